"""A scene: an arm or a single inertia, and the effects that are simulated."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array, checked_array
from drivetrain.effects.effect import Effect
from drivetrain.errors import Fault, Faults, InputError, nearest
from drivetrain.solvers.solver import check_positive

WHOLE = "scene"  # key of the effects of the whole scene


@dataclass(frozen=True)
class Inertia:
    """One joint without an arm.

    Attributes:
        inertia: Inertia that the joint moves, without rotors [kg m^2], or mass [kg] of a prismatic joint.
        weight: Gravity torque against the joint with its load in horizontal position [N m]; times the cosine of the
            load's angle otherwise.
        phase: Angle of the load above the horizontal at position 0 [rad].
        turning: Whether it is a revolute joint, or a prismatic one.
        name: Name of the joint.
    """

    inertia: float
    weight: float = 0.0
    phase: float = 0.0
    turning: bool = True
    name: str = "joint"

    def __post_init__(self) -> None:
        faults = Faults()
        for name in ("inertia", "weight", "phase"):
            faults.attempt(checked_array, getattr(self, name), (), name)
        if not faults.found and self.inertia < 0.0:
            faults.add("inertia", "must not be negative [kg m^2 or kg]", self.inertia)
        faults.raise_any()


@dataclass(frozen=True, eq=False)
class Scene:
    """A mechanical system with its effects, to be simulated for a duration.

    Attributes:
        body: The arm, or one inertia.
        effects: Effects by joint name, and under ``scene`` those of the whole scene; their order does not matter.
        duration: Duration of the run [s].
        position, speed: Initial positions and speeds [rad or m, and per s], (n,); None: those at the beginning of the
            command, without a command zero.
        name: Name of the scene.
        notes: Notes for the reader of its plan.
    """

    body: Arm | Inertia
    effects: Mapping[str, tuple[Effect, ...]]
    duration: float
    position: Array | None = None
    speed: Array | None = None
    name: str = "scene"
    notes: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        _check_kinds(self.body, self.effects)
        check_positive("duration", self.duration, "s")
        faults = Faults()
        kept: dict[str, tuple[Effect, ...]] = {}
        for name, effects in self.effects.items():
            listed = (effects,) if isinstance(effects, Effect) else tuple(effects)
            kept[name] = listed
            if name != WHOLE and name not in self.joints:
                faults.add(f"effects[{name!r}]", "no joint of that name", name, nearest(name, [*self.joints, WHOLE]))
            wanted = "scene" if name == WHOLE else "joint"
            for effect in listed:
                if not isinstance(effect, Effect):
                    faults.add(f"effects[{name!r}]", "must be an effect, made with its numbers", effect)
                elif effect.scope != wanted:
                    problem = f"is an effect of a {effect.scope}, not of a {wanted}"
                    faults.add(f"effects[{name!r}]", problem, type(effect).__name__)
        for name in ("position", "speed"):
            if (given := getattr(self, name)) is not None:
                object.__setattr__(self, name, faults.attempt(checked_array, given, (len(self.joints),), name))
        faults.raise_any()
        object.__setattr__(self, "effects", kept)

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints."""
        return self.body.joint_names if isinstance(self.body, Arm) else (self.body.name,)

    @property
    def turning(self) -> tuple[bool, ...]:
        """Whether each joint is revolute (or prismatic)."""
        if isinstance(self.body, Arm):
            return tuple(bool(screw[:3].any()) for screw in self.body.screws)
        return (self.body.turning,)


def _check_kinds(body: object, effects: object) -> None:
    """Raise InputError if the arguments of a scene have the wrong types, before they are checked further."""
    faults = Faults()
    if not isinstance(body, Arm | Inertia):
        faults.add("body", "must be an arm or an Inertia", body, "dt.load_arm reads an arm from its name")
    if not isinstance(effects, Mapping):
        hint = "such as {'joint_1': (effect, effect), 'scene': (effect,)}"
        faults.add("effects", "must be effects by the name of their joint", effects, hint)
    else:
        hint = "such as dt.DryFriction(...): an object, neither its name nor its class"
        for name, one in effects.items():
            if isinstance(one, str) or not isinstance(one, Effect | Iterable):
                faults.add(f"effects[{name!r}]", "must be an effect, or several", one, hint)
    faults.raise_any()


def joint_scene(
    inertia: Inertia | float, effects: Iterable[Effect], duration: float, *, position: Any = None, speed: Any = None
) -> Scene:
    """A scene of one joint without an arm.

    Args:
        inertia: The load, or its inertia [kg m^2].
        effects: Effects of the joint and of the whole scene, in any order.
        duration: Duration of the run [s].
        position, speed: Initial position and speed [rad or m, and per s]; None: those at the beginning of the command,
            without a command zero.

    Returns:
        The scene.

    Raises:
        InputError: Values that are no numbers, or effects that are no effects.
    """
    body = inertia if isinstance(inertia, Inertia) else Inertia(inertia)
    if not isinstance(effects, Effect | Iterable):
        raise InputError(Fault("effects", "must be a list of effects", effects))
    listed = (effects,) if isinstance(effects, Effect) else tuple(effects)
    own = tuple(effect for effect in listed if getattr(effect, "scope", "joint") == "joint")
    whole = tuple(effect for effect in listed if getattr(effect, "scope", "joint") == "scene")
    named = {body.name: own, **({WHOLE: whole} if whole else {})}
    at = None if position is None else checked_array([position], (1,), "position")
    turning = None if speed is None else checked_array([speed], (1,), "speed")
    return Scene(body, named, duration, at, turning)


def without(scene: Scene, kind: type[Effect]) -> Scene:
    """The scene without one kind of effect, which is replaced by its quasi-static substitute if it has one.

    Args:
        scene: The scene.
        kind: Class of the effects to leave out, at all joints.

    Returns:
        The scene; all other effects are the same objects.

    Raises:
        InputError: No class of effects.
    """
    if not (isinstance(kind, type) and issubclass(kind, Effect)):
        raise InputError(Fault("kind", "must be a class of effects, such as MeshLoss", kind))
    kept: dict[str, tuple[Effect, ...]] = {}
    for name, effects in scene.effects.items():
        assumed_limits = [effect.quasi_static() if type(effect) is kind else effect for effect in effects]
        kept[name] = tuple(effect for effect in assumed_limits if effect is not None)
    return replace(scene, effects=kept)
