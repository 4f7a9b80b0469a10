"""What a study wants of its simulation, and the effects that it may add to it: any class of ``effects/`` by its name.

No other place lists the effects that can be added: a new file in ``effects/`` is a new name in study files. Of each
    field
the effect's own annotations and docstring say what it takes; the joint's motor and gear are taken from its drive.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_type_hints

from annotated_types import Ge, Le

from drivetrain.drive.drive import Drive
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.errors import nearest
from drivetrain.units import Duration, Factor, Quantity, Rate, Reader, Speed, Torque, refused

if TYPE_CHECKING:
    from drivetrain.effects.effect import Effect

WORDS = ("auto", "all", "none")
KNOWN_EFFECTS = {
    "viscous_friction": "ViscousFriction",
    "dry_friction": "DryFriction",
    "mesh_loss": "MeshLoss",
    "gear_drag": "GearDrag",
    "springs": "FlexibleJoint",
    "inductance": "CurrentLoop",
    "heat": "WindingHeat",
    "full_rotor": "FullRotor",
    "cogging": "Cogging",
    "sampling": "SampledCascade",
    "amplifier_sampling": "SampledCurrentLoop",
    "encoder": "Encoder",
}
"""Effects that a study's simulation may leave out, by the name that the file gives them, and the class of each."""


class _Added(Reader):
    """Effects by their names, each with its fields: read further where they are looked up."""

    def read(self, value: Any) -> Any:
        if not isinstance(value, list) or not all(isinstance(entry, dict) for entry in value):
            hint = "such as [{effect: HoldingBrake, joint: elbow, holding: 9 N m}]"
            raise refused("must be a list of effects", hint)
        return tuple(value)

    def json_schema(self) -> dict[str, Any]:
        names = {"effect": {"type": "string"}, "joint": {"type": "string"}}
        return {"type": "array", "items": {"type": "object", "properties": names, "required": ["effect"]}}


class _Effects(Reader):
    """A word, or names of effects."""

    def read(self, value: Any) -> tuple[str, ...]:
        if isinstance(value, str):
            if value in WORDS:
                return () if value == "none" else (value,)
            value = [value]
        if not isinstance(value, list | tuple):
            raise refused("must be auto, all, none, or a list of effects", ", ".join(KNOWN_EFFECTS))
        for name in value:
            if name not in KNOWN_EFFECTS:
                hint = nearest(str(name), KNOWN_EFFECTS) or f"known are {', '.join(KNOWN_EFFECTS)}"
                raise refused("is no effect of a study", hint, str(name))
        return tuple(dict.fromkeys(value))

    def json_schema(self) -> dict[str, Any]:
        names = {"enum": list(KNOWN_EFFECTS)}
        return {"anyOf": [{"enum": [*WORDS, *KNOWN_EFFECTS]}, {"type": "array", "items": names}]}


@dataclass(frozen=True)
class Control:
    """How a joint is controlled, where that is not a continuous loop.

    Attributes:
        sampled: Whether position and speed loop run at samples, on a measured angle.
        rate: Of those loops [Hz].
        amplifier_rate: Of the current loop [Hz]; None: it is continuous.
        delay: From measuring to giving out [samples].
        encoder_bits: Of the motor's encoder, a turn; None: as fine as numbers are.
    """

    sampled: bool = True
    rate: Rate = 1e3
    amplifier_rate: Rate | None = 1e4
    delay: Annotated[int, Ge(0), Le(2)] = 1
    encoder_bits: Annotated[int, Ge(4), Le(40)] | None = None


@dataclass(frozen=True)
class Teeth:
    """What a motor's magnets pull at its teeth; data sheets do not give it.

    Attributes:
        amplitude: Of the cogging torque at the motor's shaft [N m]; 0: none.
        periods: A turn of the motor: the least common multiple of teeth and poles.
    """

    amplitude: Torque = 0.0
    periods: Annotated[int, Ge(1)] = 0


@dataclass(frozen=True)
class AddedEffect:
    """An effect beside those that sheets and control bring.

    Attributes:
        joint: Its name; empty for the whole scene.
        kind: Class of the effect.
        values: Of its fields, in SI, but for those of the drive.
    """

    joint: str
    kind: type[Effect]
    values: Mapping[str, Any]

    def built(self, drive: Drive | None = None) -> Effect:
        """The effect at a joint with a drive."""
        parts = {Motor: drive.motor, Gear: drive.gear} if drive is not None else {}
        own = {name: parts[part] for name, part in drive_fields(self.kind).items()}
        return self.kind(**{**self.values, **own})


def drive_fields(kind: type) -> dict[str, type]:
    """The fields of an effect that the joint's drive fills, and with what."""
    return {name: hint for name, hint in get_type_hints(kind).items() if hint in (Motor, Gear)}


def known_effects() -> dict[str, type[Effect]]:
    """Every effect of the package, and every other that is imported, by the name of its class."""
    from drivetrain import effects  # compiled code, which only a study that adds some needs
    from drivetrain.effects.effect import Effect

    for module in pkgutil.walk_packages(effects.__path__, f"{effects.__name__}."):
        import_module(module.name)
    return {kind.__name__: kind for kind in _below(Effect) if not getattr(kind, "__abstractmethods__", None)}


def _below(kind: Any) -> Iterator[Any]:
    for child in kind.__subclasses__():
        yield child
        yield from _below(child)


@dataclass(frozen=True)
class Simulation:
    """What a study's simulation holds, and how it is run.

    Attributes:
        effects: ``auto``, ``all``, or names from ``KNOWN_EFFECTS``.
        tolerance: Of the decision quantities, where effects are chosen [-].
        tip_tolerance: Of the tip [m]; None: the tolerance's share of the distance that the tip is commanded to go.
        solver: ``fixed``, ``adaptive`` or ``inverse``.
        step: Of the fixed engine [s].
        precision: Relative tolerance of the adaptive engine [-].
        bandwidth: Of the position loops [rad/s].
        current_bandwidth: Of the current loops [rad/s].
        damping: Of the springs, as a share of the critical one [-].
        repetitions: Of the cycle.
        control: By joint name; a joint that is not named has continuous loops.
        cogging: By joint name; a joint that is not named has none.
        add: Any other effects, by the names of their classes, with their fields and the joint that they are of.
    """

    effects: Annotated[tuple[str, ...], _Effects()] = ("all",)
    tolerance: Factor = 0.01
    tip_tolerance: Annotated[float, Quantity("m", above=0.0)] | None = None
    solver: Literal["fixed", "adaptive", "inverse"] = "fixed"
    step: Duration = 5e-4
    precision: Factor = 1e-6
    bandwidth: Speed = 40.0
    current_bandwidth: Speed = 6283.185307179586
    damping: Annotated[float, Quantity("", minimum=0.0)] = 0.02
    repetitions: Annotated[int, Ge(1)] = 1
    control: Mapping[str, Control] = field(default_factory=dict)
    cogging: Mapping[str, Teeth] = field(default_factory=dict)
    add: Annotated[tuple[AddedEffect, ...], _Added()] = ()
