"""The HTML pages, one file each, and their shared parts."""
