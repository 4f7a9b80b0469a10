"""What candidates ask at least while the torque of their joint lies in an interval at every sample.

The figures of a judgement are bounded by the same laws and held against the same table of checks; a figure that nothing
bounds stays unknown, and its checks are not made. The motor's torque is a function of the gear's at each sample: two
straight lines that meet where the power through the mesh turns. Its range over an interval is that of the ends, and of
the bend where it lies between them, whether the mesh locks itself or not. What is feasible is never ruled out.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.amplifier import conduction_loss
from drivetrain.drive.brake import holding_torque
from drivetrain.drive.drive import rotor_torque, starting_torque
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
from drivetrain.drive.motor import torque_constant, winding_resistance
from drivetrain.drive.stops import braked, braking_push, stiff_spring, stop_rotor, swing_spring, swung_torque
from drivetrain.drive.thermal.periodic_heat import thermal_nodes
from drivetrain.jit import FAST, kernel, law
from drivetrain.records import known, known_or
from drivetrain.sizing.demand.series import Motion, Powers, new_powers
from drivetrain.sizing.judge.cases import stop_constant, stop_temperature
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

STEPS = 8  # of the ladder of temperatures at most; each adds a few percent of the one before
ENOUGH = 1e-3  # of the rise: a step that adds less is the last
SAMPLED = 8  # candidates whose power the line of energy is taken from
WIDER = 1e-12  # of an interval's width and middle: rounding of the sums that make it
BELOW = 1.0 - 2e-9  # a bound stays a bound though it is rounded


class Brake(NamedTuple):
    """What open choices leave possible at one joint where a stop at the current limit begins, at a few samples, B.

    The ends are memory: of the load's torque, of that without what its own acceleration asks, and of its inertia, what
    the joint's own drive adds not in them.
    """

    speed: Array  # as in ``Motion``, (B,)
    loss_speed: Array
    acceleration: Array
    carrier_acceleration: Array
    added_torque: Array  # what a unit of each number of the joint's own drive adds, (K, B)
    added_inertia: Array
    torque: Array  # ends [N m], (2, B)
    static: Array
    inertia: Array  # [kg m^2]


class Span(NamedTuple):
    """What open choices leave possible at one joint, at all samples or at a few; N samples.

    All but the first five is memory.
    """

    motion: Motion  # of the joint
    shown: Array  # friction of the joint at its speed [N m], (N,)
    lossy: Array  # the same at the speed that decides the losses
    added: Array  # what a unit of each number of the joint's own drive adds to its torque, (K, N)
    share: Array  # of the time of use between each sample and the next, (N,)
    low: Array  # ends of the torque at the gear's output, joint friction and own drive not in it [N m], (N,)
    high: Array
    own_low: Array  # with what the joint's own drive adds
    own_high: Array
    least: Array  # ends of the motor's torque [N m], (N,)
    most: Array
    shaft: Array  # the motor's torque without what crosses the mesh [N m], (N,)
    excess: Array  # of falling friction at the shaft [N m], (N,)
    drag: Array  # of the gear, at its input [N m], (N,)
    powers: Powers  # for the drag
    # least tilting moment, axial and radial load on the output bearing [N m], [N], least torque that holds the worst
    # position still [N m], least of the largest inertia [kg m^2], torque in stops on a ramp [N m]; NaN: nobody knows
    still: Array
    # of the output bearing at a few samples the least squares of the tilting moment and of the radial load, and the
    # least of |mx fy - my fx|, (3, B)
    tilts: Array


class Sheets(NamedTuple):
    """What a pair's case is made of."""

    plain: Any  # a case of the joint, whatever its motor and gear, (1,)
    case: Any  # memory: the case of one candidate, (1,)
    motors: Any  # records of motors and of their shafts' friction
    shafts: Any
    gears: Any  # records of gears, and whether they are none
    direct: Array
    pairs: Any  # row of motor and gear of all pairs of the study, (P, 2)


