"""Parts of tolerance sampling written out: intervals, shares of variance, tables, samples at the edges."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from built_sample import built
from scipy.stats import f_oneway

import drivetrain as dt
from drivetrain.catalog.read import Catalog
from drivetrain.drive.amplifier import Supply
from drivetrain.sizing.tolerance.draws import EFFICIENCY, Draws, Source, deviated
from drivetrain.sizing.tolerance.monte_carlo import Chance, robustness
from drivetrain.sizing.tolerance.sampling import Samples, candidate, figures_of, judged, nominal_of
from drivetrain.sizing.tolerance.tornado import effects, variance_share
from drivetrain.study.parts.tolerances import Tolerance, Tolerances

Z = 1.959963984540054  # of 95 %


@pytest.mark.parametrize(("held", "samples"), [(1, 7), (3, 10), (9, 10), (250, 1000), (999, 1000)])
def test_an_interval_has_the_probabilities_at_which_the_share_is_z_deviations_off(held: int, samples: int) -> None:
    """Wilson's interval: the roots of (p - share)^2 = z^2 p (1 - p)/n."""
    share, spread = held / samples, Z**2 / samples
    low, high = sorted(np.roots([1.0 + spread, -2.0 * share - spread, share**2]).real)
    found = Chance(held, samples)
    assert found.interval == pytest.approx((low, high), rel=1e-9)
    assert found.standard_error == pytest.approx((high - low) / (2.0 * Z), rel=1e-9)
    assert (found.probability, Chance(samples, samples).interval[1]) == (share, 1.0)


