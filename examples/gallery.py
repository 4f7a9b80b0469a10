"""Write the reports of all example studies into reports/, and the picture of the README: ``make gallery``."""

from __future__ import annotations

from pathlib import Path

from overview import overview_png

import drivetrain as dt
from drivetrain.report.outputs import write_outputs
from drivetrain.report.pages.trade_off_pages import trade_off_extra
from drivetrain.sizing.answers.spread import spread

ROOT = Path(__file__).resolve().parents[1]
SIZED = ("puma560",)  # its drives are given; the others are chosen


BESIDE = ("tradeoffs",)  # studies beside study.yaml in the same folder


def main() -> None:
    for file in sorted(ROOT.glob("examples/*/*.yaml")):
        if file.stem not in ("study", *BESIDE):
            continue
        folder = file.parent
        study = dt.load_study(file)
        result = dt.evaluate(study) if folder.name in SIZED else dt.select(study)
        evaluation, extra = getattr(result, "evaluation", result), None
        if study.trade_offs:
            extra = trade_off_extra(dt.trade_offs(study), result)
        name = folder.name if file.stem == "study" else f"{folder.name}_{file.stem}"
        written = write_outputs(ROOT / "reports" / name, result, spread=spread(evaluation), extra=extra)
        print(f"{name}: {'fits' if result.feasible else 'does not fit'}, {written['report.html']}")
        if extra is not None:  # what can be had from the study itself in half a minute, and is large
            for bulky in ("currents.csv", "rejected.csv"):
                written[bulky].unlink()
        if name == "ur5_pick_and_place":
            (ROOT / "reports" / "demo.png").write_bytes(overview_png(evaluation))


if __name__ == "__main__":
    main()
