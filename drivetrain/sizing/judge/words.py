"""Source and remark of every check, as text: where the limit comes from and what a reader should know."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from drivetrain.drive.amplifier import Amplifier, from_dc, motor_basis
from drivetrain.drive.brake import Brake
from drivetrain.drive.friction import friction_curve
from drivetrain.drive.gear import Gear, drag_factor, mesh_of, onward, stage_load, torque_exponent
from drivetrain.drive.motor import Motor
from drivetrain.drive.stops import (
    braked,
    braking_push,
    jam_torque,
    rotor_energy,
    stiff_spring,
    stop_rotor,
)
from drivetrain.drive.thermal.heat import rms_rule_validity
from drivetrain.motion.duty_cycle import sample_weights
from drivetrain.records import known
from drivetrain.sizing.judge.cases import rests_on_gear, stop_constant, stop_temperature

STANDS = "the joint never moves: one phase may carry the amplitude, sqrt(2) times its RMS"
RESTS = "at rest one phase may carry the amplitude: sqrt(2) times its RMS"
AMPERES = {"dc": "DC", "rms": "rms", "peak": "amplitude"}
UNUSED = "the joint never moves, so its life is not consumed"
NO_SHORT_TIME = "a short-time limit is not in the catalogue row"


class Words(NamedTuple):
    """Source and remark of a check."""

    source: str  # where the limit comes from
    remark: str = ""  # what a reader should know, or which data is missing
    silent: bool = False  # whether no limit is shown because the check does not apply


def printed(op: Any, row: Any) -> Words:
    """Words for a limit from a data sheet or from the study."""
    part = row.limit.partition(".")[0]
    unknown = not known(op.number(row.limit))
    if part == "amplifier":
        own = op.task.amplifier
        as_stated = "" if unknown or row.unit != "A" else _as_direct_current(op, op.number(row.limit))
        if own.key:
            return Words(
                f"{row.sheet} of {sheet_name(own)}{as_stated}",
                f"{row.sheet} is not in the catalogue row" if unknown else "",
            )
        missing = f"the study states no amplifier {row.sheet}" if unknown else ""
        return Words(f"amplifier {row.sheet} of the study{as_stated}", missing)
    return Words(
        f"{row.sheet} of {sheet_name(getattr(op.drive, part))}",
        f"{row.sheet} is not in the catalogue row" if unknown else "",
    )


def _as_direct_current(op: Any, limit: float) -> str:
    """How a limit of sinusoidal phases became one of direct current, as text; empty where both are of one kind."""
    stated = op.task.amplifier.current_basis
    if motor_basis(op.drive.motor.kind, stated) == stated:
        return ""
    return f": {from_dc(limit, stated):.4g} A {AMPERES[stated]} of sinusoidal phases, at equal loss {limit:.4g} A DC"


def stage_torque(op: Any, row: Any) -> Words:
    """Words for the stage behind the gear that limits its torque."""
    return Words(op.drive.gear.stage_words[0] or "the stages of the study", _unsaid(op, row))


def stage_speed(op: Any, row: Any) -> Words:
    """Words for the stage behind the gear that limits its speed."""
    return Words(op.drive.gear.stage_words[1] or "the stages of the study", _unsaid(op, row))


def _unsaid(op: Any, row: Any) -> str:
    return "" if known(op.number(row.limit)) else "no stage states a limit"


def overload(op: Any, row: Any) -> Words:
    """Words for the amplifier's overload, by the overload model that applies."""
    own = op.task.amplifier
    if not known(op.number(row.limit)):
        return Words("", "peak time is not stated")
    model = "peak current and peak time" if own.thermal_time_constant is None else "thermal time constant"
    return Words(f"{model} of {sheet_name(own) if own.key else 'the study'}")


def lowest_supply(op: Any, row: Any) -> Words:
    """Words for the lowest supply voltage that the amplifier requires."""
    missing = "" if known(op.number(row.required)) else "lowest supply voltage is not in the catalogue row"
    return Words("supply of the study", missing)


