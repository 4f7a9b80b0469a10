"""The gear: its data sheet in SI, mesh losses by direction of power, and drag."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from drivetrain.arrays import Array, checked_array, checked_number, checked_numbers
from drivetrain.drive.friction import direction, side
from drivetrain.drive.ranges import EFFICIENCY, FINITE, NOT_NEGATIVE, POSITIVE, Range, range_faults
from drivetrain.errors import Fault, InputError, nearest, raise_faults
from drivetrain.jit import law
from drivetrain.notebook import DataSheet
from drivetrain.records import as_record, known, known_or

HOLDING = {"least": -1.0, "lossless": 0.0, "most": 1.0}
"""Which motor torque counts while a mesh rests under load, by its name in a study; see ``Gear.holding``."""

MOMENTARY_WAVES = 1e4
"""Permitted number of flexspline waves under momentary peaks in the life of the gear; Harmonic Drive catalogue SHG, p.
30.
"""

GEAR_KINDS = ("planetary", "strain_wave", "rv", "koaxdrive", "spur", "ideal")

_OPTIONAL_POSITIVE = (
    "momentary_waves ratcheting_torque buckling_torque "
    "continuous_torque average_torque_limit repeated_peak_torque momentary_torque max_input_speed "
    "average_input_speed_limit rated_speed rated_life life_exponent stiffness_1 stiffness_2 stiffness_3 torque_1 "
    "bearing_dynamic_rating bearing_static_rating bearing_pitch_diameter bearing_offset drag_speed "
    "torque_2 tilting_moment_limit axial_load_limit radial_load_limit size pitch_diameter diameter length "
    "max_motor_shaft stages"
).split()
_RANGES = {
    "ratio": FINITE,
    "efficiency": EFFICIENCY,
    "backdriving_efficiency": Range("must be at most 1 (0 or less: self-locking)", -math.inf, 1.0),
    "mesh_efficiency": EFFICIENCY,
    **dict.fromkeys(("drag_temperature_1", "drag_temperature_2", "max_temperature"), FINITE),
    "holding": Range("must be from -1 (least) to 1 (most)", -1.0, 1.0, low_included=True),
    **dict.fromkeys(("no_load_torque", "inertia", "mass", "backlash", "price"), NOT_NEGATIVE),
    **dict.fromkeys(("drag_torque", "drag_speed_exponent", "seal_drag_torque", "starting_torque"), NOT_NEGATIVE),
    **dict.fromkeys(_OPTIONAL_POSITIVE, POSITIVE),
}


@dataclass(frozen=True, repr=False)
class Gear(DataSheet):
    """A gear's data sheet; None if the data sheet gives no value (unknown is never zero).

    Torques and stiffnesses are at the output, speeds and inertia at the input.

    Attributes:
        key: Unique name in the catalogue.
        ratio: Motor speed over output speed; negative when the output turns the other way.
        maker, series, part_number: As printed.
        kind: ``planetary``, ``strain_wave``, ``rv``, ``koaxdrive``, ``spur`` or ``ideal``.
        stages: Number of stages.
        efficiency: Power out over power in when the motor drives, at the rated torque; None: unknown (``ideal``: 1).
        backdriving_efficiency: Power out over power in when the load drives; None: that of the same mesh friction.
        no_load_torque: Running torque at the input without load [N m]. It is part of the loss in ``efficiency``, and is
            not used where ``drag_torque`` is given.
        mesh_efficiency: Power out over power in of the mesh alone, without the drag below; None: mesh and drag are not
            given separately, and ``efficiency`` is used.
        drag_torque: Load-independent torque at the input at ``drag_speed`` and 20 C, without seals [N m].
        drag_speed: Input speed of ``drag_torque`` [rad/s].
        drag_speed_exponent: Exponent of the drag over speed; 0: drag does not depend on speed.
        drag_temperature_1, drag_temperature_2: Coefficients of the drag over gear temperature, exp(-b1 d + b2 d^2), d
            above 20 C [1/K], [1/K^2].
        seal_drag_torque: Drag of the input's seals, at any speed and temperature [N m].
        starting_torque: Breakaway torque of the unloaded gear at the input [N m]; None: its running drag.
        loss_basis: Basis of the seven values above, and which of them are fitted or assumed.
        inertia: Inertia at the input [kg m^2].
        mass: Mass [kg].
        continuous_torque: Rated (strain wave: at rated speed; planetary: continuous) [N m].
        average_torque_limit: Limit of the average torque over the cycle [N m].
        repeated_peak_torque: Limit of the peaks of every cycle (acceleration torque, intermittent torque) [N m].
        momentary_torque: Limit of rare peaks [N m].
        momentary_waves: Permitted flexspline waves under momentary peaks in its life; None: the value of its kind, if
            known.
        ratcheting_torque: Torque at which the teeth of a strain-wave gear ratchet [N m].
        buckling_torque: Torque at which the flexspline buckles [N m].
        max_input_speed: Largest input speed, short-time [rad/s].
        average_input_speed_limit: Limit of the mean input speed [rad/s].
        rated_speed: Input speed at which the rated torque and life hold [rad/s].
        rated_life: L10 life at rated torque and speed [s]; a mean life L50 of a data sheet is five times L10.
        life_exponent: Exponent of torque in average torque and life; None: that of the kind.
        stiffness_1, stiffness_2, stiffness_3: Stiffness K1, K2, K3 of the three ranges of torque [N m/rad].
        torque_1, torque_2: Torques between these ranges [N m].
        backlash: Total backlash at the output [rad].
        tilting_moment_limit: Largest tilting moment on the output bearing [N m].
        axial_load_limit, radial_load_limit: Largest forces on the output bearing [N].
        bearing_dynamic_rating, bearing_static_rating: Load ratings C and C0 of the output bearing [N].
        bearing_pitch_diameter: Pitch diameter of the output bearing's rollers or balls [m].
        bearing_offset: Distance from the output flange back to the bearing's centre [m].
        max_temperature: Largest housing temperature, for grease and seals [C].
        size: The maker's size number, such as 25 for a strain-wave gear.
        pitch_diameter: Pitch diameter of the toothing, for the geometric rule with frameless motors [m].
        diameter, length: Dimensions [m].
        max_motor_shaft: Largest motor shaft diameter that fits [m].
        price: In the user's currency; empty in the shipped catalogue.
        holding: Which of the motor torques that hold a load at rest is used: -1 the smallest, 0 that of a lossless
            mesh, 1 the largest. With friction all torques between are possible, depending on how the joint came to
            rest.
        source: File and row, sheet, edition: what a report prints.
        load_friction: Load-dependent friction of the joint behind the gear over its load (``Friction.load_share``).
        stage_driving, stage_driven: Torque before the stages over torque behind them, relative to lossless stages, when
            the gear drives and when the load drives.
        stage_inertia: Inertia of the stages at the input, not included in ``inertia`` where that is unknown [kg m^2].
        stage_mass: Mass of the stages, included in ``mass`` [kg].
        stage_sprung: Inertia of the stages that the spring of gear and stages carries, at the joint [kg m^2].
        stage_torque, stage_speed: Limits of the stages at the joint [N m], [rad/s]; None: unknown.
        stage_words: The parts that set these two limits.
        staged: 1 if there are stages behind the gear, else 0 (``drive/stages.py``).
    """

    key: str
    ratio: float
    maker: str = ""
    series: str = ""
    part_number: str = ""
    kind: str = "ideal"
    stages: int | None = None
    efficiency: float | None = None
    backdriving_efficiency: float | None = None
    no_load_torque: float | None = None
    mesh_efficiency: float | None = None
    drag_torque: float | None = None
    drag_speed: float | None = None
    drag_speed_exponent: float | None = None
    drag_temperature_1: float | None = None
    drag_temperature_2: float | None = None
    seal_drag_torque: float | None = None
    starting_torque: float | None = None
    loss_basis: str = ""
    inertia: float | None = None
    mass: float | None = None
    continuous_torque: float | None = None
    average_torque_limit: float | None = None
    repeated_peak_torque: float | None = None
    momentary_torque: float | None = None
    momentary_waves: float | None = None
    ratcheting_torque: float | None = None
    buckling_torque: float | None = None
    max_input_speed: float | None = None
    average_input_speed_limit: float | None = None
    rated_speed: float | None = None
    rated_life: float | None = None
    life_exponent: float | None = None
    stiffness_1: float | None = None
    stiffness_2: float | None = None
    stiffness_3: float | None = None
    torque_1: float | None = None
    torque_2: float | None = None
    backlash: float | None = None
    tilting_moment_limit: float | None = None
    axial_load_limit: float | None = None
    radial_load_limit: float | None = None
    bearing_dynamic_rating: float | None = None
    bearing_static_rating: float | None = None
    bearing_pitch_diameter: float | None = None
    bearing_offset: float | None = None
    max_temperature: float | None = None
    size: float | None = None
    pitch_diameter: float | None = None
    diameter: float | None = None
    length: float | None = None
    max_motor_shaft: float | None = None
    price: float | None = None
    holding: float = 0.0
    source: str = ""
    load_friction: float = 0.0
    stage_driving: float = 1.0
    stage_driven: float = 1.0
    stage_inertia: float = 0.0
    stage_mass: float = 0.0
    stage_sprung: float = 0.0
    stage_torque: float | None = None
    stage_speed: float | None = None
    stage_words: tuple[str, str] = ("", "")
    staged: float = 0.0

    def __post_init__(self) -> None:
        owner = f"gear {self.key}"
        faults = range_faults(owner, self, _RANGES, required=("ratio",))
        if self.ratio == 0:
            faults.append(Fault(f"{owner}.ratio", "must not be 0", self.ratio))
        if not faults and (self.torque_1 or 0.0) > (self.torque_2 or math.inf):
            problem = f"is larger than torque_2 ({self.torque_2:g} N m): the first piece of the spring ends first"
            faults.append(Fault(f"{owner}.torque_1", problem, self.torque_1))
        if self.kind not in GEAR_KINDS:
            faults.append(Fault(f"{owner}.kind", "unknown kind", self.kind, nearest(str(self.kind), GEAR_KINDS)))
        raise_faults(faults)

    @property
    def direct(self) -> bool:
        """Whether this is the placeholder of a direct drive, with or without stages."""
        return self.key == "" or self.key.startswith("+")


NO_GEAR = Gear("", 1.0, kind="ideal", efficiency=1.0)
"""The gear of a direct drive."""


class Mesh(NamedTuple):
    """The values of a gear that its torque laws need; torques at the input [N m]."""

    ratio: float  # motor speed over output speed
    # Motor-side torque through the mesh over that of a lossless mesh.
    driving: float  # when the motor drives the load; 1 or more
    driven: float  # when the load drives the motor; 1 or less, 0 or less for a self-locking mesh
    # At rest, according to ``Gear.holding``: factor on the lossless torque, and torque added to it.
    holding: float
    grip: float
    drag: float  # at an input speed of 1 rad/s and 20 C, without load and seals
    exponent: float  # exponent of the drag over speed; 0: independent of speed
    # Coefficients b1 and b2 of the drag over temperature, see ``drag_factor`` [1/K], [1/K^2].
    cooling: float
    bend: float
    seal: float  # drag of the seals, at any speed and temperature
    starting: float  # breakaway torque of the unloaded gear


class StandstillInterval(NamedTuple):
    """Ends of the interval of motor-side torques at which a mesh stays at rest.

    Attributes:
        hold: Smallest magnitude that holds the load [N m]; 0 when the gear holds it without the motor.
        start: Torque at which the motor starts to move the load against its torque [N m].
    """

    hold: Array
    start: Array


@law
def has_drag_data(gear: Any) -> Any:
    """Whether the data sheet gives mesh and drag losses separately."""
    return known(gear.mesh_efficiency) or known(gear.drag_torque)


@law
def unknown_loss(gear: Any) -> Any:
    """NaN where the data sheet lacks data for the gear's loss, else 0. Mesh efficiency without drag, or drag without
    it, is not enough.
    """
    if not has_drag_data(gear):
        return 0.0 * gear.efficiency
    speed = gear.drag_speed if gear.drag_speed_exponent > 0.0 else 0.0
    temperature = gear.drag_temperature_1 + gear.drag_temperature_2
    return 0.0 * (gear.mesh_efficiency + gear.drag_torque + gear.drag_speed_exponent + speed + temperature)


@law
def onward(gear: Any) -> Any:
    """Torque at the gear's output over that at the joint, relative to lossless transmission, while the motor drives:
    stages and load-dependent friction.
    """
    return gear.stage_driving * (1.0 + gear.load_friction)


@law
def stage_load(gear: Any) -> Any:
    """Inertia of the stages behind a gear, at the joint [kg m^2]; the gear transmits the torque that accelerates it."""
    return gear.stage_inertia * gear.ratio * gear.ratio


def sprung_stages(gear: Gear) -> float:
    """Inertia of the stages that the spring of gear and stages carries, at the joint [kg m^2]: of the inertia at the
    motor's shaft, that which stands on the link's side of the spring.
    """
    return 0.0 if gear.stiffness_1 is None or gear.inertia is None else gear.stage_sprung


@law
def mesh_of(gear: Any) -> Any:
    """The mesh of a gear, lossless where the loss is unknown. The friction is mu |N| against the motion, mu = 1/eta -
    1.

    When the motor drives, the factor on the lossless torque is 1/eta; when the load drives, it is eta_back, or 1 - mu
    if none is given (ASSUMED: the same friction in both directions); at 0 or less the mesh is self-locking. If the data
    sheet gives mesh and drag separately, both are used as given.

    Otherwise the printed efficiency is that of the whole gear at its rated torque, which includes the no-load running
    torque. If the data sheet gives that torque too, its share at rated torque is removed from the mesh loss (the mesh
    efficiency is limited to 1) and it is applied as a drag that depends on neither speed nor temperature. At rated
    torque the sum is the printed loss; at smaller torques it is more than the printed efficiency implies. Without a
    rated torque the share is unknown and stays in the mesh, which counts it twice.

    The factors of stages and load-dependent friction behind the gear are multiplied; where a stage is self-locking, the
    gear drives.
    """
    apart, knows = has_drag_data(gear), known(unknown_loss(gear))
    efficiency = (gear.mesh_efficiency if apart else gear.efficiency) if knows else 1.0
    loss, running, exponent, cooling, bend, share = 1.0 / efficiency - 1.0, gear.no_load_torque, 0.0, 0.0, 0.0, 0.0
    if apart:
        exponent, running = known_or(gear.drag_speed_exponent, 0.0), gear.drag_torque
        cooling, bend = known_or(gear.drag_temperature_1, 0.0), known_or(gear.drag_temperature_2, 0.0)
    else:
        share = known_or(running * abs(gear.ratio) / gear.continuous_torque, 0.0)
    back = known_or(gear.backdriving_efficiency, 1.0 - loss) if knows else 1.0
    driving, driven = max(1.0 + loss - share, 1.0), min(back + share, 1.0)
    behind = gear.stage_driven * (1.0 - gear.load_friction)
    driven = behind * (driven if behind > 0.0 else driving)
    driving = driving * onward(gear)
    drag = known_or(running, 0.0) / known_or(gear.drag_speed, 1.0) ** exponent
    seal = known_or(gear.seal_drag_torque, 0.0)
    starting = max(known_or(gear.starting_torque, known_or(running, 0.0)), seal)
    span = driving - 1.0 if gear.holding > 0.0 else 1.0 - max(driven, 0.0)
    return Mesh(
        gear.ratio, driving, driven, 1.0 + gear.holding * span, gear.holding * starting, drag, exponent, cooling, bend,
        seal, starting,
    )  # fmt: skip


@law
def mesh_slope(mesh: Any, power: Any) -> Any:
    """Motor-side torque through the mesh over the load torque, by the sign of the power to the load; 0: at rest."""
    factor = mesh.driving * (power > 0.0) + mesh.driven * (power < 0.0) + mesh.holding * (power == 0.0)
    return factor / mesh.ratio


@law
def mesh_torque(mesh: Any, load: Any, speed: Any) -> Any:
    """Motor-side torque through the mesh [N m]: T/(eta G) if the motor drives, eta_back T/G if the load does, at rest
    by ``Gear.holding``.
    """
    through = mesh_slope(mesh, load * speed) * load
    size = abs(through)
    grip = 0.5 * (mesh.grip - size + abs(mesh.grip + size))  # not below the value at which the torque is 0
    # Without load the torque that the gear may hold has either sign.
    return through + grip * side(through) * (speed == 0.0)


@law
def resting_interval(mesh: Any, load: Any) -> Any:
    """Interval of motor-side torques at which a gear stays at rest: T eta_b/G - T_s to T/(eta G) + T_s for T/G > 0.

    The first has the opposite sign where the gear holds its load without the motor.
    """
    lossless = load / mesh.ratio
    sign = side(lossless)
    return StandstillInterval(
        mesh.driven * lossless - sign * mesh.starting, mesh.driving * lossless + sign * mesh.starting
    )


@law
def wear(torque: Any, exponent: Any) -> Any:
    """|T|^e; the usual exponent 3 needs no power function."""
    size = abs(torque)
    return size * size * size if exponent == 3.0 else size**exponent


@law
def life_of(gear: Any, average_torque: Any, mean_input_speed: Any) -> Any:
    """L10 = L_rated (n_rated/n) (T_rated/T)^e [s]; infinite without speed or load, NaN if unknown.

    Harmonic Drive catalogues HFUS-2A p. 19, SHG p. 30.
    """
    return gear.rated_life / (
        mean_input_speed / gear.rated_speed * wear(average_torque / gear.continuous_torque, gear.life_exponent)
    )


@law
def permitted_peaks(waves: Any, ratio: Any, travel: Any) -> Any:
    """Permitted number of momentary peaks of a strain-wave gear during each of which its output turns by ``travel``
    [rad].

    N / (2 |G| travel / 2 pi), two waves of the flexspline per turn of the input; Harmonic Drive catalogue SHG, p. 30.
    """
    turns = abs(ratio * travel) / (2.0 * math.pi)
    return math.inf if turns == 0.0 else waves / (2.0 * turns)


# Assumed if a catalogue row gives no value: slightly below the lowest value of the shipped rows. Momentary over
# repeated peak torque is 1.45 to 2.39 in 91 gears, mean over maximum input speed 0.386 to 1 in 182; the lowest printed
# limits are 3500 and 2000 rpm.
MOMENTARY_SHARE, MEAN_SHARE = 1.4, 0.38
SLOWEST_INPUT, SLOWEST_MEAN = 3500.0 * math.pi / 30.0, 2000.0 * math.pi / 30.0  # rad/s


@law
def least_momentary_torque(gear: Any) -> Any:
    """A conservative momentary peak torque for a row that gives none [N m]."""
    return MOMENTARY_SHARE * known_or(gear.repeated_peak_torque, gear.continuous_torque)


@lru_cache(maxsize=1024)  # because every copy is validated again
def complete(gear: Gear) -> Gear:
    """The gear with the defaults of its kind: life exponent, momentary waves; if ideal also efficiency and inertia."""
    if gear.kind == "strain_wave" and gear.momentary_waves is None:
        return replace(gear, life_exponent=torque_exponent(gear), momentary_waves=MOMENTARY_WAVES)
    if gear.kind != "ideal":
        return replace(gear, life_exponent=torque_exponent(gear))
    efficiency = 1.0 if gear.efficiency is None else gear.efficiency
    return replace(gear, life_exponent=torque_exponent(gear), efficiency=efficiency, inertia=gear.inertia or 0.0)


def mesh_loss_coefficient(gear: Gear) -> float:
    """Friction torque over transmitted torque, from the mesh efficiency or else from the printed efficiency."""
    record = as_record(complete(gear))
    if not known(unknown_loss(record)):
        hint, problem = "state an assumption for this kind of gear", "is unknown, so its losses cannot be computed"
        name = "mesh_efficiency" if has_drag_data(record) else "efficiency"
        if has_drag_data(record):
            hint, problem = "complete its columns", "and the columns of drag stand together, and one of them is empty"
        raise InputError(Fault(f"gear {gear.key}.{name}", problem, hint=hint))
    return float(1.0 / (record.mesh_efficiency if has_drag_data(record) else record.efficiency) - 1.0)


@lru_cache(maxsize=1024)
def mesh(gear: Gear) -> Mesh:
    """The mesh of a gear whose loss is known."""
    mesh_loss_coefficient(gear)
    return Mesh(*(float(value) for value in mesh_of(as_record(complete(gear)))))


def mesh_input_torque(
    gear: Gear, output_torque: Array, output_speed: Array, *, standstill: Array | None = None
) -> Array:
    """Motor-side torque that the mesh requires, without rotor acceleration and drag.

    Motor drives (torque times speed positive): T / (eta ratio). Load drives: eta_back T / ratio, which changes sign for
    a self-locking mesh because the motor must help to lower the load. At rest: T / ratio, or according to
    ``gear.holding`` (``standstill_interval`` gives all torques that hold, and the one that starts the motion).

    Args:
        gear: Data sheet.
        output_torque: Torque at the gear's output, acting on the load [N m], any shape.
        output_speed: Speed of the gear's output [rad/s], same shape.
        standstill: True where the gear is at rest, same shape; None: where the speed is exactly 0.

    Returns:
        Motor-side torque [N m], same shape.

    Raises:
        InputError: The loss is unknown and the gear is not ``ideal``.
    """
    speed = np.asarray(output_speed, dtype=np.float64)
    moving = speed if standstill is None else np.where(standstill, 0.0, speed)
    return np.asarray(mesh_torque(mesh(gear), np.asarray(output_torque, dtype=np.float64), moving))


def standstill_interval(gear: Gear, output_torque: Array) -> StandstillInterval:
    """The interval of motor-side torques at which a gear at rest holds a load.

    Args:
        gear: Data sheet.
        output_torque: Torque at the gear's output, acting on the load [N m], any shape.

    Returns:
        Both ends of the interval [N m], each of that shape, including the breakaway torque of the unloaded gear.

    Raises:
        InputError: The loss is unknown and the gear is not ``ideal``.
    """
    found, torque = mesh(gear), np.asarray(output_torque, dtype=np.float64)
    hold, start = resting_interval(found, torque)
    return StandstillInterval(np.where(hold * torque / gear.ratio > 0.0, hold, 0.0), np.asarray(start))


def torque_exponent(gear: Gear) -> float:
    """Exponent of torque in the gear's average torque and life: 3 for ball bearings (Harmonic Drive catalogues; cubic
    mean torque of planetary gears), 10/3 for roller bearings.
    """
    if gear.life_exponent is not None:
        return gear.life_exponent
    return 10.0 / 3.0 if gear.kind == "rv" else 3.0


def average_torque(exponent: float, torque: Array, speed: Array, weights: Array) -> float:
    """Average torque of a cycle weighted by wear; rests and signs do not count.

    Args:
        exponent: Exponent from ``torque_exponent``.
        torque: Output torque in each section [N m], (N,).
        speed: Output speed in each section [rad/s] or any other unit of speed, (N,).
        weights: Duration of each section [s], (N,).

    Returns:
        Average torque [N m]; 0 if nothing turns.

    Raises:
        InputError: An exponent that is not positive, negative durations, or arrays of different lengths.

    Reference:
        ``(sum |n T^e| t / sum |n| t)^(1/e)``, Harmonic Drive catalogue SHG, p. 30.
    """
    checked_number(exponent, "exponent", "-", above=0.0)
    torque = checked_array(torque, (None,), "torque")
    speed, weights = (checked_array(one, torque.shape, name) for name, one in (("speed", speed), ("weights", weights)))
    if (weights < 0.0).any():
        raise InputError(Fault("weights", "must be at least 0 [s]", float(weights.min())))
    travel = np.abs(speed) * weights
    total = float(np.sum(travel))
    return float((travel @ wear(torque, exponent) / total) ** (1.0 / exponent)) if total > 0.0 else 0.0


def gear_life(gear: Gear, average_torque: float, average_input_speed: float) -> float | None:
    """L10 life, which nine of ten gears reach.

    Args:
        gear: Rated life, torque and speed; ``rated_life`` is an L10 (a printed L50 over 5).
        average_torque: Average torque from ``average_torque`` [N m].
        average_input_speed: Mean magnitude of the input speed over the whole cycle, rests included [rad/s].

    Returns:
        Life [s]; infinite without speed or load; None if rated life, torque or speed is not given.

    Raises:
        InputError: A torque or speed that is negative or no finite number.

    Reference:
        L = L_rated (n_rated / n_average) (T_rated / T_average)^e, Harmonic Drive catalogues HFUS-2A p. 19, SHG p. 30.
    """
    named = {"average_torque": (average_torque, "N m"), "average_input_speed": (average_input_speed, "rad/s")}
    average_torque, average_input_speed = checked_numbers(named, least=0.0)
    if gear.rated_life is None or gear.rated_speed is None or gear.continuous_torque is None:
        return None
    if average_torque == 0.0 or average_input_speed == 0.0:
        return math.inf
    return float(life_of(complete(gear), average_torque, average_input_speed))


def momentary_peak_count(gear: Gear, output_speed: float, duration: float) -> float:
    """Permitted number of momentary peaks in the life of a strain-wave gear.

    Args:
        gear: Gear with its ratio.
        output_speed: Output speed during the peak [rad/s].
        duration: Duration of one peak [s].

    Returns:
        Allowed number of peaks; infinite at rest.

    Raises:
        InputError: A duration that is negative, or values that are no finite numbers.

    Reference:
        10^4 / (2 (n/60) i t), two waves of the flexspline a turn; Harmonic Drive catalogue SHG, p. 30.
    """
    speed = checked_number(output_speed, "output_speed", "rad/s")
    travel = speed * checked_number(duration, "duration", "s", least=0.0)
    waves = MOMENTARY_WAVES if gear.momentary_waves is None else gear.momentary_waves
    return float(permitted_peaks(waves, gear.ratio, travel))


# Drag of a gear over speed and temperature, in addition to the loss of its mesh.
#
# A printed efficiency combines both at one operating point. Given separately they apply at any load and at rest: T_in =
# T_out/(G eta) + T_d when the motor drives, T_out eta_back/G + T_d when the load does, T_d against the motion.


DRAG_REFERENCE = 20.0  # temperature at which drag is given [C]
# range of the charts that the law was fitted to [C]; outside, the value at the nearest end is used
DRAG_TEMPERATURES = (-10.0, 40.0)
HALVINGS = 24  # bisection steps from some ten kelvin to a resolution of a millionth


@law
def drag_factor(mesh: Any, temperature: Any) -> Any:
    """Drag at a gear temperature over that at 20 C: exp(-b1 d + b2 d^2), d above 20 C, from -10 to 40 C; without seals.

    Fitted to 88 points of efficiency charts to 0.4 points rms (catalogs/SOURCES.md). +-20 % for sizes 14 to 25, +-40 %
    elsewhere.
    """
    above = min(max(temperature, DRAG_TEMPERATURES[0]), DRAG_TEMPERATURES[1]) - DRAG_REFERENCE
    return math.exp((mesh.bend * above - mesh.cooling) * above)


@law
def turning_drag(mesh: Any, factor: Any, input_speed: Any) -> Any:
    """T_d = T_20 (n/n_0)^p f + T_seal with the sign of the input speed [N m]; 0 at rest. ``factor``: temperature factor
    f.
    """
    return grown_drag(mesh, factor * speed_power(mesh.exponent, input_speed), input_speed)


@law
def grown_drag(mesh: Any, factor: Any, input_speed: Any) -> Any:
    """Drag torque with the sign of the input speed [N m]; ``factor``: f |n|^p, of temperature and speed."""
    return direction(input_speed) * (mesh.drag * factor + mesh.seal)


@law
def speed_power(exponent: Any, speed: Any) -> Any:
    """|n|^p; 1 for p = 0, without a power function."""
    return 1.0 if exponent == 0.0 else abs(speed) ** exponent


@law
def drag_torque(mesh: Any, input_speed: Any, temperature: Any) -> Any:
    """Drag torque at a gear temperature [C], with the sign of the input speed [N m]."""
    return turning_drag(mesh, drag_factor(mesh, temperature), input_speed)


@law
def settled_temperature(mesh: Any, ambient: Any, resistance: Any, heat: Any, drag: Any) -> Any:
    """Temperature of a gear that its drag heats, T = T_ambient + R (heat + drag f(T)) [C], from below by bisection."""
    low = ambient + resistance * heat
    high = low + resistance * drag * drag_factor(mesh, low)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if ambient + resistance * (heat + drag * drag_factor(mesh, middle)) > middle:
            low = middle
        else:
            high = middle
    return low


@law
def mesh_loss_power(mesh: Any, load: Any, speed: Any) -> Any:
    """Heat of a turning mesh [W] from torque and speed at its output: (1/eta - 1) |T w| or (1 - eta_back) |T w|."""
    power = load * speed
    return ((mesh.driving - 1.0) * (power > 0.0) + (mesh.driven - 1.0) * (power < 0.0)) * power


@law
def gear_loss_power(mesh: Any, load: Any, speed: Any, temperature: Any) -> Any:
    """Heat of mesh and drag together [W]."""
    motor_speed = mesh.ratio * speed
    return mesh_loss_power(mesh, load, speed) + drag_torque(mesh, motor_speed, temperature) * motor_speed


# Output bearing of a gear: equivalent load of tilting moment, radial and axial force, and life.
#
# Crossed rollers carry all three; the moment acts as a couple of radial forces on the pitch circle of the rollers.
# Source: Harmonic Drive CSF/CSG catalogue; equivalent load as for any crossed roller bearing.


ROLLER_EXPONENT = 10.0 / 3.0


@law
def bearing_arm(gear: Any) -> Any:
    """Distance from the output flange to the bearing's centre [m]; NaN if the sheet gives only the bearing's diameter.

    0 if the data sheet gives neither: the tilting moment is then taken about the flange.
    """
    return gear.bearing_offset if known(gear.bearing_pitch_diameter) else known_or(gear.bearing_offset, 0.0)


@law
def moment_square(arm: Any, mx: Any, my: Any, fx: Any, fy: Any) -> Any:
    """Square of the tilting moment about a point at the distance ``arm`` along the axis, the larger value of both sides
    [N^2 m^2].

    The moment is M + F x d z, (mx + d fy, my - d fx). The larger value is used because a study does not state on which
    side of the joint the flange lies. The radial force enters by this lever and once more directly in the loads below.
    """
    return mx * mx + my * my + arm * (arm * (fx * fx + fy * fy) + 2.0 * abs(mx * fy - my * fx))


@law
def static_load(diameter: Any, moment: Any, radial: Any, axial: Any) -> Any:
    """Equivalent static load P0 = Fr + 2 M/dp + 0.44 Fa [N] of the largest value of each.

    C0/P0 should be 1.5, with shocks 2, for precision 3 (Harmonic Drive FHA-C catalogue, p. 23).
    """
    return radial + 2.0 * moment / diameter + 0.44 * axial


@law
def equivalent_load(diameter: Any, moment: Any, radial: Any, axial: Any) -> Any:
    """P = x A + y Fa, A = Fr + 2 M/dp [N]; x = 1, y = 0.45 where Fa <= 1.5 A, else both 0.67.

    The two lines meet at Fa = 1.5 A, so P is the larger of them. All loads are magnitudes.
    """
    across = radial + 2.0 * moment / diameter
    return np.maximum(across + 0.45 * axial, 0.67 * (across + axial))


@law
def bearing_life(rating: Any, load_factor: Any, mean_load: Any, mean_speed: Any) -> Any:
    """L10 = 10^6 turns (C/(fw P))^(10/3) [s]; infinite without speed or load.

    Oscillating motion counts by the angle travelled; the law does not hold for very small angles, which cause fretting.
    Harmonic Drive CSF/CSG catalogue, pp. 34-35.
    """
    return 2e6 * math.pi / mean_speed * (rating / (load_factor * mean_load)) ** ROLLER_EXPONENT
