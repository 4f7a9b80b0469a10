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
COUNT, CONTACT, MESH_WAY = range(3)  # of moves; modes
BY_STATE, APART, TOUCHING = range(3)  # whether the wall is felt: as the state says, or as the events have said
FORWARD, BACKWARD = 1, 2  # which way the mesh carries, likewise
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
def move_at(t: float, p, count: int) -> int:
    """Which of the moves an instant belongs to; where two meet, to the later."""
    move = 0
    while move < count - 1 and t >= p[MOVES + MOVE * move + 1]:
        move += 1
    return move


@nb.njit(cache=True)
def wanted(t: float, p, move: int):
    """Angle, speed, acceleration and jerk that a quintic move wants [rad, rad/s, rad/s^2, rad/s^3]."""
    k = MOVES + MOVE * move
    span, way = p[k + 1] - p[k], p[k + 3] - p[k + 2]
    rate = 1.0 / span
    s = min(max((t - p[k]) * rate, 0.0), 1.0)
    angle = p[k + 2] + way * s * s * s * (10.0 + s * (6.0 * s - 15.0))
    first, bend = s * (1.0 - s), 60.0 * s * (1.0 + s * (2.0 * s - 3.0))
    speed, turn = way * rate, way * rate * rate
    return angle, speed * 30.0 * first * first, turn * bend, turn * rate * 60.0 * (1.0 - 6.0 * first)


@nb.njit(cache=True)
def commanded(t: float, x, p, move: int):
    """The current that control asks for [A], its change with time [A/s], and whether it is free of its limit."""
    angle, speed, acceleration, jerk = wanted(t, p, move)
    back = 1.0 / p[RATIO]
    load = p[LINK_INERTIA] * acceleration + p[GRAVITY] * math.cos(angle)
    rise = p[LINK_INERTIA] * jerk - p[GRAVITY] * math.sin(angle) * speed
    drives = load * p[MOVES + MOVE * move + 4] >= 0.0
    share = 1.0 + p[MESH] if drives else 1.0 / (1.0 + p[MESH])
    control = p[KP] * (angle - x[ROTOR] * back) + p[KD] * (speed - x[ROTOR_SPEED] * back)
    rotor, grown = p[ROTOR_INERTIA] * p[RATIO], p[KP] * speed + p[KD] * acceleration
    asked = (rotor * acceleration + (share * load + control) * back) / p[KT]
    slope = (rotor * jerk + (share * rise + grown) * back) / p[KT]
    if abs(asked) <= p[MOST_CURRENT]:
        return asked, slope, 1.0
    return math.copysign(p[MOST_CURRENT], asked), 0.0, 0.0


@nb.njit(cache=True)
def carried(x, p):
    """What the spring carries [N m]."""
    back = 1.0 / p[RATIO]
    turned, turning = x[ROTOR] * back - x[LINK], x[ROTOR_SPEED] * back - x[LINK_SPEED]
    return p[STIFFNESS] * turned + p[DAMPING] * turning


@nb.njit(cache=True)
def modes(x, force: float, p, words):
    """Which way the mesh carries, and the force of the wall with its slopes."""
    side = 1.0 if force >= 0.0 else -1.0
    if words[MESH_WAY] != BY_STATE:
        side = 1.0 if words[MESH_WAY] == FORWARD else -1.0
    touches = x[LINK] > p[WALL] if words[CONTACT] == BY_STATE else words[CONTACT] == TOUCHING
    if touches:
        contact = p[WALL_STIFFNESS] * (x[LINK] - p[WALL]) + p[WALL_DAMPING] * x[LINK_SPEED]
        if contact > 0.0:
            return side, contact, p[WALL_STIFFNESS], p[WALL_DAMPING]
    return side, 0.0, 0.0, 0.0


