"""Plant of one joint's servo: inertias with a spring between, current loop, sampling and delay; a notch filter.

Seen from the motor's shaft, a current I gives the torque kt I on the rotor J, which drives the load I_L / ratio^2
through the spring K / ratio^2. The gain of the speed loop is low at the anti-resonance sqrt(K / I_L), where the rotor
is at rest and the load oscillates, and high at the resonance, where both oscillate.

Reference: Astrom and Wittenmark, Computer-Controlled Systems, section 2.3 (sampling with a hold).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.ranges import FINITE, NOT_NEGATIVE, POSITIVE, range_faults
from drivetrain.errors import Fault, raise_faults

_RANGES = {
    "torque_constant": POSITIVE, "ratio": FINITE, "rotor_inertia": POSITIVE, "load_inertia": POSITIVE,
    "stiffness": POSITIVE, "spring_damping": NOT_NEGATIVE, "viscous": NOT_NEGATIVE,
}  # fmt: skip

if TYPE_CHECKING:
    from control import StateSpace, TransferFunction


@dataclass(frozen=True)
class ServoAxis:
    """Servo axis of one joint.

    Attributes:
        torque_constant: Torque constant of the motor [N m/A].
        ratio: Motor angle over joint angle [-].
        rotor_inertia: Inertia at the motor's shaft, gear input included [kg m^2].
        load_inertia: Inertia of the load at the joint [kg m^2].
        stiffness: Stiffness of the joint's spring [N m/rad]; None: rigid.
        spring_damping: Damping of the joint's spring [N m s/rad].
        viscous: Viscous friction at the motor's shaft [N m s/rad].
    """

    torque_constant: float
    ratio: float
    rotor_inertia: float
    load_inertia: float
    stiffness: float | None = None
    spring_damping: float = 0.0
    viscous: float = 0.0

    def __post_init__(self) -> None:
        faults = range_faults("ServoAxis", self, _RANGES, required=[name for name in _RANGES if name != "stiffness"])
        if self.ratio == 0:
            faults.append(Fault("ServoAxis.ratio", "must not be 0", self.ratio))
        raise_faults(faults)

    @property
    def whole_inertia(self) -> float:
        """Inertia of rotor and load together, at the motor's shaft [kg m^2]."""
        return self.rotor_inertia + self.load_inertia / self.ratio**2


@dataclass(frozen=True)
class ServoTiming:
    """Timing between the speed loop and the motor's torque.

    Attributes:
        current_bandwidth: Bandwidth of the current loop [rad/s]; infinite: ideal current loop.
        period: Sampling period of the servo [s]; 0: continuous.
        delay: Delay from measurement to output, in samples.
    """

    current_bandwidth: float = math.inf
    period: float = 0.0
    delay: int = 0

    def __post_init__(self) -> None:
        faults = []
        if not self.current_bandwidth > 0.0:
            faults.append(Fault("ServoTiming.current_bandwidth", "must be positive [rad/s]", self.current_bandwidth))
        if not 0.0 <= self.period < math.inf:
            faults.append(Fault("ServoTiming.period", "must not be negative [s]", self.period))
        if self.delay != int(self.delay) or self.delay < 0:
            faults.append(Fault("ServoTiming.delay", "must be a whole number of samples from 0", self.delay))
        raise_faults(faults)

    @property
    def lag(self) -> float:
        """Time from a speed to the torque in response [s]: hold and difference cost half a period each."""
        return self.period * (1.0 + self.delay)


@dataclass(frozen=True)
class Notch:
    """A filter that suppresses a resonance: (s^2 + 2 z w s + w^2) / (s^2 + 2 p w s + w^2).

    Attributes:
        frequency: Centre frequency w [rad/s].
        zeros, poles: Damping ratios z and p [-].
    """

    frequency: float
    zeros: float = 0.1
    poles: float = 0.7  # wide enough for an error of 20 % in the resonance


def resonances(axis: ServoAxis) -> tuple[float, float]:
    """Anti-resonance and resonance of a joint with a spring [rad/s]; infinite if it is rigid."""
    if axis.stiffness is None:
        return math.inf, math.inf
    rotor = axis.ratio**2 * axis.rotor_inertia
    return (
        math.sqrt(axis.stiffness / axis.load_inertia),
        math.sqrt(axis.stiffness * (1.0 / axis.load_inertia + 1.0 / rotor)),
    )


