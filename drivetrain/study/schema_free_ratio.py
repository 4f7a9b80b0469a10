"""What a study file may say of a gear whose ratio is still free."""

from __future__ import annotations

from typing import Annotated

from drivetrain.study import fields as f
from drivetrain.study.form import Form


class FreeRatioForm(Form):
    """A gear of any ratio in a range: ideal, or one of a series of the catalogue, scaled.

    The motor is that of the joint's drive, or the one named here.
    """

    ratio: Annotated[f.Interval, f.Between("")]
    series: f.Name | None = None
    motor: f.Name | None = None
