"""Rest-to-rest profiles of moves.

A move is a straight line in joint space: all joints share one path law s(t) from 0 to 1, so they start and stop
together. A law is a sequence of polynomials. Where its acceleration steps, the sampled motion has two samples at one
instant, so that integrals over the samples include both values.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from drivetrain.arrays import Array, checked_number
from drivetrain.errors import Fault, InputError, raise_faults

# s = 10 u^3 - 15 u^4 + 6 u^5: largest values of its derivatives over u in [0, 1].
QUINTIC_SPEED = 15.0 / 8.0  # at the middle
QUINTIC_ACCELERATION = 10.0 / math.sqrt(3.0)  # at u = (3 -+ sqrt 3)/6
QUINTIC_JERK = 60.0  # at both ends
SAMPLES_A_PIECE = 16  # at least, so that a short piece is still resolved


class PathLimits(NamedTuple):
    """Largest derivatives of s(t): speed [1/s], acceleration [1/s^2], jerk [1/s^3]; infinity means no limit."""

    speed: float
    acceleration: float
    jerk: float


@dataclass(frozen=True, eq=False)
class Law:
    """The path law s(t) of a move: from 0, at rest, to 1, at rest, as a piecewise polynomial."""

    knots: Array  # boundaries of the pieces [s], (p + 1,), from 0
    coefficients: Array  # by ascending powers of the time since the start of the piece, (p, 6)
    peak: PathLimits  # largest derivatives; the jerk is infinite if the acceleration steps

    @property
    def duration(self) -> float:
        """Length of the move [s]."""
        return float(self.knots[-1])

    def stretched(self, duration: float) -> Law:
        """The same law over another duration [s]; its derivatives scale with powers of the ratio of the durations."""
        slower = self.duration / duration
        powers = slower ** np.arange(6.0)
        peak = PathLimits(self.peak.speed * slower, self.peak.acceleration * slower**2, self.peak.jerk * slower**3)
        return Law(self.knots / slower, self.coefficients * powers, peak)

    def sampled(self, sample_time: float) -> Array:
        """Time [s], s and two derivatives of s, (N, 4), at most ``sample_time`` [s] apart; both ends of each piece."""
        smooth = math.isfinite(self.peak.jerk)
        blocks: list[Array] = []
        for start, end, row in zip(self.knots[:-1], self.knots[1:], self.coefficients, strict=True):
            count = max(math.ceil((end - start) / sample_time - 1e-9), SAMPLES_A_PIECE)
            since = np.linspace(0.0, end - start, count + 1)
            polynomial = np.polynomial.Polynomial(row)
            block = [start + since, polynomial(since), polynomial.deriv()(since), polynomial.deriv(2)(since)]
            blocks.append(np.stack(block, axis=1)[1 if smooth and blocks else 0 :])
        samples = np.concatenate(blocks)
        samples[0, 1:3], samples[-1, 0:3] = (0.0, 0.0), (self.duration, 1.0, 0.0)
        if smooth:
            samples[0, 3] = samples[-1, 3] = 0.0
        return samples


class Profile(Protocol):
    """A family of path laws, with one member for a given duration or given limits."""

    def over(self, duration: float) -> Law:
        """The law with this duration [s]; raises ``InputError`` if the profile's shares are out of range."""

    def fastest(self, limits: PathLimits) -> Law:
        """The fastest law within the limits; raises ``InputError`` if a limit is missing or cannot be satisfied."""


def _chain(lengths: list[float], accelerations: list[float], jerks: list[float], peak: PathLimits) -> Law:
    """The law whose pieces have these lengths [s], accelerations at their starts and constant jerks."""
    rows, knots = [], [0.0]
    place = speed = 0.0
    for length, acceleration, jerk in zip(lengths, accelerations, jerks, strict=True):
        if length <= 0.0:
            continue
        rows.append([place, speed, acceleration / 2.0, jerk / 6.0, 0.0, 0.0])
        place += length * (speed + length * (acceleration / 2.0 + length * jerk / 6.0))
        speed += length * (acceleration + length * jerk / 2.0)
        knots.append(knots[-1] + length)
    return Law(np.array(knots), np.array(rows), peak)


def _check_shares(shares: dict[str, float]) -> None:
    """Raise one ``InputError`` that lists all shares that are not above 0 and at most 0.5."""
    faults = []
    for name, share in shares.items():
        try:
            inside = checked_number(share, name, "-", above=0.0) <= 0.5
        except InputError:
            inside = False
        if not inside:
            faults.append(Fault("profile", f"{name} must be above 0 and at most 0.5", share))
    raise_faults(faults)


