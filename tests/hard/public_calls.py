"""Valid calls of the public functions, for others to spoil: name, function, and arguments that hold numbers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from random_arms import pose, random_arm, rotors_of, tensor

import drivetrain as dt
from drivetrain import modern_robotics as book
from drivetrain.arm.dh import DHConvention, DHRow
from drivetrain.drive.amplifier import Amplifier, Supply
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor, exact_current_step
from drivetrain.drive.thermal.heat import periodic_temperature, temperature_of_current
from drivetrain.drive.thermal.thermal_network import thermal_network
from drivetrain.drive.thermal.warm_up import warm_up
from drivetrain.motion.point_to_point import MotionLimits, waypoint_motion
from drivetrain.motion.profiles import Quintic, SCurve, Trapezoid
from drivetrain.spatial.beams import box_tube, end_deflection, round_tube
from drivetrain.spatial.inertia import cuboid, cylinder, ellipsoid
from drivetrain.spatial.poses import adjoint, exp_pose, inverse_pose, log_pose
from drivetrain.spatial.rotations import exp_rotation, log_rotation

Call = tuple[Callable[..., Any], dict[str, Any]]

RNG = np.random.default_rng(11)


def pose_at(x: float) -> np.ndarray:
    place = np.eye(4)
    place[0, 3] = x
    return place


ONE = random_arm(4, "R")
BARE = random_arm(3)
ARM = dt.with_rotors(BARE, rotors_of(3, "balanced", 6))
Q, QD, QDD, TAU, WRENCH = RNG.normal(size=(5, 6))
ROD = dt.Arm.from_screws(
    [pose_at(0.15)], [[0, 0, 1.0, 0, 0, 0]], [0.5], [np.diag([1e-3, 0.5 * 0.3**2 / 12, 0.5 * 0.3**2 / 12])]
)
MANY = RNG.normal(size=(3, 3, 6))
POSE, TENSOR = pose(RNG), tensor(RNG, 0.1)
TETRAHEDRON = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
MOTOR = {
    "resistance": 0.299, "torque_constant": 0.0302, "inductance": 8.2e-5, "rotor_inertia": 1.4e-5, "mass": 0.48,
    "nominal_voltage": 24.0, "no_load_current": 0.137, "no_load_speed": 790.0, "nominal_current": 6.0,
    "resistance_winding_housing": 1.9, "resistance_housing_ambient": 4.65, "winding_time_constant": 41.0,
    "housing_time_constant": 1120.0, "max_winding_temperature": 155.0, "reference_temperature": 25.0,
    "magnet_coefficient": -0.001,
}  # fmt: skip
GEAR = {
    "ratio": 100.0, "efficiency": 0.8, "backdriving_efficiency": 0.7, "inertia": 1e-5, "mass": 1.0,
    "no_load_torque": 0.01, "continuous_torque": 50.0, "stiffness_1": 1e4, "stiffness_2": 2e4, "torque_1": 10.0,
    "backlash": 1e-4, "max_input_speed": 600.0,
}  # fmt: skip
RE40 = Motor("typical", **MOTOR)
NETWORK = thermal_network(RE40, 25.0)
SHEET = {"time": np.array([0.0, 1.0, 1.0, 3.0]), "values": np.array([4.0, 4.0, 0.5, 0.5])}


def plane(arm: dt.Arm, normal: Any, point: Any) -> dt.PointOnSurface:
    return dt.PointOnSurface(dt.Attachment.tip(arm), dt.Plane(normal, point))


def rotors(ratio: Any, inertia: Any, mass: Any, carrier: Any) -> dt.Arm:
    return dt.with_rotors(BARE, [dt.Rotor(ratio, inertia, mass, carrier=carrier)] + [None] * 5)


def dh(a: Any, alpha: Any, d: Any, mass: Any, com: Any, inertia: Any, gravity: Any) -> dt.Arm:
    row = DHRow(a, alpha, d, mass=mass, com=com, inertia=inertia)
    return dt.arm_from_dh([row, row], convention=DHConvention.CLASSIC, gravity=gravity)


def bent(outer: Any, inner: Any, start: Any, end: Any, mass: Any) -> Any:
    beam = dt.Beam(round_tube(outer, inner, 7e10, 2.6e10), start, end)
    return dt.with_flexible_links(ROD, {0: dt.BendingLink(beam, mass)})


def mesh(vertices: Any, density: Any) -> Any:
    return dt.mesh_body(dt.TriangleMesh(vertices, FACES), density=density)


def on_arm(function: Callable[..., Any], *names: str) -> Call:
    """A function of the arm and states: one sample, and rates too where it takes them."""
    given = {"q": Q, "qd": QD, "qdd": QDD, "tau": TAU, "tip_wrench": WRENCH}

    def call(**values: Any) -> Any:
        wrench = {"tip_wrench": values.pop("tip_wrench")} if "tip_wrench" in values else {}
        return function(ARM, *values.values(), **wrench)

    return call, {name: given[name] for name in names}


STATES: dict[str, tuple[str, ...]] = {
    "inverse_dynamics": ("q", "qd", "qdd", "tip_wrench"), "drive_torques": ("q", "qd", "qdd", "tip_wrench"),
    "joint_loads": ("q", "qd", "qdd", "tip_wrench"), "power_balance": ("q", "qd", "qdd", "tip_wrench"),
    "forward_dynamics": ("q", "qd", "tau", "tip_wrench"), "articulated_body": ("q", "qd", "tau", "tip_wrench"),
    "bias_torque": ("q", "qd", "tip_wrench"), "velocity_torque": ("q", "qd"), "tip_torque": ("q", "tip_wrench"),
    "gravity_torque": ("q",), "mass_matrix": ("q",), "coriolis_matrix": ("q", "qd"), "christoffel_symbols": ("q",),
    "mass_matrix_rate": ("q", "qd"), "closed_form": ("q", "qd"), "kinetic_energy": ("q", "qd"),
    "potential_energy": ("q",), "link_poses": ("q",), "tip_pose": ("q",), "space_jacobian": ("q",),
    "body_jacobian": ("q",), "space_jacobian_rate": ("q", "qd"), "body_jacobian_rate": ("q", "qd"),
    "task_space_dynamics": ("q", "qd"), "acceleration_ellipsoid": ("q",), "torque_ellipsoid": ("q",),
    "tip_acceleration_ellipsoid": ("q",), "tip_force_ellipsoid": ("q",),
}  # fmt: skip


def public_calls() -> dict[str, Call]:
    """Every public function that takes numbers, and the descriptions that they are built from."""
    calls: dict[str, Call] = {name: on_arm(getattr(dt, name), *states) for name, states in STATES.items()}
    calls["inverse_dynamics of many"] = (
        lambda q, qd, qdd: dt.inverse_dynamics(ARM, q, qd, qdd), dict(zip(("q", "qd", "qdd"), MANY, strict=True))
    )  # fmt: skip
    calls |= _of_the_book() | _of_arms() | _of_dynamics() | _of_drives() | _of_motions() | _of_bodies()
    return calls


def _of_the_book() -> dict[str, Call]:
    """The functions under the names of the book's own package."""
    lists = dt.book_lists(BARE)
    chain = {"Mlist": np.array(lists.Mlist), "Glist": np.array(lists.Glist), "Slist": np.array(lists.Slist)}
    state = {"thetalist": Q, "dthetalist": QD}
    weight, tip = {"g": np.array([0.0, 0.0, -9.81])}, {"Ftip": WRENCH}
    rows = {"thetamat": MANY[0], "dthetamat": MANY[1], "ddthetamat": MANY[2], **weight, "Ftipmat": 0.1 * MANY[2]}
    return {
        "book.InverseDynamics": (book.InverseDynamics, {**state, "ddthetalist": QDD, **weight, **tip, **chain}),
        "book.ForwardDynamics": (book.ForwardDynamics, {**state, "taulist": TAU, **weight, **tip, **chain}),
        "book.MassMatrix": (book.MassMatrix, {"thetalist": Q, **chain}),
        "book.VelQuadraticForces": (book.VelQuadraticForces, {**state, **chain}),
        "book.GravityForces": (book.GravityForces, {"thetalist": Q, **weight, **chain}),
        "book.EndEffectorForces": (book.EndEffectorForces, {"thetalist": Q, **tip, **chain}),
        "book.EulerStep": (book.EulerStep, {**state, "ddthetalist": QDD, "dt": 0.01}),
        "book.InverseDynamicsTrajectory": (book.InverseDynamicsTrajectory, {**rows, **chain}),
        "book.ForwardDynamicsTrajectory": (
            book.ForwardDynamicsTrajectory,
            {**state, "taumat": MANY[0], **weight, "Ftipmat": 0.1 * MANY[2], **chain, "dt": 0.01, "intRes": 2},
        ),
    }


