"""A commented study to start from: it runs unchanged, and three edits adapt it to the user's own task."""

from __future__ import annotations

import math
import os
import warnings
from pathlib import Path
from string import Template

from drivetrain.arm.arm import Arm
from drivetrain.arm.builtin import builtin_names
from drivetrain.arm.files.load import load_arm, usual_tip
from drivetrain.arm.files.xml import PACKAGE
from drivetrain.arrays import Mask
from drivetrain.errors import PhysicsWarning
from drivetrain.study.written import scalar

SWING = math.radians(40.0)  # [rad] swing of each revolute joint, where its range allows
SLIDE = 0.1  # [m] stroke of each prismatic joint
SPEED, SLIDE_SPEED = math.radians(90.0), 0.25  # [rad/s], [m/s] speed limits, unless the arm's own are lower
TEMPLATE = Path(__file__).with_name("template.yaml")
_SCREW = """
  {name}: # prismatic: a screw driven by the motor without a gear
    candidates: {{motors: {{frameless: false, nominal_voltage: [40 V, 60 V]}}, gears: none}}
    travel_per_turn: 10 mm/rev"""


def study_template(
    arm: str = "ur5-corrected", folder: Path | None = None, name: str = "My arm", *, tip: str | None = None
) -> str:
    """The text of a study that loads and runs, with comments on what to change.

    Args:
        arm: Name of a built-in arm, or path of a robot file.
        folder: Folder of the future study file, to which the path of ``arm`` is made relative; None: the working
            directory.
        name: Name of the study; the folder of its reports is named after it.
        tip: Link that carries the payload; None: the end of the arm, of a file with several chains a likely one.

    Raises:
        InputError: No such arm, file or link, or all faults of the file.
    """
    file = None if arm in builtin_names() or arm.startswith(PACKAGE) else Path(arm)
    note = "this link carries the payload"
    if tip is None and arm not in builtin_names():
        tip, note = usual_tip(arm), f"the file has several chains; {note}"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)  # shown with the rest when the study is read
        loaded = load_arm(arm, tip=tip)
    if file is not None and not file.is_absolute():
        file = Path(os.path.relpath(file, folder or Path()))  # as the study names it
    slides = loaded.slides
    start, end = (_row(loaded, slides, side) for side in (-0.5, 0.5))
    return Template(TEMPLATE.read_text(encoding="utf-8")).substitute(
        arm=scalar(arm) if file is None else scalar(file.as_posix()),
        tip="" if tip is None else f"\ntip: {scalar(tip)} # {note}",
        drive_mass="added" if arm.endswith("-bare") else "included",
        builtin=", ".join(builtin_names()),
        name=scalar(name),
        first=loaded.joint_names[0],
        first_unit="mm" if slides[0] else "deg",
        joints=", ".join(loaded.joint_names),
        pair=", ".join(loaded.joint_names[-2:]),
        unit="" if any(slides) else "\n    unit: deg",
        start=start,
        end=end,
        speed=_together([_speed(limit, slide) for limit, slide in zip(loaded.speed_limits, slides, strict=True)]),
        acceleration=_together(["1 m/s^2" if slide else "300 deg/s^2" for slide in slides]),
        jerk=_together(["10 m/s^3" if slide else "3000 deg/s^3" for slide in slides]),
        slides="".join(
            _SCREW.format(name=scalar(name)) for name, slide in zip(loaded.joint_names, slides, strict=True) if slide
        ),
    )


def _row(arm: Arm, slides: Mask, side: float) -> str:
    """A waypoint: the middle of each joint's range plus ``side`` times the swing."""
    entries = []
    for lower, upper, sliding in zip(arm.lower, arm.upper, slides, strict=True):
        bounded = math.isfinite(lower) and math.isfinite(upper)
        middle = 0.5 * (lower + upper) if bounded else 0.0
        swing = min(SLIDE if sliding else SWING, 0.8 * (upper - lower) if bounded else math.inf)
        value = middle + side * swing
        entries.append(f"{1e3 * value:.0f} mm" if sliding else f"{math.degrees(value):.1f}")
    units = [" deg" if any(slides) and not sliding else "" for sliding in slides]
    return ", ".join(entry + unit for entry, unit in zip(entries, units, strict=True))


def _speed(limit: float, slide: bool) -> str:
    """The template's speed limit as text, or the joint's own limit if that is lower."""
    usual = SLIDE_SPEED if slide else SPEED
    value, unit, digits = (limit, "m/s", 4) if slide else (math.degrees(limit), "deg/s", 2)
    if not 0.0 < limit < usual:
        return f"{usual if slide else math.degrees(usual):.4g} {unit}"
    # rounded down, so that the motion does not exceed the limit by rounding; a slower joint keeps its own
    return f"{math.floor(value * 10**digits) / 10**digits or value:g} {unit}"


def _together(each: list[str]) -> str:
    """One limit for all joints, or a list with one per joint if they differ."""
    return each[0] if len(set(each)) == 1 else f"[{', '.join(each)}]"
