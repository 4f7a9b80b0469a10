"""E1: the fixed implicit step. Every joint in one system, sticking is exact.

Compiled from node to node, over breakpoints and samples, with a row a wanted instant. A step never crosses a breakpoint
or a sample: it is shortened to end there. The grid counts from the last of them, so that to stop and to go on changes
nothing.
"""

from __future__ import annotations

import ctypes
import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numba import carray, types

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError
from drivetrain.jit import callback
from drivetrain.records import record_type
from drivetrain.simulation.core.equations import (
    OPEN,
    OPEN_WORDS,
    account_at,
    pass_payloads,
    put_row,
    solve_at,
    take_samples,
)
from drivetrain.simulation.core.friction import keep_modes, put_back_modes
from drivetrain.simulation.core.records import (
    AT,
    MODE_CHANGE,
    PARTS,
    UNDECIDED,
    Run,
    call_equations,
    call_laws,
    calls_of,
    coordinates_of,
    engine_of,
    log_changes,
    memory_of,
    numbers_of,
    part,
    parts_of,
    states_of,
    words_of,
    world_of,
)
from drivetrain.simulation.engines.engine import Engine, Outcome, RunOptions
from drivetrain.simulation.engines.starting import started
from drivetrain.simulation.planning.plan import Plan
from drivetrain.simulation.recording import Event
from drivetrain.solvers.solver import check_positive

DONE, FULL, PAUSED, DIVERGED, JAMMED, ENDLESS, APART = range(7)  # why the kernel came back
SLACK = 1e-9  # of a step: what rounding may leave
BEYOND = 1e60
MOST_TRIES = 30  # of a step, for effects that must provide another value
SHORTEST = 1.0 / 4096.0  # of a step, for effects that cannot follow a longer one
MUCH_SHORTER = 0.8  # of a step: it is parted


@dataclass
class Clock:
    """All that a run must keep besides its numbers."""

    # now, and of the run [s]
    time: float
    end: float
    anchor: float  # where the grid counts from [s]
    next_row: float  # instant of the next row [s]
    # of the grid, and between rows [s]
    step: float
    interval: float
    in_segment: int  # steps since the anchor
    next_break: int  # index of the next breakpoint
    # counted so far
    steps: int
    solves: int
    instants: int
    soft: int  # whether the next step is to calm a stiff spring
    node: float  # where the grid's present step ends [s]
    wanted: float  # longest step that effects stand, which parts it [s]
    parted: int  # steps that were shorter than the grid's
    # filled so far
    rows: int
    events: int
    culprit: int  # what ended the run: a coordinate or state
    budget: int  # steps left before the kernel comes back


CLOCK = record_type(Clock, np.int64)


@part
def _next_sample(run: Run) -> float:
    """The next instant at which something is sampled."""
    samples = calls_of(run, AT.samples)
    first = math.inf
    for k in range(len(samples)):
        first = min(first, samples[k].period * samples[k].taken)
    return first


@part
def _record(run: Run, t: float, row: Any) -> None:
    """A row at a node; the modes of friction stay as they are."""
    keep_modes(coordinates_of(run))
    solve_at(run, t)
    account_at(run, t)
    put_back_modes(coordinates_of(run))
    put_row(run, t, row)


@part
def _accept(run: Run, t: float, h: float, theta: float) -> int:
    """Move on by a solved step; a coordinate or state that is no number any more, or -1."""
    coordinates, states, memory = coordinates_of(run), states_of(run), memory_of(run)
    powers, energies = words_of(run, AT.powers), numbers_of(run, AT.energies)
    c, bad = len(coordinates), -1
    call_laws(run, AT.accepts, t + theta * h, h)
    for k in range(len(powers)):
        energies[k] += h * memory[powers[k]]
    for i in range(world_of(run).joints):
        coordinates[i].position += h * coordinates[i].guess
        m = coordinates[i].motor
        if m != i:
            coordinates[m].position += h * (coordinates[m].guess - coordinates[i].guess)
    for i in range(c):
        one = coordinates[i]
        if one.dry.mode == 0:
            # Exactly the speed of what it slides on, not what rounding makes of it.
            one.speed, one.last = one.surface, 0.0
        else:
            one.speed += one.change
            one.last = one.change * (1.0 / h)
        if not abs(one.speed) < BEYOND:
            bad = c + i
    for k in range(2 * c, len(states)):
        state = states[k]
        if state.rate >= 0:
            state.last = memory[state.rate]
            memory[state.value] += h * state.last
        if not abs(memory[state.value]) < BEYOND:
            bad = k
    return bad


