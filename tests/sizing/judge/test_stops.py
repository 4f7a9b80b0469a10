"""Stops of a joint against dynamics done by hand: forward and inverse, from every state of the cycle."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import drivetrain
from drivetrain.arm.geared import with_rotors
from drivetrain.arm.rotors import Rotor
from drivetrain.drive.amplifier import Amplifier
from drivetrain.drive.friction import Friction
from drivetrain.dynamics.inverse import drive_torques, joint_loads
from drivetrain.dynamics.mass import mass_matrix
from drivetrain.errors import InputError
from drivetrain.sizing.judge.cases import stop_temperature
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.study.model import DriveMass, Mount, Stop
from drivetrain.study.parts.mounting import seated_rotor
from drivetrain.study.parts.verdicts import Verdict
from drivetrain.study.read import load_study

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "ur5_pick_and_place" / "study.yaml"
MOMENTARY, CURRENT = "gear momentary peak torque", "current to stop"


def check(evaluation, joint, name):
    return next(one for one in evaluation.joints[joint].checks if one.name == name)


@pytest.fixture
def two_links(make):
    """Two joints whose drives weigh nothing, frictionless; the gears bear little and lose 30 %."""
    arm = make.planar_arm([0.4, 0.35], [2.0, 1.0])
    gear = replace(make.gear, efficiency=0.7, momentary_torque=30.0)
    motor = replace(make.motor, no_load_current=None, no_load_speed=None, coulomb_friction=0.0, viscous_friction=0.0)
    study = make.study(make.sines(2, samples=61, size=0.9), arm=arm, drive_mass=DriveMass.INCLUDED)
    catalog = replace(study.catalog, motors={"m1": motor}, gears={"g1": gear})
    tasks = tuple(replace(task, friction=Friction()) for task in study.joints)
    return replace(study, catalog=catalog, joints=tasks)


def stopped(study, **stop):
    return replace(study, joints=tuple(replace(task, stop=Stop(**stop)) for task in study.joints))


def geared(study):
    gear, motor = study.catalog.gears["g1"], study.catalog.motors["m1"]
    return with_rotors(study.arm, [Rotor(gear.ratio, motor.rotor_inertia + gear.inertia)] * 2)


@pytest.mark.parametrize(("cold", "told", "counted"), [(0.0, -30.0, 20.0), (1.0, -30.0, -30.0), (1.0, 35.0, 20.0)])
def test_a_stop_is_judged_with_the_least_warm_drag_that_may_be(cold, told, counted):
    """A cold start makes it colder, never warmer."""
    setting = SimpleNamespace(gear_temperature=20.0, cold_start=told, cold=cold)
    assert stop_temperature(SimpleNamespace(setting=setting)) == counted


def test_cold_magnets_brake_harder(two_links):
    """kt of -20 C over that of the sheet, warmer air changing nothing; in a stop, in a jam, of one joint and of all."""
    sheet = replace(two_links.catalog.motors["m1"], magnet_coefficient=-0.002)
    springs = {"stiffness_1": 8e3, "stiffness_2": 1e4, "stiffness_3": 1.5e4, "torque_1": 5.0, "torque_2": 20.0}
    parts = replace(
        two_links.catalog, motors={"m1": sheet}, gears={"g1": replace(two_links.catalog.gears["g1"], **springs)}
    )
    study = stopped(replace(two_links, catalog=parts), current=9.0, jam=True)
    stronger = stopped(study, current=9.0 * (1.0 + 0.002 * 45.0), jam=True)
    names = MOMENTARY, "gear torque in a jam", "arm stop at full current"

    def asked(study, **changes):
        found = evaluate(replace(study, **changes))
        checks = {one.name: one.required for one in (*found.joints["j1"].checks, *found.shared)}
        return [checks[name] for name in names]

    plain = asked(study)
    assert asked(study, ambient=60.0) == plain
    cold = asked(study, ambient=-20.0, gear_temperature=20.0)
    assert cold == pytest.approx(asked(stronger), rel=1e-9) and all(
        more > 1.02 * less for more, less in zip(cold, plain, strict=True)
    )
    assert asked(study, cold_start=-20.0, gear_temperature=20.0) == cold


@pytest.mark.parametrize("still", [(), (0,), (1,)])
@pytest.mark.parametrize("ramp", [0.05, 0.3])
def test_a_ramp_asks_what_inverse_dynamics_says(two_links, ramp, still):
    """From each sample, at the start, in the middle and just before standstill; to rounding of the basis.

    A joint that stands still bears what the other one does in its stop.
    """
    cycle = two_links.cycle
    moved = {name: getattr(cycle, name).copy() for name in ("velocity", "acceleration")}
    for rates in moved.values():
        rates[:, still] = 0.0
    study = stopped(replace(two_links, cycle=replace(cycle, **moved)), ramp=ramp)
    arm, cycle = geared(study), study.cycle
    largest = np.zeros(2)
    for share in (0.0, 0.5, 1.0):
        q = cycle.position + cycle.velocity * ramp * share * (1.0 - 0.5 * share)
        found = joint_loads(arm, q, cycle.velocity * (1.0 - share), -cycle.velocity / ramp)
        largest = np.maximum(largest, np.abs(found.gear).max(axis=0))
    evaluation = evaluate(study)
    for joint, name in enumerate(cycle.joint_names):
        own = check(evaluation, name, "gear repeated peak torque").required
        assert check(evaluation, name, MOMENTARY).required == pytest.approx(max(largest[joint], own), rel=1e-9)


@pytest.mark.parametrize("rubbing", [0.0, 1.5])
def test_a_motor_that_drives_on_along_a_ramp_pays_all_losses(two_links, rubbing):
    """On a soft ramp the weight may stop the arm by itself: the motor then drives it on, through mesh and friction."""
    ramp = 1.0
    study = stopped(two_links, ramp=ramp)
    study = replace(study, joints=tuple(replace(one, friction=Friction(coulomb=rubbing)) for one in study.joints))
    arm, cycle, ratio, lossy, spared = geared(study), study.cycle, study.catalog.gears["g1"].ratio, 0.0, 0.0
    for share in (0.0, 0.5, 1.0):
        q = cycle.position + cycle.velocity * ramp * share * (1.0 - 0.5 * share)
        found = drive_torques(arm, q, cycle.velocity * (1.0 - share), -cycle.velocity / ramp)
        way = np.sign(cycle.velocity)
        load, rotor = found.gear + rubbing * way, found.motor - found.gear / ratio
        through = np.where(load * way > 0.0, 1.0 / 0.7, 2.0 - 1.0 / 0.7) * load / ratio + rotor
        spared = np.maximum(spared, np.abs(found.motor).max(axis=0))
        lossy = np.maximum(lossy, np.abs(through).max(axis=0))
    assert (lossy > 1.04 * spared).any()
    for name, torque in zip(cycle.joint_names, np.maximum(lossy, spared), strict=True):
        joint = evaluate(study).joints[name]
        constant = joint.series.motor_torque.max() / joint.series.current.max()
        assert check(evaluate(study), name, CURRENT).actual * constant == pytest.approx(torque, rel=1e-9)
        momentary, own = (check(evaluate(study), name, one) for one in (MOMENTARY, "gear repeated peak torque"))
        assert momentary.required >= own.required


def braked_by_hand(study, joint, amperes):
    """Largest |T + (T - T_cycle)| over the cycle: one joint braked, its acceleration solved, the other at its work."""
    arm, cycle = geared(study), study.cycle
    gear, motor = study.catalog.gears["g1"], study.catalog.motors["m1"]
    rotor, push = gear.ratio**2 * (motor.rotor_inertia + gear.inertia), gear.ratio * motor.torque_constant * amperes
    bare = with_rotors(study.arm, [None if k == joint else Rotor(gear.ratio, rotor / gear.ratio**2) for k in range(2)])
    largest = 0.0
    for q, qd, qdd in zip(cycle.position, cycle.velocity, cycle.acceleration, strict=True):
        way, planned = np.sign(qd[joint]), joint_loads(arm, q, qd, qdd)
        if way == 0.0:
            continue
        inertia = mass_matrix(bare, q)[joint, joint]
        carrier = planned.carrier_acceleration[joint]
        for factor in (1.0 / 0.7, 2.0 - 1.0 / 0.7):  # the one whose sign fits
            rest = planned.gear[joint] - inertia * qdd[joint]
            wanted = -way * push - rotor / gear.ratio * carrier - factor * rest
            slowed = qdd.copy()
            slowed[joint] = wanted / (factor * inertia + rotor)
            torque = joint_loads(arm, q, qd, slowed).gear[joint]
            if (torque * way > 0.0) == (factor > 1.0):
                largest = max(largest, abs(2.0 * torque - planned.gear[joint]))
    return largest


def test_a_stop_at_a_current_solves_the_braked_joint(two_links):
    """The stators are on the links before their joints; the spring's stiffness is unknown, so it swings to twice."""
    study = stopped(two_links, current=5.0)
    evaluation = evaluate(study)
    for joint, name in enumerate(study.cycle.joint_names):
        assert check(evaluation, name, MOMENTARY).required == pytest.approx(braked_by_hand(study, joint, 5.0), rel=1e-6)


