"""What every command shares: its shape, faults reported as a list, lines on the terminal, progress, exit codes.

A command is a function under ``command``: ``inputs`` reads all that it is given, so that all faults are reported at
once; then comes its own work; what it returns is whether the drives fit.
"""

from __future__ import annotations

import os
import re
import sys
import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from drivetrain.study.model import Study

COMPILING = "compiling to machine code, some half a minute: a first run; later ones find it done ..."
NOT_KEPT = (
    "compiling to machine code, some half a minute: no folder can be written to keep it in (NUMBA_CACHE_DIR names one)"
)
FITS, DOES_NOT_FIT, BAD_INPUT, FAILED, STOPPED, NOBODY_READS = 0, 1, 2, 3, 130, 141
DEBUG = "DRIVETRAIN_DEBUG"  # in the environment

StudyFile = Annotated[Path, typer.Argument(metavar="STUDY", help="The study, a YAML file (see `drivetrain init`).")]
StudyOrResult = Annotated[
    Path,
    typer.Argument(
        metavar="STUDY|RESULT",
        help="A study (drives are selected first if it names none), or a result.json of `drivetrain select` or `size`.",
    ),
]
Joints = Annotated[list[str] | None, typer.Option(help="Only this joint; may be repeated.")]


def folder_for(files: str, *, ends: str = "") -> Any:
    """The option that names the folder of what a command writes."""
    return typer.Option("--out", metavar="DIR", help=f"Folder for {files}.{ends}", show_default=False)


def command(function: Callable[..., bool | None]) -> Callable[..., None]:
    """A command: faults, failures and Ctrl-C become lines, and whether it fits the exit code."""

    @wraps(function)
    def run(*args: Any, **named: Any) -> None:
        with report_faults():
            fits = function(*args, **named)
            raise typer.Exit(FITS if fits is None or fits else DOES_NOT_FIT)

    return run


def inputs(*reads: Callable[[], Any], out: Path | None = None) -> list[Any]:
    """What the functions read, in their order, and whether ``out`` can be written: all faults are reported at once."""
    from drivetrain.errors import Faults

    faults = Faults()
    found = [faults.attempt(read) for read in (lambda: writable(out), *reads)]
    faults.raise_any()
    return found[1:]


def refuse(wrong: object, option: str, problem: str, value: object = None, hint: str = "") -> None:
    """Raise the fault of an option where something is wrong with it."""
    from drivetrain.errors import Fault, InputError

    if wrong:
        raise InputError(Fault(option, problem, value, hint))


def positive(text: str | None, unit: str, option: str) -> Any:
    """The SI number of an option above zero; None where it is not given."""
    from drivetrain.units import quantity

    return None if text is None else quantity(text, unit, option, above=0.0)


def write_page(study: Study, out: Path | None, files: Mapping[str, str]) -> None:
    """Write a page and what belongs to it into a folder, the study's own where none is named, and say where it is."""
    from drivetrain.whole_files import write_files

    written = write_files(out or report_folder(study.name), files)
    say(f"page: {next(iter(written.values()))}")


@contextmanager
def report_faults() -> Iterator[None]:
    """Wrong input ends as a list of faults, Ctrl-C and failures in one line; warnings become notes."""
    from drivetrain.errors import DrivetrainError

    with warnings.catch_warnings():
        warnings.showwarning = lambda message, category, *_: say(f"note: {message}", errors=True)
        try:
            yield
        except DrivetrainError as error:
            from drivetrain.report.terminal import console, fault_lines

            for line in fault_lines(error):
                console(errors=True).print(line, soft_wrap=True)
            raise typer.Exit(BAD_INPUT) from None
        except KeyboardInterrupt:
            say("stopped", errors=True)
            raise typer.Exit(STOPPED) from None
        except (typer.Exit, typer.Abort, typer.BadParameter):
            raise
        except Exception as error:
            raise typer.Exit(failure(error)) from None


def failure(error: Exception) -> int:
    """Report an unexpected error in one line, or with its traceback if wanted; returns the exit code."""
    if isinstance(error, BrokenPipeError):  # such as `| head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return NOBODY_READS
    if os.environ.get(DEBUG):
        traceback.print_exception(error)
    elif isinstance(error, OSError):
        place = f"{error.filename}: " if error.filename else ""
        say(f"failed: {place}{error.strerror or error}", errors=True)
    else:
        hint = "drivetrain --debug COMMAND shows where; please report it with the study"
        say(f"failed: {type(error).__name__}: {error}; this is a fault of the program ({hint})", errors=True)
    return FAILED


def writable(out: Path | None, *, file: bool = False, option: str = "--out") -> None:
    """Refuse a place for results, a folder or a file, before any work is done for them."""
    if out is None:
        return
    refuse(file and out.is_dir(), option, "must be a file, but is a folder", str(out), f"such as {out / 'results.csv'}")
    folder = out.absolute().parent if file else out.absolute()
    there = next(one for one in (folder, *folder.parents) if one.exists())
    refuse(not there.is_dir(), option, f"must be a folder, but {there} is a file", str(out))
    refuse(not os.access(there, os.W_OK | os.X_OK), option, f"there is no right to write into {there}", str(out))


def say(text: str, *, errors: bool = False) -> None:
    """One line on the terminal, never wrapped."""
    from drivetrain.errors import plain

    typer.echo(plain(text), err=errors)


def lines(texts: Iterable[str]) -> None:
    for text in texts:
        say(text)


def listed(heading: str, texts: list[str], *, most: int) -> None:
    """A list on standard error, cut when it is long."""
    if texts:
        say(f"{heading} ({len(texts)}):", errors=True)
    for line in texts[:most]:
        say(f"  {line}", errors=True)
    if len(texts) > most:
        say(f"  ... and {len(texts) - most} more", errors=True)


@contextmanager
def working(text: str) -> Iterator[Callable[[int, int, str], None]]:
    """Says what takes time, and shows how far it is by what it yields; the first run also compiles."""
    from drivetrain.jit import cold, kept
    from drivetrain.report.terminal import console, progress

    screen = console(errors=True)

    if cold():
        screen.print(COMPILING if kept() else NOT_KEPT, soft_wrap=True)
    with progress(screen, text) as step:
        yield step


def report_folder(name: str) -> Path:
    """The folder for what a command writes when none is named: ``<study name>_report`` in the working directory."""
    return Path(re.sub(r"[^\w.-]+", "_", name).strip("_.") + "_report")
