"""Charts of answers: fronts, curves of the optimum, gear ratios, sweeps."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.report.charts.chart import BLUE, GREEN, INSTANTS, JOINT_COLOURS, ORANGE, SKY, VERMILLION, Chart, Mark
from drivetrain.report.quantities import convert, number, percent, printed_unit, shown_unit
from drivetrain.sizing.answers.curve import CurvePiece, OptimumCurve
from drivetrain.sizing.answers.free_ratio import FreeJoint, FreeRatios
from drivetrain.sizing.answers.ratio import RatioPoint, RatioStudy
from drivetrain.sizing.judge.vary import Vary
from drivetrain.sizing.results import DriveSet
from drivetrain.sizing.search.pareto.front import Front
from drivetrain.study.model import pair_name
from drivetrain.study.parts.verdicts import Verdict

OBJECTIVES = {"mass": "mass of all drives [kg]", "price": "price of all drives", "energy": "energy a cycle [J]"}
AXES = OBJECTIVES | {"utilisation": "highest utilisation [%]"}
SHORT_AXES = {"energy": "energy [J]", "mass": "mass [kg]", "utilisation": "utilisation [%]"}
NAMES = {
    Vary.PAYLOAD: "payload", Vary.CYCLE_TIME: "length of the cycle", Vary.VOLTAGE: "supply voltage",
    Vary.AMBIENT: "air temperature", Vary.FORCE: "force at the tip",
}  # fmt: skip
VERDICT_COLOURS = {
    Verdict.PASS: GREEN, Verdict.MARGINAL: ORANGE, Verdict.FAIL: VERMILLION, Verdict.NOT_CHECKED: "muted",
}  # fmt: skip
NEAR_LIMIT = 90.0  # [%] a limit is drawn if a curve reaches this share of it
BESIDE = 2.5  # factor by which the chart of a ratio extends beyond its marks
MOST_CHECKS = 7
MOST_LINES = 10  # largest number of lines of a sweep, for legibility
SCALE = "scale."  # prefix of names that are varied by a factor
_NUMBER = re.compile(r"\s*([-+]?\d+\.?\d*(?:[eE][-+]?\d+)?)\s*(.*)$")


def drives_text(drives: dict[str, tuple[str, str]]) -> str:
    return "\n".join(f"{joint}: {pair_name(*pair)}" for joint, pair in drives.items())


def front_charts(found: Front, chosen: DriveSet | None = None) -> tuple[Chart, ...]:
    """A chart for every two criteria; a point shows its drives, the chosen set is marked."""
    names = found.names if len(found.names) > 1 else ("energy" if found.names[0] == "mass" else "mass", found.names[0])
    third = next((name for name in ("utilisation", "energy", "mass") if name not in names[:2]), "")
    shades = _criterion(found.points, third)
    span = float(np.ptp(shades)) or 1.0
    colours = [INSTANTS[round(23 * (value - float(shades.min())) / span)] for value in shades]
    tips = [
        f"set {index}: " + ", ".join(f"{SHORT_AXES.get(one, one)} {number(value, 4)}" for one, value in _shown(point))
        + f"\n{drives_text(point.drives)}"
        for index, point in enumerate(found.points, 1)
    ]  # fmt: skip
    bend, charts = knee(found), []
    for x, y in itertools.combinations(names, 2):
        across, up = _criterion(found.points, x), _criterion(found.points, y)
        order = np.argsort(across, kind="stable")
        marks = [Mark("step", across[order], up[order], colour="muted", size=0.8)] if len(names) == 2 else []
        label = f"{AXES[third]}: dark low, light high" if third else ""
        marks.append(Mark("points", across, up, size=9 if len(across) < 100 else 5, colours=colours, tips=tips,
                          label=label))  # fmt: skip
        if bend is not None:
            marks.append(Mark("points", across[[bend]], up[[bend]], size=18, alpha=0.0, colour="ink", label="knee"))
        if chosen is not None:
            own = {"x": _criterion([chosen], x), "y": _criterion([chosen], y)}
            marks.append(Mark("points", own["x"], own["y"], size=16, marker="star", colour="ink", label="chosen",
                              tips=[f"chosen\n{drives_text(chosen.drives)}"]))  # fmt: skip
        for name, values in ((x, across), (y, up)):
            if name == "utilisation" and len(values) and values.max() > NEAR_LIMIT:
                along, above = ([100.0], []) if name == x else ([], [100.0])
                marks.append(Mark("rule", along, above, colour=VERMILLION, dash=True))
        charts.append(Chart(f"sets of drives over {AXES[x]} and {AXES[y]}", AXES[x], AXES[y], marks, height=360))
    return tuple(charts)


def _criterion(points: Sequence[DriveSet], name: str) -> Array:
    scale = 100.0 if name == "utilisation" else 1.0
    return np.array([scale * point.criteria.get(name, math.nan) for point in points])


def _shown(point: DriveSet) -> list[tuple[str, float]]:
    known = [name for name in AXES if not math.isnan(point.criteria.get(name, math.nan))]
    return [(name, float(_criterion([point], name)[0])) for name in known]


def knee(found: Front) -> int | None:
    """Index of the set nearest to the best of all criteria, each scaled to its span; None for too few sets."""
    if len(found.points) < 3 or len(found.names) < 2:
        return None
    values = np.stack([_criterion(found.points, name) for name in found.names], axis=1)
    span = np.maximum(np.ptp(values, axis=0), 1e-12)
    return int(np.argmin((((values - values.min(axis=0)) / span) ** 2).sum(axis=1)))


def curve_charts(found: OptimumCurve) -> tuple[Chart, ...]:
    """Objective, energy per cycle and highest utilisation of the best set over the varied quantity."""
    objective = OBJECTIVES.get(found.study.objective, "objective")
    reserve = 100.0 * (1.0 - found.study.safety.reserve)
    limits = [
        Mark("rule", y=[100.0], colour=VERMILLION, dash=True),
        Mark("rule", y=[reserve], colour=ORANGE, dash=True),
    ]
    return (
        _curve(found, objective, lambda values: values["objective"], 300, _end_marks(found)),
        _curve(found, "energy a cycle [J]", lambda values: values["energy"], 200),
        _curve(found, "highest utilisation [%]", lambda values: 100.0 * values["utilisation"], 200, limits),
    )


def _curve(
    found: OptimumCurve, label: str, of: Callable[[dict[str, float]], float], height: int, beside: Sequence[Mark] = ()
) -> Chart:
    """One line per piece, in the colour of its set; red if no set fits."""
    marks = [
        Mark("span", x=[piece.low], to=[piece.high], colour=VERMILLION, alpha=0.1)
        for piece in found.pieces if not piece.drives
    ]  # fmt: skip
    low, high = found.pieces[0].low, found.pieces[-1].high
    if low <= found.now <= high:
        marks.append(Mark("rule", x=[found.now], colour="ink", dash=True))
    for index, piece in enumerate(found.pieces, 1):
        if not piece.drives:
            continue
        x = [point.value for point in piece.points]
        y = [of({**point.criteria, "objective": point.objective}) for point in piece.points]
        text = f"piece {index}: {number(piece.low, 4)} to {number(piece.high, 4)} {printed_unit(found.unit)}"
        colour, tips = colour_of(found, piece), [f"{text}\n{drives_text(piece.drives)}"] * len(x)
        marks += [Mark("line", x, y, colour=colour, size=2.5), Mark("points", x, y, colour=colour, size=6, tips=tips)]
    what = f" {found.payload}" if found.payload else ""
    unit = f" [{printed_unit(found.unit)}]" if found.unit else ""
    over = NAMES[found.vary]
    return Chart(f"{label} of the best set of drives over the {over}", f"{over}{what}{unit}", label,
                 [*marks, *beside], x_range=(low, high), height=height, joined=f"curve-{found.vary}")  # fmt: skip


def colour_of(found: OptimumCurve, piece: CurvePiece) -> str:
    """The colour of a piece's set, the same for all pieces of the set."""
    sets = list(dict.fromkeys(tuple(one.drives.items()) for one in found.pieces if one.drives))
    return JOINT_COLOURS[sets.index(tuple(piece.drives.items())) % len(JOINT_COLOURS)]