def repeated_peak(op: Any, row: Any) -> Words:
    """Words for the repeated peak torque; if none is given the continuous torque is the limit."""
    gear = op.drive.gear
    if gear.repeated_peak_torque is None and gear.continuous_torque is not None:
        remark = "repeated peak torque is not in the catalogue row: the continuous torque is the limit"
        return Words(f"continuous torque of {sheet_name(gear)}", remark)
    missing = "" if gear.repeated_peak_torque is not None else "repeated peak torque is not in the catalogue row"
    return Words(f"repeated peak torque of {sheet_name(gear)}", missing)


def momentary(op: Any, row: Any) -> Words:
    """Words for the decisive stop; at the current limit also the current that does not overload the gear and the
    current that holds the load.
    """
    words, case = printed(op, row), op.judgement.case
    suffix, jam_torque = f"; {words.remark}" if words.remark else "", case.figures.jam_torque
    if known(jam_torque) and case.setting.jam == 0.0:
        suffix = (
            f"; if its output is blocked at top speed: {jam_torque:.4g} N m (checked with stop: {{jam: true}}){suffix}"
        )
    if not known(case.figures.stop_torque):
        return words._replace(remark=_no_stop(op) + suffix)
    cycle = f"the cycle by itself needs {case.figures.load_torque:.4g} N m"
    stop = op.demand.stop
    if case.setting.moves == 0.0 and not len(stop.torque):
        return words._replace(remark=f"the joint never moves: there is nothing to stop; {cycle}{suffix}")
    if case.setting.ramped != 0.0:
        taken = np.abs(stop.torque + stage_load(case.gear) * stop.acceleration)
        worst = int(np.argmax(np.maximum(op.demand.stop_torque, taken)))
        begin, speed = op.demand.time[stop.first[worst]], abs(op.demand.speed[stop.first[worst]])
        return words._replace(
            remark=f"stop of all joints on a ramp of {case.setting.stop_ramp:.3g} s: "
            f"{case.figures.stop_torque:.4g} N m, {stop.after[worst]:.3g} s after its start at t = {begin:.4g} s "
            f"from {math.degrees(speed):.3g} deg/s, {_travel(op)}; {cycle}{suffix}"
        )
    return words._replace(remark=f"{_hard_stop(op)}; {cycle}{_safe_current(op)}{suffix}")


def _no_stop(op: Any) -> str:
    """Why no torque of a stop is known."""
    task = op.task
    if task.stop.ramp is None and not known(op.number("setting.stop_current")):
        return "no stop is known: state stop: {ramp: 0.3 s}, stop: {current: ...} or the amplifier's peak_current"
    if op.demand.load_inertia is None:
        return "what a stop needs is not known: the joint's load_inertia is not stated"
    return f"what a stop needs is not known without {op.missing or 'a motion'}"


def _hard_stop(op: Any) -> str:
    """The worst stop at the current limit, as text."""
    case, demand = op.judgement.case, op.demand
    at = int(np.argmax(op.judgement.series.traces.stop))
    mesh, way = mesh_of(case.gear), float(np.sign(op.demand.loss_speed[at]) or 1.0)
    rotor, push, static, inertia = (float(series[at]) for series in _braking(op))
    found = braked(mesh.driving, mesh.driven, rotor, push, static, inertia, way)
    speed = abs(float(demand.speed[at]))
    slowing = -way * found.acceleration
    ends = f"in {1e3 * speed / slowing:.3g} ms" if slowing > 0.0 else "never, as the load is stronger"
    more, taken = float(onward(case.gear)), float(stage_load(case.gear)) * abs(found.acceleration)
    rigid = f"{more * (abs(found.torque) + taken):.4g} N m with a rigid gear"
    if math.isinf(found.torque):
        rigid, ends = "the mesh locks, so that the torque has no bound", "at once"
    peak = more * op.judgement.series.traces.stop[at]
    return (
        f"stop of this joint at {_amperes(op, case.setting.stop_current)} from t = {demand.time[at]:.4g} "
        f"s at {math.degrees(speed):.3g} deg/s: {rigid}, {peak:.4g} N m with the "
        f"oscillation of its spring; with a rigid gear at rest {ends}, {_travel(op)}"
    )


