"""One motor-gear pair at one joint as a record. Its fields are all numbers that the table of checks can refer to."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
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
from drivetrain.records import UNKNOWN, as_record, as_records, copied, record_type
from drivetrain.sizing.demand.demand import JointDemand
from drivetrain.study.model import JointTask, Safety, Study


@dataclass(frozen=True)
class Setting:
    """Parameters of a joint's task that do not depend on the drive (the time series are in ``series.JointSeries``)."""

    ambient: float = 0.0  # air temperature [C]
    volts: float = 0.0  # voltage available at the motor terminals [V]
    # thermal resistance from housing to ambient that replaces the data sheet's [K/W]; NaN: the data sheet's is used
    mounting: float | None = None
    # largest and mean speed of the gear's output [rad/s]
    fastest: float = 0.0
    mean_speed: float = 0.0
    bearing: float = 0.0  # 1 where the joint rests on its gear's own output bearing, else 0
    moves: float = 0.0  # 1 where the joint moves during the cycle, else 0
    duration: float = 0.0  # duration of the cycle [s]
    stop_current: float | None = None  # current with which the motor brakes in a stop [A]; NaN if unknown
    # time in which the speeds fall to 0 in a stop [s]; NaN where the stop runs at ``stop_current`` instead
    stop_ramp: float | None = None
    stop_rise: float = 0.0  # rise time of the braking current [s]
    rides: float = 0.0  # 1 where the stator is mounted on the link that its joint moves, else 0
    # 1 where stops follow a ramp, and where a blocked output is checked, else 0
    ramped: float = 0.0
    jam: float = 0.0
    stops: float | None = None  # number of stops in the service life; NaN if not stated
    counted: float = 0.0  # 1 where ``stops`` is stated, else 0
    # temperature at which the gear's drag torque is evaluated [C]; for its heat see ``settles``
    gear_temperature: float = DRAG_REFERENCE
    # 1 where the gear's loss is evaluated at the housing temperature, 0 where it is evaluated at ``gear_temperature``
    settles: float = 1.0
    gear_heat: float = 1.0  # share of the gear's loss that heats the motor's housing
    cold_start: float | None = None  # temperature of gear and motor at a cold start [C]; NaN if none is checked
    cold: float = 0.0  # 1 where the study requires a cold start, else 0
    brake: float = 0.0  # 1 where a brake must hold the joint, else 0
    resonance: float = 0.0  # required lowest natural frequency of the arm [rad/s]; 0 if none is required
    # share of a gear's stiffness on the data sheet that is used, which is 1 minus the manufacturing scatter
    stiffness_share: float = 1.0
    supply: float = 0.0  # voltage of the supply [V]
    # 1 where the amplifier's permitted supply voltage is known, from the catalogue or from the study, else 0
    listed: float = 0.0
    overload: float = 0.0  # 1 where the amplifier has a peak current above its continuous current, else 0
    # limit of the amplifier's overload utilisation: 1, or NaN where the permitted duration of the peak current is
    # unknown
    overload_limit: float = UNKNOWN
    amplifier_heat: float = 0.0  # share of the amplifier's loss that heats the motor's housing
    stated_friction: float = 0.0  # 1 where the study states the motor's friction, else 0
    # 1 where the study requires a service life and the joint moves, else 0; for the bearing the joint must also rest on
    # the gear's output bearing
    life: float = 0.0
    bearing_life: float = 0.0
    ratio_limit: float = 0.0  # 1 where the study limits the inertia ratio and the inertia of the load is known, else 0
    stands_still: float = 0.0  # 1 where the joint is at rest for two consecutive samples or never moves, else 0


@dataclass(frozen=True)
class Limits:
    """Limits of motor, gear and amplifier that a data sheet can state in more than one way; NaN if unknown."""

    # of the gear, at its output [N m]
    repeated_peak_torque: float = UNKNOWN
    average_torque: float = UNKNOWN
    short_time_torque: float = UNKNOWN  # of the motor, at its shaft [N m]
    peak_current: float = UNKNOWN  # smaller one of the motor's and the amplifier's peak current [A]
    # continuous current of the motor at the ambient temperature and mounting of the study [A]
    continuous_current: float = UNKNOWN
    winding_temperature: float = UNKNOWN  # largest permitted winding temperature, less the margin of the study [C]
    stiffness: float = UNKNOWN  # stiffness of the gear at small torque, less the manufacturing scatter [N m/rad]


@dataclass(frozen=True)
class AssumedLimits:
    """Conservative limits that are used where a data sheet gives none; NaN if none can be derived."""

    # Torque at the gear's output [N m], speeds at its input [rad/s].
    momentary_torque: float = UNKNOWN
    input_speed: float = UNKNOWN
    mean_input_speed: float = UNKNOWN
    motor_speed: float = UNKNOWN  # of the rotor [rad/s]
    brake_energy: float = UNKNOWN  # heat that the brake can absorb in one stop [J]


