"""Reads what commands take as input: a study, the file of `select --write`, or a result.json of a selection."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drivetrain.commands.shared import refuse, say, working

if TYPE_CHECKING:
    from drivetrain.sizing.results import Evaluation, Selection
    from drivetrain.study.model import Study


def load_chosen(path: Path) -> Study:
    """A study from its file; from a result.json, the study that it names with the drives of the result."""
    from drivetrain.errors import Fault, InputError
    from drivetrain.study.read import load_study

    if path.suffix.lower() != ".json":
        return load_study(path)
    data = _result(path)
    file = path.parent / data["study_file"]
    if not file.is_file():
        raise InputError(Fault("study_file", "does not exist any more", str(file), file=str(path)))
    study = load_study(file)
    if data["digest"] != study.digest:
        say(f"note: {file} has changed since {path} was written; the drives of the result are used", errors=True)
    drives = {name: (one["drive"]["motor"], one["drive"]["gear"]) for name, one in data["joints"].items()}
    return replace(study, joints=tuple(replace(one, drive=drives.get(one.name, one.drive)) for one in study.joints))


def load_joints(path: Path, wanted: list[str] | None, *others: str) -> tuple[Study, list[str]]:
    """A study as in ``load_chosen``, and the requested names of joints or of ``others`` (such as "supply")."""
    from drivetrain.errors import whole_names

    loaded = load_chosen(path)
    known = [*(one.name for one in loaded.joints), *others]
    return loaded, whole_names("--joint", "joint of the study", wanted or (), known)


def _result(path: Path) -> dict[str, Any]:
    from drivetrain.errors import Fault, InputError
    from drivetrain.whole_files import read_bytes

    hint = "write one with `drivetrain select STUDY`"
    try:
        data = json.loads(read_bytes(path))
    except FileNotFoundError:
        raise InputError(Fault("the result", "does not exist", str(path), hint)) from None
    except InputError:
        raise
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(Fault("the result", f"cannot be read: {error}", str(path), hint)) from None
    try:
        drives = [one["drive"]["motor"] + one["drive"]["gear"] for one in data["joints"].values()]
        if all(isinstance(one, str) for one in (data["study_file"], data["digest"], *drives)):
            return dict(data)
    except (TypeError, KeyError, AttributeError):
        pass
    raise InputError(Fault("the result", "is no result.json with a study_file", str(path), hint))


def chosen(study: Study, *, runs: bool = False) -> Evaluation:
    """The evaluation of the study's drives, or of selected ones if it does not name all; as in a run if it ``runs``."""
    from drivetrain.sizing.judge.evaluate import evaluate
    from drivetrain.sizing.results import every_drive
    from drivetrain.sizing.search.search import select

    if runs:
        from drivetrain.simulation.study_scene import refuse_unsimulated
        from drivetrain.sizing.as_one import judged_to_run

        refuse_unsimulated(study)
    if study.gives_all_drives:
        with working("checking the given drives"):
            return judged_to_run(evaluate(study)) if runs else evaluate(study)
    say("note: the study does not name all drives; they are selected first", errors=True)
    with working("searching the catalogues for drives") as step:
        found = select(study, progress=step)
    evaluation = every_drive(found)
    if not found.drives:
        say("note: no set of drives fits; the closest candidates are used", errors=True)
    elif not found.feasible:
        say("note: the drives are not proven to fit: data are missing", errors=True)
    return judged_to_run(evaluation) if runs else evaluation


def _unstaged(study: Study, gear: str) -> str:
    """The catalogue's key of a gear without the study's stages; empty if the stages follow a direct drive."""
    rows = study.catalog.gears
    if gear not in rows or not rows[gear].staged:
        return gear
    return max((key for key in rows if not rows[key].staged and gear.startswith(f"{key}+")), key=len, default="")


def write_chosen(selection: Selection, target: Path) -> None:
    from drivetrain.drive.motor import bare_key
    from drivetrain.study.written import with_drives
    from drivetrain.whole_files import write_files

    study = selection.study
    itself = target.exists() and target.samefile(study.path)
    refuse(itself, "--write", "is the study itself", str(target), "name another file")
    if not selection.drives:
        say(f"not written: {target}, as no set of drives fits", errors=True)
        return
    drives: dict[str, dict[str, str]] = {}
    for task in study.joints:
        joint, named = selection.evaluation.joints[task.name], dict[str, str]()
        if task.axis_name != task.name:  # the study names the drive of the two motors of an axis only once
            continue
        if task.drive is None:
            named = {"motor": bare_key(joint.drive.motor), "gear": _unstaged(study, joint.gear)}
        if task.brakes and joint.brake:
            named["brake"] = joint.brake
        if task.amplifiers and joint.amplifier.key:
            both = [selection.evaluation.joints[name].amplifier for name in task.sharing or (task.name,)]
            named["amplifier"] = max(both, key=task.amplifiers.index).key  # of two motors, that of the larger load
        if named:
            drives[task.name] = named
    write_files(target.parent, {target.name: with_drives(study.path, target, drives)})
    say(f"study with its drives: {target}", errors=True)
