"""Puts this folder's helpers, and the oracles of the agreement tests, where its tests can import them."""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
for folder in (HERE, HERE.parent / "agreement"):
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))
