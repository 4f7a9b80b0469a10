"""Demand: the loads of a task at the gear output of each joint over the cycle, for any drive behind it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np

from drivetrain.arrays import Array, Indices
from drivetrain.drive.drive import STANDSTILL, Drive, loss_speed, resting
from drivetrain.drive.friction import Friction, friction_curve, friction_torque, loosening_load
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.sizing.demand.drive_wrenches import DriveWrenches, drive_wrenches
from drivetrain.sizing.demand.load_basis import (
    PARAMETERS,
    JointBasis,
    all_load_parameters,
    counterbalance_torques,
    load_basis,
    load_parameters,
)
from drivetrain.sizing.demand.stops import StopBasis, stop_basis
from drivetrain.study.model import Study
from drivetrain.study.parts.mounting import seat


class Peak(NamedTuple):
    """The largest magnitude of a series."""

    value: float  # in the unit of the series
    time: float  # instant of the largest magnitude [s]


class StopDemand(NamedTuple):
    """Loads of one joint in stops on a ramp from states of the cycle; all (M,), empty if it has no ramp."""

    first: Indices  # sample from which each stop starts, integers
    after: Array  # time since the start of the stop [s]
    torque: Array  # torque of the gear's output on the link [N m]; joint friction, which helps to stop, is not included
    # Speed and acceleration of the gear's output [rad/s], [rad/s^2]; at the end of a ramp the speed keeps its sign.
    speed: Array
    acceleration: Array
    carrier_acceleration: Array  # as ``JointDemand.carrier_acceleration`` [rad/s^2]


@dataclass(frozen=True, eq=False)
class JointDemand:
    """Motion and loads of one joint at the gear's output; all (N,).

    If motors are coupled to several joints, these are the coordinate and loads of the shaft that the gear turns.
    """

    time: Array  # time [s]
    weights: Array  # integration weights over the cycle [s]
    position: Array  # position of the joint [rad or m]
    speed: Array  # speed of the gear's output [rad/s]
    acceleration: Array  # acceleration of the gear's output [rad/s^2]
    carrier_acceleration: Array  # angular acceleration of the stator's link along the rotor's axis [rad/s^2]
    gear_torque: Array  # torque of the gear's output on the link, equation 8.110 of Modern Robotics [N m]
    friction: Friction  # friction of the joint, outside the gear's mesh
    payload: Indices  # index of the payload, -1 for none
    # wrench (moment [N m], force [N]) through the joint, joint frame, (N, 6); None without an arm, if the joint slides
    # (its guide carries the wrench), and if the gear is not at the joint (coupled)
    wrench: Array | None
    # load inertia at the gear's output, own rotor excluded [kg m^2]; None if neither an arm nor the study gives it
    load_inertia: Array | None
    cycle: Cycle  # the repeated task; its parts each repeat on their own
    stop: StopDemand  # loads of stops on a ramp
    # ``gear_torque`` that holds each position at rest [N m], one per sample of ``held``; None if no brake is required
    static_torque: Array | None = None

    @cached_property
    def load_torque(self) -> Array:
        """Torque at the gear's output, joint friction included [N m], (N,)."""
        return np.asarray(self.gear_torque + friction_torque(self.friction, self.speed))

    @cached_property
    def at_rest(self) -> Array:
        """Whether the joint is at rest, (N,)."""
        return resting(self.speed)

    @cached_property
    def loss_speed(self) -> Array:
        """The speed whose sign determines the losses, also where a motion starts or ends [rad/s], (N,)."""
        return loss_speed(self.speed, self.acceleration, self.at_rest, parts=self.cycle.parts)

    @cached_property
    def loosening_torque(self) -> Array:
        """``load_torque``; at rest ``loosening_load`` if the joint ever moves [N m], (N,)."""
        if not self.moves:
            return self.load_torque
        load, ahead = self.load_torque, self.loss_speed[self.cycle.after]
        return np.where(self.at_rest, loosening_load(friction_curve(self.friction), load, ahead), load)

    @cached_property
    def stop_torque(self) -> Array:
        """Magnitude of the gear's torque in stops on a ramp, with joint friction if it increases it [N m], (M,)."""
        rubbed = self.stop.torque + friction_torque(self.friction, self.stop.speed)
        return np.maximum(np.abs(self.stop.torque), np.abs(rubbed))

    @cached_property
    def fastest(self) -> Peak:
        """Peak of ``speed`` [rad/s]."""
        index = int(np.argmax(np.abs(self.speed)))
        return Peak(float(abs(self.speed[index])), float(self.time[index]))

    @cached_property
    def tilting_moment(self) -> Array | None:
        """Moment across the output axis [N m], (N,); None if ``wrench`` is."""
        return None if self.wrench is None else np.hypot(self.wrench[:, 0], self.wrench[:, 1])

    @cached_property
    def radial_load(self) -> Array | None:
        """Force across the output axis [N], (N,); None if ``wrench`` is."""
        return None if self.wrench is None else np.hypot(self.wrench[:, 3], self.wrench[:, 4])

    @property
    def axial_load(self) -> Array | None:
        """Force along the output axis [N], (N,); None if ``wrench`` is."""
        return None if self.wrench is None else self.wrench[:, 5]

    @cached_property
    def moves(self) -> bool:
        """Whether the joint moves during the cycle."""
        return bool(np.any(self.speed != 0.0))

    @cached_property
    def mean_speed(self) -> float:
        """Mean magnitude of the speed over the whole cycle, dwells included [rad/s]."""
        return self.mean(np.abs(self.speed))

    def mean(self, values: Array) -> float:
        """Time average over the cycle."""
        total = float(self.weights.sum())
        return float(values @ self.weights) / total if total > 0.0 else float(np.mean(values))


