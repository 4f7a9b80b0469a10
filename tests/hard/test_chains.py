"""Long chains, masses and ratios far apart, links without mass: where the mass matrix loses digits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pinocchio as pin
from chains import chain, exact_accelerations
from hard_case import Figure, hard_case
from in_pinocchio import InPinocchio
from random_arms import EVERY_JOINT, error, motion, random_arm, rotors_of

from drivetrain.arm.arm import Arm
from drivetrain.arm.geared import with_rotors
from drivetrain.arm.rotors import Rotor, RotorLevel
from drivetrain.dynamics.forward import articulated_body
from drivetrain.dynamics.inverse import inverse_dynamics
from drivetrain.dynamics.mass import mass_factor, mass_matrix, solve_lower, solve_upper
from drivetrain.errors import InputError

Forward = Callable[[Arm, np.ndarray, np.ndarray, np.ndarray], np.ndarray]


def by_inverse(arm: Arm, q: np.ndarray, qd: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """The mass matrix column by column from inverse dynamics, and inverted: the textbook's way."""
    units, still = np.eye(arm.n), np.zeros((arm.n, arm.n))
    weightless = replace(arm, gravity=np.zeros(3))
    matrix = inverse_dynamics(weightless, np.tile(q, (arm.n, 1)), still, units).T
    return np.linalg.inv(matrix) @ (tau - inverse_dynamics(arm, q, qd, still[0]))