def _end_marks(found: OptimumCurve) -> list[Mark]:
    return [
        Mark("rule", x=[before.high], colour=VERMILLION, label="no set fits")
        for before, after in itertools.pairwise(found.pieces) if bool(before.drives) != bool(after.drives)
    ]  # fmt: skip


def ratio_charts(found: RatioStudy) -> tuple[Chart, ...]:
    """Marks, torque, speed, temperature and utilisation over the gear's ratio, the feasible windows shaded."""
    low, high = _ratio_view(found)
    seen = np.flatnonzero((found.ratios >= low / 1.05) & (found.ratios <= high * 1.05))
    ratios, limits, own = found.ratios[seen], found.limits, abs(found.drive.gear.ratio)
    shade = [
        Mark("span", x=[max(one.low, low)], to=[min(one.high, high)], colour=GREEN, alpha=0.13) for one in found.windows
    ]  # fmt: skip
    shade.append(Mark("rule", x=[own], colour="muted", dash=True))

    def chart(label: str, marks: list[Mark], height: int, y_range: Sequence[float] = (), log: bool = True) -> Chart:
        return Chart(f"{found.joint}: {label} over the gear ratio", "gear ratio [-]", label, [*shade, *marks],
                     x_range=(low, high), y_range=y_range, log_x=True, log_y=log, height=height,
                     joined=f"ratio-{found.joint}")  # fmt: skip

    def limit(value: float | None, label: str, unit: str, shown: str, colour: str = VERMILLION) -> list[Mark]:
        at = [] if value is None else [float(convert(value, unit, shown))]
        return [Mark("rule", y=at, label=label, colour=colour, dash=True)] if at else []

    peak, rms = found.series("peak_torque")[seen], found.series("rms_torque")[seen]
    unit = shown_unit(max([float(np.median(peak)), limits.continuous_torque or 0.0, limits.peak_torque or 0.0]), "N m")
    torque = [
        Mark("line", ratios, convert(peak, "N m", unit), label="peak", colour="ink"),
        Mark("line", ratios, convert(rms, "N m", unit), label="RMS", colour=BLUE),
        *limit(limits.peak_torque, "peak limit", "N m", unit),
        *limit(limits.continuous_torque, "continuous limit", "N m", unit, BLUE),
    ]  # fmt: skip
    speed = [
        Mark("line", ratios, convert(found.series("motor_speed")[seen], "rad/s", "rpm"), colour="ink"),
        *limit(limits.motor_speed, "slower limit of motor and gear", "rad/s", "rpm"),
    ]
    charts = [
        _ladder(found, low, high, shade),
        chart(f"motor torque [{printed_unit(unit)}]", torque, 260),
        chart("motor speed [rpm]", speed, 190),
    ]
    warm = found.series("winding_temperature")[seen]
    if np.isfinite(warm).any():
        ambient, most = found.study.ambient, limits.winding_temperature
        top = 3.0 * float(np.nanmedian(warm)) if most is None or most <= ambient else ambient + 2.0 * (most - ambient)
        heat = [Mark("line", ratios, np.where(np.isfinite(warm), warm, np.nan), colour=VERMILLION)]
        heat += limit(most, "winding limit", "C", "C", "ink")
        charts.append(chart("winding [°C]", heat, 190, (ambient - 0.05 * (top - ambient), top), log=False))
    points = [found.points[i] for i in seen]
    used = _undecided_spans(points)
    for i, check in enumerate(_leading(found, seen)):
        shares = [math.nan if check in one.undecided else one.utilisations.get(check, math.nan) for one in points]
        used.append(Mark("line", ratios, 100.0 * np.clip(shares, 1e-9, 1e9), label=check,
                         colour=JOINT_COLOURS[i % len(JOINT_COLOURS)]))  # fmt: skip
    worst = [math.nan if one.binding in one.undecided else one.utilisation for one in points]
    used.append(
        Mark("line", ratios, 100.0 * np.clip(worst, 1e-9, 1e9), label="the highest", colour="ink", size=4, alpha=0.3)
    )
    used.append(Mark("rule", y=[100.0], colour=VERMILLION, dash=True))
    charts.append(chart("utilisation [%]", used, 280, (100.0 * min(0.05, 0.5 * found.best.utilisation), 500.0)))
    return tuple(charts)


