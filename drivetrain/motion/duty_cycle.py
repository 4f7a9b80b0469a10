"""The duty cycle: motions, dwells and payloads as one sequence that repeats indefinitely.

A mix of several such cycles, each with its share of the operating time, is one ``Cycle`` too.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Annotated, Any

import numpy as np
from annotated_types import Ge

from drivetrain.arrays import Array, Indices, Mask, read_only
from drivetrain.errors import Fault, InputError, raise_faults
from drivetrain.motion.motion import LoadTable, Motion
from drivetrain.units import Duration, Name

GAP_ALLOWED = 1e-3  # [rad or m] accepted as rounding between two motions; a larger gap is a step that no drive can make
GAP_SEEN = 1e-6  # [rad or m] above this, the gap is reported
SERIES = ("position", "velocity", "acceleration")
TIME_ROUNDING = 1e-9  # of a step's length: samples closer than this are at one instant
SPEED_STEP_SEEN = 1e-3  # steps of speed above this share of the joint's peak speed are reported


@dataclass(frozen=True, eq=False)
class Cycle:
    """Samples of one period of the repeated task; for a mix, of one period of each of its parts.

    Each part repeats by itself while it is in use, so the last sample of a part is followed by the first sample of the
    same part.

    Attributes:
        joint_names: (n,).
        time: From 0, non-decreasing [s], (N,); the parts of a mix follow one another.
        position: [rad or m], (N, n); for a load table, the integral of the speed.
        velocity: [rad/s or m/s], (N, n).
        acceleration: [rad/s^2 or m/s^2], (N, n).
        torque: Given torque at the gear output [N m], (N, n); None if it follows from an arm.
        payload: Index into ``payload_names`` of the payload at the tip, -1 for none, (N,), integers.
        payload_names: Names of the payloads that occur.
        segment: Index into ``segment_names``, (N,), integers.
        segment_names: Names of motions and dwells in their order.
        notes: Notes of its motions, and warnings about gaps and steps of speed between them.
        tip_wrench: Moment [N m] and force [N] that the tip applies to its surroundings, in the tip frame, (N, 6); None
            if the task states no force.
        parts: Samples of each part of a mix, in their order; default: one part with all samples.
        shares: Share of the operating time of each part; the sum is 1.
        part_names: Name of each part; one empty name if the cycle is not a mix.
    """

    joint_names: tuple[str, ...]
    time: Array
    position: Array
    velocity: Array
    acceleration: Array
    torque: Array | None
    payload: Indices
    payload_names: tuple[str, ...]
    segment: Indices
    segment_names: tuple[str, ...]
    notes: tuple[str, ...] = ()
    tip_wrench: Array | None = None
    parts: tuple[slice, ...] = ()
    shares: tuple[float, ...] = (1.0,)
    part_names: tuple[str, ...] = ("",)

    def __post_init__(self) -> None:
        if len(self.parts) <= 1:  # also after ``replace`` has changed the number of samples
            object.__setattr__(self, "parts", (slice(0, len(self.time)),))
        if not len(self.parts) == len(self.shares) == len(self.part_names):
            raise InputError(Fault("cycle.parts", "needs one share and one name a part", len(self.parts)))
        if self.parts[-1].stop != len(self.time):
            raise InputError(Fault("cycle.parts", "must cover all samples", self.parts[-1].stop))

    def __repr__(self) -> str:
        steps = ", ".join(self.segment_names[:6]) + (", ..." if len(self.segment_names) > 6 else "")
        return f"Cycle({steps}: {len(self.joint_names)} joints, {len(self.time)} samples, {self.duration:.4g} s)"

    @property
    def duration(self) -> float:
        """Length of the period [s]; for a mix, the sum over one period of each part."""
        return float(self.time[-1] - self.time[0])

    @cached_property
    def weights(self) -> Array:
        """Integration weight of each sample [s], (N,); their sum is ``duration``.

        An integral over the repeated task is the sum over the samples with these weights. For a mix, the weights of a
        part add up to ``duration`` times the part's share of the operating time.
        """
        weights = sample_weights(self.time)
        if len(self.parts) > 1:
            for part, share in zip(self.parts, self.shares, strict=True):
                weights[part] *= share * self.duration / float(self.time[part][-1] - self.time[part][0])
        return np.asarray(read_only(weights))

    @cached_property
    def before(self) -> Indices:
        """Index of the preceding sample, (N,), integers; the first sample of a part is preceded by its last."""
        return np.concatenate([np.roll(np.arange(part.start, part.stop), 1) for part in self.parts])

    @cached_property
    def after(self) -> Indices:
        """Index of the following sample, (N,), integers; the last sample of a part is followed by its first."""
        return np.concatenate([np.roll(np.arange(part.start, part.stop), -1) for part in self.parts])

    def at(self, samples: Any) -> Cycle:
        """Some of its samples, with their times, as a cycle that is no mix.

        Args:
            samples: Indices, or a slice.

        Returns:
            The cycle of these samples.
        """
        names = ("time", *SERIES, "torque", "payload", "segment", "tip_wrench")
        rows = {name: series[samples] for name in names if (series := getattr(self, name)) is not None}
        return replace(self, **rows, parts=(), shares=(1.0,), part_names=("",))

    def part_at(self, time: float) -> int:
        """The part of a mix that contains an instant.

        Args:
            time: Time since the start of the cycle [s].

        Returns:
            Index of the part; at the boundary of two parts, of the first.
        """
        ends = [float(self.time[part.stop - 1]) for part in self.parts]
        return min(int(np.searchsorted(ends, time)), len(ends) - 1)


@dataclass(frozen=True, eq=False)
class StepForce:
    """The force at the tip during one step of a cycle."""

    name: str  # what to call it
    times: Array  # times since the beginning of the step at which it has a kink [s], (K,)
    # from times since the beginning of the step [s], (N,), and the positions and speeds of the joints at these times,
    # (N, n), the moment [N m] and force [N] that the tip applies to its surroundings, in the tip frame, (N, 6)
    wrench: Callable[[Array, Array, Array], Array]


@dataclass(frozen=True, eq=False)
class Step:
    """One entry of the cycle: a motion, a load table or a dwell.

    Attributes:
        motion: The motion or load table; None for a dwell.
        dwell: Time for which the last position is held [s]; None for a motion.
        repetitions: Number of consecutive repetitions.
        payload: Name of the payload at the tip during the step; None for none.
        force: Force of the tip on its surroundings during the step; None for none.
        name: Name of the step; empty: the motion's name, or ``dwell``.
    """

    motion: Motion | LoadTable | None = None
    dwell: Duration | None = None
    repetitions: Annotated[int, Ge(1)] = 1
    payload: Name | None = None
    force: StepForce | None = None
    name: str = ""

    @property
    def label(self) -> str:
        """Name used in messages and reports."""
        return self.name or (self.motion.name if self.motion is not None else "dwell")


@dataclass(frozen=True, eq=False)
class _Block:
    """Samples of one repetition of a step; arrays are (N, n) except the time, (N,)."""

    label: str
    time: Array
    position: Array
    velocity: Array
    acceleration: Array
    torque: Array
    tip_wrench: Array | None = None  # (N, 6)


def build_cycle(steps: Sequence[Step], *, may_stay_open: bool = False, slides: Mask | None = None) -> Cycle:
    """Join steps into one period.

    A dwell holds the position before it at zero speed (a dwell at the start: the position after it); between load
    tables it holds the last torque. At the boundary of two steps there are two samples at one instant.

    Args:
        steps: In their order: motions, or load tables, and dwells.
        may_stay_open: Accept a last position that differs from the first, as for an indexing table.
        slides: Which joints are prismatic, (n,), so that messages use m and deg; None: "rad or m".

    Returns:
        The cycle, starting at time 0.

    Raises:
        InputError: Steps that are neither motion nor dwell, different joints, gaps of position between steps or
            between the end and the start, motions mixed with load tables, or zero duration; all of them listed.
    """
    raise_faults(_step_faults(steps))
    blocks, which = _blocks(steps)
    if not blocks:
        raise InputError(Fault("cycle", "takes no time"))
    loaded = any(isinstance(step.motion, LoadTable) for step in steps)
    joint_names = next(step.motion.joint_names for step in steps if step.motion is not None)
    notes = list(dict.fromkeys(note for step in steps if step.motion is not None for note in step.motion.notes))
    if loaded:
        blocks = _from_integral(blocks)
        if any(step.motion is None for step in steps):
            notes.append("dwells between load tables hold the last torque at no speed")
    else:
        notes += _gaps(blocks, joint_names, may_stay_open, slides)
    notes += _speed_steps(blocks, joint_names, slides)
    payload_names = tuple(dict.fromkeys(step.payload for step in steps if step.payload is not None))
    carried = [-1 if step.payload is None else payload_names.index(step.payload) for step in steps]
    lengths = [len(block.time) for block in blocks]
    begins = np.cumsum([0.0] + [float(block.time[-1]) for block in blocks])
    return Cycle(
        joint_names=joint_names,
        time=read_only(np.concatenate([block.time + begin for block, begin in zip(blocks, begins, strict=False)])),
        **{name: read_only(np.concatenate([getattr(block, name) for block in blocks])) for name in SERIES},
        torque=read_only(np.concatenate([block.torque for block in blocks])) if loaded else None,
        payload=_per_sample([carried[index] for index in which], lengths),
        payload_names=payload_names,
        segment=_per_sample(which, lengths),
        segment_names=tuple(step.label for step in steps),
        notes=tuple(notes),
        tip_wrench=_tip_wrenches(blocks),
    )


def _tip_wrenches(parts: Sequence[_Block] | Sequence[Cycle]) -> Array | None:
    """The wrenches at the tip of parts one after another, zeros for parts without; None if no part has any."""
    if all(part.tip_wrench is None for part in parts):
        return None
    rows = [np.zeros((len(part.time), 6)) if part.tip_wrench is None else part.tip_wrench for part in parts]
    return np.asarray(read_only(np.concatenate(rows)))


def samples_between(time: Array, instants: Array, near: float) -> tuple[Indices, Array, Callable[[Array], Array]]:
    """Further samples at rising instants, interpolated linearly; none outside the given samples or ``near`` one [s].

    Returns the samples before which they go, their instants, (K,) each, and a function that inserts them into a series.
    """
    after = np.searchsorted(time, instants, side="right").clip(1, len(time) - 1)
    away = np.minimum(np.abs(time[after] - instants), np.abs(time[after - 1] - instants)) > near
    new = away & (instants > time[0]) & (instants < time[-1])
    at, instants = after[new], instants[new]
    share = ((instants - time[at - 1]) / (time[at] - time[at - 1]))[:, np.newaxis]

    def with_between(values: Array) -> Array:
        return np.insert(values, at, values[at - 1] + share * (values[at] - values[at - 1]), axis=0)

    return at, instants, with_between


def sample_weights(time: Array) -> Array:
    """Weights [s] of the trapezoidal rule: their product with values at the samples sums to the integral; (N,)."""
    half = 0.5 * np.diff(time)
    weights = np.zeros(len(time))
    weights[:-1] += half
    weights[1:] += half
    return weights


def _per_sample(labels: list[int], lengths: list[int]) -> Indices:
    return np.asarray(read_only(np.repeat(np.array(labels, dtype=np.int64), lengths)))


def _step_faults(steps: Sequence[Step]) -> list[Fault]:
    """Faults of single steps, and of joints that differ between steps."""
    faults: list[Fault] = []
    motions = [step.motion for step in steps if step.motion is not None]
    if not motions:
        return [Fault("cycle", "needs at least one motion or load table")]
    if len({type(motion) for motion in motions}) > 1:
        faults.append(Fault("cycle", "mixes motions of an arm with load tables"))
    for index, step in enumerate(steps):
        place = f"cycle[{index}] ({step.label})"
        if (step.motion is None) == (step.dwell is None):
            faults.append(Fault(place, "must be either a motion or a dwell"))
        if step.dwell is not None and not 0.0 <= step.dwell < np.inf:
            faults.append(Fault(place, "a dwell must not be negative [s]", step.dwell))
        if step.repetitions != int(step.repetitions) or step.repetitions < 1:
            faults.append(Fault(place, "repetitions must be a whole number from 1", step.repetitions))
        if step.motion is not None and step.motion.joint_names != motions[0].joint_names:
            expected = f"has other joints than {motions[0].name}: {', '.join(motions[0].joint_names)}"
            faults.append(Fault(place, expected, ", ".join(step.motion.joint_names)))
        if step.payload is not None and isinstance(step.motion, LoadTable):
            faults.append(Fault(place, "a load table already holds the load: it takes no payload", step.payload))
        if step.force is not None and isinstance(step.motion, LoadTable):
            faults.append(Fault(place, "a load table already holds the load: it takes no force", step.force.name))
    return faults


def _blocks(steps: Sequence[Step]) -> tuple[list[_Block], list[int]]:
    """Samples of all repetitions of all steps, each from time 0, and the index of the step of each."""
    blocks: list[_Block] = []
    which: list[int] = []
    before = _run(next(step for step in steps if step.motion is not None))
    position, torque = before.position[0], before.torque[0]
    for index, step in enumerate(steps):
        block = _rest(step, position, torque) if step.motion is None else _run(step)
        if step.force is not None:
            block = _pressing(block, step.force)
        if block.time[-1] > 0.0:
            blocks += [block] * int(step.repetitions)
            which += [index] * int(step.repetitions)
            position, torque = block.position[-1], block.torque[-1]
    return blocks, which


def _run(step: Step) -> _Block:
    motion = step.motion
    assert motion is not None
    time, none = motion.time - motion.time[0], np.zeros_like(motion.acceleration)
    if isinstance(motion, LoadTable):
        return _Block(step.label, time, none, motion.speed, motion.acceleration, motion.torque)
    return _Block(step.label, time, motion.position, motion.velocity, motion.acceleration, none)


def _rest(step: Step, position: Array, torque: Array) -> _Block:
    held, none = np.tile(position, (2, 1)), np.zeros((2, len(position)))
    return _Block(step.label, np.array([0.0, step.dwell or 0.0]), held, none, none, np.tile(torque, (2, 1)))


def _pressing(block: _Block, force: StepForce) -> _Block:
    """The samples of a step with the force at the tip, and with further samples where the force has kinks."""
    at, instants, between = samples_between(block.time, force.times, TIME_ROUNDING * block.time[-1])
    time, torque = np.insert(block.time, at, instants), between(block.torque)
    position, velocity, acceleration = (between(getattr(block, name)) for name in SERIES)
    return _Block(block.label, time, position, velocity, acceleration, torque, force.wrench(time, position, velocity))


def _from_integral(blocks: list[_Block]) -> list[_Block]:
    """The blocks of load tables with the position as the integral of speed, from zero at the start of the cycle."""
    counted, start = [], np.zeros(blocks[0].velocity.shape[1])
    for block in blocks:
        half = 0.5 * np.diff(block.time)[:, np.newaxis]
        travel = np.cumsum(half * (block.velocity[1:] + block.velocity[:-1]), axis=0)
        counted.append(replace(block, position=start + np.vstack([np.zeros(len(start)), travel])))
        start = counted[-1].position[-1]
    return counted


def _boundaries(blocks: list[_Block]) -> list[tuple[str, _Block, _Block, bool]]:
    """(label, block, next block, whether the period closes here) of each block; the last is followed by the first."""
    pairs = [(f"{a.label} to {b.label}", a, b, False) for a, b in itertools.pairwise(blocks)]
    return [*pairs, (f"end ({blocks[-1].label}) to start ({blocks[0].label})", blocks[-1], blocks[0], True)]


def shown_unit(slides: Mask | None, joint: int) -> tuple[str, float]:
    """The unit in which messages show a joint's position, and the factor from SI to it."""
    if slides is None:
        return "rad or m", 1.0
    return ("m", 1.0) if slides[joint] else ("deg", math.degrees(1.0))


