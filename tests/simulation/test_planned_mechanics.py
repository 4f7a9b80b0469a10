"""Mass matrices and accelerations of planned scenes against kinetic energies written out rotor by rotor."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import pytest
from crank_arm import DIFFERENTIAL, short_crank, two_links
from random_arms import random_arm
from scipy.spatial.transform import Rotation

import drivetrain as dt
from drivetrain.arm.closures import with_second_motors
from drivetrain.arm.coupling import with_coupling
from drivetrain.arm.kinematics import tip_jacobian, tip_pose
from drivetrain.arrays import Array
from drivetrain.drive.stages import Stage, chained, with_stages
from drivetrain.drive.thermal.thermal_network import ThermalNetwork
from drivetrain.effects import signals
from drivetrain.effects.effect import Effect, Place, Ports
from drivetrain.effects.laws import scene_law
from drivetrain.simulation.core import equations, jacobian
from drivetrain.simulation.core.jacobian import sparsity_pattern
from drivetrain.simulation.core.records import parts_of
from drivetrain.simulation.engines import adaptive_step
from drivetrain.simulation.engines.starting import initial_memory
from drivetrain.simulation.planning.plan import Plan, plan
from drivetrain.simulation.run import simulate
from drivetrain.solvers.compiled_function import evaluate

AXIAL, RATIOS = (4e-4, 7e-4, 3e-4, 5e-4), (30.0, -20.0, 40.0, 25.0)  # rotors [kg m^2]
Q, QD = np.array([0.3, -0.8, 0.5, 1.1]), np.array([0.7, 0.4, -0.9, 0.6])
PULLEY = 0.05  # of a stage behind the gear, at the joint [kg m^2]
DAMPING = (3.0, 5.0, 2.0, 4.0)  # of springs
COUPLING = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.8], [0.0, 0.0, 1.0, 0.0], [0.0, -0.6, 0.0, 1.0]])


def gear(k: int, staged: bool = False) -> dt.Gear:
    if not staged:
        return dt.Gear(f"g{k}", RATIOS[k], stiffness_1=1e4)
    stage = Stage(type="belt", ratio=2.0, efficiency=0.96, inertia=PULLEY / 4.0)
    return with_stages(dt.Gear(f"g{k}", RATIOS[k] / 2.0, inertia=1e-5, stiffness_1=1e4), chained([stage]))


def bias_of(matrix_at: Callable[[Any], Any], turns: Any, speed: Any) -> Any:
    """Coriolis and centrifugal torques, from differences of the mass matrix ``matrix_at(shift of the joints)``."""
    step, c = 1e-5, len(speed)
    change = np.zeros((c, c, c))
    for k in range(len(turns)):
        more, less = (matrix_at(way * step * turns[:, k]) for way in (1.0, -1.0))
        change[k] = (more - less) / (2.0 * step)
    return np.einsum("kij,k,j->i", change, speed, speed) - 0.5 * np.einsum("ijk,j,k->i", change, speed, speed)


def energy_matrix(arm: dt.Arm, kinds: str, q: Any, turns: Any, staged: tuple[int, ...] = ()) -> Any:
    """Mass matrix of shafts (motors without a spring turn with them), then of motors behind springs.

    ``kinds`` by joint: ``F`` and ``R`` a full and a reflected rotor, ``f`` and ``r`` the same behind a spring, ``-``
    none. A full rotor turns at the speed of its motor and with the link before its joint.
    """
    n, soft = arm.n, [i for i, kind in enumerate(kinds) if kind in "fr"]
    moved = np.hstack([turns, np.zeros((n, len(soft)))])  # joints by coordinates
    mass = moved.T @ dt.mass_matrix(arm, q) @ moved
    turned, angular = Rotation.identity(), np.zeros((3, n))
    for i, (kind, screw) in enumerate(zip(kinds, np.array(arm.screws), strict=True)):
        revolute = screw[:3].any()
        axis = turned.apply(screw[:3] if revolute else screw[3:])
        if kind != "-":
            row = np.zeros(n + len(soft))
            row[n + soft.index(i) if i in soft else i] = RATIOS[i]
            row += axis @ angular @ moved if kind in "Ff" else 0.0
            carried = PULLEY if i in staged else 0.0
            mass += (AXIAL[i] - carried / RATIOS[i] ** 2) * np.outer(row, row) + carried * np.outer(moved[i], moved[i])
        if revolute:
            angular[:, i] = axis
            turned = turned * Rotation.from_rotvec(screw[:3] * q[i])
    return mass


def scene_with(arm: dt.Arm, kinds: str, staged: tuple[int, ...] = (), mounted: bool = False) -> dt.Scene:
    """The rotors as effects, or of the arm, and springs."""
    effects: dict[str, tuple[Any, ...]] = {}
    for k, (name, kind) in enumerate(zip(arm.joint_names, kinds, strict=True)):
        own: list[Any] = []
        if kind != "-" and not mounted:
            own.append((dt.FullRotor if kind in "Ff" else dt.ReflectedRotor)(AXIAL[k], RATIOS[k]))
        if kind in "fr":
            own.append(dt.FlexibleJoint(gear(k, k in staged), DAMPING[k]))
        effects[name] = tuple(own)
    if mounted:
        rotors = [None if kind == "-" else dt.Rotor(RATIOS[k], AXIAL[k]) for k, kind in enumerate(kinds)]
        arm = dt.with_rotors(arm, rotors)
    return dt.Scene(arm, effects, 1.0, Q[: arm.n], QD[: arm.n])


def accelerations(done: Plan, q: Any, speed: Any) -> Any:
    """Of all coordinates at positions of joints or shafts, without wind-up, and speeds of all coordinates."""
    c, numbers = done.body.c, done.memory.numbers.copy()
    state = np.zeros(len(done.memory.states))
    state[: len(q)], state[c : 2 * c] = q, speed
    return equations.evaluate_rates(numbers, state)[c : 2 * c]


CASES = [
    ("RRRR", "FFFF", False, (), False), ("RPRR", "FRfr", False, (), False), ("RRPR", "-fF-", False, (), False),
    ("RRRR", "fFrR", False, (0, 2), False), ("PRRR", "rFf-", False, (0,), False), ("RRRR", "Ff-F", False, (1,), True),
    ("RRRR", "FFFF", True, (), False), ("RRRR", "FRfR", True, (), False), ("RRRR", "rFFR", True, (0,), False),
    ("RRRR", "fF-F", True, (), True),
]  # fmt: skip


@pytest.mark.parametrize("joints, kinds, coupled, staged, mounted", CASES)
def test_a_scene_moves_as_its_kinetic_energy_says(
    joints: str, kinds: str, coupled: bool, staged: tuple[int, ...], mounted: bool
) -> None:
    """Lagrange's equations with the energy of every body: Coriolis terms by differences of the mass matrix."""
    bare = random_arm(11, joints)
    turns = np.linalg.inv(COUPLING) if coupled else np.eye(4)
    done = plan(scene_with(with_coupling(bare, COUPLING) if coupled else bare, kinds, staged, mounted))
    soft = [i for i, kind in enumerate(kinds) if kind in "fr"]
    assert done.body.c == 4 + len(soft) and list(done.body.springs) == soft
    mass = energy_matrix(bare, kinds, Q, turns, staged)
    np.testing.assert_allclose(done.inertia, mass, atol=1e-10 * np.abs(mass).max())
    for k, kind in enumerate(kinds):
        carried = PULLEY if k in staged else 0.0
        own = 0.0 if kind == "-" else AXIAL[k] * RATIOS[k] ** 2 - carried
        assert done.body.rotors[k] == pytest.approx(own, rel=1e-9, abs=1e-12)

    speed = np.concatenate([np.linalg.inv(turns) @ QD, 1.7 + np.arange(len(soft))])
    bias = bias_of(lambda shift: energy_matrix(bare, kinds, Q + shift, turns, staged), turns, speed)
    bias[:4] += turns.T @ dt.inverse_dynamics(bare, Q, 0.0 * Q, 0.0 * Q)
    for k, i in enumerate(soft):  # dampers between motors and joints
        torque = DAMPING[i] * (speed[4 + k] - QD[i])
        bias[4 + k] += torque
        bias[:4] -= turns[i] * torque
    found = accelerations(done, np.linalg.inv(turns) @ Q, speed)
    wanted = np.linalg.solve(mass, -bias)
    np.testing.assert_allclose(found, wanted, atol=1e-6 * np.abs(wanted).max())


