"""Losses in the mesh, which turn with the direction of power."""

from __future__ import annotations

import numpy as np
from hard_case import Figure, hard_case
from power_balance import power_balance

from drivetrain.drive.drive import Drive, book_current, motor_torque
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor, current

MU, RATIO, LOAD = 0.25, 100.0, 19.6


@hard_case(
    "T06",
    "Current to lift a load, relative to the current to lower it",
    setup="The mesh friction is 0.25 of the load, the ratio 100, and the load 19.6 N m at constant speed.",
    naive="current = torque / (efficiency · torque constant) in both directions",
)
def test_lift_and_lower() -> list[Figure]:
    motor = Motor("typical", resistance=0.299, torque_constant=0.0302, rotor_inertia=3.3e-5)
    drive = Drive(motor, Gear("typical", RATIO, kind="planetary", efficiency=1.0 / (1.0 + MU)))
    speed = np.concatenate([np.full(5, 0.2), np.full(5, -0.2)])
    load, still = np.full(10, LOAD), np.zeros(10)
    asked = motor_torque(drive, load, speed, still, still)
    amperes = current(motor, asked.total, 25.0)
    book = book_current(drive, load, still, still, 25.0)
    wanted = (1.0 + MU) / (1.0 - MU)
    balance = power_balance(drive, load, speed, asked, 25.0, 25.0)
    # What the mesh keeps of the power that crosses it: shaft power in, less the power at the output.
    book_loss = book * motor.torque_constant * RATIO * speed - load * speed
    return [
        Figure(
            "relative error of the ratio (1 + mu)/(1 - mu)",
            ours=abs(amperes[0] / amperes[-1] / wanted - 1.0),
            naive=abs(book[0] / book[-1] / wanted - 1.0),
            at_most=1e-6,
        ),
        Figure("smallest loss in the mesh", balance.mesh.min(), book_loss.min(), at_least=0.0, unit="W"),
        Figure("power unaccounted for", float(np.abs(balance.residual).max()), at_most=1e-12, unit="W"),
    ]
