"""Loss of a gear in two parts: a mesh that takes its share of the load, and a drag that knows speed and temperature.

A printed efficiency is a mixture of both at one point. Apart they hold at every load, at rest and without load too:
T_in = T_out/(G eta) + T_d when the motor drives, T_out (2 - 1/eta)/G + T_d when the load does, T_d against the motion.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from drivetrain.drive.friction import direction
from drivetrain.drive.gear import StandstillInterval
from drivetrain.jit import law
from drivetrain.records import known_or

DRAG_REFERENCE = 20.0  # C, at which the drag is given
DRAG_TEMPERATURES = (-10.0, 40.0)  # C: what the charts cover that the law was fitted to; it is held at the ends outside
BACK_DRIVING = 1.05  # of ratio and starting torque, fitted to strain-wave gears of four sizes


class GearLoss(NamedTuple):
    """The loss of a gear as its laws need it.

    Attributes:
        ratio: Motor speed over output speed.
        driving, driven: Motor-side torque through the mesh over the lossless one, by direction of power.
        drag: At ``speed`` and 20 C, without seals [N m].
        speed: Of the input [rad/s].
        exponent: Of drag over speed.
        cooling, bend: b1 and b2 of drag over temperature [1/K], [1/K^2].
        seal: Drag at any speed and temperature [N m].
        starting: At the input, that moves the unloaded gear from rest [N m].
    """

    ratio: float
    driving: float
    driven: float
    drag: float
    speed: float
    exponent: float
    cooling: float
    bend: float
    seal: float
    starting: float


@law
def loss_of(gear: Any) -> Any:
    """The loss of a gear by its mesh efficiency and drag; NaN in ``driving`` where the row has none.

    The same friction mu = 1/eta - 1 in both directions is ASSUMED; at rest the seals hold too.
    """
    friction = 1.0 / known_or(gear.mesh_efficiency, math.nan) - 1.0
    seal = known_or(gear.seal_drag_torque, 0.0)
    return GearLoss(
        gear.ratio, 1.0 + friction, 1.0 - friction, known_or(gear.drag_torque, math.nan),
        known_or(gear.drag_speed, 1.0), known_or(gear.drag_speed_exponent, 0.0), known_or(gear.drag_temperature_1, 0.0),
        known_or(gear.drag_temperature_2, 0.0), seal, max(known_or(gear.starting_torque, 0.0), seal),
    )  # fmt: skip


@law
def drag_torque(loss: Any, input_speed: Any, temperature: Any) -> Any:
    """T_d = T_20 (n/n_0)^p exp(-b1 d + b2 d^2) + T_seal [N m], at the input; d above 20 C, -10 to 40 C.

    Fitted to 88 points of efficiency charts to 0.4 points rms (catalogs/SOURCES.md). +-20 % for sizes 14 to 25, +-40 %
    elsewhere.
    """
    above = min(max(temperature, DRAG_TEMPERATURES[0]), DRAG_TEMPERATURES[1]) - DRAG_REFERENCE
    grown = 1.0 if loss.exponent == 0.0 else (abs(input_speed) / loss.speed) ** loss.exponent
    return loss.drag * grown * math.exp((loss.bend * above - loss.cooling) * above) + loss.seal


@law
def gear_input_torque(loss: Any, load: Any, speed: Any, temperature: Any) -> Any:
    """Motor-side torque of a turning gear [N m]; load and speed at the output [N m], [rad/s]; rotor not in it."""
    factor = loss.driving if load * speed > 0.0 else loss.driven
    motor_speed = loss.ratio * speed
    return factor * load / loss.ratio + direction(motor_speed) * drag_torque(loss, motor_speed, temperature)


@law
def gear_loss_power(loss: Any, load: Any, speed: Any, temperature: Any) -> Any:
    """What a turning gear makes of power into heat, |w| (T_d + mu |T|/|G|) with w of the input [W]."""
    motor_speed = abs(loss.ratio * speed)
    mesh = (loss.driving - 1.0) * abs(load / loss.ratio)
    return motor_speed * (mesh + drag_torque(loss, motor_speed, temperature))


@law
def resting_interval(loss: Any, load: Any) -> Any:
    """Motor-side torques between which a gear at rest stays so: T eta_b/G - T_s and T/(eta G) + T_s for T/G > 0."""
    lossless = load / loss.ratio
    way = direction(lossless) if lossless != 0.0 else 1.0
    return StandstillInterval(
        loss.driven * lossless - way * loss.starting, loss.driving * lossless + way * loss.starting
    )


@law
def back_driving_torque(loss: Any) -> Any:
    """At the output, that moves the gear from behind with nothing on the motor: 1.05 G T_s [N m], FITTED."""
    return BACK_DRIVING * abs(loss.ratio) * loss.starting
