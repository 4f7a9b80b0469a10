"""The arm as data: a serial chain of rigid links on screw joints, optionally with rotors.

All frames are given in the base frame with every joint at zero, as in Modern Robotics chapter 8; twists and
screws are (angular, linear).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from drivetrain.arm.checks import checked_inertia, checked_pose, checked_screw, each, warn_of_inertias
from drivetrain.arm.rotors import MountedRotor, RotorLevel
from drivetrain.arrays import Array, Mask, axes_of, frozen_array, read_only, real_array
from drivetrain.errors import Fault, Faults, InputError, nearest, raise_faults
from drivetrain.notebook import shown
from drivetrain.spatial.poses import axis_point, pose

# arrays with one row per joint, under the names of ``Arm`` and of ``Arm.from_screws``
ROWS = ("home", "screws", "masses", "inertias", "joint_points", "lower", "upper", "speed_limits")
STANDARD_GRAVITY = (0.0, 0.0, -9.81)  # m/s^2, rounded as in Modern Robotics, pinocchio and MuJoCo


@dataclass(frozen=True, eq=False)
class Arm:
    """A serial arm of n links; build one with ``from_screws``, ``load_arm`` or ``with_rotors``.

    Attributes:
        home: Centre-of-mass frames of the links, base frame, all joints zero, (n, 4, 4).
        screws: Joint screw axes, base frame, all joints zero, (n, 6), (angular, linear). A unit angular part is a
            revolute (or helical) joint [rad], a zero one with a unit linear part a prismatic joint [m].
        masses: Masses of the links [kg], (n,).
        inertias: Inertia tensors about the centre of mass, in the home frame [kg m^2], (n, 3, 3).
        tip: End-effector frame, fixed to the last link, base frame, all joints zero, (4, 4).
        gravity: Acceleration of free fall in the base frame [m/s^2], (3,).
        joint_points: Position of each joint on its axis, base frame, all joints zero [m], (n, 3); drives and rotors are
            mounted there.
        joint_names, link_names: Names of joints and links, (n,) each.
        lower, upper: Position limits [rad or m], (n,); infinite where unknown.
        speed_limits: Speed limits [rad/s or m/s], (n,); infinite where unknown.
        rotors: One rotor per joint (None: direct drive), (n,).
        level: Which parts of the rotors' motion the dynamics includes.
        coupling: Turns of shaft i, which motor i drives through its gear, per turn of joint j [-], (n, n); None: shaft
            i is joint i. See ``coupling.py``.
        linkage: All bodies of an arm with closed loops; the rows of the arm are then its driven joints. See
            ``closures.py``.
        name: Name of the arm.
        notes: Remarks for the report: ignored tags, implausible numbers.
        file: Path of the file from which it was read, if shapes of links can be drawn from it; empty: none.
        frames: For every link of that file, by name: the moving link that carries it (itself if it moves; empty: the
            base), and its frame, base frame, all joints zero, (4, 4).
    """

    home: Array
    screws: Array
    masses: Array
    inertias: Array
    tip: Array
    gravity: Array
    joint_points: Array
    joint_names: tuple[str, ...]
    link_names: tuple[str, ...]
    lower: Array
    upper: Array
    speed_limits: Array
    rotors: tuple[MountedRotor | None, ...]
    level: RotorLevel = RotorLevel.FULL
    coupling: Array | None = None
    linkage: Linkage | None = None
    name: str = "arm"
    notes: tuple[str, ...] = field(default=())
    file: str = ""
    frames: Mapping[str, tuple[str, Array]] = field(default_factory=dict)

    def __repr__(self) -> str:
        rotors = sum(rotor is not None for rotor in self.rotors)
        return f"Arm({self.name}: {self.n} joints, {self.masses.sum():.4g} kg, {rotors} rotors)"

    def _repr_html_(self) -> str:
        import pandas as pd

        columns = {
            "joint": self.joint_names, "kind": ["slides" if one else "turns" for one in self.slides],
            "lower": self.lower, "upper": self.upper, "speed limit": self.speed_limits, "link": self.link_names,
            "mass [kg]": self.masses,
        }  # fmt: skip
        return shown(repr(self), pd.DataFrame(columns))

    @property
    def n(self) -> int:
        """Number of joints [-]."""
        return len(self.masses)

    @property
    def slides(self) -> Mask:
        """Which joints are prismatic, (n,)."""
        return np.asarray(~self.screws[:, :3].any(axis=1))

    @property
    def axes(self) -> Array:
        """Directions of the joints' axes, or of their travel, base frame, all joints at zero, (n, 3)."""
        return np.where(self.screws[:, :3].any(axis=1, keepdims=True), self.screws[:, :3], self.screws[:, 3:])

    @property
    def pitches(self) -> Array:
        """Travel of each joint along its axis per radian [m/rad], (n,); nonzero for helical joints only."""
        pitch = np.sum(self.screws[:, :3] * self.screws[:, 3:], axis=1)
        rounding = 1e-12 * np.maximum(1.0, np.linalg.norm(self.screws[:, 3:], axis=1))
        return np.where(np.abs(pitch) <= rounding, 0.0, pitch)

    def body_before(self, joint: int) -> int:
        """The body before a joint, on which the joint is mounted.

        Args:
            joint: Index of the joint [-].

        Returns:
            Index of the link [-], among all bodies of the linkage if the arm has closed loops; -1 is the base.
        """
        return joint - 1 if self.linkage is None else self.linkage.loops.before(self.linkage.loops.driven[joint])

    def body_after(self, joint: int) -> int:
        """The body that a joint moves.

        Args:
            joint: Index of the joint [-].

        Returns:
            Index of the link [-], among all bodies of the linkage if the arm has closed loops.
        """
        return joint if self.linkage is None else self.linkage.loops.driven[joint]

    def link_frame(self, name: str) -> Array:
        """The frame of a link, at its joint, in which the arm's file gives the parameters of the link.

        Args:
            name: Name of a moving link or its joint, or of a link that the file fixes to a moving link or to the base,
                such as a flange, a tool or a sensor.

        Returns:
            Frame in the base frame, all joints at zero, (4, 4); translation [m].

        Raises:
            InputError: No such link.
        """
        at = self.link_index(name)
        if name in self.frames:
            return self.frames[name][1].copy()
        return pose(self.home[at, :3, :3], self.joint_points[at])

    def link_index(self, name: str) -> int:
        """Index of the moving link of this name, or to which the file fixes a link of this name; for ``with_body``.

        Args:
            name: As in ``link_frame``.

        Returns:
            Index of the link [-]; -1 is the base.

        Raises:
            InputError: No such link.
        """
        names = (*self.link_names, *self.joint_names)
        carrier = self.frames[name][0] if name in self.frames else name
        if carrier not in names and (carrier or name not in self.frames):
            known = tuple(dict.fromkeys((*names, *self.frames)))
            raise InputError(Fault("link", "is no link or joint of the arm", name, nearest(name, known)))
        return names.index(carrier) % self.n if carrier else -1

    @classmethod
    def from_screws(
        cls,
        home: Any,
        screws: Any,
        masses: Any,
        inertias: Any,
        tip: Any = None,
        gravity: Any = STANDARD_GRAVITY,
        *,
        joint_points: Any = None,
        joint_names: Sequence[str] | None = None,
        link_names: Sequence[str] | None = None,
        lower: Any = None,
        upper: Any = None,
        speed_limits: Any = None,
        name: str = "arm",
        notes: Sequence[str] = (),
        check_inertias: bool = True,
    ) -> Arm:
        """An arm without rotors, from frames and screw axes in the base frame with every joint at zero.

        Args:
            home: Centre-of-mass frames of the links, (n, 4, 4); translation [m].
            screws: Joint screw axes, (n, 6), (angular [-], linear [m]), unit to 1e-6 and then normalised. Zero angular
                part: prismatic; angular and linear part not at right angles: helical.
            masses: Masses of the links [kg], (n,); zero is allowed.
            inertias: Inertia tensors about the centre of mass, in the home frame [kg m^2], (n, 3, 3). A tensor that no
                body can have gives a PhysicsWarning that names the link, and a note.
            tip: End-effector frame, fixed to the last link, (4, 4). None: the last link's home frame.
            gravity: Acceleration of free fall in the base frame [m/s^2], (3,).
            joint_points: Position of each joint on its axis [m], (n, 3). None: the point of the axis nearest to the
                centre of mass of its link; for a prismatic joint, that centre itself.
            joint_names, link_names: n each. None: joint_1, joint_2, ... and link_1, link_2, ...
            lower, upper: Position limits [rad or m], (n,). None: unknown, infinite.
            speed_limits: Speed limits [rad/s or m/s], (n,). None: unknown, infinite.
            name: Name of the arm.
            notes: Remarks for the report.
            check_inertias: Whether to warn of inertias that no body can have; False if the caller has done so.

        Returns:
            The arm.

        Raises:
            InputError: Wrong shapes, NaN, invalid frames, screws not unit, negative masses, asymmetric inertias, limits
                in the wrong order, repeated names; all faults are listed.
        """
        faults = Faults()
        n = _count(masses, {"home": home, "screws": screws, "inertias": inertias}, faults)
        checked_home = each(home, checked_pose, "home", faults)
        checked_screws = each(screws, checked_screw, "screws", faults)
        checked_masses = faults.attempt(_masses, masses, n)
        checked_inertias = each(inertias, checked_inertia, "inertias", faults)
        checked_tip = None if tip is None else faults.attempt(checked_pose, tip, "tip")
        checked_gravity = faults.attempt(frozen_array, gravity, (3,), "gravity")
        limits = _limits(n, lower, upper, speed_limits, faults)
        joints = _names(joint_names, n, "joint", faults)
        links = _names(link_names, n, "link", faults)
        points = None
        if joint_points is not None:
            points = faults.attempt(frozen_array, joint_points, (n, 3), "joint_points")
        faults.raise_any()
        assured_home, assured_screws = read_only(checked_home), read_only(checked_screws)
        if points is None:  # the point of each axis nearest to the link's centre of mass
            centres = assured_home[:, :3, 3]
            pairs = zip(assured_screws, centres, strict=True)
            points = read_only([axis_point(screw, centre) if screw[:3].any() else centre for screw, centre in pairs])
        warnings = warn_of_inertias(checked_inertias, links) if check_inertias else []
        return cls(
            assured_home,
            assured_screws,
            read_only(checked_masses),
            read_only(checked_inertias),
            assured_home[-1] if checked_tip is None else read_only(checked_tip),
            read_only(checked_gravity),
            points,
            joints,
            links,
            *limits,
            rotors=(None,) * n,
            name=name,
            notes=(*notes, *warnings),
        )


