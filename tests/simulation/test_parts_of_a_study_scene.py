"""What a study's scene consists of, number by number: loops, drives, friction, loads, payloads, times, notes."""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from crank_arm import DIFFERENTIAL, GEAR, MOTOR, short_crank, two_links

import drivetrain as dt
from drivetrain.arm.closures import second_motor
from drivetrain.drive.amplifier import Amplifier
from drivetrain.drive.counterbalance import Counterbalance
from drivetrain.drive.drive import Drive
from drivetrain.drive.friction import FRICTIONLESS, Friction, friction_torque
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.effects.control.cascade import PositionLoop
from drivetrain.effects.control.commanded_motion import CommandedMotion
from drivetrain.effects.control.preload import Preload
from drivetrain.effects.effect import Effect
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.friction.viscous_friction import ViscousFriction
from drivetrain.effects.gear.gear_drag import GearDrag
from drivetrain.effects.gear.mesh_loss import MeshLoss
from drivetrain.effects.gear.springs import Backlash, FlexibleJoint
from drivetrain.effects.loads.counterbalance_torque import CounterbalanceTorque
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.loads.payload_change import EMPTY, PayloadChange
from drivetrain.effects.motor.given import GivenCurrent
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.effects.motor.rotor import FullRotor, ReflectedRotor
from drivetrain.effects.motor.winding_heat import WindingHeat
from drivetrain.errors import InputError
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.motion.motion import Motion
from drivetrain.simulation import study_scene
from drivetrain.simulation.planning.plan import plan
from drivetrain.simulation.scene import Inertia, Scene
from drivetrain.simulation.study_scene import SceneOptions, Surroundings, at_joint, drive_effects, scene_of
from drivetrain.study.model import Payload, Study
from drivetrain.study.parts.mounting import loaded_arm
from drivetrain.study.read import load_study

sys.path.insert(0, str(Path(__file__).parents[1] / "sizing"))
from test_second_motors import task as second_task

BARE = SceneOptions(feed_forward=False, heat=False)


def drives_of(study: Study, **changes: Any) -> dict[str, Drive]:
    """The study's only motor and gear at every joint; ``changes`` of the gears."""
    motor, gear = study.catalog.motors["M"], replace(study.catalog.gears["G"], **changes)
    return {one.name: Drive(motor, gear, one.friction, one.motor_friction) for one in study.joints}


def only(effects: Any, kind: type[Effect]) -> Any:
    [found] = [one for one in effects if type(one) is kind]
    return found


def kinds(effects: Any) -> list[str]:
    return [type(one).__name__ for one in effects]


# --- joints


@pytest.mark.parametrize("case", ["plain", "coupled", "closed"])
def test_loops_and_springs_are_tuned_to_what_their_motors_move(case: str) -> None:
    """Critically damped at the bandwidth; inertia by the kinetic energy of unit speeds of each motor's shaft."""
    study = two_links(
        coupling=[DIFFERENTIAL] if case == "coupled" else (), closures=short_crank() if case == "closed" else None
    )
    drives, options = drives_of(study), SceneOptions(35.0, False, springs=True, damping=0.04, repetitions=3)
    scene = scene_of(study, drives, options=options)
    arm, start = loaded_arm(study, drives, -1), study.cycle.position[0]
    still = np.zeros(2)
    weight = dt.inverse_dynamics(arm, start, still, still)
    mass = np.array([dt.inverse_dynamics(arm, start, still, one) - weight for one in np.eye(2)])
    turns = np.eye(2) if study.arm.coupling is None else np.linalg.inv(study.arm.coupling)
    for k, name in enumerate(scene.joints):
        moved, loop = turns[:, k] @ mass @ turns[:, k], only(scene.effects[name], PositionLoop)
        assert loop.stiffness == pytest.approx(35.0**2 * moved, rel=1e-9)
        assert loop.damping == pytest.approx(2.0 * 35.0 * moved, rel=1e-9)
        assert loop.torque_constant == pytest.approx(0.1, rel=1e-12)
        springs = [one for one in scene.effects[name] if isinstance(one, FlexibleJoint)]
        assert bool(springs) == (case != "coupled")
        for spring in springs:
            assert spring.damping == pytest.approx(2.0 * 0.04 * math.sqrt(2e4 * moved), rel=1e-9)
    command = only(scene.effects["scene"], CommandedMotion)
    np.testing.assert_array_equal(command.motion.position, study.cycle.position)
    assert (command.repetitions, scene.duration) == (3, 6.0)
    np.testing.assert_array_equal(scene.position, start)
    np.testing.assert_array_equal(scene.speed, study.cycle.velocity[0])
    assert scene.notes == (("springs in the gears of shoulder, elbow: their motors are coupled",) * (case == "coupled"))