def _undecided_spans(points: Sequence[RatioPoint]) -> list[Mark]:
    """Grey around the ratios at which a check is not decided for lack of data."""
    ratios = np.array([one.ratio for one in points])
    ends = [ratios[0], *np.sqrt(ratios[:-1] * ratios[1:]), ratios[-1]]  # halfway to the next ratio on both sides
    change = np.diff([0, *(bool(one.undecided) for one in points), 0])
    return [
        Mark("span", x=[ends[first]], to=[ends[after]], colour="muted", alpha=0.2)
        for first, after in zip(np.flatnonzero(change > 0), np.flatnonzero(change < 0), strict=True)
    ]


def _ratio_view(found: RatioStudy) -> tuple[float, float]:
    """The range of ratios shown: around windows, marks and the gear's own ratio, within the computed range."""
    ends = [end for window in found.windows for end in (window.low, window.high)]
    inner = [abs(found.drive.gear.ratio), found.best.ratio, *(e for e in ends if 0.0 < e < math.inf)]
    low, high = min(inner) / BESIDE, max(inner) * BESIDE
    least = found.closed_forms.least_rms
    if low / 4.0 < least < high * 4.0:
        low, high = min(low, least / BESIDE), max(high, least * BESIDE)
    return max(low, float(found.ratios[0])), min(high, float(found.ratios[-1]))


