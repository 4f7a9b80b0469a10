"""Spellings of units on data sheets, brought to one plain form before any arithmetic.

"gcm²", "oz-in-s2", "6000 min⁻¹" and "V/1000 rpm" become products of symbols; spellings that can be read in two ways,
and units that hide a convention (A_rms), are refused with the fix.
"""

from __future__ import annotations

import re
import unicodedata


class NotAUnitError(ValueError):
    """A unit text that cannot be read; carries the problem and the fix."""

    def __init__(self, problem: str, hint: str = ""):
        self.problem, self.hint = problem, hint
        super().__init__(problem)


_SIGNS = {"−": "-", "–": "-", "μ": "u", "µ": "u", "°C": "degC", "°F": "degF", "°": "deg", "Ω": "ohm", "%": "percent",
          "‰": "per_mille", "·": "*", "⋅": "*", "•": "*", "∙": "*", "×": "*", "**": "^"}  # fmt: skip
_RPM = re.compile(
    r"(?<![\w/])(?:1|r)\s*/\s*min\b|(?<=/)1\s*/\s*min\b|^\s*/\s*min\b|\bmin\s*\^?\s*(?:-1\b|\(-1\))|\brpm\b", re.I
)
_KILO_RPM = re.compile(r"(?<![\w.])1000\s*(?:rpm\b|/\s*min\b)|\bkrpm\b", re.I)
_CONVENTION = re.compile(r"([mk]?[AV])_?(rms|eff|pk|peak|ac|dc|pp)", re.I)
_GLUED = (  # words that are products; the exponent that may follow belongs to the last factor
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
    """Unicode and rpm spellings brought to plain text; exponents marked by ^."""
    plain = unicodedata.normalize("NFKC", text.replace("⁻", "-")).strip()
    for sign, word in _SIGNS.items():
        plain = plain.replace(sign, word)
    plain = _RPM.sub("rpm", plain)
    plain = _KILO_RPM.sub("krpm", plain)
    plain = re.sub(r"\^\s*\((-?\d+)\)", r"^\1", plain)
    return re.sub(r"(?<=[A-Za-z])\s*\^?\s*(-?\d+)(?![\d.])", r"^\1", plain)


def _word(word: str) -> list[str]:
    """The known symbols a word stands for."""
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
    """One piece between slashes and spaces, such as oz-in-s^2, as a bracketed product."""
    symbols: list[str] = []
    for part in re.split(r"[-.](?=[A-Za-z])", piece):
        match = re.fullmatch(r"([A-Za-z_]+)(\^-?\d+)?", part)
        if not match:
            raise NotAUnitError(f"cannot read {part!r} as a unit")
        symbols += _word(match[1])
        symbols[-1] += match[2] or ""
    return symbols[0] if len(symbols) == 1 else "(" + "*".join(symbols) + ")"


def pint_expression(text: str) -> str:
    """A unit text as a product that pint reads; raises NotAUnitError where it can be read in no way or in two."""
    pieces = re.findall(r"[()/*]|[^\s()/*]+", _cleaned(text))
    out: list[str] = []
    divided = [False]  # at each depth of brackets: has a slash been passed?
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
