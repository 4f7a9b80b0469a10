"""Evaluates motor-gear pairs at one joint: the only module that loops over the samples of a cycle, and the only kernel.

``judge_cases`` fills the figures of a batch of cases stage by stage and compares them with the table of checks.
``evaluate`` runs all stages for one drive; the search stops at the first violated check of each candidate; tolerance
sampling runs all stages for cases with random parameters.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from drivetrain.drive.amplifier import conduction_loss, overload_share
from drivetrain.drive.brake import LEAST_ENERGY, holding_torque, stopping_energy
from drivetrain.drive.drive import drive_inertia, rotor_torque, starting_torque
from drivetrain.drive.friction import (
    direction,
    friction_curve,
    loosening_load,
    sliding_friction,
    static_excess,
)
from drivetrain.drive.gear import (
    DRAG_TEMPERATURES,
    MEAN_SHARE,
    ROLLER_EXPONENT,
    SLOWEST_INPUT,
    SLOWEST_MEAN,
    bearing_arm,
    bearing_life,
    drag_factor,
    equivalent_load,
    grown_drag,
    least_momentary_torque,
    life_of,
    mesh_loss_power,
    mesh_of,
    mesh_torque,
    moment_square,
    onward,
    permitted_peaks,
    settled_temperature,
    speed_power,
    stage_load,
    static_load,
    unknown_loss,
    wear,
)
from drivetrain.drive.motor import torque_constant, winding_resistance, winding_voltage
from drivetrain.drive.motor_limits import (
    LEAST_LIMIT,
    NOMINAL_SHARE,
    SHEET_AMBIENT,
    WARMEST,
    WINDING_SHARE,
    continuous_current_limit,
    least_max_speed,
    least_winding_time,
    poorest_path,
    scaled_nominal_current,
    short_time_torque,
)
from drivetrain.drive.stops import (
    braked,
    braking_push,
    jam_torque,
    overshoot,
    rotor_energy,
    stiff_spring,
    stop_rotor,
    stop_swing,
    swing_spring,
)
from drivetrain.drive.thermal.periodic_heat import (
    copper_of,
    hottest_bound,
    hottest_phase,
    interval_means,
    part_means,
    periodic_heat,
    quick_nodes,
    responses,
    thermal_nodes,
    trace_own_periods,
)
from drivetrain.jit import FAST, kernel, law
from drivetrain.records import as_numbers, known, known_or
from drivetrain.sizing.demand.series import JointSeries
from drivetrain.sizing.judge.cases import coldest, stop_constant, stop_temperature
from drivetrain.sizing.judge.checks import GEAR, HEAT, SPEED, TORQUE
from drivetrain.vector import larger, smaller

HALVINGS = 12  # bisection steps for the largest current that does not overload the gear
NOTHING = np.int64(-1)  # numpy's integer, because numba compiles a kernel again for each plain Python integer or bool
NO, YES = np.int64(0) != 0, np.int64(1) != 0


def judge_cases(
    cases: Any, numbers: Any, checks: Any, series: JointSeries, amounts: Any, until: float, quick: bool, power: Any,
    used: Any, found: Any, binding: Any, lacking: Any,
) -> None:  # fmt: skip
    """Evaluate cases at one joint; each stops after the stage in which a utilisation exceeds ``until``."""
    whole = series._replace(at_key_samples=None)
    if not quick or series.at_key_samples is None:
        judge_all(cases, numbers, checks, whole, amounts, until, quick, False, power, used, found, binding, lacking)
        return
    nothing, none = np.zeros((0, 0)), np.zeros((0, 2, 0))
    key, figures = series.at_key_samples, (found, binding, lacking)
    judge_all(cases, numbers, checks, key, amounts, until, True, True, none, nothing, *figures)
    left = np.flatnonzero((found <= until) & (lacking < 0))
    some, rows = cases[left], power[left] if len(power) > 1 else power
    shares, figures = used[left] if len(used) else used, (found[left], binding[left], lacking[left])
    judge_all(some, as_numbers(some), checks, whole, amounts[left], until, True, False, rows, shares, *figures)
    cases[left] = some
    found[left], binding[left], lacking[left] = figures
    if len(power) > 1:
        power[left] = rows
    if len(used):
        used[left] = shares


@kernel(fastmath=FAST)  # as the laws below: numba compiles a law again for callers with other options
def judge_all(
    cases: Any, numbers: Any, checks: Any, series: Any, amounts: Any, until: float, quick: bool, screen: bool,
    power: Any, used: Any, found: Any, binding: Any, lacking: Any,
) -> None:  # fmt: skip
    """Compiled part of ``judge_cases``. With ``screen`` only a subset of the samples is used and only peak checks are
    made: their required values are lower bounds of those over all samples.
    """
    motion, traces, load, total = series.motion, series.traces, series.load, series.total
    torque, inertia, stop = load.torque, load.inertia, load.stop
    traces.powers.exponent[0] = np.nan  # the buffers may hold the powers of another motion
    for i in range(len(cases)):
        case, row = cases[i], numbers[i]
        figures, ambient, unknown = case.figures, case.setting.ambient, unknown_torque(case)
        set_limits(case)
        if quick:
            lacking[i], found[i], binding[i] = first_lacking(case, row, checks, NO), np.inf, NOTHING
            if lacking[i] >= 0:
                continue
        if len(series.unit_loads.torque) > 0:
            torque, stop, resting = total.torque, total.stop, applies_at_rest(case)
            add_up(series.load, series.unit_loads, amounts[i], total, resting)
            load = total if resting else series.load
            inertia = load.inertia
        set_carried(case, load, motion.weight, motion.speed, quick)
        if case.setting.cold != 0.0:
            cold = case.setting.cold_start
            set_cold_start(case, mechanical(case, motion, torque, traces, cold).torque + unknown)
            volts = voltage_at(case, motion.speed, motion.rates, traces.torque, cold)
            figures.cold_voltage = larger(figures.cold_voltage, volts) + unknown
        set_mechanics(case, mechanical(case, motion, torque, traces, case.setting.gear_temperature))
        if not screen:
            set_jam(case)
            set_stop(case, motion, torque, inertia, stop, series.stops, traces.stop)
        found[i], binding[i] = 0.0, NOTHING
        for stage in (GEAR, SPEED, TORQUE):
            if found[i] <= until:
                found[i], binding[i] = worst(case, row, checks, stage, found[i], binding[i], screen)
        if screen:
            continue
        if found[i] <= until:
            volts = voltage_at(case, motion.speed, motion.rates, traces.torque, ambient)
            if quick and case.motor.magnet_coefficient <= 0.0:  # the warm motor needs no less current
                set_currents(case, torque_constant(case.motor, ambient))
                figures.winding_temperature, figures.phase_temperature, figures.voltage = np.nan, np.nan, volts
                found[i], binding[i] = worst(case, row, checks, HEAT, found[i], binding[i], NO)
        if found[i] <= until:
            warm_up(case, motion, traces)
            set_currents(case, torque_constant(case.motor, figures.magnet_temperature))
            judged = known(case.limits.winding_temperature + figures.winding_temperature)
            heating = 0.0 if judged else heating_allowance(case, motion, traces)
            steepest = 0.0 if case.motor.inductance_allowance == 0.0 else steepest_rate(motion.rates, traces.torque)
            add_thermal_allowance(case, traces.losses.winding_at[0], heating, steepest)
            if case.setting.overload != 0.0:
                phase, periods, torques = motion.phase_ratio, motion.periods, traces.torque[1:-1]
                figures.overload = overload_of(case, phase, periods, torques, 1.0) + unknown
                if case.allowance.current > 0.0:
                    grown = 1.0 + case.allowance.current / figures.motor_current
                    more = overload_of(case, phase, periods, torques, grown)
                    case.allowance.overload = more - figures.overload
            volts = larger(volts, starting_voltage(case, motion.rests, traces.losses.winding_at, traces.starting))
            drawn = power[min(i, len(power) - 1)] if len(power) > 0 else traces.power
            peak = electrical(case, motion, traces.torque, traces.load, traces.losses.winding_at, drawn)
            figures.voltage = larger(volts, peak) + unknown
            figures.winding_temperature += unknown
            figures.phase_temperature += unknown
            figures.gear_loss += unknown
            figures.gear_temperature += unknown
            found[i], binding[i] = worst(case, row, checks, HEAT, found[i], binding[i], NO)
        lacking[i] = first_lacking(case, row, checks, YES)
        for k in range(len(checks) if i < len(used) else 0):
            used[i, k] = utilisation_of(case, row, checks[k])


@law
def set_mechanics(case: Any, found: Any) -> None:
    """Set the figures that do not depend on temperature."""
    gear, figures, unknown = case.gear, case.figures, unknown_torque(case)
    figures.load_torque, figures.average_load_torque = found.load, found.average_load
    figures.joint_torque = found.joint
    figures.momentary_torque = found.load
    figures.gear_life = life_of(gear, found.average_load, figures.mean_input_speed)
    figures.motor_torque = found.torque + unknown
    figures.rms_torque = math.sqrt(found.square / case.setting.duration) + unknown
    figures.phase_torque = math.sqrt(found.phase / case.setting.duration) + unknown


@law
def set_jam(case: Any) -> None:
    """Set the gear torques that follow if the output is blocked at its highest speed."""
    gear, figures = case.gear, case.figures
    spring, push = stiff_spring(gear), abs(gear.ratio) * stop_constant(case) * case.setting.stop_current
    energy = rotor_energy(case.motor, gear, case.setting.fastest)
    if known(energy + spring.slope_3):
        figures.coast_torque, figures.jam_torque = jam_torque(spring, energy, 0.0), np.nan
        if known(push):
            figures.jam_torque = jam_torque(spring, energy, push)


@law
def set_stop(case: Any, motion: Any, torque: Any, inertia: Any, stop: Any, stops: Any, trace: Any) -> None:
    """Set the gear and motor torques of emergency stops from every state of the cycle; NaN if data is missing."""
    gear, setting, figures = case.gear, case.setting, case.figures
    figures.stop_torque = np.nan
    if setting.ramped != 0.0:
        figures.stop_travel = 0.5 * setting.fastest * setting.stop_ramp
    if len(stop) > 0:  # all joints on a ramp: a joint at rest carries the loads of the others
        figures.stop_torque, figures.stop_motor_torque = ramped_stop(case, stop, stops)
    elif setting.moves == 0.0:
        figures.stop_torque, figures.stop_motor_torque, figures.stop_travel = 0.0, unknown_torque(case), 0.0
    elif setting.ramped == 0.0 and len(inertia) > 0 and known(setting.stop_current + unknown_torque(case)):
        found = hard_stop(case, motion, torque, inertia, trace)
        figures.stop_torque, figures.stop_motor_torque, figures.stop_travel = found
    figures.stop_torque *= onward(gear)
    load, factor, momentary = figures.load_torque, case.safety.peak_torque, known(figures.stop_torque)
    if momentary:
        figures.momentary_torque = max(load, figures.stop_torque)
    elif not load * factor > gear.momentary_torque:
        figures.momentary_torque = np.nan
    figures.permitted_peaks = permitted_peaks(gear.momentary_waves, gear.ratio, figures.stop_travel)
    if momentary and figures.stop_torque * factor <= case.limits.repeated_peak_torque:
        figures.permitted_peaks = np.inf  # a stop loads the gear no more than the normal cycle


@law
def unknown_torque(case: Any) -> Any:
    """NaN if data of the motor torque is missing, else 0; added to a figure it marks the figure as unknown."""
    return 0.0 * (case.motor.rotor_inertia + case.gear.inertia) + unknown_loss(case.gear)


@law(fastmath=FAST)
def set_cold_start(case: Any, torque: Any) -> None:
    """Set torque, current and voltage of a cold start: highest torque constant, lowest resistance, at standstill."""
    figures, cold = case.figures, case.setting.cold_start
    figures.cold_torque, figures.cold_current = torque, torque / abs(torque_constant(case.motor, cold))
    figures.cold_voltage = winding_resistance(case.motor, cold) * figures.cold_current * torque_factor(case.safety)


@law(fastmath=FAST)
def set_limits(case: Any) -> None:
    """Set the limits of a case, and the figures that do not depend on the samples."""
    gear, motor, setting, figures, limits = case.gear, case.motor, case.setting, case.figures, case.limits
    limits.repeated_peak_torque = known_or(gear.repeated_peak_torque, gear.continuous_torque)
    limits.average_torque = known_or(gear.average_torque_limit, gear.continuous_torque)
    limits.short_time_torque = short_time_torque(motor)
    limits.continuous_current = continuous_current_limit(motor, setting.ambient, setting.mounting)
    peaks = motor.peak_current, case.amplifier.peak_current
    limits.peak_current = known_or(min(peaks[0], peaks[1]), known_or(peaks[0], peaks[1]))
    limits.winding_temperature = motor.max_winding_temperature - case.safety.temperature_margin
    limits.stiffness = setting.stiffness_share * gear.stiffness_1
    least = case.assumed_limits
    least.momentary_torque = least_momentary_torque(gear)
    least.input_speed = SLOWEST_INPUT
    least.mean_input_speed = known_or(MEAN_SHARE * gear.max_input_speed, SLOWEST_MEAN)
    least.motor_speed = least_max_speed(motor)
    least.brake_energy = LEAST_ENERGY * motor.brake.static_torque
    figures.input_speed = abs(gear.ratio) * setting.fastest
    figures.mean_input_speed = abs(gear.ratio) * setting.mean_speed
    set_allowance(case)


@law
def set_allowance(case: Any) -> None:
    """Set the additional demand of friction that the data sheet does not specify, for a warm motor with weakened
    magnets.

    In a stop this friction acts with the motor torque: T = (... - I push)/(f I + G^2 J) grows by at most push/f, and by
    twice that with the overshoot of the spring, times how much that stiffens. The additional rise x of the winding
    follows from x = c R(x) q^2, where q^2 is the mean square torque that is left below the temperature limit: the RMS
    of a sum is at most the sum of the RMS values.
    """
    motor, setting, figures, allowance = case.motor, case.setting, case.figures, case.allowance
    ambient = setting.ambient
    friction = motor.friction_allowance if setting.moves != 0.0 and setting.stated_friction == 0.0 else 0.0
    limit = known_or(case.limits.winding_temperature, WARMEST)
    allowance.torque, allowance.current = friction, friction / abs(torque_constant(motor, limit))
    allowance.voltage, allowance.temperature, allowance.stop_torque = 0.0, 0.0, 0.0
    allowance.rms_current, allowance.winding_temperature, allowance.resistance = 0.0, 0.0, 0.0
    allowance.overload = 0.0
    if friction == 0.0:
        return
    ohms, driven = winding_resistance(motor, limit), mesh_of(case.gear).driven
    allowance.voltage = torque_factor(case.safety) * ohms * allowance.current
    if setting.ramped == 0.0:
        spring = swing_spring(case.gear)
        grows = 2.0 * max(spring.slope_3 / spring.slope_1, 1.0)
        allowance.stop_torque = grows * abs(case.gear.ratio) * friction / driven if driven > 0.0 else np.nan
    nodes = thermal_nodes(motor, setting.mounting)
    permitted_rise, path = limit - ambient, nodes.inner + nodes.outer
    left = max(permitted_rise - nodes.outer * friction * figures.mean_input_speed, 0.0)
    current = max(math.sqrt(left / (path * ohms)) - allowance.current, 0.0)
    cold, slope = winding_resistance(motor, ambient), (ohms - winding_resistance(motor, ambient)) / permitted_rise
    heat = path * current * current
    allowance.temperature = known_or(permitted_rise - heat * cold / (1.0 - heat * slope), 0.0)


@law
def add_thermal_allowance(case: Any, winding: Any, heating: Any, steepest: Any) -> None:
    """Add the allowance for additional heating (weaker magnets, higher resistance) and for the largest L di/dt of an
    unspecified inductance.

    ``winding``: temperature that was assumed where none can be computed [C]; ``heating``: from ``heating_allowance``
    [A]; ``steepest``: from ``steepest_rate`` [N m/s].
    """
    motor, allowance, figures = case.motor, case.allowance, case.figures
    unknown = 0.0 if known(figures.winding_temperature) else WARMEST - winding
    warmer = allowance.temperature + max(unknown, 0.0)
    allowance.resistance = winding_resistance(motor, warmer) - winding_resistance(motor, 0.0)
    allowance.current += figures.motor_current * abs(motor.magnet_coefficient) * allowance.temperature
    allowance.voltage += torque_factor(case.safety) * figures.motor_current * allowance.resistance
    allowance.winding_temperature += allowance.temperature
    allowance.rms_current = allowance.current
    if not known(case.limits.winding_temperature + figures.winding_temperature):
        allowance.rms_current += heating
        weak = torque_constant(motor, figures.magnet_temperature) / torque_constant(motor, WARMEST)
        allowance.current += (weak - 1.0) * figures.motor_current
    if not known(scaled_nominal_current(motor, case.setting.ambient, case.setting.mounting)):
        allowance.rms_current += (1.0 / NOMINAL_SHARE - 1.0) * figures.rms_current
    weakest = known_or(case.limits.winding_temperature, case.setting.ambient)
    lag = torque_factor(case.safety) * motor.inductance_allowance
    allowance.voltage += lag * steepest / abs(torque_constant(motor, weakest))


@law(fastmath=FAST)
def steepest_rate(rates: Any, torque: Any) -> Any:
    """Largest rate of change of the motor torque [N m/s]; ``torque``: with a sample more at each end."""
    before, at, after, steepest = torque[:-2], torque[1:-1], torque[2:], 0.0
    for t in range(len(at)):
        rate = rates[0, t] * before[t] + rates[1, t] * at[t] + rates[2, t] * after[t]
        steepest = larger(steepest, abs(rate))
    return steepest


@law
def heating_allowance(case: Any, motion: Any, traces: Any) -> Any:
    """Margin between the RMS current and its limit that is required where the winding temperature cannot be computed
    [A].

    Three effects heat such a winding beyond what the RMS limit covers. (1) A winding with a short time constant follows
    the current: at rest by all of the loss of one phase, in motion by its assumed share of the thermal path. (2) The
    losses of gear, friction and brake raise the housing temperature, through the stated mounting or else the poorest
    thermal path, and the magnets are as warm as the winding may be. (3) If the data sheet gives no winding limit,
    ambient air above the data sheet's reduces the assumed one. Infinite if the winding cannot be kept below its limit.
    """
    losses, figures, setting = traces.losses, case.figures, case.setting
    rms, largest_square, stated_limit = figures.rms_current, figures.rms_current**2, case.limits.winding_temperature
    square, heat = 1.0 / torque_constant(case.motor, figures.magnet_temperature) ** 2, 0.0
    rate = 1.0 / least_winding_time(case.motor)
    drag = drag_factor(mesh_of(case.gear), setting.gear_temperature)
    phase, torque, last = motion.phase_ratio, traces.torque[1:-1], len(motion.speed) - 1
    before, after = phase[:-1], phase[1:]
    for t in range(len(torque)):
        gear = traces.mesh_loss[t] + drag * traces.drag_loss[t]
        heat += motion.weight[t] * (traces.friction_loss[t] + setting.gear_heat * gear) / setting.duration
    for t in range(len(before)):
        rests = (before[t] > 1.0) & (after[t] > 1.0)
        losses.held[t] = squared_current(rests, rms, square, torque[t], losses.held[t])
    losses.held[last] = squared_current(phase[last] > 1.0, rms, square, torque[last], losses.held[last])
    largest_square = max(largest_square, responses(motion.periods, rate, losses.held, losses.held, losses.memory).first)
    limit = known_or(stated_limit, LEAST_LIMIT)
    largest_square *= (
        torque_constant(case.motor, figures.magnet_temperature) / torque_constant(case.motor, WARMEST)
    ) ** 2
    permitted_rise, copper = limit - setting.ambient, winding_resistance(case.motor, limit) * largest_square
    left = permitted_rise - known_or(setting.mounting, poorest_path(case.motor)) * heat
    if left <= 0.0 or (known(setting.mounting) and setting.mounting * copper > left):
        return np.inf
    at_rated = permitted_rise if known(stated_limit) else max(permitted_rise, limit - SHEET_AMBIENT)
    return max(math.sqrt(largest_square * at_rated / left) - rms, 0.0)


@law(fastmath=FAST)
def squared_current(rests: Any, rms: Any, square: Any, torque: Any, held: Any) -> Any:
    """Squared current that heats a winding at once [A^2]: at rest all of one phase, in motion its share of the path.

    ``square``: factor on squared torques; ``held``: squared torque of the most loaded phase above that of all [N^2
    m^2].
    """
    turning = rms * rms + WINDING_SHARE * (square * torque * torque - rms * rms)
    return 2.0 * square * held if rests else turning


@law(fastmath=FAST)
def set_currents(case: Any, constant: Any) -> None:
    """Set peak and RMS currents for a torque constant [N m/A]."""
    figures = case.figures
    figures.motor_current = figures.motor_torque / abs(constant)
    figures.stop_current = figures.stop_motor_torque / abs(constant)
    figures.phase_current = figures.phase_torque / abs(constant)
    figures.rms_current = figures.phase_current if case.setting.moves == 0.0 else figures.rms_torque / abs(constant)


@law
def overload_of(case: Any, phase: Any, periods: Any, torque: Any, grown: Any) -> Any:
    """Utilisation of the amplifier's I2t overload at ``grown`` times the current."""
    scale = grown * case.safety.rms / abs(torque_constant(case.motor, case.figures.magnet_temperature))
    scale *= 1.0 if case.setting.moves != 0.0 else phase[0]
    return overload_share(case.amplifier, torque, scale, periods.step, periods.edges)


