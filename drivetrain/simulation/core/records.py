"""The memory of a run as named records: one block of float64 numbers, divided into sections of records.

Python lays out the block (``memory.py``) and passes the addresses of its sections to compiled code as ``run``. There,
``coordinates_of(run)[i].change`` or ``pairs_of(run)[i, k].mass`` reads or writes a number of the block.
"""

from __future__ import annotations

from collections import namedtuple
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from numba import carray, types

from drivetrain.arrays import Array
from drivetrain.call_address import call_address
from drivetrain.effects.connectors import JOINT, WORLD
from drivetrain.jit import law
from drivetrain.records import record_type

part: Any = law(fastmath={"contract"})

PARTS = types.CPointer(types.voidptr)  # addresses of a run's sections
EQUATIONS = types.void(types.float64, types.float64, PARTS)


@dataclass
class Bounds:
    """Bounds of dry friction at rest (hold) and while slipping (slide) by direction, all positive [N m]."""

    hold_forward: float = 0.0
    hold_backward: float = 0.0
    slide_forward: float = 0.0
    slide_backward: float = 0.0


@dataclass
class Dry:
    """Dry friction of a coordinate."""

    # bounds of the joint, and of the motor referred to the joint
    joint: Bounds
    motor: Bounds
    # loss of the mesh over the torque that it transmits, when the motor drives and when the load drives [-]
    driving: float = 0.0
    driven: float = 0.0
    active: int = 0  # whether the coordinate has dry friction
    mode: int = 0  # contact mode: 1 slips forward, -1 slips backward, 0 sticks
    load_sign: int = 1  # sign of the torque transmitted by the mesh
    mode_fixed: int = 0


@dataclass
class Coordinate:
    """A coordinate of the mechanics: of a joint (its shaft where motors are coupled) or of a rotor behind a spring."""

    # of a joint: coordinate of its link (for the second motor of an axis that of the first), coordinate of its motor,
    # motor angle over joint coordinate, zero of the motor's angle at the gear's output, whether motors are coupled
    link: int
    motor: int
    ratio: float
    zero: float
    coupled: int
    # of a scene without an arm: inertia, torque of the weight along x, angle from x, the rotor's share of the inertia
    inertia: float
    weight: float
    phase: float
    rotor: float
    # row of the body that the motor turns (-1: none), and, where motors are coupled or loops closed, the inertia of
    # reflected rotors at the shaft [kg m^2 or kg]
    rotor_row: int
    shaft_inertia: float
    dry: Dry
    # the states [rad or m, and per s]; the position of a rotor behind a spring is the wind-up of the spring
    position: float = 0.0
    speed: float = 0.0
    # rates of the states at an instant
    position_rate: float = 0.0
    speed_rate: float = 0.0
    last: float = 0.0  # acceleration of the last step [rad/s^2]
    impulse: float = 0.0  # right-hand side of the linear system: impulse without dry friction [N m s]
    change: float = 0.0  # change of speed over a step [rad/s]; at an instant the acceleration
    relative: float = 0.0  # speed relative to its contact surface [rad/s]
    surface: float = 0.0  # speed of that surface [rad/s]
    transmitted: float = 0.0  # torque transmitted by the mesh if no speed changed [N m]
    friction: float = 0.0  # torque of dry friction [N m]
    margin: float = 0.0  # distance from a change of the contact mode: a torque while it sticks, a speed while it slips
    # position and guessed speed in the middle of a step [rad or m, and per s]
    mid_position: float = 0.0
    mid_speed: float = 0.0
    trial_speed: float = 0.0  # speed in the middle of the step at which piecewise laws were evaluated [rad/s]
    # bias torque (at zero acceleration), and the part of it that acts on the motor's rotor [N m or N]
    bias: float = 0.0
    rotor_bias: float = 0.0
    slipping: int = 0  # entry k of this field is the k-th slipping coordinate
    # contact mode before a step or an event, and the direction in which friction last exceeded its bound while stuck
    before: int = 0
    breakaway_direction: int = 0
    released: int = 0  # entry k of this field is the k-th coordinate that has just started to slip
    # saved contact mode, while others are tried
    saved_mode: int = 0
    saved_sign: int = 1
    saved_fixed: int = 0


@dataclass
class Pair:
    """Entry (i, k) of the matrices of the mechanics."""

    # mass matrix, and the part of it that acts on the motor's rotor [kg m^2 or kg]
    mass: float = 0.0
    rotor_mass: float = 0.0
    matrix: float = 0.0  # matrix of the linear system: mass matrix with dampers and springs
    transmitted: float = 0.0  # torque transmitted by the mesh of i per change of speed of k [N m s]
    reduced: float = 0.0  # matrix of the slipping coordinates, then its factors


