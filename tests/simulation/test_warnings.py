"""What a run was not made for is said by the run itself, or refused before it begins."""

import math

import numpy as np
import pytest

import drivetrain as dt
from drivetrain.drive.counterbalance import Counterbalance
from drivetrain.drive.thermal.thermal_network import ThermalNetwork
from drivetrain.effects.effect import Effect
from drivetrain.effects.loads.counterbalance_torque import CounterbalanceTorque
from drivetrain.errors import InputError
from drivetrain.simulation.engines.engine import Engine
from drivetrain.simulation.recording import Event
from drivetrain.simulation.run import _recorded, largest_change

MOTOR = dt.Motor("m", 0.3, 0.03, max_winding_temperature=155.0)


def named(run: dt.Recording, name: str) -> list[Event]:
    return [event for event in run.events if event.name == name]


def heated(current: float, duration: float, resistance: float = 2.0, housing: float = 25.0) -> dt.Recording:
    network = ThermalNetwork(resistance, 3.0, 10.0, 200.0, 25.0)
    effects = [
        dt.GivenCurrent([0.0], [current]), dt.MotorCurrent(MOTOR), dt.WindingHeat(network, housing=housing),
        dt.ViscousFriction(dt.Friction(viscous=1.0)),
    ]  # fmt: skip
    return dt.simulate(dt.joint_scene(1.0, effects, duration), solver=dt.FixedStep(1e-2), interval=0.1)


def test_winding_above_its_limit() -> None:
    assert not named(heated(6.0, 5.0), "winding")
    (event,) = named(hot := heated(20.0, 20.0), "winding")
    above = hot.time[hot["joint.winding_temperature"] > 155.0]
    assert event.time == above[0] > 0.0
    assert "155" in event.detail and "the limit of m" in event.detail


def test_magnets_above_what_they_stand() -> None:
    assert named(heated(1.0, 1.0, housing=151.0), "magnets") and not named(heated(1.0, 1.0, housing=149.0), "magnets")


def test_runaway_where_no_temperature_lasts() -> None:
    # Without end where alpha R Rth I^2 reaches 1: at 13 A of 0.3 ohm and 5 K/W with copper's 0.0039 1/K at 25 C.
    limit = math.sqrt(1.0 / (0.0039 * 0.3 * 5.0))
    assert named(heated(1.02 * limit, 5.0), "runaway")
    assert not named(heated(0.98 * limit, 5.0), "runaway")


def test_a_joint_has_one_mesh() -> None:
    gears = [dt.MeshLoss(dt.Gear(key, 50.0, efficiency=0.9)) for key in "ab"]
    with pytest.raises(InputError, match="2 mesh losses"):
        dt.plan(dt.joint_scene(1.0, [*gears, dt.FullRotor(1e-5, 50.0)], 1.0))


@pytest.mark.parametrize("what", ["winding", "housing"])
def test_nothing_is_colder_than_absolute_zero(what: str) -> None:
    network = ThermalNetwork(1.0, 3.0, 10.0, 200.0, 25.0)
    with pytest.raises(InputError, match="absolute zero"):
        dt.WindingHeat(network, **{what: -300.0})
    with pytest.raises(InputError, match="absolute zero"):
        dt.GearDrag(dt.Gear("g", 50.0), -300.0)


def test_a_gas_spring_that_leaves_its_stroke() -> None:
    """The levers' points are 0.15 to 0.35 m apart, and 0.2 m at cos q = (0.25^2 + 0.1^2 - 0.2^2) / 0.05."""

    def falls(**spring: float) -> dt.Recording:
        one = Counterbalance(gas_force=1.0, lever_carrier=0.25, lever_link=0.1, extended_length=0.36, **spring)
        return dt.simulate(dt.joint_scene(dt.Inertia(1.0, weight=5.0), [CounterbalanceTorque(one)], 1.0, position=1.2))

    assert not named(falls(stroke=0.22, progression=1.2), "gas spring")
    (event,) = named(run := falls(stroke=0.16, progression=1.2), "gas spring")
    passed = run.time[run["joint.position"] < math.acos((0.25**2 + 0.1**2 - 0.2**2) / 0.05)]
    assert event.time == passed[0] > 0.0 and "from 0.2 to 0.36 m" in event.detail
    with pytest.raises(InputError, match=r"the very start.*gas spring of counterbalance 1"):
        falls(stroke=0.02, progression=9.0, exponent=1.2)


def test_a_step_longer_than_the_motion() -> None:
    scene = dt.joint_scene(1.0, [dt.WallSpring(1.0)], 0.5, position=0.1)
    (event,) = named(dt.simulate(scene, solver=dt.FixedStep(1.0)), "step")
    assert "0.5 s" in event.detail
    assert not named(dt.simulate(scene, solver=dt.FixedStep(0.01)), "step")


