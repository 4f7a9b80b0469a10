"""Recordings that contradict the model: each is told by name, and stated deviations hold for known parameters."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

import drivetrain as dt
from drivetrain.dynamics.inverse import inverse_dynamics

VISCOUS, COULOMB = np.array([2.0, 0.7]), np.array([3.0, 1.0])
SAMPLES, RATE = 1200, 150.0


def arms() -> tuple[dt.Arm, dt.Arm]:
    """The arm that is recorded, and a guess that is a fifth lighter."""
    arm = dt.with_rotors(dt.load_arm("planar-2r"), [dt.Rotor(100.0, 3e-4)] * 2)
    return arm, replace(arm, masses=0.8 * arm.masses, inertias=0.8 * arm.inertias)


def recorded(
    arm: dt.Arm, rng: np.random.Generator, *, late: float = 0.0, constant: float = 0.0, load: float = 0.0,
    stribeck: float = 0.0, noise: float = 0.05, correlation: float = 0.0,
) -> dt.MeasuredMotion:  # fmt: skip
    """A recording with friction that changes its sign at once, as the laws of a study do."""
    time = np.arange(SAMPLES) / RATE
    omega = 2.0 * np.pi * RATE / SAMPLES * np.arange(1.0, 6.0)
    size, phase = rng.normal(size=(5, 2)), rng.uniform(0.0, 6.0, (5, 2))

    def moved(time: np.ndarray) -> list[np.ndarray]:
        angle = time[:, None, None] * omega[:, None] + phase
        waves = np.sin(angle) / omega[:, None], np.cos(angle), -np.sin(angle) * omega[:, None]
        return [np.sum(size * wave, axis=1) for wave in waves]

    q, qd, qdd = moved(time - late)
    carried = inverse_dynamics(dt.with_rotors(arm, [None, None]), q, qd, qdd)
    torque = inverse_dynamics(arm, q, qd, qdd) + VISCOUS * qd + (COULOMB + load * np.abs(carried)) * np.sign(qd)
    torque += constant * COULOMB + stribeck * COULOMB * np.sign(qd) * np.exp(-((qd / 0.2) ** 2))
    errors = lfilter([1.0], [1.0, -correlation], rng.normal(size=(SAMPLES + 300, 2)), axis=0)[300:]
    torque += noise * np.sqrt(1.0 - correlation**2) * torque.std(axis=0) * errors
    return dt.MeasuredMotion("test", arm.joint_names, time, *moved(time), torque=torque)


def warnings(found: dt.Identification) -> str:
    return "; ".join(note for note in found.notes if note.startswith("warning: "))


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({}, ""),
        ({"correlation": 0.97}, ""),
        ({"constant": 0.6}, "constant torques that the model lacks (joint_1 1."),
        ({"load": 0.1}, "the friction of joint_1 grows with its load"),
        ({"load": -0.1}, "grows less with its load than the efficiencies of the study's gears say"),
        ({"stribeck": 8.0, "noise": 0.01}, "is not linear in its speed"),
        ({"late": 0.02, "noise": 0.01}, "the torques are about 2"),
    ],
)
def test_what_the_model_lacks_is_told(wrong: dict[str, float], words: str) -> None:
    arm, guess = arms()
    found = warnings(dt.identify(guess, recorded(arm, np.random.default_rng(3), **wrong)))
    assert words in found if words else not found, found


def test_a_payload_in_a_part_of_the_recording_is_told() -> None:
    """Also in less than a half; without a word, the errors were a third of the torque."""
    arm, guess = arms()
    held = dt.with_payload(arm, 1.0, np.zeros(3), np.zeros((3, 3)))
    bare, loaded = (recorded(one, np.random.default_rng(3), noise=0.01) for one in (arm, held))
    for share in (0.5, 0.3):
        some = (bare.time < share * bare.time[-1])[:, None]
        told = warnings(dt.identify(guess, replace(bare, torque=np.where(some, bare.torque, loaded.torque))))
        assert "parts of the recording contradict each other: did the payload" in told


def test_signs_units_and_joints_at_rest_are_told() -> None:
    arm, guess = arms()
    good = recorded(arm, np.random.default_rng(4), noise=0.01)
    assert not warnings(dt.identify(guess, good))
    turned = dt.identify(guess, replace(good, torque=good.torque * [1.0, -1.0]))
    assert "only impossible parameters" in warnings(turned) and "explains little of the torque of joint_2" in warnings(
        turned
    )
    # The errors are those of the arm that is returned, not of one with negative masses, which would be some per cent.
    assert turned.errors["identified"].iloc[1] > 0.5 * turned.errors["measured"].iloc[1]
    limited = replace(good, torque=np.clip(good.torque, -0.6 * good.torque.max(), 0.6 * good.torque.max()))
    assert "is it limited?" in warnings(dt.identify(guess, limited))
    flat = dt.identify(guess, replace(good, torque=good.torque * [1.0, 0.0]))
    assert "the torque of joint_2 does not change" in warnings(flat)
    still = np.array([1.0, 0.0])
    noisy = good.velocity * still + 1e-3 * np.random.default_rng(5).normal(size=good.velocity.shape)
    resting = replace(good, position=good.position * still, velocity=noisy, acceleration=good.acceleration * still)
    found = dt.identify(guess, resting)
    assert "joint_2 does not move" in warnings(found) and found.friction[1].coulomb < 1e-3
    told = found.parameters["deviation"]
    assert told[["joint_2.viscous [N m s/rad]", "joint_2.coulomb [N m]"]].tolist() == [np.inf] * 2
    with pytest.raises(dt.InputError, match="list of Friction"):
        dt.identify(guess, good, friction=[1.0, 2.0])


@pytest.mark.parametrize("correlation", [0.0, 0.95])
def test_deviations_of_friction_hold(correlation: float) -> None:
    """Also with correlated noise, and with friction whose sign changes at once."""
    arm, guess = arms()
    missed = []
    for seed in range(8):
        found = dt.identify(guess, recorded(arm, np.random.default_rng(10 + seed), correlation=correlation))
        friction = found.parameters.iloc[-4:]
        missed.extend((friction["identified"] - np.r_[VISCOUS, COULOMB]) / friction["deviation"])
    assert np.mean(np.abs(missed) < 1.96) >= 0.85  # of 32; 0.95 on average
    assert 0.4 < np.sqrt(np.mean(np.square(missed))) < 1.5
