"""Sets of drives judged one by one: the plain way through pinocchio, the compiled judge, the machine's limits."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pinocchio as pin
from inverse_dynamics import along_z

from drivetrain.drive.drive import Drive
from drivetrain.sizing.judge.operation import Operation
from drivetrain.sizing.judge.parts import FilledParts
from drivetrain.sizing.judge.verdicts import checks_of
from drivetrain.sizing.search.candidates import Candidates
from drivetrain.sizing.search.problem import build_problem
from drivetrain.sizing.search.tree import NO_TEST_LIMIT, Tree
from drivetrain.spatial.rotations import frame_along
from drivetrain.study.model import DriveMass
from drivetrain.study.parts.mounting import carrier_link, carrying, drive_body, emptied, mount_point, seat
from drivetrain.study.parts.verdicts import Verdict


class Plainly:
    """The plain way: the drives put into the arm's links, ``rnea`` at every sample, then the same checks."""

    def __init__(self, offered: Candidates) -> None:
        self.offered, self.study = offered, offered.study
        self.filled_parts = FilledParts(self.study)
        cycle, arm = self.study.cycle, emptied(self.study)
        self.samples = list(zip(cycle.position, cycle.velocity, cycle.acceleration, cycle.payload, strict=True))
        self.models = {tip: along_z(carrying(self.study, arm, tip)) for tip in sorted(set(cycle.payload.tolist()))}
        self.data = {tip: model.createData() for tip, model in self.models.items()}
        self.bare = {tip: [pin.Inertia(one) for one in model.inertias] for tip, model in self.models.items()}
        turned = [frame_along(screw[:3]) for screw in arm.screws]  # how along_z turns the frames of the joints
        self.places = []
        for joint, task in enumerate(self.study.joints):
            link = carrier_link(arm, joint, task.mount)
            away = mount_point(arm, joint, task.mount) - arm.joint_points[max(link, 0)]
            axis = turned[max(link, 0)].T @ arm.axes[seat(joint, task.mount)]
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
        drives = {j: self.filled_parts.drive(joints[j], *self.offered.keys(int(pair))) for j, pair in enumerate(pairs)}
        found = self.torques(drives)
        for joint in reversed(range(len(joints))):
            after = {k: drive for k, drive in drives.items() if k >= joint}
            demand = self.offered.work.at(joint, {}).demand(after[joint])
            demand = replace(demand, gear_torque=found[:, joint])
            checks = checks_of(Operation(demand, drives[joint], self.study, joint))
            if any(check.verdict is Verdict.FAIL for check in checks):
                return False
        return True


class Compiled:
    """The judge of the search, and which pairs hold under the lightest load that the others can leave them."""

    def __init__(self, offered: Candidates) -> None:
        self.problem = build_problem(offered, replace(offered.study.wanted, sets=1))
        start = time.process_time()
        root = Tree(self.problem).propagate(self.problem.domains(), NO_TEST_LIMIT, None)
        self.pools = (
            [np.zeros(0, dtype=np.int64)] * self.problem.n if root is None else [one.pairs for one in root.domains]
        )
        self.possible = np.zeros(len(offered.pairs), dtype=np.bool_)
        self.possible[np.concatenate(self.pools)] = True
        self.preparation = time.process_time() - start
        self.order = np.argsort([len(pool) for pool in self.pools])  # the most critical joint first

    def holds(self, sets: np.ndarray, *, possible: bool = True) -> np.ndarray:
        """Which of many sets hold, (M,): first what no other drive can fix, then joint by joint."""
        out = self.possible[sets].all(axis=1) if possible else np.ones(len(sets), dtype=np.bool_)
        offered = self.problem.candidates
        for row in np.flatnonzero(out):
            numbers = offered.parameters[sets[row]]
            for joint in self.order:
                found = offered.judge(joint, sets[row, joint : joint + 1], numbers, until=1.0, quick=True)
                if found.utilisation[0] > 1.0 or found.missing_check[0] >= 0:
                    out[row] = False
                    break
        return out


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