def test_scenes_without_some_effects() -> None:
    study = two_links(motor={"coulomb_friction": 0.01, "viscous_friction": 1e-5})
    drives = drives_of(study)
    base = ["PositionLoop", "MotorCurrent"]
    for options, more in (
        (BARE, ["DryFriction", "ViscousFriction", "MeshLoss"]),
        (replace(BARE, friction=False), ["MeshLoss"]),
        (replace(BARE, mesh=False), ["DryFriction", "ViscousFriction"]),
        (replace(BARE, mesh=False, friction=False), []),
    ):
        scene = scene_of(study, drives, options=options)
        assert kinds(scene.effects["elbow"]) == base + more and not scene.notes
        assert all(one.side == "motor" for one in scene.effects["elbow"] if isinstance(one, DryFriction))
    current = only(scene.effects["elbow"], MotorCurrent)
    assert current.peak_current == pytest.approx(20.0)
    assert current.voltage == pytest.approx(48.0 * study.joints[0].amplifier.modulation)


def test_a_drive_is_needed_at_every_joint_and_one_amplifier() -> None:
    study = two_links()
    drives = drives_of(study)
    with pytest.raises(InputError) as told:
        scene_of(study, {"shoulder": drives["shoulder"]}, options=BARE)
    assert [fault.place for fault in told.value.faults] == ["joints.elbow"]
    open_choice = tuple(replace(one, amplifiers=(Amplifier(key="A"), Amplifier(key="B"))) for one in study.joints)
    with pytest.raises(InputError) as told:
        scene_of(replace(study, joints=open_choice), drives, options=BARE)
    assert [fault.place for fault in told.value.faults] == [f"joints.{one}.amplifier" for one in drives]
    assert told.value.faults[0].value == "A, B"


PLAIN = Motor("m", 0.5, 0.1, rotor_inertia=1e-4, coulomb_friction=0.02, viscous_friction=1e-5)
AROUND = Surroundings(60.0, 31.0, 12.0, True)


def drive_kinds(gear: Gear, friction: Friction = FRICTIONLESS, motor: Motor = PLAIN, **task: Any) -> list[Effect]:
    own = replace(two_links().joints[0], **task)
    return drive_effects(own, Drive(motor, gear, friction), AROUND)


def test_losses_of_a_gear_as_its_data_sheet_has_them() -> None:
    """An efficiency of the whole; one of the mesh with drag, or seals, or a starting torque; a no-load torque only."""
    whole = drive_kinds(Gear("g", 50.0, kind="spur", efficiency=0.9))
    assert kinds(whole) == ["MotorCurrent", "DryFriction", "ViscousFriction", "MeshLoss"]
    for more in ({"drag_torque": 0.02}, {"seal_drag_torque": 0.01}, {"starting_torque": 0.03}):
        sheet = {"mesh_efficiency": 0.95, "drag_torque": 0.0, "drag_speed_exponent": 0.0, "drag_temperature_1": 0.0,
                 "drag_temperature_2": 0.0, **more}  # fmt: skip
        drag = only(drive_kinds(Gear("g", 50.0, kind="spur", **sheet)), GearDrag)
        assert (drag.temperature, drag.follows) == (12.0, True)
    idle = drive_kinds(Gear("g", 50.0, kind="spur", no_load_torque=0.04))
    assert [one.friction.coulomb for one in idle if isinstance(one, DryFriction)] == [0.02, 0.04]
    assert {one.side for one in idle if isinstance(one, DryFriction)} == {"motor"}
    assert "MeshLoss" not in kinds(idle)
    unknown = drive_kinds(Gear("g", 50.0, kind="spur"))
    assert [one.friction.coulomb for one in unknown if isinstance(one, DryFriction)] == [0.02]


