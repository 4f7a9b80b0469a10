"""Arms and drives written out for other tools: each format in a file of its own."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.export.currents import write_currents as write_currents
    from drivetrain.export.fmu import write_fmu as write_fmu
    from drivetrain.export.limits import write_drive_urdf as write_drive_urdf
    from drivetrain.export.limits import write_physx as write_physx
    from drivetrain.export.limits import write_ros2 as write_ros2
    from drivetrain.export.mjcf import write_mjcf as write_mjcf
    from drivetrain.export.scales import current_scales as current_scales
    from drivetrain.export.sdf import write_sdf as write_sdf
    from drivetrain.export.urdf import write_urdf as write_urdf

__getattr__, __dir__ = shown(__name__)
