"""Stops of all joints at once: the rigid arm is integrated from states of the cycle while motors or brakes decelerate
it.

For every drive P = f T + R: T = A s'' + b is the gear's output torque, R = B s'' + r accelerates the rotor, P is the
braking torque, all at the gear's output; s is its angle; f is 1/eta or eta_back, depending on the direction of power
through the mesh. ``drive.stops.braked`` solves one joint alone; here all joints share s''.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.coupling import joint_turns
from drivetrain.arrays import Array, Indices
from drivetrain.drive.brake import LEAST_ENERGY
from drivetrain.drive.drive import Drive, drive_inertia, shaft_friction
from drivetrain.drive.friction import friction_curve
from drivetrain.drive.gear import complete, drag_factor, least_momentary_torque, mesh_of, onward, stage_load
from drivetrain.drive.motor import strongest_constant
from drivetrain.drive.stops import (
    StiffSpring,
    braking_push,
    overshoot,
    stiff_spring,
    swing_spring,
    swung_torque,
)
from drivetrain.dynamics.flexibility import struck_torques
from drivetrain.dynamics.inverse import drive_torques
from drivetrain.errors import InputError
from drivetrain.jit import kernel
from drivetrain.records import as_record, as_records, known
from drivetrain.sizing.demand.load_basis import counterbalance_torques
from drivetrain.sizing.demand.stops import stop_starts
from drivetrain.sizing.judge.cases import stop_current
from drivetrain.sizing.judge.checks import STOP_CHECKS, Requirement
from drivetrain.sizing.judge.judge import utilisation
from drivetrain.sizing.judge.missing import torque_lacks
from drivetrain.sizing.judge.stiffness import joint_travels, loaded_arms
from drivetrain.sizing.judge.verdicts import judged
from drivetrain.sizing.judge.words import amperes
from drivetrain.study.model import Study
from drivetrain.study.parts.verdicts import Check, Verdict

# longest step [s], and its share of the time since the start; a step ends where a joint comes to rest or a brake
# engages
STEP, GROWTH = 0.01, 0.2
# time to a joint's rest below which a step ends there [s]; above, a step covers half of it, as the torque may change
NEAR = 5e-4
LONGEST, FASTEST = 5.0, 300.0  # time [s] and speed [rad/s] above which a stop is reported as endless
INSTANT = 1e-12  # rounding of sums of steps [s]
HALVINGS = 9  # bisection steps for the share of the stop currents at which no gear is overloaded
ROUNDS = 8  # iterations for the directions of power through the meshes
SLIPPING = 1e-9  # speed of a joint that is about to slip [rad/s]
FEW = 16  # samples from which stops are tried first where one that fails is enough
OVER = 1.0 + 1e-9  # factor on a limit, so that rounding alone never exceeds it


@dataclass(frozen=True, eq=False)
class Braking:
    """Braking of the n joints of an arm."""

    torque: Array  # braking torque at the motors' shafts [N m], (n,); 0 where nothing brakes
    delay: Array  # time from the start of the stop until the torque acts [s], (n,)
    ramp: Array  # time in which the speed falls linearly to 0 [s], (n,); NaN where the torque decelerates the joint

    @property
    def ends(self) -> Any:
        """Which joints are braked, by a torque or along a ramp, (n,)."""
        return (self.torque > 0.0) | np.isfinite(self.ramp)


@dataclass(frozen=True, eq=False)
class Stops:
    """Results of stops from S states of the cycle for n joints."""

    first: Indices  # sample at which each stop starts, (S,)
    torque: Array  # largest torque at the gears' outputs, oscillation of their springs included [N m], (S, n)
    travel: Array  # travel of the gears' outputs [rad], (S, n); infinite for a braked joint that does not come to rest
    energy: Array  # heat in each brake [J], (S, n); infinite for a braked joint that does not come to rest
    duration: Array  # time until all braked joints rest [s], (S,); infinite if they never do


@dataclass(frozen=True, eq=False)
class _Driven:
    """An arm with one payload and its drives, in terms of the gear output angles s; n joints."""

    study: Study  # its counterbalances act on the joints
    arm: Arm  # with payload, drives and rotors
    turns: Array  # motion of each joint per radian of each gear's output [rad or m], (n, n)
    travels: Array  # travel of each joint per radian of its own gear's output [rad or m], (n,)
    ratio: Array  # gear ratios, (n,)
    rotor: Array  # rotor inertia reflected to the gear's output [kg m^2], (n,)
    # Records, one per joint: gears and the friction at the motors' shafts.
    gears: Any
    shafts: Any
    springs: Array  # gear springs for the oscillation, in the order of ``StiffSpring``, (n, 5)
    stiffest: Array  # largest slope of each spring [N m/rad], infinite for a direct drive, NaN if unknown, (n,)
    drag: Array  # temperature factor of each gear's drag, (n,)
    # Torque factors of the meshes for power from motor to load and from load to motor, (n,).
    driving: Array
    driven: Array
    onward: Array  # factor by which stages and load-dependent friction increase the gear torque, (n,)
    stages: Array  # inertia of the stages at the gear's output, (n,) [kg m^2]
    rises: tuple[float, ...]  # rise time of each braking torque [s]

    def torques(self, q: Array, speed: Array, acceleration: Array, tip: Array | None) -> tuple[Array, Array]:
        """Gear output torques, and the torques that accelerate the rotors [N m], (S, n) each.

        ``tip``: what the tip applies to its surroundings, as in ``Cycle.tip_wrench``, (S, 6).
        """
        found = drive_torques(self.arm, q, speed @ self.turns.T, acceleration @ self.turns.T, tip_wrench=tip)
        gear = found.gear * self.travels
        return gear - counterbalance_torques(self.study, q), found.motor * self.ratio - gear

    def equations(self, q: Array, speed: Array, tip: Array | None) -> tuple[Array, Array, Array, Array]:
        """A, b, B and r of the equations in the module's docstring, (S, n, n) and (S, n)."""
        count, n = speed.shape
        units = np.tile(np.concatenate([np.zeros((1, n)), np.eye(n)]), (count, 1))
        tips = None if tip is None else np.repeat(tip, n + 1, axis=0)
        every = self.torques(np.repeat(q, n + 1, axis=0), np.repeat(speed, n + 1, axis=0), units, tips)
        gear, rotor = (part.reshape(count, n + 1, n) for part in every)
        first, second = ((part[:, 1:] - part[:, :1]).swapaxes(1, 2) for part in (gear, rotor))
        return first, gear[:, 0], second, rotor[:, 0]

    def push(self, speed: Array, limit: Array, free: Any) -> Array:
        """Torque that brakes the rotors, at the gear output [N m], (S, n); ``free``: states without losses, (S, 1)."""
        lossy = _pushes(self.gears, self.shafts, self.drag, limit, speed)
        return np.where(free, -np.sign(speed) * np.abs(self.ratio) * limit, lossy)

    def swings(self, inertia: Array) -> Array:
        """Overshoot of each spring as a share of a torque step, (S, n); ``inertia``: of the load at the gear output [kg
        m^2], (S, n).
        """
        shares = np.ones(inertia.shape)
        for k, rise in enumerate(self.rises):
            if rise > 0.0:
                shares[:, k] = [overshoot(self.gears[k].stiffness_1, one, self.rotor[k], rise) for one in inertia[:, k]]
        return shares


