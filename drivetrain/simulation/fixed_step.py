"""E1: a fixed implicit step with set-valued friction; it needs no tolerance, and sticking is exact."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError
from drivetrain.simulation import fields as f
from drivetrain.simulation import step_kernel as kernel
from drivetrain.simulation.beginning import started
from drivetrain.simulation.engine import Engine, Outcome, Wish
from drivetrain.simulation.memory import Words
from drivetrain.simulation.plan import Plan
from drivetrain.simulation.recording import Event
from drivetrain.solvers.solver import check_positive

NUMBERS = 2**22  # of the rows of a chunk, at most
EVENTS = 4096  # a chunk; more are counted, not told
Run = tuple[Array, Words, Array, Words, Array]  # numbers, words, clock, counts, breakpoints
MOST_STEPS = 1e11
CHUNK = 20000  # steps between two looks at the progress


@dataclass(frozen=True)
class FixedStep(Engine):
    """The default engine.

    Attributes:
        step: [s]; shortened where a breakpoint or a sample comes first.
    """

    step: float = 1e-3

    def __post_init__(self) -> None:
        check_positive("FixedStep.step", self.step, "s")

    def run(self, plan: Plan, wish: Wish) -> Outcome:
        """Run a plan with fixed steps.

        Raises:
            InputError: What is to be resumed belongs to another scene; more steps than anyone could wait for.
        """
        if plan.scene.duration > MOST_STEPS * self.step:
            problem = f"makes more than {MOST_STEPS:g} steps in {plan.scene.duration:g} s"
            raise InputError(Fault("FixedStep.step", problem, self.step))
        numbers, words = plan.memory.numbers.copy(), plan.memory.words.copy()
        clock, counts = np.zeros(kernel.CLOCK), np.zeros(kernel.COUNTS, dtype=np.int64)
        if wish.resume is None:
            numbers = started(plan, numbers, words)
        else:
            _restore(wish.resume, plan, numbers, words, clock, counts)
            # The instant at which the two runs join stands in the first already.
            told = math.floor(clock[kernel.TIME] / wish.interval + 1e-6)
            clock[kernel.NEXT_ROW] = min(wish.interval * (told + 1.0), plan.scene.duration)
            if clock[kernel.STEP] != self.step:
                clock[kernel.ANCHOR], counts[kernel.IN_SEGMENT] = clock[kernel.TIME], 0
        clock[kernel.END], clock[kernel.STEP], clock[kernel.INTERVAL] = plan.scene.duration, self.step, wish.interval
        breaks = np.append(plan.breakpoints, np.inf)
        counts[kernel.NEXT_BREAK] = np.searchsorted(breaks, clock[kernel.TIME] + kernel.SLACK * self.step, side="right")
        return _looped(plan, wish, (numbers, words, clock, counts, breaks))


def _looped(plan: Plan, wish: Wish, run: Run) -> Outcome:
    """Call the kernel until it is done."""
    _, _, clock, counts, _ = run
    advance, parts, filled = kernel.compiled(), [], 0
    rows, events, logged = _room(plan, wish, clock), np.empty((EVENTS, 4)), []
    scratch = np.empty(3 * plan.body.c, dtype=np.int64)
    while True:
        counts[kernel.ROWS] = counts[kernel.EVENTS] = 0
        counts[kernel.BUDGET] = CHUNK
        code = advance(*run, rows[filled:], events, scratch)
        filled += counts[kernel.ROWS]
        if code == kernel.FULL:
            parts.append(rows)
            rows, filled = _room(plan, wish, clock), 0
        logged += [row.copy() for row in events[: min(counts[kernel.EVENTS], EVENTS)]]
        stopped = _stopped(code, plan, clock, counts)
        if code == kernel.DONE or stopped is not None:
            break
        if wish.progress is not None and wish.progress(float(clock[kernel.TIME] / clock[kernel.END])) is False:
            stopped = Event(float(clock[kernel.TIME]), "stopped", "by the progress callback; it can be resumed")
            break
    counters = {"steps": counts[kernel.STEPS], "solves": counts[kernel.SOLVES], "instants": counts[kernel.INSTANTS]}
    if run[1][f.REPEATS]:
        counters["unsettled"] = run[1][f.UNSETTLED]
    rows = rows[:filled]
    return Outcome(
        np.concatenate([*parts, rows]) if parts else rows,
        {name: int(count) for name, count in counters.items()},
        tuple(_told(row, plan) for row in logged),
        stopped,
        _kept(plan, run),
    )


def _room(plan: Plan, wish: Wish, clock: Array) -> Array:
    """Rows for the rest of a run, as far as one block may go."""
    left = (clock[kernel.END] - clock[kernel.TIME]) / wish.interval
    width = 1 + len(plan.layout.columns)
    return np.empty((int(min(left + 3.0, max(NUMBERS // width, 64))), width))


def _stopped(code: int, plan: Plan, clock: Array, counts: Words) -> Event | None:
    """What ended the run, if anything did."""
    t, culprit = float(clock[kernel.TIME]), int(counts[kernel.CULPRIT])
    if code == kernel.DIVERGED:
        name = list(plan.memory.states)[culprit]
        return Event(t, "diverged", f"{name} is no number any more or grows beyond all bounds; try a shorter step")
    if code == kernel.JAMMED:
        return Event(t, "jammed", f"{_coordinate(plan, culprit)}: its mesh friction has no solution in this posture")
    if code == kernel.ENDLESS:
        return Event(t, "endless", "no set of sticking and sliding joints fits; try a shorter step")
    return None


def _coordinate(plan: Plan, index: int) -> str:
    """The name of a coordinate."""
    joints = plan.scene.joints
    if index < len(joints):
        return joints[index]
    return next(f"motor of {joints[i]}" for i in plan.body.springs if plan.body.motors[i] == index)


def _told(row: Array, plan: Plan) -> Event:
    """A change of friction's mode, in words."""
    words = {0: "stuck", 1: "slides forward", -1: "slides backward"}
    before, after = int(row[2]), int(row[3])
    name = "stick" if after == 0 else "breakaway" if before == 0 else "reversal"
    return Event(float(row[0]), name, f"{_coordinate(plan, int(row[1]))}: {words[before]}, then {words[after]}")


def _kept(plan: Plan, run: Run) -> dict[str, Any]:
    """All that a run needs to go on."""
    numbers, words, clock, counts, _ = run
    modes, samples = words[f.AT_MODES], words[f.AT_SAMPLES]
    return {
        "numbers": numbers[: plan.memory.kept].copy(),
        "modes": words[modes : modes + 3 * words[f.COORDINATES]].copy(),
        "samples": words[samples : samples + 4 * words[f.SAMPLES]][3::4].copy(),
        "clock": clock.copy(),
        "counts": counts.copy(),
    }


def _restore(kept: dict[str, Any], plan: Plan, numbers: Array, words: Words, clock: Array, counts: Words) -> None:
    """Put back what a run has kept."""
    c, modes, samples = words[f.COORDINATES], words[f.AT_MODES], words[f.AT_SAMPLES]
    fits = {"numbers": plan.memory.kept, "modes": 3 * c, "samples": words[f.SAMPLES], "clock": 6, "counts": 10}
    if any(name not in kept or len(kept[name]) != size for name, size in fits.items()):
        raise InputError(Fault("resume", "belongs to another scene", hint="resume with the same effects and joints"))
    numbers[: plan.memory.kept] = kept["numbers"]
    words[modes : modes + 3 * c] = kept["modes"]
    words[samples : samples + 4 * words[f.SAMPLES]][3::4] = kept["samples"]
    clock[:], counts[:] = kept["clock"], kept["counts"]
