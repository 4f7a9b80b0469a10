"""Moves in no time at all, and motions that jump."""

from __future__ import annotations

import numpy as np
import pytest
from hard_case import Figure, hard_case

from drivetrain.errors import InputError
from drivetrain.motion.duty_cycle import Step, build_cycle
from drivetrain.motion.point_to_point import waypoint_motion
from drivetrain.motion.profiles import Profile, Quintic, SCurve, Trapezoid

PROFILES: list[Profile] = [Quintic(), Trapezoid(), SCurve()]
NAMES = ("shoulder", "elbow")


def textbook(points: np.ndarray, durations: np.ndarray) -> np.ndarray:
    """Quintics one after another, sampled at tenths of each."""
    blocks = []
    for start, end, duration in zip(points[:-1], points[1:], durations, strict=True):
        time = np.linspace(0.0, duration, 11)
        with np.errstate(invalid="ignore", divide="ignore"):
            u = (time / duration)[:, None]
            blocks.append(start + (10 * u**3 - 15 * u**4 + 6 * u**5) * (end - start))
    return np.concatenate(blocks)


def tour(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Eight points, some of them twice in a row with no time between."""
    points, durations = [rng.uniform(-2, 2, 2)], []
    for _ in range(7):
        stays = rng.random() < 0.4 and len(durations) > 0
        points.append(points[-1] if stays else rng.uniform(-2, 2, 2))
        durations.append(0.0 if stays else rng.uniform(0.1, 2.0))
    return np.array(points), np.array(durations)


@hard_case(
    "T39",
    "Moves without duration, and position steps",
    setup="300 paths of which a third of the moves have no duration, 300 impulses, and 100 cycles with a gap.",
    naive="quintic polynomials in t/T, joined without a check",
)
def test_no_duration() -> list[Figure]:
    rng, bad, naive_bad, through, naive_through = np.random.default_rng(0), 0, 0, 0, 0
    for count in range(300):
        points, durations = tour(rng)
        motion = waypoint_motion("tour", NAMES, points, profile=PROFILES[count % 3], durations=durations)
        samples = np.hstack([motion.position, motion.velocity, motion.acceleration, motion.time[:, None]])
        bad += int(not np.isfinite(samples).all())
        naive_bad += int(not np.isfinite(textbook(points, durations)).all())
        assert motion.position[-1] == pytest.approx(points[-1], abs=0.0)
        assert motion.time[-1] == pytest.approx(durations.sum(), rel=1e-12)
        durations[rng.integers(7)] = 0.0
        if (np.abs(np.diff(points, axis=0)).max(axis=1)[durations == 0.0] == 0.0).all():
            continue  # a wait of no time again
        with pytest.raises(InputError, match="impulse"):
            waypoint_motion("blow", NAMES, points, profile=PROFILES[count % 3], durations=durations)
    for count in range(100):
        first, second = (
            waypoint_motion(name, NAMES, rng.uniform(-2, 2, (3, 2)), profile=PROFILES[count % 3], durations=[1.0, 0.5])
            for name in ("first", "second")
        )
        joined = np.vstack([first.position, second.position])
        naive_through += int(np.isfinite(joined).all() and np.abs(np.diff(joined, axis=0)).max() > 0.1)
        try:
            build_cycle([Step(first), Step(second)], may_stay_open=True)
            through += 1
        except InputError as fault:
            assert "a gap" in str(fault)
    return [
        Figure("paths with samples that are not finite, of 300", float(bad), float(naive_bad), at_most=0.0),
        Figure("position steps accepted, of 100", float(through), float(naive_through), at_most=0.0),
    ]
