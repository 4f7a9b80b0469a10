"""The complementarity problem of friction: answers held against what each mode claims, and against enumeration."""

import itertools

import numpy as np
import pytest

from drivetrain.jit import kernel
from drivetrain.simulation.core import friction
from drivetrain.simulation.core.records import COORDINATE, PAIR

solve_friction = kernel(friction.solve_friction)
NAMES = {"hold": ("hold_forward", "hold_backward"), "slide": ("slide_forward", "slide_backward")}


class Problem:
    """A random one; meshes where asked for."""

    def __init__(self, seed: int, n: int, mesh: bool, static: bool):
        rng = np.random.default_rng(seed)
        self.n, self.h = n, 1e-3
        root = rng.normal(size=(n, n))
        links = root @ root.T + 0.05 * np.eye(n)
        self.matrix = links + np.diag(rng.uniform(0.0, 1.0, n))
        self.carried = links / self.h
        self.right = self.h * rng.normal(size=n) * 20.0
        self.load = rng.normal(size=n) * 10.0
        self.speed = np.where(rng.random(n) < 0.5, 0.0, rng.normal(size=n) * 3e-3)
        self.coordinates = np.zeros(n, COORDINATE)
        self.dry = self.coordinates["dry"]
        slide = rng.uniform(0.0, 10.0, (n, 2))
        drag = rng.uniform(0.0, 5.0, n)
        for level, factor in (("slide", 1.0), ("hold", 1.3 if static else 1.0)):
            for back, name in enumerate(NAMES[level]):
                self.dry["joint"][name] = slide[:, back] * factor
                self.dry["motor"][name] = drag
        if mesh:
            self.dry["driving"] = rng.uniform(0.0, 0.3, n)
            self.dry["driven"] = rng.uniform(0.0, 0.3, n)
        self.dry["active"] = 1
        self.mesh = mesh

    def solved(self) -> tuple[np.ndarray, np.ndarray, int]:
        found, pairs = self.coordinates.copy(), np.zeros((self.n, self.n), PAIR)
        found["impulse"], found["transmitted"], found["relative"] = self.right, self.load, self.speed
        found["dry"]["mode"], found["dry"]["load_sign"] = np.sign(self.speed), 1
        pairs["matrix"], pairs["transmitted"] = self.matrix, self.carried
        solves = solve_friction(found, pairs, self.h)
        return found["change"], found["dry"]["mode"], solves

    def limits(self, i: int, load: float, level: str) -> tuple[float, float]:
        """Friction in either direction, at a carried torque without the joint's own friction."""
        answer = []
        for back, sign in ((0, 1.0), (1, -1.0)):
            row, name = self.dry[i], NAMES[level][back]
            joint, motor = row["joint"][name], row["motor"][name]
            total = load + sign * joint
            lost = row["driving"] * abs(total) if sign * total > 0.0 else row["driven"] * abs(total)
            answer.append(joint + motor + lost)
        return answer[0], answer[1]

    def contradictions(self, change: np.ndarray) -> float:
        """By how much [N m] friction is outside what the motion allows."""
        friction = (self.right - self.matrix @ change) / self.h
        load = self.load + self.carried @ change
        worst = 0.0
        for i in range(self.n):
            after = self.speed[i] + change[i]
            if after == 0.0:
                forward, backward = self.limits(i, load[i], "hold")
                worst = max(worst, friction[i] - forward, -backward - friction[i])
            else:
                forward, backward = self.limits(i, load[i], "slide")
                worst = max(worst, abs(friction[i] - (forward if after > 0.0 else -backward)))
        return worst


@pytest.mark.parametrize("mesh", [False, True])
@pytest.mark.parametrize("static", [False, True])
@pytest.mark.parametrize("n", [1, 2, 6, 12])
def test_every_answer_fits_its_modes(n: int, mesh: bool, static: bool) -> None:
    solves = []
    for seed in range(150):
        problem = Problem(seed, n, mesh, static)
        change, modes, count = problem.solved()
        assert count > 0, seed
        solves.append(count)
        scale = np.abs(problem.right).max() / problem.h + np.abs(problem.load).max()
        assert problem.contradictions(change) < 1e-8 * scale * np.linalg.cond(problem.matrix) ** 0.5, seed
        assert (problem.speed[modes == 0] + change[modes == 0] == 0.0).all()
    assert np.mean(solves) < 2.0 + 0.35 * n  # few systems, though half the joints begin at rest and break loose


@pytest.mark.parametrize("seed", range(40))
def test_without_a_step_from_static_to_sliding_the_answer_is_the_only_one(seed: int) -> None:
    problem = Problem(seed, 3, False, False)
    change, _, _ = problem.solved()
    fitting = []
    for modes in itertools.product((-1, 0, 1), repeat=3):
        sliding = np.array([mode != 0 for mode in modes])
        friction = np.array([m * problem.limits(i, 0.0, "slide")[0 if m > 0 else 1] for i, m in enumerate(modes)])
        answer = -problem.speed.copy()
        if sliding.any():
            known = problem.matrix[np.ix_(sliding, ~sliding)] @ answer[~sliding]
            rest = (problem.right - problem.h * friction)[sliding] - known
            answer[sliding] = np.linalg.solve(problem.matrix[np.ix_(sliding, sliding)], rest)
        right_way = ((problem.speed + answer) * np.array(modes))[sliding] > 0.0
        if right_way.all() and problem.contradictions(answer) < 1e-9:
            fitting.append(answer)
    assert len(fitting) == 1
    np.testing.assert_allclose(change, fitting[0], atol=1e-15, rtol=1e-9)
