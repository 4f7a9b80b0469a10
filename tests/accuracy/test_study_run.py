"""Studies, evaluations and selections run as they are, from Python as from the command."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import drivetrain as dt
from drivetrain.accuracy.decision import basis_of, decision
from drivetrain.accuracy.scenes import full_scene
from drivetrain.drive.brake import Brake
from drivetrain.errors import InputError
from drivetrain.simulation.recording import load_recording
from drivetrain.study.parts.simulation import AddedEffect
from drivetrain.whole_files import shipped

DOOR = shipped("examples") / "one_axis" / "study.yaml"
PUMA = shipped("examples") / "puma560" / "study.yaml"
DRIVE = {"hinge": ("maxon_625858", "maxon_223094")}


@pytest.fixture(scope="module")
def door() -> dt.Study:
    return dt.load_study(DOOR)


def _same(one: dt.Recording, other: dt.Recording) -> None:
    assert set(one.series) == set(other.series)
    for name in one.series:
        np.testing.assert_array_equal(one[name], other[name])


def test_a_study_runs_with_the_drives_that_it_gives() -> None:
    study = dt.load_study(PUMA)
    run = dt.simulate(study)
    assert run.stopped_by is None
    assert run.time[-1] == pytest.approx(study.cycle.duration)
    evaluation = dt.evaluate(study)
    _same(run, dt.simulate(evaluation))
    sized = evaluation.joints["joint_2"].series
    rms = float(np.sqrt(np.trapezoid(run["joint_2.current"] ** 2, run.time) / study.cycle.duration))
    wanted = float(np.sqrt(np.trapezoid(sized.current**2, sized.time) / study.cycle.duration))
    assert rms == pytest.approx(wanted, rel=0.01)  # loops lag, the motion is smooth


def test_a_study_that_gives_no_drives_runs_with_those_that_select_chooses(door: dt.Study) -> None:
    chosen = dt.select(door)
    assert chosen.drives == DRIVE
    run = dt.simulate(door)
    _same(run, dt.simulate(chosen))
    _same(run, dt.simulate(chosen.evaluation))
    _same(run, dt.simulate(door, drives=DRIVE))
    _same(run, dt.simulate(door, drives={"hinge": chosen.evaluation.joints["hinge"].drive}))


def test_drives_of_no_catalogue_run_too(door: dt.Study) -> None:
    known = dt.evaluate(door, DRIVE).joints["hinge"].drive
    weaker = replace(known, motor=replace(known.motor, key="mine", torque_constant=0.5 * known.motor.torque_constant))
    cold = {"interval": 0.05}
    one, other = dt.simulate(door, drives={"hinge": known}, **cold), dt.simulate(door, drives={"hinge": weaker}, **cold)
    ratio = np.abs(other["hinge.current"]).max() / np.abs(one["hinge.current"]).max()
    assert 1.8 < ratio < 2.4  # twice the current, and what more heat costs


def test_the_section_of_the_study_is_honoured(door: dt.Study) -> None:
    bare = replace(door, simulation=replace(door.simulation, effects=("viscous_friction",), step=2e-3))
    run = dt.simulate(bare, drives=DRIVE)
    assert run.counters["steps"] == pytest.approx(13.0 / 2e-3, rel=0.05)  # and a step at each jump
    assert "hinge.winding_temperature" not in run.series
    adaptive = replace(door, simulation=replace(door.simulation, solver="adaptive", precision=1e-4))
    assert "rates" in dt.simulate(adaptive, drives=DRIVE, duration=1.0).counters


def test_the_command_writes_what_python_runs(tmp_path: Path, door: dt.Study) -> None:
    from typer.testing import CliRunner

    from drivetrain.cli import app

    ran = CliRunner().invoke(app, ["simulate", str(DOOR), "--out", str(tmp_path)])
    assert ran.exit_code == 0, ran.output
    _same(load_recording(tmp_path / "recording.npz"), dt.simulate(door))


def test_a_longer_run_repeats_the_cycle(door: dt.Study) -> None:
    """As with repetitions of the study, and with --duration of the command."""
    twice = replace(door, simulation=replace(door.simulation, repetitions=2))
    longer = dt.simulate(door, drives=DRIVE, duration=26.0, interval=0.01)
    _same(longer, dt.simulate(twice, drives=DRIVE, interval=0.01))
    again = longer["hinge.command_position"][longer.time >= 13.0]
    assert np.ptp(again) == pytest.approx(np.ptp(longer["hinge.command_position"]), rel=1e-6)
    with pytest.raises(InputError, match="duration"):
        dt.simulate(door, drives=DRIVE, duration=-1.0)


@pytest.mark.parametrize(
    ("drives", "told"),
    [
        ({"hindge": DRIVE["hinge"]}, "hinge"),
        ({"hinge": ("maxon_625859x", "maxon_223094")}, "is not in the catalogue"),
        ({}, "has no drive"),
    ],
)
def test_wrong_drives_are_told(door: dt.Study, drives: dict[str, tuple[str, str]], told: str) -> None:
    with pytest.raises(InputError, match=told):
        dt.simulate(door, drives=drives)


def test_what_takes_no_drives_says_so(door: dt.Study) -> None:
    with pytest.raises(InputError, match="go with a study"):
        dt.simulate(dt.evaluate(door, DRIVE), drives=DRIVE)
    with pytest.raises(InputError, match="must be a scene"):
        dt.simulate(3.0)  # type: ignore[arg-type]
    heavy = replace(door, supply=replace(door.supply, voltage=1.0))
    with pytest.raises(InputError, match="no set of drives fits"):
        dt.simulate(heavy)


def test_a_brake_and_an_amplifier_in_the_housing_heat_both_roads_alike(door: dt.Study) -> None:
    """5 W of a coil, 2 W of standby and the conduction loss of an amplifier: what they add is the same."""
    door = replace(door, gear_temperature=20.0)
    amplifier = replace(door.joints[0].amplifier, standby_power=2.0, on_resistance=0.05)
    joints = (replace(door.joints[0], amplifier=amplifier, amplifier_heat=1.0),)
    brake = Brake("B", "motor", power=5.0, static_torque=1.0, mass=0.1, inertia=0.0)
    key, motors = DRIVE["hinge"][0], door.catalog.motors
    braked = replace(door.catalog, motors={**motors, key: replace(motors[key], brake=brake)})
    found = []
    for study in (door, replace(door, joints=joints, catalog=braked)):
        evaluation = dt.evaluate(study, DRIVE)
        full = full_scene(evaluation)
        run = decision(dt.simulate(evaluation), full, basis_of(full, evaluation))
        sized = next(one for one in evaluation.joints["hinge"].checks if one.name == "winding temperature")
        found.append((sized.required, run.joints["hinge"].winding_temperature))
    (cool, cool_run), (warm, warm_run) = found
    assert warm - cool > 10.0
    assert warm_run - cool_run == pytest.approx(warm - cool, rel=0.03)  # springs and loops are in the run alone


def test_a_mix_is_judged_by_its_shares_when_it_has_run() -> None:
    """RMS currents, heat and verdict of the simulated mix are those of sizing, not of one canister for each carton."""
    # At a stated temperature the gears drag alike on both roads; else sizing's are cold and simulated ones run warm.
    study = replace(dt.load_study(shipped("examples") / "mix" / "study.yaml"), gear_temperature=20.0)
    chosen = dt.select(study)
    full = full_scene(chosen.evaluation)
    found = decision(dt.simulate(chosen), full, basis_of(full, chosen.evaluation))
    for name, joint in chosen.evaluation.joints.items():
        checks = {check.name: check for check in joint.checks}
        rms = checks["motor RMS current"].required / study.safety.rms
        if np.abs(joint.series.speed).max() > 0.0:  # one that is held for ever is judged by its hottest phase
            assert found.joints[name].rms_current == pytest.approx(rms, rel=0.08)  # springs and loops are in one alone
        winding = checks["winding temperature"].required
        assert found.joints[name].winding_temperature - 30.0 == pytest.approx(winding - 30.0, rel=0.16, abs=0.2)
    assert found.verdict == chosen.evaluation.verdict
    second = np.arange(len(study.cycle.time)) >= study.cycle.parts[1].start
    away = replace(study.cycle, position=study.cycle.position + 0.1 * second[:, np.newaxis])
    with pytest.raises(InputError, match="begins elsewhere"):
        dt.simulate(replace(study, cycle=away), drives=chosen.drives)


def test_a_bus_whose_capacitance_is_known_is_simulated(door: dt.Study) -> None:
    """It rises with the energy that comes back, at most as far as the check allows for; a resistor holds it."""
    supply = replace(door.supply, regenerated_power=None, capacity=5e-3, max_voltage=90.0)
    study = replace(door, supply=supply)
    run = dt.simulate(study, drives=DRIVE, interval=1e-3)
    energy, most = 0.0, 0.0
    for power, step in zip(run["scene.delivered_power"][1:], np.diff(run.time), strict=True):
        energy = max(energy - power * step, 0.0)  # the source fills it up again
        most = max(most, energy)
    peak = run["scene.bus_voltage"].max()
    assert peak == pytest.approx(np.sqrt(24.0**2 + 2.0 * most / 5e-3), rel=2e-3) and peak > 40.0
    judged = next(one for one in dt.evaluate(study, DRIVE).shared if one.name == "supply bus voltage").required
    assert judged is not None and peak <= judged
    braked = replace(study, supply=replace(supply, threshold=30.0, resistance=20.0))
    assert dt.simulate(braked, drives=DRIVE)["scene.bus_voltage"].max() == pytest.approx(30.0, rel=1e-6)
    bus = AddedEffect("", dt.SupplyBus, {"voltage": 24.0, "capacity": 5e-3, "power": 150.0})
    added = replace(door, simulation=replace(door.simulation, add=(bus,)))
    assert dt.simulate(added, drives=DRIVE)["scene.bus_voltage"].max() == pytest.approx(peak, rel=1e-9)
