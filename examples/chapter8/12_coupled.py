"""Motors that work together: the Barrett WAM's differential, and an industrial wrist driven through hollow shafts."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np
from figures.coupling import figure_coupled_motors

import drivetrain as dt
from drivetrain.arm.coupling import belts_over, placed, rotor_turns
from drivetrain.dynamics.energy import power_balance
from drivetrain.export.urdf import write_urdf
from drivetrain.report.charts.plotting import house_style, png_bytes


def swing(n: int, joints: dict[int, float], duration: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Some joints to and fro by so many radians, each a little later than the one before."""
    t, rate = np.linspace(0.0, duration, 401)[:, None], 2.0 * np.pi / duration
    size, late = np.zeros(n), np.zeros(n)
    for place, (joint, angle) in enumerate(joints.items()):
        size[joint], late[joint] = angle, 0.6 * place
    phase = rate * t - late
    return size * np.sin(phase), size * rate * np.cos(phase), -size * rate**2 * np.sin(phase)


def main(picture: Path) -> None:
    # The maker publishes ratios, differentials and masses; 8e-5 kg m^2 is what rotors of such motors have.
    wam = dt.load_arm("wam")
    carriers = (-1, 0, 0, 0, 3, 3, 5)  # motors 2 to 4 ride in the shoulder, 5 and 6 in the forearm
    wam = dt.with_rotors(wam, [dt.Rotor(r.ratio, 8e-5, carrier=c) for r, c in zip(wam.rotors, carriers, strict=True)])
    print(f"WAM, motors 2 and 3 a turn of joints 2 and 3:\n{rotor_turns(wam)[1:3, 1:3].round(4)}")
    lifted = swing(7, {1: 0.8, 2: 0.5}, 2.0)
    drives, torque = dt.drive_torques(wam, *lifted), dt.inverse_dynamics(wam, *lifted)
    joints, motors = (np.abs(values[:, 1:3]).max(axis=0).round(3) for values in (torque, drives.motor))
    print(f"joints 2 and 3 ask for up to {joints} N m, motors 2 and 3 give up to {motors} N m")
    more = dt.mass_matrix(wam, np.zeros(7)) - dt.mass_matrix(dt.load_arm("wam"), np.zeros(7))
    print(f"their rotors add {more[1:3, 1:3].round(4).tolist()} kg m^2: reflected twice, and nothing off the diagonal")
    power = np.sum(drives.motor * (lifted[1] @ rotor_turns(wam).T), axis=1)
    print(f"power of motors less power of joints: {np.ptp(power - power_balance(wam, *lifted).joints.sum(1)):.0e} W")
    # A KR 300's links, with motors 4 to 6 on the forearm and tubes of equal bevel wheels through axes 4 and 5.
    robot = dt.load_arm("kr300")
    axis = robot.screws[3]
    rotors = [dt.Rotor(r.ratio, r.axial_inertia, screw=axis, carrier=2) if i > 2 else r
              for i, r in enumerate(robot.rotors)]  # fmt: skip
    wrist = dt.with_rotors(robot, rotors, coupling=placed(belts_over([1.0, 1.0]), (3, 4, 5), 6))
    print(f"wrist, motors 4 to 6 a turn of joints 4 to 6:\n{rotor_turns(wrist)[3:, 3:].round(2)}")
    turned = swing(6, {3: 1.2, 4: 0.9, 5: 1.5}, 4.0)
    fastest = np.abs(turned[1] @ rotor_turns(wrist).T).max(axis=0)[5], np.abs(turned[1][:, 5] * rotors[5].ratio).max()
    print(f"motor 6 must reach {fastest[0]:.0f} rad/s; with joint 6 to itself {fastest[1]:.0f} rad/s would do")
    with tempfile.TemporaryDirectory() as folder:
        print(f"URDF: {write_urdf(dt.at_level(wrist, dt.RotorLevel.NONE), Path(folder) / 'wrist.urdf')[-1]}")
    with house_style("coupled motors"):
        picture.write_bytes(png_bytes(figure_coupled_motors({"WAM": (wam, lifted), "hollow wrist": (wrist, turned)})))


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else f"{Path(__file__).stem}.png"))
