"""Arguments of the wrong kind anywhere in the public face end in an InputError that names them."""

from __future__ import annotations

import inspect
import math
import pickle
from dataclasses import replace
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import drivetrain as dt

CALLABLE = [
    name for name in dt.__all__
    if callable(getattr(dt, name)) and name not in ("Effect", "Recording")  # abstract; made by simulate
    and not (isinstance(getattr(dt, name), type) and issubclass(getattr(dt, name), (Exception, Enum)))
]  # fmt: skip
CLASSES = [getattr(dt, name) for name in dt.__all__ if isinstance(getattr(dt, name), type)]


@pytest.mark.parametrize(
    "value", [None, "x", object(), 1.5, [], {}], ids=["None", "text", "object", "number", "list", "dict"]
)
@pytest.mark.filterwarnings("ignore")
def test_every_public_callable_takes_or_refuses_any_value(value: Any) -> None:
    strange = []
    for name in CALLABLE:
        called = getattr(dt, name)
        needed = [one for one in inspect.signature(called).parameters.values() if one.default is one.empty]
        args = [
            value for one in needed if one.kind in (one.POSITIONAL_ONLY, one.POSITIONAL_OR_KEYWORD, one.VAR_POSITIONAL)
        ]
        named = {one.name: value for one in needed if one.kind is one.KEYWORD_ONLY}
        try:
            called(*args, **named)
        except dt.InputError:
            pass
        except Exception as error:
            strange.append(f"{name}: {error!r}")
    assert not strange, "\n".join(strange)


@pytest.mark.parametrize("name", CALLABLE)
def test_an_unknown_keyword_is_named(name: str) -> None:
    called = getattr(dt, name)
    if any(one.kind is one.VAR_KEYWORD for one in inspect.signature(called).parameters.values()):
        return
    with pytest.raises(dt.InputError, match="quark"):
        called(quark=1)


def test_an_unknown_keyword_of_a_method_is_named() -> None:
    asked = 0
    for kind in CLASSES:
        if issubclass(kind, Exception | Enum | tuple):
            continue
        for name, method in inspect.getmembers(kind, inspect.isroutine):
            unwrapped = getattr(method, "__func__", method)
            if name.startswith("_") or not unwrapped.__module__.startswith("drivetrain."):
                continue
            self = [] if not inspect.isfunction(inspect.getattr_static(kind, name)) else [object()]
            with pytest.raises(dt.InputError, match=rf"{unwrapped.__name__}\(quark=\)"):
                method(*self, quark=1)
            asked += 1
    assert asked > 100


def test_arguments_of_classes_are_named() -> None:
    with pytest.raises(dt.InputError, match=r"RigidBody\(\): missing a required argument: 'com'"):
        dt.RigidBody(1.0)  # type: ignore[call-arg]
    with pytest.raises(dt.InputError, match="did you mean 'resistance'"):
        dt.Motor("m", resistence=1.0)  # type: ignore[call-arg]


def test_a_room_that_is_called_names_its_functions() -> None:
    with pytest.raises(dt.InputError, match=r"^dt.accuracy: is a module, not a function; call one of .*simulate"):
        dt.accuracy("study.yaml")  # type: ignore[operator]
    with pytest.raises(dt.InputError, match="write_mjcf"):
        dt.export()  # type: ignore[operator]


def test_the_message_names_the_argument_and_what_it_may_be() -> None:
    with pytest.raises(dt.InputError, match=r"inverse_dynamics\(arm=\): must be of kind Arm \(found 'str'\)"):
        dt.inverse_dynamics("ur5", [0.0], [0.0], [0.0])  # type: ignore[arg-type]
    with pytest.raises(dt.InputError, match="did you mean 'tip'"):
        dt.load_arm("ur5", tipp="x")  # type: ignore[call-arg]
    with pytest.raises(dt.InputError, match="missing a required argument: 'source'"):
        dt.load_arm()  # type: ignore[call-arg]


