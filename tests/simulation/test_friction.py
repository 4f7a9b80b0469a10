"""The complementarity problem of friction: answers held against what each mode claims, and against enumeration."""

import itertools

import numpy as np
import pytest

import drivetrain as dt
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
    # Few systems, though half the joints begin at rest and break loose, and half the meshes with the wrong sign.
    assert np.mean(solves) < 2.0 + (0.65 if mesh else 0.35) * n


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


@pytest.mark.parametrize("n", [2, 3, 4])
def test_all_beyond_their_bounds_slip_whatever_their_meshes_transmit(n: int) -> None:
    """From rest: all beyond their bounds slip, those that do not then move stick again, each with its mesh's sign."""
    for seed in range(60):
        problem = Problem(seed, n, True, True)
        problem.speed[:] = 0.0
        modes, sides = np.zeros(n, int), np.ones(n)
        for _ in range(50):
            for _ in range(50):  # until the signs of the torques in all meshes are those that the losses assume
                change, kappa, own = np.zeros(n), np.zeros(n), np.zeros(n)
                for i, mode in enumerate(modes):
                    row = problem.dry[i]
                    own[i] = mode * row["joint"]["slide_forward" if mode > 0 else "slide_backward"]
                    kappa[i] = row["driving"] if mode * sides[i] > 0 else -row["driven"]
                go = modes != 0
                drag = own + modes * problem.dry["motor"]["slide_forward"] + kappa * (problem.load + own)
                matrix = problem.matrix + problem.h * kappa[:, None] * problem.carried
                change[go] = np.linalg.solve(matrix[np.ix_(go, go)], (problem.right - problem.h * drag)[go])
                carried = problem.load + problem.carried @ change
                wrong = go & ((carried + own) * sides < 0.0)
                if not wrong.any():
                    break
                sides[wrong] *= -1.0
            friction = (problem.right - problem.matrix @ change) / problem.h
            before = modes.copy()
            for i in range(n):
                forward, backward = problem.limits(i, carried[i], "hold")
                if before[i] == 0 and not -backward <= friction[i] <= forward:
                    modes[i] = 1 if friction[i] > 0.0 else -1
                    held = problem.dry[i]["joint"]["hold_forward" if modes[i] > 0 else "hold_backward"]
                    sides[i] = 1.0 if carried[i] + modes[i] * held >= 0.0 else -1.0
                elif before[i] * change[i] < 0.0:
                    modes[i] = 0
            if (modes == before).all():
                break
        else:
            continue  # this rule finds none: the least index decides
        _, found, _ = problem.solved()
        np.testing.assert_array_equal(found, modes, str(seed))


@pytest.mark.parametrize("engine", [dt.FixedStep(1e-4), dt.AdaptiveStep()], ids=repr)
def test_what_breaks_loose_behind_a_self_locking_gear_also_slides(engine: dt.FixedStep | dt.AdaptiveStep) -> None:
    """A load pushes a worm forward, and a motor has to help: less friction at the joint loads the teeth more.

    With 1.2 of the load lost, the motor adds 0.2 (load - friction). With the static friction that is less than sliding
    takes, so the gear sticks until the motor can make it slide.
    """
    load, coulomb, rise, inertia, rotor, ratio, kt = 0.68, 0.2, 2.0, 0.1, 0.15, 80.0, 0.05
    gear = dt.Gear("worm", ratio, efficiency=0.6, backdriving_efficiency=-0.2)
    effects = (
        dt.FullRotor(rotor / ratio**2, ratio), dt.MotorCurrent(dt.Motor("m", 0.5, kt)), dt.MeshLoss(gear),
        dt.DryFriction(dt.Friction(coulomb=coulomb, static=0.26)), dt.GivenTorque([0.0, 1.0], [load, load]),
        dt.GivenCurrent([0.0, 1.0], [0.0, rise / ratio / kt]),
    )  # fmt: skip
    run = dt.simulate(dt.joint_scene(inertia, effects, 0.3), solver=engine, interval=0.02)
    limit = 0.2 * (load - coulomb)
    late = np.maximum(run.time - limit / rise, 0.0)
    np.testing.assert_allclose(run["joint.speed"], 0.5 * rise * late**2 / (rotor - 0.2 * inertia), atol=2e-5)
    assert run.stopped_by is None and [event.name for event in run.events] == ["breakaway"]
