"""Work and precision of every solver on the user's own scene, against a reference that is shown to have settled."""

from __future__ import annotations

import math
import statistics
import time as clock
from collections.abc import Callable, Sequence

from drivetrain.accuracy.decision import Basis, change, decision, tip_travel
from drivetrain.accuracy.runs import interval_of, ran, work
from drivetrain.errors import InputError
from drivetrain.simulation.adaptive_engine import AdaptiveStep
from drivetrain.simulation.cost_results import Decision, SolverCosts, SolverRun
from drivetrain.simulation.engine import Engine
from drivetrain.simulation.fixed_step import FixedStep
from drivetrain.simulation.plan import Plan, plan
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Scene
from drivetrain.solvers.adaptive import DormandPrince54
from drivetrain.solvers.explicit import RungeKutta4
from drivetrain.solvers.rosenbrock import Rodas5P

FIXED = "fixed implicit step"
ADAPTIVE = "adaptive RODAS5P"
STEPS = (4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4, 1.25e-4)  # s
PRECISIONS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
REFERENCES = (1e-7, 1e-8)
EXPLICIT: tuple[tuple[str, float, Engine], ...] = (
    ("explicit RK4", 1e-4, AdaptiveStep(RungeKutta4(1e-4))),
    ("explicit RK4", 5e-5, AdaptiveStep(RungeKutta4(5e-5))),
    ("explicit DP5(4)", 1e-4, AdaptiveStep(DormandPrince54(1e-4, 1e-6))),
)
"""What others use, at settings at which it may run; where it cannot, the reason is told."""
LONGEST = 20.0  # s of wall time that one run may take
LONG = 1.0  # s of wall time after which a run is not repeated

Told = Callable[[int, int, str], None]


def solver_cost(
    scene: Scene,
    basis: Basis,
    *,
    steps: Sequence[float] = STEPS,
    precisions: Sequence[float] = PRECISIONS,
    references: tuple[float, float] = REFERENCES,
    explicit: Sequence[tuple[str, float, Engine]] = EXPLICIT,
    rounds: int = 3,
    progress: Told | None = None,
) -> SolverCosts:
    """Error in the decision quantities against wall time and against evaluations.

    Args:
        steps: Of the fixed engine [s].
        precisions: Relative tolerances of the adaptive engine [-].
        progress: Told (done, of how many, what).

    Raises:
        InputError: The reference does not reach the end.
    """
    ready = plan(scene)
    listed = [
        *((FIXED, step, FixedStep(step)) for step in steps),
        *((ADAPTIVE, rtol, AdaptiveStep(Rodas5P(rtol=rtol))) for rtol in precisions),
        *explicit,
    ]
    total = len(listed) + 2
    tell = progress if progress is not None else _silent
    try:
        engines: list[Engine] = [AdaptiveStep(Rodas5P(rtol=rtol)) for rtol in references]
        name = f"{ADAPTIVE} at a relative tolerance of 1e−{-math.log10(references[1]):.3g}"
        best = _references(ready, scene, basis, engines, tell, total)
    except InputError as error:
        finest = min(steps)
        engines = [FixedStep(finest / 4.0), FixedStep(finest / 8.0)]
        name = f"{FIXED} at {1e3 * finest / 8.0:.3g} ms, as the adaptive one stops: {error.faults[0].problem}"
        best = _references(ready, scene, basis, engines, tell, total)
    settled, _ = distance(best[0][0], *best[1])
    runs = []
    for done, (family, setting, engine) in enumerate(listed):
        tell(done + 2, total, f"{family} at {setting:g}")
        runs.append(_run(ready, scene, basis, (family, setting, engine), best[1], rounds))
    return SolverCosts(tuple(runs), name, settled)


def _silent(_done: int, _total: int, _text: str) -> None:
    pass


def _references(
    ready: Plan, scene: Scene, basis: Basis, engines: Sequence[Engine], tell: Told, total: int
) -> list[tuple[Decision, float]]:
    """What each decides, and how far the tip is commanded to go."""
    found = []
    for done, engine in enumerate(engines):
        tell(done, total, "reference")
        recording = ran(ready, engine)
        found.append((decision(recording, scene, basis), tip_travel(scene, recording)))
    return found


def _run(
    ready: Plan,
    scene: Scene,
    basis: Basis,
    listed: tuple[str, float, Engine],
    best: tuple[Decision, float],
    rounds: int,
) -> SolverRun:
    """One engine, its error and its median time."""
    family, setting, engine = listed
    begun = clock.perf_counter()

    def patient(_share: float) -> bool:
        return clock.perf_counter() - begun < LONGEST

    try:
        recording = simulate(ready, solver=engine, interval=interval_of(scene.duration), progress=patient)
    except InputError as error:
        return SolverRun(family, setting, math.nan, math.nan, 0, error.faults[0].problem)
    if recording.stopped_by is not None:
        told = recording.stopped_by
        why = f"not done in {LONGEST:g} s" if told.name == "stopped" else f"{told.name} at {told.time:.4g} s"
        return SolverRun(family, setting, math.nan, math.nan, work(recording.counters), why)
    taken: list[float] = []
    while len(taken) < rounds and sum(taken) < LONG:
        begin = clock.perf_counter()
        simulate(ready, solver=engine, interval=scene.duration)
        taken.append(clock.perf_counter() - begin)
    apart, where = distance(decision(recording, scene, basis), *best)
    return SolverRun(family, setting, apart, statistics.median(taken), work(recording.counters), where=where)


def distance(one: Decision, best: Decision, travel: float) -> tuple[float, str]:
    """The largest share by which two decisions differ in any quantity of any joint, and in which.

    Args:
        travel: How far the tip is commanded to go [m], beside which its deviation counts.

    Returns:
        Share [-], and the quantity in words.
    """
    apart = {joint: told.largest(travel) for joint, told in change(one, best).items()}
    joint = max(apart, key=lambda name: apart[name])
    return apart[joint], f"{change(one, best)[joint].leading(travel)} of {joint}"
