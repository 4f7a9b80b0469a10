"""What the task needs, whether a drive fits, which drives are best."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.sizing.answers.curve import OptimumCurve as OptimumCurve
    from drivetrain.sizing.answers.curve import optimum_curve as optimum_curve
    from drivetrain.sizing.answers.family import FamilySelection as FamilySelection
    from drivetrain.sizing.answers.family import select_family as select_family
    from drivetrain.sizing.answers.fastest import Fastest as Fastest
    from drivetrain.sizing.answers.fastest import fastest as fastest
    from drivetrain.sizing.answers.free_ratio import FreeRatios as FreeRatios
    from drivetrain.sizing.answers.free_ratio import free_ratios as free_ratios
    from drivetrain.sizing.answers.ratio import ratio_studies as ratio_studies
    from drivetrain.sizing.answers.ratio import ratio_study as ratio_study
    from drivetrain.sizing.answers.trade_offs import trade_offs as trade_offs
    from drivetrain.sizing.answers.why_not import WhyNot as WhyNot
    from drivetrain.sizing.answers.why_not import why_not as why_not
    from drivetrain.sizing.currents import current_commands as current_commands
    from drivetrain.sizing.deflection import tip_deflection as tip_deflection
    from drivetrain.sizing.deflection import vibration as vibration
    from drivetrain.sizing.judge.checks import REQUIREMENTS as REQUIREMENTS
    from drivetrain.sizing.judge.checks import Requirement as Requirement
    from drivetrain.sizing.judge.evaluate import evaluate as evaluate
    from drivetrain.sizing.judge.evaluate import evaluate_drives as evaluate_drives
    from drivetrain.sizing.judge.missing import gaps as gaps
    from drivetrain.sizing.results import DriveSet as DriveSet
    from drivetrain.sizing.results import Evaluation as Evaluation
    from drivetrain.sizing.results import Selection as Selection
    from drivetrain.sizing.search.front import Front as Front
    from drivetrain.sizing.search.front import pareto_front as pareto_front
    from drivetrain.sizing.search.robust import robust_select as robust_select
    from drivetrain.sizing.search.search import select as select
    from drivetrain.sizing.tolerance.monte_carlo import robustness as robustness

__getattr__, __dir__ = shown(__name__)
