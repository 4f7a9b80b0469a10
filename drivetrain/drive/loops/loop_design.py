"""Design of a joint's servo loops from its drive: gains, margins, and the influence of the joint's spring.

A loop is evaluated as the simulation runs it (``effects/control/sampled_cascade.py``): the motor angle is sampled, its
difference is the speed, the command is held for one period and output some samples later. Stability is decided by the
poles of the closed loop, not by a margin; robustness is measured by the smallest distance of the open loop from -1.

Reference: Astrom and Murray, Feedback Systems, sections 10.3 (modulus margin 1/Ms) and 12.5 (resonances); Astrom and
Wittenmark, Computer-Controlled Systems, section 3.2 (poles against the unit circle).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.loops.servo_axis import (
    Notch,
    ServoAxis,
    ServoTiming,
    notch_system,
    resonances,
    sampled_limit,
    servo_plant,
)
from drivetrain.errors import Fault, raise_faults

if TYPE_CHECKING:
    from control import StateSpace, TransferFunction

BELOW_CURRENT_LOOP = 5.0  # smallest ratio of the current loop's to the speed loop's bandwidth
BELOW_SPRING = 3.0  # smallest ratio of the anti-resonance to the speed loop's bandwidth
SAMPLES = 10.0  # smallest ratio of the speed loop's time constant to the lag of sampling and computing
OUTER = 4.0  # ratio of the speed loop's to the position loop's bandwidth
# distance from -1: gives a gain margin of 6 dB and a phase margin of 29 deg at least at every crossing
MODULUS_MARGIN = 0.5
SLOWER = 0.95  # factor to the next bandwidth tried
SLOWEST = 0.02  # lowest bandwidth tried, as a share of the first one
POINTS, AROUND = 500, 60  # frequencies of a response: over its whole range, and on each side of a root
NOTCHED = 0.8  # highest resonance for which a sampled notch is designed, as a share of half the sampling rate
WORTH = 1.1  # smallest factor on the bandwidth for which a notch is proposed
SPRING = "resonance of the joint's spring"


@dataclass(frozen=True)
class Margins:
    """Stability margins of one open loop at every crossing frequency.

    Attributes:
        gain: (frequency [rad/s], factor on the gain at the stability limit [-]) where the phase is -180 deg.
        phase: (frequency [rad/s], additional lag at the stability limit [rad]) where the gain is 1.
    """

    gain: tuple[tuple[float, float], ...]
    phase: tuple[tuple[float, float], ...]

    @property
    def least_gain(self) -> float:
        """The gain margin nearest to 1 [-]; infinite if there is none."""
        return min(
            (factor for _, factor in self.gain), key=lambda one: abs(math.log(max(one, 1e-300))), default=math.inf
        )

    @property
    def least_phase(self) -> float:
        """The phase margin nearest to 0 [rad]; infinite if there is none."""
        return min((lag for _, lag in self.phase), key=abs, default=math.inf)


@dataclass(frozen=True, eq=False)
class LoopDesign:
    """Gains of a cascade and its stability margins.

    Attributes:
        speed_bandwidth, position_bandwidth: Design crossover frequency of each loop [rad/s].
        speed_gain: Gain of the speed loop, at the motor [A s/rad].
        integral_time: Integral time of the speed loop [s].
        position_gain: Gain of the position loop [1/s].
        limited_by: What limits the bandwidth of the speed loop.
        anti_resonance, resonance: Frequencies of the joint's spring [rad/s]; infinite for a rigid joint.
        stable: Whether both closed loops are stable by their poles, also with the lightest load.
        modulus_margin: Smallest distance of the open loops from -1 [-].
        critical_frequency: Frequency of that distance [rad/s].
        poles: Poles of the closed cascade [rad/s]; of a sampled one ln(z) / period.
        sampled_share: Speed gain over its limit by sampling for a rigid joint [-]; 0 without sampling.
        frequencies: Frequencies of the responses [rad/s], (N,).
        speed_loop, position_loop: Complex responses of the open loops, (N,).
        notch: Notch filter in the speed loop; None if there is none.
        with_notch: The design with a notch filter where the spring's resonance limits a sampled loop; else None.
    """

    speed_bandwidth: float
    position_bandwidth: float
    speed_gain: float
    integral_time: float
    position_gain: float
    limited_by: str
    anti_resonance: float
    resonance: float
    stable: bool
    modulus_margin: float
    critical_frequency: float
    poles: tuple[complex, ...]
    sampled_share: float
    frequencies: Array
    speed_loop: Array
    position_loop: Array
    notch: Notch | None = None
    with_notch: LoopDesign | None = None

    @cached_property
    def speed_margins(self) -> Margins:
        """Margins of the open speed loop at every crossing."""
        return _margins(self.frequencies, self.speed_loop)

    @cached_property
    def position_margins(self) -> Margins:
        """Margins of the open position loop at every crossing."""
        return _margins(self.frequencies, self.position_loop)

    @property
    def speed_phase_margin(self) -> float:
        """Phase margin nearest to 0 of all crossings [rad]; meaningless for an unstable loop."""
        return self.speed_margins.least_phase

    @property
    def position_phase_margin(self) -> float:
        """Phase margin of the position loop, as ``speed_phase_margin`` [rad]."""
        return self.position_margins.least_phase

    @property
    def speed_gain_margin(self) -> float:
        """Gain margin nearest to 1 of all crossings [-]; meaningless for an unstable loop."""
        return self.speed_margins.least_gain

    @property
    def position_gain_margin(self) -> float:
        """Gain margin of the position loop, as ``speed_gain_margin`` [-]."""
        return self.position_margins.least_gain

    @property
    def speed_reach(self) -> float:
        """Frequency at which the closed speed loop's gain is -3 dB [rad/s]."""
        return _reach(self.frequencies, self.speed_loop)

    @property
    def position_reach(self) -> float:
        """Frequency at which the closed position loop's gain is -3 dB, without speed feed-forward [rad/s]."""
        return _reach(self.frequencies, self.position_loop)

    @property
    def damping(self) -> float:
        """Damping ratio of the closed cascade's least damped pole [-]; negative if the cascade is unstable."""
        return min(-pole.real / abs(pole) if pole else 0.0 for pole in self.poles)