@pytest.mark.parametrize("joint", [0, 1])
def test_a_stator_on_the_moved_link_brakes_that_too(two_links, joint):
    """T = A a + b and G tau = f T + R a + r, the numbers by two runs of inverse dynamics, the rotor on its link."""
    before, limit = stopped(two_links, current=5.0), 50.0 * 0.05 * 5.0
    tasks = [replace(task, mount=Mount("child")) if k == joint else task for k, task in enumerate(before.joints)]
    study = replace(before, joints=tuple(tasks))
    rotors = [seated_rotor(study.arm, k, task.mount, 50.0, 2.1e-5) for k, task in enumerate(tasks)]
    arm, cycle, largest = with_rotors(study.arm, rotors), study.cycle, 0.0
    for q, qd, qdd in zip(cycle.position, cycle.velocity, cycle.acceleration, strict=True):
        runs = []
        for share in (0.0, 1.0):
            slowed = qdd.copy()
            slowed[joint] = share
            found = drive_torques(arm, q, qd, slowed)
            runs.append((found.gear[joint], 50.0 * found.motor[joint] - found.gear[joint]))
        (b, r), (whole, turned) = runs
        way, planned = np.sign(qd[joint]), b + (whole - b) * qdd[joint]
        for factor in (1.0 / 0.7, 2.0 - 1.0 / 0.7) if way else ():
            slowing = (-way * limit - factor * b - r) / (factor * (whole - b) + turned - r)
            torque = b + (whole - b) * slowing
            if (torque * way > 0.0) == (factor > 1.0):
                largest = max(largest, abs(2.0 * torque - planned))
    asked = [check(evaluate(one), cycle.joint_names[joint], MOMENTARY).required for one in (study, before)]
    assert asked[0] == pytest.approx(largest, rel=1e-6)
    assert abs(asked[1] / asked[0] - 1.0) > 1e-3


