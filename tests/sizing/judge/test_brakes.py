"""Holding brakes: what they must hold, what they add, how a study names them and how `select` chooses them."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from drivetrain.catalog.read import Catalog, compatible_pairs
from drivetrain.drive.brake import Brake, stopping_energy
from drivetrain.drive.motor import braked
from drivetrain.dynamics.inverse import inverse_dynamics
from drivetrain.errors import InputError
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.sizing.answers.free_ratio import free_ratios
from drivetrain.sizing.answers.ratio import partners
from drivetrain.sizing.answers.why_not import why_not
from drivetrain.sizing.demand.changed_work import WorkFamily
from drivetrain.sizing.demand.demand import workload
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.judge.parts import FilledParts
from drivetrain.sizing.search.search import select
from drivetrain.study.change import TaskChange
from drivetrain.study.model import FreeRatio, Mount, Study
from drivetrain.study.parts.candidates import with_brakes
from drivetrain.study.parts.mounting import loaded_arm
from drivetrain.study.parts.verdicts import Verdict
from drivetrain.study.read import load_study

WEAK = Brake("weak", "motor", static_torque=0.2, inertia=1e-6, power=8.0, mass=0.1, price=10.0)
STRONG = Brake("strong", "motor", static_torque=2.0, inertia=4e-6, power=12.0, mass=0.3, energy_per_stop=50.0)
TORQUE, ENERGY = "holding brake torque", "holding brake energy"


def held_study(make, brakes=(WEAK, STRONG), **changes) -> Study:
    """Two joints that swing a payload; the second one must be held by a brake."""
    cycle = make.sines(2, samples=41, duration=3.0, size=0.6)
    cycle = replace(cycle, payload=np.where(np.arange(41) < 20, 0, -1), payload_names=("part",))
    motors, tasks = {"m1": make.motor}, [make.task("j1"), make.task("j2", brakes=brakes, drive=None)]
    pairs, rows = with_brakes(Catalog(motors), [("m1", "g1")], brakes)
    tasks[1] = replace(tasks[1], pairs=pairs, mount=Mount("child", 0.05))
    return make.study(
        cycle, arm=make.planar_arm([0.38, 0.35], [0.6, 0.6]), joints=tuple(tasks), payloads=(make.payload(1.0),),
        catalog=Catalog({**motors, **rows}, {"g1": make.gear}, brakes={one.key: one for one in brakes}), **changes,
    )  # fmt: skip


def checks_of(evaluation, joint="j2"):
    return {check.name: check for check in evaluation.joints[joint].checks}


def test_a_brake_holds_the_worst_pose_and_payload_without_the_mesh(make):
    """Against inverse dynamics of the arm with its drives mounted, at rest in each pose with what the tip carries."""
    study = held_study(make)
    found = evaluate(study, {"j2": ("m1+strong", "g1")})
    filled_parts, cycle = FilledParts(study), study.cycle
    drives = {
        "j1": filled_parts.drive(study.joints[0], "m1", "g1"),
        "j2": filled_parts.drive(study.joints[1], "m1+strong", "g1"),
    }
    still = np.zeros(2)
    torque = [
        inverse_dynamics(loaded_arm(study, drives, int(payload)), q, still, still)[1]
        for q, payload in zip(cycle.position, cycle.payload, strict=True)
    ]
    check = checks_of(found)[TORQUE]
    assert check.actual == pytest.approx(np.abs(torque).max() / make.gear.ratio, rel=1e-9)
    assert (check.factor, check.available, check.verdict) == (2.0, 2.0, Verdict.PASS)
    assert check.time == cycle.time[int(np.argmax(np.abs(torque)))]
    assert TORQUE not in checks_of(found, "j1")


def test_a_brake_loads_its_motor_and_the_arm(make):
    study = held_study(make, (STRONG,))
    found, plain = evaluate(study, {"j2": ("m1", "g1")}), evaluate(make_plain(study), {"j2": ("m1", "g1")})
    assert found.joints["j2"].motor == "m1+strong" and found.joints["j2"].brake == "strong"
    assert found.criteria["mass"] == pytest.approx(plain.criteria["mass"] + STRONG.mass)
    extra = found.joints["j1"].series.gear_torque - plain.joints["j1"].series.gear_torque
    assert np.abs(extra).max() > 0.3 * 9.81 * 0.3  # 0.3 kg near 0.38 m from the first joint
    rotor = found.joints["j2"].series.rotor_torque - plain.joints["j2"].series.rotor_torque
    acceleration = study.cycle.acceleration.sum(axis=1) + (make.gear.ratio - 1.0) * study.cycle.acceleration[:, 1]
    assert rotor == pytest.approx(STRONG.inertia * (acceleration + study.cycle.acceleration[:, 1]), rel=1e-6)


def test_a_brake_of_unknown_mass_leaves_the_motors_on_the_arm(make):
    study = held_study(make, (replace(STRONG, mass=None, inertia=0.0),))
    found, plain = evaluate(study, {"j2": ("m1", "g1")}), evaluate(make_plain(study), {"j2": ("m1", "g1")})
    assert found.verdict is Verdict.NOT_CHECKED and np.isnan(found.criteria["mass"])
    torques = (one.joints["j1"].series.gear_torque for one in (found, plain))
    np.testing.assert_allclose(*torques, rtol=1e-12)


def make_plain(study: Study) -> Study:
    """The same without a brake."""
    return replace(study, joints=(study.joints[0], replace(study.joints[1], brakes=(), drive=("m1", "g1"))))


def test_the_coil_takes_its_power_from_the_supply_and_warms_the_housing(make):
    study = held_study(make, (STRONG,))
    light = replace(study.catalog.motors["m1+strong"], brake=replace(STRONG, power=1e-9))
    idle = replace(study, catalog=replace(study.catalog, motors={**study.catalog.motors, "m1+strong": light}))
    found, without = (evaluate(one, {"j2": ("m1+strong", "g1")}) for one in (study, idle))
    # Little more than 12 W over 3 s: the warmer housing adds some copper loss.
    assert 36.0 <= found.criteria["energy"] - without.criteria["energy"] < 37.0
    assert 12.0 <= found.shared[0].required - without.shared[0].required < 13.0
    warm, cold = (one.joints["j2"].series.housing_temperature.mean() for one in (found, without))
    assert 12.0 * 4.0 <= warm - cold < 1.05 * 12.0 * 4.0  # 4 K/W from housing to ambient


def test_the_energy_of_a_stop_is_that_of_a_simulated_one(make):
    """A brake of constant torque against a constant load, marched in small steps."""
    torque, load, inertia, speed, h = 2.0, 0.7, 3e-5, 300.0, 1e-7
    heat, now = 0.0, speed
    while now > 0.0:
        heat += torque * now * h
        now -= (torque - load) / inertia * h
    assert stopping_energy(torque, load, inertia, speed) == pytest.approx(heat, rel=1e-3)
    assert stopping_energy(torque, torque, inertia, speed) == np.inf
    study = held_study(make)
    found = checks_of(evaluate(study, {"j2": ("m1+strong", "g1")}))
    parts, keys = FilledParts(study), (("m1", "g1"), ("m1+strong", "g1"))
    drives = {i: parts.drive(study.joints[i], *own) for i, own in enumerate(keys)}
    demand = workload(study).at(1, drives).demand(drives[1])
    total = make.motor.rotor_inertia + STRONG.inertia + make.gear.inertia + demand.load_inertia.max() / 2500.0
    fastest = 50.0 * np.abs(demand.speed).max()
    expected = stopping_energy(2.0, found[TORQUE].actual, total, fastest)
    assert found[ENERGY].required == pytest.approx(expected, rel=1e-9)
    weak = checks_of(evaluate(study, {"j2": ("m1+weak", "g1")}))
    assert weak[TORQUE].verdict is Verdict.FAIL and "energy per stop is not in the catalogue row" in weak[ENERGY].remark


def test_why_not_takes_a_motor_for_one_with_any_brake_of_the_joint(make):
    study = held_study(make)
    found = why_not(study, "j2", motor="m1", cost=False)
    assert found.answers[0].motor in ("m1+weak", "m1+strong")
    both = why_not(study, "j2", motor="m1", gear="g1", cost=False)
    assert both.answers[0].partners == 2


def test_selection_takes_the_lightest_brake_that_holds(make):
    study = held_study(make)
    found = select(study)
    assert found.drives["j2"] == ("m1+strong", "g1") and found.proof == "optimal"
    assert [fallen.check for fallen in found.rejected_pairs if fallen.joint == "j2"] == [TORQUE]
    weak = replace(study, safety=replace(study.safety, brake=0.2))
    assert select(weak).drives["j2"] == ("m1+weak", "g1")
    none = held_study(make, (WEAK,))
    answer = select(replace(none, joints=(none.joints[0], replace(none.joints[1], pairs=none.joints[1].pairs))))
    assert not answer.feasible and any(TORQUE in line for line in answer.advice)


@pytest.mark.parametrize("mount", ["parent", "child"])
def test_changes_of_the_task_reach_the_brake(make, mount):
    """A curve's work, made without running the arm again, and the study changed in full."""
    study = held_study(make)
    study = replace(study, joints=(study.joints[0], replace(study.joints[1], mount=Mount(mount))))
    change = TaskChange(payload=1.7, time=2.0)
    work, keys = WorkFamily(study).at(change), (("m1", "g1"), ("m1+strong", "g1"))
    drives = {i: FilledParts(study).drive(study.joints[i], *pair) for i, pair in enumerate(keys)}
    for joint in range(2):
        quick, whole = (one.at(joint, drives).demand(drives[joint]) for one in (work, workload(work.study)))
        assert (quick.static_torque is None) == (joint == 0)
        if joint:
            assert quick.static_torque == pytest.approx(whole.static_torque, abs=1e-9)


