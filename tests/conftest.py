"""For all tests."""

import os

# The matrices here are small: threads of a linear algebra library only stand in each other's way, eight times the work.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from hypothesis import settings  # after the line above: it may import numpy

settings.register_profile("same each time", derandomize=True, deadline=None, database=None)
settings.load_profile("same each time")
