"""The drag of a gear over speed and temperature, beside the loss of its mesh.

A printed efficiency is a mixture of both at one point. Apart they hold at every load, at rest and without load too:
T_in = T_out/(G eta) + T_d when the motor drives, T_out eta_back/G + T_d when the load does, T_d against the motion.
"""

from __future__ import annotations

import math
from typing import Any

from drivetrain.drive.friction import direction
from drivetrain.jit import law

DRAG_REFERENCE = 20.0  # C, at which the drag is given
DRAG_TEMPERATURES = (-10.0, 40.0)  # C: what the charts cover that the law was fitted to; it is held at the ends outside
HALVINGS = 24  # of some ten kelvin: to a millionth
BACK_DRIVING = 1.05  # of ratio and starting torque, fitted to strain-wave gears of four sizes


@law
def drag_factor(mesh: Any, temperature: Any) -> Any:
    """Drag at a gear's temperature over that at 20 C: exp(-b1 d + b2 d^2), d above 20 C, -10 to 40 C; seals apart.

    Fitted to 88 points of efficiency charts to 0.4 points rms (catalogs/SOURCES.md). +-20 % for sizes 14 to 25, +-40 %
    elsewhere.
    """
    above = min(max(temperature, DRAG_TEMPERATURES[0]), DRAG_TEMPERATURES[1]) - DRAG_REFERENCE
    return math.exp((mesh.bend * above - mesh.cooling) * above)


@law
def turning_drag(mesh: Any, factor: Any, input_speed: Any) -> Any:
    """T_d = T_20 (n/n_0)^p f + T_seal with f known, of the sign of the input's speed [N m]; 0 at rest."""
    return grown_drag(mesh, factor * speed_power(mesh.exponent, input_speed), input_speed)


@law
def grown_drag(mesh: Any, factor: Any, input_speed: Any) -> Any:
    """The same with f |n|^p known."""
    return direction(input_speed) * (mesh.drag * factor + mesh.seal)


@law
def speed_power(exponent: Any, speed: Any) -> Any:
    """|n|^p, 1 without a power."""
    return 1.0 if exponent == 0.0 else abs(speed) ** exponent


@law
def drag_torque(mesh: Any, input_speed: Any, temperature: Any) -> Any:
    """The same at a temperature of the gear [C]."""
    return turning_drag(mesh, drag_factor(mesh, temperature), input_speed)


@law
def settled_temperature(mesh: Any, ambient: Any, resistance: Any, heat: Any, drag: Any) -> Any:
    """Of a gear whose drag warms its housing: T = T_ambient + R (heat + drag f(T)), from below by halving [C]."""
    low = ambient + resistance * heat
    high = low + resistance * drag * drag_factor(mesh, low)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if ambient + resistance * (heat + drag * drag_factor(mesh, middle)) > middle:
            low = middle
        else:
            high = middle
    return low


@law
def mesh_loss_power(mesh: Any, load: Any, speed: Any) -> Any:
    """What a turning mesh makes of power into heat, (1/eta - 1) |T w| or (1 - eta_back) |T w| [W]; at the output."""
    power = load * speed
    return ((mesh.driving - 1.0) * (power > 0.0) + (mesh.driven - 1.0) * (power < 0.0)) * power


@law
def gear_loss_power(mesh: Any, load: Any, speed: Any, temperature: Any) -> Any:
    """The same of mesh and drag together [W]."""
    motor_speed = mesh.ratio * speed
    return mesh_loss_power(mesh, load, speed) + drag_torque(mesh, motor_speed, temperature) * motor_speed


@law
def back_driving_torque(mesh: Any) -> Any:
    """At the output, that moves the gear from behind with nothing on the motor: 1.05 G T_s [N m], FITTED."""
    return BACK_DRIVING * abs(mesh.ratio) * mesh.starting
