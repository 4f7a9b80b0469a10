"""Charts of all joints together: utilisations, power, temperatures; and the effect of tolerances on a check."""

from __future__ import annotations

import numpy as np

from drivetrain.report.charts.chart import BLUE, GREEN, JOINT_COLOURS, ORANGE, VERMILLION, Chart, Mark
from drivetrain.report.charts.motion_data import clock, kept_samples
from drivetrain.report.quantities import convert, percent, printed_unit, scaled, with_unit
from drivetrain.sizing.results import Evaluation
from drivetrain.sizing.tolerance.tornado import Bar, Tornado

LARGEST_DRAWN = 200.0  # [%] of a limit; larger values are drawn at the edge
MOST_BARS = 12
UNITS = {"payload": "kg", "ambient": "K"}


def margin_chart(evaluation: Evaluation) -> Chart | None:
    """Utilisation of every check of every joint, the highest first; None if there is no check."""
    places = [(name, joint.checks) for name, joint in evaluation.joints.items()] + [("supply", evaluation.shared)]
    used: dict[str, list[tuple[str, float]]] = {}
    for place, checks in places:
        for check in checks:
            if check.utilisation is not None:
                used.setdefault(check.name, []).append((place, 100.0 * check.utilisation))
    if not used:
        return None
    rows = sorted(used, key=lambda name: (-max(share for _, share in used[name]), name))
    reserve = 100.0 * (1.0 - evaluation.study.safety.reserve)
    largest = max(share for shares in used.values() for _, share in shares)
    end = LARGEST_DRAWN + 10.0 if not largest <= LARGEST_DRAWN else max(112.0, 1.06 * largest)
    marks = [
        Mark("span", x=[0.0], to=[reserve], colour=GREEN, alpha=0.08),
        Mark("span", x=[reserve], to=[100.0], colour=ORANGE, alpha=0.15),
        Mark("span", x=[100.0], to=[end], colour=VERMILLION, alpha=0.12),
    ]
    for number, (place, _) in enumerate(places):
        own = [(rows.index(name), share) for name, shares in used.items() for where, share in shares if where == place]
        if own:
            colour = JOINT_COLOURS[number % len(JOINT_COLOURS)] if number < len(evaluation.joints) else "muted"
            tips = [f"{place}: {rows[row]} {percent(share / 100.0)} of the limit" for row, share in own]
            shown = [min(share, LARGEST_DRAWN) for _, share in own]
            marks.append(Mark("points", shown, [row for row, _ in own], label=place, colour=colour, size=9, tips=tips))
    marks.append(Mark("rule", x=[100.0], colour=VERMILLION))
    return Chart("utilisation of every check of every joint, the tightest first", "used [% of the limit]", "", marks,
                 x_range=(0.0, end), rows=rows, height=80 + 22 * len(rows))  # fmt: skip


def power_chart(evaluation: Evaluation) -> Chart | None:
    """Electrical power of all joints together; None if that of a joint is unknown."""
    joints, supply = list(evaluation.joints.values()), evaluation.study.supply
    total = np.sum([joint.series.electrical_power for joint in joints], axis=0) if joints else np.zeros(0)
    if not len(total) or not np.isfinite(total).all():
        return None
    kept = np.union1d(kept_samples(evaluation), [total.argmin(), total.argmax()])
    time, limit = joints[0].series.time[kept], supply.peak_power
    near = limit if limit is not None and limit < 4.0 * total.max() else None
    power, unit = scaled(total[kept], "W", near)
    marks = []
    for number, part in enumerate(evaluation.study.cycle.parts):  # no line from one part of a mix to the next
        own = (kept >= part.start) & (kept < part.stop)
        around = np.concatenate([time[own][:1], time[own], time[own][-1:]])
        for values, label, colour in (
            (np.maximum(power, 0.0), "drawn", BLUE),
            (np.minimum(power, 0.0), "regenerated", GREEN),
        ):
            area = np.concatenate([[0.0], values[own], [0.0]])
            marks.append(Mark("area", around, area, label="" if number else label, colour=colour, alpha=0.25))
        marks.append(Mark("line", time[own], power[own], colour="ink"))
    if near is not None:
        marks.append(Mark("rule", y=[float(convert(near, "W", unit))], colour=VERMILLION, dash=True,
                          label=f"peak limit {with_unit(near, 'W')}"))  # fmt: skip
    return Chart("electrical power of all joints together over time", clock(evaluation.study.cycle),
                 f"power of all joints [{printed_unit(unit)}]", marks, height=240)  # fmt: skip