class Offer(NamedTuple):
    """The candidates of one joint for compiled code, K other joints' drives that load it, and its bounds' memory.

    A law takes the parts that it needs: each array of what is handed on is compiled, whether it is looked at or not.
    """

    sheets: Sheets
    row: Array  # the memory of the case as plain floats, (1, floats)
    parameters: Array  # load parameters of each pair, (P, NUMBERS)
    load: Array  # torque without drives [N m], (N,)
    others: Any  # joints whose drives load this one, (K,)
    rows: Array  # what a unit of each number of each of them adds, (K, NUMBERS, N)
    half: Array  # memory: half the width of each of these numbers, (K, NUMBERS)
    sharp: Any  # in each stretch of the cycle the sample of largest acceleration, (STRETCHES,)
    few: Span  # what is possible at those, and at as many samples of large torque
    whole: Span  # at all samples
    brake: Brake  # stops at the current limit


def span_of(motion: Motion, friction: Friction, added: Array, share: Array, bearing: int) -> Span:
    """A span with memory of its own; ``bearing``: samples at which the output bearing is looked at."""
    shown, lossy = friction_torque(friction, motion.speed), friction_torque(friction, motion.loss_speed)
    memory: Any = (*np.zeros((9, len(share))), new_powers(len(share)), np.full(6, np.nan), np.zeros((3, bearing)))
    return Span(motion, shown, lossy, added, share, *memory)


@kernel(fastmath=FAST)
def open_span(
    load: Array, others: Any, rows: Array, low: Array, high: Array, half: Array, bottom: Array, top: Array
) -> None:
    """Fill half widths and ends of the torque that open choices leave, as in ``Offer``.

    ``low``, ``high``: numbers of all joints' drives, (n, NUMBERS).
    """
    middle = np.empty(half.shape[1])
    for t in range(len(bottom)):
        bottom[t] = load[t]
    for k in range(len(others)):
        least, most = low[others[k]], high[others[k]]
        for i in range(len(middle)):
            wide = 0.5 * (most[i] - least[i])
            middle[i] = 0.5 * (least[i] + most[i])
            half[k, i] = wide + WIDER * (wide + abs(middle[i])) if wide > 0.0 else 0.0
        add_rows(bottom, rows[k], middle, bottom)
    for t in range(len(bottom)):
        top[t] = bottom[t]
    for k in range(len(others)):
        for i in range(half.shape[1]):
            row, half_width = rows[k, i], half[k, i]
            if half_width > 0.0:
                for t in range(len(row)):
                    wide = half_width * abs(row[t])
                    bottom[t] -= wide
                    top[t] += wide


@kernel(fastmath=FAST)
def bound_candidates(
    offer: Offer, checks: Any, pairs: Any, exact: Any, until: float, strict: bool, room: float, full: bool,
    energies: bool, weight: float, base: Array, cost: Array, used: Array, energy: Array, line: Array,
) -> int:  # fmt: skip
    """What candidates of one joint ask at least, with any torque in its interval (``open_span``); how many were tested.

    One that asks more than ``until``, that costs ``room`` or more or whose cost is ``exact`` is looked at no further;
    with ``strict`` one of which an essential check cannot be made is out; not ``full``: only those that may be the
    cheapest are looked at. ``base`` (P,) and ``weight`` make the cost. ``cost`` (K,) is raised by the energy that is
    certain, ``used`` (K,) becomes the largest utilisation, infinite where one is out, ``energy`` (K,) that of a cycle
    less the line times what the load is above the middle of its interval [J], ``line`` (N,) how the power grows with
    the load [W/(N m)].
    """
    count, least, open_energy = 0, np.inf, 0.0
    few, whole, sheets, brake = offer.few, offer.whole, offer.sheets, offer.brake
    own, flat = len(whole.added), np.zeros(len(line))
    for i in range(len(pairs)):
        least = min(least, cost[i]) if exact[i] else least
    look_closer(few, whole, offer.sharp)
    if energies:
        power_line(sheets, whole, pairs, weight != 0.0, line)
        open_energy = energy_of_line(offer.half, offer.rows, whole.motion.weight, line)
    for i in range(len(pairs)):
        if exact[i] or cost[i] >= room or not (full or cost[i] < least):
            continue
        count += 1
        case, row, amounts = put(sheets, pairs[i]), offer.row[0], offer.parameters[pairs[i]][:own]
        set_limits(case)
        used[i] = np.inf
        if strict and first_lacking(case, row, checks, NO) >= 0:
            continue
        used[i], heat = bound(case, row, checks, few, brake, amounts, until, YES)
        if used[i] <= until:
            used[i], heat = bound(case, row, checks, whole, brake, amounts, until, NO)
        if energies and used[i] <= until:
            energy[i] = least_energy(case, whole, heat, line)
            drawn = energy[i] - open_energy
            if weight != 0.0 and open_energy != 0.0:
                drawn = max(drawn, least_energy(case, whole, heat, flat))
            cost[i] = max(cost[i], base[pairs[i]] + weight * drawn * (BELOW if drawn > 0.0 else 1.0 / BELOW))
        if used[i] <= until and cost[i] < room:
            least = min(least, cost[i])
    return count


