from __future__ import annotations

import xml.etree.ElementTree as ET

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from drivetrain.report.charts.plotting import house_style, png_bytes, svg_text


def picture(name: str, points: int = 50) -> str:
    with house_style(name):
        figure = Figure(figsize=(3, 2))
        axes = figure.subplots()
        axes.plot(np.linspace(0, 1, points), np.sin(np.arange(points)), clip_on=True)
        axes.set_xlabel("speed [rpm]")
        return svg_text(figure, "a <picture> & more")


def test_same_input_same_bytes() -> None:
    assert picture("one") == picture("one")


def test_nothing_tells_the_time() -> None:
    text = picture("one")
    root = ET.fromstring(text)
    assert "<dc:date>" not in text and root.get("viewBox")
    assert root.get("aria-label") == "a <picture> & more"


def test_style_ignores_and_leaves_alone_the_users_settings() -> None:
    plain = picture("one")
    with mpl.rc_context({"axes.facecolor": "pink", "font.size": 30}):
        assert picture("one") == plain
        assert mpl.rcParams["font.size"] == 30


def test_png_is_a_png() -> None:
    with house_style("p"):
        figure = Figure(figsize=(1, 1))
        figure.subplots()
        assert png_bytes(figure).startswith(b"\x89PNG")
