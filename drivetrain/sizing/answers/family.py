"""Drives for a family of arms (several payloads, reaches or tasks) with common parts, by one search for all.

If drives are common, the branch and bound search of the first member is used, and at every node the bounds of all other
members remove candidates too. A set is accepted if it is feasible for every member.

If only motors or only gears are common, an outer branch and bound search decides which of them each joint may have. The
best set of each member is found by a search of its own, and the sum of their objectives is a lower bound. Where members
disagree at a joint, one branch gives the part of one member to all, and the other branch excludes it. Common drives are
chosen in this way too if each member has amplifiers of its own, whose prices differ between members.
"""

from __future__ import annotations

import heapq
import math
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from operator import itemgetter
from typing import Any

import numpy as np

from drivetrain.arrays import Mask
from drivetrain.errors import Fault, InputError, nearest, raise_faults
from drivetrain.sizing.judge.evaluate import Pair
from drivetrain.sizing.results import Evaluation
from drivetrain.sizing.search.candidates import build_candidates
from drivetrain.sizing.search.domains import Domain, Domains
from drivetrain.sizing.search.preconditions import check_keys, check_options, satisfied
from drivetrain.sizing.search.problem import Problem, build_problem
from drivetrain.sizing.search.propagate import ParameterRanges, Propagation
from drivetrain.sizing.search.tree import FULL_TEST_SIZE, NO_TEST_LIMIT, Tree, run_search
from drivetrain.study.model import JointTask, Study
from drivetrain.study.parts.selection import SelectionOptions


@dataclass(frozen=True, eq=False)
class FamilySelection:
    """The selected drives of all members of a family.

    Attributes:
        drives: Keys of (motor, gear) by joint name of the first member; those of members with other parts are in
            ``evaluations``; empty if no set is feasible for all members.
        objective: Mean of all members [kg, or the unit of the price]; NaN if no set is feasible.
        evaluations: Evaluation of each member with its drives, in order; empty if no set is feasible.
        proven: Whether it is proven that no better set is feasible for all members, or none at all.
        bound: Lower bound on the objective; infinite if no set is feasible.
        counters: Counters of the work done.
    """

    drives: dict[str, Pair]
    objective: float
    evaluations: tuple[Evaluation, ...]
    proven: bool
    bound: float
    counters: dict[str, int]

    def __repr__(self) -> str:
        if not self.drives:
            return "FamilySelection(no set fits all members)"
        proof = "optimal" if self.proven else f"not proven, bound {self.bound:.4g}"
        return f"FamilySelection({self.objective:.4g} for each of {len(self.evaluations)} members, {proof})"


@dataclass
class _OtherMembers:
    """Constraint that sets are feasible for the other members too, in the place of a chance constraint."""

    problems: tuple[Problem, ...]
    counters: Counter[str] = field(default_factory=Counter)

    def satisfied(self, pairs: tuple[int, ...], objective: float) -> bool:
        """Whether a set is feasible for all other members, whatever its objective is."""
        return all(satisfied(one.evaluate(pairs)) for one in self.problems)

    def without_failing(self, domains: Domains, load_decided: Mask) -> Domains:
        """The domains without candidates that the bounds of another member rule out; the same object if none are."""
        found = domains
        for one in self.problems:
            size = FULL_TEST_SIZE if self.counters["nodes of other members"] >= len(self.problems) else NO_TEST_LIMIT
            self.counters["nodes of other members"] += 1
            fresh = [_untested(one, domain) for domain in found]
            left = Propagation(one, fresh, ParameterRanges.unknown(one.n), math.inf, size, set(), self.counters).run()
            kept = [np.zeros(0, dtype=np.int64)] * one.n if left is None else [domain.pairs for domain in left]
            found = tuple(
                domain.subset(np.isin(domain.pairs, pairs)) for domain, pairs in zip(found, kept, strict=True)
            )
            if left is None:
                return found
        return domains if all(map(np.array_equal, _pairs(found), _pairs(domains))) else found


def _pairs(domains: Domains) -> list[Any]:
    return [domain.pairs for domain in domains]


def _untested(one: Problem, domain: Domain) -> Domain:
    """A domain with the costs of a member's problem, untested."""
    cost = one.fixed_cost[domain.pairs]
    return Domain(domain.pairs, cost, np.zeros(len(cost), dtype=np.bool_), float(cost.min()))


# What all members share, by name: its key, from the keys of a (motor, gear)
COMMON: dict[str, Callable[[Pair], str]] = {"drives": str, "motors": itemgetter(0), "gears": itemgetter(1)}


