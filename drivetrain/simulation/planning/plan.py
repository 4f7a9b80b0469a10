"""The plan of a scene: which laws are evaluated in which order from which signals; printed, it documents the run."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from html import escape
from itertools import chain

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array
from drivetrain.effects.effect import Place, Role, TimeScale
from drivetrain.effects.signals import (
    JOINT_HOLD_FORWARD,
    KINETIC_ENERGY,
    MESH_DRIVING,
    MOTOR_HOLD_FORWARD,
    PAYLOAD_ENERGY,
    POTENTIAL_ENERGY,
    SURFACE_SPEED,
    TIP_TAKEN,
)
from drivetrain.errors import Fault, InputError, raise_faults
from drivetrain.simulation.core import equations
from drivetrain.simulation.planning.mechanics import Mechanics, coupling_of, mechanics, ratios_of
from drivetrain.simulation.planning.memory import Memory, lay_out, recorded_signals
from drivetrain.simulation.planning.wiring import (
    MECHANICS,
    Directory,
    Group,
    Instance,
    directory,
    in_fixed_order,
    instance,
    ordered,
    unit_at,
)
from drivetrain.simulation.scene import WHOLE, Scene


@dataclass(frozen=True, eq=False)
class Layout:
    """The columns of a run's output rows: time, states, signals, energies."""

    columns: tuple[tuple[str, str], ...]  # names and units of all columns after the time
    recorded: dict[str, tuple[int, str]]  # column (that of the time is 0) and unit of each recorded series, by name
    stores: tuple[str, ...]  # names of all stored energies
    # names of the integrals of powers, with 1 for a source and -1 for a loss
    flows: tuple[tuple[str, float], ...]

    def energies(self, rows: Array) -> tuple[Array, Array, float, float]:
        """The energy balance of output rows.

        Returns the stored energy and that minus the energy supplied, (N,) each, the largest range of a stored or
        supplied energy, and the largest stored energy [J].
        """
        stored = rows[:, [self.recorded[name][0] for name in self.stores]]
        moved = rows[:, [self.recorded[name][0] for name, _ in self.flows]]
        passed = max(np.ptp(stored, axis=0).max(), np.ptp(moved, axis=0).max(initial=0.0))
        total = sum(stored.T, start=np.zeros(len(rows)))
        # Column by column, since the rounding of a matrix product depends on the number of rows.
        left = total - sum((sign * one for one, (_, sign) in zip(moved.T, self.flows, strict=True)), start=0.0 * total)
        return total, left, float(passed), float(np.abs(stored).max())


def layout_of(memory: Memory, signals: Directory, units: Mapping[str, str]) -> Layout:
    """The columns of a run's output rows, from its memory and signals."""
    states = [(name, units[name]) for name in memory.states]
    shown = [(name, signals.units[name]) for name in recorded_signals(memory.places, signals)]
    columns = (*states, *shown, *((energy_of(name), "J") for name in memory.powers))
    recorded: dict[str, tuple[int, str]] = {}
    for index, (name, unit) in enumerate(columns, 1):
        recorded.setdefault(name, (index, unit))
    flows = tuple((energy_of(name), 1.0 if role is Role.SOURCE else -1.0) for name, role in signals.powers.items())
    if PAYLOAD_ENERGY.name in recorded:
        flows = (*flows, (PAYLOAD_ENERGY.name, 1.0))
    return Layout(columns, recorded, (KINETIC_ENERGY.name, POTENTIAL_ENERGY.name, *signals.stores), flows)


def energy_of(power: str) -> str:
    """The name of the integral of a power."""
    return f"{power.removesuffix('_power')}_energy"


MASSLESS = 1e-14  # share of a joint's inertia below which the inertia with all other joints free is a rounding error
SMALLEST_INERTIA = 1e-60  # smallest inertia [kg m^2 or kg]
MOST_SAMPLES = 1e9  # of one effect in a run