def test_a_table_tells_what_is_static_only_with_its_inertia(make):
    time = np.linspace(0.0, 2.0, 21)
    acceleration = np.cos(np.pi * time)
    cycle: Cycle = make.table_cycle(time, 12.0 + 3.0 * acceleration, np.sin(np.pi * time) / np.pi, acceleration)
    motors = {"m1+strong": braked(make.motor, STRONG)}
    for inertia, expected in ((None, 15.0), (3.0, 12.0)):
        task = make.task(drive=("m1+strong", "g1"), brakes=(STRONG,), load_inertia=inertia)
        study = make.study(cycle, joints=(task,), catalog=Catalog(motors, {"g1": make.gear}))
        check = checks_of(evaluate(study), "j1")[TORQUE]
        assert check.actual == pytest.approx(expected / 50.0)
        assert ("whole torque of the table" in check.remark) == (inertia is None)


STUDY = """
schema_version: 1
motions: {swing: {table: swing.csv}}
supply: {voltage: 48 V}
catalogs: [shipped]
joints:
  axis: {drive: {motor: maxon_625858, gear: hd_CSG-14-50-2UH}, %s}
"""


def written(tmp_path, brake, more=""):
    table = "time [s],torque_axis [N m],speed_axis [rad/s]\n0,2,0\n1,2,0.5\n2,2,0\n"
    (tmp_path / "swing.csv").write_text(table)
    (tmp_path / "study.yaml").write_text(STUDY % f"brake: {brake}" + more)
    return load_study(tmp_path / "study.yaml")


