"""The commanded motion: positions, speeds and accelerations of all joints over time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drivetrain.arrays import Array, checked_array
from drivetrain.drive.drive import resting
from drivetrain.effects import signals as s
from drivetrain.effects.effect import Effect, Place, Ports, Signal
from drivetrain.effects.laws import scene_law
from drivetrain.effects.tables import interval_of, repeated_time
from drivetrain.errors import Fault, InputError, nearest
from drivetrain.jit import law
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.motion.motion import Motion

MOST_REPETITIONS = 1_000_000  # each adds instants at which steps end
ROUNDING = 1e-15  # share by which a rounded time may exceed the end of a command that it belongs to
JERK_TOLERANCE = 1e-6  # jump of the jerk, over the largest jerk, that may come from rounding of the samples


@dataclass
class Own:
    """Record of the effect. Table rows: time [s], then position, speed and acceleration of each joint, each shaft."""

    period: float  # of a repeated motion [s]; 0: not repeated
    last: float  # end of the command [s]
    holds: float  # from then on its last position is held [s]
    shafts: int  # whether shafts of coupled motors follow the joints in the table


@law
def _interpolate(command: Any, table: Any, low: int, at: int, t: float, ended: bool) -> None:
    """Interpolate a command between two samples with the quintic polynomial that matches both.

    ``low`` is the row before t [s], ``at`` the column of the position; once the command has ended, its last position is
    held.
    """
    span = table[low + 1, 0] - table[low, 0] if low + 1 < len(table) else 0.0
    q = table[low, at]
    if ended or span <= 0.0 or t < table[0, 0]:
        command.position, command.speed, command.acceleration = table[len(table) - 1, at] if ended else q, 0.0, 0.0
        return
    u, d = (t - table[low, 0]) / span, table[low + 1, at] - q
    v0, a0 = table[low, at + 1] * span, table[low, at + 2] * span * span
    v1, a1 = table[low + 1, at + 1] * span, table[low + 1, at + 2] * span * span
    c3 = 10.0 * d - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1
    c4 = -15.0 * d + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1
    c5 = 6.0 * d - 3.0 * v0 - 3.0 * v1 - 0.5 * a0 + 0.5 * a1
    command.position = q + u * (v0 + u * (0.5 * a0 + u * (c3 + u * (c4 + u * c5))))
    command.speed = (v0 + u * (a0 + u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5)))) / span
    command.acceleration = (a0 + u * (6.0 * c3 + u * (12.0 * c4 + u * 20.0 * c5))) / (span * span)


@scene_law(Own)
def _compute(t: Any, h: Any, own: Any, scene: Any) -> None:
    ended, joints, table = t >= own.holds, scene.joints, scene.table
    # At an end in motion it still moves: that instant belongs to the piece before.
    t = min(repeated_time(own.period, own.last, t), np.nextafter(table[len(table) - 1, 0], -math.inf))
    low = interval_of(table, t)
    for j in range(len(joints)):
        _interpolate(joints[j].command, table, low, 1 + 3 * j, t, ended)
        if own.shafts:
            _interpolate(joints[j].shaft_command, table, low, 1 + 3 * (len(joints) + j), t, ended)


@dataclass(frozen=True, eq=False)
class CommandedMotion(Effect):
    """Commanded motion of the joints; interpolated smoothly between samples.

    Attributes:
        motion: Motion of all joints of the scene; two samples at the same time are a jump of the acceleration.
        repetitions: How often it is run; afterwards the last position is held.
    """

    motion: Motion | Cycle
    repetitions: int = 1

    scope = "scene"
    compute = _compute

    def __post_init__(self) -> None:
        if not isinstance(self.motion, Motion | Cycle):
            raise InputError(Fault("motion", "must be a motion or a cycle", type(self.motion).__name__))
        if isinstance(self.motion, Cycle) and self.motion.torque is not None:
            raise InputError(Fault("motion", "is a load table: it commands no position"))
        time = checked_array(self.motion.time, (None,), "motion.time")
        if len(time) < 2 or (np.diff(time) < 0.0).any() or not time[-1] > time[0]:
            raise InputError(Fault("motion.time", "must be two or more instants that never decrease [s]"))
        shape = (len(time), len(self.motion.joint_names))
        position, velocity, acceleration = (
            checked_array(getattr(self.motion, name), shape, f"motion.{name}")
            for name in ("position", "velocity", "acceleration")
        )
        checked = replace(self.motion, time=time, position=position, velocity=velocity, acceleration=acceleration)
        object.__setattr__(self, "motion", checked)
        if not 1 <= self.repetitions <= MOST_REPETITIONS:
            raise InputError(Fault("repetitions", f"must be from 1 to {MOST_REPETITIONS}", self.repetitions))

    def ports(self, place: Place) -> Ports:
        """Provides position, speed and acceleration of every joint, and of shafts where motors are coupled."""
        missing = [name for name in place.joints if name not in self.motion.joint_names]
        if missing:
            hint = nearest(missing[0], list(self.motion.joint_names))
            raise InputError(Fault("motion", f"says nothing of {', '.join(missing)}", None, hint))
        kinds = (s.COMMAND_POSITION, s.COMMAND_SPEED, s.COMMAND_ACCELERATION)
        commands = [(name, kind) for name in place.joints for kind in kinds]
        commands += [(place.joints[i], kind) for i in place.shafts for kind in s.SHAFT_COMMANDS]
        return Ports(provides=tuple(Signal(f"{name}:{kind.name}", kind.unit) for name, kind in commands))

    def own(self, place: Place) -> Own:
        period = float(self.motion.time[-1] - self.motion.time[0])
        return Own(period if self.repetitions > 1 else 0.0, period * self.repetitions, self._holds, bool(place.shafts))

    def table(self, place: Place) -> Array:
        order = [self.motion.joint_names.index(name) for name in place.joints]
        turns = np.array(place.coupling).reshape(-1, len(order)) if place.shafts else np.zeros((0, len(order)))
        parts = (self.motion.position, self.motion.velocity, self.motion.acceleration)
        data = np.stack([np.hstack([part[:, order], part[:, order] @ turns.T]) for part in parts], axis=2)
        return np.column_stack([self.motion.time - self.motion.time[0], data.reshape(len(data), -1)])

    @property
    def _holds(self) -> float:
        """The time from which the last position is held [s]: the end, or just after it where the motion ends moving."""
        moving = not resting(self.motion.velocity)[-1].all()
        return float(self.motion.time[-1] - self.motion.time[0]) * self.repetitions * (1.0 + ROUNDING * moving)

    def breakpoints(self) -> Sequence[float]:
        time = self.motion.time - self.motion.time[0]
        jumps = np.unique(time[1:][np.diff(time) == 0.0])
        return self._repeated([*jumps[jumps < time[-1]].tolist(), float(time[-1])])

    def knots(self, tolerance: float) -> Sequence[float]:
        time = self.motion.time - self.motion.time[0]
        instants = [0.0, *time[self._jerk_jumps(max(tolerance, JERK_TOLERANCE))].tolist(), float(time[-1])]
        return self._repeated(instants)

    def _repeated(self, instants: list[float]) -> list[float]:
        """Instants of one run, its end the last, in all runs; the last end is where the last position is held [s]."""
        period = instants[-1]
        return [*[float(t) + k * period for k in range(self.repetitions) for t in instants][:-1], self._holds]

    def _jerk_jumps(self, share: float) -> Array:
        """Indices of the samples at which the jerk of any joint jumps by more than ``share`` of its maximum."""
        at = np.flatnonzero(np.diff(self.motion.time) > 0.0)
        span = np.diff(self.motion.time)[at, None]
        mean_slope = (self.motion.position[at + 1] - self.motion.position[at]) / span**3
        v0, v1 = self.motion.velocity[at] / span**2, self.motion.velocity[at + 1] / span**2
        a0, a1 = self.motion.acceleration[at] / span, self.motion.acceleration[at + 1] / span
        first = 60.0 * mean_slope - 36.0 * v0 - 24.0 * v1 - 9.0 * a0 + 3.0 * a1
        last = 60.0 * mean_slope - 24.0 * v0 - 36.0 * v1 - 3.0 * a0 + 9.0 * a1
        jumps = np.abs(first[1:] - last[:-1]) > share * np.maximum(np.abs(first), np.abs(last)).max(axis=0)
        return np.asarray(at[1:][jumps.any(axis=1)])

    def begins_at(self, place: Place) -> tuple[list[int], Array, Array]:
        """Indices of the commanded joints, and their positions and speeds at the beginning, (n,) each."""
        order = [self.motion.joint_names.index(name) for name in place.joints]
        return list(range(len(order))), self.motion.position[0, order], self.motion.velocity[0, order]
