"""Prints a lock file: every package that `make test` needs, the version that pip chooses today and its file's hash.

The hashes are of the files for this platform and Python alone, as an index may offer others under other names. So the
lock is for who wants the same bytes again (`make LOCKED=1 test`); without it pip chooses for the machine it is on.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
ASKED = (f"{ROOT}[test]", "editables")  # what an editable install is built with


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.json"
        command = [sys.executable, "-m", "pip", "install", "--dry-run", "--ignore-installed", "--quiet"]
        subprocess.run([*command, "--report", str(report), *ASKED], check=True, stdout=sys.stderr)
        found = json.loads(report.read_text(encoding="utf-8"))
    lines = sorted(
        f"{one['metadata']['name'].lower()}=={one['metadata']['version']} "
        f"--hash=sha256:{one['download_info']['archive_info']['hashes']['sha256']}"
        for one in found["install"]
        if "archive_info" in one["download_info"]  # all but the project itself
    )
    where = [found["environment"][name] for name in ("python_version", "sys_platform", "platform_machine")]
    print(f"# For Python {' '.join(where)}; renewed by `make lock`")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
