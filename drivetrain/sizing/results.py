"""Results: checks and series of a joint, evaluations of a whole arm, selections, and rejected candidates."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from drivetrain.arrays import Array
from drivetrain.drive.amplifier import Amplifier
from drivetrain.drive.drive import Drive
from drivetrain.drive.motor_limits import operating_region
from drivetrain.errors import Fault, InputError, whole_names
from drivetrain.notebook import axes_of, shown
from drivetrain.study.model import Study, pair_name
from drivetrain.study.parts.verdicts import Check, Verdict, lacking, shared_place, verdict_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes

UNLIMITED = Amplifier()


@dataclass(frozen=True, eq=False)
class JointSeries:
    """Series of one drive over the cycle, for plots and current commands; all (N,).

    Attributes:
        time: Time [s].
        position: Position of the joint [rad or m].
        speed, acceleration: Speed and acceleration of the gear's output [rad/s], [rad/s^2].
        gear_torque: Torque at the gear's output, joint friction included [N m].
        motor_speed: Speed of the rotor relative to its stator [rad/s].
        motor_torque: Electromagnetic torque, losses and rotor included [N m].
        rotor_torque: Part of the motor torque that accelerates the rotor [N m].
        friction_torque: Part of the motor torque for motor friction and gear loss [N m].
        current: DC-equivalent current [A].
        voltage: Terminal voltage of the warm motor [V].
        electrical_power: Power drawn from the supply; negative when regenerating [W].
        least_power: Lower bound of that power: without losses of gear and motor shaft and with a cold winding [W].
        winding_temperature, housing_temperature: Temperatures in the periodic steady state [C]; None if not computed.
        bearing_load: Joint wrench in the joint frame, (moment, force) [N m], [N], (N, 6); None without an arm.
        load_inertia: Load inertia at the gear's output, rotor excluded [kg m^2]; None if unknown.
    """

    time: Array
    position: Array
    speed: Array
    acceleration: Array
    gear_torque: Array
    motor_speed: Array
    motor_torque: Array
    rotor_torque: Array
    friction_torque: Array
    current: Array
    voltage: Array
    electrical_power: Array
    least_power: Array
    winding_temperature: Array | None
    housing_temperature: Array | None
    bearing_load: Array | None
    load_inertia: Array | None

    def __repr__(self) -> str:
        return f"JointSeries({len(self.time)} samples, {self.time[-1] - self.time[0]:.4g} s)"


@dataclass(frozen=True, eq=False)
class JointResult:
    """One joint's drive with its checks and series.

    Attributes:
        name: Name of the joint.
        motor, gear: Catalogue keys.
        drive: The drive with the study's assumptions filled in.
        checks: Every check, in a fixed order.
        series: Series of the drive over the cycle.
        remarks: Remarks as text: standstill rule, RMS rule validity, assumptions.
        gear_loss: Mean loss of the gear at its steady temperature [W]; None without a gear, or if unknown.
        housing_temperature: Mean over the cycle, or that of a single-node model [C]; None: unknown, or thermal runaway.
        amplifier: Amplifier of the study, or the chosen one of several.
        power_allowance: Additional power, peak and mean, for friction and heating that the data sheets do not specify
            [W].
    """

    name: str
    motor: str
    gear: str
    drive: Drive
    checks: tuple[Check, ...]
    series: JointSeries
    remarks: tuple[str, ...] = ()
    gear_loss: float | None = None
    housing_temperature: float | None = None
    amplifier: Amplifier = UNLIMITED
    power_allowance: tuple[float, float] = (0.0, 0.0)

    @property
    def brake(self) -> str:
        """Catalogue key of the holding brake; empty if there is none."""
        return self.drive.motor.brake.key

    @property
    def verdict(self) -> Verdict:
        return verdict_of(self.checks)

    @property
    def lacking(self) -> tuple[Check, ...]:
        """The essential checks that could not be made."""
        return lacking(self.checks)

    @property
    def torque_known(self) -> bool:
        """Whether the data sheets suffice to compute the motor's torque, on which most checks depend."""
        return not any(check.name == "motor voltage" and check.required is None for check in self.checks)

    @property
    def binding(self) -> Check | None:
        """The check with the highest utilisation; None if no check was made."""
        return most_used(self.checks)

    def __repr__(self) -> str:
        binding = "nothing was judged" if self.binding is None else f"{self.binding.name} {_share(self.binding)}"
        return f"JointResult({self.name}: {pair_name(self.motor, self.gear)}, {self.verdict}, {binding})"


