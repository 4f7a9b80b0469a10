"""Files of an identification: a study that can be sized, its arm, tables and a report page."""

from __future__ import annotations

import os
from dataclasses import fields, replace
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from drivetrain.arm.arm import STANDARD_GRAVITY
from drivetrain.drive.friction import Friction
from drivetrain.errors import Fault, InputError
from drivetrain.export.urdf import urdf_text
from drivetrain.identification.fit import Identification
from drivetrain.study.document import read_document, varied
from drivetrain.study.written import written
from drivetrain.whole_files import write_files

STYLE = (
    ":root{color-scheme:light dark}svg{background:#fff}"
    "body{font:15px/1.5 sans-serif;max-width:70em;margin:2em auto;padding:0 1em}table{border-collapse:collapse}"
    "td,th{padding:.15em .7em;text-align:right;border-bottom:1px solid #ddd}th{text-align:left}img{max-width:100%}"
)
ERRORS = {"given": "error of the given model", "identified": "error of the identified model"}


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
    import io

    from matplotlib.figure import Figure

    picture, names = io.StringIO(), found.arm.joint_names
    figure = Figure(figsize=(9.0, 1.8 * len(names)), layout="constrained")
    for ax, name in zip(figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0], names, strict=True):
        found.plot(ax, joint=name)
    figure.savefig(picture, format="svg")
    svg = picture.getvalue()
    tables = {
        "RMS torque on data held out [N m or N]": found.errors.rename(columns=ERRORS),
        "RMS torque of each contribution [N m or N]": found.contributions,
        "Combinations of parameters that the motion can distinguish": found.base,
        "All parameters": found.parameters,
    }
    parts = [
        f"<h2>{escape(title)}</h2>{table.to_html(float_format=_short, border=0)}" for title, table in tables.items()
    ]
    notes = "".join(f"<li>{escape(note)}</li>" for note in found.notes)
    body = (
        f"<h1>Identification of {escape(found.arm.name)}</h1><ul>{notes}</ul>{svg[svg.index('<svg') :]}{''.join(parts)}"
    )
    head = f"<!doctype html><html lang=en><meta charset=utf-8><title>Identification</title><style>{STYLE}</style>"
    return f"{head}{body}</html>\n"


def _short(value: float) -> str:
    return f"{value:.4g}"
