"""Temperatures of winding and housing: states of the adaptive engine; with fixed steps they have a longer step.

With fixed steps the losses are summed over a share of the winding's time constant; then both nodes advance by one exact
step with the mean losses.
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
from drivetrain.effects.fields import not_negative, positive, ranges
from drivetrain.effects.laws import joint_law
from drivetrain.errors import Fault
from drivetrain.jit import law

STEP_SHARE = 0.005  # step of the temperatures, over the winding's time constant
# Largest heating of a node by its losses between two steps [K]: a larger one would make resistance and torque constant
# jump.
MOST_HEATING = 0.2


@dataclass
class Own:
    # limits between two steps of the temperatures: time [s], losses of winding and housing [J]
    period: float
    most_copper: float
    most_iron: float
    gear_heat: float  # share of the gear's loss that heats the housing [-]
    constant_loss: float  # of a brake's coil and an amplifier, in the housing [W]
    ambient: float  # [C]
    # thermal resistances winding to housing, and housing to ambient [K/W]
    inner: float
    outer: float
    # eigenvectors of the two-node network (2, 2), their inverse, and the eigenvalues [1/s]
    modes: Annotated[Array, 4]
    inverse: Annotated[Array, 4]
    decay: Annotated[Array, 2]
    # states [C], and their rates [C/s]
    winding_temperature: float = 0.0
    winding_temperature_rate: float = 0.0
    housing_temperature: float = 0.0
    housing_temperature_rate: float = 0.0
    # losses of winding and housing since the last step of the temperatures [J], time since then [s]
    copper: float = 0.0
    iron: float = 0.0
    clock: float = 0.0


@law
def _modal_deviation(own: Any, p: float, q: float) -> tuple[float, float, float, float]:
    """Steady-state temperatures under constant losses, and the deviation from them in modal coordinates.

    ``p`` and ``q`` are the losses of winding and housing [W]. Returns the steady state of both nodes [C], and the two
    modal coordinates [K].
    """
    inverse = own.inverse
    end_h = own.ambient + own.outer * (p + q)
    end_w = own.ambient + own.inner * p + own.outer * (p + q)
    a, b = own.winding_temperature - end_w, own.housing_temperature - end_h
    return end_w, end_h, inverse[0] * a + inverse[1] * b, inverse[2] * a + inverse[3] * b


@law
def warmed(own: Any) -> tuple[float, float]:
    """Both temperatures now [C]: an exact step since the last one, with the mean of the losses since then."""
    if own.clock == 0.0:
        return own.winding_temperature, own.housing_temperature
    modes = own.modes
    end_w, end_h, u, v = _modal_deviation(own, own.copper / own.clock, own.iron / own.clock)
    u *= math.exp(own.decay[0] * own.clock)
    v *= math.exp(own.decay[1] * own.clock)
    return end_w + modes[0] * u + modes[1] * v, end_h + modes[2] * u + modes[3] * v


@law
def _housing_loss(own: Any, joint: Any) -> float:
    """Losses that heat the housing [W]: friction at the shaft, drag and mesh loss by the gear's share, constant."""
    heat = joint.heat
    gear = own.gear_heat * joint.mesh.power if own.gear_heat > 0.0 else 0.0
    own_loss = joint.motor.friction_power + heat.viscous_power + own.constant_loss
    return own_loss - (1.0 - own.gear_heat) * heat.drag_power + gear


@joint_law(Own)
def _compute(t: Any, h: Any, own: Any, joint: Any) -> None:
    """Provide the temperature of a gear that heats the housing."""
    if own.gear_heat > 0.0:
        joint.heat.gear = joint.heat.housing


@joint_law(Own)
def _account(t: Any, h: Any, own: Any, joint: Any) -> None:
    """Rates of both temperatures at an instant, and the temperatures to be recorded."""
    heat, modes = joint.heat, own.modes
    if h > 0.0:
        return
    _, _, u, v = _modal_deviation(own, heat.copper_loss, _housing_loss(own, joint))
    u *= own.decay[0]
    v *= own.decay[1]
    own.winding_temperature_rate, own.housing_temperature_rate = (
        modes[0] * u + modes[1] * v,
        modes[2] * u + modes[3] * v,
    )
    # Recorded temperatures include the time since the last step of the temperatures.
    heat.winding, heat.housing = warmed(own)


@joint_law(Own)
def _accept(t: Any, h: Any, own: Any, joint: Any) -> None:
    """Sum the losses of a fixed step, and advance the temperatures when their own step is over."""
    heat = joint.heat
    own.winding_temperature_rate = own.housing_temperature_rate = 0.0  # changed below, not by the engine
    own.copper += h * heat.copper_loss
    own.iron += h * _housing_loss(own, joint)
    own.clock += h
    below_limits = own.copper < own.most_copper and own.iron < own.most_iron
    if below_limits and own.clock < own.period * (1.0 - 1e-9):
        return
    own.winding_temperature, own.housing_temperature = warmed(own)
    own.copper = own.iron = own.clock = 0.0


@dataclass(frozen=True)
class WindingHeat(Effect):
    """Thermal model with two nodes, heated by copper loss, friction at the motor's shaft and part of the gear's loss.

    A gear that heats the housing has the temperature of the housing.

    Attributes:
        network: Thermal resistances and capacities; the winding's capacity must be known.
        winding, housing: Initial temperatures [C]; None: the ambient temperature.
        every: Longest time between two steps of the temperatures with fixed steps [s]; None: a two-hundredth of the
            winding's time constant. It is shortened where losses would heat a node by more than 0.2 K in this time.
        gear_heat: Share of the gear's loss that heats the housing; 0: the gear is mounted elsewhere [-].
        constant_loss: Further loss in the housing, such as that of a holding brake's coil [W].
    """

    network: ThermalNetwork
    winding: float | None = None
    housing: float | None = None
    every: float | None = None
    gear_heat: float = 0.0
    constant_loss: float = 0.0

    limits = ranges(
        winding=TEMPERATURE, housing=TEMPERATURE, every=positive("s"),
        gear_heat=Range("must be between 0 and 1 [-]", 0.0, 1.0, low_included=True),
        constant_loss=not_negative("W"),
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
        period = self.every or STEP_SHARE * (net.winding_time_constant or 1.0)
        winding = net.winding_capacity or math.inf
        most = MOST_HEATING * winding, MOST_HEATING * (winding if inner == 0.0 else net.housing_capacity or math.inf)
        heats = self.gear_heat, self.constant_loss
        return Own(period, *most, *heats, net.ambient, inner, outer, modes.ravel(), inverse.ravel(), decay)

    def start(self, place: Place, signals: Mapping[str, float]) -> Sequence[float]:
        ambient = self.network.ambient
        first = ambient if self.winding is None else self.winding
        second = ambient if self.housing is None else self.housing
        return first, second, 0.0, 0.0, 0.0

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        return (TimeScale("winding warms", self.network.winding_time_constant or math.inf),)
