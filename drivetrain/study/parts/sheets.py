"""The data sheets of a study: its catalogues, its own rows, and assumed values where they give none."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from drivetrain.catalog.price import Offer, Price, offer_of
from drivetrain.catalog.read import MOST_NAMED, Catalog, read_catalog
from drivetrain.catalog.schema import GEAR_KINDS
from drivetrain.catalog.table import dc_equivalent
from drivetrain.drive.brake import Brake
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.errors import Fault, InputError, nearest
from drivetrain.study.faults import Ledger
from drivetrain.study.form import Form, made
from drivetrain.study.model import GearAssumption, MotorAssumption, Prices
from drivetrain.study.schema import AssumptionsForm, StudyForm
from drivetrain.whole_files import shipped

SHIPPED_CATALOG = "shipped"  # name of the catalogue that comes with the package
MOTOR_GROUPS = ("brushed", "brushless", "frameless")
ASSUMPTIONS = Path(__file__).with_name("assumptions.yaml")

SHEETS: dict[str, type[Any]] = {"motors": Motor, "gears": Gear, "brakes": Brake}  # tables of a study's own rows


def catalog_folders(form: StudyForm, folder: Path) -> list[Path]:
    return [shipped("catalogs") if name == SHIPPED_CATALOG else folder / name for name in form.catalogs]


def resolve_catalog(form: StudyForm, ledger: Ledger) -> Catalog:
    """The catalogue of a study; its own rows replace those of the same key in its folders."""
    catalog = Catalog()
    folders = catalog_folders(form, ledger.document.folder)
    with ledger.gather(("catalogs",)):
        catalog = read_catalog(*folders) if folders else catalog  # `catalogs: []` means the study's own rows alone
    own = {part: _own(getattr(form, part), kind, part, ledger) for part, kind in SHEETS.items()}
    listed = {key for part in own for key in getattr(catalog, part)}
    replaced = [key for rows in own.values() for key in rows if key in listed]
    if replaced:
        ledger.note([f"The study's own rows replace those of the catalogue: {', '.join(replaced)}."])
    merged: dict[str, Any] = {part: {**getattr(catalog, part), **rows} for part, rows in own.items()}
    whole = replace(catalog, **merged)
    return whole if form.prices is None else _priced(whole, made(form.prices), ledger)


def _priced(catalog: Catalog, wanted: Prices, ledger: Ledger) -> Catalog:
    """The catalogue with the prices of ``prices.csv`` for rows without one, converted to the study's currency.

    A price whose currency has no rate is a fault.
    """
    if not re.fullmatch("[A-Z]{3}", wanted.currency):
        ledger.fault(("prices", "currency"), "must be three capital letters such as EUR", wanted.currency)
        return catalog
    offers: dict[str, list[Price]] = {}
    for price in catalog.prices:
        offers.setdefault(price.part_key, []).append(price)
    found: dict[str, Offer] = {}
    tables = {name: getattr(catalog, name) for name in ("motors", "gears", "brakes", "amplifiers")}
    for key, row in ((key, row) for rows in tables.values() for key, row in rows.items() if key in offers):
        offer = offer_of(offers[key], wanted.currency, wanted.rates)
        if row.price is None and offer is None:
            other = offers[key][0].currency
            problem = f"needs {other}: the price of {key} is in it, and currencies are not mixed"
            hint = f"such as {{{other}: 0.9}}: {wanted.currency} for one {other}"
            ledger.fault(("prices", "rates"), problem, hint=hint)
        elif row.price is None and offer is not None:
            found[key] = offer
    guessed = [key for key, offer in found.items() if offer.estimate]
    if found:
        text = f"; estimates are those of {', '.join(guessed[:MOST_NAMED])}" if guessed else ""
        ledger.note([f"{len(found)} rows without a price have that of prices.csv, in {wanted.currency}{text}."])
    priced: dict[str, Any] = {name: _with_offers(rows, found) for name, rows in tables.items()}
    return replace(catalog, **priced)


def _with_offers(rows: Mapping[str, Any], offers: Mapping[str, Offer]) -> dict[str, Any]:
    """Rows of one table with the prices of their offers and the source of these."""
    priced = {
        key: replace(rows[key], price=offer.value, source=f"{rows[key].source}; {offer.words}")
        for key, offer in offers.items() if key in rows
    }  # fmt: skip
    return {**rows, **priced}


def _own(forms: Mapping[str, Form], kind: type[Any], part: str, ledger: Ledger) -> dict[str, Any]:
    known = {item.name for item in fields(kind)}
    sheets: dict[str, Any] = {}
    for key, form in forms.items():
        cells: dict[str, Any] = {name: value for name, value in form.model_dump().items() if value is not None}
        converted: dict[str, Any] = dc_equivalent(cells) if kind is Motor else cells
        with ledger.gather((part, key)):
            sheets[key] = kind(key=key, **{name: value for name, value in converted.items() if name in known})
    return sheets


def resolve_assumptions(
    own: AssumptionsForm, ledger: Ledger
) -> tuple[dict[str, GearAssumption], dict[str, MotorAssumption]]:
    """The assumptions by gear kind and by motor group: the study's own entry replaces the shipped one as a whole."""
    shipped = shipped_assumptions()
    for part, known in (("gears", GEAR_KINDS), ("motors", MOTOR_GROUPS)):
        for kind in getattr(own, part):
            if kind not in known:
                ledger.fault(("assumptions", part, kind), "is no kind to assume for", hint=nearest(kind, known))
    gears = {kind: made(one) for kind, one in {**shipped.gears, **own.gears}.items()}
    motors = {kind: made(one) for kind, one in {**shipped.motors, **own.motors}.items()}
    return gears, motors


def shipped_assumptions() -> AssumptionsForm:
    """The defaults that ship with the package."""
    try:
        data: Any = yaml.safe_load(ASSUMPTIONS.read_text(encoding="utf-8"))
        return AssumptionsForm.model_validate(data)
    except (yaml.YAMLError, ValidationError) as error:
        raise InputError(Fault("shipped assumptions", f"cannot be read: {error}", file=ASSUMPTIONS.name)) from None
