"""What may change nothing, held against every check of a whole study: an arm, its drives, motions, supply."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Any, get_type_hints

import numpy as np
import pytest
import random_tasks
from random_tasks import KINDS, random_study

import drivetrain as dt
from drivetrain.catalog.read import Catalog
from drivetrain.catalog.schema import BRAKE_COLUMNS, GEAR_COLUMNS, MOTOR_COLUMNS
from drivetrain.drive.friction import Friction
from drivetrain.sizing.judge.checks import REQUIREMENTS

MOTOR: dict[str, Any] = {
    "kind": "brushless", "current_basis": "dc", "winding_basis": "line_line", "resistance": 0.5,
    "torque_constant": 0.05, "inductance": 2e-4, "rotor_inertia": 3e-5, "mass": 0.6, "nominal_voltage": 48.0,
    "no_load_current": 0.2, "no_load_speed": 950.0, "nominal_current": 6.0, "peak_current": 60.0, "max_speed": 900.0,
    "resistance_winding_housing": 1.0, "resistance_housing_ambient": 3.0, "winding_time_constant": 20.0,
    "housing_time_constant": 900.0, "max_winding_temperature": 155.0,
}  # fmt: skip
IN_OTHER_UNITS = {
    "resistance": "500 mohm", "torque_constant": "5 N cm/A", "inductance": "0.2 mH", "rotor_inertia": "300 g cm^2",
    "mass": "600 g", "nominal_voltage": "0.048 kV", "no_load_current": "200 mA",
    "no_load_speed": f"{950.0 * 30.0 / math.pi!r} rpm", "nominal_current": "6000 mA", "peak_current": "0.06 kA",
    "max_speed": f"{900.0 * 180.0 / math.pi!r} deg/s", "winding_time_constant": "20000 ms",
    "housing_time_constant": "15 min", "max_winding_temperature": "428.15 K",
}  # fmt: skip
GEAR: dict[str, Any] = {
    "kind": "planetary", "ratio": 100.0, "average_torque_limit": 150.0, "continuous_torque": 150.0,
    "repeated_peak_torque": 300.0, "momentary_torque": 600.0, "max_input_speed": 700.0, "efficiency": 0.75,
    "mass": 0.8, "inertia": 1e-5,
}  # fmt: skip
LOSSLESS: dict[str, Any] = {  # as good as: a motor without any no-load current is refused
    "motors": {"M": MOTOR | {"no_load_current": 1e-5}}, "gears": {"G": GEAR | {"efficiency": 1.0}},
}  # fmt: skip
REST: dict[str, Any] = {
    "motors": {"M": MOTOR}, "gears": {"G": GEAR}, "drives": ("M", "G"), "drive_mass": "added",
    "supply": {"voltage": 48.0, "peak_power": 4000.0, "mean_power": 2000.0, "regenerated_power": 1000.0},
    "amplifier": {"current_basis": "dc", "peak_current": 80.0, "continuous_current": 40.0},
}  # fmt: skip
TIME = np.linspace(0.0, 2.0, 101)
ROUNDING = 1e-9  # sums in another order, over a hundred samples
MARCHED = 1e-6  # the same in a stop that is followed step by step


def motion(n: int, time: np.ndarray = TIME, turn: float = 1.0) -> tuple[np.ndarray, ...]:
    """A closed motion in which no joint keeps step with another, run backward for ``turn`` = -1."""
    rate, phase, size = np.pi, 0.7 * np.arange(n), 0.6 / (1.0 + np.arange(n))
    angle = turn * rate * time[:, np.newaxis] + phase
    return time, size * np.sin(angle), turn * size * rate * np.cos(angle), -size * rate**2 * np.sin(angle)


def figures(evaluation: dt.Evaluation, among: dict[str, str] | None = None) -> dict[tuple[str, str], Any]:
    """What every check of every joint and of all together is asked and allowed; ``among`` gives joints other names."""
    named = among or {}
    found = {
        (named.get(name, name), one.name): one for name, joint in evaluation.joints.items() for one in joint.checks
    }
    found |= {("", one.name): one for one in evaluation.shared}
    return {key: (one.required, one.available, one.verdict) for key, one in found.items()}


def assert_same(one: dict[Any, Any], other: dict[Any, Any], tolerance: float = ROUNDING) -> None:
    assert one.keys() == other.keys()
    assert sum(required is not None for required, _, _ in one.values()) > 15
    for key, (required, available, verdict) in one.items():
        assert other[key][2] == verdict, key
        for mine, its in ((required, other[key][0]), (available, other[key][1])):
            assert its == (mine if mine is None else pytest.approx(mine, rel=tolerance, abs=tolerance)), key


@pytest.fixture(scope="module")
def arm() -> dt.Arm:
    return dt.load_arm("ur5")


@pytest.fixture(scope="module")
def plain(arm: dt.Arm) -> Any:
    return figures(dt.evaluate(dt.study(arm=arm, motion=motion(arm.n), **REST)))


def test_the_mirror_image_of_an_arm_is_asked_the_same(arm: dt.Arm, plain: Any) -> None:
    mirror = np.diag([1.0, -1.0, 1.0])
    across = np.diag([1.0, -1.0, 1.0, 1.0])
    axes = np.concatenate([-arm.screws[:, :3] @ mirror, arm.screws[:, 3:] @ mirror], axis=1)  # a turn is axial
    image = replace(
        arm, home=across @ arm.home @ across, screws=axes, inertias=mirror @ arm.inertias @ mirror,
        tip=across @ arm.tip @ across, gravity=mirror @ arm.gravity, joint_points=arm.joint_points @ mirror,
    )  # fmt: skip
    assert_same(plain, figures(dt.evaluate(dt.study(arm=image, motion=motion(arm.n), **REST))))


def turned_about(study: Any) -> Any:
    """The same machine, every joint counted the other way round."""

    def swapped(law: Friction | None) -> Friction | None:
        ahead = {} if law is None else {"coulomb": law.coulomb_negative, "viscous": law.viscous_negative}
        back = {} if law is None else {"coulomb_negative": law.coulomb, "viscous_negative": law.viscous}
        return law and replace(law, **{name: value for name, value in ahead.items() if value is not None}, **back)

    cycle, tasks = study.cycle, []
    series = {name: getattr(cycle, name) for name in ("position", "velocity", "acceleration", "torque")}
    for task in study.joints:
        across = replace(task.mount, offset=-task.mount.offset)
        own = None if task.motor_friction is None else swapped(task.motor_friction)
        tasks.append(replace(task, friction=swapped(task.friction), motor_friction=own, mount=across))
    turned = replace(cycle, **{name: -values for name, values in series.items() if values is not None})
    arm = None if study.arm is None else replace(study.arm, screws=-study.arm.screws)
    return replace(study, cycle=turned, joints=tuple(tasks), arm=arm)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", [200, 201, 204])
def test_axes_counted_the_other_way_round_change_nothing(make: Any, kind: str, seed: int) -> None:
    """Whatever a study holds: friction that differs by direction, stops, brakes, mixes, slides, coupled motors."""
    study, rng = random_study(make, seed, kind), np.random.default_rng(seed)
    tasks = [replace(t, drive=t.pairs[rng.integers(len(t.pairs))], pairs=(), counterbalances=()) for t in study.joints]
    study = replace(study, joints=tuple(tasks))
    assert_same(figures(dt.evaluate(study)), figures(dt.evaluate(turned_about(study))), tolerance=MARCHED)


HEAVIER = dict.fromkeys(("kg", "kg m^2", "N", "N m", "N m/A", "N m/rad", "N m s/rad", "J", "W", "V", "ohm", "H"), 2.0)
LIGHTER = dict.fromkeys(("K/W", "F"), 0.5)


def twice_as_heavy(row: Any) -> Any:
    """A part or a law with all masses, forces, powers and voltages doubled, currents and temperatures kept."""
    hints = get_type_hints(type(row), include_extras=True)
    units = {one.name: one.unit for one in (*MOTOR_COLUMNS, *GEAR_COLUMNS, *BRAKE_COLUMNS)}
    units |= {"stage_torque": "N m", "stage_inertia": "kg m^2"}
    changed = {}
    for name, value in vars(row).items():
        stated = re.search(r"unit='([^']*)'", str(hints[name]))
        share = (HEAVIER | LIGHTER).get(stated[1] if stated else units.get(name, ""))
        if value is not None and share is not None:
            changed[name] = share * value
    return replace(row, **changed)


@pytest.mark.parametrize("kind", ["table", "arm", "mix", "dwell", "coupled"])
@pytest.mark.parametrize("seed", [500, 504])
def test_a_machine_twice_as_heavy_needs_twice_as_much(make: Any, kind: str, seed: int, monkeypatch: Any) -> None:
    """Mass by mass, so that no formula holds a number with a dimension; twos keep every sum exact."""
    monkeypatch.setattr(random_tasks, "blanked", lambda _rng, row, _names, _share: row)  # stand-ins have dimensions
    study, rng = random_study(make, seed, kind), np.random.default_rng(seed)
    tasks = [replace(t, drive=t.pairs[rng.integers(len(t.pairs))], pairs=(), counterbalances=()) for t in study.joints]
    study = replace(study, joints=tuple(tasks))

    def doubled(task: Any) -> Any:
        laws = {name: getattr(task, name) for name in ("friction", "motor_friction", "amplifier", "contained")}
        heavier = {name: twice_as_heavy(law) for name, law in laws.items() if law is not None}
        brakes, mounting = tuple(twice_as_heavy(one) for one in task.brakes), task.housing_to_ambient
        return replace(task, **heavier, brakes=brakes, housing_to_ambient=mounting and 0.5 * mounting)

    rows = [{k: twice_as_heavy(row) for k, row in part.items()} for part in (study.catalog.motors, study.catalog.gears)]
    rows[0] = {k: replace(row, brake=twice_as_heavy(row.brake)) for k, row in rows[0].items()}
    arm, cycle = study.arm, study.cycle
    heavy = replace(
        study, joints=tuple(doubled(task) for task in study.joints), catalog=Catalog(*rows),
        arm=arm and replace(arm, masses=2.0 * arm.masses, inertias=2.0 * arm.inertias),
        cycle=cycle if cycle.torque is None else replace(cycle, torque=2.0 * cycle.torque),
        supply=twice_as_heavy(study.supply),
    )  # fmt: skip
    units = {one.name: one.unit for one in REQUIREMENTS}
    light = {
        (place, name): (*(value and HEAVIER.get(units.get(name), 1.0) * value for value in numbers), verdict)
        for (place, name), (*numbers, verdict) in figures(dt.evaluate(study)).items()
    }  # fmt: skip
    assert_same(light, figures(dt.evaluate(heavy)), tolerance=ROUNDING)


def test_other_units_change_nothing(arm: dt.Arm, plain: Any) -> None:
    stated = REST | {
        "motors": {"M": MOTOR | IN_OTHER_UNITS},
        "gears": {"G": GEAR | {"repeated_peak_torque": "30000 N cm", "momentary_torque": "0.6 kN m", "mass": "800 g",
                               "inertia": "100 g cm^2", "efficiency": "75 %"}},
        "supply": {"voltage": "48000 mV", "peak_power": "4 kW", "mean_power": "2 kW", "regenerated_power": "1 kW"},
    }  # fmt: skip
    assert_same(plain, figures(dt.evaluate(dt.study(arm=arm, motion=motion(arm.n), **stated))))


def test_other_names_change_nothing(arm: dt.Arm, plain: Any) -> None:
    names = {f"axis {i}": name for i, name in enumerate(arm.joint_names)}
    stated = REST | {"motors": {"a/b": MOTOR}, "gears": {"Getriebe": GEAR}, "drives": ("a/b", "Getriebe")}
    called = dt.study(arm=replace(arm, joint_names=tuple(names)), motion=motion(arm.n), name="other", **stated)
    assert_same(plain, figures(dt.evaluate(called), names))


def test_the_order_of_sheets_changes_nothing(arm: dt.Arm, plain: Any) -> None:
    weaker = MOTOR | {"peak_current": 10.0}
    for motors in ({"M": MOTOR, "W": weaker}, {"W": weaker, "M": MOTOR}):
        given = REST | {"motors": motors}
        assert_same(plain, figures(dt.evaluate(dt.study(arm=arm, motion=motion(arm.n), **given))))


def test_the_order_of_joints_changes_nothing(make: Any) -> None:
    """Of joints that are not one arm: there the order is the chain's."""
    rng = np.random.default_rng(4)
    torque, speed, acceleration = (size * rng.normal(size=(30, 3)) for size in (8.0, 5.0, 40.0))
    friction = [Friction(coulomb=0.1 * i, viscous=0.02) for i in range(3)]

    def at(order: list[int]) -> Any:
        columns = [values[:, order] for values in (torque, speed, acceleration)]
        joints = [make.task(f"j{k + 1}", friction=friction[i]) for k, i in enumerate(order)]
        return dt.evaluate(make.study(make.table_cycle(np.linspace(0.0, 3.0, 30), *columns), joints=tuple(joints)))

    assert_same(figures(at([0, 1, 2])), figures(at([2, 0, 1]), {"j1": "j3", "j2": "j1", "j3": "j2"}))


