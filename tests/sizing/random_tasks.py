"""Random studies that hold everything a study can, and all their sets: for tests that set two ways of judging against
each other."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.coupling import belts_over, differential, placed, with_coupling
from drivetrain.catalog.read import Catalog
from drivetrain.drive.amplifier import Amplifier
from drivetrain.drive.brake import Brake
from drivetrain.drive.counterbalance import Counterbalance
from drivetrain.drive.drive import Drive, shaft_friction
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import NO_GEAR
from drivetrain.drive.stages import Stage, chained, with_stages
from drivetrain.motion.duty_cycle import build_mix
from drivetrain.records import as_records
from drivetrain.sizing.demand.demand import JointDemand, Workload, workload
from drivetrain.sizing.demand.series import JointSeries, joint_series, unit_loads_of
from drivetrain.sizing.judge.cases import paired
from drivetrain.sizing.judge.evaluate import evaluate_joint, evaluation_of, shared_checks
from drivetrain.sizing.judge.parts import FilledParts, Parts
from drivetrain.sizing.results import Evaluation, JointResult
from drivetrain.sizing.search.preconditions import satisfied
from drivetrain.study.model import ContainedDrive, DriveMass, Mount, Safety, Stop, Study
from drivetrain.study.parts.candidates import with_brakes
from drivetrain.study.parts.verdicts import Verdict

KINDS = ("table", "arm", "sliding", "coupled", "mix", "dwell")


Drives = dict[str, tuple[str, str]]


def unfailed_sets(study: Study, kept: Callable[[Drives], bool] = lambda _: True) -> Iterator[tuple[Drives, Evaluation]]:
    """Every set of drives, each judged on its own, but those of which a joint fails: what it fails for is enough.

    In an open chain without coupled motors a joint bears nothing of the drives before it: who fails with those that
    come after fails with all before.
    """
    work, parts, names = workload(study), FilledParts(study), [task.name for task in study.joints]
    options = [(task.drive,) if task.drive else task.pairs for task in study.joints]
    chain = study.arm is None or (study.arm.coupling is None and study.arm.linkage is None)

    def judged(joint: int, drives: Drives) -> JointResult | None:
        mounted = {i: parts.drive(task, *drives[names[i]]) for i, task in enumerate(study.joints) if names[i] in drives}
        result = evaluate_joint(work, mounted, joint, drives[names[joint]])
        return None if result.verdict is Verdict.FAIL else result

    def grown(joint: int, drives: Drives, results: dict[str, JointResult]) -> Iterator[dict[str, JointResult]]:
        """Results of sets with these drives at the joints after one."""
        if joint < 0:
            yield results
            return
        for pair in options[joint]:
            now = {names[joint]: pair, **drives}
            if found := judged(joint, now):
                yield from grown(joint - 1, now, {names[joint]: found, **results})

    def whole() -> Iterator[dict[str, JointResult]]:
        for pairs in itertools.product(*options):
            drives = dict(zip(names, pairs, strict=True))
            found: dict[str, JointResult] = {}
            for i, name in enumerate(names if kept(drives) else ()):
                if not (result := judged(i, drives)):
                    break
                found[name] = result
            if len(found) == len(names):
                yield found

    for results in grown(len(names) - 1, {}, {}) if chain else whole():
        drives = {name: (results[name].motor, results[name].gear) for name in names}
        if kept(drives):
            yield drives, evaluation_of(study, results, shared_checks(study, results))


def feasible_sets(study: Study, kept: Callable[[Drives], bool] = lambda _: True) -> list[Evaluation]:
    """The evaluations of all sets that are feasible, or would be but for data that a given drive lacks."""
    return [found for _, found in unfailed_sets(study, kept) if satisfied(found)]


def blanked(rng, row, names, share):
    """A sheet with some of its numbers missing."""
    return replace(row, **{name: None for name in names if rng.random() < share})


def random_motor(make, rng, key):
    size = rng.uniform(0.3, 3.0)
    row = replace(
        make.motor, key=key, mass=0.4 * size, nominal_current=5.0 * size, peak_current=18.0 * size,
        no_load_current=0.27 * size, rotor_inertia=2e-5 * size**2, resistance=rng.uniform(0.2, 1.5) / size,
        price=float(rng.uniform(50, 200)),
        peak_torque=float(rng.choice([0.8, 3.0])) * size, coulomb_friction=0.004 * size, viscous_friction=1e-5 * size,
        magnet_coefficient=float(rng.choice([-0.002, -0.001, 0.0, 0.0005])), max_speed=float(rng.uniform(400, 1500)),
        winding_time_constant=float(rng.choice([0.02, 3.0, 40.0])), diameter=0.06, length=0.05,
        resistance_winding_ambient=3.0, inductance=float(rng.choice([1e-4, 2e-3])),
    )  # fmt: skip
    row = replace(row, inductance=row.resistance * row.inductance)  # L/R as motors have
    optional = (
        "inductance mass nominal_current peak_current peak_torque max_speed coulomb_friction viscous_friction "
        "no_load_current no_load_speed nominal_voltage resistance_winding_housing resistance_housing_ambient "
        "resistance_winding_ambient winding_time_constant housing_time_constant max_winding_temperature diameter length"
    ).split()
    row = blanked(rng, row, optional, 0.15)
    return blanked(rng, row, ("rotor_inertia",), 0.05)


def random_gear(make, rng, key):
    size = rng.uniform(0.3, 3.0)
    row = replace(
        make.gear, key=key, ratio=float(rng.choice([-60.0, 20.0, 50.0, 100.0])), mass=0.4 * size,
        kind=str(rng.choice(["planetary", "strain_wave", "rv"])), efficiency=float(rng.choice([0.35, 0.7, 0.9])),
        repeated_peak_torque=35.0 * size, average_torque_limit=25.0 * size, momentary_torque=80.0 * size,
        no_load_torque=0.003 * size, backdriving_efficiency=float(rng.choice([0.0, 0.5, 0.8])), diameter=0.08,
        tilting_moment_limit=float(rng.choice([10.0, 300.0])), price=float(rng.uniform(40, 150)),
    )  # fmt: skip
    optional = (
        "no_load_torque backdriving_efficiency mass continuous_torque average_torque_limit repeated_peak_torque "
        "momentary_torque max_input_speed average_input_speed_limit rated_speed rated_life tilting_moment_limit "
        "axial_load_limit radial_load_limit diameter"
    ).split()
    row = with_bearing(row, np.random.default_rng((int(1e6 * size), 3)))
    row = blanked(rng, row, optional, 0.15)
    row = blanked(rng, row, ("efficiency", "inertia"), 0.05)
    return dragging(rng, row, size) if rng.random() < 0.5 else row


def dragging(rng, row, size):
    """A gear whose sheet tells mesh and drag apart; some of them incompletely."""
    row = replace(
        row, mesh_efficiency=float(rng.choice([0.45, 0.9])), drag_torque=0.02 * size, drag_speed=200.0,
        drag_speed_exponent=float(rng.choice([0.0, 0.72])), drag_temperature_1=float(rng.choice([0.0, 0.0436])),
        drag_temperature_2=0.00037, seal_drag_torque=float(rng.choice([0.0, 0.03])), starting_torque=0.015 * size,
    )  # fmt: skip
    return blanked(rng, row, ("mesh_efficiency", "drag_speed", "seal_drag_torque", "starting_torque"), 0.05)


def with_bearing(row, rng):
    """A gear whose sheet mostly prints the rollers of its output bearing, some of them too weak."""
    row = replace(
        row, bearing_dynamic_rating=float(rng.choice([600.0, 3e4])), bearing_pitch_diameter=0.05,
        bearing_static_rating=float(rng.choice([100.0, 2e4])), bearing_offset=float(rng.uniform(0.0, 0.03)),
        max_temperature=float(rng.uniform(60.0, 140.0)),
    )  # fmt: skip
    ratings = ("bearing_dynamic_rating", "bearing_static_rating", "bearing_pitch_diameter", "bearing_offset",
               "max_temperature")  # fmt: skip
    return blanked(rng, row, ratings, 0.1)


def random_brakes(rng, torque, silent):
    """Two that may hold a joint, the stronger one heavier; some state no mass, some the energy of a stop."""
    rows = []
    for i, size in enumerate(np.sort(rng.uniform(0.1, 3.0, 2))):
        mass = float(0.1 + 0.2 * size) if rng.random() >= silent else None
        energy = float(rng.uniform(0.1, 20.0)) if rng.random() < 0.5 else None
        rows.append(Brake(
            f"b{i}", "motor", static_torque=float(size * torque), inertia=float(1e-6 * size),
            power=float(5.0 + 5.0 * size), mass=mass, energy_per_stop=energy, price=float(20.0 + 30.0 * size),
            engage_time=None if size * 1e6 % 1.0 < 0.2 else 0.03,
        ))  # fmt: skip
    return tuple(rows)


def held_by_brakes(study, seed, torque=0.3, share=0.3, silent=0.1):
    """The study with brakes that some of its joints must have, all else as it was."""
    rng, motors, tasks = np.random.default_rng((seed, 99)), dict(study.catalog.motors), []
    for task in study.joints:
        brakes = random_brakes(rng, torque, silent) if rng.random() < share else ()
        if brakes:
            brakes = tuple(replace(brake, key=f"{brake.key}_{task.name}") for brake in brakes)
            pairs, rows = with_brakes(study.catalog, task.pairs, brakes)
            given = None if task.drive is None else (f"{task.drive[0]}+{brakes[0].key}", task.drive[1])
            task, motors = replace(task, pairs=pairs, brakes=brakes, drive=given), motors | rows
        tasks.append(task)
    return replace(study, joints=tuple(tasks), catalog=replace(study.catalog, motors=motors))


def counterbalanced(study, seed, share=0.3):
    """The study with springs and biases at some of its turning joints, with smooth and load-dependent friction, and
    with belts behind some gears."""
    rng, tasks = np.random.default_rng((seed, 77)), []
    for task in study.joints:
        spring = Counterbalance(
            stiffness=float(rng.uniform(100.0, 3000.0)), free_length=0.1, lever_carrier=0.25, lever_link=0.1,
            dead_centre=float(rng.uniform(-2.0, 2.0)), torque=float(rng.normal()),
        )  # fmt: skip
        chosen = rng.random() < share and task.travel_per_turn is None
        smooth = float(rng.choice([0.05, 0.5])) if task.friction.static is None and rng.random() < 0.3 else None
        friction = replace(task.friction, load_share=float(rng.choice([0.0, 0.0, 0.1])), tanh_speed=smooth)
        tasks.append(replace(task, counterbalances=(spring,) if chosen else (), friction=friction))
    belt = chained([Stage("belt", efficiency=0.9, ratio=1.5, diameter=0.1, force_limit=600.0, inertia=1e-6)])
    gears = {
        key: replace(with_stages(row, belt), key=key) if rng.random() < 0.2 else row
        for key, row in study.catalog.gears.items()
    }
    return replace(study, joints=tuple(tasks), catalog=replace(study.catalog, gears=gears))


def random_friction(rng, curved):
    if not curved:
        return Friction(float(rng.uniform(0, 1)), viscous=float(rng.uniform(0, 0.3)))
    return Friction(
        0.4, float(rng.uniform(0, 0.4)), 0.1, 0.2, static=0.9, stribeck_speed=float(rng.choice([0.1, 1.0])),
    )  # fmt: skip


def sliding_arm(make):
    """Three joints, the second one slides."""
    arm = make.planar_arm([0.4, 0.35, 0.3], [1.0, 0.8, 0.5])
    screws = np.array(arm.screws)
    screws[1] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0]
    return Arm.from_screws(
        arm.home, screws, arm.masses, arm.inertias, tip=arm.tip, joint_points=arm.joint_points,
        joint_names=arm.joint_names,
    )  # fmt: skip


def moved(make, rng, kind, samples=41):
    """The cycle of a kind of task."""
    size = float(rng.uniform(0.3, 1.5))
    if kind == "table":
        time = np.linspace(0.0, 2.0, samples)
        speed = size * np.where(time < 0.6, 0.0, np.sin(2.0 * np.pi * time))
        torque = rng.uniform(5, 40) * np.sin(4.0 * time + rng.uniform(0, 6))
        return make.table_cycle(time, torque, speed, np.gradient(speed, time))
    cycle = make.sines(3, samples=samples, duration=float(rng.uniform(1.0, 4.0)), size=size)
    if kind in ("dwell", "sliding"):
        velocity, acceleration = np.array(cycle.velocity), np.array(cycle.acceleration)
        still = slice(samples // 3, samples // 2)
        velocity[still], acceleration[still] = 0.0, 0.0
        velocity[:, 2] = acceleration[:, 2] = 0.0  # the last joint never moves
        return replace(cycle, velocity=velocity, acceleration=acceleration)
    if kind == "mix":
        other = make.sines(3, samples=31, duration=1.0, size=0.5 * size)
        return build_mix([cycle, other], [0.3, 0.7])
    return cycle


def elastic(rng, gear):
    """A gear with what a stop and a jam ask of its sheet."""
    stiff = float(rng.choice([2e3, 2e4]))
    row = replace(
        gear, stiffness_1=stiff, stiffness_2=1.3 * stiff, stiffness_3=1.6 * stiff, torque_1=5.0, torque_2=20.0,
        momentary_torque=gear.momentary_torque and gear.momentary_torque * float(rng.choice([0.5, 1.0, 3.0])),
        ratcheting_torque=float(rng.choice([50.0, 500.0])), buckling_torque=float(rng.choice([100.0, 1000.0])),
    )  # fmt: skip
    optional = ("stiffness_1", "stiffness_3", "torque_1", "torque_2", "ratcheting_torque", "buckling_torque")
    return blanked(rng, row, optional, 0.15)


def random_stop(rng):
    """On a ramp, at a current, or at the amplifier's."""
    ramp = float(rng.choice([0.05, 0.3])) if rng.random() < 0.4 else None
    current = float(rng.uniform(2.0, 30.0)) if rng.random() < 0.6 else None
    counted = rng.random() < 0.5
    return Stop(
        current, ramp, float(rng.choice([0.0, 0.02])), 3.0 if counted else None,
        float(rng.choice([1e7, 3e8])) if counted else None, bool(rng.random() < 0.3),
    )  # fmt: skip


