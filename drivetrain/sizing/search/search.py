"""The best sets of drives for the whole arm, every drive loading the joints before it, with a proof."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Protocol

from drivetrain.errors import Fault, InputError
from drivetrain.sizing.demand.demand import Workload
from drivetrain.sizing.judge.evaluate import Pair, evaluated
from drivetrain.sizing.judge.missing import missing_words, uncounted
from drivetrain.sizing.results import DriveSet, Evaluation, Selection
from drivetrain.sizing.search.candidates import Pairs, candidates
from drivetrain.sizing.search.preconditions import check_keys, check_options, nothing_to_choose, same_study, why_nothing
from drivetrain.sizing.search.problem import Problem, problem
from drivetrain.sizing.search.rejected import Rejected, advice_on, alternatives, nearest_set
from drivetrain.sizing.search.tree import Report, Tree, searched
from drivetrain.study.model import Study
from drivetrain.study.parts.selection import SelectionOptions

OPTIMAL = "optimal"
ROUNDING = 1e-12  # of a sum of a few shares: a gap below it is none
UNITS = {"mass": " kg", "energy": " J"}


class Progress(Protocol):
    """Something that shows how far a search is."""

    def advance(self, done: int, total: int, text: str) -> None:
        """Show it."""


def select(
    study: Study, *, wanted: SelectionOptions | None = None, resume: Selection | None = None,
    work: Workload | None = None, progress: Progress | Report | None = None, advise: bool = True,
) -> Selection:  # fmt: skip
    """The sets of drives with the smallest objective whose every check holds, and why not the others.

    Args:
        study: The task, with the candidates of every joint; joints with a given drive keep it.
        wanted: What is minimised and must be respected; None: what the study says, or what the search to go on with
            was asked.
        resume: A selection of the same study that its time limit stopped: the search goes on where it stopped, for
            another time limit, and ends with the sets that it would have found without the stop.
        work: Of the study, where it is already prepared.
        advise: Whether to look for changes that would fix it where nothing fits, which takes further searches.
        progress: Told how far the search is: an object with ``advance(done, total, text)`` or a function.

    Returns:
        The drives, their evaluation, the runners-up, the lower bound, every rejected candidate; when nothing fits the
        nearest set and what would fix it. Sets whose objectives are equal to 1e-9 come in the order of their energy a
        cycle, those of equal energy in that of their largest utilisation; the proof is one of this order, and up to
        1000 equals of the best set are counted. Nothing else orders them: neither how often a search was stopped, nor
        the machine.

    Raises:
        InputError: Options that make no sense of the study; ``resume`` is of another study, or asks for something else.
    """
    check_options(study, wanted)
    report = _reporter(progress)
    if not isinstance(resume, Selection | None):
        raise InputError(Fault("resume", "must be a selection", type(resume).__name__))
    if resume is not None and resume.state is None:
        return resume
    tree = _new_tree(study, wanted, work) if resume is None else _old_tree(study, wanted, resume)
    tree.begin()
    begin = time.perf_counter()  # what a first run compiles is no search
    limit = tree.problem.wanted.time_limit if wanted is None else wanted.time_limit
    tree, evaluations = searched(tree, begin + limit, report)
    return _answer(tree, evaluations, report) if tree.best else _nothing_fits(tree, report, advise)


def better_set(study: Study, objective: float) -> tuple[dict[str, Pair], bool]:
    """The best set that is better than one known, empty where none was found, and whether that is proven.

    A fraction of a search that has none to hold others against.
    """
    tree = _new_tree(study, None, None)
    tree.below = (tree.problem.level(objective) - 0.5) * tree.problem.step
    tree, _ = searched(tree, time.perf_counter() + tree.problem.wanted.time_limit, _reporter(None))
    keys = tree.problem.keys(dict(enumerate(tree.found[0]))) if tree.best else {}
    return keys, tree.finished


def _new_tree(study: Study, wanted: SelectionOptions | None, work: Workload | None) -> Tree:
    """A search that begins."""
    study_asked = study if wanted is None else replace(study, wanted=wanted)
    try:
        offered = candidates(study_asked, None if work is None else replace(work, study=study_asked))
        return Tree(problem(offered, study_asked.wanted))
    except KeyError:
        check_keys(study_asked)
        raise


def _old_tree(study: Study, wanted: SelectionOptions | None, resume: Selection) -> Tree:
    """A search that goes on."""
    tree, faults = resume.state, []
    if not isinstance(tree, Tree):
        raise InputError(Fault("resume", "is not a selection that a search returned", type(tree).__name__))
    if not same_study(tree.problem.candidates.study, study):
        faults.append(Fault("resume", "is a selection of another study", tree.problem.candidates.study.name))
    if wanted is not None and replace(wanted, time_limit=0.0) != replace(tree.problem.wanted, time_limit=0.0):
        hint = "only the time limit may differ; leave the selection out to search anew"
        faults.append(Fault("wanted", "asks for something else than the search that is to go on", hint=hint))
    if faults:
        raise InputError(faults)
    return tree.copied()


def _answer(tree: Tree, evaluations: Mapping[Pairs, Evaluation], report: Report) -> Selection:
    """What a search found."""
    study, problem, sets = tree.problem.candidates.study, tree.problem, []
    for found in tree.best:
        one = evaluations[found.pairs]
        # Of what is known of a set, where a given drive's share is not.
        objective = found.objective if math.isnan(one.objective) else one.objective
        sets.append(DriveSet(problem.keys(dict(enumerate(found.pairs))), objective, one.criteria))
    best, chosen = evaluations[tree.found[0]], dict(enumerate(tree.found[0]))
    report(1, 1, "the next best of each joint")
    return Selection(
        study, sets[0].drives, best, sets[0].objective, _proof(tree), Rejected(problem, chosen),
        alternatives(problem, chosen), missing_words(best), dict(tree.counters), tuple(sets),
        min(tree.bound, sets[0].objective), None if tree.finished else tree,
        tuple(f"{text}; the objective is that of the rest" for text in uncounted(best)), *tree.equals,
    )  # fmt: skip


def _nothing_fits(tree: Tree, report: Report, advise: bool) -> Selection:
    """The answer when no set was found: the nearest one, and what would fix it."""
    report(1, 1, "what would fix it")
    study, lacking = tree.problem.candidates.study, nothing_to_choose(tree.problem)
    reasons = why_nothing(tree.problem)
    near = nearest_set(tree.problem)
    evaluation = evaluated(tree.problem.candidates.work, near.keys, lacking)
    proof = "no set fits: every combination was ruled out"
    if lacking:
        proof = "no set fits: " + "; ".join(reason for reason, _ in reasons)
    elif not tree.finished:
        proof = f"not proven: the search stopped after {tree.counters['nodes']} nodes without a set that fits"
    advice = tuple(f"{reason} ({fix})." if fix else f"{reason}." for reason, fix in reasons)
    return Selection(
        study, {}, evaluation, math.nan, proof, Rejected(tree.problem, near.pairs), {},
        advice or _impossible(tree.problem) or (advice_on(evaluation, near) if advise else ()), dict(tree.counters), (),
        tree.bound, None if tree.finished else tree,
    )  # fmt: skip


def _impossible(problem: Problem) -> tuple[str, ...]:
    """The constraints on common parts that alone leave no set, whatever the loads are."""
    return tuple(
        f"No set keeps the limit of {one.what} ({one.most}): the candidates of the joints have too few in common."
        for one in problem.constraints
        if one.propagate(problem.domains(), math.inf) is None
    )


def _proof(tree: Tree) -> str:
    """Whether the best set is proven to be, or how far from it the bound is."""
    best, bound = tree.best[0].objective, tree.bound
    if tree.finished:
        return OPTIMAL
    if best <= bound + ROUNDING * abs(bound):
        return f"{OPTIMAL}; whether an equal set takes less energy is not proven: the search was stopped"
    text = f"lower bound {bound:.3g}{UNITS.get(tree.problem.wanted.objective, '')}"
    if not 0.0 < bound < math.inf:
        return f"not proven: {text}"
    return f"not proven: at most {100.0 * (best / bound - 1.0):.3g} % above the best possible ({text})"


def _reporter(progress: Progress | Report | None) -> Report:
    """One function for every kind of progress."""
    if progress is None:
        return lambda done, total, text: None
    advance: Report = getattr(progress, "advance", progress)  # type: ignore[arg-type]
    return advance
