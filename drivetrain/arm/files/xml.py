"""The XML of a robot description: parsed without namespaces, its numbers read, unused elements counted."""

from __future__ import annotations

import importlib.util
import math
import os
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from drivetrain.arrays import Array, within_reach
from drivetrain.errors import Fault, Faults, InputError, plain
from drivetrain.units import number_of
from drivetrain.whole_files import is_there, read_bytes

EXPAND = Path(__file__).with_name("expand_xacro.py")
LONGEST_WAIT = 60.0  # [s] of wall time, on a busy machine; the process itself stops after 5 s of processor time
TRUSTED = "DRIVETRAIN_TRUST_XACRO"  # if set, xacro files may run any code
REFUSALS = ("is not evaluated", "is not below", "is not allowed")
TRUST = f"for a file you trust: drivetrain --trust-xacro, or {TRUSTED}=1 in the environment"
PACKAGE = "package://"
PACKAGE_ROOTS = "ROS_PACKAGE_PATH or AMENT_PREFIX_PATH name the folders that hold packages"
PACKAGE_SOUGHT = re.compile(r"\$\(find ([\w.-]+)\) is not below")
ARGUMENT_SOUGHT = re.compile(r"Undefined substitution argument (\w+)")
ROOTS = ("robot", "sdf", "mujoco")
LARGEST = 1 << 25  # bytes, also of an expanded xacro file: parsed elements take some twenty times as much memory
UNLIMITED = sys.float_info.max  # files use it for "no limit", since most parsers do not accept "inf"


def read_document(path: Path) -> ElementTree.Element:
    """The root element of a robot's file (a xacro file is expanded): <robot>, <sdf> or <mujoco>.

    Tags keep their prefix as written (``drake:gear_ratio``), whether or not the file declares the namespace.
    """
    if not is_there(path):
        raise InputError(Fault(str(path), "no such file"))
    text = _expanded(path) if path.suffix == ".xacro" else read_bytes(path, LARGEST)
    builder = ElementTree.TreeBuilder()
    parser = expat.ParserCreate()
    parser.StartElementHandler = lambda tag, given: builder.start(
        tag, {name: plain(text) for name, text in given.items()}
    )
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.data
    try:
        parser.Parse(text, True)
    except expat.ExpatError as error:
        place = f"line {error.lineno}, column {error.offset}"
        raise InputError(Fault(place, f"malformed XML: {expat.ErrorString(error.code)}", file=str(path))) from None
    except (ValueError, LookupError) as error:  # an unknown or unsupported encoding
        raise InputError(Fault("encoding", f"{error}; must be UTF-8", file=str(path))) from None
    root = builder.close()
    if root.tag not in ROOTS:
        problem = "must be a <robot> element, or that of another known format: <sdf>, <mujoco>"
        raise InputError(Fault("root", problem, f"<{root.tag}>", file=str(path)))
    return root


def _expanded(path: Path) -> bytes:
    if importlib.util.find_spec("xacro") is None:
        problem = "a xacro file needs the package xacro"
        raise InputError(Fault(str(path), problem, hint='install it with: pip install "drivetrain[xacro]"'))
    if os.environ.get(TRUSTED):
        return _trusted(path)
    own = path.resolve().parent
    package = next((one for one in (own, *own.parents) if (one / "package.xml").is_file()), own)
    roots = [package, *_stated_roots()]  # folders whose files it may include
    command = [sys.executable, "-P", str(EXPAND), str(path.resolve()), *map(str, roots)]
    around = {"PYTHONPATH": os.pathsep.join(one for one in sys.path if one), "PYTHONIOENCODING": "utf-8"}
    kept = {name: os.environ[name] for name in ("SYSTEMROOT", "LD_LIBRARY_PATH") if name in os.environ}
    try:
        done = subprocess.run(command, capture_output=True, env=around | kept, timeout=LONGEST_WAIT, check=False)
    except subprocess.TimeoutExpired:
        raise InputError(Fault(str(path), "xacro cannot expand it: it takes too long", hint=TRUST)) from None
    if done.returncode == 0:
        return done.stdout
    said = done.stderr.decode("utf-8", "replace").rpartition("\0")[2].strip()
    problem = said if done.returncode == 2 else "it takes more than 5 s or 1 GB"
    hint = _hint(path, said) if done.returncode == 2 else TRUST
    raise InputError(Fault(str(path), f"xacro cannot expand it: {problem}", hint=hint))


