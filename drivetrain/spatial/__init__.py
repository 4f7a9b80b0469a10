"""Rigid-body algebra: rotations, poses, wrenches, inertia."""
