"""Loads of a task with another payload or cycle time, without new inverse dynamics.

If time is scaled by s, the terms of a joint torque by gravity and by a force at the tip stay, and all other terms
(inertial, centripetal, Coriolis, rotors) are divided by s^2, as they are quadratic in speed or linear in acceleration.
Both are linear in the mass of the payload. So four runs of the inverse dynamics give the loads for every payload and
every cycle time.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from drivetrain.arrays import Array
from drivetrain.sizing.demand.demand import Workload, at_rest, held, needs_brakes, workload
from drivetrain.sizing.demand.load_basis import JointBasis, Loads, load_basis
from drivetrain.sizing.demand.stops import StopBasis, stop_basis
from drivetrain.study.change import TaskChange, changed
from drivetrain.study.model import Study

Basis = tuple[JointBasis, ...]


@dataclass(frozen=True, eq=False)
class WorkFamily:
    """A task with the loads of all its changes of payload and cycle time; another force is computed anew."""

    study: Study  # the task unchanged
    payloads: tuple[str, ...] = ()  # names of the payloads that change; empty: all

    def at(self, change: TaskChange) -> Workload:
        """The loads of the changed task."""
        study = changed(self.study, change)
        if change.force != 1.0:
            return workload(study)
        if study.arm is None:
            return Workload(study, (), study.cycle.weights)
        share, slower = change.payload, 1.0 / change.time**2
        basis = tuple(
            _combined(bases, share, slower) for bases in zip(self._moving, self._resting, *self._empty, strict=True)
        )
        resting = () if not needs_brakes(study) else tuple(
            _combined((still, still, empty, empty), share, 1.0)
            for still, empty in zip(*self._held, strict=True)
        )  # fmt: skip
        return Workload(study, basis, study.cycle.weights, resting, self._stops(share) if change.time == 1.0 else None)

    def _stops(self, share: float) -> StopBasis | None:
        """Loads of stops at the unchanged cycle time; with another one the arm stops along a different path."""
        full, empty = self._stopping
        if full is None or empty is None:
            return full
        joints = tuple(
            replace(one, bare=replace(one.bare, torque=bare.bare.torque + share * (one.bare.torque - bare.bare.torque)))
            for one, bare in zip(full.joints, empty.joints, strict=True)
        )
        return replace(full, joints=joints)

    @cached_property
    def _stopping(self) -> tuple[StopBasis | None, StopBasis | None]:
        """Loads of stops with and without the payloads that change; the same object if there are none."""
        full = stop_basis(self.study)
        return full, stop_basis(self._bare) if self.study.payloads else full

    @cached_property
    def _moving(self) -> Basis:
        return load_basis(self.study)

    @cached_property
    def _resting(self) -> Basis:
        return load_basis(self.study, at_rest(self.study.cycle))

    @cached_property
    def _empty(self) -> tuple[Basis, Basis]:
        """Loads in motion and at rest without the payloads that change; the same objects if there are none."""
        if not self.study.payloads:
            return self._moving, self._resting
        return load_basis(self._bare), load_basis(self._bare, at_rest(self._bare.cycle))

    @cached_property
    def _held(self) -> tuple[Basis, Basis]:
        """Loads that brakes hold, with and without the payloads that change."""
        if self.study.cycle.tip_wrench is None:
            return self._resting, self._empty[1]
        full = load_basis(self.study, held(self.study.cycle))
        return full, load_basis(self._bare, held(self._bare.cycle)) if self.study.payloads else full

    @cached_property
    def _bare(self) -> Study:
        return changed(self.study, TaskChange(payload=0.0, payloads=self.payloads))


def _combined(bases: tuple[JointBasis, ...], share: float, slower: float) -> JointBasis:
    """One joint's basis from those in motion and at rest, with and without payload.

    ``share``: factor on the payload's mass; ``slower``: 1/s^2 for a time scale s.
    """
    moving, resting, moving_empty, resting_empty = bases

    def paced(of: Callable[[JointBasis], Array], full: JointBasis, still: JointBasis) -> Array:
        return np.asarray(of(still) + slower * (of(full) - of(still)))

    def bare(of: Callable[[Loads], Array]) -> Array:
        with_payload = paced(lambda basis: of(basis.bare), moving, resting)
        if share == 1.0:
            return with_payload
        without = paced(lambda basis: of(basis.bare), moving_empty, resting_empty)
        return without + share * (with_payload - without)

    inertia = moving_empty.bare.inertia + share * (moving.bare.inertia - moving_empty.bare.inertia)
    loads = Loads(
        bare(lambda one: one.torque), bare(lambda one: one.wrench), inertia, slower * moving.bare.carrier_acceleration
    )
    return replace(
        moving,
        bare=loads,
        torque=paced(lambda basis: basis.torque, moving, resting),
        wrench=paced(lambda basis: basis.wrench, moving, resting),
    )
