"""The laws of the supply, called one by one: what a step and each mode does to the charge, and when modes change."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from called_laws import PLACE, Called, joint_at, world_at

from drivetrain.effects.laws import Whole
from drivetrain.effects.motor.supply_bus import (
    RESISTOR_HOLDS,
    RESISTOR_ON,
    SOURCE_HOLDS,
    SOURCE_LIMITED,
    UNREGULATED,
    StiffSupply,
    SupplyBus,
)

BUS = SupplyBus(48.0, 2e-3, 200.0, 60.0, 15.0, 0.8)
EDGE = 48e-9  # V, within which the voltage counts as held
TINY = 1e-6 * 0.5 * 2e-3 * 48.0**2  # W, a millionth of its energy in a second


def stepped(one: Called, h: float, drawn: Any) -> int:
    """Solve a step as an engine does: again as long as the bus asks for it; how often that was."""
    world = one.world
    for k in range(30):
        world.iteration, world.repeat_step, world.step_limit = k, 0, math.inf
        one("compute", h)
        one.joint.pin.power = drawn(one.joint.pin.limit / 0.8)
        one("account", h)
        if world.repeat_step == 0:
            return k + 1
    raise AssertionError("no end")


# Voltage before the step, its length, and the power that the drives draw at a voltage.
STEPS: dict[str, tuple[float, float, Any]] = {
    "held": (48.0, 1e-3, lambda v: 150.0),
    "sinks": (48.0, 1e-3, lambda v: 900.0 * (v / 48.0) ** 2),
    "sinks steeply": (20.0, 1e-3, lambda v: 700.0 * math.exp((v - 20.0) / 2.0)),
    "comes up": (30.0, 1e-3, lambda v: 20.0 + v),
    "comes up to its voltage": (47.9, 1e-3, lambda v: 20.0),
    "is fed": (50.0, 1e-3, lambda v: -8.0 * v),
    "is fed to the threshold": (59.5, 1e-3, lambda v: -150.0),
    "is fed more than is burnt": (60.0, 1e-3, lambda v: -600.0),
    "burns": (66.0, 1e-3, lambda v: 10.0),
    "breaks down": (2.0, 1e-3, lambda v: 300.0),
}


@pytest.mark.parametrize("name", STEPS)
def test_a_step_keeps_the_charge(name: str) -> None:
    volts, h, drawn = STEPS[name]
    one = Called(BUS, {}, {"bus_voltage": volts})
    solved = stepped(one, h, drawn)
    own, power = one.own, one.joint.pin.power
    before = 1e-3 * volts**2
    left = before - h * power
    fed = min(max(1e-3 * 48.0**2 - left, 0.0), h * 200.0)
    burnt = min(max(left + fed - 1e-3 * 60.0**2, 0.0), h * volts**2 / 15.0)
    end = math.sqrt(max(left + fed - burnt, 0.0) / 1e-3)
    assert volts + h * own.bus_voltage_rate == pytest.approx(end, rel=1e-9, abs=1e-9)
    assert (own.source_power, own.brake_resistor_power) == pytest.approx((fed / h, burnt / h))
    assert own.delivered_power == power and own.bus_energy == pytest.approx(before)
    assert own.slope == own.bus_voltage_rate
    assert abs(own.trial - 0.5 * (volts + end)) <= 1e-7 * 48.0  # what the drives were told
    assert solved <= (10 if name == "sinks steeply" else 5)  # halvings would take 24, a voltage put in again has no end
    change = abs(end - volts)
    longest = 0.005 * h * max(volts, 0.005 * 48.0) / change if change else math.inf
    assert one.world.step_limit == pytest.approx(longest, rel=1e-6)
    # From there on the next step begins with a voltage that goes on as it did.
    one.world.iteration, own.bus_voltage = 0, end
    one("compute", h)
    assert one.joint.pin.limit == pytest.approx(0.8 * max(end + 0.5 * (end - volts), 0.5 * end), rel=1e-9)


# Mode, voltage, power drawn; power of source and resistor, distance from a change.
MOST = 60.0**2 / 15.0
MODES = (
    (SOURCE_HOLDS, 48.0, 50.0, 50.0, 0.0, 50.0 + TINY), (SOURCE_HOLDS, 48.0, 150.0, 150.0, 0.0, 50.0),
    (SOURCE_HOLDS, 48.0, -5.0, 0.0, 0.0, TINY - 5.0), (SOURCE_HOLDS, 48.0, 230.0, 200.0, 0.0, -30.0),
    (SOURCE_LIMITED, 40.0, 250.0, 200.0, 0.0, 8.0 + EDGE), (SOURCE_LIMITED, 48.1, -20.0, 200.0, 0.0, EDGE - 0.1),
    (UNREGULATED, 50.0, -30.0, 0.0, 0.0, 2.0 + EDGE), (UNREGULATED, 59.0, 30.0, 0.0, 0.0, 1.0 + EDGE),
    (RESISTOR_HOLDS, 60.0, -50.0, 0.0, 50.0, 50.0 + TINY), (RESISTOR_HOLDS, 60.0, -200.0, 0.0, 200.0, MOST - 200.0),
    (RESISTOR_HOLDS, 60.0, 3.0, 0.0, 0.0, TINY - 3.0), (RESISTOR_HOLDS, 60.0, -300.0, 0.0, MOST, MOST - 300.0),
    (RESISTOR_ON, 62.0, -400.0, 0.0, 62.0**2 / 15.0, 2.0 + EDGE),
)  # fmt: skip


@pytest.mark.parametrize("mode, volts, drawn, source, burnt, margin", MODES)
def test_each_mode_at_an_instant(
    mode: int, volts: float, drawn: float, source: float, burnt: float, margin: float
) -> None:
    one = Called(BUS, {"pin.power": drawn}, {"bus_voltage": volts, "mode": mode})("compute")("account")
    own = one.own
    assert one.joint.pin.limit == pytest.approx(0.8 * volts)
    assert (own.source_power, own.brake_resistor_power) == pytest.approx((source, burnt))
    assert own.margin == pytest.approx(margin, rel=1e-12)
    held = mode in (SOURCE_HOLDS, RESISTOR_HOLDS)
    assert own.bus_voltage_rate == pytest.approx(0.0 if held else (source - drawn - burnt) / (2e-3 * volts))
    assert (own.delivered_power, own.bus_energy) == pytest.approx((drawn, 1e-3 * volts**2))


def test_an_empty_bus_has_a_rate_too() -> None:
    one = Called(BUS, {"pin.power": 0.0}, {"bus_voltage": 0.0, "mode": SOURCE_LIMITED})("account")
    assert one.own.bus_voltage_rate == pytest.approx(200.0 / (2e-3 * EDGE))


# Voltage at the end of a fixed step and the mode from then on.
ENDS = (
    (40.0, SOURCE_LIMITED), (48.0 - 2.0 * EDGE, SOURCE_LIMITED), (48.0, SOURCE_HOLDS),
    (48.0 + 0.5 * EDGE, SOURCE_HOLDS), (48.0 - 0.5 * EDGE, SOURCE_HOLDS),
    (48.0 + 2.0 * EDGE, UNREGULATED), (60.0 - 2.0 * EDGE, UNREGULATED),
    (60.0 - 0.5 * EDGE, RESISTOR_HOLDS), (60.0, RESISTOR_HOLDS), (60.0 + 2.0 * EDGE, RESISTOR_ON),
)  # fmt: skip


@pytest.mark.parametrize("volts, mode", ENDS)
@pytest.mark.parametrize("before", [SOURCE_HOLDS, UNREGULATED, RESISTOR_ON])
def test_the_mode_after_a_fixed_step(volts: float, mode: int, before: int) -> None:
    rate = (volts - 50.0) / 1e-3
    one = Called(BUS, {}, {"bus_voltage": 50.0, "bus_voltage_rate": rate, "mode": before})("accept", 1e-3)
    assert one.own.mode == mode and one.own.bus_voltage == 50.0


# Mode and voltage where a margin is zero, the power drawn there; mode and voltage from then on.
CHANGES = (
    (SOURCE_HOLDS, 48.0, 200.0, SOURCE_LIMITED, 48.0), (SOURCE_HOLDS, 48.0, -TINY, UNREGULATED, 48.0),
    (RESISTOR_HOLDS, 60.0, -MOST, RESISTOR_ON, 60.0), (RESISTOR_HOLDS, 60.0, TINY, UNREGULATED, 60.0),
    (SOURCE_LIMITED, 48.0 + EDGE, 250.0, SOURCE_LIMITED, 48.0),
    (SOURCE_LIMITED, 48.0 + EDGE, 150.0, SOURCE_HOLDS, 48.0),
    (SOURCE_LIMITED, 48.0 + EDGE, 0.05, SOURCE_HOLDS, 48.0), (RESISTOR_ON, 60.0 - EDGE, 0.05, UNREGULATED, 60.0),
    (SOURCE_LIMITED, 48.0 + EDGE, -10.0, UNREGULATED, 48.0), (UNREGULATED, 48.0 - EDGE, 250.0, SOURCE_LIMITED, 48.0),
    (UNREGULATED, 48.0 - EDGE, 50.0, SOURCE_HOLDS, 48.0), (UNREGULATED, 48.0 + EDGE, 50.0, SOURCE_HOLDS, 48.0),
    (UNREGULATED, 60.0 - EDGE, -300.0, RESISTOR_ON, 60.0), (UNREGULATED, 60.0 + EDGE, -300.0, RESISTOR_ON, 60.0),
    (UNREGULATED, 60.0 + EDGE, -100.0, RESISTOR_HOLDS, 60.0), (UNREGULATED, 60.0 + EDGE, 10.0, UNREGULATED, 60.0),
    (RESISTOR_ON, 60.0 - EDGE, -100.0, RESISTOR_HOLDS, 60.0), (RESISTOR_ON, 60.0 - EDGE, 20.0, UNREGULATED, 60.0),
    (RESISTOR_ON, 60.0 - EDGE, -300.0, RESISTOR_ON, 60.0),
)  # fmt: skip


@pytest.mark.parametrize("mode, volts, drawn, after, left", CHANGES)
def test_the_mode_where_a_margin_is_zero(mode: int, volts: float, drawn: float, after: int, left: float) -> None:
    one = Called(BUS, {}, {"bus_voltage": volts, "delivered_power": drawn, "mode": mode})("accept")
    assert (one.own.mode, one.own.bus_voltage) == (after, left)


def test_all_joints_share_a_supply() -> None:
    joints, laws = [joint_at({"pin.power": 30.0}), joint_at({"pin.power": -50.0})], (StiffSupply(24.0, 0.9), BUS)
    for effect in laws:
        own, law = effect.own(PLACE), effect.compute
        if effect is BUS:
            own.bus_voltage = 50.0
        assert law is not None
        law(0.0, 0.0, own, Whole(joints, world_at(), np.eye(2), np.zeros((0, 0))))
        assert [one.pin.limit for one in joints] == pytest.approx([21.6 if effect is not BUS else 40.0] * 2)
    account: Any = BUS.account
    account(0.0, 0.0, own, Whole(joints, world_at(), np.eye(2), np.zeros((0, 0))))
    assert own.delivered_power == -20.0 and BUS.start(PLACE, {}) == (48.0,)
