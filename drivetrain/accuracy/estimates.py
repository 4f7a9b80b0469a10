"""What leaving each effect out is estimated to change: a run without it at a coarse step, beside one with all."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from drivetrain.accuracy.costs import Progress, ran, silent
from drivetrain.accuracy.decision import Basis, change, decision
from drivetrain.accuracy.scenes import choices, without
from drivetrain.errors import InputError
from drivetrain.simulation.cost_results import Change, Choice, Decision
from drivetrain.simulation.engines.engine import Engine
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.planning.plan import plan
from drivetrain.simulation.scene import Scene

COARSE = 2.5e-4  # s, at which peaks of most scenes are told to a few hundredths of a percent
COSTS = {
    "FlexibleJoint": 6.0, "Backlash": 6.0, "MeshLoss": 3.0, "LuGreFriction": 3.0, "CurrentLoop": 2.0,
    "SampledCurrentLoop": 8.0, "SampledCascade": 2.0, "Encoder": 0.5,
    "DryFriction": 2.0, "GearDrag": 2.0, "ViscousFriction": 1.0, "Cogging": 1.0, "WindingHeat": 0.5, "FullRotor": 0.5,
}  # fmt: skip
"""What keeping an effect is thought to cost, relative to others: states and coordinates more, bounds to be solved."""


@dataclass(frozen=True)
class Told:
    """What leaving one effect out is thought to change.

    Attributes:
        choice: The effect.
        changes: Sizes of the changes by joint; the tip's stands at each.
        valid: Whether a run without it comes to its end.
        why: How it was found, or what ended that run.
    """

    choice: Choice
    changes: Mapping[str, Change]
    valid: bool
    why: str


def estimates(scene: Scene, basis: Basis, step: float = COARSE, progress: Progress | None = None) -> tuple[Told, ...]:
    """The estimate of every effect that may be left out."""
    engine, full, listed = FixedStep(step), without(scene, ()), choices(scene)
    base, found = decision(ran(plan(full), engine), full, basis), []
    for done, choice in enumerate(listed):
        (progress or silent)(done, len(listed), "estimating")
        found.append(_estimate(scene, choice, base, basis, engine))
    return tuple(found)


def _estimate(scene: Scene, choice: Choice, base: Decision, basis: Basis, engine: Engine) -> Told:
    """Of one effect."""
    try:
        less = without(scene, [choice])
        found = change(decision(ran(plan(less), engine), less, basis), base)
    except InputError as error:
        return Told(choice, {}, False, f"without it: {error.faults[0].problem}")
    sizes = {name: joined(lambda values: abs(values[0]), [one]) for name, one in found.items()}
    return Told(choice, sizes, True, "a run without it")


def joined(rule: Callable[[tuple[float, ...]], float], parts: Iterable[Change]) -> Change:
    """Changes made one by a rule for each quantity, such as ``sum``; none changes nothing."""
    return Change(*(rule(values) for values in zip(*((*part.shares, part.tip) for part in parts), strict=True)))


def added(parts: list[Mapping[str, Change]], joints: tuple[str, ...]) -> dict[str, Change]:
    """Estimates of several effects together."""
    return {name: joined(sum, [part[name] for part in parts if name in part]) for name in joints}