@part
def _next_node(run: Run, clock: Any, breaks: Any) -> float:
    """Where the step ends: on the grid, or on what comes first."""
    inner = min(breaks[clock.next_break], _next_sample(run))
    mark, slack = min(clock.end, inner), SLACK * clock.step
    to = clock.anchor + clock.step * (clock.in_segment + 1)
    if to <= mark - slack:
        clock.in_segment += 1
        return to
    if inner <= mark + slack:
        clock.anchor, clock.in_segment = inner, 0
        return inner
    if to <= mark + slack:
        clock.in_segment += 1
        return to  # the end, as it would be if the run went on
    return mark


@part
def _solve(run: Run, t: float, h: float, theta: float) -> int:
    """Solve a step, and ask its powers; how many solutions it took, negative where there is none.

    The first guess are the speeds of the middle, if the last accelerations go on. Effects whose provided value
    does not fit the result provide another one, until it does.
    """
    coordinates, world, total = coordinates_of(run), world_of(run), 0
    for tries in range(MOST_TRIES):
        world.tries = tries
        for i in range(len(coordinates)):
            one = coordinates[i]
            one.dry.mode = one.before
            one.guess = one.speed + theta * h * one.last
        world.again, world.longest = 0, math.inf
        call_equations(run, engine_of(run).motion, t, h)
        if engine_of(run).solved < 0:
            return engine_of(run).solved
        total += engine_of(run).solved
        call_equations(run, engine_of(run).forces, t, h)
        call_laws(run, AT.accounts, t + theta * h, h)
        if world.again == 0 or world.longest < MUCH_SHORTER * h:
            return total
    engine_of(run).unsettled += 1
    return total


@part
def _part(clock: Any, t: float, wanted: float) -> float:
    """The step: what is left of the grid's, or an equal part of it that is no longer than wanted."""
    left = clock.node - t
    # A whole step is exactly that, however the clock is rounded: laws may keep what they have made for it.
    whole = clock.step if abs(left - clock.step) <= SLACK * clock.step else left
    if wanted >= left:
        return whole
    return left / math.ceil(left / max(wanted, SHORTEST * clock.step))


@part
def _pass_breaks(run: Run, clock: Any, breaks: Any, to: float, slack: float) -> None:
    """Breakpoints that the step has come to."""
    if to >= breaks[clock.next_break] - slack:
        while breaks[clock.next_break] <= to + slack:
            clock.next_break += 1
        pass_payloads(run, to)
        # Half a step ahead a stiff spring would ring for ever after a jump; a whole one calms it.
        clock.soft = engine_of(run).stiff


