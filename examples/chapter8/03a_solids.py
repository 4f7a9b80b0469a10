"""Modern Robotics figure 8.5: three solids, their principal axes and moments, by formula and by equation 8.24."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from drivetrain.spatial.inertia import cuboid, cylinder, ellipsoid

MASS, SAMPLES = 2.0, 400_000


def by_chance(inside: np.ndarray, box: np.ndarray) -> np.ndarray:
    """Equation 8.24 as a mean over points spread evenly through the solid, [kg m^2]."""
    points = box * inside
    return MASS * (np.einsum("ni,ni->", points, points) * np.eye(3) - points.T @ points) / len(points)


def main(picture: Path) -> None:
    points = np.random.default_rng(85).uniform(-1.0, 1.0, (SAMPLES, 3))
    round_, ball = np.hypot(points[:, 0], points[:, 1]) <= 1.0, np.linalg.norm(points, axis=1) <= 1.0
    u, v = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, 41), np.linspace(-1.0, 1.0, 21))
    side = np.array([np.cos(u), np.sin(u), v])
    skin = np.array([np.cos(u) * np.cos(v * np.pi / 2), np.sin(u) * np.cos(v * np.pi / 2), np.sin(v * np.pi / 2)])
    edges = np.array([[-1, 1, 1, -1, -1], [-1, -1, 1, 1, -1]])
    frame = np.stack([np.array([*edges, np.full(5, z)]) for z in (-1.0, 1.0)], axis=2)
    solids = {
        "box of 0.3, 0.2, 0.1 m": (cuboid(MASS, 0.3, 0.2, 0.1), points, np.array([0.15, 0.1, 0.05]), frame),
        "cylinder, radius 0.1, height 0.3 m": (
            cylinder(MASS, 0.1, 0.3), points[round_], np.array([0.1, 0.1, 0.15]), side),
        "ellipsoid, half axes 0.15, 0.1, 0.05 m": (
            ellipsoid(MASS, 0.15, 0.1, 0.05), points[ball], np.array([0.15, 0.1, 0.05]), skin),
    }  # fmt: skip
    figure = Figure(figsize=(10.0, 3.2), layout="constrained")
    print(f"{MASS:g} kg, moments about x, y, z [g m^2]: by formula, and by {SAMPLES} random points")
    for k, (name, (body, inside, half, surface)) in enumerate(solids.items(), 1):
        moments, chance = np.diag(body.inertia), by_chance(inside, half)
        print(f"{name:42s} {np.round(1e3 * moments, 3)}  {np.round(1e3 * np.diag(chance), 2)}")
        axes = figure.add_subplot(1, 3, k, projection="3d")
        axes.plot_wireframe(*(half[:, None, None] * surface), color="0.6", linewidth=0.5)
        for i, (letter, moment) in enumerate(zip("xyz", moments, strict=True)):
            tip = 0.22 * np.eye(3)[i]
            axes.plot(*np.array([0 * tip, tip]).T, color=f"C{i}")
            axes.text(*tip, f"{letter}: {1e3 * moment:.2f}", color=f"C{i}")
        axes.set(xlim=(-0.15, 0.15), ylim=(-0.15, 0.15), zlim=(-0.15, 0.15), box_aspect=(1, 1, 1))
        axes.set_title(f"{name}\nmoments [g m²] of {MASS:g} kg", fontsize=9)
        axes.set_axis_off()
    figure.savefig(picture, dpi=150)
    print(f"drew {picture}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(Path(__file__).stem + ".png"))