def _gaps(blocks: list[_Block], joint_names: tuple[str, ...], may_stay_open: bool, slides: Mask | None) -> list[str]:
    """Notes on small gaps of position between steps; large gaps raise ``InputError``."""
    faults: dict[str, Fault] = {}
    notes: dict[str, None] = {}
    for where, before, after, closing in _boundaries(blocks):
        for i, (joint, end, start) in enumerate(zip(joint_names, before.position[-1], after.position[0], strict=True)):
            gap, (unit, times) = float(start - end), shown_unit(slides, i)
            text = f"{joint} stands at {times * end:.6g} and goes on from {times * start:.6g} [{unit}]"
            if abs(gap) <= GAP_SEEN:
                continue
            if abs(gap) <= GAP_ALLOWED or (closing and may_stay_open):
                notes[f"warning: {where}: {text}"] = None
                continue
            fix = "add a motion back, or open_cycle: true" if closing else "add a motion between them"
            problem = f"{'the cycle does not close' if closing else 'a gap'}: {text}"
            faults[where + joint] = Fault(f"cycle, {where}", problem, None, fix)
    raise_faults(faults.values())
    return list(notes)


def _speed_steps(blocks: list[_Block], joint_names: tuple[str, ...], slides: Mask | None) -> list[str]:
    peak = np.max([np.abs(block.velocity).max(axis=0) for block in blocks], axis=0)
    notes: dict[str, None] = {}
    for where, before, after, _ in _boundaries(blocks):
        step = after.velocity[0] - before.velocity[-1]
        for index in np.flatnonzero(np.abs(step) > SPEED_STEP_SEEN * peak):
            unit, times = shown_unit(slides, int(index))
            text = f"speed of {joint_names[index]} steps by {times * step[index]:.4g}"
            rate = unit.replace(" or", "/s or") + "/s"
            notes[f"warning: {where}: {text} [{rate}]; the impulse it takes is not counted"] = None
    return list(notes)


