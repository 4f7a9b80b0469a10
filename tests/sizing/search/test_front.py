"""The Pareto front against brute force, its zones, and what it says when the time is up."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from random_tasks import feasible_sets

from drivetrain.catalog.read import Catalog
from drivetrain.drive.amplifier import Supply
from drivetrain.errors import InputError
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.search.candidates import build_candidates
from drivetrain.sizing.search.pareto import front_tree
from drivetrain.sizing.search.pareto.front import pareto_front
from drivetrain.sizing.search.pareto.front_tree import NAMES, UTILISATION, FrontTree
from drivetrain.sizing.search.problem import Problem, build_problem
from drivetrain.sizing.search.search_region import SearchRegion
from drivetrain.study.model import Mount
from drivetrain.study.parts.selection import Wanted


def random_study(make, seed, joints=2, carrier="parent", pairs_a_joint=9):
    rng = np.random.default_rng(seed)
    motors, gears = {}, {}
    for i in range(3):
        size = rng.uniform(0.6, 3.0)
        motors[f"m{i}"] = replace(
            make.motor, key=f"m{i}", mass=0.4 * size * rng.uniform(0.8, 1.3), nominal_current=5.0 * size,
            peak_current=22.0 * size, rotor_inertia=2e-5 * size**2, resistance=0.3 / size,
            price=float(rng.uniform(50, 200)), series=f"s{i % 2}",
        )  # fmt: skip
        size = rng.uniform(0.8, 3.0)
        gears[f"g{i}"] = replace(
            make.gear, key=f"g{i}", ratio=float(rng.choice([30.0, 60.0, 100.0])), mass=0.4 * size,
            repeated_peak_torque=40.0 * size, average_torque_limit=25.0 * size, momentary_torque=80.0 * size,
            price=float(rng.uniform(40, 150)), efficiency=float(rng.uniform(0.6, 0.9)),
        )  # fmt: skip
    every = list(itertools.product(motors, gears))
    cycle = make.sines(joints, samples=41, duration=2.5, size=rng.uniform(0.4, 0.9))
    tasks = tuple(
        make.task(name, drive=None, pairs=tuple(every[:pairs_a_joint]), mount=Mount(carrier, 0.05 * (i % 2)))
        for i, name in enumerate(cycle.joint_names)
    )
    supply = Supply(48.0, peak_power=float(rng.uniform(80, 600)))
    arm = make.planar_arm([0.4, 0.35, 0.3][:joints], rng.uniform(0.5, 1.5, joints))
    return make.study(cycle, arm=arm, joints=tasks, catalog=Catalog(motors, gears), supply=supply)


def brute_force(study, names, keep=lambda drives: True):
    """Vectors of all sets that hold, dominated ones taken out."""
    found = [[one.criteria[name] for name in names] for one in feasible_sets(study, keep)]
    points = np.array(found).reshape(-1, len(names))

    def beaten(point):
        less = points < point - 1e-9 * np.abs(point)
        return bool(((points <= point + 1e-9 * np.abs(point)).all(axis=1) & less.any(axis=1)).any())

    kept = [point for point in points if not beaten(point)]
    return np.unique(np.round(np.array(kept), 9), axis=0) if kept else np.zeros((0, len(names)))


def vectors(front):
    found = np.array([[point.criteria[name] for name in front.names] for point in front.points])
    return np.unique(np.round(found, 9), axis=0) if len(found) else np.zeros((0, len(front.names)))


def test_every_set_is_what_evaluate_says(make):
    study = random_study(make, 0)
    for point in pareto_front(study, ("mass", "energy")).points:
        evaluation = evaluate(study, point.drives)
        assert evaluation.feasible and evaluation.criteria == point.criteria


def test_wanted_types_and_families_are_kept(make):
    study = replace(random_study(make, 0), wanted=Wanted((("mass", 1.0),), most_motor_types=1))
    front = pareto_front(study, ("mass", "energy"))
    expected = brute_force(study, ("mass", "energy"), lambda drives: len({m for m, _ in drives.values()}) == 1)
    np.testing.assert_allclose(vectors(front), expected, rtol=1e-7)
    study = replace(study, wanted=Wanted((("mass", 1.0),), same_family=(("j1", "j2"),)))
    series = {key: row.series for key, row in study.catalog.motors.items()}
    front = pareto_front(study, ("mass", "energy"))

    def related(drives):
        return len({series[m] for m, _ in drives.values()}) == 1 and len({g for _, g in drives.values()}) == 1

    np.testing.assert_allclose(vectors(front), brute_force(study, ("mass", "energy"), related), rtol=1e-7)


def test_unknown_prices_leave_the_criterion_out(make):
    study = random_study(make, 0)
    catalog = study.catalog
    bare = Catalog({k: replace(m, price=None) for k, m in catalog.motors.items()}, catalog.gears)
    front = pareto_front(replace(study, catalog=bare), ("mass", "price", "energy"))
    assert front.names == ("mass", "energy") and "price" in front.left_out
    some = {k: replace(m, price=None if k == "m0" else m.price) for k, m in catalog.motors.items()}
    one = Catalog(some, catalog.gears)
    front = pareto_front(replace(study, catalog=one), ("mass", "price"))
    assert front.names == ("mass", "price") and any("without a known price" in note for note in front.notes)
    assert all(motor != "m0" for point in front.points for motor, _ in point.drives.values())


def test_when_the_time_is_up_it_says_so(make):
    study = random_study(make, 51, joints=3)
    front = pareto_front(study, ("mass", "energy", "utilisation"), time_limit=1e-6)
    assert not front.complete and front.gap > 0.0 and front.proof.startswith("not complete")
    whole = pareto_front(study, ("mass", "energy", "utilisation"))
    assert whole.complete
    best, known = vectors(whole), vectors(front)
    for point in known:  # nothing not found beats what was found by more than the gap in all criteria
        assert not (best < point * (1.0 - front.gap) * (1.0 - 1e-9)).all(axis=1).any()


def test_nothing_holds(make):
    study = random_study(make, 0)
    weak = Catalog({k: replace(m, peak_current=0.1) for k, m in study.catalog.motors.items()}, study.catalog.gears)
    front = pareto_front(replace(study, catalog=weak))
    assert front.complete and not front.feasible


SUBSETS = [names for count in range(1, 5) for names in itertools.combinations(NAMES, count)]


def tied_study(make, seed, coarse):
    """A study whose sheets are rounded so coarsely that sets share masses and prices, some parts being the same."""
    rng = np.random.default_rng(seed)
    carrier, joints = str(rng.choice(["parent", "child", "base"])), int(rng.integers(1, 4))
    study = random_study(make, seed, joints=joints, carrier=carrier, pairs_a_joint=6)
    motors, gears = study.catalog.motors, study.catalog.gears
    if coarse:
        motors, gears = (
            {key: replace(row, mass=round(2.0 * row.mass) / 2.0 + 0.1, price=round(row.price, -2)) for key, row in rows}
            for rows in (motors.items(), gears.items())
        )
        motors["m1"] = replace(motors["m0"], key="m1")  # the same part under another name
    return replace(study, catalog=Catalog(motors, gears))


@settings(max_examples=24, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(st.integers(0, 10**6), st.sampled_from(SUBSETS), st.booleans(), st.sampled_from([0, 4, 64]))
def test_any_criteria_with_ties_agree_with_brute_force(make, seed, names, coarse, few):
    study = tied_study(make, seed, coarse)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(front_tree, "MAX_WALKED", few)  # 0: boxes are parted to the end, none is walked through
        front = pareto_front(study, names)
    assert front.complete and front.gap == 0.0
    np.testing.assert_allclose(vectors(front), brute_force(study, names), rtol=1e-7)
    assert len(front.points) == len(vectors(front))  # of equal sets one


@pytest.mark.parametrize(("seed", "carrier"), [(29, "parent"), (0, "child"), (29, "child")])
def test_costs_of_a_box_are_below_those_of_every_set_in_it(make, seed, carrier):
    study = random_study(make, seed, joints=3 if seed else 2, carrier=carrier)
    what = build_problem(build_candidates(study), study.wanted)
    search = FrontTree(what, names=("mass", "energy", "utilisation"))
    root = search.root()
    search._weights = np.array([[0.0, 0.0, 1.0, 0.0]])
    rng, looked_at = np.random.default_rng(seed), 0
    for share in (1.0, 0.7, 0.4, 0.2):
        masks = [rng.random(len(domain)) < share for domain in root.domains]
        for mask in masks:
            mask[0] = True
        kept = tuple(domain.subset(mask) for domain, mask in zip(root.domains, masks, strict=True))
        part = search._update_costs(replace(root, domains=kept))
        if part is None:
            continue
        values = search._weighted_costs(part)
        for _ in range(25):
            at = [int(rng.integers(len(domain))) for domain in part.domains]
            evaluation = what.evaluate([int(domain.pairs[i]) for domain, i in zip(part.domains, at, strict=True)])
            if evaluation.feasible:
                looked_at += 1
                least = sum(float(one[i, 0]) for one, i in zip(values, at, strict=True))
                used = max(float(domain.cost[i, UTILISATION]) for domain, i in zip(part.domains, at, strict=True))
                assert least <= evaluation.criteria["energy"] + 1e-9
                assert used <= evaluation.criteria["utilisation"] * (1.0 + 1e-12)
    assert looked_at > 20


def test_a_stopped_search_goes_on_to_the_same_front(make):
    study, names = random_study(make, 51, joints=3), ("mass", "energy", "utilisation")
    whole = pareto_front(study, names)
    part = pareto_front(study, names, time_limit=1e-6)
    told, steps = len(part.points), 0
    first = part
    while not part.complete and steps < 500:
        part, steps = pareto_front(study, names, time_limit=1e-3, resume=part), steps + 1
    assert steps >= 1 and part.complete and part.state is None
    np.testing.assert_allclose(vectors(part), vectors(whole), rtol=1e-9)
    assert len(first.points) == told and not first.complete  # what was there before is as it was
    assert pareto_front(study, names, resume=part) is part
    with pytest.raises(InputError, match="other criteria"):
        pareto_front(study, ("mass",), resume=part)
    with pytest.raises(InputError, match="another study"):
        pareto_front(random_study(make, 28, joints=3), names, resume=first)


@pytest.mark.parametrize("dimensions", [2, 3, 4])
def test_zones_hold_exactly_what_is_not_dominated(dimensions):
    rng = np.random.default_rng(dimensions)
    zones, known = SearchRegion(np.full(dimensions, 10.0), 0.0), []
    for index, point in enumerate(rng.uniform(0.0, 1.0, (40, dimensions))):
        taken = zones.add(point, (index,))
        assert taken == (not any((old <= point).all() for old in known))
        known.append(point)
        probes = rng.uniform(0.0, 1.2, (50, dimensions))
        for probe in probes:
            free = not any((old <= probe).all() for old in known)
            assert free == bool((probe < zones.corners).all(axis=1).any())
    front = [p for p in known if not any((q <= p).all() and (q < p).any() for q in known)]
    assert len(front) == len(zones.points)
    corners = zones.corners
    assert not any((np.delete(corners, i, axis=0) >= one).all(axis=1).any() for i, one in enumerate(corners))


@pytest.mark.parametrize("dimensions", [2, 3, 4])
def test_zones_of_points_that_share_coordinates(dimensions):
    rng = np.random.default_rng(10 + dimensions)
    zones, known = SearchRegion(np.full(dimensions, 10.0), 0.0), []
    for index, point in enumerate(rng.integers(0, 5, (40, dimensions)).astype(float)):
        zones.add(point, (index,))
        known.append(point)
    for probe in itertools.product(np.arange(-0.5, 6.0, 0.5), repeat=dimensions):
        free = not any((old <= probe).all() for old in known)
        assert free == bool((np.array(probe) < zones.corners).all(axis=1).any())


def test_one_candidate_a_joint_is_not_halved_into_none(make, monkeypatch):
    """Sets found late may leave single candidates in a node whose costs are bounds still; a domain without any has no
    range of parameters, and compiled code would read beyond its end."""
    study = random_study(make, 0)
    tree = FrontTree(build_problem(build_candidates(study), study.wanted), names=("mass", "energy"))
    tree.begin()
    node, range_of = tree._root, Problem.range_of
    node = replace(node, domains=tuple(one.subset(np.arange(len(one)) == 0) for one in node.domains))
    assert node.width.any()

    def of_some(problem, domain):
        assert len(domain)
        return range_of(problem, domain)

    monkeypatch.setattr(Problem, "range_of", of_some)
    assert all(all(map(len, child.domains)) for child in tree.branch(node))
    assert tree.counters["nodes decided"] == 1


def test_bad_input_is_told(make):
    study = random_study(make, 0)
    for arguments, word in ((((),), "name one"), ((("mas",),), "mass")):
        with pytest.raises(InputError, match=word):
            pareto_front(study, *arguments)
    with pytest.raises(InputError, match="positive"):
        pareto_front(study, time_limit=0.0)
