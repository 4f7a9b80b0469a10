"""The currents of one control tick: feed-forward, friction without chatter, limits of voltage, current and heat.

These laws run compiled (``commander.py``) and on symbols (``symbols.py``), from which the C code is printed. So nothing
here may branch on what changes from tick to tick: limits are taken with ``smaller`` and ``larger``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from drivetrain.drive.amplifier import Amplifier, overload_after, overload_allows
from drivetrain.drive.counterbalance import Counterbalance, lever_torque
from drivetrain.drive.friction import Friction, friction_at, friction_curve
from drivetrain.drive.gear import Gear, drag_torque, gear_loss_power, mesh_of, mesh_torque
from drivetrain.drive.motor import Motor, torque_constant, winding_resistance
from drivetrain.dynamics.core.recursion import back, outwards
from drivetrain.effects.motor.winding_heat import Own, warmed
from drivetrain.jit import law
from drivetrain.records import known, known_or

TARGETS = ("position", "speed", "acceleration", "measured_position", "measured_speed")


NO_BALANCE = Counterbalance(angles=(0.0, 1.0), torques=(0.0, 0.0))


@dataclass
class Balances:
    """Counterbalances of a joint: springs on levers, gas springs, torques that stay the same."""

    first: Counterbalance = NO_BALANCE
    second: Counterbalance = NO_BALANCE
    third: Counterbalance = NO_BALANCE


@dataclass
class Axis:
    """One drive of an arm: what is known of it, and what changes from tick to tick."""

    # their sheets
    motor: Motor
    gear: Gear
    amplifier: Amplifier
    # friction at the gear's output and at the motor
    joint: Friction
    shaft: Friction
    balances: Balances
    heat: Own  # winding and housing, with their temperatures
    travel: float  # of the joint a radian of the gear's output [m/rad], 1 where it turns
    gear_temperature: float  # at which its drag is taken [C]
    volts: float  # largest at the terminals [V]
    most: float  # largest current, at any speed [A]
    # 1 where winding temperature, and overload of the amplifier, can be told, else 0
    heats: float
    overloads: float
    fade: float  # below the winding's limit, in which the current fades to nothing [K]
    slow: float  # speed of the gear's output below which friction fades [rad/s]
    bandwidth: float  # of the loop on position errors [rad/s]
    step: float  # between two ticks [s]
    # in this tick, before and after the limits [A]
    wanted: float = 0.0
    current: float = 0.0
    overload: float = 0.0  # of the amplifier, see ``drive/amplifier.py``
    acceleration: float = 0.0  # of the joint with what its errors ask [rad/s^2 or m/s^2]
    helped: float = 0.0  # torque of its counterbalances on the link [N m]


class Arm(NamedTuple):
    """The arm, and memory of its recursion."""

    # as ``dynamics/core/packed.py`` tells
    links: Any
    rotors: Any
    # memory
    joints: Any
    bodies: Any
    spread: Any  # motions of all links of the recursion for those of the arm's joints, (wide, n)
    # speeds of the shafts behind the gears for those of the joints, and torques likewise, (n, n)
    turns: Any
    unmixed: Any


@law
def larger(a: Any, b: Any) -> Any:
    """Of two numbers."""
    return 0.5 * (a + b + abs(a - b))


@law
def smaller(a: Any, b: Any) -> Any:
    """Of two numbers."""
    return 0.5 * (a + b - abs(a - b))


@law
def command(arm: Any, axes: Any, targets: Any, size: Any) -> None:
    """One tick: the current of every axis, and the temperatures and overloads that it leaves.

    Args:
        targets: Rows of ``TARGETS`` [rad or m, and per s, s^2], (5, n).
        size: Sum of squares of the positions, which tells how to take their sines.
    """
    n, wide = len(axes), len(arm.spread)
    position, speed, acceleration, at, moving = targets[0], targets[1], targets[2], targets[3], targets[4]
    for i in range(n):
        pull = axes[i].bandwidth
        axes[i].acceleration = acceleration[i] + pull * (pull * (position[i] - at[i]) + 2.0 * (speed[i] - moving[i]))
        axes[i].helped = balanced(axes[i].balances, position[i])
    for j in range(wide):
        joint = arm.joints[j]
        q, qd, qdd = 0.0, 0.0, 0.0
        for i in range(n):
            q += arm.spread[j][i] * position[i]
            qd += arm.spread[j][i] * speed[i]
            qdd += arm.spread[j][i] * axes[i].acceleration
        joint.q[0], joint.qd[0], joint.qdd[0] = q, qd, qdd
    outwards(arm.links, arm.rotors, arm.joints, arm.bodies, wide, size)
    back(arm.links, arm.joints, arm.bodies, wide)
    for i in range(n):
        load, whole, planned, measured = 0.0, 0.0, 0.0, 0.0
        for k in range(n):
            asked = 0.0
            for j in range(wide):
                asked += arm.spread[j][k] * arm.joints[j].torque[0]
            load += arm.unmixed[i][k] * (arm.joints[k].torque[0] - arm.joints[k].rotor[0] - axes[k].helped)
            whole += arm.unmixed[i][k] * (asked - axes[k].helped)
            planned += arm.turns[i][k] * speed[k]
            measured += arm.turns[i][k] * moving[k]
        axis = axes[i]
        drive(axis, load * axis.travel, whole * axis.travel, planned / axis.travel, measured / axis.travel)


@law
def balanced(balances: Any, angle: Any) -> Any:
    """What all counterbalances of a joint do to its link [N m]."""
    torque = lever_torque(balances.first, angle) + lever_torque(balances.second, angle)
    return torque + lever_torque(balances.third, angle)


@law
def drive(axis: Any, load: Any, whole: Any, planned: Any, measured: Any) -> None:
    """One tick of an axis: torque of its load, that with its rotor's [N m], speeds of the gear's output [rad/s]."""
    mesh, heat = mesh_of(axis.gear), axis.heat
    torque = (whole - load) / mesh.ratio + through_gear(axis, mesh, load, planned)
    constant = torque_constant(axis.motor, heat.housing_temperature)
    resistance = winding_resistance(axis.motor, heat.winding_temperature)
    turning = mesh.ratio * measured
    axis.wanted = torque / constant
    axis.current = limited(axis, constant, resistance, turning)
    amperes = axis.current
    if axis.overloads != 0.0:
        square = (amperes / axis.amplifier.continuous_current) ** 2
        axis.overload = overload_after(axis.amplifier, axis.overload, square, axis.step)
    if axis.heats != 0.0:
        lost = friction_at(friction_curve(axis.shaft), turning) * turning
        lost += heat.gear_heat * gear_loss_power(mesh, load, measured, axis.gear_temperature)
        heat.copper, heat.iron, heat.clock = axis.step * resistance * amperes * amperes, axis.step * lost, axis.step
        heat.winding_temperature, heat.housing_temperature = warmed(heat)


@law
def through_gear(axis: Any, mesh: Any, load: Any, speed: Any) -> Any:
    """Motor torque for a load, all frictions and losses counted; below ``slow`` between those of both directions."""
    quick = larger(abs(speed), axis.slow)
    forward, backward = turned(axis, mesh, load, quick), turned(axis, mesh, load, -quick)
    share = smaller(larger(speed / axis.slow, -1.0), 1.0)
    return 0.5 * (forward + backward + share * (forward - backward))


@law
def turned(axis: Any, mesh: Any, load: Any, speed: Any) -> Any:
    """Motor torque for a load while the gear's output turns [N m]."""
    turning = mesh.ratio * speed
    through = mesh_torque(mesh, load + friction_at(friction_curve(axis.joint), speed), speed)
    lost = friction_at(friction_curve(axis.shaft), turning) + drag_torque(mesh, turning, axis.gear_temperature)
    return through + lost


@law
def limited(axis: Any, constant: Any, resistance: Any, turning: Any) -> Any:
    """The wanted current within what voltage, motor, amplifier and winding allow in this tick [A]."""
    motor = axis.motor
    lag = known_or(motor.inductance, 0.0) / axis.step  # the voltage that a change of current takes
    back_emf = constant * turning - lag * axis.current
    low, high = (-axis.volts - back_emf) / (resistance + lag), (axis.volts - back_emf) / (resistance + lag)
    most = axis.most
    if known(motor.peak_torque):
        most = smaller(most, motor.peak_torque / abs(constant))
    if axis.overloads != 0.0:
        allowed = overload_allows(axis.amplifier, axis.overload, axis.step)
        most = smaller(most, axis.amplifier.continuous_current * np.sqrt(allowed))
    if axis.heats != 0.0:
        spare = (motor.max_winding_temperature - axis.heat.winding_temperature) / axis.fade
        most = most * smaller(larger(spare, 0.0), 1.0)
    return smaller(larger(smaller(larger(axis.wanted, low), high), -most), most)
