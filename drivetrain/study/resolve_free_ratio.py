"""A joint's free ratio from its form: a range that rises, a series and a motor that the catalogue has."""

from __future__ import annotations

from drivetrain.catalog.read import Catalog
from drivetrain.errors import nearest
from drivetrain.study.document import Place
from drivetrain.study.ledger import Ledger
from drivetrain.study.schema_free_ratio import FreeRatioForm
from drivetrain.study.study import FreeRatio


def resolve_free_ratio(form: FreeRatioForm | None, catalog: Catalog, ledger: Ledger, place: Place) -> FreeRatio | None:
    """The range of ratios of a joint, and of which gears.

    Args:
        form: As written; None where nothing is.

    Returns:
        The range; None without a form or with a faulty one.
    """
    if form is None:
        return None
    low, high = form.ratio
    if low is None or high is None or not 0.0 < low < high:
        ledger.fault((*place, "ratio"), "needs a smaller and a larger positive ratio, such as [30, 160]")
        return None
    known = {row.series for row in catalog.gears.values() if row.series}
    if form.series is not None and form.series not in known and not ledger.spoiled(("catalogs",)):
        hint = nearest(form.series, known)
        ledger.fault((*place, "series"), "no gear of the catalogue has this series", form.series, hint)
    if form.motor is not None and form.motor not in catalog.motors and not ledger.spoiled(("catalogs",)):
        ledger.fault((*place, "motor"), "no motor has this key", form.motor, nearest(form.motor, catalog.motors))
    return FreeRatio(low, high, form.series, form.motor)
