"""What a plan refuses beside what it accepts, the units and names of its signals, and the words it is printed in."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Annotated, Any

import numpy as np
import pytest
from random_arms import random_arm

import drivetrain as dt
from drivetrain.arm.bodies import with_payload
from drivetrain.arm.closures import second_motor, with_second_motors
from drivetrain.arm.coupling import with_coupling
from drivetrain.arrays import Array
from drivetrain.drive.friction import Friction
from drivetrain.drive.thermal.thermal_network import ThermalNetwork
from drivetrain.effects import signals as s
from drivetrain.effects.control.preload import Preload
from drivetrain.effects.effect import Effect, Place, Ports, Role, Signal, State
from drivetrain.effects.laws import joint_law
from drivetrain.effects.loads.payload_change import Body, PayloadChange
from drivetrain.errors import InputError
from drivetrain.records import record_type
from drivetrain.simulation.planning import memory as layout
from drivetrain.simulation.planning import plan as planning
from drivetrain.simulation.planning import wiring
from drivetrain.simulation.planning.plan import plan
from drivetrain.simulation.scene import Inertia, Scene, joint_scene, without

MOTOR = dt.Motor("m", 0.3, 0.03)
RUB = dt.DryFriction(Friction(coulomb=1.0))
COUPLING = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.5], [0.0, 0.0, 1.0]])


def arm_of(joints: str = "RRR", coupled: bool = False) -> dt.Arm:
    arm = random_arm(2, joints)
    return with_coupling(arm, COUPLING) if coupled else arm


def geared(arm: dt.Arm, more: dict[int, tuple[Effect, ...]], **scene: Any) -> Scene:
    names = arm.joint_names
    effects = {name: (dt.FullRotor(1e-4, 50.0), *more.get(k, ())) for k, name in enumerate(names)}
    return Scene(arm, effects | ({"scene": more[-1]} if -1 in more else {}), 1.0, **scene)


def faults_of(scene: Scene) -> list[str]:
    with pytest.raises(InputError) as told:
        plan(scene)
    return [f"{fault.place}: {fault.problem}" for fault in told.value.faults]


SOFT = dt.FlexibleJoint(dt.Gear("g", 50.0, stiffness_1=1e4))
MESH = dt.MeshLoss(dt.Gear("g", 50.0, efficiency=0.9))


@pytest.mark.parametrize(
    ("coupled", "more", "joint", "words"),
    [
        (True, {1: (RUB,)}, 1, "coupled to others"), (True, {2: (dt.MovingBelt(0.1),)}, 2, "coupled to others"),
        (True, {0: (RUB,)}, None, ""), (False, {1: (RUB,)}, None, ""),
        (True, {1: (dt.DryFriction(RUB.friction, "shaft"),)}, None, ""),
        (True, {1: (dt.DryFriction(RUB.friction, "motor"),)}, None, ""),
        (True, {1: (SOFT,)}, 1, "behind coupled motors"), (True, {0: (SOFT,)}, None, ""),
        (False, {1: (MESH, MESH)}, 1, "2 mesh losses"), (False, {1: (MESH,), 2: (MESH,)}, None, ""),
        (False, {1: (dt.MovingBelt(0.1), RUB, MESH)}, 1, "moving belt"),
        (False, {1: (dt.MovingBelt(0.1), RUB, dt.DryFriction(RUB.friction, "motor"))}, 1, "moving belt"),
        (False, {1: (dt.MovingBelt(0.1), RUB, MESH, SOFT)}, None, ""),
        (False, {1: (dt.MovingBelt(0.1), RUB)}, None, ""),
        (False, {0: (dt.MovingBelt(0.1), RUB), 1: (MESH,)}, None, ""),
        (False, {1: (dt.FullRotor(1e-4, 50.0),)}, 1, "more than one rotor"),
        (False, {2: (SOFT, SOFT)}, 2, "one spring"),
        (False, {2: (dt.MeshLoss(dt.Gear("g", 60.0, efficiency=0.9)),)}, 2, "different ratios"),
    ],
)  # fmt: skip
def test_what_a_joint_may_hold(coupled: bool, more: dict[int, Any], joint: int | None, words: str) -> None:
    scene = geared(arm_of(coupled=coupled), more)
    if joint is None:
        plan(scene)
        return
    told = faults_of(scene)
    assert len(told) == 1 and words in told[0] and scene.joints[joint] in told[0]


def test_a_rotor_is_mounted_once_and_a_spring_needs_one() -> None:
    arm = dt.with_rotors(arm_of(), [dt.Rotor(50.0, 1e-4), None, None])
    first, second, _ = arm.joint_names
    assert plan(Scene(arm, {first: (SOFT,)}, 1.0)).body.c == 4
    assert "one there already" in faults_of(Scene(arm, {first: (dt.FullRotor(1e-4, 50.0),)}, 1.0))[0]
    assert "no rotor inertia" in faults_of(Scene(arm, {second: (SOFT,)}, 1.0))[0]
    assert "no rotor inertia" in faults_of(Scene(arm, {second: (SOFT, dt.FullRotor(0.0, 50.0))}, 1.0))[0]
    assert (
        "different ratios" in faults_of(Scene(arm, {first: (dt.MeshLoss(dt.Gear("g", 60.0, efficiency=0.9)),)}, 1.0))[0]
    )
    assert plan(Scene(arm, {second: (MESH, dt.FullRotor(1e-4, 50.0))}, 1.0)).body.ratios.tolist() == [50.0, 50.0, 1.0]


def two_motors(first: tuple[Effect, ...], second: tuple[Effect, ...], preloads: tuple[float, float]) -> Scene:
    home = np.eye(4)
    link = dt.Arm.from_screws([home], [[0, 0, 1.0, 0, 0, 0]], [2.0], [np.eye(3)], gravity=(0.0, 0.0, 0.0),
                              joint_names=["axis"])  # fmt: skip
    arm = with_second_motors(link, [0])
    arm = dt.with_rotors(arm, [dt.Rotor(50.0, 1e-4, carrier=-1)] * 2)
    soft = dt.Backlash(replace(SOFT.gear, backlash=0.0))
    effects = {
        name: (soft, Preload(MOTOR, push), *(dt.MotorCurrent(MOTOR), dt.GivenCurrent([0.0], [0.0])), *more)
        for name, push, more in zip(arm.joint_names, preloads, (first, second), strict=True)
    }
    return Scene(arm, effects, 1.0)


def test_two_motors_push_each_other_alike_and_rub_at_the_first() -> None:
    assert second_motor("axis") == "axis_motor_2"
    assert plan(two_motors((RUB,), (), (5.0, -5.0))).body.shared == ((0, 1),)
    assert "of a second motor" in faults_of(two_motors((), (RUB,), (5.0, -5.0)))[0]
    assert "of a second motor" in faults_of(two_motors((), (dt.MovingBelt(0.1),), (5.0, -5.0)))[0]
    for pushes in ((5.0, 5.0), (5.0, -4.0), (-5.0, 4.0), (0.0, 1.0)):
        (told,) = faults_of(two_motors((), (), pushes))
        assert "effects['axis']" in told and "push the other motor" in told
    arm = dt.with_rotors(arm_of(), [dt.Rotor(50.0, 1e-4)] * 3)
    own = (Preload(MOTOR, -3.0), dt.MotorCurrent(MOTOR))
    (told,) = faults_of(Scene(arm, {arm.joint_names[1]: own}, 1.0))
    assert arm.joint_names[1] in told and "no second motor" in told
    preloaded = plan(two_motors((), (), (6.0, -6.0)))
    # Each of two motors has half of what both carry, and its preload.
    halves = preloaded.body.halved(np.array([[7.0, 3.0], [1.0, -2.0]]))
    np.testing.assert_allclose(halves, [[5.0 + 6.0, 5.0 - 6.0], [-0.5 + 6.0, -0.5 - 6.0]])
    np.testing.assert_allclose(preloaded.body.zeros, [6e-4, -6e-4], rtol=1e-9)
    # A flank that no preload touches is none: play alone winds nothing up.
    played = joint_scene(1.0, [dt.FullRotor(1e-4, 50.0), dt.Backlash(replace(SOFT.gear, backlash=2e-3))], 1.0)
    assert plan(played).body.zeros.tolist() == [0.0]


def test_a_mesh_of_one_joint_jams() -> None:
    """mu against 1 + J ratio^2 / I = 1.25."""
    for loss, told in ((1.24, False), (1.26, True)):
        mesh = dt.MeshLoss(dt.Gear("g", 50.0, efficiency=1.0 / (1.0 + loss)))
        scene = joint_scene(1.0, [dt.ReflectedRotor(1e-4, 50.0), mesh], 1.0)
        if told:
            assert "1.25 on it jams" in faults_of(scene)[0]
        else:
            plan(scene)


@pytest.mark.parametrize("share, told", [(0.99, False), (1.01, True)])
def test_a_mesh_jams_where_its_friction_reaches_what_the_rotor_can_give(share: float, told: bool) -> None:
    """mu against 1 + J ratio^2 / I, with I of the joint as all others stand, without the rotor."""
    arm, q = arm_of("RPR"), np.array([0.3, 0.2, -0.5])
    rotors = (2e-4, 3e-4, 5e-4)
    for k in (1, 2):
        load = dt.mass_matrix(arm, q)[k, k]
        most = 1.0 + rotors[k] * 50.0**2 / load
        mesh = dt.MeshLoss(dt.Gear("g", 50.0, efficiency=1.0 / (1.0 + share * most)))
        effects = {name: (dt.ReflectedRotor(rotors[i], 50.0), *((mesh,) if i == k else ()))
                   for i, name in enumerate(arm.joint_names)}  # fmt: skip
        scene = Scene(arm, effects, 1.0, q)
        if not told:
            plan(scene)
            continue
        (fault,) = faults_of(scene)
        assert arm.joint_names[k] in fault and f"{most:.4g} on it jams" in fault
        soft = {**effects, arm.joint_names[k]: (*effects[arm.joint_names[k]], SOFT)}
        plan(Scene(arm, soft, 1.0, q))


@pytest.mark.parametrize("at", [0, 1])
def test_a_joint_that_moves_nothing_while_those_after_it_are_free_is_named(at: int) -> None:
    """A mass matrix of rank two: what is left of the inertia of one joint is zero to rounding, or is not."""
    rng = np.random.default_rng(at)
    body, scene = SimpleNamespace(n=2, c=3, springs=[1], motors=[0, 2]), SimpleNamespace(joints=("a", "b"))
    lower = np.tril(rng.uniform(0.5, 1.0, (3, 3)))
    for share, told in ((0.0, True), (1e-15, True), (2e-14, False), (1.0, False)):
        factor = lower[::-1, ::-1].copy()  # upper triangular: M = U U^T, eliminated from the last on
        whole = factor @ factor.T
        left = factor[at, at] ** 2
        factor[at, at] = math.sqrt(share * (whole[at, at] - left))
        whole = factor @ factor.T
        if not told:
            planning.check_inertias(body, whole, scene)
            continue
        with pytest.raises(InputError) as caught:
            planning.check_inertias(body, whole, scene)
        assert caught.value.faults[0].place == f"scene.{('a', 'b', 'motor of b')[at]}"
    for k, size in enumerate((1e-61, -1.0, math.nan)):
        with pytest.raises(InputError, match=r"moves no inertia \((0|nan|1e-61) kg") as caught:
            planning.check_inertias(body, np.diag(np.where(np.arange(3) == k, size, 1.0)), scene)
        assert caught.value.faults[0].place == f"scene.{('a', 'b', 'motor of b')[k]}"


@pytest.mark.parametrize("period, told", [(1.01e-9, False), (0.99e-9, True)])
def test_samples_of_one_effect_are_limited(period: float, told: bool) -> None:
    effect = SimpleNamespace(period=period)
    still = SimpleNamespace(period=None)
    instances = [SimpleNamespace(title="A", effect=still), SimpleNamespace(title="B", effect=effect)]
    scene = SimpleNamespace(duration=1.0)
    if not told:
        planning._check_periods(instances, scene)
        return
    with pytest.raises(InputError) as caught:
        planning._check_periods(instances, scene)
    assert [fault.place for fault in caught.value.faults] == ["B"]


# --- signals


@dataclass
class Nothing:
    value: float = 0.0


@joint_law(Nothing)
def _nothing(t: Any, h: Any, own: Any, joint: Any) -> None:
    own.value = 0.0


@dataclass(frozen=True)
class Adds(Effect):
    """Contributes to a signal in a unit."""

    name: str
    unit: str

    compute = _nothing

    def ports(self, place: Place) -> Ports:
        return Ports(contributes=(Signal(self.name, self.unit),))


@dataclass(frozen=True)
class Later(Adds):
    """The same, read after it."""


@dataclass(frozen=True)
class Needs(Effect):
    """Reads a signal, with or without a default; sets another."""

    name: str
    default: float | None = None
    sets: str = "value"

    compute = _nothing

    def ports(self, place: Place) -> Ports:
        return Ports(needs=(Signal(self.name, "-", self.default),), provides=(Signal(self.sets, "-", path="value"),))


def slide_scene(*effects: Effect) -> Scene:
    return joint_scene(Inertia(1.0, turning=False), effects, 1.0)


@pytest.mark.parametrize(
    ("turning", "name", "unit", "fits"),
    [
        (True, "joint_torque", "N m", True), (True, "joint_torque", "N", False), (False, "joint_torque", "N m", True),
        (False, "joint_torque", "N", True), (False, "joint_torque", "A", False), (False, "motor_torque", "N m", True),
        (False, "motor_torque", "N", False), (False, "joint_damping", "N m s/rad", True),
        (False, "joint_damping", "N m/rad", False), (True, "current_command", "A", True),
    ],
)  # fmt: skip
def test_units_of_what_is_added(turning: bool, name: str, unit: str, fits: bool) -> None:
    readers = (dt.MotorCurrent(MOTOR), dt.GivenCurrent([0.0], [0.0])) if name == "current_command" else ()
    scene = joint_scene(Inertia(1.0, turning=turning), [*readers, Adds(name, unit)], 1.0)
    if fits:
        done = plan(scene)
        own = "N m" if name == "motor_torque" or turning else "N"
        if name in ("joint_torque", "motor_torque"):
            assert done.signals.units[f"joint.{name}"] == own
        return
    (told,) = faults_of(scene)
    assert f"adds to joint.{name} in {unit}" in told


def test_one_unit_for_what_two_effects_add_at_a_joint_that_turns() -> None:
    scene = joint_scene(1.0, [Needs("extra"), Adds("extra", "N"), Later("extra", "N m")], 1.0)
    assert "adds to joint.extra in N m; it is in N" in faults_of(scene)[0]


def test_defaults_are_one_and_only_where_nothing_gives_them() -> None:
    done = plan(joint_scene(1.0, [Needs("room", 20.0), Needs("room", 20.0, "other")], 1.0))
    assert done.signals.defaults == {"joint.room": 20.0}
    warm = plan(joint_scene(1.0, [Needs("housing_temperature", 20.0)], 1.0))
    assert warm.memory.numbers[warm.memory.places["joint.housing_temperature"]] == 20.0
    (told,) = faults_of(joint_scene(1.0, [Needs("room", 20.0), Needs("room", 21.0, "other")], 1.0))
    assert "another default" in told
    given = plan(joint_scene(1.0, [Needs("room", 20.0), Needs("speed", None, "room")], 1.0))
    assert given.signals.defaults == {}
    (told,) = faults_of(joint_scene(1.0, [Needs("sped", None)], 1.0))
    assert "needs joint.sped [-], which nothing gives" in told


def test_full_names_and_the_unit_of_a_joint_that_slides() -> None:
    place = Place(0, "elbow", ("elbow",), (1.0,), (True,))
    names = [wiring.full_name(name, place) for name in ("speed", "scene.bus_voltage", "wrist:speed")]
    assert names == ["elbow.speed", "scene.bus_voltage", "wrist.speed"]
    pairs = (("rad", "m"), ("rad/s", "m/s"), ("rad/s^2", "m/s^2"), ("N m", "N"), ("N m s/rad", "N s/m"), ("A", "A"))
    assert all((wiring.unit_at(a, True), wiring.unit_at(a, False)) == (a, b) for a, b in pairs)
    done = plan(slide_scene(dt.FullRotor(1e-4, 50.0), SOFT))
    assert done.units == {
        "joint.position": "m",
        "joint.deflection": "m",
        "joint.speed": "m/s",
        "joint.shaft_speed": "m/s",
    }
    units = done.signals.units
    assert (units["joint.acceleration"], units["joint.motor_acceleration"]) == ("m/s^2", "rad/s^2")
    assert (units["joint.motor_position"], units["joint.position"]) == ("rad", "m")


def test_roles_of_powers_and_stores() -> None:
    network = ThermalNetwork(2.0, 3.0, 10.0, 200.0, 25.0)
    effects = [dt.GivenCurrent([0.0], [1.0]), dt.MotorCurrent(MOTOR), dt.WindingHeat(network), RUB, dt.WallSpring(5.0)]
    done = plan(joint_scene(1.0, effects, 1.0))
    losses = {name for name, role in done.signals.powers.items() if role is Role.LOSS}
    assert {"joint.joint_friction_power", "joint.motor_friction_power", "joint.mesh_power"} <= losses
    assert done.signals.stores == [name for name in done.signals.units if name.endswith("spring_energy")]
    assert done.memory.powers == tuple(sorted(done.signals.powers))


def test_tolerances_of_states_and_which_are_memory() -> None:
    @dataclass(frozen=True)
    class Keeps(Effect):
        """Two states, one of which only changes at samples."""

        compute = _keep

        def ports(self, place: Place) -> Ports:
            return Ports(states=(State("kept", "-", atol=3e-3, memory=True), State("grown", "-", atol=4e-4)))

        def own(self, place: Place) -> Kept:
            return Kept()

    done = plan(joint_scene(1.0, [dt.FullRotor(1e-4, 50.0), SOFT, Keeps()], 1.0))
    names = ["position", "deflection", "speed", "shaft_speed", "grown", "kept"]
    assert list(done.memory.states) == [f"joint.{name}" for name in names]
    assert done.memory.atol.tolist() == [1e-7, 1e-7, 1e-6, 1e-6, 4e-4, 3e-3]
    assert done.memory.memory.tolist() == [False] * 5 + [True] and done.memory.moving == 5
    assert done.memory.view(done.memory.numbers, "engine")[0]["moving"] == 5


@dataclass
class Kept:
    kept: float = 0.0
    grown: float = 0.0
    grown_rate: float = 0.0


@joint_law(Kept)
def _keep(t: Any, h: Any, own: Any, joint: Any) -> None:
    own.grown_rate = 1.0


@dataclass
class Inner:
    """A record within another."""

    given: float
    kept: float = 0.0


@dataclass
class Outer:
    """A record of all kinds of fields."""

    first: float
    inner: Inner
    table: Annotated[Array, 3]
    count: int = 0
    memory: Annotated[Array, 2] = field(default_factory=lambda: np.zeros(2))


def test_numbers_of_a_record_that_a_run_changes_are_those_with_a_default() -> None:
    """One by one over arrays and records within: what has no default is given once."""
    assert layout.changing_numbers(Outer) == [False, False, True, False, False, False, True, True, True]
    for effect in (dt.WindingHeat, dt.Backlash, dt.SampledCascade, dt.HoldingBrake):
        described = effect.described()
        assert 8 * len(layout.changing_numbers(described)) == record_type(described, np.int64).itemsize


# --- payloads


def test_a_payload_is_the_link_that_carries_it() -> None:
    """Inertial data of the last link, as those of the arm that holds the body at its tip."""
    arm = arm_of("RPR")
    bodies = (
        Body(0.9, np.array([0.02, -0.03, 0.05]), np.diag([0.004, 0.006, 0.005])),
        Body(
            0.4, np.array([-0.1, 0.2, 0.3]), [[0.01, 0.002, 0.001], [0.002, 0.02, 0.003], [0.001, 0.003, 0.015]],
        ),
    )  # fmt: skip
    done = plan(Scene(arm, {"scene": (PayloadChange([0.2, 0.7], bodies),)}, 1.0))
    found, names = done.body.payloads, done.body.payloads.dtype.names
    assert found["time"][0] < -1e20 and found["time"][1:].tolist() == [0.2, 0.7]
    arms = [arm, *(with_payload(arm, one.mass, one.com, one.inertia) for one in bodies)]
    for row, one in zip(found, arms, strict=True):
        last = plan(Scene(one, {}, 1.0)).body.links[2]
        for name in names[1:]:
            assert row[name] == pytest.approx(last[name], rel=1e-9, abs=1e-12), name
    twice = {"scene": (PayloadChange([0.2], bodies[:1]), PayloadChange([0.3], bodies[1:]))}
    assert "one PayloadChange at most" in faults_of(Scene(arm, twice, 1.0))[0]
    assert "of an arm" in faults_of(Scene(Inertia(1.0), {"scene": (PayloadChange([0.2], bodies[:1]),)}, 1.0))[0]


# --- scenes


def test_a_scene_without_a_kind_of_effects_has_their_substitutes() -> None:
    scene = geared(arm_of(), {0: (SOFT, RUB), 1: (RUB,)})
    rigid = without(scene, dt.FullRotor)
    for name in scene.joints:
        assert type(rigid.effects[name][0]) is dt.ReflectedRotor and rigid.effects[name][1:] == scene.effects[name][1:]
    smooth = without(scene, dt.DryFriction)
    assert [len(smooth.effects[name]) for name in scene.joints] == [2, 1, 1]
    assert smooth.effects[scene.joints[0]][1] is SOFT


@pytest.mark.parametrize("turning", [True, False])
def test_a_scene_of_one_joint(turning: bool) -> None:
    whole = dt.CommandedMotion(dt.Motion("m", ("hinge",), np.array([0.0, 1.0]), *(np.zeros((2, 1)) for _ in range(3))))
    scene = joint_scene(Inertia(2.0, 3.0, 0.5, turning, "hinge"), [whole, RUB], 4.0, position=0.3, speed=-0.2)
    assert scene.joints == ("hinge",) and scene.turning == (turning,) and scene.duration == 4.0
    assert scene.effects == {"hinge": (RUB,), "scene": (whole,)}
    assert (scene.position.tolist(), scene.speed.tolist()) == ([0.3], [-0.2])
    bare = joint_scene(2.0, RUB, 4.0)
    assert bare.position is None and bare.speed is None and bare.effects == {"joint": (RUB,)}
    assert Scene(arm_of("RPR"), {}, 1.0).turning == (True, False, True)
    for wrong in ({"inertia": -1.0}, {"inertia": math.nan}, {"inertia": 1.0, "weight": math.inf}):
        with pytest.raises(InputError):
            Inertia(**wrong)
    assert Inertia(0.0, -3.0).weight == -3.0


# --- words


def test_a_printed_plan() -> None:
    arm = arm_of("RRR")
    own = (dt.FullRotor(1e-4, 50.0), dt.MotorCurrent(MOTOR), dt.GivenCurrent([0.0, 0.5, 2.0], [1.0, 2.0, 3.0]), RUB)
    text = str(plan(Scene(arm, dict.fromkeys(arm.joint_names, own), 1.5, name="three", notes=("a note",))))
    lines = text.splitlines()
    assert lines[0] == "Plan of three: 3 joints, 6 states, 12 effects in 4 calls, 1.5 s"
    assert [line for line in lines if line and line[0] != " "][1:] == ["States", "Order", "Signals", "Left out"]
    joints = f"({', '.join(arm.joint_names)})"
    states = lines[lines.index("States") + 1 : lines.index("Order") - 1]
    width = len(f"{joints}.position")
    assert states == [f"  {joints}.position  rad", f"  {joints}.speed".ljust(width + 4) + "rad/s"]
    order = lines[lines.index("Order") + 1 : lines.index("Signals") - 1]
    names = ["DryFriction", "FullRotor", "GivenCurrent", "MotorCurrent"]
    assert [line.split()[0] for line in order] == ["1.", "2.", "3.", "4."]
    assert sorted(line.split()[1] for line in order) == names and all(line.endswith(joints[1:-1]) for line in order)
    signals = [line.strip() for line in lines[lines.index("Signals") + 1 : lines.index("Left out") - 1]]
    assert any(
        line.startswith(f"{joints}.current_command [A]") and line.endswith("sum of GivenCurrent") for line in signals
    )
    defaults = [line.endswith("as nothing gives it") for line in signals]
    assert any(defaults) and defaults == sorted(defaults)
    assert lines[lines.index("Left out") + 1 :] == ["  springs in the joints: all are rigid", "  a note"]
    one = plan(joint_scene(1.0, [RUB], 2.0))
    assert repr(one) == "Plan(scene: 1 joint, 2 states, 1 effect in 1 call, 2 s)"
    assert "Left out" not in str(one) and "Time scales" not in str(one)
    soft = str(plan(geared(arm_of("RRR"), {0: (SOFT,)})))
    assert "all are rigid" not in soft


def test_rows_that_joints_share_and_time_scales() -> None:
    assert planning._joined(["a"]) == "a" and planning._joined(["a", "b", "c"]) == "(a, b, c)"
    assert (
        planning._joined(list("abcd")) == "(4 joints)"
        and planning._printed("C") == "°C"
        and planning._printed("A") == "A"
    )
    scale = SimpleNamespace(name="decays", seconds=0.01234)
    rows = planning._scale_rows([("Loop of a", scale), ("Loop of b", scale), ("Bus", scale)])
    assert rows == [("Loop, decays: 0.0123 s", "a, b"), ("Bus, decays: 0.0123 s", "")]
    assert planning._table("Title", [("a", "b"), ("long", ""), ("x", "y")]) == [
        "", "Title", "  a     b", "  long", "  x     y",
    ]  # fmt: skip
    assert planning._table("Title", []) == []
    loops = [dt.PositionLoop(100.0, k, 0.1) for k in (2.0, 1.0)]
    arm = arm_of()
    effects = {name: (dt.FullRotor(1e-4, 50.0), dt.MotorCurrent(MOTOR), loop) for name, loop in
               zip(arm.joint_names[:2], loops, strict=True)}  # fmt: skip
    still = dt.Motion("m", arm.joint_names, np.array([0.0, 1.0]), *(np.zeros((2, 3)) for _ in range(3)))
    done = plan(Scene(arm, effects | {"scene": (dt.CommandedMotion(still),)}, 1.0))
    seconds = [scale.seconds for _, scale in done.time_scales]
    assert seconds == sorted(seconds) and done.time_scales[0][0] == f"PositionLoop of {arm.joint_names[1]}"


def test_breaks_of_all_effects_within_the_run() -> None:
    times = {"joint": [0.0, 0.2, 0.2, 0.9, 0.9], "motor": [0.0, 0.5, 0.5, 1.0, 1.0]}
    torques = [dt.GivenTorque(time, np.arange(5.0), side) for side, time in times.items()]
    done = plan(joint_scene(1.0, torques, 0.9))
    every = sorted({t for one in torques for t in one.breakpoints()})
    assert done.breakpoints.tolist() == [t for t in every if 0.0 < t <= 0.9] and 0.9 in done.breakpoints
    assert done.period == math.inf and done.coordinates == ["joint"]
    assert s.SPEED.name == "speed"
