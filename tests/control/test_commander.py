"""The commander: the currents of sizing, no chatter at rest, all limits, and the same results in C."""

from __future__ import annotations

import ctypes
import math
import shutil
import subprocess
import tracemalloc
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from crank_arm import DIFFERENTIAL, GEAR, MOTOR, short_crank, two_links
from pinned_arm import constrained

from drivetrain.arm.coupling import belts_over, placed, with_coupling
from drivetrain.catalog.read import Catalog
from drivetrain.control.c_code import Tape, write_c
from drivetrain.control.commander import SLOW, WHOLE_AT, Commander
from drivetrain.drive.amplifier import Amplifier, Supply
from drivetrain.drive.counterbalance import Counterbalance
from drivetrain.drive.friction import Friction
from drivetrain.dynamics.closed import whole_motion
from drivetrain.errors import InputError
from drivetrain.motion.base import Swing, harmonic_motion
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.study.parts.mounting import with_sharing
from drivetrain.study.read import load_study
from drivetrain.whole_files import shipped

ROUGH = Friction(coulomb=0.4, coulomb_negative=0.5, viscous=0.3, static=0.7, stribeck_speed=0.2)
SPRING = Counterbalance(stiffness=8e3, free_length=0.15, lever_carrier=0.2, lever_link=0.08, dead_centre=0.4)
GAS = Counterbalance(gas_force=300.0, extended_length=0.35, stroke=0.2, progression=1.5, exponent=1.2,
                     lever_carrier=0.25, lever_link=0.09, dead_centre=-1.0)  # fmt: skip
TABLE = Counterbalance(angles=(-1.0, 1.0), torques=(-3.0, 3.0))
BALANCES = {"j1": (SPRING, Counterbalance(torque=-2.0)), "j3": (GAS,)}
WIDE = Amplifier(peak_current=200.0, continuous_current=100.0)


def lossy(make, *, amplifier: Amplifier = WIDE, coupled: bool = False, **changes):
    """A study with friction at joint and motor, a gear with loss and drag, a payload; if coupled a belt to joint 2."""
    names = ("j1", "j2", "j3")
    arm = make.planar_arm([0.3, 0.3, 0.2], [1.5, 1.0, 0.5])
    group = ("j2", "j3") if coupled else ()
    tasks = tuple(
        make.task(name, friction=ROUGH, motor_friction=Friction(0.01, viscous=1e-5), amplifier=amplifier,
                  coupled=group if name in group else (), counterbalances=BALANCES.get(name, ()))
        for name in names
    )  # fmt: skip
    arm = with_coupling(arm, placed(belts_over([1.0]), (1, 2), 3)) if coupled else arm
    gear = replace(make.gear, no_load_torque=0.02, ratio=-50.0)
    cycle = make.sines(3)
    cycle = replace(cycle, payload=np.where(cycle.time < 1.0, -1, 0), payload_names=("part",))
    catalog = Catalog({"m1": make.motor}, {"g1": gear})
    return make.study(cycle, arm=arm, joints=tasks, catalog=catalog, payloads=(make.payload(1.0),), **changes)


