"""What each export format cannot represent, for the comments in files, messages and the documentation."""

from __future__ import annotations

from drivetrain.arm.arm import Arm, refuse_loops

_REFLECTED = "rotors as bodies: only their inertia reflected to the joint is exported, no gyroscopic torques"
_MESH = "mesh losses that depend on the direction of power, and the gear's drag over speed and temperature"
_STATIC = "breakaway (static) friction, friction that decreases with speed or differs between directions"
_TASK = "a moving base; forces at the tip"
_PLAY = "springs and backlash of the gears"
_FLEXIBLE = f"{_PLAY}; counterbalances; {_TASK}"
_MOTOR = "motor models (resistance, inductance, back-emf, temperature, current limits): only limits of effort and speed"
_COUPLED = "coupled motors other than ros_control's differential and four-bar"

LOSSES: dict[str, tuple[str, ...]] = {
    "mjcf": (
        _REFLECTED, f"{_MESH}: the drag at the cycle's mean speed is exported as Coulomb friction", _STATIC,
        f"{_PLAY}, and their load limits; {_TASK}",
        "counterbalances other than springs on levers; pins of closed loops are slightly compliant in MuJoCo",
        "changes of the housing temperature, which is constant at its evaluated value; the torque constant over "
        "temperature",
        "the amplifier's I2t, the supply's bus, holding brakes",
        "friction that holds at rest: joints creep under load in MuJoCo",
    ),
    "urdf": (_REFLECTED, _MESH, _STATIC, _FLEXIBLE, _MOTOR, _COUPLED, "gravity"),
    "drake": (
        _REFLECTED, _MESH, _STATIC, _FLEXIBLE, _MOTOR,
        "coupled motors: Drake ignores their transmissions, so that their reflected inertia is missing", "gravity",
    ),
    "sdf": (
        f"{_REFLECTED}; only Drake reads that inertia (drake:rotor_inertia, drake:gear_ratio)", _MESH, _STATIC,
        _FLEXIBLE, _MOTOR, "coupled motors: each is exported as if it drove its own joint alone", "gravity",
        "payload changes; the pins of closed loops, except in Drake (drake:ball_constraint)",
    ),
    "ros2": (
        "everything except limits of position, speed, acceleration and effort, and the names of the interfaces",
        "coupled motors: the limits of each joint are those when it moves alone",
    ),
    "physx": (
        "the exact torque-speed limit of current and voltage: it is approximated by two straight lines",
        "heat, I2t, the supply's bus", "the higher torque that the voltage allows in braking", _MESH, _STATIC,
        _FLEXIBLE, "coupled motors: each is exported as if it drove its own joint alone",
    ),
    "c": (
        "other payloads and drives than those of the exported study", "springs and backlash of the gears",
        "counterbalances that are given as a table; forces at the tip",
    ),
    "fmu": (
        "all other joints and the payload: the arm is a constant inertia; its weight and the torques of other joints "
        "are the input load_torque",
        f"{_PLAY}, unless springs are requested", "inductance: the current follows its command without delay",
        "the amplifier's I2t, the supply's bus, holding brakes",
        "use without Python: the FMU needs a Python in which drivetrain is installed",
    ),
}  # fmt: skip
"""What is lost, by the name of the format."""

TWO_MOTORS = ("mjcf", "c")
"""The formats that represent two motors on one axis."""

CLOSED_LOOPS = (*TWO_MOTORS, "sdf", "ros2", "physx", "fmu")
"""The formats that represent closed loops."""


def refuse_unsupported(arm: Arm, name: str) -> None:
    """Raise InputError for an arm with loops or axes that a format cannot represent."""
    refuse_loops(arm, shared=name in TWO_MOTORS, closed=name in CLOSED_LOOPS)


def lost(name: str) -> tuple[str, ...]:
    """What is lost in a format, one text for each item, beginning with "lost: "."""
    return tuple(f"lost: {one}" for one in LOSSES[name])
