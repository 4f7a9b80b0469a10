"""Two motors on one axis: halves and preload by hand, one drive twice as large, the search against brute force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import yaml
from random_tasks import feasible_sets
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline

from drivetrain.accuracy.study_run import simulate
from drivetrain.arm.arm import Arm
from drivetrain.commands.chain import write_chosen
from drivetrain.drive.drive import drive_inertia
from drivetrain.effects.control.cascade import PositionLoop
from drivetrain.errors import InputError
from drivetrain.simulation.engines.adaptive_step import AdaptiveStep
from drivetrain.simulation.engines.inverse import Inverse
from drivetrain.simulation.study_scene import SceneOptions, scene_of
from drivetrain.sizing.answers.ratio import ratio_study
from drivetrain.sizing.currents import current_commands
from drivetrain.sizing.deflection import tip_deflection, vibration
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.search.search import select
from drivetrain.solvers.solver import Rodas5P
from drivetrain.spatial.poses import pose
from drivetrain.study.model import StiffnessWish
from drivetrain.study.objects import study as make_study
from drivetrain.study.parts.mounting import second_motor
from drivetrain.study.read import load_study

MOTOR = {
    "torque_constant": 0.1, "resistance": 0.5, "rotor_inertia": 1e-4, "nominal_current": 8.0, "peak_current": 30.0,
    "peak_torque": 3.0, "mass": 0.8, "max_speed": 600.0, "kind": "brushless", "diameter": 0.06, "length": 0.05,
    "current_basis": "dc", "winding_basis": "line_line", "price": 100.0,
}  # fmt: skip
GEAR = {
    "ratio": 50, "kind": "planetary", "efficiency": 0.9, "mass": 1.0, "repeated_peak_torque": 60.0, "price": 80.0,
    "momentary_torque": 120.0, "average_torque_limit": 40.0, "max_input_speed": 600.0, "diameter": 0.08, "length": 0.06,
}  # fmt: skip
TIME = np.linspace(0.0, 2.0, 81)
NAMES = ("joint_1", "joint_2")


def planar(slides=()):
    """Two links in a vertical plane, of which some slide."""
    home = np.array([pose(point=[x, 0.0, 0.0]) for x in (0.15, 0.4)])
    screws = np.array([[0, -1.0, 0, 0, 0, 0], [0, -1.0, 0, 0, 0, -0.3]])
    for joint in slides:
        screws[joint] = [0, 0, 0, 0, 0, 1.0]
    return Arm.from_screws(
        home, screws, [2.0, 1.5], np.tile(0.01 * np.eye(3), (2, 1, 1)), tip=pose(point=[0.5, 0.0, 0.0]),
        joint_points=[[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]], joint_names=NAMES,
    )  # fmt: skip


def task(first=None, second=None, *, arm=None, motors=None, gears=None, drives=("M", "G"), **more):
    """A study of the two joints, each entry of a joint over one of a bearing of its own."""
    q = np.column_stack([0.4 * np.sin(np.pi * TIME), 0.6 * np.sin(2.0 * np.pi * TIME)])
    joints = {name: {"output_bearing": "external", **(own or {})}
              for name, own in zip(NAMES, (first, second), strict=True)}  # fmt: skip
    return make_study(
        arm=planar() if arm is None else arm, motion=(TIME, q), motors=motors or {"M": MOTOR},
        gears=gears or {"G": GEAR}, drives=drives, supply="48 V", stop={"ramp": 0.3}, joints=joints, drive_mass="added",
        **more,
    )  # fmt: skip


def friction(**more):
    return {"friction": {"coulomb": 1.0, "viscous": 0.5, **more}}


def required(evaluation, joint, check):
    return next(one.required for one in evaluation.joints[joint].checks if one.name == check)


def test_without_preload_it_is_one_drive_of_twice_the_size():
    """Twice the mass, inertia, torque a current and resistance: the same loads everywhere, the same power."""
    two = evaluate(task(friction(), {"motors": 2, **friction()}))
    twice = {name: 2.0 * MOTOR[name] for name in ("torque_constant", "resistance", "rotor_inertia", "mass")}
    large = {"M": MOTOR, "L": {**MOTOR, **twice, "peak_torque": 6.0}}
    gears = {"G": GEAR, "K": {**GEAR, "mass": 2.0}}
    drives = {"joint_1": ("M", "G"), "joint_2": ("L", "K")}
    one = evaluate(task(friction(), friction(), motors=large, gears=gears, drives=drives))
    series, both = (
        one.joints["joint_2"].series,
        [two.joints[name].series for name in ("joint_2", second_motor("joint_2"))],
    )
    size = np.abs(series.gear_torque).max()
    np.testing.assert_allclose(both[0].gear_torque + both[1].gear_torque, series.gear_torque, atol=1e-9 * size)
    np.testing.assert_allclose(both[0].motor_torque, 0.5 * series.motor_torque, atol=1e-9 * size)
    np.testing.assert_allclose(two.joints["joint_1"].series.gear_torque, one.joints["joint_1"].series.gear_torque,
                               atol=1e-9 * size)  # fmt: skip
    assert required(two, "joint_2", "inertia ratio") == pytest.approx(
        required(one, "joint_2", "inertia ratio"), rel=1e-9
    )
    powers = [next(c.required for c in found.shared if c.name == "supply mean power") for found in (one, two)]
    assert powers[1] == pytest.approx(powers[0], rel=1e-9)
    assert two.criteria["mass"] == pytest.approx(3.0 * (MOTOR["mass"] + GEAR["mass"]))
    assert two.criteria["price"] == pytest.approx(3.0 * (MOTOR["price"] + GEAR["price"]))


def test_halves_and_preload_by_hand():
    """A link that is held and swung: its torque by the closed form, of each gear half of it and the preload."""
    found = evaluate(task({"motors": 2, "preload": 30.0}, drives=("M", "G")))
    alone = evaluate(task())
    whole = alone.joints["joint_1"].series.gear_torque
    for name, sign in (("joint_1", 1.0), (second_motor("joint_1"), -1.0)):
        np.testing.assert_allclose(found.joints[name].series.gear_torque, 0.5 * whole + sign * 30.0, atol=1e-9)
        most = np.abs(0.5 * whole + sign * 30.0).max()
        assert required(found, name, "gear repeated peak torque") == pytest.approx(most, rel=1e-9)
        told = " ".join(found.joints[name].remarks)
        assert ("backlash closed" in told) == bool(np.abs(0.5 * whole).max() < 30.0)
    table = current_commands(found)
    for name, part in table.groupby("joint"):
        parts = [part[f"{one} current [A]"] for one in ("inertia", "gravity", "velocity", "counterbalance")]
        if name != "joint_2":
            constant = part["motor torque [N m]"] / part["current [A]"]
            np.testing.assert_allclose(sum(parts) * constant * 50, found.joints[name].series.gear_torque, atol=1e-6)
            sign = 1.0 if name == "joint_1" else -1.0
            np.testing.assert_allclose(parts[3] * constant * 50, sign * 30.0, rtol=1e-9)


SPRUNG = {
    "stiffness_1": 4e3,
    "stiffness_2": 6e3,
    "stiffness_3": 9e3,
    "torque_1": 6.0,
    "torque_2": 20.0,
    "backlash": 2e-3,
}
WISHES = {"first_resonance": 8.0, "tip_deviation": 0.02, "lost_motion": 0.002}


def figures(found):
    """What the arm does of what is wished: frequency, deviation, lost motion."""
    checks = {one.name: one for one in found.shared}
    resonance = checks["arm first resonance"].available
    return resonance, *(checks[f"arm {one}"].required for one in ("tip deviation", "lost motion"))


def test_two_gears_are_one_of_twice_the_stiffness():
    """Without preload; its springs bend as far at twice the torque, and its play is one gear's."""
    gear = {**GEAR, **SPRUNG}
    stiff = {name: (1.0 if name == "backlash" else 2.0) * value for name, value in SPRUNG.items()}
    for slides in ((), (0,)):
        travel = {"travel_per_turn": 0.05} if slides else {}
        two = evaluate(task({"motors": 2, **travel}, gears={"G": gear}, arm=planar(slides), stiffness=WISHES))
        twice = {name: 2.0 * MOTOR[name] for name in ("torque_constant", "resistance", "rotor_inertia", "mass")}
        large = {"M": MOTOR, "L": {**MOTOR, **twice, "peak_torque": 6.0}}
        gears, drives = {"G": gear, "K": {**gear, **stiff, "mass": 2.0}}, {"joint_1": ("L", "K"), "joint_2": ("M", "G")}
        one = evaluate(task(travel, motors=large, gears=gears, drives=drives, arm=planar(slides), stiffness=WISHES))
        # The winding of both gears against each other has a millionth of the inertia.
        assert figures(two) == pytest.approx(figures(one), rel=1e-5)
        told = tip_deflection(two)
        np.testing.assert_allclose(told.displacement, tip_deflection(one).displacement, atol=1e-9)
        np.testing.assert_allclose(vibration(two).free, vibration(one).free, rtol=1e-9)


