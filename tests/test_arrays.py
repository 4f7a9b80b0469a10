"""Values at the doors: what is no array of numbers is told by its name."""

import numpy as np
import pytest

from drivetrain.arrays import axes_of, batch, checked_array, checked_number, checked_numbers
from drivetrain.errors import InputError


@pytest.mark.parametrize("value", [[[1.0, 2.0], [3.0]], [1.0], [[[1.0, 2.0]]], "x", None, [1.0, float("nan")]])
def test_no_sample_and_no_batch(value: object) -> None:
    with pytest.raises(InputError, match=r"^q"):
        batch(value, 2, "q")


@pytest.mark.parametrize(
    ("value", "said"),
    [
        ([1.0, 1e61], r"q\[1\]: is too large to calculate with, above 1e\+60"),
        ([-1e300, 1.0], r"q\[0\]: is too large"),
        ([1e300, float("inf")], r"q\[1\]: must be finite"),
        ([1.0, 2.0 + 1.0j], "must be numbers of shape"),
        (np.array([1.0, 2.0], dtype=complex), "must be numbers of shape"),
        ([1.0, 10**400], "must be numbers of shape"),
    ],
)
def test_numbers_that_cannot_be_calculated_with(value: object, said: str) -> None:
    with pytest.raises(InputError, match=said):
        checked_array(value, (2,), "q")


def test_floats_are_not_copied() -> None:
    values = np.array([1.0, 2.0])
    assert checked_array(values, (2,), "q") is values
    assert checked_array([], (0,), "q").shape == (0,)


def test_numbers_and_their_ranges() -> None:
    assert checked_number("3", "mass", "kg", above=0.0) == 3.0
    assert checked_number(0, "mass", "kg", least=0.0) == 0.0
    with pytest.raises(InputError) as error:
        checked_numbers({"mass": (0.0, "kg"), "length": (float("nan"), "m"), "width": (2.0, "m")}, above=0.0)
    assert [fault.place for fault in error.value.faults] == ["mass", "length"]
    with pytest.raises(InputError, match=r"at least 0 \[kg\]"):
        checked_number(-1e-300, "mass", "kg", least=0.0)


def test_axes() -> None:
    assert [axes_of(value) for value in (1.0, [1.0], np.eye(2), [[1.0], [1.0, 2.0]], None)] == [0, 1, 2, -1, 0]
