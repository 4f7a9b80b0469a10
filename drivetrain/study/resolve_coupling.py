"""The couplings of a study: several motors that drive several joints together, put on the arm as one matrix."""

from __future__ import annotations

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.coupling import belts_over, coupled_groups, differential, placed, with_coupling
from drivetrain.arrays import Array
from drivetrain.errors import nearest
from drivetrain.study.document import Place
from drivetrain.study.ledger import Ledger
from drivetrain.study.schema import StudyForm
from drivetrain.study.schema_coupling import CouplingForm


def resolve_coupling(form: StudyForm, arm: Arm | None, ledger: Ledger) -> Arm | None:
    """The arm with its motors coupled to its joints as the study says.

    Args:
        arm: None without one, or when it cannot be read.
    """
    if arm is None:
        if form.coupling and form.arm is None:
            ledger.fault(("coupling",), "goes with an arm: load tables already hold what each gear must give")
        return None
    if form.coupling:
        with ledger.gather(("coupling",)):
            arm = with_coupling(arm, _matrix(form.coupling, arm, ledger))
    ledger.note(
        f"Joints {', '.join(arm.joint_names[i] for i in group)} are coupled: position, speed, torque and friction of "
        "their drives are those of the shafts behind the gears."
        for group in coupled_groups(arm)
    )
    return arm


def _matrix(entries: list[CouplingForm], arm: Arm, ledger: Ledger) -> Array:
    """The coupling of the whole arm; entries at fault are left out."""
    matrix, taken = np.eye(arm.n), set[str]()
    for i, entry in enumerate(entries):
        place: Place = ("coupling", i)
        joints = _joints(entry, arm, taken, ledger, (*place, "joints"))
        part = None if joints is None else _part(entry, ledger, place)
        if joints is not None and part is not None:
            matrix = matrix @ placed(part, joints, arm.n)
    return matrix


def _joints(entry: CouplingForm, arm: Arm, taken: set[str], ledger: Ledger, place: Place) -> list[int] | None:
    """Indices of the joints of one entry; None after a fault."""
    known = True
    for name in entry.joints:
        if name not in arm.joint_names:
            ledger.fault(place, "names a joint that is not there", name, nearest(name, arm.joint_names))
            known = False
        elif name in taken or entry.joints.count(name) > 1:
            ledger.fault(place, "names a joint twice: one entry must hold all that works together", name)
            known = False
    taken.update(entry.joints)
    return [arm.joint_names.index(name) for name in entry.joints] if known else None


def _part(entry: CouplingForm, ledger: Ledger, place: Place) -> Array | None:
    """The matrix of one entry; None after a fault."""
    size = len(entry.joints)
    if entry.matrix is not None:
        if len(entry.matrix) != size or any(len(row) != size for row in entry.matrix):
            ledger.fault((*place, "matrix"), f"must have {size} rows of {size} numbers, one a joint")
            return None
        return np.array(entry.matrix)
    if entry.type == "differential":
        turns = [1.0, 1.0] if entry.turns is None else entry.turns
        if size != 2 or len(turns) != 2:
            ledger.fault(place, "a differential has two joints, and two turns if any", size)
            return None
        return differential(*turns)
    passes = [1.0] * (size - 1) if entry.passes is None else entry.passes
    if len(passes) != size - 1 or size < 2:
        ledger.fault(
            place, "a belt has two joints or more, and one number in passes for each but the last", len(passes)
        )
        return None
    return belts_over(passes)
