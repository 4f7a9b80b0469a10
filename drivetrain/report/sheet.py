"""A small page for one answer: sections of words, pictures and tables in the look of the report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import jinja2
from markupsafe import Markup

from drivetrain.report.svg import share_glyphs
from drivetrain.study.study import Study
from drivetrain.version import __version__

HERE = Path(__file__).parent


@dataclass(frozen=True)
class Chip:
    """A coloured word in a table.

    Attributes:
        text: The word.
        css: ``pass``, ``marginal``, ``fail`` or ``unchecked``.
    """

    text: str
    css: str


@dataclass(frozen=True)
class SheetTable:
    """A table of texts.

    Attributes:
        headings: Of the columns.
        rows: One text or chip a column.
        title: Above it; empty for none.
        numeric: Indices of the columns that hold numbers.
    """

    headings: tuple[str, ...]
    rows: tuple[tuple[str | Chip, ...], ...]
    title: str = ""
    numeric: tuple[int, ...] = ()


@dataclass(frozen=True)
class Section:
    """One part of the page.

    Attributes:
        title, anchor: Its heading, and its place on the page.
        word, css: A coloured word beside the heading; empty for none.
        lead: Paragraphs.
        figures: Pictures as SVG elements, each with its caption.
        tables: Below them.
        notes: A list at the end.
    """

    title: str
    anchor: str
    word: str = ""
    css: str = ""
    lead: tuple[str, ...] = ()
    figures: tuple[tuple[str, str], ...] = ()
    tables: tuple[SheetTable, ...] = ()
    notes: tuple[str, ...] = ()


def sheet(study: Study, kind: str, sections: Sequence[Section]) -> str:
    """One answer as one page that needs nothing from outside.

    Args:
        study: Whose name, description and digest the page bears.
        kind: What kind of page, above the title.
        sections: Its content.

    Returns:
        HTML text; the same answer gives the same bytes.
    """
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(HERE), autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    page = environment.get_template("sheet.html.j2").render(
        study=study,
        kind=kind,
        version=__version__,
        style=Markup((HERE / "style.css").read_text(encoding="utf-8")),
        sections=[_with_markup(section) for section in sections],
    )
    return share_glyphs(page) + "\n"


def _with_markup(section: Section) -> dict[str, object]:
    """The section with its pictures marked as safe."""
    shown = {name: getattr(section, name) for name in section.__dataclass_fields__}
    return shown | {"figures": [(Markup(figure), caption) for figure, caption in section.figures]}
