"""The recording of a simulation: named series with units over a common time, counters and events; saved in one file."""

from __future__ import annotations

import json
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd

from drivetrain.arrays import Array, frozen_array, within_reach
from drivetrain.errors import Fault, InputError, nearest
from drivetrain.notebook import axes_of, shown
from drivetrain.whole_files import write_whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class Series(NamedTuple):
    """One quantity at the times of a recording."""

    unit: str  # SI, such as ``rad/s``; ``-`` for a pure number
    values: Array  # (N,)


class TableSeries(Mapping[str, Series]):
    """Series in the columns of a table, made only when they are asked for, and some more series.

    A run has hundreds of series, of which few are used.
    """

    def __init__(self, table: Array, columns: Mapping[str, tuple[int, str]], more: Mapping[str, Series]) -> None:
        """Use a table, which must not be changed afterwards; ``columns`` gives column and unit by name."""
        self._table, self._columns, self._made = table, columns, dict(more)
        self._names = (*columns, *more)
        for one in more.values():
            one.values.setflags(write=False)

    @property
    def rows(self) -> int:
        """Number of values of each series."""
        return len(self._table)

    def __getitem__(self, name: str) -> Series:
        """The series of a name, made at the first access."""
        if name not in self._made:
            column, unit = self._columns[name]
            values = self._table[:, column].copy()
            values.setflags(write=False)
            self._made[name] = Series(unit, values)
        return self._made[name]

    def __contains__(self, name: object) -> bool:
        """Whether there is a series of that name; it is not made."""
        return name in self._columns or name in self._made

    def __iter__(self) -> Iterator[str]:
        return iter(self._names)

    def __len__(self) -> int:
        return len(self._names)


LARGEST_ERROR = 0.01  # error of the energy balance, over the energy exchanged, above which an event warns
UNACCOUNTED = "energy"  # name of that event
ROUNDING_ERROR = 1e-9  # error that rounding may cause, over the stored energy
FORMAT = 1  # version of the file format
# Errors that reading a damaged archive may raise: each layer has its own.
DAMAGE_ERRORS = (
    ValueError, KeyError, TypeError, AttributeError, NotImplementedError, OSError, EOFError, zipfile.BadZipFile,
    zlib.error,
)  # fmt: skip


@dataclass(frozen=True)
class Event:
    """An event of a run, such as a change of contact mode or a warning."""

    time: float  # [s]
    name: str  # kind of the event, such as ``limit``
    detail: str  # description, with units


