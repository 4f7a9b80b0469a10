"""Scenes that cannot be: spoiled numbers anywhere in effects, bodies and arguments, and joints that move nothing."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from corruption import spoiled_call
from hard_case import Figure, hard_case
from scene_spoilers import BODY, JOINT, MOTION, WHOLE, spoiled_scene

from drivetrain.arm.arm import Arm
from drivetrain.drive.gear import Gear
from drivetrain.effects.control.commanded_motion import CommandedMotion
from drivetrain.effects.gear.springs import FlexibleJoint
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.motor.rotor import FullRotor, ReflectedRotor
from drivetrain.errors import InputError
from drivetrain.motion.motion import Motion
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.recording import Recording
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Inertia, Scene, joint_scene
from drivetrain.solvers.solver import Rodas4

RUNS = 1500


def verdict(call: Callable[[], Any]) -> str:
    """``fine``: refused by name, or a recording of numbers; else what is wrong."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            result = call()
        except InputError as error:
            return "fine" if str(error) else "an error without words"
        except Exception as error:  # the point of the test
            return f"{type(error).__name__}: {error}"[:200]
    values = [one.values for one in result.series.values()] if isinstance(result, Recording) else [result]
    return "fine" if all(np.isfinite(one).all() for one in values) else "no number comes out"


def test_the_scenes_are_right_before_they_are_spoiled() -> None:
    for specs in JOINT:
        for kind, fields in WHOLE:
            whole = (CommandedMotion(Motion(**MOTION)), kind(**fields))
            effects = {"joint": tuple(effect(**own) for effect, own in specs), "scene": whole}
            scene = Scene(Inertia(**BODY), effects, 0.02, [0.1], [0.2])
            for solver in (FixedStep(), Rodas4(1e-4)):
                assert simulate(scene, solver=solver).stopped_by is None, specs


def textbook(inertia: Any, weight: Any, stiffness: Any, friction: Any, ratio: Any, step: Any) -> np.ndarray:
    """A pendulum with rotor, spring and friction by Euler's method, taken as it comes."""
    q, v = np.array(0.1), np.array(0.2)
    for _ in range(30):
        torque = -weight * np.cos(q) - stiffness * q - friction * np.tanh(v / 0.01)
        q, v = q + step * v, v + step * torque / (inertia + 3e-5 * ratio**2)
    return np.array([q, v])


def naive_verdicts(rng: np.random.Generator) -> int:
    """Of as many spoiled runs, those that end in no number or another exception."""
    right = {"inertia": 1.0, "weight": 3.0, "stiffness": 100.0, "friction": 0.7, "ratio": 100.0, "step": 1e-3}
    wrong = 0
    for _ in range(RUNS):
        given = spoiled_call(right, rng)
        wrong += verdict(lambda given=given: textbook(**given)) != "fine"
    return wrong


@hard_case(
    "T51",
    "NaN, infinity, wrong signs, shapes and types in a scene",
    setup=(
        f"{RUNS} runs of 11 scenes with 27 effects, with one corrupted value of an effect, body, motion or argument."
    ),
    naive="a pendulum with rotor, spring and friction by explicit Euler",
)
def test_spoiled_scenes() -> list[Figure]:
    rng, wrong = np.random.default_rng(51), dict[str, str]()
    for count in range(RUNS):
        name, call = spoiled_scene(rng, 1 + count % 2)
        found = verdict(call)
        if found != "fine":
            wrong.setdefault(found, name)
    assert wrong == {}
    naive = float(naive_verdicts(np.random.default_rng(51)))
    return [Figure("results other than an InputError or a finite recording", float(len(wrong)), naive, at_most=0.0)]


def massless(last: float, *effects: Any) -> Scene:
    """Two links in a plane, the second of a mass without extent at its own axis or of none."""
    home, screws = np.tile(np.eye(4), (2, 1, 1)), np.array([[0, 0, 1, 0, 0, 0], [0, 0, 1, 0, -1.0, 0]], dtype=float)
    home[1, 0, 3] = 1.0
    inertias = np.stack([0.1 * np.eye(3), np.zeros((3, 3))])
    arm = Arm.from_screws(home, screws, [1.0, last], inertias, joint_names=("upper", "fore"))
    return Scene(arm, {"upper": (GivenTorque([0.0], [1.0]),), "fore": effects}, 0.1)


@hard_case(
    "T49",
    "A joint that moves no inertia",
    setup=(
        "A scene without mass, an arm whose last link has none, and one behind a spring. E1 and E2 must name the joint."
    ),
    naive="np.linalg.solve with the mass matrix",
)
def test_massless() -> list[Figure]:
    spring = FlexibleJoint(Gear("g", 100.0, stiffness_1=1e4))
    scenes = {
        "scene.joint": joint_scene(0.0, [GivenTorque([0.0], [1.0])], 0.1),
        "scene.fore": massless(0.0),
        "scene.fore ": massless(2.0),  # all of its mass on its own axis
        "scene.fore  ": massless(0.0, FullRotor(1e-5, 100.0), spring),
    }
    named, naive = 0, 0
    for place, scene in scenes.items():
        for solver in (FixedStep(), Rodas4()):
            try:
                simulate(scene, solver=solver)
            except InputError as error:
                named += error.faults[0].place == place.strip() and "moves no inertia" in str(error)
        try:
            np.linalg.solve(np.array([[1.1, 0.0], [0.0, 0.0]]), np.array([1.0, 0.0]))
        except np.linalg.LinAlgError as error:
            naive += "fore" in str(error)
    # An armature is all that it takes.
    assert simulate(massless(0.0, ReflectedRotor(1e-5, 100.0))).stopped_by is None
    said = "LinAlgError: Singular matrix"
    return [
        Figure("runs whose message names the joint, of 8", float(named), float(naive), naive_says=said, at_least=8.0)
    ]
