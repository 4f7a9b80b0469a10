"""Parts of a step by themselves: dry friction against every set of modes, factors, groups of columns, a linkage."""

from __future__ import annotations

import itertools
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from crank_arm import short_crank, two_links

import drivetrain as dt
from drivetrain.simulation.core import equations, friction
from drivetrain.simulation.core.jacobian import _to_accelerations, _to_torques, column_groups
from drivetrain.simulation.engines.starting import initial_memory
from drivetrain.simulation.planning.plan import plan
from drivetrain.simulation.run import simulate

# --- dry friction


class Pairs:
    """Entries of pairs of coordinates by two indices, as in a run's memory."""

    def __init__(self, matrix: np.ndarray, transmitted: np.ndarray):
        self.rows = [
            [
                SimpleNamespace(matrix=float(a), transmitted=float(b), reduced=0.0, mass=float(a))
                for a, b in zip(*two, strict=True)
            ]
            for two in zip(matrix, transmitted, strict=True)
        ]

    def __getitem__(self, at: tuple[int, int]) -> Any:
        return self.rows[at[0]][at[1]]


def bounds(hold: Any, slide: Any) -> Any:
    return SimpleNamespace(hold_forward=hold[0], hold_backward=hold[1], slide_forward=slide[0], slide_backward=slide[1])


def system(rng: np.random.Generator, c: int, meshes: bool, static: bool) -> tuple[Any, Pairs]:
    """Random coordinates with friction of joint and motor, some without any; some at rest."""
    root = rng.normal(size=(c, c))
    matrix = root @ root.T + np.eye(c)
    transmitted = meshes * 0.3 * rng.normal(size=(c, c))
    coordinates = []
    for _ in range(c):
        slide = rng.uniform(0.1, 1.0, (2, 2)) * rng.integers(0, 2, (2, 1))
        hold = slide * (1.0 + static * rng.random((2, 2)))
        dry = SimpleNamespace(
            mode=int(rng.integers(-1, 2)), mode_fixed=0, active=int(slide.any() or meshes),
            load_sign=int(rng.choice([-1, 1])),
            joint=bounds(hold[0], slide[0]), motor=bounds(hold[1], slide[1]),
            driving=meshes * rng.uniform(0.05, 0.3), driven=meshes * rng.uniform(0.05, 0.3),
        )  # fmt: skip
        dry.mode = dry.mode if dry.active else 1
        coordinates.append(SimpleNamespace(
            dry=dry, relative=float(rng.normal() * rng.integers(0, 2)), change=0.0, impulse=float(2.0 * rng.normal()),
            transmitted=float(meshes * rng.normal()), friction=0.0, margin=0.0, before=0, slipping=0, released=0,
            saved_mode=0, saved_sign=0, saved_fixed=0,
        ))  # fmt: skip
    return coordinates, Pairs(matrix, transmitted)


def consistent(coordinates: Any, matrix: np.ndarray, transmitted: np.ndarray, h: float, room: float = 1e-9) -> bool:
    """Whether changes, modes and friction satisfy the equations and the laws of friction."""
    change = np.array([one.change for one in coordinates])
    left = np.array([one.impulse for one in coordinates]) - matrix @ change
    load = np.array([one.transmitted for one in coordinates]) + transmitted @ change
    fits = True
    for i, one in enumerate(coordinates):
        force, after, dry = left[i] / h, one.relative + change[i], one.dry
        if not dry.active:
            fits &= abs(force) < room
        elif dry.mode == 0:
            upper, lower = lost(dry, load[i], 1, False), lost(dry, load[i], -1, False)
            slack = room + 2e-8 * matrix[i, i] * (dry.driven > 0.0)
            fits &= abs(after) < room and -lower - slack <= force <= upper + slack
        else:
            fits &= after * dry.mode > -room and abs(dry.mode * force - lost(dry, load[i], dry.mode, True)) < room
    return bool(fits)


