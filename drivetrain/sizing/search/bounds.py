"""Lower bounds on what candidates require while the torque of their joint lies in an interval at every sample.

While other drives are open, the load of a joint is known only to lie in an interval. The figures of the judge are
bounded from below over that interval by the same laws, and compared with the limits by the same table of checks. A
figure without a bound stays unknown, and its checks are not made; so a candidate that is feasible for any load in the
interval is never ruled out.

At each sample the motor's torque is a function of the gear's torque that consists of two straight lines, which meet
where the power through the mesh changes sign. Over an interval its extremes are therefore at the ends, or at the bend
if that lies between them, whether the mesh is self-locking or not.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.amplifier import conduction_loss
from drivetrain.drive.brake import holding_torque
from drivetrain.drive.drive import breakaway_motor_torque, drive_inertia, rotor_torque
from drivetrain.drive.friction import (
    Friction,
    breakaway_friction,
    direction,
    friction_curve,
    friction_torque,
    sliding_friction,
)
from drivetrain.drive.gear import (
    bearing_arm,
    drag_factor,
    life_of,
    mesh_loss_power,
    mesh_of,
    mesh_slope,
    mesh_torque,
    permitted_peaks,
    static_load,
    wear,
)
from drivetrain.drive.linear_interval import mean_square
from drivetrain.drive.motor import torque_constant, winding_resistance
from drivetrain.drive.stops import braked, braking_push, stiff_spring, stop_rotor, swing_spring, swung_torque
from drivetrain.drive.thermal.periodic_heat import thermal_nodes
from drivetrain.jit import FAST, kernel, law
from drivetrain.records import known, known_or
from drivetrain.sizing.demand.series import SECTIONS, Motion, SpeedPowers, new_speed_powers
from drivetrain.sizing.judge.cases import CASE, stop_constant, stop_temperature
from drivetrain.sizing.judge.checks import GEAR, HEAT, SPEED, TORQUE
from drivetrain.sizing.judge.judge import (
    NO,
    NOTHING,
    YES,
    add_rows,
    drag_series,
    excess_series,
    first_lacking,
    set_cold_start,
    set_currents,
    set_jam,
    set_limits,
    settled_factor,
    torque_factor,
    unknown_torque,
    worst,
)
from drivetrain.vector import larger, smaller

# Temperatures are bounded in steps, each of which adds a few percent of the one before; largest number of steps.
MAX_HEAT_STEPS = 8
HEAT_TOLERANCE = 1e-3  # relative rise below which a step is the last one
SLOPE_CANDIDATES = 8  # candidates over which the slope of the power is averaged
INTERVAL_ROUNDING = 1e-12  # rounding of the sums in an interval, relative to its width and middle
ROUND_DOWN = 1.0 - 2e-9  # factor on a bound, so that rounding does not make it too large
# first number of these parts of a case
MOTOR_AT, SHAFT_AT, GEAR_AT = (CASE.fields[name][1] // 8 for name in ("motor", "shaft", "gear"))


class CurrentStops(NamedTuple):
    """Stops at the current limit that begin at B samples of one joint.

    The last three are buffers for the ends of intervals: of the load's torque, of that without the part that its own
    acceleration needs, and of its inertia, all without the contribution of the joint's own drive.
    """

    speed: Array  # as in ``Motion``, (B,)
    loss_speed: Array
    acceleration: Array
    carrier_acceleration: Array
    unit_torque: Array  # per unit of each load parameter of the joint's own drive, (K, B)
    unit_inertia: Array
    torque: Array  # low and high end [N m], (2, B)
    static: Array
    inertia: Array  # [kg m^2]


class TorqueInterval(NamedTuple):
    """Interval of the torque of one joint at N samples, all of the cycle or the key ones, while other drives are open.

    All but the first five are buffers.
    """

    motion: Motion  # motion of the joint
    friction: Array  # friction of the joint at its speed [N m], (N,)
    loss_friction: Array  # friction at the speed that decides the losses [N m], (N,)
    unit_torque: Array  # torque per unit of each load parameter of the joint's own drive, (K, N)
    step_share: Array  # share of the operating time of the step from each sample to the next, (N,)
    low: Array  # ends of the torque at the gear's output, without joint friction and own drive [N m], (N,)
    high: Array
    total_low: Array  # ends of the torque with the own drive [N m], (N,)
    total_high: Array
    motor_low: Array  # ends of the motor's torque [N m], (N,)
    motor_high: Array
    shaft: Array  # the motor's torque without the part that passes the mesh [N m], (N,)
    excess: Array  # friction of the shaft above the sum of Coulomb and viscous friction [N m], (N,)
    drag: Array  # drag torque of the gear, at its input [N m], (N,)
    powers: SpeedPowers  # for the drag
    # lower bounds on the largest tilting moment [N m], axial and radial load [N] of the output bearing, on the largest
    # torque that holds a position at rest [N m], on the largest inertia [kg m^2], and on the torque in stops on a ramp
    # [N m]; NaN if not known
    least_loads: Array
    # lower bounds at some samples on the squares of tilting moment and radial load of the output bearing, and on
    # |mx fy - my fx|, (3, B)
    bearing_products: Array


class CaseNumbers(NamedTuple):
    """What the case of a pair is composed of: records as plain numbers, which are copied faster and compile faster."""

    template: Array  # a case of the joint with any motor and gear, (1, numbers)
    row: Array  # buffer: the case of one candidate, (1, numbers)
    case: Any  # the same memory as a record, (1,)
    motors: Array  # motors, (motors, numbers), and the friction of their shafts
    shafts: Array
    gears: Array  # gears, and whether there is none (direct drive)
    direct: Array
    pairs: Any  # rows of motor and gear of all pairs of the study, (P, 2)


class BoundData(NamedTuple):
    """What the bounds on the candidates of one joint need, with their buffers; K other joints' drives load it.

    Compiled functions take the parts that they need: every array of an argument costs compile time, used or not.
    """

    cases: CaseNumbers
    parameters: Array  # load parameters of each pair, (P, PARAMETERS)
    load: Array  # torque without drives [N m], (N,)
    unit_torque: (
        Array  # torque per unit of each load parameter of the K joints whose drives load it, (K, PARAMETERS, N)
    )
    half_width: Array  # half the range of each of these parameters, (K, PARAMETERS)
    key: TorqueInterval  # at the key samples
    full: TorqueInterval  # at all samples
    stops: CurrentStops


def torque_interval_of(
    motion: Motion, friction: Friction, unit_torque: Array, step_share: Array, bearing: int
) -> TorqueInterval:
    """A torque interval with buffers of its own; ``bearing``: number of samples for the output bearing."""
    at_speed, at_loss_speed = friction_torque(friction, motion.speed), friction_torque(friction, motion.loss_speed)
    n = len(step_share)
    buffers: Any = (*np.zeros((9, n)), new_speed_powers(n), np.full(6, np.nan), np.zeros((3, bearing)))
    return TorqueInterval(motion, at_speed, at_loss_speed, unit_torque, step_share, *buffers)


@kernel(fastmath=FAST)
def load_interval(
    load: Array, unit_load: Array, low: Array, high: Array, bottom: Array, top: Array, half: Array
) -> None:
    """Interval of a load (N,) while the drives of K other joints are open: each load parameter lies within a range.

    ``unit_load``: load per unit of each parameter, (K, PARAMETERS, N). Filled are the ends of the interval, ``bottom``
    and ``top``, and half the width of the range of each parameter, ``half``.
    """
    for t in range(len(load)):  # the middle and half the width of the interval, until the last loop
        bottom[t], top[t] = load[t], 0.0
    for k in range(half.shape[0]):
        for i in range(half.shape[1]):
            middle, width, row = 0.5 * (low[k, i] + high[k, i]), 0.5 * (high[k, i] - low[k, i]), unit_load[k, i]
            if width > 0.0:
                width += INTERVAL_ROUNDING * (width + abs(middle))
            half[k, i] = width
            for t in range(len(row)):
                bottom[t] += middle * row[t]
                top[t] += width * abs(row[t])
    for t in range(len(load)):
        middle, width = bottom[t], top[t]
        bottom[t], top[t] = middle - width, middle + width


@kernel(fastmath=FAST)
def bound_candidates(
    data: BoundData, checks: Any, pairs: Any, exact: Any, until: float, strict: bool, cost_limit: float, test_all: bool,
    with_energy: bool, energy_weight: float, open_energy: float, base: Array, cost: Array, used: Array, energy: Array,
    slope: Array,
) -> int:  # fmt: skip
    """Lower bounds for K candidates of one joint while its torque lies in the interval (``load_interval``); returns how
    many were tested. The key samples are filled already (``fill_key_samples``).

    Not tested are candidates whose cost is ``exact`` or reaches ``cost_limit``, and without ``test_all`` those that
    cannot be the cheapest. A candidate is not tested further once its utilisation exceeds ``until``; ``strict`` rules
    it out if an essential check cannot be made. ``base`` is the cost of each pair without its energy, (P,).

    Filled are, (K,) each: ``cost``, raised by the least energy; ``used``, lower bounds on the utilisation, infinite if
    ruled out; with ``with_energy`` also ``energy``, lower bounds on the energy of a cycle minus ``slope`` (of the power
    over the load at each sample [W/(N m)], (N,)) times the deviation of the load from the middle of its interval [J].
    ``open_energy``: see ``energy_of_slope``.
    """
    count, least = 0, np.inf
    key, full, stops = data.key, data.full, data.stops
    own, no_slope = len(full.unit_torque), np.zeros(len(slope))
    for i in range(len(pairs)):
        least = min(least, cost[i]) if exact[i] else least
    for i in range(len(pairs)):
        if exact[i] or cost[i] >= cost_limit or not (test_all or cost[i] < least):
            continue
        count += 1
        case, row, amounts = set_case(data.cases, pairs[i]), data.cases.row[0], data.parameters[pairs[i]][:own]
        set_limits(case)
        used[i] = np.inf
        if strict and first_lacking(case, row, checks, NO) >= 0:
            continue
        used[i], heat = bound_case(case, row, checks, key, stops, amounts, until, YES)
        if used[i] <= until:
            used[i], heat = bound_case(case, row, checks, full, stops, amounts, until, NO)
        if with_energy and used[i] <= until:
            energy[i] = least_energy(case, full, heat, slope)
            drawn = energy[i] - open_energy
            if energy_weight != 0.0 and open_energy != 0.0:
                drawn = max(drawn, least_energy(case, full, heat, no_slope))
            rounded = drawn * (ROUND_DOWN if drawn > 0.0 else 1.0 / ROUND_DOWN)
            cost[i] = max(cost[i], base[pairs[i]] + energy_weight * rounded)
        if used[i] <= until and cost[i] < cost_limit:
            least = min(least, cost[i])
    return count


@law
def set_case(numbers: CaseNumbers, pair: Any) -> Any:
    """Set the buffer to the case of a pair, all figures unknown, and return it."""
    motor, gear, case, row = numbers.pairs[pair, 0], numbers.pairs[pair, 1], numbers.case[0], numbers.row[0]
    copy_numbers(numbers.template[0], row, 0)
    copy_numbers(numbers.motors[motor], row, MOTOR_AT)
    copy_numbers(numbers.shafts[motor], row, SHAFT_AT)
    copy_numbers(numbers.gears[gear], row, GEAR_AT)
    case.direct = numbers.direct[gear]
    return case


@law
def copy_numbers(numbers: Any, row: Any, at: Any) -> None:
    for i in range(len(numbers)):
        row[at + i] = numbers[i]


def fill_key_samples(key: TorqueInterval, full: TorqueInterval, acceleration_peaks: Any) -> None:
    """Fill the key samples: of each section of the cycle those of largest acceleration and of largest certain torque.

    The certain torque is the smallest magnitude in the interval.
    """
    key.powers.exponent[0] = np.nan  # the speeds change
    at = np.concatenate([acceleration_peaks, section_peaks(np.maximum(full.low, -full.high))])
    for name in ("low", "high", "friction", "loss_friction", "unit_torque"):
        np.take(getattr(full, name), at, axis=-1, out=getattr(key, name))
    for name in ("speed", "loss_speed", "acceleration", "carrier_acceleration"):
        np.take(getattr(full.motion, name), at, out=getattr(key.motion, name))


def section_peaks(values: Array) -> Any:
    """Sample of the largest value in each of SECTIONS sections of equal length."""
    length, first = len(values) // SECTIONS, np.arange(SECTIONS)
    if length == 0:
        return first % len(values)
    return first * length + values[: SECTIONS * length].reshape(SECTIONS, length).argmax(axis=1)


def energy_of_slope(half_width: Array, unit_torque: Array, weighted: Array) -> float:
    """Largest magnitude of the slope times the deviation of the load, summed over a cycle [J].

    The load deviates from the middle of its interval by the parameters of the open drives; this is the part of the
    energy that depends on them and not on the candidate. ``weighted``: the slope times the weight of each sample.
    """
    moved = half_width > 0.0
    return float(half_width[moved] @ np.abs(unit_torque[moved] @ weighted))


@law(fastmath=FAST)
def bound_case(
    case: Any, row: Any, checks: Any, interval: TorqueInterval, stops: CurrentStops, amounts: Any, until: Any,
    peaks_only: Any,
) -> Any:  # fmt: skip
    """Fill the figures of one case with lower bounds, stage by stage; returns lower bounds on the largest utilisation
    and on the temperatures.

    ``row`` is the case as plain numbers, ``amounts`` the load parameters of its drive if it loads its own joint.
    ``peaks_only``: the samples are not all of the cycle, so that only checks on peak values are made.
    """
    gear, motor, setting, figures = case.gear, case.motor, case.setting, case.figures
    unknown = unknown_torque(case)
    if setting.cold != 0.0:
        set_cold_start(case, least_mechanical(case, interval, amounts, setting.cold_start).torque + unknown)
    found = least_mechanical(case, interval, amounts, setting.gear_temperature)
    figures.load_torque, figures.joint_torque = found.load, found.load
    if setting.jam != 0.0:
        set_jam(case)
    stop = least_hard_stop(case, stops, amounts)
    figures.momentary_torque, figures.stop_motor_torque = larger(found.load, stop.load), stop.torque
    if not peaks_only:
        least_loads, products = interval.least_loads, interval.bearing_products
        stop_torque, travel = stop.load, stop.travel
        if known(least_loads[5]):
            stop_torque, travel = least_loads[5], 0.5 * setting.fastest * setting.stop_ramp
            figures.momentary_torque = larger(figures.momentary_torque, stop_torque)
        if stop_torque * case.safety.peak_torque * ROUND_DOWN > case.limits.repeated_peak_torque:
            figures.permitted_peaks = permitted_peaks(gear.momentary_waves, gear.ratio, travel)
        figures.average_load_torque = least_average(case, interval)
        figures.gear_life = life_of(gear, figures.average_load_torque, figures.mean_input_speed)
        arm, square, radial = bearing_arm(gear), 0.0, least_loads[2]
        lever = known_or(arm, 0.0)
        for t in range(products.shape[1]):  # as ``moment_square``, with the smallest value of each term
            square = larger(square, products[0, t] + lever * (lever * products[1, t] + 2.0 * products[2, t]))
        figures.tilting_moment = math.sqrt(square) + 0.0 * (arm + radial)  # NaN if one of them is unknown
        figures.axial_load, figures.radial_load = least_loads[1], radial
        figures.required_stiffness = setting.resonance * setting.resonance * (least_loads[4] + gear.stage_sprung)
        figures.bearing_static_load = static_load(
            gear.bearing_pitch_diameter, figures.tilting_moment, figures.radial_load, figures.axial_load
        )
        figures.holding_torque = holding_torque(least_loads[3], gear.ratio)
    used, _ = worst(case, row, checks, GEAR, 0.0, NOTHING, peaks_only)
    used, _ = worst(case, row, checks, SPEED, used, NOTHING, peaks_only)
    figures.motor_torque = found.torque + unknown
    figures.rms_torque = math.sqrt(found.square / setting.duration) + unknown
    figures.phase_torque = math.sqrt(found.phase / setting.duration) + unknown
    used, _ = worst(case, row, checks, TORQUE, used, NOTHING, peaks_only)
    if peaks_only or used > until:
        return used, LeastHeat(np.nan, np.nan, np.nan)
    heat = least_heat(case, interval)

    heated, weakest = heat.hottest > -np.inf, torque_constant(motor, heat.magnets)
    figures.winding_temperature = heat.hottest + unknown if heated else np.nan
    figures.phase_temperature = figures.winding_temperature + least_phase_rise(case, heat, found)
    if weakest <= 0.0:  # thermal runaway; an unknown torque does not prove one
        return np.inf if known(unknown) else used, heat
    # otherwise warm magnets have no upper bound on their torque constant
    if motor.magnet_coefficient <= 0.0 or not heated:
        set_currents(case, weakest)
    # as cold as the ambient, and as warm as a feasible candidate may be
    warmest = case.limits.winding_temperature if heated else heat.coolest
    cold, ohms = torque_constant(motor, setting.ambient), winding_resistance(motor, setting.ambient)
    weakened = torque_constant(motor, warmest if heated else setting.ambient)
    ends, volts = (winding_resistance(motor, heat.coolest), winding_resistance(motor, warmest)), 0.0
    for factor in (1.0, torque_factor(case.safety)):
        volts = larger(volts, least_voltage(case, interval, (cold, cold), (ohms, ohms), factor))
        if weakened > 0.0 and not (heated and motor.magnet_coefficient > 0.0):
            volts = larger(volts, least_voltage(case, interval, (weakened, weakest), ends, factor))
    figures.voltage = volts + unknown
    used, _ = worst(case, row, checks, HEAT, used, NOTHING, NO)
    return used, heat


class LeastStop(NamedTuple):
    """Bounds on stops at a current limit."""

    load: float  # lower bound on the largest torque of the gear [N m]
    torque: float  # lower bound on the largest motor torque that holds the load [N m]
    travel: float  # upper bound on the angle until standstill [rad]


@law
def least_hard_stop(case: Any, stops: CurrentStops, amounts: Any) -> Any:
    """Bounds on stops at the current limit; see ``judge.hard_stop``.

    The torque of the gear rises with the static torque and is monotonic in the inertia, and so is the deceleration.
    Their extremes are therefore at the ends of both intervals.
    """
    setting, gear = case.setting, case.gear
    if len(stops.speed) == 0 or setting.ramped != 0.0 or not known(setting.stop_current + unknown_torque(case)):
        return LeastStop(0.0, np.nan, 0.0)
    mesh, shaft, ratio = mesh_of(gear), friction_curve(case.shaft), gear.ratio
    largest, holding, longest = 0.0, 0.0, 0.0
    inertia = drive_inertia(case)
    rides, limit = setting.rides, stop_constant(case) * setting.stop_current
    weaker = case.motor.torque_constant * setting.stop_current
    rotor, riding = stop_rotor(ratio, inertia, rides)
    factor, spring = drag_factor(mesh, stop_temperature(case)), swing_spring(gear)
    stiff, swings = stiff_spring(gear).slope_3, 1.0 if setting.stop_rise <= 0.0 else 0.0
    for t in range(len(stops.speed)):
        speed, acceleration, own_torque, own_inertia = stops.loss_speed[t], stops.acceleration[t], 0.0, 0.0
        for k in range(len(amounts)):
            own_torque += amounts[k] * stops.unit_torque[k, t]
            own_inertia += amounts[k] * stops.unit_inertia[k, t]
        sign, low, high, slowing = direction(speed), np.inf, -np.inf, 0.0
        carrier = stops.carrier_acceleration[t] - rides * acceleration
        push = braking_push(mesh, shaft, factor, inertia, limit, speed, carrier)
        unaided = braking_push(mesh, shaft, 0.0, inertia, weaker, speed, carrier)
        own = own_inertia + riding
        least = max(max(stops.inertia[0, t] + own_inertia, 0.0) + riding, 0.0)
        for i in range(2):
            static = stops.static[i, t] + own_torque - own * acceleration
            for j in range(2):
                load = max(stops.inertia[j, t] + own_inertia, 0.0) + riding
                torque = braked(mesh.driving, mesh.driven, rotor, push, static, load, sign).torque
                free = braked(1.0, 1.0, rotor, unaided, static, load, sign)
                slowing = max(slowing, -sign * free.acceleration if load + rotor > 0.0 else np.inf)
                for k in range(2):
                    swung = swung_torque(spring, stops.torque[k, t] + own_torque, torque, 1.0)
                    low, high = min(low, swung), max(high, swung)
                    if swings == 0.0:
                        low, high = min(low, torque), max(high, torque)
        below, above = stops.static[0, t] + own_torque - own * acceleration, stops.static[1, t]
        held = max(below, -(above + own_torque - own * acceleration), 0.0)
        holding = max(holding, held / abs(ratio))
        most = (
            held + least * abs(acceleration) + abs(stops.speed[t]) * math.sqrt((stiff if known(stiff) else 0.0) * least)
        )
        swung = max(low, -high, 0.0) if high < np.inf else 0.0
        largest = max(largest, min(swung, most) if known(stiff) else swung)
        longest = max(longest, 0.5 * speed * speed / slowing if slowing > 0.0 else np.inf)
    return LeastStop(largest, holding, longest)


class LeastMechanical(NamedTuple):
    """Lower bounds on the fields of ``judge.Mechanical``."""

    load: float  # largest torque at the gear's output [N m]
    torque: float  # largest torque of the motor [N m]
    square: float  # time integral of its square [N^2 m^2 s]
    phase: float  # the same integral for the most loaded phase [N^2 m^2 s]


@law(fastmath=FAST)
def least_mechanical(case: Any, interval: TorqueInterval, amounts: Any, gear_temperature: Any) -> Any:
    """Fill the ends of the motor's torque at every sample, and return the bounds that follow from them."""
    motion, low, high = interval.motion, interval.total_low, interval.total_high
    friction, loss_friction = interval.friction, interval.loss_friction
    add_rows(interval.low, interval.unit_torque, amounts, low)
    for t in range(len(low)):
        high[t] = low[t] + (interval.high[t] - interval.low[t])
    mesh, inertia = mesh_of(case.gear), drive_inertia(case)
    at_shaft, excess = friction_curve(case.shaft), interval.excess
    excess_series(at_shaft, mesh.ratio, motion.loss_speed, excess)
    drag_series(mesh, gear_temperature, motion.loss_speed, interval.powers, interval.drag)
    motor_low, motor_high, shaft = interval.motor_low, interval.motor_high, interval.shaft
    load, torque, square, phase = 0.0, 0.0, 0.0, 0.0
    for t in range(len(low)):
        speed = motion.loss_speed[t]
        shaft[t] = (
            rotor_torque(inertia, mesh.ratio, motion.acceleration[t], motion.carrier_acceleration[t])
            + sliding_friction(at_shaft, mesh.ratio * speed) + excess[t] + interval.drag[t]
        )  # fmt: skip
        a, b = low[t] + loss_friction[t], high[t] + loss_friction[t]
        first, second = mesh_torque(mesh, a, speed), mesh_torque(mesh, b, speed)
        bend = 0.0 if (a < 0.0) & (b > 0.0) else first
        motor_low[t] = smaller(smaller(first, second), bend) + shaft[t]
        motor_high[t] = larger(larger(first, second), bend) + shaft[t]
        load = larger(load, larger(low[t] + friction[t], -(high[t] + friction[t])))
        magnitude = larger(larger(motor_low[t], -motor_high[t]), 0.0)
        torque = larger(torque, magnitude)
        heating = motion.weight[t] * magnitude * magnitude
        square += heating
        phase += heating * motion.phase_ratio[t] * motion.phase_ratio[t]
    if case.setting.moves != 0.0:
        joint = friction_curve(case.joint)
        for first_sample, after in motion.rests:
            for t in range(first_sample, after):  # breakaway, if the sign of the load is known
                a, b = low[t] + friction[t], high[t] + friction[t]
                if a > 0.0 or b < 0.0:
                    sign, nearest = direction(a + b), a if a > 0.0 else b
                    load = larger(load, abs(nearest + breakaway_friction(joint, sign)))
                a, b = low[t], high[t]
                if a > 0.0 or b < 0.0:
                    rotor = rotor_torque(inertia, mesh.ratio, motion.acceleration[t], motion.carrier_acceleration[t])
                    sign = direction(a + b)
                    start = breakaway_motor_torque(mesh, at_shaft, joint, a, sign) + rotor
                    other = breakaway_motor_torque(mesh, at_shaft, joint, b, sign) + rotor
                    if start * other > 0.0:
                        torque = larger(torque, smaller(abs(start), abs(other)))
    return LeastMechanical(load, torque, square, phase)


