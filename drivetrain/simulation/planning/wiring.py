"""The signals of a scene with the effects that set them, and the order in which the effects are evaluated."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from itertools import groupby, pairwise

from drivetrain.effects import signals as named
from drivetrain.effects.effect import Effect, Place, Ports, Role, Signal, State
from drivetrain.errors import Fault, InputError, nearest, raise_faults


@dataclass(frozen=True, eq=False)
class Instance:
    """One effect at one place, with the full names of its signals."""

    effect: Effect  # the effect
    place: Place  # its joint, or the scene
    ports: Ports  # its signals, with their local names
    # their full names, in the same order
    states: tuple[str, ...]
    needs: tuple[str, ...]
    provides: tuple[str, ...]
    contributes: tuple[str, ...]
    outputs: tuple[str, ...]

    @property
    def title(self) -> str:
        """Its name in messages."""
        return f"{type(self.effect).__name__} of {self.place.name}"


@dataclass(frozen=True, eq=False)
class Group:
    """Effects of one kind that are evaluated by one call."""

    kind: type[Effect]  # their class
    instances: tuple[Instance, ...]  # in the order of their joints


@dataclass
class Directory:
    """All signals of a scene by full name, with the effects that set them."""

    units: dict[str, str] = field(default_factory=dict)  # unit of each signal
    providers: dict[str, str] = field(default_factory=dict)  # the effect that provides it, or ``motion and forces``
    contributors: dict[str, list[str]] = field(default_factory=dict)  # the effects that contribute to it
    defaults: dict[str, float] = field(default_factory=dict)  # values of needed signals that no effect provides
    powers: dict[str, Role] = field(default_factory=dict)  # role of each power [W]
    stores: list[str] = field(default_factory=list)  # names of the stored energies [J]


MECHANICS = "motion and forces"  # name of the mechanics as the provider of a signal
# Local names of the signals that the mechanics reads.
MECHANICAL = {signal.name.rpartition(".")[2] for signal in (*named.TAKEN, *named.SHAFT_TAKEN, *named.TIP_TAKEN)}


def full_name(name: str, place: Place) -> str:
    """Full name of a signal in a scene, from its local name at a place."""
    if name.startswith("scene."):
        return name
    joint, colon, own = name.rpartition(":")
    return f"{joint}.{own}" if colon else f"{place.name}.{name}"


def instance(effect: Effect, place: Place) -> Instance:
    """An effect at a place, with the full names of its signals."""
    ports = effect.ports(place)

    def names(signals: Iterable[Signal]) -> tuple[str, ...]:
        return tuple(full_name(signal.name, place) for signal in signals)

    states = tuple(full_name(state.name, place) for state in ports.states)
    written = names(ports.provides), names(ports.contributes), names(ports.outputs)
    return Instance(effect, place, ports, states, names(ports.needs), *written)


def in_fixed_order(instances: Iterable[Instance]) -> list[Instance]:
    """Effects in an order that does not depend on that of their declaration: by kind, joint, then parameters."""

    def rank(one: Instance) -> tuple[str, int]:
        return type(one.effect).__name__, one.place.joint

    groups = [list(same) for _, same in groupby(sorted(instances, key=rank), rank)]
    return [one for same in groups for one in (sorted(same, key=lambda x: repr(x.effect)) if len(same) > 1 else same)]


# Unit at a prismatic joint for each unit at a revolute joint.
PRISMATIC_UNITS = {"rad": "m", "rad/s": "m/s", "rad/s^2": "m/s^2", "N m": "N", "N m s/rad": "N s/m", "N m/rad": "N/m"}


def unit_at(unit: str, turning: bool) -> str:
    """The SI unit of a joint's quantity, at a revolute (``turning``) or a prismatic joint."""
    return unit if turning else PRISMATIC_UNITS.get(unit, unit)


