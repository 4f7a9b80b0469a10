"""Every judged check of every joint on one axis, the tightest first."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from drivetrain.report.quantities import percent
from drivetrain.report.svg import FAINT, GREEN, INK, JOINT_COLOURS, MUTED, ORANGE, VERMILLION, house_style, svg_text
from drivetrain.sizing.results import Check, Evaluation

LARGEST_DRAWN = 2.0  # utilisations above this are told at the edge
ROOM_BEYOND = 0.75

Used = list[tuple[int, float]]  # joint number (0: the supply) and utilisation


def margin_bars(evaluation: Evaluation, *, reserve: float, name: str = "margins") -> str:
    """Every judged check of every joint on one axis, the tightest first.

    Args:
        evaluation: What was found.
        reserve: Wanted below the limit, as a share.
        name: Of the figure on the page.

    Returns:
        An SVG element.
    """
    groups = _by_check(evaluation)
    order = sorted(groups, key=lambda check: (-max(share for _, share in groups[check]), check))
    with house_style(name):
        figure = Figure(figsize=(9.2, 0.95 + 0.3 * max(len(order), 1)))
        axes = figure.subplots()
        axes.axvspan(0, 1 - reserve, color=GREEN, alpha=0.07, linewidth=0)
        axes.axvspan(1 - reserve, 1, color=ORANGE, alpha=0.14, linewidth=0)
        axes.axvspan(1, LARGEST_DRAWN + ROOM_BEYOND, color=VERMILLION, alpha=0.10, linewidth=0)
        axes.axvline(1.0, color=VERMILLION, linewidth=1.2)
        largest = 0.0
        for row, check in enumerate(order):
            top = min(max(share for _, share in groups[check]), LARGEST_DRAWN)
            largest = max(largest, top)
            axes.barh(row, top, height=0.34, color=FAINT, linewidth=0, zorder=2)
            _dots(axes, row, groups[check])
        axes.set_ylim(len(order) - 0.4, -0.6)
        over = any(not share <= LARGEST_DRAWN for used in groups.values() for _, share in used)
        axes.set_xlim(-0.015, LARGEST_DRAWN + ROOM_BEYOND if over else max(1.12, 1.06 * largest))
        axes.set_yticks(range(len(order)), order)
        axes.tick_params(axis="y", length=0)
        axes.grid(axis="y", visible=False)
        axes.xaxis.set_major_locator(MultipleLocator(0.2))
        axes.xaxis.set_major_formatter(lambda value, _: f"{100 * value:.0f}" if value <= LARGEST_DRAWN else "")
        axes.set_xlabel("utilisation [% of the limit]")
        _joint_legend(figure, axes, evaluation)
        return svg_text(figure, "utilisation of every check of every joint, the tightest first")


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


def _dots(axes: Axes, row: int, used: Used) -> None:
    """A numbered dot a joint; those beyond the scale side by side to its right, with their numbers."""
    inside = sorted((pair for pair in used if pair[1] <= LARGEST_DRAWN), key=lambda pair: (pair[1], pair[0]))
    beyond = sorted((pair for pair in used if not pair[1] <= LARGEST_DRAWN), key=lambda pair: (-pair[1], pair[0]))
    for number, share in inside:
        _dot(axes, row, number, share)
    for place, (number, _) in enumerate(beyond):
        _dot(axes, row, number, LARGEST_DRAWN + 0.08 + 0.06 * place)
    if beyond:
        text = ", ".join(percent(share) for _, share in beyond)
        end = LARGEST_DRAWN + 0.08 + 0.06 * (len(beyond) - 1)
        axes.annotate(
            text, (end, row), xytext=(8, 0), textcoords="offset points", va="center_baseline", fontsize=6.5, color=INK
        )


def _dot(axes: Axes, row: int, number: int, at: float) -> None:
    """One numbered dot."""
    axes.plot(
        at, row, "o", markersize=9.5, color=_colour(number), markeredgecolor="white", markeredgewidth=0.8, zorder=3
    )
    axes.annotate(
        str(number or "S"), (at, row), ha="center", va="center_baseline", fontsize=6.5, color="white", weight="bold",
        zorder=4,
    )  # fmt: skip


def _joint_legend(figure: Figure, axes: Axes, evaluation: Evaluation) -> None:
    """Which number is which joint."""
    marks = [
        axes.plot([], [], "o", color=_colour(i + 1), label=f"{i + 1}  {name}", markersize=7)[0]
        for i, name in enumerate(evaluation.joints)
    ]
    if evaluation.shared:
        marks.append(axes.plot([], [], "o", color=MUTED, label="S  supply", markersize=7)[0])
    figure.legend(handles=marks, loc="outside upper center", ncols=min(len(marks), 7), handletextpad=0.2)
