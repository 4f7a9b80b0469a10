"""Which couplings of an arm URDF has words for: one shaft on its joint, and ros_control's two kinds of two on two."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.coupling import coupled_groups
from drivetrain.arm.files.drives import DIFFERENTIAL, FOUR_BAR
from drivetrain.arrays import Array

SAME = 1e-12  # on products of printed numbers


@dataclass(frozen=True, eq=False)
class Pair:
    """Two joints whose motors work together."""

    kind: str  # ros_control's name for the transmission
    joints: tuple[int, int]  # indices in the order of ros_control's roles, which is that of the motors too
    reductions: tuple[float, float]  # of the joints [-]
    # by which the gears' ratios are multiplied, so that the motors turn as they do in the arm [-]
    factors: tuple[float, float]


@dataclass(frozen=True, eq=False)
class WrittenCouplings:
    """An arm's coupling as far as URDF can say it."""

    pairs: tuple[Pair, ...]  # of two motors and two joints each
    factors: Array  # by which each gear's ratio is multiplied [-], (n,)
    lost: tuple[tuple[int, ...], ...]  # groups of joints whose coupling URDF has no words for


def written_couplings(arm: Arm) -> WrittenCouplings:
    """The coupling of an arm in the words of URDF."""
    pairs, lost = [], []
    factors = np.ones(arm.n)
    for group in coupled_groups(arm):
        found = None if arm.coupling is None or len(group) > 2 else _said(arm.coupling, group)
        # A direct drive has no ratio to take a factor.
        direct = found and any(arm.rotors[i] is None and f != 1.0 for i, f in zip(group, found[1], strict=True))
        if found is None or direct:
            lost.append(group)
            continue
        factors[list(group)] = found[1]
        pairs += [] if found[0] is None else [found[0]]
    return WrittenCouplings(tuple(pairs), factors, tuple(lost))


def _said(coupling: Array, group: tuple[int, ...]) -> tuple[Pair | None, tuple[float, ...]] | None:
    """The pair, if it is one, and the factors of the group's ratios; None where there are no words."""
    if len(group) == 1:
        return None, (float(coupling[group[0], group[0]]),)
    for joints in (group, group[::-1]):
        pair = _pair(coupling[np.ix_(joints, joints)], (joints[0], joints[1]))
        if pair is not None:
            return pair, pair.factors if joints == group else pair.factors[::-1]
    return None


def _pair(matrix: Array, joints: tuple[int, int]) -> Pair | None:
    (a, b), (c, d) = matrix.tolist()
    if a and b and abs(a * d + b * c) <= SAME * abs(a * d):
        return Pair(DIFFERENTIAL, joints, (a, b), (1.0, c / a))
    if a and c and d and not b:
        return Pair(FOUR_BAR, joints, (a, d / c), (1.0, c))
    return None
