"""Loads of a task, feasibility of drives, and the search for the best drives."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.sizing.answers.curve import OptimumCurve, optimum_curve
    from drivetrain.sizing.answers.family import FamilySelection, select_family
    from drivetrain.sizing.answers.fastest import Fastest, fastest
    from drivetrain.sizing.answers.free_ratio import FreeRatios, free_ratios
    from drivetrain.sizing.answers.loops import JointLoops, StudyLoops, study_loops
    from drivetrain.sizing.answers.ratio import ratio_studies, ratio_study
    from drivetrain.sizing.answers.trade_offs import trade_offs
    from drivetrain.sizing.answers.why_not import WhyNot, why_not
    from drivetrain.sizing.currents import current_commands
    from drivetrain.sizing.deflection import tip_deflection, vibration
    from drivetrain.sizing.judge.checks import REQUIREMENTS, Requirement
    from drivetrain.sizing.judge.evaluate import evaluate, evaluate_drives
    from drivetrain.sizing.judge.missing import gaps
    from drivetrain.sizing.results import DriveSet, Evaluation, Selection
    from drivetrain.sizing.search.pareto.front import Front, pareto_front
    from drivetrain.sizing.search.robust import robust_select
    from drivetrain.sizing.search.search import select
    from drivetrain.sizing.tolerance.monte_carlo import robustness

__getattr__, __dir__ = shown(__name__)
