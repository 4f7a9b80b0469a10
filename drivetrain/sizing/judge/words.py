"""Where the limit of a check comes from, and what a reader should know: source and remark, in words."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from drivetrain.drive.amplifier import Amplifier
from drivetrain.drive.brake import Brake
from drivetrain.drive.gear import Gear, torque_exponent
from drivetrain.drive.heat import rms_rule_validity
from drivetrain.drive.motor import Motor
from drivetrain.motion.duty_cycle import sample_weights
from drivetrain.records import known
from drivetrain.sizing.judge.cases import rests_on_gear

STANDS = "the joint never moves: one phase may carry the amplitude, sqrt(2) times its RMS"
NO_SHORT_TIME = "a short-time limit is not in the catalogue row"


class Words(NamedTuple):
    """What is told beside the numbers of a check.

    Attributes:
        source: Where the limit comes from.
        remark: What a reader should know, or what is missing.
        silent: Whether no limit is told, as what is required cannot be made.
    """

    source: str
    remark: str = ""
    silent: bool = False


def printed(op: Any, row: Any) -> Words:
    """Of a limit that stands on a sheet or in the study."""
    part = row.limit.partition(".")[0]
    lacks = not known(op.number(row.limit))
    if part == "amplifier":
        own = op.task.amplifier
        if own.key:
            return Words(
                f"{row.sheet} of {sheet_name(own)}", f"{row.sheet} is not in the catalogue row" if lacks else ""
            )
        lack = f"the study states no amplifier {row.sheet}" if lacks else ""
        return Words(f"amplifier {row.sheet} of the study", lack)
    return Words(
        f"{row.sheet} of {sheet_name(getattr(op.drive, part))}",
        f"{row.sheet} is not in the catalogue row" if lacks else "",
    )


def overload(op: Any, row: Any) -> Words:
    """By which of the two models."""
    own = op.task.amplifier
    model = "peak current and peak time" if own.thermal_time_constant is None else "thermal time constant"
    return Words(f"{model} of {sheet_name(own) if own.key else 'the study'}")


def lowest_supply(op: Any, row: Any) -> Words:
    """The amplifier asks, the supply gives."""
    lack = "" if known(op.number(row.required)) else "lowest supply voltage is not in the catalogue row"
    return Words("supply of the study", lack)


def repeated_peak(op: Any, row: Any) -> Words:
    """The continuous torque holds where no repeated peak is printed."""
    gear = op.drive.gear
    if gear.repeated_peak_torque is None and gear.continuous_torque is not None:
        remark = "repeated peak torque is not in the catalogue row: the continuous one holds"
        return Words(f"continuous torque of {sheet_name(gear)}", remark)
    lack = "" if gear.repeated_peak_torque is not None else "repeated peak torque is not in the catalogue row"
    return Words(f"repeated peak torque of {sheet_name(gear)}", lack)


def average_torque(op: Any, row: Any) -> Words:
    """The same of the average, with the exponent by which it is made."""
    gear = op.drive.gear
    source, remark = f"average torque limit of {sheet_name(gear)}", f"average with exponent {torque_exponent(gear):.3g}"
    if not op.demand.moves:
        remark = "the joint never moves: the largest torque that it holds"
    if gear.average_torque_limit is not None:
        return Words(source, remark)
    if gear.continuous_torque is None:
        return Words(source, "average torque limit is not in the catalogue row")
    lack = "average torque limit is not in the catalogue row: the continuous torque holds"
    return Words(f"continuous torque of {sheet_name(gear)}", f"{remark}; {lack}")


def gear_life(op: Any, row: Any) -> Words:
    """Only told when the study wants none."""
    if not known(op.number(row.limit)):
        return Words("", "rated life, torque and speed are not in the catalogue row together")
    remark = "told, not judged: the study asks no life" if op.safety.life is None else ""
    return Words(f"rated life of {sheet_name(op.drive.gear)}", remark)


def bearing(op: Any, row: Any) -> Words:
    """Only where the loads across the axis are known."""
    elsewhere = _carried_elsewhere(op)
    if elsewhere is not None:
        return elsewhere
    said = printed(op, row)
    hint = "; if the joint has a bearing of its own, state output_bearing: external"
    return said._replace(remark=said.remark + hint) if said.remark else said


def tilting(op: Any, row: Any) -> Words:
    """The moment is about the bearing's centre, where the sheet says where that is."""
    said, gear = bearing(op, row), op.drive.gear
    if said.silent or said.remark or gear.bearing_offset is not None:
        return said
    if gear.bearing_pitch_diameter is not None:
        return said._replace(remark="bearing offset is not in the catalogue row")
    return said._replace(remark="the bearing's centre is not in the catalogue row: the moment about the joint's point")


