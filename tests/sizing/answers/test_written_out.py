"""Parts of the answers on tasks made by hand: envelopes of curves, factors of moves, paths, ranges of ratios."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from drivetrain.drive.drive import Drive
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear, complete
from drivetrain.drive.loops.servo_axis import ServoAxis, ServoTiming
from drivetrain.drive.matching import GearFamily
from drivetrain.drive.motor import Motor
from drivetrain.sizing.answers import curve, fastest, loops, ratio, ratio_descent
from drivetrain.sizing.answers.trade_offs import usual_span
from drivetrain.sizing.judge.vary import Vary, Worst, edge, edges, first_edge, worst_of
from drivetrain.study.parts.verdicts import Check, Verdict

STEP = 1.0 / 16.0  # of the grid of a curve


class Lines:
    """Sets with a range in which each is feasible, and an objective that is linear in the value."""

    wanted = None

    def __init__(self, sets: dict[str, tuple[float, float, float, float]]) -> None:
        self.sets, self.searches = sets, 0

    def worth(self, drives: dict[str, Any], value: float) -> float:
        if not drives:
            return math.inf
        low, high, at_zero, slope = self.sets[drives["j"][0]]
        return at_zero + slope * value if low <= value <= high else math.inf

    def best(self, value: float) -> str:
        costs = {name: self.worth({"j": (name, "")}, value) for name in self.sets}
        name = min(costs, key=costs.get)  # type: ignore[arg-type]
        return name if math.isfinite(costs[name]) else ""

    def selected(self, value: float, before: object) -> curve.CurvePoint:
        self.searches += 1
        name = self.best(value)
        drives = {"j": (name, "")} if name else {}
        return curve.CurvePoint(value, drives, self.worth(drives, value) if name else math.nan, {}, "optimal")


def drawn(seed: int) -> tuple[Lines, list[tuple[str, float]]]:
    """Random sets, and the true best ones with the value from which each is; empty if one is narrower than a step."""
    rng = np.random.default_rng(seed)
    row = Lines({})
    for name in "abcdef"[: rng.integers(2, 7)]:
        low, high = np.sort(rng.uniform(-0.3, 1.3, 2))
        row.sets[name] = (low, high, rng.uniform(1.0, 3.0), rng.uniform(-0.9, 0.9))
    values = np.linspace(0.0, 1.0, 4001)
    names = [row.best(value) for value in values]
    starts = [(name, float(values[i])) for i, name in enumerate(names) if i == 0 or name != names[i - 1]]
    ends = [value for _, value in starts[1:]] + [1.0]
    wide = all(end - start > 1.1 * STEP for (_, start), end in zip(starts, ends, strict=True))
    return row, starts if wide else []


def test_pieces_are_the_lower_envelope(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of sets that are feasible in ranges, cheapest first; where every piece is wider than the grid, none is missed."""
    monkeypatch.setattr(curve, "_piece_points", lambda *_: ())
    monkeypatch.setattr(curve, "_ended_by", lambda search, drives, value, way: f"{value:.3f} {way:+d}")
    tried = 0
    for seed in range(60):
        row, wanted = drawn(seed)
        if len(wanted) < 2:
            continue
        tried += 1
        found = [row.selected(value, None) for value in np.linspace(0.0, 1.0, 17)]
        starts = [(0.0, found[0])]
        for one in found:
            curve._find_breakpoints(row, starts, one, 1e-7, curve.NARROW * STEP)  # type: ignore[arg-type]
        assert [one.drives for _, one in starts] == [{"j": (name, "")} if name else {} for name, _ in wanted]
        pieces, folded = curve._pieces(row, starts, 1.0, 1e-7, curve.NARROW * STEP)  # type: ignore[arg-type]
        assert folded == 0 and len(pieces) == len(wanted)
        lows, highs = [value for _, value in wanted], [*(value for _, value in wanted[1:]), 1.0]
        assert [one.low for one in pieces] == pytest.approx(lows, abs=2.6e-4)
        assert [one.high for one in pieces] == pytest.approx(highs, abs=2.6e-4)
        for one, (name, _) in zip(pieces, wanted, strict=True):
            assert one.drives == ({"j": (name, "")} if name else {})
            assert one.low_ends_by == ("" if one.low == 0.0 else f"{one.low:.3f} -1")
            assert one.high_ends_by == ("" if one.high == 1.0 else f"{one.high:.3f} +1")
        assert row.searches <= 17 + 2 * (len(wanted) - 1)
    assert tried > 10