def design_loops(
    axis: ServoAxis,
    timing: ServoTiming,
    *,
    speed_bandwidth: float | None = None,
    lightest: float | None = None,
    modulus_margin: float = MODULUS_MARGIN,
) -> LoopDesign:
    """Design the gains of a cascade for a given speed bandwidth, or as fast as current loop, sampling and spring
    permit.

    The first speed bandwidth tried is the smallest of a fifth of the current loop's, a third of the anti-resonance, and
    that of a time constant of ten lags of sampling. It is reduced until both loops are stable and keep the modulus
    margin.

    Args:
        axis: The joint with its heaviest load.
        timing: Current loop and sampling.
        speed_bandwidth: Required crossover frequency of the speed loop [rad/s], which is used as stated; the result
            says whether it is stable. None: the highest one with the required margin.
        lightest: Load inertia with which the same gains must also have the margin [kg m^2]; None: that of ``axis``.
        modulus_margin: Smallest permitted distance of the open loops from -1 [-], above 0 and below 1; 0.5 gives 6 dB
            and 29 deg at every crossing.

    Returns:
        Gains, margins, poles with the heaviest load, and what limits them. If no bandwidth has the margin, the stable
        one with the largest margin; if none is stable, ``stable`` is False.

    Raises:
        InputError: Nothing limits the bandwidth and none is given, or a value is out of its range.
    """
    limits = {
        "current loop": timing.current_bandwidth / BELOW_CURRENT_LOOP,
        "samples and delay": math.inf if timing.lag == 0.0 else 2.0 * math.pi / (SAMPLES * timing.lag),
        "anti-resonance of the joint's spring": resonances(axis)[0] / BELOW_SPRING,
    }
    limit = min(limits, key=lambda name: limits[name])
    wanted = limits[limit] if speed_bandwidth is None else speed_bandwidth
    faults = []
    if not 0.0 < wanted < math.inf:
        hint = "give a bandwidth, a current loop, samples or a stiffness"
        problem = "must be positive, or something must limit it [rad/s]"
        faults.append(Fault("speed_bandwidth", problem, wanted, hint))
    if not 0.0 < modulus_margin < 1.0:
        faults.append(Fault("modulus_margin", "must be above 0 and below 1", modulus_margin))
    if lightest is not None and not 0.0 < lightest <= axis.load_inertia:
        faults.append(Fault("lightest", "must be positive and no more than the axis's load [kg m^2]", lightest))
    raise_faults(faults)
    axes = [axis] if lightest in (None, axis.load_inertia) else [axis, replace(axis, load_inertia=lightest)]
    servos = [_Servo.of(one, timing, wanted) for one in axes]
    if speed_bandwidth is not None:
        return _judged(servos, *_gains(axis, wanted), "wanted")
    found, good = _fastest(servos, axis, wanted, modulus_margin)
    if not good or found < wanted:  # too fast for the lag or the spring: a rigid joint could be faster
        rigid = [_Servo.of(replace(one, stiffness=None), timing, wanted) for one in axes]
        stiff, _ = _fastest(rigid, axis, wanted, modulus_margin)
        by_spring = axis.stiffness is not None and (stiff > found or not good)
        limit = SPRING if by_spring else min(list(limits)[:2], key=lambda name: limits[name])
    design = _judged(servos, *_gains(axis, found), limit)
    if limit != SPRING or not 0.0 < timing.period * resonances(axis)[1] < NOTCHED * math.pi:
        return design
    notch = Notch(resonances(axis)[1])
    servos = [_Servo.of(one, timing, wanted, notch) for one in axes]
    faster, good = _fastest(servos, axis, wanted, modulus_margin)
    if not good or (design.stable and faster < WORTH * found):
        return design
    return replace(design, with_notch=_judged(servos, *_gains(axis, faster), "notch and " + SPRING))


