"""One geared joint with everything on, as a compiled right-hand side, and the three motions it is judged on.

A 150 W class motor with typical numbers behind a strain-wave gear with a spring: inductance and current loop, voltage
limit, winding and housing heat with R(T) and kt(T), Coulomb, Stribeck and viscous friction of the rotor, mesh loss that
follows the load, position control with feed-forward of what a careful engineer would feed forward. Friction is smooth
here (tanh), so that methods that know nothing of sticking can run beside the others.

Reference: the torque balance of Modern Robotics section 8.9; friction and mesh loss as in ``drivetrain.drive``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numba as nb
import numpy as np

from drivetrain.solvers.compiled_function import compiled
from drivetrain.solvers.compiled_problem import CompiledProblem, Events
from drivetrain.solvers.layout import EITHER

# States: link [rad, rad/s], rotor [rad, rad/s], current [A], voltage of the current loop's integrator [V],
# winding and housing [C], integral of the squared current [A^2 s].
LINK, LINK_SPEED, ROTOR, ROTOR_SPEED, CURRENT, INTEGRATOR, WINDING, HOUSING, HEAT = range(9)
SIZE = 9
NAMES = ("link", "link speed", "rotor", "rotor speed", "current", "integrator", "winding", "housing", "heat")
ATOL = (1e-7, 1e-5, 1e-5, 1e-3, 1e-4, 1e-4, 1e-4, 1e-4, 1e-3)  # at rtol 1e-4; smaller in proportion

(
    KT, RESISTANCE, INDUCTANCE, ROTOR_INERTIA, ROTOR_VISCOUS, COULOMB, STATIC, STRIBECK, SOFTNESS, RATIO, MESH,
    STIFFNESS, DAMPING, LINK_INERTIA, GRAVITY, LINK_VISCOUS, VOLTAGE, MOST_CURRENT, KP, KD, LOOP, WALL, WALL_STIFFNESS,
    WALL_DAMPING, MOVES,
) = range(25)  # fmt: skip
MOVE_WORD, CONTACT = range(2)
BY_STATE, APART, TOUCHING = range(3)  # whether the wall is felt: as the state says, or as the events have said
ALPHA_R, ALPHA_K, WINDING_W, HOUSING_W, WINDING_C, HOUSING_C, AMBIENT = 0.00393, -0.001, 1.9, 4.65, 21.8, 241.0, 25.0
MOVE = 5  # numbers a move: start, end [s], from, to [rad], which way its feed-forward drives

COMMON = {
    KT: 0.0302, RESISTANCE: 0.299, INDUCTANCE: 8.2e-5, ROTOR_INERTIA: 3.3e-5, ROTOR_VISCOUS: 5e-6, COULOMB: 0.015,
    STATIC: 0.025, STRIBECK: 5.0, SOFTNESS: 0.5, RATIO: 100.0, MESH: 0.25, STIFFNESS: 2e4, DAMPING: 4.0,
    LINK_VISCOUS: 0.2, VOLTAGE: 48.0, MOST_CURRENT: 30.0, LOOP: 2.0 * math.pi * 1000.0, WALL: 1e9,
    WALL_STIFFNESS: 0.0, WALL_DAMPING: 0.0,
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class JointScene:
    """A motion of the joint: its name, what differs from the common numbers, and the moves [s, s, rad, rad]."""

    name: str
    differs: dict[int, float]
    moves: tuple[tuple[float, float, float, float], ...]

    @property
    def duration(self) -> float:
        """How long it lasts [s]."""
        return self.moves[-1][1]


SCENES = (
    JointScene("S1 slow heavy lift", {LINK_INERTIA: 1.3, GRAVITY: 19.62, KP: 2000.0, KD: 60.0},
               ((0.0, 8.0, -1.2, 0.3), (8.0, 10.0, 0.3, 0.3), (10.0, 18.0, 0.3, -1.2), (18.0, 20.0, -1.2, -1.2))),
    JointScene("S2 fast pick and place", {LINK_INERTIA: 0.4, GRAVITY: 4.9, KP: 4000.0, KD: 80.0},
               ((0.0, 0.35, -0.5, 0.5), (0.35, 0.75, 0.5, 0.5), (0.75, 1.1, 0.5, -0.5), (1.1, 1.5, -0.5, -0.5))),
    JointScene("S3 stiff strain-wave contact",
               {LINK_INERTIA: 0.3, GRAVITY: 3.0, ROTOR_INERTIA: 2e-6, COULOMB: 0.004, STATIC: 0.006,
                ROTOR_VISCOUS: 1e-6, STIFFNESS: 1e5, DAMPING: 5.0, KP: 1500.0, KD: 8.0, WALL: 0.015,
                WALL_STIFFNESS: 5e4, WALL_DAMPING: 50.0},
               ((0.0, 0.05, 0.0, 0.02), (0.05, 0.15, 0.02, 0.02), (0.15, 0.2, 0.02, 0.0), (0.2, 0.3, 0.0, 0.0))),
)  # fmt: skip


@nb.njit(cache=True)
def wanted(t: float, p, move: int):
    """Angle, speed and acceleration that a quintic move wants [rad, rad/s, rad/s^2]."""
    k = MOVES + MOVE * move
    span, way = p[k + 1] - p[k], p[k + 3] - p[k + 2]
    s = min(max((t - p[k]) / span, 0.0), 1.0)
    angle = p[k + 2] + way * s**3 * (10.0 + s * (6.0 * s - 15.0))
    return angle, way / span * 30.0 * (s * (1.0 - s)) ** 2, way / span**2 * 60.0 * s * (1.0 + s * (2.0 * s - 3.0))


@nb.njit(cache=True)
def commanded(t: float, x, p, move: int):
    """The current that control asks for [A]."""
    angle, speed, acceleration = wanted(t, p, move)
    ratio = p[RATIO]
    load = p[LINK_INERTIA] * acceleration + p[GRAVITY] * np.cos(angle)
    drives = load * p[MOVES + MOVE * move + 4] >= 0.0
    load = load * (1.0 + p[MESH]) if drives else load / (1.0 + p[MESH])
    control = p[KP] * (angle - x[ROTOR] / ratio) + p[KD] * (speed - x[ROTOR_SPEED] / ratio)
    torque = p[ROTOR_INERTIA] * ratio * acceleration + (load + control) / ratio
    return min(max(torque / p[KT], -p[MOST_CURRENT]), p[MOST_CURRENT])


@compiled
def joint_rates(t, x, dx, p, words):
    """The joint's equations."""
    ratio, speed, current = p[RATIO], x[ROTOR_SPEED], x[CURRENT]
    resistance = p[RESISTANCE] * (1.0 + ALPHA_R * (x[WINDING] - 25.0))
    constant = p[KT] * (1.0 + ALPHA_K * (x[HOUSING] - 25.0))
    error = commanded(t, x, p, words[MOVE_WORD]) - current
    asked = p[INDUCTANCE] * p[LOOP] * error + x[INTEGRATOR] + p[KT] * speed
    voltage = min(max(asked, -p[VOLTAGE]), p[VOLTAGE])
    dx[INTEGRATOR] = p[RESISTANCE] * p[LOOP] * error + (voltage - asked) * p[LOOP]
    dx[CURRENT] = (voltage - resistance * current - constant * speed) / p[INDUCTANCE]
    sliding = np.tanh(speed / p[SOFTNESS])
    stribeck = np.exp(-((speed / p[STRIBECK]) ** 2))
    friction = p[ROTOR_VISCOUS] * speed + (p[COULOMB] + (p[STATIC] - p[COULOMB]) * stribeck) * sliding
    turned, turning = x[ROTOR] / ratio - x[LINK], speed / ratio - x[LINK_SPEED]
    force = p[STIFFNESS] * turned + p[DAMPING] * turning
    contact = 0.0
    touches = x[LINK] > p[WALL] if words[CONTACT] == BY_STATE else words[CONTACT] == TOUCHING
    if touches:
        contact = max(p[WALL_STIFFNESS] * (x[LINK] - p[WALL]) + p[WALL_DAMPING] * x[LINK_SPEED], 0.0)
    resisting = p[GRAVITY] * np.cos(x[LINK]) + p[LINK_VISCOUS] * x[LINK_SPEED] + contact
    dx[LINK], dx[LINK_SPEED] = x[LINK_SPEED], (force - resisting) / p[LINK_INERTIA]
    mesh = p[MESH] * abs(force) * sliding / ratio
    dx[ROTOR], dx[ROTOR_SPEED] = speed, (constant * current - friction - force / ratio - mesh) / p[ROTOR_INERTIA]
    loss, across = current * current * resistance, (x[WINDING] - x[HOUSING]) / WINDING_W
    dx[WINDING] = (loss - across) / WINDING_C
    dx[HOUSING] = (across - (x[HOUSING] - AMBIENT) / HOUSING_W) / HOUSING_C
    dx[HEAT] = current * current


