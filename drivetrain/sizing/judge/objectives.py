"""The criteria by which sets of drives are compared: mass, price, energy a cycle, largest utilisation."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from drivetrain.drive.amplifier import Amplifier
from drivetrain.drive.drive import Drive
from drivetrain.sizing.results import JointResult
from drivetrain.study.model import Study
from drivetrain.study.parts.mounting import drive_mass
from drivetrain.study.parts.selection import SelectionOptions
from drivetrain.study.parts.verdicts import Check

TERMS = ("mass", "price", "energy")
"""Terms of an objective; the largest ``utilisation`` of a set is reported in addition."""


def drive_price(drive: Drive, amplifier: Amplifier) -> float | None:
    """Price of motor with brake, gear and amplifier, in the catalogue's currency; the gear of a direct drive costs
    nothing. None if one is unknown.
    """
    gear, own = 0.0 if drive.gear.key == "" else drive.gear.price, amplifier_price(amplifier)
    return None if drive.motor.price is None or gear is None or own is None else drive.motor.price + gear + own


def amplifier_price(amplifier: Amplifier) -> float | None:
    """Price of a catalogue amplifier; an amplifier that the study describes only by its limits costs nothing."""
    return amplifier.price if amplifier.key else 0.0


def criteria(study: Study, joints: Mapping[str, JointResult], shared: Iterable[Check]) -> dict[str, float]:
    """The figures by which sets of drives are compared."""
    results = joints.values()
    checks = [check for result in results for check in result.checks] + list(shared)
    used = [check.utilisation for check in checks if check.utilisation is not None]
    without = [None] * (len(study.joints) - len(results))  # joints without a drive
    return {
        "mass": _sum([*(drive_mass(result.drive) for result in results), *without]),
        "price": _sum([*(drive_price(result.drive, result.amplifier) for result in results), *without]),
        "energy": _sum([*(_energy(study, result) for result in results), *without]),
        "utilisation": max(used, default=math.nan),
    }


def weighted(wanted: SelectionOptions, found: Mapping[str, float]) -> float:
    """The objective: the weighted sum of the criteria ``found``, with the weights of the selection's options."""
    return math.fsum(weight * found[name] for name, weight in wanted.weights)


def known_objective(study: Study, joints: Mapping[str, JointResult]) -> float:
    """The objective without mass and price of the drives for which one of them is unknown but counts, as the search has
    it: only drives that the study gives may lack them.
    """
    sheets = [(name, weight) for name, weight in study.wanted.weights if weight and name != "energy"]
    value = 0.0
    for result in joints.values():
        mass, price = drive_mass(result.drive), drive_price(result.drive, result.amplifier)
        found = {"mass": _sum([mass]), "price": _sum([price])}
        own = math.fsum(weight * found[name] for name, weight in sheets)
        value += 0.0 if math.isnan(own) else own
    energy = weight_of(study.wanted, "energy")
    return value + (energy * _sum(_energy(study, result) for result in joints.values()) if energy else 0.0)


def weight_of(wanted: SelectionOptions, term: str) -> float:
    """Weight of a term in the objective, per unit."""
    return math.fsum(weight for name, weight in wanted.weights if name == term)


def _energy(study: Study, result: JointResult) -> float | None:
    """Energy that one drive draws over a cycle, net of what it feeds back [J]."""
    return float(result.series.electrical_power @ study.cycle.weights) if result.torque_known else None


def _sum(values: Iterable[float | None]) -> float:
    """The sum; NaN if one term is unknown."""
    return math.fsum(math.nan if value is None else value for value in values)
