"""Arms with closed loops run: against open ones that move alike, MuJoCo, sizing, energy, and dead centres."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np
import pytest
from crank_arm import DIFFERENTIAL, HEIGHT, crank, short_crank, two_links
from scipy.integrate import solve_ivp

from drivetrain.accuracy.study_run import simulate
from drivetrain.arm.coupling import rotor_turns
from drivetrain.arm.geared import at_level
from drivetrain.arm.rotors import RotorLevel
from drivetrain.dynamics.closed import whole_motion
from drivetrain.dynamics.inverse import inverse_dynamics
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.loads.tip_contact import TipContact
from drivetrain.effects.motor.rotor import FullRotor, ReflectedRotor
from drivetrain.export.mjcf import write_mjcf
from drivetrain.simulation.engines.adaptive_step import AdaptiveStep
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.engines.inverse import Inverse
from drivetrain.simulation.scene import Scene
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.solvers.solver import Rodas5P
from drivetrain.study.parts.mounting import loaded_arm
from drivetrain.study.read import load_study

PALLETISER = Path(__file__).resolve().parents[2] / "examples" / "palletiser" / "study.yaml"


def bare(evaluation, level=RotorLevel.FULL):
    """The arm with its drives, nothing commanded."""
    drives = {name: joint.drive for name, joint in evaluation.joints.items()}
    return at_level(loaded_arm(evaluation.study, drives, -1), level)


@pytest.mark.parametrize("coupling", [[], [DIFFERENTIAL]])
@pytest.mark.parametrize("effects", [("all",), ("mesh_loss", "full_rotor"), ("springs",)])
def test_a_crank_beside_a_link_is_inertia_of_that_link(effects, coupling):
    """The open chain that moves alike, signal by signal: all effects, rigid joints, reflected rotors on springs."""
    pair = (two_links(closures=crank(0.3), coupling=coupling), two_links(0.3, coupling=coupling))
    pair = [replace(one, simulation=replace(one.simulation, effects=effects)) for one in pair]
    closed, opened = (simulate(evaluate(one), interval=0.01) for one in pair)
    assert closed.stopped_by is None and closed.series.keys() == opened.series.keys()
    for name, wanted in opened.series.items():
        # The crank's own weight stays at the height of its joint.
        more = 9.81 * HEIGHT if name in ("scene.potential_energy", "stored_energy") else 0.0
        size = np.abs(wanted.values).max()
        np.testing.assert_allclose(closed[name] - more, wanted.values, atol=1e-7 * size + 1e-12, err_msg=name)


def fallen_in_mujoco(model, whole, instants):
    """Positions of both driven joints, extrapolated from two steps to none: MuJoCo's error is of first order."""
    runs = []
    for step in (2e-4, 1e-4):
        model.opt.timestep, model.eq_solref[:] = step, [2.0 * step, 1.0]
        data, rows = mujoco.MjData(model), []
        data.qpos[:], data.qvel[:] = whole.position[0], whole.velocity[0]
        for k in range(round(instants[-1] / step) + 1):
            if k % round(0.05 / step) == 0:
                rows.append(data.qpos[:2].copy())
            mujoco.mj_step(model, data)
        runs.append(np.array(rows))
    return 2.0 * runs[1] - runs[0]


@pytest.mark.parametrize("speed", [(0.0, 0.0), (1.0, -2.0)])
def test_a_four_bar_falls_as_in_mujoco(speed, tmp_path):
    """Rotors left out; MuJoCo's step goes to zero, from two of its steps, of which the error is of the first order."""
    found, start, instants = evaluate(two_links(closures=short_crank())), np.array([0.5, -0.4]), np.arange(9) * 0.05
    arm = bare(found, RotorLevel.NONE)
    scene = Scene(arm, {}, instants[-1], start, np.array(speed))
    run = simulate(scene, solver=AdaptiveStep(Rodas5P(rtol=1e-9)), interval=0.05)
    ours = np.column_stack([run[f"{name}.position"] for name in arm.joint_names])
    write_mjcf(found, tmp_path / "arm.xml")
    root = ElementTree.parse(tmp_path / "arm.xml").getroot()
    for actuators in root.findall("actuator"):
        root.remove(actuators)
    model, [first] = mujoco.MjModel.from_xml_string(ElementTree.tostring(root, "unicode")), start[None]
    model.dof_armature[:] = model.dof_damping[:] = model.dof_frictionloss[:] = 0.0
    model.eq_solimp[:] = [0.9999, 0.9999, 0.001, 0.5, 2.0]
    whole = whole_motion(found.study.arm.linkage, first[None], np.array([speed]), np.zeros((1, 2)))
    theirs = fallen_in_mujoco(model, whole, instants)
    assert np.ptp(ours, axis=0).min() > 0.5
    np.testing.assert_allclose(theirs, ours, atol=2e-5)


