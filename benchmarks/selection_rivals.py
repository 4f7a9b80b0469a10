"""Sets of drives judged one by one: the plain way through pinocchio, the compiled judge, the machine's limits."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numba
import numpy as np
import pinocchio as pin
from inverse_dynamics import along_z

from drivetrain.drive.drive import Drive
from drivetrain.sizing.demand.load_kernels import load_joint, new_load
from drivetrain.sizing.judge.fill import Shelf
from drivetrain.sizing.judge.judge import judge
from drivetrain.sizing.judge.judge_kernels import HOLDS, judge_exact
from drivetrain.sizing.judge.operation import operation
from drivetrain.sizing.judge.packed_task import Packed
from drivetrain.sizing.search.choices import all_choices, segment
from drivetrain.sizing.search.problem import problem
from drivetrain.sizing.search.search_tree import Tree
from drivetrain.spatial.rotations import frame_along
from drivetrain.study.model import DriveMass
from drivetrain.study.mounting import carrier_link, carrying, drive_body, emptied, joint_axis, mount_point
from drivetrain.study.verdicts import Verdict

DEPTH = 32  # multiply-adds of a number between its load and its store


class Plainly:
    """The plain way: the drives put into the arm's links, ``rnea`` at every sample, then the same checks."""

    def __init__(self, packed: Packed) -> None:
        self.packed, self.study = packed, packed.study
        self.shelf = Shelf(self.study)
        cycle, arm = self.study.cycle, emptied(self.study)
        self.samples = list(zip(cycle.position, cycle.velocity, cycle.acceleration, cycle.payload, strict=True))
        self.models = {tip: along_z(carrying(self.study, arm, tip)) for tip in sorted(set(cycle.payload.tolist()))}
        self.data = {tip: model.createData() for tip, model in self.models.items()}
        self.bare = {tip: [pin.Inertia(one) for one in model.inertias] for tip, model in self.models.items()}
        turned = [frame_along(screw[:3]) for screw in arm.screws]  # how along_z turns the frames of the joints
        self.places = []
        for joint, task in enumerate(self.study.joints):
            link = carrier_link(joint, task.mount)
            away = mount_point(arm, joint, task.mount) - arm.joint_points[max(link, 0)]
            axis = turned[max(link, 0)].T @ joint_axis(arm, joint)
            self.places.append((link, turned[max(link, 0)].T @ away, np.outer(axis, axis)))

    def torques(self, drives: dict[int, Drive]) -> np.ndarray:
        """Torque at every joint and sample [N m], (N, n); the couple of spinning rotors is left out."""
        for tip, model in self.models.items():
            for i, bare in enumerate(self.bare[tip]):
                model.inertias[i] = bare
            for joint, (link, place, along_axis) in enumerate(self.places):
                mass, across, along = drive_body(drives[joint])
                if link >= 0 and self.study.drive_mass is not DriveMass.INCLUDED:
                    tensor = across * np.eye(3) + (along - across) * along_axis
                    model.inertias[link + 1] += pin.Inertia(mass, place, tensor)
        pairs = {tip: (self.models[tip], self.data[tip]) for tip in self.models}
        return np.array([pin.rnea(*pairs[tip], q, qd, qdd) for q, qd, qdd, tip in self.samples])

    def holds(self, pairs: np.ndarray) -> bool:
        """Whether a set of drives holds, checked from the tip to the base until something fails."""
        joints = self.study.joints
        drives = {j: self.shelf.drive(joints[j], *self.packed.keys(int(pair))) for j, pair in enumerate(pairs)}
        found = self.torques(drives)
        for joint in reversed(range(len(joints))):
            after = {k: drive for k, drive in drives.items() if k >= joint}
            demand = self.packed.work.at(joint, {}).demand(after[joint])
            demand = replace(demand, gear_torque=found[:, joint])
            checks = judge(operation(self.study, joint, demand, drives[joint]), stop_at_fail=True)
            if any(check.verdict is Verdict.FAIL for check in checks):
                return False
        return True


@numba.njit(cache=True, error_model="numpy")
def judge_sets(task, sets, order, possible, drives, load, out):  # type: ignore[no-untyped-def]
    """Which sets of drives hold: first what no other drive can mend, then joint by joint."""
    for row in range(len(sets)):
        out[row] = True
        for joint in order:
            if not possible[sets[row, joint]]:
                out[row] = False
                break
        if not out[row]:
            continue
        for joint in range(len(order)):
            drives[joint] = task.numbers[sets[row, joint]]
        for joint in order:
            load_joint(task, joint, drives, load)
            if judge_exact(task, joint, sets[row, joint], load)[0] != HOLDS:
                out[row] = False
                break


