"""The pictures of the mass matrix: what is drawn where, against numbers, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from figures.mass_matrix import (
    figure_mass_ellipsoids,
    figure_ratio_sweep,
    figure_tip_mass,
    figure_velocity_accelerations,
)
from matplotlib.figure import Figure
from matplotlib.quiver import Quiver

from drivetrain.arm.files.load import load_arm
from drivetrain.dynamics.book.planar_2r import Planar2R, planar_2r_arm
from drivetrain.dynamics.book.ratio_sweep import sweep_ratio
from drivetrain.errors import InputError
from drivetrain.report.charts.plotting import house_style, png_bytes

ARM = planar_2r_arm(Planar2R())
POSTURES = np.radians([[0.0, 90.0], [0.0, 150.0]])
XZ = np.eye(3)[[0, 2]]


def drawn(figure: Figure) -> bytes:
    with house_style("test"):
        return png_bytes(figure, dpi=40)


def arrows(figure: Figure, panel: int) -> np.ndarray:
    found = [item for item in figure.axes[panel].collections if isinstance(item, Quiver)]
    return np.array([[item.U[0], item.V[0]] for item in found])


def test_figure_8_2_points_where_the_book_says() -> None:
    figure = figure_velocity_accelerations(ARM, POSTURES[0], [1.0, 1.0])
    first, second, everything = (arrows(figure, panel) for panel in range(3))
    np.testing.assert_allclose(first[0] / np.linalg.norm(first[0]), [-np.sqrt(0.5)] * 2, atol=1e-12)
    np.testing.assert_allclose(second[0] / np.linalg.norm(second[0]), [0.0, -1.0], atol=1e-12)
    # Centripetal, centripetal and Coriolis in one scale: (-1, -1), (0, -1), (0, -2).
    np.testing.assert_allclose(everything / -everything[0, 0], [[-1, -1], [0, -1], [0, -2]], atol=1e-12)
    assert figure.axes[2].get_title(loc="left") == "all: Coriolis 2, sum 4.12 m/s²"
    assert drawn(figure).startswith(b"\x89PNG")


def test_figure_8_3_draws_the_ellipses() -> None:
    figure = figure_mass_ellipsoids(ARM, POSTURES)
    _, accelerations, torques = figure.axes[:3]
    curve = torques.lines[0].get_xydata()
    back = np.linalg.solve([[3.0, 1.0], [1.0, 1.0]], curve.T)
    np.testing.assert_allclose(np.linalg.norm(back, axis=0), 1.0, rtol=1e-12)
    dotted = accelerations.lines[1].get_xydata()
    np.testing.assert_allclose(np.linalg.norm(dotted @ [[3.0, 1.0], [1.0, 1.0]], axis=1), 1.0, rtol=1e-12)
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles[:3] == ["θ = (0°, 90°)", "M⁻¹ = [0.5  -0.5 ; -0.5  1.5]", "M = [3  1 ; 1  1]"]
    assert titles[3:] == ["θ = (0°, 150°)", "M⁻¹ = [0.8  -0.107 ; -0.107  1.01]", "M = [1.27  0.134 ; 0.134  1]"]
    assert torques.get_xlabel() == "torque 1 [N m]" and accelerations.get_ylabel() == "acceleration 2 [rad/s²]"
    assert drawn(figure)


def test_figure_8_4_marks_the_example_force() -> None:
    figure = figure_tip_mass(ARM, POSTURES[1])
    _, moved, pushed = figure.axes
    np.testing.assert_allclose(moved.lines[-1].get_xydata(), [[0.4, 0.2 * np.sqrt(3)]], rtol=1e-12)
    np.testing.assert_array_equal(pushed.lines[-1].get_xydata(), [[1.0, 0.0]])
    assert pushed.get_title(loc="left") == "Λ = [4  -1.73 ; -1.73  2]"
    assert drawn(figure)


def test_a_stretched_arm_is_drawn_with_words() -> None:
    figure = figure_tip_mass(ARM, [0.0, 0.0])
    assert figure.axes[2].get_title(loc="left") == "Λ = infinite in a direction"
    assert drawn(figure)


def test_any_arm() -> None:
    arm, q = load_arm("ur5"), np.radians([0.0, -60.0, 80.0, -110.0, -90.0, 0.0])
    seen = figure_velocity_accelerations(arm, q, np.ones(6), plane=XZ)
    assert [axes.get_visible() for axes in seen.axes] == [True] * 7 + [False]
    assert seen.axes[5].get_title(loc="left") == "joint 6 alone: 0 m/s²"  # the tip is on its axis
    assert len(arrows(seen, 5)) == 0
    tip = figure_tip_mass(arm, q, plane=XZ)
    assert tip.axes[1].get_ylabel() == "acceleration z [m/s²]"
    pair = figure_mass_ellipsoids(arm, q, joints=(1, 2), plane=XZ)
    assert pair.axes[2].get_xlabel() == "torque 2 [N m]" and pair.axes[0].get_title(loc="left") == "ur5"
    assert drawn(seen) and drawn(tip) and drawn(pair)


def test_ratio_sweep_draws_its_numbers() -> None:
    arm = load_arm("planar-2r")
    elbows = np.column_stack([np.zeros(7), np.linspace(0, np.pi, 7)])
    sweep = sweep_ratio(arm, elbows, np.geomspace(1, 1000, 9))
    figure = figure_ratio_sweep({"planar-2r": sweep}, arm, elbows)
    upper, lower = figure.subfigs
    assert [axes.get_title(loc="left") for axes in upper.axes] == [f"planar-2r, ratio {g}" for g in (10, 100, 1000)]
    assert len(upper.axes[0].lines) == 7
    coupling, variation = lower.axes
    np.testing.assert_array_equal(coupling.lines[0].get_ydata(), np.median(sweep.coupling, axis=1))
    np.testing.assert_array_equal(variation.lines[0].get_ydata(), sweep.variation.max(axis=1))
    assert coupling.get_xscale() == variation.get_yscale() == "log"
    assert drawn(figure)


def test_same_bytes_twice() -> None:
    assert drawn(figure_tip_mass(ARM, POSTURES)) == drawn(figure_tip_mass(ARM, POSTURES))


def test_wrong_input() -> None:
    with pytest.raises(InputError, match="two"):
        figure_mass_ellipsoids(ARM, POSTURES, joints=(0,))
    with pytest.raises(InputError, match="postures"):
        figure_tip_mass(ARM, np.zeros((7, 2)))
    for plane in (np.eye(2), [[1, 0, 0], [1, 0, 0]], np.eye(3)):
        with pytest.raises(InputError, match="plane"):
            figure_tip_mass(ARM, POSTURES, plane=plane)
    with pytest.raises(InputError, match="qd"):
        figure_velocity_accelerations(ARM, POSTURES[0], [1.0])
    with pytest.raises(InputError, match="no rotors"):
        figure_ratio_sweep({}, ARM, POSTURES)
