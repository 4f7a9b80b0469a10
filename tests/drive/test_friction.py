from __future__ import annotations

import numpy as np
import pytest

from drivetrain.drive.friction import Friction, book_curves, breakaway_torque, friction_torque
from drivetrain.errors import InputError

SPEED = np.array([-40.0, -3.0, -0.2, 0.0, 0.2, 3.0, 40.0])
SIGN = np.array([-1.0, -1.0, -1.0, 0.0, 1.0, 1.0, 1.0])

# The six curves of figure 8.13, written out one by one instead of as one family.
CURVES = {
    "a": (Friction(viscous=0.1), 0.1 * SPEED, 0.0),
    "b": (Friction(coulomb=2.0), 2.0 * SIGN, 2.0),
    "c": (Friction(coulomb=2.0, viscous=0.1), 2.0 * SIGN + 0.1 * SPEED, 2.0),
    "d": (Friction(coulomb=2.0, static=3.0), 2.0 * SIGN, 3.0),
    "e": (Friction(coulomb=2.0, static=3.0, viscous=0.1), 2.0 * SIGN + 0.1 * SPEED, 3.0),
    "f": (
        Friction(coulomb=2.0, static=3.0, viscous=0.1, stribeck_speed=0.5),
        (2.0 + np.exp(-((SPEED / 0.5) ** 2))) * SIGN + 0.1 * SPEED,
        3.0,
    ),
}


@pytest.mark.parametrize("curve", CURVES)
def test_each_curve_of_figure_8_13(curve: str) -> None:
    friction, expected, breakaway = CURVES[curve]
    np.testing.assert_allclose(friction_torque(friction, SPEED), expected, rtol=1e-15)
    np.testing.assert_array_equal(breakaway_torque(friction, np.array([-2.0, 0.0, 1e-9])), [-breakaway, 0.0, breakaway])


def test_stribeck_falls_at_low_speed_and_rises_again() -> None:
    friction = CURVES["f"][0]
    torque = friction_torque(friction, np.array([1e-9, 0.5, 1.2, 40.0]))
    assert torque[0] == pytest.approx(3.0, rel=1e-9)
    assert torque[1] == pytest.approx(2.0 + 1.0 / np.e + 0.05, rel=1e-14)
    assert torque[0] > torque[1] > torque[2] < torque[3]


def test_directions_may_differ() -> None:
    friction = Friction(coulomb=1.0, coulomb_negative=4.0, viscous=0.5, viscous_negative=0.25)
    np.testing.assert_allclose(friction_torque(friction, np.array([2.0, -2.0])), [2.0, -4.5])
    np.testing.assert_array_equal(breakaway_torque(friction, np.array([7.0, -1e-9])), [1.0, -4.0])


@pytest.mark.parametrize("exponent", [0.5, 1.0, 2.0])
def test_the_fall_behind_breakaway_has_the_stated_exponent(exponent: float) -> None:
    friction = Friction(1.0, 2.0, static=2.5, stribeck_speed=0.3, stribeck_exponent=exponent)
    speed = np.array([-0.9, -0.1, 0.05, 0.3, 1.2])
    kinetic = np.where(speed > 0.0, 1.0, -2.0)
    fall = np.exp(-((np.abs(speed) / 0.3) ** exponent))
    expected = kinetic + (np.sign(speed) * 2.5 - kinetic) * fall
    np.testing.assert_allclose(friction_torque(friction, speed), expected, rtol=1e-12)


def test_friction_never_makes_power() -> None:
    rng = np.random.default_rng(1)
    friction = Friction(1.0, 2.0, 0.1, 0.2, static=2.5, stribeck_speed=0.3, stribeck_exponent=1.0)
    speed = rng.normal(size=200) * 3.0
    assert (friction_torque(friction, speed) * speed > 0.0).all()


def test_a_scalar_and_any_shape() -> None:
    friction = Friction(coulomb=1.0)
    assert float(friction_torque(friction, np.float64(-3.0))) == -1.0
    assert friction_torque(friction, np.ones((2, 3))).shape == (2, 3)


def test_all_faults_at_once() -> None:
    with pytest.raises(InputError) as caught:
        Friction(coulomb=-1.0, viscous=float("nan"), stribeck_speed=0.0)
    assert [fault.place for fault in caught.value.faults] == [
        "friction.coulomb",
        "friction.viscous",
        "friction.stribeck_speed",
    ]
    with pytest.raises(InputError, match="static"):
        Friction(coulomb=1.0, coulomb_negative=3.0, static=2.0)


def test_the_books_curves_by_their_letters() -> None:
    curves = book_curves(static=3.0, kinetic=2.0, viscous=0.1, stribeck_speed=0.5)
    assert list(curves) == list("abcdef")
    for letter in "adef":
        assert curves[letter] == CURVES[letter][0]
    # In (b) and (c) the one friction torque is the static one.
    for letter in "bc":
        assert curves[letter] == Friction(coulomb=3.0, viscous=CURVES[letter][0].viscous)
        np.testing.assert_array_equal(breakaway_torque(curves[letter], np.array([-1.0, 1.0])), [-3.0, 3.0])
    with pytest.raises(InputError, match="static"):
        book_curves(static=1.0, kinetic=2.0, viscous=0.0, stribeck_speed=0.5)


def test_a_stribeck_speed_without_static_torque_is_refused() -> None:
    with pytest.raises(InputError, match=r"friction\.stribeck_speed: says nothing without static"):
        Friction(coulomb=1.0, stribeck_speed=0.5)
