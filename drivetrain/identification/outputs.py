"""Files of an identification: a study that can be sized, its arm, tables and a report page."""

from __future__ import annotations

import os
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from drivetrain.arm.arm import STANDARD_GRAVITY
from drivetrain.drive.friction import Friction
from drivetrain.errors import Fault, InputError
from drivetrain.export.urdf import urdf_text
from drivetrain.identification.fit import Identification
from drivetrain.report.charts.chart import Chart, Mark, captioned
from drivetrain.report.pages.sheet import Section, SheetTable, sheet
from drivetrain.report.quantities import number, percent, printed_unit
from drivetrain.study.document import read_document, varied
from drivetrain.study.written import written
from drivetrain.whole_files import write_files

if TYPE_CHECKING:
    import pandas as pd


def write_identification(found: Identification, folder: str | Path) -> dict[str, Path]:
    """Write the identified study, its arm, tables and a report page.

    Args:
        found: The identification; without a study, no study file is written.
        folder: Folder for the files; it is created if it does not exist.

    Returns:
        Paths of the files by name: ``study.yaml``, ``arm.urdf``, ``parameters.csv``, ``base.csv``, ``report.html``.

    Raises:
        InputError: An arm that URDF cannot represent, or a folder that cannot be written.
    """
    arm = replace(found.arm, coupling=None)  # the study contains the coupling
    texts = {
        "arm.urdf": urdf_text(arm),
        "parameters.csv": found.parameters.to_csv(index_label="parameter"),
        "base.csv": found.base.to_csv(index_label="parameter"),
        "report.html": identification_page(found),
    }
    if found.study is not None:
        texts["study.yaml"] = _study_text(found, Path(folder))
    return write_files(folder, texts)


def _study_text(found: Identification, folder: Path) -> str:
    study = found.study
    if study is None or not Path(study.path).is_file():
        raise InputError(Fault("study", "was not read from a file that is still there"))
    before = read_document(study.path)
    arm = os.path.relpath(folder / "arm.urdf", before.folder)  # ``written`` makes it relative to the new file
    entries: dict[tuple[Any, ...], Any] = {("arm",): arm, ("name",): study.name}
    if not np.array_equal(found.arm.gravity, STANDARD_GRAVITY):
        entries["gravity",] = [float(g) for g in found.arm.gravity]
    joints = dict(before.data.get("joints", {}))
    for name, law in zip(found.arm.joint_names, found.friction, strict=True):
        joints[name] = {**(joints.get(name) or {}), "friction": _stated(law)}
    document = varied(before, {**entries, ("joints",): joints})
    document.data.pop("tip", None)
    return written(document, folder)


def _stated(law: Friction) -> dict[str, Any]:
    units = {"viscous": " N m s/rad", "coulomb": " N m", "static": " N m"}
    units |= dict.fromkeys(("stribeck_speed", "tanh_speed"), " rad/s")
    given = {field.name: getattr(law, field.name) for field in fields(law)}
    return {
        name: f"{value:.9g}{units.get(name.removesuffix('_negative'), '')}"
        for name, value in given.items()
        if value is not None and name != "stribeck_exponent"
    }


def identification_page(found: Identification) -> str:
    """The report as a page that needs nothing from outside."""
    sections = [_result(found), _torques(found), *_parameters(found)]
    return sheet(found.study, "Identification", sections, name=found.arm.name)


def _result(found: Identification) -> Section:
    names, errors = found.arm.joint_names, _rows(found.errors)
    better = [name for name in names if errors[name]["identified"] < errors[name]["given"]]
    lead = (
        f"On data that were not used for the fit, the identified model is closer to the measured torque than the given "
        f"model at {len(better)} of {len(names)} joints."
    )
    rows = tuple(
        (name, *(number(errors[name][column], 4) for column in ("measured", "given", "identified")),
         _unit(found, i), number(errors[name]["correlation"], 4))
        for i, name in enumerate(names)
    )  # fmt: skip
    headings = (
        "joint", "measured, RMS", "RMS error of the given model", "RMS error of the identified model", "unit",
        "correlation with the identified model",
    )  # fmt: skip
    shares = _rows(found.contributions.round(9))  # friction that was found to be none is 1e-100
    causes = tuple(
        (name, *(number(value, 4) for value in shares[name].values()), _unit(found, i)) for i, name in enumerate(names)
    )
    tables = (
        SheetTable(headings, rows, "Torque on data held out", (1, 2, 3, 5)),
        SheetTable(("joint", *found.contributions.columns, "unit"), causes, "RMS torque of each contribution",
                   tuple(range(1, 1 + len(found.contributions.columns)))),
    )  # fmt: skip
    word, css = ("better", "pass") if len(better) == len(names) else ("not better at every joint", "marginal")
    return Section("Result", "result", word, css, (lead,), tables=tables, notes=found.notes)


def _rows(table: pd.DataFrame) -> dict[str, dict[str, Any]]:
    """The rows of a table by their names."""
    return {str(name): {str(key): row[key] for key in row} for name, row in table.to_dict("index").items()}


def _unit(found: Identification, joint: int) -> str:
    return "N" if found.arm.slides[joint] else "N m"


def _torques(found: Identification) -> Section:
    charts = []
    for i, name in enumerate(found.arm.joint_names):
        unit = _unit(found, i)
        marks = [
            Mark("line", found.time, found.measured[:, i], label="measured", colour="muted", alpha=0.7),
            Mark("line", found.time, found.modelled[:, i], label="identified model", size=1.0),
        ]
        label = f"{'torque' if unit == 'N m' else 'force'} [{unit}]"
        ends = (float(found.time[0]), float(found.time[-1]))
        about = f"measured and modelled {label} of {name} over time"
        charts.append(Chart(about, "time [s]", label, marks, ends, height=220, title=name, joined="torque"))
    caption = "Torque at the joints, measured and by the model that was identified from all data."
    return Section("Measured and modelled torque", "torque", figures=captioned(charts, caption))


def _parameters(found: Identification) -> tuple[Section, Section]:
    base = tuple(
        (row["combination"], _unit_of(name), number(row["value"], 4), number(row["deviation"], 2))
        for name, row in _rows(found.base).items()
    )
    every = tuple(
        (name.partition(" [")[0], _unit_of(name), number(row["prior"], 4), number(row["identified"], 4),
         number(row["deviation"], 2), percent(row["share"]))
        for name, row in _rows(found.parameters).items()
    )  # fmt: skip
    about = (
        "hx, hy, hz are mass times centre of mass. They and the inertias are about the joint's point, in the axes of "
        "the base with all joints at zero.",
        "Remaining uncertainty: the standard deviation that recording and prior leave together, divided by that of the "
        "prior. Near 100 % the recording adds nothing to what was given, and the value is that of the prior.",
        "A standard deviation of ∞: the recording determines the parameter only together with others, or not at all.",
    )
    return (
        Section("Combinations that the motion can distinguish", "base", lead=(
            "Torques depend on these combinations of parameters only.",
        ), tables=(SheetTable(("combination", "unit", "value", "standard deviation"), base, "", (2, 3)),)),
        Section("All parameters", "parameters", tables=(
            SheetTable(("parameter", "unit", "prior", "identified", "standard deviation", "remaining uncertainty"),
                       every, "", (2, 3, 4, 5)),
        ), notes=about),
    )  # fmt: skip


def _unit_of(name: str) -> str:
    return printed_unit(name.partition(" [")[2].removesuffix("]"))
