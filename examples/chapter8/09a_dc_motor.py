"""Modern Robotics 8.9.1: what a DC motor can do within a voltage and a current, and behind a gear; rated power."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import drivetrain as dt
from drivetrain.drive.amplifier import Amplifier
from drivetrain.drive.motor import no_load_speed, stall_torque, terminal_voltage
from drivetrain.drive.motor_limits import continuous_current, continuous_region, operating_region

MOTOR = dt.Motor(
    key="0.3 ohm", nominal_voltage=48.0, resistance=0.299, torque_constant=0.0302, max_winding_temperature=155.0,
    nominal_current=6.0, resistance_winding_housing=1.9, resistance_housing_ambient=4.65,
)  # fmt: skip
AMPLIFIER = Amplifier(peak_current=20.0, modulation=1.0)
VOLTS, COLD, RATIO = 48.0, 25.0, 2.0


def main(picture: Path) -> None:
    kt, resistance = MOTOR.torque_constant, MOTOR.resistance
    lasting = continuous_current(MOTOR, COLD)
    torque = kt * lasting.value
    speed = (VOLTS - resistance * lasting.value) / kt  # equation 8.102 without the inductance
    print(f"no-load speed {no_load_speed(MOTOR):.0f} rad/s, stall torque {stall_torque(MOTOR):.2f} N m")
    print(f"continuous torque {torque:.3f} N m ({lasting.source}), there {speed:.0f} rad/s")
    print(f"rated mechanical power {torque * speed:.0f} W")
    asked = terminal_voltage(MOTOR, np.array([speed]), np.array([lasting.value]), np.array([0.0]), COLD, COLD)
    print(f"equation 8.102 asks {asked[0]:.6f} V of {VOLTS:g} V there")

    short = operating_region(MOTOR, AMPLIFIER, VOLTS, COLD, COLD)
    lasts = continuous_region(MOTOR, AMPLIFIER, VOLTS, lasting.value, COLD, COLD)
    figure = Figure(figsize=(9.0, 4.8), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.fill(short[:, 1], short[:, 0], color="0.75", label=f"20 A, {VOLTS:g} V for a short time")
    left.fill(lasts[:, 1], lasts[:, 0], color="0.9", label="continuous")
    curve = np.array([0.0, stall_torque(MOTOR)])
    left.plot(curve, no_load_speed(MOTOR) - resistance / kt**2 * curve, "C0--", label="speed-torque curve of 48 V")
    left.plot(torque, speed, "C3o", label=f"rated power {torque * speed:.0f} W")
    left.set(title="the motor, figure 8.10", xlim=(-0.8, 1.6))
    right.fill(RATIO * short[:, 1], short[:, 0] / RATIO, color="0.75", label=f"behind a gear of {RATIO:g}:1")
    right.plot(short[:, 1], short[:, 0], "C0", label="the motor")
    hot = operating_region(MOTOR, AMPLIFIER, VOLTS, 155.0, 100.0)
    right.plot(hot[:, 1], hot[:, 0], "C3--", label="the motor at 155 °C, magnets at 100 °C")
    right.set(title="geared, figure 8.11")
    for axes in (left, right):
        axes.axhline(0.0, color="0.4", linewidth=0.7)
        axes.axvline(0.0, color="0.4", linewidth=0.7)
        axes.set(xlabel="torque [N m]", ylabel="speed [rad/s]")
        axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2)
    figure.savefig(picture, dpi=150)
    print(f"drew {picture}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(Path(__file__).stem + ".png"))