class JointSums(NamedTuple):
    """Loads of a joint: torque (N,), wrench (6, N), inertia (N,)."""

    torque: Array
    wrench: Array
    inertia: Array


@dataclass(frozen=True, eq=False)
class Workload:
    """A study with the load basis of its joints, for any set of drives."""

    study: Study  # the task
    basis: tuple[JointBasis, ...]  # load basis by joint; empty without an arm
    weights: Array  # integration weights over the cycle [s], (N,)
    # load basis with every position held at rest; empty if no brake is required
    resting: tuple[JointBasis, ...] = ()
    # loads of stops on a ramp if they are known; None: computed on first access
    ramped: StopBasis | None = None

    @cached_property
    def stops(self) -> StopBasis | None:
        """Loads of stops on a ramp; None if the study states none."""
        return stop_basis(self.study) if self.ramped is None else self.ramped

    def at(self, joint: int, drives: Mapping[int, Drive]) -> JointWork:
        """The loads of one joint given the other drives."""
        if not self.basis:
            return JointWork(self, joint, None, np.zeros(0))
        basis = self.basis[joint]
        others = {index: drive for index, drive in drives.items() if index != joint}
        parameters = all_load_parameters(self.study, basis, others)
        bare = JointSums(basis.bare.torque, basis.bare.wrench, basis.bare.inertia)
        return JointWork(self, joint, self.added_up(joint, bare, parameters, slice(None)), parameters)

    @cached_property
    def _drive_wrenches(self) -> DriveWrenches | None:
        """None if the basis has the wrenches per unit."""
        arm = self.study.arm
        return drive_wrenches(self.study) if arm is not None and arm.linkage is None else None

    def wrench(self, joint: int, parameters: Array) -> Array:
        """Moment [N m] and force [N] through a joint by drives, in its frame, (6, N); (6, 0) if not on the bearing.

        ``parameters``: load parameters of all joints' drives, (n, PARAMETERS).
        """
        basis, computed = self.basis[joint], self._drive_wrenches
        if basis.on_bearing and computed is not None:
            return computed.of(joint, parameters)
        return np.asarray(np.tensordot(parameters[list(basis.drives)].ravel(), basis.wrench, 1))

    def unit_wrenches(self, joint: int, drives: Sequence[int], samples: Any = slice(None)) -> Array:
        """The same per unit of each load parameter of some drives, at M samples, (PARAMETERS for each drive, 6, M)."""
        basis, computed = self.basis[joint], self._drive_wrenches
        if basis.on_bearing and computed is not None:
            return computed.per_unit_of(joint, list(drives), samples)
        rows = [basis.wrench[basis.rows(drive)] for drive in drives]
        return np.concatenate([basis.wrench[:0], *rows])[..., samples]

    def added_up(self, joint: int, start: JointSums, parameters: Array, rows: slice) -> JointSums:
        """Loads plus those by the load parameters in some rows of the joint's basis."""
        if not parameters[rows].any():  # no drives: skips products with the rows of long motions, which are slow
            return start
        basis, some = self.basis[joint], np.zeros(len(parameters))
        some[rows] = parameters[rows]
        by_joint = np.zeros((len(self.basis), PARAMETERS))
        by_joint[list(basis.drives)] = some.reshape(-1, PARAMETERS)
        torque, inertia = (np.tensordot(some[rows], unit[rows], 1) for unit in (basis.torque, basis.inertia))
        wrench = start.wrench + self.wrench(joint, by_joint)
        return JointSums(start.torque + torque, wrench, start.inertia + inertia)

    def static(self, joint: int, parameters: Array) -> Array | None:
        """Torque that holds a gear's output at rest at each sample of ``held`` [N m]; None if no brake is required.

        ``parameters``: load parameters of all drives that load the joint.
        """
        if not self.resting:
            return None
        return np.asarray(self.resting[joint].bare.torque + parameters @ self.resting[joint].torque)


