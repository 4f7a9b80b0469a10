"""What the reflected-inertia shortcut leaves out of the mass matrix."""

from __future__ import annotations

import numpy as np
from hard_case import Figure, hard_case

from drivetrain.arm.arm import Arm
from drivetrain.arm.geared import at_level, with_rotors
from drivetrain.arm.rotors import Rotor, RotorLevel
from drivetrain.dynamics.mass import mass_matrix

ANGLE = 1.0
# Printed on p. 311 without the terms in the cosine; the last digit of each is rounded (1.125 to 1.13).
PRINTED = {10.0: [[4.13, 1.01], [1.01, 1.13]], 100.0: [[16.5, 1.13], [1.13, 13.5]]}
DIGITS = {10.0: [[2, 2], [2, 2]], 100.0: [[1, 2], [2, 1]]}


def book_arm(ratio: float) -> Arm:
    """Unit links and masses; motors of 1 kg, stators of 0.005, rotors of 0.00125 kg m^2, masses with the stators."""
    home = np.tile(np.eye(4), (2, 1, 1))
    home[:, 0, 3] = [1.0, 2.0]
    screws = [[0, 0, 1, 0, 0, 0], [0, 0, 1, 0, -1, 0]]
    inertias = [np.diag([0.0025, 0.0025, 0.005]), np.zeros((3, 3))]
    bare = Arm.from_screws(home, screws, [2.0, 1.0], inertias, joint_points=[[0, 0, 0], [1, 0, 0]])
    return with_rotors(bare, [Rotor(ratio, 0.00125)] * 2)


def wrong_entries(level: RotorLevel) -> float:
    """Printed entries that are missed by more than half a unit of their last digit."""
    cosine = np.cos(ANGLE)
    wrong = 0
    for ratio, printed in PRINTED.items():
        found = mass_matrix(at_level(book_arm(ratio), level), (0.3, ANGLE)) - [[2 * cosine, cosine], [cosine, 0.0]]
        half = 0.5 * 10.0 ** -np.array(DIGITS[ratio], dtype=float)
        wrong += int((np.abs(found - printed) > half + 1e-12).sum())
    return float(wrong)


@hard_case(
    "T26",
    "Rotors that couple joints",
    setup="The 2R arm with ratios 10 and 100 of Modern Robotics, p. 311.",
    naive="ratio² · rotor inertia on the diagonal of the mass matrix",
)
def test_book_matrices() -> list[Figure]:
    return [
        Figure(
            "printed entries not reproduced, of 8",
            ours=wrong_entries(RotorLevel.FULL),
            naive=wrong_entries(RotorLevel.REFLECTED),
            at_most=0.0,
        )
    ]
