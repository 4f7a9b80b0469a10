"""E1: implicit integration with a fixed time step. All joints are solved in one system, and stuck joints stay exactly.

The compiled loop runs from grid point to grid point of the time grid and fills one output row per output time. No step
crosses a breakpoint or a sampling time: it is shortened to end there, and the time grid counts from there on. The grid
does not depend on where a run is interrupted, so a resumed run gives the same result.
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
    LOOPS_CANNOT_CLOSE,
    fill_row,
    outputs_at,
    pass_payloads,
    solve_at,
    take_samples,
)
from drivetrain.simulation.core.friction import NO_MODES_FOUND, restore_modes, save_modes
from drivetrain.simulation.core.records import (
    AMBIGUOUS_MODE,
    AT,
    MODE_CHANGE,
    PARTS,
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
from drivetrain.simulation.engines.starting import initial_memory
from drivetrain.simulation.planning.plan import Plan
from drivetrain.simulation.recording import Event
from drivetrain.solvers.solver import check_positive

# Return codes of the kernel: finished, output rows full, budget of steps used up, a state diverges, the equations of
# motion have no solution.
DONE, ROWS_FULL, PAUSED, DIVERGED, UNSOLVED = range(5)
TIME_TOLERANCE = 1e-9  # share of a step up to which two times count as equal
LARGEST_STATE = 1e60  # a larger state counts as diverged
MOST_SOLUTIONS = 30  # solutions of a step, at most, while effects correct a value that they provide
SMALLEST_SUBSTEP = 1.0 / 4096.0  # shortest substep as a share of the grid's step
SUBDIVIDE_BELOW = 0.8  # a step is repeated with substeps if an effect limits its length to less than this share


@dataclass
class Clock:
    """Times and counters of a run: all that it must keep between two steps, besides its numbers."""

    time: float  # current time [s]
    end: float  # end of the run [s]
    grid_origin: float  # origin of the time grid: the last breakpoint or sampling time on it [s]
    next_row: float  # time of the next output row [s]
    step: float  # step of the time grid [s]
    interval: float  # time between two output rows [s]
    grid_steps: int  # grid steps since the origin
    next_break: int  # index of the next breakpoint
    # counters so far: steps, solutions of the equations, output rows
    steps: int
    solves: int
    instants: int
    damp_next: int  # whether the next step is fully implicit (theta = 1), to damp a stiff spring after a jump
    grid_end: float  # end of the present step of the time grid [s]
    step_limit: float  # longest step that the effects allow; a shorter one than the grid's divides it into substeps [s]
    substeps: int  # number of steps that were substeps
    # output rows and events in the present call of the kernel
    rows: int
    events: int
    fault_index: int  # index of the state that ended the run, or the negative code of equations without a solution
    budget: int  # steps that may still be taken before the kernel returns


CLOCK = record_type(Clock, np.int64)


@part
def _next_sample(run: Run) -> float:
    """Time of the next sample of any sampled effect [s]; infinite if there is none."""
    samples = calls_of(run, AT.samples)
    first = math.inf
    for k in range(len(samples)):
        first = min(first, samples[k].period * samples[k].taken)
    return first


@part
def _record_row(run: Run, t: float, row: Any) -> None:
    """Fill one output row at a grid point, from the accelerations and forces at this time.

    Evaluating the forces may change the contact modes of dry friction (stick or slip), so these are saved and restored:
    recording a row must not influence the motion.
    """
    save_modes(coordinates_of(run))
    solve_at(run, t)
    outputs_at(run, t)
    restore_modes(coordinates_of(run))
    fill_row(run, t, row)


@part
def _accept_step(run: Run, t: float, h: float, theta: float) -> int:
    """Advance coordinates, states and energies by a solved step of length h [s], from time t [s].

    Returns the index of the last state that is not finite or exceeds ``LARGEST_STATE``, so that the run can report it;
    -1 if there is none.
    """
    coordinates, states, memory = coordinates_of(run), states_of(run), memory_of(run)
    powers, energies = words_of(run, AT.powers), numbers_of(run, AT.energies)
    c, not_finite = len(coordinates), -1
    call_laws(run, AT.accepts, t + theta * h, h)
    for k in range(len(powers)):
        energies[k] += h * memory[powers[k]]
    for i in range(world_of(run).joints):
        link, m = coordinates[i].link, coordinates[i].motor
        if link == i:
            coordinates[i].position += h * coordinates[i].mid_speed
        if m != link:
            coordinates[m].position += h * (coordinates[m].mid_speed - coordinates[link].mid_speed)
    for i in range(c):
        one = coordinates[i]
        if one.dry.mode == 0:
            # A stuck coordinate gets exactly the speed of its contact surface, free of rounding errors.
            one.speed, one.last = one.surface, 0.0
        else:
            one.speed += one.change
            one.last = one.change * (1.0 / h)
        if not abs(one.speed) < LARGEST_STATE:
            not_finite = c + i
    for k in range(2 * c, len(states)):
        state = states[k]
        if state.rate >= 0:
            state.last = memory[state.rate]
            memory[state.value] += h * state.last
        if not abs(memory[state.value]) < LARGEST_STATE:
            not_finite = k
    return not_finite


@part
def _next_grid_end(run: Run, clock: Any, breaks: Any) -> float:
    """End of the next step of the time grid [s]: a grid point, or an earlier breakpoint, sampling time or end."""
    inner = min(breaks[clock.next_break], _next_sample(run))
    t_limit, slack = min(clock.end, inner), TIME_TOLERANCE * clock.step
    t_end = clock.grid_origin + clock.step * (clock.grid_steps + 1)
    if t_end <= t_limit - slack:
        clock.grid_steps += 1
        return t_end
    if inner <= t_limit + slack:
        clock.grid_origin, clock.grid_steps = inner, 0
        return inner
    if t_end <= t_limit + slack:
        clock.grid_steps += 1
        return t_end  # the same rounded time as if the run continued beyond its end
    return t_limit


@part
def _solve(run: Run, t: float, h: float, theta: float) -> int:
    """Solve one step of length h [s] from time t [s], and evaluate its forces and powers.

    The first guess for the speeds in the middle of the step assumes that the accelerations of the last step continue.
    An effect whose provided value does not agree with the solution (a voltage limit, for example) asks for another
    solution with a corrected value, at most ``MOST_SOLUTIONS`` times.

    Returns the number of solutions of the equations, or a negative code if there is none.
    """
    coordinates, world, total = coordinates_of(run), world_of(run), 0
    for iteration in range(MOST_SOLUTIONS):
        world.iteration = iteration
        for i in range(len(coordinates)):
            one = coordinates[i]
            one.dry.mode = one.before
            one.mid_speed = one.speed + theta * h * one.last
        world.repeat_step, world.step_limit = 0, math.inf
        call_equations(run, engine_of(run).motion, t, h)
        if engine_of(run).solved < 0:
            return engine_of(run).solved
        total += engine_of(run).solved
        call_equations(run, engine_of(run).forces, t, h)
        call_laws(run, AT.accounts, t + theta * h, h)
        if world.repeat_step == 0 or world.step_limit < SUBDIVIDE_BELOW * h:
            return total
    engine_of(run).unsettled += 1
    return total


@part
def _substep_length(clock: Any, t: float, step_limit: float) -> float:
    """Length of the next step [s]: the rest of the grid's step, or an equal part of it within ``step_limit``."""
    left = clock.grid_end - t
    # A whole step has always exactly the same length, in spite of rounded times: laws may cache values made for it.
    whole = clock.step if abs(left - clock.step) <= TIME_TOLERANCE * clock.step else left
    if step_limit >= left:
        return whole
    return left / math.ceil(left / max(step_limit, SMALLEST_SUBSTEP * clock.step))


