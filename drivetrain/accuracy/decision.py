"""The decision quantities of a recording: currents, torque, heat and deviation of every joint, and the checks."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.kinematics import tip_pose
from drivetrain.arrays import Array
from drivetrain.drive.drive import resting
from drivetrain.drive.motor import Motor, torque_constant
from drivetrain.drive.thermal.heat import Mix, PeriodicTemperature, mixed_temperature_of_current
from drivetrain.dynamics.closed import main_chain
from drivetrain.effects.motor.winding_heat import WindingHeat
from drivetrain.motion.duty_cycle import sample_weights
from drivetrain.simulation.cost_results import Change, Decision, JointDecision
from drivetrain.simulation.recording import Recording
from drivetrain.simulation.scene import Scene
from drivetrain.sizing.judge.judge import utilisation
from drivetrain.sizing.judge.verdicts import judged
from drivetrain.sizing.results import Evaluation
from drivetrain.study.parts.verdicts import Check


@dataclass(frozen=True, eq=False)
class Basis:
    """The data, besides a recording, from which its decision quantities are computed."""

    motors: Mapping[str, Motor]  # data sheets by joint name
    heats: Mapping[str, WindingHeat]  # heating by joint name; a joint without one has no temperature
    evaluation: Evaluation | None = None  # of the study; None: no checks
    period: float | None = None  # of the repeated cycle, of which the last is judged [s]; None: the whole recording
    ends: tuple[float, ...] = (math.inf,)  # ends of the parts of a mix within the period [s]
    shares: tuple[float, ...] = (1.0,)  # share of the operating time of each part [-]

    def use(self, time: Array) -> Mix:
        """The parts of the mix as slices of the recorded times [s], (N,)."""
        stops = [*np.searchsorted(time, time[0] + np.array(self.ends[:-1])).tolist(), len(time)]
        return Mix([slice(first, stop) for first, stop in pairwise([0, *stops])], self.shares)


def basis_of(scene: Scene, evaluation: Evaluation | None = None) -> Basis:
    """The data from which the decision quantities of a scene's recordings are computed."""
    motors, heats = {}, {}
    for name, effects in scene.effects.items():
        for effect in effects:
            sheet = getattr(effect, "motor", None)
            if isinstance(sheet, Motor):
                motors[name] = sheet
            if isinstance(effect, WindingHeat):
                heats[name] = effect
    if evaluation is None:
        return Basis(motors, heats)
    cycle = evaluation.study.cycle
    ends = tuple(float(cycle.time[part.stop - 1]) for part in cycle.parts)
    return Basis(motors, heats, evaluation, cycle.duration, ends, cycle.shares)


def decision(recording: Recording, scene: Scene, basis: Basis) -> Decision:
    """The decision quantities of a recording, over the last period of its cycle."""
    first = 0.0 if basis.period is None else max(0.0, float(recording.time[-1]) - basis.period)
    last = np.flatnonzero(recording.time >= first - 1e-9)
    series = {name: one.values[last] for name, one in recording.series.items()}
    time, joints, checks = recording.time[last], {}, {}
    use = basis.use(time)
    heated = {name for name, own in scene.effects.items() if any(isinstance(effect, WindingHeat) for effect in own)}
    for name in scene.joints:
        heat = _heat(name, time, series, basis, name in heated)
        joints[name] = _joint(name, mean_weights(time, use), series, basis, heat)
        if basis.evaluation is not None and f"{name}.current" in series:
            checks[name] = _checks(basis.evaluation, name, (time, mean_weights(time, use)), series, heat)
    return Decision(joints, _tip_deviation(scene, series), checks)


def change(one: Decision, full: Decision) -> dict[str, Change]:
    """The signed relative changes of a decision against that of the full scene, by joint."""
    tip = one.tip_deviation - full.tip_deviation
    parts = ("peak_current", "rms_current", "rms_torque", "rise")
    return {
        name: Change(*(*(_share(getattr(one.joints[name], part), getattr(reference, part)) for part in parts), tip))
        for name, reference in full.joints.items()
    }


def _share(value: float, whole: float) -> float:
    """Relative change of a value against a reference [-]; NaN if the reference is zero."""
    if value == whole:
        return 0.0
    return (value - whole) / abs(whole) if whole else math.nan


def _joint(
    name: str, weights: Array, series: Mapping[str, Array], basis: Basis, heat: PeriodicTemperature | None
) -> JointDecision:
    """The decision quantities of one joint; ``weights`` are those of ``mean_weights``."""
    current = series.get(f"{name}.current", np.full(len(weights), np.nan))
    torque = series.get(f"{name}.mesh_torque", np.full(len(weights), np.nan))
    heating = basis.heats.get(name)
    return JointDecision(
        float(np.abs(current).max()),
        rms(current, weights),
        rms(torque, weights),
        math.nan if heat is None else heat.peak_winding,
        math.nan if heating is None else heating.network.ambient,
        float(np.abs(_deviation(name, series)).max()),
    )


def mean_weights(time: Array, use: Mix) -> Array:
    """Integration weights of the recorded times [s], (N,), for means over all parts with their shares of use."""
    weights = np.zeros(len(time))
    for part, share in zip(use.parts, use.shares, strict=True):
        own = sample_weights(time[part])
        weights[part] = own * (share * float(time[-1] - time[0]) / float(own.sum()))
    return weights


def rms(values: Array, weights: Array) -> float:
    """Weighted root mean square."""
    total = float(weights.sum())
    return math.sqrt(float(weights @ values**2) / total) if total > 0.0 else 0.0


def _deviation(name: str, series: Mapping[str, Array]) -> Array:
    """Deviation of a joint from its command [rad or m], (N,); NaN without a command."""
    position = series[f"{name}.position"]
    return position - series.get(f"{name}.command_position", np.full(len(position), np.nan))