def bearing_rating(op: Any, row: Any) -> Words:
    """Of the rollers; few makers of planetary gears print it."""
    said = _carried_elsewhere(op) or printed(op, row)
    return said if said.remark else said._replace(remark=_bearing_lack(op))


def bearing_life(op: Any, row: Any) -> Words:
    """Only told when the study wants none."""
    elsewhere, gear, lack = _carried_elsewhere(op), op.drive.gear, _bearing_lack(op)
    if elsewhere is not None:
        return elsewhere
    if gear.bearing_dynamic_rating is None:
        lack = "dynamic rating of the output bearing is not in the catalogue row"
    if lack:
        return Words("", lack)
    rating = f"dynamic rating {gear.bearing_dynamic_rating:g} N of {sheet_name(gear)}"
    remark = "told, not judged: the study asks no life" if op.safety.life is None else ""
    return Words(f"{rating}, load factor {op.safety.bearing_load_factor:g}", remark)


def _bearing_lack(op: Any) -> str:
    """What of the bearing's shape is unknown, in words."""
    gear = op.drive.gear
    lacks = [
        name
        for name, value in (("pitch diameter", gear.bearing_pitch_diameter), ("offset", gear.bearing_offset))
        if value is None
    ]
    return f"bearing {' and '.join(lacks)} not in the catalogue row" if lacks else ""


def _carried_elsewhere(op: Any) -> Words | None:
    """Why the gear's output bearing is not asked; None where it is."""
    if rests_on_gear(op.task, op.demand):
        return None
    if op.task.output_bearing == "external":
        return Words("", "the joint has a bearing of its own, as the study states", silent=True)
    reason = "the joint slides: its guide carries the loads across"
    if op.demand.cycle.torque is not None:
        reason = "without an arm the loads across the axis are unknown"
    elif op.task.coupled:
        reason = "the gear turns a shaft away from the joint: what loads its bearing is not known"
    return Words("", reason, silent=True)


def stiffness(op: Any, row: Any) -> Words:
    """Of the gear as soft as it may be built."""
    wish, gear = op.study.stiffness, op.drive.gear
    if gear.stiffness_1 is None:
        return Words("", "stiffness_1 is not in the catalogue row")
    source = f"K1 of {sheet_name(gear)}, {gear.stiffness_1:g} N m/rad less {100 * wish.scatter:g} %"
    return Words(source, f"for the wished {wish.first_resonance:g} Hz")


def brake(op: Any, row: Any) -> Words:
    """Of the brake beside the motor, and what its torque is held against."""
    own = op.drive.motor.brake
    lack = "" if known(op.number(row.limit)) else f"{row.sheet} is not in the catalogue row"
    given = op.demand.cycle.torque is not None and op.demand.load_inertia is None
    table = "without load_inertia the whole torque of the table counts as static" if given else ""
    return Words(f"{row.sheet} of {sheet_name(own)}", "; ".join(filter(None, (lack, table))))


def inertia_ratio(op: Any, row: Any) -> Words:
    """The span over the motion; judged only where the study sets a limit."""
    inertia = op.demand.load_inertia
    if inertia is None:
        return Words("", "neither an arm nor the joint's load_inertia tells it", silent=True)
    if op.drive.motor.rotor_inertia is None:
        return Words("", "rotor inertia is not in the catalogue row", silent=True)
    largest = op.number(row.required)
    least = largest * float(inertia.min()) / float(np.abs(inertia).max())
    span = f"{least:.3g} to {largest:.3g} over the motion"
    return (
        Words("", f"{span}; told, not judged") if op.safety.inertia_ratio is None else Words("the study's limit", span)
    )


def short_time(op: Any, row: Any) -> Words:
    """Printed peak torque, else what the printed peak current makes, else what nominal voltage makes at stall."""
    motor = op.drive.motor
    if motor.peak_torque is not None:
        return Words(f"peak torque of {sheet_name(motor)}")
    if motor.peak_current is not None:
        return Words(f"torque constant x peak current of {sheet_name(motor)}")
    if not known(op.number(row.limit)):
        return Words("", f"{NO_SHORT_TIME} and no nominal voltage")
    remark = f"{NO_SHORT_TIME}: the stall torque at nominal voltage holds, heat and voltage are judged apart"
    return Words(f"stall torque of {sheet_name(motor)}", remark)


