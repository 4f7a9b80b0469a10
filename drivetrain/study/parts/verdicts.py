"""Results of checks, in sizing and in simulation: verdicts with numbers."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum

from drivetrain.drive.amplifier import from_dc


class Verdict(StrEnum):
    """Verdict of a check. NOT CHECKED means that data are missing; it never counts as a pass."""

    PASS = "PASS"
    MARGINAL = "MARGINAL"
    FAIL = "FAIL"
    NOT_CHECKED = "NOT CHECKED"


@dataclass(frozen=True)
class Check:
    """Comparison of what the task requires with one limit.

    Attributes:
        name: Name of the check, such as ``motor peak torque``.
        required: Value that the task requires, including the safety factor [unit]; None if it could not be computed.
        available: Limit of the part [unit]; None if the data sheet does not give it.
        unit: Unit of both, SI with the usual prefixes (``N m``, ``A``, ``rad/s``, ``C``, ``h``).
        utilisation: Required over available, or the equivalent for temperatures and lives; 1 is the limit; None if not
            checked.
        verdict: See ``Verdict``.
        time: Instant in the cycle at which it is closest to its limit [s]; None if it belongs to no instant.
        source: Source of the limit.
        remark: Remark for the reader: why it was not checked, an assumption, a fix.
        essential: Whether the drive cannot be accepted without this check: if it is NOT CHECKED, so is the evaluation,
            and a search does not choose the drive.
        factor: Safety factor: ``required`` is ``actual`` times it.
        current_basis: For a current, the convention in which it is shown to the user: ``dc``, ``rms`` or ``peak``.
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
        """Value that the task requires, without the safety factor [unit]."""
        return None if self.required is None else self.required / self.factor

    def entered(self, name: str) -> float | None:
        """One of its numbers as shown to the user: currents in the convention ``current_basis``.

        Args:
            name: ``actual``, ``required`` or ``available``.

        Returns:
            The number [unit]; None if it is not known.
        """
        value: float | None = getattr(self, name)
        return value if value is None or self.unit != "A" else float(from_dc(value, self.current_basis))


def worst(verdicts: object) -> Verdict:
    """The worst of some verdicts: FAIL, then MARGINAL, then PASS; NOT CHECKED only if nothing was checked."""
    found = set(verdicts)  # type: ignore[call-overload]
    for verdict in (Verdict.FAIL, Verdict.MARGINAL, Verdict.PASS):
        if verdict in found:
            return verdict
    return Verdict.NOT_CHECKED


UNWEIGHED = "mass of the drives"  # check of the whole arm, made only if the mass of a drive is not known


def shared_place(check: Check) -> str:
    """The group in which a check of all joints together is shown: ``supply``, ``arm`` or ``catalogue``."""
    first = check.name.partition(" ")[0]
    return first if first in ("supply", "arm") else "catalogue"


def lacking(checks: Iterable[Check]) -> tuple[Check, ...]:
    return tuple(check for check in checks if check.essential and check.verdict is Verdict.NOT_CHECKED)


def undecided(check: Check) -> bool:
    """Whether an essential check is not decided because the substitute for a missing value does not satisfy it."""
    return bool(lacking([check])) and None not in (check.required, check.available)


def fails(check: Check) -> bool:
    """Whether a check does not pass, be it against its limit or against the substitute for a missing one."""
    return check.verdict is Verdict.FAIL or undecided(check)


def verdict_of(checks: Iterable[Check]) -> Verdict:
    """Overall verdict of some checks; the only place that decides what missing data mean."""
    made = tuple(checks)
    found = worst(check.verdict for check in made)
    return Verdict.NOT_CHECKED if found is not Verdict.FAIL and lacking(made) else found
