"""Reports: figures, page, files, the only door through which results go out."""
