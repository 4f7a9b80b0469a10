"""How the judge is compiled: few big units, as every level of calls is optimised again with all that it calls.

None of it makes arrays: without counts of references there is half as much to compile. Memory is handed in.
"""

from __future__ import annotations

from typing import Any

import numba

from drivetrain.jit import kernel, law

njit_entry: Any = kernel
"""Called from Python, kept on disk."""

njit_face: Any = kernel(inline="always")
"""Called from Python, kept on disk; in compiled code nothing but the call that it holds."""

njit_part: Any = numba.njit(inline="always", error_model="numpy", nogil=True)
"""Compiled as a part of whoever uses it, which should be one: what takes a whole task has two hundred arguments."""

njit_leaf: Any = law
"""Compiled once for all in compiled code that use it."""

njit_loop: Any = law(fastmath={"contract", "reassoc", "nsz"})
"""The same for loops over samples, where sums may be taken in another order; NaN is respected."""

njit_unit: Any = kernel
"""Called by its address (``units.py``), kept on disk."""
