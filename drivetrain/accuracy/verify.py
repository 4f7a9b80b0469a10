"""Verification of a run: repeated at half the step or a tenth of the tolerance, decision quantities compared."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from drivetrain.accuracy.costs import judged_interval
from drivetrain.accuracy.decision import Basis, decision, tip_travel
from drivetrain.errors import Fault, InputError
from drivetrain.simulation.cost_results import Decision
from drivetrain.simulation.engines.engine import Engine, Progress
from drivetrain.simulation.planning.plan import plan
from drivetrain.simulation.recording import Event, Recording
from drivetrain.simulation.run import EQUILIBRIUM, largest_change, simulate
from drivetrain.simulation.scene import Scene

LARGEST_CHANGE = 0.01  # relative change up to which a quantity counts as converged
SMALLEST_SIZE = 1e-6  # quantities below this are not compared [A, N m, K, rad, m]
REPEATED_SHARE = 1.0 / 3.0  # of a run with more rows: the finer one takes twice as many steps
UNITS = {"peak_current": "A", "rms_current": "A", "rms_torque": "N m", "rise": "K", "deviation": "rad"}


def verified(
    recording: Recording,
    scene: Scene,
    engine: Engine,
    basis: Basis,
    *,
    interval: float,
    progress: Progress | None = None,
    start: str | Mapping[str, float] = EQUILIBRIUM,
) -> Recording:
    """The recording with ``verified``: every decision quantity from this run and from a finer run, by name.

    ``interval`` is the time between two output rows of the recording [s]. If these leave out peaks, the run is repeated
    with more rows. A recording that stopped early is returned unchanged.
    """
    if recording.stopped_by is not None:
        return recording
    ready, runs = plan(scene), [recording]
    engines = [(engine.finer(ready.period), scaled(progress, REPEATED_SHARE, 1.0 - REPEATED_SHARE))]
    if interval > judged_interval(engine, scene.duration):
        engines, runs = [(engine, scaled(progress, 0.0, REPEATED_SHARE)), *engines], []
    for one, report in engines:
        rows = min(interval, judged_interval(one, scene.duration))
        run = simulate(ready, solver=one, interval=rows, progress=report, start=start, checked=False)
        if run.stopped_by is not None:
            detail = f"a run with {run.about['solver']} stops at {run.stopped_by.time:.6g} s: {run.stopped_by.detail}"
            return replace(recording, events=(*recording.events, Event(float(recording.time[-1]), "verify", detail)))
        runs.append(run)
    first, finer = runs
    here, there = _quantities(decision(first, scene, basis)), _quantities(decision(finer, scene, basis))
    values = {name: (here.get(name, math.nan), there.get(name, math.nan)) for name in here | there}
    return replace(recording, verified=values, events=(*recording.events, *_changed(first, finer, scene, values)))


def scaled(progress: Progress | None, done: float, share: float) -> Progress | None:
    """Progress of a run that is a ``share`` of the whole work, of which a part is ``done`` before."""
    return None if progress is None else lambda part: progress(done + share * part)


def _quantities(found: Decision) -> dict[str, float]:
    """The known decision quantities by name, such as ``elbow.peak_current`` [units of ``UNITS``]."""
    values = {f"{joint}.{name}": getattr(one, name) for joint, one in found.joints.items() for name in UNITS}
    values["tip_deviation"] = found.tip_deviation
    return {name: float(value) for name, value in values.items() if not math.isnan(value)}


def _changed(
    recording: Recording, finer: Recording, scene: Scene, values: Mapping[str, tuple[float, float]]
) -> tuple[Event, ...]:
    """An event for a run that is not converged: the largest relative change exceeds ``LARGEST_CHANGE``; else empty.

    Changes of deviations are relative to the travel, all others to the quantity itself. Beside the decision quantities,
    the motion is compared, which no deviation contains if nothing commands it.
    """
    travels = {f"{joint}.deviation": float(np.ptp(recording[f"{joint}.position"])) for joint in scene.joints}
    travels["tip_deviation"] = tip_travel(scene, recording)
    sizes = {name: max(travels.get(name, 0.0), abs(b)) for name, (_, b) in values.items()}
    shares = {
        name: abs(a - b) / sizes[name] if math.isfinite(a - b) else math.inf  # infinite or unknown in one run only
        for name, (a, b) in values.items()
        if a != b and (sizes[name] > SMALLEST_SIZE or math.isnan(b))
    }
    worst = max(shares, key=lambda name: shares[name], default="")
    if worst and shares[worst] > LARGEST_CHANGE:
        changed = f"{worst} by {100.0 * shares[worst]:.2g} %"
    else:
        changed = largest_change(scene.joints, recording, finer)
    detail = f"{finer.about['solver']} changes {changed}: not converged"
    return (Event(float(recording.time[-1]), "verify", detail),) if changed else ()


def refuse_resumed(verify: bool, resume: Recording | None) -> None:
    """Raise InputError for a verification of a resumed run: the finer run must begin at the start."""
    if verify and resume is not None:
        raise InputError(Fault("verify", "needs a run from its start: the finer one cannot go on from another's end"))