@dataclass(frozen=True, eq=False)
class Recording:
    """Named series with units at common times, with counters of the computing effort and events.

    Attributes:
        time: Times of the output rows, increasing [s], (N,).
        series: Series by name, such as ``elbow_joint.position`` or ``kinetic_energy``.
        counters: Computing effort, such as evaluations of the right-hand side and steps, by name [-].
        events: Events in the order of time.
        stopped_by: The event that ended the run early; None if it reached its end.
        about: Description of the run (arm, solver and others), by name.
        kept: The data to resume the run from its end, by name; empty if it cannot be resumed.
        verified: Decision quantities by name [SI]: from this run, and from a run at half the step or a tenth of the
            tolerance; empty if that was not requested.
    """

    time: Array
    series: Mapping[str, Series]
    counters: Mapping[str, int] = field(default_factory=dict)
    events: tuple[Event, ...] = ()
    stopped_by: Event | None = None
    about: Mapping[str, str] = field(default_factory=dict)
    kept: Mapping[str, Any] = field(default_factory=dict)
    verified: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        time = frozen_array(self.time, (None,), "time")
        object.__setattr__(self, "time", time)
        if not isinstance(self.series, TableSeries) or self.series.rows != len(time):
            object.__setattr__(self, "series", _frozen(self.series, len(time)))

    def __getitem__(self, name: str) -> Array:
        """The values of a series, (N,)."""
        return self._find(name).values

    def __repr__(self) -> str:
        ended = "" if self.stopped_by is None else f", stopped by {self.stopped_by.name}"
        length = self.time[-1] - self.time[0] if len(self.time) else 0.0
        return f"Recording({len(self.series)} series, {len(self.time)} instants, {length:.4g} s{ended})"

    def _repr_html_(self) -> str:
        rows = {
            name: {"unit": one.unit, "lowest": one.values.min(), "highest": one.values.max(), "last": one.values[-1]}
            for name, one in self.series.items()
            if len(one.values)
        }
        return shown(repr(self), pd.DataFrame.from_dict(rows, orient="index"))

    def plot(self, *names: str, ax: Axes | None = None) -> Axes:
        """Plot series over time.

        Args:
            names: Names of series of one unit, or the last part of several, such as ``current``; none: ``position``.
            ax: The axes to draw into; None: a new figure.

        Returns:
            The axes.

        Raises:
            InputError: No such series, or series of different units.
        """
        chosen: list[str] = []
        for name in names or ("position",):
            ending = [one for one in self.series if one.endswith(f".{name}")]
            chosen += [name] if name in self.series or not ending else ending
        units = list(dict.fromkeys(self.unit(name) for name in chosen))
        if len(units) > 1 and names:
            raise InputError(Fault("series", "must be of one unit to share an axis", ", ".join(units)))
        ax = axes_of(ax)
        for name in chosen:
            ax.plot(self.time, self[name], label=name)
        what = names[0].rpartition(".")[2] if names else "position"
        ax.set(xlabel="time [s]", ylabel=f"{what} [{' or '.join(units)}]")
        ax.legend()
        return ax

    def unit(self, name: str) -> str:
        """The unit of a series.

        Args:
            name: Name of the series.

        Returns:
            SI unit, such as ``rad/s``.

        Raises:
            InputError: No such series.
        """
        return self._find(name).unit

    def ending(self, part: str) -> dict[str, Array]:
        """All series whose name ends with a part, such as ``position``, by the part before it.

        Args:
            part: Last part of the name, after the last dot.

        Returns:
            Values by joint or body, in the order of the arm, (N,) each, in the series' unit.
        """
        suffix = "." + part
        return {n.removesuffix(suffix): s.values for n, s in self.series.items() if n.endswith(suffix)}

    def to_frame(self) -> pd.DataFrame:
        """The series as a pandas DataFrame.

        Returns:
            One row per output time, index ``time [s]``; columns ``name [unit]``.
        """
        columns = {f"{name} [{series.unit}]": series.values for name, series in self.series.items()}
        return pd.DataFrame(columns, index=pd.Index(self.time, name="time [s]"))

    def save(self, path: Path | str) -> Path:
        """Write the recording to a file, atomically: a reader never finds an incomplete file.

        Args:
            path: The file. With the suffix ``.parquet`` it contains the DataFrame of the series, which needs pyarrow;
                else it is a numpy npz file with the whole recording.

        Returns:
            The path.

        Raises:
            InputError: The folder does not exist, or pyarrow is missing.
        """
        target = Path(path)
        if not target.parent.is_dir():
            raise InputError(Fault("path", "must lie in a folder that exists", str(target)))
        if target.suffix == ".parquet":
            if find_spec("pyarrow") is None:
                hint = "install pyarrow, or save as .npz"
                raise InputError(Fault("path", "needs pyarrow for Parquet", str(target), hint))
            write_whole(target, lambda file: self.to_frame().to_parquet(file))
            return target
        arrays: dict[str, Any] = {f"series {i}": series.values for i, series in enumerate(self.series.values())}
        arrays |= {f"kept {name}": values for name, values in self.kept.items()}
        header = np.array(self._header())
        write_whole(target, lambda file: np.savez_compressed(file, time=self.time, told=header, **arrays))
        return target

    def _find(self, name: str) -> Series:
        """The series of a name; InputError if there is none."""
        if name not in self.series:
            raise InputError(Fault("series", "no series of that name", name, nearest(name, self.series)))
        return self.series[name]

    def _header(self) -> str:
        """All but the arrays, as JSON."""
        header: dict[str, Any] = {
            "format": FORMAT,
            "series": [[name, series.unit] for name, series in self.series.items()],
            "counters": dict(self.counters),
            "events": [[event.time, event.name, event.detail] for event in self.events],
            "stopped_by": None if self.stopped_by is None else list(vars(self.stopped_by).values()),
            "about": dict(self.about),
            "verified": {name: list(both) for name, both in self.verified.items()},
        }
        return json.dumps(header)