@law(fastmath=FAST)
def least_average(case: Any, interval: TorqueInterval) -> Any:
    """Lower bound on the average load that counts for wear [N m]; Harmonic Drive SHG, p. 30."""
    motion, low, high, exponent = interval.motion, interval.total_low, interval.total_high, case.gear.life_exponent
    friction, total, travel, largest = interval.friction, 0.0, 0.0, 0.0
    for t in range(len(low)):
        angle = motion.weight[t] * abs(motion.speed[t])
        load = larger(larger(low[t] + friction[t], -(high[t] + friction[t])), 0.0)
        total += angle * wear(load, exponent)
        travel += angle
        largest = larger(largest, load)
    return (total / travel) ** (1.0 / exponent) if travel > 0.0 else largest


class LeastHeat(NamedTuple):
    """Lower bounds on the temperatures of a motor [C].

    If the data sheet lacks thermal data, the hottest is -inf, the coolest at most the winding's limit, and the magnets
    are at ambient temperature.
    """

    coolest: float  # temperature of the winding at every instant
    magnets: float  # mean temperature of the magnets
    hottest: float  # largest temperature of the winding


@law(fastmath=FAST)
def least_heat(case: Any, interval: TorqueInterval) -> Any:
    """Lower bounds on the temperatures of a motor.

    The mean heat of a cycle can be bounded from below before any temperature is known. It warms the magnets, which then
    need more current, and the winding, which then has more resistance; both add to the heat. Each step of this
    iteration is a lower bound, and the next one starts from it.
    """
    motor, setting, ambient = case.motor, case.setting, case.setting.ambient
    nodes, limit = thermal_nodes(motor, setting.mounting), motor.max_winding_temperature
    if not known(nodes.inner + nodes.outer):
        return LeastHeat(known_or(limit, ambient), ambient, -np.inf)
    # torque constant without upper bound, or no check against runaway
    if motor.magnet_coefficient > 0.0 or not known(limit):
        return LeastHeat(smaller(ambient, known_or(limit, ambient)), ambient, ambient)
    square = least_mean_square(interval.motor_low, interval.motor_high, interval.step_share)
    loss = least_housing_loss(case, interval, nodes, square)
    share = resting_share(nodes, len(interval.motion.periods.shares), setting.duration)
    coolest, housing, winding = ambient, 0.0, 0.0
    for _ in range(MAX_HEAT_STEPS):
        constant, before = torque_constant(motor, ambient + housing), winding
        if not constant > 0.0:
            return LeastHeat(coolest, ambient + housing, np.inf)
        copper = square / (constant * constant) * winding_resistance(motor, coolest)
        housing = nodes.outer * (copper + loss)
        winding, coolest = nodes.inner * copper + housing, ambient + share * housing
        if winding - before <= HEAT_TOLERANCE * winding:
            break
    return LeastHeat(coolest, ambient + housing, ambient + winding)