# --- forces on the tip


@dataclass
class Pull:
    """Record of a linear force and a moment on the tip."""

    force: Annotated[Array, 3]
    moment: Annotated[Array, 3]
    damping: Annotated[Array, 6]
    stiffness: Annotated[Array, 6]


@scene_law(Pull)
def _pull(t: Any, h: Any, own: Any, scene: Any) -> None:
    tip = scene.world.tip
    for a in range(3):
        tip.moment[a] += own.moment[a]
        tip.force[a] += own.force[a]
        for b in range(3):
            at = a + b + (1 if a > 0 and b > 0 else 0)
            tip.force[a] -= own.damping[at] * tip.speed[b] + own.stiffness[at] * tip.place[b]
    for k in range(6):
        tip.damping[k] += own.damping[k]
        tip.stiffness[k] += own.stiffness[k]


FORCE, MOMENT = np.array([3.0, -5.0, 7.0]), np.array([0.6, 0.9, -0.7])
DAMPS = np.array([[9.0, 1.0, 2.0], [1.0, 7.0, -1.5], [2.0, -1.5, 8.0]])
STIFF = np.array([[90.0, 20.0, 10.0], [20.0, 80.0, -15.0], [10.0, -15.0, 70.0]])


@dataclass(frozen=True)
class TipSpring(Effect):
    """A spring and a damper of all directions between the tip and the origin, and a constant force and moment."""

    scope = "scene"
    compute = _pull

    def ports(self, place: Place) -> Ports:
        return Ports(needs=signals.TIP_GIVEN[:6], contributes=signals.TIP_TAKEN)

    def own(self, place: Place) -> Pull:
        upper = np.triu_indices(3)
        return Pull(FORCE, MOMENT, DAMPS[upper], STIFF[upper])


