"""At most so many different parts: what such a constraint rules out, what it costs at least, and how to branch on it.

Every constraint has one form: each pair has a label (its motor, its gear, the family of either), and some joints may
have only so many different labels together. One label for a group of joints is the same family.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivetrain.arrays import Array
from drivetrain.sizing.search.candidates import UNPRICED, Candidates, Domain, Domains, Indices, with_domain
from drivetrain.study.parts.selection import SelectionOptions, family

FREE = -1  # label of what is no part at all, such as the gear of a direct drive
STEPS = 30  # of the multipliers of a bound


@dataclass(frozen=True, eq=False)
class CommonParts:
    """At most so many different labels at some joints."""

    what: str  # in words, such as ``motor types``
    label: Indices  # of each pair, (P,)
    joints: tuple[int, ...]  # indices of the joints
    most: int  # different labels, FREE not counted

    def satisfied(self, pairs: Sequence[int]) -> bool:
        """Whether a set satisfies the constraint."""
        return len({int(self.label[pairs[joint]]) for joint in self.joints} - {FREE}) <= self.most

    def propagate(self, domains: Domains, limit: float) -> Domains | None:
        """The domains without what the constraint alone rules out; None where no set is left."""
        there = [np.unique(self.label[domains[joint].pairs]) for joint in self.joints]
        fixed = {int(labels[0]) for labels in there if len(labels) == 1} - {FREE}
        if len(fixed) > self.most:
            return None
        kept: Indices | None = np.array([*fixed, FREE]) if len(fixed) == self.most else None
        if self.most == 1 and kept is None and min(domain.least for domain in domains) > UNPRICED:
            cost, labels, free = self._costs(domains)
            kept = np.append(labels[np.minimum(cost, free).sum(axis=1) < limit - self._rest(domains)], FREE)
        return domains if kept is None else self._with(domains, kept, keep=True)

    def bound(self, domains: Domains, limit: float) -> float:
        """What all sets that satisfy the constraint cost at least.

        Joints that choose their labels together are a median problem: choose a few labels, then the cheapest of them
        for each joint. Its Lagrangian relaxation is a lower bound at any multipliers; a few steps make it a good one.
        """
        cost, _, free = self._costs(domains)
        rest = self._rest(domains)
        if self.most == 1:
            return rest + float(np.minimum(cost, free).sum(axis=1).min())
        multipliers = np.minimum(np.partition(cost, min(1, len(cost) - 1), axis=0)[min(1, len(cost) - 1)], free)
        known = cost[np.isfinite(cost)]
        multipliers = np.where(np.isfinite(multipliers), multipliers, known.max(initial=0.0))
        best, scale = -math.inf, 1.0
        for _ in range(STEPS):
            gain = np.minimum(cost - multipliers, 0.0)
            order = np.argsort(gain.sum(axis=1), kind="stable")[: self.most]
            value = float(multipliers.sum() + gain[order].sum() + np.minimum(free - multipliers, 0.0).sum())
            scale = scale if value > best else 0.6 * scale
            best = max(best, value)
            slope = 1.0 - (gain[order] < 0.0).sum(axis=0) - (free < multipliers)
            if not slope.any():
                break
            goal = limit - rest if math.isfinite(limit) else 1.05 * abs(best) + 1e-9
            multipliers = multipliers + scale * max(goal - value, 1e-3 * abs(value)) * slope / float(slope @ slope)
        return rest + best

    def branch(self, domains: Domains) -> list[Domains]:
        """Two parts of some domains whose cheapest candidates violate the constraint."""
        cost, labels, free = self._costs(domains)
        if self.most == 1:
            label = labels[int(np.argmin(np.minimum(cost, free).sum(axis=1)))]
            parts = (self._with(domains, (label, FREE), keep=True), self._with(domains, (label,), keep=False))
            return [part for part in parts if part is not None]
        several = [joint for joint in self.joints if len(np.unique(self.label[domains[joint].pairs])) > 1]
        regrets = []
        for joint in several:
            known = np.sort(cost[:, self.joints.index(joint)])
            regrets.append(known[1] - known[0] if len(known) > 1 and np.isfinite(known[1]) else math.inf)
        joint = several[int(np.argmax(regrets))]
        domain = domains[joint]
        mask = self.label[domain.pairs] == self.label[domain.pairs[domain.cheapest]]
        return [with_domain(domains, joint, domain.kept(one)) for one in (mask, ~mask)]

    def _with(self, domains: Domains, labels: Sequence[int] | Indices, *, keep: bool) -> Domains | None:
        """Only some labels at all joints of the constraint, or all but them; None where a joint is left with none."""
        for joint in self.joints:
            mask = np.isin(self.label[domains[joint].pairs], labels, invert=not keep)
            if not mask.any():
                return None
            domains = with_domain(domains, joint, domains[joint].kept(mask))
        return domains

    def _rest(self, domains: Sequence[Domain]) -> float:
        """What the joints that the constraint does not name cost at least."""
        return float(sum(domain.least for joint, domain in enumerate(domains) if joint not in self.joints))

    def _costs(self, domains: Domains) -> tuple[Array, Indices, Array]:
        """Least cost of each label at each joint, (labels, joints), the labels, and the least cost of FREE."""
        parts = [domains[joint] for joint in self.joints]
        labels = np.unique(np.concatenate([self.label[part.pairs] for part in parts]))
        cost = np.full((len(labels), len(parts)), math.inf)
        for column, part in enumerate(parts):
            np.minimum.at(cost[:, column], np.searchsorted(labels, self.label[part.pairs]), part.cost)
        free = cost[0].copy() if labels[0] == FREE else np.full(len(parts), math.inf)
        counted = labels != FREE
        if not counted.any():
            return free[np.newaxis], labels, free
        return cost[counted], labels[counted], free


def common_parts(offered: Candidates, wanted: SelectionOptions) -> tuple[CommonParts, ...]:
    """The constraints that a selection must satisfy."""
    motor, gear = offered.pairs.T
    every = tuple(range(len(offered.study.joints)))
    found = []
    if wanted.most_motor_types is not None:
        found.append(CommonParts("motor types", motor, every, wanted.most_motor_types))
    if wanted.most_gear_types is not None:
        geared = np.where(np.array(offered.gears) == "", FREE, _numbered(offered.gears))  # a key may have two rows
        found.append(CommonParts("gear types", geared[gear], every, wanted.most_gear_types))
    names, catalog = [task.name for task in offered.study.joints], offered.study.catalog
    for group in wanted.same_family:
        joints, listed = tuple(names.index(name) for name in group), ", ".join(group)
        motors = _numbered([family(catalog.motors[key]) for key in offered.motors])
        gears = _numbered([family(catalog.gears[key]) if key else "" for key in offered.gears])
        found.append(CommonParts(f"motor family of {listed}", motors[motor], joints, 1))
        found.append(CommonParts(f"gear family of {listed}", gears[gear], joints, 1))
    pairs = np.unique(offered.pairs, axis=0, return_inverse=True)[1].reshape(-1).astype(np.int64)
    for one, other in sorted({task.sharing for task in offered.study.joints if task.sharing}):
        joints = (names.index(one), names.index(other))
        found.append(CommonParts(f"drives of {one} and {other}", pairs, joints, 1))
    return tuple(found)


def _numbered(names: Sequence[str]) -> Indices:
    """A number for each name; the same name has the same number."""
    return np.unique(np.array(names), return_inverse=True)[1].reshape(-1).astype(np.int64)
