"""Consistency rules for the values of one motor: data sheets are redundant, so mistakes can be detected."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from drivetrain.catalog.findings import ANY, Finding, Relation, Values, conflicts, error, in_order, numbers, warning
from drivetrain.catalog.table import Cell, dc_equivalent
from drivetrain.drive.motor import COPPER_COEFFICIENT

ELECTRICAL_TIME = (1e-6, 2e-2)  # s; 1051 sheets print 1.8e-6 to 7.0e-3
MECHANICAL_TIME = (1e-4, 0.5)  # s; 1043 sheets imply 4.8e-4 to 0.126
RADIUS_SHARE = (2e-3, 0.5)  # rotor inertia over mass times outer radius squared; 873 sheets print 0.0096 to 0.32
NOMINAL_TORQUE = (-0.10, 0.30)  # relative to kt (I - I0); flat motors have up to 24 % more, none has 10 % less
THERMAL_SURPLUS = 0.15  # nominal current above the thermal limit; 638 sheets: at most 14 % above, down to 51 % below
RIM_SPEED = 40.0  # m/s, of a rotor whose mass is that of the motor; 116 shipped rows have 2.3 to 17
FRICTION_LIMIT = 0.15  # 67 sheets: at most 8.8 %
PEAK_LIMITS = (-0.35, 0.10)  # iron saturates, so the printed peak torque is the smaller one
PEAK_USUAL = (-0.10, math.inf)


def _thermal_current(v: Values) -> float:
    """The current that heats the winding to its limit at an ambient temperature of 25 C [A]."""
    if "resistance_winding_housing" in v and "resistance_housing_ambient" in v:
        total = v["resistance_winding_housing"] + v["resistance_housing_ambient"]
    else:
        total = v["resistance_winding_ambient"]
    limit, reference = v["max_winding_temperature"], v.get("reference_temperature", 25.0)
    hot = v["resistance"] * (1.0 + COPPER_COEFFICIENT * (limit - reference))
    return math.sqrt(max(limit - 25.0, 0.0) / (hot * total))


# Data sheets print more than they need: these values follow from others.
_RELATIONS = (
    Relation("no_load_speed", "(V - R I0)/kt", lambda v:
             (v["nominal_voltage"] - v["resistance"] * v.get("no_load_current", 0.0)) / v["torque_constant"]),
    Relation("stall_torque", "kt V/R", lambda v: v["torque_constant"] * v["nominal_voltage"] / v["resistance"]),
    Relation("stall_current", "V/R", lambda v: v["nominal_voltage"] / v["resistance"]),
    Relation("speed_torque_gradient", "R/kt^2", lambda v: v["resistance"] / v["torque_constant"] ** 2),
    Relation("mechanical_time_constant", "R J/kt^2", lambda v:
             v["resistance"] * v["rotor_inertia"] / v["torque_constant"] ** 2),
    Relation("speed_constant", "1/kt", lambda v: 1.0 / v["torque_constant"]),
    Relation("peak_torque", "kt times the peak current", lambda v: v["torque_constant"] * v["peak_current"],
             error=PEAK_LIMITS, warning=PEAK_USUAL),
    Relation("nominal_torque", "kt (I - I0)", lambda v:
             max(v["torque_constant"] * (v["nominal_current"] - v["no_load_current"]), 0.0),
             error=ANY, warning=NOMINAL_TORQUE),
    Relation("nominal_current", "the current that heats the winding to its limit", _thermal_current,
             error=ANY, warning=(-math.inf, THERMAL_SURPLUS)),
    Relation("no_load_current", "the friction at no-load speed over kt", lambda v:
             (v["coulomb_friction"] + v["viscous_friction"] * v["no_load_speed"]) / v["torque_constant"],
             error=ANY, warning=(-FRICTION_LIMIT, FRICTION_LIMIT)),
)  # fmt: skip
_ORDERS = (
    (error, "no_load_current", "nominal_current", ""), (error, "nominal_current", "stall_current", ""),
    (error, "nominal_current", "peak_current", ""), (error, "nominal_torque", "stall_torque", ""),
    (error, "nominal_torque", "peak_torque", ""), (warning, "nominal_speed", "no_load_speed", ""),
    (warning, "winding_time_constant", "housing_time_constant", ""),
)  # fmt: skip


def check_motor(cells: Mapping[str, Cell]) -> list[Finding]:
    """All inconsistencies in the row of one motor."""
    values = numbers(dc_equivalent(cells))
    found = [*in_order(values, *_ORDERS), *conflicts(values, _RELATIONS), *_time_constants(values)]
    findings = [_as_in_row(finding, cells, values) for finding in (*found, *_rotor(values))]
    return findings + list(_convention(cells))


def _as_in_row(finding: Finding, cells: Mapping[str, Cell], values: Values) -> Finding:
    """The finding with its predicted value converted from the DC equivalent to the row's own convention."""
    printed, converted = cells.get(finding.column), values.get(finding.column)
    if finding.predicted is None or not isinstance(printed, float) or not converted:
        return finding
    return Finding(finding.column, finding.severity, finding.problem, finding.predicted * printed / converted)


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
    if all(name in values for name in ("rotor_inertia", "mass", "max_speed")):
        rim = math.sqrt(2.0 * values["rotor_inertia"] / values["mass"]) * values["max_speed"]
        if rim > RIM_SPEED:
            turns = values["max_speed"] * 30.0 / math.pi
            problem = f"is {turns:.0f} rpm, at which the rotor's rim has {rim:.2g} m/s; motors have up to 20 m/s"
            yield error("max_speed", f"{problem}: are rpm given as rad/s, or g cm^2 as kg cm^2?")


def _convention(cells: Mapping[str, Cell]) -> Iterator[Finding]:
    if cells.get("kind") == "brushed":
        if cells.get("current_basis") in ("rms", "peak"):
            yield error("current_basis", "a brushed motor carries direct current: dc")
        if cells.get("winding_basis") == "phase":
            yield error("winding_basis", "a brushed motor has no phases: line_line")


def _span(limits: tuple[float, float]) -> str:
    return f"{limits[0]:.2g} to {limits[1]:.2g}"
