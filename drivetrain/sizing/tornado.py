"""What each tolerance alone does to a check: the bars of a tornado."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetrain.arrays import Array
from drivetrain.sizing.many_arms import SUPPLY_NAMES, figures_of, judged
from drivetrain.sizing.results import Evaluation
from drivetrain.sizing.scatter import Source, deviated, sources
from drivetrain.sizing.scatter_task import bench
from drivetrain.sizing.scatter_numbers import NAMES
from drivetrain.sizing.uncertainty import SUPPLY, drives_of

FELT = 1e-9  # of a utilisation: a smaller change is none


@dataclass(frozen=True)
class Bar:
    """What one number that scatters does to a check, all others nominal.

    Attributes:
        source: What scatters.
        low, high: Deviations at the ends: the limits of a uniform law, twice the standard deviation of a normal one; a
            share of the nominal value, or in kg or K.
        absolute: The deviations are in kg or K.
        at_low, at_high: Utilisation with each.
    """

    source: Source
    low: float
    high: float
    absolute: bool
    at_low: float
    at_high: float

    @property
    def span(self) -> float:
        """How far the utilisation moves between both ends."""
        return abs(self.at_high - self.at_low)


@dataclass(frozen=True)
class Tornado:
    """What each tolerance alone does to one check.

    Attributes:
        joint: Name, or ``supply``.
        check: Its name.
        nominal: Utilisation with nominal numbers.
        bars: Widest first; what does nothing is left out.
    """

    joint: str
    check: str
    nominal: float
    bars: tuple[Bar, ...]


@dataclass(frozen=True, eq=False)
class Effects:
    """Every check with each tolerance alone at both of its ends.

    Attributes:
        evaluation: With nominal numbers.
        sources: What scatters.
        joints: Utilisations at the low and at the high end, (2, sources, n, CHECKS).
        supply: Of the supply, (2, sources, 3).
    """

    evaluation: Evaluation
    sources: tuple[Source, ...]
    joints: Array
    supply: Array

    def of(self, joint: str, check: str) -> Tornado:
        """The tornado of one check.

        Args:
            joint: Name, or ``supply``.
            check: Its name.

        Returns:
            The bars; none where the check is not made.
        """
        joints, supply = figures_of(self.evaluation)
        names = list(self.evaluation.joints)
        if joint == SUPPLY:
            ends, nominal = self.supply[..., SUPPLY_NAMES.index(check)], float(supply[SUPPLY_NAMES.index(check)])
        else:
            at = names.index(joint), NAMES.index(check)
            ends, nominal = self.joints[..., at[0], at[1]], float(joints[at])
        bars = []
        for source, low, high in zip(self.sources, *ends, strict=True):
            tolerance = getattr(self.evaluation.study.tolerances, source.quantity)
            if max(abs(low - nominal), abs(high - nominal)) > FELT * max(nominal, FELT):
                least, most = tolerance.edges
                bars.append(Bar(source, least, most, tolerance.absolute, float(low), float(high)))
        return Tornado(joint, check, nominal, tuple(sorted(bars, key=lambda bar: (-bar.span, str(bar.source)))))

    def worst(self) -> tuple[Tornado, ...]:
        """The tornado of the binding check of every joint and of the supply, most loaded first.

        Returns:
            One each, where something was judged.
        """
        places = [(name, result.binding) for name, result in self.evaluation.joints.items()]
        shared = [check for check in self.evaluation.shared if check.utilisation is not None]
        places.append((SUPPLY, max(shared, key=lambda check: check.utilisation or 0.0, default=None)))
        found = [(place, check) for place, check in places if check is not None and check.utilisation is not None]
        found.sort(key=lambda pair: -(pair[1].utilisation or 0.0))
        return tuple(self.of(place, check.name) for place, check in found)


def effects(evaluation: Evaluation) -> Effects:
    """What each tolerance alone does to every check.

    Args:
        evaluation: Of the drives with nominal numbers; its study states the tolerances.

    Returns:
        Utilisations at both ends of each.
    """
    study, found = evaluation.study, sources(evaluation.study)
    count = 2 * len(found)
    deviations = {}
    for i, source in enumerate(found):
        values = np.zeros(count)
        values[i], values[len(found) + i] = getattr(study.tolerances, source.quantity).edges
        deviations[source] = values
    parts = list(judged(bench(study, drives_of(evaluation)), deviated(study, count, deviations)))
    n = len(study.joints)
    joints = np.concatenate([part.joints for part in parts]) if parts else np.zeros((0, n, len(NAMES)))
    supply = np.concatenate([part.supply for part in parts]) if parts else np.zeros((0, len(SUPPLY_NAMES)))
    shape = (2, len(found))
    return Effects(evaluation, found, joints.reshape(*shape, n, len(NAMES)), supply.reshape(*shape, len(SUPPLY_NAMES)))
