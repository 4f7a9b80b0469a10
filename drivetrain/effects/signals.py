"""The signals between effects and mechanics: names and units, one place for all effects to agree on.

Those of a joint; torques at a sliding joint are forces [N], angles lengths [m]. Coordinates of the joint count at the
joint, motor coordinates at the motor's shaft.
"""

from __future__ import annotations

from drivetrain.effects.effect import Place, Signal

# Known before any effect is computed.
POSITION = Signal("position", "rad")
SPEED = Signal("speed", "rad/s")
MOTOR_POSITION = Signal("motor_position", "rad")
MOTOR_SPEED = Signal("motor_speed", "rad/s")
DEFLECTION = Signal("deflection", "rad")  # of a flexible joint: motor angle behind the gear, less joint angle
DEFLECTION_SPEED = Signal("deflection_speed", "rad/s")
BIAS_TORQUE = Signal("bias_torque", "N m")  # what gravity and speeds ask of the joint

# Where motors are coupled (``arm/coupling.py``): of the shaft behind this joint's gear. Dry friction of such a joint,
# its mesh, its bias torque and its mass matrix's row are those of the shaft too.
SHAFT_POSITION = Signal("shaft_position", "rad")
SHAFT_SPEED = Signal("shaft_speed", "rad/s")
SHAFT_TORQUE = Signal("shaft_torque", "N m")
SHAFT_DAMPING = Signal("shaft_damping", "N m s/rad")
SHAFT_STIFFNESS = Signal("shaft_stiffness", "N m/rad")

# Added to by effects, taken by the mechanics: smooth torques, and how they fall with speed and position.
JOINT_TORQUE = Signal("joint_torque", "N m")  # on the link, pushing it forward
JOINT_DAMPING = Signal("joint_damping", "N m s/rad")
JOINT_STIFFNESS = Signal("joint_stiffness", "N m/rad")
MOTOR_TORQUE = Signal("motor_torque", "N m")  # on the rotor
MOTOR_DAMPING = Signal("motor_damping", "N m s/rad")
MOTOR_STIFFNESS = Signal("motor_stiffness", "N m/rad")
GEAR_TORQUE = Signal("gear_torque", "N m")  # through the spring of a flexible joint, pushing the link forward
GEAR_DAMPING = Signal("gear_damping", "N m s/rad")
GEAR_STIFFNESS = Signal("gear_stiffness", "N m/rad")

# Bounds of set-valued friction, all positive: what holds at rest, and what slides, for either direction of motion.
JOINT_HOLD_FORWARD = Signal("joint_hold_forward", "N m")
JOINT_HOLD_BACKWARD = Signal("joint_hold_backward", "N m")
JOINT_SLIDE_FORWARD = Signal("joint_slide_forward", "N m")
JOINT_SLIDE_BACKWARD = Signal("joint_slide_backward", "N m")
MOTOR_HOLD_FORWARD = Signal("motor_hold_forward", "N m")
MOTOR_HOLD_BACKWARD = Signal("motor_hold_backward", "N m")
MOTOR_SLIDE_FORWARD = Signal("motor_slide_forward", "N m")
MOTOR_SLIDE_BACKWARD = Signal("motor_slide_backward", "N m")
MESH_DRIVING = Signal("mesh_driving", "-")  # loss over transmitted torque, power to the load
MESH_DRIVEN = Signal("mesh_driven", "-")  # the same, power from the load; 1 or more locks
SURFACE_SPEED = Signal("surface_speed", "rad/s")  # of what the joint rubs on
MOTOR_SURFACE_SPEED = Signal("motor_surface_speed", "rad/s", default=0.0)  # that of a motor's bearings: they rest

# Told by the mechanics once motion and forces are known.
ACCELERATION = Signal("acceleration", "rad/s^2")
MOTOR_ACCELERATION = Signal("motor_acceleration", "rad/s^2")
JOINT_FRICTION = Signal("joint_friction", "N m")  # taken from the link by dry friction
MOTOR_FRICTION = Signal("motor_friction", "N m")
MESH_TORQUE = Signal("mesh_torque", "N m")  # through the mesh, at the output
MESH_LOSS = Signal("mesh_loss", "N m")  # lost in it, at the output
JOINT_FRICTION_POWER = Signal("joint_friction_power", "W")
MOTOR_FRICTION_POWER = Signal("motor_friction_power", "W")
MESH_POWER = Signal("mesh_power", "W")
MOTOR_VISCOUS_POWER = Signal("motor_viscous_power", "W")  # told by viscous friction there

