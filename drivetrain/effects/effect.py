"""The interface of an effect: a description of the signals that it reads and writes, and compiled laws on records.

An effect belongs to one joint or to the whole scene. Its file contains a frozen dataclass (the user's parameters), a
dataclass ``Own`` (the effect's record: constants of its laws, states with their rates, memory, outputs) and its laws,
made by ``laws.joint_law``, ``table_law`` or ``scene_law``. Laws read and write ``own`` and the connectors of
``connectors.py``. ``ports`` declares these signals (``signals.py``), so that the plan of a scene can check them and put
the effects in an order in which every signal is written before it is read. Nothing else depends on an effect.

``compute`` has two modes. At an instant (h = 0), states and connectors are those at time ``t``, and rates are time
derivatives. In a fixed step (h > 0), ``t`` and the connectors are those of the middle of the step, own states those at
its beginning; rates are the changes of the states over the whole step divided by h, and provided values are means over
the step. An effect that is faster than the step solves its own equation over it; any other uses its state plus half a
step of its rate.

``account`` is called when motion and forces are known; it outputs powers and fills the rates of states that are
``late``. It may find that a step was too long, or that a value provided before does not agree with the solution, and
request another solution of the step. ``accept`` is called when a fixed step is final, and may change the record.
``sample`` is called at the sampling times of the effect, and only changes memory.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, dataclass, fields
from enum import StrEnum
from typing import Any, ClassVar

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.gear import Gear
from drivetrain.drive.ranges import Range
from drivetrain.effects.fields import kind_faults, range_faults
from drivetrain.effects.laws import Law
from drivetrain.errors import Fault, raise_faults


class Role(StrEnum):
    """Role of an output in the energy balance: SOURCE supplies power, LOSS dissipates it, STORE is a stored energy."""

    SOURCE = "source"
    LOSS = "loss"
    STORE = "store"


@dataclass(frozen=True)
class State:
    """A state of an effect.

    Attributes:
        name: Name of the state, and of a signal with its value, which is known before any law is evaluated.
        unit: SI unit.
        atol: Absolute tolerance for integration with an adaptive step, at a relative tolerance of 1e-6 [unit].
        memory: True: the state has no rate, but changes at samples or after steps.
        late: True: its rate needs motion, forces and powers, so ``account`` fills it instead of ``compute``.
        path: Field of the effect's record, whose rate is the field ``<path>_rate``; empty: as its name.
    """

    name: str
    unit: str
    atol: float = 1e-6
    memory: bool = False
    path: str = ""
    late: bool = False


@dataclass(frozen=True)
class Signal:
    """A scalar that effects and mechanics exchange.

    Attributes:
        name: A signal of the effect's joint; with the prefix ``scene.`` one of the scene; ``joint:name`` of another
            joint.
        unit: SI unit.
        default: For a need, the value if no effect provides it; None: one must.
        path: Field of the joint's connectors, such as ``motor.torque``; for an output that is no connector, the field
            of the effect's record; empty: as its name.
        role: For an output that is a power or a stored energy, its role in the energy balance.
    """

    name: str
    unit: str
    default: float | None = None
    path: str = ""
    role: Role | None = None


@dataclass(frozen=True)
class Ports:
    """The interface of an effect to the rest of a scene.

    Attributes:
        states: Its states.
        needs: Signals that it reads; all effects that provide them or contribute to them are evaluated before.
        provides: Signals that it alone sets.
        contributes: Signals to which it adds, as others may; they are reset to zero before the first contribution.
        outputs: Signals that it sets in ``account``, when motion and forces are known.
        guard: Field of its record, filled in ``account``, that must not become negative. Integration with an adaptive
            step locates its zero and calls ``accept`` there with h = 0, which makes the change of mode. Empty: none.
    """

    states: tuple[State, ...] = ()
    needs: tuple[Signal, ...] = ()
    provides: tuple[Signal, ...] = ()
    contributes: tuple[Signal, ...] = ()
    outputs: tuple[Signal, ...] = ()
    guard: str = ""


@dataclass(frozen=True)
class Place:
    """The joint to which an effect belongs, and the data of all joints.

    Attributes:
        joint: Index of its joint; -1 for an effect of the whole scene.
        name: Name of the joint, or ``scene``.
        joints: Names of all joints.
        ratios: Motor angle over joint coordinate, one per joint [- or rad/m]; 1 without a gear.
        turning: Whether a joint is revolute (or prismatic), one per joint.
        coordinates: Number of coordinates of the mechanics: joints, then rotors behind springs [-].
        coupling: Turns of each shaft per turn of each joint, see ``arm/coupling.py``, (n, n); empty: none is coupled.
    """

    joint: int
    name: str
    joints: tuple[str, ...]
    ratios: tuple[float, ...]
    turning: tuple[bool, ...]
    coordinates: int = 0
    coupling: tuple[tuple[float, ...], ...] = ()

    @property
    def coupled(self) -> bool:
        """Whether its motor also drives other joints, or other motors drive this joint."""
        return self.joint in self.shafts

    @property
    def shafts(self) -> tuple[int, ...]:
        """Indices of the joints whose motors are coupled."""
        n = range(len(self.coupling))
        return tuple(i for i in n if any(abs(self.coupling[i][k]) + abs(self.coupling[k][i]) > 0.0 for k in n if k != i)
                     or self.coupling[i][i] != 1.0)  # fmt: skip

    @property
    def ratio(self) -> float:
        """Motor angle over joint coordinate of this joint [- or rad/m]."""
        return self.ratios[self.joint]


def ratio_of(place: Place, gear: Gear) -> float | None:
    """Ratio of a joint that its gear defines; None at a prismatic joint, where the travel per turn is needed too."""
    return gear.ratio if place.turning[place.joint] else None


@dataclass(frozen=True)
class TimeScale:
    """A time scale of an effect, for the printed plan.

    Attributes:
        name: The process that has it.
        seconds: Its time constant [s].
    """

    name: str
    seconds: float


@dataclass(frozen=True)
class Shape:
    """Contribution of an effect to the mechanics of the scene.

    Attributes:
        ratio: Motor angle over joint coordinate [- or rad/m]; None: not defined by this effect.
        rotor_inertia: Inertia about the motor's axis [kg m^2]; None: the effect has no rotor.
        full: Whether that rotor is a rigid body on its carrier, or only reflected to its joint.
        flexible: Whether the rotor is a coordinate of its own, behind a spring.
        deflection: Wind-up of that spring as a function of the torque, [N m] to [rad].
        preload: Of one of two motors on an axis, the torque of its gear in addition to half of the load [N m].
        carried: Of the rotor's inertia, what the spring carries: stages behind the gear, at the joint [kg m^2].
    """

    ratio: float | None = None
    rotor_inertia: float | None = None
    full: bool = True
    flexible: bool = False
    deflection: Callable[[float], float] | None = None
    preload: float = 0.0
    carried: float = 0.0


NOTHING = Ports()
NO_SHAPE = Shape()


def _checked(own: Callable[[Any], None] | None) -> Callable[[Any], None]:
    """A ``__post_init__`` that checks types and ranges of an effect's fields and its own faults, then calls ``own``."""

    def checks(self: Any) -> None:
        faults = kind_faults(self)
        faults += range_faults(self) + ([] if faults else self.faults())
        raise_faults(faults)
        if own is not None:
            own(self)

    return checks