def amperes(amplifier: Amplifier, motor: Motor, current: float) -> str:
    """A DC-equivalent current as text, first in the study's current basis where that differs."""
    basis = motor_basis(motor.kind, amplifier.current_basis)
    text = f"{current:.3g} A (DC)"
    return text if basis == "dc" else f"{from_dc(current, basis):.3g} A {AMPERES[basis]} ({text})"


def _amperes(op: Any, current: float) -> str:
    return amperes(op.task.amplifier, op.drive.motor, current)


def _travel(op: Any) -> str:
    """The longest travel in a stop, as text."""
    travel = math.degrees(op.number("figures.stop_travel"))
    return (
        f"travel at most {travel:.3g} deg"
        if math.isfinite(travel)
        else "from some state of the cycle it does not stop the load"
    )


def _braking(op: Any) -> tuple[Any, Any, Any, Any]:
    """Series of stops at the current limit, at the gear output: rotor inertia [kg m^2], braking torque and static
    torque [N m], inertia of the load [kg m^2], (N,) each.
    """
    case, demand = op.judgement.case, op.demand
    ratio, mesh = float(case.gear.ratio), mesh_of(case.gear)
    inertia = float(case.motor.rotor_inertia) + (op.drive.gear.inertia or 0.0)
    limit = float(stop_constant(case) * case.setting.stop_current)
    shaft, factor = friction_curve(case.shaft), drag_factor(mesh, float(stop_temperature(case)))
    rides = float(case.setting.rides)
    rotor, load = stop_rotor(ratio, inertia, rides)
    load = load + demand.load_inertia
    carrier = demand.carrier_acceleration - rides * demand.acceleration
    push = braking_push(mesh, shaft, factor, inertia, limit, demand.loss_speed, carrier)
    return np.full(len(push), rotor), push, demand.gear_torque - load * demand.acceleration, load


def _safe_current(op: Any) -> str:
    """The largest current limit at which no stop overloads the gear and the current that holds the load, as text."""
    if op.drive.gear.momentary_torque is None:
        return ""
    case, safe = op.judgement.case, op.safe_stop_current
    if safe >= op.number("setting.stop_current"):
        return ""
    _, _, static, _ = _braking(op)
    # without help of the mesh friction
    holding = float(np.abs(static).max()) / abs(float(case.gear.ratio * stop_constant(case)))
    text = "; no stop current keeps the gear within its limit"
    if safe > 0.0:
        text = f"; a stop current up to {_amperes(op, safe)} keeps the gear within its limit"
    text += f", {_amperes(op, holding)} hold the load"
    return (
        text if safe >= holding else f"{text}: no current does both, so let stops follow a ramp (stop: {{ramp: ...}})"
    )


def peaks(op: Any, row: Any) -> Words:
    """Words for the permitted number of momentary peaks."""
    task, permitted = op.task, op.number(row.limit)
    if permitted == math.inf:
        return Words("", "a stop does not exceed the repeated peak torque, so it is not a momentary peak")
    if not known(permitted):
        return Words(
            "", "the number of momentary peaks that this kind of gear permits, or the torque of a stop, is not known"
        )
    travel = math.degrees(op.number("figures.stop_travel"))
    source = "10^4 waves of the flexspline, Harmonic Drive catalogue SHG, p. 30"
    torque, factor = op.number("figures.stop_torque"), op.number("safety.peak_torque")
    return Words(
        source,
        f"a stop takes {torque:.4g} N m x {factor:g} = {factor * torque:.4g}, above the repeated peak torque of "
        f"{op.number('limits.repeated_peak_torque'):.4g}; {task.stop.stops_per_day:g} stops a day, each over at most "
        f"{travel:.3g} deg of travel",
    )


def jam(op: Any, row: Any) -> Words:
    """Words for a jam: the torque with the motor off, beside that with the motor driving on."""
    words, coast = printed(op, row), op.number("figures.coast_torque")
    if not known(coast):
        return words._replace(remark="not known without the gear's stiffness and the rotor's inertia")
    text = f"{coast:.4g} N m with the motor off"
    if not known(op.number(row.required)):
        text += "; with it on not known: no current of a stop is stated"
    text += _safe_jam(op, row)
    return words._replace(remark=f"{text}; {words.remark}" if words.remark else text)


