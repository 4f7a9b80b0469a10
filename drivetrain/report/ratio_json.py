"""Ratio studies for machines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from drivetrain.drive.matching import RatioRange
from drivetrain.report.json_text import json_text
from drivetrain.sizing.answers.ratio import RatioPoint, RatioStudy
from drivetrain.version import __version__

SCHEMA_VERSION = 1  # rises when a key is taken away or changes its meaning; new keys may come without


def ratio_json(studies: Sequence[RatioStudy]) -> str:
    """The ratio studies of one task as JSON text.

    Returns:
        JSON with a ``schema_version``; numbers in SI, temperatures in degrees Celsius, null where a number is unknown
        or not finite; the same studies give the same bytes.
    """
    data = {
        "schema_version": SCHEMA_VERSION,
        "drivetrain": __version__,
        "study": studies[0].study.name if studies else "",
        "digest": studies[0].study.digest if studies else "",
        "job": "ratio",
        "feasible": all(found.feasible for found in studies),
        "joints": {found.joint: _joint(found) for found in studies},
    }
    return json_text(data)


def _range(span: RatioRange | None) -> list[float | None] | None:
    return None if span is None else [span.low, span.high]


def _joint(found: RatioStudy) -> dict[str, Any]:
    forms, match, limits = found.closed_forms, found.closed_forms.load_match, found.limits
    return {
        "drive": {"motor": found.motor, "gear": found.gear, "ratio": found.drive.gear.ratio},
        "windows": [
            {
                "low": window.low, "high": window.high,
                "low_binding": window.low_binding, "high_binding": window.high_binding,
            }
            for window in found.windows
        ],
        "best": _point(found.best),
        "matched_inertia": forms.matching,
        "least_rms_torque": forms.least_rms,
        "least_peak_torque": forms.least_peak,
        "rated_ranges": None if forms.rated is None else [_range(span) for span in forms.rated],
        "load_match": None if match is None else {
            "accelerating_factor": match.accelerating_factor,
            "load_factor": match.load_factor,
            "range": _range(match.range),
            "best": match.best,
        },
        "limits": {name: getattr(limits, name) for name in vars(limits)},
        "gears": [
            {
                "gear": gear.key, "ratio": gear.ratio, "utilisation": gear.utilisation,
                "binding": gear.binding, "verdict": str(gear.verdict), "inside": gear.inside,
            }
            for gear in found.gears
        ],
        "reaction": {name: share for name, share in found.reaction.items()},
        "not_checked": [check.name for check in found.lacking],
        "notes": list(found.notes),
        "points": [_point(point) for point in found.points],
    }  # fmt: skip


def _point(point: RatioPoint) -> dict[str, Any]:
    return {
        "ratio": point.ratio,
        "rms_torque": point.rms_torque,
        "peak_torque": point.peak_torque,
        "motor_speed": point.motor_speed,
        "winding_temperature": point.winding_temperature,
        "utilisation": point.utilisation,
        "binding": point.binding,
    }