def by_factors(arm: Arm, q: np.ndarray, qd: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """By the Cholesky factors of the mass matrix."""
    factors, torque = mass_factor(arm, q[None]), tau - inverse_dynamics(arm, q, qd, np.zeros(arm.n))
    return solve_upper(factors, solve_lower(factors, torque[None, :, None]))[0, :, 0]


def by_damped_factors(arm: Arm, q: np.ndarray, qd: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """The mass matrix "conditioned" by a billionth of its largest entry on the diagonal."""
    matrix = mass_matrix(arm, q)
    matrix = matrix + 1e-9 * matrix.max() * np.eye(arm.n)
    return np.linalg.solve(matrix, tau - inverse_dynamics(arm, q, qd, np.zeros(arm.n)))


def sample(seed: int, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.uniform(-3, 3, n), rng.uniform(-1, 1, n), rng.uniform(-5, 5, n)


def errors(ways: list[Forward], arm: Arm, count: int) -> np.ndarray:
    """The error of each way at each sample, against 50 digits, (count, ways)."""
    found = []
    for seed in range(count):
        state = sample(seed, arm.n)
        wanted = exact_accelerations(arm, *state)
        found.append([error(way(arm, *state), wanted) for way in ways])
    return np.array(found)


def random_chain(n: int) -> Arm:
    rng = np.random.default_rng([n, 0])
    return chain(rng.uniform(0.3, 1.0, n), rng.uniform(0.5, 2.0, n))


@hard_case(
    "T23a",
    "A chain of 50 joints",
    setup="Random lengths and masses. The reference has 50 digits.",
    naive="inverse of the mass matrix",
)
def test_fifty() -> list[Figure]:
    ours, naive, factored = errors([articulated_body, by_inverse, by_factors], random_chain(50), 2).max(axis=0)
    assert ours < factored  # solving with the factors is better than the inverse, but not enough either
    return [Figure("relative error of the accelerations", ours, naive, at_most=1e-11)]


@hard_case(
    "T23b",
    "A chain of 200 joints",
    setup="Random lengths and masses. The reference has 50 digits.",
    naive="Cholesky factorisation of the mass matrix",
)
def test_two_hundred() -> list[Figure]:
    ours, naive = errors([articulated_body, by_factors], random_chain(200), 1)[0]
    return [Figure("relative error of the accelerations", ours, naive, at_most=1e-11)]


@hard_case(
    "T22",
    "Ratios from 1 to 100 000 in one arm",
    setup="Six joints with ratios 1, 100, 1, 1e5, 1 and 1000 and rotors of 1e-5 kg m². The reference has 50 digits.",
    naive="mass matrix with a billionth of its largest entry added to the diagonal",
)
def test_ratios_far_apart() -> list[Figure]:
    bare, ratios, inertia = chain(np.full(6, 0.5), np.full(6, 2.0)), [1.0, 1e2, 1.0, 1e5, 1.0, 1e3], 1e-5
    geared = with_rotors(bare, [Rotor(ratio, inertia) for ratio in ratios], level=RotorLevel.REFLECTED)
    # A rotor turns with the link before it, too.
    carried = np.array([np.diag([0.0, 0.0, 0.0 if i == 5 else inertia]) for i in range(6)])
    riding, armature = replace(bare, inertias=bare.inertias + carried), inertia * np.square(ratios)
    found = []
    for seed in range(10):
        state = sample(seed, 6)
        wanted = exact_accelerations(riding, *state, armature)
        # Joint by joint: beside the fast ones, an error of the joint behind 1e5 would not be seen.
        ways = [way(geared, *state) / wanted - 1.0 for way in (articulated_body, by_factors, by_damped_factors)]
        found.append([np.abs(way).max() for way in ways])
    ours, factored, naive = np.max(found, axis=0)
    return [
        Figure("largest relative error of a joint acceleration", ours, naive, at_most=1e-12),
        Figure("the same by factorisation", factored, at_most=1e-12),
    ]


@hard_case(
    "T24",
    "Masses that differ by a factor of a million along the arm",
    setup=(
        "Six links of 1, 10, 100, 1e3, 1e4 and 1e6 kg, the reverse order, and five links of 1 kg before one of "
        "1e6 kg. The reference has 50 digits."
    ),
    naive="inverse of the mass matrix",
)
def test_heavy_end() -> list[Figure]:
    ramp, jump = np.array([1.0, 10.0, 100.0, 1e3, 1e4, 1e6]), np.array([1.0, 1.0, 1.0, 1.0, 1.0, 1e6])
    ways: list[Forward] = [articulated_body, by_inverse]
    distal, proximal, sudden = (errors(ways, chain(np.full(6, 0.5), m), 15) for m in (ramp, ramp[::-1], jump))
    return [
        Figure("relative error with the heavy end", *distal.max(axis=0), at_most=1e-10),
        Figure("relative error with the heavy base", *proximal.max(axis=0), at_most=1e-10),
        # Its worst sample loses as much as pinocchio's does, 1e-10 of what the lightest links do: see the next test.
        Figure("median relative error with the heavy last link", *np.median(sudden, axis=0), at_most=1e-10),
    ]


def test_a_sudden_heavy_end_is_as_good_as_pinocchio() -> None:
    arm = chain(np.full(6, 0.5), np.array([1.0, 1.0, 1.0, 1.0, 1.0, 1e6]))
    twin = InPinocchio(arm)
    found = errors([articulated_body, lambda _, *state: pin.aba(twin.model, twin.data, *state)], arm, 15)
    ours, theirs = np.median(found, axis=0)
    assert ours < 2.0 * theirs
    assert found[:, 0].max() < 1e-9


@hard_case(
    "T25",
    "Links without mass",
    setup=(
        "The last two of six links have no mass, which must be refused; with a rotor inertia of 1e-4 kg m² "
        "reflected at each joint the arm has a solution. The reference has 50 digits."
    ),
    naive="pinocchio's articulated-body algorithm",
)
def test_massless_links() -> list[Figure]:
    whole = chain(np.full(6, 0.5), np.full(6, 2.0))
    masses, inertias = whole.masses.copy(), whole.inertias.copy()
    masses[4:], inertias[4:] = 0.0, 0.0
    arm = replace(whole, masses=masses, inertias=inertias)
    state = sample(0, 6)
    twin = InPinocchio(arm)
    theirs = pin.aba(twin.model, twin.data, *state)
    told = 0
    for way in (articulated_body, by_factors):
        try:
            way(arm, *state)
        except InputError as fault:
            told += "joint_6" in str(fault) or "joint_5" in str(fault)
    armature = np.full(6, 1e-4)
    healed = with_rotors(arm, [Rotor(100.0, 1e-8, carrier=-1)] * 6, level=RotorLevel.REFLECTED)
    wanted = exact_accelerations(arm, *state, armature)
    return [
        Figure(
            "algorithms whose message names the joint, of 2",
            ours=float(told),
            naive=2.0 * float(np.isfinite(theirs).all()),
            at_least=2.0,
            naive_says="silently " + " ".join(f"{value:.3g}" for value in theirs),
        ),
        Figure(
            "relative error with the reflected inertia", error(articulated_body(healed, *state), wanted), at_most=1e-12
        ),
        Figure("the same by factorisation", error(by_factors(healed, *state), wanted), at_most=1e-12),
    ]


def arm_of_many(seed: int) -> Arm:
    """Three of four with up to six joints and rotors of every kind on every link, one a chain of up to 40 joints."""
    if seed % 4 == 3:
        rng = np.random.default_rng([seed, 7])
        n = 1 + seed % 40
        return chain(rng.uniform(0.3, 1.0, n), rng.uniform(0.5, 2.0, n))
    bare = random_arm(seed, EVERY_JOINT[: 1 + seed % 6])
    return with_rotors(bare, rotors_of(seed, ("coaxial", "balanced", "unbalanced")[seed % 4], bare.n))


@hard_case(
    "T27",
    "From accelerations to torques and back",
    setup=(
        "1000 random arms with revolute, prismatic and helical joints, rotors carried by any link, and chains "
        "of up to 40 joints."
    ),
    naive="inverse of the mass matrix",
)
def test_round_trip() -> list[Figure]:
    found = []
    for seed in range(1000):
        arm = arm_of_many(seed)
        q, qd, qdd = (values[0] for values in motion(seed, arm.n, 1))
        tau = inverse_dynamics(arm, q, qd, qdd)
        found.append([error(way(arm, q, qd, tau), qdd) for way in (articulated_body, by_inverse)])
    ours, naive = np.max(found, axis=0)
    return [Figure("relative error of the accelerations", ours, naive, at_most=1e-9)]
