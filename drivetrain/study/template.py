"""A commented study to start from: it works as it stands, and three edits make it one's own."""

from __future__ import annotations

import math
import os
import warnings
from pathlib import Path

import yaml

from drivetrain.arm.arm import Arm
from drivetrain.arm.builtin import builtin_names
from drivetrain.arm.files.links import tip_among_several
from drivetrain.arm.files.load import load_arm
from drivetrain.errors import PhysicsWarning

SWING = math.radians(40.0)  # of each revolute joint, where its range allows
SLIDE = 0.1  # [m], of each prismatic joint
SPEED, SLIDE_SPEED = math.radians(90.0), 0.25  # [rad/s], [m/s], where the arm's own limits are not lower

_TEMPLATE = """\
# A study for drivetrain. It works as it stands:
#   drivetrain check THIS_FILE     are all values understood?
#   drivetrain select THIS_FILE    which motors and gears drive this arm?
#   drivetrain size THIS_FILE      do the drives written under `joints` fit?
# Three edits make it your own: the arm (1), what it carries (2), how it moves (3). Every value carries its unit.
schema_version: 1
name: My arm

# 1. The arm: a built-in one ({builtin}), a path to a .urdf or .xacro file,
#    or a table: {{dh: my_table.csv, convention: classic}} (or modified).
arm: {arm}{tip}
# Whose mass are the drives?  added: the links are bare, the drives come on top.  included: the links, of a finished
# robot, hold them already.  replaced: they hold other drives; each joint then says `contained: {{mass: 1.2 kg}}`.
drive_mass: included

# 2. What the tip carries; com and inertia in the tip's frame.
payloads:
  part:
    mass: 3 kg
    com: [0 mm, 0 mm, 60 mm]
    inertia: {{xx: 8e-3 kg m^2, yy: 8e-3 kg m^2, zz: 6e-3 kg m^2}}

# 3. How it moves: waypoints, at rest in each. Or a recording: {{file: my_motion.csv}}, with a header such as
#    time [s], {first} [deg], ...
motions:
  default: # holds for all motions{unit}
    profile: s_curve # or trapezoid, quintic
    speed: {speed}
    acceleration: {acceleration}
    jerk: {jerk}
  there: # {joints}
    waypoints:
      - [{start}]
      - [{end}]
  back:
    waypoints:
      - [{end}]
      - [{start}]
  # drawn: # or moves of the tool in the base frame, by inverse kinematics; `start` also chooses the arm's posture
  #   start: [{start}]
  #   tool: {{speed: 250 mm/s, acceleration: 2 m/s^2, jerk: 20 m/s^3}} # along lines and circles
  #   moves:
  #     - {{line: {{position: [0.4 m, 0 m, 0.3 m]}}, blend: 20 mm}} # rpy, quaternion or axis_angle turn the tool
  #     - {{circle: {{position: [0.4 m, 0.2 m, 0.3 m]}}, via: [0.5 m, 0.1 m, 0.3 m]}}
  #     - {{to: {{position: [0.4 m, 0.2 m, 0.4 m]}}}} # the joints in step; or joints: [...]

# One round of the repeated task; temperatures are those after many rounds.
cycle:
  - {{motion: there, payload: part}}
  - {{dwell: 0.5 s, payload: part}}
  - {{motion: back}}
  - {{dwell: 0.5 s}}

# Several such rounds, each for a share of the time of use, instead of `cycle`:
# mix:
#   - {{name: busy, share: 60 %, cycle: [{{motion: there, payload: part}}, {{motion: back}}]}}
#   - {{name: waiting, share: 40 %, cycle: [{{motion: there}}, {{motion: back}}, {{dwell: 5 s}}]}}

# Which parts there are: `shipped` is this package's catalogue, a folder of your own holds motors.csv and gears.csv.
catalogs: [shipped] # or [shipped, my_parts]; single parts may stand here, under `motors` and `gears`

supply:
  voltage: 48 V
  regenerated_power: 100 W # what the brake resistor burns

amplifier: # limits of each; current_basis says what their ampere is: dc, rms or peak
  current_basis: rms
  peak_current: 40 A
  continuous_current: 20 A

ambient: 25 °C
# cold_start: -10 °C # checks the start of a cold machine too: stiff grease
safety:
  peak_torque: 1.2 # factor on what is required
  reserve: 10 % # a check that passes with less is MARGINAL
stop: # of all joints at once, from any state of the cycle; without a ramp the motors brake with their peak current
  ramp: 0.5 s
  # stops_per_day: 10 # with service_life: 87600 h, how many momentary peaks the gears must bear
# stiffness: {{first_resonance: 8 Hz, tip_deviation: 0.5 mm}} # of the arm on its gears' springs; lost_motion likewise
objective: mass # or price, energy, or a mix by the kg, the unit of price, the J a cycle: {{mass: 1, energy: 0.001}}
# selection: # what the chosen set must respect, and how far the search goes
#   sets: 5 # how many of the best sets are wanted
#   time_limit: 30 s # then the best found is reported with the gap that is left
#   most_motor_types: 3 # fewer spare parts: different motors over all joints, at most; most_gear_types likewise
#   same_family: [[{pair}]] # groups of joints whose motors, and whose gears, are of one maker's series
#   front: [mass, energy] # also in the report: the sets that no other beats in both
#   curves: [payload, 'cycle_time: 3 s..8 s'] # and the best drives over a payload, a pace, voltage or ambient

# By how much what is built may differ: plus and minus, or a standard deviation. The report then says with what
# probability each check holds; `selection: {{holds: 99 %}}` chooses a set that holds so often.
# tolerances: {{torque_constant: 5 %, friction: 30 %, payload: {{normal: 0.1 kg}}, ambient: 5 K}}

# How it is run (drivetrain simulate, drivetrain accuracy). What no data sheet gives is stated here, for all joints by
# `default`, or by joint:
# simulation:
#   effects: auto # or all, or a list; auto omits what changes less than the tolerance, and proves it
#   tolerance: 1 %
#   control: # a digital controller: loops closed at samples, on an encoder's counts
#     default: {{rate: 1 kHz, amplifier_rate: 10 kHz, delay: 1, encoder_bits: 17}}
#   cogging: {{default: {{amplitude: 5 mN m, periods: 84}}}} # at the motor; periods a turn
#   add: # any other effect, by the name of its class and of its fields
#     - {{effect: HoldingBrake, joint: {first}, holding: 400 N m, engages: [2 s]}}

# What may drive each joint; a joint's own entry goes over the default one, name by name.
joints:
  default:
    candidates:
      motors: {{frameless: true, nominal_voltage: [40 V, 60 V], diameter: [null, 130 mm]}}
      gears: {{kind: strain_wave, ratio: [50, 160], size: [11, 40]}}
      pairs: compatible # published as fitting, or frameless around its gear; all: any motor with any gear{slides}
  # {first}:
  #   drive: {{motor: key, gear: key}} # a given drive, for `drivetrain size`; gear: none is a direct drive
  #   friction: {{coulomb: 0.5 N m}} # at the joint, outside the gear
  #   stages: # between gear and joint, in order: screw, belt, rack, worm, gear
  #     - {{type: belt, ratio: 2.5, efficiency: 96 %, diameter: 100 mm, tooth_force: 30 N, teeth_in_mesh: 6}}
  #   counterbalances: # by the joint's angle alone: spring or gas_force on levers, torque, or angles and torques
  #     - {{stiffness: 8 N/mm, free_length: 150 mm, lever_carrier: 200 mm, lever_link: 80 mm, dead_centre: 90 deg}}
  #   amplifier_heat: 100 % # the amplifier sits in the joint and warms the motor's housing
  #   gear_heat: 0 % # the gear does not sit on the motor's housing, which its loss then does not warm
  #   output_bearing: external # the joint has a bearing of its own; else the gear's must bear what loads it across

# Joints whose motors work together: a differential wrist, belts over joints, motors on the base.
# coupling:
#   - {{joints: [{pair}], type: differential}} # or belt, or matrix: [[1, 0], [1, 1]]
"""


