"""The forms of a study file as a whole and of its parts, and its JSON Schema for editors.

A part that has a dataclass is read by ``Entry`` of it; a part whose entries in the file differ from the dataclass has a
form of its own here.
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import BeforeValidator, Field, GetJsonSchemaHandler, model_validator
from pydantic_core import CoreSchema

from drivetrain import units as f
from drivetrain.arm.closures import BASE, Closure, LoopLink
from drivetrain.arm.tool_moves import Move, ToolLimits
from drivetrain.arrays import Array
from drivetrain.drive.amplifier import Amplifier, CurrentBasis, Supply
from drivetrain.drive.counterbalance import Counterbalance
from drivetrain.drive.friction import Friction
from drivetrain.drive.stages import Stage
from drivetrain.motion.base import AXES, Swing
from drivetrain.motion.duty_cycle import Step
from drivetrain.study.form import AsForm, Entry, Form, Shaped, form_of
from drivetrain.study.model import (
    ContainedDrive,
    FreeRatio,
    GearAssumption,
    MotorAssumption,
    Mount,
    Payload,
    Prices,
    ProcessForce,
    Safety,
    StiffnessWish,
    Stop,
)
from drivetrain.study.parts.rules import BrakeRow, CandidatesForm, DriveForm, GearRow, MotorRow
from drivetrain.study.parts.selection import (
    CRITERIA,
    TERMS,
    UNITS,
    CurveWanted,
    SelectionOptions,
    read_criterion,
    read_curve,
)
from drivetrain.study.parts.simulation import Simulation
from drivetrain.study.parts.tolerances import Tolerances

SCHEMA_VERSION = 1
DEFAULT = "default"  # the entry of `joints` and of `motions` with values for all entries that state none


def about(description: str, default: Any = None) -> Any:
    """A field with a description, which a file may leave out."""
    return Field(default=default, description=description)


MountEntry = Annotated[Mount, AsForm(without=("joint",))]


class ArmForm(Form):
    """The arm: the name of a built-in one or a .urdf or .xacro file; or a table of DH parameters."""

    source: f.Name | None = None
    dh: f.Name | None = about("CSV file of DH parameters")
    convention: Literal["classic", "modified"] | None = None
    from_screws: dict[str, Any] | None = about(
        "bare numbers in SI by the names of Arm.from_screws: home, screws, masses, inertias"
    )

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if sum(one is not None for one in (self.source, self.dh, self.from_screws)) != 1:
            known = "a built-in arm, a .urdf file, {dh: table.csv, convention: classic}, or {from_screws: {...}}"
            raise f.refused(f"must be {known}")
        if self.dh is not None and self.convention is None:
            hint = "classic (Paul) puts frame i at the far end of link i, modified (Craig) at its joint"
            raise f.refused("a DH table needs its convention: classic or modified", hint)
        return self

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"anyOf": [{"type": "string"}, handler.resolve_ref_schema(handler(schema))]}


Product = Annotated[float, f.Quantity("kg m^2")]


class InertiaForm(Form):
    """Inertia about the centre of mass, in axes parallel to the tip's."""

    xx: f.Inertia
    yy: f.Inertia
    zz: f.Inertia
    xy: Product = 0.0
    xz: Product = 0.0
    yz: Product = 0.0

    def made(self, **_: Any) -> Array:
        """The tensor, (3, 3)."""
        return np.array([[self.xx, self.xy, self.xz], [self.xy, self.yy, self.yz], [self.xz, self.yz, self.zz]])


Point = Annotated[tuple[float, float, float], f.Vector("m")]
Angles = Annotated[tuple[float, float, float], f.Vector("rad")]


class PayloadForm(form_of(Payload, without=("name",))):  # type: ignore[misc]
    """A body fixed to the tip; without inertia a point mass."""

    com: Point = (0.0, 0.0, 0.0)
    inertia: InertiaForm | None = None


class ForceForm(form_of(ProcessForce, without=("name", "table"))):  # type: ignore[misc]
    """A force between the tip and its surroundings during steps of the cycle; constant, or from a file."""

    file: f.Name | None = about("CSV file of force and moment over the time since the beginning of the step")
    samples: str | None = about("the lines of such a CSV file, instead of its name")


Pure = Annotated[float, f.Quantity("")]


class AxisAngleForm(Form):
    """A rotation by an angle about an axis of the base."""

    axis: Annotated[tuple[float, float, float], f.Vector("")]
    angle: Annotated[float, f.Quantity("rad")]