@law(fastmath=FAST)
def least_mean_square(least: Any, most: Any, share: Any) -> Any:
    """Lower bound on the mean square of the motor's torque, linear between samples [N^2 m^2]."""
    low, high, low_after, high_after, total = least[:-1], most[:-1], least[1:], most[1:], 0.0
    for t in range(len(low)):
        a = larger(low[t], 0.0) + smaller(high[t], 0.0)
        b = larger(low_after[t], 0.0) + smaller(high_after[t], 0.0)
        same_sign = mean_square(a, b)
        other_sign = 0.25 * larger(a * a, b * b)  # the minimum of that expression while the larger one is fixed
        total += share[t] * (same_sign if a * b > 0.0 else other_sign)
    return total


@law(fastmath=FAST)
def least_housing_loss(case: Any, interval: TorqueInterval, nodes: Any, square: Any) -> Any:
    """Lower bound on the mean power of shaft friction and gear losses that heats the motor's housing [W].

    Friction that falls with speed is left out. The drag of a gear falls as other losses warm it, but the sum of both
    does not. ``excess`` and ``drag`` are overwritten: by the loss without drag, and by the power of the drag.
    """
    shaft, mesh, speed = friction_curve(case.shaft), mesh_of(case.gear), interval.motion.speed
    low, high, friction, share = interval.total_low, interval.total_high, interval.friction, interval.step_share
    gear_heat, counts_friction = case.setting.gear_heat, not shaft.falls
    loss, drag_power, total, total_drag = interval.excess, interval.drag, 0.0, 0.0
    coil = known_or(case.motor.brake.power, 0.0)
    for t in range(len(loss)):
        motor_speed, a, b = mesh.ratio * speed[t], low[t] + friction[t], high[t] + friction[t]
        load = larger(a, 0.0) + smaller(b, 0.0)  # smallest magnitude, at which the mesh loss is smallest
        seal = mesh.seal * abs(motor_speed) * (drag_power[t] != 0.0)
        drag_power[t] = drag_power[t] * motor_speed - seal
        loss[t] = coil + gear_heat * (mesh_loss_power(mesh, load, speed[t]) + seal)
        loss[t] += sliding_friction(shaft, motor_speed) * motor_speed * counts_friction
    for t in range(len(loss) - 1):
        total += 0.5 * share[t] * (loss[t] + loss[t + 1])
        total_drag += 0.5 * share[t] * (drag_power[t] + drag_power[t + 1])
    drag = gear_heat * total_drag / drag_factor(mesh, case.setting.gear_temperature)
    if nodes.inner == 0.0 and len(interval.motion.periods.shares) > 1:  # each part has its own temperature
        return total
    return total + drag * settled_factor(case, nodes, square, total, drag)


