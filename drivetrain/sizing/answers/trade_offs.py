"""Trade-offs that a study requests: the Pareto front, and the best set over quantities of the task."""

from __future__ import annotations

from dataclasses import dataclass

from drivetrain.errors import Faults
from drivetrain.sizing.answers.curve import OptimumCurve, Progress, check_curve, optimum_curve
from drivetrain.sizing.judge.vary import Vary
from drivetrain.sizing.search.pareto.front import Front, check_criteria, pareto_front
from drivetrain.study.model import Study
from drivetrain.study.parts.selection import CurveWanted

# range relative to the study's value
FACTORS = {Vary.PAYLOAD: (0.5, 1.5), Vary.CYCLE_TIME: (0.75, 1.5), Vary.VOLTAGE: (0.75, 1.25), Vary.FORCE: (0.5, 1.5)}
AROUND = 20.0  # half width of the range of ambient temperatures [K]


@dataclass(frozen=True, eq=False)
class TradeOffsFound:
    """The front, None if not requested, and the curves over quantities of the task."""

    front: Front | None
    curves: tuple[OptimumCurve, ...]


def trade_offs(study: Study, *, progress: Progress | None = None) -> TradeOffsFound:
    """The front and the curves that a study requests in its ``trade_offs``.

    Args:
        study: The task; the time limit of its search applies to the front and to every point of a curve.
        progress: Called with (steps done, total, text).

    Returns:
        The front and the curves.

    Raises:
        InputError: A payload that the study does not carry is to be varied.
    """
    report = progress or (lambda done, total, text: None)
    wanted, front = study.trade_offs, None
    if wanted.front:
        front = pareto_front(
            study, wanted.front, time_limit=study.wanted.time_limit,
            progress=lambda done, total, text: report(done, total, f"front: {text}"),
        )  # fmt: skip
    return TradeOffsFound(front, tuple(_curve(study, one, report) for one in wanted.curves))


def check_trade_offs(study: Study) -> None:
    """Raise InputError for fronts and curves that cannot be computed, with every fault at once."""
    faults = Faults()
    wanted = study.trade_offs
    if wanted.front:
        faults.attempt(check_criteria, study, wanted.front)
    for one in wanted.curves:
        vary = Vary(one.vary)
        # Without a payload or a force there is no usual range; any range shows the fault.
        lacking = vary in (Vary.PAYLOAD, Vary.FORCE) and not vary.now(study)
        own = (0.0, 1.0) if lacking else usual_span(study, vary)
        faults.attempt(check_curve, study, vary, one.span or own)
    faults.raise_any()


def usual_span(study: Study, vary: Vary) -> tuple[float, float]:
    """The default range of a curve around the study's own value: [kg], [s], [V], [C] or [%]."""
    own, (low, high) = vary.now(study), FACTORS.get(vary, (1.0, 1.0))
    return (own - AROUND, own + AROUND) if vary is Vary.AMBIENT else (low * own, high * own)


def _curve(study: Study, wanted: CurveWanted, report: Progress) -> OptimumCurve:
    vary = Vary(wanted.vary)
    name = vary.replace("_", " ")
    return optimum_curve(
        study, vary, wanted.span or usual_span(study, vary),
        progress=lambda done, total, text: report(done, total, f"over the {name}: {text}"),
    )  # fmt: skip