@part
def _pass_breaks(run: Run, clock: Any, breaks: Any, t_end: float, slack: float) -> None:
    """At the end of a step, at ``t_end`` [s]: pass the breakpoints there, and the payloads picked up or set down."""
    if t_end >= breaks[clock.next_break] - slack:
        while breaks[clock.next_break] <= t_end + slack:
            clock.next_break += 1
        pass_payloads(run, t_end)
        # With theta = 1/2 a stiff spring would ring undamped after a jump; one step with theta = 1 damps it.
        clock.damp_next = engine_of(run).stiff


def _advance(
    run: Any, clock_at: Any, breaks_at: Any, rows_at: Any, most_rows: Any, width: Any, log_at: Any, log_size: Any
) -> int:  # fmt: skip
    """Step until the end, until the output rows are full, or until the budget of steps is used up; returns a code
    above.

    All data are pointers, since numba counts references to every array argument. The breakpoints [s] are followed by
    infinity; of mode changes more than ``log_size`` are only counted.
    """
    clock = carray(clock_at, 1, CLOCK)[0]
    c, breaks, rows = world_of(run).coordinates, carray(breaks_at, 2**31), carray(rows_at, (most_rows, width))
    log = carray(log_at, log_size, MODE_CHANGE)
    engine, slack = engine_of(run), TIME_TOLERANCE * clock.step
    while True:
        t = clock.time
        take_samples(run, t, slack, 0.0)
        if t >= clock.grid_end and t >= clock.next_row - slack:
            if clock.rows == most_rows:
                return ROWS_FULL
            _record_row(run, t, rows[clock.rows])
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
        if t >= clock.grid_end:
            clock.grid_end = _next_grid_end(run, clock, breaks)
        h = _substep_length(clock, t, clock.step_limit)
        engine.theta = 1.0 if clock.damp_next else 0.5
        clock.damp_next = 0
        for i in range(c):
            coordinates_of(run)[i].before = coordinates_of(run)[i].dry.mode
        while True:
            solved = _solve(run, t, h, engine.theta)
            if solved < 0:
                clock.fault_index = solved
                return UNSOLVED
            clock.solves += solved
            step_limit = world_of(run).step_limit
            if step_limit >= SUBDIVIDE_BELOW * h or h <= 2.0 * SMALLEST_SUBSTEP * clock.step:
                break
            h = _substep_length(clock, t, step_limit)
        clock.step_limit = min(step_limit, 2.0 * h) if step_limit < clock.step else math.inf
        t_end = clock.grid_end if h > 0.75 * (clock.grid_end - t) else t + h
        clock.steps += 1
        clock.substeps += t_end < clock.grid_end
        call_equations(run, engine.uniqueness_law, t, h)
        not_finite = _accept_step(run, t, h, engine.theta)
        clock.time = t_end
        clock.events = log_changes(run, t_end, log, clock.events)
        if not_finite >= 0:
            clock.fault_index = not_finite
            return DIVERGED
        _pass_breaks(run, clock, breaks, t_end, slack)


