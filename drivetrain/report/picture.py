"""Pictures as text: one SVG written directly, a hundred times faster than a general plotting library draws it.

Lengths are points (1/72 inch); the file counts tenths of a point, so that its numbers are whole.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.report.colours import INK, MUTED
from drivetrain.report.scales import FONT, text_width

SIZE = 9.0  # of plain text [points]
SMALL = 7.7
_TENTHS = 10.0
_UP = {"middle": 0.36, "top": 0.76, "base": 0.0, "bottom": -0.2}  # of the font size, below the place that is named


@dataclass(frozen=True)
class Pen:
    """How a line is drawn.

    Attributes:
        colour: Of the line.
        width: [points].
        dash: Lengths of dashes and gaps [points], such as ``(5, 2)``; empty: unbroken.
        opacity: 1 hides what lies below.
    """

    colour: str = INK
    width: float = 1.3
    dash: tuple[float, ...] = ()
    opacity: float = 1.0


@dataclass(frozen=True)
class Font:
    """How a text is written.

    Attributes:
        size: [points].
        colour: Of the letters.
        anchor: Which end of the text stands at its place: ``start``, ``middle`` or ``end``.
        level: What of its height does: ``middle``, ``top``, ``base`` or ``bottom``.
        bold: In bold letters.
        turned: Reads from bottom to top.
    """

    size: float = SIZE
    colour: str = INK
    anchor: str = "start"
    level: str = "base"
    bold: bool = False
    turned: bool = False


PLAIN = Font()


@dataclass(frozen=True)
class Key:
    """One entry of a legend.

    Attributes:
        text: What it says.
        kind: ``line``, ``box`` or the name of a mark.
        pen: Of its line or edge.
        fill: Of its box or mark; empty: none.
        opacity: Of the fill.
    """

    text: str
    kind: str = "line"
    pen: Pen = Pen()
    fill: str = ""
    opacity: float = 1.0


class Picture:
    """An SVG that is being written.

    Attributes:
        name: Of the picture on its page; its identifiers start with it.
        width, height: [points].
        parts: What has been drawn, in order.
    """

    def __init__(self, name: str, width: float, height: float) -> None:
        self.name = name
        self.width = width
        self.height = height
        self.parts: list[str] = []
        self._named = 0

    def svg(self, label: str) -> str:
        """The picture as an element for a page."""
        head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {tenths(self.width)} {tenths(self.height)}" '
            f'font-family="{escape(FONT)}" font-size="{tenths(SIZE)}" fill="{INK}" stroke-linejoin="round" '
            f'role="img" aria-label="{escape(label)}">'
        )
        return head + "".join(self.parts) + "</svg>"

    def new_name(self) -> str:
        """An identifier that no other part of the page has."""
        self._named += 1
        return f"{self.name}-{self._named}"

    def path(self, data: str, pen: Pen | None, *, fill: str = "none", opacity: float = 1.0, extra: str = "") -> None:
        """A path.

        Args:
            pen: Of its outline; None: no outline.
        """
        shade = f' fill-opacity="{opacity:g}"' if opacity < 1.0 and fill != "none" else ""
        self.parts.append(f'<path d="{data}" fill="{fill}"{shade}{pen_text(pen)}{extra}/>')

    def box(self, x: Sequence[float], y: Sequence[float], fill: str, opacity: float = 1.0) -> None:
        """A filled rectangle.

        Args:
            x, y: Its two ends each [points].
        """
        (x0, x1), (y0, y1) = sorted(map(tenths, x)), sorted(map(tenths, y))
        shade = f' fill-opacity="{opacity:g}"' if opacity < 1.0 else ""
        self.parts.append(f'<rect x="{x0}" y="{y0}" width="{x1 - x0}" height="{y1 - y0}" fill="{fill}"{shade}/>')

    def words(self, x: float, y: float, text: str, font: Font = PLAIN) -> None:
        """A line of text.

        Args:
            x, y: Its place [points].
        """
        down = _UP[font.level] * font.size
        across, below = tenths(x + (down if font.turned else 0.0)), tenths(y + (0.0 if font.turned else down))
        look = f' font-size="{tenths(font.size)}"' if font.size != SIZE else ""
        look += f' fill="{font.colour}"' if font.colour != INK else ""
        look += f' text-anchor="{font.anchor}"' if font.anchor != "start" else ""
        look += ' font-weight="700"' if font.bold else ""
        look += f' transform="rotate(-90 {across} {below})"' if font.turned else ""
        self.parts.append(f'<text x="{across}" y="{below}"{look}>{escape(text)}</text>')

    def mark(self, kind: str, x: float, y: float, size: float, look: Key) -> None:
        """A small sign.

        Args:
            x, y: Its centre [points].
            size: Its width [points].
        """
        half = 0.5 * size
        fill = look.fill or "none"
        if kind in ("dot", "ring"):
            shade = f' fill-opacity="{look.opacity:g}"' if look.opacity < 1.0 else ""
            place = f'cx="{tenths(x)}" cy="{tenths(y)}" r="{tenths(half)}"'
            self.parts.append(f'<circle {place} fill="{fill}"{shade}{pen_text(look.pen)}/>')
            return
        corners = half * _SHAPES[kind]
        self.path(line_data(x + corners[:, 0], y + corners[:, 1], closed=True), look.pen, fill=fill)

    def legend(self, keys: Sequence[Key], y: float, *, across: tuple[float, float], columns: int = 0) -> None:
        """A legend in rows from left to right, centred.

        Args:
            y: Of its first row [points].
            across: Where it may stand [points].
        """
        widths = [_KEY_SIGN + text_width(key.text, SMALL) + _KEY_GAP for key in keys]
        for number, row in enumerate(_rows_of(widths, across[1] - across[0], columns)):
            cells = (
                [max(widths[i::columns]) for i in range(min(columns, len(widths)))]
                if columns
                else [widths[i] for i in row]
            )
            x = max(across[0], 0.5 * (across[0] + across[1] - sum(cells) + _KEY_GAP))
            for i, cell in zip(row, cells, strict=False):
                self._key(keys[i], x, y + number * LEGEND_ROW)
                x += cell

    def _key(self, key: Key, x: float, y: float) -> None:
        end, middle = x + _KEY_SIGN - 5.0, y
        if key.kind == "line":
            self.path(line_data(np.array([x, end]), np.array([middle, middle])), key.pen)
        elif key.kind == "box":
            edge = None if key.pen.colour == "none" else key.pen
            corners = np.array([x, end, end, x]), middle + np.array([-3.0, -3.0, 3.0, 3.0])
            self.path(line_data(*corners, closed=True), edge, fill=key.fill or "none", opacity=key.opacity)
        elif key.kind:
            self.mark(key.kind, 0.5 * (x + end), middle, 7.0, key)
        self.words(x + _KEY_SIGN, middle, key.text, Font(SMALL, level="middle"))


LEGEND_ROW = 11.5  # [points]
_KEY_SIGN, _KEY_GAP = 19.0, 13.0


def legend_height(keys: Sequence[Key], width: float, columns: int = 0) -> float:
    """How high a legend is.

    Args:
        width: Room for a row [points].

    Returns:
        [points].
    """
    widths = [_KEY_SIGN + text_width(key.text, SMALL) + _KEY_GAP for key in keys]
    return LEGEND_ROW * len(_rows_of(widths, width, columns))


def _rows_of(widths: Sequence[float], room: float, columns: int) -> list[list[int]]:
    """Indices of the entries row by row."""
    if columns:
        return [list(range(i, min(i + columns, len(widths)))) for i in range(0, len(widths), columns)]
    rows: list[list[int]] = [[]]
    used = 0.0
    for i, width in enumerate(widths):
        if rows[-1] and used + width - _KEY_GAP > room:
            rows.append([])
            used = 0.0
        rows[-1].append(i)
        used += width
    return rows if rows[0] else []


def _star() -> Array:
    angles = np.arange(10) * np.pi / 5.0 - np.pi / 2.0
    radii = np.where(np.arange(10) % 2, 0.42, 1.0)
    return np.asarray(np.column_stack([radii * np.cos(angles), radii * np.sin(angles)]))


_SHAPES: dict[str, Array] = {
    "diamond": np.array([[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]]),
    "triangle": np.array([[-1.0, -0.85], [1.0, -0.85], [0.0, 0.95]]),
    "star": _star(),
    "bar": np.array([[-0.12, -1.0], [0.12, -1.0], [0.12, 1.0], [-0.12, 1.0]]),
}


def tenths(length: float) -> int:
    """A length as the file counts it.

    Args:
        length: [points].
    """
    return round(length * _TENTHS)


def pen_text(pen: Pen | None) -> str:
    """A pen as attributes.

    Args:
        pen: None: no line.
    """
    if pen is None or pen.colour == "none":
        return ""
    text = f' stroke="{pen.colour}" stroke-width="{tenths(pen.width)}"'
    if pen.dash:
        text += f' stroke-dasharray="{" ".join(str(tenths(length)) for length in pen.dash)}"'
    return text + (f' stroke-opacity="{pen.opacity:g}"' if pen.opacity < 1.0 else "")


def line_data(x: Any, y: Any, *, closed: bool = False) -> str:
    """A line through points as path commands; points that nobody sees are left out.

    Args:
        x, y: Places [points], (N,).
    """
    points = np.rint(_TENTHS * np.column_stack([x, y])).astype(np.int64)
    points = points[np.append(True, (points[1:] != points[:-1]).any(axis=1))]
    if len(points) > 2:
        points = points[_turns(points)]
    steps = np.diff(points, axis=0)
    text = " ".join(map(str, steps.ravel().tolist())).replace(" -", "-")
    return f"M{points[0, 0]} {points[0, 1]}" + (f"l{text}" if text else "") + ("z" if closed else "")


def _turns(points: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which points of a line change its direction, or are its ends; no two that follow each other are the same."""
    before, after = points[1:-1] - points[:-2], points[2:] - points[1:-1]
    turn = before[:, 0] * after[:, 1] != before[:, 1] * after[:, 0]
    back = (before * after).sum(axis=1) < 0
    return np.concatenate([[True], turn | back, [True]])


def dot_data(x: Array, y: Array) -> str:
    """Dots as path commands, to be drawn with a round pen.

    Args:
        x, y: Places [points], (N,).
    """
    points = np.rint(_TENTHS * np.column_stack([x, y])).astype(np.int64)
    steps = np.diff(points, axis=0, prepend=np.zeros((1, 2), dtype=np.int64))
    return "".join(f"m{dx} {dy}h0" for dx, dy in steps.tolist()).replace(" -", "-")


LABEL = Font(SIZE, INK, "middle")
TICK = Font(8.4, INK)
NOTE = Font(SMALL, MUTED)
