"""The functions of section 8.11 of Modern Robotics, under the book's own names and with its arguments.

A reader of the book changes ``import modern_robotics as mr`` to ``import drivetrain.modern_robotics as mr``. All of it
is this package's dynamics in the book's clothes; an arm is built once for each content of ``Mlist``, ``Glist`` and
``Slist`` and remembered. For rotors, URDF files and the rest, use the ``Arm``; ``drivetrain.arm.lists`` turns
one into such lists.

The other chapters' functions (``FKinSpace``, ``CubicTimeScaling``, ...) are those of the package ``modern_robotics``
where it is installed, so that a reader's whole program runs with the one line changed.

Conventions, the book's: ``Mlist`` holds n + 1 poses, of link frame i in link frame i-1 at zero, the first in the base
frame and the last of the end effector in link n [m]; ``Glist`` n spatial inertias in the link frames [kg m^2, kg m,
kg], whose origins need not be the centres of mass; ``Slist`` n screw axes in the base frame, as columns, (6, n).
Twists are (angular, linear), wrenches (moment, force). A screw axis that is not unit, as the first in the examples of
the book's own package, moves its joint that much farther for the same ``theta``, there as here.

One posture may be a list, a vector or a column, as that package takes it in places; what comes back is a vector.

Where this differs from the package ``modern_robotics`` 1.1: rotations below 1e-6 rad are made, not dropped; a mass
matrix is never inverted; a zero for ``Ftipmat`` is taken as no tip forces, as that package promises and does not do;
shapes, rotations and inertias are checked, and what is wrong raises ``InputError``.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from drivetrain.arm.lists import BookArm, arm_from_lists
from drivetrain.arrays import Array, axes_of, checked_array, checked_number
from drivetrain.dynamics.forward import articulated_body
from drivetrain.dynamics.from_positions import torque_from_positions
from drivetrain.dynamics.inverse import gravity_torque, inverse_dynamics, tip_torque, velocity_torque
from drivetrain.dynamics.mass import mass_matrix
from drivetrain.errors import Fault, InputError
from drivetrain.spatial.wrenches import bracket

MOST_TURNS = 1e6  # steps of integration a row


def ad(V: Any) -> Array:
    """The matrix of the Lie bracket with a twist.

    Args:
        V: Twist (angular [rad/s], linear [m/s]), (6,).

    Returns:
        [ad_V], (6, 6).

    Reference: Modern Robotics, equation 8.38.
    """
    return bracket(_vector(V))


def InverseDynamics(
    thetalist: Any, dthetalist: Any, ddthetalist: Any, g: Any, Ftip: Any, Mlist: Any, Glist: Any, Slist: Any
) -> Array:
    """The joint torques of a motion.

    Args:
        thetalist, dthetalist, ddthetalist: Positions, speeds, accelerations [rad or m, and per s, s^2], (n,).
        g: Acceleration of free fall in the base frame [m/s^2], (3,).
        Ftip: What the end effector applies to the environment, in its frame [N m, N], (6,).
        Mlist: Poses of the link frames, each in the one before [m], (n + 1, 4, 4).
        Glist: Spatial inertias in the link frames [kg m^2, kg m, kg], (n, 6, 6).
        Slist: Screw axes in the base frame, as columns, (6, n).

    Returns:
        Torques [N m; N at a prismatic joint], (n,).

    Raises:
        InputError: Wrong shapes, a NaN or infinity, or data that are no arm.

    Reference: Modern Robotics, sections 8.3.2 and 8.11.
    """
    chain = _chain(Mlist, Glist, Slist, g)
    motion = _posture(chain, {"thetalist": thetalist, "dthetalist": dthetalist, "ddthetalist": ddthetalist})
    return inverse_dynamics(chain.arm, *motion, tip_wrench=_tip(_vector(Ftip))) * chain.scale


def MassMatrix(thetalist: Any, Mlist: Any, Glist: Any, Slist: Any) -> Array:
    """The mass matrix.

    Args:
        thetalist: Positions [rad or m], (n,).
        Mlist: Poses of the link frames, each in the one before [m], (n + 1, 4, 4).
        Glist: Spatial inertias in the link frames [kg m^2, kg m, kg], (n, 6, 6).
        Slist: Screw axes in the base frame, as columns, (6, n).

    Returns:
        M [kg m^2; kg m and kg where joints are prismatic], (n, n).

    Raises:
        InputError: As ``InverseDynamics``.

    Reference: Modern Robotics, sections 8.5 and 8.11.
    """
    chain = _chain(Mlist, Glist, Slist, np.zeros(3))
    (q,) = _posture(chain, {"thetalist": thetalist})
    return mass_matrix(chain.arm, q) * np.outer(chain.scale, chain.scale)


def VelQuadraticForces(thetalist: Any, dthetalist: Any, Mlist: Any, Glist: Any, Slist: Any) -> Array:
    """The Coriolis and centripetal torques c.

    Args:
        thetalist, dthetalist: Positions and speeds [rad or m, and per s], (n,).
        Mlist: Poses of the link frames, each in the one before [m], (n + 1, 4, 4).
        Glist: Spatial inertias in the link frames [kg m^2, kg m, kg], (n, 6, 6).
        Slist: Screw axes in the base frame, as columns, (6, n).

    Returns:
        c [N m; N at a prismatic joint], (n,).

    Raises:
        InputError: As ``InverseDynamics``.

    Reference: Modern Robotics, sections 8.4 and 8.11.
    """
    chain = _chain(Mlist, Glist, Slist, np.zeros(3))
    q, qd = _posture(chain, {"thetalist": thetalist, "dthetalist": dthetalist})
    return velocity_torque(chain.arm, q, qd) * chain.scale


def GravityForces(thetalist: Any, g: Any, Mlist: Any, Glist: Any, Slist: Any) -> Array:
    """The torques that hold the arm still.

    Args:
        thetalist: Positions [rad or m], (n,).
        g: Acceleration of free fall in the base frame [m/s^2], (3,).
        Mlist: Poses of the link frames, each in the one before [m], (n + 1, 4, 4).
        Glist: Spatial inertias in the link frames [kg m^2, kg m, kg], (n, 6, 6).
        Slist: Screw axes in the base frame, as columns, (6, n).

    Returns:
        g [N m; N at a prismatic joint], (n,).

    Raises:
        InputError: As ``InverseDynamics``.

    Reference: Modern Robotics, sections 8.4 and 8.11.
    """
    chain = _chain(Mlist, Glist, Slist, g)
    (q,) = _posture(chain, {"thetalist": thetalist})
    return gravity_torque(chain.arm, q) * chain.scale


def EndEffectorForces(thetalist: Any, Ftip: Any, Mlist: Any, Glist: Any, Slist: Any) -> Array:
    """The torques that press the end effector on the environment: ``J^T Ftip``.

    Args:
        thetalist: Positions [rad or m], (n,).
        Ftip: What the end effector applies to the environment, in its frame [N m, N], (6,).
        Mlist: Poses of the link frames, each in the one before [m], (n + 1, 4, 4).
        Glist: Spatial inertias in the link frames [kg m^2, kg m, kg], (n, 6, 6).
        Slist: Screw axes in the base frame, as columns, (6, n).

    Returns:
        Torques [N m; N at a prismatic joint], (n,).

    Raises:
        InputError: As ``InverseDynamics``.

    Reference: Modern Robotics, equation 8.77 and section 8.11.
    """
    chain = _chain(Mlist, Glist, Slist, np.zeros(3))
    (q,) = _posture(chain, {"thetalist": thetalist})
    return tip_torque(chain.arm, q, _vector(Ftip)) * chain.scale


def ForwardDynamics(
    thetalist: Any, dthetalist: Any, taulist: Any, g: Any, Ftip: Any, Mlist: Any, Glist: Any, Slist: Any
) -> Array:
    """The accelerations that joint torques give.

    Args:
        thetalist, dthetalist: Positions and speeds [rad or m, and per s], (n,).
        taulist: Torques [N m; N at a prismatic joint], (n,).
        g: Acceleration of free fall in the base frame [m/s^2], (3,).
        Ftip: What the end effector applies to the environment, in its frame [N m, N], (6,).
        Mlist: Poses of the link frames, each in the one before [m], (n + 1, 4, 4).
        Glist: Spatial inertias in the link frames [kg m^2, kg m, kg], (n, 6, 6).
        Slist: Screw axes in the base frame, as columns, (6, n).

    Returns:
        Accelerations [rad/s^2 or m/s^2], (n,).

    Raises:
        InputError: As ``InverseDynamics``; or a joint that moves no inertia.

    Reference: Modern Robotics, sections 8.5 and 8.11.
    """
    chain = _chain(Mlist, Glist, Slist, g)
    q, qd, tau = _posture(chain, {"thetalist": thetalist, "dthetalist": dthetalist, "taulist": taulist})
    return articulated_body(chain.arm, q, qd, tau / chain.scale**2, tip_wrench=_tip(_vector(Ftip))) / chain.scale


def EulerStep(thetalist: Any, dthetalist: Any, ddthetalist: Any, dt: float) -> tuple[Array, Array]:
    """Positions and speeds one step of Euler's first-order method later.

    Args:
        thetalist, dthetalist, ddthetalist: Positions, speeds, accelerations [rad or m, and per s, s^2], (n,).
        dt: The step [s].

    Returns:
        Positions [rad or m] and speeds [rad/s or m/s], as given; the positions by the old speeds.

    Raises:
        InputError: Three shapes that differ, or values that are no finite numbers.

    Reference: Modern Robotics, section 8.11.
    """
    given = {"thetalist": thetalist, "dthetalist": dthetalist, "ddthetalist": ddthetalist}
    positions, speeds, accelerations = _all_values(given)
    step = checked_number(dt, "dt", "s")
    if not positions.shape == speeds.shape == accelerations.shape:
        shapes = f"shapes {positions.shape}, {speeds.shape}, {accelerations.shape}"
        raise InputError(Fault("thetalist, dthetalist, ddthetalist", "must have one shape", shapes))
    return positions + step * speeds, speeds + step * accelerations


def InverseDynamicsTrajectory(
    thetamat: Any, dthetamat: Any, ddthetamat: Any, g: Any, Ftipmat: Any, Mlist: Any, Glist: Any, Slist: Any
) -> Array:
    """The joint torques of a motion, sample by sample.

    Args:
        thetamat, dthetamat, ddthetamat: Positions, speeds, accelerations [rad or m, and per s, s^2], (N, n).
        g: Acceleration of free fall in the base frame [m/s^2], (3,).
        Ftipmat: What the end effector applies to the environment, in its frame [N m, N], (N, 6). 0 or None: nothing.
        Mlist: Poses of the link frames, each in the one before [m], (n + 1, 4, 4).
        Glist: Spatial inertias in the link frames [kg m^2, kg m, kg], (n, 6, 6).
        Slist: Screw axes in the base frame, as columns, (6, n).

    Returns:
        Torques [N m; N at a prismatic joint], (N, n).

    Raises:
        InputError: As ``InverseDynamics``.

    Reference: Modern Robotics, section 8.11.
    """
    chain = _chain(Mlist, Glist, Slist, g)
    motion = _scaled(chain, {"thetamat": thetamat, "dthetamat": dthetamat, "ddthetamat": ddthetamat})
    return inverse_dynamics(chain.arm, *motion, tip_wrench=_tip(Ftipmat)) * chain.scale


def InverseDynamicsTrajectoryFromPositions(
    thetamat: Any, dt: float, g: Any, Ftipmat: Any, Mlist: Any, Glist: Any, Slist: Any, resolution: Any = None
) -> Array:
    """The joint torques of a motion given by its positions alone: the book's exercise 8.14.

    Differencing readings twice, as the exercise suggests, multiplies their noise by 2.4/dt^2: with a 12-bit encoder at
    1 kHz the torques come out tens of times too large. Here each joint is smoothed by as much as its resolution
    explains, see ``drivetrain.dynamics.from_positions``.

    Args:
        thetamat: Positions as read [rad or m], (N, n).
        dt: Time from sample to sample [s].
        g: Acceleration of free fall in the base frame [m/s^2], (3,).
        Ftipmat: What the end effector applies to the environment, in its frame [N m, N], (N, 6). 0 or None: nothing.
        Mlist: Poses of the link frames, each in the one before [m], (n + 1, 4, 4).
        Glist: Spatial inertias in the link frames [kg m^2, kg m, kg], (n, 6, 6).
        Slist: Screw axes in the base frame, as columns, (6, n).
        resolution: Step between neighbouring readings [rad or m], one for all or one each, (n,). None: from the
            samples; 0: exact.

    Returns:
        Torques [N m; N at a prismatic joint], (N, n).

    Raises:
        InputError: As ``InverseDynamics``; or fewer than three samples.

    Reference: Modern Robotics, exercise 8.14.
    """
    chain = _chain(Mlist, Glist, Slist, g)
    scale = chain.scale
    positions = checked_array(thetamat, (None, len(scale)), "thetamat") * scale
    step = resolution
    if step is not None:
        step = _values(step, "resolution") * scale if axes_of(step) == 0 else _scaled(chain, {"resolution": step})[0]
    time = checked_number(dt, "dt", "s", above=0.0) * np.arange(len(positions))
    return torque_from_positions(chain.arm, time, positions, resolution=step, tip_wrench=_tip(Ftipmat)).torque * scale


def ForwardDynamicsTrajectory(
    thetalist: Any, dthetalist: Any, taumat: Any, g: Any, Ftipmat: Any, Mlist: Any, Glist: Any, Slist: Any, dt: float,
    intRes: int,
) -> tuple[Array, Array]:  # fmt: skip
    """The motion that joint torques give, by Euler's first-order method as in the book.

    Its error falls only with the step: a UR5 let fall at 100 steps a second gains energy and is off by radians after
    three seconds. ``drivetrain.simulate_passive`` has better methods.

    Args:
        thetalist, dthetalist: Positions and speeds at the start [rad or m, and per s], (n,).
        taumat: Torques, each held for ``dt`` [N m; N at a prismatic joint], (N, n).
        g: Acceleration of free fall in the base frame [m/s^2], (3,).
        Ftipmat: What the end effector applies to the environment, in its frame [N m, N], (N, 6). 0 or None: nothing.
        Mlist: Poses of the link frames, each in the one before [m], (n + 1, 4, 4).
        Glist: Spatial inertias in the link frames [kg m^2, kg m, kg], (n, 6, 6).
        Slist: Screw axes in the base frame, as columns, (6, n).
        dt: Time from row to row [s].
        intRes: Steps of integration a row, at least 1 [-].

    Returns:
        Positions [rad or m] and speeds [rad/s or m/s], (N, n) each; the last row of ``taumat`` moves nothing.

    Raises:
        InputError: As ``InverseDynamics``; or a number of steps below 1, or absurd.

    Reference: Modern Robotics, section 8.11.
    """
    chain = _chain(Mlist, Glist, Slist, g)
    turns = checked_number(intRes, "intRes", "-")
    if turns != int(turns) or not 1.0 <= turns <= MOST_TURNS:
        raise InputError(Fault("intRes", f"must be a whole number of steps, 1 to {MOST_TURNS:g}", intRes))
    step = checked_number(dt, "dt", "s") / turns
    torques = checked_array(taumat, (None, chain.arm.n), "taumat") / chain.scale
    wrenches = _tip(Ftipmat)
    tips = [None] * len(torques) if wrenches is None else checked_array(wrenches, (len(torques), 6), "Ftipmat")
    start = _posture(chain, {"thetalist": thetalist, "dthetalist": dthetalist})
    q, qd = np.empty((2, *torques.shape))
    q[:1], qd[:1] = start
    for row in range(len(torques) - 1):
        now = (q[row], qd[row])
        for _ in range(int(turns)):
            now = EulerStep(*now, articulated_body(chain.arm, *now, torques[row], tip_wrench=tips[row]), step)
        q[row + 1], qd[row + 1] = now
    return q / chain.scale, qd / chain.scale


def __getattr__(name: str) -> Any:
    """The rest of the book's package, chapters other than 8, where it is installed."""
    from importlib import import_module

    try:
        return getattr(import_module("modern_robotics"), name)
    except (ImportError, AttributeError):
        hint = " (the book's package, modern_robotics, has the other chapters' where it is installed)"
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}{hint}") from None


