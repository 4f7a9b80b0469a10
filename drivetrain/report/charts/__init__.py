"""Charts as data, drawn by BokehJS on a page and by matplotlib elsewhere."""
