"""Random catalogues of any size: parts by scaling laws with scatter, so that sets of drives are hard to tell apart."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import product

import numpy as np

from drivetrain.catalog.read import Catalog
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.study.study import Study

RATIOS = (50.0, 80.0, 100.0, 120.0, 160.0)


def random_catalog(pairs: int, seed: int, *, voltage: float = 48.0) -> Catalog:
    """Motors and gears whose every combination is a candidate.

    Args:
        pairs: How many combinations are wanted; the nearest square at or above it is made.
        seed: Of the scatter.
        voltage: Nominal, of the motors [V].

    Returns:
        The catalogue; masses from those of a wrist to those of a shoulder, prices that grow with mass and scatter.
    """
    rng = np.random.default_rng(seed)
    each = math.ceil(math.sqrt(pairs))
    motors = [_motor(f"motor_{index}", rng, voltage) for index in range(each)]
    gears = [_gear(f"gear_{index}", rng) for index in range(each)]
    return Catalog({row.key: row for row in motors}, {row.key: row for row in gears})


def with_candidates(study: Study, catalog: Catalog, pairs: tuple[tuple[str, str], ...] | None = None) -> Study:
    """A study whose every joint may have any pair of a catalogue.

    Args:
        study: The task.
        catalog: The rows.
        pairs: Keys of (motor, gear); None: every combination.

    Returns:
        The study, given drives taken out.
    """
    chosen = tuple(product(catalog.motors, catalog.gears)) if pairs is None else pairs
    return replace(
        study, catalog=catalog, joints=tuple(replace(task, drive=None, pairs=chosen) for task in study.joints)
    )


def _scatter(rng: np.random.Generator, share: float) -> float:
    return math.exp(share * float(rng.standard_normal()))


def _motor(key: str, rng: np.random.Generator, voltage: float) -> Motor:
    """Frameless motors: continuous torque as mass^1.15, motor constant as mass^0.85, inertia as mass^1.6."""
    mass = 10.0 ** rng.uniform(-1.2, 0.6)
    constant = voltage / rng.uniform(300.0, 700.0)
    resistance = (constant / (0.16 * mass**0.85 * _scatter(rng, 0.15))) ** 2
    current = 1.5 * mass**1.15 * _scatter(rng, 0.15) / constant
    whole = 90.0 / (1.4 * resistance * current**2)  # K/W at which the printed current heats by some 90 K
    return Motor(
        key, resistance, constant, series=f"series {int(rng.integers(5))}", frameless=True,
        inductance=1e-3 * resistance, rotor_inertia=5e-5 * mass**1.6 * _scatter(rng, 0.2), mass=mass,
        nominal_voltage=voltage, nominal_current=current, peak_current=3.0 * current,
        max_speed=1.3 * voltage / constant, coulomb_friction=0.01 * current * constant,
        resistance_winding_housing=0.25 * whole, resistance_housing_ambient=0.75 * whole,
        winding_time_constant=25.0 * mass**0.3, housing_time_constant=900.0 * mass**0.2,
        max_winding_temperature=125.0, price=60.0 + 260.0 * mass**0.7 * _scatter(rng, 0.35), source="random",
    )  # fmt: skip


def _gear(key: str, rng: np.random.Generator) -> Gear:
    """Strain-wave gears: torque as mass^1.2, inertia as mass^1.6."""
    mass, ratio = 10.0 ** rng.uniform(-1.0, 0.7), float(rng.choice(RATIOS))
    torque = 42.0 * mass**1.2 * _scatter(rng, 0.15) * (ratio / 100.0) ** 0.3
    return Gear(
        key, ratio, series=f"series {int(rng.integers(4))}", kind="strain_wave", efficiency=rng.uniform(0.65, 0.82),
        inertia=4e-5 * mass**1.6 * _scatter(rng, 0.2), mass=mass, continuous_torque=torque,
        average_torque_limit=1.2 * torque, repeated_peak_torque=2.1 * torque, momentary_torque=4.2 * torque,
        max_input_speed=730.0, average_input_speed_limit=365.0, rated_speed=209.0, rated_life=2.5e7,
        tilting_moment_limit=250.0 * mass, no_load_torque=0.02 * torque / ratio,
        price=140.0 + 300.0 * mass**0.6 * _scatter(rng, 0.3), source="random",
    )  # fmt: skip
