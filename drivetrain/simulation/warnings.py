"""Warnings about runs of little use: temperatures that damage a motor, steps too long for motion or bristles."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.counterbalance import out_of_stroke, span_length
from drivetrain.drive.motor import copper_coefficient
from drivetrain.effects.control.commanded_motion import CommandedMotion
from drivetrain.effects.friction.lugre_friction import LuGreFriction
from drivetrain.effects.loads.counterbalance_torque import CounterbalanceTorque
from drivetrain.effects.motor.winding_heat import WindingHeat
from drivetrain.simulation.engines.engine import Engine
from drivetrain.simulation.engines.inverse import motor_of
from drivetrain.simulation.planning.plan import Plan
from drivetrain.simulation.recording import Event

HOTTEST_MAGNETS = 150.0  # ASSUMED: above it common sintered magnets are demagnetised permanently [C]
FEWEST_STEPS = 10  # in a motion
LARGEST_PHASE = 3.0  # phase of the oscillation of the load on its bristles within one step [rad]
SMALLEST_DEFLECTION = 1e-6  # deflection of the bristles over the relative tolerance that resolves it [rad or m]


def warnings(plan: Plan, engine: Engine, rows: Array) -> tuple[Event, ...]:
    """Warnings about a run that ended without an error; ``rows`` are its output rows."""
    step = float(getattr(engine, "step", 0.0))
    found = (*_temperature_warnings(plan, rows), *_long_step(plan, step), *_bristles(plan, engine.tolerance, step))
    return (*found, *gas_springs(plan, rows))


def _temperature_warnings(plan: Plan, rows: Array) -> Iterator[Event]:
    """Windings and magnets above their limits, and losses at which the temperature would rise without limit."""
    recorded, time = plan.layout.recorded, rows[:, 0]
    for joint, effects in plan.scene.effects.items():
        heat = next((one for one in effects if isinstance(one, WindingHeat)), None)
        motor = motor_of(effects)
        if heat is None:
            continue
        limits = {"housing_temperature": ("magnets", HOTTEST_MAGNETS, "ASSUMED for its magnets")}
        if motor is not None and motor.max_winding_temperature is not None:
            limits["winding_temperature"] = ("winding", motor.max_winding_temperature, f"the limit of {motor.key}")
        for name, (kind, limit, whose) in limits.items():
            values = rows[:, recorded[f"{joint}.{name}"][0]]
            if values.max() > limit:
                at = float(time[int(np.argmax(values > limit))])
                hottest = f"{joint}.{name} reaches {values.max():.4g} °C, above {limit:g} °C, {whose}"
                yield Event(at, kind, hottest)
        if motor is None or f"{joint}.current_command" not in recorded or f"{joint}.current" not in recorded:
            continue
        square = _mean(time, rows[:, recorded[f"{joint}.current"][0]] ** 2)
        resistance = heat.network.resistance_winding_housing + heat.network.resistance_housing_ambient
        gain = motor.resistance * copper_coefficient(motor.reference_temperature) * resistance * square
        winding = rows[:, recorded[f"{joint}.winding_temperature"][0]]
        if gain >= 1.0 and winding[-1] > winding[0]:
            detail = f"{joint}: if its {math.sqrt(square):.3g} A RMS continued, the winding would heat up without limit"
            yield Event(float(time[-1]), "runaway", detail)


def _mean(time: Array, values: Array) -> float:
    span = float(time[-1] - time[0])
    return float(np.trapezoid(values, time)) / span if span > 0.0 else float(values[0])


def _long_step(plan: Plan, step: float) -> Iterator[Event]:
    """A fixed step that is too long for the duration of the motion."""
    moves = [one.effect.motion.time for one in plan.instances if isinstance(one.effect, CommandedMotion)]
    lasts = min([plan.scene.duration, *(float(time[-1] - time[0]) for time in moves)])
    if FEWEST_STEPS * step > lasts:
        detail = f"a step of {step:g} s is too long for a motion of {lasts:g} s; use {lasts / 100.0:.2g} s"
        yield Event(0.0, "step", detail)


def _bristles(plan: Plan, tolerance: float, step: float) -> Iterator[Event]:
    """LuGre bristles that are too stiff for the step or the tolerance."""
    inertia = np.diag(plan.inertia)
    for one in plan.instances:
        law = one.effect
        if not isinstance(law, LuGreFriction):
            continue
        joint, deflection = one.place.joint, law.coulomb / law.stiffness
        moved = float(inertia[joint]) / (one.place.ratio**2 if law.side == "motor" else 1.0)
        frequency = math.sqrt(law.stiffness / moved)
        if step * frequency > LARGEST_PHASE:
            best = 1.0 / frequency
            text = f"oscillates at {frequency:.3g} rad/s, too fast for a step of {step:g} s; use {best:.2g} s"
        elif deflection < SMALLEST_DEFLECTION * tolerance:
            text = f"deflects by {deflection:.3g} before it slips, too little for a tolerance of {tolerance:g}"
        else:
            continue
        yield Event(0.0, "LuGre stiffness", f"{one.title} {text}; DryFriction models exact sticking at any step")


def gas_springs(plan: Plan, rows: Array) -> Iterator[Event]:
    """Gas springs that a motion extends or compresses beyond their stroke, where their law says nothing."""
    for one in plan.instances:
        if isinstance(one.effect, CounterbalanceTorque):
            angle, balance = rows[:, plan.layout.recorded[f"{one.place.name}.position"][0]], one.effect.balance
            beyond = np.flatnonzero(out_of_stroke(balance, angle))
            if len(beyond):
                length = float(span_length(balance, angle[beyond[0]]))
                shortest, longest = balance.extended_length - balance.stroke, balance.extended_length
                detail = (
                    f"{one.place.name}: the gas spring of counterbalance {one.effect.number} would be {length:.4g} m "
                    f"long, and it goes from {shortest:.4g} to {longest:.4g} m: its force there is none that it has"
                )
                yield Event(float(rows[beyond[0], 0]), "gas spring", detail)
