"""Flexible links: an arm whose links are cut into short rigid pieces connected by springs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from drivetrain.arm.arm import Arm, refuse_loops
from drivetrain.arm.coupling import placed
from drivetrain.arm.rotors import MountedRotor
from drivetrain.arrays import Array, checked_number
from drivetrain.errors import Fault, Faults, raise_faults
from drivetrain.spatial.beams import Beam
from drivetrain.spatial.inertia import RigidBody, combined
from drivetrain.spatial.poses import axis_screw, pose

NOTHING = 1e-9  # share of a link's mass below which the rest besides its beam is a rounding error
SPRINGS = 3  # at every cut: bending about x, bending about y, twisting about z


@dataclass(frozen=True, eq=False)
class BendingLink:
    """The flexible part of one link.

    Attributes:
        beam: The beam that bends, base frame, every joint at zero [m].
        mass: Mass of the beam, uniform along it [kg]; the rest of the link is rigid.
        rest_at_end: Whether the rigid rest is beyond the beam's end instead of before its start.
        pieces: Number of cuts along the beam; the error of a natural frequency decreases with its square.
    """

    beam: Beam
    mass: float
    rest_at_end: bool = False
    pieces: int = 4

    def __post_init__(self) -> None:
        faults = Faults()
        mass = faults.attempt(checked_number, self.mass, "bending link.mass", "kg", above=0.0)
        if isinstance(self.pieces, bool) or not isinstance(self.pieces, int) or self.pieces < 1:
            faults.add("bending link.pieces", "must be a whole number, 1 or more", self.pieces)
        faults.raise_any()
        object.__setattr__(self, "mass", mass)


@dataclass(frozen=True, eq=False)
class SprungArm:
    """An arm whose flexible links have additional joints with springs."""

    arm: Arm  # the arm with ``3 * pieces`` additional joints for every flexible link
    # stiffness of the spring in each joint [N m/rad], infinite at driven joints, (m,)
    stiffness: Array
    driven: tuple[int, ...]  # index in the new arm of every joint of the old one, integers, (n,)

    def widened(self, values: Array) -> Array:
        """Positions, speeds or anything else of the driven joints, with zeros for the springs, (m,) or (N, m)."""
        given = np.asarray(values, dtype=np.float64)
        wide = np.zeros((*given.shape[:-1], self.arm.n))
        wide[..., list(self.driven)] = given
        return wide


def with_flexible_links(arm: Arm, links: Mapping[int, BendingLink]) -> SprungArm:
    """The arm with links cut into short rigid pieces connected by springs.

    With all springs at zero it is the same arm; only a link whose whole mass is in the beam gets the inertia of a
    uniform beam.

    A beam is cut in the middle of each of ``pieces`` equal parts. Every cut has three springs, for bending about x and
    y and for torsion about z, with the stiffness of its part of the beam: E I and G J over the part's length. Extension
    and shear are neglected. The beam is of one material, from which follow the inertias of the pieces about their own
    axes.

    Args:
        arm: The arm, with or without rotors; a rotor carried by a flexible link moves with the last piece of that link
            if it drives a joint beyond it, else with the first piece.
        links: The flexible part of each link, by link index; lengths [m] and masses [kg].

    Returns:
        The arm and its springs.

    Raises:
        InputError: No such link, or a beam heavier than its link.

    Reference:
        Modern Robotics, section 8.9.5: "vibrations along the link" add states; here they are joints.
    """
    refuse_loops(arm)
    _check(arm, links)
    bodies: list[RigidBody] = []
    rows: list[tuple[int, Array, Array, str]] = []  # link whose home frame gives the directions, screw, point, name
    driven, starts, ends, stiffness = [], [], [], []
    for link in range(arm.n):
        own = _own(arm, link)
        driven.append(len(rows))
        starts.append(len(rows))
        rows.append((link, arm.screws[link], arm.joint_points[link], arm.joint_names[link]))
        stiffness.append(np.inf)
        pieces = [own]
        if link in links:
            pieces = _pieces(own, links[link])
            cuts = _cuts(links[link], arm.link_names[link])
            rows += [(link, screw, point, name) for screw, point, name, _ in cuts]
            stiffness += [spring for *_, spring in cuts]
        bodies += pieces
        ends.append(len(rows) - 1)
    new = _assembled(arm, rows, bodies)
    shafts = None if arm.coupling is None else placed(arm.coupling, driven, new.n)
    new = replace(new, rotors=_rotors(arm, new.n, starts, ends), coupling=shafts)
    return SprungArm(new, np.array(stiffness), tuple(driven))


def _own(arm: Arm, link: int) -> RigidBody:
    """A link in the base frame, every joint at zero."""
    return RigidBody(arm.masses[link], np.zeros(3), arm.inertias[link]).seen_from(arm.home[link])


def _check(arm: Arm, links: Mapping[int, BendingLink]) -> None:
    faults = []
    for link, bending in links.items():
        if not 0 <= link < arm.n:
            faults.append(Fault(f"links[{link}]", f"is no link of the arm: 0 to {arm.n - 1}", link))
        elif bending.mass > arm.masses[link] * (1.0 + NOTHING):
            problem = f"must not exceed that of {arm.link_names[link]}, {arm.masses[link]:g} kg"
            faults.append(Fault(f"links[{link}].mass", problem, bending.mass))
        else:
            own = _own(arm, link)
            rest = _rest(own, bending)
            rounding = NOTHING * float(np.trace(own.inertia) + own.mass * bending.beam.length**2)
            if rest is not None and float(np.linalg.eigvalsh(rest.inertia)[0]) < -rounding:
                problem = f"leaves {arm.link_names[link]} a negative moment of inertia beside the beam"
                hint = "let the beam hold the whole mass of the link, or less of it"
                faults.append(Fault(f"links[{link}].mass", problem, bending.mass, hint))
    raise_faults(faults)


def _piece(bending: BendingLink, first: float, last: float) -> RigidBody:
    """The part of a beam between two shares of its length, base frame."""
    beam, section = bending.beam, bending.beam.section
    mass, length = bending.mass * (last - first), beam.length * (last - first)
    # Second moments of area over the area, the modulus cancelled.
    x, y = section.bending_x / section.axial, section.bending_y / section.axial
    inertia = mass * np.diag([length**2 / 12.0 + x, length**2 / 12.0 + y, x + y])
    centre = beam.start + 0.5 * (first + last) * (beam.end - beam.start)
    return RigidBody(mass, np.zeros(3), inertia).seen_from(pose(beam.axes, centre))


def _rest(own: RigidBody, bending: BendingLink) -> RigidBody | None:
    """The rigid rest of a link; None if the beam is the whole link."""
    rest = combined([own, _piece(bending, 0.0, 1.0).negative()])
    return rest if rest.mass > NOTHING * own.mass else None


def _pieces(own: RigidBody, bending: BendingLink) -> list[RigidBody]:
    """The rigid pieces of a link in their order, massless ones between the springs of each cut."""
    shares = [0.0, *((np.arange(bending.pieces) + 0.5) / bending.pieces), 1.0]
    pieces = [_piece(bending, a, b) for a, b in pairwise(shares)]
    rest = _rest(own, bending)
    if rest is not None:
        at = -1 if bending.rest_at_end else 0
        pieces[at] = combined([pieces[at], rest])
    empty = RigidBody(0.0, np.zeros(3), np.zeros((3, 3)))
    found = [pieces[0]]
    for piece in pieces[1:]:
        found += [empty] * (SPRINGS - 1) + [piece]
    return found


def _cuts(bending: BendingLink, link: str) -> list[tuple[Array, Array, str, float]]:
    """Screw, point, name and stiffness of every spring along a beam."""
    beam, section = bending.beam, bending.beam.section
    part = beam.length / bending.pieces
    found = []
    for cut in range(bending.pieces):
        point = beam.start + (cut + 0.5) / bending.pieces * (beam.end - beam.start)
        springs = ((section.bending_x, "bend_x"), (section.bending_y, "bend_y"), (section.torsion, "twist"))
        for axis, (resistance, name) in zip(beam.axes.T, springs, strict=True):
            found.append((axis_screw(axis, point), point, f"{link}_{name}_{cut + 1}", resistance / part))
    return found


def _assembled(arm: Arm, rows: list[tuple[int, Array, Array, str]], bodies: list[RigidBody]) -> Arm:
    """The new arm without rotors."""
    home, inertias = np.empty((len(rows), 4, 4)), np.empty((len(rows), 3, 3))
    for i, ((link, _, point, _), body) in enumerate(zip(rows, bodies, strict=True)):
        rotation = arm.home[link, :3, :3]
        home[i] = pose(rotation, body.com if body.mass > 0.0 else point)
        turned = rotation.T @ body.inertia @ rotation
        inertias[i] = 0.5 * (turned + turned.T)
    free = {name: np.full(len(rows), sign * np.inf) for name, sign in (("lower", -1.0), ("upper", 1.0))}
    free["speed_limits"] = np.full(len(rows), np.inf)
    last = {link: i for i, (link, *_) in enumerate(rows)}
    first = {link: i for i, (link, *_) in reversed(list(enumerate(rows)))}
    for name, values in free.items():
        values[[first[link] for link in range(arm.n)]] = getattr(arm, name)
    links = [
        arm.link_names[link] if i == last[link] else f"{arm.link_names[link]}_piece_{i - first[link] + 1}"
        for i, (link, *_) in enumerate(rows)
    ]
    return replace(
        Arm.from_screws(
            home, np.array([screw for _, screw, _, _ in rows]), [body.mass for body in bodies], inertias,
            tip=arm.tip, gravity=arm.gravity, joint_points=np.array([point for _, _, point, _ in rows]),
            joint_names=[name for *_, name in rows], link_names=links, lower=free["lower"], upper=free["upper"],
            speed_limits=free["speed_limits"], name=arm.name, notes=arm.notes,
        ),
        level=arm.level,
    )  # fmt: skip


def _rotors(arm: Arm, count: int, starts: list[int], ends: list[int]) -> tuple[MountedRotor | None, ...]:
    """The rotors of the old arm, with the new indices of joints and carriers."""
    found: list[MountedRotor | None] = [None] * count
    for joint, rotor in enumerate(arm.rotors):
        if rotor is not None:
            where = ends if rotor.carrier < joint else starts
            carrier = -1 if rotor.carrier < 0 else where[rotor.carrier]
            found[starts[joint]] = replace(rotor, carrier=carrier)
    return tuple(found)
