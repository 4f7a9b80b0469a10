"""One drive doing one joint's work: torque, current, heat and voltage over the cycle, computed when first asked for."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.drive import Drive, MotorTorque, PowerBalance, motor_torque, power_balance, shaft_friction
from drivetrain.drive.friction import friction_torque
from drivetrain.drive.heat import PeriodicTemperature, periodic_temperature, thermal_network
from drivetrain.drive.mixed_heat import Use, mixed_temperature
from drivetrain.drive.motor import terminal_voltage, torque_constant, winding_resistance
from drivetrain.drive.motor_limits import SourcedValue, continuous_current
from drivetrain.sizing.demand.demand import JointDemand
from drivetrain.sizing.results import JointSeries
from drivetrain.study.model import JointTask, Safety, Study, Supply


@dataclass(frozen=True, eq=False)
class Operation:
    """One drive doing one joint's work over the repeated cycle.

    Attributes:
        demand: What the joint asks.
        drive: What answers.
        task: Of the joint: amplifier, mounting, mount.
        supply: Behind the amplifier.
        ambient: Air temperature [C].
        safety: Factors and reserves.
    """

    demand: JointDemand
    drive: Drive
    task: JointTask
    supply: Supply
    ambient: float
    safety: Safety

    @cached_property
    def missing(self) -> str:
        """What the sheets lack to compute the motor's torque, in words; empty when nothing does."""
        lacks = []
        if self.drive.motor.rotor_inertia is None:
            lacks.append("the motor's rotor inertia")
        if self.drive.gear.efficiency is None and self.drive.gear.kind != "ideal":
            lacks.append("the gear's efficiency")
        if self.drive.gear.inertia is None and self.drive.gear.kind != "ideal":
            lacks.append("the gear's input inertia")
        return " and ".join(lacks)

    @cached_property
    def computed(self) -> Drive:
        """The drive with which the figures are computed: lossless where the efficiency is unknown (not judged)."""
        gear = self.drive.gear
        if gear.efficiency is not None or gear.kind == "ideal":
            return self.drive
        return replace(self.drive, gear=replace(gear, efficiency=1.0, backdriving_efficiency=1.0))

    @cached_property
    def motor_speed(self) -> Array:
        """Of the rotor against its stator [rad/s], (N,)."""
        return np.asarray(self.drive.gear.ratio * self.demand.speed)

    @cached_property
    def torque(self) -> MotorTorque:
        """Electromagnetic torque and its parts [N m]."""
        demand = self.demand
        return motor_torque(
            self.computed, demand.gear_torque, demand.speed, demand.acceleration, demand.carrier_acceleration,
            standstill=demand.at_rest, parts=demand.cycle.parts,
        )  # fmt: skip

    @cached_property
    def peak_torque(self) -> Array:
        """Torque to be held against peak limits [N m], (N,): with what it takes to start, if the joint ever starts."""
        return self.torque.starting if self.demand.moves else self.torque.total

    @cached_property
    def heat(self) -> PeriodicTemperature | None:
        """Temperatures and current of the repeated cycle; None when the sheet does not say enough."""
        motor = self.drive.motor
        network = thermal_network(motor, self.ambient, housing_to_ambient=self.task.housing_to_ambient)
        if network is None:
            return None
        loss = friction_torque(shaft_friction(self.drive), self.motor_speed) * self.motor_speed
        time, torque, cycle = self.demand.time, self.torque.total, self.demand.cycle
        if len(cycle.parts) == 1:
            return periodic_temperature(network, motor, time, torque, housing_loss=loss)
        return mixed_temperature(network, motor, time, torque, Use(cycle.parts, cycle.shares), housing_loss=loss)

    @cached_property
    def magnet_temperature(self) -> float:
        """That the torque constant is taken at [C]: mean housing temperature, else ambient."""
        known = self.heat is not None and not self.heat.runaway
        return self.heat.magnet_temperature if self.heat is not None and known else self.ambient

    @cached_property
    def winding_temperature(self) -> Array | float:
        """That the resistance is taken at [C]: computed, else the winding's limit, else ambient."""
        if self.heat is not None and not self.heat.runaway:
            return self.heat.winding
        limit = self.drive.motor.max_winding_temperature
        return self.ambient if limit is None else limit

    @cached_property
    def constant(self) -> float:
        """Torque constant of the warm motor [N m/A]."""
        return float(torque_constant(self.drive.motor, self.magnet_temperature))

    @cached_property
    def current(self) -> Array:
        """DC equivalent [A], (N,)."""
        return np.asarray(self.torque.total / self.constant)

    @cached_property
    def peak_current(self) -> Array:
        """Current of ``peak_torque`` [A], (N,)."""
        return np.asarray(self.peak_torque / self.constant)

    @cached_property
    def rms_current(self) -> float:
        """Over the cycle [A]."""
        return float(np.sqrt(self.demand.mean(self.current**2)))

    @cached_property
    def continuous_current(self) -> SourcedValue:
        """What the motor can carry for ever in this air and mounting [A]."""
        return continuous_current(self.drive.motor, self.ambient, housing_to_ambient=self.task.housing_to_ambient)

    @cached_property
    def voltage(self) -> Array:
        """At the terminals of the warm motor [V], (N,)."""
        rate = current_rate(self.demand, self.current)
        return terminal_voltage(
            self.drive.motor, self.motor_speed, self.current, rate, self.winding_temperature, self.magnet_temperature
        )

    @cached_property
    def largest_voltage(self) -> Array:
        """Magnitude to be held against the supply [V], (N,).

        The largest of three: warm; cold, when strong magnets ask more at speed; and to start from rest.
        """
        motor = self.drive.motor
        cold = self.torque.total / float(torque_constant(motor, self.ambient))
        cold_voltage = terminal_voltage(
            motor, self.motor_speed, cold, current_rate(self.demand, cold), self.ambient, self.ambient
        )
        running = np.maximum(np.abs(self.voltage), np.abs(cold_voltage))
        resistance = winding_resistance(motor, np.asarray(self.winding_temperature))
        return np.maximum(running, np.where(self.demand.at_rest, np.abs(resistance * self.peak_current), 0.0))

    @cached_property
    def balance(self) -> PowerBalance:
        """Where the electrical power goes [W]."""
        return power_balance(
            self.computed, self.demand.gear_torque, self.demand.speed, self.torque,
            self.winding_temperature, self.magnet_temperature,
        )  # fmt: skip

    def series(self) -> JointSeries:
        """Everything over the cycle, for plots and current commands.

        Returns:
            The drive's series, (N,) each.
        """
        demand, torque = self.demand, self.torque
        steady = self.heat is not None and not self.heat.runaway
        return JointSeries(
            time=demand.time,
            position=demand.position,
            speed=demand.speed,
            acceleration=demand.acceleration,
            gear_torque=demand.load_torque,
            motor_speed=self.motor_speed,
            motor_torque=torque.total,
            rotor_torque=torque.rotor,
            friction_torque=torque.total - torque.rotor - demand.load_torque / self.drive.gear.ratio,
            current=self.current,
            voltage=self.voltage,
            electrical_power=self.balance.electrical,
            winding_temperature=self.heat.winding if self.heat is not None and steady else None,
            housing_temperature=self.heat.housing if self.heat is not None and steady else None,
            bearing_load=demand.wrench,
            load_inertia=demand.load_inertia,
        )


def operation(study: Study, joint: int, demand: JointDemand, drive: Drive) -> Operation:
    """A drive doing the work of a study's joint."""
    return Operation(demand, drive, study.joints[joint], study.supply, study.ambient, study.safety)


def current_rate(demand: JointDemand, current: Array) -> Array:
    """Rate of change of a current within its smooth stretches.

    Where two samples share an instant, where the direction of motion changes (friction and mesh loss step there) and
    where the payload changes, the model's current steps; a real one needs some electrical time constants for it,
    which no voltage of the model tells. There the slope of the nearer side is taken.

    Args:
        current: [A], (N,).

    Returns:
        [A/s], (N,).
    """
    steps = np.diff(demand.time)
    way = np.where(demand.at_rest, 0.0, np.sign(demand.speed))
    smooth = (steps > 0.0) & (way[1:] == way[:-1]) & (demand.payload[1:] == demand.payload[:-1])
    slope = np.where(smooth, np.diff(current) / np.where(smooth, steps, 1.0), 0.0)
    sides = np.zeros(len(current))
    total = np.zeros(len(current))
    sides[:-1] += smooth
    sides[1:] += smooth
    total[:-1] += slope
    total[1:] += slope
    return np.asarray(total / np.maximum(sides, 1.0))
