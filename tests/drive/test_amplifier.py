from __future__ import annotations

import numpy as np
import pytest

from drivetrain.drive.amplifier import (
    LEAST_PEAK_TIME,
    Amplifier,
    Supply,
    available_voltage,
    conduction_loss,
    from_dc,
    judges_overload,
    line_to_line,
    to_dc,
    torque_constant_to_dc,
    with_peak_time,
)
from drivetrain.errors import InputError

ANGLE = np.linspace(0.0, 2.0 * np.pi, 3600, endpoint=False)
PHASES = np.cos(ANGLE[:, None] - np.arange(3) * 2.0 * np.pi / 3.0)  # current and back-emf of a star, in phase


def test_the_dc_equivalent_of_explicit_three_phase_sinusoids() -> None:
    amplitude, flux, phase_resistance, speed = 7.0, 0.03, 0.2, 150.0
    currents, back_emf = amplitude * PHASES, flux * speed * PHASES
    copper = np.mean(np.sum(phase_resistance * currents**2, axis=1))
    torque = np.mean(np.sum(back_emf * currents, axis=1)) / speed
    rms = np.sqrt(np.mean(currents[:, 0] ** 2))
    between = (back_emf[:, 0] - back_emf[:, 1]).max()
    terminals = (back_emf + phase_resistance * currents)[:, 0] - (back_emf + phase_resistance * currents)[:, 1]

    resistance = line_to_line(phase_resistance)
    current = to_dc(rms, "rms")
    constant = torque_constant_to_dc(torque / rms, "rms")
    # rtol: the maximum over 3600 angles misses the crest by less than (pi/3600)^2 / 2 = 4e-7
    assert current == pytest.approx(to_dc(amplitude, "peak"), rel=1e-12)
    assert resistance * current**2 == pytest.approx(copper, rel=1e-12)
    assert constant * current == pytest.approx(torque, rel=1e-12)
    assert constant == pytest.approx(torque_constant_to_dc(torque / amplitude, "peak"), rel=1e-12)
    assert constant * speed == pytest.approx(between, rel=1e-6)
    assert constant * speed + resistance * current == pytest.approx(terminals.max(), rel=1e-6)


@pytest.mark.parametrize("basis", ["dc", "rms", "peak"])
def test_there_and_back(basis: str) -> None:
    currents = np.array([-3.0, 0.0, 5.0])
    np.testing.assert_allclose(from_dc(to_dc(currents, basis), basis), currents, rtol=1e-15)
    assert to_dc(2.0, basis) * torque_constant_to_dc(0.4, basis) == pytest.approx(0.8)


def test_two_switches_of_three_half_bridges_heat_by_their_resistance() -> None:
    """Three phases of sinusoidal currents, each through one switch: 3 R times the mean square, in the DC equivalent."""
    phase = 4.0 * PHASES
    lost = 0.005 * np.mean(np.sum(phase**2, axis=1))
    assert conduction_loss(0.005, to_dc(4.0, "peak")) == pytest.approx(lost, rel=1e-12)


def test_an_unknown_basis_is_refused_with_the_known_ones() -> None:
    with pytest.raises(InputError, match="did you mean 'rms'"):
        to_dc(1.0, "rmss")


def test_limits_must_be_positive() -> None:
    with pytest.raises(InputError) as caught:
        Amplifier(peak_current=0.0, continuous_current=-1.0, modulation=1.1)
    assert len(caught.value.faults) == 3
    with pytest.raises(InputError) as caught:
        Supply(voltage=-48.0, peak_power=0.0, regenerated_power=-1.0)
    assert len(caught.value.faults) == 3
    assert Supply(voltage=48.0, regenerated_power=0.0).peak_power is None


def test_overload_is_judged_by_a_time_or_a_time_constant() -> None:
    """With a continuous current and a way to say how long more than that may flow; a peak time is assumed else."""
    both = {"peak_current": 9.0, "continuous_current": 5.0}
    for given, judged in (
        (both, False), ({**both, "peak_time": 2.0}, True), ({**both, "thermal_time_constant": 3.0}, True),
        ({"peak_time": 2.0, **both, "continuous_current": None}, False),
        ({"continuous_current": 5.0, "peak_time": 2.0}, False), ({"peak_current": 9.0}, False),
    ):  # fmt: skip
        amplifier = Amplifier(**given)
        assert judges_overload(amplifier) == judged
        assumed = with_peak_time(amplifier).peak_time
        assert assumed == (LEAST_PEAK_TIME if given == both else given.get("peak_time"))


def test_modulation_is_a_share_of_the_supply() -> None:
    assert available_voltage(Amplifier(modulation=0.9), 50.0) == pytest.approx(45.0)
