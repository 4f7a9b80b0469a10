"""Descriptions and physical laws of a joint's drive: motor, gear, friction, heat, amplifier, brake."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.drive.amplifier import Amplifier, AmplifierSheet, CurrentBasis, Supply, from_dc, to_dc
    from drivetrain.drive.brake import Brake
    from drivetrain.drive.counterbalance import Counterbalance, counterbalance_torque
    from drivetrain.drive.drive import Drive, book_current, motor_torque
    from drivetrain.drive.friction import Friction, book_curves, breakaway_torque, friction_torque
    from drivetrain.drive.gear import (
        Gear,
        average_torque,
        gear_life,
        mesh_input_torque,
        momentary_peak_count,
        standstill_interval,
    )
    from drivetrain.drive.loops.loop_design import design_loops
    from drivetrain.drive.loops.servo_axis import ServoAxis, ServoTiming
    from drivetrain.drive.matching import inertia_matching_ratio
    from drivetrain.drive.motor import (
        Motor,
        exact_current_step,
        no_load_speed,
        stall_torque,
        terminal_voltage,
        torque_constant,
        winding_resistance,
    )
    from drivetrain.drive.motor_limits import (
        continuous_current,
        continuous_region,
        operating_region,
        peak_current,
        torque_limits,
    )
    from drivetrain.drive.spring import tangent_stiffness, wind_up
    from drivetrain.drive.stages import Chain, Stage, chained, with_stages
    from drivetrain.drive.thermal.heat import periodic_temperature, temperature_of_current
    from drivetrain.drive.thermal.thermal_network import thermal_network
    from drivetrain.drive.thermal.warm_up import warm_up

__getattr__, __dir__ = shown(__name__)