def test_no_third_set_is_better_at_a_breakpoint() -> None:
    """On a coarse grid, between whose values sets come and go: the best one on both sides of each breakpoint."""
    tried = 0
    for seed in range(60):
        row, wanted = drawn(seed)
        if len(wanted) < 3:
            continue
        found = [row.selected(value, None) for value in (0.0, 0.5, 1.0)]
        starts = [(0.0, found[0])]
        for one in found:
            curve._find_breakpoints(row, starts, one, 1e-7, 1e-3)  # type: ignore[arg-type]
        for (_, before), (value, after) in itertools.pairwise(starts):
            for one, there in ((before, value - 1e-6), (after, value + 1e-6)):
                best = row.best(there)
                assert one.drives == ({"j": (best, "")} if best else {})
            tried += 1
        assert [value for value, _ in starts] == sorted(value for value, _ in starts)
        assert len(starts) <= len(wanted)
    assert tried > 10


def test_a_set_may_replace_another_where_it_is_no_worse() -> None:
    """At all evaluated points of the interval; at any cost only feasibility counts."""
    row: Any = Lines({"a": (0.0, 1.0, 2.0, 0.0), "b": (0.2, 1.0, 2.0, 0.0), "c": (0.0, 1.0, 1.9, 0.2)})

    def good(name: str, low: float, high: float, other: str = "a", **more: bool) -> bool:
        own = {"j": (name, "")} if name else {}
        return curve._as_good(row, own, curve._Interval(low, high, {"j": (other, "")} if other else {}), **more)

    assert good("b", 0.2, 0.9) and not good("b", 0.1, 0.9) and not good("b", 0.1, 0.9, at_any_cost=True)
    assert good("c", 0.0, 0.5) and not good("c", 0.0, 0.6) and good("c", 0.0, 0.6, at_any_cost=True)
    assert not good("a", 0.1, 0.9, "b")  # where the other is infeasible there is nothing to replace
    for cost in (False, True):  # a range without a set stays one
        assert not good("", 0.2, 0.9, at_any_cost=cost) and not good("a", 0.2, 0.9, "", at_any_cost=cost)


@pytest.mark.parametrize(("way", "feasible"), [(1, True), (-1, False), (1, False)])
def test_what_ends_a_piece_is_looked_up_just_outside(way: int, feasible: bool) -> None:
    """Twice the accuracy of a breakpoint away, relative to the larger of the value and the study's own."""
    asked = []
    check = Check("motor speed", 2.0, 1.0, "rad/s", 2.0, Verdict.FAIL)

    def evaluated(drives: object, value: float) -> Any:
        asked.append(value)
        return SimpleNamespace(feasible=feasible, joints={"elbow": SimpleNamespace(checks=(check,))}, shared=())

    search: Any = SimpleNamespace(wanted=None, number=SimpleNamespace(now=5.0), evaluated=evaluated)
    drives = {"j": ("a", "")}
    said = "another set is better" if feasible else "motor speed at elbow"
    assert curve._ended_by(search, drives, -8.0, way) == said == curve._ended_by(search, drives, 0.0, way)
    assert asked == pytest.approx([-8.0 + way * 16e-6, way * 10e-6], abs=1e-12)
    assert curve._ended_by(search, {}, 0.0, way) == ""
    assert "probability" in curve._ended_by(SimpleNamespace(wanted=0.9), drives, 0.0, way)  # type: ignore[arg-type]


def test_points_of_a_piece_reach_from_end_to_end() -> None:
    search: Any = SimpleNamespace(
        evaluated=lambda drives, value: SimpleNamespace(objective=3.0 * value, criteria={"mass": value})
    )
    points = curve._piece_points(search, {"j": ("a", "")}, 2.0, 6.0)
    assert [one.value for one in points] == [2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 5.5, 6.0]
    assert all(one.objective == 3.0 * one.value and one.criteria == {"mass": one.value} for one in points)
    assert curve._piece_points(search, {}, 2.0, 6.0) == ()


