"""Effects: one physical effect a file, each knowing nothing of the others."""
