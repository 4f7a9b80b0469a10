"""A payload that comes and goes is the arm with it and the arm without it, each in its time."""

from typing import Any

import numpy as np
import pytest

import drivetrain as dt
from drivetrain.arm.bodies import with_payload
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.loads.payload_change import EMPTY, Body, PayloadChange
from drivetrain.errors import InputError
from drivetrain.simulation.engines.engine import Engine
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.recording import Recording
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Scene

BOX = Body(2.5, np.array([0.02, -0.01, 0.08]), np.diag([0.01, 0.02, 0.015]))
POSE = np.array([0.3, -0.9, 1.1, 0.2, 0.5, 0.1])


def run(arm: dt.Arm, duration: float, start: np.ndarray, speed: np.ndarray, *change: PayloadChange) -> Recording:
    effects = {name: (GivenTorque([0.0], [3.0]),) for name in arm.joint_names}
    return simulate(
        Scene(arm, effects | {"scene": change}, duration, start, speed), solver=FixedStep(1e-3), interval=0.1
    )


def states(recording: Recording, arm: dt.Arm, what: str) -> np.ndarray:
    return np.array([recording[f"{name}.{what}"][-1] for name in arm.joint_names])


def test_picked_up_and_put_down() -> None:
    empty = dt.load_arm("ur5")
    loaded = with_payload(empty, BOX.mass, BOX.com, BOX.inertia)
    whole = run(empty, 0.6, POSE, np.zeros(6), PayloadChange([0.2, 0.4], (BOX, EMPTY)))
    position, speed = POSE, np.zeros(6)
    for arm in (empty, loaded, empty):
        part = run(arm, 0.2, position, speed)
        position, speed = states(part, arm, "position"), states(part, arm, "speed")
    # Each part begins with its own guess of the accelerations: a difference of the second power of the step, on a
    # wrist that is 26 rad further.
    np.testing.assert_allclose(states(whole, empty, "position"), position, atol=2e-4)
    np.testing.assert_allclose(states(whole, empty, "speed"), speed, atol=5e-3)


def test_carried_from_the_start_it_is_the_loaded_arm() -> None:
    empty = dt.load_arm("ur5")
    loaded = with_payload(empty, BOX.mass, BOX.com, BOX.inertia)
    changed = run(empty, 0.3, POSE, np.zeros(6), PayloadChange([0.0], (BOX,)))
    plain = run(loaded, 0.3, POSE, np.zeros(6))
    for what in ("position", "speed", "acceleration"):
        np.testing.assert_allclose(states(changed, empty, what), states(plain, loaded, what), rtol=1e-9, atol=1e-11)
    np.testing.assert_allclose(changed["energy_error"], plain["energy_error"], atol=1e-9)


def test_wrong_schedules_are_refused() -> None:
    with pytest.raises(InputError, match="rise"):
        PayloadChange([0.4, 0.2], (BOX, EMPTY))
    with pytest.raises(InputError, match="mass"):
        PayloadChange([0.4], (Body(-1.0, np.zeros(3), np.zeros((3, 3))),))


@pytest.mark.parametrize(
    ("wrong", "what"),
    [({"mass": "1 kg"}, "mass"), ({"com": [0.0, 0.0]}, "com"), ({"com": [np.nan, 0.0, 0.0]}, "com"),
     ({"inertia": 0.1}, "inertia"), ({"inertia": -np.eye(3)}, "no negative moment"),
     ({"inertia": np.diag([1.0, 2.0, 3.0]) + np.eye(3, k=1)}, "symmetric"),
     ({"inertia": np.ones((3, 3)) - 0.5 * np.eye(3)}, "no negative moment")],
)  # fmt: skip
def test_what_is_no_body_is_refused(wrong: dict[str, Any], what: str) -> None:
    with pytest.raises(InputError, match=what):
        Body(**{"mass": 1.0, "com": np.zeros(3), "inertia": np.eye(3)} | wrong)


@pytest.mark.parametrize("solver", [FixedStep(1e-4), dt.AdaptiveStep(dt.Rodas5P(1e-7))])
def test_what_payloads_bring_and_take_is_accounted_for(solver: Engine) -> None:
    """A heavy body is picked up and put down in motion: some 15 J of its own come and go with it."""
    arm = dt.load_arm("ur5")
    effects = {name: (GivenTorque([0.0], [3.0]),) for name in arm.joint_names}
    change = PayloadChange([0.2, 0.31], (BOX, EMPTY))
    found = simulate(Scene(arm, effects | {"scene": (change,)}, 0.4, POSE), solver=solver, interval=0.05)
    brought = found["scene.payload_energy"]
    assert brought[0] == 0.0 and np.ptp(brought) > 1.0
    assert np.abs(found["energy_error"]).max() < 1e-4 * np.ptp(found["stored_energy"])
