"""Selection: the best sets of drives for a whole arm by branch and bound, with a proof of optimality.

Every drive loads the joints before it, so the drives of all joints are chosen together.
"""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Protocol

from drivetrain.errors import Fault, InputError, raise_faults
from drivetrain.sizing.demand.demand import Workload
from drivetrain.sizing.judge.evaluate import Pair, evaluated
from drivetrain.sizing.judge.missing import missing_words, of_the_rest
from drivetrain.sizing.results import DriveSet, Evaluation, Selection
from drivetrain.sizing.search.candidates import build_candidates
from drivetrain.sizing.search.constraints.chance import has_tolerances
from drivetrain.sizing.search.domains import Pairs
from drivetrain.sizing.search.preconditions import check_keys, check_options, nothing_to_choose, same_study, why_nothing
from drivetrain.sizing.search.problem import Problem, build_problem
from drivetrain.sizing.search.rejected import Rejected, advice_on, alternatives, nearest_set
from drivetrain.sizing.search.robust import RobustSelection, robust_search, robust_select
from drivetrain.sizing.search.tree import Report, Tree, run_search
from drivetrain.study.model import Study
from drivetrain.study.parts.selection import SelectionOptions

OPTIMAL = "optimal"
ROUNDING = 1e-12  # relative gap that is attributed to rounding
UNITS = {"mass": " kg", "energy": " J"}


class Progress(Protocol):
    """Displays the progress of a search."""

    def advance(self, done: int, total: int, text: str) -> None:
        """Display that ``done`` of ``total`` units of work are done."""


def select(
    study: Study, *, wanted: SelectionOptions | None = None, resume: Selection | None = None,
    work: Workload | None = None, progress: Progress | Report | None = None, advise: bool = True,
) -> Selection:  # fmt: skip
    """The feasible sets of drives of smallest objective, and why the other candidates were rejected.

    Args:
        study: The task with the candidates of every joint; a joint with a fixed drive keeps it.
        wanted: Objective and constraints; None: those of the study, or of the resumed search.
        resume: A selection of the same study that was stopped by its time limit. The search continues from there with
            a new time limit, and finds the same sets as without the stop.
        work: Loads of the study, if they are known already.
        advise: If nothing is feasible, search for changes that would fix it; this takes further searches.
        progress: A function of (done, total, text), or an object with such a method ``advance``.

    Returns:
        The drives, their evaluation, the runners-up, the lower bound and all rejected candidates; if nothing is
        feasible, the nearest set and what would fix it. Sets whose objectives are equal to 1e-9 are ordered by their
        energy per cycle, sets of equal energy by their largest utilisation. The proof covers this order; up to 1000
        ties of the best set are counted. The result does not depend on the machine or on stops. If the study requires
        a probability within tolerances (``holds``), the drives are the best that have it, as of ``robust_select``.

    Raises:
        InputError: Options that do not suit the study; ``resume`` is of another study or has other options.
    """
    check_options(study, wanted)
    report = _reporter(progress)
    if not isinstance(resume, Selection | None):
        raise InputError(Fault("resume", "must be a selection", type(resume).__name__))
    if resume is not None and resume.state is None:
        return resume
    tree = _new_tree(study, wanted, work) if resume is None else _resumed_tree(study, wanted, resume)
    tree.begin()
    start = time.perf_counter()  # compilation in a first run does not count
    time_limit = tree.problem.options.time_limit if wanted is None else wanted.time_limit
    if resume is not None and tree.chance_constraint is not None:
        return _robust(resume, tree.problem, robust_search(tree, tree.chance_constraint, time_limit))
    tree, evaluations = run_search(tree, start + time_limit, report)
    if not tree.best:
        return _nothing_fits(tree, report, advise)
    found = _answer(tree, evaluations, report)
    if not found.feasible or found.study.wanted.holds is None or not has_tolerances(found.study):
        return found
    report(1, 1, "the required probability")
    wishes = replace(found.study.wanted, time_limit=time_limit)
    choice = robust_select(replace(found.study, wanted=wishes), work=tree.problem.candidates.work)
    return _robust(found, tree.problem, choice)


def better_set(study: Study, objective: float) -> tuple[dict[str, Pair], bool]:
    """The best set below a known objective, empty if none was found, and whether the answer is proven.

    This takes a fraction of the time of ``select``, which starts without an upper bound.
    """
    tree = _new_tree(study, None, None)
    tree.cutoff = (tree.problem.level(objective) - 0.5) * tree.problem.objective_step
    tree, _ = run_search(tree, time.perf_counter() + tree.problem.options.time_limit, _reporter(None))
    keys = tree.problem.keys(dict(enumerate(tree.found[0]))) if tree.best else {}
    return keys, tree.finished


