"""One motor and one gear at one joint as a record: all numbers that a check may refer to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.amplifier import Amplifier, available_voltage, judges_overload, rates_supply, with_peak_time
from drivetrain.drive.drive import Drive, shaft_friction
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import DRAG_REFERENCE, Gear, complete
from drivetrain.drive.motor import Motor, strongest_constant, winding_resistance
from drivetrain.drive.motor_limits import with_allowances
from drivetrain.jit import law
from drivetrain.records import UNKNOWN, as_record, as_records, record_type
from drivetrain.sizing.demand.demand import JointDemand
from drivetrain.study.model import JointTask, Safety, Study


@dataclass(frozen=True)
class Setting:
    """What one joint asks whatever drives it, beside its series.

    Attributes:
        ambient: Air temperature [C].
        volts: That reach the terminals [V].
        mounting: Thermal resistance from housing to ambient that replaces the sheet's [K/W]; NaN: the sheet's.
        fastest, mean_speed: Of the gear's output [rad/s].
        bearing: 1 where the joint rests on its gear's own output bearing, else 0.
        moves: 1 where the joint moves at all, else 0.
        duration: Of the cycle [s].
        stop_current: With which the motor brakes in a stop [A]; NaN: not known.
        stop_ramp: Time in which the speeds fall to 0 in a stop [s]; NaN: as that current allows.
        stop_rise: Time in which that current comes [s].
        rides: 1 where the stator turns with the link that its joint moves, else 0.
        ramped, jam: 1 where stops follow a ramp, and where the gear must bear a jam, else 0.
        stops: In the service life; NaN: not stated.
        counted: 1 where they are stated, else 0.
        gear_temperature: At which the gear's drag is taken, but for its own heat [C].
        settles: 1 where the gear's heat is that of a gear as warm as its housing, 0: of that temperature.
        gear_heat, amplifier_heat: Share of the gear's and of the amplifier's loss that warms the motor's housing.
        cold_start: Of gear and motor when the machine starts cold [C].
        cold: 1 where the study asks for a cold start, else 0.
        brake: 1 where a brake must hold the joint, else 0.
        resonance: Lowest natural frequency that the arm must have [rad/s]; 0: none is wished.
        stiffness_share: Of a gear's printed stiffness that counts.
        supply: Voltage of the supply [V].
        listed: 1 where the amplifier is one of the catalogue, or the study states the supply that it bears, else 0.
        overload: 1 where the amplifier has a continuous current and one above it, else 0.
        whole: 1, all of its overload; NaN where it does not say how long it bears that.
        stated_friction: 1 where the study states the friction of the motor, else 0.
        life, bearing_life: 1 where the study wishes one of a joint that moves, and it rests on its gear, else 0.
        ratio_limit: 1 where the study states a largest inertia ratio, and tells the load's inertia, else 0.
        stands_still: 1 where the joint is at rest for two samples in a row or never moves, else 0.
    """

    ambient: float = 0.0
    volts: float = 0.0
    mounting: float | None = None
    fastest: float = 0.0
    mean_speed: float = 0.0
    bearing: float = 0.0
    moves: float = 0.0
    duration: float = 0.0
    stop_current: float | None = None
    stop_ramp: float | None = None
    stop_rise: float = 0.0
    rides: float = 0.0
    ramped: float = 0.0
    jam: float = 0.0
    stops: float | None = None
    counted: float = 0.0
    gear_temperature: float = DRAG_REFERENCE
    settles: float = 1.0
    gear_heat: float = 1.0
    cold_start: float | None = None
    cold: float = 0.0
    brake: float = 0.0
    resonance: float = 0.0
    stiffness_share: float = 1.0
    supply: float = 0.0
    listed: float = 0.0
    overload: float = 0.0
    whole: float = UNKNOWN
    amplifier_heat: float = 0.0
    stated_friction: float = 0.0
    life: float = 0.0
    bearing_life: float = 0.0
    ratio_limit: float = 0.0
    stands_still: float = 0.0


@dataclass(frozen=True)
class Limits:
    """Limits of the parts where a data sheet can state them in more than one way; NaN if unknown.

    Attributes:
        repeated_peak_torque, average_torque: Of the gear [N m].
        short_time_torque: Of the motor [N m].
        peak_current: The smaller of the motor's and the amplifier's [A].
        continuous_current: Of the motor at this ambient temperature and mounting [A].
        winding_temperature: [C].
        stiffness: Of the gear at small torque, less the manufacturing scatter [N m/rad].
    """

    repeated_peak_torque: float = UNKNOWN
    average_torque: float = UNKNOWN
    short_time_torque: float = UNKNOWN
    peak_current: float = UNKNOWN
    continuous_current: float = UNKNOWN
    winding_temperature: float = UNKNOWN
    stiffness: float = UNKNOWN


@dataclass(frozen=True)
class AssumedLimits:
    """Conservative limits that are used if a data sheet gives none; NaN if none can be derived."""

    # of the gear [N m], [rad/s]
    momentary_torque: float = UNKNOWN
    input_speed: float = UNKNOWN
    mean_input_speed: float = UNKNOWN
    motor_speed: float = UNKNOWN  # [rad/s]
    brake_energy: float = UNKNOWN  # of a stop [J]


@dataclass(frozen=True)
class Allowance:
    """What friction, inductance and heating that the data sheet does not specify may demand in addition; 0 if it
    specifies them.
    """

    # of the motor [N m], [A], [V], [K]
    torque: float = 0.0
    current: float = 0.0
    voltage: float = 0.0
    temperature: float = 0.0
    # in a long hold [A], [K]
    rms_current: float = 0.0
    winding_temperature: float = 0.0
    resistance: float = 0.0  # of a winding whose temperature no sheet tells [ohm]
    stop_torque: float = 0.0  # of the gear in a stop at the current limit [N m]
    overload: float = 0.0  # of the amplifier, share


@dataclass(frozen=True)
class Figures:
    """Computed values of one motor and one gear at one joint; NaN if the data sheets do not suffice."""

    # of the gear, and so of the motor [rad/s]
    input_speed: float = UNKNOWN
    mean_input_speed: float = UNKNOWN
    joint_torque: float = UNKNOWN  # at the joint, friction included, before stages and what grows with load [N m]
    # at the gear's output [N m]; the average of a joint that never moves is the largest that it holds
    load_torque: float = UNKNOWN
    average_load_torque: float = UNKNOWN
    stop_torque: float = UNKNOWN  # largest of the gear in a stop [N m]
    momentary_torque: float = UNKNOWN  # the larger of both largest [N m]
    stop_travel: float = UNKNOWN  # longest way of the gear's output in a stop [rad]
    stop_current: float = UNKNOWN  # largest that a stop asks: on a ramp, else to hold the load [A]
    stop_motor_torque: float = UNKNOWN  # the same as torque [N m]
    permitted_peaks: float = UNKNOWN  # how many such stops the gear bears in its life
    # of the gear where its output is held fast, the motor off and pushing on [N m]
    coast_torque: float = UNKNOWN
    jam_torque: float = UNKNOWN
    gear_life: float = UNKNOWN  # L10 [s]
    # on the output bearing [N m], [N]
    tilting_moment: float = UNKNOWN
    axial_load: float = UNKNOWN
    radial_load: float = UNKNOWN
    bearing_static_load: float = UNKNOWN  # that stands for the largest of each [N]
    bearing_life: float = UNKNOWN  # L10 of the output bearing [s]
    inertia_ratio: float = UNKNOWN  # load over rotor, at its largest
    # of the gear; with less the arm swings slower than wished, whatever its other gears [N m/rad]
    wanted_stiffness: float = UNKNOWN
    motor_torque: float = UNKNOWN  # largest electromagnetic, starting from rest included [N m]
    # of the motor, and as one of its phases may feel it, ``series.phase_ratio`` [N m]
    rms_torque: float = UNKNOWN
    phase_torque: float = UNKNOWN
    # mean of the magnets, largest of the winding [C]
    magnet_temperature: float = UNKNOWN
    winding_temperature: float = UNKNOWN
    phase_temperature: float = UNKNOWN  # largest of the phase that carries most at rest [C]
    # part in which the winding is hottest, and when, from its start [s]
    hottest_part: float = 0.0
    hottest_time: float = UNKNOWN
    heat_converged: float = 1.0  # 1 where magnet and housing temperature could be matched
    # [A]; the second of a joint that never moves that of one phase
    motor_current: float = UNKNOWN
    rms_current: float = UNKNOWN
    phase_current: float = UNKNOWN
    voltage: float = UNKNOWN  # largest at the terminals [V]
    # the same of a cold start [N m], [A], [V]
    cold_torque: float = UNKNOWN
    cold_current: float = UNKNOWN
    cold_voltage: float = UNKNOWN
    gear_loss: float = UNKNOWN  # mean power that the gear makes into heat, as warm as it settles [W]
    housing_temperature: float = UNKNOWN  # mean, or of the one node that a sheet knows [C]
    gear_temperature: float = UNKNOWN  # the same where the gear shares that housing, or the study's [C]
    # electrical, over a cycle [J], [W]
    energy: float = UNKNOWN
    mean_power: float = UNKNOWN
    # at the motor's shaft, that holds the worst position still without help of the mesh [N m]
    holding_torque: float = UNKNOWN
    stopping_energy: float = UNKNOWN  # that the brake turns into heat in a stop from the largest speed [J]
    overload: float = UNKNOWN  # share of what the amplifier bears above its continuous current


@dataclass(frozen=True)
class Case:
    """One motor and one gear at one joint."""

    # sheets with the study's assumptions filled in
    motor: Motor
    gear: Gear
    # friction at the motor's shaft and at the gear's output
    shaft: Friction
    joint: Friction
    # of the joint
    amplifier: Amplifier
    safety: Safety
    setting: Setting
    # filled by the judge
    limits: Limits = Limits()
    figures: Figures = Figures()
    allowance: Allowance = Allowance()
    assumed_limits: AssumedLimits = AssumedLimits()
    direct: float = 0.0  # 1 for a drive without a gear, else 0
    # for checks without an origin or a factor
    zero: float = 0.0
    one: float = 1.0


CASE = record_type(Case)
DAY = 86400.0  # s
NOBODY = Drive(Motor("", 1.0, 1.0), Gear("", 1.0, kind="ideal", efficiency=1.0))  # weighs nothing and turns nothing


def setting_of(study: Study, task: JointTask, demand: JointDemand) -> Setting:
    """The parameters of a joint's task."""
    duration, stop, on_gear = float(demand.weights.sum()), task.stop, rests_on_gear(task, demand)
    life, stops = study.safety.life is not None and demand.moves, None
    if stop.stops_per_day is not None and stop.service_life is not None:
        stops = stop.stops_per_day * stop.service_life / DAY
    overload, whole = overload_limits(task.amplifier)
    return Setting(
        ambient=study.ambient,
        volts=available_voltage(task.amplifier, study.supply.voltage),
        mounting=task.housing_to_ambient,
        fastest=demand.fastest.value,
        mean_speed=demand.mean_speed,
        bearing=float(on_gear),
        moves=float(demand.moves),
        duration=duration if duration > 0.0 else 1.0,
        stop_current=stop_current(stop.current, task.amplifier),
        stop_ramp=stop.ramp,
        stop_rise=stop.rise,
        rides=float(study.arm is not None and rides(task)),
        ramped=float(stop.ramp is not None),
        jam=float(stop.jam),
        stops=stops,
        counted=float(stops is not None),
        gear_temperature=float(study.drag_temperature(study.ambient)),
        settles=float(study.gear_temperature is None),
        gear_heat=task.gear_heat,
        cold_start=study.cold_start,
        cold=float(study.cold_start is not None),
        brake=float(bool(task.brakes)),
        resonance=0.0 if task.coupled else 2.0 * math.pi * (study.stiffness.first_resonance or 0.0),
        stiffness_share=1.0 - study.stiffness.scatter,
        supply=study.supply.voltage,
        listed=float(rates_supply(task.amplifier)),
        overload=overload,
        whole=whole,
        amplifier_heat=task.amplifier_heat,
        stated_friction=float(task.motor_friction is not None),
        life=float(life),
        bearing_life=float(life and on_gear),
        ratio_limit=float(study.safety.inertia_ratio is not None and demand.load_inertia is not None),
        stands_still=float(not demand.moves or bool(np.logical_and(demand.at_rest[1:], demand.at_rest[:-1]).any())),
    )


