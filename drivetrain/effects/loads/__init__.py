"""Loads: payload, contact with walls, counterbalances, and torques given over time."""
