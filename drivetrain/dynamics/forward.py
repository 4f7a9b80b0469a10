"""Forward dynamics: the accelerations that torques give, by solving with the mass matrix."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array
from drivetrain.dynamics.core.packed import packed
from drivetrain.dynamics.doors import finite_samples, run, tip_samples
from drivetrain.dynamics.mass_matrix import mass_matrices
from drivetrain.errors import Fault, InputError
from drivetrain.jit import kernel

# What is left of a joint's inertia, of its whole, when the joints before it are free to give way. Rounding leaves
# about 1e-15 of nothing.
SINGULAR = 1e-12


def forward_dynamics(arm: Arm, q: Any, qd: Any, tau: Any, *, tip_wrench: Any = None) -> Array:
    """The accelerations that generalised joint torques give.

    Args:
        arm: With rotors or without.
        q, qd: Positions and speeds [rad or m, and per s], (n,) or (N, n).
        tau: Generalised torques, ``ratio_i`` times the torque of motor i [N m; N at a prismatic joint], (n,) or (N, n).
        tip_wrench: What the end effector applies to the environment, in the tip frame, (moment [N m], force [N]),
            (6,) or (N, 6). None: nothing.

    Returns:
        Accelerations [rad/s^2 or m/s^2], (n,) or (N, n).

    Raises:
        InputError: Wrong shapes, a NaN or infinity, or a mass matrix that is singular: a joint that moves no inertia.

    Reference: Modern Robotics, equation 8.81.
    """
    positions, speeds, torques = finite_samples(arm.n, {"q": q, "qd": qd, "tau": tau})
    model = packed(arm)
    rest = np.zeros(positions.shape)
    bias = run(model, (positions, speeds, rest), tip=tip_samples(model, tip_wrench, len(positions)))
    accelerations = torques - bias
    matrices = mass_matrices(model, positions)
    sample, joint = _solve(matrices, accelerations)
    if joint >= 0:
        raise _singular(arm, sample, joint, np.ndim(q) == 2)
    return accelerations if np.ndim(q) == 2 else accelerations[0]


@kernel
def _solve(matrices: Array, vectors: Array) -> tuple[int, int]:
    """Replace vectors by solutions, and matrices by rubbish; sample and joint of the first that is singular, or -1."""
    n = matrices.shape[1]
    scale = np.empty(n)
    for sample in range(len(matrices)):
        a, b = matrices[sample], vectors[sample]
        for i in range(n):
            if not a[i, i] > 0.0:
                return sample, i
            scale[i] = 1.0 / math.sqrt(a[i, i])
        for i in range(n):
            for j in range(i + 1):
                total = a[i, j] * scale[i] * scale[j]
                for k in range(j):
                    total -= a[i, k] * a[j, k]
                if j < i:
                    a[i, j] = total / a[j, j]
                elif total > SINGULAR:
                    a[i, i] = math.sqrt(total)
                else:
                    return sample, i
        for i in range(n):
            total = b[i] * scale[i]
            for k in range(i):
                total -= a[i, k] * b[k]
            b[i] = total / a[i, i]
        for i in range(n - 1, -1, -1):
            total = b[i]
            for k in range(i + 1, n):
                total -= a[k, i] * b[k]
            b[i] = total / a[i, i]
        for i in range(n):
            b[i] *= scale[i]
    return -1, -1


def _singular(arm: Arm, sample: int, joint: int, many: bool) -> InputError:
    where = f" at sample {sample}" if many else ""
    problem = f"moves no inertia of its own{where}: the mass matrix is singular there, accelerations are not defined"
    hint = "give the links from this joint on mass and inertia, or the joint a rotor"
    return InputError(Fault(f"joint {arm.joint_names[joint]!r}", problem, None, hint))
