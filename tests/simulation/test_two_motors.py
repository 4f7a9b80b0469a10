"""Two motors on one axis that push against each other: written out for another solver, limits, lost motion, energy."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from typer.testing import CliRunner

from drivetrain.accuracy.scenes import full_scene
from drivetrain.accuracy.study_run import simulate
from drivetrain.arm.arm import Arm
from drivetrain.arm.closures import second_motor, with_second_motors
from drivetrain.arm.geared import with_rotors
from drivetrain.arm.rotors import Rotor
from drivetrain.cli import app
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.effects.control.cascade import PositionLoop
from drivetrain.effects.control.commanded_motion import CommandedMotion
from drivetrain.effects.control.computed_torque import ComputedTorque
from drivetrain.effects.control.preload import Preload
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.friction.viscous_friction import ViscousFriction
from drivetrain.effects.gear.mesh_loss import MeshLoss
from drivetrain.effects.gear.springs import Backlash
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.errors import InputError
from drivetrain.motion.motion import Motion
from drivetrain.simulation.engines.adaptive_step import AdaptiveStep
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.engines.inverse import demanded
from drivetrain.simulation.engines.starting import initial_memory
from drivetrain.simulation.planning.plan import plan
from drivetrain.simulation.scene import Scene
from drivetrain.simulation.study_scene import scene_of
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.solvers.solver import Rodas5P
from drivetrain.study.read import load_study

sys.path.insert(0, str(Path(__file__).parents[1] / "sizing"))
from test_second_motors import DRAGS, GEAR, MOTOR, SPRUNG, TIME, WARM, friction, planar, task

FIRST, SECOND = "axis", second_motor("axis")
LINK, LOOP = 2.0, (3000.0, 150.0)  # kg m^2, N m/rad, N m s/rad
RATIOS, ROTORS, CONSTANTS = (50.0, -40.0), (1e-4, 2e-4), (0.1, 0.16)
STIFF, PLAY, DAMPED = (8e3, 6e3), (2e-3, 3e-3), (8.0, 6.0)
ETA, BACK = 0.9, 0.85
SPEED, SWING, PULSE = 2.0, 40.0, 12.0  # rad/s, N m, rad/s


def axis_scene(preload, *, speed=SPEED, swing=SWING, pulse=PULSE, duration=1.0, play=PLAY, loss=True):
    """One link without weight that two unequal motors turn at one speed, against a torque that swings."""
    link = Arm.from_screws(
        np.eye(4)[None], [[0, 0, 1.0, 0, 0, 0]], [0.0], [np.diag([0.0, 0.0, LINK])], gravity=(0.0, 0.0, 0.0),
        joint_names=[FIRST], check_inertias=False,
    )  # fmt: skip
    rotors = [Rotor(ratio, inertia, carrier=-1) for ratio, inertia in zip(RATIOS, ROTORS, strict=True)]
    effects = {}
    for k, (name, push) in enumerate(((FIRST, preload), (SECOND, -preload))):
        motor = Motor(f"M{k}", torque_constant=CONSTANTS[k], resistance=0.5)
        gear = Gear(f"G{k}", ratio=RATIOS[k], kind="planetary", efficiency=ETA, backdriving_efficiency=BACK,
                    stiffness_1=STIFF[k], backlash=play[k])  # fmt: skip
        effects[name] = (MotorCurrent(motor), Preload(motor, push), Backlash(gear, DAMPED[k]))
        effects[name] += (PositionLoop(*LOOP, CONSTANTS[k]),)
        effects[name] += (MeshLoss(gear),) if loss else ()
    time = np.linspace(0.0, duration, round(1000 * duration) + 1)
    motion = np.column_stack([speed * time] * 2)
    rest = np.zeros_like(motion)
    effects[FIRST] += (ViscousFriction(Friction(viscous=3.0)), GivenTorque(time, swing * np.sin(pulse * time)))
    effects["scene"] = (CommandedMotion(Motion("turning", (FIRST, SECOND), time, motion, rest + speed, rest)),)
    return Scene(with_rotors(with_second_motors(link, [0]), rotors), effects, duration)


def flanks(k, wind_up, rate, play=PLAY):
    """Torque of a gear on the link: a spring and a damper at the flank that is touched, which never pull."""
    deep = abs(wind_up) - 0.5 * play[k]
    if deep <= 0.0:
        return 0.0
    side = math.copysign(1.0, wind_up)
    return side * max(STIFF[k] * deep + DAMPED[k] * side * rate, 0.0)


def zero(k, preload, play=PLAY):
    """Wind-up under nothing but the preload."""
    push = (preload, -preload)[k]
    return 0.0 if push == 0.0 else push / STIFF[k] + math.copysign(0.5 * play[k], push)


def written_out(preload):
    """The equations of the link and the two rotors, all angles behind the gears."""
    push, inertia = (preload, -preload), [r * r * j for r, j in zip(RATIOS, ROTORS, strict=True)]

    def rates(t, x):
        q, first, second, qd, first_speed, second_speed = x
        angles = (first - zero(0, preload), second - zero(1, preload))
        late, slow = SPEED * t - np.array(angles), SPEED - np.array([first_speed, second_speed])
        asked = LOOP[0] * late + LOOP[1] * slow
        gears = [flanks(0, first - q, first_speed - qd), flanks(1, second - q, second_speed - qd)]
        # Neither motor turns back: a mesh takes its share of what it carries, by who drives whom.
        lost = [torque * (1.0 / ETA - 1.0) if torque > 0.0 else torque * (BACK - 1.0) for torque in gears]
        turned = [(asked[k] + push[k] - gears[k] - lost[k]) / inertia[k] for k in range(2)]
        return [
            qd, first_speed, second_speed,
            (sum(gears) - 3.0 * qd + SWING * math.sin(PULSE * t)) / LINK, *turned,
        ]  # fmt: skip

    return rates


def test_preloaded_motors_begin_at_their_command() -> None:
    """At rest under a load each sags behind it by what its loop needs; the link by the twist beyond the preload's."""
    scene, load = axis_scene(20.0, speed=0.0), 12.0
    effects = dict(scene.effects)
    effects[FIRST] = (*effects[FIRST][:-1], GivenTorque([0.0], [-load]))
    done = plan(replace(scene, effects=effects))
    at = done.memory.view(initial_memory(done), "coordinates")
    assert at["position"][0] == pytest.approx(-0.5 * load * (1.0 / STIFF[0] + 1.0 / LOOP[0]), rel=1e-9)
    twist = [(0.5 * load + push) / STIFF[k] + math.copysign(0.5 * PLAY[k], push) for k, push in ((0, 20.0), (1, -20.0))]
    assert at["position"][[2, 1]] == pytest.approx(twist, rel=1e-9)


