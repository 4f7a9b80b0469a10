"""Adaptive methods step by step: every instant and state that they ask for, against their formulas written out plainly.

Stages are those of the textbooks (matrix products, no transformation), step control is Gustafsson's as described in
Hairer, Wanner, Solving Ordinary Differential Equations II (1996), section IV.8, the first step that of Hairer, Norsett,
Wanner I (1993), section II.4. What was asked last is taken over at each kept step, so rounding does not add up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from drivetrain.solvers.integrate import integrate
from drivetrain.solvers.solver import DormandPrince54, Rodas4, Rodas5P

SMALL = 2.0**-26  # the root of the machine's precision
DOUBT = 1e-5  # of how far a call is from the state: what is left of small errors
START, BEGIN, END = np.array([1.0, -2.0, 1.0, 1e-20]), -1.0, 2.0


def rates(t: float, y: np.ndarray) -> np.ndarray:
    """A pendulum that is pushed and struck at 0.3 s, a follower with a time constant of 4 ms, one that grows."""
    struck = 200.0 * math.exp(-(((t - 0.3) / 0.005) ** 2))
    return np.array([y[1], -9.0 * math.sin(y[0]) + math.cos(3.0 * t) + struck, 250.0 * (y[0] - y[2]), 12.0 * y[3]])


@dataclass
class Asked:
    """What a solver asked for, which a reader must expect call by call."""

    t: list[float] = field(default_factory=list)
    y: list[np.ndarray] = field(default_factory=list)
    read: int = 0

    def __call__(self, t: float, y: np.ndarray) -> np.ndarray:
        self.t.append(t)
        self.y.append(y.copy())
        return rates(t, y)

    def expect(self, t: float, y: np.ndarray, base: np.ndarray, since: float) -> np.ndarray:
        """The rates at the next call, once it is what is expected."""
        assert self.read < len(self.t), "it asked for less"
        found, self.read = self.read, self.read + 1
        assert abs(self.t[found] - t) <= DOUBT * (t - since) + 1e-15, (found, self.t[found], t)
        allowed = DOUBT * np.abs(y - base).max() + 1e-15 * np.abs(base)
        assert (np.abs(self.y[found] - y) <= allowed).all(), (found, self.y[found], y)
        return rates(self.t[found], self.y[found])


def stages(method: Any, asked: Asked, t: float, y: np.ndarray, h: float, first: Any, jacobian: Any, drift: Any) -> Any:
    """The end of a step and its error in the classical form of both kinds of method; the last rates."""
    if jacobian is None:
        from scipy.integrate import RK45

        k = [first]
        for row, c in zip(RK45.A[1:], RK45.C[1:], strict=True):
            k.append(asked.expect(t + c * h, y + h * row[: len(k)] @ k, y, t))
        end = y + h * RK45.B @ k
        k.append(asked.expect(t + h, end, y, t))
        return end, h * RK45.E @ k, k[-1]
    gamma = np.linalg.inv(np.eye(len(method.c)) / method.gamma - method.c)
    alpha, k = method.a @ gamma, np.zeros((len(gamma), len(y)))
    for s in range(len(gamma)):
        f = asked.expect(t + method.times[s] * h, y + alpha[s] @ k, y, t) if s else first
        goal = h * f + h * jacobian @ (gamma[s, :s] @ k[:s]) + h * h * method.gammas[s] * drift
        k[s] = np.linalg.solve(np.eye(len(y)) - h * method.gamma * jacobian, goal)
    return y + alpha[-1] @ k, method.error[0] @ gamma @ k, None


def differences(asked: Asked, t: float, y: np.ndarray, f: Any, h: float, floor: Any, limit: float) -> Any:
    """The Jacobian by forward differences of sqrt(eps) of what the state is or becomes, and df/dt."""
    later = min(t + min(h, SMALL * max(abs(t), h)), limit)
    drift = asked.expect(later, y, y, t) - f
    drift /= asked.t[asked.read - 1] - t
    jacobian = np.empty((len(y), len(y)))
    for j in range(len(y)):
        moved = y.copy()
        moved[j] += SMALL * max(abs(y[j]), h * abs(f[j]), floor[j]) * (1.0 if f[j] >= 0.0 else -1.0)
        jacobian[:, j] = asked.expect(t, moved, y, t) - f
        jacobian[:, j] /= asked.y[asked.read - 1][j] - y[j]  # as rounding has left it
    return jacobian, drift


def look_for_a_jump(asked: Asked, t: float, y: np.ndarray, h: float, new: np.ndarray, allowed: np.ndarray) -> None:
    """Halve a step that was refused towards where the rate that changes most changes most, until it is smooth."""

    def at(share: float) -> np.ndarray:
        return asked.expect(t + share * h, y + share * (new - y), y, t)

    left, right = at(0.0), at(1.0)
    i = int(np.argmax(abs(right - left) / allowed))
    low, high, whole, left, right = 0.0, 1.0, abs(right - left)[i], left[i], right[i]
    while abs(right - left) >= 0.05 * whole:
        middle = 0.5 * (low + high)
        value = at(middle)[i]
        if abs(value - left) >= abs(right - value):
            high, right = middle, value
        else:
            low, left = middle, value


def written_out(solver: Any, asked: Asked, y: np.ndarray, ends: list[float]) -> dict[str, int]:
    """Expect call after call; what the whole run cost."""
    method, atol, settings = solver.compiled_settings(len(START))
    rtol, power = settings["rtol"], 1.0 / method.order
    work = {"steps": 0, "rejected": 0, "jacobians": 0}
    t, step, before, refused = BEGIN, 0.0, None, False
    base, since, failures = y, t, 0
    for end in ends:
        limit, f, jacobian = end if end == ends[-1] else np.nextafter(end, -1.0), None, None
        while t < end:
            if f is None:
                f = asked.expect(t, y, base, since)
                t, y = asked.t[asked.read - 1], asked.y[asked.read - 1]
            allowed = atol + rtol * abs(y)
            if step == 0.0 and not (step := settings.get("first_step", 0.0)):
                d0, d1 = max(abs(y) / allowed), max(abs(f) / allowed)
                h = min(1e-6 if min(d0, d1) < 1e-5 else 0.01 * d0 / d1, settings["largest_step"], end - t)
                d2 = max(abs(asked.expect(t + h, y + h * f, y, t) - f) / allowed) / h
                step = min(100.0 * h, (0.01 / max(d1, d2)) ** 0.25)
            h, left = min(step, settings["largest_step"]), end - t
            h = left if 1.1 * h >= left else 0.5 * left if 2.0 * h > left else h
            if method.gamma:
                if jacobian is None:
                    floor = np.where(np.isfinite(atol), atol / rtol, 1e-3)
                    jacobian = differences(asked, t, y, f, h, floor, limit)
                    work["jacobians"] += 1
                h = min(h, 1.0 / max(np.diag(jacobian[0])))
            taken = (asked.t[asked.read] - t) / method.times[1]  # to rounding what it should be, and taken over
            assert taken == pytest.approx(h, rel=DOUBT)
            h = left if h == left else taken
            new, error, last = stages(method, asked, t, y, h, f, *(jacobian or (None, None)))
            error = max(abs(error) / (atol + rtol * np.maximum(abs(y), abs(new))))
            if error > 1.0:
                step, refused = h * max(0.1, 0.85 / error**0.25), True
                work["rejected"], failures = work["rejected"] + 1, failures + 1
                if failures == 3 or work["rejected"] % 10 == 0:
                    look_for_a_jump(asked, t, y, h, new, allowed)
                continue
            small = max(error, 1e-10)
            factor = 0.85 / small**power
            if before is not None:
                factor = min(factor, 0.85 * h / before[0] * (before[1] / small**2) ** power)
            factor = min(max(factor, 0.2), 2.0 if refused else 6.0)
            step = max(step, h * factor) if h < step and factor >= 1.0 else h * factor
            before, refused, failures = (h, max(error, 1e-2)), False, 0
            base, since = y, t
            t, y, f, jacobian = end if h == left else t + h, new, last, None
            if last is not None:  # where this was asked is where the next step begins
                y, t = asked.y[asked.read - 1], end if h == left else asked.t[asked.read - 1]
            work["steps"] += 1
    return work


@pytest.mark.parametrize(
    "solver",
    [
        Rodas4(1e-4), Rodas4(1e-6, 1e-7), Rodas5P(1e-4, 1e-5), DormandPrince54(1e-6, 1e-6), DormandPrince54(1e-3, 1e-5),
        Rodas4(1e-3, 1e-3, largest_step=0.05), Rodas5P(1e-4, 1e-6, first_step=0.02),
        Rodas5P(1e-7, 1e-9, first_step=0.5), Rodas4(1e-4, (1e-5, math.inf, 1e-6, 1e-5)),
    ],
    ids=repr,
)  # fmt: skip
@pytest.mark.parametrize("start", [START, np.zeros(4)], ids=["moving", "resting"])
def test_every_call_of_a_run(solver: Any, start: np.ndarray) -> None:
    asked = Asked()
    found = integrate(solver, asked, start, [BEGIN, 0.4, END], breakpoints=[0.3])
    work = written_out(solver, asked, start, [0.3, END])
    assert found.stopped == "" and asked.read == len(asked.t) == found.work.rates
    assert work["rejected"] > 0 and work == {name: getattr(found.work, name) for name in work}
