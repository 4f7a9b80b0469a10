"""Denavit-Hartenberg tables in files: CSV or Excel, JSON, and the models of Corke's Robotics Toolbox (.m, .py)."""

from __future__ import annotations

import ast
import csv
import json
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from drivetrain.arm.arm import STANDARD_GRAVITY, Arm
from drivetrain.arm.checks import LENGTH, farthest, millimetres
from drivetrain.arm.dh import DHConvention, DHRow, JointKind, arm_from_dh
from drivetrain.errors import Fault, Faults, InputError, nearest
from drivetrain.units import number_of, quantity, split_header
from drivetrain.whole_files import WORKBOOKS, read_text

# Unit and default of each column; "joint" is [rad] or [m], depending on the kind of the row, "joint/s" its rate.
COLUMNS: dict[str, tuple[str, float]] = {
    "a": ("m", 0.0), "alpha": ("rad", 0.0), "d": ("m", 0.0), "theta": ("rad", 0.0), "mass": ("kg", 0.0),
    "com_x": ("m", 0.0), "com_y": ("m", 0.0), "com_z": ("m", 0.0),
    "ixx": ("kg m^2", 0.0), "iyy": ("kg m^2", 0.0), "izz": ("kg m^2", 0.0),
    "ixy": ("kg m^2", 0.0), "ixz": ("kg m^2", 0.0), "iyz": ("kg m^2", 0.0),
    "lower": ("joint", -inf), "upper": ("joint", inf), "speed_limit": ("joint/s", inf), "offset": ("joint", 0.0),
}  # fmt: skip
NEEDED = ("a", "alpha", "d", "mass")
TEXTS = ("name", "kind")
# Names of the fields of a link in Corke's Robotics Toolbox (components of vectors as columns), in lower case.
TOOLBOX = {"m": "mass", "rx": "com_x", "ry": "com_y", "rz": "com_z", "qmin": "lower", "qmax": "upper", "sigma": "kind",
           "jointtype": "kind"}  # fmt: skip
OF_DRIVES = ("b", "jm", "g", "tc", "tc+", "tc-")  # friction, rotor and ratio, which the drives of a study define
KINDS = {"0": "revolute", "r": "revolute", "1": "prismatic", "p": "prismatic"}
TOOLBOX_SUFFIXES = (".json", ".m", ".py")  # models of the toolbox; every other file is read as a table
DH_SUFFIXES = (".csv", *WORKBOOKS, *TOOLBOX_SUFFIXES)


def read_dh_table(path: Path, convention: str, *, gravity: Any = None) -> Arm:
    """The arm of a Denavit-Hartenberg table; raises InputError with all faults of the file.

    A CSV file with columns ``name``, ``kind`` (revolute or prismatic), ``a [mm]``, ``alpha [deg]``, ``d [mm]``,
    ``theta [deg]``, ``offset [deg]`` (added to the joint's variable), ``mass [kg]``, ``com_x [mm]`` to ``com_z``,
    ``ixx [kg m^2]`` to ``iyz``, ``lower [deg]``, ``upper [deg]``, ``speed_limit [deg/s]``; or with those of
    ``TOOLBOX``. A cell may have its own unit. Alternatively a JSON list of links with these names; or a model of the
    Robotics Toolbox in MATLAB (.m) or Python (.py), which is read as text in SI, never run, without base and tool.
    """
    header, lines = _rows(path, convention)
    names = [split_header(column)[0].casefold() for column in header]
    names = [TOOLBOX.get(name, name) for name in names]
    faults = Faults(str(path))
    _check_header(names, faults)
    rows: list[tuple[int, DHRow]] = []
    for number, line in lines:
        cells = {name: (text.strip(), column) for name, column, text in zip(names, header, line, strict=False)}
        rows.append((number, _row(cells, f"row {number}", faults)))
    if not rows:
        faults.add("the file", "holds no joint")
    faults.raise_any()
    left = [column for name, column in zip(names, header, strict=True) if name in OF_DRIVES]
    notes = _implausible(rows, path)
    if left:
        notes.insert(0, f"{', '.join(left)}: not used, as the drives of the study bring inertia, ratio and friction")
    return arm_from_dh(
        [row for _, row in rows], convention=convention,  # type: ignore[arg-type]
        gravity=STANDARD_GRAVITY if gravity is None else gravity,
        joint_names=[line[names.index("name")].strip() for _, line in lines] if "name" in names else None,
        name=path.stem, notes=notes,
    )  # fmt: skip


