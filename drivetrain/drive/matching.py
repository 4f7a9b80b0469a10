"""Which gear ratio suits a motor to a motion: inertia matching, and what it becomes under gravity, friction and loss.

Everything here counts with the magnitude of the ratio, G > 0, and with motor torque in the sense in which the motor
drives the joint forwards; neither changes an RMS or a peak.
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
from drivetrain.errors import Fault, InputError

_REAL = 1e-7  # imaginary part over magnitude below which a root is a real one with rounding
STARTING = 0.7  # of one over the ratio, with which the torque that starts a strain-wave gear grows


def inertia_matching_ratio(load_inertia: float, rotor_inertia: float) -> float:
    """The ratio at which a motor torque accelerates a pure inertia most.

    Args:
        load_inertia: About the joint's axis [kg m^2].
        rotor_inertia: At the motor shaft [kg m^2].

    Returns:
        sqrt(I_load / I_rotor): the reflected rotor inertia then equals the load's.

    Raises:
        InputError: An inertia that is not positive.

    Reference:
        Lynch and Park, Modern Robotics (2017), exercise 8.9: the zero of the derivative of G tau / (I + G^2 J).
    """
    _check_positive({"load_inertia": load_inertia, "rotor_inertia": rotor_inertia})
    return math.sqrt(load_inertia / rotor_inertia)


def scaled_gear(gear: Gear, ratio: float) -> Gear:
    """The gear as it would be with another ratio, everything else on its sheet kept.

    Limits of output torque and of input speed, efficiency, input inertia, mass and stiffness stay. The no-load running
    torque at the input keeps its share of the rated torque, so it falls as the ratio grows, and so the split of the
    printed loss into running torque and mesh stays the same at every ratio. A drag over speed and temperature hardly
    depends on the ratio and stays; what starts the gear falls with its power STARTING (catalogs/SOURCES.md). Stages
    behind the gear stay as they are, so that their inertia at its input falls with the square of the ratio.
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
    """Motor torque of a motion as it depends on the ratio G: ``inverse / G + constant + linear * G``, each (N,)."""

    # load, joint friction, mesh loss by direction of power, acceleration of stages behind the gear, and a printed
    # no-load running torque [N m]
    inverse: Array
    # what the ratio does not change: carrier's acceleration, the motor's Coulomb friction, and the gear's drag over
    # speed, taken at the template's ratio [N m]
    constant: Array
    linear: Array  # rotor's acceleration and the motor's viscous friction [N m]
    weights: Array  # time each sample stands for [s]


class RatioRange(NamedTuple):
    """A range of ratios."""

    # its ends
    low: float
    high: float


class LoadMatch(NamedTuple):
    """How a motor's rated torque stands to a load, by the method of accelerating and load factor."""

    accelerating_factor: float  # alpha, what the motor has [W/s]
    load_factor: float  # beta, what the load takes at the best ratio, efficiency counted [W/s]
    range: RatioRange | None  # of the ratios whose RMS torque is within the rated torque; None when no ratio's is
    best: float  # the ratio of least RMS torque


