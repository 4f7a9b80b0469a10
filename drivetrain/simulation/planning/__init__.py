"""From a scene to a plan: mechanics, who needs whom, the memory of a run."""
