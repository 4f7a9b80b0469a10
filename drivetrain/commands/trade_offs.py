"""What `drivetrain select` tells beside the best set: its options, and the work with its progress."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from drivetrain.commands.shared import working

if TYPE_CHECKING:
    from drivetrain.errors import Fault
    from drivetrain.sizing.answers.trade_offs import TradeOffsFound
    from drivetrain.sizing.results import Selection
    from drivetrain.study.parts.selection import CurveWanted


def options_beside(
    front: str | None, curves: list[str] | None, low: str | None, high: str | None
) -> dict[str, Any]:  # fmt: skip
    """The front and the curves that the command line asks for instead of what a study says.

    Args:
        front: Criteria separated by commas; None: as the study says.
        curves: Each on one line; None or none: as the study says.
        low, high: Ends of the one curve that is asked for.

    Returns:
        Fields of ``TradeOffs`` by name; none where the study has its say.

    Raises:
        InputError: Every fault of the options at once.
    """
    from drivetrain.errors import Fault, InputError
    from drivetrain.study.parts.selection import read_criterion

    faults: list[Fault] = []
    names = [] if front is None else [name.strip() for name in front.split(",") if name.strip()]
    for name in names:
        try:
            read_criterion(name, "--front")
        except InputError as error:
            faults += error.faults
    if front is not None and not names:
        faults.append(Fault("--front", "names no criterion", front, "such as mass,energy"))
    found = _curves(curves or [], low, high, faults)
    if faults:
        raise InputError(faults)
    asked: dict[str, Any] = {} if front is None else {"front": tuple(dict.fromkeys(names))}
    return asked | ({"curves": tuple(found)} if found else {})


def beside(selection: Selection) -> TradeOffsFound | None:
    """The answers that the study asks for beside the best set.

    Args:
        selection: Of the study.

    Returns:
        Front and curves; None when nothing is asked for.
    """
    if not selection.study.trade_offs:
        return None
    from drivetrain.sizing.answers.trade_offs import trade_offs

    asked = selection.study.trade_offs
    parts = [f"the front over {' and '.join(asked.front)}"] if asked.front else []
    parts += [f"the best drives over the {curve.vary.replace('_', ' ')}" for curve in asked.curves]
    with working("; ".join(parts)) as step:
        return trade_offs(selection.study, progress=step)


def _curves(texts: list[str], low: str | None, high: str | None, faults: list[Fault]) -> list[CurveWanted]:
    """The curves of the command line; what is wrong with them goes to the faults."""
    from drivetrain.errors import Fault, InputError
    from drivetrain.study.parts.selection import CurveWanted, read_curve, read_span

    found: list[CurveWanted] = []
    for text in texts:
        try:
            found.append(read_curve(text, "--curve"))
        except InputError as error:
            faults += error.faults
    twice = {one.vary for one in found if [other.vary for other in found].count(one.vary) > 1}
    faults += [Fault("--curve", "is asked for twice", name) for name in sorted(twice)]
    if low is None and high is None:
        return found
    if len(texts) != 1 or (found and found[0].span is not None):
        hint = "with several curves write the ends into each: --curve 'payload: 0 kg..8 kg'"
        faults.append(
            Fault("--curve-from, --curve-to", "are the ends of one --curve without ends of its own", hint=hint)
        )
        return found
    if low is None or high is None:
        faults.append(Fault("--curve-to" if high is None else "--curve-from", "is missing: a curve has two ends"))
    elif found:
        try:
            span = read_span(found[0].vary, (low, high), ("--curve-from", "--curve-to"))
            found = [CurveWanted(found[0].vary, span)]
        except InputError as error:
            faults += error.faults
    return found
