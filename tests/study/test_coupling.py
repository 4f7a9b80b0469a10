"""Couplings in study files: what they mean on the arm, where drives sit, and every fault told at its place."""

from __future__ import annotations

import numpy as np
import pytest

from drivetrain.errors import InputError
from drivetrain.study.model import Mount

GROUP = {"joints": ["joint_1", "joint_2"]}


def faults(load, changes) -> str:
    with pytest.raises(InputError) as error:
        load(changes)
    return str(error.value)


@pytest.mark.parametrize(
    ("entry", "matrix"),
    [
        ({"type": "differential"}, [[1, 1], [1, -1]]),
        ({"type": "differential", "turns": [1, 1.68]}, [[1, 1.68], [1, -1.68]]),
        ({"type": "belt"}, [[1, 0], [1, 1]]),
        ({"type": "belt", "passes": [-1]}, [[1, 0], [-1, 1]]),
        ({"matrix": [[2, 0.5], [0, "100 %"]]}, [[2, 0.5], [0, 1]]),
    ],
)
def test_what_it_means(load, entry, matrix) -> None:
    study = load({"coupling": [{**GROUP, **entry}]})
    assert study.arm.coupling == pytest.approx(np.array(matrix))
    assert [task.coupled for task in study.joints] == [("joint_1", "joint_2")] * 2
    assert sum("are coupled" in note for note in study.notes) == 1


def test_the_order_of_the_joints_is_that_of_rows_and_columns(load) -> None:
    study = load({"coupling": [{"joints": ["joint_2", "joint_1"], "matrix": [[1, 0.5], [0, 3]]}]})
    assert study.arm.coupling == pytest.approx(np.array([[3, 0], [0.5, 1]]))


def test_nothing_said_is_nothing_coupled(load) -> None:
    study = load()
    assert study.arm.coupling is None
    assert all(task.coupled == () and task.mount.joint is None for task in study.joints)
    assert load({"coupling": [{**GROUP, "matrix": [[1, 0], [0, 1]]}]}).arm.coupling is None


def test_drives_may_sit_where_their_group_begins(load) -> None:
    mount = {"carrier": "group", "offset": "-50 mm"}
    joints = {"default": {"candidates": {}, "mount": mount}}
    study = load({"coupling": [{**GROUP, "type": "belt"}], "joints": joints})
    assert [task.mount for task in study.joints] == [Mount("parent", -0.05, 0)] * 2
    told = faults(load, {"joints": joints})
    assert told.count("applies only to a joint that `coupling` names") >= 1


@pytest.mark.parametrize(
    ("entry", "problem"),
    [
        ({**GROUP}, "must have one of: type"),
        ({**GROUP, "type": "belt", "matrix": [[1, 0], [0, 1]]}, "must have one of: type"),
        ({**GROUP, "type": "belts"}, "'differential' or 'belt'"),
        ({**GROUP, "type": "belt", "turns": [1, 1]}, "turns applies only to type: differential"),
        ({**GROUP, "matrix": [[1, 0], [0, 1]], "passes": [1]}, "passes applies only to type: belt"),
        ({**GROUP, "matrix": [[1, 0]]}, "2 rows of 2 numbers"),
        ({**GROUP, "matrix": [[1, 0], [1]]}, "2 rows of 2 numbers"),
        ({**GROUP, "matrix": [[1, 1], [1, 1]]}, "singular"),
        ({**GROUP, "type": "differential", "turns": [1]}, "two turns"),
        ({**GROUP, "type": "belt", "passes": [1, 1]}, "each but the last"),
        ({"joints": ["joint_1"], "type": "belt"}, "two joints or more"),
        ({"joints": ["joint_1", "joint_3"], "type": "belt"}, "did you mean 'joint_1'|names a joint that is not there"),
        ({"joints": ["joint_1", "joint_1"], "type": "belt"}, "names a joint twice"),
        ({"type": "belt"}, "is missing"),
        ({**GROUP, "type": "belt", "ratio": 3}, "is not known here"),
    ],
)
def test_faults(load, entry, problem) -> None:
    with pytest.raises(InputError, match=problem) as error:
        load({"coupling": [entry]})
    assert any("coupling" in fault.place for fault in error.value.faults)


def test_two_entries_cannot_share_a_joint(load) -> None:
    one = {"joints": ["joint_1"], "matrix": [[2]]}
    both = load({"coupling": [one, {"joints": ["joint_2"], "matrix": [[3]]}]})
    assert both.arm.coupling == pytest.approx(np.diag([2, 3]))
    assert "twice" in faults(load, {"coupling": [one, {**GROUP, "type": "belt"}]})


def test_a_coupling_of_the_arm_itself_holds_until_the_study_says_another(load) -> None:
    rows = [[0, 0, 0, 90, 0, 0, 0], [10, 20, 0, 80, 0, 0, 0]]
    motions = {"there": {"unit": "deg", "profile": "quintic", "durations": ["1 s"], "waypoints": rows}}
    changes = {"arm": "wam", "motions": motions, "cycle": None, "payloads": {}, "open_cycle": True,
               "joints": {"default": {"candidates": {}, "mount": {"carrier": "parent"}}}}  # fmt: skip
    study = load(changes)
    assert study.joints[2].coupled == ("joint_2", "joint_3") and study.joints[0].coupled == ()
    assert sum("are coupled" in note for note in study.notes) == 2
    other = load({**changes, "coupling": [{"joints": ["joint_6", "joint_7"], "type": "belt"}]})
    assert [task.coupled for task in other.joints[:5]] == [()] * 5
    assert other.arm.coupling[5:, 5:] == pytest.approx(np.array([[1.0, 0.0], [1.0, 1.0]]))
