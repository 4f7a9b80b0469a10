"""What the selection benchmark chooses for: catalogues scaled from the shipped rows, and tasks of any size."""

from __future__ import annotations

import csv
import math
from dataclasses import fields, replace
from itertools import product
from pathlib import Path

import numpy as np

import drivetrain as dt
from drivetrain.catalog.read import Catalog, compatible_pairs, read_catalog
from drivetrain.catalog.schema import GEAR_COLUMNS, GEARS, MOTOR_COLUMNS, MOTORS, NUMBER
from drivetrain.drive.friction import FRICTIONLESS
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.study.model import DriveMass, JointTask, Mount, Study
from drivetrain.whole_files import shipped

ROOT = Path(__file__).resolve().parents[1]
EXAMPLE = ROOT / "examples" / "ur5_pick_and_place" / "study.yaml"
RULES = """      motors: {frameless: true, nominal_voltage: [40 V, 60 V], diameter: [null, 100 mm]}
      gears: {kind: strain_wave, ratio: [50, 160], size: [11, 32]}"""

Pairs = tuple[tuple[str, str], ...]


def scaled_catalog(pairs: int, seed: int) -> tuple[Catalog, Pairs]:
    """Frameless motors and strain-wave gears as shipped, made longer, rewound and enlarged at random.

    A motor l times as long, wound with w times the turns, has l w times the torque constant, l w^2 times the
    resistance and 1/w times the currents; a gear s times as large has s^3 times the torque and mass and s^5 times the
    inertia. Prices are invented: they grow with mass and scatter.

    Args:
        pairs: How many pairs are wanted.
        seed: Of the scatter.

    Returns:
        The rows, and the pairs.
    """
    rng, rows = np.random.default_rng(seed), read_catalog()
    motors = [m for m in rows.motors.values() if m.frameless and m.mass and 40.0 <= (m.nominal_voltage or 0) <= 60.0]
    gears = [g for g in rows.gears.values() if g.kind == "strain_wave" and g.mass and 50.0 <= g.ratio <= 160.0]
    each = math.ceil(math.sqrt(pairs))
    made = [_motor(motors[int(rng.integers(len(motors)))], f"motor_{i}", rng) for i in range(each)]
    turned = [_gear(gears[int(rng.integers(len(gears)))], f"gear_{i}", rng) for i in range(each)]
    catalog = Catalog({row.key: row for row in made}, {row.key: row for row in turned})
    chosen = list(product(catalog.motors, catalog.gears))
    return catalog, tuple(chosen[i] for i in sorted(rng.permutation(len(chosen))[:pairs].tolist()))


def _motor(row: Motor, key: str, rng: np.random.Generator) -> Motor:
    longer, turns = math.exp(rng.uniform(-1.2, 0.9)), math.exp(rng.uniform(-0.4, 0.4))
    factors = {
        "torque_constant": longer * turns, "resistance": longer * turns**2, "inductance": longer * turns**2,
        "nominal_current": 1 / turns, "peak_current": 1 / turns, "no_load_current": 1 / turns,
        "stall_current": 1 / turns,
        "no_load_speed": 1 / (longer * turns), "nominal_speed": 1 / (longer * turns), "stall_torque": longer,
        "nominal_torque": longer, "peak_torque": longer, "mass": longer, "rotor_inertia": longer, "length": longer,
        "coulomb_friction": longer, "viscous_friction": longer, "resistance_winding_housing": 1 / longer,
        "resistance_housing_ambient": 1 / longer, "resistance_winding_ambient": 1 / longer,
    }  # fmt: skip
    price = 60.0 + 260.0 * (longer * (row.mass or 1.0)) ** 0.7 * math.exp(0.3 * rng.standard_normal())
    return replace(row, key=key, price=price, source=f"scaled from {row.key}", **_times(row, factors))


def _gear(row: Gear, key: str, rng: np.random.Generator) -> Gear:
    size = math.exp(rng.uniform(-0.35, 0.25))
    torques = ("continuous_torque", "average_torque_limit", "repeated_peak_torque", "momentary_torque")
    factors = dict.fromkeys((*torques, "tilting_moment_limit", "mass", "no_load_torque"), size**3)
    factors |= {"inertia": size**5, "axial_load_limit": size**2, "radial_load_limit": size**2}
    factors |= dict.fromkeys(("diameter", "length", "pitch_diameter"), size)
    factors |= dict.fromkeys(("max_input_speed", "average_input_speed_limit", "rated_speed"), 1 / size)
    price = 140.0 + 300.0 * (size**3 * (row.mass or 1.0)) ** 0.6 * math.exp(0.3 * rng.standard_normal())
    return replace(row, key=key, price=price, source=f"scaled from {row.key}", **_times(row, factors))


def _times(row: Motor | Gear, factors: dict[str, float]) -> dict[str, float]:
    """The known numbers of a row times their factors."""
    known = {name: getattr(row, name, None) for name in factors}
    return {name: value * factors[name] for name, value in known.items() if value is not None}


def with_pairs(study: Study, catalog: Catalog, pairs: Pairs) -> Study:
    """A study in which every joint may have any of the pairs.

    Args:
        study: The task.
        catalog: The rows.
        pairs: Keys of (motor, gear).

    Returns:
        The study, given drives taken out.
    """
    tasks = tuple(replace(task, drive=None, pairs=pairs, rules=None) for task in study.joints)
    return replace(study, catalog=catalog, joints=tasks)


