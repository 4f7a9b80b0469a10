"""Every set of drives that no other beats in all criteria at once: a search over boxes of choices.

A box is some candidates at every joint. Their numbers bound the torque on each joint, and so what each candidate costs
at least (exactly, where the drives that load its joint are decided). The least of every weighting of the additive
criteria, and of utilisation, bounds the box: where no zone that the sets found leave open reaches below all of these
bounds, nothing new is in it. Boxes are parted where the open choice changes the load of the others most.
"""

from __future__ import annotations

import heapq
import itertools
import math
import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.sizing.demand.load_basis import NUMBERS
from drivetrain.sizing.judge.verdicts import supply_checks
from drivetrain.sizing.search.front_boxes import Part, all_sets, closed_up, halves, only, parted, weightings
from drivetrain.sizing.search.front_chances import OftenEnough
from drivetrain.sizing.search.front_cost import Box, Known, cost_box
from drivetrain.sizing.search.front_kernels import ENERGY, MASS, PRICE, USED
from drivetrain.sizing.search.front_prune import MOST_SETS, Reach, bounds, nearness, sets_of, survivors, weigh
from drivetrain.sizing.search.front_walk import new_walk, walk_box
from drivetrain.sizing.search.problem import CLOSE, Problem
from drivetrain.sizing.search.propagation import set_power
from drivetrain.sizing.search.zones import Zones
from drivetrain.study.verdicts import Verdict

NAMES = ("mass", "price", "energy", "utilisation")
ADDITIVE = {"mass": MASS, "price": PRICE, "energy": ENERGY}
EQUAL = 1e-9  # relative: sums in another order
PASSES = 3
FEW = 128  # sets of a box: so few are looked at one by one
HEIGHTS = (math.inf, 0.95, 0.9, 0.85, 0.8, 0.75, 0.7, 0.65, 0.6, 0.5, 0.4, 0.3)
TELL_EVERY = 64

Tell = Callable[[int, int, str], None]
Pairs = tuple[int, ...]
Indices = NDArray[np.int64]


