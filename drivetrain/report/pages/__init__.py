"""One file a page, the parts that pages share, and their templates."""
