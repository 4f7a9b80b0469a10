"""Where a run begins: under load nothing moves that is not commanded to, whatever loop holds it."""

from dataclasses import replace

import numpy as np
import pytest

import drivetrain as dt
from drivetrain.effects.effect import Effect
from drivetrain.errors import InputError
from drivetrain.simulation.engines.engine import Engine

MOTOR = dt.Motor(key="m", resistance=0.299, torque_constant=0.0302, inductance=82e-6)
GEAR = dt.Gear("g", 100.0, stiffness_1=2e4, torque_1=5.0, stiffness_2=3e4)
WEIGHT, PLACE, DURATION = 12.0, 0.4, 0.05
TIME = np.array([0.0, DURATION])
STAY = dt.CommandedMotion(
    dt.Motion("stay", ("joint",), TIME, np.full((2, 1), PLACE), np.zeros((2, 1)), np.zeros((2, 1)))
)
HOLDING = WEIGHT * np.cos(PLACE) / 100.0 / 0.0302  # A: weight at its angle, through the gear, over the torque constant
SPRING = dt.FlexibleJoint(GEAR, 4.0)
DRIVES: dict[str, list[Effect]] = {
    "cascade": [dt.CascadeLoop(20.0, 0.5, 0.1), dt.MotorCurrent(MOTOR)],
    "current loop": [dt.CascadeLoop(20.0, 0.5, 0.1), dt.CurrentLoop(MOTOR, 3000.0)],
    "digital": [
        dt.Encoder(),
        dt.SampledCascade(20.0, 0.5, 0.1, delay=1),
        dt.SampledCurrentLoop(MOTOR, 3000.0),
        dt.Winding(MOTOR),
    ],
}


def scene(effects: list[Effect], position: float | None = PLACE, rotor: float = 3e-5) -> dt.Scene:
    own = {"joint": (*effects, dt.FullRotor(rotor, 100.0)), "scene": (STAY,)}
    body = dt.Inertia(1.2, weight=WEIGHT)
    return dt.Scene(body, own, DURATION, None if position is None else np.array([position]), np.zeros(1))


@pytest.mark.parametrize("engine", [dt.FixedStep(), dt.AdaptiveStep()])
@pytest.mark.parametrize("name", DRIVES)
def test_integrators_and_currents_hold_from_the_start(name: str, engine: Engine) -> None:
    run = dt.simulate(scene(DRIVES[name]), solver=engine)
    np.testing.assert_allclose(run["joint.position"], PLACE, atol=1e-9)
    np.testing.assert_allclose(run["joint.current"], HOLDING, rtol=1e-6)
    assert run.about["start"] == f"equilibrium, held by joint {HOLDING:.3g} A"
    if name != "digital":  # its loop asks for what is not fed forward
        half = dt.simulate(scene([*DRIVES[name], dt.GivenCurrent(TIME, np.full(2, 0.4 * HOLDING))]), solver=engine)
        np.testing.assert_allclose(half["joint.position"], PLACE, atol=1e-9)
        np.testing.assert_allclose(half["joint.current"], HOLDING, rtol=1e-6)


@pytest.mark.parametrize("name", DRIVES)
def test_springs_are_twisted_by_what_they_carry(name: str) -> None:
    # The motor is where it is commanded, so the link hangs behind it by the twist, under its load there.
    run = dt.simulate(scene([*DRIVES[name], SPRING], position=None))
    link = run["joint.position"][0]
    load = WEIGHT * np.cos(link)
    assert PLACE - link == pytest.approx(5.0 / 2e4 + (load - 5.0) / 3e4, rel=1e-9)
    np.testing.assert_allclose(run["joint.position"], link, atol=1e-9)


@pytest.mark.parametrize(
    "loop",
    [dt.PositionLoop(900.0, 60.0, 0.0302), dt.CascadeLoop(15.0, 60.0 / 100.0**2 / 0.0302)],
    ids=["pd", "cascade"],
)
def test_a_loop_without_integrator_hangs_by_load_over_stiffness(loop: Effect) -> None:
    run = dt.simulate(scene([loop, dt.MotorCurrent(MOTOR)], position=None))
    link = run["joint.position"][0]
    assert PLACE - link == pytest.approx(WEIGHT * np.cos(link) / 900.0, rel=1e-6)
    np.testing.assert_allclose(run["joint.position"], link, atol=1e-7)
    fed = scene([loop, dt.MotorCurrent(MOTOR), dt.GivenCurrent(TIME, np.full(2, HOLDING))], position=None)
    np.testing.assert_allclose(dt.simulate(fed)["joint.position"], PLACE, atol=1e-9)


