"""One of the many arms that may be built: parts, payload and air drawn within their tolerances."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from drivetrain.arrays import Array
from drivetrain.catalog.read import Catalog
from drivetrain.drive.drive import Drive, shaft_friction
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.sizing.judge.fill import Shelf
from drivetrain.study.model import JointTask, Study
from drivetrain.study.tolerances import SMALLEST, Tolerance

PARTS = ("torque_constant", "resistance", "friction", "efficiency", "thermal_resistance")
CONSTANT, RESISTANCE, FRICTION, EFFICIENCY, THERMAL = range(5)

Pair = tuple[str, str]


@dataclass(frozen=True)
class Source:
    """One number that scatters by itself.

    Attributes:
        quantity: Name of its tolerance.
        place: Name of the joint or the payload; empty for the air.
    """

    quantity: str
    place: str = ""

    def __str__(self) -> str:
        words = self.quantity.replace("_", " ")
        return f"{words} of {self.place}" if self.place else words


@dataclass(frozen=True, eq=False)
class Draws:
    """Many arms as they may be built.

    Attributes:
        factors: On the numbers of each joint, in the order of ``PARTS``, (samples, n, 5).
        ambient: Air temperature [C], (samples,).
        payload: Factors on mass and inertia of each payload, (samples, payloads).
    """

    factors: Array
    ambient: Array
    payload: Array

    def __len__(self) -> int:
        return len(self.ambient)


def sources(study: Study) -> tuple[Source, ...]:
    """What scatters in a study, each by itself."""
    given = study.tolerances.given
    found = [Source(name, task.name) for task in study.joints for name in PARTS if name in given]
    if "payload" in given and study.arm is not None:
        found += [Source("payload", body.name) for body in study.payloads if body.mass > 0.0]
    return (*found, Source("ambient")) if "ambient" in given else tuple(found)


def drawn(study: Study, samples: int, seed: int | tuple[int, ...]) -> Draws:
    """Arms drawn at random."""
    return from_uniform(study, np.random.default_rng(seed).random((samples, len(sources(study)))))


def streamed(study: Study, samples: int, seed: int | tuple[int, ...], *, most: int) -> Iterator[Draws]:
    """The same arms, some at a time, so that a million of them need no more memory than the first."""
    stream, columns = np.random.default_rng(seed), len(sources(study))
    for first in range(0, samples, most):
        yield from_uniform(study, stream.random((min(most, samples - first), columns)))


def from_uniform(study: Study, uniform: Array) -> Draws:
    """Arms by the probabilities of smaller deviations.

    Args:
        uniform: Numbers between 0 and 1, one column a source, (samples, sources).
    """
    found, edge = sources(study), 2.0**-53  # neither 0 nor 1: no law has an end at infinity
    columns = np.clip(uniform, edge, 1.0 - edge).T
    deviations = [_tolerance(study, one).deviation(column) for one, column in zip(found, columns, strict=True)]
    return deviated(study, len(uniform), dict(zip(found, deviations, strict=True)))


def deviated(study: Study, samples: int, deviations: Mapping[Source, Array]) -> Draws:
    """Arms with given deviations.

    Args:
        deviations: Of some sources, in the unit of their tolerance, (samples,) each; the rest is nominal.
    """
    names = [task.name for task in study.joints]
    bodies = [body.name for body in study.payloads]
    factors = np.ones((samples, len(names), len(PARTS)))
    ambient, payload = np.full(samples, study.ambient), np.ones((samples, len(bodies)))
    for source, deviation in deviations.items():
        if source.quantity == "ambient":
            ambient += deviation
        elif source.quantity == "payload":
            body = bodies.index(source.place)
            mass = study.payloads[body].mass if _tolerance(study, source).absolute else 1.0
            payload[:, body] = np.maximum(1.0 + deviation / mass, 0.0)
        else:
            at = names.index(source.place), PARTS.index(source.quantity)
            factors[:, at[0], at[1]] = np.maximum(1.0 + deviation, SMALLEST)
    return Draws(factors, ambient, payload)


def built(study: Study, drives: Mapping[str, Pair], draws: Draws, sample: int) -> Study:
    """The study of one arm as it is built: catalogue rows, payload and air of its own.

    Args:
        drives: Keys of (motor, gear) by joint name.
    """
    shelf = Shelf(study)
    motors: dict[str, Motor] = {}
    gears: dict[str, Gear] = {}
    tasks: list[JointTask] = []
    for task, factors in zip(study.joints, draws.factors[sample], strict=True):
        motor, gear = drives[task.name]
        drive = built_drive(shelf.drive(task, motor, gear), factors)
        mark = f"@{task.name}"
        motors[motor + mark] = replace(drive.motor, key=motor + mark)
        if gear:
            gears[gear + mark] = replace(drive.gear, key=gear + mark)
        tasks.append(_task(task, (motor + mark, gear + mark if gear else ""), drive, float(factors[THERMAL])))
    return replace(
        study,
        joints=tuple(tasks),
        catalog=Catalog(motors, gears),
        ambient=float(draws.ambient[sample]),
        payloads=tuple(
            replace(body, mass=body.mass * float(share), inertia=body.inertia * float(share))
            for body, share in zip(study.payloads, draws.payload[sample], strict=True)
        ),
    )


def built_drive(drive: Drive, factors: Array) -> Drive:
    """A drive as it is built.

    What a sheet prints as a limit (currents, torques, speeds, temperatures) stays as printed; what is computed from
    the numbers that scatter follows them. Heat capacities stay, so thermal time constants follow the resistances.

    Args:
        factors: On them, in the order of ``PARTS``, (5,).
    """
    constant, resistance, friction, efficiency, thermal = (float(value) for value in factors)
    motor, gear = drive.motor, drive.gear
    nominal = motor.nominal_current
    if nominal is None and motor.nominal_torque is not None:
        nominal = motor.nominal_torque / motor.torque_constant
    names = (
        "resistance_winding_housing", "resistance_housing_ambient", "resistance_winding_ambient",
        "winding_time_constant", "housing_time_constant",
    )  # fmt: skip
    warm = {name: _scaled(getattr(motor, name), thermal) for name in names}
    return replace(
        drive,
        motor=replace(
            motor, torque_constant=motor.torque_constant * constant, resistance=motor.resistance * resistance,
            nominal_current=nominal, **warm,  # type: ignore[arg-type]
        ),
        gear=_built_gear(gear, friction, efficiency),
        joint_friction=_rubbing(drive.joint_friction, friction),
        motor_friction=_rubbing(shaft_friction(drive), friction),
    )  # fmt: skip


def _built_gear(gear: Gear, friction: float, efficiency: float) -> Gear:
    if gear.kind == "ideal":
        return gear
    return replace(
        gear,
        efficiency=None if gear.efficiency is None else min(gear.efficiency * efficiency, 1.0),
        backdriving_efficiency=_back(gear.backdriving_efficiency, efficiency),
        no_load_torque=_scaled(gear.no_load_torque, friction),
    )


def _back(given: float | None, efficiency: float) -> float | None:
    """A negative one (self-locking) is a loss too: a better gear locks less."""
    if given is None:
        return None
    return min(given * efficiency if given >= 0.0 else given / efficiency, 1.0)


def _task(task: JointTask, keys: Pair, drive: Drive, thermal: float) -> JointTask:
    return replace(
        task,
        drive=keys,
        pairs=(),
        friction=drive.joint_friction,
        motor_friction=drive.motor_friction,
        housing_to_ambient=_scaled(task.housing_to_ambient, thermal),
    )


def _rubbing(law: Friction, factor: float) -> Friction:
    """A friction law with all its torques larger or smaller."""
    names = ("coulomb", "coulomb_negative", "viscous", "viscous_negative", "static")
    return replace(law, **{name: _scaled(getattr(law, name), factor) for name in names})  # type: ignore[arg-type]


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else value * factor


def _tolerance(study: Study, source: Source) -> Tolerance:
    found = getattr(study.tolerances, source.quantity)
    return found if isinstance(found, Tolerance) else Tolerance(0.0)