@law(fastmath=FAST)
def worst(case: Any, row: Any, checks: Any, stage: Any, used: Any, binding: Any, peaks: Any) -> Any:
    """The largest utilisation so far and its check, after one more stage (with ``peaks``, its peak checks)."""
    for i in range(len(checks)):
        check = checks[i]
        if check.stage == stage and (check.peak != 0 or not peaks):
            found = utilisation_of(case, row, check)
            if found > used:
                used, binding = found, i
    return used, binding


@law(fastmath=FAST)
def first_lacking(case: Any, row: Any, checks: Any, final: Any) -> Any:
    """Index of the first check that prevents a proof that the drive is feasible, else -1.

    These are essential checks that cannot be made for lack of data and, once all figures are computed (``final``),
    checks that are satisfied only without the allowance for unspecified data.
    """
    torque = known(unknown_torque(case))
    for i in range(len(checks)):
        check = checks[i]
        if not applies(case, row, check):
            continue
        limit, lacks = known_or(row[check.limit], row[check.assumed_limit]), False
        if final or check.stage < TORQUE:
            lacks = math.isnan(utilisation_of(case, row, check))
            lacks &= known(row[check.required] + limit) or (final and check.essential != 0)
        if not final and check.essential != 0:
            lacks |= (check.stage >= TORQUE and not torque) or (check.figured == 0 and math.isnan(limit))
        if lacks:
            return np.int64(i)
    return NOTHING