def published_pairs(folder: Path) -> tuple[Catalog, Pairs]:
    """A catalogue folder and the shipped one with all their compatible pairs.

    Args:
        folder: As ``drivetrain catalog import`` writes it.

    Returns:
        The rows, and the pairs: those published, and frameless motors by the rule.
    """
    catalog = read_catalog(folder, shipped("catalogs"))
    return catalog, tuple(compatible_pairs(catalog))


def resampled(study: Study, samples: int) -> Study:
    """A study whose cycle has another number of samples, evenly spaced.

    Args:
        study: The task.
        samples: How many.

    Returns:
        The same motion, straight between the old samples.
    """
    cycle = study.cycle
    time = np.linspace(cycle.time[0], cycle.time[-1], samples)
    nearest = np.minimum(np.searchsorted(cycle.time, time), len(cycle.time) - 1)

    def at(values: np.ndarray) -> np.ndarray:
        return np.column_stack([np.interp(time, cycle.time, column) for column in values.T])

    motion = {name: at(getattr(cycle, name)) for name in ("position", "velocity", "acceleration")}
    return replace(
        study,
        cycle=replace(cycle, time=time, payload=cycle.payload[nearest], segment=cycle.segment[nearest], **motion),
    )


def chain_study(study: Study, joints: int, samples: int) -> Study:
    """A task for an arm of any number of joints, bare links that get slimmer towards the tip.

    Args:
        study: Of which everything but the arm and the motion is taken.
        joints: How many.
        samples: Of the motion, which is a few sines a joint.

    Returns:
        The study without candidates.
    """
    reach = 1.1 * 0.78 ** np.arange(joints) / np.sum(0.78 ** np.arange(joints))
    ends = np.concatenate([[0.0], np.cumsum(reach)])
    axes = [np.array([0.0, 0.0, 1.0]) if i % 3 == 0 else np.array([0.0, 1.0, 0.0]) for i in range(joints)]
    home = np.tile(np.eye(4), (joints, 1, 1))
    home[:, 0, 3] = 0.5 * (ends[:-1] + ends[1:])
    points = np.column_stack([ends[:-1], np.zeros(joints), np.zeros(joints)])
    screws = np.array([np.concatenate([axis, np.cross(point, axis)]) for axis, point in zip(axes, points, strict=True)])
    masses = 8.0 * reach
    across = masses * reach**2 / 10  # about both axes across a link; along it no body has more than their sum
    inertias = np.array([np.diag([min(0.002, 2 * one), one, one]) for one in across])
    tip = np.eye(4)
    tip[0, 3] = ends[-1]
    names = tuple(f"joint_{i + 1}" for i in range(joints))
    arm = dt.Arm.from_screws(home, screws, masses, inertias, tip, joint_points=points, joint_names=names)
    own = study.joints[0]
    tasks = tuple(
        JointTask(name, None, (), (), Mount("parent"), None, FRICTIONLESS, None, own.amplifier, stop=own.stop)
        for name in names
    )
    supply = replace(study.supply, peak_power=None, mean_power=None, regenerated_power=None)
    cycle = _sines(names, samples)
    return replace(
        study, arm=arm, drive_mass=DriveMass.ADDED, joints=tasks, payloads=(), cycle=cycle, supply=supply, notes=()
    )


def _sines(names: tuple[str, ...], samples: int) -> Cycle:
    rng, n = np.random.default_rng(0), len(names)
    t = np.linspace(0.0, 4.0, samples)[:, None]
    rate, phase = 0.5 * np.pi * rng.integers(1, 3, n), rng.uniform(0.0, 2 * np.pi, n)
    size = 0.9 / rate
    q, qd = size * np.sin(rate * t + phase), size * rate * np.cos(rate * t + phase)
    none, zero = np.full(samples, -1), np.zeros(samples, dtype=np.int64)
    return Cycle(names, t[:, 0], q, qd, -(rate**2) * q, None, none, (), zero, ("sines",))


def write_study(folder: Path, catalog: Catalog, pairs: str = "all") -> Path:
    """The example's study file with another catalogue beside it.

    Args:
        folder: Made when missing.
        catalog: Its rows are written as a catalogue folder.
        pairs: Which of them may be paired: ``all`` or ``compatible``.

    Returns:
        The study file.
    """
    rows = folder / "catalog"
    rows.mkdir(parents=True, exist_ok=True)
    for name, columns, parts in (
        (MOTORS, MOTOR_COLUMNS, catalog.motors.values()), (GEARS, GEAR_COLUMNS, catalog.gears.values()),
    ):  # fmt: skip
        with (rows / name).open("w", newline="", encoding="utf-8") as file:
            known = {field.name for part in parts for field in fields(part)}
            shown = [column for column in columns if column.name in known or column.name.endswith("_basis")]
            writer = csv.writer(file)
            writer.writerow([_header(column.name, column.unit, column.content) for column in shown])
            writer.writerows([[_cell(part, column.name) for column in shown] for part in parts])
    text = EXAMPLE.read_text(encoding="utf-8")
    text = text.replace("objective: mass", "objective: mass\ncatalogs: [catalog]")
    study = folder / "study.yaml"
    study.write_text(text.replace(RULES, f"      pairs: {pairs}"), encoding="utf-8")
    return study


def _header(name: str, unit: str, content: str) -> str:
    return f"{name} [{unit}]" if content == NUMBER and unit not in ("", "1") else name


def _cell(part: Motor | Gear, name: str) -> str:
    fixed = {"current_basis": "dc", "winding_basis": "line_line"}
    value = fixed.get(name, getattr(part, name, None))
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "" if value is None else repr(float(value)) if isinstance(value, float) else str(value)
