"""Catalogue folders: motors, gears and which of them fit each other."""

from __future__ import annotations

from dataclasses import dataclass, field

from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor


@dataclass(frozen=True, eq=False)
class Catalog:
    """The rows of one or more catalogue folders, in SI.

    Attributes:
        motors, gears: By key, in file order.
        pairs: Published combinations: gear keys by motor key.
        notes: Doubts and where the rows are from, for the report.
    """

    motors: dict[str, Motor] = field(default_factory=dict)
    gears: dict[str, Gear] = field(default_factory=dict)
    pairs: dict[str, frozenset[str]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
