"""Influence and computing time of each effect in the user's own motion; work-precision data of the solvers on it."""

from __future__ import annotations

import math
import statistics
import time as clock
from collections.abc import Callable, Mapping, Sequence

from drivetrain.accuracy.decision import Basis, change, decision, tip_travel
from drivetrain.accuracy.scenes import LABELS, choices, without
from drivetrain.errors import Fault, InputError
from drivetrain.simulation.cost_results import Choice, Decision, EffectCost, EffectCosts, SolverCosts, SolverRun
from drivetrain.simulation.engines.adaptive_step import AdaptiveStep
from drivetrain.simulation.engines.engine import Engine
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.planning.plan import Plan, plan
from drivetrain.simulation.recording import Recording
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Scene
from drivetrain.solvers.solver import DormandPrince54, Rodas5P, RungeKutta4

MOST_ROWS = 20_000  # output rows of a recording
MOST_NODES = 120_000  # output rows with fixed steps, where all steps are recorded: breakaway makes sharp current peaks
USUAL_INTERVAL = 1e-3  # time between two output rows [s]
WORK = ("rates", "solves")  # names of the counters of evaluations, of the adaptive and the fixed-step engine
FIXED = "fixed implicit step"
ADAPTIVE = "adaptive RODAS5P"
STEPS = (4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4, 1.25e-4)  # fixed steps that are compared [s]
PRECISIONS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)  # relative tolerances that are compared [-]
REFERENCES = (1e-7, 1e-8)  # relative tolerances of the two reference runs [-]
EXPLICIT: tuple[tuple[str, float, Engine], ...] = (
    ("explicit RK4", 1e-4, AdaptiveStep(RungeKutta4(1e-4))),
    ("explicit RK4", 5e-5, AdaptiveStep(RungeKutta4(5e-5))),
    ("explicit DP5(4)", 1e-4, AdaptiveStep(DormandPrince54(1e-4, 1e-6))),
)
"""Explicit methods, which other simulators use, for comparison; where one fails, the result says why."""
TIME_LIMIT = 20.0  # wall time after which a run is stopped [s]
REPEAT_LIMIT = 1.0  # processor time above which a run is not repeated [s]

Progress = Callable[[int, int, str], None]


def no_progress(_done: int, _total: int, _text: str) -> None:
    """A progress callback that does nothing."""


def interval_of(duration: float) -> float:
    """Time between two output rows of a run that is judged [s]: 1 ms, longer for a long run, shorter for a short."""
    return max(min(USUAL_INTERVAL, duration / 500.0), duration / MOST_ROWS)


def judged_interval(engine: Engine, duration: float) -> float:
    """Time between two output rows of a run of an engine that is judged [s]; of a fixed step all steps."""
    interval = interval_of(duration)
    return max(min(interval, engine.step), duration / MOST_NODES) if isinstance(engine, FixedStep) else interval


def run_to_end(ready: Plan, engine: Engine) -> Recording:
    """Simulate a plan, recorded finely enough to be judged; InputError if it stops before its end."""
    interval = judged_interval(engine, ready.scene.duration)
    recording = simulate(ready, solver=engine, interval=interval, checked=False)
    if recording.stopped_by is not None:
        event = recording.stopped_by
        raise InputError(Fault(ready.scene.name, f"{event.name} at {event.time:.6g} s: {event.detail}"))
    return recording


def seconds(plans: Sequence[tuple[Plan, Engine]], rounds: int = 3, longest: float = math.inf) -> list[float]:
    """Median processor time of each plan with its engine [s], measured in alternation.

    Processor time, since wall time would include other processes. Further rounds are skipped once all runs together
    have taken ``longest`` [s].
    """
    found: list[list[float]] = [[] for _ in plans]
    for done in range(rounds):
        if done and sum(map(sum, found)) >= longest:
            break
        for own, (ready, engine) in zip(found, plans, strict=True):
            begin = clock.process_time()
            # Only two output rows, so that recording takes no time.
            simulate(ready, solver=engine, interval=ready.scene.duration, checked=False)
            own.append(clock.process_time() - begin)
    return [statistics.median(own) for own in found]


def work(counters: Mapping[str, int]) -> int:
    """Number of evaluations of a run, from its counters."""
    return next((counters[name] for name in WORK if name in counters), 0)


