"""What every command shares: faults told as a list, lines on the terminal, progress, exit codes."""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import typer

FITS, DOES_NOT_FIT, BAD_INPUT, STOPPED = 0, 1, 2, 130


@contextmanager
def told() -> Iterator[None]:
    """Wrong input ends as a list of faults, Ctrl-C in one line; warnings become notes."""
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


def say(text: str, *, errors: bool = False) -> None:
    """One line on the terminal, never wrapped.

    Args:
        text: The line.
        errors: To standard error instead of standard output.
    """
    typer.echo(text, err=errors)


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
    from drivetrain.report.terminal import console, progress

    screen = console(errors=True)
    if _must_compile():
        screen.print("compiling the dynamics once (about half a minute) ...")
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


def _must_compile() -> bool:
    """Whether no compiled dynamics lie beside the package yet."""
    beside = Path(__file__).parents[1] / "dynamics" / "__pycache__"
    return "NUMBA_CACHE_DIR" not in os.environ and not any(beside.glob("*.nbi"))