# Between effects.
COMMAND_POSITION = Signal("command_position", "rad")
COMMAND_SPEED = Signal("command_speed", "rad/s")
COMMAND_ACCELERATION = Signal("command_acceleration", "rad/s^2")
SHAFT_COMMAND_POSITION = Signal("shaft_command_position", "rad")  # where motors are coupled: of the shaft
SHAFT_COMMAND_SPEED = Signal("shaft_command_speed", "rad/s")
SHAFT_COMMAND_ACCELERATION = Signal("shaft_command_acceleration", "rad/s^2")
MEASURED_POSITION = Signal("measured_position", "rad")  # the motor's, as an encoder sees it
CURRENT_COMMAND = Signal("current_command", "A")  # added to by controllers and feed-forward
CURRENT_DAMPING = Signal("current_damping", "A s/rad", default=0.0)  # how that falls with the motor's speed
CURRENT_STIFFNESS = Signal("current_stiffness", "A/rad", default=0.0)  # and with its position
CURRENT = Signal("current", "A")
VOLTAGE = Signal("voltage", "V")  # between the motor's terminals
VOLTAGE_LIMIT = Signal("voltage_limit", "V", default=float("inf"))
WINDING_TEMPERATURE = Signal("winding_temperature", "C")
HOUSING_TEMPERATURE = Signal("housing_temperature", "C")
COPPER_LOSS = Signal("copper_loss", "W")
ELECTRICAL_POWER = Signal("electrical_power", "W")
MAGNETIC_ENERGY = Signal("magnetic_energy", "J")

BEFORE = (POSITION, SPEED, MOTOR_POSITION, MOTOR_SPEED, DEFLECTION, DEFLECTION_SPEED, BIAS_TORQUE)
TAKEN = (
    JOINT_TORQUE, JOINT_DAMPING, JOINT_STIFFNESS, MOTOR_TORQUE, MOTOR_DAMPING, MOTOR_STIFFNESS,
    GEAR_TORQUE, GEAR_DAMPING, GEAR_STIFFNESS,
    JOINT_HOLD_FORWARD, JOINT_HOLD_BACKWARD, JOINT_SLIDE_FORWARD, JOINT_SLIDE_BACKWARD,
    MOTOR_HOLD_FORWARD, MOTOR_HOLD_BACKWARD, MOTOR_SLIDE_FORWARD, MOTOR_SLIDE_BACKWARD,
    MESH_DRIVING, MESH_DRIVEN, SURFACE_SPEED,
)  # fmt: skip
AFTER = (
    ACCELERATION, MOTOR_ACCELERATION, JOINT_FRICTION, MOTOR_FRICTION, MESH_TORQUE, MESH_LOSS,
    JOINT_FRICTION_POWER, MOTOR_FRICTION_POWER, MESH_POWER,
)  # fmt: skip

SHAFT_GIVEN = (SHAFT_POSITION, SHAFT_SPEED)
SHAFT_TAKEN = (SHAFT_TORQUE, SHAFT_DAMPING, SHAFT_STIFFNESS)
SHAFT_COMMANDS = (SHAFT_COMMAND_POSITION, SHAFT_COMMAND_SPEED, SHAFT_COMMAND_ACCELERATION)

# Of the whole mechanics, told at instants only.
KINETIC_ENERGY = Signal("scene.kinetic_energy", "J")
POTENTIAL_ENERGY = Signal("scene.potential_energy", "J")

# Of the tip, along the axes of the base: known before; and what the surroundings do to it.
TIP_GIVEN = (
    *(Signal(f"scene.tip_{axis}", "m") for axis in "xyz"),
    *(Signal(f"scene.tip_speed_{axis}", "m/s") for axis in "xyz"),
    *(Signal(f"scene.tip_turning_{axis}", "rad/s") for axis in "xyz"),
)
TIP_TAKEN = (
    *(Signal(f"scene.tip_force_{axis}", "N") for axis in "xyz"),
    *(Signal(f"scene.tip_moment_{axis}", "N m") for axis in "xyz"),
    *(Signal(f"scene.tip_damping_{axes}", "N s/m") for axes in ("xx", "xy", "xz", "yy", "yz", "zz")),
    *(Signal(f"scene.tip_stiffness_{axes}", "N/m") for axes in ("xx", "xy", "xz", "yy", "yz", "zz")),
)


def commanded(place: Place) -> tuple[Signal, Signal, Signal]:
    """What a motor's loop is told to follow: the joint's command, or its shaft's where motors are coupled."""
    return SHAFT_COMMANDS if place.coupled else (COMMAND_POSITION, COMMAND_SPEED, COMMAND_ACCELERATION)


def motion(place: Place) -> tuple[Signal, Signal]:
    """What a joint does along its coordinate: its shaft where motors are coupled."""
    return SHAFT_GIVEN if place.coupled else (POSITION, SPEED)


def of_side(side: str, place: Place) -> tuple[Signal, Signal, Signal]:
    """What friction at a side of the gear reads and adds to."""
    if side == "motor":
        return MOTOR_SPEED, MOTOR_TORQUE, MOTOR_DAMPING
    if side == "shaft" and place.coupled:
        return SHAFT_SPEED, SHAFT_TORQUE, SHAFT_DAMPING
    return SPEED, JOINT_TORQUE, JOINT_DAMPING
