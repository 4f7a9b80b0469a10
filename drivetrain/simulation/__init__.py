"""Motions that follow from forces: what is simulated, and what is recorded of it."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.simulation.constrained import Baumgarte as Baumgarte
    from drivetrain.simulation.constrained import Projection as Projection
    from drivetrain.simulation.constrained import simulate_constrained as simulate_constrained
    from drivetrain.simulation.engines.adaptive_step import AdaptiveStep as AdaptiveStep
    from drivetrain.simulation.engines.fixed_step import FixedStep as FixedStep
    from drivetrain.simulation.engines.inverse import Inverse as Inverse
    from drivetrain.simulation.passive import simulate_passive as simulate_passive
    from drivetrain.simulation.planning.plan import Plan as Plan
    from drivetrain.simulation.planning.plan import plan as plan
    from drivetrain.simulation.recording import Recording as Recording
    from drivetrain.simulation.recording import load_recording as load_recording
    from drivetrain.simulation.scene import Inertia as Inertia
    from drivetrain.simulation.scene import Scene as Scene
    from drivetrain.simulation.scene import joint_scene as joint_scene
    from drivetrain.simulation.scene import without as without
    from drivetrain.simulation.study_scene import scene_of as scene_of
    from drivetrain.simulation.study_scene import with_feed_forward as with_feed_forward

__getattr__, __dir__ = shown(__name__)
