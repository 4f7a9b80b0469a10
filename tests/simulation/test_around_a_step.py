"""What engines do between two steps and around a run: events, times that no step crosses, walls, starts, refusals."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from crank_arm import DIFFERENTIAL, crank, two_links

import drivetrain as dt
from drivetrain.arm.bodies import with_payload
from drivetrain.effects import signals
from drivetrain.effects.effect import Effect, Place, Ports, Signal
from drivetrain.effects.laws import joint_law, scene_law
from drivetrain.effects.loads.payload_change import Body, PayloadChange
from drivetrain.simulation.core import assembly, bodies, equations, friction
from drivetrain.simulation.core.jacobian import sparsity_pattern
from drivetrain.simulation.core.records import AT, parts_of
from drivetrain.simulation.engines import adaptive_step, fixed_step, inverse, starting
from drivetrain.simulation.engines.engine import RunOptions
from drivetrain.simulation.planning.plan import Plan, plan
from drivetrain.simulation.run import simulate
from drivetrain.solvers import records as at
from drivetrain.solvers.compiled_function import evaluate
from drivetrain.solvers.solver import Rodas4
from drivetrain.spatial.poses import pose

MOTOR = dt.Motor("m", 0.3, 0.03)

# --- dry friction


@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize(("load", "hold"), [(0.5, 1.0), (-1.0, 2.0), (0.2, 0.0)])
def test_a_stuck_mesh_that_locks_gives_way_to_its_motor_at_once(load: float, hold: float, way: int) -> None:
    """Driven back it would jam, so the direction of power has to be seen before the first solution with slip."""
    slide, h, whole, link = 0.8 * hold, 0.5, 1.0, 0.9
    both = [SimpleNamespace(hold_forward=a, hold_backward=a, slide_forward=b, slide_backward=b)
            for a, b in ((hold, slide), (0.3, 0.2))]  # fmt: skip
    dry = SimpleNamespace(
        mode=0, mode_fixed=0, active=1, load_sign=-way, joint=both[0], motor=both[1], driving=0.5, driven=1.4
    )
    push = hold + 0.3 + 0.5 * (load + hold) + 0.6
    one = SimpleNamespace(dry=dry, relative=0.0, change=0.0, impulse=way * h * push, transmitted=way * load,
                          friction=0.0, margin=0.0, slipping=0)  # fmt: skip
    entry = SimpleNamespace(matrix=whole, transmitted=link, mass=whole, reduced=0.0)
    assert friction.solve_friction([one], {(0, 0): entry}, h) == 2
    lost = slide + 0.2 + 0.5 * (load + slide)
    assert one.change == pytest.approx(way * h * (push - lost) / (whole + 0.5 * h * link), rel=1e-12)
    assert dry.mode == way and dry.load_sign == way


# --- events of the adaptive engine


def bars(laws: list[Any], torques: list[float], more: tuple[Effect, ...] = ()) -> dt.Scene:
    """Masses of 3, 2 and 1 kg that slide on one another along x, y and z, each pushed by a force."""
    home, screws = np.tile(np.eye(4), (3, 1, 1)), np.hstack([np.zeros((3, 3)), np.eye(3)])
    arm = dt.Arm.from_screws(
        home, screws, [3.0, 2.0, 1.0], [np.eye(3) * 1e-3] * 3, tip=np.eye(4), gravity=(0.0, 0.0, 0.0),
        joint_names=["a", "b", "c"],
    )  # fmt: skip
    effects: dict[str, tuple[Effect, ...]] = {
        name: (dt.DryFriction(law), dt.GivenTorque([0.0], [torque]), *more)
        for name, law, torque in zip("abc", laws, torques, strict=True)
    }
    return dt.Scene(arm, effects, 1.0)


def adaptive(scene: dt.Scene) -> tuple[Plan, Any]:
    """A plan and the memory of its adaptive run."""
    done = plan(scene)
    moving = done.memory.moving
    numbers = starting.initial_memory(done)
    return done, adaptive_step._with_engine_sections(done, numbers, sparsity_pattern(done)[:moving, :moving])


def called(function: Any, numbers: Any, x: Any, result: Any, t: float = 0.0) -> None:
    evaluate(equations.right_side(function).address, t, x, result, np.zeros(1), parts_of(numbers))


LAW = dt.Friction(coulomb=2.0, static=3.0)


def test_margins_are_what_is_left_of_friction_or_of_speed() -> None:
    done, numbers = adaptive(bars([LAW] * 3, [1.0, -2.5, 0.0]))
    at, found = done.memory.view(numbers, "coordinates"), np.zeros(3)
    at["dry"]["mode"] = 0, 0, -1
    called(adaptive_step._event_values, numbers, np.array([0.1, 0.2, 0.3, 0.0, 0.0, -0.4]), found)
    np.testing.assert_allclose(found, [2.0, 0.5, 0.4], rtol=1e-12)
    at["dry"]["mode"] = 1, 1, -1
    called(adaptive_step._event_values, numbers, np.array([0.1, 0.2, 0.3, 0.5, -0.1, 0.2]), found)
    np.testing.assert_allclose(found, [0.5, -0.1, -0.2], rtol=1e-12)
    belt, numbers = adaptive(bars([LAW] * 3, [0.0, -3.5, 2.0], (dt.MovingBelt(0.25),)))
    at = belt.memory.view(numbers, "coordinates")
    at["dry"]["mode"] = 1, 0, 0
    called(adaptive_step._event_values, numbers, np.array([0.0, 0.0, 0.0, 0.1, 0.25, 0.25]), found)
    np.testing.assert_allclose(found, [-0.15, -0.5, 1.0], rtol=1e-12)
    assert at["breakaway_direction"][1] == -1


def test_a_mesh_sticks_up_to_an_acceleration_beyond_its_bound() -> None:
    """Of 3e-8 rad/s^2 times the inertia; other friction has no such margin."""
    for inertia in (0.5, 8.0):
        for more, margin in (((), 0.0), ((dt.MeshLoss(dt.Gear("g", 1.0, efficiency=0.9)),), 3e-8 * inertia)):
            rub = dt.DryFriction(dt.Friction(coulomb=2.0))
            done, numbers = adaptive(dt.joint_scene(inertia, [rub, dt.GivenTorque([0.0], [1.5]), *more], 1.0))
            at, found = done.memory.view(numbers, "coordinates"), np.zeros(1)
            at["dry"]["mode"] = 0
            called(adaptive_step._event_values, numbers, np.zeros(2), found)
            assert found[0] - at["margin"][0] == pytest.approx(margin, abs=1e-15) and 0.4 < at["margin"][0] < 0.8


@pytest.mark.parametrize("surface", [0.4, -0.4])
def test_friction_takes_power_by_the_speed_on_its_surface(surface: float) -> None:
    done, numbers = adaptive(bars([dt.Friction(coulomb=2.0)] * 3, [0.0] * 3, (dt.MovingBelt(surface),)))
    speeds = np.array([0.1, 0.9, -1.3])
    done.memory.view(numbers, "coordinates")["dry"]["mode"] = np.sign(speeds - surface)
    equations.evaluate_rates(numbers, np.concatenate([np.zeros(3), speeds]))
    equations.evaluate_signals(numbers)
    for name, speed in zip("abc", speeds, strict=True):
        power, torque = (numbers[done.memory.places[f"{name}.{what}"]] for what in
                         ("joint_friction_power", "joint_friction"))  # fmt: skip
        assert power == pytest.approx(2.0 * abs(speed - surface), rel=1e-12)
        assert torque == pytest.approx(2.0 * np.sign(speed - surface), rel=1e-12)


def test_a_payload_is_taken_at_the_beginning_of_a_segment() -> None:
    """Its energy is counted once: of half a kilogram at its height and speed."""
    arm = dt.load_arm("planar-2r")
    body = Body(0.5, np.zeros(3), np.zeros((3, 3)))
    scene = dt.Scene(arm, {"scene": (PayloadChange([0.3], (body,)),)}, 1.0)
    done, numbers = adaptive(scene)
    x = np.array([0.4, -0.7, 1.1, -1.6])
    added = done.memory.places["scene.payload_energy"]
    for t, taken in ((0.2, False), (0.3, True), (0.5, True)):
        called(adaptive_step._segment_start, numbers, x, np.zeros(1), t)
        assert bool(numbers[added]) == taken
    energy = [dt.kinetic_energy(one, x[:2], x[2:]) + dt.potential_energy(one, x[:2])
              for one in (arm, with_payload(arm, 0.5, np.zeros(3), np.zeros((3, 3))))]  # fmt: skip
    assert numbers[added] == pytest.approx(energy[1] - energy[0], rel=1e-9)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_command_beyond_a_limit_is_refused_in_both_directions(way: float) -> None:
    """Current and voltage, at a share of the limit, at the time of the largest."""
    motor = dt.MotorCurrent(MOTOR, 5.0, 24.0)
    made = SimpleNamespace(scene=SimpleNamespace(effects={"b": (motor, LAW)}))
    time = np.array([0.0, 0.5, 1.0])
    for share in (1.0, 0.5):
        for current, voltage, wanted in ((0.99, 0.99, []), (1.01, 0.9, [("5.05", "A")]), (0.9, 1.01, [("24.24", "V")])):
            shape = way * share * np.array([[0.1, 0.2], [0.3, 1.0], [np.nan, -0.5]])
            demand = SimpleNamespace(time=time, current=5.0 * current * shape, voltage=24.0 * voltage * shape)
            found = dt.Inverse(share)._limits(made, demand, 1, "b")
            assert len(found) == len(wanted) and all(fault.place == "b" for fault in found)
            for fault, (size, unit) in zip(found, wanted, strict=True):
                assert f"takes {share * float(size):.4g} {unit} at 0.5 s" in fault.problem


@pytest.mark.parametrize("surface", [0.0, 0.7, -0.7])
def test_who_slips_and_who_sticks_after_an_event(surface: float) -> None:
    """One reaches its bound and takes along another that is at its own; the third comes to rest and is held."""
    more = (dt.MovingBelt(surface),) if surface else ()
    done, numbers = adaptive(bars([LAW] * 3, [3.0 * (1.0 + 1e-12), -3.0, 2.5], more))
    at = done.memory.view(numbers, "coordinates")
    at["dry"]["mode"], at["breakaway_direction"] = (0, 0, 1), (1, 0, 0)
    stale = np.array([0.0, 0.0, 0.0, surface, surface, 3.0])
    equations.evaluate_rates(numbers, stale)
    at["margin"], at["friction"] = 9.0, 0.1  # what another state has left: it is computed anew
    x = np.array([0.3, 0.2, 0.1, surface, surface, surface + 4e-6])
    called(adaptive_step._handler, numbers, x, np.array([1.0, 0.0, 1.0]), 0.25)
    assert at["dry"]["mode"].tolist() == [1, -1, 0]
    assert x[:3].tolist() == [0.3, 0.2, 0.1]
    assert x[3] > surface > x[4] and x[5] == surface
    assert abs(x[3] - surface) < 1e-15 and abs(x[4] - surface) < 1e-15
    log = done.memory.view(numbers, "sections")[AT.log]
    entries = numbers[log["first"] : log["first"] + log["size"]].view(adaptive_step.MODE_CHANGE)
    # The first could as well have stuck: with static friction both fit at the bound.
    assert entries[:4].tolist() == [(0.25, 0, 0, 1), (0.25, 1, 0, -1), (0.25, 2, 1, 0), (0.25, 0, 0, 2)]
    engine = done.memory.view(numbers, "engine")[0]
    assert engine["logged"] == 4 and engine["modes_fixed"] == 1 and engine["ambiguous"] == 0
    # What does not reach its bound stays, and what is fast does not come to rest.
    at["dry"]["mode"], at["breakaway_direction"] = (0, 0, 1), (1, 0, 0)
    x = np.array([0.0, 0.0, 0.0, surface, surface, surface + 0.1])
    called(adaptive_step._handler, numbers, x, np.array([0.0, 0.0, 1.0]))
    assert at["dry"]["mode"].tolist() == [0, 0, 1] and x[5] == surface + 0.1
    if surface:
        return
    done, numbers = adaptive(bars([LAW] * 3, [3.0 * (1.0 + 1e-12), -2.9, 3.5]))
    at = done.memory.view(numbers, "coordinates")
    at["dry"]["mode"], at["breakaway_direction"] = (0, 0, -1), (1, 0, 0)
    x = np.array([0.0, 0.0, 0.0, 0.0, 0.0, -1e-6])
    called(adaptive_step._handler, numbers, x, np.array([1.0, 0.0, 1.0]))
    assert at["dry"]["mode"].tolist() == [1, 0, 1]  # the third is pushed on by more than holds
    assert x[3] > 0.0 and x[4:].tolist() == [0.0, 0.0]


def test_times_of_rows_and_breaks() -> None:
    table = dt.GivenTorque([0.0, 0.1, 0.1, 0.25, 0.4, 0.4, 2.0], [1.0, 1.0, 2.0, 3.0, 3.0, 0.0, 0.0])
    done = plan(dt.Scene(dt.Inertia(1.0), {"joint": (table,)}, 0.4))
    assert adaptive_step._break_times(done, 1e-6).tolist() == pytest.approx([0.1, 0.25])
    motor, servo = dt.Motor("m", 0.3, 0.05), dt.SampledCascade(20.0, 0.5, every=0.15, delay=0)
    still = dt.Motion("still", ("joint",), np.array([0.0, 0.4]), *(np.zeros((2, 1)) for _ in range(3)))
    effects = (dt.FullRotor(1e-3), dt.MotorCurrent(motor), dt.Encoder(), servo, table)
    sampled = plan(dt.Scene(dt.Inertia(1.0), {"joint": effects, "scene": (dt.CommandedMotion(still),)}, 0.4))
    assert adaptive_step._break_times(sampled, 1e-6).tolist() == pytest.approx([0.1, 0.15, 0.25, 0.3])
    for interval, first, wanted in (
        (0.1, 0.0, [0.0, 0.1, 0.2, 0.3, 0.4]), (0.15, 0.0, [0.0, 0.15, 0.3, 0.4]), (1.0, 0.0, [0.0, 0.4]),
        (0.1, 0.2, [0.2, 0.3, 0.4]), (0.1, 0.25, [0.25, 0.3, 0.4]), (0.1, 0.4, [0.4, np.nextafter(0.4, 1.0)]),
    ):  # fmt: skip
        found = adaptive_step._output_times(done, RunOptions(interval), first)
        assert found.tolist() == pytest.approx(wanted), (interval, first)


def test_finer_engines_and_their_tolerances() -> None:
    done = plan(dt.Scene(dt.Inertia(1.0), {"joint": (dt.WallSpring(9.0),)}, 1.0))
    engine = dt.AdaptiveStep(Rodas4(1e-4))
    own = adaptive_step._with_state_tolerances(engine.solver, done)
    np.testing.assert_allclose(own.atol, 100.0 * done.memory.atol[:2], rtol=1e-12)
    finer = engine.finer().solver
    assert (finer.rtol, finer.atol) == (pytest.approx(1e-5), None)
    assert adaptive_step._with_state_tolerances(own, done) is own
    for atol, wanted in (((1e-3, 1e-2), (1e-4, 1e-3)), (1e-3, 1e-4)):
        told = dt.AdaptiveStep(Rodas4(1e-4, atol=atol)).finer()
        assert told.solver.atol == pytest.approx(wanted) and told.tolerance == pytest.approx(1e-5)
    assert dt.FixedStep(1e-3).finer().step == 5e-4 and dt.FixedStep(1e-3).finer(1e-4).step == 5e-5


# --- the grid of fixed steps


def test_a_breakpoint_beside_the_grid_is_the_end_of_a_step_of_its_own() -> None:
    beside = 3e-7
    push = dt.GivenTorque([0.0, 2e-3 + beside, 2e-3 + beside, 1.0], [1.0, 1.0, -2.0, -2.0])
    scene = dt.Scene(dt.Inertia(1.0), {"joint": (push,)}, 6e-3)
    run = simulate(scene, solver=dt.FixedStep(1e-3), interval=2e-3, checked=False)
    assert run.counters["steps"] == 2 + 1 + 3 + 1
    assert run.time.tolist() == pytest.approx([0.0, 2e-3, 4e-3 + beside, 6e-3], abs=1e-12)
    late = np.maximum(run.time - 2e-3 - beside, 0.0)
    np.testing.assert_allclose(run["joint.speed"], run.time - 3.0 * late, rtol=0.0, atol=1e-15)


def test_a_run_that_goes_on_has_the_rows_of_the_whole() -> None:
    scene = dt.Scene(dt.Inertia(1.0), {"joint": (dt.WallSpring(50.0, 1.0),)}, 9.5e-3, speed=np.array([1.0]))
    for step in (1e-3, 5e-4):
        whole = simulate(scene, solver=dt.FixedStep(step), interval=2e-3, checked=False)
        half = simulate(scene, solver=dt.FixedStep(step), interval=2e-3, checked=False, duration=4e-3)
        rest = simulate(scene, solver=dt.FixedStep(step), interval=2e-3, checked=False, resume=half)
        assert whole.time.tolist() == pytest.approx([0.0, 2e-3, 4e-3, 6e-3, 8e-3, 9.5e-3])
        assert rest.time.tolist() == whole.time[3:].tolist()
        assert rest["joint.position"].tolist() == whole["joint.position"][3:].tolist()
        short = simulate(scene, solver=dt.FixedStep(step), interval=2e-3, checked=False, resume=half, duration=5e-3)
        assert short.time.tolist() == pytest.approx([5e-3])


@pytest.mark.parametrize(("step", "steps"), [(1e-3, 6), (5e-4, 8)])
def test_a_run_that_goes_on_with_its_step_keeps_its_grid(step: float, steps: int) -> None:
    """Stopped within a step: the rest of that step first, or a grid of another step from there on."""
    scene = dt.joint_scene(dt.Inertia(2.0, 5.0), [], 2.5e-3, speed=1.0)
    first = simulate(scene, solver=dt.FixedStep(1e-3), interval=1e-3, checked=False)
    assert first.counters["steps"] == 3
    rest = simulate(scene, solver=dt.FixedStep(step), interval=1e-3, resume=first, duration=5e-3)
    assert rest.counters["steps"] == steps
    whole = simulate(scene, solver=dt.FixedStep(1e-3), interval=1e-3, duration=5e-3, checked=False)
    np.testing.assert_allclose(rest.time, [3e-3, 4e-3, 5e-3], rtol=1e-12)
    np.testing.assert_allclose(rest["joint.position"], whole["joint.position"][3:], rtol=1e-6)


@pytest.mark.parametrize("start", [0.3, 0.7, 1e6 + 0.3])
def test_a_whole_step_has_the_same_length_wherever_it_begins(start: float) -> None:
    """In spite of rounded times, to the bit; parts of one are equal and no longer than is allowed."""
    clock = SimpleNamespace(step=0.1, grid_end=start + 0.1)
    assert fixed_step._substep_length(clock, start, math.inf) == 0.1
    shorter = SimpleNamespace(step=0.1, grid_end=start + 0.07)
    left = shorter.grid_end - start
    assert fixed_step._substep_length(shorter, start, math.inf) == left
    for limit, parts in ((0.05, 2), (0.0351, 2), (0.0349, 3), (0.0099, 8), (1e-9, math.ceil(0.7 * 4096.0))):
        found = fixed_step._substep_length(shorter, start, limit)
        assert found == pytest.approx(left / parts, rel=1e-6)


def test_too_many_steps_are_refused() -> None:
    scene = dt.Scene(dt.Inertia(1.0), {}, 2e8)
    with pytest.raises(dt.InputError, match=r"more than 1e\+11 steps in 2e\+08 s"):
        simulate(scene, solver=dt.FixedStep(1e-3), interval=1e6, checked=False)


@dataclass
class Limit:
    """Record of an effect that allows short steps only [s], until a time [s], and asks for more solutions."""

    longest: float
    until: float
    more: int


@scene_law(Limit)
def _limit(t: Any, h: Any, own: Any, scene: Any) -> None:
    if h > 0.0 and t < own.until:
        scene.world.step_limit = min(scene.world.step_limit, own.longest)
    if h > 0.0 and scene.world.iteration < own.more:
        scene.world.repeat_step = 1


@dataclass(frozen=True)
class ShortSteps(Effect):
    """Allows short steps only, until a time; each is solved so many times more."""

    longest: float
    until: float
    more: int = 0

    scope = "scene"
    account = _limit

    def ports(self, place: Place) -> Ports:
        return Ports()

    def own(self, place: Place) -> Limit:
        return Limit(self.longest, self.until, self.more)


def test_a_step_is_divided_as_an_effect_asks() -> None:
    """Equal parts within the limit; after it, at most twice as long each time, but never beyond the grid."""
    h = 1.0 / 64.0
    effects = {"joint": (dt.GivenTorque([0.0], [2.0]),), "scene": (ShortSteps(0.3 * h, 2.9 * h),)}
    scene = dt.Scene(dt.Inertia(1.0), effects, 6 * h)
    run = simulate(scene, solver=dt.FixedStep(h), interval=h, checked=False)
    # Four parts of each of three steps, the first tried as a whole; the last limit still holds for one step after it.
    assert (run.counters["steps"], run.counters["substeps"]) == (12 + 2 + 2, 9 + 1)
    assert run.counters["solves"] == 1 + 16
    np.testing.assert_allclose(run["joint.position"], run.time**2, rtol=1e-13, atol=1e-16)
    wide = replace(scene, effects=scene.effects | {"scene": (ShortSteps(0.9 * h, 9.0),)})
    run = simulate(wide, solver=dt.FixedStep(h), interval=h, checked=False)
    assert run.counters["steps"] == run.counters["solves"] == 1 + 5 * 2  # the first is not repeated for so little
    again = replace(scene, effects=scene.effects | {"scene": (ShortSteps(9.0, 9.0, 4),)})
    run = simulate(again, solver=dt.FixedStep(h), interval=h, checked=False)
    assert run.counters["solves"] == 6 * 5 and "unsettled" not in run.counters
    never = replace(scene, effects=scene.effects | {"scene": (ShortSteps(9.0, 9.0, 99),)})
    run = simulate(never, solver=dt.FixedStep(h), interval=h, checked=False)
    assert run.counters["solves"] == 6 * 30 and run.counters["unsettled"] == 6


@dataclass
class Sums:
    """Record of an effect that sums what steps tell it: changes of speed [rad/s], times times steps [s^2]."""

    link: float = 0.0
    motor: float = 0.0
    time: float = 0.0


@joint_law(Sums)
def _sum(t: Any, h: Any, own: Any, joint: Any) -> None:
    own.link += h * joint.load.acceleration
    own.motor += h * joint.motor.acceleration
    own.time += h * t


@dataclass(frozen=True)
class Summed(Effect):
    """Sums what steps tell it."""

    accept = _sum

    def ports(self, place: Place) -> Ports:
        outputs = (Signal("link", "rad/s"), Signal("shaft", "rad/s", path="motor"), Signal("times", "s^2", path="time"))
        return Ports(needs=(signals.ACCELERATION, signals.MOTOR_ACCELERATION), outputs=outputs)

    def own(self, place: Place) -> Sums:
        return Sums()


@pytest.mark.parametrize("how", ["rigid", "springs", "coupled"])
def test_effects_are_told_the_accelerations_and_the_middle_of_each_step(how: str) -> None:
    study = two_links(coupling=[DIFFERENTIAL] if how == "coupled" else [])
    own: tuple[Any, ...] = (dt.ReflectedRotor(1e-4, 50.0), dt.GivenTorque([0.0], [1.5], "motor"), Summed())
    own += (dt.FlexibleJoint(dt.Gear("g", 50.0, stiffness_1=2e4), 3.0),) if how == "springs" else ()
    scene = dt.Scene(study.arm, dict.fromkeys(study.arm.joint_names, own), 4e-3, np.array([0.5, -0.9]), np.ones(2))
    run = simulate(scene, solver=dt.FixedStep(1e-3), interval=1e-3, checked=False)
    for name in study.arm.joint_names:
        for what, speed in (("link", "speed"), ("shaft", "motor_speed")):
            found = run[f"{name}.{speed}"]
            assert np.ptp(found) > 1e-3
            np.testing.assert_allclose(
                run[f"{name}.{what}"], found - found[0], rtol=0.0, atol=1e-12 * np.abs(found).max()
            )
        np.testing.assert_allclose(run[f"{name}.times"], 0.5 * run.time**2, rtol=1e-12, atol=1e-18)


@pytest.mark.parametrize("ratio", [0.05, -0.05])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_friction_at_a_motor_that_turns_slower_than_its_joint(ratio: float, way: float) -> None:
    """Forward and backward are those of the motor."""
    rub = dt.DryFriction(dt.Friction(coulomb=4.0, coulomb_negative=7.0), "motor")
    scene = dt.Scene(dt.Inertia(2.0), {"joint": (dt.FullRotor(8.0, ratio), rub)}, 2e-3, speed=np.array([way]))
    run = simulate(scene, solver=dt.FixedStep(1e-3), interval=1e-3, checked=False)
    force = 0.05 * (4.0 if way * ratio > 0.0 else 7.0)
    assert run["joint.speed"] == pytest.approx(way * (1.0 - force / (2.0 + 8.0 * 0.05**2) * run.time), rel=1e-12)


@pytest.mark.parametrize("push", [2.0, -2.0])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_mesh_alone_takes_its_share_of_what_it_carries(way: float, push: float) -> None:
    """Without other dry friction: of a motor's torque that drives the load, or of the load's that drives the rotor."""
    mesh = dt.MeshLoss(dt.Gear("g", 50.0, kind="spur", efficiency=0.8))
    effects = (dt.FullRotor(4e-5, 50.0), mesh, dt.GivenTorque([0.0], [push]))
    scene = dt.Scene(dt.Inertia(0.3), {"joint": effects}, 2e-3, speed=np.array([way]))
    run = simulate(scene, solver=dt.FixedStep(1e-3), interval=1e-3, checked=False)
    rotor = 4e-5 * 50.0**2  # the load's torque turns it; the mesh carries what the load does not keep
    for kappa in (0.25, -0.25):  # driving and driven: 1 / 0.8 - 1 of what is carried is lost
        turn = (1.0 + kappa) * push / (0.3 * (1.0 + kappa) + rotor)
        carried = 0.3 * turn - push
        if (carried * way > 0.0) == (kappa > 0.0):
            wanted = turn
    assert run["joint.speed"] == pytest.approx(way + wanted * run.time, rel=1e-9)
    assert run["joint.mesh_torque"] == pytest.approx(0.3 * wanted - push, rel=1e-9)


@pytest.mark.parametrize("soft", [False, True])
@pytest.mark.parametrize("closed", [False, True])
def test_the_weight_of_a_rotor_out_of_balance_is_in_the_energy(closed: bool, soft: bool) -> None:
    """One on the base, 0.5 kg and 3 cm off its axis: its height is that of its own angle, also behind a spring."""
    study, runs = two_links(closures=crank(0.3) if closed else []), []
    spring = {"shoulder": (dt.FlexibleJoint(dt.Gear("g", 3.0, stiffness_1=200.0)),)} if soft else {}
    for off in (0.03, 0.0):
        rotors = [dt.Rotor(3.0, 1e-3 * np.eye(3), 0.5, pose(point=[off, 0.0, 0.0]), carrier=-1), dt.Rotor(5.0, 1e-4)]
        arm = dt.with_rotors(study.arm, rotors)
        scene = dt.Scene(arm, spring, 3e-3, np.array([0.4, -0.7]), np.array([1.1, -1.6]))
        given = {"shoulder.deflection": 0.05} if soft else {}
        runs.append(simulate(scene, solver=dt.FixedStep(1e-3), interval=1e-3, checked=False, start=given))
    angle, potential = runs[0]["shoulder.motor_position"], "scene.potential_energy"
    assert angle[0] == pytest.approx(3.0 * (0.4 + 0.05 * soft), rel=1e-12)
    lifted = runs[0][potential][0] - runs[1][potential][0]
    assert lifted == pytest.approx(0.5 * 9.81 * 0.03 * np.sin(angle[0]), rel=1e-9)
    whole = runs[0]["stored_energy"]
    assert np.ptp(runs[0][potential]) > 1e-3 and np.ptp(whole) < 1e-3 * np.ptp(runs[0][potential])


def test_a_run_begins_with_the_torques_of_its_first_instant() -> None:
    still = dt.Motion("still", ("joint",), np.array([0.0, 1.0]), *(np.zeros((2, 1)) for _ in range(3)))
    load = dt.GivenTorque([0.0, 0.2], [-3.0, -30.0])
    effects = (dt.FullRotor(1e-4, 50.0), dt.MotorCurrent(MOTOR), dt.CascadeLoop(20.0, 0.5, 0.1), load)
    done = plan(dt.Scene(dt.Inertia(1.0), {"joint": effects, "scene": (dt.CommandedMotion(still),)}, 1.0))
    numbers = starting.initial_memory(done)
    value = done.memory.view(numbers, "states")["value"][done.memory.states["joint.integrated_current"]]
    assert numbers[value] == pytest.approx(3.0 / 50.0 / 0.03, rel=1e-9)


def test_runs_without_a_solution_are_told_in_words() -> None:
    done = plan(bars([LAW] * 3, [0.0] * 3))
    told = [fixed_step.unsolved_event(done, 0.5, code, "; advice") for code in
            (friction.NO_MODES_FOUND, equations.LOOPS_CANNOT_CLOSE, -1, -3)]  # fmt: skip
    assert [one.name for one in told] == ["no solution", "linkage not closed", "jammed", "jammed"]
    assert told[0].detail.endswith("; advice") and {one.time for one in told} == {0.5}
    assert [one.detail[0] for one in told[2:]] == ["a", "c"]


@pytest.mark.parametrize("seed", [0, 1])
def test_the_tip_goes_on_with_the_trial_speeds(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Speed and turning by the columns of its Jacobian, place with them, the force less its damping."""
    rng = np.random.default_rng(seed)
    columns, change = rng.normal(size=(3, 6)), rng.normal(size=3)
    engine, tip = ({name: rng.normal(size=3) for name in names} for names in
                   (("tip_speed", "tip_turning", "tip_place"), ("speed", "turning", "place", "force")))  # fmt: skip
    damping, stiffness = rng.normal(size=6), rng.normal(size=6)
    found = SimpleNamespace(**tip, damping=damping, stiffness=stiffness)
    kept = SimpleNamespace(**engine, tip_expected=np.zeros(3))
    before, force = tip["speed"].copy(), tip["force"].copy()
    coordinates = [SimpleNamespace(trial_speed=2.0 + one, mid_speed=2.0) for one in change]
    monkeypatch.setattr(bodies, "world_of", lambda run: SimpleNamespace(tip=found, joints=3))
    monkeypatch.setattr(bodies, "engine_of", lambda run: kept)
    monkeypatch.setattr(bodies, "coordinates_of", lambda run: coordinates)
    monkeypatch.setattr(bodies, "_tip_screw", lambda run, k: (tuple(columns[k, :3]), tuple(columns[k, 3:])))
    shift = 0.25
    bodies.move_tip_to_trial(None, shift)
    turned = change @ columns[:, :3]
    moved = change @ columns[:, 3:] + np.cross(turned, engine["tip_place"])
    np.testing.assert_allclose(found.turning, kept.tip_turning + turned, rtol=1e-12)
    np.testing.assert_allclose(found.speed, kept.tip_speed + moved, rtol=1e-12)
    np.testing.assert_allclose(found.place, kept.tip_place + shift * moved, rtol=1e-12)
    soft = np.zeros((3, 3))
    soft[np.triu_indices(3)] = damping + shift * stiffness
    soft = soft + np.triu(soft, 1).T
    np.testing.assert_allclose(kept.tip_expected, force - soft @ (kept.tip_speed + moved - before), rtol=1e-12)


