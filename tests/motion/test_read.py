"""Motions and load tables from files: what is read, what is a fault with row and column, what is a warning."""

import math

import numpy as np
import pytest

from drivetrain.errors import InputError
from drivetrain.motion.point_to_point import waypoint_motion
from drivetrain.motion.profiles import Quintic, SCurve, Trapezoid
from drivetrain.motion.read import read_load_table, read_motion
from drivetrain.motion.smoothing import SavitzkyGolay, SmoothingSpline

JOINTS = ("shoulder", "elbow")
MOTION = waypoint_motion(
    "m",
    JOINTS,
    [[0, 0], [1, -2], [0, 0]],
    profile=Quintic(),
    durations=[1.0, 1.5],
    dwell=[0.1, 0.2, 0],
    sample_time=0.01,
)
TIME = np.arange(0.0, 2.0005, 0.01)
WAVES = np.stack([np.sin(math.pi * TIME), 0.5 * np.cos(2 * math.pi * TIME)], axis=1)
SPEEDS = np.stack([math.pi * np.cos(math.pi * TIME), -math.pi * np.sin(2 * math.pi * TIME)], axis=1)
RATES = np.stack([-(math.pi**2) * WAVES[:, 0], -4 * math.pi**2 * WAVES[:, 1]], axis=1)


def write(tmp_path, header, columns, *, form="%.17g", separator=",", name="motion.csv"):
    path = tmp_path / name
    rows = [separator.join(form % value for value in row) for row in np.column_stack(columns)]
    path.write_text("\n".join([separator.join(header), *rows]) + "\n", encoding="utf-8")
    return path


def edited(path, row, column, text):
    """The file with one cell replaced; rows are counted from the header, which is row 1."""
    lines = path.read_text(encoding="utf-8").splitlines()
    cells = lines[row - 1].split(",")
    cells[column] = text
    lines[row - 1] = ",".join(cells)
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


def faults_of(path, joints=JOINTS, **options):
    with pytest.raises(InputError) as caught:
        read_motion(path, joints, **options)
    return [str(fault) for fault in caught.value.faults]


def warnings(motion):
    return [note for note in motion.notes if note.startswith("warning: ")]


HEADER = ["time [s]", "q_shoulder [rad]", "q_elbow [rad]"]


def test_all_columns_given_come_back_to_the_bit(tmp_path):
    header = [*HEADER, *(f"qd_{j} [rad/s]" for j in JOINTS), *(f"qdd_{j} [rad/s^2]" for j in JOINTS)]
    trapezoid = waypoint_motion("t", JOINTS, [[0, 0], [1, -2]], profile=Trapezoid(), durations=[1.0], sample_time=0.01)
    for motion in (MOTION, trapezoid):  # one motion has a rest of two samples, one has two rows at one instant
        columns = [motion.time, motion.position, motion.velocity, motion.acceleration]
        read = read_motion(write(tmp_path, header, columns), JOINTS)
        for what in ("time", "position", "velocity", "acceleration"):
            assert (getattr(read, what) == getattr(motion, what)).all()
        assert warnings(read) == []
        assert any("as given" in note for note in read.notes)


def test_missing_rates_are_differentiated_and_the_method_is_noted(tmp_path):
    motion = read_motion(write(tmp_path, HEADER, [TIME, WAVES]), JOINTS)
    # Errors of (omega dt)^2/6 = 7e-4 of the speed and half of that of the acceleration; first order at the ends.
    assert motion.velocity[1:-1] == pytest.approx(SPEEDS[1:-1], abs=3e-3)
    assert motion.acceleration[1:-1] == pytest.approx(RATES[1:-1], abs=1e-2)
    assert any(note.startswith("shoulder, elbow: velocity and acceleration by parabolas") for note in motion.notes)
    assert warnings(motion) == []


