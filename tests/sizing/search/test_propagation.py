"""What propagation rules out can be part of no set that holds, and what it promises no set undercuts."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from random_tasks import feasible_sets

from drivetrain.catalog.read import Catalog
from drivetrain.sizing.search.candidates import build_candidates
from drivetrain.sizing.search.constraints.supply import power_range
from drivetrain.sizing.search.problem import build_problem
from drivetrain.sizing.search.propagate import ParameterRanges, Propagation
from drivetrain.sizing.search.tree import NO_TEST_LIMIT, Tree, bisect_parameter
from drivetrain.study.model import Mount
from drivetrain.study.parts.selection import Wanted


def study_of(make, seed: int, wanted: Wanted, lengths=(0.4, 0.3)):
    """A few joints, strong enough drives at all, bearings and heat near their limits."""
    rng = np.random.default_rng(seed)
    motors = {
        f"m{i}": replace(
            make.motor, key=f"m{i}", mass=float(rng.uniform(0.3, 1.2)), resistance=float(rng.uniform(0.15, 0.6)),
            nominal_current=float(rng.uniform(4, 15)), rotor_inertia=float(rng.uniform(1e-5, 8e-5)),
        )
        for i in range(3)
    }  # fmt: skip
    gears = {
        f"g{i}": replace(
            make.gear, key=f"g{i}", mass=float(rng.uniform(0.2, 1.0)), ratio=float(rng.uniform(25, 110)),
            tilting_moment_limit=float(rng.uniform(15, 60)), repeated_peak_torque=float(rng.uniform(20, 90)),
            average_torque_limit=float(rng.uniform(15, 60)),
        )
        for i in range(3)
    }  # fmt: skip
    cycle = make.sines(len(lengths), samples=41, duration=float(rng.uniform(2, 4)), size=0.5)
    carrier = str(rng.choice(["parent", "child"]))
    pairs = tuple(itertools.product(motors, gears))
    tasks = tuple(make.task(name, drive=None, pairs=pairs, mount=Mount(carrier)) for name in cycle.joint_names)
    arm = make.planar_arm(lengths, rng.uniform(0.5, 1.5, len(lengths)))
    return make.study(cycle, arm=arm, joints=tasks, catalog=Catalog(motors, gears), wanted=wanted)


def propagated(problem, limit):
    """What is left of all candidates, and the ranges of their numbers."""
    ranges = ParameterRanges.unknown(problem.n)
    return Propagation(problem, list(problem.domains()), ranges, limit, NO_TEST_LIMIT, set()).run(), ranges


def holding_sets(study):
    """Pairs by keys of every set whose joints hold, with its objective and its power."""
    for found in feasible_sets(study):
        power = sum(joint.series.electrical_power for joint in found.joints.values())
        yield tuple(found.drives.values()), found.objective, power


@pytest.mark.parametrize("weights", [(("mass", 1.0),), (("energy", 1.0),)])
@pytest.mark.parametrize("seed", range(4))
def test_no_part_of_a_set_that_holds_is_ruled_out(make, seed, weights):
    study = study_of(make, seed, Wanted(weights))
    asked = build_problem(build_candidates(study), study.wanted)
    domains, ranges = propagated(asked, np.inf)
    sets = list(holding_sets(study))
    if domains is None:
        assert not sets
        return
    total = power_range(asked, domains, ranges, both=True)
    assert np.isfinite(total).all()
    left = [{asked.candidates.keys(int(pair)) for pair in domain.pairs} for domain in domains]
    for pairs, objective, power in sets:
        assert all(keys in there for keys, there in zip(pairs, left, strict=True))
        assert sum(domain.lower_bound for domain in domains) <= objective * (1 + 1e-9)
        slack = 1e-6 * np.abs(power).max()
        assert (total[0] <= power + slack).all()
        assert (total[1] >= power - slack).all()


@pytest.mark.parametrize("seed", range(3))
def test_a_limit_keeps_what_is_cheaper(make, seed):
    study = study_of(make, seed, Wanted())
    asked = build_problem(build_candidates(study), study.wanted)
    sets = sorted(objective for _, objective, _ in holding_sets(study))
    for limit in sets[:5]:
        domains, _ = propagated(asked, limit * (1 + 1e-9))
        assert domains is not None
        assert sum(domain.lower_bound for domain in domains) <= limit * (
            1 + 1e-9
        )  # equals are put in order by less than that


def test_cheapest_candidates_are_judged_where_loads_are_decided(make):
    """A node whose loads are decided is branched by excluding its cheapest set, which must have been judged.

    The load of the joints before the middle one is decided while the domains are filtered, as its dearer candidates go.
    """
    study = study_of(make, 2, Wanted(), lengths=(0.15, 0.1, 0.1))
    asked = build_problem(build_candidates(study), study.wanted)
    tree = Tree(asked)
    tree.run(math.inf, lambda *_: None)
    best, domains = tree.best[0], list(asked.domains())
    for joint in (0, 2):
        chosen = domains[joint].subset(domains[joint].pairs == best.pairs[joint])
        domains[joint] = replace(chosen, lower_bound=best.costs[joint])
    ranges = ParameterRanges.unknown(3)
    left = Propagation(asked, domains, ranges, best.objective * (1 + 1e-9), NO_TEST_LIMIT, set()).run()
    assert left is not None
    assert len(asked.domains()[1]) > len(left[1]) == 1
    assert all(domain.cheapest_is_exact for domain in left)


def test_a_domain_is_parted_where_its_numbers_are_neighbouring_floats(make):
    study = study_of(make, 0, Wanted())
    asked = build_problem(build_candidates(study), study.wanted)
    domains = asked.domains()
    least = 1.0 + 2.0**-52  # the middle of this float and the next is rounded to the next
    asked.candidates.parameters[domains[0].pairs, 0] = least
    asked.candidates.parameters[domains[0].pairs[1:], 0] = np.nextafter(least, 2.0)
    assert [len(part[0]) for part in bisect_parameter(asked, domains, 0, 0)] == [1, len(domains[0]) - 1]
