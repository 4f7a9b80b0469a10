"""The signals between effects and mechanics, with names and units: the common vocabulary of all effects.

Units are those of a revolute joint; at a prismatic joint torques are forces [N] and angles are lengths [m]. Signals of
the joint are on the joint side of the gear, signals of the motor at the motor's shaft.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from drivetrain.drive.motor import Motor
from drivetrain.effects.effect import Place, Role, Signal

# Provided by the mechanics before any effect is evaluated.
POSITION = Signal("position", "rad", path="load.position")
SPEED = Signal("speed", "rad/s", path="load.speed")
MOTOR_POSITION = Signal("motor_position", "rad", path="motor.position")
MOTOR_SPEED = Signal("motor_speed", "rad/s", path="motor.speed")
# Of a flexible joint: motor angle at the gear's output minus joint angle.
DEFLECTION = Signal("deflection", "rad", path="spring.wind_up")
DEFLECTION_SPEED = Signal("deflection_speed", "rad/s", path="spring.speed")
BIAS_TORQUE = Signal("bias_torque", "N m", path="bias_torque")  # torque at zero acceleration: gravity, Coriolis terms

# Where motors are coupled (``arm/coupling.py``): signals of the output shaft of this joint's gear. Dry friction, mesh,
# bias torque and row of the mass matrix of such a joint also belong to the shaft.
SHAFT_POSITION = Signal("shaft_position", "rad", path="shaft.position")
SHAFT_SPEED = Signal("shaft_speed", "rad/s", path="shaft.speed")
SHAFT_TORQUE = Signal("shaft_torque", "N m", path="shaft.torque")
SHAFT_DAMPING = Signal("shaft_damping", "N m s/rad", path="shaft.damping")
SHAFT_STIFFNESS = Signal("shaft_stiffness", "N m/rad", path="shaft.stiffness")

# Contributed by effects, read by the mechanics: smooth torques, and their negative derivatives by speed and position.
JOINT_TORQUE = Signal("joint_torque", "N m", path="load.torque")  # on the link, positive along the joint
JOINT_DAMPING = Signal("joint_damping", "N m s/rad", path="load.damping")
JOINT_STIFFNESS = Signal("joint_stiffness", "N m/rad", path="load.stiffness")
MOTOR_TORQUE = Signal("motor_torque", "N m", path="motor.torque")  # on the rotor
MOTOR_DAMPING = Signal("motor_damping", "N m s/rad", path="motor.damping")
MOTOR_STIFFNESS = Signal("motor_stiffness", "N m/rad", path="motor.stiffness")
# Of the spring of a flexible joint; positive accelerates the link.
GEAR_TORQUE = Signal("gear_torque", "N m", path="spring.torque")
GEAR_DAMPING = Signal("gear_damping", "N m s/rad", path="spring.damping")
GEAR_STIFFNESS = Signal("gear_stiffness", "N m/rad", path="spring.stiffness")

# Bounds of set-valued friction, all positive: at rest (hold) and while slipping (slide), by direction of motion.
JOINT_HOLD_FORWARD = Signal("joint_hold_forward", "N m", path="load.hold_forward")
JOINT_HOLD_BACKWARD = Signal("joint_hold_backward", "N m", path="load.hold_backward")
JOINT_SLIDE_FORWARD = Signal("joint_slide_forward", "N m", path="load.slide_forward")
JOINT_SLIDE_BACKWARD = Signal("joint_slide_backward", "N m", path="load.slide_backward")
MOTOR_HOLD_FORWARD = Signal("motor_hold_forward", "N m", path="motor.hold_forward")
MOTOR_HOLD_BACKWARD = Signal("motor_hold_backward", "N m", path="motor.hold_backward")
MOTOR_SLIDE_FORWARD = Signal("motor_slide_forward", "N m", path="motor.slide_forward")
MOTOR_SLIDE_BACKWARD = Signal("motor_slide_backward", "N m", path="motor.slide_backward")
MESH_DRIVING = Signal("mesh_driving", "-", path="mesh.driving")  # loss over transmitted torque, power to the load
MESH_DRIVEN = Signal("mesh_driven", "-", path="mesh.driven")  # the same, power from the load; self-locking from 1 on
SURFACE_SPEED = Signal("surface_speed", "rad/s", path="load.surface_speed")  # of the surface on which the joint slips
# Of a motor's bearings, which are at rest.
MOTOR_SURFACE_SPEED = Signal("motor_surface_speed", "rad/s", default=0.0, path="motor.surface_speed")

# Provided by the mechanics when motion and forces are known.
ACCELERATION = Signal("acceleration", "rad/s^2", path="load.acceleration")
MOTOR_ACCELERATION = Signal("motor_acceleration", "rad/s^2", path="motor.acceleration")
JOINT_FRICTION = Signal("joint_friction", "N m", path="load.friction")  # dry friction, positive against motion forward
MOTOR_FRICTION = Signal("motor_friction", "N m", path="motor.friction")
TIP_TORQUE = Signal("tip_torque", "N m", path="tip_torque")  # of the forces on the tip, positive along the joint
MESH_TORQUE = Signal("mesh_torque", "N m", path="mesh.torque")  # transmitted by the mesh, at the gear's output
MESH_LOSS = Signal("mesh_loss", "N m", path="mesh.loss")  # torque lost in the mesh, at the gear's output
JOINT_FRICTION_POWER = Signal("joint_friction_power", "W", path="load.friction_power")
MOTOR_FRICTION_POWER = Signal("motor_friction_power", "W", path="motor.friction_power")
MESH_POWER = Signal("mesh_power", "W", path="mesh.power")
# Provided by viscous friction at the motor.
MOTOR_VISCOUS_POWER = Signal("motor_viscous_power", "W", path="heat.viscous_power")

# Exchanged between effects.
COMMAND_POSITION = Signal("command_position", "rad", path="command.position")
COMMAND_SPEED = Signal("command_speed", "rad/s", path="command.speed")
COMMAND_ACCELERATION = Signal("command_acceleration", "rad/s^2", path="command.acceleration")
# Where motors are coupled: of the shaft.
SHAFT_COMMAND_POSITION = Signal("shaft_command_position", "rad", path="shaft_command.position")
SHAFT_COMMAND_SPEED = Signal("shaft_command_speed", "rad/s", path="shaft_command.speed")
SHAFT_COMMAND_ACCELERATION = Signal("shaft_command_acceleration", "rad/s^2", path="shaft_command.acceleration")
MEASURED_POSITION = Signal("measured_position", "rad", path="measured_position")  # of the motor, by an encoder
CURRENT_COMMAND = Signal("current_command", "A", path="pin.command")  # contributed by controllers and feed-forward
# Negative derivative of the command by the motor's speed.
CURRENT_DAMPING = Signal("current_damping", "A s/rad", default=0.0, path="pin.damping")
CURRENT_STIFFNESS = Signal("current_stiffness", "A/rad", default=0.0, path="pin.stiffness")  # and by its position
CURRENT = Signal("current", "A", path="pin.current")
VOLTAGE = Signal("voltage", "V", path="pin.voltage")  # between the motor's terminals
VOLTAGE_LIMIT = Signal("voltage_limit", "V", default=float("inf"), path="pin.limit")
WINDING_TEMPERATURE = Signal("winding_temperature", "C", path="heat.winding")
HOUSING_TEMPERATURE = Signal("housing_temperature", "C", path="heat.housing")
GEAR_TEMPERATURE = Signal("gear_temperature", "C", path="heat.gear")
# Part of the motor's dry friction that is the drag of the gear.
GEAR_DRAG_POWER = Signal("gear_drag_power", "W", path="heat.drag_power")
COPPER_LOSS = Signal("copper_loss", "W", path="heat.copper_loss", role=Role.LOSS)
ELECTRICAL_POWER = Signal("electrical_power", "W", path="pin.power", role=Role.SOURCE)
MAGNETIC_ENERGY = Signal("magnetic_energy", "J", path="pin.magnetic_energy", role=Role.STORE)

# Provided to ``Effect.start`` only [A]: the current that holds the load at rest, and the feed-forward current.
HOLDING_CURRENT = "holding_current"
FED_CURRENT = "fed_current"

JOINT_BOUNDS = (JOINT_HOLD_FORWARD, JOINT_HOLD_BACKWARD, JOINT_SLIDE_FORWARD, JOINT_SLIDE_BACKWARD)
MOTOR_BOUNDS = (MOTOR_HOLD_FORWARD, MOTOR_HOLD_BACKWARD, MOTOR_SLIDE_FORWARD, MOTOR_SLIDE_BACKWARD)
# Provided by the mechanics before any law, contributed to them by effects, provided when motion and forces are known.
BEFORE = (POSITION, SPEED, MOTOR_POSITION, MOTOR_SPEED, DEFLECTION, DEFLECTION_SPEED, BIAS_TORQUE)
TAKEN = (
    JOINT_TORQUE, JOINT_DAMPING, JOINT_STIFFNESS, MOTOR_TORQUE, MOTOR_DAMPING, MOTOR_STIFFNESS,
    GEAR_TORQUE, GEAR_DAMPING, GEAR_STIFFNESS,
    *JOINT_BOUNDS, *MOTOR_BOUNDS, MESH_DRIVING, MESH_DRIVEN, SURFACE_SPEED,
)  # fmt: skip
AFTER = (
    ACCELERATION, MOTOR_ACCELERATION, JOINT_FRICTION, MOTOR_FRICTION, TIP_TORQUE, MESH_TORQUE, MESH_LOSS,
    JOINT_FRICTION_POWER, MOTOR_FRICTION_POWER, MESH_POWER,
)  # fmt: skip

SHAFT_GIVEN = (SHAFT_POSITION, SHAFT_SPEED)
SHAFT_TAKEN = (SHAFT_TORQUE, SHAFT_DAMPING, SHAFT_STIFFNESS)
SHAFT_COMMANDS = (SHAFT_COMMAND_POSITION, SHAFT_COMMAND_SPEED, SHAFT_COMMAND_ACCELERATION)

# Energies of the mechanics, provided at instants only.
KINETIC_ENERGY = Signal("scene.kinetic_energy", "J", path="kinetic_energy")
POTENTIAL_ENERGY = Signal("scene.potential_energy", "J", path="potential_energy")
PAYLOAD_ENERGY = Signal("scene.payload_energy", "J", path="payload_energy")  # added by payload changes so far

# Motion of the tip in the base frame, provided by the mechanics before any law; forces on the tip, from effects.
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
    """Signals of the command that a motor's loop follows: the joint's, or its shaft's where motors are coupled."""
    return SHAFT_COMMANDS if place.coupled else (COMMAND_POSITION, COMMAND_SPEED, COMMAND_ACCELERATION)