def test_a_preload_takes_the_play_away():
    """Of the axis that it closes, as long as half of the load stays below it; the other joint keeps its own."""
    own = {"gears": {"G": {**GEAR, **SPRUNG}}, "stiffness": WISHES}
    loose, most = (
        figures(evaluate(task(**own)))[2],
        np.abs(evaluate(task(**own)).joints["joint_1"].series.gear_torque).max(),
    )
    second = 0.2 * SPRUNG["backlash"]  # the lever of the second joint
    closed, open_ = (figures(evaluate(task({"motors": 2, "preload": p}, **own)))[2] for p in (0.51 * most, 0.49 * most))
    assert closed == pytest.approx(second, rel=1e-9) and closed < 0.5 * loose
    assert open_ == pytest.approx(loose, rel=0.02)  # where the load is largest, in another pose than the loosest


def test_integrators_of_two_motors_with_a_preload_are_refused_when_the_study_is_read():
    control = {"simulation": {"control": {"default": {"integral_time": 0.1}}}}
    task({"motors": 2}, **control)  # without a preload both are computed as one motor
    with pytest.raises(InputError, match=r"simulation.control.default.integral_time.*act against each other"):
        task({"motors": 2, "preload": 30.0}, **control)


def test_a_preload_that_is_too_small_is_told():
    found = evaluate(task({"motors": 2, "preload": 2.0}))
    half = 0.5 * np.abs(evaluate(task()).joints["joint_1"].series.gear_torque)
    told = " ".join(found.joints["joint_1"].remarks)
    assert f"above {half.max():.4g} N m it stays closed" in told


