"""What a study assumes of gears and motors where their sheets are silent: shipped defaults under the study's own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml
from pydantic import ValidationError

from drivetrain.catalog.schema import GEAR_KINDS
from drivetrain.errors import Fault, InputError, nearest
from drivetrain.study.ledger import Ledger
from drivetrain.study.schema_parts import AssumptionsForm, GearAssumptionForm, MotorAssumptionForm
from drivetrain.study.study import GearAssumption, MotorAssumption

MOTOR_GROUPS = ("brushed", "brushless", "frameless")
SHIPPED = Path(__file__).with_name("assumptions.yaml")


def resolve_assumptions(
    own: AssumptionsForm, ledger: Ledger
) -> tuple[dict[str, GearAssumption], dict[str, MotorAssumption]]:
    """The assumptions by gear kind and by motor group: the study's own entry replaces the shipped one as a whole."""
    shipped = shipped_assumptions()
    for part, known in (("gears", GEAR_KINDS), ("motors", MOTOR_GROUPS)):
        for kind in getattr(own, part):
            if kind not in known:
                ledger.fault(("assumptions", part, kind), "is no kind to assume for", hint=nearest(kind, known))
    gears = {kind: _gear(form) for kind, form in {**shipped.gears, **own.gears}.items()}
    motors = {kind: _motor(form) for kind, form in {**shipped.motors, **own.motors}.items()}
    return gears, motors


def shipped_assumptions() -> AssumptionsForm:
    """The defaults that ship with the package.

    Returns:
        As a form, values in SI.

    Raises:
        InputError: The shipped file is damaged.
    """
    try:
        data: Any = yaml.safe_load(SHIPPED.read_text(encoding="utf-8"))
        return AssumptionsForm.model_validate(data)
    except (yaml.YAMLError, ValidationError) as error:
        raise InputError(Fault("shipped assumptions", f"cannot be read: {error}", file=SHIPPED.name)) from None


def _gear(form: GearAssumptionForm) -> GearAssumption:
    return GearAssumption(form.efficiency, form.backdriving_efficiency, form.no_load_torque_share, form.source)


def _motor(form: MotorAssumptionForm) -> MotorAssumption:
    return MotorAssumption(
        form.max_winding_temperature, form.winding_time_constant, form.housing_time_constant, form.source
    )
