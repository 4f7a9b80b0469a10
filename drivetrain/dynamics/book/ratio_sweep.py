"""The mass matrix over the gear ratio: with growing ratio it becomes diagonal and independent of the posture.

The coupling by the links is constant while the diagonal grows with the square of the ratio, so its share falls with
``ratio^-2``. The share of the coupling by the rotors, ``ratio * inertia``, falls only with ``ratio^-1``: at high ratios
the remaining coupling is that of the rotors, which does not depend on the posture.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array, axes_of, checked_array, finite_samples
from drivetrain.dynamics.mass import mass_matrix
from drivetrain.errors import Fault, InputError, raise_faults


@dataclass(frozen=True, eq=False)
class RatioSweep:
    """Coupling and variation of the mass matrix of an arm at R gear ratios over N postures.

    Attributes:
        ratios: Magnitudes, one for all joints [- or rad/m], (R,).
        coupling: Largest coupling of two joints at each posture [-], (R, N); see ``coupling``.
        variation: Variation of each joint's inertia M_ii over the postures, largest minus smallest over their mean [-],
            (R, n).
    """

    ratios: Array
    coupling: Array
    variation: Array


def with_ratio(arm: Arm, ratio: float) -> Arm:
    """The arm with the same gear ratio at every joint that has a rotor; rotors and signs of the ratios are kept."""
    size = float(checked_array(ratio, (), "ratio"))
    faults = [] if size > 0.0 else [Fault("ratio", "must be positive", size)]
    if all(rotor is None for rotor in arm.rotors):
        faults.append(Fault("arm", "has no rotors whose ratio could change", arm.name, "see with_rotors"))
    raise_faults(faults)
    turned = (None if r is None else replace(r, ratio=float(np.copysign(size, r.ratio))) for r in arm.rotors)
    return replace(arm, rotors=tuple(turned))


def coupling(matrix: Any) -> Array:
    """Measure of the off-diagonal part of a mass matrix: the largest ``|M_ij|/sqrt(M_ii M_jj)``, 0 to 1, () or (N,)."""
    shape = (None, None) if axes_of(matrix) == 2 else (None, None, None)
    values = checked_array(matrix, shape, "matrix")
    if values.shape[-1] != values.shape[-2]:
        raise InputError(Fault("matrix", "must be square", f"shape {values.shape}"))
    diagonal = np.diagonal(values, axis1=-2, axis2=-1)
    if not (diagonal > 0.0).all():
        raise InputError(Fault("matrix", "must have a positive diagonal", float(diagonal.min())))
    scale = 1.0 / np.sqrt(diagonal)
    shares = np.abs(values) * scale[..., :, None] * scale[..., None, :]
    others = ~np.eye(values.shape[-1], dtype=bool)
    return np.asarray(np.max(shares, axis=(-2, -1), where=others, initial=0.0))


def sweep_ratio(arm: Arm, q: Any, ratios: Any) -> RatioSweep:
    """Coupling and variation of the mass matrix at several gear ratios.

    For the book's 2R arm, unit masses, lengths and motors, rotors of 0.00125 kg m^2, stators of 0.005 kg m^2, the mass
    matrix is exactly ``[[4.13125 + 2c, 1.0125 + c], [1.0125 + c, 1.125]]`` at ratio 10 and
    ``[[16.50625 + 2c, 1.125 + c], [1.125 + c, 13.5]]`` at ratio 100, c the cosine of theta_2. The book prints three
    digits, and so 1.13 for both of the 1.125.

    Args:
        arm: With rotors.
        q: Postures [rad or m], (N, n).
        ratios: Magnitudes, each used for all joints [- or rad/m], (R,), positive.

    Returns:
        The sweep.

    Raises:
        InputError: Wrong shapes, a NaN or infinity, ratios that are not positive, an arm without rotors.

    Reference: Modern Robotics, section 8.9.2.
    """
    values = checked_array(ratios, (None,), "ratios")
    if axes_of(q) != 2 or not len(q):
        raise InputError(Fault("q", f"must be at least one posture, shape (N, {arm.n})", q))
    (postures,) = finite_samples(arm.n, {"q": q})
    coupled = np.empty((len(values), len(postures)))
    variation = np.empty((len(values), arm.n))
    for row, ratio in enumerate(values):
        matrices = mass_matrix(with_ratio(arm, ratio), postures)
        coupled[row] = coupling(matrices)
        diagonal = np.diagonal(matrices, axis1=1, axis2=2)
        variation[row] = np.ptp(diagonal, axis=0) / diagonal.mean(axis=0)
    return RatioSweep(values, coupled, variation)
