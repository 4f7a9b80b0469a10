"""Arms with closed loops: palletisers and a screw on a triangle, against MuJoCo's and pinocchio's constraints."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from pinned_arm import constrained
from scipy.linalg import eigh

import drivetrain as dt
from drivetrain.arm.closures import Closure, LoopLink, with_closures
from drivetrain.arm.geared import with_rotors
from drivetrain.arm.rotors import Rotor
from drivetrain.dynamics.closed import main_chain, whole_motion
from drivetrain.dynamics.flexibility import locked_frequencies
from drivetrain.dynamics.inverse import inverse_dynamics, joint_loads
from drivetrain.export.urdf import urdf_text
from drivetrain.spatial.poses import exp_pose, pose

Y, Z = np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0])


def link(name, axis, point, com, mass, rod, **options):
    """A body whose principal axes are along no axis of its frame."""
    return LoopLink(
        name, axis, np.array(point), mass, np.array(com), mass * np.diag([0.02, 0.03, 0.025]) * rod, **options
    )


def open_chain(links, tip, **options):
    return dt.Arm.from_screws(
        np.array([pose(point=one.com) for one in links]), np.array([one.screw for one in links]),
        np.array([one.mass for one in links]), np.array([one.inertia for one in links]), pose(point=tip),
        joint_points=np.array([one.point for one in links]), joint_names=[one.joint for one in links], **options,
    )  # fmt: skip


def palletiser(skew=0.0):
    """Turret, lower arm, forearm, wrist, flange; crank and rod drive the forearm, two parallelograms level the wrist.

    With a skew the linkages are not parallelograms, so the passive joints are not linear in the driven ones.
    """
    main = open_chain(
        [
            link("turret", Z, [0, 0, 0.2], [0.1, 0.02, 0.5], 180.0, 1.0),
            link("lower", Y, [0.26, 0, 0.74], [0.27, 0.05, 1.2], 60.0, 2.0),
            link("elbow", Y, [0.26, 0, 1.685], [0.7, -0.02, 1.7], 45.0, 2.0),
            link("wrist", Y, [1.285, 0, 1.685], [1.35, 0, 1.66], 12.0, 1.0),
            link("flange", Z, [1.5, 0, 1.6], [1.5, 0.01, 1.5], 6.0, 1.0),
        ],
        [1.5, 0, 1.45],
    )
    crank = link("crank", Y, [0.26, 0.1, 0.74], [0.1, 0.1, 0.76], 14.0, 1.0, driven=True)
    rod = link("rod", Y, [-0.04, 0.1, 0.74 + skew], [-0.04, 0.1, 1.2], 9.0, 1.0)
    post = link("post", Y, [0.1, -0.1, 0.9], [0.1, -0.1, 1.4], 7.0, 1.0)
    plate = link("plate", Y, [0.1, -0.1, 1.845 + skew], [0.25, -0.1, 1.8], 5.0, 1.0)
    tie = link("tie", Y, [0.35, -0.1, 1.9], [0.9, -0.1, 1.9], 6.0, 1.0)
    closures = [
        Closure("turret", "elbow", [-0.04, 0.1, 1.685], (crank, rod)),
        Closure("turret", "lower", [0.26, -0.1, 1.685], (post, plate)),
        Closure("plate", "wrist", [1.375 + skew, -0.1, 1.9], (tie,)),
    ]
    return with_closures(main, closures, ["elbow", "wrist"])


def actuator():
    """A boom driven by a screw hinged at the base."""
    main = open_chain([link("boom", Y, [0, 0, 1.0], [0.6, 0, 1.1], 30.0, 2.0)], [1.2, 0, 1.1])
    start, end = np.array([0.1, 0, 0.2]), np.array([0.5, 0, 1.0])
    along = (end - start) / np.linalg.norm(end - start)
    links = (
        link("cylinder", Y, start, start + 0.2 * along, 8.0, 1.0),
        link("screw", along, start, start + 0.6 * along, 4.0, 1.0, slides=True, driven=True),
    )
    return with_closures(main, [Closure("base", "boom", end, links)], ["boom"])


CASES = {"palletiser": palletiser(), "skew": palletiser(0.05), "actuator": actuator()}


def motion(arm, samples=12, seed=3):
    rng = np.random.default_rng(seed)
    size = np.where(arm.slides, 0.15, 0.5)
    return [scale * size * rng.uniform(-1.0, 1.0, (samples, arm.n)) for scale in (1.0, 4.0, 10.0)]


@pytest.mark.parametrize("name", CASES)
def test_closed_positions_speeds_accelerations(name):
    """Pins are closed, and the rates are the derivatives of the positions, by central differences along a path."""
    arm = CASES[name]
    q, qd, qdd = motion(arm)
    step = 1e-5
    paths = [q + t * qd + 0.5 * t**2 * qdd for t in (-step, 0.0, step)]
    rest = np.zeros_like(q)
    before, here, after = (whole_motion(arm.linkage, path, rest, rest).position for path in paths)
    found = whole_motion(arm.linkage, q, qd, qdd)
    loops = arm.linkage.loops
    for (a, m), (b, k), point in loops.pins:
        ends = []
        for chain, count in ((a, m), (b, k)):
            place = pose(point=point)
            for joint in reversed(loops.paths[chain][:count]):
                owner = loops.owner[joint]
                screw = arm.linkage.chains[owner].screws[loops.paths[owner].index(joint)]
                place = np.array([exp_pose(screw * angle) for angle in here[:, joint]]) @ place
            ends.append(place[..., :3, 3])
        assert np.abs(ends[0] - ends[1]).max() < 1e-10
    # Rounding of 1e-16 in a second difference over 1e-10 gives some 1e-5; the truncation error is of the same size.
    np.testing.assert_allclose((after - before) / (2 * step), found.velocity, atol=1e-6 * np.abs(qd).max() * 10)
    np.testing.assert_allclose((after - 2 * here + before) / step**2, found.acceleration, rtol=1e-3, atol=1e-3)


@pytest.mark.parametrize("name", CASES)
def test_locked_frequencies_of_loops(name):
    """The eigenvalues of stiffness and mass, whose columns are torques per unit of acceleration."""
    arm = CASES[name]
    q = motion(arm, samples=3)[0]
    zero, stiffness = np.zeros(q.shape), np.geomspace(1e5, 4e5, arm.n)
    held = inverse_dynamics(arm, q, zero, zero)
    mass = np.stack([inverse_dynamics(arm, q, zero, zero + unit) - held for unit in np.eye(arm.n)], axis=2)
    squares = np.array([eigh(np.diag(stiffness), one, eigvals_only=True) for one in mass])
    np.testing.assert_allclose(locked_frequencies(arm, q, stiffness), np.sqrt(squares) / (2.0 * np.pi), rtol=1e-7)


def test_motors_of_a_closed_loop_have_the_torque_over_their_ratio():
    ratios = (120.0, -90.0, 60.0, 100.0, 40.0)[: CASES["palletiser"].n]
    arm = with_rotors(CASES["palletiser"], [Rotor(ratio, inertia=2e-4) for ratio in ratios])
    q, qd, qdd = motion(arm, samples=4)
    found = joint_loads(arm, q, qd, qdd)
    np.testing.assert_allclose(found.torque, inverse_dynamics(arm, q, qd, qdd), rtol=1e-12)
    np.testing.assert_allclose(found.motor * ratios, found.torque, rtol=1e-12)
    one = joint_loads(arm, q[1], qd[1], qdd[1])
    for name in ("torque", "gear", "motor", "wrench", "carrier_acceleration"):
        np.testing.assert_allclose(getattr(one, name), getattr(found, name)[1], rtol=1e-10, atol=1e-10)


def mujoco_model(arm):
    """The bodies as one MuJoCo tree, with pins as connect constraints; at zero bodies have the axes of the world."""
    loops, chains = arm.linkage.loops, arm.linkage.chains
    spec = mujoco.MjSpec()
    spec.option.gravity = arm.gravity
    bodies, origin = {-1: spec.worldbody}, {-1: np.zeros(3)}
    for body, owner in enumerate(loops.owner):
        chain, at = chains[owner], loops.paths[owner].index(body)
        parent = loops.before(body)
        here = chain.joint_points[at]
        one = bodies[parent].add_body(name=f"b{body}", pos=here - origin[parent])
        home = chain.home[at]
        tensor = home[:3, :3] @ chain.inertias[at] @ home[:3, :3].T
        one.mass, one.ipos, one.explicitinertial = chain.masses[at], home[:3, 3] - here, True
        one.fullinertia = [tensor[0, 0], tensor[1, 1], tensor[2, 2], tensor[0, 1], tensor[0, 2], tensor[1, 2]]
        kind = mujoco.mjtJoint.mjJNT_SLIDE if chain.slides[at] else mujoco.mjtJoint.mjJNT_HINGE
        one.add_joint(name=f"j{body}", type=kind, axis=chain.axes[at])
        bodies[body], origin[body] = one, here
    for first, second, point in loops.pins:
        ends = [loops.paths[chain][count - 1] if count else -1 for chain, count in (first, second)]
        one = spec.add_equality(type=mujoco.mjtEq.mjEQ_CONNECT, objtype=mujoco.mjtObj.mjOBJ_BODY)
        one.name1 = f"b{ends[0]}"
        one.name2 = f"b{ends[1]}" if ends[1] >= 0 else "world"
        one.data[:3] = point - origin[ends[0]]
    return spec.compile()


@pytest.mark.parametrize("name", CASES)
def test_torques_against_mujoco(name):
    """MuJoCo's tree torques, with multipliers of its equality constraints chosen for zero torque of passive joints."""
    arm = CASES[name]
    q, qd, qdd = motion(arm)
    model = mujoco_model(arm)
    data, loops = mujoco.MjData(model), arm.linkage.loops
    whole = whole_motion(arm.linkage, q, qd, qdd)
    torque = inverse_dynamics(arm, q, qd, qdd)
    driven, passive = list(loops.driven), list(loops.passive)
    for k in range(len(q)):
        data.qpos, data.qvel = whole.position[k], whole.velocity[k]
        model.opt.disableflags = 0
        mujoco.mj_forward(model, data)
        rows = data.efc_J.reshape(-1, model.nv)[: 3 * len(loops.pins)].copy()
        # In MuJoCo, too, the pins are closed and the speeds satisfy the constraints.
        assert np.abs(data.efc_pos[: len(rows)]).max() < 1e-9 and np.abs(rows @ data.qvel).max() < 1e-8
        model.opt.disableflags = int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
        mujoco.mj_forward(model, data)
        data.qacc = whole.acceleration[k]
        mujoco.mj_inverse(model, data)
        tree = data.qfrc_inverse.copy()
        multipliers = np.linalg.lstsq(rows[:, passive].T, tree[passive], rcond=None)[0]
        np.testing.assert_allclose(rows[:, passive].T @ multipliers, tree[passive], atol=1e-8 * np.abs(tree).max())
        expected = tree[driven] - rows[:, driven].T @ multipliers
        np.testing.assert_allclose(torque[k], expected, rtol=1e-9, atol=1e-9 * np.abs(tree).max())


