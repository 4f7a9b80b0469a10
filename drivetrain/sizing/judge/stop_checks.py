"""What stops of all joints at once ask of a set of drives, held against what its gears and brakes bear."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.drive import Drive
from drivetrain.motion.duty_cycle import Indices
from drivetrain.sizing.demand.stops import stop_starts
from drivetrain.sizing.judge.arm_stops import Braking, Stops, march
from drivetrain.sizing.judge.cases import stop_current
from drivetrain.sizing.judge.checks import STOP_CHECKS, Requirement
from drivetrain.sizing.judge.judge import utilisation
from drivetrain.sizing.judge.missing import torque_lacks
from drivetrain.sizing.judge.stiffness import joint_travels
from drivetrain.sizing.judge.verdicts import judged
from drivetrain.study.model import Study
from drivetrain.study.parts.verdicts import Check, Verdict

AT_CURRENT, POWER_OFF, BRAKE_HEAT = STOP_CHECKS


def asks_stops(study: Study) -> bool:
    """Whether sets of drives of a study are held against a stop of all joints."""
    return _stops_at_current(study) or any(task.brakes and task.stop.power_off for task in study.joints)


def stop_checks(study: Study, drives: Mapping[str, Drive]) -> Iterator[Check]:
    """The checks of a set of drives, of every joint by name; none where none is asked."""
    if study.arm is None or not study.cycle.velocity.any():
        return
    every, tasks = [drives[task.name] for task in study.joints], study.joints
    nothing, open_end = np.zeros(len(tasks)), np.full(len(tasks), math.nan)
    silent = _lacks(drives, torque_lacks)
    if _stops_at_current(study):
        currents = [stop_current(task.stop.current, task.amplifier) for task in tasks]
        ramps = np.array([math.nan if task.stop.ramp is None else task.stop.ramp for task in tasks])
        limits = np.array([(i or 0.0) * one.motor.torque_constant for i, one in zip(currents, every, strict=True)])
        unknown = [task.name for task, i in zip(tasks, currents, strict=True) if i is None and task.stop.ramp is None]
        lack = f"no current of a stop is known at {', '.join(unknown)}" if unknown else silent
        yield from _told(study, drives, AT_CURRENT, Braking(limits, nothing, ramps), lack)
    if any(one.motor.brake.key and task.stop.power_off for one, task in zip(every, tasks, strict=True)):
        brakes = [one.motor.brake for one in every]
        limits = np.array([one.static_torque or 0.0 for one in brakes])
        delays = np.array([one.engage_time or 0.0 for one in brakes])
        yield from _told(
            study, drives, POWER_OFF, Braking(limits, delays, open_end), silent or _lacks(drives, _brake_lacks)
        )


def _stops_at_current(study: Study) -> bool:
    """Whether several joints stop at once and some of them at the limit of a current that is known."""
    known = [stop_current(task.stop.current, task.amplifier) is not None for task in study.joints]
    free = [task.stop.ramp is None for task in study.joints]
    return study.arm is not None and len(free) > 1 and any(np.logical_and(known, free))


def _lacks(drives: Mapping[str, Drive], of: Callable[[Drive], str]) -> str:
    """What the sheets of all drives do not say, in words."""
    told = [f"{name}: {text} not in the catalogue row" for name, one in drives.items() if (text := of(one))]
    return "; ".join(told)


def _brake_lacks(drive: Drive) -> str:
    """What a brake's sheet does not say of a stop."""
    own = drive.motor.brake
    names = ("static_torque", "engage_time") if own.key else ()
    return " and ".join(f"the brake's {name.replace('_', ' ')}" for name in names if getattr(own, name) is None)


def _told(study: Study, drives: Mapping[str, Drive], row: Requirement, braking: Braking, lack: str) -> Iterator[Check]:
    """The checks of one kind of stop."""
    heat, factor = row is POWER_OFF, study.safety.peak_torque
    if lack:
        for one in (row, BRAKE_HEAT) if heat else (row,):
            yield Check(one.name, None, None, one.unit, None, Verdict.NOT_CHECKED, remark=lack)
        return
    moving = np.flatnonzero(study.cycle.velocity.any(axis=1))
    first = stop_starts(study.cycle, np.arange(len(study.cycle.time)) if heat else moving)
    worst, longest = march(study, drives, braking, first)
    ways = _ways(study, longest)
    every = [drives[task.name] for task in study.joints]
    limits = [math.inf if one.gear.direct else one.gear.momentary_torque for one in every]
    yield _check(study, row, factor, worst.torque, limits, first, ways)
    if heat:
        limits = [one.motor.brake.energy_per_stop if one.motor.brake.key else math.inf for one in every]
        yield _check(study, BRAKE_HEAT, 1.0, longest.energy, limits, first, ways)


def _check(
    study: Study, row: Requirement, factor: float, asked: Array, limits: list[float | None], first: Indices, ways: str
) -> Check:
    """What is asked of n joints from S states, held against the limit of each; the joint nearest to its limit tells."""
    names = [task.name for task in study.joints]
    silent = [name for name, limit in zip(names, limits, strict=True) if limit is None]
    allowed, most = np.array([math.nan if one is None else one for one in limits]), asked.max(axis=0)
    used = [utilisation(factor * one, limit) for one, limit in zip(most, allowed, strict=True)]
    joint = int(np.nanargmax(np.append(used, -1.0)))
    lack = f"{row.sheet} is not in the catalogue row of {', '.join(silent)}" if silent else ""
    if joint == len(names):
        return Check(row.name, None, None, row.unit, None, Verdict.NOT_CHECKED, remark=f"{lack}; {ways}", factor=factor)
    state, verdict = int(np.argmax(asked[:, joint])), judged(used[joint], study.safety.reserve)
    if silent and verdict is not Verdict.FAIL:
        verdict = Verdict.NOT_CHECKED
    time = float(study.cycle.time[first[state]])
    remark = "; ".join(filter(None, (f"{names[joint]}, in a stop from t = {time:.4g} s", ways, lack)))
    return Check(
        row.name, factor * float(most[joint]), None if limits[joint] == math.inf else limits[joint], row.unit,
        None if verdict is Verdict.NOT_CHECKED else float(used[joint]), verdict, time, f"{row.sheet} of {names[joint]}",
        remark, factor=factor,
    )  # fmt: skip


def _ways(study: Study, stops: Stops) -> str:
    """How long stops take and how far the joints go in them, in words."""
    longest, most = float(stops.duration.max()), stops.travel.max(axis=0) * joint_travels(study)
    time = f"at rest in at most {longest:.3g} s" if math.isfinite(longest) else "from some states it never rests"
    ways = [
        f"{task.name} {math.degrees(way):.3g} deg"
        if task.travel_per_turn is None
        else f"{task.name} {1e3 * way:.3g} mm"
        for task, way in zip(study.joints, most, strict=True)
    ]
    return f"{time}; travel at most {', '.join(ways)}"