def _advance(
    run: Any, clock_at: Any, breaks_at: Any, rows_at: Any, most: Any, width: Any, log_at: Any, room: Any
) -> int:  # fmt: skip
    """Step until the end, until the rows are full, or until the budget of steps is spent; why it came back.

    All by pointers, as numba counts references to whatever comes as an array. ``breaks`` are instants, rising, an
    infinity last [s]; ``modes`` is room for three numbers a coordinate.
    """
    clock = carray(clock_at, 1, CLOCK)[0]
    c, breaks, rows = world_of(run).coordinates, carray(breaks_at, 2**31), carray(rows_at, (most, width))
    log = carray(log_at, room, MODE_CHANGE)
    engine, slack = engine_of(run), SLACK * clock.step
    while True:
        t = clock.time
        take_samples(run, t, slack, 0.0)
        if t >= clock.node and t >= clock.next_row - slack:
            if clock.rows == most:
                return FULL
            _record(run, t, rows[clock.rows])
            if abs(t - clock.end) <= slack:
                rows[clock.rows, 0] = clock.end
            clock.rows += 1
            clock.instants += 1
            clock.next_row = min(clock.interval * (math.floor(t / clock.interval + 1e-6) + 1.0), clock.end)
        if t >= clock.end - slack:
            return DONE
        if clock.budget == 0:
            return PAUSED
        clock.budget -= 1
        if t >= clock.node:
            clock.node = _next_node(run, clock, breaks)
        h = _part(clock, t, clock.wanted)
        engine.theta = 1.0 if clock.soft else 0.5
        clock.soft = 0
        for i in range(c):
            coordinates_of(run)[i].before = coordinates_of(run)[i].dry.mode
        while True:
            solved = _solve(run, t, h, engine.theta)
            if solved < 0:
                clock.culprit = -1 - solved
                return JAMMED if solved > -1000 else ENDLESS if solved > OPEN else APART
            clock.solves += solved
            wanted = world_of(run).longest
            if wanted >= MUCH_SHORTER * h or h <= 2.0 * SHORTEST * clock.step:
                break
            h = _part(clock, t, wanted)
        clock.wanted = min(wanted, 2.0 * h) if wanted < clock.step else math.inf
        to = clock.node if h > 0.75 * (clock.node - t) else t + h
        clock.steps += 1
        clock.parted += to < clock.node
        call_equations(run, engine.outcomes_law, t, h)
        bad = _accept(run, t, h, engine.theta)
        clock.time = to
        clock.events = log_changes(run, to, log, clock.events)
        if bad >= 0:
            clock.culprit = bad
            return DIVERGED
        _pass_breaks(run, clock, breaks, to, slack)


_NUMBERS, _MEMORY, _WHOLE = types.CPointer(types.float64), types.voidptr, types.int64


@lru_cache(maxsize=1)
def advance() -> Any:
    """The loop over nodes, compiled at the first call or taken from the disk cache; called as a function of C."""
    kinds = (PARTS, _MEMORY, _NUMBERS, _NUMBERS, _WHOLE, _WHOLE, _MEMORY, _WHOLE)
    return callback(_WHOLE(*kinds), _advance).ctypes


