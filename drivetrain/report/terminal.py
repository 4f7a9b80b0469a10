"""Terminal output other than verdicts: faults of the input, findings of a catalogue, notes, progress."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Literal

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from drivetrain.catalog.findings import Severity
from drivetrain.catalog.linting import LintFault
from drivetrain.errors import DrivetrainError, InputError, plain

WIDTH_WITHOUT_TERMINAL = 160  # columns if the output is piped, so that lines are not cut


def console(*, errors: bool = False) -> Console:
    """Console for the terminal, or for a pipe without colours."""
    found = Console(stderr=errors, highlight=False, markup=False, emoji=False)
    if not found.is_terminal:
        found = Console(stderr=errors, highlight=False, markup=False, emoji=False, width=WIDTH_WITHOUT_TERMINAL)
    return found


def fault_lines(error: DrivetrainError) -> list[Text]:
    """The faults of an error as lines: file, place, value, what is allowed, the fix."""
    if not isinstance(error, InputError):
        return [Text.assemble(("error ", "bold red"), str(error))]
    count = len(error.faults)
    lines = [Text("1 error" if count == 1 else f"{count} errors", "bold red")]
    for fault in error.faults:
        where = " ".join(part for part in (f"{fault.file}:" if fault.file else "", fault.place) if part)
        lines.append(Text.assemble("  ", (plain(where), "bold"), plain(f": {fault.problem}")))
        if fault.value is not None:
            lines.append(Text.assemble(("      found  ", "dim"), plain(fault.shown)))
        if fault.hint:
            lines.append(Text.assemble(("      fix    ", "dim"), plain(fault.hint)))
    return lines


def lint_table(found: Sequence[LintFault]) -> Table:
    """The findings of a catalogue, with the printed and the expected value of each."""
    table = Table(box=None, pad_edge=False, header_style="bold", padding=(0, 2, 0, 0))
    for heading in ("file", "row", "key", "column", "", "problem", "printed", "predicted"):
        side: Literal["left", "right"] = "right" if heading in ("row", "printed", "predicted") else "left"
        table.add_column(heading, justify=side, overflow="fold")
    for one in found:
        style = "red" if one.severity is Severity.ERROR else "yellow"
        problem = one.problem + (f"; {one.hint}" if one.hint else "")
        table.add_row(
            one.file, str(one.row), one.key, one.column, Text(str(one.severity), style), problem,
            _value(one.printed), _value(one.predicted),
        )  # fmt: skip
    return table


def _value(value: object) -> str:
    return "" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)


@contextmanager
def progress(to: Console, text: str) -> Iterator[Callable[[int, int, str], None]]:
    """Context with a progress bar; yields its update function (done, total, what). No bar without a terminal."""
    columns = (
        SpinnerColumn(),
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=to, transient=True, disable=not to.is_terminal) as bar:
        task = bar.add_task(text, total=None)

        def step(done: int, total: int, doing: str) -> None:
            bar.update(task, completed=done, total=total, description=doing or text)

        yield step
