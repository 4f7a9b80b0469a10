"""One look for every picture, and pictures as text that can stand inside a page: same input, same bytes."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from typing import Any, cast

import matplotlib as mpl
import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

from drivetrain.report.colours import FAINT, INK, MUTED

# The yellow end of viridis is lost on white paper.
TIME_COLOURS = LinearSegmentedColormap.from_list("instants", mpl.colormaps["viridis"](np.linspace(0.0, 0.9, 64)))

_LOOK: dict[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 8.5,
    "axes.labelcolor": INK,
    "axes.edgecolor": MUTED,
    "axes.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.unicode_minus": True,
    "grid.color": FAINT,
    "grid.linewidth": 0.6,
    "text.color": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "legend.fontsize": 7.5,
    "legend.frameon": False,
    "lines.linewidth": 1.3,
    "figure.constrained_layout.use": True,
    "path.simplify_threshold": 0.2,
    "savefig.facecolor": "none",
    "figure.facecolor": "none",
    "axes.facecolor": "white",
    "svg.fonttype": "path",
}


@contextmanager
def house_style(name: str) -> Iterator[None]:
    """The look of all figures, whatever the user's own settings are; figures are made and written inside."""
    defaults = {key: value for key, value in mpl.rcParamsDefault.items() if not key.startswith("backend")}
    look = cast(Any, {**_LOOK, "svg.hashsalt": name})
    with mpl.rc_context(defaults), mpl.rc_context(look):
        yield


def svg_text(figure: Figure, label: str) -> str:
    """A figure as an SVG element for a page; call it inside ``house_style``."""
    out = io.StringIO()
    figure.savefig(out, format="svg", dpi=150, metadata={"Date": None, "Creator": None, "Format": None, "Type": None})
    text = out.getvalue()
    text = _lean(text[text.index("<svg") :].strip())
    head, rest = text.split(">", 1)
    head = re.sub(r'\s(?:width|height)="[^"]*pt"', "", head)
    return f'{head} role="img" aria-label="{escape(label)}">{rest}'


def share_glyphs(page: str) -> str:
    """A page on which every letter shape is defined once, by the first picture that needs it, and used by all."""
    seen: set[str] = set()

    def first_only(found: re.Match[str]) -> str:
        repeated = found[1] in seen
        seen.add(found[1])
        return "" if repeated else found[0]

    return re.sub(r'<path id="(DejaVu[^"]*)"[^>]*/>', first_only, page)


_SPARE_DIGITS = re.compile(r"-?\d+\.\d{3,}|\n")


def _two_decimals(found: re.Match[str]) -> str:
    """A coordinate of a path without the digits that nobody sees."""
    return "" if found[0] == "\n" else f"{float(found[0]):.2f}".rstrip("0").rstrip(".")


def _lean(text: str) -> str:
    """The picture without what a page does not need: half of the bytes."""
    text = re.sub(r"<metadata>.*?</metadata>|<style.*?</style>", "", text, flags=re.DOTALL)
    text = re.sub(r' d="([^"]*)"', lambda path: f' d="{_SPARE_DIGITS.sub(_two_decimals, path[1])}"', text)
    used = set(re.findall(r'(?:url\(#|xlink:href="#)([^")]*)', text))
    text = re.sub(r' id="([^"]*)"', lambda found: found[0] if found[1] in used else "", text)
    return re.sub(r">\s+<", "><", text)


def png_bytes(figure: Figure, dpi: float = 150) -> bytes:
    """A figure as a PNG file on white; call it inside ``house_style``."""
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=dpi, facecolor="white", metadata={"Software": None})
    return out.getvalue()
