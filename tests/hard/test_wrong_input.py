"""Numbers that are none, or cannot be, anywhere in the input: an error that tells the place, never a NaN."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from corruption import spoiled_call, verdict
from hard_case import Figure, hard_case
from public_calls import public_calls
from spoiled_files import spoilers

CALLS = 8560  # with the files, ten thousand
FINE = ("refused", "answered")


def told(wrong: Mapping[str, Any], right: Mapping[str, Any]) -> str:
    """The arguments that were spoiled, in short."""
    return str({name: value for name, value in wrong.items() if str(value) != str(right[name])})[:300]


def test_the_calls_are_right_before_they_are_spoiled() -> None:
    for name, (function, arguments) in public_calls().items():
        assert verdict(lambda function=function, given=arguments: function(**given)) == "answered", name


def naive_verdicts(rng: np.random.Generator) -> int:
    """Of a thousand spoiled samples, those that a textbook's formula answers with no number, or another error."""
    wrong = 0
    for _ in range(1000):
        q, qd = np.array([0.3, -1.0]), np.array([0.5, 0.2])
        q, qd = spoiled_call({"q": q, "qd": qd}, rng).values()
        wrong += verdict(lambda q=q, qd=qd: _textbook_2r(q, qd)) not in FINE
    return wrong


def _textbook_2r(q: Any, qd: Any) -> np.ndarray:
    """Equation 8.9 for unit masses and lengths, taken as it comes."""
    c, s = np.cos(q[1]), np.sin(q[1])
    mass = np.array([[3.0 + 2.0 * c, 1.0 + c], [1.0 + c, 1.0]])
    speed = np.array([-s * (2.0 * qd[0] * qd[1] + qd[1] ** 2), s * qd[0] ** 2])
    return np.linalg.solve(mass, -speed)


@hard_case(
    "T41",
    "NaN, infinity, wrong signs, shapes and types in the input",
    setup="10 000 calls, studies, robots, motions, catalogue rows and recordings with one corrupted value.",
    naive="the textbook equations of a 2R arm in 1000 corrupted calls",
)
def test_spoiled_input() -> list[Figure]:
    rng, calls = np.random.default_rng(41), public_calls()
    wrong: dict[str, str] = {}
    names = list(calls)
    for count in range(CALLS):
        name = names[count % len(names)]
        function, arguments = calls[name]
        given = spoiled_call(arguments, rng)
        found = verdict(lambda function=function, given=given: function(**given))
        if found not in FINE:
            wrong.setdefault(f"{name}: {found}", told(given, arguments))
    with tempfile.TemporaryDirectory() as folder:
        for name, (source, count) in spoilers(Path(folder)).items():
            for _ in range(count):
                found = verdict(source.spoiled(rng))
                if found not in FINE:
                    wrong.setdefault(f"{name}: {found}", "")
    assert wrong == {}
    return [
        Figure(
            "results other than an InputError or a finite answer",
            float(len(wrong)),
            float(naive_verdicts(rng)),
            at_most=0.0,
        )
    ]