def test_a_study_names_its_brakes(tmp_path):
    one = written(tmp_path, "BR_8JSA_2").joints[0]
    assert one.drive == ("maxon_625858+BR_8JSA_2", "hd_CSG-14-50-2UH") and one.brakes[0].static_torque == 1.42
    some = written(tmp_path, "[BR_8JSA_2, BR_8JSA_3]").joints[0]
    assert some.drive is None and [motor for motor, _ in some.pairs] == [
        "maxon_625858+BR_8JSA_2", "maxon_625858+BR_8JSA_3",
    ]  # fmt: skip
    every = written(tmp_path, "true").joints[0]
    assert len(every.pairs) == len(every.brakes) > 5 and "brakes:" in every.passed_over[-1]
    own = "brakes:\n  mine: {torque_side: motor, static_torque: 1 N m, inertia: 2 g cm^2, power: 6 W, source: sheet}\n"
    assert written(tmp_path, "mine", own).joints[0].brakes[0].inertia == pytest.approx(2e-7)
    assert written(tmp_path, "false").joints[0].brakes == ()


@pytest.mark.parametrize(
    ("brake", "told"),
    [("BR_8JSA_22", "no brake has this key"), ("MAYR_8982_40", "lacks static_torque, inertia, power"), ("3.5", "name")],
)
def test_faults_of_brakes_are_told(tmp_path, brake, told):
    with pytest.raises(InputError) as error:
        written(tmp_path, brake)
    assert told in str(error.value) and "study.yaml:" in str(error.value)


