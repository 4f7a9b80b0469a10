"""The memory of a run, with names: records of joints, coordinates, calls and states over one block of numbers.

Python lays the block out (``memory.py``) and hands the addresses of its sections to compiled code as ``run``: there
``coordinates_of(run)[i].change`` or ``pairs_of(run)[i, k].mass`` is a number of that memory.
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
    """Of dry friction, all positive [N m]."""

    hold_forward: float = 0.0
    hold_backward: float = 0.0
    slide_forward: float = 0.0
    slide_backward: float = 0.0


@dataclass
class Dry:
    """Dry friction of a coordinate."""

    # bounds of the joint and, at the joint, of the motor
    joint: Bounds
    motor: Bounds
    # loss of the mesh over the torque it transmits [-]
    driving: float = 0.0
    driven: float = 0.0
    active: int = 0  # whether there is any
    mode: int = 0  # 1 slides forward, -1 backward, 0 sticks
    load_sign: int = 1  # of the transmitted torque
    given: int = 0  # whether the mode is not to be changed


@dataclass
class Tried:
    """A rate of a spring that was tried: what the solution expected of the spring, and by how much it was off."""

    rate: float = 0.0
    expected: float = 0.0
    off: float = 0.0


@dataclass
class Coordinate:
    """A coordinate of the mechanics: of a joint (or its shaft, where motors are coupled), or of a rotor on a spring."""

    # of a joint: its motor's coordinate, motor angle over joint coordinate, whether motors are coupled there
    motor: int
    ratio: float
    coupled: int
    # of a scene without an arm: inertia, torque of the weight along x, angle from x, the rotor's share of the inertia
    inertia: float
    weight: float
    phase: float
    rotor: float
    # where motors are coupled or loops closed: the body whose turning the motor feels (-1: none), and the inertia of
    # reflected rotors at the shaft [kg m^2 or kg]
    felt: int
    own: float
    dry: Dry
    # between which rates of its spring the answer lies
    slow: Tried
    fast: Tried
    # states; of a rotor the wind-up of its spring [rad]
    position: float = 0.0
    speed: float = 0.0
    # of these, at an instant
    position_rate: float = 0.0
    speed_rate: float = 0.0
    last: float = 0.0  # acceleration of the last step [rad/s^2]
    right: float = 0.0  # impulse without friction [N m s]
    change: float = 0.0  # of the speed over a step [rad/s], at an instant the acceleration
    relative: float = 0.0  # speed over what it slides on [rad/s]
    surface: float = 0.0  # speed of that [rad/s]
    transmitted: float = 0.0  # torque through the mesh without changes of speed [N m]
    friction: float = 0.0  # what dry friction takes [N m]
    margin: float = 0.0  # how far its mode is from changing
    # position, and guessed speed of the middle of a step [rad or m, and per s]
    place: float = 0.0
    guess: float = 0.0
    trial: float = 0.0  # speed of the middle at which springs and the tip's surroundings were asked [rad/s]
    # torque at constant speed, and the part of it that the motor feels [N m or N]
    bias: float = 0.0
    felt_bias: float = 0.0
    sliding: int = 0  # of the coordinates that slide, the one at this place
    # mode before a step or an event, and the direction in which it was last seen to give while stuck
    before: int = 0
    gave: int = 0
    # of those that let go together the one at this place, and what friction does in the solution that is kept, while
    # others are tried
    loose: int = 0
    found_mode: int = 0
    found_sign: int = 1
    found_given: int = 0


@dataclass
class Pair:
    """What a coordinate has to do with another."""

    # entry of the mass matrix, and the part of it that the motor feels [kg m^2 or kg]
    mass: float = 0.0
    felt: float = 0.0
    matrix: float = 0.0  # inertia with dampers and springs in it
    transmitted: float = 0.0  # torque through the mesh for a change of speed [N m s]
    reduced: float = 0.0  # the system of what slides


@dataclass
class Call:
    """A law to be called: its address, first number of its records, how many; of samples the period and how many."""

    law: int
    own: int
    count: int
    period: float = 0.0
    taken: int = 0


@dataclass
class Guard:
    """What must not become negative, and the law that makes the change when it would: address, first number, one."""

    value: int
    law: int
    own: int
    count: int


@dataclass
class State:
    """Where a state and its rate are among the numbers, and the connector that shows it (-1: none)."""

    value: int
    rate: int
    shown: int
    last: float = 0.0  # its rate over the last step


UNDECIDED = 2  # in the place of a mode: the coordinate might as well have held


@dataclass
class ModeChange:
    """Of a coordinate's friction: instant [s], coordinate, mode before and after."""

    time: float
    coordinate: int
    before: int
    after: int


