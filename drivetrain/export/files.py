"""Files written beside their place and then renamed, so that a failure leaves the old one as it was."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

from drivetrain.errors import Fault, InputError


def write_text(path: str | Path, text: str) -> Path:
    """Write a file whole or not at all.

    Args:
        path: Where; its folder must be there.
        text: What, in UTF-8.

    Returns:
        Where it is.

    Raises:
        InputError: It cannot be written there.
    """
    place = Path(path)
    try:
        handle, name = tempfile.mkstemp(prefix=f".{place.name}.", dir=place.parent)
    except OSError as error:
        raise _refused(place, error) from None
    beside = Path(name)
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        beside.chmod(0o644)
        beside.replace(place)
    except OSError as error:
        raise _refused(place, error) from None
    finally:
        beside.unlink(missing_ok=True)
    return place


def _refused(place: Path, error: OSError) -> InputError:
    return InputError(Fault("path", f"cannot be written: {error.strerror}", str(place)))
