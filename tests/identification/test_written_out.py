"""Identification part by part on small recordings, each against another way to the same numbers."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

import drivetrain as dt
from drivetrain.arm.coupling import rotor_turns
from drivetrain.drive.friction import friction_curve
from drivetrain.drive.gear import complete, mesh_of
from drivetrain.dynamics.inverse import inverse_dynamics
from drivetrain.dynamics.regressor import torque_parameters, torque_regressor
from drivetrain.identification import exciting, fit
from drivetrain.identification.least_squares import (
    GRID,
    base_parameters,
    consistent,
    correlated_covariance,
    nearest_consistent,
    problem_of,
    pseudo_inertias,
    ten_parameters,
)
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.records import as_record
from drivetrain.sizing.demand.demand import workload
from drivetrain.sizing.judge.operation import Operation
from drivetrain.study.model import DriveMass, Stop

EXAMPLES = Path(__file__).parents[2] / "examples"


# --- bodies


def of_points(masses: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ten parameters and pseudo-inertia of points, both by their definitions."""
    tensor = sum(m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip(masses, points, strict=True))
    ten = [
        masses.sum(),
        *(masses @ points),
        *(tensor[i, j] for i, j in ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))),
    ]
    ones = np.column_stack([points, np.ones(len(points))])
    return np.array(ten), ones.T @ (masses[:, None] * ones)


def test_pseudo_inertias_of_points() -> None:
    rng = np.random.default_rng(0)
    found = [of_points(rng.uniform(0.5, 2.0, 5), rng.normal(size=(5, 3))) for _ in range(3)]
    ten, pseudo = np.concatenate([one for one, _ in found]), np.array([one for _, one in found])
    np.testing.assert_allclose(pseudo_inertias(ten), pseudo, atol=1e-13)
    np.testing.assert_allclose(ten_parameters(pseudo), ten, atol=1e-13)


def test_consistency_to_a_billionth() -> None:
    point, _ = of_points(np.array([2.0]), np.array([[0.3, -0.2, 0.5]]))
    body, pseudo = of_points(np.ones(9), np.random.default_rng(1).normal(size=(9, 3)))
    assert consistent(point) and consistent(np.zeros(10)) and consistent(np.r_[body, point])
    values, vectors = np.linalg.eigh(pseudo)
    for share, possible in ((-0.9e-9, True), (-1.1e-9, False), (1e-9, True)):
        values[0] = share * values[-1]
        ten = ten_parameters((vectors * values @ vectors.T)[None])
        assert consistent(ten) == consistent(np.r_[body, ten]) == consistent(np.r_[ten, body]) == possible
    # Next to nothing: not less than a billionth of a billionth.
    assert consistent(ten_parameters(np.diag([1e-30, -0.9e-18, 0.0, 0.0])[None]))
    assert not consistent(ten_parameters(np.diag([1e-30, -1.1e-18, 0.0, 0.0])[None]))


def test_the_nearest_body_in_the_norm_of_its_pseudo_inertia_has_its_positive_eigenvalues() -> None:
    """There the nearest positive matrix is known: Higham, Linear Algebra and its Applications 103 (1988) 103."""
    rng = np.random.default_rng(2)
    to_pseudo = np.array([pseudo_inertias(row).ravel() for row in np.eye(10)]).T
    metric = np.zeros((22, 22))
    metric[:10, :10] = metric[10:20, 10:20] = to_pseudo.T @ to_pseudo
    metric[20:, 20:] = np.diag([3.0, 0.5])
    wanted, found = [], []
    for _ in range(2):
        matrix = rng.normal(size=(4, 4))
        matrix = matrix + matrix.T
        values, vectors = np.linalg.eigh(matrix)
        found.append(ten_parameters(matrix[None]))
        wanted.append(ten_parameters((vectors * np.maximum(values, 0.0) @ vectors.T)[None]))
    start, _ = of_points(np.ones(5), rng.normal(size=(5, 3)))
    given, best = np.r_[*found, -0.7, 0.4], np.r_[*wanted, 0.0, 0.4]
    answer = nearest_consistent(given, metric, 2, np.r_[start, start, 0.3, 0.3])
    assert consistent(answer[:20]) and (answer[20:] >= 0.0).all()
    far, least = ((one - given) @ metric @ (one - given) for one in (answer, best))
    assert least * (1.0 - 1e-9) < far < least * (1.0 + 1e-3)  # slow where eigenvalues vanish
    np.testing.assert_allclose(answer, best, atol=0.05)
    kept = np.r_[start, start, 0.0, 0.4]  # consistent already
    assert nearest_consistent(kept, metric, 2, np.r_[start, start, 0.3, 0.3]) is kept


# --- least squares


def small_problem() -> tuple[Any, np.ndarray, np.ndarray]:
    """Two joints, five parameters, the last of which does nothing, the two before are friction."""
    rng = np.random.default_rng(3)
    rows = rng.normal(size=(83, 2, 5)) * [1.0, 5.0, 0.2, 2.0, 1e-10]
    wanted = rows @ [0.3, -0.1, 2.0, 0.5, 0.0] + 0.4 * rng.normal(size=(83, 2))
    return problem_of(rows, wanted, np.array([False, False, True, True, False]), 4, 3), rows, wanted


def least(rows: np.ndarray, wanted: np.ndarray, scale: np.ndarray, held: np.ndarray) -> np.ndarray:
    """Ridge regression by rows added for what is held, of scaled parameters."""
    flat = np.vstack([rows.reshape(-1, 5) / scale, np.diag(np.sqrt(held))])
    return np.linalg.lstsq(flat, np.r_[wanted.ravel(), np.zeros(5)], rcond=None)[0]