@pytest.mark.parametrize(
    ("law", "wanted"),
    [
        (Friction(), []), (Friction(coulomb=1.0), ["DryFriction"]), (Friction(viscous=1.0), ["ViscousFriction"]),
        (Friction(coulomb_negative=1.0), ["DryFriction"]), (Friction(static=1.0), ["DryFriction"]),
        (Friction(viscous_negative=1.0), ["ViscousFriction"]),
        (Friction(coulomb=1.0, viscous=2.0), ["DryFriction", "ViscousFriction"]),
        (Friction(coulomb=1.0, tanh_speed=0.1), ["ViscousFriction"]),
        (Friction(coulomb=1.0, tanh_speed=0.1, viscous=1.0), ["ViscousFriction"]),
    ],
)  # fmt: skip
def test_a_law_is_dry_or_smooth_or_both(law: Friction, wanted: list[str]) -> None:
    for place, task in (("joint", {}), ("shaft", {"coupled": ("shoulder", "elbow")})):
        own = drive_kinds(Gear("g", 50.0), law, replace(PLAIN, coulomb_friction=None, viscous_friction=None), **task)
        found = [one for one in own if isinstance(one, DryFriction | ViscousFriction)]
        assert kinds(found) == wanted and {one.side for one in found} <= {place}
        assert all(one.friction is law or one.friction == law for one in found)


def test_friction_of_a_shaft_at_a_joint_that_slides_takes_the_same_power() -> None:
    law = Friction(3.0, 4.0, 0.5, 0.7, static=5.0, stribeck_speed=2.0)
    smooth = Friction(3.0, 3.0, 0.5, 0.7, tanh_speed=2.0)
    for one in (law, smooth):
        for travel in (0.02, 3.0):
            speed = travel * np.array([-7.0, -1.0, 0.3, 5.0])
            power = friction_torque(at_joint(one, travel), speed) * speed
            np.testing.assert_allclose(power, friction_torque(one, speed / travel) * speed / travel, rtol=1e-12)
    assert at_joint(law, 0.02).static == pytest.approx(250.0)
    found = drive_kinds(Gear("g", 50.0), law, replace(PLAIN, coulomb_friction=None, viscous_friction=None),
                        travel_per_turn=0.02)  # fmt: skip
    assert only(found, DryFriction).friction == at_joint(law, 0.02)


def test_counterbalances_are_numbered_and_heat_needs_capacities() -> None:
    weights = (Counterbalance(torque=3.0), Counterbalance(torque=5.0))
    found = drive_kinds(Gear("g", 50.0), counterbalances=weights)
    balances = [one for one in found if isinstance(one, CounterbalanceTorque)]
    assert [(one.balance.torque, one.number) for one in balances] == [(3.0, 1), (5.0, 2)]
    warm = {"resistance_winding_housing": 1.0, "resistance_housing_ambient": 4.0}
    assert "WindingHeat" not in kinds(drive_kinds(Gear("g", 50.0), motor=replace(PLAIN, **warm)))
    full = replace(PLAIN, **warm, winding_time_constant=20.0, housing_time_constant=800.0)
    heat = only(drive_kinds(Gear("g", 50.0), motor=full, housing_to_ambient=2.5, gear_heat=0.3), WindingHeat)
    assert (heat.gear_heat, heat.network.ambient, heat.network.resistance_housing_ambient) == (0.3, 31.0, 2.5)
    own = replace(two_links().joints[0])
    assert "WindingHeat" not in kinds(drive_effects(own, Drive(full, Gear("g", 50.0)), AROUND, BARE))
    assert only(drive_kinds(Gear("g", 50.0), amplifier=Amplifier()), MotorCurrent).peak_current == math.inf