@dataclass(frozen=True, eq=False)
class Plan:
    """A scene, checked and prepared to run.

    Attributes:
        scene: The scene.
        body: Its mechanics.
        groups: Effects in the order of their laws, those of one kind together.
        signals: All signals with units and the effects that set them, powers and stored energies.
        memory: Memory of the compiled engines before the start.
        units: Units of the states, by full name.
        breakpoints: Times at which laws are discontinuous [s], increasing, inside the run or at its end.
        time_scales: Time scales with the effects that they belong to, the fastest first.
        left_out: Notes on effects that are left out.
    """

    scene: Scene
    body: Mechanics
    groups: tuple[Group, ...]
    signals: Directory
    memory: Memory
    units: dict[str, str]
    breakpoints: Array
    time_scales: tuple[tuple[str, TimeScale], ...]
    left_out: tuple[str, ...]

    @property
    def instances(self) -> tuple[Instance, ...]:
        """All effects, in the order of their laws."""
        return tuple(chain.from_iterable(group.instances for group in self.groups))

    @property
    def period(self) -> float:
        """The shortest sampling period [s]; infinite: nothing is sampled."""
        return min((one.effect.period for one in self.instances if one.effect.period is not None), default=math.inf)

    @cached_property
    def coordinates(self) -> list[str]:
        """Names of the coordinates: joints, then motors behind springs."""
        return coordinate_names(self.body, self.scene)

    @cached_property
    def inertia(self) -> Array:
        """Mass matrix of the coordinates at the start [kg m^2 or kg], (c, c)."""
        return _inertia(self.memory, self.body, self.scene)[0]

    @cached_property
    def layout(self) -> Layout:
        """The columns of the output rows of its runs."""
        return layout_of(self.memory, self.signals, self.units)

    def __repr__(self) -> str:
        return f"Plan({self._summary})"

    def _repr_html_(self) -> str:
        return f"<pre>{escape(str(self))}</pre>"

    @property
    def _summary(self) -> str:
        counts = {"joint": self.body.n, "state": len(self.memory.states), "effect": len(self.instances)}
        parts = ", ".join(f"{count} {name}{'s' * (count != 1)}" for name, count in counts.items())
        calls = len(self.groups)
        return f"{self.scene.name}: {parts} in {calls} call{'s' * (calls != 1)}, {self.scene.duration:g} s"

    def __str__(self) -> str:
        return "\n".join([
            f"Plan of {self._summary}",
            *_table("States", _state_rows(self.memory.states, self.units)),
            *_table("Order", ((f"{k}. {one.kind.__name__}", _places_of(one)) for k, one in enumerate(self.groups, 1))),
            *_table("Signals", _signal_rows(self.signals)),
            *_table("Time scales", _scale_rows(self.time_scales)),
            *_table("Left out", ((text, "") for text in self.left_out)),
        ])  # fmt: skip


def plan(scene: Scene) -> Plan:
    """Check a scene and order its effects.

    Args:
        scene: The scene to be simulated.

    Returns:
        The plan.

    Raises:
        InputError: Signals that no effect provides or that two effects set, algebraic loops, contradictory mechanics,
            joints without inertia, meshes that jam, sampling periods that are too short for the duration.
    """
    if not isinstance(scene, Scene):
        raise InputError(Fault("scene", "must be a scene", type(scene).__name__, "scene_of makes one of a study"))
    ratios = ratios_of(scene)
    body = mechanics(scene, ratios)
    whole = Place(-1, WHOLE, scene.joints, ratios, scene.turning, body.c, coupling_of(scene))
    places = {WHOLE: whole} | {name: replace(whole, joint=i, name=name) for i, name in enumerate(scene.joints)}
    found = [instance(effect, places[name]) for name, effects in scene.effects.items() for effect in effects]
    instances = in_fixed_order(found)
    _check_tip(instances, scene)
    _check_shafts(instances)
    _check_meshes_alone(instances)
    _check_belts(instances, body)
    _check_second_motors(instances, body, scene.joints)
    known = directory(instances, whole, [i in body.springs for i in range(body.n)])
    groups, accounts = ordered(instances), ordered(instances, outputs=True)
    memory = lay_out(groups, accounts, body, known, scene.joints)
    scales = [(one.title, scale) for one in instances for scale in one.effect.time_scales(one.place)]
    inertia = _inertia(memory, body, scene)
    check_inertias(body, inertia[0], scene)
    check_meshes(instances, body, inertia, scene)
    _check_periods(instances, scene)
    return Plan(
        scene, body, tuple(groups), known, memory,
        _state_units(instances, memory, scene), _breakpoints(instances, scene),
        tuple(sorted(scales, key=lambda pair: (pair[1].seconds, pair[0]))), _left_out(scene, instances),
    )  # fmt: skip


