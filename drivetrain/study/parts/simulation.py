"""Options of a simulation, and the effects that a study may add to it: any class of ``effects/`` by its name.

No other place lists the effects that can be added: a new file in ``effects/`` is a new name in study files. The
annotations and the docstring of an effect say what its fields take; motor and gear of the joint are those of its drive.
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
from drivetrain.errors import Fault, nearest, raise_faults
from drivetrain.units import TEXT, Duration, Factor, Function, Quantity, Rate, Speed, Torque, refused

if TYPE_CHECKING:
    from drivetrain.effects.effect import Effect

WORDS = ("auto", "all", "none")
TWO_INTEGRATORS = "cannot be combined with two motors on the axis, whose integrators would act against each other"
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


def _added(value: Any) -> Any:
    """A list of effects with their names and fields, which are checked when the effects are looked up."""
    if not isinstance(value, list) or not all(isinstance(entry, dict) for entry in value):
        raise refused("must be a list of effects", "such as [{effect: HoldingBrake, joint: elbow, holding: 9 N m}]")
    return tuple(value)


def read_effects(value: Any, place: str = "") -> tuple[str, ...]:
    """Effects by their names, or one of ``WORDS``; raises InputError with all unknown names."""
    if value in WORDS:
        return () if value == "none" else (value,)
    names, known = ([value], ALLOWED) if isinstance(value, str) else (value, KNOWN_EFFECTS)
    if not isinstance(names, list | tuple):
        raise refused("must be auto, all, none, or a list of effects", ", ".join(KNOWN_EFFECTS))
    unknown = [str(name) for name in names if str(name) not in KNOWN_EFFECTS]
    raise_faults(Fault(place, "is no effect of a study", name, nearest(name, known)) for name in unknown)
    return tuple(dict.fromkeys(names))


_ADDED = {"type": "object", "properties": {"effect": TEXT, "joint": TEXT}, "required": ["effect"]}
ALLOWED = [*WORDS, *KNOWN_EFFECTS]
_EFFECTS = {"anyOf": [{"enum": ALLOWED}, {"type": "array", "items": {"enum": list(KNOWN_EFFECTS)}}]}


@dataclass(frozen=True)
class Control:
    """Digital control of a joint; without it, all loops are continuous.

    Attributes:
        sampled: Whether position and speed loop are sampled and use the measured angle.
        rate: Sample rate of the position and speed loop [Hz].
        amplifier_rate: Sample rate of the current loop [Hz]; None: it is continuous.
        delay: Delay from measurement to output [samples].
        encoder_bits: Resolution of the motor's encoder per turn [bit]; None: ideal.
        position_gain: Gain of the position loop [1/s]; None: that of the simulation's ``bandwidth``.
        speed_gain: Gain of the speed loop, at the motor, in amperes of the equivalent DC machine [A s/rad]; None: that
            of the simulation's ``bandwidth``.
        integral_time: Integral time of the speed loop [s]; None: no integrator.
    """

    sampled: bool = True
    rate: Rate = 1e3
    amplifier_rate: Rate | None = 1e4
    delay: Annotated[int, Ge(0), Le(2)] = 1
    encoder_bits: Annotated[int, Ge(4), Le(40)] | None = None
    position_gain: Annotated[float, Quantity("1/s", minimum=0.0)] | None = None
    speed_gain: Annotated[float, Quantity("A s/rad", minimum=0.0)] | None = None
    integral_time: Duration | None = None


@dataclass(frozen=True)
class Teeth:
    """Cogging torque of a motor, between its magnets and the stator teeth; data sheets do not give it.

    Attributes:
        amplitude: Amplitude of the cogging torque at the motor's shaft [N m]; 0: none.
        periods: Periods per turn of the motor: the least common multiple of the numbers of teeth and poles.
    """

    amplitude: Torque = 0.0
    periods: Annotated[int, Ge(1)] = 0


@dataclass(frozen=True)
class AddedEffect:
    """An effect in addition to those that follow from data sheets and control.

    Attributes:
        joint: Name of its joint; empty: the effect applies to the whole scene.
        kind: Class of the effect.
        values: Values of its fields in SI, except those that the drive provides.
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
    """The fields of an effect that the joint's drive provides, with the class of each value."""
    return {name: hint for name, hint in get_type_hints(kind).items() if hint in (Motor, Gear)}


def known_effects() -> dict[str, type[Effect]]:
    """All effects of the package and all others that were imported, by class name."""
    from drivetrain import effects  # imported here because it loads compiled code that few studies need
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
    """Effects and numerical settings of a study's simulation.

    Attributes:
        effects: ``auto``, ``all``, or names from ``KNOWN_EFFECTS``.
        tolerance: Relative tolerance of the decision quantities by which effects are chosen [-].
        tip_tolerance: Tolerance of the tip position by which effects are chosen [m]; None: ``tolerance`` times the
            distance that the tip is commanded to move.
        solver: ``fixed``, ``adaptive`` or ``inverse``.
        step: Step of the fixed-step solver [s].
        precision: Relative tolerance of the adaptive solver [-].
        bandwidth: Bandwidth of the position loops [rad/s].
        current_bandwidth: Bandwidth of the current loops [rad/s].
        damping: Damping ratio of the springs, as a share of critical damping [-].
        repetitions: Number of repetitions of the cycle.
        control: Control by joint name; a joint that is not named has continuous loops.
        cogging: Cogging by joint name; a joint that is not named has none.
        add: Additional effects, each with its class name, its fields and the joint to which it applies.
    """

    effects: Annotated[tuple[str, ...], Function(read_effects, _EFFECTS)] = ("all",)
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
    add: Annotated[tuple[AddedEffect, ...], Function(_added, {"type": "array", "items": _ADDED})] = ()
