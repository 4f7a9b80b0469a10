"""Pictures written directly: curves keep their shape, dots their places, ticks are round, names do not clash."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from drivetrain.report.panel import cloud, panel, time_bar
from drivetrain.report.picture import Font, Key, Pen, Picture, dot_data, legend_height, line_data
from drivetrain.report.scales import Scale, padded, round_step, text_width, tick_texts
from drivetrain.report.thinning import told_apart

SVG = "{http://www.w3.org/2000/svg}"


def drawn(name: str, points: int = 50) -> str:
    picture = Picture(name, 200.0, 100.0)
    axes = panel(picture, (20.0, 190.0), (10.0, 80.0), (0.0, 1.0), (-1.2, 1.2))
    axes.grid()
    axes.curve(np.linspace(0, 1, points), np.sin(np.arange(points)), Pen())
    axes.edges()
    axes.x_axis("speed [rpm]")
    axes.y_axis("torque [N m]")
    picture.legend([Key("one"), Key("a <b>", "dot", Pen("none"), "#123")], 5.0, across=(0.0, 200.0))
    return picture.svg("a <picture> & more")


def places(data: str) -> np.ndarray:
    """Absolute places [tenths of a point] of a line's commands."""
    numbers = np.array([int(text) for text in re.findall(r"-?\d+", data)]).reshape(-1, 2)
    return numbers.cumsum(axis=0)


def test_same_input_same_bytes_and_well_formed() -> None:
    assert drawn("one") == drawn("one")
    root = ET.fromstring(drawn("one"))
    assert root.get("width") is None and root.get("viewBox") == "0 0 2000 1000"
    assert root.get("aria-label") == "a <picture> & more"
    assert {"speed [rpm]", "torque [N m]", "one", "a <b>"} <= {e.text for e in root.iter(f"{SVG}text")}


def test_two_pictures_share_no_name_and_every_reference_is_defined() -> None:
    ids = []
    for name in ("one", "two"):
        root = ET.fromstring(drawn(name))
        defined = {e.get("id") for e in root.iter() if e.get("id")}
        used = {e.get("clip-path", "")[5:-1] for e in root.iter() if e.get("clip-path")}
        assert used and used <= defined
        ids.append(defined)
    assert not ids[0] & ids[1]


def test_a_line_keeps_its_corners_and_only_those() -> None:
    x = np.array([0.0, 1.0, 2.0, 3.0, 3.0, 3.0, 3.0, 2.0, 4.0])
    y = np.array([0.0, 1.0, 2.0, 3.0, 3.0, 4.0, 5.0, 5.0, 5.0])
    corners = places(line_data(x, y)) / 10.0
    np.testing.assert_array_equal(corners, [[0, 0], [3, 3], [3, 5], [2, 5], [4, 5]])


@pytest.mark.parametrize("seed", range(5))
def test_every_point_of_a_curve_lies_on_what_is_drawn(seed: int) -> None:
    rng = np.random.default_rng(seed)
    x, y = np.sort(rng.uniform(0, 50, 300)), np.cumsum(rng.integers(-1, 2, 300)) * 0.1
    shown = places(line_data(x, y)) / 10.0
    assert len(shown) <= 300
    # x rises, so the drawn line is a function of x wherever it does not stand upright.
    clear = np.searchsorted(shown[:, 0], np.round(x, 1), side="right") == np.searchsorted(shown[:, 0], np.round(x, 1))
    on_line = np.interp(np.round(x, 1), shown[:, 0], shown[:, 1])
    assert np.abs(on_line - y)[clear].max(initial=0.0) < 0.051  # half a tenth of a point


def test_dots_stand_where_they_should() -> None:
    rng = np.random.default_rng(3)
    x, y = rng.uniform(0, 100, 40), rng.uniform(0, 100, 40)
    steps = np.array([[int(v) for v in pair] for pair in re.findall(r"m(-?\d+) ?(-?\d+)h0", dot_data(x, y))])
    np.testing.assert_allclose(steps.cumsum(axis=0) / 10.0, np.column_stack([x, y]), atol=0.0501)


