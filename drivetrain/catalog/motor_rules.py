"""Consistency rules for the values of one motor: data sheets are redundant, so mistakes can be detected."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping

from drivetrain.catalog.findings import LIMIT, Finding, differs, error, in_order, warning
from drivetrain.catalog.table import Cell, dc_equivalent
from drivetrain.drive.motor import COPPER_COEFFICIENT

Values = Mapping[str, float]

ELECTRICAL_TIME = (1e-6, 2e-2)  # s; 1051 sheets print 1.8e-6 to 7.0e-3
MECHANICAL_TIME = (1e-4, 0.5)  # s; 1043 sheets imply 4.8e-4 to 0.126
RADIUS_SHARE = (2e-3, 0.5)  # rotor inertia over mass times outer radius squared; 873 sheets print 0.0096 to 0.32
NOMINAL_TORQUE = (-0.10, 0.30)  # relative to kt (I - I0); flat motors have up to 24 % more, none has 10 % less
THERMAL_SURPLUS = 0.15  # nominal current above the thermal limit; 638 sheets: at most 14 % above, down to 51 % below
FRICTION_LIMIT = 0.15  # 67 sheets: at most 8.8 %
PEAK_LIMITS = (-0.35, 0.10)  # iron saturates, so the printed peak torque is the smaller one


# Printed values that follow from others: column, law, columns that it needs, and the function that computes it.
_RELATIONS: tuple[tuple[str, str, tuple[str, ...], Callable[[Values], float]], ...] = (
    (
        "no_load_speed", "(V - R I0)/kt", ("nominal_voltage", "resistance", "torque_constant"),
        lambda v: (v["nominal_voltage"] - v["resistance"] * v.get("no_load_current", 0.0)) / v["torque_constant"],
    ),
    (
        "stall_torque", "kt V/R", ("nominal_voltage", "resistance", "torque_constant"),
        lambda v: v["torque_constant"] * v["nominal_voltage"] / v["resistance"],
    ),
    ("stall_current", "V/R", ("nominal_voltage", "resistance"), lambda v: v["nominal_voltage"] / v["resistance"]),
    (
        "speed_torque_gradient", "R/kt^2", ("resistance", "torque_constant"),
        lambda v: v["resistance"] / v["torque_constant"] ** 2,
    ),
    (
        "mechanical_time_constant", "R J/kt^2", ("resistance", "torque_constant", "rotor_inertia"),
        lambda v: v["resistance"] * v["rotor_inertia"] / v["torque_constant"] ** 2,
    ),
    ("speed_constant", "1/kt", ("torque_constant",), lambda v: 1.0 / v["torque_constant"]),
)  # fmt: skip
_ORDERS = (
    (error, "no_load_current", "nominal_current", ""), (error, "nominal_current", "stall_current", ""),
    (error, "nominal_current", "peak_current", ""), (error, "nominal_torque", "stall_torque", ""),
    (error, "nominal_torque", "peak_torque", ""), (warning, "nominal_speed", "no_load_speed", ""),
    (warning, "winding_time_constant", "housing_time_constant", ""),
)  # fmt: skip


def check_motor(cells: Mapping[str, Cell]) -> list[Finding]:
    """All inconsistencies in the row of one motor."""
    values = {name: value for name, value in dc_equivalent(cells).items() if isinstance(value, float)}
    rules = (_redundancy, _peak_torque, _nominal_torque, _thermal, _friction, _time_constants, _rotor)
    findings = [*in_order(values, *_ORDERS), *(finding for rule in rules for finding in rule(values))]
    findings = [_as_in_row(finding, cells, values) for finding in findings]
    return findings + list(_convention(cells))


def _as_in_row(finding: Finding, cells: Mapping[str, Cell], values: Values) -> Finding:
    """The finding with its predicted value converted from the DC equivalent to the row's own convention."""
    printed, converted = cells.get(finding.column), values.get(finding.column)
    if finding.predicted is None or not isinstance(printed, float) or not converted:
        return finding
    return Finding(finding.column, finding.severity, finding.problem, finding.predicted * printed / converted)


def _redundancy(values: Values) -> Iterator[Finding]:
    for column, law, needs, predict in _RELATIONS:
        if column in values and all(name in values for name in needs):
            predicted = predict(values)
            difference = values[column] / predicted - 1.0
            if abs(difference) > LIMIT:
                yield error(column, differs(difference, law), predicted)


