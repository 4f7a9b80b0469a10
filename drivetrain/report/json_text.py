"""JSON that every reader takes: numbers that are none are null."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np


def json_text(data: Mapping[str, Any], *, packed: bool = False) -> str:
    """Plain data as JSON text.

    Args:
        data: Texts, numbers, truths, None, and lists and dictionaries of them; NaN and infinity become null.
        packed: In one line, for a script to read.
    """
    if packed:
        try:  # what is plain already needs no walk through every number
            return json.dumps(data, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
        except (TypeError, ValueError):
            return json.dumps(plain(data), ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    return json.dumps(plain(data), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def plain(value: Any) -> Any:
    """A value that strict JSON can hold.

    Returns:
        The same with None for what is no finite number, and Python's numbers for numpy's.
    """
    if isinstance(value, Mapping):
        return {str(name): plain(one) for name, one in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [plain(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