def _safe_jam(op: Any, row: Any) -> str:
    """The current up to which a jam does not overload the gear, as text; empty if the present one does not."""
    from scipy.optimize import brentq

    case, limit = op.judgement.case, op.number(row.limit) / op.number(row.factor)
    if not op.number(row.required) > limit:
        return ""
    if op.number("figures.coast_torque") >= limit:
        return "; no current limit helps: the rotor's energy alone exceeds the limit"
    spring, energy = stiff_spring(case.gear), rotor_energy(case.motor, case.gear, case.setting.fastest)
    per_ampere = abs(float(case.gear.ratio * stop_constant(case)))
    full_current = op.number("setting.stop_current")
    safe = brentq(lambda current: jam_torque(spring, energy, per_ampere * current) - limit, 0.0, full_current)
    return f"; with no more than {_amperes(op, safe)} of the amplifier it bears that"


def stop_current(op: Any, row: Any) -> Words:
    """Words for the stopping current: on a ramp what the stop requires, else what holds the load."""
    reason = "what the ramp needs" if op.number("setting.ramped") != 0.0 else "what holds the load"
    if not known(op.number(row.limit)):
        reason = "neither stop: {current: ...} nor an amplifier peak_current is stated"
    elif not known(op.number(row.required)):
        reason = _no_stop(op)
    return Words("current for a stop: the study's, or the amplifier's peak", reason)


def average_torque(op: Any, row: Any) -> Words:
    """Words for the average torque, with the exponent of the average."""
    gear = op.drive.gear
    source, remark = f"average torque limit of {sheet_name(gear)}", f"average with exponent {torque_exponent(gear):.3g}"
    if not op.demand.moves:
        remark = "the joint never moves: the largest torque that it holds"
    if gear.average_torque_limit is not None:
        return Words(source, remark)
    if gear.continuous_torque is None:
        return Words(source, "average torque limit is not in the catalogue row")
    missing = "average torque limit is not in the catalogue row: the continuous torque is the limit"
    return Words(f"continuous torque of {sheet_name(gear)}", f"{remark}; {missing}")


def gear_life(op: Any, row: Any) -> Words:
    """Words for the gear's life; the check is only informative if the study requires no life."""
    if not op.demand.moves:
        return Words("", UNUSED, silent=True)
    if not known(op.number(row.limit)):
        return Words("", "rated life, torque and speed are not in the catalogue row together")
    remark = "for information: the study requires no life" if op.safety.life is None else ""
    return Words(f"rated life of {sheet_name(op.drive.gear)}", remark)


def bearing(op: Any, row: Any) -> Words:
    """Words for a load of the output bearing, which needs the forces and moments across the axis."""
    elsewhere = _carried_elsewhere(op)
    if elsewhere is not None:
        return elsewhere
    words = printed(op, row)
    hint = "; if the joint has a bearing of its own, state output_bearing: external"
    return words._replace(remark=words.remark + hint) if words.remark else words


def tilting(op: Any, row: Any) -> Words:
    """Words for the tilting moment; it is taken about the bearing's centre where the data sheet gives its offset."""
    words, gear = bearing(op, row), op.drive.gear
    if words.silent or words.remark or gear.bearing_offset is not None:
        return words
    if gear.bearing_pitch_diameter is not None:
        return words._replace(remark="bearing offset is not in the catalogue row")
    return words._replace(remark="the bearing's centre is not in the catalogue row: the moment about the joint's point")


def bearing_rating(op: Any, row: Any) -> Words:
    """Words for the static load of the bearing's rollers; few makers of planetary gears state its limit."""
    words = _carried_elsewhere(op) or printed(op, row)
    return words if words.remark else words._replace(remark=_bearing_lack(op))


