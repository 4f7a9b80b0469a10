"""Speeds and accelerations from positions: three methods of differentiation, and the choice between them.

Differentiating twice multiplies noise by 1/dt^2: a 12-bit encoder at 1 kHz shows some hundred rad/s^2 at rest.
Positions of coarse resolution are therefore smoothed, by as much as the resolution justifies. The same holds for
instants with jitter: an error dt of an instant is an error of speed times dt in the position.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError

if TYPE_CHECKING:  # importing scipy.sparse takes half a second, so functions that need it import it
    from scipy.sparse import csr_array

UNIFORM = 0.01  # largest relative deviation of a time step from the median step of uniform sampling
NOISE_OF_RESOLUTION = 1.0 / math.sqrt(12.0)  # standard deviation of rounding errors, in steps of the resolution
RESOLUTION_COUNTS = 0.01  # share of the RMS acceleration due to rounding above which the positions are smoothed
ROUNDING_EXPLAINS = 2.0  # an estimated noise below this multiple of the rounding noise is taken as rounding noise
NOISE_COUNTS = 0.03  # the same for noise estimated from the samples themselves, which is less certain
SECOND_DIFFERENCE = math.sqrt(6.0)  # amplification of independent noise by the second difference 1, -2, 1
ORDERS = (6, 8)  # orders of the divided differences from which noise is estimated
WHITE = 0.7  # smallest ratio of the two orders' estimates; it is lower for a coarsely sampled wave
SLOW = 0.1  # share of the samples, the slowest ones, in which jitter has little effect and position noise shows
MOVES = 0.05  # share of the largest speed below which jitter has no visible effect
# Smallest position noise, as a share of the noise from jitter at the median speed: otherwise the samples at turning
# points, where jitter has no effect, would have nearly all the weight.
LEAST_NOISE = 0.05
SAME_NOISE = 0.5  # ratio of the slowest samples' noise to that of all above which no jitter is needed to explain it
MEDIAN_TO_DEVIATION = 1.0 / 0.6745  # ratio of standard deviation to median absolute value of a normal variable
FEWEST_SAMPLES = 6  # a quintic through fewer is not defined
LONG_PAUSE = 100.0  # ratio of a pause in a recording to the usual step above which the parts are separate
USUAL = 0.95  # share of steps that are not longer: readings may come in bursts
DEGREE = 5
UNLIKELY = 1e200  # instead of infinity, with which the line search could not calculate
LEAST_PENALTY, MOST_PENALTY = -16, 6  # range of log10 of noise variance over variance of third differences


class Derivatives(NamedTuple):
    """First and second derivative at the samples, each (N,)."""

    first: Array
    second: Array


class Smoothing(Protocol):
    """A method of differentiating samples."""

    def derivatives(self, time: Array, values: Array) -> Derivatives:
        """First and second derivative at the samples."""

    @property
    def description(self) -> str:
        """Name and parameters of the method, for notes and reports."""


@dataclass(frozen=True)
class Parabolas(Smoothing):
    """The parabola through each sample and its two neighbours: no smoothing, and no ringing at corners."""

    def derivatives(self, time: Array, values: Array) -> Derivatives:
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
        return "parabolas through three neighbouring samples, no smoothing"


@dataclass(frozen=True)
class SmoothingSpline(Smoothing):
    """Penalised quintic spline on equally spaced knots, for values with noise of a known size.

    The penalty on third differences of the coefficients is the one of largest likelihood, for noise of the given
    variance and third differences that are random. The standard deviation of the result follows from the same model.
    FITPACK's adaptive knots were compared with it: they sometimes follow the encoder's steps, and gave peaks 130 % too
    high in one of forty cases; this spline stayed within 5 %.

    Reference: P. Eilers and B. Marx, Flexible smoothing with B-splines and penalties, Statistical Science 11 (1996);
        the standard deviation: G. Wahba, Bayesian confidence intervals for the cross-validated smoothing spline,
        J. R. Statist. Soc. B 45 (1983).
    """

    # step between neighbouring readings, or the noise's standard deviation times sqrt(12) [the values' unit]; None:
    # detected from the samples
    resolution: float | None = None
    # standard deviation of the recorded instants [s]; its effect is noise proportional to the speed
    jitter: float = 0.0

    def derivatives(self, time: Array, values: Array) -> Derivatives:
        return Derivatives(*self.fitted(time, values).rates[1:])

    def fitted(self, time: Array, values: Array) -> Fitted:
        """Positions, speeds and accelerations of the spline at the samples, with their covariances."""
        _check_count(time, FEWEST_SAMPLES)
        resolution = self.resolution if self.resolution is not None else detected_resolution(values)
        if not resolution > 0.0:
            raise InputError(Fault("smoothing", "needs a resolution above zero", resolution))
        takes = [self._take(time[one], values[one], resolution * NOISE_OF_RESOLUTION) for one in _takes(time)]
        rates, covariances = zip(*takes, strict=True)
        return Fitted(np.concatenate(rates, axis=1), np.concatenate(covariances))

    def _take(self, time: Array, values: Array, deviation: float) -> Fitted:
        if len(time) < FEWEST_SAMPLES:
            problem = f"needs at least {FEWEST_SAMPLES} samples between two long pauses"
            raise InputError(Fault("time", problem, float(time[0]), "leave these samples out"))
        noise = np.full(len(time), deviation)
        try:
            if self.jitter:
                steepest = self.jitter * float(np.abs(np.diff(values)).sum()) / float(time[-1] - time[0])
                speed = _maximum_likelihood(time, values, np.hypot(noise, steepest)).rates[1]
                noise = np.hypot(noise, self.jitter * speed)
            return _maximum_likelihood(time, values, noise)
        except np.linalg.LinAlgError:
            problem = "no spline fits: samples too far apart in time, or values too large for their resolution"
            raise InputError(Fault("smoothing", problem, float(np.diff(time).max()), "split the recording")) from None

    @property
    def description(self) -> str:
        size = "found in the samples" if self.resolution is None else f"{self.resolution:.3g}"
        clock = f", instants uncertain by {1e3 * self.jitter:.2g} ms" if self.jitter else ""
        return f"smoothing spline for a resolution of {size} [rad or m, per s for speeds]{clock}"


class Fitted(NamedTuple):
    """Result of a spline fit at the samples."""

    rates: Array  # position, speed and acceleration, (3, N)
    covariance: Array  # of position, speed and acceleration at each sample, (N, 3, 3)


def _takes(time: Array) -> list[slice]:
    """The parts of a recording between long pauses, over which knots at equal distances would be too far apart."""
    step = np.diff(time)
    ends = np.flatnonzero(step > LONG_PAUSE * np.quantile(step, USUAL, method="lower")) + 1
    return [slice(*both) for both in pairwise([0, *ends.tolist(), len(time)])]


def _maximum_likelihood(time: Array, values: Array, noise: Array) -> Fitted:
    """The maximum-likelihood spline.

    With as many knots as samples: with half as many the stated deviations of moves of fifteen samples held for 75 %.
    """
    from scipy.interpolate import BSpline
    from scipy.linalg import cho_solve_banded, cholesky_banded
    from scipy.optimize import minimize_scalar
    from scipy.sparse import diags_array

    count = len(time)
    width = (time[-1] - time[0]) / count
    knots = time[0] + width * np.arange(-DEGREE, count + DEGREE + 1.0)
    basis = BSpline.design_matrix(time, knots, DEGREE, extrapolate=True).tocsr()
    size = basis.shape[1]
    third = diags_array([-1.0, 3.0, -3.0, 1.0], offsets=[0, 1, 2, 3], shape=(size - 3, size))
    weighted = basis.T.multiply(noise**-2.0).tocsr()
    normal_matrix, penalty, moment = _banded(weighted @ basis), _banded(third.T @ third), weighted @ values

    def solve(power: float) -> tuple[Array, Array]:
        factor = cholesky_banded(normal_matrix + 10.0**power * penalty)
        return factor, cho_solve_banded((factor, False), moment)

    def negative_log_likelihood(power: float) -> float:
        try:
            factor, weights = solve(power)
        except np.linalg.LinAlgError:  # the penalty is so large that the data are lost in rounding
            return UNLIKELY
        misfit = float(np.sum(((values - basis @ weights) / noise) ** 2))
        prior = 10.0**power * float(np.sum((third @ weights) ** 2)) - (size - 3) * power * math.log(10.0)
        return misfit + prior + 2.0 * float(np.sum(np.log(factor[-1])))

    # The penalty is the inverse of the variance of third differences.
    middle = -2.0 * math.log10(float(np.median(noise)))
    powers = middle + np.arange(LEAST_PENALTY, MOST_PENALTY + 1.0)
    best = powers[int(np.argmin([negative_log_likelihood(power) for power in powers]))]
    found = minimize_scalar(
        negative_log_likelihood, bounds=(best - 1.0, best + 1.0), method="bounded", options={"xatol": 0.02}
    )
    factor, weights = solve(float(found.x) if found.fun < negative_log_likelihood(best) else float(best))
    spline = BSpline(knots, weights, DEGREE)
    rates = np.stack([spline.derivative(order)(time) for order in range(3)])
    at = np.clip(((time - time[0]) / width).astype(int), 0, count - 1)
    local = np.stack([_local_basis(time, knots, at, order) for order in range(3)], axis=1)
    return Fitted(rates, local @ _inverse_blocks(factor)[at] @ np.swapaxes(local, 1, 2))


def _local_basis(time: Array, knots: Array, at: np.ndarray, order: int) -> Array:
    """Derivatives of order ``order`` of the six B-splines that are non-zero at each sample, (N, 6); equal knots."""
    from scipy.interpolate import BSpline

    one = BSpline.basis_element(knots[: DEGREE + 2], extrapolate=False).derivative(order)
    width = knots[1] - knots[0]
    shifted = time[:, None] - width * (at[:, None] + np.arange(DEGREE + 1))
    return np.asarray(np.nan_to_num(one(shifted)))


def _inverse_blocks(factor: Array) -> Array:
    """Diagonal blocks of the inverse of a banded matrix from its upper Cholesky factor; block j starts at row j.

    Reference: K. Takahashi, J. Fagan, M. Chin, Formation of a sparse bus impedance matrix, PICA Proceedings (1973).
    """
    size = factor.shape[1]
    blocks = np.zeros((size, DEGREE + 1, DEGREE + 1))
    rows = np.zeros((size, DEGREE + 1))
    for offset in range(DEGREE + 1):
        rows[: size - offset, offset] = factor[DEGREE - offset, offset:]
    after = np.zeros((DEGREE, DEGREE))
    for j in range(size - 1, -1, -1):
        along = rows[j, 1:] / rows[j, 0]
        across = -after @ along
        block = blocks[j]
        block[0, 0] = rows[j, 0] ** -2.0 - across @ along
        block[0, 1:] = block[1:, 0] = across
        block[1:, 1:] = after
        after = block[:DEGREE, :DEGREE]
    return blocks


def _banded(matrix: csr_array) -> Array:
    """A symmetric matrix in LAPACK's upper banded storage, (6, size)."""
    bands = np.zeros((DEGREE + 1, matrix.shape[1]))
    for offset in range(DEGREE + 1):
        bands[DEGREE - offset, offset:] = matrix.diagonal(offset)
    return bands