def random_study(make: SimpleNamespace, seed: int, kind: str) -> Study:
    """A study of a kind, with random rows and a random task."""
    rng = np.random.default_rng(seed)
    motors = {f"m{i}": random_motor(make, rng, f"m{i}") for i in range(6)}
    gears = {f"g{i}": random_gear(make, rng, f"g{i}") for i in range(6)}
    rare = np.random.default_rng((seed, 11))
    gears = {key: elastic(rare, row) for key, row in gears.items()}
    pairs = (*itertools.product(motors, gears), *((key, "") for key in motors))
    cycle = moved(make, rng, kind)
    arm = None
    if kind != "table":
        arm = sliding_arm(make) if kind == "sliding" else make.planar_arm([0.4, 0.35, 0.3], rng.uniform(0.5, 2.0, 3))
    if kind == "coupled":
        matrix = differential() if rng.random() < 0.5 else belts_over([1.0])
        arm = with_coupling(arm, placed(matrix, (1, 2), 3))
    mass = None if arm is None else (DriveMass.ADDED, DriveMass.INCLUDED, DriveMass.REPLACED)[rng.integers(3)]
    tasks = []
    for i, name in enumerate(cycle.joint_names):
        mount = Mount(str(rng.choice(["parent", "child", "base"])), float(rng.uniform(-0.1, 0.1)))
        tasks.append(
            make.task(
                name, drive=None, pairs=pairs, mount=mount, friction=random_friction(rng, rng.random() < 0.5),
                motor_friction=random_friction(rng, True) if rng.random() < 0.2 else None,
                amplifier=Amplifier(*(float(x) if rng.random() < 0.8 else None for x in rng.uniform(10, 60, 2))),
                travel_per_turn=0.02 if kind == "sliding" and i == 1 else None,
                housing_to_ambient=float(rng.uniform(0.5, 4.0)) if rng.random() < 0.5 else None,
                gear_heat=float(rng.choice([0.0, 0.4, 1.0])),
                coupled=("j2", "j3") if kind == "coupled" and i > 0 else (),
                stop=random_stop(rare), contained=ContainedDrive(0.05, Mount()) if mass is DriveMass.REPLACED else None,
            )
        )  # fmt: skip
    safety = Safety(
        1.1, 1.05, 1.02, 1.03, inertia_ratio=float(rng.choice([5.0, 200.0])) if rng.random() < 0.5 else None,
        life=float(rng.choice([1e6, 1e8])) if rng.random() < 0.7 else None, temperature_margin=5.0,
    )  # fmt: skip
    study = make.study(
        cycle, arm=arm, drive_mass=mass, joints=tuple(tasks), catalog=Catalog(motors, gears), safety=safety,
        ambient=float(rng.choice([25.0, 40.0])), holding=str(rng.choice(["least", "lossless", "most"])),
        cold_start=float(rng.choice([-30.0, 0.0])) if rng.random() < 0.5 else None,
    )  # fmt: skip
    return held_by_brakes(counterbalanced(study, seed), seed)