def test_the_safe_current_is_the_largest_one(two_links):
    """As the remark tells it, to its three digits."""
    study = stopped(two_links, current=20.0)
    told = check(evaluate(study), "j1", MOMENTARY)
    assert told.verdict is Verdict.FAIL
    safe = float(re.search(r"a stop current up to ([\d.]+) A \(DC\) ", told.remark).group(1))
    found = [check(evaluate(stopped(two_links, current=safe * f)), "j1", MOMENTARY) for f in (0.98, 1.02)]
    used = [one.required / one.available for one in found]
    assert used[0] < 1.0 < used[1]


def test_the_remark_on_a_stop_from_the_first_instant_of_a_motion(tmp_path):
    """There the speed is 0 and the motion has a direction; the spring's stiffness is unknown, so it swings to twice."""
    motor = {
        "kind": "brushless", "current_basis": "dc", "winding_basis": "line_line", "resistance": 0.4, "mass": 1.0,
        "torque_constant": 0.1, "rotor_inertia": 1e-5, "nominal_current": 9.0, "peak_current": 35.0,
    }  # fmt: skip
    gear = {"kind": "planetary", "ratio": 20, "efficiency": 0.9, "mass": 1.0, "repeated_peak_torque": 60}
    table = tmp_path / "axis.csv"
    table.write_text("time [s],torque_a [N m],speed_a [rad/s]\n0,9,0\n0.3,9,6\n0.3,-9,6\n0.6,-9,0\n")
    study = drivetrain.study(
        motions={"turn": {"table": str(table)}}, motors={"M": motor}, gears={"G": gear | {"momentary_torque": 90}},
        supply="48 V", amplifier={"current_basis": "dc", "peak_current": 30.0}, open_cycle=True,
        joints={"default": {"output_bearing": "external", "load_inertia": 0.4}},
    )  # fmt: skip
    chosen = drivetrain.select(study)
    found = check(chosen.evaluation, "a", MOMENTARY)
    assert any(f"Cause: {found.remark}" in line for line in chosen.advice)
    words = (r"t = (\S+) s", r"(\S+) N m with a rigid gear")
    begin, rigid = (float(re.search(one, found.remark).group(1)) for one in words)
    assert begin == 0.0
    assert found.required == pytest.approx(2.0 * rigid + 9.0, rel=1e-3)  # four digits


