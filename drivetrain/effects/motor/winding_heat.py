"""Temperatures of winding and housing: states of engines that control their error, on a clock of their own in others.

In fixed steps losses are gathered over a share of the winding's time constant, then both nodes take one exact step
under their mean.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.ranges import TEMPERATURE, Range
from drivetrain.drive.thermal.thermal_network import ThermalNetwork
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports, State, TimeScale
from drivetrain.effects.fields import positive, ranges
from drivetrain.effects.laws import joint_law
from drivetrain.errors import Fault
from drivetrain.jit import law

SHARE = 0.005  # of the winding's time constant, between two steps
MOST = 0.2  # K that losses may bring to a node between two steps, whose resistance and torque constant else would jump


@dataclass
class Own:
    """What it keeps."""

    # between two steps of the temperatures, at most [s], [J]
    period: float
    most_copper: float
    most_iron: float
    gear_heat: float  # share of the gear's loss that warms the housing [-]
    # [C], thermal resistances [K/W]
    ambient: float
    inner: float
    outer: float
    # of both nodes: rises are modes times what decays [1/s]
    modes: Annotated[Array, 4]
    inverse: Annotated[Array, 4]
    decay: Annotated[Array, 2]
    # [C]
    winding_temperature: float = 0.0
    winding_temperature_rate: float = 0.0
    housing_temperature: float = 0.0
    housing_temperature_rate: float = 0.0
    # losses gathered since the last step [J], for so long [s]
    copper: float = 0.0
    iron: float = 0.0
    clock: float = 0.0


@law
def _off(own: Any, p: float, q: float) -> tuple[float, float, float, float]:
    """Where losses p and q [W] would bring both nodes, and how far these are from there along the two exponentials."""
    inverse = own.inverse
    end_h = own.ambient + own.outer * (p + q)
    end_w = own.ambient + own.inner * p + own.outer * (p + q)
    a, b = own.winding_temperature - end_w, own.housing_temperature - end_h
    return end_w, end_h, inverse[0] * a + inverse[1] * b, inverse[2] * a + inverse[3] * b


@law
def warmed(own: Any) -> tuple[float, float]:
    """Both temperatures after the time gathered, under the mean losses gathered in it."""
    if own.clock == 0.0:
        return own.winding_temperature, own.housing_temperature
    modes = own.modes
    end_w, end_h, u, v = _off(own, own.copper / own.clock, own.iron / own.clock)
    u *= math.exp(own.decay[0] * own.clock)
    v *= math.exp(own.decay[1] * own.clock)
    return end_w + modes[0] * u + modes[1] * v, end_h + modes[2] * u + modes[3] * v


@law
def _into_housing(own: Any, joint: Any) -> float:
    """Friction at the motor's shaft, of the gear's drag and mesh their share [W]."""
    heat = joint.heat
    gear = own.gear_heat * joint.mesh.power if own.gear_heat > 0.0 else 0.0
    return joint.motor.friction_power + heat.viscous_power - (1.0 - own.gear_heat) * heat.drag_power + gear


@joint_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any) -> None:
    if own.gear_heat > 0.0:
        joint.heat.gear = joint.heat.housing


@joint_law(Own)
def _account(t: Any, h: Any, own: Any, joint: Any) -> None:
    heat, modes = joint.heat, own.modes
    if h > 0.0:
        return
    _, _, u, v = _off(own, heat.copper_loss, _into_housing(own, joint))
    u *= own.decay[0]
    v *= own.decay[1]
    own.winding_temperature_rate, own.housing_temperature_rate = (
        modes[0] * u + modes[1] * v,
        modes[2] * u + modes[3] * v,
    )
    # What is recorded does not wait for the next step of the temperatures.
    heat.winding, heat.housing = warmed(own)


@joint_law(Own)
def _accept(t: Any, h: Any, own: Any, joint: Any) -> None:
    heat = joint.heat
    own.winding_temperature_rate = own.housing_temperature_rate = 0.0  # it moves by steps of its own
    own.copper += h * heat.copper_loss
    own.iron += h * _into_housing(own, joint)
    own.clock += h
    little = own.copper < own.most_copper and own.iron < own.most_iron
    if little and own.clock < own.period * (1.0 - 1e-9):
        return
    own.winding_temperature, own.housing_temperature = warmed(own)
    own.copper = own.iron = own.clock = 0.0


@dataclass(frozen=True)
class WindingHeat(Effect):
    """Thermal model with two nodes, heated by copper loss, friction at the motor's shaft and part of the gear's loss.

    A gear that warms the housing is as warm as that.

    Attributes:
        network: Resistances and capacities; the winding's must be known.
        winding, housing: Temperatures at the start [C]; None: those of the air.
        every: Longest time between two steps of the temperatures under fixed steps [s]; None: a two-hundredth of the
            winding's time constant. Losses that would warm a node by more than 0.2 K in it make it shorter.
        gear_heat: Share of the gear's loss that warms the housing; 0: the gear is mounted elsewhere [-].
    """

    network: ThermalNetwork
    winding: float | None = None
    housing: float | None = None
    every: float | None = None
    gear_heat: float = 0.0

    limits = ranges(
        winding=TEMPERATURE, housing=TEMPERATURE, every=positive("s"),
        gear_heat=Range("must be between 0 and 1 [-]", 0.0, 1.0, low_included=True),
    )  # fmt: skip
    compute = _compute
    account = _account
    accept = _accept

    def faults(self) -> list[Fault]:
        if self.network.winding_capacity is not None:
            return []
        hint = "state one, or use mean temperatures only"
        return [Fault("WindingHeat.network", "has no winding time constant", None, hint)]

    def ports(self, place: Place) -> Ports:
        return Ports(
            states=(
                State("winding_temperature", "C", 1e-3, late=True),
                State("housing_temperature", "C", 1e-3, late=True),
                State("gathered_copper_loss", "J", 1.0, memory=True, path="copper"),
                State("gathered_housing_loss", "J", 1.0, memory=True, path="iron"),
                State("gathered_time", "s", 1.0, memory=True, path="clock"),
            ),
            needs=(
                replace(s.COPPER_LOSS, default=0.0), s.MOTOR_FRICTION_POWER,
                replace(s.MOTOR_VISCOUS_POWER, default=0.0), replace(s.GEAR_DRAG_POWER, default=0.0),
                s.WINDING_TEMPERATURE, s.HOUSING_TEMPERATURE, *((s.MESH_POWER,) if self.gear_heat > 0.0 else ()),
            ),
            provides=(s.GEAR_TEMPERATURE,) if self.gear_heat > 0.0 else (),
        )  # fmt: skip

    def own(self, place: Place) -> Own:
        net = self.network
        modes: Any
        inverse: Any
        decay: Any
        inner, outer = net.resistance_winding_housing, net.resistance_housing_ambient
        if inner == 0.0:
            modes = inverse = np.eye(2)
            decay = np.full(2, -1.0 / (outer * (net.winding_capacity or 1.0)))
        else:
            first, second = 1.0 / (net.winding_capacity or math.inf), 1.0 / (net.housing_capacity or math.inf)
            flow = np.array([[-first / inner, first / inner], [second / inner, -second / inner - second / outer]])
            decay, modes = (part.real for part in np.linalg.eig(flow))  # real; numpy from 2.5 on types them complex
            inverse = np.linalg.inv(modes)
        period = self.every or SHARE * (net.winding_time_constant or 1.0)
        winding = net.winding_capacity or math.inf
        most = MOST * winding, MOST * (winding if inner == 0.0 else net.housing_capacity or math.inf)
        return Own(period, *most, self.gear_heat, net.ambient, inner, outer, modes.ravel(), inverse.ravel(), decay)

    def start(self, place: Place, signals: Mapping[str, float]) -> Sequence[float]:
        ambient = self.network.ambient
        first = ambient if self.winding is None else self.winding
        second = ambient if self.housing is None else self.housing
        return first, second, 0.0, 0.0, 0.0

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        return (TimeScale("winding warms", self.network.winding_time_constant or math.inf),)