@pytest.mark.parametrize(
    "check", ["gear repeated peak torque", "motor peak torque", "motor RMS current", "motor voltage"]
)
def test_a_higher_preload_is_never_better(check):
    worst = []
    for preload in (0.0, 1.0, 5.0, 20.0):
        found = evaluate(task({"motors": 2, "preload": preload, **friction()}))
        worst.append(max(required(found, name, check) for name in ("joint_1", second_motor("joint_1"))))
    assert (np.diff(worst) > 0.0).all()


def test_another_drive_of_the_axis_is_that_of_both_motors():
    """A ratio study of one of the two changes the rotors of both, which load the joint before."""

    def whole(ratio):
        gears = {"G": GEAR, "K": {**GEAR, "ratio": ratio}}
        drives = {"joint_1": ("M", "G"), "joint_2": ("M", "K")}
        return task(None, {"motors": 2}, gears=gears, drives=drives)

    found = ratio_study(whole(50), "joint_2")
    (window,) = found.windows
    slow, fast = (evaluate(whole(end)).joints["joint_1"].series.gear_torque for end in (window.low, window.high))
    wanted = np.abs(fast - slow).max() / np.abs(slow).max()
    assert wanted > 0.001
    assert found.reaction == {"joint_1": pytest.approx(wanted, rel=1e-6)}


def test_two_different_drives_of_one_axis_are_refused():
    study = task(None, {"motors": 2}, motors={"M": MOTOR, "S": {**MOTOR, "mass": 0.5}})
    with pytest.raises(InputError, match=r"drives.joint_2_motor_2: must be the drive of joint_2"):
        evaluate(study, {"joint_2": ("M", "G"), "joint_2_motor_2": ("S", "G")})
    one, both = (
        evaluate(study, dict.fromkeys(names, ("S", "G"))) for names in (("joint_2",), ("joint_2", "joint_2_motor_2"))
    )
    assert one.drives == both.drives


