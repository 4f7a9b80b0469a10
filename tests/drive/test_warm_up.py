"""Motors that warm up: against closed forms, the periodic state, and bad input."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drivetrain.drive.motor import Motor, copper_coefficient
from drivetrain.drive.thermal.heat import temperature_of_current
from drivetrain.drive.thermal.thermal_network import ThermalNetwork
from drivetrain.drive.thermal.warm_up import warm_up
from drivetrain.errors import InputError

MOTOR = Motor("any", 0.5, 0.05)
TWO_NODES = ThermalNetwork(2.0, 4.0, 20.0, 300.0, 25.0)
TIME, CURRENT = [0.0, 2.0, 2.0, 10.0], [5.0, 5.0, 1.0, 1.0]


def test_one_node_at_constant_current_is_an_exponential() -> None:
    network = ThermalNetwork(0.0, 4.0, 100.0, None, 25.0)
    found = warm_up(network, MOTOR, [0.0, 30.0], [3.0, 3.0], 40)
    gain = 4.0 * 0.5 * copper_coefficient(25.0) * 9.0
    final, rate = 4.0 * 4.5 / (1.0 - gain), (1.0 - gain) / 400.0
    assert found.winding == pytest.approx(25.0 + final * -np.expm1(-rate * found.time), rel=1e-12)
    assert (found.housing == found.winding).all()
    assert found.peak_winding == found.winding[-1]


def test_it_ends_in_the_periodic_state() -> None:
    settled = temperature_of_current(TWO_NODES, MOTOR, np.array(TIME), np.array(CURRENT))
    found = warm_up(TWO_NODES, MOTOR, TIME, CURRENT, 6000)
    assert found.winding[-1] == pytest.approx(settled.winding[0], abs=1e-9)
    assert found.housing[-1] == pytest.approx(settled.housing[0], abs=1e-9)
    assert found.peak_winding == pytest.approx(settled.peak_winding, abs=1e-9)
    again = warm_up(TWO_NODES, MOTOR, TIME, CURRENT, 1, start=(settled.winding[0], settled.housing[0]))
    assert again.winding[1] == pytest.approx(again.winding[0], abs=1e-9)


@pytest.mark.parametrize("network", [TWO_NODES, ThermalNetwork(0.0, 4.0, 20.0, None, 25.0)], ids=["two", "one"])
def test_what_runs_away_is_infinite_from_there_on(network: ThermalNetwork) -> None:
    found = warm_up(network, MOTOR, TIME, [60.0, 60.0, 50.0, 50.0], 400)
    assert found.winding[0] == 25.0
    assert found.winding[1] > 25.0
    assert math.isinf(found.winding[-1])
    assert math.isinf(found.peak_winding)
    assert not np.isnan(found.winding).any()


def test_every_fault_is_told() -> None:
    slow = ThermalNetwork(2.0, 4.0, None, None, 25.0)
    with pytest.raises(InputError) as error:
        warm_up(slow, MOTOR, [0.0], [1.0], 0)
    assert {fault.place for fault in error.value.faults} == {"cycles", "network.winding_capacity", "current"}
    with pytest.raises(InputError, match="start"):
        warm_up(TWO_NODES, MOTOR, TIME, CURRENT, 2, start=(25.0, math.nan))
