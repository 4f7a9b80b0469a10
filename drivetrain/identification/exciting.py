"""Exciting motions for identification: sums of sines within the arm's limits, the best conditioned of many."""

from __future__ import annotations

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array, checked_numbers
from drivetrain.dynamics.regressor import torque_regressor
from drivetrain.errors import Fault, InputError, raise_faults
from drivetrain.identification.least_squares import base_parameters
from drivetrain.motion.motion import Motion

USED_SHARE = 0.9  # used share of the limits
UNLIMITED = {"position": np.pi, "speed": 2.0}  # [rad] and [rad/s] for revolute joints without stated limits
CONDITION_SAMPLES = 150  # samples from which the condition number of a candidate is computed


def exciting_motion(
    arm: Arm,
    *,
    duration: float = 10.0,
    rate: float = 250.0,
    harmonics: int = 5,
    acceleration: float = 10.0,
    candidates: int = 40,
    seed: int = 0,
) -> Motion:
    """A motion for identification: periodic, at rest at its ends, within the arm's limits.

    Each joint moves by a sum of sines at multiples of the base frequency, with random amplitudes, scaled to 90 % of its
    limits of position, speed and acceleration. The candidate with the best conditioned base parameters is returned.

    Args:
        arm: Arm with position and speed limits; for a revolute joint without limits half a turn in either direction and
            2 rad/s. Collisions are not checked.
        duration: Period [s], to the nearest sample.
        rate: Sample rate [Hz].
        harmonics: Number of multiples of the base frequency, 2 or more.
        acceleration: Acceleration limit of every joint [rad/s^2 or m/s^2].
        candidates: Number of random candidates.
        seed: Seed of the random numbers; equal seeds give equal motions.

    Returns:
        The motion, with its condition number in the notes.

    Raises:
        InputError: Numbers out of range, limits between which a joint cannot move, or a prismatic joint without
            position and speed limits.

    Reference: J. Swevers, C. Ganseman, D. Tuekel, J. De Schutter, H. Van Brussel, Optimal robot excitation and
        identification, IEEE Transactions on Robotics and Automation 13 (1997) 730-740.
    """
    named = {"duration": (duration, "s"), "rate": (rate, "Hz"), "acceleration": (acceleration, "rad/s^2")}
    duration, rate, acceleration = checked_numbers(named, above=0.0)
    if harmonics < 2 or candidates < 1 or duration * rate < 10 * harmonics:
        problem = "needs 2 harmonics, 1 candidate, and 10 samples a harmonic"
        raise InputError(Fault("exciting_motion", problem, [harmonics, candidates, duration * rate]))
    if seed < 0:
        raise InputError(Fault("seed", "must not be negative", seed))
    low, high, speed = _limits(arm)
    steps = round(duration * rate)  # a whole number in the period, so that the last sample is at rest too
    time = np.arange(steps + 1) / rate
    omega = 2.0 * np.pi * rate / steps * np.arange(1.0, harmonics + 1.0, dtype=np.float64)
    rng, some = np.random.default_rng(seed), slice(None, None, max(1, len(time) // CONDITION_SAMPLES))
    best: tuple[float, list[Array]] | None = None
    for _ in range(candidates):
        motion = _series(time, omega, rng.normal(size=(2, harmonics, arm.n)), (low, high, speed, acceleration))
        condition = _condition(arm, [values[some] for values in motion])
        if best is None or condition < best[0]:
            best = condition, motion
    assert best is not None
    note = f"best conditioned of {candidates} sums of {harmonics} sines: condition {best[0]:.3g} of the base parameters"
    q, qd, qdd = best[1]
    return Motion("exciting", arm.joint_names, time, q, qd, qdd, (note,))


def _limits(arm: Arm) -> tuple[Array, Array, Array]:
    turning = ~arm.slides
    known = np.isfinite(arm.lower) & np.isfinite(arm.upper) & np.isfinite(arm.speed_limits)
    faults = [
        Fault(f"joint {arm.joint_names[i]}", "slides: it needs limits of position [m] and speed [m/s]")
        for i in np.flatnonzero(~(turning | known))
    ]
    for i in np.flatnonzero((arm.lower >= arm.upper) | (arm.speed_limits <= 0.0)):
        limits = {"lower": arm.lower[i], "upper": arm.upper[i], "speed": arm.speed_limits[i]}
        problem = "cannot move between its limits: lower must be below upper, speed above 0 [rad or m, per s]"
        faults.append(Fault(f"joint {arm.joint_names[i]}", problem, {key: float(one) for key, one in limits.items()}))
    raise_faults(faults)
    low = np.where(np.isfinite(arm.lower), arm.lower, np.minimum(-UNLIMITED["position"], arm.upper - 1.0))
    high = np.where(np.isfinite(arm.upper), arm.upper, np.maximum(UNLIMITED["position"], low + 1.0))
    return low, high, np.where(np.isfinite(arm.speed_limits), arm.speed_limits, UNLIMITED["speed"])


def _series(time: Array, omega: Array, factors: Array, limits: tuple[Array, Array, Array, float]) -> list[Array]:
    """Position, speed and acceleration of sums of sines that start at rest, (N, n) each, scaled to the limits."""
    low, high, fastest, most = limits
    sines, cosines = factors / omega[:, None]
    sines = sines - omega[:, None] * (omega @ sines) / (omega @ omega)  # zero speed at the start
    square = omega**2
    cosines = cosines - square[:, None] * (square @ cosines) / (square @ square)  # zero acceleration at the start
    s, c = np.sin(time[:, None] * omega), np.cos(time[:, None] * omega)
    q, qd = s @ sines + c @ cosines, (c * omega) @ sines - (s * omega) @ cosines
    qdd = -(s * square) @ sines - (c * square) @ cosines
    middle, span = 0.5 * (q.max(axis=0) + q.min(axis=0)), np.ptp(q, axis=0)
    size = USED_SHARE * np.minimum.reduce(
        [(high - low) / span, fastest / np.abs(qd).max(axis=0), most / np.abs(qdd).max(axis=0)]
    )
    return [0.5 * (low + high) + size * (q - middle), size * qd, size * qdd]


def _condition(arm: Arm, motion: list[Array]) -> float:
    rows = torque_regressor(arm, *motion)
    flat = rows.reshape(-1, rows.shape[2])
    chosen = flat[:, base_parameters(flat).leading]
    return float(np.linalg.cond(chosen / np.sqrt(np.sum(chosen**2, axis=0))))