def check_meshes(
    instances: Sequence[Instance], body: Mechanics, inertia_at_start: tuple[Array, Array], scene: Scene
) -> None:
    """Raise InputError unless the equations with mesh friction have exactly one solution in the initial position.

    The mesh torque N of a rigid joint satisfies a N + mu |N| = r with a = 1 + J ratio^2 / I. There is one solution for
    every r only if mu < a.
    """
    loss_terms = [(one.place.joint, getattr(one.effect, "driven_loss", None)) for one in instances]
    losses = {joint: float(loss) for joint, loss in loss_terms if loss is not None}
    if not losses:
        return
    whole, rotors = inertia_at_start
    inertia = (np.diag(whole) - rotors)[: body.n]
    faults = []
    for joint, loss in losses.items():
        if joint in body.springs or inertia[joint] <= 0.0:
            continue
        limit = 1.0 + body.rotors[joint] / inertia[joint]
        if not loss < limit:
            problem = f"has a mesh friction of {loss:.4g}; from 1 + J ratio^2 / I = {limit:.4g} on it jams as it turns"
            hint = "give the joint a spring (FlexibleJoint), or the rotor more inertia"
            faults.append(Fault(f"effects[{scene.joints[joint]!r}]", problem, loss, hint))
    raise_faults(faults)


def _inertia(memory: Memory, body: Mechanics, scene: Scene) -> tuple[Array, Array]:
    """Mass matrix at the start, (c, c), and the rotors' part of its diagonal, (c,) [kg m^2 or kg]."""
    numbers = memory.numbers.copy()
    at = memory.view(numbers, "coordinates")
    if scene.position is not None:
        at["position"][: body.n] = body.places_of(scene.position)
    equations.evaluate_signals(numbers)
    pairs = memory.view(numbers, "pairs").reshape(body.c, body.c)
    return pairs["mass"], np.diagonal(pairs["rotor_mass"])


def coordinate_names(body: Mechanics, scene: Scene) -> list[str]:
    """Names of the coordinates: joints, then motors behind springs."""
    names = [*scene.joints, *[""] * (body.c - body.n)]
    for i in body.springs:
        names[body.motors[i]] = f"motor of {scene.joints[i]}"
    return names


def check_inertias(body: Mechanics, whole: Array, scene: Scene) -> None:
    """Raise InputError if a joint or a rotor behind a spring moves no inertia; ``whole`` is the mass matrix, (c, c)."""
    left, c = whole.copy(), len(whole)
    names = coordinate_names(body, scene)
    # Elimination from the last joint to the first: the inertia of each joint while those after it are free.
    for i in range(c - 1, -1, -1):
        if not left[i, i] > max(MASSLESS * whole[i, i], SMALLEST_INERTIA):
            problem = f"moves no inertia ({max(left[i, i], 0.0):.3g} kg m^2 or kg)"
            hint = "give its link a mass, or the joint a rotor (FullRotor, ReflectedRotor)"
            raise InputError(Fault(f"scene.{names[i]}", problem, None, hint))
        left[:i, :i] -= np.outer(left[:i, i], left[i, :i] / left[i, i])


def _check_periods(instances: Sequence[Instance], scene: Scene) -> None:
    """Raise InputError for more than ``MOST_SAMPLES`` samples of one effect, which would take too long."""
    raise_faults(
        Fault(f"{one.title}", f"samples more than {MOST_SAMPLES:g} times in {scene.duration:g} s", one.effect.period)
        for one in instances
        if one.effect.period is not None and scene.duration > MOST_SAMPLES * one.effect.period
    )