@dataclass(frozen=True)
class SavitzkyGolay(Smoothing):
    """Polynomials fitted to a moving window of given length; for uniform sampling only."""

    window: float  # length [s]
    order: int = 5  # degree of the polynomials

    def derivatives(self, time: Array, values: Array) -> Derivatives:
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
        return f"Savitzky-Golay filter of degree {self.order} over {self.window:.4g} s"


def is_uniform(time: Array) -> bool:
    """Whether all time steps are equal to one per cent."""
    step = np.diff(time)
    middle = float(np.median(step))
    return bool(np.abs(step - middle).max() <= UNIFORM * middle)


def detected_resolution(values: Array) -> float:
    """Step between neighbouring readings, in the values' unit: that of the written decimals, or of an encoder."""
    size = max(float(np.abs(values).max(initial=0.0)), 1e-12)
    decimal = 0.0
    for digits in range(0, 10):
        scaled = values * 10.0**digits
        if np.abs(scaled - np.round(scaled)).max(initial=0.0) < max(1e-6, 1e-15 * size * 10.0**digits):
            decimal = 10.0**-digits
            break
    return max(decimal, _count_step(values, decimal))


def _count_step(values: Array, decimal: float) -> float:
    """Step of an encoder, if all levels are multiples of it and the samples alternate between levels; else 0."""
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


