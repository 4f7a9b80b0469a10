"""The drive of one axis as a co-simulation FMU that runs this package's simulation, built with pythonfmu."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from drivetrain.catalog.schema import GEAR_COLUMNS, MOTOR_COLUMNS
from drivetrain.drive.amplifier import Amplifier
from drivetrain.drive.brake import Brake
from drivetrain.drive.counterbalance import Counterbalance
from drivetrain.drive.drive import Drive, drive_inertia
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear
from drivetrain.drive.motor import Motor
from drivetrain.dynamics.inverse import inverse_dynamics
from drivetrain.effects.gear.springs import Backlash, FlexibleJoint
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.motor.given import GivenCurrent
from drivetrain.effects.motor.rotor import ReflectedRotor
from drivetrain.errors import Fault, InputError, whole_names
from drivetrain.export.losses import lost
from drivetrain.simulation.engines.engine import Outcome, RunOptions
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.planning.plan import Plan, plan
from drivetrain.simulation.scene import Inertia, joint_scene
from drivetrain.simulation.study_scene import Surroundings, drive_effects, spring_damping, surroundings
from drivetrain.sizing.results import Evaluation
from drivetrain.study.model import JointTask, Mount, Study
from drivetrain.study.parts.mounting import loaded_arm, rotor_ratio
from drivetrain.whole_files import refusal

AXIS_FILE = "axis.json"
AT_JOINT = "position speed acceleration gear_torque load_torque load_inertia start_position start_speed".split()
SLIDING = {"rad": "m", "rad/s": "m/s", "rad/s^2": "m/s^2", "N m": "N", "kg m^2": "kg"}
"""Units of quantities at a prismatic joint, by the unit at a revolute one."""
SCRIPT = """from drivetrain.export.fmu_slave import DriveSlave

# At every start pythonfmu 0.7 gives back one reference to this module's dictionary that it never took.
DriveSlave.held.append(globals())


class {name}(DriveSlave):
    pass
