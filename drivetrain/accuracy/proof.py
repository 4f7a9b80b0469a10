"""The proof that what was left out does not matter: both scenes run, both again with half the step, energy audited."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from drivetrain.accuracy.decision import Basis, change, decision
from drivetrain.accuracy.runs import ran, seconds
from drivetrain.accuracy.variants import without
from drivetrain.effects.payload_change import PayloadChange
from drivetrain.simulation.cost_results import Change, Decision, Proof
from drivetrain.simulation.fixed_step import FixedStep
from drivetrain.simulation.plan import Plan, plan
from drivetrain.simulation.recording import Recording
from drivetrain.simulation.scene import WHOLE, Scene

NUMERICAL = 0.2  # of the measured change or of the tolerance that the step itself may make
HALVINGS = 3
AUDIT = 1e-3  # of the energy that passes through that may be lost in the step


def proved(
    scene: Scene, kept: Scene, basis: Basis, estimate: Mapping[str, Change], tolerance: float, tip: float, step: float
) -> Proof:
    """The chosen scene beside the full one.

    Args:
        tolerance: Of the decision quantities [-].
        tip: Tolerance of the tip [m].
        step: To start with [s]; halved until the numbers are good enough.

    Raises:
        InputError: A run that does not reach its end.
    """
    full = without(scene, ())
    plans, scenes = (plan(kept), plan(full)), (kept, full)
    coarse, audit = _pair(plans, scenes, basis, step)
    scale = tip / tolerance if tolerance > 0.0 else 0.0
    for _ in range(HALVINGS):
        step *= 0.5
        fine, audit = _pair(plans, scenes, basis, step)
        measured = change(fine[0], fine[1])
        before = change(coarse[0], coarse[1])
        numerical = {name: _apart(measured[name], before[name]) for name in measured}
        largest = max(one.largest(scale) for one in measured.values())
        noise = max(one.largest(scale) for one in numerical.values())
        good = noise <= NUMERICAL * max(largest, tolerance)
        if good:
            break
        coarse = fine
    within = largest + (noise if largest > 0.8 * tolerance else 0.0) <= tolerance
    times = seconds([(ready, FixedStep(step)) for ready in plans])
    return Proof(
        fine[0], fine[1], estimate, measured, numerical, step, audit, times[0], times[1],
        not within, within and good and audit <= AUDIT, _said(within, good, audit, noise),
    )  # fmt: skip


def _pair(
    plans: tuple[Plan, Plan], scenes: tuple[Scene, Scene], basis: Basis, step: float
) -> tuple[tuple[Decision, Decision], float]:
    """Decisions of both scenes, and the worse audit."""
    runs = [ran(ready, FixedStep(step)) for ready in plans]
    found = [decision(run, own, basis) for run, own in zip(runs, scenes, strict=True)]
    return (found[0], found[1]), max(audited(run, own) for run, own in zip(runs, scenes, strict=True))


def audited(recording: Recording, scene: Scene) -> float:
    """Energy that is there and should not be, over all that was put in, taken out, or stored on the way.

    Returns:
        [-]; NaN where the scene tells no energies.
    """
    if "energy_error" not in recording.series:
        return math.nan
    passed = max(
        (float(np.ptp(one.values)) for name, one in recording.series.items()
         if name.endswith("_energy") and one.unit == "J"), default=0.0
    )  # fmt: skip
    changes = np.diff(recording["energy_error"])
    for effect in scene.effects.get(WHOLE, ()):
        if isinstance(effect, PayloadChange):
            for instant in effect.breakpoints():
                at = int(np.searchsorted(recording.time, instant, side="left"))
                changes[max(0, at - 1) : at + 1] = 0.0
    wrong = float(np.abs(np.cumsum(changes)).max()) if len(changes) else 0.0
    return wrong / passed if passed > 0.0 else 0.0


def _apart(one: Change, other: Change) -> Change:
    """Size of the difference of two changes."""
    return Change(
        abs(one.peak_current - other.peak_current),
        abs(one.rms_current - other.rms_current),
        abs(one.rms_torque - other.rms_torque),
        abs(one.temperature - other.temperature),
        abs(one.tip - other.tip),
    )


def _said(within: bool, good: bool, audit: float, noise: float) -> str:
    if not good:
        return f"the step itself changes the result by {noise:.2g}: too much to tell"
    if not audit <= AUDIT:
        return f"the energy audit is off by {audit:.2g} of what passes through"
    return "the measured change is within the tolerance" if within else "the measured change is beyond the tolerance"