def given_loops(
    axis: ServoAxis,
    timing: ServoTiming,
    speed_gain: float,
    integral_time: float,
    position_gain: float,
    *,
    notch: Notch | None = None,
    limited_by: str = "given gains",
) -> LoopDesign:
    """The loop design that results from given gains."""
    bandwidth = speed_gain * axis.torque_constant / axis.whole_inertia
    servo = _Servo.of(axis, timing, bandwidth, notch)
    return _judged([servo], speed_gain, integral_time, position_gain, limited_by)


def closed_loop(axis: ServoAxis, timing: ServoTiming, design: LoopDesign) -> StateSpace:
    """The closed cascade from commanded to measured motor angle, without speed feed-forward."""
    servo = _Servo.of(axis, timing, design.speed_bandwidth, design.notch)
    return _cascade(servo, design.speed_gain, design.integral_time, design.position_gain)[1]


def _gains(axis: ServoAxis, bandwidth: float) -> tuple[float, float, float]:
    """Gain and integral time of a speed loop, and gain of the position loop around it."""
    return bandwidth * axis.whole_inertia / axis.torque_constant, OUTER / bandwidth, bandwidth / OUTER


def _fastest(servos: list[_Servo], axis: ServoAxis, first: float, margin: float) -> tuple[float, bool]:
    """The largest bandwidth from ``first`` down at which every servo is stable and has the margin, and whether there is
    one.

    If none has the margin, the stable one with the largest margin.
    """
    tried = first * SLOWER ** np.arange(1 + math.ceil(math.log(SLOWEST) / math.log(SLOWER)))
    near = []
    for bandwidth in tried.tolist():
        gains = _gains(axis, bandwidth)
        near.append(min(_distance(servo, *gains)[0] for servo in servos))
        if near[-1] >= margin and all(_settled(*_cascade(servo, *gains)) for servo in servos):
            return bandwidth, True
    for k in np.argsort(near)[::-1]:  # those with the margin are unstable, or one of them would have been returned
        if near[k] < margin and all(_settled(*_cascade(servo, *_gains(axis, float(tried[k])))) for servo in servos):
            return float(tried[k]), False
    return first, False


@dataclass(frozen=True, eq=False)
class _Servo:
    """Plant of the speed loop, from commanded current to measured speed, with its frequency response."""

    axis: ServoAxis
    timing: ServoTiming
    notch: Notch | None
    plant: StateSpace
    at: Array
    response: Array
    summed: Array

    @staticmethod
    def of(axis: ServoAxis, timing: ServoTiming, first: float, notch: Notch | None = None) -> _Servo:
        """The plant with a response that covers every bandwidth from ``first`` down."""
        import control

        plant = servo_plant(axis, timing)
        if notch is not None:
            plant = plant * control.ss(notch_system(notch, timing.period))
        at = _grid(axis, timing, plant, first)
        points = 1j * at if timing.period == 0.0 else np.exp(1j * at * timing.period)
        states = np.linalg.solve(points[:, None, None] * np.eye(plant.nstates) - plant.A, plant.B[None])
        return _Servo(axis, timing, notch, plant, at, (plant.C @ states)[:, 0, 0], _summed(timing)(points))