def shorted(found, path):
    """MuJoCo's model of an arm, its rotors reflected to the joints that turn them; no voltage, no current."""
    write_mjcf(found, path, motors="general")
    model = mujoco.MjModel.from_xml_path(str(path))
    model.actuator_gainprm[:] = model.actuator_biasprm[:] = 0.0
    model.dof_damping[:] = model.dof_frictionloss[:] = model.tendon_damping[:] = model.tendon_frictionloss[:] = 0.0
    model.eq_solimp[:] = [0.9999, 0.9999, 0.001, 0.5, 2.0]
    return model


def test_a_four_bar_with_a_differential_falls_as_in_mujoco(tmp_path):
    """Rotors reflected through the differential; MuJoCo's step goes to zero, as above."""
    found = evaluate(two_links(closures=short_crank(), coupling=[DIFFERENTIAL]))
    start, speed, instants = np.array([0.5, -0.4]), np.array([1.0, -2.0]), np.arange(6) * 0.05
    fallen = {}
    for level in (RotorLevel.REFLECTED, RotorLevel.NONE):
        scene = Scene(bare(found, level), {}, instants[-1], start, speed)
        run = simulate(scene, solver=AdaptiveStep(Rodas5P(rtol=1e-9)), interval=0.05)
        fallen[level] = np.column_stack([run[f"{name}.position"] for name in scene.joints])
    whole = whole_motion(found.study.arm.linkage, start[None], speed[None], np.zeros((1, 2)))
    theirs = fallen_in_mujoco(shorted(found, tmp_path / "arm.xml"), whole, instants)
    ours = fallen[RotorLevel.REFLECTED]
    assert np.abs(ours - fallen[RotorLevel.NONE]).max() > 0.03 < np.ptp(ours, axis=0).min()
    np.testing.assert_allclose(theirs, ours, atol=2e-5)


def test_a_four_bar_with_a_differential_written_out():
    """Rotors as bodies, pushed by a torque at each motor: by scipy on the inverse dynamics of the chains."""
    found = evaluate(two_links(closures=short_crank(), coupling=[DIFFERENTIAL]))
    arm, pushes = bare(found), np.array([1.5, -1.0])
    held = {name: GivenTorque(np.zeros(1), np.array([push]), "motor")
            for name, push in zip(arm.joint_names, pushes, strict=True)}  # fmt: skip
    effects = {name: (one,) for name, one in held.items()}
    start, speed = np.array([0.5, -0.4]), np.array([1.0, -2.0])
    run = simulate(Scene(arm, effects, 0.1, start, speed), solver=AdaptiveStep(Rodas5P(rtol=1e-9)), interval=0.025)

    def rates(t, x):
        q, qd = x[:2], x[2:]
        torque = rotor_turns(arm).T @ pushes
        bias, *columns = inverse_dynamics(arm, np.tile(q, (3, 1)), np.tile(qd, (3, 1)), np.vstack([[0, 0], np.eye(2)]))
        return [*qd, *np.linalg.solve(np.column_stack(columns) - bias[:, None], torque - bias)]

    fallen = solve_ivp(rates, (0.0, 0.1), [*start, *speed], "DOP853", run.time, rtol=1e-9, atol=1e-10)
    for k, name in enumerate(arm.joint_names):
        np.testing.assert_allclose(run[f"{name}.position"], fallen.y[k], atol=1e-7)
        np.testing.assert_allclose(run[f"{name}.speed"], fallen.y[2 + k], atol=1e-6)


@pytest.mark.parametrize("kind", [FullRotor, ReflectedRotor])
def test_rotors_of_a_scene_behind_a_differential(kind):
    """Rotors that effects bring: the linkage and the open chain that moves alike fall alike."""
    runs = []
    for study in (two_links(closures=crank(0.3), coupling=[DIFFERENTIAL]), two_links(0.3, coupling=[DIFFERENTIAL])):
        effects = {name: (kind(1e-4, 50.0),) for name in study.arm.joint_names}
        scene = Scene(study.arm, effects, 0.2, np.array([0.5, -0.4]), np.array([1.0, -2.0]))
        runs.append(simulate(scene, solver=FixedStep(1e-3), interval=0.01))
    for name in ("shoulder", "elbow"):
        assert np.ptp(runs[1][f"{name}.position"]) > 0.05
        np.testing.assert_allclose(runs[0][f"{name}.position"], runs[1][f"{name}.position"], atol=1e-9)