def _rows(path: Path, convention: str) -> tuple[list[str], list[tuple[int, list[str]]]]:
    suffix = path.suffix.lower()
    if suffix not in TOOLBOX_SUFFIXES:
        return _csv(path)
    links = _json_links(path) if suffix == ".json" else _toolbox_links(path, convention)
    header = list(dict.fromkeys(name for _, link in links for name in link))
    return header, [(line, [link.get(name, "") for name in header]) for line, link in links]


def _csv(path: Path) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """Header, and the rows that are not empty with their line numbers."""
    try:
        parsed = list(csv.reader(read_text(path).splitlines()))
    except csv.Error as error:
        raise InputError(Fault("the file", f"cannot be read: {error}", file=str(path))) from None
    lines = [(i, line) for i, line in enumerate(parsed, 1) if line and not line[0].startswith("#")]
    if not lines:
        raise InputError(Fault("the file", "is empty", file=str(path)))
    return [column.strip() for column in lines[0][1]], lines[1:]


Link = dict[str, str]  # a cell by column


def _json_links(path: Path) -> list[tuple[int, Link]]:
    """Numbered links (from 1) of a JSON list, which may be the value of ``links``."""
    try:
        data = json.loads(read_text(path))
    except (ValueError, RecursionError) as error:
        raise InputError(Fault("the file", f"cannot be read: {error}", file=str(path))) from None
    data = data.get("links", data.get("joints")) if isinstance(data, dict) else data
    if not isinstance(data, list) or not all(isinstance(one, dict) for one in data):
        problem = "must hold a list of links, each with its columns"
        hint = 'such as [{"a [mm]": 400, "alpha [deg]": 90, "d": "0 m", "mass [kg]": 3}, ...]'
        raise InputError(Fault("the file", problem, hint=hint, file=str(path)))
    return [(i, {str(name): "" if cell is None else str(cell) for name, cell in one.items()})
            for i, one in enumerate(data, 1)]  # fmt: skip


# ---------------------------------------------------------------- Robotics Toolbox

_CLASS = re.compile(r"(Link|DHLink|Revolute|Prismatic|RevoluteDH|PrismaticDH|RevoluteMDH|PrismaticMDH)")
_FIELD = "m|r|I|qlim|Jm|G|B|Tc|theta|d|a|alpha|sigma|offset|mdh"
_LOOPED = re.compile(rf"\w\s*[({{]\s*[A-Za-z]\w*\s*[)}}]\s*(\.({_FIELD})\s*=[^=]|=\s*{_CLASS.pattern}\b)")
"""MATLAB code that sets a link, or a field of one, whose index is a variable."""
_VECTOR = ("theta", "d", "a", "alpha", "sigma", "offset")  # order in Link([...])
_PLACES = {"Revolute": ("d", "a", "alpha", "offset", "qlim"), "Prismatic": ("theta", "a", "alpha", "offset", "qlim")}
"""Names of positional arguments in Python."""
_FLIPPED = "a joint that is flipped is not read: turn its axis round in the table"
_TENSOR = ("Ixx", "Iyy", "Izz", "Ixy", "Iyz", "Ixz")
_FUNCTIONS: dict[str, Any] = {
    "sin": np.sin, "cos": np.cos, "tan": np.tan, "sqrt": np.sqrt, "deg2rad": np.deg2rad, "radians": np.deg2rad,
    "diag": lambda x: np.diag(x).ravel(), "array": lambda x: x,
}  # fmt: skip
_OPERATIONS: dict[type, Any] = {
    ast.Add: np.add, ast.Sub: np.subtract, ast.Mult: np.multiply, ast.Div: np.divide, ast.Pow: np.power,
    ast.USub: np.negative, ast.UAdd: np.positive,
}  # fmt: skip


