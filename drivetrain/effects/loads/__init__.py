"""What the surroundings do: payload, walls, torques that are given."""