@pytest.mark.parametrize("least", [0.03, 0.3, 0.95, 1.0, 1.3, 7.0, 40.0])
def test_the_smallest_factor_is_bracketed_and_on_the_safe_side(least: float) -> None:
    asked: list[float] = []

    def holds(factor: float) -> bool:
        asked.append(factor)
        return factor >= least

    found = fastest._smallest_factor(holds, 1.0)
    assert least <= found <= least * (1.0 + fastest.FACTOR_TOLERANCE)
    assert len(asked) < 45 and max(asked) <= max(1.0, 1.25 * least) and min(asked) >= min(1.0, least / 1.25 - 1e-12)
    assert fastest._smallest_factor(lambda factor: factor >= 2.0 * least, 2.0, quicker=False) >= 2.0


def test_a_factor_beyond_fifty_is_none() -> None:
    """The last one tried is returned, whatever lies behind."""
    for found, ends in ((fastest._smallest_factor(lambda _: False, 2.0), (100.0, 125.0)),
                        (fastest._smallest_factor(lambda _: True, 2.0), (0.04, 0.05))):  # fmt: skip
        assert ends[0] <= found <= ends[1]


def test_a_path_through_a_move(make: SimpleNamespace) -> None:
    """Over its chord length, dense at both ends, through the samples that are not too near to each other."""
    time = np.linspace(0.0, 3.0, 61)
    angle = np.pi * (3.0 * (time / 3.0) ** 2 - 2.0 * (time / 3.0) ** 3)
    q = np.column_stack([np.cos(angle), np.sin(angle), np.full(61, 0.4)])  # half a circle
    cycle = make.arm_cycle(time, q, 0.0 * q, 0.0 * q)
    path = fastest._move_path(cycle, slice(0, 61))
    grid = 0.5 * (1.0 - np.cos(np.pi * np.arange(161) / 160.0))
    np.testing.assert_allclose(path.place, grid, atol=1e-15)
    np.testing.assert_allclose(path.position[[0, -1]], q[[0, -1]], atol=1e-15)
    on = np.pi * grid
    np.testing.assert_allclose(path.position, np.column_stack([np.cos(on), np.sin(on), 0.4 + 0.0 * on]), atol=2e-3)
    np.testing.assert_allclose(np.linalg.norm(path.first, axis=1)[5:-5], np.pi, rtol=0.03)
    speed = np.gradient(path.position, grid, axis=0)
    np.testing.assert_allclose(path.first[2:-2], speed[2:-2], atol=0.01)
    np.testing.assert_allclose(path.second[4:-4], np.gradient(path.first, grid, axis=0)[4:-4], atol=0.2)
    chord = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(q, axis=0), axis=1))])
    chord /= chord[-1]
    for place, sample in zip(path.place[1:-1], path.sample[1:-1], strict=True):
        assert chord[sample - 1] <= place <= chord[sample]
    later = fastest._move_path(make.arm_cycle(time, np.roll(q, 20, axis=0), q, q), slice(20, 61))
    np.testing.assert_array_equal(later.position[0], q[0])
    assert later.sample.min() == 21 and later.sample.max() == 60


def test_moves_lie_between_rests(make: SimpleNamespace) -> None:
    """Rest, move, turning point under acceleration, move, rest with two samples at one instant, move."""
    time = np.array([0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.0, 3.5, 4.0])
    speed = np.array([0.0, 0.0, 1.0, 0.0, -1.0, 1.0, 0.0, 0.0, 1.0, 0.0])
    push = np.array([0.0, 0.0, 1.0, -0.2, 1.0, 1.0, 3.0, 2.0, 1.0, 0.0])
    cycle = make.arm_cycle(time, np.zeros((10, 1)), speed[:, None], push[:, None])
    assert fastest.moves_of(cycle) == [slice(1, 7), slice(7, 10)]
    halves = replace(cycle, parts=(slice(0, 5), slice(5, 10)), shares=(0.5, 0.5), part_names=("a", "b"))
    assert fastest.moves_of(halves) == [slice(1, 5), slice(5, 7), slice(7, 10)]


