"""What checks say, of sizing and of simulation alike: verdicts with numbers."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from drivetrain.drive.amplifier import from_dc


class Verdict(StrEnum):
    """What a check says. NOT CHECKED means that data are missing; it never counts as a pass."""

    PASS = "PASS"
    MARGINAL = "MARGINAL"
    FAIL = "FAIL"
    NOT_CHECKED = "NOT CHECKED"


@dataclass(frozen=True)
class Check:
    """One limit held against the task.

    Attributes:
        name: Of the check, such as ``motor peak torque``.
        required: What the task asks, safety factor included [unit]; None when it could not be computed.
        available: What the part can do [unit]; None when the sheet does not say.
        unit: Of both, SI with the usual prefixes (``N m``, ``A``, ``rad/s``, ``C``, ``h``).
        utilisation: Required over available, or the equivalent for temperatures and lives; 1 is the limit; None when
            not checked.
        verdict: See ``Verdict``.
        time: Instant in the cycle at which it is closest to its limit [s]; None when it belongs to no instant.
        source: Where the limit comes from.
        remark: What a reader should know: why it was not checked, an assumption, the fix.
        essential: Without it nothing is proven: an evaluation says NOT CHECKED, and a search does not choose the drive.
        factor: Safety factor in ``required``: ``actual`` times it.
        current_basis: The ampere in which the user thinks, of a current: ``dc``, ``rms`` or ``peak``.
    """

    name: str
    required: float | None
    available: float | None
    unit: str
    utilisation: float | None
    verdict: Verdict
    time: float | None = None
    source: str = ""
    remark: str = ""
    essential: bool = False
    factor: float = 1.0
    current_basis: str = "dc"

    @property
    def actual(self) -> float | None:
        """What the task asks, without the safety factor [unit]."""
        return None if self.required is None else self.required / self.factor

    def entered(self, name: str) -> float | None:
        """One of its numbers as the user thinks of it: a current in the study's ampere.

        Args:
            name: ``actual``, ``required`` or ``available``.

        Returns:
            The number; None where it is not known.
        """
        value: float | None = getattr(self, name)
        return value if value is None or self.unit != "A" else float(from_dc(value, self.current_basis))


def worst(verdicts: object) -> Verdict:
    """The worst of some verdicts: FAIL, then MARGINAL, then PASS; NOT CHECKED only when nothing was checked."""
    found = set(verdicts)  # type: ignore[call-overload]
    for verdict in (Verdict.FAIL, Verdict.MARGINAL, Verdict.PASS):
        if verdict in found:
            return verdict
    return Verdict.NOT_CHECKED


UNWEIGHED = "mass of the drives"  # a check of all together, made only where the mass of one is not known


def shared_place(check: Check) -> str:
    """Where a check of all joints together belongs: ``supply``, ``arm`` or ``catalogue``."""
    first = check.name.partition(" ")[0]
    return first if first in ("supply", "arm") else "catalogue"


def lacking(checks: Iterable[Check]) -> tuple[Check, ...]:
    return tuple(check for check in checks if check.essential and check.verdict is Verdict.NOT_CHECKED)


def verdict_of(checks: Iterable[Check]) -> Verdict:
    """What checks say together: the one law of what missing data mean."""
    made = tuple(checks)
    found = worst(check.verdict for check in made)
    return Verdict.NOT_CHECKED if found is not Verdict.FAIL and lacking(made) else found
