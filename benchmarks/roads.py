"""Which modules of the package the three main jobs enter: the roads of the README's architecture, measured.

    python benchmarks/roads.py

A module counts when one of its Python functions is called after the study is loaded; compiled laws are entered by
their kernel and do not count.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType
from typing import Any

import drivetrain as dt

ROOT = Path(dt.__file__).resolve().parent
STUDY = ROOT.parent / "examples" / "ur5_pick_and_place" / "study.yaml"


def entered(job: Callable[[], Any]) -> list[str]:
    """The modules of the package whose functions a job calls."""
    found: set[str] = set()

    def look(frame: FrameType, event: str, _: Any) -> None:
        if event == "call" and frame.f_code.co_name != "<module>":
            path = Path(frame.f_code.co_filename)
            if ROOT in path.parents:
                found.add(".".join(path.relative_to(ROOT).with_suffix("").parts))

    sys.setprofile(look)
    try:
        job()
    finally:
        sys.setprofile(None)
    return sorted(found - {"__init__"})


def main() -> None:
    chosen = dt.select(dt.load_study(STUDY))
    roads = {
        "does it fit (evaluate)": lambda study: dt.evaluate(study, chosen.drives),
        "which one (select)": dt.select,
        "what happens (simulate)": lambda study: dt.simulate(dt.evaluate(study, chosen.drives), duration=0.1),
    }
    for name, job in roads.items():
        job(dt.load_study(STUDY))  # once before, so that nothing that is only made once counts
        study = dt.load_study(STUDY)  # another one, whose motion is not prepared yet
        modules = entered(lambda job=job, study=study: job(study))  # type: ignore[misc]
        print(f"{name}: {len(modules)} modules\n  " + ", ".join(modules))


if __name__ == "__main__":
    main()
