"""What a run costs is what it computes, not what the machine does beside it."""

import time

import pytest

import drivetrain as dt
from drivetrain.accuracy import costs


def test_waiting_costs_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    def slowed(*_given: object, **_named: object) -> None:
        time.sleep(0.2)

    ready = dt.plan(dt.joint_scene(1.0, [dt.WallSpring(1.0)], 0.1))
    monkeypatch.setattr(costs, "simulate", slowed)
    (taken,) = costs.seconds([(ready, dt.FixedStep())], rounds=1)
    assert taken < 0.1
