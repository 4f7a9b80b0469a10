"""How a check comes about, in lines: what is asked and by which formula, what is allowed and who says so, when."""

from __future__ import annotations

from collections.abc import Iterator

from drivetrain.report.quantities import DASH, convert, number, percent, printed_unit
from drivetrain.report.words import common_unit, digits_near_limit, identity, in_study_amperes, required_text
from drivetrain.sizing.judge.checks import REQUIREMENTS
from drivetrain.sizing.results import Evaluation, JointResult
from drivetrain.study.parts.verdicts import Check, shared_place


def explanation(evaluation: Evaluation, joints: tuple[str, ...], checks: tuple[str, ...]) -> Iterator[str]:
    """Every wanted check of every wanted joint.

    Args:
        evaluation: Of the drives.
        joints: Names, ``supply`` and ``arm`` among them; empty: all.
        checks: Names; empty: all.
    """
    for name, joint in evaluation.joints.items():
        found = [one for one in joint.checks if not checks or one.name in checks]
        if found and (not joints or name in joints):
            yield f"{name}: {_parts(joint)}"
            yield from (line for check in found for line in check_lines(check))
    for place in ("supply", "arm", "catalogue"):
        found = [
            one for one in evaluation.shared
            if shared_place(one) == place and (not checks or one.name in checks)
        ]  # fmt: skip
        if found and (not joints or place in joints):
            yield place
            yield from (line for check in found for line in check_lines(check))


def check_lines(check: Check) -> Iterator[str]:
    """One check."""
    shown = common_unit(check)
    unit, digits = printed_unit(shown), digits_near_limit(check.utilisation)
    limit = DASH if check.available is None else number(float(convert(check.available, check.unit, shown)), digits)
    formula = next((row.formula for row in REQUIREMENTS if row.name == check.name), "")
    used = "" if check.utilisation is None else f", {percent(check.utilisation)} of the limit"
    yield f"  {check.name}: {check.verdict}{used}"
    lines = (
        ("required", "" if check.required is None else required_text(check, shown, unit)),
        ("in study", in_study_amperes(check)),
        ("formula", formula),
        ("limit", "" if check.available is None else f"{limit} {unit}".rstrip()),
        ("source", check.source),
        ("instant", "" if check.time is None else f"t = {number(check.time)} s of the cycle"),
        ("remark", check.remark),
    )
    yield from (f"    {name:<8} {text}" for name, text in lines if text)


def _parts(joint: JointResult) -> str:
    """The drive of a joint: keys, and what the maker calls them."""
    motor, gear = joint.drive.motor, joint.drive.gear
    told = []
    for part in (motor, gear) if joint.gear else (motor,):
        maker = identity(part)
        told.append(f"{part.key} ({maker})" if maker else part.key)
    return " with ".join(told) + ("" if joint.gear else ", no gear")
