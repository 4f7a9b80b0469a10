"""Held arms over time against closed forms; a hundred thousand steps of one stand among the hard cases."""

from __future__ import annotations

import math

import numpy as np
import pytest
from four_bar import four_bar
from round_surface import Sphere
from scipy.special import ellipk

from drivetrain.arm.arm import Arm
from drivetrain.arm.files.load import load_arm
from drivetrain.arm.geared import with_rotors
from drivetrain.arm.kinematics import tip_pose
from drivetrain.arm.rotors import Rotor
from drivetrain.dynamics.constraints import (
    Attachment,
    CallableConstraint,
    ClosingJoint,
    LoopClosure,
    PointOnSurface,
)
from drivetrain.errors import InputError
from drivetrain.simulation.constrained import Baumgarte, Drifting, Projection, Stabilisation, simulate_constrained
from drivetrain.solvers.solver import DormandPrince853, RungeKutta4, SemiImplicitEuler, Solver


@pytest.mark.parametrize(
    ("how", "solver", "least", "most"),
    [
        (Projection(), RungeKutta4(2e-3), 0.0, 1e-11),
        (Projection(1e-9), DormandPrince853(1e-9, 1e-11), 0.0, 2e-9),
        (Baumgarte(20.0), RungeKutta4(2e-3), 1e-12, 1e-7),
        (Baumgarte(20.0), DormandPrince853(1e-9, 1e-11), 1e-14, 1e-7),
        (Drifting(), RungeKutta4(2e-3), 1e-7, 1e-3),
        (Drifting(), SemiImplicitEuler(2e-3), 1e-3, 1.0),
    ],
    ids=str,
)
def test_ways_to_stabilise(how: Stabilisation, solver: Solver, least: float, most: float) -> None:
    arm, loop, q = four_bar()
    recording = simulate_constrained(arm, loop, q, np.zeros(3), 6.0, solver=solver, stabilisation=how)
    assert least <= recording["constraint_error"].max() <= most
    assert (recording.counters["restarts"] > 0) == isinstance(how, Projection)


def test_point_on_a_circle_is_a_pendulum() -> None:
    """Two rails, the first carriage without mass: the period of the elliptic integral, and the force of the circle."""
    screws = [[0, 0, 0, 1, 0, 0], [0, 0, 0, 0, 0, 1.0]]
    arm = Arm.from_screws(np.tile(np.eye(4), (2, 1, 1)), screws, [0.0, 3.0], np.zeros((2, 3, 3)))
    radius, swing = 0.7, 2.0
    circle = PointOnSurface(Attachment.tip(arm), Sphere(np.zeros(3), radius))
    period = 4.0 * math.sqrt(radius / 9.81) * ellipk(math.sin(0.5 * swing) ** 2)
    start = radius * np.array([math.sin(swing), -math.cos(swing)])
    recording = simulate_constrained(arm, circle, start, [0.0, 0.0], 2.0 * period, interval=period / 4.0)
    x, z = recording["joint_1.position"], recording["joint_2.position"]
    np.testing.assert_allclose(x[::4], start[0], atol=1e-8)
    np.testing.assert_allclose(x[2::4], -start[0], atol=1e-8)
    np.testing.assert_allclose(z[1::2], -radius, atol=1e-8)
    # At the bottom m g + m v^2 / r = m g (3 - 2 cos swing); at the turn m g cos swing.
    bottom = 3.0 * 9.81 * (3.0 - 2.0 * math.cos(swing))
    np.testing.assert_allclose(recording["constraint_1.multiplier_1"][1::2], bottom, rtol=1e-7)
    np.testing.assert_allclose(recording["constraint_1.multiplier_1"][::4], 3.0 * 9.81 * math.cos(swing), rtol=1e-6)
    assert recording.unit("constraint_1.multiplier_1") == "N"