# Signals at the motor's shaft, which rotates at prismatic joints too.
MOTOR_SIDE = {
    "motor_position", "motor_speed", "motor_acceleration", "motor_torque", "motor_damping", "motor_stiffness",
    "motor_friction", *(signal.name for signal in named.TAKEN if signal.name.startswith("motor_")),
}  # fmt: skip


def uses_tip(instances: Sequence[Instance]) -> bool:
    """Whether any effect reads the motion of the tip or acts on it."""
    of_tip = {signal.name for signal in (*named.TIP_GIVEN, *named.TIP_TAKEN)}
    return any(of_tip.intersection((*one.needs, *one.contributes)) for one in instances)


def directory(instances: Sequence[Instance], place: Place, flexible: Sequence[bool]) -> Directory:
    """All signals of a scene; ``flexible`` tells which joints have a spring.

    InputError for signals that nothing provides or that are set twice, and for contradictory units or defaults.
    """
    known, faults = Directory(), list[Fault]()
    every = [
        *((signal, False) for signal in (*named.BEFORE, *named.AFTER)),
        *((signal, True) for signal in named.TAKEN),
    ]
    tip = uses_tip(instances)  # otherwise its motion is not computed
    for index, joint in enumerate(place.joints):
        for signal, taken in every:
            if signal.name.startswith(("deflection", "gear_")) and not flexible[index]:
                continue
            if signal is named.TIP_TORQUE and not tip:
                continue
            own = signal.name in MOTOR_SIDE
            name = f"{joint}.{signal.name}"
            known.units[name] = signal.unit if own else unit_at(signal.unit, place.turning[index])
            if taken:
                known.contributors[name] = []
            else:
                known.providers[name] = MECHANICS
        if index in place.shafts:
            for signal in (*named.SHAFT_GIVEN, *named.SHAFT_TAKEN):
                known.units[f"{joint}.{signal.name}"] = signal.unit
            known.providers |= {f"{joint}.{signal.name}": MECHANICS for signal in named.SHAFT_GIVEN}
            known.contributors |= {f"{joint}.{signal.name}": [] for signal in named.SHAFT_TAKEN}
        for power in (named.JOINT_FRICTION_POWER, named.MOTOR_FRICTION_POWER, named.MESH_POWER):
            known.powers[f"{joint}.{power.name}"] = Role.LOSS
    known.units["scene.mass_matrix"], known.providers["scene.mass_matrix"] = "kg m^2", MECHANICS
    for signal in (named.KINETIC_ENERGY, named.POTENTIAL_ENERGY, *(named.TIP_GIVEN if tip else ())):
        known.units[signal.name], known.providers[signal.name] = signal.unit, MECHANICS
    for signal in named.TIP_TAKEN:
        known.units[signal.name], known.contributors[signal.name] = signal.unit, []
    for one in instances:
        _add_signals(one, known, faults)
    for one in instances:
        for signal, name in zip(one.ports.needs, one.needs, strict=True):
            if name in known.providers or name in known.contributors:
                continue
            if signal.default is None:
                hint = nearest(name, list(known.units)) or f"add an effect that gives {name}"
                faults.append(Fault(one.title, f"needs {name} [{signal.unit}], which nothing gives", None, hint))
            elif known.defaults.setdefault(name, signal.default) != signal.default:
                problem = f"needs {name} with another default than others: give it by an effect"
                faults.append(Fault(one.title, problem, signal.default))
            known.units.setdefault(name, signal.unit)
    raise_faults([*faults, *_unread_faults(instances, known)])
    return known


def _unread_faults(instances: Sequence[Instance], known: Directory) -> list[Fault]:
    """Faults of effects whose contributions nothing reads, such as the loop of a joint without a motor.

    An effect that has a share in the mechanics does something without them.
    """
    read = {name for one in instances for name in one.needs}
    read |= {name for name in known.contributors if name.rpartition(".")[2] in MECHANICAL}
    hint = "add the effect that reads it, such as MotorCurrent for a current command; or leave this one out"
    return [
        Fault(one.title, f"has no effect, since nothing reads {one.contributes[0]}", None, hint)
        for one in instances
        if one.contributes and not read & set(one.contributes) and type(one.effect).shape is Effect.shape
    ]


