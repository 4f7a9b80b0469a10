"""A study from its file: form, arm, catalogue, motions, joints; every fault of all of them at once."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from pydantic import PydanticSchemaGenerationError

from drivetrain.arm.files.load import packaged_file
from drivetrain.arm.files.xml import PACKAGE
from drivetrain.errors import Fault, InputError, nearest
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.study.document import Document, parsed_document, read_document
from drivetrain.study.faults import Ledger, read_form
from drivetrain.study.form import form_of, given, made, over
from drivetrain.study.model import DriveMass, Payload, Prices, Study
from drivetrain.study.parts.arm import resolve_arm, resolve_closures, resolve_coupling, resolve_payloads
from drivetrain.study.parts.forces import named_forces, resolve_forces
from drivetrain.study.parts.joints import Surroundings, check_gas_springs, resolve_joints
from drivetrain.study.parts.motions import resolve_base, resolve_cycle, resolve_motions
from drivetrain.study.parts.mounting import with_counterbalances, with_sharing
from drivetrain.study.parts.selection import TERMS, SelectionOptions, TradeOffs
from drivetrain.study.parts.sheets import ASSUMPTIONS, catalog_folders, resolve_assumptions, resolve_catalog
from drivetrain.study.parts.simulation import (
    TWO_INTEGRATORS,
    AddedEffect,
    Control,
    Simulation,
    drive_fields,
    known_effects,
)
from drivetrain.study.plausibility import note_implausible
from drivetrain.study.schema import DEFAULT, SCHEMA_VERSION, StudyForm
from drivetrain.study.written import entry_at, file_places, python_document

LARGEST_GAIN = 2.0  # largest bandwidth times sample period: beyond it a sampled loop is unstable
T = TypeVar("T")


def load_study(source: str | Path | Mapping[str, Any]) -> Study:
    """Read a study with all the files it names, and check it as a whole; the result is in SI.

    Args:
        source: Path of the YAML file (names of other files are relative to its folder); or YAML text of more than one
            line or in braces; or nested mappings, in which bare numbers are in SI.

    Returns:
        The study; warnings are in its ``notes``.

    Raises:
        InputError: Every fault found, with place, line, value, what is allowed and the nearest known name.
    """
    if isinstance(source, Mapping):
        return study_from(python_document({"schema_version": SCHEMA_VERSION, **source}))
    if isinstance(source, str) and ("\n" in source or source.lstrip().startswith("{")):
        return study_from(parsed_document(Path("study text"), source.encode()))
    document = read_document(source)
    if {"study_file", "digest"} <= document.data.keys():
        hint = f"its study is {document.data['study_file']}"
        raise InputError(Fault("the study file", "is a result of drivetrain, no study", str(source), hint))
    return study_from(document)


def study_from(document: Document, notes: Iterable[str] = ()) -> Study:
    """A study from a document; ``notes`` are put before the notes found here."""
    form, faults, places = read_form(StudyForm, document)
    ledger = Ledger(document, faults, places, list(notes))
    arm = resolve_coupling(form, resolve_closures(form, resolve_arm(form, ledger), ledger), ledger)
    payloads = resolve_payloads(form, ledger)
    catalog = resolve_catalog(form, ledger)
    forces = resolve_forces(form, arm, ledger)
    motions = resolve_motions(form, arm, ledger)
    base, cycle = resolve_base(form, arm, resolve_cycle(form, arm, motions, forces, ledger), ledger)
    gear_assumptions, motor_assumptions = resolve_assumptions(form.assumptions, ledger)
    names = arm.joint_names if arm else next((motion.joint_names for motion in motions.values()), ())
    around = Surroundings(form, arm, catalog, ledger)
    joints = resolve_joints(around, names)
    check_gas_springs(joints, cycle, ledger)
    wanted = resolve_wanted(form, names, ledger)
    trade_offs = resolve_trade_offs(form, cycle, payloads, ledger)
    simulation = resolve_simulation(form, names, ledger)
    for task in joints:
        control = simulation.control.get(task.name)
        if task.preload and control is not None and control.integral_time is not None:
            place = task.name if task.name in form.simulation.control else DEFAULT
            ledger.fault(("simulation", "control", place, "integral_time"), TWO_INTEGRATORS, control.integral_time)
    supply = form.supply
    with ledger.gather(("supply",)):
        supply = made(supply)
        if supply.resistor_always_on:
            problem = "must be above the voltage of the source, or the resistor never goes off"
            ledger.fault(("supply", "threshold"), problem, supply.threshold)
    stiffness = made(form.stiffness)
    if stiffness.stated and arm is None:
        ledger.fault(("stiffness",), "applies only to studies of an arm: a load table does not say where a tip is")
    ledger.raise_any()
    if cycle is None:
        raise InputError(document.fault(("cycle",), "cannot be built from these motions"))
    note_implausible(form, arm, payloads, motions, joints, ledger)
    arm = None if arm is None else with_counterbalances(arm, joints)
    arm, cycle, joints = with_sharing(arm, cycle, joints)
    study = Study(
        name=form.name or document.path.stem,
        description=form.description.strip(),
        path=str(document.path),
        digest=study_digest(form, document),
        arm=arm,
        drive_mass=None if form.drive_mass is None else DriveMass(form.drive_mass),
        payloads=tuple(payloads[name] for name in cycle.payload_names),
        forces=tuple(force for name, force in forces.items() if name in named_forces(form)),
        cycle=cycle,
        base=base,
        joints=joints,
        supply=supply,
        ambient=form.ambient,
        safety=made(form.safety),
        holding=form.holding,
        stiffness=stiffness,
        prices=Prices() if form.prices is None else made(form.prices),
        gear_temperature=form.gear_temperature,
        cold_start=form.cold_start,
        gear_assumptions=gear_assumptions,
        motor_assumptions=motor_assumptions,
        catalog=replace(catalog, motors={**catalog.motors, **around.braked}, gears={**catalog.gears, **around.staged}),
        wanted=wanted,
        tolerances=made(form.tolerances),
        simulation=simulation,
        trade_offs=trade_offs,
        notes=tuple(ledger.notes),
    )
    object.__setattr__(study, "document", document)  # not set by __init__, so that a study made by ``replace`` has none
    return study


def resolve_wanted(form: StudyForm, names: Sequence[str], ledger: Ledger) -> SelectionOptions:
    """The objective and the constraints."""
    objective, chosen = form.objective, form.selection
    weights = {objective: 1.0} if isinstance(objective, str) else {name: getattr(objective, name) for name in TERMS}
    for index, group in enumerate(chosen.same_family if names else ()):
        for name in group:
            ledger.known(("selection", "same_family", index), "is no joint", name, names)
    options: SelectionOptions = made(chosen)
    return replace(options, weights=tuple((name, weight) for name, weight in weights.items() if weight > 0.0))


def resolve_trade_offs(
    form: StudyForm, cycle: Cycle | None, payloads: Mapping[str, Payload], ledger: Ledger
) -> TradeOffs:
    """What the report shows besides the best set; ``cycle`` is None if it could not be built because of faults."""
    curves = form.selection.curves
    carried = () if cycle is None else cycle.payload_names
    # A payload that the cycle names but ``payloads`` lacks has faults, which are reported elsewhere.
    weighs = [name not in payloads or payloads[name].mass > 0.0 for name in carried]
    heavy = cycle is None or (form.arm is not None and any(weighs))
    for index, curve in enumerate(curves):
        place = ("selection", "curves", index)
        if curve.vary == "payload" and not heavy:
            ledger.fault(place, "the study carries no payload of any mass that could be varied", curve.vary)
        if curve.vary == "cycle_time" and form.base is not None:
            ledger.fault(place, "cannot be combined with a base that moves by its own clock", curve.vary)
        if curve.vary in [other.vary for other in curves[:index]]:
            ledger.fault(place, "is given twice", curve.vary)
    return TradeOffs(tuple(dict.fromkeys(form.selection.front)), curves)


def resolve_simulation(form: StudyForm, joints: Sequence[str], ledger: Ledger) -> Simulation:
    """The simulation options of a study, with the control and the cogging of each joint."""
    stated = form.simulation
    control = _named(stated.control, joints, "control", ledger)
    cogging = _named(stated.cogging, joints, "cogging", ledger)
    for name in stated.control:
        _check_rates(name, stated.control, stated.current_bandwidth, ledger)
    for name, one in cogging.items():
        if (one.amplitude and not one.periods) or not given(one, "amplitude"):
            place = name if name in stated.cogging else DEFAULT
            ledger.fault(("simulation", "cogging", place), "needs an amplitude, and periods a turn", None,
                         "such as {amplitude: 5 mN m, periods: 84}")  # fmt: skip
    return replace(
        made(stated),
        control={name: made(one) for name, one in control.items() if one.sampled},
        cogging={name: made(one) for name, one in cogging.items() if one.amplitude},
        add=_added(stated.add, joints, ledger),
    )


def _named(entries: Mapping[str, T], joints: Sequence[str], what: str, ledger: Ledger) -> dict[str, T]:
    known = [*joints, DEFAULT]
    for name in entries if joints else ():
        ledger.known(("simulation", what, name), "names a joint that is not there", name, known)
    base, found = entries.get(DEFAULT), dict[str, T]()
    for name in joints:
        own = entries.get(name, base)
        if own is not None:
            found[name] = own if base is None else over(own, base)
    return found


def _check_rates(name: str, entries: Mapping[str, Control], bandwidth: float, ledger: Ledger) -> None:
    """Check that the amplifier's rate is at least that of the outer loops and high enough for a stable current loop."""
    own = over(entries[name], entries.get(DEFAULT, entries[name]))
    rate, place = own.amplifier_rate, ("simulation", "control", name)
    if rate is None or not own.sampled:
        return
    if rate < own.rate:
        ledger.fault((*place, "amplifier_rate"), f"must be at least the rate of the outer loops: {own.rate:g} Hz", rate)
    elif not bandwidth / rate < LARGEST_GAIN:
        problem = f"must be above {bandwidth / LARGEST_GAIN:.4g} Hz for a current loop of {bandwidth:.4g} rad/s"
        ledger.fault((*place, "amplifier_rate"), problem, rate, "or a smaller current_bandwidth")