def test_a_slide_on_two_pinions():
    """The force of a slide over two racks: force times travel, halved, and the preload at the pinions."""
    own = {"stages": [{"type": "rack", "diameter": 0.08, "efficiency": 0.95}]}
    arm = planar(slides=(0,))
    alone, both = (evaluate(task({**own, **more}, arm=arm)) for more in ({}, {"motors": 2, "preload": 3.0}))
    whole = alone.joints["joint_1"].series.gear_torque
    np.testing.assert_allclose(both.joints["joint_1"].series.gear_torque, 0.5 * whole + 3.0, atol=1e-9)
    np.testing.assert_allclose(both.joints[second_motor("joint_1")].series.gear_torque, 0.5 * whole - 3.0, atol=1e-9)
    parts = current_commands(both).groupby("joint").get_group("joint_1")
    assert parts["counterbalance current [A]"].to_numpy() == pytest.approx(3.0 / both.joints["joint_1"].drive.gear.ratio
        / (parts["motor torque [N m]"] / parts["current [A]"]).iloc[1], rel=1e-6)  # fmt: skip


def test_a_spring_is_shared_too():
    balance = {"counterbalances": [{"stiffness": 800.0, "free_length": 0.1, "lever_carrier": 0.2, "lever_link": 0.08}]}
    alone, both = (evaluate(task({**balance, **more})) for more in ({}, {"motors": 2, "preload": 4.0}))
    whole = alone.joints["joint_1"].series.gear_torque
    assert np.abs(whole - evaluate(task()).joints["joint_1"].series.gear_torque).max() > 1.0
    np.testing.assert_allclose(both.joints["joint_1"].series.gear_torque, 0.5 * whole + 4.0, atol=1e-9)


def test_a_load_table_is_shared():
    torque, speed = 40.0 * np.cos(np.pi * TIME), np.sin(np.pi * TIME)
    lines = [f"{t},{a},{b}" for t, a, b in zip(TIME, torque, speed, strict=True)]
    text = "time [s],torque_axis [N m],speed_axis [rad/s]\n" + "\n".join(lines) + "\n"
    found = evaluate(load_study({
        "motions": {"table": {"samples": text}}, "supply": {"voltage": 48.0}, "motors": {"M": {**MOTOR, "source": "t"}},
        "gears": {"G": {**GEAR, "source": "t"}}, "catalogs": [], "open_cycle": True,
        "joints": {"axis": {"motors": 2, "preload": 8.0, "load_inertia": 2.0, "drive": {"motor": "M", "gear": "G"}}},
    }))  # fmt: skip
    for name, sign in (("axis", 1.0), (second_motor("axis"), -1.0)):
        series = found.joints[name].series
        wanted = 0.5 * np.interp(series.time, TIME, torque) + 8.0 * sign
        np.testing.assert_allclose(series.gear_torque, wanted, atol=1e-9)
        assert required(found, name, "inertia ratio") == pytest.approx(
            1.0 / (50**2 * drive_inertia(found.joints[name].drive)), rel=1e-9
        )


def choice(seed, wish=None):
    """Three motors and two gears of random sizes for every drive."""
    rng = np.random.default_rng(seed)
    motors, gears = {}, {}
    for i, size in enumerate(rng.uniform(0.4, 1.6, 3).tolist()):
        own = {"mass": size, "torque_constant": 0.08 * size, "rotor_inertia": 8e-5 * size**2, "peak_torque": 2.0 * size}
        motors[f"M{i}"] = {**MOTOR, **own}
    for i, size in enumerate(rng.uniform(0.5, 1.5, 2).tolist()):
        own = {"mass": size, "repeated_peak_torque": 50.0 * size, "average_torque_limit": 30.0 * size}
        gears[f"G{i}"] = {**GEAR, **own}
    own = {"motors": 2, "preload": float(rng.uniform(1.0, 15.0)), "candidates": {"pairs": "all"}}
    other, which = {"candidates": {"pairs": "all"}}, rng.integers(2)
    entries = (own, other) if which == 0 else (other, own)
    if wish is not None:
        for key, gear in gears.items():
            scale = rng.uniform(0.5, 2.0)
            gears[key] = gear | {name: scale * value for name, value in SPRUNG.items()}
    more = {} if wish is None else {"stiffness": wish}
    return task(*entries, motors=motors, gears=gears, drives=None, **more), f"joint_{which + 1}"


