"""Stages between gear and joint: closed forms, power balance, chains, and what a study makes of them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from power_balance import power_balance

import drivetrain
from drivetrain.drive.drive import Drive, motor_torque
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import NO_GEAR, Gear, mesh
from drivetrain.drive.motor import Motor
from drivetrain.drive.stages import Stage, chained, with_stages
from drivetrain.errors import InputError
from drivetrain.study.model import pair_name
from drivetrain.study.read import load_study

BALL = Stage("screw", efficiency=0.9, lead=0.01 / (2.0 * math.pi), root_diameter=0.0174, diameter=0.0208, length=1.0)
TRAPEZOID = Stage("screw", friction=0.12, lead=0.004 / (2.0 * math.pi), diameter=0.018)
BELT = Stage("belt", efficiency=0.96, ratio=2.5, diameter=0.1, tooth_force=30.0, teeth_in_mesh=6.0, inertia=2e-5)
WORM = Stage("worm", friction=0.08, lead_angle=0.1, ratio=30.0)


def test_a_screw_by_hand() -> None:
    """Published example: 20 x 10 screw, 1 m; Euler and beam formulas worked with I = pi d^4/64, A = pi d^2/4."""
    second, area = math.pi * 0.0174**4 / 64.0, math.pi * 0.0174**2 / 4.0
    found = chained([BALL])
    assert found.travel == pytest.approx(0.01 / (2.0 * math.pi))
    assert found.torque == pytest.approx(math.pi**2 * 2.06e11 * second / 2.0 * found.travel)
    assert found.torque_words == "buckling of the screw"
    whirling = 0.8 * math.pi**2 * math.sqrt(2.06e11 * second / (7850.0 * area))
    assert found.speed == pytest.approx(whirling)
    # 0.8 pi^2 d/4 sqrt(E/rho)/L^2 = 176 rad/s = 1680 rpm: catalogues print some 1600 to 1700 for 20 mm over 1 m.
    assert 1600.0 < found.speed * 30.0 / math.pi < 1750.0
    # 19.1 mm, the mean of 20.8 and 17.4 mm: half of the mass times the radius squared
    assert found.inertia == pytest.approx(0.5 * math.pi * 0.00955**2 * 7850.0 * 0.00955**2)
    assert 1.0 / found.compliance == pytest.approx(2.06e11 * area * found.travel**2)


def test_a_screw_turns_its_thread_too() -> None:
    """Triangles between root and pitch diameter, in slices, have 0.3 to 2.2 % more than the default."""
    for root, pitch in ((0.013, 0.016), (0.017, 0.02), (0.029, 0.032)):
        flank = 0.5 * np.linspace(root, pitch, 100001)
        real = 7850.0 * 0.3 * math.pi / 2.0 * np.mean(flank**4)
        one = Stage("screw", efficiency=0.9, lead=0.001, diameter=pitch, root_diameter=root, length=0.3)
        assert 1.003 < real / one.input_inertia < 1.022
        alone = replace(one, root_diameter=None), replace(one, diameter=None)
        ends = [math.pi / 32.0 * 7850.0 * 0.3 * across**4 for across in (pitch, root)]
        assert [end.input_inertia for end in alone] == pytest.approx(ends)


def test_friction_of_threads_is_the_wedge() -> None:
    """Work in over work out on a slope, by equilibrium of forces; a trapezoidal thread of 4 degrees locks itself."""
    slope, friction = 0.004 / (math.pi * 0.018), 0.12
    driving, driven = TRAPEZOID.factors
    assert driving == pytest.approx((slope + friction) / (1.0 - friction * slope) / slope)
    assert driven == pytest.approx((slope - friction) / (1.0 + friction * slope) / slope)
    assert driven < 0.0
    assert Stage("screw", friction=0.0, lead=1e-3, diameter=0.02).factors == pytest.approx((1.0, 1.0))
    assert WORM.factors[1] == pytest.approx(math.tan(0.1 - math.atan(0.08)) / math.tan(0.1))


def test_a_chain_is_its_stages_one_after_the_other() -> None:
    """Torque, speed and power through belt and screw by hand, in both directions of power."""
    found = chained([BELT, BALL])
    assert found.ratio == 2.5
    assert found.driving == pytest.approx(1.0 / (0.96 * 0.9))
    assert found.driven == pytest.approx((2.0 - 1.0 / 0.96) * (2.0 - 1.0 / 0.9))
    assert found.inertia == pytest.approx(2e-5 + BALL.input_inertia / 2.5**2)
    assert found.torque == pytest.approx(min(30.0 * 6.0 * 0.05, BALL.torque_limits["buckling"]))
    locked = chained([BELT, TRAPEZOID])
    assert locked.driven == pytest.approx(TRAPEZOID.factors[1] / 0.96)  # a belt that must push the load down
    with pytest.raises(InputError, match="slide"):
        chained([BALL, BELT])


def test_limits_and_stiffness_of_slides_from_the_force_along_them() -> None:
    """Force times radius or lead, and a spring along the slide seen as a torsional one, for numbers that all differ."""
    rack = Stage("rack", efficiency=0.9, diameter=0.06, force_limit=900.0, axial_stiffness=3e6, stiffness=5e3)
    line = Stage("belt", efficiency=0.95, diameter=0.05, tooth_force=40.0, force_limit=700.0, axial_stiffness=4e5)
    screw = Stage("screw", efficiency=0.9, lead=0.003, root_diameter=0.016, length=0.7, force_limit=800.0)
    for one, arm in ((rack, 0.03), (line, 0.025), (screw, 0.003)):
        assert one.travel == pytest.approx(arm)
        assert one.torque_limits["force"] == pytest.approx(one.force_limit * arm)
        assert chained([one]).travel == pytest.approx(arm)
    assert line.torque_limits["teeth in mesh"] == pytest.approx(40.0 * 0.025)  # one tooth unless more are stated
    assert rack.compliance == pytest.approx(1.0 / 5e3 + 1.0 / (3e6 * 0.03**2))
    assert line.compliance == pytest.approx(1.0 / (4e5 * 0.025**2))
    rod = 2.06e11 * math.pi * 0.016**2 / 4.0 / 0.7
    assert screw.compliance == pytest.approx(1.0 / (rod * 0.003**2))
    assert BELT.travel is None and WORM.travel is None
    for kind, given in (("gear", {"ratio": 3.0}), ("worm", {"ratio": 30.0})):
        with pytest.raises(InputError, match="diameter"):
            Stage(kind, efficiency=0.9, force_limit=100.0, **given)


def test_three_stages_in_series_by_the_whole_matrix() -> None:
    """Springs and inertias between gear and joint: compliance at the joint with the gear's output held, kinetic energy
    at a given speed, and each limit alone, with turns of every shaft from the joint backwards.
    """
    given = ((3.0, 4e2, 5e-4, 90.0, 500.0), (2.0, 9e2, 3e-3, 200.0, 90.0), (5.0, 8e3, 2e-2, 1500.0, 70.0))
    stages = [
        Stage("gear", 0.9, ratio=r, stiffness=k, inertia=j, torque_limit=t, speed_limit=w, mass=1.0, price=7.0)
        for r, k, j, t, w in given
    ]
    found = chained(stages)
    turns = [30.0, 10.0, 5.0, 1.0]  # of the shafts, gear's output first, per turn of the joint
    energy = sum(j * turn**2 for (_, _, j, _, _), turn in zip(given, turns, strict=False))
    assert (found.ratio, found.mass, found.price) == (30.0, 3.0, 21.0)
    assert found.inertia * 30.0**2 == pytest.approx(energy)
    # A torque of 1 at the joint is 1/turns at each output, whose twist is seen at the joint divided by the turns again.
    twists = [1.0 / (k * turn**2) for (_, k, _, _, _), turn in zip(given, turns[1:], strict=True)]
    assert found.compliance == pytest.approx(sum(twists))
    carried = sum(j * turns[i] ** 2 * sum(twists[:i]) for i, (_, _, j, _, _) in enumerate(given))
    assert found.carried == pytest.approx(carried)
    assert found.torque == pytest.approx(min(t * turn for (*_, t, _), turn in zip(given, turns[1:], strict=True)))
    assert found.speed == pytest.approx(min(w / turn for (*_, w), turn in zip(given, turns, strict=False)))
    direct = with_stages(NO_GEAR, found)
    for name in ("stiffness_1", "stiffness_2", "stiffness_3"):
        assert getattr(direct, name) == pytest.approx(1.0 / found.compliance)
    assert direct.inertia == pytest.approx(found.inertia)
    assert direct.stage_sprung == pytest.approx(carried / found.compliance)
    whole = with_stages(Gear("p4", 4.0, kind="planetary", efficiency=0.9, stiffness_1=150.0), found)
    before = 1.0 / (150.0 * 30.0**2)  # compliance of the gear seen at the joint, before all stages
    moved = sum(j * turn**2 for (_, _, j, _, _), turn in zip(given, turns, strict=False)) * before + carried
    assert whole.stage_sprung == pytest.approx(moved / (before + found.compliance))
    assert whole.stiffness_1 == pytest.approx(1.0 / (before + found.compliance))


def test_a_gear_with_a_chain_is_mechanics_done_twice() -> None:
    gear = Gear("p20", -20.0, kind="planetary", efficiency=0.8, inertia=1e-6, repeated_peak_torque=30.0, backlash=1e-3,
                stiffness_1=500.0, continuous_torque=15.0)  # fmt: skip
    whole = with_stages(gear, chained([BELT]))
    assert (whole.key, whole.ratio, whole.repeated_peak_torque) == ("p20+belt", -50.0, 75.0)
    assert whole.stiffness_1 == pytest.approx(500.0 * 2.5**2)
    assert whole.inertia == pytest.approx(1e-6 + 2e-5 / 20.0**2)
    assert whole.backlash == pytest.approx(1e-3 / 2.5)
    found = mesh(whole)
    assert found.driving == pytest.approx(1.0 / 0.8 / 0.96)
    assert found.driven == pytest.approx((2.0 - 1.0 / 0.8) * (2.0 - 1.0 / 0.96))
    assert with_stages(NO_GEAR, chained([BALL])).direct
    assert with_stages(NO_GEAR, chained([BALL])).key == "+screw"
    assert pair_name("m", "+screw") == "m with screw"


def test_power_that_a_stage_takes_is_accounted_for() -> None:
    """Electrical power in is copper, frictions, mesh and output, stages and load friction among it."""
    gear = with_stages(Gear("g", 20.0, kind="planetary", efficiency=0.8, inertia=0.0), chained([BELT]))
    drive = Drive(Motor("m", 0.3, 0.05, rotor_inertia=1e-5), gear, Friction(coulomb=0.4, load_share=0.05), Friction())
    speed = np.array([2.0, 2.0, -2.0, -2.0])
    load, still = np.array([9.0, -9.0, 9.0, -9.0]), np.zeros(4)
    torque = motor_torque(drive, load, speed, still, still)
    joint = load + 0.4 * np.sign(speed)
    ahead = joint * speed > 0.0
    behind = joint * np.where(ahead, 1.05, 0.95)  # what the joint's friction makes of it
    stage = behind * np.where(ahead, 1.0 / 0.96, 2.0 - 1.0 / 0.96)
    expected = stage * np.where(ahead, 1.0 / 0.8, 0.75) / 50.0
    np.testing.assert_allclose(torque.total, expected, rtol=1e-12)
    balance = power_balance(drive, load, speed, torque, 25.0, 25.0)
    np.testing.assert_allclose(balance.residual, 0.0, atol=1e-12 * np.abs(balance.electrical).max())
    assert (balance.mesh > 0.0).all()


@pytest.mark.parametrize("curve", [Friction(coulomb=2.0, tanh_speed=0.5, viscous=0.1, coulomb_negative=1.0)])
def test_a_smooth_law(curve) -> None:
    from drivetrain.drive.friction import friction_curve, friction_torque, tanh_slope

    speed = np.array([-3.0, -0.2, -1e-9, 0.0, 0.2, 3.0])
    coulomb = np.where(speed > 0.0, 2.0, 1.0)
    np.testing.assert_allclose(friction_torque(curve, speed), coulomb * np.tanh(speed / 0.5) + 0.1 * speed, atol=1e-12)
    step = 1e-6
    told = friction_curve(curve)
    slope = (friction_torque(curve, 0.3 + step) - friction_torque(curve, 0.3 - step)) / (2.0 * step) - 0.1
    assert tanh_slope(told, 0.3) == pytest.approx(float(slope), rel=1e-6)
    sigmoid = 2.0 / (1.0 + np.exp(-speed / 0.25)) - 1.0
    np.testing.assert_allclose(coulomb * sigmoid + 0.1 * speed, friction_torque(curve, speed), atol=1e-12)
    with pytest.raises(InputError, match="tanh_speed"):
        Friction(coulomb=1.0, static=2.0, tanh_speed=0.1)


STUDY = """
schema_version: 1
arm: planar-2r
drive_mass: included
motions: {there: {unit: deg, profile: quintic, durations: [1 s, 1 s], waypoints: [[0, 0], [20, -45], [0, 0]]}}
cycle: [{motion: there}]
supply: {voltage: 24 V}
motors:
  m: {resistance: 1 ohm, torque_constant: 0.05 N m/A, kind: brushed, current_basis: dc, winding_basis: line_line,
      rotor_inertia: 10 g cm^2, source: test}
