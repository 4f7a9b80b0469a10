"""Stages between gear and joint: screws, belts, racks, worm gears, one or several in series.

``chained`` combines stages into one, and ``with_stages`` combines it with a gear into an equivalent gear at the joint:
ratio, torques and stiffness at the joint, losses by direction of power, inertia at the motor. All laws of a gear apply
to it.

Formulas: efficiency and self-locking of screws and worms, tan(l)/tan(l + r) and tan(l - r)/tan(l), r the angle of
friction: Budynas and Nisbett, Shigley's Mechanical Engineering Design (9th edition, 2011), sections 8-2 (power screws)
and 13-17 (worm gears), the flank's angle counted in the coefficient. Buckling pi^2 E I/(k L)^2: the same, equation 4-43
and table 4-2 with C = 1/k^2, whose 2 for fixed and supported ends is 2.0457 here: k = pi/4.493409, tan x = x. Whirling
of an even shaft at its first bending frequency (l/L)^2 sqrt(E I/(rho A)): Rao, Mechanical Vibrations (5th edition,
2011), section 8.5, boundary conditions; Thomson, Theory of Vibration, table 9.5-1: l^2 is 3.52, 9.87, 15.4, 22.4.
Makers of screws take 0.8 of it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Literal

from drivetrain.drive.gear import Gear
from drivetrain.drive.ranges import EFFICIENCY, NOT_NEGATIVE, POSITIVE, Range, range_faults
from drivetrain.errors import Fault, InputError, raise_faults
from drivetrain.units import Efficiency, Quantity

STEEL_MODULUS, STEEL_DENSITY = 2.06e11, 7850.0  # Pa, kg/m^3
WHIRLING_SHARE = 0.8
ENDS = {
    "fixed-free": (2.0, 1.875104),
    "supported-supported": (1.0, math.pi),
    "fixed-supported": (0.699156, 3.926602),
    "fixed-fixed": (0.5, 4.730041),
}
"""By the bearings at the ends of a screw: buckling length over length, and the first root of the bending vibration."""

_RANGES = {
    "efficiency": EFFICIENCY,
    "backdriving_efficiency": Range("must be above -1 and at most 1", -1.0, 1.0),
    "friction": NOT_NEGATIVE,
    "ratio": POSITIVE,
    "lead": POSITIVE,
    "lead_angle": Range("must be greater than 0 and below 90 degrees", 0.0, 1.5707),
    "diameter": POSITIVE,
    "root_diameter": POSITIVE,
    "length": POSITIVE,
    "buckling_safety": POSITIVE,
    "diameter_speed": POSITIVE,
    "force_limit": POSITIVE,
    "teeth_in_mesh": POSITIVE,
    "tooth_force": POSITIVE,
    "torque_limit": POSITIVE,
    "speed_limit": POSITIVE,
    "inertia": NOT_NEGATIVE,
    "stiffness": POSITIVE,
    "axial_stiffness": POSITIVE,
    "mass": NOT_NEGATIVE,
    "price": NOT_NEGATIVE,
}


@dataclass(frozen=True)
class Stage:
    """One stage between gear and joint; a screw, a rack, or a belt without ratio drives a prismatic joint.

    Attributes:
        type: Kind of stage.
        efficiency: Power out over power in when the gear drives; None: from ``friction``.
        backdriving_efficiency: Power out over power in when the load drives, below 0 where the stage is self-locking;
            None: that of the same friction.
        friction: Friction coefficient at the thread or the worm, divided by the cosine of the flank angle.
        ratio: Input turns per output turn, of a gear, worm or belt.
        lead: Lead of a screw [m/rad].
        lead_angle: Lead angle of a worm [rad].
        diameter: Pitch diameter of a screw (ball centres), of the last pulley or of the pinion [m].
        root_diameter: Root diameter of a screw [m].
        length: Length of a screw between its bearings, or from bearing to nut [m].
        ends: Bearings at the ends of a screw.
        buckling_safety: Safety factor against buckling of a screw.
        diameter_speed: Largest product of diameter and speed of a screw, its DN value [m rad/s].
        force_limit: Largest force along a screw, at the teeth of a rack, or in a belt [N].
        teeth_in_mesh: Number of belt teeth in mesh on the smaller pulley.
        tooth_force: Largest force per belt tooth [N].
        torque_limit: Largest output torque [N m].
        speed_limit: Largest input speed [rad/s].
        inertia: Inertia at the input [kg m^2]; None for a screw: that of a steel rod with the mean of root and pitch
            diameter, as the thread fills about half of the ring between them, or with the only one that is stated.
        stiffness: Torsional stiffness at the output with the input held [N m/rad].
        axial_stiffness: Stiffness of screw, rack or belt along the slide [N/m]; None for a screw: that of a steel rod
            fixed at one end.
        mass: Mass [kg].
        price: Price, in the currency of the study.
        source: Source of these values.
    """

    type: Literal["gear", "worm", "belt", "screw", "rack"]
    efficiency: Efficiency | None = None
    backdriving_efficiency: Annotated[float, Quantity("")] | None = None
    friction: Annotated[float, Quantity("")] | None = None
    ratio: Annotated[float, Quantity("")] | None = None
    lead: Annotated[float, Quantity("m/rad")] | None = None
    lead_angle: Annotated[float, Quantity("rad")] | None = None
    diameter: Annotated[float, Quantity("m")] | None = None
    root_diameter: Annotated[float, Quantity("m")] | None = None
    length: Annotated[float, Quantity("m")] | None = None
    ends: Literal["fixed-free", "supported-supported", "fixed-supported", "fixed-fixed"] = "supported-supported"
    buckling_safety: Annotated[float, Quantity("")] = 2.0
    diameter_speed: Annotated[float, Quantity("m rad/s")] | None = None
    force_limit: Annotated[float, Quantity("N")] | None = None
    teeth_in_mesh: Annotated[float, Quantity("")] | None = None
    tooth_force: Annotated[float, Quantity("N")] | None = None
    torque_limit: Annotated[float, Quantity("N m")] | None = None
    speed_limit: Annotated[float, Quantity("rad/s")] | None = None
    inertia: Annotated[float, Quantity("kg m^2")] | None = None
    stiffness: Annotated[float, Quantity("N m/rad")] | None = None
    axial_stiffness: Annotated[float, Quantity("N/m")] | None = None
    mass: Annotated[float, Quantity("kg")] = 0.0
    price: Annotated[float, Quantity("")] = 0.0
    source: str = ""

    def __post_init__(self) -> None:
        faults = range_faults("stage", self, _RANGES)
        needs: tuple[str, ...] = {
            "screw": ("lead",), "rack": ("diameter",), "gear": ("ratio",), "worm": ("ratio",),
            "belt": ("diameter",) if self.ratio is None else ("ratio",),
        }[self.type]  # fmt: skip
        if self.efficiency is None:
            needs += {"screw": ("friction", "diameter"), "worm": ("friction", "lead_angle")}.get(
                self.type, ("efficiency",)
            )
        if self.tooth_force is not None or (self.force_limit is not None and self.type != "screw"):
            needs += ("diameter",)
        for name in needs:
            if getattr(self, name) is None:
                faults.append(Fault(f"stage.{name}", f"is needed for a {self.type}"))
        raise_faults(faults)

    @property
    def travel(self) -> float | None:
        """Travel of a prismatic joint per radian of the stage's input [m/rad]; None where the output turns."""
        if self.type == "screw":
            return self.lead
        slides = self.type == "rack" or (self.type == "belt" and self.ratio is None)
        return 0.5 * (self.diameter or 0.0) if slides else None

    @property
    def factors(self) -> tuple[float, float]:
        """Input torque over output torque relative to a lossless stage, when the gear drives and when the load drives
        (0 or less: self-locking).
        """
        if self.efficiency is not None:
            loss = 1.0 / self.efficiency - 1.0
            back = 1.0 - loss if self.backdriving_efficiency is None else self.backdriving_efficiency
            return 1.0 + loss, back
        if self.type == "screw":
            lead_angle = math.atan(2.0 * (self.lead or 0.0) / (self.diameter or 1.0))
        else:
            lead_angle = self.lead_angle or 0.0
        rubbing = math.atan(self.friction or 0.0)
        back = math.tan(lead_angle - rubbing) / math.tan(lead_angle)
        if self.backdriving_efficiency is not None:
            back = self.backdriving_efficiency
        return math.tan(lead_angle + rubbing) / math.tan(lead_angle), back

    @property
    def rod(self) -> tuple[float, float] | None:
        """Length and root diameter of a screw as a steel rod [m]."""
        known = self.type == "screw" and self.length is not None and self.root_diameter is not None
        return (self.length, self.root_diameter) if known else None  # type: ignore[return-value]

    @property
    def torque_limits(self) -> dict[str, float]:
        """Torque limits at the output, or at the input of a stage that drives a prismatic joint [N m], by the limiting
        part.
        """
        found, arm = {}, self.travel or 0.5 * (self.diameter or 0.0)
        if self.torque_limit is not None:
            found["torque"] = self.torque_limit
        if self.force_limit is not None:
            found["force"] = self.force_limit * arm
        if self.tooth_force is not None:
            found["teeth in mesh"] = self.tooth_force * (self.teeth_in_mesh or 1.0) * arm
        if self.rod is not None:
            length, diameter = self.rod
            section = math.pi * diameter**4 / 64.0
            force = math.pi**2 * STEEL_MODULUS * section / (ENDS[self.ends][0] * length) ** 2
            found["buckling"] = force / self.buckling_safety * arm
        return found

    @property
    def speed_limits(self) -> dict[str, float]:
        """Limits of the input speed [rad/s], by the limiting part."""
        found = {}
        if self.speed_limit is not None:
            found["speed"] = self.speed_limit
        if self.diameter_speed is not None and self.diameter is not None:
            found["DN value"] = self.diameter_speed / self.diameter
        if self.rod is not None:
            length, diameter = self.rod
            bending = (ENDS[self.ends][1] / length) ** 2 * diameter / 4.0 * math.sqrt(STEEL_MODULUS / STEEL_DENSITY)
            found["whirling"] = WHIRLING_SHARE * bending
        return found

    @property
    def input_inertia(self) -> float:
        """Inertia at the input [kg m^2]."""
        diameters = [one for one in (self.root_diameter, self.diameter) if one is not None]
        if self.inertia is None and self.type == "screw" and self.length is not None and diameters:
            return math.pi / 32.0 * STEEL_DENSITY * self.length * (sum(diameters) / len(diameters)) ** 4
        return self.inertia or 0.0

    @property
    def compliance(self) -> float:
        """Compliance at the output, or at the input if it drives a prismatic joint [rad/(N m)]; 0 if unknown."""
        axial, found = self.axial_stiffness, 0.0 if self.stiffness is None else 1.0 / self.stiffness
        if axial is None and self.rod is not None:
            length, diameter = self.rod
            axial = STEEL_MODULUS * math.pi / 4.0 * diameter**2 / length
        if axial is not None and self.travel:
            found += 1.0 / (axial * self.travel**2)
        return found


