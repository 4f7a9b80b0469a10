"""Decision quantities, tolerances and the steps of a proof, written out once more for recordings made by hand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from sizing.conftest import planar_arm, sines, study

import drivetrain as dt
from drivetrain.accuracy import auto, costs, decision, study_run, verify
from drivetrain.accuracy.auto import Estimate, Limits
from drivetrain.accuracy.decision import Basis
from drivetrain.accuracy.inverse_forward import _compared
from drivetrain.accuracy.scenes import _with_slow_nodes, choices, without
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.drive.thermal.thermal_network import ThermalNetwork
from drivetrain.effects.gear.mesh_loss import MeshLoss
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.effects.motor.rotor import ReflectedRotor
from drivetrain.effects.motor.winding_heat import WindingHeat
from drivetrain.errors import Fault, InputError
from drivetrain.simulation.cost_results import Change, Choice, Decision, JointDecision
from drivetrain.simulation.engines.adaptive_step import AdaptiveStep
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.recording import Event, Recording, Series
from drivetrain.simulation.scene import Inertia, Scene
from drivetrain.solvers.solver import Rodas5P
from drivetrain.study.model import Safety
from drivetrain.study.parts.simulation import Simulation

JOINTS = ("joint_1", "joint_2")
ARM = Scene(dt.load_arm("planar-2r"), {}, 2.0)
ALONE = Scene(Inertia(1.0), {}, 2.0)


def recorded(time: np.ndarray, series: dict[str, np.ndarray], unit: str = "-") -> Recording:
    return Recording(time, {name: Series(unit, np.broadcast_to(one, time.shape)) for name, one in series.items()})


def noise(names: Sequence[str], what: Sequence[str], samples: int = 41) -> Recording:
    """Series of random numbers over 2 s, at times of random distances."""
    rng = np.random.default_rng(11)
    time = np.cumsum(rng.uniform(0.1, 1.0, samples))
    time = 2.0 * (time - time[0]) / (time[-1] - time[0])
    return recorded(time, {f"{name}.{one}": rng.normal(-0.5, size=samples) for name in names for one in what})


def tip(q: np.ndarray) -> np.ndarray:
    """Tip of two unit links, by their absolute angles."""
    first, second = q[:, 0], q[:, 0] + q[:, 1]
    return np.column_stack([np.cos(first) + np.cos(second), np.sin(first) + np.sin(second)])


def with_peak(name: str, current: float) -> Decision:
    return Decision({name: JointDecision(current, 1.0, 1.0, math.nan, math.nan, 0.0)}, 0.0)


def mean(values: np.ndarray, time: np.ndarray) -> float:
    return float(np.trapezoid(values, time) / (time[-1] - time[0]))


def test_decision_quantities_of_an_arm() -> None:
    run = noise(JOINTS, ("current", "mesh_torque", "position", "command_position"))
    found = decision.decision(run, ARM, Basis({}, {}))
    for name, joint in found.joints.items():
        current, torque = run[f"{name}.current"], run[f"{name}.mesh_torque"]
        assert joint.peak_current == np.abs(current).max() > current.max()  # of either sign
        assert joint.rms_current == pytest.approx(math.sqrt(mean(current**2, run.time)))
        assert joint.rms_torque == pytest.approx(math.sqrt(mean(torque**2, run.time)))
        assert joint.deviation == np.abs(run[f"{name}.position"] - run[f"{name}.command_position"]).max()
        assert math.isnan(joint.winding_temperature) and math.isnan(joint.rise)
    asked = ("position", "command_position")
    places = [tip(np.column_stack([run[f"{name}.{what}"] for name in JOINTS])) for what in asked]
    assert found.tip_deviation == pytest.approx(np.linalg.norm(places[0] - places[1], axis=1).max())
    travel = np.linalg.norm(places[1] - places[1][0], axis=1).max()
    assert decision.tip_travel(ARM, run) == pytest.approx(travel)
    free = recorded(run.time, {f"{name}.position": run[f"{name}.position"] for name in JOINTS})
    assert decision.tip_travel(ARM, free) == 0.0
    assert math.isnan(decision.decision(free, ARM, Basis({}, {})).tip_deviation)


def test_decision_quantities_of_one_joint_of_the_last_cycle() -> None:
    """Without an arm, deviation and travel are those of the joint."""
    run = noise(("joint",), ("current", "position", "command_position"))
    period = float(run.time[-1] - run.time[-11])
    found = decision.decision(run, ALONE, Basis({}, {}, period=period))
    last, current = slice(-11, None), run["joint.current"]
    assert found.joints["joint"].peak_current == np.abs(current[last]).max() < np.abs(current).max()
    assert found.joints["joint"].rms_current == pytest.approx(math.sqrt(mean(current[last] ** 2, run.time[last])))
    off = np.abs(run["joint.position"] - run["joint.command_position"])
    assert found.tip_deviation == found.joints["joint"].deviation == off[last].max() < off.max()
    assert decision.tip_travel(ALONE, run) == np.ptp(run["joint.command_position"])


def test_a_mix_is_judged_by_the_shares_of_its_parts() -> None:
    """The sample at the end of a part belongs to the next one, as that of a cycle does, which jumps there."""
    time = np.array([5.0, 5.2, 5.9, 6.0, 6.3, 7.0, 8.0, 8.5])
    current = np.array([1.0, -2.0, 3.0, 0.5, 7.0, 1.0, -4.0, 2.0])
    shares = (0.6, 0.3, 0.1)
    basis = Basis({}, {}, ends=(1.0, 2.0, 3.5), shares=shares)
    run = recorded(time, {"joint.current": current, "joint.position": np.zeros(8)})
    parts = (slice(0, 3), slice(3, 5), slice(5, 8))
    square = sum(share * mean(current[part] ** 2, time[part]) for share, part in zip(shares, parts, strict=True))
    assert basis.use(time).parts == list(parts)
    assert decision.decision(run, ALONE, basis).joints["joint"].rms_current == pytest.approx(math.sqrt(square))
    assert decision.mean_weights(time, basis.use(time)).sum() == pytest.approx(3.5)


@pytest.mark.parametrize("heated", [True, False])
def test_heat_of_a_constant_current(heated: bool) -> None:
    """The steady state: copper loss through both resistances, friction and the gear's share through the outer one.

    Drag of the gear is part of the motor's friction; only a share of it heats the motor.
    """
    inner, outer, ambient, current = 0.8, 1.5, 21.0, 3.0
    motor = Motor("m", 0.9, 0.05)
    network = ThermalNetwork(inner, outer, 40.0, 300.0, ambient)
    powers = {"motor_friction_power": 4.0, "motor_viscous_power": 2.0, "mesh_power": 10.0, "gear_drag_power": 3.0}
    time = np.linspace(0.0, 2.0, 21)
    run = recorded(time, {f"joint.{name}": value for name, value in powers.items()} | {"joint.current": current})
    basis = Basis({"joint": motor}, {"joint": WindingHeat(network, gear_heat=0.4, constant_loss=1.7)})
    found = decision._heat("joint", time, {name: one.values for name, one in run.series.items()}, basis, heated)
    lost = 1.7 + 4.0 + 2.0 + 0.4 * 10.0 + (0.4 - 1.0) * 3.0
    copper, slope = motor.resistance * current**2, 0.0
    if heated:  # the resistance is that of the winding's own temperature
        slope = 0.0039 / (1.0 + 0.0039 * (motor.reference_temperature - 25.0))
    path = inner + outer
    rise = (copper * path * (1.0 + slope * (ambient - motor.reference_temperature)) + lost * outer) / (
        1.0 - copper * path * slope
    )
    assert found is not None and found.peak_winding == pytest.approx(ambient + rise, rel=1e-9)
    assert found.magnet_temperature == pytest.approx(
        ambient + rise - inner * (rise - lost * outer) / path if heated else motor.reference_temperature
    )
    assert decision._heat("joint", time, {}, basis, heated) is None
    other = replace(basis, heats={})
    assert decision._heat("joint", time, {"joint.current": run["joint.current"]}, other, heated) is None


def test_changes_are_relative_to_the_full_scene() -> None:
    def one(*numbers: float, deviation: float) -> Decision:
        return Decision({"joint": JointDecision(*numbers, 20.0, 0.0)}, deviation)

    found = decision.change(one(-3.0, 2.5, 0.0, 60.0, deviation=3e-3), one(-4.0, 2.0, 0.0, 45.0, deviation=1e-3))
    assert (*found["joint"].shares, found["joint"].tip) == pytest.approx((0.25, 0.25, 0.0, 15.0 / 25.0, 2e-3))
    assert math.isnan(decision.change(one(1.0, 1.0, 1.0, 30.0, deviation=0.0),
                                      one(0.0, 1.0, 1.0, 30.0, deviation=0.0))["joint"].peak_current)  # fmt: skip


def test_checks_of_a_run_are_required_by_its_series() -> None:
    """Each with its factor of safety and the instant of its largest magnitude; unknown ones stay unknown."""
    safety = Safety(speed=1.1, peak_torque=1.3, voltage=1.4, rms=1.6, reserve=0.2)
    evaluation = dt.evaluate(study(sines(1), arm=planar_arm([0.3], [1.0]), safety=safety))
    run = noise(("j1",), ("current", "motor_speed", "voltage"))
    time, series = run.time, {name: 5.0 * one.values for name, one in run.series.items()}
    weights = np.full(len(time), 0.3)
    checks = {one.name: one for one in decision._checks(evaluation, "j1", (time, weights), series, None)}
    own = {one.name: one for one in evaluation.joints["j1"].checks}
    constant = dt.torque_constant(evaluation.joints["j1"].drive.motor, 25.0)
    for name, (factor, values) in {
        "motor speed": (1.1, series["j1.motor_speed"]), "motor voltage": (1.4, series["j1.voltage"]),
        "amplifier peak current": (1.3, series["j1.current"]), "motor peak current": (1.3, series["j1.current"]),
        "motor peak torque": (1.3, float(constant) * series["j1.current"]),
    }.items():  # fmt: skip
        if name in own and own[name].available is not None:
            worst = int(np.abs(values).argmax())
            found = checks[name]
            assert found.required == pytest.approx(factor * abs(values[worst])) and found.time == time[worst]
            assert found.utilisation == pytest.approx(found.required / found.available)
            limits = ((0.8, dt.Verdict.PASS), (1.0, dt.Verdict.MARGINAL), (math.inf, dt.Verdict.FAIL))
            assert found.verdict is next(verdict for limit, verdict in limits if found.utilisation <= limit)
    effective = checks["motor RMS current"]
    assert effective.required == pytest.approx(1.6 * np.sqrt(np.mean(series["j1.current"] ** 2)))
    assert effective.time is None
    known = SimpleNamespace(runaway=False, magnet_temperature=90.0, peak_winding=75.0, peak_time=0.7)
    hot = {one.name: one for one in decision._checks(evaluation, "j1", (time, weights), series, known)}  # type: ignore[arg-type]
    assert (hot["winding temperature"].required, hot["winding temperature"].time) == (75.0, 0.7)
    assert hot["winding temperature"].utilisation == pytest.approx((75.0 - 25.0) / (125.0 - 25.0))
    known.runaway = True
    lost = {one.name: one for one in decision._checks(evaluation, "j1", (time, weights), series, known)}  # type: ignore[arg-type]
    assert lost["winding temperature"].required == math.inf == lost["winding temperature"].utilisation
    assert lost["winding temperature"].verdict is dt.Verdict.FAIL
    assert lost["winding temperature"].remark == "thermal runaway"


@pytest.mark.parametrize("parts", [1, 2])
def test_remarks_of_a_mix_lose_the_part_that_decides_in_sizing(parts: int) -> None:
    speed = dt.Check("motor speed", 3.0, 9.0, "rad/s", 0.3, dt.Verdict.PASS, 0.4, remark="carton; printed")
    rms = replace(speed, name="motor RMS current", time=None)
    cycle, drive = SimpleNamespace(parts=[slice(0, 1)] * parts), SimpleNamespace(motor=Motor("m", 0.3, 0.05))
    joints = {"a": SimpleNamespace(checks=(speed, rms), drive=drive)}
    told = SimpleNamespace(study=SimpleNamespace(cycle=cycle, safety=Safety(), ambient=20.0), joints=joints)
    series, time = {"a.current": np.array([1.0, -2.0]), "a.motor_speed": np.array([-4.0, 3.0])}, np.array([0.0, 1.0])
    found = decision._checks(told, "a", (time, np.ones(2)), series, None)  # type: ignore[arg-type]
    assert [one.remark for one in found] == ["carton; printed" if parts == 1 else "printed", "carton; printed"]
    assert [(one.required, one.time) for one in found] == [(4.0, 0.0), (pytest.approx(math.sqrt(2.5)), None)]


def test_used_tolerances() -> None:
    """Of each quantity of each joint, then of the tip, of which the largest counts; unknown ones use nothing."""
    one = Estimate(
        Choice("x", "a"), {"a": Change(0.01, 0.02, 0.0, math.nan, 3e-4), "b": Change(0.0, 0.0, 0.03, 0.005, 5e-4)},
        True, "",
    )  # fmt: skip
    used = auto._used_tolerances(one, Limits(0.02, 1e-3), ("a", "b"))
    np.testing.assert_allclose(used, [0.5, 1.0, 0.0, 0.0, 0.0, 0.0, 1.5, 0.25, 0.5])
    assert auto._used_tolerances(one, Limits(0.02, 0.0), ("a",))[-1] == math.inf
    still = replace(one, changes={"a": Change(0.01)})
    assert auto._used_tolerances(still, Limits(0.02, 0.0), ("a",))[-1] == 0.0


def test_unresolved_shares_count_in_the_bound_alone() -> None:
    one = Estimate(Choice("x", "a"), {"a": Change(0.01, 0.02), "b": Change(0.05)}, True, "", {"a": 0.004})
    assert one.bound == {"a": Change(0.014, 0.02), "b": Change(0.05)}


def test_the_effect_that_is_restored() -> None:
    """Of those left out, that with the largest share of its tolerance at the joint that changed most."""

    def told(kind: str, joint: str, share: float) -> Estimate:
        return Estimate(Choice(kind, joint), {joint: Change(rms_current=share)}, True, "")

    left = [told("small", "b", 1e-3), told("large", "b", 2e-3), told("elsewhere", "a", 9e-3), told("kept", "b", 8e-3)]
    dropped = [one.choice for one in left[:3]]
    proof = SimpleNamespace(measured={"a": Change(0.01, tip=2e-3), "b": Change(0.011, tip=2e-3)})
    limits = Limits(0.01, 1.0)
    assert auto._effect_to_restore(left, dropped, limits, proof).kind == "large"  # type: ignore[arg-type]
    assert auto._effect_to_restore(left, dropped[2:], limits, proof).kind == "elsewhere"  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("exact", "slope", "steps", "beyond", "proven", "said"),
    [
        (0.005, 0.1, 1, False, True, "within"),  # error at once below a fifth of the tolerance
        (0.005, 1.0, 2, False, True, "within"),
        (0.02, 1.0, 1, True, False, "beyond the tolerance"),  # below a fifth of the measured change
        (0.0, 30.0, 3, True, False, "the step itself"),
        (0.0089, 0.8, 1, True, False, "beyond the tolerance"),  # only with its numerical error
    ],
)
def test_a_proof_halves_its_step_until_errors_are_small(
    monkeypatch: pytest.MonkeyPatch, exact: float, slope: float, steps: int, beyond: bool, proven: bool, said: str
) -> None:
    """A change that depends linearly on the step: its error is the change of the last halving."""
    tolerance, first = 0.01, 4e-3
    asked: list[float] = []

    def both(plans: object, scenes: object, basis: object, step: float) -> object:
        asked.append(step)
        size = 2.0 * (1.0 + exact + slope * step)
        ends = [
            Decision({"joint": JointDecision(peak, 1.0, 1.0, math.nan, math.nan, 0.0)}, 0.0) for peak in (size, 2.0)
        ]
        return tuple(ends), 5e-4

    monkeypatch.setattr(auto, "_run_both", both)
    monkeypatch.setattr(auto, "plan", lambda scene: scene)
    monkeypatch.setattr(auto, "without", lambda scene, gone: scene)
    monkeypatch.setattr(auto, "seconds", lambda plans: [0.3, 0.9])
    found = auto.proved(ALONE, ALONE, Basis({}, {}), {}, tolerance, 1e-3, first)
    assert asked == [first / 2**k for k in range(steps + 1)] and found.steps == asked[-1]
    assert found.measured["joint"].peak_current == pytest.approx(exact + slope * asked[-1])
    assert found.numerical["joint"].peak_current == pytest.approx(slope * asked[-1])
    assert (found.beyond, found.proven, found.audit) == (beyond, proven, 5e-4) and said in found.why
    assert (found.seconds_chosen, found.seconds_full) == (0.3, 0.9)
    assert found.chosen.joints["joint"].peak_current > found.full.joints["joint"].peak_current == 2.0
    assert "audit" in auto._proof_text(True, True, 2e-3, 0.0) and "audit" in auto._proof_text(True, True, math.nan, 0.0)


def test_effects_are_restored_one_by_one_until_it_is_proven(monkeypatch: pytest.MonkeyPatch) -> None:
    """The sum of all bounds is to be proven; the tolerance of the tip is the relative one times its travel."""
    listed = [
        Estimate(Choice("Cogging", "joint"), {"joint": Change(3e-3, tip=1e-4)}, True, "a run", {"joint": 1e-3}),
        Estimate(Choice("MeshLoss", "joint"), {"joint": Change(1e-3, 2e-3)}, True, "a run"),
        Estimate(Choice("Encoder", "joint"), {"joint": Change(5e-3)}, False, "it stops"),
    ]
    asked, told = [], []

    def proved(scene: object, kept: object, basis: object, estimate: object, *more: float) -> SimpleNamespace:
        asked.append((kept, estimate, *more))
        done = len(asked) == 2
        return SimpleNamespace(proven=done, beyond=not done, measured={"joint": Change(0.02)})

    monkeypatch.setattr(auto, "estimates", lambda *given: tuple(listed))
    monkeypatch.setattr(auto, "tip_travel", lambda scene, run: 0.7)
    monkeypatch.setattr(auto, "run_to_end", lambda ready, engine: engine.step)
    monkeypatch.setattr(auto, "plan", lambda scene: scene)
    monkeypatch.setattr(auto, "without", lambda scene, gone: frozenset(gone))
    monkeypatch.setattr(auto, "proved", proved)
    found = auto.choose_effects(ALONE, Basis({}, {}), tolerance=0.02, step=2e-4, progress=lambda *one: told.append(one))
    cogging, mesh = listed[0].choice, listed[1].choice
    both, one = Change(5e-3, 2e-3, tip=1e-4), Change(1e-3, 2e-3)
    assert [row[0] for row in asked] == [{cogging, mesh}, {mesh}] and found.scene == {mesh}
    assert [row[1] for row in asked] == [{"joint": both}, {"joint": one}]
    assert all(row[2:] == (0.02, pytest.approx(0.014), 2e-4) for row in asked)
    assert found.tip_tolerance == pytest.approx(0.014) and found.restored == (cogging,)
    assert [(row.label, row.kept, row.valid, row.cost) for row in found.effects] == [
        ("cogging", True, True, 1.0), ("mesh loss", False, True, 3.0), ("steps of the encoder", True, False, 0.5),
    ]  # fmt: skip
    assert found.effects[0].estimate == Change(4e-3, tip=1e-4)
    assert told == [(0, 1, "proving that 2 effects may be omitted"), (0, 1, "proving that 1 effects may be omitted"),
                    (1, 1, "done")]  # fmt: skip
    assert auto.choose_effects(ALONE, Basis({}, {}), tip_tolerance=0.5).tip_tolerance == 0.5


def test_error_of_the_energy_balance() -> None:
    """Its range over the largest range of an energy; powers and temperatures are none."""
    time = np.linspace(0.0, 1.0, 5)
    values = {"energy_error": [0.1, 0.0, 0.3, 0.1, 0.1], "a.motor_energy": [-2.0, 0.0, 4.0, 1.0, 1.0],
              "b.mesh_energy": [0.0, 1.0, 2.0, 3.0, 3.0]}  # fmt: skip
    run = recorded(time, {name: np.array(one) for name, one in values.items()}, "J")
    more = {"c.copper_energy": Series("W", 100.0 * time), "power": Series("J", 100.0 * time)}
    assert auto.audited(replace(run, series={**run.series, **more})) == pytest.approx(0.3 / 6.0)
    assert auto.audited(recorded(time, {"energy_error": time})) == 0.0
    assert math.isnan(auto.audited(recorded(time, {"a.motor_energy": time}, "J")))


@pytest.mark.parametrize(
    ("duration", "engine", "interval"),
    [
        (0.1, AdaptiveStep(Rodas5P(1e-3)), 0.1 / 500), (3.0, AdaptiveStep(Rodas5P(1e-3)), 1e-3),
        (100.0, AdaptiveStep(Rodas5P(1e-3)), 100.0 / 20_000),
        (3.0, FixedStep(2e-4), 2e-4), (3.0, FixedStep(4e-3), 1e-3), (60.0, FixedStep(1e-4), 60.0 / 120_000),
    ],
)  # fmt: skip
def test_rows_of_a_run_that_is_judged(
    monkeypatch: pytest.MonkeyPatch, duration: float, engine: FixedStep | AdaptiveStep, interval: float
) -> None:
    def run(ready: object, **asked: object) -> Recording:
        assert asked == {"solver": engine, "interval": pytest.approx(interval), "checked": False}
        return Recording(np.zeros(1), {}, stopped_by=Event(0.25, "limit", "at its end") if stops else None)

    ready = SimpleNamespace(scene=replace(ALONE, duration=duration, name="door"))
    monkeypatch.setattr(costs, "simulate", run)
    stops = False
    assert costs.run_to_end(ready, engine).stopped_by is None  # type: ignore[arg-type]
    stops = True
    with pytest.raises(InputError, match=r"door.*limit at 0\.25 s: at its end"):
        costs.run_to_end(ready, engine)  # type: ignore[arg-type]


def test_the_median_of_some_rounds_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two plans in turn; after a first round that is long enough there is no other."""
    ready, clock, done = SimpleNamespace(scene=ALONE), [0.0], []

    def run(ready: object, *, solver: float, interval: float, checked: bool) -> None:
        done.append(solver)
        clock[0] += solver * len(done)
        assert interval == ALONE.duration and not checked

    monkeypatch.setattr(costs, "simulate", run)
    monkeypatch.setattr(costs, "clock", SimpleNamespace(process_time=lambda: clock[0]))
    plans = [(ready, 1.0), (ready, 10.0)]
    assert costs.seconds(plans) == [3.0, 40.0] and done == [1.0, 10.0] * 3  # type: ignore[arg-type, comparison-overlap]
    done.clear()
    assert costs.seconds(plans, longest=21.0) == [1.0, 20.0]  # type: ignore[arg-type]
    done.clear()
    assert len(costs.seconds(plans, 2, longest=22.0)) == 2 and len(done) == 4  # type: ignore[arg-type]


