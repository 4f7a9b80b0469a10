"""What leaving effects out is estimated to change, beside what finer runs measure: shipped studies and random scenes.

    python benchmarks/estimates.py [--seeds 100]

Prints tables for ``docs/validation.md``: of each study the quantity that each kind of effect changes most, and how far
estimates lie from measurements, both counted as at least 0.2 %
(of the tip 1 mm or 1 mrad). Random scenes whose loop does not follow its command are left out.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import drivetrain as dt
from drivetrain.accuracy.decision import basis_of
from drivetrain.accuracy.scenes import LABELS, full_scene
from drivetrain.sizing.results import every_drive

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "accuracy"))

from random_scenes import Row, estimated_and_measured, follows, pair, ratio, single  # noqa: E402

STUDIES = ("one_axis", "puma560", "desktop_arm", "ur5_pick_and_place", "mix")
SHIPPED_STEP = 1e-4  # s, where estimates take a quarter of a millisecond


def shipped(name: str) -> list[Row]:
    """A shipped study with the drives that it gives or that ``select`` chooses."""
    study = dt.load_study(ROOT / "examples" / name / "study.yaml")
    found = dt.evaluate(study) if study.gives_all_drives else every_drive(dt.select(study))
    full = full_scene(found, study.simulation)
    return estimated_and_measured(full, basis_of(full, found), SHIPPED_STEP)


def largest(rows: list[Row]) -> dict[str, Row]:
    """Of each kind of effect the row with the largest measured change."""
    found: dict[str, Row] = {}
    for row in rows:
        kind = row[0].choice.kind
        if row[2] != "tip" and (kind not in found or row[4] > found[kind][4]):
            found[kind] = row
    return found


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=100)
    seeds = parser.parse_args().seeds
    print("| study | omitted effect | joint | quantity | estimated | measured |\n|---|---|---|---|---|---|")
    spans = []
    for name in STUDIES:
        rows = shipped(name)
        spans.append((name, rows))
        for kind, (_, joint, what, guess, found) in largest(rows).items():
            print(
                f"| {name} | {LABELS[kind]} | {joint} | {what} | {100 * guess:.3g} % | {100 * found:.3g} % |",
                flush=True,
            )
    scenes = [single(seed) if seed % 3 else pair(seed) for seed in range(seeds)]
    scenes = [scene for scene in scenes if follows(scene)]
    spans.append(
        (f"{len(scenes)} random scenes", [row for one in scenes for row in estimated_and_measured(one, basis_of(one))])
    )
    print("\n| | quantities | estimate / measurement: least | largest |\n|---|---|---|---|")
    for name, rows in spans:
        ratios = [ratio(row) for row in rows]
        print(f"| {name} | {len(ratios)} | {min(ratios):.3f} | {max(ratios):.3f} |")


if __name__ == "__main__":
    main()