@dataclass(frozen=True, eq=False)
class Evaluation:
    """All checks of a set of drives for a study.

    Attributes:
        study: The task.
        joints: Results by joint name, in the arm's order.
        shared: Checks of all joints together (supply, stiffness, stops).
        objective: Value of the study's objective for these drives; NaN where data are missing.
        criteria: ``mass`` [kg], ``price``, ``energy`` of a cycle [J] and largest ``utilisation``; NaN where unknown.
    """

    study: Study
    joints: dict[str, JointResult]
    shared: tuple[Check, ...]
    objective: float
    criteria: dict[str, float] = field(default_factory=dict)

    @property
    def drives(self) -> dict[str, tuple[str, str]]:
        """Keys of motor and gear by joint name, as ``evaluate`` takes them."""
        return {name: (joint.motor, joint.gear) for name, joint in self.joints.items()}

    @property
    def mounted(self) -> dict[str, Drive]:
        """The drives by joint name, with the study's assumptions filled in."""
        return {name: joint.drive for name, joint in self.joints.items()}

    @property
    def verdict(self) -> Verdict:
        """Verdict of the checks of all joints and of those of all joints together, see ``verdict_of``."""
        return verdict_of(check for _, check in placed_checks(self))

    @property
    def lacking(self) -> tuple[Check, ...]:
        """The essential checks that could not be made, of each joint and of all joints together."""
        return lacking(check for _, check in placed_checks(self))

    @property
    def feasible(self) -> bool:
        """True if no check failed and every essential one could be made."""
        return self.verdict in (Verdict.PASS, Verdict.MARGINAL)

    @property
    def binding(self) -> tuple[str, Check] | None:
        """Place and check of the highest utilisation, of each joint and of all joints together; None if none was made.

        The place is the name of a joint, ``supply``, ``arm`` or ``catalogue``.
        """
        judged = [one for one in placed_checks(self) if one[1].utilisation is not None]
        return max(judged, key=lambda one: one[1].utilisation or 0.0, default=None)

    @property
    def checks(self) -> pd.DataFrame:
        """Every check as a table, one per row: joint, check, verdict, utilisation, required, available and unit."""
        from drivetrain.sizing.tables import ALL, check_table

        return check_table({**{name: joint.checks for name, joint in self.joints.items()}, ALL: self.shared})

    @property
    def summary(self) -> pd.DataFrame:
        """The drive of each joint with its verdict and the check of highest utilisation, one joint a row; below, the
        checks of all joints together: ``supply``, ``arm`` and ``catalogue``, as far as they decide anything.
        """
        import pandas as pd

        checks = {name: joint.checks for name, joint in self.joints.items()}
        for check in (one for one in self.shared if one.essential or one.verdict is not Verdict.NOT_CHECKED):
            checks[shared_place(check)] = (*checks.get(shared_place(check), ()), check)
        rows = {}
        for name, made in checks.items():
            binding, joint = most_used(made), self.joints.get(name)
            rows[name] = {
                "motor": joint.motor if joint else "", "gear": joint.gear if joint else "",
                "verdict": str(verdict_of(made)), "limited by": binding.name if binding else "",
                "utilisation": binding.utilisation if binding else None,
            }  # fmt: skip
        return pd.DataFrame.from_dict(rows, orient="index")

    def __repr__(self) -> str:
        joints = f"{len(self.joints)} joint{'s' * (len(self.joints) > 1)}"
        most = "" if self.binding is None else f", {self.binding[0]}: {self.binding[1].name} {_share(self.binding[1])}"
        return f"Evaluation({self.study.name}: {self.verdict}, {joints}{most}{self.study.warned('study.notes')})"

    def _repr_html_(self) -> str:
        return shown(repr(self), self.summary)

    def plot(self, ax: Axes | None = None, *, joint: str | None = None) -> Axes:
        """Plot the speed-torque plane of one joint's motor: its path over the cycle, and the intermittent limit.

        The limit is that of the motor at its data-sheet temperature; verdicts use the hot motor too.

        Args:
            ax: Where to draw; None: a new figure.
            joint: Name of the joint, or a part of it that no other name contains; None: the joint nearest to a limit.

        Returns:
            The axes.

        Raises:
            InputError: There is no such joint, or no joint at all.
        """
        used = {name: one.binding.utilisation or 0.0 if one.binding else 0.0 for name, one in self.joints.items()}
        chosen = max(used, key=used.__getitem__, default="") if joint is None else joint
        [name] = whole_names("joint", "joint of this evaluation", [chosen], self.joints)
        one, ax = self.joints[name], axes_of(ax)
        motor, at = one.drive.motor, one.drive.motor.reference_temperature
        corners = operating_region(motor, one.amplifier, self.study.supply.voltage, at, at)
        ax.plot(*corners.T, color="0.4", label="intermittent limit")
        ax.plot(one.series.motor_speed, one.series.motor_torque, label=one.motor)
        reach = 1.2 * np.array([corners[np.abs(corners[:, 1]).argmin(), 0], np.abs(corners[:, 1]).max()])
        speed = max(abs(float(reach[0])), 1.1 * float(np.abs(one.series.motor_speed).max()))
        torque = max(float(reach[1]), 1.1 * float(np.abs(one.series.motor_torque).max()))
        ax.set(xlim=(-speed, speed), ylim=(-torque, torque), title=f"{name}: {one.verdict}")
        ax.set(xlabel="motor speed [rad/s]", ylabel="motor torque [N m]")
        ax.legend()
        return ax