@dataclass
class Chain:
    """Of an arm with loops a chain: its first row, link, rotor, body and entry of its mass matrix, and how many."""

    row: int
    link: int
    rotor: int
    body: int
    entry: int
    joints: int
    rows: int  # joints, then rotors on their own
    rotors: int


@dataclass
class Section:
    """A part of the memory: its first number, how many numbers there are, and how many records."""

    first: int
    size: int
    count: int


SECTIONS = (
    "numbers", "joints", "mass", "engine", "sections",  # all of it; what laws see; what the engine keeps; this list
    # mechanics
    "coordinates", "pairs", "links", "rotors", "bodies", "payloads", "turns", "spread", "body_places",
    "body_speeds", "body_bias", "body_felt_bias", "body_mass", "body_felt", "between",
    # of closed loops
    "body_rates", "row_joints", "chains", "whole", "follow", "ends", "screws", "loop_links", "pins", "followed",
    "lower",
    # laws, states, and what is recorded
    "computes", "repeats", "accounts", "accepts", "samples", "guards", "states", "powers", "energies", "columns",
    # of the adaptive engine: its log, and what its Jacobian needs
    "log", "sizes", "found", "later", "moved", "factors", "slid", "torques", "own", "groups", "members", "row_starts",
    "rows",
)  # fmt: skip
AT: Any = namedtuple("AT", SECTIONS)(*range(len(SECTIONS)))  # type: ignore[misc]  # where each stands in such a list


@dataclass
class Engine:
    """What the equations of motion keep for themselves."""

    # whether there is an arm, whether an effect looks at the tip, whether motors are coupled, whether loops are closed,
    # and whether neither is: then the bodies have the coordinates for their own, of which there are else as many
    arm: int
    uses_tip: int
    coupled: int
    looped: int
    direct: int
    bodies: int
    last: int  # link that carries the tip
    # addresses of the compiled equations
    motion: int
    forces: int
    bodies_law: int
    friction_law: int
    outcomes_law: int
    moving: int  # how many states follow rates
    open: int  # whether loops could not be closed
    potential: float  # energy of the bodies of an arm with loops [J]
    tip_offset: Annotated[Array, 3]  # of the tip in the last link's frame [m]
    theta: float  # share of the step at which forces are taken [-]
    solved: int  # solutions of the last step; negative: which coordinate jams, below -1000 none fits or loops are open
    undecided: int  # A coordinate that has let go together with others and may as well have held; -1: none
    stiff: int  # whether springs or dampers made the last step's inertia a good deal larger
    held: int  # whether modes of friction are given
    unsettled: int  # steps on which solution and springs never agreed
    rates_calls: int  # evaluations of the rates
    late: int  # whether any state's rate is known only once motion and forces are
    logged: int  # changes of modes so far, of the adaptive engine
    # of the guess; the force that a solution expects
    tip_place: Annotated[Array, 3]
    tip_speed: Annotated[Array, 3]
    tip_turning: Annotated[Array, 3]
    tip_expected: Annotated[Array, 3]
    # how forces fell when last asked
    tip_damping: Annotated[Array, 6]
    tip_stiffness: Annotated[Array, 6]


COORDINATE, PAIR, CALL, GUARDED, STATE, MODE_CHANGE, SECTION, ENGINE, CHAIN = (
    record_type(one, np.int64) for one in (Coordinate, Pair, Call, Guard, State, ModeChange, Section, Engine, Chain)
)


