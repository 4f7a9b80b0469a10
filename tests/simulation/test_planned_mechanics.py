"""Mass matrices and accelerations of planned scenes against kinetic energies written out rotor by rotor."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from crank_arm import DIFFERENTIAL, short_crank, two_links
from random_arms import random_arm
from scipy.spatial.transform import Rotation

import drivetrain as dt
from drivetrain.arm.coupling import with_coupling
from drivetrain.arm.rotors import RotorLevel
from drivetrain.drive.stages import Stage, chained, with_stages
from drivetrain.simulation.core import equations
from drivetrain.simulation.planning.plan import Plan, plan

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

    speed = np.concatenate([np.linalg.inv(turns) @ QD, 1.0 + np.arange(len(soft))])
    step, c = 1e-5, len(speed)
    change = np.zeros((c, c, c))
    for k in range(4):
        more, less = (energy_matrix(bare, kinds, Q + way * step * turns[:, k], turns, staged) for way in (1.0, -1.0))
        change[k] = (more - less) / (2.0 * step)
    bias = np.einsum("kij,k,j->i", change, speed, speed) - 0.5 * np.einsum("ijk,j,k->i", change, speed, speed)
    bias[:4] += turns.T @ dt.inverse_dynamics(bare, Q, 0.0 * Q, 0.0 * Q)
    for k, i in enumerate(soft):  # dampers between motors and joints
        torque = DAMPING[i] * (speed[4 + k] - QD[i])
        bias[4 + k] += torque
        bias[:4] -= turns[i] * torque
    found = accelerations(done, np.linalg.inv(turns) @ Q, speed)
    wanted = np.linalg.solve(mass, -bias)
    np.testing.assert_allclose(found, wanted, atol=1e-6 * np.abs(wanted).max())


@pytest.mark.parametrize("coupled", [False, True])
@pytest.mark.parametrize("kinds", ["FF", "RR", "F-", "ff", "fF", "-R"])
def test_a_linkage_has_the_mass_matrix_of_its_arm(kinds: str, coupled: bool) -> None:
    """Rotors as effects or on the arm; springs held rigid are none, and a rotor behind one has its own inertia."""
    arm = two_links(closures=short_crank(), coupling=[DIFFERENTIAL] if coupled else []).arm
    if coupled and "f" in kinds:
        return
    level = RotorLevel.REFLECTED if "R" in kinds else RotorLevel.FULL
    carriers = {"R": -1, "r": -1}  # without a motion of what carries them
    rotors = [None if kind == "-" else dt.Rotor(RATIOS[k], AXIAL[k], carrier=carriers.get(kind))
              for k, kind in enumerate(kinds)]  # fmt: skip
    geared, still = dt.with_rotors(arm, rotors, level=level), np.zeros(2)
    weight = dt.inverse_dynamics(geared, Q[:2], still, still)
    whole = np.array([dt.inverse_dynamics(geared, Q[:2], still, one) - weight for one in np.eye(2)]).T
    turns = np.linalg.inv(arm.coupling) if coupled else np.eye(2)
    done = plan(scene_with(arm, kinds))
    soft = [i for i, kind in enumerate(kinds) if kind == "f"]
    rigid = np.concatenate([np.eye(2), np.eye(2)[soft]])
    np.testing.assert_allclose(rigid.T @ done.inertia @ rigid, turns.T @ whole @ turns, rtol=1e-9, atol=1e-9)
    own = [0.0 if kind == "-" else AXIAL[k] * RATIOS[k] ** 2 for k, kind in enumerate(kinds)]
    np.testing.assert_allclose(np.diag(done.inertia)[2:], np.array(own)[soft], rtol=1e-12)
    np.testing.assert_allclose(done.body.rotors, own, rtol=1e-9)
