"""Friction that grows with speed, at the joint or at the motor's shaft."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.drive.friction import (
    Friction,
    friction_curve,
    friction_torque,
    sliding_friction,
    smooth_lack,
    tanh_slope,
)
from drivetrain.effects import signals as s
from drivetrain.effects.bounds import bounded
from drivetrain.effects.effect import Effect, Place, Ports, Role, Signal
from drivetrain.effects.estimate import Conditions, Estimate, TaskSeries
from drivetrain.effects.field_types import side_faults
from drivetrain.effects.laws import MOTOR, flange_of, joint_law, side_of
from drivetrain.errors import InputError
from drivetrain.jit import law


@dataclass
class Own:
    """What it keeps: its side, damping either way [N m s/rad], Coulomb's torques and speed of a smooth law; power."""

    side: int
    viscous_forward: float
    viscous_backward: float
    forward: float
    backward: float
    tanh_speed: float
    power: float = 0.0


@law
def _torque(own: Any, speed: float) -> float:
    """All of it; without a smooth part Coulomb's torques are 0."""
    torque = sliding_friction(own, speed)
    return torque + smooth_lack(own, speed) if own.tanh_speed > 0.0 else torque


@joint_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any) -> None:
    flange = flange_of(joint, own.side)
    flange.torque -= _torque(own, flange.speed)
    flange.damping += own.viscous_forward if flange.speed >= 0.0 else own.viscous_backward
    if own.tanh_speed > 0.0:
        flange.damping += tanh_slope(own, flange.speed)


@joint_law(Own)
def _account(t: Any, h: Any, own: Any, joint: Any) -> None:
    speed = flange_of(joint, own.side).speed
    own.power = _torque(own, speed) * speed
    if own.side == MOTOR:
        joint.heat.viscous_power = own.power


@dataclass(frozen=True)
class ViscousFriction(Effect):
    """A torque against the motion, proportional to speed or growing smoothly with it.

    Attributes:
        friction: Of which ``viscous`` and ``viscous_negative`` are taken, and Coulomb's torque where it rises as tanh;
            dry friction is an effect of its own.
        side: ``joint``, ``motor``, or ``shaft``: behind the gear, where motors are coupled.
    """

    friction: Friction
    side: str = "joint"

    compute = _compute
    account = _account

    def __post_init__(self) -> None:
        faults = side_faults(self)
        if faults:
            raise InputError(faults)

    def ports(self, place: Place) -> Ports:
        speed, torque, damping = s.of_side(self.side, place)
        loss = Signal(f"{self.side}_viscous_power", "W", path="power")
        return Ports(
            needs=(speed,),
            contributes=(torque, damping),
            outputs=(loss,),
            powers={loss.name: Role.LOSS},
        )

    def own(self, place: Place) -> Own:
        curve = friction_curve(self.friction)
        forward, backward = (curve.forward, curve.backward) if curve.tanh_speed else (0.0, 0.0)
        viscous = curve.viscous_forward, curve.viscous_backward
        return Own(side_of(self.side, place), *viscous, forward, backward, curve.tanh_speed)

    def estimate(self, place: Place, conditions: Conditions) -> Estimate:
        if conditions.series is not None:
            return self._along(place, conditions, conditions.series)
        damping = max(self.friction.viscous, self.friction.viscous_negative or 0.0)
        damping *= place.ratio**2 if self.side == "motor" else 1.0
        torque = damping * conditions.peak_speed + (self.friction.coulomb if self.friction.tanh_speed else 0.0)
        peak, mean = torque / max(conditions.peak_torque, 1e-300), torque / max(conditions.rms_torque, 1e-300)
        why = "torque at peak speed over peak and RMS torque; squared on the copper loss"
        return Estimate(peak, mean, 2.0 * mean + mean**2, 0.0, conditions.free, why)

    def _along(self, place: Place, conditions: Conditions, series: TaskSeries) -> Estimate:
        """Its torque at the commanded speed, at every instant."""
        motor, ratio = self.side == "motor", abs(place.ratio)
        speed = series.speed * (place.ratio if motor else 1.0)
        stated = self.friction
        viscous = Friction(viscous=stated.viscous, viscous_negative=stated.viscous_negative)
        torque = np.abs(friction_torque(stated if stated.tanh_speed else viscous, speed))
        at_motor = torque if motor else torque / ratio * conditions.mesh_share
        away = float(np.abs(at_motor).max()) * ratio / conditions.loop_stiffness
        why = "damping times the commanded speed, at every instant"
        power = torque * np.abs(speed) if motor else None
        return bounded(conditions, at_motor / conditions.torque_constant, why, deviation=away, power=power)