def _grid(axis: ServoAxis, timing: ServoTiming, plant: StateSpace, first: float) -> Array:
    """Frequencies for the response of an open loop: dense near every lightly damped pole and zero [rad/s]."""
    roots = np.concatenate([plant.poles(), plant.zeros()]).astype(complex)
    if timing.period > 0.0:
        top = math.pi / timing.period
        roots = np.log(roots[np.abs(roots) > 1e-6]) / timing.period
    else:
        top = 100.0 * max([first, *(w for w in (resonances(axis)[1], timing.current_bandwidth) if w < math.inf)])
    at = np.geomspace(1e-2 * SLOWEST * min(first, top), top, POINTS)
    for root in roots[roots.imag > 0.0]:
        apart = np.geomspace(0.03 * max(abs(root.real), 1e-6 * root.imag), 0.3 * root.imag + abs(root.real), AROUND)
        at = np.concatenate([at, root.imag - apart, root.imag + apart])
    return np.unique(at[(at > 0.0) & (at <= (1.0 - 1e-9) * top)])


def _summed(timing: ServoTiming) -> TransferFunction:
    """From measured speed to measured angle, and from the speed error to its integral."""
    import control

    if timing.period == 0.0:
        return control.tf([1.0], [1.0, 0.0])
    return control.tf([timing.period, 0.0], [1.0, -1.0], timing.period)


def _responses(servo: _Servo, gain: float, integral: float, outer: float) -> tuple[Array, Array]:
    """Responses of the open speed loop and the open position loop at the servo's frequencies."""
    inner = gain * (1.0 + servo.summed / integral) * servo.response
    return inner, outer * servo.summed * inner / (1.0 + inner)


def _distance(servo: _Servo, gain: float, integral: float, outer: float) -> tuple[float, float]:
    """Smallest distance of the open loops from -1, and its frequency [rad/s]."""
    away = np.min([np.abs(1.0 + loop) for loop in _responses(servo, gain, integral, outer)], axis=0)
    at = int(np.argmin(away))
    return float(away[at]), float(servo.at[at])


def _cascade(servo: _Servo, gain: float, integral: float, outer: float) -> tuple[StateSpace, StateSpace]:
    """The closed speed loop and the closed cascade."""
    import control

    summed = control.ss(_summed(servo.timing))
    speed = control.feedback(servo.plant * (gain * (1.0 + summed / integral)))
    return speed, control.feedback(outer * summed * speed)


def _settled(*loops: StateSpace) -> bool:
    """Whether all poles of all loops are stable."""
    return all(
        bool((loop.poles().real < 0.0).all() if loop.isctime() else (np.abs(loop.poles()) < 1.0).all())
        for loop in loops
    )


def _judged(servos: list[_Servo], gain: float, integral: float, outer: float, limited_by: str) -> LoopDesign:
    servo = servos[0]
    axis, timing = servo.axis, servo.timing
    loops = [loop for one in servos for loop in _cascade(one, gain, integral, outer)]
    poles = loops[1].poles().astype(complex)
    if timing.period > 0.0:
        poles = np.log(np.where(np.abs(poles) > 1e-12, poles, 1e-12)) / timing.period
    near, where = _distance(servo, gain, integral, outer)
    largest_gain, (anti, res) = sampled_limit(axis, timing), resonances(axis)
    return LoopDesign(
        gain * axis.torque_constant / axis.whole_inertia, outer, gain, integral, outer, limited_by, anti, res,
        _settled(*loops), near, where, tuple(poles.tolist()), 0.0 if math.isinf(largest_gain) else gain / largest_gain,
        servo.at, *_responses(servo, gain, integral, outer), servo.notch,
    )  # fmt: skip


def _margins(at: Array, loop: Array) -> Margins:
    import control

    # The response is infinite at an undamped pole: a finite peak changes no margin.
    shown = loop * np.minimum(1.0, 1e6 / np.maximum(np.abs(loop), 1e-300))
    gain, phase, _, gain_at, phase_at, _ = control.stability_margins(control.frd(shown, at), returnall=True)
    return Margins(
        tuple(zip(gain_at.tolist(), gain.tolist(), strict=True)),
        tuple(zip(phase_at.tolist(), np.radians(phase).tolist(), strict=True)),
    )


def _reach(at: Array, loop: Array) -> float:
    low = np.flatnonzero(np.abs(loop / (1.0 + loop)) < math.sqrt(0.5))
    return float(at[low[0]]) if len(low) else math.inf