LAW_MOTOR = dt.Motor("m", 0.5, 0.05, rotor_inertia=1e-5, inductance=1e-3, no_load_current=0.1, magnet_coefficient=-1e-3)
LAW_GEAR = dt.Gear("g", 50.0, kind="planetary", efficiency=0.8, stiffness_1=1e4, inertia=1e-6)
LAW_FRICTION = dt.Friction(coulomb=0.2, viscous=0.01)
LAW_DRIVE = dt.Drive(LAW_MOTOR, LAW_GEAR, LAW_FRICTION)
FIRST, SECOND, THIRD = [3.0, -4.0, 5.0], [1.0, 2.0, -1.0], [0.5, 0.0, 2.0]
LAWS: list[tuple[str, tuple[Any, ...]]] = [
    ("average_torque", (3.0, FIRST, SECOND, [1.0, 2.0, 3.0])),
    ("book_current", (LAW_DRIVE, FIRST, SECOND, THIRD, 40.0)),
    ("breakaway_torque", (LAW_FRICTION, FIRST)),
    ("counterbalance_torque", ([dt.Counterbalance(torque=3.0)], FIRST)),
    ("friction_torque", (LAW_FRICTION, FIRST)),
    ("from_dc", (FIRST, "rms")),
    ("to_dc", (FIRST, "peak")),
    ("mesh_input_torque", (LAW_GEAR, FIRST, SECOND)),
    ("motor_torque", (LAW_DRIVE, FIRST, SECOND, THIRD, THIRD)),
    ("standstill_interval", (LAW_GEAR, FIRST)),
    ("tangent_stiffness", (LAW_GEAR, FIRST)),
    ("terminal_voltage", (LAW_MOTOR, FIRST, SECOND, THIRD, FIRST, SECOND)),
    ("torque_constant", (LAW_MOTOR, FIRST)),
    ("torque_limits", (LAW_MOTOR, FIRST, 48.0, 9.0, 80.0, 60.0)),
    ("wind_up", (LAW_GEAR, FIRST)),
    ("winding_resistance", (LAW_MOTOR, FIRST)),
]


@pytest.mark.parametrize(("name", "args"), LAWS, ids=[name for name, _ in LAWS])
def test_laws_take_whatever_is_an_array_of_finite_numbers(name: str, args: tuple[Any, ...]) -> None:
    called = getattr(dt, name)
    lists = [at for at, value in enumerate(args) if isinstance(value, list) and isinstance(value[0], float)]

    def result(change: Any) -> Any:
        found = called(*(change(value) if at in lists else value for at, value in enumerate(args)))
        return np.array([found[k] for k in range(len(found))] if isinstance(found, tuple) else found)

    for change in (list, tuple, pd.Series):
        if name != "motor_torque":
            np.testing.assert_array_equal(result(change), result(np.array))
    for at in lists:
        one = list(inspect.signature(called).parameters)[at]
        for wrong in ([1.0, math.nan, 2.0], math.inf, None, "x", [1j]):
            with pytest.raises(dt.InputError, match=rf"{name}\({one}=\): must be"):
                called(*args[:at], wrong, *args[at + 1 :])
        if len(lists) > 1:
            with pytest.raises(dt.InputError, match="shape"):
                called(*args[:at], np.ones(2), *args[at + 1 :])
    if name == "motor_torque":
        total = [called(*(change(value) if at in lists else value for at, value in enumerate(args))).total
                 for change in (list, pd.Series, np.array)]  # fmt: skip
        np.testing.assert_array_equal(total[0], total[2])
        np.testing.assert_array_equal(total[1], total[2])


