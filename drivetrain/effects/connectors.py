"""The typed connectors through which effects and mechanics meet: one record a joint, one for the whole scene.

A record is a numpy structured type made of a dataclass; compiled laws write ``joint.motor.torque``. Torques at a
sliding joint are forces [N], angles lengths [m]. Quantities of ``load`` count at the joint, of ``motor`` at its shaft.
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
    """A turning part: what it does, the smooth torques on it, how they fall, and the bounds of its dry friction."""

    # [rad], [rad/s], [rad/s^2]
    position: float = 0.0
    speed: float = 0.0
    acceleration: float = 0.0
    # sum of smooth torques, and how it falls with speed and position
    torque: float = 0.0
    damping: float = 0.0
    stiffness: float = 0.0
    # what friction holds at rest, and takes sliding
    hold_forward: float = 0.0
    hold_backward: float = 0.0
    slide_forward: float = 0.0
    slide_backward: float = 0.0
    surface_speed: float = 0.0  # of what it slides on [rad/s]
    # what dry friction takes [N m], [W]
    friction: float = 0.0
    friction_power: float = 0.0


@dataclass
class Spring:
    """Between the rotor behind the gear and the link: wind-up, and what answers it, pushing the link forward."""

    wind_up: float = 0.0
    speed: float = 0.0
    torque: float = 0.0
    damping: float = 0.0
    stiffness: float = 0.0


@dataclass
class Mesh:
    """A gear's mesh: loss over transmitted torque by direction of power, the torque at the output, its loss, power."""

    driving: float = 0.0
    driven: float = 0.0
    torque: float = 0.0
    loss: float = 0.0
    power: float = 0.0


@dataclass
class Pin:
    """A motor's terminals: the current asked for, how that falls with the motor's speed and position, what flows."""

    # [A], [A s/rad], [A/rad]
    command: float = 0.0
    damping: float = 0.0
    stiffness: float = 0.0
    # [A], [V], largest voltage there is [V]
    current: float = 0.0
    voltage: float = 0.0
    limit: float = 0.0
    # electrical [W], [J]
    power: float = 0.0
    magnetic_energy: float = 0.0


@dataclass
class HeatPort:
    """A motor's two thermal nodes and its gear: temperatures [C], and losses that warm them [W]."""

    winding: float = 0.0
    housing: float = 0.0
    gear: float = 0.0  # of the gear, the housing's where it warms that
    copper_loss: float = 0.0
    viscous_power: float = 0.0
    drag_power: float = 0.0  # share of the motor's dry friction that is the gear's drag


@dataclass
class Motion:
    """A commanded motion [rad], [rad/s], [rad/s^2]."""

    position: float = 0.0
    speed: float = 0.0
    acceleration: float = 0.0


@dataclass
class Joint:
    """All that effects of one joint share."""

    # of the link, and of the motor's shaft
    load: Flange
    motor: Flange
    shaft: Flange  # behind the gear, where motors are coupled; its dry friction is that of ``load``
    spring: Spring  # of a flexible joint
    mesh: Mesh
    pin: Pin
    heat: HeatPort
    # what the joint, or its shaft where motors are coupled, is commanded to do
    command: Motion
    shaft_command: Motion
    bias_torque: float = 0.0  # what gravity and speeds ask of the joint [N m]
    measured_position: float = 0.0  # the motor's, as an encoder sees it [rad]


@dataclass
class Tip:
    """The arm's tip along the axes of the base: what it does, and what the surroundings do to it."""

    # [m], [m/s], [rad/s]
    place: Annotated[Array, 3]
    speed: Annotated[Array, 3]
    turning: Annotated[Array, 3]
    # [N], [N m]
    force: Annotated[Array, 3]
    moment: Annotated[Array, 3]
    # how the force falls with speed and place; xx, xy, xz, yy, yz, zz
    damping: Annotated[Array, 6]
    stiffness: Annotated[Array, 6]


@dataclass
class World:
    """The head of a run's memory."""

    size: int  # of the memory, in numbers [-]
    # how many there are [-]
    joints: int
    coordinates: int
    # [J], at instants only
    kinetic_energy: float
    potential_energy: float
    payload_energy: float  # that payloads have brought or taken [J]
    payloads_passed: int  # how many of them are counted in it [-]
    tries: int  # how often this step has been solved before [-]
    again: int  # set by an effect that must provide another value for this step
    longest: float  # set by an effect: the step that it can follow [s]
    tip: Tip


@cache
def place_in(dtype: np.dtype[Any], path: str) -> int | None:
    """Which number of a record a path such as ``motor.torque`` or ``tip.place.2`` names; None: none."""
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