def test_limits_and_use_of_the_best_cycle(make: SimpleNamespace) -> None:
    """Largest torques over their utilisation, speeds likewise, voltage as a linear function of torque and speed."""
    rng = np.random.default_rng(5)

    def joint(used: dict[str, float]) -> SimpleNamespace:
        torque, speed = rng.normal(size=(2, 30))
        checks = [
            Check(name, 1.0, 1.0, "-", share, Verdict.PASS, 0.5 if name != "cold start torque" else None)
            for name, share in used.items()
        ]
        over = Check("motor RMS current", 1.0, 1.0, "A", 0.97, Verdict.PASS)
        return SimpleNamespace(checks=(*checks, over), series=SimpleNamespace(
            gear_torque=rng.normal(size=30), motor_torque=torque, motor_speed=speed, voltage=2.0 * torque + 0.3 * speed
        ))  # fmt: skip

    joints = {
        "a": joint({"gear repeated peak torque": 0.5, "gear momentary peak torque": 0.2, "motor voltage": 0.8,
                    "motor speed": 0.25, "motor peak torque": 0.4, "cold start torque": 0.6}),
        "b": joint({"gear repeated peak torque": 0.04, "motor voltage": 0.03, "motor speed": 0.05,
                    "motor peak current": 0.02}),
    }  # fmt: skip
    velocity = np.array([[1.0, -3.0], [-2.0, 0.5]])
    cycle = make.arm_cycle([0.0, 1.0], velocity, velocity, velocity)
    arm = SimpleNamespace(speed_limits=np.array([5.0, 100.0]))
    evaluation = SimpleNamespace(study=SimpleNamespace(cycle=cycle, arm=arm), joints=joints)
    torque, speed, volts = fastest._allowed(SimpleNamespace(evaluation=evaluation))  # type: ignore[arg-type]
    for i, (one, gear, motor, voltage) in enumerate(zip(joints.values(), (0.5, 0.04), (0.6, 0.02), (0.8, 0.03),
                                                        strict=True)):  # fmt: skip
        assert torque[:, i] == pytest.approx([
            np.abs(one.series.gear_torque).max() / gear, np.abs(one.series.motor_torque).max() / motor
        ])  # fmt: skip
        assert volts[:, i] == pytest.approx(np.array([2.0, 0.3]) * voltage / np.abs(one.series.voltage).max())
    np.testing.assert_allclose(speed, [5.0, 3.0 / 0.05])  # the arm's limit, and 2 / 0.25 of the checks is more


def test_boundaries_by_bisection() -> None:
    def holds(value: float) -> bool:
        return 2.0 <= value <= 5.0 or 20.0 <= value <= 30.0

    inside, outside = edge(holds, 3.0, 9.0)
    assert inside <= 5.0 < outside and outside - inside <= 1e-6 * outside
    assert edge(holds, 3.0, 9.0, error=0.0, least=0.75) == (4.5, 5.25)
    inside, outside = edge(holds, 4.0, 9.0, error=0.0, least=2.0)
    assert (inside, outside) == (4.0, 5.25)
    inside, outside = edge(holds, 4.0, 9.0, error=0.0, least=4.0, geometric=True)
    assert (inside, outside) == (4.0, 6.0)
    first = first_edge(holds, [1.0, 1.5, 3.0, 4.0])
    assert first is not None and first.outside < 2.0 <= first.inside
    assert first_edge(holds, [6.0, 8.0, 10.0]) is None and first_edge(holds, [3.0, 1.0]) is None
    values = [1.0, 3.0, 4.0, 10.0, 25.0]
    (low, high), (second, open_end) = edges(holds, values)
    assert low.outside < 2.0 <= low.inside and high.inside <= 5.0 < high.outside
    assert second.outside < 20.0 <= second.inside and open_end == (math.inf, math.inf)
    ((low, high),) = edges(holds, [2.5, 3.0, 10.0])
    assert low == (0.0, 0.0) and high.inside <= 5.0 < high.outside
    assert list(edges(lambda _: False, values)) == []