@compiled
def joint_rates(t, x, dx, p, words):
    """The joint's equations."""
    back, speed, current = 1.0 / p[RATIO], x[ROTOR_SPEED], x[CURRENT]
    resistance = p[RESISTANCE] * (1.0 + ALPHA_R * (x[WINDING] - 25.0))
    constant = p[KT] * (1.0 + ALPHA_K * (x[HOUSING] - 25.0))
    command, _, _ = commanded(t, x, p, move_at(t, p, words[COUNT]))
    error = command - current
    asked = p[INDUCTANCE] * p[LOOP] * error + x[INTEGRATOR] + p[KT] * speed
    voltage = min(max(asked, -p[VOLTAGE]), p[VOLTAGE])
    dx[INTEGRATOR] = p[RESISTANCE] * p[LOOP] * error + (voltage - asked) * p[LOOP]
    dx[CURRENT] = (voltage - resistance * current - constant * speed) / p[INDUCTANCE]
    sliding, slow = math.tanh(speed / p[SOFTNESS]), speed / p[STRIBECK]
    dry = p[COULOMB] + (p[STATIC] - p[COULOMB]) * math.exp(-slow * slow)
    force = carried(x, p)
    side, contact, _, _ = modes(x, force, p, words)
    resisting = p[GRAVITY] * math.cos(x[LINK]) + p[LINK_VISCOUS] * x[LINK_SPEED] + contact
    dx[LINK], dx[LINK_SPEED] = x[LINK_SPEED], (force - resisting) / p[LINK_INERTIA]
    taken = p[ROTOR_VISCOUS] * speed + dry * sliding + force * back * (1.0 + p[MESH] * side * sliding)
    dx[ROTOR], dx[ROTOR_SPEED] = speed, (constant * current - taken) / p[ROTOR_INERTIA]
    loss, across = current * current * resistance, (x[WINDING] - x[HOUSING]) * (1.0 / WINDING_W)
    dx[WINDING] = (loss - across) * (1.0 / WINDING_C)
    dx[HOUSING] = (across - (x[HOUSING] - AMBIENT) * (1.0 / HOUSING_W)) * (1.0 / HOUSING_C)
    dx[HEAT] = current * current


@compiled
def joint_jacobian(t, x, columns, p, words):
    """Derivatives of the joint's equations: a column of nine a state, then by time."""
    for k in range(SIZE * (SIZE + 1)):
        columns[k] = 0.0
    back, speed, current = 1.0 / p[RATIO], x[ROTOR_SPEED], x[CURRENT]
    resistance = p[RESISTANCE] * (1.0 + ALPHA_R * (x[WINDING] - 25.0))
    constant = p[KT] * (1.0 + ALPHA_K * (x[HOUSING] - 25.0))
    command, slope, free = commanded(t, x, p, move_at(t, p, words[COUNT]))
    asked = p[INDUCTANCE] * p[LOOP] * (command - current) + x[INTEGRATOR] + p[KT] * speed
    open_ = 1.0 if abs(asked) <= p[VOLTAGE] else 0.0
    by = (
        (ROTOR, -free * p[KP] * back * back / p[KT], 0.0), (CURRENT, -1.0, 0.0), (INTEGRATOR, 0.0, 1.0),
        (ROTOR_SPEED, -free * p[KD] * back * back / p[KT], p[KT]), (SIZE, slope, 0.0),
    )  # fmt: skip
    for state, error, more in by:
        grown = p[INDUCTANCE] * p[LOOP] * error + more
        columns[state * SIZE + INTEGRATOR] = p[RESISTANCE] * p[LOOP] * error + (open_ - 1.0) * grown * p[LOOP]
        columns[state * SIZE + CURRENT] = open_ * grown / p[INDUCTANCE]
    columns[CURRENT * SIZE + CURRENT] -= resistance / p[INDUCTANCE]
    columns[ROTOR_SPEED * SIZE + CURRENT] -= constant / p[INDUCTANCE]
    columns[WINDING * SIZE + CURRENT] = -p[RESISTANCE] * ALPHA_R * current / p[INDUCTANCE]
    columns[HOUSING * SIZE + CURRENT] = -p[KT] * ALPHA_K * speed / p[INDUCTANCE]
    sliding, slow = math.tanh(speed / p[SOFTNESS]), speed / p[STRIBECK]
    turns = (1.0 - sliding * sliding) / p[SOFTNESS]
    extra = (p[STATIC] - p[COULOMB]) * math.exp(-slow * slow)
    force = carried(x, p)
    side, _, stiff, damp = modes(x, force, p, words)
    share = back * (1.0 + p[MESH] * side * sliding) / p[ROTOR_INERTIA]
    stiffness, damping = p[STIFFNESS], p[DAMPING]
    pulls = ((LINK, -stiffness), (LINK_SPEED, -damping), (ROTOR, stiffness * back), (ROTOR_SPEED, damping * back))
    for state, pull in pulls:
        columns[state * SIZE + LINK_SPEED] = pull / p[LINK_INERTIA]
        columns[state * SIZE + ROTOR_SPEED] = -share * pull
    columns[LINK * SIZE + LINK_SPEED] -= (stiff - p[GRAVITY] * math.sin(x[LINK])) / p[LINK_INERTIA]
    columns[LINK_SPEED * SIZE + LINK_SPEED] -= (p[LINK_VISCOUS] + damp) / p[LINK_INERTIA]
    columns[LINK_SPEED * SIZE + LINK] = columns[ROTOR_SPEED * SIZE + ROTOR] = 1.0
    friction = p[ROTOR_VISCOUS] - 2.0 * slow / p[STRIBECK] * extra * sliding + (p[COULOMB] + extra) * turns
    friction += force * back * p[MESH] * side * turns
    columns[ROTOR_SPEED * SIZE + ROTOR_SPEED] -= friction / p[ROTOR_INERTIA]
    columns[CURRENT * SIZE + ROTOR_SPEED] = constant / p[ROTOR_INERTIA]
    columns[HOUSING * SIZE + ROTOR_SPEED] = p[KT] * ALPHA_K * current / p[ROTOR_INERTIA]
    columns[CURRENT * SIZE + WINDING] = 2.0 * current * resistance / WINDING_C
    columns[WINDING * SIZE + WINDING] = (current * current * p[RESISTANCE] * ALPHA_R - 1.0 / WINDING_W) / WINDING_C
    columns[HOUSING * SIZE + WINDING] = 1.0 / (WINDING_W * WINDING_C)
    columns[WINDING * SIZE + HOUSING] = 1.0 / (WINDING_W * HOUSING_C)
    columns[HOUSING * SIZE + HOUSING] = -(1.0 / WINDING_W + 1.0 / HOUSING_W) / HOUSING_C
    columns[CURRENT * SIZE + HEAT] = 2.0 * current