def test_laws_name_numbers_out_of_their_range() -> None:
    amplifier = dt.Amplifier(peak_current=10.0, continuous_current=5.0)
    for voltage, hot in ((-48.0, 60.0), (math.nan, 60.0), (48.0, 2000.0), (48.0, math.nan)):
        with pytest.raises(dt.InputError, match=r"supply_voltage|magnet_temperature"):
            dt.operating_region(LAW_MOTOR, amplifier, voltage, 80.0, hot)
    with pytest.raises(dt.InputError, match="continuous_current: must be at least 0"):
        dt.continuous_region(LAW_MOTOR, amplifier, 48.0, -1.0, 80.0, 60.0)
    with pytest.raises(dt.InputError, match=r"weights: must be at least 0 \[s\]"):
        dt.average_torque(3.0, np.ones(2), np.ones(2), np.array([1.0, -1.0]))
    with pytest.raises(dt.InputError, match="exponent: must be above 0"):
        dt.average_torque(0.0, np.ones(2), np.ones(2), np.ones(2))
    with pytest.raises(dt.InputError, match="average_input_speed: must be at least 0"):
        dt.gear_life(LAW_GEAR, 10.0, -5.0)
    with pytest.raises(dt.InputError, match="duration: must be at least 0"):
        dt.momentary_peak_count(LAW_GEAR, 10.0, -5.0)
    with pytest.raises(dt.InputError, match=r"continuous_current\(ambient=\): must be a number"):
        dt.continuous_current(replace(LAW_MOTOR, nominal_current=3.0, max_winding_temperature=99.0), np.zeros(2))  # type: ignore[arg-type]
    with pytest.raises(dt.InputError, match=r"combined\(bodies=\): must be of kind Iterable"):
        dt.combined([1, 2])  # type: ignore[list-item]


def test_faults_of_the_program_stay_what_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object, **__: object) -> None:
        raise TypeError("ours")

    monkeypatch.setattr("drivetrain.study.read.read_document", broken)
    with pytest.raises(TypeError, match="ours"):
        dt.load_study("some.yaml")


def test_public_functions_are_found_by_other_processes() -> None:
    assert pickle.loads(pickle.dumps(dt.evaluate)) is dt.evaluate
    assert inspect.signature(dt.evaluate) == inspect.signature(dt.evaluate.__wrapped__)  # type: ignore[attr-defined]


@pytest.fixture(scope="module")
def swing() -> dt.Study:
    t = np.linspace(0.0, 2.0, 41)
    q = np.sin(np.pi * t / 2.0)[:, np.newaxis] ** 2 * [0.5, 0.3]
    motor: dict[str, Any] = {"kind": "brushless", "current_basis": "dc", "winding_basis": "line_line"}
    motor |= {"resistance": 0.5, "torque_constant": 0.05}
    gear = {"kind": "planetary", "ratio": 50.0}
    return dt.study("planar-2r-bare", (t, q), drive_mass="added", supply="48 V", motors={"M": motor}, gears={"G": gear})


@pytest.mark.parametrize("pair", [3, float("nan"), object(), "M", ("M",), (3, "G"), (None, "G"), ("M", 3), ([], "G")])
def test_a_drive_that_is_no_pair_of_keys_is_named(swing: dt.Study, pair: Any) -> None:
    with pytest.raises(dt.InputError, match=r"drives.joint_1: must be a motor key and a gear key"):
        dt.evaluate(swing, {"joint_1": pair, "joint_2": ("M", "G")})


@pytest.mark.parametrize("name", [None, 1, float("nan"), object()])
def test_a_joint_that_is_named_by_no_text_is_named(swing: dt.Study, name: Any) -> None:
    with pytest.raises(dt.InputError, match="must be the name of a joint of the study, as a text"):
        dt.evaluate(swing, {name: ("M", "G"), "joint_1": ("M", "G"), "joint_2": ("M", "G")})


@pytest.mark.parametrize("free", [None, 3, "x", [20, 200], {}])
def test_a_range_of_ratios_of_another_kind_is_named(swing: dt.Study, free: Any) -> None:
    with pytest.raises(dt.InputError, match=r"free.joint_1: must be a FreeRatio"):
        dt.free_ratios(swing, free={"joint_1": free}, drives={"joint_1": ("M", "G"), "joint_2": ("M", "G")})


