"""The tip of an arm in its surroundings: where it is and how it moves, and what they do to it."""

from __future__ import annotations

from typing import Any

from drivetrain.dynamics.compiled_vectors import Vector, cross, dot, get, part, put
from drivetrain.dynamics.mass_and_bias import COLUMNS, ORIGIN, SCREW, VELOCITY
from drivetrain.simulation.records import Run, inlined


@inlined
def show_tip(run: Run) -> None:
    """Fill place, speed and turning of the tip, along the axes of the base."""
    work, engine, tip, o = run.work, run.engine[0], run.world[0].tip, (run.engine[0].links - 1) * COLUMNS
    offset, place = get(engine.tip_offset, 0), tip.place
    for r in range(3):
        place[r] = work[o + ORIGIN + r] + dot(get(work, o + 3 * r), offset)
    turning = get(work, o + VELOCITY)
    around = cross(turning, get(place, 0))
    for r in range(3):
        tip.speed[r] = work[o + VELOCITY + 3 + r] + around[r]
    put(tip.turning, 0, turning)
    for r in range(3):
        engine.tip_place[r], engine.tip_speed[r], engine.tip_turning[r] = place[r], tip.speed[r], turning[r]


@part
def softness(tip: Any, step: float, k: int) -> float:
    """Entry k (xx, xy, xz, yy, yz, zz) of damping and stiffness together [N s/m]."""
    return tip.damping[k] + step * tip.stiffness[k]


@inlined
def _resisting(tip: Any, step: float, a: Vector) -> Vector:
    """Damping and stiffness together, times a speed [N]."""
    xx, xy, xz = softness(tip, step, 0), softness(tip, step, 1), softness(tip, step, 2)
    yy, yz, zz = softness(tip, step, 3), softness(tip, step, 4), softness(tip, step, 5)
    return (
        xx * a[0] + xy * a[1] + xz * a[2],
        xy * a[0] + yy * a[1] + yz * a[2],
        xz * a[0] + yz * a[1] + zz * a[2],
    )


@part
def _screw(run: Run, k: int) -> tuple[Vector, Vector]:
    """Turning of the tip, and speed at the base's origin, for a unit speed of a coordinate."""
    work = run.work
    if not run.engine[0].coupled:
        return get(work, k * COLUMNS + SCREW), get(work, k * COLUMNS + SCREW + 3)
    a = b = c = x = y = z = 0.0
    for j in range(run.engine[0].links):
        turns, screw = run.turns[j, k], j * COLUMNS + SCREW
        a += turns * work[screw]
        b += turns * work[screw + 1]
        c += turns * work[screw + 2]
        x += turns * work[screw + 3]
        y += turns * work[screw + 4]
        z += turns * work[screw + 5]
    return (a, b, c), (x, y, z)


@inlined
def _column(run: Run, k: int) -> Vector:
    """Speed of the tip for a unit speed of a coordinate."""
    turning, linear = _screw(run, k)
    around = cross(turning, get(run.engine[0].tip_place, 0))
    return linear[0] + around[0], linear[1] + around[1], linear[2] + around[2]


@part
def try_tip(run: Run, shift: float) -> None:
    """Move the tip from the guess to the trial, and note what force a solution expects.

    Args:
        shift: Time from the beginning of the step to its middle [s].
    """
    engine, tip = run.engine[0], run.world[0].tip
    before, speed, turning = get(tip.speed, 0), get(engine.tip_speed, 0), get(engine.tip_turning, 0)
    for k in range(engine.links):
        more = run.coordinates[k].trial - run.guess[k]
        column, (around, _) = _column(run, k), _screw(run, k)
        speed = (speed[0] + more * column[0], speed[1] + more * column[1], speed[2] + more * column[2])
        turning = (turning[0] + more * around[0], turning[1] + more * around[1], turning[2] + more * around[2])
    put(tip.speed, 0, speed)
    put(tip.turning, 0, turning)
    less = _resisting(tip, shift, (speed[0] - before[0], speed[1] - before[1], speed[2] - before[2]))
    for r in range(3):
        tip.place[r] = engine.tip_place[r] + shift * (speed[r] - engine.tip_speed[r])
        engine.tip_expected[r] = tip.force[r] - less[r]
    for k in range(6):
        engine.tip_damping[k], engine.tip_stiffness[k] = tip.damping[k], tip.stiffness[k]


@inlined
def calm_tip(run: Run) -> None:
    """Take the mean of how forces fall now and of how they did when last asked: it ends going round in circles."""
    engine, tip = run.engine[0], run.world[0].tip
    for k in range(6):
        tip.damping[k] = 0.5 * (tip.damping[k] + engine.tip_damping[k])
        tip.stiffness[k] = 0.5 * (tip.stiffness[k] + engine.tip_stiffness[k])


@inlined
def tip_agrees(run: Run, shift: float) -> bool:
    """Whether the surroundings answer what the solution expects of them.

    Args:
        shift: Time from the beginning of the step to its middle [s].
    """
    tip, expected, off, size = run.world[0].tip, run.engine[0].tip_expected, 0.0, 0.0
    for r in range(3):
        off = max(off, abs(tip.force[r] - expected[r]))
        size = max(size, abs(tip.force[r]), abs(expected[r]))
    stiff = max(0.0, softness(tip, shift, 0), softness(tip, shift, 3), softness(tip, shift, 5))
    far = max(abs(tip.place[0]), abs(tip.place[1]), abs(tip.place[2])) + 1.0
    fast = max(abs(tip.speed[0]), abs(tip.speed[1]), abs(tip.speed[2]))
    return off <= 1e-12 * size + 2e-15 * stiff * (fast + far / shift)


@inlined
def clear_tip(tip: Any) -> None:
    """Nothing acts on the tip yet."""
    for k in range(3):
        tip.force[k] = tip.moment[k] = 0.0
    for k in range(6):
        tip.damping[k] = tip.stiffness[k] = 0.0


@part
def add_tip(run: Run, h: float, theta: float, trial: bool) -> None:
    """What the surroundings do to the tip joins the linear system, and what meshes transmit.

    Args:
        h: Step [s].
        trial: Whether they were asked at the trial, not at the guess.
    """
    coordinates, drives = run.coordinates, run.drives
    tip, joints = run.world[0].tip, run.engine[0].links
    step, moment, force = theta * h, get(tip.moment, 0), get(tip.force, 0)
    for k in range(joints):
        one = coordinates[k]
        soft = _resisting(tip, step, _column(run, k))
        late = (one.trial if trial else run.guess[k]) - one.speed
        force = (force[0] + soft[0] * late, force[1] + soft[1] * late, force[2] + soft[2] * late)
        for i in range(joints):
            entry = dot(_column(run, i), soft)
            run.system.matrix[i, k] += step * entry
            if drives[i].motor == i:
                run.system.transmitted[i, k] += theta * entry
    for i in range(joints):
        torque = dot(_column(run, i), force) + dot(_screw(run, i)[0], moment)
        coordinates[i].right += h * torque
        if drives[i].motor == i:
            coordinates[i].transmitted -= torque
