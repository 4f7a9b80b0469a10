"""E1: the fixed implicit step. Every joint in one system, sticking is exact."""

from __future__ import annotations

import ctypes
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError
from drivetrain.simulation import step_kernel as kernel
from drivetrain.simulation.beginning import started
from drivetrain.simulation.engine import Engine, Outcome, Wish
from drivetrain.simulation.plan import Plan
from drivetrain.simulation.recording import Event
from drivetrain.simulation.records import MODE_CHANGE, parts_of
from drivetrain.solvers.solver import check_positive

DOUBLES, WORDS, ADDRESSES = (ctypes.POINTER(one) for one in (ctypes.c_double, ctypes.c_int64, ctypes.c_void_p))
NUMBERS = 2**22  # of the rows of a chunk, at most
EVENTS = 4096  # a chunk; more are counted, not told
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
        clocks = np.zeros(1, kernel.CLOCK)
        clock: Any = clocks[0]
        if wish.resume is None:
            numbers = started(plan)
        else:
            numbers = resumed(wish.resume, plan, {"clock": clocks.itemsize // 8})
            clocks[:] = np.asarray(wish.resume["clock"]).view(kernel.CLOCK)
            # The instant at which the two runs join stands in the first already.
            told = math.floor(clock["time"] / wish.interval + 1e-6)
            clock["next_row"] = min(wish.interval * (told + 1.0), plan.scene.duration)
            if clock["step"] != self.step:
                clock["anchor"], clock["in_segment"] = clock["time"], 0
        clock["end"], clock["step"], clock["interval"] = plan.scene.duration, self.step, wish.interval
        breaks = np.append(plan.breakpoints, np.inf)
        clock["next_break"] = np.searchsorted(breaks, clock["time"] + kernel.SLACK * self.step, side="right")
        return _looped(plan, wish, numbers, clocks, breaks)


def _looped(plan: Plan, wish: Wish, numbers: Array, clocks: Any, breaks: Array) -> Outcome:
    """Call the kernel until it is done."""
    clock, parts, done, filled, logged = clocks[0], parts_of(numbers), [], 0, []
    rows, log = _room(plan, wish, clock), np.zeros(EVENTS, MODE_CHANGE)
    before, modes = np.zeros(plan.body.c, dtype=np.int64), np.zeros((plan.body.c, 3), dtype=np.int64)
    while True:
        clock["rows"] = clock["events"] = 0
        clock["budget"] = CHUNK
        left = rows[filled:]
        code = kernel.advance()(
            parts.ctypes.data_as(ADDRESSES), clocks.ctypes.data, breaks.ctypes.data_as(DOUBLES),
            left.ctypes.data_as(DOUBLES), *left.shape, log.ctypes.data, len(log), before.ctypes.data_as(WORDS),
            modes.ctypes.data_as(WORDS),
        )  # fmt: skip
        filled += int(clock["rows"])
        if code == kernel.FULL:
            done.append(rows)
            rows, filled = _room(plan, wish, clock), 0
        logged += log[: min(clock["events"], EVENTS)].tolist()
        stopped = _stopped(code, plan, clock)
        if code == kernel.DONE or stopped is not None:
            break
        if wish.progress is not None and wish.progress(float(clock["time"] / clock["end"])) is False:
            stopped = Event(float(clock["time"]), "stopped", "by the progress callback; it can be resumed")
            break
    counters = {name: int(clock[name]) for name in ("steps", "solves", "instants")}
    if len(plan.memory.view(numbers, "repeats")):
        counters["unsettled"] = int(plan.memory.view(numbers, "engine")[0]["unsettled"])
    kept = {"numbers": numbers[plan.memory.changing], "clock": clocks.view(np.float64).copy()}
    whole = np.concatenate([*done, rows[:filled]]) if done else rows[:filled]
    return Outcome(whole, counters, tuple(mode_event(plan, *one) for one in logged), stopped, kept)


def _room(plan: Plan, wish: Wish, clock: Any) -> Array:
    """Rows for the rest of a run, as far as one block may go."""
    left = (clock["end"] - clock["time"]) / wish.interval
    width = 1 + len(plan.layout.columns)
    return np.empty((int(min(left + 3.0, max(NUMBERS // width, 64))), width))


def _stopped(code: int, plan: Plan, clock: Any) -> Event | None:
    """What ended the run, if anything did."""
    t, culprit = float(clock["time"]), int(clock["culprit"])
    if code == kernel.DIVERGED:
        name = list(plan.memory.states)[culprit]
        return Event(t, "diverged", f"{name} is no number any more or grows beyond all bounds; try a shorter step")
    if code == kernel.JAMMED:
        return Event(t, "jammed", f"{plan.coordinates[culprit]}: its mesh friction has no solution in this posture")
    if code == kernel.ENDLESS:
        return Event(t, "endless", "no set of sticking and sliding joints fits; try a shorter step")
    return None


def mode_event(plan: Plan, time: float, coordinate: int, before: int, after: int) -> Event:
    """A change of friction's mode, in words."""
    words = {0: "stuck", 1: "slides forward", -1: "slides backward"}
    name = "stick" if after == 0 else "breakaway" if before == 0 else "reversal"
    return Event(time, name, f"{plan.coordinates[coordinate]}: {words[before]}, then {words[after]}")


def resumed(kept: dict[str, Any], plan: Plan, sizes: dict[str, int]) -> Array:
    """The numbers of a run that goes on.

    Args:
        sizes: Of what else the engine keeps, by name.

    Raises:
        InputError: What was kept belongs to another scene or engine.
    """
    sizes = {"numbers": int(plan.memory.changing.sum()), **sizes}
    if any(name not in kept or np.size(kept[name]) != size for name, size in sizes.items()):
        hint = "resume with the same effects, joints and engine"
        raise InputError(Fault("resume", "belongs to another scene", hint=hint))
    numbers = plan.memory.numbers.copy()
    numbers[plan.memory.changing] = kept["numbers"]
    return numbers