@law
def applies(case: Any, row: Any, check: Any) -> Any:
    """Whether a check applies: gear checks need a gear, bearing checks a joint that rests on the gear's bearing."""
    return row[check.applies] != 0.0 and (check.geared == 0 or case.direct == 0.0)


@law(fastmath=FAST)
def utilisation_of(case: Any, row: Any, check: Any) -> Any:
    """Utilisation of one check; NaN if it cannot be made or if more than an assumed limit is required."""
    if not applies(case, row, check):
        return np.nan
    required, limit = row[check.required] * row[check.factor] - row[check.origin], row[check.limit]
    assumed = math.isnan(limit) and known(row[check.assumed_limit])
    available = (row[check.assumed_limit] if assumed else limit) - row[check.origin]
    if check.rise != 0 and available <= 0.0:  # at or above the limit by the ambient temperature alone
        return np.inf if known(required) else np.nan
    used = utilisation(required, available)
    if assumed and used > 1.0 and required < np.inf:
        return np.nan
    return np.nan if in_doubt(used, row[check.allowance] * row[check.factor], available) else used


@law
def in_doubt(used: Any, more: Any, available: Any) -> Any:
    """Whether a check is satisfied, but not with the allowance added; an allowance of NaN is unbounded.

    ``available``: limit minus origin.
    """
    return used <= 1.0 and more != 0.0 and not (available > 0.0 and used + more / available <= 1.0)