@pytest.mark.parametrize("seed", range(4))
def test_search_is_brute_force_where_springs_bind(seed):
    """Wishes that some of the sets that fit otherwise keep."""
    study, axis = choice(seed, WISHES)

    def fitting(wish):
        sets = feasible_sets(replace(study, stiffness=wish), lambda drives: drives[axis] == drives[second_motor(axis)])
        return list(sets)

    loose = fitting(StiffnessWish(first_resonance=0.1, tip_deviation=1.0, lost_motion=1.0))
    told = np.array([figures(one) for one in loose])
    slow, far, play = (np.quantile(told[:, k], share) for k, share in enumerate((0.3, 0.8, 0.8)))
    wish = StiffnessWish(first_resonance=slow * 0.9999, tip_deviation=far * 1.0001, lost_motion=play * 1.0001)
    stiff, found = fitting(wish), select(replace(study, stiffness=wish))
    assert 0 < len(stiff) < len(loose)
    assert found.objective == pytest.approx(min(one.objective for one in stiff), rel=1e-12)
    assert found.proof == "optimal"


@pytest.mark.parametrize("seed", range(4))
def test_search_is_brute_force(seed):
    study, axis = choice(seed)
    fitting = feasible_sets(study, lambda drives: drives[axis] == drives[second_motor(axis)])
    found = select(study)
    assert len(study.joints[0].pairs) == 6
    if not fitting:
        assert not found.drives
        return
    assert found.objective == pytest.approx(min(one.objective for one in fitting), rel=1e-12)
    assert found.drives[axis] == found.drives[second_motor(axis)] and found.proof == "optimal"
    assert evaluate(study, {name: found.drives[name] for name in NAMES}).objective == found.objective


def test_the_written_study_names_the_drive_once(tmp_path):
    study, axis = choice(1)
    path, target = tmp_path / "study.yaml", tmp_path / "chosen.yaml"
    path.write_text(study.to_yaml(), encoding="utf-8")
    found = select(load_study(path))
    write_chosen(found, target)
    joints = yaml.safe_load(target.read_text(encoding="utf-8"))["joints"]
    assert {*joints} == {*NAMES} and joints[axis]["motors"] == 2
    assert evaluate(load_study(target)).objective == pytest.approx(found.objective, rel=1e-12)


def test_what_does_not_go_with_two_motors():
    with pytest.raises(InputError) as error:
        task({"preload": 3.0}, {"motors": 2, "mount": {"carrier": "child"}},
             base={"z": {"amplitude": 0.1, "period": 2.0}})  # fmt: skip
    told = str(error.value)
    for part in ("requires two motors", "must be parent or base", "a base that moves"):
        assert part in told
    with pytest.raises(InputError, match="motors"):
        task({"motors": 3})
    study = task({"motors": 2, "preload": 3.0}, gears={"G": {**GEAR, **SPRUNG}})
    with pytest.raises(InputError, match=r"joints.joint_1.preload.*preload against each other"):
        vibration(evaluate(study))


WARM = {
    "inductance": 4e-4, "no_load_current": 0.3, "nominal_voltage": 48.0, "no_load_speed": 440.0,
    "resistance_winding_housing": 2.0, "resistance_housing_ambient": 3.0, "winding_time_constant": 20.0,
    "housing_time_constant": 600.0, "max_winding_temperature": 130.0,
}  # fmt: skip
DRAGS = {
    "mesh_efficiency": 0.93, "drag_torque": 0.05, "drag_speed": 300.0, "drag_speed_exponent": 0.4,
    "drag_temperature_1": -0.02, "drag_temperature_2": 1e-4, "seal_drag_torque": 0.01, "starting_torque": 0.08,
    "inertia": 2e-5,
}  # fmt: skip


