"""Compiled code that takes in other files is compiled anew when these change."""

import re
import zlib
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[2] / "drivetrain"
FILES = [path for folder in ("effects", "simulation") for path in sorted((PACKAGE / folder).glob("*.py"))]
NAMING = [path for path in FILES if "\nSOURCES = " in path.read_text(encoding="utf-8")]


@pytest.mark.parametrize("path", NAMING, ids=lambda path: path.stem)
def test_checksums_of_what_is_compiled_in(path: Path) -> None:
    block = re.search(r"^SOURCES = \{.*?\}", path.read_text(encoding="utf-8"), re.S | re.M)
    assert block is not None
    told = {name: int(number) for name, number in re.findall(r'"([\w/]+\.py)": (\d+)', block[0])}
    assert told
    assert told == {name: zlib.crc32((PACKAGE / name).read_bytes()) for name in told}
