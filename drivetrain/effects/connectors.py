"""The connectors between effects and mechanics: one record per joint, and one for the whole scene.

A record is a numpy structured type made from a dataclass, so that compiled laws write ``joint.motor.torque``. At a
prismatic joint torques are forces [N] and angles are lengths [m]. ``load`` is on the joint side of the gear, ``motor``
on the side of the motor's shaft.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Annotated, Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.records import record_type


@dataclass
class Flange:
    """A rotating part: its motion, the smooth torques on it with their derivatives, and the bounds of dry friction."""

    # [rad], [rad/s], [rad/s^2]
    position: float = 0.0
    speed: float = 0.0
    acceleration: float = 0.0
    # sum of the smooth torques [N m], and its negative derivatives by speed [N m s/rad] and position [N m/rad]
    torque: float = 0.0
    damping: float = 0.0
    stiffness: float = 0.0
    # bounds of dry friction at rest (hold) and while slipping (slide) [N m]
    hold_forward: float = 0.0
    hold_backward: float = 0.0
    slide_forward: float = 0.0
    slide_backward: float = 0.0
    surface_speed: float = 0.0  # speed of the surface on which it slips [rad/s]
    # torque [N m] and power loss [W] of dry friction
    friction: float = 0.0
    friction_power: float = 0.0


@dataclass
class Spring:
    """The gear's spring between rotor (at the gear's output) and link; a positive torque accelerates the link."""

    wind_up: float = 0.0  # [rad]
    speed: float = 0.0  # [rad/s]
    torque: float = 0.0  # [N m]
    damping: float = 0.0  # [N m s/rad]
    stiffness: float = 0.0  # [N m/rad]


@dataclass
class Mesh:
    """The mesh of a gear."""

    # loss over transmitted torque when the motor drives, and when the load drives [-]
    driving: float = 0.0
    driven: float = 0.0
    torque: float = 0.0  # transmitted torque, at the gear's output [N m]
    loss: float = 0.0  # torque lost in the mesh, at the gear's output [N m]
    power: float = 0.0  # power lost [W]


@dataclass
class Pin:
    """A motor's terminals, as of the equivalent DC machine."""

    # current command [A], and its negative derivatives by the motor's speed [A s/rad] and position [A/rad]
    command: float = 0.0
    damping: float = 0.0
    stiffness: float = 0.0
    # actual current [A], voltage [V], largest available voltage [V]
    current: float = 0.0
    voltage: float = 0.0
    limit: float = 0.0
    # electrical power [W], energy in the inductance [J]
    power: float = 0.0
    magnetic_energy: float = 0.0


@dataclass
class HeatPort:
    """Temperatures of the motor's two thermal nodes and of its gear [C], and the losses that heat them [W]."""

    winding: float = 0.0
    housing: float = 0.0
    gear: float = 0.0  # the housing's, where the gear heats the housing
    copper_loss: float = 0.0
    viscous_power: float = 0.0
    drag_power: float = 0.0  # part of the motor's dry friction that is the drag of the gear


@dataclass
class Motion:
    """A commanded motion [rad], [rad/s], [rad/s^2]."""

    position: float = 0.0
    speed: float = 0.0
    acceleration: float = 0.0


@dataclass
class Joint:
    """The connectors of one joint, which all its effects share."""

    load: Flange  # the link
    motor: Flange  # the motor's shaft
    shaft: Flange  # the gear's output shaft, where motors are coupled; its dry friction is in ``load``
    spring: Spring  # of a flexible joint
    mesh: Mesh
    pin: Pin
    heat: HeatPort
    # commanded motion of the joint, and of the gear's output shaft where motors are coupled
    command: Motion
    shaft_command: Motion
    bias_torque: float = 0.0  # torque at zero acceleration: gravity, Coriolis and centrifugal terms [N m]
    tip_torque: float = 0.0  # torque of the forces on the tip at this coordinate [N m]
    measured_position: float = 0.0  # motor position that the encoder measures [rad]


@dataclass
class Tip:
    """The arm's tip in the base frame: its motion, and the forces that act on it."""

    # position [m], velocity [m/s], angular velocity [rad/s]
    place: Annotated[Array, 3]
    speed: Annotated[Array, 3]
    turning: Annotated[Array, 3]
    # [N], [N m]
    force: Annotated[Array, 3]
    moment: Annotated[Array, 3]
    # negative derivatives of the force by velocity [N s/m] and position [N/m]; xx, xy, xz, yy, yz, zz
    damping: Annotated[Array, 6]
    stiffness: Annotated[Array, 6]


@dataclass
class World:
    """The connectors of the whole scene; the first record of a run's memory."""

    size: int  # of the memory, in numbers [-]
    # numbers of joints and of coordinates of the mechanics [-]
    joints: int
    coordinates: int
    # [J], at instants only
    kinetic_energy: float
    potential_energy: float
    payload_energy: float  # energy that payload changes have added [J]
    payloads_passed: int  # number of payload changes counted in it [-]
    iteration: int  # number of solutions of this step so far [-]
    repeat_step: int  # set by an effect to request another solution of this step, with a corrected value
    step_limit: float  # set by an effect: longest step that it allows [s]
    tip: Tip


@cache
def place_in(dtype: np.dtype[Any], path: str) -> int | None:
    """Index of the number of a record that a path such as ``motor.torque`` or ``tip.place.2`` names; None: no such."""
    at = 0
    for name in path.split("."):
        if dtype.subdtype is not None and name.isdigit():
            dtype, at = dtype.subdtype[0], at + int(name)
        elif dtype.names is not None and name in dtype.names:
            dtype, offset = dtype.fields[name][:2]  # type: ignore[index]
            at += offset // 8
        else:
            return None
    return at if dtype.names is None else None


JOINT, WORLD = record_type(Joint, np.int64), record_type(World, np.int64)
