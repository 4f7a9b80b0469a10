"""Reports: all output of results as text, charts, HTML pages and files."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.report.outputs import write_outputs
    from drivetrain.report.pages.report_page import html_report
    from drivetrain.report.verdict_lines import explanation

__getattr__, __dir__ = shown(__name__)
