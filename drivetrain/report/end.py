"""How far the end of the chain is from its command: the tip of an arm, or an axis itself."""

from __future__ import annotations

from dataclasses import dataclass

from drivetrain.report.quantities import with_unit
from drivetrain.study.model import Study

NEGLIGIBLE = 1e-9  # m or rad


@dataclass(frozen=True)
class End:
    """What deviates.

    Attributes:
        name: In words.
        unit: Of its deviation.
    """

    name: str
    unit: str

    def far(self, deviation: float) -> str:
        """A deviation in words.

        Args:
            deviation: [m or rad].
        """
        shown = "mrad" if self.unit == "rad" else ""  # as pictures and tables say it
        return "0" if deviation < NEGLIGIBLE else with_unit(deviation, self.unit, shown=shown)


def end_of(study: Study) -> End:
    """What deviates in a study's run.

    Returns:
        The tip in metres, or the axis in radians.
    """
    return End("axis", "rad") if study.arm is None else End("tip", "m")
