"""The two thermal nodes of a motor, winding and housing, from its sheet."""

from __future__ import annotations

from dataclasses import dataclass

from drivetrain.drive.motor import Motor
from drivetrain.drive.motor_limits import thermal_resistances
from drivetrain.drive.ranges import NOT_NEGATIVE, POSITIVE, TEMPERATURE, range_faults
from drivetrain.errors import InputError


@dataclass(frozen=True)
class ThermalNetwork:
    """The way of the heat from the winding over the housing to the air.

    Attributes:
        resistance_winding_housing: [K/W]; 0: winding and housing are one node.
        resistance_housing_ambient: [K/W].
        winding_capacity: [J/K]; of the whole motor when it is one node; None: unknown, so only means can be told.
        housing_capacity: [J/K]; None: unknown, so the housing rests at its mean.
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
        faults = range_faults("thermal network", self, ranges, required=needed)
        if faults:
            raise InputError(faults)

    @property
    def winding_time_constant(self) -> float | None:
        """How fast the winding follows its loss [s]; None when unknown."""
        resistance = self.resistance_winding_housing or self.resistance_housing_ambient
        return None if self.winding_capacity is None else resistance * self.winding_capacity


def thermal_network(motor: Motor, ambient: float, *, housing_to_ambient: float | None = None) -> ThermalNetwork | None:
    """The two thermal nodes of a motor, or one where its sheet prints one resistance from winding to ambient.

    Capacities are time constants over resistances of the sheet, so another mounting changes the housing's time
    constant and not its capacity.

    Args:
        motor: The sheet.
        ambient: Air temperature [C].
        housing_to_ambient: Replaces the sheet's thermal resistance, for the real mounting [K/W].

    Returns:
        The network; None when the sheet's resistances do not say enough.

    Reference:
        C_w = tau_w / R_th1, C_h = tau_h / R_th2.
    """
    resistances = thermal_resistances(motor, housing_to_ambient)
    if resistances is None:
        return None
    inner, outer = resistances
    if inner == 0.0:
        constant = motor.winding_time_constant or motor.housing_time_constant
        return ThermalNetwork(0.0, outer, None if constant is None else constant / outer, None, ambient)
    winding = None if motor.winding_time_constant is None else motor.winding_time_constant / inner
    printed = thermal_resistances(motor)
    printed_outer = outer if printed is None else printed[1]
    housing = None if motor.housing_time_constant is None else motor.housing_time_constant / printed_outer
    return ThermalNetwork(inner, outer, winding, housing, ambient)