_SCREW = """
  {name}: # slides: a screw that the motor turns without a gear
    candidates: {{motors: {{frameless: false, nominal_voltage: [40 V, 60 V]}}, gears: none}}
    travel_per_turn: 10 mm/rev"""


def study_template(arm: str = "ur5-corrected", folder: Path | None = None) -> str:
    """The text of a study that loads and runs, with comments on what to change.

    Args:
        arm: A built-in one, or a file.
        folder: In which the study will stand, and from which it names the file; None: the working directory.
    """
    file = None if arm in builtin_names() else Path(arm)
    tip = tip_among_several(file) if file is not None and file.is_file() else None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PhysicsWarning)  # told again, with the rest, when the study is read
        loaded = load_arm(arm, tip=tip)
    slides = [not screw[:3].any() for screw in loaded.screws]
    start, end = (_row(loaded, slides, side) for side in (-0.5, 0.5))
    return _TEMPLATE.format(
        arm=arm if file is None else _quoted(_from(folder, file)),
        tip=""
        if tip is None
        else f"\ntip: {_quoted(tip)} # the file has several chains: which link carries the payload",
        builtin=", ".join(builtin_names()),
        first=loaded.joint_names[0],
        joints=", ".join(loaded.joint_names),
        pair=", ".join(loaded.joint_names[-2:]),
        unit="" if any(slides) else "\n    unit: deg",
        start=start,
        end=end,
        speed=_together([_speed(limit, slide) for limit, slide in zip(loaded.speed_limits, slides, strict=True)]),
        acceleration=_together(["1 m/s^2" if slide else "300 deg/s^2" for slide in slides]),
        jerk=_together(["10 m/s^3" if slide else "3000 deg/s^3" for slide in slides]),
        slides="".join(
            _SCREW.format(name=_quoted(name)) for name, slide in zip(loaded.joint_names, slides, strict=True) if slide
        ),
    )


def _row(arm: Arm, slides: list[bool], side: float) -> str:
    """A waypoint: the middle of each joint's range, and a share of the swing to one side."""
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
    """An easy speed, or the joint's own limit where that is lower."""
    usual = SLIDE_SPEED if slide else SPEED
    value = limit if 0.0 < limit < usual else usual
    return f"{value:.4g} m/s" if slide else f"{math.degrees(value):.4g} deg/s"


def _together(each: list[str]) -> str:
    """One limit for all joints, or one each where they differ."""
    return each[0] if len(set(each)) == 1 else f"[{', '.join(each)}]"


def _from(folder: Path | None, file: Path) -> str:
    """A file as a study in a folder names it."""
    return file.as_posix() if file.is_absolute() else Path(os.path.relpath(file, folder or Path())).as_posix()


def _quoted(text: str) -> str:
    """A text as YAML writes it."""
    return str(yaml.safe_dump([text], default_flow_style=True, width=10_000, allow_unicode=True).strip()[1:-1])
