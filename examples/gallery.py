"""Write the reports of all example studies into reports/, and the picture of the README: ``make gallery``."""

from __future__ import annotations

from pathlib import Path

import drivetrain as dt
from drivetrain.report.figures_overview import overview_png
from drivetrain.report.outputs import write_outputs

ROOT = Path(__file__).resolve().parents[1]
SIZED = ("puma560",)  # its drives are given; the others are chosen


def main() -> None:
    for folder in sorted(path.parent for path in ROOT.glob("examples/*/study.yaml")):
        study = dt.load_study(folder / "study.yaml")
        result = dt.evaluate(study) if folder.name in SIZED else dt.select(study)
        written = write_outputs(ROOT / "reports" / folder.name, result)
        print(f"{folder.name}: {'fits' if result.feasible else 'does not fit'}, {written['report.html']}")
        if folder.name == "ur5_pick_and_place":
            (ROOT / "reports" / "demo.png").write_bytes(overview_png(result.evaluation))


if __name__ == "__main__":
    main()
