"""Decorators that compile a function of records to a law, which engines call by its address.

    @joint_law(Own)                     # Own: the dataclass of the effect's record, see Effect.own
    def compute(t, h, own, joint): ...

    @table_law(Own)                     # with the effect's table, (rows, columns), see Effect.table
    def compute(t, h, own, joint, table): ...

    @scene_law(Own)                     # of the whole scene, with all joints: ``scene.joints[i]``
    def compute(t, h, own, scene): ...

``own`` and ``joint`` (``connectors.Joint``) are records, read and written by the names of their fields. Since all laws
have the same signature, the engines are compiled once for all scenes.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, cached_property
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np
from numba import carray, types

from drivetrain.effects.connectors import JOINT, WORLD
from drivetrain.jit import callback, law
from drivetrain.records import record_type

# void(t, h, records of the effects, their number, addresses of a run's sections)
SIGNATURE = types.void(types.float64, types.float64, types.voidptr, types.int64, types.CPointer(types.voidptr))
WORLD_AT, JOINTS_AT, MASS_AT = range(3)  # sections of the memory that laws use; they are the first
# Fields before those of ``Own``: index of the joint, section, rows and columns of the table.
HEAD = [("joint", np.int64), ("table", np.int64), ("rows", np.int64), ("columns", np.int64)]


class Whole(NamedTuple):
    """The argument ``scene`` of a law of the whole scene."""

    joints: Any  # records of all joints, (n,)
    world: Any  # the record of the scene, with ``tip``
    mass: Any  # mass matrix of the mechanics [kg m^2 or kg], (c, c)
    table: Any  # of the effect, (rows, columns)


# Templates of the compiled functions: call the law LAW for each of ``count`` records of type OWN.
def _joint_law(t: Any, h: Any, owns: Any, count: Any, run: Any) -> None:
    joints = carray(run[JOINTS_AT], carray(run[WORLD_AT], 1, WORLD)[0].joints, JOINT)
    for own in carray(owns, count, OWN):  # type: ignore[name-defined] # noqa: F821
        LAW(t, h, own, joints[own.joint])  # type: ignore[name-defined] # noqa: F821


def _table_law(t: Any, h: Any, owns: Any, count: Any, run: Any) -> None:
    joints = carray(run[JOINTS_AT], carray(run[WORLD_AT], 1, WORLD)[0].joints, JOINT)
    for own in carray(owns, count, OWN):  # type: ignore[name-defined] # noqa: F821
        LAW(t, h, own, joints[own.joint], carray(run[own.table], (own.rows, own.columns), np.float64))  # type: ignore[name-defined] # noqa: F821


def _scene_law(t: Any, h: Any, owns: Any, count: Any, run: Any) -> None:
    world = carray(run[WORLD_AT], 1, WORLD)[0]
    joints, c = carray(run[JOINTS_AT], world.joints, JOINT), world.coordinates
    mass = carray(run[MASS_AT], (c, c), np.float64)
    for own in carray(owns, count, OWN):  # type: ignore[name-defined] # noqa: F821
        LAW(t, h, own, Whole(joints, world, mass, carray(run[own.table], (own.rows, own.columns), np.float64)))  # type: ignore[name-defined] # noqa: F821


@cache
def own_type(described: type) -> np.dtype[Any]:
    """The record type of an effect: ``HEAD``, then the fields of its dataclass ``Own``."""
    inner = record_type(described, np.int64)
    return np.dtype([*HEAD, *((name, inner[name]) for name in inner.names or ())])


class Law:
    """A law with an address, compiled at its first use or read from the disk cache."""

    def __init__(self, template: Any, described: type, function: Callable[..., None]):
        self._template, self._function, self.described = template, function, described

    @cached_property
    def _library(self) -> Any:
        # A copy of the template with this law and record as globals: numba does not cache closures on disk.
        named = {**self._template.__globals__, "LAW": law(self._function), "OWN": own_type(self.described)}
        own = FunctionType(self._template.__code__, named, self._function.__name__)
        own.__module__, own.__qualname__ = self._function.__module__, self._function.__qualname__
        return callback(SIGNATURE, own)

    @property
    def address(self) -> int:
        """Address of the compiled function."""
        return int(self._library.address)

    def __call__(self, *given: Any) -> None:
        """The law uncompiled, on records or on any objects with their fields, such as the dataclasses of both."""
        self._function(*given)


def joint_law(described: type) -> Callable[[Callable[..., None]], Law]:
    """A law of one joint, ``(t, h, own, joint)``."""
    return lambda function: Law(_joint_law, described, function)


def table_law(described: type) -> Callable[[Callable[..., None]], Law]:
    """A law of one joint with a table, ``(t, h, own, joint, table)``."""
    return lambda function: Law(_table_law, described, function)


def scene_law(described: type) -> Callable[[Callable[..., None]], Law]:
    """A law of the whole scene, ``(t, h, own, scene)``."""
    return lambda function: Law(_scene_law, described, function)


LOAD, MOTOR, SHAFT = range(3)  # the flanges of a joint, see ``flange_of``


def side_of(side: str, place: Any) -> int:
    """The flange on which friction at a side of the gear acts; ``shaft`` is the joint where no motors are coupled."""
    return MOTOR if side == "motor" else SHAFT if side == "shaft" and place.coupled else LOAD


@law
def flange_of(joint: Any, side: int) -> Any:
    """The flange of a joint that LOAD, MOTOR or SHAFT selects."""
    if side == MOTOR:
        return joint.motor
    if side == SHAFT:
        return joint.shaft
    return joint.load


@law
def command_of(joint: Any, coupled: int) -> Any:
    """The command that a motor's loop follows: the joint's, or the gear's output shaft's where motors are coupled."""
    return joint.shaft_command if coupled else joint.command
