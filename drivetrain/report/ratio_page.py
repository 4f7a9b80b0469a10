"""The page of a ratio study: one picture and its tables a joint, in the look of the report."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import jinja2
from markupsafe import Markup

from drivetrain.errors import Fault, InputError
from drivetrain.report.figures_ratio import figure_ratio
from drivetrain.report.quantities import DASH, number, percent, with_unit
from drivetrain.report.svg import house_style, share_glyphs, svg_text
from drivetrain.report.views import CSS, anchor
from drivetrain.sizing.answers.ratio import ClosedForms, NearGear, RatioStudy, RatioWindow
from drivetrain.version import __version__

HERE = Path(__file__).parent


def ratio_report(studies: Sequence[RatioStudy]) -> str:
    """The ratio studies of one task as one page that needs nothing from outside.

    Raises:
        InputError: No study.
    """
    if not studies:
        raise InputError(Fault("joints", "none of them moves, so no ratio decides anything"))
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(HERE), autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    page = environment.get_template("ratio.html.j2").render(
        study=studies[0].study,
        version=__version__,
        style=Markup((HERE / "style.css").read_text(encoding="utf-8")),
        overview=[row for found in studies for row in ratio_rows(found)],
        joints=[_joint(found) for found in studies],
    )
    return share_glyphs(page) + "\n"


@dataclass(frozen=True)
class RatioRow:
    """One window of one joint as texts; a joint without any has one row too.

    Attributes:
        joint, anchor, motor, gear, own: The joint, its place on the page, its drive and the gear's own ratio.
        low, high, low_binding, high_binding: Ends of the window, and what fails beyond them.
        best, used: The ratio of least utilisation, and that utilisation.
        css: Class of the row.
    """

    joint: str
    anchor: str
    motor: str
    gear: str
    own: str
    low: str
    high: str
    low_binding: str
    high_binding: str
    best: str
    used: str
    css: str


def ratio_rows(found: RatioStudy) -> list[RatioRow]:
    """What a table of ratio studies holds of one joint."""
    nothing = RatioWindow(math.nan, math.nan, found.best.binding, found.best.binding)
    return [
        RatioRow(
            found.joint, anchor(found.joint), found.motor, found.gear or "ideal gear", number(found.drive.gear.ratio),
            "no ratio" if window is nothing else number(window.low), number(window.high), window.low_binding or DASH,
            window.high_binding or DASH, number(found.best.ratio), percent(found.best.utilisation),
            "fail" if window is nothing else "pass",
        )
        for window in found.windows or (nothing,)
    ]  # fmt: skip


def ratio_sentence(found: RatioStudy) -> str:
    """The answer for one joint."""
    drive = f"{found.motor} behind {found.gear or 'an ideal gear'}"
    if not found.windows:
        return (
            f"No ratio lets {drive} meet all limits: the best, {number(found.best.ratio)}, "
            f"needs {percent(found.best.utilisation)} of the limit on {found.best.binding}."
        )
    spans = " and ".join(_span(window) for window in found.windows)
    own = abs(found.drive.gear.ratio)
    inside = any(window.low <= own <= window.high for window in found.windows)
    where = f"{spans}; its own, {number(own)}, is {'inside' if inside else 'outside'}."
    if found.lacking:
        unknown = ", ".join(check.name for check in found.lacking)
        return f"{drive} is not proven to fit: data are missing to check {unknown}; the rest holds with a ratio {where}"
    return f"{drive} fits with a ratio {where}"


def _span(window: RatioWindow) -> str:
    """A window in words, with what ends it."""
    low = f"from {number(window.low)} ({window.low_binding})" if window.low > 0.0 else "of any smallness"
    high = f"to {number(window.high)} ({window.high_binding})" if window.high < math.inf else "upwards"
    return f"{low} {high}"


@dataclass(frozen=True)
class _GearRow:
    """A gear of the catalogue as texts."""

    key: str
    ratio: str
    verdict: str
    css: str
    used: str
    binding: str


@dataclass(frozen=True)
class _Joint:
    """One joint's section."""

    name: str
    anchor: str
    word: str
    css: str
    sentence: str
    figure: Markup
    formulas: list[tuple[str, str]]
    gears: list[_GearRow]
    reaction: list[tuple[str, str]]
    notes: tuple[str, ...]


def _joint(found: RatioStudy) -> _Joint:
    name = anchor(found.joint)
    with house_style(name):
        picture = svg_text(figure_ratio(found, name=name), f"{found.joint}: torque, speed and heat over the gear ratio")
    return _Joint(
        name=found.joint,
        anchor=name,
        word="fits" if found.feasible else "no ratio fits",
        css="pass" if found.feasible else "fail",
        sentence=ratio_sentence(found),
        figure=Markup(picture),
        formulas=_formulas(found.closed_forms, found.limits.continuous_torque),
        gears=[_gear(gear) for gear in found.gears],
        reaction=[(joint, _small_percent(share)) for joint, share in found.reaction.items()],
        notes=found.notes,
    )


def _formulas(forms: ClosedForms, rated: float | None) -> list[tuple[str, str]]:
    """The closed forms as texts."""
    rows = [
        ("matched inertia, √(I/J)", number(forms.matching)),
        ("least RMS motor torque", number(forms.least_rms)),
        ("least peak motor torque", number(forms.least_peak)),
    ]
    if forms.rated is not None:
        spans = [f"{number(span.low)} to {number(span.high)}" for span in forms.rated]
        rows.append((f"RMS torque within {with_unit(rated, 'N m')}", " and ".join(spans) or "no ratio"))
    match = forms.load_match
    if match is not None:
        span = "no ratio" if match.range is None else f"{number(match.range.low)} to {number(match.range.high)}"
        rows += [
            ("accelerating factor α", f"{number(match.accelerating_factor)} W/s"),
            ("load factor β/η", f"{number(match.load_factor)} W/s"),
            ("range by α and β", span),
            ("best ratio by α and β", number(match.best)),
        ]
    return rows


def _small_percent(share: float) -> str:
    """A share that is small as a rule."""
    return f"{number(100.0 * share, 2)}\u00a0%" if share >= 1e-4 else "below 0.01\u00a0%"


def _gear(gear: NearGear) -> _GearRow:
    return _GearRow(
        gear.key, number(gear.ratio), str(gear.verdict), CSS[gear.verdict], percent(gear.utilisation), gear.binding
    )