class PoseForm(Form):
    """Position and orientation of the tool in the base frame; without a rotation it keeps the orientation before."""

    position: Point
    rpy: Angles | None = about("roll, pitch, yaw about the base's x, y, z, as in a URDF")
    quaternion: Annotated[list[Pure], Field(min_length=4, max_length=4)] | None = about("w, x, y, z")
    axis_angle: AxisAngleForm | None = None

    @model_validator(mode="after")
    def _one_rotation(self) -> Self:
        if sum(one is not None for one in (self.rpy, self.quaternion, self.axis_angle)) > 1:
            raise f.refused("must have at most one of: rpy, quaternion, axis_angle")
        if self.quaternion is not None and not any(self.quaternion):
            raise f.refused("quaternion must not be zero")
        if self.axis_angle is not None and not any(self.axis_angle.axis):
            raise f.refused("the axis must not be zero")
        return self


class MoveForm(form_of(Move, without=("kind", "target"))):  # type: ignore[misc]
    """One move: to joint positions, to a pose with the joints in step, or of the tool along a line or a circle."""

    joints: list[Any] | None = about("one value a joint")
    to: PoseForm | None = None
    line: PoseForm | None = None
    circle: PoseForm | None = about("the end of an arc that passes `via`")

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        if sum(getattr(self, kind) is not None for kind in ("joints", "to", "line", "circle")) != 1:
            raise f.refused("must have one of: joints, to, line, circle")
        return self


class ToolForm(form_of(ToolLimits)):  # type: ignore[misc]
    """Limits of the tool along lines and circles, and its pose on the arm's tip."""

    at: PoseForm | None = about("the tool's frame in the tip frame; default: the tip frame itself")


class MotionForm(Form):
    """One motion: a file of joint positions, waypoints or moves with a profile, or a table of torque and speed.

    The entry `default` is not a motion: its values apply to every motion with waypoints or moves that states no own.
    """

    file: f.Name | None = about("CSV file of joint positions over time")
    smoothing: Annotated[float, f.Quantity("s", minimum=0.0)] | None = about(
        "smoothing window for differentiating the file; 0 s: none; default: from the file's resolution"
    )
    table: f.Name | None = about("CSV file of torque and speed over time, without an arm")
    samples: str | None = about("the lines of such a CSV file, instead of its name")
    waypoints: list[Any] | None = about("one row a waypoint, one value a joint")
    start: list[Any] | None = about("joint positions before the first of `moves`")
    moves: list[MoveForm] | None = about("moves of joints and tool, in their order")
    tool: ToolForm | None = about("limits of the tool along lines and circles")
    unit: f.Names | None = about("unit of bare numbers in waypoints, start and joints: one for all, or one per joint")
    profile: Literal["trapezoid", "quintic", "s_curve"] | None = None
    speed: Any = about("largest speed, for all joints or one each")
    acceleration: Any = about("largest acceleration, for all joints or one each")
    jerk: Any = about("largest jerk, for all joints or one each")
    durations: list[f.Duration] | None = about("duration of each move; default: the shortest allowed")
    dwell: Any = about("rest at each waypoint, one for all or a list")


class HeaveForm(form_of(Swing)):  # type: ignore[misc]
    """A harmonic motion of the base along an axis of the ground."""

    amplitude: f.Length


class SwingForm(form_of(Swing)):  # type: ignore[misc]
    """A harmonic motion of the base about one of its axes."""

    amplitude: Annotated[float, f.Quantity("rad")]


class BaseForm(Form):
    """Given motion of the arm's base during the cycle: a motion of six joints, or harmonic swings as on a ship."""

    motion: MotionForm | None = about("motion of the joints base_x, base_y, base_z, base_yaw, base_pitch, base_roll")
    x: HeaveForm | None = None
    y: HeaveForm | None = None
    z: HeaveForm | None = None
    yaw: SwingForm | None = None
    pitch: SwingForm | None = None
    roll: SwingForm | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        if (self.motion is None) == all(getattr(self, axis) is None for axis in AXES):
            raise f.refused(f"must have either a motion, or swings by axis: {', '.join(AXES)}")
        return self


class CycleForm(form_of(Step, without=("name", "force"))):  # type: ignore[misc]
    """One step of the repeated task: a motion or a dwell."""

    motion: f.Name | None = None
    force: f.Name | None = about("force at the tip during the step")

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        if (self.motion is None) == (self.dwell is None):
            raise f.refused("must have one of: motion, dwell")
        return self