def most_used(checks: Iterable[Check]) -> Check | None:
    """The check with the highest utilisation; None if none was made."""
    made = (check for check in checks if check.utilisation is not None)
    return max(made, key=lambda check: check.utilisation or 0.0, default=None)


def _share(check: Check) -> str:
    used = check.utilisation or 0.0
    return "∞" if math.isinf(used) else f"{100.0 * used:.3g} %"


REJECTED_NUMBERS = ("required", "available", "utilisation", "objective")
REJECTED = ("joint", "motor", "gear", "check", "required", "available", "unit", "utilisation", "objective")


@dataclass(frozen=True)
class RejectedPair:
    """A rejected candidate of a joint, given the drives chosen for the joints after it.

    Attributes:
        joint, motor, gear: Name of the joint and catalogue keys.
        check: The check with the highest utilisation in the first group of checks that it fails: gear and bearing,
            then speed, then motor torque, then heat with current and voltage.
        required, available: Required value and limit of that check [unit].
        unit: Unit of both.
        utilisation: Utilisation of that check, above 1.
        objective: Contribution of the pair to the objective; NaN if unknown.
    """

    joint: str
    motor: str
    gear: str
    check: str
    required: float
    available: float
    unit: str
    utilisation: float
    objective: float


@dataclass(frozen=True, eq=False)
class DriveSet:
    """A feasible set of drives.

    Attributes:
        drives: Keys of (motor, gear) by joint name.
        objective: Value of the objective.
        criteria: ``mass`` [kg], ``price``, ``energy`` of a cycle [J] and largest ``utilisation``; NaN where unknown.
    """

    drives: dict[str, tuple[str, str]]
    objective: float
    criteria: dict[str, float]


