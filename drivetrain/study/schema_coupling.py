"""What a study file may say of motors that drive several joints together."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from drivetrain.study import fields as f
from drivetrain.study.form import Form

Turns = Annotated[float, f.Quantity("")]
_WANTS = {"differential": "turns", "belt": "passes"}


class CouplingForm(Form):
    """Joints whose motors work together: the shafts behind their gears turn as these turn with the joints.

    The drive of a joint listed here is the one behind its shaft, in the same order: speed, torque and friction of that
    joint's drive are the shaft's.
    """

    joints: f.Names = Field(description="from the base towards the tip; their drives turn the shafts, in this order")
    type: Literal["differential", "belt"] | None = Field(
        default=None,
        description="differential: two shafts turn the first joint together, the second against each other; belt: all "
        "shafts start before the first joint, and reach theirs over wheels on the axes between",
    )
    turns: list[Turns] | None = Field(
        default=None, description="differential: of a shaft, a turn of the first and of the second joint; default 1, 1"
    )
    passes: list[Turns] | None = Field(
        default=None,
        description="belt: what the wheel on each axis but the last passes on, a turn of its own; -1: the other way "
        "round; default 1 each",
    )
    matrix: list[list[Turns]] | None = Field(
        default=None, description="instead of a type: row i, turns of shaft i a turn of each joint"
    )

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if (self.type is None) == (self.matrix is None):
            raise f.refused("must have one of: type (differential or belt), matrix")
        for name in _WANTS.values():
            if getattr(self, name) is not None and _WANTS.get(self.type or "") != name:
                owner = next(kind for kind, wanted in _WANTS.items() if wanted == name)
                raise f.refused(f"{name} goes with type: {owner}")
        return self
