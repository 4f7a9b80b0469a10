"""Laws that kernels call, each against a formula of its own: scipy's exponentials and roots, quadrature, geometry."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import expm
from scipy.optimize import brentq

from drivetrain.drive.amplifier import Amplifier, bus_peak, bus_step, overload_after, overload_allows, overload_room
from drivetrain.drive.counterbalance import Counterbalance, counterbalance_torque, gas_spring_force
from drivetrain.drive.gear import Gear, mesh_of, settled_temperature
from drivetrain.drive.motor import current_reach
from drivetrain.drive.spring import gear_spring, mean_touch, touch
from drivetrain.drive.thermal.periodic_heat import (
    Copper,
    Nodes,
    hottest_bound,
    hottest_phase,
    interval_means,
    new_losses,
    new_parts,
    periodic_heat,
    periods_of,
    quick_nodes,
    responses,
)
from drivetrain.jit import kernel
from drivetrain.records import as_record

RNG = np.random.default_rng(20)


@pytest.mark.parametrize("told", [{"thermal_time_constant": 3.0}, {"peak_time": 2.0}], ids=["mean", "integral"])
def test_what_an_overload_allows_fills_it(told: dict[str, float]) -> None:
    amplifier = as_record(Amplifier(peak_current=12.0, continuous_current=5.0, **told))
    for held, step in ((0.0, 0.01), (0.3, 0.7), (0.9, 4.0), (overload_room(amplifier), 1e-3)):
        square = overload_allows(amplifier, held, step)
        assert overload_after(amplifier, held, square, step) == pytest.approx(overload_room(amplifier), rel=1e-12)
        assert square >= 1.0 and overload_after(amplifier, held, 0.99 * square, step) < overload_room(amplifier)


def test_a_step_of_the_bus_fills_up_and_cuts_off() -> None:
    for drawn, feedable, burnable, after in (
        (2.0, math.inf, 0.0, (10.0, 2.0, 0.0)), (2.0, 0.5, 0.0, (8.5, 0.5, 0.0)), (-1.0, 9.0, 9.0, (11.0, 0.0, 0.0)),
        (-5.0, 9.0, 9.0, (12.0, 0.0, 3.0)), (-5.0, 9.0, 1.0, (14.0, 0.0, 1.0)), (0.0, 9.0, 9.0, (10.0, 0.0, 0.0)),
    ):  # fmt: skip
        assert bus_step(10.0, drawn, 10.0, 12.0, feedable, burnable) == after
    assert bus_step(5.0, 1.0, 10.0, 12.0, 2.5, 9.0) == (6.5, 2.5, 0.0)


def test_a_bus_without_resistor_is_a_reflected_walk() -> None:
    """Energy above that of the source: the sum since the least of all sums before it (Skorokhod)."""
    for _ in range(5):
        time = np.cumsum(RNG.uniform(0.01, 0.3, 20)) + 4.0
        power = 40.0 * RNG.standard_normal(20)
        power += (5.0 - np.trapezoid(power, time)) / np.ptp(time)  # it takes 5 J more than it feeds back
        turns = np.flatnonzero(power[:-1] * power[1:] < 0.0)  # the extremes of the sum lie where the power is zero
        zeros = time[turns] + np.diff(time)[turns] * power[turns] / (power[turns] - power[turns + 1])
        all_times = np.unique(np.concatenate([time, zeros]))
        drawn = np.interp(all_times, time, power)
        fed = np.concatenate([[0.0], np.tile(-0.5 * (drawn[1:] + drawn[:-1]) * np.diff(all_times), 3).cumsum()])
        above = fed - np.minimum.accumulate(fed)
        found = bus_peak(40.0, 0.02, math.inf, math.inf, time, power, 40.0)
        assert found.voltage == pytest.approx(math.sqrt(40.0**2 + 2.0 * above.max() / 0.02), rel=1e-12)
        peak = all_times[1 + (int(np.argmax(above > above.max() * (1.0 - 1e-12))) - 1) % (len(all_times) - 1)]
        assert found.sample == np.searchsorted(time, peak - 1e-9)
        burnt = bus_peak(40.0, 0.02, 41.0, 1e-3, time, power, 40.0).burnt
        room = 0.5 * 0.02 * (41.0**2 - 40.0**2)
        energy = gone = 0.0
        for k, step in enumerate(np.diff(fed)):
            energy = max(energy + step, 0.0)
            gone += max(energy - room, 0.0) if k >= 2 * (len(all_times) - 1) else 0.0
            energy = min(energy, room)
        assert burnt == pytest.approx(gone / (time[-1] - time[0]), rel=1e-9)


LEVERS = Counterbalance(900.0, 0.12, lever_carrier=0.25, lever_link=0.15, dead_centre=0.4, torque=0.8)
GAS = Counterbalance(
    gas_force=400.0, extended_length=0.42, stroke=0.25, progression=1.4, exponent=1.2, lever_carrier=0.25,
    lever_link=0.15, dead_centre=0.4,
)  # fmt: skip


def length_of(angle: float) -> float:
    return math.dist((0.25, 0.0), (0.15 * math.cos(angle - 0.4), 0.15 * math.sin(angle - 0.4)))


def test_springs_on_levers_give_back_what_they_store() -> None:
    volume = 0.25 / (1.0 - 1.4 ** (-1.0 / 1.2))  # of the gas over the rod's section: 1.4 times the force at full stroke
    for angle in (-2.0, 0.1, 0.9, 3.0):
        force = 400.0 * (volume / (volume - (0.42 - length_of(angle)))) ** 1.2
        assert gas_spring_force(as_record(GAS), length_of(angle)) == pytest.approx(force, rel=1e-12)
        gone = quad(lambda q: float(counterbalance_torque((LEVERS,), np.array(q))), 0.6, angle, epsabs=1e-10)[0]
        stored = [450.0 * (length_of(q) - 0.12) ** 2 for q in (0.6, angle)]
        assert gone == pytest.approx(0.8 * (angle - 0.6) - stored[1] + stored[0], abs=1e-9)
        pushed = quad(lambda q: float(counterbalance_torque((GAS,), np.array(q))), 0.6, angle, epsabs=1e-10)[0]
        work = quad(lambda x: 400.0 * (volume / (volume - 0.42 + x)) ** 1.2, length_of(0.6), length_of(angle))[0]
        assert pushed == pytest.approx(work, abs=1e-8)


def test_a_gear_that_warms_itself_settles_where_it_sheds_its_heat() -> None:
    gear = Gear("g", 50.0, mesh_efficiency=0.9, drag_torque=0.1, drag_speed=100.0, drag_temperature_1=0.02,
                drag_temperature_2=1e-4)  # fmt: skip
    mesh = mesh_of(as_record(gear))
    for ambient, resistance, heat, drag in ((20.0, 0.8, 3.0, 9.0), (-5.0, 1.5, 2.0, 4.0), (30.0, 0.1, 0.0, 1.0)):

        def gained(at: float, a: float = ambient, r: float = resistance, q: float = heat, d: float = drag) -> float:
            above = np.clip(at, -10.0, 40.0) - 20.0  # of the fit
            return float(a + r * (q + d * math.exp(-0.02 * above + 1e-4 * above**2)) - at)

        found = settled_temperature(mesh, ambient, resistance, heat, drag)
        assert found == pytest.approx(brentq(gained, -50.0, 200.0), abs=2e-6)


@pytest.mark.parametrize("holding", [-1.0, -0.04, 0.0, 0.04, 1.0])
def test_what_holds_a_mesh_at_rest_lies_between_least_and_most(holding: float) -> None:
    mesh = mesh_of(as_record(Gear("g", 50.0, efficiency=0.8, backdriving_efficiency=0.7, holding=holding)))
    assert mesh.holding == pytest.approx(1.0 + holding * (0.25 if holding > 0.0 else 0.3), rel=1e-12)


@pytest.mark.parametrize("inductance", [0.0, 1e-4, 2e-3])
def test_how_far_a_volt_carries_the_current(inductance: float) -> None:
    reach = current_reach(0.3, inductance, 5e-4)
    if inductance == 0.0:
        assert reach == pytest.approx((1.0 / 0.3, 1.0 / 0.3), rel=1e-14)
    else:  # I' = (1 - R I)/L, its end and its mean
        rates = np.array([[-0.3 / inductance, 1.0 / inductance, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
        current, _, area = expm(5e-4 * rates) @ [0.0, 1.0, 0.0]
        assert reach == pytest.approx((current, area / 5e-4), rel=1e-9)


SPRING = gear_spring(Gear("g", 1.0, stiffness_1=1e4, torque_1=5.0, stiffness_2=3e4, torque_2=26.0, stiffness_3=2e4))


def test_flanks_push_and_never_pull() -> None:
    flanks, damping = (-1e-3, 2e-3), 4.0
    for twist, rate, push in (
        (0.0, 3.0, (0.0, 0.0, 0.0)), (2.2e-3, 0.5, (4.0, 1e4, 4.0)), (2.2e-3, -1.0, (0.0, 0.0, 0.0)),
        (3.0e-3, -0.25, (19.0, 3e4, 4.0)), (-1.2e-3, -0.5, (-4.0, 1e4, 4.0)), (-1.2e-3, 0.6, (0.0, 0.0, 0.0)),
        (-2.0e-3, 0.25, (-19.0, 3e4, 4.0)), (2e-3, 1.0, (0.0, 0.0, 0.0)), (-1e-3, -1.0, (0.0, 0.0, 0.0)),
    ):  # fmt: skip
        assert touch(SPRING, flanks, damping, twist, rate) == pytest.approx(push, rel=1e-9, abs=1e-12)
    glued = touch(SPRING, (1e-3, 1e-3), damping, 0.8e-3, 1.0)
    assert glued == pytest.approx((-2.0 + 4.0, 1e4, 4.0), rel=1e-9)


def test_the_mean_touch_over_a_step_piece_by_piece() -> None:
    """Quadrature over stretches without kinks; growth with twist and with rate by differences."""
    flanks, damping, h = (-1e-3, 1e-3), 3.0, 1e-3
    kinks = np.array([-1e-3, 1e-3, *(s * (1e-3 + b) for s in (1, -1) for b in (SPRING.bend_1, SPRING.bend_2))])

    def whole(twist: float, rate: float) -> float:
        begin, end = twist - 0.5 * h * rate, twist + 0.5 * h * rate
        loose = [s * (1e-3 + damping * abs(rate) / 1e4) for s in (1, -1)]  # here within the first piece
        inside = sorted(x for x in [*kinks, *loose] if min(begin, end) < x < max(begin, end))
        edges = np.array([min(begin, end), *inside, max(begin, end)])
        # straight between kinks, so the middle of each stretch is its mean
        pushes = [touch(SPRING, flanks, damping, x, rate)[0] for x in 0.5 * (edges[1:] + edges[:-1])]
        return float(np.diff(edges) @ pushes / (edges[-1] - edges[0]))

    for twist, rate in RNG.uniform((-2.5e-3, -1.5), (2.5e-3, 1.5), (40, 2)):
        torque, slope, slowing = mean_touch(SPRING, flanks, damping, twist, rate, h)
        assert torque == pytest.approx(whole(twist, rate), rel=1e-9, abs=1e-12)
        d = 1e-8
        assert slope == pytest.approx((whole(twist + d, rate) - whole(twist - d, rate)) / (2.0 * d), rel=1e-5, abs=1e-3)
        d = 1e-5
        found = (whole(twist, rate + d) - whole(twist, rate - d)) / (2.0 * d)
        assert slowing == pytest.approx(found, rel=1e-5, abs=1e-4)
    assert mean_touch(SPRING, flanks, damping, 1.5e-3, 0.0, h) == touch(SPRING, flanks, damping, 1.5e-3, 0.0)


COPPER = Copper(0.31, 0.0012, 0.05, -0.001, 25.0)
TIME = np.array([0.0, 0.4, 0.9, 1.5, 1.5, 2.0, 3.1])
PARTS = (slice(0, 4), slice(4, 7))
TORQUE, LOSS = np.array([0.1, 0.4, 0.2, -0.3, 0.2, 0.2, -0.1]), np.array([1.0, 2.0, 0.5, 1.0, 0.4, 1.4, 0.8])
HELD = np.array([0.0, 0.05, 0.02, 0.0, 0.08, 0.01, 0.0])


@kernel
def judged(nodes: Any, copper: Any, periods: Any, losses: Any, parts: Any, torque: Any, loss: Any, out: Any) -> Any:
    """The periodic state, the phase that is hottest at rest, its bound, and the response to what it has alone."""
    interval_means(torque, loss, losses)
    heat = periodic_heat(nodes, copper, periods, losses, parts, 30.0)
    phase = hottest_phase(nodes, copper, periods, losses, heat, 30.0)
    bound = hottest_bound(nodes, copper, periods, losses, parts, heat.magnets, 30.0)
    rate = 1.0 / (nodes.inner * nodes.winding)
    found = responses(periods, rate, losses.held, losses.square, losses.memory)
    out[:-1], out[-1] = losses.memory[0][:-1], found.first
    return heat, phase, bound


def use_of(nodes: Nodes, held: float = 1.0, copper: Copper = COPPER, parts: Any = PARTS) -> tuple[Any, ...]:
    """What is judged with so many times ``HELD``; the losses and the responses."""
    shares = (0.3, 0.7) if len(parts) > 1 else (1.0,)
    losses, out = new_losses(len(TIME)), np.zeros(len(TIME) + 1)
    losses.held[: len(HELD)] = held * HELD
    periods = periods_of(TIME, parts, shares)
    return *judged(nodes, copper, periods, losses, new_parts(len(parts)), TORQUE, LOSS, out), losses, out


def response(rate: float, *values: np.ndarray, parts: Any = PARTS) -> list[np.ndarray]:
    """x' = rate (sum of values - x) at the samples of each part, which begins with the most that parts leave."""

    def after(start: float, value: np.ndarray, part: slice) -> np.ndarray:
        found = [start]
        for step, wanted in zip(np.diff(TIME[part]), value[part], strict=False):
            found.append(wanted + (found[-1] - wanted) * math.exp(-rate * step))
        return np.array(found)

    rounds = [(part, 1.0 - math.exp(-rate * np.ptp(TIME[part]))) for part in parts]
    left = sum(max(after(0.0, value, part)[-1] / gone for part, gone in rounds) for value in values)
    return [after(left, sum(values), part) for part in parts]


