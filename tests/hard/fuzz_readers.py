"""A coverage-guided fuzzer on the readers: any bytes in a file end in an ``InputError`` or in an answer.

Run as `python tests/hard/fuzz_readers.py TARGET SECONDS` (needs atheris); targets: study, urdf, mjcf, sdf, motion,
recording, catalogue. Begins with the examples' files. What ends otherwise is printed once for each place in the code,
and its bytes are kept in `fuzz_TARGET/` below the working folder.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import atheris

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1])]
# Laws that numba compiles are left as they are: only what reads is watched.
with atheris.instrument_imports(
    include=["yaml", *(f"drivetrain.{part}" for part in ("arm.urdf", "arm.mjcf", "arm.sdf", "arm.load", "catalog"))]
    + [f"drivetrain.motion.{part}" for part in ("read", "columns", "table", "foreign", "recording", "checks")]
    + [f"drivetrain.study.{part}" for part in ("document", "form", "read", "faults", "schema", "parts")]
    + ["drivetrain.units"]
):
    from drivetrain.arm.files.load import load_arm
    from drivetrain.catalog.read import read_catalog
    from drivetrain.errors import InputError
    from drivetrain.motion.read import read_motion
    from drivetrain.motion.recording import read_recording
    from drivetrain.study.read import load_study
    from drivetrain.whole_files import shipped

SLOW = 5.0  # s: a reader that takes longer hangs, as far as a user can see
DATA = HERE.parent / "arm" / "data"


def _examples(pattern: str) -> list[Path]:
    return sorted(shipped("examples").rglob(pattern))


TARGETS: dict[str, tuple[str, Callable[[Path], Any], list[Path]]] = {
    "study": ("study.yaml", load_study, _examples("*.yaml")),
    "urdf": ("arm.urdf", load_arm, [*_examples("*.urdf"), *sorted(DATA.rglob("*.urdf"))]),
    "mjcf": ("arm.xml", load_arm, sorted(DATA.rglob("*.xml"))),
    "sdf": ("arm.sdf", load_arm, sorted(DATA.rglob("*.sdf"))),
    "motion": ("motion.csv", lambda file: read_motion(file, ("a", "b")), _examples("*.csv")),
    "recording": ("recording.csv", lambda file: read_recording(file, ("a", "b")), _examples("*.csv")),
    "catalogue": ("motors.csv", lambda file: read_catalog(file.parent), [shipped("catalogs") / "motors.csv"]),
}


def main(target: str, seconds: str) -> None:
    """Fuzz one reader for so long."""
    name, read, seeds = TARGETS[target]
    folder, kept = Path(tempfile.mkdtemp()), Path(f"fuzz_{target}")
    corpus = folder / "corpus"
    corpus.mkdir()
    for number, seed in enumerate(seeds):
        (corpus / str(number)).write_bytes(seed.read_bytes()[:20_000])
    place, found, tried, end = folder / name, set[str](), 0, time.monotonic() + float(seconds)
    warnings.simplefilter("ignore")

    def once(data: bytes) -> None:
        nonlocal tried
        tried += 1
        place.write_bytes(data)
        begin = time.monotonic()
        try:
            read(place)
        except InputError as error:
            str(error)
        except Exception as error:
            frame = traceback.extract_tb(error.__traceback__)[-1]
            report(f"{type(error).__name__} in {Path(frame.filename).name}:{frame.name}: {error}"[:200], data)
        if (took := time.monotonic() - begin) > SLOW:
            report(f"takes {took:.0f} s", data)
        if time.monotonic() > end:
            print(f"| {target} | {tried} | {len(found) or 'nothing'} | {seconds} |", flush=True)
            os._exit(0)  # the fuzzer knows no other end that leaves a count

    def report(what: str, data: bytes) -> None:
        key = what.partition(": ")[0]
        if key not in found:
            found.add(key)
            kept.mkdir(exist_ok=True)
            (kept / f"{len(found)}{place.suffix}").write_bytes(data)
            print(f"{target}: {what}", flush=True)

    atheris.Setup([sys.argv[0], str(corpus), "-max_len=20000", "-verbosity=0"], once)
    atheris.Fuzz()


if __name__ == "__main__":
    main(*sys.argv[1:])