def test_the_worst_check() -> None:
    """A number that exceeds 1 before one that is unbounded or missing, these before one that does not."""

    def check(name: str, used: float | None, verdict: Verdict, *, essential: bool = False) -> Check:
        return Check(name, 1.0, 1.0, "-", used, verdict, essential=essential)

    small, large = check("small", 0.4, Verdict.PASS), check("large", 0.9, Verdict.PASS)
    over, endless = check("over", 1.2, Verdict.FAIL), check("endless", math.inf, Verdict.FAIL)
    nameless = replace(check("lost", None, Verdict.NOT_CHECKED), available=None)
    assert worst_of([small, large, nameless]).check == "large" and worst_of([large, small]).utilisation == 0.9
    assert worst_of([large, endless, over]).check == "over"
    assert worst_of([large, endless, small]) == ("endless", math.inf, "")
    assert worst_of([nameless]) == ("", 0.0, "") == worst_of([])


def sweep_point(ratio_: float, **used: float) -> ratio.RatioPoint:
    return ratio.RatioPoint(ratio_, 1.0, 1.0, 1.0, 1.0, used)


def test_a_sweep_is_extended_to_its_ends_and_finds_the_least_utilisation() -> None:
    """Torque falls as one over the ratio, speed rises with it: equal at the root of 0.5 * 200."""

    def at(value: float) -> ratio.RatioPoint:
        return sweep_point(value, torque=0.5 / value * 100.0, speed=value / 200.0, constant=0.99)

    grid = [60.0, 80.0, 120.0, 160.0]
    points = ratio._sweep(at, grid, fixed=False)
    values = [one.ratio for one in points]
    assert values == sorted(values) and set(grid) <= set(values)
    assert values[0] < 50.0 <= values[1] * 1.0001 and values[-1] > 200.0 >= values[-2]
    assert min(points, key=ratio._strain(points)).ratio == pytest.approx(100.0, rel=2e-4)
    fixed = ratio._sweep(at, grid, fixed=True)
    assert [one.ratio for one in fixed if one.ratio not in grid] == [pytest.approx(100.0, rel=2e-4)]
    assert (fixed[0].ratio, fixed[-1].ratio) == (60.0, 160.0)
    endless = ratio._sweep(lambda value: sweep_point(value, torque=0.5), [1.0, 10.0], fixed=False)
    assert endless[-1].ratio >= ratio.LARGEST > endless[-2].ratio
    assert endless[0].ratio <= ratio.SMALLEST < endless[1].ratio
    assert [one.ratio for one in ratio._sweep(at, [90.0], fixed=True)] == [90.0]


def test_only_checks_that_the_ratio_changes_decide() -> None:
    points = [sweep_point(1.0, a=0.2, b=0.9, c=math.nan), sweep_point(2.0, a=0.5, b=0.9, c=math.nan)]
    strain = ratio._strain(points)
    assert [strain(one) for one in points] == [0.2, 0.5]
    assert strain(sweep_point(3.0, a=math.nan, b=0.1, c=0.0)) == math.inf
    same = [sweep_point(1.0, b=0.9, d=0.95), sweep_point(2.0, b=0.9, d=0.95)]
    assert ratio._strain(same)(same[0]) == 0.95


class Bowl(ratio_descent.LineSearch):
    """A search whose objective is a parabola of the logarithm of a ratio, with limits on a range."""

    def __init__(self, least: float, low: float, high: float) -> None:
        self.least, self.low, self.high, self.joint = least, low, high, 0
        self.design: Any = SimpleNamespace(families={0: GearFamily("", 10.0, 1000.0)})

    def objective(self, value: float) -> float:
        return 1.0 + math.log(value / self.least) ** 2

    def binding_limit(self, value: float) -> Worst:
        used, name = max((value / self.high, "motor speed"), (self.low / value, "gear mean input speed"))
        return Worst(name, used)