def highest(rate: float, *values: np.ndarray, parts: Any = PARTS) -> float:
    return max(one.max() for one in response(rate, *values, parts=parts))


@pytest.mark.parametrize("winding", [0.1, 1.0, 30.0])
def test_a_response_of_first_order_after_the_part_that_leaves_the_most(winding: float) -> None:
    *_, out = use_of(Nodes(1.9, 4.6, winding, 900.0))
    *_, even = use_of(Nodes(1.9, 4.6, math.nan, 900.0))
    wanted = response(1.0 / (1.9 * winding), HELD)
    assert out[-1] == pytest.approx(highest(1.0 / (1.9 * winding), HELD), rel=1e-9)
    means = [HELD[part][:-1] @ np.diff(TIME[part]) / np.ptp(TIME[part]) for part in PARTS]
    assert even[-1] == pytest.approx(max(means), rel=1e-12)
    for part, found, mean in zip(PARTS, wanted, means, strict=True):
        assert out[part] == pytest.approx(found, rel=1e-9)
        assert even[part] == pytest.approx(np.full(len(found), mean), rel=1e-12)


@pytest.mark.parametrize("nodes", [Nodes(1.9, 4.6, 4.0, 900.0), Nodes(0.0, 4.6, 40.0, math.nan)], ids=["two", "one"])
@pytest.mark.parametrize("parts", [PARTS, (slice(0, 7),)], ids=["mix", "cycle"])
def test_a_phase_that_holds_is_hotter_by_what_it_has_alone(nodes: Nodes, parts: tuple[slice, ...]) -> None:
    nodes = Nodes(*np.array(nodes))  # a division by zero is infinite
    heat, phase, _, losses, _ = use_of(nodes, parts=parts)
    assert heat.converged
    at, way = losses.winding_at, nodes.inner or nodes.outer
    rises = response(1.0 / (way * nodes.winding), HELD, parts=parts)
    constant = 0.05 * (1.0 - 0.001 * (heat.magnets - 25.0))
    square = np.append((TORQUE[:-1] ** 2 + TORQUE[:-1] * TORQUE[1:] + TORQUE[1:] ** 2) / 3.0, 0.0)
    most = highest(1.0 / (way * nodes.winding), square, HELD, parts=parts)
    # x = way/k^2 (R(T_peak) held + R' x (all that the phase carries)), at the most that it may carry
    cold, slope = 0.31 + 0.0012 * (heat.peak - 30.0), 0.0012
    scale = brentq(lambda s: way / constant**2 * (cold + slope * s * most) - s, 0.0, 1e6)
    wanted = max(heat.peak, *((at[part] + scale * rise).max() for part, rise in zip(parts, rises, strict=True)))
    assert wanted > heat.peak + 1.0 and phase == pytest.approx(wanted, rel=1e-9)
    calm, same, *_ = use_of(nodes, 0.0, parts=parts)
    assert same == calm.peak and use_of(nodes, 60.0, parts=parts)[1] == math.inf

    def beyond(times: float) -> float:
        """How far the rise that grows with itself is from growing to 1.05 times itself."""
        return (
            way / constant**2 * slope * highest(1.0 / (way * nodes.winding), square, times * HELD, parts=parts) - 1.05
        )

    assert use_of(nodes, brentq(beyond, 0.0, 1e4), parts=parts)[1] == math.inf


