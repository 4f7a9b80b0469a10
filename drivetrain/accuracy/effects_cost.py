"""What each effect changes in the user's own motion when it is left out, beside what it costs to keep."""

from __future__ import annotations

from collections.abc import Callable

from drivetrain.accuracy.decision import Basis, change, decision
from drivetrain.accuracy.runs import ran, seconds, work
from drivetrain.accuracy.variants import LABELS, choices, without
from drivetrain.simulation.cost_results import Choice, EffectCost, EffectCosts
from drivetrain.simulation.engine import Engine
from drivetrain.simulation.fixed_step import FixedStep
from drivetrain.simulation.plan import Plan, plan
from drivetrain.simulation.scene import Scene

Told = Callable[[int, int, str], None]


def effects_cost(
    scene: Scene, basis: Basis, *, engine: Engine | None = None, rounds: int = 3, progress: Told | None = None
) -> EffectCosts:
    """Every effect of a scene left out once, at all joints that have it.

    Args:
        engine: What runs it; None: the default of ``simulate`` with half its step.
        progress: Told (done, of how many, what).

    Raises:
        InputError: A scene that contradicts itself or does not reach its end.
    """
    engine = FixedStep(5e-4) if engine is None else engine
    groups: dict[str, list[Choice]] = {}
    for choice in choices(scene):
        groups.setdefault(choice.kind, []).append(choice)
    full = without(scene, ())
    plans = [plan(full)]
    recording = ran(plans[0], engine)
    base = decision(recording, full, basis)
    kept: list[tuple[str, list[Choice], Plan, EffectCost]] = []
    for done, (kind, members) in enumerate(groups.items()):
        if progress is not None:
            progress(done, len(groups) + 1, f"without {LABELS[kind]}")
        less = without(scene, members)
        ready = plan(less)
        told = ran(ready, engine)
        found = decision(told, less, basis)
        share = work(recording.counters) / max(work(told.counters), 1)
        row = EffectCost(
            LABELS[kind], tuple(one.joint for one in members), change(found, base), found.verdict, 1.0, share
        )
        kept.append((kind, members, ready, row))
    if progress is not None:
        progress(len(groups), len(groups) + 1, "timing")
    bare = plan(without(scene, choices(scene)))
    times = seconds([(ready, engine) for ready in (plans[0], bare, *(ready for _, _, ready, _ in kept))], rounds)
    rows = [
        EffectCost(row.label, row.joints, row.changes, row.verdict, times[0] / taken, row.work)
        for (_, _, _, row), taken in zip(kept, times[2:], strict=True)
    ]
    ordered = sorted(rows, key=lambda row: -row.time)
    return EffectCosts(base, times[0], repr(engine), recording.counters, tuple(ordered), times[1] / times[0])