def own_work(work: Workload, joint: int, drives: Mapping[int, Drive]) -> tuple[JointDemand, JointSeries]:
    """The work of a joint for any drive of its own, those of the other joints in place.

    Its amounts are the numbers of the joint's own drive where that rides on the link which it moves, else there are
    none: ``own_amounts``.
    """
    at = work.at(joint, drives)
    if not at.own_load:
        return at.fixed, joint_series(at.fixed)
    own = unit_loads_of(work, joint, [joint])._replace(wrench=work.unit_wrenches(joint, [joint]))
    return at.fixed, joint_series(at.fixed, own)


def pair_cases(parts: Parts, joint: int, demand: JointDemand, chosen: Any = slice(None)) -> Any:
    """The pairs of a joint as records for the judge, all or some, (P,)."""
    friction = parts.study.joints[joint].motor_friction
    shafts = as_records(
        [shaft_friction(Drive(one, NO_GEAR, motor_friction=friction)) for one in parts.motors], Friction
    )
    return paired(parts.study, joint, demand, (parts.motor_rows, shafts), parts.gear_rows, parts.pairs[joint][chosen])


def own_amounts(series: JointSeries, amounts: np.ndarray) -> np.ndarray:
    """Of pairs, (P, PARAMETERS), what the joint's work asks for: all of them or none, (P, K)."""
    return np.ascontiguousarray(amounts[:, : len(series.unit_loads.torque)])
