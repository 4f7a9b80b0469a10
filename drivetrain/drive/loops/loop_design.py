"""The loops of one joint's servo, designed from its drive: gains, margins, and what the joint's spring leaves of them.

A loop is judged as the simulation runs it (``effects/control/sampled_cascade.py``): the motor's angle is sampled, its
difference is the speed, the command is held for a period and given out some samples later. Whether it settles is
decided by the poles of the closed loop, never by a margin; how well, by the nearest that the open loop comes to -1.

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
from drivetrain.errors import Fault, InputError

if TYPE_CHECKING:
    from control import StateSpace, TransferFunction

BELOW_CURRENT_LOOP = 5.0  # times slower than the current loop a speed loop is laid out, at least
BELOW_SPRING = 3.0  # and than the anti-resonance
SAMPLES = 10.0  # and periods that the lag of sampling and computing may take of its time
OUTER = 4.0  # times slower than the speed loop the position loop is
MODULUS_MARGIN = 0.5  # from -1: every crossing then has a gain margin of 6 dB and a phase margin of 29 deg at least
SLOWER = 0.95  # is the next bandwidth tried where one does not have it
SLOWEST = 0.02  # of the first one tried: what is slower still is no servo
POINTS, AROUND = 500, 60  # frequencies of a response: along all of it, and on each side of a root
NOTCHED = 0.8  # of half the sampling rate: the highest resonance that a sampled notch is laid on
WORTH = 1.1  # times faster a loop must become by a notch
SPRING = "resonance of the joint's spring"


@dataclass(frozen=True)
class Margins:
    """Of one open loop, at every frequency where there is one.

    Attributes:
        gain: (frequency [rad/s], factor on the gain that would make the loop swing [-]) where the phase is -180 deg.
        phase: (frequency [rad/s], lag that would make it swing [rad]) where the gain is 1.
    """

    gain: tuple[tuple[float, float], ...]
    phase: tuple[tuple[float, float], ...]

    @property
    def least_gain(self) -> float:
        """The gain margin nearest to 1 [-]; infinite where there is none."""
        return min(
            (factor for _, factor in self.gain), key=lambda one: abs(math.log(max(one, 1e-300))), default=math.inf
        )

    @property
    def least_phase(self) -> float:
        """The phase margin nearest to 0 [rad]; infinite where there is none."""
        return min((lag for _, lag in self.phase), key=abs, default=math.inf)


@dataclass(frozen=True, eq=False)
class LoopDesign:
    """Gains of a cascade and how far they are from trouble.

    Attributes:
        speed_bandwidth, position_bandwidth: Crossover of the loops as designed [rad/s].
        speed_gain: At the motor [A s/rad].
        integral_time: Of the speed loop [s].
        position_gain: Of the position loop [1/s].
        limited_by: What keeps the speed loop from being faster.
        anti_resonance, resonance: Of the joint's spring [rad/s]; infinite for a rigid joint.
        stable: Whether both loops settle, by their closed poles, with the lightest load too.
        modulus_margin: The nearest that one of the open loops comes to -1 [-].
        critical_frequency: Where it does [rad/s].
        poles: Of the closed cascade [rad/s]; of a sampled one ln(z) / period.
        sampled_share: Speed gain over the largest that sampling allows for a rigid joint [-]; 0 without samples.
        frequencies: At which the responses are [rad/s], (N,).
        speed_loop, position_loop: Open loops' complex responses, (N,).
        notch: In the speed loop; None: it has none.
        with_notch: The design that a notch would allow, where the spring's resonance limits a sampled one; else None.
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
        """Of the open speed loop, at every crossing."""
        return _margins(self.frequencies, self.speed_loop)

    @cached_property
    def position_margins(self) -> Margins:
        """Of the open position loop, at every crossing."""
        return _margins(self.frequencies, self.position_loop)

    @property
    def speed_phase_margin(self) -> float:
        """Nearest to 0 of all crossings [rad]; meaningless for an unstable loop."""
        return self.speed_margins.least_phase

    @property
    def position_phase_margin(self) -> float:
        """As that of the speed loop [rad]."""
        return self.position_margins.least_phase

    @property
    def speed_gain_margin(self) -> float:
        """Nearest to 1 of all crossings [-]; meaningless for an unstable loop."""
        return self.speed_margins.least_gain

    @property
    def position_gain_margin(self) -> float:
        """As that of the speed loop [-]."""
        return self.position_margins.least_gain

    @property
    def speed_reach(self) -> float:
        """Frequency at which the closed speed loop is down to -3 dB [rad/s]."""
        return _reach(self.frequencies, self.speed_loop)

    @property
    def position_reach(self) -> float:
        """Frequency at which the closed position loop, without speed fed forward, is down to -3 dB [rad/s]."""
        return _reach(self.frequencies, self.position_loop)

    @property
    def damping(self) -> float:
        """Damping ratio of the closed cascade's least damped pole [-]; negative where it does not settle."""
        return min(-pole.real / abs(pole) if pole else 0.0 for pole in self.poles)