def test_coarse_numbers_are_smoothed_and_the_method_is_noted(tmp_path):
    fine = np.arange(0.0, 2.0005, 0.001)
    degrees = np.degrees(np.sin(math.pi * fine))
    path = write(tmp_path, ["t [ms]", "q_a [deg]"], [1e3 * fine, np.round(degrees, 2)], form="%.6g")
    motion = read_motion(path, ["a"])
    truth = -(math.pi**2) * np.sin(math.pi * fine)
    assert np.abs(motion.acceleration).max() == pytest.approx(math.pi**2, rel=0.03)
    # The errors are largest at the ends, where there are neighbours on one side only.
    assert motion.acceleration[50:-50, 0] == pytest.approx(truth[50:-50], abs=0.05 * math.pi**2)
    assert any("smoothing spline" in note and "0.000175" in note for note in motion.notes)


def test_given_speeds_are_differentiated_once(tmp_path):
    header = [*HEADER, "qd_shoulder [deg/s]"]
    motion = read_motion(write(tmp_path, header, [TIME, WAVES, np.degrees(SPEEDS[:, 0])]), JOINTS)
    assert motion.velocity[:, 0] == pytest.approx(SPEEDS[:, 0], rel=1e-12, abs=1e-12)
    assert motion.acceleration[1:-1, 0] == pytest.approx(RATES[1:-1, 0], abs=1e-2)
    assert any(note.startswith("shoulder: acceleration by") for note in motion.notes)


def test_the_method_of_differentiation_can_be_chosen(tmp_path):
    path = write(tmp_path, HEADER, [TIME, WAVES])
    for way, words in ((SavitzkyGolay(0.11), "Savitzky-Golay"), (SmoothingSpline(1e-6), "smoothing spline")):
        motion = read_motion(path, JOINTS, smoothing=way)
        assert motion.acceleration[2:-2] == pytest.approx(RATES[2:-2], abs=0.05)
        assert any(words in note for note in motion.notes)


@pytest.mark.parametrize(
    "header",
    [
        ["time [s]", "q1 [rad]", "q2 [rad]"],
        ["t [s]", "q_1 [rad]", "q_2 [rad]"],
        ["Time [s]", "Shoulder [rad]", "ELBOW [rad]"],
        ["time [s]", "position_shoulder [rad]", "angle elbow [rad]"],
    ],
)
def test_names_of_columns(tmp_path, header):
    motion = read_motion(write(tmp_path, header, [TIME, WAVES]), JOINTS)
    assert (motion.position == WAVES).all()


def test_semicolons_decimal_commas_comments_and_empty_lines(tmp_path):
    path = write(tmp_path, HEADER, [TIME, WAVES], separator=";", form="%.12f")
    text = path.read_text(encoding="utf-8").replace(".", ",")
    path.write_text("\ufeff# from the cell\n\n" + text + "\n\n;;\n", encoding="utf-8")
    motion = read_motion(path, JOINTS)
    assert motion.position == pytest.approx(WAVES, abs=1e-11)


def test_the_order_of_joints_is_the_requested_one(tmp_path):
    motion = read_motion(write(tmp_path, HEADER, [TIME, WAVES]), JOINTS[::-1], name="turned")
    assert (motion.position == WAVES[:, ::-1]).all()
    assert (motion.name, motion.joint_names) == ("turned", JOINTS[::-1])


def test_prismatic_joints(tmp_path):
    header = ["time [s]", "q_shoulder [rad]", "q_elbow [mm]", "qd_elbow [mm/s]"]
    path = write(tmp_path, header, [TIME, WAVES[:, 0], 1e3 * WAVES[:, 1], 1e3 * SPEEDS[:, 1]])
    motion = read_motion(path, JOINTS, position_units=["rad", "m"])
    assert motion.position == pytest.approx(WAVES, rel=1e-12, abs=1e-15)
    faults = faults_of(path, position_units=["rad", "rad"])
    assert len(faults) == 2
    assert all("joint elbow turns" in fault for fault in faults)