def _added(entries: Sequence[Any], joints: Sequence[str], ledger: Ledger) -> tuple[AddedEffect, ...]:
    """The effects that a study adds, from mappings of their names and fields; those with faults are left out."""
    found = []
    for i, entry in enumerate(entries):
        place, known = ("simulation", "add", i), known_effects()
        name, joint = str(entry.get("effect")), entry.get("joint")
        if name not in known:
            ledger.fault((*place, "effect"), "is no effect", entry.get("effect"), nearest(name, known))
            continue
        kind = known[name]
        if kind.scope == "scene" and joint is not None:
            ledger.fault((*place, "joint"), f"cannot be combined with {name}, which concerns the whole scene", joint)
        elif kind.scope != "scene" and joints and joint not in joints:
            ledger.fault((*place, "joint"), "names a joint that is not there", joint, nearest(str(joint), joints))
        try:
            form = form_of(kind, without=tuple(drive_fields(kind)))
        except PydanticSchemaGenerationError:
            ledger.fault((*place, "effect"), "has fields that a study file cannot state, such as a whole motion", name)
            continue
        fields = {key: value for key, value in entry.items() if key not in ("effect", "joint")}
        stated = ledger.read(form, fields, place)
        if stated is not None:
            added = AddedEffect(joint or "", kind, {key: made(getattr(stated, key)) for key in stated.model_fields_set})
            found.append(added)
            if not drive_fields(kind):
                ledger.attempt(place, added.built)
    return tuple(found)


def study_digest(form: StudyForm, document: Document) -> str:
    """SHA-256 over the study file and the files it names, their paths left out."""
    places = [place for place in file_places(document.data) if place[0] != "catalogs"]
    files = [document.folder / entry_at(document.data, place) for place in places]
    source = "" if form.arm is None else form.arm.source or ""
    files += [packaged_file(source)] if source.startswith(PACKAGE) else []
    for folder in catalog_folders(form, document.folder):
        files += sorted(folder.glob("*.csv")) if folder.is_dir() else [folder]
    digest = hashlib.sha256()
    contents = (file.read_bytes() for file in files if file.is_file())
    for content in (document.content, ASSUMPTIONS.read_bytes(), *contents):
        digest.update(len(content).to_bytes(8, "big"))  # separates the files in the digest
        digest.update(content)
    return digest.hexdigest()
