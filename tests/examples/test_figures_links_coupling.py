"""Pictures of links by their masses, and of coupled motors: what they draw is what was computed."""

from __future__ import annotations

import numpy as np
import pytest
from figures.coupling import figure_coupled_motors
from figures.links import figure_links

from drivetrain.arm.arm import Arm
from drivetrain.arm.coupling import differential, placed, rotor_turns, with_coupling
from drivetrain.arm.files.load import load_arm
from drivetrain.arm.geared import with_rotors
from drivetrain.arm.rotors import Rotor
from drivetrain.dynamics.inverse import drive_torques
from drivetrain.errors import InputError
from drivetrain.spatial.inertia import ellipsoid


def test_a_link_is_drawn_as_the_ellipsoid_that_it_is() -> None:
    turn = np.array([[0.6, 0.0, 0.8], [0.0, 1.0, 0.0], [-0.8, 0.0, 0.6]])
    home = np.eye(4)
    home[:3, :3], home[:3, 3] = turn, [0.2, 0.0, 0.1]
    body = ellipsoid(2.0, 0.3, 0.2, 0.05)
    arm = Arm.from_screws([home], [[0, 0, 1, 0, 0, 0]], [2.0], [body.inertia])
    axes = figure_links({"one": arm}, [0.0]).axes[0]
    outline = axes.patches[0].get_xy() - [0.2, 0.1]
    # Seen along y, the half axes of 0.3 and 0.05 m show whole, turned with the link.
    inside = outline @ turn[[0, 2]][:, [0, 2]]
    assert np.hypot(inside[:, 0] / 0.3, inside[:, 1] / 0.05) == pytest.approx(np.ones(len(inside)), abs=1e-9)
    assert axes.get_xlabel() == "x [m]" and axes.get_ylabel() == "z [m]"


def test_links_without_mass_are_points_and_other_views_are_named() -> None:
    figure = figure_links({"puma": load_arm("puma560")}, np.zeros(6), plane=[[0.6, 0.8, 0.0], [0.0, 0.0, 1.0]])
    assert figure.axes[0].get_xlabel() == "along (0.6, 0.8, 0) [m]"
    with pytest.raises(InputError):
        figure_links({"puma": load_arm("puma560")}, np.zeros(5))


def test_coupled_motors_are_drawn_beside_lone_ones() -> None:
    bare = load_arm("ur5-corrected")
    arm = with_rotors(bare, [Rotor(100.0, 1e-4)] * 6, coupling=placed(differential(), (4, 5), 6))
    rng = np.random.default_rng(1)
    motion = tuple(rng.normal(size=(3, 20, 6)))
    axes = figure_coupled_motors({"wrist": (arm, motion)}).axes
    assert len(axes) == 1 and axes[0].get_title(loc="left") == "wrist: wrist_2_joint, wrist_3_joint"
    drawn = {line.get_label(): line for line in axes[0].lines}
    assert drawn["motor 5"].get_xdata() == pytest.approx((motion[1] @ rotor_turns(arm).T)[:, 4])
    torque = drive_torques(arm, *motion).motor[:, 5]
    scale = drawn["motor 6"].get_ydata() / torque
    assert scale == pytest.approx(np.full(20, scale[0])) and np.log10(scale[0]) == pytest.approx(
        round(np.log10(scale[0]))
    )
    with pytest.raises(InputError, match="coupled motors that turn"):
        figure_coupled_motors({"plain": (with_coupling(arm, None), motion)})
