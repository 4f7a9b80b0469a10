"""Gear ratio for a motor and a motion: inertia matching, and its extension to gravity, friction and losses.

All functions use the magnitude of the ratio, G > 0, and the motor torque in the sense that drives the joint forwards;
neither changes an RMS or a peak.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from drivetrain.arrays import Array, checked_array
from drivetrain.drive.drive import Drive, loss_speed, motor_torque, resting, shaft_friction
from drivetrain.drive.gear import DRAG_REFERENCE, Gear, drag_torque, mesh
from drivetrain.drive.ranges import EFFICIENCY, POSITIVE, is_number_in
from drivetrain.errors import Fault, InputError, raise_faults

_REAL = 1e-7  # relative imaginary part below which a root counts as real
STARTING = 0.7  # exponent of 1/ratio in the breakaway torque of a strain-wave gear


def inertia_matching_ratio(load_inertia: float, rotor_inertia: float) -> float:
    """Ratio at which a motor torque gives a pure inertia the largest acceleration.

    Args:
        load_inertia: Inertia of the load about the joint's axis [kg m^2].
        rotor_inertia: Inertia at the motor shaft [kg m^2].

    Returns:
        sqrt(I_load / I_rotor), at which the reflected rotor inertia equals that of the load.

    Raises:
        InputError: An inertia is not positive.

    Reference:
        Lynch and Park, Modern Robotics (2017), exercise 8.9: the zero of the derivative of G tau / (I + G^2 J).
    """
    _check_positive({"load_inertia": load_inertia, "rotor_inertia": rotor_inertia})
    return math.sqrt(load_inertia / rotor_inertia)


def scaled_gear(gear: Gear, ratio: float) -> Gear:
    """The gear with another ratio and otherwise the same data sheet.

    Limits of output torque and input speed, efficiency, input inertia, mass and stiffness stay. The no-load running
    torque at the input keeps its share of the rated torque, so it falls as the ratio grows and the split of the printed
    loss into running torque and mesh stays the same. A drag over speed and temperature hardly depends on the ratio and
    stays; the breakaway torque falls with the power STARTING of the ratio (catalogs/SOURCES.md). Stages behind the gear
    stay, so their inertia at its input falls with the square of the ratio.
    """
    running, starting, share = gear.no_load_torque, gear.starting_torque, abs(gear.ratio) / ratio
    stages = gear.stage_inertia * share**2
    return replace(
        gear,
        ratio=math.copysign(ratio, gear.ratio),
        inertia=None if gear.inertia is None else gear.inertia - gear.stage_inertia + stages,
        stage_inertia=stages,
        no_load_torque=None if running is None else running * share,
        starting_torque=None if starting is None else starting * share**STARTING,
    )


@dataclass(frozen=True, eq=False)
class TorqueTerms:
    """Motor torque of a motion as a function of the ratio G: ``inverse / G + constant + linear * G``, each (N,)."""

    # Load, joint friction, mesh loss by direction of power, acceleration of stages behind the gear, printed no-load
    # running torque [N m].
    inverse: Array
    # Terms independent of the ratio: acceleration of the carrier, Coulomb friction of the motor, drag of the gear over
    # speed at the given gear's ratio [N m].
    constant: Array
    linear: Array  # rotor acceleration and viscous friction of the motor [N m]
    weights: Array  # duration of each sample [s]


class RatioRange(NamedTuple):
    """A range of gear ratios."""

    # Ends of the range [-].
    low: float
    high: float


class LoadMatch(NamedTuple):
    """Suitability of a motor for a load, by the method of accelerating factor and load factor."""

    accelerating_factor: float  # alpha of the motor [W/s]
    load_factor: float  # beta of the load at the best ratio, efficiency included [W/s]
    range: RatioRange | None  # ratios at which the RMS torque is within the rated torque; None if there are none
    best: float  # ratio of the smallest RMS torque


def torque_terms(
    drive: Drive, gear_torque: Array, speed: Array, acceleration: Array, carrier_acceleration: Array, weights: Array
) -> TorqueTerms:
    """Motor torque of a motion as a function of the ratio, with the losses of the drive.

    The direction of power at the gear's output does not depend on the ratio, and therefore neither does the torque
    factor of the mesh, so three ratios determine all terms (Modern Robotics, equation 8.111, ordered by powers of G).
    Two effects that do not fit this form are neglected: the decrease of motor friction with speed (Stribeck), and
    breakaway from rest.
    """
    plain = replace(shaft_friction(drive), static=None, stribeck_speed=None)
    middle, gear, dragging = abs(drive.gear.ratio), drive.gear, 0.0
    if gear.drag_torque is not None:
        slow = loss_speed(speed, acceleration, resting(speed))
        dragging = drag_torque(mesh(gear), gear.ratio * slow, DRAG_REFERENCE)
        gear = replace(gear, drag_torque=0.0, seal_drag_torque=0.0)

    def torque(share: float) -> Array:
        turned = replace(drive, gear=scaled_gear(gear, share * middle), motor_friction=plain)
        return motor_torque(turned, gear_torque, speed, acceleration, carrier_acceleration).total

    # t(u) = a/u + b + c u at u = 1/2, 1 and 2.
    at_one = torque(1.0)
    below, above = torque(0.5) - at_one, torque(2.0) - at_one
    a, c = (below + 0.5 * above) / 0.75, (above + 0.5 * below) / 0.75
    sign = math.copysign(1.0, drive.gear.ratio)
    return TorqueTerms(sign * middle * a, sign * (at_one - a - c + dragging), sign * c / middle, weights)


def torque_at(terms: TorqueTerms, ratio: float) -> Array:
    """Motor torque at a ratio [N m], (N,)."""
    return np.asarray(terms.inverse / ratio + terms.constant + terms.linear * ratio)


def rms_torque(terms: TorqueTerms, ratio: float) -> float:
    """RMS motor torque at a ratio [N m]."""
    return math.sqrt(_mean(torque_at(terms, ratio) ** 2, terms.weights))


def ratio_of_least_rms(terms: TorqueTerms) -> float:
    """Ratio at which the RMS motor torque is smallest.

    For load and rotor alone RMS^2 = mean(T^2)/G^2 + 2 J mean(T a) + J^2 G^2 mean(a^2). The mixed term does not depend
    on the ratio, so G^4 = mean(T^2) / (J^2 mean(a^2)) exactly, whether T is inertia, weight or friction; for a pure
    inertia this is the matching ratio sqrt(I/J). With terms independent of the ratio (Coulomb friction, an accelerated
    carrier) it is a root of a quartic.
    """
    x, y, xz, yz, _, _ = _moments(terms)
    if y == 0.0 or x == 0.0:
        return math.inf if y == 0.0 else 0.0
    scale = (x / y) ** 0.25
    # Y G^4 + YZ G^3 - XZ G - X = 0, normalised by the ratio without the constant terms.
    roots = _positive_roots([1.0, yz / (y * scale), 0.0, -xz / (y * scale**3), -1.0])
    return min((scale * root for root in roots), key=lambda ratio: rms_torque(terms, ratio))


def ratio_of_least_peak(terms: TorqueTerms) -> float:
    """Ratio at which the peak motor torque is smallest."""
    if not terms.linear.any() or not terms.inverse.any():
        return math.inf if not terms.linear.any() else 0.0

    from scipy.optimize import minimize_scalar  # imported here because it is slow to import and rarely needed

    def peak(logarithm: float) -> float:
        return float(np.abs(torque_at(terms, math.exp(logarithm))).max())

    centre = 0.5 * math.log(np.abs(terms.inverse).max() / np.abs(terms.linear).max())
    grid = centre + np.linspace(-math.log(1e3), math.log(1e3), 400)
    best = int(np.argmin([peak(x) for x in grid]))
    ends = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    return math.exp(minimize_scalar(peak, bounds=ends, method="bounded", options={"xatol": 1e-10}).x)


def rated_ranges(terms: TorqueTerms, rated_torque: float) -> tuple[RatioRange, ...]:
    """Ranges of ratios at which the RMS torque is within a rated torque [N m]: as ``load_match``, but with direction of
    power, Coulomb friction and carrier acceleration included.
    """
    x, y, xz, yz, zz, xy = _moments(terms)
    rest = zz + 2.0 * xy - rated_torque**2
    if x == 0.0 and y == 0.0:
        return (RatioRange(0.0, math.inf),) if rest <= 0.0 else ()
    scale = (x / y) ** 0.25 if x > 0.0 and y > 0.0 else (math.sqrt(x) or 1.0) / rated_torque
    quartic = [y * scale**4, 2.0 * yz * scale**3, rest * scale**2, 2.0 * xz * scale, x]
    edges = [0.0, *(scale * root for root in _positive_roots(quartic)), math.inf]
    ranges: list[RatioRange] = []
    for low, high in pairwise(edges):
        inside = math.sqrt(low * high) if 0.0 < low and high < math.inf else (2.0 * low or 0.5 * min(high, 1e9))
        if rms_torque(terms, inside) <= rated_torque:
            ranges.append(RatioRange(low, high))
    return tuple(ranges)


def load_match(
    rated_torque: float, rotor_inertia: float, load_torque: Array, acceleration: Array, weights: Array,
    *, efficiency: float = 1.0,
) -> LoadMatch:  # fmt: skip
    """Range of ratios by accelerating factor and load factor, with one efficiency for the whole motion.

    The efficiency divides the load torque regardless of the direction of power, which overestimates the torque while
    braking; ``rated_ranges`` accounts for the direction.

    Reference:
        Giberti, Cinquemani and Legnani: alpha = T_N^2/J, beta = 2 [a_rms T_rms + mean(a T)], and the condition
        alpha >= beta/eta + [T_rms tau/(eta sqrt J) - sqrt J a_rms/tau]^2.
    """
    _check_positive({"rated_torque": rated_torque, "rotor_inertia": rotor_inertia})
    if not EFFICIENCY.holds(efficiency):
        raise InputError(Fault("efficiency", EFFICIENCY.words, efficiency))
    load_torque = checked_array(load_torque, (None,), "load_torque")
    acceleration = checked_array(acceleration, load_torque.shape, "acceleration")
    weights = checked_array(weights, load_torque.shape, "weights")
    if not (weights >= 0.0).all() or not weights.any():
        raise InputError(Fault("weights", "must not be negative, nor all zero [s]", weights.tolist()[:8]))
    torque = math.sqrt(_mean(load_torque**2, weights)) / efficiency
    accelerated = math.sqrt(_mean(acceleration**2, weights))
    alpha = rated_torque**2 / rotor_inertia
    beta = 2.0 * (accelerated * torque + _mean(load_torque * acceleration, weights) / efficiency)
    best = math.sqrt(torque / (rotor_inertia * accelerated)) if accelerated > 0.0 else math.inf
    excess = alpha - beta
    if excess < 0.0:
        return LoadMatch(alpha, beta, None, best)
    root, wide = math.sqrt(excess), math.sqrt(excess + 4.0 * accelerated * torque)
    # tau_max and tau_min of the source, inverted; in the second the difference of roots is rewritten as a sum.
    low = 2.0 * torque / (math.sqrt(rotor_inertia) * (wide + root))
    high = (wide + root) / (2.0 * math.sqrt(rotor_inertia) * accelerated) if accelerated > 0.0 else math.inf
    return LoadMatch(alpha, beta, RatioRange(low, high), best)


def _mean(values: Array, weights: Array) -> float:
    return float(values @ weights / weights.sum())


def _moments(terms: TorqueTerms) -> tuple[float, ...]:
    """Means of x^2, y^2, x z, y z, z^2 and x y for torque x/G + z + y G."""
    x, y, z = terms.inverse, terms.linear, terms.constant
    return tuple(_mean(product, terms.weights) for product in (x * x, y * y, x * z, y * z, z * z, x * y))


def _positive_roots(coefficients: list[float]) -> list[float]:
    """Real positive roots of a polynomial, smallest first."""
    roots = np.roots(coefficients)
    real = roots[np.abs(roots.imag) <= _REAL * np.abs(roots)].real
    return sorted(float(root) for root in real if root > 0.0)


def _check_positive(values: dict[str, float]) -> None:
    """Raise one error that lists all values that are not positive."""
    raise_faults(
        Fault(name, POSITIVE.words, value) for name, value in values.items() if not is_number_in(POSITIVE, value)
    )


# A gear as a member of a family with any ratio in a range and, where fitted to a catalogue series, of any size.


FITTED = (
    "mass", "inertia", "continuous_torque", "average_torque_limit", "momentary_torque", "max_input_speed",
    "average_input_speed_limit", "efficiency", "no_load_torque", "mesh_efficiency", "drag_torque", "drag_speed",
    "drag_speed_exponent", "drag_temperature_1", "drag_temperature_2", "seal_drag_torque", "starting_torque",
    "diameter", "length",
)  # fmt: skip
LEAST_ROWS = 4  # fewest rows for a fit of two exponents
KEPT = 1.0 + 1e-9  # relative tolerance, so that rounding does not reject a gear sized to its limit


@dataclass(frozen=True)
class PowerLaw:
    """A data sheet value over repeated peak torque T and ratio G: ``scale * T^torque * G^ratio``."""

    scale: float  # value at 1 N m and ratio 1 [SI]
    # Exponents.
    torque: float
    ratio: float
    error: float  # relative standard deviation of the rows from the law
    rows: int  # number of rows that the law was fitted to

    def at(self, torque: float, ratio: float) -> float:
        """Value of the gear with a repeated peak torque [N m] and a ratio."""
        return self.scale * torque**self.torque * ratio**self.ratio

    def torque_for(self, value: float, ratio: float) -> float:
        """Repeated peak torque [N m] of the gear with a given value."""
        if self.torque <= 0.0 or value <= 0.0:
            return 0.0
        return float((value / (self.scale * ratio**self.ratio)) ** (1.0 / self.torque))


@dataclass(frozen=True, eq=False)
class GearFamily:
    """Gears that differ in ratio and, where power laws are given, in size."""

    name: str  # name of the series; ``ideal gear`` for one without losses, mass, inertia and limits
    # Ends of the range of ratios.
    low: float
    high: float
    kind: str = "ideal"  # kind of gear
    laws: Mapping[str, PowerLaw] = field(default_factory=dict)  # by data sheet column; empty for the ideal family
    source: str = "no loss, no mass, no inertia, no limits"  # source of the laws, as text
    # Smallest and largest repeated peak torque of the rows [N m]. No gear is smaller; for larger ones the laws are
    # extrapolated.
    smallest: float = 0.0
    largest: float = math.inf

    def gear(self, ratio: float, torque: float) -> Gear:
        """The gear with a ratio and a size (repeated peak torque [N m])."""
        key = f"{self.name} {ratio:.4g}"
        if not self.laws:
            return Gear(key, ratio, kind="ideal", efficiency=1.0)
        numbers = {name: law.at(torque, ratio) for name, law in self.laws.items()}
        for name in ("efficiency", "mesh_efficiency"):
            if name in numbers:
                numbers[name] = min(numbers[name], 1.0)
        bare = Gear(key, ratio, series=self.name, kind=self.kind, repeated_peak_torque=torque, source=self.source)
        return replace(bare, **numbers)  # type: ignore[arg-type]

    def size_for(self, ratio: float, peak: float, average: float) -> float:
        """Smallest size (repeated peak torque [N m]) whose limits cover a peak and an average load torque [N m]."""
        needed = [peak]
        for name, value in (("momentary_torque", peak), ("average_torque_limit", average)):
            if name in self.laws:
                needed.append(self.laws[name].torque_for(value, ratio))
        if "average_torque_limit" not in self.laws and "continuous_torque" in self.laws:
            needed.append(self.laws["continuous_torque"].torque_for(average, ratio))
        return max(max(needed) * KEPT, self.smallest)


def ideal_family(low: float, high: float) -> GearFamily:
    """Gears without losses, mass, inertia and limits, within a range of ratios."""
    _check_range(low, high)
    return GearFamily("ideal gear", low, high)


def fitted_family(name: str, gears: Iterable[Gear], low: float, high: float) -> GearFamily:
    """A family whose values follow power laws fitted to the rows of one series.

    The logarithm of every value is fitted by least squares over the logarithms of repeated peak torque and ratio, or
    over torque alone if all rows have the same ratio.
    """
    _check_range(low, high)
    rows = [gear for gear in gears if gear.repeated_peak_torque is not None]
    if len(rows) < LEAST_ROWS:
        problem = f"has {len(rows)} rows with a repeated peak torque; a fit needs {LEAST_ROWS}"
        raise InputError(Fault(f"gear series {name}", problem))
    laws = {}
    for column in FITTED:
        printed = [(row, getattr(row, column)) for row in rows if getattr(row, column) is not None]
        known = [(row, value) for row, value in printed if value > 0.0]
        if len(printed) >= LEAST_ROWS and not known:
            laws[column] = PowerLaw(0.0, 0.0, 0.0, 0.0, len(printed))
        elif len(known) >= LEAST_ROWS:
            laws[column] = _fit([row for row, _ in known], [value for _, value in known])
    torques = [row.repeated_peak_torque or 0.0 for row in rows]
    source = f"power laws of torque and ratio through {len(rows)} rows of series {name}"
    return GearFamily(name, low, high, rows[0].kind, laws, source, min(torques), max(torques))


def _fit(rows: list[Gear], values: list[float]) -> PowerLaw:
    """Least squares fit of logarithms."""
    torque = np.log([row.repeated_peak_torque or 1.0 for row in rows])
    ratio = np.log([abs(row.ratio) for row in rows])
    columns = [np.ones(len(rows))]
    varied = [column for column in (torque, ratio) if np.ptp(column) > 1e-9]
    matrix = np.column_stack([*columns, *varied])
    target = np.log(values)
    found = np.linalg.lstsq(matrix, target, rcond=None)[0]
    error = float(np.sqrt(np.mean((matrix @ found - target) ** 2)))
    exponents = dict(zip([id(column) for column in varied], found[1:], strict=True))
    return PowerLaw(
        math.exp(float(found[0])), float(exponents.get(id(torque), 0.0)), float(exponents.get(id(ratio), 0.0)), error,
        len(rows),
    )  # fmt: skip


def _check_range(low: float, high: float) -> None:
    if not (math.isfinite(low) and math.isfinite(high) and 0.0 < low < high):
        raise InputError(Fault("ratio", "must be a range from a smaller to a larger positive ratio", (low, high)))