@law(fastmath=FAST)
def utilisation(required: Any, available: Any) -> Any:
    """Required over available; NaN if one of them is unknown.

    Infinite if something is required and nothing is available, and if the required value is infinite whatever the
    limit.
    """
    if required == np.inf:
        return np.inf
    if available > 0.0 or math.isnan(required) or math.isnan(available):
        return required / available
    return 0.0 if required <= 0.0 else np.inf


# Laws that loop over samples.


@law(fastmath=FAST)
def add_up(load: Any, added: Any, amounts: Any, total: Any, at_rest: Any) -> None:
    """Set a total to a load plus a multiple of each added load (of the joint's own drive, or of payloads).

    ``at_rest``: whether more than the torques is needed.
    """
    add_rows(load.torque, added.torque, amounts, total.torque)
    add_rows(load.stop, added.stop, amounts, total.stop)
    if not at_rest:
        return
    add_rows(load.inertia, added.inertia, amounts, total.inertia)
    add_rows(load.static, added.static, amounts, total.static)
    for component in (0, 1, 3, 4, 5):  # the moment along its axis does not load the bearing
        start, out = load.wrench[component], total.wrench[component]
        for k in range(len(amounts)):
            add_row(start if k == 0 else out, added.wrench[k, component], amounts[k], out)


@law(fastmath=FAST)
def add_row(start: Any, row: Any, amount: Any, out: Any) -> None:
    for t in range(len(out)):
        out[t] = start[t] + amount * row[t]


@law
def applies_at_rest(case: Any) -> Any:
    """Whether a figure of bearing load, holding torque or load inertia is needed."""
    setting, limited = case.setting, known(case.safety.inertia_ratio)
    applies = setting.bearing != 0.0 or setting.brake != 0.0 or setting.resonance != 0.0 or setting.ramped == 0.0
    return applies or limited


@law(fastmath=FAST)
def add_rows(start: Any, rows: Any, amounts: Any, out: Any) -> None:
    """Set out = start + sum of amounts[k] * rows[k]; in a single pass for a drive's parameters."""
    if len(amounts) == 5:
        a, b, c, d, e = amounts[0], amounts[1], amounts[2], amounts[3], amounts[4]
        r0, r1, r2, r3, r4 = rows[0], rows[1], rows[2], rows[3], rows[4]
        for t in range(len(out)):
            out[t] = start[t] + (a * r0[t] + b * r1[t] + c * r2[t] + d * r3[t] + e * r4[t])
        return
    for t in range(len(out) if len(amounts) == 0 else 0):
        out[t] = start[t]
    for k in range(len(amounts)):
        add_row(start if k == 0 else out, rows[k], amounts[k], out)