def bearing_life(op: Any, row: Any) -> Words:
    """Words for the bearing's life; the check is only informative if the study requires no life."""
    elsewhere, gear, missing = _carried_elsewhere(op), op.drive.gear, _bearing_lack(op)
    if elsewhere is not None:
        return elsewhere
    if not op.demand.moves:
        return Words("", UNUSED, silent=True)
    if gear.bearing_dynamic_rating is None:
        missing = "dynamic rating of the output bearing is not in the catalogue row"
    if missing:
        return Words("", missing)
    rating = f"dynamic rating {gear.bearing_dynamic_rating:g} N of {sheet_name(gear)}"
    remark = "for information: the study requires no life" if op.safety.life is None else ""
    return Words(f"{rating}, load factor {op.safety.bearing_load_factor:g}", remark)


def _bearing_lack(op: Any) -> str:
    """Dimensions of the bearing that are unknown, as text."""
    gear = op.drive.gear
    missing = [
        name
        for name, value in (("pitch diameter", gear.bearing_pitch_diameter), ("offset", gear.bearing_offset))
        if value is None
    ]
    return f"bearing {' and '.join(missing)} not in the catalogue row" if missing else ""


def _carried_elsewhere(op: Any) -> Words | None:
    """Why the gear's output bearing is not checked; None if it is."""
    if rests_on_gear(op.task, op.demand):
        return None
    if op.task.output_bearing == "external":
        return Words("", "the joint has a bearing of its own, as the study states", silent=True)
    reason = "the joint is prismatic: its guide carries the loads across the axis"
    if op.demand.cycle.torque is not None:
        reason = "without an arm the loads across the axis are unknown"
    elif op.task.coupled:
        reason = "the gear turns a shaft away from the joint: the loads of its bearing are not known"
    return Words("", reason, silent=True)


def stiffness(op: Any, row: Any) -> Words:
    """Words for the gear's stiffness, less the manufacturing scatter."""
    wish, gear = op.study.stiffness, op.drive.gear
    if gear.stiffness_1 is None:
        return Words("", "stiffness_1 is not in the catalogue row")
    source = f"K1 of {sheet_name(gear)}, {gear.stiffness_1:g} N m/rad less {100 * wish.scatter:g} %"
    return Words(source, f"for the required {wish.first_resonance:g} Hz")


def brake(op: Any, row: Any) -> Words:
    """Words for a check of the holding brake, with the torque that counts as static."""
    own = op.drive.motor.brake
    missing = "" if known(op.number(row.limit)) else f"{row.sheet} is not in the catalogue row"
    given = op.demand.cycle.torque is not None and op.demand.load_inertia is None
    table = "without load_inertia the whole torque of the table counts as static" if given else ""
    return Words(f"{row.sheet} of {sheet_name(own)}", "; ".join(filter(None, (missing, table))))


def inertia_ratio(op: Any, row: Any) -> Words:
    """Words for the inertia ratio, with its range over the motion; only informative if the study sets no limit."""
    inertia = op.demand.load_inertia
    if inertia is None:
        return Words("", "neither an arm nor the joint's load_inertia is given", silent=True)
    if op.drive.motor.rotor_inertia is None:
        return Words("", "rotor inertia is not in the catalogue row", silent=True)
    largest = op.number(row.required)
    stages = float(stage_load(op.drive.gear))
    least = largest * (float(inertia.min()) + stages) / (float(np.abs(inertia).max()) + stages)
    span = f"{least:.3g} to {largest:.3g} over the motion"
    return (
        Words("", f"{span}; for information") if op.safety.inertia_ratio is None else Words("the study's limit", span)
    )


def short_time(op: Any, row: Any) -> Words:
    """Words for the short-time torque: printed peak torque, else that of the printed peak current, else that at stall
    with nominal voltage.
    """
    motor = op.drive.motor
    if motor.peak_torque is not None:
        return Words(f"peak torque of {sheet_name(motor)}")
    if motor.peak_current is not None:
        return Words(f"torque constant x peak current of {sheet_name(motor)}")
    if not known(op.number(row.limit)):
        return Words("", f"{NO_SHORT_TIME} and no nominal voltage")
    remark = (
        f"{NO_SHORT_TIME}: the stall torque at nominal voltage is the limit; heat and voltage are checked separately"
    )
    return Words(f"stall torque of {sheet_name(motor)}", remark)