def test_it_runs_as_two_windings_in_a_row():
    """Springs, drag, inductance and heat in: the same two drives as one sheet of twice the torque an ampere."""
    motor, gear = {**MOTOR, **WARM}, {**GEAR, **SPRUNG, **DRAGS}
    two = evaluate(task({"motors": 2, **friction()}, friction(), motors={"M": motor}, gears={"G": gear}))
    double = ("torque_constant", "resistance", "inductance", "rotor_inertia", "mass", "nominal_voltage", "peak_torque")
    halved = ("resistance_winding_housing", "resistance_housing_ambient")
    large = motor | {name: 2.0 * motor[name] for name in double} | {name: 0.5 * motor[name] for name in halved}
    more = ("stiffness_1", "stiffness_2", "stiffness_3", "torque_1", "torque_2", "mass", "inertia", "drag_torque")
    strong = gear | {name: 2.0 * gear[name] for name in (*more, "seal_drag_torque", "starting_torque")}
    parts = {"motors": {"M": motor, "L": large}, "gears": {"G": gear, "K": strong}}
    one = evaluate(task(friction(), friction(), drives={"joint_1": ("L", "K"), "joint_2": ("M", "G")}, **parts))
    run, same = (simulate(found, interval=5e-3) for found in (two, one))
    assert run.series.keys() == same.series.keys()
    for name, share in {"joint_1.current": 2.0, "joint_1.voltage": 0.5}.items():
        np.testing.assert_allclose(run[name], share * same[name], rtol=1e-6, atol=1e-6 * np.abs(same[name]).max())
    alike = ("position", "deflection", "mesh_torque", "winding_temperature", "housing_temperature", "electrical_power")
    for name in alike:
        for joint in NAMES:
            wanted = same[f"{joint}.{name}"]
            np.testing.assert_allclose(run[f"{joint}.{name}"], wanted, rtol=1e-6, atol=1e-6 * np.abs(wanted).max())


def test_what_it_runs_with_is_what_is_judged():
    """As commanded, at the cold winding's constants: each motor's current is half of what the run takes."""
    found = evaluate(task({"motors": 2, **friction()}, friction()))
    run = simulate(found, solver=Inverse(), interval=TIME[1])
    inside = slice(1, -1)  # where it sets off and stops both roads take the motion's own way
    for name, motors in (("joint_1", ("joint_1", second_motor("joint_1"))), ("joint_2", ("joint_2",))):
        series = [found.joints[one].series for one in motors]
        judged = sum(np.interp(run.time, one.time, one.current) for one in series)
        np.testing.assert_allclose(run[f"{name}.current"][inside], judged[inside], rtol=1e-6, atol=1e-6)


def test_both_motors_written_out():
    """One inertia that two motors swing against a torque, each with a current of its own, by another solver."""
    load, torque, time = 2.0, 30.0, np.linspace(0.0, 1.0, 401)
    speed = 0.5 * np.sin(2.0 * np.pi * time)
    acceleration = np.pi * np.cos(2.0 * np.pi * time)
    given = load * acceleration + torque
    lines = [f"{t},{a},{b},{c}" for t, a, b, c in zip(time, given, speed, acceleration, strict=True)]
    text = "time [s],torque_axis [N m],speed_axis [rad/s],acceleration_axis [rad/s^2]\n" + "\n".join(lines) + "\n"
    study = load_study({
        "motions": {"table": {"samples": text}}, "supply": {"voltage": 48.0}, "motors": {"M": {**MOTOR, "source": "t"}},
        "gears": {"G": {**GEAR, "efficiency": 1.0, "source": "t"}}, "catalogs": [], "open_cycle": True,
        "joints": {"axis": {"motors": 2, "load_inertia": load, "drive": {"motor": "M", "gear": "G"},
                            "stop": {"ramp": "0.3 s"}}},
    })  # fmt: skip
    drives = {name: one.drive for name, one in evaluate(study).joints.items()}
    scene, own = scene_of(study, drives, options=SceneOptions(feed_forward=False)), drive_inertia(drives["axis"])
    run = simulate(scene, solver=AdaptiveStep(Rodas5P(rtol=1e-8)), interval=0.05)
    [loop] = [one for one in scene.effects["axis"] if isinstance(one, PositionLoop)]

    instants, first = np.unique(study.cycle.time, return_index=True)
    wanted = CubicHermiteSpline(instants, study.cycle.position[first, 0], study.cycle.velocity[first, 0])

    def rates(t, x):
        """Each motor has half of the current that the loop asks for, a rotor and a mesh of its own."""
        asked = loop.stiffness * (wanted(t) - x[0]) + loop.damping * (wanted(t, 1) - x[1])
        currents = [0.5 * asked / (50.0 * MOTOR["torque_constant"])] * 2
        pushed = sum(50.0 * MOTOR["torque_constant"] * current for current in currents)
        moved = load + sum(50.0**2 * own for _ in currents)
        return [x[1], (pushed - torque) / moved]

    start = [run["axis.position"][0], run["axis.speed"][0]]
    swung = solve_ivp(rates, (0.0, 1.0), start, t_eval=run.time, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(run["axis.position"], swung.y[0], atol=1e-6)
