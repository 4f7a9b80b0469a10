"""A mix of cycles: weights, parts, names, and faults."""

from __future__ import annotations

import numpy as np
import pytest

from drivetrain.errors import InputError
from drivetrain.motion.duty_cycle import Step, build_cycle, build_mix, sample_weights
from drivetrain.motion.motion import Motion


def swing(size: float, length: float, *, payload: str | None = None, samples: int = 21, names=("a", "b")):
    time = np.linspace(0.0, length, samples)
    rate = 2.0 * np.pi / length
    shape = np.ones(len(names))
    position = size * np.outer(1.0 - np.cos(rate * time), shape)
    velocity = size * rate * np.outer(np.sin(rate * time), shape)
    acceleration = size * rate**2 * np.outer(np.cos(rate * time), shape)
    motion = Motion("swing", names, time, position, velocity, acceleration)
    return build_cycle([Step(motion, payload=payload)])


def test_a_mix_of_one_cycle_is_that_cycle():
    cycle = swing(0.1, 2.0)
    np.testing.assert_array_equal(cycle.weights, sample_weights(cycle.time))
    assert cycle.parts == (slice(0, 21),) and cycle.shares == (1.0,)
    assert build_mix([cycle], [1.0]) is cycle
    np.testing.assert_array_equal(cycle.before, np.roll(np.arange(21), 1))
    np.testing.assert_array_equal(cycle.after, np.roll(np.arange(21), -1))


def test_averages_of_a_mix_are_those_of_its_parts_by_share():
    slow, fast = swing(0.1, 3.0), swing(0.2, 1.0, samples=31)
    mix = build_mix([slow, fast], [0.75, 0.25], names=["slow", "fast"])
    assert mix.duration == pytest.approx(4.0) and mix.weights.sum() == pytest.approx(4.0)
    for share in (0.6, 0.1):
        mix = build_mix([slow, fast], [share, 1.0 - share])
        means = [sample_weights(one.time) @ one.velocity[:, 0] ** 2 / one.duration for one in (slow, fast)]
        got = mix.weights @ mix.velocity[:, 0] ** 2 / mix.weights.sum()
        assert got == pytest.approx(share * means[0] + (1.0 - share) * means[1], rel=1e-12)


def test_shares_by_length_are_one_after_the_other():
    slow, fast = swing(0.1, 3.0), swing(0.2, 1.0)
    mix = build_mix([slow, fast], [0.75, 0.25])
    np.testing.assert_allclose(mix.weights, sample_weights(mix.time), rtol=1e-14)


def test_every_part_repeats_by_itself():
    mix = build_mix([swing(0.1, 3.0, samples=5), swing(0.2, 1.0, samples=4)], [0.5, 0.5], names=["slow", "fast"])
    assert mix.parts == (slice(0, 5), slice(5, 9))
    assert mix.before.tolist() == [4, 0, 1, 2, 3, 8, 5, 6, 7]
    assert mix.after.tolist() == [1, 2, 3, 4, 0, 6, 7, 8, 5]
    assert [mix.part_at(t) for t in (0.0, 2.9, 3.1, 4.0)] == [0, 0, 1, 1]
    assert (np.diff(mix.time) >= 0.0).all() and mix.time[4] == mix.time[5] == 3.0


def test_payloads_and_segments_keep_their_names():
    bare, first, second = swing(0.1, 1.0), swing(0.1, 1.0, payload="box"), swing(0.1, 1.0, payload="bag")
    mix = build_mix([first, bare, second, first], [0.25] * 4)
    assert mix.payload_names == ("box", "bag")
    assert [mix.payload[part][0] for part in mix.parts] == [0, -1, 1, 0]
    assert [mix.segment[part][0] for part in mix.parts] == [0, 1, 2, 3]
    assert len(mix.segment_names) == 4


@pytest.mark.parametrize(("shares", "words"), [
    ([0.5, 0.4], "is 90 %"),
    ([0.5, 0.6], "is 110 %"),
    ([1.5, -0.5], "between 0 and 1"),
    ([0.5, float("nan")], "between 0 and 1"),
    ([1.0], "one share for each of 2"),
])  # fmt: skip
def test_invalid_shares_are_errors(shares, words):
    with pytest.raises(InputError, match=words):
        build_mix([swing(0.1, 1.0), swing(0.1, 2.0)], shares)


def test_all_faults_at_once():
    other = swing(0.1, 1.0, names=("a", "c"))
    with pytest.raises(InputError) as error:
        build_mix([swing(0.1, 1.0), other], [0.5, 0.6], names=["x", "x"])
    assert len(error.value.faults) == 3
    mix = build_mix([swing(0.1, 1.0), swing(0.1, 2.0)], [0.5, 0.5])
    with pytest.raises(InputError, match="is a mix itself"):
        build_mix([mix, swing(0.1, 1.0)], [0.5, 0.5])


def test_rounded_shares_are_normalised():
    mix = build_mix([swing(0.1, 1.0)] * 3, [0.333333, 0.333333, 0.333334], names=["x", "y", "z"])
    assert sum(mix.shares) == pytest.approx(1.0, abs=1e-15)
    assert mix.weights.sum() == pytest.approx(mix.duration, rel=1e-14)
