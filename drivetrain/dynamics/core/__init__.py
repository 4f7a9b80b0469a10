"""Compiled kernels of the dynamics, on records with named fields."""