@law(fastmath=FAST)
def set_carried(case: Any, load: Any, weight: Any, speed: Any, quick: Any) -> None:
    """Set the figures of output bearing, holding brake and load inertia; NaN if their series are unknown."""
    gear, figures, arm, wrench = case.gear, case.figures, bearing_arm(case.gear), load.wrench
    mx, my, fx, fy, fz = wrench[0], wrench[1], wrench[3], wrench[4], wrench[5]
    lever, unknown = known_or(arm, 0.0), 0.0 * arm if len(mx) > 0 else np.nan
    tilt, side, push, inertia, static = 0.0, 0.0, 0.0, 0.0, 0.0
    for t in range(len(mx)):
        tilt = larger(tilt, moment_square(lever, mx[t], my[t], fx[t], fy[t]))
        side = larger(side, fx[t] * fx[t] + fy[t] * fy[t])
        push = larger(push, abs(fz[t]))
    for t in range(len(load.inertia)):
        inertia = larger(inertia, abs(load.inertia[t]))
    for t in range(len(load.static)):
        static = larger(static, abs(load.static[t]))
    figures.tilting_moment = math.sqrt(tilt) + unknown
    figures.radial_load, figures.axial_load = (math.sqrt(side), push) if len(mx) > 0 else (np.nan, np.nan)
    figures.bearing_static_load = static_load(
        gear.bearing_pitch_diameter, figures.tilting_moment, figures.radial_load, figures.axial_load
    )
    needed = known(gear.bearing_dynamic_rating + figures.bearing_static_load)
    if needed and (known(case.safety.life) or not quick):
        mean = mean_bearing_load(gear.bearing_pitch_diameter, arm, wrench, weight, speed)
        fw, mean_speed = case.safety.bearing_load_factor, case.setting.mean_speed
        figures.bearing_life = bearing_life(gear.bearing_dynamic_rating, fw, mean, mean_speed)
    rotor = case.motor.rotor_inertia + known_or(gear.inertia, 0.0)
    largest_inertia = inertia if len(load.inertia) > 0 else np.nan
    own = case.motor.rotor_inertia + known_or(gear.inertia - gear.stage_inertia, 0.0)  # the stages belong to the load
    figures.inertia_ratio = (largest_inertia + stage_load(gear)) / (gear.ratio * gear.ratio * own)
    carried = largest_inertia + gear.stage_sprung
    figures.required_stiffness = case.setting.resonance * case.setting.resonance * carried
    figures.holding_torque = holding_torque(static if len(load.static) > 0 else np.nan, gear.ratio)
    turning, strength = rotor + largest_inertia / (gear.ratio * gear.ratio), case.motor.brake.static_torque
    figures.stopping_energy = stopping_energy(strength, figures.holding_torque, turning, figures.input_speed)


@law(fastmath=FAST)
def mean_bearing_load(diameter: Any, arm: Any, wrench: Any, weight: Any, speed: Any) -> Any:
    """Mean load of the output bearing over its travel, (sum |n| P^(10/3) t / sum |n| t)^(3/10) [N]."""
    worn, travel = 0.0, 0.0
    for t in range(wrench.shape[1]):
        fx, fy = wrench[3, t], wrench[4, t]
        moment = math.sqrt(moment_square(arm, wrench[0, t], wrench[1, t], fx, fy))
        load = equivalent_load(diameter, moment, math.sqrt(fx * fx + fy * fy), abs(wrench[5, t]))
        travelled = weight[t] * abs(speed[t])
        worn += travelled * wear(load, ROLLER_EXPONENT)
        travel += travelled
    return (worn / travel) ** (1.0 / ROLLER_EXPONENT) if travel > 0.0 else 0.0


@law(fastmath=FAST)
def ramped_stop(case: Any, stop: Any, stops: Any) -> Any:
    """Largest gear and motor torque [N m] in stops on a ramp.

    Losses would help a braking motor and are left out there; a motor that drives on against a weight overcomes all of
    them.
    """
    mesh, joint, shaft = mesh_of(case.gear), friction_curve(case.joint), friction_curve(case.shaft)
    ratio, load, motor, unknown = case.gear.ratio, 0.0, 0.0, unknown_torque(case)
    inertia = drive_inertia(case)
    excess_series(joint, 1.0, stops.speed, stops.joint_excess)
    excess_series(shaft, ratio, stops.speed, stops.shaft_excess)
    drag_series(mesh, stop_temperature(case), stops.speed, stops.powers, stops.drag)
    for t in range(len(stop)):
        speed = stops.speed[t]
        rotor = rotor_torque(inertia, ratio, stops.acceleration[t], stops.carrier_acceleration[t])
        lossy = stop[t] + sliding_friction(joint, speed) + stops.joint_excess[t]
        shaft_torque = sliding_friction(shaft, ratio * speed) + stops.shaft_excess[t] + stops.drag[t]
        taken = abs(stop[t] + stage_load(case.gear) * stops.acceleration[t])
        load = larger(load, larger(larger(abs(stop[t]), taken), abs(lossy)))
        motor = larger(
            motor, larger(abs(stop[t] / ratio + rotor), abs(mesh_torque(mesh, lossy, speed) + rotor + shaft_torque))
        )
    return load, motor + unknown


@law
def hard_stop(case: Any, motion: Any, torque: Any, load_inertia: Any, trace: Any) -> Any:
    """Stops at the current limit while the other joints follow the cycle: largest gear torque, motor torque that holds
    the load, longest travel.

    The travel is that of a lossless gear with the magnets of the data sheet, which is the longest; the torque is that
    of cold magnets. Joint friction, which helps to brake, is left out.
    """
    mesh, shaft, ratio = mesh_of(case.gear), friction_curve(case.shaft), case.gear.ratio
    inertia = drive_inertia(case)
    rides, limit = case.setting.rides, stop_constant(case) * case.setting.stop_current
    weaker = case.motor.torque_constant * case.setting.stop_current
    rotor, own = stop_rotor(ratio, inertia, rides)
    stiff, factor = stiff_spring(case.gear).slope_3, drag_factor(mesh, stop_temperature(case))
    spring = swing_spring(case.gear)
    largest, holding, longest = 0.0, 0.0, 0.0
    for t in range(len(torque)):
        speed, load = motion.loss_speed[t], load_inertia[t] + own
        static = torque[t] - load * motion.acceleration[t]
        holding = max(holding, abs(static / ratio))
        sign, trace[t] = direction(speed), 0.0
        if sign == 0.0:
            continue
        carrier = motion.carrier_acceleration[t] - rides * motion.acceleration[t]
        push = braking_push(mesh, shaft, factor, inertia, limit, speed, carrier)
        found = braked(mesh.driving, mesh.driven, rotor, push, static, load, sign)
        share = overshoot(case.gear.stiffness_1, load, rotor, case.setting.stop_rise)
        trace[t] = stop_swing(spring, stiff, share, found, static, torque[t], load, motion.speed[t])
        trace[t] += stage_load(case.gear) * abs(found.acceleration)
        free = braking_push(mesh, shaft, 0.0, inertia, weaker, speed, carrier)
        slowing = -sign * braked(1.0, 1.0, rotor, free, static, load, sign).acceleration
        largest = max(largest, trace[t])
        longest = max(longest, 0.5 * speed * speed / slowing) if slowing > 0.0 else np.inf
    return largest, holding, longest


