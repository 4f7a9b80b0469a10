"""What a user installs works: the wheel, in a clean environment, away from the checkout."""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def run(*command: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run(command, cwd=cwd, env=environment, capture_output=True, text=True, check=False)
    return done


def test_demo_runs_from_the_wheel(tmp_path: Path) -> None:
    """What it depends on is lent by this environment; `make lowest` installs it by name."""
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", tmp_path / "dist", ROOT]
    built = run(*command, cwd=tmp_path)
    assert built.returncode == 0, built.stdout + built.stderr
    (wheel,) = (tmp_path / "dist").glob("*.whl")
    venv.create(tmp_path / "venv")
    scripts = tmp_path / "venv" / ("Scripts" if os.name == "nt" else "bin")
    command = [sys.executable, "-m", "pip", "--python", scripts / "python", "install", "--quiet", "--no-deps", wheel]
    installed = run(*command, cwd=tmp_path)
    assert installed.returncode == 0, installed.stdout + installed.stderr
    own = sysconfig.get_path("purelib", vars={"base": str(tmp_path / "venv")})
    Path(own, "lent.pth").write_text(sysconfig.get_path("purelib"))
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    demo = run(scripts / "drivetrain", "demo", cwd=elsewhere)
    assert demo.returncode == 0, demo.stdout + demo.stderr
    assert "Traceback" not in demo.stderr
    reports = list(elsewhere.rglob("report.html"))
    assert len(reports) == 1
    where = run(scripts / "python", "-c", "import drivetrain; print(drivetrain.__file__)", cwd=elsewhere)
    assert str(tmp_path) in where.stdout
