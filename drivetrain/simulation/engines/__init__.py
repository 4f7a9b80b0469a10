"""The simulation engines (inverse, fixed step, adaptive step) and the initial state of a run."""
