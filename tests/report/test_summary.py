"""One page for those who decide."""

from __future__ import annotations

import matplotlib.figure
import pytest

from drivetrain.report.summary import summary_pdf
from drivetrain.sizing.results import Selection


def test_one_page_names_verdict_and_every_drive(selection: Selection, monkeypatch: pytest.MonkeyPatch) -> None:
    figures = []
    kept = matplotlib.figure.Figure.savefig
    monkeypatch.setattr(
        matplotlib.figure.Figure,
        "savefig",
        lambda self, *args, **named: (figures.append(self), kept(self, *args, **named)),
    )
    found = summary_pdf(selection)
    assert found.startswith(b"%PDF") and found.count(b"/Type /Page ") == 1
    assert found == summary_pdf(selection)
    told = "\n".join(text.get_text() for text in figures[0].findobj(matplotlib.text.Text))
    cells = [
        cell.get_text().get_text()
        for one in figures[0].axes
        for table in one.tables
        for cell in table.get_celld().values()
    ]
    told += "\n".join(cells)
    assert str(selection.verdict) in told
    for name, (motor, gear) in selection.drives.items():
        assert name in told and motor in told and gear in told