@pytest.mark.parametrize(
    ("engine", "stiffness", "told"),
    [
        (dt.FixedStep(), 1e6, False), (dt.FixedStep(), 1e8, True), (dt.FixedStep(1e-4), 1e8, False),
        (dt.AdaptiveStep(), 1e10, False), (dt.AdaptiveStep(), 1e14, True),
        (dt.AdaptiveStep(dt.Rodas5P(1e-4)), 1e11, True),
    ],
)  # fmt: skip
def test_bristles_too_stiff_to_be_seen(engine: Engine, stiffness: float, told: bool) -> None:
    bristles: list[Effect] = [dt.LuGreFriction(stiffness, 1.0, 1.5, damping=0.1 * stiffness**0.5), dt.WallSpring(100.0)]
    run = dt.simulate(dt.joint_scene(1.0, bristles, 2.0, position=0.103), solver=engine, interval=0.1)
    assert bool(named(run, "LuGre stiffness")) == told
    if not told:  # stops after five half cycles, as with Coulomb friction, at -0.003 less what static friction changes
        assert run["joint.position"][-1] == pytest.approx(-0.00296, abs=3e-5)


def test_a_spring_whose_pieces_overlap() -> None:
    with pytest.raises(InputError, match="torque_1"):
        dt.Gear("g", 50.0, stiffness_1=1e3, stiffness_2=2e3, stiffness_3=3e3, torque_1=9.0, torque_2=5.0)


def test_an_ordinary_run_says_nothing() -> None:
    run = dt.simulate(dt.joint_scene(1.0, [dt.WallSpring(1.0)], 1.0, position=0.1))
    assert run.events == ()


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("position", "along the motion"), ("speed", "(peak)"), ("current", "(peak)"), ("mesh_torque", "(RMS)"),
        ("winding_temperature", "(rise)"),
    ],
)  # fmt: skip
def test_a_quantity_that_half_the_step_changes_by_more_than_a_percent_is_named(name: str, words: str) -> None:
    effects = [
        dt.GivenCurrent([0.0], [1.0]), dt.MotorCurrent(MOTOR), dt.FullRotor(1e-5, 50.0),
        dt.MeshLoss(dt.Gear("g", 50.0, efficiency=0.9)), dt.WindingHeat(ThermalNetwork(2.0, 3.0, 10.0, 200.0, 25.0)),
    ]  # fmt: skip
    plan = dt.plan(dt.joint_scene(1.0, effects, 1.0))
    rows = np.zeros((5, 1 + len(plan.layout.columns)))
    rows[:, 0], column = np.linspace(0.0, 1.0, 5), plan.layout.recorded[f"joint.{name}"][0]
    rows[:, column] = [25.0, 26.0, 29.0, 27.0, 26.0]
    start = 25.0 if name in ("position", "winding_temperature") else 0.0  # what only its range counts of
    for change in (1.009, 1.011):
        finer = rows.copy()
        finer[:, column] = start + (rows[:, column] - start) * change
        found = largest_change(("joint",), _recorded(plan, rows), _recorded(plan, finer))
        assert (f"joint.{name} {words} by 1.1 %" in found) if change > 1.01 else not found


def test_the_step_is_checked_between_output_rows_too() -> None:
    """A current that is over before the first output row, and has a peak of a third of that of half the step."""
    motor = dt.Motor("m", 0.5, 0.05, inductance=1e-4)
    scene = dt.joint_scene(2e-6, [dt.Winding(motor), dt.GivenVoltage([0.0, 0.1], [24.0, 24.0])], 0.1)
    rare, dense = (dt.simulate(scene, interval=interval) for interval in (0.01, 1e-3))
    assert rare["joint.current"].max() < 0.01 * dense["joint.current"].max()
    assert [event.detail for event in named(rare, "step")] == [event.detail for event in named(dense, "step")] != []


def test_a_bus_that_sinks_between_output_rows_is_checked_too() -> None:
    """A pulse of 40 ms takes 24 V down to 2 V; rows are 0.1 s apart."""
    motor = dt.Motor("m", 0.299, 0.0302, inductance=82e-6)
    pulse = dt.GivenCurrent([0.0, 0.01, 0.03, 0.04, 0.2], [0.0, 0.0, 25.0, 0.0, 0.0])
    joint = (dt.ReflectedRotor(0.0), dt.CurrentLoop(motor, 3000.0), pulse)
    scene = dt.Scene(dt.Inertia(1.1e-4), {"joint": joint, "scene": (dt.SupplyBus(24.0, 4e-4, power=20.0),)}, 0.2)
    rare, dense = (dt.simulate(scene, interval=interval) for interval in (0.1, 1e-3))
    assert rare["scene.bus_voltage"].min() == pytest.approx(24.0) and dense["scene.bus_voltage"].min() < 3.0
    assert named(rare, "bus") == named(dense, "bus") != []


