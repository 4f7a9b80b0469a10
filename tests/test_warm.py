"""The jobs of ``drivetrain warm`` run; what they compile, other tests use anyway."""

from __future__ import annotations

import pytest

from drivetrain.commands.warm import JOBS


@pytest.mark.filterwarnings("ignore")  # as the command does: they are about the shipped studies
@pytest.mark.parametrize("name", JOBS)
def test_every_job_runs(name: str) -> None:
    JOBS[name]()
