"""Shared parts of the commands: reporting of faults, lines on the terminal, progress, exit codes.

A command is a function decorated with ``command``. It first reads all its arguments by ``inputs``, so that all faults
are reported together, then does its work, and returns whether the drives fit.
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
FILES = (".html", ".json", ".csv", ".pdf")  # what commands write into the folder of --out
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
    """The option for the output folder of a command."""
    return typer.Option("--out", metavar="DIR", help=f"Folder for {files}.{ends}", show_default=False)


def command(function: Callable[..., bool | None]) -> Callable[..., None]:
    """Decorator of a command: errors and Ctrl-C become lines of text, and its return value the exit code."""

    @wraps(function)
    def run(*args: Any, **named: Any) -> None:
        with report_faults():
            fits = function(*args, **named)
            raise typer.Exit(FITS if fits is None or fits else DOES_NOT_FIT)

    return run


def inputs(*reads: Callable[[], Any], out: Path | None = None) -> list[Any]:
    """Results of the functions in their order, after a check that ``out`` is writable; all faults are collected."""
    from drivetrain.errors import Faults

    faults = Faults()
    found = [faults.attempt(read) for read in (lambda: writable(out), *reads)]
    faults.raise_any()
    return found[1:]


def refuse(wrong: object, option: str, problem: str, value: object = None, hint: str = "") -> None:
    """Raise InputError for an option if ``wrong`` is true."""
    from drivetrain.errors import Fault, InputError

    if wrong:
        raise InputError(Fault(option, problem, value, hint))


def positive(text: str | None, unit: str, option: str) -> Any:
    """The positive value of an option in SI; None if the option is not given."""
    from drivetrain.units import quantity

    return None if text is None else quantity(text, unit, option, above=0.0)


def write_page(study: Study, out: Path | None, files: Mapping[str, str]) -> None:
    """Write a page and its other files into a folder (default: that of the study's reports), and print the paths."""
    from drivetrain.whole_files import write_files

    written = write_files(out or report_folder(study.name), files)
    say(f"page: {next(iter(written.values()))}")


@contextmanager
def report_faults() -> Iterator[None]:
    """Context that prints InputErrors as a list, other failures and Ctrl-C in one line, and warnings as notes."""
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
    """Report an unexpected error in one line, or with its traceback in debug mode; returns the exit code."""
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
    """Raise InputError if an output folder or file cannot be written; called before any computation."""
    if out is None:
        return
    refuse(file and out.is_dir(), option, "must be a file, but is a folder", str(out), f"such as {out / 'results.csv'}")
    named = not file and not out.exists() and out.suffix.lower() in FILES
    refuse(named, option, "must be a folder, but has the name of a file", str(out), f"such as {out.with_suffix('')}")
    folder = out.absolute().parent if file else out.absolute()
    there = next(one for one in (folder, *folder.parents) if one.exists())
    refuse(not there.is_dir(), option, f"must be a folder, but {there} is a file", str(out))
    refuse(not os.access(there, os.W_OK | os.X_OK), option, f"there is no right to write into {there}", str(out))


def say(text: str, *, errors: bool = False) -> None:
    """Print one line to the terminal without wrapping."""
    from drivetrain.errors import plain

    typer.echo(plain(text), err=errors)


def lines(texts: Iterable[str]) -> None:
    for text in texts:
        say(text)


def listed(heading: str, texts: list[str], *, most: int | None = None) -> None:
    """Print a list to standard error, with at most ``most`` entries; None: all."""
    if texts:
        say(f"{heading} ({len(texts)}):", errors=True)
    for line in texts[:most]:
        say(f"  {line}", errors=True)
    if most is not None and len(texts) > most:
        say(f"  ... and {len(texts) - most} more", errors=True)


@contextmanager
def working(text: str) -> Iterator[Callable[[int, int, str], None]]:
    """Context that prints what is being computed and yields a function to show progress; notes first compilations."""
    from drivetrain.jit import cold, kept
    from drivetrain.report.terminal import console, progress

    screen = console(errors=True)

    if cold():
        screen.print(COMPILING if kept() else NOT_KEPT, soft_wrap=True)
    with progress(screen, text) as step:
        yield step


def report_folder(name: str) -> Path:
    """The default output folder of a command: ``<study name>_report`` in the working directory."""
    return Path(re.sub(r"[^\w.-]+", "_", name).strip("_.") + "_report")
