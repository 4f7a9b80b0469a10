"""The mechanics of a scene: the arm with rotors and springs of its effects, as constants of the compiled equations."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetrain.arm.arm import Arm
from drivetrain.arm.coupling import coupled_groups
from drivetrain.arm.geared import with_lighter_rotors, with_rotors
from drivetrain.arm.rotors import Rotor, RotorLevel
from drivetrain.arrays import Array
from drivetrain.dynamics.closed import chain_arms
from drivetrain.dynamics.core.equation_of_motion import BODY, moving_bodies
from drivetrain.dynamics.core.frames import LINK as MOVED
from drivetrain.dynamics.core.loops import linkage_records
from drivetrain.dynamics.core.packed import followers, link_frames, packed
from drivetrain.dynamics.core.records import LINK, ROTOR
from drivetrain.effects.effect import Effect, Place, Shape
from drivetrain.effects.loads.payload_change import PayloadChange
from drivetrain.errors import Fault, InputError, raise_faults
from drivetrain.simulation.core import records as r
from drivetrain.simulation.scene import WHOLE, Inertia, Scene

# Inertial data of the last link with a payload, from a time [s] on: mass, first and second moments.
BODY_NAMES = ("mass", "hx", "hy", "hz", "sxx", "syy", "szz", "sxy", "sxz", "syz")
PAYLOAD = np.dtype([(name, np.float64) for name in ("time", *BODY_NAMES)])


@dataclass(frozen=True, eq=False)
class Coupled:
    """Coupled motors: coordinates of the mechanics are then the angles of the gears' output shafts."""

    shaft_turns: Array  # coupling matrix C from the joints to the first n coordinates, (n, n)
    turns: Array  # its inverse, from these coordinates to the joints, (n, n)