@kernel(fastmath=FAST)
def safe_stop_current(cases: Any, motion: Any, torque: Any, load_inertia: Any, allowed: float) -> float:
    """Largest stop current [A], up to that of a case, at which no ``hard_stop`` needs more gear torque than allowed
    [N m], by bisection; ``cases``: this case alone, whose stop current is changed.
    """
    case, trace, low, high = cases[0], np.zeros(len(torque)), 0.0, 1.0
    full = case.setting.stop_current
    if hard_stop(case, motion, torque, load_inertia, trace)[0] <= allowed:
        return float(full)
    for _ in range(HALVINGS):
        share = 0.5 * (low + high)
        case.setting.stop_current = share * full
        safe = hard_stop(case, motion, torque, load_inertia, trace)[0] <= allowed
        low, high = (share, high) if safe else (low, share)
    return float(low * full)


class Mechanical(NamedTuple):
    """Result of ``mechanical``: largest and average load, largest motor torque, sums of its weighted squares (of all
    phases, of the worst phase), largest joint torque; see ``Figures``.
    """

    load: float
    average_load: float
    torque: float
    square: float
    phase: float
    joint: float


@law(fastmath=FAST)
def excess_series(curve: Any, ratio: Any, speed: Any, excess: Any) -> None:
    """Friction torque above the sum of Coulomb and viscous friction (Stribeck, tanh) [N m], for a shaft that turns
    ``ratio`` times as fast as the output.

    It has a loop of its own because an exponential keeps a whole loop from being vectorised; most drives have none.
    """
    excess[:] = 0.0
    if curve.falls:
        for t in range(len(speed)):
            excess[t] = static_excess(curve, ratio * speed[t])


@law(fastmath=FAST)
def drag_series(mesh: Any, temperature: Any, speed: Any, powers: Any, drag: Any) -> None:
    """Drag torque of the gear at a temperature [N m]; powers of the speeds are kept for gears of the same exponent."""
    if powers.exponent[0] != mesh.exponent:
        powers.exponent[0] = mesh.exponent
        for t in range(len(speed)):
            powers.values[t] = speed_power(mesh.exponent, speed[t])
    factor = drag_factor(mesh, temperature) * speed_power(mesh.exponent, mesh.ratio)
    for t in range(len(speed)):
        drag[t] = grown_drag(mesh, factor * powers.values[t], mesh.ratio * speed[t])


@law(fastmath=FAST)
def mechanical(case: Any, motion: Any, gear_torque: Any, traces: Any, gear_temperature: Any) -> Any:
    """Gear load and motor torque at every sample, and their extremes.

    The average load follows Harmonic Drive SHG, p. 30; if nothing turns it is the largest static load. Extremes include
    the torque that breaks a resting joint loose.
    """
    mesh, torque = mesh_of(case.gear), traces.torque[1:-1]
    inertia = drive_inertia(case)
    joint, shaft = friction_curve(case.joint), friction_curve(case.shaft)
    excess_series(joint, 1.0, motion.speed, traces.excess[0])
    excess_series(joint, 1.0, motion.loss_speed, traces.excess[1])
    excess_series(shaft, mesh.ratio, motion.loss_speed, traces.excess[2])
    drag_series(mesh, gear_temperature, motion.loss_speed, traces.powers, traces.drag)
    largest_load, largest_joint, largest, square, phase = 0.0, 0.0, 0.0, 0.0, 0.0
    more, own = onward(case.gear) - 1.0, stage_load(case.gear)
    for t in range(len(torque)):
        speed = motion.loss_speed[t]
        load = gear_torque[t] + sliding_friction(joint, motion.speed[t]) + traces.excess[0, t]
        lossy = gear_torque[t] + sliding_friction(joint, speed) + traces.excess[1, t]
        torque[t] = (
            mesh_torque(mesh, lossy, speed)
            + rotor_torque(inertia, mesh.ratio, motion.acceleration[t], motion.carrier_acceleration[t])
            + sliding_friction(shaft, mesh.ratio * speed) + traces.excess[2, t]
            + traces.drag[t]
        )  # fmt: skip
        driven = gear_load(more, own, load, motion.speed[t], motion.acceleration[t])
        largest_joint, largest_load, largest = (
            larger(largest_joint, abs(load)),
            larger(largest_load, driven),
            larger(largest, abs(torque[t])),
        )
        heating = motion.weight[t] * torque[t] * torque[t]
        square += heating
        phase += heating * motion.phase_ratio[t] * motion.phase_ratio[t]
        traces.load[t], traces.gear_load[t] = load, driven
    moves = case.setting.moves
    resting_load, start = at_rest(
        moves, mesh, inertia, joint, shaft, motion, gear_torque, torque, traces.load, traces.starting
    )
    largest_joint, largest_load = (
        larger(largest_joint, resting_load),
        larger(largest_load, resting_load * (1.0 + more * moves)),
    )
    largest = larger(largest, start)
    average = average_load(traces.gear_load, motion.speed, motion.weight, case.gear.life_exponent, largest_load)
    return Mechanical(largest_load, average, largest, square, phase, largest_joint)


@law(fastmath=FAST)
def gear_load(more: Any, own: Any, load: Any, speed: Any, acceleration: Any) -> Any:
    """Magnitude of the gear's output torque for a joint load [N m]: stages behind the gear increase it by the share
    ``more`` in losses and need ``own * acceleration``, which never counts as relief.
    """
    driven = load * (1.0 + more * (load * speed > 0.0))
    return larger(abs(driven), abs(driven + own * acceleration))


@law(fastmath=FAST)
def average_load(load: Any, speed: Any, weight: Any, exponent: Any, largest_at_rest: Any) -> Any:
    """(sum |n| |T|^e t / sum |n| t)^(1/e), or the largest static load if nothing turns. Its own loop needs no power
    function for e = 3.
    """
    worn, travel = 0.0, 0.0
    for t in range(len(load)):
        travelled = weight[t] * abs(speed[t])
        worn += travelled * wear(load[t], exponent)
        travel += travelled
    return (worn / travel) ** (1.0 / exponent) if travel > 0.0 else largest_at_rest