def test_backward_in_time_without_losses_the_same_torques(arm: dt.Arm) -> None:
    """Torque is even in time: torques, currents, their heat and speeds are the same; what is drawn is given back."""
    there, back = (
        dt.evaluate(dt.study(arm=arm, motion=motion(arm.n, turn=turn), **REST | LOSSLESS)) for turn in (1.0, -1.0)
    )
    # Not what counts the order of samples, or the sign of power: heat's ripple, voltage, supply, stops.
    even = re.compile(
        r"gear (repeated|average|max|mean)|motor (speed|peak|rms|nominal|continuous)|output bearing|inertia"
    )
    one, other = ({key: found for key, found in figures(each).items() if even.match(key[1])} for each in (there, back))
    assert len(one) >= 7 * arm.n
    assert_same(one, other, 1e-4)
    for name, joint in there.joints.items():
        np.testing.assert_allclose(joint.series.gear_torque, back.joints[name].series.gear_torque[::-1], rtol=1e-7)


def test_a_motion_in_two_pieces_is_the_motion(arm: dt.Arm, plain: Any) -> None:
    half = len(TIME) // 2
    whole = motion(arm.n)
    pieces = [tuple(values[part] - (values[part][0] if values is TIME else 0.0) for values in whole)
              for part in (slice(0, half + 1), slice(half, None))]  # fmt: skip
    assert_same(plain, figures(dt.evaluate(dt.study(arm=arm, motion=pieces, **REST))))