@law(fastmath=FAST)
def resting_share(nodes: Any, parts: Any, duration: Any) -> Any:
    """Lower bound on the winding's temperature rise at any instant, as a share of the housing's mean rise.

    The response of the housing to an impulse of heat in the winding, repeated with the cycle, is the difference of two
    exponentials, which is least at the instant of the impulse. The winding responds in the same way to heat in the
    housing, and is warmer than the housing while it is heated itself. No distribution of the same heat over the cycle
    keeps it cooler at an instant. The response of a single node is one exponential, least before the next impulse.
    """
    inner, outer = nodes.inner, nodes.outer
    if inner == 0.0 and parts > 1:
        return 0.0
    if math.isnan(nodes.winding):
        return 1.0
    if inner == 0.0:
        decay = duration / (outer * nodes.winding)
        return decay / math.expm1(decay)
    if parts > 1 or math.isnan(nodes.housing):
        return 0.0
    a, c = 1.0 / (inner * nodes.winding), 1.0 / (inner * nodes.housing)
    d = (1.0 / inner + 1.0 / outer) / nodes.housing
    middle, spread = 0.5 * (a + d), math.sqrt(0.25 * (a - d) ** 2 + a * c)
    slow, quick = (a * d - a * c) / (middle + spread), middle + spread
    left = 1.0 / -math.expm1(-slow * duration) - 1.0 / -math.expm1(-quick * duration)
    return min(max(duration * slow * quick / (quick - slow) * left, 0.0), 1.0)


