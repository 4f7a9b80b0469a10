"""The study: everything one job needs, read, checked and in SI."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array, frozen_array
from drivetrain.catalog.read import Catalog
from drivetrain.drive.amplifier import Amplifier, Supply
from drivetrain.drive.brake import Brake
from drivetrain.drive.counterbalance import Counterbalance
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import DRAG_REFERENCE
from drivetrain.errors import Fault, InputError
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.motion.motion import Motion
from drivetrain.notebook import shown
from drivetrain.study.document import Document
from drivetrain.study.parts.selection import SelectionOptions, TradeOffs
from drivetrain.study.parts.simulation import Simulation
from drivetrain.study.parts.tolerances import EXACT, Tolerances
from drivetrain.study.written import written
from drivetrain.units import (
    Current,
    Duration,
    Efficiency,
    Factor,
    Length,
    Mass,
    Name,
    PositiveLength,
    Quantity,
    Rate,
    Share,
    Temperature,
    TemperatureStep,
    Vector,
)

if TYPE_CHECKING:
    from drivetrain.study.parts.rules import CandidatesForm

Carrier = Literal["parent", "child", "base", "group"]


class DriveMass(StrEnum):
    """Whose mass the drives are: ADDED to bare links, INCLUDED in the arm's links, or REPLACED in them."""

    ADDED = "added"
    INCLUDED = "included"
    REPLACED = "replaced"


@dataclass(frozen=True, eq=False)
class Payload:
    """A body fixed to the tip.

    Attributes:
        name: What to call it.
        mass: [kg].
        com: Centre of mass in the tip frame [m], (3,).
        inertia: About the centre of mass, tip axes [kg m^2], (3, 3).
    """

    name: str
    mass: Mass
    com: Annotated[Array, Vector("m")]
    inertia: Array

    def __post_init__(self) -> None:
        for part, shape in (("com", (3,)), ("inertia", (3, 3))):
            object.__setattr__(self, part, frozen_array(getattr(self, part), shape, f"{self.name}.{part}"))


@dataclass(frozen=True)
class Mount:
    """Where a drive sits.

    A drive of coupled joints may sit where its group begins (``group``): on the link before the first joint of them, at
    and along that joint's axis. As read, that is ``parent`` of another joint.

    Attributes:
        carrier: Link that holds the stator: ``parent`` (before the joint), ``child`` (after it) or ``base``.
        offset: Of the drive's centre of mass from the joint's point, along the joint axis [m].
        joint: Index of the joint that the two others speak of, where a drive of coupled joints sits at another than
            its own; None: its own.
    """

    carrier: Carrier = "parent"
    offset: Length = 0.0
    joint: int | None = None


@dataclass(frozen=True, eq=False)
class ContainedDrive:
    """What an arm's links already hold at one joint, to be taken out before another drive is put in.

    Attributes:
        mass: Of motor and gear together [kg].
        mount: Where it sits in the links.
    """

    mass: Mass
    mount: Mount = Mount()


@dataclass(frozen=True)
class FreeRatio:
    """Gears of any ratio in a range, for early design: ideal, or of a series of the catalogue, scaled.

    Attributes:
        low, high: Ends of the range.
        series: Of the catalogue, whose rows are scaled; None: ideal gears.
        motor: Key; None: the motor of the joint's drive.
    """

    low: float
    high: float
    series: Name | None = None
    motor: Name | None = None


@dataclass(frozen=True)
class Stop:
    """The emergency stop, from any state of the cycle, and how often it comes.

    Attributes:
        current: With which the motor brakes [A], in the convention of the amplifier; None: its peak current.
        ramp: Time in which every speed falls to 0 on a straight line [s]; None: the motor brakes with that current.
        rise: Time in which the current comes, without a ramp [s].
        stops_per_day: How many; None: the permitted number of momentary peaks is not checked.
        service_life: Of the arm [s]; None: the same.
        jam: Whether the gear must bear an output that is held fast at full speed; else for information.
        power_off: Whether gears and holding brakes must bear the power going off at any instant; false where the supply
            outlives it, so that brakes bite at rest alone.
    """

    current: Current | None = None
    ramp: Duration | None = None
    rise: Annotated[float, Quantity("s", minimum=0.0)] = 0.0
    stops_per_day: Factor | None = None
    service_life: Duration | None = None
    jam: bool = False
    power_off: bool = True