def torque_terms(
    drive: Drive, gear_torque: Array, speed: Array, acceleration: Array, carrier_acceleration: Array, weights: Array
) -> TorqueTerms:
    """How a motion's motor torque depends on the ratio, with the drive's losses.

    The direction of power at the gear's output does not depend on the ratio, and so neither does the factor of the
    mesh; three ratios therefore determine all of them. What does not fit the form is left out: the fall of the motor's
    friction with speed (Stribeck), and what it takes to start from rest.

    Reference:
        Lynch and Park, Modern Robotics (2017), equation 8.111, ordered by powers of G.
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
    """The motor torque at a ratio."""
    return np.asarray(terms.inverse / ratio + terms.constant + terms.linear * ratio)


def rms_torque(terms: TorqueTerms, ratio: float) -> float:
    """RMS of the motor torque at a ratio."""
    return math.sqrt(_mean(torque_at(terms, ratio) ** 2, terms.weights))


def ratio_of_least_rms(terms: TorqueTerms) -> float:
    """The ratio that heats the motor least.

    For load and rotor alone RMS^2 = mean(T^2)/G^2 + 2 J mean(T a) + J^2 G^2 mean(a^2): the term that couples them
    does not depend on the ratio, so G^4 = mean(T^2) / (J^2 mean(a^2)) exactly, whether T is inertia, weight or
    friction; for an inertia alone that is the matching ratio sqrt(I/J). With what does not depend on the ratio in the
    sum (Coulomb friction, an accelerated carrier) it is a root of a quartic.
    """
    x, y, xz, yz, _, _ = _moments(terms)
    if y == 0.0 or x == 0.0:
        return math.inf if y == 0.0 else 0.0
    scale = (x / y) ** 0.25
    # Y G^4 + YZ G^3 - XZ G - X = 0, counted in multiples of the ratio without the constant part.
    roots = _positive_roots([1.0, yz / (y * scale), 0.0, -xz / (y * scale**3), -1.0])
    return min((scale * root for root in roots), key=lambda ratio: rms_torque(terms, ratio))


def ratio_of_least_peak(terms: TorqueTerms) -> float:
    """The ratio of the smallest peak of motor torque."""
    if not terms.linear.any() or not terms.inverse.any():
        return math.inf if not terms.linear.any() else 0.0

    from scipy.optimize import minimize_scalar  # takes long to import, and few answers need it

    def peak(logarithm: float) -> float:
        return float(np.abs(torque_at(terms, math.exp(logarithm))).max())

    centre = 0.5 * math.log(np.abs(terms.inverse).max() / np.abs(terms.linear).max())
    grid = centre + np.linspace(-math.log(1e3), math.log(1e3), 400)
    best = int(np.argmin([peak(x) for x in grid]))
    ends = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    return math.exp(minimize_scalar(peak, bounds=ends, method="bounded", options={"xatol": 1e-10}).x)


def rated_ranges(terms: TorqueTerms, rated_torque: float) -> tuple[RatioRange, ...]:
    """The ratios at which the RMS torque is within a rated one.

    Reference:
        As ``load_match``, with the direction of power, Coulomb friction and the carrier in it.
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
    """The range of ratios by accelerating and load factor, with one efficiency for all of the motion.

    The efficiency divides the load torque whichever way the power flows, which asks too much of a motion that brakes;
    ``rated_ranges`` goes by the direction of power.

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
    room = alpha - beta
    if room < 0.0:
        return LoadMatch(alpha, beta, None, best)
    root, wide = math.sqrt(room), math.sqrt(room + 4.0 * accelerated * torque)
    # tau_max and tau_min of the source, inverted; the second with its difference of roots turned into a sum.
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
    """Every number positive, or one error for all that are not."""
    faults = [Fault(name, POSITIVE.words, value) for name, value in values.items() if not is_number_in(POSITIVE, value)]
    if faults:
        raise InputError(faults)


# A gear as one of a family: of any ratio in a range and, where fitted to a series of a catalogue, of any size.


FITTED = (
    "mass", "inertia", "continuous_torque", "average_torque_limit", "momentary_torque", "max_input_speed",
    "average_input_speed_limit", "efficiency", "no_load_torque", "mesh_efficiency", "drag_torque", "drag_speed",
    "drag_speed_exponent", "drag_temperature_1", "drag_temperature_2", "seal_drag_torque", "starting_torque",
    "diameter", "length",
)  # fmt: skip
LEAST_ROWS = 4  # below, a law of two exponents is no fit
KEPT = 1.0 + 1e-9  # of a size: rounding must not reject a gear that is sized to its limit


@dataclass(frozen=True)
class PowerLaw:
    """A number of a sheet over the repeated peak torque T and the ratio G: ``scale * T^torque * G^ratio``."""

    scale: float  # at 1 N m and ratio 1 [SI]
    # exponents
    torque: float
    ratio: float
    error: float  # standard deviation of the rows from the law, relative
    rows: int  # how many the law was fitted to

    def at(self, torque: float, ratio: float) -> float:
        """The number of a gear."""
        return self.scale * torque**self.torque * ratio**self.ratio

    def torque_for(self, value: float, ratio: float) -> float:
        """The size whose number is a wanted one."""
        if self.torque <= 0.0 or value <= 0.0:
            return 0.0
        return float((value / (self.scale * ratio**self.ratio)) ** (1.0 / self.torque))


@dataclass(frozen=True, eq=False)
class GearFamily:
    """Gears that differ in ratio, and in size where laws say how."""

    name: str  # of the series; ``ideal gear`` for one without loss, mass, inertia and limits
    # ends of the range of ratios
    low: float
    high: float
    kind: str = "ideal"  # of its gears
    laws: Mapping[str, PowerLaw] = field(default_factory=dict)  # by column of the sheet; empty for the ideal family
    source: str = "no loss, no mass, no inertia, no limits"  # where the laws are from, in words
    # repeated peak torque of the rows [N m]; none is made smaller, and for larger ones the laws are carried on
    smallest: float = 0.0
    largest: float = math.inf

    def gear(self, ratio: float, torque: float) -> Gear:
        """The gear of a ratio and a size."""
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
        """The smallest size whose limits cover a load."""
        needed = [peak]
        for name, value in (("momentary_torque", peak), ("average_torque_limit", average)):
            if name in self.laws:
                needed.append(self.laws[name].torque_for(value, ratio))
        if "average_torque_limit" not in self.laws and "continuous_torque" in self.laws:
            needed.append(self.laws["continuous_torque"].torque_for(average, ratio))
        return max(max(needed) * KEPT, self.smallest)


def ideal_family(low: float, high: float) -> GearFamily:
    """Gears without loss, mass, inertia and limits."""
    _check_range(low, high)
    return GearFamily("ideal gear", low, high)


def fitted_family(name: str, gears: Iterable[Gear], low: float, high: float) -> GearFamily:
    """A family whose numbers follow power laws fitted to the rows of one series.

    Every number is fitted by least squares of its logarithm over those of repeated peak torque and ratio; where all
    rows have one ratio, over torque alone.
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
    """Least squares in logarithms."""
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
