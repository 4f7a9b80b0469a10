"""The loops of one joint's servo, designed from its drive: gains, margins, and what the joint's spring leaves of them.

Seen from the motor's shaft, a current I gives the torque kt I to the rotor J, which drives the load I_L / ratio^2
through the spring K / ratio^2. The speed loop sees the rotor, so the load pulls it down at the anti-resonance
sqrt(K / I_L), where the rotor stands and the load swings, and lifts it at the resonance, where both swing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from drivetrain.arrays import Array
from drivetrain.errors import Fault, InputError

if TYPE_CHECKING:
    from control import TransferFunction

BELOW_CURRENT_LOOP = 5.0  # times slower than the current loop a speed loop is laid out, at least
BELOW_SPRING = 3.0  # and than the anti-resonance
SAMPLES = 10.0  # and periods that the lag of sampling and computing may take of its time
OUTER = 4.0  # times slower than the speed loop the position loop is
POINTS = 4000


@dataclass(frozen=True)
class ServoAxis:
    """One joint as its servo sees it.

    Attributes:
        torque_constant: [N m/A].
        ratio: Motor angle over joint angle [-].
        rotor_inertia: Gear input included [kg m^2].
        load_inertia: At the joint [kg m^2].
        stiffness: Of the joint's spring [N m/rad]; None: rigid.
        spring_damping: Along it [N m s/rad].
        viscous: Friction at the motor's shaft [N m s/rad].
    """

    torque_constant: float
    ratio: float
    rotor_inertia: float
    load_inertia: float
    stiffness: float | None = None
    spring_damping: float = 0.0
    viscous: float = 0.0

    def __post_init__(self) -> None:
        positive = ("torque_constant", "rotor_inertia", "load_inertia")
        faults = [
            Fault(f"ServoAxis.{name}", "must be positive and finite", getattr(self, name))
            for name in positive
            if not 0.0 < getattr(self, name) < math.inf
        ]
        if not (math.isfinite(self.ratio) and self.ratio != 0.0):
            faults.append(Fault("ServoAxis.ratio", "must be a number other than 0", self.ratio))
        if self.stiffness is not None and not 0.0 < self.stiffness < math.inf:
            faults.append(Fault("ServoAxis.stiffness", "must be positive [N m/rad], or None", self.stiffness))
        faults += [
            Fault(f"ServoAxis.{name}", "must not be negative [N m s/rad]", getattr(self, name))
            for name in ("spring_damping", "viscous")
            if not 0.0 <= getattr(self, name) < math.inf
        ]
        if faults:
            raise InputError(faults)

    @property
    def whole_inertia(self) -> float:
        """Of rotor and load together, at the motor's shaft [kg m^2]."""
        return self.rotor_inertia + self.load_inertia / self.ratio**2


