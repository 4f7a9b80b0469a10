"""One joint's gear ratio: what formulas and the catalogue say of it; torque, speed, heat and every check over it."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter
from matplotlib.transforms import Bbox

from drivetrain.arrays import Array
from drivetrain.report.colours import BLUE, FAINT, GREEN, INK, JOINT_COLOURS, MUTED, ORANGE, SKY, VERMILLION
from drivetrain.report.quantities import convert, number, printed_unit, shown_unit
from drivetrain.report.svg import house_style
from drivetrain.sizing.answers.ratio import RatioStudy
from drivetrain.study.verdicts import Verdict

BESIDE = 2.5  # times beyond the marks that the picture goes on
VERDICT_COLOURS = {
    Verdict.PASS: GREEN, Verdict.MARGINAL: ORANGE, Verdict.FAIL: VERMILLION, Verdict.NOT_CHECKED: MUTED,
}  # fmt: skip
LOWEST_SHARE, HIGHEST_SHARE = 0.05, 5.0  # utilisations drawn
MOST_CHECKS = 7
ROOM_FOR_A_NAME = 0.26  # of the axis


def figure_ratio(found: RatioStudy, *, name: str = "ratio") -> Figure:
    """Marks, torque, speed, temperature and utilisation over the ratio, the feasible window shaded."""
    with house_style(name):
        figure = Figure(figsize=(7.6, 10.4))
        rows = list(figure.subplots(5, 1, sharex=True, height_ratios=[1.25, 1.2, 0.8, 0.8, 1.5]))
        low, high = _view(found)
        rows[0].set_xscale("log")
        rows[0].set_xlim(low, high)
        for axes in rows:
            for window in found.windows:
                ends = max(window.low, low), min(window.high, high)
                axes.axvspan(*ends, color=GREEN, alpha=0.13, linewidth=0, zorder=0)
            axes.axvline(abs(found.drive.gear.ratio), color=MUTED, linewidth=0.9, linestyle=(0, (1, 1.5)), zorder=2)
        _marks(rows[0], found)
        _torque(rows[1], found)
        _speed(rows[2], found)
        _temperature(rows[3], found)
        _utilisations(rows[4], found)
        gear = found.gear or "an ideal gear"
        figure.suptitle(f"{found.joint}: {found.motor} with {gear}, its ratio varied", fontsize=9.5)
        figure.align_ylabels(rows[1:])
        rows[-1].set_xlabel("gear ratio [-]")
        rows[-1].xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        rows[-1].xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        rows[-1].xaxis.set_minor_formatter(NullFormatter())
        _settle(figure)
    return figure


def _settle(figure: Figure) -> None:
    """Take the layout's rounding out of the picture: it differs from run to run in the last digits."""
    # Letters are a little wider at other resolutions than the one laid out here.
    figure.set_layout_engine("constrained", rect=(0.01, 0.0, 0.97, 1.0))
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    for axes in figure.axes:
        axes.set_position(Bbox(np.round(axes.get_position().get_points(), 4)))


def _view(found: RatioStudy) -> tuple[float, float]:
    """The range of ratios shown: around windows, marks and the sheet's ratio, within what was swept."""
    ends = [end for window in found.windows for end in (window.low, window.high)]
    inner = [abs(found.drive.gear.ratio), found.best.ratio, *(e for e in ends if 0.0 < e < math.inf)]
    low, high = min(inner) / BESIDE, max(inner) * BESIDE
    least = found.closed_forms.least_rms
    if low / 4.0 < least < high * 4.0:
        low, high = min(low, least / BESIDE), max(high, least * BESIDE)
    return max(low, float(found.ratios[0])), min(high, float(found.ratios[-1]))


