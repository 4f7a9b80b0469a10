"""One pair of axes in a picture: grid, ticks, curves, dots, limits and words by value."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drivetrain.arrays import Array
from drivetrain.report.colours import FAINT, INSTANTS, MUTED
from drivetrain.report.picture import (
    LABEL,
    SIZE,
    SMALL,
    TICK,
    Font,
    Key,
    Pen,
    Picture,
    dot_data,
    line_data,
    tenths,
)
from drivetrain.report.scales import Scale, text_width
from drivetrain.report.thinning import told_apart

GRID = Pen(FAINT, 0.6)
FINE = Pen(FAINT, 0.3)
EDGE = Pen(MUTED, 0.7)
X_SPACING, Y_SPACING = 46.0, 17.0  # [points] between ticks, at least
WORDS = Font(SMALL)
MOST_JOINED = 1000  # a cloud of more samples shows its way without a line


@dataclass(frozen=True, eq=False)
class Panel:
    """A rectangle of the picture with two scales.

    Attributes:
        picture: Where it is drawn.
        x: From left to right.
        y: From bottom to top: it starts at the lower edge.
        clip: Identifier of its rectangle, which cuts what is drawn in it.
    """

    picture: Picture
    x: Scale
    y: Scale
    clip: str

    # ------------------------------------------------------------ the frame

    def grid(self, *, across: bool = True, upright: bool = True) -> None:
        """White ground and faint lines at the ticks."""
        self.picture.box((self.x.start, self.x.end), (self.y.start, self.y.end), "#fff")
        for pen, xs, ys in (
            (FINE, self.x.between(), self.y.between()),
            (GRID, self.x.ticks(X_SPACING), self.y.ticks(Y_SPACING)),
        ):
            data = [f"M{tenths(float(self.x.at(v)))} {self._ends('V')}" for v in xs if upright]
            data += [f"M{self._ends('H')[0]} {tenths(float(self.y.at(v)))}{self._ends('H')[1]}" for v in ys if across]
            if data:
                self.picture.path("".join(data), pen)

    def _ends(self, way: str) -> Any:
        """Start and command of a line through the whole panel."""
        if way == "V":
            return f"{tenths(self.y.start)}V{tenths(self.y.end)}"
        return tenths(self.x.start), f"H{tenths(self.x.end)}"

    def edges(self) -> None:
        """The left and the lower edge."""
        left, right, low, high = (tenths(v) for v in (self.x.start, self.x.end, self.y.start, self.y.end))
        self.picture.path(f"M{left} {high}V{low}H{right}", EDGE)

    def x_axis(self, label: str = "", *, texts: bool = True) -> None:
        """Ticks below, with their texts and what they mean."""
        values, low = self.x.ticks(X_SPACING), self.y.start
        self.picture.path("".join(f"M{tenths(float(self.x.at(v)))} {tenths(low)}v30" for v in values) or "M0 0", EDGE)
        for value, text in zip(values, self.x.texts(values) if texts else (), strict=False):
            self.picture.words(float(self.x.at(value)), low + 5.0, text, replace(TICK, anchor="middle", level="top"))
        if label:
            self.picture.words(0.5 * (self.x.start + self.x.end), low + 24.0, label, LABEL)

    def y_axis(self, label: str = "", *, at: float | None = None) -> None:
        """Ticks at the left, with their texts and what they mean.

        Args:
            at: Where the label stands [points from the left]; None: beside the widest tick.
        """
        values, left = self.y.ticks(Y_SPACING), self.x.start
        texts = self.y.texts(values)
        self.picture.path("".join(f"M{tenths(left)} {tenths(float(self.y.at(v)))}h-30" for v in values) or "M0 0", EDGE)
        for value, text in zip(values, texts, strict=True):
            self.picture.words(left - 5.0, float(self.y.at(value)), text, replace(TICK, anchor="end", level="middle"))
        if label:
            widest = max((text_width(text, TICK.size) for text in texts), default=0.0)
            place = left - 11.0 - widest if at is None else at
            self.picture.words(place, 0.5 * (self.y.start + self.y.end), label, replace(LABEL, turned=True))

    # ------------------------------------------------------------ what is in it

    def curve(self, xs: Array, ys: Array, pen: Pen) -> None:
        """A line through points.

        Args:
            xs, ys: Values, (N,).
        """
        self.picture.path(line_data(self.x.at(xs), self.y.at(ys)), pen, extra=self._cut)

    def shape(self, xs: Any, ys: Any, pen: Pen | None, fill: str = "none", opacity: float = 1.0) -> None:
        """A closed line.

        Args:
            xs, ys: Values of its corners, (N,).
            pen: Of its edge; None: no edge.
        """
        data = line_data(self.x.at(xs), self.y.at(ys), closed=True)
        self.picture.path(data, pen, fill=fill, opacity=opacity, extra=self._cut)

    def block(self, xs: Sequence[float] | None, ys: Sequence[float] | None, fill: str, opacity: float = 1.0) -> None:
        """A rectangle.

        Args:
            xs, ys: Values at its ends, cut at the panel's; None: through the whole panel.
        """
        ends = []
        for values, scale in ((xs, self.x), (ys, self.y)):
            given = (scale.low, scale.high) if values is None else values
            least, most = sorted((scale.low, scale.high))
            ends.append([float(v) for v in scale.at(np.clip(given, least, most))])
        self.picture.box(ends[0], ends[1], fill, opacity)

    def level(self, value: float, pen: Pen) -> None:
        """A line across, where the value lies in the panel."""
        if self.y.holds(value):
            y = tenths(float(self.y.at(value)))
            self.picture.path(f"M{tenths(self.x.start)} {y}H{tenths(self.x.end)}", pen)

    def upright(self, value: float, pen: Pen) -> None:
        """An upright line, where the value lies in the panel."""
        if self.x.holds(value):
            x = tenths(float(self.x.at(value)))
            self.picture.path(f"M{x} {tenths(self.y.start)}V{tenths(self.y.end)}", pen)

    def dots(self, xs: Array, ys: Array, pen: Pen) -> None:
        """Many small dots; those that cannot be told apart are drawn once.

        Args:
            xs, ys: Values, (N,).
        """
        if not len(xs):
            return
        x, y = self.x.at(xs), self.y.at(ys)
        kept = told_apart(x, y, np.zeros(len(x), dtype=np.intp), 0.5)
        extra = f' stroke-linecap="round"{self._cut}'
        self.picture.path(dot_data(x[kept], y[kept]), pen, extra=extra)

    def words(self, x: float, y: float, text: str, font: Font = WORDS, by: tuple[float, float] = (0, 0)) -> None:
        """A text at a value.

        Args:
            by: To the right and down from there [points].
        """
        self.picture.words(float(self.x.at(x)) + by[0], float(self.y.at(y)) + by[1], text, font)

    def mark(self, kind: str, x: float, y: float, size: float, look: Key) -> None:
        """A sign at a value.

        Args:
            size: Width [points].
        """
        self.picture.mark(kind, float(self.x.at(x)), float(self.y.at(y)), size, look)

    @property
    def _cut(self) -> str:
        return f' clip-path="url(#{self.clip})"'


def panel(
    picture: Picture, across: Sequence[float], upright: Sequence[float], x: Sequence[float], y: Sequence[float],
    *, logarithmic: tuple[bool, bool] = (False, False),
) -> Panel:  # fmt: skip
    """A panel on a picture.

    Args:
        across: Its left and right edge [points].
        upright: Its upper and lower edge [points].
    """
    clip = picture.new_name()
    left, right, top, low = (tenths(v) for v in (*across, *upright))
    rectangle = f'<rect x="{left}" y="{top}" width="{right - left}" height="{low - top}"/>'
    picture.parts.append(f'<clipPath id="{clip}">{rectangle}</clipPath>')
    return Panel(
        picture,
        Scale(x[0], x[1], across[0], across[1], logarithmic[0]),
        Scale(y[0], y[1], upright[1], upright[0], logarithmic[1]),
        clip,
    )


def cloud(on: Panel, xs: Array, ys: Array, time: Array, *, parts: Sequence[slice] = ()) -> None:
    """The motion's samples on a plane, coloured by time.

    Args:
        xs, ys: Values, (N,).
        time: [s], (N,).
    """
    x, y = on.x.at(xs), on.y.at(ys)
    if len(time) <= MOST_JOINED:
        for part in parts or (slice(None),):
            line = line_data(x[part], y[part])
            on.picture.path(line, Pen(MUTED, 0.5, opacity=0.6), extra=on._cut)  # between sparse samples
    span = float(time[-1] - time[0]) or 1.0
    colour = np.minimum((len(INSTANTS) * (time - time[0]) / span).astype(np.intp), len(INSTANTS) - 1)
    kept = told_apart(x, y, colour, 0.5)
    for number, shade in enumerate(INSTANTS):
        chosen = kept[colour[kept] == number]
        if len(chosen):
            extra = f' stroke-linecap="round"{on._cut}'
            on.picture.path(dot_data(x[chosen], y[chosen]), Pen(shade, 2.6), extra=extra)


def time_bar(picture: Picture, across: tuple[float, float], top: float, time: Array) -> None:
    """Which colour of a cloud is which instant.

    Args:
        across: Its left and right end [points].
        top: Its upper edge [points].
        time: [s], (N,).
    """
    name = picture.new_name()
    stops = "".join(
        f'<stop offset="{i / (len(INSTANTS) - 1):.3f}" stop-color="{shade}"/>' for i, shade in enumerate(INSTANTS)
    )
    picture.parts.append(f'<linearGradient id="{name}">{stops}</linearGradient>')
    picture.box(across, (top, top + 6.0), f"url(#{name})")
    strip = panel(picture, across, (top, top + 6.0), (float(time[0]), float(time[-1])), (0.0, 1.0))
    strip.x_axis()
    middle, low = 0.5 * (across[0] + across[1]), top + 6.0 + 24.0
    picture.words(middle, low, "time in the cycle [s]", replace(LABEL, size=SIZE))
