"""Motions over time and the duty cycle they make."""