def test_influence_and_time_of_each_kind_of_effect(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each kind left out at all joints that have it; times and evaluations of the full scene over those without it."""
    listed = (Choice("MeshLoss", "a"), Choice("Cogging", "a"), Choice("MeshLoss", "b"))
    peaks = {0: 4.0, 2: 3.0, 1: 5.0}  # by the number of effects that are left out

    def run(ready: tuple[Choice, ...], engine: object) -> Recording:
        return Recording(np.zeros(1), {}, counters={"solves": 100 * (1 + len(ready))})

    def decided(run: Recording, scene: object, basis: object) -> Decision:
        left = run.counters["solves"] // 100 - 1
        return with_peak("a", peaks[left])

    told: list[tuple[int, int, str]] = []
    monkeypatch.setattr(costs, "choices", lambda scene: listed)
    monkeypatch.setattr(costs, "without", lambda scene, gone: tuple(gone))
    monkeypatch.setattr(costs, "plan", lambda scene: scene)
    monkeypatch.setattr(costs, "run_to_end", run)
    monkeypatch.setattr(costs, "decision", decided)
    times = {(): 6.0, listed: 1.5, (listed[0], listed[2]): 4.0, (listed[1],): 2.0}
    monkeypatch.setattr(costs, "seconds", lambda plans, rounds: [rounds * times[ready] for ready, _ in plans])
    found = costs.effects_cost(ALONE, Basis({}, {}), rounds=2, progress=lambda *one: told.append(one))
    assert (found.full.joints["a"].peak_current, found.seconds, found.bare) == (4.0, 12.0, 0.25)
    assert found.counters == {"solves": 100} and found.solver == str(FixedStep(5e-4))
    rows = [(row.label, row.joints, row.time, row.work, row.changes["a"].peak_current) for row in found.rows]
    assert rows == [("cogging", ("a",), 3.0, 0.5, 0.25), ("mesh loss", ("a", "b"), 1.5, 1.0 / 3.0, -0.25)]
    assert told == [(0, 3, "without mesh loss"), (1, 3, "without cogging"), (2, 3, "timing")]


@pytest.mark.parametrize("stops", [False, True])
def test_errors_of_solvers_are_relative_to_the_finest(monkeypatch: pytest.MonkeyPatch, stops: bool) -> None:
    """The reference is the tighter tolerance, or an eighth of the smallest step where adaptive runs stop."""
    explicit = (("explicit", 1e-4, AdaptiveStep(Rodas5P(3e-3))), ("slow", 1e-5, AdaptiveStep(Rodas5P(5e-3))))

    def run(ready: object, *, solver: FixedStep | AdaptiveStep, **asked: object) -> Recording:
        fixed = isinstance(solver, FixedStep)
        size = solver.step if isinstance(solver, FixedStep) else solver.solver.rtol  # type: ignore[attr-defined]
        if size == 3e-3 or (stops and not fixed and size < 1e-6):
            raise InputError(Fault("scene", "too stiff"))
        ended = Event(0.5, "stopped" if size == 5e-3 else "limit", "") if size in (5e-3, 4e-3) else None
        series = {"joint.current": Series("A", np.full(2, 2.0 + size)), "joint.position": Series("rad", np.zeros(2))}
        return Recording(np.array([0.0, 2.0]), series, {"rates": round(1.0 / size)}, stopped_by=ended)

    monkeypatch.setattr(costs, "simulate", run)
    told: list[tuple[int, int, str]] = []
    found = costs.solver_cost(
        ALONE, Basis({}, {}), steps=(4e-3, 1e-3), precisions=(1e-3,), references=(1e-7, 1e-8), explicit=explicit,
        rounds=1, progress=lambda *one: told.append(one),
    )  # fmt: skip
    references = (1e-3 / 4.0, 1e-3 / 8.0) if stops else (1e-7, 1e-8)
    best = 2.0 + references[1]
    assert found.settled == pytest.approx((references[0] - references[1]) / best)
    assert ("0.125 ms, as the adaptive one stops: too stiff" if stops else "tolerance of 1e−8") in found.reference
    first, second, adaptive, stiff, slow = found.runs
    for one, setting in ((second, 1e-3), (adaptive, 1e-3)):
        assert (one.setting, one.work, one.note) == (setting, 1000, "")
        assert one.error == pytest.approx((setting - references[1]) / best) and one.where == "peak current of joint"
    for one, work, note in ((first, 250, "limit at 0.5 s"), (stiff, 0, "too stiff"), (slow, 200, "not done in 20 s")):
        assert math.isnan(one.error) and math.isnan(one.seconds) and (one.work, one.note) == (work, note)
    assert [one[:2] for one in told if one[2] != "reference"] == [(k, 7) for k in range(2, 7)]
    assert [one[:2] for one in told if one[2] == "reference"] == [(0, 7)] * stops + [(0, 7), (1, 7)]


@pytest.mark.parametrize(("factor", "warned"), [(1.009, False), (1.011, True), (0.989, True)])
def test_a_finer_run_that_differs_is_reported(factor: float, warned: bool) -> None:
    """Currents relative to themselves, deviations to the travel; what is next to nothing is not compared."""
    run = noise(("joint",), ("position", "command_position"))
    finer = replace(run, about={"solver": "finest"})
    travel = float(np.ptp(run["joint.position"]))
    values = {
        "joint.peak_current": (2.0 * factor, 2.0), "joint.rms_torque": (3e-7, 1e-7), "joint.rise": (0.0, 0.0),
        "joint.deviation": (0.009 * travel, 0.0), "tip_deviation": (0.0, 0.005),
    }  # fmt: skip
    found = verify._changed(run, finer, ALONE, values)
    assert len(found) == warned
    if warned:
        percent = 100.0 * abs(factor - 1.0)
        assert found[0].detail.startswith(f"finest changes joint.peak_current by {percent:.2g} %")
        assert (found[0].time, found[0].name) == (run.time[-1], "verify")
    far = values | {"joint.deviation": (0.05 * travel, 0.0)}
    assert "joint.deviation by 5 %" in verify._changed(run, finer, ALONE, far)[0].detail
    away = values | {"tip_deviation": (0.0, 0.06 * float(np.ptp(run["joint.command_position"])))}
    assert "tip_deviation by 6 %" in verify._changed(run, finer, ALONE, away)[0].detail


def test_currents_of_both_directions_compared() -> None:
    """Between samples linear, at a jump sizing's current before it; RMS at rest and in motion apart."""
    sized = SimpleNamespace(time=np.array([0.0, 1.0, 1.0, 2.0]), current=np.array([2.0, 4.0, -1.0, -3.0]))
    drive = SimpleNamespace(gear=SimpleNamespace(mesh_efficiency=None, efficiency=0.8))
    evaluation = SimpleNamespace(joints={"a": SimpleNamespace(series=sized, drive=drive)})
    time, weights = np.array([0.0, 0.5, 1.0, 1.5]), np.array([0.25, 0.5, 0.5, 0.25])
    moves, forward = np.array([True, True, False, False]), np.array([2.1, 3.3, -0.9, -2.5])
    found = _compared(evaluation, "a", (time, weights), forward, moves)  # type: ignore[arg-type]
    own = np.array([2.0, 3.0, 4.0, -2.0])
    np.testing.assert_allclose(found.inverse, own, atol=1e-9)
    whole = math.sqrt((weights * own**2).sum() / weights.sum())
    assert found.rms == pytest.approx((whole, math.sqrt((weights * forward**2).sum() / weights.sum())))
    assert found.peaks == (4.0, 3.3)
    off = (forward - own) ** 2
    assert found.apart_moving == pytest.approx(math.sqrt((0.25 * off[0] + 0.5 * off[1]) / 0.75) / whole)
    assert found.apart_resting == pytest.approx(math.sqrt((0.5 * off[2] + 0.25 * off[3]) / 0.75) / whole)
    assert "at rest the friction" in found.note and "in motion the controller" in found.note
    same = _compared(evaluation, "a", (time, weights), own, np.full(4, True))  # type: ignore[arg-type]
    assert same.note == "" and same.apart_moving == pytest.approx(0.0) and math.isnan(same.apart_resting)
    for mesh, whole_gear in ((None, 1.0), (1.0, 0.8), (None, None)):
        drive.gear.mesh_efficiency, drive.gear.efficiency = mesh, whole_gear
        assert "no mesh loss" in _compared(evaluation, "a", (time, weights), own, moves).note  # type: ignore[arg-type]


def test_capacities_that_no_sheet_states_are_slow() -> None:
    """Ten thousand cycles are their time constant; stated ones stay."""
    network = ThermalNetwork(0.5, 2.0, None, None, 25.0)
    slow = _with_slow_nodes(network, 3.0)
    assert (slow.winding_capacity, slow.housing_capacity) == (3e4 / 0.5, 3e4 / 2.0)
    assert _with_slow_nodes(replace(network, resistance_winding_housing=0.0), 3.0).winding_capacity == 3e4 / 2.0
    stated = replace(network, winding_capacity=7.0, housing_capacity=80.0)
    assert _with_slow_nodes(stated, 3.0) == stated


@pytest.mark.parametrize("proven", [True, False, None])
def test_the_words_of_a_study_name_what_was_left_out(monkeypatch: pytest.MonkeyPatch, proven: bool | None) -> None:
    """And the axes with two motors; the estimates take the study's step where it is finer than their own."""
    asked = {}

    def chosen(full: object, basis: object, **options: object) -> SimpleNamespace:
        asked.update(options)
        named = [("mesh loss", "a"), ("rotor as a body", "scene")] if proven is not None else []
        dropped = tuple(SimpleNamespace(label=label, choice=Choice("", joint)) for label, joint in named)
        return SimpleNamespace(dropped=dropped, scene=ALONE, proof=(dropped and SimpleNamespace(proven=proven)) or None)

    monkeypatch.setattr(study_run, "choose_effects", chosen)
    monkeypatch.setattr(study_run, "full_scene", lambda evaluation, settings: ARM)
    monkeypatch.setattr(study_run, "basis_of", lambda full, evaluation: None)
    first, second = ("a", "b"), ("c", "d")
    listed = (("a", first, -3.0), ("b", first, 3.0), ("c", second, None), ("d", second, None), ("e", (), None))
    joints = [SimpleNamespace(name=name, sharing=sharing, preload=preload) for name, sharing, preload in listed]
    evaluation: object = SimpleNamespace(study=SimpleNamespace(joints=joints))
    for step in (1e-3, 1e-4):
        settings = Simulation(effects=("auto",), tolerance=0.02, tip_tolerance=1e-4, step=step)
        found = study_run.study_scene(evaluation, settings)  # type: ignore[arg-type]
        assert asked["step"] == min(step, auto.COARSE)
        assert (asked["tolerance"], asked["tip_tolerance"]) == (0.02, 1e-4)
    assert found.scene is ALONE and found.full is ARM
    left = "nothing" if proven is None else "mesh loss of a, rotor as a body of scene"
    proof = {True: " (proven)", False: " (not proven)", None: ""}[proven]
    pairs = "; a and b push against each other with 3 N m; c and d are two motors on one axis"
    assert found.words == f"effects: auto within 2 % left out {left}{proof}{pairs}"


def test_a_gear_without_its_loss_is_still_a_gear() -> None:
    """Its ratio stays, with no inertia of its own; a rotor that has the ratio already needs nothing."""
    motor, gear = Motor("m", 0.4, 0.06), Gear("g", -70.0, efficiency=0.8)
    named = (MotorCurrent(motor), MeshLoss(gear))
    gone = [Choice("MeshLoss", "joint")]
    assert choices(replace(ALONE, effects={"joint": named})) == (gone[0],)
    bare = without(replace(ALONE, effects={"joint": named}), gone)
    assert bare.effects["joint"] == (MotorCurrent(motor), ReflectedRotor(0.0, -70.0))
    rotor = ReflectedRotor(2e-5, -70.0)
    turned = without(replace(ALONE, effects={"joint": (*named, rotor)}), gone)
    assert turned.effects["joint"] == (MotorCurrent(motor), rotor)
