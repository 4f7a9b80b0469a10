"""One drawn sample as a study of its own, so that ``evaluate`` can judge it: the reference of tolerance sampling."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from drivetrain.catalog.read import Catalog
from drivetrain.drive.drive import Drive, shaft_friction
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.sizing.judge.parts import FilledParts
from drivetrain.sizing.tolerance.draws import THERMAL, Draws, Pair
from drivetrain.study.model import JointTask, Study

Array = np.ndarray


def built(study: Study, drives: Mapping[str, Pair], draws: Draws, sample: int) -> Study:
    """The study of one arm as it is built: catalogue rows, payload, force at the tip and air of its own.

    Args:
        drives: Keys of (motor, gear) by joint name.
    """
    filled_parts = FilledParts(study)
    motors: dict[str, Motor] = {}
    gears: dict[str, Gear] = {}
    tasks: list[JointTask] = []
    for task, factors in zip(study.joints, draws.factors[sample], strict=True):
        motor, gear = drives[task.name]
        drive = built_drive(filled_parts.drive(task, motor, gear), factors)
        mark = f"@{task.name}"
        motors[motor + mark] = replace(drive.motor, key=motor + mark)
        if gear:
            gears[gear + mark] = replace(drive.gear, key=gear + mark)
        tasks.append(_task(task, (motor + mark, gear + mark if gear else ""), drive, float(factors[THERMAL])))
    cycle, loads = study.cycle, draws.loads[sample]
    return replace(
        study,
        joints=tuple(tasks),
        cycle=cycle if cycle.tip_wrench is None else replace(cycle, tip_wrench=loads[-1] * cycle.tip_wrench),
        catalog=Catalog(motors, gears),
        ambient=float(draws.ambient[sample]),
        payloads=tuple(
            replace(body, mass=body.mass * float(share), inertia=body.inertia * float(share))
            for body, share in zip(study.payloads, loads[:-1], strict=True)
        ),
    )


def built_drive(drive: Drive, factors: Array) -> Drive:
    """A drive as it is built.

    What a sheet prints as a limit (currents, torques, speeds, temperatures) stays as printed; what is computed from
    the numbers that scatter follows them. Heat capacities stay, so thermal time constants follow the resistances.

    Args:
        factors: On them, in the order of ``PARTS``, (6,).
    """
    constant, resistance, friction, efficiency, thermal, drag = (float(value) for value in factors)
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
        gear=_built_gear(gear, friction, efficiency, drag),
        joint_friction=_rubbing(drive.joint_friction, friction),
        motor_friction=_rubbing(shaft_friction(drive), friction),
    )  # fmt: skip


def _built_gear(gear: Gear, friction: float, efficiency: float, drag: float) -> Gear:
    if gear.kind == "ideal":
        return gear
    return replace(
        gear,
        efficiency=None if gear.efficiency is None else min(gear.efficiency * efficiency, 1.0),
        mesh_efficiency=None if gear.mesh_efficiency is None else min(gear.mesh_efficiency * efficiency, 1.0),
        drag_torque=_scaled(gear.drag_torque, drag),
        seal_drag_torque=_scaled(gear.seal_drag_torque, drag),
        starting_torque=_scaled(gear.starting_torque, drag),
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
