"""The benchmark command runs, agrees, and prints its table."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

BENCHMARK = Path(__file__).resolve().parents[2] / "benchmarks" / "inverse_dynamics.py"


def test_benchmark_on_a_few_samples(capsys: pytest.CaptureFixture[str]) -> None:
    spec = importlib.util.spec_from_file_location("benchmark_inverse_dynamics", BENCHMARK)
    benchmark = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(benchmark)
    # Times of so few samples are meaningless and not checked; the agreement of results is.
    assert benchmark.main(["--samples", "70", "--repeats", "1"]) == 0
    printed = capsys.readouterr().out
    for name in ("drivetrain, rotors off", "rotors on the joint axes", "rneaInParallel", "MuJoCo", "us/sample"):
        assert name in printed
    assert "met     all agree with pinocchio" in printed


def test_missed_targets_give_an_exit_code() -> None:
    spec = importlib.util.spec_from_file_location("benchmark_inverse_dynamics", BENCHMARK)
    benchmark = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(benchmark)
    kinds = ("off", "on the joint axes", "oblique")
    names = [*(f"drivetrain, rotors {kind}" for kind in kinds), *benchmark.TARGETS]
    good = dict(zip(names, (1.0, 1.1, 1.15, 26.0, 13.0), strict=True))
    assert all(met for _, met in benchmark.verdicts(good, {"all": 1e-12}))
    for name, time in zip(names, (2.0, 1.2, 1.16, 24.0, 11.0), strict=True):
        assert not all(met for _, met in benchmark.verdicts({**good, name: time}, {"all": 1e-12}))
    assert not all(met for _, met in benchmark.verdicts(good, {"all": 1e-9}))
