"""A mix on the page: its parts named, and no line drawn from one to the next."""

from __future__ import annotations

from dataclasses import replace

import pytest

from drivetrain.motion.duty_cycle import build_mix
from drivetrain.report.charts.arm_charts import power_chart
from drivetrain.report.charts.motion_data import kept_samples, motion_data
from drivetrain.report.pages.report_page import html_report
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.search.search import select
from drivetrain.study.change import slowed
from drivetrain.study.read import load_study
from drivetrain.whole_files import shipped


@pytest.fixture(scope="module")
def pair():
    """The same drives at a plain cycle and at a mix."""
    study = load_study(shipped("examples") / "one_axis" / "study.yaml")
    drives = select(study).drives
    cycle = build_mix([study.cycle, slowed(study.cycle, 2.0)], [0.3, 0.7], names=["rush hour", "night"])
    return evaluate(study, drives), evaluate(replace(study, cycle=cycle), drives)


def test_the_page_names_parts_and_shares(pair):
    page = html_report(pair[1]).replace("\u00a0", " ")
    assert "mix of 30 % rush hour, 70 % night" in page
    assert "part of the mix: night" in page and "repeated for 70 % of the time" in page
    assert "in rush hour" in page


def test_no_line_joins_two_parts(pair):
    plain, mixed = (motion_data(one) for one in pair)
    assert plain["breaks"] == [] and plain["clock"] == "time in the cycle [s]"
    second = pair[1].study.cycle.parts[1].start
    assert kept_samples(pair[1])[mixed["breaks"]].tolist() == [second] and "one period of each part" in mixed["clock"]
    assert [name for _, name in mixed["segments"]][1] == "night, 70\u00a0% of the time"


def test_the_supply_too(pair):
    for one, parts in zip(pair, (1, 2), strict=True):
        chart = power_chart(one)
        assert sum(mark.kind == "line" for mark in chart.marks) == parts