def test_what_strikes_within_a_step_is_said() -> None:
    """A swing of 158 rad/s on a wall's spring: a millisecond runs ahead of the cosine, and says what does not."""
    swing = math.sqrt(2.5e4)
    off, told = [], []
    for step in (1e-3, 1.25e-4):
        scene = dt.joint_scene(1.0, [dt.WallSpring(2.5e4)], 2.0, position=0.01)
        run = dt.simulate(scene, solver=dt.FixedStep(step))
        apart = run["joint.speed"] + 0.01 * swing * np.sin(swing * run.time)
        off.append(math.sqrt(float(np.mean(apart**2))) / (0.01 * swing))
        told += [named(run, "step")]
    assert (
        off[0] > 0.1
        and "joint.position" in told[0][0].detail
        and "a step of 0.000125 s is short enough" in told[0][0].detail
    )
    assert off[1] < 0.02 and not told[1]


def test_a_brake_that_bites_before_a_stiff_spring() -> None:
    """The link then rings on the gear's spring, at 16e3 rad/s: a step of a millisecond sees a third of its torque."""
    link, gear = 2e-4, dt.Gear("g", 100.0, stiffness_1=5e4)
    brake = dt.HoldingBrake(2000.0, engages=(0.01,))
    scene = dt.joint_scene(link, [dt.FullRotor(5e-5, 100.0), dt.FlexibleJoint(gear), brake], 0.1, speed=1.0)
    (event,) = named(dt.simulate(scene), "step")
    enough = float(event.detail.rpartition("; a step of ")[2].partition(" s is short enough")[0])
    torque = 1.0 * math.sqrt(link * 5e4 / 2.0)  # RMS of the swing that the link's speed makes
    rms = [
        math.sqrt(float(np.mean(run["joint.mesh_torque"][run.time > 0.02] ** 2)))
        for run in (dt.simulate(scene, solver=dt.FixedStep(step), interval=7.3e-5) for step in (1e-3, enough))
    ]
    assert "joint.mesh_torque (RMS)" in event.detail
    assert rms[0] < 0.5 * torque and rms[1] == pytest.approx(torque, rel=0.02)


def test_play_that_rattles_is_said() -> None:
    """Between flanks of 1 mrad at 2000 rad/s no step of a millisecond finds the instants of the strikes."""
    gear = dt.Gear("g", 1.0, stiffness_1=2e6, backlash=1e-3)
    effects = [dt.ReflectedRotor(1.0, 1.0), dt.Backlash(gear), dt.WallSpring(100.0)]
    scene = dt.joint_scene(1.0, effects, 1.0, position=0.1)
    run, known = (dt.simulate(scene, solver=solver) for solver in (dt.FixedStep(), dt.AdaptiveStep(dt.Rodas5P(1e-9))))
    assert np.abs(run["joint.speed"] - known["joint.speed"]).max() > 0.05 * known["joint.speed"].max()
    assert named(run, "step") and not named(known, "step")


def test_stick_slip_of_which_a_step_sees_too_little_is_said() -> None:
    """A link on a belt, held by its gear's spring: slips of 90 ms whose speed of Stribeck passes within a step."""
    friction = dt.Friction(coulomb=0.5, static=0.94, stribeck_speed=1.2e-3)
    gear = dt.Gear("g", 100.0, stiffness_1=50.0)
    effects = [dt.DryFriction(friction), dt.MovingBelt(0.17), dt.FlexibleJoint(gear), dt.ReflectedRotor(1.0, 100.0)]
    scene = dt.joint_scene(0.038, effects, 1.0)
    known = dt.simulate(scene, solver=dt.AdaptiveStep(dt.Rodas5P(1e-9)))
    for step, told in ((1e-3, True), (2.5e-5, False)):
        run = dt.simulate(scene, solver=dt.FixedStep(step))
        off = np.abs(run["joint.position"] - known["joint.position"]).max() / np.ptp(known["joint.position"])
        assert bool(named(run, "step")) == told == bool(off > 0.02)


def test_half_a_step_is_half_of_what_samples_leave_of_it() -> None:
    """Samples of 0.1 ms shorten a step of 1 ms already: half of it would compare a run with itself."""
    motor = dt.Motor("m", 0.3, 0.03, inductance=1e-4)
    wanted = dt.GivenCurrent([0.0, 0.1], [0.0, 9.0])
    loop = [dt.SampledCurrentLoop(motor, 3000.0, 1e-4), dt.Winding(motor), wanted, dt.StiffSupply(48.0)]
    scene = dt.joint_scene(0.1, [*loop, dt.ReflectedRotor(1e-5, 50.0), dt.WallSpring(1e3)], 0.1)
    run = dt.simulate(scene, verify=True, interval=1e-3)
    assert all(here != there for here, there in (run.verified[f"joint.{what}_current"] for what in ("peak", "rms")))