def design_loops(
    axis: ServoAxis,
    timing: ServoTiming,
    *,
    speed_bandwidth: float | None = None,
    lightest: float | None = None,
    modulus_margin: float = MODULUS_MARGIN,
) -> LoopDesign:
    """The gains of a cascade, as fast as current loop, samples and spring let it be, or as wanted.

    The speed loop is tried at a fifth of the current loop's bandwidth, a third of the anti-resonance, or slow enough
    for ten lags of sampling, whichever is least; then ever slower, until both loops settle and stay away from -1.

    Args:
        axis: The joint, with its load at its heaviest.
        timing: Current loop and samples.
        speed_bandwidth: Wanted crossover of the speed loop [rad/s]: used as stated, with a statement whether the loop
            is stable. None: the fastest that has the margin.
        lightest: Load inertia with which the same gains must have the margin too [kg m^2]; None: the axis's own.
        modulus_margin: Least distance of the open loops from -1 [-], above 0 and below 1; 0.5 means 6 dB and 29 deg at
            every crossing.

    Returns:
        Gains, margins, poles with the heaviest load, and what limits them. Where no bandwidth has the margin, the one
        that comes nearest to it of those that settle; where none settles ``stable`` is False.

    Raises:
        InputError: Nothing limits the bandwidth and none is wanted, or a number out of its range.
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
    if faults:
        raise InputError(faults)
    axes = [axis] if lightest in (None, axis.load_inertia) else [axis, replace(axis, load_inertia=lightest)]
    servos = [_Servo.of(one, timing, wanted) for one in axes]
    if speed_bandwidth is not None:
        return _judged(servos, *_gains(axis, wanted), "wanted")
    found, good = _fastest(servos, axis, wanted, modulus_margin)
    if not good or found < wanted:  # too fast for its lag, or for its spring: that is, a rigid joint could be faster
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
    """What gains make of an axis."""
    bandwidth = speed_gain * axis.torque_constant / axis.whole_inertia
    servo = _Servo.of(axis, timing, bandwidth, notch)
    return _judged([servo], speed_gain, integral_time, position_gain, limited_by)


def closed_loop(axis: ServoAxis, timing: ServoTiming, design: LoopDesign) -> StateSpace:
    """The cascade from commanded to measured angle of the motor, without speed fed forward."""
    servo = _Servo.of(axis, timing, design.speed_bandwidth, design.notch)
    return _cascade(servo, design.speed_gain, design.integral_time, design.position_gain)[1]


def _gains(axis: ServoAxis, bandwidth: float) -> tuple[float, float, float]:
    """Gain and integral time of a speed loop, and gain of the position loop around it."""
    return bandwidth * axis.whole_inertia / axis.torque_constant, OUTER / bandwidth, bandwidth / OUTER


def _fastest(servos: list[_Servo], axis: ServoAxis, first: float, margin: float) -> tuple[float, bool]:
    """The largest bandwidth from ``first`` down at which every bench settles and stays away from -1, if there is one.

    Where none has the margin, the nearest to it of those that settle.
    """
    tried = first * SLOWER ** np.arange(1 + math.ceil(math.log(SLOWEST) / math.log(SLOWER)))
    near = []
    for bandwidth in tried.tolist():
        gains = _gains(axis, bandwidth)
        near.append(min(_distance(servo, *gains)[0] for servo in servos))
        if near[-1] >= margin and all(_settled(*_cascade(servo, *gains)) for servo in servos):
            return bandwidth, True
    for k in np.argsort(near)[::-1]:  # those with the margin do not settle, or they would have been taken
        if near[k] < margin and all(_settled(*_cascade(servo, *_gains(axis, float(tried[k])))) for servo in servos):
            return float(tried[k]), False
    return first, False


@dataclass(frozen=True, eq=False)
class _Servo:
    """An axis as its speed loop meets it: from the commanded current, late as it comes, to the measured speed."""

    axis: ServoAxis
    timing: ServoTiming
    notch: Notch | None
    plant: StateSpace
    at: Array
    response: Array
    summed: Array

    @staticmethod
    def of(axis: ServoAxis, timing: ServoTiming, first: float, notch: Notch | None = None) -> _Servo:
        """With responses that show every bandwidth from ``first`` down."""
        import control

        plant = servo_plant(axis, timing)
        if notch is not None:
            plant = plant * control.ss(notch_system(notch, timing.period))
        at = _grid(axis, timing, plant, first)
        points = 1j * at if timing.period == 0.0 else np.exp(1j * at * timing.period)
        states = np.linalg.solve(points[:, None, None] * np.eye(plant.nstates) - plant.A, plant.B[None])
        return _Servo(axis, timing, notch, plant, at, (plant.C @ states + plant.D)[:, 0, 0], _summed(timing)(points))


def _grid(axis: ServoAxis, timing: ServoTiming, plant: StateSpace, first: float) -> Array:
    """Frequencies that show an open loop whole: dense about every pole and zero that is hardly damped [rad/s]."""
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
    """From measured speed to measured angle, and from the speed's error to its integral."""
    import control

    if timing.period == 0.0:
        return control.tf([1.0], [1.0, 0.0])
    return control.tf([timing.period, 0.0], [1.0, -1.0], timing.period)