def test_why_an_adaptive_run_ended() -> None:
    done, numbers = adaptive(bars([LAW] * 3, [0.0] * 3))
    engine = done.memory.view(numbers, "engine")
    ends = {at.TOO_MANY_STEPS: "budget", at.JUMP: "jump", at.ZENO: "chattering", at.DIVERGES: "diverged", 99: "stopped"}
    for code, name in ends.items():
        event = adaptive_step._stop_event(SimpleNamespace(code=code, stopped="why", stopped_at=0.7), done, numbers)
        assert (event.time, event.name, event.detail) == (0.7, name, "why")
    engine["solved"] = -2
    event = adaptive_step._stop_event(SimpleNamespace(code=99, stopped="why", stopped_at=0.7), done, numbers)
    assert (event.time, event.name, event.detail[0]) == (0.7, "jammed", "b")


@pytest.mark.parametrize(("which", "hold"), [("joint", (1.0, 2.0)), ("motor", (3.0, 4.0))])
@pytest.mark.parametrize("load", [9.0, -9.0])
def test_what_sticks_is_shared_in_proportion_to_the_bounds(which: str, hold: tuple[float, float], load: float) -> None:
    """At the bound of all together each is at its own: joint, motor, and the loss of the mesh in either direction."""
    bounds = {"joint": (1.0, 2.0), "motor": (3.0, 4.0)}
    dry = SimpleNamespace(driving=0.5, driven=0.3, **{
        name: SimpleNamespace(hold_forward=a, hold_backward=b) for name, (a, b) in bounds.items()
    })  # fmt: skip
    for share in (1.0, 0.25):
        for way, side in ((1.0, 0), (-1.0, 1)):
            most = bounds["joint"][side] + bounds["motor"][side] + 0.5 * abs(load)
            rotor = SimpleNamespace(dry=dry, friction=way * share * most)
            found = assembly._share(rotor, getattr(dry, which), load)
            assert found == pytest.approx(way * share * hold[side], rel=1e-12)


