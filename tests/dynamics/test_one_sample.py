"""Kernels for a single sample, compiled from the same laws, against batches, and refused input."""

from __future__ import annotations

import numpy as np
import pytest
from random_arms import EVERY_JOINT, error, motion, random_arm, rotors_of

import drivetrain as dt
from drivetrain.arm.arm import Arm
from drivetrain.errors import InputError

# Rounding of the same sums in another order; for accelerations times the condition number of the mass matrix.
TOLERANCE, BY_MATRIX = 1e-12, 1e-8


def arm_of(kind: str | None, joints: str = EVERY_JOINT) -> Arm:
    arm = random_arm(3, joints)
    return arm if kind is None else dt.with_rotors(arm, rotors_of(3, kind, arm.n))


@pytest.mark.parametrize("kind", [None, "coaxial", "balanced", "unbalanced", "mixed"])
@pytest.mark.parametrize("joints", [EVERY_JOINT, "RRRRRR", "P"])
@pytest.mark.parametrize("pressed", [False, True])
def test_one_sample_is_that_of_the_batch(joints: str, kind: str | None, pressed: bool) -> None:
    arm = arm_of(kind, joints)
    q, qd, x = motion(4, arm.n, 3)
    tip = np.random.default_rng(4).normal(size=(3, 6)) * 20 if pressed else None
    for k in range(3):
        one = (arm, q[k], qd[k], x[k])
        press = None if tip is None else tip[k]
        wanted = dt.inverse_dynamics(arm, q, qd, x, tip_wrench=tip)[k]
        assert error(dt.inverse_dynamics(*one, tip_wrench=press), wanted) < TOLERANCE
        wanted = dt.forward_dynamics(arm, q, qd, x, tip_wrench=tip)[k]
        assert error(dt.forward_dynamics(*one, tip_wrench=press), wanted) < BY_MATRIX
        found = dt.inverse_dynamics_derivatives(*one, tip_wrench=press)
        many = dt.inverse_dynamics_derivatives(arm, q, qd, x, tip_wrench=tip)
        for name in ("q", "qd", "qdd"):
            assert error(getattr(found, name), getattr(many, name)[k]) < TOLERANCE
        assert error(dt.coriolis_matrix(arm, q[k], qd[k]), dt.coriolis_matrix(arm, q, qd)[k]) < TOLERANCE


CALLS = {"inverse_dynamics": 3, "forward_dynamics": 3, "coriolis_matrix": 2, "closed_form": 2}


@pytest.mark.parametrize("name", CALLS)
@pytest.mark.parametrize("value", [np.nan, np.inf, 1e200])
def test_what_a_batch_refuses_one_sample_refuses_in_the_same_words(name: str, value: float) -> None:
    arm, call = arm_of("coaxial"), getattr(dt, name)
    for spoiled in range(CALLS[name]):
        given = np.zeros((CALLS[name], arm.n))
        given[spoiled, 1] = value
        with pytest.raises(InputError) as one:
            call(arm, *given)
        with pytest.raises(InputError) as many:
            call(arm, *given[:, None])
        assert str(one.value).replace("[0, 1]", "[1]") == str(many.value).replace("[0, 1]", "[1]")


@pytest.mark.parametrize("name", CALLS)
def test_any_kind_of_numbers_gives_the_same(name: str) -> None:
    """Lists, integers, strided arrays, and read-only arrays."""
    arm, call = arm_of("coaxial"), getattr(dt, name)
    given = np.random.default_rng(0).integers(-2, 3, (CALLS[name], arm.n))
    first = lambda found: getattr(found, "mass", found)  # noqa: E731
    wanted = first(call(arm, *given.astype(float)))
    locked = given.astype(float)
    locked.setflags(write=False)
    strided = np.repeat(given.astype(float), 2, axis=1)[:, ::2]
    for same in (given, given.tolist(), locked, strided, given.astype(np.float32)):
        assert error(first(call(arm, *same)), wanted) < BY_MATRIX


def test_results_are_not_shared() -> None:
    arm = arm_of("coaxial")
    q, qd, x = motion(6, arm.n, 2)
    for call in (dt.inverse_dynamics, dt.forward_dynamics):
        first = call(arm, q[0], qd[0], x[0])
        kept = first.copy()
        call(arm, q[1], qd[1], x[1])
        np.testing.assert_array_equal(first, kept)


@pytest.mark.parametrize("masses", [[1.0, 0.0], [0.0, 1.0]])
def test_a_joint_that_moves_nothing_is_named_as_in_a_batch(masses: list[float]) -> None:
    """A link without inertia, or two joints that turn one body about one axis: M is singular."""
    arm = Arm.from_screws(
        np.tile(np.eye(4), (2, 1, 1)), [[0, 0, 1, 0, 0, 0]] * 2, masses, [mass * np.eye(3) for mass in masses]
    )
    still = np.zeros(2)
    with pytest.raises(InputError, match="moves no inertia") as one:
        dt.forward_dynamics(arm, still, still, still)
    with pytest.raises(InputError) as many:
        dt.forward_dynamics(arm, *np.zeros((3, 1, 2)))
    assert str(one.value) == str(many.value).replace(" at sample 0", "")
