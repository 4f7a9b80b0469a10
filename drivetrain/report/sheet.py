"""A small page for one answer: sections of words, pictures and tables in the look of the report."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import jinja2
from markupsafe import Markup

from drivetrain.report.chart import Pictures
from drivetrain.report.sections import Section, with_markup
from drivetrain.study.model import Study
from drivetrain.version import __version__

HERE = Path(__file__).parent


def sheet(study: Study, kind: str, sections: Sequence[Section]) -> str:
    """One answer as one page that needs nothing from outside."""
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(HERE), autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )  # fmt: skip
    pictures = Pictures()
    placed = [with_markup(section, pictures) for section in sections]
    page = environment.get_template("sheet.html.j2").render(
        study=study,
        kind=kind,
        version=__version__,
        style=Markup((HERE / "style.css").read_text(encoding="utf-8")),
        sections=placed,
        pictures=pictures.end(),
    )
    return page + "\n"
