"""At most so many different parts: what such a rule rules out, what it costs at least, and how a choice under it parts.

Every rule has one form: each pair has a label (its motor, its gear, the family of either), and some joints may have
only so many different labels together. One label for a group of joints is the same family.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.sizing.judge.packed_task import Packed
from drivetrain.sizing.search.choices import UNPRICED, cheapest, chosen, segment
from drivetrain.sizing.search.propagation import Choices, Indices
from drivetrain.study.model import Study
from drivetrain.study.selection import Wanted, family

FREE = -1  # label of what is no part at all, such as the gear of a direct drive
STEPS = 30  # of the multipliers of a bound

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Rule:
    """At most so many different labels at some joints.

    Attributes:
        what: In words, such as ``motor types``.
        label: Of each pair, (P,).
        joints: Indices of the joints.
        most: Different labels, FREE not counted.
    """

    what: str
    label: Indices
    joints: tuple[int, ...]
    most: int

    def allows(self, pairs: Sequence[int]) -> bool:
        """Whether a set keeps the rule."""
        return len({int(self.label[pairs[joint]]) for joint in self.joints} - {FREE}) <= self.most


def rules_of(packed: Packed, wanted: Wanted) -> tuple[Rule, ...]:
    """The rules that a selection must keep.

    Returns:
        None where nothing is limited.
    """
    motor, gear = packed.task.pairs.T
    every = tuple(range(len(packed.study.joints)))
    geared = np.where(np.array([key == "" for key in packed.gears], dtype=bool)[gear], FREE, _same(packed.gears)[gear])
    found = []
    if wanted.most_motor_types is not None:
        found.append(Rule("motor types", motor, every, wanted.most_motor_types))
    if wanted.most_gear_types is not None:
        found.append(Rule("gear types", geared, every, wanted.most_gear_types))
    names = [task.name for task in packed.study.joints]
    for group in wanted.same_family:
        joints = tuple(names.index(name) for name in group)
        of_motors, of_gears = _families(packed, packed.study)
        found.append(Rule(f"motor family of {', '.join(group)}", of_motors[motor], joints, 1))
        found.append(Rule(f"gear family of {', '.join(group)}", of_gears[gear], joints, 1))
    return tuple(found)


def narrowed_by(rule: Rule, choices: Choices, limit: float) -> Choices | None:
    """The choices without what the rule alone rules out.

    Returns:
        The same object where nothing is ruled out; None where no set is left.
    """
    there = [np.unique(rule.label[segment(choices, joint)]) for joint in rule.joints]
    fixed = {int(labels[0]) for labels in there if len(labels) == 1} - {FREE}
    if len(fixed) > rule.most:
        return None
    kept: Indices | None = np.array([*fixed, FREE]) if len(fixed) == rule.most else None
    if rule.most == 1 and kept is None and choices.least.min() > UNPRICED:
        cost, labels, free = _costs(rule, choices)
        room = limit - (choices.least.sum() - choices.least[list(rule.joints)].sum())
        kept = np.append(labels[np.minimum(cost, free).sum(axis=1) < room], FREE)
    if kept is None:
        return choices
    for joint in rule.joints:
        mask = np.isin(rule.label[segment(choices, joint)], kept)
        if not mask.any():
            return None
        if not mask.all():
            choices = chosen(choices, joint, mask)
    return choices


def least_under(rule: Rule, choices: Choices, limit: float) -> float:
    """What all sets that keep the rule cost at least.

    Joints that choose their labels together are a median problem: choose a few labels, then the cheapest of them for
    each joint. Its Lagrangian relaxation is a lower bound at any multipliers; a few steps make it a good one.
    """
    cost, _, free = _costs(rule, choices)
    rest = float(choices.least.sum() - choices.least[list(rule.joints)].sum())
    if rule.most == 1:
        return rest + float(np.minimum(cost, free).sum(axis=1).min())
    multipliers = np.minimum(np.partition(cost, min(1, len(cost) - 1), axis=0)[min(1, len(cost) - 1)], free)
    known = cost[np.isfinite(cost)]
    multipliers = np.where(np.isfinite(multipliers), multipliers, known.max(initial=0.0))
    best, scale = -math.inf, 1.0
    for _ in range(STEPS):
        gain = np.minimum(cost - multipliers, 0.0)
        order = np.argsort(gain.sum(axis=1), kind="stable")[: rule.most]
        value = float(multipliers.sum() + gain[order].sum() + np.minimum(free - multipliers, 0.0).sum())
        scale = scale if value > best else 0.6 * scale
        best = max(best, value)
        slope = 1.0 - (gain[order] < 0.0).sum(axis=0) - (free < multipliers)
        if not slope.any():
            break
        goal = limit - rest if math.isfinite(limit) else 1.05 * abs(best) + 1e-9
        multipliers = multipliers + scale * max(goal - value, 1e-3 * abs(value)) * slope / float(slope @ slope)
    return rest + best


def parted_by(rule: Rule, choices: Choices) -> list[Choices]:
    """Two parts of some choices whose cheapest candidates break the rule."""
    cost, labels, free = _costs(rule, choices)
    if rule.most == 1:
        label = labels[int(np.argmin(np.minimum(cost, free).sum(axis=1)))]
        return [_with(rule, choices, (label, FREE), keep=True), _with(rule, choices, (label,), keep=False)]
    several = [joint for joint in rule.joints if len(np.unique(rule.label[segment(choices, joint)])) > 1]
    regrets = []
    for joint in several:
        known = np.sort(cost[:, rule.joints.index(joint)])
        regrets.append(known[1] - known[0] if len(known) > 1 and np.isfinite(known[1]) else math.inf)
    joint = several[int(np.argmax(regrets))]
    mask = rule.label[segment(choices, joint)] == rule.label[cheapest(choices, joint)]
    return [chosen(choices, joint, mask), chosen(choices, joint, ~mask)]


def _with(rule: Rule, choices: Choices, labels: tuple[int, ...], *, keep: bool) -> Choices:
    """Only some labels at all joints of a rule, or all but them."""
    for joint in rule.joints:
        mask = np.isin(rule.label[segment(choices, joint)], labels)
        choices = chosen(choices, joint, mask if keep else ~mask)
    return choices


def _costs(rule: Rule, choices: Choices) -> tuple[Array, Indices, Array]:
    """Least cost of each label at each joint of a rule, (labels, joints), the labels, and the least cost of FREE."""
    parts = [segment(choices, joint) for joint in rule.joints]
    labels = np.unique(np.concatenate([rule.label[part] for part in parts]))
    cost = np.full((len(labels), len(parts)), math.inf)
    for column, (joint, part) in enumerate(zip(rule.joints, parts, strict=True)):
        first = choices.first[joint]
        at = np.searchsorted(labels, rule.label[part])
        np.minimum.at(cost[:, column], at, choices.cost[first : first + len(part)])
    free = cost[0].copy() if labels[0] == FREE else np.full(len(parts), math.inf)
    counted = labels != FREE
    if not counted.any():
        return free[np.newaxis], labels, free
    return cost[counted], labels[counted], free


def _same(keys: Sequence[str]) -> Indices:
    """A number for each key; a key that has two rows has one number."""
    return np.unique(np.array(keys), return_inverse=True)[1].reshape(-1).astype(np.int64)


def _families(packed: Packed, study: Study) -> tuple[Indices, Indices]:
    """A number for the family of each motor and of each gear."""
    motors = [family(study.catalog.motors[key]) for key in packed.motors]
    gears = [family(study.catalog.gears[key]) if key else "" for key in packed.gears]
    return tuple(np.unique(np.array(names), return_inverse=True)[1].reshape(-1) for names in (motors, gears))  # type: ignore[return-value]
