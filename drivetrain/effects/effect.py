"""What an effect is: a small description of what it reads and writes, and compiled laws on records.

An effect belongs to one joint or to the whole scene. Its file holds a frozen dataclass (what the user states), a
dataclass ``Own`` (what the effect keeps: constants of its law, states with their rates, memory, outputs) and its laws,
made by ``laws.joint_law``, ``table_law`` or ``scene_law``. Laws read and write ``own`` and the connectors of
``connectors.py``; ``ports`` names these signals (``signals.py``), so that the plan of a scene can check them
and put all effects in an order that serves each. Nothing else depends on an effect.

``compute`` has two modes. At an instant (h = 0) states and connectors are those of ``t``, rates are derivatives.
In a fixed step (h > 0) ``t`` and the connectors are those of the middle of the step, own states those of its beginning;
rates are what the states change by over the whole step, divided by h, what it provides are means over it. An effect
faster than the step solves its own equation there; any other just adds half a step of its rates.

``account`` is called after motion and forces are known, puts out powers, and fills rates of states that are ``late``;
it may find that a step was too long, or that a value provided before does not fit, and ask for the step once more.
``accept`` is called when a fixed step is taken for good, and may change what is kept. ``sample`` is called at the
instants of the effect's period, and only changes memory.
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
    """What an output is in the balance of energy: SOURCE puts power in, LOSS takes it out for good, STORE keeps it."""

    SOURCE = "source"
    LOSS = "loss"
    STORE = "store"


@dataclass(frozen=True)
class State:
    """A number that an effect remembers.

    Attributes:
        name: Also the name of a signal that holds its value, which is known before anything is computed.
        unit: SI.
        atol: Error that does not matter [unit].
        memory: True: it does not follow a rate, but changes at samples or after steps.
        late: True: its rate is known once motion, forces and powers are, so ``account`` fills it.
        path: Field of the effect's own record, beside which stands its rate, ``<path>_rate``; empty: as its name.
    """

    name: str
    unit: str
    atol: float = 1e-6
    memory: bool = False
    path: str = ""
    late: bool = False


@dataclass(frozen=True)
class Signal:
    """A number that effects and mechanics exchange.

    Attributes:
        name: Of the joint's own signal; ``scene.`` before it: of the scene's; ``joint:name``: of another joint's.
        unit: SI.
        default: Of a need: the value if no effect provides it; None: one must.
        path: Where it lies in the joint's connectors, such as ``motor.torque``; of an output that is no connector, the
            field of the effect's own record; empty: as its name.
        role: Of an output that is a power or a stored energy: what it is in the balance.
    """

    name: str
    unit: str
    default: float | None = None
    path: str = ""
    role: Role | None = None


@dataclass(frozen=True)
class Ports:
    """All that an effect shows of itself.

    Attributes:
        states: What it remembers.
        needs: What it reads; all that provide it or contribute to it come before.
        provides: What it alone sets.
        contributes: What it adds to, with others; set to zero before the first.
        outputs: What it sets in ``account``, after motion and forces are known.
        guard: Field of its own record, filled in ``account`` at instants, that must not become negative where the error
            is controlled: ``accept`` is called there with h = 0, and makes the change that it stands for. Empty: none.
    """

    states: tuple[State, ...] = ()
    needs: tuple[Signal, ...] = ()
    provides: tuple[Signal, ...] = ()
    contributes: tuple[Signal, ...] = ()
    outputs: tuple[Signal, ...] = ()
    guard: str = ""


@dataclass(frozen=True)
class Place:
    """Where an effect stands.

    Attributes:
        joint: Index of its joint; -1 for an effect of the whole scene.
        name: Of the joint, or ``scene``.
        joints: Names of all joints.
        ratios: Motor angle over joint coordinate, one a joint [- or rad/m]; 1 without a gear.
        turning: Whether a joint turns (or slides), one a joint.
        coordinates: Of the mechanics: joints, and rotors on their own after them [-].
        coupling: Turns of each shaft a turn of each joint, as of ``arm/coupling.py``, (n, n); empty: none is coupled.
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
        """Whether its motor drives other joints too, or other motors it."""
        return self.joint in self.shafts

    @property
    def shafts(self) -> tuple[int, ...]:
        """Joints whose motors are coupled."""
        n = range(len(self.coupling))
        return tuple(i for i in n if any(abs(self.coupling[i][k]) + abs(self.coupling[k][i]) > 0.0 for k in n if k != i)
                     or self.coupling[i][i] != 1.0)  # fmt: skip

    @property
    def ratio(self) -> float:
        """Motor angle over joint coordinate of this joint [- or rad/m]."""
        return self.ratios[self.joint]


