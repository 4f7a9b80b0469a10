"""What a stop does to a gear: closed forms against equations of motion."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from drivetrain.catalog.read import read_catalog
from drivetrain.drive.friction import Friction, friction_curve
from drivetrain.drive.gear import Gear, mesh_of, permitted_peaks
from drivetrain.drive.spring import answer, gear_spring, wind_up
from drivetrain.drive.stops import (
    HARDER,
    STIFFER,
    StiffSpring,
    braked,
    braking_push,
    jam_torque,
    overshoot,
    stiff_spring,
    stop_rotor,
    struck,
    swing_spring,
    swung_torque,
)
from drivetrain.records import as_record

GEAR = Gear(
    "g", 100.0, kind="strain_wave", stiffness_1=1e4, stiffness_2=1.4e4, stiffness_3=1.6e4, torque_1=4.0, torque_2=12.0
)


def wound(gear, rotor, speed, push):
    """Largest torque of a rotor that runs on into the gear's spring, its output held fast; by an ODE."""
    spring = gear_spring(gear)

    def rates(t, state):
        return [state[1], (push - float(answer(spring, state[0])[0])) / rotor]

    def turned(t, state):
        return state[1]

    turned.terminal, turned.direction = True, -1.0
    found = solve_ivp(rates, (0.0, 10.0), [0.0, speed], events=turned, rtol=1e-10, atol=1e-13, max_step=1e-3)
    return float(answer(spring, found.y[0, -1])[0])


@pytest.mark.parametrize("speed, push", [(2.0, 0.0), (0.05, 0.0), (2.0, 60.0), (0.0, 60.0), (0.3, 2.0)])
def test_a_jam_winds_the_spring_as_the_equation_of_motion_says(speed, push):
    """Integrated to 1e-10; the event is found to the step's tolerance."""
    rotor = 0.8
    stiffer = replace(GEAR, **{f"stiffness_{i}": STIFFER * getattr(GEAR, f"stiffness_{i}") for i in (1, 2, 3)})
    closed = jam_torque(stiff_spring(GEAR), 0.5 * rotor * speed**2, push)
    assert closed == pytest.approx(wound(stiffer, rotor, max(speed, 1e-12), push), rel=1e-6)


def test_a_stall_that_comes_at_once_doubles_the_torque():
    straight = StiffSpring(1e4, 1e4, 1e4, 1.0, 2.0)
    assert jam_torque(straight, 0.0, 30.0) == pytest.approx(60.0, rel=1e-12)
    assert jam_torque(straight, 0.5 * 0.8 * 2.0**2, 0.0) == pytest.approx(2.0 * math.sqrt(0.8 * 1e4), rel=1e-12)


def test_of_a_sheet_that_says_less_the_spring_is_no_softer():
    whole = jam_torque(stiff_spring(GEAR), 20.0, 5.0)
    for name in ("torque_1", "torque_2", "stiffness_1", "stiffness_2"):
        less = jam_torque(stiff_spring(replace(GEAR, **{name: None})), 20.0, 5.0)
        assert less >= whole * (1.0 - 1e-4)  # a soft first piece lets the motor push a little longer
    nothing = stiff_spring(replace(GEAR, stiffness_1=None, stiffness_2=None, stiffness_3=None))
    assert math.isnan(nothing.slope_3)
    for gone, slopes, bends in (
        ((), (1.0e4, 1.4e4, 1.6e4), (4.0, 12.0)),
        (("stiffness_1",), (1.4e4, 1.4e4, 1.6e4), (4.0, 12.0)),
        (("stiffness_1", "stiffness_2"), (1.6e4, 1.6e4, 1.6e4), (4.0, 12.0)),
        (("stiffness_2",), (1.0e4, 1.0e4, 1.6e4), (4.0, 12.0)),
        (("stiffness_3",), (1.0e4, 1.4e4, 1.4e4), (4.0, 12.0)),
        (("torque_1",), (1.0e4, 1.4e4, 1.6e4), (0.0, 12.0)),
        (("torque_2",), (1.0e4, 1.4e4, 1.6e4), (4.0, 4.0)),
        (("torque_1", "torque_2"), (1.0e4, 1.4e4, 1.6e4), (0.0, 0.0)),
    ):
        spring = stiff_spring(replace(GEAR, **dict.fromkeys(gone)))
        assert spring == pytest.approx((*(1.3 * slope for slope in slopes), *bends), rel=1e-15)  # 30 % as documented


