"""A small page for one answer: sections of words, pictures and tables in the look of the report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup

from drivetrain.report.charts.chart import Chart, Pictures
from drivetrain.study.model import Study
from drivetrain.version import __version__

TEMPLATES = Path(__file__).parent / "templates"


def sheet(study: Study, kind: str, sections: Sequence[Section]) -> str:
    """One answer as one page that needs nothing from outside."""
    pictures = Pictures()
    placed = [with_markup(section, pictures) for section in sections]
    return page_text(
        "sheet.html.j2",
        study=study,
        kind=kind,
        sections=placed,
        pictures=pictures.end(),
    )


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
        figures: Pictures, each with its caption.
        tables: Below them.
        notes: A list at the end.
        facts: Names and values, before the pictures.
    """

    title: str
    anchor: str
    word: str = ""
    css: str = ""
    lead: tuple[str, ...] = ()
    figures: tuple[tuple[Chart | str, str], ...] = ()
    tables: tuple[SheetTable, ...] = ()
    notes: tuple[str, ...] = ()
    facts: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, eq=False)
class Extra:
    """What stands in a report beside its usual content.

    Attributes:
        sections: Of the page.
        data: Keys of ``result.json``.
    """

    sections: tuple[Section, ...] = ()
    data: dict[str, Any] = field(default_factory=dict)


def with_markup(section: Section, pictures: Pictures | None = None) -> dict[str, object]:
    """A section for a template, its charts put among the pictures of the page."""
    shown = {name: getattr(section, name) for name in section.__dataclass_fields__}
    placed = [
        (Markup(figure) if isinstance(figure, str) or pictures is None else pictures.add(figure), caption)
        for figure, caption in section.figures
    ]
    return shown | {"figures": placed}


def page_text(template: str, **content: Any) -> str:
    """A page, or a part of one, from its template and what stands on it."""
    style = Markup((TEMPLATES / "style.css").read_text(encoding="utf-8"))
    return _environment().get_template(template).render(version=__version__, style=style, **content) + "\n"


@cache
def _environment() -> jinja2.Environment:
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATES), autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
