"""Functions of samples of the joints, all alike: a batch is its samples, none are none, and faults are named."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from random_arms import error, motion, random_arm, rotors_of

import drivetrain as dt
from drivetrain.arm.kinematics import (
    body_jacobian,
    link_poses,
    skeleton,
    space_jacobian,
    tip_acceleration_terms,
    tip_jacobian,
)
from drivetrain.dynamics.book.closed_form import closed_form_torque
from drivetrain.dynamics.derivatives import forward_dynamics_derivatives
from drivetrain.dynamics.forward import articulated_body
from drivetrain.dynamics.inverse import joint_loads
from drivetrain.dynamics.regressor import torque_regressor

NAMES = ("q", "qd", "qdd")
SOLVING = (dt.forward_dynamics, articulated_body, forward_dynamics_derivatives)  # the third argument is tau
ELLIPSOIDS = (dt.torque_ellipsoid, dt.acceleration_ellipsoid, dt.tip_acceleration_ellipsoid, dt.tip_force_ellipsoid)
OF_POSITIONS = (
    dt.mass_matrix, dt.gravity_torque, dt.potential_energy, dt.christoffel_symbols, link_poses, dt.tip_pose,
    space_jacobian, body_jacobian, tip_jacobian, skeleton, *ELLIPSOIDS,
)  # fmt: skip
OF_SPEEDS = (
    dt.coriolis_matrix, dt.velocity_torque, dt.bias_torque, dt.kinetic_energy, dt.closed_form, dt.mass_matrix_rate,
    tip_acceleration_terms,
)  # fmt: skip
OF_ACCELERATIONS = (
    dt.inverse_dynamics, dt.drive_torques, joint_loads, dt.power_balance, closed_form_torque,
    dt.inverse_dynamics_derivatives, torque_regressor, *SOLVING,
)  # fmt: skip
TAKING = {**dict.fromkeys(OF_POSITIONS, 1), **dict.fromkeys(OF_SPEEDS, 2), **dict.fromkeys(OF_ACCELERATIONS, 3)}
PRESSED = (dt.inverse_dynamics, dt.power_balance, closed_form_torque, dt.bias_torque, *SOLVING[:2])

every = pytest.mark.parametrize("function", TAKING, ids=lambda function: function.__name__)


def arm() -> dt.Arm:
    return dt.with_rotors(random_arm(3), rotors_of(3, "mixed", 6))


def arrays(found: Any) -> list[np.ndarray]:
    """The arrays of a result: itself, or those of its fields."""
    if dataclasses.is_dataclass(found):
        parts = [getattr(found, field.name) for field in dataclasses.fields(found)]
    else:
        parts = list(found) if isinstance(found, tuple) else [found]
    return [np.asarray(part) for part in parts if isinstance(part, float | np.ndarray)]


@every
@pytest.mark.parametrize("count", [1, 65, 130])
def test_a_batch_is_its_samples(function: Callable[..., Any], count: int) -> None:
    """Rounding of the same sums in another order; for what solves with it, times the condition of the mass matrix."""
    given, tip = motion(4, 6, count)[: TAKING[function]], np.random.default_rng(1).normal(size=(count, 6))
    within = 1e-8 if function in (*SOLVING, *ELLIPSOIDS) else 1e-11
    for pressed in (False, True)[: 1 + (function in PRESSED)]:
        many = arrays(function(arm(), *given, **({"tip_wrench": tip} if pressed else {})))
        assert many
        for k in (0, count // 2, count - 1):
            one = arrays(
                function(arm(), *(values[k] for values in given), **({"tip_wrench": tip[k]} if pressed else {}))
            )
            assert [part.shape for part in one] == [part.shape[1:] for part in many]
            assert all(error(mine, all_of[k]) < within for mine, all_of in zip(one, many, strict=True))


@every
def test_no_samples(function: Callable[..., Any]) -> None:
    empty, one = (arrays(function(arm(), *np.zeros((3, count, 6))[: TAKING[function]])) for count in (0, 1))
    assert [part.shape for part in empty] == [(0, *part.shape[1:]) for part in one]


@every
def test_what_is_no_sample_is_named(function: Callable[..., Any]) -> None:
    taking = TAKING[function]
    for at, name in enumerate((*NAMES[:2], "tau") if function in SOLVING else NAMES[:taking]):
        for wrong, told in (
            (np.zeros((2, 5)), name), (np.full((2, 6), "fast"), name), (np.zeros((3, 6)), name if at else "qd|q"),
        )[: 2 + (taking > 1)]:  # fmt: skip
            given: list[Any] = [np.zeros((2, 6))] * taking
            given[at] = wrong
            with pytest.raises(dt.InputError, match=told):
                function(arm(), *given)
        for value in (np.nan, np.inf):
            spoiled = np.zeros((taking, 2, 6))
            spoiled[at, 1, 2] = value
            with pytest.raises(dt.InputError) as caught:
                function(arm(), *spoiled)
            assert [fault.place for fault in caught.value.faults] == [f"{name}[1, 2]"]
    if function in PRESSED:
        for wrong in (np.zeros(5), np.zeros((3, 6)), [0, 0, np.nan, 0, 0, 0]):
            with pytest.raises(dt.InputError, match="tip_wrench"):
                function(arm(), *np.zeros((taking, 2, 6)), tip_wrench=wrong)


@pytest.mark.parametrize(
    "layout", [np.asfortranarray, np.ndarray.tolist, lambda values: np.repeat(values, 2, 1)[:, ::2]]
)
def test_any_layout_of_numbers(layout: Callable[[np.ndarray], Any]) -> None:
    given = motion(23, 6, 70)
    wanted = dt.inverse_dynamics(arm(), *given)
    np.testing.assert_array_equal(dt.inverse_dynamics(arm(), *map(layout, given)), wanted)
    for values in given:
        values.setflags(write=False)
    np.testing.assert_array_equal(dt.inverse_dynamics(arm(), *given), wanted)


@pytest.mark.parametrize("size", [1.0, 1e3, 9.9e5, 1.1e6, 1e9])
@pytest.mark.parametrize(
    "function",
    [dt.inverse_dynamics, dt.inverse_dynamics_derivatives, dt.mass_matrix, dt.coriolis_matrix, dt.closed_form],
)
def test_angles_far_from_zero(function: Callable[..., Any], size: float) -> None:
    """The reference angle is from numpy's sine and cosine, since whole turns are not exact in binary."""
    bare, (_, *rates) = random_arm(26), motion(26, 6, 70)
    q = np.random.default_rng(26).uniform(-size, size, (70, 6))
    near = np.arctan2(np.sin(q), np.cos(q))
    for rows in (slice(None), 3):
        given = [values[rows] for values in rates[: TAKING[function] - 1]]
        far, wanted = (arrays(function(bare, angle[rows], *given)) for angle in (q, near))
        # An error of 1e-15 of the reduced angle, followed by some hundred operations.
        assert all(error(mine, other) < 1e-13 for mine, other in zip(far, wanted, strict=True))