@pytest.mark.parametrize("how", [Projection(), Baumgarte(5.0)], ids=repr)
def test_skate_on_a_slope(how: Stabilisation) -> None:
    """A knife edge that spins evenly on a slope does not slide down it: a cycloid across (nonholonomic)."""
    screws = [[0, 0, 0, 1, 0, 0], [0, 0, 0, 0, 1, 0], [0, 0, 1.0, 0, 0, 0]]
    inertias = [np.zeros((3, 3)), np.zeros((3, 3)), 0.1 * np.eye(3)]
    slope, spin = 3.0, 2.0  # m/s^2 along x, rad/s
    arm = Arm.from_screws(np.tile(np.eye(4), (3, 1, 1)), screws, [0.0, 0.0, 2.0], inertias, None, (slope, 0.0, 0.0))
    blade = CallableConstraint(
        lambda q: [[-math.sin(q[2]), math.cos(q[2]), 0.0]],
        lambda q, qd: [-qd[2] * (math.cos(q[2]) * qd[0] + math.sin(q[2]) * qd[1])],
        1,
    )
    recording = simulate_constrained(arm, blade, np.zeros(3), [0.0, 0.0, spin], 4.0, stabilisation=how)
    angle = spin * recording.time
    size = slope / (2.0 * spin**2)
    np.testing.assert_allclose(recording["joint_1.position"], size * np.sin(angle) ** 2, atol=1e-9)
    np.testing.assert_allclose(recording["joint_2.position"], size * (angle - 0.5 * np.sin(2.0 * angle)), atol=1e-9)
    assert recording["constraint_speed"].max() < 1e-10
    assert np.abs(recording["energy_error"]).max() < 1e-8


def test_geared_arm_that_holds_a_door() -> None:
    """Six joints, five rows, full rotors; closed within rounding, and no energy made."""
    bare = load_arm("ur5-corrected")
    arm = with_rotors(bare, [Rotor(100.0, 6e-5, 0.3)] * 3 + [Rotor(-80.0, 8e-6, 0.1)] * 3)
    q = np.array([0.3, -1.2, 1.5, -0.6, -1.2, 0.4])
    hinge = tip_pose(arm, q)
    hinge[:3, :3] = np.eye(3)
    hinge[:3, 3] += [0.3, 0.5, 0.0]
    door = LoopClosure(Attachment.at(arm, 5, q, hinge), Attachment.base(hinge), ClosingJoint.HINGE)

    def push(t: float, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
        return np.array([20.0, 0.0, 0.0, 0.0, 0.0, 0.0])

    recording = simulate_constrained(arm, door, q, np.zeros(6), 1.0, torque=push)
    assert recording.stopped_by is None
    assert recording["constraint_error"].max() < 1e-11
    assert np.abs(recording["energy_error"]).max() < 1e-7
    assert np.abs(recording["work"]).max() > 0.1
    assert (recording["rank"] == 5.0).all()


def test_start_that_is_off_is_mended_and_told() -> None:
    arm, loop, q = four_bar()
    recording = simulate_constrained(arm, loop, q + np.array([0.1, 0.0, 0.0]), [1.0, 0.0, 0.0], 0.1)
    assert recording.events[0].name == "start"
    assert recording["constraint_error"][0] < 1e-11
    assert recording["constraint_speed"][0] < 1e-11
    assert simulate_constrained(arm, loop, q, np.zeros(3), 0.1).events == ()
    far = np.eye(4)
    far[0, 3] = 9.0
    with pytest.raises(InputError, match="no position near"):
        simulate_constrained(arm, LoopClosure(Attachment.tip(arm), Attachment.base(far), ClosingJoint.BALL), q, q, 0.1)


def test_divergence_is_told() -> None:
    arm, loop, q = four_bar()
    recording = simulate_constrained(arm, loop, q, [1.0, 0, 0], 5.0, stabilisation=Baumgarte(1e5))
    assert recording.stopped_by is not None
    assert recording.stopped_by.name == "diverged"
    assert np.isfinite(recording["energy_error"]).all()


def test_wrong_input() -> None:
    for kind in (Projection, Baumgarte):
        with pytest.raises(InputError, match="positive"):
            kind(0.0)
    arm, loop, q = four_bar()
    with pytest.raises(InputError, match="duration"):
        simulate_constrained(arm, loop, q, q, 0.0)
