"""Warnings about recordings that contradict the model: signs, units, order of columns, offsets, delays."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.coupling import shaft_turns
from drivetrain.arrays import Array, Mask
from drivetrain.identification.least_squares import correlated_covariance

if TYPE_CHECKING:
    import pandas as pd

MOST_CONDITION = 100.0  # above it the motion excites the parameters too little
LITTLE = 0.5  # error over torque on held-out data above which a joint is hardly explained
IMPOSSIBLE = 1.2  # ratio of the errors of consistent and of unrestricted parameters
SATURATED = 0.05  # share of samples at the largest or smallest torque
SURE = 5.0  # standard deviations from zero
COUNTS = 0.02  # least share of a joint's torque that a missing effect, or a change in the recording, must have
SLOW = 0.1  # share of the highest speed over which friction may fall or rise
PARTS = 8  # of the recording that are compared
APART = 3.0  # ratio of the errors of one model for all parts and of one for each; 1.25 for a measured robot
DISTINCT = 0.01  # least share of a column that the base parameters do not have


class Evidence(NamedTuple):
    """What an identification knows of a recording."""

    arm: Arm
    time: Array  # [s], (N,)
    measured: Array  # torque at the joints [N m or N], (N, n)
    modelled: Array  # torque by the identified model [N m or N], (N, n)
    laws: Array  # torque at the shafts of unit viscous, Coulomb and load-dependent friction, (3, N, n)
    used: Mask  # (N, n)
    moves: Mask  # which shafts move, (n,)
    spread: Array  # by which the residuals are divided [N m or N], (n,)
    left: Array  # residuals of the identified model, (N, n)
    free: Array  # those of parameters that need not be physically consistent
    base: Array  # regressor of the base parameters, (N, n, r)
    condition: float  # of that regressor
    errors: pd.DataFrame  # on held-out data


def warnings(found: Evidence) -> list[str]:
    """Warnings, as notes that begin with "warning:"."""
    names, lines = found.arm.joint_names, []
    lines += [f"{name} does not move: nothing is known of its friction" for name in _of(names, ~found.moves)]
    if found.condition > MOST_CONDITION:
        lines.append("the motion excites the parameters too little: exciting_motion proposes a better one")
    constant = np.ptp(found.measured, axis=0) == 0.0
    lines += [f"the torque of {name} does not change" for name in _of(names, constant)]
    ends = [np.mean(found.measured == end(found.measured, axis=0), axis=0) for end in (np.min, np.max)]
    limited = np.where(constant, 0.0, np.maximum(*ends))
    lines += [
        f"the torque of {name} has one extreme value in {100.0 * share:.2g} % of the samples: is it limited?"
        for name, share in zip(names, limited, strict=True) if share > SATURATED
    ]  # fmt: skip
    ratio = found.errors["identified"] / found.errors["measured"].where(found.errors["measured"] > 0.0)
    lines += [
        f"the model explains little of the torque of {name}: errors of {100.0 * share:.3g} % on data held out"
        for name, share in ratio.items() if share > LITTLE
    ]  # fmt: skip
    errors = [np.sqrt(np.sum(values**2, axis=0)) for values in (found.left, found.free)]
    wrong = _of(names, errors[0] > IMPOSSIBLE * errors[1])
    if wrong:
        lines.append(
            f"only impossible parameters, such as negative masses or friction, would explain the torques of "
            f"{', '.join(wrong)}: check signs, units, and the order of the columns"
        )
    if _changes(found):
        lines.append(
            "the parts of the recording contradict each other: did the payload, the friction or a signal change in it?"
        )
    return [f"warning: {line}" for line in (*lines, *_missing(found))]


def _of(names: tuple[str, ...], which: Mask) -> list[str]:
    return [name for name, one in zip(names, which, strict=True) if one]


def _changes(found: Evidence) -> bool:
    """Whether models of the parts of the recording, one for each, explain it much better than one for all of it."""
    samples, free = len(found.left), found.base.shape[2]
    ends = np.linspace(0, samples, PARTS + 1).astype(int)
    if min(found.used[first:last].sum() for first, last in pairwise(ends)) < 3 * free:
        return False

    def variance(first: int, last: int) -> float:
        rows, left = found.base[first:last].reshape(-1, free), found.left[first:last].ravel()
        errors = left - rows @ np.linalg.lstsq(rows, left)[0]
        return float(errors @ errors) / float(found.used[first:last].sum() - free)

    # A change in a part leaves large errors there.
    usual = np.median([variance(*both) for both in pairwise(ends.tolist())])
    torque = np.sum((found.measured * found.used / found.spread) ** 2) / found.used.sum()
    return bool(variance(0, samples) > max(APART**2 * usual, COUNTS**2 * torque))


def _missing(found: Evidence) -> list[str]:
    """Effects that the model lacks."""
    names, n, turns, lines = found.arm.joint_names, found.arm.n, shaft_turns(found.arm), []
    speed, coulomb, load = found.laws
    slow = coulomb * np.exp(-np.abs(speed) / (SLOW * np.maximum(np.abs(speed).max(axis=0), 1e-300)))
    value, sure = _factors(found, np.broadcast_to(np.eye(n), (*found.left.shape, n)))
    if sure.any():
        units = ["N" if slides else "N m" for slides in found.arm.slides]
        parts = [f"{names[i]} {value[i]:.3g} {units[i]}" for i in np.flatnonzero(sure)]
        lines.append(
            f"constant torques that the model lacks ({', '.join(parts)}), or friction that differs by direction"
        )
    curved = "is not linear in its speed"
    less = "grows less with its load than the efficiencies of the study's gears say"
    for column, words in ((load, ("grows with its load", less)), (slow, (curved, curved))):
        value, sure = _factors(found, np.einsum("ti,ij->tji", column, turns))
        for sign, text in zip((1.0, -1.0), words, strict=True):
            joints = _of(names, sure & (sign * value > 0.0))
            if joints:
                lines.append(f"the friction of {', '.join(joints)} {text}")
    [late], [sure] = _factors(found, -np.gradient(found.modelled, found.time, axis=0)[:, :, None], least=0.0)
    if sure and abs(late) > 0.5 * np.median(np.diff(found.time)):
        lines.append(f"the torques are about {1e3 * abs(late):.2g} ms {'late' if late > 0.0 else 'early'}")
    return lines


def _factors(found: Evidence, columns: Array, least: float = COUNTS) -> tuple[Array, Mask]:
    """Factors of columns (N, n, k) beside the base parameters, (k,), and which surely have ``least`` of the torque."""
    rows = found.used / found.spread
    flat, base = (x.reshape(rows.size, -1) for x in (columns * rows[:, :, None], found.base))
    apart, left = (x - base @ np.linalg.lstsq(base, x)[0] for x in (flat, found.left.ravel()))
    size = np.linalg.norm(apart, axis=0)
    distinct = size > DISTINCT * np.linalg.norm(flat, axis=0)
    factor, sure = np.zeros(len(size)), np.zeros(len(size), bool)
    if distinct.any():
        apart = apart[:, distinct] / size[distinct]
        share = np.linalg.lstsq(apart, left)[0]
        rest = (left - apart @ share).reshape(rows.shape)
        variance = np.diag(correlated_covariance(apart.reshape(*rows.shape, -1), rest, found.used))
        torque = (found.measured * rows).reshape(-1, 1) * (flat[:, distinct] != 0.0)
        sure[distinct] = np.abs(share) > np.maximum(SURE * np.sqrt(variance), least * np.linalg.norm(torque, axis=0))
        factor[distinct] = share / size[distinct]
    return factor, sure
