"""The verdict for machines: ``result.json``."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

from drivetrain.drive.amplifier import from_dc
from drivetrain.report.json_text import json_text, plain
from drivetrain.report.pages.sheet import Extra
from drivetrain.report.pages.spread_section import spread_data
from drivetrain.report.rejected import counted
from drivetrain.report.words import heat_model, identity
from drivetrain.sizing.answers.spread import Spread
from drivetrain.sizing.judge.missing import Gap, gaps, uncounted
from drivetrain.sizing.results import DriveSet, Evaluation, JointResult, Selection
from drivetrain.study.parts.verdicts import Check
from drivetrain.version import __version__

SCHEMA_VERSION = 1  # rises when a key is taken away or changes its meaning; new keys may come without


def result_json(
    result: Evaluation | Selection,
    *,
    spread: Spread | None = None,
    extra: Extra | None = None,
    folder: Path | None = None,
) -> str:
    """An evaluation or a selection as JSON text.

    Args:
        folder: Where it will stand, from which it names the study's file; None: the working directory.

    Returns:
        JSON with a ``schema_version``; numbers in SI, null where a number is unknown or not finite; the same result
        gives the same bytes.
    """
    data = result_data(result, folder=folder)
    if spread is not None:
        data["robustness"] = plain(spread_data(spread))
    if extra is not None:
        data |= plain(extra.data)
    return json_text(data)


def result_data(result: Evaluation | Selection, *, folder: Path | None = None) -> dict[str, Any]:
    """An evaluation or a selection as plain data."""
    selection = result if isinstance(result, Selection) else None
    evaluation = result.evaluation if isinstance(result, Selection) else result
    study = evaluation.study
    data: dict[str, Any] = {
        "schema_version": SCHEMA_VERSION,
        "drivetrain": __version__,
        "study": study.name,
        "study_file": _study_file(study.path, folder),
        "digest": study.digest,
        "job": "size" if selection is None else "select",
        "verdict": str(result.verdict),
        "feasible": result.feasible,
        "objective": {
            "name": study.objective,
            "value": _finite(result.objective),
            "unit": _objective_unit(evaluation),
            "remark": "; ".join(uncounted(evaluation)),
        },
        "criteria": {name: _finite(value) for name, value in sorted(evaluation.criteria.items())},
        "currency": study.prices.currency,
        "missing": [_gap(gap) for gap in gaps(evaluation)],
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
    """The study's file from the folder of the result; None where it has none."""
    if not Path(path).is_file():
        return None
    try:
        return Path(os.path.relpath(path, folder or ".")).as_posix()
    except ValueError:  # another drive of Windows
        return str(Path(path).resolve())


def _objective_unit(evaluation: Evaluation) -> str:
    """Nothing for a price where nobody says the currency, and for a weighted sum."""
    return {"mass": "kg", "energy": "J", "price": evaluation.study.prices.currency}.get(evaluation.study.objective, "")


def _finite(value: float | None) -> float | None:
    """A number that JSON can hold; None for NaN and infinity."""
    return None if value is None or not math.isfinite(value) else float(value)


def _gap(gap: Gap) -> dict[str, Any]:
    """A number that a sheet lacks; any one of the columns fills it."""
    return {**vars(gap), "columns": list(gap.columns), "checks": list(gap.checks)}


def _check(check: Check) -> dict[str, Any]:
    """One check; says in the remark which number was not finite."""
    names = ("required", "available", "utilisation")
    endless = [name for name in names if (value := getattr(check, name)) is not None and not math.isfinite(value)]
    notes = [check.remark] if check.remark else []
    notes += [f"{name} is {'not a number' if math.isnan(getattr(check, name)) else 'infinite'}" for name in endless]
    return {
        "name": check.name,
        "actual": _finite(check.actual),
        "factor": check.factor,
        "required": _finite(check.required),
        "available": _finite(check.available),
        "unit": check.unit,
        "utilisation": _finite(check.utilisation),
        "in_study_amperes": _amperes(check),
        "verdict": str(check.verdict),
        "time": _finite(check.time),
        "source": check.source,
        "remark": "; ".join(notes),
    }


def _amperes(check: Check) -> dict[str, Any] | None:
    """A current in the ampere that the study uses; nothing for what is none, or where both are one."""
    if check.unit != "A" or check.current_basis == "dc":
        return None
    values = {name: _finite(getattr(check, name)) for name in ("actual", "required", "available")}
    return {"basis": check.current_basis} | {
        name: None if value is None else from_dc(value, check.current_basis) for name, value in values.items()
    }


def _joint(joint: JointResult, mounting: float | None) -> dict[str, Any]:
    """One joint: its drive and every check."""
    return {
        "verdict": str(joint.verdict),
        "drive": {"motor": joint.motor, "gear": joint.gear}
        | ({"brake": joint.brake} if joint.brake else {})
        | ({"amplifier": joint.amplifier.key} if joint.amplifier.key else {}),
        "parts": {"motor": identity(joint.drive.motor), "gear": identity(joint.drive.gear)},
        "heat_model": heat_model(joint.drive.motor, mounting),
        "binding": None if joint.binding is None else joint.binding.name,
        "checks": [_check(check) for check in joint.checks],
        "assumptions": list(joint.drive.assumptions),
        "remarks": list(joint.remarks),
        "gear_loss": _finite(joint.gear_loss),
        "housing_temperature": _finite(joint.housing_temperature),
    }


def _set(one: DriveSet) -> dict[str, Any]:
    """One of the best sets."""
    return {
        "objective": _finite(one.objective),
        "criteria": {name: _finite(value) for name, value in sorted(one.criteria.items())},
        "drives": {joint: {"motor": motor, "gear": gear} for joint, (motor, gear) in one.drives.items()},
    }


def _search(selection: Selection, by_check: dict[tuple[str, str], int]) -> dict[str, Any]:
    """What only a selection knows."""
    rejected: dict[str, dict[str, int]] = {joint: {} for joint in selection.evaluation.joints}
    for (joint, check), count in sorted(by_check.items(), key=lambda item: (-item[1], item[0])):
        rejected.setdefault(joint, {})[check] = count
    return {
        "proof": selection.proof,
        "bound": _finite(selection.bound),
        "equals": {"count": selection.equals, "all": selection.all_equals},
        "sets": [_set(one) for one in selection.best_sets],
        "alternatives": {
            joint: [{"motor": motor, "gear": gear, "objective": _finite(share)} for motor, gear, share in found]
            for joint, found in selection.alternatives.items()
        },
        "fallen": {"count": len(selection.fallen), "by_joint_and_check": rejected},
        "advice": list(selection.advice),
        "notes": list(selection.notes),
        "counters": dict(sorted(selection.counters.items())),
    }