@pytest.mark.parametrize("preload", [0.0, 8.0, 30.0])
def test_both_rotors_written_out(preload):
    """By scipy, the flanks left and met again unless the preload keeps them; no motor turns back."""
    run = simulate(axis_scene(preload), solver=AdaptiveStep(Rodas5P(rtol=1e-9)), interval=0.01)
    at = [run[f"{FIRST}.position"][0]]
    at += [at[0] + run[f"{name}.deflection"][0] for name in (FIRST, SECOND)]
    start = [*at, *([SPEED] * 3)]
    found = solve_ivp(written_out(preload), (0.0, 1.0), start, "LSODA", run.time, rtol=1e-9, atol=1e-11, max_step=1e-3)
    assert min(found.y[4].min(), found.y[5].min()) > 0.0
    np.testing.assert_allclose(run[f"{FIRST}.position"], found.y[0], atol=1e-6)
    np.testing.assert_allclose(run[f"{SECOND}.position"], found.y[0], atol=1e-6)
    for k, name in enumerate((FIRST, SECOND)):
        np.testing.assert_allclose(run[f"{name}.deflection"], found.y[1 + k] - found.y[0], atol=1e-6)
        np.testing.assert_allclose(run[f"{name}.shaft_speed"], found.y[4 + k], atol=1e-4)
        angle = RATIOS[k] * (found.y[1 + k] - zero(k, preload))
        np.testing.assert_allclose(run[f"{name}.motor_position"], angle, atol=1e-4)
    parted = [np.abs(run[f"{name}.mesh_torque"]).min() == 0.0 for name in (FIRST, SECOND)]
    assert parted == [preload < 30.0] * 2
    fixed = simulate(axis_scene(preload), solver=FixedStep(1e-4), interval=0.01)
    np.testing.assert_allclose(fixed[f"{FIRST}.position"], run[f"{FIRST}.position"], atol=2e-5)