@law
def least_phase_rise(case: Any, heat: LeastHeat, found: LeastMechanical) -> Any:
    """Lower bound on the rise of the phase that carries most current at rest above the winding [C]: its mean."""
    nodes = thermal_nodes(case.motor, case.setting.mounting)
    alone = (found.phase - found.square) / case.setting.duration
    inner = nodes.inner if nodes.inner > 0.0 else nodes.outer
    return inner * alone * certain_loss(case.motor, heat.magnets, heat.hottest, heat.hottest > -np.inf)


@law(fastmath=FAST)
def least_voltage(case: Any, interval: TorqueInterval, constants: Any, ohms: Any, factor: Any) -> Any:
    """Lower bound on the largest voltage, the torque times a factor [V].

    Torque constant and winding resistance lie between two ends each. The first and the last sample are left out.
    """
    motion, least, most = interval.motion, interval.motor_low, interval.motor_high
    ratio, inductance, largest = case.gear.ratio, known_or(case.motor.inductance, 0.0), 0.0
    (weak, strong), (cool, warm) = constants, ohms
    more, less = factor / weak, factor / strong
    l0, l1, l2, h0, h1, h2 = least[:-2], least[1:-1], least[2:], most[:-2], most[1:-1], most[2:]
    speed, behind = motion.speed[1:-1], motion.rates[0, 1:-1]
    at, ahead = motion.rates[1, 1:-1], motion.rates[2, 1:-1]
    for t in range(len(speed)):
        emf, low, high = ratio * speed[t], smaller(cool * l1[t], warm * l1[t]), larger(cool * h1[t], warm * h1[t])
        low += inductance * smaller(behind[t] * l0[t], behind[t] * h0[t])
        low += inductance * (smaller(at[t] * l1[t], at[t] * h1[t]) + smaller(ahead[t] * l2[t], ahead[t] * h2[t]))
        high += inductance * larger(behind[t] * l0[t], behind[t] * h0[t])
        high += inductance * (larger(at[t] * l1[t], at[t] * h1[t]) + larger(ahead[t] * l2[t], ahead[t] * h2[t]))
        low = smaller(weak * emf, strong * emf) + smaller(more * low, less * low)
        high = larger(weak * emf, strong * emf) + larger(more * high, less * high)
        largest = larger(largest, larger(low, -high))
    return largest


