"""``effects: auto``: choose the cheapest set of effects within a tolerance, and prove it.

The influence of an effect is estimated by a run without it at a coarse step, compared with a run with all effects. The
reported estimate also contains what that step cannot resolve of a sharp current peak. Effects are left out as long as
the sum of their influences is within the tolerance. The proof is a run of the chosen scene beside the full one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp

from drivetrain.accuracy.costs import Progress, no_progress, run_to_end, seconds
from drivetrain.accuracy.decision import Basis, change, decision, tip_travel
from drivetrain.accuracy.scenes import LABELS, choices, without
from drivetrain.arrays import Array
from drivetrain.errors import InputError
from drivetrain.simulation.cost_results import AutoChoice, Change, Choice, Decision, Judged, Proof
from drivetrain.simulation.engines.engine import Engine
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.planning.plan import Plan, plan
from drivetrain.simulation.recording import Recording
from drivetrain.simulation.scene import Scene
from drivetrain.solvers.solver import check_positive

COARSE = 2.5e-4  # step of the estimates [s]; peaks of most scenes are then accurate to a few hundredths of a percent
COSTS = {
    "FlexibleJoint": 6.0, "Backlash": 6.0, "MeshLoss": 3.0, "LuGreFriction": 3.0, "CurrentLoop": 2.0,
    "SampledCurrentLoop": 8.0, "SampledCascade": 2.0, "Encoder": 0.5,
    "DryFriction": 2.0, "GearDrag": 2.0, "ViscousFriction": 1.0, "Cogging": 1.0, "WindingHeat": 0.5, "FullRotor": 0.5,
}  # fmt: skip
"""Assumed computing time of each effect, relative to the others: more states, coordinates, friction bounds."""


@dataclass(frozen=True)
class Estimate:
    """Estimated influence of leaving out one effect."""

    choice: Choice  # the effect
    changes: Mapping[str, Change]  # absolute changes by joint; the change at the tip is included at each joint
    valid: bool  # whether the run without it reached its end
    why: str  # how the estimate was found, or what ended that run
    # share of the peak current that the step cannot resolve, by joint [-]
    unresolved: Mapping[str, float] = field(default_factory=dict)

    @property
    def bound(self) -> Mapping[str, Change]:
        """The changes plus the unresolved shares of the peak currents, by joint."""
        return {
            name: replace(one, peak_current=one.peak_current + self.unresolved.get(name, 0.0))
            for name, one in self.changes.items()
        }


def estimates(
    scene: Scene, basis: Basis, step: float = COARSE, progress: Progress | None = None
) -> tuple[Estimate, ...]:
    """Estimate the influence of every effect that may be left out, each by a run without it at a step [s]."""
    engine, full, listed = FixedStep(step), without(scene, ()), choices(scene)
    whole, found = run_to_end(plan(full), engine), []
    base, unresolved = decision(whole, full, basis), _unresolved_peaks(whole, full, basis)
    for done, choice in enumerate(listed):
        (progress or no_progress)(done, len(listed), "estimating")
        found.append(_estimate(scene, choice, base, unresolved, basis, engine))
    return tuple(found)


def _estimate(
    scene: Scene, choice: Choice, base: Decision, unresolved: Mapping[str, float], basis: Basis, engine: Engine
) -> Estimate:
    """The influence of one effect; ``base`` and ``unresolved`` are the results of the full scene."""
    try:
        reduced = without(scene, [choice])
        run = run_to_end(plan(reduced), engine)
        found = change(decision(run, reduced, basis), base)
    except InputError as error:
        return Estimate(choice, {}, False, f"without it: {error.faults[0].problem}")
    sizes = {name: combined(lambda values: abs(values[0]), [one]) for name, one in found.items()}
    own = _unresolved_peaks(run, reduced, basis)
    return Estimate(choice, sizes, True, "a run without it", {name: max(own[name], unresolved[name]) for name in own})


def _unresolved_peaks(run: Recording, scene: Scene, basis: Basis) -> dict[str, float]:
    """Share of each peak current that is uncertain because breakaway may be one step too early or too late, by joint.

    Before breakaway a current rises steadily, so its rise in the last step is the uncertainty of the peak. At a jump,
    which rises in one step only, and at a rounded peak, whose rise decreases, the uncertainty is smaller or zero.
    """
    last = run.time >= run.time[-1] - (basis.period or math.inf) - 1e-9
    found = dict.fromkeys(scene.joints, 0.0)
    for name in found:
        current = run.series.get(f"{name}.current")
        size = np.zeros(1) if current is None else np.abs(current.values[last])
        k = int(np.argmax(size))
        if k >= 2:
            before, rise = np.diff(size[k - 2 : k + 1])
            found[name] = float(max(min(rise, before, 2.0 * rise - before), 0.0) / size[k])
    return found


def combined(rule: Callable[[tuple[float, ...]], float], parts: Iterable[Change]) -> Change:
    """Combine changes quantity by quantity with a rule such as ``sum`` or ``max``; without changes, no change."""
    return Change(*(rule(values) for values in zip(*((*part.shares, part.tip) for part in parts), strict=True)))


def added(parts: list[Mapping[str, Change]], joints: tuple[str, ...]) -> dict[str, Change]:
    """Sum of the estimated changes of several effects, by joint."""
    return {name: combined(sum, [part[name] for part in parts if name in part]) for name in joints}


CONSTRAINT_SLACK = 1e-6  # constraint violation that the integer programming solver may leave, over the tolerance
NUMERICAL_SHARE = 0.2  # numerical error that is allowed, over the measured change or the tolerance
MOST_HALVINGS = 3  # of the step, at most, to reach that
LARGEST_ENERGY_ERROR = 1e-3  # error of the energy balance that is allowed, over the energy exchanged


@dataclass(frozen=True)
class Limits:
    """Tolerances of the decision quantities."""

    share: float  # relative tolerance of currents, torques and temperature rises [-]
    tip: float  # tolerance of the tip's deviation [m]; without an arm of the joint's [rad or m]


def choose_effects(
    scene: Scene,
    basis: Basis,
    *,
    tolerance: float = 0.01,
    tip_tolerance: float | None = None,
    step: float = COARSE,
    progress: Progress | None = None,
) -> AutoChoice:
    """Choose the cheapest scene within a tolerance of the full one, and prove it by running both.

    ``tip_tolerance`` [m] is that of the tip's deviation; None: the relative tolerance times the tip's travel. The
    estimates take a time step ``step`` [s].
    """
    check_positive("tolerance", tolerance, "1")
    report = progress or no_progress
    found = estimates(scene, basis, step, report)
    if tip_tolerance is None:
        tip_tolerance = tolerance * tip_travel(scene, run_to_end(plan(without(scene, ())), FixedStep(step)))
    limits = Limits(tolerance, tip_tolerance)
    dropped = set(cheapest(found, limits, scene.joints, COSTS))
    restored: list[Choice] = []
    while True:
        report(0, 1, f"proving that {len(dropped)} effects may be omitted")
        kept = without(scene, dropped)
        proof = None
        if dropped:
            bound = added([one.bound for one in found if one.choice in dropped], scene.joints)
            proof = proved(scene, kept, basis, bound, limits.share, limits.tip, step)
        if proof is None or proof.proven or not proof.beyond:
            break
        back = _effect_to_restore(found, dropped, limits, proof)
        restored.append(back)
        dropped.remove(back)
    report(1, 1, "done")
    judged = []
    for one in found:
        kind, worst = one.choice.kind, combined(max, added([one.bound], scene.joints).values())
        cost, stays = COSTS.get(kind, 1.0), one.choice not in dropped
        judged.append(Judged(one.choice, LABELS[kind], worst, one.valid, one.why, stays, cost))
    return AutoChoice(kept, tolerance, tip_tolerance, tuple(judged), proof, tuple(restored))


def cheapest(
    found: Sequence[Estimate], limits: Limits, joints: tuple[str, ...], costs: Mapping[str, float]
) -> tuple[Choice, ...]:
    """The effects to leave out: those that save most while the sum of their changes is within all limits.

    A binary linear program, with one variable per effect and one constraint per decision quantity.
    """
    fit = [one for one in found if one.valid and _used_tolerances(one, limits, joints).max() <= 1.0]
    if not fit:
        return ()
    uses = np.array([_used_tolerances(one, limits, joints) for one in fit]).T
    saved = np.array([costs.get(one.choice.kind, 1.0) for one in fit])
    best = milp(
        -saved, integrality=np.ones(len(fit)), bounds=Bounds(0.0, 1.0), options={"mip_rel_gap": 0.0},
        constraints=LinearConstraint(uses, ub=1.0 - CONSTRAINT_SLACK),
    )  # fmt: skip
    return tuple(one.choice for one, gone in zip(fit, best.x, strict=True) if gone > 0.5)


def _used_tolerances(one: Estimate, limits: Limits, joints: tuple[str, ...]) -> Array:
    """Changes of an estimate over their tolerances: of every quantity of every joint, then of the tip."""
    changes = added([one.changes], joints).values()
    shares = [share / limits.share for change in changes for share in change.shares]
    tip = max((change.tip for change in changes), default=0.0)
    of_tip = tip / limits.tip if limits.tip > 0.0 else (math.inf if tip > 0.0 else 0.0)
    return np.nan_to_num(np.array([*shares, of_tip]), nan=0.0, posinf=math.inf)


def _effect_to_restore(left: Sequence[Estimate], dropped: Collection[Choice], limits: Limits, proof: Proof) -> Choice:
    """The effect to restore after a failed proof: with the largest estimate at the joint with the largest change."""
    joints = tuple(proof.measured)
    worst = max(proof.measured, key=lambda name: proof.measured[name].largest(limits.tip))
    candidates = [one for one in left if one.choice in dropped]
    near = [one for one in candidates if worst in one.changes] or candidates
    return max(near, key=lambda one: float(_used_tolerances(one, limits, joints).max())).choice


def proved(
    scene: Scene, kept: Scene, basis: Basis, estimate: Mapping[str, Change], tolerance: float, tip: float, step: float
) -> Proof:
    """Run the chosen scene and the full one with ever smaller steps, and compare their decision quantities.

    The step is halved until the numerical error of the measured change is small. ``tip`` is the tolerance of the tip's
    deviation [m], ``step`` the first time step [s], ``estimate`` the summed estimates that the result reports.
    """
    full = without(scene, ())
    plans, scenes = (plan(kept), plan(full)), (kept, full)
    coarse, audit = _run_both(plans, scenes, basis, step)
    scale = tip / tolerance if tolerance > 0.0 else 0.0
    for _ in range(MOST_HALVINGS):
        step *= 0.5
        fine, audit = _run_both(plans, scenes, basis, step)
        measured = change(fine[0], fine[1])
        before = change(coarse[0], coarse[1])
        numerical = {
            name: combined(lambda two: abs(two[0] - two[1]), (measured[name], before[name])) for name in measured
        }
        largest = max(one.largest(scale) for one in measured.values())
        noise = max(one.largest(scale) for one in numerical.values())
        good = noise <= NUMERICAL_SHARE * max(largest, tolerance)
        if good:
            break
        coarse = fine
    within = largest + (noise if largest > 0.8 * tolerance else 0.0) <= tolerance
    times = seconds([(ready, FixedStep(step)) for ready in plans])
    return Proof(
        fine[0], fine[1], estimate, measured, numerical, step, audit, times[0], times[1],
        not within, within and good and audit <= LARGEST_ENERGY_ERROR, _proof_text(within, good, audit, noise),
    )  # fmt: skip


def _run_both(
    plans: tuple[Plan, Plan], scenes: tuple[Scene, Scene], basis: Basis, step: float
) -> tuple[tuple[Decision, Decision], float]:
    """Decisions of both scenes at a step [s], and the larger error of their energy balances [-]."""
    runs = [run_to_end(ready, FixedStep(step)) for ready in plans]
    found = [decision(run, own, basis) for run, own in zip(runs, scenes, strict=True)]
    return (found[0], found[1]), max(audited(run) for run in runs)


def audited(recording: Recording) -> float:
    """Error of the energy balance over the largest energy exchanged [-]; NaN if the recording has no balance."""
    if "energy_error" not in recording.series:
        return math.nan
    passed = max(
        (float(np.ptp(one.values)) for name, one in recording.series.items()
         if name.endswith("_energy") and one.unit == "J"), default=0.0
    )  # fmt: skip
    wrong = float(np.ptp(recording["energy_error"]))
    return wrong / passed if passed > 0.0 else 0.0


def _proof_text(within: bool, good: bool, audit: float, noise: float) -> str:
    """The result of the proof in words."""
    if not good:
        return f"the step itself changes the result by {noise:.2g}: beyond any estimate"
    if not audit <= LARGEST_ENERGY_ERROR:
        return f"the energy audit is off by {audit:.2g} of what passes through"
    return "the measured change is within the tolerance" if within else "the measured change is beyond the tolerance"
