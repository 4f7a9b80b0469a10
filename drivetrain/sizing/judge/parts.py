"""The candidates of a study as tables: filled sheets, pairs by joint, and the numbers by which they load joints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.drive import Drive, shaft_friction
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import NO_GEAR, Gear
from drivetrain.drive.motor import Motor
from drivetrain.records import as_records
from drivetrain.sizing.demand.demand import JointDemand
from drivetrain.sizing.demand.load_basis import NUMBERS
from drivetrain.sizing.judge.cases import gear_records, motor_records, paired
from drivetrain.sizing.judge.fill import FilledParts
from drivetrain.study.model import DriveMass, Study
from drivetrain.study.parts.mounting import cylinder_inertia


@dataclass(frozen=True, eq=False)
class Parts:
    """Motors and gears that occur in a study, each once, and the pairs of every joint.

    Attributes:
        study: The task.
        motor_keys, gear_keys: By row; the direct drive's gear, of key "", is the first.
        motors, gears: Sheets with the study's assumptions filled in.
        motor_rows, gear_rows: The same as records (``cases.motor_records``, ``cases.gear_records``).
        pairs: Of each joint, row of the motor and of the gear, (P, 2) each; of a given drive that one alone.
        amounts: Through which each pair loads joints, the units of ``load_basis.drive_numbers``, (P, NUMBERS) a joint.
        mass, price: Of each pair [kg], [-], NaN where unknown, (P,) a joint.
    """

    study: Study
    motor_keys: tuple[str, ...]
    gear_keys: tuple[str, ...]
    motors: tuple[Motor, ...]
    gears: tuple[Gear, ...]
    motor_rows: Any
    gear_rows: Any
    pairs: tuple[Any, ...]
    amounts: tuple[Array, ...]
    mass: tuple[Array, ...]
    price: tuple[Array, ...]

    def keys(self, joint: int, pair: int) -> tuple[str, str]:
        """The catalogue keys of a pair."""
        motor, gear = self.pairs[joint][pair]
        return self.motor_keys[motor], self.gear_keys[gear]

    def drive(self, joint: int, pair: int) -> Drive:
        """A pair as a drive."""
        motor, gear = self.pairs[joint][pair]
        task = self.study.joints[joint]
        return Drive(self.motors[motor], self.gears[gear], task.friction, task.motor_friction)

    def cases(self, joint: int, demand: JointDemand, chosen: Any = slice(None)) -> Any:
        """Pairs of a joint as records for the judge, all or some, (P,)."""
        friction = self.study.joints[joint].motor_friction
        shafts = as_records(
            [shaft_friction(Drive(one, NO_GEAR, motor_friction=friction)) for one in self.motors], Friction
        )
        return paired(self.study, joint, demand, (self.motor_rows, shafts), self.gear_rows, self.pairs[joint][chosen])


def parts_of(study: Study) -> Parts:
    """The candidates of a study."""
    filled_parts = FilledParts(study)
    lists = [task.pairs if task.drive is None else (task.drive,) for task in study.joints]
    motor_keys = tuple(dict.fromkeys(motor for one in lists for motor, _ in one))
    gear_keys = tuple(dict.fromkeys(["", *(gear for one in lists for _, gear in one)]))
    motors, gears = tuple(map(filled_parts.motor, motor_keys)), tuple(map(filled_parts.gear, gear_keys))
    left = {key: row for row, key in enumerate(motor_keys)}
    right = {key: row for row, key in enumerate(gear_keys)}
    known: dict[int, Any] = {}  # joints often share a list
    for one in lists:
        if id(one) not in known:
            rows = dict.fromkeys((left[motor], right[gear]) for motor, gear in one)
            known[id(one)] = np.array(list(rows), dtype=np.int64).reshape(-1, 2)
    pairs = tuple(known[id(one)] for one in lists)
    weighed = _column([0.0 if one.kind == "ideal" and one.mass is None else one.mass for one in gears])
    priced = _column([0.0 if one.key == "" else one.price for one in gears])
    mass, price = _column([one.mass for one in motors]), _column([one.price for one in motors])
    return Parts(
        study, motor_keys, gear_keys, motors, gears, motor_records(motors), gear_records(gears), pairs,
        tuple(_amounts(study, joint, motors, gears, some) for joint, some in enumerate(pairs)),
        tuple(mass[some[:, 0]] + weighed[some[:, 1]] for some in pairs),
        tuple(price[some[:, 0]] + priced[some[:, 1]] for some in pairs),
    )  # fmt: skip


def _amounts(study: Study, joint: int, motors: tuple[Motor, ...], gears: tuple[Gear, ...], pairs: Any) -> Array:
    """``load_basis.drive_numbers`` of all pairs of a joint at once."""
    left, right = pairs[:, 0], pairs[:, 1]
    bodies = [np.array([_body(part) for part in parts]).reshape(-1, 3) for parts in (motors, gears)]
    mass, across, along = (bodies[0][left] + bodies[1][right]).T
    rotor = np.array([motor.rotor_inertia or 0.0 for motor in motors])[left]
    spinning = rotor + np.array([gear.inertia or 0.0 for gear in gears])[right]
    ratio = np.array([gear.ratio for gear in gears])[right] / (study.joints[joint].travel_per_turn or 1.0)
    moved = [mass, across, along - np.minimum(rotor, along)]
    if study.drive_mass is DriveMass.INCLUDED:
        moved = [np.zeros(len(pairs))] * 3
    return np.ascontiguousarray(np.stack([*moved, spinning, spinning * ratio], axis=1)).reshape(-1, NUMBERS)


def _body(part: Motor | Gear) -> tuple[float, float, float]:
    """Mass, inertia across and along the axis; of an unknown mass nothing."""
    return part.mass or 0.0, *cylinder_inertia(part.mass, part.diameter, part.length)


def _column(values: list[float | None]) -> Array:
    return np.array(values, dtype=np.float64)  # None becomes NaN