@lru_cache(maxsize=1)
def workload(study: Study) -> Workload:
    """The workload of a study, prepared for any set of drives; the last one is cached."""
    resting = load_basis(study, held(study.cycle), torques_only=True) if needs_brakes(study) else ()
    return Workload(study, load_basis(study), study.cycle.weights, resting)


def needs_brakes(study: Study) -> bool:
    """Whether any joint must be held by a brake."""
    return any(task.brakes for task in study.joints)


def at_rest(cycle: Cycle) -> Cycle:
    """A cycle in which every position is held at rest."""
    still = np.zeros_like(cycle.velocity)
    return replace(cycle, velocity=still, acceleration=still)


def held(cycle: Cycle) -> Cycle:
    """A cycle at rest as a brake must hold it: with the force at the tip and, after all these samples, without it."""
    if cycle.tip_wrench is None:
        return at_rest(cycle)
    both = at_rest(cycle.at(held_samples(cycle)))
    released = np.zeros((len(both.time) - len(cycle.time), 6))
    return replace(both, tip_wrench=np.concatenate([cycle.tip_wrench, released]))


def held_samples(cycle: Cycle) -> Indices:
    """The samples of ``held`` as samples of the cycle: all, then those with a force at the tip once more."""
    every = np.arange(len(cycle.time))
    return every if cycle.tip_wrench is None else np.concatenate([every, every[cycle.tip_wrench.any(axis=1)]])


