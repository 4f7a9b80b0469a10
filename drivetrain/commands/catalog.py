"""The commands around catalogues: lint, import."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from drivetrain.commands.shared import command, lines, listed, refuse, say, writable


class Source(StrEnum):
    """Column formats that can be imported."""

    MGDB = "mgdb"
    TABLE = "table"
    MAKER = "maker"


@command
def lint(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="Folder with motors.csv, gears.csv and the other tables.")
    ],
) -> bool:
    """List all errors and warnings of a catalogue; exit code 1 if it has errors."""
    from drivetrain.catalog.findings import Severity
    from drivetrain.catalog.linting import lint
    from drivetrain.report.terminal import console, lint_table

    found = lint(folder)
    errors = sum(one.severity is Severity.ERROR for one in found)
    screen = console()
    if found and screen.is_terminal:
        screen.print(lint_table(found))
    else:
        lines(str(one) for one in found)  # one finding per line, so that the output can be searched and counted
    rest = len(found) - errors
    say(f"{folder}: {errors} error{'s' * (errors != 1)}, {rest} warning{'s' * (rest != 1)}")
    return not errors


@command
def import_(
    source: Annotated[
        Path, typer.Argument(metavar="SOURCE", help="Folder with the files to read; for format maker, one file.")
    ],
    out: Annotated[Path, typer.Argument(metavar="OUT", help="Catalogue folder to write.")],
    form: Annotated[Source, typer.Option("--format", help="Column format of the source.")] = Source.MGDB,
    columns: Annotated[
        Path | None,
        typer.Option(
            "--map", metavar="FILE", help="Map of a manufacturer's headings to columns; implies --format maker."
        ),
    ] = None,
    table: Annotated[
        str, typer.Option(help="Content of a manufacturer's table without --map: motors, gears, brakes or amplifiers.")
    ] = "motors",
    basis: Annotated[
        list[str] | None,
        typer.Option(
            help="Basis of the source's currents: dc, rms/phase, peak/line_line ...; for one maker or key: NAME=BASIS. "
            "May be repeated."
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace tables that are already there.")] = False,
    drop_faulty: Annotated[
        bool, typer.Option("--drop-faulty", help="Omit rows in which the lint finds an error.")
    ] = False,
) -> None:
    """Convert a catalogue or a manufacturer's table to a catalogue folder."""
    from drivetrain.catalog.exports import ExportMap, import_export, read_map
    from drivetrain.catalog.formats import MGDB, TABLE
    from drivetrain.catalog.importers import import_rows

    writable(out)
    if columns is not None or form is Source.MAKER:
        refuse(drop_faulty, "--drop-faulty", "goes with the formats mgdb and table", None, "lint the folder instead")
        given = ExportMap(table) if columns is None else read_map(columns)
        imported = import_export(source, out, given, basis=_basis(basis or []), overwrite=force)
        listed("left out", [str(fault) for fault in imported.refused], most=25)
        listed("headings that are not columns of a catalogue", list(imported.unused), most=25)
        refuse(not imported.rows, source.name, "no row was imported, so nothing was written")
        say(f"{imported.file}: {imported.rows} row{'s' if imported.rows > 1 else ''}")
        say(f"next: `drivetrain catalog lint {out}`")
        return
    told = MGDB if form is Source.MGDB else TABLE
    done = import_rows(told, source, out, basis=_basis(basis or []), keep_faulty=not drop_faulty, overwrite=force)
    listed("left out", [str(fault) for fault in done.refused], most=25)
    say(f"{out}: {done.motors} motors, {done.gears} gears, {done.pairs} pairs")
    say(f"next: `drivetrain catalog lint {out}`")


def _basis(given: list[str]) -> str | dict[str, str]:
    """``dc`` for all, or by maker or key as NAME=BASIS."""
    if not given:
        return ""
    named = dict(text.rpartition("=")[::2] for text in given)
    return named.get("", "") if set(named) == {""} else named
