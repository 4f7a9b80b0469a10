"""Coupled motors in the equations of motion: coordinates are turns of the shafts behind gears, not of the joints."""

from __future__ import annotations

from typing import Any

from drivetrain.dynamics.compiled_vectors import part
from drivetrain.dynamics.mass_and_bias import Places, mass_and_bias
from drivetrain.simulation import fields as f
from drivetrain.simulation.vector_rows import row_of


@part
def tell_joints(n: Any, w: Any) -> None:
    """Fill what the joints do when the shafts behind the gears do what has been told."""
    joints, s = w[f.JOINTS], w[f.AT_SIGNALS]
    guess, places, turns = row_of(w, f.GUESS), row_of(w, f.PLACES), w[f.AT_TURNS]
    for i in range(joints):
        if w[w[f.AT_BOUND] + i]:
            place, speed = 0.0, 0.0
            for k in range(joints):
                place += n[turns + i * joints + k] * n[places + k]
                speed += n[turns + i * joints + k] * n[guess + k]
            n[s + f.SHAFT_POSITION * joints + i] = n[places + i]
            n[s + f.SHAFT_SPEED * joints + i] = n[guess + i]
            n[s + f.POSITION * joints + i] = place
            n[s + f.SPEED * joints + i] = speed


# long kernel: products of matrices, written out
@part
def spread_bodies(n: Any, w: Any) -> None:
    """Mass matrix and bias of the bodies, along the coordinates."""
    joints, c, e, at = w[f.JOINTS], w[f.COORDINATES], w[f.BODIES], w[f.AT_BODIES]
    speeds, bias, felt_bias, mass = at + e, at + 2 * e, at + 3 * e, at + 4 * e
    turned, between, spread = mass + e * e, mass + 2 * e * e, w[f.AT_SPREAD]
    places, guess, to = row_of(w, f.PLACES), row_of(w, f.GUESS), w[f.AT_SIGNALS] + w[f.AT_MASS]
    for r in range(e):
        place, speed = 0.0, 0.0
        for k in range(c):
            place += n[spread + r * c + k] * n[places + k]
            speed += n[spread + r * c + k] * n[guess + k]
        n[at + r] = place
        n[speeds + r] = speed
    mass_and_bias(
        Places(
            joints, e, w[f.SPINS], w[f.AT_ROWS], w[f.AT_SPINS], at, speeds, w[f.AT_WORK], mass, turned, bias, felt_bias
        ),
        n, w,
    )  # fmt: skip
    for r in range(e):
        for k in range(c):
            entry = 0.0
            for j in range(e):
                entry += n[mass + r * e + j] * n[spread + j * c + k]
            n[between + r * c + k] = entry
    for i in range(c):
        value, row, factor = 0.0, w[w[f.AT_FELT] + i], n[w[f.AT_FACTORS] + i]
        for r in range(e):
            value += n[spread + r * c + i] * n[bias + r]
        n[row_of(w, f.BIAS) + i] = value
        n[row_of(w, f.TURNED_BIAS) + i] = factor * n[felt_bias + row] if row >= 0 else 0.0
        for k in range(c):
            whole, felt = 0.0, 0.0
            for r in range(e):
                whole += n[spread + r * c + i] * n[between + r * c + k]
                if row >= 0:
                    felt += n[turned + row * e + r] * n[spread + r * c + k]
            n[to + i * c + k] = whole
            n[w[f.AT_TURNED] + i * c + k] = factor * felt
        n[to + i * c + i] += n[w[f.AT_OWN] + i]
        n[w[f.AT_TURNED] + i * c + i] += n[w[f.AT_OWN] + i]


@part
def add_joints(n: Any, w: Any, h: float, theta: float) -> None:
    """Smooth torques at joints whose motors are coupled join the linear system of their shafts.

    Args:
        h: Step [s].
    """
    joints, c, taken = w[f.JOINTS], w[f.COORDINATES], w[f.AT_SIGNALS] + w[f.ADDED_FROM]
    speeds, guess, right = w[f.AT_STATE] + c, row_of(w, f.GUESS), row_of(w, f.RIGHT)
    for i in range(joints):
        if not w[w[f.AT_BOUND] + i]:
            continue
        own, turns = taken + i, w[f.AT_TURNS] + i * joints
        soft = n[own + f.JOINT_DAMPING * joints] + theta * h * n[own + f.JOINT_STIFFNESS * joints]
        torque = n[own + f.JOINT_TORQUE * joints]
        for k in range(joints):
            torque += soft * n[turns + k] * (n[guess + k] - n[speeds + k])
        for k in range(joints):
            if not w[w[f.AT_BOUND] + k]:
                continue
            n[right + k] += h * n[turns + k] * torque
            n[row_of(w, f.CARRIED) + k] -= n[turns + k] * torque
            for j in range(joints):
                entry = theta * soft * n[turns + k] * n[turns + j]
                n[w[f.AT_MATRIX] + k * c + j] += h * entry
                n[w[f.AT_CARRIED] + k * c + j] += entry
