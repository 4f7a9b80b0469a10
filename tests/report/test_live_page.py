"""The page that answers: its numbers are those of ``evaluate`` for the changed study, and it answers nobody else."""

from __future__ import annotations

import http.client
import json
import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import drivetrain as dt
from drivetrain.commands.server import server_of
from drivetrain.drive.matching import scaled_gear
from drivetrain.report.pages.live_page import LivePage
from drivetrain.sizing.judge.evaluate import evaluate_drives

STUDY = Path(__file__).resolve().parents[2] / "examples" / "desktop_arm" / "study.yaml"


@pytest.fixture(scope="module")
def live() -> LivePage:
    study = dt.load_study(STUDY)
    return LivePage(study, dt.select(study))


@pytest.fixture(scope="module")
def drives(live: LivePage) -> dict[str, list[str]]:
    return {name: list(pair) for name, pair in live.first.drives.items()}


def used(evaluation: Any) -> dict[tuple[str, str], float]:
    checks = [(name, check) for name, joint in evaluation.joints.items() for check in joint.checks]
    checks += [("", check) for check in evaluation.shared]
    return {(name, check.name): check.utilisation for name, check in checks if check.utilisation is not None}


def test_a_drive_with_stages_and_no_gear_has_an_empty_gear() -> None:
    time = np.linspace(0.0, 2.0, 101)
    belt = {"type": "belt", "ratio": 2.5, "efficiency": 0.95, "force_limit": 300.0, "diameter": 0.1}
    motor = {"kind": "brushless", "current_basis": "dc", "winding_basis": "line_line", "resistance": 0.3, "mass": 2.0,
             "torque_constant": 0.5, "rotor_inertia": 1e-3, "peak_current": 60.0, "nominal_current": 20.0}  # fmt: skip
    study = dt.study(
        "planar-2r-bare", (time, np.sin(np.pi * time)[:, None] ** 2 * [0.2, 0.1]), supply=48.0, drive_mass="added",
        motors={"M": motor}, drives=("M", None), joints={"default": {"output_bearing": "external", "stages": [belt]}},
    )  # fmt: skip
    live = LivePage(study, dt.evaluate(study))
    assert 'value="+belt"' not in live.page()
    asked = {name: ["M", ""] for name in ("joint_1", "joint_2")}
    assert used(live.result({"drives": asked})) == used(dt.evaluate(study))
    with pytest.raises(dt.InputError, match="has no gear"):
        live.result({"drives": asked, "ratios": {"joint_1": 3.0}})


def test_two_motors_of_an_axis_are_changed_together() -> None:
    time = np.linspace(0.0, 2.0, 101)
    motor = {"kind": "brushless", "current_basis": "dc", "winding_basis": "line_line", "resistance": 0.3, "mass": 2.0,
             "torque_constant": 0.5, "rotor_inertia": 1e-3, "peak_current": 60.0, "nominal_current": 20.0}  # fmt: skip
    gears = {f"G{ratio}": {"ratio": ratio, "kind": "planetary", "efficiency": 0.9, "mass": 1.0} for ratio in (20, 30)}
    study = dt.study(
        "planar-2r-bare", (time, np.sin(np.pi * time)[:, None] ** 2 * [0.2, 0.1]), supply=48.0, drive_mass="added",
        motors={"M": motor, "L": motor | {"mass": 1.0}}, gears=gears, drives=("M", "G20"), stop={"ramp": 0.3},
        joints={"default": {"output_bearing": "external"}, "joint_2": {"motors": 2}},
    )  # fmt: skip
    live = LivePage(study, dt.evaluate(study))
    asked = {name: list(pair[:2]) for name, pair in live.answer({})["drives"].items()}
    assert [*asked] == ["joint_1", "joint_2"]
    found = live.result({"drives": asked | {"joint_2": ["L", "G20"]}, "ratios": {"joint_2": 30.0}})
    assert used(found) == pytest.approx(used(dt.evaluate(study, {"joint_2": ("L", "G30")})))
    assert found.joints["joint_2_motor_2"].drive.gear.ratio == 30.0


def test_numbers_are_those_of_evaluate_for_the_changed_study(live: LivePage, drives: dict[str, list[str]]) -> None:
    study = live.study
    payload = next(one for one in live.controls.values() if one.payload)
    asked = {
        payload.name: 1.3 * payload.now,
        "cycle time": 1.2 * study.cycle.duration,
        "voltage": 40.0,
        "ambient": 35.0,
    }
    found = live.result({"values": asked, "drives": drives})
    cycle = study.cycle
    other = replace(
        study, ambient=35.0, supply=replace(study.supply, voltage=40.0),
        payloads=tuple(
            replace(one, mass=1.3 * one.mass, inertia=1.3 * one.inertia) if one.name == payload.payload else one
            for one in study.payloads
        ),
        cycle=replace(
            cycle, time=1.2 * cycle.time, velocity=cycle.velocity / 1.2, acceleration=cycle.acceleration / 1.44
        ),
    )  # fmt: skip
    expected = used(dt.evaluate(other, {name: tuple(pair) for name, pair in drives.items()}))
    told = used(found)
    assert told.keys() == expected.keys()
    np.testing.assert_allclose(list(told.values()), list(expected.values()), rtol=1e-9)  # linear in payload and pace
    assert used(live.result({"drives": drives})) != told


