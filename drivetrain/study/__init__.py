"""The study file, the only door through which files come in."""
