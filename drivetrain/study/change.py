"""The same task made harder or easier: payload, force, pace, voltage and ambient changed, everything else kept."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from drivetrain.errors import Fault, InputError, nearest, raise_faults
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.study.model import Payload, ProcessForce, Study, refuse_moving_base


@dataclass(frozen=True)
class TaskChange:
    """Changes of a task; the default changes nothing.

    Attributes:
        payload: Factor on mass and inertia of payloads (same shape, other density); 0 or more.
        time: Factor on the length of the cycle: the same path, uniformly slower or faster; positive.
        voltage: Factor on the supply's voltage; positive.
        ambient: Added to the ambient temperature [K].
        payloads: Names of the payloads that ``payload`` scales; empty: all.
        force: Factor on the forces and moments at the tip; 0 or more.
    """

    payload: float = 1.0
    time: float = 1.0
    voltage: float = 1.0
    ambient: float = 0.0
    payloads: tuple[str, ...] = ()
    force: float = 1.0

    def __post_init__(self) -> None:
        faults = []
        for name in ("payload", "force"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                faults.append(Fault(name, "a factor must be 0 or more", value))
        for name in ("time", "voltage"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                faults.append(Fault(name, "a factor must be positive", value))
        if not math.isfinite(self.ambient):
            faults.append(Fault("ambient", "a difference of temperature must be finite [K]", self.ambient))
        raise_faults(faults)


def changed(study: Study, change: TaskChange) -> Study:
    """The task with a change.

    A motion slowed by the factor s passes the same positions at s times the instants, with 1/s of the speed and 1/s^2
    of the acceleration, dwells included. Torques of a load table are kept, as no law says how they would change.

    Args:
        study: The task.
        change: What to change.

    Returns:
        The changed task; the name of the study and its digest stay.

    Raises:
        InputError: The study does not have a named payload, or ``time`` is not 1 while the base moves: the motion of
            the base does not scale with the cycle.
    """
    if change.time != 1.0:
        refuse_moving_base(study, "another pace of the cycle")
    strangers = [name for name in change.payloads if name not in [one.name for one in study.payloads]]
    if strangers:
        known = [one.name for one in study.payloads]
        raise InputError([Fault("payload", "is none of the study's", n, nearest(n, known)) for n in strangers])
    payloads = tuple(
        replace(one, mass=one.mass * change.payload, inertia=one.inertia * change.payload)
        if scales(change.payloads, one.name)
        else one
        for one in study.payloads
    )
    return replace(
        study,
        payloads=payloads,
        forces=tuple(_pressing(one, change.force) for one in study.forces),
        cycle=_forced(slowed(study.cycle, change.time), change.force),
        supply=replace(study.supply, voltage=study.supply.voltage * change.voltage),
        ambient=study.ambient + change.ambient,
    )


def heaviest(study: Study) -> tuple[Payload, ...]:
    """The heaviest payload, which a curve over payload varies, as a tuple of one; empty if none has a mass."""
    weighing = [one for one in study.payloads if one.mass > 0.0]
    return tuple(sorted(weighing, key=lambda one: -one.mass)[:1]) if study.arm is not None else ()


def carrying_mass(study: Study, mass: float) -> Study:
    """The task with another mass of its heaviest payload [kg] (same shape, other density); the name states the mass."""
    most = heaviest(study)
    if not most:
        raise InputError(Fault("payload", "cannot be varied: the study carries none of any mass", study.name))
    change = TaskChange(payload=mass / most[0].mass, payloads=(most[0].name,))
    return replace(changed(study, change), name=f"{study.name}, {mass:g} kg")


def scales(payloads: Collection[str], name: str) -> bool:
    """Whether a change restricted to ``payloads`` (empty: all) scales the payload ``name``."""
    return not payloads or name in payloads


def _pressing(force: ProcessForce, factor: float) -> ProcessForce:
    """A force with all its parts multiplied by a factor."""

    def scaled(vector: tuple[float, float, float]) -> tuple[float, float, float]:
        x, y, z = vector
        return factor * x, factor * y, factor * z

    table = None if force.table is None else np.column_stack([force.table[:, 0], factor * force.table[:, 1:]])
    return replace(
        force, force=scaled(force.force), moment=scaled(force.moment), along_motion=factor * force.along_motion,
        table=table,
    )  # fmt: skip


def _forced(cycle: Cycle, factor: float) -> Cycle:
    """The cycle with the force at the tip multiplied by a factor."""
    if factor == 1.0 or cycle.tip_wrench is None:
        return cycle
    return replace(cycle, tip_wrench=factor * cycle.tip_wrench)


def slowed(cycle: Cycle, factor: float) -> Cycle:
    """The cycle along the same path with its duration multiplied by ``factor``."""
    if factor == 1.0:
        return cycle
    return replace(
        cycle,
        time=cycle.time * factor,
        velocity=cycle.velocity / factor,
        acceleration=cycle.acceleration / factor**2,
    )
