"""Conversion of units at input and output: texts such as "92.5 gcm²" to SI floats, SI floats to readable units.

The registry contains only the units of ``units.txt``: pint's own definitions read "10 Nm" as a textile unit. Spellings
of data sheets ("min⁻¹", "oz-in-s2", "V/1000 rpm") are first converted to products of symbols; ambiguous spellings, and
units that include a convention (A_rms), are refused with a hint.
Angle is a dimension, so 100 Hz or 100 1/s is not accepted as a speed. Temperatures are in degrees Celsius throughout
the package ("degC"); differences are in kelvin.

``Torque`` and similar names at the end are annotations of fields: a float in SI, and how it is read from a file.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import NDArray

from drivetrain.errors import LARGEST, Fault, Faults, InputError, nearest

if TYPE_CHECKING:
    import pint


class NotAUnitError(ValueError):
    """A unit text that cannot be read, with the problem and a hint."""

    def __init__(self, problem: str, hint: str = ""):
        self.problem, self.hint = problem, hint
        super().__init__(problem)


_SIGNS = {"−": "-", "–": "-", "μ": "u", "µ": "u", "°C": "degC", "°F": "degF", "°": "deg", "Ω": "ohm", "%": "percent",
          "‰": "per_mille", "·": "*", "⋅": "*", "•": "*", "∙": "*", "×": "*", "**": "^"}  # fmt: skip
_RPM = re.compile(
    r"(?<![\w/])(?:1|r|u|tr)\s*/\s*min\b|(?<=/)1\s*/\s*min\b|^\s*/\s*min\b|\bmin\s*\^?\s*(?:-1\b|\(-1\))|\brpm\b", re.I
)
_KILO_RPM = re.compile(r"(?<![\w.])1000\s*(?:rpm\b|/\s*min\b)|\bkrpm\b", re.I)
_CONVENTION = re.compile(r"([mk]?[AV])_?(rms|eff|pk|peak|ac|dc|pp)", re.I)
_GLUED = (  # words that are products; a following exponent belongs to the last factor
    (re.compile(r"([mkMu]?)N([cm]?m)(s?)"), lambda m: [f"{m[1]}N", m[2]] + ["s"] * bool(m[3])),
    (re.compile(r"([mkMu]?[VAWJN])s"), lambda m: [m[1], "s"]),
    (re.compile(r"([mk]?A|k?W)h"), lambda m: [m[1], "h"]),
    (re.compile(r"(k?g|kgf|kp)([cm]?m)(s?)"), lambda m: [m[1], m[2]] + ["s"] * bool(m[3])),
    (re.compile(r"(oz|lb)(f?)(in|ft)"), lambda m: [m[1] + m[2], m[3]]),
    (re.compile(r"(in|ft)(oz|lb)(f?)"), lambda m: [m[2] + m[3], m[1]]),
)
_RESPELLED = {"Kg": "kg", "KG": "kg", "C": "degC", "Ohm": "ohm", "Ohms": "ohm", "mOhm": "mohm", "kOhm": "kohm",
              "RPM": "rpm", "Vdc": "V", "VDC": "V", "sec": "s", "Deg": "deg", "NM": "Nm"}  # fmt: skip


def _cleaned(text: str) -> str:
    """The text with Unicode and rpm spellings replaced by plain text, and exponents marked by ^."""
    plain = unicodedata.normalize("NFKC", text.replace("⁻", "-")).strip()
    for sign, word in _SIGNS.items():
        plain = plain.replace(sign, word)
    plain = _RPM.sub("rpm", plain)
    plain = _KILO_RPM.sub("krpm", plain)
    plain = re.sub(r"\^\s*\((-?\d+)\)", r"^\1", plain)
    return re.sub(r"(?<=[A-Za-z])\s*\^?\s*(-?\d+)(?![\d.])", r"^\1", plain)


def _word(word: str) -> list[str]:
    """The known symbols that a word consists of."""
    word = _RESPELLED.get(word, word)
    convention = _CONVENTION.fullmatch(word)
    if convention:
        if convention[2].lower() == "dc":
            return [convention[1]]
        raise NotAUnitError(
            f"{word!r} mixes a unit with a convention", f"write {convention[1]} and state rms or peak in its own field"
        )
    for pattern, split in _GLUED:
        match = pattern.fullmatch(word)
        if match:
            return split(match)
    return [word]


def _operand(piece: str) -> str:
    """A part between slashes and spaces, such as oz-in-s^2, as a product in brackets."""
    symbols: list[str] = []
    for part in re.split(r"[-.](?=[A-Za-z])", piece):
        match = re.fullmatch(r"([A-Za-z_]+)(\^-?\d{1,2})?", part)  # evaluating a power with more digits would never end
        if not match:
            raise NotAUnitError(f"cannot read {part!r} as a unit")
        symbols += _word(match[1])
        symbols[-1] += match[2] or ""
    return symbols[0] if len(symbols) == 1 else "(" + "*".join(symbols) + ")"


def pint_expression(text: str) -> str:
    """A unit text as a product that pint reads; raises ``NotAUnitError`` if it is unknown or ambiguous."""
    pieces = re.findall(r"[()/*]|[^\s()/*]+", _cleaned(text))
    out: list[str] = []
    divided = [False]  # at each depth of brackets: whether there was a slash
    for piece in pieces:
        joins = bool(out) and out[-1] not in "(/*"
        if piece not in "*/)" and joins:
            out.append("*")
        if divided[-1] and (piece == "*" or (joins and piece not in "*/)")):
            raise NotAUnitError("a product after a slash can be read in two ways", "put it in brackets: a/(b c)")
        divided[-1] = divided[-1] or piece == "/"
        if piece == "(":
            divided.append(False)
        elif piece == ")" and len(divided) > 1:
            divided.pop()
        out.append(piece if piece in "()/*1" else _operand(piece))
    joined = "".join(out)
    if len(divided) > 1 or joined.count("(") != joined.count(")"):
        raise NotAUnitError("brackets do not match")
    if re.search(r"(?:^|[(*/])(?:[)*/]|$)", joined):
        raise NotAUnitError(f"cannot read {text!r} as a unit")
    if re.search(r"\b(in|ft)\b(?!\^)", joined):  # oz-in, lb/in, oz-in-s2: a force; lb-in2: a mass
        joined = re.sub(r"\b(oz|lb)\b", r"\1f", joined)
    return joined.replace("^", "**")


NUMBER = re.compile(r"\s*([+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?)(.*)", re.DOTALL)
LONGEST = 200  # largest number of characters of a unit
PURE = ("", "1", "-")

# Names of dimensions by SI unit; the first unit of each is also the one shown in errors.
NAMES = {
    "rad/s": "rotation speed", "rad/s^2": "rotational acceleration", "rad": "angle", "Hz": "frequency",
    "N m": "torque or energy", "N m/rad": "torsional stiffness", "N m/A": "torque constant", "N": "force",
    "N m s/rad": "viscous friction", "kg m^2": "moment of inertia", "kg": "mass", "m": "length", "m/s": "speed",
    "m/s^2": "acceleration", "m/rad": "travel per angle", "rad/m": "angle per travel", "V": "voltage", "A": "current",
    "W": "power", "ohm": "resistance", "H": "inductance", "F": "capacitance", "s": "time", "K": "temperature",
    "K/W": "thermal resistance", "J/K": "heat capacity", "V s/rad": "back-emf constant", "N/m": "stiffness",
    "1/K": "temperature coefficient", "rad/(s V)": "speed constant", "rad/(s N m)": "speed-torque gradient",
    "1": "pure number",
}  # fmt: skip

# Readable units of a quantity, largest first: the first one in which the value is at least 1 is used, else the last.
READABLE = {
    "A": ("A", "mA"), "V": ("V", "mV"), "W": ("kW", "W", "mW"), "J": ("kJ", "J", "mJ"), "N m": ("N m", "mN m"),
    "N": ("N", "mN"), "kg": ("kg", "g"), "m": ("m", "mm"), "kg m^2": ("kg m^2", "kg cm^2", "g cm^2"),
    "ohm": ("ohm", "mohm"), "H": ("H", "mH", "uH"), "F": ("F", "mF", "uF"), "N m/A": ("N m/A", "mN m/A"),
    "V s/rad": ("V s/rad", "mV s/rad"), "s": ("h", "s", "ms"), "N m/rad": ("N m/rad", "mN m/rad"),
    "Hz": ("kHz", "Hz"), "m/s": ("m/s", "mm/s"),
}  # fmt: skip
BACK_EMF = (  # hint if a torque constant is given in V/krpm
    "per ampere dc a back-emf constant of 1 V/krpm is 9.549 mN m/A: of a DC motor, or the amplitude between two lines "
    "of a brushless one (1.414 times the rms value)"
)
Interval = tuple[float | None, float | None]
TO_CELSIUS = {"degC": (1.0, 0.0), "K": (1.0, -273.15), "degF": (5.0 / 9.0, -160.0 / 9.0)}  # factor and offset
LARGEST_IN_SECONDS = 9000.0  # 2.5 h: shorter times are shown in seconds


class SI(float):
    """A number without unit from Python, in SI; the field that reads it sets its unit, which is used in files."""

    unit: str | None = None

    def __deepcopy__(self, memo: object) -> SI:
        return self


@dataclass(frozen=True)
class _Unit:
    """Meaning of a unit text: factor to SI, dimension, and cleaned spelling."""

    scale: float
    dimension: Mapping[str, float]
    text: str


@lru_cache(maxsize=1)
def _registry() -> pint.UnitRegistry:
    """The registry of units, built on first use, since importing pint takes a third of a second."""
    import pint

    registry: pint.UnitRegistry = pint.UnitRegistry(None)
    registry.load_definitions(str(Path(__file__).with_name("units.txt")))
    return registry


@lru_cache(maxsize=4096)
def _unit(text: str) -> _Unit:
    """The meaning of a unit text; raises ``NotAUnitError``."""
    import pint

    if text.strip() in PURE:
        return _Unit(1.0, {}, "")
    if len(text) > LONGEST:
        raise NotAUnitError(f"its unit has {len(text)} characters, more than {LONGEST}")
    expression = pint_expression(text)
    registry = _registry()
    try:
        parsed = registry.parse_units(expression)
        scale = float(registry.Quantity(1.0, parsed).to_root_units().magnitude)
    except pint.UndefinedUnitError as error:
        missing = str(error.unit_names if isinstance(error.unit_names, str) else error.unit_names[0])
        known = [str(name) for name in registry._units if len(str(name)) <= 10]
        raise NotAUnitError(f"unknown unit {missing!r}", nearest(missing, [*known, "Nm", "krpm"])) from None
    except (pint.PintError, ArithmeticError, ValueError, TypeError, SyntaxError, AttributeError, KeyError):
        raise NotAUnitError(f"cannot read {text!r} as a unit") from None
    dimension: Any = parsed.dimensionality
    return _Unit(scale, {str(base): float(power) for base, power in dimension.items()}, expression)


@lru_cache(maxsize=1)
def _dimension_names() -> dict[frozenset[tuple[str, float]], str]:
    return {frozenset(_unit(unit).dimension.items()): name for unit, name in reversed(NAMES.items())}


def _called(unit: _Unit) -> str:
    name = _dimension_names().get(frozenset(unit.dimension.items()), "quantity of another kind")
    return f"an {name}" if name[0] in "aeio" else f"a {name}"


def _conversion(text: str, unit: str) -> tuple[float, float]:
    """Factor and offset from a unit text to the SI unit ``unit``; raises ``NotAUnitError`` if dimensions differ."""
    found, wanted = _unit(text), _unit(unit)
    if wanted.text == "degC":
        if found.text in TO_CELSIUS:
            return TO_CELSIUS[found.text]
    elif wanted.text == "K" and found.text in ("degC", "degF"):
        raise NotAUnitError("must be a difference of temperatures", "write it in K")
    elif found.dimension == wanted.dimension or _radian_left_out(found, wanted):
        return found.scale / wanted.scale, 0.0
    example = "%" if unit in PURE else unit
    problem = f"must be {_called(wanted)} in a unit such as {example}, but {text!r} is {_called(found)}"
    raise NotAUnitError(problem, _angle_hint(found, wanted))


def _radian_left_out(found: _Unit, wanted: _Unit) -> bool:
    """Whether only the radian is missing in a unit that data sheets print without it, and that is unambiguous.

    Examples are viscous friction in Nms and the back-emf constant in Vs (or Nm/A).
    """
    per_radian = [_unit("N m s/rad").dimension, _unit("V s/rad").dimension]
    return (
        "Hz" not in found.text
        and wanted.dimension in per_radian
        and found.dimension == {base: power for base, power in wanted.dimension.items() if base != "[angle]"}
    )


def _angle_hint(found: _Unit, wanted: _Unit) -> str:
    bases = [{base: power for base, power in unit.dimension.items() if base != "[angle]"} for unit in (found, wanted)]
    if bases[0] != bases[1]:
        return ""
    if (found.dimension, wanted.dimension) == (_unit("V s/rad").dimension, _unit("N m/A").dimension):
        return BACK_EMF
    if found.dimension.get("[angle]", 0.0) == 0.0:
        if wanted.dimension == _unit("rad/s").dimension:
            return "write rpm, rad/s or deg/s: a rate by itself does not say what is counted"
        return "the angle is missing, such as rad, deg or rev"
    return "there is an angle too many"


def factor(unit_text: str) -> float:
    """Factor from a unit to SI (for temperatures that of differences)."""
    try:
        return _unit(unit_text).scale
    except NotAUnitError as error:
        raise InputError(Fault("unit", error.problem, unit_text, error.hint)) from None


def number_of(text: str) -> float:
    """The number in a text; NaN if it is not a number."""
    try:
        return float(text)
    except ValueError:
        return math.nan


def split_header(header: str) -> tuple[str, str]:
    """Name and unit of a column header such as ``Kt [mNm/A]``."""
    match = re.fullmatch(r"\s*(.*?)\s*\[([^\[\]]*)\]\s*", header, re.DOTALL)
    return (match[1], match[2].strip()) if match else (header.strip(), "")


def to_si(values: Any, unit_text: str, place: str = "", *, unit: str = "", file: str = "") -> NDArray[np.float64]:
    """Values in a unit as SI floats; temperatures are in degrees Celsius.

    ``unit`` is the SI unit whose dimension is required; empty: not checked, and kelvin are not converted.
    """
    try:
        scale, offset = _conversion(unit_text, unit) if unit else (_unit(unit_text).scale, 0.0)
        if not unit and _unit(unit_text).text == "degF":
            scale, offset = _conversion(unit_text, "degC")
    except NotAUnitError as error:
        raise InputError(Fault(place or "unit", error.problem, unit_text, error.hint, file)) from None
    return np.asarray(values, dtype=np.float64) * scale + offset


def quantity(
    value: Any,
    unit: str,
    place: str,
    *,
    minimum: float | None = None,
    maximum: float | None = None,
    above: float | None = None,
) -> float:
    """The SI float of a text such as "48 V" or "6000 1/min", after checking its dimension and range.

    Raises:
        InputError: Not a quantity with the dimension of ``unit``, or outside the range.
    """
    try:
        number, unit_text = _split_number(value, unit)
        scale, offset = _conversion(unit_text, unit)
        result = number * scale + offset
        if not abs(result) <= LARGEST:
            raise NotAUnitError(f"is too large to calculate with, above {LARGEST:g} in SI")
        _check_range(result, unit, minimum, maximum, above)
    except NotAUnitError as error:
        raise InputError(Fault(place, error.problem, value, error.hint)) from None
    return result


def _split_number(value: Any, unit: str) -> tuple[float, str]:
    """Number and unit text of a value as written; raises ``NotAUnitError``."""
    if isinstance(value, SI) and math.isfinite(value):
        value.unit = unit
        return float(value), unit
    example = f"48 {unit}" if unit not in PURE else "0.9 or 90 %"
    bare = isinstance(value, int | float) and not isinstance(value, bool)
    match = NUMBER.fullmatch(str(value).replace("−", "-")) if bare or isinstance(value, str) else None
    if match is None or not math.isfinite(float(match[1])):
        raise NotAUnitError(f"must be a number with a unit, such as {example}")
    number, rest = float(match[1]), match[2].strip()
    if rest.startswith(","):
        raise NotAUnitError("has a decimal comma", "write a point")
    if not rest and unit not in PURE:
        raise NotAUnitError(f"needs a unit, such as {number:g} {unit}")
    return number, rest


def _check_range(value: float, unit: str, minimum: float | None, maximum: float | None, above: float | None) -> None:
    shown = f" {unit}" if unit not in PURE else ""
    if minimum is not None and value < minimum:
        unknown = "leave it out if it is unknown" if value == 0.0 else ""
        raise NotAUnitError(f"must be at least {minimum:g}{shown}", unknown)
    if maximum is not None and value > maximum:
        percent = f"was {value:g} % meant?" if maximum == 1.0 and unit in PURE and 2.0 <= value <= 100.0 else ""
        raise NotAUnitError(f"must be at most {maximum:g}{shown}", percent)
    if above is not None and not value > above:
        raise NotAUnitError(f"must be above {above:g}{shown}")


def quantities(value: Any, unit: str, place: str, n: int | None = None) -> NDArray[np.float64]:
    """The SI vector of "[0, 0, 60] mm" or ["0 mm", "0 mm", "60 mm"], (n,); all faulty entries are reported."""
    entries = _entries(value)
    example = f"[{', '.join(['0'] * (n or 3))}]" + (f" {unit}" if unit not in PURE else "")
    if entries is None or (n is not None and len(entries) != n):
        count = f"{n} values" if n is not None else "a list"
        raise InputError(Fault(place, f"must be {count} with a unit, such as {example}", value))
    faults = Faults()
    results = [faults.attempt(quantity, entry, unit, f"{place}[{index}]") for index, entry in enumerate(entries)]
    faults.raise_any()
    return np.array(results, dtype=np.float64)


def _entries(value: Any) -> Sequence[Any] | None:
    """The list as written, each entry with its unit; None if it is not a list."""
    if isinstance(value, list | tuple):
        return value
    match = re.fullmatch(r"\s*\[([^\]]*)\]\s*(.*)", value, re.DOTALL) if isinstance(value, str) else None
    return None if match is None else [f"{entry.strip()} {match[2]}".strip() for entry in match[1].split(",")]


def from_si(values: Any, unit: str, unit_text: str) -> NDArray[np.float64]:
    """Values in the SI unit ``unit`` converted to another unit, for tables and files."""
    try:
        scale, offset = _conversion(unit_text, unit)
    except NotAUnitError as error:
        raise InputError(Fault("unit", error.problem, unit_text, error.hint)) from None
    return (np.asarray(values, dtype=np.float64) - offset) / scale


def readable_unit(value: float, unit: str) -> str:
    """A readable unit for a value in an SI unit."""
    choices = READABLE.get(unit)
    size = abs(value)
    if choices is None or size == 0.0 or not math.isfinite(size):
        return unit
    for choice in choices:
        if choice == "h" and size < LARGEST_IN_SECONDS:
            continue
        if size / factor(choice) >= 1.0 - 1e-12:
            return choice
    return choices[-1]


def refused(problem: str, hint: str = "", found: object = None) -> InputError:
    """The error for a value that a field does not accept; the reader of the file adds the place."""
    return InputError(Fault("", problem, found, hint))


class Reader:
    """Base class of annotations that define how a field reads a value from a file, through pydantic."""

    def read(self, value: Any) -> Any:
        """The value of the field from the value in the file; raises ``InputError``."""
        raise NotImplementedError

    def json_schema(self) -> dict[str, Any]:
        """JSON schema of accepted values, for editors."""
        raise NotImplementedError

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> Any:
        from pydantic_core import core_schema  # imported only when a file is read

        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> dict[str, Any]:
        return self.json_schema()


@dataclass(frozen=True)
class Quantity(Reader):
    """A number with a unit, converted to SI."""

    unit: str  # SI unit; empty for a pure number, which may be without unit or in percent
    minimum: float | None = None
    maximum: float | None = None
    above: float | None = None

    def read(self, value: Any) -> float:
        try:
            return quantity(value, self.unit, "", minimum=self.minimum, maximum=self.maximum, above=self.above)
        except InputError as error:
            raise InputError(replace(error.faults[0], value=None)) from None

    def json_schema(self) -> dict[str, Any]:
        if self.unit in PURE:
            return {"type": ["number", "string"], "description": "a pure number, or in %"}
        return {"type": "string", "description": f"a number with a unit such as {self.unit.replace('degC', '°C')}"}


@dataclass(frozen=True)
class Between(Reader):
    """A range of magnitudes: a list of the smallest and the largest one, with null for no limit."""

    unit: str

    def read(self, value: Any) -> Interval:
        example = f"[1 {self.unit}, 2 {self.unit}]" if self.unit not in PURE else "[30, 160]"
        if not isinstance(value, list | tuple) or len(value) != 2:
            raise refused(f"must be a range such as {example}", "null leaves an end open")
        low, high = (None if end is None else Quantity(self.unit).read(end) for end in value)
        if min(end for end in (low, high, 0.0) if end is not None) < 0.0:
            raise refused("must not be negative", f"values count by their magnitude, whatever their sign: {example}")
        if low is not None and high is not None and low > high:
            raise refused(f"must be a range such as {example}, smallest first")
        return low, high

    def json_schema(self) -> dict[str, Any]:
        end = {"type": ["number", "null"] if self.unit in PURE else ["string", "null"]}
        return {"type": "array", "minItems": 2, "maxItems": 2, "items": end, "description": "smallest and largest"}


@dataclass(frozen=True)
class Vector(Reader):
    """Three quantities: ``[0, 0, 40] mm``, or ``[0 mm, 0 mm, 40 mm]`` with a unit each."""

    unit: str

    def read(self, value: Any) -> tuple[float, float, float]:
        try:
            x, y, z = quantities(value, self.unit, "", 3)
        except InputError as error:
            raise InputError(error.faults[0]) from None
        return float(x), float(y), float(z)

    def json_schema(self) -> dict[str, Any]:
        kinds = ["number", "string"] if self.unit in PURE else "string"
        listed = {"type": "array", "minItems": 3, "maxItems": 3, "items": {"type": kinds}}
        words = f"three values such as [0, 0, 40] {self.unit}".rstrip()
        return {"anyOf": [{"type": "string"}, listed], "description": words}


@dataclass(frozen=True, eq=False)
class Function(Reader):
    """A value that a function reads."""

    function: Callable[[Any], Any]  # raises ``InputError``
    schema: dict[str, Any]  # JSON schema of accepted values

    def read(self, value: Any) -> Any:
        return self.function(value)

    def json_schema(self) -> dict[str, Any]:
        return self.schema


def read_names(value: Any) -> tuple[str, ...]:
    """A list of names, or a single name, as a tuple."""
    return tuple(map(read_name, value if isinstance(value, list | tuple) else [value]))


def read_name(value: Any) -> str:
    """A name; a number, such as a part number, is read as text."""
    if isinstance(value, bool) or not isinstance(value, str | int) or not str(value).strip():
        raise refused("must be a name (text)", "put it in quotes" if isinstance(value, bool | float) else "", value)
    return str(value).strip()


TEXT = {"type": "string"}
Name = Annotated[str, Function(read_name, TEXT)]
Names = Annotated[tuple[str, ...], Function(read_names, {"anyOf": [TEXT, {"type": "array", "items": TEXT}]})]

Capacitance = Annotated[float, Quantity("F", above=0.0)]
Current = Annotated[float, Quantity("A", above=0.0)]
Duration = Annotated[float, Quantity("s", above=0.0)]
Efficiency = Annotated[float, Quantity("", above=0.0, maximum=1.0)]
Factor = Annotated[float, Quantity("", above=0.0)]
Inertia = Annotated[float, Quantity("kg m^2", minimum=0.0)]
Force = Annotated[float, Quantity("N")]
Length = Annotated[float, Quantity("m")]
Mass = Annotated[float, Quantity("kg", minimum=0.0)]
PositiveLength = Annotated[float, Quantity("m", above=0.0)]
Power = Annotated[float, Quantity("W", minimum=0.0)]
Rate = Annotated[float, Quantity("Hz", above=0.0)]
Resistance = Annotated[float, Quantity("ohm", above=0.0)]
Share = Annotated[float, Quantity("", minimum=0.0, maximum=1.0)]
Speed = Annotated[float, Quantity("rad/s", above=0.0)]
Temperature = Annotated[float, Quantity("degC", minimum=-273.15)]
TemperatureStep = Annotated[float, Quantity("K", minimum=0.0)]
ThermalResistance = Annotated[float, Quantity("K/W", above=0.0)]
Torque = Annotated[float, Quantity("N m", minimum=0.0)]
ViscousFriction = Annotated[float, Quantity("N m s/rad", minimum=0.0)]
Voltage = Annotated[float, Quantity("V", above=0.0)]
