"""The table of checks: what is required of a drive, its limit, and the stage at which both are known.

Utilisations, verdicts, reports, the feasibility test of the search and tolerance sampling all use this table. A name
such as ``figures.rms_current`` is a field of ``cases.Case``. A new check is one more row.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from drivetrain.records import columns
from drivetrain.sizing.judge import words
from drivetrain.sizing.judge.cases import CASE
from drivetrain.study.model import Safety

GEAR, SPEED, TORQUE, HEAT, SUPPLY, ARM, STOP = np.arange(7)
"""Stages, in the order in which they are evaluated. GEAR: needs no motor; SPEED: no torque; TORQUE: no temperature;
HEAT: the rest of one drive. The others need all drives: SUPPLY, the common supply; ARM, the arm's stiffness; STOP, a
stop of all joints at once.

They are numpy integers because numba compiles a kernel again for each plain Python integer."""


@dataclass(frozen=True)
class Requirement:
    """One check: a requirement and its limit.

    Attributes:
        name, unit: Name and unit as displayed to the user.
        required, limit: Fields of the case; if one of them is NaN the check cannot be made. In stage SUPPLY they are a
            sum over all joints (``verdicts.supply_figures``) and a field of the study's supply; in stage ARM a figure
            (``stiffness.FIGURES``) and a field of the study's stiffness requirements; stage STOP is evaluated by
            ``arm_stops``.
        stage: The first stage after which the check can be made.
        sheet: Name of the limit on a data sheet or in the study.
        factor: Field with the safety factor on the required value.
        allowance: Field with what may be required in addition where the data sheet gives no value
            (``cases.Allowance``). A check that is satisfied only without it is NOT CHECKED.
        origin: Field with the zero point of both values, such as the ambient temperature for a temperature rise.
        assumed_limit, assumption: Field with a conservative limit for parts whose data sheet gives none, and its
            description. A requirement above it is NOT CHECKED, not FAIL.
        peak: Whether the required value is a maximum over the samples, so that a subset of samples bounds it from
            below.
        essential: Whether the verdict of a drive is NOT CHECKED if this check cannot be made.
        applies: Field that is 0 where the check does not apply to a drive.
        optional: Whether the check is left out of tables where it does not apply.
        of_gear: Whether the check does not apply to a direct drive; true for all of stage GEAR.
        scale: Factor from SI to the unit.
        instant: Name of the series whose largest magnitude gives the instant (``operation.Operation``); may be empty.
        words: Function that gives source and remark.
        formula: How the required value is computed.
    """

    name: str
    unit: str
    required: str
    limit: str
    stage: Any
    sheet: str = ""
    factor: str = "one"
    allowance: str = "zero"
    assumed_limit: str = ""
    assumption: str = ""
    origin: str = "zero"
    peak: bool = False
    essential: bool = False
    scale: float = 1.0
    instant: str = ""
    applies: str = "one"
    optional: bool = False
    of_gear: bool = False
    words: Callable[[Any, Any], words.Words] = words.printed
    formula: str = ""


RARE = "1.4 times the repeated peak torque, less than in any of 91 gears that print both"
JAM = "G^2 J w^2 / 2 + G kt i phi(T) = U(T); no losses, w the largest speed, gear 30 % stiffer than printed"
MARCHED = (
    "largest T of each gear while all joints stop from any state of the cycle: M q'' + h = tau, P = f T + R for each "
    "drive, with the oscillation of its spring; P: "
)

REQUIREMENTS: tuple[Requirement, ...] = (
    Requirement(
        "gear repeated peak torque", "N m", "figures.load_torque", "limits.repeated_peak_torque", GEAR,
        "repeated peak torque", "safety.peak_torque", peak=True, essential=True, instant="loosening_torque",
        words=words.repeated_peak, formula="largest load torque of all cycles, including breakaway from rest",
    ),
    Requirement(
        "gear momentary peak torque", "N m", "figures.momentary_torque", "gear.momentary_torque", GEAR,
        "momentary peak torque", "safety.peak_torque", peak=True, instant="momentary_torque", words=words.momentary,
        allowance="allowance.stop_torque", assumed_limit="assumed_limits.momentary_torque", assumption=RARE,
        formula="larger of the cycle's peak and of a stop from any state: on a ramp q'' = -q'/t; at a current "
        "T = (G^2 J b - I (G kt i + drag)) / (f I + G^2 J), magnets cold, with the swing of its spring as it begins "
        "and ends, others following the cycle",
    ),
    Requirement(
        "gear momentary peaks", "1", "setting.stops", "figures.permitted_peaks", GEAR,
        "permitted peaks of the flexspline", applies="setting.counted",
        optional=True, words=words.peaks,
        formula="stops per day x service life; limit: N / (2 turns of the input in a stop)",
    ),
    Requirement(
        "gear torque in a jam", "N m", "figures.jam_torque", "gear.momentary_torque", GEAR, "momentary peak torque",
        "safety.peak_torque", assumed_limit="assumed_limits.momentary_torque", assumption=RARE,
        applies="setting.jam", optional=True, words=words.jam, formula=JAM,
    ),
    Requirement(
        "gear ratcheting in a jam", "N m", "figures.jam_torque", "gear.ratcheting_torque", GEAR, "ratcheting torque",
        "safety.peak_torque", applies="setting.jam", optional=True, words=words.jam, formula=JAM,
    ),
    Requirement(
        "gear buckling in a jam", "N m", "figures.jam_torque", "gear.buckling_torque", GEAR, "buckling torque",
        "safety.peak_torque", applies="setting.jam", optional=True, words=words.jam, formula=JAM,
    ),
    Requirement(
        "gear average torque", "N m", "figures.average_load_torque", "limits.average_torque", GEAR,
        "average torque limit", words=words.average_torque,
        formula="(sum |n| |T|^e t / sum |n| t)^(1/e); the largest holding torque for a joint that never moves",
    ),
    Requirement(
        "gear maximum input speed", "rad/s", "figures.input_speed", "gear.max_input_speed", GEAR,
        "maximum input speed", "safety.speed", peak=True, instant="speed", formula="|G| max |w|",
        assumed_limit="assumed_limits.input_speed",
        assumption="3500 rpm, the least that any gear of the shipped catalogue prints",
    ),
    Requirement(
        "gear mean input speed", "rad/s", "figures.mean_input_speed", "gear.average_input_speed_limit", GEAR,
        "mean input speed limit", "safety.speed", peak=True, formula="|G| mean |w|, including rests",
        assumed_limit="assumed_limits.mean_input_speed",
        assumption="0.38 times the maximum input speed, or 2000 rpm: "
        "less than any gear of the shipped catalogue prints",
    ),
    Requirement(
        "gear life L10", "h", "safety.life", "figures.gear_life", GEAR, "life", scale=1.0 / 3600.0,
        words=words.gear_life, essential=True, applies="setting.life",
        formula="L_rated (n_rated / n) (T_rated / T)^e",
    ),
    Requirement(
        "output bearing tilting moment", "N m", "figures.tilting_moment", "gear.tilting_moment_limit", GEAR,
        "output bearing tilting moment limit", "safety.peak_torque", essential=True, applies="setting.bearing",
        instant="tilting_moment", words=words.tilting,
        formula="largest moment perpendicular to the output axis, about the bearing's centre on its worse side",
    ),
    Requirement(
        "output bearing axial load", "N", "figures.axial_load", "gear.axial_load_limit", GEAR,
        "output bearing axial load limit", "safety.peak_torque", essential=True, applies="setting.bearing",
        instant="axial_load", words=words.bearing,
        formula="largest force along the output axis",
    ),
    Requirement(
        "output bearing radial load", "N", "figures.radial_load", "gear.radial_load_limit", GEAR,
        "output bearing radial load limit", "safety.peak_torque", essential=True, applies="setting.bearing",
        instant="radial_load", words=words.bearing,
        formula="largest force perpendicular to the output axis",
    ),
    Requirement(
        "output bearing static load", "N", "figures.bearing_static_load", "gear.bearing_static_rating", GEAR,
        "static rating of the output bearing", "safety.bearing_static_safety", applies="setting.bearing",
        words=words.bearing_rating, formula="P0 = Fr + 2 M/dp + 0.44 Fa with the largest of each; the factor is C0/P0",
    ),
    Requirement(
        "output bearing life L10", "h", "safety.life", "figures.bearing_life", GEAR, "life",
        applies="setting.bearing_life", scale=1.0 / 3600.0, words=words.bearing_life, essential=True,
        formula="10^6 turns (C/(fw P))^(10/3); P: mean over the travel of the larger of Fr + 2 M/dp + 0.45 Fa and "
        "0.67 (Fr + 2 M/dp + Fa)",
    ),
    Requirement(
        "gear stiffness", "N m/rad", "figures.required_stiffness", "limits.stiffness", GEAR, "stiffness",
        essential=True, applies="setting.resonance", optional=True, instant="load_inertia", words=words.stiffness,
        formula="(2 pi f)^2 x (largest load inertia + stages that it carries); for the joint alone, the arm may "
        "require more",
    ),
    Requirement(
        "motor speed", "rad/s", "figures.input_speed", "motor.max_speed", SPEED, "maximum speed", "safety.speed",
        peak=True, instant="speed", formula="|G| max |w|", assumed_limit="assumed_limits.motor_speed",
        assumption="0.92 times the no-load speed, or 5000 rpm: less than any motor of the shipped catalogue prints",
    ),
    Requirement(
        "torque behind the gear", "N m", "figures.joint_torque", "gear.stage_torque", SPEED, "torque of its stages",
        "safety.peak_torque", essential=True, peak=True, instant="loosening_torque", applies="gear.staged",
        optional=True, words=words.stage_torque,
        formula="largest load torque of all cycles at the joint, including breakaway",
    ),
    Requirement(
        "speed behind the gear", "rad/s", "setting.fastest", "gear.stage_speed", SPEED, "speed of its stages",
        "safety.speed", peak=True, instant="speed", applies="gear.staged", optional=True, words=words.stage_speed,
        formula="max |w|",
    ),
    Requirement(
        "holding brake torque", "N m", "figures.holding_torque", "motor.brake.static_torque", SPEED, "static torque",
        "safety.brake", essential=True, applies="setting.brake", optional=True, instant="static_torque",
        words=words.brake,
        formula="largest |T| / |G| needed to hold a position of the cycle, without friction of the mesh",
    ),
    Requirement(
        "holding brake energy", "J", "figures.stopping_energy", "motor.brake.energy_per_stop", SPEED,
        "energy per stop", applies="setting.brake", optional=True, words=words.brake,
        assumed_limit="assumed_limits.brake_energy",
        assumption="26 J a N m of static torque, less than any brake of the shipped catalogue prints",
        formula="J (G w)^2 / 2 x T / (T - T_load); largest speed and inertia, load of the worst position",
    ),
    Requirement(
        "inertia ratio", "1", "figures.inertia_ratio", "safety.inertia_ratio", SPEED,
        "inertia ratio that the study allows", instant="load_inertia", applies="setting.ratio_limit", essential=True,
        words=words.inertia_ratio,
        formula="(largest load inertia + stages) / (G^2 x inertia of rotor, brake and gear input)",
    ),
    Requirement(
        "motor peak torque", "N m", "figures.motor_torque", "limits.short_time_torque", TORQUE, "short-time torque",
        "safety.peak_torque", peak=True, essential=True, instant="peak_torque", words=words.short_time,
        allowance="allowance.torque",
        formula="largest electromagnetic torque, including starts from rest",
    ),
    Requirement(
        "cold start torque", "N m", "figures.cold_torque", "limits.short_time_torque", TORQUE, "short-time torque",
        "safety.peak_torque", peak=True, essential=True, applies="setting.cold", optional=True, words=words.cold_torque,
        allowance="allowance.torque",
        formula="largest electromagnetic torque with the drag of a cold gear, including starts from rest",
    ),
    Requirement(
        "cold start current", "A", "figures.cold_current", "limits.peak_current", TORQUE, "peak current",
        "safety.peak_torque", peak=True, applies="setting.cold", optional=True, words=words.cold_current,
        allowance="allowance.current",
        formula="cold start torque / kt(cold)",
    ),
    Requirement(
        "motor peak current", "A", "figures.motor_current", "motor.peak_current", HEAT, "peak current",
        "safety.peak_torque", instant="peak_torque", allowance="allowance.current",
        formula="largest torque / kt(magnets)",
    ),
    Requirement(
        "amplifier peak current", "A", "figures.motor_current", "amplifier.peak_current", HEAT, "peak current",
        "safety.peak_torque", instant="peak_torque", allowance="allowance.current",
        formula="largest torque / kt(magnets)",
    ),
    Requirement(
        "current to stop", "A", "figures.stop_current", "setting.stop_current", HEAT, "current for a stop",
        "safety.peak_torque", words=words.stop_current, allowance="allowance.current",
        formula="divided by kt(magnets): on a ramp the largest |T / G + J (G a + a_carrier)|, losses counted only "
        "where the motor must still drive; at a current limit the largest |b| / G that holds the load",
    ),
    Requirement(
        "motor voltage", "V", "figures.voltage", "setting.volts", HEAT, "voltage at the motor", "safety.voltage",
        essential=True,
        instant="largest_voltage", words=words.voltage,
        allowance="allowance.voltage",
        formula="largest of |kt G w + R i + L di/dt|, warm and cold, and of R i to start from rest; with i as it is "
        "and times the factor on peak torque",
    ),
    Requirement(
        "cold start voltage", "V", "figures.cold_voltage", "setting.volts", HEAT, "voltage at the motor",
        "safety.voltage", essential=True,
        applies="setting.cold", optional=True, words=words.voltage,
        allowance="allowance.voltage",
        formula="largest of |kt G w + R i + L di/dt| and of R i to start from rest, everything cold",
    ),
    Requirement(
        "motor RMS current", "A", "figures.rms_current", "limits.continuous_current", HEAT, "continuous current",
        "safety.rms",
        essential=True, words=words.rms_current,
        allowance="allowance.rms_current",
        formula="RMS torque / kt(magnets); times sqrt(2) where the joint never moves",
    ),
    Requirement(
        "winding temperature", "C", "figures.winding_temperature", "limits.winding_temperature", HEAT,
        "highest winding temperature",
        origin="setting.ambient", instant="winding", words=words.winding,
        allowance="allowance.winding_temperature",
        formula="hottest winding in the periodic steady state; utilisation is that of the rise over ambient",
    ),
    Requirement(
        "phase temperature at rest", "C", "figures.phase_temperature", "limits.winding_temperature", HEAT,
        "highest winding temperature", origin="setting.ambient", applies="setting.stands_still", optional=True,
        words=words.phase_at_rest, allowance="allowance.winding_temperature",
        formula="winding temperature of the phase that may carry the amplitude at rest, twice its share of the loss",
    ),
    Requirement(
        "gear temperature", "C", "figures.gear_temperature", "gear.max_temperature", HEAT,
        "maximum housing temperature", origin="setting.ambient", of_gear=True, words=words.gear_temperature,
        allowance="allowance.temperature",
        formula="mean temperature of the housing of gear and motor; utilisation is that of the rise over ambient",
    ),
    Requirement(
        "amplifier continuous current", "A", "figures.rms_current", "amplifier.continuous_current", HEAT,
        "continuous current", "safety.rms", words=words.amplifier_continuous,
        allowance="allowance.current",
        formula="RMS torque / kt(magnets); times sqrt(2) where the joint never moves",
    ),
    Requirement(
        "amplifier phase current at rest", "A", "figures.phase_current", "amplifier.continuous_current", HEAT,
        "continuous current", "safety.rms", applies="setting.stands_still", optional=True, words=words.phase_at_rest,
        allowance="allowance.current", formula="RMS torque / kt(magnets), times sqrt(2) at rest",
    ),
    Requirement(
        "amplifier overload (I2t)", "1", "figures.overload", "setting.overload_limit", HEAT, "overload capacity",
        applies="setting.overload", optional=True, assumed_limit="one",
        assumption="1 s at the peak current, as with 3.5 s of time constant at twice the continuous one",
        words=words.overload, allowance="allowance.overload",
        formula="largest value in the periodic steady state of (integral of I^2 - I_c^2) / ((I_p^2 - I_c^2) t_p), or "
        "of the first-order mean of I^2/I_c^2; I: current x safety.rms",
    ),
    Requirement(
        "amplifier highest supply", "V", "setting.supply", "amplifier.max_voltage", SPEED, "highest supply voltage",
        applies="setting.listed", optional=True, formula="voltage of the supply",
    ),
    Requirement(
        "amplifier lowest supply", "V", "amplifier.min_voltage", "setting.supply", SPEED, "supply voltage",
        applies="setting.listed",
        optional=True, words=words.lowest_supply, formula="lowest supply voltage of the amplifier",
    ),
    Requirement(
        "supply peak power", "W", "peak_power", "peak_power", SUPPLY, "peak power", instant="power",
        formula="largest sum of all joints' electrical power, including standby and switching losses of amplifiers "
        "where stated",
    ),
    Requirement(
        "supply mean power", "W", "mean_power", "mean_power", SUPPLY, "mean power",
        formula="mean over the cycle of the electrical power of all joints, negative values counted as 0",
    ),
    Requirement(
        "supply regenerated power", "W", "regenerated_power", "regenerated_power", SUPPLY, "regenerated power",
        formula="mean over the cycle of the negative part of the electrical power of all joints",
    ),
    Requirement(
        "supply peak braking power", "W", "braking_power", "braking_power", SUPPLY, "braking power", instant="braking",
        formula="largest power that all joints feed back at an instant; gears, shafts and amplifiers without losses, "
        "windings as cold as the ambient or the cold start",
    ),
    Requirement(
        "supply bus voltage", "V", "bus_voltage", "max_voltage", SUPPLY, "highest bus voltage", instant="bus",
        formula="sqrt(V^2 + 2 E/C); E: energy fed back since the bus was last at V, as for the peak braking power, "
        "minus that dissipated in the resistor",
    ),
    Requirement(
        "arm tip deviation", "m", "deviation", "tip_deviation", ARM, "tip deviation", essential=True,
        formula="largest |sum J phi(T)| over the cycle: displacement of the tip by the gears' wind-up, K1 to K3 minus "
        "their tolerance",
    ),
    Requirement(
        "arm lost motion", "m", "play", "lost_motion", ARM, "lost motion", essential=True,
        formula="largest |sum +-J b| over the cycle and all signs; b: total backlash of each gear",
    ),
    Requirement(
        "arm first resonance", "Hz", "resonance", "first_resonance", ARM, "first resonance", essential=True,
        formula="lowest root of det(K - w^2 M) over the cycle; M: mass matrix with rotors locked by their motors and "
        "carried along; K: K1 of each gear minus its tolerance",
    ),
    Requirement(
        "arm stop at full current", "N m", "torque", "gear.momentary_torque", STOP, "momentary peak torque",
        "safety.peak_torque", formula=f"{MARCHED}G kt i + drag",
    ),
    Requirement(
        "arm power failure", "N m", "torque", "gear.momentary_torque", STOP, "momentary peak torque",
        "safety.peak_torque", formula=f"{MARCHED}drag, plus the brake's static torque after its engage time",
    ),
    Requirement(
        "arm power failure heat", "J", "energy", "motor.brake.energy_per_stop", STOP, "energy per stop of the brake",
        formula="integral of brake torque x motor speed in such stops; gears and shafts without losses",
    ),
)  # fmt: skip
"""In the order in which they are shown."""

CHECKS = tuple(row for row in REQUIREMENTS if row.stage < SUPPLY)
SUPPLY_CHECKS = tuple(row for row in REQUIREMENTS if row.stage == SUPPLY)
ARM_CHECKS = tuple(row for row in REQUIREMENTS if row.stage == ARM)
STOP_CHECKS = tuple(row for row in REQUIREMENTS if row.stage == STOP)


def factors(safety: Safety) -> dict[str, float]:
    """The safety factor of each check of a drive, by name of the check."""
    return {
        row.name: 1.0 if row.factor == "one" else getattr(safety, row.factor.removeprefix("safety.")) for row in CHECKS
    }


def table(checks: tuple[Requirement, ...] | None = None) -> Any:
    """The checks as records for compiled code: named fields become positions among the floats of a case, (checks,)."""
    return _table(CHECKS if checks is None else checks)


@cache
def _table(checks: tuple[Requirement, ...]) -> Any:
    place = columns(CASE)
    names = (
        "required", "factor", "allowance", "limit", "assumed_limit", "origin", "stage", "rise", "geared", "peak",
        "essential", "applies", "figured",
    )  # fmt: skip
    rows = [
        (place[one.required], place[one.factor], place[one.allowance], place[one.limit],
         place[one.assumed_limit or one.limit], place[one.origin], one.stage, one.origin != "zero",
         one.of_gear or one.stage == GEAR, one.peak, one.essential, place[one.applies],
         one.limit.startswith("figures."))
        for one in checks
    ]  # fmt: skip
    return np.array(rows, dtype=np.dtype((np.record, [(name, np.int64) for name in names])))