def _values(value: Any, name: str) -> Array:
    """Finite numbers, of any shape."""
    return checked_array(value, (None,) * max(axes_of(value), 0), name)


def _all_values(named: dict[str, Any]) -> list[Array]:
    """Finite numbers, every fault of all of them told at once."""
    arrays: list[Array] = []
    faults: list[Fault] = []
    for name, value in named.items():
        try:
            arrays.append(_values(value, name))
        except InputError as error:
            faults.extend(error.faults)
    if faults:
        raise InputError(faults)
    return arrays


def _vector(value: Any) -> Any:
    """A column as the vector that is meant; everything else as it is."""
    return np.ravel(value) if axes_of(value) == 2 and np.shape(value)[1] == 1 else value


def _posture(chain: BookArm, named: dict[str, Any]) -> list[Array]:
    """As ``_scaled``, where one posture may be a column."""
    n = chain.arm.n
    return _scaled(chain, {k: _vector(v) if axes_of(v) == 2 and np.shape(v) == (n, 1) else v for k, v in named.items()})


def _scaled(chain: BookArm, named: dict[str, Any]) -> list[Array]:
    """Joint values for unit screws, (n,) or (N, n) each."""
    arrays = dict(zip(named, _all_values(named), strict=True))
    n = chain.arm.n
    faults = [
        Fault(name, f"must have shape ({n},) or (N, {n})", f"shape {array.shape}")
        for name, array in arrays.items()
        if array.ndim not in (1, 2) or array.shape[-1] != n
    ]
    if faults:
        raise InputError(faults)
    return [array * chain.scale for array in arrays.values()]


def _tip(wrench: Any) -> Any:
    """The wrench, or None for the zero that stands for none."""
    return (
        None
        if wrench is None or (axes_of(wrench) == 0 and isinstance(wrench, (int, float, np.number)) and wrench == 0)
        else wrench
    )


def _chain(poses: Any, inertias: Any, screws: Any, gravity: Any) -> BookArm:
    arrays = _all_values({"Mlist": poses, "Glist": inertias, "Slist": screws, "g": _vector(gravity)})
    return _remembered(*((array.tobytes(), array.shape) for array in arrays))


@lru_cache(maxsize=32)
def _remembered(*contents: tuple[bytes, tuple[int, ...]]) -> BookArm:
    """The arm of these Mlist, Glist, Slist and g."""
    return arm_from_lists(*(np.frombuffer(data).reshape(shape) for data, shape in contents))
