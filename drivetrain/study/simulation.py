"""What a study wants of its simulation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

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
    rate: float = 1e3
    amplifier_rate: float | None = 1e4
    delay: int = 1
    encoder_bits: int | None = None


@dataclass(frozen=True)
class Teeth:
    """What a motor's magnets pull at its teeth; sheets hold no such data.

    Attributes:
        amplitude: Of the cogging torque at the motor's shaft [N m].
        periods: A turn of the motor.
    """

    amplitude: float
    periods: int


@dataclass(frozen=True)
class Simulation:
    """What a study's simulation holds, and how it is run.

    Attributes:
        effects: ``("auto",)``, ``("all",)``, or names from ``KNOWN_EFFECTS``.
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

    effects: tuple[str, ...] = ("all",)
    tolerance: float = 0.01
    tip_tolerance: float | None = None
    solver: str = "fixed"
    step: float = 5e-4
    precision: float = 1e-6
    bandwidth: float = 40.0
    current_bandwidth: float = 6283.185307179586
    damping: float = 0.02
    repetitions: int = 1
    control: Mapping[str, Control] = field(default_factory=dict)
    cogging: Mapping[str, Teeth] = field(default_factory=dict)