def test_folds_and_their_normal_equations() -> None:
    problem, rows, wanted = small_problem()
    ends = [0, 20, 41, 62, 83]
    parts = [slice(a + 3, b - 3) for a, b in itertools.pairwise(ends)]
    size = np.sqrt((rows**2).sum(axis=1).mean(axis=0))
    size[4] = np.inf
    np.testing.assert_allclose(problem.scale, [*size[:4], 1.0])
    for fold, part in zip(problem.folds, parts, strict=True):
        np.testing.assert_allclose(fold.rows, rows[part] / size)
        np.testing.assert_array_equal(fold.wanted, wanted[part])

    def held(weights, kept):
        bodies, friction = weights
        return np.array([bodies, bodies, friction, friction, bodies]) * sum(len(fold.rows) for fold in kept)

    def found(kept, weights):
        some = [problem.folds[k] for k in kept]
        return least(np.concatenate([f.rows for f in some]), np.concatenate([f.wanted for f in some]),
                     np.ones(5), held(weights, some))  # fmt: skip

    for kept, weights in (([0, 1, 2, 3], GRID[5]), ([1, 3], GRID[30])):
        np.testing.assert_allclose(problem.deviation(kept, weights), found(kept, weights), rtol=1e-9, atol=1e-12)

    # The strongest prior that misses what is held out by no more than the best and one standard error.
    def chosen(kept):
        missed = []
        for weights in GRID:
            left = [(problem.folds[k], found([j for j in kept if j != k], weights)) for k in kept]
            missed.append([((fold.wanted - fold.rows @ one) ** 2).sum() for fold, one in left])
        missed = np.array(missed)
        best = missed[missed.sum(axis=1).argmin()]
        more = missed - best
        error = np.sqrt(len(kept)) * more.std(axis=1, ddof=1)
        return max(weights for weights, row, one in zip(GRID, more, error, strict=True) if row.sum() <= one)

    assert problem.best_weights([0, 1, 2, 3]) == chosen([0, 1, 2, 3])
    far = np.full(5, 1e3)  # from the limit of parameters that must not be negative
    for k, left in enumerate(problem.held_out(far, 0)):
        others = [j for j in range(4) if j != k]
        fold = problem.folds[k]
        np.testing.assert_allclose(left, fold.wanted - fold.rows @ found(others, chosen(others)), rtol=1e-8, atol=1e-9)
    # Of the second parameter, -0.1, nothing is left if it must not be negative: the errors are those of such a model.
    limited = problem.held_out(np.zeros(5), 0)
    assert sum((left**2).sum() for left in limited) > 1.1 * sum((left**2).sum() for left in problem.held_out(far, 0))
    change = problem.consistent_change([0, 1, 2, 3], GRID[5], np.zeros(5), 0)
    assert change[1] == pytest.approx(0.0, abs=1e-6) and (change >= 0.0).all()
    assert len({chosen([j for j in range(4) if j != k]) for k in range(4)} | {chosen([0, 1, 2, 3])}) > 1


def test_combinations_that_rows_tell_apart() -> None:
    rng = np.random.default_rng(4)
    free = rng.normal(size=(40, 3)) * [1.0, 30.0, 0.2]
    mixed = free @ [[2.0, 0.0], [-0.002, 0.0], [0.0, 4.0]]
    rows = np.column_stack([free, mixed, np.zeros(40), 1e-10 * rng.normal(size=40)])
    base = base_parameters(rows)
    assert len(base.leading) == 3 == base.combined.shape[0] and base.combined.shape[1] == 7
    parameters = rng.normal(size=7)
    np.testing.assert_allclose(
        rows[:, base.leading] @ (base.combined @ parameters), rows[:, :6] @ parameters[:6], atol=1e-8
    )
    np.testing.assert_allclose(base.combined[:, base.leading], np.eye(3), atol=1e-12)
    assert (base.combined[:, 5:] == 0.0).all()
    assert sorted((base.combined != 0.0).sum(axis=1)) == [2, 2, 3] or (base.combined != 0.0).sum() >= 6
    small = np.column_stack([free[:, 0], free[:, 1], free[:, 0] + 1e-8 * free[:, 2]])
    assert len(base_parameters(small).leading) == 2  # apart by less than the tolerance
    apart = np.column_stack([free[:, 0], free[:, 1], free[:, 0] + 1e-6 * free[:, 2]])
    assert len(base_parameters(apart).leading) == 3


# --- what is known of the fit


def test_covariance_of_autoregressive_errors() -> None:
    """The scatter of least squares over many draws of errors whose correlation is known, and that of the joints."""
    rng, length, draws = np.random.default_rng(5), 400, 300
    time = np.linspace(0.0, 10.0, length)
    regressor = np.stack([np.sin(k * time[:, None] + [0.0, 1.0]) for k in (1.0, 2.0, 5.0)], axis=2)
    used = np.ones((length, 2), bool)
    used[150:200, 0] = False
    regressor *= used[:, :, None]
    flat = regressor.reshape(-1, 3)
    for first, second in ((0.0, 0.0), (0.9, 0.0), (1.5, -0.6)):
        noise = rng.normal(size=(draws, length + 100, 1)) + 0.5 * rng.normal(size=(draws, length + 100, 2))
        errors = lfilter([1.0], [1.0, -first, -second], noise, axis=1)[:, 100:] * used
        found = np.linalg.lstsq(flat, errors.reshape(draws, -1).T)[0].T
        stated = [
            correlated_covariance(regressor, one - regressor @ answer, used)
            for one, answer in zip(errors[:60], found[:60], strict=True)
        ]
        size = np.sqrt(np.diag(np.mean(stated, axis=0)))
        assert size == pytest.approx(found.std(axis=0), rel=0.2)  # of 300 draws: 4 % of it, and bias of few samples
    assert correlated_covariance(regressor, np.zeros((length, 2)), used) == pytest.approx(np.zeros((3, 3)))


