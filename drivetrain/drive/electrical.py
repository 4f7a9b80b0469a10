"""The winding as an electrical stage, stepped exactly: stable and right at any step, however small the inductance.

The time constant L/R of a winding is some tenths of a millisecond. An explicit step of a millisecond multiplies the
current by ``1 - h R/L``, which is -2.6 for a common motor: it explodes. The stage is linear while voltage, speed and
temperature are held, so its exponential is the step.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np

from drivetrain.arrays import Array, axes_of, checked_array, checked_number, checked_numbers
from drivetrain.drive.motor import Motor, torque_constant, winding_resistance
from drivetrain.drive.thermal.exponentials import first, second
from drivetrain.errors import Fault, InputError
from drivetrain.jit import kernel

ABSOLUTE_ZERO = -273.15  # C


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
    winding, magnets = (cold if t is None else t for t in (winding_temperature, magnet_temperature))
    temperatures = {"winding_temperature": (winding, "C"), "magnet_temperature": (magnets, "C")}
    given = {"current": current, "voltage": voltage, "speed": speed}
    checks: list[Callable[[], object]] = [
        lambda: checked_numbers(temperatures, least=ABSOLUTE_ZERO),
        lambda: checked_number(step, "step", "s", above=0.0),
        *(partial(checked_array, value, (None,) * max(axes_of(value), 0), name) for name, value in given.items()),
    ]
    faults = [fault for check in checks for fault in _faults_of(check)]
    if faults:
        raise InputError(faults)
    arrays = {name: np.asarray(value, dtype=np.float64) for name, value in given.items()}
    return _stepped(motor, arrays, step, winding_resistance(motor, winding), torque_constant(motor, magnets))


def _stepped(motor: Motor, given: dict[str, Array], step: float, resistance: float, constant: float) -> CurrentStep:
    """The step itself, for checked values."""
    if not resistance > 0.0:
        raise InputError(Fault("winding_temperature", "leaves the winding no resistance", resistance))
    start, at_end = given["current"], current_reach(resistance, motor.inductance or 0.0, step)
    missing = given["voltage"] - constant * given["speed"] - resistance * start
    return CurrentStep(*(np.asarray(start + reach * missing) for reach in at_end))


def _faults_of(check: Callable[[], object]) -> tuple[Fault, ...]:
    try:
        check()
    except InputError as error:
        return error.faults
    return ()


@kernel
def current_reach(resistance: float, inductance: float, step: float) -> tuple[float, float]:
    """By how much the current grows over a step for each volt that ``V - R I - k_t w`` is off at its start."""
    if inductance == 0.0:
        return 1.0 / resistance, 1.0 / resistance
    rate = -resistance * step / inductance
    grown = first(rate)
    return step / inductance * grown, step / inductance * second(rate, grown)