@dataclass(frozen=True)
class ServoTiming:
    """What lies between the speed loop and the motor's torque.

    Attributes:
        current_bandwidth: Of the current loop [rad/s]; infinite: none.
        period: Between two samples of the servo [s]; 0: it is continuous.
        delay: Samples from measuring to giving out.
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
        if faults:
            raise InputError(faults)

    @property
    def lag(self) -> float:
        """Time from a speed to the torque that answers it [s]: holding and differencing cost half a period each."""
        return self.period * (1.0 + self.delay)


@dataclass(frozen=True)
class LoopDesign:
    """Gains of a cascade and how far they are from trouble.

    Attributes:
        speed_bandwidth, position_bandwidth: Crossover of the loops [rad/s].
        speed_gain: At the motor [A s/rad].
        integral_time: Of the speed loop [s].
        position_gain: Of the position loop [1/s].
        limited_by: What keeps the speed loop from being faster.
        anti_resonance, resonance: Of the joint's spring [rad/s]; infinite for a rigid joint.
        speed_phase_margin, position_phase_margin: [rad].
        speed_gain_margin, position_gain_margin: Factor on the gain that would make the loop swing [-].
        stable: Whether both loops settle; margins of a loop that does not are told as they come out.
        sampled_share: Speed gain over the largest that sampling allows for a rigid joint [-]; 0 without samples.
    """

    speed_bandwidth: float
    position_bandwidth: float
    speed_gain: float
    integral_time: float
    position_gain: float
    limited_by: str
    anti_resonance: float
    resonance: float
    speed_phase_margin: float
    position_phase_margin: float
    speed_gain_margin: float
    position_gain_margin: float
    stable: bool
    sampled_share: float


def resonances(axis: ServoAxis) -> tuple[float, float]:
    """The two frequencies of a joint with a spring.

    Args:
        axis: The joint.

    Returns:
        Anti-resonance sqrt(K / I_L) and resonance sqrt(K (1/I_L + 1/(ratio^2 J))) [rad/s]; infinite when rigid.
    """
    if axis.stiffness is None:
        return math.inf, math.inf
    rotor = axis.ratio**2 * axis.rotor_inertia
    return (
        math.sqrt(axis.stiffness / axis.load_inertia),
        math.sqrt(axis.stiffness * (1.0 / axis.load_inertia + 1.0 / rotor)),
    )


def speed_response(axis: ServoAxis) -> TransferFunction:
    """From current to motor speed.

    Args:
        axis: The joint.

    Returns:
        A transfer function of the ``control`` library [rad/s over A].
    """
    import control

    if axis.stiffness is None:
        return control.tf([axis.torque_constant], [axis.whole_inertia, axis.viscous])
    load, spring = axis.load_inertia / axis.ratio**2, axis.stiffness / axis.ratio**2
    damping = axis.spring_damping / axis.ratio**2
    across = np.array([damping, spring])
    swing = np.polyadd([load, 0.0, 0.0], across)
    # (J s + c) w + (d + K/s) (w - v) = kt I,  load s v = (d + K/s) (w - v)
    below = np.polyadd(np.polymul([axis.rotor_inertia, axis.viscous], swing), np.polymul([load, 0.0], across))
    return control.tf(axis.torque_constant * swing, below)


def sampled_limit(axis: ServoAxis, timing: ServoTiming) -> float:
    """The largest speed gain with which a rigid joint settles under a sampled speed loop.

    Args:
        axis: The joint; its spring is left out.
        timing: Period and delay.

    Returns:
        [A s/rad]; infinite for a continuous loop.

    Reference:
        The loop z^(d+2) - z^(d+1) + a/2 (z + 1) = 0, a = gain kt period / J; its root of largest magnitude leaves the
        circle at a = 2 without delay, at 2 (sqrt 2 - 1) with one sample.
    """
    if timing.period == 0.0:
        return math.inf
    low, high = 0.0, 4.0
    while high - low > 1e-12:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _settles(middle, int(timing.delay)) else (low, middle)
    return low * axis.whole_inertia / (axis.torque_constant * timing.period)


def design_loops(axis: ServoAxis, timing: ServoTiming, *, speed_bandwidth: float | None = None) -> LoopDesign:
    """The gains of a cascade, as fast as current loop, samples and spring let it be, or as wanted.

    Args:
        axis: The joint.
        timing: Current loop and samples.
        speed_bandwidth: Wanted crossover of the speed loop [rad/s]; None: a fifth of the current loop's, a third of the
            anti-resonance, and slow enough for ten lags of sampling, whichever is least.

    Returns:
        Gains, margins, and what limits them.

    Raises:
        InputError: Nothing limits the bandwidth and none is wanted, or one that is not positive.
    """
    anti, res = resonances(axis)
    limits = {
        "current loop": timing.current_bandwidth / BELOW_CURRENT_LOOP,
        "anti-resonance of the joint's spring": anti / BELOW_SPRING,
        "samples and delay": math.inf if timing.lag == 0.0 else 2.0 * math.pi / (SAMPLES * timing.lag),
    }
    limit = min(limits, key=lambda name: limits[name])
    wanted = limits[limit] if speed_bandwidth is None else speed_bandwidth
    if not 0.0 < wanted < math.inf:
        hint = "give a bandwidth, a current loop, samples or a stiffness"
        raise InputError(Fault("speed_bandwidth", "must be positive, or something must limit it [rad/s]", wanted, hint))
    gain = wanted * axis.whole_inertia / axis.torque_constant
    integral, outer = OUTER / wanted, wanted / OUTER
    inner, around = _open_loops(axis, timing, gain, integral, outer)
    speed, position = _margins(inner), _margins(around)
    limit_of_samples = sampled_limit(axis, timing)
    return LoopDesign(
        wanted, outer, gain, integral, outer, limit if speed_bandwidth is None else "wanted", anti, res,
        speed[1], position[1], speed[0], position[0], min(*speed, *position, speed[0] - 1.0, position[0] - 1.0) > 0.0,
        0.0 if math.isinf(limit_of_samples) else gain / limit_of_samples,
    )  # fmt: skip


def frequencies(axis: ServoAxis, design: LoopDesign) -> Array:
    """Where a Bode plot of the loops should be drawn.

    Args:
        axis: The joint; its two resonances are met exactly.
        design: Of its loops.

    Returns:
        Rising [rad/s], (N,).
    """
    top = max(10.0 * design.speed_bandwidth, 0.0 if axis.stiffness is None else 3.0 * design.resonance)
    marks = [w for w in resonances(axis) if math.isfinite(w)]
    return np.unique([*np.geomspace(0.02 * design.position_bandwidth, top, POINTS), *marks])


def open_loops(axis: ServoAxis, timing: ServoTiming, design: LoopDesign, at: Array) -> tuple[Array, Array]:
    """The open speed loop and the open position loop along frequencies.

    Args:
        axis: The joint.
        timing: Current loop and samples.
        design: Its gains.
        at: [rad/s], (N,).

    Returns:
        Complex responses, (N,) each.
    """
    return _responses(axis, timing, (design.speed_gain, design.integral_time, design.position_gain), at)


def _settles(share: float, delay: int) -> bool:
    polynomial = np.zeros(delay + 3)
    polynomial[:2] = 1.0, -1.0
    polynomial[-2:] += 0.5 * share
    return bool(np.abs(np.roots(polynomial)).max() < 1.0)


def _responses(
    axis: ServoAxis, timing: ServoTiming, gains: tuple[float, float, float], at: Array
) -> tuple[Array, Array]:
    gain, integral, outer = gains
    s = 1j * at
    plant = speed_response(axis)(s)
    held = np.exp(-s * timing.lag) / (1.0 + s / timing.current_bandwidth)
    inner = gain * (1.0 + 1.0 / (s * integral)) * plant * held
    return inner, outer / s * inner / (1.0 + inner)


def _open_loops(
    axis: ServoAxis, timing: ServoTiming, gain: float, integral: float, outer: float
) -> tuple[object, object]:
    import control

    _, res = resonances(axis)
    fast = gain * axis.torque_constant / axis.whole_inertia
    top = max(1e3 * fast, 0.0 if math.isinf(res) else 10.0 * res)
    at = np.geomspace(1e-3 * outer, top, POINTS)
    return tuple(control.frd(one, at) for one in _responses(axis, timing, (gain, integral, outer), at))  # type: ignore[return-value]


def _margins(loop: object) -> tuple[float, float]:
    """Gain margin [-] and phase margin [rad] of an open loop."""
    import control

    gain, phase, *_ = control.stability_margins(loop)
    return float(gain), math.radians(float(phase))
