"""What follows once the change of speeds is known: true motion of the middle, friction of each part, its powers."""

from __future__ import annotations

import math
from typing import Any

from drivetrain.dynamics.compiled_vectors import dot, get, part
from drivetrain.dynamics.mass_and_bias import ACCEL, BODY, COLUMNS
from drivetrain.simulation import fields as f
from drivetrain.simulation.equations_kernel import tell_motion
from drivetrain.simulation.vector_rows import row_of


@part
def tell_energies(n: Any, w: Any) -> None:
    """Kinetic and potential energy at an instant."""
    c, s, links = w[f.COORDINATES], w[f.AT_SIGNALS], w[f.JOINTS]
    mass, speeds = s + w[f.AT_MASS], w[f.AT_STATE] + c
    kinetic, potential = 0.0, 0.0
    for i in range(c):
        for k in range(c):
            kinetic += 0.5 * n[speeds + i] * n[mass + i * c + k] * n[speeds + k]
    if w[f.KIND] == f.ARM:
        # All that the first link carries has been gathered in its row; what the base carries stands in rows of its own.
        base = w[f.AT_WORK] + (w[f.AT_WORK_ROWS] - 1) * COLUMNS
        potential = dot(get(n, base + ACCEL + 3), get(n, w[f.AT_WORK] + BODY + 1))
        for r in range(w[f.SPINS]):
            if w[w[f.AT_SPINS] + 3 * r + 1] < 0 and w[w[f.AT_SPINS] + 3 * r + 2] == 0:
                potential += dot(get(n, base + ACCEL + 3), get(n, w[f.AT_WORK] + (links + r) * COLUMNS + BODY + 1))
    else:
        constant, places = w[f.AT_CONSTANT], row_of(w, f.PLACES)
        for i in range(c):
            weight = n[constant + f.WEIGHT * c + i]
            potential += weight * math.sin(n[places + i] + n[constant + f.PHASE * c + i])
    n[s + w[f.AT_ENERGY_SIGNALS]] = kinetic
    n[s + w[f.AT_ENERGY_SIGNALS] + 1] = potential


# long kernel: every force that is known only now, once
@part
def tell_forces(n: Any, w: Any, h: float, theta: float, shift: float) -> None:
    """Fill the signals of motion at the true middle, and those that follow from the solution.

    Args:
        h: Step [s]; 1 at an instant.
        shift: Time from the states to the middle [s].
    """
    joints, c, s = w[f.JOINTS], w[f.COORDINATES], w[f.AT_SIGNALS]
    change, guess, right = row_of(w, f.CHANGE), row_of(w, f.GUESS), row_of(w, f.RIGHT)
    speeds, friction, matrix = w[f.AT_STATE] + c, row_of(w, f.FRICTION), w[f.AT_MATRIX]
    for i in range(c):
        n[guess + i] = n[speeds + i] + theta * n[change + i]
        force = 0.0
        if n[w[f.AT_LEVELS] + i * f.LEVELS + f.ACTIVE] != 0.0:
            force = n[right + i]
            for k in range(c):
                force -= n[matrix + i * c + k] * n[change + k]
            force /= h
        n[friction + i] = force
    tell_motion(n, w, shift)
    for i in range(joints):
        m, ratio, own = w[w[f.AT_MOTORS] + i], n[w[f.AT_RATIOS] + i], s + i
        load, rows = n[row_of(w, f.CARRIED) + m], w[f.AT_CARRIED] + m * c
        for k in range(c):
            load += n[rows + k] * n[change + k]
        joint, motor = _split(n, w, i, m, load)
        mesh = n[friction + m] - motor
        if m == i:
            mesh -= joint
            load += joint
        n[own + f.ACCELERATION * joints] = n[change + i] / h
        if w[f.COUPLED] and w[w[f.AT_BOUND] + i]:
            turned = 0.0
            for k in range(joints):
                turned += n[w[f.AT_TURNS] + i * joints + k] * n[change + k]
            n[own + f.ACCELERATION * joints] = turned / h
        n[own + f.MOTOR_ACCELERATION * joints] = ratio * n[change + m] / h
        n[own + f.JOINT_FRICTION * joints] = joint
        n[own + f.MOTOR_FRICTION * joints] = motor / ratio
        n[own + f.MESH_TORQUE * joints] = load
        n[own + f.MESH_LOSS * joints] = mesh
        n[own + f.JOINT_FRICTION_POWER * joints] = joint * (n[guess + i] - n[row_of(w, f.SURFACE) + i])
        n[own + f.MOTOR_FRICTION_POWER * joints] = motor * n[guess + m]
        n[own + f.MESH_POWER * joints] = mesh * n[guess + m]


@part
def _split(n: Any, w: Any, i: int, m: int, load: float) -> tuple[float, float]:
    """Friction of joint and of motor (both counted at the joint) from what they are together with the mesh.

    Sliding, each is at its bound. Stuck, only the sum is known, and each takes a share as large as its bound.
    """
    friction, level = row_of(w, f.FRICTION), w[f.AT_LEVELS] + m * f.LEVELS
    mode = w[w[f.AT_MODES] + m]
    back = 0 if mode > 0 else 1
    motor = mode * n[level + f.MOTOR + f.SLIDE + back]
    if mode == 0:
        motor = _share(n, n[friction + m], level, f.MOTOR, load)
    if m != i:
        return n[friction + i], motor
    joint = mode * n[level + f.SLIDE + back]
    if mode == 0:
        joint = _share(n, n[friction + m], level, 0, load)
    return joint, motor


@part
def _share(n: Any, total: float, level: int, which: int, load: float) -> float:
    """The share of stuck friction that one of its bounds takes."""
    back = 0 if total > 0.0 else 1
    mesh = max(n[level + f.DRIVING], n[level + f.DRIVEN]) * abs(load)
    bound = n[level + f.HOLD + back] + n[level + f.MOTOR + f.HOLD + back] + mesh
    return total * n[level + which + back] / bound if bound > 0.0 else 0.0