DOUBLES, ADDRESSES = ctypes.POINTER(ctypes.c_double), ctypes.POINTER(ctypes.c_void_p)
NUMBERS = 2**22  # of the rows of a chunk, at most
EVENTS = 4096  # a chunk; more are counted, not stored
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

    def finer(self, period: float = math.inf) -> FixedStep:
        return FixedStep(0.5 * min(self.step, period))

    def run(self, plan: Plan, options: RunOptions) -> Outcome:
        """Run a plan with fixed steps."""
        if plan.scene.duration > MOST_STEPS * self.step:
            problem = f"makes more than {MOST_STEPS:g} steps in {plan.scene.duration:g} s"
            raise InputError(Fault("FixedStep.step", problem, self.step))
        clocks = np.zeros(1, CLOCK)
        clock: Any = clocks[0]
        if options.resume is None:
            numbers, clock["wanted"] = started(plan, options.start), np.inf
        else:
            numbers = resumed(options.resume, plan, {"clock": clocks.itemsize // 8})
            clocks[:] = np.asarray(options.resume["clock"]).view(CLOCK)
            # The instant at which the two runs join stands in the first already.
            recorded = math.floor(clock["time"] / options.interval + 1e-6)
            clock["next_row"] = min(options.interval * (recorded + 1.0), plan.scene.duration)
            if clock["step"] != self.step:
                clock["anchor"], clock["in_segment"] = clock["time"], 0
                clock["node"] = clock["time"]
        clock["end"], clock["step"], clock["interval"] = plan.scene.duration, self.step, options.interval
        breaks = np.append(plan.breakpoints, np.inf)
        clock["next_break"] = np.searchsorted(breaks, clock["time"] + SLACK * self.step, side="right")
        return _looped(plan, options, numbers, clocks, breaks)


def _looped(plan: Plan, options: RunOptions, numbers: Array, clocks: Any, breaks: Array) -> Outcome:
    """Call the kernel until it is done."""
    clock, parts, done, filled, logged = clocks[0], parts_of(numbers), [], 0, []
    rows, log = _room(plan, options, clock), np.zeros(EVENTS, MODE_CHANGE)
    while True:
        clock["rows"] = clock["events"] = 0
        clock["budget"] = CHUNK
        left = rows[filled:]
        code = advance()(
            parts.ctypes.data_as(ADDRESSES), clocks.ctypes.data, breaks.ctypes.data_as(DOUBLES),
            left.ctypes.data_as(DOUBLES), *left.shape, log.ctypes.data, len(log),
        )  # fmt: skip
        filled += int(clock["rows"])
        if code == FULL:
            done.append(rows)
            rows, filled = _room(plan, options, clock), 0
        logged += log[: min(clock["events"], EVENTS)].tolist()
        stopped = _stopped(code, plan, clock)
        if code == DONE or stopped is not None:
            break
        if options.progress is not None and options.progress(float(clock["time"] / clock["end"])) is False:
            stopped = Event(float(clock["time"]), "stopped", "by the progress callback; it can be resumed")
            break
    counters = {name: int(clock[name]) for name in ("steps", "solves", "instants")}
    if clock["parted"]:
        counters["parted"] = int(clock["parted"])
    unsettled = int(plan.memory.view(numbers, "engine")[0]["unsettled"])
    if unsettled or len(plan.memory.view(numbers, "repeats")):
        counters["unsettled"] = unsettled
    kept = {"numbers": numbers[plan.memory.changing], "clock": clocks.view(np.float64).copy()}
    whole = np.concatenate([*done, rows[:filled]]) if done else rows[:filled]
    return Outcome(whole, counters, tuple(mode_event(plan, *one) for one in logged), stopped, kept)


def _room(plan: Plan, options: RunOptions, clock: Any) -> Array:
    """Rows for the rest of a run, as far as one block may go."""
    left = (clock["end"] - clock["time"]) / options.interval
    width = 1 + len(plan.layout.columns)
    return np.empty((int(min(left + 3.0, max(NUMBERS // width, 64))), width))


def _stopped(code: int, plan: Plan, clock: Any) -> Event | None:
    """What ended the run, if anything did."""
    t, culprit = float(clock["time"]), int(clock["culprit"])
    if code == DIVERGED:
        name = list(plan.memory.states)[culprit]
        return Event(t, "diverged", f"{name} is no number any more or grows beyond all bounds; try a shorter step")
    if code == JAMMED:
        return Event(t, "jammed", f"{plan.coordinates[culprit]}: its mesh friction has no solution in this posture")
    if code == APART:
        return Event(t, "apart", OPEN_WORDS)
    if code == ENDLESS:
        return Event(t, "endless", "no set of sticking and sliding joints fits; try a shorter step")
    return None


def mode_event(plan: Plan, time: float, coordinate: int, before: int, after: int) -> Event:
    """A change of friction's mode, in words; or that another change would have been as right."""
    if after == UNDECIDED:
        name = plan.coordinates[coordinate]
        detail = (
            f"{name} lets go together with others, though it could as well have held while they slide: static friction "
            "above Coulomb friction leaves both open; here all that reach their bounds at one instant let go"
        )
        return Event(time, "several solutions", detail)
    words = {0: "stuck", 1: "slides forward", -1: "slides backward"}
    name = "stick" if after == 0 else "breakaway" if before == 0 else "reversal"
    return Event(time, name, f"{plan.coordinates[coordinate]}: {words[before]}, then {words[after]}")


def resumed(kept: dict[str, Any], plan: Plan, sizes: dict[str, int]) -> Array:
    """The numbers of a run that goes on."""
    sizes = {"numbers": int(plan.memory.changing.sum()), **sizes}
    if any(name not in kept or np.size(kept[name]) != size for name, size in sizes.items()):
        hint = "resume with the same effects, joints and engine"
        raise InputError(Fault("resume", "belongs to another scene", hint=hint))
    numbers = plan.memory.numbers.copy()
    numbers[plan.memory.changing] = kept["numbers"]
    return numbers
