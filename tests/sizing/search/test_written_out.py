"""Parts of the search against enumeration and linear programs, on numbers made by hand."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import linprog

import drivetrain as dt
from drivetrain.catalog.read import Catalog
from drivetrain.drive.amplifier import Supply
from drivetrain.drive.friction import Friction
from drivetrain.errors import InputError
from drivetrain.sizing.results import DriveSet
from drivetrain.sizing.search import rejected
from drivetrain.sizing.search.candidates import build_candidates
from drivetrain.sizing.search.constraints.chance import Decision, Trial
from drivetrain.sizing.search.constraints.common_parts import NO_PART, CommonParts
from drivetrain.sizing.search.constraints.stiffness import lagrangian_bound
from drivetrain.sizing.search.constraints.supply import power_range
from drivetrain.sizing.search.domains import Domain, cheapest_pairs, exclude_cheapest
from drivetrain.sizing.search.problem import build_problem
from drivetrain.sizing.search.propagate import ParameterRanges
from drivetrain.sizing.search.robust import RobustSelection
from drivetrain.sizing.search.search_region import filter_candidates
from drivetrain.sizing.tolerance.monte_carlo import Chance
from drivetrain.study.model import Mount
from drivetrain.study.parts.selection import Wanted


def domains_of(costs) -> tuple[Domain, ...]:
    """A domain for each joint; pairs are numbered through."""
    first = np.cumsum([0, *map(len, costs)])
    return tuple(
        Domain(np.arange(start, start + len(cost)), np.asarray(cost), np.zeros(len(cost), np.bool_), float(min(cost)))
        for start, cost in zip(first, costs, strict=False)
    )


def sets_of(domains) -> set[tuple[int, ...]]:
    return set(itertools.product(*(one.pairs.tolist() for one in domains)))


def test_all_sets_but_the_cheapest_are_in_one_part_each() -> None:
    domains = domains_of([[3.0, 1.0, 2.0], [5.0], [1.0, 0.5]])
    parts = [sets_of(one) for one in exclude_cheapest(domains)]
    assert sum(map(len, parts)) == 5 and set.union(*parts) == sets_of(domains) - {cheapest_pairs(domains)}


@pytest.mark.parametrize("most", [1, 2])
@pytest.mark.parametrize("seed", range(12))
def test_limits_of_common_parts(seed: int, most: int) -> None:
    """Three of four joints, labels drawn, some of which do not count: bound, removals and branches by enumeration."""
    rng = np.random.default_rng(seed)
    costs = [rng.uniform(1.0, 9.0, rng.integers(2, 6)) for _ in range(4)]
    domains, label = domains_of(costs), rng.integers(-1, 4, sum(map(len, costs)))
    cost, rule = np.concatenate(costs), CommonParts("types", label, (0, 1, 3), most)

    def kept(one) -> bool:
        return len({int(label[one[j]]) for j in (0, 1, 3)} - {NO_PART}) <= most

    price = {one: float(cost[list(one)].sum()) for one in sets_of(domains) if kept(one)}
    assert all(rule.satisfied(one) == kept(one) for one in sets_of(domains))
    least = min(price.values(), default=math.inf)
    for limit in (math.inf, 1.2 * least, 0.9 * least):
        bound = rule.bound(domains, limit)
        assert bound == pytest.approx(least, rel=1e-12) if most == 1 else bound <= least * (1.0 + 1e-12)
        left = rule.propagate(domains, limit)
        wanted = {one for one, paid in price.items() if paid < limit}
        assert wanted <= (set() if left is None else sets_of(left))
        if most == 1 and left is not None and all(len(set(label[one.pairs])) > 1 for one in domains):
            used = {int(label[one[j]]) for one in wanted for j in (0, 1, 3)} | {NO_PART}
            assert all(set(label[left[j].pairs].tolist()) <= used for j in (0, 1, 3))
    if not kept(cheapest_pairs(domains)):
        branches = [sets_of(one) for one in rule.branch(domains)]
        assert set(price) <= set.union(set(), *branches) and sum(map(len, branches)) <= len(sets_of(domains))
        assert all(one < sets_of(domains) for one in branches)


@pytest.mark.parametrize("seed", range(8))
def test_the_bound_of_a_shared_budget_is_that_of_a_linear_program(seed: int) -> None:
    """Shares of each candidate add up to a budget; the relaxed choice of one candidate a joint, by scipy."""
    rng = np.random.default_rng(seed)
    costs, shares = ([rng.uniform(1.0, 9.0, size) for size in (4, 6, 3)] for _ in range(2))
    shares[1][2] = math.inf
    domains, cost, share = domains_of(costs), np.concatenate(costs), np.concatenate(shares)
    budget = float(np.quantile([sum(one) for one in itertools.product(*shares)], 0.1 + 0.1 * seed))
    places, limited = np.repeat(np.arange(3), (4, 6, 3)), np.where(np.isinf(share), 1e9, share)
    relaxed = linprog(cost, limited[None], [budget], (np.arange(3)[:, None] == places).astype(float), np.ones(3))
    within = {one: float(cost[list(one)].sum()) for one in sets_of(domains) if share[list(one)].sum() <= budget}
    limit = 1.3 * min(within.values())
    bound, masks = lagrangian_bound(domains, shares, budget, limit)
    assert bound == pytest.approx(relaxed.fun, rel=1e-9)
    left = set(itertools.product(*(one.pairs[mask].tolist() for one, mask in zip(domains, masks, strict=True))))
    assert {one for one, paid in within.items() if paid < limit} <= left
    unfit = [share[one.pairs] > budget - sum(min(s) for k, s in enumerate(shares) if k != j) + 1e-12
             for j, one in enumerate(domains)]  # fmt: skip
    assert not any((mask & out).any() for mask, out in zip(masks, unfit, strict=True))
    assert lagrangian_bound(domains, shares, sum(map(min, shares)) - 1e-6, limit)[0] == math.inf


@pytest.mark.parametrize("seed", range(6))
def test_candidates_that_may_be_part_of_a_better_set(seed: int) -> None:
    """Kept where some zone lies above the candidate with the best others that its utilisation admits, one by one."""
    rng = np.random.default_rng(seed)
    values, used = [rng.random((5, 2)) for _ in range(3)], [rng.random(5) for _ in range(3)]
    corners, caps = rng.uniform(0.5, 1.6, (7, 2)), rng.uniform(0.2, 1.0, 7)

    def near(joint: int, row: int, zone: int) -> bool:
        others = [v[u < caps[zone]] for k, (v, u) in enumerate(zip(values, used, strict=True)) if k != joint]
        return bool(
            used[joint][row] < caps[zone]
            and all(map(len, others))
            and (values[joint][row] + sum(one.min(axis=0) for one in others) < corners[zone]).all()
        )

    masks = [[any(near(j, k, z) for z in range(7)) for k in range(5)] for j in range(3)]
    found = filter_candidates(values, used, corners, caps)
    if not all(map(any, masks)):
        assert found is None
    else:
        assert found is not None and [one.tolist() for one in found[0]] == masks
        assert found[1] == pytest.approx(sum(one.min(axis=0) for one in values))
        assert found[2] == max(one.min() for one in used)


def test_what_is_proven_of_a_set_that_holds_often_enough() -> None:
    """Better sets are those that do not hold, up to an equal objective; an open one or a lower bound proves nothing."""

    def tried(objective: float, decision: Decision) -> Trial:
        return Trial(DriveSet({}, objective, {}), Chance(1, 2), decision)

    chosen = tried(10.0, Decision.HOLDS)
    fallen = [tried(value, Decision.FALLS) for value in (9.0, 10.0 * (1.0 + 5e-10), 10.1, 11.5)]
    found = RobustSelection(0.9, 0.99, chosen, (*fallen, chosen), False, bound=10.0 * (1.0 - 5e-10))
    assert (
        found.better == tuple(fallen[:2]) and found.proven and "2 better sets do not (99 % confidence)" in found.proof
    )
    near = replace(found, trials=(*fallen, tried(9.5, Decision.OPEN), chosen))
    assert not near.proven and "2 better sets do not" in near.proof and "1 better sets are too near" in near.proof
    early = replace(found, bound=9.9)
    assert not early.proven and early.proof.endswith("sets from an objective of 9.9 on are left")
    nothing = replace(found, chosen=None, exhausted=True)
    assert nothing.better == nothing.trials and nothing.proven


def lossless(make, inertias, mounts):
    """Two joints with copies of a motor and a gear without losses, ``inertias`` of their rotors, friction at joints."""
    plain = replace(make.motor, resistance=1e-9, no_load_current=None, no_load_speed=None, coulomb_friction=0.0,
                    viscous_friction=0.0, resistance_winding_housing=None)  # fmt: skip
    motors = {f"m{i}": replace(plain, key=f"m{i}", rotor_inertia=float(one)) for i, one in enumerate(inertias)}
    gear = replace(make.gear, efficiency=1.0)
    pairs = tuple((key, "g1") for key in motors)
    tasks = tuple(
        make.task(f"j{i + 1}", drive=None, pairs=pairs, mount=mount, friction=Friction(2.0, viscous=0.7))
        for i, mount in enumerate(mounts)
    )
    return make.study(make.sines(2, samples=41), arm=make.planar_arm([0.4, 0.3], [1.0, 0.6]), joints=tasks,
                      catalog=Catalog(motors, {"g1": gear}), supply=Supply(48.0, peak_power=500.0))  # fmt: skip


@pytest.mark.parametrize("mounts", [(Mount("child", 0.1), Mount()), (Mount(), Mount("child", -0.2))])
def test_power_of_many_candidates_without_losses(make, mounts) -> None:
    """Of 30 equal candidates the bound is their power; of 30 unlike ones it is below that of every one."""
    for inertias in (np.full(30, 3e-5), np.linspace(1e-5, 2e-4, 30)):
        study = lossless(make, inertias, mounts)
        problem = build_problem(build_candidates(study), study.wanted)
        domains = problem.domains()
        lower, upper = power_range(problem, domains, ParameterRanges(*problem.ranges(domains)), both=False)
        assert np.isinf(upper).all()
        for key in ("m0", "m29"):
            drawn = sum(one.series.electrical_power for one in dt.evaluate(study, (key, "g1")).joints.values())
            if inertias[0] == inertias[-1]:
                np.testing.assert_allclose(lower, drawn, atol=1e-5 * np.abs(drawn).max())
            assert (lower <= drawn + 1e-5 * np.abs(drawn).max()).all()


def test_candidates_are_judged_as_evaluate_does(make) -> None:
    """A share of the load as friction, however small, costs energy and counts in every check of each candidate."""
    gears = {
        f"g{i}": replace(make.gear, key=f"g{i}", ratio=20.0 + 30.0 * i, efficiency=0.7 + 0.1 * i) for i in range(3)
    }
    own = make.task("j1", drive=None, pairs=tuple(("m1", key) for key in gears), friction=Friction(load_share=0.06))
    study = make.study(make.sines(1), arm=make.planar_arm([0.4], [1.0]), joints=(own,),
                       catalog=Catalog({"m1": make.motor}, gears))  # fmt: skip
    problem = build_problem(build_candidates(study), study.wanted)
    found = problem.candidates.judge(0, problem.eligible[0], np.zeros((1, 5)), until=math.inf, quick=False)
    for pair, used, case in zip(problem.eligible[0], found.utilisation, found.cases, strict=True):
        one = dt.evaluate(study, problem.candidates.keys(int(pair)))
        assert used == pytest.approx(one.binding[1].utilisation, rel=1e-9)
        assert case["figures"]["energy"] == pytest.approx(one.criteria["energy"], rel=1e-9)


def test_feasible_candidates_far_down_the_list_are_found(make, monkeypatch) -> None:
    """The lightest 150 of 200 motors are too weak; in small batches nothing changes."""
    peaks = [1.0] * 150 + [30.0] * 50
    motors = {f"m{i:03}": replace(make.motor, key=f"m{i:03}", mass=0.1 + 1e-3 * i, peak_current=peak)
              for i, peak in enumerate(peaks)}  # fmt: skip
    time = np.linspace(0.0, 2.0, 41)
    torque, speed = 6.0 * np.sin(np.pi * time), np.cos(np.pi * time)
    own = make.task("j1", drive=None, pairs=tuple((key, "g1") for key in motors))
    study = make.study(make.table_cycle(time, torque, speed, -np.pi * np.sin(np.pi * time)), joints=(own,),
                       catalog=Catalog(motors, {"g1": make.gear}))  # fmt: skip
    whole = dt.select(study)
    fallen = list(whole.rejected_pairs)
    assert whole.drives == {"j1": ("m150", "g1")} and len(fallen) == 150
    assert [one[0] for one in whole.alternatives["j1"]] == [f"m{i}" for i in range(151, 156)]
    assert [one.check for one in fallen] == ["motor peak torque"] * 150
    monkeypatch.setattr(rejected, "MAX_BATCH", 7)
    monkeypatch.setattr(rejected, "FIRST_BATCH", 2)
    parts = dt.select(study)
    assert parts.alternatives == whole.alternatives and list(parts.rejected_pairs) == fallen
    weak = replace(study, joints=(replace(own, pairs=own.pairs[:100]),))
    nearest = dt.select(weak, advise=False)
    assert nearest.evaluation.drives["j1"] == ("m000", "g1")  # all are equally far


def test_the_account_of_what_binds(make) -> None:
    """The excess in percent with the factor that it contains, the place, and the change that is enough."""
    time = np.linspace(0.0, 2.0, 41)
    torque, speed = 6.0 * np.sin(np.pi * time), np.cos(np.pi * time)
    motor = replace(make.motor, peak_current=2.0)
    own = make.task("j1", drive=None, pairs=(("m1", "g1"),))
    study = make.study(make.table_cycle(time, torque, speed, -np.pi * np.sin(np.pi * time)), joints=(own,),
                       catalog=Catalog({"m1": motor}, {"g1": make.gear}))  # fmt: skip
    checks = dt.evaluate(study, ("m1", "g1")).joints["j1"].checks
    (drawn,) = [one.required for one in checks if one.name == "motor peak current"]
    for factor, told in ((1.0, ""), (1.5, "; safety factor 1.5 included")):
        found = dt.select(replace(study, safety=replace(study.safety, peak_torque=factor)))
        (line,) = [one for one in found.advice if one.startswith("Binding at j1: motor peak current")]
        over = 100.0 * (factor * drawn / 2.0 - 1.0)
        assert f"{factor * drawn:.4g} of 2 A" in line and f"({over:.3g} % over{told})" in line
        assert found.advice[0] == "No candidate at j1 meets all limits; the closest is m1 with g1."


def test_joints_without_known_prices(make) -> None:
    """How many candidates and rows lack one; the first three rows are named."""
    motors = {f"m{i}": replace(make.motor, key=f"m{i}", price=None) for i in range(5)}
    pairs = tuple((key, "g1") for key in motors)
    tasks = (make.task("j1", drive=None, pairs=pairs), make.task("j2", drive=None, pairs=pairs[:2]))
    study = make.study(make.sines(2), arm=make.planar_arm([0.3, 0.2], [1.0, 0.5]), joints=tasks,
                       catalog=Catalog(motors, {"g1": make.gear}))  # fmt: skip
    told = "no candidate has a known price: 5 at j1, 2 at j2; without one are the rows of 5 motors (m0, m1, m2, ...)"
    assert dt.pareto_front(study, ("mass", "price"), time_limit=30.0).left_out == {"price": told}
    with pytest.raises(InputError, match="needs a weight above 0"):
        dt.select(study, wanted=Wanted((("mass", 0.0), ("price", 0.0))))
