"""Results as sentences: the limiting check of a joint, its values and instant; and what the model does not cover."""

from __future__ import annotations

import math
from dataclasses import dataclass

from drivetrain.drive.brake import Brake
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.drive.thermal.thermal_network import thermal_network
from drivetrain.report.quantities import DASH, convert, number, percent, printed_unit, shown_unit, with_unit
from drivetrain.sizing.judge.missing import gap_lines, uncounted
from drivetrain.sizing.judge.missing import gaps as missing_gaps
from drivetrain.sizing.judge.objectives import drive_price
from drivetrain.sizing.judge.words import AMPERES
from drivetrain.sizing.results import DriveSet, Evaluation, JointResult, Selection
from drivetrain.study.model import DriveMass, Study, pair_name
from drivetrain.study.parts.mounting import drive_mass
from drivetrain.study.parts.verdicts import Check, Verdict, lacking

NOTHING = "Nothing could be checked: the data sheets lack values."

DRIVE_MASS = {
    DriveMass.ADDED: "The arm's links are bare: stator, rotor and gear of every drive load every joint before it.",
    DriveMass.INCLUDED: "The arm's links already hold the drives' masses: nothing is added; rotors spin in addition.",
    DriveMass.REPLACED: "The drives that the arm's links contain are taken out, and the drives of this report put in.",
}

OUTSIDE = (
    (
        "springs that swing against each other in a stop; a brake that slips with less than its static torque; impacts",
        "`drivetrain simulate` with `FlexibleJoint`, `HoldingBrake` and walls",
    ),
    (
        "overshoot, control error, start-up: the motion counts as followed exactly",
        "gains of the loops (`drivetrain loops`); `drivetrain simulate` runs them",
    ),
    (
        "insulation of windings on a supply above the motor's nominal voltage",
        "the highest voltage of its data sheet; `nominal_voltage` under `candidates` of motors",
    ),
    (
        "bending of links, strength of links, screws and housings",
        "stiffness and strength of the structure: a finite-element model, or links as beams in a scene",
    ),
    (
        "warm-up and rare loads: temperatures are those of the cycle repeated without end",
        "`drivetrain simulate` over the hours wanted",
    ),
    (
        "joints that warm each other; air that is hotter in one place",
        "a measured rise at the joint: state it as `ambient` or `housing_to_ambient`",
    ),
    (
        "iron loss beyond what the data sheet's nominal current includes; current ripple, cogging, dead time",
        "loss map of the motor, or its maker; `drivetrain simulate` with `Cogging`",
    ),
    (
        "lubrication, seals, dirt, shock, mounting tolerances of gears and bearings",
        "the maker's selection procedure with the loads of this report",
    ),
    (
        "cables, connectors, encoders, electromagnetic compatibility, functional safety",
        "their own standards (ISO 10218-1 and IEC 61800-5-2 among them): nothing of it is computed here",
    ),
    (
        "the catalogue rows themselves: they are for sizing studies",
        "the maker's current data sheet of each chosen part",
    ),
)
"""What the checks do not cover, and what is needed to check it."""


def check_sentence(check: Check) -> str:
    """A checked limit as a sentence."""
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
    needs, allowed = required_text(check, shown, unit), f"{available}\u00a0{unit}".rstrip()
    entered = in_study_amperes(check)
    beside = f"; {entered}" if entered else ""
    return f"{check.name} {needs}{when}, limit {allowed} ({percent(check.utilisation)}{beside})"


def in_study_amperes(check: Check) -> str:
    """A current and its limit in the convention of the study (rms or peak); empty for other quantities and for dc."""
    if check.unit != "A" or check.current_basis == "dc" or check.required is None:
        return ""
    digits = digits_near_limit(check.utilisation)
    found = [check.entered(name) for name in ("required", "available")]
    needs, limit = (None if value is None else number(value, digits) for value in found)
    return f"{needs}{'' if limit is None else f' of {limit}'} A {AMPERES[check.current_basis]}"


def common_unit(check: Check) -> str:
    """The unit in which the required value and the limit of a check are shown."""
    known = [abs(value) for value in (check.required, check.available) if value is not None]
    return shown_unit(max(known) if known else None, check.unit)


def required_text(check: Check, shown: str, unit: str = "") -> str:
    """The required value of a check in the unit shown; with a safety factor ``actual × factor = required``."""
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
    """Number of digits that distinguish the required value of a check from its limit."""
    return 5 if utilisation is not None and 0.99 < utilisation < 1.01 else 3


def identity(record: Motor | Gear | Brake | None) -> str:
    """Maker, series and part number as far as known; each is left out if the next one contains it."""
    if record is None:
        return ""
    names = (record.maker, record.series, record.part_number)
    return " ".join(name for i, name in enumerate(names) if name and not names[i + 1 :].count(name))


