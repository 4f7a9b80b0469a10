"""Effects: one physical effect a file, each knowing nothing of the others."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.effects import connectors as connectors
    from drivetrain.effects import laws as laws
    from drivetrain.effects import signals as signals
    from drivetrain.effects.control.cascade import CascadeLoop as CascadeLoop
    from drivetrain.effects.control.cascade import PositionLoop as PositionLoop
    from drivetrain.effects.control.cascade import SampledCascade as SampledCascade
    from drivetrain.effects.control.commanded_motion import CommandedMotion as CommandedMotion
    from drivetrain.effects.control.computed_torque import ComputedTorque as ComputedTorque
    from drivetrain.effects.control.computed_torque import SampledComputedTorque as SampledComputedTorque
    from drivetrain.effects.control.encoder import Encoder as Encoder
    from drivetrain.effects.effect import Effect as Effect
    from drivetrain.effects.effect import Place as Place
    from drivetrain.effects.effect import Ports as Ports
    from drivetrain.effects.effect import Role as Role
    from drivetrain.effects.effect import Shape as Shape
    from drivetrain.effects.effect import Signal as Signal
    from drivetrain.effects.effect import State as State
    from drivetrain.effects.effect import TimeScale as TimeScale
    from drivetrain.effects.friction.dry_friction import DryFriction as DryFriction
    from drivetrain.effects.friction.holding_brake import HoldingBrake as HoldingBrake
    from drivetrain.effects.friction.lugre_friction import LuGreFriction as LuGreFriction
    from drivetrain.effects.friction.moving_belt import MovingBelt as MovingBelt
    from drivetrain.effects.friction.viscous_friction import ViscousFriction as ViscousFriction
    from drivetrain.effects.gear.gear_drag import GearDrag as GearDrag
    from drivetrain.effects.gear.mesh_loss import MeshLoss as MeshLoss
    from drivetrain.effects.gear.springs import Backlash as Backlash
    from drivetrain.effects.gear.springs import FlexibleJoint as FlexibleJoint
    from drivetrain.effects.loads.given_torque import GivenTorque as GivenTorque
    from drivetrain.effects.loads.payload_change import Body as Body
    from drivetrain.effects.loads.payload_change import PayloadChange as PayloadChange
    from drivetrain.effects.loads.tip_contact import TipContact as TipContact
    from drivetrain.effects.loads.wall_spring import WallSpring as WallSpring
    from drivetrain.effects.motor.cogging import Cogging as Cogging
    from drivetrain.effects.motor.current_loop import CurrentLoop as CurrentLoop
    from drivetrain.effects.motor.current_loop import SampledCurrentLoop as SampledCurrentLoop
    from drivetrain.effects.motor.given import GivenCurrent as GivenCurrent
    from drivetrain.effects.motor.given import GivenVoltage as GivenVoltage
    from drivetrain.effects.motor.motor_current import MotorCurrent as MotorCurrent
    from drivetrain.effects.motor.rotor import FullRotor as FullRotor
    from drivetrain.effects.motor.rotor import ReflectedRotor as ReflectedRotor
    from drivetrain.effects.motor.supply_bus import StiffSupply as StiffSupply
    from drivetrain.effects.motor.supply_bus import SupplyBus as SupplyBus
    from drivetrain.effects.motor.winding import Winding as Winding
    from drivetrain.effects.motor.winding_heat import WindingHeat as WindingHeat

__getattr__, __dir__ = shown(__name__)
