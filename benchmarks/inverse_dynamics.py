"""Inverse dynamics of a six-axis arm along a trajectory, side by side with pinocchio and MuJoCo.

One process, one thread. Every competitor gets its samples in the layout it likes best, outside the measured time; the
package is measured as a user calls it, checks and allocation included. The runs are interleaved and the medians
of processor time compared, because machines are noisy: read the ratios, not the microseconds.

    python benchmarks/inverse_dynamics.py [--samples 10000] [--repeats 21] [--arm ur5-corrected] [--check]
"""

from __future__ import annotations

import argparse
import gc
import platform
import sys
import time
from collections.abc import Callable
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np
import pinocchio as pin

import drivetrain as dt
from drivetrain.spatial.rotations import frame_along

# The same arm in the other libraries' terms is made by what the agreement tests use.
sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "agreement"))

from in_mujoco import InMujoco
from in_pinocchio import InPinocchio

TARGETS = {"pinocchio rnea, Python loop": 25.0, "pinocchio rneaInParallel, 1 thread": 12.0}
ROTOR_COST = 0.15
OBLIQUE_COST = 0.05
AGREEMENT = 1e-10


class Row(NamedTuple):
    """One way to compute the torques: what it is called, the call, and what its result should equal."""

    name: str
    run: Callable[[], np.ndarray]
    wanted: np.ndarray
    ours: bool


def main(arguments: list[str] | None = None) -> int:
    """Measure, print the table, and with --check say by the exit code whether the targets are met."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--samples", type=int, default=10_000, help="samples of the trajectory, default 10000")
    parser.add_argument("--repeats", type=int, default=21, help="interleaved runs of each, default 21")
    parser.add_argument("--arm", default="ur5-corrected", help="a built-in arm or a file, default ur5-corrected")
    parser.add_argument("--check", action="store_true", help="exit 1 when a target is missed")
    options = parser.parse_args(arguments)
    bare = dt.with_rotors(arm := dt.load_arm(options.arm), [None] * arm.n)
    motion = trajectory(bare.n, options.samples)
    rows = contestants(bare, motion)
    times = measure(rows, options.repeats)
    agreement = {row.name: error(row.run(), row.wanted) for row in rows}
    print(header(bare, options.samples, options.repeats))
    print(table(rows, times, agreement, options.samples))
    met = verdicts(times, agreement)
    print("\n".join(f"{'met   ' if good else 'MISSED'}  {text}" for text, good in met))
    return int(options.check and not all(good for _, good in met))


def trajectory(n: int, samples: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A smooth motion of several sines, as (N, n) positions, speeds and accelerations."""
    rng = np.random.default_rng(0)
    t = np.linspace(0.0, 4.0, samples)[:, None, None]
    rates = 0.5 * np.pi * np.arange(1, 5)
    size = rng.uniform(-1.2, 1.2, (n, 4)) / np.arange(1, 5)
    angle = rates * t + rng.uniform(0.0, 2 * np.pi, (n, 4))
    sine, cosine = size * np.sin(angle), size * np.cos(angle)
    return sine.sum(-1), (rates * cosine).sum(-1), -(rates**2 * sine).sum(-1)


def geared(bare: dt.Arm, kind: str) -> dt.Arm:
    """The arm with a rotor at every joint: on its axis, oblique and balanced, or oblique and unbalanced."""
    if kind == "on the joint axes":
        return dt.with_rotors(bare, [dt.Rotor(100.0, 5e-5, 0.4)] * bare.n)
    axis = np.array([0.36, 0.48, 0.8])
    lines = [np.concatenate([axis, np.cross(point, axis)]) for point in bare.joint_points]
    if kind == "oblique":
        return dt.with_rotors(bare, [dt.Rotor(100.0, 5e-5, 0.4, screw=line) for line in lines])
    tensor = np.diag([3e-5, 4e-5, 5e-5])
    return dt.with_rotors(bare, [dt.Rotor(100.0, tensor, 0.4, screw=line) for line in lines])


def contestants(bare: dt.Arm, motion: tuple[np.ndarray, np.ndarray, np.ndarray]) -> list[Row]:
    """Everything that is measured; the first is what the others are compared with."""
    other, model = InMujoco(bare), along_z(bare)
    data = model.createData()
    samples = list(zip(*motion, strict=True))
    wanted = np.array([pin.rnea(model, data, *sample) for sample in samples])
    columns = [np.asfortranarray(values.T) for values in motion]
    torque, pool = np.zeros(columns[0].shape, order="F"), pin.ModelPool(model, 1)
    out = np.empty(motion[0].shape)

    def loop() -> np.ndarray:
        for k, (q, qd, qdd) in enumerate(samples):
            out[k] = pin.rnea(model, data, q, qd, qdd)
        return out

    def parallel() -> np.ndarray:
        pin.rneaInParallel(1, pool, *columns, torque)
        return torque.T

    def inverse() -> np.ndarray:
        m, d = other.model, other.data
        for k, (q, qd, qdd) in enumerate(samples):
            d.qpos[:], d.qvel[:], d.qacc[:] = q, qd, qdd
            mujoco.mj_inverse(m, d)
            out[k] = d.qfrc_inverse
        return out

    rows = [Row("drivetrain, rotors off", partial(dt.inverse_dynamics, bare, *motion), wanted, True)]
    for kind in ("on the joint axes", "oblique", "unbalanced"):
        arm = geared(bare, kind)
        run = partial(dt.inverse_dynamics, arm, *motion)
        rows.append(Row(f"drivetrain, rotors {kind}", run, by_bodies(arm, samples), True))
    rows.append(Row("pinocchio rneaInParallel, 1 thread", parallel, wanted, False))
    rows.append(Row("pinocchio rnea, Python loop", loop, wanted, False))
    rows.append(Row("MuJoCo mj_inverse, Python loop", inverse, wanted, False))
    return rows


