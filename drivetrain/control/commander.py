"""``Commander``: computes the motor currents to command, called once per tick of a controller."""

from __future__ import annotations

import ctypes
import math
from typing import Any

import numpy as np
from numba import carray, types

from drivetrain.arm.arm import Arm
from drivetrain.arm.bodies import on_moving_base
from drivetrain.arm.coupling import shaft_torques, shaft_turns
from drivetrain.arrays import Array, checked_number
from drivetrain.control.laws import TARGETS, Axis, Balances, Chain, Chains, command
from drivetrain.drive.amplifier import available_voltage, judges_overload, overload_room
from drivetrain.drive.drive import shaft_friction
from drivetrain.drive.gear import complete
from drivetrain.drive.thermal.thermal_network import ThermalNetwork, thermal_network
from drivetrain.dynamics.closed import chain_arms, whole_motion
from drivetrain.dynamics.core.blocks import JOINT_ALONE
from drivetrain.dynamics.core.frames import LINK as MOVED
from drivetrain.dynamics.core.loops import END, WHOLE, Pins, follow, linkage_records
from drivetrain.dynamics.core.packed import packed
from drivetrain.dynamics.core.records import LINK, ROTOR
from drivetrain.dynamics.core.recursion import LINKS_ALONE
from drivetrain.effects.motor.winding_heat import WindingHeat
from drivetrain.errors import Fault, InputError, raise_faults
from drivetrain.jit import callback
from drivetrain.motion.base import BASE_JOINTS
from drivetrain.records import as_records, record_type
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.judge.missing import unknown_torques
from drivetrain.sizing.results import Evaluation, JointResult, Selection, every_drive
from drivetrain.study.model import JointTask, Study
from drivetrain.study.parts.mounting import loaded_arm, payload_index

FADE = 10.0  # [K] below the winding's limit, over which the current is reduced: covers errors of sensors and models
SLOW = 0.01  # share of a joint's largest speed in the cycle below which friction is reduced
AXIS = record_type(Axis)
FAR = 1e150  # numbers below this can be squared and summed without overflow
CHAIN = record_type(Chain, np.int64)
# Largest change of position in one tick that the solution of closed loops follows, in steps of 0.2 rad or of a fifth
# of the arm's size.
MOST_STRIDES = 32.0
NOT_FINITE, APART = 1, 2  # reasons for refusing a tick: targets not finite, loops that cannot be closed

# Indices of the arrays in a tick's memory. ``sizes`` contains the numbers of axes, rows, chains, joints of a moving
# base, links, rotors, joints of the linkage, passive joints among them and ends of pins, then the reason for a refusal.
(
    SIZES, AXES_AT, TARGETS_AT, LINKS_AT, ROTORS_AT, JOINTS_AT, BODIES_AT, CHAINS_AT, PLACED_AT, SPREAD_AT, GEARED_AT,
    OWN_AT, TURNS_AT, UNMIXED_AT, SHARES_AT, WHOLE_AT, FOLLOW_AT, ENDS_AT, ROWS_AT, SCREWS_AT, PLACES_AT, SPEEDS_AT,
    MOVED_AT, TABLE_AT, FOUND_AT, LOWER_AT,
) = range(26)  # fmt: skip


