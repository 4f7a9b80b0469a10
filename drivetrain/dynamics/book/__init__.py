"""What the chapter shows beside the algorithms that the package runs on."""
