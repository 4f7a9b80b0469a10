"""What accuracy costs in time: effects, solvers, and the cheapest scene that is good enough."""
