"""Depth-first branch and bound over the choices of all joints, from the tip to the base."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from drivetrain.motion.duty_cycle import sample_weights
from drivetrain.sizing.bounds import Bounds
from drivetrain.sizing.candidates import Candidate, Field, Judgement
from drivetrain.sizing.checks_supply import supply_checks
from drivetrain.sizing.results import Check, Verdict
from drivetrain.study.study import Study


@dataclass(frozen=True, eq=False)
class Blocked:
    """Where the search could not go on.

    Attributes:
        joint: Index of the joint at which no candidate holds; -1 when all joints hold and the supply does not.
        chosen: Candidates of the joints after it, by joint index.
        supply: Largest utilisation of the supply, where that is what does not hold.
    """

    joint: int
    chosen: dict[int, Candidate]
    supply: float = math.inf


class Tree:
    """The search and what it found.

    Attributes:
        study: The task.
        fields: Candidates of every joint.
        best: The best set so far, one candidate a joint; None before the first.
        objective: Of the best set.
        bound: No set that is not ruled out has a smaller objective.
        exhausted: Whether every choice was made or ruled out.
        blocked: The deepest place where nothing held; None where there was none.
        counters: Work done.
    """

    def __init__(
        self, study: Study, fields: Sequence[Field], node_limit: int, tell: Callable[[int, str], None]
    ) -> None:
        self.study = study
        self.fields = fields
        self.best: tuple[Candidate, ...] | None = None
        self.objective = math.inf
        self.bound = math.inf
        self.exhausted = True
        self.blocked: Blocked | None = None
        self.counters = Counter({"nodes": 0, "candidates judged": 0, "sets that fit": 0})
        self._node_limit = node_limit
        self._tell = tell
        self._weights = sample_weights(study.cycle.time)
        self._bounds = Bounds(fields)

    def run(self) -> None:
        """Search until the tree is exhausted or the nodes are used up."""
        self._visit(len(self.fields) - 1, {}, 0.0)
        self.bound = min(self.bound, self.objective)

    def _visit(self, joint: int, chosen: dict[int, Judgement], spent: float) -> None:
        """Try the candidates of one joint in order of their share, the drives after it chosen."""
        field = self.fields[joint]
        self.counters["nodes"] += 1
        self._tell(self.counters["nodes"], f"choosing at {field.name}")
        mounted = {index: one.candidate.drive for index, one in chosen.items()}
        work = field.work.at(joint, mounted)
        before, known = self._bounds.before(joint, mounted, spent), self.objective
        held = False
        for candidate, strong in zip(field.fast_enough, field.strong_enough(work), strict=True):
            if self.objective < known:  # a better set tightens the bounds
                before, known = self._bounds.before(joint, mounted, spent), self.objective
            least = spent + candidate.share + before
            if least >= self.objective:
                held = True  # cut off, not blocked
                break
            if not strong:
                continue
            judgement = field.judge(candidate, work)
            self.counters["candidates judged"] += 1
            if not judgement.holds:
                continue
            held = True
            if joint > 0 and self.counters["nodes"] >= self._node_limit:
                self.exhausted = False
                self.bound = min(self.bound, least)
                return
            self._choose(joint, {**chosen, joint: judgement}, spent + candidate.share)
        if not held:
            self._block(Blocked(joint, {index: one.candidate for index, one in chosen.items()}))

    def _choose(self, joint: int, chosen: dict[int, Judgement], spent: float) -> None:
        """Go on to the joint before, or, at the base, hold the whole set against the supply."""
        if joint > 0:
            self._visit(joint - 1, chosen, spent)
            return
        candidates = {index: one.candidate for index, one in chosen.items()}
        failed = [check for check in self._supply(chosen) if check.verdict is Verdict.FAIL]
        if failed:
            self._block(Blocked(-1, candidates, max(check.utilisation or 0.0 for check in failed)))
        elif spent < self.objective:
            self.counters["sets that fit"] += 1
            self.objective = spent
            self._bounds.improve(spent)
            self.best = tuple(candidates[index] for index in range(len(self.fields)))

    def _supply(self, chosen: dict[int, Judgement]) -> tuple[Check, ...]:
        powers = {self.fields[index].name: one.operation.balance.electrical for index, one in chosen.items()}
        cycle = self.study.cycle
        return supply_checks(self.study.supply, cycle.time, self._weights, powers, reserve=self.study.safety.reserve)

    def _block(self, blocked: Blocked) -> None:
        """Remember the place nearest to the base; among whole sets, the one nearest to the supply."""
        old = self.blocked
        if old is None or (blocked.joint, blocked.supply) < (old.joint, old.supply):
            self.blocked = blocked
