"""Evaluates the drives of a study: required values, limits, utilisations and verdicts."""
