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
    """What one joint's drive is judged by, of a simulated cycle.

    Attributes:
        peak_current, rms_current: [A].
        rms_torque: Through the mesh, at the gear's output [N m or N].
        winding_temperature: Hottest in the periodic steady state of the cycle [C]; NaN where the sheet does not say.
        ambient: Air [C].
        deviation: Largest distance from the commanded position [rad or m].
    """

    peak_current: float
    rms_current: float
    rms_torque: float
    winding_temperature: float
    ambient: float
    deviation: float

    @property
    def rise(self) -> float:
        """Of the winding over the air [K]."""
        return self.winding_temperature - self.ambient


@dataclass(frozen=True, eq=False)
class Decision:
    """What a set of drives is judged by, of a simulated cycle.

    Attributes:
        joints: By name.
        tip_deviation: Largest distance of the tip from where it is commanded [m]; of one joint its own [rad or m].
        checks: Of the study, held against the simulated series, by joint; empty without a study.
    """

    joints: Mapping[str, JointDecision]
    tip_deviation: float
    checks: Mapping[str, tuple[Check, ...]] = field(default_factory=dict)

    @property
    def verdict(self) -> Verdict:
        """Of all checks, see ``verdict_of``."""
        return verdict_of(check for checks in self.checks.values() for check in checks)


@dataclass(frozen=True)
class Change:
    """How far two decisions lie apart, or are thought to, as shares; of the tip as a length.

    Attributes:
        peak_current, rms_current, rms_torque: Over the values of the full scene [-].
        temperature: Over the winding's rise in the full scene [-].
        tip: [m], of one joint [rad or m].
    """

    peak_current: float = 0.0
    rms_current: float = 0.0
    rms_torque: float = 0.0
    temperature: float = 0.0
    tip: float = 0.0

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
    """One effect that may be left out.

    Attributes:
        kind: Name of the effect's class.
        joint: Its joint; ``scene`` for one of all.
    """

    kind: str
    joint: str


@dataclass(frozen=True, eq=False)
class EffectCost:
    """One effect left out of the full scene.

    Attributes:
        label: What it is, in words.
        joints: Where it was left out.
        changes: By joint, signed: without it less with it.
        verdict: Without it.
        time: Of the full scene over that without it [-]; above 1 it costs time.
        work: Evaluations of the full scene over those without it [-].
    """

    label: str
    joints: tuple[str, ...]
    changes: Mapping[str, Change]
    verdict: Verdict
    time: float
    work: float


@dataclass(frozen=True, eq=False)
class EffectCosts:
    """Every effect left out once.

    Attributes:
        full: Decision of the full scene.
        seconds: Processor time of one run of it [s].
        solver: What ran it.
        counters: Its work.
        rows: One an effect, dearest first.
        bare: Processor time without any of them over the full one's [-].
    """

    full: Decision
    seconds: float
    solver: str
    counters: Mapping[str, int]
    rows: tuple[EffectCost, ...]
    bare: float


@dataclass(frozen=True)
class Judged:
    """An effect before the run: what leaving it out is thought to change, and what became of it.

    Attributes:
        choice: The effect.
        label: In words.
        estimate: Bounds on the changes at its joint.
        valid: Whether the derivation holds here.
        why: The derivation, or what it lacks.
        kept: Whether the scene keeps it.
        cost: What keeping it is thought to cost [-], relative to others.
    """

    choice: Choice
    label: str
    estimate: Change
    valid: bool
    why: str
    kept: bool
    cost: float


@dataclass(frozen=True, eq=False)
class Proof:
    """The chosen scene run beside the full one.

    Attributes:
        chosen, full: Decisions.
        estimate, measured: Changes by joint; the tip's is the scene's.
        numerical: How much of the measured change may be the step's, by halving it.
        steps: That were used [s].
        audit: Energy that is there and should not be, over what was put in and taken out [-].
        seconds_chosen, seconds_full: Processor time of one run [s].
        beyond: Whether the measured change is beyond the tolerance.
        proven: Whether it is within, and the numbers good enough to say so.
        why: In words.
    """

    chosen: Decision
    full: Decision
    estimate: Mapping[str, Change]
    measured: Mapping[str, Change]
    numerical: Mapping[str, Change]
    steps: float
    audit: float
    seconds_chosen: float
    seconds_full: float
    beyond: bool
    proven: bool
    why: str


@dataclass(frozen=True, eq=False)
class AutoChoice:
    """The cheapest scene within a tolerance, and its proof.

    Attributes:
        scene: To be run.
        tolerance: Of the decision quantities [-].
        tip_tolerance: Of the tip [m], of one joint [rad or m].
        effects: All that could be left out.
        proof: None where nothing was left out.
        restored: Effects that came back because the proof asked for them.
    """

    scene: Scene
    tolerance: float
    tip_tolerance: float
    effects: tuple[Judged, ...]
    proof: Proof | None
    restored: tuple[Choice, ...] = ()

    @property
    def dropped(self) -> tuple[Judged, ...]:
        """Effects that are left out."""
        return tuple(one for one in self.effects if not one.kept)


@dataclass(frozen=True)
class SolverRun:
    """One solver at one setting.

    Attributes:
        family: Such as ``fixed step``.
        setting: Its step [s] or tolerance [-].
        error: In the decision quantities, the largest share [-]; NaN where the run did not end.
        seconds: Processor time, the median of some runs [s].
        work: Evaluations of the right-hand side or solved steps.
        note: Why it did not end; empty where it did.
        where: The decision quantity that is furthest off, and its joint.
    """

    family: str
    setting: float
    error: float
    seconds: float
    work: int
    note: str = ""
    where: str = ""


@dataclass(frozen=True, eq=False)
class SolverCosts:
    """Work and precision on one scene.

    Attributes:
        runs: All of them.
        reference: What they are held against, in words.
        settled: Largest share by which two settings of the reference differ [-]; smaller errors are not drawn.
    """

    runs: tuple[SolverRun, ...]
    reference: str
    settled: float


@dataclass(frozen=True, eq=False)
class JointCurrents:
    """The current of one joint by both roads.

    Attributes:
        time: [s], (N,).
        inverse, forward: [A], (N,).
        moving: Where the joint is commanded to move, (N,).
        peaks, rms: Of both roads [A].
        apart_moving, apart_resting: RMS of the difference over that of the inverse road [-]; NaN where it never does.
        note: What the difference comes from, in words.
    """

    time: Array
    inverse: Array
    forward: Array
    moving: Array
    peaks: tuple[float, float]
    rms: tuple[float, float]
    apart_moving: float
    apart_resting: float
    note: str


@dataclass(frozen=True, eq=False)
class RoadsCompared:
    """Sizing against simulation with the same effects.

    Attributes:
        joints: By name.
        recording: Of the forward run.
    """

    joints: Mapping[str, JointCurrents]
    recording: Recording
