"""Comparison of the motor currents of sizing (inverse) and of simulation (forward), with the same effects in both."""

from __future__ import annotations

import math

import numpy as np

from drivetrain.accuracy.decision import basis_of, mean_weights, moving, rms
from drivetrain.accuracy.scenes import choices, full_scene, without
from drivetrain.arrays import Array
from drivetrain.simulation.cost_results import CurrentsCompared, JointCurrents
from drivetrain.simulation.engines.engine import Engine
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Scene
from drivetrain.sizing.results import Evaluation

UNKNOWN_TO_SIZING = ("FlexibleJoint", "CurrentLoop", "Backlash", "Cogging")
SMALL = 0.01  # difference over the RMS current below which no explanation is given


def inverse_against_forward(
    evaluation: Evaluation, *, scene: Scene | None = None, engine: Engine | None = None
) -> CurrentsCompared:
    """Compare the currents of an evaluation with a forward simulation, joint by joint.

    Effects of the scene that are unknown to sizing are left out. By default the scene is built here, and simulated with
    fixed steps of 0.5 ms.
    """
    full = full_scene(evaluation) if scene is None else scene
    engine = FixedStep(5e-4) if engine is None else engine
    same = without(full, [one for one in choices(full) if one.kind in UNKNOWN_TO_SIZING])
    recording = simulate(same, solver=engine, interval=1e-3, checked=False)
    when = recording.time, mean_weights(recording.time, basis_of(full, evaluation).use(recording.time))
    joints = {
        name: _compared(evaluation, name, when, recording[f"{name}.current"], moving(recording, name))
        for name in full.joints
    }
    return CurrentsCompared(joints, recording)


def _compared(
    evaluation: Evaluation, name: str, when: tuple[Array, Array], forward: Array, moves: Array
) -> JointCurrents:
    """The comparison for one joint; ``when`` are the recorded times and their integration weights [s]."""
    series, (time, weights) = evaluation.joints[name].series, when
    # At a jump sizing has a sample on both sides; between samples its current is linear.
    own = np.interp(time, series.time + 1e-12 * np.arange(len(series.time)), series.current)
    difference = forward - own
    whole = rms(own, weights)
    apart = [rms(difference[mask], weights[mask]) / whole if mask.any() and whole else math.nan
             for mask in (moves, np.logical_not(moves))]  # fmt: skip
    return JointCurrents(
        time, own, forward, moves,
        (float(np.abs(series.current).max()), float(np.abs(forward).max())),
        (whole, rms(forward, weights)), apart[0], apart[1], _note(apart[0], apart[1], evaluation, name),
    )  # fmt: skip


def _note(moves: float, rests: float, evaluation: Evaluation, name: str) -> str:
    """The cause of the difference, in words; empty if it is small."""
    said = []
    if not math.isnan(rests) and rests > SMALL:
        said.append(
            "at rest the friction torque depends on how the joint came to rest, anywhere between its two bounds; "
            "sizing takes the smallest current that still holds"
        )
    if not math.isnan(moves) and moves > SMALL:
        said.append("in motion the controller also corrects its tracking error, and starting and stopping take time")
    drive = evaluation.joints[name].drive
    if not said and (drive.gear.mesh_efficiency or drive.gear.efficiency or 1.0) == 1.0:
        said.append("no mesh loss: at rest only the motor holds the load")
    return "; ".join(said)
