"""Array types and the checks made at the doors of the package."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetrain.errors import Fault, InputError

Array = NDArray[np.float64]


def frozen_array(value: Any, shape: Sequence[int | None], name: str) -> Array:
    """A read-only float copy of a value whose shape and finiteness have been checked.

    Args:
        value: Anything numpy can turn into floats.
        shape: The wanted shape; None allows any length along that axis.
        name: What to call it in an error.

    Returns:
        The copy, not writeable.

    Raises:
        InputError: Not numeric, another shape, or a NaN or infinity in it.
    """
    array = checked_array(value, shape, name).copy()
    array.setflags(write=False)
    return array


def checked_array(value: Any, shape: Sequence[int | None], name: str) -> Array:
    """A float array (not copied when it already is one) whose shape and finiteness have been checked.

    Args:
        value: Anything numpy can turn into floats.
        shape: The wanted shape; None allows any length along that axis.
        name: What to call it in an error.

    Returns:
        The values as contiguous float64.

    Raises:
        InputError: Not numeric, another shape, or a NaN or infinity in it.
    """
    wanted = "(" + ", ".join("N" if size is None else str(size) for size in shape) + ")"
    try:
        array = np.ascontiguousarray(value, dtype=np.float64) if len(shape) else np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(Fault(name, f"must be numbers of shape {wanted}", value)) from None
    fits = array.ndim == len(shape) and all(w is None or w == s for w, s in zip(shape, array.shape, strict=True))
    if not fits:
        raise InputError(Fault(name, f"must have shape {wanted}", f"shape {array.shape}"))
    if not np.isfinite(array).all():
        bad = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise InputError(Fault(f"{name}{list(bad) if bad else ''}", "must be finite", float(array[bad])))
    return array


def batch(value: Any, width: int, name: str) -> Array:
    """One sample (width,) or a batch (N, width), as a checked two-dimensional array.

    Args:
        value: The sample or the batch.
        width: Entries a sample.
        name: What to call it in an error.

    Returns:
        The values, (N, width), N = 1 for one sample; no copy when already contiguous floats.

    Raises:
        InputError: Another shape, or a NaN or infinity in it.
    """
    try:
        shape = np.shape(value)
    except ValueError:  # rows of different lengths
        raise InputError(Fault(name, f"must be numbers of shape ({width},) or (N, {width})", value)) from None
    if len(shape) == 1:
        return checked_array(value, (width,), name)[np.newaxis]
    if len(shape) == 2:
        return checked_array(value, (None, width), name)
    raise InputError(Fault(name, f"must have shape ({width},) or (N, {width})", f"shape {shape}"))
