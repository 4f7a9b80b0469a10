"""Common-parts constraints: at most so many different parts at some joints.

Every constraint has one form: each pair has a label (its motor, its gear, or the family of either), and the joints of
the constraint may use at most ``most`` different labels. A limit of one label expresses "the same family". The file
gives propagation, a Lagrangian lower bound on the cost, and branching.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivetrain.arrays import Array, Indices
from drivetrain.sizing.search.candidates import Candidates
from drivetrain.sizing.search.domains import UNPRICED, Domain, Domains, replace_domain
from drivetrain.study.parts.selection import SelectionOptions, family

NO_PART = -1  # label that does not count, such as the gear of a direct drive
SUBGRADIENT_STEPS = 30
SHRINK = 0.6  # factor on the subgradient step length after a step that did not raise the bound


@dataclass(frozen=True, eq=False)
class CommonParts:
    """The constraint that some joints use at most ``most`` different labels."""

    name: str  # for messages, such as ``motor types``
    label: Indices  # label of each pair, (P,)
    joints: tuple[int, ...]  # indices of the joints
    most: int  # different labels allowed, NO_PART not counted

    def satisfied(self, pairs: Sequence[int]) -> bool:
        """Whether a set of drives, one pair a joint of the arm, satisfies the constraint."""
        return len({int(self.label[pairs[joint]]) for joint in self.joints} - {NO_PART}) <= self.most

    def propagate(self, domains: Domains, limit: float) -> Domains | None:
        """Remove candidates that cannot satisfy the constraint below a cost limit; None if no set is left."""
        available = [np.unique(self.label[domains[joint].pairs]) for joint in self.joints]
        fixed = {int(labels[0]) for labels in available if len(labels) == 1} - {NO_PART}
        if len(fixed) > self.most:
            return None
        if len(fixed) == self.most:
            return self._restrict(domains, [*fixed, NO_PART], keep=True)
        if self.most > 1 or min(domain.lower_bound for domain in domains) <= UNPRICED:
            return domains
        cost, labels, no_part_cost = self._label_costs(domains)
        cost_with_label = np.minimum(cost, no_part_cost).sum(axis=1) + self._other_joints_bound(domains)
        return self._restrict(domains, np.append(labels[cost_with_label < limit], NO_PART), keep=True)

    def bound(self, domains: Domains, limit: float) -> float:
        """Lower bound on the cost of all sets that satisfy the constraint.

        Choosing a few labels and then the cheapest of them for each joint is a p-median problem. Its Lagrangian
        relaxation is a lower bound for any multipliers; some subgradient steps with Polyak's step length improve it.
        """
        cost, _, no_part_cost = self._label_costs(domains)
        rest = self._other_joints_bound(domains)
        if self.most == 1:
            return rest + float(np.minimum(cost, no_part_cost).sum(axis=1).min())
        second = min(1, len(cost) - 1)
        multipliers = np.minimum(np.partition(cost, second, axis=0)[second], no_part_cost)
        largest_cost = cost[np.isfinite(cost)].max(initial=0.0)
        multipliers = np.where(np.isfinite(multipliers), multipliers, largest_cost)
        best, scale = -math.inf, 1.0
        for _ in range(SUBGRADIENT_STEPS):
            reduced = np.minimum(cost - multipliers, 0.0)
            chosen = np.argsort(reduced.sum(axis=1), kind="stable")[: self.most]
            value = float(multipliers.sum() + reduced[chosen].sum() + np.minimum(no_part_cost - multipliers, 0.0).sum())
            scale = scale if value > best else SHRINK * scale
            best = max(best, value)
            subgradient = 1.0 - (reduced[chosen] < 0.0).sum(axis=0) - (no_part_cost < multipliers)
            if not subgradient.any():
                break
            target = limit - rest if math.isfinite(limit) else 1.05 * abs(best) + 1e-9
            length = scale * max(target - value, 1e-3 * abs(value)) / float(subgradient @ subgradient)
            multipliers = multipliers + length * subgradient
        return rest + best

    def branch(self, domains: Domains) -> list[Domains]:
        """Two branches of domains whose cheapest candidates violate the constraint.

        If one label is allowed, the cheapest label is either taken or excluded. Otherwise the joint with the largest
        regret (cost difference between its two cheapest labels) either takes the label of its cheapest candidate or
        excludes it.
        """
        cost, labels, no_part_cost = self._label_costs(domains)
        if self.most == 1:
            label = labels[int(np.argmin(np.minimum(cost, no_part_cost).sum(axis=1)))]
            branches = (
                self._restrict(domains, (label, NO_PART), keep=True),
                self._restrict(domains, (label,), keep=False),
            )
            return [branch for branch in branches if branch is not None]
        undecided = [joint for joint in self.joints if len(np.unique(self.label[domains[joint].pairs])) > 1]
        joint = max(undecided, key=lambda joint: _regret(cost[:, self.joints.index(joint)]))
        domain = domains[joint]
        same = self.label[domain.pairs] == self.label[domain.pairs[domain.cheapest]]
        return [replace_domain(domains, joint, domain.subset(mask)) for mask in (same, ~same)]

    def _restrict(self, domains: Domains, labels: Sequence[int] | Indices, *, keep: bool) -> Domains | None:
        """Keep only, or else exclude, some labels at all joints of the constraint; None if a joint has no candidate."""
        for joint in self.joints:
            mask = np.isin(self.label[domains[joint].pairs], labels, invert=not keep)
            if not mask.any():
                return None
            domains = replace_domain(domains, joint, domains[joint].subset(mask))
        return domains

    def _other_joints_bound(self, domains: Sequence[Domain]) -> float:
        """Lower bound on the cost of the joints outside the constraint."""
        return float(sum(domain.lower_bound for joint, domain in enumerate(domains) if joint not in self.joints))

    def _label_costs(self, domains: Domains) -> tuple[Array, Indices, Array]:
        """Smallest cost of each label at each joint, (labels, joints), the labels, and the cost of NO_PART, (joints,).

        Costs are infinite where a joint has no candidate with the label.
        """
        own = [domains[joint] for joint in self.joints]
        labels = np.unique(np.concatenate([self.label[domain.pairs] for domain in own]))
        cost = np.full((len(labels), len(own)), math.inf)
        for column, domain in enumerate(own):
            np.minimum.at(cost[:, column], np.searchsorted(labels, self.label[domain.pairs]), domain.cost)
        no_part_cost = cost[0].copy() if labels[0] == NO_PART else np.full(len(own), math.inf)
        counted = labels != NO_PART
        if not counted.any():
            return no_part_cost[np.newaxis], labels, no_part_cost
        return cost[counted], labels[counted], no_part_cost


def common_parts(candidates: Candidates, options: SelectionOptions) -> tuple[CommonParts, ...]:
    """The common-parts constraints of a selection."""
    motor, gear = candidates.pairs.T
    every = tuple(range(len(candidates.study.joints)))
    found = []
    if options.most_motor_types is not None:
        found.append(CommonParts("motor types", motor, every, options.most_motor_types))
    if options.most_gear_types is not None:
        # Two catalogue rows may share a key, so keys are numbered, not rows.
        numbered = np.where(np.array(candidates.gears) == "", NO_PART, _numbered(candidates.gears))
        found.append(CommonParts("gear types", numbered[gear], every, options.most_gear_types))
    names, catalog = candidates.study.joint_names, candidates.study.catalog
    for group in options.same_family:
        joints, listed = tuple(names.index(name) for name in group), ", ".join(group)
        motors = _numbered([family(catalog.motors[key]) for key in candidates.motors])
        gears = _numbered([family(catalog.gears[key]) if key else "" for key in candidates.gears])
        found.append(CommonParts(f"motor family of {listed}", motors[motor], joints, 1))
        found.append(CommonParts(f"gear family of {listed}", gears[gear], joints, 1))
    sharing = sorted({task.sharing for task in candidates.study.joints if task.sharing})
    if sharing:
        pairs = np.unique(candidates.pairs, axis=0, return_inverse=True)[1].reshape(-1).astype(np.int64)
    for one, other in sharing:
        joints = (names.index(one), names.index(other))
        found.append(CommonParts(f"drives of {one} and {other}", pairs, joints, 1))
    return tuple(found)


def _regret(cost: Array) -> float:
    """Difference between the two smallest of some costs; infinite if there is only one finite cost."""
    ordered = np.sort(cost)
    return float(ordered[1] - ordered[0]) if len(ordered) > 1 and np.isfinite(ordered[1]) else math.inf


def _numbered(names: Sequence[str]) -> Indices:
    """An integer for each name, equal for equal names."""
    return np.unique(np.array(names), return_inverse=True)[1].reshape(-1).astype(np.int64)
