"""The engines: inverse, fixed step, adaptive step; and where a run begins."""