def effects_cost(
    scene: Scene, basis: Basis, *, engine: Engine | None = None, rounds: int = 3, progress: Progress | None = None
) -> EffectCosts:
    """Leave out every kind of effect once, at all joints that have it, and compare results and computing time."""
    engine, report = FixedStep(5e-4) if engine is None else engine, progress or no_progress
    groups: dict[str, list[Choice]] = {}
    for choice in choices(scene):
        groups.setdefault(choice.kind, []).append(choice)
    full = without(scene, ())
    plans = [plan(full), plan(without(scene, choices(scene)))]
    recording = run_to_end(plans[0], engine)
    base, rows = decision(recording, full, basis), []
    for done, (kind, members) in enumerate(groups.items()):
        report(done, len(groups) + 1, f"without {LABELS[kind]}")
        reduced = without(scene, members)
        plans.append(plan(reduced))
        one = run_to_end(plans[-1], engine)
        found, share = decision(one, reduced, basis), work(recording.counters) / max(work(one.counters), 1)
        rows.append((LABELS[kind], tuple(m.joint for m in members), change(found, base), found.verdict, share))
    report(len(groups), len(groups) + 1, "timing")
    whole, bare, *each = seconds([(ready, engine) for ready in plans], rounds)
    costs = [EffectCost(*row[:4], whole / duration, row[4]) for row, duration in zip(rows, each, strict=True)]
    ordered = tuple(sorted(costs, key=lambda row: -row.time))
    return EffectCosts(base, whole, str(engine), recording.counters, ordered, bare / whole)


def solver_cost(
    scene: Scene,
    basis: Basis,
    *,
    steps: Sequence[float] = STEPS,
    precisions: Sequence[float] = PRECISIONS,
    references: tuple[float, float] = REFERENCES,
    explicit: Sequence[tuple[str, float, Engine]] = EXPLICIT,
    rounds: int = 3,
    progress: Progress | None = None,
) -> SolverCosts:
    """Work-precision data: error of the decision quantities, processor time and evaluations of solvers and settings.

    Errors are relative to the adaptive engine at the tighter of two tolerances, or to a very small fixed step if that
    engine stops. ``steps`` in s, ``precisions`` and ``references`` are relative tolerances, ``rounds`` the number of
    timed runs.
    """
    ready = plan(scene)
    listed = [
        *((FIXED, step, FixedStep(step)) for step in steps),
        *((ADAPTIVE, rtol, AdaptiveStep(Rodas5P(rtol=rtol))) for rtol in precisions),
        *explicit,
    ]
    total = len(listed) + 2
    report = progress or no_progress
    try:
        engines: list[Engine] = [AdaptiveStep(Rodas5P(rtol=rtol)) for rtol in references]
        name = f"{ADAPTIVE} at a relative tolerance of 1e−{-math.log10(references[1]):.3g}"
        best = _references(ready, scene, basis, engines, report, total)
    except InputError as error:
        finest = min(steps)
        engines = [FixedStep(finest / 4.0), FixedStep(finest / 8.0)]
        name = f"{FIXED} at {1e3 * finest / 8.0:.3g} ms, as the adaptive one stops: {error.faults[0].problem}"
        best = _references(ready, scene, basis, engines, report, total)
    settled, _ = distance(best[0][0], *best[1])
    runs = []
    for done, (family, setting, engine) in enumerate(listed):
        report(done + 2, total, f"{family} at {setting:g}")
        runs.append(_run(ready, basis, (family, setting, engine), best[1], rounds))
    return SolverCosts(tuple(runs), name, settled)


def _references(
    ready: Plan, scene: Scene, basis: Basis, engines: Sequence[Engine], report: Progress, total: int
) -> list[tuple[Decision, float]]:
    """Decision of each reference engine, and the commanded travel of the tip [m or rad]."""
    found = []
    for done, engine in enumerate(engines):
        report(done, total, "reference")
        recording = run_to_end(ready, engine)
        found.append((decision(recording, scene, basis), tip_travel(scene, recording)))
    return found


def _run(
    ready: Plan, basis: Basis, listed: tuple[str, float, Engine], best: tuple[Decision, float], rounds: int
) -> SolverRun:
    """Run one engine; its error against the reference, its processor time, or why it did not end."""
    family, setting, engine = listed
    started = clock.perf_counter()

    def within_time(_share: float) -> bool:
        return clock.perf_counter() - started < TIME_LIMIT

    try:
        recording = simulate(
            ready, solver=engine, interval=interval_of(ready.scene.duration), progress=within_time, checked=False
        )
    except InputError as error:
        return SolverRun(family, setting, math.nan, math.nan, 0, error.faults[0].problem)
    if recording.stopped_by is not None:
        event = recording.stopped_by
        why = f"not done in {TIME_LIMIT:g} s" if event.name == "stopped" else f"{event.name} at {event.time:.4g} s"
        return SolverRun(family, setting, math.nan, math.nan, work(recording.counters), why)
    (duration,) = seconds([(ready, engine)], rounds, REPEAT_LIMIT)
    largest, where = distance(decision(recording, ready.scene, basis), *best)
    return SolverRun(family, setting, largest, duration, work(recording.counters), where=where)


def distance(one: Decision, best: Decision, travel: float) -> tuple[float, str]:
    """The largest relative difference of two decisions over all quantities and joints [-], and where it is."""
    differences = change(one, best)
    joint = max(differences, key=lambda name: differences[name].largest(travel))
    return differences[joint].largest(travel), f"{differences[joint].leading(travel)} of {joint}"