@law
def put(sheets: Sheets, pair: Any) -> Any:
    """The case of a pair, with nothing found yet."""
    motor, gear, case = sheets.pairs[pair, 0], sheets.pairs[pair, 1], sheets.case[0]
    sheets.case[0] = sheets.plain[0]
    case.motor, case.shaft = sheets.motors[motor], sheets.shafts[motor]
    case.gear, case.direct = sheets.gears[gear], sheets.direct[gear]
    return case


@law
def look_closer(few: Span, whole: Span, sharp: Any) -> None:
    """Fill the few samples: of each stretch of the cycle those of largest acceleration and largest certain torque."""
    stretches = len(sharp)
    few.powers.exponent[0] = np.nan
    length = len(whole.low) // stretches
    for k in range(2 * stretches):
        at = sharp[k % stretches]
        if k >= stretches:
            first, largest = (k - stretches) * length, -np.inf
            for t in range(first, first + length):
                needed = max(whole.low[t], -whole.high[t])
                if needed > largest:
                    at, largest = t, needed
        few.low[k], few.high[k] = whole.low[at], whole.high[at]
        few.shown[k], few.lossy[k] = whole.shown[at], whole.lossy[at]
        few.motion.speed[k], few.motion.loss_speed[k] = whole.motion.speed[at], whole.motion.loss_speed[at]
        few.motion.acceleration[k] = whole.motion.acceleration[at]
        few.motion.carrier_acceleration[k] = whole.motion.carrier_acceleration[at]
        for i in range(len(few.added)):
            few.added[i, k] = whole.added[i, at]


@law(fastmath=FAST)
def energy_of_line(half: Any, rows: Any, weight: Any, line: Any) -> Any:
    """What the line takes over at most: its share of what is open in the load [J]."""
    total = 0.0
    for k in range(half.shape[0]):
        for i in range(half.shape[1]):
            if half[k, i] > 0.0:
                row, slope = rows[k, i], 0.0
                for t in range(len(line)):
                    slope += row[t] * (line[t] * weight[t])
                total += half[k, i] * abs(slope)
    return total