# A mix: several repeated tasks, each with its share of the operating time, as one cycle of several parts


SHARE_ROUNDING = 1e-6  # accepted difference of the sum of the shares from 1, as rounding of written numbers


def build_mix(cycles: Sequence[Cycle], shares: Sequence[float], *, names: Sequence[str] | None = None) -> Cycle:
    """Combine several cycles, each used for a share of the operating time, into one.

    Each part repeats by itself while it is in use. Peaks are the largest over all parts; averages, RMS values, energy
    and life weight each part by its share of the time. Of a part with share 0 only the peaks count.

    Args:
        cycles: Cycles of the same joints, all from motions or all from load tables; a single one is returned unchanged.
        shares: Share of the operating time of each cycle; the sum must be 1.
        names: Names of the parts; None: ``part 1`` and so on.

    Returns:
        The mix; its time runs through one period of each part after another.

    Raises:
        InputError: Shares outside 0 to 1 or with another sum, different joints, motions mixed with load tables; all
            of them listed.
    """
    called = [f"part {i + 1}" for i in range(len(cycles))] if names is None else [str(name) for name in names]
    raise_faults(_faults(cycles, list(shares), called))
    if len(cycles) == 1:
        return cycles[0]
    ends = np.cumsum([0.0, *(cycle.duration for cycle in cycles)])
    stops = np.cumsum([0, *(len(cycle.time) for cycle in cycles)]).tolist()
    total = math.fsum(shares)
    payload_names = tuple(dict.fromkeys(name for cycle in cycles for name in cycle.payload_names))
    segments = np.cumsum([0, *(len(cycle.segment_names) for cycle in cycles)]).tolist()
    torques = [cycle.torque for cycle in cycles if cycle.torque is not None]
    time = [cycle.time - cycle.time[0] + end for cycle, end in zip(cycles, ends, strict=False)]
    return Cycle(
        joint_names=cycles[0].joint_names,
        time=read_only(np.concatenate(time)),
        **{name: read_only(np.concatenate([getattr(cycle, name) for cycle in cycles])) for name in SERIES},
        torque=read_only(np.concatenate(torques)) if torques else None,
        payload=read_only(np.concatenate([_renumbered(cycle, payload_names) for cycle in cycles])),
        payload_names=payload_names,
        segment=read_only(
            np.concatenate([cycle.segment + first for cycle, first in zip(cycles, segments, strict=False)])
        ),
        segment_names=tuple(name for cycle in cycles for name in cycle.segment_names),
        notes=tuple(
            _with_part_name(name, note) for name, cycle in zip(called, cycles, strict=True) for note in cycle.notes
        ),
        tip_wrench=_tip_wrenches(cycles),
        parts=tuple(slice(first, stop) for first, stop in itertools.pairwise(stops)),
        shares=tuple(float(share) / total for share in shares),
        part_names=tuple(called),
    )


