"""The currents of one control tick: feed-forward, friction without chatter, limits of voltage, current and heat.

These laws run compiled (``commander.py``) and on symbols (``c_code.py``), from which the C code is printed. So nothing
here may branch on what changes from tick to tick: limits are taken with ``np.minimum`` and ``np.maximum``.
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
    # 1 where winding temperature, and overload of the amplifier, can be computed, else 0
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
    # torque of its counterbalances on the link, and at its joint what the gear and what the rotor gives [N m or N]
    helped: float = 0.0
    load: float = 0.0
    spun: float = 0.0


class Chains(NamedTuple):
    """The chains of the arm, one after another, and memory of their recursions."""

    # see ``dynamics/core/packed.py``
    links: Any
    rotors: Any
    # memory
    joints: Any
    bodies: Any
    chains: Any  # records CHAIN
    # what the joints of the axes do, (rows, n), a row a joint of the recursions: how far that turns, how fast, and what
    # of it stands behind a gear
    placed: Any
    spread: Any
    geared: Any
    # position, speed, acceleration of the rows beyond that, (3, rows): of joints that follow in closed loops, and of
    # what carries the arm, which the first joints of the recursion take
    own: Any
    turns: Any  # speeds of the shafts behind the gears for those of the joints, (n, n)
    # torques of the shafts for those of the joints, and how the load is shared, (n, n)
    unmixed: Any
    shares: Any
    pins: Any  # ``loops.Pins``; nothing follows where no loop is closed


@dataclass
class Chain:
    """One chain: its first row, link and rotor, and how many joints and rotors its recursion has."""

    row: int
    link: int
    rotor: int
    joints: int
    rotors: int


@law
def command(arm: Chains, axes: Any, targets: Any, size: Any) -> None:
    """One tick: the current of every axis, and the temperatures and overloads that it leaves.

    Args:
        targets: Rows of ``TARGETS`` [rad or m, and per s, s^2], (5, n).
        size: Sum of squares of the positions, which decides how their sines are computed.
    """
    n = len(axes)
    position, speed, acceleration, at, moving = targets[0], targets[1], targets[2], targets[3], targets[4]
    for i in range(n):
        axis, pull = axes[i], axes[i].bandwidth
        axis.acceleration = acceleration[i] + pull * (pull * (position[i] - at[i]) + 2.0 * (speed[i] - moving[i]))
        axis.helped = balanced(axis.balances, position[i])
        axis.load, axis.spun = 0.0, 0.0
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
                axes[i].spun += arm.spread[row + j][i] * joints[j].torque[0] - arm.geared[row + j][i] * through
    for i in range(n):
        load, spun, planned, measured = 0.0, 0.0, 0.0, 0.0
        for k in range(n):
            load += arm.shares[i][k] * axes[k].load - arm.unmixed[i][k] * axes[k].helped
            spun += arm.unmixed[i][k] * axes[k].spun
            planned += arm.turns[i][k] * speed[k]
            measured += arm.turns[i][k] * moving[k]
        axis = axes[i]
        drive(axis, load * axis.travel, spun * axis.travel, planned / axis.travel, measured / axis.travel)


@law
def move_linkage(arm: Chains, speed: Any) -> None:
    """How the joints that follow move, into the rows of the recursions; they are where the loops are closed."""
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
def balanced(balances: Any, angle: Any) -> Any:
    """What all counterbalances of a joint do to its link [N m]."""
    torque = lever_torque(balances.first, angle) + lever_torque(balances.second, angle)
    return torque + lever_torque(balances.third, angle)


@law
def drive(axis: Any, load: Any, spun: Any, planned: Any, measured: Any) -> None:
    """One tick of an axis: torques of its load and its rotor [N m], speeds of the gear's output [rad/s]."""
    mesh, heat = mesh_of(axis.gear), axis.heat
    torque = spun / mesh.ratio + through_gear(axis, mesh, load, planned)
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
    quick = np.maximum(abs(speed), axis.slow)
    forward, backward = turned(axis, mesh, load, quick), turned(axis, mesh, load, -quick)
    share = np.minimum(np.maximum(speed / axis.slow, -1.0), 1.0)
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
        most = np.minimum(most, motor.peak_torque / abs(constant))
    if axis.overloads != 0.0:
        allowed = overload_allows(axis.amplifier, axis.overload, axis.step)
        most = np.minimum(most, axis.amplifier.continuous_current * np.sqrt(allowed))
    if axis.heats != 0.0:
        spare = (motor.max_winding_temperature - axis.heat.winding_temperature) / axis.fade
        most = most * np.minimum(np.maximum(spare, 0.0), 1.0)
    return np.minimum(np.maximum(np.minimum(np.maximum(axis.wanted, low), high), -most), most)
