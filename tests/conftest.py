"""For all tests."""

import os

# The matrices here are small: threads of a linear algebra library only stand in each other's way, eight times the work.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