class Effect(ABC):
    """Base of all effects; each is a frozen dataclass in a file of its own.

    Attributes:
        scope: ``joint`` or ``scene``.
        limits: Ranges of its fields, by name.
        compute: Law that provides and contributes signals and fills the rates of states; None: only a ``shape``.
        account: Law that outputs powers when motion and forces are known; None: no outputs.
        accept: Law that changes the record after a fixed step, or (h = 0) where its guard becomes zero; None: none.
        sample: Law that changes memory at the sampling times of ``period``; None: not sampled.
    """

    scope: ClassVar[str] = "joint"
    limits: ClassVar[Mapping[str, Range]] = {}
    compute: ClassVar[Law | None] = None
    account: ClassVar[Law | None] = None
    accept: ClassVar[Law | None] = None
    sample: ClassVar[Law | None] = None

    def __init_subclass__(cls) -> None:
        """Make every effect check its fields before its own ``__post_init__``."""
        super().__init_subclass__()
        own = cls.__dict__.get("__post_init__")
        if own is not None or not hasattr(cls, "__post_init__"):
            setattr(cls, "__post_init__", _checked(own))  # noqa: B010

    def faults(self) -> list[Fault]:
        """Faults of its fields beyond types and ranges."""
        return []

    @abstractmethod
    def ports(self, place: Place) -> Ports:
        """Its states, and the signals that it reads and writes at a place."""

    def own(self, place: Place) -> Any:
        """Its record at a place; by default, fields of ``Own`` without a default are copied from the effect."""
        described = self.described()
        names = [one.name for one in fields(described) if one.default is MISSING and one.default_factory is MISSING]
        return described(**{name: getattr(self, name) for name in names})

    @classmethod
    def described(cls) -> Any:
        """The dataclass of its record, for which its laws are made; None: it has no laws."""
        laws = (cls.compute, cls.account, cls.accept, cls.sample)
        return next((law.described for law in laws if isinstance(law, Law)), None)

    def table(self, place: Place) -> Array:
        """A table of any length that its laws read besides the record, such as values over time, (rows, columns)."""
        return np.zeros((0, 0))

    def start(self, place: Place, signals: Mapping[str, float]) -> Sequence[float]:
        """Initial states in equilibrium with the given signals, so that a run does not begin with a transient."""
        return (0.0,) * len(self.ports(place).states)

    def shape(self, place: Place) -> Shape:
        """Its contribution to the mechanics: ratio, rotor, spring."""
        return NO_SHAPE

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        """Its time scales, for the printed plan."""
        return ()

    def breakpoints(self) -> Sequence[float]:
        """Times at which its law is discontinuous [s]; no step crosses them."""
        return ()

    def knots(self, tolerance: float) -> Sequence[float]:
        """Times at which its law is continuous but not smooth [s]; steps of the adaptive engine end there.

        ``tolerance`` is the relative tolerance; smaller kinks are left out.
        """
        return ()

    def piecewise(self) -> bool:
        """Whether its torque at a gear or force at the tip is piecewise, so that a step needs Newton iterations."""
        return False

    @property
    def period(self) -> float | None:
        """Time between two samples [s]; None: it is continuous."""
        return None

    def quasi_static(self) -> Effect | None:
        """The effect that replaces it when it is left out, with the same mean behaviour; None: nothing."""
        return None
