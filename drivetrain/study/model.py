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
from drivetrain.drive.amplifier import Amplifier, Supply, conduction_loss
from drivetrain.drive.brake import Brake
from drivetrain.drive.counterbalance import Counterbalance
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import DRAG_REFERENCE
from drivetrain.drive.motor import Motor
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
    Force,
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


@dataclass(frozen=True, eq=False)
class ProcessForce:
    """A force between the tip and its surroundings: of a grinding tool, a gripper that presses, the ground under a leg.

    Attributes:
        name: What to call it.
        force: [N], (3,).
        moment: Moment in addition to that of the force [N m], (3,).
        point: Point in the tip frame at which the force acts [m], (3,).
        axes: Axes of force and moment: those of the ``tip`` frame, which turn with it, or of the ``base`` frame.
        along_motion: Force in the direction in which the point moves relative to the base [N], in addition; 0 while it
            rests. Positive: the tip pushes ahead, such as against the cutting force of a milling tool.
        applied_by: Whether they are what the ``tip`` applies to its surroundings, or what the ``surroundings`` apply to
            the tip.
        table: Instead of ``force`` and ``moment``, these over the time since the beginning of the step: time [s],
            moment [N m], force [N], (K, 7). None: they are constant.
    """

    name: str
    force: Annotated[tuple[float, float, float], Vector("N")] = (0.0, 0.0, 0.0)
    moment: Annotated[tuple[float, float, float], Vector("N m")] = (0.0, 0.0, 0.0)
    point: Annotated[tuple[float, float, float], Vector("m")] = (0.0, 0.0, 0.0)
    axes: Literal["tip", "base"] = "tip"
    along_motion: Force = 0.0
    applied_by: Literal["tip", "surroundings"] = "tip"
    table: Array | None = None


@dataclass(frozen=True)
class Mount:
    """Where a drive is mounted on the arm.

    A study file may mount the drive of a coupled joint at the first joint of its group (``carrier: group``): on the
    link before that joint, along that joint's axis. It is read as ``parent`` with the index of that joint in ``joint``.

    Attributes:
        carrier: Link that holds the stator: ``parent`` (before the joint), ``child`` (after it) or ``base``.
        offset: Distance of the drive's centre of mass from the joint's point, along the joint axis [m].
        joint: Index of the joint to which ``carrier`` and ``offset`` refer if it is not the drive's own joint; None:
            the drive's own joint.
    """

    carrier: Carrier = "parent"
    offset: Length = 0.0
    joint: int | None = None


@dataclass(frozen=True, eq=False)
class ContainedDrive:
    """The drive that an arm's links already contain at one joint; its mass is removed before another drive is added.

    Attributes:
        mass: Mass of its motor and gear together [kg].
        mount: Where it is mounted.
    """

    mass: Mass
    mount: Mount = Mount()


@dataclass(frozen=True)
class FreeRatio:
    """Hypothetical gears of any ratio in a range, for early design: ideal gears, or scaled rows of a catalogue series.

    Attributes:
        low, high: Smallest and largest ratio [-].
        series: Series of the catalogue whose rows are scaled to the ratio; None: ideal gears.
        motor: Key of the motor; None: the motor of the joint's drive.
    """

    low: float
    high: float
    series: Name | None = None
    motor: Name | None = None


