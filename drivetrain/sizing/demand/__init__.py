"""What the motions ask of every joint."""
