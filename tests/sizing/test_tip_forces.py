"""Forces at the tip: by virtual work along the motion, and against stronger gravity, which loads a slide alike."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

import drivetrain as dt
from drivetrain.dynamics.closed import main_chain
from drivetrain.errors import InputError
from drivetrain.sizing.demand.changed_work import WorkFamily
from drivetrain.sizing.demand.load_basis import load_basis
from drivetrain.study.change import TaskChange
from drivetrain.study.parts.tolerances import Tolerance, Tolerances
from drivetrain.study.read import load_study

CARRIED, PUSHED = 8.0, 60.0  # [kg] behind the vertical slide, [N] downwards
EARTH = 9.81  # [m/s^2]
EXAMPLES = Path(__file__).parents[2] / "examples"
STEPS = [{"motion": "up", "force": "push"}, {"dwell": 0.2, "force": "push"}, {"motion": "down", "force": "push"}]


def slides(gravity: float, force: dict | None, **changes) -> dt.study.Study:
    """A gantry of a slide along x that carries one along z, with a mass at its end."""
    home = np.tile(np.eye(4), (2, 1, 1)).tolist()
    arm = {
        "home": home, "screws": [[0, 0, 0, 1, 0, 0], [0, 0, 0, 0, 0, 1]], "masses": [5.0, CARRIED],
        "inertias": (np.tile(np.eye(3), (2, 1, 1)) * 0.1).tolist(), "gravity": [0, 0, -gravity],
        "joint_names": ["x", "z"],
    }  # fmt: skip
    motor = {
        "kind": "brushless", "torque_constant": 0.1, "resistance": 0.5, "inductance": 1e-3, "rotor_inertia": 5e-5,
        "nominal_voltage": 48, "nominal_torque": 0.6, "nominal_current": 6, "source": "test", "peak_torque": 3.0,
        "current_basis": "dc", "winding_basis": "line_line",
        "peak_current": 30, "max_speed": 500, "mass": 1.0, "max_winding_temperature": 130,
        "resistance_winding_housing": 1.0, "resistance_housing_ambient": 2.0, "winding_time_constant": 30,
        "housing_time_constant": 900,
    }  # fmt: skip
    brake = {
        "kind": "spring", "torque_side": "motor", "source": "test", "static_torque": 2.0, "engage_time": 0.03,
        "inertia": 1e-5, "power": 10, "energy_per_stop": 50.0,
    }  # fmt: skip
    own = {"drive": {"motor": "m", "gear": "none"}, "travel_per_turn": "20 mm/rev", "friction": {"coulomb": 0.02}}
    steps = STEPS if force else [{name: one for name, one in step.items() if name != "force"} for step in STEPS]
    rest, raised = [0.0, 0.0], [0.3, 0.4]
    stated = {
        "arm": {"from_screws": arm}, "drive_mass": "included", "forces": {"push": force} if force else {},
        "motions": {
            "default": {"profile": "quintic", "speed": 1.0, "acceleration": 4.0},
            "up": {"waypoints": [rest, raised]}, "down": {"waypoints": [raised, rest]},
        },
        "cycle": steps, "motors": {"m": motor},
        "brakes": {"b": brake},
        "supply": {"voltage": 48, "regenerated_power": 500}, "open_cycle": False,
        "amplifier": {"current_basis": "dc", "peak_current": 30, "continuous_current": 10},
        "joints": {"default": own, "z": {"brake": "b"}},
        **changes,
    }  # fmt: skip
    return load_study(stated)


def downwards(force: float) -> dict:
    return {"force": [0, 0, -force], "axes": "base", "applied_by": "surroundings"}


def figures(evaluation) -> dict:
    found = {(name, one.name): one.required for name, joint in evaluation.joints.items() for one in joint.checks}
    return found | {("set", one.name): one.required for one in evaluation.shared}


@pytest.mark.parametrize("stop", [{}, {"ramp": "0.15 s"}, {"current": 20.0, "rise": 0.01}])
def test_a_force_downwards_is_stronger_gravity(stop):
    """Everything but the mass that gravity accelerates agrees: peaks, heat, stops, power failures, brakes."""
    pushed = dt.evaluate(slides(EARTH, downwards(PUSHED), stop=stop))
    heavier = dt.evaluate(slides(EARTH + PUSHED / CARRIED, None, stop=stop))
    alone = dt.evaluate(slides(EARTH, None, stop=stop))
    found, wanted, before = figures(pushed), figures(heavier), figures(alone)
    assert found.keys() == wanted.keys()
    for name, value in wanted.items():
        assert found[name] == (None if value is None else pytest.approx(value, rel=1e-9)), name
    changed = {name for _, name in found if found[_, name] != before[_, name]}
    assert {"motor RMS current", "holding brake torque", "motor peak torque"} <= changed


def test_the_brake_holds_without_a_force_that_helps():
    """A force that lifts unloads the motor in motion; the brake must hold the mass alone, as power is off."""
    lifted, alone = (dt.evaluate(slides(EARTH, force)) for force in (downwards(-PUSHED), None))
    brake = ("z", "holding brake torque")
    assert figures(lifted)[brake] == pytest.approx(figures(alone)[brake], rel=1e-12)
    assert figures(lifted)["z", "motor RMS current"] < 0.5 * figures(alone)["z", "motor RMS current"]


def test_a_force_keeps_its_value_at_another_pace_and_payload():
    pushed, heavier = slides(EARTH, downwards(PUSHED)), slides(EARTH + PUSHED / CARRIED, None)
    for time in (0.8, 1.7):
        change = TaskChange(time=time)
        one, other = (WorkFamily(study).at(change) for study in (pushed, heavier))
        for mine, wanted in zip(one.basis, other.basis, strict=True):
            np.testing.assert_allclose(mine.bare.torque, wanted.bare.torque, rtol=1e-9, atol=1e-9)
        for mine, wanted in zip(one.resting, other.resting, strict=True):
            count = wanted.bare.torque.shape[-1]
            np.testing.assert_allclose(mine.bare.torque[:count], wanted.bare.torque, rtol=1e-9, atol=1e-9)
    quickest = [dt.fastest(study).duration for study in (pushed, heavier)]
    assert quickest[0] == pytest.approx(quickest[1], rel=1e-6)


def test_a_force_keeps_its_value_at_each_place_of_a_rebuilt_motion():
    """A force that grows along a coarsely sampled move, at the rebuilt samples of the quickest motion."""
    time = np.linspace(0.0, 1.0, 21)
    height = 0.4 * (10.0 * time**3 - 15.0 * time**4 + 6.0 * time**5)
    rows = "".join(f"{t!r},0,{z!r}\n" for t, z in zip(time.tolist(), height.tolist(), strict=True))
    presses = "".join(f"{t!r},{-100.0 * z!r}\n" for t, z in zip(time.tolist(), height.tolist(), strict=True))
    force = {"samples": f"time [s],force_z [N]\n{presses}", "applied_by": "surroundings"}
    back = {"waypoints": [[0.0, 0.4], [0.0, 0.0]], "profile": "quintic", "speed": 1.0, "acceleration": 4.0}
    motions = {"up": {"samples": f"time [s],q_x [m],q_z [m]\n{rows}", "smoothing": 0.0}, "back": back}
    cycle = [{"motion": "up", "force": "push"}, {"motion": "back"}]
    found = dt.fastest(slides(EARTH, force, motions=motions, cycle=cycle)).study.cycle
    assert len(found.time) > 300
    up = found.segment == 0
    np.testing.assert_allclose(found.tip_wrench[up, 5], 100.0 * found.position[up, 1], atol=0.15)  # of the spline


@pytest.mark.parametrize("solver", [dt.FixedStep(1e-3), dt.AdaptiveStep(), dt.Inverse()])
def test_a_simulated_force_is_stronger_gravity(solver):
    pushed, heavier = (
        dt.simulate(dt.evaluate(study), solver=solver)
        for study in (slides(EARTH, downwards(PUSHED)), slides(EARTH + PUSHED / CARRIED, None))
    )
    for name in ("x.current", "z.current", "z.position", "z.mesh_torque"):
        if name in heavier.series:
            scale = np.abs(heavier[name]).max()
            # within the tolerance of the adaptive step, whose steps differ
            np.testing.assert_allclose(pushed[name], heavier[name], atol=1e-4 * scale, rtol=0.0)
    if "scene.tip_force_power" in pushed.series:
        np.testing.assert_allclose(
            pushed["scene.tip_force_power"], -PUSHED * pushed["scene.tip_speed_z"], atol=1e-9, rtol=1e-9
        )


@pytest.mark.parametrize("loops", [False, True])
def test_a_force_on_a_free_arm_accelerates_it(loops):
    """After a few short steps from rest, the accelerations need no torques with the force at the tip."""
    if loops:
        study = load_study(EXAMPLES / "palletiser" / "study.yaml")
        arm, q = study.arm, study.cycle.position[300]
    else:
        arm, q = dt.load_arm("ur5"), np.array([0.3, -1.2, 1.0, -1.0, -1.5, 0.2])
    wrench, still = np.array([1.0, 2.0, 3.0, 5.0, 10.0, -80.0]), np.zeros(arm.n)
    turn = dt.tip_pose(*main_chain(arm, q[None]))[0, :3, :3]
    force = dt.effects.TipForce([0.0], -(turn @ wrench[3:])[None], -(turn @ wrench[:3])[None])
    run = dt.simulate(dt.Scene(arm, {"scene": (force,)}, 5e-4, q), solver=dt.FixedStep(1e-5))
    rates = np.array([run[f"{name}.speed"][-1] / run.time[-1] for name in arm.joint_names])
    rest = dt.inverse_dynamics(arm, q, still, rates, tip_wrench=wrench)
    needed = dt.inverse_dynamics(arm, q, still, still, tip_wrench=wrench)
    assert np.abs(rest).max() < 1e-5 * np.abs(needed).max()  # by the motion during these steps


def test_the_inverse_engine_knows_forces_on_arms_with_loops():
    text = (EXAMPLES / "palletiser" / "study.yaml").read_text(encoding="utf-8")
    robot = str(EXAMPLES / "palletiser" / "palletiser.urdf")
    stated = {**yaml.safe_load(text), "arm": robot, "forces": {"push": {"force": [5, 10, -80], "moment": [1, 2, 3]}}}
    large, small = ("servo_5", "cycloid_2500"), ("servo_2", "cycloid_400")
    pairs = {"turn": large, "lower": large, "flange_turn": small, "crank": large}
    stated["cycle"] = [{**step, "force": "push"} for step in stated["cycle"]]
    evaluation = dt.evaluate(load_study(stated), pairs)
    run = dt.simulate(evaluation, solver=dt.Inverse())
    for name, joint in evaluation.joints.items():
        wanted = np.interp(run.time, evaluation.study.cycle.time, joint.series.gear_torque)
        away = np.abs(run[f"{name}.mesh_torque"] - wanted)
        assert np.median(away) < 1e-6 * np.abs(wanted).max(), name  # not at jumps of friction, between samples


def study_of(force: dict, **changes) -> dt.study.Study:
    there = [[0.3, -1.2, 1.0, -1.0, -1.5, 0.2], [1.2, -0.8, 1.3, -1.2, -1.2, 0.8]]
    limits = {"profile": "quintic", "speed": 1.5, "acceleration": 3.0}
    stated = {
        "arm": "ur5", "drive_mass": "included", "forces": {"press": force},
        "motions": {"there": {"waypoints": there, **limits}, "back": {"waypoints": there[::-1], **limits}},
        "cycle": [{"motion": "there", "force": "press"}, {"dwell": 0.3, "force": "press"}, {"motion": "back"}],
        "supply": {"voltage": 48},
        "joints": {"default": {"candidates": {"motors": {"frameless": True}, "gears": {"kind": "strain_wave"}}}},
        **changes,
    }  # fmt: skip
    return load_study(stated)


@pytest.mark.parametrize(
    ("force", "axes"),
    [
        ({"force": [5, 10, -60], "moment": [1, 2, 3], "point": [0.01, 0.02, 0.1]}, "tip"),
        ({"force": [5, 10, -60], "moment": [1, 2, 3], "point": [0.01, 0.02, 0.1], "axes": "base"}, "base"),
        ({"along_motion": 15.0, "point": [0.05, 0.0, 0.2]}, "along"),
    ],
)
def test_joint_torques_do_the_work_of_the_force(force, axes):
    """The added joint torques have the power of force and moment; velocities by finite differences of poses."""
    study, free = study_of(force), [{"motion": "there"}, {"dwell": 0.3}, {"motion": "back"}]
    pairs = zip(load_basis(study), load_basis(study_of(force, cycle=free)), strict=True)
    added = np.array([one.bare.torque - two.bare.torque for one, two in pairs]).T
    cycle, arm, step = study.cycle, study.arm, 1e-6
    moving = np.flatnonzero(cycle.segment == 0)[5:-5:40]
    point = np.array([*force.get("point", [0, 0, 0]), 1.0])
    for i in moving:
        q, qd = cycle.position[i], step * cycle.velocity[i]
        before, now, after = (dt.tip_pose(arm, q + sign * qd) for sign in (-1, 0, 1))
        velocity = ((after - before) @ point)[:3] / (2.0 * step)
        spin = (after - before)[:3, :3] / (2.0 * step) @ now[:3, :3].T
        turning = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
        turn = now[:3, :3] if axes == "tip" else np.eye(3)
        pressed, moment = (turn @ np.array(force.get(name, [0, 0, 0])) for name in ("force", "moment"))
        power = pressed @ velocity + moment @ turning + force.get("along_motion", 0.0) * np.linalg.norm(velocity)
        assert added[i] @ cycle.velocity[i] == pytest.approx(power, rel=1e-6, abs=1e-8)
    assert not added[cycle.segment == 2].any()


def test_a_force_over_time_from_a_table():
    """Kinks of the table become samples, in every repetition and in dwells; between them the force is linear."""
    rows = "time [s],force_z [N],moment_x [N cm]\n-0.1,50,-100\n0,0,0\n0.1,-50,100\n0.25,-50,0\n10,0,0\n"
    held = {"dwell": 0.3, "repetitions": 2, "force": "press"}
    study = study_of({"samples": rows}, cycle=[{"motion": "there", "force": "press"}, held, {"motion": "back"}])
    cycle, begin = study.cycle, np.searchsorted(study.cycle.segment, 1)
    start = cycle.time[begin]
    for repetition in (0.0, 0.3):
        for since, force, moment in ((0.0, 0.0, 0.0), (0.1, -50.0, 1.0), (0.25, -50.0, 0.0)):
            at = np.flatnonzero(np.abs(cycle.time - (start + repetition + since)) < 1e-9)
            assert any(np.allclose(cycle.tip_wrench[k], [moment, 0, 0, 0, 0, force]) for k in at), (repetition, since)
    inside = (cycle.segment == 0) & (cycle.time > 0.1) & (cycle.time < 0.25)
    np.testing.assert_allclose(cycle.tip_wrench[inside, 0], (0.25 - cycle.time[inside]) / 0.15, atol=1e-9)
    assert load_study(study.to_yaml()).cycle.tip_wrench == pytest.approx(cycle.tip_wrench)


def test_a_force_is_a_part_of_the_currents_of_its_own():
    """Not weight: the other parts of the torque are those of the same motion without the force."""

    def torques(force, part):
        rows = dt.current_commands(dt.evaluate(slides(EARTH, force))).query("joint == 'z'")
        constant = (rows["motor torque [N m]"] / rows["current [A]"]).to_numpy()  # that of the magnets' temperature
        return (rows[f"{part} current [A]"] * constant).to_numpy()

    for part in ("inertia", "gravity", "velocity"):
        np.testing.assert_allclose(torques(downwards(PUSHED), part), torques(None, part), rtol=1e-9, atol=1e-12)
    # a motor has 2 pi rad for 20 mm
    np.testing.assert_allclose(torques(downwards(PUSHED), "given torque"), PUSHED * 0.02 / (2.0 * np.pi), rtol=1e-9)
    assert not torques(None, "given torque").any()


def test_forces_of_a_mix_stay_with_their_parts():
    free = [{"motion": "there"}, {"motion": "back"}]
    pressed = [{"motion": "there", "force": "press"}, {"motion": "back"}]
    mix = [{"share": 0.4, "cycle": free}, {"share": 0.6, "cycle": pressed}]
    study = study_of({"force": [0, 0, 30.0]}, cycle=None, mix=mix)
    first, second = study.cycle.parts
    assert not study.cycle.tip_wrench[first].any()
    assert study.cycle.tip_wrench[second][0, 5] == 30.0


def test_the_only_force_goes_with_the_only_motion():
    t = np.linspace(0.0, 1.0, 50)
    q = 0.5 * np.sin(2 * np.pi * t)[:, None] * np.ones(2)
    pressed = {"arm": "planar-2r", "forces": {"press": {"force": [0, 5, 0]}}, "supply": 48}
    study = dt.study(motion=(t, q), **pressed)
    assert (study.cycle.tip_wrench[:, 4] == 5.0).all()
    steps = dt.study(motion=[(t, q), {"dwell": 0.1}], **pressed)
    assert (steps.cycle.tip_wrench[steps.cycle.segment == 0, 4] == 5.0).all()
    assert not steps.cycle.tip_wrench[steps.cycle.segment == 1].any()


TABLE = "time [s],force_x [N]\n0,0\n{},0\n"


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"forces": {"press": {}}}, "must state a force"),
        ({"forces": {"press": {"force": [0, 0, 1], "samples": TABLE.format(9)}}}, "cannot be combined"),
        ({"forces": {"press": {"samples": TABLE.format(0.2)}}}, "must cover the step"),
        ({"forces": {"press": {"samples": TABLE.format(9).replace("_x", "")}}}, "a force or a moment"),
        ({"forces": {"pres": {"force": [0, 0, 1]}}}, "did you mean 'pres'"),
        ({"forces": {"press": {"force": [0, 0, "1 kg"]}}}, "N"),
    ],
)
def test_what_is_wrong_with_a_force_is_said(changes, said):
    with pytest.raises(InputError, match=said):
        study_of({}, **changes)


@pytest.mark.parametrize("force", [{"force": [0, 0, 1], "axes": "base"}, {"along_motion": 1.0}])
def test_forces_on_arms_with_loops_are_in_the_axes_of_the_tip(force):
    folder = EXAMPLES / "palletiser"
    stated = yaml.safe_load((folder / "study.yaml").read_text(encoding="utf-8"))
    cycle = [{**step, "force": "push"} for step in stated["cycle"]]
    stated |= {"arm": str(folder / "palletiser.urdf"), "forces": {"push": force}, "cycle": cycle}
    with pytest.raises(InputError, match="is not known for arms with closed loops") as error:
        load_study(stated)
    assert len(error.value.faults) == 1


def test_a_force_that_no_step_names_is_warned_of():
    free = [{"motion": "there"}, {"motion": "back"}]
    study = study_of({"force": [0, 0, 1]}, cycle=free)
    assert study.forces == () and study.cycle.tip_wrench is None
    assert any("forces that no step of the cycle names: press" in note for note in study.notes)


@pytest.mark.parametrize(
    "force",
    [
        {"force": [5, 10, -60], "moment": [1, 2, 3], "point": [0.01, 0.02, 0.1], "along_motion": 15.0},
        {"samples": "time [s],force_z [N],moment_x [N cm]\n0,0,0\n0.1,-50,100\n10,0,0\n", "axes": "base"},
    ],
)
def test_a_changed_force_is_that_of_a_study_that_states_it(force):
    """All parts by one factor, in the cycle and in what the report lists."""
    rows = {"samples": "time [s],force_z [N],moment_x [N cm]\n0,0,0\n0.1,-125,250\n10,0,0\n"}
    more = {name: 2.5 * np.array(value) for name, value in force.items() if name in ("force", "moment")}
    more = {name: value.tolist() for name, value in more.items()} | ({"along_motion": 37.5} if more else rows)
    found, wanted = dt.study.changed(study_of(force), TaskChange(force=2.5)), study_of({**force, **more})
    np.testing.assert_allclose(found.cycle.tip_wrench, wanted.cycle.tip_wrench, rtol=1e-12, atol=1e-12)
    for name in ("force", "moment", "point", "along_motion", "axes"):
        assert getattr(found.forces[0], name) == pytest.approx(getattr(wanted.forces[0], name))
    if wanted.forces[0].table is not None:
        np.testing.assert_allclose(found.forces[0].table, wanted.forces[0].table, rtol=1e-12)


def shop(force: float, **changes) -> dt.study.Study:
    """The slides, each with one of five motors of 0.4 to 1.6 N m, the heavier the stronger."""
    own = slides(EARTH, downwards(force), stop={"ramp": "0.15 s"})
    row = own.catalog.motors["m"]
    motors = {
        f"m{k}": replace(
            row,
            key=f"m{k}",
            mass=0.5 * k,
            nominal_torque=0.2 * k,
            nominal_current=2.0 * k,
            peak_torque=0.8 * k,
            resistance=1.0 / k,
            coulomb_friction=0.001 * k,
            viscous_friction=0.0,
        )
        for k in (2, 3, 4, 6, 8)
    }
    tasks = tuple(replace(one, drive=None, brakes=(), pairs=tuple((key, "") for key in motors)) for one in own.joints)
    return replace(own, joints=tasks, catalog=replace(own.catalog, motors=motors), **changes)


def test_the_curve_over_the_force_is_the_selection_at_each():
    found = dt.optimum_curve(shop(100.0), "force", ("20 %", "320 %"), points=4)
    assert found.now == 100.0 and found.unit == "%" and len(found.pieces) >= 3
    for point in found.points:
        assert point.drives == dt.select(shop(point.value), advise=False).drives, point.value
    for piece in found.pieces[:-1]:  # within the stated accuracy of the breakpoints
        ends = [dt.evaluate(shop(piece.high + sign * 1e-3), piece.drives).feasible for sign in (-1, 1)]
        assert ends == [True, False]
    with pytest.raises(InputError, match="no step of the cycle has one"):
        dt.optimum_curve(replace(shop(1.0), cycle=slides(EARTH, None).cycle), "force", (50.0, 150.0))
    with pytest.raises(InputError, match="0 or more"):
        dt.optimum_curve(shop(100.0), "force", (-50.0, 150.0))


def test_what_fails_passes_with_the_smaller_force_that_is_told():
    advice = " ".join(dt.select(shop(900.0)).advice)
    share = float(re.search(r"less force at the tip is enough: ([\d.]+) %", advice)[1]) / 100.0
    assert dt.select(shop(900.0 * share * 0.99)).feasible  # the share is told to three digits
    assert not dt.select(shop(900.0 * share * 1.02), advise=False).feasible
    weak = dt.why_not(shop(100.0), "z", "m2", "", cost=False)
    [less] = [one for one in weak.answers[0].changes if one.what == "force at the tip"]
    pairs = {**weak.selection.evaluation.drives, "z": ("m2", "")}
    assert [dt.evaluate(shop(value), pairs).feasible for value in (less.after, less.short)] == [True, False]


def test_a_tolerance_of_the_force_scatters_it():
    """A uniform force of plus and minus half: quantiles of utilisations are those at the quantiles of the force."""
    drives = {"x": ("m4", ""), "z": ("m8", "")}
    scattering = shop(200.0, tolerances=Tolerances(force=Tolerance(0.5)))
    found = dt.robustness(dt.evaluate(scattering, drives), samples=4000)
    for check in ("motor peak torque", "motor RMS current", "winding temperature"):
        for used, force in zip(found.utilisations["z"][check], (110.0, 200.0, 290.0), strict=True):
            wanted = dt.evaluate(shop(force), drives).joints["z"]
            [expected] = [one.utilisation for one in wanted.checks if one.name == check]
            assert used == pytest.approx(expected, rel=0.03)  # standard error of a quantile of 4000 samples
    assert found.scattering == ("force",)


def test_samples_of_a_cycle_keep_their_force():
    cycle = study_of({"force": [0, 0, 30.0]}).cycle
    some = cycle.at(np.arange(3, 9))
    np.testing.assert_array_equal(some.tip_wrench, cycle.tip_wrench[3:9])
    assert replace(cycle, notes=()).tip_wrench is cycle.tip_wrench