def test_every_fault_of_cells_and_headers_at_once(tmp_path):
    header = ["time [s]", "q_shoulder [Hz]", "q_elbwo [rad]", "current [A]", "qd_shoulder"]
    path = write(tmp_path, header, [TIME, WAVES, TIME, TIME])
    edited(path, 4, 0, "n/a")
    edited(path, 9, 3, "nan")
    edited(path, 12, 3, "")
    problem = "\n".join(faults_of(path))
    for words in (
        "row 4, column time [s]: must be a finite number (found 'n/a')",
        "row 9, column current [A]: must be a finite number (found 'nan')",
        "row 12, column current [A]: must be a finite number (found '')",
        "column q_shoulder [Hz]: must be an angle in a unit such as rad, but 'Hz' is a frequency",
        "column q_elbwo [rad]: is no column known here (found 'q_elbwo'); did you mean 'q_elbow'",
        "column qd_shoulder: needs a unit in its header, such as qd_shoulder [rad/s] or qd_shoulder [m/s]",
        "the position of joint elbow is missing: no column q_elbow [rad]; did you mean 'q_elbwo'",
    ):
        assert words in problem
    assert str(path) in problem
    assert problem.count("\n") == 6


def test_unknown_columns_are_noted(tmp_path):
    motion = read_motion(write(tmp_path, [*HEADER, "current [A]"], [TIME, WAVES, TIME]), JOINTS)
    assert "column current [A] is not used" in motion.notes


def test_a_column_of_text_is_reported_briefly(tmp_path):
    path = write(tmp_path, [*HEADER, "state [-]"], [TIME, WAVES, TIME])
    lines = path.read_text(encoding="utf-8").splitlines()
    path.write_text("\n".join([lines[0], *(f"{line},x" for line in lines[1:])]), encoding="utf-8")
    faults = faults_of(path)  # a row of five cells instead of four
    assert "must have 4 cells" in faults[0]
    path.write_text("\n".join([lines[0], *(line.rsplit(",", 1)[0] + ",x" for line in lines[1:])]), encoding="utf-8")
    faults = faults_of(path)
    assert len(faults) == 6
    assert f"{len(TIME) - 5} more cells" in faults[-1]


@pytest.mark.parametrize(
    ("text", "problem"),
    [("", "at least two rows"), ("time [s],q_a [rad]\n0,1\n", "at least two rows")],
)
def test_files_without_data_are_errors(tmp_path, text, problem):
    path = tmp_path / "m.csv"
    path.write_text(text, encoding="utf-8")
    assert problem in faults_of(path)[0]
    assert "cannot be read" in faults_of(tmp_path / "none.csv")[0]


def test_doubled_and_missing_columns(tmp_path):
    problem = "\n".join(faults_of(write(tmp_path, ["q1 [rad]", "q_shoulder [rad]", "q2 [rad]"], [TIME, WAVES])))
    assert "no column time [s]" in problem
    assert "column q_shoulder [rad]: a second position of shoulder" in problem
    problem = "\n".join(faults_of(write(tmp_path, ["time [s]", "q1 [rad]", "q1 [rad]"], [TIME, WAVES])))
    assert "row 1: two columns have this header" in problem
    problem = "\n".join(faults_of(write(tmp_path, ["time [s]", "t [ms]", "q1 [rad]"], [TIME, WAVES]), ["a"]))
    assert "column t [ms]: a second time" in problem


def test_time_that_decreases_or_repeats_is_a_fault(tmp_path):
    path = write(tmp_path, HEADER, [TIME, WAVES])
    edited(edited(path, 10, 0, "0.01"), 20, 0, repr(float(TIME[17])))
    faults = faults_of(path)
    assert len(faults) == 2
    assert "row 10, column time [s]: time must increase (found 0.01)" in faults[0]
    assert "row 20" in faults[1]


