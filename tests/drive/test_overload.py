"""How long an amplifier bears more than its continuous current: worked numbers, and a plain march over many cycles."""

from __future__ import annotations

import math

import numpy as np
import pytest

from drivetrain.drive.amplifier import AmplifierSheet, judges_overload, overload_share

TIMED = AmplifierSheet("A", continuous_current=5.0, peak_current=10.0, peak_time=3.0)
FIRST_ORDER = AmplifierSheet("A", continuous_current=5.0, peak_current=10.0, thermal_time_constant=3.5)
CYCLE = np.array([9.0, 9.0, 0.0, 0.0]), np.array([0.0, 2.0, 2.0, 7.0])  # 9 A for 2 s, nothing for 5 s


def overload(sheet: AmplifierSheet, current: np.ndarray, time: np.ndarray) -> float:
    """What a cycle of samples uses up."""
    return float(overload_share(sheet, current, 1.0, np.append(np.diff(time), 0.0), np.array([0, len(time)])))


def pieces(a: float, b: float, step: float) -> list[tuple[float, float]]:
    """Mean square and length of a step with a straight current, in two where it passes 5 A."""
    cuts = [x for x in ((5.0 - a) / (b - a), (-5.0 - a) / (b - a)) if 0.0 < x < 1.0] if a != b else []
    edges = [0.0, *sorted(cuts), 1.0] if len(cuts) == 1 else [0.0, 1.0]
    ends = [a + (b - a) * x for x in edges]
    return [
        ((c * c + c * d + d * d) / 3.0, (y - x) * step)
        for c, d, x, y in zip(ends[:-1], ends[1:], edges[:-1], edges[1:], strict=True)
    ]


def test_the_worked_cycle() -> None:
    """112 of 225 A^2 s by its peak time; 1.63 of a time constant of 3.5 s: that one trips."""
    assert overload(TIMED, *CYCLE) == pytest.approx(112.0 / 225.0)
    assert overload(FIRST_ORDER, *CYCLE) == pytest.approx(1.63, abs=5e-3)


@pytest.mark.parametrize(("sheet", "lasts"), [(FIRST_ORDER, 3.5 * math.log(4.0 / 3.0)), (TIMED, 3.0)])
def test_twice_the_current_from_rest_uses_up_what_an_amplifier_bears(sheet: AmplifierSheet, lasts: float) -> None:
    """1.007 s of a constant of 3.5 s: tau ln(r^2/(r^2 - 1))."""
    long = 1e4  # s without current, after which nothing is left of the peak
    found = overload(sheet, np.array([10.0, 10.0, 0.0, 0.0]), np.array([0.0, lasts, lasts, long]))
    assert found == pytest.approx(1.0, rel=1e-9)


@pytest.mark.parametrize("sheet", [TIMED, FIRST_ORDER])
@pytest.mark.parametrize("seed", range(8))
def test_a_march_over_many_cycles_ends_there(sheet: AmplifierSheet, seed: int) -> None:
    rng = np.random.default_rng(seed)
    time = np.concatenate([[0.0], np.cumsum(rng.uniform(0.05, 1.5, 12))])
    current = rng.uniform(-7.0, 7.0, 13)
    held, largest = 0.0, 0.0
    steps = [one for row in zip(current[:-1], current[1:], np.diff(time), strict=True) for one in pieces(*row)]
    for round_ in range(200):
        for value, step in steps:
            if sheet is TIMED:
                held = max(held + (value - 25.0) * step, 0.0)
            else:
                held += (value / 25.0 - held) * (1.0 - math.exp(-step / 3.5))
            if round_ > 100:
                largest = max(largest, held)
    mean = sum(value * step for value, step in steps) / time[-1]
    if sheet is TIMED:
        wanted = math.inf if mean > 25.0 else largest / 225.0
    else:
        wanted = largest
    assert overload(sheet, current, time) == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize("sheet", [TIMED, FIRST_ORDER])
def test_coarse_samples_of_a_ramp_tell_what_fine_ones_do(sheet: AmplifierSheet) -> None:
    """50 samples for 20 000: a current that rises is more in an interval than at its beginning."""
    corners, time = np.array([0.0, 9.0, 0.0, 0.0]), np.array([0.0, 1.2, 1.5, 5.0])
    fine, coarse = np.linspace(0.0, 5.0, 20001), np.linspace(0.0, 5.0, 51)
    found = [overload(sheet, np.interp(one, time, corners), one) for one in (coarse, fine)]
    # a straight current has its exact integral; in the first-order model its mean counts over a step of tau/35
    assert found[0] == pytest.approx(found[1], rel=1e-9 if sheet is TIMED else 0.014)
    assert found[0] > 0.07


def test_what_a_sheet_lacks_is_not_answered() -> None:
    bare = AmplifierSheet("A", continuous_current=5.0)
    assert not judges_overload(bare) and not judges_overload(AmplifierSheet("A"))
    assert overload(AmplifierSheet("A", continuous_current=5.0, peak_current=5.0, peak_time=1.0), *CYCLE) == math.inf


@pytest.mark.parametrize("sheet", [TIMED, FIRST_ORDER])
def test_no_order_of_the_parts_of_a_mix_uses_up_more(sheet: AmplifierSheet) -> None:
    """One part works hard at its end, the next one at its start: a march over both, and over random orders."""
    rows = [np.array(row) for row in ([2.0, 2.0, 2.0, 9.0, 9.0], [8.5, 8.5, 1.0, 1.0, 1.0], [3.0, 6.0, 3.0, 2.0, 1.0])]
    # the current jumps within each part, and its last sample has no step
    steps = np.array([[4.0, 1.5, 0.0, 1.2, 0.0], [1.2, 0.0, 1.5, 4.0, 0.0], [4.0, 1.5, 0.5, 1.2, 0.0]])
    rng = np.random.default_rng(3)
    held, largest, room = 0.0, 0.0, 225.0 if sheet is TIMED else 1.0
    for part in [*(40 * [0] + [1]), *rng.integers(0, 3, 400), *(40 * [0] + [1])]:
        row = rows[part]
        for a, b, step in zip(row[:-1], row[1:], steps[part, :-1], strict=True):
            for square, length in pieces(a, b, step):
                if sheet is TIMED:
                    held = max(held + (square - 25.0) * length, 0.0)
                else:
                    held += (square / 25.0 - held) * (1.0 - math.exp(-length / 3.5))
                largest = max(largest, held)
    edges = np.array([0, 5, 10, 15])
    found = overload_share(sheet, np.concatenate(rows), 1.0, steps.ravel(), edges)
    assert found == pytest.approx(largest / room, rel=1e-9)
    alone = [overload_share(sheet, row, 1.0, step, edges[:2]) for row, step in zip(rows, steps, strict=True)]
    assert found > 1.2 * max(alone)