"""
SHEET = {
    "motor": (
        "resistance torque_constant reference_temperature magnet_coefficient rotor_inertia coulomb_friction "
        "viscous_friction nominal_voltage no_load_current no_load_speed resistance_winding_housing "
        "resistance_housing_ambient resistance_winding_ambient winding_time_constant housing_time_constant"
    ),
    "gear": (
        "ratio efficiency backdriving_efficiency no_load_torque mesh_efficiency drag_torque drag_speed "
        "drag_speed_exponent drag_temperature_1 drag_temperature_2 seal_drag_torque starting_torque inertia "
        "stiffness_1 stiffness_2 stiffness_3 torque_1 torque_2 backlash"
    ),
}
"""What a simulation takes of the rows."""
SPRING = SHEET["gear"].split()[-6:]
UNITS = {
    f"{part}.{one.name}": one.unit
    for part, columns in (("motor", MOTOR_COLUMNS), ("gear", GEAR_COLUMNS))
    for one in columns
    if one.name in SHEET[part].split()
}
OUTPUTS = {
    "position": ("rad", "of the joint"),
    "speed": ("rad/s", "of the joint"),
    "acceleration": ("rad/s^2", "of the joint"),
    "gear_torque": ("N m", "through the mesh, at the gear's output"),
    "motor_torque": ("N m", "on the rotor: by the current, less viscous friction of its shaft"),
    "motor_speed": ("rad/s", "of the motor's shaft"),
    "current": ("A", "that flows, DC equivalent"),
    "voltage": ("V", "between the motor's terminals"),
    "electrical_power": ("W", "into the motor"),
    "winding_temperature": ("degC", "of the motor"),
    "housing_temperature": ("degC", "of the motor"),
}
INPUTS = {
    "current_command": ("A", "of the amplifier, DC equivalent; voltage and peak current limit it"),
    "load_torque": ("N m", "on the joint from outside, positive along its axis, without load_inertia's own"),
}


@dataclass(frozen=True)
class Axis:
    """Parameters of one axis as stored in the FMU, in SI; forces and lengths for a prismatic joint."""

    joint: str
    motor: Motor
    gear: Gear
    friction: Friction
    motor_friction: Friction | None
    amplifier: Amplifier
    counterbalances: tuple[Counterbalance, ...]
    around: Surroundings
    travel_per_turn: float | None
    housing_to_ambient: float | None
    gear_heat: float
    load_inertia: float  # inertia that the joint moves, without the drive [kg m^2 or kg]
    springs: bool  # whether the gear is elastic
    # initial position [rad or m] and speed [rad/s or m/s]
    position: float
    speed: float

    def text(self) -> str:
        return json.dumps(asdict(self), indent=1) + "\n"

    def parameters(self) -> dict[str, tuple[float, str, str]]:
        """Value, unit and description, by name, of the parameters that may be set before a run and are known."""
        found = {
            "load_inertia": (self.load_inertia, "kg m^2", "that the joint moves, drive left out"),
            "start_position": (self.position, "rad", "of the joint"),
            "start_speed": (self.speed, "rad/s", "of the joint"),
            "supply_voltage": (self.around.supply_voltage, "V", "behind the amplifier"),
            "ambient": (self.around.ambient, "degC", "of the air; motor and gear begin as warm"),
        }
        if self.amplifier.peak_current is not None:
            found["peak_current"] = self.amplifier.peak_current, "A", "of the amplifier, DC equivalent"
        for name, unit in UNITS.items():
            part, field = name.split(".")
            value = getattr(getattr(self, part), field)
            if value is not None and (self.springs or field not in SPRING):
                found[name] = float(value), unit, f"of {getattr(self, part).key}, as its row says"
        return found

    def unit(self, name: str, unit: str) -> str:
        """Unit of a parameter, input or output at this axis, converted for a prismatic joint."""
        return unit if self.travel_per_turn is None or name not in AT_JOINT else SLIDING[unit]

    def with_parameters(self, values: Mapping[str, float]) -> Axis:
        """The axis with changed values of ``parameters``."""
        parts: dict[str, Any] = {}
        for part in SHEET:
            own = {name.partition(".")[2]: value for name, value in values.items() if name.startswith(f"{part}.")}
            parts[part] = replace(getattr(self, part), **own)  # type: ignore[arg-type]
        around = replace(self.around, supply_voltage=values["supply_voltage"], ambient=values["ambient"])
        amplifier = replace(self.amplifier, peak_current=values.get("peak_current"))
        return replace(
            self, **parts, around=around, amplifier=amplifier, load_inertia=values["load_inertia"],
            position=values["start_position"], speed=values["start_speed"],
        )  # fmt: skip


def read_axis(text: str) -> Axis:
    """The axis from the text of ``Axis.text``."""
    data: dict[str, Any] = json.loads(text)
    data["motor"]["brake"] = _made(Brake, data["motor"]["brake"])
    kinds = {"motor": Motor, "gear": Gear, "friction": Friction, "amplifier": Amplifier, "around": Surroundings}
    parts = {name: _made(kind, data[name]) for name, kind in kinds.items()}
    shaft = None if data["motor_friction"] is None else _made(Friction, data["motor_friction"])
    balances = tuple(_made(Counterbalance, one) for one in data["counterbalances"])
    return Axis(**data | parts | {"motor_friction": shaft, "counterbalances": balances})


def _made(kind: Any, data: dict[str, Any]) -> Any:
    """A dataclass of type ``kind`` from its JSON data."""
    return kind(**{name: tuple(value) if isinstance(value, list) else value for name, value in data.items()})


def axis_of(evaluation: Evaluation, joint: str, *, springs: bool = False) -> Axis:
    """One axis of an evaluation, with a rigid or an elastic gear; what prevents it is an InputError."""
    study = evaluation.study
    names = study.joint_names
    (joint,) = whole_names("joint", "joint of the study", [joint], names)
    index = names.index(joint)
    task, judged = study.joints[index], evaluation.joints[joint]
    drive = judged.drive
    if task.coupled or task.sharing:
        problem = "shares joints with other motors: an FMU holds one motor at one joint"
        raise InputError(Fault(f"joints.{joint}", problem))
    if springs and (drive.gear.stiffness_1 is None or task.travel_per_turn is not None):
        problem = "is not in the row of its gear" if task.travel_per_turn is None else "is not simulated at a slide"
        raise InputError(Fault(f"joints.{joint}", f"{problem}: the stiffness of its spring", drive.gear.key))
    return Axis(
        joint, drive.motor, drive.gear, drive.joint_friction, drive.motor_friction, judged.amplifier,
        task.counterbalances, surroundings(study), task.travel_per_turn, task.housing_to_ambient, task.gear_heat,
        _load_inertia(study, evaluation, index), springs, float(study.cycle.position[0, index]),
        float(study.cycle.velocity[0, index]),
    )  # fmt: skip


def _load_inertia(study: Study, evaluation: Evaluation, index: int) -> float:
    """Inertia of the joint at the start of the cycle with all others held, without its own drive and a payload."""
    task = study.joints[index]
    if study.arm is None:
        if task.load_inertia is None:
            hint = "such as 15 kg m^2"
            place = f"joints.{task.name}.load_inertia"
            raise InputError(Fault(place, "is needed for an FMU of a load table", hint=hint))
        return float(task.load_inertia)
    arm = loaded_arm(study, evaluation.mounted, -1)
    drive = evaluation.joints[task.name].drive
    rest = np.zeros(arm.n)
    with_weight, weight = (
        inverse_dynamics(arm, study.cycle.position[0], rest, qdd) for qdd in (np.eye(arm.n)[index], rest)
    )
    return float(with_weight[index] - weight[index]) - rotor_ratio(drive, task) ** 2 * drive_inertia(drive)


class AxisRun:
    """Simulation of an axis from one communication point to the next, with constant inputs in between."""

    def __init__(self, axis: Axis):
        task = JointTask(
            axis.joint, None, (), (), Mount(), None, axis.friction, axis.motor_friction, axis.amplifier,
            travel_per_turn=axis.travel_per_turn, housing_to_ambient=axis.housing_to_ambient,
            gear_heat=axis.gear_heat, counterbalances=axis.counterbalances,
        )  # fmt: skip
        drive = Drive(axis.motor, axis.gear, axis.friction, axis.motor_friction)
        ratio = rotor_ratio(drive, task)
        load = Inertia(axis.load_inertia, turning=axis.travel_per_turn is None, name=axis.joint)
        once = np.zeros(1)
        given = {"current_command": GivenCurrent(once, once), "load_torque": GivenTorque(once, once)}
        rotor = ReflectedRotor(drive_inertia(drive), ratio)
        effects = [*drive_effects(task, drive, axis.around), rotor, *given.values()]
        if axis.springs:
            damping = spring_damping(axis.gear, axis.load_inertia + ratio**2 * drive_inertia(drive))
            effects.append((Backlash if axis.gear.backlash else FlexibleJoint)(axis.gear, damping))
        self._plan: Plan = plan(joint_scene(load, effects, 1.0, position=axis.position, speed=axis.speed))
        tables = [one.effect for one in self._plan.instances if one.effect.table(one.place).size]
        self._inputs = {
            name: self._plan.memory.view(self._plan.memory.numbers, f"table {tables.index(effect) + 1}")
            for name, effect in given.items()
        }
        step = 2e-4 if axis.springs else 1e-3
        self._layout, self._engine, self._axis = self._plan.layout, FixedStep(step), axis
        self._kept: dict[str, Any] | None = None
        self.time = 0.0  # since the start [s]

    def run(self, inputs: Mapping[str, float], end: float) -> dict[str, float]:
        """Simulate until ``end`` [s] with constant inputs, and return the outputs there."""
        outcome = self._to(inputs, end)
        if outcome.stopped_by is not None:
            raise ArithmeticError(f"{outcome.stopped_by.name}: {outcome.stopped_by.detail}")
        self._kept, self.time = outcome.kept, end
        return self._outputs(outcome.rows[-1])

    def now(self, inputs: Mapping[str, float]) -> dict[str, float]:
        return self._outputs(self._to(inputs, self._engine.step).rows[0])

    def _to(self, inputs: Mapping[str, float], end: float) -> Outcome:
        for name, value in inputs.items():
            self._inputs[name][1] = value
        scene = replace(self._plan.scene, duration=end)
        return self._engine.run(replace(self._plan, scene=scene), RunOptions(end, resume=self._kept))

    def _outputs(self, row: Any) -> dict[str, float]:
        joint = self._axis.joint
        shown = {
            name.removeprefix(f"{joint}."): float(row[column]) for name, (column, _) in self._layout.recorded.items()
        }
        shown["gear_torque"] = shown["mesh_torque"]
        return {name: shown[name] for name in OUTPUTS if name in shown}


def write_fmu(evaluation: Evaluation, path: str | Path, *, joint: str, springs: bool = False) -> tuple[str, ...]:
    """Write the drive of one axis as a co-simulation FMU, FMI 2.0: amplifier, motor, gear, friction, heat and a load.

    Inputs are the commanded current and the external torque on the joint; outputs are the joint's motion, torques,
    current, voltage and temperatures; parameters are the values of the motor's and the gear's catalogue rows, the
    load's inertia and the initial state. The FMU runs this package's simulation, so it needs a Python with drivetrain
    installed.

    Args:
        evaluation: Evaluation of a set of drives.
        path: The file, with suffix .fmu.
        joint: Name of the joint, or a part of it that is unique.
        springs: Whether the gear is elastic: its stiffness with 2 % of critical damping, and its backlash if known.

    Returns:
        What is lost in the format, one sentence each.

    Raises:
        InputError: An unknown joint, a joint with coupled motors, a load table without ``load_inertia``, ``springs``
            with a gear without stiffness or at a prismatic joint, pythonfmu is not installed, or the file cannot be
            written.

    Reference: FMI 2.0.4, co-simulation; https://github.com/NTNU-IHB/PythonFMU.
    """
    try:
        from pythonfmu import FmuBuilder
    except ModuleNotFoundError:
        raise InputError(Fault("export", "needs pythonfmu", "fmu", "pip install drivetrain[fmu]")) from None
    place, axis = Path(path), axis_of(evaluation, joint, springs=springs)
    if place.suffix != ".fmu":
        raise InputError(Fault("path", "must end in .fmu", str(place)))
    name = re.sub(r"\W", "_", f"drive_{axis.joint}")
    searched = list(sys.path)
    with TemporaryDirectory() as folder:
        script, data = Path(folder) / f"{name}.py", Path(folder) / AXIS_FILE
        script.write_text(SCRIPT.format(name=name), encoding="utf-8")
        data.write_text(axis.text(), encoding="utf-8")
        try:
            place.parent.mkdir(parents=True, exist_ok=True)
            FmuBuilder.build_FMU(script, dest=place, project_files=[data])
        except OSError as error:
            raise refusal(error, "path", place) from None
        finally:  # the builder does not remove its folder
            sys.path[:] = searched
            sys.modules.pop(name, None)
    return lost("fmu")
