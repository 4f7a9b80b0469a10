"""Pictures of friction laws and of the tip's deflection: they show what was computed, in readable units."""

from __future__ import annotations

import numpy as np
from figures.flexibility import figure_flexibility
from figures.friction import figure_friction

from drivetrain.drive.friction import Friction, book_curves, friction_torque
from drivetrain.report.charts.plotting import house_style, svg_text
from drivetrain.sizing.deflection import TipDeflection, Vibration


def deflection(play: float = 0.0) -> TipDeflection:
    time = np.linspace(0.0, 2.0, 40)
    wave = np.sin(np.pi * time)[:, None, None]
    joints = 1e-3 * wave * np.array([[[0, 0, -1.0], [0.5, 0, 0]]])
    links = 2e-4 * wave * np.array([[[0, 1.0, 0], [0, 0, 0]]])
    backlash = play * np.ones((40, 2, 1)) * np.array([[[0, 0, -1.0], [0, 0, -0.5]]])
    return TipDeflection(
        time, ("a", "b"), ("one", "two"), 1e-3 * wave[:, :, 0] * np.ones(2), joints, links, backlash,
        np.full(40, 3 * play), (), (),
    )  # fmt: skip


def vibration() -> Vibration:
    time = np.linspace(0.0, 2.0, 40)
    locked = np.column_stack([7 + time, 20 + time])
    return Vibration(time, np.full((40, 2), 1e4), locked, 3 * locked, ())


def test_friction_curves_are_the_laws() -> None:
    laws = book_curves(static=3e-3, kinetic=2e-3, viscous=1e-3, stribeck_speed=0.3)
    figure = figure_friction(laws, top_speed=2.0)
    assert [axes.get_title("left") for axes in figure.axes] == list("abcdef")
    for axes, law in zip(figure.axes, laws.values(), strict=True):
        assert axes.get_ylim()[1] > 3.0  # shown in mN m
        for line in axes.lines[2:4]:
            speed, torque = line.get_data()
            np.testing.assert_allclose(torque, 1e3 * friction_torque(law, np.asarray(speed)), rtol=1e-12)
    held = [axes.lines[4].get_ydata() for axes in figure.axes]
    np.testing.assert_allclose(held[0], 0.0)
    np.testing.assert_allclose(held[3], [-3.0, 3.0], rtol=1e-12)


def test_friction_of_four_laws_leaves_no_empty_frame() -> None:
    laws = {"one": Friction(1.0), "two": Friction(2.0), "three": Friction(1.5), "none": Friction()}
    figure = figure_friction(laws, top_speed=1.0)
    assert [axes.get_visible() for axes in figure.axes] == [True] * 4 + [False] * 2


def test_deflection_strips() -> None:
    plain = figure_flexibility(deflection())
    assert len(plain.axes) == 2
    assert "mm" in plain.axes[0].get_ylabel()
    assert "1.13 mm" in plain.axes[0].get_title("left")  # sqrt(1 + 0.25 + 0.04) at its peak, sampled
    labels = [text.get_text() for text in plain.axes[1].get_legend().get_texts()]
    assert labels == ["a", "b", "one, bending", "all one way"]  # the stiff link is left out
    full = figure_flexibility(deflection(play=1e-4), vibration())
    assert [axes.get_ylabel() for axes in full.axes][2:] == ["size [mm]", "frequency [Hz]"]
    assert "7.00 Hz" in full.axes[-1].get_title("left")


def test_same_input_same_bytes() -> None:
    def drawn() -> str:
        with house_style("flexibility"):
            return svg_text(figure_flexibility(deflection(1e-4), vibration()), "tip deflection")

    first = drawn()
    assert first.startswith("<svg")
    assert first == drawn()
