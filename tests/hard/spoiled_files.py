"""Files with one number spoiled: studies, motions, rows of a catalogue."""

from __future__ import annotations

import csv
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import yaml

import drivetrain as dt
from drivetrain.motion.read import read_load_table, read_motion
from drivetrain.whole_files import shipped

WORDS = ("nan", "inf", "-inf", "1e400", "1e308", "0", "three", "", "-", "1e12")
NUMBER = re.compile(r"[-+]?\d+(\.\d*)?([eE][-+]?\d+)?")
Reader = Callable[[], Any]


def spoiled_text(text: str, rng: np.random.Generator) -> str:
    """The number in a text, such as ``48 V``, replaced; or its sign turned, or its unit gone."""
    found = NUMBER.search(text)
    if found is None or rng.random() < 0.1:
        return str(rng.choice(["", "nan", text + text, "5"]))
    if rng.random() < 0.25:
        return text.replace(found[0], "-" + found[0].lstrip("+-"), 1)
    return text.replace(found[0], str(rng.choice(WORDS)), 1)


def spoiled_leaf(value: Any, rng: np.random.Generator) -> Any:
    """A document with one leaf spoiled."""
    if isinstance(value, dict) and value:
        key = list(value)[rng.integers(len(value))]
        return {**value, key: spoiled_leaf(value[key], rng)}
    if isinstance(value, list) and value:
        place = int(rng.integers(len(value)))
        return [spoiled_leaf(part, rng) if i == place else part for i, part in enumerate(value)]
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        others: list[Any] = [float("nan"), float("inf"), -value, 1e308, 10**400, "three", None, [], {}]
        return others[rng.integers(len(others))]
    if isinstance(value, str) and NUMBER.search(value):
        return spoiled_text(value, rng)
    return [None, float("nan"), -1.0, [], {}, "", value][rng.integers(7)]


class Studies:
    """Study files of the examples, one leaf of their own spoiled."""

    def __init__(self, folder: Path):
        self.files = []
        for name in ("one_axis", "desktop_arm"):
            shutil.copytree(shipped("examples") / name, folder / name)
            path = folder / name / "study.yaml"
            self.files.append((path, yaml.safe_load(path.read_text(encoding="utf-8"))))

    def spoiled(self, rng: np.random.Generator) -> Reader:
        """Write the next one, and give what reads it."""
        path, document = self.files[rng.integers(len(self.files))]
        wrong = spoiled_leaf({k: v for k, v in document.items() if k not in ("name", "description")}, rng)
        path.write_text(yaml.safe_dump(wrong, allow_unicode=True), encoding="utf-8")
        return lambda: dt.load_study(path)


class Tables:
    """A table of text with one cell spoiled."""

    def __init__(self, source: Path, target: Path, read: Callable[[Path], Any], most_rows: int = 400):
        with source.open(encoding="utf-8", newline="") as file:
            self.rows = list(csv.reader(file))[: most_rows + 1]
        self.target, self.read = target, read
        target.parent.mkdir(parents=True, exist_ok=True)

    def spoiled(self, rng: np.random.Generator) -> Reader:
        """Write it, and give what reads it."""
        rows = [list(row) for row in self.rows]
        row = rows[1 + rng.integers(len(rows) - 1)]
        column = int(rng.integers(len(row)))
        row[column] = spoiled_text(row[column], rng)
        with self.target.open("w", encoding="utf-8", newline="") as file:
            csv.writer(file).writerows(rows)
        return lambda: self.read(self.target)


class Urdf:
    """A robot's file with one attribute spoiled, or one character of it."""

    def __init__(self, folder: Path):
        self.text = (shipped("examples") / "desktop_arm" / "desktop_arm.urdf").read_text(encoding="utf-8")
        self.values = [found.span(1) for found in re.finditer('="([^"]*)"', self.text)]
        self.path = folder / "spoiled.urdf"

    def spoiled(self, rng: np.random.Generator) -> Reader:
        """Write it, and give what reads it."""
        if rng.random() < 0.2:
            at = int(rng.integers(len(self.text)))
            wrong = self.text[:at] + chr(rng.integers(32, 127)) + self.text[at + 1 :]
        else:
            start, end = self.values[rng.integers(len(self.values))]
            words = self.text[start:end].split() or [""]
            place = int(rng.integers(len(words)))
            words[place] = spoiled_text(words[place], rng)
            wrong = self.text[:start] + " ".join(words) + self.text[end:]
        self.path.write_text(wrong, encoding="utf-8")
        return lambda: dt.load_arm(self.path)


class Recordings:
    """A recording cut short, or with some of its bytes changed."""

    def __init__(self, folder: Path):
        run = dt.simulate_passive(dt.load_arm("planar-2r"), [0.1, 0.2], [0.0, 0.0], 0.05)
        self.path = run.save(folder / "run.npz")
        self.whole = self.path.read_bytes()

    def spoiled(self, rng: np.random.Generator) -> Reader:
        """Write it, and give what reads it."""
        wrong = bytearray(self.whole)
        if rng.random() < 0.5:
            wrong = wrong[: rng.integers(len(wrong))]
        else:
            for at in rng.integers(len(wrong), size=3):
                wrong[at] = rng.integers(256)
        self.path.write_bytes(bytes(wrong))
        return lambda: dt.load_recording(self.path)


def _read_puma(path: Path) -> Any:
    return read_motion(path, dt.load_arm("puma560").joint_names)


def spoilers(folder: Path) -> dict[str, tuple[Any, int]]:
    """What spoils, and how often it shall."""
    examples, catalogue = shipped("examples"), shipped("catalogs")
    return {
        "study": (Studies(folder), 40),
        "robot": (Urdf(folder), 200),
        "recording": (Recordings(folder), 100),
        "motion": (Tables(examples / "puma560" / "swing.csv", folder / "a" / "swing.csv", _read_puma, 30), 100),
        "load table": (Tables(examples / "one_axis" / "door.csv", folder / "b" / "door.csv", read_load_table), 300),
        "motor row": (
            Tables(catalogue / "motors.csv", folder / "c" / "motors.csv", lambda path: dt.read_catalog(path.parent), 3),
            350,
        ),
        "gear row": (
            Tables(catalogue / "gears.csv", folder / "d" / "gears.csv", lambda path: dt.read_catalog(path.parent), 3),
            350,
        ),
    }
