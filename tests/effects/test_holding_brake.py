"""A brake holds exactly up to its torque, slips with less, and closes when it is told, after its delay."""

from __future__ import annotations

import pytest

from drivetrain.drive.friction import Friction
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.friction.holding_brake import HoldingBrake
from drivetrain.effects.friction.viscous_friction import ViscousFriction
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.motor.rotor import ReflectedRotor
from drivetrain.errors import InputError
from drivetrain.simulation.engines.adaptive_step import AdaptiveStep
from drivetrain.simulation.engines.engine import Engine
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Inertia, joint_scene

RATIO = 10.0


def loaded(torque: float, brake: HoldingBrake, *, speed: float = 0.0, duration: float = 1.0):
    effects = [ReflectedRotor(1e-3, RATIO), GivenTorque([0.0], [torque]), brake]
    return simulate(joint_scene(Inertia(0.5), effects, duration, speed=speed), interval=1e-3)


@pytest.mark.parametrize("share", [-0.99, 0.5, 0.99])
def test_it_holds_without_any_drift(share: float) -> None:
    run = loaded(share * RATIO * 2.0, HoldingBrake(2.0, engaged=True))
    assert (run.series["joint.position"].values == 0.0).all()


def test_overloaded_it_slips_with_its_sliding_torque() -> None:
    run = loaded(1.2 * RATIO * 2.0, HoldingBrake(2.0, 1.5, engaged=True))
    expected = (24.0 - 15.0) / (0.5 + RATIO**2 * 1e-3)
    assert run.series["joint.speed"].values[-1] == pytest.approx(expected, rel=1e-2)
    assert [(event.time, event.name) for event in run.events] == [(0.0, "start")] and "2 N m" in run.events[0].detail
    holds, moves = HoldingBrake(2.0, engaged=True), HoldingBrake(2.0, engages=(0.0,), closing=0.1, engaged=True)
    moved = loaded(0.0, moves, speed=0.1, duration=0.01)
    assert not loaded(0.9 * RATIO * 2.0, holds).events and "start" not in {event.name for event in moved.events}


def test_released_the_load_falls_and_engaged_again_it_stops() -> None:
    brake = HoldingBrake(5.0, releases=(0.2,), engages=(0.5,), opening=0.05, closing=0.02, engaged=True)
    run = loaded(6.0, brake)
    speed = dict(zip(run.time.round(3), run.series["joint.speed"].values, strict=True))
    assert speed[0.249] == 0.0  # still opening
    assert speed[0.519] == pytest.approx(6.0 / 0.6 * (0.519 - 0.25), rel=1e-3)
    assert speed[0.9] == 0.0
    late = run.series["joint.position"].values[-100:]
    assert (late == late[0]).all()


def test_the_last_command_counts_while_an_earlier_one_is_still_delayed() -> None:
    """Released before it has closed it never closes; engaged before it has opened it never opens."""
    open_still = loaded(0.0, HoldingBrake(5.0, engages=(0.1,), releases=(0.12,), closing=0.05, opening=0.01), speed=1.0)
    assert open_still["joint.speed"][-1] == pytest.approx(1.0, rel=1e-12)
    again = HoldingBrake(5.0, releases=(0.1,), engages=(0.12,), closing=0.01, opening=0.05, engaged=True)
    assert (loaded(6.0, again)["joint.speed"] == 0.0).all()
    twice = loaded(0.0, HoldingBrake(50.0, engages=(0.1, 0.14), closing=0.05), speed=1.0)
    assert twice["joint.speed"][149] > 0.9 and twice["joint.speed"][170] == 0.0


@pytest.mark.parametrize("engine", [FixedStep(), AdaptiveStep()])
def test_what_an_engaging_and_a_releasing_brake_change_is_told_as_it_is(engine: Engine) -> None:
    """A joint that moves backward when its brake engages has not reversed; released it slides where its load pulls."""
    brake = HoldingBrake(5.0, engages=(0.1,), releases=(0.3,))
    effects = [ReflectedRotor(1e-3, RATIO), GivenTorque([0.0], [-6.0]), brake]
    run = simulate(joint_scene(Inertia(0.5), effects, 0.4, speed=-1.0), solver=engine)
    told = [(event.name, event.detail) for event in run.events if event.name != "step"]
    assert told[0] == ("stick", "joint: slides backward, then stuck")
    assert set(told[1:]) <= {("breakaway", "joint: stuck, then slides backward")}


def test_faults_come_together() -> None:
    with pytest.raises(InputError) as error:
        HoldingBrake(0.0, -1.0, engages=(-1.0,), closing=-1.0, opening=float("nan"))
    assert len(error.value.faults) == 5


@pytest.mark.parametrize("kind", [DryFriction, ViscousFriction])
def test_a_side_that_is_none_is_refused(kind: type) -> None:
    with pytest.raises(InputError, match="must be joint, shaft or motor"):
        kind(Friction(coulomb=1.0), side="middle")