def ratio_of(place: Place, gear: Gear) -> float | None:
    """The ratio that a gear provides for its joint; of a sliding joint it includes the travel."""
    return gear.ratio if place.turning[place.joint] else None


@dataclass(frozen=True)
class TimeScale:
    """A time in which something happens.

    Attributes:
        name: What happens.
        seconds: How fast [s].
    """

    name: str
    seconds: float


@dataclass(frozen=True)
class Shape:
    """What an effect adds to the mechanics themselves.

    Attributes:
        ratio: Motor angle over joint coordinate [- or rad/m]; None: not defined.
        rotor_inertia: About the motor's axis [kg m^2]; None: brings no rotor.
        full: Whether that rotor is a body on its carrier, or only reflected to its joint.
        flexible: Whether the rotor moves on its own, behind a spring.
        deflection: Twist of that spring under a torque, [N m] to [rad].
    """

    ratio: float | None = None
    rotor_inertia: float | None = None
    full: bool = True
    flexible: bool = False
    deflection: Callable[[float], float] | None = None


NOTHING = Ports()
NO_SHAPE = Shape()


def _checked(own: Callable[[Any], None] | None) -> Callable[[Any], None]:
    """The checks of an effect: kinds of its fields, ranges and its own, all at once; then what it does itself."""

    def checks(self: Any) -> None:
        faults = kind_faults(self)
        faults += range_faults(self) + ([] if faults else self.faults())
        raise_faults(faults)
        if own is not None:
            own(self)

    return checks


class Effect(ABC):
    """One effect; every one is a frozen dataclass in a file of its own.

    Attributes:
        scope: ``joint`` or ``scene``.
        limits: Ranges of its fields, by name.
        compute: Provides and contributes, fills the rates of its states; None: only a shape.
        account: Puts out powers once motion and forces are known; None: there are none.
        accept: Changes what is kept after a fixed step, or (h = 0) where its guard is spent; None: nothing.
        sample: Changes memory at the instants of ``period``; None: not sampled.
    """

    scope: ClassVar[str] = "joint"
    limits: ClassVar[Mapping[str, Range]] = {}
    compute: ClassVar[Law | None] = None
    account: ClassVar[Law | None] = None
    accept: ClassVar[Law | None] = None
    sample: ClassVar[Law | None] = None

    def __init_subclass__(cls) -> None:
        """Every effect is checked before it does anything of its own."""
        super().__init_subclass__()
        own = cls.__dict__.get("__post_init__")
        if own is not None or not hasattr(cls, "__post_init__"):
            setattr(cls, "__post_init__", _checked(own))  # noqa: B010

    def faults(self) -> list[Fault]:
        """What is wrong with its fields beside their kinds and ranges."""
        return []

    @abstractmethod
    def ports(self, place: Place) -> Ports:
        """What it reads, writes and remembers there."""

    def own(self, place: Place) -> Any:
        """What it keeps, as its laws find it: by default what of it has the names of the fields without a default."""
        described = self.described()
        names = [one.name for one in fields(described) if one.default is MISSING and one.default_factory is MISSING]
        return described(**{name: getattr(self, name) for name in names})

    @classmethod
    def described(cls) -> Any:
        """The dataclass that its laws are made for; None: it has no laws."""
        laws = (cls.compute, cls.account, cls.accept, cls.sample)
        return next((law.described for law in laws if isinstance(law, Law)), None)

    def table(self, place: Place) -> Array:
        """What its law reads beside, of any length, such as values over time."""
        return np.zeros((0, 0))

    def start(self, place: Place, signals: Mapping[str, float]) -> Sequence[float]:
        """States that fit the rest of the scene, so that no layer of fast motion begins the run."""
        return (0.0,) * len(self.ports(place).states)

    def shape(self, place: Place) -> Shape:
        """What it adds to the mechanics."""
        return NO_SHAPE

    def time_scales(self, place: Place) -> tuple[TimeScale, ...]:
        """How fast it is."""
        return ()

    def breakpoints(self) -> Sequence[float]:
        """Where its law jumps in time."""
        return ()

    def knots(self, tolerance: float) -> Sequence[float]:
        """Where its law bends in time, without a jump; only engines that control their error stop there."""
        return ()

    def piecewise(self) -> bool:
        """Whether what it adds to a gear's or to the tip's forces has pieces, so that a step looks again."""
        return False

    @property
    def period(self) -> float | None:
        """Time between two samples [s]; None: it is continuous."""
        return None

    def quasi_static(self) -> Effect | None:
        """What takes its place when it is dropped."""
        return None
