"""Modern Robotics figures 8.7 and 8.8: the signals of an n-joint robot, and its controller at samples of 1 ms."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import drivetrain as dt

MOTOR = dt.Motor(key="48 V", resistance=0.299, torque_constant=0.0302, inductance=82e-6, rotor_inertia=1.4e-5)
RATIO, ROTOR, COUNTS = 100.0, 3.3e-5, 4096
BOXES = {  # place, text: figure 8.7 above, one axis of it, figure 8.8, below
    (0.0, 1.0): "desired motion", (2.0, 1.0): "controller with\nmodel of the arm",
    (4.0, 1.0): "amplifier\n+ current sensor", (4.0, 2.0): "power supply, DC", (6.0, 1.0): "motor\n+ encoder",
    (0.0, -1.0): "encoder",
    (1.5, -1.0): "motor", (3.0, -1.0): "gearhead", (4.5, -1.0): "bearing", (6.0, -1.0): "link i + 1",
}  # fmt: skip
WIRES = [  # from, to, label, line width: bold is power
    ((0.5, 1), (1.42, 1), "q, q', q''", 1), ((2.58, 1), (3.45, 1), "currents\nwanted", 1),
    ((4, 1.88), (4, 1.25), "", 3), ((4.55, 1), (5.6, 1), "current", 3), ((0.35, -1), (1.22, -1), "", 2),
    ((1.78, -1), (2.6, -1), "", 2), ((3.42, -1), (4.15, -1), "", 2), ((4.85, -1), (5.62, -1), "", 2),
]  # fmt: skip


def draw_blocks(axes: Axes) -> None:
    """Boxes and wires; a bold line carries power, a thin one tells."""
    arrow, box = {"arrowstyle": "->", "color": "0.4", "shrinkA": 0, "shrinkB": 0}, {"boxstyle": "round", "fc": "white"}
    for start, end, label, width in WIRES:
        axes.annotate("", end, start, arrowprops={**arrow, "lw": width})
        axes.text((start[0] + end[0]) / 2, (start[1] + end[1]) / 2 + 0.12, label, ha="center", fontsize=7)
    axes.plot([6.0, 6.0, 2.0], [0.75, 0.1, 0.1], "0.4", linewidth=1)
    axes.annotate("", (2.0, 0.75), (2.0, 0.08), arrowprops=arrow)
    axes.text(4.0, 0.17, "angles measured", ha="center", fontsize=7)
    for (x, y), text in BOXES.items():
        axes.text(x, y, text, ha="center", va="center", fontsize=8, bbox=box)
    axes.text(3.0, -1.75, "cases of encoder, motor, gearhead and bearing are fixed in link i", ha="center", fontsize=7)
    axes.set(xlim=(-0.8, 6.8), ylim=(-2.0, 2.5))
    axes.set_axis_off()


def main(picture: Path) -> None:
    arm = dt.with_rotors(dt.load_arm("planar-2r"), [dt.Rotor(RATIO, ROTOR)] * 2)
    u, far = np.linspace(0.0, 1.0, 201)[:, None], np.array([1.0, -1.5])
    q, qd, qdd = 10 * u**3 - 15 * u**4 + 6 * u**5, 30 * u**2 * (1 - u) ** 2, 60 * u * (1 - u) * (1 - 2 * u)
    motion = dt.Motion("reach", arm.joint_names, u[:, 0], q * far, qd * far, qdd * far)
    drive = (dt.Encoder(COUNTS), dt.SampledCurrentLoop(MOTOR, 3000.0, peak_current=30.0), dt.Winding(MOTOR))
    constants = tuple((name, MOTOR.torque_constant) for name in arm.joint_names)
    figure = Figure(figsize=(8.0, 8.0), layout="constrained")
    blocks, rows = figure.subplots(2, 1, height_ratios=(1.1, 1.0))
    draw_blocks(blocks)
    for every, delay in ((1e-3, 0), (1e-3, 1), (4e-3, 1)):
        servo = dt.SampledComputedTorque(60.0, constants, every, delay)
        whole = (dt.CommandedMotion(motion), dt.StiffSupply(48.0), servo)
        run = dt.simulate(dt.Scene(arm, {**dict.fromkeys(arm.joint_names, drive), "scene": whole}, 1.2, name="2R"))
        error = 1e3 * (run["joint_1.command_position"] - run["joint_1.position"])
        rows.plot(run.time, error, label=f"samples of {1e3 * every:g} ms, given out {delay} later")
        print(f"samples of {1e3 * every:g} ms given out {delay} later: off by {np.abs(error).max():.3f} mrad at most")
    rows.set(xlabel="time [s]", ylabel="joint 1 behind its command [mrad]")
    rows.legend()
    figure.savefig(picture, dpi=120)
    print(f"drew {picture}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(Path(__file__).stem + ".png"))
