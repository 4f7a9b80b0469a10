"""Algorithms on an arm: kinematics, inverse and forward dynamics."""
