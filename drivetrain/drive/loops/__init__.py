"""The loops of a joint's servo: plant, design, and the exact step of the current loop."""
