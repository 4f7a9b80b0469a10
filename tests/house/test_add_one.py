"""The page on adding a check does what it says: its edits, made to a copy of the package, and nothing else."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "add_one.md"
STUDY = """
schema_version: 1
catalogs: [catalog]
motions: {swing: {table: swing.csv}}
supply: {voltage: 48 V}
joints: {axis: {candidates: {pairs: all}}}
tolerances: {samples: 100, efficiency: 5 %}
"""
MOTOR = {
    "kind": "brushed", "current_basis": "dc", "winding_basis": "line_line", "resistance [ohm]": "0.5",
    "torque_constant [N m/A]": "0.05", "rotor_inertia [kg m^2]": "1e-5", "nominal_torque [N m]": "0.5",
    "nominal_current [A]": "10", "peak_torque [N m]": "2", "max_speed [rpm]": "9000", "mass [kg]": "1",
}  # fmt: skip
GEAR = {
    "kind": "planetary", "ratio [1]": "50", "efficiency [1]": "0.9", "inertia [kg m^2]": "1e-6",
    "continuous_torque [N m]": "40", "repeated_peak_torque [N m]": "60", "mass [kg]": "1",
}  # fmt: skip
# The kernels run as the plain Python that they are: what is compiled does not depend on how many checks there are.
ASKS = """
import json, sys, types
sys.modules["drivetrain.vector"] = types.SimpleNamespace(larger=max, smaller=min)
import drivetrain as dt
study = dt.load_study("study.yaml")
chosen = dt.select(study)
weak = dt.evaluate(study, {"axis": ("m", "weak")})
silent = dt.evaluate(study, {"axis": ("m", "silent")})
names = [one.name for one in weak.joints["axis"].checks]
found = weak.joints["axis"].checks[names.index("gear flange torque")]
sure = {gear: dt.robustness(dt.evaluate(study, {"axis": ("m", gear)})) for gear in ("weak", "strong")}
print(json.dumps({
    "chosen": chosen.drives["axis"][1], "fallen": [(one.gear, one.check) for one in chosen.rejected_pairs],
    "told": [found.verdict.value, found.required, found.available, found.source],
    "unknown": [one.verdict.value for one in silent.joints["axis"].checks if one.name == "gear flange torque"],
    "sure": {gear: one.whole.probability for gear, one in sure.items()},
}))
"""


def edits() -> list[tuple[str, str, str]]:
    """What the page changes: (file, lines before, lines after)."""
    found, name = [], ""
    for line in re.split(r"(?m)^(?=`drivetrain/)", PAGE.read_text(encoding="utf-8"))[1:]:
        name = line[1 : line.index("`", 1)]
        for block in re.findall(r"```diff\n(.*?)```", line, re.S):
            rows = block.splitlines()
            before = "\n".join(row[1:] for row in rows if row[0] != "+")
            found.append((name, before, "\n".join(row[1:] for row in rows if row[0] != "-")))
    return found


def write_table(path: Path, rows: list[dict[str, str]]) -> None:
    names = list(dict.fromkeys(name for row in rows for name in row))
    path.write_text("\n".join(",".join(row) for row in [names, *([r.get(n, "") for n in names] for r in rows)]) + "\n")


def test_a_check_with_a_column_of_its_own(tmp_path):
    changes = edits()
    assert len({name for name, _, _ in changes}) <= 3
    assert sum(len(after.splitlines()) for _, _, after in changes) <= 40
    shutil.copytree(ROOT / "drivetrain", tmp_path / "drivetrain", ignore=shutil.ignore_patterns("__pycache__"))
    for name, before, after in changes:
        text = (tmp_path / name).read_text(encoding="utf-8")
        assert text.count(before + "\n") == 1, before
        (tmp_path / name).write_text(text.replace(before + "\n", after + "\n"), encoding="utf-8")
    (tmp_path / "catalog").mkdir()
    write_table(tmp_path / "catalog" / "motors.csv", [{"key": "m", **MOTOR}])
    gears = [
        {"key": "strong", "flange_torque [N m]": "50"},
        {"key": "weak", "flange_torque [N m]": "5"},
        {"key": "silent"},
    ]
    write_table(tmp_path / "catalog" / "gears.csv", [{**GEAR, **one} for one in gears])
    (tmp_path / "swing.csv").write_text("time [s],speed [rad/s],torque [N m]\n0,0,10\n0.5,2,10\n1,0,10\n")
    (tmp_path / "study.yaml").write_text(STUDY)
    place = {**os.environ, "PYTHONPATH": str(tmp_path), "NUMBA_DISABLE_JIT": "1"}
    ran = subprocess.run([sys.executable, "-c", ASKS], cwd=tmp_path, env=place, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    answer = json.loads(ran.stdout)
    assert answer["chosen"] in ("strong", "silent")
    assert ["weak", "gear flange torque"] in answer["fallen"]
    assert answer["told"][0] == "FAIL" and answer["told"][2] == 5.0 and "gear weak" in answer["told"][3]
    assert answer["unknown"] == ["NOT CHECKED"]
    assert answer["sure"]["weak"] == 0.0 and answer["sure"]["strong"] > 0.5
