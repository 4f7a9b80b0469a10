"""The inverse engine with springs: closed form, and a forward run of its own currents."""

import numpy as np
import pytest

import drivetrain as dt

INERTIA, ROTOR, RATIO, STIFFNESS, WEIGHT, KT = 1.3, 4e-5, 80.0, 150.0, 6.0, 0.04
MOTOR = dt.Motor("m", 0.5, KT)
GEAR = dt.Gear("g", RATIO, stiffness_1=STIFFNESS)
TIME = np.linspace(0.0, 1.0, 1001)


def smooth_move(share: np.ndarray) -> tuple[np.ndarray, ...]:
    """From 0 to 1 with four derivatives that vanish at both ends: a polynomial of ninth order and its derivatives."""
    rise = np.polynomial.Polynomial([0, 0, 0, 0, 0, 126, -420, 540, -315, 70])
    return tuple((rise if k == 0 else rise.deriv(k))(share) for k in range(5))


NOTHING = dt.GivenCurrent([0.0], [0.0])


def scene(motion: dt.Motion, current: dt.GivenCurrent = NOTHING) -> dt.Scene:
    own = (dt.FlexibleJoint(GEAR), dt.FullRotor(ROTOR, RATIO), dt.MotorCurrent(MOTOR), current)
    return dt.Scene(dt.Inertia(INERTIA, weight=WEIGHT), {"joint": own, "scene": (dt.CommandedMotion(motion),)}, 1.0)


def moved(q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> dt.Motion:
    return dt.Motion("move", ("joint",), TIME, q[:, None], qd[:, None], qdd[:, None])


def test_the_rotor_turns_ahead_of_the_link() -> None:
    run = dt.simulate(scene(moved(*smooth_move(TIME)[:3])), solver=dt.Inverse(), interval=0.05)
    q, qd, qdd, _, snap = smooth_move(run.time)
    # T = I a + W cos q, and its second derivative by hand.
    torque = INERTIA * qdd + WEIGHT * np.cos(q)
    ahead = (INERTIA * snap - WEIGHT * (np.sin(q) * qdd + np.cos(q) * qd**2)) / STIFFNESS
    wanted = (torque / RATIO + ROTOR * RATIO * (qdd + ahead)) / KT
    found = run["joint.current"]
    assert np.abs(ROTOR * RATIO * ahead / KT).max() > 0.05 * np.abs(found).max()  # it is worth to be counted
    np.testing.assert_allclose(found, wanted, atol=2e-3 * np.abs(wanted).max())
    assert run.events == ()


def test_a_command_that_ends_in_motion_moves_to_its_end() -> None:
    """A swing without rest: at its last instant all is as at its first, and no jerk strikes the motor."""
    w = 4.0 * np.pi
    swing = [0.3 * w**k * np.sin(w * TIME + k * np.pi / 2.0) for k in range(3)]
    run = dt.simulate(scene(moved(*swing)), solver=dt.Inverse(), interval=0.05)
    assert run.events == ()
    q, qd, qdd = (0.3 * w**k * np.sin(w * run.time + k * np.pi / 2.0) for k in range(3))
    ahead = WEIGHT * np.sin(q) * qd + INERTIA * w**2 * qd  # minus the rate of I a + W cos q
    rate = qd - ahead / STIFFNESS
    assert np.abs(ahead / STIFFNESS).max() > 0.3 * np.abs(rate).max()  # it is worth to be counted
    # at both ends the differences are those of 2 ms within: 2.5 % of a radian of the swing
    np.testing.assert_allclose(run["joint.motor_speed"], RATIO * rate, atol=5e-3 * RATIO * np.abs(rate).max())
    whole = w**2 * -INERTIA * w**2 * -q + WEIGHT * (np.sin(q) * w**2 * q - np.cos(q) * qd**2)
    wanted = ((INERTIA * qdd + WEIGHT * np.cos(q)) / RATIO + ROTOR * RATIO * (qdd + whole / STIFFNESS)) / KT
    np.testing.assert_allclose(run["joint.current"], wanted, atol=1e-2 * np.abs(wanted).max())


def test_the_link_follows_the_currents_that_it_asks() -> None:
    q, qd, qdd, _, _ = smooth_move(TIME)
    asked = scene(moved(q, qd, qdd))
    run = dt.simulate(asked, solver=dt.Inverse(), interval=1e-3)
    driven = scene(moved(q, qd, qdd), dt.GivenCurrent(run.time, run["joint.current"]))
    real = dt.simulate(driven, solver=dt.AdaptiveStep(), interval=1e-2)
    np.testing.assert_allclose(real["joint.position"], q[::10], atol=2e-4)
    rigid = asked.effects["joint"][1:]
    bare = dt.Scene(asked.body, {"joint": rigid, "scene": asked.effects["scene"]}, 1.0)
    stiff = dt.simulate(bare, solver=dt.Inverse(), interval=1e-3)["joint.current"]
    left = dt.simulate(scene(moved(q, qd, qdd), dt.GivenCurrent(TIME, stiff)), solver=dt.AdaptiveStep(), interval=1e-2)
    assert np.abs(left["joint.position"] - q[::10]).max() > 5.0 * np.abs(real["joint.position"] - q[::10]).max()


def test_a_jerk_that_jumps_is_said() -> None:
    # Fifth order: its jerk jumps where it begins and ends.
    q = 10.0 * TIME**3 - 15.0 * TIME**4 + 6.0 * TIME**5
    qd = 30.0 * TIME**2 - 60.0 * TIME**3 + 30.0 * TIME**4
    qdd = 60.0 * TIME - 180.0 * TIME**2 + 120.0 * TIME**3
    run = dt.simulate(scene(moved(q, qd, qdd)), solver=dt.Inverse(), interval=1e-2)
    (event,) = run.events
    assert event.name == "rigid" and "jerk" in event.detail
    torque = INERTIA * qdd + WEIGHT * np.cos(q)
    np.testing.assert_allclose(run["joint.current"], ((torque / RATIO + ROTOR * RATIO * qdd) / KT)[::10], rtol=1e-6)


def test_where_it_begins_is_commanded() -> None:
    moves = scene(moved(*smooth_move(TIME)[:3]))
    with pytest.raises(dt.InputError, match="start: does not go with Inverse"):
        dt.simulate(moves, solver=dt.Inverse(), start={"joint.speed": 0.1})
    with pytest.raises(dt.InputError, match="resume: does not go with Inverse"):
        dt.simulate(moves, solver=dt.Inverse(), resume=dt.simulate(moves, duration=0.1))
