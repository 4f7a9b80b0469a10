"""Applies the table of checks to one drive and to the common supply: numbers, verdicts, instants, remarks."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.amplifier import BusPeak, Supply, bus_peak, motor_basis
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.records import known
from drivetrain.sizing.judge.checks import CHECKS, GEAR, SUPPLY_CHECKS, TORQUE, Requirement
from drivetrain.sizing.judge.judge import in_doubt, utilisation
from drivetrain.sizing.judge.operation import Operation
from drivetrain.study.model import Study
from drivetrain.study.parts.verdicts import Check, Verdict


def checks_of(op: Operation) -> tuple[Check, ...]:
    """All checks of one drive; gear checks only if there is a gear, optional checks only if they apply."""
    rows = [row for row in CHECKS if not ((row.of_gear or row.stage == GEAR) and op.direct)]
    return tuple(as_check(op, row) for row in rows if not row.optional or op.number(row.applies) != 0.0)


def as_check(op: Operation, row: Requirement) -> Check:
    """The result of one check of the table for a drive."""
    factor = op.number(row.factor)
    basis = str(motor_basis(op.drive.motor.kind, op.task.amplifier.current_basis))
    if row.stage >= TORQUE and op.missing:
        lack = f"cannot be computed without {op.missing}, not in the catalogue row and not assumed"
        return Check(
            row.name, None, None, row.unit, None, Verdict.NOT_CHECKED, remark=lack, essential=row.essential,
            factor=factor, current_basis=basis,
        )  # fmt: skip
    words = row.words(op, row)
    required = _number(op.number(row.required) * factor * row.scale)
    limit = None if words.silent else _number(op.number(row.limit) * row.scale)
    assumed = row.assumption if limit is None and not words.silent else ""
    limit = _number(op.number(row.assumed_limit) * row.scale) if assumed else limit
    endless = required is not None and math.isinf(required)
    used = op.utilisation(row) if required is not None and (endless or limit is not None) else None
    instant = None if required is None or endless else op.instant(row.instant)
    more, remark, source = op.number(row.allowance) * factor * row.scale, words.remark, words.source
    both = required is not None and limit is not None
    if assumed and both:
        source = f"assumed: {assumed}"
        remark = remark if used is not None else "; ".join(filter(None, (remark, f"more than is assumed: {assumed}")))
    elif more != 0.0 and both and (used is None or used <= 1.0):
        remark = "; ".join(filter(None, (_hidden(more, row.unit, used is None), remark)))
    if used is None:
        essential = (row.essential or both) and not words.silent and op.number(row.applies) != 0.0
        remark = remark or "no limit in the catalogue row"
        required = None if words.silent else required
        return Check(
            row.name, required, limit, row.unit, None, Verdict.NOT_CHECKED, None if words.silent else instant, source,
            remark, essential, factor, basis,
        )  # fmt: skip
    verdict = judged(used, op.safety.reserve)
    return Check(
        row.name, required, limit, row.unit, used, verdict, instant, source, remark, row.essential, factor, basis
    )


def _hidden(more: float, unit: str, doubtful: bool) -> str:
    """The remark on an allowance for what the motor's data sheet does not specify."""
    amount = f"{more:.3g} {'K' if unit == 'C' else unit} more" if math.isfinite(more) else "an unknown amount more"
    text = f"data missing from the motor's catalogue row may require {amount}"
    return f"{text}: the check would then fail" if doubtful else f"{text}: the check would still pass"


def judged(used: float, reserve: float) -> Verdict:
    """The verdict for a utilisation."""
    if used <= 1.0 - reserve:
        return Verdict.PASS
    return Verdict.MARGINAL if used <= 1.0 else Verdict.FAIL


def placed(cycle: Cycle, check: Check) -> Check:
    """A check with the part of a mix in which its instant lies."""
    if len(cycle.parts) == 1 or check.time is None:
        return check
    part = cycle.part_at(check.time)
    begin = float(cycle.time[cycle.parts[part].start])
    said = f"in {cycle.part_names[part]}, {check.time - begin:.4g} s into it"
    return replace(check, remark=f"{said}; {check.remark}" if check.remark else said)


def supply_figures(study: Study, power: Array) -> dict[str, Any]:
    """Required values of the common supply by the names of the table. ``power``: sum of the joints' power and of its
    lower bound [W], (..., 2, N).

    Power that one joint feeds back may be used by another at the same instant; only the sum reaches the supply. Drawn
    power is the positive part of the sum, regenerated power the negative part; each mean is over the whole cycle, so a
    supply that cannot absorb power is not credited with it. Braking power and bus voltage follow from the lower bound
    of the power, in which no loss helps to brake.
    """
    weights = study.cycle.weights
    share = weights / weights.sum() if weights.sum() > 0.0 else np.full(len(weights), 1.0 / len(weights))
    total, least = power[..., 0, :] + standby_power(study), power[..., 1, :]
    peak, braking = np.maximum(total.max(axis=-1), 0.0), np.maximum(-least.min(axis=-1), 0.0)
    drawn = np.maximum(total, 0.0)
    fed_back = np.subtract(drawn, total, out=total)
    # einsum: the rounding of @ depends on the number of sets
    mean, back = (np.einsum("...t,t", one, share) for one in (drawn, fed_back))
    volts = np.array([bus_of(study, row).voltage for row in least.reshape(-1, len(weights))])
    return {
        "peak_power": peak, "mean_power": mean, "regenerated_power": back, "braking_power": braking,
        "bus_voltage": volts.reshape(least.shape[:-1]),
    }  # fmt: skip


