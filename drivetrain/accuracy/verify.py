"""Verification of a run: repeated at half the step or a tenth of the tolerance, decision quantities compared."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from drivetrain.accuracy.decision import Basis, decision, tip_travel
from drivetrain.errors import Fault, InputError
from drivetrain.simulation.cost_results import Decision
from drivetrain.simulation.engines.engine import Engine, Progress
from drivetrain.simulation.planning.plan import plan
from drivetrain.simulation.recording import Event, Recording
from drivetrain.simulation.run import EQUILIBRIUM, simulate
from drivetrain.simulation.scene import Scene

LARGEST_CHANGE = 0.01  # relative change up to which a quantity counts as converged
SMALLEST_SIZE = 1e-6  # quantities below this are not compared [A, N m, K, rad, m]
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

    ``interval`` is the time between two output rows of the finer run [s]. A recording that stopped early is returned
    unchanged.
    """
    if recording.stopped_by is not None:
        return recording
    ready = plan(scene)
    finer = simulate(
        ready, solver=engine.finer(ready.period), interval=interval, progress=progress, start=start, checked=False
    )
    if finer.stopped_by is not None:
        detail = f"a run with {finer.about['solver']} stops at {finer.stopped_by.time:.6g} s: {finer.stopped_by.detail}"
        return replace(recording, events=(*recording.events, Event(float(recording.time[-1]), "verify", detail)))
    both = [_quantities(decision(one, scene, basis)) for one in (recording, finer)]
    values = {name: (value, both[1][name]) for name, value in both[0].items()}
    return replace(recording, verified=values, events=(*recording.events, *_changed(recording, finer, scene, values)))


def _quantities(found: Decision) -> dict[str, float]:
    """The known decision quantities by name, such as ``elbow.peak_current`` [units of ``UNITS``]."""
    values = {f"{joint}.{name}": getattr(one, name) for joint, one in found.joints.items() for name in UNITS}
    values["tip_deviation"] = found.tip_deviation
    return {name: float(value) for name, value in values.items() if math.isfinite(value)}


def _changed(
    recording: Recording, finer: Recording, scene: Scene, values: Mapping[str, tuple[float, float]]
) -> tuple[Event, ...]:
    """An event for a run that is not converged: the largest relative change exceeds ``LARGEST_CHANGE``; else empty.

    Changes of deviations are relative to the travel, all others to the quantity itself.
    """
    travels = {f"{joint}.deviation": float(np.ptp(recording[f"{joint}.position"])) for joint in scene.joints}
    travels["tip_deviation"] = tip_travel(scene, recording)
    sizes = {name: max(travels.get(name, 0.0), abs(b)) for name, (_, b) in values.items()}
    shares = {name: abs(a - b) / sizes[name] for name, (a, b) in values.items() if sizes[name] > SMALLEST_SIZE}
    worst = max(shares, key=lambda name: shares[name], default=None)
    if worst is None or shares[worst] <= LARGEST_CHANGE:
        return ()
    detail = f"{worst} changes by {100.0 * shares[worst]:.2g} % with {finer.about['solver']}: not converged"
    return (Event(float(recording.time[-1]), "verify", detail),)


def refuse_resumed(verify: bool, resume: Recording | None) -> None:
    """Raise InputError for a verification of a resumed run: the finer run must begin at the start."""
    if verify and resume is not None:
        raise InputError(Fault("verify", "needs a run from its start: the finer one cannot go on from another's end"))
