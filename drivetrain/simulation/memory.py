"""The memory of a run: one block of real numbers, one of whole ones, laid out for the compiled engines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetrain.arrays import Array
from drivetrain.effects import signals as named
from drivetrain.effects.effect import Compiled
from drivetrain.errors import Fault, InputError
from drivetrain.simulation import fields as f
from drivetrain.simulation.law_kernels import forces, motion
from drivetrain.simulation.shaping import Mechanics
from drivetrain.simulation.wiring import Directory, Group, Instance

Words = NDArray[np.int64]
GEAR = {named.GEAR_TORQUE.name, named.GEAR_DAMPING.name, named.GEAR_STIFFNESS.name}


@dataclass(frozen=True, eq=False)
class Memory:
    """What the engines work on.

    Attributes:
        numbers: Real numbers; the first ``kept`` of them are what changes from step to step.
        words: Whole numbers, the header first.
        kept: How many numbers a run must keep to go on later.
        places: Of each signal, by full name, in the signals.
        states: Of each state, by full name, in the state.
        powers: Names of the powers that are summed up, in their order.
        atol: Error that does not matter, one a state [its unit].
        memory: Whether a state is memory, which no rate changes, one a state; those that are come last.
    """

    numbers: Array
    words: Words
    kept: int
    places: dict[str, int]
    states: dict[str, int]
    powers: tuple[str, ...]
    atol: Array
    memory: NDArray[np.bool_]

    @property
    def moving(self) -> int:
        """How many states follow rates."""
        return int(len(self.memory) - self.memory.sum())


class _Block:
    """Numbers handed out one after another."""

    def __init__(self) -> None:
        self.parts: list[Any] = []
        self.size = 0

    def put(self, values: Any) -> int:
        """Place of some values, now at the end."""
        at, flat = self.size, np.ravel(np.asarray(values))
        self.parts.append(flat)
        self.size += flat.size
        return at


def signal_places(known: Directory, joints: Sequence[str], body: Mechanics) -> tuple[dict[str, int], dict[str, int]]:
    """Where each signal lies."""
    n, c, places = len(joints), body.c, {}
    shafts = () if body.coupled is None else body.coupled.shafts
    for field, signal in enumerate((*named.BEFORE, *named.AFTER)):
        for i, joint in enumerate(joints):
            places[f"{joint}.{signal.name}"] = field * n + i
    for i in shafts:
        places[f"{joints[i]}.{named.SHAFT_POSITION.name}"] = f.SHAFT_POSITION * n + i
        places[f"{joints[i]}.{named.SHAFT_SPEED.name}"] = f.SHAFT_SPEED * n + i
    borders = {"mass": f.FIELDS_GIVEN * n, "tip": f.FIELDS_GIVEN * n + c * c}
    places["scene.mass_matrix"] = borders["mass"]
    for k, signal in enumerate(named.TIP_GIVEN):
        places[signal.name] = borders["tip"] + k
    at = borders["energy"] = borders["tip"] + len(named.TIP_GIVEN)
    places[named.KINETIC_ENERGY.name], places[named.POTENTIAL_ENERGY.name] = at, at + 1
    at += 2
    for name in sorted({*known.givers, *known.defaults} - set(places)):
        places[name] = at
        at += 1
    borders["added"] = at
    for field, signal in enumerate(named.TAKEN):
        for i, joint in enumerate(joints):
            places[f"{joint}.{signal.name}"] = at + field * n + i
    for i in shafts:
        for field, signal in enumerate(named.SHAFT_TAKEN, f.SHAFT_TORQUE):
            places[f"{joints[i]}.{signal.name}"] = at + field * n + i
    at += f.FIELDS_TAKEN * n
    borders["tip_taken"] = at
    for k, signal in enumerate(named.TIP_TAKEN):
        places[signal.name] = at + k
    at += len(named.TIP_TAKEN)
    for name in sorted(set(known.adders) - set(places)):
        places[name] = at
        at += 1
    borders["end"] = at
    return places, borders


def state_places(instances: Sequence[Instance], body: Mechanics, joints: Sequence[str]) -> dict[str, int]:
    """Where each state lies: positions, deflections, speeds, then those of the effects, those that are memory last."""
    shafts = () if body.coupled is None else body.coupled.shafts
    kinds = ["shaft_" if i in shafts else "" for i in range(body.n)]
    states = {f"{joint}.{kinds[i]}position": i for i, joint in enumerate(joints)}
    states |= {f"{joints[i]}.deflection": int(body.motors[i]) for i in body.springs}
    states |= {f"{joint}.{kinds[i]}speed": body.c + i for i, joint in enumerate(joints)}
    states |= {f"{joints[i]}.shaft_speed": body.c + int(body.motors[i]) for i in body.springs}
    ranked = sorted(instances, key=lambda one: one.rank)
    for memory in (False, True):
        for one in ranked:
            for name, state in zip(one.states, one.ports.states, strict=True):
                if state.memory == memory:
                    states[name] = len(states)
    return states


def lay_out(
    groups: Sequence[Group], accounts: Sequence[Group], body: Mechanics, known: Directory, joints: Sequence[str]
) -> Memory:
    """Everything in its place."""
    instances = [one for group in groups for one in group.instances]
    places, borders = signal_places(known, joints, body)
    states = state_places(instances, body, joints)
    powers = tuple(sorted(known.powers))
    numbers, words, head = _Block(), _Block(), np.zeros(f.HEADER, dtype=np.int64)
    words.put(head)
    signals, c = np.zeros(borders["end"]), body.c
    for name, value in known.defaults.items():
        signals[places[name]] = value
    head[[f.JOINTS, f.COORDINATES, f.STATES, f.SIGNALS]] = body.n, c, len(states), len(signals)
    head[f.MOVING], head[f.KIND], head[f.SPINS] = len(states), body.kind, len(body.spins)
    head[f.AT_STATE], head[f.AT_RATES] = numbers.put(np.zeros(len(states))), numbers.put(np.zeros(len(states)))
    head[f.AT_SIGNALS], head[f.AT_ENERGIES] = numbers.put(signals), numbers.put(np.zeros(len(powers)))
    head[f.AT_VECTORS] = numbers.put(np.zeros(f.VECTORS * c))
    kept = numbers.size
    for place, values in (
        (f.AT_TURNED, np.zeros(c * c)), (f.AT_MATRIX, np.zeros(c * c)), (f.AT_REDUCED, np.zeros(c * c + c)),
        (f.AT_CARRIED, np.zeros(c * c)), (f.AT_LEVELS, np.zeros(f.LEVELS * c)), (f.AT_WORK, body.work),
        (f.AT_ROWS, body.rows), (f.AT_RATIOS, body.ratios), (f.AT_CONSTANT, body.constant),
        (f.AT_TIP, np.append(body.tip, np.zeros(f.TIP_NUMBERS - 16))), (f.AT_TRIED, np.zeros(6 * c)),
    ):  # fmt: skip
        head[place] = numbers.put(values)
    head[f.MOTION], head[f.FORCES], head[f.AT_THETA] = motion().address, forces().address, numbers.put([0.5])
    head[f.AT_SPARE] = numbers.put(np.zeros(len(states)))
    _couple(head, body, numbers, words)
    head[f.AT_WORK_ROWS], head[f.AT_ROW_COUNT] = len(body.work), len(body.rows)
    head[f.AT_SPINS], head[f.AT_MOTORS] = words.put(body.spins), words.put(body.motors)
    head[f.AT_MODES] = words.put(np.concatenate([np.zeros(c), np.ones(c), np.zeros(c)]).astype(np.int64))
    head[f.AT_MASS], head[f.ADDED_FROM], head[f.ADDED_TO] = borders["mass"], borders["added"], borders["end"]
    head[f.AT_TIP_SIGNALS], head[f.AT_TIP_TAKEN] = borders["tip"], borders["tip_taken"]
    head[f.TIP], head[f.AT_ENERGY_SIGNALS] = _uses_tip(instances), borders["energy"]
    shown = [(states[name], places[name]) for one in instances for name in one.states]
    head[f.AT_SHOWN], head[f.SHOWN] = words.put(np.array(shown, dtype=np.int64)), len(shown)
    head[f.POWERS] = len(powers)
    head[f.AT_POWERS] = words.put(np.array([places[name] for name in powers], dtype=np.int64))
    wiring = _Wiring(places, states, {id(one): _constants(one, numbers) for one in instances}, words)
    again = _repeated(groups, instances)
    laws = [_call(group, group.kind.compute, wiring) for group in groups if group.kind.compute and group not in again]
    bent = [_call(group, group.kind.compute, wiring) for group in again if group.kind.compute]
    telling = [_call(group, group.kind.account, wiring) for group in accounts if group.kind.account]
    _table(head, (f.COMPUTES, f.AT_COMPUTES), laws, words)
    _table(head, (f.REPEATS, f.AT_REPEATS), bent, words)
    _table(head, (f.ACCOUNTS, f.AT_ACCOUNTS), telling, words)
    _table(head, (f.SAMPLES, f.AT_SAMPLES), _sampled(groups, wiring, numbers), words)
    head[f.NUMBERS], head[f.WORDS] = numbers.size, words.size
    block = np.concatenate([part.astype(np.int64) for part in words.parts])
    block[: f.HEADER] = head
    return Memory(
        np.concatenate(numbers.parts), block, kept, places, states, powers, *_tolerances(instances, states, c)
    )


@dataclass(frozen=True, eq=False)
class _Wiring:
    """Places of signals, states, and each effect's constants; where whole numbers go."""

    places: dict[str, int]
    states: dict[str, int]
    constants: dict[int, int]
    words: _Block