def cold_torque(op: Any, row: Any) -> Words:
    """Words for the torque of a cold start, with the temperature."""
    words = short_time(op, row)
    return words._replace(remark="; ".join(text for text in (_cold(op), words.remark) if text))


def cold_current(op: Any, row: Any) -> Words:
    """Words for the peak current: the smaller limit of motor and amplifier."""
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
    """The temperature of a cold start, as text; a gear without drag over temperature is named."""
    gear, cold = op.drive.gear, op.study.cold_start
    lawless = "" if gear.drag_temperature_1 or op.direct else "; no drag over temperature in the gear's catalogue row"
    return f"gear and motor at {cold:g} °C{lawless}"


def voltage(op: Any, row: Any) -> Words:
    """Words for the voltage at the motor terminals."""
    factor = op.safety.peak_torque
    remark = f"R i and L di/dt also with {factor:g} times the torque, the factor on peak torque" if factor > 1.0 else ""
    return Words(f"supply {op.supply.voltage:g} V x modulation {op.task.amplifier.modulation:g}", remark)


def rms_current(op: Any, row: Any) -> Words:
    """Words for the continuous current: the smaller of nominal and thermal limit, and why the RMS rule may fail."""
    limit = op.continuous_current
    if limit.value is None:
        return Words(limit.source, limit.source)
    if op.network is None:
        return Words(limit.source, "no thermal data in the catalogue row to say whether the RMS rule holds")
    if not op.demand.moves:
        return Words(limit.source, STANDS)
    cycle = op.demand.cycle
    words = rms_rule_validity(op.network, op.demand.time, op.current, limit.value, parts=cycle.parts)
    return Words(limit.source, words or _hot_parts(op, limit.value))


def amplifier_continuous(op: Any, row: Any) -> Words:
    """Words for the amplifier's continuous current."""
    words = printed(op, row)
    return words if words.remark or op.demand.moves else words._replace(remark=STANDS)


def phase_at_rest(op: Any, row: Any) -> Words:
    """Words for a limit at rest, of winding or amplifier, where one phase may carry more than its share."""
    words = winding(op, row) if row.unit == "C" else printed(op, row)
    return words if words.remark else words._replace(remark=RESTS)


def _hot_parts(op: Any, continuous: float) -> str:
    """Parts of a mix that overload the motor when repeated for long, as text."""
    cycle, square = op.demand.cycle, op.current**2
    if len(cycle.parts) == 1:
        return ""
    weights = [sample_weights(cycle.time[part]) for part in cycle.parts]
    means = [square[part] @ each / each.sum() for part, each in zip(cycle.parts, weights, strict=True)]
    hot = [name for name, mean in zip(cycle.part_names, means, strict=True) if mean > continuous**2]
    text = f"RMS of the mix; {', '.join(hot)} run by itself is above the limit: see the winding temperature"
    return text if hot else ""


def winding(op: Any, row: Any) -> Words:
    """Words for the winding temperature: the winding's limit less the margin of the study."""
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


def gear_temperature(op: Any, row: Any) -> Words:
    """Words for the gear's temperature: that of the housing shared with the motor, or the one that the study states."""
    words, found = printed(op, row), op.number(row.required)
    if op.study.gear_temperature is not None and found == op.study.gear_temperature:
        return words._replace(remark=words.remark or "as the study states it")
    if op.task.gear_heat == 0.0:
        return Words("", "the gear is in another housing than its motor: its temperature is not computed", silent=True)
    if math.isinf(found):
        return words._replace(remark="thermal runaway")
    missing = "" if known(found) else "the motor's thermal resistances are not in the catalogue row"
    return words._replace(remark="; ".join(filter(None, (words.remark, missing))))


def sheet_name(part: Motor | Gear | Brake | Amplifier) -> str:
    """A part with the source of its data sheet."""
    kind = type(part).__name__.lower()
    return f"{kind} {part.key}" + (f" ({part.source})" if part.source else "")
