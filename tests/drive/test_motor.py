from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from drivetrain.drive import motor as law
from drivetrain.drive.motor import Motor
from drivetrain.errors import InputError

# maxon DCX 22 L, DCX22L01EBKL637, online catalogue 2019 (resistance and constants as printed, in SI).
DCX22 = Motor(
    key="DCX22L01EBKL637",
    kind="brushed",
    resistance=7.25,
    torque_constant=0.0452,
    inductance=0.000746,
    rotor_inertia=8.85e-7,
    nominal_voltage=24.0,
    no_load_speed=529.882,
    no_load_current=0.0102,
)


def test_the_sheet_agrees_with_its_own_redundancy() -> None:
    # 1 %: rounding of the printed figures to three digits
    assert law.stall_torque(DCX22) == pytest.approx(0.150, rel=0.01)
    assert law.stall_current(DCX22) == pytest.approx(3.31, rel=0.01)
    assert law.no_load_speed(DCX22) == pytest.approx(529.882, rel=0.01)


def test_its_text_lists_what_the_sheet_states_and_makes_it_again() -> None:
    assert "peak_current" not in repr(DCX22) and "inductance=0.000746" in repr(DCX22)
    assert eval(repr(DCX22)) == DCX22


def test_predictions_need_a_nominal_voltage() -> None:
    bare = Motor("bare", 1.0, 0.1)
    assert law.stall_torque(bare) is law.stall_current(bare) is law.no_load_speed(bare) is None


def test_resistance_rises_with_the_winding() -> None:
    assert law.winding_resistance(DCX22, 25.0) == 7.25
    assert law.winding_resistance(DCX22, 125.0) == pytest.approx(7.25 * 1.39, rel=1e-14)


def test_a_sheet_at_another_temperature_is_the_same_copper() -> None:
    at_20 = dataclasses.replace(
        DCX22, resistance=float(law.winding_resistance(DCX22, 20.0)), reference_temperature=20.0
    )
    temperatures = np.array([-40.0, 20.0, 25.0, 155.0])
    np.testing.assert_allclose(
        law.winding_resistance(at_20, temperatures), law.winding_resistance(DCX22, temperatures), rtol=1e-14
    )


def test_torque_constant_falls_with_the_magnets() -> None:
    assert law.torque_constant(DCX22, 75.0) == pytest.approx(0.0452 * 0.95)
    assert law.current(DCX22, 0.0452, 75.0) == pytest.approx(1.0 / 0.95)


def test_terminal_voltage_has_three_parts() -> None:
    speed, current, rate = np.array([100.0, -100.0]), np.array([2.0, 2.0]), np.array([50.0, 50.0])
    volts = law.terminal_voltage(DCX22, speed, current, rate, 125.0, 75.0)
    expected = 0.0452 * 0.95 * speed + 7.25 * 1.39 * 2.0 + 0.000746 * 50.0
    np.testing.assert_allclose(volts, expected, rtol=1e-14)
    # braking: the back-emf takes over what the resistance would need
    assert volts[1] < volts[0]
    no_inductance = dataclasses.replace(DCX22, inductance=None)
    np.testing.assert_allclose(
        law.terminal_voltage(no_inductance, speed, current, rate, 125.0, 75.0), expected - 0.0373, rtol=1e-12
    )


def test_no_load_friction_from_whatever_the_sheet_has() -> None:
    no_load = 0.0452 * 0.0102
    only_current = law.no_load_friction(DCX22)
    assert only_current is not None and (only_current.coulomb, only_current.viscous) == (pytest.approx(no_load), 0.0)

    both = law.no_load_friction(dataclasses.replace(DCX22, coulomb_friction=1e-4, viscous_friction=3e-7))
    assert both is not None and (both.coulomb, both.viscous) == (1e-4, 3e-7)

    # the other one is what is left at the no-load point
    rest = law.no_load_friction(dataclasses.replace(DCX22, coulomb_friction=1e-4))
    assert rest is not None and rest.coulomb + rest.viscous * 529.882 == pytest.approx(no_load)
    rest = law.no_load_friction(dataclasses.replace(DCX22, viscous_friction=3e-7))
    assert rest is not None and rest.coulomb + 3e-7 * 529.882 == pytest.approx(no_load)

    assert law.no_load_friction(Motor("bare", 1.0, 0.1)) is None
    alone = law.no_load_friction(Motor("bare", 1.0, 0.1, coulomb_friction=0.01))
    assert alone is not None and (alone.coulomb, alone.viscous) == (0.01, 0.0)


def test_friction_data_are_one_current_or_both_terms() -> None:
    bare = Motor("m", 0.3, 0.05)
    for given, known in (
        ({}, False), ({"no_load_current": 0.2}, True), ({"coulomb_friction": 1e-3}, False),
        ({"viscous_friction": 1e-5}, False), ({"coulomb_friction": 1e-3, "viscous_friction": 1e-5}, True),
    ):  # fmt: skip
        assert law.has_friction_data(dataclasses.replace(bare, **given)) == known


def test_all_faults_of_a_sheet_at_once() -> None:
    with pytest.raises(InputError) as caught:
        Motor("bad", -1.0, 0.0, kind="stepper", rotor_inertia=0.0, no_load_current=-0.1, max_winding_temperature=-300.0)
    places = {fault.place for fault in caught.value.faults}
    fields = "resistance torque_constant kind rotor_inertia no_load_current max_winding_temperature".split()
    assert places == {f"motor bad.{field}" for field in fields}


def test_unknown_is_allowed_but_not_for_what_every_law_needs() -> None:
    with pytest.raises(InputError, match="torque_constant: is needed"):
        Motor("bad", 1.0, None)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="resistance"):
        Motor("bad", float("nan"), 1.0)