@dataclass(frozen=True, eq=False)
class Loops:
    """Topology of an arm with closed loops.

    Joints and bodies are numbered with those of the arm first, then those of the linkages in their order.
    """

    paths: tuple[tuple[int, ...], ...]  # joints of each chain from the base, the arm's own first
    owner: tuple[int, ...]  # index of the chain that contains the mass of each body
    driven: tuple[int, ...]  # joints with a drive, in the order of the arm that shows them
    # each pin: two chains, the number of joints of each before the pin, and the pin's point in the base frame with all
    # joints at zero [m], (3,)
    pins: tuple[tuple[tuple[int, int], tuple[int, int], Array], ...]
    shared: tuple[tuple[int, int], ...] = ()  # rows of the two motors of an axis, each with half its load

    @property
    def passive(self) -> tuple[int, ...]:
        return tuple(joint for joint in range(len(self.owner)) if joint not in self.driven)

    def path(self, body: int) -> tuple[int, ...]:
        """Joints from the base to a body, its own joint last; empty for the base, -1."""
        if body < 0:
            return ()
        path = self.paths[self.owner[body]]
        return path[: path.index(body) + 1]

    def before(self, joint: int) -> int:
        """The body before a joint, on which the joint is mounted; -1 is the base."""
        path = self.path(joint)
        return path[-2] if len(path) > 1 else -1

    def moving(self, body: int) -> tuple[int, ...]:
        """Indices, among the driven joints, of those that may move a body; all of them behind a passive joint."""
        path = self.path(body)
        every = any(joint not in self.driven for joint in path)
        found = {k for k, joint in enumerate(self.driven) if every or joint in path}
        return tuple(sorted(found.union(*(pair for pair in self.shared if found & {*pair}))))

    @property
    def size(self) -> float:
        """Largest distance of a pin from the base's origin [m]; 1 if there is none."""
        return max((float(np.linalg.norm(point)) for _, _, point in self.pins), default=1.0) or 1.0

    @property
    def mean(self) -> Array:
        """Projection of driven joint motions onto those in which the two motors of an axis move alike, (n, n)."""
        found = np.eye(len(self.driven))
        for pair in map(list, self.shared):
            found[np.ix_(pair, pair)] = 0.5
        return found

    def inside(self, joint: int) -> bool:
        """Whether a joint is part of a closed loop, so that its loads across the axis are statically indeterminate."""
        ends = [[joint in self.paths[chain][:count] for chain, count in pin[:2]] for pin in self.pins]
        return any(first != second for first, second in ends)