def pulled(coupled: bool) -> tuple[dt.Arm, Any, dt.Scene]:
    bare = random_arm(11, "RRPR")
    turns = np.linalg.inv(COUPLING) if coupled else np.eye(4)
    scene = scene_with(with_coupling(bare, COUPLING) if coupled else bare, "RRRR")
    return bare, turns, dt.Scene(scene.body, {**scene.effects, "scene": (TipSpring(),)}, 1.0, Q, QD)


@pytest.mark.parametrize("coupled", [False, True])
def test_what_pulls_at_the_tip_moves_the_joints(coupled: bool) -> None:
    """By the Jacobian of the tip, again and again; place, speed and turning of the tip are recorded."""
    bare, turns, scene = pulled(coupled)
    done = plan(scene)
    columns = tip_jacobian(bare, Q)
    turning, speed = columns[:3] @ QD, columns[3:] @ QD
    place = tip_pose(bare, Q)[:3, 3]
    tau = columns[:3].T @ MOMENT + columns[3:].T @ (FORCE - DAMPS @ speed - STIFF @ place)
    bias = dt.inverse_dynamics(bare, Q, QD, np.zeros(4))
    mass = energy_matrix(bare, "RRRR", Q, turns)
    wanted = np.linalg.solve(mass, turns.T @ (tau - bias))
    numbers = done.memory.numbers.copy()
    state = np.concatenate([np.linalg.inv(turns) @ Q, np.linalg.inv(turns) @ QD])
    for _ in range(2):
        np.testing.assert_allclose(equations.evaluate_rates(numbers, state)[4:8], wanted, rtol=1e-8)
    for name, values in (("", place), ("speed_", speed), ("turning_", turning)):
        found = [numbers[done.memory.places[f"scene.tip_{name}{axis}"]] for axis in "xyz"]
        np.testing.assert_allclose(found, values, rtol=1e-9, err_msg=name)


