"""A joint's load with what its own drive adds: sums of rows times amounts, as numpy takes them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from drivetrain.sizing.judge.judge import add_rows, added_up


@pytest.mark.parametrize("count", [1, 2, 5])
def test_added_up_is_a_sum_of_rows(count: int) -> None:
    """Five are the parameters of a drive, which have a pass of their own; a bearing has no moment along its axis."""
    rng, samples = np.random.default_rng(count), 4
    amounts = rng.normal(size=count)

    def rows(*shape: int) -> SimpleNamespace:
        inertia, static, wrench = (rng.normal(size=(*shape, *last, samples)) for last in ((), (), (6,)))
        return SimpleNamespace(inertia=inertia, static=static, wrench=wrench)

    load, added, total = rows(), rows(count), rows()
    kept = total.wrench.copy()
    assert added_up(load, added, amounts, total) is total
    for name in ("inertia", "static"):
        wanted = getattr(load, name) + np.einsum("k,kt->t", amounts, getattr(added, name))
        np.testing.assert_allclose(getattr(total, name), wanted, atol=1e-14)
    wanted = load.wrench + np.einsum("k,kct->ct", amounts, added.wrench)
    np.testing.assert_allclose(np.delete(total.wrench, 2, 0), np.delete(wanted, 2, 0), atol=1e-14)
    np.testing.assert_array_equal(total.wrench[2], kept[2])
    add_rows(load.static, added.static, amounts, out := np.empty(samples))
    np.testing.assert_array_equal(out, total.static)
