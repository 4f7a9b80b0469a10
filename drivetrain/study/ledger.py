"""What is found while a study is resolved: faults with their places, and notes for the report."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

from drivetrain.errors import Fault, InputError, PhysicsWarning
from drivetrain.study.document import Document, Place, spelled
from drivetrain.study.validate import touches


@dataclass(eq=False)
class Ledger:
    """Faults and notes of one study, gathered until all of it has been looked at.

    Attributes:
        document: The study file.
        faults: Found so far.
        faulty: Places of the faults in the study file.
        notes: Doubts and remarks, in the order found, each once.
    """

    document: Document
    faults: list[Fault] = field(default_factory=list)
    faulty: set[Place] = field(default_factory=set)
    notes: list[str] = field(default_factory=list)

    def fault(self, place: Place, problem: str, value: object = None, hint: str = "") -> None:
        """Notes down a fault of the study file, unless it can only be the consequence of one already known."""
        if not self.spoiled(place):
            self.faults.append(self.document.fault(place, problem, value, hint))
            self.faulty.add(place)

    def note(self, notes: Iterable[str]) -> None:
        """Notes down remarks for the report."""
        self.notes.extend(note for note in dict.fromkeys(notes) if note not in self.notes)

    def spoiled(self, place: Place) -> bool:
        """Whether an entry has a fault already, so that what depends on it need not be looked at."""
        return touches(place, self.faulty)

    @contextmanager
    def gather(self, place: Place) -> Iterator[None]:
        """Takes up the faults and physics warnings of what is done inside, and goes on."""
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                yield
            except InputError as error:
                self._take(place, error.faults)
        for warning in caught:
            if issubclass(warning.category, PhysicsWarning):
                self.note([str(warning.message)])
            else:
                warnings.warn_explicit(warning.message, warning.category, warning.filename, warning.lineno)

    def raise_any(self) -> None:
        """Raises what has been found, in the order of the file's lines.

        Raises:
            InputError: At least one fault was found.
        """
        if self.faults:
            raise InputError(sorted(self.faults, key=_line))

    def _take(self, place: Place, faults: Iterable[Fault]) -> None:
        """Faults of another reader: those without a file stand at the entry that asked."""
        for fault in faults:
            if fault.file:
                self.faults.append(fault)
            else:
                told = fault.place.startswith(spelled(place))  # it names the entry itself
                inner = fault.place if told else ", ".join(filter(None, (spelled(place), fault.place)))
                self.faults.append(replace(fault, place=inner, file=self.document.where(place)))
        self.faulty.add(place)


def _line(fault: Fault) -> tuple[str, int]:
    """Where a fault is sorted: by file, then by line; sorting keeps the order found within a line."""
    file, _, line = fault.file.rpartition(":")
    return (file, int(line)) if line.isdigit() else (fault.file, 0)