def test_a_braked_mesh_solves_its_equation():
    """G tau = f T + G^2 J a and T = I a + b, with f by the way of the power."""
    rng = np.random.default_rng(3)
    for _ in range(200):
        rotor, inertia, static, push = rng.uniform(0.1, 3.0), rng.uniform(0.1, 5.0), *rng.normal(size=2) * 100.0
        way = float(rng.choice([-1.0, 1.0]))
        torque, acceleration = braked(1.4, 0.6, rotor, push, static, inertia, way)
        factor = 1.4 if torque * way > 0.0 else 0.6
        assert torque == pytest.approx(inertia * acceleration + static, abs=1e-9)
        assert push == pytest.approx(factor * torque + rotor * acceleration, abs=1e-9)
    assert braked(1.4, -2.0, 0.1, -50.0, 0.0, 1.0, 1.0).torque == math.inf  # no acceleration solves a mesh that locks


@pytest.mark.parametrize("ratio", [100.0, -60.0])
def test_motor_and_friction_push_against_the_motion(ratio):
    """-sgn(w) |G| (K I + drag + friction) - G J a_carrier, the drag and friction by hand."""
    mesh = mesh_of(replace(
        GEAR, ratio=ratio, mesh_efficiency=0.9, drag_torque=0.02, drag_speed=200.0, drag_speed_exponent=0.5,
        drag_temperature_1=0.0, drag_temperature_2=0.0, seal_drag_torque=0.03,
    ))  # fmt: skip
    shaft = friction_curve(Friction(0.004, viscous=1e-5))
    for speed, carrier in ((2.0, 0.0), (-2.0, 0.0), (2.0, 7.0), (-0.5, -3.0)):
        turning = abs(ratio * speed)
        drag = 0.02 * 0.8 * (turning / 200.0) ** 0.5 + 0.03 + 0.004 + 1e-5 * turning
        asked = -math.copysign(abs(ratio) * (0.3 + drag), speed) - ratio * 2e-5 * carrier
        assert braking_push(mesh, shaft, 0.8, 2e-5, 0.3, speed, carrier) == pytest.approx(asked, rel=1e-12)


def test_a_rotor_on_the_moved_link_turns_more_and_loads_it():
    assert stop_rotor(50.0, 2e-5, 0.0) == pytest.approx((0.05, 0.0))
    assert stop_rotor(50.0, 2e-5, 1.0) == pytest.approx((0.051, 51 * 2e-5))
    assert stop_rotor(-50.0, 2e-5, 1.0) == pytest.approx((0.049, -49 * 2e-5))


def test_a_worse_mesh_asks_more_of_a_gear_that_is_driven():
    torques = [
        abs(braked(1.0 / eta, 2.0 - 1.0 / eta, 0.5, -80.0, 0.0, 3.0, 1.0).torque) for eta in (1.0, 0.9, 0.8, 0.7)
    ]
    assert torques == sorted(torques)
    assert all(torque <= 80.0 / (2.0 - 1.0 / eta) for torque, eta in zip(torques, (1.0, 0.9, 0.8, 0.7), strict=True))


def swung(stiffness, inertia, rotor, push, rise):
    """Largest torque of the spring between a load and a rotor that a push slows down, both turning alike before."""

    def rates(t, state):
        torque = stiffness * state[0]
        drive = push * min(t / rise, 1.0) if rise else push
        return [state[2] - state[1], torque / inertia, (drive - torque) / rotor]

    found = solve_ivp(rates, (0.0, 1.0), [0.0, 0.0, 0.0], rtol=1e-9, atol=1e-12, max_step=5e-4)
    return stiffness * np.abs(found.y[0]).max()


