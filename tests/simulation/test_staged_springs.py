"""Stages behind a gear with a spring swing with the link: two masses and a spring by hand, in every answer."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import drivetrain as dt
from drivetrain.arm.arm import Arm
from drivetrain.arm.closures import with_second_motors
from drivetrain.arm.geared import with_rotors
from drivetrain.arm.rotors import Rotor
from drivetrain.drive.gear import Gear
from drivetrain.drive.loops.servo_axis import resonances
from drivetrain.drive.stages import Stage, chained, with_stages
from drivetrain.effects.control.preload import Preload
from drivetrain.effects.gear.springs import Backlash, FlexibleJoint
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.motor.rotor import FullRotor, ReflectedRotor
from drivetrain.errors import InputError
from drivetrain.simulation.engines.inverse import demanded
from drivetrain.simulation.planning.plan import Plan, plan
from drivetrain.simulation.scene import Inertia, Scene
from drivetrain.simulation.study_scene import SceneOptions, scene_of
from drivetrain.sizing.answers.loops import study_loops
from drivetrain.sizing.deflection import vibration

LOAD, PULLEY, ROTOR, INPUT, RATIO, BELT, STIFF = 0.3, 0.02, 5e-5, 1e-5, 10.0, 2.5, 2000.0
WHOLE, CARRIED = RATIO * BELT, PULLEY * BELT**2  # the pulley weighs less than half of load and pulley together
MOTOR = {
    "kind": "brushless", "current_basis": "dc", "winding_basis": "line_line", "resistance": 0.3, "inductance": 3e-4,
    "torque_constant": 0.06, "rotor_inertia": ROTOR, "nominal_current": 9.0, "peak_current": 35.0, "peak_torque": 2.0,
    "max_speed": 700.0, "coulomb_friction": 1e-9, "viscous_friction": 1e-12, "magnet_coefficient": 0.0, "mass": 0.9,
}  # fmt: skip
SHEET = {
    "kind": "planetary", "inertia": INPUT, "mass": 1.2, "ratio": RATIO, "efficiency": 0.9, "backlash": 0.0,
    "repeated_peak_torque": 50.0, "momentary_torque": 90.0, "torque_1": 1.0, "torque_2": 2.0,
    **dict.fromkeys(("stiffness_1", "stiffness_2", "stiffness_3"), STIFF),
}  # fmt: skip
STAGE = {"type": "belt", "ratio": BELT, "efficiency": 0.96, "inertia": PULLEY}
GEAR = with_stages(
    Gear("G", RATIO, kind="planetary", efficiency=0.9, inertia=INPUT, stiffness_1=STIFF), chained([Stage(**STAGE)])
)


def bar() -> Arm:
    return Arm.from_screws(
        np.eye(4)[None], [[0, 0, 1.0, 0, 0, 0]], [0.0], [np.diag([0.0, 0.0, LOAD])], gravity=(0.0, 0.0, 0.0),
        joint_names=["axis"], check_inertias=False,
    )  # fmt: skip


@pytest.fixture(scope="module")
def turning() -> dt.Evaluation:
    """A link that a belt turns behind a gear, from rest to rest."""
    t = np.linspace(0.0, 1.0, 401)
    q = 0.5 * (t - np.sin(2.0 * np.pi * t) / (2.0 * np.pi))[:, None]
    study = dt.study(
        arm=bar(), drive_mass="included", motion=(t, q), motors={"M": MOTOR}, gears={"G": SHEET}, supply=90.0,
        stop={"ramp": 0.3}, open_cycle=True, joints={"axis": {"stages": [STAGE], "drive": {"motor": "M", "gear": "G"}}},
    )  # fmt: skip
    return dt.evaluate(study)


def two_masses(stiffness: float, motors: int = 1) -> float:
    """By hand [rad/s]: motor and gear input on one side, load and pulleys on the other."""
    return math.sqrt(
        motors * stiffness * (1.0 / (motors * WHOLE**2 * (ROTOR + INPUT)) + 1.0 / (LOAD + motors * CARRIED))
    )


def test_vibration_and_loops_swing_load_and_stages_on_the_spring(turning: dt.Evaluation) -> None:
    found, [joint] = vibration(turning), study_loops(turning).joints
    stiffness = float(found.stiffness[0, 0])
    assert found.free == pytest.approx(two_masses(stiffness) / (2.0 * math.pi), rel=1e-9)
    assert found.locked == pytest.approx(math.sqrt(stiffness / (LOAD + CARRIED)) / (2.0 * math.pi), rel=1e-9)
    assert joint.axis.stiffness == pytest.approx(stiffness, rel=1e-12)
    held, free = resonances(joint.axis)
    assert (held, free) == pytest.approx((math.sqrt(stiffness / (LOAD + CARRIED)), two_masses(stiffness)), rel=1e-9)
    assert joint.axis.whole_inertia == pytest.approx(ROTOR + INPUT + (LOAD + CARRIED) / WHOLE**2, rel=1e-12)


def balance(ready: Plan, run: dt.Recording) -> float:
    """Energy that a run does not account for, over the energy supplied and lost, columns written out."""
    stored = sum(run[name] for name in ready.layout.stores)
    moved = [sign * run[name] for name, sign in ready.layout.flows]
    left = stored - sum(moved)
    return float(np.ptp(left) / max(np.ptp(one) for one in moved))


def swinging(kind: str) -> Scene:
    """A link that begins to be pushed, with motors that turn freely; the rotors' inertia includes the pulleys'."""
    inertia, push = ROTOR + INPUT + CARRIED / WHOLE**2, GivenTorque([0.0, 1.0], [3.0, 3.0])
    if kind == "two motors":
        rotors = [Rotor(WHOLE, inertia, carrier=-1)] * 2
        arm = with_rotors(with_second_motors(bar(), [0]), rotors)
        motor = dt.Motor("M", torque_constant=0.06, resistance=0.3)
        each = {name: (Backlash(replace(GEAR, backlash=0.0)), Preload(motor, 0.0)) for name in arm.joint_names}
        return Scene(arm, {**each, "axis": (*each["axis"], push)}, 0.05)
    body = Inertia(LOAD, name="axis") if kind == "inertia" else bar()
    own = (ReflectedRotor if kind in ("inertia", "reflected") else FullRotor)(inertia, WHOLE)
    if kind == "mounted":
        return Scene(with_rotors(body, [Rotor(WHOLE, inertia)]), {"axis": (FlexibleJoint(GEAR), push)}, 0.05)
    return Scene(body, {"axis": (own, FlexibleJoint(GEAR), push)}, 0.05)


@pytest.mark.parametrize("kind", ["inertia", "reflected", "full", "mounted", "two motors"])
def test_simulations_swing_load_and_stages_on_the_spring(kind: str) -> None:
    """By hand, a push T on two masses at rest on a spring: it winds up by -T/(I w^2) (1 - cos w t)."""
    stiffness, scene = float(GEAR.stiffness_1 or 0.0), swinging(kind)
    motors = 2 if kind == "two motors" else 1
    load, free = LOAD + motors * CARRIED, two_masses(stiffness, motors)
    run = dt.simulate(scene, solver=dt.AdaptiveStep(dt.Rodas5P(rtol=1e-9)), interval=1e-3,
                      start={name: 0.0 for name in plan(scene).memory.states})  # fmt: skip
    wanted = -3.0 / (load * free**2) * (1.0 - np.cos(free * run.time))
    np.testing.assert_allclose(run["axis.deflection"], wanted, atol=1e-5 * np.abs(wanted).max())
    assert balance(plan(scene), run) < 1e-6


def test_a_simulated_move_keeps_its_energies_and_asks_for_no_more(turning: dt.Evaluation) -> None:
    """Rigid and with springs the same inertia is moved; the spring's mesh also transmits what turns the pulley."""
    drives = {name: joint.drive for name, joint in turning.joints.items()}
    rigid, soft = (
        plan(scene_of(turning.study, drives, options=SceneOptions(springs=springs, heat=False, feed_forward=False)))
        for springs in (False, True)
    )
    own = WHOLE**2 * (ROTOR + INPUT)
    np.testing.assert_allclose(np.diag(rigid.inertia), [LOAD + CARRIED + own], rtol=1e-9)
    np.testing.assert_allclose(np.diag(soft.inertia), [LOAD + CARRIED, own], rtol=1e-9)
    times = np.linspace(0.0, 1.0, 101)
    acceleration = demanded(rigid, times).acceleration
    for ready, load in ((rigid, LOAD), (soft, LOAD + CARRIED)):
        np.testing.assert_allclose(demanded(ready, times).mesh_torque, load * acceleration, rtol=1e-9, atol=1e-9)
    scene = scene_of(turning.study, drives, options=SceneOptions(springs=True, heat=False))
    run = dt.simulate(scene, interval=0.01)
    assert balance(plan(scene), run) < 1e-3  # the step of 1 ms resolves a spring that swings in 12 ms
    assert run["axis.position"][-1] == pytest.approx(0.5, abs=1e-4)