def test_the_tip_of_a_linkage_is_that_of_its_first_chain() -> None:
    """A second motor has a chain of its own, up to its joint."""
    bare = two_links().arm
    arm = dt.with_rotors(with_second_motors(bare, [0]), [dt.Rotor(50.0, 1e-4, carrier=-1)] * 2 + [None])
    soft = dt.Backlash(dt.Gear("g", 50.0, stiffness_1=1e4, backlash=0.0))
    effects = {**dict.fromkeys(arm.joint_names[:2], (soft,)), "scene": (TipSpring(),)}
    done = plan(dt.Scene(arm, effects, 1.0))
    numbers, state = done.memory.numbers.copy(), np.zeros(len(done.memory.states))
    state[[done.memory.states[f"{name}.position"] for name in bare.joint_names]] = [0.3, -0.8]
    equations.evaluate_rates(numbers, state)
    found = [numbers[done.memory.places[f"scene.tip_{axis}"]] for axis in "xyz"]
    np.testing.assert_allclose(found, tip_pose(bare, np.array([0.3, -0.8]))[:3, 3], atol=1e-12)


@pytest.mark.parametrize("coupled", [False, True])
def test_a_step_with_a_spring_at_the_tip(coupled: bool) -> None:
    """The implicit midpoint rule, with the Jacobian at the guessed middle: written out."""
    bare, turns, scene = pulled(coupled)
    h, back = 2e-3, np.linalg.inv(turns)
    run = simulate(
        dt.Scene(scene.body, scene.effects, 2.0 * h, Q, QD), solver=dt.FixedStep(h), interval=h, checked=False
    )
    q, v = (np.stack([run[f"{name}.{what}"] for name in bare.joint_names], axis=1) for what in ("position", "speed"))
    state = np.concatenate([back @ Q, back @ QD])
    last = equations.evaluate_rates(plan(scene).memory.numbers.copy(), state)[4:8]
    for k in range(2):
        guess = back @ v[k] + 0.5 * h * last  # speeds of the shafts
        middle = turns @ (back @ q[k] + 0.5 * h * guess)
        columns = tip_jacobian(bare, middle)
        along = columns[3:] @ turns
        mass = energy_matrix(bare, "RRRR", middle, turns)
        bias = turns.T @ dt.inverse_dynamics(bare, middle, turns @ guess, np.zeros(4))
        place = tip_pose(bare, middle)[:3, 3] - 0.5 * h * along @ guess
        # M dv / h + bias = along^T (F - D w - K (place + h/2 w)) + moments, with w = along (v + dv / 2)
        soft = DAMPS + 0.5 * h * STIFF
        pull = turns.T @ columns[:3].T @ MOMENT + along.T @ (FORCE - STIFF @ place - soft @ along @ (back @ v[k]))
        change = np.linalg.solve(mass / h + 0.5 * along.T @ soft @ along, pull - bias)
        np.testing.assert_allclose(back @ v[k + 1], back @ v[k] + change, rtol=1e-9)
        np.testing.assert_allclose(back @ q[k + 1], back @ (q[k]) + h * (back @ v[k] + 0.5 * change), rtol=1e-9)
        last = change / h


# --- which rate depends on which state


def patterns(scene: dt.Scene) -> tuple[Any, Any, int]:
    """The pattern that is assumed, and where differences of the rates are not zero at a state at random."""
    done = plan(scene)
    numbers, moving, c = initial_memory(done), done.memory.moving, done.body.c
    x = numbers[done.memory.view(numbers, "states")["value"][:moving]] + np.random.default_rng(4).uniform(
        0.2, 0.4, moving
    )
    columns = []
    for k in range(moving):
        step = 1e-4 * np.eye(moving)[k]
        columns.append(equations.evaluate_rates(numbers, x + step) - equations.evaluate_rates(numbers, x - step))
    found = np.array(columns).T / 2e-4
    size = np.maximum(np.abs(found).max(axis=1, keepdims=True), 1e-12)
    return sparsity_pattern(done)[:moving, :moving], np.abs(found) > 1e-9 * size, c


