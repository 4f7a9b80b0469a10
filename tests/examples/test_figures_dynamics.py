"""Pictures of rigid bodies, stacked matrices and readings: what they draw is what was computed."""

from __future__ import annotations

import numpy as np
import pytest
from figures.closed_form import figure_stacked
from figures.readings import figure_torque_from_positions
from figures.rigid_body import figure_free_motion

from drivetrain.arm.files.load import load_arm
from drivetrain.dynamics.book.closed_form import closed_form, stacked
from drivetrain.dynamics.from_positions import torque_from_positions
from drivetrain.dynamics.inverse import inverse_dynamics
from drivetrain.errors import InputError
from drivetrain.report.charts.plotting import house_style, png_bytes
from drivetrain.spatial.free_body import free_motion
from drivetrain.spatial.inertia import cuboid


def drawn(figure: object) -> None:
    with house_style("test"):
        assert png_bytes(figure, dpi=40)[:4] == b"\x89PNG"


def test_free_motion() -> None:
    book = cuboid(1.2, 0.22, 0.15, 0.03)
    time = np.linspace(0.0, 1.0, 101)
    flights = [free_motion(book.spatial_inertia(), np.eye(4), [*w, 0, 0, 0], time) for w in ([1, 5, 0], [0, 5, 3])]
    figure = figure_free_motion(book.inertia, flights[0], flights[1:])
    sphere, rates = figure.axes
    for axis in range(3):
        np.testing.assert_array_equal(rates.lines[axis].get_ydata(), flights[0].twists[:, axis])
    curves = [np.array(line.get_data_3d()) for line in sphere.lines[:2]]
    for curve in curves:
        seen = curve[:, ~np.isnan(curve[0])]
        assert np.linalg.norm(seen, axis=0) == pytest.approx(np.ones(seen.shape[1]))
    drawn(figure)
    with pytest.raises(InputError, match="inertia"):
        figure_free_motion(np.eye(2), flights[0])


def test_stacked_matrices() -> None:
    arm = load_arm("puma560")
    q = np.arange(6.0) / 3.0
    figure = figure_stacked(arm, q)
    m = stacked(arm, q)
    shown = [panel.images[0].get_array().filled(0.0) for panel in figure.axes]
    for found, wanted in zip(shown, (m.A, m.G, m.W, m.L, closed_form(arm, q, 0 * q).mass), strict=True):
        # Rounding below 1e-12 of the largest entry is left out of the picture.
        assert found == pytest.approx(np.abs(wanted), abs=1e-12 * np.abs(wanted).max())
    drawn(figure)
    with pytest.raises(InputError, match="q"):
        figure_stacked(arm, q[:5])


def test_torque_from_positions() -> None:
    arm = load_arm("ur5")
    time = 1e-3 * np.arange(300)
    x = 6.0 * time[:, None] + np.arange(6)
    path, speed, acceleration = np.sin(x), 6.0 * np.cos(x), -36.0 * np.sin(x)
    exact = inverse_dynamics(arm, path, speed, acceleration)
    read = np.round(path / 1e-3) * 1e-3
    rough, found = (torque_from_positions(arm, time, read, resolution=step) for step in (0.0, 1e-3))
    figure = figure_torque_from_positions(time, found, 2, differenced=rough.torque, exact=exact)
    top, middle, bottom = figure.axes
    np.testing.assert_array_equal(top.lines[0].get_ydata(), rough.torque[:, 2])
    np.testing.assert_array_equal(middle.lines[0].get_ydata(), found.torque[:, 2])
    np.testing.assert_array_equal(middle.lines[1].get_ydata(), exact[:, 2])
    np.testing.assert_array_equal(bottom.lines[1].get_ydata(), (found.torque - exact)[:, 2])
    drawn(figure)
    drawn(figure_torque_from_positions(time, found, 0))
    with pytest.raises(InputError, match="joint"):
        figure_torque_from_positions(time, found, 6)
    with pytest.raises(InputError, match="exact"):
        figure_torque_from_positions(time, found, 0, exact=exact[:5])