@pytest.mark.parametrize(
    ("least", "low", "high", "best", "ended_by"),
    [
        (70.0, 1.0, 1e4, 70.0, "end of the range"), (70.0, 20.0, 50.0, 50.0, "motor speed"),
        (70.0, 90.0, 300.0, 90.0, "motor speed"), (3.0, 1.0, 1e4, 10.0, "end of the range"),
        (4e3, 1.0, 1e4, 1000.0, "end of the range"), (4e3, 1.0, 700.0, 700.0, "motor speed"),
        (70.0, 2000.0, 2000.0, 1000.0, "gear mean input speed"),
    ],
)  # fmt: skip
def test_the_least_within_the_limits_of_a_ratio(
    least: float, low: float, high: float, best: float, ended_by: str
) -> None:
    found = Bowl(least, low, high).minimum()
    assert found.ratio == pytest.approx(best, rel=1e-6) and found.ended_by == ended_by
    if low < 1000.0:
        assert (found.low, found.high) == (pytest.approx(max(low, 10.0)), pytest.approx(min(high, 1000.0)))


def test_a_descent_ends_when_no_ratio_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two ratios that each depend on the other converge to their common solution; from the tip to the base."""
    order: list[int] = []

    class Search:
        def __init__(self, design: object, joint: int, ratios: dict[int, float]) -> None:
            order.append(joint)
            self.best = 50.0 * (ratios[1 - joint] / 80.0) ** 0.25

        def minimum(self) -> SimpleNamespace:
            return SimpleNamespace(ratio=self.best)

    monkeypatch.setattr(ratio_descent, "LineSearch", Search)
    design: Any = SimpleNamespace(families={0: None, 1: None}, middle_ratios=lambda: {0: 30.0, 1: 90.0})
    found, rounds = ratio_descent.coordinate_descent(design)
    same = 50.0 ** (4.0 / 3.0) / 80.0 ** (1.0 / 3.0)  # G = 50 (G / 80)^(1/4)
    assert found == {0: pytest.approx(same, rel=1e-5), 1: pytest.approx(same, rel=1e-5)}
    assert order == [1, 0] * rounds and 3 < rounds < ratio_descent.MAX_ROUNDS
    monkeypatch.setattr(ratio_descent, "RATIO_TOLERANCE", -1.0)
    assert ratio_descent.coordinate_descent(design)[1] == ratio_descent.MAX_ROUNDS


def test_usual_ranges_of_curves(make: SimpleNamespace) -> None:
    cycle = make.sines(2, duration=2.0)
    study = make.study(cycle, arm=make.planar_arm([0.3, 0.2], [1.0, 1.0]), payloads=(make.payload(4.0),), ambient=30.0)
    assert usual_span(study, Vary.PAYLOAD) == (2.0, 6.0) and usual_span(study, Vary.CYCLE_TIME) == (1.5, 3.0)
    assert usual_span(study, Vary.VOLTAGE) == (36.0, 60.0) and usual_span(study, Vary.AMBIENT) == (10.0, 50.0)
    assert all(low < high for low, high in itertools.pairwise(usual_span(study, Vary.PAYLOAD)))


@pytest.mark.parametrize("period", [0.0, 1e-3])
def test_step_responses_last_eight_time_constants(period: float) -> None:
    """At most 600 points, at samples of the servo; the lighter load has the gains of the heavier one."""
    axis, timing = ServoAxis(0.03, 50.0, 61e-7, 0.5), ServoTiming(6e3, period, 1)
    motor = Motor("m", 0.5, 0.03, inductance=1e-4)
    joint: Any = SimpleNamespace(name="door", drive=SimpleNamespace(motor=motor))
    found = loops._joint_loops(joint, axis, 0.3, timing)
    lasts, apart = 8.0 / found.design.position_gain, np.diff(found.time)
    assert found.time[0] == 0.0 and np.allclose(apart, apart[0]) and 150 <= len(found.time) <= 600
    assert lasts - 2.0 * apart[0] <= found.time[-1] <= lasts
    if period:
        assert apart[0] / period == pytest.approx(round(apart[0] / period))
    for one in (found.step, found.light_step):
        assert len(one) == len(found.time) and one[0] < 0.05 and one[-1] == pytest.approx(1.0, abs=0.02)
    for name in ("speed_gain", "integral_time", "position_gain"):
        assert getattr(found.light, name) == getattr(found.design, name)
    assert (found.current_gain, found.current_integral) == pytest.approx((0.6, 3e3))
    joint.drive.motor = replace(motor, inductance=None)
    bare = loops._joint_loops(joint, axis, 0.5, timing)
    assert bare.current_gain is None is bare.current_integral and bare.light is bare.design


def test_servo_axes_of_a_joint() -> None:
    """Heaviest load, spring damped by its largest inertia; nothing without an inertia."""
    motor, gear = Motor("m", 0.5, 0.03, rotor_inertia=5e-5), complete(Gear("g", -40.0, inertia=1e-5, stiffness_1=3e3))
    series = SimpleNamespace(load_inertia=np.array([0.4, 0.9, 0.6]))
    joint: Any = SimpleNamespace(series=series, drive=Drive(motor, gear, Friction(), None))
    axis, lightest = loops.servo_axes(joint, 0.05)  # type: ignore[misc]
    assert (axis.ratio, axis.load_inertia, lightest, axis.stiffness) == (-40.0, 0.9, 0.4, 3e3)
    assert axis.rotor_inertia == pytest.approx(6e-5)
    assert axis.spring_damping == pytest.approx(2.0 * 0.05 * math.sqrt(3e3 * (0.4 + 1600.0 * 6e-5)))
    series.load_inertia = np.array([0.4, 0.0])
    assert loops.servo_axes(joint, 0.05) is None
    series.load_inertia = None
    assert loops.servo_axes(joint, 0.05) is None


def answered(**used: float) -> Any:
    """An evaluation whose checks at ``joint`` have these utilisations."""
    checks = tuple(
        Check(name.replace("_", " "), share, 1.0, "-", share, Verdict.PASS, 1.5 if share else None)
        for name, share in used.items()
    )
    return SimpleNamespace(joints={"a": SimpleNamespace(checks=checks)}, shared=(), drives={})


@pytest.mark.parametrize(
    ("used", "limit", "said"),
    [
        (0.97, 4.0, ("a", "motor speed", 1.5)), (0.6, 4.0, ("a", "motor speed", 1.5)),
        (0.97, 2.0, ("j2", fastest.SPEED_LIMIT, 3.0)),
    ],
)  # fmt: skip
def test_what_limits_each_move(
    make: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, used: float, limit: float, said: tuple[str, str, float]
) -> None:
    """The check at an instant with the largest utilisation, or the arm's speed limit; else that of the whole cycle."""
    time = np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0])
    velocity = np.array([[0.0, 0.0], [1.0, -1.2], [0.0, 0.0], [0.5, -1.98], [0.5, 1.0], [0.0, 0.0]])
    cycle = replace(make.arm_cycle(time, velocity, velocity, velocity), segment=np.array([0, 0, 0, 1, 1, 1]),
                    segment_names=("there", "back"))  # fmt: skip
    study = SimpleNamespace(cycle=cycle, arm=SimpleNamespace(speed_limits=np.array([10.0, limit])))
    whole = SimpleNamespace(study=replace(make.study(cycle), arm=None), drives={})
    object.__setattr__(whole.study, "arm", study.arm)
    moves = [slice(0, 3), slice(2, 6)]
    best: Any = SimpleNamespace(evaluation=whole, moves=moves, edges=np.array([0.8, 0.7]), pace=np.array([0.9, 0.7]),
                                over_cycle=("b", "motor RMS current"))  # fmt: skip
    own = replace(cycle, time=2.0 * time)
    alone = answered(motor_peak_torque=0.5, motor_speed=used, gear_peak=0.2)
    monkeypatch.setattr(fastest, "evaluate", lambda one, drives: alone)
    first, second = fastest._move_times(own, moves, best)
    assert (first.name, first.start, first.before, first.after) == ("there", 0.0, 4.0, 2.0)
    assert (first.place, first.check) == ("b", "motor RMS current") and math.isnan(first.time)
    assert (second.name, second.start, second.before, second.after) == ("back", 2.0, 6.0, 3.0)
    assert (second.place, second.check, second.time) == said
