"""The functions of section 8.11 of Modern Robotics, with the book's names and arguments.

A reader of the book changes ``import modern_robotics as mr`` to ``import drivetrain.modern_robotics as mr``. The
functions call this package's dynamics; an arm is built once for each content of ``Mlist``, ``Glist`` and ``Slist``, and
cached. For rotors, URDF files and so on, use ``Arm``; ``drivetrain.arm.lists`` converts an arm to such lists.

The functions of other chapters (``FKinSpace``, ``CubicTimeScaling``, ...) are those of the package ``modern_robotics``,
if it is installed, so that a whole program runs with only this line changed.

Conventions of the book: ``Mlist`` contains n + 1 poses, of link frame i in link frame i-1 at zero, the first in the
base frame and the last of the end effector in link n [m]; ``Glist`` n spatial inertias in the link frames [kg m^2, kg
m, kg], whose origins need not be the centres of mass; ``Slist`` n screw axes in the base frame, as columns, (6, n).
Twists are (angular, linear), wrenches (moment, force). A screw axis that is not of unit length, as the first one in the
examples of the book's package, scales the motion of its joint for a given ``theta``, in both packages.

Arguments: ``thetalist``, ``dthetalist``, ``ddthetalist`` positions, speeds, accelerations [rad or m, and per s, s^2],
(n,); ``taulist`` torques [N m; N at a prismatic joint], (n,); ``thetamat`` and similar one row per sample, (N, n);
``g`` the acceleration of free fall in the base frame [m/s^2], (3,); ``Ftip`` what the end effector applies to the
environment, in its frame [N m, N], (6,); ``Ftipmat`` the same for every sample, (N, 6), 0 or None for nothing; ``dt``
the time between samples [s]. A posture may be a list, a vector or a column, as in that package; results are vectors.

Differences from the package ``modern_robotics`` 1.1: rotations below 1e-6 rad are computed, not dropped; mass matrices
are not inverted; zero for ``Ftipmat`` means no tip forces, as documented but not implemented there; shapes, rotations
and inertias are checked, and faults raise ``InputError``.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from drivetrain.arm.lists import BookArm, arm_from_lists
from drivetrain.arrays import Array, axes_of, checked_array, checked_number
from drivetrain.dynamics.forward import forward_dynamics
from drivetrain.dynamics.from_positions import torque_from_positions
from drivetrain.dynamics.inverse import gravity_torque, inverse_dynamics, tip_torque, velocity_torque
from drivetrain.dynamics.mass import mass_matrix
from drivetrain.errors import Fault, Faults, InputError, raise_faults
from drivetrain.spatial.wrenches import bracket

MOST_TURNS = 1e6  # largest number of integration steps per row


def ad(V: Any) -> Array:
    """The matrix [ad_V] of the Lie bracket with a twist, (6, 6); equation 8.38."""
    return bracket(_vector(V))


def InverseDynamics(
    thetalist: Any, dthetalist: Any, ddthetalist: Any, g: Any, Ftip: Any, Mlist: Any, Glist: Any, Slist: Any
) -> Array:
    """The joint torques of a motion, (n,); sections 8.3.2 and 8.11."""
    chain = _chain(Mlist, Glist, Slist, g)
    motion = _posture(chain, {"thetalist": thetalist, "dthetalist": dthetalist, "ddthetalist": ddthetalist})
    return inverse_dynamics(chain.arm, *motion, tip_wrench=_tip(_vector(Ftip))) * chain.scale


def MassMatrix(thetalist: Any, Mlist: Any, Glist: Any, Slist: Any) -> Array:
    """The mass matrix M [kg m^2; kg m and kg where joints are prismatic], (n, n); sections 8.5 and 8.11."""
    chain = _chain(Mlist, Glist, Slist, np.zeros(3))
    (q,) = _posture(chain, {"thetalist": thetalist})
    return mass_matrix(chain.arm, q) * np.outer(chain.scale, chain.scale)


def VelQuadraticForces(thetalist: Any, dthetalist: Any, Mlist: Any, Glist: Any, Slist: Any) -> Array:
    """The Coriolis and centripetal torques c, (n,); sections 8.4 and 8.11."""
    chain = _chain(Mlist, Glist, Slist, np.zeros(3))
    q, qd = _posture(chain, {"thetalist": thetalist, "dthetalist": dthetalist})
    return velocity_torque(chain.arm, q, qd) * chain.scale


def GravityForces(thetalist: Any, g: Any, Mlist: Any, Glist: Any, Slist: Any) -> Array:
    """The torques g that hold the arm at rest, (n,); sections 8.4 and 8.11."""
    chain = _chain(Mlist, Glist, Slist, g)
    (q,) = _posture(chain, {"thetalist": thetalist})
    return gravity_torque(chain.arm, q) * chain.scale


def EndEffectorForces(thetalist: Any, Ftip: Any, Mlist: Any, Glist: Any, Slist: Any) -> Array:
    """The torques ``J^T Ftip`` for a wrench on the environment, (n,); equation 8.77, section 8.11."""
    chain = _chain(Mlist, Glist, Slist, np.zeros(3))
    (q,) = _posture(chain, {"thetalist": thetalist})
    return tip_torque(chain.arm, q, _vector(Ftip)) * chain.scale


def ForwardDynamics(
    thetalist: Any, dthetalist: Any, taulist: Any, g: Any, Ftip: Any, Mlist: Any, Glist: Any, Slist: Any
) -> Array:
    """The accelerations due to joint torques, (n,); sections 8.5 and 8.11."""
    chain = _chain(Mlist, Glist, Slist, g)
    q, qd, tau = _posture(chain, {"thetalist": thetalist, "dthetalist": dthetalist, "taulist": taulist})
    return forward_dynamics(chain.arm, q, qd, tau / chain.scale**2, tip_wrench=_tip(_vector(Ftip))) / chain.scale


def EulerStep(thetalist: Any, dthetalist: Any, ddthetalist: Any, dt: float) -> tuple[Array, Array]:
    """Positions and speeds after one explicit Euler step; section 8.11."""
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
    """The joint torques of a motion, sample by sample, (N, n); section 8.11."""
    chain = _chain(Mlist, Glist, Slist, g)
    motion = _scaled(chain, {"thetamat": thetamat, "dthetamat": dthetamat, "ddthetamat": ddthetamat})
    return inverse_dynamics(chain.arm, *motion, tip_wrench=_tip(Ftipmat)) * chain.scale


def InverseDynamicsTrajectoryFromPositions(
    thetamat: Any, dt: float, g: Any, Ftipmat: Any, Mlist: Any, Glist: Any, Slist: Any, resolution: Any = None
) -> Array:
    """The joint torques of a motion from its positions alone, (N, n): the book's exercise 8.14.

    Differentiating readings twice, as the exercise suggests, multiplies their noise by 2.4/dt^2: with a 12-bit encoder
    at 1 kHz the torques are tens of times too large. Here each joint is smoothed according to its resolution, see
    ``drivetrain.dynamics.from_positions``. ``resolution``: step between neighbouring readings [rad or m], a number or
    (n,); None: detected from the samples; 0: exact positions.
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
    """Positions and speeds due to joint torques, (N, n) each, by the explicit Euler method; section 8.11.

    The torques of a row are constant for ``dt``, in ``intRes`` steps; those of the last row are not used. The error is
    of first order only: a falling UR5 with 100 steps per second gains energy, and after three seconds its error is
    some radians. ``drivetrain.simulate_passive`` has better methods.
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
            now = EulerStep(*now, forward_dynamics(chain.arm, *now, torques[row], tip_wrench=tips[row]), step)
        q[row + 1], qd[row + 1] = now
    return q / chain.scale, qd / chain.scale


def __getattr__(name: str) -> Any:
    """Functions of other chapters from the book's package, if it is installed."""
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
    """Finite numbers; all faults are reported together."""
    faults = Faults()
    arrays = [faults.attempt(_values, value, name) for name, value in named.items()]
    faults.raise_any()
    return [array for array in arrays if array is not None]


def _vector(value: Any) -> Any:
    """A column as a vector; other values unchanged."""
    return np.ravel(value) if axes_of(value) == 2 and np.shape(value)[1] == 1 else value


def _posture(chain: BookArm, named: dict[str, Any]) -> list[Array]:
    """As ``_scaled``, but a posture may be a column."""
    n = chain.arm.n
    return _scaled(chain, {k: _vector(v) if axes_of(v) == 2 and np.shape(v) == (n, 1) else v for k, v in named.items()})


def _scaled(chain: BookArm, named: dict[str, Any]) -> list[Array]:
    """Joint values converted to those of unit screws, (n,) or (N, n) each."""
    arrays = dict(zip(named, _all_values(named), strict=True))
    n = chain.arm.n
    raise_faults(
        Fault(name, f"must have shape ({n},) or (N, {n})", array.shape)
        for name, array in arrays.items()
        if array.ndim not in (1, 2) or array.shape[-1] != n
    )
    return [array * chain.scale for array in arrays.values()]


def _tip(wrench: Any) -> Any:
    """The wrench, or None for zero."""
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
    """The arm of these Mlist, Glist, Slist and g, cached by their contents."""
    return arm_from_lists(*(np.frombuffer(data).reshape(shape) for data, shape in contents))
