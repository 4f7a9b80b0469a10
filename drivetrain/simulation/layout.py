"""What stands in the rows that a run leaves, and how its energy audit follows from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from drivetrain.arrays import Array
from drivetrain.effects.effect import Role
from drivetrain.effects.signals import KINETIC_ENERGY, POTENTIAL_ENERGY
from drivetrain.simulation.memory import Memory, recorded_signals
from drivetrain.simulation.series import Series
from drivetrain.simulation.wiring import Directory


@dataclass(frozen=True, eq=False)
class Layout:
    """The columns of a run's rows: time, states, signals, energies.

    Attributes:
        columns: Names and units of all columns after the time.
        recorded: Column, the time's being 0, and unit of what is worth recording, by name.
        stores: Names of all stored energies.
        flows: Names of the energies that powers have moved, and 1 for what they put in, -1 for what they take.
    """

    columns: tuple[tuple[str, str], ...]
    recorded: dict[str, tuple[int, str]]
    stores: tuple[str, ...]
    flows: tuple[tuple[str, float], ...]

    def balance(self, row: Sequence[float]) -> float:
        """Stored energy less what was put in.

        Returns:
            [J]; as long as no energy comes from nowhere, the same at every row.
        """
        stored = sum(row[self.recorded[name][0]] for name in self.stores)
        return stored - sum(sign * row[self.recorded[name][0]] for name, sign in self.flows)


@dataclass(frozen=True, eq=False)
class Audit:
    """The energy audit of a recording.

    Attributes:
        layout: Of its rows.
        balance: Stored energy less what was put in, at the start [J].
    """

    layout: Layout
    balance: float

    def stored(self, series: Mapping[str, Series]) -> Array:
        """Kinetic, potential and whatever effects store.

        Returns:
            [J], (N,).
        """
        first, *rest = self.layout.stores
        total = series[first].values.copy()
        for name in rest:
            total += series[name].values
        return total

    def error(self, series: Mapping[str, Series]) -> Array:
        """Energy that is there and should not be.

        Returns:
            [J], (N,).
        """
        put_in = 0.0 * series[self.layout.stores[0]].values
        for name, sign in self.layout.flows:
            put_in += sign * series[name].values
        return self.stored(series) - put_in - self.balance


def layout_of(memory: Memory, signals: Directory, units: Mapping[str, str]) -> Layout:
    """What a run's rows hold."""
    states = [(name, units[name]) for name in memory.states]
    shown = [(name, signals.units[name]) for name in recorded_signals(memory.places, signals)]
    columns = (*states, *shown, *((energy_of(name), "J") for name in memory.powers))
    recorded: dict[str, tuple[int, str]] = {}
    for index, (name, unit) in enumerate(columns, 1):
        recorded.setdefault(name, (index, unit))
    flows = tuple((energy_of(name), 1.0 if role is Role.SOURCE else -1.0) for name, role in signals.powers.items())
    return Layout(columns, recorded, (KINETIC_ENERGY.name, POTENTIAL_ENERGY.name, *signals.stores), flows)


def energy_of(power: str) -> str:
    """The name of the energy that a power has moved."""
    return f"{power.removesuffix('_power')}_energy"