@dataclass(frozen=True)
class Chain:
    """Several stages in series, combined.

    Attributes:
        name: Types of the stages, in order.
        ratio: Turns of the gear's output for one unit of the joint coordinate.
        travel: Travel of a prismatic joint per radian of the last stage's input [m/rad]; None for a revolute joint.
        driving, driven: Torque at the gear over torque at the joint relative to lossless stages, when the gear drives
            and when the load drives.
        inertia: Inertia at the gear's output [kg m^2].
        compliance: Compliance at the joint [rad/(N m)].
        carried: Sum over the stages of inertia times the compliance before it, both at the joint [s^2].
        torque, torque_words: Torque limit at the joint [N m] and the limiting part; None: unknown.
        speed, speed_words: Speed limit of the joint [rad/s], and its reason; None: unknown.
        mass, price: Mass [kg] and price, in the currency of the study.
    """

    name: str
    ratio: float
    travel: float | None
    driving: float
    driven: float
    inertia: float
    compliance: float
    carried: float
    torque: float | None
    torque_words: str
    speed: float | None
    speed_words: str
    mass: float
    price: float


def chained(stages: Sequence[Stage]) -> Chain:
    """Combine several stages in series.

    Args:
        stages: In order from the gear to the joint; only the last one may drive a prismatic joint.

    Returns:
        The combined stages; of several limits the lowest one as seen at the joint.

    Raises:
        InputError: There are no stages, or a stage that drives a prismatic joint is not the last one.
    """
    if not stages:
        raise InputError(Fault("stages", "needs at least one stage"))
    for k, one in enumerate(stages[:-1]):
        if one.travel is not None:
            raise InputError(Fault(f"stages[{k}]", "moves a slide, so nothing can stand behind it", one.type))
    whole = math.prod(one.ratio or 1.0 for one in stages if one.travel is None)
    ratio, inertia, compliance, carried, driving, driven = 1.0, 0.0, 0.0, 0.0, 1.0, 1.0
    torques, speeds = list[tuple[float, str]](), list[tuple[float, str]]()
    for one in stages:
        inertia += one.input_inertia / ratio**2
        carried += one.input_inertia * (whole / ratio) ** 2 * compliance
        speeds += [(limit * ratio / whole, f"{why} of the {one.type}") for why, limit in one.speed_limits.items()]
        ratio *= 1.0 if one.travel is not None else one.ratio or 1.0
        behind = whole / ratio  # output turns of the stage per turn of the joint
        torques += [(limit * behind, f"{why} of the {one.type}") for why, limit in one.torque_limits.items()]
        compliance += one.compliance / behind**2
        forward, back = one.factors
        driving, driven = driving * forward, back * (driven if back > 0.0 else driving)
    torque, torque_words = min(torques, default=(None, ""))
    speed, speed_words = min(speeds, default=(None, ""))
    return Chain(
        "+".join(one.type for one in stages), whole, stages[-1].travel, driving, driven, inertia, compliance, carried,
        torque, torque_words, speed, speed_words, sum(one.mass for one in stages), sum(one.price for one in stages),
    )  # fmt: skip


