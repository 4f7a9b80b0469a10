"""The demand on each joint, as weighted sums, against the recursion on an arm that carries the drives."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from drivetrain.arm.arm import Arm
from drivetrain.arm.coupling import placed, with_coupling
from drivetrain.catalog.read import Catalog
from drivetrain.drive.amplifier import Amplifier, Supply
from drivetrain.drive.drive import Drive, motor_torque
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.dynamics.inverse import joint_loads
from drivetrain.dynamics.mass import mass_matrix
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.sizing.demand.demand import JointDemand, workload
from drivetrain.study.model import ContainedDrive, DriveMass, JointTask, Mount, Payload, Safety, Study
from drivetrain.study.parts.mounting import loaded_arm

TRAVEL = 0.02  # m/rad of the prismatic joint


def joint_demand(study: Study, drives: dict[int, Drive], joint: int) -> JointDemand:
    return workload(study).at(joint, drives).demand(drives[joint])


def random_arm(rng: np.random.Generator, n: int) -> Arm:
    """A chain with axes in all directions, the third joint sliding."""
    home, screws, inertias = np.tile(np.eye(4), (n, 1, 1)), np.zeros((n, 6)), np.zeros((n, 3, 3))
    points = np.cumsum(rng.uniform(-0.3, 0.5, (n, 3)), axis=0)
    for i in range(n):
        axis = rng.normal(size=3)
        axis /= np.linalg.norm(axis)
        screws[i] = [0, 0, 0, *axis] if i == 2 else [*axis, *np.cross(points[i], axis)]
        home[i, :3, 3] = points[i] + rng.uniform(-0.2, 0.2, 3)
        spread = 0.2 * np.eye(3) + rng.normal(size=(3, 3)) * 0.1
        second = spread @ spread.T
        inertias[i] = np.trace(second) * np.eye(3) - second
    return Arm.from_screws(
        home, screws, rng.uniform(5, 8, n), inertias, joint_points=points, gravity=(1.0, -3.0, -9.0),
        joint_names=[f"j{i}" for i in range(n)],
    )  # fmt: skip


def random_study(
    seed: int, drive_mass: DriveMass, carrier: str, group: tuple[int, ...] = ()
) -> tuple[Study, dict[str, Drive]]:
    """With drives on any links; those of a group of joints are coupled, and may ride where it begins ("group")."""
    rng = np.random.default_rng(seed)
    n, samples = 4, 15
    arm = random_arm(rng, n)
    if group:
        k = len(group)
        arm = with_coupling(arm, placed(np.eye(k) + 0.5 * rng.normal(size=(k, k)), group, n))
    coupled = tuple(arm.joint_names[i] for i in group)
    carriers = {"mixed": ["parent", "child", "child", "base"]}.get(carrier, [carrier] * n)
    drives, tasks = {}, []
    for i, name in enumerate(arm.joint_names):
        motor = Motor(f"m{i}", 0.3, 0.05, rotor_inertia=1e-4, mass=rng.uniform(0.3, 1.5), diameter=0.06, length=0.08)
        gear = Gear(f"g{i}", float(rng.choice([-80.0, 30.0, 120.0])), efficiency=1.0, inertia=2e-5, mass=0.7)
        drives[name] = Drive(motor, gear)
        mount = Mount(carriers[i], rng.uniform(-0.1, 0.1))
        if carrier == "group":
            mount = Mount("parent", mount.offset, group[0] if i in group else None)
        held = ContainedDrive(rng.uniform(0.1, 0.2), mount) if drive_mass is DriveMass.REPLACED else None
        tasks.append(
            JointTask(
                name,
                None,
                (),
                (),
                mount,
                held,
                Friction(),
                None,
                Amplifier(),
                TRAVEL if i == 2 else None,
                coupled=coupled if i in group else (),
            )
        )
    q, qd, qdd = rng.normal(size=(3, samples, n))
    payload = np.repeat([0, -1, 1], 5)
    cycle = Cycle(
        arm.joint_names, np.arange(samples) * 0.1, q, qd, qdd, None, payload, ("a", "b"),
        np.zeros(samples, dtype=int), ("motion",),
    )  # fmt: skip
    bodies = tuple(Payload(s, m, rng.normal(size=3) * 0.1, 0.01 * np.eye(3)) for s, m in (("a", 2.0), ("b", 0.5)))
    study = Study(
        "random", "", "", "", arm, drive_mass, bodies, cycle, tuple(tasks), Supply(48.0), 25.0, Safety(), {}, {},
        Catalog(),
    )  # fmt: skip
    return study, drives


CASES = list(itertools.product(range(3), DriveMass, ("parent", "child", "base", "mixed")))


# Taking a point mass out of a random link may leave a spread that no body has; the dynamics do not mind.
@pytest.mark.filterwarnings("ignore::drivetrain.errors.PhysicsWarning")
@pytest.mark.parametrize(("seed", "drive_mass", "carrier"), CASES)
def test_sums_are_the_recursion_on_the_loaded_arm(seed: int, drive_mass: DriveMass, carrier: str) -> None:
    study, drives = random_study(seed, drive_mass, carrier)
    cycle = study.cycle
    arms = {index: loaded_arm(study, drives, index) for index in (-1, 0, 1)}
    rotor_rows = [drive.gear.ratio**2 * 1.2e-4 for drive in drives.values()]
    for joint, task in enumerate(study.joints):
        demand = joint_demand(study, {i: drives[t.name] for i, t in enumerate(study.joints)}, joint)
        travel = task.travel_per_turn or 1.0
        torque = motor_torque(
            drives[task.name], demand.gear_torque, demand.speed, demand.acceleration, demand.carrier_acceleration
        )
        for index, arm in arms.items():
            at = cycle.payload == index
            loads = joint_loads(arm, cycle.position[at], cycle.velocity[at], cycle.acceleration[at])
            scale = np.abs(loads.gear[:, joint]).max()
            np.testing.assert_allclose(demand.gear_torque[at], loads.gear[:, joint] * travel, atol=1e-11 * scale)
            # Equation 8.111 as the recursion has it, against the drive's law fed with the demand.
            largest = np.abs(loads.motor[:, joint]).max()
            np.testing.assert_allclose(torque.total[at], loads.motor[:, joint], atol=1e-11 * largest)
            diagonal = mass_matrix(arm, cycle.position[at])[:, joint, joint]
            if task.mount.carrier != "child":  # there the own rotor's coupling stands in the diagonal too
                own = rotor_rows[joint] / travel**2
                np.testing.assert_allclose(demand.load_inertia[at], (diagonal - own) * travel**2, rtol=1e-10)
            if demand.wrench is None:
                assert joint == 2
                continue
            size = np.abs(loads.wrench[:, joint]).max()
            np.testing.assert_allclose(demand.wrench[at], loads.wrench[:, joint], atol=1e-11 * size)


GROUPS = [(0, 1), (1, 2, 3), (1, 3), (0, 1, 2, 3), (2, 3)]
COUPLED = list(itertools.product(GROUPS, (DriveMass.ADDED, DriveMass.INCLUDED), ("group", "parent", "base", "mixed")))


@pytest.mark.parametrize(("group", "drive_mass", "carrier"), COUPLED)
def test_coupled_drives_as_the_recursion_has_them(group: tuple[int, ...], drive_mass: DriveMass, carrier: str) -> None:
    """Sums over the drives' numbers, the drive's law at its shaft, and power, against the whole coupled arm."""
    study, drives = random_study(3, drive_mass, carrier, group)
    cycle = study.cycle
    mounted = {i: drives[t.name] for i, t in enumerate(study.joints)}
    power = np.zeros(len(cycle.time))
    for joint, task in enumerate(study.joints):
        demand = joint_demand(study, mounted, joint)
        travel = task.travel_per_turn or 1.0
        torque = motor_torque(
            drives[task.name], demand.gear_torque, demand.speed, demand.acceleration, demand.carrier_acceleration
        )
        power += torque.total * drives[task.name].gear.ratio * demand.speed
        for index in (-1, 0, 1):
            at = cycle.payload == index
            arm = loaded_arm(study, drives, index)
            assert arm.coupling is not None
            loads = joint_loads(arm, cycle.position[at], cycle.velocity[at], cycle.acceleration[at])
            scale = np.abs(loads.gear[:, joint]).max()
            np.testing.assert_allclose(demand.gear_torque[at], loads.gear[:, joint] * travel, atol=1e-11 * scale)
            largest = np.abs(loads.motor[:, joint]).max()
            np.testing.assert_allclose(torque.total[at], loads.motor[:, joint], atol=1e-11 * largest)
            turns = np.linalg.inv(arm.coupling)
            diagonal = (turns.T @ mass_matrix(arm, cycle.position[at]) @ turns)[:, joint, joint]
            if carrier in ("group", "base"):  # else the own rotor's coupling may stand in the diagonal too
                own = drives[task.name].gear.ratio ** 2 * 1.2e-4 / travel**2
                np.testing.assert_allclose(demand.load_inertia[at], (diagonal - own) * travel**2, rtol=1e-9)
        assert (demand.wrench is None) == (joint in group or joint == 2)
    torques = np.zeros_like(cycle.position)
    for index in (-1, 0, 1):
        at = cycle.payload == index
        motion = (cycle.position[at], cycle.velocity[at], cycle.acceleration[at])
        torques[at] = joint_loads(loaded_arm(study, drives, index), *motion).torque
    wanted = np.sum(torques * cycle.velocity, axis=1)
    np.testing.assert_allclose(power, wanted, atol=1e-11 * np.abs(wanted).max())


def test_shoulder_of_a_planar_arm_by_hand() -> None:
    """A drive of mass m at the elbow, its rotor turning against the upper arm: written out."""
    length, mass = 0.5, 2.0
    home = np.tile(np.eye(4), (2, 1, 1))
    home[0, 0, 3], home[1, 0, 3] = 0.25, 0.9
    screws = np.array([[0, -1, 0, 0, 0, 0], [0, -1, 0, *np.cross([length, 0, 0], [0, -1, 0])]], dtype=float)
    points = np.array([[0, 0, 0], [length, 0, 0]], dtype=float)
    arm = Arm.from_screws(
        home, screws, [1.0, 1.0], np.tile(0.01 * np.eye(3), (2, 1, 1)), joint_points=points, joint_names=["a", "b"]
    )
    rng = np.random.default_rng(7)
    q, qd, qdd = rng.normal(size=(3, 9, 2))
    cycle = Cycle(
        ("a", "b"), np.arange(9) * 0.1, q, qd, qdd, None, np.full(9, -1), (), np.zeros(9, dtype=int), ("motion",)
    )
    tasks = tuple(JointTask(name, None, (), (), Mount(), None, Friction(), None, Amplifier()) for name in "ab")
    study = Study(
        "hand", "", "", "", arm, DriveMass.ADDED, (), cycle, tasks, Supply(48.0), 25.0, Safety(), {}, {},
        Catalog(),
    )  # fmt: skip
    spin, ratio = 3e-4, 60.0
    radius, tall = 0.03, 0.07
    motor = Motor("m", 0.3, 0.05, rotor_inertia=spin, mass=mass, diameter=2 * radius, length=tall)
    drive = Drive(motor, Gear("", ratio, kind="ideal", efficiency=1.0))
    massless = Drive(Motor("n", 0.3, 0.05), Gear("", 1.0, kind="ideal", efficiency=1.0))
    with_it = joint_demand(study, {0: massless, 1: drive}, 0)
    without = joint_demand(study, {0: massless, 1: massless}, 0)
    # The axis is horizontal: the cylinder turns about its own axis with the upper arm, rotor and housing apart.
    housing = 0.5 * mass * radius**2 - spin
    expected = (
        mass * length**2 * qdd[:, 0]
        + mass * 9.81 * length * np.cos(q[:, 0])
        + housing * qdd[:, 0]
        + spin * (qdd[:, 0] + ratio * qdd[:, 1])
    )
    np.testing.assert_allclose(with_it.gear_torque - without.gear_torque, expected, atol=1e-11)
    elbow = joint_demand(study, {0: massless, 1: drive}, 1)
    torque = motor_torque(drive, elbow.gear_torque, elbow.speed, elbow.acceleration, elbow.carrier_acceleration)
    np.testing.assert_allclose(torque.rotor, spin * (ratio * qdd[:, 1] + qdd[:, 0]), rtol=1e-12)