def _tick(run: Any) -> None:
    """One tick; ``run`` contains the addresses of the arrays."""
    sizes = carray(run[SIZES], 10, np.int64)
    n, rows, many, carried, m, p = sizes[0], sizes[1], sizes[2], sizes[3], sizes[6], sizes[7]
    targets = carray(run[TARGETS_AT], (len(TARGETS), n), np.float64)
    own = carray(run[OWN_AT], (3, rows), np.float64)
    size, whole = 0.0, 0.0
    for i in range(n):
        size += targets[0, i] * targets[0, i]
        for k in range(len(TARGETS)):
            whole += targets[k, i] * targets[k, i]
    for i in range(carried):
        size += own[0, i] * own[0, i]
        whole += own[0, i] * own[0, i] + own[1, i] * own[1, i] + own[2, i] * own[2, i]
    sizes[9] = 0 if whole < FAR * FAR else NOT_FINITE
    if sizes[9] != 0:
        return
    square, chains = (n, n), carray(run[CHAINS_AT], many, CHAIN)
    pins = Pins(
        carray(run[WHOLE_AT], m, WHOLE), carray(run[FOLLOW_AT], p, np.int64), carray(run[ENDS_AT], sizes[8], END),
        chains, carray(run[ROWS_AT], rows, np.int64), carray(run[SCREWS_AT], (rows, 6), np.float64),
        carray(run[PLACES_AT], rows, np.float64), carray(run[SPEEDS_AT], rows, np.float64),
        carray(run[MOVED_AT], rows + many, MOVED), carray(run[TABLE_AT], (3 * sizes[8] // 2, m + 2), np.float64),
        carray(run[FOUND_AT], (p, m + 2), np.float64), carray(run[LOWER_AT], (p, p), np.float64),
    )  # fmt: skip
    if p > 0:
        for w in range(m):
            if pins.whole[w].coordinate >= 0:
                pins.whole[w].wanted = targets[0, pins.whole[w].coordinate]
        if not follow(pins, MOST_STRIDES):
            sizes[9] = APART
            return
    arm = Chains(
        carray(run[LINKS_AT], sizes[4], LINK), carray(run[ROTORS_AT], sizes[5], ROTOR),
        carray(run[JOINTS_AT], rows + many, JOINT_ALONE), carray(run[BODIES_AT], rows + 2 * many, LINKS_ALONE),
        chains, carray(run[PLACED_AT], (rows, n), np.float64), carray(run[SPREAD_AT], (rows, n), np.float64),
        carray(run[GEARED_AT], (rows, n), np.float64), own, carray(run[TURNS_AT], square, np.float64),
        carray(run[UNMIXED_AT], square, np.float64), carray(run[SHARES_AT], square, np.float64), pins,
    )  # fmt: skip
    command(arm, carray(run[AXES_AT], n, AXIS), targets, size)


class Commander:
    """Motor currents of all joints for each tick of a controller: ``commander(q, qd, qdd)``.

    The currents are the feed-forward of the arm with its drives, counterbalances and payload (forces at the tip are
    left to the feedback), including friction and losses by direction of motion. They are limited by the voltage
    (including inductance), peak current and torque, the amplifier's I2t limit, and the computed winding temperature,
    which reduces the current over the last 10 K below the winding's limit. Friction depends on the target speed and is
    reduced below one hundredth of the largest speed of the cycle, so that noise around standstill does not reverse it.
    ``wanted`` returns the currents before the limits. For an arm with closed loops, the positions of the passive joints
    are found by Newton's method, starting from those of the last tick (initially the start of the cycle); feedback uses
    the errors of the driven joints only.

    Args:
        study_or_evaluation: A study whose joints have drives, an evaluation, or a selection.
        rate: Frequency of the calls [Hz].
        bandwidth: Bandwidth of the critically damped position loop [rad/s]: ``bandwidth^2 (q - measured_q) +
            2 bandwidth (qd - measured_qd)`` is added to the acceleration.
        payload: Name of the payload at the tip; None: none.

    Raises:
        InputError: A study without an arm; a joint without a drive, with missing data of torque or heat, with more than
            three counterbalances, or with a counterbalance given as a table; an unknown payload; a rate or bandwidth
            that is not positive.
    """

    def __init__(
        self,
        study_or_evaluation: Study | Evaluation | Selection,
        *,
        rate: float = 1000.0,
        bandwidth: float = 40.0,
        payload: str | None = None,
    ) -> None:
        if isinstance(study_or_evaluation, Selection):
            study_or_evaluation = every_drive(study_or_evaluation)
        if not isinstance(study_or_evaluation, Study | Evaluation):
            problem = "must be a study, an evaluation or a selection"
            raise InputError(Fault("Commander", problem, type(study_or_evaluation).__name__))
        study = study_or_evaluation if isinstance(study_or_evaluation, Study) else study_or_evaluation.study
        if study.arm is None:
            raise InputError(Fault("arm", "is needed: of a load table only its own cycle can be commanded"))
        step = 1.0 / checked_number(rate, "rate", "Hz", above=0.0)
        checked_number(bandwidth, "bandwidth", "rad/s", above=0.0)
        given = study_or_evaluation if isinstance(study_or_evaluation, Evaluation) else evaluate(study)
        faults = unknown_torques(given.joints)
        faults += [
            Fault(f"joints.{task.name}.counterbalances", "may be at most three, without a table of angles")
            for task in study.joints
            if len(task.counterbalances) > 3 or any(one.angles for one in task.counterbalances)
        ]
        raise_faults(faults)
        self.joints: tuple[str, ...] = tuple(given.joints)
        """Names, in the order of all arrays."""
        self.rate: float = float(rate)
        """Frequency of the calls [Hz]."""
        self.study = given.study
        self._drives = given.mounted
        described = [
            _axis(given.study, task, given.joints[task.name], step, float(bandwidth)) for task in given.study.joints
        ]
        self.axes = as_records(described)
        """Parameters and state of each drive: records of ``laws.Axis``, (n,)."""
        self._current: Array = self.axes["current"]
        self._targets = np.zeros((len(TARGETS), len(self.joints)))
        self._function = callback(types.void(types.CPointer(types.voidptr)), _tick).ctypes
        self.memory: list[Any] = []
        start, linkage = given.study.cycle.position[:1], study.arm.linkage
        self._start = np.zeros(0) if linkage is None else whole_motion(linkage, start, 0 * start, 0 * start).position[0]
        self.carry(payload)

    def __repr__(self) -> str:
        carried = self.payload or "no payload"
        return f"Commander({self.study.name}: {len(self.joints)} joints at {self.rate:g} Hz, {carried})"

    def carry(self, payload: str | None) -> None:
        """Change the payload at the tip from the next tick on.

        Args:
            payload: Name of the payload in the study; None: none.

        Raises:
            InputError: An unknown name.
        """
        arm = loaded_arm(self.study, self._drives, payload_index(self.study, payload))
        self.payload: str | None = payload
        places = self.memory[WHOLE_AT]["place"] if self.memory else self._start
        carried = 0 if self.study.base is None else len(BASE_JOINTS)
        self.memory = memory(arm, self.axes, self._targets, carried=carried)
        self.memory[WHOLE_AT]["place"] = places
        self._base: Array = self.memory[OWN_AT][:, :carried]
        self._addresses = np.array([one.ctypes.data for one in self.memory], dtype=np.intp)
        self._where = ctypes.cast(self._addresses.ctypes.data, self._function.argtypes[0])

    def __call__(
        self, q: Any, qd: Any, qdd: Any, measured_q: Any = None, measured_qd: Any = None, *, base: Any = None
    ) -> Array:
        """Compute the currents of one tick, and advance the state of heat and overload by one tick.

        Args:
            q, qd, qdd: Target positions, speeds and accelerations [rad or m, per s, per s^2], (n,).
            measured_q, measured_qd: Measured positions and speeds [rad or m, per s], (n,); None: equal to the targets.
            base: Position, velocity and acceleration of a moving base along x, y, z of the ground and in yaw, pitch and
                roll [m, rad, and per s, per s^2], (3, 6), as ``base`` of a study states them.

        Returns:
            DC-equivalent current [A], (n,); always the same array, overwritten by the next call.

        Raises:
            InputError: Wrong shapes, or numbers that are not finite; positions that closed loops cannot reach from
                those of the last tick; ``base`` missing for a moving base, or given for a fixed one. The state is
                unchanged.
        """
        targets = self._targets
        try:
            targets[0], targets[1], targets[2] = q, qd, qdd
            targets[3] = q if measured_q is None else measured_q
            targets[4] = qd if measured_qd is None else measured_qd
            if self._base.size:
                self._base[0], self._base[1], self._base[2] = base
            elif base is not None:
                raise ValueError
        except (TypeError, ValueError):
            raise self._wrong(q, qd, qdd, measured_q, measured_qd, base) from None
        self._function(self._where)
        if self.memory[SIZES][9]:
            raise self._wrong(q, qd, qdd, measured_q, measured_qd, base)
        return self._current

    @property
    def wanted(self) -> Array:
        """Currents of the last tick before the limits [A], (n,)."""
        return np.asarray(self.axes["wanted"]).copy()

    @property
    def winding_temperature(self) -> Array:
        """Computed winding temperature [C], (n,); ambient temperature if the data sheet lacks thermal data."""
        return np.asarray(self.axes["heat"]["winding_temperature"]).copy()

    @property
    def overload(self) -> Array:
        """Used share of the amplifiers' I2t limit [-], (n,); 0 if the limit is unknown."""
        room = [(overload_room(one["amplifier"]) if one["overloads"] else 0.0) or math.inf for one in self.axes]
        return np.asarray(self.axes["overload"] / np.array(room))

    def reset(self, *, winding: Any = None, housing: Any = None) -> None:
        """Reset the state: no overload, zero current, closed loops at the start of the cycle.

        Args:
            winding, housing: Temperatures [C], a number or (n,); None: ambient.

        Raises:
            InputError: Numbers that are not finite.
        """
        for name, value in (("winding", winding), ("housing", housing)):
            start = np.broadcast_to(self.study.ambient if value is None else value, len(self.joints))
            for one in start:
                checked_number(float(one), name, "C")
            self.axes["heat"][f"{name}_temperature"] = start
        for name in ("current", "wanted", "overload"):
            self.axes[name] = 0.0
        self.memory[WHOLE_AT]["place"] = self._start

    def _wrong(self, *given: Any) -> InputError:
        """The error for a refused tick, with all faults of its arguments."""
        if self.memory[SIZES][9] == APART:
            problem = "cannot be reached by the linkage from its last position: out of reach, a dead centre, or too far"
            return InputError(Fault("q", problem, self._targets[0].tolist(), "call reset to start again"))
        shapes = (*[(len(self.joints),)] * 5, self._base.shape)
        names, faults = (*("q", "qd", "qdd", "measured_q", "measured_qd"), "base"), []
        for name, value, shape in zip(names, given, shapes, strict=True):
            if name == "base" and (value is None) != (not self._base.size):
                problem = (
                    "stands still in this study" if self._base.size == 0 else "moves: its motion, (3, 6), is needed"
                )
                faults.append(Fault(name, problem))
            if value is None or (name == "base" and not self._base.size):
                continue
            try:
                row = np.asarray(value, dtype=np.float64)
            except (TypeError, ValueError):
                faults.append(Fault(name, f"must be numbers of shape {shape}", type(value).__name__))
                continue
            if row.shape != shape:
                faults.append(Fault(name, f"must have shape {shape}", row.shape))
            elif not np.abs(row).max() < FAR:
                faults.append(Fault(name, "must be finite, and not too large to be squared", row.tolist()))
        return InputError(faults or [Fault("q", "is too large to calculate with")])


def memory(arm: Arm, axes: Any, targets: Array, *, carried: int) -> list[Any]:
    """The arrays of a tick, in the order of their addresses; the first ``carried`` rows are the moving base."""
    n = arm.n
    unmixed = shaft_torques(arm, np.eye(n)).T if arm.coupling is not None else np.eye(n)
    shares = unmixed.copy()
    arms = [on_moving_base(arm) if carried else arm] if arm.linkage is None else chain_arms(arm)
    models = [packed(one) for one in arms]
    counts = np.array([(len(one.links) - len(one.rotors), len(one.links), len(one.rotors)) for one in models])
    first, (wide, _, _) = np.cumsum(counts, axis=0) - counts, counts.sum(axis=0)
    chains = np.zeros(len(models), CHAIN)
    for name, values in zip(("row", "link", "rotor", "joints", "rotors"), (*first.T, *counts.T[::2]), strict=True):
        chains[name] = values
    joints, screws = np.zeros(wide, np.int64), np.zeros((wide, 6))
    if arm.linkage is None:
        whole, passive, ends = np.zeros(0, WHOLE), np.zeros(0, np.int64), np.zeros(0, END)
        spread = np.eye(n + carried) if models[0].spread is None else models[0].spread
        placed = np.ascontiguousarray(spread[:, carried:])
        geared = np.where(np.arange(wide)[:, None] < n + carried, placed, 0.0)
    else:
        loops, (whole, passive, ends) = arm.linkage.loops, linkage_records(arm.linkage)
        placed, geared = np.zeros((2, wide, n))
        # Default: also for the substitute joints of coupled rotors, at the end of a chain, which move no link.
        joints[:] = loops.driven[0]
        for at, path, chain, model in zip(chains, loops.paths, arms, models, strict=True):
            own = np.arange(at["row"], at["row"] + len(path))
            joints[own], screws[own] = path, chain.screws
            placed[own] = np.array(path)[:, None] == np.array(loops.driven)
            geared[own] = placed[own]
            if model.spread is not None:
                placed[at["row"] : at["row"] + at["joints"]] = model.spread @ placed[own]
        for pair in loops.shared:
            shares[np.ix_(pair, pair)] = 0.5
    links, rotors = (np.concatenate([getattr(one, name) for one in models]) for name in ("links", "rotors"))
    states, bodies = np.zeros(wide + len(chains), JOINT_ALONE), np.zeros(wide + 2 * len(chains), LINKS_ALONE)
    for c, one in enumerate(models):
        for name, weight in zip(("ax", "ay", "az"), one.gravity, strict=True):
            bodies[name][chains["row"][c] + 2 * c] = -weight
    m, p = len(whole), len(passive)
    sizes = np.array([n, wide, len(chains), carried, len(links), len(rotors), m, p, len(ends), 0], dtype=np.int64)
    return [
        sizes, axes, targets, links, rotors, states, bodies, chains, placed, placed.copy(), geared,
        np.zeros((3, wide)), shaft_turns(arm).copy(), np.ascontiguousarray(unmixed), np.ascontiguousarray(shares),
        whole, passive, ends, joints, screws, np.zeros(wide), np.zeros(wide), np.zeros(wide + len(chains), MOVED),
        np.zeros((3 * len(ends) // 2, m + 2)), np.zeros((p, m + 2)), np.zeros((p, p)),
    ]  # fmt: skip


def _axis(study: Study, task: JointTask, joint: JointResult, step: float, bandwidth: float) -> Axis:
    """Parameters and initial state, at ambient temperature, of one joint's drive."""
    drive, amplifier, motor = joint.drive, joint.amplifier, joint.drive.motor
    volts = available_voltage(amplifier, study.supply.voltage)
    peaks = [one for one in (amplifier.peak_current, motor.peak_current) if one is not None]
    network = thermal_network(motor, study.ambient, housing_to_ambient=task.housing_to_ambient)
    heats = network is not None and network.winding_capacity is not None and motor.max_winding_temperature is not None
    # A winding without thermal data stays at ambient temperature.
    nodes = network if heats and network is not None else ThermalNetwork(1.0, 1.0, 1.0, 1.0, study.ambient)
    other = task.constant_loss(motor, amplifier)
    heat = WindingHeat(nodes, gear_heat=task.gear_heat, constant_loss=other).own(None)  # type: ignore[arg-type]
    heat.winding_temperature = heat.housing_temperature = study.ambient
    fastest = float(np.abs(joint.series.speed).max())
    return Axis(
        motor, complete(drive.gear), amplifier, drive.joint_friction, shaft_friction(drive),
        Balances(*task.counterbalances), heat, travel=task.travel_per_turn or 1.0,
        gear_temperature=float(study.drag_temperature(study.ambient)), volts=volts,
        most=min(peaks, default=2.0 * volts / motor.resistance), heats=float(heats),
        overloads=float(judges_overload(amplifier)), fade=FADE, slow=SLOW * (fastest or 1.0), bandwidth=bandwidth,
        step=step,
    )  # fmt: skip