def heat_chart(evaluation: Evaluation) -> Chart | None:
    """Highest winding and housing temperature of every joint in the periodic steady state; None if none is known."""
    known = [
        (row, joint.series.winding_temperature, joint.series.housing_temperature,
         joint.drive.motor.max_winding_temperature)
        for row, joint in enumerate(evaluation.joints.values()) if joint.series.winding_temperature is not None
    ]  # fmt: skip
    if not known:
        return None
    ambient = evaluation.study.ambient
    rows = [row for row, _, _, _ in known]
    hottest = [float(winding.max()) for _, winding, _, _ in known]
    housed = [(row, float(housing.max())) for row, _, housing, _ in known if housing is not None]
    limits = [(row, limit) for row, _, _, limit in known if limit is not None]
    tips = [f"winding limit {limit:.0f} °C" for _, limit in limits]
    marks = [
        Mark("bars", [ambient] * len(rows), rows, to=hottest, label="winding, at its highest", colour=ORANGE, size=0.6),
        Mark("bars", [ambient] * len(housed), [row for row, _ in housed], to=[value for _, value in housed],
             label="housing, at its highest", colour=BLUE, size=0.25),
        Mark("points", [limit for _, limit in limits], [row for row, _ in limits], label="winding limit",
             colour=VERMILLION, size=12, marker="diamond", tips=tips),
        Mark("rule", x=[ambient], colour="muted", dash=True),
        *[Mark("text", [value], [row], label=f"{value:.0f} °C", colour="ink")
          for row, value in zip(rows, hottest, strict=True)],
    ]  # fmt: skip
    names = list(evaluation.joints)
    return Chart("winding and housing temperature of every joint against the limit",
                 "temperature in the periodic steady state [°C]", "", marks, rows=names,
                 height=90 + 30 * len(names))  # fmt: skip


def tornado_chart(tornado: Tornado) -> Chart:
    """Tornado chart: utilisation of one check at both ends of each tolerance alone, the widest bar at the top."""
    bars = tornado.bars[:MOST_BARS]
    middle = min(100.0 * tornado.nominal, 1000.0)
    rows = [f"{bar.source} ±{deviation_text(bar)}" for bar in bars]
    marks = []
    for name, colour in (("low", BLUE), ("high", ORANGE)):
        ends = [min(100.0 * getattr(bar, f"at_{name}"), 1000.0) for bar in bars]
        label = f"number at its {'lower' if name == 'low' else 'upper'} end"
        start, places = [middle] * len(bars), range(len(bars))
        marks.append(Mark("bars", start, places, to=ends, label=label, colour=colour, size=0.7))
        tips = [f"{row}: {percent(getattr(bar, f'at_{name}'))}, {_share(bar)} of the variance"
                for row, bar in zip(rows, bars, strict=True)]  # fmt: skip
        marks.append(Mark("points", ends, places, colour=colour, size=6, tips=tips))
    marks += [Mark("rule", x=[middle], colour="ink"), Mark("rule", x=[100.0], colour=VERMILLION)]
    place = "" if tornado.check.startswith(tornado.joint) else f"{tornado.joint}: "  # of the supply, named twice
    return Chart(f"{tornado.joint}: what each tolerance alone does to {tornado.check}",
                 f"{place}{tornado.check}\n[% of the limit]", "", marks, rows=rows,
                 height=104 + 24 * len(rows))  # fmt: skip


def deviation_text(bar: Bar) -> str:
    """Text on the deviation of a bar's quantity from its nominal value."""
    if bar.absolute:
        return f"{bar.high:g}\u00a0{UNITS.get(bar.source.quantity, '')}".rstrip("\u00a0")
    return f"{100.0 * bar.high:g}\u00a0%"


def _share(bar: Bar) -> str:
    return "–" if np.isnan(bar.share) else f"{100.0 * bar.share:.0f}\u00a0%" if bar.share >= 0.01 else "<\u00a01\u00a0%"