def test_coupled_motors_in_a_linkage_take_what_sizing_says():
    """The commanded motion of a four-bar: torques and currents of the shafts are those of its evaluation."""
    found = evaluate(two_links(closures=short_crank(), coupling=[DIFFERENTIAL]))
    run = simulate(found, solver=Inverse(), interval=0.05)
    for name, joint in found.joints.items():
        series, inside = joint.series, slice(1, -1)
        moving = np.abs(run[f"{name}.motor_speed"][inside]) > 1e-9
        for ours, wanted in (("mesh_torque", series.gear_torque), ("current", series.current)):
            at = np.interp(run.time, series.time, wanted)[inside][moving]
            np.testing.assert_allclose(run[f"{name}.{ours}"][inside][moving], at, rtol=1e-6, atol=1e-6)
    forward = simulate(found, interval=5e-3)
    for name in found.joints:
        away = forward[f"{name}.position"] - forward[f"{name}.command_position"]
        assert np.abs(away).max() < 5e-3
    passed = max(np.ptp(forward[f"{name}.electrical_energy"]) for name in found.joints)
    assert np.abs(forward["energy_error"]).max() < 1e-3 * passed


def test_a_fall_keeps_its_energy_and_its_halves():
    """Rotors as bodies; pins closed to rounding all the way, and a run that goes on is the one run, to the bit."""
    arm = bare(evaluate(two_links(closures=short_crank())))
    scene = Scene(arm, {}, 0.4, np.array([0.5, -0.4]), np.array([1.0, -2.0]))
    run = simulate(scene, solver=AdaptiveStep(Rodas5P(rtol=1e-9)), interval=0.01)
    assert np.ptp(run["stored_energy"]) < 1e-7 < 5.0 < np.ptp(run["scene.kinetic_energy"])
    one = simulate(scene, solver=FixedStep(2e-4), interval=0.01)
    half = simulate(scene, solver=FixedStep(2e-4), interval=0.01, duration=0.2)
    both = simulate(scene, solver=FixedStep(2e-4), interval=0.01, resume=half)
    for name in arm.joint_names:
        np.testing.assert_array_equal(one[f"{name}.position"][-20:], both[f"{name}.position"][-20:])
        np.testing.assert_allclose(one[f"{name}.position"], run[f"{name}.position"], atol=1e-5)


@pytest.mark.parametrize("engine", [FixedStep(1e-3), AdaptiveStep(Rodas5P(rtol=1e-6))])
def test_a_linkage_that_reaches_no_further_ends_the_run(engine):
    """The short crank's rod is in line with it as the arm falls."""
    arm = bare(evaluate(two_links(closures=short_crank())))
    run = simulate(Scene(arm, {}, 3.0, np.zeros(2)), solver=engine, interval=0.01)
    assert run.stopped_by is not None and run.stopped_by.name == "linkage not closed"
    assert "dead centre" in run.stopped_by.detail
    assert np.isfinite(run["shoulder.position"]).all()


def test_the_tip_pushes_back_through_the_loops():
    """A wall under the tip: the parallelogram's arm stands on it as the open one does."""
    found = []
    for study in (two_links(closures=crank(0.3)), two_links(0.3)):
        wall = TipContact((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), stiffness=2e4, damping=50.0)
        scene = Scene(bare(evaluate(study)), {"scene": (wall,)}, 0.5, np.array([0.05, 0.1]))
        found.append(simulate(scene, solver=FixedStep(2e-4), interval=0.01))
    closed, opened = found
    for name in ("shoulder.position", "elbow.position"):
        np.testing.assert_allclose(closed[name], opened[name], atol=1e-9)
    assert np.abs(np.diff(opened["shoulder.speed"])).max() > 0.1


def test_the_palletiser_takes_what_sizing_says():
    """Of the example: torques behind the gears as commanded, the same with all effects, energy accounted for."""
    study = load_study(PALLETISER)
    pairs = [("servo_5", "cycloid_2500")] * 4
    found = evaluate(study, dict(zip(study.arm.joint_names, pairs, strict=True)))
    commanded, run = simulate(found, solver=Inverse(), interval=0.01), simulate(found, interval=0.01)
    assert run.stopped_by is None
    assert np.abs(run["energy_error"]).max() < 1e-6 * np.ptp(run["stored_energy"])
    for name, joint in found.joints.items():
        series = joint.series
        jumps = series.time[np.flatnonzero(np.diff(series.time) <= 0.0)]
        smooth = np.abs(np.subtract.outer(commanded.time, jumps)).min(axis=1) > 0.02  # at one both sides stand
        wanted = np.interp(commanded.time, series.time, series.gear_torque)
        size = np.abs(wanted).max()
        np.testing.assert_allclose(commanded[f"{name}.mesh_torque"][smooth], wanted[smooth], atol=1e-3 * size)
        assert np.abs(run[f"{name}.current"]).max() == pytest.approx(np.abs(series.current).max(), rel=0.03)
        assert np.abs(run[f"{name}.position"] - run[f"{name}.command_position"]).max() < 1e-3
