"""Topics of the book's chapter that the package itself does not need: closed forms, ellipsoids, symbolic equations."""
