"""The gear: its drag and mesh loss, play, and its spring."""