@pytest.mark.parametrize("housing", [20.0, math.nan])
def test_the_bound_of_the_hottest_phase_is_its_formula_and_a_bound(housing: float) -> None:
    heat, phase, bound, losses, _ = use_of(Nodes(1.9, 4.6, 4.0, housing))
    constant = 0.05 * (1.0 - 0.001 * (heat.magnets - 25.0))
    cold, slope = 0.31 / constant**2, 0.0012 / constant**2
    square, loss = losses.square[: len(TIME)], losses.housing[: len(TIME)]
    steps = [np.diff(TIME[part]) for part in PARTS]
    even = [
        sum(share * (x[p][:-1] @ s) / s.sum() for share, p, s in zip((0.3, 0.7), PARTS, steps, strict=True))
        for x in (square, loss)
    ]
    if math.isfinite(housing):
        even = [max(e, highest(1.0 / (4.6 * housing), x)) for e, x in zip(even, (square, loss), strict=True)]
    heating = 4.6 * even[0] + 1.9 * highest(1.0 / (1.9 * 4.0), square, HELD)
    wanted = 30.0 + (4.6 * even[1] + cold * heating) / (1.0 - slope * heating)
    assert bound == pytest.approx(wanted, rel=1e-9) and bound > phase
    assert use_of(Nodes(1.9, 4.6, 4.0, housing), copper=COPPER._replace(slope=9.0))[2] == math.inf
    almost = COPPER._replace(slope=0.95 * 0.05**2 / heating, coefficient=0.0)  # a twentieth below a runaway
    wanted = 30.0 + 20.0 * (4.6 * even[1] + 0.31 / 0.05**2 * heating)
    assert use_of(Nodes(1.9, 4.6, 4.0, housing), copper=almost)[2] == pytest.approx(wanted, rel=1e-8)


def test_a_quicker_winding_takes_its_share_of_the_way() -> None:
    assert quick_nodes(Nodes(1.9, 4.6, 4.0, 900.0), 3.0) == pytest.approx((1.9, 4.6, 3.0 / 1.9, 900.0), rel=1e-14)
    found = quick_nodes(Nodes(0.0, 4.0, 50.0, math.nan), 3.0)
    assert found.inner + found.outer == pytest.approx(4.0, rel=1e-14) and found.inner == pytest.approx(2.2)  # 55 %
    assert (found.winding, found.housing) == pytest.approx((3.0 / found.inner, 50.0), rel=1e-14)
