from __future__ import annotations

import xml.etree.ElementTree as ET

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from drivetrain.report.svg import house_style, png_bytes, share_glyphs, svg_text
from drivetrain.report.thinning import spread, thinned


def picture(name: str, points: int = 50) -> str:
    with house_style(name):
        figure = Figure(figsize=(3, 2))
        axes = figure.subplots()
        axes.plot(np.linspace(0, 1, points), np.sin(np.arange(points)), clip_on=True)
        axes.set_xlabel("speed [rpm]")
        return svg_text(figure, "a <picture> & more")


def test_same_input_same_bytes() -> None:
    assert picture("one") == picture("one")


def test_two_pictures_do_not_share_clip_paths() -> None:
    """An id that both define would let the first picture cut the second."""
    one, two = picture("one"), picture("two")
    ids = [
        {e.get("id") for e in ET.fromstring(text).iter() if e.get("id") and not e.get("id", "").startswith("DejaVu")}
        for text in (one, two)
    ]
    assert ids[0] and not ids[0] & ids[1]


def test_every_reference_is_defined() -> None:
    root = ET.fromstring(picture("one"))
    link = "{http://www.w3.org/1999/xlink}href"
    defined = {e.get("id") for e in root.iter()}
    used = {e.get(link, "#")[1:] for e in root.iter() if e.get(link)}
    used |= {e.get("clip-path", "")[5:-1] for e in root.iter() if e.get("clip-path")}
    assert used and used <= defined


def test_the_page_decides_the_size_and_nothing_tells_the_time() -> None:
    text = picture("one")
    root = ET.fromstring(text)
    assert root.get("width") is None and root.get("viewBox")
    assert "<metadata" not in text and "matplotlib" not in text.lower()
    assert root.get("aria-label") == "a <picture> & more"


def test_paths_keep_their_shape_with_fewer_digits() -> None:
    """The curve's own coordinates: 50 vertices of sin(k), recovered from the SVG up to the axes' scaling."""
    root = ET.fromstring(picture("one"))
    paths = [e.get("d", "") for e in root.iter("{http://www.w3.org/2000/svg}path") if e.get("d", "").count("L") == 49]
    assert len(paths) == 1
    numbers = np.array([float(t) for t in paths[0].replace("M", " ").replace("L", " ").split()]).reshape(-1, 2)
    drawn, wanted = numbers[:, 1], -np.sin(np.arange(50))  # y grows downwards in SVG
    scaled = np.polyval(np.polyfit(wanted, drawn, 1), wanted)
    assert np.abs(scaled - drawn).max() < 0.02  # points: two decimals are kept
    assert np.polyfit(wanted, drawn, 1)[0] > 0


def test_style_ignores_and_leaves_alone_the_users_settings() -> None:
    plain = picture("one")
    with mpl.rc_context({"axes.facecolor": "pink", "font.size": 30}):
        assert picture("one") == plain
        assert mpl.rcParams["font.size"] == 30


def test_shared_glyphs_are_defined_once() -> None:
    page = share_glyphs(picture("one") + picture("two"))
    assert page.count('<path id="DejaVuSans-') == len(set(picture("one").split('<path id="DejaVuSans-'))) - 1
    assert page.count("<svg") == 2


def test_thinned_keeps_peaks_and_ends() -> None:
    rng = np.random.default_rng(1)
    values = rng.normal(size=20_000)
    values[12_345], values[777] = 50.0, -50.0
    kept = thinned(values, 300)
    assert {0, 777, 12_345, 19_999} <= set(kept.tolist())
    assert len(kept) <= 602 and (np.diff(kept) > 0).all()
    assert thinned(values[:500], 300).tolist() == list(range(500))


def test_spread_pushes_labels_apart_in_order() -> None:
    placed = spread([1.0, 5.0, 1.1, 1.05], 0.5)
    order = np.argsort([1.0, 5.0, 1.1, 1.05])
    gaps = np.diff(np.array(placed)[order])
    assert (gaps > 0.5 - 1e-3).all()
    assert placed[1] == 5.0


def test_png_is_a_png() -> None:
    with house_style("p"):
        figure = Figure(figsize=(1, 1))
        figure.subplots()
        assert png_bytes(figure).startswith(b"\x89PNG")