@dataclass(frozen=True, eq=False)
class Linkage:
    """The bodies of an arm with loops."""

    # each chain has all joints from the base; a body has its mass in only one of them; the rotors are those of the arm
    chains: tuple[Arm, ...]
    loops: Loops  # the topology

    def with_chain(self, index: int, chain: Arm) -> Linkage:
        """The linkage with one of its chains replaced."""
        return replace(self, chains=(*self.chains[:index], chain, *self.chains[index + 1 :]))


def refuse_loops(arm: Arm, *, shared: bool = False, closed: bool = False) -> None:
    """Raise InputError for an arm with closed loops or with two motors on an axis (unless ``shared``, ``closed``)."""
    if arm.linkage is not None and arm.linkage.loops.shared:
        if shared:
            return
        problem = "has two motors on one axis, which is not computed here"
        known = "evaluations, selections, currents, commanders, simulations and exports to mjcf and c know such arms"
        raise InputError(Fault("arm", problem, arm.name, known))
    if arm.linkage is not None and not closed:
        known = "inverse dynamics, evaluations, simulations, commanders and all exports but URDF know such arms"
        hint = f"{known}; constraints on an open chain go through LoopClosure"
        raise InputError(Fault("arm", "has closed loops (closures), which is not computed here", arm.name, hint))