@pytest.mark.parametrize("name", ["a.speed", "b.speed", "c.speed"])
def test_a_speed_beyond_all_bounds_is_named(name: str) -> None:
    for way in (1.0, -1.0):
        torques = [9e59 * way if one == name[0] else 0.0 for one in "abc"]
        done = plan(bars([dt.Friction(coulomb=1e-3)] * 3, torques))
        run = dt.FixedStep(1.0).run(done, RunOptions(1.0, start={name: way * 9e59}))
        assert run.stopped_by is not None and run.stopped_by.name == "diverged" and name in run.stopped_by.detail
    done = plan(bars([dt.Friction(coulomb=1e-3)] * 3, [0.0] * 3))
    fine = dt.FixedStep(0.25).run(done, RunOptions(0.5, start={name: 3.0}))
    assert fine.stopped_by is None and fine.counters["instants"] == len(fine.rows) == 3
    assert fine.events == ()


def test_rates_of_wind_ups_along_a_command(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a torque that swings, without the joint's friction, through a spring with a bend."""
    soft = SimpleNamespace(deflection=lambda load: 1e-3 * load + 1e-5 * load**2)
    made = SimpleNamespace(body=SimpleNamespace(springs={1: soft, 0: SimpleNamespace(deflection=None)}))

    def demanded(plan: Any, time: Any) -> Any:
        load = np.column_stack([np.cos(time), 5.0 * np.sin(3.0 * time)])
        return SimpleNamespace(mesh_torque=load + 7.0, joint_friction=np.full(load.shape, 7.0))

    monkeypatch.setattr(inverse, "demanded", demanded)
    time = np.array([0.1, 0.4, 0.9])
    first, second = inverse._wind_up_derivatives(made, time, 1e-3)
    load, rate, bend = 5.0 * np.sin(3.0 * time), 15.0 * np.cos(3.0 * time), -45.0 * np.sin(3.0 * time)
    slope = 1e-3 + 2e-5 * load
    np.testing.assert_allclose(first[:, 1], slope * rate, rtol=1e-4)
    np.testing.assert_allclose(second[:, 1], slope * bend + 2e-5 * rate**2, rtol=1e-4)
    assert not first[:, 0].any() and not second[:, 0].any()


# --- walls

# masses [kg], point [m], normal, stiffness [N/m], damping [N s/m], step [s], speeds [m/s]
WALLS: Any = (
    ((0.018, 0.031, 0.01), (-1.3e-4, -3.8e-4, 7.3e-4), (0.73, 0.27, -0.63), 1.3e6, 58.0, 2e-3, (-1.0, 0.5, 0.3)),
    ((0.023, 0.045, 0.014), (-2e-4, 4.4e-4, 2e-4), (0.25, 0.9, -0.37), 7.3e5, 23.0, 3e-3, (-0.9, 0.01, -0.3)),
    ((0.048, 0.014, 0.051), (-1.1e-4, -7.4e-4, -6.3e-4), (-0.33, -0.69, -0.65), 5.1e6, 0.0, 3e-3, (2.0, -0.02, 0.5)),
    ((0.024, 0.011, 0.011), (3.7e-4, 3.3e-4, -7.5e-4), (0.69, -0.48, -0.53), 4.5e5, 130.0, 4e-3, (0.3, -0.5, 1.0)),
    ((0.024, 0.013, 0.021), (9.3e-4, -1.5e-4, 7.7e-4), (0.14, 0.72, 0.68), 1.1e6, 0.0, 3e-3, (-1.0, -0.8, 1.0)),
)


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_force_at_the_tip_is_found_when_it_is_the_expected_one(axis: int, way: float, monkeypatch: Any) -> None:
    """To 1e-12 of the force, or what rounding of place and speed does to a stiff wall; too little or too much."""

    def found(off: float, stiffness: float = 0.0, place: float = 0.0, speed: float = 0.0) -> bool:
        tip, expected = SimpleNamespace(**{name: np.zeros(3) for name in ("force", "place", "speed")}), np.zeros(3)
        tip.force[:], expected[:] = 50.0 * way, 50.0 * way
        expected[axis] += off
        tip.place[axis], tip.speed[axis] = -way * place, way * speed
        tip.damping, tip.stiffness = np.zeros(6), stiffness * np.array([1.0, 0.1, 0.1, 1.0, 0.1, 1.0])
        monkeypatch.setattr(bodies, "world_of", lambda run: SimpleNamespace(tip=tip))
        monkeypatch.setattr(bodies, "engine_of", lambda run: SimpleNamespace(tip_expected=expected))
        return bool(bodies.tip_converged(None, 1e-3))

    for sign in (1.0, -1.0):
        assert found(0.9 * 50e-12 * sign) and not found(1.2 * 50e-12 * sign) and not found(30.0 * sign)
        # 2e-15 of stiffness times distance, with a metre more; and of stiffness times step times speed.
        assert found(sign * 1e-7, 1e7, place=9.0) and not found(sign * 1e-7, 1e7) and not found(sign * 3e-7, 1e7, 9.0)
        assert found(sign * 1e-7, 1e7, speed=9e3) and not found(sign * 3e-7, 1e7, speed=9e3)


@pytest.mark.parametrize("case", WALLS)
def test_a_stiff_wall_is_met_to_rounding_however_its_force_jumps_in_a_step(case: Any) -> None:
    """Light masses that go far through it in a step: momentum changes along its normal only, energy is accounted."""
    masses, point, normal, stiffness, damping, step, speed = case
    home, screws = np.tile(np.eye(4), (3, 1, 1)), np.hstack([np.zeros((3, 3)), np.eye(3)])
    arm = dt.Arm.from_screws(home, screws, masses, [np.eye(3) * 1e-3] * 3, tip=np.eye(4), gravity=(0.0, 0.0, 0.0))
    scene = dt.Scene(arm, {"scene": (dt.TipContact(point, normal, stiffness, damping),)}, 8 * step, np.zeros(3),
                     np.array(speed))  # fmt: skip
    run = simulate(scene, solver=dt.FixedStep(step), interval=step, checked=False)
    assert run.counters["unsettled"] == 0 and run.counters["solves"] > 12
    assert run["scene.contact_force"].min() >= 0.0
    energy = run["stored_energy"]
    assert np.abs(run["energy_error"]).max() < 1e-10 * energy[0]
    assert np.diff(energy).max() < 1e-10 * energy[0] and (damping == 0.0) == (energy[-1] > (1.0 - 1e-9) * energy[0])
    v = np.stack([run[f"{name}.speed"] for name in arm.joint_names])
    lost = np.diff(np.cumsum(masses[::-1])[::-1, None] * v, axis=1)
    np.testing.assert_allclose(np.cross(lost, normal, axisa=0), 0.0, atol=1e-12 * np.abs(lost).max())


# step [s], stiffness [N m/rad], rotor, load [kg m^2], play [rad], speeds [rad/s], damping [N m s/rad]
SPRINGS: Any = (
    (2e-3, 6.3e6, 6.3e-5, 1.0, 1.6e-3, 3.6, -4.5, 94.0),
    (4e-3, 3.5e6, 1.4e-5, 0.012, 2.5e-3, 2.8, -2.1, 0.0),
    (1e-3, 3.5e4, 8e-6, 0.13, 3.5e-3, 13.0, -1.4, 13.0),
    (3e-3, 8.2e6, 8.3e-5, 0.013, 8.3e-3, 6.6, -2.8, 270.0),
    (4e-3, 1.6e4, 3.6e-6, 1.7, 2.3e-3, 0.35, -0.49, 0.38),
    (5e-4, 2.6e6, 1.2e-5, 0.16, 3.8e-4, 0.87, -12.0, 0.0),
)


@pytest.mark.parametrize("case", SPRINGS)
def test_flanks_are_met_to_rounding_however_their_torque_jumps_in_a_step(case: Any) -> None:
    """Rotors that strike both flanks within few steps: energy is accounted for, momentum stays."""
    step, stiffness, rotor, load, play, speed, shaft, damping = case
    gear = dt.Gear(
        "g", 10.0, stiffness_1=stiffness, backlash=play, torque_1=1e-4 * stiffness, stiffness_2=2.0 * stiffness
    )
    effects = (dt.FullRotor(rotor, 10.0), dt.Backlash(gear, damping))
    scene = dt.Scene(dt.Inertia(load), {"joint": effects}, 8 * step, speed=np.array([speed]))
    begun = {"joint.deflection": 0.0, "joint.shaft_speed": shaft}
    run = simulate(scene, solver=dt.FixedStep(step), interval=step, checked=False, start=begun)
    assert run.counters["unsettled"] == 0 and run.counters["solves"] > 12
    energy = run["stored_energy"]
    assert np.abs(run["energy_error"] - run["energy_error"][0]).max() < 1e-10 * energy[0]
    assert (damping == 0.0) == (energy[-1] > (1.0 - 1e-9) * energy[0])
    momentum = load * run["joint.speed"] + 10.0 * rotor * run["joint.motor_speed"]
    np.testing.assert_allclose(momentum, momentum[0], rtol=1e-11)


# --- what a command requires


def test_a_small_torque_takes_the_loss_of_its_own_direction() -> None:
    """A light joint that is set in motion and stopped: the motor drives its mesh, then is driven."""
    time = np.linspace(0.0, 1.0, 5)
    speed, push = np.array([0.0, 0.25, 0.5, 0.25, 0.0]), np.array([1.0, 1.0, -1.0, -1.0, -1.0])
    place = np.array([0.0, 0.03125, 0.125, 0.21875, 0.25])
    motion = dt.Motion("m", ("joint",), time, place[:, None], speed[:, None], push[:, None])
    gear = dt.Gear("g", 50.0, kind="spur", efficiency=0.8)
    effects = (dt.ReflectedRotor(1e-6, 50.0), dt.MotorCurrent(MOTOR), dt.GivenCurrent([0.0], [0.0]), dt.MeshLoss(gear))
    scene = dt.Scene(dt.Inertia(0.06), {"joint": effects, "scene": (dt.CommandedMotion(motion),)}, 1.0)
    run = simulate(scene, solver=dt.Inverse(), interval=0.25, checked=False)
    assert run["joint.mesh_torque"][:4] == pytest.approx(0.06 * push[:4])
    share = np.where(push > 0.0, 1.0 / 0.8, 2.0 - 1.0 / 0.8)
    wanted = (share * 0.06 * push) / 50.0 + 1e-6 * 50.0 * push
    assert run["joint.electromagnetic_torque"][1:4] == pytest.approx(wanted[1:4], rel=1e-12)


# --- starts


@pytest.mark.parametrize("ratio", [100.0, -100.0])
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_joint_that_gives_way_at_the_start_is_named(ratio: float, way: float) -> None:
    """Less current than holds, and a motion with the load that nobody commanded."""
    still = dt.Motion("still", ("joint",), np.array([0.0, 1.0]), *(np.zeros((2, 1)) for _ in range(3)))
    effects = (dt.FullRotor(1e-4, ratio), dt.MotorCurrent(MOTOR), dt.CascadeLoop(20.0, 0.5, 0.1))
    done = plan(dt.Scene(dt.Inertia(1.0, 5.0), {"joint": effects, "scene": (dt.CommandedMotion(still),)}, 1.0))
    # 12 N m of load and 3 N m that help to carry it; a current of 2 A, a drag of 0.01 N m at the motor.
    holding = (9.0 * way / ratio + 0.01 * way) / 0.03

    def told(current: float = 2.0, acceleration: float = -0.4, **more: float) -> Any:
        flows = math.copysign(current, holding)
        row = {"bias_torque": 12.0 * way, "joint_torque": 3.0 * way, "current": flows, "command_speed": 0.0,
               "motor_torque": 0.03 * flows - 0.01 * way, "motor_acceleration": acceleration * way * ratio,
               "command_acceleration": 0.0, **more}  # fmt: skip
        return starting.yielding_joints(done, {f"joint.{name}": value for name, value in row.items()})

    (event,) = told()
    flows = math.copysign(2.0, holding)
    assert (event.time, event.name) == (
        0.0,
        "start",
    ) and f"{holding:.3g} A would hold it, {flows:.3g} A flow" in event.detail
    assert told(abs(holding) * 0.999) and told(acceleration=-2e-6)
    for nothing in (
        told(abs(holding) * 1.001), told(abs(holding)), told(acceleration=0.4), told(acceleration=2e-6),
        told(acceleration=-5e-7), told(command_speed=0.1), told(command_acceleration=-0.1),
    ):  # fmt: skip
        assert not nothing
    assert not starting.yielding_joints(done, {"joint.current": 1.0})
    rows = {"joint.current": -0.05}
    assert starting.start_description(done, rows, {}) == "equilibrium, held by joint -0.05 A"
    assert starting.start_description(done, {"joint.current": 0.0}, {"x": 1.0}) == "equilibrium; given: x"
