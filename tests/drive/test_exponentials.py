"""The functions of exact steps against many digits, and what is compiled into others."""

from __future__ import annotations

import mpmath as mp
import numpy as np
import pytest

from drivetrain.drive.thermal.exponentials import first, second


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_against_many_digits(sign: float) -> None:
    for x in sign * np.array([0.0, *10.0 ** np.linspace(-300, 2.5, 200), 0.0499999, 0.05, 0.0500001]):
        with mp.workdps(700):
            exact = mp.mpf(float(x))
            one = mp.expm1(exact) / exact if x else mp.mpf(1)
            two = (one - 1) / exact if x else mp.mpf(0.5)
        assert first(x) == pytest.approx(float(one), rel=1e-15)
        # Its difference of nearly equal numbers starts at x = 0.05, where it costs a digit and a half.
        assert second(x, first(x)) == pytest.approx(float(two), rel=1e-14)
