"""BokehJS and the page's own scripts in a real browser, where one is found; `make page-check` looks at more."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from html import unescape
from pathlib import Path

import numpy as np
import pytest

import drivetrain as dt
from drivetrain.report.pages.report_page import html_report

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
MOTOR = {
    "kind": "brushless", "current_basis": "dc", "winding_basis": "line_line", "resistance": 0.3, "mass": 0.9,
    "torque_constant": 0.06, "rotor_inertia": 5e-5, "nominal_current": 9.0, "peak_current": 35.0, "max_speed": 628.0,
}  # fmt: skip
GEAR = {
    "kind": "strain_wave", "efficiency": 0.75, "mass": 1.2, "repeated_peak_torque": 120.0, "momentary_torque": 250.0,
    "max_input_speed": 700.0, "average_input_speed_limit": 400.0,
}  # fmt: skip
ASKED = """
<script>
const rows = () => Object.fromEntries(Array.from(document.getElementById("readings-0").rows).map(
  (row) => [row.cells[0].textContent, Array.from(row.cells).slice(1).map((cell) => parseFloat(cell.textContent))]));
const waiting = setInterval(() => {
  if (document.documentElement.dataset.drawn !== "all") return;
  clearInterval(waiting);
  const pictures = document.querySelectorAll(".chart:not(#strips), .strip");
  const found = { drawn: Array.from(pictures, (one) => !!one.view), judged: rows() };
  const box = document.getElementById("ratio-box-0");
  box.value = 240;
  box.dispatchEvent(new Event("input"));
  found.told = document.getElementById("ratio-told-0").textContent;
  found.other = rows();
  document.querySelector("[data-reset]").click();
  found.back = rows();
  document.body.dataset.found = JSON.stringify(found);
}, 50);
</script>
</body>"""


def answered(page: Path, folder: Path) -> str:
    """What the page's script found; a busy machine's browser may let its virtual time pass before it draws."""
    for attempt in range(4):
        done = subprocess.run(
            [str(CHROMIUM), "--headless=new", "--no-sandbox", "--disable-gpu",
             f"--user-data-dir={folder / f'profile{attempt}'}", "--enable-logging=stderr",
             "--virtual-time-budget=60000", "--dump-dom", page.as_uri()],
            capture_output=True, text=True, timeout=120, check=True,
        )  # fmt: skip
        assert re.findall(r".*(?:ERROR|WARNING):CONSOLE.*", done.stderr) == []
        if answers := re.findall(r'data-found="([^"]*)"', done.stdout):
            return str(answers[0])
    raise AssertionError("the page did not draw all of its pictures")


@pytest.mark.skipif(CHROMIUM is None, reason="needs chromium, chromium-browser or google-chrome on the PATH")
def test_the_page_draws_and_answers_what_if_the_ratio_were_another(tmp_path: Path) -> None:
    t = np.linspace(0, 2, 201)
    q = np.sin(np.pi * t / 2)[:, None] ** 2 * [0.5, 0.3]
    gears = {f"G{ratio}": {**GEAR, "ratio": ratio} for ratio in (160, 240)}
    study = dt.study(
        arm="planar-2r-bare", drive_mass="added", motion=(t, q), motors={"M": MOTOR}, gears=gears, supply="48 V",
        joints={"default": {"output_bearing": "external"}},
    )  # fmt: skip
    judged, engine = (dt.evaluate(study, ("M", gear)).joints["joint_1"].checks for gear in gears)
    page = tmp_path / "report.html"
    text = html_report(dt.evaluate(study, ("M", "G160")))
    page.write_text(ASKED.join(text.rsplit("</body>", 1)), encoding="utf-8")
    found = json.loads(unescape(answered(page, tmp_path)))
    assert len(found["drawn"]) > 5 and all(found["drawn"])
    assert found["back"] == found["judged"] and "estimate" in found["told"]
    for checks, told in ((judged, found["judged"]), (engine, found["other"])):
        used = {check.name: check.utilisation for check in checks if check.utilisation is not None}
        assert len(told) >= 6 and set(told) <= set(used)
        for name, (_, value) in told.items():
            assert value == pytest.approx(100.0 * used[name], abs=0.51), name  # the page rounds to 1 %
