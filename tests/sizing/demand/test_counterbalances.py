"""Counterbalances: their torque against MuJoCo and potentials, and in every road of a study."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from scipy.integrate import quad

from drivetrain.drive.counterbalance import Counterbalance, counterbalance_torque
from drivetrain.dynamics.inverse import inverse_dynamics
from drivetrain.errors import InputError
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.engines.inverse import Inverse
from drivetrain.simulation.run import simulate
from drivetrain.simulation.study_scene import scene_of
from drivetrain.sizing.currents import PARTS, current_commands
from drivetrain.sizing.demand.demand import workload
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.study.parts.mounting import loaded_arm
from drivetrain.study.read import load_study

SPRING = Counterbalance(stiffness=900.0, free_length=0.12, lever_carrier=0.25, lever_link=0.1, dead_centre=0.4)
GAS = Counterbalance(
    gas_force=300.0, extended_length=0.4, stroke=0.3, progression=1.6, exponent=1.2, lever_carrier=0.25, lever_link=0.1,
    dead_centre=-1.0,
)  # fmt: skip
BIAS = Counterbalance(torque=1.5, angles=(-1.0, 0.0, 2.0), torques=(0.5, -0.7, 1.1))


def balanced(make, *balances, **changes):
    """An arm of two joints that swing, the first one balanced."""
    cycle = make.sines(2, samples=201, duration=3.0, size=0.6)
    tasks = (make.task("j1", counterbalances=balances), make.task("j2"))
    return make.study(cycle, arm=make.planar_arm([0.38, 0.35], [1.5, 0.6]), joints=tasks, **changes)


def bare(study):
    return replace(study, joints=tuple(replace(task, counterbalances=()) for task in study.joints))


def test_a_spring_on_levers_is_the_tendon_of_mujoco():
    """The tendon runs between a site of the world and one of the link: passive force of the joint."""
    model = mujoco.MjModel.from_xml_string("""
      <mujoco><worldbody>
        <site name="a" pos="0.25 0 0"/>
        <body><joint name="j" axis="0 0 1"/><geom size="0.01" mass="1"/>
          <site name="b" pos="0.09210609940028851 -0.03894183423086505 0"/></body>
      </worldbody><tendon><spatial stiffness="900" springlength="0.12">
        <site site="a"/><site site="b"/></spatial></tendon>
      </mujoco>""")
    data = mujoco.MjData(model)
    for angle in np.linspace(-3.0, 3.0, 25):
        data.qpos[0] = angle
        mujoco.mj_forward(model, data)
        found = counterbalance_torque((SPRING,), np.array(angle))
        np.testing.assert_allclose(found, data.qfrc_passive[0], rtol=1e-12, atol=1e-9)  # the site has 16 digits


@pytest.mark.parametrize("balance", [SPRING, GAS, BIAS])
def test_torques_are_slopes_of_energies(balance):
    """Work from angle to angle against the energy of the spring, and of a gas with p V^n constant, by the length."""
    low, high = -0.9, 1.7
    work = quad(lambda q: float(counterbalance_torque((balance,), np.array(q))), low, high, points=[0.0])[0]
    a, b = balance.lever_carrier, balance.lever_link

    def energy(angle):
        length = np.sqrt(a * a + b * b - 2.0 * a * b * np.cos(angle - balance.dead_centre))
        if balance is SPRING:
            return 0.5 * 900.0 * (length - 0.12) ** 2
        # Volume a unit of the rod's section: full when extended, smaller by x^(1/n) when pushed in.
        full = 0.3 / (1.0 - 1.6 ** (-1.0 / 1.2))
        return 300.0 * full**1.2 / 0.2 * (full - (0.4 - length)) ** -0.2

    if balance is BIAS:
        trapezes = 0.5 * 0.9 * (-0.7 + 0.5 - 0.1 * 1.2) + 1.7 * (-0.7 + 0.5 * 1.7 * 0.9)
        assert work == pytest.approx(1.5 * (high - low) + trapezes, rel=1e-12)
    else:
        assert work == pytest.approx(energy(low) - energy(high), rel=1e-9)


def test_the_gear_carries_what_is_left(make):
    study = balanced(make, SPRING, GAS, BIAS)
    found = evaluate(study)
    drives = {k: joint.drive for k, joint in enumerate(found.joints.values())}
    torque = counterbalance_torque(study.joints[0].counterbalances, study.cycle.position[:, 0])
    demands = [[workload(one).at(k, drives).demand(drives[k]) for k in (0, 1)] for one in (study, bare(study))]
    np.testing.assert_allclose(demands[0][0].gear_torque, demands[1][0].gear_torque - torque, atol=1e-12)
    np.testing.assert_array_equal(demands[0][1].gear_torque, demands[1][1].gear_torque)
    np.testing.assert_allclose(
        demands[0][0].stop.torque[::3], (demands[1][0].stop.torque - counterbalance_torque(
            study.joints[0].counterbalances, study.cycle.position[demands[1][0].stop.first, 0]))[::3], atol=1e-12
    )  # fmt: skip  # every third state is the one in which a stop begins
    speed, weights = study.cycle.velocity[:, 0], study.cycle.weights
    # Over a closed cycle a conservative torque does no work; the trapezes of 200 samples of a smooth one are exact.
    smooth = counterbalance_torque((SPRING, GAS), study.cycle.position[:, 0])
    assert abs(np.sum(smooth * speed * weights)) < 1e-6 * np.sum(np.abs(smooth * speed) * weights)


def test_a_brake_and_the_standstill_see_it(make):
    """Held still the gear bears gravity less the spring, with nothing else on the arm's first joint."""
    study = balanced(make, SPRING)
    cycle = study.cycle
    still = replace(study, cycle=replace(cycle, velocity=0.0 * cycle.velocity, acceleration=0.0 * cycle.acceleration))
    found = evaluate(still)
    drives = {name: joint.drive for name, joint in found.joints.items()}
    arm, zero = loaded_arm(still, drives, -1), np.zeros_like(cycle.position)
    wanted = inverse_dynamics(arm, cycle.position, zero, zero)[:, 0] - counterbalance_torque(
        (SPRING,), cycle.position[:, 0]
    )
    np.testing.assert_allclose(found.joints["j1"].series.gear_torque, wanted, atol=1e-10)


