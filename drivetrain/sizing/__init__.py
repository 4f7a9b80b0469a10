"""What the task needs, whether a drive fits, which drives are best."""
