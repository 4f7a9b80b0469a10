"""Motions that follow from forces: what is simulated, and what is recorded of it."""