@dataclass
class Call:
    """A call of a law for consecutive records of effects of one kind."""

    law: int  # address of the compiled law
    own: int  # index of the first number of the records
    count: int  # number of records
    period: float = 0.0  # sampling period [s]; 0: not sampled
    taken: int = 0  # number of samples taken so far


@dataclass
class Guard:
    """A guard of an effect: a value that must not become negative, and the law that changes the mode when it does."""

    value: int  # index of the value
    law: int  # address of the law, as in ``Call``
    own: int
    count: int


@dataclass
class State:
    """Indices of a state, of its rate and of the connector that shows it in the memory; -1: none."""

    value: int
    rate: int
    shown: int
    last: float = 0.0  # rate over the last step


AMBIGUOUS_MODE = 2  # in place of a contact mode: the coordinate could as well have stuck


@dataclass
class ModeChange:
    """A change of the contact mode of a coordinate, with the modes before and after."""

    time: float  # [s]
    coordinate: int
    before: int
    after: int


@dataclass
class Chain:
    """A chain of an arm with closed loops."""

    # index of its first row, link, rotor, body, and entry of the mass matrices
    row: int
    link: int
    rotor: int
    body: int
    entry: int
    # how many there are; rows are joints, then rotors behind springs
    joints: int
    rows: int
    rotors: int


@dataclass
class Section:
    """A section of the memory: index of its first number, how many numbers it has, and how many records."""

    first: int
    size: int
    count: int


SECTIONS = (
    # the whole memory; what laws see (joints, mass matrix); data of the equations; this list of sections
    "numbers", "joints", "mass", "engine", "sections",
    # mechanics
    "coordinates", "pairs", "links", "rotors", "bodies", "payloads", "turns", "spread", "body_places",
    "body_speeds", "body_bias", "body_rotor_bias", "body_mass", "body_rotor_mass", "between",
    # closed loops
    "body_rates", "row_joints", "chains", "whole", "follow", "ends", "screws", "loop_links", "pins", "followed",
    "lower",
    # calls of laws, states, and recorded numbers
    "computes", "iterated", "accounts", "accepts", "samples", "guards", "states", "powers", "energies", "columns",
    # of the adaptive engine: its log of mode changes, and the memory of its Jacobian
    "log", "sizes", "found", "later", "moved", "factors", "slid", "torques", "own", "arm_torques", "groups", "members",
    "row_starts", "rows",
)  # fmt: skip
AT: Any = namedtuple("AT", SECTIONS)(*range(len(SECTIONS)))  # type: ignore[misc]  # index of each section


@dataclass
class Engine:
    """Settings and working data of the equations of motion."""

    # flags: there is an arm, an effect uses the tip, motors are coupled, loops are closed; neither of the last two:
    # then the bodies have the coordinates of the mechanics
    arm: int
    uses_tip: int
    coupled: int
    looped: int
    direct: int
    bodies: int  # number of coordinates of the bodies
    last: int  # index of the link that carries the tip
    # addresses of the compiled equations
    motion: int
    forces: int
    bodies_law: int
    friction_law: int
    uniqueness_law: int
    moving: int  # number of states that have rates
    loops_open: int  # whether the loops could not be closed
    potential: float  # potential energy of an arm with closed loops [J]
    tip_offset: Annotated[Array, 3]  # position of the tip in the last link's frame [m]
    theta: float  # share of the step at which forces are evaluated [-]
    # number of solutions of the last step; negative: -1 - i if coordinate i jams, NO_MODES_FOUND or LOOPS_CANNOT_CLOSE
    solved: int
    ambiguous: int  # a coordinate that could as well have stuck (see ``ambiguous_modes``); -1: none
    stiff: int  # whether a spring or damper is stiff for the step, see ``assembly.STIFF_RATIO``
    modes_fixed: int  # whether all contact modes are fixed
    unsettled: int  # number of steps in which the Newton iteration did not converge
    late: int  # whether the rate of any state needs the forces, see ``State.late`` of the effects
    logged: int  # number of mode changes so far, of the adaptive engine
    # motion of the tip at the guessed speeds, and the force that the solution assumed
    tip_place: Annotated[Array, 3]
    tip_speed: Annotated[Array, 3]
    tip_turning: Annotated[Array, 3]
    tip_expected: Annotated[Array, 3]
    # damping and stiffness at the tip in the iteration before


COORDINATE, PAIR, CALL, GUARDED, STATE, MODE_CHANGE, SECTION, ENGINE, CHAIN = (
    record_type(one, np.int64) for one in (Coordinate, Pair, Call, Guard, State, ModeChange, Section, Engine, Chain)
)