def both(result: Evaluation | Selection) -> tuple[Evaluation, Selection | None]:
    return (result.evaluation, result) if isinstance(result, Selection) else (result, None)


def objective_tail(study: Study, space: str = "\u00a0") -> str:
    """The unit after a value of the objective; empty for a price or a weighted sum."""
    return {"mass": f"{space}kg", "energy": f"{space}J"}.get(study.objective, "")


def named(key: str, record: Motor | Gear | None) -> str:
    """A part by its key and its maker's name."""
    name = identity(record)
    return f"{key} ({name})" if name else key


def study_facts(study: Study) -> list[str]:
    """Short texts on arm, cycle (for a mix its shares), supply and ambient temperature."""
    cycle, arm = study.cycle, f"{len(study.joints)} joint{'s' if len(study.joints) > 1 else ''}"
    shares = (f"{percent(share)} {name}" for share, name in zip(cycle.shares, cycle.part_names, strict=True))
    return [
        arm if study.arm is None else f"{study.arm.name}, {arm}",
        f"cycle of {number(cycle.duration)} s" if len(cycle.parts) == 1 else f"mix of {', '.join(shares)}",
        f"supply {with_unit(study.supply.voltage, 'V')}",
        f"ambient {study.ambient:g} °C",
    ]


def nearness(check: Check | None) -> str:
    """Heading of the check with the highest utilisation."""
    over = check is not None and check.utilisation is not None and not check.utilisation <= 1.0
    return "furthest over its limit" if over else "closest to a limit"


def heat_model(motor: Motor, mounting: float | None) -> str:
    """Text on a motor's thermal model, with sources; ``mounting``: housing to ambient in the study [K/W]."""
    network = thermal_network(motor, 0.0, housing_to_ambient=mounting)
    if network is None:
        return "temperatures not computed: thermal resistances are not in the catalogue row"
    inner, outer = network.resistance_winding_housing, network.resistance_housing_ambient
    whole, unsteady = motor.resistance_winding_ambient, network.winding_capacity is None
    end = "; its time constant is unknown: mean temperatures, without peaks" if unsteady else ""
    if inner == 0.0:
        stated = "" if mounting is None else f", the larger of the data sheet's {number(whole)} and the stated mounting"
        return f"one node, {number(outer)} K/W from winding to ambient{stated}{end}"
    start = f"two nodes, winding to housing {number(inner)} K/W (data sheet)"
    if motor.resistance_winding_housing is None and whole is not None:
        share = f"{percent(inner / whole)} of the data sheet's {number(whole)} K/W from winding to ambient, assumed"
        start = f"two nodes, winding to housing {number(inner)} K/W ({share})"
    source = "the study's mounting" if mounting is not None else "data sheet"
    return f"{start}, housing to ambient {number(outer)} K/W ({source}){end}"


def joint_sentence(joint: JointResult) -> str:
    return f"{NOTHING[0].lower()}{NOTHING[1:-1]}" if joint.binding is None else check_sentence(joint.binding)


def overall_sentence(evaluation: Evaluation) -> str:
    """A sentence on the limit that decides the overall verdict."""
    found = evaluation.binding
    if found is None and evaluation.verdict is Verdict.FAIL:
        reason = next(check.remark or check.name for check in evaluation.shared if check.verdict is Verdict.FAIL)
        named = reason.partition(" ")[0] in evaluation.study.joint_names
        return f"{reason if named else reason[0].upper() + reason[1:]}."
    if found is None:
        return NOTHING
    place, check = found
    return f"{nearness(check).capitalize()}: {place}: {check_sentence(check)}."


def headline(evaluation: Evaluation, selection: Selection | None) -> str:
    if selection is not None and not selection.drives:
        unknown = selection.verdict is Verdict.NOT_CHECKED
        found = "is proven to meet all limits: data are missing" if unknown else "meets all limits"
        if not evaluation.joints:
            return "No set of drives can be chosen: joints have nothing to choose from."
        return f"No allowed set of drives {found}. The closest candidates are shown."
    words = {
        Verdict.PASS: "The drives meet all limits with the required reserve.",
        Verdict.MARGINAL: "The drives meet all limits, some with less reserve than required.",
        Verdict.FAIL: "The drives do not meet all limits.",
        Verdict.NOT_CHECKED: "The drives are not proven to meet all limits: no check fails, but data are missing.",
    }
    made = any(check.utilisation is not None for joint in evaluation.joints.values() for check in joint.checks)
    return words[evaluation.verdict] if made or evaluation.verdict is Verdict.FAIL else NOTHING


