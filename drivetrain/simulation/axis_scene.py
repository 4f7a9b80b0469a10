"""What an axis without an arm does and carries: the motion and the load that its table of torque and speed holds."""

from __future__ import annotations

import numpy as np

from drivetrain.drive.drive import Drive, drive_inertia
from drivetrain.effects.given_torque import GivenTorque
from drivetrain.effects.rotor import ReflectedRotor
from drivetrain.errors import Fault, InputError
from drivetrain.motion.motion import Motion
from drivetrain.simulation.scene import Inertia
from drivetrain.study.model import Study


def axis_faults(study: Study) -> list[Fault]:
    """What keeps a study without an arm from being simulated."""
    faults = []
    if len(study.joints) > 1:
        hint = "axes that no arm couples can be studied one at a time"
        faults.append(Fault("joints", "without an arm one joint can be simulated", len(study.joints), hint))
    for task in study.joints:
        if task.load_inertia is None:
            hint = "such as 15 kg m^2: what the gear turns, whose acceleration is already in the table's torque"
            faults.append(Fault(f"joints.{task.name}.load_inertia", "is needed to simulate a load table", hint=hint))
    return [Fault(one.place, one.problem, one.value, one.hint, study.path or "") for one in faults]


def axis_body(study: Study) -> Inertia:
    """The load as one inertia.

    Raises:
        InputError: As ``axis_faults`` tells.
    """
    faults = axis_faults(study)
    if faults:
        raise InputError(faults)
    task = study.joints[0]
    return Inertia(float(task.load_inertia or 0.0), name=task.name)


def axis_rotor(drive: Drive) -> ReflectedRotor:
    """Motor and gear input, behind the gear; nothing carries their stator about."""
    return ReflectedRotor(drive_inertia(drive), drive.gear.ratio)


def axis_inertia(study: Study, drive: Drive) -> float:
    """What the axis accelerates.

    Returns:
        Load and reflected rotor [kg m^2].
    """
    return float(study.joints[0].load_inertia or 0.0) + drive.gear.ratio**2 * drive_inertia(drive)


def axis_motion(study: Study, repetitions: int) -> tuple[Motion, GivenTorque]:
    """What is commanded, and what the load does beside being accelerated.

    A table tells what the drive must give, T = J a + load; so the link feels J a - T from outside. A cycle that does
    not come back to where it began (a conveyor) goes on from there.
    """
    cycle, task = study.cycle, study.joints[0]
    if cycle.torque is None:
        raise InputError(Fault("cycle", "holds no torques: it is no load table"))
    travel = cycle.position[-1] - cycle.position[0]
    starts = cycle.duration * np.arange(repetitions)
    time = np.concatenate([start + cycle.time for start in starts])
    position = np.concatenate([cycle.position + k * travel for k in range(repetitions)])
    velocity, acceleration = (np.tile(values, (repetitions, 1)) for values in (cycle.velocity, cycle.acceleration))
    load = (task.load_inertia or 0.0) * cycle.acceleration[:, 0] - cycle.torque[:, 0]
    motion = Motion(study.name, cycle.joint_names, time, position, velocity, acceleration, cycle.notes)
    return motion, GivenTorque(time, np.tile(load, repetitions))
