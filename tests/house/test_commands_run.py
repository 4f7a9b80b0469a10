"""Every command that the README and the docs print runs as printed, one after the other, on a small arm."""

from __future__ import annotations

import math
import re
import shlex
from http.server import ThreadingHTTPServer
from pathlib import Path

import pytest
from typer.testing import CliRunner

from drivetrain.cli import app
from drivetrain.study.template import study_template

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
BODY = (
    '<inertial><origin xyz="0 0 0.1"/><mass value="2"/>'
    '<inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial>'
)
JOINT = (
    '<joint name="{0}_joint" type="revolute"><parent link="{1}"/><child link="{2}"/><origin xyz="0 0 0.3"/>'
    '<axis xyz="0 1 0"/><limit lower="-2" upper="2" velocity="3" effort="9"/></joint>'
)
PAIRS = ", ".join(
    f"{{motor: {motor}, gear: hd_CSG-17-{ratio}-2UH}}"
    for motor in ("AM_MF0060008_48V", "AM_MF0060020_48V") for ratio in (100, 120)
)  # fmt: skip
WAVES = [(0.01 * k, *(math.sin(r * 0.01 * k) for r in (2.0, 3.0, 2.5, 1.5))) for k in range(600)]
RECORDING = "time [s],q1 [rad],q2 [rad],torque1 [N m],torque2 [N m]\n" + "\n".join(
    ",".join(f"{x:.9g}" for x in row) for row in WAVES
)
AXIS = (ROOT / "docs" / "size_an_axis.md").read_text(encoding="utf-8")
FILES = dict(re.findall(r"`([\w.]+)`:\n\n```\w+\n(.*?)```", AXIS, re.S))
SWEEP = "study: my_arm.yaml\nscale:\n  payload: [0.5, 1]\npoints_per_shard: 1\n"


def printed() -> list[str]:
    """The commands of all shell blocks, each once."""
    blocks = [
        block for page in PAGES for block in re.findall(r"```sh\n(.*?)```", page.read_text(encoding="utf-8"), re.S)
    ]
    lines = [line for block in blocks for line in block.splitlines() if line.startswith("drivetrain ")]
    return list({" ".join(shlex.split(line, comments=True)): line for line in lines}.values())


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A study as `init` writes it, with four pairs of motor and gear and a ratio to vary."""
    links = "".join(f'<link name="{name}">{BODY}</link>' for name in ("base", "upper", "fore"))
    joints = JOINT.format("shoulder", "base", "upper") + JOINT.format("elbow", "upper", "fore")
    (tmp_path / "arm.urdf").write_text(f'<robot name="two">{links}{joints}</robot>', encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    text = study_template("arm.urdf")
    found = re.search(r"( +)candidates:\n +motors:.*\n +gears:.*\n +pairs:.*\n", text)
    assert found is not None
    few = f"    candidates: {{pairs: [{PAIRS}]}}\n    free_ratio: {{ratio: [80, 160], motor: AM_MF0060020_48V}}\n"
    (tmp_path / "my_arm.yaml").write_text(text.replace(found.group(0), few), encoding="utf-8")
    for name, content in FILES.items():
        (tmp_path / name).write_text(content, encoding="utf-8")
    (tmp_path / "run.csv").write_text(RECORDING, encoding="utf-8")
    (tmp_path / "sweep.yaml").write_text(SWEEP, encoding="utf-8")
    return tmp_path


def test_sizing_an_axis_gives_what_its_page_prints(folder: Path) -> None:
    (answer,) = re.findall(r"```text\n(joint.*?)```", AXIS, re.S)
    done = CliRunner().invoke(app, ["select", "turntable.yaml"])
    said = [" ".join(line.split()) for line in done.output.splitlines()]
    assert [line for line in answer.splitlines() if line and " ".join(line.split()) not in said] == []
    for pair in re.findall(r"(\d+) pairs", AXIS):
        assert f"{pair} pairs" in CliRunner().invoke(app, ["check", "turntable.yaml"]).output


def test_every_command_runs_as_printed(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ThreadingHTTPServer, "serve_forever", lambda _: None)  # until Ctrl-C
    commands = printed()
    assert len(commands) >= 15
    runner = CliRunner()
    for line in commands:
        arguments = [part.replace("KEY", "AM_MF0060020_48V") for part in shlex.split(line, comments=True)[1:]]
        if arguments[0] == "init":
            arguments[1] = f"fresh_{arguments[1]}"  # the fixture's own stays
        arguments += ["--workers", "0"] if arguments[0] == "sweep" else []  # its processes are tested in tests/sweep
        done = runner.invoke(app, arguments)
        assert done.exit_code in (0, 1), f"{line}\n{done.output}"
        assert done.exit_code == 0 or arguments[0] in ("why-not", "loops", "free-ratio"), f"{line}\n{done.output}"
    assert (folder / "chosen.yaml").is_file() and (folder / "currents.csv").is_file()
