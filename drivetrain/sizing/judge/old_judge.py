"""One drive at one joint, judged: the same stages for an evaluation and for a search."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetrain.drive.gear import mesh_factors
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.sizing.judge.checks_gear import GEAR_CHECKS
from drivetrain.sizing.judge.checks_motor import ELECTRIC_CHECKS, SPEED_CHECKS, TORQUE_CHECKS
from drivetrain.sizing.judge.operation import Operation
from drivetrain.sizing.results import JointResult
from drivetrain.study.verdicts import Check, Verdict

STAGES = (GEAR_CHECKS, SPEED_CHECKS, TORQUE_CHECKS, ELECTRIC_CHECKS)
"""From cheap to dear: what needs no motor torque, what needs no temperature, and the rest."""


def judge(operation: Operation, *, stop_at_fail: bool = False) -> tuple[Check, ...]:
    """Everything held against one drive."""
    found: list[Check] = []
    for stage in STAGES:
        if stage is GEAR_CHECKS and is_direct(operation):
            continue
        found += [check(operation) for check in stage]
        if stop_at_fail and any(check.verdict is Verdict.FAIL for check in found):
            break
    return tuple(found)


def is_direct(operation: Operation) -> bool:
    """Whether there is no gear."""
    return operation.drive.gear.key == ""


def joint_result(operation: Operation, name: str, motor: str, gear: str) -> JointResult:
    """One joint's drive with every check and its series."""
    checks = tuple(placed(operation.demand.cycle, check) for check in judge(operation))
    return JointResult(name, motor, gear, operation.drive, checks, operation.series(), tuple(_remarks(operation)))


def placed(cycle: Cycle, check: Check) -> Check:
    """A check that says in which part of a mix its instant lies."""
    if len(cycle.parts) == 1 or check.time is None:
        return check
    part = cycle.part_at(check.time)
    begin = float(cycle.time[cycle.parts[part].start])
    said = f"in {cycle.part_names[part]}, {check.time - begin:.4g} s into it"
    return replace(check, remark=f"{said}; {check.remark}" if check.remark else said)


def _remarks(operation: Operation) -> list[str]:
    """What a reader should know that belongs to no single check."""
    demand = operation.demand
    remarks = []
    if operation.task.coupled:
        others = ", ".join(operation.task.coupled)
        remarks.append(f"drives {others} together with others: torque, speed and position are its shaft's")
    if operation.missing:
        remarks.append(
            f"{operation.missing} unknown: motor torque, current and power are shown without and are not judged"
        )
    holds = bool(np.any(demand.gear_torque[demand.at_rest == 1] != 0.0))
    if holds and demand.moves:
        remarks.append(
            "at rest the mesh carries part of the load: heat counts the smaller torque that still holds, "
            "peaks the larger one that starts the motion"
        )
    elif holds:
        remarks.append("the joint never moves: the smaller torque that still holds counts")
    if mesh_factors(operation.computed.gear).driven <= 0.0:
        remarks.append("the gear locks itself: the load cannot drive the motor, which must help it down")
    if operation.heat is not None and not operation.heat.converged:
        remarks.append("magnet and housing temperature could not be matched: temperatures are approximate")
    return remarks
