"""A study from its file: form, arm, catalogue, motions, joints; every fault of all of them at once."""

from __future__ import annotations

from pathlib import Path

from drivetrain.drive.amplifier import Supply
from drivetrain.errors import InputError
from drivetrain.study.assumptions import resolve_assumptions
from drivetrain.study.digest import study_digest
from drivetrain.study.document import Document, read_document
from drivetrain.study.ledger import Ledger
from drivetrain.study.resolve_arm import arm_files, resolve_arm, resolve_payloads
from drivetrain.study.resolve_coupling import resolve_coupling
from drivetrain.study.resolve_cycle import motion_files, resolve_cycle, resolve_motions
from drivetrain.study.resolve_joints import Surroundings, resolve_joints
from drivetrain.study.resolve_simulation import resolve_simulation
from drivetrain.study.resolve_wanted import resolve_trade_offs, resolve_wanted
from drivetrain.study.rows import catalog_folders, resolve_catalog
from drivetrain.study.schema import StudyForm
from drivetrain.study.schema_tolerances import TolerancesForm
from drivetrain.study.study import DriveMass, Safety, Study
from drivetrain.study.tolerances import Tolerances
from drivetrain.study.validate import read_form


def load_study(path: str | Path) -> Study:
    """A study, read with all the files it names, checked as a whole, in SI.

    Args:
        path: The YAML file; names of other files in it start from its folder.

    Returns:
        The study; doubts are in its notes.

    Raises:
        InputError: Every fault found, with place, line, value, what is allowed and the nearest known name.
    """
    return study_from(read_document(path))


def study_from(document: Document) -> Study:
    """A study from its file as read, or as changed since.

    Raises:
        InputError: As ``load_study``.
    """
    form, faults, places = read_form(document)
    ledger = Ledger(document, faults, places)
    arm = resolve_coupling(form, resolve_arm(form, ledger), ledger)
    payloads = resolve_payloads(form, ledger)
    catalog = resolve_catalog(form, ledger)
    motions = resolve_motions(form, arm, ledger)
    cycle = resolve_cycle(form, motions, ledger)
    gear_assumptions, motor_assumptions = resolve_assumptions(form.assumptions, ledger)
    names = arm.joint_names if arm else next((motion.joint_names for motion in motions.values()), ())
    joints = resolve_joints(Surroundings(form, arm, catalog, ledger), names)
    wanted = resolve_wanted(form, names, ledger)
    trade_offs = resolve_trade_offs(form, cycle, payloads, ledger)
    simulation = resolve_simulation(form, names, ledger)
    ledger.raise_any()
    if cycle is None:
        raise InputError(document.fault(("cycle",), "cannot be built from these motions"))
    return Study(
        name=form.name or document.path.stem,
        description=form.description.strip(),
        path=str(document.path),
        digest=study_digest(document, named_files(form, document)),
        arm=arm,
        drive_mass=None if form.drive_mass is None else DriveMass(form.drive_mass),
        payloads=tuple(payloads[name] for name in cycle.payload_names),
        cycle=cycle,
        joints=joints,
        supply=Supply(**form.supply.model_dump()),
        ambient=form.ambient,
        safety=Safety(**form.safety.model_dump()),
        gear_assumptions=gear_assumptions,
        motor_assumptions=motor_assumptions,
        catalog=catalog,
        wanted=wanted,
        tolerances=_tolerances(form),
        simulation=simulation,
        trade_offs=trade_offs,
        notes=tuple(ledger.notes),
    )


def _tolerances(form: StudyForm) -> Tolerances:
    """What scatters."""
    return Tolerances(**{name: getattr(form.tolerances, name) for name in TolerancesForm.model_fields})


def named_files(form: StudyForm, document: Document) -> list[Path]:
    """The files and folders a study names."""
    folder = document.folder
    return [*arm_files(form, folder), *motion_files(form, folder), *catalog_folders(form, folder)]