def rides(task: JointTask) -> bool:
    """Whether the stator moves with the link that its joint drives."""
    return task.mount.carrier == "child" and task.travel_per_turn is None and not task.coupled


@law
def stop_temperature(case: Any) -> Any:
    """Gear temperature in a stop [C]: the lowest, because drag then brakes the rotor most."""
    setting = case.setting
    return min(setting.gear_temperature, setting.cold_start) if setting.cold != 0.0 else setting.gear_temperature


@law
def stop_constant(case: Any) -> Any:
    """Torque constant of a motor that stops, or runs into a jam [N m/A]: its magnets are strongest in the cold."""
    setting = case.setting
    coldest = min(setting.ambient, setting.cold_start) if setting.cold != 0.0 else setting.ambient
    return strongest_constant(case.motor, coldest)


def stop_current(stated: float | None, amplifier: Amplifier) -> float | None:
    """Current with which a motor brakes in a stop [A]: the stated one, at most the amplifier's peak; None if
    unknown.
    """
    found = [one for one in (stated, amplifier.peak_current) if one is not None]
    return min(found, default=None)


def overload_limits(amplifier: Amplifier) -> tuple[float, float]:
    """Whether an amplifier's I2t overload is checked, and its limit: 1, or NaN if the duration of the peak current is
    unknown.
    """
    printed = judges_overload(amplifier)
    return float(judges_overload(with_peak_time(amplifier))), 1.0 if printed else UNKNOWN


