"""What a study wants of its simulation."""

from __future__ import annotations

from dataclasses import dataclass

KNOWN_EFFECTS = {
    "viscous_friction": "ViscousFriction",
    "dry_friction": "DryFriction",
    "mesh_loss": "MeshLoss",
    "springs": "FlexibleJoint",
    "inductance": "CurrentLoop",
    "heat": "WindingHeat",
    "full_rotor": "FullRotor",
}
"""Effects that a study's simulation may leave out, by the name that the file gives them, and the class of each."""


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