Run = Any  # in compiled code: pointer to the addresses of a run's sections, of type PARTS


def parts_of(numbers: Array) -> Any:
    """Addresses of the sections of a run's memory and of its effects' tables, int64; the memory must stay alive."""
    listed = numbers[(WORLD.itemsize + ENGINE.itemsize) // 8 :]
    size = listed[: len(SECTIONS) * SECTION.itemsize // 8].view(SECTION)["size"][AT.sections]
    return np.asarray(numbers.ctypes.data + 8 * listed[:size].view(SECTION)["first"])


@part
def world_of(run: Run) -> Any:
    """The record of the whole scene, WORLD."""
    return carray(run[AT.numbers], 1, WORLD)[0]


@part
def engine_of(run: Run) -> Any:
    """Settings and working data of the equations of motion, record ENGINE."""
    return carray(run[AT.engine], 1, ENGINE)[0]


@part
def count_of(run: Run, which: int) -> int:
    """Number of records (or plain numbers) in a section."""
    return carray(run[AT.sections], len(SECTIONS), SECTION)[which].count


@part
def memory_of(run: Run) -> Any:
    """The whole memory as float64 numbers."""
    return carray(run[AT.numbers], world_of(run).size, np.float64)


@part
def numbers_of(run: Run, which: int) -> Any:
    """A section of float64 numbers."""
    return carray(run[which], count_of(run, which), np.float64)


@part
def words_of(run: Run, which: int) -> Any:
    """A section of int64 numbers."""
    return carray(run[which], count_of(run, which), np.int64)


@part
def rows_of(run: Run, which: int, rows: int, columns: int) -> Any:
    """A section of float64 numbers as a matrix, (rows, columns)."""
    return carray(run[which], (rows, columns), np.float64)


@part
def joints_of(run: Run) -> Any:
    """Connectors of the joints, records JOINT, (n,)."""
    return carray(run[AT.joints], world_of(run).joints, JOINT)


@part
def coordinates_of(run: Run) -> Any:
    """Coordinates of the mechanics, records COORDINATE, (c,); the first n are those of the joints."""
    return carray(run[AT.coordinates], world_of(run).coordinates, COORDINATE)


@part
def pairs_of(run: Run) -> Any:
    """Matrices of the mechanics, records PAIR, (c, c)."""
    return carray(run[AT.pairs], (world_of(run).coordinates, world_of(run).coordinates), PAIR)


@part
def states_of(run: Run) -> Any:
    """The states, records STATE."""
    return carray(run[AT.states], count_of(run, AT.states), STATE)


@part
def calls_of(run: Run, which: int) -> Any:
    """A section of calls of laws, records CALL."""
    return carray(run[which], count_of(run, which), CALL)


@part
def guards_of(run: Run) -> Any:
    """Guards of effects, records GUARDED."""
    return carray(run[AT.guards], count_of(run, AT.guards), GUARDED)


@part
def log_changes(run: Run, t: float, log: Any, logged: int) -> int:
    """Append the contact modes that have changed to the log, as long as it has room; returns their number so far."""
    coordinates, ambiguous = coordinates_of(run), engine_of(run).ambiguous
    for i in range(len(coordinates)):
        one, after = coordinates[i], coordinates[i].dry.mode
        if not one.dry.active:  # nothing rubs: all that can have changed is that it was stuck
            after = one.before if one.before != 0 else (1 if one.speed > one.surface else -1)
        if after != one.before:
            _put_change(log, logged, t, i, one.before, after)
            logged += 1
    if ambiguous >= 0:
        _put_change(log, logged, t, ambiguous, 0, AMBIGUOUS_MODE)
        logged += 1
    return logged


@part
def _put_change(log: Any, at: int, t: float, coordinate: int, before: int, after: int) -> None:
    """Write entry ``at`` of the log, if it has room."""
    if at < len(log):
        change = log[at]
        change.time, change.coordinate, change.before, change.after = t, coordinate, before, after


@part
def call_law(run: Run, call: Any, t: float, h: float) -> None:
    """Call a law for its records, at time t [s] in a step of length h [s]."""
    own = memory_of(run).ctypes.data + 8 * call.own
    call_address(call.law, (t, h, own, call.count, run))


@part
def call_laws(run: Run, which: int, t: float, h: float) -> None:
    """Call the laws of a section in order."""
    calls = calls_of(run, which)
    for k in range(len(calls)):
        call_law(run, calls[k], t, h)


@part
def call_equations(run: Run, address: int, t: float, h: float) -> None:
    """Call a part of the equations of motion by its address, such as the engine record's ``motion``."""
    call_address(address, (t, h, run))