# --- one axis


def table_of(time: Any, torque: Any, speed: Any, acceleration: Any) -> Cycle:
    t, v = np.asarray(time), np.asarray(speed)
    place = np.append(0.0, np.cumsum(0.5 * np.diff(t) * (v[1:] + v[:-1])))
    columns = [np.asarray(one, dtype=float)[:, None] for one in (place, v, acceleration, torque)]
    zeros = np.zeros(len(t), dtype=int)
    return Cycle(("shoulder",), t, *columns, zeros - 1, (), zeros, ("table",))


def axis_study(cycle: Cycle, **task: Any) -> Study:
    study = two_links()
    return replace(study, arm=None, drive_mass=None, cycle=cycle, joints=(replace(study.joints[0], **task),))


def test_an_axis_goes_on_with_its_table() -> None:
    """What the gear turns and the torque of the table's load, over three rounds of a conveyor."""
    time, speed = np.array([0.0, 0.5, 0.5, 1.0]), np.array([1.0, 2.0, 2.0, 1.0])
    cycle = table_of(time, [5.0, 6.0, 2.0, 3.0], speed, [2.0, 2.0, -2.0, -2.0])
    study = axis_study(cycle, load_inertia=0.4)
    drives = drives_of(study, inertia=2e-5)
    scene = scene_of(study, drives, options=replace(BARE, repetitions=3))
    motion, load = only(scene.effects["scene"], CommandedMotion).motion, only(scene.effects["shoulder"], GivenTorque)
    np.testing.assert_allclose(motion.time, np.concatenate([time, 1.0 + time, 2.0 + time]))
    np.testing.assert_allclose(motion.position[::4, 0], [0.0, 1.5, 3.0], atol=1e-12)
    np.testing.assert_allclose(np.diff(motion.position[:, 0]).sum(), 4.5)
    np.testing.assert_allclose(motion.velocity[:, 0], np.tile(speed, 3))
    np.testing.assert_allclose(load.time, motion.time)
    np.testing.assert_allclose(load.torque, np.tile([-4.2, -5.2, -2.8, -3.8], 3), rtol=1e-12)
    assert isinstance(scene.body, Inertia) and (scene.body.inertia, scene.duration) == (0.4, 3.0)
    rotor = only(scene.effects["shoulder"], ReflectedRotor)
    assert (rotor.ratio, rotor.inertia) == (50.0, pytest.approx(1.2e-4))
    moved = 0.4 + 50.0**2 * 1.2e-4
    assert only(scene.effects["shoulder"], PositionLoop).stiffness == pytest.approx(40.0**2 * moved)


@pytest.mark.parametrize("gap, told", [(0.9e-3, False), (1.1e-3, True)])
def test_parts_of_a_mix_have_to_meet(gap: float, told: bool) -> None:
    time = np.array([0.0, 0.5, 1.0, 1.0, 1.5, 2.0])
    place = np.array([[0.0, 0.0], [0.2, 0.1], [0.4, 0.3], [0.4, 0.3 + gap], [0.2, 0.0], [0.0, 0.0]])
    zeros = np.zeros(6, dtype=int)
    cycle = Cycle(
        ("a", "b"), time, place, 0.0 * place, 0.0 * place, None, zeros - 1, (), zeros, ("m",),
        parts=(slice(0, 3), slice(3, 6)), shares=(0.5, 0.5), part_names=("there", "back"),
    )  # fmt: skip
    faults = study_scene._mix_faults(cycle)
    assert len(faults) == told
    assert study_scene._mix_faults(replace(cycle, torque=place)) == []
    away = replace(cycle, position=np.vstack([place[:5], [[0.5, 0.0]]]))
    problems = [fault.problem for fault in study_scene._mix_faults(away)]
    assert [one.split(":")[0] for one in problems][-1] == "there begins elsewhere than back ends"
    assert study_scene._mix_faults(replace(away, parts=(), shares=(1.0,), part_names=("",))) == []
    if told:
        assert faults[0].problem.startswith("back begins elsewhere than there ends")
        assert faults[0].value == pytest.approx(gap)
        with pytest.raises(InputError, match="back begins"):
            study = two_links()
            scene_of(replace(study, cycle=cycle), drives_of(study), options=BARE)