@pytest.mark.parametrize("count", [10, 130, 1000])
def test_a_share_of_variance_is_that_of_an_analysis_of_variance(count: int) -> None:
    """Kelley's unbiased correlation ratio of 64 bins of equal size, fewer if there are no two values for each."""
    rng = np.random.default_rng(count)
    values = 3.0 * np.arange(count) / count + rng.normal(size=count) - 40.0
    bins = np.array_split(values, min(64, count // 2))
    within = f_oneway(*bins).statistic * (len(bins) - 1) + count - len(bins)
    assert variance_share(values) == pytest.approx(1.0 - (count - 1) / within, rel=1e-9)
    assert variance_share(np.tile([0.0, 1.0], 64)) == 0.0  # every bin has the same mean: less than no share


def test_a_sample_holds_where_no_utilisation_is_above_1() -> None:
    """Each kind of utilisation alone a little over its limit, at it, unknown; data lacking; nothing wrong."""
    nan, over = math.nan, 1.05
    joints, supply, arm = np.full((6, 2, 2), 1.0), np.full((6, 3), nan), np.full((6, 2), 1.0)
    joints[1, 1, 0], supply[2, 1], arm[3, 1], lacking = over, over, over, np.zeros((6, 4), dtype=bool)
    lacking[4, 2], joints[5] = True, nan
    found = Samples(joints, supply, arm, lacking, proven=True)
    assert [np.flatnonzero(row).tolist() for row in found.failed] == [[], [1], [2], [3], [2], []]
    assert found.feasible.tolist() == [True, False, False, False, False, True]
    assert not Samples(joints, supply, arm, lacking, proven=False).feasible.any()


def judged_twice(study, draws: Draws):
    """Utilisations of joints and supply of each sample, as drawn and as a study of its own."""
    drives = {task.name: ("m1", "g1") for task in study.joints}
    (found,) = judged(candidate(nominal_of(study), drives), draws)
    alone = [figures_of(dt.evaluate(built(study, drives, draws, k))) for k in range(len(draws))]
    return (found.joints, np.array([one[0] for one in alone])), (found.supply, np.array([one[1] for one in alone]))


def same(pairs) -> None:
    for found, alone in pairs:
        np.testing.assert_allclose(found, alone, rtol=1e-11, atol=1e-12)


@pytest.mark.parametrize("drag", [{}, {"mesh_efficiency": 0.95, "drag_torque": 0.02}])
@pytest.mark.parametrize("back", [-0.4, 0.05, 0.97])
def test_gears_that_lock_or_lose_little_when_driven_back(make, back: float, drag: dict[str, float]) -> None:
    """A better gear that locks itself locks less; no efficiency exceeds 1."""
    time = np.linspace(0.0, 2.0, 41)
    torque, speed = 6.0 * np.sin(np.pi * time), np.cos(np.pi * time)
    gear = replace(make.gear, efficiency=0.95, backdriving_efficiency=back, **drag)
    study = make.study(make.table_cycle(time, torque, speed, -np.pi * np.sin(np.pi * time)),
                       catalog=Catalog({"m1": make.motor}, {"g1": gear}),
                       tolerances=Tolerances(efficiency=Tolerance(0.2)))  # fmt: skip
    factors = np.ones((3, 1, 6))
    factors[:, 0, EFFICIENCY] = 0.8, 1.0, 1.2
    same(judged_twice(study, Draws(factors, np.full(3, 25.0), np.ones((3, 1)))))


@pytest.mark.parametrize("speed", [0.02, 3.0])
def test_a_supply_that_takes_nothing_back(make, speed: float) -> None:
    """Against a limit of 0 W any power that is fed back counts as infinitely too much, none as nothing."""
    time = np.linspace(0.0, 2.0, 41)
    study = make.study(make.table_cycle(time, 0 * time - 0.4, 0 * time + speed, 0 * time),
                       supply=Supply(48.0, regenerated_power=0.0),
                       tolerances=Tolerances(resistance=Tolerance(0.2)))  # fmt: skip
    draws = Draws(np.ones((2, 1, 6)), np.full(2, 25.0), np.ones((2, 1)))
    (joints, supply) = judged_twice(study, draws)
    same((joints, supply))
    assert sorted(set(supply[0][~np.isnan(supply[0])])) in ([0.0], [np.inf])


def test_largest_loads_on_bearings_and_shafts_of_an_arm_in_space(make) -> None:
    """Moment, axial and radial force are largest at different samples, in other ones with another payload.

    The life of bearings is not asked for, so that samples at which none of them can be largest are left out.
    """
    arm = dt.load_arm("ur5")
    cycle = make.sines(6, samples=61)
    cycle = replace(cycle, joint_names=arm.joint_names, payload=np.arange(61) // 20 % 2, payload_names=("big", "small"))
    tasks = tuple(make.task(name) for name in arm.joint_names)
    study = make.study(cycle, arm=arm, joints=tasks, payloads=(make.payload(3.0, "big"), make.payload(0.05, "small")),
                       tolerances=Tolerances(payload=Tolerance(0.9)))  # fmt: skip
    shares = np.array([[0.2, 1.0, 1.0], [1.9, 1.0, 1.0], [1.0, 1.9, 1.0], [1.6, 0.3, 1.0]])  # the last: of no force
    same(judged_twice(study, Draws(np.ones((4, 6, 6)), np.full(4, 25.0), shares)))


def test_deviations_are_added_to_the_nominal_values(make) -> None:
    """Degrees to the air, kilograms or shares to the payload, shares to factors, which stay positive."""
    study = make.study(make.sines(2), arm=make.planar_arm([0.3, 0.2], [1.0, 0.5]), payloads=(make.payload(2.0),))
    for absolute, shares in ((True, [1.25, 0.0]), (False, [1.5, 0.0])):
        study = replace(study, tolerances=Tolerances(payload=Tolerance(0.5, absolute=absolute)))
        given = {Source("ambient"): [3.0, -4.0], Source("payload", "part"): [0.5, -2.5],
                 Source("resistance", "j2"): [0.2, -1.5]}  # fmt: skip
        found = deviated(study, 2, {source: np.array(values) for source, values in given.items()})
        assert found.ambient.tolist() == [28.0, 21.0] and found.loads[:, 0].tolist() == shares
        assert found.factors[0, 1].tolist() == [1.0, 1.2, 1.0, 1.0, 1.0, 1.0] and 0.0 < found.factors[1, 1, 1] < 0.1
        assert (found.factors[:, 0] == 1.0).all() and (found.loads[:, 1:] == 1.0).all()


def test_bars_and_places_of_a_tornado(make) -> None:
    """Twice the deviation of a normal distribution; the supply beside the joint, the most used first.

    The constant of the motor alone changes the current: the ambient has no effect on a motor without coefficients.
    """
    time = np.linspace(0.0, 2.0, 41)
    torque, speed = 6.0 * np.sin(np.pi * time), np.cos(np.pi * time)
    motor = replace(make.motor, magnet_coefficient=0.0, peak_current=4.0)
    study = make.study(make.table_cycle(time, torque, speed, -np.pi * np.sin(np.pi * time)),
                       catalog=Catalog({"m1": motor}, {"g1": make.gear}), supply=Supply(48.0, peak_power=100.0),
                       tolerances=Tolerances(torque_constant=Tolerance(0.05, normal=True),
                                             ambient=Tolerance(5.0, absolute=True)))  # fmt: skip
    found = effects(dt.evaluate(study))
    (bar,) = found.of("j1", "motor peak current").bars
    assert (bar.low, bar.high, bar.absolute) == (-0.1, 0.1, False)
    worst = found.worst()
    assert sorted(one.joint for one in worst) == ["j1", "supply"]
    assert [one.nominal for one in worst] == sorted((one.nominal for one in worst), reverse=True)
    told = robustness(found.evaluation, samples=1, seed=0)
    for place, checks in told.checks.items():
        rows = told.table[told.table["joint"] == place].set_index("check")
        assert list(rows.index) == list(checks)
        for name, row in rows.iterrows():
            assert tuple(row.iloc[3:]) == told.utilisations[place][name]