@pytest.mark.parametrize("name", CASES)
def test_accelerations_of_pinocchio(name):
    """Under our torques pinocchio's constrained dynamics gives our accelerations."""
    arm = CASES[name]
    q, qd, qdd = motion(arm, seed=5)
    moved = constrained(arm)
    whole, torque = whole_motion(arm.linkage, q, qd, qdd), inverse_dynamics(arm, q, qd, qdd)
    for k in range(len(q)):
        found = moved(whole.position[k], whole.velocity[k], torque[k])
        size = np.abs(whole.acceleration[k]).max()
        np.testing.assert_allclose(found, whole.acceleration[k], atol=1e-10 * size)  # measured 1e-13


@pytest.mark.parametrize("name", CASES)
def test_power_balance(name):
    """The power of the drives is the rate of kinetic and potential energy, by differences of MuJoCo's energies."""
    arm = CASES[name]
    q, qd, qdd = motion(arm, samples=4, seed=8)
    model = mujoco_model(arm)
    data, step = mujoco.MjData(model), 1e-5
    model.opt.enableflags = int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    energies = []
    for t in (-step, step):
        whole = whole_motion(arm.linkage, q + t * qd + 0.5 * t**2 * qdd, qd + t * qdd, qdd)
        for k in range(len(q)):
            data.qpos, data.qvel = whole.position[k], whole.velocity[k]
            mujoco.mj_forward(model, data)
            mujoco.mj_energyPos(model, data), mujoco.mj_energyVel(model, data)
            energies.append(data.energy.sum())
    before, after = np.array(energies).reshape(2, -1)
    power = np.sum(inverse_dynamics(arm, q, qd, qdd) * qd, axis=1)
    np.testing.assert_allclose((after - before) / (2 * step), power, rtol=1e-5)


