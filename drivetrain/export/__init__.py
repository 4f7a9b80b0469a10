"""Export of arms and drives to the formats of other tools, one module per format."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.export.currents import current_scales, write_currents
    from drivetrain.export.fmu import write_fmu
    from drivetrain.export.limits import write_drive_urdf, write_physx, write_ros2
    from drivetrain.export.mjcf import write_mjcf
    from drivetrain.export.sdf import write_sdf
    from drivetrain.export.urdf import UrdfJointData, write_urdf

__getattr__, __dir__ = shown(__name__)
