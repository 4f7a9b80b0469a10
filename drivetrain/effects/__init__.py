"""Physical effects of a simulation, one per file; effects exchange signals and do not know one another."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.effects import connectors, laws, signals
    from drivetrain.effects.control.cascade import CascadeLoop, PositionLoop, SampledCascade
    from drivetrain.effects.control.commanded_motion import CommandedMotion
    from drivetrain.effects.control.computed_torque import ComputedTorque, SampledComputedTorque
    from drivetrain.effects.control.encoder import Encoder
    from drivetrain.effects.control.preload import Preload
    from drivetrain.effects.effect import Effect, Place, Ports, Role, Shape, Signal, State, TimeScale
    from drivetrain.effects.friction.dry_friction import DryFriction
    from drivetrain.effects.friction.holding_brake import HoldingBrake
    from drivetrain.effects.friction.lugre_friction import LuGreFriction
    from drivetrain.effects.friction.moving_belt import MovingBelt
    from drivetrain.effects.friction.viscous_friction import ViscousFriction
    from drivetrain.effects.gear.gear_drag import GearDrag
    from drivetrain.effects.gear.mesh_loss import MeshLoss
    from drivetrain.effects.gear.springs import Backlash, FlexibleJoint
    from drivetrain.effects.loads.given_torque import GivenTorque
    from drivetrain.effects.loads.payload_change import Body, PayloadChange
    from drivetrain.effects.loads.tip_contact import TipContact
    from drivetrain.effects.loads.tip_force import TipForce
    from drivetrain.effects.loads.wall_spring import WallSpring
    from drivetrain.effects.motor.cogging import Cogging
    from drivetrain.effects.motor.current_loop import CurrentLoop, SampledCurrentLoop
    from drivetrain.effects.motor.given import GivenCurrent, GivenVoltage
    from drivetrain.effects.motor.motor_current import MotorCurrent
    from drivetrain.effects.motor.rotor import FullRotor, ReflectedRotor
    from drivetrain.effects.motor.supply_bus import StiffSupply, SupplyBus
    from drivetrain.effects.motor.winding import Winding
    from drivetrain.effects.motor.winding_heat import WindingHeat

__getattr__, __dir__ = shown(__name__)
