"""Files written beside their place and then renamed, so that a failure leaves the old one as it was."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import IO


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
