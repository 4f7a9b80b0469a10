"""What is found about accuracy and its cost: plain results, computed in ``accuracy/`` and drawn in ``report/``."""

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
    """What one joint's drive is judged by, of a simulated cycle."""

    # [A]
    peak_current: float
    rms_current: float
    rms_torque: float  # through the mesh, at the gear's output [N m or N]
    # hottest in the periodic steady state of the cycle [C]; NaN where the sheet does not say
    winding_temperature: float
    ambient: float  # air [C]
    deviation: float  # largest distance from the commanded position [rad or m]

    @property
    def rise(self) -> float:
        """Of the winding over the air [K]."""
        return self.winding_temperature - self.ambient


@dataclass(frozen=True, eq=False)
class Decision:
    """What a set of drives is judged by, of a simulated cycle."""

    joints: Mapping[str, JointDecision]  # by name
    tip_deviation: float  # largest distance of the tip from where it is commanded [m]; of one joint its own [rad or m]
    # of the study, held against the simulated series, by joint; empty without a study
    checks: Mapping[str, tuple[Check, ...]] = field(default_factory=dict)

    @property
    def verdict(self) -> Verdict:
        return verdict_of(check for checks in self.checks.values() for check in checks)


@dataclass(frozen=True)
class Change:
    """How far two decisions lie apart, or are thought to, as shares; of the tip as a length."""

    # over the values of the full scene [-]
    peak_current: float = 0.0
    rms_current: float = 0.0
    rms_torque: float = 0.0
    temperature: float = 0.0  # over the winding's rise in the full scene [-]
    tip: float = 0.0  # [m], of one joint [rad or m]

    def largest(self, tip_scale: float) -> float:
        """The largest share, the tip's beside a length."""
        return max(self._sizes(tip_scale).values(), default=0.0)

    def leading(self, tip_scale: float) -> str:
        """Which quantity the largest share belongs to."""
        sizes = self._sizes(tip_scale)
        return max(sizes, key=lambda name: sizes[name], default="tip")

    def _sizes(self, tip_scale: float) -> dict[str, float]:
        words = ("peak current", "RMS current", "RMS torque", "winding temperature")
        named = dict(zip(words, self.shares, strict=True))
        named["tip"] = self.tip / tip_scale if tip_scale > 0.0 else 0.0
        return {name: abs(share) for name, share in named.items() if not math.isnan(share)}

    @property
    def shares(self) -> tuple[float, float, float, float]:
        """Those of the joint [-]."""
        return self.peak_current, self.rms_current, self.rms_torque, self.temperature


@dataclass(frozen=True)
class Choice:
    """One effect that may be left out."""

    kind: str  # name of the effect's class
    joint: str  # its joint; ``scene`` for one of all


@dataclass(frozen=True, eq=False)
class EffectCost:
    """One effect left out of the full scene."""

    label: str  # what it is, in words
    joints: tuple[str, ...]  # where it was left out
    changes: Mapping[str, Change]  # by joint, signed: without it less with it
    verdict: Verdict  # without it
    time: float  # of the full scene over that without it [-]; above 1 it costs time
    work: float  # evaluations of the full scene over those without it [-]


@dataclass(frozen=True, eq=False)
class EffectCosts:
    """Every effect left out once."""

    full: Decision  # decision of the full scene
    seconds: float  # processor time of one run of it [s]
    solver: str  # what ran it
    counters: Mapping[str, int]  # its work
    rows: tuple[EffectCost, ...]  # one an effect, dearest first
    bare: float  # processor time without any of them over the full one's [-]


@dataclass(frozen=True)
class Judged:
    """An effect before the run: what leaving it out is thought to change, and what became of it."""

    choice: Choice  # the effect
    label: str  # in words
    estimate: Change  # bounds on the changes at its joint
    valid: bool  # whether the derivation holds here
    why: str  # the derivation, or what it lacks
    kept: bool  # whether the scene keeps it
    cost: float  # what keeping it is thought to cost [-], relative to others


@dataclass(frozen=True, eq=False)
class Proof:
    """The chosen scene run beside the full one."""

    # decisions
    chosen: Decision
    full: Decision
    # changes by joint; the tip's is the scene's
    estimate: Mapping[str, Change]
    measured: Mapping[str, Change]
    numerical: Mapping[str, Change]  # how much of the measured change may be the step's, by halving it
    steps: float  # that were used [s]
    audit: float  # energy that is there and should not be, over what was put in and taken out [-]
    # processor time of one run [s]
    seconds_chosen: float
    seconds_full: float
    beyond: bool  # whether the measured change is beyond the tolerance
    proven: bool  # whether it is within, and the numbers good enough to say so
    why: str  # in words


@dataclass(frozen=True, eq=False)
class AutoChoice:
    """The cheapest scene within a tolerance, and its proof."""

    scene: Scene  # to be run
    tolerance: float  # of the decision quantities [-]
    tip_tolerance: float  # of the tip [m], of one joint [rad or m]
    effects: tuple[Judged, ...]  # all that could be left out
    proof: Proof | None  # none where nothing was left out
    restored: tuple[Choice, ...] = ()  # effects that came back because the proof asked for them

    @property
    def dropped(self) -> tuple[Judged, ...]:
        return tuple(one for one in self.effects if not one.kept)


@dataclass(frozen=True)
class SolverRun:
    """One solver at one setting."""

    family: str  # such as ``fixed step``
    setting: float  # its step [s] or tolerance [-]
    error: float  # in the decision quantities, the largest share [-]; NaN where the run did not end
    seconds: float  # processor time, the median of some runs [s]
    work: int  # evaluations of the right-hand side or solved steps
    note: str = ""  # why it did not end; empty where it did
    where: str = ""  # the decision quantity that is furthest off, and its joint


@dataclass(frozen=True, eq=False)
class SolverCosts:
    """Work and precision on one scene."""

    runs: tuple[SolverRun, ...]  # all of them
    reference: str  # what they are held against, in words
    settled: float  # largest share by which two settings of the reference differ [-]; smaller errors are not drawn


@dataclass(frozen=True, eq=False)
class JointCurrents:
    """The current of one joint by both roads."""

    time: Array  # [s], (N,)
    # [A], (N,)
    inverse: Array
    forward: Array
    moving: Array  # where the joint is commanded to move, (N,)
    # of both roads [A]
    peaks: tuple[float, float]
    rms: tuple[float, float]
    # RMS of the difference over that of the inverse road [-]; NaN where it never does
    apart_moving: float
    apart_resting: float
    note: str  # what the difference comes from, in words


@dataclass(frozen=True, eq=False)
class CurrentsCompared:
    """Sizing against simulation with the same effects."""

    joints: Mapping[str, JointCurrents]  # by name
    recording: Recording  # of the forward run
