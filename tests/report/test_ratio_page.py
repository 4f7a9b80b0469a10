"""The page, the picture and the data of a ratio study: what they say is what was found."""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from drivetrain.catalog.read import Catalog
from drivetrain.drive.amplifier import Amplifier, Supply
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.errors import InputError
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.report.charts.answer_charts import ratio_charts
from drivetrain.report.pages.ratio_page import ratio_json, ratio_report, ratio_rows, ratio_sentence
from drivetrain.report.pages.sheet import Chip
from drivetrain.sizing.answers.ratio import RatioStudy, ratio_studies, ratio_study
from drivetrain.study.model import JointTask, Mount, Safety, Study

MOTOR = Motor(
    "acme <&> 1", resistance=0.3, torque_constant=0.05, inductance=2e-4, rotor_inertia=2e-5, mass=0.5,
    nominal_voltage=48.0, nominal_current=6.0, peak_current=30.0, max_speed=1200.0, resistance_winding_housing=1.0,
    resistance_housing_ambient=4.0, winding_time_constant=20.0, housing_time_constant=800.0,
    max_winding_temperature=125.0,
)  # fmt: skip
GEAR = Gear(
    "wheel", -50.0, kind="planetary", efficiency=0.8, inertia=1e-6, mass=0.4, continuous_torque=20.0,
    repeated_peak_torque=40.0, momentary_torque=80.0, max_input_speed=1000.0,
)  # fmt: skip


def one_axis(motor: Motor = MOTOR) -> Study:
    time = np.linspace(0.0, 2.0, 101)
    speed = 3.0 * np.sin(np.pi * time)[:, None]
    acceleration = 3.0 * np.pi * np.cos(np.pi * time)[:, None]
    zeros = np.zeros(101, dtype=int)
    cycle = Cycle(
        ("hinge",), time, np.zeros((101, 1)), speed, acceleration, 0.4 * acceleration + 3.0, zeros - 1, (), zeros,
        ("table",),
    )  # fmt: skip
    task = JointTask(
        "hinge", (motor.key, "wheel"), (), (), Mount(), None, Friction(0.2), Friction(0.002), Amplifier(40.0, 20.0)
    )
    gears = {"wheel": GEAR, **{f"w{i}": replace(GEAR, key=f"w{i}", ratio=15.0 * i) for i in range(1, 5)}}
    return Study(
        name="Door & frame", description="", path="", digest="abc", arm=None, drive_mass=None, payloads=(), cycle=cycle,
        joints=(task,), supply=Supply(48.0), ambient=25.0, safety=Safety(), gear_assumptions={}, motor_assumptions={},
        catalog=Catalog({motor.key: motor}, gears),
    )  # fmt: skip


@pytest.fixture(scope="module")
def found() -> RatioStudy:
    return ratio_study(one_axis(), "hinge")