def test_payloads_change_where_the_cycle_says_in_every_round() -> None:
    study = two_links()
    carried = np.full(41, -1)
    carried[5:12], carried[12:20] = 1, 0
    bodies = tuple(Payload(f"p{k}", 0.5 + k, np.array([0.1, 0.0, 0.2 * k]), np.eye(3) * (1.0 + k)) for k in range(2))
    study = replace(study, payloads=bodies, cycle=replace(study.cycle, payload=carried, payload_names=("p0", "p1")))
    [change] = study_scene._payloads(study, 2)
    assert isinstance(change, PayloadChange)
    np.testing.assert_allclose(change.time, [0.0, 0.25, 0.6, 1.0, 2.0, 2.25, 2.6, 3.0])
    assert [one.mass for one in change.bodies] == [0.0, 1.5, 0.5, 0.0] * 2
    assert change.bodies[0] is EMPTY
    np.testing.assert_array_equal(change.bodies[1].inertia, 2.0 * np.eye(3))
    np.testing.assert_array_equal(change.bodies[1].com, [0.1, 0.0, 0.2])
    assert study_scene._payloads(replace(study, cycle=replace(study.cycle, payload=carried * 0 - 1)), 2) == ()
    assert study_scene._payloads(replace(study, cycle=replace(study.cycle, payload=carried * 0)), 1)
    assert only(scene_of(study, drives_of(study), options=BARE).effects["scene"], PayloadChange)


# --- times and currents of a command


def test_times_of_a_command_are_its_own_and_no_further_apart_than_asked() -> None:
    """Each interval between samples in as few equal parts as that takes; jumps are seen from both sides."""
    time = np.array([1.0, 1.003, 1.01, 1.01, 1.0145, 1.03])
    q = np.array([0.0, 0.01, 0.02, 0.02, 0.01, 0.0])[:, None]
    a = np.array([5.0, 3.0, 2.0, -9.0, -3.0, 5.0])[:, None]
    motion = Motion("m", ("joint",), time, q, 0.0 * q, a)
    command = CommandedMotion(motion, 2)
    for duration in (0.06, 0.05):
        found = study_scene.command_times(Scene(Inertia(1.0), {"scene": (command,)}, duration), 2e-3)
        marks = sorted({0.0, duration, *(t + k * 0.03 for k in (0, 1) for t in time - 1.0 if t + k * 0.03 < duration)})
        marks = [t for k, t in enumerate(marks) if k == 0 or t - marks[k - 1] > 1e-9]
        wanted = [np.linspace(low, high, math.ceil((high - low) / 2e-3 - 1e-9) + 1)[:-1] for low, high in
                  pairwise(marks)]  # fmt: skip
        grid = np.append(np.concatenate(wanted), duration)
        jumps = [t for t in command.breakpoints() if 0.0 < t <= duration]
        assert any(abs(t - 0.01) < 1e-12 for t in jumps)
        np.testing.assert_allclose(found, np.sort([*grid, *jumps]), atol=1e-12)
        assert np.isin([np.nextafter(t, 0.0) for t in jumps], found).all()
    bare = study_scene.command_times(Scene(Inertia(1.0), {}, 0.005), 2e-3)
    np.testing.assert_allclose(bare, [0.0, 0.005 / 3.0, 0.01 / 3.0, 0.005])
    np.testing.assert_allclose(study_scene.command_times(Scene(Inertia(1.0), {}, 0.001), 2e-3), [0.0, 0.001])