def _constants(one: Instance, numbers: _Block) -> int:
    constants = np.array(one.effect.numbers(one.place), dtype=np.float64)
    if np.isnan(constants).any():
        raise InputError(
            Fault(one.title, f"has a constant that is no number, number {int(np.isnan(constants).argmax())}")
        )
    return numbers.put(constants)


def _call(group: Group, law: Compiled, wiring: _Wiring) -> list[int]:
    """Address of a law, and place of its rows."""
    rows = [
        [wiring.constants[id(one)], *(wiring.states[name] for name in one.states),
         *(wiring.places[name] for name in (*one.needs, *one.provides, *one.contributes, *one.outputs))]
        for one in group.instances
    ]  # fmt: skip
    longest = max(len(row) for row in rows)
    padded = [row + [0] * (longest - len(row)) for row in rows]
    return [law.address, wiring.words.put(np.array([len(rows), longest, *chain.from_iterable(padded)], dtype=np.int64))]


def _sampled(groups: Sequence[Group], wiring: _Wiring, numbers: _Block) -> list[list[int]]:
    """Calls of sampled effects, one for each period: address, rows, place of the period, samples taken."""
    calls = []
    for group in groups:
        if group.kind.sample is None:
            continue
        for period in sorted({one.effect.period or 0.0 for one in group.instances} - {0.0}):
            members = tuple(one for one in group.instances if one.effect.period == period)
            calls.append([*_call(Group(group.kind, members), group.kind.sample, wiring), numbers.put([period]), 0])
    return calls