def _new_tree(study: Study, wanted: SelectionOptions | None, work: Workload | None) -> Tree:
    study = study if wanted is None else replace(study, wanted=wanted)
    try:
        offered = build_candidates(study, None if work is None else replace(work, study=study))
        return Tree(build_problem(offered, study.wanted))
    except KeyError:
        check_keys(study)
        raise


def _resumed_tree(study: Study, wanted: SelectionOptions | None, resume: Selection) -> Tree:
    """A copy of a stopped search, with all faults of resuming it reported."""
    tree, faults = resume.state, []
    if not isinstance(tree, Tree):
        raise InputError(Fault("resume", "is not a selection that a search returned", type(tree).__name__))
    if not same_study(tree.problem.candidates.study, study):
        faults.append(Fault("resume", "is a selection of another study", tree.problem.candidates.study.name))
    if wanted is not None and replace(wanted, time_limit=0.0) != replace(tree.problem.options, time_limit=0.0):
        hint = "only the time limit may differ; leave the selection out to search anew"
        faults.append(Fault("wanted", "asks for something else than the search that is to go on", hint=hint))
    raise_faults(faults)
    return tree.copy()


def _answer(tree: Tree, evaluations: Mapping[Pairs, Evaluation], report: Report) -> Selection:
    """The selection of a search that found sets."""
    study, problem, sets = tree.problem.candidates.study, tree.problem, []
    for found in tree.best:
        one = evaluations[found.pairs]
        # without a value for a fixed drive that lacks data, the objective of the other drives
        objective = found.objective if math.isnan(one.objective) else one.objective
        sets.append(DriveSet(problem.keys(dict(enumerate(found.pairs))), objective, one.criteria))
    best, chosen = evaluations[tree.found[0]], dict(enumerate(tree.found[0]))
    report(1, 1, "the next best of each joint")
    return Selection(
        study, sets[0].drives, best, sets[0].objective, _proof(tree), Rejected(problem, chosen),
        alternatives(problem, chosen), missing_words(best), dict(tree.counters), tuple(sets),
        min(tree.bound, sets[0].objective), None if tree.finished else tree,
        of_the_rest(best), *tree.equals,
    )  # fmt: skip


def _robust(selection: Selection, problem: Problem, found: RobustSelection) -> Selection:
    """A selection of the best set with the required probability instead of the best one with nominal values."""
    stopped = replace(
        selection, bound=found.least, state=found.state, best_sets=found.best_sets, equals=0, all_equals=False,
        choice=found,
    )  # fmt: skip
    if found.chosen is None:
        return replace(stopped, drives={}, objective=math.nan, proof=found.proof, advice=(f"{found.proof}.",))
    best = found.chosen.drives
    chosen = problem.pairs(best.drives)
    return replace(
        stopped, drives=dict(best.drives), evaluation=evaluated(problem.candidates.work, best.drives),
        objective=best.objective, proof=f"{OPTIMAL if found.proven else 'not proven'}: {found.proof}",
        rejected_pairs=Rejected(problem, chosen), alternatives=alternatives(problem, chosen), advice=(),
    )  # fmt: skip


def _nothing_fits(tree: Tree, report: Report, advise: bool) -> Selection:
    """The selection of a search that found no set: the nearest set, and what would fix it."""
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
    """The common-parts constraints that no set satisfies, whatever the loads are."""
    return tuple(
        f"No set keeps the limit of {one.name} ({one.most}): the candidates of the joints have too few in common."
        for one in problem.constraints
        if one.propagate(problem.domains(), math.inf) is None
    )


def _proof(tree: Tree) -> str:
    """The proof of optimality in words, or the gap between the best set and the lower bound."""
    best, bound = tree.best[0].objective, tree.bound
    if tree.finished:
        return OPTIMAL
    if best <= bound + ROUNDING * abs(bound):
        return f"{OPTIMAL}; whether an equal set takes less energy is not proven: the search was stopped"
    text = f"lower bound {bound:.3g}{UNITS.get(tree.problem.options.objective, '')}"
    if not 0.0 < bound < math.inf:
        return f"not proven: {text}"
    return f"not proven: at most {100.0 * (best / bound - 1.0):.3g} % above the best possible ({text})"


def _reporter(progress: Progress | Report | None) -> Report:
    """A progress function from any accepted kind of progress."""
    if progress is None:
        return lambda done, total, text: None
    advance: Report = getattr(progress, "advance", progress)  # type: ignore[arg-type]
    return advance
