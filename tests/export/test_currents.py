"""Current files, read back by readers in this test: the currents of all joints agree within one count."""

from __future__ import annotations

import csv
import math
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from export.driven_arms import coupled

from drivetrain.drive.amplifier import Amplifier
from drivetrain.errors import InputError
from drivetrain.export.currents import current_scales, write_currents
from drivetrain.sizing.currents import PARTS, current_commands
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.study.read import load_study
from drivetrain.whole_files import shipped


@pytest.fixture(scope="module")
def ur5():
    """The example's arm with one set of drives from its catalogue."""
    study = load_study(shipped("examples") / "ur5_pick_and_place" / "study.yaml")
    drives = {task.name: task.pairs[len(task.pairs) // 2] for task in study.joints}
    return evaluate(study, drives)


@pytest.fixture(scope="module")
def wide(ur5):
    """The same with amplifiers of 100 A, every eighth sample and all samples that share an instant."""
    joints = tuple(replace(task, amplifier=replace(task.amplifier, peak_current=100.0)) for task in ur5.study.joints)
    cycle = ur5.study.cycle
    names = ("time", "position", "velocity", "acceleration", "payload", "segment")
    twice = np.flatnonzero(np.diff(cycle.time) <= 0.0)
    kept = np.union1d(np.arange(0, len(cycle.time), 8), [*twice, *(twice + 1)])
    few = replace(cycle, **{name: getattr(cycle, name)[kept] for name in names})
    return evaluate(replace(ur5.study, joints=joints, cycle=few), ur5.drives)


def amperes_of(unit: str) -> float:
    """DC-equivalent amperes per phase ampere, from equal copper loss of two and three windings."""
    return {"dc": 1.0, "rms": np.sqrt(3.0 / 2.0), "peak": np.sqrt(3.0) / 2.0}[unit]


def decoded(text: str, numbers: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Currents [A dc] computed from the text of the header alone: objects, full scales and conventions."""
    found = {}
    for name, values in numbers.items():
        line = next(line for line in text.splitlines() if re.search(rf"(^|[#*] ){re.escape(name)}: ", line))
        if "0x6075" in line:
            milliamperes, unit = re.search(r"0x6075 = (\S+) mA (\w+)", line).groups()
            found[name] = values / 1000.0 * float(milliamperes) * 1e-3 * amperes_of(unit)
        elif "0x6076" in line:
            millinewtonmetres, constant = re.search(r"0x6076 = (\S+) mN m.* constant (\S+) N m/A", line).groups()
            found[name] = values / 1000.0 * float(millinewtonmetres) * 1e-3 / float(constant)
        elif " are " in line:
            most, full, unit = re.search(r": (\S+) (?:V|counts) are (\S+) A (\w+)", line).groups()
            found[name] = values / float(most) * float(full) * amperes_of(unit)
        else:
            found[name] = values * amperes_of(re.search(r"amperes, (\w+)", line).group(1))
    return found


def read_csv(path: Path) -> dict[str, np.ndarray]:
    rows = [row for row in csv.reader(line for line in path.read_text().splitlines() if line[0] != "#")]
    columns = np.array(rows[1:], dtype=float).T
    return {re.sub(r" \[.*", "", name): column for name, column in zip(rows[0], columns, strict=True)}


def read_yaml(path: Path) -> dict[str, np.ndarray]:
    message = yaml.load(path.read_text(), yaml.CSafeLoader)
    assert set(message) == {"joint_names", "points"}
    points = message["points"]
    assert all(set(p) == {"time_from_start", "positions", "velocities", "effort"} for p in points)
    assert all(0 <= p["time_from_start"]["nanosec"] < 10**9 for p in points)
    times = np.array([p["time_from_start"]["sec"] + 1e-9 * p["time_from_start"]["nanosec"] for p in points])
    effort, positions, velocities = (
        np.array([p[what] for p in points]) for what in ("effort", "positions", "velocities")
    )
    return {"time": times, "positions": positions, "velocities": velocities} | dict(
        zip(message["joint_names"], effort.T, strict=True)
    )


def read_header(path: Path, folder: Path) -> dict[str, np.ndarray]:
    """Read by a C program that is compiled with the header and prints its values."""
    cc = shutil.which("cc") or shutil.which("gcc")
    assert cc, "a C compiler is needed"
    program = folder / "print.c"
    program.write_text(
        f'#include <stdio.h>\n#include "{path.name}"\n'
        'int main(void) { int i, k; for (i = 0; i < CURRENTS_JOINTS; i++) { printf("%s", currents_joint[i]);'
        ' for (k = 0; k < CURRENTS_SAMPLES; k++) printf(" %.17g", (double)currents_command[k][i]); puts(""); }'
        ' printf("time"); for (k = 0; k < CURRENTS_SAMPLES; k++) printf(" %.17g", currents_time[k]);'
        ' printf("\\nunit"); for (i = 0; i < CURRENTS_JOINTS; i++) printf(" %.17g", currents_amperes_per_unit[i]);'
        " return 0; }\n"
    )
    strict = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror"]
    subprocess.run([cc, *strict, "-o", folder / "print", program], check=True)
    printed = subprocess.run([folder / "print"], check=True, capture_output=True, text=True).stdout
    return {line.split()[0]: np.array(line.split()[1:], dtype=float) for line in printed.splitlines()}


CASES = [
    ("amperes", "dc", None), ("amperes", "rms", None), ("amperes", None, None), ("cia402", "rms", None),
    ("cia402", None, None),
    ("cia402", "peak", 12.0), ("cia402", "torque", 0.9), ("analogue", "peak", 80.0), ("counts", "rms", 60.0),
    ("counts", None, None),
]  # fmt: skip


@pytest.mark.parametrize(("scale", "basis", "full"), CASES)
def test_currents_come_back(wide, tmp_path: Path, scale: str, basis: str | None, full: float | None) -> None:
    scales = current_scales(wide, scale, basis=basis, full_scale=full)
    for suffix in (".csv", ".h", ".yaml"):
        path = write_currents(wide, tmp_path / f"currents{suffix}", scales)
        read = read_header(path, tmp_path) if suffix == ".h" else {".csv": read_csv, ".yaml": read_yaml}[suffix](path)
        numbers = {name: read[name] for name in wide.joints}
        time = wide.study.cycle.time
        lasting = np.append(np.diff(time) > 0.0, True)
        np.testing.assert_allclose(read["time"], (time - time[0])[lasting], atol=1e-9)
        assert (np.diff(read["time"]) > 0.0).all()  # otherwise ROS controllers refuse it
        for name, current in decoded(path.read_text(), numbers).items():
            # Half a count of rounding; the header gives nine digits of the scale.
            count = scales[name].amperes if scales[name].whole else 0.0
            assert np.abs(current - wide.joints[name].series.current[lasting]).max() <= 0.501 * count + 1e-7
            if scales[name].whole:
                np.testing.assert_array_equal(numbers[name], np.rint(numbers[name]))


def test_a_trajectory_moves_the_joints_and_not_the_shafts_of_their_motors(make, tmp_path: Path) -> None:
    """Two joints with a differential: the currents are those of the shafts, the motion is that of the joints."""
    found = coupled(make)
    read = read_yaml(write_currents(found, tmp_path / "c.yaml", current_scales(found, "amperes", basis="dc")))
    np.testing.assert_allclose(read["positions"], found.study.cycle.position, atol=1e-15)
    np.testing.assert_allclose(read["velocities"], found.study.cycle.velocity, atol=1e-15)
    for name, joint in found.joints.items():
        np.testing.assert_allclose(read[name], joint.series.current, atol=1e-12 * np.abs(joint.series.current).max())
        assert name == "j1" or np.abs(joint.series.position - read["positions"][:, int(name[1]) - 1]).max() > 0.1


def test_the_default_basis_is_that_of_the_study(make_one, make, ur5) -> None:
    """The rated current in rms for amplifiers in rms; the rated torque for dc, which object 0x6075 does not have."""
    assert all("0x6075" in one.base and "rms" in one.base for one in current_scales(ur5, "cia402").values())
    assert "torque constant" in current_scales(make_one, "cia402")["j1"].base
    rated = 1e3 * make.motor.torque_constant * make.motor.nominal_current
    assert f"0x6076 = {rated:.9g} mN m" in current_scales(make_one, "cia402")["j1"].base


@pytest.mark.parametrize("basis", ["rms", "peak"])
def test_a_brushed_motor_carries_direct_current(make, make_one, basis: str) -> None:
    """Of which RMS value and amplitude are the current itself, unlike that of the same motor with three phases."""
    catalog = replace(make_one.study.catalog, motors={"m1": replace(make.motor, kind="brushed")})
    found = evaluate(replace(make_one.study, catalog=catalog))
    assert current_scales(found, "amperes", basis=basis)["j1"].amperes == 1.0
    assert current_scales(make_one, "amperes", basis=basis)["j1"].amperes == pytest.approx(
        {"rms": math.sqrt(1.5), "peak": math.sqrt(0.75)}[basis]
    )
    assert "0x6075 = 6000 mA dc" in current_scales(found, "cia402", basis=basis)["j1"].base
    assert current_scales(found, "cia402", basis=basis, full_scale=4.0)["j1"].amperes == pytest.approx(4e-3)
    table = current_commands(found)
    np.testing.assert_array_equal(table["phase current RMS [A]"], table["current [A]"])
    np.testing.assert_array_equal(table["phase current peak [A]"], table["current [A]"])


def test_the_head_names_study_hold_and_rate(ur5, tmp_path: Path) -> None:
    scales = current_scales(ur5, "amperes")
    for suffix in (".csv", ".h", ".yaml"):
        text = write_currents(ur5, tmp_path / f"c{suffix}", scales, rate=1000.0, hold=0).read_text()
        assert ur5.study.digest in text and "1000 Hz" in text and "the sample before" in text
    rows = read_csv(tmp_path / "c.csv")
    np.testing.assert_allclose(np.diff(rows["time"]), 1e-3, atol=1e-9)
    np.testing.assert_allclose(read_yaml(tmp_path / "c.yaml")["time"], rows["time"], atol=1e-9)


def test_currents_beyond_sixteen_bits_are_reported(ur5, tmp_path: Path) -> None:
    """All joints are reported and nothing is written: 32.8 times the rated current of 0.02 A is 0.6 A."""
    path = tmp_path / "c.csv"
    with pytest.raises(InputError, match="beyond the \\+-32767") as caught:
        write_currents(ur5, path, current_scales(ur5, "cia402", basis="rms", full_scale=0.001))
    assert len(caught.value.faults) == 6 and not path.exists()
    with pytest.raises(InputError, match="10 V"):
        write_currents(ur5, path, current_scales(ur5, "analogue", full_scale=0.01))


def test_the_largest_number_that_fits_is_written(make_one, tmp_path: Path) -> None:
    """With a joint's peak current as full scale, the largest number is that of 16 bits; any more is an error."""
    peak = float(np.abs(make_one.joints["j1"].series.current).max())
    path = write_currents(make_one, tmp_path / "c.csv", current_scales(make_one, "counts", basis="dc", full_scale=peak))
    assert np.abs(read_csv(path)["j1"]).max() == 32767
    with pytest.raises(InputError, match="beyond"):
        scales = current_scales(make_one, "counts", basis="dc", full_scale=peak * 0.9999)
        write_currents(make_one, path, scales)


@pytest.fixture
def make_one(make):
    time = np.linspace(0.0, 1.0, 51)
    cycle = make.table_cycle(time, 3.0 * np.cos(6.0 * time), np.sin(6.0 * time), 6.0 * np.cos(6.0 * time))
    return evaluate(make.study(cycle))


@pytest.mark.parametrize(
    ("scale", "options", "problem"),
    [
        ("cia401", {}, "cia402"),
        ("cia402", {"basis": "dc"}, "rms, peak, torque"),
        ("counts", {"basis": "rsm"}, "rms"),
        ("counts", {"full_scale": {"j9": 3.0}}, "j9"),
        ("counts", {"full_scale": -3.0}, "positive"),
    ],
)
def test_invalid_scales_are_errors(make_one, scale, options, problem) -> None:
    with pytest.raises(InputError, match=problem):
        current_scales(make_one, scale, **options)


def test_missing_full_scales_are_errors(make) -> None:
    time = np.linspace(0.0, 1.0, 11)
    cycle = make.table_cycle(time, time, time, time)
    found = evaluate(make.study(cycle, joints=(make.task(amplifier=Amplifier()),)))
    assert "30 A" in current_scales(found, "counts")["j1"].base  # the peak current of the motor
    motor = replace(found.joints["j1"].drive.motor, nominal_current=None, peak_current=None)
    joint = replace(found.joints["j1"], drive=replace(found.joints["j1"].drive, motor=motor))
    with pytest.raises(InputError, match="peak_current"):
        current_scales(replace(found, joints={"j1": joint}), "counts")
    with pytest.raises(InputError, match="nominal current"):
        current_scales(replace(found, joints={"j1": joint}), "cia402", basis="rms")


def test_unknown_suffixes_are_errors(make_one, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.csv, \.h, \.yaml"):
        write_currents(make_one, tmp_path / "c.txt", current_scales(make_one, "amperes"))


def test_rounding_of_zero_is_written_as_zero(ur5) -> None:
    """No component below 1e-12 of the largest current, no negative zero, and the components still add up."""
    table = current_commands(ur5)
    parts = [f"{part} current [A]" for part in PARTS]
    for _, rows in table.groupby("joint"):
        values, whole = rows[parts].to_numpy(), rows["current [A]"].to_numpy()
        most = np.abs(whole).max()
        assert not ((values != 0.0) & (np.abs(values) < 1e-12 * most)).any()
        np.testing.assert_allclose(values.sum(axis=1), whole, atol=1e-11 * most)
    numbers = table.select_dtypes(float).to_numpy()
    assert not (np.signbit(numbers) & (numbers == 0.0)).any()