def with_stages(gear: Gear, chain: Chain) -> Gear:
    """Combine a gear and the stages behind it into an equivalent gear at the joint.

    Args:
        gear: The gear that drives the first stage; ``NO_GEAR`` if the motor drives it directly.
        chain: The stages, from ``chained``.

    Returns:
        The equivalent gear with key ``GEAR+STAGES``: ratio, torques and stiffness at the joint, losses by direction of
        power.
    """

    def times(factor: float, *names: str) -> dict[str, float]:
        return {name: factor * value for name in names if (value := getattr(gear, name)) is not None}

    stiff = {
        name: 1.0 / (1.0 / (chain.ratio**2 * slope) + chain.compliance)
        for name in ("stiffness_1", "stiffness_2", "stiffness_3")
        if (slope := getattr(gear, name)) is not None
    }
    if gear.direct and chain.compliance > 0.0:
        stiff = dict.fromkeys(("stiffness_1", "stiffness_2", "stiffness_3"), 1.0 / chain.compliance)
    torques = times(
        chain.ratio, "ratio", "continuous_torque", "average_torque_limit", "repeated_peak_torque", "momentary_torque",
        "ratcheting_torque", "buckling_torque", "torque_1", "torque_2",
    )  # fmt: skip
    words = f"{gear.source}; behind it {chain.name}, torques and stiffness at the joint" if gear.source else chain.name
    price = chain.price if gear.direct else None if gear.price is None else gear.price + chain.price
    mass = chain.mass if gear.direct else None if gear.mass is None else gear.mass + chain.mass
    inertia = chain.inertia / gear.ratio**2
    known = 0.0 if gear.kind == "ideal" and gear.inertia is None else gear.inertia
    # w^-2 of the first resonance is at most the sum of each inertia times the compliance before it (Dunkerley).
    before = 0.0 if gear.stiffness_1 is None else 1.0 / (chain.ratio**2 * gear.stiffness_1)
    moved, whole = chain.inertia * chain.ratio**2 * before + chain.carried, before + chain.compliance
    changed = {**torques, **stiff, **times(1.0 / chain.ratio, "backlash")}
    return replace(  # type: ignore[arg-type]
        gear, key=f"{gear.key}+{chain.name}", source=words, stage_driving=chain.driving, stage_driven=chain.driven,
        stage_inertia=inertia, stage_mass=chain.mass, stage_sprung=moved / whole if whole else 0.0,
        inertia=None if known is None else known + inertia,
        stage_torque=chain.torque, stage_speed=chain.speed,
        stage_words=(chain.torque_words, chain.speed_words), staged=1.0, price=price, mass=mass, **changed,
    )  # fmt: skip
