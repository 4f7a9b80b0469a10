"""Array types, and checks of arrays and numbers given by users."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetrain.errors import LARGEST, Fault, Faults, InputError

Array = np.ndarray[tuple[Any, ...], np.dtype[np.float64]]
Mask = NDArray[np.bool_]
Indices = NDArray[np.int64]


def frozen_array(value: Any, shape: Sequence[int | None], name: str) -> Array:
    """A read-only float copy of a value, after checking its shape and numbers."""
    return read_only(checked_array(value, shape, name).copy())


def read_only(values: Any) -> Any:
    """The same array, made read-only."""
    array = np.asarray(values)
    array.setflags(write=False)
    return array


def checked_array(value: Any, shape: Sequence[int | None], name: str) -> Array:
    """A value as a float array (not copied if it is one already), after checking its shape and numbers.

    ``shape`` has None for axes of any length.
    """
    try:
        array = real_array(value)
    except (TypeError, ValueError, OverflowError):
        raise InputError(Fault(name, f"must be numbers of shape {_shape_text(shape)}", value)) from None
    fits = array.ndim == len(shape) and all(w is None or w == s for w, s in zip(shape, array.shape, strict=True))
    if not fits and not shape:
        raise InputError(Fault(name, "must be one number", value))
    if not fits:
        raise InputError(Fault(name, f"must have shape {_shape_text(shape)}", array.shape))
    if not within_reach(array):
        finite = np.isfinite(array)
        bad = tuple(int(i) for i in np.argwhere(~finite if not finite.all() else np.abs(array) > LARGEST)[0])
        problem = "must be finite" if not finite.all() else f"is too large to calculate with, above {LARGEST:g}"
        raise InputError(Fault(f"{name}{list(bad) if bad else ''}", problem, float(array[bad])))
    return array


def _shape_text(shape: Sequence[int | None]) -> str:
    sizes = ["N" if size is None else str(size) for size in shape]
    return f"({sizes[0]},)" if len(sizes) == 1 else f"({', '.join(sizes)})"


def checked_number(value: Any, name: str, unit: str, *, above: float = -LARGEST, least: float = -LARGEST) -> float:
    """A value as a float, checked to be finite, above ``above`` and at least ``least`` [unit]."""
    number = float(checked_array(value, (), name))
    if number <= above and above > -LARGEST:
        raise InputError(Fault(name, f"must be above {above:g} [{unit}]", number))
    if number < least:
        raise InputError(Fault(name, f"must be at least {least:g} [{unit}]", number))
    return number


def checked_numbers(
    named: Mapping[str, tuple[Any, str]], *, above: float = -LARGEST, least: float = -LARGEST
) -> list[float]:
    """Several numbers with the same range; all faults are reported together."""
    faults = Faults()
    numbers = [
        faults.attempt(checked_number, value, name, unit, above=above, least=least)
        for name, (value, unit) in named.items()
    ]
    faults.raise_any()
    return [number for number in numbers if number is not None]


def axes_of(value: Any) -> int:
    """Number of axes of a value as an array."""
    try:
        return np.ndim(value)
    except ValueError:
        return -1


def real_array(value: Any) -> Array:
    """The value as contiguous float64 of any shape; raises TypeError or ValueError if it is not real numbers."""
    if isinstance(value, np.ndarray) and value.dtype == np.float64:
        return np.asarray(value, order="C")
    if np.iscomplexobj(value):
        raise TypeError("complex numbers")  # numpy would drop the imaginary part
    return np.asarray(value, dtype=np.float64, order="C")


def within_reach(array: Array) -> bool:
    """Whether all numbers are finite and small enough to calculate with."""
    # Without a temporary array; with a NaN both comparisons are false.
    return array.size == 0 or bool(array.min() >= -LARGEST and array.max() <= LARGEST)


def batch(value: Any, width: int, name: str) -> Array:
    """One sample (width,) or a batch (N, width), as a checked two-dimensional array; N = 1 for one sample."""
    try:
        shape = np.shape(value)
    except ValueError:  # rows of different lengths
        raise InputError(Fault(name, f"must be numbers of shape ({width},) or (N, {width})", value)) from None
    if len(shape) == 1:
        return checked_array(value, (width,), name)[np.newaxis]
    if len(shape) == 2:
        return checked_array(value, (None, width), name)
    raise InputError(Fault(name, f"must have shape ({width},) or (N, {width})", shape))


def samples(n: int, named: dict[str, Any]) -> list[Array]:
    """Samples as arrays of one shape, (N, n); whether they are finite is checked by the recursion."""
    try:
        arrays = [real_array(value) for value in named.values()]
    except (TypeError, ValueError, OverflowError):
        raise wrong_samples(n, named) from None
    shape = arrays[0].shape
    if len(shape) not in (1, 2) or shape[-1] != n or any(array.shape != shape for array in arrays):
        raise wrong_samples(n, named)
    # Kernels are compiled for writable arrays; read-only ones would need another compilation.
    return [(array if array.flags.writeable else array.copy()).reshape(-1, n) for array in arrays]


def finite_samples(n: int, named: dict[str, Any]) -> list[Array]:
    """As ``samples``, and checks that all numbers are finite and not too large."""
    arrays = samples(n, named)
    if not all(within_reach(array) for array in arrays):
        raise wrong_samples(n, named)
    return arrays


def wrong_samples(n: int, named: dict[str, Any]) -> InputError:
    faults = Faults()
    arrays = {name: faults.attempt(batch, value, n, name) for name, value in named.items()}
    if faults.found:
        return InputError(faults.found)
    lead, first = next(iter(named.items()))
    for name, value in named.items():
        if np.shape(value) != np.shape(first):
            faults.add(name, f"must have the shape of {lead}, {np.shape(first)}", f"shape {np.shape(value)}")
    if not faults.found:
        large = {name: float(np.abs(array).max(initial=0.0)) for name, array in arrays.items() if array is not None}
        name = max(large, key=lambda key: large[key])
        faults.add(name, "is too large to calculate with", large[name])
    return InputError(faults.found)
