"""Can this motor and gear drive this arm through these motions? The public names, loaded when first used."""

from __future__ import annotations

from importlib import import_module
from types import FunctionType
from typing import TYPE_CHECKING, Any

from drivetrain.face import guarded
from drivetrain.version import __version__ as __version__

if TYPE_CHECKING:
    from drivetrain.accuracy.study_run import simulate as simulate
    from drivetrain.arm.arm import Arm as Arm
    from drivetrain.arm.bodies import with_body as with_body
    from drivetrain.arm.bodies import with_payload as with_payload
    from drivetrain.arm.book_lists import book_lists as book_lists
    from drivetrain.arm.closures import Closure as Closure
    from drivetrain.arm.closures import LoopLink as LoopLink
    from drivetrain.arm.closures import with_closures as with_closures
    from drivetrain.arm.coupling import belts_over as belts_over
    from drivetrain.arm.coupling import differential as differential
    from drivetrain.arm.coupling import with_coupling as with_coupling
    from drivetrain.arm.dh import arm_from_dh as arm_from_dh
    from drivetrain.arm.flexible_links import BendingLink as BendingLink
    from drivetrain.arm.flexible_links import with_flexible_links as with_flexible_links
    from drivetrain.arm.load import load_arm as load_arm
    from drivetrain.arm.rotors import Rotor as Rotor
    from drivetrain.arm.rotors import RotorLevel as RotorLevel
    from drivetrain.arm.with_rotors import at_level as at_level
    from drivetrain.arm.with_rotors import with_rotors as with_rotors
    from drivetrain.catalog.price import Price as Price
    from drivetrain.catalog.read import read_catalog as read_catalog
    from drivetrain.control.c_code import write_c as write_c
    from drivetrain.control.commander import Commander as Commander
    from drivetrain.drive.amplifier import AmplifierSheet as AmplifierSheet
    from drivetrain.drive.brake import Brake as Brake
    from drivetrain.drive.friction import Friction as Friction
    from drivetrain.drive.friction import book_curves as book_curves
    from drivetrain.drive.gear import Gear as Gear
    from drivetrain.drive.loops.loop_design import design_loops as design_loops
    from drivetrain.drive.loops.servo_axis import ServoAxis as ServoAxis
    from drivetrain.drive.loops.servo_axis import ServoTiming as ServoTiming
    from drivetrain.drive.matching import inertia_matching_ratio as inertia_matching_ratio
    from drivetrain.drive.motor import Motor as Motor
    from drivetrain.drive.thermal.thermal_network import thermal_network as thermal_network
    from drivetrain.dynamics.book.closed_form import closed_form as closed_form
    from drivetrain.dynamics.book.closed_form import mass_matrix_rate as mass_matrix_rate
    from drivetrain.dynamics.book.ellipsoids import acceleration_ellipsoid as acceleration_ellipsoid
    from drivetrain.dynamics.book.ellipsoids import effective_mass as effective_mass
    from drivetrain.dynamics.book.ellipsoids import tip_acceleration_ellipsoid as tip_acceleration_ellipsoid
    from drivetrain.dynamics.book.ellipsoids import tip_force_ellipsoid as tip_force_ellipsoid
    from drivetrain.dynamics.book.ellipsoids import torque_ellipsoid as torque_ellipsoid
    from drivetrain.dynamics.book.ratio_sweep import sweep_ratio as sweep_ratio
    from drivetrain.dynamics.book.symbolic import symbolic_dynamics as symbolic_dynamics
    from drivetrain.dynamics.constrained import constrained_forward_dynamics as constrained_forward_dynamics
    from drivetrain.dynamics.constrained import constrained_inverse_dynamics as constrained_inverse_dynamics
    from drivetrain.dynamics.constrained import constraint_projectors as constraint_projectors
    from drivetrain.dynamics.constraints import Attachment as Attachment
    from drivetrain.dynamics.constraints import ClosingJoint as ClosingJoint
    from drivetrain.dynamics.constraints import LoopClosure as LoopClosure
    from drivetrain.dynamics.constraints import Plane as Plane
    from drivetrain.dynamics.constraints import PointOnSurface as PointOnSurface
    from drivetrain.dynamics.coriolis import christoffel_symbols as christoffel_symbols
    from drivetrain.dynamics.coriolis import coriolis_matrix as coriolis_matrix
    from drivetrain.dynamics.derivatives import AccelerationDerivatives as AccelerationDerivatives
    from drivetrain.dynamics.derivatives import TorqueDerivatives as TorqueDerivatives
    from drivetrain.dynamics.derivatives import forward_dynamics_derivatives as forward_dynamics_derivatives
    from drivetrain.dynamics.derivatives import inverse_dynamics_derivatives as inverse_dynamics_derivatives
    from drivetrain.dynamics.energy import kinetic_energy as kinetic_energy
    from drivetrain.dynamics.energy import potential_energy as potential_energy
    from drivetrain.dynamics.energy import power_balance as power_balance
    from drivetrain.dynamics.flexibility import free_frequencies as free_frequencies
    from drivetrain.dynamics.flexibility import locked_frequencies as locked_frequencies
    from drivetrain.dynamics.flexibility import tip_compliance as tip_compliance
    from drivetrain.dynamics.forward import articulated_body as articulated_body
    from drivetrain.dynamics.forward import forward_dynamics as forward_dynamics
    from drivetrain.dynamics.from_positions import torque_from_positions as torque_from_positions
    from drivetrain.dynamics.inverse import DriveTorques as DriveTorques
    from drivetrain.dynamics.inverse import bias_torque as bias_torque
    from drivetrain.dynamics.inverse import drive_torques as drive_torques
    from drivetrain.dynamics.inverse import gravity_torque as gravity_torque
    from drivetrain.dynamics.inverse import inverse_dynamics as inverse_dynamics
    from drivetrain.dynamics.inverse import joint_loads as joint_loads
    from drivetrain.dynamics.inverse import tip_torque as tip_torque
    from drivetrain.dynamics.inverse import velocity_torque as velocity_torque
    from drivetrain.dynamics.kinematics import body_jacobian as body_jacobian
    from drivetrain.dynamics.kinematics import body_jacobian_rate as body_jacobian_rate
    from drivetrain.dynamics.kinematics import link_poses as link_poses
    from drivetrain.dynamics.kinematics import space_jacobian as space_jacobian
    from drivetrain.dynamics.kinematics import space_jacobian_rate as space_jacobian_rate
    from drivetrain.dynamics.kinematics import tip_pose as tip_pose
    from drivetrain.dynamics.mass_matrix import mass_matrix as mass_matrix
    from drivetrain.dynamics.regressor import parameter_names as parameter_names
    from drivetrain.dynamics.regressor import torque_parameters as torque_parameters
    from drivetrain.dynamics.regressor import torque_regressor as torque_regressor
    from drivetrain.dynamics.task_space import task_space_dynamics as task_space_dynamics
    from drivetrain.effects.control.cascade_loop import CascadeLoop as CascadeLoop
    from drivetrain.effects.control.commanded_motion import CommandedMotion as CommandedMotion
    from drivetrain.effects.control.computed_torque import ComputedTorque as ComputedTorque
    from drivetrain.effects.control.computed_torque import SampledComputedTorque as SampledComputedTorque
    from drivetrain.effects.control.encoder import Encoder as Encoder
    from drivetrain.effects.control.position_loop import PositionLoop as PositionLoop
    from drivetrain.effects.control.sampled_cascade import SampledCascade as SampledCascade
    from drivetrain.effects.effect import Effect as Effect
    from drivetrain.effects.friction.dry_friction import DryFriction as DryFriction
    from drivetrain.effects.friction.holding_brake import HoldingBrake as HoldingBrake
    from drivetrain.effects.friction.lugre_friction import LuGreFriction as LuGreFriction
    from drivetrain.effects.friction.moving_belt import MovingBelt as MovingBelt
    from drivetrain.effects.friction.viscous_friction import ViscousFriction as ViscousFriction
    from drivetrain.effects.gear.backlash import Backlash as Backlash
    from drivetrain.effects.gear.flexible_joint import FlexibleJoint as FlexibleJoint
    from drivetrain.effects.gear.gear_drag import GearDrag as GearDrag
    from drivetrain.effects.gear.mesh_loss import MeshLoss as MeshLoss
    from drivetrain.effects.loads.given_torque import GivenTorque as GivenTorque
    from drivetrain.effects.loads.payload_change import Body as Body
    from drivetrain.effects.loads.payload_change import PayloadChange as PayloadChange
    from drivetrain.effects.loads.tip_contact import TipContact as TipContact
    from drivetrain.effects.loads.wall_spring import WallSpring as WallSpring
    from drivetrain.effects.motor.cogging import Cogging as Cogging
    from drivetrain.effects.motor.current_loop import CurrentLoop as CurrentLoop
    from drivetrain.effects.motor.given_current import GivenCurrent as GivenCurrent
    from drivetrain.effects.motor.given_voltage import GivenVoltage as GivenVoltage
    from drivetrain.effects.motor.motor_current import MotorCurrent as MotorCurrent
    from drivetrain.effects.motor.rotor import FullRotor as FullRotor
    from drivetrain.effects.motor.rotor import ReflectedRotor as ReflectedRotor
    from drivetrain.effects.motor.sampled_current_loop import SampledCurrentLoop as SampledCurrentLoop
    from drivetrain.effects.motor.supply_bus import StiffSupply as StiffSupply
    from drivetrain.effects.motor.supply_bus import SupplyBus as SupplyBus
    from drivetrain.effects.motor.winding import Winding as Winding
    from drivetrain.effects.motor.winding_heat import WindingHeat as WindingHeat
    from drivetrain.errors import DrivetrainError as DrivetrainError
    from drivetrain.errors import InputError as InputError
    from drivetrain.errors import PhysicsWarning as PhysicsWarning
    from drivetrain.export.current_scales import current_scales as current_scales
    from drivetrain.export.currents import write_currents as write_currents
    from drivetrain.export.limits import write_drive_urdf as write_drive_urdf
    from drivetrain.export.limits import write_physx as write_physx
    from drivetrain.export.limits import write_ros2 as write_ros2
    from drivetrain.export.mjcf import write_mjcf as write_mjcf
    from drivetrain.export.sdf import write_sdf as write_sdf
    from drivetrain.export.urdf import write_urdf as write_urdf
    from drivetrain.identification.exciting import exciting_motion as exciting_motion
    from drivetrain.identification.identify import Identification as Identification
    from drivetrain.identification.identify import identify as identify
    from drivetrain.identification.outputs import write_identification as write_identification
    from drivetrain.motion.mix import build_mix as build_mix
    from drivetrain.motion.motion import Motion as Motion
    from drivetrain.motion.recording import MeasuredMotion as MeasuredMotion
    from drivetrain.motion.recording import read_recording as read_recording
    from drivetrain.report.outputs import write_outputs as write_outputs
    from drivetrain.report.page import html_report as html_report
    from drivetrain.simulation.constrained import Baumgarte as Baumgarte
    from drivetrain.simulation.constrained import Projection as Projection
    from drivetrain.simulation.constrained import simulate_constrained as simulate_constrained
    from drivetrain.simulation.engines.adaptive_step import AdaptiveStep as AdaptiveStep
    from drivetrain.simulation.engines.fixed_step import FixedStep as FixedStep
    from drivetrain.simulation.engines.inverse import Inverse as Inverse
    from drivetrain.simulation.passive import simulate_passive as simulate_passive
    from drivetrain.simulation.plan.plan import Plan as Plan
    from drivetrain.simulation.plan.plan import plan as plan
    from drivetrain.simulation.recording import Recording as Recording
    from drivetrain.simulation.recording import load_recording as load_recording
    from drivetrain.simulation.scene import Inertia as Inertia
    from drivetrain.simulation.scene import Scene as Scene
    from drivetrain.simulation.scene import joint_scene as joint_scene
    from drivetrain.simulation.scene import without as without
    from drivetrain.simulation.study_scene import scene_of as scene_of
    from drivetrain.simulation.study_scene import with_feed_forward as with_feed_forward
    from drivetrain.sizing.answers.curve import OptimumCurve as OptimumCurve
    from drivetrain.sizing.answers.curve import optimum_curve as optimum_curve
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
    from drivetrain.sizing.judge.evaluate import evaluate as evaluate
    from drivetrain.sizing.judge.evaluate import evaluate_drives as evaluate_drives
    from drivetrain.sizing.judge.missing import gaps as gaps
    from drivetrain.sizing.results import DriveSet as DriveSet
    from drivetrain.sizing.search.front import Front as Front
    from drivetrain.sizing.search.front import pareto_front as pareto_front
    from drivetrain.sizing.search.robust import robust_select as robust_select
    from drivetrain.sizing.search.search import select as select
    from drivetrain.sizing.tolerance.monte_carlo import robustness as robustness
    from drivetrain.solvers.solver import DormandPrince853 as DormandPrince853
    from drivetrain.solvers.solver import Euler as Euler
    from drivetrain.solvers.solver import Rodas4 as Rodas4
    from drivetrain.solvers.solver import Rodas5P as Rodas5P
    from drivetrain.solvers.solver import RungeKutta4 as RungeKutta4
    from drivetrain.spatial.beams import Beam as Beam
    from drivetrain.spatial.free_motion import free_motion as free_motion
    from drivetrain.spatial.inertia import RigidBody as RigidBody
    from drivetrain.spatial.mesh_file import read_mesh as read_mesh
    from drivetrain.spatial.mesh_inertia import TriangleMesh as TriangleMesh
    from drivetrain.spatial.mesh_inertia import mesh_body as mesh_body
    from drivetrain.spatial.rigid_body import body_acceleration as body_acceleration
    from drivetrain.spatial.rigid_body import body_wrench as body_wrench
    from drivetrain.study.change import TaskChange as TaskChange
    from drivetrain.study.change import changed as changed
    from drivetrain.study.parts.selection import SelectionOptions as SelectionOptions
    from drivetrain.study.parts.selection import Wanted as Wanted
    from drivetrain.study.parts.tolerances import Tolerances as Tolerances
    from drivetrain.study.parts.verdicts import Verdict as Verdict
    from drivetrain.study.read import load_study as load_study
    from drivetrain.study.schema import json_schema as json_schema
    from drivetrain.sweep.points import read_sweep as read_sweep
    from drivetrain.sweep.run import run_sweep as run_sweep
    from drivetrain.sweep.shards import read_results as read_results