def estimated_noise(time: Array, values: Array) -> float:
    """Standard deviation of the noise in the values, from divided differences of high order.

    It is 0 for fewer than 12 samples, or if the two orders disagree, as for a coarsely sampled wave.
    """
    if len(values) < 12:
        return 0.0
    parts = [_scaled_differences(time, values, order) for order in ORDERS]
    deviations = [_deviation(one[_moves(speed)]) for one, speed in parts]
    if deviations[1] < WHITE * deviations[0]:
        return 0.0
    # The estimate is raised by about three of its own standard deviations: with too small a value the spline would
    # follow the noise.
    return (1.0 + 4.0 / math.sqrt(len(values))) * max(deviations)


def estimated_jitter(time: Array, values: Array, noise: float) -> float:
    """Standard deviation of the instants [s], from the noise at high speed in excess of ``noise``.

    Also of uniform samples: many recorders write the instants that should be, not those of the readings.
    """
    if len(values) < 12:
        return 0.0
    wavering, speed = _scaled_differences(time, values, ORDERS[0])
    fast = speed >= np.median(speed[_moves(speed)])
    usual = float(np.sqrt(np.mean(speed[fast] ** 2)))
    beyond = _deviation(wavering[fast]) ** 2 - noise**2
    return math.sqrt(beyond) / usual if beyond > 0.0 and usual > 0.0 else 0.0


