"""The forces between the tip and its surroundings that steps of the cycle name."""

from __future__ import annotations

from functools import partial
from io import StringIO

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.kinematics import tip_pose_and_jacobian
from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError
from drivetrain.motion.duty_cycle import GAP_ALLOWED, StepForce
from drivetrain.motion.read import read_forces
from drivetrain.spatial.wrenches import turned
from drivetrain.study.document import Place
from drivetrain.study.faults import Ledger
from drivetrain.study.model import ProcessForce
from drivetrain.study.schema import ForceForm, StudyForm

RESTING = 1e-9  # of the largest speed of the point during a step: below it, the point rests


def resolve_forces(form: StudyForm, arm: Arm | None, ledger: Ledger) -> dict[str, ProcessForce]:
    """The forces of a study by name."""
    found = {}
    if form.forces and form.arm is None:
        ledger.fault(("forces",), "apply only to an arm: load tables already hold the load")
    for name, own in form.forces.items():
        place: Place = ("forces", name)
        source = [what for what in ("file", "samples") if getattr(own, what) is not None]
        stated = [what for what in ("force", "moment") if any(getattr(own, what))]
        for what in [*source[1:], *(stated if source else ())]:
            ledger.fault((*place, what), f"cannot be combined with {source[0]}")
        if not (source or stated or own.along_motion):
            ledger.fault(place, "must state a force, a moment, along_motion or a file")
        closed = arm is not None and arm.linkage is not None
        for what in ("axes", "along_motion") if closed else ():
            if getattr(own, what) not in ("tip", 0.0):
                hint = "state it in the axes of the tip"
                ledger.fault((*place, what), "is not known for arms with closed loops", getattr(own, what), hint)
        table = _table(own, source[0], place, ledger) if source else None
        if not ledger.spoiled(place):
            found[name] = own.made(name=name, table=table)
    unused = set(form.forces) - named_forces(form)
    if unused and (form.cycle is not None or form.mix is not None):
        ledger.note([f"warning: forces that no step of the cycle names: {', '.join(sorted(unused))}"])
    return found


def named_forces(form: StudyForm) -> set[str]:
    """Names of the forces that steps of the cycle name; without a cycle, all."""
    steps = [*(form.cycle or ()), *(step for part in form.mix or () for step in part.cycle)]
    return {step.force for step in steps if step.force is not None} if steps else set(form.forces)


def _table(own: ForceForm, kind: str, place: Place, ledger: Ledger) -> Array | None:
    source = StringIO(own.samples) if own.samples is not None else ledger.document.folder / (own.file or "")
    return ledger.attempt((*place, kind), read_forces, source)


def force_of_step(arm: Arm | None, force: ProcessForce | None) -> StepForce | None:
    """A force as the cycle needs it; None if there is none."""
    if force is None or arm is None:
        return None
    times = np.zeros(0) if force.table is None else force.table[:, 0]
    return StepForce(force.name, times, partial(_tip_wrench, arm, force))


def _tip_wrench(arm: Arm, force: ProcessForce, time: Array, position: Array, velocity: Array) -> Array:
    """What the tip applies to its surroundings, in the tip frame, as ``StepForce.wrench``."""
    table, count = force.table, len(time)
    if table is None:
        wrench = np.tile([*force.moment, *force.force], (count, 1))
    else:
        if table[0, 0] > 0.0 or table[-1, 0] < time[-1] * (1.0 - GAP_ALLOWED):
            problem = f"must cover the step, from 0 s to {time[-1]:.6g} s"
            raise InputError(Fault(f"force {force.name}", problem, f"{table[0, 0]:.6g} s to {table[-1, 0]:.6g} s"))
        wrench = np.column_stack([np.interp(time, table[:, 0], column) for column in table[:, 1:].T])
    if force.applied_by == "surroundings":
        wrench = -wrench
    point = np.array(force.point)
    if force.axes == "base" or force.along_motion:
        pose, jacobian = tip_pose_and_jacobian(arm, position)
        into_tip = np.swapaxes(pose[:, :3, :3], 1, 2)
        wrench = turned(into_tip, wrench) if force.axes == "base" else wrench
        turning, moving = np.hsplit(turned(into_tip, (jacobian @ velocity[:, :, None])[:, :, 0]), 2)
        speed = moving + np.cross(turning, point)
        size = np.linalg.norm(speed, axis=1, keepdims=True)
        rests = size <= RESTING * size.max()
        wrench[:, 3:] += np.where(rests, 0.0, force.along_motion * speed / np.where(rests, 1.0, size))
    wrench[:, :3] += np.cross(point, wrench[:, 3:])
    return wrench
