"""Branch and bound search for the best sets of drives of the whole arm, with a proof of optimality."""