def _responses(servo: _Servo, gain: float, integral: float, outer: float) -> tuple[Array, Array]:
    """Open speed loop and open position loop along the bench's frequencies."""
    inner = gain * (1.0 + servo.summed / integral) * servo.response
    return inner, outer * servo.summed * inner / (1.0 + inner)


def _distance(servo: _Servo, gain: float, integral: float, outer: float) -> tuple[float, float]:
    """The nearest that one of the open loops comes to -1, and at which frequency."""
    away = np.min([np.abs(1.0 + loop) for loop in _responses(servo, gain, integral, outer)], axis=0)
    at = int(np.argmin(away))
    return float(away[at]), float(servo.at[at])


def _cascade(servo: _Servo, gain: float, integral: float, outer: float) -> tuple[StateSpace, StateSpace]:
    """Closed speed loop and closed cascade."""
    import control

    summed = control.ss(_summed(servo.timing))
    speed = control.feedback(servo.plant * (gain * (1.0 + summed / integral)))
    return speed, control.feedback(outer * summed * speed)


def _settled(*loops: StateSpace) -> bool:
    """Whether every pole of every loop lies where what it stands for fades."""
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
    most, (anti, res) = sampled_limit(axis, timing), resonances(axis)
    return LoopDesign(
        gain * axis.torque_constant / axis.whole_inertia, outer, gain, integral, outer, limited_by, anti, res,
        _settled(*loops), near, where, tuple(poles.tolist()), 0.0 if math.isinf(most) else gain / most,
        servo.at, *_responses(servo, gain, integral, outer), servo.notch,
    )  # fmt: skip


def _margins(at: Array, loop: Array) -> Margins:
    import control

    # Where a pole is not damped at all the loop is infinite: nothing is lost by a finite peak.
    shown = loop * np.minimum(1.0, 1e6 / np.maximum(np.abs(loop), 1e-300))
    gain, phase, _, gain_at, phase_at, _ = control.stability_margins(control.frd(shown, at), returnall=True)
    return Margins(
        tuple(zip(gain_at.tolist(), gain.tolist(), strict=True)),
        tuple(zip(phase_at.tolist(), np.radians(phase).tolist(), strict=True)),
    )


def _reach(at: Array, loop: Array) -> float:
    low = np.flatnonzero(np.abs(loop / (1.0 + loop)) < math.sqrt(0.5))
    return float(at[low[0]]) if len(low) else math.inf
