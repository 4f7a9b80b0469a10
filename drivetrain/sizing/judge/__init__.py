"""One drive at one joint held against every limit."""