def _add_signals(one: Instance, known: Directory, faults: list[Fault]) -> None:
    slides = one.place.joint >= 0 and not one.place.turning[one.place.joint]
    written: tuple[State | Signal, ...] = (*one.ports.states, *one.ports.provides, *one.ports.outputs)
    for signal, name in zip(written, (*one.states, *one.provides, *one.outputs), strict=True):
        if name in known.providers or name in known.contributors:
            who = known.providers.get(name) or ", ".join(known.contributors[name]) or MECHANICS
            faults.append(Fault(one.title, f"sets {name}, which {who} sets already"))
            continue
        unit, (joint, _, what) = signal.unit, name.rpartition(".")
        if what.startswith("command_") and joint in one.place.joints:
            unit = unit_at(unit, one.place.turning[one.place.joints.index(joint)])
        known.units[name], known.providers[name] = unit, one.title
    for signal, name in zip(one.ports.contributes, one.contributes, strict=True):
        if name in known.providers:
            faults.append(Fault(one.title, f"adds to {name}, which {known.providers[name]} alone sets"))
            continue
        own = known.units.setdefault(name, signal.unit)
        if own != signal.unit and not (slides and own == unit_at(signal.unit, False)):
            faults.append(Fault(one.title, f"adds to {name} in {signal.unit}; it is in {own}"))
        known.contributors.setdefault(name, []).append(one.title)
    for signal, name in zip(one.ports.outputs, one.outputs, strict=True):
        if signal.role is Role.STORE:
            known.stores.append(name)
        elif signal.role is not None:
            known.powers[name] = signal.role


def ordered(instances: Sequence[Instance], *, outputs: bool = False) -> list[Group]:
    """The effects in groups, each after all effects that set the signals that it needs; InputError if they need one
    another in a loop.

    ``outputs``: the order of their ``account`` laws, which set the outputs, instead of ``compute``.
    """
    sets: dict[str, list[Instance]] = {}
    for one in instances:
        for name in one.outputs if outputs else (*one.provides, *one.contributes):
            sets.setdefault(name, []).append(one)
    before = {
        id(one): {id(giver) for name in one.needs for giver in sets.get(name, ()) if giver is not one}
        for one in instances
    }
    left, groups = list(instances), []
    done: set[int] = set()
    while left:
        ready = [one for one in left if before[id(one)] <= done]
        if not ready:
            raise InputError(Fault("effects", _loop(left, before, sets), hint="a state in between breaks a loop"))
        kinds = {type(one.effect) for one in ready}
        waiting = {type(one.effect) for one in left if before[id(one)] - done}
        kind = min(kinds - waiting or kinds, key=lambda one: one.__name__)
        members = tuple(one for one in ready if type(one.effect) is kind)
        groups.append(Group(kind, members))
        done |= {id(one) for one in members}
        left = [one for one in left if id(one) not in done]
    return groups


def _loop(left: list[Instance], before: dict[int, set[int]], sets: dict[str, list[Instance]]) -> str:
    """A loop among the effects that are left, described for the message."""
    by_id = {id(one): one for one in left}
    path = [left[0]]
    while True:
        one = next(by_id[key] for key in sorted(before[id(path[-1])], key=lambda k: str(k)) if key in by_id)
        if one in path:
            path = [*path[path.index(one) :], one]
            break
        path.append(one)
    links = []
    for needy, giver in pairwise(path):
        name = next(name for name in needy.needs if giver in sets.get(name, ()))
        links.append(f"{needy.title} needs {name} of {giver.title}")
    return "need one another in a loop: " + "; ".join(links)
