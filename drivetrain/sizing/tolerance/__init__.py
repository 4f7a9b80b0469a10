"""Tolerances: Monte Carlo sampling, probabilities of feasibility, and sensitivities."""