def march(
    study: Study, drives: Mapping[str, Drive], braking: Braking, first: Indices, enough: Array | None = None
) -> tuple[Stops, Stops]:
    """Stops of an arm from some samples of its cycle, with losses and without; integration ends when a gear torque [N
    m] of the former exceeds ``enough``, (n,). Then a few of the samples come first: most that fail do so from them.
    """
    arms: list[tuple[_Driven, Any]] = [
        (_driven(study, arm, drives), chosen) for arm, chosen in loaded_arms(study, drives)
    ]
    if enough is not None:
        few = _stops(arms, study, braking, first[:: max(1, len(first) // FEW)], enough)
        if (few[0].torque > enough).any():
            return few
    return _stops(arms, study, braking, first, enough)


def _stops(
    arms: list[tuple[_Driven, Any]], study: Study, braking: Braking, first: Indices, enough: Array | None
) -> tuple[Stops, Stops]:
    """Stops from all of some samples; ``arms``: the arm with each payload, and the samples at which it moves."""
    twice = np.concatenate([first, first])
    torque, travel, energy = np.zeros((3, len(twice), len(study.joints)))
    found = Stops(twice, torque, travel, energy, np.full(len(twice), math.inf))
    for driven, chosen in arms:
        rows = np.flatnonzero(chosen[twice])
        if len(rows):
            _march(driven, study, braking, found, rows, (rows >= len(first))[:, None], enough)
    halves = zip(*(np.split(getattr(found, field.name), 2) for field in fields(found)), strict=True)
    lossy, lossless = (Stops(*half) for half in halves)
    return lossy, lossless


def _driven(study: Study, arm: Arm, drives: Mapping[str, Drive]) -> _Driven:
    every, travels = [drives[task.name] for task in study.joints], joint_travels(study)
    shafts = joint_turns(arm)
    gears = as_records([complete(one.gear) for one in every])
    meshes = [mesh_of(one) for one in gears]
    cold, ratio = study.cold_start, np.array([one.gear.ratio for one in every])
    coldest = min(float(study.drag_temperature(study.ambient)), math.inf if cold is None else cold)
    driving, driven = (np.array([getattr(one, way) for one in meshes]) for way in ("driving", "driven"))
    return _Driven(
        study, arm, shafts * travels, travels, ratio, ratio**2 * np.array([drive_inertia(one) for one in every]), gears,
        as_records([shaft_friction(one) for one in every]), np.array([swing_spring(one) for one in gears]),
        _stiffest(every, gears), np.array([drag_factor(one, coldest) for one in meshes]),
        driving, driven, np.array([onward(one) for one in gears]),
        np.array([stage_load(one) for one in gears]), tuple(task.stop.rise for task in study.joints),
    )  # fmt: skip


def _stiffest(drives: list[Drive], gears: Any) -> Array:
    """Largest slope of the spring of each drive [N m/rad], (n,): infinite for a direct drive, NaN if unknown."""
    slopes = np.array([stiff_spring(one).slope_3 for one in gears])
    return np.where([one.gear.direct for one in drives], math.inf, slopes)


def _march(
    driven: _Driven, study: Study, braking: Braking, found: Stops, rows: Indices, free: Any, enough: Array | None
) -> None:
    """Fill the ``rows`` of ``found`` that belong to one payload; ``free``: rows without losses, (S, 1)."""
    cycle, back = study.cycle, np.linalg.inv(driven.turns).T
    start = found.first[rows]
    q, speed, time = cycle.position[start], cycle.velocity[start] @ back, np.zeros(len(rows))
    pressed = cycle.tip_wrench  # acts on the arm until it rests
    tip = None if pressed is None else pressed[start]
    before, _ = driven.torques(q, speed, cycle.acceleration[start] @ back, tip)
    slowing, ramped, overshoots = -speed / braking.ramp, np.isfinite(braking.ramp), None
    all_stop, unit = bool(np.all(braking.ends)), np.eye(len(driven.ratio))
    wound, turning = before, np.abs(speed)  # torques and speeds before anything brakes
    while len(rows):
        engaged = time[:, None] >= braking.delay - INSTANT
        limit = braking.torque * engaged
        first, constant, rotor, rest = driven.equations(q, speed, tip)
        sign, acceleration, torque = _slowed(
            driven, (first, constant, rotor, rest), speed, limit, slowing, ramped, free
        )
        own = np.diagonal(first, axis1=1, axis2=2)
        overshoots = driven.swings(own) if overshoots is None else overshoots
        swung = np.abs(_swung(driven.springs, before, torque, overshoots))
        # the same condition as in ``drive.stops.braked``
        locks = np.where(free, 1.0, driven.driven) * own + driven.rotor <= 0.0
        # the links on their springs if all rotors stop; otherwise each joint alone on what the others do
        carried, still = (first, constant) if all_stop else (own[..., None] * unit, torque - own * acceleration)
        braked = engaged.any(axis=1, keepdims=True)
        wound = np.where(braked, wound, before)
        turning = np.where(braked, np.maximum(turning, np.abs(speed)), np.abs(speed))
        taken = driven.stages * np.abs(acceleration)
        # the others need no bound: their gears were loaded more at an earlier instant
        more = ~(driven.onward * (swung + taken) <= found.torque[rows]).all(axis=1)
        excess = (wound - still)[more]
        bound = np.abs(still[more]) + struck_torques(carried[more], driven.stiffest, turning[more], excess)
        swung[more] = np.minimum(swung[more], bound)
        swung = np.where(locks & (speed != 0.0), np.inf, swung)
        gear_torque = np.where(ramped, np.abs(torque), swung) + taken
        found.torque[rows] = np.maximum(found.torque[rows], driven.onward * gear_torque)
        # only the stops with losses decide on torque
        if enough is not None and ((found.torque[rows] > enough) & ~free).any():
            return
        moving = ((sign != 0.0) & braking.ends).any(axis=1) | (~engaged & braking.ends).any(axis=1)
        found.duration[rows[~moving]] = time[~moving]
        with np.errstate(divide="ignore", invalid="ignore"):
            own_end = np.where((acceleration * speed < 0.0) & ~ramped, -speed / acceleration, np.inf)
        ramp_end = np.where(ramped & (speed != 0.0), np.maximum(braking.ramp - time[:, None], 0.0), np.inf)
        until_engaged = np.where(engaged, np.inf, braking.delay - time[:, None])
        rests = np.minimum(np.where(own_end <= NEAR, own_end, np.inf), ramp_end)
        ends = np.concatenate([np.where(own_end <= NEAR, own_end, 0.5 * own_end), ramp_end, until_engaged], axis=1)
        step = np.minimum(ends.min(axis=1), np.maximum(STEP, GROWTH * time))[:, None]
        after = np.where(rests <= step + INSTANT, 0.0, speed + acceleration * step)
        # ends a limit cycle in which two joints keep breaking each other loose
        after = np.where(np.abs(after) < SLIPPING, 0.0, after)
        moved = 0.5 * (speed + after) * step
        found.travel[rows] += np.abs(moved)
        found.energy[rows] += limit * np.abs(driven.ratio * moved)
        q, speed, time, before = q + moved @ driven.turns.T, after, time + step[:, 0], torque
        lost = moving & (~(time < LONGEST) | (np.abs(speed) > FASTEST).any(axis=1))
        endless, kept = lost[:, None] & (speed != 0.0) & braking.ends, moving & ~lost
        found.travel[rows] += np.where(endless, np.inf, 0.0)
        found.energy[rows] += np.where(endless, np.inf, 0.0)
        rows, q, speed, time, before, slowing, overshoots, free = (
            part[kept] for part in (rows, q, speed, time, before, slowing, overshoots, free)
        )
        wound, turning = wound[kept], turning[kept]
        tip = None if tip is None else tip[kept]


@kernel
def _pushes(gears: Any, shafts: Any, drag: Array, limit: Array, speed: Array) -> Array:
    """``braking_push`` of each joint without a turning carrier, (S, n)."""
    found = np.empty(speed.shape)
    for k in range(len(gears)):
        mesh, shaft = mesh_of(gears[k]), friction_curve(shafts[k])
        for i in range(len(speed)):
            found[i, k] = braking_push(mesh, shaft, drag[k], 0.0, limit[i, k], speed[i, k], 0.0)
    return found


@kernel
def _swung(springs: Array, before: Array, torque: Array, shares: Array) -> Array:
    """Peak torque of each spring's oscillation after a step of torque [N m], (S, n)."""
    found = np.empty(torque.shape)
    for k in range(len(springs)):
        first, second, third, lower, upper = springs[k]
        spring = StiffSpring(first, second, third, lower, upper)
        for i in range(len(torque)):
            found[i, k] = swung_torque(spring, before[i, k], torque[i, k], shares[i, k])
    return found


def _slowed(
    driven: _Driven, equations: tuple[Array, ...], speed: Array, limit: Array, slowing: Array, ramped: Any,
    free: Any,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Directions of motion of the joints, 0 for those held at rest; accelerations; torques at the gear outputs.

    A joint at rest slips where motor or brake and the friction of its mesh do not hold it.
    """
    first, constant, rotor, rest = equations
    signs, given, unit = np.sign(speed), np.where(ramped & (speed != 0.0), slowing, 0.0), np.eye(len(driven.ratio))
    up, down = (np.where(free, 1.0, factor) for factor in (driven.driving, driven.driven))
    ahead, back = (driven.push(np.where(speed != 0.0, speed, slip), limit, free) for slip in (SLIPPING, -SLIPPING))
    driving = np.zeros(speed.shape, dtype=bool)
    for _ in range(ROUNDS):
        factor, fixed = np.where(driving, up, down), ramped | (signs == 0.0)
        braked = np.where(signs < 0.0, back, ahead)
        matrix = np.where(fixed[..., None], unit, factor[..., None] * first + rotor)
        right_side = np.where(fixed, given, braked - factor * constant - rest)
        acceleration = np.linalg.solve(matrix, right_side[..., None])
        torque, turning = constant + (first @ acceleration)[..., 0], rest + (rotor @ acceleration)[..., 0]
        acceleration, one, other = acceleration[..., 0], down * torque + turning, up * torque + turning
        # least holding torque, with the help of the mesh friction
        held = np.clip(0.0, np.minimum(one, other), np.maximum(one, other))
        strength = np.abs(np.where(held > 0.0, back, ahead))
        slips, now = (signs == 0.0) & ~ramped & (np.abs(held) > strength), torque * signs > 0.0
        if not slips.any() and (now == driving)[~fixed].all():
            break
        signs, driving = np.where(slips, -np.sign(held), signs), now
    return signs, np.where((speed == 0.0) & (acceleration * signs < 0.0), 0.0, acceleration), torque


# Checks of stops of all joints at once against the limits of gears and brakes.


AT_CURRENT, POWER_OFF, BRAKE_HEAT = STOP_CHECKS


def needs_arm_stops(study: Study) -> bool:
    """Whether a study needs stops of all joints at once."""
    return _stops_at_current(study) or any(task.brakes and task.stop.power_off for task in study.joints)


def stop_checks(study: Study, drives: Mapping[str, Drive], *, quick: bool = False) -> Iterator[Check]:
    """The checks of a set of drives by joint name; empty if none is needed. With ``quick`` a set that fails is followed
    only to its first violation.
    """
    if study.arm is None or not study.cycle.velocity.any():
        return
    every, tasks = [drives[task.name] for task in study.joints], study.joints
    nothing, open_end = np.zeros(len(tasks)), np.full(len(tasks), math.nan)
    missing = _lacks(drives, torque_lacks)
    if _stops_at_current(study):
        currents = [stop_current(task.stop.current, task.amplifier) for task in tasks]
        ramps = np.array([math.nan if task.stop.ramp is None else task.stop.ramp for task in tasks])
        limits = np.array([(i or 0.0) * _constant(study, one) for i, one in zip(currents, every, strict=True)])
        unknown = [task.name for task, i in zip(tasks, currents, strict=True) if i is None and task.stop.ramp is None]
        reason = f"no current of a stop is known at {', '.join(unknown)}" if unknown else missing
        yield from _checks_of(study, drives, AT_CURRENT, Braking(limits, nothing, ramps), reason, quick)
    if any(one.motor.brake.key and task.stop.power_off for one, task in zip(every, tasks, strict=True)):
        brakes = [one.motor.brake for one in every]
        limits = np.array([one.static_torque or 0.0 for one in brakes])
        delays = np.array([one.engage_time or 0.0 for one in brakes])
        reason = missing or _lacks(drives, _brake_lacks)
        yield from _checks_of(study, drives, POWER_OFF, Braking(limits, delays, open_end), reason, quick)


def _stops_at_current(study: Study) -> bool:
    """Whether several joints stop at once and some of them at a known current limit."""
    known = [stop_current(task.stop.current, task.amplifier) is not None for task in study.joints]
    free = [task.stop.ramp is None for task in study.joints]
    return study.arm is not None and len(free) > 1 and any(np.logical_and(known, free))


def _constant(study: Study, drive: Drive) -> float:
    """Torque constant of cold magnets, which brake the most [N m/A]."""
    cold = math.inf if study.cold_start is None else study.cold_start
    return float(strongest_constant(drive.motor, min(study.ambient, cold)))


def _lacks(drives: Mapping[str, Drive], of: Callable[[Drive], str]) -> str:
    """What the data sheets of the drives lack, in words."""
    missing = [f"{name}: {text} not in the catalogue row" for name, one in drives.items() if (text := of(one))]
    return "; ".join(missing)


def _brake_lacks(drive: Drive) -> str:
    """What a brake's data sheet lacks for a stop, in words."""
    own = drive.motor.brake
    names = ("static_torque", "engage_time") if own.key else ()
    return " and ".join(f"the brake's {name.replace('_', ' ')}" for name in names if getattr(own, name) is None)


def _checks_of(
    study: Study, drives: Mapping[str, Drive], row: Requirement, braking: Braking, missing: str, quick: bool
) -> Iterator[Check]:
    every = [drives[task.name] for task in study.joints]
    limits = [math.inf if one.gear.direct else one.gear.momentary_torque for one in every]
    least = [float(least_momentary_torque(as_record(one.gear))) for one in every]
    heat, factor = row is POWER_OFF, study.safety.peak_torque
    moving = np.flatnonzero(study.cycle.velocity.any(axis=1))
    first = stop_starts(study.cycle, np.arange(len(study.cycle.time)) if heat else moving)
    if not missing:
        try:
            enough = np.array(_with_assumed(limits, least)) * (OVER / factor) if quick else None
            worst, longest = march(study, drives, braking, first, enough)
        except InputError as error:  # the stop leaves the reach of a linkage
            missing = f"a stop cannot be followed: {error.faults[0]}"
    if missing:
        for one in (row, BRAKE_HEAT) if heat else (row,):
            yield Check(one.name, None, None, one.unit, None, Verdict.NOT_CHECKED, remark=missing)
        return
    ways = _ways(study, longest)
    if not heat and not quick and (used := worst.torque * factor / np.array(_with_assumed(limits, least))).max() > 1.0:
        joint, allowed = int(np.argmax(used.max(axis=0))), np.array(_with_assumed(limits, least)) * (OVER / factor)
        ways += _safe_current(study, drives, braking, first, allowed, joint)
    yield _check(study, row, factor, worst.torque, limits, least, worst.first, ways)
    if heat:
        limits = [one.motor.brake.energy_per_stop if one.motor.brake.key else math.inf for one in every]
        least = [LEAST_ENERGY * (one.motor.brake.static_torque or math.nan) for one in every]
        yield _check(study, BRAKE_HEAT, 1.0, longest.energy, limits, least, worst.first, ways)


def _check(
    study: Study, row: Requirement, factor: float, torques: Array, limits: list[float | None], least: list[float],
    first: Indices, ways: str,
) -> Check:  # fmt: skip
    """Required values of n joints over S states against the limit of each; the result is the check of the joint with
    the highest utilisation.

    If a data sheet gives no limit, an assumed one is used; what exceeds that is NOT CHECKED.
    """
    names, largest = study.joint_names, torques.max(axis=0)
    assumed, allowed = np.array([one is None for one in limits]), _with_assumed(limits, least)
    used = np.array([utilisation(factor * one, limit) for one, limit in zip(largest, allowed, strict=True)])
    fails = (used > 1.0) & ~assumed
    joint = int(np.argmax(np.where(fails.any() & assumed, -1.0, np.nan_to_num(used, nan=math.inf))))
    verdict = judged(float(used[joint]), study.safety.reserve)
    doubtful = bool(assumed[joint]) and not used[joint] <= 1.0
    state = int(np.argmax(torques[:, joint]))
    time, limit = float(study.cycle.time[first[state]]), allowed[joint]
    unknown = [name for name, one in zip(names, assumed, strict=True) if one]
    missing = f"{row.sheet} is not in the catalogue row of {', '.join(unknown)}" if unknown else ""
    if doubtful:
        missing += f": more than {limit:.4g} {row.unit}, which is assumed" if known(limit) else ""
    remark = "; ".join(filter(None, (f"{names[joint]}, in a stop from t = {time:.4g} s", ways, missing)))
    return Check(
        row.name, factor * float(largest[joint]), limit if known(limit) and math.isfinite(limit) else None, row.unit,
        None if doubtful else float(used[joint]), Verdict.NOT_CHECKED if doubtful else verdict, time,
        f"{row.sheet} of {names[joint]}", remark, doubtful, factor,
    )  # fmt: skip


def _safe_current(
    study: Study, drives: Mapping[str, Drive], braking: Braking, first: Indices, limits: Array, joint: int
) -> str:
    """The largest share of all stop currents at which no gear is overloaded, in words."""
    low, high, holds = 0.0, 1.0, False
    for _ in range(HALVINGS):
        share = 0.5 * (low + high)
        try:
            worst, longest = march(study, drives, replace(braking, torque=share * braking.torque), first, limits)
            safe = bool((worst.torque <= limits).all())
        except InputError:  # the stop leaves the reach of a linkage
            safe = False
        if safe:
            low, holds = share, bool(np.isfinite(longest.duration).all())
        else:
            high = share
    if low == 0.0:
        return "; no current keeps every gear safe, so let stops follow a ramp (stop: {ramp: ...})"
    task = study.joints[joint]
    current = low * braking.torque[joint] / _constant(study, drives[task.name])
    text = f"; up to {math.floor(1000.0 * low) / 10.0:g} % of all stop currents keep every gear safe"
    text += f", {amperes(task.amplifier, drives[task.name].motor, current)} at {task.name}" if current > 0.0 else ""
    if holds:
        return text
    return f"{text}, and do not stop the arm from some states: let stops follow a ramp (stop: {{ramp: ...}})"


def _with_assumed(limits: list[float | None], least: list[float]) -> list[float]:
    return [less if one is None else one for one, less in zip(limits, least, strict=True)]


def _ways(study: Study, stops: Stops) -> str:
    """Duration of stops and travel of the joints, in words."""
    longest, largest = float(stops.duration.max()), stops.travel.max(axis=0) * joint_travels(study)
    time = f"at rest in at most {longest:.3g} s" if math.isfinite(longest) else "from some states it never rests"
    ways = [
        f"{task.name} {math.degrees(way):.3g} deg"
        if task.travel_per_turn is None
        else f"{task.name} {1e3 * way:.3g} mm"
        for task, way in zip(study.joints, largest, strict=True)
    ]
    return f"{time}; travel at most {', '.join(ways)}"
