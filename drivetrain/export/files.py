"""Text files, written whole or not at all."""

from __future__ import annotations

from pathlib import Path

from drivetrain.errors import Fault, InputError
from drivetrain.whole_files import write_whole


def write_text(path: str | Path, text: str) -> Path:
    """Write a file whole or not at all.

    Raises:
        InputError: It cannot be written there.
    """
    place = Path(path)
    try:
        write_whole(place, text)
    except OSError as error:
        raise InputError(Fault("path", f"cannot be written: {error.strerror}", str(place))) from None
    return place
