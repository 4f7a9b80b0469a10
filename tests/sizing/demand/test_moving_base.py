"""Studies of arms on a base whose motion is given: loads as of pinocchio's free-flyer, another gravity, the search."""

from __future__ import annotations

import itertools

import numpy as np
import pinocchio
import pytest

import drivetrain as dt
from drivetrain.arm.bodies import on_moving_base
from drivetrain.dynamics.inverse import joint_loads
from drivetrain.motion.base import base_states
from drivetrain.sizing.demand.demand import workload
from drivetrain.sizing.judge.parts import FilledParts
from drivetrain.study.parts.mounting import loaded_arm

SHEET = {
    "kind": "brushless", "current_basis": "dc", "winding_basis": "line_line", "resistance": 0.3, "inductance": 2e-4,
    "torque_constant": 0.09, "rotor_inertia": 6e-5, "mass": 1.1, "max_speed": 700.0, "peak_current": 60.0,
    "nominal_current": 16.0, "nominal_voltage": 48.0, "max_winding_temperature": 125.0, "diameter": 0.08,
    "resistance_winding_housing": 0.6, "resistance_housing_ambient": 1.5, "winding_time_constant": 30.0,
    "housing_time_constant": 900.0, "source": "made up",
}  # fmt: skip
GEAR = {
    "kind": "planetary", "efficiency": 0.9, "inertia": 1e-6, "continuous_torque": 900.0, "repeated_peak_torque": 1500.0,
    "momentary_torque": 3000.0, "max_input_speed": 700.0, "mass": 1.5, "source": "made up",
}  # fmt: skip
SWINGS = {
    "roll": {"amplitude": "9 deg", "period": "2 s", "phase": "40 deg"},
    "pitch": {"amplitude": "4 deg", "period": "4 s"}, "yaw": {"amplitude": "6 deg", "period": "4 s"},
    "z": {"amplitude": "0.5 m", "period": "2 s", "phase": "10 deg"}, "x": {"amplitude": "0.2 m", "period": "4 s"},
}  # fmt: skip


SPRINGS = {
    f"G{ratio}": GEAR | {"ratio": float(ratio), "stiffness_1": slope, "backlash": 3e-4}
    for ratio, slope in ((80, 2.0e5), (120, 3.0e5))
}  # fmt: skip
STIFF = {"first_resonance": "3 Hz", "tip_deviation": "5 mm", "lost_motion": "2 mm"}


def document(**changes):
    """A PUMA that moves for 1.5 s each way and rests for the other second of four."""
    places = [[0.0, -0.9, 0.5, 0.2, 0.4, 0.0], [0.9, -0.2, 1.1, -0.5, 0.9, 1.0]]
    return {
        "schema_version": 1, "arm": "puma560", "drive_mass": "added",
        "motions": {
            "there": {"waypoints": places, "profile": "quintic", "durations": ["1.5 s"]},
            "back": {"waypoints": places[::-1], "profile": "quintic", "durations": ["1.5 s"]},
        },
        "payloads": {"box": {"mass": "3 kg", "com": ["0 m", "0 m", "0.1 m"]}},
        "cycle": [{"motion": "there", "payload": "box"}, {"dwell": "1 s", "payload": "box"}, {"motion": "back"}],
        "supply": {"voltage": "48 V"}, "stop": {"ramp": "0.4 s"}, "catalogs": [], "base": SWINGS,
        "motors": {f"M{mass}": SHEET | {"mass": mass, "torque_constant": 0.05 + 0.02 * mass} for mass in (1, 2)},
        "gears": {f"G{ratio}": GEAR | {"ratio": float(ratio)} for ratio in (80, 120)},
        "joints": {"default": {"drive": {"motor": "M1", "gear": "G120"}, "output_bearing": "external"}},
    } | changes  # fmt: skip


@pytest.fixture(scope="module")
def study():
    return dt.load_study(document())


def twist(position, rates):
    """Of the base in its own frame, (linear, angular), from x, y, z, yaw, pitch, roll and their rates."""
    yaw, pitch, roll = position[3:]
    turned = pinocchio.rpy.rpyToMatrix(roll, pitch, yaw)
    angular = np.array(
        [
            rates[5] - rates[3] * np.sin(pitch),
            rates[4] * np.cos(roll) + rates[3] * np.cos(pitch) * np.sin(roll),
            rates[3] * np.cos(pitch) * np.cos(roll) - rates[4] * np.sin(roll),
        ]
    )
    return np.concatenate([turned.T @ rates[:3], angular])