class MixForm(Form):
    """One part of a mix: a cycle that repeats by itself, and its share of the time of use."""

    name: f.Name | None = about("name in reports; default: part 1 and so on")
    share: f.Share = Field(description="share of the time of use; all parts together 100 %")
    cycle: Annotated[list[CycleForm], Field(min_length=1)]


_WANTS = {"differential": "turns", "belt": "passes"}


class CouplingForm(Form):
    """Joints with coupled motors: the angles of the gears' output shafts are linear combinations of the joint angles.

    The drive of each joint listed here turns the shaft at the same place of the list; its speed, torque and friction
    are those of that shaft.
    """

    joints: f.Names = Field(description="from the base towards the tip; their drives turn the shafts, in this order")
    type: Literal["differential", "belt"] | None = about(
        "differential: two shafts drive the first joint by turning together, the second by turning against "
        "each other; belt: all motors sit before the first joint, and drive theirs over wheels on the axes between"
    )
    turns: list[Pure] | None = about(
        "differential: turns of a shaft per turn of the first and of the second joint; default 1, 1"
    )
    passes: list[Pure] | None = about(
        "belt: output per input turn of the wheel on each axis but the last; -1: reversed; default 1 each"
    )
    matrix: list[list[Pure]] | None = about(
        "instead of a type: row i holds the turns of shaft i per turn of each joint"
    )

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if (self.type is None) == (self.matrix is None):
            raise f.refused("must have one of: type (differential or belt), matrix")
        for name in _WANTS.values():
            if getattr(self, name) is not None and _WANTS.get(self.type or "") != name:
                owner = next(kind for kind, wanted in _WANTS.items() if wanted == name)
                raise f.refused(f"{name} applies only to type: {owner}")
        return self


class AxisForm(form_of(LoopLink, without=("slides", "driven", "lower", "upper", "speed_limit"))):  # type: ignore[misc]
    """A body and the joint that connects it to the body before it; in the base frame, all joints at zero."""

    kind: Literal["revolute", "prismatic"] = "revolute"
    inertia: InertiaForm | None = about("about the centre of mass, in axes of the base")

    def made(self, **more: Any) -> LoopLink:
        link: LoopLink = super().made(slides=self.kind == "prismatic", **more)
        return link


class LoopLinkForm(AxisForm):
    """A body of a linkage and the joint that connects it to the body before it; in the base frame, joints at zero."""

    driven: bool = about("whether the joint has a drive", False)


class ExternalAxesForm(Form):
    """Driven axes that carry the arm, such as a track or a turntable, as its first joints; in the ground frame."""

    links: list[AxisForm] = Field(min_length=1, description="the body that each axis moves, from the ground upwards")
    point: Point = about("position of the arm's base, all joints at zero", (0.0, 0.0, 0.0))
    rpy: Angles = about(
        "orientation of the arm's base: roll, pitch, yaw about the fixed axes of the ground", (0.0, 0.0, 0.0)
    )


class ClosureForm(form_of(Closure)):  # type: ignore[misc]
    """A linkage between two links of the arm, which closes a loop; without links of its own, a pin between the two."""

    start: f.Name = about("link or joint of the arm to which the first link is connected", BASE)
    links: list[LoopLinkForm] = Field(default_factory=list, description="links of the linkage, beginning at `start`")


class FreeRatioForm(form_of(FreeRatio, without=("low", "high"))):  # type: ignore[misc]
    """A gear of any ratio in a range: ideal, or one of a series of the catalogue, scaled."""

    ratio: Annotated[f.Interval, f.Between("")]


class ContainedForm(form_of(ContainedDrive)):  # type: ignore[misc]
    """The drive that the arm's links already contain at a joint (drive_mass: replaced)."""

    mount: MountEntry = Field(default_factory=Mount)


class AmplifierForm(form_of(Amplifier, without=("price", "key", "source"))):  # type: ignore[misc]
    """Limits of an amplifier; current_basis states whether its currents are dc, rms or peak values of a sine."""

    current_basis: CurrentBasis | None = None
    modulation: f.Efficiency | None = about("largest share of the supply voltage at the terminals")


def _parts(value: Any) -> tuple[str, ...] | bool:
    """Keys of parts of the catalogue; true: all of them, false: none."""
    return value if isinstance(value, bool) else f.read_names(value)