def _toolbox_links(path: Path, convention: str) -> list[tuple[int, Link]]:
    """Line and cells of the links that a model defines, in their order."""
    text = read_text(path)
    found: list[tuple[int, dict[str, Any]]] = []
    names: dict[str, Any] = {"pi": math.pi}
    faults = Faults(str(path))
    try:
        steps = list(_python_steps(text) if path.suffix.lower() == ".py" else _matlab_steps(text))
    except (SyntaxError, ValueError, RecursionError) as error:
        raise InputError(Fault("the file", f"cannot be read: {error}", file=str(path))) from None
    for line, target, node in steps:
        name = _called(node) if isinstance(node, ast.Call) else ""
        makes = _CLASS.fullmatch(name)
        try:
            if makes and isinstance(node, ast.Call):
                found.append((line, _made_link(name, node, names, python=path.suffix.lower() == ".py")))
            elif isinstance(target, tuple):
                found[target[0] - 1][1][target[1]] = _value(node, names)
            elif target:
                names[target] = _value(node, names)
        except (ValueError, TypeError, IndexError, KeyError, ArithmeticError) as error:
            if makes or isinstance(target, tuple):
                faults.add(f"line {line}", f"is no link with plain numbers: {error}")
    if not found:
        faults.add("the file", "holds no joint: no Link(...), Revolute(...) or the like is written out")
    modified = {bool(link.get("mdh")) for _, link in found}
    found_convention = DHConvention.MODIFIED if True in modified else DHConvention.CLASSIC
    if found and (len(modified) > 1 or found_convention != convention):
        faults.add("convention", f"the model is {found_convention}", convention)
    rows = []
    for line, link in found:
        try:
            rows.append((line, _cells(link)))
        except (ValueError, TypeError) as error:
            faults.add(f"line {line}", f"is no link with plain numbers: {error}")
    faults.raise_any()
    return rows


Step = tuple[int, Any, ast.expr]  # line, target (a name, or a link's number and field), value


def _called(call: ast.Call) -> str:
    """The name of a called function, without its module."""
    return str(getattr(call.func, "id", getattr(call.func, "attr", "")))


def _python_steps(text: str) -> Iterator[Step]:
    """Assignments of names and definitions of links, in the order of the text."""
    nodes = list(ast.walk(ast.parse(text)))
    for loop in (one for one in nodes if isinstance(one, ast.For | ast.While | ast.ListComp | ast.GeneratorExp)):
        if any(isinstance(one, ast.Call) and _CLASS.fullmatch(_called(one)) for one in ast.walk(loop)):
            raise ValueError(f"line {loop.lineno} makes links in a loop: write them out")
    found: list[Any] = [node for node in nodes if isinstance(node, ast.Assign | ast.Call)]
    for node in sorted(found, key=lambda one: (one.lineno, one.col_offset)):
        if isinstance(node, ast.Call):
            yield node.lineno, None, node
        elif len(node.targets) == 1 and isinstance(node.targets[0], ast.Name):
            yield node.lineno, node.targets[0].id, node.value


def _matlab_steps(text: str) -> Iterator[Step]:
    lines = [re.sub(r"('[^'\n]*')|%.*", r"\1", line) for line in text.splitlines()]
    statement, first, lists = "", 1, 0
    for number, line in enumerate(lines, 1):
        first = first if statement else number
        part, more, _ = line.partition("...")
        statement += part + " "
        if more or statement.count("[") > statement.count("]") or statement.count("(") > statement.count(")"):
            continue
        for one in _parts(statement):
            made = list(_made(one))
            lists += len(made) > 1
            if lists > 1 and made:
                raise ValueError(f"line {first} makes links of another chain: leave those of one")
            yield from _matlab_step(one, made, first)
        statement = ""


def _parts(text: str) -> Iterator[str]:
    """Parts of a text separated by semicolons outside of brackets."""
    depth, part = 0, ""
    for sign in text:
        depth += (sign in "([{") - (sign in ")]}")
        if sign == ";" and depth <= 0:
            yield part
            part = ""
        else:
            part += sign
    yield part


def _made(text: str) -> Iterator[str]:
    """The calls in a text that define links, as written."""
    for start in re.finditer(rf"(?<![\w.'])(?:{_CLASS.pattern})\s*\(", text):
        depth, end = 1, start.end()
        while depth and end < len(text):
            depth += (text[end] == "(") - (text[end] == ")")
            end += 1
        yield text[start.start() : end]


