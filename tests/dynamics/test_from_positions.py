"""Torques from position readings against the torques of the true motion."""

from __future__ import annotations

import numpy as np
import pytest

from drivetrain.arm.files.load import load_arm
from drivetrain.dynamics.from_positions import torque_from_positions
from drivetrain.dynamics.inverse import inverse_dynamics
from drivetrain.errors import InputError

ARM = load_arm("ur5")
TIME = 1e-3 * np.arange(2000)


def wave() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A motion with two frequencies per joint, different for each joint."""
    w = np.pi * (1.0 + 0.3 * np.arange(6))
    a = np.array([1.2, 0.5, 0.7, 1.0, 0.8, 1.5])
    x, y = w * TIME[:, None] + 0.7 * np.arange(6), 3.0 * w * TIME[:, None]
    q = a * np.sin(x) + 0.15 * np.sin(y)
    return q, w * (a * np.cos(x) + 0.45 * np.cos(y)), -w * w * (a * np.sin(x) + 1.35 * np.sin(y))


def rms(values: np.ndarray) -> np.ndarray:
    return np.sqrt((values**2).mean(axis=0))


def step(bits: int) -> float:
    return 2.0 * np.pi / 2**bits


def readings(q: np.ndarray, bits: int) -> np.ndarray:
    return np.round(q / step(bits)) * step(bits)


@pytest.mark.parametrize("bits", [12, 14, 16])
def test_deviation_is_that_of_the_errors(bits: int) -> None:
    q, qd, qdd = wave()
    read = readings(q, bits)
    found = torque_from_positions(ARM, TIME, read, resolution=step(bits))
    inner = slice(200, 1800)
    actual = rms((found.torque - inverse_dynamics(ARM, q, qd, qdd))[inner])
    stated = rms(found.deviation[inner])
    # A wave is smoother than the spline's model of random third differences, so deviations are up to three times too
    # large.
    assert ((actual / stated > 0.3) & (actual / stated < 1.2)).all()
    again = torque_from_positions(ARM, TIME, read, resolution=step(bits))
    np.testing.assert_array_equal(found.deviation, again.deviation)


def test_exact_positions_are_not_smoothed() -> None:
    q, qd, qdd = wave()
    found = torque_from_positions(ARM, TIME, q, resolution=0.0)
    assert not found.deviation.any()
    inner = slice(1, -1)
    # The error of central differences is (w dt)^2 / 12 = 5e-5 of the fastest joint's third harmonic.
    assert rms((found.torque - inverse_dynamics(ARM, q, qd, qdd))[inner]).max() < 1e-3 * rms(found.torque).max()
    assert found.qd == pytest.approx(qd, abs=2e-2)
    assert all("no smoothing" in words for words in found.smoothing)


def test_gaussian_noise_by_its_deviation() -> None:
    q, qd, qdd = wave()
    noisy = q + 2e-4 * np.random.default_rng(0).normal(size=q.shape)
    found = torque_from_positions(ARM, TIME, noisy, resolution=2e-4 * np.sqrt(12.0))
    assert rms(found.torque) / rms(inverse_dynamics(ARM, q, qd, qdd)) == pytest.approx(np.ones(6), abs=0.03)


def test_a_joint_at_rest_and_one_resolution_each() -> None:
    q, qd, qdd = wave()
    for values in (q, qd, qdd):
        values[:, 3] = 0.0
    steps = [step(12), step(14), step(14), step(14), step(16), 0.0]
    read = np.column_stack([x if h == 0.0 else np.round(x / h) * h for x, h in zip(q.T, steps, strict=True)])
    found = torque_from_positions(ARM, TIME, read, resolution=steps)
    assert not found.qdd[:, 3].any()
    assert found.qdd[1:-1, 5] == pytest.approx(qdd[1:-1, 5], abs=0.05)
    others = [0, 1, 2, 4]
    assert (rms((found.qdd - qdd)[:, others]) < 0.3 * rms(qdd[:, others])).all()


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(
    "kind", ["clock", "hidden clock", "clock and counts", "clock and gaps", "gaps and noise", "gaps", "noise", ""]
)
@pytest.mark.parametrize("resting", [False, True], ids=["waves", "moves and rests"])
def test_the_truth_is_inside_the_stated_band(kind: str, seed: int, resting: bool) -> None:
    """Intervals of 0.7 to 8.8 ms, because the clock jitters or because the samples come so; 95 % within 1.96."""
    rng = np.random.default_rng([seed, 5])
    true = 0.004 * np.arange(2000)
    if "gaps" in kind:
        true = np.cumsum(rng.uniform(0.0007, 0.0088, 2000))
    if kind == "hidden clock":  # every stamp as it should be, the reading taken sooner or later
        true = np.sort(true + rng.uniform(-0.0016, 0.0016, len(true)))
    motion = moves_and_rests(true, rng) if resting else moving(true, rng)
    stamps = np.sort(true + rng.uniform(-0.0016, 0.0024, len(true))) if kind.startswith("clock") else true
    stamps = 0.004 * np.arange(2000) if kind == "hidden clock" else stamps
    read = motion[0] + 1e-4 * rng.normal(size=motion[0].shape) * ("noise" in kind)
    found = torque_from_positions(ARM, stamps, readings(read, 14) if "counts" in kind else read)
    wanted = inverse_dynamics(ARM, *motion)
    off = np.abs(found.torque - wanted)
    inside = off <= 1.96 * found.deviation + 1e-9
    assert inside.mean() > 0.95
    assert rms(off).max() < 0.25 * rms(wanted).max()
    assert np.abs(found.deviation).max() < np.abs(wanted).max()


@pytest.mark.parametrize("bits", [0, 13], ids=["noise", "counts"])
def test_the_band_holds_for_moves_of_fifteen_samples(bits: int) -> None:
    """From rest to rest, with rests as long; with a knot to every second sample it held for 75 %."""
    rng, time = np.random.default_rng(6), 0.01 * np.arange(1000)
    span, number = 15 * 0.01, np.arange(1000) // 30
    places = np.cumsum(rng.uniform(-1.0, 1.0, (35, 6)), axis=0)
    u, way = np.clip((time - 2.0 * span * number) / span, 0.0, 1.0)[:, None], places[number + 1] - places[number]
    q = places[number] + way * u**3 * (10.0 - 15.0 * u + 6.0 * u**2)
    qd = way * u**2 * (30.0 - 60.0 * u + 30.0 * u**2) / span
    qdd = way * u * (60.0 - 180.0 * u + 120.0 * u**2) / span**2
    found = torque_from_positions(ARM, time, readings(q, bits) if bits else q + 2e-4 * rng.normal(size=q.shape))
    wanted = inverse_dynamics(ARM, q, qd, qdd)
    off = np.abs(found.torque - wanted)
    assert (off <= 1.96 * found.deviation + 1e-9).mean() > 0.93
    assert rms(off).max() < 0.15 * rms(wanted).max()


def moving(time: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Four sines a joint, up to 1.2 Hz."""
    rate, phase = rng.uniform(0.5, 7.5, (4, 6)), rng.uniform(0.0, 6.3, (4, 6))
    size, angle = rng.uniform(0.2, 1.0, (4, 6)) / rate, rate * time[:, None, None] + phase
    return tuple(
        part.sum(axis=1)
        for part in (size * np.sin(angle), size * rate * np.cos(angle), -size * rate**2 * np.sin(angle))
    )


