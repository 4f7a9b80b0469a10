"""What runs in the loop of a real controller: currents tick by tick, in Python and in C."""