def test_friction_with_what_was_found() -> None:
    laws = (
        dt.Friction(1.0, 2.0, 0.1, 0.2, static=2.4, load_share=0.1), dt.Friction(0.5, viscous=0.3, load_share=0.9),
        dt.Friction(2.0, static=2.5),
    )  # fmt: skip
    change = np.array([0.05, -0.4, 0.2, 0.7, -0.1, -3.0, 0.2, 0.3, -0.5])  # viscous, Coulomb, share
    found = fit._with_friction(laws, change)
    assert found == (
        dt.Friction(1.7, 2.7, 0.15000000000000002, 0.25, static=2.7, load_share=0.30000000000000004),
        dt.Friction(0.4, viscous=0.0, load_share=0.999), dt.Friction(0.0, viscous=0.2, static=2.5, load_share=0.0),
    )  # fmt: skip
    two = fit._with_friction(laws, change[:6])
    assert [law.load_share for law in two] == [0.1, 0.9, 0.0] and two[0].coulomb == pytest.approx(1.7)


# --- whole identifications


TRUE = np.array([[3.0, 0.4], [1.5, 0.7]])  # viscous and Coulomb friction


def small_arm() -> dt.Arm:
    """Two joints that turn, about axes across each other, with rotors that are bodies of their own."""
    home = np.tile(np.eye(4), (2, 1, 1))
    home[:, :3, 3] = [0.2, 0.05, 0.1], [0.55, 0.1, 0.15]
    c, s = np.cos(0.4), np.sin(0.4)
    home[1, :3, :3] = [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]
    tensors = [np.array([[0.05, 0.01, 0.0], [0.01, 0.08, 0.005], [0.0, 0.005, 0.06]]), np.diag([0.03, 0.05, 0.04])]
    arm = dt.Arm.from_screws(
        home, [[0.0, 0.0, 1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, -0.2, 0.0, 0.4]], [3.0, 2.0], tensors, tip=np.eye(4),
        gravity=(1.3, -8.0, 4.0), joint_names=["a", "b"], joint_points=[[0.0, 0.0, 0.0], [0.4, 0.0, 0.2]],
    )  # fmt: skip
    return dt.with_rotors(arm, [dt.Rotor(60.0, 4e-5, 0.2), dt.Rotor(-50.0, 5e-5, 0.1)])


def record(arm: dt.Arm, noise: float = 0.02, samples: int = 200) -> dt.MeasuredMotion:
    rng = np.random.default_rng(7)
    time = np.arange(samples) / 50.0
    omega = 2.0 * np.pi / 4.0 * np.arange(1, 5)
    phase, size = rng.uniform(0.0, 6.0, (4, 2)), rng.normal(size=(4, 2)) / omega[:, None]
    angle = time[:, None, None] * omega[:, None] + phase
    q = (size * np.sin(angle)).sum(axis=1)
    qd = (size * omega[:, None] * np.cos(angle)).sum(axis=1)
    qdd = -(size * omega[:, None] ** 2 * np.sin(angle)).sum(axis=1)
    slow = 0.01 * np.abs(qd).max(axis=0)
    torque = inverse_dynamics(arm, q, qd, qdd) + TRUE[0] * qd + TRUE[1] * np.tanh(qd / slow)
    torque = torque + noise * rng.normal(size=torque.shape)
    return dt.MeasuredMotion("small", arm.joint_names, time, q, qd, qdd, torque=torque)


def guess_of(arm: dt.Arm) -> dt.Arm:
    light = replace(arm, masses=arm.masses * [0.8, 1.25], inertias=arm.inertias * np.array([0.8, 1.25])[:, None, None])
    return dt.with_rotors(light, [dt.Rotor(60.0, 3e-5, 0.2), dt.Rotor(-50.0, 6e-5, 0.1)])


@pytest.fixture(scope="module")
def identified() -> tuple[dt.Identification, dt.MeasuredMotion, dt.Arm]:
    arm = small_arm()
    measured, guess = record(arm), guess_of(arm)
    return dt.identify(guess, measured), measured, guess


def regressor_of(measured: dt.MeasuredMotion, guess: dt.Arm) -> tuple[np.ndarray, np.ndarray]:
    """Columns of links, of the rotors' inertia about their axes, of friction; what the guess leaves over."""
    motion = measured.position, measured.velocity, measured.acceleration
    matrix, qd = torque_regressor(guess, *motion), measured.velocity
    slow = 0.01 * np.abs(qd).max(axis=0)
    rubs = [qd[:, :, None] * np.eye(2), np.tanh(qd / slow)[:, :, None] * np.eye(2)]
    left = measured.torque - inverse_dynamics(guess, *motion)
    return np.concatenate([matrix[:, :, [*range(20), 29, 39]], *rubs], axis=2), left


def rms(values: np.ndarray) -> np.ndarray:
    return np.sqrt(np.mean(np.asarray(values) ** 2, axis=0))


def test_what_is_found_explains_the_recording(identified: Any) -> None:
    found, measured, guess = identified
    matrix, left = regressor_of(measured, guess)
    motion = measured.position, measured.velocity, measured.acceleration
    numbers = found.parameters["identified"].to_numpy()
    assert len(numbers) == 26 and list(found.parameters.index[20:]) == [
        "rotor a.Izz [kg m^2]", "rotor b.Izz [kg m^2]", "a.viscous [N m s/rad]", "b.viscous [N m s/rad]",
        "a.coulomb [N m]", "b.coulomb [N m]",
    ]  # fmt: skip
    prior = np.r_[torque_parameters(guess)[[*range(20), 29, 39]], np.zeros(4)]
    np.testing.assert_allclose(found.parameters["prior"], prior, atol=1e-15)
    np.testing.assert_allclose(torque_parameters(found.arm)[[*range(20), 29, 39]], numbers[:22], atol=1e-12)
    np.testing.assert_allclose(torque_parameters(found.arm)[20:29], torque_parameters(guess)[20:29], atol=1e-15)
    assert [law.viscous for law in found.friction] == pytest.approx(numbers[22:24])
    assert [law.coulomb for law in found.friction] == pytest.approx(numbers[24:])
    assert numbers[22:24] == pytest.approx(TRUE[0], rel=0.05) and numbers[24:] == pytest.approx(TRUE[1], rel=0.1)
    modelled = inverse_dynamics(guess, *motion) + matrix @ (numbers - prior)
    np.testing.assert_allclose(found.modelled, modelled, atol=1e-10)
    assert (rms(found.measured - found.modelled) < 0.025).all() and (rms(left) > 0.3).all()
    parts = {"links": slice(0, 20), "rotors": slice(20, 22), "viscous": slice(22, 24), "coulomb": slice(24, 26)}
    for name, part in parts.items():
        np.testing.assert_allclose(found.contributions[name], rms(matrix[:, :, part] @ numbers[part]), rtol=1e-9)
    fixed = inverse_dynamics(guess, *motion) - matrix[:, :, :22] @ prior[:22]
    np.testing.assert_allclose(found.contributions["drives"], rms(fixed), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found.contributions["unexplained"], rms(measured.torque - modelled), rtol=1e-9)
    assert found.study is None and found.torque_constant is None


