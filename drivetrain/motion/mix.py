"""Several repeated tasks in a mix: each with its share of the time of use, as one cycle of several parts."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np

from drivetrain.arrays import read_only
from drivetrain.errors import Fault, InputError
from drivetrain.motion.duty_cycle import Cycle, Indices

SERIES = ("position", "velocity", "acceleration")
WHOLE = 1e-6  # by which shares may miss 1: rounding of what was written, not a part forgotten


def build_mix(cycles: Sequence[Cycle], shares: Sequence[float], *, names: Sequence[str] | None = None) -> Cycle:
    """Several cycles, each used for a share of the time, as one.

    Each part repeats by itself while it is in use. Peaks are the worst over all parts; averages, RMS, energy and life
    count each part by its share of the time. A part of share 0 is used so rarely that only its peaks count.

    Args:
        cycles: Of the same joints, all from motions or all from load tables; one alone is handed back as it is.
        shares: Of the time of use, one a cycle, together 1.
        names: What to call the parts; None: ``part 1`` and so on.

    Returns:
        The mix; its time runs through one period of each part after another.

    Raises:
        InputError: Shares that are no shares or do not add to 1, other joints, motions mixed with load tables; all of
            them listed.
    """
    called = [f"part {i + 1}" for i in range(len(cycles))] if names is None else [str(name) for name in names]
    faults = _faults(cycles, list(shares), called)
    if faults:
        raise InputError(faults)
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
        notes=tuple(_said(name, note) for name, cycle in zip(called, cycles, strict=True) for note in cycle.notes),
        parts=tuple(slice(first, stop) for first, stop in itertools.pairwise(stops)),
        shares=tuple(float(share) / total for share in shares),
        part_names=tuple(called),
    )


def share_faults(shares: Sequence[float]) -> list[Fault]:
    """What is wrong with shares of use."""
    faults = [
        Fault(f"shares[{i}]", "must lie between 0 and 1 (0 % and 100 %)", share)
        for i, share in enumerate(shares)
        if not 0.0 <= share <= 1.0
    ]
    if not faults and shares and abs(math.fsum(shares) - 1.0) > WHOLE:
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


def _said(name: str, note: str) -> str:
    """A note of a part, with its name; a warning still begins as one."""
    warning = "warning: "
    return f"{warning}{name}: {note.removeprefix(warning)}" if note.startswith(warning) else f"{name}: {note}"


def _renumbered(cycle: Cycle, names: tuple[str, ...]) -> Indices:
    """What the tip carries, by its place in the payloads of all parts; -1 stays."""
    places = np.array([*(names.index(name) for name in cycle.payload_names), -1], dtype=np.int64)
    return np.asarray(places[cycle.payload])
