"""The plan: who needs whom, what contradicts, and that neither order nor bystanders leave a trace."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

import drivetrain as dt
from drivetrain.drive.counterbalance import Counterbalance
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.drive.thermal.thermal_network import ThermalNetwork
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports, Signal, State
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.friction.viscous_friction import ViscousFriction
from drivetrain.effects.gear.mesh_loss import MeshLoss
from drivetrain.effects.gear.springs import FlexibleJoint
from drivetrain.effects.laws import joint_law
from drivetrain.effects.loads.counterbalance_torque import CounterbalanceTorque
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.loads.wall_spring import WallSpring
from drivetrain.effects.motor.given import GivenCurrent
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.effects.motor.rotor import FullRotor
from drivetrain.effects.motor.winding_heat import WindingHeat
from drivetrain.errors import InputError
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.planning.plan import plan
from drivetrain.simulation.recording import load_recording
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Inertia, Scene, joint_scene

MOTOR = Motor("m", 0.299, 0.0302)
GEAR = Gear("g", 100.0, kind="strain_wave", efficiency=0.8)


@dataclass
class Given:
    given: float = 0.0


@joint_law(Given)
def _copy(t: Any, h: Any, own: Any, joint: Any) -> None:
    own.given = joint.load.speed


@dataclass(frozen=True)
class Copy(Effect):
    needed: str
    given: str

    compute = _copy

    def ports(self, place: Place) -> Ports:
        return Ports(needs=(Signal(self.needed, "-"),), provides=(Signal(self.given, "-", path="given"),))

    def own(self, place: Place) -> Given:
        return Given()


@dataclass
class Travelled:
    travelled: float = 0.0
    travelled_rate: float = 0.0


@joint_law(Travelled)
def _travel(t: Any, h: Any, own: Any, joint: Any) -> None:
    own.travelled_rate = abs(joint.load.speed)


@dataclass(frozen=True)
class Odometer(Effect):
    """A state and no feedback."""

    compute = _travel

    def ports(self, place: Place) -> Ports:
        return Ports(states=(State("travelled", "rad"),), needs=(s.SPEED,))

    def own(self, place: Place) -> Travelled:
        return Travelled()


def drive() -> list[Effect]:
    return [
        FullRotor(3e-5, 100.0),
        DryFriction(Friction(coulomb=0.015, static=0.025, stribeck_speed=5.0), "motor"),
        DryFriction(Friction(coulomb=0.005), "motor"),
        DryFriction(Friction(coulomb=1.0)),
        ViscousFriction(Friction(viscous=5e-6), "motor"),
        MeshLoss(GEAR),
        MotorCurrent(MOTOR),
        WindingHeat(ThermalNetwork(1.9, 4.65, 21.8, 241.0, 25.0), every=0.02),
        GivenCurrent([0.0, 0.3, 0.3, 1.0], [0.0, 8.0, -8.0, 2.0]),
    ]


def test_order_of_declaration_changes_no_bit() -> None:
    effects = drive()
    first = simulate(joint_scene(Inertia(1.2, weight=10.0), effects, 1.0))
    rng = np.random.default_rng(5)
    for _ in range(6):
        shuffled = [effects[i] for i in rng.permutation(len(effects))]
        other = simulate(joint_scene(Inertia(1.2, weight=10.0), shuffled, 1.0))
        assert list(other.series) == list(first.series)
        for name in first.series:
            np.testing.assert_array_equal(other[name], first[name])


def test_order_of_joints_in_the_scene_changes_no_bit() -> None:
    arm = dt.load_arm("ur5")
    pairs = {n: (DryFriction(Friction(coulomb=2.0)), FullRotor(3e-5, 100.0)) for n in arm.joint_names}
    runs = [simulate(Scene(arm, dict(items), 0.3)) for items in (pairs.items(), reversed(list(pairs.items())))]
    for name in runs[0].series:
        np.testing.assert_array_equal(runs[0][name], runs[1][name])


def test_an_effect_without_feedback_leaves_the_motion_alone_to_the_bit() -> None:
    without = simulate(joint_scene(1.2, drive(), 1.0))
    beside = simulate(joint_scene(1.2, [*drive(), Odometer()], 1.0))
    assert "joint.travelled" in beside.series and "joint.travelled" not in without.series
    for name in without.series:
        np.testing.assert_array_equal(beside[name], without[name])
    path = np.abs(np.diff(without["joint.position"])).sum()
    assert beside["joint.travelled"][-1] == pytest.approx(path, rel=1e-3)  # turning points lie between the samples


def test_an_absent_effect_has_no_state_and_no_call() -> None:
    bare, full = plan(joint_scene(1.0, [], 1.0)), plan(joint_scene(1.0, drive(), 1.0))
    assert len(bare.memory.states) == 2 and not bare.groups
    # Two kinds of calls for nine effects' worth of laws: those of one kind share one.
    assert {group.kind for group in full.groups if len(group.instances) == 3} == {DryFriction}


def test_what_is_needed_must_be_given() -> None:
    with pytest.raises(InputError, match=r"needs joint.current_command"):
        plan(joint_scene(1.0, [MotorCurrent(MOTOR)], 1.0))
    with pytest.raises(InputError, match=r"joint.deflection"):
        plan(joint_scene(1.0, [Copy("deflection", "seen")], 1.0))


def test_what_acts_on_nothing_is_refused() -> None:
    """A current without a motor, a wall at the tip of no arm."""
    with pytest.raises(InputError, match=r"GivenCurrent of joint: has no effect.* joint.current_command"):
        dt.plan(dt.joint_scene(1.0, [dt.GivenCurrent([0.0], [1.0])], 1.0))
    with pytest.raises(InputError, match="acts on the tip of an arm, and the scene has none"):
        dt.plan(dt.joint_scene(1.0, [dt.TipContact((0.0, 0.0, 0.0), (0.0, 0.0, 1.0), 1e3)], 1.0))


def test_names_that_are_no_text_and_a_motion_of_lists() -> None:
    with pytest.raises(InputError, match="no joint of that name"):
        dt.Scene(dt.Inertia(1.0), {0: ()}, 1.0)
    turning = dt.joint_scene(1.0, [], 0.1)
    with pytest.raises(InputError, match="the scene has no state 3"):
        dt.simulate(turning, start={3: 1.0})
    with pytest.raises(InputError, match="progress"):
        dt.simulate(turning, progress=3)
    motion = dt.Motion("still", ("joint",), [0.0, 1.0], [[0.2], [0.2]], [[0.0]] * 2, [[0.0]] * 2)
    with pytest.raises(InputError, match="repetitions"):
        dt.CommandedMotion(motion, 10**9)
    assert dt.simulate(dt.joint_scene(1.0, [dt.CommandedMotion(motion)], 0.1))["joint.position"][-1] == 0.2


def test_nobody_sets_a_signal_twice() -> None:
    with pytest.raises(InputError, match=r"sets joint.out, which Copy of joint sets already"):
        plan(joint_scene(1.0, [Copy("speed", "out"), Copy("position", "out")], 1.0))
    with pytest.raises(InputError, match=r"sets joint.joint_torque"):
        plan(joint_scene(1.0, [Copy("speed", "joint_torque")], 1.0))
    with pytest.raises(InputError, match=r"sets joint.speed"):
        plan(joint_scene(1.0, [Copy("position", "speed")], 1.0))


def test_a_loop_names_its_signals() -> None:
    loop = [Copy("b", "a"), Copy("c", "b"), Copy("a", "c")]
    for order in itertools.permutations(loop):
        with pytest.raises(InputError) as caught:
            plan(joint_scene(1.0, order, 1.0))
        assert all(f"joint.{name}" in str(caught.value) for name in "abc")


def test_chains_of_one_kind_are_called_in_the_order_of_need() -> None:
    chain = [Copy("c", "d"), Copy("speed", "b"), Copy("b", "c")]
    run = simulate(joint_scene(1.0, [*chain, GivenTorque([0.0], [1.0])], 0.1))
    np.testing.assert_array_equal(run["joint.d"], run["joint.speed"])


def test_wrong_joints_scopes_and_numbers_are_told_together() -> None:
    arm = dt.load_arm("ur5")
    effects = {"elbow": (DryFriction(Friction(coulomb=1.0)),), "scene": (Odometer(),), arm.joint_names[0]: ("glue",)}
    with pytest.raises(InputError) as caught:
        Scene(arm, effects, 1.0, position=[0.0, np.nan, 0.0, 0.0, 0.0, 0.0])
    told = str(caught.value)
    assert "elbow_joint" in told and "Odometer" in told and "glue" in told and "position" in told


def test_what_is_no_scene_no_body_and_no_effects_is_told() -> None:
    nonsense: Any = "ur5"
    with pytest.raises(InputError) as told:
        Scene(nonsense, nonsense, 1.0)
    assert [fault.place for fault in told.value.faults] == ["body", "effects"]
    for wrong in (None, 5):
        anything: Any = wrong
        with pytest.raises(InputError, match="effects"):
            joint_scene(1.0, anything, 1.0)
        with pytest.raises(InputError, match="effects"):
            Scene(Inertia(1.0), {"joint": anything}, 1.0)
        with pytest.raises(InputError, match="scene"):
            plan(anything)
    with pytest.raises(InputError, match="resume"):
        simulate(joint_scene(1.0, [], 1.0), resume=nonsense)
    with pytest.raises(InputError, match="joint, shaft or motor"):
        GivenTorque(np.array([0.0]), np.array([1.0]), side="moter")


def test_mechanics_that_contradict_are_told() -> None:
    spring = FlexibleJoint(Gear("s", 100.0, stiffness_1=1e4))
    with pytest.raises(InputError, match="no rotor inertia"):
        plan(joint_scene(1.0, [spring], 1.0))
    with pytest.raises(InputError, match="more than one rotor"):
        plan(joint_scene(1.0, [FullRotor(1e-5, 10.0), FullRotor(2e-5, 10.0)], 1.0))
    with pytest.raises(InputError, match="different ratios"):
        plan(joint_scene(1.0, [FullRotor(1e-5, 10.0), spring], 1.0))


def test_printed_it_shows_states_signals_order_and_what_is_left_out() -> None:
    arm = dt.load_arm("ur5")
    made = plan(Scene(arm, {name: tuple(drive()) for name in arm.joint_names}, 2.0))
    text = str(made)
    assert repr(made)[5:-1] in text and "<pre>Plan of" in made._repr_html_()
    for word in (
        "(6 joints).speed ",
        "(6 joints).winding_temperature    °C",
        "rad/s",
        "DryFriction",
        "sum of",
        "springs",
        "winding warms",
    ):
        assert word in text
    assert text.count(".speed ") == 1 and " C\n" not in text  # one row for all joints, no coulombs


def test_stopped_and_resumed_it_is_the_same_to_the_bit() -> None:
    scene = joint_scene(Inertia(1.2, weight=10.0), drive(), 2.0)
    whole = simulate(scene, solver=FixedStep(1e-5), interval=0.05)
    share = []
    first = simulate(
        scene, solver=FixedStep(1e-5), interval=0.05, progress=lambda done: share.append(done) or done < 0.4
    )
    assert first.stopped_by is not None and first.stopped_by.name == "stopped"
    assert first.stopped_by.time < 2.0 and share == sorted(share)
    rest = simulate(scene, solver=FixedStep(1e-5), interval=0.05, resume=first)
    assert rest.stopped_by is None
    for name in whole.series:
        np.testing.assert_array_equal(np.concatenate([first[name], rest[name]]), whole[name])
    assert rest.counters["steps"] == whole.counters["steps"]


def test_a_resumed_run_answers_for_its_own_energy_only() -> None:
    """The error of the first second, small beside its energies, is not held against a millisecond or nothing."""
    scene = joint_scene(Inertia(1.2, weight=10.0), [], 1.0, position=0.5)
    first = simulate(scene, solver=FixedStep(5e-3))
    assert abs(first["energy_error"][-1]) > 0.0 and not first.events
    assert not simulate(scene, solver=FixedStep(5e-3), resume=first).events
    assert not simulate(scene, solver=FixedStep(5e-3), resume=first, duration=1.001).events


@pytest.mark.parametrize("half", [1.0, 0.75])
def test_a_run_in_two_parts_is_that_in_one_sample_by_sample(half: float) -> None:
    scene = joint_scene(Inertia(1.2, weight=10.0), drive(), 2.0)
    whole = simulate(scene, interval=0.05)
    first = simulate(scene, interval=0.05, duration=half)
    rest = simulate(scene, interval=0.05, resume=first)
    np.testing.assert_array_equal(np.concatenate([first.time, rest.time]), whole.time)
    for name in whole.series:
        np.testing.assert_array_equal(np.concatenate([first[name], rest[name]]), whole[name], err_msg=name)
    # Nothing is left to do: the instant at which it ended, once.
    np.testing.assert_array_equal(simulate(scene, interval=0.05, resume=rest).time, [2.0])


def test_a_run_may_go_on_with_another_step() -> None:
    scene = joint_scene(Inertia(1.2, weight=10.0), drive(), 1.0)
    first = simulate(scene, duration=0.4005)
    rest = simulate(scene, solver=FixedStep(1e-4), resume=first)
    assert rest.counters["steps"] - first.counters["steps"] == 5995
    assert rest["joint.position"][-1] == pytest.approx(simulate(scene)["joint.position"][-1], abs=1e-4)
    # Half a step was left on the old grid.
    assert simulate(scene, resume=first).counters["steps"] == 1001


def test_a_longer_run_goes_on_from_a_saved_one(tmp_path: Any) -> None:
    scene = joint_scene(Inertia(1.2, weight=10.0), [*drive(), WallSpring(50.0)], 1.0)
    path = simulate(scene, duration=0.5).save(tmp_path / "half.npz")
    rest = simulate(scene, resume=load_recording(path))
    whole = simulate(scene)
    np.testing.assert_array_equal(rest["joint.position"][-20:], whole["joint.position"][-20:])
    np.testing.assert_array_equal(rest["joint.winding_temperature"][-20:], whole["joint.winding_temperature"][-20:])
    with pytest.raises(InputError, match="another scene"):
        simulate(joint_scene(1.0, [], 1.0), resume=load_recording(path))


def test_divergence_is_told_with_instant_and_signal() -> None:
    # A damper of the wrong sign, which no step can calm.
    @joint_law(Given)
    def push(t: Any, h: Any, own: Any, joint: Any) -> None:
        joint.load.torque += 1e3 * joint.load.speed

    @dataclass(frozen=True)
    class Push(Effect):
        compute = push

        def ports(self, place: Place) -> Ports:
            return Ports(needs=(s.SPEED,), contributes=(s.JOINT_TORQUE,))

        def own(self, place: Place) -> Given:
            return Given()

    run = simulate(joint_scene(1.0, [Push()], 10.0, speed=1.0))
    assert run.stopped_by is not None
    assert run.stopped_by.name == "diverged" and "joint.speed" in run.stopped_by.detail
    # e^(1000 t) passes 1e15, whose square is the bound of powers, at 0.035 s; the step of 1 ms is slower.
    assert 0.03 < run.stopped_by.time < 0.1
    assert all(np.isfinite(one.values).all() for one in run.series.values())


def test_a_counterbalance_is_refused_where_the_joint_slides() -> None:
    effect = CounterbalanceTorque(Counterbalance(stiffness=1e3, lever_carrier=0.2, lever_link=0.1))
    with pytest.raises(InputError, match="CounterbalanceTorque: acts at revolute joints only"):
        plan(joint_scene(Inertia(1.0, turning=False), [effect], 1.0))
