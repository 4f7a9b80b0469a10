"""Arms with closed loops: palletisers with parallelograms, screws on a triangle, four-bars.

A linkage is a chain that begins at the base or at a link and whose far end is pinned to another body. Some joints are
driven, the others are passive and follow. The rows of such an ``Arm`` are its driven joints only; all bodies are in
``arm.linkage``. ``dynamics/closed.py`` computes the motion of the passive joints and the torques of the driven ones.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import Annotated, Any

import numpy as np

from drivetrain.arm.arm import ROWS, Arm, Linkage, Loops
from drivetrain.arm.checks import checked_inertia
from drivetrain.arrays import Array, checked_array, frozen_array, read_only
from drivetrain.errors import Fault, Faults, InputError, nearest
from drivetrain.spatial.poses import axis_screw, pose
from drivetrain.units import Mass, Name, Vector

BASE = "base"


@dataclass(frozen=True, eq=False)
class LoopLink:
    """A body of a linkage and the joint that connects it to the body before it; in the base frame, joints at zero.

    Attributes:
        joint: Name of the joint and of the body.
        axis: Direction of the joint's axis, or of its travel [-], (3,); it is normalised.
        point: Point on the joint's axis [m], (3,).
        mass: Mass of the body [kg].
        com: Centre of mass [m], (3,); None: the joint's point.
        inertia: Inertia about the centre of mass, axes of the base [kg m^2], (3, 3).
        slides: Whether the joint is prismatic.
        driven: Whether the joint has a drive.
        lower, upper, speed_limit: Limits of the joint [rad or m, and per s]; infinite where unknown.
    """

    joint: Name
    axis: Annotated[Array, Vector("")]
    point: Annotated[Array, Vector("m")]
    mass: Mass = 0.0
    com: Annotated[Array, Vector("m")] | None = None
    inertia: Array | None = None
    slides: bool = False
    driven: bool = False
    lower: float = -inf
    upper: float = inf
    speed_limit: float = inf

    def __post_init__(self) -> None:
        place = f"LoopLink {self.joint}"
        axis = checked_array(self.axis, (3,), f"{place}.axis")
        if not axis.any():
            raise InputError(Fault(f"{place}.axis", "must not be zero", axis.tolist()))
        mass = float(checked_array(self.mass, (), f"{place}.mass"))
        if mass < 0.0:
            raise InputError(Fault(f"{place}.mass", "must not be negative [kg]", mass))
        tensor = np.zeros((3, 3)) if self.inertia is None else self.inertia
        checked = {
            "axis": frozen_array(axis / np.linalg.norm(axis), (3,), "axis"),
            "point": frozen_array(self.point, (3,), f"{place}.point"),
            "com": frozen_array(self.point if self.com is None else self.com, (3,), f"{place}.com"),
            "mass": mass,
            "inertia": checked_inertia(tensor, f"{place}.inertia"),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    @property
    def screw(self) -> Array:
        """Screw axis of the joint in the base frame, (6,)."""
        return axis_screw(self.axis, self.point, slides=self.slides)


def link_rows(links: Sequence[LoopLink]) -> dict[str, Any]:
    """The rows of links that follow each other, as ``Arm.from_screws`` takes them."""
    return {
        "home": [pose(point=link.com) for link in links],
        "screws": [link.screw for link in links],
        "masses": [link.mass for link in links],
        "inertias": [link.inertia for link in links],
        "joint_points": [link.point for link in links],
        "lower": [link.lower for link in links],
        "upper": [link.upper for link in links],
        "speed_limits": [link.speed_limit for link in links],
    }


@dataclass(frozen=True, eq=False)
class Closure:
    """A linkage from one body to another, which closes a loop; without links, a pin between two links of the arm.

    Attributes:
        start: Link or joint of the arm, or joint of an earlier linkage, to which the first link is connected; or
            ``base``.
        end: The body to which the last link is pinned.
        point: Point of the pin, base frame, all joints at zero [m], (3,). The pin keeps two points together like a ball
            joint; in a planar linkage it acts as a hinge.
        links: Links of the linkage, beginning at ``start``.
    """

    start: Name
    end: Name
    point: Annotated[Array, Vector("m")]
    links: tuple[LoopLink, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", frozen_array(self.point, (3,), "Closure.point"))
        object.__setattr__(self, "links", tuple(self.links))


def with_closures(arm: Arm, closures: Sequence[Closure], passive: Sequence[str] = ()) -> Arm:
    """The arm with linkages that close loops; its passive joints then follow the driven ones.

    Args:
        arm: The open chain, without rotors and without a coupling.
        closures: The linkages; each must be closed with all joints at zero, since its pin is given as one point.
        passive: Names of the arm's joints without a drive. Joints of linkages have none unless their link is
            ``driven``.

    Returns:
        An arm of the driven joints: the arm's own in their order, then those of the linkages. The positions of the
        driven joints determine all others. ``inverse_dynamics``, ``drive_torques``, ``joint_loads``, ``evaluate`` and
        ``simulate`` support such an arm; functions that do not raise InputError.

    Raises:
        InputError: Unknown or repeated names, an arm with rotors, no driven joint, or pins that do not determine the
            passive joints; all faults are listed.
    """
    faults = Faults()
    if any(arm.rotors) or arm.coupling is not None or arm.linkage is not None:
        faults.add("arm", "must be an open chain without rotors and coupling", arm.name)
    for name in passive:
        if name not in arm.joint_names:
            faults.add("passive", "names a joint that is not there", name, nearest(name, arm.joint_names))
    names = [*arm.joint_names, *(link.joint for closure in closures for link in closure.links)]
    for name in sorted({name for name in names if names.count(name) > 1}):
        faults.add("closures", "has a joint whose name another joint has", name)
    bodies = {BASE: -1, **{name: i for i, name in enumerate(arm.link_names)}, **{n: i for i, n in enumerate(names)}}
    paths, owner = [tuple(range(arm.n))], [0] * arm.n
    chains, ends, drives = [arm], [], [name not in passive for name in arm.joint_names]
    for k, closure in enumerate(closures):
        known = {name: body for name, body in bodies.items() if body < len(owner)}
        if closure.start not in known:
            faults.add(f"closures[{k}].start", "is no body before it", closure.start, nearest(closure.start, known))
            continue
        start = known[closure.start]
        on = () if start < 0 else paths[owner[start]][: paths[owner[start]].index(start) + 1]
        first = len(owner)
        if closure.links:
            carrier = arm if start < 0 else chains[owner[start]]
            chains.append(_chain(carrier, len(on), closure.links))
            paths.append((*on, *range(first, first + len(closure.links))))
            owner += [len(paths) - 1] * len(closure.links)
            drives += [link.driven for link in closure.links]
        ends.append((k, len(owner) - 1 if closure.links else start))
    faults.raise_any()
    driven = tuple(i for i, one in enumerate(drives) if one)
    loops = Loops(tuple(paths), tuple(owner), driven, ())
    pins = []
    for k, last in ends:
        name = closures[k].end
        if name not in bodies:
            faults.add(f"closures[{k}].end", "is no body", name, nearest(name, bodies))
            continue
        held = tuple((0 if body < 0 else owner[body], len(loops.path(body))) for body in (last, bodies[name]))
        pins.append((held[0], held[1], closures[k].point))
    if not driven:
        faults.add("passive", "leaves no joint with a drive", list(passive))
    faults.raise_any()
    return _shown(arm, Linkage(tuple(chains), replace(loops, pins=tuple(pins))))


def with_second_motors(arm: Arm, joints: Collection[int]) -> Arm:
    """The arm with an additional row after each of some joints, for a second motor that takes half of the joint's load.

    Both rows have the motion of the joint. The link of the second row has no mass; its drive is mounted like the first.
    """
    paths, owner, chains = [tuple(range(arm.n))], [0] * arm.n, [arm]
    driven, shared = list[int](), list[tuple[int, int]]()
    for joint in range(arm.n):
        driven.append(joint)
        if joint in joints:
            shared.append((len(driven) - 1, len(driven)))
            driven.append(len(owner))
            paths.append((*range(joint), len(owner)))
            owner.append(len(chains))
            name, rows = second_motor(arm.joint_names[joint]), _massless(arm, joint + 1)
            joint_names, link_names = [*arm.joint_names[:joint], name], [*arm.link_names[:joint], name]
            chains.append(Arm.from_screws(**rows, gravity=arm.gravity, joint_names=joint_names, link_names=link_names))
    return _shown(arm, Linkage(tuple(chains), Loops(tuple(paths), tuple(owner), tuple(driven), (), tuple(shared))))


def second_motor(joint: str) -> str:
    return f"{joint}_motor_2"


def _massless(arm: Arm, count: int) -> dict[str, Any]:
    """The rows of the first joints of an arm, their bodies without mass."""
    rows = {name: getattr(arm, name)[:count] for name in ROWS}
    return rows | {"masses": np.zeros(count), "inertias": np.zeros((count, 3, 3))}


def _chain(carrier: Arm, count: int, links: Sequence[LoopLink]) -> Arm:
    """A linkage after the first ``count`` joints of another chain, whose bodies have no mass here."""
    own = link_rows(links)
    rows: dict[str, Any] = {name: [*before, *own[name]] for name, before in _massless(carrier, count).items()}
    names = [*carrier.joint_names[:count], *(link.joint for link in links)]
    return Arm.from_screws(**rows, gravity=carrier.gravity, joint_names=names, check_inertias=False)


def _shown(arm: Arm, linkage: Linkage) -> Arm:
    """The driven joints of a linkage as an arm."""
    loops, rows = linkage.loops, []
    for joint in loops.driven:
        chain = linkage.chains[loops.owner[joint]]
        rows.append((chain, loops.paths[loops.owner[joint]].index(joint)))
    changes: dict[str, Any] = {name: read_only([getattr(chain, name)[at] for chain, at in rows]) for name in ROWS}
    for name in ("joint_names", "link_names"):
        changes[name] = tuple(str(getattr(chain, name)[at]) for chain, at in rows)
    return replace(arm, **changes, rotors=(None,) * len(rows), linkage=linkage)