def put_amplifier(cases: Any, amplifier: Amplifier, task: JointTask) -> None:
    """Put another amplifier into all cases of a joint."""
    setting = cases["setting"]
    cases["amplifier"] = as_record(with_peak_time(amplifier))
    setting["volts"] = available_voltage(amplifier, 1.0) * setting["supply"]
    setting["listed"], (setting["overload"], setting["whole"]) = rates_supply(amplifier), overload_limits(amplifier)
    limit = stop_current(task.stop.current, amplifier)
    setting["stop_current"] = np.nan if limit is None else limit


def rests_on_gear(task: JointTask, demand: JointDemand) -> bool:
    """Whether the gear's output bearing carries the joint, as far as its loads are known."""
    return demand.wrench is not None and task.output_bearing == "gear"


def cases_of(study: Study, joint: int, demand: JointDemand, drives: Sequence[Drive]) -> Any:
    """Cases of drives at one joint, (len(drives),). For many pairs of few parts ``paired`` is faster."""
    motors = motor_records([one.motor for one in drives])
    gears = gear_records([one.gear for one in drives])
    shafts = as_records([shaft_friction(one) for one in drives])
    return paired(study, joint, demand, (motors, shafts), gears, np.tile(np.arange(len(drives)), (2, 1)).T)


def motor_records(motors: Sequence[Motor]) -> Any:
    """Motors as records, with allowances for what their data sheets do not specify."""
    return as_records(list(map(with_allowances, motors)), Motor)


