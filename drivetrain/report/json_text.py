"""JSON that every reader takes: numbers that are none are null."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from drivetrain.study.model import Study
from drivetrain.version import __version__

SCHEMA_VERSION = 1  # rises when a key is taken away or changes its meaning; new keys may come without


def json_text(data: Mapping[str, Any], *, packed: bool = False) -> str:
    """Plain data as JSON text, NaN and infinity as null; packed: in one line, for a script to read."""
    if packed:
        try:  # what is plain already needs no walk through every number
            return json.dumps(data, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
        except (TypeError, ValueError):
            return json.dumps(plain(data), ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    return json.dumps(plain(data), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def job_data(study: Study, job: str, **data: Any) -> dict[str, Any]:
    """What a job found, headed by what it is the answer to."""
    head = {"schema_version": SCHEMA_VERSION, "drivetrain": __version__, "study": study.name}
    return head | {"digest": study.digest, "job": job} | data


def drives_data(drives: Mapping[str, tuple[str, str]]) -> dict[str, dict[str, str]]:
    return {joint: {"motor": motor, "gear": gear} for joint, (motor, gear) in drives.items()}


def plain(value: Any) -> Any:
    """A value that strict JSON can hold: None for what is no finite number, Python's numbers for numpy's."""
    if isinstance(value, Mapping):
        return {str(name): plain(one) for name, one in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [plain(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
