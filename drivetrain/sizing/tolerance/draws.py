"""Random samples of motor, gear, payload, force and ambient values within their tolerances.

The values of a joint's parts are independent of those of other joints; each payload, the ambient temperature and the
forces at the tip have one value per sample. A sample is one row of a stream of numpy's default generator (PCG64), so
its values depend on the seed and on its row alone: not on the number of samples, on blocks, or on threads.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from drivetrain.arrays import Array
from drivetrain.errors import Fault
from drivetrain.study.model import Study
from drivetrain.study.parts.tolerances import SMALLEST, Tolerance

PARTS = ("torque_constant", "resistance", "friction", "efficiency", "thermal_resistance", "drag")
CONSTANT, RESISTANCE, FRICTION, EFFICIENCY, THERMAL, DRAG = range(6)

Pair = tuple[str, str]


@dataclass(frozen=True)
class Source:
    """One independent random quantity."""

    quantity: str  # name of its tolerance in the study
    place: str = ""  # name of the joint or the payload; empty for the ambient temperature and the force at the tip

    def __str__(self) -> str:
        words = {"force": "force at the tip"}.get(self.quantity, self.quantity.replace("_", " "))
        return f"{words} of {self.place}" if self.place else words


@dataclass(frozen=True, eq=False)
class Draws:
    """Random samples of a study's uncertain quantities."""

    factors: Array  # on the nominal values of each joint, in the order of ``PARTS``, (samples, n, 6)
    ambient: Array  # ambient temperature [C], (samples,)
    # factors on mass and inertia of each payload and, last, on the forces at the tip, (samples, payloads + 1)
    loads: Array

    def __len__(self) -> int:
        return len(self.ambient)


def sources(study: Study) -> tuple[Source, ...]:
    """The independent random quantities of a study."""
    given = study.tolerances.given
    found = [Source(name, task.name) for task in study.joints for name in PARTS if name in given]
    if "payload" in given and study.arm is not None:
        found += [Source("payload", body.name) for body in study.payloads if body.mass > 0.0]
    if "ambient" in given:
        found.append(Source("ambient"))
    if "force" in given and study.cycle.tip_wrench is not None:
        found.append(Source("force"))
    return tuple(found)


def check_seed(seed: int) -> list[Fault]:
    """The fault of a seed that the random numbers cannot start from, if it has one."""
    return [] if seed >= 0 else [Fault("seed", "must be 0 or more", seed)]


def drawn(study: Study, samples: int, seed: int | tuple[int, ...]) -> Draws:
    """Random samples."""
    return from_uniform(study, np.random.default_rng(seed).random((samples, len(sources(study)))))


def streamed(study: Study, samples: int, seed: int | tuple[int, ...], *, most: int) -> Iterator[Draws]:
    """The samples of ``drawn`` in batches of at most ``most``, so that memory does not grow with their number."""
    stream, columns = np.random.default_rng(seed), len(sources(study))
    for first in range(0, samples, most):
        yield from_uniform(study, stream.random((min(most, samples - first), columns)))


def from_uniform(study: Study, uniform: Array) -> Draws:
    """Samples from uniform random numbers, by the inverse distribution functions of the tolerances.

    ``uniform``: between 0 and 1, one column per source, (samples, sources).
    """
    found, edge = sources(study), 2.0**-53  # excludes 0 and 1, at which a normal distribution is infinite
    columns = np.clip(uniform, edge, 1.0 - edge).T
    deviations = [_tolerance(study, one).deviation(column) for one, column in zip(found, columns, strict=True)]
    return deviated(study, len(uniform), dict(zip(found, deviations, strict=True)))


def deviated(study: Study, samples: int, deviations: Mapping[Source, Array]) -> Draws:
    """Samples with given deviations from the nominal values.

    ``deviations``: of some sources, in the unit of their tolerance, (samples,) each; all others are nominal.
    """
    names = study.joint_names
    bodies = [body.name for body in study.payloads]
    factors = np.ones((samples, len(names), len(PARTS)))
    ambient, loads = np.full(samples, study.ambient), np.ones((samples, len(bodies) + 1))
    for source, deviation in deviations.items():
        if source.quantity == "ambient":
            ambient += deviation
        elif source.quantity == "payload":
            body = bodies.index(source.place)
            mass = study.payloads[body].mass if _tolerance(study, source).absolute else 1.0
            loads[:, body] = np.maximum(1.0 + deviation / mass, 0.0)
        elif source.quantity == "force":
            loads[:, -1] = np.maximum(1.0 + deviation, 0.0)
        else:
            at = names.index(source.place), PARTS.index(source.quantity)
            factors[:, at[0], at[1]] = np.maximum(1.0 + deviation, SMALLEST)
    return Draws(factors, ambient, loads)


def _tolerance(study: Study, source: Source) -> Tolerance:
    found = getattr(study.tolerances, source.quantity)
    return found if isinstance(found, Tolerance) else Tolerance(0.0)