@dataclass(frozen=True, eq=False)
class ClosedLoops:
    """The closed loops of an arm: data for ``core/loops.py``, with a row per joint of a chain and rotor on a spring."""

    chains: Any  # records CHAIN
    whole: Any  # joints of the linkage, records WHOLE
    follow: NDArray[np.int64]  # indices of the passive joints
    ends: Any  # records END of the loop closures
    joints: NDArray[np.int64]  # joint of the linkage by row; -1 - k for a rotor behind a spring with coordinate k, (e,)
    screws: Array  # screws of the joints by row, (e, 6)

    def put(self, put: Callable[[Any, bool, str], Any]) -> None:
        """Add their sections to a run's memory, by calling ``put`` for each."""
        p, columns = len(self.follow), len(self.whole) + 2
        for name, values in (
            ("body_rates", np.zeros(len(self.joints))), ("row_joints", self.joints), ("chains", self.chains),
            ("whole", self.whole), ("follow", self.follow), ("ends", self.ends), ("screws", self.screws),
            ("loop_links", np.zeros(len(self.joints) + len(self.chains), MOVED)),
            ("pins", np.zeros((3 * len(self.ends) // 2, columns))), ("followed", np.zeros((p, columns))),
            ("lower", np.zeros((p, p))),
        ):  # fmt: skip
            put(values, name == "whole", name)


@dataclass(frozen=True, eq=False)
class Mechanics:
    """The mechanics of a scene."""

    # number of joints, and of coordinates: rotors behind springs come after the joints
    n: int
    c: int
    ratios: Array  # motor angle over joint coordinate [- or rad/m], (n,)
    motors: Array  # index of the coordinate of each joint's motor, (n,)
    # records LINK, ROTOR and BODY of ``mass_and_bias``; empty without an arm
    links: Any
    spinning: Any
    bodies: Any
    constant: Array  # without an arm: inertia, weight, phase, rotor's share of the inertia, (4, c)
    tip: Array  # frame of the tip in the last link's frame, (4, 4)
    arm: Arm | None  # with all rotors mounted; None without an arm
    springs: dict[int, Shape]  # shapes of the flexible joints, by joint
    # inertia about each motor's axis, referred to the joint, without stages behind a spring [kg m^2 or kg], (n,)
    rotors: Array
    # matrix from the coordinates to those of the bodies, where it is constant, (e, c): joints (of closed loops those of
    # all chains), rotors behind springs, rotors that turn with several joints
    spread: Array
    rotor_row: NDArray[np.int64]  # row of the body that the motor of each coordinate turns; -1: none, (c,)
    shaft_inertia: Array  # of reflected rotors at the shafts of coupled motors [kg m^2 or kg], (c,)
    # time [s] and inertial data of the last link from then on, records PAYLOAD, (K,)
    payloads: Any = field(default_factory=lambda: np.zeros(0, PAYLOAD))
    shafts: tuple[int, ...] = ()  # indices of the joints whose motors are coupled
    coupled: Coupled | None = None  # coupled motors; None: each joint has its own motor
    last: int = -1  # index of the link that carries the tip
    loops: ClosedLoops | None = None  # closed loops; None: there are none
    shared: tuple[tuple[int, int], ...] = ()  # axes with two motors: joints of the first and of the second motor
    carried: Any = 0.0  # inertia of stages that each spring carries [kg m^2], (n,)
    preloads: tuple[float, ...] = ()  # torque of each gear in addition to half of the load [N m], one per joint

    @cached_property
    def loads(self) -> NDArray[np.int64]:
        """Coordinate of the link that each motor drives, (n,); for a second motor behind a spring that of the first."""
        found = np.arange(self.n)
        for first, second in self.shared:
            found[second] = first if second in self.springs else second
        return found

    @cached_property
    def zeros(self) -> Array:
        """Wind-up of each spring under its preload alone [rad], (n,), at which the motor's angle counts as zero."""
        found = np.zeros(self.n)
        for i, shape in self.springs.items():
            if shape.deflection is not None and self.preloads[i]:
                found[i] = shape.deflection(self.preloads[i])
        return found

    def halved(self, torque: Array) -> Array:
        """Gear torques for torques at the joints, (N, n): each of two motors has half of the sum, plus its preload."""
        half = np.array(torque)
        for pair in map(list, self.shared):
            half[:, pair] = 0.5 * half[:, pair].sum(axis=1, keepdims=True)
        return half + np.array(self.preloads)

    def places_of(self, position: Array) -> Array:
        """Positions of the first n coordinates for positions of the joints without wind-up of the springs, (n,)."""
        return np.where(self.loads == np.arange(self.n), self.coordinates_of(position), 0.0)

    def coordinates_of(self, motion: Array) -> Array:
        """Motion of the first n coordinates (shafts, where motors are coupled) for a motion of the joints, (..., n)."""
        return motion if self.coupled is None else np.asarray(motion @ self.coupled.shaft_turns.T)

    def joints_of(self, motion: Array) -> Array:
        """Motion of the joints for a motion of the first n coordinates, (..., n)."""
        return motion if self.coupled is None else np.asarray(motion @ self.coupled.turns.T)

    def torques_of(self, torque: Array) -> Array:
        """Torques along the first n coordinates for torques at the joints, (..., n)."""
        return torque if self.coupled is None else np.asarray(torque @ self.coupled.turns)


def ratios_of(scene: Scene) -> tuple[float, ...]:
    """Motor angle over joint coordinate of each joint, from its effects and rotors; 1 if none defines it, InputError if
    they differ.
    """
    blank = Place(0, "", scene.joints, (1.0,) * len(scene.joints), scene.turning, 0, coupling_of(scene))
    result, faults = [], []
    for index, name in enumerate(scene.joints):
        place = replace(blank, joint=index, name=name)
        ratios = {effect.shape(place).ratio for effect in scene.effects.get(name, ())} - {None}
        rotor = scene.body.rotors[index] if isinstance(scene.body, Arm) else None
        if rotor is not None:
            ratios.add(rotor.ratio)
        if len(ratios) > 1:
            faults.append(Fault(f"effects[{name!r}]", "state different ratios", sorted(str(ratio) for ratio in ratios)))
        result.append(next(iter(ratios)) if ratios else 1.0)
    raise_faults(faults)
    return tuple(float(ratio or 1.0) for ratio in result)


def mechanics(scene: Scene, ratios: Sequence[float]) -> Mechanics:
    """The mechanics of a scene, with the rotors, springs and payloads of its effects; InputError if these contradict
    each other, such as two rotors at one joint.
    """
    shapes, faults = [], []
    for index, name in enumerate(scene.joints):
        place = Place(index, name, scene.joints, tuple(ratios), scene.turning, 0, coupling_of(scene))
        shape, more = _joint_shape(name, scene.effects.get(name, ()), place)
        mounted = isinstance(scene.body, Arm) and scene.body.rotors[index] is not None
        if mounted and shape.rotor_inertia is not None:
            more.append(Fault(f"effects[{name!r}]", "bring a rotor, and the arm has one there already"))
        if shape.flexible and not mounted and not shape.rotor_inertia:
            more.append(Fault(f"effects[{name!r}]", "has a spring but no rotor inertia behind it"))
        shapes.append(shape)
        faults += more
    faults += _coupled_spring_faults(scene, shapes)
    raise_faults(faults)
    body, shapes = _stages_carried(scene, shapes, np.array(ratios))
    loads = [effect.carried() for effect in scene.effects.get(WHOLE, ()) if isinstance(effect, PayloadChange)]
    if len(loads) > 1 or (loads and not isinstance(scene.body, Arm)):
        raise InputError(Fault("effects['scene']", "must hold one PayloadChange at most, and that of an arm"))
    if isinstance(body, Inertia):
        built = _without_arm(body, shapes[0], np.array(ratios))
    else:
        built = (_with_arm if body.linkage is None else _with_loops)(body, shapes, np.array(ratios))
    preloads, carried = tuple(shape.preload for shape in shapes), np.array([shape.carried for shape in shapes])
    built = replace(built, preloads=preloads, carried=carried)
    return replace(built, payloads=_payloads(built, *loads[0])) if loads else built


def _stages_carried(scene: Scene, shapes: list[Shape], ratios: Array) -> tuple[Arm | Inertia, list[Shape]]:
    """Body and shapes of a scene, with the rotors less those stages that springs carry; InputError if nothing of a
    rotor is left.
    """
    body, faults, found = scene.body, [], []
    less = np.array([shape.carried for shape in shapes]) / ratios**2
    for i, shape in enumerate(shapes):
        rotor, own = body.rotors[i] if isinstance(body, Arm) else None, shape.rotor_inertia
        whole = own if rotor is None else rotor.axial_inertia
        if less[i] and not (whole or 0.0) > less[i]:
            problem = "has no more rotor inertia than the stages that its spring carries [kg m^2]"
            hint = "the rotor's inertia includes that of the stages, as seen at the motor"
            faults.append(Fault(f"effects[{scene.joints[i]!r}]", problem, whole, hint))
        found.append(shape if own is None else replace(shape, rotor_inertia=own - less[i]))
    raise_faults(faults)
    return with_lighter_rotors(body, less) if isinstance(body, Arm) and less.any() else body, found


def coupling_of(scene: Scene) -> tuple[tuple[float, ...], ...]:
    """The coupling matrix of the motors, (n, n); empty if none are coupled."""
    coupling = scene.body.coupling if isinstance(scene.body, Arm) else None
    return () if coupling is None else tuple(tuple(float(one) for one in row) for row in coupling)


def _coupled_spring_faults(scene: Scene, shapes: Sequence[Shape]) -> list[Fault]:
    """Faults for springs at joints with coupled motors: the distribution of their torques is not modelled."""
    coupled = Place(-1, WHOLE, scene.joints, (), (), 0, coupling_of(scene)).shafts
    hint = "leave the spring out (effects: without springs), or couple no motors to this joint"
    return [
        Fault(f"effects[{scene.joints[i]!r}]", "has a spring or play behind coupled motors", None, hint)
        for i in coupled
        if shapes[i].flexible
    ]


def _joint_shape(name: str, effects: Sequence[Effect], place: Place) -> tuple[Shape, list[Fault]]:
    """The combined contribution of a joint's effects to the mechanics, and its faults."""
    shapes = [effect.shape(place) for effect in effects]
    rotors = [shape for shape in shapes if shape.rotor_inertia is not None]
    springs = [shape for shape in shapes if shape.flexible]
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
        sum(shape.preload for shape in shapes),
        sum(shape.carried for shape in shapes),
    ), faults


def _motors(shapes: Sequence[Shape], seconds: Collection[int] = ()) -> Array:
    """Index of the coordinate of each joint's motor, (n,): the joint's own, or after the joints behind a spring.

    The joint of a second motor on an axis (``seconds``) is the rotor itself, with a spring or without.
    """
    n, motors, extra = len(shapes), [], 0
    for index, shape in enumerate(shapes):
        apart = shape.flexible and index not in seconds
        motors.append(n + extra if apart else index)
        extra += apart
    return np.array(motors, dtype=np.int64)


def _mounted(arm: Arm, shapes: Sequence[Shape], ratios: Array) -> Arm:
    """The arm with those rotors of effects mounted that are rigid bodies; a reflected one behind a spring on the base,
    where nothing but its own coordinate moves it.
    """
    own = [shape.rotor_inertia for shape in shapes]
    if any(inertia is not None for inertia in own):
        mounted = [
            Rotor(float(ratio), inertia, carrier=None if shape.full else -1)
            if inertia is not None and (shape.full or shape.flexible)
            else kept
            for ratio, inertia, shape, kept in zip(ratios, own, shapes, arm.rotors, strict=True)
        ]
        arm = with_rotors(arm, mounted, level=RotorLevel.FULL if arm.level is RotorLevel.NONE else arm.level)
    return arm


def _with_arm(arm: Arm, shapes: Sequence[Shape], ratios: Array) -> Mechanics:
    """The mechanics of an arm that is an open chain."""
    motors, arm = _motors(shapes), _mounted(arm, shapes, ratios)
    free = tuple(i for i, shape in enumerate(shapes) if shape.flexible)
    model, frames, (shafts, apart, turns) = packed(arm, free), link_frames(arm), _shafts(arm)
    c, links, rotors = arm.n + len(free), model.links.copy(), model.rotors.copy()
    follow = followers(arm)
    spread, rotor_row, shaft_inertia = np.eye(c + len(follow), c), np.arange(c), np.zeros(c)
    spread[: arm.n, : arm.n], rotor_row[apart] = turns, -1
    for k, i in enumerate(follow):
        spread[c + k, i], rotor_row[i] = ratios[i], c + k
    # ``packed`` lists the additional bodies in the order of the joints; here rotors behind springs come first.
    listed = sorted([*free, *follow])
    order = [*range(arm.n), *(arm.n + listed.index(i) for i in (*free, *follow))]
    links[: len(order)], rotors["joint"] = links[order], np.argsort(order)[rotors["joint"]]
    links["rotor_inertia"][: arm.n] += [shape.carried for shape in shapes]
    reflected = np.zeros(arm.n)
    for i, (shape, at) in enumerate(zip(shapes, motors, strict=True)):
        if shape.rotor_inertia is not None and not shape.full and not shape.flexible:
            inertia = shape.rotor_inertia * ratios[i] ** 2
            if i in shafts:
                shaft_inertia[i] = inertia
            else:
                links["rotor_inertia"][at] += inertia
        row = rotor_row[at]
        reflected[i] = shaft_inertia[at] + (links["rotor_inertia"][row] * spread[row, at] ** 2 if row >= 0 else 0.0)
    bodies = moving_bodies(arm.n, len(rotors), frames[0], arm.gravity)
    return Mechanics(
        arm.n, c, ratios, motors, links, rotors, bodies, np.zeros((4, c)), np.linalg.solve(frames[-1], arm.tip),
        arm, {i: shapes[i] for i in free}, reflected, spread, rotor_row, shaft_inertia, shafts=shafts,
        coupled=None if arm.coupling is None else Coupled(arm.coupling, turns), last=arm.n - 1,
    )  # fmt: skip


def _shafts(arm: Arm) -> tuple[tuple[int, ...], list[int], Array]:
    """Joints whose motors are coupled, those of them whose motors turn with several joints or with another one, and the
    turns of the joints per turn of each shaft, (n, n).
    """
    if arm.coupling is None:
        return (), [], np.eye(arm.n)
    shafts, turns = tuple(i for group in coupled_groups(arm) for i in group), np.linalg.inv(arm.coupling)
    apart = [i for i in shafts if (arm.coupling[i] != np.eye(arm.n)[i]).any()]
    # Rows and columns of joints that are not coupled are made exact, free of rounding errors.
    for i in range(arm.n):
        if i not in shafts:
            turns[i], turns[:, i] = np.eye(arm.n)[i], np.eye(arm.n)[i]
    return shafts, apart, np.asarray(turns, dtype=np.float64)


def _with_loops(arm: Arm, shapes: Sequence[Shape], ratios: Array) -> Mechanics:
    """The mechanics of an arm with closed loops: its chains one after another; coordinates are the driven joints.

    If motors are coupled, the coordinates are their shafts.
    """
    raise_faults(
        Fault(f"effects[{name!r}]", "has a spring before a rotor that is reflected", None, "let it be a FullRotor")
        for name, shape in zip(arm.joint_names, shapes, strict=True)
        if shape.flexible and shape.rotor_inertia is not None and not shape.full
    )
    assert arm.linkage is not None
    loops = arm.linkage.loops
    motors, arm = _motors(shapes, [second for _, second in loops.shared]), _mounted(arm, shapes, ratios)
    assert arm.linkage is not None
    c = max(arm.n, int(motors.max()) + 1)
    whole, follow, ends = linkage_records(arm.linkage)
    links, rotors, bodies, screws = list[Any](), list[Any](), list[Any](), list[Array]()
    chains, joints, first = list[tuple[int, ...]](), list[int](), np.zeros(4, np.int64)  # link, rotor, body, entry
    rotor_row, at = np.full(c, -1), np.zeros(c, np.int64)  # row and link that the motor of each coordinate turns
    shafts, apart, turns = _shafts(arm)
    for chain, path in zip(chain_arms(arm), loops.paths, strict=True):
        own = {j: int(whole["coordinate"][joint]) for j, joint in enumerate(path) if joint in loops.driven}
        free = [j for j, i in own.items() if motors[i] >= arm.n and chain.rotors[j] is not None]
        model, n, row = packed(chain, tuple(free)), chain.n, len(joints)
        turned = {i: j for j, i in own.items() if i not in apart and (rotor_row[i] < 0 or chain.rotors[j] is not None)}
        behind = [int(motors[own[j]]) for j in sorted({*followers(chain), *free})]  # coordinates of rotors' rows
        turned |= {i: n + k for k, i in enumerate(behind)}
        for i, k in turned.items():
            rotor_row[i], at[i] = row + k, first[0] + k
        sizes = np.array([n, n + len(behind), len(model.rotors)])
        chains.append((row, *first.tolist(), *sizes.tolist()))
        first += [len(model.links), sizes[2], n + sizes[2] + 1, sizes[1] ** 2]
        joints += [*path, *(-1 - i for i in behind)]
        screws += [chain.screws, np.zeros((len(behind), 6))]
        links.append(model.links.copy())
        rotors.append(model.rotors)
        bodies.append(moving_bodies(n, int(sizes[2]), link_frames(chain)[0], arm.gravity))
    spread, every, lone = np.zeros((len(joints), c)), np.concatenate(links), np.zeros(c)
    for row, joint in enumerate(joints):
        driver = -1 - joint if joint < 0 else whole["coordinate"][joint]
        if joint < 0:  # of a rotor: its own angle if several joints turn it, behind a spring that of its joint
            spread[row, driver] = ratios[driver] if driver in apart else 1.0
        elif driver >= 0:
            spread[row, : arm.n] = turns[driver]
    for i, shape in enumerate(shapes):
        if shape.rotor_inertia is not None and not shape.full:
            inertia = lone if i in shafts else every["rotor_inertia"]
            inertia[i if i in shafts else at[i]] += shape.rotor_inertia * ratios[i] ** 2
    turning = np.where(rotor_row >= 0, every["rotor_inertia"][at] * spread[rotor_row, np.arange(c)] ** 2, 0.0) + lone
    firsts = {second: first for first, second in loops.shared}
    for i, shape in enumerate(shapes):
        if shape.carried:
            every["rotor_inertia"][at[firsts.get(i, i)]] += shape.carried
    closed = ClosedLoops(
        np.array(chains, r.CHAIN), whole, follow, ends, np.array(joints, np.int64), np.concatenate(screws)
    )
    return Mechanics(
        arm.n, c, ratios, motors, every, np.concatenate(rotors), np.concatenate(bodies), np.zeros((4, c)),
        np.linalg.solve(link_frames(arm.linkage.chains[0])[-1], arm.tip), arm,
        {i: shape for i, shape in enumerate(shapes) if shape.flexible}, turning[motors],
        spread, rotor_row, lone, shafts=shafts, coupled=None if arm.coupling is None else Coupled(arm.coupling, turns),
        last=arm.linkage.chains[0].n - 1, loops=closed, shared=loops.shared,
    )  # fmt: skip


def _payloads(built: Mechanics, time: Array, moments: Array) -> Any:
    """The last link's inertial data without a payload, then with each, records PAYLOAD, (K + 1,).

    ``time`` [s], (K,), and ``moments``, (K, 4, 4), are those of ``PayloadChange.carried``.
    """
    in_link = built.tip @ moments @ built.tip.T
    added = np.zeros((1 + len(time), 10))
    added[1:, 0] = in_link[:, 3, 3]
    added[1:, 1:4] = in_link[:, :3, 3]
    added[1:, 4:7] = np.diagonal(in_link, axis1=1, axis2=2)[:, :3]
    added[1:, 7], added[1:, 8], added[1:, 9] = in_link[:, 0, 1], in_link[:, 0, 2], in_link[:, 1, 2]
    payloads = np.zeros(1 + len(time), PAYLOAD)
    payloads["time"] = np.append(-1e30, time)
    for name, values in zip(BODY_NAMES, added.T, strict=True):
        payloads[name] = built.links[name][built.last] + values
    return payloads


def _without_arm(body: Inertia, shape: Shape, ratios: Array) -> Mechanics:
    """The mechanics of one joint without an arm."""
    motors, c = _motors([shape]), 1 + shape.flexible
    reflected = (shape.rotor_inertia or 0.0) * ratios[0] ** 2
    constant = np.zeros((4, c))
    constant[0, 0], constant[1, 0], constant[2, 0] = body.inertia, body.weight, body.phase
    constant[0, 0] += shape.carried
    constant[0, motors[0]] += reflected
    constant[3, motors[0]] = reflected
    return Mechanics(
        1, c, ratios, motors, np.zeros(0, LINK), np.zeros(0, ROTOR),
        np.zeros(0, BODY), constant, np.eye(4), None, {0: shape} if shape.flexible else {}, np.array([reflected]),
        np.eye(c), np.arange(c), np.zeros(c),
    )  # fmt: skip