def _ladder(found: RatioStudy, low: float, high: float, shade: list[Mark]) -> Chart:
    """Ranges as bars, ratios as points, gears of the catalogue coloured by their verdict."""
    forms, match = found.closed_forms, found.closed_forms.load_match
    ranges = [("all checks satisfied", [(w.low, w.high) for w in found.windows], GREEN)]
    if forms.rated is not None:
        ranges.append(("RMS torque within rated", [(r.low, r.high) for r in forms.rated], BLUE))
    if match is not None:
        ranges.append(("the same by α and β", [] if match.range is None else [match.range], SKY))
    points = [("the gear's own ratio", abs(found.drive.gear.ratio)), ("least utilisation", found.best.ratio),
              ("least RMS torque", forms.least_rms), ("least peak torque", forms.least_peak),
              ("matched inertia √(I/J)", forms.matching)]  # fmt: skip
    known = [(label, ratio) for label, ratio in points if ratio is not None and not math.isnan(ratio)]
    rows = [label for label, _, _ in ranges] + [
        f"{label} ({number(ratio)})" if low <= ratio <= high else f"{label} ({number(ratio)}, beyond)"
        for label, ratio in known
    ]  # fmt: skip
    marks = [
        Mark("bars", [max(start, low)], [row], to=[min(end, high)], colour=colour, size=0.35)
        for row, (_, spans, colour) in enumerate(ranges) for start, end in spans
    ]  # fmt: skip
    seen = [(ratio, len(ranges) + i) for i, (_, ratio) in enumerate(known) if low <= ratio <= high]
    marks.append(Mark("points", [x for x, _ in seen], [y for _, y in seen], colour="ink", size=9, marker="diamond"))
    if found.gears:
        rows.append("gears for this motor")
        tips = [f"{one.key}: {one.verdict}, {percent(one.utilisation)} of {one.binding}" for one in found.gears]
        marks.append(Mark("points", [abs(one.ratio) for one in found.gears], [len(rows) - 1] * len(found.gears), size=9,
                          colours=[VERDICT_COLOURS[one.verdict] for one in found.gears], tips=tips))  # fmt: skip
    return Chart(f"{found.joint}: what formulas and the catalogue say of the ratio", "gear ratio [-]", "",
                 [*shade, *marks], x_range=(low, high), log_x=True, rows=rows, height=80 + 24 * len(rows),
                 joined=f"ratio-{found.joint}")  # fmt: skip


def _leading(found: RatioStudy, seen: NDArray[np.intp]) -> list[str]:
    """The checks with the highest utilisation anywhere in the range shown."""
    highest = {}
    for check in found.points[0].utilisations:
        used = found.utilisation_of(check)[seen]
        if not np.isnan(used).all():
            leads = sum(found.points[i].binding == check for i in seen)
            highest[check] = (leads, float(np.nanmin(used)))
    return sorted(highest, key=lambda check: (-highest[check][0], -highest[check][1], check))[:MOST_CHECKS]


def free_ratio_charts(found: FreeRatios) -> tuple[Chart, ...]:
    """The goal of the whole arm over each joint's ratio, with the best ratio and the catalogue's gears."""
    return tuple(_free_joint(found, joint) for joint in found.joints)