def test_parallelograms_are_a_coupling():
    """In a palletiser with exact parallelograms the elbow follows crank minus lower arm, and the flange stays level."""
    arm = CASES["palletiser"]
    q = motion(arm)[0]
    position = whole_motion(arm.linkage, q, 0 * q, 0 * q).position
    lower, crank = (arm.joint_names.index(name) for name in ("lower", "crank"))
    np.testing.assert_allclose(position[:, 2], q[:, crank] - q[:, lower], atol=1e-9)
    np.testing.assert_allclose(position[:, 3], -q[:, crank], atol=1e-9)


def test_wrenches_are_known_outside_of_loops():
    """Wrenches at turret and flange are determined, those at joints within loops are not (NaN)."""
    arm = CASES["palletiser"]
    loads = joint_loads(arm, *motion(arm))
    known = ~np.isnan(loads.wrench).any(axis=(0, 2))
    assert dict(zip(arm.joint_names, known, strict=True)) == {
        "turret": True, "lower": False, "flange": True, "crank": False
    }  # fmt: skip
    np.testing.assert_allclose(loads.wrench[:, 0, 2], loads.gear[:, 0], rtol=1e-9, atol=1e-9)


def test_functions_for_open_chains_refuse_loops():
    arm = CASES["palletiser"]
    q = np.zeros(arm.n)
    for call in (dt.mass_matrix, dt.tip_pose):
        with pytest.raises(dt.InputError, match="closed loops"):
            call(arm, q)
    for once in (dt.torque_parameters, urdf_text, dt.book_lists, dt.symbolic_dynamics, dt.on_moving_base):
        with pytest.raises(dt.InputError, match="closed loops"):
            once(arm)
    with pytest.raises(dt.InputError, match=r"moves of the tool .* closed loops .*state positions of the driven"):
        dt.tool_motion("m", arm, q, [dt.Move("line", [1.4, 0.0, 1.4])], profile="quintic", tool=dt.ToolLimits(1.0))