def standby_power(study: Study) -> float:
    """Standby power of all amplifiers, as far as it is known [W]."""
    return math.fsum(task.amplifier.standby_power or 0.0 for task in study.joints)


def bus_of(study: Study, power: Array) -> BusPeak:
    """Bus voltage [V] over the cycle from the power (N,) [W]; NaN without a capacitance, infinite if the brake resistor
    never goes off.

    Each part of a mix repeats by itself, and may follow any other: it begins with the highest voltage that one of them
    leaves. As no part leaves more than the larger of that and its own, no order of the parts gives more.
    """
    supply, cycle = study.supply, study.cycle
    if supply.capacity is None:
        return BusPeak(math.nan, 0, math.nan, math.nan)
    if supply.resistor_always_on:
        return BusPeak(math.inf, 0, math.inf, math.inf)
    bus = supply.voltage, supply.capacity, supply.threshold or math.inf, supply.resistance or math.inf
    rows = [(np.ascontiguousarray(cycle.time[part]), np.ascontiguousarray(power[part])) for part in cycle.parts]
    alone = [bus_peak(*bus, *row, supply.voltage) for row in rows]
    left = max(found.left for found in alone)
    burnt = sum(share * found.burnt for share, found in zip(cycle.shares, alone, strict=True))
    highest = BusPeak(-math.inf, 0, burnt, left)
    for part, row, found in zip(cycle.parts, rows, alone, strict=True):
        worst = found if left == found.left else bus_peak(*bus, *row, left)
        if worst.voltage > highest.voltage:
            highest = highest._replace(voltage=worst.voltage, sample=part.start + worst.sample)
    return highest


def supply_checks(
    study: Study, power: Array, *, unknown: str = "", more: Array | tuple[float, float] = (0.0, 0.0)
) -> tuple[Check, ...]:
    """The checks of the common supply; ``more``: allowance as ``JointResult.power_allowance``.

    A limit that is met only without the allowance is NOT CHECKED.
    """
    supply, figures, bus = study.supply, supply_figures(study, power), bus_of(study, power[1])
    instants = {
        "power": int(np.argmax(power[0])), "braking": int(np.argmin(power[1])), "bus": bus.sample, "": None,
    }  # fmt: skip
    found, hides = [], dict(zip(("peak_power", "mean_power"), more, strict=True))
    for row in SUPPLY_CHECKS:
        amount, limit = float(figures[row.required]), getattr(supply, row.limit)
        required = None if unknown or math.isnan(amount) else amount
        used = None if required is None or limit is None else utilisation(required, limit)
        remark = f"power unknown of {unknown}" if unknown else _supply_words(supply, row, bus)
        hidden, doubtful = float(hides.get(row.required, 0.0)), False
        if used is not None and hidden != 0.0:
            doubtful = bool(in_doubt(used, hidden, limit))
            used = None if doubtful else used
            remark = "; ".join(filter(None, (_hidden(hidden, row.unit, used is None), remark)))
        verdict = Verdict.NOT_CHECKED if used is None else judged(used, study.safety.reserve)
        at = instants[row.instant]
        instant = None if at is None or required is None else float(study.cycle.time[at])
        source = f"{row.name} limit of the study"
        if row.limit == "braking_power" and limit is not None:
            source = f"brake resistor of the study: {supply.threshold:g} V squared over {supply.resistance:g} ohm"
        found.append(Check(row.name, required, limit, row.unit, used, verdict, instant, source, remark, doubtful))
    return tuple(found)


def _supply_words(supply: Supply, row: Requirement, bus: BusPeak) -> str:
    """Source and remark of a check of the supply."""
    if supply.resistor_always_on and row.required in ("braking_power", "bus_voltage"):
        return f"the source of {supply.voltage:.6g} V is above the threshold: the brake resistor never goes off"
    if row.limit == "braking_power" and getattr(supply, row.limit) is None:
        whole = "the voltage of the bus decides whether its capacity and the resistor are enough"
        return whole if supply.max_voltage is not None else "the study states no threshold and resistance"
    if row.required == "bus_voltage" and supply.capacity is None:
        return "the study states no capacity of the bus"
    if row.required == "bus_voltage" and math.isinf(bus.voltage):
        return "every round of the cycle feeds back more than it takes, and nothing burns it"
    if getattr(supply, row.limit) is None:
        return "the study states no limit"
    if row.required == "bus_voltage" and supply.resistance is not None and supply.threshold is not None:
        burnt = f"the resistor burns {bus.burnt:.3g} W in the mean"
        if bus.voltage > supply.threshold * (1.0 + 1e-9):
            return f"{burnt}, and does not hold the threshold of {supply.threshold:g} V"
        duty = 100.0 * bus.burnt * supply.resistance / supply.threshold**2
        return f"{burnt}, on {duty:.2g} % of the time"
    return ""


def _number(value: float) -> float | None:
    return float(value) if known(value) else None
