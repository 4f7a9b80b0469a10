"""The gear's limits held against the task: torques, speeds, life, and the load on its output bearing."""

from __future__ import annotations

from drivetrain.drive.gear import Gear, gear_life, torque_exponent
from drivetrain.sizing.judge.held import Limit, Peak, held, reported
from drivetrain.sizing.judge.operation import Operation
from drivetrain.study.verdicts import Check

HOUR = 3600.0  # s


def gear_repeated_peak_torque(op: Operation) -> Check:
    """The largest torque of every cycle against the repeated-peak limit.

    Returns:
        The check [N m].
    """
    gear = op.drive.gear
    limit = _limit(op, gear.repeated_peak_torque, "repeated peak torque")
    if gear.repeated_peak_torque is None and gear.continuous_torque is not None:
        remark = "the sheet prints no repeated peak torque: the continuous one holds"
        limit = Limit(gear.continuous_torque, f"continuous torque of {_name(gear)}", remark)
    largest = op.demand.largest_load
    required = op.safety.peak_torque * largest.value
    return held("gear repeated peak torque", "N m", required, limit, reserve=op.safety.reserve, time=largest.time)


def gear_momentary_torque(op: Operation) -> Check:
    """The largest torque of every cycle against the limit of rare peaks.

    Returns:
        The check [N m].
    """
    largest = op.demand.largest_load
    return held(
        "gear momentary peak torque", "N m", op.safety.peak_torque * largest.value,
        _limit(op, op.drive.gear.momentary_torque, "momentary peak torque"),
        reserve=op.safety.reserve, time=largest.time,
    )  # fmt: skip


def gear_average_torque(op: Operation) -> Check:
    """The average torque as wear sees it against its limit.

    Returns:
        The check [N m].
    """
    gear = op.drive.gear
    exponent = torque_exponent(gear)
    limit = _limit(op, gear.average_torque_limit, "average torque limit")
    if gear.average_torque_limit is None and gear.continuous_torque is not None:
        remark = "the sheet prints no limit of the average torque: the continuous torque holds"
        limit = Limit(gear.continuous_torque, f"continuous torque of {_name(gear)}", remark)
    if limit.value is not None:
        limit = limit._replace(remark=_joined(f"average with exponent {exponent:.3g}", limit.remark))
    required = op.demand.average_torque(exponent)
    return held("gear average torque", "N m", required, limit, reserve=op.safety.reserve)


def gear_mean_input_speed(op: Operation) -> Check:
    """The mean input speed, rests included, against its limit.

    Returns:
        The check [rad/s].
    """
    required = op.safety.speed * abs(op.drive.gear.ratio) * op.demand.mean_speed
    limit = _limit(op, op.drive.gear.average_input_speed_limit, "mean input speed limit")
    return held("gear mean input speed", "rad/s", required, limit, reserve=op.safety.reserve)


def gear_maximum_input_speed(op: Operation) -> Check:
    """The largest input speed against its limit.

    Returns:
        The check [rad/s].
    """
    fastest = op.demand.fastest
    required = op.safety.speed * abs(op.drive.gear.ratio) * fastest.value
    limit = _limit(op, op.drive.gear.max_input_speed, "maximum input speed")
    return held("gear maximum input speed", "rad/s", required, limit, reserve=op.safety.reserve, time=fastest.time)


def gear_life_check(op: Operation) -> Check:
    """The L10 life against the wanted one; only told when the study wants none.

    Returns:
        The check [h]; required is the wanted life, available the computed one.
    """
    gear, demand = op.drive.gear, op.demand
    name = "gear life L10"
    life = gear_life(gear, demand.average_torque(torque_exponent(gear)), abs(gear.ratio) * demand.mean_speed)
    if life is None:
        wanted = None if op.safety.life is None else op.safety.life / HOUR
        return reported(name, "h", wanted, "the sheet has no rated life, torque and speed together")
    source = f"rated life of {_name(gear)}"
    if op.safety.life is None:
        told = Limit(life / HOUR, source, "told, not judged: the study asks no life")
        return held(name, "h", None, told, reserve=op.safety.reserve)
    return held(name, "h", op.safety.life / HOUR, Limit(life / HOUR, source), reserve=op.safety.reserve)


def tilting_moment(op: Operation) -> Check:
    """The moment across the output axis against the output bearing's limit.

    Returns:
        The check [N m].
    """
    load = op.demand.bearing
    limit = op.drive.gear.tilting_moment_limit
    return _bearing(op, "output bearing tilting moment", "N m", load and load.tilting, limit)


def axial_load(op: Operation) -> Check:
    """The force along the output axis against the output bearing's limit.

    Returns:
        The check [N].
    """
    load = op.demand.bearing
    return _bearing(op, "output bearing axial load", "N", load and load.axial, op.drive.gear.axial_load_limit)


def radial_load(op: Operation) -> Check:
    """The force across the output axis against the output bearing's limit.

    Returns:
        The check [N].
    """
    load = op.demand.bearing
    return _bearing(op, "output bearing radial load", "N", load and load.radial, op.drive.gear.radial_load_limit)


GEAR_CHECKS = (
    gear_repeated_peak_torque,
    gear_momentary_torque,
    gear_average_torque,
    gear_maximum_input_speed,
    gear_mean_input_speed,
    gear_life_check,
    tilting_moment,
    axial_load,
    radial_load,
)
"""Every check of the gear, in the order in which they are told; none needs the motor's torque."""


TORQUE_ONLY = (gear_repeated_peak_torque, gear_momentary_torque, gear_average_torque, gear_life_check)
"""Those that can only get worse with a larger load torque, whatever else changes."""


def _bearing(op: Operation, name: str, unit: str, largest: Peak | None, available: float | None) -> Check:
    if largest is None:
        reason = "the joint slides: its guide carries the loads across"
        if op.demand.cycle.torque is not None:
            reason = "without an arm the loads across the axis are unknown"
        elif op.task.coupled:
            reason = "the gear turns a shaft away from the joint: what loads its bearing is not known"
        return reported(name, unit, None, reason)
    required = op.safety.peak_torque * largest.value
    limit = _limit(op, available, f"{name} limit")
    return held(name, unit, required, limit, reserve=op.safety.reserve, time=largest.time)


def _limit(op: Operation, value: float | None, what: str) -> Limit:
    """A number of the gear's sheet as a limit."""
    lack = f"the sheet prints no {what}" if value is None else ""
    return Limit(value, f"{what} of {_name(op.drive.gear)}", lack)


def _name(gear: Gear) -> str:
    return f"gear {gear.key}" + (f" ({gear.source})" if gear.source else "")


def _joined(*remarks: str) -> str:
    return "; ".join(remark for remark in remarks if remark)