@law(fastmath=FAST)
def bound(case: Any, row: Any, checks: Any, span: Span, brake: Brake, amounts: Any, until: Any, peaks: Any) -> Any:
    """Fill the figures of one case with their least, stage by stage; its largest utilisation, and how warm it gets."""
    gear, motor, setting, figures = case.gear, case.motor, case.setting, case.figures
    unknown = unknown_torque(case)
    if setting.cold != 0.0:
        set_cold_start(case, least_mechanical(case, span, amounts, setting.cold_start).torque + unknown)
    found = least_mechanical(case, span, amounts, setting.gear_temperature)
    figures.load_torque, figures.joint_torque = found.load, found.load
    if setting.jam != 0.0:
        set_jam(case)
    stop = least_hard_stop(case, brake, amounts)
    figures.momentary_torque, figures.stop_motor_torque = larger(found.load, stop.load), stop.torque
    if not peaks:
        struck, travel = stop.load, stop.travel
        if known(span.still[5]):
            struck, travel = span.still[5], 0.5 * setting.fastest * setting.stop_ramp
            figures.momentary_torque = larger(figures.momentary_torque, struck)
        if struck * case.safety.peak_torque * BELOW > case.limits.repeated_peak_torque:
            figures.permitted_peaks = permitted_peaks(gear.momentary_waves, gear.ratio, travel)
        figures.average_load_torque = least_average(case, span)
        figures.gear_life = life_of(gear, figures.average_load_torque, figures.mean_input_speed)
        arm, tilt, radial = bearing_arm(gear), 0.0, span.still[2]
        lever = known_or(arm, 0.0)
        for t in range(span.tilts.shape[1]):  # ``moment_square`` of what is least
            tilt = larger(tilt, span.tilts[0, t] + lever * (lever * span.tilts[1, t] + 2.0 * span.tilts[2, t]))
        figures.tilting_moment = math.sqrt(tilt) + 0.0 * (arm + radial)
        figures.axial_load, figures.radial_load = span.still[1], radial
        figures.wanted_stiffness = setting.resonance * setting.resonance * span.still[4]
        figures.bearing_static_load = static_load(
            gear.bearing_pitch_diameter, figures.tilting_moment, figures.radial_load, figures.axial_load
        )
        figures.holding_torque = holding_torque(span.still[3], gear.ratio)
    used, _ = worst(case, row, checks, GEAR, 0.0, NOTHING, peaks)
    used, _ = worst(case, row, checks, SPEED, used, NOTHING, peaks)
    figures.motor_torque = found.torque + unknown
    figures.rms_torque = math.sqrt(found.square / setting.duration) + unknown
    figures.phase_torque = math.sqrt(found.phase / setting.duration) + unknown
    used, _ = worst(case, row, checks, TORQUE, used, NOTHING, peaks)
    if peaks or used > until:
        return used, LeastHeat(np.nan, np.nan, np.nan)
    heat = least_heat(case, span)

    heated, weakest = heat.hottest > -np.inf, torque_constant(motor, heat.magnets)
    figures.winding_temperature = heat.hottest + unknown if heated else np.nan
    figures.phase_temperature = figures.winding_temperature
    if weakest <= 0.0:  # it runs away; where the torque is not known nobody says so
        return np.inf if known(unknown) else used, heat
    if motor.magnet_coefficient <= 0.0 or not heated:  # else warm magnets may be stronger without bound
        set_currents(case, weakest)
    cold, volts = torque_constant(motor, setting.ambient), 0.0
    ends = (winding_resistance(motor, setting.ambient), winding_resistance(motor, heat.coolest))
    for more in (1.0, torque_factor(case.safety)):
        for i in range(1 if heated else 2):
            volts = larger(volts, least_voltage(case, span, cold, ends[i], more))
    figures.voltage = volts + unknown
    used, _ = worst(case, row, checks, HEAT, used, NOTHING, NO)
    return used, heat


class LeastStop(NamedTuple):
    """Least of stops at a current limit: largest torque of the gear, of the motor to hold the load; longest way."""

    load: float
    torque: float
    travel: float


@law
def least_hard_stop(case: Any, brake: Brake, amounts: Any) -> Any:
    """The least of what stops at the current limit ask, at a few samples: torque, torque that holds the load, way.

    See ``judge.hard_stop``. The torque rises with the static one, and with the inertia it only rises or only falls, so
    its ends lie at the ends of both, and those of how fast the joint slows down.
    """
    setting, gear = case.setting, case.gear
    if len(brake.speed) == 0 or setting.ramped != 0.0 or not known(setting.stop_current + unknown_torque(case)):
        return LeastStop(0.0, np.nan, 0.0)
    mesh, shaft, ratio, found, holding, longest = mesh_of(gear), friction_curve(case.shaft), gear.ratio, 0.0, 0.0, 0.0
    inertia = known_or(case.motor.rotor_inertia, 0.0) + known_or(gear.inertia, 0.0)
    rides, limit = setting.rides, stop_constant(case) * setting.stop_current
    weaker = case.motor.torque_constant * setting.stop_current
    rotor, riding = stop_rotor(ratio, inertia, rides)
    factor, spring = drag_factor(mesh, stop_temperature(case)), swing_spring(gear)
    stiff, swings = stiff_spring(gear).slope_3, 1.0 if setting.stop_rise <= 0.0 else 0.0
    for t in range(len(brake.speed)):
        speed, acceleration, own_torque, own = brake.loss_speed[t], brake.acceleration[t], 0.0, 0.0
        for k in range(len(amounts)):
            own_torque += amounts[k] * brake.added_torque[k, t]
            own += amounts[k] * brake.added_inertia[k, t]
        way, low, high, slowing = direction(speed), np.inf, -np.inf, 0.0
        carrier = brake.carrier_acceleration[t] - rides * acceleration
        push = braking_push(mesh, shaft, factor, inertia, limit, speed, carrier)
        unaided = braking_push(mesh, shaft, 0.0, inertia, weaker, speed, carrier)
        bare, own = own, own + riding
        least = max(max(brake.inertia[0, t] + bare, 0.0) + riding, 0.0)
        for i in range(2):
            static = brake.static[i, t] + own_torque - own * acceleration
            for j in range(2):
                load = max(brake.inertia[j, t] + bare, 0.0) + riding
                torque = braked(mesh.driving, mesh.driven, rotor, push, static, load, way).torque
                free = braked(1.0, 1.0, rotor, unaided, static, load, way)
                slowing = max(slowing, -way * free.acceleration if load + rotor > 0.0 else np.inf)
                for k in range(2):
                    swung = swung_torque(spring, brake.torque[k, t] + own_torque, torque, 1.0)
                    low, high = min(low, swung), max(high, swung)
                    if swings == 0.0:
                        low, high = min(low, torque), max(high, torque)
        below, above = brake.static[0, t] + own_torque - own * acceleration, brake.static[1, t]
        still = max(below, -(above + own_torque - own * acceleration), 0.0)
        holding = max(holding, still / abs(ratio))
        most = (
            still
            + least * abs(acceleration)
            + abs(brake.speed[t]) * math.sqrt((stiff if known(stiff) else 0.0) * least)
        )
        swung = max(low, -high, 0.0) if high < np.inf else 0.0
        found = max(found, min(swung, most) if known(stiff) else swung)
        longest = max(longest, 0.5 * speed * speed / slowing if slowing > 0.0 else np.inf)
    return LeastStop(found, holding, longest)


