"""Data of the page's animated charts: series and operating regions, and their dependence on the gear ratio."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetrain.arm.arm import Arm
from drivetrain.arm.files.shapes import Triangles, box, link_shapes
from drivetrain.arm.kinematics import link_poses
from drivetrain.arrays import Array
from drivetrain.drive.drive import drive_inertia, unstaged_inertia
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import torque_constant, winding_resistance
from drivetrain.drive.motor_limits import continuous_current, continuous_region, operating_region
from drivetrain.dynamics.closed import chain_motions
from drivetrain.motion.duty_cycle import Cycle, sample_weights
from drivetrain.report.charts.chart import rounded
from drivetrain.report.quantities import convert, percent, printed_unit, scaled
from drivetrain.sizing.results import Evaluation, JointResult
from drivetrain.study.model import JointTask, Study
from drivetrain.study.parts.mounting import drive_mass

TURNED = 1e4  # scale of rotation matrices in the data, which are stored as integers
BAR = 0.045  # width of a bar over the arm's length
SAMPLES = 500  # samples of a series, in addition to its extremes
POSES = 160
SUPPLIES = (0.9, 1.0, 1.1)  # supply voltages over that of the study
# quantity on which the required value of a check depends: motor torque (largest or RMS), speed, or voltage
FOLLOWS = {
    "motor peak torque": "peak", "motor peak current": "peak", "amplifier peak current": "peak",
    "motor RMS current": "rms", "motor RMS torque": "rms", "amplifier continuous current": "rms",
    "motor speed": "speed", "gear maximum input speed": "speed", "gear mean input speed": "speed",
    "motor voltage": "voltage",
}  # fmt: skip
SERIES = (
    ("position", "position", "rad"), ("speed", "motor_speed", "rad/s"), ("gear", "gear_torque", "N m"),
    ("torque", "motor_torque", "N m"), ("rotor", "rotor_torque", "N m"), ("friction", "friction_torque", "N m"),
    ("current", "current", "A"), ("voltage", "voltage", "V"), ("power", "electrical_power", "W"),
    ("winding", "winding_temperature", "C"), ("housing", "housing_temperature", "C"),
)  # fmt: skip


def motion_data(evaluation: Evaluation) -> dict[str, Any]:
    """Series of every joint on one thinned grid of time, regions, limits, and the arm's poses."""
    study, joints = evaluation.study, list(evaluation.joints.values())
    if not joints:
        return {}
    tasks = {task.name: task for task in study.joints}
    kept = kept_samples(evaluation)
    units = {key: _unit(joints, field, unit) for key, field, unit in SERIES}
    units |= {"rotor": units["torque"], "friction": units["torque"]}
    return {
        "time": rounded(joints[0].series.time[kept], 5),
        "units": {key: printed_unit(unit) for key, unit in units.items()},
        "clock": clock(study.cycle),
        "segments": [[rounded([a, b]), name] for a, b, name in segments(study.cycle)],
        "breaks": [int(np.searchsorted(kept, part.start)) for part in study.cycle.parts[1:]],
        "supply": study.supply.voltage,
        "joints": [_joint(joint, tasks[joint.name], study, kept, units) for joint in joints],
        "arm": _arm(evaluation, kept),
    }