gears: {g: {kind: planetary, ratio: 20, efficiency: 80 %, inertia: 1 g cm^2,
          repeated_peak_torque: 30 N m, source: test}}
joints:
  default: {drive: {motor: m, gear: g}}
  joint_1:
    stages:
"""


def test_a_study_states_them_and_an_evaluation_judges_them() -> None:
    from drivetrain.sizing.judge.evaluate import evaluate

    belt = "      - {type: belt, ratio: 2.5, efficiency: 96 %, diameter: 100 mm, tooth_force: 30 N, teeth_in_mesh: 6"
    study = load_study(STUDY + f"{belt}, speed_limit: 300 rpm}}")
    assert study.joints[0].drive == ("m", "g+belt")
    found = evaluate(study).joints["joint_1"]
    checks = {check.name: check for check in found.checks}
    limit = checks["torque behind the gear"]
    assert limit.available == pytest.approx(30.0 * 6.0 * 0.05)
    assert limit.required == pytest.approx(np.abs(found.series.gear_torque).max(), rel=1e-9)
    assert checks["speed behind the gear"].available == pytest.approx(300.0 * math.pi / 30.0 / 2.5)
    assert "torque behind the gear" not in {check.name for check in evaluate(study).joints["joint_2"].checks}


@pytest.mark.parametrize("stop", [{"ramp": 0.1}, {"current": 40.0}])
def test_a_gear_bears_what_its_screw_takes_to_speed_up(stop) -> None:
    """A table of 40 kg on a level screw, by hand: the screw's 1e-3 kg m^2 ask more than the table, seen there."""
    mass, lead, inertia, ratio, rotor = 40.0, 0.02 / (2.0 * math.pi), 1e-3, 4.0, 1e-4
    home, axis, links = np.eye(4)[None], [[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]], [np.eye(3)]
    arm = drivetrain.Arm.from_screws(home, axis, [mass], links, tip=np.eye(4), gravity=[0.0, 0.0, -9.81])
    t = np.linspace(0.0, 2.0, 401)
    w, s, c = 0.5 * np.pi, np.sin(0.5 * np.pi * t), np.cos(0.5 * np.pi * t)
    q, qd, qdd = (0.4 * x[:, None] for x in (s**4, 4.0 * w * s**3 * c, w * w * (12.0 * s**2 * c**2 - 4.0 * s**4)))
    motor = {"kind": "brushless", "current_basis": "dc", "winding_basis": "line_line", "resistance": 0.3,
             "torque_constant": 0.1, "rotor_inertia": rotor, "mass": 0.9, "nominal_current": 20, "peak_current": 90,
             "coulomb_friction": 1e-9, "viscous_friction": 1e-12}  # fmt: skip
    gear = {"kind": "planetary", "ratio": ratio, "efficiency": 1.0, "inertia": 1e-12, "mass": 1.0, "stiffness_1": 1e9,
            "repeated_peak_torque": 20, "momentary_torque": 40}  # fmt: skip
    screw = {"type": "screw", "lead": lead, "efficiency": 1.0, "backdriving_efficiency": 1.0, "inertia": inertia}
    study = drivetrain.study(
        arm=arm, drive_mass="included", motion=(t, q, qd, qdd), motors={"M": motor}, gears={"G": gear},
        drives=("M", "G"), supply="400 V", joints={"default": {"stages": [screw]}}, stop=stop,
        amplifier={"current_basis": "dc"},
    )  # fmt: skip
    found = drivetrain.evaluate(study).checks.set_index("check")
    checks, told = found.required, found.remark["gear momentary peak torque"]
    whole = mass * lead * lead + inertia
    assert checks["gear repeated peak torque"] == pytest.approx(whole * np.abs(qdd / lead).max(), rel=1e-9)
    way, torque = np.abs(qd[:, 0]), np.abs(whole * qdd[:, 0] / lead)
    mean = np.trapezoid(way * torque**3, t) / np.trapezoid(way, t)
    assert checks["gear average torque"] == pytest.approx(mean ** (1.0 / 3.0), rel=1e-3)  # of 400 samples
    if "ramp" in stop:
        slowing = np.abs(qd).max() / lead / stop["ramp"]
        assert checks["gear momentary peak torque"] == pytest.approx(whole * slowing, rel=1e-3)
        assert f"{checks['gear momentary peak torque']:.4g} N m, 0 s after its start" in told
    else:  # from where the motion brakes already the spring swings less than by all of what the stop takes
        share = whole / (whole + ratio**2 * rotor) * ratio * 0.1 * stop["current"]
        assert f"{checks['gear momentary peak torque']:.4g} N m with the oscillation" in told
        assert share < checks["gear momentary peak torque"] < 2.0 * share + torque.max()


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ("{type: belt, ratio: 2}", "efficiency"),
        ("{type: chain, ratio: 2}", "belt"),
        ("{type: screw, lead: 10 mm/rev, efficiency: 90 %}", "sliding"),
        ("{type: worm, ratio: -2, efficiency: 50 %}", "greater than 0"),
    ],
)
def test_faults_say_where(entry, words) -> None:
    with pytest.raises(InputError, match=words) as caught:
        load_study(STUDY + f"      - {entry}")
    assert "stages" in str(caught.value)
