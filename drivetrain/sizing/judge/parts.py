"""The candidates of a study as tables: completed data sheets, pairs by joint, and their contributions to joint
loads.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.brake import Brake
from drivetrain.drive.drive import Drive
from drivetrain.drive.gear import HOLDING, NO_GEAR, Gear
from drivetrain.drive.motor import Motor, has_friction_data, whole_mass
from drivetrain.drive.motor_limits import FRICTION_SHARE, with_allowances
from drivetrain.records import known
from drivetrain.sizing.demand.load_basis import PARAMETERS
from drivetrain.sizing.judge.cases import gear_records, motor_records
from drivetrain.study.model import DriveMass, JointTask, MotorAssumption, Study
from drivetrain.study.parts.mounting import cylinder_inertia


@dataclass(frozen=True, eq=False)
class Parts:
    """The motors and gears of a study, each once, and the pairs of every joint."""

    study: Study  # the task
    # by row; row 0 of the gears is the direct drive, with key ""
    motor_keys: tuple[str, ...]
    gear_keys: tuple[str, ...]
    # data sheets with the study's assumptions filled in
    motors: tuple[Motor, ...]
    gears: tuple[Gear, ...]
    # the same as records (``cases.motor_records``, ``cases.gear_records``)
    motor_rows: Any
    gear_rows: Any
    pairs: tuple[Any, ...]  # for each joint the rows of motor and gear, (P, 2) each; a single row if the drive is given
    # parameters by which each pair loads joints, ``load_basis.load_parameters``, (P, PARAMETERS) a joint
    amounts: tuple[Array, ...]
    # mass [kg] and price of each pair, NaN if unknown, (P,) a joint
    mass: tuple[Array, ...]
    price: tuple[Array, ...]


def parts_of(study: Study) -> Parts:
    """The candidates of a study."""
    filled_parts = FilledParts(study)
    lists = [task.choices for task in study.joints]
    different = {id(one): one for one in lists}  # joints often share a list of candidates
    # keys of the motors and of the gears, each pair once
    columns = {key: tuple(zip(*dict.fromkeys(one), strict=True)) or ((), ()) for key, one in different.items()}
    motor_keys = tuple(dict.fromkeys(key for motors, _ in columns.values() for key in motors))
    gear_keys = tuple(dict.fromkeys(["", *(key for _, gears in columns.values() for key in gears)]))
    motors, gears = tuple(map(filled_parts.motor, motor_keys)), tuple(map(filled_parts.gear, gear_keys))
    left = {key: row for row, key in enumerate(motor_keys)}
    right = {key: row for row, key in enumerate(gear_keys)}
    rows = {
        key: np.array([[left[motor] for motor in motors], [right[gear] for gear in gears]], dtype=np.int64).T.copy()
        for key, (motors, gears) in columns.items()
    }
    pairs = tuple(rows[id(one)] for one in lists)
    weighed = _column([0.0 if one.kind == "ideal" and one.mass is None else one.mass for one in gears])
    priced = _column([0.0 if one.key == "" else one.price for one in gears])
    mass, price = _column([whole_mass(one) for one in motors]), _column([one.price for one in motors])
    bodies = np.array([(*_body(one), one.rotor_inertia or 0.0) for one in motors]).reshape(-1, 4)
    wheels = np.array([(*_body(one), one.inertia or 0.0, one.ratio) for one in gears])
    return Parts(
        study, motor_keys, gear_keys, motors, gears, motor_records(motors), gear_records(gears), pairs,
        tuple(_amounts(study, joint, bodies[some[:, 0]], wheels[some[:, 1]]) for joint, some in enumerate(pairs)),
        tuple(mass[some[:, 0]] + weighed[some[:, 1]] for some in pairs),
        tuple(price[some[:, 0]] + priced[some[:, 1]] for some in pairs),
    )  # fmt: skip


def _amounts(study: Study, joint: int, motors: Array, gears: Array) -> Array:
    """``load_basis.load_parameters`` of all pairs of a joint at once, (P, PARAMETERS), from ``_body`` and rotor inertia
    of the motors, (P, 4), and ``_body``, inertia and ratio of the gears, (P, 5).
    """
    mass, across, along = (motors[:, :3] + gears[:, :3]).T
    rotor, spinning = motors[:, 3], motors[:, 3] + gears[:, 3]
    ratio = gears[:, 4] / (study.joints[joint].travel_per_turn or 1.0)
    moved = [mass, across, along - np.minimum(rotor, along)]
    if study.drive_mass is DriveMass.INCLUDED:
        moved = [np.zeros(len(motors))] * 3
    return np.ascontiguousarray(np.stack([*moved, spinning, spinning * ratio], axis=1)).reshape(-1, PARAMETERS)


def _body(part: Motor | Gear) -> tuple[float, float, float]:
    """Mass [kg] and inertias across and along the axis [kg m^2]; zeros if the mass is unknown."""
    return part.mass or 0.0, *cylinder_inertia(part.mass, part.diameter, part.length)


def _column(values: list[float | None]) -> Array:
    return np.array(values, dtype=np.float64)  # None becomes NaN


# A drive from two catalogue rows, with the study's assumptions where the data sheets give no value.


# Inertia at the input over that of a solid cylinder of the gear's mass and diameter: 95th percentile of the rows of
# the source catalogues that print it (560 planetary, 24 koaxdrive, 118 strain wave); RV as strain wave.
INPUT_INERTIA_SHARE = {"planetary": 0.03, "spur": 0.03, "koaxdrive": 0.004, "strain_wave": 0.085, "rv": 0.085}
# density of a cylinder of equal length and diameter: mass over diameter cubed [kg/m^3]
_ROUND_DENSITY = 5200.0 * 3.141592653589793 / 4.0


class FilledParts:
    """The catalogue rows of a study with missing data filled where it states an assumption; each row is filled once.

    Attributes:
        study: The study with its catalogue and assumptions.
    """

    def __init__(self, study: Study) -> None:
        self.study = study
        self._motors: dict[str, tuple[Motor, tuple[str, ...]]] = {}
        self._gears: dict[str, tuple[Gear, tuple[str, ...]]] = {"": _filled_gear(NO_GEAR, study)}

    def drive(self, task: JointTask, motor: str, gear: str) -> Drive:
        """The drive of one motor and one gear at one joint."""
        row, wheel = self.motor(motor), self.gear(gear)
        motor_words, gear_words = self._motors[motor][1], self._gears[gear][1]
        words = [*motor_words, *gear_words]
        if task.motor_friction is None and not has_friction_data(row):
            words.append(_friction_allowance(row))
        if row.inductance is None:
            lag = with_allowances(row).inductance_allowance / row.resistance
            words.append(
                f"motor {motor}: inductance is not in the catalogue row and left out; voltage must hold with "
                f"L/R = {1e3 * lag:g} ms too, more than shipped rows of its kind have"
            )
        if row.brake.key:
            words.append(_with_brake(row.brake))
        if task.housing_to_ambient is not None and _lumped(row):
            words.append(_mounted(row, task.housing_to_ambient, self.study))
        return Drive(row, wheel, task.friction, task.motor_friction, tuple(words))

    def motor(self, key: str) -> Motor:
        if key not in self._motors:
            self._motors[key] = _filled_motor(self.study.catalog.motors[key], self.study)
        return self._motors[key][0]

    def gear(self, key: str) -> Gear:
        if key not in self._gears:
            self._gears[key] = _filled_gear(self.study.catalog.gears[key], self.study)
        return self._gears[key][0]

    def filled(self, gear: Gear) -> Gear:
        """A gear that is in no catalogue, with assumptions filled in."""
        return _filled_gear(gear, self.study)[0]


def _friction_allowance(motor: Motor) -> str:
    """Remark on a data sheet without complete no-load data."""
    if motor.frameless:
        missing = "a frameless motor has no bearings; no-load friction is not in the catalogue row and not counted"
        return f"motor {motor.key}: {missing}"
    allowance = with_allowances(motor).friction_allowance
    size = f"{allowance:.3g} N m, " if known(allowance) else ""
    return (
        f"motor {motor.key}: the catalogue row does not give all of its no-load friction; torque, current, voltage and "
        f"heat must hold with {size}{100 * FRICTION_SHARE:g} % of its continuous torque on top too, more than shipped "
        "motors with a housing have"
    )


def _with_brake(brake: Brake) -> str:
    """Remark on the mass and inertia that a brake adds to its motor."""
    mass = "mass unknown" if brake.mass is None else f"{brake.mass:g} kg"
    added = f"{mass}, {brake.inertia:g} kg m^2, {brake.power:g} W while it is open"
    return f"brake {brake.key}: {added} count with its motor"


def _lumped(motor: Motor) -> bool:
    """Whether a data sheet gives only one thermal resistance, from winding to ambient."""
    parts = (motor.resistance_winding_housing, motor.resistance_housing_ambient)
    return motor.resistance_winding_ambient is not None and parts == (None, None)


def _mounted(motor: Motor, mounting: float, study: Study) -> str:
    """Remark on how a single thermal resistance is split if the study states the mounting."""
    whole, assumption = motor.resistance_winding_ambient, _assumption(motor, study)
    text = f"motor {motor.key}: one thermal resistance in the catalogue row, {whole:g} K/W from winding to ambient"
    if assumption is None or assumption.winding_share is None:
        return f"{text}; the larger of that and the stated {mounting:g} K/W is taken for all of it"
    return f"{text}; {100 * assumption.winding_share:g} % of it assumed between winding and housing"


def _assumption(motor: Motor, study: Study) -> MotorAssumption | None:
    return study.motor_assumptions.get("frameless" if motor.frameless else motor.kind)


def _filled_motor(motor: Motor, study: Study) -> tuple[Motor, tuple[str, ...]]:
    """The completed motor, and remarks on what was assumed."""
    assumption = _assumption(motor, study)
    if assumption is None:
        return motor, ()
    words: list[str] = []
    changes: dict[str, float] = {}
    named = (
        ("max_winding_temperature", "winding limit", "°C"),
        ("winding_time_constant", "winding time constant", "s"),
        ("housing_time_constant", "housing time constant", "s"),
    )
    for field, name, unit in named:
        value = getattr(assumption, field)
        if value is not None and getattr(motor, field) is None:
            changes[field] = value
            words.append(_words(f"motor {motor.key}: {name} {value:g} {unit} assumed", assumption.source))
    if assumption.winding_share is not None and _lumped(motor):
        changes["winding_share"] = assumption.winding_share  # reported where a mounting is stated
    return (replace(motor, **changes) if changes else motor), tuple(words)  # type: ignore[arg-type]


def _filled_gear(gear: Gear, study: Study) -> tuple[Gear, tuple[str, ...]]:
    """The completed gear, and remarks on what was assumed."""
    words: list[str] = []
    changes: dict[str, float] = {"holding": HOLDING[study.holding]} if study.holding != "lossless" else {}
    assumption = study.gear_assumptions.get(gear.kind)
    if assumption is not None:
        apart = gear.mesh_efficiency is not None or gear.drag_torque is not None
        for field, name in (("efficiency", "efficiency"), ("backdriving_efficiency", "back-driving efficiency")):
            value = getattr(assumption, field)
            if value is not None and getattr(gear, field) is None and not apart:
                changes[field] = value
                words.append(_words(f"gear {gear.key}: {name} {100 * value:g} % assumed", assumption.source))
        share = assumption.no_load_torque_share
        if share is not None and gear.no_load_torque is None and not apart and gear.continuous_torque is not None:
            changes["no_load_torque"] = share * gear.continuous_torque / abs(gear.ratio)
            text = f"gear {gear.key}: no-load running torque {100 * share:g} % of rated torque over ratio assumed"
            words.append(_words(text, assumption.source))
    if gear.mesh_efficiency is not None and gear.loss_basis:
        words.append(f"gear {gear.key}: mesh efficiency {100 * gear.mesh_efficiency:g} % and drag: {gear.loss_basis}")
    inertia = _input_inertia(gear)
    if inertia is not None:
        changes["inertia"] = inertia + gear.stage_inertia
        text = f"gear {gear.key}: input inertia {inertia:.2g} kg m^2 assumed"
        share = INPUT_INERTIA_SHARE[gear.kind]
        words.append(_words(text, f"{share:g} of a solid cylinder's, high among gears of its kind"))
    return (replace(gear, **changes) if changes else gear), tuple(words)  # type: ignore[arg-type]


def _input_inertia(gear: Gear) -> float | None:
    """A conservative estimate of a missing input inertia; None if it is given or nothing is known."""
    if gear.inertia is not None or gear.mass is None or gear.kind not in INPUT_INERTIA_SHARE:
        return None
    mass = gear.mass - gear.stage_mass
    squared = (mass / _ROUND_DENSITY) ** (2.0 / 3.0) if gear.diameter is None else gear.diameter**2
    return INPUT_INERTIA_SHARE[gear.kind] * mass * squared / 8.0


def _words(text: str, source: str) -> str:
    return f"{text} ({source})" if source else text