@compiled
def wall_values(t, x, values, p, words):
    """Where the link meets the wall: its damper sets in with a jump."""
    values[0] = x[LINK] - p[WALL]


@compiled
def wall_handler(t, x, crossed, p, words):
    """The link has met the wall, or left it."""
    words[CONTACT] = TOUCHING if crossed[0] > 0.0 else APART


SPARSITY = np.zeros((SIZE, SIZE), dtype=bool)
for row, columns in {
    LINK: (LINK_SPEED,), LINK_SPEED: (LINK, LINK_SPEED, ROTOR, ROTOR_SPEED), ROTOR: (ROTOR_SPEED,),
    ROTOR_SPEED: (LINK, LINK_SPEED, ROTOR, ROTOR_SPEED, CURRENT, HOUSING),
    CURRENT: (ROTOR, ROTOR_SPEED, CURRENT, INTEGRATOR, WINDING, HOUSING),
    INTEGRATOR: (ROTOR, ROTOR_SPEED, CURRENT, INTEGRATOR), WINDING: (CURRENT, WINDING, HOUSING),
    HOUSING: (WINDING, HOUSING), HEAT: (CURRENT,),
}.items():  # fmt: skip
    SPARSITY[row, list(columns)] = True


def parameters(scene: JointScene, softness: float):
    """The numbers of the right-hand side; ``softness`` is the speed over which friction changes its sign [rad/s]."""
    numbers = np.zeros(MOVES + MOVE * len(scene.moves))
    for place, value in {**COMMON, **scene.differs, SOFTNESS: softness}.items():
        numbers[place] = value
    for k, (first, last, start, end) in enumerate(scene.moves):
        numbers[MOVES + MOVE * k : MOVES + MOVE * (k + 1)] = first, last, start, end, float(np.sign(end - start))
    return numbers