def _of_arms() -> dict[str, Call]:
    chain = {
        "home": np.array(BARE.home), "screws": np.array(BARE.screws), "masses": np.array(BARE.masses),
        "inertias": np.array(BARE.inertias), "tip": np.array(BARE.tip), "gravity": np.array([0.0, 0.0, -9.81]),
        "lower": np.full(6, -3.0), "upper": np.full(6, 3.0), "speed_limits": np.full(6, 2.0),
    }  # fmt: skip
    dh_numbers = {
        "a": 0.4, "alpha": 1.5, "d": 0.1, "mass": 2.0, "com": np.zeros(3), "inertia": np.eye(3) * 0.1,
        "gravity": np.array([0.0, 0.0, -9.81]),
    }  # fmt: skip
    body = {"mass": 1.0, "com": np.array([0.1, 0.0, 0.2]), "inertia": np.eye(3) * 0.01}
    return {
        "Arm.from_screws": (dt.Arm.from_screws, chain),
        "arm_from_dh": (dh, dh_numbers),
        "Rotor": (rotors, {"ratio": 100.0, "inertia": 1e-4, "mass": 0.5, "carrier": 0}),
        "Rotor of a tensor": (lambda **v: rotors(100.0, mass=0.5, carrier=0, **v), {"inertia": np.eye(3) * 1e-4}),
        "with_body": (lambda **v: dt.with_body(ARM, **v), {"link": 2, **body}),
        "with_payload": (lambda **v: dt.with_payload(ARM, **v), body),
        "with_coupling": (lambda coupling: dt.with_coupling(ARM, coupling), {"coupling": np.eye(6)}),
        "belts_over": (dt.belts_over, {"passes": [1.0, 0.5, -1.0]}),
        "differential": (dt.differential, {"first": 1.0, "second": 2.0}),
        "with_flexible_links": (
            bent, {"outer": 0.05, "inner": 0.04, "start": np.zeros(3), "end": np.array([0.3, 0, 0]), "mass": 0.5}
        ),
        "Attachment": (lambda link, pose: dt.Attachment(link, pose), {"link": 2, "pose": POSE}),
    }  # fmt: skip