_HOME = {
    "simulate": "accuracy.study_run",
    "Arm": "arm.arm",
    "with_body": "arm.bodies",
    "with_payload": "arm.bodies",
    "book_lists": "arm.book_lists",
    "Closure": "arm.closures",
    "LoopLink": "arm.closures",
    "with_closures": "arm.closures",
    "belts_over": "arm.coupling",
    "differential": "arm.coupling",
    "with_coupling": "arm.coupling",
    "arm_from_dh": "arm.dh",
    "BendingLink": "arm.flexible_links",
    "with_flexible_links": "arm.flexible_links",
    "load_arm": "arm.load",
    "Rotor": "arm.rotors",
    "RotorLevel": "arm.rotors",
    "at_level": "arm.with_rotors",
    "with_rotors": "arm.with_rotors",
    "Price": "catalog.price",
    "read_catalog": "catalog.read",
    "Commander": "control.commander",
    "write_c": "control.c_code",
    "AmplifierSheet": "drive.amplifier",
    "Brake": "drive.brake",
    "book_curves": "drive.friction",
    "Friction": "drive.friction",
    "Gear": "drive.gear",
    "design_loops": "drive.loops.loop_design",
    "ServoAxis": "drive.loops.servo_axis",
    "ServoTiming": "drive.loops.servo_axis",
    "inertia_matching_ratio": "drive.matching",
    "Motor": "drive.motor",
    "thermal_network": "drive.thermal.thermal_network",
    "articulated_body": "dynamics.forward",
    "bias_torque": "dynamics.inverse",
    "tip_torque": "dynamics.inverse",
    "velocity_torque": "dynamics.inverse",
    "closed_form": "dynamics.book.closed_form",
    "mass_matrix_rate": "dynamics.book.closed_form",
    "ClosingJoint": "dynamics.constraints",
    "LoopClosure": "dynamics.constraints",
    "constrained_forward_dynamics": "dynamics.constrained",
    "constrained_inverse_dynamics": "dynamics.constrained",
    "constraint_projectors": "dynamics.constrained",
    "Attachment": "dynamics.constraints",
    "Plane": "dynamics.constraints",
    "PointOnSurface": "dynamics.constraints",
    "christoffel_symbols": "dynamics.coriolis",
    "coriolis_matrix": "dynamics.coriolis",
    "acceleration_ellipsoid": "dynamics.book.ellipsoids",
    "effective_mass": "dynamics.book.ellipsoids",
    "tip_acceleration_ellipsoid": "dynamics.book.ellipsoids",
    "tip_force_ellipsoid": "dynamics.book.ellipsoids",
    "torque_ellipsoid": "dynamics.book.ellipsoids",
    "free_frequencies": "dynamics.flexibility",
    "locked_frequencies": "dynamics.flexibility",
    "tip_compliance": "dynamics.flexibility",
    "forward_dynamics": "dynamics.forward",
    "torque_from_positions": "dynamics.from_positions",
    "body_jacobian_rate": "dynamics.kinematics",
    "space_jacobian_rate": "dynamics.kinematics",
    "body_jacobian": "dynamics.kinematics",
    "link_poses": "dynamics.kinematics",
    "space_jacobian": "dynamics.kinematics",
    "tip_pose": "dynamics.kinematics",
    "AccelerationDerivatives": "dynamics.derivatives",
    "TorqueDerivatives": "dynamics.derivatives",
    "forward_dynamics_derivatives": "dynamics.derivatives",
    "inverse_dynamics_derivatives": "dynamics.derivatives",
    "kinetic_energy": "dynamics.energy",
    "potential_energy": "dynamics.energy",
    "power_balance": "dynamics.energy",
    "mass_matrix": "dynamics.mass_matrix",
    "drive_torques": "dynamics.inverse",
    "DriveTorques": "dynamics.inverse",
    "gravity_torque": "dynamics.inverse",
    "inverse_dynamics": "dynamics.inverse",
    "joint_loads": "dynamics.inverse",
    "sweep_ratio": "dynamics.book.ratio_sweep",
    "symbolic_dynamics": "dynamics.book.symbolic",
    "parameter_names": "dynamics.regressor",
    "torque_parameters": "dynamics.regressor",
    "torque_regressor": "dynamics.regressor",
    "task_space_dynamics": "dynamics.task_space",
    "Backlash": "effects.gear.backlash",
    "CascadeLoop": "effects.control.cascade_loop",
    "Cogging": "effects.motor.cogging",
    "CommandedMotion": "effects.control.commanded_motion",
    "ComputedTorque": "effects.control.computed_torque",
    "CurrentLoop": "effects.motor.current_loop",
    "DryFriction": "effects.friction.dry_friction",
    "Effect": "effects.effect",
    "Encoder": "effects.control.encoder",
    "FlexibleJoint": "effects.gear.flexible_joint",
    "GearDrag": "effects.gear.gear_drag",
    "GivenCurrent": "effects.motor.given_current",
    "GivenTorque": "effects.loads.given_torque",
    "GivenVoltage": "effects.motor.given_voltage",
    "HoldingBrake": "effects.friction.holding_brake",
    "LuGreFriction": "effects.friction.lugre_friction",
    "MeshLoss": "effects.gear.mesh_loss",
    "MotorCurrent": "effects.motor.motor_current",
    "MovingBelt": "effects.friction.moving_belt",
    "Body": "effects.loads.payload_change",
    "PayloadChange": "effects.loads.payload_change",
    "PositionLoop": "effects.control.position_loop",
    "FullRotor": "effects.motor.rotor",
    "ReflectedRotor": "effects.motor.rotor",
    "SampledCascade": "effects.control.sampled_cascade",
    "SampledComputedTorque": "effects.control.computed_torque",
    "SampledCurrentLoop": "effects.motor.sampled_current_loop",
    "StiffSupply": "effects.motor.supply_bus",
    "SupplyBus": "effects.motor.supply_bus",
    "TipContact": "effects.loads.tip_contact",
    "ViscousFriction": "effects.friction.viscous_friction",
    "WallSpring": "effects.loads.wall_spring",
    "Winding": "effects.motor.winding",
    "WindingHeat": "effects.motor.winding_heat",
    "DrivetrainError": "errors",
    "InputError": "errors",
    "PhysicsWarning": "errors",
    "current_scales": "export.current_scales",
    "write_currents": "export.currents",
    "write_drive_urdf": "export.limits",
    "write_physx": "export.limits",
    "write_ros2": "export.limits",
    "write_mjcf": "export.mjcf",
    "write_sdf": "export.sdf",
    "write_urdf": "export.urdf",
    "exciting_motion": "identification.exciting",
    "Identification": "identification.identify",
    "identify": "identification.identify",
    "write_identification": "identification.outputs",
    "MeasuredMotion": "motion.recording",
    "read_recording": "motion.recording",
    "build_mix": "motion.mix",
    "Motion": "motion.motion",
    "write_outputs": "report.outputs",
    "html_report": "report.page",
    "AdaptiveStep": "simulation.engines.adaptive_step",
    "simulate_constrained": "simulation.constrained",
    "FixedStep": "simulation.engines.fixed_step",
    "Inverse": "simulation.engines.inverse",
    "simulate_passive": "simulation.passive",
    "Plan": "simulation.plan.plan",
    "plan": "simulation.plan.plan",
    "load_recording": "simulation.recording",
    "Recording": "simulation.recording",
    "Inertia": "simulation.scene",
    "joint_scene": "simulation.scene",
    "Scene": "simulation.scene",
    "without": "simulation.scene",
    "Baumgarte": "simulation.constrained",
    "Projection": "simulation.constrained",
    "scene_of": "simulation.study_scene",
    "with_feed_forward": "simulation.study_scene",
    "current_commands": "sizing.currents",
    "OptimumCurve": "sizing.answers.curve",
    "optimum_curve": "sizing.answers.curve",
    "tip_deflection": "sizing.deflection",
    "vibration": "sizing.deflection",
    "evaluate": "sizing.judge.evaluate",
    "evaluate_drives": "sizing.judge.evaluate",
    "fastest": "sizing.answers.fastest",
    "Fastest": "sizing.answers.fastest",
    "free_ratios": "sizing.answers.free_ratio",
    "FreeRatios": "sizing.answers.free_ratio",
    "Front": "sizing.search.front",
    "pareto_front": "sizing.search.front",
    "gaps": "sizing.judge.missing",
    "ratio_studies": "sizing.answers.ratio",
    "ratio_study": "sizing.answers.ratio",
    "DriveSet": "sizing.results",
    "robust_select": "sizing.search.robust",
    "select": "sizing.search.search",
    "trade_offs": "sizing.answers.trade_offs",
    "robustness": "sizing.tolerance.monte_carlo",
    "why_not": "sizing.answers.why_not",
    "WhyNot": "sizing.answers.why_not",
    "DormandPrince853": "solvers.solver",
    "Euler": "solvers.solver",
    "RungeKutta4": "solvers.solver",
    "Rodas4": "solvers.solver",
    "Rodas5P": "solvers.solver",
    "Beam": "spatial.beams",
    "free_motion": "spatial.free_motion",
    "RigidBody": "spatial.inertia",
    "read_mesh": "spatial.mesh_file",
    "mesh_body": "spatial.mesh_inertia",
    "TriangleMesh": "spatial.mesh_inertia",
    "body_acceleration": "spatial.rigid_body",
    "body_wrench": "spatial.rigid_body",
    "changed": "study.change",
    "TaskChange": "study.change",
    "load_study": "study.read",
    "json_schema": "study.schema",
    "SelectionOptions": "study.parts.selection",
    "Wanted": "study.parts.selection",
    "Tolerances": "study.parts.tolerances",
    "Verdict": "study.parts.verdicts",
    "read_sweep": "sweep.points",
    "run_sweep": "sweep.run",
    "read_results": "sweep.shards",
}

_ROOMS = ("study",)  # folders that are names themselves

__all__ = sorted([*_HOME, *_ROOMS, "__version__"])


def __getattr__(name: str) -> Any:
    """The public name, imported from the module it lives in, and kept."""
    if name in _ROOMS:
        return import_module(f"drivetrain.{name}")
    if name not in _HOME:
        raise AttributeError(f"module 'drivetrain' has no attribute {name!r}")
    found = getattr(import_module(f"drivetrain.{_HOME[name]}"), name)
    globals()[name] = guarded(found, __name__) if isinstance(found, FunctionType) else found
    return globals()[name]


def __dir__() -> list[str]:
    """The public names."""
    return __all__
