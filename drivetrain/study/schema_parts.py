"""What the parts of a study file may say: drives, candidates, mounting, friction, electrics, assumptions."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from drivetrain.study import fields as f
from drivetrain.study.form import Form
from drivetrain.study.schema_free_ratio import FreeRatioForm

CurrentBasis = Literal["dc", "rms", "peak"]
Carrier = Literal["parent", "child", "base", "group"]


class SupplyForm(Form):
    """The one supply behind all amplifiers."""

    voltage: f.Voltage
    peak_power: f.Power | None = Field(default=None, description="limit over all joints together")
    mean_power: f.Power | None = Field(default=None, description="limit over all joints together")
    regenerated_power: f.Power | None = Field(
        default=None, description="mean power it takes back or burns in a resistor"
    )


class AmplifierForm(Form):
    """Limits of an amplifier; current_basis says whether its ampere is dc, rms or peak of a sine."""

    current_basis: CurrentBasis | None = None
    peak_current: f.Current | None = None
    continuous_current: f.Current | None = None
    modulation: f.Efficiency | None = Field(
        default=None, description="largest share of the supply voltage at the terminals"
    )


class SafetyForm(Form):
    """Factors on what is required, and the reserve below which a pass is marginal."""

    peak_torque: f.Factor = 1.0
    rms: f.Factor = 1.0
    speed: f.Factor = 1.0
    voltage: f.Factor = 1.0
    reserve: f.Share = 0.1
    temperature_margin: f.TemperatureStep = 0.0
    inertia_ratio: f.Factor | None = None
    life: f.Duration | None = None


class MountForm(Form):
    """Where a drive sits: on the link before the joint (parent), after it (child), or on the base.

    A drive of coupled joints may sit where its group begins (group): on the link before the first joint of them, at and
    along that joint's axis.
    """

    carrier: Carrier = "parent"
    offset: f.Length = 0.0


class ContainedForm(Form):
    """The drive that the arm's links already hold at a joint (drive_mass: replaced)."""

    mass: f.Mass
    mount: MountForm = MountForm()


class FrictionForm(Form):
    """A friction law at one shaft; all values positive, the negative direction only where it differs."""

    coulomb: f.Torque = 0.0
    coulomb_negative: f.Torque | None = None
    viscous: f.ViscousFriction = 0.0
    viscous_negative: f.ViscousFriction | None = None
    static: f.Torque | None = None
    stribeck_speed: f.Speed | None = None
    stribeck_exponent: f.Factor = 2.0


class DriveForm(Form):
    """A given drive: keys of the catalogue or of the file's own rows; gear: none is a direct drive."""

    motor: f.Name
    gear: f.Name


class MotorFilter(Form):
    """Which motors may be considered; every line must hold."""

    keys: f.Names | None = None
    maker: f.Names | None = None
    series: f.Names | None = None
    kind: f.Names | None = None
    frameless: bool | None = None
    nominal_voltage: Annotated[f.Interval, f.Between("V")] | None = None
    nominal_torque: Annotated[f.Interval, f.Between("N m")] | None = None
    mass: Annotated[f.Interval, f.Between("kg")] | None = None
    diameter: Annotated[f.Interval, f.Between("m")] | None = None
    length: Annotated[f.Interval, f.Between("m")] | None = None


class GearFilter(Form):
    """Which gears may be considered; every line must hold."""

    keys: f.Names | None = None
    maker: f.Names | None = None
    series: f.Names | None = None
    kind: f.Names | None = None
    ratio: Annotated[f.Interval, f.Between("")] | None = None
    size: Annotated[f.Interval, f.Between("")] | None = None
    stages: Annotated[f.Interval, f.Between("")] | None = None
    continuous_torque: Annotated[f.Interval, f.Between("N m")] | None = None
    backlash: Annotated[f.Interval, f.Between("rad")] | None = None
    mass: Annotated[f.Interval, f.Between("kg")] | None = None
    diameter: Annotated[f.Interval, f.Between("m")] | None = None
    length: Annotated[f.Interval, f.Between("m")] | None = None


class FramelessRuleForm(Form):
    """Changes to the rule that says which frameless motor fits around which gear."""

    max_diameter_ratio: f.Factor | None = None
    min_diameter_ratio: f.Factor | None = None
    kinds: f.Names | None = None


class JointForm(Form):
    """One joint: a given drive, or which catalogue rows may drive it; `default` holds for all joints."""

    drive: DriveForm | None = None
    candidates: CandidatesForm | None = None
    free_ratio: FreeRatioForm | None = Field(default=None, description="for `drivetrain free-ratio`")
    mount: MountForm = MountForm()
    contained: ContainedForm | None = None
    friction: FrictionForm = FrictionForm()
    motor_friction: FrictionForm | None = Field(
        default=None, description="replaces what the motor's no-load data imply"
    )
    amplifier: AmplifierForm = AmplifierForm()
    travel_per_turn: f.TravelPerTurn | None = Field(
        default=None, description="prismatic joints: travel per turn of the gear"
    )
    housing_to_ambient: f.ThermalResistance | None = Field(default=None, description="of the real mounting")
    load_inertia: f.Inertia | None = Field(
        default=None, description="without an arm: what the gear turns, already in the table's torque"
    )


class GearAssumptionForm(Form):
    """What to assume of gears of one kind where the sheet is silent, and why."""

    efficiency: f.Efficiency | None = None
    backdriving_efficiency: f.Share | None = None
    no_load_torque_share: f.Share | None = None
    source: f.Name


class MotorAssumptionForm(Form):
    """What to assume of motors of one kind where the sheet is silent, and why."""

    max_winding_temperature: f.Temperature | None = None
    winding_time_constant: f.Duration | None = None
    housing_time_constant: f.Duration | None = None
    source: f.Name


class AssumptionsForm(Form):
    """What to assume where a sheet is silent: gears by kind; motors by brushed, brushless or frameless."""

    gears: dict[str, GearAssumptionForm] = Field(default_factory=dict)
    motors: dict[str, MotorAssumptionForm] = Field(default_factory=dict)


def _none_or_filter(value: Any) -> str:
    return "<none>" if isinstance(value, str) else "<filter>"


def _list_or_word(value: Any) -> str:
    return "<list>" if isinstance(value, list) else "<word>"


class CandidatesForm(Form):
    """Which motors and gears may drive a joint, and how they are paired; gears: none are direct drives."""

    motors: MotorFilter = MotorFilter()
    gears: Annotated[
        Annotated[Literal["none"], Tag("<none>")] | Annotated[GearFilter, Tag("<filter>")],
        Discriminator(_none_or_filter),
    ] = GearFilter()
    pairs: Annotated[
        Annotated[Literal["compatible", "published", "all"], Tag("<word>")] | Annotated[list[DriveForm], Tag("<list>")],
        Discriminator(_list_or_word),
    ] = "compatible"
    frameless_rule: FramelessRuleForm = FramelessRuleForm()


JointForm.model_rebuild()
