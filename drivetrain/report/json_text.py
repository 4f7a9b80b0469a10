"""Standard JSON text, in which NaN and infinity are null."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from drivetrain.study.model import Study
from drivetrain.version import __version__

SCHEMA_VERSION = 1  # increased if a key is removed or changes its meaning, not for new keys


def json_text(data: Mapping[str, Any], *, packed: bool = False) -> str:
    """Plain data as JSON text, NaN and infinity as null; packed: in one line, for a script to read."""
    if packed:
        try:  # fast path: plain data need no conversion of every number
            return json.dumps(data, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
        except (TypeError, ValueError):
            return json.dumps(plain(data), ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    return json.dumps(plain(data), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def job_data(study: Study, job: str, **data: Any) -> dict[str, Any]:
    """The results of a job after a header with versions, study and job."""
    head = {"schema_version": SCHEMA_VERSION, "drivetrain": __version__, "study": study.name}
    return head | {"digest": study.digest, "job": job} | data


def picked(record: Any, *names: str) -> dict[str, Any]:
    """Some attributes of a record by name."""
    return {name: getattr(record, name) for name in names}


def drives_data(drives: Mapping[str, tuple[str, str]]) -> dict[str, dict[str, str]]:
    return {joint: {"motor": motor, "gear": gear} for joint, (motor, gear) in drives.items()}


def plain(value: Any) -> Any:
    """A value that strict JSON can represent: None for NaN and infinity, Python numbers for numpy numbers."""
    if isinstance(value, Mapping):
        return {str(name): plain(one) for name, one in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [plain(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