def test_tables_of_uncertainty_and_errors(identified: Any) -> None:
    found, measured, guess = identified
    matrix, left = regressor_of(measured, guess)
    moving = np.abs(measured.velocity) > 0.03 * np.abs(measured.velocity).max(axis=0)  # friction near rest is not known
    assert 0.9 < moving.mean() < 1.0

    def some(values: np.ndarray) -> np.ndarray:
        return np.sqrt((values**2).sum(axis=0) / moving[used].sum(axis=0))

    used = np.arange(200)
    spread = some(left * moving)
    rows, wanted = matrix / spread[:, None] * moving[:, :, None], left / spread * moving
    size = np.sqrt((rows**2).sum(axis=1).mean(axis=0))
    size[size < 1e-10 * size.max()] = np.inf
    ends = np.linspace(0, 200, 11).astype(int)
    parts = [np.arange(a + 2, b - 2) for a, b in itertools.pairwise(ends)]  # 0.04 s at 50 Hz
    problem = problem_of(rows, wanted, np.arange(26) >= 22, 10, 2)
    bodies, friction = problem.best_weights(list(range(10)))
    assert any(f"prior {bodies:g} for bodies and {friction:g} for friction" in note for note in found.notes)
    used = np.concatenate(parts)
    flat = rows[used].reshape(-1, 26) / size
    held = np.where(np.arange(26) >= 22, friction, bodies) * len(used)
    normal = flat.T @ flat + np.diag(held)
    change = np.linalg.solve(normal, flat.T @ wanted[used].ravel())
    numbers, prior = found.parameters["identified"].to_numpy(), found.parameters["prior"].to_numpy()
    finite = np.where(np.isfinite(size), size, 1.0)
    np.testing.assert_allclose(numbers, prior + change / finite, rtol=1e-6, atol=1e-9)  # consistent at once
    # Of parameters that act alike, rounding decides which one stands for the others.
    leading = [list(found.parameters.index).index(name) for name in found.base.index]
    columns = rows.reshape(-1, 26)
    assert len(leading) == np.linalg.matrix_rank(columns / finite, tol=1e-9 * np.linalg.norm(columns / finite))
    combined = np.linalg.lstsq(columns[:, leading], columns, rcond=None)[0]
    chosen = rows[:, :, leading]
    plain = np.linalg.lstsq(chosen.reshape(-1, len(leading)), wanted.ravel())[0]
    norm = np.sqrt((chosen**2).sum(axis=(0, 1)))
    covariance = correlated_covariance(chosen / norm, wanted - chosen @ plain, moving) / np.outer(norm, norm)
    np.testing.assert_allclose(found.base["value"], combined @ numbers, rtol=1e-9, atol=1e-12)
    deviation = np.hypot(np.sqrt(np.diag(covariance)), combined @ (numbers - prior) - plain)
    np.testing.assert_allclose(found.base["deviation"], deviation, rtol=1e-6)
    singular = np.linalg.svd((chosen / norm).reshape(400, -1), compute_uv=False)
    assert found.condition == pytest.approx(singular[0] / singular[-1], rel=1e-9)
    # Information of the data and of the prior, of scaled parameters, added up.
    scaled = combined / finite
    after = np.diag(np.linalg.inv(scaled.T @ np.linalg.inv(covariance) @ scaled + np.diag(held)))
    np.testing.assert_allclose(found.parameters["share"], np.sqrt(after * held), rtol=1e-5)
    # Finite for parameters that act like no others.
    unlike = [
        np.linalg.matrix_rank(columns[:, [j for j in range(26) if j != k]] / np.delete(finite, k)) for k in leading
    ]
    alone = [name for name, rank in zip(found.base.index, unlike, strict=True) if rank < len(leading)]
    assert 4 < len(alone) < len(leading) and "a.coulomb [N m]" in alone
    told = found.parameters["deviation"]
    assert set(told.index[np.isfinite(told)]) == set(alone)
    np.testing.assert_allclose(told[alone], found.base.loc[alone, "deviation"])
    # Errors on what was held out.
    missed = np.concatenate(problem.held_out(prior, 2)) * spread
    errors = found.errors
    np.testing.assert_allclose(errors["measured"], some((measured.torque * moving)[used]), rtol=1e-9)
    np.testing.assert_allclose(errors["given"], some((left * moving)[used]), rtol=1e-9)
    np.testing.assert_allclose(errors["identified"], some(missed), rtol=1e-6)
    model = measured.torque[used] - missed
    wanted = [np.corrcoef(measured.torque[used][m, i], model[m, i])[0, 1] for i, m in enumerate(moving[used].T)]
    np.testing.assert_allclose(errors["correlation"], wanted, rtol=1e-9)
    assert repr(found) == f"Identification({len(leading)} base parameters, better on 2 of 2 joints)"
    assert "N m" in found._repr_html_()


@pytest.fixture(scope="module")
def short() -> tuple[dt.MeasuredMotion, dt.Arm]:
    """As few samples as may be: ten parts, each of which loses 0.04 s at both ends and keeps ten samples."""
    arm = small_arm()
    return record(arm, samples=140), guess_of(arm)


