"""Kinetic and potential energy of a scene's mechanics."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from drivetrain.arrays import Array
from drivetrain.dynamics.flexibility import rotor_inertias
from drivetrain.dynamics.lagrange import kinetic_energy, potential_energy
from drivetrain.simulation.plan import Plan


def mechanical_energy(plan: Plan, series: Mapping[str, Array]) -> Array:
    """Energy of motion and height.

    Args:
        plan: The plan.
        series: Positions and speeds of all joints, and of rotors on their own, by full name.

    Returns:
        [J], one an instant.
    """
    joints, body = plan.scene.joints, plan.body
    q = np.column_stack([series[f"{joint}.position"] for joint in joints])
    qd = np.column_stack([series[f"{joint}.speed"] for joint in joints])
    shafts = qd.copy()
    for i in body.springs:
        shafts[:, i] = series[f"{joints[i]}.shaft_speed"]
    if body.arm is None:
        inertia, rotor = body.constant[0, 0], body.constant[3, body.motors[0]]
        kinetic = 0.5 * inertia * qd[:, 0] ** 2
        if body.springs:
            kinetic = kinetic + 0.5 * rotor * shafts[:, 0] ** 2
        return np.asarray(kinetic + body.constant[1, 0] * np.sin(q[:, 0] + body.constant[2, 0]))
    rigid = kinetic_energy(body.arm, q, qd) + potential_energy(body.arm, q)
    # Rotors that only reflect to their joints are not in the arm; those on springs move otherwise than their joints.
    own = np.array([0.0 if rotor is None else rotor.ratio**2 * rotor.axial_inertia for rotor in body.arm.rotors])
    rigid = rigid + 0.5 * (qd**2) @ (body.rotors - own)
    if body.springs:
        shared, apart = rotor_inertias(body.arm, q)
        slip = shafts - qd
        turning = slip.copy()
        turning[:, body.uncoupled] = -qd[:, body.uncoupled]  # takes back the coupling that the arm's own energy has
        rigid = rigid + np.einsum("ki,kij,kj->k", qd, shared, turning) + np.einsum("ki,kij,kj->k", qd, apart, slip)
        rigid = rigid + 0.5 * np.einsum("ki,kij,kj->k", slip, apart, slip)
        rigid = rigid + 0.5 * ((shafts**2 - qd**2) @ (body.rotors - own))
    return np.asarray(rigid)
