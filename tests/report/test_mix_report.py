"""A mix on the page: its parts named, and no line drawn from one to the next."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from drivetrain.motion.mix import build_mix
from drivetrain.report.figures_arm import supply_power
from drivetrain.report.figures_strips import motion_strips
from drivetrain.report.page import html_report
from drivetrain.shipped import shipped
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.search.search import select
from drivetrain.study.change import slowed
from drivetrain.study.read import load_study


@pytest.fixture(scope="module")
def pair():
    """The same drives at a plain cycle and at a mix."""
    study = load_study(shipped("examples") / "one_axis" / "study.yaml")
    drives = select(study).drives
    cycle = build_mix([study.cycle, slowed(study.cycle, 2.0)], [0.3, 0.7], names=["rush hour", "night"])
    return evaluate(study, drives), evaluate(replace(study, cycle=cycle), drives)


def lines(svg: str) -> int:
    """Curves: paths of many points without an area."""
    return sum(len(path) > 200 for path in re.findall(r'<path d="([^"]+)"', svg))


def test_the_page_names_parts_and_shares(pair):
    page = html_report(pair[1]).replace("\u00a0", " ")
    assert "mix of 30 % rush hour, 70 % night" in page
    assert "part of the mix: night" in page and "repeated for 70 % of the time" in page
    assert "in rush hour" in page


def test_every_curve_is_drawn_part_by_part(pair):
    plain, mixed = (motion_strips(next(iter(one.joints.values())), one.study.cycle) for one in pair)
    assert lines(mixed) == 2 * lines(plain)
    assert "rush hour, 30\u00a0% of the time" in mixed and "one period of each part" in mixed


def test_the_supply_too(pair):
    plain, mixed = (supply_power(one).count('stroke-width="11"') for one in pair)
    assert plain == 1 and mixed == 2