def test_single_causes_add_up_with_loops():
    """Gravity, speeds and a wrench at the tip alone add up; the wrench does the work of the tip's motion."""
    arm = CASES["palletiser"]
    q, qd, _ = (rows[::7] for rows in motion(arm))
    wrench, still = np.array([1.0, -2.0, 3.0, 40.0, -50.0, 60.0]), np.zeros_like(q)
    alone = dt.gravity_torque(arm, q) + dt.velocity_torque(arm, q, qd) + dt.tip_torque(arm, q, wrench)
    np.testing.assert_allclose(alone, dt.bias_torque(arm, q, qd, tip_wrench=wrench), atol=1e-9)
    np.testing.assert_allclose(dt.gravity_torque(arm, q[0]), inverse_dynamics(arm, q[0], still[0], still[0]), atol=1e-9)
    step = 1e-6
    before, now, after = (dt.tip_pose(*main_chain(arm, q + sign * step * qd)) for sign in (-1, 0, 1))
    velocity, rate = (after - before)[:, :3, 3] / (2 * step), (after - before)[:, :3, :3] / (2 * step)
    spin = rate @ np.swapaxes(now[:, :3, :3], 1, 2)
    turning = np.column_stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]])
    moment, force = (now[:, :3, :3] @ part for part in np.split(wrench, 2))
    power = np.sum(moment * turning + force * velocity, axis=1)
    np.testing.assert_allclose(np.sum(dt.tip_torque(arm, q, wrench) * qd, axis=1), power, rtol=1e-6, atol=1e-7)


def test_dead_centres_and_reach():
    """Positions at which pins cannot close are reported."""
    with pytest.raises(dt.InputError, match=r"reach|dead centre"):
        inverse_dynamics(CASES["actuator"], [2.0], [0.0], [0.0])
    one = open_chain(
        [link("a", Y, [0, 0, 0], [0.1, 0, 0], 1.0, 1.0), link("b", Y, [1, 0, 0], [1.1, 0, 0], 1.0, 1.0)], [1.5, 0, 0]
    )
    free = with_closures(one, [], ["b"])
    with pytest.raises(dt.InputError, match="no pin holds"):
        inverse_dynamics(free, [0.1], [0.0], [0.0])