def test_loads_are_those_of_a_free_flyer(study):
    """Pinocchio's free-flyer with the base's velocity and acceleration given, those by differences of Euler rates."""
    arm, model = study.arm, pinocchio.Model()
    model.gravity.linear = np.array(arm.gravity)
    parent, place = model.addJoint(0, pinocchio.JointModelFreeFlyer(), pinocchio.SE3.Identity(), "base"), np.zeros(3)
    for i, screw in enumerate(arm.screws):
        here, rotation = arm.joint_points[i], arm.home[i, :3, :3]
        joint = pinocchio.JointModelRevoluteUnaligned(screw[:3])
        parent = model.addJoint(parent, joint, pinocchio.SE3(np.eye(3), here - place), arm.joint_names[i])
        tensor = rotation @ arm.inertias[i] @ rotation.T
        body = pinocchio.Inertia(arm.masses[i], arm.home[i, :3, 3] - here, tensor)
        model.appendBodyToJoint(parent, body, pinocchio.SE3.Identity())
        place = here
    data, cycle, basis = model.createData(), study.cycle, workload(study).basis
    bare = np.flatnonzero(cycle.payload < 0)[::25]
    rate = {"period": lambda one: 2.0 * np.pi / float(one["period"].split()[0])}

    def base(t):
        """Position and rates at an instant, by the study's own words."""
        found, rates = np.zeros(6), np.zeros(6)
        for at, axis in enumerate(("x", "y", "z", "yaw", "pitch", "roll")):
            if axis in SWINGS:
                one = SWINGS[axis]
                size = float(one["amplitude"].split()[0]) * (np.pi / 180 if "deg" in one["amplitude"] else 1.0)
                w, phase = rate["period"](one), np.deg2rad(float(one.get("phase", "0 deg").split()[0]))
                found[at], rates[at] = size * np.sin(w * t + phase), size * w * np.cos(w * t + phase)
        return found, rates

    found, wanted, h = [], [], 1e-5
    for k in bare:
        t = cycle.time[k]
        at, rates = base(t)
        speed = twist(at, rates)
        change = (twist(*base(t + h)) - twist(*base(t - h))) / (2 * h)
        quaternion = pinocchio.Quaternion(pinocchio.rpy.rpyToMatrix(at[5], at[4], at[3])).coeffs()
        q = np.concatenate([at[:3], quaternion, cycle.position[k]])
        torque = pinocchio.rnea(
            model, data, q, np.concatenate([speed, cycle.velocity[k]]), np.concatenate([change, cycle.acceleration[k]])
        )
        wanted.append(torque[6:])
        found.append([one.bare.torque[k] for one in basis])
    assert len(bare) > 10
    np.testing.assert_allclose(found, wanted, atol=1e-6)  # N m of tens; what differences of 1e-5 s leave


def test_drives_count_as_bodies_of_the_arm(study):
    """The sum over the drives' numbers, against the arm with their masses and rotors at once."""
    parts, cycle = FilledParts(study), study.cycle
    drives = {task.name: parts.drive(task, *task.drive) for task in study.joints}
    by_index = dict(enumerate(drives.values()))
    for payload in (-1, 0):
        at = np.flatnonzero(cycle.payload == payload)[::20]
        whole = on_moving_base(loaded_arm(study, drives, payload))
        states = base_states(study.base, cycle.time[at])
        own = (cycle.position[at], cycle.velocity[at], cycle.acceleration[at])
        loads = joint_loads(whole, *(np.hstack(rows) for rows in zip(states, own, strict=True)))
        for joint, drive in by_index.items():
            demand = workload(study).at(joint, by_index).demand(drive)
            np.testing.assert_allclose(demand.gear_torque[at], loads.gear[:, 6 + joint], rtol=1e-9, atol=1e-8)
            np.testing.assert_allclose(demand.wrench[at], loads.wrench[:, 6 + joint], rtol=1e-9, atol=1e-7)
            carried = loads.carrier_acceleration[:, 6 + joint]
            np.testing.assert_allclose(demand.carrier_acceleration[at], carried, rtol=1e-9, atol=1e-9)


def test_a_base_that_is_pushed_is_another_gravity():
    """Einstein's lift: figures of a base accelerating by (0, 2, 1.5) m/s^2 are those of gravity less that."""
    end = 4.0
    lines = [f"{t},0,{t * t},{0.75 * t * t},0,0,0" for t in np.linspace(0.0, end, 401).tolist()]
    names = ",".join(f"q_base_{axis} [{'m' if axis in 'xyz' else 'rad'}]"
                     for axis in ("x", "y", "z", "yaw", "pitch", "roll"))  # fmt: skip
    text = "\n".join([f"time [s],{names}", *lines])
    common = {"open_cycle": True, "gears": SPRINGS, "stiffness": STIFF}
    pushed = dt.load_study(document(base={"motion": {"samples": text, "smoothing": 0.0}}, **common))
    heavier = dt.load_study(document(base=None, gravity=[0.0, -2.0, -9.81 - 1.5], **common))
    found, wanted = dt.evaluate(pushed), dt.evaluate(heavier)
    stiff, others, still = (
        {check.name: check for check in one.shared if check.name.startswith("arm ")}
        for one in (found, wanted, dt.evaluate(dt.load_study(document(base=None, **common))))
    )
    assert len(stiff) == 3
    for name, other in others.items():
        assert (stiff[name].required, stiff[name].available) == pytest.approx(
            (other.required, other.available), rel=2e-4
        )
    assert stiff["arm tip deviation"].required > 1.05 * still["arm tip deviation"].required
    for name, joint in wanted.joints.items():
        for check, other in zip(found.joints[name].checks, joint.checks, strict=True):
            if other.required is not None:
                assert check.required == pytest.approx(other.required, rel=2e-4), (name, other.name)