class _Tags(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.text = ""

    def handle_starttag(self, tag: str, attrs: object) -> None:
        if tag not in ("meta", "br", "path", "use"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag not in ("path", "use"):
            assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


def test_page_is_well_formed_and_says_what_was_found(found) -> None:
    page = ratio_report([found])
    reader = _Tags()
    reader.feed(page)
    assert reader.open == []
    assert "Door & frame" in reader.text
    assert "acme <&> 1" in reader.text
    assert "<&>" not in page
    assert ratio_sentence(found) in reader.text
    for gear in found.gears:
        assert gear.key in reader.text
    assert not re.search(r'(?:src|href)="(?!#)', page)
    assert page == ratio_report([ratio_study(one_axis(), "hinge")])


def test_sentence_and_rows(found) -> None:
    (window,) = found.windows
    sentence = ratio_sentence(found)
    assert f"from {window.low:.1f} ({window.low_binding})" in sentence
    assert f"to {window.high:.0f} ({window.high_binding.replace(' (not checked)', ', not checked')})" in sentence
    assert "its own, 50.0, is inside" in sentence
    (row,) = ratio_rows(found)
    assert row[4:6] == (Chip(f"{window.low:.1f}", "pass"), f"{window.high:.0f}")
    open_below = replace(found, gear="+screw", windows=(replace(window, low=0.0, low_binding=""),))
    assert f"with screw fits with a ratio up to {window.high:.0f} (" in ratio_sentence(open_below)
    (row,) = ratio_rows(open_below)
    assert (row[2], row[4]) == ("screw", Chip("any", "pass"))


def test_undecided_checks_are_grey(found) -> None:
    """Where data are missing for a verdict, there is a grey span in the place of an infinite utilisation."""
    first = int(np.argmin(np.abs(found.ratios - found.best.ratio)))
    name, hidden = found.best.binding, [k - first in (0, 1, 3) for k in range(len(found.points))]
    points = tuple(
        replace(point, utilisations={**point.utilisations, name: math.inf if hides else 0.5}, undecided=(name,) * hides)
        for point, hides in zip(found.points, hidden, strict=True)
    )
    drawn = replace(found, points=points, windows=())
    used = ratio_charts(drawn)[-1].marks
    spans = [(mark.x[0], mark.to[0]) for mark in used if mark.kind == "span"]
    between = np.sqrt(found.ratios[:-1] * found.ratios[1:])
    assert spans == [(between[first - 1], between[first + 1]), (between[first + 2], between[first + 3])]
    (highest,) = (mark for mark in used if mark.label == "the highest")
    gone = {float(ratio) for ratio, hides in zip(found.ratios, hidden, strict=True) if hides}
    assert {float(ratio) for ratio in np.asarray(highest.x)[np.isnan(highest.y)]} == gone
    assert "Grey in the utilisation" in ratio_report([drawn])


def test_no_ratio_fits() -> None:
    weak = ratio_study(one_axis(replace(MOTOR, nominal_current=0.3)), "hinge")
    assert ratio_sentence(weak).startswith("No ratio lets acme <&> 1 with wheel meet all limits: the best, ")
    (row,) = ratio_rows(weak)
    assert row[4] == Chip("no ratio", "fail")
    assert "no ratio fits" in ratio_report([weak])
    marks = [mark for chart in ratio_charts(weak) for mark in chart.marks if mark.kind == "span"]
    assert {mark.colour for mark in marks} == {"muted"}  # no ratio is shaded as one that fits


def test_missing_data_can_be_drawn() -> None:
    blind = replace(MOTOR, resistance_winding_housing=None, nominal_current=None, max_winding_temperature=None)
    found = ratio_study(one_axis(blind), "hinge")
    page = ratio_report([found])
    assert "Winding temperature not computed: no thermal data in the catalogue row" in page
    assert len(ratio_charts(found)) == 4 and "RMS torque within" not in page
    unknown = ratio_study(one_axis(replace(MOTOR, rotor_inertia=None)), "hinge")
    assert "not checked at any ratio: motor RMS current" in ratio_report([unknown])


def test_picture_shades_the_window(found) -> None:
    charts = ratio_charts(found)
    (window,) = found.windows
    for chart in charts:
        shade = next(mark for mark in chart.marks if mark.kind == "span")
        assert (shade.x[0], shade.to[0]) == (pytest.approx(window.low), pytest.approx(window.high))
    rms = next(mark for mark in charts[1].marks if mark.label == "RMS")
    scale = 1e3 if "mN m" in charts[1].y else 1.0
    for ratio, value in zip(rms.x, rms.y, strict=True):
        point = found.points[int(np.argmin(np.abs(found.ratios - ratio)))]
        assert value == pytest.approx(point.rms_torque * scale)
    assert charts[2].y == "motor speed [rpm]" and charts[4].y == "utilisation [%]"


def test_data_are_the_study(found) -> None:
    data = json.loads(ratio_json([found]))
    joint = data["joints"]["hinge"]
    assert (data["schema_version"], data["feasible"], data["digest"]) == (1, True, "abc")
    assert joint["windows"][0]["low"] == found.windows[0].low
    assert len(joint["points"]) == len(found.points)
    assert joint["drive"]["ratio"] == -50.0
    assert joint["load_match"]["range"] == list(found.closed_forms.load_match.range)
    assert ratio_json([found]) == ratio_json([ratio_study(one_axis(), "hinge")])
    endless = replace(found, best=replace(found.best, winding_temperature=math.inf))
    assert json.loads(ratio_json([endless]))["joints"]["hinge"]["best"]["winding_temperature"] is None


def test_nothing_moves_nothing_to_tell() -> None:
    study = one_axis()
    still = replace(study, cycle=replace(study.cycle, velocity=0 * study.cycle.velocity))
    with pytest.raises(InputError, match="none of them moves"):
        ratio_report(ratio_studies(still))
