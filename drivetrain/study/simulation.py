"""What a study wants of its simulation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from annotated_types import Ge, Le

from drivetrain.errors import nearest
from drivetrain.units import Duration, Factor, Quantity, Rate, Reader, Speed, Torque, refused

WORDS = ("auto", "all", "none")
KNOWN_EFFECTS = {
    "viscous_friction": "ViscousFriction",
    "dry_friction": "DryFriction",
    "mesh_loss": "MeshLoss",
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
    """What a motor's magnets pull at its teeth; sheets hold no such data.

    Attributes:
        amplitude: Of the cogging torque at the motor's shaft [N m]; 0: none.
        periods: A turn of the motor: the least common multiple of teeth and poles.
    """

    amplitude: Torque = 0.0
    periods: Annotated[int, Ge(1)] | None = None


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