def test_the_current_that_spares_a_jammed_gear(two_links):
    """As the remark tells it, to its three digits; a rotor that winds the spring too far by itself has none."""
    stiff = replace(two_links.catalog.gears["g1"], stiffness_1=2e4)
    study = replace(two_links, catalog=replace(two_links.catalog, gears={"g1": stiff}))

    def jammed(current, most):
        catalog = replace(study.catalog, gears={"g1": replace(stiff, momentary_torque=most)})
        return check(
            evaluate(stopped(replace(study, catalog=catalog), current=current, jam=True)), "j1", "gear torque in a jam"
        )

    coast = float(re.search(r"([\d.]+) N m with the motor off", jammed(20.0, 30.0).remark).group(1))
    most = 1.5 * coast * study.safety.peak_torque
    told = jammed(20.0, most)
    assert told.verdict is Verdict.FAIL
    safe = float(re.search(r"no more than ([\d.]+) A \(DC\)", told.remark).group(1))
    used = [one.required / one.available for one in (jammed(safe * f, most) for f in (0.98, 1.02))]
    assert used[0] < 1.0 < used[1]
    assert "the rotor's energy alone" in jammed(20.0, 0.9 * coast * study.safety.peak_torque).remark


def test_what_holds_the_load_is_asked_of_the_current(two_links):
    """The torque without what the joint's own acceleration asks, over ratio and torque constant."""
    study = stopped(two_links, current=5.0)
    arm, cycle = geared(study), study.cycle
    planned = joint_loads(arm, cycle.position, cycle.velocity, cycle.acceleration).gear[:, 1]
    bare = with_rotors(study.arm, [Rotor(50.0, 2.1e-5), None])
    inertia = mass_matrix(bare, cycle.position)[:, 1, 1]
    static = np.abs(planned - inertia * cycle.acceleration[:, 1]).max() / 50.0
    found = check(evaluate(study), "j2", CURRENT).required
    assert static / 0.05 == pytest.approx(found, rel=0.1)  # of warm magnets, a little weaker
    assert check(evaluate(stopped(two_links, current=1e-3)), "j2", CURRENT).verdict is Verdict.FAIL


