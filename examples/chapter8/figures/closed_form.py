"""The stacked matrices of the closed form, to look at: which body rides on which, and what depends on what."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array, checked_array
from drivetrain.dynamics.book.closed_form import closed_form, stacked
from drivetrain.report.charts.chart import FAINT, MUTED
from drivetrain.report.charts.plotting import house_style

NEGLIGIBLE = 1e-12  # of the largest entry: rounding, drawn as zero
NARROW = 0.17  # width of A over that of the square matrices
DECADES = 6  # entries smaller than the largest by more are drawn as the smallest shown


def figure_stacked(arm: Arm, q: Any) -> Figure:
    """The matrices A, G, W and L of an arm, entry by entry, and the mass matrix that they make.

    Args:
        q: One posture [rad or m], (n,).

    Raises:
        InputError: A wrong shape, or a NaN or infinity.
    """
    posture = checked_array(q, (arm.n,), "q")
    m = stacked(arm, posture)
    mass = closed_form(arm, posture, np.zeros(arm.n)).mass
    count = len(m.carriers)
    labels = [f"{i + 1}" for i in range(arm.n)] + [f"r{k + 1}" for k in range(count - arm.n)]
    with house_style("stacked"):
        figure = Figure(figsize=(9.6, 3.2))
        panels = figure.subplots(1, 5, width_ratios=[NARROW, 1.0, 1.0, 1.0, 0.5])
        for panel, title, matrix in zip(panels, ("A", "G", "W(θ)", "L(θ)"), (m.A, m.G, m.W, m.L), strict=False):
            _draw(panel, matrix, title)
            panel.set_yticks(6.0 * np.arange(count) + 2.5, labels, fontsize=6)
            _grid(panel, count, matrix.shape[1] // 6 if matrix.shape[1] == 6 * count else 0)
        for panel in panels[1:4]:
            panel.set_xticks(6.0 * np.arange(count) + 2.5, labels, fontsize=6)
        panels[0].set_xticks([0, arm.n - 1], [labels[0], labels[arm.n - 1]], fontsize=6)
        panels[0].set(aspect="auto", box_aspect=1.0 / NARROW)
        _draw(panels[4], mass, "M = AᵀLᵀGLA")
        panels[4].set_xticks(np.arange(arm.n), labels[: arm.n], fontsize=6)
        panels[4].set_yticks(np.arange(arm.n), labels[: arm.n], fontsize=6)
        panels[0].set_ylabel("links 1 to n, then rotors r1, r2, ...")
        figure.supxlabel(f"dark is large, each matrix on its own scale of {DECADES} decades; white is zero", fontsize=8)
    return figure


def _draw(panel: Axes, matrix: Array, title: str) -> None:
    size = np.abs(matrix)
    largest = float(size.max()) or 1.0
    shown = np.ma.masked_less_equal(size, NEGLIGIBLE * largest)
    scale = LogNorm(largest * 10.0**-DECADES, largest, clip=True)
    panel.imshow(shown, cmap="Blues", norm=scale, interpolation="nearest", aspect="equal")
    panel.set_title(title)
    panel.grid(False)
    panel.tick_params(length=0)
    for spine in panel.spines.values():
        spine.set(visible=True, color=MUTED)


def _grid(panel: Axes, rows: int, columns: int) -> None:
    """Lines between bodies."""
    for k in range(1, rows):
        panel.axhline(6 * k - 0.5, color=FAINT, linewidth=0.5)
    for k in range(1, columns):
        panel.axvline(6 * k - 0.5, color=FAINT, linewidth=0.5)
