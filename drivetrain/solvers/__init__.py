"""Steppers for y' = f(t, y) behind one interface, and the loop that drives them."""
