"""The amplifier of one joint and the supply of them all: limits, in the DC-equivalent convention of the motors."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Amplifier:
    """Limits of one joint's amplifier; None where unknown.

    Attributes:
        peak_current: [A], DC equivalent.
        continuous_current: RMS over the cycle [A], DC equivalent.
        modulation: Largest share of the supply voltage that reaches the motor terminals.
    """

    peak_current: float | None = None
    continuous_current: float | None = None
    modulation: float = 0.95


@dataclass(frozen=True)
class Supply:
    """The one supply behind all amplifiers; None where unknown.

    Attributes:
        voltage: [V].
        peak_power, mean_power: Limits over all joints together [W].
        regenerated_power: Largest mean power it takes back or burns in a brake resistor [W].
    """

    voltage: float
    peak_power: float | None = None
    mean_power: float | None = None
    regenerated_power: float | None = None
