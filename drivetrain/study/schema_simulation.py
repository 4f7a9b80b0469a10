"""What a study file may say of its simulation."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field

from drivetrain.errors import nearest
from drivetrain.study import fields as f
from drivetrain.study.form import Form
from drivetrain.study.simulation import KNOWN_EFFECTS, Control, Simulation

USUAL = Simulation()
USUAL_CONTROL = Control()
WORDS = ("auto", "all", "none")


def _effects(value: Any) -> tuple[str, ...]:
    """A word, or names of effects."""
    if isinstance(value, str):
        if value in WORDS:
            return () if value == "none" else (value,)
        value = [value]
    if not isinstance(value, list | tuple):
        raise f.refused("must be auto, all, none, or a list of effects", ", ".join(KNOWN_EFFECTS))
    for name in value:
        if name not in KNOWN_EFFECTS:
            hint = nearest(str(name), KNOWN_EFFECTS) or f"known are {', '.join(KNOWN_EFFECTS)}"
            raise f.refused("is no effect of a study", hint, found=str(name))
    return tuple(dict.fromkeys(value))


Effects = Annotated[tuple[str, ...], BeforeValidator(_effects)]
Share = Annotated[float, f.Quantity("", above=0.0)]
Rate = Annotated[float, f.Quantity("Hz", above=0.0)]


class ControlForm(Form):
    """How a joint is controlled: by a digital controller, its loops closed at samples."""

    sampled: bool = Field(default=USUAL_CONTROL.sampled, description="false: continuous loops")
    rate: Rate = Field(default=USUAL_CONTROL.rate, description="of position and speed loop")
    amplifier_rate: Rate | None = Field(
        default=USUAL_CONTROL.amplifier_rate, description="of the current loop; null: continuous"
    )
    delay: Annotated[int, Field(ge=0, le=2)] = Field(
        default=USUAL_CONTROL.delay, description="samples from measuring to giving out"
    )
    encoder_bits: Annotated[int, Field(ge=4, le=40)] | None = Field(
        default=None, description="of the motor's encoder, a turn; default: as fine as numbers are"
    )


class CoggingForm(Form):
    """What a motor's magnets pull at its teeth."""

    amplitude: f.Torque | None = Field(default=None, description="at the motor's shaft; 0 N m: none")
    periods: Annotated[int, Field(ge=1)] | None = Field(
        default=None, description="a turn: the least common multiple of teeth and poles"
    )


class SimulationForm(Form):
    """What is simulated of the study, and how."""

    effects: Effects = Field(default=USUAL.effects, description="auto, all, none, or the names of those wanted")
    tolerance: Share = Field(default=USUAL.tolerance, description="of what is decided by, for effects: auto")
    tip_tolerance: Annotated[float, f.Quantity("m", above=0.0)] | None = Field(
        default=None, description="of the tip; default: the tolerance's share of how far it is commanded to go"
    )
    solver: Literal["fixed", "adaptive", "inverse"] = "fixed"
    step: f.Duration = Field(default=USUAL.step, description="of the fixed engine")
    precision: Share = Field(default=USUAL.precision, description="relative tolerance of the adaptive engine")
    bandwidth: Annotated[float, f.Quantity("rad/s", above=0.0)] = Field(
        default=USUAL.bandwidth, description="of the position loops"
    )
    current_bandwidth: Annotated[float, f.Quantity("rad/s", above=0.0)] = Field(
        default=USUAL.current_bandwidth, description="of the current loops"
    )
    damping: Annotated[float, f.Quantity("", minimum=0.0)] = Field(
        default=USUAL.damping, description="of the springs, as a share of the critical one"
    )
    repetitions: Annotated[int, Field(ge=1)] = Field(default=USUAL.repetitions, description="of the cycle")
    control: dict[str, ControlForm] = Field(
        default_factory=dict, description="by joint; default holds for all that are not named"
    )
    cogging: dict[str, CoggingForm] = Field(
        default_factory=dict, description="by joint; default holds for all that are not named"
    )
