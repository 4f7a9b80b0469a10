"""A made-up evaluation of three joints with every kind of verdict in it, to draw and print without running a study."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from drivetrain.catalog.read import Catalog
from drivetrain.drive.amplifier import Amplifier, Supply
from drivetrain.drive.drive import Drive
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.motion.duty_cycle import Cycle
from drivetrain.sizing.results import Evaluation, JointResult, JointSeries, RejectedPair, Selection
from drivetrain.study.model import GearAssumption, JointTask, MotorAssumption, Mount, Safety, Study
from drivetrain.study.parts.verdicts import Check, Verdict

NAMES = ("shoulder_pan", "shoulder_lift", "elbow")
SIZES = (3.0, 2.5, 2.0)
SAMPLES = 1601


def made_up_motor(size: float) -> Motor:
    return Motor(
        key=f"acme-{size:g}",
        resistance=0.4 / size,
        torque_constant=0.08 * size**0.5,
        maker="Acme <&> Sons",
        series="M",
        part_number=f"M-{size:g}",
        frameless=True,
        inductance=2e-4,
        rotor_inertia=3e-5 * size,
        mass=0.4 * size,
        nominal_voltage=48.0,
        no_load_current=0.3,
        no_load_speed=400.0,
        coulomb_friction=0.01,
        viscous_friction=1e-5,
        nominal_current=9.0 * size,
        nominal_torque=0.6 * size,
        peak_current=30.0 * size,
        max_speed=600.0,
        resistance_winding_housing=0.6,
        resistance_housing_ambient=1.2,
        winding_time_constant=25.0,
        housing_time_constant=1200.0,
        max_winding_temperature=155.0,
        source="made-up sheet, edition 2024, row 3",
    )


def made_up_gear(size: float) -> Gear:
    return Gear(
        key=f"wave-{size:g}-100",
        ratio=100.0,
        maker="Wave",
        series="W",
        part_number=f"W-{size:g}-100",
        kind="strain_wave",
        efficiency=0.75,
        inertia=1e-5 * size,
        mass=0.5 * size,
        continuous_torque=40.0 * size,
        average_torque_limit=60.0 * size,
        repeated_peak_torque=100.0 * size,
        momentary_torque=200.0 * size,
        max_input_speed=700.0,
        average_input_speed_limit=360.0,
        rated_speed=209.0,
        rated_life=7000 * 3600.0,
        life_exponent=3.0,
        tilting_moment_limit=150.0,
        source="made-up sheet, page 12",
    )


def made_up_series(size: float, phase: float) -> JointSeries:
    time = np.linspace(0.0, 4.0, SAMPLES)
    w = np.pi / 2
    position = 1.2 * np.sin(w * time + phase)
    speed = 1.2 * w * np.cos(w * time + phase)
    acceleration = -1.2 * w**2 * np.sin(w * time + phase)
    gear_torque = size * (45.0 * np.cos(position) + 12.0 * acceleration)
    motor_speed = 100.0 * speed
    rotor = 4e-5 * size * 100.0 * acceleration
    friction = 0.05 * size * np.sign(speed)
    motor_torque = gear_torque / 100.0 + rotor + friction
    current = motor_torque / (0.08 * size**0.5)
    voltage = 0.5 / size * current + 0.08 * size**0.5 * motor_speed
    heat = 70.0 + 40.0 * size / 3 + 3.0 * np.sin(w * time)
    return JointSeries(
        time, position, speed, acceleration, gear_torque, motor_speed, motor_torque, rotor, friction, current,
        voltage, voltage * current, voltage * current, heat, 55.0 + 0 * time, np.zeros((SAMPLES, 6)),
        0.5 * size + 0 * time,
    )  # fmt: skip


def made_up_checks(used: float) -> tuple[Check, ...]:
    def judged(name: str, available: float, unit: str, share: float, time: float | None) -> Check:
        verdict = Verdict.FAIL if share > 1 else Verdict.MARGINAL if share > 0.9 else Verdict.PASS
        factor = 1.2 if "peak" in name else 1.0  # the study's
        return Check(name, share * available, available, unit, share, verdict, time, "sheet <row 3>", factor=factor)

    return (
        judged("motor peak torque", 2.4, "N m", 0.8 * used, 0.71),
        judged("motor peak current", 30.0, "A", 0.7 * used, 0.71),
        judged("motor voltage", 48.0, "V", 0.6 * used, 1.93),
        judged("motor speed", 600.0, "rad/s", 0.5 * used, 2.0),
        judged("motor RMS current", 9.0, "A", 0.95 * used, None),
        judged("winding temperature", 155.0, "C", used, 3.1),
        judged("gear average torque", 60.0, "N m", 0.4 * used, None),
        judged("gear repeated peak torque", 100.0, "N m", 0.55 * used, 0.71),
        Check(
            "gear life L10", 2.0e4, None, "h", None, Verdict.NOT_CHECKED, None, "", "no rated life in the catalogue row"
        ),
        Check("inertia ratio", 1.8, None, "", None, Verdict.NOT_CHECKED, 0.2, "", "reported, the study sets no limit"),
    )


def made_up_study() -> Study:
    time = np.linspace(0.0, 4.0, SAMPLES)
    flat = np.zeros((SAMPLES, len(NAMES)))
    segment = np.minimum((time / 1.0).astype(int), 3)
    cycle = Cycle(
        NAMES, time, flat, flat, flat, None, np.where(segment == 1, 0, -1), ("box",), segment,
        ("approach", "carry", "retreat", "wait"), ("trapezoid at 80 % of the speed limits",),
    )  # fmt: skip
    motors = {m.key: m for m in (made_up_motor(s) for s in SIZES)}
    gears = {g.key: g for g in (made_up_gear(s) for s in SIZES)}
    joints = tuple(
        JointTask(
            name, (m, g), ((m, g),), ("12 gears: no compatible motor",), Mount(), None, Friction(), None,
            Amplifier(peak_current=60.0, continuous_current=30.0),
        )
        for name, m, g in zip(NAMES, motors, gears, strict=True)
    )  # fmt: skip
    return Study(
        name="made_up_arm",
        description="Three axes that carry a box <and nothing else>.",
        path="/somewhere/on/one/machine/study.yaml",
        digest="0123456789abcdef" * 4,
        arm=None,
        drive_mass=None,
        payloads=(),
        cycle=cycle,
        joints=joints,
        supply=Supply(48.0, peak_power=2000.0, mean_power=600.0, regenerated_power=50.0),
        ambient=25.0,
        safety=Safety(peak_torque=1.2, life=20000 * 3600.0),
        gear_assumptions={"strain_wave": GearAssumption(efficiency=0.72, source="range of the sheets")},
        motor_assumptions={"frameless": MotorAssumption(max_winding_temperature=125.0, source="class B")},
        catalog=Catalog(motors, gears, {}, ("confirm against the current data sheet",)),
        notes=("link wrist_3: Izz is implausible",),
    )


def made_up_evaluation(used: tuple[float, ...] = (0.62, 0.97, 1.08)) -> Evaluation:
    study = made_up_study()
    joints = {}
    for i, (task, share) in enumerate(zip(study.joints, used, strict=True)):
        assert task.drive is not None
        motor, gear = study.catalog.motors[task.drive[0]], study.catalog.gears[task.drive[1]]
        size = motor.mass / 0.4 if motor.mass else 1.0
        drive = Drive(motor, gear, assumptions=("back-driving efficiency 0.67: same mesh friction",))
        joints[task.name] = JointResult(
            task.name, motor.key, gear.key, drive, made_up_checks(share), made_up_series(size, 0.4 * i),
            ("at standstill the smaller holding torque is used",),
        )  # fmt: skip
    shared = (
        Check("supply peak power", 900.0, 2000.0, "W", 0.45, Verdict.PASS, 0.7, "study"),
        Check("supply regenerated power", 20.0, 50.0, "W", 0.4, Verdict.PASS, None, "study"),
    )
    return Evaluation(study, joints, shared, 12.34)


def made_up_fallen() -> tuple[RejectedPair, ...]:
    rng = np.random.default_rng(3)
    names = ("winding temperature", "motor voltage", "gear repeated peak torque")
    found = []
    for joint in NAMES:
        for i in range(400):
            available = float(rng.uniform(1, 10))
            share = float(1.0 + rng.exponential(2.0))
            check = names[int(rng.integers(3))]
            mass = float(rng.uniform(0.3, 5))
            found.append(
                RejectedPair(joint, f"m{i}", f"g{i % 7}", check, share * available, available, "N m", share, mass)
            )
    return tuple(found)


def made_up_selection(feasible: bool = True) -> Selection:
    used = (0.62, 0.97, 0.98) if feasible else (0.62, 0.97, 1.08)
    evaluation = made_up_evaluation(used)
    drives = {name: (joint.motor, joint.gear) for name, joint in evaluation.joints.items()} if feasible else {}
    return Selection(
        evaluation.study,
        drives,
        evaluation,
        12.34 if feasible else float("nan"),
        "optimal" if feasible else "nothing fits at elbow",
        made_up_fallen(),
        {name: (("acme-9", "wave-9-100", 3.1), ("acme-8", "wave-8-100", 3.4)) for name in NAMES},
        () if feasible else ("elbow: the nearest is acme-2 with wave-2-100", "a 10 % lower speed would do"),
        {"nodes": 12, "candidates": 1200},
    )


@pytest.fixture(scope="session")
def evaluation() -> Evaluation:
    return made_up_evaluation()


@pytest.fixture(scope="session")
def selection() -> Selection:
    return made_up_selection()


@pytest.fixture(scope="session")
def nothing_fits() -> Selection:
    return made_up_selection(feasible=False)


@pytest.fixture(scope="session")
def without_data() -> Evaluation:
    """Every drive with a bare sheet: no temperatures, no limits, nothing checked."""
    full = made_up_evaluation()
    joints = {}
    for name, joint in full.joints.items():
        motor = Motor("bare", 1.0, 0.05)
        drive = Drive(motor, Gear("", 1.0))
        series = replace(
            joint.series, winding_temperature=None, housing_temperature=None, bearing_load=None, load_inertia=None
        )
        checks = tuple(
            Check(
                c.name,
                None,
                None,
                c.unit,
                None,
                Verdict.NOT_CHECKED,
                remark="not in the catalogue row",
                essential=c.name in ("motor peak torque", "motor RMS current"),
            )
            for c in joint.checks
        )
        joints[name] = JointResult(name, "bare", "", drive, checks, series)
    return Evaluation(full.study, joints, (), float("nan"))


@pytest.fixture
def make_evaluation() -> Callable[..., Evaluation]:
    return made_up_evaluation
