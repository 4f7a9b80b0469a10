"""The output files of one job, among them ``result.json`` with the results for other programs."""

from __future__ import annotations

import math
import os
from csv import writer
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drivetrain.report.json_text import drives_data, job_data, json_text, picked
from drivetrain.report.pages.report_page import html_report
from drivetrain.report.pages.sheet import Extra
from drivetrain.report.pages.spread_section import spread_data
from drivetrain.report.rejected import counted, rejected_text
from drivetrain.report.words import both, heat_model, identity
from drivetrain.sizing.answers.spread import Spread
from drivetrain.sizing.currents import current_commands
from drivetrain.sizing.judge.missing import gaps, uncounted
from drivetrain.sizing.results import Evaluation, JointResult, Selection
from drivetrain.study.parts.verdicts import Check
from drivetrain.whole_files import write_files

if TYPE_CHECKING:
    import pandas as pd


def write_outputs(
    out_dir: str | Path, result: Evaluation | Selection, *, spread: Spread | None = None, extra: Extra | None = None
) -> dict[str, Path]:
    """Write ``report.html``, ``result.json`` and ``currents.csv``; for a selection also ``rejected.csv``.

    All texts are made before any file is written, and all are written to temporary files before old ones are replaced.

    Args:
        out_dir: Output folder; it is made if missing.
        result: Result of ``evaluate`` or ``select``.
        spread: Effect of the tolerances, if the study states any.
        extra: Additional results for the report, such as ``trade_off_extra``.

    Returns:
        Path of each file by name.

    Raises:
        InputError: The folder cannot be made or written to.
    """
    texts = {
        "report.html": html_report(result, spread=spread, extra=extra),
        "result.json": result_json(result, spread=spread, extra=extra, folder=Path(out_dir)),
        "currents.csv": currents_csv(both(result)[0]),
    }
    if isinstance(result, Selection):
        texts["rejected.csv"] = rejected_text(result.rejected)
    return write_files(out_dir, texts)


def currents_csv(evaluation: Evaluation, *, rate: float | None = None, hold: int = 1) -> str:
    """The current commands as CSV text; with a rate [Hz], a comment line states it and the order of hold."""
    table = current_commands(evaluation, rate=rate, hold=hold)
    text = StringIO()
    if rate is not None:
        text.write(f"# rate: {rate:.9g} Hz, order of hold between samples: {hold}\n")
    lines = writer(text, lineterminator="\n")  # pandas would take three times as long to format the numbers
    lines.writerow(table.columns)
    lines.writerows(zip(*(_printed(table[name]) for name in table.columns), strict=True))
    return text.getvalue()


def _printed(column: pd.Series) -> list[object]:
    """Numbers with six digits, empty where unknown; other values as they are."""
    if column.dtype.kind != "f":
        return column.tolist()
    return ["" if math.isnan(value) else f"{value:.6g}" for value in column.tolist()]


def result_json(
    result: Evaluation | Selection,
    *,
    spread: Spread | None = None,
    extra: Extra | None = None,
    folder: Path | None = None,
) -> str:
    """An evaluation or a selection as JSON text in SI; the path of the study file is relative to ``folder``."""
    data = result_data(result, folder=folder)
    if spread is not None:
        data["robustness"] = spread_data(spread)
    if extra is not None:
        data |= extra.data
    return json_text(data)


def result_data(result: Evaluation | Selection, *, folder: Path | None = None) -> dict[str, Any]:
    evaluation, selection = both(result)
    study = evaluation.study
    data = job_data(study, "size" if selection is None else "select") | {
        "study_file": _study_file(study.path, folder),
        **picked(result, "verdict", "feasible"),
        "objective": {
            "name": study.objective,
            "value": result.objective,
            "unit": study.objective_unit,
            "remark": "; ".join(uncounted(evaluation)),
        },
        "criteria": dict(sorted(evaluation.criteria.items())),
        "currency": study.prices.currency,
        "missing": [vars(gap) for gap in gaps(evaluation)],
        "joints": {
            task.name: _joint(evaluation.joints[task.name], task.housing_to_ambient)
            for task in study.joints
            if task.name in evaluation.joints
        },
        "shared": [_check(check) for check in evaluation.shared],
    }
    if selection is None:
        return data
    return data | _search(selection, counted(selection.rejected))


def _study_file(path: str, folder: Path | None) -> str | None:
    """Path of the study file relative to the folder of the result; None if the study has no file."""
    if not Path(path).is_file():
        return None
    try:
        return Path(os.path.relpath(path, folder or ".")).as_posix()
    except ValueError:  # on another Windows drive
        return str(Path(path).resolve())


CHECK = ("name", "actual", "factor", "required", "available", "unit", "utilisation")


def _check(check: Check) -> dict[str, Any]:
    """Data of one check; its remark states numbers that are not finite."""
    names = ("required", "available", "utilisation")
    endless = [name for name in names if (value := getattr(check, name)) is not None and not math.isfinite(value)]
    notes = [check.remark] if check.remark else []
    notes += [f"{name} is {'not a number' if math.isnan(getattr(check, name)) else 'infinite'}" for name in endless]
    return {
        **picked(check, *CHECK),
        "in_study_amperes": _amperes(check),
        **picked(check, "verdict", "time", "source"),
        "remark": "; ".join(notes),
    }


def _amperes(check: Check) -> dict[str, Any] | None:
    """A current in the convention of the study (rms or peak); None for other quantities and for dc."""
    if check.unit != "A" or check.current_basis == "dc":
        return None
    return {"basis": check.current_basis} | {name: check.entered(name) for name in ("actual", "required", "available")}


def _joint(joint: JointResult, mounting: float | None) -> dict[str, Any]:
    return {
        "verdict": joint.verdict,
        "drive": {"motor": joint.motor, "gear": joint.gear}
        | ({"brake": joint.brake} if joint.brake else {})
        | ({"amplifier": joint.amplifier.key} if joint.amplifier.key else {}),
        "parts": {"motor": identity(joint.drive.motor), "gear": identity(joint.drive.gear)},
        "heat_model": heat_model(joint.drive.motor, mounting),
        "binding": None if joint.binding is None else joint.binding.name,
        "checks": [_check(check) for check in joint.checks],
        "assumptions": joint.drive.assumptions,
        **picked(joint, "remarks", "gear_loss", "housing_temperature"),
    }


def _search(selection: Selection, by_check: dict[tuple[str, str], int]) -> dict[str, Any]:
    rejected: dict[str, dict[str, int]] = {joint: {} for joint in selection.evaluation.joints}
    for (joint, check), count in sorted(by_check.items(), key=lambda item: (-item[1], item[0])):
        rejected.setdefault(joint, {})[check] = count
    return {
        **picked(selection, "proof", "bound"),
        "equals": {"count": selection.equals, "all": selection.all_equals},
        "sets": [
            picked(one, "objective")
            | {"criteria": dict(sorted(one.criteria.items())), "drives": drives_data(one.drives)}
            for one in selection.best_sets
        ],
        "alternatives": {
            joint: [{"motor": motor, "gear": gear, "objective": share} for motor, gear, share in found]
            for joint, found in selection.alternatives.items()
        },
        "rejected": {"count": len(selection.rejected_pairs), "by_joint_and_check": rejected},
        **picked(selection, "advice", "notes"),
        "counters": dict(sorted(selection.counters.items())),
    }