def motion(place: Place) -> tuple[Signal, Signal]:
    """Signals of position and speed of a joint's coordinate, which is its shaft where motors are coupled."""
    return SHAFT_GIVEN if place.coupled else (POSITION, SPEED)


def of_side(side: str, place: Place) -> tuple[Signal, Signal, Signal]:
    """Signals of speed, torque and damping at a side of the gear."""
    if side == "motor":
        return MOTOR_SPEED, MOTOR_TORQUE, MOTOR_DAMPING
    if side == "shaft" and place.coupled:
        return SHAFT_SPEED, SHAFT_TORQUE, SHAFT_DAMPING
    return SPEED, JOINT_TORQUE, JOINT_DAMPING


def read(place: Place, signals: Mapping[str, float], signal: Signal, otherwise: float = 0.0) -> float:
    """The value of a signal of an effect's joint; ``otherwise`` if it is not known."""
    return signals.get(f"{place.name}.{signal.name}", otherwise)


def temperatures(motor: Motor) -> tuple[Signal, Signal]:
    """Temperature signals that a motor's law needs; if no effect provides them, the data sheet's reference applies."""
    rest = motor.reference_temperature
    return replace(WINDING_TEMPERATURE, default=rest), replace(HOUSING_TEMPERATURE, default=rest)


def source(name: str, path: str = "power") -> Signal:
    """An output: power supplied from outside [W]."""
    return Signal(name, "W", path=path, role=Role.SOURCE)


def loss(name: str, path: str = "power") -> Signal:
    """An output: power dissipated [W]."""
    return Signal(name, "W", path=path, role=Role.LOSS)


def store(name: str, path: str = "energy") -> Signal:
    """An output: stored energy [J]."""
    return Signal(name, "J", path=path, role=Role.STORE)


JOINT_SIGNALS: tuple[Signal, ...] = tuple(
    one for one in list(globals().values()) if isinstance(one, Signal) and not one.name.startswith("scene.")
)