def kept_samples(evaluation: Evaluation) -> NDArray[np.intp]:
    """Indices of the samples drawn: evenly spaced ones, extremes of all series, the instants of all checks, and steps.

    Both samples of a step are kept: with one of them a step before a dwell would be drawn as a ramp over the dwell.
    """
    joints = list(evaluation.joints.values())
    n = len(joints[0].series.time)
    steps = np.flatnonzero(np.diff(joints[0].series.time) == 0.0)
    kept = set(range(0, n, max(1, n // SAMPLES))) | set(steps.tolist()) | set((steps + 1).tolist())
    for part in evaluation.study.cycle.parts:
        kept |= {part.start, part.stop - 1}
    for joint in joints:
        for _, field, _ in SERIES:
            values = getattr(joint.series, field)
            if values is not None:
                kept |= {int(values.argmin()), int(values.argmax())}
        times = [check.time for check in joint.checks if check.time is not None]
        kept |= set(np.abs(joint.series.time[:, None] - times).argmin(axis=0).tolist()) if times else set()
    return np.array(sorted(kept))


def clock(cycle: Cycle) -> str:
    return "time in the cycle [s]" if len(cycle.parts) == 1 else "time, one period of each part after another [s]"


def segments(cycle: Cycle) -> list[tuple[float, float, str]]:
    """Begin, end [s] and name of every segment (for a mix, of every part); empty if there is only one."""
    if len(cycle.parts) > 1:
        return [
            (float(cycle.time[part.start]), float(cycle.time[part.stop - 1]), f"{name}, {percent(share)} of the time")
            for part, name, share in zip(cycle.parts, cycle.part_names, cycle.shares, strict=True)
        ]
    starts = [0, *(np.flatnonzero(np.diff(cycle.segment)) + 1).tolist(), len(cycle.time)]
    if len(starts) < 3:
        return []
    ends = [(float(cycle.time[a]), float(cycle.time[min(b, len(cycle.time) - 1)])) for a, b in pairwise(starts)]
    names = [cycle.segment_names[int(cycle.segment[first])] for first in starts[:-1]]
    return [(low, high, name) for (low, high), name in zip(ends, names, strict=True)]


def gear_limits(gear: Gear) -> list[tuple[str, float, str]]:
    """Name, value and SI unit of the limits of torque and input speed in a gear's data sheet."""
    lines = (
        ("rated torque", gear.continuous_torque, "N m"), ("average torque", gear.average_torque_limit, "N m"),
        ("repeated peak torque", gear.repeated_peak_torque, "N m"), ("momentary torque", gear.momentary_torque, "N m"),
        ("rated input speed", gear.rated_speed, "rad/s"), ("mean input speed", gear.average_input_speed_limit, "rad/s"),
        ("maximum input speed", gear.max_input_speed, "rad/s"),
    )  # fmt: skip
    return [(name, value, unit) for name, value, unit in lines if value is not None]


def _unit(joints: list[JointResult], field: str, unit: str) -> str:
    known = [getattr(joint.series, field) for joint in joints if getattr(joint.series, field) is not None]
    return scaled(np.concatenate(known), unit)[1] if known else unit


def _joint(
    joint: JointResult, task: JointTask, study: Study, kept: NDArray[np.intp], units: dict[str, str]
) -> dict[str, Any]:
    series, drive = joint.series, joint.drive
    slides = task.travel_per_turn is not None

    def shown(key: str, values: Any, unit: str) -> Array:
        return convert(values, unit, units[key])

    drawn = {}
    for key, field, unit in SERIES:
        values = getattr(series, field)
        if values is not None:
            drawn[key] = rounded(values[kept] if key == "position" and slides else shown(key, values[kept], unit))
    at = temperatures(joint, study)
    limits: dict[str, list[tuple[str, float | None]]] = {
        "gear": [("repeated peak", drive.gear.repeated_peak_torque), ("momentary peak", drive.gear.momentary_torque)],
        "current": [("motor peak", drive.motor.peak_current), ("amplifier peak", task.amplifier.peak_current)],
        "voltage": [("available", task.amplifier.modulation * study.supply.voltage)],
        "winding": [("winding limit", drive.motor.max_winding_temperature)],
    }
    of = {key: unit for key, _, unit in SERIES}
    wide, high = view(joint, regions(joint, task, study, at["hot"], study.supply.voltage)[0])
    constant = torque_constant(drive.motor, at["hot"][1])
    return {
        "name": joint.name,
        "slides": slides,
        "series": drawn,
        "view": [float(shown("speed", wide, "rad/s")), float(shown("torque", high, "N m"))],
        "temperatures": {name: round(warm[0], 1) for name, warm in at.items()},
        "regions": {
            f"{name} {share:g}": [
                None if one is None else
                [rounded(shown("speed", one[:, 0], "rad/s")), rounded(shown("torque", one[:, 1], "N m"))]
                for one in regions(joint, task, study, warm, share * study.supply.voltage)
            ]
            for name, warm in at.items() for share in SUPPLIES
        },
        "limits": {
            key: [[name, float(shown(key, value, of[key]))] for name, value in limit if value is not None]
            for key, limit in limits.items()
        },
        "gear_limits": [
            [name, float(shown("gear" if unit == "N m" else "speed", value, unit)), unit == "N m"]
            for name, value, unit in gear_limits(drive.gear)
        ],
        "checks": {
            check.name: check.utilisation for check in joint.checks
            if check.name in FOLLOWS and check.utilisation is not None and np.isfinite(check.utilisation)
        },
        "ratio": _ratio(joint, study, kept, units, float(shown("torque", constant, "N m"))),
        "resistances": {name: float(winding_resistance(drive.motor, warm[0])) for name, warm in at.items()},
        "mass": drive_mass(drive) or 0.0,
    }  # fmt: skip


def _ratio(
    joint: JointResult, study: Study, kept: NDArray[np.intp], units: dict[str, str], constant: float
) -> dict[str, Any]:
    """Terms of the motor torque by their dependence on the ratio G: the load ~ 1/G, the rotor's acceleration ~ G.

    The motor torque at G of a drive evaluated at G0 is a G0/G + b + c (G/G0 - 1): a is the load torque without the
    rotor, b the term of the rotor, c = J G0 acceleration. ``moments`` are the mean products of a, b and c, from which
    the RMS at any G follows. Stages behind the gear belong to the load: ``rotor`` is the rotor's share of the inertia
    and torque at the gear's input.
    """
    series, drive = joint.series, joint.drive
    inertia = unstaged_inertia(drive)
    rotor = inertia / drive_inertia(drive) if inertia > 0.0 else 1.0
    weights = sample_weights(series.time) if len(study.cycle.parts) == 1 else study.cycle.weights
    spin, own = inertia * drive.gear.ratio * series.acceleration, rotor * series.rotor_torque
    parts = convert(np.stack([series.motor_torque - own, own, spin]), "N m", units["torque"])
    moments = (parts * weights) @ parts.T / max(float(weights.sum()), 1e-12)
    back_emf = constant / float(convert(1.0, "N m", units["torque"])) / float(convert(1.0, "rad/s", units["speed"]))
    return {
        "own": abs(drive.gear.ratio),
        "direct": drive.gear.kind == "ideal",
        "spin": rounded(parts[2][kept]),
        "rotor": rotor,
        "moments": moments.ravel().tolist(),
        "constant": constant,
        "back_emf": back_emf,
    }


def _arm(evaluation: Evaluation, kept: NDArray[np.intp]) -> dict[str, Any] | None:
    """Joints, tip, drives and link shapes [mm] with all joints at zero, and the motion of each link; None: no arm.

    The moving links are those of the arm's own chain, then those of linkages with a drive.
    """
    study = evaluation.study
    arm = study.arm
    if arm is None:
        return None
    at = kept[np.unique(np.linspace(0, len(kept) - 1, POSES).astype(int))]
    named, chains = {name: k for k, name in enumerate(arm.joint_names)}, chain_motions(arm, study.cycle.position[at])
    motions = [link_poses(chain, positions) @ np.linalg.inv(chain.home) for chain, positions, _ in chains]
    arm, moved, drives = chains[0][0], motions[0], list[dict[str, Any]]()
    for name in evaluation.joints:
        i, link = next((i, own.index(named[name])) for i, (_, _, own) in enumerate(chains) if named[name] in own)
        chain = chains[i][0]
        point, axis = np.round(1e3 * chain.joint_points[link], 1).tolist(), np.round(chain.axes[link], 3).tolist()
        drives.append({"link": moved.shape[1] if i else link, "point": point, "axis": axis})
        moved = np.concatenate([moved, motions[i][:, link : link + 1]], axis=1) if i else moved
    moved[..., :3, 3] *= 1e3
    moved[..., :3, :3] *= TURNED
    points = np.vstack([np.zeros(3), arm.joint_points, arm.tip[:3, 3]])
    return {
        "samples": np.searchsorted(kept, at).tolist(),
        "moved": np.round(moved[..., :3, :]).astype(int).ravel().tolist(),
        "points": np.round(1e3 * points, 1).tolist(),
        "links": moved.shape[1],
        "drives": drives,
        "shapes": [
            {"link": link, "corners": np.round(1e3 * corners).astype(int).tolist(), "faces": faces.tolist()}
            for link, (corners, faces) in _shapes(arm, points)
        ],
    }


def _shapes(arm: Arm, points: Array) -> list[tuple[int, Triangles]]:
    """Shapes of the links from the arm's file; without shapes, bars from joint to joint."""
    found = link_shapes(arm)
    known, width = {link for link, _ in found}, BAR * float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    for link, (start, end) in enumerate(pairwise(points), -1):
        length = float(np.linalg.norm(end - start))
        if link not in known and length > 1e-3:
            along = (end - start) / length
            across = np.cross(along, np.eye(3)[np.abs(along).argmin()])
            across /= np.linalg.norm(across)
            corners, faces = box(np.array([width, width, length]))
            frame = np.stack([across, np.cross(along, across), along])
            found.append((link, (corners @ frame + 0.5 * (start + end), faces)))
    return found


FAR = 4.0  # largest value shown over that of the motion; the region may be larger


def temperatures(joint: JointResult, study: Study) -> dict[str, tuple[float, float]]:
    """Temperatures of winding and magnets [C] for which regions are drawn, by name."""
    motor, series = joint.drive.motor, joint.series
    winding, housing, limit = series.winding_temperature, series.housing_temperature, motor.max_winding_temperature
    cold = study.ambient
    hot = float(winding.max()) if winding is not None else cold if limit is None else limit
    magnets = float(housing.mean()) if housing is not None else hot
    found = {"hot": (hot, magnets), "cold": (cold, cold)}
    return found if limit is None else found | {"limit": (limit, max(magnets, cold))}


def regions(
    joint: JointResult, task: JointTask, study: Study, at: tuple[float, float], supply: float
) -> tuple[Array, Array | None]:
    """Corners (speed [rad/s], torque [N m]) of the intermittent and the continuous operating region, (N, 2) each.

    ``at`` are the temperatures of winding and magnets [C]; the second is None if the data sheet lacks values.
    """
    motor = joint.drive.motor
    short = operating_region(motor, task.amplifier, supply, *at)
    continuous = continuous_current(motor, study.ambient, housing_to_ambient=task.housing_to_ambient).value
    if continuous is None:
        return short, None
    return short, continuous_region(motor, task.amplifier, supply, continuous, *at)


def view(joint: JointResult, corners: Array) -> tuple[float, float]:
    """Half width [rad/s] and half height [N m] of the chart: the motion and, up to ``FAR``, the intermittent region."""
    speed = float(np.abs(joint.series.motor_speed).max())
    torque = float(np.abs(joint.series.motor_torque).max())
    (x0, y0), (x1, y1) = corners[:-1].T, corners[1:].T
    crossing = (y0 * y1 <= 0) & (y0 != y1)  # without the corners of braking, which are far outside
    at = x0[crossing] - y0[crossing] * (x1[crossing] - x0[crossing]) / (y1[crossing] - y0[crossing])
    reach = float(np.abs(at).max(initial=0.0)) or float(np.abs(corners[:, 0]).max())
    right = max(1.15 * speed, min(1.12 * reach, FAR * speed if speed else np.inf))
    height = float(np.abs(corners[:, 1]).max())
    top = max(1.2 * torque, min(1.12 * height, FAR * torque if torque else np.inf))
    return right, top