def test_criteria_and_motions_of_another_kind_are_named(swing: dt.Study) -> None:
    with pytest.raises(dt.InputError, match="criteria: is none that sets can be compared by"):
        dt.pareto_front(swing, (1, 2))  # type: ignore[arg-type]
    for motions in (None, 3, "x", (1, 2)):
        with pytest.raises(dt.InputError, match="motions: must be a mapping of motions by name"):
            dt.study("planar-2r-bare", ([0.0, 1.0], [[0.0, 0.0], [1.0, 1.0]]), motions=motions, supply=48.0)


SPRUNG = dt.joint_scene(1.0, [dt.WallSpring(100.0)], 0.1, position=0.1)
HELD = dt.CallableConstraint(lambda _q: np.array([[1.0, 1.0]]), lambda _q, _qd: np.zeros(1), 1)
REST = [0.1, 0.2]


@pytest.mark.parametrize("wrong", [None, "x", math.nan, -1.0, [1.0], np.zeros((2, 2)), object()])
def test_options_of_another_kind_are_named(wrong: Any, swing: dt.Study) -> None:
    """Options that a call, or only the run after it, trips over, or that change nothing without a word."""
    arm, evaluation = dt.load_arm("planar-2r"), dt.evaluate(swing, ("M", "G"))
    calls: dict[str, Any] = {
        "AdaptiveStep.solver": lambda: dt.AdaptiveStep(wrong),
        "Inverse.share": lambda: dt.Inverse(wrong),
        "kind": lambda: dt.without(SPRUNG, wrong),
        "profile": lambda: dt.waypoint_motion("m", ("a",), [[0.0], [1.0]], profile=wrong, durations=[1.0]),
        "rate": lambda: dt.current_commands(evaluation, rate="x" if wrong is None else wrong),
        "hold": lambda: dt.current_commands(evaluation, hold=wrong),
        "tolerance": lambda: dt.constraint_projectors(arm, HELD, REST, tolerance=wrong),
    }
    for name, call in calls.items():
        with pytest.raises(dt.InputError, match=name):
            call()
    with pytest.raises(dt.InputError, match="tolerance"):
        dt.constrained_forward_dynamics(arm, HELD, REST, REST, REST, tolerance=wrong)


def test_more_options_out_of_their_range_are_named(swing: dt.Study, tmp_path: Path) -> None:
    arm, evaluation = dt.load_arm("planar-2r"), dt.evaluate(swing, ("M", "G"))
    with pytest.raises(dt.InputError, match="tolerance: must be below 1"):
        dt.constraint_projectors(arm, HELD, REST, tolerance=1.0)
    with pytest.raises(dt.InputError, match="rate: makes more than"):
        dt.current_commands(evaluation, rate=1e300)
    full = dt.Motor("F", 0.5, 0.05, rotor_inertia=1e-5, coulomb_friction=0.01)
    gear = dt.Gear("H", 50.0, kind="planetary", efficiency=0.8, inertia=1e-6)
    motion = (swing.cycle.time, swing.cycle.position)
    study = dt.study("planar-2r-bare", motion, drive_mass="included", supply=48.0, drives=(full, gear))
    with pytest.raises(dt.InputError, match=r"(?s)scales.joint_1: is missing.*scales.joint_2: is missing"):
        dt.write_currents(dt.evaluate(study), tmp_path / "currents.csv", {})
    with pytest.raises(dt.InputError, match="joints: must be different indices"):
        dt.torque_ellipsoid(arm, REST, joints=[[0], [0, 1]])
    with pytest.raises(dt.InputError, match=r"exciting_motion\(candidates=\): must be a whole number"):
        dt.exciting_motion(arm, duration=1.0, rate=50.0, candidates=np.array([1, 2]))  # type: ignore[arg-type]
