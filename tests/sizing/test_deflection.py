"""The tip's deflection: by hand on one joint, against displaced postures, and against links cut into pieces."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from drivetrain.arm.arm import Arm
from drivetrain.arm.coupling import with_coupling
from drivetrain.arm.flexible_links import BendingLink, with_flexible_links
from drivetrain.arm.kinematics import tip_pose
from drivetrain.catalog.read import Catalog
from drivetrain.drive.spring import wind_up
from drivetrain.dynamics.inverse import inverse_dynamics
from drivetrain.errors import InputError
from drivetrain.sizing.deflection import joint_stiffness, lost_motion, tip_deflection, vibration
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.spatial.beams import Beam, round_tube
from drivetrain.study.model import DriveMass
from drivetrain.study.parts.mounting import loaded_arm

SECTION = round_tube(0.04, 0.036, 70e9, 26e9)
SPRINGS = {"stiffness_1": 3000.0, "stiffness_2": 5000.0, "stiffness_3": 8000.0, "torque_1": 3.0, "torque_2": 9.0}


def flexible_study(make, arm, cycle, **changes):
    """Springs and play in every gear, drives without weight."""
    gear = replace(make.gear, **{**SPRINGS, "backlash": 1e-3, **changes.pop("gear", {})})
    kept = {"drive_mass": DriveMass.INCLUDED, "catalog": Catalog({"m1": make.motor}, {"g1": gear}), **changes}
    return make.study(cycle, arm=arm, **kept)


def still(make, q, samples=3):
    q = np.tile(np.atleast_1d(q).astype(float), (samples, 1))
    return make.arm_cycle(np.linspace(0, 1, samples), q, 0 * q, 0 * q)


def even_bar(length=0.6, mass=1.2):
    """One link that is a bar along x of even mass, lifted by positive angles."""
    home, tip = np.eye(4), np.eye(4)
    home[0, 3], tip[0, 3] = length / 2, length
    across = mass * length**2 / 12
    return Arm.from_screws(
        [home], [[0, -1, 0, 0, 0, 0]], [mass], [np.diag([1e-9, across, across])], tip=tip, joint_names=["j1"]
    )


def test_one_joint_by_hand(make) -> None:
    length, mass = 0.5, 3.0
    study = flexible_study(make, make.planar_arm([length], [mass]), still(make, 0.0))
    found = tip_deflection(evaluate(study))
    torque = mass * 9.81 * length  # 14.7 N m: on the third piece
    twist = 3.0 / 3000 + 6.0 / 5000 + (torque - 9.0) / 8000
    np.testing.assert_allclose(found.twist, twist, rtol=1e-12)
    np.testing.assert_allclose(found.joints[:, 0], [[0, 0, -length * twist]] * 3, rtol=1e-12, atol=1e-18)
    # Weight lays the teeth on the side that lets the arm down.
    np.testing.assert_allclose(found.backlash[:, 0], [[0, 0, -length * 0.5e-3]] * 3, rtol=1e-12, atol=1e-18)
    np.testing.assert_allclose(found.lost_motion, length * 1e-3, rtol=1e-12)
    np.testing.assert_allclose(found.size, length * (twist + 0.5e-3), rtol=1e-12)
    np.testing.assert_allclose(found.worst_case, found.size, rtol=1e-12)
    assert found.rigid == found.unknown_play == ()


def test_twist_follows_the_motion(make) -> None:
    # The tip of an arm whose joints stand at the planned angle less the twist, played back exactly.
    study = flexible_study(make, make.planar_arm([0.5, 0.4], [1.5, 1.0]), make.sines(2))
    evaluation = evaluate(study)
    found = tip_deflection(evaluation)
    gear = study.catalog.gears["g1"]
    lag = np.column_stack([wind_up(gear, joint.series.gear_torque) for joint in evaluation.joints.values()])
    assert np.abs(lag).max() > 1e-3
    play = 0.5e-3 * np.sign(np.column_stack([joint.series.gear_torque for joint in evaluation.joints.values()]))
    q = study.cycle.position
    moved = tip_pose(study.arm, q - lag - play)[:, :3, 3] - tip_pose(study.arm, q)[:, :3, 3]
    # What linearising leaves out is of second order in the lag.
    np.testing.assert_allclose(found.displacement, moved, atol=2 * np.abs(lag + play).max() ** 2)
    mirrored = replace(study.cycle, position=-q, velocity=-study.cycle.velocity, acceleration=-study.cycle.acceleration)
    up = replace(study.arm, gravity=-study.arm.gravity)
    other = tip_deflection(evaluate(replace(study, cycle=mirrored, arm=up)))
    np.testing.assert_allclose(other.size, found.size, rtol=1e-9)


def test_deflection_falls_as_one_over_stiffness(make) -> None:
    arm, cycle = make.planar_arm([0.5, 0.4], [1.5, 1.0]), make.sines(2)
    sizes = []
    for factor in (1.0, 10.0, 100.0):
        stiff = {"stiffness_1": 3e3 * factor, "stiffness_2": None, "stiffness_3": None, "backlash": 0.0}
        sizes.append(tip_deflection(evaluate(flexible_study(make, arm, cycle, gear=stiff))).size)
    np.testing.assert_allclose(sizes[0], 10 * sizes[1], rtol=1e-9)
    np.testing.assert_allclose(sizes[0], 100 * sizes[2], rtol=1e-9)


def test_bar_on_a_hinge_bends_by_its_weight_and_its_payload(make) -> None:
    length, mass, load = 0.6, 1.2, 2.0
    arm = even_bar(length, mass)
    cycle = replace(
        still(make, 0.0, 4), payload=np.array([-1, -1, 0, 0]), payload_names=("part",),
        time=np.array([0.0, 1.0, 1.0, 2.0]),
    )  # fmt: skip
    study = flexible_study(make, arm, cycle, payloads=(make.payload(load),))
    beams = {0: Beam(SECTION, np.zeros(3), np.array([length, 0, 0]))}
    found = tip_deflection(evaluate(study), beams=beams).links[:, 0]
    own = mass * 9.81 / length * length**4 / (8 * SECTION.bending_x)
    carried = load * 9.81 * length**3 / (3 * SECTION.bending_x)
    np.testing.assert_allclose(found[:, 2], [-own, -own, -own - carried, -own - carried], rtol=1e-9)
    np.testing.assert_allclose(found[:, :2], 0.0, atol=1e-15)


def test_bar_on_a_hinge_bends_by_a_force_and_a_moment_at_its_tip(make) -> None:
    length, force, moment = 0.6, 30.0, 5.0  # with which the tip pushes upwards, and turns about y
    wrench = np.outer([1.0, 0.0, 0.0, 0.0], [0.0, moment, 0.0, 0.0, 0.0, force])
    wrench[1, 5] = force
    study = flexible_study(make, even_bar(length, 1.2), replace(still(make, 0.0, 4), tip_wrench=wrench))
    beams = {0: Beam(SECTION, np.zeros(3), np.array([length, 0, 0]))}
    found = tip_deflection(evaluate(study), beams=beams).links[:, 0, 2]
    pressed = force * length**3 / (3 * SECTION.bending_x)
    turned = moment * length**2 / (2 * SECTION.bending_x)
    np.testing.assert_allclose(found - found[3], [turned - pressed, -pressed, 0.0, 0.0], rtol=1e-9, atol=1e-15)


def test_links_in_motion_against_links_cut_into_pieces(make) -> None:
    lengths, masses = [0.5, 0.4], [1.0, 0.7]
    points = np.array([[0.0, 0, 0], [0.5, 0, 0], [0.9, 0, 0]])
    home = np.tile(np.eye(4), (2, 1, 1))
    home[:, :3, 3] = 0.5 * (points[1:] + points[:-1])
    slim = SECTION.bending_x / SECTION.axial
    inertias = [np.diag([2 * slim * m, m * (s**2 / 12 + slim), m * (s**2 / 12 + slim)])
                for m, s in zip(masses, lengths, strict=True)]  # fmt: skip
    tip = np.eye(4)
    tip[:3, 3] = points[2]
    # The first joint turns about the upright: the second link swings the first one sideways and twists it.
    screws = [[0, 0, 1, 0, 0, 0], [0, -1, 0, *np.cross(points[1], [0, -1, 0])]]
    arm = Arm.from_screws(home, screws, masses, inertias, tip=tip, joint_points=points[:2], joint_names=["j1", "j2"])
    study = flexible_study(make, arm, make.sines(2, samples=21))
    beams = {i: Beam(SECTION, points[i], points[i + 1]) for i in range(2)}
    evaluation = evaluate(study)
    unstretched = {i: replace(beam, section=replace(SECTION, axial=1e15)) for i, beam in beams.items()}
    found = tip_deflection(evaluation, beams=unstretched).links
    drives = {name: joint.drive for name, joint in evaluation.joints.items()}
    bending = {i: BendingLink(beam, masses[i], pieces=40) for i, beam in beams.items()}
    sprung = with_flexible_links(loaded_arm(study, drives, -1), bending)
    motion = [sprung.widened(x) for x in (study.cycle.position, study.cycle.velocity, study.cycle.acceleration)]
    bent = np.where(np.isfinite(sprung.stiffness), -inverse_dynamics(sprung.arm, *motion) / sprung.stiffness, 0.0)
    middle = tip_pose(sprung.arm, motion[0])[:, :3, 3]
    for link, part in enumerate((slice(0, sprung.driven[1]), slice(sprung.driven[1], None))):
        alone = np.zeros_like(bent)
        alone[:, part] = 1e-3 * bent[:, part]  # small enough to be linear
        moved = (tip_pose(sprung.arm, motion[0] + alone)[:, :3, 3] - middle) / 1e-3
        # 40 pieces miss 1/6400 of the beam's stiffness; the moments that turn its sections are counted as forces.
        np.testing.assert_allclose(found[:, link], moved, atol=1e-3 * np.abs(moved).max())
    assert np.abs(found[:, 0, :2]).max() > 1e-5  # sideways too


def test_lost_motion_by_trying_everything() -> None:
    rng = np.random.default_rng(5)
    plays = rng.normal(size=(7, 4, 3))
    plays[:, 2] = 0.0
    sums = [np.einsum("j,njc->nc", np.array(s), plays) for s in itertools.product([-1.0, 1.0], repeat=4)]
    np.testing.assert_allclose(lost_motion(plays), np.linalg.norm(sums, axis=2).max(axis=0), rtol=1e-12)
    assert (lost_motion(plays) <= np.linalg.norm(plays, axis=2).sum(axis=1)).all()
    many = rng.normal(size=(2, 14, 3))
    np.testing.assert_allclose(lost_motion(many), np.linalg.norm(many, axis=2).sum(axis=1), rtol=1e-12)
    assert not lost_motion(np.zeros((3, 2, 3))).any()


def test_a_sliding_joint_gives_way_along_its_travel(make) -> None:
    tip = np.eye(4)
    mass, travel = 4.0, 0.01
    arm = Arm.from_screws([np.eye(4)], [[0, 0, 0, 0, 0, 1]], [mass], [1e-3 * np.eye(3)], tip=tip, joint_names=["j1"])
    sliding = make.task(travel_per_turn=travel)
    study = flexible_study(make, arm, still(make, 0.0), joints=(sliding,))
    evaluation = evaluate(study)
    found = tip_deflection(evaluation)
    twist = mass * 9.81 * travel / 3000.0
    np.testing.assert_allclose(found.joints[:, 0], [[0, 0, -travel * twist]] * 3, rtol=1e-10, atol=1e-18)
    np.testing.assert_allclose(found.lost_motion, travel * 1e-3, rtol=1e-12)
    np.testing.assert_allclose(joint_stiffness(evaluation), 3000.0 / travel**2, rtol=1e-12)
    frequency = math.sqrt(3000.0 / travel**2 / mass) / (2 * math.pi)
    np.testing.assert_allclose(vibration(evaluation).locked, frequency, rtol=1e-6)


def test_vibration_about_the_torque_carried(make) -> None:
    # One joint: the stiffness of the third piece where it holds the arm out, of the first where it hangs.
    length, mass = 0.5, 3.0
    cycle = still(make, [[0.0]], 2)
    cycle = replace(cycle, position=np.array([[0.0], [-np.pi / 2]]))
    study = flexible_study(make, make.planar_arm([length], [mass]), cycle)
    found = vibration(evaluate(study))
    inertia = mass * length**2 + 1e-4
    rotor = make.gear.ratio**2 * (make.motor.rotor_inertia + make.gear.inertia)
    np.testing.assert_allclose(found.stiffness[:, 0], [8000.0, 3000.0])
    for k, stiffness in enumerate((8000.0, 3000.0)):
        locked = math.sqrt(stiffness / inertia) / (2 * math.pi)
        free = math.sqrt(stiffness * (1 / inertia + 1 / rotor)) / (2 * math.pi)
        assert found.locked[k, 0] == pytest.approx(locked, rel=1e-8)
        assert found.free[k, 0] == pytest.approx(free, rel=1e-8)


def test_what_no_sheet_prints_is_told(make) -> None:
    stiff = {"stiffness_1": None, "backlash": None}
    study = flexible_study(make, make.planar_arm([0.5, 0.4], [1.5, 1.0]), make.sines(2), gear=stiff)
    evaluation = evaluate(study)
    found = tip_deflection(evaluation)
    assert found.rigid == found.unknown_play == vibration(evaluation).rigid == ("j1", "j2")
    assert not found.displacement.any()
    assert not found.lost_motion.any()
    assert vibration(evaluation).locked.shape == (101, 0)


def test_no_arm_no_tip(make) -> None:
    study = make.study(make.table_cycle([0.0, 1.0], [1.0, 1.0], [0.0, 0.0], [0.0, 0.0]))
    for compute in (tip_deflection, vibration):
        with pytest.raises(InputError, match="arm: is needed"):
            compute(evaluate(study))
    arm = flexible_study(make, make.planar_arm([0.5], [1.0]), still(make, 0.0))
    with pytest.raises(InputError, match=r"beams\[3\]"):
        tip_deflection(evaluate(arm), beams={3: Beam(SECTION, np.zeros(3), np.ones(3))})


def test_coupled_shafts_lag_through_their_coupling(make) -> None:
    study = flexible_study(make, make.planar_arm([0.5, 0.4], [1.5, 1.0]), make.sines(2))
    evaluation = evaluate(study)
    coupling = np.array([[1.0, 0.0], [-1.0, 1.0]])  # a belt over the first joint
    coupled = replace(evaluation, study=replace(study, arm=with_coupling(study.arm, coupling)))
    found = tip_deflection(coupled)
    lag = np.linalg.solve(coupling, found.twist.T).T
    q = study.cycle.position
    moved = (tip_pose(study.arm, q - 1e-4 * lag) - tip_pose(study.arm, q + 1e-4 * lag))[:, :3, 3] / 2e-4
    np.testing.assert_allclose(found.joints.sum(axis=1), moved, rtol=1e-6, atol=1e-9)
