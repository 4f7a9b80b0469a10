"""Files as a whole: read within bounds; written beside their place, then renamed, so that a failure changes nothing."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import IO

from drivetrain.errors import Fault, InputError, plain

LARGEST_TEXT = 256 << 20  # bytes: a day of six joints at 100 Hz is 0.5 GB as text, and nobody sizes with that


def read_text(path: Path) -> str:
    """The UTF-8 text of a file that a user names, its control characters spelled out."""
    try:
        if path.stat().st_size > LARGEST_TEXT:
            problem = f"has {path.stat().st_size / 1e6:.0f} MB; at most {LARGEST_TEXT >> 20} MB are read"
            raise InputError(Fault("the file", problem, hint="keep what the study needs", file=str(path)))
        return plain(path.read_text(encoding="utf-8-sig"))
    except InputError:
        raise
    except (OSError, ValueError) as error:
        problem = str(error.strerror) if isinstance(error, OSError) else f"must be UTF-8 text: {error}"
        raise InputError(Fault("the file", f"cannot be read: {problem}", file=str(path))) from None


def written_beside(place: Path, write: Callable[[IO[bytes]], object]) -> Path:
    """A hidden file in the same folder that holds everything, on the disk; the caller renames it to its place."""
    handle, name = tempfile.mkstemp(prefix=f".{place.name}.", dir=place.parent)
    beside = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            write(file)
            file.flush()
            os.fsync(file.fileno())
        beside.chmod(0o644)  # as other files are, not as temporary ones
    except BaseException:
        beside.unlink(missing_ok=True)
        raise
    return beside


def write_whole(place: Path, write: Callable[[IO[bytes]], object]) -> None:
    """Write one file whole or not at all."""
    beside = written_beside(place, write)
    try:
        beside.replace(place)
    finally:
        beside.unlink(missing_ok=True)
