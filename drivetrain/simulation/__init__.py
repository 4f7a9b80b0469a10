"""Forward simulation: scenes, plans, engines and recordings."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.simulation.constrained import Baumgarte, Projection, simulate_constrained
    from drivetrain.simulation.engines.adaptive_step import AdaptiveStep
    from drivetrain.simulation.engines.fixed_step import FixedStep
    from drivetrain.simulation.engines.inverse import Inverse
    from drivetrain.simulation.passive import simulate_passive
    from drivetrain.simulation.planning.plan import Plan, plan
    from drivetrain.simulation.recording import Recording, load_recording
    from drivetrain.simulation.scene import Inertia, Scene, joint_scene, without
    from drivetrain.simulation.study_scene import SceneOptions, scene_of, with_feed_forward

__getattr__, __dir__ = shown(__name__)
