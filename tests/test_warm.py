"""The jobs of ``drivetrain warm`` run; what they compile, other tests use anyway. That of simulation takes too long."""

from __future__ import annotations

import pytest

from drivetrain.commands.warm import JOBS


@pytest.mark.filterwarnings("ignore")  # as the command does: they are about the shipped studies
@pytest.mark.parametrize("name", [name for name in JOBS if name != "simulate"])
def test_every_job_runs(name: str) -> None:
    JOBS[name]()
