"""What `drivetrain select` tells beside the best set: its options, and the work with its progress."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from drivetrain.commands.shared import inputs, refuse, working

if TYPE_CHECKING:
    from drivetrain.report.pages.sheet import Extra
    from drivetrain.sizing.results import Evaluation, Selection


def options_beside(front: str | None, curves: list[str] | None, low: str | None, high: str | None) -> dict[str, Any]:
    """The front and the curves that the command line asks for instead of what a study says, as fields of its own."""
    from drivetrain.study.parts.selection import read_criterion, read_curve, read_span

    names = [name.strip() for name in (front or "").split(",") if name.strip()]
    texts = curves or []

    def ends() -> Any:
        """Of the one curve that has none of its own."""
        if low is None and high is None:
            return None
        hint = "with several curves write the ends into each: --curve 'payload: 0 kg..8 kg'"
        problem = "are the ends of one --curve without ends of its own"
        bare = len(texts) == 1 and ":" not in texts[0]
        refuse(not bare, "--curve-from, --curve-to", problem, hint=hint)
        missing = "--curve-to" if high is None else "--curve-from"
        refuse(low is None or high is None, missing, "is missing: a curve has two ends")
        return read_span(read_curve(texts[0], "--curve").vary, (str(low), str(high)), ("--curve-from", "--curve-to"))

    def several() -> Any:
        """The curves, each asked for once."""
        found = inputs(*(partial(read_curve, text, "--curve") for text in texts))
        asked = [one.vary for one in found]
        twice = sorted({one for one in asked if asked.count(one) > 1})
        inputs(*(partial(refuse, True, "--curve", "is asked for twice", name) for name in twice))
        return found

    _, found, span, *_ = inputs(
        lambda: refuse(front is not None and not names, "--front", "names no criterion", front, "such as mass,energy"),
        several,
        ends,
        *(partial(read_criterion, name, "--front") for name in names),
    )
    if span is not None:
        found = [replace(found[0], span=span)]
    asked: dict[str, Any] = {} if front is None else {"front": tuple(dict.fromkeys(names))}
    return asked | ({"curves": tuple(found)} if found else {})


def told_beside(result: Evaluation | Selection) -> tuple[Extra | None, list[str]]:
    """Front and curves where a selection was asked for them: parts of the report, and lines for the terminal."""
    from drivetrain.sizing.results import Selection

    asked = result.study.trade_offs
    if not asked or not isinstance(result, Selection):
        return None, []
    from drivetrain.report.pages.trade_off_pages import trade_off_extra, trade_off_lines
    from drivetrain.sizing.answers.trade_offs import trade_offs

    parts = [f"the front over {' and '.join(asked.front)}"] if asked.front else []
    parts += [f"the best drives over the {curve.vary.replace('_', ' ')}" for curve in asked.curves]
    with working("; ".join(parts)) as step:
        found = trade_offs(result.study, progress=step)
    return trade_off_extra(found, result), trade_off_lines(found)
