"""The limits of motor and amplifier held against the task: torque, current, speed, voltage, heat, inertia."""

from __future__ import annotations

import math

from drivetrain.drive.amplifier import available_voltage
from drivetrain.drive.drive import drive_inertia
from drivetrain.drive.heat import rms_rule_validity, thermal_network
from drivetrain.drive.motor import Motor, stall_torque
from drivetrain.motion.duty_cycle import sample_weights
from drivetrain.sizing.judge.held import Limit, held, judged, peak, reported
from drivetrain.sizing.judge.operation import Operation
from drivetrain.study.verdicts import Check, Verdict

NO_SHORT_TIME = "the sheet prints no short-time limit"


def motor_speed(op: Operation) -> Check:
    """The largest rotor speed against the motor's mechanical limit.

    Returns:
        The check [rad/s].
    """
    fastest = op.demand.fastest
    required = op.safety.speed * abs(op.drive.gear.ratio) * fastest.value
    limit = _limit(op, op.drive.motor.max_speed, "maximum speed")
    return held("motor speed", "rad/s", required, limit, reserve=op.safety.reserve, time=fastest.time)


def motor_peak_torque(op: Operation) -> Check:
    """The largest electromagnetic torque, starting from rest included, against the short-time limit.

    Returns:
        The check [N m].
    """
    name = "motor peak torque"
    if op.missing:
        return reported(name, "N m", None, _unknown(op))
    largest = peak(op.demand.time, op.peak_torque)
    required = op.safety.peak_torque * largest.value
    return held(name, "N m", required, peak_torque_limit(op), reserve=op.safety.reserve, time=largest.time)


def motor_peak_current(op: Operation) -> Check:
    """The largest current, magnets warm, against the motor's printed peak current.

    Returns:
        The check [A], DC equivalent.
    """
    return _peak_current(op, "motor peak current", _limit(op, op.drive.motor.peak_current, "peak current"))


def amplifier_peak_current(op: Operation) -> Check:
    """The largest current, magnets warm, against the amplifier's peak current.

    Returns:
        The check [A], DC equivalent.
    """
    limit = _amplifier_limit(op.task.amplifier.peak_current, "peak current")
    return _peak_current(op, "amplifier peak current", limit)


def motor_voltage(op: Operation) -> Check:
    """The voltage at every sample, warm and cold, against what reaches the terminals.

    Returns:
        The check [V].
    """
    name = "motor voltage"
    if op.missing:
        return reported(name, "V", None, _unknown(op))
    largest = peak(op.demand.time, op.largest_voltage)
    amplifier = op.task.amplifier
    remark = "" if op.drive.motor.inductance is not None else "inductance unknown: its share is left out"
    source = f"supply {op.supply.voltage:g} V x modulation {amplifier.modulation:g}"
    limit = Limit(available_voltage(amplifier, op.supply.voltage), source, remark)
    required = op.safety.voltage * largest.value
    return held(name, "V", required, limit, reserve=op.safety.reserve, time=largest.time)


def motor_rms_current(op: Operation) -> Check:
    """The RMS current, friction counted before squaring, against the smaller of nominal and thermal limit.

    Returns:
        The check [A], DC equivalent.
    """
    name = "motor RMS current"
    if op.missing:
        return reported(name, "A", None, _unknown(op))
    known = op.continuous_current
    remark = known.source if known.value is None else _rms_remark(op, known.value)
    limit = Limit(known.value, known.source, remark)
    return held(name, "A", op.safety.rms * op.rms_current, limit, reserve=op.safety.reserve)


def amplifier_continuous_current(op: Operation) -> Check:
    """The RMS current against the amplifier's continuous current.

    Returns:
        The check [A], DC equivalent.
    """
    name = "amplifier continuous current"
    if op.missing:
        return reported(name, "A", None, _unknown(op))
    limit = _amplifier_limit(op.task.amplifier.continuous_current, "continuous current")
    return held(name, "A", op.safety.rms * op.rms_current, limit, reserve=op.safety.reserve)


def winding_temperature(op: Operation) -> Check:
    """The hottest winding of the cycle that repeats for ever against its limit less the margin.

    Its utilisation is that of the rise over ambient, so that a warm day counts.

    Returns:
        The check [C].
    """
    name, limit = "winding temperature", op.drive.motor.max_winding_temperature
    if op.missing:
        return reported(name, "C", None, _unknown(op))
    if limit is None:
        return reported(name, "C", None, "the sheet prints no winding limit")
    if op.heat is None:
        return reported(name, "C", None, "the sheet has no thermal resistances for this mounting")
    allowed = limit - op.safety.temperature_margin
    source = f"winding limit {limit:g} °C of {_name(op.drive.motor)}"
    if op.safety.temperature_margin:
        source += f" less {op.safety.temperature_margin:g} K"
    if op.heat.runaway:
        remark = "no steady temperature: the losses grow faster with temperature than the cooling"
        return Check(name, math.inf, allowed, "C", math.inf, Verdict.FAIL, None, source, remark)
    hottest = op.heat.peak_winding
    room = allowed - op.ambient
    used = (hottest - op.ambient) / room if room > 0.0 else math.inf
    remark = "" if op.heat.ripple_known else "mean over the cycle: the winding time constant is unknown"
    return Check(name, hottest, allowed, "C", used, judged(used, op.safety.reserve), op.heat.peak_time, source, remark)