def cold_torque(op: Any, row: Any) -> Words:
    """As of the warm motor, and how cold."""
    said = short_time(op, row)
    return said._replace(remark="; ".join(text for text in (_cold(op), said.remark) if text))


def cold_current(op: Any, row: Any) -> Words:
    """Of motor and amplifier the smaller one."""
    motor, amplifier = op.drive.motor, op.task.amplifier.peak_current
    limits = {
        f"peak current of {sheet_name(motor)}": motor.peak_current,
        "amplifier peak current of the study": amplifier,
    }
    given = {name: value for name, value in limits.items() if value is not None}
    if not given:
        return Words("", "neither the motor's row nor the study's amplifier has a peak current")
    return Words(min(given, key=lambda name: given[name]), _cold(op))


def _cold(op: Any) -> str:
    """What is cold; a gear without a law says so."""
    gear, cold = op.drive.gear, op.study.cold_start
    lawless = "" if gear.drag_temperature_1 or op.direct else "; the gear's sheet tells no drag over temperature"
    return f"gear and motor at {cold:g} °C{lawless}"


def voltage(op: Any, row: Any) -> Words:
    """What reaches the terminals."""
    remark = "" if op.drive.motor.inductance is not None else "inductance unknown: its share is left out"
    if op.safety.peak_torque > 1.0:
        held = f"R i and L di/dt also with {op.safety.peak_torque:g} times the torque, the factor on peak torque"
        remark = f"{held}; {remark}" if remark else held
    return Words(f"supply {op.supply.voltage:g} V x modulation {op.task.amplifier.modulation:g}", remark)


def rms_current(op: Any, row: Any) -> Words:
    """The smaller of nominal and thermal limit, and why the RMS rule may mislead here."""
    limit = op.continuous_current
    if limit.value is None:
        return Words(limit.source, limit.source)
    if op.network is None:
        return Words(limit.source, "no thermal data in the catalogue row to tell whether the RMS rule holds")
    if not op.demand.moves:
        return Words(limit.source, STANDS)
    cycle = op.demand.cycle
    said = rms_rule_validity(op.network, op.demand.time, op.current, limit.value, parts=cycle.parts)
    return Words(limit.source, said or _hot_parts(op, limit.value))


def amplifier_lasting(op: Any, row: Any) -> Words:
    """The same of the amplifier."""
    said = printed(op, row)
    return said if said.remark or op.demand.moves else said._replace(remark=STANDS)


def _hot_parts(op: Any, continuous: float) -> str:
    """Which parts of a mix overload the motor if they are run for long."""
    cycle, square = op.demand.cycle, op.current**2
    if len(cycle.parts) == 1:
        return ""
    weights = [sample_weights(cycle.time[part]) for part in cycle.parts]
    means = [square[part] @ each / each.sum() for part, each in zip(cycle.parts, weights, strict=True)]
    hot = [name for name, mean in zip(cycle.part_names, means, strict=True) if mean > continuous**2]
    told = f"RMS of the mix; {', '.join(hot)} run by itself is above the limit: see the winding temperature"
    return told if hot else ""


def winding(op: Any, row: Any) -> Words:
    """The winding's limit less the margin."""
    limit, margin, found = op.drive.motor.max_winding_temperature, op.safety.temperature_margin, op.number(row.required)
    if math.isinf(found):
        source = "" if limit is None else f"winding limit {limit:g} °C of {sheet_name(op.drive.motor)}"
        return Words(source, "thermal runaway: the losses grow faster with temperature than the cooling")
    if limit is None:
        return Words("", "winding limit is not in the catalogue row", silent=True)
    if not known(found):
        return Words("", "thermal resistances for this mounting are not in the catalogue row", silent=True)
    source = f"winding limit {limit:g} °C of {sheet_name(op.drive.motor)}" + (f" less {margin:g} K" if margin else "")
    ripple = op.network is not None and op.network.winding_capacity is not None
    return Words(source, "" if ripple else "mean over the cycle: the winding time constant is unknown")


def sheet_name(part: Motor | Gear | Brake | Amplifier) -> str:
    """A part with the source of its sheet."""
    kind = type(part).__name__.lower()
    return f"{kind} {part.key}" + (f" ({part.source})" if part.source else "")