_NUMBERS, _MEMORY, _WHOLE = types.CPointer(types.float64), types.voidptr, types.int64


@lru_cache(maxsize=1)
def advance() -> Any:
    """The time loop as a C function, compiled at the first call or taken from the disk cache."""
    kinds = (PARTS, _MEMORY, _NUMBERS, _NUMBERS, _WHOLE, _WHOLE, _MEMORY, _WHOLE)
    return callback(_WHOLE(*kinds), _advance).ctypes


DOUBLES, ADDRESSES = ctypes.POINTER(ctypes.c_double), ctypes.POINTER(ctypes.c_void_p)
LARGEST_BLOCK = 2**22  # values in a block of output rows, at most
MOST_EVENTS = 4096  # mode changes stored per call of the kernel; more are counted, not stored
MOST_STEPS = 1e11  # in a run
CHUNK = 20000  # steps between two calls of the progress callback


@dataclass(frozen=True)
class FixedStep(Engine):
    """The default engine: implicit integration with a fixed time step, dry friction as a complementarity problem.

    Attributes:
        step: Time step [s]; shortened where a breakpoint or a sampling time comes first.
    """

    step: float = 1e-3

    def __post_init__(self) -> None:
        check_positive("FixedStep.step", self.step, "s")

    def __str__(self) -> str:
        return f"FixedStep({self.step:g} s)"

    def finer(self, period: float = math.inf) -> FixedStep:
        return FixedStep(0.5 * min(self.step, period))

    def run(self, plan: Plan, options: RunOptions) -> Outcome:
        """Compute the motion of a plan with fixed steps."""
        if plan.scene.duration > MOST_STEPS * self.step:
            problem = f"makes more than {MOST_STEPS:g} steps in {plan.scene.duration:g} s"
            raise InputError(Fault("FixedStep.step", problem, self.step))
        clocks = np.zeros(1, CLOCK)
        clock: Any = clocks[0]
        if options.resume is None:
            numbers, clock["step_limit"] = initial_memory(plan, options.start), np.inf
        else:
            numbers = resumed(options.resume, plan, {"clock": clocks.itemsize // 8})
            clocks[:] = np.asarray(options.resume["clock"]).view(CLOCK)
            # The time at which the two runs join is already an output row of the first.
            recorded = math.floor(clock["time"] / options.interval + 1e-6)
            clock["next_row"] = min(options.interval * (recorded + 1.0), plan.scene.duration)
            if clock["step"] != self.step:
                clock["grid_origin"], clock["grid_steps"] = clock["time"], 0
                clock["grid_end"] = clock["time"]
        clock["end"], clock["step"], clock["interval"] = plan.scene.duration, self.step, options.interval
        breaks = np.append(plan.breakpoints, np.inf)
        clock["next_break"] = np.searchsorted(breaks, clock["time"] + TIME_TOLERANCE * self.step, side="right")
        return _run_in_chunks(plan, options, numbers, clocks, breaks)


def _run_in_chunks(plan: Plan, options: RunOptions, numbers: Array, clocks: Any, breaks: Array) -> Outcome:
    """Call the kernel, chunk by chunk with reports of the progress, until the run has ended."""
    clock, parts, done, filled, logged = clocks[0], parts_of(numbers), [], 0, []
    rows, log = _row_block(plan, options, clock), np.zeros(MOST_EVENTS, MODE_CHANGE)
    while True:
        clock["rows"] = clock["events"] = 0
        clock["budget"] = CHUNK
        left = rows[filled:]
        code = advance()(
            parts.ctypes.data_as(ADDRESSES), clocks.ctypes.data, breaks.ctypes.data_as(DOUBLES),
            left.ctypes.data_as(DOUBLES), *left.shape, log.ctypes.data, len(log),
        )  # fmt: skip
        filled += int(clock["rows"])
        if code == ROWS_FULL:
            done.append(rows)
            rows, filled = _row_block(plan, options, clock), 0
        logged += log[: min(clock["events"], MOST_EVENTS)].tolist()
        stopped = _stop_event(code, plan, clock)
        if code == DONE or stopped is not None:
            break
        if options.progress is not None and options.progress(float(clock["time"] / clock["end"])) is False:
            stopped = Event(float(clock["time"]), "stopped", "by the progress callback; it can be resumed")
            break
    counters = {name: int(clock[name]) for name in ("steps", "solves", "instants")}
    if clock["substeps"]:
        counters["substeps"] = int(clock["substeps"])
    unsettled = int(plan.memory.view(numbers, "engine")[0]["unsettled"])
    if unsettled or len(plan.memory.view(numbers, "iterated")):
        counters["unsettled"] = unsettled
    kept = {"numbers": numbers[plan.memory.changing], "clock": clocks.view(np.float64).copy()}
    whole = np.concatenate([*done, rows[:filled]]) if done else rows[:filled]
    return Outcome(whole, counters, tuple(mode_event(plan, *one) for one in logged), stopped, kept)


def _row_block(plan: Plan, options: RunOptions, clock: Any) -> Array:
    """An empty block of output rows for the rest of a run, limited to ``LARGEST_BLOCK`` values."""
    left = (clock["end"] - clock["time"]) / options.interval
    width = 1 + len(plan.layout.columns)
    return np.empty((int(min(left + 3.0, max(LARGEST_BLOCK // width, 64))), width))


def _stop_event(code: int, plan: Plan, clock: Any) -> Event | None:
    """The event for a return code that ends the run early; None for the others."""
    t, fault_index = float(clock["time"]), int(clock["fault_index"])
    if code == DIVERGED:
        name = list(plan.memory.states)[fault_index]
        return Event(t, "diverged", f"{name} is not a number or grows without bound; try a shorter step")
    return unsolved_event(plan, t, fault_index, "; try a shorter step") if code == UNSOLVED else None


def unsolved_event(plan: Plan, time: float, solved: int, advice: str = "") -> Event:
    """The event for equations of motion without a solution; ``solved`` is what ``equations.solve`` has returned."""
    if solved == LOOPS_CANNOT_CLOSE:
        detail = "the closed loops cannot be closed: the linkage does not reach this position, or is at a dead centre"
        return Event(time, "linkage not closed", detail)
    if solved == NO_MODES_FOUND:
        detail = f"no combination of sticking and sliding joints satisfies the equations{advice}"
        return Event(time, "no solution", detail)
    detail = "the equations with its mesh friction have no solution in this position"
    return Event(time, "jammed", f"{plan.coordinates[-1 - solved]}: {detail}")


def mode_event(plan: Plan, time: float, coordinate: int, before: int, after: int) -> Event:
    """The event for a change of contact mode, or for a change that has another equally valid solution."""
    if after == AMBIGUOUS_MODE:
        name = plan.coordinates[coordinate]
        detail = (
            f"{name} starts to slip together with others, but could also have kept sticking while they slip: with "
            "static above Coulomb friction both are solutions; all that reach their bounds at one instant slip here"
        )
        return Event(time, "several solutions", detail)
    words = {0: "stuck", 1: "slides forward", -1: "slides backward"}
    name = "stick" if after == 0 else "breakaway" if before == 0 else "reversal"
    return Event(time, name, f"{plan.coordinates[coordinate]}: {words[before]}, then {words[after]}")


def resumed(kept: dict[str, Any], plan: Plan, sizes: dict[str, int]) -> Array:
    """The memory of a run that is resumed, from what the earlier run kept; InputError if its arrays do not have the
    ``sizes`` that this plan and engine need, by name.
    """
    sizes = {"numbers": int(plan.memory.changing.sum()), **sizes}
    if any(name not in kept or np.size(kept[name]) != size for name, size in sizes.items()):
        hint = "resume with the same effects, joints and engine"
        raise InputError(Fault("resume", "belongs to another scene", hint=hint))
    numbers = plan.memory.numbers.copy()
    numbers[plan.memory.changing] = kept["numbers"]
    return numbers