def _free_joint(found: FreeRatios, joint: FreeJoint) -> Chart:
    goal = np.where(np.isfinite(joint.goal), joint.goal, np.nan)
    gears = [(gear, found.value * (1.0 + gear.excess)) for gear in joint.gears if math.isfinite(gear.excess)]
    top = min(float(np.nanmax(goal)), 3.0 * found.value)
    top = max([top, found.value, *(min(height, 3.0 * found.value) for _, height in gears)])
    span = max(top - found.value, 1e-3 * abs(found.value))
    gears = [(gear, height) for gear, height in gears if height <= top]
    marks = [
        Mark("span", x=[joint.low], to=[joint.high], colour=GREEN, alpha=0.1),
        Mark("line", joint.ratios, goal, label="continuous ratio"),
        Mark("points", [joint.best], [found.value], label=f"best for the arm: {number(joint.best)}", colour="ink",
             size=11, marker="diamond"),
        Mark("points", [abs(gear.ratio) for gear, _ in gears], [height for _, height in gears], size=8,
             label="gears of the catalogue", colours=[VERDICT_COLOURS[gear.verdict] for gear, _ in gears],
             tips=[f"{gear.key}: {gear.verdict}" for gear, _ in gears]),
    ]  # fmt: skip
    if joint.family.low < joint.least_rms < joint.family.high:
        marks.append(Mark("rule", x=[joint.least_rms], label="by formula, its motor only", colour="muted", dash=True))
    unit = f" [{printed_unit(found.goal.unit)}]" if printed_unit(found.goal.unit) else ""
    return Chart(f"{joint.joint}: {found.goal} of the arm over its ratio", "gear ratio [-]",
                 f"{found.goal} of the arm{unit}", marks, x_range=(joint.family.low / 1.06, joint.family.high * 1.06),
                 y_range=(found.value - 0.28 * span, top + 0.08 * span), log_x=True, height=280,
                 title=joint.joint)  # fmt: skip


def sweep_chart(results: pd.DataFrame, names: Sequence[str], label: str) -> Chart | None:
    """The objective at every point, one line per combination of the other values; None without an axis to draw over."""
    along = along_axis(results, names)
    if not along or not results["feasible"].any():
        return None
    numbers, unit = _numbers(results[along])
    others = [one for one in names if one != along]
    marks = []
    for count, (key, rows) in enumerate(results.groupby(others, sort=False) if others else [((), results)]):
        if count == MOST_LINES:
            break
        order = numbers.loc[rows.index].sort_values().index
        fits = rows.loc[order, "feasible"].to_numpy()
        x, colour = numbers.loc[order].to_numpy(), JOINT_COLOURS[count % len(JOINT_COLOURS)]
        y = np.where(fits, rows.loc[order, "objective"], np.nan)
        title = _title(others, key)
        marks += [Mark("line", x, y, label=title, colour=colour), Mark("points", x, y, colour=colour, size=6)]
        foot = np.full(int((~fits).sum()), 0.03 * (1 + count) * float(np.nanmax(results["objective"])))
        marks.append(Mark("points", x[~fits], foot, colour=colour, size=9, marker="x",
                          tips=[f"{title or 'here'}: no set fits"] * len(foot)))  # fmt: skip
    over = f"{varied_name(along)} [-]" if along.startswith(SCALE) else f"{_short(along)} [{unit or '-'}]"
    most = 1.06 * float(results.loc[results["feasible"], "objective"].max())
    return Chart(f"{label} of every point of the sweep", over, label, marks, y_range=(0.0, most), height=360)


def varied_name(name: str) -> str:
    """Heading of a varied quantity: its place in the study, or what a factor multiplies."""
    return f"{_short(name)} over the study's" if name.startswith(SCALE) else name


def along_axis(results: pd.DataFrame, names: Sequence[str]) -> str:
    """Name of the varied quantity along the horizontal axis."""
    fitting = {one: results[one].nunique() for one in names if not _numbers(results[one])[0].isna().any()}
    return max(fitting, key=lambda one: fitting[one], default="")


def _title(names: Sequence[str], key: object) -> str:
    values = key if isinstance(key, tuple) else (key,)
    pairs = zip(names, values, strict=True)
    return ", ".join(f"{_short(one)} {'× ' if one.startswith(SCALE) else ''}{value}" for one, value in pairs)


def _short(name: str) -> str:
    return name.removeprefix(SCALE).split(".")[-1].replace("_", " ")


def _numbers(texts: pd.Series[str]) -> tuple[pd.Series[float], str]:
    """Values as numbers with their common unit; all NaN if they are not numbers of one unit."""
    found = [_NUMBER.match(text) for text in texts]
    units = {match[2].strip() for match in found if match}
    if len(units) != 1 or not all(found):
        return pd.Series(np.nan, index=texts.index), ""
    return pd.Series([float(match[1]) for match in found if match], index=texts.index), units.pop()
