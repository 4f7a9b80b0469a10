"""Candidates of every joint: mass against the worst utilisation, and which check felled them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.report.colours import BLUE, GREEN, INK, ORANGE, PURPLE, SKY, VERMILLION
from drivetrain.report.fallen_columns import counted, fallen_columns
from drivetrain.report.panel import Panel, panel
from drivetrain.report.picture import Font, Key, Pen, Picture, legend_height
from drivetrain.sizing.judge.objectives import criteria, weighted
from drivetrain.sizing.results import Selection

CHECK_COLOURS = (VERMILLION, BLUE, ORANGE, PURPLE, SKY, "#7f6a3f")
OTHER = "#9aa5b1"
LARGEST_DRAWN = 10.0  # times the limit; candidates beyond stand at the upper edge
WIDTH, HEIGHT, LEFT, GAP = 662.0, 132.0, 46.0, 16.0  # [points] of the picture, a panel, before the first, between
UNDER = 40.0  # [points] from one row of panels to the next
_SHARES = {
    "mass": "mass of motor and gear [kg]",
    "price": "price of motor and gear",
    "energy": "energy a cycle [J]",
    "weighted": "share of the weighted objective",
}
_STAR = Key("", "star", Pen("#fff", 0.6), INK)
_ALSO = Key("also passes", "triangle", Pen(GREEN, 1.0), "#fff")


@dataclass(frozen=True, eq=False)
class _Fell:
    """The candidates of one joint that fell and whose share of the objective is known; checks by number."""

    count: int
    share: Array
    used: Array
    check: NDArray[np.int8]
    checks: tuple[str, ...]


def candidates(selection: Selection, *, name: str = "candidates", fallen: pd.DataFrame | None = None) -> str:
    """One small picture a joint: every candidate that fell, by its share of the objective and its worst utilisation."""
    table = fallen_columns(selection) if fallen is None else fallen
    by_joint = _by_joint(table)
    nothing = _Fell(0, np.zeros(0), np.zeros(0), np.zeros(0, dtype=np.int8), ())
    joints = [j for j in selection.evaluation.joints if j in by_joint or selection.alternatives.get(j)]
    if not joints:
        return ""
    colours = _colours(counted(table))
    columns = min(3, len(joints))
    across = (WIDTH - 4.0 - LEFT - (columns - 1) * GAP) / columns
    keys = _keys(colours, "chosen" if selection.drives else "nearest")
    first = legend_height(keys, WIDTH, 5) + 22.0
    picture = Picture(name, WIDTH, first + -(-len(joints) // columns) * (HEIGHT + UNDER) - 4.0)
    used = table["utilisation"].to_numpy(dtype=float)
    largest = float(used.max(initial=1.0)) if len(used) else 1.0
    top = 100.0 * min(max(2.0, 1.3 * largest), 1.15 * LARGEST_DRAWN)
    for number, joint in enumerate(joints):
        left = LEFT + number % columns * (across + GAP)
        high = first + number // columns * (HEIGHT + UNDER)
        fell, place = by_joint.get(joint, nothing), (left, left + across, high)
        axes = _joint(picture, place, joint, fell, selection, colours, top)
        axes.edges()
        axes.x_axis(objective_label(selection.study.objective) if number + columns >= len(joints) else "")
        if number % columns == 0:
            axes.y_axis("worst utilisation [%]")
    picture.legend(keys, 8.0, across=(0.0, WIDTH), columns=5)
    return picture.svg("candidates by their share of the objective and their worst utilisation")


def objective_label(objective: str) -> str:
    """The axis of an objective."""
    return _SHARES[objective]


def _by_joint(table: pd.DataFrame) -> dict[str, _Fell]:
    """The columns that are drawn, by joint."""
    share, used = (table[column].to_numpy(dtype=float) for column in ("objective", "utilisation"))
    used, known = np.minimum(used, LARGEST_DRAWN), np.isfinite(share)
    checks, joints = tuple(map(str, table["check"].cat.categories)), table["joint"].cat.codes.to_numpy()
    check = table["check"].cat.codes.to_numpy().astype(np.int8)
    found = {}
    for number, joint in enumerate(table["joint"].cat.categories):
        own = joints == number
        if own.any():
            drawn = own & known
            found[str(joint)] = _Fell(int(own.sum()), share[drawn], used[drawn], check[drawn], checks)
    return found


def _colours(counts: Mapping[tuple[str, str], int]) -> dict[str, str]:
    """A colour for each of the checks that felled most; the rest share grey."""
    totals: dict[str, int] = {}
    for (_, check), count in counts.items():
        totals[check] = totals.get(check, 0) + count
    common = sorted(totals, key=lambda check: (-totals[check], check))[: len(CHECK_COLOURS)]
    return dict(zip(common, CHECK_COLOURS, strict=False))


def _joint(
    picture: Picture, place: tuple[float, float, float], joint: str, fell: _Fell, selection: Selection,
    colours: Mapping[str, str], top: float,
) -> Panel:  # fmt: skip
    """The candidates of one joint."""
    left, right, high = place
    others = [share for _, _, share in selection.alternatives.get(joint, ()) if np.isfinite(share)]
    chosen = _share(selection, joint)
    low, most, wide = _ends(np.array([*fell.share, *others, *([] if chosen is None else [chosen])]))
    axes = panel(picture, (left, right), (high, high + HEIGHT), (low, most), (18.0, top), logarithmic=(wide, True))
    axes.grid()
    axes.block(None, (18.0, 100.0), GREEN, 0.07)
    axes.level(100.0, Pen(VERMILLION, 1.0))
    names = {fell.checks[number]: number for number in np.unique(fell.check).tolist()}
    for check in sorted(names, key=lambda check: (check in colours, check)):
        group = fell.check == names[check]
        axes.dots(fell.share[group], 100.0 * fell.used[group], Pen(colours.get(check, OTHER), 2.8, opacity=0.75))
    for share in others:
        axes.mark("triangle", share, 80.0, 6.0, _ALSO)
    result = selection.evaluation.joints.get(joint)
    if result is not None and result.binding is not None and result.binding.utilisation is not None and chosen:
        used = min(max(result.binding.utilisation, 0.21), LARGEST_DRAWN)
        axes.mark("star", chosen, 100.0 * used, 11.0, _STAR)
    picture.words(left, high - 5.0, f"{joint}: {fell.count} rejected", Font(9.5, bold=True))
    return axes


def _ends(shares: Array) -> tuple[float, float, bool]:
    """Ends of the axis of the shares, and whether it is logarithmic."""
    known = shares[np.isfinite(shares)]
    if not len(known):
        return 0.0, 1.0, False
    low, most = float(known.min()), float(known.max())
    if low > 0.0 and most > 3.0 * low:
        return low / (most / low) ** 0.04, most * (most / low) ** 0.04, True
    room = 0.04 * (most - low) or 0.05 * abs(most) or 1.0
    return low - room, most + room, False


def _share(selection: Selection, joint: str) -> float | None:
    """The chosen drive's own share of the objective, where known."""
    result = selection.evaluation.joints.get(joint)
    if result is None:
        return None
    study = selection.study
    share = weighted(study.wanted, criteria(study, {joint: result}, ()))
    return share if np.isfinite(share) else None


def _keys(colours: Mapping[str, str], star: str) -> list[Key]:
    """What the colours and marks mean."""
    keys = [replace(_STAR, text=star), _ALSO]
    keys += [Key(check, "dot", Pen("none"), colour) for check, colour in colours.items()]
    return [*keys, Key("other checks", "dot", Pen("none"), OTHER)] if colours else keys