class FrontSearch:
    """The search, what it found and what it has left; it can be stopped between two boxes and go on.

    Attributes:
        problem: What is chosen from.
        names: Criteria that are compared.
        zones: The sets found, and what they leave open.
        open: Boxes left, most promising first.
        counters: Work done.
        excluded: Sets that are not to be found.
        often: Says whether a set holds often enough; None where that is not asked.
    """

    def __init__(
        self, problem: Problem, names: Sequence[str], excluded: frozenset[Pairs] = frozenset(),
        often: OftenEnough | None = None,
    ) -> None:  # fmt: skip
        self.problem = problem
        self.names = tuple(names)
        self.excluded = excluded
        self.often = often
        self.counters: Counter[str] = Counter()
        self.open: list[tuple[float, int, Part]] = []
        self.zones = Zones(np.zeros(len(self.names)), EQUAL)
        self._columns = [ADDITIVE[name] for name in self.names if name in ADDITIVE]
        self._additive = [i for i, name in enumerate(self.names) if name in ADDITIVE]
        self._judged = "utilisation" in self.names
        packed = problem.packed
        self._known = Known(np.nan_to_num(np.stack([packed.mass, packed.price], axis=1)), problem.reach)
        self._weights = np.zeros((0, 4))
        self._reach: Reach | None = None
        self._following: Part | None = None
        self._started = False
        # Whether drives load only the joints before their own: then these can be judged from the tip to the base.
        self._ordered = not np.tril(problem.setting.loads).any()

    @property
    def finished(self) -> bool:
        """Whether nothing is left."""
        return self._started and not self.open and self._following is None

    def copied(self) -> FrontSearch:
        """The same search, to go on without touching this one."""
        other = FrontSearch(self.problem, self.names, self.excluded, self.often)
        other.counters, other.open, other.zones = Counter(self.counters), list(self.open), self.zones.copied()
        other._weights, other._following, other._started = self._weights, self._following, self._started
        return other

    def run(self, time_limit: float, tell: Tell) -> None:
        """Search until nothing is left or the time is up.

        Args:
            time_limit: Once all candidates were looked at a first time, which may compile [s]; at most half of it
                goes into first sets.
        """
        start = self._begin(time_limit) if not self._started else time.perf_counter()
        deadline = start + time_limit
        while not self.finished and time.perf_counter() < deadline:
            # A descent ends in sets, and sets rule out boxes: so the better part of a box is gone on with at once.
            part = heapq.heappop(self.open)[2] if self._following is None else self._following
            self._following = None
            self.counters["boxes"] += 1
            if self.counters["boxes"] % TELL_EVERY == 0:
                tell(0, 1, f"{len(self.zones.points)} sets, {self.counters['boxes']} boxes, {len(self.open)} open")
            again = self._survivors(part.box)  # sets found since may rule it out
            boxes = [] if again is None else self._parts(again.box)
            parts = [one for one in map(self._narrowed, boxes) if one is not None]
            self._following = min(parts, key=self._order, default=None)
            for one in parts:
                if one is not self._following:
                    self._push(one)

    def gap(self) -> float:
        """By what share of itself every criterion of a set found may at most be improved at once by one not found."""
        left = [part for _, _, part in self.open] + ([] if self._following is None else [self._following])
        points = self.zones.points
        if not left or not len(points):
            return math.inf if left or not self._started else 0.0
        values = np.ascontiguousarray(points[:, self._additive] @ self._weights[:, self._columns].T)
        heights = points[:, self.names.index("utilisation")] if self._judged else np.full(len(points), math.inf)
        bound, used = np.array([part.bound for part in left]), np.array([part.used for part in left])
        return float(nearness(bound, used, values, np.ascontiguousarray(heights)))

    def _begin(self, time_limit: float) -> float:
        """All candidates, the weightings that suit their sizes, and first sets; returns when their search began."""
        self._started = True
        if not all(len(pairs) for pairs in self.problem.known):
            return time.perf_counter()
        root = all_sets(self.problem)
        if not self._costed(root):
            return time.perf_counter()
        root = closed_up(root)
        cost = [root.cost[a : a + k] for a, k in zip(root.first, root.size, strict=True)]
        spans = np.maximum(np.sum([np.ptp(one, axis=0) for one in cost], axis=0), 1e-9)
        self._weights = weightings(self._columns, spans)
        most = np.sum([np.abs(one).max(axis=0) for one in cost], axis=0)
        highest = [2.0 * most[ADDITIVE[name]] + 1e9 if name in ADDITIVE else 2.0 for name in self.names]
        self.zones = Zones(np.array(highest), EQUAL)
        self._survivors(root)  # compiled before the clock runs
        start = time.perf_counter()
        self._dive(root, start + 0.5 * time_limit)
        self._following = self._narrowed(root)
        return start

    def _open(self) -> Reach:
        """What the sets found leave open, in the terms of the bounds."""
        if self._reach is None:
            corners = self.zones.corners
            values = corners[:, self._additive] @ self._weights[:, self._columns].T
            used = np.full(len(corners), math.inf)
            if self._judged:
                used = corners[:, self.names.index("utilisation")] * (1.0 - EQUAL)
            self._reach = Reach(
                self._weights, np.ascontiguousarray(values - EQUAL * np.abs(values)), np.ascontiguousarray(used)
            )
        return self._reach

    def _push(self, part: Part) -> None:
        self.counters["pushed"] += 1
        heapq.heappush(self.open, (self._order(part), -self.counters["pushed"], part))

    def _order(self, part: Part) -> float:
        """How promising a box is: the smaller the better."""
        order = part.used if self._judged else 0.0
        return order + (float(np.mean(part.bound / self._scale)) if len(part.bound) else 0.0)

    @property
    def _scale(self) -> Array:
        points = self.zones.points
        if not len(points) or not self._additive:
            return np.ones(len(self._weights))
        return np.maximum((points[:, self._additive] @ self._weights[:, self._columns].T).min(axis=0), 1e-12)

    def _costed(self, box: Box) -> bool:
        """Costs of what is not decided yet; False when a joint has no candidates left."""
        problem, work = self.problem, np.zeros(1, dtype=np.int64)
        kept = np.zeros(len(box.pool), dtype=np.bool_)
        left = cost_box(problem.packed.task, problem.setting, self._known, box, problem.memory, kept, work)
        self.counters["candidates costed"] += int(work[0])
        return bool(left)

    def _narrowed(self, box: Box) -> Part | None:
        """A box with what cannot matter taken out, until nothing changes; None when nothing is left of it."""
        part = None
        for _ in range(PASSES):
            before = int(box.size.sum())
            part = self._survivors(self._without_falling(closed_up(box))) if self._costed(box) else None
            if part is None:
                return None
            box = part.box
            if int(box.size.sum()) == before:
                break
        if part is not None and self._ordered and box.size.prod() <= (FEW if self.often is None else FEW // 16):
            self._walk(part)
            return None
        if part is not None and box.decided.all() and not box.stale.any():
            self._enumerate(part)
            return None
        return part

    def _without_falling(self, box: Box) -> Box:
        """A box without the candidates that are known to fall too often with loads that are decided."""
        if self.often is None or not self.often.falling:
            return box
        kept = np.ones(len(box.pool), dtype=np.bool_)
        lead = tuple(int(pair) for pair in box.pool[box.first])
        for joint in np.flatnonzero(box.decided & ~box.stale):
            part = slice(int(box.first[joint]), int(box.first[joint] + box.size[joint]))
            kept[part] = ~self.often.falls(int(joint), box.pool[part], lead)
        return only(box, kept)

    def _survivors(self, box: Box) -> Part | None:
        """A box without the candidates with which no zone can be reached."""
        if not box.size.all():
            return None
        kept, total = np.zeros(len(box.pool), dtype=np.bool_), np.zeros(len(self._weights))
        used = float(survivors(box, self.problem.packed.task.numbers, self._open(), kept, total))
        return None if math.isinf(used) else Part(only(box, kept), total, used)

    def _walk(self, part: Part) -> None:
        """Every set of a small box, those that reach no zone left out."""
        self.counters["boxes walked"] += 1
        problem, box, reach = self.problem, part.box, self._open()
        near = (part.bound < reach.values).all(axis=1) & (part.used < reach.used)
        reach = Reach(reach.weights, np.ascontiguousarray(reach.values[near]), np.ascontiguousarray(reach.used[near]))
        walk = new_walk(box, len(self._weights), int(np.prod(box.size)))
        values, least = np.zeros((len(box.pool), len(self._weights))), np.zeros((problem.n, len(self._weights)))
        weigh(box, problem.packed.task.numbers, self._weights, values)
        bounds(box, values, least)
        walk.least[1:] = np.cumsum(least, axis=0)
        used = [float(box.cost[a : a + k, USED].min()) for a, k in zip(box.first, box.size, strict=True)]
        walk.height[1:] = np.maximum.accumulate(used)
        count = int(walk_box(problem.packed.task, box, reach, problem.memory, walk))
        self.counters["candidates judged"] += int(walk.work[0])
        costs = walk.costs[:count]
        for at in np.lexsort((costs[:, USED], *costs[:, :3].T)):
            self._offer(tuple(int(pair) for pair in walk.pairs[at]), costs[at], bool(walk.doubts[at]))

    def _offer(self, pairs: Pairs, cost: Array, doubt: bool) -> None:
        """A whole set: held against the supply, and kept if no other matches it."""
        found = {"utilisation": float(cost[USED]), **{name: float(cost[column]) for name, column in ADDITIVE.items()}}
        if self.zones.matched(self._point(found)):
            return
        self.counters["sets judged"] += 1
        if pairs in self.excluded or not all(rule.allows(pairs) for rule in self.problem.rules):
            return
        found["utilisation"] = max(found["utilisation"], self._supply(pairs))
        if math.isinf(found["utilisation"]) or (doubt and not self._sure(pairs)):
            return
        if self.often is not None and (self.zones.matched(self._point(found)) or not self.often(pairs)):
            return
        if self.zones.offer(self._point(found), pairs):
            self.counters["sets that fit"] += 1
            self._reach = None

    def _point(self, found: Mapping[str, float]) -> Array:
        """The criteria that are compared."""
        return np.array([found[name] for name in self.names])

    def _enumerate(self, part: Part) -> None:
        """Every set of a box whose loads are decided, those that reach no zone left out."""
        self.counters["boxes decided"] += 1
        box, found = part.box, np.zeros((MOST_SETS, self.problem.n), dtype=np.int64)
        count = int(sets_of(box, self.problem.packed.task.numbers, self._open(), found))
        if count > MOST_SETS:
            for half in halves(part):
                self._enumerate(half)
            return
        cost = box.cost[found[:count]]
        total = np.concatenate([cost[:, :, :3].sum(axis=1), cost[:, :, USED:].max(axis=1)], axis=1)
        for at in np.lexsort((total[:, USED], *total[:, :3].T)):
            pairs = tuple(int(pair) for pair in box.pool[found[at]])
            self._offer(pairs, total[at], bool(box.doubt[found[at]].any()))

    def _supply(self, pairs: Pairs) -> float:
        """The highest utilisation of the supply; infinite where a set asks too much of it."""
        study = self.problem.packed.study
        supply, cycle = study.supply, study.cycle
        if supply.peak_power is None and supply.mean_power is None and supply.regenerated_power is None:
            return 0.0
        total = np.zeros(len(cycle.time))
        set_power(self.problem.packed.task, np.array(pairs, dtype=np.int64), self.problem.memory, total)
        checks = supply_checks(supply, cycle.time, cycle.weights, {"all": total}, reserve=study.safety.reserve)
        used = max((check.utilisation for check in checks if check.utilisation is not None), default=0.0)
        if abs(used - 1.0) <= CLOSE:  # the Python road tells
            failed = any(check.verdict is Verdict.FAIL for check in self.problem.evaluation(pairs).shared)
            return math.inf if failed else used
        return math.inf if used > 1.0 else used

    def _sure(self, pairs: Pairs) -> bool:
        """Whether a set with candidates at a limit to rounding holds, by the Python road."""
        self.counters["asked of the exact road"] += 1
        return all(
            self.problem.holds(joint, pair, {k: other for k, other in enumerate(pairs) if k != joint})
            for joint, pair in enumerate(pairs)
        )

    def _parts(self, box: Box) -> list[Box]:
        """A box in two, by the number that changes the loads most."""
        numbers = self.problem.packed.task.numbers
        pools = [numbers[box.pool[a : a + k]] for a, k in zip(box.first, box.size, strict=True)]
        half = np.array([0.5 * np.ptp(pool, axis=0) for pool in pools])
        # Only joints whose load is still open are changed; each counts with its share of the bounds.
        share = np.array([
            0.0 if decided else float(np.abs(box.cost[first : first + size, ENERGY]).min()) + 1e-3
            for decided, first, size in zip(box.decided, box.first, box.size, strict=True)
        ])  # fmt: skip
        effect = half * np.einsum("j,jki->ki", share, self.problem.reach)
        joint, number = np.unravel_index(int(np.argmax(effect)), effect.shape)
        if effect[joint, number] > 0.0:
            return parted(box, numbers, int(joint), int(number))
        # Where no number changes a torque, loads are told apart by any number that differs.
        for k, i in itertools.product(range(self.problem.n), range(NUMBERS)):
            if self.problem.setting.loads[:, k].any() and half[k, i] > 0.0:
                return parted(box, numbers, k, i)
        return [box]  # its loads are decided

    def _dive(self, root: Box, deadline: float) -> None:
        """First sets to hold others against, from the tip to the base.

        For each weighting, and for each height under which all utilisations are to stay, the cheapest that holds.
        """
        known: dict[tuple[int, bytes], Box] = {}
        for height in HEIGHTS if self._judged else (math.inf,):
            for weights in self._weights if len(self._weights) else np.ones((1, 4)):
                if self.counters["sets judged"] and time.perf_counter() > deadline:
                    return
                chosen: dict[int, tuple[int, Array]] = {}
                for joint in range(self.problem.n - 1, -1, -1):
                    exact = self._exact(root, joint, chosen, known)
                    fits = (exact.cost[:, USED] < height) & ~exact.doubt
                    if self.often is not None and len(exact.pool):
                        lead = tuple(chosen[k][0] if k in chosen else 0 for k in range(self.problem.n))
                        fits &= ~self.often.falls(joint, exact.pool, lead)
                    low = np.flatnonzero(fits)
                    if not len(low):
                        break
                    at = int(low[np.argmin(exact.cost[low] @ weights)])
                    chosen[joint] = int(exact.pool[at]), exact.cost[at]
                else:
                    cost = np.array([chosen[joint][1] for joint in range(self.problem.n)])
                    total = np.append(cost[:, :3].sum(axis=0), cost[:, USED].max())
                    self._offer(tuple(chosen[joint][0] for joint in range(self.problem.n)), total, False)

    def _exact(
        self, root: Box, joint: int, chosen: dict[int, tuple[int, Array]], known: dict[tuple[int, bytes], Box]
    ) -> Box:
        """The candidates of a joint that hold beside chosen drives after it, with their costs."""
        task, n, loads = self.problem.packed.task, self.problem.n, self.problem.setting.loads[joint]
        pair = [chosen[k][0] if k in chosen else int(root.pool[root.first[k]]) for k in range(n)]
        if any(loads[k] and k not in chosen for k in range(n)):  # loaded from both sides: left to the boxes
            return root._replace(pool=root.pool[:0], cost=root.cost[:0], doubt=root.doubt[:0])
        key = (joint, task.numbers[[pair[k] for k in range(n) if loads[k]]].tobytes())
        if key not in known:
            own = root.pool[root.first[joint] : root.first[joint] + root.size[joint]]
            pool = np.concatenate([own if k == joint else [pair[k]] for k in range(n)]).astype(np.int64)
            size = np.array([len(own) if k == joint else 1 for k in range(n)], dtype=np.int64)
            stale = np.arange(n) == joint
            numbers = task.numbers[pair]
            low, high = numbers.copy(), numbers.copy()
            low[joint], high[joint] = task.numbers[own].min(axis=0), task.numbers[own].max(axis=0)
            box = Box(
                pool, np.zeros((len(pool), 4)), np.zeros(len(pool), dtype=np.bool_), np.cumsum(size) - size, size,
                np.zeros(n, dtype=np.bool_), stale, low, high, np.full(n, math.inf), np.zeros((n, n, NUMBERS)),
            )  # fmt: skip
            self._costed(box)
            part = slice(int(box.first[joint]), int(box.first[joint] + box.size[joint]))
            known[key] = box._replace(pool=box.pool[part], cost=box.cost[part], doubt=box.doubt[part])
        return known[key]
