"""The duty cycle: order, times, payloads and closed periods; integrals against closed forms."""

import numpy as np
import pytest

from drivetrain.errors import InputError
from drivetrain.motion.duty_cycle import Step, build_cycle, sample_weights
from drivetrain.motion.motion import LoadTable, Motion
from drivetrain.motion.point_to_point import waypoint_motion
from drivetrain.motion.profiles import Quintic, Trapezoid

GO = waypoint_motion("go", ("a",), [[0.0], [1.0]], profile=Trapezoid(), durations=[1.0], sample_time=0.1)
BACK = waypoint_motion("back", ("a",), [[1.0], [0.0]], profile=Quintic(), durations=[2.0], sample_time=0.1)


def periodic_mean(values, time):
    return np.tensordot(sample_weights(time), values, axes=1) / (time[-1] - time[0])


def table(speed, torque, acceleration=((0.0,), (0.0,))):
    return LoadTable(
        "press", ("axis",), np.array([5.0, 6.0]), np.array(torque), np.array(speed), np.array(acceleration)
    )


def test_order_times_and_labels():
    cycle = build_cycle(
        [
            Step(dwell=0.5, name="wait"),
            Step(GO, payload="box"),
            Step(dwell=0.25, payload="box"),
            Step(BACK),
            Step(dwell=0.0),
            Step(dwell=1.0, payload="lid"),
        ]
    )
    assert cycle.duration == pytest.approx(0.5 + 1.0 + 0.25 + 2.0 + 1.0)
    assert cycle.segment_names == ("wait", "go", "dwell", "back", "dwell", "dwell")
    assert cycle.payload_names == ("box", "lid")
    assert (np.diff(cycle.time) >= 0.0).all()
    assert (np.diff(cycle.segment) >= 0).all()
    begins = {int(s): float(cycle.time[cycle.segment == s][0]) for s in np.unique(cycle.segment)}
    assert begins == pytest.approx({0: 0.0, 1: 0.5, 2: 1.5, 3: 1.75, 5: 3.75})
    assert [int(cycle.payload[cycle.segment == s][0]) for s in begins] == [-1, 0, 0, -1, 1]
    assert (cycle.position[cycle.segment == 2] == 1.0).all()
    assert not cycle.velocity[cycle.segment == 2].any()
    assert cycle.torque is None
    assert not cycle.position.flags.writeable


def test_repetitions_follow_each_other():
    both = build_cycle([Step(GO), Step(BACK)])
    turn = Motion("turn", ("a",), both.time, both.position, both.velocity, both.acceleration)
    cycle = build_cycle([Step(turn, repetitions=3)])
    assert cycle.duration == pytest.approx(9.0)
    assert cycle.segment_names == ("turn",)
    assert cycle.position[:, 0] == pytest.approx(np.tile(both.position[:, 0], 3))
    middle = (cycle.time >= 3.0) & (cycle.time <= 6.0)
    assert np.interp(4.2, cycle.time[middle], cycle.position[middle, 0]) == pytest.approx(
        np.interp(1.2, both.time, both.position[:, 0])
    )


def test_all_gaps_and_an_open_end_are_reported():
    with pytest.raises(InputError) as caught:
        build_cycle([Step(GO), Step(GO)])
    places = [fault.place for fault in caught.value.faults]
    assert places == ["cycle, go to go", "cycle, end (go) to start (go)"]
    assert all("a stands at 1 and goes on from 0" in fault.problem for fault in caught.value.faults)
    with pytest.raises(InputError, match=r"does not close: a stands at 57\.2958 and goes on from 0 \[deg\]"):
        build_cycle([Step(GO)], slides=[False])
    with pytest.raises(InputError, match=r"stands at 1 and goes on from 0 \[m\]"):
        build_cycle([Step(GO)], slides=[True])
    cycle = build_cycle([Step(GO)], may_stay_open=True)
    assert any(note.startswith("warning: end (go) to start (go)") for note in cycle.notes)


