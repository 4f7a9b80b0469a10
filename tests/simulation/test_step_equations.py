"""A few fixed steps of small arms, and what is recorded between them, against the equations written out.

    M (v' - v) / h + bias = torques,    x' - x = h (v + v') / 2

with mass matrix and bias at the middle of the step as it was guessed, and with every linear torque in its middle as it
was found. What is left over is dry friction, which has to fit the motion.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from crank_arm import DIFFERENTIAL, HEIGHT, crank, two_links

import drivetrain as dt
from drivetrain.arm.bodies import with_payload
from drivetrain.arm.coupling import with_coupling
from drivetrain.effects.loads.payload_change import Body, PayloadChange
from drivetrain.simulation.run import simulate

H = 2e-3
MASSES, COMS = (3.0, 2.0), ([0.2, 0.05, 0.1], [0.55, 0.1, 0.15])
TENSORS = [np.array([[0.05, 0.01, 0.0], [0.01, 0.08, 0.005], [0.0, 0.005, 0.06]]), np.diag([0.03, 0.05, 0.04])]
SCREWS = np.array([[0.0, 0.0, 1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, -0.2, 0.0, 0.4]])
TIP = np.eye(4)
TIP[:3, 3] = 0.8, 0.1, 0.2
START = np.array([0.3, -0.5])
CARRIED = Body(0.9, np.array([0.02, -0.03, 0.05]), np.diag([0.004, 0.006, 0.005]))


def bare() -> dt.Arm:
    home = np.tile(np.eye(4), (2, 1, 1))
    home[:, :3, 3] = COMS
    return dt.Arm.from_screws(
        home, SCREWS, MASSES, TENSORS, tip=TIP, gravity=(1.3, -8.0, 4.0), joint_names=["a", "b"]
    )  # fmt: skip


def run_of(scene: dt.Scene, step: float = H) -> dict[str, np.ndarray]:
    found = simulate(scene, solver=dt.FixedStep(step), interval=step, checked=False)
    assert found.stopped_by is None
    return {"time": found.time} | {name: one.values for name, one in found.series.items()}


def pair(run: dict[str, np.ndarray], what: str) -> np.ndarray:
    return np.stack([run[f"a.{what}"], run[f"b.{what}"]], axis=1)


def mass_and_bias(arm: dt.Arm, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return dt.mass_matrix(arm, q), dt.inverse_dynamics(arm, q, v, np.zeros(2))


# --- friction and meshes

SPRING, DAMPER, TWIST, WALL = 4e3, 3.0, 2e-4, (80.0, 2.0, 0.1)
ROTORS, RATIOS = (4e-5, 6e-5), (50.0, -40.0)
RUBS = {  # by place: forward, backward, static [N m]
    "a": (0.6, 0.9, 1.2), "b": (1.5, 1.1, 2.0), "a motor": (0.02, 0.03, 0.035), "b motor": (0.02, 0.05, 0.06),
}  # fmt: skip
ETA = (0.8, 0.85)
PUSH = {"a": (0.3, 0.5), "b": (1.0, -2.0)}  # N m at motor a and joint b at first, and in a second
CASES = {
    "forward": (0.5, 0.3, 0.5), "backward": (-0.5, -0.4, -0.7), "against one another": (0.4, -0.6, 0.1),
    "from rest": (0.0, 0.0, 0.0), "about to stop": (0.004, -0.003, 0.002),
}  # fmt: skip


def rubbing(place: str) -> dt.Friction:
    forward, backward, static = RUBS[place]
    return dt.Friction(coulomb=forward, coulomb_negative=backward, static=static)


def geared(speed: Any, push: Any = PUSH, more: tuple[Any, ...] = ()) -> dt.Scene:
    """Joint a behind a spring, joint b rigid; both with all kinds of friction."""
    time = [0.0, 1.0]
    meshes = [dt.Gear(f"g{k}", RATIOS[k], kind="spur", efficiency=ETA[k], stiffness_1=SPRING) for k in range(2)]
    effects = {
        "a": (
            dt.ReflectedRotor(ROTORS[0], RATIOS[0]), dt.FlexibleJoint(meshes[0], DAMPER), dt.MeshLoss(meshes[0]),
            dt.DryFriction(rubbing("a")), dt.DryFriction(rubbing("a motor"), "motor"), dt.WallSpring(*WALL),
            dt.ViscousFriction(dt.Friction(viscous=2e-4), "motor"), dt.GivenTorque(time, push["a"], "motor"),
        ),
        "b": (
            dt.ReflectedRotor(ROTORS[1], RATIOS[1]), dt.MeshLoss(meshes[1]), dt.DryFriction(rubbing("b")),
            dt.DryFriction(rubbing("b motor"), "motor"), dt.ViscousFriction(dt.Friction(viscous=0.4)),
            dt.GivenTorque(time, push["b"]),
        ),
    }  # fmt: skip
    effects |= {"scene": more} if more else {}
    return dt.Scene(bare(), effects, 8 * H, START, np.array(speed[:2]))


def bounds(place: str, ratio: float, way: int, sliding: bool) -> float:
    """Of friction against a motion of the joint that way, at the joint [N m]."""
    forward, backward, static = RUBS[place]
    turned = way * (ratio if "motor" in place else 1.0)
    size = abs(ratio) if "motor" in place else 1.0
    return size * (static if not sliding else forward if turned > 0.0 else backward)


def lost_in_mesh(k: int, load: float, way: int) -> float:
    """Friction of a mesh that carries ``load`` to the joint, positive against motion forward."""
    mu = 1.0 / ETA[k] - 1.0  # driven by the load 2 - 1/eta comes back
    return way * abs(mu * load)


def fits(k: int, friction: float, load: float, speed: float, rigid: bool, scale: float) -> None:
    """Friction behind the gear, with that at a rigid joint, at a speed after the step; ``load`` without any of it."""
    name, tight = "ab"[k], 1e-9 * scale
    if speed != 0.0:
        way = 1 if speed > 0.0 else -1
        joint = way * bounds(name, RATIOS[k], way, True) if rigid else 0.0
        motor = way * bounds(f"{name} motor", RATIOS[k], way, True)
        assert friction == pytest.approx(joint + motor + lost_in_mesh(k, load + joint, way), abs=tight)
        return
    for way in (1, -1):
        joint = bounds(name, RATIOS[k], way, False) if rigid else 0.0
        most = joint + bounds(f"{name} motor", RATIOS[k], way, False)
        assert way * friction <= most + abs(lost_in_mesh(k, load + way * joint, way)) + 1e-7


@pytest.mark.parametrize("name, loaded", [*((name, False) for name in CASES), ("forward", True)])
def test_a_step_is_its_equation_and_friction_fits(name: str, loaded: bool) -> None:
    change = (PayloadChange([4 * H], (CARRIED,)),) if loaded else ()
    run, arms = run_of(geared(CASES[name], more=change)), [bare()] * 2
    if loaded:
        arms[1] = with_payload(bare(), CARRIED.mass, CARRIED.com, CARRIED.inertia)
    t, q, v = run["time"], pair(run, "position"), pair(run, "speed")
    twist, spin = run["a.deflection"], run["a.motor_speed"] / RATIOS[0]
    whole = np.column_stack([v, spin])
    assert len(t) == 9
    if loaded:  # it brings the energy that it has at once
        (mass, _), (more, _) = (mass_and_bias(arm, q[4], v[4]) for arm in arms)
        at = dt.tip_pose(bare(), q[4])
        height = CARRIED.mass * (at[:3, 3] + at[:3, :3] @ CARRIED.com) @ [-1.3, 8.0, -4.0]
        brought = 0.5 * v[4] @ (more - mass) @ v[4] + height
        assert run["scene.payload_energy"] == pytest.approx(np.where(np.arange(9) < 4, 0.0, brought), rel=1e-9)
    for k in range(1, 8):
        last = np.where(whole[k] == 0.0, 0.0, (whole[k] - whole[k - 1]) / H)
        guess = whole[k] + 0.5 * H * last
        mass, bias = mass_and_bias(arms[int(loaded and k >= 4)], q[k] + 0.5 * H * guess[:2], guess[:2])
        change_ = whole[k + 1] - whole[k]
        middle = whole[k] + 0.5 * change_
        np.testing.assert_allclose(q[k + 1], q[k] + H * middle[:2], rtol=0.0, atol=1e-14)
        assert twist[k + 1] == pytest.approx(twist[k] + H * (middle[2] - middle[0]), abs=1e-15)
        rate = middle[2] - middle[0]
        spring = SPRING * (twist[k] + 0.5 * H * rate) + DAMPER * rate
        wall = WALL[0] * (q[k, 0] + 0.5 * H * middle[0] - WALL[2]) + WALL[1] * middle[0]
        now = t[k] + 0.5 * H
        motor = PUSH["a"][0] + now * (PUSH["a"][1] - PUSH["a"][0]) - 2e-4 * RATIOS[0] * middle[2]
        pushed = PUSH["b"][0] + now * (PUSH["b"][1] - PUSH["b"][0]) - 0.4 * middle[1]
        asked = mass @ change_[:2] / H + bias
        scale = np.abs(asked).max() + abs(spring) + 10.0
        link = spring - wall - asked[0]
        rotor = RATIOS[0] * motor - spring - ROTORS[0] * RATIOS[0] ** 2 * change_[2] / H
        rigid = pushed - asked[1] - ROTORS[1] * RATIOS[1] ** 2 * change_[1] / H
        if v[k + 1, 0] != 0.0:
            way = np.sign(v[k + 1, 0])
            assert link == pytest.approx(way * bounds("a", 1.0, int(way), True), abs=1e-9 * scale)
        else:
            assert abs(link) <= 1.2 + 1e-9
        fits(0, rotor, spring, spin[k + 1], False, scale)
        fits(1, rigid, asked[1] - pushed, v[k + 1, 1], True, scale)


@pytest.mark.parametrize("name", CASES)
def test_what_is_recorded_is_the_equation_at_that_instant(name: str) -> None:
    arm, push = bare(), {"a": (0.02, 0.02), "b": (1.0, -2.0)} if name == "from rest" else PUSH
    run = run_of(geared(CASES[name], push))
    kinetic = []
    for k in range(9):
        q, v = (np.array([run[f"{one}.{what}"][k] for one in "ab"]) for what in ("position", "speed"))
        told = {one: float(values[k]) for one, values in run.items()}
        spin, twist = told["a.motor_speed"] / RATIOS[0], told["a.deflection"]
        mass, bias = mass_and_bias(arm, q, v)
        rate = np.array([told["a.acceleration"], told["b.acceleration"], told["a.motor_acceleration"] / RATIOS[0]])
        assert told["b.motor_acceleration"] == pytest.approx(RATIOS[1] * rate[1])
        assert [told["a.bias_torque"], told["b.bias_torque"]] == pytest.approx(bias)
        spring = SPRING * twist + DAMPER * (spin - v[0])
        asked, t = mass @ rate[:2] + bias, run["time"][k]
        wall = WALL[0] * (q[0] - WALL[2]) + WALL[1] * v[0]
        motor = push["a"][0] + t * (push["a"][1] - push["a"][0]) - 2e-4 * RATIOS[0] * spin
        pushed = push["b"][0] + t * (push["b"][1] - push["b"][0]) - 0.4 * v[1]
        link = spring - wall - asked[0]
        rotor = RATIOS[0] * motor - spring - ROTORS[0] * RATIOS[0] ** 2 * rate[2]
        rigid = pushed - asked[1] - ROTORS[1] * RATIOS[1] ** 2 * rate[1]
        assert told["a.joint_friction"] == pytest.approx(link, abs=1e-7)
        assert told["a.joint_friction_power"] == pytest.approx(link * v[0], abs=1e-7)
        behind = ("a", rotor, spring, spin), ("b", rigid, asked[1] - pushed, v[1])
        for i, (one, friction, load, speed) in enumerate(behind):
            joint = told["b.joint_friction"] if one == "b" else 0.0
            found = joint + told[f"{one}.motor_friction"] * RATIOS[i] + told[f"{one}.mesh_loss"]
            assert found == pytest.approx(friction, abs=1e-7)
            assert told[f"{one}.mesh_torque"] == pytest.approx(load + joint, abs=1e-7)
            assert told[f"{one}.mesh_power"] == pytest.approx(told[f"{one}.mesh_loss"] * speed, abs=1e-9)
            shaft = told[f"{one}.motor_friction"] * RATIOS[i]
            assert told[f"{one}.motor_friction_power"] == pytest.approx(shaft * speed, abs=1e-9)
            going = speed or (rate[2] if one == "a" else rate[1])  # at rest it may be about to move
            if going != 0.0:
                way = 1 if going > 0.0 else -1
                assert shaft == pytest.approx(way * bounds(f"{one} motor", RATIOS[i], way, True))
                assert told[f"{one}.mesh_loss"] == pytest.approx(lost_in_mesh(i, load + joint, way), abs=1e-7)
                assert one == "a" or joint == pytest.approx(way * bounds("b", 1.0, way, True))
            else:  # in proportion to what each could hold
                way = 1 if friction > 0.0 else -1
                parts = [bounds("b", 1.0, way, False) if one == "b" else 0.0]
                parts += [bounds(f"{one} motor", RATIOS[i], way, False), abs(lost_in_mesh(i, load, way))]
                assert abs(friction) <= sum(parts) * (1.0 + 1e-9)
                assert shaft == pytest.approx(friction * parts[1] / sum(parts), abs=1e-7)
                assert joint == pytest.approx(friction * parts[0] / sum(parts), abs=1e-7)
        kinetic.append(0.5 * v @ mass @ v)
        kinetic[-1] += 0.5 * (ROTORS[0] * told["a.motor_speed"] ** 2 + ROTORS[1] * told["b.motor_speed"] ** 2)
        height = sum(m * dt.link_poses(arm, q)[i][:3, 3] @ [-1.3, 8.0, -4.0] for i, m in enumerate(MASSES))
        assert told["scene.potential_energy"] == pytest.approx(height, rel=1e-9)
    assert run["scene.kinetic_energy"] == pytest.approx(kinetic)


# --- coupled motors, and a wall at the tip

TURNS = np.array([[1.0, 0.4], [-0.6, 1.2]])
OUT = np.array([2.0, -1.0, -2.0]) / 3.0


def tip_of(q: np.ndarray) -> np.ndarray:
    return np.asarray(dt.tip_pose(bare(), q)[:3, 3])


def tip_slope(q: np.ndarray) -> np.ndarray:
    return np.column_stack([(tip_of(q + d) - tip_of(q - d)) / 2e-5 for d in 1e-5 * np.eye(2)])


@pytest.mark.parametrize("speed", [(0.2, 0.3), (-0.3, 0.1), (0.0, 0.0)])
@pytest.mark.parametrize("coupled", [False, True])
def test_a_step_with_a_wall_at_the_tip(coupled: bool, speed: tuple[float, float]) -> None:
    """Friction of meshes, shafts and motors behind it has to fit, where motors are coupled by their shafts."""
    turns = TURNS if coupled else np.eye(2)
    arm, point = with_coupling(bare(), TURNS) if coupled else bare(), tip_of(START) + 0.01 * OUT
    gears = [dt.Gear(f"g{k}", RATIOS[k], kind="spur", efficiency=ETA[k]) for k in range(2)]
    effects: dict[str, Any] = {
        name: (
            dt.ReflectedRotor(ROTORS[k], RATIOS[k]), dt.MeshLoss(gears[k]), dt.DryFriction(rubbing(name), "shaft"),
            dt.DryFriction(rubbing(f"{name} motor"), "motor"), dt.ViscousFriction(dt.Friction(viscous=0.4), "shaft"),
            dt.WallSpring(80.0, 2.0, 0.1 * k), dt.GivenTorque([0.0], [0.3 - 0.5 * k], "motor"),
        )
        for k, name in enumerate("ab")
    }  # fmt: skip
    effects["scene"] = (dt.TipContact(tuple(point), tuple(3.0 * OUT), 9e3, 40.0),)
    run = run_of(dt.Scene(arm, effects, 3 * H, START, np.linalg.solve(turns, speed)))
    q, v, reflected = pair(run, "position"), pair(run, "speed"), np.multiply(ROTORS, np.square(RATIOS))
    if coupled:
        np.testing.assert_allclose(pair(run, "shaft_position"), q @ turns.T, atol=1e-12)
    assert run["scene.contact_force"].min() > 0.0
    for k in (1, 2):
        shafts = v[k - 1 : k + 2] @ turns.T
        still = np.abs(shafts[1]) < 1e-12
        guess = np.linalg.solve(turns, shafts[1] + np.where(still, 0.0, 0.5 * (shafts[1] - shafts[0])))
        at, change = q[k] + 0.5 * H * guess, v[k + 1] - v[k]
        mass, bias = mass_and_bias(bare(), at, guess)
        middle, slope = v[k] + 0.5 * change, tip_slope(at)
        tip = tip_of(at) + 0.5 * H * slope @ (middle - guess)
        force = 9e3 * OUT @ (point - tip) - 40.0 * OUT @ slope @ middle
        held = [80.0 * (q[k, i] + 0.5 * H * middle[i] - 0.1 * i) + 2.0 * middle[i] for i in range(2)]
        load = np.linalg.solve(turns.T, mass @ change / H + bias - slope.T @ OUT * force + held)
        load += 0.4 * turns @ middle
        moved = turns @ change / H
        for i in range(2):
            friction = RATIOS[i] * (0.3 - 0.5 * i) - load[i] - reflected[i] * moved[i]
            after = shafts[2, i] if abs(shafts[2, i]) > 1e-12 else 0.0
            fits(i, friction, load[i], after, True, 1e3)


def test_a_weight_without_an_arm_swings_step_by_step() -> None:
    """W cos(q + phase) against the motion, at the guess of the middle."""
    rotor = dt.FullRotor(4e-5, 50.0)
    scene = dt.Scene(dt.Inertia(0.4, 30.0, 0.7), {"joint": (rotor,)}, 6 * H, np.array([0.2]), np.array([-0.5]))
    run = run_of(scene)
    q, v, whole = run["joint.position"], run["joint.speed"], 0.4 + 4e-5 * 2500.0
    for k in range(1, 6):
        guess = v[k] + 0.5 * (v[k] - v[k - 1])
        pull = -30.0 * np.cos(q[k] + 0.5 * H * guess + 0.7)
        assert whole * (v[k + 1] - v[k]) == pytest.approx(H * pull, rel=1e-10)
    np.testing.assert_allclose(run["scene.potential_energy"], 30.0 * np.sin(q + 0.7), rtol=1e-12)
    np.testing.assert_allclose(run["scene.kinetic_energy"], 0.5 * whole * v**2, rtol=1e-12)
    np.testing.assert_allclose(run["joint.bias_torque"], 30.0 * np.cos(q + 0.7), rtol=1e-12)
    np.testing.assert_allclose(run["joint.acceleration"], -30.0 / whole * np.cos(q + 0.7), rtol=1e-12)


# --- springs in pieces keep their energy in every step

BENT = dt.Gear("s", 50.0, stiffness_1=9e3, torque_1=4.5, stiffness_2=1.7e4, torque_2=13.0, stiffness_3=2.6e4)
LOOSE = dt.Gear("b", 50.0, stiffness_1=9e3, torque_1=4.5, stiffness_2=1.7e4, backlash=1.2e-3)


@pytest.mark.parametrize("step", [5e-4, 5e-3])
@pytest.mark.parametrize("speed", [0.2, -3.0])
@pytest.mark.parametrize("spring", [dt.FlexibleJoint(BENT), dt.Backlash(LOOSE)])
def test_springs_in_pieces_keep_their_energy(spring: Any, speed: float, step: float) -> None:
    """Steps that go through bends and play: what the spring gives is what both bodies take, to rounding."""
    scene = dt.Scene(dt.Inertia(0.4), {"joint": (dt.FullRotor(4e-5, 50.0), spring)}, 20 * step, speed=np.array([speed]))
    begun = {"joint.deflection": 4e-4, "joint.shaft_speed": 0.0}
    found = simulate(scene, solver=dt.FixedStep(step), interval=step, checked=False, start=begun)
    whole = found["stored_energy"]
    assert np.ptp(found["joint.deflection"]) > 8e-4 and np.ptp(found["scene.kinetic_energy"]) > 0.01 * whole[0]
    assert np.abs(whole - whole[0]).max() < 1e-11 * whole[0]
    momentum = 0.4 * found["joint.speed"] + 4e-5 * 50.0 * found["joint.motor_speed"]
    np.testing.assert_allclose(momentum, momentum[0], rtol=1e-12)
    assert found.counters["unsettled"] == 0


@pytest.mark.parametrize("step", [1e-3, 1e-2])
def test_a_wall_gives_back_what_bounces(step: float) -> None:
    """Masses that slide along x, y and z, the last against a skew wall: energy to rounding, none of it across."""
    home, screws = np.tile(np.eye(4), (3, 1, 1)), np.hstack([np.zeros((3, 3)), np.eye(3)])
    arm = dt.Arm.from_screws(
        home, screws, [1.0, 2.0, 3.0], [np.eye(3) * 1e-3] * 3, tip=np.eye(4), gravity=(0.0, 0.0, 0.0)
    )
    wall = dt.TipContact((0.0, 0.0, 0.0), tuple(-4.0 * OUT), 4e5)
    scene = dt.Scene(arm, {"scene": (wall,)}, 20 * step, -0.004 * OUT, np.array([1.0, 0.7, -0.9]))
    found = simulate(scene, solver=dt.FixedStep(step), interval=step, checked=False)
    whole, v = found["stored_energy"], np.stack([found[f"{name}.speed"] for name in arm.joint_names])
    assert found["scene.contact_force"].max() > 50.0 and found["scene.contact_force"][-1] == 0.0
    assert np.abs(whole - whole[0]).max() < 1e-11 * whole[0]
    lost = np.diff(np.diag([6.0, 5.0, 3.0]) @ v, axis=1)
    np.testing.assert_allclose(np.cross(lost, OUT, axisa=0), 0.0, atol=1e-12)
    assert found.counters["unsettled"] == 0


# --- the grid of times


def test_no_step_crosses_a_breakpoint_and_a_run_may_stop_anywhere() -> None:
    """Speed and time are exact where the torque is linear between breakpoints; the grid goes on from each of them."""
    push = dt.GivenTorque([0.0, 0.0033, 0.0033, 0.0051, 0.02], [1.0, 1.0, -3.0, 2.0, 2.0])
    scene = dt.Scene(dt.Inertia(2.0), {"joint": (push,)}, 0.02)
    whole = simulate(scene, solver=dt.FixedStep(1e-3), interval=1e-3, checked=False)
    assert whole.counters["steps"] == 4 + 2 + 15 and whole.time[-1] == 0.02

    def speed(t: float) -> float:
        after, last = np.clip(t - 0.0033, 0.0, 0.0018), max(t - 0.0051, 0.0)
        return float(min(t, 0.0033) - 3.0 * after + 0.5 * 5.0 / 0.0018 * after**2 + 2.0 * last) / 2.0

    np.testing.assert_allclose(whole["joint.speed"], [speed(t) for t in whole.time], rtol=0.0, atol=1e-15)
    for end in (0.0043, 0.0101, 0.0051):
        half = simulate(scene, solver=dt.FixedStep(1e-3), interval=1e-3, checked=False, duration=end)
        rest = simulate(scene, solver=dt.FixedStep(1e-3), interval=1e-3, checked=False, resume=half)
        assert rest.time[-1] == 0.02
        assert rest["joint.position"][-1] == pytest.approx(whole["joint.position"][-1], rel=1e-12)


def test_an_adaptive_run_goes_on_where_it_was_stopped() -> None:
    scene = dt.Scene(dt.Inertia(2.0), {"joint": (dt.WallSpring(4e3, 9.0, 0.1),)}, 0.02)
    whole = simulate(scene, solver=dt.AdaptiveStep(), interval=1e-3, checked=False)
    half = simulate(scene, solver=dt.AdaptiveStep(), interval=1e-3, checked=False, duration=0.0085)
    rest = simulate(scene, solver=dt.AdaptiveStep(), interval=1e-3, checked=False, resume=half)
    assert whole.time.tolist() == pytest.approx([1e-3 * k for k in range(21)])
    assert half.time.tolist() == pytest.approx([*whole.time[:9], 0.0085])
    assert rest.time.tolist() == pytest.approx(whole.time[9:].tolist())
    np.testing.assert_allclose(rest["joint.position"], whole["joint.position"][9:], rtol=0.0, atol=1e-7)
    swing, decay = np.sqrt(2e3 - 2.25**2), 2.25
    t = whole.time
    exact = 0.1 - 0.1 * np.exp(-decay * t) * (np.cos(swing * t) + decay / swing * np.sin(swing * t))
    np.testing.assert_allclose(whole["joint.position"], exact, rtol=0.0, atol=1e-7)


def test_two_joints_come_to_rest_one_after_the_other() -> None:
    """Masses that slide on their own, each braked by its friction: when, where, and in which direction."""
    home, screws = (
        np.tile(np.eye(4), (2, 1, 1)),
        np.array([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0, 1.0, 0.0]]),
    )
    arm = dt.Arm.from_screws(
        home, screws, [1.0, 2.0], [np.eye(3) * 1e-3] * 2, tip=np.eye(4), gravity=(0.0, 0.0, 0.0), joint_names=["a", "b"]
    )
    brakes = {name: (dt.DryFriction(dt.Friction(coulomb=size)),) for name, size in (("a", 6.0), ("b", 5.0))}
    scene = dt.Scene(arm, brakes, 0.3, np.zeros(2), np.array([0.2, -0.5]))  # 3 and 2 kg: 0.1 s and 0.2 s
    run = simulate(scene, solver=dt.AdaptiveStep(), interval=0.05, checked=False)
    assert [(event.name, event.detail[0]) for event in run.events] == [("stick", "a"), ("stick", "b")]
    assert [event.time for event in run.events] == pytest.approx([0.1, 0.2], rel=1e-6)
    for name, speed, end in (("a", 0.2, 0.1), ("b", -0.5, 0.2)):
        left = np.minimum(run.time, end)
        np.testing.assert_allclose(run[f"{name}.position"], speed * left * (1.0 - 0.5 * left / end), atol=1e-8)
        assert run[f"{name}.speed"][-1] == 0.0


def test_a_bus_that_is_fed_comes_to_its_threshold() -> None:
    """A rotor of 0.01 kg m^2 braked by 10 A, from 100 rad/s: C (V^2 - V0^2) / 2 is what comes back."""
    motor = dt.Motor("m", 0.5, 0.1)
    effects = (dt.FullRotor(0.0), dt.MotorCurrent(motor), dt.GivenCurrent([0.0], [-10.0]))
    bus = dt.SupplyBus(48.0, 0.01, threshold=56.0, resistance=10.0)
    scene = dt.Scene(dt.Inertia(0.01), {"joint": effects, "scene": (bus,)}, 0.15, speed=np.array([100.0]))
    run = simulate(scene, solver=dt.AdaptiveStep(), interval=0.01, checked=False)
    t = run.time
    volts = np.minimum(np.sqrt(48.0**2 + 200.0 * (50.0 * t - 50.0 * t**2)), 56.0)
    assert 3 < (volts == 56.0).sum() < 10
    np.testing.assert_allclose(run["scene.bus_voltage"], volts, rtol=1e-5)
    np.testing.assert_allclose(
        run["scene.brake_resistor_power"], np.where(volts == 56.0, 50.0 - 100.0 * t, 0.0), atol=1e-4
    )


def test_samples_see_the_motion_of_their_instant() -> None:
    """Voltage that is fed forward goes with the speed at the sample, not with that of the step before."""
    motor = dt.Motor("m", 0.3, 0.05, inductance=1e-4)
    push = dt.GivenTorque([0.0, 1.0], [4.0, 9.0])
    effects = (
        dt.FullRotor(0.0), dt.Winding(motor), dt.SampledCurrentLoop(motor, 2e3, 1e-4), push,
        dt.GivenCurrent([0.0], [0.0]),
    )  # fmt: skip
    scene = dt.Scene(dt.Inertia(1e-3), {"joint": effects, "scene": (dt.StiffSupply(300.0),)}, 1e-3)
    # In fixed steps a loop reads the current's state, which lags the recorded one by 4e-4 A, through 0.2 ohm.
    for engine, close in ((dt.FixedStep(1e-4), 1e-4), (dt.AdaptiveStep(), 1e-9)):
        run = simulate(scene, solver=engine, interval=1e-4, checked=False)
        asked = -0.2 * run["joint.current"] + run["joint.integrated_voltage"] + 0.05 * run["joint.speed"]
        np.testing.assert_allclose(run["joint.sampled_voltage"][:-1], asked[:-1], rtol=0.0, atol=close)
        assert run["joint.speed"][-1] > 1.0  # 0.2 rad/s more in each step


@pytest.mark.parametrize("engine", [dt.FixedStep(1e-3), dt.AdaptiveStep()])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_run_without_bound_ends_with_a_word(engine: Any, way: float) -> None:
    scene = dt.Scene(dt.Inertia(1e-12), {"joint": (dt.GivenTorque([0.0, 0.02], [0.0, way * 1e60]),)}, 0.02)
    run = simulate(scene, solver=engine, interval=1e-3, checked=False)
    stopped = run.stopped_by
    assert stopped is not None and stopped.name == "diverged" and stopped.time <= 2e-3
    assert isinstance(engine, dt.AdaptiveStep) or ("joint." in stopped.detail and run.counters["steps"] == 1)


def test_samples_are_taken_on_their_own_grid() -> None:
    """Every 0.7 ms, between which the torque stands: steps end there, and every row is on the grid from there."""
    gain, every, inertia = 3.0, 7e-4, 2e-3
    servo = dt.SampledCascade(0.0, gain, every=every, delay=0)
    still = dt.Motion("still", ("joint",), np.array([0.0, 1.0]), *(np.zeros((2, 1)) for _ in range(3)))
    effects = (dt.FullRotor(0.0), dt.MotorCurrent(dt.Motor("m", 0.3, 0.5)), dt.Encoder(), servo)
    scene = dt.Scene(
        dt.Inertia(inertia), {"joint": effects, "scene": (dt.CommandedMotion(still),)}, 4.9e-3, speed=np.array([1.0])
    )
    q, v, before, rows = 0.0, 1.0, -every, []
    for _ in range(7):
        rows.append((q, v))
        turn = -0.5 * gain * (q - before) / every / inertia
        before, q, v = q, q + every * v + 0.5 * every**2 * turn, v + every * turn
    rows.append((q, v))
    for engine, close in ((dt.FixedStep(5e-4), 1e-13), (dt.AdaptiveStep(), 1e-8)):
        run = simulate(scene, solver=engine, interval=every, checked=False)
        at = [int(np.argmin(np.abs(run.time - k * every))) for k in range(8)]
        np.testing.assert_allclose(run["joint.position"][at], [q for q, _ in rows], rtol=0.0, atol=close)
        np.testing.assert_allclose(run["joint.speed"][at], [v for _, v in rows], rtol=0.0, atol=close)
        assert isinstance(engine, dt.AdaptiveStep) or run.counters["steps"] == 14


def test_a_stiff_spring_is_calmed_after_a_jump() -> None:
    """One step of the implicit Euler rule after it, up to the next, then the midpoint rule again: written out."""
    stiff, inertia, h = 4e6, 0.5, 1e-3
    push = dt.GivenTorque([0.0, 3e-3, 3e-3, 4e-3, 4e-3, 1.0], [0.0, 0.0, 700.0, 700.0, -200.0, -200.0])
    scene = dt.Scene(dt.Inertia(inertia), {"joint": (push, dt.WallSpring(stiff, 30.0))}, 8e-3)
    run = simulate(scene, solver=dt.FixedStep(h), interval=h, checked=False)
    x = v = 0.0
    for k in range(8):
        theta, force = (1.0 if k in (3, 4) else 0.5), 0.0 if k < 3 else 700.0 if k == 3 else -200.0
        whole = inertia + theta * h * (30.0 + theta * h * stiff)
        change = h * (force - 30.0 * v - stiff * (x + theta * h * v)) / whole
        x, v = x + h * (v + theta * change), v + change
        assert (run["joint.position"][k + 1], run["joint.speed"][k + 1]) == pytest.approx((x, v), rel=1e-9, abs=1e-18)


# --- closed loops


@pytest.mark.parametrize("more", ["motors", "springs", "coupled", "wall"])
def test_a_crank_beside_a_link_is_inertia_of_that_link_in_each_step(more: str) -> None:
    """The open chain that moves alike, step by step."""
    coupling, runs = [DIFFERENTIAL] if more == "coupled" else [], []
    for study in (two_links(closures=crank(0.3), coupling=coupling), two_links(0.3, coupling=coupling)):
        gear = dt.Gear("g", 50.0, stiffness_1=2e4)
        own: tuple[Any, ...] = (dt.FullRotor(1e-4, 50.0), dt.GivenTorque([0.0], [1.5], "motor"))
        own += (dt.FlexibleJoint(gear, 3.0),) if more == "springs" else ()
        effects: dict[str, Any] = dict.fromkeys(study.arm.joint_names, own)
        if more == "wall":
            effects["scene"] = (dt.TipContact((0.0, 0.0, 0.1), (0.0, 0.1, 1.0), 2e4, 50.0),)
        scene = dt.Scene(study.arm, effects, 4e-3, np.array([0.5, -0.9]), np.array([1.0, -2.0]))
        runs.append(run_of(scene, 1e-3))
    closed, opened = runs
    assert closed.keys() == opened.keys()
    for name, wanted in opened.items():
        lifted = 9.81 * HEIGHT if name in ("scene.potential_energy", "stored_energy") else 0.0
        size = np.abs(wanted).max()
        np.testing.assert_allclose(closed[name] - lifted, wanted, atol=1e-8 * size + 1e-12, err_msg=name)


# --- what a command requires


@pytest.mark.parametrize("ways", [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0)])
def test_currents_that_a_command_requires(ways: tuple[float, float]) -> None:
    """Torque behind each gear, with friction of joint, mesh and motor against the motion; at rest the load alone."""
    time, far = np.linspace(0.0, 0.4, 9), np.array(ways) * [0.3, 0.2]
    u = np.minimum(time / 0.3, 1.0)[:, None]
    place, speed = START + far * (3.0 * u**2 - 2.0 * u**3), far * 6.0 * u * (1.0 - u) / 0.3
    push = np.where(u < 1.0, far * (6.0 - 12.0 * u) / 0.09, 0.0)
    motor = dt.Motor("m", 0.5, 0.07)
    effects: dict[str, Any] = {
        name: (
            dt.ReflectedRotor(ROTORS[k], RATIOS[k]), dt.DryFriction(rubbing(name)), dt.MotorCurrent(motor),
            dt.GivenCurrent([0.0], [0.0]),
            dt.DryFriction(rubbing(f"{name} motor"), "motor"), dt.ViscousFriction(dt.Friction(viscous=3e-4), "motor"),
            dt.MeshLoss(dt.Gear(f"g{k}", RATIOS[k], kind="spur", efficiency=ETA[k])), dt.WallSpring(80.0, 2.0, 0.1),
        )
        for k, name in enumerate("ab")
    }  # fmt: skip
    motion = dt.Motion("m", ("a", "b"), time, place, speed, push)
    scene = dt.Scene(bare(), effects | {"scene": (dt.CommandedMotion(motion),)}, 0.4)
    run = simulate(scene, solver=dt.Inverse(), interval=0.05, checked=False)
    assert run.time.tolist() == pytest.approx(time.tolist())
    for what, values in (("position", place), ("speed", speed), ("acceleration", push)):
        np.testing.assert_allclose(np.stack([run[f"{one}.{what}"] for one in "ab"], axis=1), values, atol=1e-12)
    for k in range(9):
        load = dt.inverse_dynamics(bare(), place[k], speed[k], push[k]) + 80.0 * (place[k] - 0.1) + 2.0 * speed[k]
        for i, name in enumerate("ab"):
            going, moving = speed[k, i] or push[k, i], abs(speed[k, i]) > 1e-12
            if not moving and k == 0:
                continue  # about to move: of its friction more than one view is possible
            way = 0 if not moving else 1 if going > 0.0 else -1
            joint = way * bounds(name, 1.0, way, True) if way else 0.0
            shaft = way * bounds(f"{name} motor", RATIOS[i], way, True) if way else 0.0
            mesh = load[i] + joint
            lost = lost_in_mesh(i, mesh, way) if way else 0.0
            whole = mesh + lost + shaft + ROTORS[i] * RATIOS[i] ** 2 * push[k, i]
            torque = whole / RATIOS[i] + 3e-4 * RATIOS[i] * speed[k, i]
            assert run[f"{name}.mesh_torque"][k] == pytest.approx(mesh, rel=1e-9), (k, name)
            assert run[f"{name}.joint_friction"][k] == pytest.approx(joint)
            assert run[f"{name}.electromagnetic_torque"][k] == pytest.approx(torque, rel=1e-9), (k, name)
            assert run[f"{name}.current"][k] == pytest.approx(torque / 0.07)
            volts = 0.5 * torque / 0.07 + 0.07 * RATIOS[i] * speed[k, i]
            assert run[f"{name}.voltage"][k] == pytest.approx(volts, rel=1e-9)
            assert run[f"{name}.motor_speed"][k] == pytest.approx(RATIOS[i] * speed[k, i])
    peak = np.abs(run["a.current"]).max()
    for limit, refused in ((1.001 * peak, False), (0.999 * peak, True)):
        effects["a"] = tuple(dt.MotorCurrent(motor, limit) if isinstance(one, dt.MotorCurrent) else one
                             for one in effects["a"])  # fmt: skip
        told = dt.Scene(bare(), effects | {"scene": (dt.CommandedMotion(motion),)}, 0.4)
        if refused:
            with pytest.raises(dt.InputError, match="a: the command takes"):
                simulate(told, solver=dt.Inverse(), interval=0.05, checked=False)
        else:
            simulate(told, solver=dt.Inverse(), interval=0.05, checked=False)
