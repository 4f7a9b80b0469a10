"""The currents of one control tick: feed-forward, friction without chatter, limits of voltage, current and heat.

These laws run compiled (``commander.py``) and on symbols (``c_code.py``), from which C code is generated. Therefore
they must not branch on variables that change from tick to tick; limits use ``np.minimum`` and ``np.maximum``.
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
from drivetrain.dynamics.core.loops import move_followers
from drivetrain.dynamics.core.recursion import back, outwards
from drivetrain.effects.motor.winding_heat import Own, warmed
from drivetrain.jit import law
from drivetrain.records import known, known_or

TARGETS = ("position", "speed", "acceleration", "measured_position", "measured_speed")


NO_BALANCE = Counterbalance(angles=(0.0, 1.0), torques=(0.0, 0.0))


@dataclass
class Balances:
    """Counterbalances of a joint: springs on levers, gas springs, constant torques."""

    first: Counterbalance = NO_BALANCE
    second: Counterbalance = NO_BALANCE
    third: Counterbalance = NO_BALANCE


@dataclass
class Axis:
    """Parameters and state of one drive."""

    # data sheets
    motor: Motor
    gear: Gear
    amplifier: Amplifier
    # friction at the gear's output and at the motor
    joint: Friction
    shaft: Friction
    balances: Balances
    heat: Own  # winding and housing, with their temperatures
    travel: float  # travel of a prismatic joint per radian of the gear's output [m/rad]; 1 for a revolute joint
    gear_temperature: float  # at which the gear's drag is evaluated [C]
    volts: float  # largest voltage at the motor terminals [V]
    most: float  # current limit at any speed [A]
    # 1 if the winding temperature, and the overload of the amplifier, can be computed, else 0
    heats: float
    overloads: float
    fade: float  # range below the winding's limit over which the current is reduced to zero [K]
    slow: float  # speed of the gear's output below which friction is reduced [rad/s]
    bandwidth: float  # of the position loop [rad/s]
    step: float  # time between two ticks [s]
    # in this tick, before and after the limits [A]
    wanted: float = 0.0
    current: float = 0.0
    overload: float = 0.0  # used share of the amplifier's I2t limit, see ``drive/amplifier.py``
    acceleration: float = 0.0  # of the joint, including feedback [rad/s^2 or m/s^2]
    # torque of the counterbalances on the link, and at the joint the torques of the load and of the rotor [N m or N]
    balance_torque: float = 0.0
    load: float = 0.0
    rotor_torque: float = 0.0


class Chains(NamedTuple):
    """The chains of the arm, one after another, and work arrays of their recursions."""

    # see ``dynamics/core/packed.py``
    links: Any
    rotors: Any
    # work arrays
    joints: Any
    bodies: Any
    chains: Any  # records CHAIN
    # positions and speeds of the joints of the recursions per unit of those of the axes' joints, and the part of these
    # that acts through a gear, (rows, n) each
    placed: Any
    spread: Any
    geared: Any
    # position, speed and acceleration that are added to these, (3, rows): of passive joints in closed loops, and of a
    # moving base, which is the first joints of the recursion
    own: Any
    turns: Any  # from joint speeds to the speeds of the gear outputs, (n, n)
    # from joint torques to torques of the gear outputs, and the same with the sharing of loads, (n, n) each
    unmixed: Any
    shares: Any
    pins: Any  # ``loops.Pins``; without passive joints if there are no closed loops


@dataclass
class Chain:
    """One chain: indices of its first row, link and rotor, and numbers of joints and rotors of its recursion."""

    row: int
    link: int
    rotor: int
    joints: int
    rotors: int


@law
def command(arm: Chains, axes: Any, targets: Any, size: Any) -> None:
    """One tick: sets current, temperatures and overload of every axis.

    ``targets`` are the rows of ``TARGETS``, (5, n); ``size`` is the sum of squares of the positions, of which large
    values need another method for sines.
    """
    n = len(axes)
    position, speed, acceleration, at, moving = targets[0], targets[1], targets[2], targets[3], targets[4]
    for i in range(n):
        axis, pull = axes[i], axes[i].bandwidth
        axis.acceleration = acceleration[i] + pull * (pull * (position[i] - at[i]) + 2.0 * (speed[i] - moving[i]))
        axis.balance_torque = counterbalance_torque(axis.balances, position[i])
        axis.load, axis.rotor_torque = 0.0, 0.0
    if len(arm.pins.follow) > 0:
        move_linkage(arm, speed)
    for c in range(len(arm.chains)):
        chain = arm.chains[c]
        row, wide, link, rotor = chain.row, chain.joints, chain.link, chain.rotor
        links, joints = arm.links[link : link + wide + chain.rotors], arm.joints[row + c : row + c + wide + 1]
        bodies = arm.bodies[row + 2 * c : row + 2 * c + wide + 2]
        for j in range(wide):
            q, qd, qdd = arm.own[0][row + j], arm.own[1][row + j], arm.own[2][row + j]
            for i in range(n):
                share = arm.spread[row + j][i]
                q += arm.placed[row + j][i] * position[i]
                qd, qdd = qd + share * speed[i], qdd + share * axes[i].acceleration
            joints[j].q[0], joints[j].qd[0], joints[j].qdd[0] = q, qd, qdd
        outwards(links, arm.rotors[rotor : rotor + chain.rotors], joints, bodies, wide, size)
        back(links, joints, bodies, wide)
        for j in range(wide):
            through = joints[j].torque[0] - joints[j].rotor[0]
            for i in range(n):
                axes[i].load += arm.geared[row + j][i] * through
                axes[i].rotor_torque += arm.spread[row + j][i] * joints[j].torque[0] - arm.geared[row + j][i] * through
    for i in range(n):
        load, rotor_torque, planned, measured = 0.0, 0.0, 0.0, 0.0
        for k in range(n):
            load += arm.shares[i][k] * axes[k].load - arm.unmixed[i][k] * axes[k].balance_torque
            rotor_torque += arm.unmixed[i][k] * axes[k].rotor_torque
            planned += arm.turns[i][k] * speed[k]
            measured += arm.turns[i][k] * moving[k]
        axis = axes[i]
        drive(axis, load * axis.travel, rotor_torque * axis.travel, planned / axis.travel, measured / axis.travel)


@law
def move_linkage(arm: Chains, speed: Any) -> None:
    """Write the motion of the passive joints into the rows of the recursions; the loops are closed already."""
    pins, whole, m = arm.pins, arm.pins.whole, len(arm.pins.whole)
    for w in range(m):
        if whole[w].coordinate >= 0:
            whole[w].speed = speed[whole[w].coordinate]
    move_followers(pins)
    for r in range(len(pins.joints)):
        one = whole[pins.joints[r]]
        if one.coordinate < 0:
            arm.own[0][r], arm.own[2][r] = one.place, -pins.found[one.follower, m + 1]
            for w in range(m):
                if whole[w].coordinate >= 0:
                    share = -pins.found[one.follower, w]
                    arm.spread[r][whole[w].coordinate] = arm.geared[r][whole[w].coordinate] = share


@law
def counterbalance_torque(balances: Any, angle: Any) -> Any:
    """Torque of all counterbalances of a joint on its link [N m]."""
    torque = lever_torque(balances.first, angle) + lever_torque(balances.second, angle)
    return torque + lever_torque(balances.third, angle)


@law
def drive(axis: Any, load: Any, rotor_torque: Any, planned: Any, measured: Any) -> None:
    """One tick of an axis: sets its current, temperatures and overload.

    Torques of the load and of the rotor's inertia are at the gear's output [N m], as its planned and its measured speed
    [rad/s].
    """
    mesh, heat = mesh_of(axis.gear), axis.heat
    torque = rotor_torque / mesh.ratio + torque_for_load(axis, mesh, load, planned)
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
        lost = friction_at(friction_curve(axis.shaft), turning) * turning + heat.constant_loss
        lost += heat.gear_heat * gear_loss_power(mesh, load, measured, axis.gear_temperature)
        heat.copper, heat.iron, heat.clock = axis.step * resistance * amperes * amperes, axis.step * lost, axis.step
        heat.winding_temperature, heat.housing_temperature = warmed(heat)


@law
def torque_for_load(axis: Any, mesh: Any, load: Any, speed: Any) -> Any:
    """Motor torque for a load, with friction and losses [N m]; interpolated between directions below ``slow``."""
    quick = np.maximum(abs(speed), axis.slow)
    forward, backward = torque_while_turning(axis, mesh, load, quick), torque_while_turning(axis, mesh, load, -quick)
    share = np.minimum(np.maximum(speed / axis.slow, -1.0), 1.0)
    return 0.5 * (forward + backward + share * (forward - backward))


@law
def torque_while_turning(axis: Any, mesh: Any, load: Any, speed: Any) -> Any:
    """Motor torque for a load while the gear's output turns at ``speed`` [rad/s], with friction and losses [N m]."""
    turning = mesh.ratio * speed
    through = mesh_torque(mesh, load + friction_at(friction_curve(axis.joint), speed), speed)
    lost = friction_at(friction_curve(axis.shaft), turning) + drag_torque(mesh, turning, axis.gear_temperature)
    return through + lost


@law
def limited(axis: Any, constant: Any, resistance: Any, turning: Any) -> Any:
    """The wanted current, limited by voltage, motor, amplifier and winding temperature [A]."""
    motor = axis.motor
    lag = known_or(motor.inductance, 0.0) / axis.step  # inductive voltage per change of current within one tick
    back_emf = constant * turning - lag * axis.current
    low, high = (-axis.volts - back_emf) / (resistance + lag), (axis.volts - back_emf) / (resistance + lag)
    most = axis.most
    if known(motor.peak_torque):
        most = np.minimum(most, motor.peak_torque / abs(constant))
    if axis.overloads != 0.0:
        allowed = overload_allows(axis.amplifier, axis.overload, axis.step)
        most = np.minimum(most, axis.amplifier.continuous_current * np.sqrt(allowed))
    if axis.heats != 0.0:
        spare = (motor.max_winding_temperature - axis.heat.winding_temperature) / axis.fade
        most = most * np.minimum(np.maximum(spare, 0.0), 1.0)
    return np.minimum(np.maximum(np.minimum(np.maximum(axis.wanted, low), high), -most), most)