def test_rests_are_judged_while_the_base_moves(study):
    """In a dwell of the arm the joints are asked for torque that swings with the base."""
    cycle = study.cycle
    rest = np.flatnonzero((cycle.time > 1.5) & (cycle.time < 2.5))
    assert len(rest) > 20
    assert not cycle.velocity[rest].any()
    assert np.ptp(workload(study).basis[1].bare.torque[rest]) > 1.0


def test_swinging_more_asks_more():
    mild = dt.evaluate(dt.load_study(document(base={"z": {"amplitude": "0.05 m", "period": "2 s"}})))
    wild = dt.evaluate(dt.load_study(document(base={"z": {"amplitude": "0.8 m", "period": "2 s"}})))
    for name in ("joint_2", "joint_3"):
        use = [max(c.utilisation or 0.0 for c in one.joints[name].checks) for one in (mild, wild)]
        assert use[1] > use[0]


@pytest.mark.parametrize("stiff", [{}, {"tip_deviation": "0.27 mm"}, {"first_resonance": "30 Hz"}])
def test_search_is_brute_force(stiff):
    """Every set of three joints with two pairs each, the others given, judged one by one; the springs count too."""
    listed = {"pairs": [{"motor": "M1", "gear": "G80"}, {"motor": "M2", "gear": "G120"}]}
    names = [f"joint_{i}" for i in (1, 2, 3)]
    own = {name: {"candidates": listed, "output_bearing": "external"} for name in names}
    given = {"drive": {"motor": "M1", "gear": "G120"}, "output_bearing": "external"}
    swings = {"roll": {"amplitude": "25 deg", "period": "2 s"}, "z": {"amplitude": "0.5 m", "period": "2 s"}}
    study = dt.load_study(
        document(
            joints={"default": given} | own, base=swings, **({"gears": SPRINGS, "stiffness": stiff} if stiff else {})
        )
    )
    sets = itertools.product(*(task.pairs or (task.drive,) for task in study.joints))
    found = [dt.evaluate(study, dict(zip(study.arm.joint_names, one, strict=True))) for one in sets]
    good = [one.objective for one in found if one.feasible]
    assert 0 < len(good) < len(found)
    chosen = dt.select(study)
    assert chosen.evaluation.objective == pytest.approx(min(good), rel=1e-12)


def test_currents_add_up(study):
    """Parts of the current, and the current."""
    table = dt.current_commands(dt.evaluate(study))
    parts = [f"{name} current [A]" for name in (
        "inertia", "gravity", "velocity", "counterbalance", "given torque", "joint friction", "mesh loss", "gear drag",
        "motor friction", "rotor inertia",
    )]  # fmt: skip
    np.testing.assert_allclose(table[parts].sum(axis=1), table["current [A]"], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"base": {"roll": {"amplitude": "9 deg", "period": "3 s"}}}, "roll ends the cycle otherwise"),
        ({"base": {}}, "must have either a motion, or swings"),
        ({"base": {"roll": {"amplitude": "1 m", "period": "2 s"}}}, "roll"),
        ({"base": {"motion": {"waypoints": [[0] * 6, [0, 0, 1, 0, 0, 0]], "profile": "quintic",
                              "durations": ["1 s"]}}}, "lasts 1 s"),
        ({"stop": {}}, "a base that moves a stop is checked along a ramp"),
        ({"selection": {"curves": ["cycle_time"]}}, "by its own clock"),
        ({"mix": [{"share": 1.0, "cycle": [{"motion": "there"}, {"motion": "back"}]}], "cycle": None}, "with mix"),
    ],
)  # fmt: skip
def test_what_a_base_does_not_go_with(changes, words):
    data = {name: value for name, value in document(**changes).items() if value is not None}
    with pytest.raises(dt.InputError, match=words):
        dt.load_study(data)


def test_what_is_refused_with_a_moving_base(study):
    evaluation = dt.evaluate(study)
    beam = dt.Beam(dt.round_tube(0.1, 0.09, 70e9, 26e9), [0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    for call in (dt.simulate, lambda one: dt.tip_deflection(one, beams={1: beam})):
        with pytest.raises(dt.InputError, match="moves as the study gives it"):
            call(evaluation)
    with pytest.raises(dt.InputError, match="another pace"):
        dt.fastest(study)


def test_a_written_study_is_the_same(study):
    again = dt.load_study(study.to_yaml())
    np.testing.assert_array_equal(again.base.position, study.base.position)