def test_uneven_sampling_is_noted_and_a_gap_gives_a_warning(tmp_path):
    jitter = TIME + np.random.default_rng(3).uniform(-2e-3, 2e-3, len(TIME))
    waves = np.stack([np.sin(math.pi * jitter), 0.5 * np.cos(2 * math.pi * jitter)], axis=1)
    motion = read_motion(write(tmp_path, HEADER, [jitter, waves]), JOINTS)
    assert any(note.startswith("sampling is not uniform") for note in motion.notes)
    keep = (TIME < 0.5) | (TIME > 0.6)
    gap = read_motion(write(tmp_path, HEADER, [TIME[keep], WAVES[keep]]), JOINTS)
    assert any("moves in the gap after t = 0.49 s" in note for note in warnings(gap))


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (lambda q: np.where(TIME > 1.0, q + 0.5, q), "position jumps by 0.4"),
        (lambda q: np.where(np.arange(len(q)) == 60, q + 0.5, q), "position has a spike"),
        (lambda q: np.where(TIME > 1.0, q - 2 * math.pi, q), "unwrap"),
    ],
)
def test_steps_spikes_and_wraps(tmp_path, change, problem):
    waves = np.stack([WAVES[:, 0], change(WAVES[:, 1])], axis=1)
    faults = faults_of(write(tmp_path, HEADER, [TIME, waves]))
    assert len(faults) == 1
    assert problem in faults[0]
    assert "column q_elbow [rad]" in faults[0]
    assert f"row {62 if 'spike' in problem else 103}," in faults[0]


def test_a_jump_is_reported_in_the_unit_of_its_column(tmp_path):
    jump = np.degrees(np.where(TIME > 1.0, WAVES[:, 1] + 0.5, WAVES[:, 1]))
    header = [HEADER[0], HEADER[1], "q_elbow [deg]"]
    (fault,) = faults_of(write(tmp_path, header, [TIME, WAVES[:, 0], jump]))
    after = float(jump[101])
    assert f"jumps by {after - float(jump[100]):.4g} deg at t = 1.01 s" in fault
    assert f"found {after:.8g}" in fault


@pytest.mark.parametrize("profile", [Trapezoid(), Trapezoid(0.02), Quintic(), SCurve()], ids=str)
@pytest.mark.parametrize("sample_time", [0.001, 0.01, 0.05])
@pytest.mark.parametrize("digits", [3, 12])
def test_ordinary_motions_are_no_jumps(tmp_path, profile, sample_time, digits):
    motion = waypoint_motion(
        "m", ("a",), [[0], [1], [-1], [0]], profile=profile, durations=[0.4, 0.6, 0.4], dwell=[0.3, 0, 0.3, 0.3]
    )
    time = np.arange(0.0, motion.time[-1], sample_time)
    position = np.interp(time, motion.time, motion.position[:, 0])
    read = read_motion(write(tmp_path, ["time [s]", "a [rad]"], [time, np.round(position, digits)]), ["a"])
    assert np.isfinite(read.acceleration).all()


def test_two_rows_at_one_instant_may_not_differ_in_position(tmp_path):
    header = [*HEADER, *(f"qd_{j} [rad/s]" for j in JOINTS), *(f"qdd_{j} [rad/s^2]" for j in JOINTS)]
    columns = np.column_stack([TIME, WAVES, SPEEDS, RATES])
    columns = np.insert(columns, 50, columns[50], axis=0)
    assert len(read_motion(write(tmp_path, header, [columns]), JOINTS).time) == len(TIME) + 1
    columns[50, 2] += 1e-3
    (fault,) = faults_of(write(tmp_path, header, [columns]))
    assert "row 53, column q_elbow [rad]: position steps at t = 0.5 s" in fault
    assert "must increase" in faults_of(write(tmp_path, HEADER, [columns[:, :3]]))[0]


@pytest.mark.parametrize(
    ("scale", "unit", "words"),
    [
        (180 / math.pi, "rad/s", "the rates look like degrees"),
        (60 / (2 * math.pi), "rad/s", "the rates look like rpm"),
        (math.pi / 180, "rad/s", "the values look like degrees"),
        (-1.0, "rad/s", "the sign is turned"),
        (2.0, "rad/s", "misses by"),
    ],
)
def test_speeds_that_are_not_the_derivative(tmp_path, scale, unit, words):
    path = write(tmp_path, [*HEADER, f"qd_elbow [{unit}]"], [TIME, WAVES, scale * SPEEDS[:, 1]])
    (fault,) = faults_of(path)
    assert words in fault
    assert "column qd_elbow [rad/s]: is not the derivative of q_elbow [rad]" in fault