@pytest.mark.parametrize(("engine", "share"), [(FixedStep(1e-4), 1e-5), (AdaptiveStep(Rodas5P(rtol=1e-7)), 1e-6)])
def test_energy_is_accounted_for(engine, share):
    """Flanks that hit, meshes that lose; of the fixed step up to the square of the step."""
    run = simulate(axis_scene(8.0), solver=engine, interval=0.01)
    passed = max(np.ptp(run[f"{name}.electrical_energy"]) for name in (FIRST, SECOND))
    assert passed > 10.0
    assert np.abs(run["energy_error"]).max() < share * passed


def swung(preload, play=PLAY, at=(-2.0, 2.0)):
    """Where the link stands while a slow torque at it turns round, without what the loops give way [rad]."""
    pulse = 0.1 * math.pi
    scene = axis_scene(preload, speed=0.0, swing=20.0, pulse=pulse, duration=15.0, play=play, loss=False)
    run = simulate(scene, solver=FixedStep(1e-3), interval=1e-2)
    torque, falling = 20.0 * np.sin(pulse * run.time), run.time > 5.0
    place = run[f"{FIRST}.position"] - torque / (2.0 * LOOP[0])
    return np.interp(at, torque[falling][::-1], place[falling][::-1])


def test_a_preload_takes_the_lost_motion():
    """Without it the link falls through the play at a reversal; with it both springs hold up to twice the preload."""
    stiff = sum(STIFF)
    [first, last] = swung(0.0)
    assert last - first > min(PLAY)
    places = np.array([-7.0, -2.0, 2.0, 7.0])
    closed = swung(5.0, at=places)
    np.testing.assert_allclose(closed, swung(5.0, (0.0, 0.0), at=places), atol=1e-8)
    # It turns slowly, against loops that damp it by 300 N m s/rad.
    np.testing.assert_allclose(np.diff(closed), np.diff(places) / stiff, rtol=0.04)
    [first, last] = swung(5.0, at=(-15.0, 15.0))
    assert last - first > 1.5 * 30.0 / stiff


def two(preload, gear=None, more=None, **own):
    """A study of two joints, two motors on the first."""
    gears = {"G": {**GEAR, **SPRUNG, **DRAGS, **(gear or {})}}
    first = {"motors": 2, "preload": preload, **friction(), **(more or {})}
    return task(first, friction(), motors={"M": {**MOTOR, **WARM}}, gears=gears, **own)


def test_next_to_no_preload_without_play_is_one_drive_of_twice_the_size():
    """All effects; both roads have the same springs, and none of the second motor's own."""
    gear = {"backlash": None}
    apart, single = (simulate(evaluate(two(push, gear)), interval=5e-3) for push in (1e-9, 0.0))
    assert SECOND.replace(FIRST, "joint_1") in {name.partition(".")[0] for name in apart.series}
    names = [f"joint_1.{one}" for one in ("position", "deflection", "voltage", "winding_temperature", "motor_speed")]
    for name in (*names, *(f"joint_2.{one}" for one in ("position", "current", "mesh_torque"))):
        wanted = single[name]
        np.testing.assert_allclose(apart[name], wanted, rtol=1e-6, atol=1e-6 * np.abs(wanted).max(), err_msg=name)
    for name in ("current", "mesh_torque", "electrical_power", "mesh_power"):
        wanted, both = single[f"joint_1.{name}"], (apart[f"{one}.{name}"] for one in ("joint_1", "joint_1_motor_2"))
        np.testing.assert_allclose(sum(both), wanted, rtol=1e-6, atol=1e-6 * np.abs(wanted).max(), err_msg=name)