def _matlab_step(text: str, made: list[str], line: int) -> Iterator[Step]:
    if _LOOPED.search(text):
        raise ValueError(f"line {line} makes links in a loop: write them out")
    for one in made:  # alone, or several in a bracket, in SerialLink(...) too
        try:
            yield line, None, ast.parse(_python_of(one), mode="eval").body
        except SyntaxError:
            raise ValueError(f"line {line} makes a link that is not of plain numbers: {one}") from None
    if made:
        return
    if not (found := re.fullmatch(r"\s*(\w+)\s*(?:[({](\d+)[)}])?\s*(?:\.(\w+))?\s*=\s*([^=].*)", text)):
        return
    name, index, field, value = found.groups()
    try:
        node = ast.parse(_python_of(value), mode="eval").body
    except SyntaxError:  # structs, handles, transposes: nothing of a link
        return
    yield line, (int(index), field) if index and field else None if index else name, node


def _python_of(text: str) -> str:
    """Translate a MATLAB expression to Python."""
    return re.sub(r"\[[^\]]*\]", lambda one: _listed(one[0]), text).replace("^", "**").strip()


def _listed(text: str) -> str:
    """A MATLAB bracket with commas between its numbers."""
    spaced = re.sub(r"(?<=[\w.)\]])\s+(?=[-+]?[\w.(])", ", ", text.replace(";", ","))
    return re.sub(r",(\s*,)+", ",", spaced)


def _value(node: ast.AST, names: dict[str, Any]) -> Any:
    """A number, or a list of numbers as an array."""
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float | str):
        return node.value
    if isinstance(node, ast.Name) and node.id in names:
        return names[node.id]
    if isinstance(node, ast.Attribute) and node.attr == "pi":
        return math.pi
    if isinstance(node, ast.List | ast.Tuple):
        return np.array([np.ravel(_value(one, names)) for one in node.elts], dtype=np.float64).ravel()
    if isinstance(node, ast.UnaryOp) and type(node.op) in _OPERATIONS:
        return _OPERATIONS[type(node.op)](_value(node.operand, names))
    if isinstance(node, ast.BinOp) and type(node.op) in _OPERATIONS:
        return _OPERATIONS[type(node.op)](np.float64(1.0) * _value(node.left, names), _value(node.right, names))
    if isinstance(node, ast.Call):
        name = _called(node)
        if name in _FUNCTIONS and len(node.args) == 1:
            return _FUNCTIONS[name](_value(node.args[0], names))
    raise ValueError(f"{ast.unparse(node)} is not known")


def _made_link(name: str, call: ast.Call, names: dict[str, Any], *, python: bool) -> dict[str, Any]:
    """The arguments of a link by name; flags of MATLAB count as names too."""
    found: dict[str, Any] = {}
    if python and call.args:
        places = next((places for kind, places in _PLACES.items() if name.startswith(kind)), ())
        if len(call.args) > len(places):
            raise ValueError(f"{name} needs names before its numbers")
        found = {place: _value(one, names) for place, one in zip(places, call.args, strict=False)}
    for keyword in call.keywords:
        if keyword.arg == "flip" and _value(keyword.value, names):
            raise ValueError(_FLIPPED)
        if keyword.arg in (*_VECTOR, "m", "r", "I", "qlim", "Jm", "G", "B", "Tc", "mdh"):
            found[keyword.arg] = _value(keyword.value, names)
    arguments = () if python else call.args
    given = [(one.value if isinstance(one, ast.Constant) else None, one) for one in arguments]
    while given:
        word, node = given.pop(0)
        if not isinstance(word, str):
            found |= dict(zip(_VECTOR, np.ravel(_value(node, names)).tolist(), strict=False))
        elif word in ("modified", "standard", "revolute", "prismatic"):
            found |= {"mdh": 1} if word == "modified" else {"sigma": 1} if word == "prismatic" else {}
        elif word == "flip":
            raise ValueError(_FLIPPED)
        elif given:
            value = given.pop(0)[1]
            if word in (*_VECTOR, "m", "r", "I", "qlim", "Jm", "G", "B", "Tc"):
                found[word] = _value(value, names)
    if name.endswith("MDH"):
        found["mdh"] = 1
    if name.startswith("Prismatic") or ("theta" in found and "d" not in found):
        found["sigma"] = 1
    return found


