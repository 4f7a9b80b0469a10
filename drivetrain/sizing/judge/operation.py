"""One drive at one joint over the repeated cycle: all figures, and the series for plots and current commands."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.drive import Drive, drive_inertia, rotor_torque
from drivetrain.drive.gear import moment_square, onward
from drivetrain.drive.motor import terminal_voltage, torque_constant, winding_resistance
from drivetrain.drive.motor_limits import SourcedValue, continuous_current
from drivetrain.drive.thermal.thermal_network import ThermalNetwork, thermal_network
from drivetrain.records import as_numbers, columns
from drivetrain.sizing.demand.demand import JointDemand, held_samples
from drivetrain.sizing.demand.series import joint_series
from drivetrain.sizing.judge.cases import CASE, cases_of
from drivetrain.sizing.judge.checks import CHECKS, table
from drivetrain.sizing.judge.judge import judge_cases, safe_stop_current, torque_factor
from drivetrain.sizing.judge.missing import torque_lacks
from drivetrain.sizing.results import JointSeries
from drivetrain.study.model import JointTask, Safety, Study, Supply

PLACES = columns(CASE)


@dataclass(frozen=True, eq=False)
class Judgement:
    """The records that the kernel fills."""

    case: Any  # record with figures and limits (``cases.Case``)
    used: dict[str, float]  # utilisation by name of the check; NaN where the check is not made
    power: Array  # electrical power and its lower bound [W], (2, N)
    series: Any  # ``series.JointSeries`` with its traces; None for a drive that was simulated


@dataclass(frozen=True, eq=False)
class Operation:
    """One drive at one joint over the repeated cycle."""

    demand: JointDemand  # requirements of the joint
    drive: Drive  # motor and gear
    study: Study  # the study that the joint belongs to
    joint: int  # index of the joint

    @property
    def task(self) -> JointTask:
        """The task of the joint: amplifier, mounting, mount, stops."""
        return self.study.joints[self.joint]

    @property
    def supply(self) -> Supply:
        """The supply behind the amplifier."""
        return self.study.supply

    @property
    def safety(self) -> Safety:
        """Safety factors and reserves of the study."""
        return self.study.safety

    @property
    def direct(self) -> bool:
        """Whether the drive has no gear."""
        return self.drive.gear.direct

    @cached_property
    def missing(self) -> str:
        """What the data sheets lack to compute the motor torque; empty if nothing."""
        return torque_lacks(self.drive)

    @cached_property
    def judgement(self) -> Judgement:
        """Figures, utilisations and series of the drive. Where data is missing, figures are those of a lossless drive
        without inertia, and the checks that depend on it are not made.
        """
        cases = cases_of(self.study, self.joint, self.demand, [self.drive])
        series = joint_series(self.demand, screening=False)
        used, power = np.zeros((1, len(CHECKS))), np.zeros((1, 2, len(self.demand.time)))
        found, whole = np.zeros(1), np.zeros((2, 1), dtype=np.int64)
        judge_cases(
            cases, as_numbers(cases), table(), series, np.zeros((1, 0)), math.inf, False, power, used, found, *whole
        )
        by_name = dict(zip((check.name for check in CHECKS), used[0].tolist(), strict=True))
        return Judgement(cases[0], by_name, power[0], series)

    def number(self, name: str) -> float:
        """A field of the case, such as ``figures.rms_current``."""
        return float(self._numbers[PLACES[name]])

    @cached_property
    def _numbers(self) -> Array:
        """The fields of the case as a flat row."""
        return np.asarray(as_numbers(self.judgement.case.reshape(1))[0])

    def utilisation(self, row: Any) -> float | None:
        """Utilisation of one check; None if it is not made."""
        used = self.judgement.used[row.name]
        return None if math.isnan(used) else used

    @property
    def figures(self) -> Any:
        """Record of ``cases.Figures``."""
        return self.judgement.case.figures

    @cached_property
    def motor_speed(self) -> Array:
        """Speed of the rotor relative to its stator [rad/s], (N,)."""
        return np.asarray(self.drive.gear.ratio * self.demand.speed)

    @property
    def motor_torque(self) -> Array:
        """Electromagnetic torque [N m], (N,)."""
        return self.judgement.series.traces.torque[1:-1]

    @cached_property
    def peak_torque(self) -> Array:
        """Torque for the peak checks [N m], (N,): includes breakaway at rest, if the joint ever moves."""
        return np.where(self.demand.at_rest, self.judgement.series.traces.starting, np.abs(self.motor_torque))

    @cached_property
    def momentary_torque(self) -> Array:
        """Gear torque for the momentary limit [N m], (N,): the larger one of the cycle's torque and that of a stop
        starting at the sample.
        """
        worst = np.maximum(np.abs(self.demand.loosening_torque), self.judgement.series.traces.stop)
        np.maximum.at(worst, self.demand.stop.first, self.demand.stop_torque)
        return worst

    @property
    def power(self) -> Array:
        """Electrical power without L di/dt [W], (N,)."""
        return self.judgement.power[0]

    @cached_property
    def tilting_moment(self) -> Array | None:
        """Moment about the output bearing's centre, at the more loaded side [N m], (N,); None if unknown."""
        if self.demand.wrench is None:
            return None
        mx, my, _, fx, fy, _ = self.demand.wrench.T
        return np.sqrt(moment_square(self.drive.gear.bearing_offset or 0.0, mx, my, fx, fy))

    @cached_property
    def runaway(self) -> bool:
        """Whether the losses grow faster with temperature than the cooling, so that no steady temperature exists."""
        return self.network is not None and bool(np.isinf(self.judgement.series.traces.losses.housing_at[0]))

    @cached_property
    def constant(self) -> float:
        """Torque constant of the warm motor [N m/A]."""
        return float(torque_constant(self.drive.motor, float(self.figures.magnet_temperature)))

    @cached_property
    def current(self) -> Array:
        """DC-equivalent current [A], (N,)."""
        return np.asarray(self.motor_torque / self.constant)

    @cached_property
    def network(self) -> ThermalNetwork | None:
        """The motor's thermal network in its mounting; None if the data sheet does not suffice."""
        return thermal_network(self.drive.motor, self.study.ambient, housing_to_ambient=self.task.housing_to_ambient)

    @cached_property
    def continuous_current(self) -> SourcedValue:
        """Continuous current of the motor at this ambient temperature and mounting [A]."""
        return continuous_current(self.drive.motor, self.study.ambient, housing_to_ambient=self.task.housing_to_ambient)

    @property
    def winding_temperature(self) -> Array:
        """Winding temperature at which the resistance is evaluated [C], (N,): the computed one, else the winding's
        limit, else the ambient temperature.
        """
        return self.judgement.series.traces.losses.winding_at[: len(self.demand.time)]

    @cached_property
    def voltage(self) -> Array:
        """Terminal voltage of the warm motor [V], (N,)."""
        return self._voltage(float(self.figures.magnet_temperature), self.winding_temperature)

    @cached_property
    def largest_voltage(self) -> Array:
        """Voltage for the supply voltage check [V], (N,): the largest of warm motor, cold motor and start from rest."""
        air, more, magnets = self.study.ambient, torque_factor(self.safety), float(self.figures.magnet_temperature)
        start = winding_resistance(self.drive.motor, self.winding_temperature) * more * self.peak_torque / self.constant
        largest = np.where(self.demand.at_rest, np.abs(start), 0.0)
        for times in (1.0, more):
            warm, cold = self._voltage(magnets, self.winding_temperature, times), self._voltage(air, air, times)
            largest = np.maximum(largest, np.maximum(np.abs(warm), np.abs(cold)))
        return largest

    def _voltage(self, magnets: float, winding: Array | float, more: float = 1.0) -> Array:
        """Terminal voltage [V], (N,), for temperatures of magnets and winding [C]; ``more``: factor on the torque."""
        motion = self.judgement.series.motion
        current = more * self.judgement.series.traces.torque / torque_constant(self.drive.motor, magnets)
        steps = np.diff(current)
        # differences first: this loses no digits where the steps are tiny
        rate = motion.rates[2] * steps[1:] - motion.rates[0] * steps[:-1]
        return terminal_voltage(self.drive.motor, self.motor_speed, current[1:-1], rate, winding, magnets)

    @property
    def safe_stop_current(self) -> float:
        """Largest current limit, up to that of the stop, at which no stop of this joint overloads the gear [A].

        The gear's momentary torque and the stop's current are known.
        """
        case, demand = self.judgement.case, self.demand
        allowed = float(self.drive.gear.momentary_torque or math.nan) / case.safety.peak_torque / onward(case.gear)
        load = (np.array(series, dtype=np.float64) for series in (demand.gear_torque, demand.load_inertia))
        return float(safe_stop_current(np.array([case], CASE), self.judgement.series.motion, *load, float(allowed)))

    def instant(self, series: str) -> float | None:
        """Time at which a series of the drive or its demand is largest in magnitude [s]; None if there is no series."""
        time = self.demand.time
        if series == "winding":
            if self.network is None or self.network.winding_capacity is None:
                return None  # a mean temperature belongs to no instant
            first = self.demand.cycle.parts[int(self.figures.hottest_part)].start
            return float(time[first]) + (float(self.figures.hottest_time) if len(time) > 1 else 0.0)
        if series == "static_torque":
            time = time[held_samples(self.demand.cycle)]
        values = getattr(self, series, None) if hasattr(self, series) else getattr(self.demand, series, None)
        return None if values is None else float(time[int(np.argmax(np.abs(values)))])

    def series(self) -> JointSeries:
        """All series over the cycle, for plots and current commands."""
        demand, drive, losses = self.demand, self.drive, self.judgement.series.traces.losses
        inertia, samples = drive_inertia(drive), len(self.demand.time)
        rotor = rotor_torque(inertia, drive.gear.ratio, demand.acceleration, demand.carrier_acceleration)
        steady = self.network is not None and not self.runaway
        return JointSeries(
            time=demand.time,
            position=demand.position,
            speed=demand.speed,
            acceleration=demand.acceleration,
            gear_torque=demand.load_torque,
            motor_speed=self.motor_speed,
            motor_torque=self.motor_torque,
            rotor_torque=np.asarray(rotor),
            friction_torque=self.motor_torque - rotor - demand.load_torque / drive.gear.ratio,
            current=self.current,
            voltage=self.voltage,
            electrical_power=self.power,
            least_power=self.judgement.power[1],
            winding_temperature=self.winding_temperature if steady else None,
            housing_temperature=losses.housing_at[:samples] if steady else None,
            bearing_load=demand.wrench,
            load_inertia=demand.load_inertia,
        )
