"""The rows a study may choose from: its catalogue folders, and the motors and gears written into the study itself."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, TypeVar

from drivetrain.catalog.convention import dc_equivalent
from drivetrain.catalog.read import Catalog, read_catalog
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.shipped import shipped
from drivetrain.study.form import Form
from drivetrain.study.ledger import Ledger
from drivetrain.study.schema import StudyForm

SHIPPED = "shipped"  # what a study calls the catalogue that comes with the package

Sheet = TypeVar("Sheet", Motor, Gear)


def catalog_folders(form: StudyForm, folder: Path) -> list[Path]:
    """The catalogue folders a study names."""
    return [shipped("catalogs") if name == SHIPPED else folder / name for name in form.catalogs]


def resolve_catalog(form: StudyForm, ledger: Ledger) -> Catalog:
    """The rows of a study: a row of the study itself replaces one of the same key in a folder."""
    catalog = Catalog()
    folders = catalog_folders(form, ledger.document.folder)
    with ledger.gather(("catalogs",)):
        catalog = read_catalog(*folders) if folders else catalog  # `catalogs: []` means the study's own rows alone
    motors = _own(form.motors, Motor, "motors", ledger)
    gears = _own(form.gears, Gear, "gears", ledger)
    replaced = [key for key in (*motors, *gears) if key in catalog.motors or key in catalog.gears]
    if replaced:
        ledger.note([f"The study's own rows replace those of the catalogue: {', '.join(replaced)}."])
    return replace(catalog, motors={**catalog.motors, **motors}, gears={**catalog.gears, **gears})


def _own(forms: Mapping[str, Form], kind: type[Sheet], part: str, ledger: Ledger) -> dict[str, Sheet]:
    """The sheets written into the study."""
    known = {item.name for item in fields(kind)}
    sheets: dict[str, Sheet] = {}
    for key, form in forms.items():
        cells: dict[str, Any] = {name: value for name, value in form.model_dump().items() if value is not None}
        told: dict[str, Any] = dc_equivalent(cells) if kind is Motor else cells
        with ledger.gather((part, key)):
            sheets[key] = kind(key=key, **{name: value for name, value in told.items() if name in known})
    return sheets
