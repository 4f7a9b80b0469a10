"""A study of an arm with closed loops: loads as of the arm with its drives, the search against brute force, faults."""

from __future__ import annotations

import itertools
import math
import re
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest
import yaml
from crank_arm import DIFFERENTIAL, crank, two_links
from random_tasks import feasible_sets

from drivetrain.dynamics.closed import whole_motion
from drivetrain.dynamics.inverse import joint_loads
from drivetrain.errors import InputError
from drivetrain.export.mjcf import write_mjcf
from drivetrain.report.charts.motion_data import TURNED, kept_samples, motion_data
from drivetrain.sizing.demand.demand import workload
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.judge.parts import FilledParts
from drivetrain.sizing.search.search import select
from drivetrain.study.model import Stop
from drivetrain.study.objects import study as dt_study
from drivetrain.study.parts.mounting import loaded_arm
from drivetrain.study.read import load_study

EXAMPLE = Path(__file__).resolve().parents[3] / "examples" / "palletiser"


def document(**changes):
    data = yaml.safe_load((EXAMPLE / "study.yaml").read_text(encoding="utf-8"))
    data["arm"] = str(EXAMPLE / data["arm"])
    return data | changes


@pytest.fixture(scope="module")
def study():
    return load_study(document())


def test_loads_are_those_of_the_loaded_arm(study):
    """The sum over the drives' numbers, against the arm with their masses and rotors at once."""
    keys = dict(zip(study.arm.joint_names, [("servo_5", "cycloid_2500"), ("servo_2", "cycloid_1200")] * 2, strict=True))
    parts = FilledParts(study)
    drives = {task.name: parts.drive(task, *keys[task.name]) for task in study.joints}
    by_index = dict(enumerate(drives.values()))
    cycle = study.cycle
    for payload in np.unique(cycle.payload):
        at = np.flatnonzero(cycle.payload == payload)[::200]
        arm = loaded_arm(study, drives, int(payload))
        loads = joint_loads(arm, cycle.position[at], cycle.velocity[at], cycle.acceleration[at])
        for joint, drive in by_index.items():
            demand = workload(study).at(joint, by_index).demand(drive)
            size = np.abs(loads.gear).max()
            np.testing.assert_allclose(demand.gear_torque[at], loads.gear[:, joint], rtol=1e-9, atol=1e-9 * size)
            np.testing.assert_allclose(demand.carrier_acceleration[at], loads.carrier_acceleration[:, joint], atol=1e-9)


def test_the_page_draws_each_drive_at_its_joint(study):
    """The crank rides on the turret beside the lower arm's joint, the flange's drive hangs at the wrist."""
    pair = ("servo_5", "cycloid_2500")
    found = evaluate(study, pair)
    told = motion_data(found)["arm"]
    moved = np.array(told["moved"]).reshape(-1, told["links"], 3, 4) / np.array([TURNED] * 3 + [1.0])
    at = kept_samples(found)[told["samples"]]
    spots = [moved[:, one["link"]] @ [*one["point"], 1.0] for one in told["drives"]]
    turn, lower = study.cycle.position[at, 0], study.cycle.position[at, 1]
    for spot, side in ((spots[1], 0.0), (spots[3], 150.0)):  # both axes ride on the turret
        where = [
            260.0 * np.cos(turn) - side * np.sin(turn),
            260.0 * np.sin(turn) + side * np.cos(turn),
            740.0 + 0 * turn,
        ]
        assert spot == pytest.approx(np.transpose(where), abs=1.5)
    wrist = np.hypot(*spots[2][:, :2].T)
    whole = whole_motion(study.arm.linkage, study.cycle.position[at], *np.zeros((2, len(at), 4))).position
    forearm = lower + whole[:, 2]  # from the upright and from the level
    assert wrist == pytest.approx(260.0 + 945.0 * np.sin(lower) + 1025.0 * np.cos(forearm) + 220.0, abs=2.0)
    assert [abs(one["axis"][1]) for one in told["drives"]] == [0.0, 1.0, 0.0, 1.0]