def _of_dynamics() -> dict[str, Call]:
    held = {"normal": np.array([0, 0, 1.0]), "point": np.zeros(3), "q": Q, "qd": QD, "tau": TAU}
    rows = {"normal": np.array([0, 0, 1.0]), "point": np.zeros(3), "q": Q}
    time, path = np.linspace(0.0, 1.0, 12), np.sin(np.linspace(0.0, 1.0, 12))[:, None]
    run = {"q0": Q, "qd0": 0.1 * QD, "duration": 0.02, "interval": 0.01}
    touch = dt.tip_pose(ARM, Q)[:3, 3]
    stiff = {"q": Q, "stiffness": np.full(6, 1e4)}
    return {
        "constrained_forward_dynamics": (
            lambda normal, point, **v: dt.constrained_forward_dynamics(ARM, plane(ARM, normal, point), **v), held
        ),
        "constrained_inverse_dynamics": (
            lambda normal, point, q, qd, tau: dt.constrained_inverse_dynamics(
                ARM, plane(ARM, normal, point), q, qd, tau
            ),
            held,
        ),
        "constraint_projectors": (
            lambda normal, point, q: dt.constraint_projectors(ARM, plane(ARM, normal, point), q), rows
        ),
        "simulate_passive": (
            lambda step, **v: dt.simulate_passive(ARM, **v, solver=dt.RungeKutta4(step)), {**run, "step": 5e-3}
        ),
        "simulate_passive, adaptive": (
            lambda rtol, atol, **v: dt.simulate_passive(ARM, **v, solver=dt.DormandPrince853(rtol, atol)),
            {**run, "rtol": 1e-6, "atol": 1e-8},
        ),
        "simulate_constrained": (
            lambda normal, point, **v: dt.simulate_constrained(ARM, plane(ARM, normal, point), **v),
            {**run, "duration": 0.003, "interval": 1e-3, "normal": held["normal"], "point": touch},
        ),
        "LoopClosure": (
            lambda link, pose, **v: dt.constrained_forward_dynamics(
                ARM, dt.LoopClosure(dt.Attachment(link, pose), dt.Attachment.base(POSE), dt.ClosingJoint.BALL), **v
            ),
            {"link": 5, "pose": POSE, "q": Q, "qd": QD, "tau": TAU},
        ),
        "load_arm": (lambda gravity: dt.load_arm("ur5", gravity=gravity), {"gravity": np.array([0.0, 0.0, -9.81])}),
        "Baumgarte": (dt.Baumgarte, {"rate": 10.0}),
        "Projection": (dt.Projection, {"tolerance": 1e-12, "most": 5}),
        "Euler": (dt.Euler, {"step": 1e-3}),
        "torque_from_positions": (
            lambda **v: dt.torque_from_positions(ONE, **v), {"time": time, "q": path, "resolution": 1e-4}
        ),
        "sweep_ratio": (lambda **v: dt.sweep_ratio(ARM, **v), {"q": Q[None], "ratios": np.array([10.0, 50.0, 100.0])}),
        "locked_frequencies": (lambda **v: dt.locked_frequencies(ARM, **v), stiff),
        "free_frequencies": (lambda **v: dt.free_frequencies(ARM, **v), stiff),
        "tip_compliance": (lambda **v: dt.tip_compliance(ARM, **v), stiff),
        "effective_mass": (lambda **v: dt.effective_mass(ARM, **v), {"q": Q, "direction": np.array([0.0, 0.6, 0.8])}),
    }  # fmt: skip