Run = Any  # in compiled code: where the addresses of a run's sections stand, of the kind PARTS


def parts_of(numbers: Array) -> Any:
    """Addresses of the sections of a run's memory, which must outlive them, and of its effects' tables, of int64."""
    listed = numbers[(WORLD.itemsize + ENGINE.itemsize) // 8 :]
    size = listed[: len(SECTIONS) * SECTION.itemsize // 8].view(SECTION)["size"][AT.sections]
    return np.asarray(numbers.ctypes.data + 8 * listed[:size].view(SECTION)["first"])


@part
def world_of(run: Run) -> Any:
    """The record of the scene."""
    return carray(run[AT.numbers], 1, WORLD)[0]


@part
def engine_of(run: Run) -> Any:
    """What the engine keeps for itself."""
    return carray(run[AT.engine], 1, ENGINE)[0]


@part
def count_of(run: Run, which: int) -> int:
    """How many records or numbers a section has."""
    return carray(run[AT.sections], len(SECTIONS), SECTION)[which].count


@part
def memory_of(run: Run) -> Any:
    return carray(run[AT.numbers], world_of(run).size, np.float64)


@part
def numbers_of(run: Run, which: int) -> Any:
    return carray(run[which], count_of(run, which), np.float64)


@part
def words_of(run: Run, which: int) -> Any:
    """A section of whole numbers."""
    return carray(run[which], count_of(run, which), np.int64)


@part
def rows_of(run: Run, which: int, rows: int, columns: int) -> Any:
    """A section of numbers in rows."""
    return carray(run[which], (rows, columns), np.float64)


@part
def joints_of(run: Run) -> Any:
    """The connectors of the joints, records JOINT, (n,)."""
    return carray(run[AT.joints], world_of(run).joints, JOINT)


@part
def coordinates_of(run: Run) -> Any:
    """Records COORDINATE, (c,); the first n are those of the joints."""
    return carray(run[AT.coordinates], world_of(run).coordinates, COORDINATE)


@part
def pairs_of(run: Run) -> Any:
    """Records PAIR of two coordinates, (c, c)."""
    return carray(run[AT.pairs], (world_of(run).coordinates, world_of(run).coordinates), PAIR)


@part
def states_of(run: Run) -> Any:
    """Where states, their rates and what shows them are, records STATE."""
    return carray(run[AT.states], count_of(run, AT.states), STATE)


@part
def calls_of(run: Run, which: int) -> Any:
    """The calls of a section, records CALL."""
    return carray(run[which], count_of(run, which), CALL)


@part
def guards_of(run: Run) -> Any:
    """What must not become negative, records GUARDED."""
    return carray(run[AT.guards], count_of(run, AT.guards), GUARDED)


@part
def log_changes(run: Run, t: float, log: Any, logged: int) -> int:
    """Write down the modes that have changed, as long as there is room; how many changes there are by now."""
    coordinates, undecided = coordinates_of(run), engine_of(run).undecided
    for i in range(len(coordinates)):
        one = coordinates[i]
        if one.dry.mode != one.before:
            _put_change(log, logged, t, i, one.before, one.dry.mode)
            logged += 1
    if undecided >= 0:
        _put_change(log, logged, t, undecided, 0, UNDECIDED)
        logged += 1
    return logged


@part
def _put_change(log: Any, at: int, t: float, coordinate: int, before: int, after: int) -> None:
    if at < len(log):
        change = log[at]
        change.time, change.coordinate, change.before, change.after = t, coordinate, before, after


@part
def call_law(run: Run, call: Any, t: float, h: float) -> None:
    own = memory_of(run).ctypes.data + 8 * call.own
    call_address(call.law, (t, h, own, call.count, run))


@part
def call_laws(run: Run, which: int, t: float, h: float) -> None:
    """Call the laws of a section in their order."""
    calls = calls_of(run, which)
    for k in range(len(calls)):
        call_law(run, calls[k], t, h)


@part
def call_equations(run: Run, address: int, t: float, h: float) -> None:
    """Call a part of the equations of motion, such as the engine's ``motion``."""
    call_address(address, (t, h, run))
