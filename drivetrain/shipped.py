"""Where the folders that ship with the package are: inside the wheel, or beside the package in a checkout."""

from __future__ import annotations

from pathlib import Path


def shipped(folder: str) -> Path:
    """The folder ``catalogs`` or ``examples`` as shipped; FileNotFoundError where the installation is broken."""
    package = Path(__file__).resolve().parent
    for place in (package / "_data" / folder, package.parent / folder):
        if place.is_dir():
            return place
    raise FileNotFoundError(f"the shipped folder {folder!r} is missing from this installation of drivetrain")