@law(fastmath=FAST)
def at_rest(
    moves: Any, mesh: Any, inertia: Any, joint: Any, shaft: Any, motion: Any, gear_torque: Any, torques: Any,
    loads: Any, starts: Any,
) -> Any:  # fmt: skip
    """Largest load and motor torque during all stretches of standstill, including breakaway if the joint ever moves.

    ``starts`` is set as ``Traces.starting``.
    """
    accelerations, carriers, upcoming_speeds = motion.acceleration, motion.carrier_acceleration, motion.next_speed
    largest_load, largest = 0.0, 0.0
    for first, last in motion.rests:
        rest = slice(first, last)
        acceleration, carrier, upcoming_speed = accelerations[rest], carriers[rest], upcoming_speeds[rest]
        at_gear, torque, load, starting = gear_torque[rest], torques[rest], loads[rest], starts[rest]
        for t in range(len(at_gear)):
            rotor = rotor_torque(inertia, mesh.ratio, acceleration[t], carrier[t])
            start = starting_torque(mesh, shaft, joint, at_gear[t], rotor, upcoming_speed[t])
            starting[t] = larger(abs(torque[t]), abs(start) * moves)
            loose = larger(abs(load[t]), abs(loosening_load(joint, load[t], upcoming_speed[t])) * moves)
            largest_load, largest = larger(largest_load, loose), larger(largest, starting[t])
    return largest_load, largest


@law
def warm_up(case: Any, motion: Any, traces: Any) -> None:
    """Set the steady periodic temperatures of a drive, and the winding temperature at each sample.

    If data is missing or no steady state exists, the magnets are taken at ambient temperature and the winding at its
    limit. The gear's loss reaches the winding through the housing, which evens it out: its mean counts, of a gear as
    warm as the housing. If the winding time constant is unknown, the hottest phase is computed a second time with the
    shortest time constant that such a motor may have; the difference is an allowance.
    """
    motor, figures, ambient, losses = case.motor, case.figures, case.setting.ambient, traces.losses
    nodes, rest = thermal_nodes(motor, case.setting.mounting), known_or(motor.max_winding_temperature, ambient)
    figures.winding_temperature, figures.hottest_time, figures.hottest_part = np.nan, np.nan, 0.0
    figures.phase_temperature = np.nan
    figures.heat_converged, figures.magnet_temperature, losses.housing_at[0] = 1.0, ambient, ambient
    figures.housing_temperature, figures.gear_loss, share = np.nan, np.nan, case.setting.gear_heat
    stated = case.setting.gear_temperature if case.setting.settles == 0.0 else np.nan
    figures.gear_temperature = stated if share == 0.0 else np.nan
    shaft_losses(case, motion.speed, traces)
    set_held(motion.phase_ratio, traces.torque[1:-1], traces.losses.held, traces.losses.memory[0])
    if known(nodes.inner + nodes.outer):
        periods, parts, copper = motion.periods, traces.parts, copper_of(motor, ambient)
        interval_means(traces.torque[1:-1], traces.friction_loss, losses)
        part_means(periods, losses, parts)
        square, loss, figures.gear_loss = 0.0, 0.0, 0.0
        for i in range(len(parts)):
            square += periods.shares[i] * parts[i].square
            loss += periods.shares[i] * parts[i].loss
        for i in range(len(parts)):
            first, after = periods.edges[i], periods.edges[i + 1]
            if nodes.inner > 0.0:
                gear = settled_loss(case, nodes, motion.weight, traces.mesh_loss, traces.drag_loss, square, loss)
            else:
                gear = settled_loss(
                    case, nodes, motion.weight[first:after], traces.mesh_loss[first:after],
                    traces.drag_loss[first:after], parts[i].square, parts[i].loss,
                )  # fmt: skip
            figures.gear_loss += periods.shares[i] * gear
            warmed = losses.housing[first:after]
            for t in range(len(warmed)):
                warmed[t] += share * gear
        heat = periodic_heat(nodes, copper, periods, losses, parts, ambient)
        figures.winding_temperature, figures.hottest_time = heat.peak, heat.peak_time
        figures.hottest_part, figures.heat_converged = heat.peak_part, heat.converged
        figures.phase_temperature = hottest_phase(nodes, copper, periods, losses, heat, ambient)
        least = figures.phase_temperature
        if math.isnan(motor.winding_time_constant) and least < np.inf:
            fast = quick_nodes(nodes, least_winding_time(motor))
            quickest = hottest_bound(fast, copper, periods, losses, parts, heat.magnets, ambient)
            if quickest > case.limits.winding_temperature:
                state = periodic_heat(fast, copper, periods, losses, parts, ambient)
                quickest = hottest_phase(fast, copper, periods, losses, state, ambient)
                # restores the temperatures at the samples
                heat = periodic_heat(nodes, copper, periods, losses, parts, ambient)
            case.allowance.winding_temperature = max(quickest - least, 0.0)
        trace_own_periods(nodes, copper, periods, losses, parts, heat.magnets, ambient)
        figures.housing_temperature = heat.housing
        if share > 0.0:  # a stated temperature, that of the drag, never lowers the housing's
            warmth = heat.housing if heat.peak < np.inf else np.inf
            figures.gear_temperature = max(warmth, known_or(stated, warmth))
        if heat.peak < np.inf:
            figures.magnet_temperature = heat.magnets
            return
    losses.winding_at[:] = rest


@law(fastmath=FAST)
def set_held(phase: Any, torque: Any, held: Any, extra: Any) -> None:
    """Mean square torque of the most loaded phase in excess of that of the whole winding [N^2 m^2], from each sample to
    the next.

    ``phase``: as ``Motion.phase_ratio``; ``extra`` is memory, (N + 1,).
    """
    for t in range(len(torque)):
        extra[t] = (phase[t] * phase[t] - 1.0) * torque[t] * torque[t]
    for t in range(len(torque) - 1):
        held[t] = 0.5 * (extra[t] + extra[t + 1])
    held[len(torque) - 1] = extra[len(torque) - 1]


@law(fastmath=FAST)
def shaft_losses(case: Any, speeds: Any, traces: Any) -> None:
    """Losses by place [W]: in the motor housing (shaft friction, brake coil, amplifier if mounted there), in mesh and
    seals, and the drag loss at the reference temperature.

    The amplifier's current is computed with magnets as hot as the winding may be, which is conservative.
    """
    shaft, mesh, loss = friction_curve(case.shaft), mesh_of(case.gear), traces.friction_loss
    coil, reference = known_or(case.motor.brake.power, 0.0), 1.0 / drag_factor(mesh, case.setting.gear_temperature)
    excess_series(shaft, mesh.ratio, speeds, traces.excess[2])
    share, hot = case.setting.amplifier_heat, known_or(case.motor.max_winding_temperature, WARMEST)
    coil += share * known_or(case.amplifier.standby_power, 0.0)
    constant = torque_constant(case.motor, hot)
    bridge = share * conduction_loss(known_or(case.amplifier.on_resistance, 0.0), 1.0 / constant)
    for t in range(len(loss)):
        speed = mesh.ratio * speeds[t]
        seal = mesh.seal * abs(speed) * (traces.drag[t] != 0.0)
        lost = bridge * traces.torque[t + 1] * traces.torque[t + 1]
        loss[t] = (sliding_friction(shaft, speed) + traces.excess[2, t]) * speed + coil + lost
        traces.mesh_loss[t] = mesh_loss_power(mesh, traces.load[t], speeds[t]) + seal
        traces.drag_loss[t] = (traces.drag[t] * speed - seal) * reference


