"""An arm with closed loops in pinocchio's constrained dynamics, as several rooms try it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin

from drivetrain.arm.arm import Arm


def constrained(arm: Arm) -> Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]:
    """Accelerations of all joints from their positions and speeds and the torques of the driven ones; rotors left out.

    A tree of bodies, pins as contacts of two points.
    """
    loops, chains = arm.linkage.loops, arm.linkage.chains
    model, ids, origin = pin.Model(), {-1: 0}, {-1: np.zeros(3)}
    model.gravity.linear = arm.gravity
    for body, owner in enumerate(loops.owner):
        chain, at, before = chains[owner], loops.paths[owner].index(body), loops.before(body)
        here, home, axis = chain.joint_points[at], chain.home[at], chain.axes[at]
        kind = (pin.JointModelPrismaticUnaligned if chain.slides[at] else pin.JointModelRevoluteUnaligned)(axis)
        ids[body] = model.addJoint(ids[before], kind, pin.SE3(np.eye(3), here - origin[before]), f"j{body}")
        tensor = home[:3, :3] @ chain.inertias[at] @ home[:3, :3].T
        model.appendBodyToJoint(
            ids[body], pin.Inertia(chain.masses[at], home[:3, 3] - here, tensor), pin.SE3.Identity()
        )
        origin[body] = here
    models, datas = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
    for first, second, point in loops.pins:
        ends = [loops.paths[chain][count - 1] if count else -1 for chain, count in (first, second)]
        held = [part for end in ends for part in (ids[end], pin.SE3(np.eye(3), point - origin[end]))]
        models.append(pin.RigidConstraintModel(pin.ContactType.CONTACT_3D, model, *held, pin.ReferenceFrame.LOCAL))
        datas.append(models[-1].createData())
    data, settings = model.createData(), pin.ProximalSettings(1e-12, 1e-12, 100)
    # Since version 4 it wants the data, too.
    pin.initConstraintDynamics(
        model, data, *((models, datas) if int(pin.__version__.split(".")[0]) >= 4 else (models,))
    )
    rows = [ids[body] - 1 for body in range(len(loops.owner))]

    def moved(position: np.ndarray, velocity: np.ndarray, torque: np.ndarray) -> np.ndarray:
        place, speed, tau = np.zeros((3, model.nv))
        place[rows], speed[rows] = position, velocity
        tau[[rows[joint] for joint in loops.driven]] = torque
        return np.asarray(pin.constraintDynamics(model, data, place, speed, tau, models, datas, settings)[rows])

    return moved
