"""What benches of all sets of drives of a study share: the work of its joints, and what its payloads ask alone."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drivetrain.arrays import Array
from drivetrain.sizing.demand.demand import Workload, workload
from drivetrain.sizing.demand.load_basis import load_basis
from drivetrain.study.change import TaskChange, changed
from drivetrain.study.model import Study


@dataclass(frozen=True, eq=False)
class Added:
    """What the whole of each payload asks.

    Attributes:
        force: Of each gear [N m], (n, P, N).
        wrench: Of each output bearing: two of the tilting moment, axial, two radial, (n, 5, P, N).
        inertia: Of what each gear accelerates [kg m^2], (n, P, N).
    """

    force: Array
    wrench: Array
    inertia: Array


@dataclass(frozen=True, eq=False)
class Ground:
    """What benches of all sets of drives of a study share.

    Attributes:
        study: The task.
        work: Of all joints.
        added: What the whole of each payload asks.
    """

    study: Study
    work: Workload
    added: Added


def ground(study: Study, work: Workload | None = None) -> Ground:
    """What benches of all sets of drives of a study share."""
    own = workload(study) if work is None else replace(work, study=study)
    return Ground(study, own, _payload_rows(study, own))


def _payload_rows(study: Study, work: Workload) -> Added:
    n, bodies, samples = len(study.joints), len(study.payloads), len(study.cycle.time)
    found = Added(np.zeros((n, bodies, samples)), np.zeros((n, 5, bodies, samples)), np.zeros((n, bodies, samples)))
    if not loads_scatter(study):
        return found
    for p, body in enumerate(study.payloads):
        if body.mass <= 0.0:
            continue
        without = load_basis(changed(study, TaskChange(payload=0.0, payloads=(body.name,))))
        for joint, (full, empty) in enumerate(zip(work.basis, without, strict=True)):
            travel = study.joints[joint].travel_per_turn or 1.0
            found.force[joint, p] = travel * (full.bare.force - empty.bare.force)
            found.wrench[joint, :, p] = bearing_rows(full.bare.wrench - empty.bare.wrench)
            found.inertia[joint, p] = travel**2 * (full.bare.inertia - empty.bare.inertia)
    return found


def bearing_rows(wrench: Array | None) -> Array:
    """The components of a wrench that limits of bearings ask for.

    Args:
        wrench: Moment [N m] and force [N] in the joint frame, (N, 6); None where nothing is judged.

    Returns:
        Tilting moment's two, axial force, radial force's two, (5, N); (5, 1) zeros where nothing is judged.
    """
    return np.zeros((5, 1)) if wrench is None else np.ascontiguousarray(wrench[:, [0, 1, 5, 3, 4]].T)


def loads_scatter(study: Study) -> bool:
    """Whether bearings and inertias are loaded otherwise in every arm."""
    return study.arm is not None and "payload" in study.tolerances.given and bool(study.payloads)