def test_currents_that_are_fed_forward_are_those_of_the_motion() -> None:
    """Inertia times acceleration plus the load, over ratio and constant; on both sides of a jump at its time."""
    time = np.array([0.0, 0.01, 0.01, 0.02])
    a = np.array([4.0, 4.0, -4.0, -4.0])[:, None]
    v = np.array([0.0, 0.04, 0.04, 0.0])[:, None]
    q = np.array([0.0, 2e-4, 2e-4, 4e-4])[:, None]
    motor = Motor("m", 0.5, 0.1)
    effects: tuple[Effect, ...] = (
        FullRotor(1e-4, 50.0), MotorCurrent(motor), PositionLoop(100.0, 10.0, 0.1),
        GivenTorque([0.0, 1.0], [-5.0, -5.0]),
    )  # fmt: skip
    scene = Scene(
        Inertia(0.5), {"joint": effects, "scene": (CommandedMotion(Motion("m", ("joint",), time, q, v, a)),)}, 0.02,
        q[0], v[0],
    )  # fmt: skip
    fed = only(study_scene.with_feed_forward(scene).effects["joint"], GivenCurrent)
    moved = 0.5 + 50.0**2 * 1e-4
    before, after = (moved * one + 5.0 for one in (4.0, -4.0))
    jump = np.flatnonzero(np.isclose(fed.time, 0.01))
    assert len(jump) == 2 and fed.time[jump[0]] == fed.time[jump[1]] == 0.01
    np.testing.assert_allclose(fed.current[: jump[1]], before / 50.0 / 0.1, rtol=1e-9)
    # At the last instant the command stands still.
    np.testing.assert_allclose(fed.current[jump[1] : -1], after / 50.0 / 0.1, rtol=1e-9)
    assert fed.time[0] == 0.0 and fed.time[-1] == 0.02
    # A brake that engages is no load of the motion.
    braked = replace(scene, effects={**scene.effects, "joint": (*effects, dt.HoldingBrake(3.0, engages=(0.005,)))})
    same = only(study_scene.with_feed_forward(braked).effects["joint"], GivenCurrent)
    np.testing.assert_array_equal(same.current, fed.current)


# --- two motors


def test_two_motors_turn_the_load_of_a_table() -> None:
    """An arm of one link that has the load's inertia and no weight; half of what both move for each."""
    own = {
        "motors": 2,
        "preload": 9.0,
        "load_inertia": 1.5,
        "drive": {"motor": "M", "gear": "G"},
        "stop": {"ramp": 0.3},
    }
    samples = "time [s],torque_axis [N m],speed_axis [rad/s]\n0,40,0\n0.1,30,2\n0.2,40,0\n"
    study = load_study({
        "motions": {"table": {"samples": samples}}, "supply": {"voltage": 48.0}, "open_cycle": True, "catalogs": [],
        "motors": {"M": {**MOTOR, "source": "t"}}, "gears": {"G": {**GEAR, "source": "t"}}, "joints": {"axis": own},
    })  # fmt: skip
    drives = drives_of(study)
    scene = scene_of(study, drives, options=BARE)
    assert scene.joints == ("axis", "axis_motor_2") and scene.duration == pytest.approx(0.2)
    inertia = plan(scene).inertia
    np.testing.assert_allclose(np.diag(inertia), [1.5, *(2500.0 * 1e-4 for _ in inertia[1:])], rtol=1e-9)
    moved = 0.5 * (1.5 + 2.0 * 2500.0 * 1e-4)
    for name in scene.joints:
        assert only(scene.effects[name], PositionLoop).stiffness == pytest.approx(40.0**2 * moved, rel=1e-9)
    load = only(scene.effects["axis"], GivenTorque)
    gain = study.cycle.acceleration[0, 0]
    assert load.torque[0] == pytest.approx(1.5 * gain - 40.0) and "GivenTorque" not in kinds(
        scene.effects["axis_motor_2"]
    )
    # Weightless: it stands where it is but for the table's torque.
    body = scene.body
    still = np.zeros(2)
    np.testing.assert_allclose(dt.inverse_dynamics(body, np.array([0.7, 0.7]), still, still), 0.0, atol=1e-12)
    assert study_scene.refuse_unsimulated(study) is None
    slides = tuple(replace(one, travel_per_turn=0.01) for one in study.joints)
    with pytest.raises(InputError, match="not simulated apart"):
        study_scene.refuse_unsimulated(replace(study, joints=slides))
    unequal = drives | {"axis_motor_2": replace(drives["axis"], gear=replace(drives["axis"].gear, efficiency=0.8))}
    loose = replace(study, joints=tuple(replace(one, preload=0.0) for one in slides))
    study_scene.refuse_unsimulated(replace(loose, arm=study.arm), drives)
    with pytest.raises(InputError, match="not simulated apart"):
        study_scene.refuse_unsimulated(loose, unequal)


