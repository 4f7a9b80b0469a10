"""Agreement with Lagrange's equations in letters, for small arms with every kind of rotor, at every level."""

from __future__ import annotations

import numpy as np
import pytest
from random_arms import balanced_rotor, coaxial_rotor, error, motion, random_arm, unbalanced_rotor

from drivetrain.arm.geared import at_level, with_rotors
from drivetrain.arm.rotors import RotorLevel
from drivetrain.dynamics.book.symbolic import symbolic_dynamics
from drivetrain.dynamics.inverse import inverse_dynamics

# Sympy keeps 15 digits of each constant, and rotors turn 100 times faster than the joints.
TOLERANCE = 1e-10


@pytest.mark.parametrize("joints", ["R", "P", "H", "RR", "PR", "RH"])
def test_without_rotors(joints: str) -> None:
    check(random_arm(11, joints))


@pytest.mark.parametrize("joints", ["R", "P", "RR", "RP", "HR"])
def test_with_coaxial_rotors(joints: str) -> None:
    rng = np.random.default_rng(12)
    check(with_rotors(random_arm(12, joints), [coaxial_rotor(rng) for _ in joints]))


@pytest.mark.parametrize(("joints", "carriers"), [("R", (-1,)), ("R", (0,)), ("RR", (-1, 0)), ("RP", (1, 1))])
def test_with_balanced_rotors_on_any_link(joints: str, carriers: tuple[int, ...]) -> None:
    rng = np.random.default_rng(13)
    check(with_rotors(random_arm(13, joints), [balanced_rotor(rng, c) for c in carriers]))


@pytest.mark.parametrize(("joints", "carriers"), [("R", (-1,)), ("R", (0,)), ("RR", (1, 0)), ("PR", (0, -1))])
def test_with_unbalanced_rotors_on_any_link(joints: str, carriers: tuple[int, ...]) -> None:
    rng = np.random.default_rng(14)
    check(with_rotors(random_arm(14, joints), [unbalanced_rotor(rng, c) for c in carriers]))


@pytest.mark.parametrize("level", [RotorLevel.NONE, RotorLevel.REFLECTED])
def test_lesser_levels(level: RotorLevel) -> None:
    rng = np.random.default_rng(17)
    rotors = [unbalanced_rotor(rng, 1), balanced_rotor(rng, -1)]
    check(at_level(with_rotors(random_arm(17, "RP"), rotors), level))


def test_three_joints() -> None:
    rng = np.random.default_rng(15)
    arm = with_rotors(random_arm(15, "RRR"), [coaxial_rotor(rng), unbalanced_rotor(rng, 1), None])
    check(arm, count=2)


def check(arm: object, count: int = 4) -> None:
    wanted = symbolic_dynamics(arm, simplify=False).torque_function()
    q, qd, qdd = motion(16, arm.n, count)
    for sample in zip(q, qd, qdd, strict=True):
        assert error(inverse_dynamics(arm, *sample), wanted(*sample)) < TOLERANCE
