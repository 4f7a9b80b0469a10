"""What is lost in each format, for the comments in files, messages and the documentation."""

from __future__ import annotations

from drivetrain.arm.arm import Arm, refuse_loops

_REFLECTED = "rotors as bodies: their inertia stands reflected at the joint, gyroscopic couples are left out"
_MESH = "mesh loss by direction, and the gear's drag over speed and temperature"
_STATIC = "breakaway and falling friction, frictions that differ by direction"
_BASE = "a base that moves"
_PLAY = "springs and backlash of the gears"
_FLEXIBLE = f"{_PLAY}; counterbalances; {_BASE}"
_MOTOR = "motors: resistance, inductance, back-emf, temperature, current limits; efforts and speeds alone are left"
_COUPLED = "coupled motors other than ros_control's differential and four-bar"

LOSSES: dict[str, tuple[str, ...]] = {
    "mjcf": (
        _REFLECTED, f"{_MESH}: the drag at the cycle's mean speed stands as Coulomb friction", _STATIC,
        f"{_PLAY}, what they bear; {_BASE}",
        "counterbalances but springs on levers; pins that hold closed loops give by a little",
        "the housing's temperature, which stays as the evaluation found it; the torque constant over temperature",
        "the amplifier's I2t, the supply's bus, holding brakes", "friction that sticks: MuJoCo's creeps",
    ),
    "urdf": (_REFLECTED, _MESH, _STATIC, _FLEXIBLE, _MOTOR, _COUPLED, "gravity"),
    "drake": (
        _REFLECTED, _MESH, _STATIC, _FLEXIBLE, _MOTOR,
        "coupled motors: Drake passes over their transmissions, so that their reflected inertia is missing", "gravity",
    ),
    "sdf": (
        f"{_REFLECTED}, and only Drake reads it there (drake:rotor_inertia, drake:gear_ratio)", _MESH, _STATIC,
        _FLEXIBLE, _MOTOR, "coupled motors: each counts at its own joint, which is another arm", "gravity",
        "payload changes; pins that hold closed loops together, but for Drake (drake:ball_constraint)",
    ),
    "ros2": (
        "everything but limits of position, speed, acceleration and effort, and the names of the interfaces",
        "coupled motors: of each joint what it may do alone",
    ),
    "physx": (
        "the corner where current and voltage limit: two straight lines stand for it", "heat, I2t, the supply's bus",
        "braking, in which voltage allows more than the lines", _MESH, _STATIC, _FLEXIBLE,
        "coupled motors: each counts at its own joint",
    ),
    "c": (
        "other payloads and drives than those it was written for", "springs and backlash of the gears",
        "counterbalances that follow a table",
    ),
    "fmu": (
        "all joints but one: an inertia stands for the arm, its weight and what other joints do to it is load_torque",
        f"{_PLAY}, unless springs are asked for", "inductance: the current follows its command at once",
        "the amplifier's I2t, the supply's bus, holding brakes", "any Python but one in which drivetrain is installed",
    ),
}  # fmt: skip
"""By the name of the format."""

TWO_MOTORS = ("mjcf", "c")
"""The formats that represent two motors on one axis."""

CLOSED_LOOPS = (*TWO_MOTORS, "sdf", "ros2", "physx", "fmu")
"""The formats that represent closed loops."""


def refuse_unsupported(arm: Arm, name: str) -> None:
    """Raise InputError for an arm with loops or axes that a format cannot represent."""
    refuse_loops(arm, shared=name in TWO_MOTORS, closed=name in CLOSED_LOOPS)


def lost(name: str) -> tuple[str, ...]:
    """What is lost in a format, one sentence each."""
    return tuple(f"lost: {one}" for one in LOSSES[name])
