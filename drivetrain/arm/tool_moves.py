"""Motions of robots: from pose to pose with synchronised joints, along lines, and along circular arcs."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.kinematics import tip_pose
from drivetrain.arm.pose_solver import JointPath, PathLostError, follow, inverse_kinematics
from drivetrain.arrays import Array, checked_array, checked_numbers
from drivetrain.errors import Fault, Faults, InputError, raise_faults
from drivetrain.motion.motion import Motion
from drivetrain.motion.point_to_point import MotionLimits, joined, joint_move, limit_rows, rest, sampled_law
from drivetrain.motion.profiles import PROFILES, Law, PathLimits, Profile
from drivetrain.spatial.rotations import is_rotation
from drivetrain.spatial.tool_path import SMALLEST_LENGTH, PathSamples, Piece, ToolPath
from drivetrain.units import Quantity, Vector

ALONG_PATH = ("line", "circle")
GRID = 400  # points of a path at which its limits are evaluated
ROUNDING = 1e-6
TOLD = 1.01  # factor of time above which a note says that a path is run slower


@dataclass(frozen=True, eq=False)
class Move:
    """One move of an arm.

    Attributes:
        kind: ``joints``: to joint positions; ``to``: to a pose with synchronised joints; ``line`` or ``circle``: the
            tool moves along a line or an arc to a pose.
        target: Joint positions [rad or m], (n,), or pose of the tip in the base frame [m], (4, 4), or its position only
            [m], (3,): the tool then keeps its rotation; on an arm of fewer than six joints the rotation is free.
        via: Point of the arc between start and end [m], (3,).
        blend: Distance from the end of a line or arc at which its corner into the next one is rounded [m]; 0: the tool
            stops at the corner.
        dwell: Dwell at the end [s].
    """

    kind: Literal["joints", "to", "line", "circle"]
    target: Any
    via: Annotated[Any, Vector("m")] | None = None
    blend: Annotated[float, Quantity("m", minimum=0.0)] = 0.0
    dwell: Annotated[float, Quantity("s", minimum=0.0)] = 0.0


@dataclass(frozen=True)
class ToolLimits:
    """Limits of the tool along lines and circles; None: no limit.

    Attributes:
        speed: Speed along the path [m/s].
        acceleration: Resultant of tangential and normal acceleration [m/s^2].
        jerk: Jerk along the path [m/s^3].
        turn_speed: Angular speed [rad/s].
        turn_acceleration: Angular acceleration [rad/s^2].
    """

    speed: float | None = None
    acceleration: float | None = None
    jerk: float | None = None
    turn_speed: float | None = None
    turn_acceleration: float | None = None


def tool_motion(
    name: str,
    arm: Arm,
    start: Any,
    moves: Sequence[Move],
    *,
    profile: Profile | Literal["trapezoid", "quintic", "s_curve"],
    limits: MotionLimits | None = None,
    tool: ToolLimits | None = None,
    sample_time: float = 0.002,
) -> Motion:
    """The motion of an arm through moves of its joints and its tool, at rest between moves without a blend.

    Along lines and circles the tool follows the profile within its own limits; if a joint would exceed its limits, the
    whole path is slowed down, and the notes say why.

    Args:
        name: Name of the motion.
        arm: The arm; its tip is the tool.
        start: Joint positions at the start [rad or m], (n,); they also choose the arm's posture.
        moves: The moves in their order.
        profile: ``trapezoid``, ``quintic``, ``s_curve``, or a user's own ``Profile``.
        limits: Limits of the joints; required by ``joints`` and ``to``.
        tool: Limits of the tool; required by ``line`` and ``circle``.
        sample_time: Largest distance between samples [s].

    Returns:
        The motion, from time 0.

    Raises:
        InputError: Wrong shapes, missing limits, a pose out of reach, or a path through a singular pose (with instant
            and position); all faults up to the first move whose end cannot be computed.
    """
    here = f"motion {name}"
    if isinstance(profile, str) and profile not in PROFILES:
        raise InputError(Fault(f"{here}: profile", f"must be one of: {', '.join(PROFILES)}", profile))
    q = checked_array(start, (arm.n,), f"{here}: start")
    if not moves:
        raise InputError(Fault(here, "needs at least one move"))
    _check_moves(moves, here, arm)
    law = PROFILES[profile] if isinstance(profile, str) else profile
    bounds = limit_rows(limits or MotionLimits(), arm.n, here)
    blocks, notes = [rest(q, 0.0, 0.0)], []
    for first, group in _between_rests(moves):
        place = f"{here}: move {first + 1}" + (f" to {first + len(group)}" if len(group) > 1 else "")
        try:
            if group[0].kind in ALONG_PATH:
                block, remarks = _along(arm, q, group, law, bounds, tool or ToolLimits(), sample_time)
                notes += [f"{place[len('motion ') :]} {one}" for one in remarks]
            else:
                block = joint_move(q, _goal(arm, q, group[0]), law, None, bounds, sample_time)
        except InputError as error:
            inner = [f"{place}: {fault.place}" if fault.place else place for fault in error.faults]
            faults = [replace(fault, place=at) for fault, at in zip(error.faults, inner, strict=True)]
            raise InputError(faults) from None
        q = block[-1, 1 : 1 + arm.n]
        blocks += [block, rest(q, 0.0, group[-1].dwell)]
    motion = joined(name, arm.joint_names, blocks, f"{len(moves)} moves, {type(law).__name__} profile")
    return replace(motion, notes=(*motion.notes, *notes))


def _check_moves(moves: Sequence[Move], here: str, arm: Arm) -> None:
    faults = Faults()
    closed = arm.linkage is not None and not arm.linkage.loops.shared
    for k, move in enumerate(moves):
        place, then = f"{here}: move {k + 1}", moves[k + 1] if k + 1 < len(moves) else None
        numbers = {f"{place}: {one}": (getattr(move, one), "") for one in ("blend", "dwell")}
        if faults.attempt(checked_numbers, numbers, least=0.0) is None:
            continue
        if move.kind not in ("joints", "to", *ALONG_PATH):
            faults.add(place, "must be one of: joints, to, line, circle", move.kind)
        elif closed and move.kind != "joints":
            hint = "state positions of the driven joints: `joints`, waypoints or a file"
            faults.add(place, "moves of the tool are not computed for arms with closed loops", move.kind, hint)
        if (move.kind == "circle") != (move.via is not None):
            faults.add(f"{place}: via", "a circle needs a point between, and nothing else has one", move.via)
        if move.blend and (move.kind not in ALONG_PATH or then is None or then.kind not in ALONG_PATH or move.dwell):
            problem = "rounds the corner from a line or circle into the next one, without a dwell between"
            faults.add(f"{place}: blend", problem, move.blend)
    faults.raise_any()


def _between_rests(moves: Sequence[Move]) -> list[tuple[int, list[Move]]]:
    """The parts that are run without a stop: index of their first move, and their moves."""
    groups: list[tuple[int, list[Move]]] = []
    for k, move in enumerate(moves):
        if k and moves[k - 1].blend:
            groups[-1][1].append(move)
        else:
            groups.append((k, [move]))
    return groups


def _pose(target: Any, before: Array) -> Array:
    """The target pose, (4, 4); a position alone keeps the rotation of ``before``."""
    if np.shape(target) == (3,):
        pose = before.copy()
        pose[:3, 3] = checked_array(target, (3,), "target")
        return pose
    pose = checked_array(target, (4, 4), "target")
    if not is_rotation(pose[:3, :3]):
        raise InputError(Fault("target", "its rotation must be orthogonal with determinant +1"))
    return pose


def _turns(arm: Arm, move: Move) -> bool:
    """Whether the move prescribes the rotation of the tool."""
    return arm.n >= 6 or np.shape(move.target) != (3,)


def _goal(arm: Arm, q: Array, move: Move) -> Array:
    if move.kind == "joints":
        return checked_array(move.target, (arm.n,), "joints")
    return inverse_kinematics(arm, _pose(move.target, tip_pose(arm, q)), q, rotation=_turns(arm, move))


def _along(
    arm: Arm, q: Array, group: list[Move], profile: Profile, bounds: Array, tool: ToolLimits, sample_time: float
) -> tuple[Array, list[str]]:
    """Samples of lines and circles that are run without a stop, in the form of ``joint_move``; and notes."""
    pieces, pose = [], tip_pose(arm, q)
    for move in group:
        there = _pose(move.target, pose)
        via = None if move.via is None else checked_array(move.via, (3,), "via")
        pieces.append(Piece(pose, there, via))
        pose = there
    if len(pieces) == 1 and pieces[0].length <= SMALLEST_LENGTH:
        return rest(q, 0.0, 0.0), []
    path = ToolPath(tuple(pieces), tuple(move.blend for move in group[:-1]))
    rotation = any(_turns(arm, move) for move in group)
    law = profile.fastest(_path_limits(path, tool))
    try:
        along = follow(arm, path.at, path.length, q, rotation=rotation)
        along(path.length * np.linspace(0.0, 1.0, GRID + 1))
        return _run(arm, path, along, law, bounds, tool, sample_time)
    except PathLostError as lost:
        raise InputError(_lost(lost, path, law, sample_time)) from None


def _run(
    arm: Arm,
    path: ToolPath,
    along: Callable[[Array], JointPath],
    law: Law,
    bounds: Array,
    tool: ToolLimits,
    sample_time: float,
) -> tuple[Array, list[str]]:
    """A path with a given time law, slowed down as far as the limits require: samples and notes."""
    notes: list[str] = []
    while True:
        time, share, rate, second = sampled_law(law, sample_time).T
        s, ds, dds = path.length * share, path.length * rate[:, None], path.length * second[:, None]
        joints = along(s)
        velocity = joints.first * ds
        acceleration = joints.second * ds**2 + joints.first * dds
        slower, why = _slower(arm, path.at(s), (ds, dds), (velocity, acceleration), bounds, tool, time)
        if slower <= 1.0 + ROUNDING:
            return np.hstack([time[:, None], joints.position, velocity, acceleration]), notes
        if slower > TOLD:
            notes = [f"is run {slower:.4g} times slower than the tool's own limits allow: {why}"]
        law = law.stretched(slower * law.duration)


def _path_limits(path: ToolPath, tool: ToolLimits) -> PathLimits:
    """Limits of the path coordinate (share of the path covered) from those of the tool, at the fastest points."""
    raise_faults(
        Fault(f"tool {name.replace('_', ' ')}", "must be above 0", value)
        for name, value in vars(tool).items()
        if value is not None and not value > 0.0
    )
    samples = path.at(np.linspace(0.0, path.length, GRID + 1))
    way, bend = (float(np.linalg.norm(x[:, 3:], axis=1).max()) for x in samples[1:])
    turn, turning = (float(np.linalg.norm(x[:, :3], axis=1).max()) for x in samples[1:])
    speeds = [_over(tool.speed, way), _over(tool.turn_speed, turn)]
    speeds += [_over(tool.acceleration, bend) ** 0.5, _over(tool.turn_acceleration, turning) ** 0.5]
    accelerations = [_over(tool.acceleration, way), _over(tool.turn_acceleration, turn)]
    return PathLimits(*(most / path.length for most in (min(speeds), min(accelerations), _over(tool.jerk, way))))


def _over(limit: float | None, size: float) -> float:
    return limit / size if limit is not None and size > SMALLEST_LENGTH else math.inf


def _slower(
    arm: Arm,
    samples: PathSamples,
    law: tuple[Array, Array],
    joints: tuple[Array, Array],
    bounds: Array,
    tool: ToolLimits,
    time: Array,
) -> tuple[float, str]:
    """Factor on the duration of the path that all limits require, and the limit that determines it."""
    ds, dds = law
    pull = samples.second * ds**2 + samples.first * dds
    needs = [(np.linalg.norm(pull[:, 3:], axis=1) / (tool.acceleration or math.inf)) ** 0.5]
    needs += [(np.linalg.norm(pull[:, :3], axis=1) / (tool.turn_acceleration or math.inf)) ** 0.5]
    words = ["the tool's acceleration", "the tool's turning"]
    for what, values, limit, power in (
        ("speed", joints[0], bounds[0], 1.0),
        ("acceleration", joints[1], bounds[1], 0.5),
    ):
        needs += list((np.abs(values) / limit).T ** power)
        words += [f"the {what} of joint {name}" for name in arm.joint_names]
    worst = np.array([need.max() for need in needs])
    most = int(worst.argmax())
    return float(worst[most]), f"{words[most]} at t = {time[int(needs[most].argmax())]:.4g} s of it"


def _lost(lost: PathLostError, path: ToolPath, law: Law, sample_time: float) -> Fault:
    """The fault of an arm that cannot follow a path: why, where and when."""
    pose = path.at(np.array([lost.distance])).poses[0]
    place = "[" + ", ".join(f"{1e3 * x:.4g}" for x in pose[:3, 3]) + "] mm"
    time, share, *_ = sampled_law(law, sample_time).T
    when = float(np.interp(lost.distance / path.length, share, time))
    what, hint = _WHY[lost.why]
    problem = f"{what} at t = {when:.4g} s of it, after {1e3 * lost.distance:.4g} mm, tool at {place}"
    return Fault("", problem, None, hint)


_WHY = {
    "out of reach": ("goes out of reach", "bring the path nearer to the arm's base"),
    "singular": (
        "comes to a singular pose, where joint speeds have no bound,",
        "go round it, start in another posture, or move there with `to`, which keeps no line",
    ),
}
