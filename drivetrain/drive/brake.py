"""The holding brake: data sheet in SI, holding torque, and heat of a stop."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from drivetrain.drive.ranges import NOT_NEGATIVE, POSITIVE, range_faults
from drivetrain.errors import Fault, nearest, raise_faults
from drivetrain.jit import law
from drivetrain.notebook import DataSheet

BRAKE_KINDS = ("spring", "permanent_magnet")
BRAKE_SIDES = ("motor", "output")

_POSITIVE = ("static_torque", "voltage", "power", "current", "mass", "energy_per_stop", "energy_per_hour")
_NOT_NEGATIVE = ("inertia", "release_time", "engage_time", "backlash", "price")
_RANGES = {**dict.fromkeys(_POSITIVE, POSITIVE), **dict.fromkeys(_NOT_NEGATIVE, NOT_NEGATIVE)}


@dataclass(frozen=True, repr=False)
class Brake(DataSheet):
    """A holding brake's data sheet; None if the data sheet gives no value (unknown is never zero).

    Attributes:
        key: Unique name in the catalogue.
        torque_side: Side on which the torque acts: ``motor``, before the gear, or ``output``.
        maker, series, part_number: As printed.
        kind: ``spring`` or ``permanent_magnet``; empty: not stated.
        static_torque: Static holding torque, on the brake's side [N m].
        voltage: Coil voltage [V].
        power, current: Power and current that keep the brake open [W], [A].
        inertia: Inertia that the brake adds to its shaft [kg m^2].
        mass: Mass [kg].
        release_time, engage_time: Time from switching the coil on until the brake is open, and from switching it off
            until it acts [s].
        energy_per_stop, energy_per_hour: Largest heat of one stop, and of all stops of an hour [J].
        backlash: Total backlash of the hub, on the brake's side [rad].
        price: In the user's currency; empty in the shipped catalogue.
        source: File and row, sheet, edition: what a report prints.
    """

    key: str
    torque_side: str
    maker: str = ""
    series: str = ""
    part_number: str = ""
    kind: str = ""
    static_torque: float | None = None
    voltage: float | None = None
    power: float | None = None
    current: float | None = None
    inertia: float | None = None
    mass: float | None = None
    release_time: float | None = None
    engage_time: float | None = None
    energy_per_stop: float | None = None
    energy_per_hour: float | None = None
    backlash: float | None = None
    price: float | None = None
    source: str = ""

    def __post_init__(self) -> None:
        owner = f"brake {self.key}"
        faults = range_faults(owner, self, _RANGES)
        for name, known in (("torque_side", BRAKE_SIDES), ("kind", ("", *BRAKE_KINDS))):
            value = getattr(self, name)
            if value not in known:
                faults.append(
                    Fault(f"{owner}.{name}", "must be one of " + ", ".join(known), value, nearest(str(value), known))
                )
        raise_faults(faults)


LEAST_ENERGY = 26.0
"""Smallest permitted heat of a stop over static torque [J/(N m)]: 26.7 to 104 in the three shipped brakes that print
both.
"""

NO_BRAKE = Brake("", "motor")
"""The brake of a motor without a brake."""


@law
def holding_torque(gear_torque: Any, ratio: Any) -> Any:
    """Torque at the motor's shaft that holds a torque at the gear's output, without help of the mesh [N m]."""
    return abs(gear_torque / ratio)


@law
def stopping_energy(torque: Any, load: Any, inertia: Any, speed: Any) -> Any:
    """Heat in a brake after a stop while the load drives on, J w^2/2 T/(T - T_load) [J]; all values at the brake's
    shaft.

    The load's work until standstill is its torque times the same angle; gear losses, which help, are neglected.
    Infinite if the brake does not stop the load.
    """
    return math.inf if torque <= load else 0.5 * inertia * speed * speed * torque / (torque - load)