def gear_records(gears: Sequence[Gear]) -> Any:
    """Gears as records, with assumptions filled in, and 1 for direct drives: (records, direct)."""
    direct = np.array([float(one.direct) for one in gears])
    return as_records([complete(one) for one in gears], Gear), direct


def paired(study: Study, joint: int, demand: JointDemand, motors: tuple[Any, Any], gears: Any, pairs: Any) -> Any:
    """Cases of motor-gear pairs at one joint, (P,)."""
    task = study.joints[joint]
    plain = Case(
        NOBODY.motor,
        NOBODY.gear,
        Friction(),
        task.friction,
        with_peak_time(task.amplifier),
        study.safety,
        setting_of(study, task, demand),
    )
    cases = np.repeat(as_records([plain]), len(pairs))
    left, right = pairs[:, 0], pairs[:, 1]
    cases["motor"], cases["shaft"] = motors[0][left], motors[1][left]
    cases["gear"], cases["direct"] = gears[0][right], gears[1][right]
    cases["gear"]["load_friction"] = task.friction.load_share
    return cases


def power_allowance(cases: Any) -> Array:
    """Additional power of evaluated cases that their data sheets do not specify: friction, and copper loss of a warmer
    winding; peak and mean [W], (K, 2).
    """
    every = cases.view(np.recarray)
    motor, allowance, figures = every.motor, every.allowance, every.figures
    warm = np.where(np.isnan(motor.max_winding_temperature), every.setting.ambient, motor.max_winding_temperature)
    ohms, more = winding_resistance(motor, warm), allowance.current
    pairs = (figures.input_speed, figures.motor_current), (figures.mean_input_speed, figures.rms_current)
    return np.stack(
        [
            allowance.torque * speed + ohms * more * (2.0 * now + more) + allowance.resistance * (now + more) ** 2
            for speed, now in pairs
        ],
        axis=1,
    )
