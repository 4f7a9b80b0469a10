"""Reports: figures, page, files, the only door through which results go out."""

from typing import TYPE_CHECKING

from drivetrain.face import shown

if TYPE_CHECKING:
    from drivetrain.report.explain import explanation as explanation
    from drivetrain.report.outputs import write_outputs as write_outputs
    from drivetrain.report.page import html_report as html_report

__getattr__, __dir__ = shown(__name__)
