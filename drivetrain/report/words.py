"""Results in sentences: what limits a joint, by how much, when; and what the model leaves out."""

from __future__ import annotations

import math

from drivetrain.report.quantities import DASH, convert, number, percent, printed_unit, shown_unit
from drivetrain.sizing.judge.missing import gap_lines, uncounted
from drivetrain.sizing.judge.missing import gaps as missing_gaps
from drivetrain.sizing.judge.objectives import drive_price
from drivetrain.sizing.results import Evaluation, JointResult, Selection
from drivetrain.study.model import DriveMass, Study
from drivetrain.study.mounting import drive_mass
from drivetrain.study.verdicts import Check, Verdict, lacking

DRIVE_MASS = {
    DriveMass.ADDED: "The arm's links are bare: stator, rotor and gear of every drive load every joint before it.",
    DriveMass.INCLUDED: "The arm's links already hold the drives' masses: nothing is added; rotors spin in addition.",
    DriveMass.REPLACED: "The drives that the arm's links hold are taken out, and the judged drives put in.",
}

MODEL_LIMITS = (
    "The motion is followed exactly: overshoot, control error and start-up transients are not in the numbers.",
    "Links, gears and bearings are rigid: wind-up, backlash and resonance are not computed.",
    "The cycle repeats for ever: temperatures are those of the periodic steady state, not of the first cycle or of a "
    "rare emergency stop.",
    "Each drive is two bodies of heat, winding and housing, in air of one temperature; neighbours do not warm each "
    "other, and iron loss counts only as far as the sheet's nominal current holds it.",
    "The supply holds its voltage; current ripple, cogging and dead time of the amplifier are left out.",
    "Gears are judged by the torque and speed limits of their sheet; lubrication, mounting and shock are not.",
    "Catalogue rows are for sizing studies: confirm the chosen parts against the maker's current data sheet.",
)


def check_sentence(check: Check) -> str:
    """A judged check in words."""
    if check.utilisation is None:
        return f"{check.name}: not checked"
    shown = common_unit(check)
    unit = printed_unit(shown)
    when = "" if check.time is None else f" at t\u00a0=\u00a0{number(check.time)}\u00a0s"
    if check.required is None or check.available is None:
        return f"{check.name}{when}: {percent(check.utilisation)} of its limit"
    if not math.isfinite(check.utilisation):
        return f"{check.name}: {check.remark or 'beyond any number'}"
    available = number(float(convert(check.available, check.unit, shown)), digits_near_limit(check.utilisation))
    asked, allowed = required_text(check, shown, unit), f"{available}\u00a0{unit}".rstrip()
    return f"{check.name} {asked}{when}, limit {allowed} ({percent(check.utilisation)})"


def common_unit(check: Check) -> str:
    """The unit in which both numbers of a check are shown."""
    known = [abs(value) for value in (check.required, check.available) if value is not None]
    return shown_unit(max(known) if known else None, check.unit)


def required_text(check: Check, shown: str, unit: str = "") -> str:
    """What a check requires; with a safety factor ``actual × factor = required``.

    Args:
        shown: The unit of the numbers.
        unit: As printed behind each; none where it stands beside.
    """
    if check.required is None or check.actual is None:
        return DASH
    digits = digits_near_limit(check.utilisation)
    actual, value = (float(convert(v, check.unit, shown)) for v in (check.actual, check.required))
    required = number(value, digits)
    behind = f"\u00a0{unit}" if unit else ""
    if check.factor == 1.0 or not math.isfinite(value):
        return f"{required}{behind}"
    same = number(float(f"{actual:.{digits}g}") * check.factor, digits) == required
    return f"{number(actual, digits if same else digits + 1)}{behind} × {check.factor:g} = {required}{behind}"


def digits_near_limit(utilisation: float | None) -> int:
    """How many digits tell the two numbers of a check apart."""
    return 5 if utilisation is not None and 0.99 < utilisation < 1.01 else 3


def nearness(check: Check | None) -> str:
    """What the check with the highest utilisation is."""
    over = check is not None and check.utilisation is not None and not check.utilisation <= 1.0
    return "furthest over its limit" if over else "closest to a limit"


def no_temperature(joint: JointResult) -> str:
    """Why a joint has no winding temperature."""
    check = next((check for check in joint.checks if check.name == "winding temperature"), None)
    if check is not None and check.utilisation is not None:
        return "no steady temperature: it runs away"
    return f"not computed: {check.remark}" if check is not None and check.remark else "not computed"


def joint_sentence(joint: JointResult) -> str:
    """What limits a joint."""
    binding = joint.binding
    if binding is None:
        return "nothing could be checked: the sheets lack data"
    return check_sentence(binding)


def binding_place(evaluation: Evaluation) -> tuple[str, Check] | None:
    """The limit that decides the whole verdict.

    Returns:
        Joint name, ``supply`` or ``catalogue``, and check; None when nothing was judged.
    """
    places = [(joint.name, joint.binding) for joint in evaluation.joints.values()]
    places += [(shared_place(check), check) for check in evaluation.shared]
    judged = [(place, check) for place, check in places if check is not None and check.utilisation is not None]
    return max(judged, key=lambda pair: pair[1].utilisation or 0.0, default=None)


