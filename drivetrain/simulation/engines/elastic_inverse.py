"""What springs in the joints add to a command that the links follow: motors turn ahead by the twist of their springs.

With each link on its command its spring carries a torque T that is known, so the motor stands at q + twist(T) behind
the gear, and the rotor takes J d2 twist(T) / dt2 on top of what a rigid joint takes. That asks for a command whose jerk
does not jump: else the motor would have to be struck, so what the spring does is left out, and said.

Reference: Spong, Trans. ASME J. Dynamic Systems, Measurement and Control 109 (1987) 310, for the model.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.motor import terminal_voltage, torque_constant
from drivetrain.simulation.engines.inverse_demand import Demand, demanded, motor_of
from drivetrain.simulation.planning.plan import Plan
from drivetrain.simulation.recording import Event

APART = 2e-3  # s, between the instants of a difference, less noise than samples of 1 ms make; of a short run its share
SMOOTH = 0.1  # of the largest second derivative: what half the distance may change


def with_springs(plan: Plan, demand: Demand) -> tuple[Demand, tuple[Event, ...]]:
    """A rigid demand with what springs add to motor speed, torque, current and voltage; joints where that is left out.

    Friction and drag at the motor are those of its rigid speed.
    """
    springs = plan.body.springs
    if not springs:
        return demand, ()
    apart = APART * min(plan.scene.duration, 1.0)
    # A command that begins or ends under way goes on beyond the run; one at rest stays there.
    first, last = (apart if demand.speed[k].any() else 0.0 for k in (0, -1))
    time = np.clip(demand.time, first, plan.scene.duration - last)
    speed, ahead = _twisting(plan, time, apart)
    _, finer = _twisting(plan, time, 0.5 * apart)
    motor, current, voltage = demand.motor_torque.copy(), demand.current.copy(), demand.voltage.copy()
    events = []
    for i, shape in springs.items():
        name, ratio = plan.scene.joints[i], float(plan.body.ratios[i])
        largest = np.abs(ahead[:, i]).max()
        if shape.deflection is None or np.abs(finer[:, i] - ahead[:, i]).max() > SMOOTH * largest:
            why = "its command is not smooth enough: a jerk that jumps would strike the motor"
            events.append(Event(0.0, "rigid", f"{name}: what its spring asks of the motor is left out; {why}"))
            continue
        added = plan.body.rotors[i] * finer[:, i] / ratio
        motor[:, i] += added
        sheet = motor_of(plan.scene.effects.get(name, ()))
        if sheet is not None:
            rest = sheet.reference_temperature
            current[:, i] += added / torque_constant(sheet, rest)
            turning = (demand.shaft_speed[:, i] + speed[:, i]) * ratio
            voltage[:, i] = terminal_voltage(sheet, turning, current[:, i], 0.0, rest, rest)
    return replace(demand, motor_torque=motor, current=current, voltage=voltage), tuple(events)


def _twisting(plan: Plan, time: Array, apart: float) -> tuple[Array, Array]:
    """First and second derivative of the twists, by central differences, (N, n) each.

    Dry friction at the joint jumps as the joint turns round: its share of the torque is left out.
    """
    twists = []
    for shift in (-apart, 0.0, apart):
        told = demanded(plan, time + shift)
        twist = np.zeros_like(told.mesh_torque)
        for i, shape in plan.body.springs.items():
            if shape.deflection is not None:
                carried = told.mesh_torque[:, i] - told.joint_friction[:, i]
                twist[:, i] = [shape.deflection(float(load)) for load in carried]
        twists.append(twist)
    before, now, after = twists
    return (after - before) / (2.0 * apart), (after - 2.0 * now + before) / apart**2
