"""Results about accuracy and computing time, computed in ``accuracy/`` and shown in ``report/``."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from drivetrain.arrays import Array
from drivetrain.simulation.recording import Recording
from drivetrain.simulation.scene import Scene
from drivetrain.study.parts.verdicts import Check, Verdict, verdict_of


@dataclass(frozen=True)
class JointDecision:
    """The decision quantities of one joint in a simulated cycle."""

    # [A]
    peak_current: float
    rms_current: float
    rms_torque: float  # transmitted by the mesh, at the gear's output [N m or N]
    # maximum in the periodic steady state of the cycle [C]; NaN if the data sheet does not allow to compute it
    winding_temperature: float
    ambient: float  # ambient temperature [C]
    deviation: float  # largest deviation from the commanded position [rad or m]; NaN without a command

    @property
    def rise(self) -> float:
        """Temperature rise of the winding over ambient [K]."""
        return self.winding_temperature - self.ambient


@dataclass(frozen=True, eq=False)
class Decision:
    """The decision quantities of a set of drives in a simulated cycle."""

    joints: Mapping[str, JointDecision]  # by joint name
    # largest distance of the tip from its commanded position [m]; without an arm that of the joint [rad or m];
    # NaN unless every joint has a command
    tip_deviation: float
    # the study's checks with requirements from the simulation, by joint; empty without a study
    checks: Mapping[str, tuple[Check, ...]] = field(default_factory=dict)

    @property
    def verdict(self) -> Verdict:
        """The worst verdict of all checks."""
        return verdict_of(check for checks in self.checks.values() for check in checks)


@dataclass(frozen=True)
class Change:
    """Measured or estimated change of the decision quantities: relative, for the tip a length."""

    # relative to the values of the full scene [-]
    peak_current: float = 0.0
    rms_current: float = 0.0
    rms_torque: float = 0.0
    temperature: float = 0.0  # relative to the winding's temperature rise in the full scene [-]
    tip: float = 0.0  # change of the tip's deviation [m]; without an arm of the joint's [rad or m]

    def largest(self, tip_scale: float) -> float:
        """The largest relative change [-]; that of the tip is relative to ``tip_scale`` [m]."""
        return max(self._sizes(tip_scale).values(), default=0.0)

    def leading(self, tip_scale: float) -> str:
        """The name of the quantity with the largest relative change."""
        sizes = self._sizes(tip_scale)
        return max(sizes, key=lambda name: sizes[name], default="tip")

    def _sizes(self, tip_scale: float) -> dict[str, float]:
        """Absolute relative changes by name, without unknown ones [-]."""
        words = ("peak current", "RMS current", "RMS torque", "winding temperature")
        named = dict(zip(words, self.shares, strict=True))
        named["tip"] = self.tip / tip_scale if tip_scale > 0.0 else 0.0
        return {name: abs(share) for name, share in named.items() if not math.isnan(share)}

    @property
    def shares(self) -> tuple[float, float, float, float]:
        """The relative changes of the joint's quantities [-]; without the tip."""
        return self.peak_current, self.rms_current, self.rms_torque, self.temperature


@dataclass(frozen=True)
class Choice:
    """One effect at one place that may be left out."""

    kind: str  # name of the effect's class
    joint: str  # its joint; ``scene`` for an effect of the whole scene


@dataclass(frozen=True, eq=False)
class EffectCost:
    """Influence and computing time of one effect, from the full scene and the scene without it."""

    label: str  # name of the effect in reports
    joints: tuple[str, ...]  # where it was left out
    changes: Mapping[str, Change]  # by joint, signed: value without it minus value with it
    verdict: Verdict  # without it
    time: float  # computing time of the full scene over that without it [-]
    work: float  # evaluations of the full scene over those without it [-]


