"""How the judge is compiled: few big units, as every level of calls is optimised again with all that it calls.

None of it makes arrays: without counts of references there is half as much to compile. Memory is handed in.
"""

from __future__ import annotations

from typing import Any

import numba as nb

from drivetrain.compiled_parts import CompiledLoop, CompiledPart, CompiledWhole

_njit: Any = nb.njit  # whose annotations do not know all of its options
_ALL = {"error_model": "numpy", "nogil": True, "_nrt": False, "pipeline_class": CompiledWhole}
_INSIDE = {**_ALL, "no_cpython_wrapper": True, "no_cfunc_wrapper": True, "pipeline_class": CompiledPart}

STEPS = tuple(
    f"drivetrain.{step}"
    for step in (
        "sizing.judge_kernels:compile_judge", "sizing.propagation:compile_propagate",
        "sizing.sieve_kernel:compile_sieve", "drive.heat_state:steady_state", "sizing.judge_kernels:compile_power",
        "sizing.propagation:compile_set_power", "sizing.judge_kernels:compile_judge_all",
        "sizing.judge_kernels:compile_load", "dynamics.kernels:compiled",
    )
)  # fmt: skip
"""What a search compiles, the dearest first: see ``compile_ahead.py``. Who searches begins at the other end."""

njit_entry: Any = _njit(**_ALL, cache=True)
"""Called from Python, kept on disk."""

njit_face: Any = _njit(**_ALL, cache=True, inline="always")
"""Called from Python, kept on disk; in compiled code nothing but the call that it holds."""

njit_part: Any = _njit(**_ALL, inline="always")
"""Compiled as a part of whoever uses it, which should be one: what takes a whole task has two hundred arguments."""

njit_leaf: Any = _njit(**_INSIDE)
"""Compiled once for all in compiled code that use it."""

njit_loop: Any = _njit(**{**_INSIDE, "pipeline_class": CompiledLoop}, fastmath={"contract", "reassoc", "nsz"})
"""The same for loops over samples, where sums may be taken in another order; NaN is respected."""

njit_unit: Any = _njit(**_ALL, cache=True, no_cpython_wrapper=True, no_cfunc_wrapper=True)
"""Called by its address (``units.py``), kept on disk."""