def _moves(speed: Array) -> Any:
    """Samples at which the joint's speed is not negligible, (N,), booleans."""
    return speed >= MOVES * speed.max()


def _scaled_differences(time: Array, values: Array, order: int) -> tuple[Array, Array]:
    """Divided differences, scaled so that independent noise keeps its standard deviation, and the speeds there."""
    instants = np.lib.stride_tricks.sliding_window_view(time, order + 1)
    gaps = (instants[:, :, None] - instants[:, None, :]) / (instants[:, -1] - instants[:, 0])[:, None, None]
    gaps[:, np.arange(order + 1), np.arange(order + 1)] = 1.0
    weights = 1.0 / np.prod(gaps, axis=2)
    weights /= np.sqrt(np.sum(weights**2, axis=1, keepdims=True))
    found = np.sum(weights * np.lib.stride_tricks.sliding_window_view(values, order + 1), axis=1)
    return found, np.abs((values[order:] - values[:-order]) / (time[order:] - time[:-order]))


def _deviation(values: Array) -> float:
    """Standard deviation of values with zero mean, from the median of their absolute values."""
    return float(np.median(np.abs(values))) * MEDIAN_TO_DEVIATION


def chosen_smoothing(time: Array, values: Array, resolution: float) -> Smoothing:
    """Choose the smoothing spline if rounding, noise or jitter would show in the acceleration, else parabolas."""
    if len(time) < FEWEST_SAMPLES or np.ptp(values) == 0.0 or (np.diff(time) <= 0.0).any():
        return Parabolas()
    noise = max(resolution * NOISE_OF_RESOLUTION, 0.0)
    estimated = estimated_noise(time, values)
    step = float(np.median(np.diff(time)))
    if estimated < ROUNDING_EXPLAINS * noise:
        estimated = 0.0
    jitter = estimated_jitter(time, values, noise) if estimated else 0.0
    for deviation, share in ((estimated, NOISE_COUNTS), (noise, RESOLUTION_COUNTS)):
        if deviation <= 0.0:
            continue
        spline = SmoothingSpline(deviation / NOISE_OF_RESOLUTION)
        second = spline.derivatives(time, values).second
        if deviation * SECOND_DIFFERENCE / step**2 > share * np.sqrt(np.mean(second**2)):
            return _with_jitter(time, values, noise, jitter, spline) if jitter else spline
    return Parabolas()


def _with_jitter(time: Array, values: Array, noise: float, jitter: float, without: SmoothingSpline) -> SmoothingSpline:
    """The spline for instants with jitter, or that without where the slowest samples are about as noisy as all.

    The noise of the positions is estimated from the slowest samples.
    """
    wavering, speed = _scaled_differences(time, values, ORDERS[0])
    slow = speed <= np.quantile(speed, SLOW)
    still = _deviation(wavering[slow]) ** 2 - (jitter * float(np.mean(speed[slow]))) ** 2
    usual = float(np.median(speed[_moves(speed)]))
    own = max(noise, math.sqrt(max(still, 0.0)), LEAST_NOISE * jitter * usual)
    if own > SAME_NOISE * (without.resolution or 0.0) * NOISE_OF_RESOLUTION:
        return without
    return SmoothingSpline(own / NOISE_OF_RESOLUTION, estimated_jitter(time, values, own))


def _check_count(time: Array, least: int) -> None:
    if len(time) < least:
        hint = "points between which the arm is to move are `waypoints` of a motion"
        raise InputError(Fault("time", f"needs at least {least} samples to be differentiated", len(time), hint))
