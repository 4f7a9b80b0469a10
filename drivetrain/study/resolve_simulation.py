"""What a study wants of its simulation, its joints by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeVar

from drivetrain.errors import nearest
from drivetrain.study.form import Form
from drivetrain.study.ledger import Ledger
from drivetrain.study.schema import StudyForm
from drivetrain.study.schema_simulation import ControlForm
from drivetrain.study.simulation import Control, Simulation, Teeth

DEFAULT = "default"
LIMIT = 2.0  # of bandwidth times period: a faster loop diverges from sample to sample
Named = TypeVar("Named", bound=Form)


def resolve_simulation(form: StudyForm, joints: Sequence[str], ledger: Ledger) -> Simulation:
    """The simulation that a study states."""
    told = form.simulation
    control = {
        name: Control(**one.model_dump())
        for name, one in _named(told.control, joints, "control", ledger).items()
        if one.sampled
    }
    for name in told.control:
        _check_rates(name, told.control, told.current_bandwidth, ledger)
    teeth = {}
    for name, one in _named(told.cogging, joints, "cogging", ledger).items():
        if one.amplitude and one.periods:
            teeth[name] = Teeth(one.amplitude, one.periods)
        elif one.amplitude is None or (one.amplitude and one.periods is None):
            place = name if name in told.cogging else DEFAULT
            ledger.fault(("simulation", "cogging", place), "needs an amplitude, and periods a turn", None,
                         "such as {amplitude: 5 mN m, periods: 84}")  # fmt: skip
    rest = {name: getattr(told, name) for name in type(told).model_fields if name not in ("control", "cogging")}
    return Simulation(**rest, control=control, cogging=teeth)


def _named(entries: Mapping[str, Named], joints: Sequence[str], what: str, ledger: Ledger) -> dict[str, Named]:
    """The entry of each joint that has one, over the default one."""
    known = [*joints, DEFAULT]
    for name in entries if joints else ():
        if name not in known:
            ledger.fault(("simulation", what, name), "names a joint that is not there", name, nearest(name, known))
    base = entries.get(DEFAULT)
    found = {}
    for name in joints:
        own = entries.get(name)
        if own is not None and base is not None:
            own = own.over(base)
        if own is None:
            own = base
        if own is not None:
            found[name] = own
    return found


def _check_rates(name: str, entries: Mapping[str, ControlForm], bandwidth: float, ledger: Ledger) -> None:
    """Rates of which nothing good can come."""
    own, base = entries[name], entries.get(DEFAULT)
    if base is not None and name != DEFAULT:
        own = own.over(base)
    rate, place = own.amplifier_rate, ("simulation", "control", name)
    if rate is None or not own.sampled:
        return
    if rate < own.rate:
        ledger.fault((*place, "amplifier_rate"), f"must be at least the rate of the outer loops: {own.rate:g} Hz", rate)
    elif not bandwidth / rate < LIMIT:
        problem = f"must be above {bandwidth / LIMIT:.4g} Hz for a current loop of {bandwidth:.4g} rad/s"
        ledger.fault((*place, "amplifier_rate"), problem, rate, "or a smaller current_bandwidth")
