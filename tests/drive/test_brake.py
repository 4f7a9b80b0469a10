"""A brake's laws against the motion that they are about, integrated."""

import math

import pytest
from scipy.integrate import solve_ivp

from drivetrain.drive.brake import holding_torque, stopping_energy


@pytest.mark.parametrize("load", [-0.3, 0.0, 0.9])
def test_the_heat_of_a_stop_is_what_the_brake_takes_on_its_way(load):
    torque, inertia, speed = 1.4, 3e-4, 250.0

    def end(_, state):
        return state[0]

    end.terminal = True
    slowing = (load - torque) / inertia
    found = solve_ivp(lambda _, y: (slowing, torque * y[0]), (0.0, 1.0), (speed, 0.0), events=end, rtol=1e-10)
    assert stopping_energy(torque, load, inertia, speed) == pytest.approx(found.y[1, -1], rel=1e-8)
    assert stopping_energy(torque, torque, inertia, speed) == math.inf  # it does not stop


def test_what_holds_has_no_direction():
    for gear, ratio in ((30.0, 100.0), (-30.0, 100.0), (30.0, -100.0), (-30.0, -100.0)):
        assert holding_torque(gear, ratio) == pytest.approx(0.3, rel=1e-15)
