from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace

import pytest

from drivetrain.report.json_text import SCHEMA_VERSION
from drivetrain.report.outputs import result_data, result_json
from drivetrain.sizing.results import Evaluation, Selection

CHECK_KEYS = [
    "name",
    "actual",
    "factor",
    "required",
    "available",
    "unit",
    "utilisation",
    "in_study_amperes",
    "verdict",
    "time",
    "source",
    "remark",
]


def test_round_trip_and_keys(evaluation: Evaluation) -> None:
    data = json.loads(result_json(evaluation))
    assert data["schema_version"] == SCHEMA_VERSION == 1
    assert data["job"] == "size" and data["verdict"] == "FAIL" and data["feasible"] is False
    assert data["digest"] == evaluation.study.digest and data["study"] == "made_up_arm"
    assert list(data["joints"]) == list(evaluation.joints)
    assert data["objective"] == {"name": "mass", "value": 12.34, "unit": "kg", "remark": ""}
    for name, joint in evaluation.joints.items():
        told = data["joints"][name]
        assert told["drive"] == {"motor": joint.motor, "gear": joint.gear}
        assert told["verdict"] == str(joint.verdict)
        assert [list(check) for check in told["checks"]] == [CHECK_KEYS] * len(joint.checks)
        for check, row in zip(joint.checks, told["checks"], strict=True):
            for key in (name for name in CHECK_KEYS if name != "in_study_amperes"):  # none: the study's are dc
                assert row[key] == getattr(check, key)
            if check.required is not None:
                assert row["actual"] * row["factor"] == pytest.approx(row["required"], rel=1e-15)
        assert {row["name"]: row["factor"] for row in told["checks"] if row["factor"] != 1.0} == {
            "motor peak torque": 1.2, "motor peak current": 1.2, "gear repeated peak torque": 1.2
        }  # fmt: skip
    assert [row["name"] for row in data["shared"]] == [check.name for check in evaluation.shared]


def test_selection_adds_the_search(selection: Selection, nothing_fits: Selection) -> None:
    data = json.loads(result_json(selection))
    assert data["job"] == "select" and data["feasible"] is True and data["proof"] == "optimal"
    assert data["rejected"]["count"] == 1200
    assert sum(sum(c.values()) for c in data["rejected"]["by_joint_and_check"].values()) == 1200
    assert data["alternatives"]["elbow"][0] == {"motor": "acme-9", "gear": "wave-9-100", "objective": 3.1}
    data = json.loads(result_json(nothing_fits))
    assert data["verdict"] == "FAIL" and data["feasible"] is False and data["objective"]["value"] is None
    assert data["advice"][0].startswith("elbow")


def test_infinity_and_nan_become_null_with_a_remark(make_evaluation: Callable[..., Evaluation]) -> None:
    evaluation = make_evaluation()
    joint = evaluation.joints["elbow"]
    endless = replace(joint.checks[0], required=math.inf, utilisation=math.nan, remark="runs away")
    changed = replace(joint, checks=(endless, *joint.checks[1:]))
    text = result_json(Evaluation(evaluation.study, {"elbow": changed}, (), math.nan))
    row = json.loads(text)["joints"]["elbow"]["checks"][0]
    assert row["required"] is None and row["actual"] is None and row["utilisation"] is None
    assert row["remark"] == "runs away; required is infinite; utilisation is not a number"
    assert "NaN" not in text and "Infinity" not in text


def test_no_path_of_this_machine(evaluation: Evaluation) -> None:
    assert "/somewhere" not in result_json(evaluation)
    assert result_json(evaluation) == result_json(evaluation)
    assert result_data(evaluation)["drivetrain"]