class LeastMechanical(NamedTuple):
    """Least load, least largest torque and least sums of weighted squares; see ``judge.Mechanical``."""

    load: float
    torque: float
    square: float
    phase: float


@law(fastmath=FAST)
def least_mechanical(case: Any, span: Span, amounts: Any, gear_temperature: Any) -> Any:
    """The pass over the mechanics: ends of the motor's torque at every sample, and the peaks that are certain."""
    motion, low, high, shown, lossy = span.motion, span.own_low, span.own_high, span.shown, span.lossy
    add_rows(span.low, span.added, amounts, low)
    for t in range(len(low)):
        high[t] = low[t] + (span.high[t] - span.low[t])
    mesh, inertia = mesh_of(case.gear), known_or(case.motor.rotor_inertia, 0.0) + known_or(case.gear.inertia, 0.0)
    turning, excess = friction_curve(case.shaft), span.excess
    excess_series(turning, mesh.ratio, motion.loss_speed, excess)
    drag_series(mesh, gear_temperature, motion.loss_speed, span.powers, span.drag)
    least, most, shaft, load, torque, square, phase = span.least, span.most, span.shaft, 0.0, 0.0, 0.0, 0.0
    for t in range(len(low)):
        speed = motion.loss_speed[t]
        shaft[t] = (
            rotor_torque(inertia, mesh.ratio, motion.acceleration[t], motion.carrier_acceleration[t])
            + sliding_friction(turning, mesh.ratio * speed) + excess[t] + span.drag[t]
        )  # fmt: skip
        a, b = low[t] + lossy[t], high[t] + lossy[t]
        first, second = mesh_torque(mesh, a, speed), mesh_torque(mesh, b, speed)
        bend = 0.0 if (a < 0.0) & (b > 0.0) else first
        least[t] = smaller(smaller(first, second), bend) + shaft[t]
        most[t] = larger(larger(first, second), bend) + shaft[t]
        load = larger(load, larger(low[t] + shown[t], -(high[t] + shown[t])))
        magnitude = larger(larger(least[t], -most[t]), 0.0)
        torque = larger(torque, magnitude)
        heating = motion.weight[t] * magnitude * magnitude
        square += heating
        phase += heating * motion.phase[t] * motion.phase[t]
    if case.setting.moves != 0.0:
        joint = friction_curve(case.joint)
        for first_sample, after in motion.rests:
            for t in range(first_sample, after):  # what breaks the joint loose where the direction is certain
                a, b = low[t] + shown[t], high[t] + shown[t]
                if a > 0.0 or b < 0.0:
                    way, near = direction(a + b), a if a > 0.0 else b
                    load = larger(load, abs(near + breakaway_friction(joint, way)))
                a, b = low[t], high[t]
                if a > 0.0 or b < 0.0:
                    rotor = rotor_torque(inertia, mesh.ratio, motion.acceleration[t], motion.carrier_acceleration[t])
                    start = starting_torque(mesh, turning, joint, a, 0.0) + rotor
                    other = starting_torque(mesh, turning, joint, b, 0.0) + rotor
                    if start * other > 0.0:
                        torque = larger(torque, smaller(abs(start), abs(other)))
    return LeastMechanical(load, torque, square, phase)


