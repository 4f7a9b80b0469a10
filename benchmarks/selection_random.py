"""Random tasks for the selection benchmark: arms, motions and catalogues drawn at random, some hard on purpose."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from selection_tasks import Pairs, chain_study, resampled, scaled_catalog, with_pairs

import drivetrain as dt
from drivetrain.catalog.read import Catalog
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.sizing.search.candidates import Candidates, build_candidates
from drivetrain.sizing.search.problem import build_problem
from drivetrain.sizing.search.tree import Tree
from drivetrain.study.model import Study

DURATION = 4.0  # s
JOINTS, SAMPLES = 6, 2000
MEDIAN, WORST, GIVE_UP = 0.1, 0.5, 20.0  # s, wanted of the search of random tasks; when it is stopped

Kind = tuple[str, Callable[[int], Study], Callable[[int, int], tuple[Catalog, Pairs]], str]


def random_arm_study(study: Study, joints: int, samples: int, seed: int) -> Study:
    """A task for an arm whose lengths, axes, masses and motion are drawn at random.

    Args:
        study: Of which everything but the arm and the motion is taken.
        joints: How many.
        samples: Of the motion, a sine at each joint.
        seed: Of the draw.

    Returns:
        The study without candidates.
    """
    rng, base = np.random.default_rng([seed, 7]), chain_study(study, joints, samples)
    reach = rng.uniform(0.5, 1.5) * rng.uniform(0.5, 1.0, joints).cumprod()
    reach *= rng.uniform(0.7, 1.4) / reach.sum()
    ends = np.concatenate([[0.0], np.cumsum(reach)])
    axes = [np.eye(3)[rng.choice(3, p=[0.15, 0.5, 0.35])] for _ in range(joints)]
    points = np.column_stack([ends[:-1], np.zeros(joints), np.zeros(joints)])
    home, tip = np.tile(np.eye(4), (joints, 1, 1)), np.eye(4)
    home[:, 0, 3], tip[0, 3] = 0.5 * (ends[:-1] + ends[1:]), ends[-1]
    screws = np.array([np.concatenate([axis, np.cross(point, axis)]) for axis, point in zip(axes, points, strict=True)])
    masses = rng.uniform(3.0, 12.0) * reach
    across = masses * (reach**2 / 10 + 0.001)
    inertias = np.array([np.diag([0.002 * m, i, i]) for m, i in zip(masses, across, strict=True)])
    names = base.cycle.joint_names
    arm = dt.Arm.from_screws(home, screws, masses, inertias, tip, joint_points=points, joint_names=names)
    t = np.linspace(0.0, DURATION, samples)[:, None]
    rate, phase = 0.5 * np.pi * rng.integers(1, 4, joints), rng.uniform(0.0, 2 * np.pi, joints)
    size = rng.uniform(0.3, 1.2, joints) / rate
    q, qd = size * np.sin(rate * t + phase), size * rate * np.cos(rate * t + phase)
    none, zero = np.full(samples, -1), np.zeros(samples, dtype=np.int64)
    cycle = Cycle(names, t[:, 0], q, qd, -(rate**2) * q, None, none, (), zero, ("sines",))
    return replace(base, arm=arm, cycle=cycle)


def dear_catalog(pairs: int, seed: int) -> tuple[Catalog, Pairs]:
    """A catalogue in which the price buys lightness: mass and price pull against each other, which is hard to prove.

    Args:
        pairs: How many pairs are wanted.
        seed: Of the scatter.

    Returns:
        The rows of ``scaled_catalog`` with other masses and prices, and the pairs.
    """
    catalog, chosen = scaled_catalog(pairs, seed)
    rng = np.random.default_rng([seed, 11])

    def scatter(row: Motor | Gear, price: float) -> dict[str, float]:
        lightness, mass = math.exp(rng.uniform(-0.7, 0.7)), row.mass or 1.0
        asked = price * mass**0.6 * lightness**1.3 * math.exp(0.1 * rng.standard_normal())
        return {"mass": mass / lightness, "price": asked}

    motors = {key: replace(row, **scatter(row, 150.0)) for key, row in catalog.motors.items()}
    gears = {key: replace(row, **scatter(row, 250.0)) for key, row in catalog.gears.items()}
    return Catalog(motors, gears), chosen


def kinds(task: Study) -> tuple[Kind, ...]:
    """What is drawn: in words, the task without candidates, the catalogue, the term that is minimised.

    Args:
        task: The example.

    Returns:
        Each with functions of a seed.
    """
    usual = resampled(task, SAMPLES)

    def same(seed: int) -> Study:
        """The example."""
        return usual

    def drawn(seed: int) -> Study:
        """A random arm."""
        return random_arm_study(task, JOINTS, SAMPLES, seed)

    return (
        ("the example, mass", same, scaled_catalog, "mass"),
        ("the example, price", same, scaled_catalog, "price"),
        ("the example, price buys lightness", same, dear_catalog, "price"),
        ("random arms, mass", drawn, scaled_catalog, "mass"),
        ("random arms, price buys lightness", drawn, dear_catalog, "price"),
        ("the example, energy", same, scaled_catalog, "energy"),
    )


def random_met(task: Study, size: int, count: int) -> list[tuple[str, bool]]:
    """Search random tasks for the best set and for the five best, each once, and print the times.

    Args:
        task: The example.
        size: Pairs at each joint.
        count: Tasks of each kind.

    Returns:
        What was wanted, and whether it is so.
    """
    print(f"{count} random tasks of each kind, {JOINTS} x {size} pairs, time to the proof [ms]")
    print(f"{'':36} best set: median  worst  proven   five best: median  worst  proven")
    met = []
    for kind, drawn, catalog, term in kinds(task):
        studies = (with_pairs(drawn(seed), *catalog(size, seed)) for seed in range(1, count + 1))
        found = [[_timed(offered, term, sets) for sets in (1, 5)] for offered in map(build_candidates, studies)]
        seconds = np.array([[one[0] for one in row] for row in found])
        proven = np.sum([[one[1] for one in row] for row in found], axis=0)
        median, worst = np.median(seconds, axis=0), seconds.max(axis=0)
        told = [f"{1e3 * m:16.1f} {1e3 * w:6.0f} {p:4}/{count}" for m, w, p in zip(median, worst, proven, strict=True)]
        print(f"{kind:36} {'    '.join(told)}")
        good, wish = bool((proven == count).all()), "all proven"
        if term != "energy":
            good, wish = good and bool(median.max() <= MEDIAN and worst.max() <= WORST), "all proven, none over 0.5 s"
        met.append((f"{kind}: {wish}", good))
    print()
    return met


def _timed(offered: Candidates, term: str, sets: int) -> tuple[float, bool]:
    """Time of a search, and whether it ended with a proof."""
    start = time.process_time()
    tree = Tree(build_problem(offered, replace(offered.study.wanted, weights=((term, 1.0),), sets=sets)))
    tree.run(time.perf_counter() + GIVE_UP, lambda done, total, text: None)
    return time.process_time() - start, tree.finished
