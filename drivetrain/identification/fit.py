"""Parameters of an arm from a recording: bodies, rotors and friction, their uncertainty, and the errors on unseen data.

Deviations from the given parameters are fitted to the torques that the given arm and friction do not explain, by
weighted least squares with a prior at the given values; cross-validation chooses the strength of the prior. Each part
of the recording is held out once, so the reported errors are those on data that were not used in the fit.

Reference: J. Swevers, W. Verdonck, J. De Schutter, Dynamic model identification for industrial robots, IEEE Control
    Systems Magazine 27 (2007) 58-71; base parameters and consistency as described there.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arm.coupling import rotor_turns, shaft_motion, shaft_torques, shaft_turns
from drivetrain.arm.geared import with_rotors
from drivetrain.arm.rotors import MountedRotor
from drivetrain.arrays import Array, Mask, checked_array, read_only
from drivetrain.drive.amplifier import motor_basis, to_dc
from drivetrain.drive.counterbalance import counterbalance_torque
from drivetrain.drive.drive import Drive, shaft_friction
from drivetrain.drive.friction import FRICTIONLESS, Friction, FrictionCurve, direction, friction_at, friction_curve
from drivetrain.drive.gear import NO_GEAR, complete, drag_torque, mesh_of
from drivetrain.dynamics.from_positions import rates_from_positions
from drivetrain.dynamics.inverse import joint_loads
from drivetrain.dynamics.regressor import COLUMN, ROW, parameter_names, torque_parameters, torque_regressor
from drivetrain.errors import Fault, InputError, nearest, whole_names
from drivetrain.identification.least_squares import (
    BaseParameters,
    base_parameters,
    correlated_covariance,
    problem_of,
)
from drivetrain.identification.plausibility import Evidence, warnings
from drivetrain.motion.recording import MeasuredMotion
from drivetrain.motion.smoothing import estimated_noise
from drivetrain.notebook import axes_of, shown
from drivetrain.records import as_record
from drivetrain.sizing.judge.parts import FilledParts
from drivetrain.study.model import DriveMass, Study, refuse_moving_base
from drivetrain.study.parts.mounting import emptied, loaded_arm

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

FOLDS = 10  # parts of the recording for cross-validation
MOST_SAMPLES = 20_000  # of longer recordings every second, third, ... sample is used
GAP = 0.04  # [s] left out at both ends of a held-out part, because smoothing uses samples on both sides
LAWS = {"viscous": "N m s/rad", "coulomb": "N m", "load_share": "-"}  # units of identified friction coefficients
MOST_LOAD = 0.999  # largest load-dependent friction over load
SLOW = 0.01  # share of a joint's highest speed over which Coulomb friction changes its sign
# Samples slower than this multiple of that speed, or of the speed's noise, are not used: friction near rest is not
# determined by the speed.
RESTS = 3.0
PASSES = 3  # of the fit, if the model is not linear in the parameters
MOVES = 0.03  # least share of faster samples of a joint that moves


@dataclass(frozen=True, eq=False)
class Identification:
    """An arm identified from a recording.

    Attributes:
        arm: The given arm with the identified parameters.
        friction: Friction at each joint, (n,).
        study: The given study with the identified arm and friction, ready to be evaluated; None if an arm was given.
        parameters: DataFrame by parameter name: ``prior``, ``identified``, ``deviation`` (standard deviation, infinite
            for a parameter that the recording determines only in combination with others, or not at all), ``share``
            (remaining share of the prior's uncertainty: near 1 if the recording adds nothing to what was given).
        base: DataFrame of the combinations that torques can distinguish: ``value``, ``deviation`` (standard deviation
            from the data, and how far prior and physical limits have drawn it) and ``combination`` as text.
        errors: DataFrame by joint, on held-out data at which the joint moves: RMS torque ``measured``, RMS error of the
            model ``given`` and of the ``identified`` one, physically consistent [N m or N], ``correlation``.
        contributions: DataFrame of RMS torque [N m or N] by joint and cause (links, rotors, each friction,
            unexplained).
        condition: Condition number of the scaled regressor of the base parameters [-]; above about 100 the motion
            excites the parameters too little.
        torque_constant: Of each motor per ampere of the recording, if torque and current were both measured [N m/A],
            (n,); else None.
        time: Instants of the samples used [s], (N,).
        measured, modelled: Torque at the joints, measured and by the model identified from all data [N m or N], (N, n).
        notes: Details of the method; those that begin with "warning:" say what contradicts the recording.
    """

    arm: Arm
    friction: tuple[Friction, ...]
    study: Study | None
    parameters: pd.DataFrame
    base: pd.DataFrame
    errors: pd.DataFrame
    contributions: pd.DataFrame
    condition: float
    torque_constant: Array | None
    time: Array
    measured: Array
    modelled: Array
    notes: tuple[str, ...]

    def __repr__(self) -> str:
        better = int((self.errors["identified"] < self.errors["given"]).sum())
        return f"Identification({len(self.base)} base parameters, better on {better} of {len(self.errors)} joints)"

    def _repr_html_(self) -> str:
        unit = ["N" if slides else "N m" for slides in self.arm.slides]
        return shown(f"{self!r}; RMS torque and errors on data held out", self.errors.assign(unit=unit))

    def plot(self, ax: Axes | None = None, *, joint: str | None = None) -> Axes:
        """Plot measured and modelled torque of one joint over time.

        Args:
            ax: Axes to draw on; None: a new figure.
            joint: Name, or a unique part of it; None: the joint with the largest error of the modelled torque.

        Returns:
            The axes.

        Raises:
            InputError: No such joint.
        """
        names = self.arm.joint_names
        worst = names[int(np.abs(self.measured - self.modelled).max(axis=0).argmax())]
        [name] = whole_names("joint", "joint of this arm", [worst if joint is None else joint], names)
        i, ax = names.index(name), axes_of(ax)
        ax.plot(self.time, self.measured[:, i], color="0.6", label="measured")
        ax.plot(self.time, self.modelled[:, i], color="C0", linewidth=0.9, label="identified")
        unit = "N" if self.arm.slides[i] else "N m"
        ax.set(xlabel="time [s]", ylabel=f"{'torque' if unit == 'N m' else 'force'} [{unit}]", title=name)
        ax.legend(loc="upper right")
        return ax


def identify(
    study: Study | Arm,
    recording: MeasuredMotion,
    *,
    friction: Sequence[Friction] | None = None,
    known_torque: Any = None,
    torque_constant: Any = None,
    links: Sequence[str] | None = None,
    load_friction: bool = False,
) -> Identification:
    """Identify bodies, rotors and friction of an arm from a recording.

    Args:
        study: A study with an arm, whose drives and friction are the prior; or the arm alone. Counterbalances of a
            study, and if all its drives are given also their rotors, gear losses and motor friction, are not changed;
            rotors of an arm are identified (inertia about their axes). The recording is one without the study's
            payloads and forces at the tip.
        recording: Positions, and torques at joints or motors, or currents. Speeds and accelerations that are missing
            are computed as in ``torque_from_positions``.
        friction: Friction at the joints, (n,), as a prior; None: the study's; for an arm: none.
        known_torque: Joint torques that are neither in the arm nor in the study [N m or N], (N, n): subtracted from the
            measured torques.
        torque_constant: Of the motors per ampere of the recording [N m/A], a number or (n,), used if only currents were
            measured; None: those of the study's drives, by the recording's ``current_basis``; of brushless motors,
            currents without one count as ``dc``.
        links: Names of the links whose parameters are identified; None: all. With only the last link, the difference of
            its parameters from those of a known arm is the payload.
        load_friction: Whether to identify friction in proportion to the load, ``load_share`` of the friction [-],
            which corresponds to a gear efficiency of 1 / (1 + load_share).

    Returns:
        The arm with its identified parameters, and their uncertainty.

    Raises:
        InputError: No arm, joints other than the arm's, no torque, wrong shapes, or too few samples.

    Example: ``dt.identify(dt.load_study("arm.yaml"), dt.read_recording("run.csv", names)).errors``
    """
    if not isinstance(recording, MeasuredMotion):
        hint = "dt.read_recording reads one from a file"
        raise InputError(Fault("recording", "must be a MeasuredMotion", type(recording).__name__, hint))
    prior = _prior(study, friction)
    arm = prior.arm
    thin = -(-len(recording.time) // MOST_SAMPLES)
    motion, noise = _motion(recording, arm)
    motion, noise = [values[::thin] for values in motion], noise[::thin]
    time, measured = recording.time[::thin], _joint_torque(recording, prior, torque_constant)[::thin]
    known = np.zeros(measured.shape)
    if known_torque is not None:
        known = checked_array(known_torque, recording.position.shape, "known_torque")[::thin]
    used, moves = _moving(prior, motion[1], noise)
    gap = round(GAP / float(np.median(np.diff(time))))
    if len(time) < FOLDS * (2 * gap + 10):
        raise InputError(Fault("recording", f"needs at least {FOLDS * (2 * gap + 10)} samples", len(time)))
    before = (measured - known - _model(prior, motion).given) * used
    spread = np.maximum(_rms(before, used), 1e-6 * np.maximum(np.abs(measured).max(axis=0), 1.0))
    new_friction, beyond, regressor = prior.friction, np.zeros(measured.shape), torque_regressor(arm, *motion)
    for _ in range(PASSES if load_friction or prior.drives else 1):
        model, columns = _linear(prior, new_friction, motion, regressor, beyond, moves, links, load_friction)
        given = model.given + known
        weighted, wanted = columns.matrix / spread[:, None] * used[:, :, None], (measured - given) / spread * used
        problem = problem_of(weighted, wanted, columns.friction, FOLDS, gap)
        everything, bodies = list(range(FOLDS)), len(columns.links)
        weights = problem.best_weights(everything)
        change = problem.consistent_change(everything, weights, columns.prior - columns.least, bodies)
        new_friction = _with_friction(prior.friction, change[columns.laws :])
        inertial = _inertial(columns.links)
        beyond = regressor[:, :, inertial] @ change[: len(inertial)]
    found, left = columns.prior + change, wanted - weighted @ change
    new_arm = _with_bodies(prior, columns, found)
    whole = study if isinstance(study, Study) else None
    if whole is not None:
        joints = tuple(replace(task, friction=f) for task, f in zip(whole.joints, new_friction, strict=True))
        whole = replace(whole, arm=new_arm, joints=joints)
    distinct = base_parameters(weighted.reshape(-1, weighted.shape[2]))
    base, covariance, condition = _base_table(columns, distinct, weighted, wanted, used, change)
    held = problem.held(everything, weights)
    parameters = _parameter_table(columns, found, held, problem.scale, distinct, covariance, base)
    held_out = np.concatenate(problem.held_out(columns.prior - columns.least, bodies)) * spread
    kept = np.concatenate([fold.samples for fold in problem.folds])
    errors = _error_table(before[kept], held_out, measured[kept], used[kept], arm)
    modelled = given + columns.matrix @ change
    free = wanted - weighted @ (problem.deviation(everything, weights) / problem.scale)
    told, constants = int(np.isfinite(parameters["deviation"]).sum()), _torque_constants(recording, prior)
    notes = (
        *recording.notes,
        *_assumed(prior, recording, torque_constant),
        *_words_of_constants(recording, prior, constants),
        f"weight of the prior {weights.bodies:g} for bodies and {weights.friction:g} for friction, by cross-validation",
        f"{len(columns.names)} parameters in {len(base)} combinations that the motion can distinguish, {told} of them "
        "single parameters",
        f"condition of their regressor {condition:.3g}",
        *warnings(Evidence(
            arm, time, measured, modelled, model.laws, used, moves, spread, left, free,
            weighted[:, :, distinct.leading], condition, errors,
        )),
    )  # fmt: skip
    return Identification(
        new_arm, new_friction, whole, parameters, base, errors,
        _contributions(columns, found, measured, model, known, arm), condition, constants,
        time, measured, modelled, notes,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Prior:
    """Prior knowledge of an identification."""

    arm: Arm  # including the mounted drives
    own: Arm  # as given: its links are identified
    friction: tuple[Friction, ...]  # at each joint
    study: Study | None = None
    drives: tuple[Drive, ...] = ()  # of all joints, or empty
    rotors: tuple[int, ...] = ()  # joints whose rotor inertia is identified

    @property
    def travel(self) -> Array:
        """Travel of each prismatic joint per radian of its gear's output [m/rad]; 1 for revolute joints; (n,)."""
        tasks = self.study.joints if self.study is not None else ()
        return np.array([task.travel_per_turn or 1.0 for task in tasks] or [1.0] * self.arm.n)


class _Model(NamedTuple):
    """Torques that the prior predicts for a motion."""

    given: Array  # total torque at the joints [N m or N], (N, n)
    balance: Array  # the part of it due to counterbalances, (N, n)
    through: Array  # motor torque times ratio over load at the gear's output [-], (N, n)
    laws: Array  # torque at the gears' outputs of unit viscous, Coulomb and load-dependent friction, (3, N, n)


@dataclass(frozen=True, eq=False)
class _Columns:
    """Regressor of the identified parameters: ten per link, then rotors and friction, which must not be negative."""

    matrix: Array
    prior: Array
    names: list[str]
    links: tuple[int, ...]
    laws: int  # index of the first friction coefficient
    # From which what must be possible is counted: a link without its contained drive, the weaker direction of friction.
    least: Array  # (p,)

    @property
    def friction(self) -> np.ndarray:
        return np.arange(len(self.prior)) >= self.laws


def _prior(study: Study | Arm, friction: Sequence[Friction] | None) -> _Prior:
    if isinstance(study, Arm):
        rotors = tuple(i for i, rotor in enumerate(study.rotors) if rotor is not None)
        prior = _Prior(study, study, (FRICTIONLESS,) * study.n, rotors=rotors)
    else:
        if study.arm is None:
            raise InputError(Fault("study", "has no arm to identify", study.name))
        refuse_moving_base(study, "identification")
        prior = _Prior(study.arm, study.arm, tuple(task.friction for task in study.joints), study)
        if study.gives_all_drives:
            keys, filled_parts = study.given_drives, FilledParts(study)
            drives = {task.name: filled_parts.drive(task, *keys[task.name]) for task in study.joints}
            prior = replace(prior, arm=loaded_arm(study, drives, -1), drives=tuple(drives.values()))
    if friction is None:
        return prior
    if isinstance(friction, Friction) or not all(isinstance(one, Friction) for one in friction):
        raise InputError(Fault("friction", "must be a list of Friction, one a joint", repr(friction)[:60]))
    if len(friction) != prior.arm.n:
        raise InputError(Fault("friction", f"must be one a joint: {prior.arm.n}", len(friction)))
    return replace(prior, friction=tuple(friction))


def _motion(recording: MeasuredMotion, arm: Arm) -> tuple[list[Array], Array]:
    """Positions, speeds and accelerations, (N, n) each, and the standard deviation of the speeds, (N, n)."""
    if recording.joint_names != arm.joint_names:
        problem = f"must be of the joints {', '.join(arm.joint_names)}"
        raise InputError(Fault("recording", problem, ", ".join(recording.joint_names)))
    if recording.velocity is not None and recording.acceleration is not None:
        noise = np.array([estimated_noise(recording.time, speed) for speed in recording.velocity.T])
        motion = [recording.position, recording.velocity, recording.acceleration]
        return motion, np.broadcast_to(noise, recording.velocity.shape)
    motion, covariance, _ = rates_from_positions(recording.time, recording.position, [None] * arm.n)
    return motion, np.sqrt(covariance[:, 1, 1])


def _moving(prior: _Prior, speed: Array, noise: Array) -> tuple[Mask, Mask]:
    """Which samples of joint torque are used, (N, n), and which shafts move, (n,).

    Torques of a joint are not used where a shaft that drives it moves too slowly for its friction to be known; a shaft
    that never moves has no known friction.
    """
    turns = shaft_turns(prior.arm)
    speed, noise = np.abs(shaft_motion(prior.arm, speed)), np.sqrt(noise**2 @ turns.T**2)
    moving = speed > RESTS * np.maximum(SLOW * speed.max(axis=0), noise)
    moves = moving.mean(axis=0) >= MOVES
    return ~((~moving & moves) @ (turns != 0.0)), moves


def _joint_torque(recording: MeasuredMotion, prior: _Prior, torque_constant: Any) -> Array:
    """Measured torque, converted to the joints [N m or N], (N, n)."""
    if recording.torque is not None:
        return recording.torque
    turns = rotor_turns(prior.arm)
    if recording.motor_torque is not None:
        return np.asarray(recording.motor_torque @ turns)
    if recording.current is None:
        joint = recording.joint_names[0]
        hint = f"columns such as torque_{joint} [N m], motor_torque_{joint} [N m] or current_{joint} [A_rms]"
        raise InputError(Fault("recording", "has neither torque nor motor_torque nor current of all joints", hint=hint))
    if torque_constant is not None:
        constants = checked_array(np.broadcast_to(torque_constant, (prior.arm.n,)), (prior.arm.n,), "torque_constant")
    elif prior.drives:
        constants = _stated_constants(recording, prior)
    else:
        raise InputError(Fault("torque_constant", "is needed: only currents were measured [N m/A]"))
    return np.asarray((recording.current * constants) @ turns)


def _stated_constants(recording: MeasuredMotion, prior: _Prior) -> Array:
    """Torque constants of the given motors per ampere of the recording [N m/A], (n,)."""
    motors, basis = [drive.motor for drive in prior.drives], recording.current_basis or "dc"
    return np.array([to_dc(m.torque_constant, motor_basis(m.kind, basis)) for m in motors])


def _words_of_constants(recording: MeasuredMotion, prior: _Prior, fitted: Array | None) -> list[str]:
    """A note on fitted torque constants, with those of the given motors."""
    if fitted is None:
        return []
    stated = _stated_constants(recording, prior) if prior.drives else np.full(len(fitted), np.nan)
    each = [
        f"{name} {value:.4g}" + (f" (given {given:.4g})" if np.isfinite(given) else "")
        for name, value, given in zip(recording.joint_names, fitted, stated, strict=True)
        if np.isfinite(value)
    ]
    return [f"torque constants from torque and current, per A of the recording: {', '.join(each)} N m/A"]


def _assumed(prior: _Prior, recording: MeasuredMotion, torque_constant: Any) -> list[str]:
    """Notes on what a recording does not state and was assumed."""
    notes, study = [], prior.study
    if study is not None and any(payload.mass for payload in study.payloads):
        notes.append("the recording counts as one without the study's payloads")
    measured = recording.torque is not None or recording.motor_torque is not None
    brushless = any(drive.motor.kind != "brushed" for drive in prior.drives)
    if not measured and torque_constant is None and recording.current_basis is None and brushless:
        notes.append(
            "warning: the currents do not say what amperes they are, and count as those of the equivalent DC machine; "
            f"for values of a phase write current_{recording.joint_names[0]} [A_rms] or [A_peak]"
        )
    return notes


def _model(prior: _Prior, motion: list[Array], beyond: Array | float = 0.0) -> _Model:
    """Torques predicted by the prior, with losses by the direction of power; the transition near rest is smooth.

    The direction of power, and the load on which friction depends, are those of an arm whose links need torques at the
    joints ``beyond`` those of the prior [N m or N], (N, n).
    """
    arm, travel, study = prior.arm, prior.travel, prior.study
    balance = np.zeros(motion[0].shape)
    for i, task in enumerate(study.joints if study is not None else ()):
        balance[:, i] = -counterbalance_torque(task.counterbalances, motion[0][:, i])
    loads, speed = joint_loads(arm, *motion), shaft_motion(arm, motion[1]) / travel
    load = (loads.gear + shaft_torques(arm, balance)) * travel
    near = (loads.gear + shaft_torques(arm, balance + beyond)) * travel
    way = np.tanh(speed / np.maximum(SLOW * np.abs(speed).max(axis=0), 1e-12))
    sliding, coulomb, through, share, drag = (np.zeros_like(speed) for _ in range(5))
    for i, law in enumerate(prior.friction):
        curve = friction_curve(law)
        unit = curve._replace(
            forward=1.0, backward=1.0, viscous_forward=0.0, viscous_backward=0.0, static_forward=0.0,
            static_backward=0.0,
        )  # fmt: skip
        sliding[:, i], coulomb[:, i] = (_smooth(one, speed[:, i], way[:, i]) for one in (curve, unit))
        gear = replace(prior.drives[i].gear if prior.drives else NO_GEAR, load_friction=law.load_share)
        mesh = mesh_of(as_record(complete(gear)))
        power = way[:, i] * direction(near[:, i] + sliding[:, i])
        through[:, i] = 0.5 * (mesh.driving + mesh.driven + (mesh.driving - mesh.driven) * power)
        share[:, i] = 1.0 + law.load_share * power  # the factor of ``through`` that grows with the share
        if study is not None and prior.drives:
            turning, temperature = mesh.ratio * speed[:, i], float(study.drag_temperature(study.ambient))
            running = drag_torque(mesh, np.abs(turning), temperature) * way[:, i] * np.sign(mesh.ratio)
            own = _smooth(friction_curve(shaft_friction(prior.drives[i])), turning, way[:, i])
            drag[:, i] = mesh.ratio * (running + own)
    lost = through * (load + sliding) - load + drag
    given = loads.torque + balance + (lost / travel) @ shaft_turns(arm)
    laws = np.stack([speed, coulomb, way * np.abs(near + sliding) / share])
    return _Model(given, balance, through, laws)


def _linear(
    prior: _Prior, friction: Sequence[Friction], motion: list[Array], regressor: Array, beyond: Array, moves: Mask,
    links: Sequence[str] | None, load_friction: bool,
) -> tuple[_Model, _Columns]:  # fmt: skip
    """The model at the prior and its columns, linear in the parameters around ``friction`` and links that need torques
    ``beyond`` those of the prior.

    Losses of gears and load-dependent friction also act on the torque of the other friction.
    """
    near = replace(prior, friction=tuple(friction))
    model = _model(near, motion, beyond)
    model = model._replace(laws=model.laws * moves)
    columns = _columns(near, regressor, model, links, load_friction)
    known = np.r_[columns.prior[: columns.laws], _coefficients(prior.friction, list(LAWS)[: 2 + load_friction])]
    return model._replace(given=model.given - columns.matrix @ (columns.prior - known)), replace(columns, prior=known)


def _coefficients(friction: Sequence[Friction], laws: Iterable[str]) -> Array:
    """Coefficients of all joints, law by law; NaN where a law has none."""
    return np.array([getattr(law, name, None) for name in laws for law in friction], dtype=np.float64)


def _smooth(curve: FrictionCurve, speed: Array, way: Array) -> Array:
    """Friction torque for speeds with noise: without breakaway; around rest its dry part changes sign with ``way``."""
    viscous = np.where(speed > 0.0, curve.viscous_forward, curve.viscous_backward) * speed
    return np.asarray(viscous + np.abs(way) * (friction_at(curve, speed) - viscous))


def _inertial(links: Iterable[int]) -> np.ndarray:
    """The columns of links in the arm's regressor."""
    return np.array([10 * link + k for link in links for k in range(10)], int)


def _columns(
    prior: _Prior, regressor: Array, model: _Model, links: Sequence[str] | None, load_friction: bool
) -> _Columns:
    arm, n, turns = prior.arm, prior.arm.n, shaft_turns(prior.arm)
    unknown = [name for name in links or () if name not in arm.link_names]
    if unknown:
        raise InputError(
            [Fault("links", "is no link of the arm", name, nearest(name, arm.link_names)) for name in unknown]
        )
    sought = tuple(i for i in range(n) if links is None or arm.link_names[i] in links)
    mounted = [i for i, rotor in enumerate(arm.rotors) if rotor is not None]
    inertial = _inertial(sought)
    spinning = np.array([10 * (n + mounted.index(i)) + 9 for i in prior.rotors if links is None], int)
    every = parameter_names(arm)
    # From joint torques without to those with losses of the gears, (N, n, n).
    with_losses = turns.T @ (model.through[:, :, None] * np.linalg.inv(turns).T)
    laws = dict(list(LAWS.items())[: 2 + load_friction])
    extra = [np.einsum("ti,ij->tji", model.through * law / prior.travel, turns) for law in model.laws[: len(laws)]]
    bodies = torque_parameters(prior.own)[inertial], torque_parameters(arm)[spinning]
    known = np.concatenate([*bodies, _coefficients(prior.friction, laws)])
    names = [every[i] for i in (*inertial, *spinning)]
    shafts = ~arm.slides | (prior.travel != 1.0)
    for name, unit in laws.items():
        for joint, turning in zip(arm.joint_names, shafts, strict=True):
            names.append(f"{joint}.{name} [{unit if turning else unit.replace('N m', 'N').replace('rad', 'm')}]")
    parts = [with_losses @ regressor[:, :, inertial], regressor[:, :, spinning], *extra]
    least = np.zeros(len(known))
    least[: len(inertial)] = _contained(prior)[inertial]
    both = (_coefficients(prior.friction, laws), _coefficients(prior.friction, [f"{name}_negative" for name in laws]))
    least[len(least) - len(both[0]) :] = both[0] - np.fmin(*both)  # no direction may get less than none
    return _Columns(np.concatenate(parts, axis=2), known, names, sought, len(inertial) + len(spinning), least)


def _contained(prior: _Prior) -> Array:
    """Parameters of the drives that the links contain and that the study replaces, (10 n,).

    Without them the links, too, must be physically consistent.
    """
    bare = with_rotors(prior.own, [None] * prior.own.n)
    if prior.study is None or prior.study.drive_mass is not DriveMass.REPLACED:
        return np.zeros(10 * bare.n)
    return torque_parameters(bare) - torque_parameters(emptied(prior.study))


def _with_bodies(prior: _Prior, columns: _Columns, found: Array) -> Arm:
    """The arm with the identified links and rotors."""
    arm = prior.own
    home, masses, inertias = arm.home.copy(), arm.masses.copy(), arm.inertias.copy()
    for place, i in enumerate(columns.links):
        mass, first, tensor = found[10 * place], found[10 * place + 1 : 10 * place + 4], np.zeros((3, 3))
        tensor[ROW, COLUMN] = tensor[COLUMN, ROW] = found[10 * place + 4 : 10 * place + 10]
        centre = first / mass if mass > 0.0 else np.zeros(3)
        central = tensor - mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        turn = home[i, :3, :3]
        home[i, :3, 3] = arm.joint_points[i] + centre
        masses[i], inertias[i] = mass, turn.T @ central @ turn
    rotors = list(arm.rotors)
    for place, i in enumerate(prior.rotors if columns.laws > 10 * len(columns.links) else ()):
        rotor = rotors[i]
        assert isinstance(rotor, MountedRotor)
        axis = rotor.home[:3, :3].T @ rotor.screw[:3]
        more = found[10 * len(columns.links) + place] - rotor.axial_inertia
        rotors[i] = replace(rotor, inertia=rotor.inertia + more * np.outer(axis, axis))
    home, masses, inertias = map(read_only, (home, masses, inertias))
    return replace(arm, home=home, masses=masses, inertias=inertias, rotors=tuple(rotors))


def _with_friction(friction: Sequence[Friction], change: Array) -> tuple[Friction, ...]:
    """The friction laws with the identified changes, equal in both directions."""
    result = []
    for law, more in zip(friction, change.reshape(-1, len(friction)).T, strict=True):
        new: dict[str, Any] = {}
        for name, value in zip(LAWS, more, strict=False):
            for key in (name, f"{name}_negative"):
                if getattr(law, key, None) is not None:
                    new[key] = max(getattr(law, key) + value, 0.0)
        if "load_share" in new:
            new["load_share"] = min(new["load_share"], MOST_LOAD)
        if law.static is not None:
            new["static"] = max(law.static, new["coulomb"], new.get("coulomb_negative", 0.0))
        result.append(replace(law, **new))
    return tuple(result)


def _base_table(
    columns: _Columns, base: BaseParameters, weighted: Array, wanted: Array, used: Mask, change: Array
) -> tuple[pd.DataFrame, Array, float]:
    """Table of the base parameters, whose deviation counts how far prior and physical limits have drawn them.

    Also returns their covariance by plain least squares, (r, r), and the condition number of their regressor.
    """
    import pandas as pd

    regressor = weighted[:, :, base.leading]
    size = np.sqrt(np.sum(regressor**2, axis=(0, 1)))
    scaled = regressor / size
    plain, _, _, values = np.linalg.lstsq(scaled.reshape(wanted.size, -1), wanted.ravel())
    covariance = correlated_covariance(scaled, wanted - scaled @ plain, used) / np.outer(size, size)
    drawn = base.combined @ change - plain / size
    words = [
        " + ".join(f"{factor:.3g} {columns.names[j].split(' [')[0]}" for j, factor in enumerate(row) if factor)
        for row in base.combined
    ]
    table = pd.DataFrame(
        {
            "value": base.combined @ (columns.prior + change),
            "deviation": np.hypot(np.sqrt(np.diag(covariance)), drawn),
            "combination": [text.replace("+ -", "- ") for text in words],
        },
        index=[columns.names[i] for i in base.leading],
    )
    return table, covariance, float(values[0] / values[-1])


def _parameter_table(
    columns: _Columns, found: Array, held: Array, scale: Array, distinct: BaseParameters, covariance: Array,
    base: pd.DataFrame,
) -> pd.DataFrame:  # fmt: skip
    """Table of all parameters: prior and identified values, standard deviation, and the prior's share of it.

    ``held`` is what the prior adds to the diagonal of the normal equations of the parameters times ``scale``, (p,).
    """
    import pandas as pd

    size = np.sqrt(np.diag(covariance))
    scaled = distinct.combined / scale / size[:, None]
    information = scaled.T @ np.linalg.solve(covariance / np.outer(size, size), scaled)
    share = np.sqrt(np.diag(np.linalg.inv(information + np.diag(held))) * held)
    values = {"prior": columns.prior, "identified": found, "deviation": np.inf, "share": share}
    table = pd.DataFrame(values, index=columns.names)
    alone = np.count_nonzero(distinct.combined, axis=1) == 1
    table.loc[base.index[alone], "deviation"] = base["deviation"][alone]
    return table


def _error_table(given: Array, held_out: Array, torque: Array, used: Mask, arm: Arm) -> pd.DataFrame:
    """Table of the errors at the samples of all folds, (M, n) each.

    ``given``: what the given model does not explain; ``held_out``: what the identified one does not.
    """
    import pandas as pd

    correlation = np.full(arm.n, np.nan)
    for i in range(arm.n):
        both = torque[used[:, i], i], (torque - held_out)[used[:, i], i]
        if all(np.ptp(one) > 0.0 for one in both):
            correlation[i] = np.corrcoef(*both)[0, 1]
    rms = {"measured": torque, "given": given, "identified": held_out}
    columns = {name: _rms(values * used, used) for name, values in rms.items()}
    return pd.DataFrame({**columns, "correlation": correlation}, index=arm.joint_names)


def _rms(values: Array, used: Mask) -> Array:
    """RMS of each joint's values, which are zero where they are not used, (N, n) to (n,)."""
    return np.asarray(np.sqrt(np.sum(values**2, axis=0) / np.maximum(used.sum(axis=0), 1)))


def _contributions(
    columns: _Columns, found: Array, measured: Array, model: _Model, known: Array, arm: Arm
) -> pd.DataFrame:
    import pandas as pd

    links = 10 * len(columns.links)
    parts = {"links": slice(0, links), "rotors": slice(links, columns.laws)}
    for k, name in enumerate(list(LAWS)[: (len(found) - columns.laws) // arm.n]):
        parts[name] = slice(columns.laws + k * arm.n, columns.laws + (k + 1) * arm.n)
    torque = {name: columns.matrix[:, :, part] @ found[part] for name, part in parts.items()}
    torque["counterbalances"] = model.balance
    torque["drives"] = model.given - model.balance - columns.matrix @ columns.prior
    torque["unexplained"] = measured - known - model.given - columns.matrix @ (found - columns.prior)
    rms = {name: np.sqrt(np.mean(values**2, axis=0)) for name, values in torque.items()}
    return pd.DataFrame(rms, index=arm.joint_names)


def _torque_constants(recording: MeasuredMotion, prior: _Prior) -> Array | None:
    """Torque constants fitted to measured torque and current [N m/A], (n,); None unless both were measured."""
    if recording.current is None or (recording.torque is None and recording.motor_torque is None):
        return None
    torque = np.linalg.solve(rotor_turns(prior.arm).T, _joint_torque(recording, prior, None).T).T
    square = np.sum(recording.current**2, axis=0)
    return np.asarray(np.sum(torque * recording.current, axis=0) / np.where(square > 0.0, square, np.nan))