@dataclass(frozen=True, eq=False)
class JointTask:
    """One joint of the study: its given drive, or the catalogue rows that may drive it.

    Attributes:
        name: Of the joint.
        drive: Keys of the given (motor, gear), or None; gear key "" is a direct drive.
        pairs: The (motor key, gear key) pairs that may be chosen, in a fixed order; empty when only a drive is given.
        passed_over: How many catalogue rows each rule of the study excluded, in words: shown in the report.
        mount: Where the drive sits.
        contained: What the arm's links already hold here (``replaced`` only).
        friction: At the joint, outside the gear's mesh.
        motor_friction: At the motor shaft, replacing the sheet's no-load data; None: from the sheet.
        amplifier: Of this joint.
        travel_per_turn: Of a prismatic joint, travel a radian of the gear's output [m/rad]; None for a revolute joint.
        housing_to_ambient: Thermal resistance that replaces the sheet's [K/W], of the real mounting; None: the sheet's.
        coupled: Names of the joints that its motor drives together with others; empty: this one alone. Friction, speed
            and torque are then those of the shaft behind the gear.
        rules: By which the pairs were found, as the study file states them; None where it states none.
        output_bearing: What carries the joint across its axis: the ``gear``'s output bearing or an ``external`` one.
        gear_heat: Share of the gear's loss that warms the motor's housing; 0: the gear is mounted elsewhere.
        amplifier_heat: The same of its amplifier's loss; 0: that is mounted elsewhere.
        load_inertia: Without an arm, what the gear turns, whose acceleration is already in the table's torque [kg m^2];
            None: not stated.
        stop: Its emergency stop, the current DC equivalent.
        free_ratio: Gears of any ratio in a range, for early design; None: none asked for.
        amplifiers: One of which is chosen, the first that holds; empty: ``amplifier``, which else allows what any of
            them allows.
        brakes: One of which must hold the joint; empty: it needs none. Motor keys name theirs: ``MOTOR+BRAKE``.
        counterbalances: Torques on the link behind the joint that its angle alone decides; their masses are the arm's.
        staged: Keys of the catalogue's gears with the joint's stages behind them, by the gear's own key ("" the direct
            drive); empty: it has no stages.
        preload: Of two motors on one axis, what it gives beside half of the load, and the other takes away [N m]; None:
            it has its axis alone.
        sharing: Names of the two motors, this one among them; empty: it has its axis alone.
    """

    name: str
    drive: tuple[str, str] | None
    pairs: tuple[tuple[str, str], ...]
    passed_over: tuple[str, ...]
    mount: Mount
    contained: ContainedDrive | None
    friction: Friction
    motor_friction: Friction | None
    amplifier: Amplifier
    travel_per_turn: float | None = None
    housing_to_ambient: float | None = None
    coupled: tuple[str, ...] = ()
    rules: CandidatesForm | None = None
    free_ratio: FreeRatio | None = None
    load_inertia: float | None = None
    output_bearing: str = "gear"
    stop: Stop = Stop()
    gear_heat: float = 1.0
    brakes: tuple[Brake, ...] = ()
    amplifiers: tuple[Amplifier, ...] = ()
    counterbalances: tuple[Counterbalance, ...] = ()
    amplifier_heat: float = 0.0
    staged: Mapping[str, str] = field(default_factory=dict)
    preload: float | None = None
    sharing: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"JointTask({self.name}: {pair_name(*self.drive) if self.drive else f'{len(self.pairs)} pairs'})"

    @property
    def choices(self) -> tuple[tuple[str, str], ...]:
        """The (motor key, gear key) pairs that may drive it: the given drive alone, or those that may be chosen."""
        return self.pairs if self.drive is None else (self.drive,)


@dataclass(frozen=True)
class Safety:
    """Factors on what is required, and the reserve below which a pass is MARGINAL.

    Attributes:
        peak_torque: On gear and motor peak torque, peak current, and the share of torque in the motor's voltage.
        rms: On RMS current.
        speed: On speeds.
        voltage: On terminal voltage.
        reserve: A check that passes with utilisation above ``1 - reserve`` is MARGINAL.
        temperature_margin: Kept below the winding's limit [K].
        inertia_ratio: Largest reflected load inertia over rotor inertia; None: for information.
        life: Wanted of gears and their output bearings [s]; None: for information.
        bearing_static_safety: On the static load of an output bearing: 1.5 is usual, 2 with shocks, 3 for precision.
        bearing_load_factor: On the mean load of an output bearing in its life: up to 1.2 smooth, up to 1.5 usual, up
            to 3 with shocks.
        brake: On the torque that a holding brake must hold; B&R asks 2 for the brakes of its 8JSA motors.
    """

    peak_torque: Factor = 1.0
    rms: Factor = 1.0
    speed: Factor = 1.0
    voltage: Factor = 1.0
    reserve: Share = 0.1
    temperature_margin: TemperatureStep = 0.0
    inertia_ratio: Factor | None = None
    life: Duration | None = None
    bearing_static_safety: Factor = 1.5
    bearing_load_factor: Factor = 1.2
    brake: Factor = 2.0