def _peak_torque(values: Values) -> Iterator[Finding]:
    if all(name in values for name in ("peak_torque", "peak_current", "torque_constant")):
        predicted = values["torque_constant"] * values["peak_current"]
        difference = values["peak_torque"] / predicted - 1.0
        if not PEAK_LIMITS[0] <= difference <= PEAK_LIMITS[1]:
            yield error("peak_torque", differs(difference, "kt times the peak current"), predicted)
        elif difference < -LIMIT:
            yield warning("peak_torque", differs(difference, "kt times the peak current"), predicted)


def _nominal_torque(values: Values) -> Iterator[Finding]:
    if all(name in values for name in ("nominal_torque", "nominal_current", "no_load_current", "torque_constant")):
        predicted = values["torque_constant"] * (values["nominal_current"] - values["no_load_current"])
        difference = values["nominal_torque"] / predicted - 1.0 if predicted > 0.0 else 0.0
        if not NOMINAL_TORQUE[0] <= difference <= NOMINAL_TORQUE[1]:
            yield warning("nominal_torque", differs(difference, "kt (I - I0)"), predicted)


def _thermal(values: Values) -> Iterator[Finding]:
    """The nominal current against the one that heats the winding to its limit at an ambient temperature of 25 C."""
    resistances = [values.get("resistance_winding_housing"), values.get("resistance_housing_ambient")]
    total = values.get("resistance_winding_ambient")
    if resistances[0] is not None and resistances[1] is not None:
        total = resistances[0] + resistances[1]
    limit = values.get("max_winding_temperature")
    if total is None or limit is None or "nominal_current" not in values or "resistance" not in values:
        return
    reference = values.get("reference_temperature", 25.0)
    hot = values["resistance"] * (1.0 + COPPER_COEFFICIENT * (limit - reference))
    predicted = math.sqrt(max(limit - 25.0, 0.0) / (hot * total))
    if values["nominal_current"] > (1.0 + THERMAL_SURPLUS) * predicted:
        difference = values["nominal_current"] / predicted - 1.0
        yield warning(
            "nominal_current", differs(difference, "the current that heats the winding to its limit"), predicted
        )


def _friction(values: Values) -> Iterator[Finding]:
    names = ("coulomb_friction", "viscous_friction", "no_load_speed", "no_load_current", "torque_constant")
    if all(name in values for name in names):
        friction = values["coulomb_friction"] + values["viscous_friction"] * values["no_load_speed"]
        predicted = friction / values["torque_constant"]
        difference = values["no_load_current"] / predicted - 1.0
        if abs(difference) > FRICTION_LIMIT:
            yield warning("no_load_current", differs(difference, "the friction at no-load speed over kt"), predicted)


def _time_constants(values: Values) -> Iterator[Finding]:
    if "inductance" in values and "resistance" in values:
        time = values["inductance"] / values["resistance"]
        if not ELECTRICAL_TIME[0] <= time <= ELECTRICAL_TIME[1]:
            yield error("inductance", f"makes L/R = {time:.2g} s; motors have {_span(ELECTRICAL_TIME)} s")
    if all(name in values for name in ("rotor_inertia", "resistance", "torque_constant")):
        time = values["rotor_inertia"] * values["resistance"] / values["torque_constant"] ** 2
        if not MECHANICAL_TIME[0] <= time <= MECHANICAL_TIME[1]:
            yield error("rotor_inertia", f"makes R J/kt^2 = {time:.2g} s; motors have {_span(MECHANICAL_TIME)} s")


def _rotor(values: Values) -> Iterator[Finding]:
    if all(name in values for name in ("rotor_inertia", "mass", "diameter")):
        whole = values["mass"] * (0.5 * values["diameter"]) ** 2
        share = values["rotor_inertia"] / whole
        if share > 1.0:
            problem = "is larger than that of the motor's whole mass at its outer radius"
            yield error("rotor_inertia", problem, RADIUS_SHARE[1] * whole)
        elif not RADIUS_SHARE[0] <= share <= RADIUS_SHARE[1]:
            yield warning("rotor_inertia", f"is {share:.2g} of mass times outer radius squared; usual: 0.01 to 0.3")


def _convention(cells: Mapping[str, Cell]) -> Iterator[Finding]:
    if cells.get("kind") == "brushed":
        if cells.get("current_basis") in ("rms", "peak"):
            yield error("current_basis", "a brushed motor carries direct current: dc")
        if cells.get("winding_basis") == "phase":
            yield error("winding_basis", "a brushed motor has no phases: line_line")


def _span(limits: tuple[float, float]) -> str:
    return f"{limits[0]:.2g} to {limits[1]:.2g}"