def along_z(arm: dt.Arm) -> pin.Model:
    """The arm in pinocchio with every joint along its frame's z axis, which pinocchio computes fastest."""
    model, frames = pin.Model(), [pin.SE3.Identity()]
    model.gravity.linear = arm.gravity
    for i, screw in enumerate(arm.screws):
        turning = bool(screw[:3].any())
        frames.append(pin.SE3(frame_along(screw[:3] if turning else screw[3:]), arm.joint_points[i]))
        kind = pin.JointModelRZ() if turning else pin.JointModelPZ()
        joint = model.addJoint(i, kind, frames[-2].actInv(frames[-1]), arm.joint_names[i])
        centre = frames[-1].actInv(pin.SE3(arm.home[i]))
        body = pin.Inertia(float(arm.masses[i]), np.zeros(3), arm.inertias[i])
        model.appendBodyToJoint(joint, body, centre)
    return model


def by_bodies(arm: dt.Arm, samples: list[tuple[np.ndarray, ...]]) -> np.ndarray:
    """Generalised torques by pinocchio with rotors as bodies; every 50th sample, the rest NaN."""
    twin, ratios = InPinocchio(arm), np.array([rotor.ratio for rotor in arm.rotors])
    result = np.full((len(samples), arm.n), np.nan)
    for k in range(0, len(samples), 50):
        result[k] = twin.torques(*samples[k])[1] * ratios
    return result


def measure(rows: list[Row], repeats: int) -> dict[str, float]:
    """Median seconds of each, in turns of changing order, caches warmed; what is quick is run several times a turn."""
    found: dict[str, list[float]] = {row.name: [] for row in rows}
    order = np.random.default_rng(0)
    gc.disable()
    for _ in range(repeats):
        for row in (rows[i] for i in order.permutation(len(rows))):
            row.run()
            for _ in range(9 if row.ours else 1):
                start = time.process_time()
                row.run()
                found[row.name].append(time.process_time() - start)
    gc.enable()
    return {name: float(np.median(times)) for name, times in found.items()}


def error(found: np.ndarray, wanted: np.ndarray) -> float:
    """Largest difference over the largest torque, where something is wanted."""
    given = ~np.isnan(wanted)
    return float(np.abs(found - wanted)[given].max() / np.abs(wanted[given]).max())


def header(arm: dt.Arm, samples: int, repeats: int) -> str:
    """What was measured, where, with which versions."""
    names = ("numpy", "numba", "pin", "mujoco")
    versions = ", ".join(f"{name} {version(name)}" for name in names)
    return (
        f"Inverse dynamics, {arm.n} axes ({arm.name}), N = {samples}, medians of {repeats} turns, one thread\n"
        f"{platform.machine()}, Python {platform.python_version()}, drivetrain {dt.__version__}, {versions}\n"
    )


def table(rows: list[Row], times: dict[str, float], agreement: dict[str, float], samples: int) -> str:
    """One line each: microseconds a sample, and times slower than the first."""
    best = times[rows[0].name]
    width = max(len(row.name) for row in rows)
    lines = [f"{'':{width}}  us/sample  times the first  against pinocchio"]
    for row in rows:
        own = times[row.name]
        lines.append(f"{row.name:{width}}  {own / samples * 1e6:9.4f}  {own / best:15.2f}  {agreement[row.name]:17.1e}")
    return "\n".join(lines) + "\n"


def verdicts(times: dict[str, float], agreement: dict[str, float]) -> list[tuple[str, bool]]:
    """The targets, each with what was found."""
    best = times["drivetrain, rotors off"]
    found = [
        (f"{times[name] / best:.1f} times faster than {name} (at least {goal:.0f})", times[name] / best >= goal)
        for name, goal in TARGETS.items()
    ]
    cost = times["drivetrain, rotors on the joint axes"] / best - 1.0
    found.append((f"rotors cost {100 * cost:+.1f} % (at most {100 * ROTOR_COST:.0f} %)", cost <= ROTOR_COST))
    more = times["drivetrain, rotors oblique"] / times["drivetrain, rotors on the joint axes"] - 1.0
    found.append(
        (f"oblique rotors cost {100 * more:+.1f} % more (at most {100 * OBLIQUE_COST:.0f} %)", more <= OBLIQUE_COST)
    )
    worst = max(agreement.values())
    found.append((f"all agree with pinocchio to {worst:.1e} (at most {AGREEMENT:.0e})", worst <= AGREEMENT))
    return found


if __name__ == "__main__":
    sys.exit(main())
