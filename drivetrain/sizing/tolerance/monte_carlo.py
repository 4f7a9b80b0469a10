"""Monte Carlo estimate of the probability that a set of drives is feasible within the tolerances of the study."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from drivetrain.arrays import Array
from drivetrain.errors import Fault, raise_faults
from drivetrain.notebook import shown
from drivetrain.sizing.results import Evaluation
from drivetrain.sizing.tolerance.draws import check_seed, sources, streamed
from drivetrain.sizing.tolerance.sampling import NAMES, SHARED, Samples, candidate, judged, nominal_of, undrawn

if TYPE_CHECKING:
    import pandas as pd

QUANTILES = (0.05, 0.5, 0.95)
REMEMBERED = 4096  # samples from which the quantiles are computed
BATCH = 65536  # samples drawn at once
NORMAL_95 = 1.959963984540054


@dataclass(frozen=True)
class Chance:
    """A probability estimated from independent samples."""

    held: int  # number of samples in which the checks were satisfied
    samples: int  # number of samples

    @property
    def probability(self) -> float:
        """Share of the samples."""
        return self.held / self.samples

    @property
    def standard_error(self) -> float:
        """Standard error of the probability, from Wilson's interval, so that it is not 0 at probability 0 or 1."""
        low, high = self.interval
        return (high - low) / (2.0 * NORMAL_95)

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson score interval of 95 % confidence, valid also near 0 and 1.

        Reference:
            Wilson, J. Am. Stat. Assoc. 22 (1927) 209.
        """
        n, p, z = self.samples, self.probability, NORMAL_95
        middle = (p + z * z / (2 * n)) / (1 + z * z / n)
        half = z / (1 + z * z / n) * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
        low = 0.0 if self.held == 0 else max(middle - half, 0.0)
        return low, 1.0 if self.held == n else min(middle + half, 1.0)


@dataclass(frozen=True, eq=False)
class Robustness:
    """Probability of feasibility of a set of drives, by check, by joint and in total."""

    evaluation: Evaluation  # with nominal values
    samples: int  # number of samples
    seed: int  # seed of the random numbers
    scattering: tuple[str, ...]  # uncertain quantities, as text
    # probability that each check is satisfied, by joint (or ``supply``, ``arm``) and name
    checks: dict[str, dict[str, Chance]]
    joints: dict[str, Chance]  # probability that all checks of a joint are satisfied, by name; supply and arm last
    whole: Chance  # probability that all checks are satisfied
    # quantiles (5 %, 50 %, 95 %) of each check's utilisation, by joint and name
    utilisations: dict[str, dict[str, tuple[float, ...]]]

    def __repr__(self) -> str:
        share = f"{100.0 * self.whole.probability:.4g} ± {100.0 * self.whole.standard_error:.2g} %"
        nominal = "".join(f", {check.name} with nominal values" for check in undrawn(self.evaluation))
        return (
            f"Robustness({self.evaluation.study.name}: all checks satisfied in {share} of {self.samples} samples"
            f"{nominal})"
        )

    @property
    def table(self) -> pd.DataFrame:
        """Probability of each check, one a row, with its standard error and the quantiles of the utilisation."""
        import pandas as pd

        rows = [
            (place, name, chance.probability, chance.standard_error, *self.utilisations[place][name])
            for place, checks in self.checks.items()
            for name, chance in checks.items()
        ]
        quantiles = [f"utilisation {100.0 * one:g} %" for one in QUANTILES]
        return pd.DataFrame(rows, columns=["joint", "check", "probability", "standard error", *quantiles])

    def _repr_html_(self) -> str:
        return shown(repr(self), self.table.sort_values("probability", kind="stable"))


def robustness(
    evaluation: Evaluation, *, samples: int | None = None, seed: int | None = None, threads: int = 1
) -> Robustness:
    """Probability that each check, each joint and the whole set of drives is satisfied, by Monte Carlo.

    Samples are drawn within the study's tolerances, and the checks of ``evaluate`` are applied to each. Checks that
    can be made in no sample are ignored. In a sample in which missing data decide over a check, as ``evaluate`` calls
    NOT CHECKED, it is not satisfied. The stiffness of the whole arm is checked with the payloads of each sample and
    else nominal values, its stops with nominal values alone: where a stop fails, the whole set holds in no sample.

    Args:
        evaluation: Evaluation of the drives with nominal values; its study states the tolerances.
        samples: Number of samples; None: that of the study.
        seed: Seed of the random numbers; None: that of the study.
        threads: Number of threads; the result does not depend on it.

    Returns:
        The probabilities with their errors.

    Raises:
        InputError: The study states no tolerance, the number of samples is below 1, or the seed is negative.
    """
    study = evaluation.study
    count = study.tolerances.samples if samples is None else samples
    start = study.tolerances.seed if seed is None else seed
    faults = check_seed(start)
    if not study.tolerances.given:
        hint = "such as {torque_constant: 5 %, friction: 30 %}"
        faults.append(Fault("tolerances", "the study states none, so nothing scatters", hint=hint))
    if count < 1:
        faults.append(Fault("samples", "must be at least 1", count))
    raise_faults(faults)
    ready = candidate(nominal_of(study), evaluation.drives)
    tally, remembered = _Tally(len(study.joints)), 0
    kept: dict[str, list[Array]] = {place: [] for place in ("joints", *SHARED)}
    for draws in streamed(study, count, start, most=BATCH):
        for found in judged(ready, draws, threads=threads):
            tally.add(found)
            if remembered < REMEMBERED:
                for place, parts in kept.items():
                    parts.append(getattr(found, place))
                remembered += len(found.joints)
    used = {place: np.concatenate(parts) for place, parts in kept.items()}
    return _result(evaluation, (count, start), tally, used)


class _Tally:
    """Counts how often each check, each joint, the supply and the arm failed or, in some samples, could not be made."""

    def __init__(self, joints: int) -> None:
        self.checks = np.zeros((joints, len(NAMES)), dtype=np.int64)
        self.shared = {place: np.zeros(len(names), dtype=np.int64) for place, names in SHARED.items()}
        self.places = np.zeros(joints + len(SHARED), dtype=np.int64)
        self.held = 0

    def add(self, found: Samples) -> None:
        self.checks += (~(found.joints <= 1.0)).sum(axis=0)
        for place, count in self.shared.items():
            count += (~(getattr(found, place) <= 1.0)).sum(axis=0)
        self.places += found.failed.sum(axis=0)
        self.held += int(found.feasible.sum())


def _result(evaluation: Evaluation, run: tuple[int, int], tally: _Tally, used: dict[str, Array]) -> Robustness:
    (samples, seed), names = run, evaluation.study.joint_names
    tables = {name: (used["joints"][:, i], tally.checks[i], NAMES) for i, name in enumerate(names)}
    tables |= {place: (used[place], tally.shared[place], labels) for place, labels in SHARED.items()}
    checks, spread, whole = {}, {}, {}
    for (place, (made, failed, labels)), count in zip(tables.items(), tally.places.tolist(), strict=True):
        if place in names or not np.isnan(made).all():
            checks[place] = {
                name: Chance(samples - int(failed[i]), samples)
                for i, name in enumerate(labels) if not np.isnan(made[:, i]).all()
            }  # fmt: skip
            spread[place] = _quantiles(made, labels)
            whole[place] = Chance(samples - count, samples)
    words = tuple(dict.fromkeys(one.quantity.replace("_", " ") for one in sources(evaluation.study)))
    return Robustness(evaluation, samples, seed, words, checks, whole, Chance(tally.held, samples), spread)


def _quantiles(values: Array, labels: tuple[str, ...]) -> dict[str, tuple[float, ...]]:
    return {
        name: tuple(float(q) for q in np.quantile(values[:REMEMBERED, i], QUANTILES, method="inverted_cdf"))
        for i, name in enumerate(labels) if not np.isnan(values[:, i]).all()
    }  # fmt: skip
