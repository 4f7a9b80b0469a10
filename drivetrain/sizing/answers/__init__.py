"""What changes when one number does."""
