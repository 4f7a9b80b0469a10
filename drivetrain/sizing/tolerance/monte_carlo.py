"""With what probability a set of drives is feasible, when parts, payload and ambient lie within their tolerances."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError
from drivetrain.sizing.results import Evaluation
from drivetrain.sizing.tolerance.draws import Pair, sources, streamed
from drivetrain.sizing.tolerance.sampling import NAMES, SUPPLY_NAMES, Samples, candidate, judged, nominal_of

SUPPLY = "supply"
QUANTILES = (0.05, 0.5, 0.95)
REMEMBERED = 4096  # arms whose utilisations make the quantiles
BATCH = 65536  # arms whose numbers are drawn at once
NORMAL_95 = 1.959963984540054


@dataclass(frozen=True)
class Chance:
    """A probability as counted over independent samples."""

    held: int  # in how many samples it held
    samples: int  # of how many

    @property
    def probability(self) -> float:
        """Share of the samples."""
        return self.held / self.samples

    @property
    def standard_error(self) -> float:
        """Of the probability; from the middle of Wilson's interval, so that 0 or all samples have one too."""
        low, high = self.interval
        return (high - low) / (2.0 * NORMAL_95)

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's interval of 95 % confidence, good also near 0 and 1.

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
    """How well a set of drives stands the scatter of its numbers."""

    evaluation: Evaluation  # with nominal numbers
    samples: int  # how many arms were drawn
    seed: int  # of the random numbers
    scattering: tuple[str, ...]  # what scattered, in words
    checks: dict[str, dict[str, Chance]]  # of every judged check, by joint (or ``supply``) and name
    joints: dict[str, Chance]  # that every check of a joint holds, by name; the supply's last
    whole: Chance  # that everything holds at once
    # quantiles (5 %, 50 %, 95 %) of each check's utilisation, by joint and name
    utilisations: dict[str, dict[str, tuple[float, ...]]]


def drives_of(evaluation: Evaluation) -> dict[str, Pair]:
    """The drives that were evaluated.

    Keys of (motor, gear) by joint name.
    """
    return {name: (result.motor, result.gear) for name, result in evaluation.joints.items()}


def robustness(
    evaluation: Evaluation, *, samples: int | None = None, seed: int | None = None, threads: int = 1
) -> Robustness:
    """The probability that each check, each joint and the whole set of drives holds.

    Arms are drawn at random within the study's tolerances, every one judged by the checks of ``evaluate`` on its own
    numbers. Checks that could not be made count for nothing, as there.

    Args:
        evaluation: Of the drives with nominal numbers; its study states the tolerances.
        samples: How many arms; None: the study's own number.
        seed: Of the random numbers; None: the study's own.
        threads: How many share the work; no number depends on it.

    Returns:
        The probabilities with their errors.

    Raises:
        InputError: The study states no tolerance, or no samples are asked for.
    """
    study = evaluation.study
    count = study.tolerances.samples if samples is None else samples
    start = study.tolerances.seed if seed is None else seed
    if not study.tolerances.given:
        hint = "such as {torque_constant: 5 %, friction: 30 %}"
        raise InputError(Fault("tolerances", "the study states none, so nothing scatters", hint=hint))
    if count < 1:
        raise InputError(Fault("samples", "must be at least 1", count))
    ready = candidate(nominal_of(study), drives_of(evaluation))
    tally, kept, kept_supply = _Tally(len(study.joints)), [], []
    remembered = 0
    for draws in streamed(study, count, start, most=BATCH):
        for found in judged(ready, draws, threads=threads):
            tally.add(found)
            if remembered < REMEMBERED:
                kept.append(found.joints)
                kept_supply.append(found.supply)
                remembered += len(found.joints)
    names = [task.name for task in study.joints]
    return _result(evaluation, (count, start), names, tally, np.concatenate(kept), np.concatenate(kept_supply))


class _Tally:
    """How often what failed."""

    def __init__(self, joints: int) -> None:
        self.checks = np.zeros((joints, len(NAMES)), dtype=np.int64)
        self.joints = np.zeros(joints, dtype=np.int64)
        self.supply = np.zeros(len(SUPPLY_NAMES), dtype=np.int64)
        self.supply_any = 0
        self.held = 0

    def add(self, found: Samples) -> None:
        """Counts some more arms."""
        joints, supply, held = found.joints > 1.0, found.supply > 1.0, found.feasible
        self.checks += joints.sum(axis=0)
        self.joints += joints.any(axis=2).sum(axis=0)
        self.supply += supply.sum(axis=0)
        self.supply_any += int(supply.any(axis=1).sum())
        self.held += int(held.sum())


def _result(
    evaluation: Evaluation, run: tuple[int, int], names: list[str], tally: _Tally, joints: Array, supply: Array
) -> Robustness:
    samples, seed = run

    def chances(made: Array, failed: list[int], labels: tuple[str, ...]) -> dict[str, Chance]:
        """Of the checks that were made."""
        return {
            name: Chance(samples - failed[i], samples)
            for i, name in enumerate(labels) if not np.isnan(made[:, i]).all()
        }  # fmt: skip

    checks = {name: chances(joints[:, i], tally.checks[i].tolist(), NAMES) for i, name in enumerate(names)}
    spread = {name: _quantiles(joints[:, i], NAMES) for i, name in enumerate(names)}
    whole = {name: Chance(samples - int(tally.joints[i]), samples) for i, name in enumerate(names)}
    powered = chances(supply, tally.supply.tolist(), SUPPLY_NAMES)
    if powered:
        checks[SUPPLY], spread[SUPPLY] = powered, _quantiles(supply, SUPPLY_NAMES)
        whole[SUPPLY] = Chance(samples - tally.supply_any, samples)
    words = tuple(dict.fromkeys(one.quantity.replace("_", " ") for one in sources(evaluation.study)))
    return Robustness(evaluation, samples, seed, words, checks, whole, Chance(tally.held, samples), spread)


def _quantiles(values: Array, labels: tuple[str, ...]) -> dict[str, tuple[float, ...]]:
    return {
        name: tuple(float(q) for q in np.quantile(values[:REMEMBERED, i], QUANTILES, method="inverted_cdf"))
        for i, name in enumerate(labels) if not np.isnan(values[:, i]).all()
    }  # fmt: skip
