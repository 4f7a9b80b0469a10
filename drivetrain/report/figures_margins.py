"""Every judged check of every joint on one axis, the tightest first."""

from __future__ import annotations

from drivetrain.report.colours import FAINT, GREEN, INK, JOINT_COLOURS, MUTED, ORANGE, VERMILLION
from drivetrain.report.panel import Panel, panel
from drivetrain.report.picture import TICK, Font, Key, Pen, Picture, legend_height
from drivetrain.report.quantities import percent
from drivetrain.report.scales import text_width
from drivetrain.sizing.results import Evaluation
from drivetrain.study.verdicts import Check

LARGEST_DRAWN = 2.0  # utilisations above this are told at the edge
ROOM_BEYOND = 0.75
WIDTH, ROW = 662.0, 21.6  # [points]
NUMBER = Font(6.5, "#fff", "middle", "middle", bold=True)

Used = list[tuple[int, float]]  # joint number (0: the supply) and utilisation


def margin_bars(evaluation: Evaluation, *, reserve: float, name: str = "margins") -> str:
    """Every judged check of every joint on one axis, the tightest first."""
    groups = _by_check(evaluation)
    order = sorted(groups, key=lambda check: (-max(share for _, share in groups[check]), check))
    tops = [min(max(share for _, share in groups[check]), LARGEST_DRAWN) for check in order]
    over = any(not share <= LARGEST_DRAWN for used in groups.values() for _, share in used)
    right = LARGEST_DRAWN + ROOM_BEYOND if over else max(1.12, 1.06 * max(tops, default=0.0))
    keys = _joint_keys(evaluation)
    left = 14.0 + max((text_width(check, TICK.size) for check in order), default=0.0)
    top = 8.0 + legend_height(keys, WIDTH)
    low = top + ROW * max(len(order), 1)
    picture = Picture(name, WIDTH, low + 32.0)
    shown = (-1.5, 100.0 * right)  # per cent
    rows = panel(picture, (left, WIDTH - 4.0), (top, low), shown, (max(len(order), 1) - 0.5, -0.5))
    rows.picture.box((left, WIDTH - 4.0), (top, low), "#fff")
    rows.block((0.0, 100.0 - 100.0 * reserve), None, GREEN, 0.07)
    rows.block((100.0 - 100.0 * reserve, 100.0), None, ORANGE, 0.14)
    rows.block((100.0, shown[1]), None, VERMILLION, 0.10)
    for tick in (value for value in rows.x.ticks(60.0) if value <= 100.0 * LARGEST_DRAWN):
        rows.upright(tick, Pen(FAINT, 0.6))
    rows.upright(100.0, Pen(VERMILLION, 1.2))
    for row, check in enumerate(order):
        rows.block((0.0, 100.0 * tops[row]), (row - 0.17, row + 0.17), FAINT)
        rows.words(rows.x.low, row, check, Font(TICK.size, INK, "end", "middle"), (-6.0, 0.0))
        _dots(rows, row, groups[check])
    rows.edges()
    rows.x_axis("utilisation [% of the limit]")
    picture.legend(keys, 8.0, across=(0.0, WIDTH))
    return picture.svg("utilisation of every check of every joint, the tightest first")


def _by_check(evaluation: Evaluation) -> dict[str, Used]:
    """What every joint uses of each check, by check name."""
    groups: dict[str, Used] = {}

    def add(number: int, checks: tuple[Check, ...]) -> None:
        for check in checks:
            if check.utilisation is not None:
                groups.setdefault(check.name, []).append((number, check.utilisation))

    for i, joint in enumerate(evaluation.joints.values()):
        add(i + 1, joint.checks)
    add(0, evaluation.shared)
    return groups


def _colour(number: int) -> str:
    """Of a joint; the supply is grey."""
    return JOINT_COLOURS[(number - 1) % len(JOINT_COLOURS)] if number else MUTED


def _dots(rows: Panel, row: int, used: Used) -> None:
    """A numbered dot a joint; those beyond the scale side by side to its right, with their numbers."""
    inside = sorted((pair for pair in used if pair[1] <= LARGEST_DRAWN), key=lambda pair: (pair[1], pair[0]))
    beyond = sorted((pair for pair in used if not pair[1] <= LARGEST_DRAWN), key=lambda pair: (-pair[1], pair[0]))
    for number, share in inside:
        _dot(rows, row, number, share)
    for place, (number, _) in enumerate(beyond):
        _dot(rows, row, number, LARGEST_DRAWN + 0.08 + 0.06 * place)
    if beyond:
        text = ", ".join(percent(share) for _, share in beyond)
        end = LARGEST_DRAWN + 0.08 + 0.06 * (len(beyond) - 1)
        rows.words(100.0 * end, row, text, Font(6.5, INK, level="middle"), (8.0, 0.0))


def _dot(rows: Panel, row: int, number: int, at: float) -> None:
    """One numbered dot."""
    rows.mark("dot", 100.0 * at, row, 10.0, Key("", pen=Pen("#fff", 0.8), fill=_colour(number)))
    rows.words(100.0 * at, row, str(number or "S"), NUMBER)


def _joint_keys(evaluation: Evaluation) -> list[Key]:
    """Which number is which joint."""
    none = Pen("none")
    keys = [Key(f"{i + 1}  {name}", "dot", none, _colour(i + 1)) for i, name in enumerate(evaluation.joints)]
    return [*keys, Key("S  supply", "dot", none, MUTED)] if evaluation.shared else keys