def test_a_rotor_without_the_stages_of_its_gear_is_refused() -> None:
    scene = Scene(Inertia(LOAD, name="axis"), {"axis": (ReflectedRotor(INPUT, WHOLE), FlexibleJoint(GEAR))}, 0.1)
    with pytest.raises(InputError, match="no more rotor inertia than the stages"):
        plan(scene)


@pytest.mark.parametrize("seed", [4, 40, 56])
def test_springs_that_change_their_stiffness_a_thousandfold_converge(seed: int) -> None:
    """Random pushes at a joint between a wall and a spring that is far too stiff for the step in one of its pieces."""
    rng, time = np.random.default_rng(seed), np.linspace(0.0, 0.5, 26)
    first = 10.0 ** rng.uniform(2, 5)
    gear = dt.Gear(
        "g", 50.0, stiffness_1=first, stiffness_2=first * 10.0 ** rng.uniform(0, 3), torque_1=0.3, torque_2=0.8,
        stiffness_3=first * 10.0 ** rng.uniform(0, 4), backlash=1e-3,
    )  # fmt: skip
    effects = (
        dt.FlexibleJoint(gear), dt.FullRotor(2e-5, 50.0), dt.GivenTorque(time, 3.0 * rng.normal(size=26)),
        dt.WallSpring(400.0, 1.0),
    )  # fmt: skip
    run = dt.simulate(dt.joint_scene(0.05, effects, 0.5), solver=dt.FixedStep(2e-3), interval=0.1)
    assert run.counters["unsettled"] == 0
