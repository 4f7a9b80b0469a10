"""Runs that say themselves that they are not to be trusted: energy missing, answers that a finer run changes."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import drivetrain as dt
from drivetrain.drive.motor import Motor
from drivetrain.effects.control.commanded_motion import CommandedMotion
from drivetrain.effects.control.computed_torque import ComputedTorque
from drivetrain.effects.loads.wall_spring import WallSpring
from drivetrain.effects.motor.given import GivenCurrent
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.effects.motor.rotor import FullRotor
from drivetrain.errors import InputError
from drivetrain.motion.motion import Motion
from drivetrain.simulation.cost_results import Decision, JointDecision
from drivetrain.simulation.engines.adaptive_step import AdaptiveStep
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.engines.inverse import Inverse
from drivetrain.simulation.passive import simulate_passive
from drivetrain.simulation.recording import Recording, energy_event, load_recording
from drivetrain.simulation.scene import Scene, joint_scene
from drivetrain.solvers.solver import DormandPrince853, Euler, Rodas5P

MOTOR = Motor("m", 0.299, 0.0302)


def swinging() -> Scene:
    """A joint on a spring of 22 Hz, pushed by a current that turns round at 2 Hz."""
    time = np.linspace(0.0, 1.0, 401)
    effects = [
        FullRotor(3e-5, 100.0), MotorCurrent(MOTOR), GivenCurrent(time, 4.0 * np.sin(4.0 * np.pi * time)),
        WallSpring(3e4, 5.0),
    ]  # fmt: skip
    return joint_scene(1.2, effects, 1.0)


def warnings(run: Recording, name: str) -> list[str]:
    return [event.detail for event in run.events if event.name == name]


def test_a_run_whose_energies_do_not_add_up_says_so() -> None:
    arm = dt.load_arm("planar-2r")
    loose = simulate_passive(arm, [0.5, 0.3], [0.0, 0.0], 1.0, solver=Euler(2e-2))
    tight = simulate_passive(arm, [0.5, 0.3], [0.0, 0.0], 1.0, solver=DormandPrince853())
    (detail,) = warnings(loose, "energy")
    assert "not accounted for" in detail
    share = float(detail.split(" %")[0]) / 100.0
    passed = max(np.ptp(loose[name]) for name in ("kinetic_energy", "potential_energy", "work"))
    assert share == pytest.approx(np.abs(loose["energy_error"]).max() / passed, rel=0.05)  # told with two digits
    assert not warnings(tight, "energy")


def test_what_is_missing_is_told_from_where_it_is_missing() -> None:
    time = np.linspace(0.0, 1.0, 11)
    (event,) = energy_event(time, 0.05 * time, 2.0, 10.0)
    assert event.time == pytest.approx(0.5)  # more than 1 % of 2 J
    assert not energy_event(time, 0.05 * time, 2.0, 10.0, tolerance=0.01)  # a tenth was allowed
    assert "a shorter step or AdaptiveStep resolves more" in event.detail
    (event,) = energy_event(time, 0.05 * time, 2.0, 10.0, tolerance=1e-4)
    assert "a smaller tolerance resolves more" in event.detail
    assert not energy_event(time, 1e-12 * time, 1e-13, 10.0)  # rounding of what is stored


@pytest.mark.parametrize("solver", [FixedStep(2e-2), AdaptiveStep(Rodas5P(1e-3))])
def test_verify_runs_once_more_and_compares(solver: FixedStep | AdaptiveStep) -> None:
    run = dt.simulate(swinging(), solver=solver, interval=0.02, verify=True)
    dense = [dt.simulate(swinging(), solver=one, interval=1e-3) for one in (solver, solver.finer())]
    assert run.verified["joint.peak_current"] == tuple(np.abs(one["joint.current"]).max() for one in dense)
    assert {"joint.rms_current", "joint.rms_torque"} <= set(run.verified)
    assert not {"joint.deviation", "tip_deviation"} & set(run.verified)  # nothing commands the joint
    there = np.interp(dense[0].time, dense[1].time, dense[1]["joint.position"])  # nothing commands the joint
    changed = np.abs(there - dense[0]["joint.position"]).max() / np.ptp(there)
    (detail,) = warnings(run, "verify")
    assert f"joint.position along the motion by {100.0 * changed:.2g} %: not converged" in detail


def test_a_step_that_does_not_resolve_is_told(tmp_path: Path) -> None:
    run = dt.simulate(
        swinging(), solver=FixedStep(5e-2), interval=0.02, verify=True
    )  # ten steps a period of the current
    (detail,) = warnings(run, "verify")
    assert "FixedStep(0.025 s) changes joint.peak_current by" in detail
    fine = dt.simulate(swinging(), solver=FixedStep(5e-4), interval=0.02, verify=True)
    assert fine.verified and not warnings(fine, "verify")
    assert load_recording(run.save(tmp_path / "run.npz")).verified == run.verified


def test_what_cannot_be_verified_is_refused() -> None:
    scene = swinging()
    half = dt.simulate(scene, duration=0.5)
    with pytest.raises(InputError, match="from its start"):
        dt.simulate(scene, resume=half, verify=True)
    with pytest.raises(InputError, match="step or a tolerance"):
        Inverse().finer()
    seen: list[float] = []
    with pytest.raises(InputError, match="needs a solver with a tolerance"):
        dt.simulate(scene, solver=Euler(1e-5), verify=True, progress=seen.append)
    assert not seen  # before it runs


@pytest.mark.parametrize("solver", [FixedStep(), AdaptiveStep(Rodas5P(1e-6))])
def test_peaks_between_output_rows_are_verified(solver: FixedStep | AdaptiveStep) -> None:
    """The current of a motor that is switched on peaks after three milliseconds; rows are ten apart."""
    motor = Motor("m", 0.5, 0.05, inductance=5e-4)
    switched = [dt.Winding(motor), dt.GivenVoltage([0.0, 0.1], [24.0, 24.0])]
    run = dt.simulate(joint_scene(2.1e-5, switched, 0.1), solver=solver, verify=True)
    time = np.linspace(0.0, 0.1, 100_001)  # I'' L + I' R + I kt^2 / J = 0, I(0) = 0, L I'(0) = V
    slow, fast = np.roots([5e-4, 0.5, 0.05**2 / 2.1e-5]).real[::-1]
    current = 24.0 / 5e-4 / (slow - fast) * (np.exp(slow * time) - np.exp(fast * time))
    assert np.abs(run["joint.current"]).max() < 0.3 * current.max()
    for peak, rms in zip(run.verified["joint.peak_current"], run.verified["joint.rms_current"], strict=True):
        assert peak == pytest.approx(current.max(), rel=0.02)
        assert rms == pytest.approx(np.sqrt(np.mean(current**2)), rel=0.02)


def test_a_motion_without_a_command_is_verified() -> None:
    """A pendulum of 1 rad: with steps of 50 ms it is late by a tenth of its swing after ten seconds."""
    pendulum = joint_scene(dt.Inertia(1.0, weight=9.81), [], 10.0, position=1.0)
    run = dt.simulate(pendulum, solver=FixedStep(0.05), verify=True)
    (detail,) = warnings(run, "verify")
    assert "FixedStep(0.025 s) changes joint.position along the motion by" in detail
    assert warnings(run, "step") == warnings(dt.simulate(pendulum, solver=FixedStep(0.05)), "step") != []
    assert not warnings(dt.simulate(pendulum, solver=AdaptiveStep(), verify=True), "verify")


def test_only_a_commanded_motion_has_a_deviation() -> None:
    arm = dt.with_rotors(dt.load_arm("planar-2r"), [None, None])
    time = np.linspace(0.0, 0.2, 201)[:, None] * np.ones(2)
    move = Motion("lift", arm.joint_names, time[:, 0], 0.1 * time**2, 0.2 * time, np.full((201, 2), 0.2))
    led = (CommandedMotion(move), ComputedTorque(50.0, tuple((name, 0.05) for name in arm.joint_names)))
    rotor, motor = FullRotor(1e-5, 50.0), MotorCurrent(Motor("m", 0.5, 0.05))
    for own, of_scene, known in (((rotor,), (), False), ((rotor, motor), led, True)):
        scene = Scene(arm, {**dict.fromkeys(arm.joint_names, own), "scene": of_scene}, 0.2)
        run = dt.simulate(scene, verify=True)
        deviations = {f"{name}.deviation" for name in arm.joint_names} | {"tip_deviation"}
        assert deviations & set(run.verified) == (deviations if known else set())


@pytest.mark.parametrize("order", [1, -1])
def test_a_quantity_that_only_one_run_has_is_verified_too(monkeypatch: pytest.MonkeyPatch, order: int) -> None:
    """A winding that runs away in one of the runs only, or a torque that only one knows."""
    for one, other in (((math.nan, 90.0), (2.0, 90.0)), ((2.0, 90.0), (2.0, math.inf))):
        both = [
            Decision({"joint": JointDecision(1.0, 1.0, torque, temperature, 25.0, 0.0)}, 0.0)
            for torque, temperature in (one, other)[::order]
        ]
        found = iter(both)
        monkeypatch.setattr("drivetrain.accuracy.verify.decision", lambda *_, found=found: next(found))
        run = dt.simulate(swinging(), solver=FixedStep(5e-4), verify=True)
        torques, rises = ([getattr(made.joints["joint"], name) for made in both] for name in ("rms_torque", "rise"))
        np.testing.assert_array_equal(run.verified["joint.rms_torque"], torques)
        np.testing.assert_array_equal(run.verified["joint.rise"], rises)
        assert "by inf %" in warnings(run, "verify")[0]


def test_progress_of_both_runs_is_one() -> None:
    seen: list[float] = []
    dt.simulate(swinging(), solver=FixedStep(2e-5), interval=0.02, verify=True, progress=seen.append)
    assert seen == sorted(seen) and seen[0] < 0.25 < seen[-1] <= 1.0