@law(fastmath=FAST)
def least_average(case: Any, span: Span) -> Any:
    """The least average load as wear sees it [N m]; Harmonic Drive SHG, p. 30."""
    motion, low, high, exponent = span.motion, span.own_low, span.own_high, case.gear.life_exponent
    shown, worn, travel, held = span.shown, 0.0, 0.0, 0.0
    for t in range(len(low)):
        way = motion.weight[t] * abs(motion.speed[t])
        least = larger(larger(low[t] + shown[t], -(high[t] + shown[t])), 0.0)
        worn += way * wear(least, exponent)
        travel += way
        held = larger(held, least)
    return (worn / travel) ** (1.0 / exponent) if travel > 0.0 else held


class LeastHeat(NamedTuple):
    """Temperatures that a motor does not stay below [C]: its winding at any instant, its magnets, its hottest winding.

    Where the sheet does not say enough the hottest is -inf, the winding is taken at its limit, the magnets at ambient.
    """

    coolest: float
    magnets: float
    hottest: float


@law(fastmath=FAST)
def least_heat(case: Any, span: Span) -> Any:
    """How warm a motor gets at least.

    The mean heat of a cycle can be bounded from below before any temperature is known; it warms the magnets, which then
    need more current, and the winding, which then has more resistance, and both add to the heat. Each step of that
    ladder is a lower bound, and the next one starts from it.
    """
    motor, setting, ambient = case.motor, case.setting, case.setting.ambient
    nodes, limit = thermal_nodes(motor, setting.mounting), motor.max_winding_temperature
    if not known(nodes.inner + nodes.outer):
        return LeastHeat(known_or(limit, ambient), ambient, -np.inf)
    if motor.magnet_coefficient > 0.0 or not known(limit):  # may be stronger without bound; or run away unjudged
        return LeastHeat(smaller(ambient, known_or(limit, ambient)), ambient, ambient)
    square = mean_square(span.least, span.most, span.share)
    loss = least_housing_loss(case, span, nodes, square)
    share = resting_share(nodes, len(span.motion.periods.shares), setting.duration)
    coolest, housing, winding = ambient, 0.0, 0.0
    for _ in range(STEPS):
        constant, before = torque_constant(motor, ambient + housing), winding
        if not constant > 0.0:
            return LeastHeat(coolest, ambient + housing, np.inf)
        copper = square / (constant * constant) * winding_resistance(motor, coolest)
        housing = nodes.outer * (copper + loss)
        winding, coolest = nodes.inner * copper + housing, ambient + share * nodes.outer * copper
        if winding - before <= ENOUGH * winding:
            break
    return LeastHeat(coolest, ambient + housing, ambient + winding)


@law(fastmath=FAST)
def mean_square(least: Any, most: Any, share: Any) -> Any:
    """Least mean square of the motor's torque, straight between samples [N^2 m^2]."""
    low, high, low_after, high_after, total = least[:-1], most[:-1], least[1:], most[1:], 0.0
    for t in range(len(low)):
        a = larger(low[t], 0.0) + smaller(high[t], 0.0)
        b = larger(low_after[t], 0.0) + smaller(high_after[t], 0.0)
        same = (a * a + a * b + b * b) * (1.0 / 3.0)
        turned = 0.25 * larger(a * a, b * b)  # the least of the same sum over one of the two
        total += share[t] * (same if a * b > 0.0 else turned)
    return total