def _of_drives() -> dict[str, Call]:
    torques = SHEET["values"] * 0.03
    return {
        "Motor": (lambda **v: Motor("any", **v), MOTOR),
        "Gear": (lambda **v: Gear("any", kind="planetary", **v), GEAR),
        "Friction": (
            Friction, {"coulomb": 0.1, "viscous": 0.01, "static": 0.2, "stribeck_speed": 0.1, "stribeck_exponent": 2.0}
        ),
        "book_curves": (dt.book_curves, {"static": 0.2, "kinetic": 0.1, "viscous": 0.01, "stribeck_speed": 0.1}),
        "Amplifier": (Amplifier, {"peak_current": 10.0, "continuous_current": 5.0, "modulation": 0.95}),
        "Supply": (Supply, {"voltage": 48.0, "peak_power": 500.0, "mean_power": 100.0, "regenerated_power": 10.0}),
        "inertia_matching_ratio": (dt.inertia_matching_ratio, {"load_inertia": 1.0, "rotor_inertia": 1e-4}),
        "thermal_network": (
            lambda **v: thermal_network(RE40, **v), {"ambient": 25.0, "housing_to_ambient": 4.0}
        ),
        "temperature_of_current": (
            lambda time, values: temperature_of_current(NETWORK, RE40, time, values), dict(SHEET)
        ),
        "periodic_temperature": (
            lambda time, values: periodic_temperature(NETWORK, RE40, time, values), {**SHEET, "values": torques}
        ),
        "warm_up": (
            lambda time, values, cycles, start: warm_up(NETWORK, RE40, time, values, cycles, start=start),
            {**SHEET, "cycles": 20, "start": (25.0, 25.0)},
        ),
        "exact_current_step": (
            lambda **v: exact_current_step(RE40, **v),
            {"current": 2.0, "voltage": 10.0, "speed": 100.0, "step": 1e-3, "winding_temperature": 80.0},
        ),
    }  # fmt: skip


