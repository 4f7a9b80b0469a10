"""The two thermal nodes of a motor, winding and housing, from its data sheet."""

from __future__ import annotations

from dataclasses import dataclass

from drivetrain.arrays import checked_number
from drivetrain.drive.motor import Motor
from drivetrain.drive.ranges import NOT_NEGATIVE, POSITIVE, TEMPERATURE, range_faults
from drivetrain.drive.thermal.periodic_heat import thermal_nodes
from drivetrain.errors import raise_faults
from drivetrain.records import UNKNOWN, as_record, known


@dataclass(frozen=True)
class ThermalNetwork:
    """Thermal path from the winding over the housing to ambient.

    Attributes:
        resistance_winding_housing: Thermal resistance [K/W]; 0: winding and housing are one node.
        resistance_housing_ambient: Thermal resistance [K/W].
        winding_capacity: Heat capacity [J/K], of the whole motor if it is one node; None: unknown, so that only mean
            temperatures can be computed.
        housing_capacity: Heat capacity [J/K]; None: unknown, so that the housing stays at its mean temperature.
        ambient: Air temperature [C].
    """

    resistance_winding_housing: float
    resistance_housing_ambient: float
    winding_capacity: float | None
    housing_capacity: float | None
    ambient: float

    def __post_init__(self) -> None:
        ranges = {
            "resistance_winding_housing": NOT_NEGATIVE,
            "resistance_housing_ambient": POSITIVE,
            "winding_capacity": POSITIVE,
            "housing_capacity": POSITIVE,
            "ambient": TEMPERATURE,
        }
        needed = ("resistance_winding_housing", "resistance_housing_ambient", "ambient")
        raise_faults(range_faults("thermal network", self, ranges, required=needed))
        for name, value in vars(self).items():  # kernels are compiled for floats
            object.__setattr__(self, name, None if value is None else float(value))

    @property
    def winding_time_constant(self) -> float | None:
        """Time constant of the winding over the housing [s]; None if unknown."""
        resistance = self.resistance_winding_housing or self.resistance_housing_ambient
        return None if self.winding_capacity is None else resistance * self.winding_capacity


def thermal_network(motor: Motor, ambient: float, *, housing_to_ambient: float | None = None) -> ThermalNetwork | None:
    """The two thermal nodes of a motor, or one if its data sheet gives a single resistance from winding to ambient.

    Capacities are time constants over resistances of the data sheet, so another mounting changes the housing's time
    constant but not its capacity.

    Args:
        motor: Data sheet.
        ambient: Air temperature [C].
        housing_to_ambient: Thermal resistance of the real mounting, which replaces the data sheet's [K/W].

    Returns:
        The network; None if the resistances of the data sheet do not suffice.
    """
    mounting = UNKNOWN
    if housing_to_ambient is not None:
        mounting = checked_number(housing_to_ambient, "housing_to_ambient", "K/W", above=0.0)
    nodes = [float(value) if known(value) else None for value in thermal_nodes(as_record(motor), mounting)]
    inner, outer, winding, housing = nodes
    return None if inner is None or outer is None else ThermalNetwork(inner, outer, winding, housing, ambient)
