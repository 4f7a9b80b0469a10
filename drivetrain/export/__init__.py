"""Arms and drives written out for other tools: each format in a file of its own."""