class Compiled:
    """The compiled judge, and which pairs hold under the lightest load that the others can leave them."""

    def __init__(self, packed: Packed) -> None:
        self.packed, self.task = packed, packed.task
        self.load = new_load(packed.task)
        self.drives = np.zeros((len(packed.study.joints), packed.task.numbers.shape[1]))
        self.all = np.ones(len(packed.task.pairs), dtype=np.bool_)
        start = time.process_time()
        self.possible, self.pools = self._possible()
        self.preparation = time.process_time() - start
        self.order = np.array(np.argsort([len(pool) for pool in self.pools]))  # the most critical joint first

    def _possible(self) -> tuple[np.ndarray, list[np.ndarray]]:
        whole = problem(self.packed, replace(self.packed.study.wanted, sets=1))
        root = Tree(whole)._narrowed(all_choices(whole.known, whole.setting), np.iinfo(np.int64).max, None)
        mask = np.zeros(len(self.task.pairs), dtype=np.bool_)
        pools = [np.zeros(0, dtype=np.int64)] * len(self.drives)
        if root is not None:
            pools = [segment(root.choices, joint).copy() for joint in range(len(self.drives))]
            mask[np.concatenate(pools)] = True
        return mask, pools

    def holds(self, sets: np.ndarray, *, possible: bool = True) -> np.ndarray:
        """Which of many sets hold, (M,)."""
        out = np.empty(len(sets), dtype=np.bool_)
        mask = self.possible if possible else self.all
        judge_sets(self.task, sets, self.order, mask, self.drives, self.load, out)
        return out

    def gather(self, joint: int) -> None:
        """The torque of one joint from its basis."""
        load_joint(self.task, joint, self.drives, self.load)


def random_sets(pools: list[np.ndarray], count: int, seed: int) -> np.ndarray:
    """Sets of drives, each joint's drawn evenly from its pool.

    Args:
        pools: Pairs of each joint.
        count: How many sets.
        seed: Of the draw.

    Returns:
        Pairs, (count, n).
    """
    rng = np.random.default_rng(seed)
    return np.column_stack([pool[rng.integers(len(pool), size=count)] for pool in pools])


# ---------------------------------------------------------------- what the machine can do


@numba.njit(cache=True, fastmath=True)
def _triad(a, b, c, scale):  # type: ignore[no-untyped-def]
    for i in range(len(a)):
        a[i] = b[i] + scale * c[i]


@numba.njit(cache=True, fastmath={"contract"})
def _multiply_add(a, out, weight, more):  # type: ignore[no-untyped-def]
    for i in range(len(a)):
        x = a[i]
        y, z = x + 1.0, x + 2.0
        for _ in range(DEPTH):
            x = x * weight + more
            y = y * weight + more
            z = z * weight + more
        out[i] = x + y + z


def triad_rate(size: int) -> float:
    """What memory or cache delivers: a = b + s c.

    Args:
        size: Of each of the three arrays, numbers.

    Returns:
        [bytes/s], two read and one written.
    """
    a, b, c = np.zeros(size), np.ones(size), np.ones(size)
    turns = max(1, 4_000_000 // size)

    def run() -> None:
        for _ in range(turns):
            _triad(a, b, c, 3.0)

    return 24.0 * size * turns / median_time(run, 9)


def multiply_add_rate() -> float:
    """What one core computes: multiply-adds in registers.

    Returns:
        [floating-point operations/s], two a multiply-add.
    """
    a, out = np.ones(2048), np.ones(2048)

    def run() -> None:
        for _ in range(100):
            _multiply_add(a, out, 0.999, 1.0)

    return 2.0 * 3 * DEPTH * 2048 * 100 / median_time(run, 9)


def median_time(run: Callable[[], object], repeats: int) -> float:
    """Median processor time of several runs after one that does not count.

    Args:
        run: What is measured.
        repeats: How often.

    Returns:
        [s].
    """
    run()
    found = []
    for _ in range(repeats):
        start = time.process_time()
        run()
        found.append(time.process_time() - start)
    return float(np.median(found))
