"""The Pareto front of several criteria: every set of drives that no other beats in all of them, with its proof."""
