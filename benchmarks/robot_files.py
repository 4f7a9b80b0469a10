"""Chains of URDF files against pinocchio: inverse dynamics at random states, and what the reader refuses.

From each file some end links are taken as tips. Rotors and couplings of the files are left out.

    python benchmarks/robot_files.py FOLDER [--tips 4]
"""

from __future__ import annotations

import argparse
import random
import warnings
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

import drivetrain as dt


def main() -> None:
    """Compare the files and print the counts."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("folder", type=Path, help="is searched for .urdf files")
    parser.add_argument("--tips", type=int, default=4, help="most end links of a file, default 4")
    options = parser.parse_args()
    warnings.simplefilter("ignore", dt.PhysicsWarning)
    draw, differences, refused, still, unread = random.Random(0), [], [], 0, 0
    for file in sorted(options.folder.rglob("*.urdf")):
        try:
            ends, model = end_links(file), pin.buildModelFromUrdf(str(file))
        except (ElementTree.ParseError, ValueError):
            unread += 1
            continue
        for tip in draw.sample(ends, min(options.tips, len(ends))):
            try:
                differences.append((difference(dt.load_arm(file, tip=tip), model), f"{file.name}, {tip}"))
            except dt.InputError as error:
                still += "no movable joint" in str(error)
                refused += [] if "no movable joint" in str(error) else [f"{file.name}: {error.faults[0].problem}"]
    print(f"{len(differences)} chains, largest difference {max(differences)[0]:.1e} ({max(differences)[1]})")
    print(f"{still} end links without a movable joint before them; {unread} files that pinocchio cannot read")
    for line in dict.fromkeys(refused):
        print(f"refused: {line}")


def end_links(file: Path) -> list[str]:
    """The links that carry no other."""
    joints = ElementTree.parse(file).getroot().findall("joint")
    ends = {end: {one.get("link", "") for j in joints for one in j.findall(end)} for end in ("parent", "child")}
    return sorted(ends["child"] - ends["parent"])


def difference(arm: dt.Arm, model: pin.Model) -> float:
    """Largest difference of the torques, relative to the largest torque."""
    whole = {model.names[i]: i for i in range(1, model.njoints)}  # joints beside the chain stay at rest at zero
    q, qd, qdd = np.random.default_rng(0).uniform(-1.0, 1.0, (3, arm.n))
    states = [pin.neutral(model), np.zeros(model.nv), np.zeros(model.nv)]
    for name, *values in zip(arm.joint_names, q, qd, qdd, strict=True):
        joint = model.joints[whole[name]]
        turn = [np.cos(values[0]), np.sin(values[0])] if joint.nq == 2 else values[:1]
        states[0][joint.idx_q : joint.idx_q + joint.nq] = turn
        states[1][joint.idx_v], states[2][joint.idx_v] = values[1:]
    model = model.copy()
    model.rotorInertia[:], model.armature[:] = 0.0, 0.0
    torque = pin.rnea(model, model.createData(), *states)
    theirs = np.array([torque[model.joints[whole[name]].idx_v] for name in arm.joint_names])
    ours = dt.inverse_dynamics(dt.with_rotors(arm, [None] * arm.n), q, qd, qdd)
    return float(np.abs(ours - theirs).max() / max(np.abs(theirs).max(), 1e-12))


if __name__ == "__main__":
    main()
