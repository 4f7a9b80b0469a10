"""Motors, gears and friction as effects agree with MuJoCo's ``dcmotor`` on the same scenes, as steps get short."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import mujoco
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from drivetrain.simulation.engines.adaptive_step import AdaptiveStep
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.run import simulate
from drivetrain.solvers.solver import Rodas4

SCENES = Path(__file__).resolve().parents[2] / "benchmarks" / "mujoco_scenes.py"


@pytest.fixture(scope="module")
def both():
    """The scenes of the benchmark, in both languages."""
    spec = importlib.util.spec_from_file_location("mujoco_scenes", SCENES)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # its dataclasses look their own module up
    spec.loader.exec_module(module)
    yield module
    del sys.modules[spec.name]


@pytest.fixture(scope="module")
def twins(both):
    return {
        "voltage": both.one_joint(),
        "bristles": both.one_joint_bristles(),
        "without inductance": both.six_joints(False),
        "with inductance": both.six_joints(True),
    }


NAMES = ("voltage", "bristles", "without inductance", "with inductance")


@pytest.mark.parametrize("name", NAMES)
def test_the_equations_are_the_same(both, twins, name: str) -> None:
    """MuJoCo's own accelerations and current rates under scipy's step control, against the adaptive engine."""
    ours = both.run_ours(twins[name], AdaptiveStep(Rodas4(1e-9)))
    # Tolerances of a step are 1e-9 and 1e-10; over some thousand steps, jumps and reversals, errors add up.
    assert both.error(ours, both.reference(twins[name])) < 1e-7


@pytest.mark.parametrize("name", NAMES)
def test_both_meet_at_short_steps(both, twins, name: str) -> None:
    """MuJoCo's step is of first order: half the step, half the distance to ours; ours falls by four."""
    true = both.run_ours(twins[name], AdaptiveStep(Rodas4(1e-9)))
    # Errors of two kinds cancel in part near half a millisecond, so the order shows at steps well below that.
    ours = [both.error(both.run_ours(twins[name], FixedStep(step)), true) for step in (1e-4, 5e-5, 2.5e-5)]
    theirs = []
    for step in (2e-4, 1e-4):
        there = both.InMujoco(twins[name], "Euler", step)
        there.run()
        theirs.append(both.error(there.answer(), true))
    assert ours[0] < 1e-4  # measured: 8e-6 to 4e-5
    assert ours[2] < ours[1] / 3.5
    assert theirs[1] < 3e-3  # measured: 9e-5 to 2.1e-3
    assert theirs[1] < theirs[0] / 1.8


def test_armature_is_the_reflected_rotor(both, twins) -> None:
    """The inertia that MuJoCo makes of rotor, gear and arm, against the one that a plan's mechanics tell."""
    for name in ("voltage", "with inductance"):
        twin = twins[name]
        model = mujoco.MjModel.from_xml_string(twin.xml.format(integrator="Euler", step="0.001"))
        data, n = mujoco.MjData(model), len(twin.scene.joints)
        data.qpos[:] = 0.0 if twin.scene.position is None else twin.scene.position
        data.qvel[:] = np.linspace(0.5, 1.0, n)
        mujoco.mj_forward(model, data)
        whole = np.zeros((n, n))
        mujoco.mj_fullM(model, data, whole)
        scene = type(twin.scene)(twin.scene.body, twin.scene.effects, 1e-3, data.qpos.copy(), data.qvel.copy())
        energy = simulate(scene).series["scene.kinetic_energy"].values[0]
        # MuJoCo keeps inertias as principal moments and quaternions, which costs some digits.
        assert energy == pytest.approx(0.5 * data.qvel @ whole @ data.qvel, rel=1e-10)


def test_voltage_and_inductance_by_hand(both, twins) -> None:
    """A third way, written out: L I' = V - R I - K G w and J w' = K G I - D w - m g l cos q; stiff, so by Radau."""
    twin = twins["voltage"]
    inertia = both.OWN + both.MASS * both.REACH**2 + both.ROTOR * both.RATIO**2
    drive, state, parts = both.CONSTANT * both.RATIO, np.zeros(3), []
    ends = [*(at for at, _ in twin.controls[1:]), twin.scene.duration]
    for (first, (volts,)), last in zip(twin.controls, ends, strict=True):

        def rates(_: float, y: np.ndarray, volts: float = volts) -> list[float]:
            load = both.DRAG * y[1] + both.MASS * both.G * both.REACH * np.cos(y[0])
            return [
                y[1],
                (drive * y[2] - load) / inertia,
                (volts - both.RESISTANCE * y[2] - drive * y[1]) / both.INDUCTANCE,
            ]

        state = solve_ivp(rates, (first, last), state, "Radau", rtol=1e-9, atol=1e-11).y[:, -1]
        parts.append(state)
    ours = both.run_ours(twin, AdaptiveStep(Rodas4(1e-9)))
    at = [round(end / both.INTERVAL) for end in ends]
    assert ours.positions[at, 0] == pytest.approx([p[0] for p in parts], abs=1e-7)  # of travels of some radians
    assert ours.currents[at, 0] == pytest.approx([p[2] for p in parts], abs=1e-6)  # of some amperes


@pytest.mark.parametrize("share", [0.5, 0.96])
def test_dry_friction_holds_here_and_creeps_there(both, share: float) -> None:
    """A joint below breakaway: not a bit of motion in ten seconds, where a regularised friction lets it sink."""
    xml, scene = both.holding(9.0, share, 10.0)
    model = mujoco.MjModel.from_xml_string(xml.format(integrator="implicitfast", step="0.001"))
    data = mujoco.MjData(model)
    data.qpos[0] = scene.position[0]
    mujoco.mj_step(model, data, 10_000)
    assert data.qpos[0] < scene.position[0] - 0.01
    held = simulate(scene, interval=1.0).series["joint.position"].values
    assert (held == scene.position[0]).all()