def inertia_ratio(op: Operation) -> Check:
    """The reflected load inertia over that of the rotor, at its largest; judged only where the study sets a limit."""
    name, inertia = "inertia ratio", op.demand.load_inertia
    if inertia is None:
        return reported(name, "1", None, "neither an arm nor the joint's load_inertia tells it")
    if op.drive.motor.rotor_inertia is None:
        return reported(name, "1", None, "the sheet prints no rotor inertia")
    ratios = inertia / (op.drive.gear.ratio**2 * drive_inertia(op.drive))
    largest = peak(op.demand.time, ratios)
    span = f"{float(ratios.min()):.3g} to {largest.value:.3g} over the motion"
    if op.safety.inertia_ratio is None:
        return reported(name, "1", largest.value, f"{span}; told, not judged", time=largest.time)
    limit = Limit(op.safety.inertia_ratio, "the study's limit", span)
    return held(name, "1", largest.value, limit, reserve=op.safety.reserve, time=largest.time)


SPEED_CHECKS = (motor_speed, inertia_ratio)
"""Checks of the motor that need no torque."""

TORQUE_CHECKS = (motor_peak_torque,)
"""Checks that need the torque and no temperature."""

ELECTRIC_CHECKS = (
    motor_peak_current,
    amplifier_peak_current,
    motor_voltage,
    motor_rms_current,
    winding_temperature,
    amplifier_continuous_current,
)
"""Checks that need the current of the warm motor."""


def _peak_current(op: Operation, name: str, limit: Limit) -> Check:
    if op.missing:
        return reported(name, "A", None, _unknown(op))
    largest = peak(op.demand.time, op.peak_current)
    required = op.safety.peak_torque * largest.value
    return held(name, "A", required, limit, reserve=op.safety.reserve, time=largest.time)


def peak_torque_limit(op: Operation) -> Limit:
    """The short-time limit of a drive's motor.

    Returns:
        The limit [N m].
    """
    return short_time_limit(op.drive.motor)


def short_time_limit(motor: Motor) -> Limit:
    """Printed peak torque, else what the printed peak current makes, else what nominal voltage makes at stall.

    Returns:
        The limit [N m].
    """
    if motor.peak_torque is not None:
        return _printed(motor, motor.peak_torque, "peak torque")
    if motor.peak_current is not None:
        return _printed(motor, motor.torque_constant * motor.peak_current, "torque constant x peak current")
    blocked = stall_torque(motor) if motor.stall_torque is None else motor.stall_torque
    if blocked is None:
        return Limit(None, "", f"{NO_SHORT_TIME} and no nominal voltage")
    return _printed(motor, blocked, "stall torque")._replace(
        remark=f"{NO_SHORT_TIME}: the stall torque at nominal voltage holds, heat and voltage are judged apart"
    )


def _rms_remark(op: Operation, continuous: float) -> str:
    """Why the RMS rule may mislead here."""
    network = thermal_network(op.drive.motor, op.ambient, housing_to_ambient=op.task.housing_to_ambient)
    if network is None:
        return "the sheet has no thermal data to tell whether the RMS rule holds"
    cycle = op.demand.cycle
    said = rms_rule_validity(network, op.demand.time, op.current, continuous, parts=cycle.parts)
    return said or _hot_parts(op, continuous)


def _hot_parts(op: Operation, continuous: float) -> str:
    """Which parts of a mix overload the motor if they are run for long."""
    cycle, square = op.demand.cycle, op.current**2
    if len(cycle.parts) == 1:
        return ""
    weights = [sample_weights(cycle.time[part]) for part in cycle.parts]
    means = [square[part] @ each / each.sum() for part, each in zip(cycle.parts, weights, strict=True)]
    hot = [name for name, mean in zip(cycle.part_names, means, strict=True) if mean > continuous**2]
    told = f"RMS of the mix; {', '.join(hot)} run by itself is above the limit: see the winding temperature"
    return told if hot else ""


def _amplifier_limit(value: float | None, what: str) -> Limit:
    remark = f"the study states no amplifier {what}" if value is None else ""
    return Limit(value, f"amplifier {what} of the study", remark)


def _limit(op: Operation, value: float | None, what: str) -> Limit:
    return _printed(op.drive.motor, value, what)


def _printed(motor: Motor, value: float | None, what: str) -> Limit:
    """A number of the motor's sheet as a limit."""
    lack = f"the sheet prints no {what}" if value is None else ""
    return Limit(value, f"{what} of {_name(motor)}", lack)


def _unknown(op: Operation) -> str:
    return f"cannot be computed: {op.missing} not on the sheet and not assumed"


def _name(motor: Motor) -> str:
    return f"motor {motor.key}" + (f" ({motor.source})" if motor.source else "")
