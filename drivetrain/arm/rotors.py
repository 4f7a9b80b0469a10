"""Rotors as bodies: what spins behind a gear, and which link carries it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from drivetrain.arrays import Array


class RotorLevel(StrEnum):
    """How much of the rotors' motion the dynamics counts.

    NONE: rotors ride along, locked to their carriers. REFLECTED: as NONE, plus ``ratio^2 * axial inertia`` on the
    diagonal, the usual shortcut. FULL: rotors are bodies (Modern Robotics, equations 8.103 to 8.111).
    """

    NONE = "none"
    REFLECTED = "reflected"
    FULL = "full"
