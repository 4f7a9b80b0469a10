"""The README's validation table: ours against pinocchio, MuJoCo, the book's equations, measurements, printed numbers.

Run with ``python benchmarks/validation.py``; needs the test extras. Every line says what was compared, on what, and
the largest difference found; the tests hold the same comparisons with bounds.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pinocchio as pin
from scipy.signal import savgol_filter

import drivetrain as dt
from drivetrain.catalog.read import read_catalog
from drivetrain.drive.drive import Drive, book_current, motor_torque
from drivetrain.drive.gear import Gear, average_torque
from drivetrain.drive.motor import Motor, torque_constant
from drivetrain.drive.motor_limits import thermal_limit_current
from drivetrain.records import UNKNOWN, as_record, known

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests" / "agreement"), str(ROOT / "tests" / "published")]

from book_newton_euler import book_torques  # noqa: E402
from in_mujoco import InMujoco  # noqa: E402
from in_pinocchio import InPinocchio  # noqa: E402
from random_arms import motion, random_arm, rotors_of  # noqa: E402

Row = tuple[str, str, str]


def relative(found: np.ndarray, wanted: np.ndarray) -> float:
    """Largest difference over the largest value."""
    return float(np.abs(np.asarray(found) - wanted).max() / np.abs(wanted).max())


def rigid_bodies() -> Iterator[Row]:
    """Six-axis arms without rotors against the two dynamics libraries."""
    arms = [random_arm(seed) for seed in range(20)] + [dt.load_arm("ur5")]
    torque, mass, acceleration, mujoco = [], [], [], []
    for seed, arm in enumerate(arms):
        q, qd, qdd = motion(seed, arm.n, count=50)
        peer, other = InPinocchio(arm), InMujoco(arm)
        ours = dt.inverse_dynamics(arm, q, qd, qdd)
        theirs = np.array([pin.rnea(peer.model, peer.data, *x) for x in zip(q, qd, qdd, strict=True)])
        torque.append(relative(ours, theirs))
        mujoco.append(relative(ours, np.array([other.torque(*x) for x in zip(q, qd, qdd, strict=True)])))
        theirs = np.array([pin.crba(peer.model, peer.data, x) for x in q])
        theirs = np.triu(theirs) + np.swapaxes(np.triu(theirs, 1), 1, 2)
        mass.append(relative(dt.mass_matrix(arm, q), theirs))
        solved = np.array([pin.aba(peer.model, peer.data, *x) for x in zip(q, qd, ours, strict=True)])
        acceleration.append(relative(dt.forward_dynamics(arm, q, qd, ours), solved))
    what = "20 random six-axis arms and the UR5, 50 states each"
    yield "inverse dynamics", f"pinocchio `rnea`, {what}", f"{max(torque):.0e} relative"
    yield "inverse dynamics", "MuJoCo `mj_inverse`, the same", f"{max(mujoco):.0e} relative"
    yield "mass matrix", "pinocchio `crba`, the same", f"{max(mass):.0e} relative"
    yield "forward dynamics", "pinocchio `aba`, the same", f"{max(acceleration):.0e} relative"


def rotors() -> Iterator[Row]:
    """Rotors of every kind: oblique, offset, unbalanced, on any link, turning either way."""
    book, peer = [], []
    for seed in range(20):
        arm = dt.with_rotors(random_arm(seed, "RPHRRP"), rotors_of(seed, "mixed", 6))
        q, qd, qdd = motion(seed, arm.n, count=20)
        ours = dt.drive_torques(arm, q, qd, qdd)
        written = [book_torques(arm, *x, np.zeros(6)) for x in zip(q, qd, qdd, strict=True)]
        book.append(max(relative(ours.gear, np.array([g for g, _ in written])),
                        relative(ours.motor, np.array([m for _, m in written]))))  # fmt: skip
        model = InPinocchio(arm)
        bodies = np.array([model.torques(*x) for x in zip(q, qd, qdd, strict=True)])
        peer.append(max(relative(ours.gear, bodies[:, 0]), relative(ours.motor, bodies[:, 1])))
    what = "20 arms with revolute, prismatic and helical joints, 20 states each"
    yield (
        "gear and motor torque with rotors",
        f"equations 8.103 to 8.111 as written in the book, {what}",
        f"{max(book):.0e} relative",
    )
    yield (
        "gear and motor torque with rotors",
        "pinocchio with rotors as additional bodies, the same",
        f"{max(peer):.0e} relative",
    )
    arm = dt.load_arm("planar-2r")
    c = np.cos(0.7)
    wanted = np.array([[4.13125 + 2 * c, 1.0125 + c], [1.0125 + c, 1.125]])
    yield (
        "mass matrix of the 2R arm with motors",
        "Modern Robotics, section 8.9.2 (exact values)",
        f"{relative(dt.mass_matrix(arm, [0.3, 0.7]), wanted):.0e} relative",
    )


def measured() -> Iterator[Row]:
    """The recorded motor torques of a KUKA KR300."""
    from test_kr300_recording import OFFSET, RECORDING, SMOOTHING, counterbalance, friction

    recording = dict(np.load(RECORDING))
    q, qd, qdd = (savgol_filter(recording["q_motor_side_rad"] + OFFSET, deriv=k, **SMOOTHING) for k in range(3))
    joint_side = friction(recording, qd)
    joint_side[:, 1] += counterbalance(q[:, 1])
    ours = dt.drive_torques(dt.load_arm("kr300"), q, qd, qdd).motor + joint_side / recording["gear_ratio"]
    theirs = recording["motor_torque_Nm"]
    found = " ".join(f"{np.corrcoef(ours[:, i], theirs[:, i])[0, 1]:.3f}" for i in range(6))
    yield "motor torque", "KUKA KR300, 10 s recorded, axes 1 to 6, published parameters", f"correlation {found}"


def printed() -> Iterator[Row]:
    """Numbers on paper: a gear maker's worked example, motor sheets, the book's current."""
    speed, hours, torque = [10.0, 20.0, 10.0, 0.0], [0.2, 3.0, 0.3, 0.2], [150.0, 82.0, 130.0, 0.0]
    found = average_torque(3.0, np.array(torque), np.array(speed), np.array(hours))
    yield "average torque of a strain-wave gear", "manufacturer's worked example, printed 89 N m", f"{found:.2f} N m"
    motors = read_catalog().motors.values()
    for series in ("A-max", "DCX"):
        rows = [m for m in motors if m.maker == "maxon" and m.series.startswith(series)]
        pairs = [(thermal_limit_current(as_record(m), 25.0, UNKNOWN), m.nominal_current) for m in rows]
        gaps = [100 * (printed / ours - 1) for ours, printed in pairs if known(ours) and printed]
        yield (
            "continuous current from two thermal resistances",
            f"maxon {series}, {len(gaps)} data sheets, printed value compared with ours",
            f"median {np.median(gaps):+.1f} %",
        )
    motor = Motor("m", resistance=1.0, torque_constant=0.05, rotor_inertia=1e-5)
    drive = Drive(motor, Gear("g", ratio=100.0, kind="planetary", efficiency=0.7, inertia=1e-6))
    load, one = np.array([40.0]), np.array([1.0])
    still = np.array([0.0])
    book = book_current(drive, load, still, still, 25.0)[0]
    ours = motor_torque(drive, load, -one, still, still).total[0] / float(torque_constant(motor, 25.0))
    yield (
        "current to lower a load of 40 N m, efficiency 0.7",
        "the book's tau/(eta kt), which divides by eta for both directions of power",
        f"{ours:.2f} A instead of {book:.2f} A",
    )


def main() -> None:
    print("| quantity | compared with | result |\n|---|---|---|")
    for part in (rigid_bodies, rotors, measured, printed):
        for row in part():
            print("| " + " | ".join(row) + " |", flush=True)


if __name__ == "__main__":
    main()
