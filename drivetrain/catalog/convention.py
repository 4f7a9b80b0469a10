"""From the convention a sheet is printed in to the equivalent DC machine between two terminals, and back."""

from __future__ import annotations

from collections.abc import Mapping

from drivetrain.catalog.table import Cell
from drivetrain.drive.amplifier import line_to_line, to_dc, torque_constant_to_dc

CURRENTS = ("no_load_current", "nominal_current", "stall_current", "peak_current", "continuous_current")
PHASE_VALUES = ("resistance", "inductance")


def dc_equivalent(cells: Mapping[str, Cell]) -> dict[str, Cell]:
    """Cells with currents, torque constant, resistance and inductance as of the DC equivalent."""
    converted = dict(cells)
    basis = cells.get("current_basis")
    for name in CURRENTS:
        value = cells.get(name)
        if isinstance(basis, str) and isinstance(value, float):
            converted[name] = to_dc(value, basis)
    constant = cells.get("torque_constant")
    if isinstance(basis, str) and isinstance(constant, float):
        converted["torque_constant"] = torque_constant_to_dc(constant, basis)
    for name in PHASE_VALUES:
        value = cells.get(name)
        if cells.get("winding_basis") == "phase" and isinstance(value, float):
            converted[name] = line_to_line(value)
    return converted
