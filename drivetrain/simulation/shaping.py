"""The mechanics of a scene: rotors and springs of the effects on the arm, as constants of the compiled equations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.rotors import Rotor, RotorLevel
from drivetrain.arm.with_rotors import with_rotors
from drivetrain.arrays import Array
from drivetrain.dynamics import passes
from drivetrain.dynamics.mass_and_bias import COLUMNS, working_rows
from drivetrain.dynamics.packed import link_frames, packed
from drivetrain.effects.effect import Effect, Place, Shape
from drivetrain.effects.payload_change import PayloadChange
from drivetrain.errors import Fault, InputError
from drivetrain.simulation.scene import WHOLE, Inertia, Scene


@dataclass(frozen=True, eq=False)
class Mechanics:
    """The mechanics of a scene.

    Attributes:
        n, c: Number of joints, and of coordinates: rotors on their own come after the joints.
        kind: 0 without an arm, 1 with one.
        ratios: Motor angle over joint coordinate [- or rad/m], (n,).
        motors: Coordinate that each joint's motor turns with, (n,).
        rows, spins, work: Of ``mass_and_bias``; empty without an arm.
        constant: Inertia, weight, phase, rotor's share of the inertia, (4, c).
        tip: Frame of the tip in the last link's, (4, 4).
        arm: With all rotors mounted; None without one.
        springs: Shapes of the flexible joints, by joint.
        rotors: Inertia about each motor's axis, at the joint [kg m^2 or kg], (n,).
        uncoupled: Flexible joints whose rotor does not feel its carrier turn.
        payloads: Instant [s], and ten numbers of the last link from there on, as in ``rows``, (K, 11).
    """

    n: int
    c: int
    kind: int
    ratios: Array
    motors: Array
    rows: Array
    spins: Array
    work: Array
    constant: Array
    tip: Array
    arm: Arm | None
    springs: dict[int, Shape]
    rotors: Array
    uncoupled: tuple[int, ...] = ()
    payloads: Array = field(default_factory=lambda: np.zeros((0, 11)))


def ratios_of(scene: Scene) -> tuple[float, ...]:
    """Motor angle over joint coordinate of each joint.

    Args:
        scene: Its effects' shapes tell, or the rotors that its arm already has.

    Returns:
        [- or rad/m], one a joint; 1 where nothing tells.

    Raises:
        InputError: Two that differ.
    """
    blank = Place(0, "", scene.joints, (1.0,) * len(scene.joints), scene.turning)
    result, faults = [], []
    for index, name in enumerate(scene.joints):
        place = replace(blank, joint=index, name=name)
        told = {effect.shape(place).ratio for effect in scene.effects.get(name, ())} - {None}
        rotor = scene.body.rotors[index] if isinstance(scene.body, Arm) else None
        if rotor is not None:
            told.add(rotor.ratio)
        if len(told) > 1:
            faults.append(Fault(f"effects[{name!r}]", "tell different ratios", sorted(str(ratio) for ratio in told)))
        result.append(next(iter(told)) if told else 1.0)
    if faults:
        raise InputError(faults)
    return tuple(float(ratio or 1.0) for ratio in result)


def mechanics(scene: Scene, ratios: Sequence[float]) -> Mechanics:
    """Rotors and springs put into the mechanics.

    Args:
        scene: The scene.
        ratios: From ``ratios_of``.

    Returns:
        The mechanics.

    Raises:
        InputError: Two rotors or springs at one joint, a spring without a rotor, motors that are coupled.
    """
    shapes, faults = [], []
    for index, name in enumerate(scene.joints):
        place = Place(index, name, scene.joints, tuple(ratios), scene.turning)
        shape, more = _joint_shape(name, scene.effects.get(name, ()), place)
        mounted = isinstance(scene.body, Arm) and scene.body.rotors[index] is not None
        if mounted and shape.rotor_inertia is not None:
            more.append(Fault(f"effects[{name!r}]", "bring a rotor, and the arm has one there already"))
        if shape.flexible and not mounted and not shape.rotor_inertia:
            more.append(Fault(f"effects[{name!r}]", "has a spring but no rotor inertia behind it"))
        shapes.append(shape)
        faults += more
    if isinstance(scene.body, Arm) and scene.body.coupling is not None:
        faults.append(Fault("arm", "has coupled motors, which forward simulation does not know yet"))
    if faults:
        raise InputError(faults)
    loads = [effect.carried() for effect in scene.effects.get(WHOLE, ()) if isinstance(effect, PayloadChange)]
    if len(loads) > 1 or (loads and not isinstance(scene.body, Arm)):
        raise InputError(Fault("effects['scene']", "must hold one PayloadChange at most, and that of an arm"))
    if isinstance(scene.body, Arm):
        built = _with_arm(scene.body, shapes, np.array(ratios))
        return replace(built, payloads=_payloads(built, *loads[0])) if loads else built
    return _without_arm(scene.body, shapes[0], np.array(ratios))


def _joint_shape(name: str, effects: Sequence[Effect], place: Place) -> tuple[Shape, list[Fault]]:
    """All shapes of a joint in one, and what contradicts."""
    told = [effect.shape(place) for effect in effects]
    rotors = [shape for shape in told if shape.rotor_inertia is not None]
    springs = [shape for shape in told if shape.flexible]
    faults = []
    if len(rotors) > 1:
        faults.append(Fault(f"effects[{name!r}]", "bring more than one rotor"))
    if len(springs) > 1:
        faults.append(Fault(f"effects[{name!r}]", "bring more than one spring"))
    return Shape(
        None,
        rotors[0].rotor_inertia if rotors else None,
        rotors[0].full if rotors else True,
        bool(springs),
        springs[0].deflection if springs else None,
    ), faults


def _motors(shapes: Sequence[Shape]) -> Array:
    n, motors, extra = len(shapes), [], 0
    for index, shape in enumerate(shapes):
        motors.append(n + extra if shape.flexible else index)
        extra += shape.flexible
    return np.array(motors, dtype=np.int64)


def _with_arm(arm: Arm, shapes: Sequence[Shape], ratios: Array) -> Mechanics:
    motors = _motors(shapes)
    own = [shape.rotor_inertia for shape in shapes]
    if any(inertia is not None for inertia in own):
        rotors = [
            Rotor(float(ratio), inertia) if inertia is not None and (shape.full or shape.flexible) else kept
            for ratio, inertia, shape, kept in zip(ratios, own, shapes, arm.rotors, strict=True)
        ]
        arm = with_rotors(arm, rotors, level=RotorLevel.FULL if arm.level is RotorLevel.NONE else arm.level)
    free = tuple(i for i, shape in enumerate(shapes) if shape.flexible)
    model = packed(arm, free)
    rows = model.rows.copy()
    reflected = np.zeros(arm.n)
    for i, (shape, inertia) in enumerate(zip(shapes, own, strict=True)):
        at = int(motors[i])
        if inertia is not None and not shape.full:
            if shape.flexible:
                # A stand-in of its own, uncoupled from its carrier.
                rows[at, passes.OWN] = inertia * ratios[i] ** 2
            else:
                rows[at, passes.OWN] += inertia * ratios[i] ** 2
        reflected[i] = rows[at, passes.OWN]
    frames = link_frames(arm)
    tip = np.linalg.solve(frames[-1], arm.tip)
    c = arm.n + len(free)
    uncoupled = tuple(i for i in free if own[i] is not None and not shapes[i].full)
    coupled = ~np.isin(model.spins[:, 0], motors[list(uncoupled)])
    rows = np.vstack([rows[:c], rows[c:][coupled]])
    spins = model.spins[coupled]
    work = working_rows(arm.n, len(spins), frames[0, :3, :3], arm.gravity)
    work[-1, 9:12] = frames[0, :3, 3]
    return Mechanics(
        arm.n, c, 1, ratios, motors, rows, np.ascontiguousarray(spins), work, np.zeros((4, c)), tip, arm,
        {i: shapes[i] for i in free}, reflected, uncoupled,
    )  # fmt: skip


def _payloads(built: Mechanics, time: Array, moments: Array) -> Array:
    """The last link's numbers, empty first, then with each body; two rows of numbers may differ in the body only."""
    in_link = built.tip @ moments @ built.tip.T
    added = np.zeros((1 + len(time), 10))
    added[1:, 0] = in_link[:, 3, 3]
    added[1:, 1:4] = in_link[:, :3, 3]
    added[1:, 4:7] = np.diagonal(in_link, axis1=1, axis2=2)[:, :3]
    added[1:, 7], added[1:, 8], added[1:, 9] = in_link[:, 0, 1], in_link[:, 0, 2], in_link[:, 1, 2]
    own = built.rows[built.n - 1, passes.MASS : passes.SYZ + 1]
    return np.column_stack([np.append(-1e30, time), own + added])


def _without_arm(body: Inertia, shape: Shape, ratios: Array) -> Mechanics:
    motors = _motors([shape])
    reflected = (shape.rotor_inertia or 0.0) * ratios[0] ** 2
    constant = np.zeros((4, 1 + shape.flexible))
    constant[0, 0], constant[1, 0], constant[2, 0] = body.inertia, body.weight, body.phase
    constant[0, motors[0]] += reflected
    constant[3, motors[0]] = reflected
    return Mechanics(
        1, 1 + shape.flexible, 0, ratios, motors, np.zeros((0, passes.WIDTH)), np.zeros((0, 3), dtype=np.int64),
        np.zeros((0, COLUMNS)), constant, np.eye(4), None, {0: shape} if shape.flexible else {}, np.array([reflected]),
    )  # fmt: skip