def test_a_gap_of_rounding_is_noted_and_a_larger_one_is_an_error():
    def shifted(by):
        return Motion("near", ("a",), BACK.time, BACK.position + by, BACK.velocity, BACK.acceleration)

    cycle = build_cycle([Step(GO), Step(shifted(2e-4))])
    assert sum(note.startswith("warning") for note in cycle.notes) == 2
    assert build_cycle([Step(GO), Step(shifted(1e-9))]).notes == (*GO.notes,)
    with pytest.raises(InputError, match="gap"):
        build_cycle([Step(GO), Step(shifted(2e-3))])


def test_steps_of_speed_between_motions_give_a_warning():
    running = Motion("run", ("a",), GO.time, GO.position, GO.velocity + 0.3, GO.acceleration)
    notes = build_cycle([Step(running), Step(BACK)]).notes
    warnings = [note for note in notes if note.startswith("warning")]
    assert len(warnings) == 2
    assert "go" not in warnings[0]
    assert "steps by -0.3 [rad/s or m/s]" in warnings[0]
    assert "steps by 0.3" in warnings[1]
    turning = build_cycle([Step(running), Step(BACK)], slides=[False])
    assert any("steps by -17.19 [deg/s]" in note for note in turning.notes)


def test_load_tables_integrate_speed_to_position_and_dwells_hold_the_torque():
    up = table([[0.0], [2.0]], [[3.0], [7.0]], [[2.0], [2.0]])
    down = table([[2.0], [0.0]], [[1.0], [4.0]], [[-2.0], [-2.0]])
    cycle = build_cycle([Step(up), Step(down), Step(dwell=2.0)])
    assert cycle.time.tolist() == [0.0, 1.0, 1.0, 2.0, 2.0, 4.0]
    assert cycle.position[:, 0].tolist() == [0.0, 1.0, 1.0, 2.0, 2.0, 2.0]  # halves of 2 rad/s x 1 s
    assert cycle.torque is not None
    assert cycle.torque[:, 0].tolist() == [3.0, 7.0, 1.0, 4.0, 4.0, 4.0]
    assert any("hold the last torque" in note for note in cycle.notes)


def test_all_wrong_steps_are_reported():
    other = waypoint_motion("other", ("b",), [[0.0], [1.0]], profile=Quintic(), durations=[1.0])
    still = table([[0.0], [0.0]], [[1.0], [1.0]])
    with pytest.raises(InputError) as caught:
        build_cycle(
            [
                Step(GO, repetitions=0),
                Step(),
                Step(GO, dwell=1.0),
                Step(dwell=-1.0),
                Step(other),
                Step(still, payload="x"),
            ]
        )
    messages = "\n".join(str(fault) for fault in caught.value.faults)
    for words in (
        "mixes",
        "[0] (go): repetitions",
        "[1] (dwell): must be either",
        "[2] (go): must be either",
        "[3] (dwell): a dwell must not",
        "[4] (other): has other joints",
        "[5] (press): a load table",
    ):
        assert words in messages
    with pytest.raises(InputError, match="at least one motion"):
        build_cycle([Step(dwell=1.0)])


def test_weights_integrate_straight_lines_exactly_and_see_both_sides_of_a_step():
    time = np.array([0.0, 0.5, 2.0, 2.0, 2.25])
    values = np.array([1.0, 2.0, 5.0, -1.0, 0.0])
    by_hand = 0.5 * 1.5 + 1.5 * 3.5 + 0.0 + 0.25 * -0.5
    assert sample_weights(time) @ values == pytest.approx(by_hand, rel=1e-15)
    assert sample_weights(time).sum() == pytest.approx(2.25)
    assert float(periodic_mean(values, time)) == pytest.approx(by_hand / 2.25)
    both = periodic_mean(np.stack([values, np.ones(5)], axis=1), time)
    assert both == pytest.approx([by_hand / 2.25, 1.0])


def test_mean_square_of_acceleration_of_a_trapezoid():
    # 4.5 rad/s^2 for two thirds of the time, zero for one third.
    cycle = build_cycle([Step(GO)], may_stay_open=True)
    assert periodic_mean(cycle.acceleration**2, cycle.time) == pytest.approx([4.5**2 * 2.0 / 3.0], rel=1e-12)