def test_motions_from_python_are_those_of_the_driven_joints(study):
    """The example's motion as arrays, a column a drive, moves it as its file does."""
    cycle, data = study.cycle, document()
    asked = ("arm", "closures", "passive", "drive_mass", "stop", "joints", "motors", "gears")
    with_drives = {name: data[name] for name in asked}
    rows = np.arange(np.flatnonzero(np.diff(cycle.time) <= 0.0)[0] + 1)  # up to the first instant that stands twice
    given = (
        cycle.time[rows] - cycle.time[rows[0]],
        cycle.position[rows],
        cycle.velocity[rows],
        cycle.acceleration[rows],
    )
    made = dt_study(motion=given, supply="560 V", open_cycle=True, **with_drives)
    assert made.cycle.joint_names == study.arm.joint_names
    np.testing.assert_allclose(made.cycle.position, cycle.position[rows], atol=1e-12)
    with pytest.raises(InputError, match=r"q_turn.*q_crank"):
        dt_study(motion=(given[0], np.zeros((len(rows), 6))), supply="560 V", **with_drives)


SPRINGS = {"cycloid_400": 1.5e5, "cycloid_1200": 4e5, "cycloid_2500": 1.2e6}


def sprung(**wish):
    """The example on springs; its weakest gear holds none of these joints."""
    data = document(stiffness=wish)
    for name, slope in SPRINGS.items():
        data["gears"][name] |= {"stiffness_1": f"{slope} N m/rad", "backlash": "0.3 mrad"}
    return data


def test_stiffness_is_that_of_mujoco(tmp_path):
    """Of the exported file, rotors locked: its mass matrix and the tip's Jacobian behind its own constraints."""
    study = load_study(sprung(first_resonance="3 Hz", tip_deviation="20 mm", lost_motion="5 mm"))
    found = evaluate(study, {name: ("servo_5", "cycloid_2500") for name in study.arm.joint_names})
    checks, cycle, loops = {one.name: one for one in found.shared}, study.cycle, study.arm.linkage.loops
    driven, passive = list(loops.driven), list(loops.passive)

    def at(check):
        """Motions of all bodies' joints for those of the driven ones, mass matrix and the tip's motion."""
        k = int(np.argmin(np.abs(cycle.time - checks[check].time)))
        write_mjcf(found, tmp_path / "arm.xml", payload=study.payloads[cycle.payload[k]].name)
        text = re.sub(' armature="[^"]*"', "", (tmp_path / "arm.xml").read_text())
        model = mujoco.MjModel.from_xml_string(text)
        data = mujoco.MjData(model)
        rest = np.zeros((1, study.arm.n))
        data.qpos[:] = whole_motion(study.arm.linkage, cycle.position[k : k + 1], rest, rest).position[0]
        mujoco.mj_forward(model, data)
        rows = data.efc_J.reshape(-1, model.nv)[: 3 * model.neq]
        turns = np.eye(model.nv)[:, driven]
        turns[passive] = -np.linalg.lstsq(rows[:, passive], rows[:, driven], rcond=None)[0]
        mass, tip = np.zeros((model.nv, model.nv)), np.zeros((3, model.nv))
        mujoco.mj_fullM(model, data, mass)
        mujoco.mj_jacSite(model, data, tip, None, 0)
        return k, turns.T @ mass @ turns, tip @ turns

    _, mass, _ = at("arm first resonance")
    squares = np.linalg.eigvals(np.linalg.solve(mass, 0.7 * 1.2e6 * np.eye(4))).real
    lowest = np.sqrt(squares.min()) / (2.0 * np.pi)
    assert checks["arm first resonance"].available == pytest.approx(lowest, rel=1e-7)
    k, _, tip = at("arm tip deviation")
    torque = np.array([joint.series.gear_torque[k] for joint in found.joints.values()])
    moved = np.linalg.norm(tip @ (torque / (0.7 * 1.2e6)))
    assert checks["arm tip deviation"].required == pytest.approx(moved, rel=1e-7)
    _, _, tip = at("arm lost motion")
    farthest = max(np.linalg.norm(tip @ signs) for signs in itertools.product((1, -1), repeat=4))
    assert checks["arm lost motion"].required == pytest.approx(3e-4 * farthest, rel=1e-7)