@law(fastmath=FAST)
def least_housing_loss(case: Any, span: Span, nodes: Any, square: Any) -> Any:
    """Least mean power that friction at the motor's shaft and the gear's share bring into the housing [W].

    What falling friction has above its straight lines is left out. The heat of a gear that settles falls with what else
    warms it, but both together do not.
    """
    shaft, mesh, speed, share = friction_curve(case.shaft), mesh_of(case.gear), span.motion.speed, span.share
    low, high, shown, warms, rubs = span.own_low, span.own_high, span.shown, case.setting.gear_heat, not shaft.falls
    loss, own, total, dragged = span.excess, span.drag, 0.0, 0.0
    coil = known_or(case.motor.brake.power, 0.0)
    for t in range(len(loss)):
        motor_speed, a, b = mesh.ratio * speed[t], low[t] + shown[t], high[t] + shown[t]
        near = larger(a, 0.0) + smaller(b, 0.0)  # the load nearest to none: no other loses less in the mesh
        seal = mesh.seal * abs(motor_speed) * (own[t] != 0.0)
        own[t] = own[t] * motor_speed - seal
        loss[t] = coil + warms * (mesh_loss_power(mesh, near, speed[t]) + seal)
        loss[t] += sliding_friction(shaft, motor_speed) * motor_speed * rubs
    for t in range(len(loss) - 1):
        total += 0.5 * share[t] * (loss[t] + loss[t + 1])
        dragged += 0.5 * share[t] * (own[t] + own[t + 1])
    drag = warms * dragged / drag_factor(mesh, case.setting.gear_temperature)
    if nodes.inner == 0.0 and len(span.motion.periods.shares) > 1:  # each part has a warmth of its own
        return total
    return total + drag * settled_factor(case, nodes, square, total, drag)


@law(fastmath=FAST)
def resting_share(nodes: Any, parts: Any, duration: Any) -> Any:
    """The share of its mean rise below which the housing never falls while the winding's heat comes unevenly.

    The answer of the housing to a short burst of heat in the winding, repeated with the cycle, is the difference of
    two exponentials: least just when the burst comes. No distribution of the same heat keeps it cooler.
    """
    inner, outer = nodes.inner, nodes.outer
    if math.isnan(nodes.winding):
        return 1.0
    if parts > 1 or math.isnan(nodes.housing) or inner == 0.0:
        return 0.0
    a, c = 1.0 / (inner * nodes.winding), 1.0 / (inner * nodes.housing)
    d = (1.0 / inner + 1.0 / outer) / nodes.housing
    middle, spread = 0.5 * (a + d), math.sqrt(0.25 * (a - d) ** 2 + a * c)
    slow, quick = (a * d - a * c) / (middle + spread), middle + spread
    left = 1.0 / -math.expm1(-slow * duration) - 1.0 / -math.expm1(-quick * duration)
    return min(max(duration * slow * quick / (quick - slow) * left, 0.0), 1.0)


@law(fastmath=FAST)
def least_voltage(case: Any, span: Span, constant: Any, ohms: Any, more: Any) -> Any:
    """Least largest voltage at fixed temperatures with so many times the torque, first and last sample left out [V]."""
    motion, least, most = span.motion, span.least, span.most
    ratio, inductance, inverse, largest = case.gear.ratio, known_or(case.motor.inductance, 0.0), more / constant, 0.0
    l0, l1, l2, h0, h1, h2 = least[:-2], least[1:-1], least[2:], most[:-2], most[1:-1], most[2:]
    speed, behind = motion.speed[1:-1], motion.rate_before[1:-1]
    at, ahead = motion.rate_at[1:-1], motion.rate_after[1:-1]
    for t in range(len(speed)):
        own, before, after = ohms + inductance * at[t], inductance * behind[t], inductance * ahead[t]
        low = smaller(own * l1[t], own * h1[t]) + smaller(before * l0[t], before * h0[t])
        high = larger(own * l1[t], own * h1[t]) + larger(before * l0[t], before * h0[t])
        low += smaller(after * l2[t], after * h2[t])
        high += larger(after * l2[t], after * h2[t])
        emf = constant * ratio * speed[t]
        largest = larger(largest, larger(emf + inverse * low, -(emf + inverse * high)))
    return largest


# Energy


@law(fastmath=FAST)
def certain_loss(motor: Any, magnets: Any, coolest: Any, heated: Any) -> Any:
    """Copper loss over torque squared that no temperature lets a motor undercut [W/(N m)^2]."""
    constant = torque_constant(motor, magnets)
    if not constant > 0.0 or (motor.magnet_coefficient > 0.0 and heated):
        return 0.0
    return winding_resistance(motor, coolest) / (constant * constant)


