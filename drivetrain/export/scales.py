"""What an amplifier takes a number for: amperes of some convention, per mille of a rated torque, volts, counts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.amplifier import CurrentBasis, from_dc, to_dc
from drivetrain.errors import Fault, Faults, InputError, by_whole_name, nearest
from drivetrain.sizing.results import Evaluation, JointResult

SCALES = ("amperes", "cia402", "analogue", "counts")
TORQUE = "torque"  # a base of CiA 402 beside the conventions of the current
WORD = 2**15 - 1  # largest number of signed 16 bits
ANALOGUE_VOLTS = 10.0


@dataclass(frozen=True)
class CurrentScale:
    """The numbers in which one joint's current is written."""

    unit: str  # of the numbers
    amperes: float  # DC-equivalent current of one unit [A]
    most: float  # largest magnitude that can be written; infinite: any
    whole: bool  # whether they are whole numbers
    base: str  # what the scale rests on, in words, with numbers


def current_scales(
    evaluation: Evaluation,
    scale: str,
    *,
    basis: str | None = None,
    full_scale: float | Mapping[str, float] | None = None,
) -> dict[str, CurrentScale]:
    """The scale of every joint's amplifier.

    Args:
        evaluation: Of the drives that are to be commanded.
        scale: ``amperes``; ``cia402``, per mille of the motor's rated torque as objects 0x6071 (target torque) and
            0x60B2 (torque offset) take it; ``analogue``, +-10 V; ``counts``, signed 16 bits.
        basis: What the amplifier's ampere is, ``dc``, ``rms`` or ``peak``; None: that of the joint's amplifier in the
            study. For ``cia402`` it is what object 0x6075 (motor rated current) holds, ``rms`` or ``peak``, as makers
            differ; or ``torque``, where the drive goes by the rated torque of object 0x6076 alone, which is what None
            means where the study's amplifiers are in ``dc``.
        full_scale: Current [A] in that basis at which 10 V or 32767 counts stand, None: the peak current of the
            amplifier, else of the motor; for ``cia402`` the rated current [A] or with ``torque`` the rated torque
            [N m], None: of the motor's sheet, else the amplifier's continuous current. One number, or one by joint
            name.

    Returns:
        By joint name.

    Raises:
        InputError: An unknown scale or basis, a joint whose full scale nobody states.

    Reference:
        CiA 402 (IEC 61800-7-201): target torque over 1000 is its share of the motor rated torque [mN m]. Drives
        command target/1000 of the rated current, as far as 0x6076 and 0x6075 are tied by the motor's torque constant.
    """
    faults: list[Fault] = []
    if scale not in SCALES:
        faults.append(Fault("scale", f"must be {', '.join(SCALES)}", scale, nearest(scale, SCALES)))
    bases = ("rms", "peak", TORQUE) if scale == "cia402" else ("dc", "rms", "peak")
    if basis is not None and basis not in bases:
        faults.append(Fault("basis", f"must be {', '.join(bases)}", basis, nearest(basis, bases)))
    given = dict(full_scale) if isinstance(full_scale, Mapping) else dict.fromkeys(evaluation.joints, full_scale)
    given = by_whole_name("full_scale", "joint of the study", given, evaluation.joints, faults)
    for name, value in given.items():
        if value is not None and not 0.0 < value < math.inf:
            faults.append(Fault(f"full_scale.{name}", "must be positive", value))
    if faults:
        raise InputError(faults)
    found, unknown = {}, Faults()
    for name, joint in evaluation.joints.items():
        used = basis or str(joint.amplifier.current_basis)
        used = TORQUE if scale == "cia402" and used == CurrentBasis.DC else used
        found[name] = unknown.attempt(_scale, joint, scale, used, given.get(name))
    unknown.raise_any()
    return {name: one for name, one in found.items() if one is not None}


def _scale(joint: JointResult, scale: str, basis: str, full: float | None) -> CurrentScale:
    if scale == "amperes":
        return CurrentScale(f"A {basis}", to_dc(1.0, basis), math.inf, False, f"amperes, {basis}")
    if scale == "cia402":
        return _per_mille(joint, basis, full)
    if full is None:
        peak = joint.amplifier.peak_current or joint.drive.motor.peak_current
        full = None if peak is None else from_dc(peak, CurrentBasis(basis))
    if full is None:
        place, problem = f"joints.{joint.name}.amplifier.peak_current", "is not known, and no full scale is given"
        raise InputError(Fault(place, problem, None, "state the current of the full scale [A]"))
    unit, most, whole = ("V", ANALOGUE_VOLTS, False) if scale == "analogue" else ("counts", float(WORD), True)
    return CurrentScale(unit, to_dc(full, basis) / most, most, whole, f"{most:g} {unit} are {full:.9g} A {basis}")


def _per_mille(joint: JointResult, basis: str, full: float | None) -> CurrentScale:
    """Of CiA 402: 1000 is the rated torque of object 0x6076."""
    motor, constant = joint.drive.motor, abs(joint.drive.motor.torque_constant)
    rated = motor.nominal_current or joint.amplifier.continuous_current
    if full is None and rated is not None:
        full = constant * rated if basis == TORQUE else from_dc(rated, CurrentBasis(basis))
    if full is None:
        place, hint = f"joints.{joint.name}: motor {motor.key}", "state the rated current [A] or torque [N m]"
        raise InputError(Fault(place, "has no nominal current in its row, and no full scale is given", hint=hint))
    current = full / constant if basis == TORQUE else to_dc(full, basis)
    words = f"1000 per mille are the rated torque, object 0x6076 = {1e3 * constant * current:.9g} mN m"
    if basis == TORQUE:
        words += f", which the drive turns into current by the torque constant {constant:.9g} N m/A dc"
    else:
        words += f", for which it gives the rated current, object 0x6075 = {1e3 * full:.9g} mA {basis}"
    return CurrentScale("per mille of rated torque", current / 1e3, float(WORD), True, words)


def in_scale(current: Array, scale: CurrentScale, joint: str, time: Array) -> Array:
    """Currents, DC equivalent [A], in the numbers of a scale; raises where it cannot say them."""
    numbers = current / scale.amperes
    numbers = np.rint(numbers) if scale.whole else numbers
    at = int(np.argmax(np.abs(numbers)))
    if not abs(numbers[at]) <= scale.most * (1.0 + 1e-12):
        problem = f"at {time[at]:.6g} s is beyond the +-{scale.most:g} {scale.unit} that can be written"
        hint = f"{scale.base}: a larger full scale makes room"
        raise InputError(Fault(f"current of {joint}", problem, f"{numbers[at]:.6g} {scale.unit}", hint))
    return numbers.astype(np.int64) if scale.whole else numbers