def _of_motions() -> dict[str, Call]:
    points = np.array([[0.0, 0.0], [1.0, -1.0], [0.5, 0.2]])
    limits = {"speed": 1.0, "acceleration": np.array([5.0, 4.0])}

    def timed(points: Any, durations: Any, dwell: Any, sample_time: Any) -> Any:
        return waypoint_motion(
            "m", ("a", "b"), points, profile=Quintic(), durations=durations, dwell=dwell, sample_time=sample_time
        )

    def limited(points: Any, jerk: Any, **bounds: Any) -> Any:
        return waypoint_motion("m", ("a", "b"), points, profile=SCurve(), limits=MotionLimits(jerk=jerk, **bounds))

    def ramped(points: Any, share: Any, **bounds: Any) -> Any:
        profile = Trapezoid(share)
        timed = waypoint_motion("m", ("a", "b"), points, profile=profile, durations=[1.0, 1.0])
        return timed, waypoint_motion("m", ("a", "b"), points, profile=profile, limits=MotionLimits(**bounds))

    return {
        "waypoints by durations": (
            timed, {"points": points, "durations": [1.0, 0.5], "dwell": [0.0, 0.1, 0.0], "sample_time": 0.01}
        ),
        "waypoints by limits": (limited, {"points": points, "jerk": 50.0, **limits}),
        "trapezoids": (ramped, {"points": points, "share": 0.3, **limits}),
    }  # fmt: skip


def _of_bodies() -> dict[str, Call]:
    inertia = np.diag([0.1, 0.2, 0.25, 2.0, 2.0, 2.0])
    tube = {"outer": 0.05, "inner": 0.04, "youngs_modulus": 7e10, "shear_modulus": 2.6e10}
    box = {"width": 0.05, "height": 0.04, "wall": 0.003, "youngs_modulus": 7e10, "shear_modulus": 2.6e10}
    return {
        "RigidBody": (dt.RigidBody, {"mass": 1.0, "com": np.zeros(3), "inertia": TENSOR}),
        "RigidBody.seen_from": (
            lambda pose_a_b: dt.RigidBody(1.0, np.zeros(3), TENSOR).seen_from(pose_a_b),
            {"pose_a_b": POSE},
        ),
        "cuboid": (cuboid, {"mass": 1.0, "length": 0.1, "width": 0.2, "height": 0.3}),
        "cylinder": (cylinder, {"mass": 1.0, "radius": 0.1, "height": 0.3}),
        "ellipsoid": (ellipsoid, {"mass": 1.0, "a": 0.1, "b": 0.2, "c": 0.3}),
        "mesh_body": (mesh, {"vertices": TETRAHEDRON, "density": 1000.0}),
        "body_wrench": (dt.body_wrench, {"inertia": inertia, "twist": Q, "acceleration": QD}),
        "body_acceleration": (dt.body_acceleration, {"inertia": inertia, "twist": Q, "wrench": QD}),
        "free_motion": (
            dt.free_motion,
            {"inertia": inertia, "pose_s_b": POSE, "twist": Q, "time": np.array([0.0, 0.01, 0.02])},
        ),
        "round_tube": (round_tube, tube),
        "box_tube": (box_tube, box),
        "end_deflection": (
            lambda length, a, b: end_deflection(round_tube(**tube), length, a, b),
            {"length": 0.5, "a": Q, "b": QD},
        ),
        "exp_rotation": (exp_rotation, {"rotation_vector": Q[:3]}),
        "log_rotation": (log_rotation, {"rotation": POSE[:3, :3]}),
        "exp_pose": (exp_pose, {"twist": Q}),
        "log_pose": (log_pose, {"pose_a_b": POSE}),
        "inverse_pose": (inverse_pose, {"pose_a_b": POSE}),
        "adjoint": (adjoint, {"pose_a_b": POSE}),
    }
