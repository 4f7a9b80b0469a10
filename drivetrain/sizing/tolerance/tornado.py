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
from drivetrain.sizing.results import Evaluation, most_used
from drivetrain.sizing.tolerance.draws import Draws, Source, deviated, from_uniform, sources
from drivetrain.sizing.tolerance.sampling import (
    NAMES,
    SHARED,
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

    joint: str  # name of the joint, or ``supply``, ``arm``
    check: str  # name of the check
    nominal: float  # utilisation with nominal values
    bars: tuple[Bar, ...]  # widest first; quantities without effect are left out


@dataclass(frozen=True, eq=False)
class Effects:
    """Utilisations of all checks with each quantity alone at both of its ends, and of random samples."""

    evaluation: Evaluation  # with nominal values
    sources: tuple[Source, ...]  # uncertain quantities
    # utilisations at the low and at the high end, by joint, ``supply`` and ``arm``, (2, sources, checks)
    ends: dict[str, Array]
    order: NDArray[np.int64]  # random samples sorted by the value of each source, (sources, samples)
    arms: dict[str, Array]  # utilisations of the random samples, by the same places, (samples, checks)

    def of(self, joint: str, check: str) -> Tornado:
        """The tornado of one check."""
        [joint] = whole_names("joint", "joint of the study", [joint], list(self.ends))
        labels = SHARED.get(joint, NAMES)
        [check] = whole_names("check", "check of it", [check], labels)
        at = labels.index(check)
        nominal = float(_by_place(self.evaluation, *figures_of(self.evaluation))[joint][at])
        ends, arms = self.ends[joint][..., at], self.arms[joint][:, at]
        bars = []
        for source, order, low, high in zip(self.sources, self.order, *ends, strict=True):
            tolerance = getattr(self.evaluation.study.tolerances, source.quantity)
            if np.ptp([low, nominal, high]) > FELT * max(nominal, FELT):
                least, most = tolerance.edges
                share = variance_share(arms[order])
                bars.append(Bar(source, least, most, tolerance.absolute, float(low), float(high), share))
        return Tornado(joint, check, nominal, tuple(sorted(bars, key=lambda bar: (-bar.span, str(bar.source)))))

    def worst(self) -> tuple[Tornado, ...]:
        """The tornado of the binding check of every joint, of the supply and of the arm, largest utilisation first."""
        places = [(name, result.binding) for name, result in self.evaluation.joints.items()]
        for place, names in SHARED.items():
            places.append((place, most_used(check for check in self.evaluation.shared if check.name in names)))
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
    ready = candidate(nominal_of(study), evaluation.drives)
    ends = _figures(ready, deviated(study, count, deviations))
    uniform = np.random.default_rng(study.tolerances.seed).random((ARMS, len(found)))  # the first samples of ``drawn``
    return Effects(
        evaluation, found, {place: used.reshape(2, len(found), used.shape[1]) for place, used in ends.items()},
        np.argsort(uniform, axis=0, kind="stable").T, _figures(ready, from_uniform(study, uniform)),
    )  # fmt: skip


def _figures(ready: Candidate, draws: Draws) -> dict[str, Array]:
    """Utilisations of all samples by joint, ``supply`` and ``arm``, (S, checks)."""
    parts = list(judged(ready, draws))
    joints = np.concatenate([part.joints for part in parts] or [np.zeros((0, len(ready.study.joints), len(NAMES)))])
    shared = [
        np.concatenate([getattr(part, place) for part in parts] or [np.zeros((0, len(names)))])
        for place, names in SHARED.items()
    ]
    return _by_place(ready.nominal, np.swapaxes(joints, 0, 1), *shared)


def _by_place(evaluation: Evaluation, joints: Array, *shared: Array) -> dict[str, Array]:
    """Rows of joints and the figures of supply and arm, by their names."""
    return dict(zip([*evaluation.joints, *SHARED], [*joints, *shared], strict=True))