def select_family(
    studies: Sequence[Study], *, wanted: SelectionOptions | None = None, common: str = "drives"
) -> FamilySelection:
    """The drives of smallest objective that are feasible for all of several studies, with common parts.

    Args:
        studies: Studies of arms with the same joint names: other payloads (``dt.study.changed``), reaches, motions,
            supplies. Candidates of a joint are those that every study offers.
        wanted: Options as for ``select``; None: those of the first study. The objective must be mass or price, and have
            the same weights in all members.
        common: What all members share: ``drives``, motor and gear of every joint; ``motors``, with gears chosen for
            each member; ``gears``, with motors chosen for each member.

    Returns:
        The drives, and their evaluation in each study.

    Raises:
        InputError: No studies, other joints, other given drives, parts of one key that differ, an objective that
            differs between members, or what ``select`` refuses.

    Example:
        ``select_family([changed(study, TaskChange(payload=share)) for share in (0.6, 1.0, 2.0)])``
    """
    if common not in COMMON:
        raise InputError(Fault("common", f"must be {', '.join(COMMON)}", common, nearest(str(common), COMMON)))
    members = _members(studies, common)
    options = replace(members[0].wanted if wanted is None else wanted, sets=1)
    check_options(members[0], options)
    if any(weight and name == "energy" for name, weight in options.weights):
        raise InputError(Fault("wanted", "must be mass, price or both: energy differs between members"))
    if options.holds is not None:
        raise InputError(Fault("wanted.holds", "is not asked of a family", options.holds))
    try:
        problems = tuple(
            build_problem(build_candidates(one), options) for one in (replace(m, wanted=options) for m in members)
        )
    except KeyError:
        for one in members:
            check_keys(one)
        raise
    own_amplifiers = any(
        one.price_weight and len(offer.task.amplifiers) > 1 for one in problems for offer in one.candidates.joints
    )
    one_search = common == "drives" and not own_amplifiers
    others: Any = _OtherMembers(problems[1:])
    tree = Tree(problems[0], chance_constraint=others if problems[1:] and one_search else None)
    tree.begin()
    # compilation before this point does not count towards the time limit
    deadline = time.perf_counter() + options.time_limit
    if not one_search:
        return _with_own_parts(problems, COMMON[common], deadline)
    tree, first = run_search(tree, deadline, lambda *_: None)
    counters = dict(tree.counters + others.counters)
    if not tree.best:
        return FamilySelection({}, math.nan, (), tree.finished, math.inf if tree.finished else tree.bound, counters)
    best = tree.best[0]
    evaluations = (first[best.pairs], *(one.evaluate(best.pairs) for one in problems[1:]))
    drives, bound = problems[0].keys(dict(enumerate(best.pairs))), min(tree.bound, best.objective)
    return FamilySelection(drives, best.objective, evaluations, tree.finished, bound, counters)


Allowed = tuple[frozenset[str], ...]  # parts by joint


