"""Energy that nothing accounts for: when a run has more of it than can be trusted, the run says so itself."""

from __future__ import annotations

import numpy as np

from drivetrain.arrays import Array
from drivetrain.simulation.recording import Event

ALLOWED = 0.01  # of the energy that goes to and fro
UNACCOUNTED = "energy"  # the name of the event
ROUNDING = 1e-9  # of all that is stored


def energy_event(time: Array, error: Array, passed: float, stored: float, tolerance: float = 0.0) -> tuple[Event, ...]:
    """The event of a run whose energies do not add up."""
    off, most = np.abs(error), max(ALLOWED, 10.0 * tolerance) * passed + ROUNDING * stored
    if not len(off) or not off.max() > most:
        return ()
    share = off.max() / max(passed, 1e-300)
    detail = (
        f"{100.0 * share:.2g} % of the energy that goes to and fro is not accounted for: do not trust this run; a "
        "shorter step or AdaptiveStep resolves more"
    )
    return (Event(float(time[int(np.argmax(off > most))]), UNACCOUNTED, detail),)
