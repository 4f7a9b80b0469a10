"""What every command shares: faults told as a list, lines on the terminal, progress, exit codes."""

from __future__ import annotations

import os
import re
import sys
import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from drivetrain.errors import Fault

COMPILING = "compiling to machine code, some half a minute: a first run; later ones find it done ..."
NOT_KEPT = (
    "compiling to machine code, some half a minute: no folder can be written to keep it in (NUMBA_CACHE_DIR names one)"
)
FITS, DOES_NOT_FIT, BAD_INPUT, FAILED, STOPPED, NOBODY_READS = 0, 1, 2, 3, 130, 141
DEBUG = "DRIVETRAIN_DEBUG"  # in the environment


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
        except (typer.Exit, typer.Abort):
            raise
        except Exception as error:
            raise typer.Exit(failure(error)) from None


def failure(error: Exception) -> int:
    """One line about what nobody expected, or the traceback where it is wanted; the exit code."""
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


class FaultCollector:
    """Faults of several inputs at once: each is read inside ``with``, then ``report`` raises what was wrong."""

    def __init__(self) -> None:
        self.faults: list[Fault] = []

    def __enter__(self) -> FaultCollector:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> bool:
        from drivetrain.errors import InputError

        if isinstance(error, InputError):
            self.faults += error.faults
            return True
        return False

    def report(self) -> None:
        """Go no further where something was wrong.

        Raises:
            InputError: Every fault so far.
        """
        from drivetrain.errors import InputError

        if self.faults:
            raise InputError({str(fault): fault for fault in self.faults}.values())


def writable(out: Path | None, *, file: bool = False, option: str = "--out") -> None:
    """Refuse a place for results before any work is done for them.

    Args:
        out: Folder, or file; None: nothing was asked for.
        file: It is a file.
        option: That names it.

    Raises:
        InputError: A file stands in the way, or there is no right to write.
    """
    from drivetrain.errors import Fault, InputError

    if out is None:
        return
    if file and out.is_dir():
        raise InputError(Fault(option, "must be a file, but is a folder", str(out), f"such as {out / 'results.csv'}"))
    folder = out.absolute().parent if file else out.absolute()
    there = next(one for one in (folder, *folder.parents) if one.exists())
    if not there.is_dir():
        raise InputError(Fault(option, f"must be a folder, but {there} is a file", str(out)))
    if not os.access(there, os.W_OK | os.X_OK):
        raise InputError(Fault(option, f"there is no right to write into {there}", str(out)))


def whole_names(option: str, what: str, asked: Iterable[str] | None, names: Sequence[str]) -> list[str]:
    """Names as they are known, from what may be their beginning, or a part that no other has: elbow for elbow_joint.

    Args:
        option: As on the command line.
        what: What the names are, in words.
        asked: None: nothing.
        names: Known.

    Returns:
        The known names.

    Raises:
        InputError: Every name that none or several begin with or contain.
    """
    from drivetrain.errors import Fault, InputError, nearest

    found, faults = [], []
    for one in asked or ():
        fits = _meant(one, names)
        found += fits[:1]
        if not fits:
            faults.append(Fault(option, f"is no {what}", one, nearest(one, names)))
        elif len(fits) > 1:
            faults.append(Fault(option, f"is short for several: {', '.join(fits)}", one, "write more of it"))
    if faults:
        raise InputError(faults)
    return found


def whole_name(short: str, names: Sequence[str]) -> str:
    """The one name that is meant; what was asked where none or several are, to be refused with all else."""
    fits = _meant(short, names)
    return fits[0] if len(fits) == 1 else short


def _meant(short: str, names: Sequence[str]) -> list[str]:
    """The name itself; else all that begin with it; else all that contain it, capitals or not."""
    low = short.lower()
    kinds = (
        [name for name in names if name == short],
        [name for name in names if name.lower().startswith(low)],
        [name for name in names if low in name.lower()],
    )
    return next((kind for kind in kinds if kind), []) if short else []


def say(text: str, *, errors: bool = False) -> None:
    """One line on the terminal, never wrapped.

    Args:
        text: The line.
        errors: To standard error instead of standard output.
    """
    from drivetrain.errors import plain

    typer.echo(plain(text), err=errors)


def lines(texts: Iterable[str]) -> None:
    """Lines on standard output.

    Args:
        texts: One a line.
    """
    for text in texts:
        say(text)


def listed(heading: str, texts: list[str], *, most: int) -> None:
    """A list on standard error, cut when it is long.

    Args:
        heading: Above the list, with its length.
        texts: One an entry.
        most: Entries shown.
    """
    if texts:
        say(f"{heading} ({len(texts)}):", errors=True)
    for line in texts[:most]:
        say(f"  {line}", errors=True)
    if len(texts) > most:
        say(f"  ... and {len(texts) - most} more", errors=True)


@contextmanager
def working(text: str) -> Iterator[Callable[[int, int, str], None]]:
    """Says what takes time, and shows how far it is; the first run also compiles.

    Args:
        text: What is being done.

    Yields:
        Called with (done, total, text) to show progress.
    """
    from drivetrain.jit import cold, kept
    from drivetrain.report.terminal import console, progress

    screen = console(errors=True)
    if cold():
        screen.print(COMPILING if kept() else NOT_KEPT, soft_wrap=True)
    with progress(screen, text) as step:
        yield step


def report_folder(name: str) -> Path:
    """The folder for what a command writes when none is named.

    Args:
        name: Of the study.

    Returns:
        ``<study name>_report`` in the working directory.
    """
    return Path(re.sub(r"[^\w.-]+", "_", name).strip("_.") + "_report")