def share_faults(shares: Sequence[float]) -> list[Fault]:
    """Faults of shares of the operating time: outside 0 to 1, or a sum other than 1."""
    faults = [
        Fault(f"shares[{i}]", "must lie between 0 and 1 (0 % and 100 %)", share)
        for i, share in enumerate(shares)
        if not 0.0 <= share <= 1.0
    ]
    if not faults and shares and abs(math.fsum(shares) - 1.0) > SHARE_ROUNDING:
        text = " + ".join(f"{100.0 * share:g} %" for share in shares)
        total = 100.0 * math.fsum(shares)
        faults.append(Fault("shares", f"must add to 100 %: {text} is {total:g} %", None, "what is left may be a dwell"))
    return faults


def _faults(cycles: Sequence[Cycle], shares: list[float], names: list[str]) -> list[Fault]:
    if not cycles:
        return [Fault("mix", "needs at least one cycle")]
    faults: list[Fault] = []
    for what, found in (("share", shares), ("name", names)):
        if len(found) != len(cycles):
            faults.append(Fault("mix", f"needs one {what} for each of {len(cycles)} cycles", len(found)))
    twice = sorted({name for name in names if names.count(name) > 1})
    faults += [Fault("mix", "has two parts of one name", name) for name in twice]
    faults += share_faults(shares)
    for i, cycle in enumerate(cycles):
        if len(cycle.parts) > 1:
            faults.append(Fault(f"mix[{i}]", "is a mix itself: give its parts"))
        if cycle.joint_names != cycles[0].joint_names:
            expected = f"has other joints than the first: {', '.join(cycles[0].joint_names)}"
            faults.append(Fault(f"mix[{i}]", expected, ", ".join(cycle.joint_names)))
        if (cycle.torque is None) != (cycles[0].torque is None):
            faults.append(Fault(f"mix[{i}]", "mixes motions of an arm with load tables"))
    return faults


def _with_part_name(name: str, note: str) -> str:
    """The note of a part with the part's name in front; a warning still begins with "warning:"."""
    warning = "warning: "
    return f"{warning}{name}: {note.removeprefix(warning)}" if note.startswith(warning) else f"{name}: {note}"


def _renumbered(cycle: Cycle, names: tuple[str, ...]) -> Indices:
    """The cycle's payload indices, converted to indices into ``names``; -1 (none) stays."""
    places = np.array([*(names.index(name) for name in cycle.payload_names), -1], dtype=np.int64)
    return np.asarray(places[cycle.payload])