def _cells(link: dict[str, Any]) -> Link:
    slides = float(link.get("sigma", 0)) == 1.0
    own = "m" if slides else "rad"
    units = {"theta": "rad", "d": "m", "a": "m", "alpha": "rad", "offset": own, "m": "kg"}
    cells = {"kind": "prismatic" if slides else "revolute"}
    link = {**link, "d" if slides else "theta": 0.0}  # the toolbox ignores this value for the joint's variable
    cells |= {name: f"{float(link.get(name, 0.0))!r} {unit}" for name, unit in units.items()}
    tensor = np.ravel(link.get("I", np.zeros(6)))
    if tensor.size == 9:
        tensor = tensor[[0, 4, 8, 1, 5, 2]]
    vectors: Sequence[tuple[tuple[str, ...], Any, str]] = (
        (("rx", "ry", "rz"), np.ravel(link.get("r", np.zeros(3))), "m"),
        (_TENSOR[: tensor.size], tensor, "kg m^2"),
        (("qmin", "qmax"), np.ravel(link.get("qlim", [])), own),
    )
    for names, values, unit in vectors:
        if len(values) not in (0, len(names)):
            raise ValueError(f"{', '.join(names)} must be as many numbers")
        cells |= {name: f"{value!r} {unit}" for name, value in zip(names, map(float, values), strict=False)}
    return cells | {name: str(link[name]) for name in ("Jm", "G", "B", "Tc") if name in link}


def _check_header(names: list[str], faults: Faults) -> None:
    known = [*COLUMNS, *TEXTS, *OF_DRIVES]
    for name in names:
        if name not in known:
            faults.add(f"column {name}", "is not known", hint=nearest(name, known))
    for name in NEEDED:
        if name not in names:
            faults.add(f"column {name}", "is missing")


def _row(cells: dict[str, tuple[str, str]], place: str, faults: Faults) -> DHRow:
    stated = cells.get("kind", ("", ""))[0] or "revolute"
    kind = KINDS.get(stated.casefold(), stated)
    if kind not in list(JointKind):
        faults.add(f"{place}, column kind", "must be revolute or prismatic", stated)
    own = {"joint": "m", "joint/s": "m/s"} if kind == "prismatic" else {"joint": "rad", "joint/s": "rad/s"}
    v: dict[str, float] = {}
    for name, (unit, default) in COLUMNS.items():
        v[name] = default
        text, column = cells.get(name, ("", ""))
        if text:
            bare, wanted = math.isfinite(number_of(text)), own.get(unit, unit)
            spelled = f"{text} {split_header(column)[1]}" if bare else text
            read = faults.attempt(quantity, spelled, wanted, f"{place}, column {column}")
            if read is None and bare and unit in own:
                faults.found[-1] = replace(
                    faults.found[-1], hint=f"write the unit in this cell, such as {text} {wanted}"
                )
            v[name] = default if read is None else read
    inertia = [[v["ixx"], v["ixy"], v["ixz"]], [v["ixy"], v["iyy"], v["iyz"]], [v["ixz"], v["iyz"], v["izz"]]]
    moved = "d" if kind == "prismatic" else "theta"
    v[moved] += v["offset"]
    return DHRow(
        v["a"], v["alpha"], v["d"], v["theta"], JointKind(kind) if kind in list(JointKind) else JointKind.REVOLUTE,
        v["mass"], (v["com_x"], v["com_y"], v["com_z"]), inertia, v["lower"], v["upper"], v["speed_limit"],
    )  # fmt: skip


def _implausible(rows: Sequence[tuple[int, DHRow]], file: Path) -> list[str]:
    """Lengths of a Denavit-Hartenberg table, by line of the file, that look like millimetres given as metres."""
    found: list[str] = []
    reach = sum(math.hypot(row.a, row.d) for _, row in rows)
    for number, row in rows:
        lengths = [("a", row.a, LENGTH), ("d", row.d, LENGTH)]
        lengths += [(f"com_{axis}", value, farthest(reach)) for axis, value in zip("xyz", row.com, strict=True)]
        for name, value, most in lengths:
            if abs(value) > most:
                problem = f"{value:.4g} m is more than {most:.3g} m"
                fault = Fault(f"column {name}", problem, hint=millimetres(value), file=f"{file}:{number}")
                found.append(f"warning: {fault}")
    return found
