"""Terms, thresholds and missing values of laws that usual numbers hide: each where it alone decides."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import mpmath as mp
import numpy as np
import pytest

from drivetrain.drive.amplifier import AmplifierSheet, overload_share
from drivetrain.drive.gear import Gear, mesh_of, mesh_torque
from drivetrain.drive.stops import Braking, stop_swing, swing_spring, swung_torque
from drivetrain.drive.thermal.periodic_heat import Flow, Losses, Steps, new_losses, set_steps, shares_within
from drivetrain.jit import kernel
from drivetrain.records import as_record


@kernel
def steps_and_shares(lengths: Any, losses: Any, flow: Any, rate: Any, share: Any) -> None:
    set_steps(lengths, losses, 0, len(lengths), flow)
    shares_within(rate, lengths, share)


def exact_step(flow: Flow, square: float, loss: float, step: float) -> list[float]:
    """As ``Steps``, from the exponential of one matrix for both rises, the integral of the first, and a constant."""
    growth, source = flow.growth * square - flow.a, flow.source * square + flow.inside * loss
    rates = [[growth, flow.b, 0.0, source], [flow.c, -flow.d, 0.0, flow.outside * loss + flow.injected], [1, 0, 0, 0]]
    with mp.workdps(40):
        change = mp.expm(mp.matrix([*rates, [0, 0, 0, 0]]) * mp.mpf(step)) - mp.eye(4)
        places = (0, 0), (0, 1), (1, 0), (1, 1), (0, 3), (1, 3), (2, 0), (2, 1), (2, 3)
        return [float(change[place]) for place in places]


FLOWS = {  # the rate of that name is by far the largest: the terms of a series are as large as they can be
    "winding": Flow(1.0, 0.01, 0.02, 0.03, 0.02, 0.7, 0.3, 0.4, 0.05),
    "housing": Flow(0.02, 0.03, 0.01, 1.0, 0.03, 0.7, 0.3, 0.4, 0.05),
    "winding by housing": Flow(0.01, 1.0, 0.03, 0.02, 0.02, 0.7, 0.3, 0.4, 0.05),
    "housing by winding": Flow(0.02, 0.03, 1.0, 0.01, 0.03, 0.7, 0.3, 0.4, 0.05),
    "growth": Flow(0.02, 0.015, 0.01, 0.03, 1.0, 0.7, 0.3, 0.4, 0.05),
}


@pytest.mark.parametrize("flow", FLOWS.values(), ids=FLOWS)
def test_steps_of_any_length_to_the_last_digits(flow: Flow) -> None:
    """From far below the lengths for which a series is used to far above, each by itself and all at once."""
    square, loss = 1.3, 0.8
    whole = flow.b + flow.c + flow.d + max(flow.a, flow.growth * square - flow.a)
    lengths = np.array([1e-6, 0.01, 0.049, 0.051, 0.3, 3.0]) / whole
    wanted = np.array([exact_step(flow, square, loss, step) for step in lengths]).T

    def found(some: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        losses: Losses = new_losses(len(some))
        losses.square[:], losses.housing[:] = square, loss
        share = np.zeros(len(some))
        steps_and_shares(some, losses, flow, flow.a, share)
        return losses.memory[:, :-1], share

    together, shares = found(lengths)
    alone = np.hstack([found(lengths[k : k + 1])[0] for k in range(len(lengths))])
    for name, one, other, exact in zip(Steps._fields, alone, together, wanted, strict=True):
        for part in (one, other):
            # Sums of a few rounded terms; long steps take differences of two functions, which cost some digits.
            np.testing.assert_allclose(part[:3], exact[:3], rtol=3e-14, err_msg=name)
            np.testing.assert_allclose(part[3:], exact[3:], rtol=1e-11, err_msg=name)
    # The first term that its series leaves out is 0.05^7/8!.
    np.testing.assert_allclose(shares, -np.expm1(-flow.a * lengths), rtol=2e-14)


RATIO_50 = {"key": "g", "ratio": -50.0}
APART = {"mesh_efficiency": 0.8, "drag_torque": 0.2, "drag_speed": 100.0, "drag_speed_exponent": 0.5,
         "drag_temperature_1": 0.02, "drag_temperature_2": 1e-4}  # fmt: skip
PLAIN = {"driving": 1.0, "driven": 1.0, "holding": 1.0, "grip": 0.0, "drag": 0.0, "exponent": 0.0, "cooling": 0.0,
         "bend": 0.0, "seal": 0.0, "starting": 0.0}  # fmt: skip


@pytest.mark.parametrize(("sheet", "mesh"), [
    ({}, {}),
    ({"efficiency": 0.8}, {"driving": 1.25, "driven": 0.75}),
    ({"efficiency": 0.8, "backdriving_efficiency": 0.6}, {"driving": 1.25, "driven": 0.6}),
    ({"backdriving_efficiency": 0.6}, {}),
    ({"efficiency": 0.8, "no_load_torque": 0.1}, {"driving": 1.25, "driven": 0.75, "drag": 0.1, "starting": 0.1}),
    ({"efficiency": 0.8, "no_load_torque": 0.1, "continuous_torque": 100.0},
     {"driving": 1.2, "driven": 0.8, "drag": 0.1, "starting": 0.1}),
    ({"efficiency": 0.8, "no_load_torque": 0.9, "continuous_torque": 100.0}, {"drag": 0.9, "starting": 0.9}),
    (APART, {"driving": 1.25, "driven": 0.75, "drag": 0.02, "exponent": 0.5, "cooling": 0.02, "bend": 1e-4,
             "starting": 0.2}),
    ({**APART, "efficiency": 0.5, "no_load_torque": 0.7, "seal_drag_torque": 0.3, "starting_torque": 0.1},
     {"driving": 1.25, "driven": 0.75, "drag": 0.02, "exponent": 0.5, "cooling": 0.02, "bend": 1e-4, "seal": 0.3,
      "starting": 0.3}),
    ({"mesh_efficiency": 0.8}, {}),
    ({"drag_torque": 0.2}, {"drag": 0.2, "starting": 0.2}),
    ({"efficiency": 0.8, "drag_torque": 0.2, "drag_speed_exponent": 0.5, "starting_torque": 0.4},
     {"drag": 0.2, "exponent": 0.5, "starting": 0.4}),
    ({"efficiency": 0.4}, {"driving": 2.5, "driven": -0.5}),
    ({"efficiency": 0.4, "holding": 1.0, "starting_torque": 0.1},
     {"driving": 2.5, "driven": -0.5, "holding": 2.5, "grip": 0.1, "starting": 0.1}),
    ({"efficiency": 0.4, "holding": -1.0, "starting_torque": 0.1},
     {"driving": 2.5, "driven": -0.5, "holding": 0.0, "grip": -0.1, "starting": 0.1}),
    ({"efficiency": 0.8, "stage_driving": 1.1, "stage_driven": 0.9, "load_friction": 0.1, "holding": 1.0},
     {"driving": 1.25 * 1.21, "driven": 0.75 * 0.81, "holding": 1.25 * 1.21}),
    ({"efficiency": 0.8, "stage_driven": -0.2, "load_friction": 0.1}, {"driving": 1.375, "driven": -0.225}),
], ids=str)  # fmt: skip
def test_the_mesh_of_a_sheet_with_gaps(sheet: dict[str, Any], mesh: dict[str, float]) -> None:
    """Lossless and without drag where nothing is known; 5 N m at the output are 0.1 N m at the input."""
    found = mesh_of(as_record(Gear(**RATIO_50, **sheet)))
    assert found._asdict() == pytest.approx({"ratio": -50.0, **PLAIN, **mesh}, rel=1e-14, abs=1e-15)


@pytest.mark.parametrize(("holding", "held"), [(1.0, 0.1), (0.0, 0.0), (-1.0, 0.0)])
def test_a_gear_at_rest_without_load_is_held_as_with_a_load_of_rounding(holding: float, held: float) -> None:
    """With the most that it may hold, its breakaway torque; a turning gear without load takes nothing."""
    mesh = mesh_of(as_record(Gear(**RATIO_50, efficiency=0.8, holding=holding, starting_torque=0.1)))
    assert [abs(mesh_torque(mesh, load, 0.0)) for load in (0.0, 1e-16, -1e-16)] == pytest.approx([held] * 3, abs=1e-15)
    assert mesh_torque(mesh, 0.0, 0.3) == 0.0


def test_just_the_continuous_current_is_no_overload() -> None:
    """Forever at the limit, and around it with its mean square."""
    sheet = AmplifierSheet("A", continuous_current=5.0, peak_current=10.0, peak_time=3.0)
    step, edges = np.array([1.0, 1.0, 0.0]), np.array([0, 3])
    assert overload_share(sheet, np.full(3, 5.0), 1.0, step, edges) == pytest.approx(0.0, abs=1e-12)
    assert overload_share(sheet, np.full(3, 4.9), 1.0, step, edges) == 0.0
    for slow in (sheet, replace(sheet, peak_time=None, thermal_time_constant=3.5)):
        assert overload_share(slow, np.zeros(3), 1.0, step, edges) == 0.0
    # 6 A for 10 ms: 0.11 A^2 s
    brief = np.array([6.0, 6.0, 0.0, 0.0]), 1.0, np.array([0.01, 0.0, 1.0, 0.0]), np.array([0, 4])
    assert overload_share(sheet, *brief) == pytest.approx(0.11 / 225.0)
    # 7 A for a second, 1 A for another: 24 A^2 s of 225
    around = np.array([7.0, 7.0, 1.0, 1.0])
    assert overload_share(sheet, around, 1.0, np.array([1.0, 0.0, 1.0, 0.0]), np.array([0, 4])) == pytest.approx(
        24.0 / 225.0
    )


@pytest.mark.parametrize("target", [7.0, -7.0])
def test_of_a_spring_that_may_soften_a_straight_line_is_assumed(target: float) -> None:
    """Only a spring that stiffens swings further than by its step."""
    soft = Gear("g", 50.0, stiffness_1=2e4, stiffness_2=1.5e4, stiffness_3=1e4)
    assert swung_torque(swing_spring(as_record(soft)), 2.0, target, 1.0) == pytest.approx(2.0 * target - 2.0, rel=1e-15)
    stiff = Gear("g", 50.0, stiffness_1=1e4, stiffness_2=1.5e4, stiffness_3=2e4)
    swung = target + math.sqrt(2.0) * (target - 2.0)
    assert swung_torque(swing_spring(as_record(stiff)), 2.0, target, 1.0) == pytest.approx(swung, rel=1e-15)


def test_a_stop_swings_a_straight_spring_at_its_begin_or_at_its_end() -> None:
    """Past the new torque by the share of the step, and no further than a rotor that stops at once."""
    rng, straight = np.random.default_rng(9), swing_spring(as_record(Gear("g", 50.0, stiffness_1=1e4)))
    decided = []
    for before, braking, static in rng.normal(size=(60, 3)) * [10.0, 20.0, 15.0]:
        begun, ended = abs(braking + 0.7 * (braking - before)), abs(static + 0.7 * (static - braking))
        hard = abs(static) + abs(before - static) + 0.2 * math.sqrt(1e4 * 1.5)
        found = stop_swing(straight, 1e4, 0.7, Braking(braking, -3.0), static, before, 1.5, -0.2)
        assert found == pytest.approx(min(max(begun, ended), hard), rel=1e-12)
        decided.append((int(np.argmax([begun, ended])), hard < max(begun, ended), braking > 0.0, static > 0.0))
    assert len({one for one in decided if not one[1]}) == 8  # begin and end, each with all signs, decide in some