@dataclass(frozen=True, eq=False)
class EffectCosts:
    """Influence and computing time of all effects, each left out once."""

    full: Decision  # decision of the full scene
    seconds: float  # processor time of one run of the full scene [s]
    solver: str  # the engine used
    counters: Mapping[str, int]  # counters of the full scene's run
    rows: tuple[EffectCost, ...]  # one per effect, the most expensive first
    bare: float  # processor time without any of them over that of the full scene [-]


@dataclass(frozen=True)
class Judged:
    """The estimated influence of an effect, and whether the chosen scene keeps it."""

    choice: Choice  # the effect
    label: str  # its name in reports
    estimate: Change  # estimated changes at its joint, the largest of all joints
    valid: bool  # whether the run without it reached its end
    why: str  # how the estimate was found, or what ended that run
    kept: bool  # whether the chosen scene keeps it
    cost: float  # assumed computing time, relative to the others [-]


@dataclass(frozen=True, eq=False)
class Proof:
    """The comparison of the chosen scene with the full one."""

    # decisions of both scenes
    chosen: Decision
    full: Decision
    # changes by joint; the change at the tip is the same at all joints
    estimate: Mapping[str, Change]
    measured: Mapping[str, Change]
    numerical: Mapping[str, Change]  # numerical error of the measured change, by halving the step
    steps: float  # time step of both runs [s]
    audit: float  # error of the energy balance over the energy exchanged [-]
    # processor time of one run [s]
    seconds_chosen: float
    seconds_full: float
    beyond: bool  # whether the measured change exceeds the tolerance
    proven: bool  # whether it is within the tolerance, with small enough numerical error and energy error
    why: str  # the result in words


@dataclass(frozen=True, eq=False)
class AutoChoice:
    """The cheapest scene within a tolerance, and its proof."""

    scene: Scene  # the chosen scene
    tolerance: float  # relative tolerance of the decision quantities [-]
    tip_tolerance: float  # tolerance of the tip's deviation [m]; without an arm of the joint's [rad or m]
    effects: tuple[Judged, ...]  # all effects that could be left out
    proof: Proof | None  # None if nothing was left out
    restored: tuple[Choice, ...] = ()  # effects that were left out first, and restored after a failed proof

    @property
    def dropped(self) -> tuple[Judged, ...]:
        """The effects that were left out."""
        return tuple(one for one in self.effects if not one.kept)


@dataclass(frozen=True)
class SolverRun:
    """Result of one solver at one setting."""

    family: str  # method, such as ``fixed implicit step``
    setting: float  # its step [s] or relative tolerance [-]
    error: float  # largest relative error of the decision quantities [-]; NaN if the run stopped early
    seconds: float  # processor time, median of several runs [s]
    work: int  # evaluations of the right-hand side, or solutions of steps
    note: str = ""  # why it stopped early; empty if it did not
    where: str = ""  # the decision quantity with the largest error, and its joint


@dataclass(frozen=True, eq=False)
class SolverCosts:
    """Work-precision data of the solvers on one scene."""

    runs: tuple[SolverRun, ...]
    reference: str  # description of the reference solution
    settled: float  # largest relative difference of two settings of the reference [-]; smaller errors are not shown


@dataclass(frozen=True, eq=False)
class JointCurrents:
    """The current of one joint from sizing (inverse) and from simulation (forward)."""

    time: Array  # [s], (N,)
    # [A], (N,)
    inverse: Array
    forward: Array
    moving: Array  # whether the joint is commanded to move, (N,)
    # (inverse, forward) [A]
    peaks: tuple[float, float]
    rms: tuple[float, float]
    # RMS of the difference over the RMS of the inverse current, while moving and at rest [-]; NaN if it never does
    apart_moving: float
    apart_resting: float
    note: str  # the cause of the difference, in words


@dataclass(frozen=True, eq=False)
class CurrentsCompared:
    """Comparison of the currents of sizing and of simulation with the same effects."""

    joints: Mapping[str, JointCurrents]  # by joint name
    recording: Recording  # of the simulation
