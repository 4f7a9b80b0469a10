"""Layout of the memory of a run: one block of numbers with the records of ``records.py`` and of every effect.

Which numbers are states, rates, powers or recorded columns follows from the names of the records' fields.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import MISSING, dataclass, fields, is_dataclass
from functools import cache, cached_property
from typing import Any, get_type_hints

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.effects import signals as named
from drivetrain.effects.connectors import JOINT, WORLD, place_in
from drivetrain.effects.laws import HEAD, own_type
from drivetrain.errors import Fault, InputError
from drivetrain.records import fill, record_type
from drivetrain.simulation.core import equations
from drivetrain.simulation.core import records as r
from drivetrain.simulation.core.loops import loop_bodies
from drivetrain.simulation.planning.mechanics import Mechanics
from drivetrain.simulation.planning.wiring import Directory, Group, Instance, in_fixed_order, uses_tip

ENERGIES = (named.KINETIC_ENERGY, named.POTENTIAL_ENERGY)
SCENE_SIGNALS = (*named.TIP_GIVEN, *named.TIP_TAKEN, *ENERGIES, named.PAYLOAD_ENERGY)
# Offset of each signal in the connectors of a joint, and of the scene.
JOINT_OFFSETS = {signal.name: int(place_in(JOINT, signal.path) or 0) for signal in named.JOINT_SIGNALS}
SCENE_OFFSETS = {signal.name: int(place_in(WORLD, signal.path) or 0) for signal in SCENE_SIGNALS}
SPRING = {named.GEAR_TORQUE.name, named.GEAR_DAMPING.name, named.GEAR_STIFFNESS.name}
INTEGERS: Any = np.int64


@dataclass(frozen=True, eq=False)
class Memory:
    """The memory of a run, with indices of all that has a name."""

    numbers: Array  # the block before the start
    places: dict[str, int]  # index of each signal in the block, by full name
    states: dict[str, int]  # index of each state among the states, by full name
    powers: tuple[str, ...]  # names of the powers that are integrated, in order
    atol: Array  # absolute tolerance of each state [its unit]
    memory: NDArray[np.bool_]  # whether a state is memory, which has no rate; such states come last
    sections: dict[str, tuple[int, Any, int]]  # first index, record type and size in numbers of each section, by name
    # parts of the block that a run changes: first index, size, and which numbers of a record change
    kept: list[tuple[int, int, Any]]

    @cached_property
    def changing(self) -> NDArray[np.bool_]:
        """Whether each number of the block changes during a run and must be kept to resume it."""
        found = np.zeros(len(self.numbers), dtype=np.bool_)
        for first, size, mask in self.kept:
            found[first : first + size] = np.resize(mask, size)
        return found

    @property
    def moving(self) -> int:
        """Number of states that have rates."""
        return int(len(self.memory) - self.memory.sum())

    def view(self, numbers: Array, section: str) -> Any:
        """A section of a block with this layout, as records or numbers."""
        first, dtype, size = self.sections[section]
        return numbers[first : first + size].view(dtype)

    def places_of(self, section: str, field: str) -> NDArray[np.int64]:
        """Indices of a field of all records of a section in the block."""
        first, dtype, size = self.sections[section]
        width = dtype.itemsize // 8
        return np.arange(first + int(place_in(dtype, field) or 0), first + size, width, dtype=np.int64)


class _Block:
    """A block under construction: sections are appended one after another."""

    def __init__(self) -> None:
        self.parts: list[Array] = []
        self.kept: list[tuple[int, int, Any]] = []
        self.sections: dict[str, tuple[int, Any, int]] = {}
        self.size = 0

    def put(self, values: Any, changing: Any, name: str = "") -> int:
        """Append values or records; returns the index of their first number.

        ``changing`` tells which numbers a run changes: True, False, or a mask for the numbers of one record.
        """
        flat, at = np.ascontiguousarray(values).reshape(-1), self.size
        dtype, block = flat.dtype, flat.view(np.float64)
        self.parts.append(block)
        if changing is not False:
            self.kept.append((at, len(block), changing))
        if name:
            self.sections[name] = (at, dtype, len(block))
        self.size += len(block)
        return at


@cache
def changing_numbers(described: type) -> list[bool]:
    """A mask of the numbers of a dataclass's record that a run changes: the fields with a default, recursively."""
    hints, record, found = get_type_hints(described), record_type(described, INTEGERS), []
    for field in (one for one in fields(described) if one.name in record.names):
        inner = record[field.name]
        if is_dataclass(hints[field.name]):
            found += changing_numbers(hints[field.name])  # type: ignore[arg-type]
        else:
            kept = field.default is not MISSING or field.default_factory is not MISSING
            found += [kept] * (inner.itemsize // 8)
    return found


@dataclass(frozen=True, eq=False)
class _Indices:
    """Indices in the block, by full name."""

    signals: dict[str, int]
    states: dict[str, tuple[int, int]]  # of value and rate; -1: no rate
    records_at: dict[int, int]  # of the first number of each effect's record, by id of its instance


def lay_out(
    groups: Sequence[Group], accounts: Sequence[Group], body: Mechanics, known: Directory, joints: Sequence[str]
) -> Memory:
    """Lay out the memory of a run; ``groups`` and ``accounts`` are the effects in the order of their laws."""
    instances = [one for group in groups for one in group.instances]
    block, n = _Block(), body.n
    block.put(np.zeros(1, WORLD), True, "world")
    block.put(np.zeros(1, r.ENGINE), False, "engine")
    block.put(np.zeros(len(r.SECTIONS) + len(instances), r.SECTION), False, "sections")
    block.put(np.zeros(n, JOINT), True, "joints")
    _put_mechanics(block, body)
    placed, powers = _put_effects(block, groups, joints), tuple(sorted(known.powers))
    signals, states = placed.signals, _mechanical_states(block, body, joints)
    block.put(np.array([signals[name] for name in powers], INTEGERS), False, "powers")
    energies = block.put(np.zeros(len(powers)), True, "energies")
    # States of effects after those of the mechanics, memory last; an output row holds them as the connectors show them.
    declared = [pair for one in in_fixed_order(instances) for pair in zip(one.states, one.ports.states, strict=True)]
    declared.sort(key=lambda pair: pair[1].memory)
    columns = [value for value, _ in states.values()] + [signals[name] for name, _ in declared]
    states |= {name: placed.states[name] for name, _ in declared}
    records = np.zeros(len(states), r.STATE)
    records["value"], records["rate"] = np.array(list(states.values())).T
    records["shown"] = np.where(records["value"] == columns, -1, columns)
    block.put(records, [False, False, False, True], "states")
    again = _iterated_effects(groups, instances)
    once = [group for group in groups if group not in again]
    for name, listed, law in (("computes", once, "compute"), ("iterated", again, "compute"),
                              ("accounts", accounts, "account"), ("accepts", accounts, "accept")):  # fmt: skip
        block.put(_calls([(group, 0.0) for group in listed if getattr(group.kind, law)], law, placed), False, name)
    block.put(_calls(list(_sampled(groups)), "sample", placed), [False] * 4 + [True], "samples")
    block.put(_guards(instances, placed), False, "guards")
    columns += [*(signals[name] for name in recorded_signals(signals, known)), *range(energies, energies + len(powers))]
    block.put(np.array(columns, INTEGERS), False, "columns")
    numbers, c = np.concatenate(block.parts), body.c
    made = Memory(
        numbers, signals, {name: k for k, name in enumerate(states)}, powers,
        np.array([1e-7] * c + [1e-6] * c + [state.atol for _, state in declared]),
        np.array([False] * (2 * c) + [state.memory for _, state in declared]), block.sections, block.kept,
    )  # fmt: skip
    _fill_world_and_engine(made, body, instances)
    for name in known.defaults.keys() & signals.keys():  # what no connector has, no law can read
        numbers[signals[name]] = known.defaults[name]
    return made


def _put_mechanics(block: _Block, body: Mechanics) -> None:
    """Append the constants and the working memory of the equations of motion."""
    n, c, size = body.n, body.c, len(body.spread)
    coordinates = np.zeros(c, r.COORDINATE)
    coordinates["link"][:n], coordinates["motor"][:n] = body.loads, body.motors
    coordinates["ratio"][:n], coordinates["zero"][:n] = body.ratios, body.zeros
    for name, row in zip(("inertia", "weight", "phase", "rotor"), body.constant, strict=True):
        coordinates[name] = row
    coordinates["dry"]["load_sign"] = 1
    coordinates["coupled"][list(body.shafts)] = 1
    coordinates["rotor_row"], coordinates["shaft_inertia"] = body.rotor_row, body.shaft_inertia
    block.put(coordinates, changing_numbers(r.Coordinate), "coordinates")
    block.put(np.zeros((c, c), r.PAIR), False, "pairs")
    block.put(np.zeros((c, c)), True, "mass")
    block.put(body.links, False, "links")
    block.put(body.spinning, False, "rotors")
    block.put(body.bodies, False, "bodies")
    block.put(body.payloads, False, "payloads")
    block.put(np.zeros((0, n)) if body.coupled is None else body.coupled.turns, False, "turns")
    block.put(body.spread, False, "spread")
    for name in ("body_places", "body_speeds", "body_bias", "body_rotor_bias"):
        block.put(np.zeros(size), False, name)
    for name in ("body_mass", "body_rotor_mass"):
        block.put(np.zeros((size, size)), False, name)
    block.put(np.zeros((size, c)), False, "between")
    if body.loops is not None:
        body.loops.put(block.put)


def _connectors(block: _Block, joints: Sequence[str]) -> dict[str, int]:
    """Indices of the signals of the connectors, by full name."""
    first, size = block.sections["joints"][0], JOINT.itemsize // 8
    places = {
        f"{joint}.{name}": first + i * size + at for name, at in JOINT_OFFSETS.items() for i, joint in enumerate(joints)
    }
    return places | SCENE_OFFSETS | {"scene.mass_matrix": block.sections["mass"][0]}


def _put_effects(block: _Block, groups: Sequence[Group], joints: Sequence[str]) -> _Indices:
    """Append the records and tables of all effects."""
    places, states, records_at, tables = _connectors(block, joints), {}, {}, 0
    for group in groups:
        described = group.kind.described()
        if described is None:
            continue
        dtype = own_type(described)
        owned = np.zeros(len(group.instances), dtype)
        fill(owned, [_checked(one) for one in group.instances], (dtype.names or ())[len(HEAD) :])
        for record, one in zip(owned, group.instances, strict=True):
            table = np.asarray(one.effect.table(one.place), dtype=np.float64)
            record["joint"] = one.place.joint
            if table.size:
                record["rows"], record["columns"] = table.shape
                record["table"], tables = len(r.SECTIONS) + tables, tables + 1
                block.put(table, False, f"table {tables}")
        at = block.put(owned, [False] * len(HEAD) + changing_numbers(described))
        for k, one in enumerate(group.instances):
            own = records_at[id(one)] = at + k * dtype.itemsize // 8
            written = (*one.ports.provides, *one.ports.outputs)
            for name, signal in zip((*one.provides, *one.outputs), written, strict=True):
                if name not in places:
                    places[name] = own + _field(one, dtype, signal.path or signal.name)
            for name, state in zip(one.states, one.ports.states, strict=True):
                path = state.path or state.name
                value = own + _field(one, dtype, path)
                states[name] = value, -1 if state.memory else own + _field(one, dtype, f"{path}_rate")
                places.setdefault(name, value)
    return _Indices(places, states, records_at)


def _field(one: Instance, dtype: Any, path: str) -> int:
    """Offset of a field in an effect's record."""
    found = place_in(dtype, path)
    if found is None:
        raise InputError(Fault(one.title, f"keeps nothing of the name {path}", hint="name the field by its path"))
    return found


def _checked(one: Instance) -> Any:
    """The record of an effect; InputError if one of its constants is NaN."""
    own = one.effect.own(one.place)
    for field in fields(own):
        value = getattr(own, field.name)
        if isinstance(value, float) and np.isnan(value):
            raise InputError(Fault(one.title, f"has a constant that is no number, {field.name}"))
    return own


def _mechanical_states(block: _Block, body: Mechanics, joints: Sequence[str]) -> dict[str, tuple[int, int]]:
    """The states of the mechanics (positions and wind-ups, then speeds): indices of value and rate, by full name."""
    first, size = block.sections["coordinates"][0], r.COORDINATE.itemsize // 8
    kinds = ["shaft_" if i in body.shafts else "" for i in range(body.n)]
    found: dict[str, tuple[int, int]] = {}
    for what, of_motor in (("position", "deflection"), ("speed", "shaft_speed")):
        value, rate = (int(place_in(r.COORDINATE, name) or 0) for name in (what, f"{what}_rate"))
        own = {k: f"{joints[k]}.{kinds[k]}{what}" for k in range(body.n) if body.loads[k] == k}
        own |= {int(body.motors[i]): f"{joints[i]}.{of_motor}" for i in body.springs}
        found |= {own[k]: (first + k * size + value, first + k * size + rate) for k in sorted(own)}
    return found


def _calls(listed: Iterable[tuple[Group, float]], law: str, placed: _Indices) -> Any:
    """Records CALL of a law; consecutive records of one kind share a call. ``listed`` gives sampling periods [s]."""
    rows: list[list[Any]] = []
    last: Any = None
    for group, period in listed:
        size = own_type(group.kind.described()).itemsize // 8
        for own in (placed.records_at[id(one)] for one in group.instances):
            if rows and last == (group, own - size):
                rows[-1][2] += 1
            else:
                rows.append([getattr(group.kind, law).address, own, 1, period, 0])
            last = group, own
    return np.array([tuple(row) for row in rows], r.CALL)


def _guards(instances: Sequence[Instance], placed: _Indices) -> Any:
    """Records GUARDED of the effects that have a guard."""
    rows = []
    for one in instances:
        if one.ports.guard:
            dtype, own = own_type(one.effect.described()), placed.records_at[id(one)]
            rows.append((own + _field(one, dtype, one.ports.guard), type(one.effect).accept.address, own, 1))  # type: ignore[union-attr]
    return np.array(rows, r.GUARDED)


def _sampled(groups: Sequence[Group]) -> Iterable[tuple[Group, float]]:
    """Sampled effects, grouped by kind and period [s]."""
    for group in groups:
        if group.kind.sample is not None:
            for period in sorted({one.effect.period or 0.0 for one in group.instances} - {0.0}):
                yield Group(group.kind, tuple(one for one in group.instances if one.effect.period == period)), period


def _iterated_effects(groups: Sequence[Group], instances: Sequence[Instance]) -> list[Group]:
    """The effects that are evaluated in every Newton iteration of a step: springs of gears, and contacts at the tip.

    Empty if none of them is piecewise. Since they are evaluated again on their own, they may only contribute to these
    torques and forces, no other effect may read them, and they may have no states; otherwise they are not iterated.
    """
    if not any(one.effect.piecewise() for one in instances):
        return []
    own = {signal.name for signal in named.TIP_TAKEN}
    own |= {name for one in instances for name in one.contributes if name.rpartition(".")[2] in SPRING}
    again = [group for group in groups if any(name in own for one in group.instances for name in one.contributes)]
    members = [one for group in again for one in group.instances]
    fit = all(set(one.contributes) <= own and not one.provides and not one.states for one in members)
    return again if fit and not any(name in own for one in instances for name in one.needs) else []


def recorded_signals(places: Mapping[str, int], known: Directory) -> list[str]:
    """Names of the signals that are recorded: no sums without contributions, no defaults without a provider.

    In this order: signals of the mechanics, signals that effects provide, contributions to the mechanics, to effects.
    """
    shown = (*named.BEFORE, *named.AFTER, *named.SHAFT_GIVEN, *named.TIP_GIVEN, *ENERGIES)
    taken = (*named.TAKEN, *named.SHAFT_TAKEN, *named.TIP_TAKEN)
    rank = {signal.name: (0, k, "") for k, signal in enumerate(shown)}
    rank |= {signal.name: (2, k, "") for k, signal in enumerate(taken)}

    def order(name: str) -> tuple[int, int, str]:
        own = name if name.startswith("scene.") else name.rpartition(".")[2]
        return rank.get(own) or (3 if name in known.contributors else 1, 0, name)

    wanted = [
        name for name in places
        if name in known.units and name != "scene.mass_matrix"
        and not (name in known.contributors and not known.contributors[name])
        and not (name in known.defaults and name not in known.providers)
    ]  # fmt: skip
    return sorted(wanted, key=order)


def _fill_world_and_engine(made: Memory, body: Mechanics, instances: Sequence[Instance]) -> None:
    """Fill the records WORLD and ENGINE, and the list of sections."""
    numbers, sections = made.numbers, made.sections
    world, engine = made.view(numbers, "world")[0], made.view(numbers, "engine")[0]
    world["size"], world["joints"], world["coordinates"] = len(numbers), body.n, body.c
    engine["uses_tip"] = uses_tip(instances)
    engine["arm"] = body.arm is not None
    engine["coupled"], engine["looped"] = body.coupled is not None, body.loops is not None
    engine["direct"], engine["last"] = body.coupled is None and body.loops is None, body.last
    engine["bodies"] = len(made.view(numbers, "body_bias"))
    engine["theta"], engine["moving"] = 0.5, made.moving
    engine["late"] = any(state.late for one in instances for state in one.ports.states)
    bodies = equations.bodies if body.loops is None else loop_bodies
    laws = {"motion": equations.motion, "forces": equations.forces, "bodies_law": bodies}
    for name, law in (laws | {"friction_law": equations.friction, "uniqueness_law": equations.uniqueness}).items():
        engine[name] = equations.equation(law).address
    engine["tip_offset"] = body.tip[:3, 3]
    listed, tables = made.view(numbers, "sections"), [name for name in sections if name.startswith("table ")]
    for k, name in enumerate((*r.SECTIONS, *tables)):
        if name in sections:
            first, dtype, size = sections[name]
            listed[k] = first, size, 8 * size // dtype.itemsize