def _couple(head: Words, body: Mechanics, numbers: _Block, words: _Block) -> None:
    """What the tip carries, and how coupled motors turn with the joints."""
    head[f.PAYLOADS], head[f.AT_PAYLOADS] = len(body.payloads), numbers.put(body.payloads)
    bound = body.coupled
    if bound is None:
        return
    size = len(bound.spread)
    head[f.COUPLED], head[f.BODIES] = len(bound.shafts), size
    head[f.AT_TURNS], head[f.AT_SPREAD] = numbers.put(bound.turns), numbers.put(bound.spread)
    # Places, speeds, bias and the part of it that motors feel; matrix, the same part of it, and what goes between.
    head[f.AT_BODIES] = numbers.put(np.zeros(size * (4 + 2 * size + body.c)))
    head[f.AT_FACTORS], head[f.AT_OWN] = numbers.put(bound.factors), numbers.put(bound.own)
    flags = np.zeros(body.n, dtype=np.int64)
    flags[list(bound.shafts)] = 1
    head[f.AT_BOUND], head[f.AT_FELT] = words.put(flags), words.put(bound.felt)


def _repeated(groups: Sequence[Group], instances: Sequence[Instance]) -> list[Group]:
    """Effects between gear and link or at the tip, where any of them bends within a step; else none.

    They are asked again with what the step has come to, so they alone may set what they set, and nobody else may need
    it.
    """
    if not any(one.effect.piecewise() for one in instances):
        return []
    own = {signal.name for signal in named.TIP_TAKEN}
    own |= {name for one in instances for name in one.contributes if name.rpartition(".")[2] in GEAR}
    again = [group for group in groups if any(name in own for one in group.instances for name in one.contributes)]
    members = [one for group in again for one in group.instances]
    fit = all(set(one.contributes) <= own and not one.provides and not one.states for one in members)
    return again if fit and not any(name in own for one in instances for name in one.needs) else []


def _table(head: Words, where: tuple[int, int], calls: Sequence[Sequence[int]], words: _Block) -> None:
    head[where[0]], head[where[1]] = len(calls), words.put(np.array(calls, dtype=np.int64))


def _tolerances(instances: Sequence[Instance], states: Mapping[str, int], c: int) -> tuple[Array, NDArray[np.bool_]]:
    """Errors that do not matter, and which states are memory."""
    atol, memory = np.full(len(states), 1e-7), np.zeros(len(states), dtype=np.bool_)
    atol[c : 2 * c] = 1e-6
    for one in instances:
        for state, name in zip(one.ports.states, one.states, strict=True):
            atol[states[name]], memory[states[name]] = state.atol, state.memory
    return atol, memory


def _uses_tip(instances: Sequence[Instance]) -> int:
    """Whether any effect looks at the tip or acts on it."""
    names = {signal.name for signal in (*named.TIP_GIVEN, *named.TIP_TAKEN)}
    return int(any(name in names for one in instances for name in (*one.needs, *one.contributes)))