def test_a_joint_without_a_given_position_starts_where_its_loop_holds_it() -> None:
    effects = [dt.PositionLoop(900.0, 60.0, 0.0302), dt.MotorCurrent(MOTOR), dt.FullRotor(3e-5, 100.0), STAY]
    run = dt.simulate(dt.joint_scene(dt.Inertia(1.2, weight=WEIGHT), effects, DURATION))
    link = run["joint.position"][0]
    assert PLACE - link == pytest.approx(WEIGHT * np.cos(link) / 900.0, rel=1e-6)
    np.testing.assert_allclose(run["joint.position"], link, atol=1e-7)


@pytest.mark.parametrize("wall", [0.0, 30.0, 300.0])
def test_a_soft_loop_finds_where_it_holds_its_load(wall: float) -> None:
    """A loop of 20 N m/rad under loads that fall or rise with the angle, by up to 15 times as much."""
    stay = dt.CommandedMotion(dt.Motion("stay", ("joint",), TIME, np.full((2, 1), 2.0), np.zeros((2, 1)), [[0.0]] * 2))
    own = (dt.PositionLoop(20.0, 5.0, 0.0302), dt.MotorCurrent(MOTOR), dt.FullRotor(3e-5, 100.0))
    own += (dt.WallSpring(wall, rest=1.0),) if wall else ()
    found = dt.simulate(dt.Scene(dt.Inertia(1.2, weight=WEIGHT), {"joint": own, "scene": (stay,)}, DURATION))
    link = found["joint.position"]
    assert 20.0 * (2.0 - link[0]) - WEIGHT * np.cos(link[0]) - wall * (link[0] - 1.0) == pytest.approx(0.0, abs=1e-9)
    assert np.ptp(link) < 1e-9 and not found.events


def test_joints_of_an_arm_hold_one_another() -> None:
    arm = dt.load_arm("planar-2r")
    names, place = arm.joint_names, np.array([[0.3, -0.5]] * 2)
    motion = dt.Motion("stay", names, TIME, place, np.zeros((2, 2)), np.zeros((2, 2)))
    drive = (dt.CascadeLoop(20.0, 5.0, 0.1), dt.MotorCurrent(MOTOR))
    effects = {**dict.fromkeys(names, drive), "scene": (dt.CommandedMotion(motion),)}
    run = dt.simulate(dt.Scene(arm, effects, DURATION))
    wanted = dt.gravity_torque(arm, place[0]) / 10.0 / 0.0302
    for i, name in enumerate(names):
        np.testing.assert_allclose(run[f"{name}.current"], wanted[i], rtol=1e-6)
        np.testing.assert_allclose(run[f"{name}.position"], place[0, i], atol=1e-9)


@pytest.mark.parametrize("engine", [dt.FixedStep(), dt.AdaptiveStep()])
def test_a_force_at_the_tip_is_held_from_the_start(engine: Engine) -> None:
    """By springs, loops with and without an integrator; one of the joints has its spring on top of its loop."""
    arm = dt.load_arm("planar-2r")
    names, place = arm.joint_names, np.array([[0.3, -0.5]] * 2)
    motion = dt.Motion("stay", names, TIME, place, np.zeros((2, 2)), np.zeros((2, 2)))
    gear = dt.Gear("g", 10.0, stiffness_1=2e4, torque_1=5.0, stiffness_2=3e4)
    push, turn = np.array([20.0, -30.0, 0.0]), np.array([0.0, 0.0, 2.0])
    first = (dt.CascadeLoop(20.0, 5.0, 0.1), dt.MotorCurrent(MOTOR), dt.FlexibleJoint(gear, 4.0))
    second = (dt.CascadeLoop(20.0, 5.0), dt.MotorCurrent(MOTOR))
    whole = (dt.CommandedMotion(motion), dt.TipForce([0.0], [push], [turn]))
    effects = {names[0]: first, names[1]: second, "scene": whole}
    run = dt.simulate(dt.Scene(arm, effects, DURATION), solver=engine)
    link = np.array([run[f"{name}.position"][0] for name in names])
    rotation = dt.tip_pose(arm, link)[:3, :3]
    wrench = -np.concatenate([turn @ rotation, push @ rotation])  # what the tip applies to its environment
    load = dt.inverse_dynamics(arm, link, np.zeros(2), np.zeros(2), tip_wrench=wrench)
    for name, torque in zip(names, load, strict=True):
        np.testing.assert_allclose(run[f"{name}.current"], torque / 10.0 / 0.0302, rtol=1e-6)
        assert np.ptp(run[f"{name}.position"]) < 1e-9


