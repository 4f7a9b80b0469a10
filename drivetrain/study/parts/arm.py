"""The arm of a study: built in, from a file or a Denavit-Hartenberg table; its coupled motors; its payloads."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.bodies import on_external_axes
from drivetrain.arm.builtin import builtin_names
from drivetrain.arm.closures import Closure, with_closures
from drivetrain.arm.coupling import belts_over, coupled_groups, differential, placed, with_coupling
from drivetrain.arm.files.dh_table import DH_SUFFIXES, read_dh_table
from drivetrain.arm.files.load import SUFFIXES, load_arm
from drivetrain.arm.files.xml import PACKAGE
from drivetrain.arm.geared import with_rotors
from drivetrain.arrays import Array
from drivetrain.errors import nearest
from drivetrain.study.document import Place
from drivetrain.study.faults import Ledger
from drivetrain.study.model import Payload
from drivetrain.study.schema import CouplingForm, StudyForm
from drivetrain.whole_files import is_there

DRIVE_MASS_HINT = (
    "added: the arm's links are bare and the drives' masses come on top; included: the links (of a finished robot) "
    "already hold them; replaced: the links hold drives that `contained` states, which are taken out first"
)


def resolve_arm(form: StudyForm, ledger: Ledger) -> Arm | None:
    """The arm of a study; None without one, or when it cannot be read."""
    if form.arm is None:
        _refuse_without_arm(form, ledger)
        return None
    if form.drive_mass is None:
        ledger.fault(("drive_mass",), "is missing: added, included or replaced", hint=DRIVE_MASS_HINT)
    if form.arm.dh is not None:
        if form.tip is not None:
            ledger.fault(("tip",), "applies only to a URDF file: a DH table has no named links", form.tip)
        path, convention = ledger.document.folder / form.arm.dh, form.arm.convention or ""
        arm = ledger.attempt(("arm", "dh"), read_dh_table, path, convention, gravity=form.gravity)
    elif form.arm.from_screws is not None:
        arm = _from_screws(form, form.arm.from_screws, ledger)
    else:
        arm = _load(form, ledger)
    if arm is not None and form.external_axes is not None:
        own = form.external_axes
        with ledger.gather(("external_axes",)):
            arm = on_external_axes(arm, [link.made() for link in own.links], own.point, own.rpy)
    if arm is not None:
        fresh = [note for note in arm.notes if note not in ledger.notes]  # its warnings are known already
        ledger.note(note if note.startswith("warning:") else f"Arm {arm.name}: {note}" for note in fresh)
    return arm


def resolve_payloads(form: StudyForm, ledger: Ledger) -> dict[str, Payload]:
    """The payloads of a study by name."""
    payloads = {}
    for name, body in form.payloads.items():
        tensor = np.zeros((3, 3)) if body.inertia is None else body.inertia.made()
        if body.inertia is None:
            ledger.note([f"Payload {name} is a point mass: no inertia is given."])
        small, middle, large = np.linalg.eigvalsh(tensor)
        if small < 0.0 or large > (small + middle) * (1.0 + 1e-9):
            moments = f"{small:.3g}, {middle:.3g}, {large:.3g} kg m^2"
            ledger.warning(("payloads", name, "inertia"), f"no body has principal moments {moments}")
        payloads[name] = body.made(name=name, inertia=tensor)
    return payloads


def _load(form: StudyForm, ledger: Ledger) -> Arm | None:
    source = form.arm.source if form.arm is not None and form.arm.source is not None else ""
    named_file = Path(source).suffix.lower() in SUFFIXES
    if source not in builtin_names() and not named_file:
        problem = "is neither a built-in arm nor a .urdf, .xacro, .xml (MJCF) or .sdf file"
        is_table = Path(source).suffix.lower() in DH_SUFFIXES
        hint = f"a DH table is {{dh: {source}, convention: classic}}, or modified" if is_table else ""
        ledger.fault(("arm",), problem, source, hint or nearest(source, builtin_names()))
        return None
    path = ledger.document.folder / source
    elsewhere = not named_file or source.startswith(PACKAGE)
    if not elsewhere and not is_there(path):
        ledger.fault(("arm",), "no such file", source, f"looked for {path}")
        return None
    return ledger.attempt(("arm",), load_arm, source if elsewhere else path, tip=form.tip, gravity=form.gravity)


def _from_screws(form: StudyForm, values: dict[str, Any], ledger: Ledger) -> Arm | None:
    place: Place = ("arm", "from_screws")
    if form.tip is not None:
        ledger.fault(("tip",), "applies only to a URDF file: here the tip is a frame among the arm's numbers", form.tip)
    known = [name for name in inspect.signature(Arm.from_screws).parameters if name != "check_inertias"]
    for name in values:
        if name not in known:
            ledger.fault((*place, name), "is not known here", hint=nearest(name, known))
    for name in ("home", "screws", "masses", "inertias"):
        if name not in values:
            ledger.fault((*place, name), "is missing")
    if ledger.spoiled(place):
        return None
    stated = {} if form.gravity is None else {"gravity": form.gravity}
    return ledger.attempt(place, Arm.from_screws, **values | stated)


def _refuse_without_arm(form: StudyForm, ledger: Ledger) -> None:
    for name in ("tip", "gravity", "drive_mass", "external_axes"):
        if getattr(form, name) is not None:
            ledger.fault((name,), "applies only to an arm, but the study has none", getattr(form, name))
    if form.payloads:
        ledger.fault(("payloads",), "apply only to an arm: load tables already hold the load")


def resolve_closures(form: StudyForm, arm: Arm | None, ledger: Ledger) -> Arm | None:
    """The arm with the closed loops of the study, in which only driven joints count as joints; None without an arm."""
    if not form.closures and not form.passive:
        return arm
    if form.arm is None:
        ledger.fault(("closures",), "apply only to an arm: load tables already hold what each gear must give")
    if arm is None:
        return None
    own = with_rotors(arm, [None] * arm.n)  # the study's drives have their own rotors
    closed = None
    with ledger.gather(("closures",)):
        closures: list[Closure] = [one.made() for one in form.closures]
        closed = with_closures(own, closures, form.passive)
        names = [*arm.joint_names, *(link.joint for one in closures for link in one.links)]
        follow = ", ".join(name for name in names if name not in closed.joint_names)
        ledger.note([f"Joints {follow} follow in closed loops: their pins are taken without friction and play."])
    return closed


def resolve_coupling(form: StudyForm, arm: Arm | None, ledger: Ledger) -> Arm | None:
    """The arm with the couplings of its motors that the study states; None without an arm."""
    if arm is None:
        if form.coupling and form.arm is None:
            ledger.fault(("coupling",), "applies only to an arm: load tables already hold what each gear must give")
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
    """The coupling matrix of the whole arm; entries with faults are left out."""
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
        if not ledger.known(place, "names a joint that is not there", name, arm.joint_names):
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
        problem = "a belt has two joints or more, and one number in passes for each but the last"
        ledger.fault(place, problem, len(passes))
        return None
    return belts_over(passes)