@dataclass(frozen=True, eq=False)
class JointWork:
    """The loads of one joint given the other drives."""

    work: Workload  # loads of all joints
    joint: int  # index of this joint
    others: JointSums | None  # loads by arm, payload and the other drives [SI]; None without an arm
    parameters: Array  # load parameters of the other drives, in the order of the joint's basis, zeros for its own

    @cached_property
    def own_load(self) -> bool:
        """Whether the demand depends on the joint's own drive, which then is mounted on the link that it moves."""
        return self.others is not None and self.joint in self.work.basis[self.joint].drives

    @cached_property
    def fixed(self) -> JointDemand:
        """The demand without the load of the joint's own drive."""
        return self._demand(self.others, self.parameters)

    def demand(self, drive: Drive) -> JointDemand:
        """The demand on a drive of this joint."""
        if not self.own_load or self.others is None:
            return self.fixed
        basis, parameters = self.work.basis[self.joint], self.parameters.copy()
        own = basis.rows(self.joint)
        parameters[own] = load_parameters(self.work.study, self.joint, drive)
        return self._demand(self.work.added_up(self.joint, self.others, parameters, own), parameters)

    def _demand(self, sums: JointSums | None, parameters: Array) -> JointDemand:
        """The demand for given loads; None: the task states them."""
        cycle, task = self.work.study.cycle, self.work.study.joints[self.joint]
        motions = (cycle.position, cycle.velocity, cycle.acceleration)
        position, speed, acceleration = (_column(self.work.study, motion, self.joint) for motion in motions)
        if sums is None:
            nothing = np.zeros_like(speed)
            given = nothing if cycle.torque is None else cycle.torque[:, self.joint]
            given = given - counterbalance_torques(self.work.study, cycle.position)[:, self.joint]
            inertia = None if task.load_inertia is None else np.full_like(speed, task.load_inertia)
            static = given if inertia is None else given - inertia * acceleration
            return JointDemand(
                cycle.time, self.work.weights, position, speed, acceleration, nothing, given, task.friction,
                cycle.payload, None, inertia, cycle, self._table_stop(speed, acceleration, given),
                static if task.brakes else None,
            )  # fmt: skip
        basis, travel = self.work.basis[self.joint], task.travel_per_turn or 1.0
        carrier = self._carrier(self.work.basis, cycle.acceleration)
        across, held = sums.wrench.T if basis.on_bearing else None, self.work.static(self.joint, parameters)
        return JointDemand(
            cycle.time, self.work.weights, position, speed / travel, acceleration / travel, carrier,
            sums.torque, task.friction, cycle.payload, across, sums.inertia, cycle, self._arm_stop(parameters),
            held if task.brakes else None,
        )  # fmt: skip

    def _carrier(self, basis: tuple[JointBasis, ...], acceleration: Array) -> Array:
        """Acceleration of the stator's link along the rotor's axis; ``acceleration``: of all joints, (N, n)."""
        mount = self.work.study.joints[self.joint].mount
        at = seat(self.joint, mount)
        carrier = basis[at].bare.carrier_acceleration
        if mount.carrier == "base":
            return np.zeros_like(carrier)
        return carrier + acceleration[:, at] if mount.carrier == "child" and not basis[at].slides else carrier

    def _arm_stop(self, parameters: Array) -> StopDemand:
        """Loads of stops of an arm on a ramp."""
        study, stops = self.work.study, self.work.stops
        task = study.joints[self.joint]
        if stops is None or task.stop.ramp is None:
            return NO_STOP
        basis, travel = stops.joints[self.joint], task.travel_per_turn or 1.0
        speed, acceleration = (
            _column(study, motion, self.joint) / travel for motion in (stops.velocity, stops.acceleration)
        )
        force = basis.bare.torque + parameters @ basis.torque
        carrier = self._carrier(stops.joints, stops.acceleration)
        tiny = STANDSTILL * np.abs(speed).max(initial=0.0)
        speed = np.where(np.abs(speed) > tiny, speed, -tiny * np.sign(acceleration))
        return StopDemand(stops.first, stops.after, force, speed, acceleration, carrier)

    def _table_stop(self, speed: Array, acceleration: Array, torque: Array) -> StopDemand:
        """Loads at the start of stops: torque and speed of a table, and the load inertia times the deceleration."""
        task, moving = self.work.study.joints[self.joint], np.flatnonzero(speed)
        if task.stop.ramp is None or task.load_inertia is None:
            return NO_STOP
        slowing, nothing = -speed[moving] / task.stop.ramp, np.zeros(len(moving))
        needed = torque[moving] + task.load_inertia * (slowing - acceleration[moving])
        return StopDemand(moving, nothing, needed, speed[moving], slowing, nothing)


NO_STOP = StopDemand(np.zeros(0, dtype=np.int64), *np.zeros((5, 0)))


def _column(study: Study, motion: Array, joint: int) -> Array:
    """Motion of one joint, or of its shaft if motors are coupled, (N,)."""
    coupling = None if study.arm is None else study.arm.coupling
    return np.asarray(motion[:, joint] if coupling is None else motion @ coupling[joint])