@dataclass(frozen=True)
class Allowance:
    """Upper bounds of what friction, inductance and heating that the data sheet does not specify may require in
    addition; 0 where it specifies them.
    """

    # At the motor: torque [N m], current [A], terminal voltage [V], winding temperature rise [K].
    torque: float = 0.0
    current: float = 0.0
    voltage: float = 0.0
    temperature: float = 0.0
    # Continuous current [A] and winding temperature [K], including a long hold at rest.
    rms_current: float = 0.0
    winding_temperature: float = 0.0
    resistance: float = 0.0  # increase of the winding resistance by the additional temperature rise [ohm]
    stop_torque: float = 0.0  # at the gear's output, in a stop at the current limit [N m]
    overload: float = 0.0  # additional utilisation of the amplifier's overload


@dataclass(frozen=True)
class Figures:
    """Computed values of one motor-gear pair at one joint; NaN if the data sheets do not suffice."""

    # Largest and mean speed at the gear's input, which is the rotor's speed [rad/s].
    input_speed: float = UNKNOWN
    mean_input_speed: float = UNKNOWN
    # largest torque at the joint, its friction included, load-dependent losses and stages excluded [N m]
    joint_torque: float = UNKNOWN
    # At the gear's output: largest torque, and average torque; of a joint that never moves the average is the largest
    # holding torque [N m].
    load_torque: float = UNKNOWN
    average_load_torque: float = UNKNOWN
    stop_torque: float = UNKNOWN  # largest torque at the gear's output in a stop [N m]
    momentary_torque: float = UNKNOWN  # larger one of load_torque and stop_torque [N m]
    stop_travel: float = UNKNOWN  # longest travel of the gear's output in a stop [rad]
    stop_current: float = UNKNOWN  # largest current that a stop requires: on a ramp, or else to hold the load [A]
    stop_motor_torque: float = UNKNOWN  # motor torque of stop_current [N m]
    permitted_peaks: float = UNKNOWN  # permitted number of such stops in the life of the gear
    # Gear torque when the output is blocked at its largest speed: motor off, motor driving on [N m].
    coast_torque: float = UNKNOWN
    jam_torque: float = UNKNOWN
    gear_life: float = UNKNOWN  # L10 life of the gear [s]
    # Largest tilting moment [N m] and forces [N] on the output bearing.
    tilting_moment: float = UNKNOWN
    axial_load: float = UNKNOWN
    radial_load: float = UNKNOWN
    bearing_static_load: float = UNKNOWN  # equivalent static load of the largest moment and forces [N]
    bearing_life: float = UNKNOWN  # L10 life of the output bearing [s]
    inertia_ratio: float = UNKNOWN  # largest inertia of the load over that of the rotor
    # Smallest stiffness of this gear [N m/rad] for which the arm can have the required natural frequency. With less,
    # even rigid gears at all other joints do not suffice.
    required_stiffness: float = UNKNOWN
    motor_torque: float = UNKNOWN  # largest electromagnetic torque, starting from rest included [N m]
    # RMS torque of the motor, and that of its most loaded phase (``series.phase_ratio``) [N m].
    rms_torque: float = UNKNOWN
    phase_torque: float = UNKNOWN
    # Mean temperature of the magnets, largest temperature of the winding [C].
    magnet_temperature: float = UNKNOWN
    winding_temperature: float = UNKNOWN
    phase_temperature: float = UNKNOWN  # largest temperature of the phase that carries most current at rest [C]
    # Part of a mix in which the winding is hottest, and the time since the start of that part [s].
    hottest_part: float = 0.0
    hottest_time: float = UNKNOWN
    heat_converged: float = 1.0  # 1 where magnet and housing temperature could be matched
    # Peak, RMS, and RMS of the most loaded phase [A]. For a joint that never moves, rms_current equals phase_current.
    motor_current: float = UNKNOWN
    rms_current: float = UNKNOWN
    phase_current: float = UNKNOWN
    voltage: float = UNKNOWN  # largest terminal voltage [V]
    # Largest torque [N m], current [A] and terminal voltage [V] of a cold start.
    cold_torque: float = UNKNOWN
    cold_current: float = UNKNOWN
    cold_voltage: float = UNKNOWN
    gear_loss: float = UNKNOWN  # mean loss of the gear at its settled temperature [W]
    housing_temperature: float = UNKNOWN  # mean housing temperature, or that of a single-node thermal network [C]
    # housing temperature where the gear heats that housing, else the one that the study states [C]
    gear_temperature: float = UNKNOWN
    # Electrical energy drawn over a cycle [J] and mean electrical power [W].
    energy: float = UNKNOWN
    mean_power: float = UNKNOWN
    # Torque at the motor's shaft that holds the load in the worst position without help of the mesh friction [N m].
    holding_torque: float = UNKNOWN
    stopping_energy: float = UNKNOWN  # heat in the brake after a stop from the largest speed [J]
    overload: float = UNKNOWN  # utilisation of the amplifier's overload above its continuous current


