"""One joint at work on a few samples, quick as plain Python, and laws of its parts written out for comparison."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from drivetrain.catalog.read import Catalog
from drivetrain.drive.amplifier import Amplifier
from drivetrain.drive.brake import Brake
from drivetrain.drive.drive import Drive
from drivetrain.drive.friction import Friction
from drivetrain.drive.motor import braked
from drivetrain.sizing.demand.demand import StopDemand, workload
from drivetrain.sizing.judge.operation import Operation
from drivetrain.study.model import Safety, StiffnessWish, Stop

COPPER, AMBIENT, PEAK = 0.0039, 31.0, 1.3  # 1/K from 25 C, C, safety factor
FRICTIONS = Friction(0.5, 0.8, 0.06, 0.09, static=1.1, stribeck_speed=0.7), Friction(0.002, None, 4e-6, static=0.003)
SLOW = {"winding_time_constant": 2e4, "housing_time_constant": 8e5}  # s, beside a cycle of some 1.5 s
SAFETY = Safety(
    peak_torque=PEAK, rms=1.15, temperature_margin=4.0, inertia_ratio=9.0, life=3e7, bearing_load_factor=1.4
)
BRAKE = Brake("b", "motor", static_torque=0.9, power=7.0, inertia=3e-6, mass=0.1, energy_per_stop=90.0)


def axis(make, motor=None, gear=None, cycle=None, task=None, demand=None, **changes):
    """One joint at work over a smooth cycle that begins and ends at rest, in all four quadrants.

    ``task``, ``demand``: changes of the joint's task and of its demand.
    """
    if cycle is None:
        time = np.linspace(0.0, 1.2, 25)
        rate = 2.0 * math.pi / 1.2
        speed, acceleration = 3.0 * np.sin(rate * time), 3.0 * rate * np.cos(rate * time)
        speed[np.abs(speed) < 1e-12] = 0.0
        torque = 9.0 * np.cos(3.0 * rate * time) + 2.0 * np.sin(rate * time) * (1.0 - np.cos(rate * time))
        cycle = make.table_cycle(time, torque, speed, acceleration)  # steepest within, not at an end
    motor, gear = motor or make.motor, gear or make.gear
    study = make.study(
        cycle, joints=(make.task(**({"motor_friction": Friction()} | (task or {}))),),
        catalog=Catalog({"m1": motor}, {"g1": gear}),
        **{"safety": Safety(peak_torque=PEAK), "ambient": AMBIENT} | changes,
    )  # fmt: skip
    only = study.joints[0]
    drive = Drive(motor, gear, only.friction, only.motor_friction)
    asked = workload(replace(study, arm=None)).at(0, {0: drive}) if demand else workload(study).at(0, {0: drive})
    return Operation(replace(asked.demand(drive), **demand or {}), drive, study, 0)


def random_axis(
    make, motor=None, gear=None, task=None, mixed=False, moves=True, size=1.0, pace=1.0, held=0.0, gives_back=False,
    brake=BRAKE, **changes,
):  # fmt: skip
    """One joint with a motion and loads that fit no mechanism: every series has numbers of its own.

    It rests at the ends, at a sample alone, and for a while; stops on a ramp have states of their own. ``motor``,
    ``gear`` and ``task``: changes of a winding that follows no cycle, a brake, losses of everything. ``mixed``: two
    parts, of which the second is used for most of the time. ``size`` and ``pace``: factors
    on speeds and loads, and on the time. ``held``: torque at a sample that rests [N m]; 0: as any other.
    ``gives_back``: the load drives the motor in every stop on a ramp.
    """
    rng, samples = np.random.default_rng(7), 16
    step = rng.uniform(0.05, 0.15, samples - 1)
    step[[7, 10]] *= 5.0  # beside a rest, which then is a small share of the time around its ends
    time = pace * np.append(0.0, np.cumsum(step))
    speed, acceleration = 3.0 * rng.normal(size=samples), 20.0 * rng.normal(size=samples)
    moves = size * moves
    speed[[0, 5, 8, 9, 10, -2, -1]] = acceleration[[8, 9, 10]] = 0.0
    acceleration[4:7], speed[[4, 6]] = [7.0, 9.0, 8.0], [-2.0, 1.5]  # turns with losses of where it goes
    parts = slice(0, 9), slice(9, samples)
    time[9:] -= mixed * (time[9] - time[8])  # one part after the other
    torque = 9.0 * size * rng.normal(size=samples)
    torque[9] = held or torque[9]
    cycle = make.table_cycle(time, torque, moves * speed, moves * acceleration)
    if mixed:
        cycle = replace(cycle, parts=parts, shares=(0.3, 0.7), part_names=("a", "b"))
    stops = size * rng.normal(size=(4, 9)) * [[12.0], [2.0], [15.0], [4.0]]
    if gives_back:
        stops[0] = -np.sign(stops[1]) * np.abs(stops[0])
    demand = {
        "wrench": size * rng.normal(size=(samples, 6)) * [30, 25, 20, 200, 150, 120],
        "load_inertia": abs(size) * rng.uniform(0.2, 0.9, samples),
        "static_torque": 6.0 * size * rng.normal(size=samples),
        "carrier_acceleration": moves * 5.0 * rng.normal(size=samples),
    }  # fmt: skip
    amplifier = Amplifier(peak_current=40.0, continuous_current=9.0, standby_power=5.0, on_resistance=0.02)
    task = {"friction": FRICTIONS[0], "motor_friction": FRICTIONS[1], "amplifier": amplifier, "brakes": (brake,),
            "gear_heat": 0.6, "amplifier_heat": 0.35, "stop": Stop(ramp=0.35), **(task or {})}  # fmt: skip
    if task["stop"].ramp is not None and moves:
        demand["stop"] = StopDemand(np.arange(9), np.zeros(9), *stops)
    plain = {"magnet_coefficient": -0.002, "inductance": 0.003, "resistance_winding_housing": 1.7}
    motor = braked(replace(make.motor, **plain | SLOW | (motor or {})), brake)
    arm = make.planar_arm([0.4], [1.0])  # of which only is asked whether there is one
    changes = {"arm": arm, "safety": SAFETY, "stiffness": StiffnessWish(7.0), **changes}
    return axis(make, motor, replace(make.gear, **(gear or {})), cycle, task, demand, **changes)


def resistance(motor, temperature):
    return motor.resistance * (1.0 + COPPER * (temperature - motor.reference_temperature))


def constant(motor, temperature):
    return motor.torque_constant * (1.0 + motor.magnet_coefficient * (temperature - motor.reference_temperature))


def rubbed(friction, speed):
    """Against the motion; what sticks more than it slides falls off with the square of the speed."""
    ahead = speed > 0.0
    behind = friction.coulomb if friction.coulomb_negative is None else friction.coulomb_negative
    viscous = friction.viscous if friction.viscous_negative is None else friction.viscous_negative
    sliding = np.where(ahead, friction.coulomb, behind)
    more = 0.0
    if friction.stribeck_speed is not None:
        more = np.maximum(friction.static - sliding, 0.0) * np.exp(-((speed / friction.stribeck_speed) ** 2))
    return np.sign(speed) * (sliding + more) + np.where(ahead, friction.viscous, viscous) * speed


def mean(op, values):
    """Over the cycle, straight between samples; of a mix by the shares of its parts."""
    cycle, time = op.demand.cycle, op.demand.time
    means = [np.trapezoid(values[one], time[one]) / np.ptp(time[one]) for one in cycle.parts]
    return float(np.dot(cycle.shares, means))


def steps(cycle):
    """The samples of a cycle that one follows the other, as pairs."""
    return [(k, k + 1) for part in cycle.parts for k in range(part.start, part.stop - 1)]


def rates(op, torque=None):
    """Mean of the torque's slopes on both sides of a sample, but for one where the motion turns: there it steps."""
    time, way, sides = op.demand.time, np.sign(op.demand.speed), [[] for _ in op.demand.time]
    torque = op.motor_torque if torque is None else torque
    for i, k in steps(op.demand.cycle):
        if way[i] == way[k]:
            slope = (torque[k] - torque[i]) / (time[k] - time[i])
            sides[i].append(slope)
            sides[k].append(slope)
    return np.array([np.mean(found) if found else 0.0 for found in sides])
