"""A study in one call, from Python's objects: the entries of a study file, its model, its messages."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from drivetrain.study.model import Study


def study(
    arm: Any = None,
    motion: Any = None,
    *,
    motors: Any = None,
    gears: Any = None,
    drives: Any = None,
    supply: Any = None,
    joints: Mapping[str, Any] | None = None,
    **entries: Any,
) -> Study:
    """A study from Python objects, without a file.

    Every entry of a study file is an argument of the same name, with the same values: numbers with units as texts
    ("48 V"), or bare numbers in SI (temperatures in degrees Celsius). The arguments listed here take more.

    Args:
        arm: Name of a built-in arm, path of a file, or an ``Arm``; None: the motion is a load table.
        motion: ``(t, q)`` or ``(t, q, qd, qdd)`` with t [s], (N,), and the others [rad or m], (N, n); a ``Motion``, a
            ``LoadTable``, a DataFrame with the columns of a motion file, or the path of one. A list of these is the
            cycle; it may also contain ``{"dwell": "0.5 s"}`` and ``{"motion": (t, q), "payload": "box"}``. If the
            study has one payload or one force, motions of the list that state none have it. The entry ``motions``
            takes these objects by name, for a ``cycle`` as in a study file.
        motors, gears: Data sheets by key, as in a study file; ``Motor`` and ``Gear`` objects; or a DataFrame or a CSV
            file with the columns of a catalogue. Without ``catalogs`` they are the only ones considered.
        drives: ``(motor key, gear key)`` for all joints, or such pairs by joint name or in a list in the arm's order;
            gear None: direct drive; ``Motor`` and ``Gear`` objects may be given instead of keys. If omitted, all pairs
            may be chosen; pairs of own parts need not be published as fitting.
        supply: As in a study file, or its voltage alone.
        joints: As in a study file.
        entries: All other entries of a study file. If ``drive_mass`` is omitted, "added" is assumed (bare links, the
            heavier case). Rotors of an ``Arm`` are left out. Both give a warning in ``notes``.

    Returns:
        The study, for ``evaluate``, ``select``, ``simulate``; ``to_yaml`` writes it as a file.

    Raises:
        InputError: Every fault found, with place, value, what is allowed and the nearest known name.

    Example:
        ``study(arm="planar-2r", motion=(t, q), motors={"MY": sheet}, gears={"G": sheet}, drives=("MY", "G"),
        supply="48 V")``
    """
    from drivetrain.study import given
    from drivetrain.study.read import study_from
    from drivetrain.study.schema import SCHEMA_VERSION
    from drivetrain.study.written import python_document

    data = dict(entries)
    notes = given.add_arm(data, arm)
    given.add_rows(data, "motors", motors)
    given.add_rows(data, "gears", gears)
    given.add_rows(data, "brakes", data.pop("brakes", None))
    given.add_joints(data, joints, drives, own=motors is not None or gears is not None)
    given.add_motion(data, motion)
    if supply is not None:
        data["supply"] = supply if isinstance(supply, Mapping) or hasattr(supply, "voltage") else {"voltage": supply}
    return study_from(python_document({"schema_version": SCHEMA_VERSION, **data}), notes)