@dataclass(frozen=True)
class StiffnessWish:
    """How stiff the arm must be on the springs of its gears, anywhere in the cycle; None: not asked.

    Attributes:
        first_resonance: Its lowest natural frequency at least, motors held still [Hz].
        tip_deviation: Of the tip under weight, payload and inertia at most [m].
        lost_motion: Of the tip at most, between the ends of all gears' backlash [m].
        scatter: By which a gear may be softer than printed.
    """

    first_resonance: Rate | None = None
    tip_deviation: PositiveLength | None = None
    lost_motion: PositiveLength | None = None
    scatter: Share = 0.3

    @property
    def stated(self) -> bool:
        return (self.first_resonance, self.tip_deviation, self.lost_motion) != (None, None, None)


@dataclass(frozen=True)
class GearAssumption:
    """What the study assumes of gears of one kind where the data sheet gives no value; None: nothing.

    Attributes:
        efficiency: Power out over power in when the motor drives.
        backdriving_efficiency: When the load drives; None: from the same mesh friction.
        no_load_torque_share: No-load running torque at the input, as a share of continuous torque over ratio.
        source: Where the assumption is from.
    """

    efficiency: Efficiency | None = None
    backdriving_efficiency: Share | None = None
    no_load_torque_share: Share | None = None
    source: Name = ""


@dataclass(frozen=True)
class MotorAssumption:
    """What the study assumes of motors where the data sheet gives no value; None: nothing.

    Attributes:
        max_winding_temperature: [C].
        winding_time_constant, housing_time_constant: Thermal [s].
        winding_share: Of a thermal resistance printed from winding to ambient alone, what lies between winding and
            housing: before a mounting that the study states.
        source: Where the assumption is from.
    """

    max_winding_temperature: Temperature | None = None
    winding_time_constant: Duration | None = None
    housing_time_constant: Duration | None = None
    winding_share: Efficiency | None = None
    source: Name = ""


