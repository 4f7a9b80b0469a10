"""Inertias that a body could have, but not this one: too wide and too thin for where its joints are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivetrain.arm.checks import called, triangle_doubt
from drivetrain.arrays import Array
from drivetrain.spatial.inertia import RigidBody, half_axes

REACH_FACTOR = 2.0  # a radius of gyration may pass the link's own size, by covers and by joints drawn at one point
DENSITY = 20.0  # kg/m^3: packing foam; the clean arms known to us lie above 50, the faulty UR5 wrists at 1 and 8
THINNEST = 0.1  # of the widest half axis: thin plates and rods count as this thick


def doubts(name: str, body: RigidBody, points: Sequence[Array]) -> list[str]:
    """What is hard to believe of a link's mass and inertia.

    Two tests. No body breaks the triangle inequality of the principal moments. And no link is both much wider than
    the distances between its joints and its centre of mass, and lighter than foam would be if it were so wide: the
    usual trace of a radius or unit wrong by a factor of ten, or of a placeholder of 1 kg m^2. Either sign alone has
    innocent causes (thin links, joints drawn at one point, large covers).

    Args:
        body: In the link's frame [kg, m, kg m^2].
        points: Origins of the link's own and its children's joints in the link's frame [m], (3,) each.
    """
    if body.mass <= 0.0:
        return []
    found = [doubt for doubt in [triangle_doubt(body.inertia, name)] if doubt]
    all_points = np.array([*points, body.com])
    size = float(np.linalg.norm(all_points[:, np.newaxis] - all_points, axis=2).max())
    largest = float(np.linalg.eigvalsh(body.inertia)[2])
    gyration = float(np.sqrt(max(largest, 0.0) / body.mass))
    density = mean_density(body)
    if gyration > REACH_FACTOR * size and density < DENSITY:
        found.append(
            f"{called(name)}: {largest:.4g} kg m^2 with {body.mass:.4g} kg is a radius of gyration of {gyration:.3g} m"
            f", but its joints and centre of mass lie within {size:.3g} m, and a body so wide would have a density of "
            f"{density:.2g} kg/m^3: check its inertia"
        )
    return found


def mean_density(body: RigidBody) -> float:
    """The density of the uniform ellipsoid with a body's mass and inertia.

    Args:
        body: With positive mass [kg].

    Returns:
        [kg/m^3]; infinite for a point mass.
    """
    axes = half_axes(body.mass, body.inertia)
    volume = 4.0 / 3.0 * np.pi * float(np.prod(np.maximum(axes, THINNEST * axes[0])))
    return body.mass / volume if volume > 0.0 else float("inf")