def test_without_a_current_a_stop_is_not_checked_but_a_cycle_that_asks_too_much_fails(two_links):
    tasks = tuple(replace(task, amplifier=Amplifier(), stop=Stop()) for task in two_links.joints)
    plain = evaluate(replace(two_links, joints=tasks))
    assert check(plain, "j2", MOMENTARY).verdict is Verdict.NOT_CHECKED
    assert "no stop is known" in check(plain, "j2", MOMENTARY).remark
    weak = {"g1": replace(two_links.catalog.gears["g1"], momentary_torque=1e-3)}
    worse = evaluate(replace(two_links, joints=tasks, catalog=replace(two_links.catalog, gears=weak)))
    assert check(worse, "j2", MOMENTARY).verdict is Verdict.FAIL


def test_a_study_file_says_how_it_stops(tmp_path):
    """Joints over the whole; the current in the amplifier's convention; the example passes on its ramp."""
    text = EXAMPLE.read_text(encoding="utf-8")
    file = tmp_path / "study.yaml"
    file.write_text(
        text.replace("  ramp: 0.3 s\n", "  ramp: 0.3 s\n  current: 8 A\n") + "    stop: {ramp: 0.5 s}\n", "utf-8"
    )
    study = load_study(file)
    ramps = [task.stop.ramp for task in study.joints]
    assert ramps == [0.3] * 5 + [0.5]
    assert study.joints[0].stop.current == pytest.approx(8.0 * np.sqrt(1.5))
    assert study.joints[5].stop.stops_per_day == 10.0
    file.write_text(text.replace("ramp: 0.3 s", "ramp: -1 s"), "utf-8")
    with pytest.raises(InputError, match="ramp"):
        load_study(file)


def test_an_arm_that_never_moves_has_nothing_to_stop(two_links, make):
    still = replace(two_links.cycle, velocity=np.zeros((61, 2)), acceleration=np.zeros((61, 2)))
    evaluation = evaluate(stopped(replace(two_links, cycle=still), ramp=0.3))
    assert "nothing to stop" in check(evaluation, "j1", MOMENTARY).remark


def test_a_stop_ends_with_a_swing_too(tmp_path):
    """A load that is only ever lifted bounces on the spring once nothing slows it down any more; lossless, by hand."""
    load, inertia, ratio, rotor, push = 52.0, 0.18, 80.0, 1e-4, 80.0 * 0.1 * 20.0
    motor = {
        "kind": "brushless", "current_basis": "dc", "winding_basis": "line_line", "resistance": 0.3,
        "torque_constant": 0.1, "rotor_inertia": rotor, "mass": 0.9, "nominal_current": 20, "coulomb_friction": 1e-9,
        "viscous_friction": 1e-12,
    }  # fmt: skip
    gear = {"kind": "planetary", "ratio": ratio, "efficiency": 1.0, "mass": 1.0, "inertia": 1e-12, "stiffness_1": 9e3,
            "repeated_peak_torque": 70, "momentary_torque": 80}  # fmt: skip
    table = tmp_path / "hoist.csv"
    table.write_text(f"time [s],torque_a [N m],speed_a [rad/s]\n0,{load},2.4\n1,{load},2.4\n")

    def judged(current):
        study = drivetrain.study(
            motions={"lift": {"table": str(table)}}, motors={"M": motor}, gears={"G": gear}, drives=("M", "G"),
            supply="48 V", stop={"current": current}, open_cycle=True, amplifier={"current_basis": "dc"},
            joints={"default": {"output_bearing": "external", "load_inertia": inertia}},
        )  # fmt: skip
        return check(drivetrain.evaluate(study), "a", MOMENTARY)

    found = judged(20.0)
    slowing = (push + load) / (inertia + ratio**2 * rotor)
    assert found.required == pytest.approx(load + inertia * slowing, rel=1e-6)  # it begins with less
    safe = float(re.search(r"stop current up to ([\d.]+) A", found.remark).group(1))
    assert judged(safe).required == pytest.approx(80.0, rel=2e-3)  # three digits of current