def _hint(path: Path, said: str) -> str:
    if found := PACKAGE_SOUGHT.search(said):
        beside = [one for one in path.resolve().parents if (one / found[1]).is_dir()]
        return f"it is in {beside[0]}: ROS_PACKAGE_PATH={beside[0]}" if beside else PACKAGE_ROOTS
    if found := ARGUMENT_SOUGHT.search(said):
        return f"xacro {path.name} {found[1]}:=VALUE > arm.urdf gives a file without arguments"
    return TRUST if any(word in said for word in REFUSALS) else ""


def _stated_roots() -> list[Path]:
    return [*_stated("ROS_PACKAGE_PATH"), *(one / "share" for one in _stated("AMENT_PREFIX_PATH"))]


def _stated(variable: str) -> list[Path]:
    return [Path(one) for one in os.environ.get(variable, "").split(os.pathsep) if one]


def package_file(address: str, beside: Path | None = None) -> Path | None:
    """The file of a ROS package: in a folder of that name above ``beside``, or in ROS's folders; None if not found."""
    name, _, rest = address.removeprefix(PACKAGE).partition("/")
    above = () if beside is None else beside.resolve().parents
    roots = _stated_roots()
    places = [folder / part for folder in above for part in (f"{name}/{rest}", rest)]
    places += [root / name / rest for root in roots] + [root / rest for root in roots if root.name == name]
    return next((place for place in places if is_there(place)), None)


def _trusted(path: Path) -> bytes:
    """The expanded URDF text of a trusted xacro file, without restrictions."""
    import xacro

    try:
        return bytes(xacro.process_file(str(path)).toxml(encoding="utf-8"))
    except Exception as error:  # expressions of macros can raise anything
        raise InputError(Fault(str(path), f"xacro cannot expand it: {error}")) from error


class Reader:
    """Reads numbers from elements, collects faults, and counts unused tags and attributes."""

    def __init__(self, file: str) -> None:
        self.file = file
        self.faults = Faults(file)
        self.ignored: Counter[str] = Counter()

    def text(self, element: ElementTree.Element, attribute: str, place: str) -> str:
        value = element.get(attribute, "").strip()
        if not value:
            self.faults.add(place, f'<{element.tag}> needs the attribute "{attribute}"')
        return value

    def numbers(self, element: ElementTree.Element, attribute: str, place: str, default: Iterable[float]) -> Array:
        """An attribute with as many finite numbers as its default."""
        return self.parsed(element.get(attribute), f"<{element.tag} {attribute}=...>", place, default)

    def parsed(self, written: str | None, called: str, place: str, default: Iterable[float]) -> Array:
        """A text with as many finite numbers as the default, which stands for a text that is not there."""
        fallback = np.array([*default])
        if written is None:
            return fallback
        try:
            values = np.array([float(word) for word in written.split()])
        except ValueError:
            values = np.empty(0)
        if values.shape != fallback.shape or not within_reach(values):
            hint = "a xacro expression: give the file the suffix .xacro" if "${" in written else ""
            self.faults.add(place, f"{called} must be {len(fallback)} finite number(s)", written, hint)
            return fallback
        return values

    def number(self, element: ElementTree.Element, attribute: str, place: str, default: float | None = None) -> float:
        """An attribute as a finite number; one without a default must be there."""
        if default is None and not self.text(element, attribute, place):
            return 0.0
        return float(self.numbers(element, attribute, place, [default or 0.0])[0])

    def limit(self, element: ElementTree.Element, attribute: str, place: str, default: float) -> float:
        """A limit, which may be infinite; the largest float also counts as infinite."""
        written = element.get(attribute, str(default))
        value = number_of(written)
        if math.isnan(value):
            self.faults.add(place, f"<{element.tag} {attribute}=...> must be a number", written)
            return default
        return math.copysign(math.inf, value) if abs(value) >= UNLIMITED else value

    def count_ignored(self, element: ElementTree.Element, tags: Iterable[str], attributes: Iterable[str] = ()) -> None:
        """Count the unused children and attributes of an element."""
        known = set(tags)
        inside = f"<{element.tag}>/" if element.tag == "ros2_control" else ""
        self.ignored.update(f"{inside}<{child.tag}>" for child in element if child.tag not in known)
        strangers = set(element.keys()) - set(attributes)
        self.ignored.update(f"<{element.tag} {name}=...>" for name in strangers if not name.startswith("xmlns"))

    def ignored_note(self) -> str:
        """A text on what was ignored, with counts; empty if nothing was."""
        if not self.ignored:
            return ""
        return "ignored: " + ", ".join(f"{tag} ({count})" for tag, count in sorted(self.ignored.items()))
