"""The laws of one drive: motor, gear, friction, heat and amplifier, each standing once."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.drive.amplifier import Amplifier as Amplifier
    from drivetrain.drive.amplifier import AmplifierSheet as AmplifierSheet
    from drivetrain.drive.amplifier import CurrentBasis as CurrentBasis
    from drivetrain.drive.amplifier import Supply as Supply
    from drivetrain.drive.amplifier import from_dc as from_dc
    from drivetrain.drive.amplifier import to_dc as to_dc
    from drivetrain.drive.brake import Brake as Brake
    from drivetrain.drive.counterbalance import Counterbalance as Counterbalance
    from drivetrain.drive.counterbalance import counterbalance_torque as counterbalance_torque
    from drivetrain.drive.drive import Drive as Drive
    from drivetrain.drive.drive import book_current as book_current
    from drivetrain.drive.drive import motor_torque as motor_torque
    from drivetrain.drive.friction import Friction as Friction
    from drivetrain.drive.friction import book_curves as book_curves
    from drivetrain.drive.friction import breakaway_torque as breakaway_torque
    from drivetrain.drive.friction import friction_torque as friction_torque
    from drivetrain.drive.gear import Gear as Gear
    from drivetrain.drive.gear import average_torque as average_torque
    from drivetrain.drive.gear import gear_life as gear_life
    from drivetrain.drive.gear import mesh_input_torque as mesh_input_torque
    from drivetrain.drive.gear import momentary_peak_count as momentary_peak_count
    from drivetrain.drive.gear import standstill_interval as standstill_interval
    from drivetrain.drive.loops.loop_design import design_loops as design_loops
    from drivetrain.drive.loops.servo_axis import ServoAxis as ServoAxis
    from drivetrain.drive.loops.servo_axis import ServoTiming as ServoTiming
    from drivetrain.drive.matching import inertia_matching_ratio as inertia_matching_ratio
    from drivetrain.drive.motor import Motor as Motor
    from drivetrain.drive.motor import exact_current_step as exact_current_step
    from drivetrain.drive.motor import no_load_speed as no_load_speed
    from drivetrain.drive.motor import stall_torque as stall_torque
    from drivetrain.drive.motor import terminal_voltage as terminal_voltage
    from drivetrain.drive.motor import torque_constant as torque_constant
    from drivetrain.drive.motor import winding_resistance as winding_resistance
    from drivetrain.drive.motor_limits import continuous_current as continuous_current
    from drivetrain.drive.motor_limits import continuous_region as continuous_region
    from drivetrain.drive.motor_limits import operating_region as operating_region
    from drivetrain.drive.motor_limits import peak_current as peak_current
    from drivetrain.drive.motor_limits import torque_limits as torque_limits
    from drivetrain.drive.spring import tangent_stiffness as tangent_stiffness
    from drivetrain.drive.spring import wind_up as wind_up
    from drivetrain.drive.stages import Chain as Chain
    from drivetrain.drive.stages import Stage as Stage
    from drivetrain.drive.stages import chained as chained
    from drivetrain.drive.stages import with_stages as with_stages
    from drivetrain.drive.thermal.heat import periodic_temperature as periodic_temperature
    from drivetrain.drive.thermal.heat import temperature_of_current as temperature_of_current
    from drivetrain.drive.thermal.thermal_network import thermal_network as thermal_network
    from drivetrain.drive.thermal.warm_up import warm_up as warm_up

__getattr__, __dir__ = shown(__name__)
