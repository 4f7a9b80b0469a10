"""Pictures as data, and what draws them: BokehJS on a page, matplotlib elsewhere."""
