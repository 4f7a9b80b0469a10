"""Values at the doors: what is no array of numbers is told by its name."""

import pytest

from drivetrain.arrays import batch
from drivetrain.errors import InputError


@pytest.mark.parametrize("value", [[[1.0, 2.0], [3.0]], [1.0], [[[1.0, 2.0]]], "x", None, [1.0, float("nan")]])
def test_no_sample_and_no_batch(value: object) -> None:
    with pytest.raises(InputError, match=r"^q"):
        batch(value, 2, "q")
