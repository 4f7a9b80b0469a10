"""Columns of ``Packed.rows``, for the simulation that has not come to records yet."""

CA, SA, PX, PY, PZ, OFFSET, MASS, HX, HY, HZ, SXX, SYY, SZZ, SXY, SXZ, SYZ = range(16)
SPIN, OWN, TURN, SLIDE, CD, SD, R0 = range(16, 23)
WIDTH = R0 + 9