def gaps(evaluation: Evaluation) -> tuple[str, ...]:
    """Texts on essential checks that could not be made, and on the missing values of data sheets."""
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
    proven = "" if evaluation.verdict is Verdict.FAIL else ", so the drives are not proven to fit (no check fails)"
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
    """Whether no drive has a known share of the objective, apart from the tie-break of a search."""
    every, objective = evaluation.joints.values(), evaluation.study.objective
    if objective == "price":
        return all(drive_price(joint.drive, joint.amplifier) is None for joint in every)
    return objective == "mass" and all(drive_mass(joint.drive) is None for joint in every)


def safety_lines(study: Study) -> list[tuple[str, str]]:
    """The factors and reserves as (name, value) pairs."""
    safety = study.safety
    ratio = "for information" if safety.inertia_ratio is None else f"at most {number(safety.inertia_ratio)}"
    life = "for information" if safety.life is None else f"at least {number(safety.life / 3600.0)} h"
    return [
        ("peak torque and peak current", f"× {safety.peak_torque:g}"),
        ("RMS current", f"× {safety.rms:g}"),
        ("speed", f"× {safety.speed:g}"),
        ("voltage", f"× {safety.voltage:g}"),
        ("winding temperature margin", f"{safety.temperature_margin:g} K"),
        ("MARGINAL above", f"{100 * (1 - safety.reserve):g} % of a limit"),
        *([("holding brake torque", f"× {safety.brake:g}")] if any(task.brakes for task in study.joints) else []),
        ("load to rotor inertia", ratio),
        ("gear life", life),
    ]


NEGLIGIBLE = 1e-9  # m or rad


@dataclass(frozen=True)
class End:
    """The quantity whose deviation from the command is shown: the tip or an axis."""

    name: str
    unit: str

    def far(self, deviation: float) -> str:
        """A deviation [m or rad] in words."""
        shown = "mrad" if self.unit == "rad" else ""  # as in charts and tables
        return "0" if deviation < NEGLIGIBLE else with_unit(deviation, self.unit, shown=shown)


def end_of(study: Study) -> End:
    """The quantity whose deviation is shown in a study's run: the tip, or the axis in a study without an arm."""
    return End("axis", "rad") if study.arm is None else End("tip", "m")


# Comparison of the best sets of drives of a selection: objective of each, and its differences from the first


CRITERIA = {
    "mass": "mass [kg]", "price": "price", "energy": "energy a cycle [J]", "utilisation": "highest utilisation",
}  # fmt: skip
HEADINGS = {**CRITERIA, "weighted": "weighted objective"}

WORDS = {
    "mass": "less mass", "price": "a lower price", "energy": "less energy a cycle", "weighted": "a smaller objective",
}  # fmt: skip


def equals_sentence(selection: Selection) -> str:
    """Number of feasible sets with the same objective as the chosen one, and the criterion that decides."""
    what, count = HEADINGS[selection.study.objective].partition(" [")[0], selection.equals
    if not selection.drives or not count:
        return ""
    if count == 1 and selection.all_equals:
        return f"No other feasible set has the same {what}."
    if count == 1:
        return f"Other feasible sets may have this {what}, too."
    return (
        f"{count if selection.all_equals else f'At least {count}'} feasible sets have this {what}; they are sorted "
        "by energy per cycle, then by largest utilisation."
    )


@dataclass(frozen=True)
class SetRow:
    """One set as texts; rank 1 is the best. ``changes``: joints with another drive than the first, with that drive."""

    rank: int
    objective: str
    mass: str
    price: str
    energy: str
    utilisation: str
    changes: tuple[str, ...]


def set_rows(selection: Selection) -> list[SetRow]:
    """The best sets, best first."""
    sets = selection.best_sets
    return [_row(rank, one, sets[0]) for rank, one in enumerate(sets, start=1)] if len(sets) > 1 else []


def set_lines(selection: Selection) -> list[str]:
    unit = objective_tail(selection.study, " ")
    return [f"set {row.rank}: {row.objective}{unit}; {'; '.join(row.changes)}" for row in set_rows(selection)[1:]]


def _row(rank: int, one: DriveSet, best: DriveSet) -> SetRow:
    changed = [joint for joint, pair in one.drives.items() if best.drives.get(joint) != pair]
    parts = tuple(f"{joint}: {pair_name(*one.drives[joint])}" for joint in changed)
    known = one.criteria
    mass, price, energy = (number(known.get(name), 4) for name in ("mass", "price", "energy"))
    used = percent(known.get("utilisation"))
    return SetRow(rank, number(one.objective, 4), mass, price, energy, used, parts)