def _frozen(series: Mapping[str, Series], size: int) -> dict[str, Series]:
    """The series with read-only values, checked together, which is faster; one by one only to name a fault."""
    columns = [one.values for one in series.values()]
    if all(isinstance(c, np.ndarray) and c.dtype == np.float64 and c.shape == (size,) for c in columns):
        table = np.array(columns)
        if within_reach(table):
            table.setflags(write=False)
            return {name: Series(one.unit, row) for (name, one), row in zip(series.items(), table, strict=True)}
    return {name: Series(one.unit, frozen_array(one.values, (size,), name)) for name, one in series.items()}


def energy_event(time: Array, error: Array, passed: float, stored: float, tolerance: float = 0.0) -> tuple[Event, ...]:
    """A warning if the energies of a run do not balance; empty if they do.

    ``error`` is that of the balance [J], (N,), ``passed`` the largest energy exchanged, ``stored`` the largest stored
    [J], ``tolerance`` the relative one of the engine.
    """
    off, most = np.abs(error), max(LARGEST_ERROR, 10.0 * tolerance) * passed + ROUNDING_ERROR * stored
    if not len(off) or not off.max() > most:
        return ()
    share = off.max() / max(passed, 1e-300)
    finer = "a smaller tolerance" if tolerance > 0.0 else "a shorter step or AdaptiveStep"
    detail = (
        f"{100.0 * share:.2g} % of the energy that goes to and fro is not accounted for: do not trust this run; "
        f"{finer} resolves more"
    )
    return (Event(float(time[int(np.argmax(off > most))]), UNACCOUNTED, detail),)


def load_recording(path: Path | str) -> Recording:
    """Read a recording from a file that ``Recording.save`` has written.

    Args:
        path: The file.

    Returns:
        The recording, bit-identical.

    Raises:
        InputError: No such file, or not a recording.
    """
    source = Path(path)
    if not source.is_file():
        raise InputError(Fault("recording", "no such file", str(source)))
    try:
        with source.open("rb") as file, np.load(file, allow_pickle=False) as stored:
            header = json.loads(str(stored["told"]))
            arrays = {name: stored[name] for name in stored.files}
    except DAMAGE_ERRORS as error:
        raise InputError(Fault("recording", f"is no recording of this package: {error}", str(source))) from None
    form = header.get("format") if isinstance(header, dict) else None
    if form != FORMAT:
        raise InputError(Fault("recording", f"must be of format {FORMAT}", form, file=str(source)))
    try:
        return _restored(header, arrays)
    except DAMAGE_ERRORS as error:
        raise InputError(Fault("recording", f"is damaged: {error}", str(source))) from None


def _restored(header: dict[str, Any], arrays: dict[str, Any]) -> Recording:
    named = enumerate(header["series"])
    return Recording(
        arrays["time"],
        {name: Series(unit, arrays[f"series {i}"]) for i, (name, unit) in named},
        header["counters"],
        tuple(Event(*event) for event in header["events"]),
        None if header["stopped_by"] is None else Event(*header["stopped_by"]),
        header["about"],
        {name.removeprefix("kept "): values for name, values in arrays.items() if name.startswith("kept ")},
        {name: (float(one), float(other)) for name, (one, other) in header.get("verified", {}).items()},
    )
