"""The columns of the catalogue tables, as the reader, the lint and the importers use them.

A table is a CSV file with one header row. Every physical column carries its unit in brackets in the header, in any
unit of the right dimension (``torque_constant [mNm/A]``, ``no_load_speed [rpm]``); an unknown value is an empty cell,
never 0.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from drivetrain.catalog.price import PRICE_KINDS
from drivetrain.drive.amplifier import CurrentBasis
from drivetrain.drive.brake import BRAKE_KINDS, BRAKE_SIDES
from drivetrain.drive.gear import GEAR_KINDS
from drivetrain.drive.motor import MOTOR_KINDS

MOTORS, GEARS, PAIRS = "motors.csv", "gears.csv", "compatibility.csv"
BRAKES, AMPLIFIERS, PRICES = "brakes.csv", "amplifiers.csv", "prices.csv"

CURRENT_BASES = tuple(str(basis) for basis in CurrentBasis)
WINDING_BASES = ("line_line", "phase")
YES_NO = ("yes", "no")

TEXT, NUMBER, CHOICE = "text", "number", "choice"


@dataclass(frozen=True)
class Column:
    """One column of a table."""

    name: str  # name in the header, before the unit
    meaning: str  # description, as documented
    content: str = TEXT  # ``text``, ``number`` or ``choice``
    # SI unit of a number, ``1`` for a pure number; the header's unit must have its dimension. Empty: the header's unit
    # is not checked (a currency)
    unit: str = ""
    # smallest and largest plausible number [in ``unit``]; the reader refuses others
    low: float = -math.inf
    high: float = math.inf
    choices: tuple[str, ...] = ()  # accepted words of a ``choice``
    needed: bool = False  # whether a row with an empty cell is refused
    lint_only: bool = False  # whether only the lint uses the values
    why_needed: str = ""  # message if the cell is empty


def _choice(name: str, meaning: str, choices: tuple[str, ...], *, needed: bool = False, why: str = "") -> Column:
    return Column(name, meaning, CHOICE, choices=choices, needed=needed, why_needed=why)


def _number(
    name: str, unit: str, low: float, high: float, meaning: str, *,
    needed: bool = False, lint_only: bool = False, why: str = "",
) -> Column:  # fmt: skip
    return Column(name, meaning, NUMBER, unit, low, high, needed=needed, lint_only=lint_only, why_needed=why)


_CURRENT_WHY = (
    "say what kind of ampere the torque constant and the currents are per: dc (equivalent DC machine between two "
    "terminals, block commutation), rms or peak (of a phase); they differ by up to 41 %, so it is not guessed"
)
_TORQUE_WHY = (
    "state it per ampere of current_basis; per ampere dc it is 9.549 N m/A divided by the speed constant in rpm/V"
)
_WINDING_WHY = (
    "say whether resistance and inductance are line_line (between two terminals) or phase; they differ by a factor 2, "
    "so it is not guessed"
)

_AMPLIFIER_WHY = (
    "say what kind of ampere its currents are: dc (equivalent DC machine), rms or peak (amplitude, of a phase); they "
    "differ by up to 41 %, so it is not guessed"
)
_SIDE_WHY = (
    "say whether its torque acts at the motor or the output shaft; they differ by the ratio, so it is not guessed"
)

_IDENTITY = (
    Column("key", "Unique name in the catalogue.", needed=True),
    Column("maker", "As the manufacturer writes it."),
    Column("series", "As the manufacturer writes it."),
    Column("part_number", "As the manufacturer writes it."),
)
_PROVENANCE = (
    Column("price", "In your own currency; empty in the shipped catalogue.", NUMBER, "", 0.0, 1e9),
    Column("source", "Origin of the numbers."),
    Column("source_url", "The maker's page, where known.", lint_only=True),
    Column("edition", "Edition or date of the data sheet."),
    Column("source_quality", "A: the maker's page; B: cited in another database; C: found in code.", lint_only=True),
    Column("notes", "Reservations, and the use that the numbers allow.", lint_only=True),
)

MOTOR_COLUMNS = (
    *_IDENTITY,
    _choice("kind", "With brushes, or commutated by the amplifier.", MOTOR_KINDS, needed=True),
    _choice("frameless", "Sold as rotor and stator, without housing and bearings.", YES_NO),
    _choice(
        "current_basis",
        "Kind of ampere of currents and torque constant.",
        CURRENT_BASES,
        needed=True,
        why=_CURRENT_WHY,
    ),
    _choice("winding_basis", "What R and L are measured between.", WINDING_BASES, needed=True, why=_WINDING_WHY),
    Column("basis_evidence", "How the two conventions are known.", lint_only=True),
    _number("nominal_voltage", "V", 0.5, 1000.0, "Supply at which no-load and stall values hold."),
    _number("no_load_speed", "rad/s", 0.5, 2e4, "At nominal voltage."),
    _number("no_load_current", "A", 1e-5, 50.0, "At nominal voltage."),
    _number("nominal_speed", "rad/s", 0.1, 2e4, "Speed at which the nominal values hold."),
    _number("nominal_torque", "N m", 1e-6, 5e3, "Continuous torque of the data sheet."),
    _number("nominal_current", "A", 1e-3, 1000.0, "Continuous current of the data sheet."),
    _number("stall_torque", "N m", 1e-6, 1e4, "At nominal voltage."),
    _number("stall_current", "A", 1e-3, 5000.0, "At nominal voltage."),
    _number("peak_torque", "N m", 1e-6, 1e4, "Short-time limit."),
    _number("peak_current", "A", 1e-3, 5000.0, "Short-time limit."),
    _number("max_speed", "rad/s", 0.5, 2e4, "Mechanical limit."),
    _number("resistance", "ohm", 1e-4, 1e3, "Terminal or phase, according to winding_basis.", needed=True),
    _number("inductance", "H", 1e-8, 1.0, "Terminal or phase, according to winding_basis."),
    _number(
        "torque_constant", "N m/A", 1e-5, 100.0, "Torque per ampere of current_basis.", needed=True, why=_TORQUE_WHY
    ),
    _number("speed_constant", "rad/(s V)", 1e-2, 1e5, "No-load speed per volt.", lint_only=True),
    _number("speed_torque_gradient", "rad/(s N m)", 1e-4, 1e10, "Decrease of speed per torque.", lint_only=True),
    _number("mechanical_time_constant", "s", 1e-5, 10.0, "Of the rotor without load.", lint_only=True),
    _number("rotor_inertia", "kg m^2", 1e-12, 10.0, "Inertia of the rotor."),
    _number("coulomb_friction", "N m", 1e-9, 100.0, "Speed-independent part of the no-load torque."),
    _number("viscous_friction", "N m s/rad", 1e-12, 1.0, "Part of the no-load torque that grows with speed."),
    _number("resistance_winding_housing", "K/W", 1e-3, 500.0, "Thermal resistance."),
    _number("resistance_housing_ambient", "K/W", 1e-3, 500.0, "Thermal resistance."),
    _number("resistance_winding_ambient", "K/W", 1e-3, 500.0, "Sum of both, if one number is given."),
    _number("winding_time_constant", "s", 0.01, 1e4, "Thermal time constant."),
    _number("housing_time_constant", "s", 1.0, 1e5, "Thermal time constant."),
    _number("max_winding_temperature", "degC", 40.0, 300.0, "Limit of the insulation."),
    _number("reference_temperature", "degC", -50.0, 150.0, "Of resistance and torque constant; empty: 25 C."),
    _number("magnet_coefficient", "1/K", -0.01, 0.0, "Change of the torque constant; empty: -0.1 %/K."),
    _number("diameter", "m", 1e-3, 2.0, "Outer diameter."),
    _number("length", "m", 1e-4, 3.0, "Length of the body."),
    _number("mass", "kg", 1e-5, 2e3, "Mass of the motor; of rotor and stator if frameless."),
    *_PROVENANCE,
)

GEAR_COLUMNS = (
    *_IDENTITY,
    _choice("kind", "Family of the gear.", GEAR_KINDS, needed=True),
    _number("stages", "1", 1.0, 12.0, "Number of stages."),
    _number("ratio", "1", -1e5, 1e5, "Input over output speed; negative: the output turns the other way.", needed=True),
    Column("ratio_exact", "The same as a fraction, such as 57/13.", lint_only=True),
    _number("efficiency", "1", 0.02, 1.0, "Power out over power in when the motor drives."),
    _number("backdriving_efficiency", "1", -5.0, 1.0, "The same when the load drives; 0 or less: self-locking."),
    _number("no_load_torque", "N m", 1e-7, 1e3, "Running torque at the input without load."),
    _number("mesh_efficiency", "1", 0.02, 1.0, "Power out over power in of the mesh only, without drag."),
    _number("drag_torque", "N m", 0.0, 1e3, "At the input, turning at drag_speed and 20 C; without seals."),
    _number("drag_speed", "rad/s", 1.0, 2e4, "Input speed at which the drag torque holds."),
    _number("drag_speed_exponent", "1", 0.0, 2.0, "Exponent of drag over speed; 0: constant drag."),
    _number("drag_temperature_1", "1/K", -1.0, 1.0, "b1 in drag ~ exp(-b1 d + b2 d^2), d in K above 20 C."),
    _number("drag_temperature_2", "1/K^2", -0.1, 0.1, "b2 in the same formula."),
    _number("seal_drag_torque", "N m", 0.0, 1e3, "Of the input's seals, at any speed and temperature."),
    _number("starting_torque", "N m", 0.0, 1e3, "Torque at the input that moves the unloaded gear from rest."),
    _number("back_driving_torque", "N m", 0.0, 1e5, "The same at the output.", lint_only=True),
    Column("loss_basis", "Where mesh efficiency, drag and starting torque come from; what is FITTED or ASSUMED."),
    _number("inertia", "kg m^2", 1e-13, 10.0, "Inertia of the gear at its input."),
    _number("mass", "kg", 1e-5, 2e3, "Mass of the gear."),
    _number("continuous_torque", "N m", 1e-5, 1e6, "Rated or continuous, at the output."),
    _number("average_torque_limit", "N m", 1e-5, 1e6, "Limit of the average torque over the cycle."),
    _number("repeated_peak_torque", "N m", 1e-5, 1e6, "Limit of the peaks of every cycle."),
    _number("momentary_torque", "N m", 1e-5, 1e6, "Limit of rare peaks."),
    _number("momentary_waves", "1", 1.0, 1e9, "Waves of the flexspline under such peaks in its life."),
    _number("ratcheting_torque", "N m", 1e-5, 1e6, "At which the teeth of a strain-wave gear skip."),
    _number("buckling_torque", "N m", 1e-5, 1e6, "At which its flexspline buckles."),
    _number("max_input_speed", "rad/s", 1.0, 2e4, "Short-time limit."),
    _number("average_input_speed_limit", "rad/s", 1.0, 2e4, "Limit of the mean input speed."),
    _number("rated_speed", "rad/s", 1.0, 2e4, "Input speed at which rated torque and life hold."),
    _number("rated_life", "s", 3.6e4, 3.6e9, "L10 life at rated torque and speed."),
    _number("life_exponent", "1", 1.0, 10.0, "Exponent of torque in the life: 3 for ball bearings, 10/3 for rollers."),
    _number("stiffness_1", "N m/rad", 1e-3, 1e9, "Torsional stiffness K1, up to torque_1."),
    _number("stiffness_2", "N m/rad", 1e-3, 1e9, "Torsional stiffness K2, from torque_1 to torque_2."),
    _number("stiffness_3", "N m/rad", 1e-3, 1e9, "Torsional stiffness K3, above torque_2."),
    _number("torque_1", "N m", 1e-6, 1e6, "Torque at which the stiffness changes from K1 to K2."),
    _number("torque_2", "N m", 1e-6, 1e6, "Torque at which the stiffness changes from K2 to K3."),
    _number("backlash", "rad", 0.0, 0.5, "At the output, total; 0: there is none, empty: unknown."),
    _number("tilting_moment_limit", "N m", 1e-6, 1e6, "Limit of the output bearing."),
    _number("axial_load_limit", "N", 1e-3, 1e7, "Limit of the output bearing."),
    _number("radial_load_limit", "N", 1e-3, 1e7, "Limit of the output bearing."),
    _number("bearing_dynamic_rating", "N", 10.0, 1e8, "Basic dynamic rating C of the output bearing."),
    _number("bearing_static_rating", "N", 10.0, 1e8, "Basic static rating C0 of the output bearing."),
    _number("bearing_pitch_diameter", "m", 1e-3, 3.0, "Pitch diameter of the rollers or balls of the output bearing."),
    _number("bearing_offset", "m", 1e-4, 1.0, "From the output flange back to the centre of the output bearing."),
    _number(
        "tilting_stiffness",
        "N m/rad",
        1.0,
        1e10,
        "Tilting stiffness of the output bearing, an average value.",
        lint_only=True,
    ),
    _number("max_temperature", "degC", 20.0, 300.0, "Largest temperature of the housing, for grease and seals."),
    _number("size", "1", 0.1, 1e4, "Size number of the manufacturer."),
    _number("pitch_diameter", "m", 1e-3, 2.0, "Pitch diameter of the toothing."),
    _number("diameter", "m", 1e-3, 2.0, "Outer diameter."),
    _number("length", "m", 1e-4, 3.0, "Length of the body."),
    _number("max_motor_shaft", "m", 1e-4, 0.2, "Largest motor shaft that fits."),
    *_PROVENANCE,
)

PAIR_COLUMNS = (
    Column("motor_key", "A motor.", needed=True),
    Column("gear_keys", "The gears published as fitting it, separated by spaces.", needed=True),
    Column("source", "Origin of this statement."),
    Column("notes", "Other remarks.", lint_only=True),
)

BRAKE_COLUMNS = (
    *_IDENTITY,
    _choice("kind", "Closed by a spring or by permanent magnets.", BRAKE_KINDS),
    _choice("torque_side", "Shaft on which its torque acts.", BRAKE_SIDES, needed=True, why=_SIDE_WHY),
    _number("static_torque", "N m", 1e-4, 1e5, "Torque that it holds at rest, on its side."),
    _number("voltage", "V", 1.0, 1000.0, "Voltage of the coil."),
    _number("power", "W", 0.1, 1e4, "Power that keeps it open."),
    _number("current", "A", 1e-3, 100.0, "Current that keeps it open."),
    _number("inertia", "kg m^2", 1e-12, 10.0, "Inertia that it adds to its shaft."),
    _number("mass", "kg", 1e-4, 1e3, "Mass of the brake."),
    _number("release_time", "s", 1e-4, 10.0, "From switching the coil on until it is open."),
    _number("engage_time", "s", 1e-4, 10.0, "From switching the coil off until it holds."),
    _number("energy_per_stop", "J", 1e-2, 1e7, "Heat that one stop may produce."),
    _number("energy_per_hour", "J", 1e-2, 1e9, "Heat that all stops of an hour may produce."),
    _number("backlash", "rad", 0.0, 0.5, "Backlash of its hub, total, on its side."),
    *_PROVENANCE,
)

AMPLIFIER_COLUMNS = (
    *_IDENTITY,
    _choice("current_basis", "What kind of ampere is printed.", CURRENT_BASES, needed=True, why=_AMPLIFIER_WHY),
    Column("basis_evidence", "How that is known.", lint_only=True),
    _number("continuous_current", "A", 1e-2, 5000.0, "Continuous output current.", needed=True),
    _number("peak_current", "A", 1e-2, 1e4, "Short-time output current."),
    _number("peak_time", "s", 1e-3, 100.0, "Time for which it provides the peak current after the continuous current."),
    _number(
        "thermal_time_constant",
        "s",
        1e-3,
        1e4,
        "Time constant of its overload model, if it has a first-order model instead of a peak time.",
    ),
    _number("min_voltage", "V", 1.0, 1000.0, "Smallest voltage of the supply."),
    _number("max_voltage", "V", 1.0, 1000.0, "Largest voltage of the supply."),
    _number("modulation", "1", 0.3, 1.0, "Largest share of the supply voltage that reaches the motor terminals."),
    _number("current_loop_rate", "Hz", 100.0, 1e6, "Rate of the current loop."),
    _number("logic_power", "W", 0.0, 1000.0, "Power drawn by its electronics."),
    _number("mass", "kg", 1e-4, 1e3, "Mass of the amplifier."),
    Column("fieldbus", "Fieldbus that commands it.", lint_only=True),
    *_PROVENANCE,
)

PRICE_COLUMNS = (
    Column("part_key", "Key of the part in this catalogue; empty: it is not in it."),
    Column("category", "Kind of part."),
    Column("maker", "As the manufacturer writes it."),
    Column("name", "As the shop or the survey calls it.", needed=True),
    _number("rated_torque", "N m", 1e-6, 1e6, "Torque of the part, for comparison."),
    _number("peak_torque", "N m", 1e-6, 1e6, "Torque of the part, for comparison."),
    _number("ratio", "1", 1.0, 1e5, "Of its gear."),
    Column("price", "In the currency; the lower end of a range.", NUMBER, "", 0.01, 1e9, needed=True),
    Column("price_to", "The upper end of a range.", NUMBER, "", 0.01, 1e9),
    Column("currency", "Three letters: EUR, USD.", needed=True),
    _choice("kind", "Whether it was listed or estimated.", PRICE_KINDS, needed=True),
    Column("date", "When it was seen, as far as the source states.", needed=True),
    Column("shop", "Where, and what the figure includes."),
    Column("source", "Origin of the price."),
    Column("source_quality", "A: the shop's page; C: collected by others.", lint_only=True),
)

TABLES = {
    MOTORS: MOTOR_COLUMNS,
    GEARS: GEAR_COLUMNS,
    PAIRS: PAIR_COLUMNS,
    BRAKES: BRAKE_COLUMNS,
    AMPLIFIERS: AMPLIFIER_COLUMNS,
    PRICES: PRICE_COLUMNS,
}


def by_name(columns: Iterable[Column]) -> dict[str, Column]:
    return {column.name: column for column in columns}
