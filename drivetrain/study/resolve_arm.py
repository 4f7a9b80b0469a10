"""The arm of a study, and the bodies its tip carries."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.builtin import builtin_names
from drivetrain.arm.load import SUFFIXES, load_arm
from drivetrain.arrays import Array, frozen_array
from drivetrain.errors import nearest
from drivetrain.study.dh_table import read_dh_table
from drivetrain.study.ledger import Ledger
from drivetrain.study.schema import InertiaForm, PayloadForm, StudyForm
from drivetrain.study.study import Payload

DRIVE_MASS_HINT = (
    "added: the arm's links are bare and the drives' masses come on top; included: the links (of a finished robot) "
    "already hold them; replaced: the links hold drives that `contained` states, which are taken out first"
)


def arm_files(form: StudyForm, folder: Path) -> list[Path]:
    """The files an arm is read from."""
    if form.arm is None:
        return []
    name = form.arm.dh or form.arm.source or ""
    return [] if name in builtin_names() else [folder / name]


def resolve_arm(form: StudyForm, ledger: Ledger) -> Arm | None:
    """The arm of a study.

    Returns:
        The arm; None without one, or when it cannot be read.
    """
    if form.arm is None:
        _refuse_without_arm(form, ledger)
        return None
    if form.drive_mass is None:
        ledger.fault(("drive_mass",), "is missing: added, included or replaced", hint=DRIVE_MASS_HINT)
    arm: Arm | None = None
    if form.arm.dh is not None:
        if form.tip is not None:
            ledger.fault(("tip",), "goes with a URDF file: a DH table has no named links", form.tip)
        with ledger.gather(("arm", "dh")):
            path = ledger.document.folder / form.arm.dh
            arm = read_dh_table(path, form.arm.convention or "", gravity=form.gravity)
    else:
        arm = _load(form, ledger)
    if arm is not None:
        ledger.note(f"Arm {arm.name}: {note}" for note in arm.notes)
    return arm


def resolve_payloads(form: StudyForm, ledger: Ledger) -> dict[str, Payload]:
    """The bodies the tip may carry."""
    payloads = {}
    for name, body in form.payloads.items():
        if body.inertia is None:
            ledger.note([f"Payload {name} is a point mass: no inertia is given."])
        else:
            _doubt_inertia(name, body.inertia, ledger)
        payloads[name] = Payload(name, body.mass, frozen_array(body.com, (3,), f"{name}.com"), _tensor(body))
    return payloads


def _load(form: StudyForm, ledger: Ledger) -> Arm | None:
    """A built-in arm, or one from a URDF or xacro file."""
    source = form.arm.source if form.arm is not None and form.arm.source is not None else ""
    named_file = Path(source).suffix.lower() in SUFFIXES
    if source not in builtin_names() and not named_file:
        problem = "is neither a built-in arm nor a .urdf or .xacro file"
        ledger.fault(("arm",), problem, source, nearest(source, builtin_names()))
        return None
    path = ledger.document.folder / source
    if named_file and not path.is_file():
        ledger.fault(("arm",), "no such file", source, f"looked for {path}")
        return None
    with ledger.gather(("arm",)):
        return load_arm(path if named_file else source, tip=form.tip, gravity=form.gravity)
    return None


def _refuse_without_arm(form: StudyForm, ledger: Ledger) -> None:
    """What only an arm gives a meaning to."""
    for name in ("tip", "gravity", "drive_mass"):
        if getattr(form, name) is not None:
            ledger.fault((name,), "goes with an arm, but the study has none", getattr(form, name))
    if form.payloads:
        ledger.fault(("payloads",), "go with an arm: load tables already hold the load")


def _tensor(body: PayloadForm) -> Array:
    i = body.inertia
    if i is None:
        return frozen_array(np.zeros((3, 3)), (3, 3), "inertia")
    return frozen_array([[i.xx, i.xy, i.xz], [i.xy, i.yy, i.yz], [i.xz, i.yz, i.zz]], (3, 3), "inertia")


def _doubt_inertia(name: str, form: InertiaForm, ledger: Ledger) -> None:
    """A note when no body has such principal moments."""
    tensor = [[form.xx, form.xy, form.xz], [form.xy, form.yy, form.yz], [form.xz, form.yz, form.zz]]
    small, middle, large = np.linalg.eigvalsh(np.array(tensor))
    if small < 0.0 or large > (small + middle) * (1.0 + 1e-9):
        ledger.note([f"Payload {name}: no body has principal moments {small:.3g}, {middle:.3g}, {large:.3g} kg m^2."])