def moves_and_rests(time: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Four moves from rest to rest, of fifth order, between rests that take half of the time."""
    places, last, span = rng.uniform(-1.5, 1.5, (5, 6)), time[-1] / 4.0, time[-1] / 8.0
    number = np.minimum((time / last).astype(int), 3)
    u, way = np.clip((time - number * last) / span, 0.0, 1.0)[:, None], places[number + 1] - places[number]
    return (
        places[number] + way * u**3 * (10.0 - 15.0 * u + 6.0 * u**2),
        way * u**2 * (30.0 - 60.0 * u + 30.0 * u**2) / span,
        way * u * (60.0 - 180.0 * u + 120.0 * u**2) / span**2,
    )


def test_tip_wrench_and_gravity_are_counted() -> None:
    still = np.tile([0.1, -1.0, 0.7, 0.2, 0.3, 0.4], (50, 1))
    found = torque_from_positions(ARM, TIME[:50], still, tip_wrench=np.arange(6.0))
    wanted = inverse_dynamics(ARM, still, 0 * still, 0 * still, tip_wrench=np.arange(6.0))
    assert found.torque == pytest.approx(wanted)


def test_bad_input_is_refused() -> None:
    q = np.zeros((10, 6))
    with pytest.raises(InputError, match="increase"):
        torque_from_positions(ARM, np.zeros(10), q)
    with pytest.raises(InputError, match="q"):
        torque_from_positions(ARM, TIME[:10], q[:, :5])
    with pytest.raises(InputError, match="negative"):
        torque_from_positions(ARM, TIME[:10], q, resolution=-1.0)
    with pytest.raises(InputError, match="resolution"):
        torque_from_positions(ARM, TIME[:10], q, resolution=[1.0, 2.0])
    with pytest.raises(InputError, match="at least 3"):
        torque_from_positions(ARM, TIME[:2], q[:2], resolution=0.0)