@dataclass(frozen=True, eq=False)
class Selection:
    """The drives chosen for a study, and why not the others.

    Attributes:
        study: The task.
        drives: Keys of the chosen (motor, gear) by joint name; empty if nothing is feasible.
        evaluation: Evaluation of the chosen drives; if nothing is feasible, of the nearest candidates.
        objective: Objective of the chosen drives; NaN if nothing is feasible.
        proof: ``optimal``, or the remaining gap in words, then after "not proven".
        rejected_pairs: Every rejected candidate, given the drives chosen after it.
        alternatives: By joint name, the next best (motor, gear, contribution to the objective) that are feasible with
            nominal values, also if a probability is required.
        advice: If nothing is feasible: the nearest candidate, the binding check and what would fix it; if a fixed
            drive lacks data, which data.
        counters: Work done: nodes, candidates judged.
        best_sets: The sets found, best first; the first is ``drives``. All are proven if the search is finished.
        bound: Lower bound on the objective of feasible sets; infinite if there is proven to be none.
        state: The stopped search, to be resumed; None if it is finished.
        notes: What the objective does not include for lack of data.
        equals: Number of feasible sets with the same objective as the chosen one, itself included.
        all_equals: Whether all of these were counted.
        choice: How the drives were chosen if a probability is required (``RobustSelection``); else None.
    """

    study: Study
    drives: dict[str, tuple[str, str]]
    evaluation: Evaluation
    objective: float
    proof: str
    rejected_pairs: Sequence[RejectedPair]
    alternatives: dict[str, tuple[tuple[str, str, float], ...]]
    advice: tuple[str, ...]
    counters: dict[str, int]
    best_sets: tuple[DriveSet, ...] = ()
    bound: float = math.nan
    state: object | None = None
    notes: tuple[str, ...] = ()
    equals: int = 0
    all_equals: bool = True
    choice: object | None = None

    @property
    def verdict(self) -> Verdict:
        """Verdict of the chosen drives; if there are none FAIL, or NOT CHECKED if the nearest set only lacks data."""
        found = self.evaluation.verdict
        return found if self.drives or found is Verdict.NOT_CHECKED else Verdict.FAIL

    @property
    def feasible(self) -> bool:
        """Whether a feasible set was found; False if a fixed drive lacks data."""
        return bool(self.drives) and self.evaluation.feasible

    @property
    def checks(self) -> pd.DataFrame:
        """Every check of the chosen drives, as ``evaluation.checks``."""
        return self.evaluation.checks

    @property
    def sets(self) -> pd.DataFrame:
        """The best sets as a table, best first: objective and criteria (units in ``attrs``), then drives of joints."""
        from drivetrain.sizing.tables import set_table

        return set_table(self.best_sets, self.study)

    @property
    def rejected(self) -> pd.DataFrame:
        """Every rejected candidate as a table, one a row, with the check that rejects it (see ``RejectedPair``)."""
        import pandas as pd

        frame = getattr(self.rejected_pairs, "frame", None)  # there may be half a million, kept column by column
        if frame is not None:
            table: pd.DataFrame = frame()
        else:
            columns = {name: [getattr(one, name) for one in self.rejected_pairs] for name in REJECTED}
            table = pd.DataFrame(
                {
                    name: np.array(values, dtype=float) if name in REJECTED_NUMBERS else pd.Categorical(values)
                    for name, values in columns.items()
                }
            )
        units = {"required": "unit", "available": "unit", "utilisation": "1", "objective": self.study.objective_unit}
        table.attrs = {"units": units}
        return table

    def __repr__(self) -> str:
        if not self.drives:
            told = f"{self.proof}; .advice says what would fit"
            return f"Selection({self.study.name}: {self.verdict}, {told}{self.study.warned('study.notes')})"
        value = f"{self.study.objective} {self.objective:.6g} {self.study.objective_unit}".strip()
        return f"Selection({self.study.name}: {self.verdict}, {value}, {self.proof}{self.study.warned('study.notes')})"

    def _repr_html_(self) -> str:
        return shown(repr(self), self.evaluation.summary)

    def plot(self, ax: Axes | None = None, *, joint: str | None = None) -> Axes:
        """The speed-torque plane of one joint's chosen motor, as ``Evaluation.plot`` draws it.

        Args:
            ax: Where to draw; None: a new figure.
            joint: Name, or a part that no other has; None: the joint nearest to a limit.

        Returns:
            The axes.
        """
        return self.evaluation.plot(ax, joint=joint)


def placed_checks(evaluation: Evaluation) -> list[tuple[str, Check]]:
    """Every check with its place: a joint, or ``supply``, ``arm`` or ``catalogue`` for one of all joints together."""
    found = [(name, check) for name, joint in evaluation.joints.items() for check in joint.checks]
    return found + [(shared_place(check), check) for check in evaluation.shared]


def every_drive(found: Selection) -> Evaluation:
    """Evaluation of the drives that a search chose or found nearest; InputError if a joint has no drive."""
    study, judged = found.evaluation.study, found.evaluation.joints
    missing = [task.name for task in study.joints if task.name not in judged]
    if missing:
        raise InputError(Fault("joints", f"no drive was found for {', '.join(missing)}", file=study.path))
    return found.evaluation
