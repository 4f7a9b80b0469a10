"""Temperatures of winding and housing, on a clock of their own: never integrated with what is fast.

Losses are gathered over a share of the winding's time constant, then both nodes take one exact step under their mean.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drivetrain.drive.thermal_network import ThermalNetwork
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Compiled, Effect, Place, Ports, State, TimeScale
from drivetrain.effects.estimate import Conditions, Estimate
from drivetrain.errors import Fault, InputError
from drivetrain.jit import law

SHARE = 0.005  # of the winding's time constant, between two steps


@law
def _warmed(x: Any, numbers: Any, words: Any, row: int) -> tuple[float, float]:
    """Both temperatures after the time gathered, under the mean losses gathered in it."""
    at, winding, housing, clock = words[row], x[words[row + 1]], x[words[row + 2]], x[words[row + 5]]
    if clock == 0.0:
        return winding, housing
    # Rises over the state that these mean losses would reach decay along two exponentials.
    p, q, ambient = x[words[row + 3]] / clock, x[words[row + 4]] / clock, numbers[at + 1]
    end_w = ambient + numbers[at + 2] * p + numbers[at + 3] * (p + q)
    end_h = ambient + numbers[at + 3] * (p + q)
    a, b = winding - end_w, housing - end_h
    u = numbers[at + 8] * a + numbers[at + 9] * b
    v = numbers[at + 10] * a + numbers[at + 11] * b
    u *= math.exp(numbers[at + 12] * clock)
    v *= math.exp(numbers[at + 13] * clock)
    return end_w + numbers[at + 4] * u + numbers[at + 5] * v, end_h + numbers[at + 6] * u + numbers[at + 7] * v


@Compiled
def _account(t: Any, h: Any, x: Any, rates: Any, signals: Any, numbers: Any, words: Any) -> None:
    for k in range(words[0]):
        row = 2 + k * words[1]
        copper, iron, clock = words[row + 3], words[row + 4], words[row + 5]
        if h <= 0.0:
            # What is recorded does not wait for the next step of the temperatures.
            signals[words[row + 9]], signals[words[row + 10]] = _warmed(x, numbers, words, row)
            continue
        x[copper] += h * signals[words[row + 6]]
        x[iron] += h * (signals[words[row + 7]] + signals[words[row + 8]])
        x[clock] += h
        if x[clock] < numbers[words[row]] * (1.0 - 1e-9):
            continue
        x[words[row + 1]], x[words[row + 2]] = _warmed(x, numbers, words, row)
        x[copper] = x[iron] = x[clock] = 0.0


AT_ONCE = 1e-9  # [s]


@dataclass(frozen=True)
class WindingHeat(Effect):
    """Two thermal nodes, heated by the copper loss and by friction at the motor's shaft.

    Attributes:
        network: Resistances and capacities; the winding's must be known.
        winding, housing: Temperatures at the start [C]; None: those of the air.
        every: Time between two steps of the temperatures [s]; None: a two-hundredth of the winding's time constant.
    """

    network: ThermalNetwork
    winding: float | None = None
    housing: float | None = None
    every: float | None = None

    account = _account

    def __post_init__(self) -> None:
        if self.network.winding_capacity is None:
            hint = "state one, or judge mean temperatures only"
            raise InputError(Fault("WindingHeat.network", "has no winding time constant", None, hint))
        if self.every is not None and not 0.0 < self.every < math.inf:
            raise InputError(Fault("WindingHeat.every", "must be positive [s]", self.every))

    def refined(self) -> WindingHeat:
        return replace(self, every=AT_ONCE)

    def ports(self, place: Place) -> Ports:
        return Ports(
            states=(
                State("winding_temperature", "C", 1e-3, memory=True),
                State("housing_temperature", "C", 1e-3, memory=True),
                State("gathered_copper_loss", "J", 1.0, memory=True),
                State("gathered_housing_loss", "J", 1.0, memory=True),
                State("gathered_time", "s", 1.0, memory=True),
            ),
            needs=(
                replace(s.COPPER_LOSS, default=0.0), s.MOTOR_FRICTION_POWER,
                replace(s.MOTOR_VISCOUS_POWER, default=0.0), s.WINDING_TEMPERATURE, s.HOUSING_TEMPERATURE,
            ),
        )  # fmt: skip

    def numbers(self, place: Place) -> Sequence[float]:
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
            decay, modes = np.linalg.eig(flow)
            inverse = np.linalg.inv(modes)
        period = self.every or SHARE * (net.winding_time_constant or 1.0)
        return [period, net.ambient, inner, outer, *modes.ravel(), *inverse.ravel(), *decay]

    def start(self, place: Place, signals: Mapping[str, float]) -> Sequence[float]:
        ambient = self.network.ambient
        first = ambient if self.winding is None else self.winding
        second = ambient if self.housing is None else self.housing
        return first, second, 0.0, 0.0, 0.0

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        return (TimeScale("winding warms", self.network.winding_time_constant or math.inf),)

    def estimate(self, place: Place, conditions: Conditions) -> Estimate:
        share, cold = conditions.magnet_share, conditions.cold_share
        if math.isnan(share) or math.isnan(cold):
            return Estimate(valid=False, why="the temperatures are not known: keep it")
        torque = conditions.peak_current * conditions.torque_constant * abs(place.ratio)
        valid = conditions.free and conditions.heat_gain < 0.8
        why = "resistance and torque constant at the temperatures of the task's own periodic state"
        return Estimate(share, share, cold, 1.2 * share * torque / conditions.loop_stiffness, valid, why)