def lost(dry: Any, load: float, way: int, sliding: bool) -> float:
    """Friction against motion one way; a mesh that is driven back gives some of what it carries."""
    side, kind = "forward" if way > 0 else "backward", "slide" if sliding else "hold"
    joint, motor = (getattr(one, f"{kind}_{side}") for one in (dry.joint, dry.motor))
    through = way * (load + way * joint)
    return joint + motor + (dry.driving * through if through > 0.0 else -dry.driven * through)


@pytest.mark.parametrize(("meshes", "static"), [(False, False), (False, True), (True, False), (True, True)])
def test_every_solution_satisfies_the_laws_of_friction(meshes: bool, static: bool) -> None:
    rng, modes = np.random.default_rng(20 + 2 * meshes + static), set()
    for trial in range(120):
        c, h = int(rng.integers(1, 5)), float(rng.choice([0.3, 1.0]))
        coordinates, pairs = system(rng, c, meshes, static)
        matrix, transmitted = (np.array([[getattr(pairs[i, k], name) for k in range(c)] for i in range(c)])
                               for name in ("matrix", "transmitted"))  # fmt: skip
        found = friction.solve_friction(coordinates, pairs, h)
        assert found >= 1, trial
        assert consistent(coordinates, matrix, transmitted, h), trial
        for one in coordinates:
            if one.dry.mode and one.dry.active:
                assert one.margin == pytest.approx((one.relative + one.change) * one.dry.mode)
            if one.dry.active and one.dry.mode == 0:
                at = coordinates.index(one)
                change = np.array([other.change for other in coordinates])
                load = one.transmitted + transmitted[at] @ change
                upper, lower = lost(one.dry, load, 1, False), lost(one.dry, load, -1, False)
                force = friction.friction_torque(coordinates, pairs, at, h)
                assert one.friction == pytest.approx(force)
                assert one.margin == pytest.approx(min(upper - force, lower + force), abs=1e-9)
        modes |= {one.dry.mode for one in coordinates}
    assert modes == {-1, 0, 1}


def test_modes_that_are_held_stay_and_a_jam_is_named() -> None:
    rng = np.random.default_rng(30)
    for _ in range(40):
        c = 3
        coordinates, pairs = system(rng, c, False, True)
        for one in coordinates:
            one.dry.mode_fixed = 1
        before = [one.dry.mode for one in coordinates]
        assert friction.solve_friction(coordinates, pairs, 1.0) == 1
        assert [one.dry.mode for one in coordinates] == before
        stuck = [one.change == -one.relative for one in coordinates if one.dry.mode == 0]
        assert all(stuck)
    coordinates, pairs = system(rng, 2, True, False)
    coordinates[1].dry.mode, coordinates[1].dry.driven, coordinates[1].dry.load_sign = 1, 9.0, -1
    coordinates[1].dry.mode_fixed, pairs[1, 1].transmitted = 1, 9.0
    assert friction.solve_friction(coordinates, pairs, 1.0) == -2


def sliding(dry: Any) -> float:
    """Friction of joint and motor while sliding."""
    side = "slide_forward" if dry.mode > 0 else "slide_backward"
    return float(getattr(dry.joint, side) + getattr(dry.motor, side))