def problem(scene: JointScene, *, softness: float = 0.5, events: bool = True) -> CompiledProblem:
    """The scene as a compiled right-hand side; with events, the contact is one instead of a jump on the way."""
    contact = Events(wall_values, (EITHER,), handler=wall_handler, names=("contact",)) if events else None
    words = np.array([0, APART if events else BY_STATE])
    return CompiledProblem(joint_rates, SIZE, parameters(scene, softness), words, sparsity=SPARSITY, events=contact,
                           names=NAMES, segment_word=MOVE_WORD)  # fmt: skip


def start(scene: JointScene, *, softness: float = 0.5):
    """At rest on the loaded spring, with the current that control asks for."""
    p, x = parameters(scene, softness), np.zeros(SIZE)
    x[LINK] = scene.moves[0][2]
    x[WINDING] = x[HOUSING] = AMBIENT
    x[ROTOR] = p[RATIO] * (x[LINK] + p[GRAVITY] * math.cos(x[LINK]) / p[STIFFNESS])
    x[CURRENT] = commanded(0.0, x, p, 0)
    x[INTEGRATOR] = p[RESISTANCE] * x[CURRENT]
    return x


def breakpoints(scene: JointScene) -> list[float]:
    """Where one move follows another [s]."""
    return [move[1] for move in scene.moves[:-1]]