def shared_place(check: Check) -> str:
    """Where a check of all joints together belongs."""
    return "supply" if check.name.startswith("supply") else "catalogue"


def overall_sentence(evaluation: Evaluation) -> str:
    """The limit that decides the whole verdict, in words."""
    found = binding_place(evaluation)
    if found is None and evaluation.verdict is Verdict.FAIL:
        told = next(check.remark or check.name for check in evaluation.shared if check.verdict is Verdict.FAIL)
        return f"{told[0].upper()}{told[1:]}."
    if found is None:
        return "Nothing could be checked: the sheets lack data."
    place, check = found
    return f"{nearness(check).capitalize()}: {place}: {check_sentence(check)}."


def headline(evaluation: Evaluation, selection: Selection | None) -> str:
    """The verdict in plain words."""
    if selection is not None and not selection.drives:
        unknown = selection.verdict is Verdict.NOT_CHECKED
        found = "is proven to do it: data are missing" if unknown else "does it"
        if not evaluation.joints:
            return "No set of drives can be chosen: joints have nothing to choose from."
        return f"No allowed set of drives {found}. Shown are the nearest candidates."
    drives = "The chosen drives" if selection is not None else "The given drives"
    words = {
        Verdict.PASS: f"{drives} do it, with the wanted reserve everywhere.",
        Verdict.MARGINAL: f"{drives} do it, but with less reserve than wanted.",
        Verdict.FAIL: f"{drives} do not do it.",
        Verdict.NOT_CHECKED: f"{drives} are not proven to do it: no check fails, but data are missing.",
    }
    made = any(check.utilisation is not None for joint in evaluation.joints.values() for check in joint.checks)
    return words[evaluation.verdict] if made or evaluation.verdict is Verdict.FAIL else NOTHING


NOTHING = "Nothing could be judged: the sheets lack data."


def gaps(evaluation: Evaluation) -> tuple[str, ...]:
    """Which essential checks could not be made, and which numbers of which sheets would let them be."""
    missing: dict[str, list[str]] = {}
    for joint in evaluation.joints.values():
        for check in joint.lacking:
            missing.setdefault(check.name, []).append(joint.name)
    for check in lacking(evaluation.shared):
        missing[check.name] = []
    count = len(evaluation.joints)
    where = [
        name if len(joints) in (0, count) else f"{name} ({', '.join(joints)})" for name, joints in missing.items()
    ]  # fmt: skip
    if not where:
        return ()
    proven = "" if evaluation.verdict is Verdict.FAIL else ", so the drives are neither proven to fit nor seen to fail"
    return (f"Data are missing to check {', '.join(where)}{proven}.", *gap_lines(missing_gaps(evaluation)))


def objective_text(evaluation: Evaluation, selection: Selection | None = None) -> str:
    """The objective's value with its unit."""
    kind = evaluation.study.objective
    part = selection is not None and bool(selection.notes)
    value = number(selection.objective if selection is not None and part else evaluation.objective)
    value += " as far as known," if part else ""
    if value.startswith((DASH, "∞")) or (part and _nothing_known(evaluation)):
        return "; ".join(uncounted(evaluation)) or f"{kind} not known"
    if kind == "weighted":
        parts = [f"{name} × {weight:g}" for name, weight in evaluation.study.wanted.weights]
        return f"{value}, weighted: {' + '.join(parts)}"
    words = {
        "mass": f"{value} kg of motors and gears",
        "energy": f"{value} J drawn in a cycle",
        "price": f"price {value} {evaluation.study.prices.currency or 'in the currency of the catalogue'}",
    }
    return words[kind]


def _nothing_known(evaluation: Evaluation) -> bool:
    """Whether no drive at all has a known share of the objective; what a search adds to put equals in order is none."""
    share = {"mass": drive_mass, "price": drive_price}.get(evaluation.study.objective)
    return share is not None and all(share(joint.drive) is None for joint in evaluation.joints.values())


def safety_lines(study: Study) -> list[tuple[str, str]]:
    """The factors and reserves as (name, value) pairs."""
    safety = study.safety
    ratio = "reported, not judged" if safety.inertia_ratio is None else f"at most {number(safety.inertia_ratio)}"
    life = "reported, not judged" if safety.life is None else f"at least {number(safety.life / 3600.0)} h"
    return [
        ("peak torque and peak current", f"× {safety.peak_torque:g}"),
        ("RMS current", f"× {safety.rms:g}"),
        ("speed", f"× {safety.speed:g}"),
        ("voltage", f"× {safety.voltage:g}"),
        ("kept below the winding's limit", f"{safety.temperature_margin:g} K"),
        ("MARGINAL above", f"{100 * (1 - safety.reserve):g} % of a limit"),
        *([("holding brake torque", f"× {safety.brake:g}")] if any(task.brakes for task in study.joints) else []),
        ("load to rotor inertia", ratio),
        ("gear life", life),
    ]