def test_dependence_of_joints_that_do_not_feel_each_other_is_exact() -> None:
    """Masses that slide along x, y and z, each with effects of its own: a winding, a wall."""
    home, screws = np.tile(np.eye(4), (3, 1, 1)), np.hstack([np.zeros((3, 3)), np.eye(3)])
    arm = dt.Arm.from_screws(home, screws, [3.0, 2.0, 1.0], [np.eye(3) * 1e-3] * 3, gravity=(0.0, 0.0, 0.0),
                             joint_names=["a", "b", "c"])  # fmt: skip
    motor = dt.Motor("m", 0.3, 0.03, inductance=1e-3, magnet_coefficient=-1e-3)
    push = (dt.GivenCurrent([0.0], [3.0]), dt.MotorCurrent(motor))
    electric, drag = (dt.Winding(motor), dt.GivenVoltage([0.0], [3.0])), dt.ViscousFriction(dt.Friction(viscous=3.0))
    effects: dict[str, Any] = {
        "a": (dt.ReflectedRotor(1e-4, 50.0), *electric, drag),
        "b": (dt.ReflectedRotor(1e-4, 50.0), *push, drag),
        "c": (dt.ReflectedRotor(1e-4, 50.0), dt.WallSpring(5.0, 1.0)),
    }
    pattern, found, c = patterns(dt.Scene(arm, effects, 1.0))
    assert found[c:].any(axis=1).all() and not (found & ~pattern).any()
    # Its own position always, so that each state belongs to a group.
    more = pattern & ~found
    more[c : 2 * c, :c] &= ~np.eye(c, dtype=bool)
    assert not more.any(), np.argwhere(more)


def test_rates_of_temperatures_depend_on_what_warms_and_on_each_other() -> None:
    """Losses of meshes and friction go with the whole arm, currents and constants with temperatures."""
    network = ThermalNetwork(2.0, 3.0, 10.0, 200.0, 25.0)
    motor, lossy = dt.Motor("m", 0.3, 0.03), dt.Gear("g", 50.0, efficiency=0.8)
    own = (
        dt.ReflectedRotor(1e-4, 50.0), dt.MeshLoss(lossy), dt.MotorCurrent(motor, voltage=9.0),
        dt.GivenCurrent([0.0], [50.0]), dt.WindingHeat(network, gear_heat=0.5),
        dt.DryFriction(dt.Friction(coulomb=0.5)), dt.DryFriction(dt.Friction(coulomb=0.01), "motor"),
    )  # fmt: skip
    arm = random_arm(5, "RR")
    pattern, found, c = patterns(dt.Scene(arm, dict.fromkeys(arm.joint_names, own), 1.0))
    temperatures = slice(2 * c, None)
    assert not (found & ~pattern)[temperatures].any() and found[temperatures, :c].any(axis=0).all()
    assert found[c : 2 * c, temperatures].any() and pattern[c : 2 * c, temperatures][
        found[c : 2 * c, temperatures] & np.repeat(np.eye(2, dtype=bool), 2, axis=1)
    ].all()  # fmt: skip


