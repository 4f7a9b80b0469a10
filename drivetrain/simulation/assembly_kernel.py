"""The linear system of a step: mass matrix and bias, and the forces of joints, gears, motors and the tip."""

from __future__ import annotations

from typing import Any

from drivetrain.dynamics.compiled_vectors import part
from drivetrain.simulation import fields as f
from drivetrain.simulation.coupled_kernel import add_joints
from drivetrain.simulation.tip_kernel import add_tip
from drivetrain.simulation.vector_rows import row_of

STIFF_FROM = 1.5  # inertia with springs and dampers in it, over that without: a step no longer follows what they do


@part
def _bounds(n: Any, w: Any, i: int, m: int, ratio: float) -> bool:
    """The bounds of dry friction of a joint and its motor; whether there are any."""
    joints, taken = w[f.JOINTS], w[f.AT_SIGNALS] + w[f.ADDED_FROM] + i
    own, shaft = w[f.AT_LEVELS] + i * f.LEVELS, w[f.AT_LEVELS] + m * f.LEVELS
    backwards = 1 if ratio < 0.0 else 0
    joint, motor = 0.0, 0.0
    for j in range(4):
        level = n[taken + (f.JOINT_LEVELS + j) * joints]
        drag = abs(ratio) * n[taken + (f.MOTOR_LEVELS + j) * joints]
        n[own + j] = level
        n[shaft + f.MOTOR + (j ^ backwards)] = drag
        joint += level
        motor += drag
    driving, driven = n[taken + f.MESH_DRIVING * joints], n[taken + f.MESH_DRIVEN * joints]
    n[shaft + f.DRIVING] = driving
    n[shaft + f.DRIVEN] = driven
    motor += abs(driving) + abs(driven)
    n[own + f.ACTIVE] = 1.0 if joint > 0.0 else 0.0
    if motor > 0.0:
        n[shaft + f.ACTIVE] = 1.0
    elif m != i:
        n[shaft + f.ACTIVE] = 0.0
    return joint + motor > 0.0


@part
def _carried(n: Any, w: Any, h: float, i: int, soft: float, torque: float) -> None:
    """What the mesh of a rigid joint carries, and how that changes with the speeds."""
    c = w[f.COORDINATES]
    n[row_of(w, f.CARRIED) + i] = n[row_of(w, f.BIAS) + i] - n[row_of(w, f.TURNED_BIAS) + i] - torque
    rows, mass, turned = w[f.AT_CARRIED] + i * c, w[f.AT_SIGNALS] + w[f.AT_MASS] + i * c, w[f.AT_TURNED] + i * c
    for k in range(c):
        n[rows + k] = (n[mass + k] - n[turned + k]) / h
    n[rows + i] += soft


@part
def _spring(n: Any, w: Any, h: float, theta: float, i: int, m: int, late: float) -> None:
    """The spring of a flexible joint between its link i and its rotor m."""
    c, joints, taken = w[f.COORDINATES], w[f.JOINTS], w[f.AT_SIGNALS] + w[f.ADDED_FROM] + i
    matrix, right, rows = w[f.AT_MATRIX], row_of(w, f.RIGHT), w[f.AT_CARRIED] + m * c
    spring = n[taken + f.GEAR_DAMPING * joints] + theta * h * n[taken + f.GEAR_STIFFNESS * joints]
    gear, stiff = n[taken + f.GEAR_TORQUE * joints] - spring * late, theta * spring
    n[right + i] += h * gear
    n[right + m] -= h * gear
    n[matrix + i * c + i] += h * stiff
    n[matrix + m * c + m] += h * stiff
    n[matrix + i * c + m] -= h * stiff
    n[matrix + m * c + i] -= h * stiff
    n[row_of(w, f.CARRIED) + m] = gear
    for k in range(c):
        n[rows + k] = 0.0
    n[rows + m] = stiff
    n[rows + i] = -stiff


# long kernel: every kind of force of a joint, once
@part
def assemble(n: Any, w: Any, h: float, theta: float, asked: int) -> bool:
    """The linear system of the step, and the bounds of friction.

    Args:
        h: Step [s]; 1 at an instant.
    """
    joints, c, taken = w[f.JOINTS], w[f.COORDINATES], w[f.AT_SIGNALS] + w[f.ADDED_FROM]
    speeds, guess, right, bias = w[f.AT_STATE] + c, row_of(w, f.GUESS), row_of(w, f.RIGHT), row_of(w, f.BIAS)
    relative, surface, matrix, mass = row_of(w, f.RELATIVE), row_of(w, f.SURFACE), w[f.AT_MATRIX], w[f.AT_MASS]
    rubbing = False
    for i in range(c):
        n[right + i] = -h * n[bias + i]
        n[relative + i] = n[speeds + i]
    for k in range(c * c):
        n[matrix + k] = n[w[f.AT_SIGNALS] + mass + k]
    for i in range(joints):
        m, ratio, own = w[w[f.AT_MOTORS] + i], n[w[f.AT_RATIOS] + i], taken + i
        late, late_motor = n[guess + i] - n[speeds + i], n[guess + m] - n[speeds + m]
        kind = f.JOINT_TORQUE
        if w[f.COUPLED] and w[w[f.AT_BOUND] + i]:
            kind = f.SHAFT_TORQUE
        soft = n[own + (kind + 1) * joints] + theta * h * n[own + (kind + 2) * joints]
        torque = n[own + kind * joints] + soft * late
        n[right + i] += h * torque
        n[surface + i] = n[own + f.SURFACE_SPEED * joints]
        n[relative + i] -= n[surface + i]
        n[matrix + i * c + i] += theta * h * soft
        motor = n[own + f.MOTOR_DAMPING * joints] + theta * h * n[own + f.MOTOR_STIFFNESS * joints]
        motor *= ratio * ratio
        n[right + m] += h * (ratio * n[own + f.MOTOR_TORQUE * joints] + motor * late_motor)
        n[matrix + m * c + m] += theta * h * motor
        rubs = _bounds(n, w, i, m, ratio)
        rubbing = rubbing or rubs
        if m != i:
            late = n[asked + m] - n[asked + i] - (n[speeds + m] - n[speeds + i])
            _spring(n, w, h, theta, i, m, late)
        else:
            _carried(n, w, h, i, theta * soft, torque)
    if w[f.COUPLED]:
        add_joints(n, w, h, theta)
    if w[f.TIP]:
        add_tip(n, w, h, theta, asked)
    stiff = 0
    for i in range(c):
        if n[matrix + i * c + i] > STIFF_FROM * n[w[f.AT_SIGNALS] + mass + i * c + i]:
            stiff = 1
    w[f.STIFF] = stiff
    return rubbing