def ur5():
    """The example with one of each joint's candidates."""
    study = load_study(shipped("examples") / "ur5_pick_and_place" / "study.yaml")
    wide = tuple(replace(task, amplifier=replace(task.amplifier, peak_current=200.0)) for task in study.joints)
    study = replace(study, joints=wide, supply=Supply(400.0))
    return evaluate(study, {task.name: task.pairs[len(task.pairs) // 2] for task in study.joints})


def palletiser():
    """The example with one of each joint's candidates."""
    study = load_study(shipped("examples") / "palletiser" / "study.yaml")
    pairs = [("servo_5", "cycloid_2500"), ("servo_2", "cycloid_1200")] * 2
    return evaluate(study, dict(zip(study.arm.joint_names, pairs, strict=True)))


WHICH = ("lossy", "coupled", "two motors", "moving base", "ur5")
CLOSED = ("palletiser", "four-bar", "coupled four-bar")
EXAMPLES = {
    "ur5": ur5, "palletiser": palletiser, "four-bar": lambda: evaluate(two_links(closures=short_crank())),
    "coupled four-bar": lambda: evaluate(two_links(closures=short_crank(), coupling=[DIFFERENTIAL])),
}  # fmt: skip
SWINGS = {"z": Swing(0.3, 1.5), "x": Swing(0.2, 2.5, 0.4), "yaw": Swing(0.4, 2.0, 1.0), "roll": Swing(0.2, 1.8)}


def built(make, which: str, **changes):
    """A study of the given kind; with two motors the first joint's are preloaded against each other."""
    study = lossy(make, coupled=which == "coupled", **changes)
    if which == "moving base":
        return replace(study, base=harmonic_motion(SWINGS, study.cycle.time))
    if which == "two motors":
        tasks = (replace(study.joints[0], preload=3.0, output_bearing="external"), *study.joints[1:])
        arm, cycle, tasks = with_sharing(study.arm, study.cycle, tasks)
        return replace(study, arm=arm, cycle=cycle, joints=tasks)
    return study


def carried(study, k: int):
    """Motion of the base at a sample."""
    base = study.base
    return {} if base is None else {"base": (base.position[k], base.velocity[k], base.acceleration[k])}


@pytest.mark.parametrize("which", WHICH + CLOSED)
def test_the_torques_are_those_of_the_evaluation(make, which: str) -> None:
    """At all samples where friction is not reduced; the judge's kernel computes the same motion independently."""
    found = EXAMPLES[which]() if which in EXAMPLES else evaluate(built(make, which, supply=Supply(400.0)))
    commander, cycle, compared = Commander(found), found.study.cycle, 0
    names = (None, *(one.name for one in found.study.payloads))
    for k in range(0, len(cycle.time), 3):
        if names[cycle.payload[k] + 1] != commander.payload:
            commander.carry(names[cycle.payload[k] + 1])
        for heat in ("winding_temperature", "housing_temperature"):
            commander.axes["heat"][heat] = found.study.ambient
        commander(cycle.position[k], cycle.velocity[k], cycle.acceleration[k], **carried(found.study, k))
        for i, joint in enumerate(found.joints.values()):
            if abs(joint.series.speed[k]) > SLOW * np.abs(joint.series.speed).max():
                motor = joint.drive.motor
                cold = motor.torque_constant * (1.0 + motor.magnet_coefficient * (
                    found.study.ambient - motor.reference_temperature))  # fmt: skip
                torque = joint.series.motor_torque
                assert cold * commander.wanted[i] == pytest.approx(torque[k], abs=1e-9 * np.abs(torque).max())
                compared += 1
    assert compared > min(80, len(cycle.time) // 2)


def test_noise_at_rest_does_not_chatter(make) -> None:
    """Speed noise of a tenth of the fading speed changes the current by less than a tenth of the change at a reversal.

    At rest the current is that of a mesh without loss, and it is continuous through zero speed.
    """
    found = evaluate(lossy(make, supply=Supply(400.0)))
    commander, nothing, q = Commander(found), np.zeros(3), np.array([0.3, 0.2, -0.4])
    slow = SLOW * np.array([np.abs(joint.series.speed).max() for joint in found.joints.values()])
    rest = commander(q, nothing, nothing).copy()
    ways = [commander(q, way * slow, nothing).copy() for way in (1.0, -1.0)]
    jump = np.abs(ways[0] - ways[1])
    assert (jump > 0.1).all()
    rng = np.random.default_rng(1)
    noisy = np.array([commander(q, 0.1 * slow * rng.uniform(-1, 1, 3), nothing).copy() for _ in range(300)])
    assert (np.ptp(noisy, axis=0) <= 0.11 * jump).all()
    steps = np.array([commander(q, x * slow, nothing).copy() for x in np.linspace(-1.5, 1.5, 3001)])
    assert (np.abs(np.diff(steps, axis=0)) < 2e-3 * jump).all()
    lossless = np.array([(a + b) / 2 for a, b in zip(*ways, strict=True)])
    np.testing.assert_allclose(rest, lossless, atol=0.1)


def test_the_voltage_does_not_exceed_the_supply(make) -> None:
    """The winding's voltage, including inductance, never exceeds the supply, and equals it if it is the limit."""
    found = evaluate(lossy(make, supply=Supply(7.0)))
    commander, cycle, motor = Commander(found, rate=1000.0), found.study.cycle, make.motor
    volts, before, short = 0.95 * 7.0, np.zeros(3), 0
    cold = motor.torque_constant * (1.0 + motor.magnet_coefficient * (25.0 - motor.reference_temperature))
    for k in range(len(cycle.time)):
        commander.reset()
        commander.axes["current"] = before
        current = commander(cycle.position[k], cycle.velocity[k], cycle.acceleration[k]).copy()
        resistance = motor.resistance
        asked = cold * -50.0 * cycle.velocity[k] + resistance * current + motor.inductance * (current - before) * 1e3
        assert (np.abs(asked) <= volts * (1.0 + 1e-9)).all()
        cut = np.abs(current - commander.wanted) > 1e-9
        np.testing.assert_allclose(np.abs(asked[cut]), volts, rtol=1e-9)
        short += int(cut.sum())
        before = current
    assert short > 20


def test_overload_folds_back_when_amplifiers_do(make) -> None:
    """From the cold state the peak current lasts as long as the I2t law states; then the continuous current remains."""
    amplifier = Amplifier(peak_current=3.0, continuous_current=1.5, peak_time=2.0)
    study = lossy(make, amplifier=amplifier)
    slow = replace(amplifier, peak_time=None, thermal_time_constant=3.5)
    for limits, wanted in ((amplifier, 2.0), (slow, 3.5 * math.log(4.0 / 3.0))):
        tasks = tuple(replace(task, amplifier=limits) for task in study.joints)
        commander = Commander(evaluate(replace(study, joints=tasks)), rate=100.0)
        nothing, hard = np.zeros(3), np.array([100.0, 0.0, 0.0])
        course = np.array([abs(commander(nothing, nothing, hard)[0]) for _ in range(600)])
        lasts = np.flatnonzero(course < 2.999)[0] / 100.0
        assert lasts == pytest.approx(wanted, abs=0.011)  # one tick
        np.testing.assert_allclose(course[int(lasts * 100) + 2 :], 1.5, rtol=1e-9)
        assert commander.overload[0] == pytest.approx(1.0)


def test_an_amplifier_without_overload_capacity_reports_none_used(make) -> None:
    """If the continuous current is the peak current there is no I2t limit, so the used share is zero."""
    amplifier = Amplifier(peak_current=3.0, continuous_current=3.0, peak_time=2.0)
    commander = Commander(evaluate(lossy(make, amplifier=amplifier)), rate=100.0)
    commander(np.zeros(3), np.zeros(3), np.full(3, 100.0))
    np.testing.assert_array_equal(commander.overload, np.zeros(3))


@pytest.mark.parametrize("speed", [0.0, 2.0])
def test_a_hot_winding_gets_less_current(make, speed: float) -> None:
    """Temperatures against an integration of both nodes in small steps, with motor friction as heat of the housing.

    The limit of 125 C is never exceeded.
    """
    study = lossy(make)
    study = replace(study, joints=tuple(replace(task, gear_heat=0.0) for task in study.joints))
    commander = Commander(evaluate(study), rate=20.0)
    motor, nothing, hard = make.motor, np.zeros(3), np.array([60.0, 0.0, 0.0])
    winding = housing = 25.0
    inner, outer = motor.resistance_winding_housing, motor.resistance_housing_ambient
    cw, ch = motor.winding_time_constant / inner, motor.housing_time_constant / outer
    copper = 0.0039 / (1.0 + 0.0039 * (motor.reference_temperature - 25.0))
    moving, hottest, turning = np.array([speed, 0.0, 0.0]), 0.0, 50.0 * speed
    rubbed = (0.01 + 1e-5 * turning) * turning  # friction of the motor's shaft in ``lossy`` [W]
    for _ in range(20 * 120):
        amperes = float(commander(nothing, nothing, hard, nothing, moving)[0])
        resistance = motor.resistance * (1.0 + copper * (winding - motor.reference_temperature))
        for _ in range(20):
            flow = (winding - housing) / inner
            winding += (resistance * amperes**2 - flow) / cw / 400.0
            housing += (flow + rubbed - (housing - 25.0) / outer) / ch / 400.0
        hottest = max(hottest, float(commander.winding_temperature[0]))
        assert commander.winding_temperature[0] == pytest.approx(winding, abs=0.3)
    assert 115.0 < hottest <= 125.0
    assert abs(amperes) < 0.6 * abs(commander.wanted[0])


def test_feedback_adds_the_stated_acceleration(make) -> None:
    """An error adds exactly the acceleration bandwidth^2 e + 2 bandwidth e'."""
    found = evaluate(lossy(make, supply=Supply(4000.0)))
    commander = Commander(found, bandwidth=25.0)
    q, qd, nothing = np.array([0.3, 0.2, -0.4]), np.array([1.0, -1.0, 0.5]), np.zeros(3)
    off, rate = np.array([0.01, -0.02, 0.0]), np.array([0.1, 0.0, -0.05])
    commander(q, qd, nothing, q - off, qd - rate)
    wanted = commander.wanted
    commander.reset()
    commander(q, qd, 25.0**2 * off + 2.0 * 25.0 * rate)
    np.testing.assert_allclose(wanted, commander.wanted, rtol=1e-12)


STRICT = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-O1", "-shared", "-fPIC"]


def compiled(commander: Commander, folder: Path) -> ctypes.CDLL:
    files = write_c(commander, folder / "arm.c", name="arm")
    assert set(files) == {"arm.c", "arm.h"}
    cc = shutil.which("cc") or shutil.which("gcc")
    assert cc, "a C compiler is needed"
    subprocess.run([cc, *STRICT, "-o", folder / "arm.so", folder / "arm.c", "-lm"], check=True)
    return ctypes.CDLL(str(folder / "arm.so"))


def at(array):
    return array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


@pytest.mark.parametrize("far", [1.0, 1e4])
@pytest.mark.parametrize("which", WHICH)
def test_the_c_code_gives_the_same_currents(make, tmp_path: Path, which: str, far: float) -> None:
    """Random consecutive ticks that reach all limits agree to 1e-12 of the largest current.

    This includes targets far beyond any arm's, there without the gears' heat, with its rounding of loads of 1e8 N m.
    """
    tight = Amplifier(peak_current=9.0, continuous_current=3.0, peak_time=0.5)
    study = built(make, which, amplifier=tight, supply=Supply(20.0))
    found = ur5() if which == "ur5" else evaluate(study)
    if far > 1.0:
        cool = tuple(replace(task, gear_heat=0.0) for task in found.study.joints)
        drives = {name: (one.motor, one.gear) for name, one in found.joints.items()}
        found = evaluate(replace(found.study, joints=cool), drives)
    commander = Commander(found, rate=50.0)
    if which != "coupled":
        commander.carry(commander.study.payloads[0].name)
    commander.reset(winding=80.0, housing=60.0)
    there, n = compiled(commander, tmp_path), len(commander.joints)
    state, current = np.zeros((4, n)), np.zeros(n)
    there.arm_start(at(state))
    rng, worst, limited, largest = np.random.default_rng(7), 0.0, 0, 0.0
    for k in range(800):
        targets = rng.uniform(-1.0, 1.0, (5, n)) * np.array([[3.0], [3.0], [10.0], [3.0], [3.0]])
        targets[[0, 2, 3]] *= far
        base = rng.uniform(-1.0, 1.0, (3, 6))
        targets[1] *= rng.choice([1.0, 0.003, 0.0])  # including reduced friction, and rest
        targets[3:] = targets[3:] if k % 4 == 0 else targets[:2]
        moves = which == "moving base"
        ours = commander(*targets, **({"base": base} if moves else {}))
        given = [at(row) for row in (*targets, *([base] if moves else []), current)]
        assert there.arm_step(at(state), *given) == 0
        worst, largest = max(worst, np.abs(ours - current).max()), max(largest, np.abs(current).max())
        limited += int((np.abs(commander.wanted - ours) > 1e-6).sum())
    assert limited > 100 and worst <= 1e-12 * largest
    assert largest <= (200.0 if which == "ur5" else 9.0)  # the amplifiers' limit, exactly
    np.testing.assert_allclose(state[2], commander.winding_temperature, rtol=1e-12)
    before = state.copy()
    targets[2, 0] = np.nan
    assert there.arm_step(at(state), *given[:2], at(targets[2]), *given[3:]) == 1
    np.testing.assert_array_equal(state, before)


@pytest.mark.parametrize("which", CLOSED)
def test_closed_loops_in_c_are_the_same(tmp_path: Path, which: str) -> None:
    """Consecutive ticks near and far from each other; both refuse positions out of reach, with unchanged states."""
    commander = Commander(EXAMPLES[which](), rate=50.0)
    there, n = compiled(commander, tmp_path), len(commander.joints)
    places = commander.memory[WHOLE_AT]
    state, current = np.zeros(4 * n + len(places)), np.zeros(n)
    there.arm_start(at(state))
    start, rng, worst, largest, refused = commander.study.cycle.position[0], np.random.default_rng(5), 0.0, 0.0, 0
    for k in range(750):
        spread = (0.01, 0.5, 20.0 if which == "palletiser" else 3.0)[k % 3]
        targets = rng.uniform(-1.0, 1.0, (5, n)) * np.array([[spread], [3.0], [30.0], [0.01], [3.0]])
        targets[0] += start
        targets[1] *= rng.choice([1.0, 0.003, 0.0])
        targets[3] = targets[3] + targets[0] if k % 4 == 0 else targets[0]
        before, kept, cooler = state.copy(), places["place"].copy(), commander.winding_temperature.copy()
        result = there.arm_step(at(state), *(at(row) for row in (*targets, current)))
        try:
            ours = commander(*targets)
        except InputError as error:
            assert "cannot be reached by the linkage" in str(error) and result == 2
            np.testing.assert_array_equal(state, before)
            np.testing.assert_array_equal(places["place"], kept)
            refused += 1
            continue
        assert result == 0
        worst, largest = max(worst, np.abs(ours - current).max()), max(largest, np.abs(current).max())
        # The rise within one tick is compared, since rounding differences add up over all ticks; temperatures have 16
        # digits.
        rise, ours_rise = (state - before)[2 * n : 3 * n], commander.winding_temperature - cooler
        np.testing.assert_allclose(rise, ours_rise, rtol=0.0, atol=1e-12 * np.abs(cooler).max())
        # Pins are closed at all positions.
        if k % 50 == 0:
            wanted = whole_motion(commander.study.arm.linkage, targets[:1], targets[1:2], targets[2:3])
            np.testing.assert_allclose(places["place"], wanted.position[0], atol=1e-9)
        np.testing.assert_allclose(state[4 * n :], places["place"], atol=1e-12)
    assert worst <= 1e-12 * largest and 10 < refused < 1000
    commander.reset()
    np.testing.assert_array_equal(places["place"], commander._start)


def test_ideal_drives_move_the_linkage_as_pinocchio_does() -> None:
    """With lossless, massless drives, the commanded torques give the target accelerations in pinocchio."""
    light = {
        "motor": {"rotor_inertia": 1e-12},
        "gear": {"efficiency": 1.0, "inertia": 1e-12},
        "brake": {"inertia": 1e-12},
    }
    study = two_links(closures=short_crank(), drive_mass="included", **light)
    commander, moved = Commander(evaluate(study)), constrained(study.arm)
    rng, motor = np.random.default_rng(3), MOTOR
    for _ in range(20):
        q, qd, qdd = (size * rng.uniform(-1.0, 1.0, 2) for size in (0.4, 3.0, 10.0))
        commander(q, qd, qdd)
        whole = whole_motion(study.arm.linkage, q[None], qd[None], qdd[None])
        torque = commander.wanted * motor["torque_constant"] * GEAR["ratio"]
        found = moved(whole.position[0], whole.velocity[0], torque)
        np.testing.assert_allclose(found, whole.acceleration[0], atol=1e-6 * np.abs(whole.acceleration).max())


def test_the_motion_of_a_moving_base_is_required(make) -> None:
    moving, still = (Commander(evaluate(built(make, which))) for which in ("moving base", "lossy"))
    rest = np.zeros((3, 3))
    for wrong, problem in ((None, "moves: its motion"), (np.zeros(6), "shape"), (np.full((3, 6), np.nan), "finite")):
        with pytest.raises(InputError, match=problem) as told:
            moving(*rest, base=wrong)
        assert [fault.place for fault in told.value.faults] == ["base"]
    with pytest.raises(InputError, match="stands still") as told:
        still(*rest, base=np.zeros((3, 6)))
    assert [fault.place for fault in told.value.faults] == ["base"]


def test_memory_does_not_grow(make) -> None:
    commander, row = Commander(evaluate(lossy(make))), np.zeros(3)
    commander(row, row, row)
    tracemalloc.start()
    before = tracemalloc.get_traced_memory()[0]
    for _ in range(2000):
        commander(row, row, row)
    assert tracemalloc.get_traced_memory()[0] - before < 2000  # bytes; one leaked float per tick would be 48 000
    tracemalloc.stop()


@pytest.mark.parametrize(
    ("wrong", "places"),
    [
        (([0, 0], [0, 0, 0], [0, 0, 0]), ["q"]),
        (([0, 0, np.nan], [0, 0, 0], [0, 0, 0]), ["q"]),
        (([0, 0, 0], [0, 0, np.inf], [0, 0, 0]), ["qd"]),
        (([0, 0, 0], [0, 0, 0], [0, 0, 1e200]), ["qdd"]),
        (("abc", [0, 0, 0], [0, 0, 0]), ["q"]),
        (([0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0], [np.nan, 0, 0]), ["measured_q", "measured_qd"]),
    ],
)
def test_invalid_arguments_of_a_tick_are_errors(make, wrong, places) -> None:
    commander = Commander(evaluate(lossy(make)))
    before = commander([0.1, 0, 0], [0, 0, 0], [0, 0, 0]).copy()
    with pytest.raises(InputError) as told:
        commander(*wrong)
    assert [fault.place for fault in told.value.faults] == places
    np.testing.assert_array_equal(commander.axes["current"], before)


def test_temperatures_of_a_reset_must_be_numbers(make) -> None:
    commander = Commander(evaluate(lossy(make)))
    for name in ("winding", "housing"):
        with pytest.raises(InputError, match=name):
            commander.reset(**{name: [30.0, math.nan, 30.0]})
    commander.reset(winding=[30.0, 40.0, 50.0])
    assert commander.winding_temperature.tolist() == [30.0, 40.0, 50.0]
    assert commander.axes["heat"]["housing_temperature"].tolist() == [25.0, 25.0, 25.0]


def test_invalid_commanders_are_errors(make) -> None:
    found = evaluate(lossy(make))
    time = np.linspace(0.0, 1.0, 11)
    for wrong, problem in (
        (lambda: Commander(make.study(make.table_cycle(time, time, time, time))), "arm"),
        (lambda: Commander(found, rate=0.0), "rate"),
        (lambda: Commander(found, bandwidth=-1.0), "bandwidth"),
        (lambda: Commander(found, payload="prat"), "part"),
        (lambda: Commander("ur5"), "study"),
        (
            lambda: Commander(
                evaluate(
                    replace(lossy(make), joints=(make.task("j1", counterbalances=(TABLE,)), *lossy(make).joints[1:]))
                )
            ),
            "without a table",
        ),
        (lambda: Commander(replace(lossy(make), joints=(make.task(drive=None), *lossy(make).joints[1:]))), "no drive"),
    ):
        with pytest.raises(InputError, match=problem):
            wrong()


def test_symbols_refuse_to_be_branched_on() -> None:
    tape = Tape()
    x = tape.input("x")
    assert (x + 0.0) is x and x * 0.0 == 0.0 and (x * 2.0) is (x * 2.0)
    assert x * 1.0 is x is 1.0 * x and x / 1.0 is x and -1.0 * x is (-x) is x * -1.0 and 0.0 - x is -x
    for unknown in (np.tan, np.add.accumulate):
        with pytest.raises(TypeError):
            unknown(x)
    with pytest.raises(TypeError, match="branches"):
        max(x, 1.0)
