"""The winding as an electrical stage, stepped exactly: stable and right at any step, however small the inductance.

The time constant L/R of a winding is some tenths of a millisecond. An explicit step of a millisecond multiplies the
current by ``1 - h R/L``, which is -2.6 for a common motor: it explodes. The stage is linear while voltage, speed and
temperature are held, so its exponential is the step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from drivetrain.arrays import Array
from drivetrain.drive.exponentials import first, second
from drivetrain.drive.motor import Motor, torque_constant, winding_resistance
from drivetrain.errors import Fault, InputError

# Numba's disk cache looks at this file alone. A test holds the CRC-32 of the other file compiled into it, so that who
# changes it must change this line, and the cache is renewed.
SOURCES = {"exponentials.py": 4137605713}


class CurrentStep(NamedTuple):
    """The current after a step, and its mean over the step, which decides the impulse of the torque.

    Attributes:
        end: [A].
        mean: [A].
    """

    end: Array
    mean: Array


def exact_current_step(
    motor: Motor,
    current: Array | float,
    voltage: Array | float,
    speed: Array | float,
    step: float,
    *,
    winding_temperature: float | None = None,
    magnet_temperature: float | None = None,
) -> CurrentStep:
    """The current after a time in which voltage and speed are held, without error at any length of the step.

    Args:
        motor: Resistance, inductance (unknown: the current follows at once) and torque constant.
        current: At the start of the step [A], any shape.
        voltage: Between the terminals [V], that shape or one for all.
        speed: Of the rotor against the stator [rad/s], that shape or one for all.
        step: [s].
        winding_temperature, magnet_temperature: [C]; None: the motor's reference temperature.

    Returns:
        The current at the end and its mean, that shape.

    Raises:
        InputError: Values that are no finite numbers, a step that is not positive, or no resistance left.

    Reference: L dI/dt = V - R I - k_t w, Modern Robotics, equation 8.102; its solution with the right-hand side held.
    """
    cold = motor.reference_temperature
    resistance = winding_resistance(motor, cold if winding_temperature is None else winding_temperature)
    constant = torque_constant(motor, cold if magnet_temperature is None else magnet_temperature)
    faults = [] if 0.0 < step < np.inf else [Fault("step", "must be a positive number [s]", step)]
    if not 0.0 < resistance < np.inf:
        faults.append(Fault("winding_temperature", "leaves the winding no resistance [C]", winding_temperature))
    if not np.isfinite(constant):
        faults.append(Fault("magnet_temperature", "must be a finite number [C]", magnet_temperature))
    given = {"current": (current, "A"), "voltage": (voltage, "V"), "speed": (speed, "rad/s")}
    arrays = {name: np.asarray(value, dtype=np.float64) for name, (value, _) in given.items()}
    for name, array in arrays.items():
        if not np.isfinite(array).all():
            faults.append(Fault(name, f"must be finite [{given[name][1]}]", array.tolist()))
    if faults:
        raise InputError(faults)
    driving = arrays["voltage"] - constant * arrays["speed"]
    start, missing = arrays["current"], driving - resistance * arrays["current"]
    at_end, in_mean = current_reach(resistance, motor.inductance or 0.0, step)
    return CurrentStep(np.asarray(start + at_end * missing), np.asarray(start + in_mean * missing))


@njit(cache=True)
def current_reach(resistance: float, inductance: float, step: float) -> tuple[float, float]:
    """By how much the current grows over a step for each volt that ``V - R I - k_t w`` is off at its start.

    Args:
        resistance: [ohm].
        inductance: [H]; 0: the current follows at once.
        step: [s].

    Returns:
        The growth at the end of the step and in the mean over it [A/V]; 1/R for steps far longer than L/R.
    """
    if inductance == 0.0:
        return 1.0 / resistance, 1.0 / resistance
    rate = -resistance * step / inductance
    grown = first(rate)
    return step / inductance * grown, step / inductance * second(rate, grown)
