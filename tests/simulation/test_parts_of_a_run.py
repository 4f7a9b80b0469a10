"""What is said of a run and kept of it, from rows and engines made by hand: energies, ends, warnings, advice, words."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
import pytest

import drivetrain as dt
from drivetrain.drive.motor import copper_coefficient
from drivetrain.drive.thermal.thermal_network import ThermalNetwork
from drivetrain.errors import InputError
from drivetrain.simulation import run as running
from drivetrain.simulation.cost_results import Change, JointDecision
from drivetrain.simulation.engines.adaptive_step import AdaptiveStep
from drivetrain.simulation.engines.engine import Engine, Outcome, RunOptions
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.planning.plan import Layout, Plan, energy_of, plan
from drivetrain.simulation.recording import Event, Recording, Series, TableSeries
from drivetrain.simulation.run import simulate
from drivetrain.simulation.warnings import warnings

MOTOR = dt.Motor("m", 0.3, 0.03, max_winding_temperature=155.0)
NETWORK = ThermalNetwork(2.0, 3.0, 10.0, 200.0, 25.0)


def heated(duration: float = 1.0, **more: Any) -> Plan:
    effects = [dt.GivenCurrent([0.0], [1.0]), dt.MotorCurrent(MOTOR), dt.WindingHeat(NETWORK), *more.get("more", ())]
    return plan(dt.joint_scene(1.0, effects, duration))


def rows_of(done: Plan, time: Any, **columns: Any) -> Any:
    """Output rows with some columns of the joint; all others are zero, temperatures 25 C."""
    rows = np.zeros((len(time), 1 + len(done.layout.columns)))
    rows[:, 0] = time
    for name, (column, unit) in done.layout.recorded.items():
        rows[:, column] = 25.0 if unit == "C" else 0.0
        if name.removeprefix("joint.") in columns:
            rows[:, column] = columns[name.removeprefix("joint.")]
    return rows


# --- energies


def test_a_balance_is_what_is_stored_less_what_was_supplied() -> None:
    rng = np.random.default_rng(3)
    rows = rng.normal(size=(6, 8))
    recorded = {name: (k, "J") for k, name in enumerate(("a", "b", "c", "x_energy", "y_energy", "z_energy"), 2)}
    layout = Layout((), recorded, ("a", "b", "c"), (("x_energy", 1.0), ("y_energy", -1.0), ("z_energy", -1.0)))
    total, left, passed, largest = layout.energies(rows)
    np.testing.assert_allclose(total, rows[:, 2:5].sum(axis=1), rtol=1e-12)
    np.testing.assert_allclose(left, rows[:, 2:5].sum(axis=1) - rows[:, 5] + rows[:, 6] + rows[:, 7], rtol=1e-12)
    assert passed == max(np.ptp(rows[:, k]) for k in range(2, 8)) and largest == np.abs(rows[:, 2:5]).max()
    for k in range(2, 8):  # whichever has the largest range
        wide = rows.copy()
        wide[0, k] = -50.0
        assert layout.energies(wide)[2] == np.ptp(wide[:, k])
    assert not any(np.any(values) for values in layout.energies(0.0 * rows))
    alone = replace(layout, flows=())
    np.testing.assert_allclose(alone.energies(rows)[1], total, rtol=1e-12)
    small = alone.energies(1e-3 * rows)
    assert small[2] == pytest.approx(1e-3 * max(np.ptp(rows[:, k]) for k in range(2, 5)), rel=1e-12)
    assert energy_of("elbow.copper_power") == "elbow.copper_energy" and energy_of("elbow.heat") == "elbow.heat_energy"


def test_columns_of_a_plan_are_states_signals_and_energies_in_order() -> None:
    done = heated()
    layout, memory = done.layout, done.memory
    names = [name for name, _ in layout.columns]
    assert names[: len(memory.states)] == list(memory.states)
    assert names[len(names) - len(memory.powers) :] == [energy_of(name) for name in memory.powers]
    assert all(names.index(name) == column - 1 for name, (column, _) in layout.recorded.items())
    flows = dict(layout.flows)
    assert set(flows) == {energy_of(name) for name in done.signals.powers}
    sources = {name for name, sign in flows.items() if sign == 1.0}
    assert sources == {energy_of(name) for name, role in done.signals.powers.items() if role.name == "SOURCE"}


# --- ends


@pytest.mark.parametrize("value", [math.nan, 1.1e30, -1.1e30, math.inf])
def test_rows_end_before_the_first_that_is_no_number(value: float) -> None:
    done = heated()
    rows = rows_of(done, np.arange(5.0), position=0.1, winding_temperature=80.0)
    column = done.layout.recorded["joint.winding_temperature"][0]
    assert running._finite_rows(done, Outcome(rows, {}))[0] is rows
    rows[3, column] = value
    rows[4, 1] = value
    kept, stopped = running._finite_rows(done, Outcome(rows, {}))
    assert kept.shape == (3, rows.shape[1]) and stopped is not None
    assert (stopped.time, stopped.name) == (3.0, "diverged")
    assert stopped.detail.startswith("joint.winding_temperature grows beyond all bounds")
    earlier = Event(2.5, "no solution", "why")
    assert running._finite_rows(done, Outcome(rows, {}, stopped_by=earlier))[1] is earlier
    again = running._finite_rows(done, Outcome(rows, {}, stopped_by=Event(2.5, "diverged", "why")))[1]
    assert again == stopped
    with pytest.raises(InputError) as told:
        running._finite_rows(done, Outcome(rows[3:], {}))
    assert told.value.faults[0].place == "joint.winding_temperature"


def test_the_largest_state_is_named_not_a_loss_that_grows_with_its_square() -> None:
    done = heated()
    rows = rows_of(done, np.arange(3.0), position=3.0, speed=1e20)
    rows[2, done.layout.recorded["joint.copper_loss"][0]] = 1e40
    kept, stopped = running._finite_rows(done, Outcome(rows, {}))
    assert len(kept) == 2 and stopped is not None and stopped.detail.startswith("joint.speed grows")


def test_limits_of_an_arm_are_looked_at_in_its_positions_only() -> None:
    base = dt.load_arm("planar-2r")
    arm = replace(base, lower=np.array([-1.0, -2.0]), upper=np.array([1.0, 0.5]))
    done = plan(dt.Scene(arm, {}, 1.0))
    rows = np.zeros((4, 1 + len(done.layout.columns)))
    rows[:, 0] = [0.0, 0.1, 0.2, 0.3]
    rows[:, 3:] = 9.0
    assert running._position_limit_events(done, rows) == ()
    for joint, value, side in ((0, 1.1, "upper"), (0, -1.1, "lower"), (1, 0.6, "upper"), (1, -2.1, "lower")):
        moved = rows.copy()
        moved[2, 1 + joint] = value
        (event,) = running._position_limit_events(done, moved)
        assert event.time == 0.2 and event.detail.startswith(f"{arm.joint_names[joint]} passes its {side} limit")
    assert running._position_limit_events(heated(), rows_of(heated(), [0.0], position=99.0)) == ()


@pytest.mark.parametrize(
    ("given", "place"),
    [
        ({"duration": 0.0}, "duration"), ({"duration": "long"}, "duration"), ({"duration": -1.0}, "duration"),
        ({"interval": 0.0}, "interval"),
        ({"interval": 0.9e-8}, "interval"), ({"start": "rest"}, "start"), ({"start": 3}, "start"),
        ({"solver": 3}, "solver"), ({"resume": 3}, "resume"), ({"duration": math.nan}, "duration"),
    ],
)  # fmt: skip
def test_what_simulate_refuses(given: dict[str, Any], place: str) -> None:
    with pytest.raises(InputError) as told:
        simulate(heated(), **given)
    assert told.value.faults[0].place == place


@dataclass(frozen=True)
class Rows(Engine):
    """An engine that returns what it is given, and notes how it was called."""

    outcome: Callable[[Plan], Outcome]
    calls: ClassVar[list[tuple[Plan, RunOptions]]] = []

    def run(self, plan: Plan, options: RunOptions) -> Outcome:
        self.calls.append((plan, options))
        return self.outcome(plan)


def test_a_recording_is_made_of_rows() -> None:
    """Balance from the first row on, events in the order of time, what was told of the start; of a resumed run less."""
    done = heated(2.0)
    time = np.array([0.0, 0.5, 1.0])

    def outcome(done: Plan) -> Outcome:
        rows = rows_of(done, time, position=[0.0, 0.1, 0.2], winding_temperature=[25.0, 160.0, 170.0])
        rows[:, done.layout.recorded["scene.kinetic_energy"][0]] = [5.0, 6.0, 7.0]
        rows[:, done.layout.recorded[done.layout.flows[0][0]][0]] = [1.0, 2.0, 3.5]
        return Outcome(rows, {"steps": 7}, (Event(0.2, "a", "b"),), kept={"numbers": np.array(3.0)})

    sign = done.layout.flows[0][1]
    Rows.calls.clear()
    found = simulate(done, solver=Rows(outcome), interval=0.5, duration=1.0)
    assert Rows.calls[0][0].scene.duration == 1.0 and Rows.calls[0][1].interval == 0.5
    np.testing.assert_array_equal(found.time, time)
    np.testing.assert_allclose(found["stored_energy"], [5.0, 6.0, 7.0])
    np.testing.assert_allclose(found["energy_error"], [0.0, 1.0 - sign, 2.0 - 2.5 * sign])
    assert [event.time for event in found.events] == sorted(event.time for event in found.events)
    names = [event.name for event in found.events]
    assert "a" in names and "winding" in names and "energy" in names
    assert found.about["start"].startswith("equilibrium") and found.about["duration"] == "1 s"
    assert found.kept["balance"] == pytest.approx(5.0 - sign * 1.0) and found.kept["numbers"] == 3.0
    before = replace(found, kept={"balance": np.array(2.0)})
    rest = simulate(done, solver=Rows(outcome), interval=0.5, resume=before)
    np.testing.assert_allclose(rest["energy_error"], np.array([5.0, 6.0, 7.0]) - sign * np.array([1.0, 2.0, 3.5]) - 2.0)
    assert "start" not in rest.about and Rows.calls[1][1].resume == before.kept
    with pytest.raises(InputError, match="start"):
        simulate(done, solver=Rows(outcome), resume=before, start={"joint.speed": 1.0})
    series = {"x": Series("m", np.array([1.0, 2.0]))}
    other = simulate(done, solver=Rows(lambda done: Outcome(np.zeros((0, 0)), {}, times=np.arange(2.0), series=series)))
    np.testing.assert_array_equal(other["x"], [1.0, 2.0])


# --- warnings


@pytest.mark.parametrize("current, told", [(0.99, False), (1.01, True)])
def test_a_run_whose_mean_heat_no_temperature_balances(current: float, told: bool) -> None:
    """The mean of the squared current counts, over uneven rows, and only of a winding that still warms up."""
    limit = math.sqrt(1.0 / (copper_coefficient(25.0) * 0.3 * 5.0))
    time = np.array([1.0, 1.2, 2.0, 3.0])
    squares = np.array([4.0, 0.0, 1.0, 2.0])
    mean = sum(0.5 * (b - a) * (x + y) for (a, b), (x, y) in zip(pairwise(time), pairwise(squares), strict=True)) / 2.0
    done = heated()
    columns = {"current": current * limit * np.sqrt(squares / mean)}
    warm = rows_of(done, time, **columns, winding_temperature=[25.0, 30.0, 29.0, 31.0])
    found = [event for event in warnings(done, FixedStep(), warm) if event.name == "runaway"]
    assert bool(found) == told and all(event.time == 3.0 for event in found)
    cools = rows_of(done, time, **columns, winding_temperature=[35.0, 30.0, 29.0, 31.0])
    assert not [event for event in warnings(done, FixedStep(), cools) if event.name == "runaway"]
    one = rows_of(done, [2.0], current=current * limit, winding_temperature=31.0)
    assert not [event for event in warnings(done, FixedStep(), one) if event.name == "runaway"]


@pytest.mark.parametrize(
    ("name", "kind", "limit"), [("winding_temperature", "winding", 155.0), ("housing_temperature", "magnets", 150.0)]
)
def test_the_first_row_above_a_limit_is_told(name: str, kind: str, limit: float) -> None:
    done = heated()
    rows = rows_of(done, np.arange(4.0), **{name: [25.0, limit, limit + 0.1, limit + 7.0]})
    (event,) = warnings(done, FixedStep(), rows)
    assert (event.time, event.name) == (2.0, kind) and f"{limit + 7.0:.4g}" in event.detail
    assert warnings(done, FixedStep(), rows[:2]) == ()
    without = plan(dt.joint_scene(1.0, [one for one in done.scene.effects["joint"] if type(one) is not dt.WindingHeat],
                                  1.0))  # fmt: skip
    assert warnings(without, FixedStep(), np.full((2, 1 + len(without.layout.columns)), 900.0)) == ()


@pytest.mark.parametrize("lasts, duration", [(0.2, 1.0), (0.2, 0.1)])
def test_a_motion_takes_ten_steps_at_least(lasts: float, duration: float) -> None:
    still = dt.Motion("still", ("joint",), np.array([3.0, 3.0 + lasts]), *(np.zeros((2, 1)) for _ in range(3)))
    done = plan(dt.joint_scene(1.0, [dt.CommandedMotion(still)], duration))
    rows, shorter = np.zeros((1, 1 + len(done.layout.columns))), min(lasts, duration)
    assert not warnings(done, FixedStep(0.0999 * shorter), rows)
    (event,) = warnings(done, FixedStep(0.1001 * shorter), rows)
    assert (event.time, event.name) == (0.0, "step") and f"use {shorter / 100.0:.2g} s" in event.detail
    assert not warnings(done, AdaptiveStep(), rows)


@pytest.mark.parametrize("side, ratio", [("joint", 50.0), ("motor", 50.0), ("motor", -0.5)])
def test_bristles_too_stiff_for_a_step_or_a_tolerance(side: Any, ratio: float) -> None:
    """The load on its bristles within a step turns by three radians at most; and deflection over tolerance."""
    inertia = 2.0 + 1e-3 * ratio**2
    moved = inertia / (ratio**2 if side == "motor" else 1.0)
    for phase, told in ((2.95, False), (3.05, True)):
        stiffness = moved * (phase / 1e-3) ** 2
        law = dt.LuGreFriction(stiffness, 1.0, 1.5, side=side)
        done = plan(dt.joint_scene(2.0, [law, dt.FullRotor(1e-3, ratio)], 1.0))
        rows = np.zeros((1, 1 + len(done.layout.columns)))
        found = warnings(done, FixedStep(1e-3), rows)
        assert [event.name for event in found] == ["LuGre stiffness"] * told
        assert not told or f"{phase / 1e-3:.3g} rad/s" in found[0].detail
        assert not warnings(done, FixedStep(1e-4), rows)
        tolerance = AdaptiveStep().tolerance
        for share, seen in ((0.99, True), (1.01, False)):
            law = dt.LuGreFriction(1.0 / (share * 1e-6 * tolerance), 1.0, 1.5, side=side)
            done = plan(dt.joint_scene(2.0, [law, dt.FullRotor(1e-3, ratio)], 1.0))
            assert bool(warnings(done, AdaptiveStep(), rows)) == seen


# --- steps that are too long


@dataclass(frozen=True)
class Coarse(FixedStep):
    """A fixed step whose speed is off by a law of the step; stops early below some step."""

    off: Callable[[float], float] = lambda step: step
    ends: float = 0.0
    ran: ClassVar[list[tuple[float, RunOptions]]] = []

    def run(self, plan: Plan, options: RunOptions) -> Outcome:
        self.ran.append((self.step, options))
        time = np.linspace(0.0, 1.0, 11)
        rows = rows_of(plan, time, speed=(1.0 + self.off(self.step)) * np.sin(time))
        return Outcome(rows, {}, stopped_by=Event(0.5, "x", "y") if self.step < self.ends else None)

    def finer(self, period: float = math.inf) -> Coarse:
        return replace(self, step=0.5 * min(self.step, period))


def told_of(engine: Coarse, done: Plan | None = None, interval: float = 0.1) -> tuple[Any, list[Any]]:
    Coarse.ran.clear()
    done = done or plan(dt.joint_scene(1.0, [], 1.0))
    rows = engine.run(done, RunOptions(interval)).rows
    recording = Recording(rows[:, 0], TableSeries(rows, done.layout.recorded, {}))
    events = running._step_events(done, engine, rows, recording, {"joint.speed": 2.0}, interval)
    return events, Coarse.ran[1:]


def test_steps_are_halved_until_they_are_short_enough() -> None:
    """Half a step changes by half its error: 12 steps of 1 ms would be off by 12 %, so 0.125 ms are enough."""
    ((event,), ran) = told_of(Coarse(1e-3, off=lambda step: 120.0 * step))
    assert event.name == "step" and event.time == 1.0
    assert "half the step changes joint.speed (peak) by 5.7 %: a step of 0.001 s" in event.detail
    assert event.detail.endswith("a step of 0.000125 s is short enough: half of it changes none by 1 %")
    assert [step for step, _ in ran] == [1e-3, 5e-4, 2.5e-4, 1.25e-4, 6.25e-5]
    assert [options.interval for _, options in ran] == [1.0 / 2e4] * 5
    assert all(options.start == {"joint.speed": 2.0} for _, options in ran)
    for rows, repeated in ((1e-3, []), (1.01e-3, [1e-3])):  # the run is repeated if its rows leave out steps
        events, ran = told_of(Coarse(1e-3, off=lambda step: 19.0 * step), interval=rows)
        assert events == () and [step for step, _ in ran] == [*repeated, 5e-4]
    assert told_of(Coarse(1e-3, off=lambda step: 120.0 * step), interval=1e-6)[1][0][1].interval == 1e-6


def test_steps_that_no_halving_makes_short_enough() -> None:
    """Down to 50 000 steps, or to a step that ends early; a first step that ends early says nothing."""
    wild = {1e-3 / 2**k: 0.1 * (-1) ** k for k in range(9)}
    ((event,), ran) = told_of(Coarse(1e-3, off=lambda step: wild[step]))
    assert event.detail.endswith("; try AdaptiveStep")
    assert ran[-1][0] == 1e-3 / 64.0 and len(ran) == 7  # 32 000 steps of the last but one, 64 000 of the last
    ((event,), ran) = told_of(Coarse(1e-3, off=lambda step: wild[step], ends=2e-4))
    assert event.detail.endswith("; try AdaptiveStep") and ran[-1][0] == 1.25e-4
    assert told_of(Coarse(1e-3, off=lambda step: wild[step], ends=9e-4))[0] == ()


def test_runs_of_many_steps_are_not_checked() -> None:
    still = dt.Motion("still", ("joint",), np.array([0.0, 1.0]), *(np.zeros((2, 1)) for _ in range(3)))
    motor, loop = dt.Motor("m", 0.3, 0.05), [dt.MotorCurrent(dt.Motor("m", 0.3, 0.05)), dt.Encoder()]
    assert motor.resistance == 0.3

    def sampled(period: float, duration: float = 1.0) -> Plan:
        servo = dt.SampledCascade(20.0, 0.5, every=period, delay=0)
        return plan(dt.joint_scene(1.0, [*loop, servo, dt.FullRotor(1e-3), dt.CommandedMotion(still)], duration))

    off = {"off": lambda step: 0.0}
    assert not told_of(Coarse(1.0 / 50001.0, **off))[1] and told_of(Coarse(1.0 / 49999.0, **off))[1]
    assert not told_of(Coarse(1e-3, **off), sampled(1.0 / 50001.0))[1]
    assert [step for step, _ in told_of(Coarse(1e-3, **off), sampled(1e-4))[1]] == [1e-3, 5e-5]
    # Within a step of 1 ms half of what samples leave of it is tried.
    ran = told_of(Coarse(1e-3, off=lambda step: 5e3 * step), sampled(1e-4))[1]
    assert [step for step, _ in ran][:3] == [1e-3, 5e-5, 2.5e-5]


class Sagging:
    """Stands for both engines: a bus whose voltage is off by a multiple of the fixed step."""

    ran: ClassVar[list[Any]] = []
    error = 10.0  # V/s
    floor, ends = 40.0, False

    def __init__(self, step: float = 0.0, most_steps: int = 0) -> None:
        self.step, self.most_steps = step, most_steps

    def run(self, plan: Plan, options: RunOptions) -> Outcome:
        self.ran.append((self.step, self.most_steps, options))
        time = np.linspace(0.0, 1.0, 6)
        rows = rows_of(plan, time)
        shape = np.array([0.0, 0.2, 1.0, 0.5, 0.0, 0.0])
        volts = 48.0 - (48.0 - self.floor) * shape + self.error * self.step * np.array([0.0, 0.1, 0.2, 1.0, 0.0, 0.0])
        rows[:, plan.layout.recorded["scene.bus_voltage"][0]] = volts
        return Outcome(rows, {}, stopped_by=Event(0.5, "x", "y") if self.ends else None)


def bus_event(monkeypatch: pytest.MonkeyPatch, step: float, duration: float = 1.0, **changed: Any) -> tuple[Any, Any]:
    effects = [dt.GivenCurrent([0.0], [1.0]), dt.MotorCurrent(MOTOR), dt.SupplyBus(48.0, 1e-3, 100.0)]
    done = plan(dt.joint_scene(1.0, effects, duration))
    engine = type("Sagging", (Sagging,), {"ran": [], **changed})
    monkeypatch.setattr(running, "AdaptiveStep", engine)
    monkeypatch.setattr(running, "FixedStep", engine)
    rows = engine(step).run(done, RunOptions(0.1)).rows
    recording = Recording(rows[:, 0], TableSeries(rows, done.layout.recorded, {}))
    return running._bus_event(engine(step), recording, done, {"joint.speed": 2.0}), engine.ran[1:]


def test_a_bus_that_sinks_is_compared_with_a_run_of_another_engine(monkeypatch: pytest.MonkeyPatch) -> None:
    """In proportion to the step: at 10 V/s, 48 mV are left after 4.8 ms, of which nine tenths are taken."""
    (event,), ran = bus_event(monkeypatch, 0.02)
    assert (event.name, event.time) == ("bus", pytest.approx(0.6))
    assert event.detail == "the bus sinks to 40 V and its voltage is off by 0.42 %: a step of 0.0043 s holds 0.1 %"
    assert [(step, most) for step, most, _ in ran] == [(0.0, 100_000), (0.0043, 0)]
    assert all(one.interval == pytest.approx(1.0 / 2e4) and one.start == {"joint.speed": 2.0} for *_, one in ran)
    # At most half the step, however little is off.
    (event,), ran = bus_event(monkeypatch, 0.005)
    assert [step for step, *_ in ran[1:]] == [0.0025] and "a step of 0.0025 s holds" in event.detail
    for step, changed in ((0.0047, {}), (0.02, {"floor": 47.6}), (0.02, {"ends": True})):
        assert bus_event(monkeypatch, step, **changed)[0] == ()
    assert bus_event(monkeypatch, 0.02, floor=47.4)[0]
    # Up to 400 000 steps.
    (event,), ran = bus_event(monkeypatch, 1.2e-5, error=1.8e4)
    assert event.detail.endswith("off by 0.45 %: try AdaptiveStep") and len(ran) == 1
    (event,), ran = bus_event(monkeypatch, 1.2e-5, error=1.6e4)
    assert event.detail.endswith("a step of 2.7e-06 s holds 0.1 %")


# --- results about accuracy


def test_the_largest_change_leads() -> None:
    change = Change(0.1, -0.2, 0.05, -0.15, tip=-3e-4)
    assert change.shares == (0.1, -0.2, 0.05, -0.15)
    assert (change.largest(1e-2), change.leading(1e-2)) == (0.2, "RMS current")
    assert (change.largest(1e-3), change.leading(1e-3)) == (pytest.approx(0.3), "tip")
    assert (change.largest(0.0), change.leading(0.0)) == (0.2, "RMS current")
    unknown = replace(change, rms_current=math.nan)
    assert (unknown.largest(1e-2), unknown.leading(1e-2)) == (0.15, "winding temperature")
    for name, words in (("peak_current", "peak current"), ("rms_torque", "RMS torque")):
        assert replace(change, **{name: -0.9}).leading(1e-3) == words
    assert JointDecision(1.0, 2.0, 3.0, 80.0, 25.0, 0.1).rise == 55.0


# --- recordings


def recorded() -> Recording:
    time = np.array([0.5, 1.0, 2.25])
    series = {
        "a.position": Series("rad", np.array([1.0, 3.0, 2.0])), "b.position": Series("m", np.array([5.0, 4.0, 6.0])),
        "a.speed": Series("rad/s", np.array([7.0, 8.0, 9.0])), "b.current": Series("A", np.array([1.0, -1.0, 0.0])),
    }  # fmt: skip
    return Recording(time, series, stopped_by=Event(2.25, "diverged", "why"))


def test_words_of_a_recording() -> None:
    run = recorded()
    assert repr(run) == "Recording(4 series, 3 instants, 1.75 s, stopped by diverged)"
    assert repr(replace(run, stopped_by=None)) == "Recording(4 series, 3 instants, 1.75 s)"
    empty = Recording(np.zeros(0), {"a": Series("m", np.zeros(0))})
    assert repr(empty) == "Recording(1 series, 0 instants, 0 s)" and "lowest" not in empty._repr_html_()
    table = run._repr_html_()
    assert all(word in table for word in ("lowest", "highest", "last", "a.speed"))
    [row] = [line for line in table.replace("\n", "").split("<tr") if "b.current" in line]
    assert [part.partition("<")[0] for part in row.split("<td>")[1:]] == ["A", "-1", "1", "0"]


def test_a_plot_has_the_series_that_are_asked_for() -> None:
    plt = pytest.importorskip("matplotlib.pyplot")
    run = recorded()
    for names, labels, words in (
        ((), ["a.position", "b.position"], "position [rad or m]"), (("speed",), ["a.speed"], "speed [rad/s]"),
        (("b.current",), ["b.current"], "current [A]"), (("a.position",), ["a.position"], "position [rad]"),
    ):  # fmt: skip
        ax = run.plot(*names)
        assert [line.get_label() for line in ax.lines] == labels and ax.get_ylabel() == words
        assert ax.get_xlabel() == "time [s]" and ax.get_legend() is not None
        for line in ax.lines:
            np.testing.assert_array_equal(line.get_xdata(), run.time)
            np.testing.assert_array_equal(line.get_ydata(), run[line.get_label()])
        plt.close(ax.figure)
    with pytest.raises(InputError, match="one unit"):
        run.plot("position", "speed")
    with pytest.raises(InputError, match="no series"):
        run.plot("spead")
