"""The lightest or cheapest set of drives: from the tip to the base, every drive loading the joints before it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Protocol

from drivetrain.sizing.advice import advice_on, nearest_set
from drivetrain.sizing.candidates import Candidate, Field, joint_fields, unknown_share
from drivetrain.sizing.evaluate import evaluate
from drivetrain.sizing.results import Fallen, Selection
from drivetrain.sizing.tree import Blocked, Tree
from drivetrain.study.study import Study

NODE_LIMIT = 200
ALTERNATIVES = 5
OPTIMAL = "optimal"
ROUNDING = 1e-12  # of a sum of a few shares: a gap below it is none

Tell = Callable[[int, int, str], None]


class Progress(Protocol):
    """Something that shows how far a search is."""

    def advance(self, done: int, total: int, text: str) -> None:
        """Show it.

        Args:
            done: Steps done.
            total: Steps at most.
            text: What is being done.
        """


def select(study: Study, *, node_limit: int = NODE_LIMIT, progress: Progress | Tell | None = None) -> Selection:
    """The set of drives with the smallest objective whose every check holds, and why not the others.

    The first set is the greedy one: from the tip to the base, the candidate of smallest share that holds. Then the
    tree of all choices is searched depth first with a bound, until it is exhausted or the nodes are used up.

    Args:
        study: The task, with the candidates of every joint; joints with a given drive keep it.
        node_limit: How many joints, each with one set of drives after it, may be looked at; the first set is
            always completed.
        progress: Told how far the search is: an object with ``advance(done, total, text)`` or a function.

    Returns:
        The drives, their evaluation, how far they are from a proven optimum, every candidate that fell beside them;
        when nothing fits the nearest set and what would mend it.

    Raises:
        InputError: A joint without candidates, or without any whose mass or price is known.
    """
    tell = _teller(progress)
    fields = joint_fields(study)
    tree = Tree(study, fields, max(node_limit, len(fields)), lambda nodes, text: tell(nodes, node_limit, text))
    tree.run()
    if tree.best is None:
        return _nothing_fits(study, fields, tree, tell)
    drives = {field.name: one.keys for field, one in zip(fields, tree.best, strict=True)}
    evaluation = evaluate(study, drives)
    fallen, alternatives = _beside(fields, tree.best, tell)
    return Selection(
        study, drives, evaluation, evaluation.objective, _proof(tree), fallen, alternatives, (), dict(tree.counters)
    )


def _nothing_fits(study: Study, fields: tuple[Field, ...], tree: Tree, tell: Tell) -> Selection:
    """The answer when no set was found: the nearest one, and what would mend it."""
    near = nearest_set(study, fields, tree.blocked or Blocked(len(fields) - 1, {}))
    tell(1, 1, "what would mend it")
    evaluation = evaluate(study, near.keys)
    fallen, _ = _beside(fields, near.path, tell)
    proof = "no set fits: every combination was ruled out"
    if not tree.exhausted:
        proof = f"not proven: the search stopped after {tree.counters['nodes']} nodes without a set that fits"
    return Selection(
        study, {}, evaluation, math.nan, proof, fallen, {}, advice_on(evaluation, near), dict(tree.counters)
    )


def _beside(
    fields: tuple[Field, ...], path: tuple[Candidate, ...], tell: Tell
) -> tuple[tuple[Fallen, ...], dict[str, tuple[tuple[str, str, float], ...]]]:
    """Every candidate at every joint judged beside a set: those that fell, and the next best that hold."""
    fallen: list[Fallen] = []
    alternatives: dict[str, tuple[tuple[str, str, float], ...]] = {}
    for done, field in enumerate(reversed(fields)):
        tell(done, len(fields), f"judging all candidates of {field.name}")
        mounted = {j: path[j].drive for j in range(field.joint + 1, len(fields))}
        work = field.work.at(field.joint, mounted)
        others: list[tuple[str, str, float]] = []
        for one in field.candidates:
            judgement = field.judge(one, work)
            if not judgement.holds:
                fallen.append(judgement.fallen(field.name))
            elif one is not path[field.joint]:
                others.append((one.motor, one.gear, one.share))
        fallen += unknown_share(field)
        alternatives[field.name] = tuple(others[:ALTERNATIVES])
    tell(len(fields), len(fields), "all candidates judged")
    return tuple(fallen), alternatives


def _proof(tree: Tree) -> str:
    """Whether the best set is proven to be, or how far from it the bound is."""
    if tree.exhausted or tree.objective <= tree.bound * (1.0 + ROUNDING):
        return OPTIMAL
    unit = " kg" if tree.study.objective == "mass" else ""
    bound = f"lower bound {tree.bound:.3g}{unit}"
    if tree.bound <= 0.0:
        return f"not proven: {bound}"
    gap = 100.0 * (tree.objective / tree.bound - 1.0)
    return f"not proven: at most {gap:.3g} % above the best possible ({bound})"


def _teller(progress: Progress | Tell | None) -> Tell:
    """One function for every kind of progress."""
    if progress is None:
        return lambda done, total, text: None
    advance: Tell = getattr(progress, "advance", progress)  # type: ignore[arg-type]
    return advance
