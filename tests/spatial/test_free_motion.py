"""Motion of a free body: conserved quantities, closed forms, and the order of the method."""

from __future__ import annotations

import numpy as np
import pytest

from drivetrain.errors import InputError
from drivetrain.spatial.free_body import free_motion, kinetic_energy, momentum, space_momentum
from drivetrain.spatial.inertia import cuboid, cylinder
from drivetrain.spatial.poses import adjoint, inverse_pose, pose
from drivetrain.spatial.rotations import exp_rotation, is_rotation

START = pose(exp_rotation([0.4, -0.3, 0.9]), [1.0, 2.0, 3.0])


def test_tumbling_keeps_energy_and_spatial_momentum() -> None:
    """Rotation about the intermediate axis, which is unstable, with the frame not at the centre of mass."""
    inertia = cuboid(1.0, 0.1, 0.2, 0.3).seen_from(pose(exp_rotation([0.3, 0.0, 0.0]), [0.1, 0.05, -0.2]))
    g = inertia.spatial_inertia()
    twist = adjoint(pose(exp_rotation([0.3, 0.0, 0.0]), [0.1, 0.05, -0.2])) @ [0.01, 10.0, 0.0, 0.2, 0.0, 1.0]
    motion = free_motion(g, START, twist, np.linspace(0.0, 3.0, 3001))
    energy, p = kinetic_energy(g, motion.twists), space_momentum(g, motion)
    for k in (0, 1234):
        own = momentum(g, motion.twists[k])
        assert p[k] == pytest.approx(adjoint(inverse_pose(motion.poses[k])).T @ own, abs=1e-13)
    assert np.ptp(energy) / energy[0] < 1e-8  # 30 rad in steps of 0.01 rad with a method of fourth order
    assert np.abs(p - p[0]).max() / np.abs(p[0]).max() < 1e-8
    spin = (motion.twists[:, :3] @ exp_rotation([0.3, 0.0, 0.0]))[:, 1]
    assert spin.min() < -9.9 < 9.9 < spin.max()
    assert all(is_rotation(t[:3, :3], 1e-12) for t in motion.poses[::500])


def test_error_falls_with_the_fourth_power_of_the_step() -> None:
    g = cuboid(1.0, 0.1, 0.2, 0.3).spatial_inertia()
    twist = np.array([1.0, 5.0, 2.0, 0.3, 0.0, 1.0])
    ends = [free_motion(g, START, twist, np.linspace(0.0, 1.0, n + 1)).poses[-1] for n in (40, 80, 1280)]
    coarse, fine = (np.abs(end - ends[2]).max() for end in ends[:2])
    assert np.log2(coarse / fine) == pytest.approx(4.0, abs=0.3)


def test_symmetric_top_precesses_as_in_the_books() -> None:
    """Axial spin is constant, transverse spin rotates at (I3 - I1)/I1 w3, the axis precesses at |L|/I1."""
    top = cylinder(2.0, 0.3, 0.1)
    i1, i3 = top.inertia[0, 0], top.inertia[2, 2]
    w1, w3, end = 1.5, 8.0, 2.0
    motion = free_motion(top.spatial_inertia(), np.eye(4), [w1, 0, w3, 0, 0, 0], np.linspace(0.0, end, 4001))
    angle = (i3 - i1) / i1 * w3 * end
    assert motion.twists[-1, :3] == pytest.approx([w1 * np.cos(angle), w1 * np.sin(angle), w3], abs=1e-9)
    moment = np.array([i1 * w1, 0.0, i3 * w3])
    turned = exp_rotation(moment / i1 * end) @ [0.0, 0.0, 1.0]
    assert motion.poses[-1, :3, 2] == pytest.approx(turned, abs=1e-9)


def test_free_fall_is_a_parabola_whatever_the_spin() -> None:
    box = cuboid(1.0, 0.1, 0.2, 0.3)
    weight = np.array([0.0, 0.0, -9.81])

    def gravity(_: float, place: np.ndarray, __: np.ndarray) -> np.ndarray:
        return np.concatenate([np.zeros(3), place[:3, :3].T @ weight])

    start = START.copy()
    twist = np.array([3.0, 1.0, -2.0, 0.0, 0.0, 0.0])
    twist[3:] = start[:3, :3].T @ [1.0, 0.0, 4.0]
    motion = free_motion(box.spatial_inertia(), start, twist, np.linspace(0.0, 1.0, 501), wrench=gravity)
    t = motion.time[:, None]
    wanted = start[:3, 3] + t * [1.0, 0.0, 4.0] + 0.5 * t**2 * weight
    assert motion.poses[:, :3, 3] == pytest.approx(wanted, abs=1e-8)
    height = motion.poses[:, 2, 3]
    total = kinetic_energy(box.spatial_inertia(), motion.twists) + 9.81 * height
    assert np.ptp(total) < 1e-8


def test_bad_input_is_refused() -> None:
    g = cuboid(1.0, 0.1, 0.2, 0.3).spatial_inertia()
    with pytest.raises(InputError, match="increase"):
        free_motion(g, np.eye(4), np.zeros(6), [0.0, 0.0])
    with pytest.raises(InputError, match="rotation"):
        free_motion(g, 2 * np.eye(4), np.zeros(6), [0.0, 1.0])
    with pytest.raises(InputError, match="positive"):
        free_motion(np.zeros((6, 6)), np.eye(4), np.zeros(6), [0.0, 1.0])
