"""Warnings on values that are probably in the wrong unit: millimetres as metres, grams as kilograms, degrees as rad.

Each is a note that begins with "warning:", never a fault. The bounds lie far above what real arms have, so that
plausible values give no warning.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.checks import FAR, LENGTH, called, farthest, mean_density, millimetres
from drivetrain.catalog.findings import Severity
from drivetrain.catalog.gear_rules import check_gear
from drivetrain.catalog.motor_rules import check_motor
from drivetrain.motion.checks import PLAUSIBLE_ANGLE
from drivetrain.motion.motion import LoadTable, Motion
from drivetrain.spatial.inertia import RigidBody
from drivetrain.study.document import Place
from drivetrain.study.faults import Ledger
from drivetrain.study.form import over
from drivetrain.study.model import JointTask, Payload
from drivetrain.study.schema import DEFAULT, MotionForm, StudyForm
from drivetrain.units import quantity

# Density of the ellipsoid of a payload's mass and inertia [kg/m^3]. Inertias are often guessed, so that metals reach
# 1e6 and frames 1; a mass or an inertia 1000 times too large or too small changes it at least 3e4-fold.
DENSEST, LIGHTEST = 1e7, 0.3
CARRIED = 20.0  # payload mass over the mass of all links: robots carry about their own mass at most
TRAVELLED = 50.0  # [m] travel of a prismatic joint, longer than any gantry
AMBIENT = (-90.0, 150.0)  # [C] from the coldest place on earth to the hottest ambient of motors
VOLTAGE = (2.0, 2000.0)  # [V] supplies of motors
GRAVITY = 30.0  # [m/s^2] above that of any planet
SPEED = 50.0  # [rad/s] joint speed; joints of arms stay below 30
DEGREES = (40.0, 720.0)  # whole numbers in between are limits of a joint in degrees; multiples of a turn are not whole


def note_implausible(
    form: StudyForm,
    arm: Arm | None,
    payloads: Mapping[str, Payload],
    motions: Mapping[str, Motion | LoadTable],
    joints: Sequence[JointTask],
    ledger: Ledger,
) -> None:
    """Add a warning for each implausible value of a study without faults."""
    if arm is not None:
        if form.arm is not None and form.arm.dh is None:  # a DH table is checked while it is read
            _check_links(arm, ledger)
        _check_limits(arm, ledger)
        for payload in payloads.values():
            _check_payload(payload, arm, ledger)
        for name, motion in motions.items():
            if isinstance(motion, Motion):
                _check_motion(motion, over(form.motions[name], form.motions.get(DEFAULT, MotionForm())), arm, ledger)
        _check_dwells(form, ledger)
    _check_sheets(form, ledger)
    _check_factors(form, ledger)
    _check_joints(form, joints, ledger)


def _check_factors(form: StudyForm, ledger: Ledger) -> None:
    """Safety factors below 1, which reduce the load, a peak current below the continuous one, ambient and supply."""
    if not AMBIENT[0] <= form.ambient <= AMBIENT[1]:
        hint = "was °C meant?" if form.ambient < AMBIENT[0] else "was K meant?"
        ledger.warning(("ambient",), f"is {form.ambient:.4g} °C, where no arm works", hint=hint)
    fall = form.gravity and math.hypot(*form.gravity)
    if fall and fall > GRAVITY:
        ledger.warning(("gravity",), f"is {fall:.4g} m/s^2, more than on any planet", hint="on earth 9.81 m/s^2")
    volts = form.supply.voltage
    if not VOLTAGE[0] <= volts <= VOLTAGE[1]:
        meant = 1e3 * volts if volts < VOLTAGE[0] else 1e-3 * volts
        ledger.warning(("supply", "voltage"), f"is {volts:.4g} V, which no motor has", hint=f"was {meant:.4g} V meant?")
    for name in ("peak_torque", "rms", "speed", "voltage", "bearing_static_safety", "bearing_load_factor", "brake"):
        factor = getattr(form.safety, name)
        if factor < 1.0:
            problem = f"a factor of {factor:g} lets more pass than the limit allows"
            ledger.warning(("safety", name), problem, hint=f"for a reserve of {100 * factor:.3g} %, {1 + factor:g}")
    lasting, peak = form.amplifier.continuous_current, form.amplifier.peak_current
    if lasting is not None and peak is not None and peak < lasting:
        ledger.warning(("amplifier", "peak_current"), "is below the continuous current")


def _reach(arm: Arm) -> float:
    """Length of the stretched arm: from the first joint over all others to the tip [m]."""
    return float(np.linalg.norm(np.diff(np.vstack([arm.joint_points, arm.tip[:3, 3]]), axis=0), axis=1).sum())


def _check_links(arm: Arm, ledger: Ledger) -> None:
    """Lengths and centres of mass of the links of a robot file."""
    points = np.vstack([arm.joint_points, arm.tip[:3, 3]])
    most = farthest(_reach(arm))
    for i, name in enumerate(arm.link_names):
        link, length = called(name), float(np.linalg.norm(points[i + 1] - points[i]))
        away = float(np.linalg.norm(arm.home[i, :3, 3] - points[i]))
        if length > LENGTH:
            problem = f"{link} is {length:.4g} m long, more than {LENGTH:g} m"
            ledger.warning(("arm",), problem, hint=millimetres(length))
        elif arm.masses[i] > 0.0 and away > most:
            problem = f"the centre of mass of {link} lies {away:.4g} m from its joint, more than {most:.3g} m"
            ledger.warning(("arm",), problem, hint=millimetres(away))


def _check_density(payload: Payload, place: Place, ledger: Ledger) -> None:
    """A mass that does not fit the inertia, by the implied density; point masses (no inertia) are not checked."""
    if not payload.mass > 0.0 or not np.linalg.eigvalsh(payload.inertia)[-1] > 0.0:
        return
    density = mean_density(RigidBody(payload.mass, payload.com, payload.inertia))
    if LIGHTEST <= density <= DENSEST:
        return
    beside, meant = "denser than any metal", f"{payload.mass:.4g} g"
    if density < LIGHTEST:
        beside, meant = "lighter than air", f"{1e3 * payload.mass:.4g} kg"
    problem = f"with {payload.mass:.4g} kg and its inertia it is {beside}, {density:.2g} kg/m^3"
    ledger.warning(place, problem, hint=f"was {meant} meant, or is the inertia in another unit?")


def _check_limits(arm: Arm, ledger: Ledger) -> None:
    """Ranges of revolute joints that look like degrees."""
    for i, name in enumerate(arm.joint_names):
        widest = max(abs(arm.lower[i]), abs(arm.upper[i]))
        if not arm.slides[i] and DEGREES[0] <= widest <= DEGREES[1] and float(widest).is_integer():
            problem = f"joint {name} may turn to {widest:g} rad, {widest / math.tau:.3g} turns"
            ledger.warning(("arm",), problem, hint=f"was {widest:g} deg meant? robot files state radians")


def _check_payload(payload: Payload, arm: Arm, ledger: Ledger) -> None:
    """Centre of mass and mass of a payload."""
    place: Place = ("payloads", payload.name)
    away, most, links = float(np.linalg.norm(payload.com)), farthest(_reach(arm)), float(arm.masses.sum())
    if payload.mass > 0.0 and away > most:
        problem = f"the centre of mass lies {away:.4g} m from the tip, more than {most:.3g} m"
        ledger.warning((*place, "com"), problem, hint=millimetres(away))
    if 0.0 < CARRIED * links < payload.mass:
        problem = f"{payload.mass:.4g} kg is more than {CARRIED:g} times the {links:.3g} kg of the arm's links"
        ledger.warning((*place, "mass"), problem, hint=f"was {payload.mass:.4g} g meant?")
    else:
        _check_density(payload, (*place, "mass"), ledger)


def _check_motion(motion: Motion, form: MotionForm, arm: Arm, ledger: Ledger) -> None:
    """Waypoints, then speeds; the columns of a motion file are checked while it is read."""
    place: Place = ("motions", motion.name)
    if any(note.startswith("warning: column") for note in motion.notes) or _check_waypoints(form, arm, place, ledger):
        return
    for i, name in enumerate(arm.joint_names):
        fastest = float(np.abs(motion.velocity[:, i]).max())
        if not arm.slides[i] and fastest > SPEED:
            problem = f"joint {name} reaches {fastest:.4g} rad/s, {fastest * 30.0 / math.pi:.4g} rpm"
            ledger.warning(place, problem, hint=f"was {fastest:.4g} deg/s meant, or is it a motor's speed?")


def _check_waypoints(form: MotionForm, arm: Arm, place: Place, ledger: Ledger) -> bool:
    """Warn of the most extreme waypoint whose value looks like a wrong unit; returns whether there is one."""
    worst: tuple[float, Place, str, str] | None = None
    units = form.unit or ("",)
    for row, values in enumerate(form.waypoints or []):
        for i, value in enumerate(values):
            turns = not arm.slides[i]
            unit = "rad" if turns else "m"
            text = value if isinstance(value, str) else f"{value} {units[i % len(units)] or unit}"
            at = quantity(text, unit, "")
            limit = arm.upper[i] if at > 0.0 else -arm.lower[i]
            most = PLAUSIBLE_ANGLE if turns else TRAVELLED
            allowed = limit < (DEGREES[0] if turns else math.inf)  # else the range is unknown, or implausible itself
            deliberate = "deg" in text or "°" in text if turns else "mm" in text
            share = abs(at) / most
            if share > 1.0 and not allowed and not deliberate and (worst is None or share > worst[0]):
                size = f"{at / math.tau:.3g} turns" if turns else f"more than {most:g} m"
                meant = f"was {at:.4g} {'deg' if turns else 'mm'} meant?"
                problem = f"joint {arm.joint_names[i]} at {at:.4g} {'rad' if turns else 'm'}, {size}"
                worst = (share, (*place, "waypoints", row, i), problem, meant)
    if worst is not None:
        ledger.warning(worst[1], worst[2], hint=worst[3])
    return worst is not None


def _check_dwells(form: StudyForm, ledger: Ledger) -> None:
    """Dwells without a payload between motions that carry one; the payload is that of the step alone."""
    cycles = {("mix", i, "cycle"): part.cycle for i, part in enumerate(form.mix or [])} | {("cycle",): form.cycle or []}
    for place, steps in cycles.items():
        moves = [i for i, step in enumerate(steps) if step.dwell is None]
        for i, step in enumerate(steps):
            if step.dwell is None or step.payload is not None:
                continue
            before = max((k for k in moves if k < i), default=moves[-1])
            after = min((k for k in moves if k > i), default=moves[0])
            if steps[before].payload is not None and steps[after].payload is not None:
                carried = " and ".join(dict.fromkeys(steps[k].payload or "" for k in (before, after)))
                problem = f"carries nothing in this dwell, between motions with {carried}"
                ledger.warning((*place, i), problem, hint=f"was payload: {steps[before].payload} meant?")


def _check_sheets(form: StudyForm, ledger: Ledger) -> None:
    """Values of the study's own motors and gears that contradict each other, by the rules of the catalogue's lint.

    What a data sheet omits is reported by the checks that need it.
    """
    for part, rules in (("motors", check_motor), ("gears", check_gear)):
        for key, sheet in getattr(form, part).items():
            cells = {name: value for name, value in sheet.model_dump().items() if value is not None}
            for finding in rules(cells):
                if finding.column in cells and (finding.severity is Severity.ERROR or finding.column == "ratio"):
                    ledger.warning((part, key, finding.column), finding.problem)
            ratio = cells.get("ratio", 1.0)
            if ratio < 0.0 and sheet.kind == "planetary":
                problem = (
                    f"a ratio of {ratio:.4g}, but the output of a planetary gear with a fixed ring turns as its motor"
                )
                ledger.warning((part, key, "ratio"), problem, hint=f"was {-ratio:.4g} meant?")


def _check_joints(form: StudyForm, joints: Sequence[JointTask], ledger: Ledger) -> None:
    """Lengths at the joints, and joints without candidates; those excluded by one rule are reported together."""
    idle: dict[tuple[Place, tuple[str, ...]], list[str]] = {}
    for task in joints:
        place: Place = ("joints", task.name if task.name in form.joints else DEFAULT)
        travel = task.travel_per_turn
        if travel is not None and abs(travel) * math.tau > LENGTH:
            turn = travel * math.tau
            ledger.warning((*place, "travel_per_turn"), f"{turn:.4g} m a turn", hint=millimetres(turn))
        if abs(task.mount.offset) > FAR:
            problem = f"the drive sits {task.mount.offset:.4g} m from its joint, more than {FAR:g} m"
            ledger.warning((*place, "mount", "offset"), problem, hint=millimetres(task.mount.offset))
        if task.rules is not None and not task.pairs:
            idle.setdefault(((*place, "candidates"), task.passed_over), []).append(task.name)
    for (place, words), names in idle.items():
        problem = f"no pair may be chosen for {', '.join(names)}: {'; '.join(words)}"
        ledger.warning(place, problem, hint=_remedy(words))


def _remedy(words: tuple[str, ...]) -> str:
    """What to do if no pair remains, by the first table from which the rules exclude every row."""
    empty = next((line.partition(":")[0] for line in words if ": 0 of " in line), "pairs")
    if empty == "pairs":
        return "pairs: all lets every motor go with every gear, where you know that they fit; or list pairs that do"
    return f"widen the rules of `{empty}`, the last one named first, or add rows to the catalogue"