_PARTS = {"anyOf": [{"type": "boolean"}, f.TEXT, {"type": "array", "items": f.TEXT}]}
Parts = Annotated[tuple[str, ...] | bool, f.Function(_parts, _PARTS)]


class JointForm(Form):
    """One joint: a given drive, or which catalogue rows may drive it; the entry `default` applies to all joints."""

    drive: DriveForm | None = None
    candidates: CandidatesForm | None = None
    free_ratio: FreeRatioForm | None = about("for `drivetrain free-ratio`")
    mount: MountEntry = Field(default_factory=Mount)
    contained: ContainedForm | None = None
    friction: Entry[Friction] = Friction()
    stages: tuple[Entry[Stage], ...] = about(
        "stages between gear and joint, in order: screw, belt, rack, worm, gear", ()
    )
    motors: Literal[1, 2] = about("2: two equal drives on the axis, each with half of the load", 1)
    preload: Annotated[float, f.Quantity("N m", minimum=0.0)] | None = about(
        "with two motors: torque by which one exceeds half of the load and the other falls below it, "
        "so that backlash is closed"
    )
    counterbalances: tuple[Entry[Counterbalance], ...] = about(
        "springs, gas springs and biases: torques on the link that depend on the joint angle alone", ()
    )
    motor_friction: Entry[Friction] | None = about(
        "friction at the motor shaft; replaces that of the motor's no-load data"
    )
    amplifier: Annotated[Parts | AmplifierForm, Shaped(dict | AmplifierForm)] = about(
        "limits of the amplifier; or a key, several keys, or true: any of the catalogue", AmplifierForm()
    )
    travel_per_turn: Annotated[float, f.Quantity("m/rad")] | None = about(
        "prismatic joints: travel per turn of the gear"
    )
    housing_to_ambient: f.ThermalResistance | None = about(
        "thermal resistance from the motor's housing to ambient in the real mounting"
    )
    amplifier_heat: f.Share = about(
        "share of the amplifier's loss that warms the motor's housing; 0 %: mounted elsewhere", 0.0
    )
    gear_heat: f.Share | None = about("share of the gear's loss that warms the motor's housing; default: the study's")
    output_bearing: Literal["gear", "external"] = about(
        "what supports tilting moment and forces of the joint: the gear's own bearing, or another one", "gear"
    )
    stop: Entry[Stop] | None = about("values of the study's stop that differ at this joint")
    brake: Parts = about("holding brake at the motor: a key, several keys, or true: any of the catalogue", False)
    load_inertia: f.Inertia | None = about(
        "without an arm: inertia at the gear's output, whose torque the load table already includes"
    )


class AssumptionsForm(Form):
    """What to assume where the data sheet gives no value: gears by kind; motors by brushed, brushless or frameless."""

    gears: dict[str, Annotated[GearAssumption, AsForm(needed=("source",))]] = Field(default_factory=dict)
    motors: dict[str, Annotated[MotorAssumption, AsForm(needed=("source",))]] = Field(default_factory=dict)


Weight = Annotated[float, f.Quantity("", minimum=0.0)]


class WeightsForm(Form):
    """Weights of a weighted objective, as pure numbers."""

    mass: Weight = about("weight of one kilogram of motors and gears", 0.0)
    price: Weight = about("weight of one unit of the catalogue's price", 0.0)
    energy: Weight = about("weight of one joule per cycle", 0.0)

    @model_validator(mode="after")
    def _something_counts(self) -> Self:
        if not any(getattr(self, name) for name in TERMS):
            raise f.refused("needs a weight above 0", f"for at least one of {', '.join(TERMS)}")
        return self


_SPAN = {"type": "string", "description": "a range such as 0 kg..8 kg"}
_MAPPING = {"type": "object", "properties": dict.fromkeys(UNITS, _SPAN), "maxProperties": 1}
_CURVE = {"anyOf": [{"type": "string", "enum": list(UNITS)}, f.TEXT, _MAPPING]}


def _listed(value: Any) -> Any:
    """Accept lists only, so that a fault states the expected form."""
    if not isinstance(value, list | tuple):
        raise f.refused("must be a list", "such as [mass, energy] for front, [payload, cycle_time] for curves")
    return value


