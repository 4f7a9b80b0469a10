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
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.sizing.front_kernels import ENERGY, EXACT, MASS, OUT, PRICE, UNSURE, USED, cost_joint, survivors
from drivetrain.sizing.load_basis import NUMBERS
from drivetrain.sizing.problem import Problem
from drivetrain.sizing.zones import Zones

NAMES = ("mass", "price", "energy", "utilisation")
ADDITIVE = {"mass": MASS, "price": PRICE, "energy": ENERGY}
EQUAL = 1e-9  # relative: sums in another order
NOTHING = b"-"  # what loads a joint that no drive loads
STEPS = 12  # of weightings between two criteria
PASSES = 3
HEIGHTS = (math.inf, 0.95, 0.9, 0.85, 0.8, 0.75, 0.7, 0.65, 0.6, 0.5, 0.4, 0.3)
TELL_EVERY = 64

Tell = Callable[[int, int, str], None]
Indices = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Box:
    """Some candidates at every joint.

    Attributes:
        pools: Pairs by joint.
        costs: Mass, price, energy and utilisation of each, bounds or exact, (K, 4) by joint.
        decided: Whether the load of a joint is decided, its costs exact.
        loads: Numbers of the drives that load a joint for which its costs were computed; empty before.
        bound: The least of each weighting, (W,).
        used: The least utilisation.
    """

    pools: tuple[Indices, ...]
    costs: tuple[Array, ...]
    decided: tuple[bool, ...]
    loads: tuple[bytes, ...]
    bound: Array
    used: float