def servo_plant(axis: ServoAxis, timing: ServoTiming) -> StateSpace:
    """Plant from commanded current to measured speed; of a sampled loop the speed is the motor angle covered in a
    period, over the period.
    """
    import control

    j, kt, c = axis.rotor_inertia, axis.torque_constant, axis.viscous
    if axis.stiffness is None:
        a, b = np.array([[-c / axis.whole_inertia]]), np.array([[kt / axis.whole_inertia]])
    else:  # states: speeds of rotor and load, and wind-up, all at the motor's shaft
        load, k, d = (one / axis.ratio**2 for one in (axis.load_inertia, axis.stiffness, axis.spring_damping))
        a = np.array([[-(c + d) / j, d / j, -k / j], [d / load, -d / load, k / load], [1.0, -1.0, 0.0]])
        b = np.array([[kt / j], [0.0], [0.0]])
    n = len(a)
    if math.isfinite(timing.current_bandwidth):  # additional state: the current
        lag = timing.current_bandwidth
        a = np.block([[a, b], [np.zeros((1, n)), np.full((1, 1), -lag)]])
        b = np.array([[0.0]] * n + [[lag]])
        n += 1
    if timing.period == 0.0:
        return control.ss(a, b, np.eye(1, n), 0.0)
    # The angle is the integral of the speed; only its change within a period is kept.
    a = np.block([[a, np.zeros((n, 1))], [np.eye(1, n), np.zeros((1, 1))]])
    angle = np.eye(1, n + 1, n)
    held = control.sample_system(control.ss(a, np.vstack([b, [[0.0]]]), angle, 0.0), timing.period, "zoh")
    turned, given = held.A.copy(), held.B.copy()
    turned[n, n] = 0.0
    turned[n] /= timing.period
    given[n] /= timing.period
    plant = control.ss(turned, given, angle, 0.0, timing.period)
    for _ in range(int(timing.delay)):
        plant = plant * control.ss([[0.0]], [[1.0]], [[1.0]], 0.0, timing.period)
    return plant


def notch_filter(notch: Notch, period: float) -> tuple[Array, Array]:
    """A sampled notch filter by the bilinear transform with exact centre frequency (Astrom and Wittenmark,
    Computer-Controlled Systems, section 8.2: Tustin's approximation with prewarping).
    """
    k = math.tan(0.5 * notch.frequency * period)
    # A damping ratio g gives 1 + 2 g k + k^2, 2 (k^2 - 1), 1 - 2 g k + k^2 for s^2 + 2 g w s + w^2.
    zeros, poles = (
        np.array([1.0 + 2.0 * share * k + k * k, 2.0 * (k * k - 1.0), 1.0 - 2.0 * share * k + k * k])
        for share in (notch.zeros, notch.poles)
    )
    return zeros / poles[0], poles / poles[0]


def notch_system(notch: Notch, period: float) -> TransferFunction:
    """A notch filter as a transfer function, sampled if ``period`` [s] is above 0."""
    import control

    if period > 0.0:
        return control.tf(*notch_filter(notch, period), period)
    middle = notch.frequency
    return control.tf(*([1.0, 2.0 * share * middle, middle**2] for share in (notch.zeros, notch.poles)))


def sampled_limit(axis: ServoAxis, timing: ServoTiming) -> float:
    """The largest stable speed gain of a rigid joint under a sampled speed loop [A s/rad].

    Reference:
        Characteristic equation z^(d+2) - z^(d+1) + a/2 (z + 1) = 0, a = gain kt period / J. Its largest root leaves the
        unit circle at a = 2 without delay, at 2 (sqrt 2 - 1) with one sample.
    """
    if timing.period == 0.0:
        return math.inf
    low, high = 0.0, 4.0
    while high - low > 1e-12:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _settles(middle, int(timing.delay)) else (low, middle)
    return low * axis.whole_inertia / (axis.torque_constant * timing.period)


def _settles(share: float, delay: int) -> bool:
    polynomial = np.zeros(delay + 3)
    polynomial[:2] = 1.0, -1.0
    polynomial[-2:] += 0.5 * share
    return bool(np.abs(np.roots(polynomial)).max() < 1.0)
