"""Text files, written whole or not at all."""

from __future__ import annotations

from pathlib import Path

from drivetrain.whole_files import refusal, write_whole


def write_text(path: str | Path, text: str) -> Path:
    """Write a file whole or not at all; raises InputError, or OSError where the disk is full or fails."""
    place = Path(path)
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
        write_whole(place, text)
    except OSError as error:
        raise refusal(error, "path", place) from None
    return place