def test_simulation_draws_the_same_currents(make):
    study = balanced(make, SPRING, GAS, BIAS)
    found = evaluate(study)
    scene = scene_of(study, {name: joint.drive for name, joint in found.joints.items()})
    inverse = simulate(scene, solver=Inverse(), interval=0.015)
    series = found.joints["j1"].series
    at = np.searchsorted(inverse.time, series.time[1:-1] - 1e-9)
    torque = inverse["j1.current"][at] * found.joints["j1"].drive.motor.torque_constant
    turning = np.abs(series.speed[1:-1]) > 1e-6
    np.testing.assert_allclose(torque[turning], series.motor_torque[1:-1][turning], rtol=1e-6, atol=1e-9)
    forward = simulate(scene, solver=FixedStep(1e-3), interval=0.015)
    assert np.abs(forward["j1.position"] - forward["j1.command_position"]).max() < 1e-3  # of 0.6 rad: a loop's error


def test_currents_tell_its_part(make):
    found = evaluate(balanced(make, SPRING))
    table = current_commands(found)
    parts = table[[f"{name} current [A]" for name in PARTS]].sum(axis=1)
    np.testing.assert_allclose(parts, table["current [A]"], atol=1e-9)
    one, ratio = table[table["joint"] == "j1"], found.joints["j1"].drive.gear.ratio
    constant = one["motor torque [N m]"] / one["current [A]"]
    torque = counterbalance_torque((SPRING,), found.study.cycle.position[:, 0])
    np.testing.assert_allclose(one["counterbalance current [A]"] * constant * ratio, -torque, rtol=1e-6, atol=1e-9)


def test_a_table_is_relieved_too(make):
    time = np.linspace(0.0, 2.0, 41)
    cycle = make.table_cycle(time, 10.0 + 0.0 * time, np.sin(np.pi * time), np.pi * np.cos(np.pi * time))
    study = make.study(cycle, joints=(make.task("j1", counterbalances=(Counterbalance(torque=4.0),)),))
    np.testing.assert_allclose(evaluate(study).joints["j1"].series.gear_torque, 6.0, atol=1e-12)


STUDY = """
schema_version: 1
arm: planar-2r
drive_mass: included
motions: {there: {unit: deg, profile: quintic, durations: [1 s, 1 s], waypoints: [[0, 0], [90, -45], [0, 0]]}}
cycle: [{motion: there}]
supply: {voltage: 24 V}
motors:
  m: {resistance: 1 ohm, torque_constant: 0.05 N m/A, kind: brushed, current_basis: dc, winding_basis: line_line,
      source: test}
joints:
  default: {drive: {motor: m, gear: none}}
  joint_1:
    counterbalances:
"""


def test_a_study_states_them_with_units():
    spring = "{stiffness: 8 N/mm, free_length: 150 mm, lever_carrier: 200 mm, lever_link: 80 mm, dead_centre: 90 deg"
    plain = load_study(STUDY + "      - {torque: 1 N m}")
    found = load_study(
        STUDY + f"      - {spring}, mass: 2 kg, moves: true, com: [10 cm, 0 m, 0 m]}}\n"
        "      - {angles: [0 deg, 90 deg], torques: [1 N m, 2 N m]}"
    )
    one, other = found.joints[0].counterbalances
    assert (one.stiffness, one.lever_link, one.dead_centre) == pytest.approx((8000.0, 0.08, np.pi / 2.0))
    assert other.angles == pytest.approx((0.0, np.pi / 2.0))
    assert found.arm.masses[0] == pytest.approx(plain.arm.masses[0] + 2.0)


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ("{stiffness: 8 N/mm}", "lever_carrier and lever_link"),
        ("{torque: 1 kg}", "kg"),
        ("{angles: [0 deg, 10 deg], torques: [1 N m]}", "as many torques"),
        ("{dead_centre: 3 deg}", "says no torque"),
        ("{gas_force: 300 N, extended_length: 0.3 m, stroke: 0.1 m, lever_carrier: 0.2 m, lever_link: 0.15 m}", "cycle"),  # noqa: E501
        ("{stifness: 8 N/mm}", "stiffness"),
    ],
)  # fmt: skip
def test_faults_say_where(entry, words):
    with pytest.raises(InputError, match=words) as caught:
        load_study(STUDY + f"      - {entry}")
    assert "counterbalances" in str(caught.value)
