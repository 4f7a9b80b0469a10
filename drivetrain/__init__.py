"""Sizing of motors and gears for robot arms: whether a drive can perform given motions, and which drives to choose.

Every public name of a subpackage is available here as well: ``dt.cuboid`` is ``dt.spatial.cuboid``.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

from drivetrain.errors import nearest
from drivetrain.face import homes
from drivetrain.version import __version__ as __version__

if TYPE_CHECKING:
    from drivetrain import (
        accuracy,
        arm,
        catalog,
        control,
        drive,
        dynamics,
        effects,
        export,
        identification,
        motion,
        report,
        simulation,
        sizing,
        solvers,
        spatial,
        sweep,
    )
    from drivetrain.accuracy import *
    from drivetrain.arm import *
    from drivetrain.catalog import *
    from drivetrain.control import *
    from drivetrain.drive import *
    from drivetrain.dynamics import *
    from drivetrain.effects import *
    from drivetrain.errors import DrivetrainError, InputError, PhysicsWarning
    from drivetrain.export import *
    from drivetrain.identification import *
    from drivetrain.motion import *
    from drivetrain.report import *
    from drivetrain.simulation import *
    from drivetrain.sizing import *
    from drivetrain.solvers import *
    from drivetrain.spatial import *
    from drivetrain.study import *
    from drivetrain.study.objects import study
    from drivetrain.sweep import *

_ROOMS = (
    "accuracy", "arm", "catalog", "control", "drive", "dynamics", "effects", "export", "identification", "motion",
    "report", "simulation", "sizing", "solvers", "spatial", "study", "sweep",
)  # fmt: skip
_BEGIN_WITH = """
load_arm arm_from_dh Arm Rotor with_rotors with_payload inverse_dynamics drive_torques forward_dynamics mass_matrix
coriolis_matrix gravity_torque tip_pose torque_from_positions load_study json_schema Motion read_recording Motor Gear
Brake Friction read_catalog evaluate select why_not pareto_front optimum_curve trade_offs ratio_study robustness fastest
current_commands Commander simulate Scene FixedStep AdaptiveStep load_recording identify html_report write_outputs
write_currents write_urdf write_mjcf run_sweep DrivetrainError InputError PhysicsWarning __version__
"""
_SHELL = {command: f"`drivetrain {command}` is dt.{name} in Python" for command, name in {
    "size": "evaluate", "currents": "current_commands", "explain": "explanation", "ratio": "ratio_study",
    "front": "pareto_front", "curve": "optimum_curve", "family": "select_family", "loops": "study_loops",
}.items()}  # fmt: skip


@cache
def _homes() -> dict[str, str]:
    """Module or subpackage of each public name: the errors from their module, all others from their subpackage."""
    errors = {name: home for name, home in homes("drivetrain").items() if home == "drivetrain.errors"}
    return errors | {name: f"drivetrain.{room}" for room in _ROOMS for name in homes(f"drivetrain.{room}")}


def __getattr__(name: str) -> Any:
    """A subpackage or a public name, imported on first use."""
    if name in _ROOMS:
        return import_module(f"drivetrain.{name}")
    if name == "__all__":
        return sorted([*_homes(), *_ROOMS, "__version__"])
    if name.startswith("_"):  # tools ask for many of these
        raise AttributeError(f"module 'drivetrain' has no attribute {name!r}")
    if name not in _homes():
        known = _SHELL.get(name) or nearest(name, [*_homes(), *_ROOMS])
        raise AttributeError(f"module 'drivetrain' has no attribute {name!r}; {known}")
    globals()[name] = getattr(import_module(_homes()[name]), name)
    return globals()[name]


def __dir__() -> list[str]:
    return sorted([*_ROOMS, *_BEGIN_WITH.split()])
