"""A gear as one of a family: of any ratio in a range and, where fitted to a series of a catalogue, of any size."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from drivetrain.drive.gear import Gear
from drivetrain.errors import Fault, InputError

FITTED = (
    "mass", "inertia", "continuous_torque", "average_torque_limit", "momentary_torque", "max_input_speed",
    "average_input_speed_limit", "efficiency", "no_load_torque", "mesh_efficiency", "drag_torque", "drag_speed",
    "drag_speed_exponent", "drag_temperature_1", "drag_temperature_2", "seal_drag_torque", "starting_torque",
    "diameter", "length",
)  # fmt: skip
LEAST_ROWS = 4  # below, a law of two exponents is no fit
KEPT = 1.0 + 1e-9  # of a size: rounding may not fell a gear that is sized to its limit


@dataclass(frozen=True)
class PowerLaw:
    """A number of a sheet over the repeated peak torque T and the ratio G: ``scale * T^torque * G^ratio``.

    Attributes:
        scale: At 1 N m and ratio 1 [SI].
        torque, ratio: Exponents.
        error: Standard deviation of the rows from the law, relative.
        rows: How many the law was fitted to.
    """

    scale: float
    torque: float
    ratio: float
    error: float
    rows: int

    def at(self, torque: float, ratio: float) -> float:
        """The number of a gear."""
        return self.scale * torque**self.torque * ratio**self.ratio

    def torque_for(self, value: float, ratio: float) -> float:
        """The size whose number is a wanted one."""
        if self.torque <= 0.0 or value <= 0.0:
            return 0.0
        return float((value / (self.scale * ratio**self.ratio)) ** (1.0 / self.torque))


@dataclass(frozen=True, eq=False)
class GearFamily:
    """Gears that differ in ratio, and in size where laws say how.

    Attributes:
        name: Of the series; ``ideal gear`` for one without loss, mass, inertia and limits.
        low, high: Ends of the range of ratios.
        kind: Of its gears.
        laws: By column of the sheet; empty for the ideal family.
        source: Where the laws are from, in words.
        smallest, largest: Repeated peak torque of the rows [N m]; none is made smaller, and for larger ones the laws
            are carried on.
    """

    name: str
    low: float
    high: float
    kind: str = "ideal"
    laws: Mapping[str, PowerLaw] = field(default_factory=dict)
    source: str = "no loss, no mass, no inertia, no limits"
    smallest: float = 0.0
    largest: float = math.inf

    def gear(self, ratio: float, torque: float) -> Gear:
        """The gear of a ratio and a size."""
        key = f"{self.name} {ratio:.4g}"
        if not self.laws:
            return Gear(key, ratio, kind="ideal", efficiency=1.0)
        numbers = {name: law.at(torque, ratio) for name, law in self.laws.items()}
        for name in ("efficiency", "mesh_efficiency"):
            if name in numbers:
                numbers[name] = min(numbers[name], 1.0)
        bare = Gear(key, ratio, series=self.name, kind=self.kind, repeated_peak_torque=torque, source=self.source)
        return replace(bare, **numbers)  # type: ignore[arg-type]

    def size_for(self, ratio: float, peak: float, average: float) -> float:
        """The smallest size that bears a load."""
        asked = [peak]
        for name, value in (("momentary_torque", peak), ("average_torque_limit", average)):
            if name in self.laws:
                asked.append(self.laws[name].torque_for(value, ratio))
        if "average_torque_limit" not in self.laws and "continuous_torque" in self.laws:
            asked.append(self.laws["continuous_torque"].torque_for(average, ratio))
        return max(max(asked) * KEPT, self.smallest)


def ideal_family(low: float, high: float) -> GearFamily:
    """Gears without loss, mass, inertia and limits."""
    _check_range(low, high)
    return GearFamily("ideal gear", low, high)


def fitted_family(name: str, gears: Iterable[Gear], low: float, high: float) -> GearFamily:
    """A family whose numbers follow power laws fitted to the rows of one series.

    Every number is fitted by least squares of its logarithm over those of repeated peak torque and ratio; where all
    rows have one ratio, over torque alone.
    """
    _check_range(low, high)
    rows = [gear for gear in gears if gear.repeated_peak_torque is not None]
    if len(rows) < LEAST_ROWS:
        problem = f"has {len(rows)} rows with a repeated peak torque; a fit needs {LEAST_ROWS}"
        raise InputError(Fault(f"gear series {name}", problem))
    laws = {}
    for column in FITTED:
        printed = [(row, getattr(row, column)) for row in rows if getattr(row, column) is not None]
        known = [(row, value) for row, value in printed if value > 0.0]
        if len(printed) >= LEAST_ROWS and not known:
            laws[column] = PowerLaw(0.0, 0.0, 0.0, 0.0, len(printed))
        elif len(known) >= LEAST_ROWS:
            laws[column] = _fit([row for row, _ in known], [value for _, value in known])
    torques = [row.repeated_peak_torque or 0.0 for row in rows]
    source = f"power laws of torque and ratio through {len(rows)} rows of series {name}"
    return GearFamily(name, low, high, rows[0].kind, laws, source, min(torques), max(torques))


def _fit(rows: list[Gear], values: list[float]) -> PowerLaw:
    """Least squares in logarithms."""
    torque = np.log([row.repeated_peak_torque or 1.0 for row in rows])
    ratio = np.log([abs(row.ratio) for row in rows])
    columns = [np.ones(len(rows))]
    varied = [column for column in (torque, ratio) if np.ptp(column) > 1e-9]
    matrix = np.column_stack([*columns, *varied])
    target = np.log(values)
    found = np.linalg.lstsq(matrix, target, rcond=None)[0]
    error = float(np.sqrt(np.mean((matrix @ found - target) ** 2)))
    exponents = dict(zip([id(column) for column in varied], found[1:], strict=True))
    return PowerLaw(
        math.exp(float(found[0])), float(exponents.get(id(torque), 0.0)), float(exponents.get(id(ratio), 0.0)), error,
        len(rows),
    )  # fmt: skip


def _check_range(low: float, high: float) -> None:
    if not (math.isfinite(low) and math.isfinite(high) and 0.0 < low < high):
        raise InputError(Fault("ratio", "must be a range from a smaller to a larger positive ratio", (low, high)))
