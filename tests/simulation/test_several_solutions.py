"""Two coupled joints let go at one instant, where one that slides may relieve the other: one rule, and it is told."""

from itertools import product

import numpy as np
import pytest

import drivetrain as dt
from drivetrain.drive.friction import Friction
from drivetrain.simulation.engines.engine import Engine

PUSH = np.array([2.5, 2.2])
COULOMB, STATIC = 1.0, 2.0
BENT = np.array([0.0, np.radians(100.0)])  # so that neither carries the other along
ENGINES: list[Engine] = [dt.FixedStep(1e-3), dt.FixedStep(1.3e-4), dt.AdaptiveStep()]


def arm() -> dt.Arm:
    """Two bars of 1 m that turn about z; no gravity."""
    home = np.array([np.eye(4), np.eye(4)])
    home[:, 0, 3] = 0.5, 1.5
    screws = np.array([[0.0, 0.0, 1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0, -1.0, 0.0]])
    bar = np.diag([1e-3, 1.0 / 12.0, 1.0 / 12.0])
    return dt.Arm.from_screws(
        home, screws, [1.0, 1.0], np.array([bar, bar]), tip=np.eye(4), gravity=(0.0, 0.0, 0.0), joint_names=["a", "b"]
    )


def pushed(static: float, time: list[float], shares: list[float], after: float = 0.03) -> dt.Scene:
    law = dt.DryFriction(Friction(coulomb=COULOMB, static=static))
    effects = {
        name: (law, dt.GivenTorque(time, [float(push) * share for share in shares]))
        for name, push in zip("ab", PUSH, strict=True)
    }
    return dt.Scene(arm(), effects, after, BENT, np.zeros(2))


def test_both_outcomes_are_consistent() -> None:
    """Written out: with both sliding, and with the second held while the first slides."""
    mass = dt.mass_matrix(arm(), BENT)
    both = np.linalg.solve(mass, PUSH - COULOMB)
    assert (both > 0.0).all()
    alone = (PUSH[0] - COULOMB) / mass[0, 0]
    assert alone > 0.0 and COULOMB < PUSH[1] - mass[1, 0] * alone < STATIC < PUSH[1]


@pytest.mark.parametrize("engine", ENGINES, ids=repr)
def test_all_that_are_beyond_their_bounds_let_go_and_it_is_said(engine: Engine) -> None:
    jump = [0.0, 0.02, 0.02, 0.03], [0.0, 0.0, 1.0, 1.0]
    run = dt.simulate(pushed(STATIC, *jump), solver=engine, interval=1e-3)
    told = [event for event in run.events if event.name == "several solutions"]
    assert len(told) == 1 and "starts to slip together" in told[0].detail
    assert told[0].time == pytest.approx(0.02, abs=1.1e-3)
    wanted = np.linalg.solve(dt.mass_matrix(arm(), BENT), PUSH - COULOMB)
    # What the turning arms do to one another is of second order in 0.01 s.
    speeds = np.array([run["a.speed"][-1], run["b.speed"][-1]])
    np.testing.assert_allclose(speeds, 0.01 * wanted, rtol=0.03)
    none = dt.simulate(pushed(COULOMB, *jump), solver=engine, interval=1e-3)
    assert not [event for event in none.events if event.name == "several solutions"]


@pytest.mark.parametrize("engine", ENGINES, ids=repr)
def test_bounds_reached_together_on_a_ramp_are_left_together(engine: Engine) -> None:
    scene = pushed(STATIC, [0.0, 0.04], [0.0, 1.0])
    same = {name: (own[0], dt.GivenTorque([0.0, 0.04], [0.0, 4.0])) for name, own in scene.effects.items()}
    run = dt.simulate(dt.Scene(arm(), same, 0.03, BENT, np.zeros(2)), solver=engine, interval=1e-3)
    loose = [event.time for event in run.events if event.name == "breakaway"]
    assert len(loose) >= 2 and loose[0] == loose[1] == pytest.approx(0.02, abs=1.1e-3)
    assert any(event.name == "several solutions" for event in run.events)


@pytest.mark.parametrize("seed", range(24))
def test_it_is_told_where_another_set_fits_and_only_there(seed: int) -> None:
    """Four bars, one push at all joints: every set of joints that may hold instead is tried, written out."""
    rng, n, names = np.random.default_rng(seed), 4, list("abcd")
    home, screws = np.array([np.eye(4)] * n), np.zeros((n, 6))
    home[:, 0, 3], screws[:, 2], screws[:, 4] = np.arange(n) + 0.5, 1.0, -np.arange(n)
    bars = np.array([np.diag([1e-3, 1.0 / 12.0, 1.0 / 12.0])] * n)
    chain = dt.Arm.from_screws(home, screws, np.ones(n), bars, gravity=(0.0, 0.0, 0.0), joint_names=names)
    bent, push = rng.uniform(-2.5, 2.5, n), rng.choice([-1.0, 1.0], n) * rng.uniform(1.5, 3.5, n)
    law = dt.DryFriction(Friction(coulomb=COULOMB, static=STATIC))
    time = [0.0, 0.01, 0.01, 0.02]
    effects = {one: (law, dt.GivenTorque(time, [0.0, 0.0, k, k])) for one, k in zip(names, push, strict=True)}
    run = dt.simulate(dt.Scene(chain, effects, 0.02, bent, np.zeros(n)), solver=dt.FixedStep(1e-5), interval=1e-3)
    mass = dt.mass_matrix(chain, bent)

    def slack(modes: np.ndarray) -> float:
        """By how much [N m, rad/s^2] what holds and slides so fits; below 0: it does not."""
        free = modes != 0
        change = np.zeros(n)
        change[free] = np.linalg.solve(mass[np.ix_(free, free)], (push - COULOMB * modes)[free])
        held = STATIC - np.abs(push - mass @ change)[~free]
        return min([*held, *(change * modes)[free]])

    first = [event for event in run.events if event.time < 0.01 + 2e-5]
    loose = {event.detail[0]: 1 if "forward" in event.detail else -1 for event in first if event.name == "breakaway"}
    found = np.array([loose.get(one, 0) for one in names])
    assert slack(found) > 0.0
    others = [found * keep for keep in product((0, 1), repeat=n)]
    others = [one for one in others if one.any() and (one != found).any()]
    best = max((slack(one) for one in others), default=-1.0)
    told = [event.detail[0] for event in first if event.name == "several solutions"]
    if abs(best) > 1e-3:  # nearer than that the step's length decides
        assert len(told) == (best > 0.0)
        assert not told or any(one[names.index(told[0])] == 0 and slack(one) > 0.0 for one in others)