def test_other_sets_of_modes_that_fit_are_found() -> None:
    """All sets in which some of those that were let go stick, tried one by one; nothing is changed."""
    rng, told = np.random.default_rng(31), {True: 0, False: 0}
    for _ in range(150):
        c = int(rng.integers(2, 5))
        coordinates, pairs = system(rng, c, False, True)
        matrix = np.array([[pairs[i, k].matrix for k in range(c)] for i in range(c)])
        for one in coordinates:
            one.relative, one.before = 0.0, int(rng.integers(0, 4) == 0 or not one.dry.active)
            one.impulse *= 0.6
            for part in (one.dry.joint, one.dry.motor):
                part.hold_forward, part.hold_backward = 2.0 * part.slide_forward, 2.0 * part.slide_backward
        friction.solve_friction(coordinates, pairs, 1.0)
        kept = [(one.dry.mode, one.dry.mode_fixed, one.dry.load_sign, one.change) for one in coordinates]
        shown = [(one.margin, one.dry.mode == 0 and one.friction) for one in coordinates if one.dry.active]
        released = [i for i, one in enumerate(coordinates) if one.before == 0 and one.dry.mode != 0]
        fitting = []
        for stuck in itertools.product((False, True), repeat=len(released)):
            if any(stuck) and not all(stuck) and len(released) > 1:
                trial = [SimpleNamespace(**vars(one)) for one in coordinates]
                for one in trial:
                    one.dry = SimpleNamespace(**vars(one.dry))
                for i, sticks in zip(released, stuck, strict=True):
                    trial[i].dry.mode = 0 if sticks else trial[i].dry.mode
                slips = [i for i, one in enumerate(trial) if one.dry.mode != 0]
                force = [one.dry.active * one.dry.mode * sliding(one.dry) for one in trial]
                change = np.zeros(c)
                change[slips] = np.linalg.solve(
                    matrix[np.ix_(slips, slips)], [trial[i].impulse - force[i] for i in slips]
                )
                for one, value in zip(trial, change, strict=True):
                    one.change = value
                if consistent(trial, matrix, 0.0 * matrix, 1.0):
                    fitting.append([i for i, sticks in zip(released, stuck, strict=True) if sticks])
        found = friction.ambiguous_modes(coordinates, pairs, 1.0)
        assert (found == -1) == (not fitting)
        assert not fitting or any(found in some for some in fitting)
        again = [(one.dry.mode, one.dry.mode_fixed, one.dry.load_sign) for one in coordinates]
        assert again == [one[:3] for one in kept]
        assert [one.change for one in coordinates] == pytest.approx([one[3] for one in kept])
        left = [(one.margin, one.dry.mode == 0 and one.friction) for one in coordinates if one.dry.active]
        np.testing.assert_allclose(left, shown, rtol=1e-9, atol=1e-12)
        told[bool(fitting)] += 1
    assert told[True] > 3 and told[False] > 30


# --- the Jacobian's own parts


def test_accelerations_and_torques_of_slipping_coordinates() -> None:
    """The factors that the solution leaves, against the matrix itself."""
    rng = np.random.default_rng(32)
    for c in (1, 2, 4):
        coordinates, pairs = system(rng, c, False, False)
        matrix = rng.normal(size=(c, c)) + 3.0 * np.eye(c)
        for i, k in itertools.product(range(c), repeat=2):
            pairs[i, k].matrix = matrix[i, k]
        for one in coordinates:
            one.dry.mode, one.dry.active = 1, 0
        assert friction._solve(coordinates, pairs, 1.0) == -1
        factors = np.array([[pairs[i, k].reduced for k in range(c)] for i in range(c)])
        given = rng.normal(size=c)
        for law, wanted in ((_to_torques, matrix @ given), (_to_accelerations, np.linalg.solve(matrix, given))):
            vector = given.copy()
            law(factors, c, vector)
            np.testing.assert_allclose(vector, wanted, rtol=1e-10)


def test_columns_of_a_group_share_no_row() -> None:
    rng = np.random.default_rng(33)
    for _ in range(20):
        full = rng.random((9, 9)) < 0.3
        full[:, 4] = False  # a state on which nothing depends
        groups, members, row_starts, rows = column_groups(full, 9)
        assert sorted(members) == [j for j in range(9) if full[:, j].any()]
        for a, b in itertools.pairwise(groups):
            assert full[:, members[a:b]].sum(axis=1).max() <= 1 and b > a
        assert len(groups) - 1 <= full.any(axis=0).sum()
        for j in range(9):
            assert rows[row_starts[j] : row_starts[j + 1]].tolist() == np.flatnonzero(full[:, j]).tolist()
    one = column_groups(np.eye(5, dtype=bool), 5)
    assert one[0].tolist() == [0, 5]  # all at once


# --- linkages and torques that depend on the angle