def test_accelerations_that_are_not_the_derivative(tmp_path):
    header = [*HEADER, "qd_elbow [rad/s]", "qdd_elbow [deg/s^2]"]
    (fault,) = faults_of(write(tmp_path, header, [TIME, WAVES, SPEEDS[:, 1], RATES[:, 1]]))
    assert "column qdd_elbow [deg/s^2]: is not the derivative of qd_elbow [rad/s]" in fault
    assert "the values look like degrees" in fault
    fine = read_motion(write(tmp_path, header, [TIME, WAVES, SPEEDS[:, 1], np.degrees(RATES[:, 1])]), JOINTS)
    assert fine.acceleration[:, 1] == pytest.approx(RATES[:, 1])


def test_a_filtered_speed_is_only_a_warning(tmp_path):
    late = np.interp(TIME - 0.02, TIME, SPEEDS[:, 1])
    motion = read_motion(write(tmp_path, [*HEADER, "qd_elbow [rad/s]"], [TIME, WAVES, late]), JOINTS)
    (warning,) = warnings(motion)
    assert "column qd_elbow [rad/s] is not the derivative" in warning


def test_an_arm_that_stays_at_a_number_whose_mean_rounds_is_read(tmp_path):
    place = next(one for one in np.sqrt(np.linspace(0.1, 1.0, 91)) if np.full(len(TIME), one).mean() != one)
    columns = [TIME, np.full(len(TIME), place), 0.0 * TIME]
    motion = read_motion(write(tmp_path, ["time [s]", "q_elbow [rad]", "qd_elbow [rad/s]"], columns), ("elbow",))
    assert not warnings(motion) and (motion.position == place).all()


def test_a_joint_at_rest_with_noise_in_its_speed_is_accepted(tmp_path):
    noise = np.random.default_rng(4).normal(scale=1e-3, size=len(TIME))
    columns = [TIME, WAVES[:, 0], np.full(len(TIME), 0.2), noise]
    motion = read_motion(write(tmp_path, [*HEADER, "qd_elbow [rad/s]"], columns), JOINTS)
    assert (motion.position[:, 1] == 0.2).all()
    assert warnings(motion) == []


@pytest.mark.parametrize(
    ("unit", "scale", "words"),
    [("rad", 180 / math.pi, "are these degrees?"), ("deg", 1.0, "are these radians?")],
)
def test_degrees_and_radians_mixed_up(tmp_path, unit, scale, words):
    header = ["time [s]", f"q_shoulder [{unit}]", f"q_elbow [{unit}]"]
    motion = read_motion(write(tmp_path, header, [TIME, scale * WAVES]), JOINTS)
    assert any(words in note for note in warnings(motion))


def test_rpm_taken_for_radians_gives_a_warning(tmp_path):
    # Position and speed with the same wrong factor are consistent with each other.
    header = [*HEADER, "qd_elbow [rad/s]"]
    motion = read_motion(write(tmp_path, header, [TIME, 20 * WAVES, 20 * SPEEDS[:, 1]]), JOINTS)
    assert any("is this deg/s, rpm or a motor's speed?" in note for note in warnings(motion))


def test_a_spike_in_a_given_acceleration_gives_a_warning(tmp_path):
    header = [*HEADER, *(f"qd_{j} [rad/s]" for j in JOINTS), *(f"qdd_{j} [rad/s^2]" for j in JOINTS)]
    rates = RATES.copy()
    rates[70, 1] += 60.0
    motion = read_motion(write(tmp_path, header, [TIME, WAVES, SPEEDS, rates]), JOINTS)
    assert any("acceleration of elbow has a spike" in note and "t = 0.7 s" in note for note in warnings(motion))


def test_coarse_sampling_gives_a_warning(tmp_path):
    motion = read_motion(write(tmp_path, HEADER, [TIME[::10], WAVES[::10]]), JOINTS)
    assert any("sampled coarsely" in note for note in warnings(motion))


