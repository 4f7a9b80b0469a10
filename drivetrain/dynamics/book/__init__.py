"""Topics of the chapter beyond the algorithms that the package runs on."""