def _tip_deviation(scene: Scene, series: Mapping[str, Array]) -> float:
    """Largest distance of the tip from its commanded position [m]; without an arm that of the joint [rad or m].

    NaN unless every joint has a command.
    """
    off = np.column_stack([_deviation(name, series) for name in scene.joints])
    if not isinstance(scene.body, Arm) or np.isnan(off).any():
        return float(np.abs(off).max())
    q = np.column_stack([series[f"{name}.position"] for name in scene.joints])
    distance = _tip_position(scene.body, q) - _tip_position(scene.body, q - off)
    return float(np.linalg.norm(distance, axis=1).max())


def _tip_position(arm: Arm, q: Array) -> Array:
    """Position of the tip for positions of the driven joints (N, n) [m], (N, 3)."""
    place: Array = tip_pose(*main_chain(arm, q))[:, :3, 3]
    return place


def tip_travel(scene: Scene, recording: Recording) -> float:
    """Largest commanded distance of the tip from its start [m]; without an arm that of the joint [rad or m]."""
    names = [f"{name}.command_position" for name in scene.joints]
    if any(name not in recording.series for name in names):
        return 0.0
    commanded = np.column_stack([recording[name] for name in names])
    if not isinstance(scene.body, Arm):
        return float(np.ptp(commanded, axis=0).max())
    place = _tip_position(scene.body, commanded)
    return float(np.linalg.norm(place - place[0], axis=1).max())


def _heat(
    name: str, time: Array, series: Mapping[str, Array], basis: Basis, heated: bool
) -> PeriodicTemperature | None:
    """Temperatures of one joint in the periodic steady state of the simulated cycle; None if they are unknown.

    ``heated``: the scene contains the heating of the winding, so its resistance follows the temperature.
    """
    heating, motor = basis.heats.get(name), basis.motors.get(name)
    current = series.get(f"{name}.current")
    if heating is None or motor is None or current is None:
        return None
    network, share = heating.network, heating.gear_heat
    loss = np.full(len(time), heating.constant_loss)
    shares = {"motor_friction_power": 1.0, "motor_viscous_power": 1.0, "mesh_power": share}
    shares["gear_drag_power"] = share - 1.0  # already included in the motor's friction
    for what, counted in shares.items():
        loss = loss + counted * series.get(f"{name}.{what}", np.zeros(1))
    use = basis.use(time)
    found = mixed_temperature_of_current(network, motor, time, current, use, housing_loss=loss)
    if heated:
        return found
    still = mixed_temperature_of_current(
        replace(network, winding_capacity=None), motor, time, current, use, housing_loss=loss, warming=False
    )
    winding, housing = still.peak_winding, still.magnet_temperature
    # The temperature ripple at constant resistance is left out; it is small against the influence of the resistance.
    return replace(
        found, winding=np.full(len(time), winding), housing=np.full(len(time), housing), mean_winding=winding,
        mean_housing=housing, peak_winding=winding, magnet_temperature=motor.reference_temperature, runaway=False,
    )  # fmt: skip


def _checks(
    evaluation: Evaluation, name: str, when: tuple[Array, Array], series: Mapping[str, Array],
    heat: PeriodicTemperature | None,
) -> tuple[Check, ...]:  # fmt: skip
    """The study's checks of one joint that apply to a simulation, with the requirements from the recorded series."""
    joint, safety, (time, weights) = evaluation.joints[name], evaluation.study.safety, when
    known = heat is not None and not heat.runaway
    magnets = heat.magnet_temperature if heat is not None and known else evaluation.study.ambient
    current = series[f"{name}.current"]
    effective = rms(current, weights)
    largest = {
        "motor speed": (safety.speed, series[f"{name}.motor_speed"]),
        "motor peak torque": (safety.peak_torque, current * torque_constant(joint.drive.motor, magnets)),
        "motor peak current": (safety.peak_torque, current),
        "amplifier peak current": (safety.peak_torque, current),
        "motor voltage": (safety.voltage, series.get(f"{name}.voltage", np.zeros(len(time)))),
    }
    mixed, found = len(evaluation.study.cycle.parts) > 1, []
    for check in joint.checks:
        if mixed and check.time is not None:  # its remark begins with the part of the mix that decides in sizing
            check = replace(check, remark=check.remark.partition("; ")[2])
        if check.name in largest:
            factor, values = largest[check.name]
            at = int(np.argmax(np.abs(values)))
            found.append(_requiring(check, factor * float(abs(values[at])), float(time[at]), safety.reserve))
        elif check.name in ("motor RMS current", "amplifier continuous current"):
            found.append(_requiring(check, safety.rms * effective, None, safety.reserve))
        elif check.name == "winding temperature":
            hottest = None if heat is None else heat.peak_winding if known else math.inf
            check = check if hottest is None or known else replace(check, remark="thermal runaway")
            instant = heat.peak_time if heat is not None and known else None
            found.append(_requiring(check, hottest, instant, safety.reserve, evaluation.study.ambient))
    return tuple(found)


def _requiring(check: Check, required: float | None, time: float | None, reserve: float, origin: float = 0.0) -> Check:
    """A check with a new requirement and its utilisation, where requirement and limit count from ``origin``.

    A check that the study cannot compute stays NOT CHECKED.
    """
    if required is None or check.required is None or check.available is None:
        return replace(check, required=None if check.required is None else required, time=time)
    used = utilisation(required - origin, check.available - origin)
    return replace(check, required=required, utilisation=used, verdict=judged(used, reserve), time=time)


def moving(recording: Recording, joint: str) -> Array:
    """Whether the joint is commanded to move at each recorded time, (N,)."""
    return ~np.asarray(resting(recording[f"{joint}.command_speed"]), dtype=bool)
