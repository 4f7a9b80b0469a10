"""The study: what one job needs, from a file or from Python. ``drivetrain.study(...)`` makes one from objects."""

import sys
from types import ModuleType

from drivetrain.face import guarded
from drivetrain.study.objects import study


class _Room(ModuleType):
    """This package, which can be called as well: ``drivetrain.study`` names both the room and what makes a study."""

    __call__ = staticmethod(guarded(study, __name__))


sys.modules[__name__].__class__ = _Room
