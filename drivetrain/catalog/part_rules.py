"""What the numbers of one brake, one amplifier or one price must obey together."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from drivetrain.catalog.findings import LIMIT, Finding, differs, error, in_order, warning
from drivetrain.catalog.table import Cell

UNDATED = "not dated"  # how a price begins whose source tells no day


def check_brake(cells: Mapping[str, Cell]) -> list[Finding]:
    """Everything that one brake's row says against itself."""
    values = _numbers(cells)
    return [*_coil(values), *in_order(values, (error, "energy_per_stop", "energy_per_hour", ""))]


def check_amplifier(cells: Mapping[str, Cell]) -> list[Finding]:
    """The same of one amplifier."""
    values = _numbers(cells)
    found = list(
        in_order(values, (error, "continuous_current", "peak_current", ""), (error, "min_voltage", "max_voltage", ""))
    )
    if "peak_time" in values and "thermal_time_constant" in values:
        found.append(warning("peak_time", "stands beside a thermal time constant: two models of one overload"))
    if not cells.get("basis_evidence"):
        found.append(warning("basis_evidence", "is empty: say how the kind of ampere is known"))
    return found


def check_price(cells: Mapping[str, Cell]) -> list[Finding]:
    """The same of one price."""
    found = list(in_order(_numbers(cells), (error, "price", "price_to", "")))
    if not re.fullmatch("[A-Z]{3}", str(cells.get("currency") or "")):
        found.append(error("currency", "must be three letters such as EUR or USD"))
    if not re.match(rf"(?:19|20)\d\d\b|{UNDATED}", str(cells.get("date") or "")):
        found.append(warning("date", f"must begin with the year, as 2026-06, or with {UNDATED}"))
    return found


def _numbers(cells: Mapping[str, Cell]) -> dict[str, float]:
    return {name: cell for name, cell in cells.items() if isinstance(cell, float)}


def _coil(values: Mapping[str, float]) -> Iterator[Finding]:
    """Power against voltage and current."""
    if all(name in values for name in ("voltage", "current", "power")):
        predicted = values["voltage"] * values["current"]
        difference = values["power"] / predicted - 1.0
        if abs(difference) > LIMIT:
            yield error("power", differs(difference, "voltage times current"), predicted)
