"""Derivatives of the torques that an arm needs for its motion, in the coordinates of a scene."""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetrain.dynamics.core.derivatives import ENTRY_ALONE, fill_alone
from drivetrain.simulation.core.bodies import bodies_of, links_of, rotors_of
from drivetrain.simulation.core.friction import slipping_loss
from drivetrain.simulation.core.records import AT, Run, coordinates_of, engine_of, numbers_of, part, rows_of, world_of


@part
def fill_arm_derivatives(run: Run, result: Any) -> None:
    """Add the derivatives of the torques that an arm needs, at the motion and accelerations of the last evaluation.

    The torques include the losses of rigid joints' meshes, which transmit all but the torques of their own rotors. The
    columns of ``result`` are positions, then speeds of the coordinates.
    """
    engine, coordinates = engine_of(run), coordinates_of(run)
    e, c, no_tip = engine.bodies, len(coordinates), np.zeros((0, 6))
    spread, accelerations = rows_of(run, AT.spread, e, c), np.zeros(e)
    for r in range(e):
        for k in range(c):
            accelerations[r] += spread[r, k] * coordinates[k].change
    entries, motors = np.zeros((e, e), ENTRY_ALONE), np.zeros((e, e), ENTRY_ALONE)
    base, gravity = bodies_of(run)[-1], np.zeros(3)
    for i in range(3):
        for k in range(3):
            gravity[i] -= base.rotation[k, i] * base.dv[k]
    places, speeds = numbers_of(run, AT.body_places), numbers_of(run, AT.body_speeds)
    fill_alone(links_of(run), rotors_of(run), gravity, places, speeds, accelerations, no_tip, entries, motors)
    for i in range(c):
        one = coordinates[i]
        through = 1.0 + (slipping_loss(one.dry) if one.dry.active and one.motor == i else 0.0)
        for r in range(e):
            if spread[r, i] != 0.0:
                own = spread[r, i] * (1.0 if r == one.rotor_row else through)
                for s in range(e):
                    entry, motor = entries[r, s], motors[r, s]
                    by_q = spread[r, i] * through * entry.by_q[0] + own * motor.by_q[0]
                    by_qd = spread[r, i] * through * entry.by_qd[0] + own * motor.by_qd[0]
                    for k in range(c):
                        if spread[s, k] != 0.0:
                            result[i, k] += spread[s, k] * by_q
                            result[i, c + k] += spread[s, k] * by_qd
    for j in range(world_of(run).joints):
        link, m = coordinates[j].link, coordinates[j].motor
        if m != link:  # the position of a rotor behind a spring is that of its link plus the wind-up
            for i in range(c):
                result[i, link] += result[i, m]