@dataclass(frozen=True)
class Trapezoid(Profile):
    """Constant acceleration, constant speed, constant deceleration; the acceleration has steps.

    Attributes:
        ramp_share: Share of the duration spent accelerating if only a duration is given, above 0 to 0.5; with the
            default of one third, the peak speed is 1.5 times the mean speed.
    """

    ramp_share: float = 1.0 / 3.0

    def over(self, duration: float) -> Law:
        _check_shares({"ramp share": self.ramp_share})
        ramp = self.ramp_share * duration
        return self._law(ramp, duration - 2.0 * ramp)

    def fastest(self, limits: PathLimits) -> Law:
        if math.isfinite(limits.jerk):
            hint = "take an s-curve, or leave the jerk limit out"
            raise InputError(Fault("profile", "a trapezoid cannot hold a jerk limit", None, hint))
        if not math.isfinite(limits.acceleration):
            raise InputError(Fault("profile", "a trapezoid needs an acceleration limit or a duration"))
        speed = min(limits.speed, math.sqrt(limits.acceleration))
        return self._law(speed / limits.acceleration, max(1.0 / speed - speed / limits.acceleration, 0.0))

    @staticmethod
    def _law(ramp: float, cruise: float) -> Law:
        speed = 1.0 / (ramp + cruise)
        acceleration = speed / ramp
        peak = PathLimits(speed, acceleration, math.inf)
        return _chain([ramp, cruise, ramp], [acceleration, 0.0, -acceleration], [0.0, 0.0, 0.0], peak)


@dataclass(frozen=True)
class Quintic(Profile):
    """One polynomial of degree five, with zero speed and acceleration at both ends."""

    def over(self, duration: float) -> Law:
        peak = PathLimits(QUINTIC_SPEED / duration, QUINTIC_ACCELERATION / duration**2, QUINTIC_JERK / duration**3)
        row = np.array([0.0, 0.0, 0.0, 10.0, -15.0, 6.0]) / duration ** np.arange(6.0)
        return Law(np.array([0.0, duration]), row[np.newaxis], peak)

    def fastest(self, limits: PathLimits) -> Law:
        needed = (
            QUINTIC_SPEED / limits.speed,
            math.sqrt(QUINTIC_ACCELERATION / limits.acceleration),
            math.cbrt(QUINTIC_JERK / limits.jerk),
        )
        if max(needed) <= 0.0:
            raise InputError(Fault("profile", "a quintic needs a limit or a duration"))
        return self.over(max(needed))


@dataclass(frozen=True)
class SCurve(Profile):
    """Seven pieces of constant jerk; the acceleration is continuous, with a constant part at its maximum.

    Attributes:
        ramp_share: Share of the duration spent accelerating if only a duration is given, above 0 to 0.5.
        jerk_share: Share of each ramp in which the acceleration grows, above 0 to 0.5 (0.5: no constant acceleration).
    """

    ramp_share: float = 1.0 / 3.0
    jerk_share: float = 1.0 / 3.0

    def over(self, duration: float) -> Law:
        _check_shares({"ramp share": self.ramp_share, "jerk share": self.jerk_share})
        ramp = self.ramp_share * duration
        return self._law(self.jerk_share * ramp, ramp, duration - 2.0 * ramp)

    def fastest(self, limits: PathLimits) -> Law:
        speed, acceleration, jerk = limits
        if not math.isfinite(jerk):
            hint = "without one the quickest profile is a trapezoid"
            raise InputError(Fault("profile", "an s-curve needs a jerk limit or a duration", None, hint))
        # Largest speed and acceleration at this jerk over this distance: replaces infinite limits, which the formulas
        # below could not use.
        shortest_rise = math.cbrt(0.5 / jerk)
        speed, acceleration = min(speed, jerk * shortest_rise**2), min(acceleration, jerk * shortest_rise)
        if speed * jerk >= acceleration**2:
            rise, ramp = acceleration / jerk, acceleration / jerk + speed / acceleration
        else:  # the speed limit is reached before the acceleration limit
            rise = math.sqrt(speed / jerk)
            ramp = 2.0 * rise
        if speed * ramp <= 1.0:
            return self._law(rise, ramp, 1.0 / speed - ramp)
        # The speed limit is not reached: two ramps of half the distance each, with or without constant acceleration.
        rise = acceleration / jerk
        flat_top = rise / 2.0 + math.sqrt(rise**2 / 4.0 + 1.0 / (rise * jerk))
        return self._law(rise, max(flat_top, 2.0 * rise), 0.0)

    @staticmethod
    def _law(rise: float, ramp: float, cruise: float) -> Law:
        speed = 1.0 / (ramp + cruise)
        top = speed / (ramp - rise)
        jerk = top / rise
        lengths = [rise, ramp - 2.0 * rise, rise, cruise, rise, ramp - 2.0 * rise, rise]
        starts = [0.0, top, top, 0.0, 0.0, -top, -top]
        return _chain(lengths, starts, [jerk, 0.0, -jerk, 0.0, -jerk, 0.0, jerk], PathLimits(speed, top, jerk))


PROFILES: dict[str, Profile] = {"trapezoid": Trapezoid(), "quintic": Quintic(), "s_curve": SCurve()}