@law(fastmath=FAST)
def power_line(sheets: Sheets, span: Span, pairs: Any, first: Any, line: Any) -> None:
    """How the power grows with the load at the middle of the interval: the mean over some candidates, or the first."""
    motion, low, high, lossy, count = span.motion, span.low, span.high, span.lossy, min(len(pairs), SAMPLED)
    line[:] = 0.0
    for i in range(count):
        case = put(sheets, pairs[i if first else i * len(pairs) // count])
        mesh, ambient = mesh_of(case.gear), case.setting.ambient
        inertia = known_or(case.motor.rotor_inertia, 0.0) + known_or(case.gear.inertia, 0.0)
        loss = certain_loss(case.motor, ambient, ambient, False)
        for t in range(len(line)):
            load = 0.5 * (low[t] + high[t]) + lossy[t]
            share = mesh_slope(mesh, load * motion.loss_speed[t])
            torque = share * load + inertia * mesh.ratio * motion.acceleration[t]
            line[t] += share * (mesh.ratio * motion.speed[t] + 2.0 * loss * torque) / count


@law(fastmath=FAST)
def least_energy(case: Any, span: Span, heat: LeastHeat, line: Any) -> Any:
    """The least energy less the line times the load's distance from the middle of its interval [J].

    The motor's torque is one straight line for a positive load and another for a negative one, so the power is a
    parabola on each side, least at its vertex or at an end; where a gear grips at rest the least torque counts.
    """
    motion, low, high, shaft, lossy = span.motion, span.own_low, span.own_high, span.shaft, span.lossy
    mesh, least_torque, most_torque = mesh_of(case.gear), span.least, span.most
    total = known_or(case.motor.brake.power, 0.0) * case.setting.duration
    loss, grips = certain_loss(case.motor, heat.magnets, heat.coolest, heat.hottest > -np.inf), mesh.grip != 0.0
    for t in range(len(line)):
        speed, turning, own, steep = motion.loss_speed[t], mesh.ratio * motion.speed[t], shaft[t], line[t]
        up, down = mesh_slope(mesh, speed), mesh_slope(mesh, -speed)
        a, b = low[t] + lossy[t], high[t] + lossy[t]
        alone = own * (turning + loss * own) + steep * 0.5 * (a + b)
        above = parabola(loss * up * up, up * (turning + 2.0 * loss * own) - steep, larger(a, 0.0), larger(b, 0.0))
        below = parabola(
            loss * down * down, down * (turning + 2.0 * loss * own) - steep, smaller(a, 0.0), smaller(b, 0.0)
        )
        least = smaller(above, below)
        least = above if a >= 0.0 else (below if b <= 0.0 else least)
        near = larger(least_torque[t], 0.0) + smaller(most_torque[t], 0.0)
        gripped = loss * near * near - 0.5 * abs(steep) * (b - a)  # at rest a grip is no straight line
        total += motion.weight[t] * (gripped if (speed == 0.0) & grips else least + alone)
    return total


@law(fastmath=FAST)
def parabola(square: Any, straight: Any, begin: Any, end: Any) -> Any:
    """The least of square x^2 + straight x from begin to end."""
    vertex = -straight / (2.0 * square) if square > 0.0 else (begin if straight > 0.0 else end)
    at = smaller(larger(vertex, begin), end)
    return (square * at + straight) * at


# Power


@kernel(fastmath=FAST)
def power_ends(offer: Offer, pairs: Any, least: Array, most: Array) -> None:
    """The least and the most power that any of some candidates takes, each no hotter than it may be [W], (N,) each."""
    whole, own = offer.whole, len(offer.whole.added)
    motion = whole.motion
    least[:], most[:] = np.inf, -np.inf
    for pair in pairs:
        case = put(offer.sheets, pair)
        motor, setting = case.motor, case.setting
        least_mechanical(case, whole, offer.parameters[pair][:own], setting.gear_temperature)
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
            low, high, turning = whole.least[t], whole.most[t], case.gear.ratio * motion.speed[t]
            best = (low if turning > 0.0 else high) if certain == 0.0 else -0.5 * turning / certain
            best = larger(low, smaller(high, best))
            least[t] = smaller(least[t], best * (turning + certain * best) + coil)
            ends = larger(low * (turning + loss * low), high * (turning + loss * high)) if bounded else np.inf
            most[t] = larger(most[t], ends + coil)