def _marks(axes: Axes, found: RatioStudy) -> None:
    """A ladder: ranges as bars, ratios as points, gears of the catalogue coloured by their verdict."""
    forms = found.closed_forms
    match = forms.load_match
    ranges: list[tuple[str, list[tuple[float, float]], str]] = [
        ("every check holds", [(w.low, w.high) for w in found.windows], GREEN)
    ]
    if forms.rated is not None:
        ranges.append(("RMS torque within rated", [(r.low, r.high) for r in forms.rated], BLUE))
    if match is not None:
        ranges.append(("the same by α and β", [] if match.range is None else [match.range], SKY))
    points = [("the gear's own ratio", abs(found.drive.gear.ratio)), ("least utilisation", found.best.ratio),
              ("least RMS torque", forms.least_rms), ("least peak torque", forms.least_peak),
              ("matched inertia √(I/J)", forms.matching)]  # fmt: skip
    low, high = axes.get_xlim()
    labels: list[str] = []
    for label, bars, colour in ranges:
        for start, end in bars:
            ends = max(start, low), min(end, high)
            axes.plot(ends, [len(labels)] * 2, color=colour, linewidth=4, solid_capstyle="butt")
        labels.append(label)
    for label, ratio in points:
        if ratio is not None and not math.isnan(ratio):
            _point(axes, ratio, len(labels))
            labels.append(label)
    # Where several have one ratio the best verdict is on top.
    for gear in sorted(found.gears, key=lambda gear: -list(VERDICT_COLOURS).index(gear.verdict)):
        colour = VERDICT_COLOURS[gear.verdict]
        axes.plot(abs(gear.ratio), len(labels), "|", color=colour, markersize=9, markeredgewidth=2)
    if found.gears:
        labels.append("gears for this motor")
    axes.set_yticks(range(len(labels)), labels)
    axes.set_ylim(len(labels) - 0.4, -0.8)
    axes.tick_params(axis="y", length=0)
    axes.set_xlim(low, high)
    _name_ends(axes, found)


def _point(axes: Axes, ratio: float, row: int) -> None:
    """A ratio on the ladder; one out of view is told at the edge."""
    low, high = axes.get_xlim()
    if low <= ratio <= high:
        axes.plot(ratio, row, "D", color=INK, markersize=4, zorder=5)
        axes.annotate(number(ratio), (ratio, row), xytext=(6, 0), textcoords="offset points", va="center", fontsize=7)
        return
    beyond = ratio > high
    text = f"{number(ratio)} →" if beyond else f"← {number(ratio)}"
    axes.text(
        0.995 if beyond else 0.005, row, text, transform=axes.get_yaxis_transform(), va="center",
        ha="right" if beyond else "left", fontsize=7, color=MUTED,
    )  # fmt: skip


def _name_ends(axes: Axes, found: RatioStudy) -> None:
    """What fails beyond each end of the windows, beside the bar."""
    low, high = axes.get_xlim()
    for window in found.windows:
        for end, check, way in ((window.low, window.low_binding, -1), (window.high, window.high_binding, 1)):
            if not check or not low < end < high:
                continue
            room = math.log(end / low if way < 0 else high / end) / math.log(high / low)
            # Without room beyond its end the name stands over the bar.
            shift, level, side = (4 * way, 0, way) if room > ROOM_FOR_A_NAME else (-2 * way, 7, -way)
            axes.annotate(
                check, (end, 0), xytext=(shift, level), textcoords="offset points", ha="left" if side > 0 else "right",
                va="center", fontsize=7, color=VERMILLION,
            )  # fmt: skip


def _seen(axes: Axes, found: RatioStudy) -> Array:
    """Which points lie in view, one beyond either side included."""
    low, high = axes.get_xlim()
    ratios = found.ratios
    inside = np.flatnonzero((ratios >= low) & (ratios <= high))
    return np.arange(max(inside[0] - 1, 0), min(inside[-1] + 2, len(ratios)))


def _line(axes: Axes, value: float | None, label: str, colour: str = VERMILLION) -> None:
    """A limit across a panel, named at its right end."""
    if value is None:
        return
    axes.axhline(value, color=colour, linewidth=0.9, linestyle=(0, (5, 2)), zorder=2)
    axes.annotate(
        label, (1.0, value), xycoords=("axes fraction", "data"), xytext=(4, 0), textcoords="offset points",
        ha="left", va="center", fontsize=7.5, color=colour,
    )  # fmt: skip