# Energy


@law(fastmath=FAST)
def certain_loss(motor: Any, magnets: Any, coolest: Any, heated: Any) -> Any:
    """Lower bound on the copper loss per square of the torque, at any temperature that occurs [W/(N m)^2]."""
    constant = torque_constant(motor, magnets)
    if not constant > 0.0 or (motor.magnet_coefficient > 0.0 and heated):
        return 0.0
    return winding_resistance(motor, coolest) / (constant * constant)


@kernel(fastmath=FAST)
def mean_power_slope(numbers: CaseNumbers, motion: Any, load: Array, pairs: Any, first: bool, slope: Array) -> None:
    """Add the slope of the power over the load [W/(N m)], (N,), the mean over some candidates.

    These are the first ones, or evenly spaced. Any slope gives valid bounds; that at the middle of the load's interval
    gives tight ones. ``motion``: speed, its sign for the losses, and acceleration; ``load``: with joint friction.
    """
    speed, loss_speed, acceleration = motion
    count = min(len(pairs), SLOPE_CANDIDATES)
    for i in range(count):
        case = set_case(numbers, pairs[i if first else i * len(pairs) // count])
        mesh, ambient = mesh_of(case.gear), case.setting.ambient
        inertia = drive_inertia(case)
        loss = certain_loss(case.motor, ambient, ambient, NO)
        for t in range(len(slope)):
            per_load = mesh_slope(mesh, load[t] * loss_speed[t])
            torque = per_load * load[t] + inertia * mesh.ratio * acceleration[t]
            slope[t] += per_load * (mesh.ratio * speed[t] + 2.0 * loss * torque) / count


@law(fastmath=FAST)
def least_energy(case: Any, interval: TorqueInterval, heat: LeastHeat, slope: Any) -> Any:
    """Lower bound on the energy minus ``slope`` times the deviation of the load from the middle of its interval [J].

    The motor's torque is one straight line for a positive load and another one for a negative load, so the power is a
    parabola on each side, least at its vertex or at an end. If a self-locking gear is at rest, the torque of smallest
    magnitude counts.
    """
    motion, low, high, shaft = interval.motion, interval.total_low, interval.total_high, interval.shaft
    friction, mesh, motor_low, motor_high = (
        interval.loss_friction, mesh_of(case.gear), interval.motor_low, interval.motor_high,
    )  # fmt: skip
    total = known_or(case.motor.brake.power, 0.0) * case.setting.duration
    loss, locks = certain_loss(case.motor, heat.magnets, heat.coolest, heat.hottest > -np.inf), mesh.grip != 0.0
    for t in range(len(slope)):
        speed, motor_speed, own, charged = motion.loss_speed[t], mesh.ratio * motion.speed[t], shaft[t], slope[t]
        up, down = mesh_slope(mesh, speed), mesh_slope(mesh, -speed)
        a, b = low[t] + friction[t], high[t] + friction[t]
        # the power is a constant and, on either side, a parabola of the load
        constant, linear = own * (motor_speed + loss * own) + charged * 0.5 * (a + b), motor_speed + 2.0 * loss * own
        positive = least_of_parabola(loss * up * up, up * linear - charged, larger(a, 0.0), larger(b, 0.0))
        negative = least_of_parabola(loss * down * down, down * linear - charged, smaller(a, 0.0), smaller(b, 0.0))
        least = smaller(positive, negative)
        least = positive if a >= 0.0 else (negative if b <= 0.0 else least)
        nearest = larger(motor_low[t], 0.0) + smaller(motor_high[t], 0.0)
        locked = loss * nearest * nearest - 0.5 * abs(charged) * (b - a)
        total += motion.weight[t] * (locked if (speed == 0.0) & locks else least + constant)
    return total


@law(fastmath=FAST)
def least_of_parabola(square: Any, linear: Any, begin: Any, end: Any) -> Any:
    """The minimum of square x^2 + linear x from begin to end, square at least 0."""
    vertex = -linear / (2.0 * square) if square > 0.0 else (begin if linear > 0.0 else end)
    at = smaller(larger(vertex, begin), end)
    return (square * at + linear) * at


# Power


@kernel(fastmath=FAST)
def candidate_power_range(data: BoundData, pairs: Any, least: Array, most: Array) -> None:
    """Fill the bounds on the power of any of some candidates, none hotter than it may be [W], (N,) each."""
    full, own = data.full, len(data.full.unit_torque)
    motion = full.motion
    least[:], most[:] = np.inf, -np.inf
    for pair in pairs:
        case = set_case(data.cases, pair)
        motor, setting = case.motor, case.setting
        least_mechanical(case, full, data.parameters[pair][:own], setting.gear_temperature)
        path, ambient, limit = thermal_nodes(motor, setting.mounting), setting.ambient, motor.max_winding_temperature
        heated = known(path.inner + path.outer)
        coolest = smaller(ambient, known_or(limit, ambient)) if heated else known_or(limit, ambient)
        certain = certain_loss(motor, ambient, coolest, heated)
        hottest = larger(limit - case.safety.temperature_margin, ambient) if heated else known_or(limit, ambient)
        weakest = torque_constant(motor, hottest if heated and motor.magnet_coefficient < 0.0 else ambient)
        switches = known_or(case.amplifier.on_resistance, 0.0)
        loss = (winding_resistance(motor, hottest) + conduction_loss(switches, 1.0)) / (weakest * weakest)
        bounded = weakest > 0.0 and not math.isnan(limit if heated else ambient)
        coil = known_or(motor.brake.power, 0.0)
        for t in range(len(least)):
            low, high, speed = full.motor_low[t], full.motor_high[t], case.gear.ratio * motion.speed[t]
            best = (low if speed > 0.0 else high) if certain == 0.0 else -0.5 * speed / certain
            best = larger(low, smaller(high, best))
            least[t] = smaller(least[t], best * (speed + certain * best) + coil)
            ends = larger(low * (speed + loss * low), high * (speed + loss * high)) if bounded else np.inf
            most[t] = larger(most[t], ends + coil)
