"""The motor electrically: winding, current and its loops, supply, heat; and what spins."""