@dataclass(frozen=True)
class Stop:
    """The emergency stop, which may begin at any instant of the cycle, and how often it occurs.

    Attributes:
        current: Current with which the motor brakes [A], in the convention of the amplifier (dc, rms or peak); None:
            the amplifier's peak current.
        ramp: Time in which every joint speed decreases linearly to 0 [s]; None: the motor brakes with ``current``.
        rise: Time in which the braking current rises from 0 [s]; for stops without a ramp.
        stops_per_day: Number of emergency stops per day; None: the permitted number of momentary peaks is not checked.
        service_life: Service life of the arm [s]; None: the permitted number of momentary peaks is not checked.
        jam: Whether the gear must withstand a collision that blocks its output at full speed; false: the torque of such
            a jam is shown for information.
        power_off: Whether gears and holding brakes must withstand a loss of power at any instant; false if the supply
            is buffered until the arm is at rest, so that brakes engage only at rest.
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
        name: Name of the joint.
        drive: Keys of the given (motor, gear), or None; gear key "" is a direct drive.
        pairs: The (motor key, gear key) pairs that may be chosen, in a fixed order; empty when only a drive is given.
        passed_over: One text per table and rule on how many catalogue rows were excluded; shown in the report.
        mount: Where the drive is mounted.
        contained: The drive that the arm's links already contain here (``drive_mass: replaced`` only).
        friction: Friction at the joint, in addition to the friction of the gear.
        motor_friction: Friction at the motor shaft, which replaces the data sheet's no-load data; None: data sheet.
        amplifier: The amplifier of this joint; with several ``amplifiers``, one that allows what any of them allows.
        travel_per_turn: Travel of a prismatic joint per radian of the gear's output [m/rad]; None for a revolute joint.
        housing_to_ambient: Thermal resistance from the housing to ambient in the real mounting [K/W]; None: that of
            the data sheet.
        coupled: Names of the joints that the motor moves through a coupling with other motors; empty: it moves this
            joint alone. In a coupling, friction, speed and torque are those of the shaft behind the gear.
        rules: Candidate rules by which the pairs were found; None where the study file states none.
        output_bearing: What supports the tilting moment and the forces across the joint axis: the output bearing of the
            ``gear``, or an ``external`` one.
        gear_heat: Share of the gear's loss that warms the motor's housing; 0: the gear is mounted elsewhere.
        amplifier_heat: Share of the amplifier's loss that warms the motor's housing; 0: it is mounted elsewhere.
        load_inertia: In studies without an arm, the inertia at the gear's output [kg m^2]; the torque of the load
            table already includes its acceleration. None: not stated.
        stop: Emergency stop of this joint; its current as DC equivalent.
        free_ratio: Range of hypothetical gear ratios for early design; None: not requested.
        amplifiers: Candidate amplifiers, of which the first that satisfies all checks is chosen; empty: ``amplifier``.
        brakes: Candidate holding brakes, of which one is chosen; empty: the joint needs none. The key of a motor with a
            brake is ``MOTOR+BRAKE``.
        counterbalances: Torques on the link behind the joint that depend on the joint angle alone; their masses belong
            to the arm.
        staged: For a joint with stages behind its gear, the key of each gear combined with them, by the gear's own key
            ("" for a direct drive); empty: no stages.
        preload: Torque of this motor's gear in addition to half of the axis load where two motors share the axis
            [N m]; the second motor has the opposite sign. None: the motor does not share its axis.
        sharing: Names of the two motors that share the axis, this one included; empty: it does not share its axis.
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
    def axis_name(self) -> str:
        """Its own name, or that of the first of the two motors that share its axis."""
        return self.sharing[0] if self.sharing else self.name

    def constant_loss(self, motor: Motor, amplifier: Amplifier, current: float = 0.0) -> float:
        """Loss in the motor's housing beside those of motor and gear [W]: of a brake's coil, of an amplifier there.

        Args:
            motor: The motor with its brake.
            amplifier: Its amplifier.
            current: RMS current, for the amplifier's conduction loss [A].
        """
        lost = (amplifier.standby_power or 0.0) + float(conduction_loss(amplifier.on_resistance or 0.0, current))
        return (motor.brake.power or 0.0) + self.amplifier_heat * lost

    @property
    def choices(self) -> tuple[tuple[str, str], ...]:
        """The (motor key, gear key) pairs that may drive it: the given drive alone, or those that may be chosen."""
        return self.pairs if self.drive is None else (self.drive,)


@dataclass(frozen=True)
class Safety:
    """Safety factors on the required values, and the reserve below which a pass is MARGINAL.

    Attributes:
        peak_torque: Factor on gear and motor peak torque, peak current, and the torque's share of the motor voltage.
        rms: Factor on the RMS current.
        speed: Factor on speeds.
        voltage: Factor on the terminal voltage.
        reserve: A check that passes with utilisation above ``1 - reserve`` is MARGINAL.
        temperature_margin: Margin between the highest winding temperature and its limit [K].
        inertia_ratio: Largest permitted ratio of reflected load inertia to that of rotor, brake and gear input. An
            amplifier's manual may count the gear with the load, which is stricter. None: for information.
        life: Required life of gears and their output bearings [s]; None: for information.
        bearing_static_safety: Factor on the static load of an output bearing: usually 1.5, with shocks 2, for precision
            3.
        bearing_load_factor: Factor on the mean load in the life of an output bearing: up to 1.2 for smooth operation,
            usually up to 1.5, with shocks up to 3.
        brake: Factor on the torque that a holding brake must hold; B&R specifies 2 for the brakes of its 8JSA motors.
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
    """Required stiffness of the arm with elastic gears, at every instant of the cycle; None: no requirement.

    Attributes:
        first_resonance: Smallest permitted first natural frequency with the motors held fixed [Hz].
        tip_deviation: Largest permitted deflection of the tip under weight, payload and inertia [m].
        lost_motion: Largest permitted motion of the tip within the backlash of all gears [m].
        scatter: Share by which the stiffness of a gear may be below the value of its data sheet.
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
    """Values that the study assumes for gears of one kind where the data sheet gives none; None: no assumption.

    Attributes:
        efficiency: Output power over input power when the motor drives.
        backdriving_efficiency: Output power over input power when the load drives; None: computed from the same mesh
            friction.
        no_load_torque_share: No-load running torque at the input, as a share of continuous torque over ratio.
        source: Source of the assumed values.
    """

    efficiency: Efficiency | None = None
    backdriving_efficiency: Share | None = None
    no_load_torque_share: Share | None = None
    source: Name = ""


@dataclass(frozen=True)
class MotorAssumption:
    """Values that the study assumes for motors where the data sheet gives none; None: no assumption.

    Attributes:
        max_winding_temperature: Largest permitted winding temperature [C].
        winding_time_constant, housing_time_constant: Thermal time constants [s].
        winding_share: Share of the thermal resistance between winding and housing in the total from winding to ambient,
            where the data sheet gives the total alone; it splits the total before the study's ``housing_to_ambient``
            replaces the rest.
        source: Source of the assumed values.
    """

    max_winding_temperature: Temperature | None = None
    winding_time_constant: Duration | None = None
    housing_time_constant: Duration | None = None
    winding_share: Efficiency | None = None
    source: Name = ""


@dataclass(frozen=True)
class Prices:
    """The currency of all prices, and exchange rates from other currencies.

    Attributes:
        currency: Three-letter code; also the currency of the column ``price`` in catalogues. Empty: not stated, and
            only that column is used.
        rates: Value of one unit of each other currency in ``currency``, by three-letter code.
    """

    currency: Name = ""
    rates: dict[str, Factor] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Study:
    """Everything one job needs, in SI.

    Attributes:
        name, description: Name and free text of the study.
        path: The study file, as given.
        digest: SHA-256 over the study and all files it names.
        arm: The robot arm; None if a load table gives the torques.
        drive_mass: Whether the masses of the drives are added to the links or already in them; None without an arm.
        payloads: The payloads that the cycle names, in the order of ``cycle.payload_names``.
        forces: The forces at the tip that the cycle names; what they add up to is ``cycle.tip_wrench``.
        cycle: The repeated task.
        base: Given motion of the arm's base, at the samples of the cycle; None: the base is fixed.
        joints: One task per joint, in the arm's order.
        supply: DC supply of all amplifiers.
        ambient: Temperature around the drives [C].
        safety: Safety factors and reserves.
        stiffness: Required stiffness of the arm.
        holding: Motor torque used for heating while a gear holds a load at rest: ``least``, ``lossless`` or ``most`` of
            the torques at which mesh friction keeps the load at rest.
        gear_temperature: Temperature at which the drag of the gears is computed [C]; None: 20 C, or the ambient
            temperature if lower, as in a machine just switched on.
        cold_start: Temperature of gears and motors at which a cold start is checked in addition to the task [C]; None:
            not checked.
        gear_assumptions: Assumed values by gear kind.
        motor_assumptions: Assumed values by motor group: ``brushed``, ``brushless`` or ``frameless``.
        catalog: The rows that may be used.
        wanted: Objective and constraints of a selection.
        tolerances: Scatter of part data and loads about their nominal values.
        simulation: Effects and numerical settings of a simulation.
        trade_offs: What the report of a selection shows besides the best set.
        prices: Currency and exchange rates.
        notes: Warnings raised while reading (arm, motion, catalogue), for the report.
        document: The file or data that it was read from; None if the study was changed after reading.
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
    forces: tuple[ProcessForce, ...] = ()
    document: Document | None = field(default=None, init=False)

    def __repr__(self) -> str:
        arm = "a load table" if self.arm is None else f"arm {self.arm.name}"
        joints = f"{len(self.joints)} joint{'s' * (len(self.joints) > 1)}"
        return f"Study({self.name}: {arm}, {joints}, cycle of {self.cycle.duration:.4g} s{self.warned('notes')})"

    def warned(self, place: str) -> str:
        """Number of warnings in the notes as the end of a sentence, such as "; 2 warnings in .notes"; empty if none.

        Args:
            place: Name of the attribute in which the reader of the text finds the notes.
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
        """The study as the text of a study file that contains its arrays; ``load_study`` of it evaluates identically.

        Paths of other files in the text are relative to the current working directory.

        Raises:
            InputError: The study was changed after it was read, so there is no document to write.
        """
        if self.document is None:
            raise InputError(Fault("study", "was changed after it was read: only what was read can be written"))
        return written(replace(self.document, data={**self.document.data, "name": self.name}))

    def drag_temperature(self, ambient: Any) -> Any:
        """Temperature at which the drag of the gears is computed [C]: that of a machine that was just switched on.

        Data sheets give the drag at 20 C; colder ambient air makes the gear colder and its drag larger. Heating by
        losses and air above 20 C are ignored, because a warm gear has less drag: counting them would let poorer cooling
        or hotter air improve a verdict.

        Args:
            ambient: Ambient temperature [C], scalar or array.

        Returns:
            The study's ``gear_temperature`` if stated, otherwise the smaller of ``ambient`` and 20 C; same shape as
            ``ambient``.
        """
        if self.gear_temperature is None:
            return np.minimum(ambient, DRAG_REFERENCE)
        return np.full_like(ambient, self.gear_temperature, dtype=np.float64)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints in order."""
        return tuple(task.name for task in self.joints)

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
        """Unit of the objective; empty for a price without a stated currency, and for a weighted sum."""
        return {"mass": "kg", "energy": "J", "price": self.prices.currency}.get(self.objective, "")


def pair_name(motor: str, gear: str) -> str:
    """A motor and its gear (keys or names) as text; an empty gear stands for a direct drive, ``+STAGES`` for stages
    that the motor drives without a gear.
    """
    return f"{motor} with {gear.removeprefix('+') or 'no gear'}"


def gear_name(gear: str) -> str:
    """Text for a gear key in a table; the empty key is a direct drive, ``+STAGES`` are stages without a gear."""
    return gear.removeprefix("+") or "direct drive"


def refuse_moving_base(study: Study, what: str) -> None:
    """Raise InputError if the base of the study's arm moves, because ``what`` is not computed for a moving base."""
    if study.base is not None:
        raise InputError(Fault("base", f"moves as the study gives it, with which {what} is not computed"))