def test_torques_from_outside_are_not_identified(short: Any) -> None:
    measured, guess = short
    outside = np.random.default_rng(8).normal(size=measured.torque.shape)
    whole = dt.identify(guess, measured)
    again = dt.identify(guess, replace(measured, torque=measured.torque + outside), known_torque=outside)
    np.testing.assert_allclose(again.parameters["identified"], whole.parameters["identified"], rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(again.modelled, whole.modelled + outside, atol=1e-8)
    np.testing.assert_allclose(again.contributions["unexplained"], whole.contributions["unexplained"], rtol=1e-6)


def test_both_directions_of_friction_change_by_the_same(short: Any) -> None:
    """As the fit assumes: the weaker direction is not cut off at zero afterwards."""
    measured, guess = short
    given = [dt.Friction(60.0, 0.1, viscous=1.0), dt.Friction(0.1, 60.0, viscous=1.0)]
    found = dt.identify(guess, measured, friction=given)
    change = (found.parameters["identified"] - found.parameters["prior"]).to_numpy()[-2:]
    assert change.min() >= -0.1 - 1e-6
    for law, before, more in zip(found.friction, given, change, strict=True):
        assert law.coulomb - before.coulomb == pytest.approx(more, abs=1e-6)
        assert law.coulomb_negative - before.coulomb_negative == pytest.approx(more, abs=1e-6)


def test_one_link_alone_and_a_joint_without_motion_of_its_torque(short: Any) -> None:
    measured, guess = short
    still = replace(measured, torque=measured.torque * [1.0, 0.0] + [0.0, 3.0])
    last = dt.identify(guess, still, links=[guess.link_names[1]])
    assert [name.split(".")[0] for name in last.parameters.index[:10]] == [guess.link_names[1]] * 10
    assert len(last.parameters) == 14 and (last.arm.masses[0], last.arm.rotors) == (guess.masses[0], guess.rotors)
    np.testing.assert_allclose(torque_parameters(last.arm)[10:20], last.parameters["identified"][:10], atol=1e-12)
    assert np.isnan(last.errors["correlation"].iloc[1]) and last.errors["measured"].iloc[1] == pytest.approx(3.0)
    few = [getattr(measured, name)[:139] for name in ("time", "position", "velocity", "acceleration", "torque")]
    with pytest.raises(dt.InputError, match="at least 140 samples"):
        dt.identify(guess, dt.MeasuredMotion("few", guess.joint_names, *few[:4], torque=few[4]))
    with pytest.raises(dt.InputError, match="is no link of the arm"):
        dt.identify(guess, measured, links=["nothing"])


def test_rotors_stay_where_links_are_named(short: Any) -> None:
    measured, guess = short
    prior, motion = fit._prior(guess, None), [measured.position, measured.velocity, measured.acceleration]
    columns = fit._columns(
        prior, torque_regressor(prior.arm, *motion), fit._model(prior, motion), guess.link_names, False
    )
    assert columns.laws == 20
    changed = fit._with_bodies(prior, columns, columns.prior * np.r_[np.full(20, 1.5), np.ones(4)])
    assert changed.rotors == guess.rotors
    np.testing.assert_allclose(changed.masses, 1.5 * guess.masses)


def test_what_each_cause_contributes() -> None:
    """Of a single sample whose causes are all different: their magnitudes."""
    arm, rng = small_arm(), np.random.default_rng(12)
    matrix, prior, found = rng.normal(size=(1, 2, 16)), rng.normal(size=16), rng.normal(size=16)
    columns = fit._Columns(matrix, prior, ["x"] * 16, (1,), 12, np.zeros(16))
    balance, drives, known, left = rng.normal(size=(4, 1, 2))
    model = fit._Model(matrix @ prior + balance + drives, balance, np.ones((1, 2)), np.zeros((3, 1, 2)))
    measured = matrix @ found + balance + drives + known + left
    table = fit._contributions(columns, found, measured, model, known, arm)
    wanted = {
        "links": matrix[:, :, :10] @ found[:10], "rotors": matrix[:, :, 10:12] @ found[10:12],
        "viscous": matrix[:, :, 12:14] @ found[12:14], "coulomb": matrix[:, :, 14:] @ found[14:],
        "counterbalances": balance, "drives": drives, "unexplained": left,
    }  # fmt: skip
    assert list(table.columns) == list(wanted)
    for name, torque in wanted.items():
        np.testing.assert_allclose(table[name], np.abs(torque[0]), rtol=1e-9, err_msg=name)


def test_motor_torques_and_currents_are_turned_by_the_ratios(short: Any) -> None:
    measured, guess = short
    prior, constants, ratios = fit._prior(guess, None), np.array([0.07, 0.11]), np.array([60.0, -50.0])
    by_motor = replace(measured, torque=None, motor_torque=measured.torque / ratios)
    np.testing.assert_allclose(fit._joint_torque(by_motor, prior, None), measured.torque, rtol=1e-12)
    current = measured.torque / ratios / constants
    by_current = replace(measured, torque=None, current=current)
    np.testing.assert_allclose(fit._joint_torque(by_current, prior, constants), measured.torque, rtol=1e-12)
    assert fit._torque_constants(by_current, prior) is None and fit._torque_constants(measured, prior) is None
    np.testing.assert_allclose(fit._torque_constants(replace(by_motor, current=current), prior), constants)
    noisy = current + 0.1
    fitted = (measured.torque / ratios * noisy).sum(axis=0) / (noisy**2).sum(axis=0)
    np.testing.assert_allclose(fit._torque_constants(replace(measured, current=noisy), prior), fitted, rtol=1e-9)
    none = fit._torque_constants(replace(measured, current=noisy * [1.0, 0.0]), prior)
    assert np.isnan(none[1]) and none[0] == pytest.approx(fitted[0])


def test_friction_that_is_known_is_the_prior_and_load_friction_is_a_share() -> None:
    """Deviations from given laws; a share of the load beside, behind joints whose losses depend on it."""
    arm = small_arm()
    measured = record(arm, noise=1e-3, samples=140)
    q, qd, qdd = measured.position, measured.velocity, measured.acceleration
    given = [dt.Friction(0.5, viscous=2.0, load_share=0.05), dt.Friction(0.9, viscous=1.0)]
    slow = 0.01 * np.abs(qd).max(axis=0)
    way, load = np.tanh(qd / slow), inverse_dynamics(dt.with_rotors(arm, [None, None]), q, qd, qdd)
    rotors = inverse_dynamics(arm, q, qd, qdd) - load
    rubs = TRUE[0] * qd + TRUE[1] * way
    shares = np.array([0.12, 0.07])
    torque = load + rubs + shares * np.abs(load + rubs) * way + rotors
    lossy = replace(measured, torque=torque)
    found = dt.identify(arm, lossy, friction=given, load_friction=True)
    names = [name for name in found.parameters.index if "load_share" in name]
    assert names == ["a.load_share [-]", "b.load_share [-]"]
    prior = found.parameters["prior"].to_numpy()[-6:]
    assert prior.tolist() == [2.0, 1.0, 0.5, 0.9, 0.05, 0.0]
    assert [float(law.load_share) for law in found.friction] == pytest.approx(
        shares, abs=0.03
    )  # hardly apart from Coulomb friction
    assert (found.errors["identified"] < 0.3 * found.errors["given"]).all()


# --- drives of a study


USED = ("AM_MF0060008_48V", "hd_CSG-14-50-2UH")


@pytest.fixture(scope="module")
def driven() -> dt.Study:
    """Two joints with drives from the catalogue, friction of all kinds, and a counterbalance at the second."""
    study, bare = dt.load_study(EXAMPLES / "ur5_pick_and_place" / "study.yaml"), small_arm()
    arm, rng = dt.with_rotors(bare, [None, None]), np.random.default_rng(9)
    position, velocity, acceleration = rng.uniform(-1.0, 1.0, (3, 4, 2))
    velocity = np.abs(velocity) + 0.5
    cycle = Cycle(arm.joint_names, np.linspace(0.0, 0.4, 4), position, velocity, acceleration, None, np.full(4, -1), (),
                  np.zeros(4, int), ("all",))  # fmt: skip
    spring = dt.Counterbalance(stiffness=2000.0, free_length=0.1, lever_carrier=0.3, lever_link=0.1, dead_centre=-1.5)
    tasks = [
        replace(task, name=name, drive=USED, counterbalances=(spring,) * i,
                friction=dt.Friction(2.0 + i, 3.0 + i, 4.0, 5.0, load_share=0.05 + 0.03 * i),
                motor_friction=dt.Friction(0.01 + 0.01 * i, viscous=1e-4), stop=Stop(current=20.0))
        for i, (name, task) in enumerate(zip(arm.joint_names, study.joints, strict=False))
    ]  # fmt: skip
    return replace(study, arm=arm, cycle=cycle, joints=tuple(tasks), drive_mass=DriveMass.INCLUDED, payloads=())


@pytest.mark.parametrize(("ways", "turned"), [((1.0, 1.0), 1.0), ((-1.0, 1.0), -1.0), ((-1.0, -1.0), 1.0)])
def test_the_model_is_the_evaluation_of_the_drives(driven: dt.Study, ways: tuple[float, ...], turned: float) -> None:
    """Torques that a study's drives need, gear by gear: those of the judge; its columns are their derivatives."""
    cycle = replace(driven.cycle, velocity=driven.cycle.velocity * ways)
    gears = {key: replace(gear, ratio=turned * gear.ratio) for key, gear in driven.catalog.gears.items() if key in USED}
    study, n = replace(driven, cycle=cycle, catalog=replace(driven.catalog, gears=gears)), 2
    prior, motion = fit._prior(study, None), [cycle.position, cycle.velocity, cycle.acceleration]
    work = workload(study)
    wanted = [
        Operation(work.at(i, dict(enumerate(prior.drives))).demand(drive), drive, study, i).motor_torque
        for i, drive in enumerate(prior.drives)
    ]
    model = fit._model(prior, motion)
    ratio = np.array([drive.gear.ratio for drive in prior.drives])
    assert (ratio * turned > 0.0).all()
    np.testing.assert_allclose(model.given / ratio, np.array(wanted).T, rtol=1e-6)
    assert (model.balance[:, 0] == 0.0).all() and (model.balance[:, 1] != 0.0).all()
    columns, step = fit._columns(prior, torque_regressor(prior.arm, *motion), model, None, True), 1e-5
    both = {"viscous": ("viscous", "viscous_negative"), "coulomb": ("coulomb", "coulomb_negative")}
    for k, name in enumerate(("viscous", "coulomb", "load_share")):
        laws = [
            replace(law, **{one: getattr(law, one) + step for one in both.get(name, (name,))}) for law in prior.friction
        ]
        more = fit._model(replace(prior, friction=tuple(laws)), motion).given
        first = columns.laws + k * n
        found = columns.matrix[:, :, first : first + n].sum(axis=2)
        np.testing.assert_allclose(found, (more - model.given) / step, rtol=1e-4, err_msg=name)
        assert columns.prior[first : first + n].tolist() == [getattr(law, name) for law in prior.friction]
    heavy = replace(study, arm=replace(study.arm, masses=study.arm.masses + np.array([0.0, 1e-3])))
    added = fit._model(fit._prior(heavy, None), motion).given - model.given
    change = torque_parameters(heavy.arm)[:20] - torque_parameters(study.arm)[:20]
    np.testing.assert_allclose(columns.matrix[:, :, :20] @ change, added, rtol=1e-4, atol=1e-9)


def test_currents_of_a_phase_are_converted(driven: dt.Study) -> None:
    """The torque constants of a study are those of the equivalent DC machine; a brushed motor's current is direct."""
    prior, ones = fit._prior(driven, None), np.ones((5, 2))
    [constant] = {drive.motor.torque_constant for drive in prior.drives}
    brushed = replace(prior.drives[0], motor=replace(prior.drives[0].motor, kind="brushed"))
    mixed = replace(prior, drives=(brushed, *prior.drives[1:]))
    for basis, factor in ((None, 1.0), ("dc", 1.0), ("rms", np.sqrt(1.5)), ("peak", np.sqrt(0.75))):
        measured = dt.MeasuredMotion(
            "m", driven.arm.joint_names, np.arange(5.0), ones, current=ones, current_basis=basis
        )
        torque = fit._joint_torque(measured, mixed, None) / rotor_turns(prior.arm).diagonal()
        np.testing.assert_allclose(torque, ones * [constant, factor * constant])
        given = fit._joint_torque(measured, mixed, 0.2) / rotor_turns(prior.arm).diagonal()
        np.testing.assert_allclose(given, 0.2 * ones)
        said = fit._assumed(mixed, measured, None)
        assert (basis is None) is any("do not say what amperes they are" in note for note in said)
        assert not fit._assumed(mixed, measured, 0.2)
        (line,) = fit._words_of_constants(measured, mixed, np.array([0.5, 0.25]))
        first, second = driven.arm.joint_names
        wanted = f"{first} 0.5 (given {constant:.4g}), {second} 0.25 (given {factor * constant:.4g}) N m/A"
        assert line.endswith(wanted)


def test_near_rest_friction_changes_its_sign_smoothly(driven: dt.Study) -> None:
    """Over a hundredth of the highest speed; the fall or rise of the law itself remains; half the losses at rest."""
    law = friction_curve(dt.Friction(2.0, 3.0, 4.0, 5.0, static=9.0, stribeck_speed=0.1))
    turning, way = np.array([0.1, -0.1, 0.0]), np.array([0.5, -1.0, 0.0])
    falls = np.array([0.4 + 0.5 * (2.0 + 7.0 / np.e), -0.5 - (3.0 + 6.0 / np.e), 0.0])
    np.testing.assert_allclose(fit._smooth(law, turning, way), falls)
    rises = fit._smooth(friction_curve(dt.Friction(2.0, tanh_speed=0.5)), turning, way)
    np.testing.assert_allclose(rises, 2.0 * np.tanh(turning / 0.5) * np.abs(way))
    arm = small_arm()
    velocity = np.array([[2.0, -1.0], [0.01, 0.004], [0.0, 0.0]])
    prior = replace(fit._prior(arm, None), friction=(dt.Friction(1.5, viscous=0.3),) * 2)
    model = fit._model(prior, [np.zeros((3, 2)), velocity, np.zeros((3, 2))])
    slow = np.array([0.02, 0.01])
    np.testing.assert_allclose(model.laws[0], velocity)
    np.testing.assert_allclose(model.laws[1], np.tanh(velocity / slow))
    bare = inverse_dynamics(arm, np.zeros((3, 2)), velocity, np.zeros((3, 2)))
    np.testing.assert_allclose(model.given - bare, 1.5 * np.tanh(velocity / slow) + 0.3 * velocity, atol=1e-12)
    assert (model.through == 1.0).all()
    stops = [np.zeros((2, 2)), np.array([[1.0, 1.0], [0.0, 0.0]]), np.zeros((2, 2))]
    resting = fit._model(fit._prior(driven, None), stops)
    with pytest.raises(dt.InputError, match="moves as the study gives it"):
        fit._prior(replace(driven, base=driven.cycle), None)
    shares = [task.friction.load_share for task in driven.joints]
    gears = [replace(drive.gear, load_friction=share) for drive, share in zip(driven_of(driven), shares, strict=True)]
    meshes = [mesh_of(as_record(complete(gear))) for gear in gears]
    np.testing.assert_allclose(resting.through[1], [0.5 * (mesh.driving + mesh.driven) for mesh in meshes])


def driven_of(study: dt.Study) -> tuple[Any, ...]:
    return fit._prior(study, None).drives


def test_sliding_joints_have_units_of_their_own() -> None:
    """Newtons and metres, unless a screw turns them."""
    bare = small_arm()
    arm = dt.Arm.from_screws(
        bare.home, [[0.0, 0.0, 0.0, 1.0, 0.0, 0.0], [0.0, 1.0, 0.0, -0.2, 0.0, 0.4]], bare.masses, bare.inertias,
        tip=np.eye(4), joint_names=["a", "b"],
    )  # fmt: skip
    motion = list(np.random.default_rng(11).normal(size=(3, 5, 2)))
    prior = fit._prior(arm, [dt.Friction(1.0, viscous=2.0)] * 2)
    assert prior.travel.tolist() == [1.0, 1.0]
    columns = fit._columns(prior, torque_regressor(prior.arm, *motion), fit._model(prior, motion), None, True)
    assert columns.names[-6:] == ["a.viscous [N s/m]", "b.viscous [N m s/rad]", "a.coulomb [N]", "b.coulomb [N m]",
                                  "a.load_share [-]", "b.load_share [-]"]  # fmt: skip
    assert columns.friction.sum() == 6 and columns.friction[-6:].all() and columns.laws == 20
    tasks = [SimpleNamespace(travel_per_turn=one, counterbalances=()) for one in (0.02, None)]
    turned = replace(prior, study=SimpleNamespace(joints=tasks, drive_mass=DriveMass.ADDED))
    assert turned.travel.tolist() == [0.02, 1.0]
    model = fit._model(turned, motion)
    np.testing.assert_allclose(model.laws[0], motion[1] / [0.02, 1.0])
    again = fit._columns(turned, torque_regressor(turned.arm, *motion), model, None, False)
    assert again.names[-4:] == ["a.viscous [N m s/rad]", "b.viscous [N m s/rad]", "a.coulomb [N m]", "b.coulomb [N m]"]
    np.testing.assert_allclose(again.matrix[:, 0, -4], motion[1][:, 0] / 0.02**2)
    np.testing.assert_allclose(again.matrix[:, 0, -2], model.laws[1][:, 0] / 0.02)


# --- exciting motions


def test_sums_of_sines_start_at_rest_and_reach_a_limit() -> None:
    rng = np.random.default_rng(10)
    time, omega = np.arange(4001) / 1000.0, 2.0 * np.pi / 4.0 * np.arange(1.0, 4.0)
    low, high, fastest = np.array([-1.0, -0.2, -3.0]), np.array([2.0, 0.1, 3.0]), np.array([0.5, 2.0, 9.0])
    q, qd, qdd = exciting._series(time, omega, rng.normal(size=(2, 3, 3)), (low, high, fastest, 4.0))
    np.testing.assert_allclose(np.gradient(q, time, axis=0)[1:-1], qd[1:-1], atol=2e-5)
    np.testing.assert_allclose(np.gradient(qd, time, axis=0)[1:-1], qdd[1:-1], atol=2e-4)
    for values in (qd, qdd):
        np.testing.assert_allclose(values[[0, -1]], 0.0, atol=1e-12)
    np.testing.assert_allclose(q[0], q[-1], atol=1e-12)
    np.testing.assert_allclose(0.5 * (q.max(axis=0) + q.min(axis=0)), 0.5 * (low + high), atol=1e-12)
    used = [np.ptp(q, axis=0) / (high - low), np.abs(qd).max(axis=0) / fastest, np.abs(qdd).max(axis=0) / 4.0]
    np.testing.assert_allclose(np.max(used, axis=0), 0.9, rtol=1e-12)
    assert len(set(np.argmax(used, axis=0))) == 3
    # All harmonics are in it: as many as free numbers.
    basis = np.column_stack([f(time[:, None] * omega) for f in (np.sin, np.cos)])
    weights = np.linalg.lstsq(np.column_stack([basis, np.ones(4001)]), q, rcond=None)[0]
    assert (np.abs(weights[:6]) > 1e-6).all()
    np.testing.assert_allclose(omega @ weights[:3], 0.0, atol=1e-9)
    np.testing.assert_allclose(omega**2 @ weights[3:6], 0.0, atol=1e-9)


def test_limits_that_are_not_stated() -> None:
    arm = dt.load_arm("planar-2r-bare")
    for lower, upper, speed, wanted in (
        (-np.inf, np.inf, np.inf, (-np.pi, np.pi, 2.0)), (-1.0, np.inf, 3.0, (-1.0, np.pi, 3.0)),
        (3.0, np.inf, 3.0, (3.0, 4.0, 3.0)), (-np.inf, -4.0, 1.0, (-5.0, -4.0, 1.0)), (0.1, 0.2, 1.0, (0.1, 0.2, 1.0)),
    ):  # fmt: skip
        limited = replace(arm, lower=np.full(2, lower), upper=np.full(2, upper), speed_limits=np.full(2, speed))
        found = exciting._limits(limited)
        for values, one in zip(found, wanted, strict=True):
            assert values.tolist() == pytest.approx([one, one])


@pytest.mark.parametrize(
    "limits",
    [
        {"lower": [0.5, -1.0], "upper": [0.5, 1.0]},
        {"lower": [0.5, -1.0], "upper": [-0.5, 1.0]},
        {"speed_limits": [0.0, 1.0]},
    ],
)
def test_a_joint_that_cannot_move_is_an_error(limits: dict[str, list[float]]) -> None:
    """Not a motion of the others alone, or one between limits that are exchanged."""
    arm = dt.load_arm("planar-2r-bare")
    still = replace(arm, **{name: np.array(values) for name, values in limits.items()})
    with pytest.raises(dt.InputError, match=f"joint {arm.joint_names[0]}: cannot move between its limits") as error:
        dt.exciting_motion(still)
    assert len(error.value.faults) == 1


def test_a_period_of_no_whole_samples_ends_at_rest() -> None:
    motion = dt.exciting_motion(dt.load_arm("planar-2r-bare"), duration=7.3, rate=33.5, candidates=1)
    assert len(motion.time) == 246  # 244.55 samples
    for values in (motion.velocity, motion.acceleration, motion.position - motion.position[0]):
        np.testing.assert_allclose(values[-1], 0.0, atol=1e-12)


def test_the_best_conditioned_of_some_motions() -> None:
    """Condition of the base parameters' columns, each scaled to 1; equal seeds draw the same candidates."""
    arm, conditions = small_arm(), []

    def condition(motion: dt.Motion) -> float:
        some = slice(None, None, max(1, len(motion.time) // 150))
        rows = torque_regressor(arm, motion.position[some], motion.velocity[some], motion.acceleration[some])
        flat = rows.reshape(-1, rows.shape[2])
        chosen = flat[:, base_parameters(flat).leading]
        return float(np.linalg.cond(chosen / np.linalg.norm(chosen, axis=0)))

    options = {"duration": 3.0, "rate": 101.0, "harmonics": 3, "seed": 4}
    for count in (1, 2, 3, 4, 5):
        motion = dt.exciting_motion(arm, candidates=count, **options)
        conditions.append(condition(motion))
        assert len(motion.time) == 304 and motion.time[-1] == pytest.approx(3.0)
        assert f"best conditioned of {count} sums of 3 sines: condition {conditions[-1]:.3g}" in motion.notes[0]
    assert (np.diff(conditions) <= 0.0).all() and conditions[-1] < conditions[0]
    with pytest.raises(dt.InputError, match="10 samples a harmonic"):
        dt.exciting_motion(arm, duration=0.29, rate=100.0, harmonics=3)
    assert len(dt.exciting_motion(arm, duration=0.3, rate=100.0, harmonics=3, candidates=1).time) == 31
    with pytest.raises(dt.InputError, match="seed: must not be negative"):
        dt.exciting_motion(arm, seed=-1)
    for wrong in ({"harmonics": 1}, {"candidates": 0}):
        with pytest.raises(dt.InputError, match="2 harmonics, 1 candidate"):
            dt.exciting_motion(arm, **wrong)