@compiled
def event_values(t, x, values, p, words):
    """Where the link meets the wall, whose damper sets in with a jump, and where the mesh carries nothing."""
    values[0] = x[LINK] - p[WALL] if words[CONTACT] == TOUCHING else p[WALL] - x[LINK]
    values[1] = carried(x, p) if words[MESH_WAY] == FORWARD else -carried(x, p)


@compiled
def event_handler(t, x, crossed, p, words):
    """The link has met the wall or left it; the mesh carries the other way."""
    if crossed[0] != 0.0:
        words[CONTACT] = APART if words[CONTACT] == TOUCHING else TOUCHING
    if crossed[1] != 0.0:
        words[MESH_WAY] = BACKWARD if words[MESH_WAY] == FORWARD else FORWARD


def parameters(scene: JointScene, softness: float):
    """The numbers of the right-hand side; ``softness`` is the speed over which friction changes its sign [rad/s]."""
    numbers = np.zeros(MOVES + MOVE * len(scene.moves))
    for place, value in {**COMMON, **scene.differs, SOFTNESS: softness}.items():
        numbers[place] = value
    for k, (first, last, start, end) in enumerate(scene.moves):
        numbers[MOVES + MOVE * k : MOVES + MOVE * (k + 1)] = first, last, start, end, float(np.sign(end - start))
    return numbers


def problem(scene: JointScene, *, softness: float = 0.5, events: bool = True) -> CompiledProblem:
    """The scene as a compiled right-hand side; with events, its bends and jumps are those."""
    kinks = Events(event_values, event_handler, ("contact", "mesh")) if events else None
    way = FORWARD if scene.differs[GRAVITY] * math.cos(scene.moves[0][2]) >= 0.0 else BACKWARD
    words = np.array([len(scene.moves), *((APART, way) if events else (BY_STATE, BY_STATE))])
    return CompiledProblem(joint_rates, SIZE, parameters(scene, softness), words, jacobian=joint_jacobian, events=kinks,
                           names=NAMES)  # fmt: skip


def start(scene: JointScene, *, softness: float = 0.5):
    """At rest on the loaded spring, with the current that control asks for."""
    p, x = parameters(scene, softness), np.zeros(SIZE)
    x[LINK] = scene.moves[0][2]
    x[WINDING] = x[HOUSING] = AMBIENT
    x[ROTOR] = p[RATIO] * (x[LINK] + p[GRAVITY] * math.cos(x[LINK]) / p[STIFFNESS])
    x[CURRENT] = commanded(0.0, x, p, 0)[0]
    x[INTEGRATOR] = p[RESISTANCE] * x[CURRENT]
    return x


def breakpoints(scene: JointScene) -> list[float]:
    """Where one move follows another [s]."""
    return [move[1] for move in scene.moves[:-1]]
