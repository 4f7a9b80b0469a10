"""The arm as data, and the files it comes from."""