def test_a_linkage_accelerates_as_its_energies_say() -> None:
    """Lagrange's equations of the recorded energies: their derivatives by differences, at an instant."""
    study = two_links(closures=short_crank())
    torques, place, speed, step = np.array([1.5, -0.4]), np.array([0.4, -0.7]), np.array([1.1, -1.6]), 1e-4

    effects = {
        name: (dt.ReflectedRotor(1e-4, 50.0), dt.GivenTorque([0.0], [float(torque)], "motor"))
        for name, torque in zip(study.arm.joint_names, torques, strict=True)
    }
    planned = plan(dt.Scene(study.arm, effects, 1e-3, place, speed))
    numbers, memory = initial_memory(planned), planned.memory
    at, world = memory.view(numbers, "coordinates"), memory.view(numbers, "world")

    def energies(q: np.ndarray, v: np.ndarray) -> tuple[float, float]:
        at["position"], at["speed"] = q, v
        equations.evaluate_signals(numbers)
        return float(world["kinetic_energy"][0]), float(world["potential_energy"][0])

    def terms(q: np.ndarray) -> tuple[np.ndarray, float]:
        """Mass matrix and potential energy."""
        (a, _), (b, _), (c, high) = (energies(q, np.array(v)) for v in ([1.0, 0.0], [0.0, 1.0], [1.0, 1.0]))
        return np.array([[2.0 * a, c - a - b], [c - a - b, 2.0 * b]]), high

    sides = [(terms(place + d), terms(place - d)) for d in step * np.eye(2)]
    change = np.array([(more[0] - less[0]) / (2.0 * step) for more, less in sides])
    gravity = np.array([(more[1] - less[1]) / (2.0 * step) for more, less in sides])
    mass = np.mean([one[0] for pair in sides for one in pair], axis=0)
    coriolis = np.einsum("kij,k,j->i", change, speed, speed) - 0.5 * np.einsum("ijk,j,k->i", change, speed, speed)
    wanted = np.linalg.solve(mass, 50.0 * torques - coriolis - gravity)
    energies(place, speed)
    np.testing.assert_allclose(at["change"], wanted, rtol=1e-5)
    np.testing.assert_allclose(at["bias"], coriolis + gravity, rtol=1e-5)
    assert (np.abs(coriolis) > 0.02 * np.abs(gravity)).all()


@pytest.mark.parametrize("ratio", [1.0, -30.0])
def test_cogging_is_a_spring_within_a_step(ratio: float) -> None:
    """Its mean over the turn and its stiffness, where it holds, at the guessed middle; written out step by step."""
    size, order, phase, inertia, h = 0.05, 6, 1.3, 3e-3, 2e-3
    phase, rotor = phase * np.sign(ratio), dt.FullRotor(0.0, ratio)
    effects = (rotor, dt.Cogging((size,), (order,), (phase,)), dt.ViscousFriction(dt.Friction(viscous=2e-3), "motor"))
    scene = dt.Scene(dt.Inertia(inertia * ratio**2), {"joint": effects}, 12 * h, speed=np.array([4.0 / abs(ratio)]))
    run = simulate(scene, solver=dt.FixedStep(h), interval=h, checked=False)
    q, v, last, held = 0.0, ratio * 4.0 / abs(ratio), None, set()
    for k in range(12):
        if last is None:  # the run begins with the acceleration of its first instant
            last = (-size * np.sin(order * q + phase) - 2e-3 * v) / inertia
        middle = v + 0.5 * h * last
        angle, half = order * (q + 0.5 * h * middle) + phase, 0.5 * h * order * middle
        pull = size * np.sinc(half / np.pi) * order * np.cos(angle)
        held.add(pull > 0.0)
        soft = 2e-3 + 0.5 * h * max(pull, 0.0)
        torque = -size * np.sinc(half / np.pi) * np.sin(angle) - 2e-3 * middle
        change = h * (torque + soft * (middle - v)) / (inertia + 0.5 * h * soft)
        q, v, last = q + h * (v + 0.5 * change), v + change, change / h
        found = ratio * run["joint.position"][k + 1], ratio * run["joint.speed"][k + 1]
        assert found == pytest.approx((q, v), rel=1e-9), k
    assert held == {True, False}