def test_dots_on_one_another_are_drawn_once_a_colour() -> None:
    x, y = np.array([0.0, 0.1, 0.1, 5.0, 5.1]), np.zeros(5)
    assert told_apart(x, y, np.array([0, 0, 1, 0, 0]), 0.5).tolist() == [1, 2, 4]
    assert len(told_apart(np.zeros(0), np.zeros(0), np.zeros(0, dtype=int), 0.5)) == 0


def test_ticks_are_round_inside_and_apart() -> None:
    scale = Scale(-3.7, 12.2, 0.0, 300.0)
    ticks = scale.ticks(40.0)
    assert ticks == [-2.5, 0.0, 2.5, 5.0, 7.5, 10.0]
    assert tick_texts(ticks) == ["−2.5", "0.0", "2.5", "5.0", "7.5", "10.0"]
    short = Scale(0.2, 30.0, 0.0, 100.0, True)
    assert short.ticks(20.0) == [0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0]
    assert short.texts(short.ticks(20.0))[:3] == ["0.2", "0.5", "1"]
    wide = Scale(1e-4, 2e3, 0.0, 200.0, True)
    assert np.allclose(wide.ticks(50.0), [1e-4, 1e-2, 1.0, 100.0]) and wide.between() == []
    assert Scale(1.0, 100.0, 0.0, 100.0, True).at(10.0) == pytest.approx(50.0)
    assert tick_texts([0.0, 20000.0]) == ["0", "20\u202f000"]
    assert [round_step(v) for v in (0.011, 0.3, 4.0, 0.0)] == [0.02, 0.5, 5.0, 0.0]


def test_a_scale_may_fall_and_a_flat_curve_has_room() -> None:
    scale = Scale(5.5, -0.5, 100.0, 0.0)
    assert scale.holds(0.0) and not scale.holds(6.0)
    low, high = padded(np.full(4, 3.0))
    assert low < 3.0 < high
    assert padded(np.array([np.nan, 0.0, 1.0])) == pytest.approx((-0.05, 1.05))


def test_a_block_is_cut_at_the_edges() -> None:
    picture = Picture("p", 100.0, 100.0)
    axes = panel(picture, (0.0, 100.0), (0.0, 100.0), (0.0, 10.0), (4.0, 0.0))
    axes.block((-5.0, 5.0), (1.0, 9.0), "#000")
    box = ET.fromstring(picture.parts[-1])
    assert [int(box.get(name, 0)) for name in ("x", "y", "width", "height")] == [0, 250, 500, 750]


def test_words_of_all_kinds_are_escaped_and_measured() -> None:
    picture = Picture("p", 100.0, 100.0)
    picture.words(1.0, 2.0, "a < b & c", Font(turned=True))
    assert "a &lt; b &amp; c" in picture.parts[0] and "rotate(-90" in picture.parts[0]
    assert text_width("wide words", 9.0) > text_width("ill", 9.0) > 0.0
    keys = [Key(f"entry number {i}") for i in range(9)]
    assert legend_height(keys, 100.0) > legend_height(keys, 400.0) == legend_height(keys, 1e4, 3)


def test_a_cloud_shows_every_instant(tmp_path: object) -> None:
    picture = Picture("p", 100.0, 100.0)
    axes = panel(picture, (0.0, 100.0), (0.0, 80.0), (0.0, 1.0), (0.0, 1.0))
    time = np.linspace(0.0, 3.0, 4000)
    cloud(axes, time / 3.0, (time / 3.0) ** 2, time)
    time_bar(picture, (0.0, 100.0), 85.0, time)
    svg = picture.svg("x")
    assert svg.count('stroke-linecap="round"') == 24  # one path a colour
    assert "time in the cycle [s]" in svg