@pytest.mark.parametrize("rise", [0.0, 0.01, 0.03, 0.05, 0.1])
def test_a_current_that_comes_slowly_swings_the_spring_less(rise):
    stiffness, inertia, rotor, push = 1e4, 2.0, 0.7, -50.0
    rigid = abs(push) * inertia / (inertia + rotor)
    found = rigid * (1.0 + overshoot(stiffness, inertia, rotor, rise))
    assert found == pytest.approx(swung(stiffness, inertia, rotor, push, rise), rel=2e-3)  # of samples of a swing
    assert overshoot(math.nan, inertia, rotor, rise) == 1.0


@pytest.mark.parametrize(
    "before, target", [(0.0, 3.0), (0.0, 9.0), (2.0, -10.0), (-30.0, 5.0), (-2.0, -40.0), (25.0, 1.0), (8.0, 8.0)]
)
def test_a_spring_that_stiffens_swings_further(before, target):
    """Load and rotor at rest on the wound spring, when the torque between them steps; by an ODE."""
    inertia, spring = 0.05, gear_spring(GEAR)
    start = float(wind_up(GEAR, np.array(before)))

    def rates(t, state):
        return [state[1], (target - float(answer(spring, state[0])[0])) / inertia]

    found = solve_ivp(rates, (0.0, 0.1), [start, 0.0], rtol=1e-10, atol=1e-14, max_step=2e-5)
    reached = np.array([float(answer(spring, twist)[0]) for twist in found.y[0]])
    furthest = reached[np.argmax(np.abs(reached - before))]
    swung = swung_torque(swing_spring(GEAR), before, target, 1.0)
    straight = 2.0 * target - before
    if (furthest - straight) * (target - before) >= 0.0:
        assert swung == pytest.approx(furthest, rel=1e-5, abs=1e-6)
    else:  # back over a soft middle it swings less far, which is not counted
        assert swung == straight
    assert swung_torque(swing_spring(GEAR), before, target, 0.0) == target
    for gone in ("torque_1", "torque_2", "stiffness_1", "stiffness_2", "stiffness_3"):
        less = swung_torque(swing_spring(as_record(replace(GEAR, **{gone: None}))), before, target, 1.0)
        assert (less - swung) * (target - before) >= -1e-12


def test_no_shipped_spring_stiffens_more_than_is_assumed():
    ratios = [row.stiffness_3 / row.stiffness_1 for row in read_catalog().gears.values() if row.stiffness_3]
    assert len(ratios) == 76 and 2.0 < max(ratios) < HARDER
    plain = swing_spring(as_record(Gear("g", 5.0, kind="planetary", stiffness_1=3e3)))
    assert swung_torque(plain, -3.0, 50.0, 1.0) == 103.0
    assert swung_torque(plain, -3.0, math.inf, 1.0) == math.inf


def test_no_way_of_stopping_a_rotor_swings_its_load_further_than_at_once():
    """The rotor's speed falls steadily, on a straight line, to 0."""
    stiffness, inertia, speed, static = 1e4, 2.0, 0.8, 30.0
    most = struck(stiffness, inertia, speed, static, static)
    reached = []
    for time in (1e-4, 0.01, 0.05, 0.2):

        def rates(t, state, time=time):
            rotor = speed * max(1.0 - t / time, 0.0)
            return [rotor - state[1], (stiffness * state[0] - static) / inertia]

        start = [static / stiffness, speed]
        found = solve_ivp(rates, (0.0, 0.5), start, rtol=1e-9, atol=1e-12, max_step=2e-4)
        reached.append(stiffness * np.abs(found.y[0]).max())
    assert max(reached) <= most * (1.0 + 1e-6)
    assert reached[0] == pytest.approx(most, rel=1e-3)


def test_what_nobody_knows_permits_no_peaks():
    assert permitted_peaks(1e4, 100.0, 0.0) == math.inf
    assert permitted_peaks(1e4, -100.0, math.pi / 50.0) == pytest.approx(1e4 / 2.0)
    assert math.isnan(permitted_peaks(1e4, 100.0, math.nan))
