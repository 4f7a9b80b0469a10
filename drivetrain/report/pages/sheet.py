"""A page for one result: sections of text, charts and tables in the style of the report."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import jinja2
from markupsafe import Markup, escape

from drivetrain.report.charts.chart import Chart, Pictures
from drivetrain.study.model import Study
from drivetrain.version import __version__

TEMPLATES = Path(__file__).parent / "templates"


def sheet(study: Study | None, kind: str, sections: Sequence[Section], *, name: str = "") -> str:
    """One result as a self-contained page; ``name`` is its heading if there is no study."""
    pictures = Pictures()
    placed = [with_markup(section, pictures) for section in sections]
    name = name if study is None else study.name
    return page_text("sheet.html.j2", study=study, name=name, kind=kind, sections=placed, pictures=pictures.end())


@dataclass(frozen=True)
class Chip:
    """A coloured label in a table."""

    text: str
    css: str  # pass, marginal, fail or unchecked


Row = tuple[str | Chip, ...]


@dataclass(frozen=True)
class SheetTable:
    """A table of texts."""

    headings: tuple[str, ...]
    rows: tuple[Row, ...]
    title: str = ""
    numeric: tuple[int, ...] = ()  # columns that hold numbers


@dataclass(frozen=True)
class Section:
    """One part of the page: heading, paragraphs, facts, pictures, tables, notes."""

    title: str
    anchor: str  # its place on the page
    word: str = ""  # beside the heading, in the colour of
    css: str = ""
    lead: tuple[str, ...] = ()
    figures: tuple[tuple[Chart, str], ...] = ()  # with their captions
    tables: tuple[SheetTable, ...] = ()
    notes: tuple[str, ...] = ()
    facts: tuple[tuple[str, str], ...] = ()  # names and values


@dataclass(frozen=True, eq=False)
class Extra:
    """Additional content of a report."""

    sections: tuple[Section, ...] = ()
    data: dict[str, Any] = field(default_factory=dict)  # keys of result.json


def with_markup(section: Section, pictures: Pictures | None = None) -> dict[str, object]:
    """A section for a template, its charts put among the pictures of the page."""
    shown = {name: getattr(section, name) for name in section.__dataclass_fields__}
    shown["tables"] = [table for table in section.tables if table.rows]
    return shown | {"figures": [] if pictures is None else [(pictures.add(one), text) for one, text in section.figures]}


def page_text(template: str, **content: Any) -> str:
    style = Markup((TEMPLATES / "style.css").read_text(encoding="utf-8"))
    return _environment().get_template(template).render(version=__version__, style=style, **content) + "\n"


def _coded(text: object) -> Markup:
    """Text in which parts between backticks are marked as code."""
    return Markup(re.sub("`([^`]+)`", r"<code>\1</code>", str(escape(text))))


@cache
def _environment() -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(TEMPLATES), autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    environment.filters["coded"] = _coded
    return environment