def _count(masses: Any, others: dict[str, Any], faults: Faults) -> int:
    """The number of joints, taken from the masses; the other lists must have the same length for further checks."""
    n = len(masses) if axes_of(masses) == 1 else 0
    if n == 0:
        faults.add("masses", "must be a list of at least one mass [kg]", masses)
        faults.raise_any()
    for name, values in others.items():
        sized = hasattr(values, "__len__") and getattr(values, "ndim", 1) > 0  # an array without axes has no length
        if not sized or len(values) != n:
            count = len(values) if sized else values
            faults.add(name, f"must have one entry a joint, {n} as masses has", count)
    faults.raise_any()
    return n


def _masses(masses: Any, n: int) -> Array:
    values = frozen_array(masses, (n,), "masses")
    raise_faults(Fault(f"masses[{i}]", "must not be negative [kg]", float(m)) for i, m in enumerate(values) if m < 0)
    return values


def _limits(n: int, lower: Any, upper: Any, speed: Any, faults: Faults) -> tuple[Array, Array, Array]:
    low = _limit(n, lower, -np.inf, "lower", faults)
    high = _limit(n, upper, np.inf, "upper", faults)
    fast = _limit(n, speed, np.inf, "speed_limits", faults)
    for i in np.flatnonzero(low > high):
        faults.add(f"lower[{i}]", f"must not be above upper[{i}], {high[i]:.6g}", float(low[i]))
    for i in np.flatnonzero(fast <= 0.0):
        faults.add(f"speed_limits[{i}]", "must be positive [rad/s or m/s]", float(fast[i]))
    return low, high, fast


def _limit(n: int, values: Any, unknown: float, name: str, faults: Faults) -> Array:
    if values is None:
        return read_only(np.full(n, unknown))
    try:
        limits = real_array(values).copy()
    except (TypeError, ValueError, OverflowError):
        limits = np.empty(0)
    if limits.shape != (n,) or np.isnan(limits).any():
        faults.add(name, f"must be {n} numbers (infinite where unknown)", values)
        return read_only(np.full(n, unknown))
    return read_only(limits)


def _names(names: Sequence[str] | None, n: int, kind: str, faults: Faults) -> tuple[str, ...]:
    if names is None:
        return tuple(f"{kind}_{i + 1}" for i in range(n))
    if len(names) != n or len(set(names)) != n:
        faults.add(f"{kind}_names", f"must be {n} different names", list(names))
    return tuple(str(name) for name in names)
