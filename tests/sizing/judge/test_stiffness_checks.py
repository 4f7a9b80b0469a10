"""How stiff the arm must be: by hand on one joint, against displaced and shaken arms, deciding a choice."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from random_tasks import unfailed_sets

from drivetrain.arm.kinematics import tip_pose
from drivetrain.catalog.read import Catalog
from drivetrain.dynamics.mass import mass_matrix
from drivetrain.errors import InputError
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.judge.missing import gaps
from drivetrain.sizing.judge.stiffness import tip_deviation
from drivetrain.sizing.search.candidates import build_candidates
from drivetrain.sizing.search.constraints.stiffness import arm_utilisation, lagrangian_bound, min_tip_motion
from drivetrain.sizing.search.domains import Domain
from drivetrain.sizing.search.pareto.front import pareto_front
from drivetrain.sizing.search.problem import TipCut, build_problem
from drivetrain.sizing.search.search import select
from drivetrain.sizing.tolerance.draws import drawn
from drivetrain.sizing.tolerance.monte_carlo import robustness
from drivetrain.sizing.tolerance.sampling import candidate, figures_of, judged, nominal_of
from drivetrain.sizing.tolerance.tornado import effects
from drivetrain.study.model import DriveMass, Payload, StiffnessWish
from drivetrain.study.parts.mounting import loaded_arm
from drivetrain.study.parts.selection import Wanted
from drivetrain.study.parts.tolerances import Tolerance, Tolerances
from drivetrain.study.parts.verdicts import Verdict

SPRINGS = {"stiffness_1": 3000.0, "stiffness_2": 5000.0, "stiffness_3": 8000.0, "torque_1": 3.0, "torque_2": 9.0}
LOOSE = StiffnessWish(1e-3, 1.0, 1.0)  # everything told, nothing binding


def sprung(make, arm, cycle, wish=LOOSE, gear=None, **changes):
    row = replace(make.gear, **{**SPRINGS, "backlash": 1e-3, **(gear or {})})
    return make.study(cycle, arm=arm, catalog=Catalog({"m1": make.motor}, {"g1": row}), stiffness=wish, **changes)


def shared(evaluation):
    return {check.name: check for check in evaluation.shared}


def told(evaluation, name, joint="j1"):
    return next(check for check in evaluation.joints[joint].checks if check.name == name)


def test_one_joint_by_hand(make):
    """sqrt(0.7 K1/I)/2 pi; l phi(T)/0.7; l b."""
    length, mass = 0.5, 3.0
    q = np.zeros((3, 1))
    still = make.arm_cycle(np.linspace(0, 1, 3), q, q, q)
    study = sprung(make, make.planar_arm([length], [mass]), still, drive_mass=DriveMass.INCLUDED)
    evaluation = evaluate(study)
    found, inertia = shared(evaluation), 1e-4 + mass * length**2
    first = math.sqrt(0.7 * 3000.0 / inertia) / (2.0 * math.pi)
    assert found["arm first resonance"].available == pytest.approx(first, rel=1e-9)
    torque = mass * 9.81 * length
    twist = 3.0 / 3000 + 6.0 / 5000 + (torque - 9.0) / 8000
    assert found["arm tip deviation"].required == pytest.approx(length * twist / 0.7, rel=1e-9)
    assert found["arm lost motion"].required == pytest.approx(length * 1e-3, rel=1e-9)
    wanted = told(evaluation, "gear stiffness")
    assert wanted.required == pytest.approx((2.0 * math.pi * 1e-3) ** 2 * inertia) and wanted.available == 2100.0
    for name, field, value in (
        ("arm first resonance", "first_resonance", first),
        ("arm tip deviation", "tip_deviation", length * twist / 0.7),
        ("arm lost motion", "lost_motion", length * 1e-3),
    ):
        for share, verdict in ((0.98, Verdict.FAIL), (1.02, Verdict.MARGINAL), (1.5, Verdict.PASS)):
            worth = value / share if field == "first_resonance" else value * share
            wish = replace(StiffnessWish(), **{field: worth})
            made = shared(evaluate(replace(study, stiffness=wish)))
            assert made[name].verdict is verdict and made[name].essential
            assert [one for one in made if one.startswith("arm")] == [name]  # what is not wished is not told


def test_an_arm_that_is_too_soft_holds_in_no_sample(make):
    arm, cycle = make.planar_arm([0.5], [1.0]), make.sines(1, samples=41, duration=4.0, size=0.3)
    scattering = Tolerances(torque_constant=Tolerance(0.01), samples=200)
    study = sprung(make, arm, cycle, drive_mass=DriveMass.INCLUDED, tolerances=scattering)
    assert robustness(evaluate(study)).whole.probability == 1.0
    soft = evaluate(replace(study, stiffness=StiffnessWish(tip_deviation=1e-5)))
    assert soft.verdict is Verdict.FAIL and soft.joints["j1"].verdict is not Verdict.FAIL
    odds = robustness(soft)
    assert odds.whole.held == 0 and odds.joints["j1"].probability == 1.0
    assert odds.checks["arm"]["arm tip deviation"].held == 0 and odds.joints["arm"].held == 0


@pytest.mark.parametrize("scatter", [Tolerance(0.3), Tolerance(0.15, normal=True), Tolerance(0.5, absolute=True)])
def test_stiffness_scatters_with_the_payload_of_a_sample(make, scatter):
    """A gripper by itself, and a box; the first resonance in between decides."""
    cycle = make.sines(1, samples=41, duration=4.0, size=0.3)
    cycle = replace(cycle, payload_names=("gripper", "box"), payload=np.repeat([0, 1], [20, 21]))
    masses = {"gripper": 1.0, "box": 3.0}
    bodies = tuple(Payload(name, mass, np.zeros(3), np.zeros((3, 3))) for name, mass in masses.items())
    study = sprung(
        make, make.planar_arm([0.5], [1.0]), cycle, drive_mass=DriveMass.INCLUDED, payloads=bodies,
        tolerances=Tolerances(payload=scatter, samples=1000),
    )  # fmt: skip
    first = shared(evaluate(study))["arm first resonance"].available
    study = replace(study, stiffness=StiffnessWish(first_resonance=0.98 * first, tip_deviation=1.0))
    evaluation, draws = evaluate(study), drawn(study, 6, 4)
    (found,) = judged(candidate(nominal_of(study), evaluation.drives), draws)
    for sample, factors in enumerate(draws.loads[:, :-1]):
        own = tuple(replace(one, mass=one.mass * factor) for one, factor in zip(bodies, factors, strict=True))
        expected = figures_of(evaluate(replace(study, payloads=own)))[2]
        np.testing.assert_allclose(found.arm[sample], expected, rtol=1e-3)  # of linear interpolation between 8 masses
    odds = robustness(evaluation)
    assert 0.3 < odds.checks["arm"]["arm first resonance"].probability == odds.joints["arm"].probability < 0.9
    assert odds.whole.probability <= odds.joints["arm"].probability
    (worst,) = (one for one in effects(evaluation).worst() if one.joint == "arm")
    assert worst.check == "arm first resonance"
    assert [(str(bar.source), bar.at_low < 1.0 < bar.at_high) for bar in worst.bars] == [("payload of box", True)]


@pytest.fixture
def elbow(make):
    """Two joints with heavy drives, in motion."""
    return sprung(make, make.planar_arm([0.4, 0.3], [0.8, 0.5]), make.sines(2, duration=4.0, size=0.6))


def test_the_worst_of_a_moving_arm(elbow):
    """Generalised eigenvalues by numpy, tips displaced by their twists, and all corners of the play."""
    evaluation = evaluate(elbow)
    found, cycle = shared(evaluation), elbow.cycle
    drives = {name: one.drive for name, one in evaluation.joints.items()}
    locked = {
        name: replace(one, motor=replace(one.motor, rotor_inertia=1e-12), gear=replace(one.gear, inertia=0.0))
        for name, one in drives.items()
    }
    arm = loaded_arm(elbow, locked, -1)  # rotors of no spin of their own; their bodies stay
    lowest = []
    for q in cycle.position:
        squares = np.linalg.eigvals(np.linalg.solve(mass_matrix(arm, q), np.diag([0.7 * 3000.0] * 2)))
        lowest.append(math.sqrt(squares.real.min()) / (2.0 * math.pi))
    told_first = found["arm first resonance"]
    assert told_first.available == pytest.approx(min(lowest), rel=1e-3)
    assert told_first.time == pytest.approx(cycle.time[int(np.argmin(lowest))], abs=0.05)

    def twist(torque):
        size = abs(torque)
        bent = min(size, 3.0) / 3000 + min(max(size - 3.0, 0.0), 6.0) / 5000 + max(size - 9.0, 0.0) / 8000
        return math.copysign(bent / 0.7, torque)

    torque = np.column_stack([one.series.gear_torque for one in evaluation.joints.values()])
    lag = np.vectorize(twist)(torque)
    base = tip_pose(elbow.arm, cycle.position)[:, :3, 3]
    size = np.linalg.norm(tip_pose(elbow.arm, cycle.position - lag)[:, :3, 3] - base, axis=1)
    assert found["arm tip deviation"].required == pytest.approx(size.max(), rel=5 * np.abs(lag).max())
    corners = []
    for signs in itertools.product((0.5, -0.5), repeat=2):
        step = np.array(signs) * 1e-3
        ends = [tip_pose(elbow.arm, cycle.position + way * step)[:, :3, 3] for way in (1.0, -1.0)]
        corners.append(np.linalg.norm(ends[0] - ends[1], axis=1).max())
    assert found["arm lost motion"].required == pytest.approx(max(corners), rel=1e-5)


def test_what_one_joint_needs_is_needed_by_the_arm(elbow):
    """A joint alone, the others rigid, is never slower than the arm: Rayleigh."""
    first = shared(evaluate(elbow))["arm first resonance"].available
    wish = StiffnessWish(first_resonance=first)
    evaluation = evaluate(replace(elbow, stiffness=wish))
    for name in evaluation.joints:
        assert told(evaluation, "gear stiffness", name).utilisation < 1.0


@pytest.mark.parametrize("field", ["stiffness_1", "backlash"])
def test_unknown_springs_prove_nothing(elbow, field):
    gear = replace(elbow.catalog.gears["g1"], **{field: None})
    evaluation = evaluate(replace(elbow, catalog=replace(elbow.catalog, gears={"g1": gear})))
    assert evaluation.verdict is Verdict.NOT_CHECKED
    names = {"backlash": {"arm lost motion"}}.get(field, {"arm first resonance", "arm tip deviation"})
    lacking = {check.name for check in evaluation.shared if check.verdict is Verdict.NOT_CHECKED and check.essential}
    assert lacking == names
    assert {gap.columns for gap in gaps(evaluation)} == {(field,)}
    free = replace(elbow, stiffness=StiffnessWish(), catalog=replace(elbow.catalog, gears={"g1": gear}))
    assert evaluate(free).verdict is not Verdict.NOT_CHECKED


def random_springs(make, seed):
    """Two joints, three gears of different springs and plays each, some unknown; a wish near what sets have."""
    rng = np.random.default_rng(seed)
    gears = {}
    for i in range(4):
        size = rng.uniform(0.5, 2.0)
        row = replace(
            make.gear, key=f"g{i}", mass=0.4 * size * rng.uniform(0.8, 1.2), repeated_peak_torque=60.0 * size,
            average_torque_limit=40.0 * size, stiffness_1=4000.0 * size * rng.uniform(0.5, 2.0),
            backlash=rng.uniform(1e-4, 1e-3) / size,
        )  # fmt: skip
        gears[f"g{i}"] = replace(row, **{f: None for f in ("stiffness_1", "backlash") if rng.random() < 0.15})
    pairs = (*(("m1", key) for key in gears), ("m1", ""))
    arm = make.planar_arm([0.4, 0.35], rng.uniform(0.3, 1.0, 2))
    tasks = tuple(
        make.task(f"j{i + 1}", drive=("m1", "g0") if rng.random() < 0.15 else None, pairs=pairs) for i in range(2)
    )
    wish = StiffnessWish(
        rng.uniform(5.0, 12.0) if rng.random() < 0.7 else None, rng.uniform(1e-3, 4e-3) if rng.random() < 0.5 else None,
        rng.uniform(2e-4, 1e-3) if rng.random() < 0.5 else None,
    )  # fmt: skip
    cycle = make.sines(2, samples=31, duration=4.0, size=0.6)
    return make.study(
        cycle, arm=arm, joints=tasks, catalog=Catalog({"m1": make.motor}, gears), stiffness=wish,
        wanted=Wanted(sets=3), drive_mass=(DriveMass.ADDED, DriveMass.INCLUDED)[seed % 3 == 0],
    )  # fmt: skip


def test_search_and_front_are_brute_force_with_wishes(make):
    decided = 0
    for seed in range(14):
        study = random_springs(make, seed)
        held, soft = [], 0
        for drives, found in unfailed_sets(study):
            excused = found.verdict is Verdict.NOT_CHECKED and all(
                study.joints[int(gap.joint[1]) - 1].drive is not None for gap in gaps(found)
            )
            if found.feasible or excused:
                held.append((found.objective, drives))
            soft += any(one.name.startswith("arm") and one.verdict is Verdict.FAIL for one in found.shared)
        held.sort(key=lambda one: one[0])
        chosen = select(study, advise=False)
        assert [one.objective for one in chosen.best_sets] == pytest.approx([one[0] for one in held[:3]], rel=1e-8), (
            seed
        )
        assert chosen.proof == "optimal" or not held
        if held and not any(task.drive for task in study.joints):
            least = min(point.criteria["mass"] for point in pareto_front(study, ("mass", "energy")).points)
            assert least == pytest.approx(held[0][0], rel=1e-9)
        decided += bool(soft) and bool(held)
    assert decided > 4


def test_bounds_of_what_a_gear_must_be(make):
    """No choice asks a gear for less stiffness than its bound."""
    rng, seen = np.random.default_rng(2), 0
    study = replace(random_springs(make, 5), stiffness=StiffnessWish(first_resonance=8.0))
    offered = build_candidates(study)
    for _ in range(10):
        picked = [rng.permutation(np.arange(offered.first_pair[j], offered.first_pair[j + 1]))[:3] for j in range(2)]
        low, high = (np.array([f(offered.parameters[p], axis=0) for p in picked]) for f in (np.min, np.max))
        for joint, offer in enumerate(offered.joints):
            offer.torque_interval(low, high)
            bound = offer.bound_data.full.least_loads[4]
            chosen = {j: int(rng.choice(picked[j])) for j in range(2)}
            numbers = offered.parameters_of(chosen)
            cases = offered.judge(joint, np.array([chosen[joint]]), numbers, until=np.inf, quick=False).cases
            wanted = cases["figures"]["required_stiffness"][0]
            assert (16.0 * math.pi) ** 2 * bound <= wanted * (1.0 + 1e-9)
            seen += (16.0 * math.pi) ** 2 * bound > 0.5 * wanted
    assert seen > 10


def test_a_relaxed_sum_bounds_every_choice():
    """Against every choice of three lists: no lower bound is too high, no candidate that may be part of one is out."""
    rng, sharp = np.random.default_rng(5), 0
    for _ in range(200):
        costs, moved = (rng.uniform(low, 3.0, (3, 5)) for low in (0.5, -0.5))
        moved[rng.random((3, 5)) < 0.1] = math.inf
        domains = [Domain(np.arange(5), row, np.zeros(5, np.bool_), float(row.min())) for row in costs]
        most, limit = float(rng.uniform(-1.0, 5.0)), float(rng.uniform(1.5, 8.0))
        bound, kept = lagrangian_bound(domains, moved, most, limit)
        for places in itertools.product(range(5), repeat=3):
            way, cost = (sum(rows[j][at] for j, at in enumerate(places)) for rows in (moved, costs))
            if way <= most and cost < limit:
                assert bound <= cost + 1e-12 and all(kept[j][at] for j, at in enumerate(places))
        sharp += bound > sum(row.min() for row in costs) or sum(map(np.sum, kept)) < 15
    assert sharp > 100


def test_bounds_of_how_far_each_joint_moves_the_tip(make):
    """A cut's sum at the least that open choices leave is no more than how far any whole set goes along it."""
    study = replace(random_springs(make, 5), stiffness=StiffnessWish(tip_deviation=1e-5))
    offered, way = build_problem(build_candidates(study), Wanted()), np.array([0.6, 0.0, 0.8])
    used = [arm_utilisation(offered, pairs) for pairs in itertools.product(*(one.tolist() for one in offered.eligible))]
    assert any(1.0 < one < math.inf for one in used) and offered.cuts
    rng = np.random.default_rng(3)
    for _ in range(20):
        domains = tuple(one.subset(rng.random(len(one)) < 0.6) for one in offered.domains())
        if not all(map(len, domains)):
            continue
        sample, (low, high) = int(rng.integers(len(study.cycle.time))), offered.ranges(domains)
        least = [
            min_tip_motion(offered.candidates, j, one, TipCut(sample, way), low, high) for j, one in enumerate(domains)
        ]
        pairs = [int(rng.choice(one.pairs)) for one in domains]
        drives = evaluate(study, offered.keys(dict(enumerate(pairs)))).joints
        torque = np.column_stack([one.series.gear_torque for one in drives.values()])
        whole = tip_deviation(study, {name: one.drive for name, one in drives.items()}, torque)[sample] @ way
        assert sum(float(row[one.pairs == pair][0]) for row, one, pair in zip(least, domains, pairs, strict=True)) <= (
            whole + 1e-12
        ) or not math.isfinite(sum(row.max() for row in least))


def test_a_wish_without_an_arm_is_refused(tmp_path):
    from drivetrain.study.read import load_study

    (tmp_path / "load.csv").write_text("time [s],speed [rad/s],torque [N m]\n0,0,1\n1,1,1\n2,0,1\n")
    text = "\n".join([
        "schema_version: 1", "motions: {m: {table: load.csv}}", "cycle: [{motion: m}]", "supply: {voltage: 48 V}",
        "stiffness: {first_resonance: 8 Hz}",
        "joints: {default: {candidates: {motors: {frameless: true}, gears: {kind: strain_wave}}}}",
    ])  # fmt: skip
    (tmp_path / "study.yaml").write_text(text)
    with pytest.raises(InputError, match="applies only to studies of an arm"):
        load_study(tmp_path / "study.yaml")
