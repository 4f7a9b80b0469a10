"""Stops and jams of a UR5-class pan (size 17, ratio 100, 10 A rms): figures worked through inverse dynamics by hand."""

from __future__ import annotations

import math

import pytest

from drivetrain.drive.stops import StiffSpring, braked, jam_torque, overshoot

# Efficiency of the mesh: largest rigid torque [N m] and way [deg] of a stop of the pan at full current.
STOPS = {1.0: (116.0, 9.3), 0.9: (129.0, 8.4), 0.8: (152.0, 7.1), 0.7: (195.0, 5.6)}
COAST, PUSHED = 178.0, 335.0  # N m: held fast at 150 deg/s, the motor off, and pushing on


def test_low_efficiency_strains_the_gear_and_shortens_the_way():
    """A pan has no static torque: T = P/(f + R/I) and a way in proportion to f + R/I.

    Two torques give P and R/I, the six other figures follow to what rounding makes of these.
    """
    (most, way), (least, _) = STOPS[0.7], STOPS[1.0]
    share = (least - most * (2.0 - 1.0 / 0.7)) / (most - least)
    push = least * (1.0 + share)
    for efficiency, (torque, travel) in STOPS.items():
        found = braked(1.0 / efficiency, 2.0 - 1.0 / efficiency, share, -push, 0.0, 1.0, 1.0)
        assert -found.torque == pytest.approx(torque, rel=0.015)
        slowed = braked(1.0 / 0.7, 2.0 - 1.0 / 0.7, share, -push, 0.0, 1.0, 1.0)
        assert way * slowed.acceleration / found.acceleration == pytest.approx(travel, rel=0.025)


def test_a_driven_mesh_bears_no_more_than_its_motor_pushes():
    """|T| <= P/eta_back, whatever the load; a current step that comes at once doubles it, so half of that is safe."""
    push, back = 120.0, 2.0 - 1.0 / 0.7
    for inertia in (0.1, 1.0, 100.0):
        assert abs(braked(1.0 / 0.7, back, 0.05, -push, 0.0, inertia, 1.0).torque) < push / back
    assert 1.0 + overshoot(1e4, 2.0, 0.1, 0.0) == 2.0
    turn = 2.0 * math.pi / math.sqrt(1e4 * (1.0 / 2.0 + 1.0 / 0.1))  # of the swing: as long a rise leaves none
    assert overshoot(1e4, 2.0, 0.1, turn) == pytest.approx(0.0, abs=1e-12)


def test_a_coasting_rotor_and_one_that_pushes_on():
    """T = w sqrt(R K): 178 N m at 150 deg/s are 109 N m, the momentary torque, at 92 deg/s.

    Pushing T = P + sqrt(P^2 + 178^2), with the P of the stops to 2.5 %: rounding of 116 and 195 N m makes 1.7 % of it,
    soft pieces the rest.
    """
    stiff, speed = 1.3 * 1.6e4, math.radians(150.0)
    spring = StiffSpring(stiff, stiff, stiff, 3.9, 12.0)
    rotor = (COAST / speed) ** 2 / stiff
    assert jam_torque(spring, 0.5 * rotor * speed**2, 0.0) == pytest.approx(COAST, rel=1e-12)
    assert jam_torque(spring, 0.5 * rotor * math.radians(92.0) ** 2, 0.0) == pytest.approx(109.0, rel=0.003)
    push = (PUSHED**2 - COAST**2) / (2.0 * PUSHED)
    assert jam_torque(spring, 0.5 * rotor * speed**2, push) == pytest.approx(PUSHED, rel=1e-12)
    share = (116.0 - 195.0 * (2.0 - 1.0 / 0.7)) / (195.0 - 116.0)
    assert push == pytest.approx(116.0 * (1.0 + share), rel=0.025)