Criterion = Annotated[str, f.Function(read_criterion, {"type": "string", "enum": list(CRITERIA)})]
Criteria = Annotated[tuple[Criterion, ...], BeforeValidator(_listed)]
Curves = Annotated[tuple[Annotated[CurveWanted, f.Function(read_curve, _CURVE)], ...], BeforeValidator(_listed)]


class SelectionForm(form_of(SelectionOptions, without=("weights",))):  # type: ignore[misc]
    """Constraints and time limit of a selection, and what is reported besides the best set."""

    front: Criteria = about("criteria of a Pareto front in the report, such as [mass, energy]", ())
    curves: Curves = about("curves of the best drives over payload, cycle_time, voltage or ambient in the report", ())


def _arm(value: Any) -> Any:
    """`arm: ur5` is short for `arm: {source: ur5}`."""
    return {"source": value} if isinstance(value, str) else value


class StudyForm(Form):
    """A study: an arm or load tables, the repeated task, the electrics, and what may drive each joint."""

    assumed_limits: ClassVar[dict[str, Any]] = {
        "schema_version": 1,
        "motions": {},
        "supply": {"voltage": "1 V"},
        "joints": {},
    }

    schema_version: Literal[1]
    name: f.Name | None = None
    description: str = ""
    arm: Annotated[ArmForm | None, BeforeValidator(_arm)] = None
    tip: f.Name | None = about("link of the arm's file that carries the payload")
    gravity: Annotated[tuple[float, float, float], f.Vector("m/s^2")] | None = about(
        "gravitational acceleration in the base frame; default [0, 0, -9.81] m/s^2"
    )
    external_axes: ExternalAxesForm | None = about("a track or a turntable under the arm")
    coupling: list[CouplingForm] = Field(
        default_factory=list, description="joints whose motors drive them together (differentials, belts)"
    )
    closures: list[ClosureForm] = Field(default_factory=list, description="linkages that close loops in the arm")
    passive: f.Names = about("joints of the arm that have no drive and follow the closures", ())
    base: BaseForm | None = about("given motion of the arm's base")
    drive_mass: Literal["added", "included", "replaced"] | None = None
    payloads: dict[str, PayloadForm] = Field(default_factory=dict)
    forces: dict[str, ForceForm] = Field(
        default_factory=dict, description="forces between the tip and its surroundings, which steps of the cycle name"
    )
    motions: dict[str, MotionForm]
    cycle: list[CycleForm] | None = None
    mix: list[MixForm] | None = about("instead of cycle: several cycles, each with its share of the time of use")
    open_cycle: bool = about("true: the task need not end where it starts", False)
    supply: Entry[Supply]
    amplifier: AmplifierForm = AmplifierForm()
    ambient: f.Temperature = 25.0
    safety: Entry[Safety] = Safety()
    holding: Literal["least", "lossless", "most"] = about(
        "motor torque used for heating while mesh friction of a gear helps to hold a load at rest", "lossless"
    )
    stop: Entry[Stop] = Stop()
    gear_heat: f.Share = about("share of each gear's loss that warms its motor's housing; 0 %: mounted elsewhere", 1.0)
    gear_temperature: f.Temperature | None = about(
        "temperature at which the gears' drag is computed; default: 20 degC, or the ambient if colder"
    )
    cold_start: f.Temperature | None = about(
        "temperature of gears and motors at which torque, current and voltage of a cold start are checked"
    )
    stiffness: Entry[StiffnessWish] = StiffnessWish()
    objective: Annotated[Literal["mass", "price", "energy"] | WeightsForm, Shaped(dict | WeightsForm)] = "mass"
    selection: SelectionForm = SelectionForm()
    catalogs: f.Names = ("shipped",)
    motors: dict[str, MotorRow] = Field(default_factory=dict)
    gears: dict[str, GearRow] = Field(default_factory=dict)
    brakes: dict[str, BrakeRow] = Field(default_factory=dict)
    joints: dict[str, JointForm]
    assumptions: AssumptionsForm = AssumptionsForm()
    prices: Annotated[Prices, AsForm(needed=("currency",))] | None = about(
        "currency of all prices; parts without one take theirs from prices.csv"
    )
    tolerances: Entry[Tolerances] = Tolerances()
    simulation: Entry[Simulation] = Simulation()


def json_schema() -> dict[str, Any]:
    """The JSON Schema of the study file, for completion and checks in editors.

    Returns:
        The schema, draft 2020-12, ready for ``json.dumps``.
    """
    schema = StudyForm.model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": "drivetrain study"}
