"""A joint's load with what its own drive adds: sums of rows times amounts, as numpy takes them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from drivetrain.sizing.judge.judge import add_rows, add_up


@pytest.mark.parametrize("count", [1, 2, 5])
def test_add_up_is_a_sum_of_rows(count: int) -> None:
    """Five are the parameters of a drive, which have a pass of their own; a bearing has no moment along its axis."""
    rng, samples = np.random.default_rng(count), 4
    amounts = rng.normal(size=count)

    def rows(*shape: int) -> SimpleNamespace:
        last = {"torque": (), "stop": (), "inertia": (), "static": (), "wrench": (6,)}
        return SimpleNamespace(**{name: rng.normal(size=(*shape, *own, samples)) for name, own in last.items()})

    load, added, total = rows(), rows(count), rows()
    kept = total.wrench.copy()
    add_up(load, added, amounts, total, True)
    for name in ("torque", "stop", "inertia", "static"):
        wanted = getattr(load, name) + np.einsum("k,kt->t", amounts, getattr(added, name))
        np.testing.assert_allclose(getattr(total, name), wanted, atol=1e-14)
    wanted = load.wrench + np.einsum("k,kct->ct", amounts, added.wrench)
    np.testing.assert_allclose(np.delete(total.wrench, 2, 0), np.delete(wanted, 2, 0), atol=1e-14)
    np.testing.assert_array_equal(total.wrench[2], kept[2])
    add_rows(load.static, added.static, amounts, out := np.empty(samples))
    np.testing.assert_array_equal(out, total.static)
