"""Speeds and accelerations from positions: three ways, and the choice between them.

Differencing twice multiplies noise by 1/dt^2: a 12-bit encoder at 1 kHz reads some hundred rad/s^2 at rest. So data
of coarse resolution are first smoothed by as much as that resolution explains and no more (discrepancy principle).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError

if TYPE_CHECKING:  # half a second that only studies with a recorded motion need: imported where it is used
    from scipy.interpolate import BSpline
    from scipy.sparse import csr_array

UNIFORM = 0.01  # largest deviation of a time step from the median that still counts as uniform, as a share
NOISE_OF_RESOLUTION = 1.0 / math.sqrt(12.0)  # standard deviation of rounding, in steps
RESOLUTION_COUNTS = 0.01  # share of the RMS acceleration that rounding may cause before it is smoothed
EXPLAINED = 2.0  # times the noise of rounding: an estimate up to there is that same noise
NOISE_COUNTS = 0.03  # the same for noise estimated from the samples themselves, which is less certain
SECOND_DIFFERENCE = math.sqrt(6.0)  # amplification of independent noise by 1, -2, 1
DIFFERENCE_NOISE = {6: math.sqrt(924.0), 8: math.sqrt(12870.0)}  # and by higher ones: root of binomial(2 k, k)
WHITE = 0.7  # estimates from both must agree at least so well; those of a coarsely sampled wave do not
MEDIAN_TO_DEVIATION = 1.0 / 0.6745  # of the absolute value of a normal variable
FEWEST_SAMPLES = 6  # a quintic through fewer is not defined
DEGREE = 5
LEAST_PENALTY, MOST_PENALTY = -8.0, 14.0  # powers of ten, over squared third differences of the spline's weights
BISECTIONS = 30  # to 2e-8 of that range


class Derivatives(NamedTuple):
    """First and second derivative at the samples, each (N,)."""

    first: Array
    second: Array


class Smoothing(Protocol):
    """A way to differentiate samples."""

    def derivatives(self, time: Array, values: Array) -> Derivatives:
        """First and second derivative at the samples.

        Args:
            time: Increasing [s], (N,).
            values: Any unit, (N,).

        Returns:
            Both derivatives.
        """

    @property
    def description(self) -> str:
        """What was done, for the report."""


@dataclass(frozen=True)
class Parabolas:
    """The parabola through each sample and its two neighbours: no smoothing, and no ringing at corners."""

    def derivatives(self, time: Array, values: Array) -> Derivatives:
        """Slope and curvature of the parabolas.

        Args:
            time: Increasing [s], (N,), N >= 3.
            values: Any unit, (N,).

        Returns:
            Both derivatives; the end samples share the parabola of their neighbour.

        Raises:
            InputError: Fewer than three samples.
        """
        _check_count(time, 3)
        step = np.diff(time)
        slope = np.diff(values) / step
        both = step[:-1] + step[1:]
        inner = 2.0 * np.diff(slope) / both
        second = np.concatenate([inner[:1], inner, inner[-1:]])
        first = np.empty_like(second)
        first[1:-1] = (step[1:] * slope[:-1] + step[:-1] * slope[1:]) / both
        first[0] = slope[0] - 0.5 * step[0] * second[0]
        first[-1] = slope[-1] + 0.5 * step[-1] * second[-1]
        return Derivatives(first, second)

    @property
    def description(self) -> str:
        """What was done, for the report."""
        return "parabolas through three neighbouring samples, no smoothing"


@dataclass(frozen=True)
class SmoothingSpline:
    """The smoothest spline that stays as close to the samples as their resolution warrants.

    A quintic spline on equal knots, its third differences held small by as much as makes the residual that of
    rounding. Tried against FITPACK's adaptive knots, which follow the counts at times: peaks 130 % too high once in
    forty, where this one stays within 6 %.

    Attributes:
        resolution: Step between neighbouring readings, or the noise's standard deviation times 3.46 [the values'
            unit]; None: taken from the samples.

    Reference: P. Eilers and B. Marx, Flexible smoothing with B-splines and penalties, Statistical Science 11 (1996);
        discrepancy principle: V. A. Morozov (1966).
    """

    resolution: float | None = None

    def derivatives(self, time: Array, values: Array) -> Derivatives:
        """Derivatives of the spline.

        Args:
            time: Increasing [s], (N,), N >= 6.
            values: Any unit, (N,).

        Returns:
            Both derivatives.

        Raises:
            InputError: Too few samples, a resolution that is not above zero, or samples that no spline fits.
        """
        _check_count(time, FEWEST_SAMPLES)
        resolution = self.resolution if self.resolution is not None else detected_resolution(values)
        if not resolution > 0.0:
            raise InputError(Fault("smoothing", "needs a resolution above zero", resolution))
        try:
            spline = _penalised_spline(time, values, resolution * NOISE_OF_RESOLUTION)
        except np.linalg.LinAlgError:
            problem = "no spline fits: samples too far apart in time, or values too large for their resolution"
            raise InputError(Fault("smoothing", problem, float(np.diff(time).max()), "split the recording")) from None
        return Derivatives(spline.derivative(1)(time), spline.derivative(2)(time))

    @property
    def description(self) -> str:
        """What was done, for the report."""
        size = "found in the samples" if self.resolution is None else f"{self.resolution:.3g}"
        return f"smoothing spline, its residual that of a resolution of {size} [rad or m, per s for speeds]"


def _penalised_spline(time: Array, values: Array, residual: float) -> BSpline:
    """The spline with this RMS residual; more knots where a few cannot come so close."""
    from scipy.interpolate import BSpline

    for samples_a_knot in (4.0, 1.0):
        count = max(math.ceil(len(time) / samples_a_knot), FEWEST_SAMPLES)
        width = (time[-1] - time[0]) / count
        knots = time[0] + width * np.arange(-DEGREE, count + DEGREE + 1.0)
        basis = BSpline.design_matrix(time, knots, DEGREE, extrapolate=True).tocsr()
        weights, reached = _discrepancy(basis, values, residual)
        if reached <= residual:
            break
    return BSpline(knots, weights, DEGREE)


def _discrepancy(basis: csr_array, values: Array, residual: float) -> tuple[Array, float]:
    """Weights of the basis under the largest penalty that keeps the RMS residual, and the residual reached."""
    from scipy.linalg import solveh_banded
    from scipy.sparse import diags_array

    size = basis.shape[1]
    third = diags_array([-1.0, 3.0, -3.0, 1.0], offsets=[0, 1, 2, 3], shape=(size - 3, size))
    close, rough = _banded(basis.T @ basis), _banded(third.T @ third)
    moment = basis.T @ values
    low, high = LEAST_PENALTY, MOST_PENALTY
    best = solveh_banded(close + 10.0**low * rough, moment)
    reached = _rms(basis @ best - values)
    for _ in range(BISECTIONS if reached <= residual else 0):
        middle = 0.5 * (low + high)
        try:
            weights = solveh_banded(close + 10.0**middle * rough, moment)
        except np.linalg.LinAlgError:  # so stiff that rounding eats the data
            high = middle
            continue
        off = _rms(basis @ weights - values)
        if off <= residual:
            low, best, reached = middle, weights, off
        else:
            high = middle
    return best, reached


def _banded(matrix: csr_array) -> Array:
    """A symmetric matrix in the upper banded form of LAPACK."""
    bands = np.zeros((DEGREE + 1, matrix.shape[1]))
    for offset in range(DEGREE + 1):
        bands[DEGREE - offset, offset:] = matrix.diagonal(offset)
    return bands


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


@dataclass(frozen=True)
class SavitzkyGolay:
    """Polynomials fitted to a moving window, for those who know their window; uniform sampling only.

    Attributes:
        window: Length [s].
        order: Degree of the polynomials.
    """

    window: float
    order: int = 5

    def derivatives(self, time: Array, values: Array) -> Derivatives:
        """Derivatives of the fitted polynomials.

        Args:
            time: Uniform [s], (N,).
            values: Any unit, (N,).

        Returns:
            Both derivatives.

        Raises:
            InputError: Sampling that is not uniform, or a window shorter than the order or longer than the data.
        """
        from scipy.signal import savgol_filter

        step = float(np.median(np.diff(time)))
        if not is_uniform(time):
            raise InputError(Fault("smoothing", "Savitzky-Golay needs uniform sampling", None, "use the spline"))
        count = 2 * round(0.5 * self.window / step) + 1
        if not self.order < count <= len(time) or self.order < 2:
            least = f"{(self.order + 1) * step:.4g} to {(len(time) - 1) * step:.4g} s at this sampling"
            raise InputError(Fault("smoothing", f"the window of order {self.order} must be {least}", self.window))
        first, second = (savgol_filter(values, count, self.order, deriv=d, delta=step) for d in (1, 2))
        return Derivatives(first, second)

    @property
    def description(self) -> str:
        """What was done, for the report."""
        return f"Savitzky-Golay filter of degree {self.order} over {self.window:.4g} s"


def is_uniform(time: Array) -> bool:
    """Whether the samples stand at equal distances, to one per cent.

    Args:
        time: Increasing [s], (N,).

    Returns:
        True where they do.
    """
    step = np.diff(time)
    middle = float(np.median(step))
    return bool(np.abs(step - middle).max() <= UNIFORM * middle)


def detected_resolution(values: Array) -> float:
    """The step between neighbouring readings: decimals written, or the counts of an encoder.

    Args:
        values: As in the file, in its unit, (N,).

    Returns:
        The step; 0 where the values have full precision.
    """
    size = max(float(np.abs(values).max(initial=0.0)), 1e-12)
    decimal = 0.0
    for digits in range(0, 10):
        scaled = values * 10.0**digits
        if np.abs(scaled - np.round(scaled)).max(initial=0.0) < max(1e-6, 1e-15 * size * 10.0**digits):
            decimal = 10.0**-digits
            break
    return max(decimal, _count_step(values, decimal))


def _count_step(values: Array, decimal: float) -> float:
    """The step of an encoder: all levels are multiples of it, and the samples waver between them; else 0."""
    levels = np.unique(values)
    if len(levels) < 8:
        return 0.0
    gaps = np.diff(levels)
    gaps = gaps[gaps > 2.0 * max(decimal, 1e-12 * float(np.abs(values).max()))]
    if not len(gaps):
        return 0.0
    step = float(np.mean(gaps[gaps < 1.5 * gaps.min()]))
    multiples = gaps / step
    if np.abs(multiples - np.round(multiples)).max() > 0.1:
        return 0.0
    # A clean ramp is also made of equal steps, but its second differences vanish.
    wavering = np.mean(np.abs(np.diff(values, 2)) > 0.5 * step)
    return step if wavering > 0.1 else 0.0


def estimated_noise(values: Array) -> float:
    """Standard deviation of what no smooth motion explains, from high differences of uniform samples.

    Args:
        values: Any unit, (N,).

    Returns:
        The deviation in the same unit; medians make it blind to corners, 0 where it is not like noise.
    """
    if len(values) < 12:
        return 0.0
    deviations = [
        float(np.median(np.abs(np.diff(values, order)))) * MEDIAN_TO_DEVIATION / gain
        for order, gain in DIFFERENCE_NOISE.items()
    ]
    if deviations[1] < WHITE * deviations[0]:
        return 0.0
    # A residual asked below the true noise makes the spline follow it, so the estimate errs to the high side by
    # about three of its own deviations.
    return (1.0 + 4.0 / math.sqrt(len(values))) * max(deviations)


def chosen_smoothing(time: Array, values: Array, resolution: float) -> Smoothing:
    """The spline where rounding or noise would show in the acceleration, else parabolas.

    Args:
        time: Increasing [s], (N,).
        values: Any unit, (N,).
        resolution: Step between readings, in that unit; 0 for full precision.

    Returns:
        The way to differentiate these values twice.
    """
    noise = max(resolution * NOISE_OF_RESOLUTION, 0.0)
    estimated = estimated_noise(values) if len(time) > 2 and is_uniform(time) else 0.0
    step = float(np.median(np.diff(time)))
    if estimated < EXPLAINED * noise:
        estimated = 0.0
    for deviation, share in ((estimated, NOISE_COUNTS), (noise, RESOLUTION_COUNTS)):
        if deviation <= 0.0 or len(time) < FEWEST_SAMPLES or np.ptp(values) == 0.0:
            continue
        spline = SmoothingSpline(deviation / NOISE_OF_RESOLUTION)
        second = spline.derivatives(time, values).second
        if deviation * SECOND_DIFFERENCE / step**2 > share * _rms(second):
            return spline
    return Parabolas()


def _check_count(time: Array, least: int) -> None:
    if len(time) < least:
        raise InputError(Fault("time", f"needs at least {least} samples to be differentiated", len(time)))