def _check_tip(instances: Sequence[Instance], scene: Scene) -> None:
    """Raise InputError for forces on the tip of a scene without an arm."""
    tip = {signal.name for signal in TIP_TAKEN}
    raise_faults(
        Fault(one.title, "acts on the tip of an arm, and the scene has none", None, "WallSpring acts on a joint")
        for one in instances
        if tip & set(one.contributes) and not isinstance(scene.body, Arm)
    )


def _check_shafts(instances: Sequence[Instance]) -> None:
    """Raise InputError for dry friction at a joint with coupled motors: the coordinate there is the shaft."""
    faults = []
    for one in instances:
        own = {signal.name for signal in one.ports.contributes} & {JOINT_HOLD_FORWARD.name, SURFACE_SPEED.name}
        if one.place.coupled and own and getattr(one.effect, "side", "joint") != "shaft":
            hint = "state its friction at the shaft behind the gear (side='shaft') or at the motor"
            faults.append(Fault(one.title, "rubs at a joint whose motor is coupled to others", None, hint))
    raise_faults(faults)


def _check_meshes_alone(instances: Sequence[Instance]) -> None:
    """Raise InputError for two mesh losses at one joint: the losses of meshes in series do not add."""
    kinds: dict[str, list[str]] = {}
    for one in instances:
        if any(signal.name == MESH_DRIVING.name for signal in one.ports.contributes):
            kinds.setdefault(one.place.name, []).append(type(one.effect).__name__)
    hint = "state one gear with the efficiency of both, the product"
    raise_faults(
        Fault(f"effects[{joint!r}]", f"has {len(listed)} mesh losses ({', '.join(listed)})", None, hint)
        for joint, listed in kinds.items()
        if len(listed) > 1
    )


def _check_belts(instances: Sequence[Instance], body: Mechanics) -> None:
    """Raise InputError for a belt at a rigid joint with friction in motor or mesh.

    A rigid joint has one contact mode, but relative to the belt it may slip in another direction than the motor.
    """
    belts = {one.place.joint for one in instances if SURFACE_SPEED in one.ports.contributes} - set(body.springs)
    hint = "give the joint a spring (FlexibleJoint), which lets motor and joint slide each its own way"
    raise_faults(
        Fault(one.title, "rubs behind the gear of a rigid joint on a moving belt", None, hint)
        for one in instances
        if one.place.joint in belts and {MOTOR_HOLD_FORWARD, MESH_DRIVING} & set(one.ports.contributes)
    )


def _check_second_motors(instances: Sequence[Instance], body: Mechanics, joints: Sequence[str]) -> None:
    """Raise InputError if an axis with two motors has dry friction at the second joint, or a model of one motor."""
    seconds, pairs = {second for _, second in body.shared}, {i for pair in body.shared for i in pair}
    faults = []
    for one in instances:
        own = {signal.name for signal in one.ports.contributes}
        if one.place.joint in seconds and own & {JOINT_HOLD_FORWARD.name, SURFACE_SPEED.name}:
            faults.append(Fault(one.title, "acts at the joint of a second motor", None, "state it at the first motor"))
        if pairs and "scene.mass_matrix" in one.needs:
            faults.append(Fault(one.title, "knows one motor a joint only, and an axis here has two"))
    push = [body.preloads[first] + body.preloads[second] for first, second in body.shared]
    faults += [
        Fault(f"effects[{joints[first]!r}]", "push the other motor by more or less than it pushes them [N m]", left)
        for (first, _), left in zip(body.shared, push, strict=True)
        if left
    ]
    faults += [
        Fault(f"effects[{joints[i]!r}]", "have a preload but no second motor on the axis", preload)
        for i, preload in enumerate(body.preloads)
        if preload and i not in pairs
    ]
    raise_faults(faults)


def _state_units(instances: Sequence[Instance], memory: Memory, scene: Scene) -> dict[str, str]:
    """Units of the states, by full name."""
    units: dict[str, str] = {}
    for joint, turning in zip(scene.joints, scene.turning, strict=True):
        units |= {f"{joint}.{name}": unit_at("rad", turning) for name in ("position", "deflection")}
        units |= {f"{joint}.{name}": unit_at("rad/s", turning) for name in ("speed", "shaft_speed")}
        units[f"{joint}.shaft_position"] = "rad"
    for one in instances:
        units |= {name: state.unit for name, state in zip(one.states, one.ports.states, strict=True)}
    return {name: units[name] for name in memory.states}


