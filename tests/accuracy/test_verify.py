"""Runs that say themselves that they are not to be trusted: energy missing, answers that a finer run changes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import drivetrain as dt
from drivetrain.drive.motor import Motor
from drivetrain.effects.loads.wall_spring import WallSpring
from drivetrain.effects.motor.given import GivenCurrent
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.effects.motor.rotor import FullRotor
from drivetrain.errors import InputError
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
    finer = dt.simulate(swinging(), solver=solver.finer(), interval=0.02)
    here, there = run.verified["joint.peak_current"]
    assert (here, there) == (np.abs(run["joint.current"]).max(), np.abs(finer["joint.current"]).max())
    assert {"joint.rms_current", "joint.rms_torque", "joint.deviation", "tip_deviation"} <= set(run.verified)
    torque = run.verified["joint.rms_torque"]
    changed = abs(torque[0] / torque[1] - 1.0)
    assert warnings(run, "verify") == [] if changed < 0.01 else "not converged" in warnings(run, "verify")[0]


def test_a_step_that_does_not_resolve_is_told(tmp_path: Path) -> None:
    run = dt.simulate(
        swinging(), solver=FixedStep(5e-2), interval=0.02, verify=True
    )  # ten steps a period of the current
    (detail,) = warnings(run, "verify")
    assert "peak_current changes by" in detail and "FixedStep(0.025 s)" in detail
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


def test_progress_of_both_runs_is_one() -> None:
    seen: list[float] = []
    dt.simulate(swinging(), solver=FixedStep(2e-5), interval=0.02, verify=True, progress=seen.append)
    assert seen == sorted(seen) and seen[0] < 1.0 / 3.0 < seen[-1] <= 1.0