@pytest.mark.parametrize("joints, kinds, coupled, staged, mounted", CASES)
def test_the_jacobian_is_that_of_differences(
    joints: str, kinds: str, coupled: bool, staged: tuple[int, ...], mounted: bool
) -> None:
    """Of an arm in motion; its part is analytic, so differences of the rates are another way."""
    bare = random_arm(11, joints)
    done = plan(scene_with(with_coupling(bare, COUPLING) if coupled else bare, kinds, staged, mounted))
    m, c = done.memory.moving, done.body.c
    numbers = adaptive_step._with_engine_sections(done, initial_memory(done), sparsity_pattern(done)[:m, :m])
    x = np.random.default_rng(6).uniform(-0.9, 0.9, m)
    x[4:c] *= 1e-3
    for state in (x, np.where(np.arange(m) < c, x, 0.0), 0.0 * x):  # in motion, at rest, and at zero
        columns = np.zeros((m + 1, m))
        evaluate(equations.right_side(jacobian.jacobian).address, 0.0, state, columns, np.zeros(1), parts_of(numbers))
        wanted = [
            (equations.evaluate_rates(numbers, state + one) - equations.evaluate_rates(numbers, state - one)) / 2e-6
            for one in 1e-6 * np.eye(m)
        ]
        size = np.abs(wanted).max(axis=0)
        # Rounding of the rates, over a move of 1.5e-8.
        np.testing.assert_allclose(columns[:m] / size, wanted / size, atol=1e-5)


@pytest.mark.parametrize("kinds", ["FFFF", "RfFr"])
def test_the_jacobian_with_lossy_meshes_is_that_of_differences(kinds: str) -> None:
    """In motion each takes its share of what it transmits, which the arm's motion changes; the rotors' own torque it
    does not transmit.
    """
    plain = scene_with(random_arm(11, "RRPR"), kinds)
    meshes = {name: (*effects, dt.MeshLoss(dt.Gear("g", RATIOS[k], efficiency=0.8, stiffness_1=1e4)))
              for k, (name, effects) in enumerate(plain.effects.items())}  # fmt: skip
    done = plan(dt.Scene(plain.body, meshes, 1.0, Q, QD))
    m, c = done.memory.moving, done.body.c
    numbers = adaptive_step._with_engine_sections(done, initial_memory(done), sparsity_pattern(done)[:m, :m])
    x = np.random.default_rng(8).uniform(0.3, 0.9, m) * np.where(np.arange(m) % 2, 1.0, -1.0)
    x[4:c] *= 1e-3
    engine = done.memory.view(numbers, "engine")[0]
    engine["modes_fixed"] = 0
    equations.evaluate_rates(numbers, x)
    engine["modes_fixed"] = 1
    columns = np.zeros((m + 1, m))
    evaluate(equations.right_side(jacobian.jacobian).address, 0.0, x, columns, np.zeros(1), parts_of(numbers))
    wanted = [(equations.evaluate_rates(numbers, x + one) - equations.evaluate_rates(numbers, x - one)) / 2e-6
              for one in 1e-6 * np.eye(m)]  # fmt: skip
    size = np.abs(wanted).max(axis=0)
    np.testing.assert_allclose(columns[:m] / size, wanted / size, atol=1e-5)


@pytest.mark.parametrize("kinds", ["RR", "ff"])
def test_every_acceleration_of_a_linkage_depends_on_all_its_motion(kinds: str) -> None:
    pattern, found, c = patterns(scene_with(two_links(closures=short_crank()).arm, kinds))
    assert not (found & ~pattern).any() and pattern[c : 2 * c, : 2 * c].all()


def test_every_acceleration_depends_on_the_whole_motion_of_a_tip_that_is_pulled() -> None:
    for coupled in (False, True):
        pattern, _, c = patterns(pulled(coupled)[2])
        assert pattern[c : 2 * c].all()
    assert math.isclose(np.linalg.det(COUPLING), 1.48)


# --- linkages


