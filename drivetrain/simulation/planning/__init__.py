"""From a scene to a plan: mechanics, order of the effects by their signals, and the memory of a run."""
