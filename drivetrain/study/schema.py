"""The study file as a whole: what it may say, and its JSON Schema for editors."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, GetJsonSchemaHandler, model_validator
from pydantic_core import CoreSchema

from drivetrain.study import fields as f
from drivetrain.study.form import Form
from drivetrain.study.schema_coupling import CouplingForm
from drivetrain.study.schema_parts import AmplifierForm, AssumptionsForm, JointForm, SafetyForm, SupplyForm
from drivetrain.study.schema_rows import GearRow, MotorRow
from drivetrain.study.schema_selection import Objective, SelectionForm
from drivetrain.study.schema_simulation import SimulationForm
from drivetrain.study.schema_tolerances import TolerancesForm

SCHEMA_VERSION = 1
DEFAULT = "default"  # the entry of `joints` and of `motions` that holds where the others are silent


class ArmForm(Form):
    """The arm: the name of a built-in one or a .urdf or .xacro file; or a table of DH parameters."""

    source: f.Name | None = None
    dh: f.Name | None = Field(default=None, description="CSV file of DH parameters")
    convention: Literal["classic", "modified"] | None = None

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        if (self.source is None) == (self.dh is None):
            raise f.refused("must be a built-in arm, a .urdf file, or {dh: table.csv, convention: classic}")
        if self.dh is not None and self.convention is None:
            raise f.refused(
                "a DH table needs its convention: classic or modified",
                "classic (Paul) puts frame i at the far end of link i, modified (Craig) at its joint",
            )
        return self

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"anyOf": [{"type": "string"}, handler.resolve_ref_schema(handler(schema))]}


class InertiaForm(Form):
    """Inertia about the centre of mass, in axes parallel to the tip's."""

    xx: f.Inertia
    yy: f.Inertia
    zz: f.Inertia
    xy: f.InertiaProduct = 0.0
    xz: f.InertiaProduct = 0.0
    yz: f.InertiaProduct = 0.0


class PayloadForm(Form):
    """A body fixed to the tip; without inertia a point mass."""

    mass: f.Mass
    com: f.Position3 = (0.0, 0.0, 0.0)
    inertia: InertiaForm | None = None


class MotionForm(Form):
    """One motion: a file of joint positions, waypoints with a profile, or a table of torque and speed.

    The entry `default` is no motion: what it says of waypoints holds for every motion that does not say otherwise.
    """

    file: f.Name | None = Field(default=None, description="CSV file of joint positions over time")
    smoothing: Annotated[float, f.Quantity("s", minimum=0.0)] | None = Field(
        default=None, description="window for differentiating the file; 0 s: none; left out: as its resolution asks"
    )
    table: f.Name | None = Field(default=None, description="CSV file of torque and speed over time, without an arm")
    waypoints: list[Any] | None = Field(default=None, description="one row a waypoint, one value a joint")
    unit: f.Names | None = Field(default=None, description="of bare numbers in the waypoints, for all or one a joint")
    profile: Literal["trapezoid", "quintic", "s_curve"] | None = None
    speed: Any = Field(default=None, description="largest speed, for all joints or one each")
    acceleration: Any = Field(default=None, description="largest acceleration, for all joints or one each")
    jerk: Any = Field(default=None, description="largest jerk, for all joints or one each")
    durations: list[f.Duration] | None = Field(default=None, description="of each move; without, as fast as allowed")
    dwell: Any = Field(default=None, description="rest at each waypoint, one for all or a list")


class CycleForm(Form):
    """One step of the repeated task: a motion or a dwell."""

    motion: f.Name | None = None
    dwell: f.Duration | None = None
    repetitions: Annotated[int, Field(ge=1)] = 1
    payload: f.Name | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        if (self.motion is None) == (self.dwell is None):
            raise f.refused("must have one of: motion, dwell")
        return self


class MixForm(Form):
    """One part of a mix: a cycle that repeats by itself, and its share of the time of use."""

    name: f.Name | None = Field(default=None, description="in reports; default part 1 and so on")
    share: f.Share = Field(description="of the time of use; all parts together 100 %")
    cycle: Annotated[list[CycleForm], Field(min_length=1)]


def _arm(value: Any) -> Any:
    """`arm: ur5` is short for `arm: {source: ur5}`."""
    return {"source": value} if isinstance(value, str) else value


class StudyForm(Form):
    """A study: an arm or load tables, the repeated task, the electrics, and what may drive each joint."""

    schema_version: Literal[1]
    name: f.Name | None = None
    description: str = ""
    arm: Annotated[ArmForm | None, BeforeValidator(_arm)] = None
    tip: f.Name | None = Field(default=None, description="link of the arm's file that carries the payload")
    gravity: f.Acceleration3 | None = Field(default=None, description="in the base frame; default [0, 0, -9.81] m/s^2")
    coupling: list[CouplingForm] = Field(default_factory=list, description="joints whose motors work together")
    drive_mass: Literal["added", "included", "replaced"] | None = None
    payloads: dict[str, PayloadForm] = Field(default_factory=dict)
    motions: dict[str, MotionForm]
    cycle: list[CycleForm] | None = None
    mix: list[MixForm] | None = Field(default=None, description="instead of cycle: several, with shares of use")
    open_cycle: bool = Field(default=False, description="true: the task need not end where it starts")
    supply: SupplyForm
    amplifier: AmplifierForm = AmplifierForm()
    ambient: f.Temperature = 25.0
    safety: SafetyForm = SafetyForm()
    objective: Objective = "mass"
    selection: SelectionForm = SelectionForm()
    catalogs: f.Names = ("shipped",)
    motors: dict[str, MotorRow] = Field(default_factory=dict)
    gears: dict[str, GearRow] = Field(default_factory=dict)
    joints: dict[str, JointForm]
    assumptions: AssumptionsForm = AssumptionsForm()
    tolerances: TolerancesForm = TolerancesForm()
    simulation: SimulationForm = SimulationForm()


def json_schema() -> dict[str, Any]:
    """The JSON Schema of the study file, for completion and checks in editors.

    Returns:
        The schema, draft 2020-12, ready for ``json.dumps``.
    """
    schema = StudyForm.model_json_schema()
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **schema, "title": "drivetrain study"}