@dataclass(frozen=True)
class Prices:
    """In which currency prices are, and what others are worth in it.

    Attributes:
        currency: Three letters, of the column ``price`` of catalogues too; empty: not stated, only that column counts.
        rates: What one unit of another currency is worth in it, by its three letters.
    """

    currency: Name = ""
    rates: dict[str, Factor] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Study:
    """Everything one job needs, in SI.

    Attributes:
        name, description: Of the study.
        path: The study file, as given.
        digest: SHA-256 over the study and all files it names.
        arm: None when a load table gives the torques.
        drive_mass: Whose mass the drives are; None without an arm.
        payloads: Those the cycle names, in the order of ``cycle.payload_names``.
        cycle: The repeated task.
        base: Given motion of what carries the arm, at the samples of the cycle; None: it stands still.
        joints: One a joint, in the arm's order.
        supply: Behind all amplifiers.
        ambient: Temperature around the drives [C].
        safety: Factors and reserves.
        stiffness: How stiff the arm must be.
        holding: Motor torque that counts for heat while a mesh holds a load: ``least``, ``lossless``, ``most``.
        gear_temperature: At which the drag of gears is taken [C]; None: 20 C or colder air, a machine just switched on.
        cold_start: Of gears and motors in a start that is checked beside the task [C]; None: none is.
        gear_assumptions: By gear kind.
        motor_assumptions: By ``brushed``, ``brushless`` or ``frameless``.
        catalog: The rows that may be used.
        wanted: What selection minimises and must respect.
        tolerances: How far what is built may lie from these numbers.
        simulation: What a simulation of it holds, and how it is run.
        trade_offs: What the report of a selection shows besides the best set.
        prices: In which currency.
        notes: Warnings raised while reading (arm, motion, catalogue), for the report.
        document: What it was read from; None of one that was changed since.
    """

    name: str
    description: str
    path: str
    digest: str
    arm: Arm | None
    drive_mass: DriveMass | None
    payloads: tuple[Payload, ...]
    cycle: Cycle
    joints: tuple[JointTask, ...]
    supply: Supply
    ambient: float
    safety: Safety
    gear_assumptions: dict[str, GearAssumption]
    motor_assumptions: dict[str, MotorAssumption]
    catalog: Catalog
    wanted: SelectionOptions = field(default_factory=SelectionOptions)
    tolerances: Tolerances = EXACT
    simulation: Simulation = field(default_factory=Simulation)
    trade_offs: TradeOffs = field(default_factory=TradeOffs)
    holding: str = "lossless"
    stiffness: StiffnessWish = StiffnessWish()
    gear_temperature: float | None = None
    cold_start: float | None = None
    notes: tuple[str, ...] = ()
    prices: Prices = field(default_factory=Prices)
    base: Motion | None = None
    document: Document | None = field(default=None, init=False)

    def __repr__(self) -> str:
        arm = "a load table" if self.arm is None else f"arm {self.arm.name}"
        joints = f"{len(self.joints)} joint{'s' * (len(self.joints) > 1)}"
        return f"Study({self.name}: {arm}, {joints}, cycle of {self.cycle.duration:.4g} s{self.warned('notes')})"

    def warned(self, place: str) -> str:
        """How many warnings its notes hold, as the end of a short text; nothing where there are none.

        Args:
            place: Where the notes are, for who reads the text.
        """
        count = sum(note.startswith("warning:") for note in self.notes)
        return f"; {count} warning{'s' * (count > 1)} in .{place}" if count else ""

    def _repr_html_(self) -> str:
        import pandas as pd

        rows = {
            joint.name: {
                "motor": joint.drive[0] if joint.drive else "", "gear": joint.drive[1] if joint.drive else "",
                "candidate pairs": len(joint.pairs),
                "largest speed": f"{np.abs(self.cycle.velocity[:, i]).max():.4g} "
                + ("rad/s" if joint.travel_per_turn is None else "m/s"),
            }
            for i, joint in enumerate(self.joints)
        }  # fmt: skip
        title = f"{self!r}, {self.supply.voltage:.4g} V, {self.ambient:.4g} °C"
        return shown(title, pd.DataFrame.from_dict(rows, orient="index"))

    def to_yaml(self) -> str:
        """The study as the text of a study file, arrays inside; ``load_study`` of it evaluates identically.

        Names of other files in it start from the folder in which this is called.

        Raises:
            InputError: The study was made from another one, not read from a file or from ``study``.
        """
        if self.document is None:
            raise InputError(Fault("study", "was changed after it was read: only what was read can be written"))
        return written(replace(self.document, data={**self.document.data, "name": self.name}))

    def drag_temperature(self, ambient: Any) -> Any:
        """At which the drag of gears is taken in air of a temperature [C]: that of a machine just switched on.

        Data sheets are for 20 C, and colder air makes a colder gear. Warmth of its own does not count, nor do hotter
        surroundings: a warm gear drags less, and a worse mounting or hotter air would make verdicts better.

        Args:
            ambient: [C], one or many.

        Returns:
            The study's ``gear_temperature`` where it states one, of the shape of ``ambient``.
        """
        if self.gear_temperature is None:
            return np.minimum(ambient, DRAG_REFERENCE)
        return np.full_like(ambient, self.gear_temperature, dtype=np.float64)

    @property
    def given_drives(self) -> dict[str, tuple[str, str]]:
        """Keys of the given (motor, gear) by joint name; joints whose drive is to be chosen are left out."""
        return {task.name: task.drive for task in self.joints if task.drive is not None}

    @property
    def gives_all_drives(self) -> bool:
        """Whether no drive is to be chosen."""
        return all(task.drive is not None for task in self.joints)

    @property
    def objective(self) -> str:
        """What selection minimises: ``mass``, ``price``, ``energy`` or ``weighted``."""
        return self.wanted.objective

    @property
    def objective_unit(self) -> str:
        """Its unit; empty for a price without a stated currency, and for a weighted sum."""
        return {"mass": "kg", "energy": "J", "price": self.prices.currency}.get(self.objective, "")


def pair_name(motor: str, gear: str) -> str:
    """A motor and its gear, by keys or names, in words; the gear of a direct drive is empty."""
    return f"{motor} with {gear or 'no gear'}"


def gear_name(gear: str) -> str:
    """A gear in a table; empty: that of a direct drive."""
    return gear or "direct drive"


def refuse_moving_base(study: Study, what: str) -> None:
    """Raises InputError where the base of the study's arm moves, with which something is not computed."""
    if study.base is not None:
        raise InputError(Fault("base", f"moves as the study gives it, with which {what} is not computed"))