@law(fastmath=FAST)
def settled_loss(case: Any, nodes: Any, weight: Any, mesh: Any, drag: Any, square: Any, heat: Any) -> Any:
    """Mean loss of a gear over some samples at the temperature that it reaches [W].

    ``mesh``, ``drag``: its losses as in ``Traces``; ``square``: mean square torque; ``heat``: other losses in the
    housing [W].
    """
    meshed, dragged, whole, share = 0.0, 0.0, 0.0, case.setting.gear_heat
    for t in range(len(weight)):
        whole += weight[t]
        meshed += weight[t] * mesh[t]
        dragged += weight[t] * drag[t]
    if whole <= 0.0:
        return 0.0
    meshed, dragged = meshed / whole, dragged / whole
    return meshed + dragged * settled_factor(case, nodes, square, heat + share * meshed, share * dragged)


@law
def settled_factor(case: Any, nodes: Any, square: Any, heat: Any, drag: Any) -> Any:
    """Temperature factor on the drag of a gear as warm as its housing, or at ``gear_temperature`` if the study states
    it.

    The copper loss is that of a motor at the lowest temperature of the drag model. A gear that is assumed too cold
    overestimates the drag, so higher ambient temperature or resistance never lowers the computed winding temperature.
    """
    mesh, motor, setting = mesh_of(case.gear), case.motor, case.setting
    if setting.settles == 0.0 or mesh.cooling <= 0.0 or drag <= 0.0:
        return drag_factor(mesh, setting.gear_temperature)
    cold = min(setting.ambient, DRAG_TEMPERATURES[0])
    constant = torque_constant(motor, cold)
    copper = square * winding_resistance(motor, cold) / (constant * constant)
    return drag_factor(mesh, settled_temperature(mesh, setting.ambient, nodes.outer, copper + heat, drag))


@law
def torque_factor(safety: Any) -> Any:
    """Safety factor on the torque in voltage checks: that on peak torque, at least 1.

    A braking motor may need more voltage at less torque, so voltages are computed with and without the factor and the
    larger one counts.
    """
    return max(safety.peak_torque, 1.0)


@law(fastmath=FAST)
def voltage_at(case: Any, speeds: Any, rates: Any, torques: Any, cold: Any) -> Any:
    """Largest terminal voltage of a cold motor [V]: its stronger magnets need more voltage at speed.

    ``torques``: with a sample more at each end.
    """
    before, torque, after = torques[:-2], torques[1:-1], torques[2:]
    ratio, inductance, largest = case.gear.ratio, known_or(case.motor.inductance, 0.0), 0.0
    constant, ohms = torque_constant(case.motor, cold), winding_resistance(case.motor, cold)
    inverse, more = 1.0 / constant, torque_factor(case.safety)
    for t in range(len(torque)):
        rate = rates[0, t] * before[t] + rates[1, t] * torque[t] + rates[2, t] * after[t]
        speed = ratio * speeds[t]
        current, rise = torque[t] * inverse, rate * inverse
        volts = winding_voltage(constant, ohms, inductance, speed, current, rise)
        with_factor = winding_voltage(constant, ohms, inductance, speed, more * current, more * rise)
        largest = larger(largest, larger(abs(volts), abs(with_factor)))
    return largest


@law(fastmath=FAST)
def starting_voltage(case: Any, rests: Any, winding_at: Any, torque: Any) -> Any:
    """Largest terminal voltage to start the joint from rest or to hold it [V]; ``torque``: ``Traces.starting``."""
    largest, constant = 0.0, torque_constant(case.motor, case.figures.magnet_temperature)
    more = torque_factor(case.safety)
    for first, last in rests:
        winding, starting = winding_at[first:last], torque[first:last]
        for t in range(len(starting)):
            hot = winding_resistance(case.motor, winding[t])
            largest = larger(largest, abs(more * hot * starting[t] / constant))
    return largest


@law(fastmath=FAST)
def electrical(case: Any, motion: Any, torques: Any, load: Any, winding_at: Any, power: Any) -> Any:
    """Largest terminal voltage at the temperatures of the cycle [V]; adds the drive's power without L di/dt to
    ``power`` [W].

    ``power`` has two rows: the expected power, and its lower bound with lossless gear and shaft and a cold winding,
    which feeds back more. A brake coil draws its power while it is open. Sets energy and mean power, including the
    amplifier's conduction loss. ``torques``: with a sample more at each end.
    """
    drawn_power, least_power, switches = power[0], power[1], known_or(case.amplifier.on_resistance, 0.0)
    inertia = drive_inertia(case)
    lowest = coldest(case.setting)
    cold = torque_constant(case.motor, lowest)
    loss = winding_resistance(case.motor, lowest) / (cold * cold)
    before, torque, after, rates = torques[:-2], torques[1:-1], torques[2:], motion.rates
    ratio, inductance, largest, energy = case.gear.ratio, known_or(case.motor.inductance, 0.0), 0.0, 0.0
    constant, ohms = torque_constant(case.motor, case.figures.magnet_temperature), winding_resistance(case.motor, 0.0)
    slope, inverse, more = winding_resistance(case.motor, 1.0) - ohms, 1.0 / constant, torque_factor(case.safety)
    coil = known_or(case.motor.brake.power, 0.0)
    for t in range(len(torque)):
        rate = rates[0, t] * before[t] + rates[1, t] * torque[t] + rates[2, t] * after[t]
        speed, current, hot = ratio * motion.speed[t], torque[t] * inverse, ohms + slope * winding_at[t]
        volts = winding_voltage(constant, hot, inductance, speed, current, rate * inverse)
        with_factor = winding_voltage(constant, hot, inductance, speed, more * current, more * (rate * inverse))
        drawn = winding_voltage(constant, hot, 0.0, speed, current, 0.0) * current + coil
        largest = larger(largest, larger(abs(volts), abs(with_factor)))
        taken = drawn + conduction_loss(switches, current)
        energy += motion.weight[t] * taken
        free = load[t] / ratio
        free += rotor_torque(inertia, ratio, motion.acceleration[t], motion.carrier_acceleration[t])
        drawn_power[t] += taken
        least_power[t] += smaller(drawn, free * (speed + loss * free))
    case.figures.energy, case.figures.mean_power = energy, energy / case.setting.duration
    return largest
