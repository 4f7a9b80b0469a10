"""Column formats of other catalogues, as assignments of their columns to ours; all of these formats are in SI."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass

from drivetrain.catalog.schema import GEARS, MOTORS, NUMBER, PAIRS, TABLES, by_name
from drivetrain.units import number_of

Record = dict[str, str]
Rows = Iterable[tuple[int, list[str]]]

KINDS = {
    "DC": "brushed",
    "BLDC": "brushless",
    "rv_cycloidal": "rv",
    "cycloid": "rv",
    "harmonic": "strain_wave",
}


@dataclass(frozen=True)
class Format:
    """One column format."""

    name: str  # name of the format
    files: Mapping[str, str]  # file name pattern for each of our tables
    # for each of our tables: from our column to theirs; of several columns the first non-empty one is used
    columns: Mapping[str, Mapping[str, tuple[str, ...]]]
    fixed: Mapping[str, str]  # values of our columns that hold for all rows of the format
    # reads motor key and gear keys of each row of a compatibility file
    read_pairs: Callable[[Rows], Iterator[tuple[str, list[str]]]]
    # text by which a row states that its current is dc; empty if it does not
    stated_basis: Callable[[Mapping[str, str]], str]
    lone_resistance_is_lumped: bool  # whether a single thermal resistance is from winding to ambient


def translate(form: Format, table: str, record: Mapping[str, str], file: str) -> Record:
    """One row of another format in our columns."""
    known = by_name(TABLES[table])
    cells: Record = {}
    for ours, theirs in form.columns[table].items():
        filled = [" ".join(record[name].split()) for name in theirs if record.get(name)]
        text = "; ".join(filled) if ours == "notes" else next(iter(filled), "")
        column = known[ours]
        if column.content == NUMBER:
            text = _number_text(text, zero_is_unknown=column.low > 0.0)
        cells[ours] = text
    cells.update({name: text for name, text in form.fixed.items() if not cells.get(name)})
    cells["key"] = "_".join(cells["key"].split())
    cells["kind"] = KINDS.get(cells.get("kind", ""), cells.get("kind", ""))
    cells["source"] = cells.get("source") or file
    if "frameless" in cells:
        cells["frameless"] = {"1": "yes", "1.0": "yes", "0": "no", "0.0": "no"}.get(cells["frameless"], "")
    if form.lone_resistance_is_lumped and not cells.get("resistance_housing_ambient"):
        cells["resistance_winding_ambient"] = cells.pop("resistance_winding_housing", "")
    if cells.get("ratio") and number_of(record.get("direction", "")) == -1.0:
        cells["ratio"] = "-" + cells["ratio"].lstrip("-")
    return cells


def _number_text(text: str, *, zero_is_unknown: bool) -> str:
    """The number as the source writes it; empty for NaN, infinity, and a zero where zero is impossible."""
    value = number_of(text)
    if math.isnan(value) and text.strip().lower() not in ("", "nan"):
        return text  # not a number: the lint reports it
    return "" if not math.isfinite(value) or (value == 0.0 and zero_is_unknown) else text


def _listed_pairs(rows: Rows) -> Iterator[tuple[str, list[str]]]:
    """Pairs from a file without header that has a motor and its gears in each row."""
    for _, cells in rows:
        keys = ["_".join(cell.split()) for cell in cells if cell.strip()]
        yield keys[0], keys[1:]


def _joined_pairs(rows: Rows) -> Iterator[tuple[str, list[str]]]:
    """Pairs from a file with a header and, in each row, a motor, a count, and its gears in one cell."""
    for index, (_, cells) in enumerate(rows):
        if index and len(cells) >= 3:
            yield cells[0].strip(), cells[2].split()


def _brushed_only(record: Mapping[str, str]) -> str:
    return "brushed: direct current" if record.get("type") == "DC" else ""


def _stated_in_table(record: Mapping[str, str]) -> str:
    commutation = record.get("commutation", "")
    if "DC equivalent" in commutation:
        return commutation
    return "brushed: direct current" if record.get("motor_type") == "brushed" else ""


def _pairs_of(text: str) -> dict[str, tuple[str, ...]]:
    """Assignment from words of the form ``ours=theirs`` or ``ours=first|second``."""
    return {ours: tuple(theirs.split("|")) for ours, theirs in (word.split("=") for word in text.split())}


# The Motor-Gearbox Database. Its README states: NaN and Inf mean that the data sheet gives no value; Rth1 without Rth2
# is the resistance from winding to ambient.
MGDB = Format(
    "MGDB",
    {MOTORS: "*_motors.csv", GEARS: "*_gearboxes.csv", PAIRS: "*_compatibility.csv"},
    {
        MOTORS: _pairs_of(
            "key=key maker=manufacturer part_number=ID kind=type nominal_voltage=V torque_constant=k_t resistance=R "
            "inductance=L mass=mass rotor_inertia=inertia no_load_speed=omega_nl no_load_current=I_nl "
            "nominal_current=I_nom peak_torque=max_int_torque max_speed=max_int_speed "
            "coulomb_friction=coulomb_friction viscous_friction=viscous_friction "
            "resistance_winding_housing=Rth1 resistance_housing_ambient=Rth2"
        ),
        GEARS: _pairs_of(
            "key=key maker=manufacturer part_number=ID kind=type stages=stages ratio=ratio mass=mass inertia=inertia "
            "efficiency=efficiency repeated_peak_torque=max_int_torque continuous_torque=max_cont_torque"
        ),
    },
    {"edition": "not stated; the database is of 2020 and 2021"},
    _listed_pairs,
    _brushed_only,
    lone_resistance_is_lumped=True,
)

TABLE = Format(
    "SI table",
    {MOTORS: "motors.csv", GEARS: "gears.csv", PAIRS: "compat.csv"},
    {
        MOTORS: _pairs_of(
            "key=key maker=manufacturer series=series part_number=part_number|name kind=motor_type frameless=frameless "
            "nominal_voltage=V_nom_V no_load_speed=w_noload_rad_s no_load_current=I_noload_A nominal_speed=w_nom_rad_s "
            "nominal_torque=tau_nom_Nm nominal_current=I_nom_A stall_torque=tau_stall_Nm stall_current=I_stall_A "
            "peak_torque=tau_peak_Nm peak_current=I_peak_A max_speed=w_max_rad_s resistance=R_ohm inductance=L_H "
            "torque_constant=kt_Nm_A speed_constant=kv_rad_s_V speed_torque_gradient=grad_rad_s_Nm "
            "mechanical_time_constant=tau_mech_s rotor_inertia=J_kgm2 coulomb_friction=coulomb_friction_Nm "
            "viscous_friction=viscous_friction_Nms resistance_winding_housing=Rth_winding_housing_K_W "
            "resistance_housing_ambient=Rth_housing_ambient_K_W "
            "resistance_winding_ambient=Rth_winding_ambient_lumped_K_W winding_time_constant=tau_th_winding_s "
            "housing_time_constant=tau_th_motor_s max_winding_temperature=T_winding_max_C diameter=diameter_m "
            "length=length_m mass=mass_kg source=source source_url=source_url edition=edition "
            "source_quality=source_quality notes=notes|flags"
        ),
        GEARS: _pairs_of(
            "key=key maker=manufacturer series=series part_number=part_number|name kind=gear_type stages=stages "
            "ratio=ratio ratio_exact=ratio_exact efficiency=eta_max no_load_torque=noload_input_torque_Nm "
            "inertia=J_in_kgm2 mass=mass_kg continuous_torque=tau_cont_Nm average_torque_limit=tau_avg_limit_Nm "
            "repeated_peak_torque=tau_int_Nm momentary_torque=tau_momentary_Nm "
            "max_input_speed=w_in_max_int_rad_s|w_in_max_cont_rad_s "
            "average_input_speed_limit=w_in_avg_limit_rad_s|w_in_max_cont_rad_s stiffness_1=K1_Nm_rad|stiffness_Nm_rad "
            "stiffness_2=K2_Nm_rad stiffness_3=K3_Nm_rad torque_1=T1_Nm torque_2=T2_Nm backlash=backlash_rad "
            "axial_load_limit=axial_load_max_N radial_load_limit=radial_load_max_N diameter=diameter_m length=length_m "
            "max_motor_shaft=max_motor_shaft_d_m source=source source_url=source_url edition=edition "
            "source_quality=source_quality notes=notes|flags"
        ),
    },
    {},
    _joined_pairs,
    _stated_in_table,
    lone_resistance_is_lumped=False,
)
