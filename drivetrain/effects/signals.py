"""The signals between effects and mechanics: names and units, one place for all effects to agree on.

Those of a joint; torques at a sliding joint are forces [N], angles lengths [m]. Coordinates of the joint count at the
joint, motor coordinates at the motor's shaft.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from drivetrain.drive.motor import Motor
from drivetrain.effects.effect import Place, Role, Signal

# Known before any effect is computed.
POSITION = Signal("position", "rad", path="load.position")
SPEED = Signal("speed", "rad/s", path="load.speed")
MOTOR_POSITION = Signal("motor_position", "rad", path="motor.position")
MOTOR_SPEED = Signal("motor_speed", "rad/s", path="motor.speed")
DEFLECTION = Signal(
    "deflection", "rad", path="spring.wind_up"
)  # of a flexible joint: motor angle behind the gear, less joint angle
DEFLECTION_SPEED = Signal("deflection_speed", "rad/s", path="spring.speed")
BIAS_TORQUE = Signal("bias_torque", "N m", path="bias_torque")  # what gravity and speeds ask of the joint

# Where motors are coupled (``arm/coupling.py``): of the shaft behind this joint's gear. Dry friction of such a joint,
# its mesh, its bias torque and its mass matrix's row are those of the shaft too.
SHAFT_POSITION = Signal("shaft_position", "rad", path="shaft.position")
SHAFT_SPEED = Signal("shaft_speed", "rad/s", path="shaft.speed")
SHAFT_TORQUE = Signal("shaft_torque", "N m", path="shaft.torque")
SHAFT_DAMPING = Signal("shaft_damping", "N m s/rad", path="shaft.damping")
SHAFT_STIFFNESS = Signal("shaft_stiffness", "N m/rad", path="shaft.stiffness")

# Added to by effects, taken by the mechanics: smooth torques, and how they fall with speed and position.
JOINT_TORQUE = Signal("joint_torque", "N m", path="load.torque")  # on the link, pushing it forward
JOINT_DAMPING = Signal("joint_damping", "N m s/rad", path="load.damping")
JOINT_STIFFNESS = Signal("joint_stiffness", "N m/rad", path="load.stiffness")
MOTOR_TORQUE = Signal("motor_torque", "N m", path="motor.torque")  # on the rotor
MOTOR_DAMPING = Signal("motor_damping", "N m s/rad", path="motor.damping")
MOTOR_STIFFNESS = Signal("motor_stiffness", "N m/rad", path="motor.stiffness")
GEAR_TORQUE = Signal(
    "gear_torque", "N m", path="spring.torque"
)  # through the spring of a flexible joint, pushing the link forward
GEAR_DAMPING = Signal("gear_damping", "N m s/rad", path="spring.damping")
GEAR_STIFFNESS = Signal("gear_stiffness", "N m/rad", path="spring.stiffness")

# Bounds of set-valued friction, all positive: what holds at rest, and what slides, for either direction of motion.
JOINT_HOLD_FORWARD = Signal("joint_hold_forward", "N m", path="load.hold_forward")
JOINT_HOLD_BACKWARD = Signal("joint_hold_backward", "N m", path="load.hold_backward")
JOINT_SLIDE_FORWARD = Signal("joint_slide_forward", "N m", path="load.slide_forward")
JOINT_SLIDE_BACKWARD = Signal("joint_slide_backward", "N m", path="load.slide_backward")
MOTOR_HOLD_FORWARD = Signal("motor_hold_forward", "N m", path="motor.hold_forward")
MOTOR_HOLD_BACKWARD = Signal("motor_hold_backward", "N m", path="motor.hold_backward")
MOTOR_SLIDE_FORWARD = Signal("motor_slide_forward", "N m", path="motor.slide_forward")
MOTOR_SLIDE_BACKWARD = Signal("motor_slide_backward", "N m", path="motor.slide_backward")
MESH_DRIVING = Signal("mesh_driving", "-", path="mesh.driving")  # loss over transmitted torque, power to the load
MESH_DRIVEN = Signal("mesh_driven", "-", path="mesh.driven")  # the same, power from the load; 1 or more locks
SURFACE_SPEED = Signal(
    "surface_speed", "rad/s", path="load.surface_speed"
)  # of the surface against which the joint slides
MOTOR_SURFACE_SPEED = Signal(
    "motor_surface_speed", "rad/s", default=0.0, path="motor.surface_speed"
)  # that of a motor's bearings: they rest

# Provided by the mechanics once motion and forces are known.
ACCELERATION = Signal("acceleration", "rad/s^2", path="load.acceleration")
MOTOR_ACCELERATION = Signal("motor_acceleration", "rad/s^2", path="motor.acceleration")
JOINT_FRICTION = Signal("joint_friction", "N m", path="load.friction")  # taken from the link by dry friction
MOTOR_FRICTION = Signal("motor_friction", "N m", path="motor.friction")
MESH_TORQUE = Signal("mesh_torque", "N m", path="mesh.torque")  # through the mesh, at the output
MESH_LOSS = Signal("mesh_loss", "N m", path="mesh.loss")  # lost in it, at the output
JOINT_FRICTION_POWER = Signal("joint_friction_power", "W", path="load.friction_power")
MOTOR_FRICTION_POWER = Signal("motor_friction_power", "W", path="motor.friction_power")
MESH_POWER = Signal("mesh_power", "W", path="mesh.power")
MOTOR_VISCOUS_POWER = Signal(
    "motor_viscous_power", "W", path="heat.viscous_power"
)  # provided by viscous friction there

# Between effects.
COMMAND_POSITION = Signal("command_position", "rad", path="command.position")
COMMAND_SPEED = Signal("command_speed", "rad/s", path="command.speed")
COMMAND_ACCELERATION = Signal("command_acceleration", "rad/s^2", path="command.acceleration")
SHAFT_COMMAND_POSITION = Signal(
    "shaft_command_position", "rad", path="shaft_command.position"
)  # where motors are coupled: of the shaft
SHAFT_COMMAND_SPEED = Signal("shaft_command_speed", "rad/s", path="shaft_command.speed")
SHAFT_COMMAND_ACCELERATION = Signal("shaft_command_acceleration", "rad/s^2", path="shaft_command.acceleration")
MEASURED_POSITION = Signal("measured_position", "rad", path="measured_position")  # the motor's, as an encoder sees it
CURRENT_COMMAND = Signal("current_command", "A", path="pin.command")  # added to by controllers and feed-forward
CURRENT_DAMPING = Signal(
    "current_damping", "A s/rad", default=0.0, path="pin.damping"
)  # how that falls with the motor's speed
CURRENT_STIFFNESS = Signal("current_stiffness", "A/rad", default=0.0, path="pin.stiffness")  # and with its position
CURRENT = Signal("current", "A", path="pin.current")
VOLTAGE = Signal("voltage", "V", path="pin.voltage")  # between the motor's terminals
VOLTAGE_LIMIT = Signal("voltage_limit", "V", default=float("inf"), path="pin.limit")
WINDING_TEMPERATURE = Signal("winding_temperature", "C", path="heat.winding")
HOUSING_TEMPERATURE = Signal("housing_temperature", "C", path="heat.housing")
GEAR_TEMPERATURE = Signal("gear_temperature", "C", path="heat.gear")
GEAR_DRAG_POWER = Signal(
    "gear_drag_power", "W", path="heat.drag_power"
)  # share of the motor's dry friction that is the gear's drag
COPPER_LOSS = Signal("copper_loss", "W", path="heat.copper_loss", role=Role.LOSS)
ELECTRICAL_POWER = Signal("electrical_power", "W", path="pin.power", role=Role.SOURCE)
MAGNETIC_ENERGY = Signal("magnetic_energy", "J", path="pin.magnetic_energy", role=Role.STORE)

# Provided to effects at the start of a run only [A]: what holds the load at rest, and what is fed forward beside the
# loops.
HOLDING_CURRENT = "holding_current"
FED_CURRENT = "fed_current"

JOINT_BOUNDS = (JOINT_HOLD_FORWARD, JOINT_HOLD_BACKWARD, JOINT_SLIDE_FORWARD, JOINT_SLIDE_BACKWARD)
MOTOR_BOUNDS = (MOTOR_HOLD_FORWARD, MOTOR_HOLD_BACKWARD, MOTOR_SLIDE_FORWARD, MOTOR_SLIDE_BACKWARD)
BEFORE = (POSITION, SPEED, MOTOR_POSITION, MOTOR_SPEED, DEFLECTION, DEFLECTION_SPEED, BIAS_TORQUE)
TAKEN = (
    JOINT_TORQUE, JOINT_DAMPING, JOINT_STIFFNESS, MOTOR_TORQUE, MOTOR_DAMPING, MOTOR_STIFFNESS,
    GEAR_TORQUE, GEAR_DAMPING, GEAR_STIFFNESS,
    *JOINT_BOUNDS, *MOTOR_BOUNDS, MESH_DRIVING, MESH_DRIVEN, SURFACE_SPEED,
)  # fmt: skip
AFTER = (
    ACCELERATION, MOTOR_ACCELERATION, JOINT_FRICTION, MOTOR_FRICTION, MESH_TORQUE, MESH_LOSS,
    JOINT_FRICTION_POWER, MOTOR_FRICTION_POWER, MESH_POWER,
)  # fmt: skip

SHAFT_GIVEN = (SHAFT_POSITION, SHAFT_SPEED)
SHAFT_TAKEN = (SHAFT_TORQUE, SHAFT_DAMPING, SHAFT_STIFFNESS)
SHAFT_COMMANDS = (SHAFT_COMMAND_POSITION, SHAFT_COMMAND_SPEED, SHAFT_COMMAND_ACCELERATION)

# Of the whole mechanics, provided at instants only.
KINETIC_ENERGY = Signal("scene.kinetic_energy", "J", path="kinetic_energy")
POTENTIAL_ENERGY = Signal("scene.potential_energy", "J", path="potential_energy")
PAYLOAD_ENERGY = Signal("scene.payload_energy", "J", path="payload_energy")  # that payloads have brought so far

# Of the tip, along the axes of the base: known before; and what the surroundings do to it.
TIP_GIVEN = (
    *(Signal(f"scene.tip_{axis}", "m", path=f"tip.place.{k}") for k, axis in enumerate("xyz")),
    *(Signal(f"scene.tip_speed_{axis}", "m/s", path=f"tip.speed.{k}") for k, axis in enumerate("xyz")),
    *(Signal(f"scene.tip_turning_{axis}", "rad/s", path=f"tip.turning.{k}") for k, axis in enumerate("xyz")),
)
PAIRS = ("xx", "xy", "xz", "yy", "yz", "zz")
TIP_TAKEN = (
    *(Signal(f"scene.tip_force_{axis}", "N", path=f"tip.force.{k}") for k, axis in enumerate("xyz")),
    *(Signal(f"scene.tip_moment_{axis}", "N m", path=f"tip.moment.{k}") for k, axis in enumerate("xyz")),
    *(Signal(f"scene.tip_damping_{axes}", "N s/m", path=f"tip.damping.{k}") for k, axes in enumerate(PAIRS)),
    *(Signal(f"scene.tip_stiffness_{axes}", "N/m", path=f"tip.stiffness.{k}") for k, axes in enumerate(PAIRS)),
)


def commanded(place: Place) -> tuple[Signal, Signal, Signal]:
    """What a motor's loop follows: the joint's command, or its shaft's where motors are coupled."""
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


def read(place: Place, signals: Mapping[str, float], signal: Signal, otherwise: float = 0.0) -> float:
    """A signal of an effect's joint."""
    return signals.get(f"{place.name}.{signal.name}", otherwise)


def temperatures(motor: Motor) -> tuple[Signal, Signal]:
    """Those that the law of a motor reads; if no effect provides them, those of its data sheet."""
    rest = motor.reference_temperature
    return replace(WINDING_TEMPERATURE, default=rest), replace(HOUSING_TEMPERATURE, default=rest)


def source(name: str, path: str = "power") -> Signal:
    """An output: power that comes from outside [W]."""
    return Signal(name, "W", path=path, role=Role.SOURCE)


def loss(name: str, path: str = "power") -> Signal:
    """An output: power that is lost [W]."""
    return Signal(name, "W", path=path, role=Role.LOSS)


def store(name: str, path: str = "energy") -> Signal:
    """An output: energy that is kept [J]."""
    return Signal(name, "J", path=path, role=Role.STORE)


JOINT_SIGNALS: tuple[Signal, ...] = tuple(
    one for one in list(globals().values()) if isinstance(one, Signal) and not one.name.startswith("scene.")
)
