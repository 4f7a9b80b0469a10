"""Modern Robotics exercise 8.9 and beyond: which gear ratio suits a motor to a load, to a motion, and to all limits."""

from __future__ import annotations

import sys
from pathlib import Path

from drivetrain.drive.matching import inertia_matching_ratio
from drivetrain.report.charts.answer_charts import ratio_charts
from drivetrain.report.charts.plotting import figure_of
from drivetrain.report.pages.ratio_page import ratio_sentence
from drivetrain.sizing.answers.ratio import ratio_study
from drivetrain.study.read import load_study
from drivetrain.whole_files import shipped

STRONG, WEAK = "AM_MF0060020_48V", "AM_MF0060008_48V"
GEARS = ("CSG-17-100", "CSG-25-160", "CSG-17-100", "CSG-14-100", "CSG-14-100", "CSG-14-100")


def main(picture: Path) -> None:
    load, rotor, torque = 2.0, 5e-5, 0.5  # kg m^2, kg m^2, N m
    matched = inertia_matching_ratio(load, rotor)
    print(f"exercise 8.9: {load} kg m^2 behind a rotor of {rotor} kg m^2 is matched by a ratio of {matched:.0f}")
    for ratio in (0.5 * matched, matched, 2.0 * matched):
        acceleration = ratio * torque / (load + ratio**2 * rotor)
        print(f"  ratio {ratio:5.0f}: {torque} N m accelerates it by {acceleration:5.1f} rad/s^2")

    study = load_study(shipped("examples") / "ur5_pick_and_place" / "study.yaml")
    motors = (WEAK, STRONG, STRONG, WEAK, WEAK, WEAK)
    names = [task.name for task in study.joints]
    drives = {n: (motor, f"hd_{gear}-2UH") for n, motor, gear in zip(names, motors, GEARS, strict=True)}
    found = ratio_study(study, "shoulder_lift_joint", drives=drives)
    forms = found.closed_forms
    print("\na real motion: the shoulder of a UR5-class arm lifting 5 kg")
    print(f"  matched to the load's mean inertia:     {forms.matching:6.0f}")
    print(f"  least RMS torque, weight and friction:  {forms.least_rms:6.0f}   G^4 = mean(T^2) / (J^2 mean(a^2))")
    print(f"  least peak torque:                      {forms.least_peak:6.0f}")
    match = forms.load_match
    print(f"  alpha {match.accelerating_factor:.0f} W/s against beta/eta {match.load_factor:.0f} W/s: ratios "
          f"{match.range.low:.0f} to {match.range.high:.0f} keep the motor cool")  # fmt: skip
    low, high = forms.rated[0]
    print(f"  with losses by the direction of power:  {low:.0f} to {high:.0f}")
    print("  every limit of the study: " + ratio_sentence(found))
    print(f"  least utilisation at {found.best.ratio:.0f}: voltage stops the ratio far short of the least torque")
    print("  nearest in the catalogue: " + ", ".join(f"{gear.key} {gear.verdict}" for gear in found.gears[:3]))
    figure_of(ratio_charts(found)).savefig(picture, dpi=150, facecolor="white")
    print(f"drew {picture}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(Path(__file__).stem + ".png"))