def test_evaluation_wants_to_know_which_brake(make):
    study = held_study(make)
    for drives in ({}, {"j2": ("m1", "g1")}):
        with pytest.raises(InputError, match="brake"):
            evaluate(study, drives)


@pytest.mark.parametrize("brake", ["BR_8JSA_2", "[BR_8JSA_2, BR_8JSA_3]"])
def test_another_motor_may_be_tried_with_the_brakes_of_a_joint(tmp_path, brake):
    """With one brake the motor's key is enough; rules, published pairs and gears are those of the motor without it."""
    study = written(tmp_path, brake)
    motor, gear = "maxon_DCX14L01EBKL610", "hd_CSG-14-50-2UH"
    tried = evaluate(study, {"axis": (f"{motor}+BR_8JSA_2", gear)}).joints["axis"]
    assert tried.brake == "BR_8JSA_2" and tried.drive.motor.rotor_inertia > study.catalog.motors[motor].rotor_inertia
    if brake == "BR_8JSA_2":
        assert evaluate(study, {"axis": (motor, gear)}).joints["axis"].motor == tried.motor
        (free,) = free_ratios(study, free={"axis": FreeRatio(20.0, 200.0, motor=motor)}).joints
        assert free.motor == tried.motor
    (answer,) = why_not(study, "axis", motor, gear, cost=False).answers
    assert TORQUE not in answer.lacking and answer.partners == len(study.joints[0].brakes)
    published = compatible_pairs(study.catalog, [motor])
    if brake == "BR_8JSA_2":  # otherwise the study considers only its own gear, with either brake
        (answer,) = why_not(study, "axis", motor, cost=False).answers
        assert answer.partners == len(published) > 0
    assert partners(study, study.joints[0], tried.motor) == sorted(one for _, one in published)


def test_selection_with_brakes_is_brute_force(make):
    """Where brakes bind: every combination judged, each by itself."""
    rng = np.random.default_rng(5)
    for _ in range(4):
        brakes = tuple(
            Brake(f"b{i}", "motor", static_torque=float(t), inertia=1e-6, power=5.0, mass=float(0.05 + 0.2 * t))
            for i, t in enumerate(rng.uniform(0.1, 1.5, 3))
        )
        study = held_study(make, brakes)
        pairs, _ = with_brakes(study.catalog, [("m1", "g1")], brakes)
        tasks = tuple(replace(task, drive=None, brakes=brakes, pairs=pairs) for task in study.joints)
        study = replace(study, joints=tasks)
        sets = [
            (one.objective, drives)
            for drives in (dict(zip(("j1", "j2"), keys, strict=True)) for keys in itertools.product(pairs, repeat=2))
            if (one := evaluate(study, drives)).feasible
        ]
        found = select(study)
        assert found.feasible == bool(sets)
        if sets:
            assert found.objective == pytest.approx(min(sets, key=lambda one: one[0])[0], rel=1e-9)