TABLE = "time [s],torque [Nm],speed [rpm]\n0,10,0\n1,10,60\n1,2,60\n3,2,60\n3.5,-8,0\n5,0,0\n"


def table_file(tmp_path, text):
    path = tmp_path / "press.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_load_table_becomes_samples_with_both_slopes(tmp_path):
    load = read_load_table(table_file(tmp_path, TABLE))
    turn = 2 * math.pi
    assert load.joint_names == ("axis",)
    assert load.time.tolist() == [0, 1, 1, 3, 3, 3.5, 3.5, 5]
    assert load.torque[:, 0].tolist() == [10, 10, 2, 2, 2, -8, -8, 0]
    assert load.speed[:, 0] == pytest.approx(turn * np.array([0, 1, 1, 1, 1, 0, 0, 0]))
    assert load.acceleration[:, 0] == pytest.approx(turn * np.array([1, 1, 0, 0, -2, -2, 0, 0]))
    assert any("acceleration from speed" in note for note in load.notes)


def test_a_load_table_of_two_joints_with_accelerations(tmp_path):
    text = (
        "t [s],torque_a [Nm],speed_a [rad/s],torque_b [mNm],speed_b [deg/s],"
        "acceleration_a [rad/s^2],acceleration_b [rad/s^2]\n"
        "0,1,0,500,0,2,0\n1,1,2,500,0,2,0\n2,1,4,500,0,2,0\n"
    )
    load = read_load_table(table_file(tmp_path, text))
    assert load.joint_names == ("a", "b")
    assert load.torque[0].tolist() == [1.0, 0.5]
    assert load.acceleration.tolist() == [[2, 0], [2, 0], [2, 0]]
    assert read_load_table(table_file(tmp_path, text), ["b", "a"]).torque[0].tolist() == [0.5, 1.0]


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("1,2,60", "1,2,30", r"row 4, column speed \[rpm\]: speed steps at one instant: an impulse \(found 30"),
        ("speed [rpm]", "speed [Hz]", "rpm, rad/s or deg/s"),
        ("torque [Nm]", "torque [N]", "torque or energy"),
        ("torque [Nm]", "force [N]", "a slide is an arm of one prismatic joint"),
        ("3.5,-8,0", "2.5,-8,0", "time must not go back"),
        ("3,2,60", "1,2,60", "at most two samples"),
        ("speed [rpm]", "sped [rpm]", "did you mean 'speed'"),
        ("3,2,60", "3,?,60", "row 5, column torque"),
        ("3,2,60", '3,"2,60', "row 5: must have 3 cells"),
        ("3,2,60", "3,2e200,60", "row 5, column torque .*too large to calculate with"),
        ("3.5,-8,0", "3.0000000000000004,-8,60", "at least 1e-12 s"),
    ],
)
def test_faults_of_load_tables(tmp_path, old, new, problem):
    with pytest.raises(InputError, match=problem):
        read_load_table(table_file(tmp_path, TABLE.replace(old, new)))


def test_accelerations_of_a_load_table_must_be_those_of_its_speed(tmp_path):
    text = "t [s],torque [Nm],speed [rad/s],acceleration [rad/s^2]\n0,1,0,2\n1,1,4,2\n2,1,8,2\n"
    with pytest.raises(InputError, match="not the derivative of speed"):
        read_load_table(table_file(tmp_path, text))


def test_the_error_of_coarse_sampling_is_that_of_a_second_difference(tmp_path):
    """Of a sine with w h = 1.2 between samples it is (w h)^2/12, as found to about a tenth."""
    time = 0.3 * np.arange(80)
    wave = np.sin(4.0 * time)
    motion = read_motion(write(tmp_path, ["time [s]", "elbow [rad]"], [time, wave]), ["elbow"])
    (note,) = [note for note in warnings(motion) if "sampled coarsely" in note]
    share = float(note.split("about ")[1].split(" %")[0])
    assert share == pytest.approx(100.0 * 1.2**2 / 12.0, rel=0.15)
