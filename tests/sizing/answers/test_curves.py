"""The curve of the optimum against brute force at values of its own, and where its pieces end."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from random_tasks import feasible_sets

from drivetrain.catalog.read import Catalog
from drivetrain.drive.amplifier import Supply
from drivetrain.errors import InputError
from drivetrain.sizing.answers import curve
from drivetrain.sizing.answers.curve import check_curve, optimum_curve
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.judge.vary import Vary
from drivetrain.sizing.search.search import select
from drivetrain.study.change import TaskChange, changed
from drivetrain.study.parts.selection import Wanted
from drivetrain.study.parts.verdicts import Verdict


def small_study(make, seed, objective="mass"):
    rng = np.random.default_rng(seed)
    motors, gears = {}, {}
    for i, size in enumerate((0.7, 1.4, 2.4)):
        motors[f"m{i}"] = replace(
            make.motor, key=f"m{i}", mass=0.4 * size * rng.uniform(0.9, 1.1), nominal_current=6.0 * size,
            peak_current=22.0 * size, rotor_inertia=2e-5 * size**2, resistance=0.3 / size,
            price=float(rng.uniform(50, 200)),
        )  # fmt: skip
    for i, size in enumerate((0.9, 2.2)):
        gears[f"g{i}"] = replace(
            make.gear, key=f"g{i}", ratio=60.0, mass=0.4 * size, repeated_peak_torque=35.0 * size,
            average_torque_limit=25.0 * size, momentary_torque=80.0 * size, price=float(rng.uniform(40, 150)),
        )  # fmt: skip
    pairs = tuple(itertools.product(motors, gears))
    cycle = replace(make.sines(2, samples=41, duration=2.0, size=0.8), payload=np.zeros(41, dtype=int),
                    payload_names=("part",))  # fmt: skip
    tasks = tuple(make.task(name, drive=None, pairs=pairs) for name in cycle.joint_names)
    return make.study(
        cycle, arm=make.planar_arm([0.4, 0.3], [1.0, 0.6]), joints=tasks, catalog=Catalog(motors, gears),
        payloads=(make.payload(2.0),), supply=Supply(48.0, peak_power=2000.0), wanted=Wanted(((objective, 1.0),)),
    )  # fmt: skip


CASES = [
    (0, Vary.PAYLOAD, (0.0, 8.0), "mass", lambda v: TaskChange(payload=v / 2.0)),
    (1, Vary.CYCLE_TIME, (0.9, 3.0), "mass", lambda v: TaskChange(time=v / 2.0)),
    (2, Vary.PAYLOAD, (0.5, 6.0), "price", lambda v: TaskChange(payload=v / 2.0)),
    (3, Vary.VOLTAGE, (10.0, 60.0), "mass", lambda v: TaskChange(voltage=v / 48.0)),
    (4, Vary.AMBIENT, (0.0, 110.0), "mass", lambda v: TaskChange(ambient=v - 25.0)),
]


@pytest.mark.parametrize(("seed", "vary", "span", "objective", "change"), CASES)
def test_every_value_has_the_optimum_of_brute_force(make, seed, vary, span, objective, change):
    study = small_study(make, seed, objective)
    curve = optimum_curve(study, vary, span, points=5)
    assert curve.pieces[0].low == span[0] and curve.pieces[-1].high == span[1]
    assert all(a.high == b.low for a, b in itertools.pairwise(curve.pieces))
    assert len(curve.pieces) >= 2 or vary is Vary.VOLTAGE
    values = np.random.default_rng(seed).uniform(*span, 4)
    for value in values:
        piece = next(one for one in curve.pieces if one.low <= value <= one.high)
        sets = feasible_sets(changed(study, change(value)))
        expected = min((one.objective for one in sets), default=math.inf)
        own = evaluate(changed(study, change(value)), piece.drives) if piece.drives else None
        found = own.objective if own is not None and own.feasible else math.inf
        assert found == pytest.approx(expected, rel=1e-9)


def test_a_piece_that_ends_by_missing_data_names_the_check_that_cannot_be_made(make):
    """Without a winding limit, hot air leaves the temperature undecided before any limit is exceeded."""
    study = small_study(make, 0)
    motors = {key: replace(row, max_winding_temperature=None) for key, row in study.catalog.motors.items()}
    study = replace(study, catalog=replace(study.catalog, motors=motors))
    curve = optimum_curve(study, Vary.AMBIENT, (0.0, 110.0), points=5)
    [piece] = [one for one in curve.pieces if one.drives and not curve.pieces[-1].drives][-1:]
    assert piece.high_ends_by.endswith(("(not checked) at j1", "(not checked) at j2"))
    beyond = evaluate(changed(study, TaskChange(ambient=piece.high + 0.01 - 25.0)), piece.drives)
    assert beyond.verdict is Verdict.NOT_CHECKED
    check, place = piece.high_ends_by.split(" (not checked) at ")
    assert check in [one.name for one in beyond.joints[place].lacking]


def test_a_breakpoint_parts_what_holds_from_what_does_not(make):
    study = small_study(make, 0)
    curve = optimum_curve(study, "payload", (0.0, 8.0), points=5)
    assert curve.proven
    checked = 0
    for piece in curve.pieces:
        if not piece.drives or not piece.high_ends_by or piece.high_ends_by == "another set is better":
            continue
        below, above = (
            evaluate(changed(study, TaskChange(payload=(piece.high + way * 2.0 * curve.tolerance) / 2.0)), piece.drives)
            for way in (-1, 1)
        )
        assert below.feasible and not above.feasible
        check, place = piece.high_ends_by.split(" at ")
        failed = [one for one in above.joints[place].checks if one.name == check]
        assert failed[0].utilisation > 1.0
        checked += 1
    assert checked >= 1


def test_the_infeasible_end_is_marked_with_its_check(make):
    curve = optimum_curve(small_study(make, 0), "payload", (0.0, 60.0), points=5)
    last = curve.pieces[-1]
    assert not last.drives and last.points == ()
    assert curve.pieces[-2].drives and curve.pieces[-2].high_ends_by
    assert curve.feasible


def test_nothing_fits_anywhere(make):
    curve = optimum_curve(small_study(make, 0), "payload", (100.0, 120.0), points=3)
    assert not curve.feasible and len(curve.pieces) == 1


def test_wrong_input_is_told(make):
    study = small_study(make, 0)
    for arguments, word in (
        (("paylaod", (0.0, 1.0)), "payload"),
        (("payload", (1.0, 1.0)), "rise"),
        (("payload", (-1.0, 1.0)), "0 or more"),
        (("cycle_time", (0.0, 1.0)), "positive"),
        (("voltage", (24.0,)), "a smallest and a largest"),
    ):
        with pytest.raises(InputError, match=word):
            optimum_curve(study, *arguments)
    for vary, low in (("payload", 0.0), ("cycle_time", 1e-3), ("voltage", 1e-3), ("ambient", -40.0)):
        check_curve(study, vary, (low, low + 1e-3))  # as near to what is refused
    with pytest.raises(InputError, match="part"):
        optimum_curve(study, "payload", (0.0, 1.0), payload="prt")
    for wrong in ([], "", 3):
        with pytest.raises(InputError, match="is none that the study carries"):
            optimum_curve(study, "payload", (0.0, 1.0), payload=wrong)
    with pytest.raises(InputError, match="carries none"):
        optimum_curve(replace(study, payloads=()), "payload", (0.0, 1.0))
    with pytest.raises(InputError) as told:
        optimum_curve(study, "payload", (0.0, -1.0), points=1, payload="prt")
    assert [fault.place for fault in told.value.faults] == ["payload", "span", "points"]


def test_a_given_drive_without_data_is_told(make):
    study = small_study(make, 2)
    bare = replace(study.catalog.gears["g1"], key="bare", efficiency=None)
    catalog = replace(study.catalog, gears={**study.catalog.gears, "bare": bare})
    first = replace(study.joints[0], drive=("m2", "bare"))
    study = replace(study, catalog=catalog, joints=(first, study.joints[1]))
    curve = optimum_curve(study, "payload", (0.5, 2.0), points=2)
    assert not curve.feasible and any("bare" in note and "efficiency" in note for note in curve.notes)


class Ladder:
    """Sets that hold up to a value each, the dearer the further: what a curve asks of a task, without one."""

    wanted = None

    def __init__(self, steps):
        self.steps, self.searches = steps, 0  # (name, holds up to, cost)

    def worth(self, drives, value):
        costs = [cost for name, end, cost in self.steps if drives == {"j": (name, "")} and value <= end]
        return costs[0] if costs else math.inf

    def selected(self, value, before):
        self.searches += 1
        cost, name = min((cost, name) for name, end, cost in self.steps if value <= end)
        return curve.CurvePoint(value, {"j": (name, "")}, cost, {}, "optimal")


def test_slivers_fold_into_a_neighbour_that_holds_and_are_not_searched_for(monkeypatch):
    """Sets a to g up to 0.3, 0.5, 0.501, 0.502, 0.503, 0.504 and 1; looked at in steps of 0.25."""
    ends = dict(zip("abcdefg", (0.3, 0.5, 0.501, 0.502, 0.503, 0.504, 1.0), strict=True))
    row = Ladder([(name, end, 1.0 + 0.1 * i) for i, (name, end) in enumerate(ends.items())])
    monkeypatch.setattr(curve, "_piece_points", lambda *_: ())
    monkeypatch.setattr(curve, "_ended_by", lambda *_: "")
    found = [row.selected(value, None) for value in np.linspace(0.0, 1.0, 5)]
    starts, narrow = [(0.0, found[0])], curve.NARROW * 0.25
    for one in found:
        curve._find_breakpoints(row, starts, one, 1e-9, narrow)
    assert len(starts) > 3
    pieces, folded = curve._pieces(row, starts, 1.0, 1e-9, narrow)
    assert folded >= 1 and [one.drives["j"][0] for one in pieces] == ["a", "b", "g"]
    assert [one.high for one in pieces] == pytest.approx([0.3, 0.5, 1.0], abs=1e-8)
    for piece in pieces:  # whoever reads a set off a piece finds one that holds
        for value in np.linspace(piece.low + 1e-8, piece.high - 1e-8, 101):
            assert math.isfinite(row.worth(piece.drives, value))


@pytest.mark.parametrize("objective", ["price", "both"])
def test_a_given_drive_without_a_price_leaves_the_curve_of_the_rest(make, objective):
    study = small_study(make, 2)
    weights = {"price": (("price", 1.0),), "both": (("mass", 30.0), ("price", 1.0), ("energy", 0.1))}[objective]
    motors = study.catalog.motors
    bare = {**motors, "given": replace(motors["m2"], key="given", price=None)}
    tasks = (replace(study.joints[0], drive=("given", "g1"), pairs=()), study.joints[1])
    study = replace(study, joints=tasks, catalog=replace(study.catalog, motors=bare), wanted=Wanted(weights))
    found = optimum_curve(study, "payload", (0.5, 6.0), points=4)
    assert found.proven and len({tuple(one.drives.items()) for one in found.pieces}) > 1
    assert any("price of j1 not known" in note and "that of the rest" in note for note in found.notes)
    for point in found.points:
        chosen = select(changed(study, TaskChange(payload=point.value / 2.0)), advise=False)
        assert point.feasible == chosen.feasible
        if point.feasible:
            assert point.objective == pytest.approx(chosen.objective, rel=1e-9)