def _torque(axes: Axes, found: RatioStudy) -> None:
    kept = _seen(axes, found)
    peak, rms, limits = found.series("peak_torque")[kept], found.series("rms_torque")[kept], found.limits
    known = [value for value in (limits.continuous_torque, limits.peak_torque) if value is not None]
    unit = shown_unit(max([float(np.median(peak)), *known]), "N m")

    axes.plot(found.ratios[kept], convert(peak, "N m", unit), color=INK, label="peak")
    axes.plot(found.ratios[kept], convert(rms, "N m", unit), color=BLUE, label="RMS")
    lines = ((limits.peak_torque, "peak limit", VERMILLION), (limits.continuous_torque, "continuous", BLUE))
    for value, label, colour in lines:
        _line(axes, None if value is None else float(convert(value, "N m", unit)), label, colour)
    axes.set_yscale("log")
    _plain_log(axes)
    axes.set_ylabel(f"motor torque [{printed_unit(unit)}]")
    axes.legend(loc="lower left", handlelength=1.3)


def _speed(axes: Axes, found: RatioStudy) -> None:
    kept = _seen(axes, found)
    axes.plot(found.ratios[kept], convert(found.series("motor_speed")[kept], "rad/s", "rpm"), color=INK)
    limit = found.limits.motor_speed
    _line(axes, None if limit is None else float(convert(limit, "rad/s", "rpm")), "slower limit of\nmotor and gear")
    axes.set_yscale("log")
    _plain_log(axes)
    axes.set_ylabel("motor speed [rpm]")


def _temperature(axes: Axes, found: RatioStudy) -> None:
    kept = _seen(axes, found)
    warm = found.series("winding_temperature")[kept]
    limit = found.limits.winding_temperature
    axes.set_ylabel("winding [°C]")
    if np.isnan(warm).all():
        axes.set_yticks([])
        text = "not computed: no thermal data in the catalogue row"
        axes.text(0.5, 0.5, text, transform=axes.transAxes, ha="center", va="center", color=MUTED)
        return
    ambient = found.study.ambient
    top = 3.0 * float(np.nanmedian(warm))
    if limit is not None and limit > ambient:
        top = ambient + 2.0 * (limit - ambient)
    axes.plot(found.ratios[kept], np.where(np.isfinite(warm), warm, 1e6), color=VERMILLION)
    _line(axes, limit, "winding limit", INK)
    axes.set_ylim(ambient - 0.05 * (top - ambient), top)


def _utilisations(axes: Axes, found: RatioStudy) -> None:
    """The checks that come highest anywhere in view, and the envelope of all."""
    kept = _seen(axes, found)
    highest = {}
    for check in found.points[0].utilisations:
        used = found.utilisation_of(check)[kept]
        if not np.isnan(used).all():
            leads = sum(found.points[i].binding == check for i in kept)
            highest[check] = (leads, float(np.nanmin(used)))
    order = sorted(highest, key=lambda check: (-highest[check][0], -highest[check][1], check))[:MOST_CHECKS]
    for i, check in enumerate(order):
        used = np.clip(found.utilisation_of(check)[kept], 1e-9, 1e9)
        colour = JOINT_COLOURS[i % len(JOINT_COLOURS)]
        axes.plot(found.ratios[kept], 100 * used, color=colour, linewidth=1.1, label=check)
    worst = np.clip(found.series("utilisation")[kept], 1e-9, 1e9)
    axes.plot(found.ratios[kept], 100 * worst, color=INK, linewidth=3.4, alpha=0.25, zorder=1.5, label="the highest")
    axes.axhline(100.0, color=VERMILLION, linewidth=0.9, linestyle=(0, (5, 2)), zorder=2)
    axes.set_yscale("log")
    axes.set_ylim(100 * min(LOWEST_SHARE, 0.5 * found.best.utilisation), 100 * HIGHEST_SHARE)
    _plain_log(axes)
    axes.set_ylabel("utilisation [%]")
    axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), handlelength=1.3)


def _plain_log(axes: Axes) -> None:
    """Decades cut at 1, 2 and 5, written out."""
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.grid(which="minor", visible=False)
    axes.yaxis.grid(color=FAINT)
