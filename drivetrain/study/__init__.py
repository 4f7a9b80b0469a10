"""The study: what one job needs. ``dt.study(...)`` makes one from objects: see ``help(dt.study.study)``."""

import sys
from inspect import signature
from types import ModuleType
from typing import TYPE_CHECKING

from drivetrain.face import guarded, shown
from drivetrain.study.objects import study

if TYPE_CHECKING:
    from drivetrain.study.change import TaskChange, changed
    from drivetrain.study.model import FreeRatio, JointTask, Study
    from drivetrain.study.parts.selection import SelectionOptions, Wanted
    from drivetrain.study.parts.tolerances import Tolerances
    from drivetrain.study.parts.verdicts import Check, Verdict
    from drivetrain.study.read import load_study
    from drivetrain.study.schema import json_schema
    from drivetrain.study.template import study_template

__getattr__, __dir__ = shown(__name__)


class _Room(ModuleType):
    """This package, which can be called as well: ``drivetrain.study`` names both the room and what makes a study."""

    __call__ = staticmethod(guarded(study, __name__))
    __signature__ = signature(study)


sys.modules[__name__].__class__ = _Room