def test_a_ratio_is_that_of_a_scaled_gear(live: LivePage, drives: dict[str, list[str]]) -> None:
    nominal = live.result({"drives": drives})
    name, joint = next((name, joint) for name, joint in nominal.joints.items() if joint.gear)
    ratio = 1.25 * abs(joint.drive.gear.ratio)
    mounted = {one: other.drive for one, other in nominal.joints.items()}
    mounted[name] = replace(joint.drive, gear=scaled_gear(joint.drive.gear, ratio))
    expected = used(evaluate_drives(live.study, mounted))
    told = used(live.result({"drives": drives, "ratios": {name: ratio}}))
    np.testing.assert_allclose([told[key] for key in expected], list(expected.values()), rtol=1e-9)
    answer = live.answer({"drives": drives, "ratios": {name: ratio}})
    assert "no gear of the catalogue" in answer["content"]
    assert answer["drives"][name][2] == pytest.approx(ratio, rel=1e-12)


def test_a_selection_is_that_of_select(live: LivePage) -> None:
    answer = live.answer({"values": {"voltage": live.study.supply.voltage * 1.1}}, anew=True)
    other = replace(live.study, supply=replace(live.study.supply, voltage=live.study.supply.voltage * 1.1))
    chosen = dt.select(other)
    assert {name: tuple(one[:2]) for name, one in answer["drives"].items()} == chosen.evaluation.drives
    assert str(chosen.verdict) in answer["told"]


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ([], "must be a mapping"),
        ({"code": "import os"}, "must be a mapping of values, drives, ratios"),
        ({"values": 3}, "must give numbers"),
        ({"values": {"voltag": 3}}, "did you mean 'voltage'"),
        ({"values": {"voltage": "__import__('os')"}}, "must be a number"),
        ({"values": {"voltage": -4, "cycle time": 0}}, "cycle time: must be from 0.001"),
        ({"values": {"ambient": float("nan")}}, "must be a number"),
        ({"drives": {"base": ["no such motor", ""]}}, "no such motor"),
        ({"drives": {"base": "x"}}, "must be the keys of a motor and a gear"),
        ({"ratios": {"no joint": 3}}, "is no joint of the study"),
    ],
)
def test_what_is_wrong_is_said(live: LivePage, asked: Any, words: str) -> None:
    with pytest.raises(dt.InputError) as error:
        live.answer(asked)
    assert words in str(error.value)


@pytest.fixture(scope="module")
def port(live: LivePage) -> Iterator[int]:
    server = server_of(live)
    assert server.server_address[0] == "127.0.0.1"
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield server.server_address[1]
    server.shutdown()
    server.server_close()


def asked(port: int, method: str, path: str, body: str = "", **headers: str) -> tuple[int, str]:
    line = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    line.request(method, path, body, {name.replace("_", "-"): value for name, value in headers.items()})
    reply = line.getresponse()
    text = reply.read().decode()
    line.close()
    return reply.status, text


JSON = {"Content_Type": "application/json"}


def test_the_page_and_its_answers_over_http(live: LivePage, drives: dict[str, list[str]], port: int) -> None:
    status, page = asked(port, "GET", "/")
    assert status == 200 and 'id="live"' in page and "https://" not in page.split('id="live"')[1].split("</aside>")[0]
    status, text = asked(port, "POST", "/evaluate", json.dumps({"drives": drives}), **JSON)
    assert status == 200 and json.loads(text)["told"].startswith(str(live.result({"drives": drives}).verdict))
    status, text = asked(port, "POST", "/evaluate", json.dumps({"values": {"voltage": -1}}), **JSON)
    assert status == 400 and "voltage" in json.loads(text)["faults"][0]


def test_nobody_else_may_ask(port: int) -> None:
    own = f"127.0.0.1:{port}"
    assert asked(port, "GET", "/", Host="evil.example")[0] == 403  # a name that was bent to this machine
    assert asked(port, "POST", "/evaluate", "{}", Origin="http://evil.example", **JSON)[0] == 403
    assert asked(port, "POST", "/evaluate", "{}", Origin="null", **JSON)[0] == 403
    assert (
        asked(port, "POST", "/evaluate", "{}", Content_Type="text/plain")[0] == 400
    )  # what a form of another site sends
    assert asked(port, "POST", "/evaluate", "{", Origin=f"http://{own}", **JSON)[0] == 400
    assert asked(port, "POST", "/evaluate", "[" * 100_000, **JSON)[0] == 400
    assert asked(port, "GET", "/../../etc/passwd")[0] == 404
    assert asked(port, "POST", "/", "{}", **JSON)[0] == 404