class FrontSearch:
    """The search, what it found and what it has left.

    Attributes:
        problem: What is chosen from.
        names: Criteria that are compared.
        zones: The sets found, and what they leave open.
        open: Boxes left, most promising first.
        counters: Work done.
        allowed: Whether a set keeps what is wanted of it beside its checks.
    """

    def __init__(self, problem: Problem, names: Sequence[str], allowed: Callable[[Sequence[int]], bool]) -> None:
        self.problem = problem
        self.names = tuple(names)
        self.allowed = allowed
        self.counters: Counter[str] = Counter()
        self.open: list[tuple[float, int, Box]] = []
        self._columns = [ADDITIVE[name] for name in self.names if name in ADDITIVE]
        self._judged = "utilisation" in self.names
        self._loading = [np.flatnonzero(row) for row in problem.setting.loads]
        packed = problem.packed
        self._fixed = np.nan_to_num(np.stack([packed.mass, packed.price], axis=1))
        self._weights = np.zeros((0, 4))
        self.zones = Zones(np.zeros(len(self.names)), EQUAL)
        self._zone_values, self._zone_used = np.zeros((0, 0)), np.zeros(0)

    def run(self, time_limit: float, tell: Tell) -> None:
        """Search until nothing is left or the time is up.

        Args:
            time_limit: Once all candidates were looked at a first time, which may compile [s]; at most half of it
                goes into first sets.
            tell: Told how far the search is.
        """
        root = self._root()
        if root is None:
            return
        start = time.perf_counter()
        deadline = start + time_limit
        self._dive(root, start + 0.5 * time_limit)
        following = self._narrowed(root)
        while (following is not None or self.open) and time.perf_counter() < deadline:
            # A descent ends in sets, and sets rule out boxes: so the better part of a box is gone on with at once.
            box = heapq.heappop(self.open)[2] if following is None else following
            self.counters["boxes"] += 1
            if self.counters["boxes"] % TELL_EVERY == 0:
                tell(0, 1, f"{len(self.zones.points)} sets, {self.counters['boxes']} boxes, {len(self.open)} open")
            again = self._survivors(box)  # sets found since may rule it out
            parts = [] if again is None else self._parts(again)
            parts = [part for part in map(self._narrowed, parts) if part is not None]
            following = min(parts, key=self._order, default=None)
            for part in parts:
                if part is not following:
                    self._push(part)
        if following is not None:
            self._push(following)

    def gap(self) -> float:
        """By what share of itself every criterion of a set found may at most be improved at once by one not found."""
        points, worst = self.zones.points, 0.0
        additive = [i for i, name in enumerate(self.names) if name in ADDITIVE]
        if not self.open or not len(points):
            return math.inf if self.open else 0.0
        for _, _, box in self.open:
            # How far every criterion of a found set can shrink before one of the bounds of the box is met.
            shares = [box.bound / (self._weights[:, self._columns] @ point[additive]) for point in points]
            nearest = np.array(shares).max(axis=1, initial=-math.inf)
            if self._judged:
                nearest = np.maximum(nearest, box.used / points[:, self.names.index("utilisation")])
            worst = max(worst, 1.0 - float(nearest.min()))
        return worst

    def _root(self) -> Box | None:
        """All candidates, their costs, and the weightings that suit their sizes."""
        problem = self.problem
        pools = tuple(pairs.astype(np.int64) for pairs in problem.known)
        if not all(len(pool) for pool in pools):
            return None
        n = problem.n
        box = Box(pools, tuple(np.zeros((len(p), 4)) for p in pools), (False,) * n, (b"",) * n, np.zeros(0), 0.0)
        costed = self._costed(box)
        if costed is None:
            return None
        least = np.sum([cost.min(axis=0) for cost in costed.costs], axis=0)
        most = np.sum([cost.max(axis=0) for cost in costed.costs], axis=0)
        self._weights = _weightings(self._columns, np.maximum(most - least, 1e-9))
        highest = [2.0 * abs(most[ADDITIVE[n]]) + 1e9 if n in ADDITIVE else 2.0 for n in self.names]
        self.zones = Zones(np.array(highest), EQUAL)
        self._refresh()
        return self._bounded(costed)

    def _refresh(self) -> None:
        """Zones in the terms of the bounds."""
        corners = self.zones.corners
        additive = [i for i, name in enumerate(self.names) if name in ADDITIVE]
        values = corners[:, additive] @ self._weights[:, self._columns].T
        self._zone_values = np.ascontiguousarray(values - EQUAL * np.abs(values))
        used = corners[:, self.names.index("utilisation")] if self._judged else np.full(len(corners), np.inf)
        self._zone_used = np.ascontiguousarray(used * (1.0 - EQUAL))

    def _push(self, box: Box) -> None:
        self.counters["pushed"] += 1
        heapq.heappush(self.open, (self._order(box), -self.counters["pushed"], box))

    def _order(self, box: Box) -> float:
        """How promising a box is: the smaller the better."""
        order = box.used if self._judged else 0.0
        return order + (float(np.mean(box.bound / self._scale)) if len(box.bound) else 0.0)

    @property
    def _scale(self) -> Array:
        points = self.zones.points
        additive = [i for i, name in enumerate(self.names) if name in ADDITIVE]
        if not len(points) or not additive:
            return np.ones(len(self._weights))
        return np.maximum((points[:, additive] @ self._weights[:, self._columns].T).min(axis=0), 1e-12)

    def _costed(self, box: Box) -> Box | None:
        """Costs of what is not decided yet, candidates that hold in no case taken out; None when a joint has none."""
        memory, packed, setting = self.problem.memory, self.problem.packed, self.problem.setting
        pools, costs, decided, loads = list(box.pools), list(box.costs), list(box.decided), list(box.loads)
        self._ranges(pools)
        for joint in range(self.problem.n - 1, -1, -1):
            loading = self._loading[joint]
            load = memory.low[loading].tobytes() + memory.high[loading].tobytes()
            if decided[joint] or (load or NOTHING) == loads[joint]:
                continue
            loads[joint] = load or NOTHING
            states = np.zeros(len(pools[joint]), dtype=np.int64)
            found = np.zeros((len(pools[joint]), 4))
            self.counters["candidates costed"] += len(pools[joint])
            decided[joint] = cost_joint(
                packed.task, setting, joint, pools[joint], self._fixed, memory, found, states
            )  # fmt: skip
            for at in np.flatnonzero(states == UNSURE):
                states[at] = UNSURE if self._holds(joint, int(pools[joint][at]), pools) else OUT
            kept = states != OUT
            if not kept.any():
                return None
            pools[joint], costs[joint] = pools[joint][kept], found[kept]
            self._ranges(pools, joint)
        return replace(box, pools=tuple(pools), costs=tuple(costs), decided=tuple(decided), loads=tuple(loads))

    def _holds(self, joint: int, pair: int, pools: Sequence[Indices]) -> bool:
        """Whether a candidate at its limit to rounding holds, by the Python road."""
        self.counters["asked of the exact road"] += 1
        return self.problem.holds(joint, pair, {k: int(pool[0]) for k, pool in enumerate(pools) if k != joint})

    def _ranges(self, pools: Sequence[Indices], joint: int | None = None) -> None:
        """The numbers of what is left into the memory."""
        memory, numbers = self.problem.memory, self.problem.packed.task.numbers
        for at in range(self.problem.n) if joint is None else (joint,):
            memory.low[at], memory.high[at] = numbers[pools[at]].min(axis=0), numbers[pools[at]].max(axis=0)

    def _bounded(self, box: Box) -> Box:
        values = [cost @ self._weights.T for cost in box.costs]
        bound = np.sum([value.min(axis=0) for value in values], axis=0)
        return replace(box, bound=bound, used=max(float(cost[:, USED].min()) for cost in box.costs))

    def _narrowed(self, box: Box) -> Box | None:
        """A box with what cannot matter taken out, until nothing changes; None when nothing is left of it."""
        for _ in range(PASSES):
            before = sum(len(pool) for pool in box.pools)
            costed = self._costed(box)
            kept = None if costed is None else self._survivors(self._bounded(costed))
            if kept is None:
                return None
            box = kept
            if sum(len(pool) for pool in box.pools) == before:
                break
        if self._loads_decided(box):
            self._enumerate(box)
            return None
        return box

    def _survivors(self, box: Box) -> Box | None:
        """Candidates with which some zone can be reached."""
        pools, costs = list(box.pools), list(box.costs)
        values = [np.ascontiguousarray(cost @ self._weights.T) for cost in costs]
        zones, zone_used = self._zone_values, self._zone_used
        least = [_least_below(value, cost[:, USED], zone_used) for value, cost in zip(values, costs, strict=True)]
        alive = (np.sum(least, axis=0) < zones).all(axis=1) & np.isfinite(least).all(axis=(0, 2))
        if self._judged:
            alive &= box.used < zone_used
        zones, zone_used = np.ascontiguousarray(zones[alive]), np.ascontiguousarray(zone_used[alive])
        least = [one[alive] for one in least]
        for joint in range(self.problem.n):
            rest = np.zeros_like(zones)
            for other, one in enumerate(least):
                if other != joint:
                    rest += one
            kept = np.zeros(len(pools[joint]), dtype=bool)
            used = np.ascontiguousarray(costs[joint][:, USED])
            if survivors(values[joint], rest, used, zones, zone_used, kept) == 0:
                return None
            if not kept.all():
                pools[joint], costs[joint], values[joint] = pools[joint][kept], costs[joint][kept], values[joint][kept]
                least[joint] = _least_below(values[joint], costs[joint][:, USED], zone_used)
        return self._bounded(replace(box, pools=tuple(pools), costs=tuple(costs)))

    def _loads_decided(self, box: Box) -> bool:
        return all(box.decided)

    def _enumerate(self, box: Box) -> None:
        """Every set of a box whose loads are decided, those that reach no zone left out."""
        self.counters["boxes decided"] += 1
        values = [cost @ self._weights.T for cost in box.costs]
        after = [np.zeros(len(self._weights))]
        for value in reversed(values):
            after.append(after[-1] + value.min(axis=0))
        after.reverse()

        def go(joint: int, spent: Array, used: float, chosen: tuple[int, ...]) -> None:
            if joint == self.problem.n:
                self._offer(box, chosen)
                return
            for at in range(len(box.pools[joint])):
                total, worst = spent + values[joint][at], max(used, float(box.costs[joint][at, USED]))
                reached = ((total + after[joint + 1])[np.newaxis] < self._zone_values).all(axis=1)
                if bool((reached & (worst < self._zone_used)).any()):
                    go(joint + 1, total, worst, (*chosen, at))

        go(0, np.zeros(len(self._weights)), 0.0, ())

    def _offer(self, box: Box, chosen: Sequence[int]) -> None:
        """A whole set: held against the supply, and kept if no other matches it."""
        pairs = tuple(int(pool[at]) for pool, at in zip(box.pools, chosen, strict=True))
        self.counters["sets judged"] += 1
        if not self.allowed(pairs) or not self.problem.supply_holds(pairs):
            return
        rows = [cost[at] for cost, at in zip(box.costs, chosen, strict=True)]
        found = {name: math.fsum(row[column] for row in rows) for name, column in ADDITIVE.items()}
        if self._judged:
            found["utilisation"] = self.problem.evaluation(pairs).criteria["utilisation"]
        if self.zones.offer(np.array([found[name] for name in self.names]), pairs):
            self.counters["sets that fit"] += 1
            self._refresh()

    def _parts(self, box: Box) -> list[Box]:
        """A box in two, by the number that changes the loads most."""
        problem = self.problem
        self._ranges(box.pools)
        half = 0.5 * (problem.memory.high - problem.memory.low)
        # Only joints whose load is still open are changed; each counts with its share of the bounds.
        share = np.array([
            0.0 if decided else float(np.abs(cost[:, ENERGY]).min()) + 1e-3 for cost, decided in
            zip(box.costs, box.decided, strict=True)
        ])  # fmt: skip
        effect = half * np.einsum("j,jki->ki", share, problem.reach)
        joint, number = np.unravel_index(int(np.argmax(effect)), effect.shape)
        if effect[joint, number] == 0.0:
            return self._by_numbers(box)
        values = problem.packed.task.numbers[box.pools[joint], number]
        middle = 0.5 * (values.min() + values.max())
        return [self._part(box, int(joint), mask) for mask in (values <= middle, values > middle) if mask.any()]

    def _by_numbers(self, box: Box) -> list[Box]:
        """Where no number changes a torque, loads are told apart by any number that differs."""
        loads = self.problem.setting.loads
        for joint, number in itertools.product(range(self.problem.n), range(NUMBERS)):
            values = self.problem.packed.task.numbers[box.pools[joint], number]
            if loads[:, joint].any() and values.min() < values.max():
                middle = 0.5 * (values.min() + values.max())
                masks = (values <= middle, values > middle)
                return [self._part(box, joint, mask) for mask in masks if mask.any()]
        return []

    def _part(self, box: Box, joint: int, mask: NDArray[np.bool_]) -> Box:
        pools, costs = list(box.pools), list(box.costs)
        pools[joint], costs[joint] = pools[joint][mask], costs[joint][mask]
        return replace(box, pools=tuple(pools), costs=tuple(costs))

    def _dive(self, root: Box, deadline: float) -> None:
        """First sets to hold others against, from the tip to the base.

        For each weighting, and for each height under which all utilisations are to stay, the cheapest that holds.
        """
        known: dict[tuple[int, bytes], tuple[Indices, Array]] = {}
        for height in HEIGHTS if self._judged else (math.inf,):
            for weights in self._weights if len(self._weights) else np.ones((1, 4)):
                if self.counters["sets judged"] and time.perf_counter() > deadline:
                    return
                pools = list(root.pools)
                rows: list[Array] = [np.zeros(4)] * self.problem.n
                for joint in range(self.problem.n - 1, -1, -1):
                    pairs, costs = self._exact(pools, joint, known)
                    low = np.flatnonzero(costs[:, USED] < height) if len(pairs) else np.zeros(0, dtype=np.int64)
                    if not len(low):
                        break
                    at = int(low[np.argmin(costs[low] @ weights)])
                    pools[joint], rows[joint] = pairs[at : at + 1], costs[at]
                else:
                    costs_of = tuple(row[np.newaxis] for row in rows)
                    self._offer(replace(root, pools=tuple(pools), costs=costs_of), [0] * self.problem.n)

    def _exact(
        self, pools: Sequence[Indices], joint: int, known: dict[tuple[int, bytes], tuple[Indices, Array]]
    ) -> tuple[Indices, Array]:
        """The candidates of a joint that hold, with their costs; none where its load is not decided."""
        self._ranges(pools)
        memory, loading = self.problem.memory, self._loading[joint]
        key = (joint, memory.low[loading].tobytes() + memory.high[loading].tobytes())
        if key not in known:
            pool = pools[joint]
            states, costs = np.zeros(len(pool), dtype=np.int64), np.zeros((len(pool), 4))
            packed, setting = self.problem.packed, self.problem.setting
            decided = cost_joint(packed.task, setting, joint, pool, self._fixed, memory, costs, states)
            kept = (states == EXACT) & decided  # what only the Python road can tell is left to the boxes
            known[key] = pool[kept], costs[kept]
        return known[key]


def _weightings(columns: Sequence[int], spans: Array) -> Array:
    """Weightings of the additive criteria, each scaled by its span, (W, 4); each alone, and mixtures of all."""
    rows = []
    for parts in itertools.product(range(STEPS + 1), repeat=len(columns)):
        if sum(parts) == STEPS:
            row = np.zeros(4)
            for column, part in zip(columns, parts, strict=True):
                row[column] = part / STEPS / spans[column]
            rows.append(row)
    return np.array(rows) if rows else np.zeros((0, 4))


def _least_below(values: Array, used: Array, zone_used: Array) -> Array:
    """The least of each weighting over the candidates below a zone's utilisation, (Z, W); infinite where none is."""
    order = np.argsort(used, kind="stable")
    least = np.minimum.accumulate(values[order], axis=0)
    below = np.searchsorted(used[order], zone_used, side="left")
    found = least[np.maximum(below - 1, 0)]
    found[below == 0] = np.inf
    return np.asarray(found)