@pytest.mark.parametrize(
    "wish", [{}, {"first_resonance": "5.22 Hz"}, {"tip_deviation": "5.5 mm", "lost_motion": "0.9 mm"}]
)
def test_search_is_brute_force(wish):
    """Every set of the four joints, judged one by one, of two pairs each."""
    data = sprung(**wish)
    data["joints"]["default"]["candidates"]["motors"]["keys"] = ["servo_5"]
    data["motors"]["servo_5"] |= {"coulomb_friction": "0.2 N m", "viscous_friction": "5e-4 N m s/rad"}
    data["joints"]["default"]["candidates"]["gears"]["keys"] = ["cycloid_1200", "cycloid_2500"]
    small = load_study(data)
    fitting = [one.objective for one in feasible_sets(small)]
    assert 0 < len(fitting) < math.prod(len(task.pairs) for task in small.joints)
    assert select(small).objective == pytest.approx(min(fitting), rel=1e-12)


@pytest.mark.parametrize(("inertia", "coupling"), [(0.0, []), (0.3, []), (0.3, [DIFFERENTIAL])])
def test_stops_are_those_of_the_open_chain_that_moves_alike(inertia, coupling):
    """At the limit of a current and by brakes: a crank beside the first link weighs as that link's own inertia; also
    where a differential drives both links."""
    pair = two_links(closures=crank(inertia), coupling=coupling), two_links(inertia, coupling=coupling)
    closed, opened = (evaluate(one) for one in pair)
    for joint in ("shoulder", "elbow"):
        for name in ("speed", "gear_torque", "motor_torque"):
            found, wanted = (getattr(one.joints[joint].series, name) for one in (closed, opened))
            np.testing.assert_allclose(found, wanted, atol=1e-9 * np.abs(wanted).max())
    names = ["arm stop at full current", "arm power failure", "arm power failure heat"]
    for name in names:
        found, wanted = (next(c for c in one.shared if c.name == name) for one in (closed, opened))
        assert found.required == pytest.approx(wanted.required, rel=1e-6)  # of the pins, which close to 1e-12
        assert found.remark == wanted.remark
    for joint in ("shoulder", "elbow"):
        for found, wanted in zip(closed.joints[joint].checks, opened.joints[joint].checks, strict=True):
            if wanted.required is not None:
                assert found.required == pytest.approx(wanted.required, rel=1e-6, abs=1e-9), wanted.name


def test_a_stop_that_no_linkage_follows_is_not_checked():
    """Crank and rod reach down to -0.48 rad, the cycle to -0.4, and the arm falls further until the brakes bite."""
    short = crank(0.0)
    short[0]["links"][1]["point"] = [0.13, 0.0, 0.2]
    study = two_links(closures=short, engage_time=0.3)
    found = next(one for one in evaluate(study).shared if one.name == "arm power failure")
    assert found.verdict == "NOT CHECKED" and "cannot be followed" in found.remark
    ramped = replace(study, joints=tuple(replace(task, stop=Stop(ramp=0.5)) for task in study.joints))
    with pytest.raises(InputError, match=r"stop\.ramp: leads the linkage where it cannot go"):
        evaluate(ramped)


def test_what_a_study_with_closures_must_state():
    """Every fault at once, with its place."""
    data = document(stop={}, passive=["elbow", "wrist_pich"])
    with pytest.raises(InputError, match="wrist_pitch"):
        load_study(data)
    joints = {"default": {**document()["joints"]["default"], "output_bearing": "gear"}}
    with pytest.raises(InputError) as error:
        load_study(document(stop={}, joints=joints))
    told = str(error.value)
    assert "must be external" in told
    with pytest.raises(InputError, match=r"coupling: .*no chain of the linkages has together.*'lower', 'crank'"):
        load_study(document(coupling=[{"joints": ["lower", "crank"], "type": "differential"}]))