def test_two_motors_of_an_axis_each_behind_its_gear() -> None:
    """Joint friction, twice, and counterbalances are the first motor's; play that is not known is none, and is told."""
    own = {"friction": {"coulomb": 1.0, "viscous": 0.5, "load_share": 0.1}}
    study = second_task({"motors": 2, "preload": 20.0, **own}, own, gears={"G": {**GEAR, "stiffness_1": 2e4}},
                        motors={"M": {**MOTOR, "price": 1.0}})  # fmt: skip
    balance = Counterbalance(torque=4.0)
    study = replace(study, joints=tuple(replace(one, counterbalances=(balance,)) for one in study.joints))
    drives = drives_of(study)
    names = ("joint_1", second_motor("joint_1"))
    scene = scene_of(study, drives, options=BARE)
    first, second = (scene.effects[name] for name in names)
    assert only(first, DryFriction).friction.coulomb == pytest.approx(2.0 * study.joints[0].friction.coulomb)
    assert only(first, ViscousFriction).friction.viscous == pytest.approx(2.0 * study.joints[0].friction.viscous)
    assert "DryFriction" not in kinds(second) and "ViscousFriction" not in kinds(second)
    assert only(second, MeshLoss).gear.load_friction == only(first, MeshLoss).gear.load_friction == 0.1
    assert len([one for one in first if isinstance(one, CounterbalanceTorque)]) == 1
    assert "CounterbalanceTorque" not in kinds(second)
    assert [only(one, Preload).torque for one in (first, second)] == [20.0, -20.0]
    assert only(first, Backlash).gear.backlash == 0.0
    assert any("play of gear" in note for note in scene.notes)
    lone = scene.effects["joint_2"]
    assert only(lone, DryFriction).friction.coulomb == 1.0 and "Backlash" not in kinds(lone)
    soft = drives | {names[1]: replace(drives[names[1]], gear=replace(drives[names[1]].gear, stiffness_1=None))}
    with pytest.raises(InputError, match="stiffness_1"):
        scene_of(study, soft, options=BARE)
    unequal = drives | {names[1]: replace(drives[names[1]], gear=replace(drives[names[1]].gear, efficiency=0.8))}
    loose = replace(study, joints=tuple(replace(one, preload=None) for one in study.joints))
    assert [only(scene_of(loose, unequal, options=BARE).effects[name], Preload).torque for name in names] == [0.0, 0.0]
    known = {name: replace(one, gear=replace(one.gear, backlash=1e-3)) for name, one in drives.items()}
    played = scene_of(study, known, options=BARE)
    assert only(played.effects[names[0]], Backlash).gear.backlash == 1e-3 and not played.notes
    # Of each motor: half of what both move at once.
    arm, both = loaded_arm(study, drives, -1), np.array([1.0, 1.0, 0.0])
    still = np.zeros(3)
    weight = dt.inverse_dynamics(arm, study.cycle.position[0], still, still)
    whole = both @ (dt.inverse_dynamics(arm, study.cycle.position[0], still, both) - weight)
    loops = [only(scene.effects[name], PositionLoop).stiffness / 40.0**2 for name in scene.joints]
    assert loops[:2] == pytest.approx([0.5 * whole] * 2, rel=1e-9)
