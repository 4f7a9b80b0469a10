"""Sensitivity of checks to tolerances: tornado bars and first-order Sobol indices.

A bar varies one quantity between its limits, with all others nominal. The Sobol index is the share of the variance of
the utilisation that would vanish if the quantity were known. It is estimated from samples in which all quantities vary,
the same as those of the probabilities: the samples are sorted by the quantity and divided into bins of equal size, and
the variance within the bins is what would remain. Interactions make up what the indices leave of 1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.errors import whole_names
from drivetrain.sizing.results import Evaluation
from drivetrain.sizing.tolerance.draws import Draws, Source, deviated, from_uniform, sources
from drivetrain.sizing.tolerance.monte_carlo import SUPPLY, drives_of
from drivetrain.sizing.tolerance.sampling import (
    NAMES,
    SUPPLY_NAMES,
    Candidate,
    candidate,
    figures_of,
    judged,
    nominal_of,
)

FELT = 1e-9  # relative change of a utilisation below which it counts as rounding
ARMS, BINS = 4096, 64  # samples and bins of the Sobol indices, which are accurate to about 0.01


@dataclass(frozen=True)
class Bar:
    """Effect of one uncertain quantity on a check, with all others nominal."""

    source: Source  # the quantity
    # deviations at the ends: the limits of a uniform distribution, twice the standard deviation of a normal one;
    # relative to the nominal value, or in kg or K
    low: float
    high: float
    absolute: bool  # whether the deviations are in kg or K
    at_low: float  # utilisation at each end
    at_high: float
    # first-order Sobol index, 0 to 1; NaN if the utilisation does not vary or some samples have thermal runaway
    share: float = math.nan

    @property
    def span(self) -> float:
        """Change of the utilisation between the ends."""
        return abs(self.at_high - self.at_low)


@dataclass(frozen=True)
class Tornado:
    """Effects of all uncertain quantities on one check."""

    joint: str  # name of the joint, or ``supply``
    check: str  # name of the check
    nominal: float  # utilisation with nominal values
    bars: tuple[Bar, ...]  # widest first; quantities without effect are left out


@dataclass(frozen=True, eq=False)
class Effects:
    """Utilisations of all checks with each quantity alone at both of its ends, and of random samples."""

    evaluation: Evaluation  # with nominal values
    sources: tuple[Source, ...]  # uncertain quantities
    joints: Array  # utilisations at the low and at the high end, (2, sources, n, CHECKS)
    supply: Array  # utilisations of the supply checks, (2, sources, 3)
    order: NDArray[np.int64]  # random samples sorted by the value of each source, (sources, samples)
    arms: Array  # utilisations of the random samples, (samples, n, CHECKS)
    arms_supply: Array  # utilisations of the supply checks, (samples, 3)

    def of(self, joint: str, check: str) -> Tornado:
        """The tornado of one check."""
        joints, supply = figures_of(self.evaluation)
        names = list(self.evaluation.joints)
        [joint] = whole_names("joint", "joint of the study", [joint], [*names, SUPPLY])
        [check] = whole_names("check", "check of it", [check], SUPPLY_NAMES if joint == SUPPLY else NAMES)
        if joint == SUPPLY:
            ends, nominal = self.supply[..., SUPPLY_NAMES.index(check)], float(supply[SUPPLY_NAMES.index(check)])
            arms = self.arms_supply[:, SUPPLY_NAMES.index(check)]
        else:
            at = names.index(joint), NAMES.index(check)
            ends, nominal, arms = self.joints[..., at[0], at[1]], float(joints[at]), self.arms[:, at[0], at[1]]
        bars = []
        for source, order, low, high in zip(self.sources, self.order, *ends, strict=True):
            tolerance = getattr(self.evaluation.study.tolerances, source.quantity)
            if max(abs(low - nominal), abs(high - nominal)) > FELT * max(nominal, FELT):
                least, most = tolerance.edges
                share = variance_share(arms[order])
                bars.append(Bar(source, least, most, tolerance.absolute, float(low), float(high), share))
        return Tornado(joint, check, nominal, tuple(sorted(bars, key=lambda bar: (-bar.span, str(bar.source)))))

    def worst(self) -> tuple[Tornado, ...]:
        """The tornado of the binding check of every joint and of the supply, largest utilisation first."""
        places = [(name, result.binding) for name, result in self.evaluation.joints.items()]
        shared = [check for check in self.evaluation.shared if check.utilisation is not None]
        places.append((SUPPLY, max(shared, key=lambda check: check.utilisation or 0.0, default=None)))
        found = [(place, check) for place, check in places if check is not None and check.utilisation is not None]
        found.sort(key=lambda pair: -(pair[1].utilisation or 0.0))
        return tuple(self.of(place, check.name) for place, check in found)


def variance_share(values: Array) -> float:
    """First-order Sobol index of a quantity by which some values are sorted, without the bias of finite bins.

    ``values``: sorted by the quantity, (N,), in any unit.

    The index is between 0 and 1; NaN if the values do not vary or are not all finite.

    Reference:
        Sobol's first-order index; as a correlation ratio: pearson, Proc. R. Soc. 71 (1903) 288, its bias after Kelley,
        Proc. Natl. Acad. Sci. 21 (1935) 554.
    """
    if not np.isfinite(values).all():
        return math.nan
    total = float(((values - values.mean()) ** 2).sum())
    if not total > len(values) * (FELT * max(float(np.abs(values).max()), FELT)) ** 2:
        return math.nan
    bins = min(BINS, len(values) // 2)
    within = sum(float(((part - part.mean()) ** 2).sum()) for part in np.array_split(values, bins))
    return min(max(1.0 - within / (len(values) - bins) * (len(values) - 1) / total, 0.0), 1.0)


def effects(evaluation: Evaluation) -> Effects:
    """Effect of each uncertain quantity on every check."""
    study, found = evaluation.study, sources(evaluation.study)
    count = 2 * len(found)
    deviations = {}
    for i, source in enumerate(found):
        values = np.zeros(count)
        values[i], values[len(found) + i] = getattr(study.tolerances, source.quantity).edges
        deviations[source] = values
    ready, n = candidate(nominal_of(study), drives_of(evaluation)), len(study.joints)
    joints, supply = _figures(ready, deviated(study, count, deviations))
    uniform = np.random.default_rng(study.tolerances.seed).random((ARMS, len(found)))  # the first samples of ``drawn``
    shape = (2, len(found))
    return Effects(
        evaluation, found, joints.reshape(*shape, n, len(NAMES)), supply.reshape(*shape, len(SUPPLY_NAMES)),
        np.argsort(uniform, axis=0, kind="stable").T, *_figures(ready, from_uniform(study, uniform)),
    )  # fmt: skip


def _figures(ready: Candidate, draws: Draws) -> tuple[Array, Array]:
    """Utilisations of all samples, (S, n, CHECKS) and (S, 3)."""
    parts = list(judged(ready, draws))
    nothing = [np.zeros((0, len(ready.study.joints), len(NAMES)))], [np.zeros((0, len(SUPPLY_NAMES)))]
    return (
        np.concatenate([part.joints for part in parts] or nothing[0]),
        np.concatenate([part.supply for part in parts] or nothing[1]),
    )
