"""The verdict table for the terminal."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from functools import reduce
from typing import TYPE_CHECKING

import numpy as np
from rich.table import Table
from rich.text import Text

from drivetrain.arrays import Array
from drivetrain.drive.drive import Drive
from drivetrain.errors import whole_names
from drivetrain.report.quantities import DASH, convert, number, percent, printed_unit
from drivetrain.report.words import (
    both,
    common_unit,
    digits_near_limit,
    equals_sentence,
    gaps,
    headline,
    identity,
    in_study_amperes,
    named,
    objective_tail,
    objective_text,
    overall_sentence,
    required_text,
    set_lines,
)
from drivetrain.sizing.judge.checks import REQUIREMENTS
from drivetrain.sizing.results import Evaluation, JointResult, JointSeries, Selection, placed_checks
from drivetrain.study.model import Study, pair_name
from drivetrain.study.parts.verdicts import Check, Verdict, shared_place

if TYPE_CHECKING:  # imports splines, which few commands need
    from drivetrain.sizing.answers.family import FamilySelection
    from drivetrain.sizing.answers.fastest import Fastest

STYLES = {
    Verdict.PASS: "bold green",
    Verdict.MARGINAL: "bold yellow",
    Verdict.FAIL: "bold red",
    Verdict.NOT_CHECKED: "dim",
}


def verdict_table(evaluation: Evaluation) -> Table:
    """Table with one line per joint: its drive, utilisations, verdict and the limiting check."""
    table = Table(box=None, pad_edge=False, header_style="bold", padding=(0, 2, 0, 0))
    table.add_column("joint", no_wrap=True)
    table.add_column("motor", overflow="fold")
    table.add_column("gear", overflow="fold")
    for name in ("peak\ntorque", "RMS\ncurrent", "winding", "peak\ncurrent"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    table.add_column("limited by", overflow="fold")
    for joint in evaluation.joints.values():
        table.add_row(*_cells(joint))
    for check in evaluation.shared:
        if check.utilisation is None and check.verdict is not Verdict.FAIL:
            continue
        verdict = Text(str(check.verdict), STYLES[check.verdict])
        table.add_row(shared_place(check), "", "", *[""] * 4, verdict, _limit(check))
    return table


def _cells(joint: JointResult) -> list[str | Text]:
    heat, binding = joint.series.winding_temperature, joint.binding
    return [
        joint.name,
        joint.motor,
        joint.gear.removeprefix("+") or "direct",
        percent(_largest(joint, ("gear repeated peak torque", "motor peak torque"))),
        percent(_largest(joint, ("motor RMS current",))),
        DASH if heat is None else f"{float(heat.max()):.0f} °C",
        percent(_largest(joint, ("motor peak current", "amplifier peak current"))),
        Text(str(joint.verdict), STYLES[joint.verdict]),
        DASH if binding is None else _limit(binding),
    ]


def _limit(check: Check) -> str:
    """A check with its utilisation, if that is known."""
    used = check.utilisation
    return check.name if used is None or math.isinf(used) else f"{check.name} {percent(used)}"


def family_lines(found: FamilySelection, names: Sequence[str]) -> list[str]:
    """The drives of a family, and the limiting check in each member."""
    if not found.drives:
        proof = "no set of drives fits every member" if found.proven else "none was found in the time given"
        return [f"DOES NOT FIT: {proof}"]
    lines = []
    for joint in found.drives:
        motors, gears = zip(*(one.drives[joint] for one in found.evaluations), strict=True)
        each = (motors, [gear or "no gear" for gear in gears])
        motor, gear = (" / ".join(own if len({*own}) > 1 else own[:1]) for own in each)
        lines.append(f"{joint}: {pair_name(motor, gear)}")
    for name, one in zip(names, found.evaluations, strict=True):
        limited = "nothing was judged"
        if one.binding is not None:
            limited = f"limited by {one.binding[0]}: {_limit(one.binding[1])}"
        lines.append(f"{name}: {one.verdict}, {limited}")
    unit = objective_tail(found.evaluations[0].study, " ")
    proof_text = "proven to be the least" if found.proven else f"not proven, at least {found.bound:.4g}{unit}"
    return [*lines, f"{found.evaluations[0].study.objective} of a member: {found.objective:.4g}{unit}, {proof_text}"]


def _largest(joint: JointResult, names: tuple[str, ...]) -> float | None:
    """The highest utilisation among the named checks; None when none of them was judged."""
    found = [check.utilisation for check in joint.checks if check.name in names and check.utilisation is not None]
    return max(found, default=None)


def verdict_lines(result: Evaluation | Selection) -> list[Text]:
    """The lines below the table: verdict, objective, proof of the selection, and possible fixes."""
    evaluation, selection = both(result)
    lines = [
        Text.assemble((str(result.verdict), STYLES[result.verdict]), "  ", headline(evaluation, selection)),
        Text(overall_sentence(evaluation)),
        Text(f"objective: {objective_text(evaluation, selection)}"),
    ]
    holes = gaps(evaluation)
    lines[1:1] = [Text(line, "yellow") for line in (holes[:1] if selection is not None else holes)]
    if selection is not None:
        lines += [Text(f"note: {line}", "yellow") for line in selection.notes]
        lines.append(Text(f"proof: {selection.proof}; {len(selection.rejected_pairs)} candidates rejected"))
        lines += [Text(line) for line in (equals_sentence(selection),) if line]
        lines += [Text(line, "dim") for line in set_lines(selection)]
        lines += [Text(f"advice: {line}") for line in selection.advice]
    missing = sum(check.verdict is Verdict.NOT_CHECKED for _, check in placed_checks(evaluation))
    rows = [row for joint in evaluation.joints.values() for row in (joint.drive.motor, joint.drive.gear)]
    named_parts = dict.fromkeys(f"{row.key}: {identity(row)}" for row in rows if row.key and identity(row))
    lines += [Text(line, "dim") for line in named_parts]
    if missing:
        words = "checks not evaluated, or for information only: the report says which and why"
        lines.append(Text(f"{missing} {words}", "dim"))
    return lines


def explanation(evaluation: Evaluation, joints: Sequence[str] = (), checks: Sequence[str] = ()) -> Iterator[str]:
    """Lines that explain the requested checks of the requested joints.

    Args:
        evaluation: Evaluation of the drives.
        joints: Names or unique parts of names, including ``supply`` and ``arm``; empty: all.
        checks: Names or unique parts of names of checks; empty: all.

    Raises:
        InputError: A name matches no or several joints or checks.
    """
    places = ("supply", "arm", "catalogue")
    joints = whole_names("joint", "joint of the study", joints, [*evaluation.joints, *places])
    checks = whole_names("check", "check", checks, [row.name for row in REQUIREMENTS])
    return _explained(evaluation, joints, checks)


def _explained(evaluation: Evaluation, joints: Collection[str], checks: Collection[str]) -> Iterator[str]:
    for name, joint in evaluation.joints.items():
        found = [one for one in joint.checks if not checks or one.name in checks]
        if found and (not joints or name in joints):
            drive = joint.drive  # sources of its rows are given once, not with every check
            gear = named(drive.gear.key, drive.gear) if joint.gear else ""
            yield f"{name}: {pair_name(named(drive.motor.key, drive.motor), gear)}"
            rows = [(kind, row) for kind, row in (("motor", drive.motor), ("gear", drive.gear)) if row.source]
            yield from (f"    {kind} {row.key}: {row.source}" for kind, row in rows)
            yield f"    {_constants(drive)}"
            for line in (line for check in found for line in check_lines(check, joint.series)):
                yield reduce(lambda text, part: text.replace(f" ({part[1].source})", ""), rows, line)
    for place in ("supply", "arm", "catalogue"):
        found = [
            one for one in evaluation.shared
            if shared_place(one) == place and (not checks or one.name in checks)
        ]  # fmt: skip
        if found and (not joints or place in joints):
            yield place
            yield from (line for check in found for line in check_lines(check))


def _constants(drive: Drive) -> str:
    """Values of the formula symbols that are constants of a drive; unknown values are left out."""
    motor, gear = drive.motor, drive.gear
    mesh = 1.0 if gear.direct else gear.efficiency if gear.mesh_efficiency is None else gear.mesh_efficiency
    parts = [
        ("G", gear.ratio, ""), ("eta", mesh, ""), ("J of the rotor", motor.rotor_inertia, "kg m^2"),
        ("J at the gear's input", None if gear.direct else gear.inertia, "kg m^2"),
        ("kt", motor.torque_constant, "N m per A dc"),
        ("R", motor.resistance, "ohm"), ("L", motor.inductance, "H"), ("K1", gear.stiffness_1, "N m/rad"),
    ]  # fmt: skip
    return ", ".join(f"{name} = {value:.5g} {unit}".rstrip() for name, value, unit in parts if value is not None)


def _values(series: JointSeries, time: float) -> str:
    """Values of the formula symbols at an instant of the cycle [s]."""
    t = int(np.argmin(np.abs(series.time - time)))
    parts = [
        ("w", series.speed, "rad/s"), ("dw/dt", series.acceleration, "rad/s^2"), ("T", series.gear_torque, "N m"),
        ("motor torque", series.motor_torque, "N m"), ("i", series.current, "A"), ("voltage", series.voltage, "V"),
    ]  # fmt: skip
    return ", ".join(f"{name} = {_told(row, t):.5g} {unit}" for name, row, unit in parts if np.isfinite(row[t]))


def _told(row: Array, t: int) -> float:
    """A value of a series; 0 if it is a rounding error relative to the largest."""
    return 0.0 if abs(row[t]) < 1e-9 * np.abs(row[np.isfinite(row)]).max() else float(row[t])


def check_lines(check: Check, series: JointSeries | None = None) -> Iterator[str]:
    """Lines on one check; with the series of its joint, also their values at its instant."""
    shown = common_unit(check)
    unit, digits = printed_unit(shown), digits_near_limit(check.utilisation)
    limit = DASH if check.available is None else number(float(convert(check.available, check.unit, shown)), digits)
    formula = next((row.formula for row in REQUIREMENTS if row.name == check.name), "")
    used = "" if check.utilisation is None else f", {percent(check.utilisation)} of the limit"
    yield f"  {check.name}: {check.verdict}{used}"
    lines = (
        ("required", "" if check.required is None else required_text(check, shown, unit)),
        ("that is", in_study_amperes(check)),
        ("formula", formula),
        ("limit", "" if check.available is None else f"{limit} {unit}".rstrip()),
        ("source", check.source),
        ("instant", "" if check.time is None else f"t = {number(check.time)} s of the cycle"),
        ("then", "" if check.time is None or series is None else _values(series, check.time)),
        ("remark", check.remark),
    )
    yield from (f"    {name:<8} {text}" for name, text in lines if text)


def fastest_lines(found: Fastest) -> Iterator[str]:
    """Lines for the terminal on the fastest cycle."""
    from drivetrain.sizing.answers.fastest import WITHOUT_A_TIME

    if found.feasible:
        change = 100.0 * (found.duration / found.before - 1.0)
        yield f"fastest cycle: {found.duration:.4g} s instead of {found.before:.4g} s ({change:+.3g} %)"
    else:
        reason = overall_sentence(found.evaluation)
        yield f"no cycle time meets all limits, not even {found.duration:.4g} s: {reason}"
    for move in found.moves:
        words = f"  {move.name}, from {move.start:.4g} s: {move.after:.4g} s instead of {move.before:.4g} s"
        if move.check:
            words += f"; limited by {move.check} at {move.place}"
            if not math.isnan(move.time):
                words += f", t = {move.time:.4g} s"
            elif move.check not in WITHOUT_A_TIME:
                words += ", over the whole cycle"
        yield words


def motion_csv(study: Study) -> str:
    """Joint positions over the cycle as CSV text, one row per instant."""
    cycle, arm = study.cycle, study.arm
    slides = np.zeros(len(cycle.joint_names), bool) if arm is None else arm.slides
    names = [f"{name} [{'m' if slide else 'rad'}]" for name, slide in zip(cycle.joint_names, slides, strict=True)]
    kept = np.append(np.diff(cycle.time) > 0.0, True)
    rows = np.column_stack([cycle.time, cycle.position])[kept]
    text = "\n".join(",".join(f"{value:.9g}" for value in row) for row in rows)
    return f"{','.join(['time [s]', *names])}\n{text}\n"