def _breakpoints(instances: Sequence[Instance], scene: Scene) -> Array:
    """Breakpoints of all effects within the run [s], increasing."""
    instants = {float(t) for one in instances for t in one.effect.breakpoints()}
    bad = [t for t in instants if not np.isfinite(t)]
    if bad:
        raise InputError(Fault("breakpoints", "must be instants [s]", bad[0]))
    return np.array(sorted(t for t in instants if 0.0 < t <= scene.duration))


def _scale_rows(scales: Sequence[tuple[str, TimeScale]]) -> list[tuple[str, str]]:
    """Printed rows of the time scales; equal ones at several joints share a row."""
    same: dict[tuple[str, str, str], list[str]] = {}
    for who, scale in scales:
        kind, _, joint = who.partition(" of ")
        same.setdefault((kind, scale.name, f"{scale.seconds:.3g} s"), []).append(joint)
    return [(f"{kind}, {name}: {text}", ", ".join(filter(None, at))) for (kind, name, text), at in same.items()]


def _left_out(scene: Scene, instances: Sequence[Instance]) -> tuple[str, ...]:
    """Notes on effects that the scene does not contain."""
    kinds = {type(one.effect).__name__ for one in instances}
    missing = []
    if isinstance(scene.body, Arm) and not any(kind in kinds for kind in ("FlexibleJoint", "Backlash")):
        missing.append("springs in the joints: all are rigid")
    return (*missing, *scene.notes)


def _places_of(group: Group) -> str:
    return ", ".join(dict.fromkeys(one.place.name for one in group.instances))


def _state_rows(names: Iterable[str], units: dict[str, str]) -> list[tuple[str, str]]:
    """Printed rows of the states with their units; equal ones of several joints share a row."""
    rows: dict[tuple[str, str], list[str]] = {}
    for name in names:
        rows.setdefault((name.rpartition(".")[2], units[name]), []).append(name.rpartition(".")[0])
    return [(f"{_joined(places)}.{what}", _printed(unit)) for (what, unit), places in rows.items()]


def _printed(unit: str) -> str:
    return "°C" if unit == "C" else unit


def _signal_rows(known: Directory) -> list[tuple[str, str]]:
    """Printed rows of the signals with the effects that set them; equal ones of several joints share a row."""
    rows: dict[tuple[str, str], list[str]] = {}
    for name, unit in known.units.items():
        who, place = _source_of(name, known), name.rpartition(".")[0]
        if who:
            said = who.replace(f" of {place}", "")
            rows.setdefault((f"{name.rpartition('.')[2]} [{_printed(unit)}]", said), []).append(place)
    listed = [(f"{_joined(places)}.{what}", said) for (what, said), places in rows.items()]
    return sorted(listed, key=lambda row: row[1].endswith("as nothing gives it"))


def _joined(places: Sequence[str]) -> str:
    """Several joints as they are printed: their names, or their number."""
    return places[0] if len(places) == 1 else f"({', '.join(places)})" if len(places) < 4 else f"({len(places)} joints)"


def _source_of(name: str, known: Directory) -> str:
    """What sets a signal, in words; empty for signals of the mechanics, and for sums without contributions."""
    contributors = known.contributors.get(name)
    if contributors is not None:
        return "sum of " + ", ".join(contributors) if contributors else ""
    who = known.providers.get(name)
    if who is None:
        return f"{known.defaults[name]:g}, as nothing gives it"
    return "" if who == MECHANICS else who


def _table(title: str, rows: Iterable[tuple[str, str]]) -> list[str]:
    """Lines of a titled table with two columns; empty without rows."""
    listed = list(rows)
    if not listed:
        return []
    width = max(len(first) for first, _ in listed)
    return ["", title, *(f"  {first:<{width}}  {second}".rstrip() for first, second in listed)]