def test_what_cannot_be_held_says_so() -> None:
    weak = [dt.CascadeLoop(20.0, 0.5, 0.1, peak_current=2.0), dt.MotorCurrent(MOTOR, 2.0)]
    event = next(one for one in dt.simulate(scene(weak)).events if one.name == "start")
    assert event.time == 0.0 and f"{HOLDING:.3g} A would hold it, 2 A flow" in event.detail
    # Enough to hold, more than that, or a command to move: nothing gives way.
    enough = [dt.CascadeLoop(20.0, 0.5, 0.1, peak_current=2.0 * HOLDING), dt.MotorCurrent(MOTOR)]
    more = [dt.GivenCurrent(TIME, np.full(2, 1.1 * HOLDING)), dt.MotorCurrent(MOTOR)]
    falls = replace(STAY.motion, acceleration=np.full((2, 1), -1.0))
    told = scene(weak)
    told = replace(told, effects=told.effects | {"scene": (dt.CommandedMotion(falls),)})
    for one in (scene(enough), scene(more), told):
        assert "start" not in {event.name for event in dt.simulate(one).events}


def test_given_states() -> None:
    whole = scene(DRIVES["cascade"])
    empty = dt.simulate(whole, start={"joint.integrated_current": 0.0})
    assert empty["joint.current"][0] == 0.0 and np.ptp(empty["joint.position"]) > 1e-3
    assert empty.about["start"] == "equilibrium; given: joint.integrated_current"
    with pytest.raises(InputError, match=r"joint\.integrated_current"):
        dt.simulate(whole, start={"joint.integrated_curent": 0.0})
    with pytest.raises(InputError, match="equilibrium"):
        dt.simulate(whole, start="rest")


@pytest.mark.parametrize("delay", [0, 1, 2])
def test_a_digital_computed_torque_holds_before_its_first_sample_is_given_out(delay: int) -> None:
    controller = dt.SampledComputedTorque(40.0, (("joint", 0.0302),), delay=delay)
    held = scene([dt.Encoder(), dt.MotorCurrent(MOTOR)])
    held = dt.Scene(held.body, held.effects | {"scene": (STAY, controller)}, DURATION, np.array([PLACE]), np.zeros(1))
    run = dt.simulate(held)
    np.testing.assert_allclose(run["joint.current"], HOLDING, rtol=1e-6)
    np.testing.assert_allclose(run["joint.position"], PLACE, atol=1e-9)


def test_a_rounded_equilibrium_is_no_joint_that_gives_way() -> None:
    """Far down the slope of its load the loop sags to the equilibrium up to a millionth of the current."""
    motor = dt.Motor("m", 1.07, 0.0283, inductance=7.4e-4)
    rest, still = np.array([0.0, 1.0]), np.zeros((2, 1))
    motion = dt.Motion("still", ("joint",), rest, still - 0.8, still, still)
    spring = dt.FlexibleJoint(dt.Gear("g", 300.0, stiffness_1=2.03e7), 15.2)
    effects = (
        dt.FullRotor(1.83e-4, 300.0), dt.CurrentLoop(motor, 472.0), dt.CascadeLoop(5.05, 0.515), spring,
        dt.CommandedMotion(motion), dt.StiffSupply(549.0),
    )  # fmt: skip
    run = dt.simulate(dt.joint_scene(dt.Inertia(48.36, 899.35, 3.12), effects, 0.1))
    assert not [event for event in run.events if event.name == "start"]
    assert np.ptp(run["joint.position"]) < 1e-6