def _with_own_parts(problems: Sequence[Problem], common: Callable[[Pair], str], deadline: float) -> FamilySelection:
    """The sets of all members with common parts and the smallest sum of objectives."""
    parts = [[np.array([common(p.candidates.keys(k)) for k in own.tolist()], dtype=str) for own in p.eligible]
             for p in problems]  # fmt: skip
    counters: Counter[str] = Counter()

    def chosen(member: int, tree: Tree) -> list[str]:
        keys = problems[member].candidates.keys
        return [common(keys(pair)) for pair in tree.best[0].pairs]

    def searches(allowed: Allowed, before: Sequence[Tree], limit: float) -> list[Tree] | None:
        """Each member's best set of allowed parts; None if the sum of their objectives reaches the limit."""
        found = list(before)
        for k, one in enumerate(problems):
            if found[k].best and all(part in may for part, may in zip(chosen(k, found[k]), allowed, strict=True)):
                continue  # the best set of a superset of parts is still allowed
            eligible = tuple(
                own[np.isin(named, [*may])] for own, named, may in zip(one.eligible, parts[k], allowed, strict=True)
            )
            rest = sum(other.bound for i, other in enumerate(found) if i != k)
            tree = Tree(replace(one, eligible=eligible), cutoff=limit - rest)
            tree.begin()
            found[k], _ = run_search(tree, deadline, lambda *_: None)
            counters.update(found[k].counters)
            counters["searches"] += 1
            if not found[k].best and found[k].finished:
                return None
        return found if sum(tree.bound for tree in found) < limit else None

    every = tuple(frozenset.intersection(*(frozenset(own[j].tolist()) for own in parts)) for j in range(problems[0].n))
    best: list[Tree] | None = None
    limit, waiting = math.inf, list[tuple[float, int, Allowed, list[Tree]]]()

    def most_expensive(found: Sequence[Tree]) -> tuple[int, Tree]:
        """The member whose set has the largest objective."""
        return max(enumerate(found), key=lambda one: one[1].best[0].objective if one[1].best else math.inf)

    def solve(allowed: Allowed, before: Sequence[Tree], *, keep: bool = True) -> None:
        nonlocal best, limit
        found = searches(allowed, before, limit)
        if found is None:
            return
        bound = sum(tree.bound for tree in found)
        cost = sum(tree.best[0].objective if tree.best else math.inf for tree in found)
        alike = cost < math.inf and len({tuple(chosen(k, tree)) for k, tree in enumerate(found)}) == 1
        if alike and cost < limit:
            best, limit = found, cost
        if keep and (not alike or bound < cost):
            heapq.heappush(waiting, (bound, -counters["searches"], allowed, found))

    solve(every, [Tree(one) for one in problems])
    if best is None and waiting and most_expensive(waiting[0][3])[1].best:
        # A first incumbent, even after the time limit: the parts of the most expensive member for all.
        solve(tuple(frozenset({part}) for part in chosen(*most_expensive(waiting[0][3]))), waiting[0][3], keep=False)
    while waiting and waiting[0][0] < limit and time.perf_counter() < deadline:
        _, _, allowed, found = heapq.heappop(waiting)
        sets = [chosen(k, tree) for k, tree in enumerate(found)]
        joint = max(range(len(every)), key=lambda j: len({own[j] for own in sets}))
        part = frozenset({sets[most_expensive(found)[0]][joint]})
        for may in (part, allowed[joint] - part):
            solve((*allowed[:joint], may, *allowed[joint + 1 :]), found)
    left, n = min((waiting[0][0] if waiting else math.inf), limit), len(problems)
    if best is None:
        return FamilySelection({}, math.nan, (), not waiting, left / n, dict(counters))
    evaluations = tuple(one.evaluate(tree.best[0].pairs) for one, tree in zip(problems, best, strict=True))
    drives = problems[0].keys(dict(enumerate(best[0].best[0].pairs)))
    return FamilySelection(drives, limit / n, evaluations, left >= limit, left / n, dict(counters))


def _members(studies: Sequence[Study], common: str) -> list[Study]:
    """The studies, each with the candidates that all of them offer."""
    if not isinstance(studies, Sequence) or not studies or not all(isinstance(one, Study) for one in studies):
        raise InputError(Fault("studies", "must be a list of studies", type(studies).__name__))
    first, faults = studies[0], []
    names = first.joint_names
    for i, one in enumerate(studies):
        own = one.joint_names
        if own != names:
            faults.append(Fault(f"studies[{i}]", f"must have the joints {', '.join(names)}", ", ".join(own)))
        elif drives := [a.name for a, b in zip(one.joints, first.joints, strict=True) if a.drive != b.drive]:
            faults.append(Fault(f"studies[{i}]", "gives another drive than the first", ", ".join(drives)))
    raise_faults(faults)
    members = list(studies)
    if common == "drives":
        offered = [_common([one.joints[j] for one in studies]) for j in range(len(names))]
        members = [
            replace(one, joints=tuple(replace(t, pairs=pairs) for t, pairs in zip(one.joints, offered, strict=True)))
            for one in studies
        ]
    used = {
        key for one in members for task in one.joints for pair in (*task.pairs, task.drive or ("", "")) for key in pair
    }
    for i, one in enumerate(members[1:], 1):
        for table in ("motors", "gears"):
            rows, own = getattr(first.catalog, table), getattr(one.catalog, table)
            differ = sorted(key for key in used & {*rows} if key in own and own[key] != rows[key])
            if differ:
                faults.append(Fault(f"studies[{i}]", f"holds other {table} under the keys of the first", differ[:5]))
    raise_faults(faults)
    return members


def _common(tasks: Sequence[JointTask]) -> tuple[Pair, ...]:
    """The pairs that all of some joints have as candidates, in the order of the first."""
    everywhere = set.intersection(*(set(task.pairs) for task in tasks))
    return tuple(pair for pair in tasks[0].pairs if pair in everywhere)