def test_stiff_gears_run_as_rigid_ones():
    """A thousand times as stiff: the axis that sizing and simulation know as one rigid motor of twice the size."""
    stiff = {name: 1e3 * SPRUNG[name] for name in ("stiffness_1", "stiffness_2", "stiffness_3")} | {"backlash": None}
    found = evaluate(two(1e-9, stiff)), evaluate(two(0.0, stiff))
    kept = ("mesh_loss", "full_rotor", "viscous_friction")
    apart, rigid = (
        simulate(replace_effects(one, kept), interval=5e-3) for one in found
    )  # fmt: skip
    assert "joint_1.deflection" in apart.series and "joint_1.deflection" not in rigid.series
    size = np.ptp(rigid["joint_1.position"])
    np.testing.assert_allclose(apart["joint_1.position"], rigid["joint_1.position"], atol=2e-5 * size)


def replace_effects(evaluation, effects):
    study = evaluation.study
    return replace(evaluation, study=replace(study, simulation=replace(study.simulation, effects=effects)))


def test_what_is_fed_forward_is_what_is_judged():
    """Of each motor half of the load and the preload, mesh and rotor: as sizing has it for the cold winding."""
    gear = {**GEAR, **SPRUNG}
    found = evaluate(task({"motors": 2, "preload": 12.0, **friction()}, friction(), gears={"G": gear}))
    scene = full_scene(found)
    demand = demanded(plan(scene), TIME)
    for i, name in enumerate(scene.joints):
        series, turning = found.joints[name].series, np.abs(demand.speed[:, i]) > 1e-9
        torque, current = (np.interp(TIME, series.time, one) for one in (series.gear_torque, series.current))
        inside = np.flatnonzero(turning)[1:-1]  # at rest, setting off and stopping both roads take the motion's own way
        assert len(inside) > 70
        np.testing.assert_allclose(demand.mesh_torque[inside, i], torque[inside], rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose(demand.current[inside, i], current[inside], rtol=1e-6, atol=1e-6)


def test_the_preload_holds_while_it_runs():
    """A stronger preload keeps both gears on their flanks, all effects in; a weak one does not."""
    names = ("joint_1", "joint_1_motor_2")
    held, loose = (simulate(evaluate(two(push)), interval=5e-3) for push in (25.0, 3.0))
    for name, side in zip(names, (1.0, -1.0), strict=True):
        assert (side * held[f"{name}.mesh_torque"][1:-1]).min() > 0.0
    assert min((side * loose[f"{name}.mesh_torque"]).min() for name, side in zip(names, (1, -1), strict=True)) <= 0.0


def test_a_table_of_loads_runs_as_one_drive_of_twice_the_size():
    """The axis without an arm, friction at its joint, next to no preload and no play."""
    lines = [f"{t},{40.0 * np.cos(np.pi * t)},{np.sin(np.pi * t)}" for t in TIME]
    text = "time [s],torque_axis [N m],speed_axis [rad/s]\n" + "\n".join(lines) + "\n"
    gear = {**GEAR, **SPRUNG, "backlash": None, "source": "t"}
    apart, single = (
        simulate(load_study({
            "motions": {"table": {"samples": text}}, "supply": {"voltage": 48.0}, "open_cycle": True, "catalogs": [],
            "motors": {"M": {**MOTOR, "source": "t"}}, "gears": {"G": gear},
            "joints": {FIRST: {"motors": 2, "preload": push, "load_inertia": 2.0, "stop": {"ramp": 0.3}, **friction(),
                               "drive": {"motor": "M", "gear": "G"}}},
        }), interval=5e-3)
        for push in (1e-9, 0.0)
    )  # fmt: skip
    assert f"{SECOND}.deflection" in apart.series
    for name in (f"{FIRST}.position", f"{FIRST}.deflection", f"{FIRST}.joint_friction"):
        wanted = single[name]
        np.testing.assert_allclose(apart[name], wanted, rtol=1e-6, atol=1e-6 * np.abs(wanted).max(), err_msg=name)
    np.testing.assert_allclose(2.0 * apart[f"{SECOND}.current"], single[f"{FIRST}.current"], rtol=1e-6, atol=1e-6)


def test_unequal_motors_run():
    """Without a preload unequal drives run apart, too; half of the load each."""
    study = two(0.0)
    drives = {name: one.drive for name, one in evaluate(study).joints.items()}
    motor = replace(drives["joint_1"].motor, torque_constant=0.13)
    unequal = drives | {"joint_1_motor_2": replace(drives["joint_1"], motor=motor)}
    run = simulate(scene_of(study, unequal), interval=5e-3)
    assert np.abs(run["joint_1.position"] - run["joint_1.command_position"]).max() < 5e-3
    halves = [run[f"{name}.mesh_torque"][20:-20] for name in ("joint_1", "joint_1_motor_2")]
    assert rms(halves[0] - halves[1]) < 0.2 * rms(halves[0])


def rms(values):
    return float(np.sqrt(np.mean(values**2)))


def test_what_is_refused():
    scene = axis_scene(5.0)
    first, second = scene.effects[FIRST], scene.effects[SECOND]

    def told(**effects):
        with pytest.raises(InputError) as error:
            simulate(replace(scene, effects=dict(scene.effects) | effects), interval=0.1)
        return str(error.value)

    sprung = tuple(one for one in second if not isinstance(one, Backlash))
    assert "parts the two motors" in told(**{SECOND: sprung})
    rubbing = DryFriction(Friction(coulomb=1.0))
    assert "at the joint of a second motor" in told(**{SECOND: (*second, rubbing)})
    alike = tuple(replace(one, torque=5.0) if isinstance(one, Preload) else one for one in second)
    assert "more or less than it pushes" in told(**{SECOND: alike})
    computed = ComputedTorque(20.0, tuple(zip((FIRST, SECOND), CONSTANTS, strict=True)))
    assert "one motor a joint only" in told(scene=(*scene.effects["scene"], computed))
    alone = with_rotors(scene.body.linkage.chains[0], [scene.body.rotors[0]])
    with pytest.raises(InputError, match="no second motor on the axis"):
        plan(Scene(alone, {FIRST: first}, 1.0))
    rigid = task({"motors": 2, "preload": 3.0})
    with pytest.raises(InputError, match=r"gear G.stiffness_1.*parts the motors of joint_1"):
        scene_of(rigid, {name: one.drive for name, one in evaluate(rigid).joints.items()})
    own = {"stages": [{"type": "rack", "diameter": 0.08, "efficiency": 0.95}]}
    sliding = task({"motors": 2, "preload": 3.0, **own}, arm=planar(slides=(0,)))
    with pytest.raises(InputError, match="of a joint that slides are not simulated apart"):
        simulate(evaluate(sliding))


def test_the_words_of_a_run(tmp_path):
    """From the shell: what was run, both motors, exit code 0."""
    path = tmp_path / "study.yaml"
    path.write_text(two(12.0).to_yaml(), encoding="utf-8")
    run = CliRunner().invoke(app, ["simulate", str(path), "--out", str(tmp_path / "run")])
    assert run.exit_code == 0, run.output
    assert "joint_1 and joint_1_motor_2 push against each other with 12 N m" in run.output
    page = (tmp_path / "run" / "simulation.html").read_text(encoding="utf-8")
    assert "push against each other with 12 N m" in page and "joint_1_motor_2" in page