def linkage_matrix(arm: dt.Arm, kinds: str, q: Any, turns: Any, staged: tuple[int, ...] = ()) -> Any:
    """Mass matrix of a linkage's shafts and of motors behind springs, from torques of inverse dynamics.

    What a full rotor adds is a square of its own turns and its carrier's: rotors that turn the other way tell
    them apart.
    """
    still, soft = np.zeros(2), [i for i, kind in enumerate(kinds) if kind == "f"]

    def inertia(rotor: int = -1, way: float = 1.0) -> Any:
        rotors = [dt.Rotor(way * RATIOS[k], AXIAL[k]) if k == rotor else None for k in range(2)]
        geared = dt.with_rotors(arm, rotors)
        weight = dt.inverse_dynamics(geared, q, still, still)
        return np.array([dt.inverse_dynamics(geared, q, still, one) - weight for one in np.eye(2)]).T

    moved = np.hstack([turns, np.zeros((2, len(soft)))])
    bare = inertia()
    mass = moved.T @ bare @ moved
    for i, kind in enumerate(kinds):
        driven = np.zeros(2 + len(soft))
        driven[2 + soft.index(i) if i in soft else i] = 1.0
        carried = PULLEY if i in staged else 0.0
        share = 1.0 - carried / (AXIAL[i] * RATIOS[i] ** 2)
        mass += carried * np.outer(moved[i], moved[i])
        mass += 0.0 if kind == "-" else share * AXIAL[i] * RATIOS[i] ** 2 * np.outer(driven, driven)
        if kind in "Ff":
            there, back = inertia(i, 1.0) - bare, inertia(i, -1.0) - bare
            shaft = np.linalg.inv(turns)[i]
            with_carrier = 0.5 * (there + back) - AXIAL[i] * RATIOS[i] ** 2 * np.outer(shaft, shaft)
            mass += share * moved.T @ with_carrier @ moved
            # shaft x + x shaft, of which x is sought
            both = 0.5 * (there - back)
            across = np.linalg.lstsq(
                np.array([np.outer(shaft, one) + np.outer(one, shaft) for one in np.eye(2)]).reshape(2, 4).T,
                both.reshape(4), rcond=None,
            )[0]  # fmt: skip
            mass += share * (np.outer(driven, across @ moved) + np.outer(across @ moved, driven))
    return mass


@pytest.mark.parametrize(
    ("kinds", "coupled", "staged"),
    [
        ("-R", True, ()), ("RR", False, ()), ("fF", False, (0,)), ("ff", False, (1,)), ("F-", True, ()),
        ("FF", False, ()),
    ],
)  # fmt: skip
def test_a_linkage_moves_as_inverse_dynamics_says(kinds: str, coupled: bool, staged: tuple[int, ...]) -> None:
    """Lagrange's equations of its mass matrix: Coriolis terms by differences, weight from inverse dynamics."""
    arm = two_links(closures=short_crank(), coupling=[DIFFERENTIAL] if coupled else []).arm
    turns, q = np.linalg.inv(arm.coupling) if coupled else np.eye(2), np.array([0.3, -0.8])
    done = plan(scene_with(arm, kinds, staged))
    soft = [i for i, kind in enumerate(kinds) if kind == "f"]
    mass = linkage_matrix(arm, kinds, q, turns, staged)
    np.testing.assert_allclose(done.inertia, mass, atol=1e-9 * np.abs(mass).max())
    own = [0.0 if kind == "-" else AXIAL[k] * RATIOS[k] ** 2 - PULLEY * (k in staged) for k, kind in enumerate(kinds)]
    np.testing.assert_allclose(done.body.rotors, own, rtol=1e-9)
    speed = np.concatenate([np.linalg.inv(turns) @ QD[:2], 1.7 + np.arange(len(soft))])
    bias = bias_of(lambda shift: linkage_matrix(arm, kinds, q + shift, turns, staged), turns, speed)
    bias[:2] += turns.T @ dt.inverse_dynamics(dt.with_rotors(arm, [None, None]), q, 0.0 * q, 0.0 * q)
    for k, i in enumerate(soft):
        torque = DAMPING[i] * (speed[2 + k] - QD[i])
        bias[2 + k] += torque
        bias[i] -= torque
    found = accelerations(done, np.linalg.inv(turns) @ q, speed)
    wanted = np.linalg.solve(mass, -bias)
    np.testing.assert_allclose(found, wanted, atol=1e-5 * np.abs(wanted).max())
