"""Modern Robotics 8.9.5: how far strain-wave gears and bending links let a UR5-class arm's tip give way, and swing."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from figures.flexibility import figure_flexibility

from drivetrain.arm.flexible_links import BendingLink, with_flexible_links
from drivetrain.dynamics.flexibility import locked_frequencies
from drivetrain.sizing.deflection import joint_stiffness, tip_deflection, vibration
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.spatial.beams import Beam, round_tube
from drivetrain.study.parts.mounting import loaded_arm
from drivetrain.study.read import load_study
from drivetrain.whole_files import shipped

STRONG, WEAK = "AM_MF0060020_48V", "AM_MF0060008_48V"
GEARS = ("CSG-17-100", "CSG-25-160", "CSG-17-100", "CSG-14-100", "CSG-14-100", "CSG-14-100")


def main(picture: Path) -> None:
    study = load_study(shipped("examples") / "ur5_pick_and_place" / "study.yaml")
    motors = (WEAK, STRONG, STRONG, WEAK, WEAK, WEAK)
    names = [task.name for task in study.joints]
    pairs = {n: (motor, f"hd_{gear}-2UH") for n, motor, gear in zip(names, motors, GEARS, strict=True)}
    evaluation = evaluate(study, pairs)

    # The two long links as aluminium tubes between their joints (E = 70 GPa, G = 26 GPa).
    points = study.arm.joint_points
    tube = {1: round_tube(0.086, 0.080, 70e9, 26e9), 2: round_tube(0.074, 0.068, 70e9, 26e9)}
    beams = {i: Beam(section, points[i], points[i + 1]) for i, section in tube.items()}
    found = tip_deflection(evaluation, beams=beams)
    worst = int(np.argmax(found.size))
    print(f"largest deflection of the tip: {1e3 * found.size[worst]:.2f} mm at {found.time[worst]:.2f} s")
    for name, part in zip(names, found.joints[worst], strict=True):
        print(f"  {name:20s} {1e3 * np.linalg.norm(part):6.3f} mm from its gear's spring")
    for i in beams:
        print(f"  {found.link_names[i]:20s} {1e3 * np.linalg.norm(found.links[worst, i]):6.3f} mm from bending")
    print(f"if all pointed one way: {1e3 * found.worst_case[worst]:.2f} mm; no backlash is on these gears' sheets")

    swings = vibration(evaluation)
    print(f"lowest natural frequency, motors holding: {swings.locked.min():.1f} to {swings.locked[:, 0].max():.1f} Hz;"
          f" motors of constant torque: {swings.free.min():.1f} Hz and more")  # fmt: skip
    drives = {name: joint.drive for name, joint in evaluation.joints.items()}
    arm = loaded_arm(study, drives, int(study.cycle.payload[worst]))
    sprung = with_flexible_links(arm, {i: BendingLink(beam, mass=0.5) for i, beam in beams.items()})
    stiffness = sprung.stiffness.copy()
    stiffness[list(sprung.driven)] = joint_stiffness(evaluation)[worst]
    together = locked_frequencies(sprung.arm, sprung.widened(study.cycle.position[worst]), stiffness)
    print(f"at that instant: {swings.locked[worst, 0]:.2f} Hz on gears alone, {together[0]:.2f} Hz with bending links")
    figure_flexibility(found, swings).savefig(picture, dpi=150, facecolor="white")
    print(f"drew {picture}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(Path(__file__).stem + ".png"))