@dataclass(frozen=True)
class Case:
    """A motor-gear pair at a joint with its task, limits and computed values."""

    # Data sheets with the study's assumptions filled in.
    motor: Motor
    gear: Gear
    # Friction at the motor's shaft and at the gear's output.
    shaft: Friction
    joint: Friction
    # Amplifier of the joint; safety factors and task.
    amplifier: Amplifier
    safety: Safety
    setting: Setting
    # Set by the kernel in ``judge``.
    limits: Limits = Limits()
    figures: Figures = Figures()
    allowance: Allowance = Allowance()
    assumed_limits: AssumedLimits = AssumedLimits()
    direct: float = 0.0  # 1 for a drive without a gear, else 0
    # Constants for checks without an origin or a safety factor.
    zero: float = 0.0
    one: float = 1.0


CASE = record_type(Case)
DAY = 86400.0  # s
# a drive without mass and with negligible inertia
NO_DRIVE = Drive(Motor("", 1.0, 1.0), Gear("", 1.0, kind="ideal", efficiency=1.0))


def setting_of(study: Study, task: JointTask, demand: JointDemand) -> Setting:
    """The parameters of a joint's task that do not depend on the drive."""
    duration, stop, on_gear = float(demand.weights.sum()), task.stop, rests_on_gear(task, demand)
    life, stops = study.safety.life is not None and demand.moves, None
    if stop.stops_per_day is not None and stop.service_life is not None:
        stops = stop.stops_per_day * stop.service_life / DAY
    overload, overload_limit = overload_limits(task.amplifier)
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
        overload_limit=overload_limit,
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
    """Gear temperature in a stop [C]: the lowest of the study, at which drag brakes the rotor most."""
    setting = case.setting
    return min(setting.gear_temperature, setting.cold_start) if setting.cold != 0.0 else setting.gear_temperature


@law
def coldest(setting: Any) -> Any:
    """Lowest temperature of magnets and winding [C]: that of a cold start, if the ambient is warmer."""
    return min(setting.ambient, setting.cold_start) if setting.cold != 0.0 else setting.ambient


@law
def stop_constant(case: Any) -> Any:
    """Torque constant in a stop or jam [N m/A]: the largest, of magnets at the lowest temperature of the study."""
    return strongest_constant(case.motor, coldest(case.setting))


def stop_current(stated: float | None, amplifier: Amplifier) -> float | None:
    """Current with which a motor brakes in a stop [A]: as stated, at most the amplifier's peak; None if unknown."""
    found = [one for one in (stated, amplifier.peak_current) if one is not None]
    return min(found, default=None)


def overload_limits(amplifier: Amplifier) -> tuple[float, float]:
    """Whether an amplifier's I2t overload is checked, and its limit: 1, or NaN if the peak's duration is unknown."""
    printed = judges_overload(amplifier)
    return float(judges_overload(with_peak_time(amplifier))), 1.0 if printed else UNKNOWN


def put_amplifier(cases: Any, amplifier: Amplifier, task: JointTask) -> None:
    """Put another amplifier into all cases of a joint."""
    setting = cases["setting"]
    cases["amplifier"] = as_record(with_peak_time(amplifier))
    setting["volts"] = available_voltage(amplifier, 1.0) * setting["supply"]
    setting["listed"], (setting["overload"], setting["overload_limit"]) = (
        rates_supply(amplifier),
        overload_limits(amplifier),
    )
    limit = stop_current(task.stop.current, amplifier)
    setting["stop_current"] = np.nan if limit is None else limit


def rests_on_gear(task: JointTask, demand: JointDemand) -> bool:
    """Whether the gear's output bearing carries the joint's loads and these are known."""
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
    task, one = study.joints[joint], copied(_blank_case())
    given = (task.friction, with_peak_time(task.amplifier), study.safety, setting_of(study, task, demand))
    for name, values in zip(("joint", "amplifier", "safety", "setting"), given, strict=True):
        one[name] = as_records([values])
    cases = np.repeat(one, len(pairs))
    left, right = pairs[:, 0], pairs[:, 1]
    cases["motor"], cases["shaft"] = motors[0][left], motors[1][left]
    cases["gear"], cases["direct"] = gears[0][right], gears[1][right]
    cases["gear"]["load_friction"] = task.friction.load_share
    return cases


@cache
def _blank_case() -> Any:
    """The record of a case without a task or a drive, (1,)."""
    return as_records([
        Case(NO_DRIVE.motor, NO_DRIVE.gear, Friction(), Friction(), Amplifier(), Safety(), Setting())
    ])  # fmt: skip


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
