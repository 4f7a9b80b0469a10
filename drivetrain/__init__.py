"""Can this motor and gear drive this arm through these motions? The public names, loaded when first used."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from drivetrain.version import __version__

if TYPE_CHECKING:
    from drivetrain.arm.arm import Arm as Arm
    from drivetrain.arm.load import load_arm as load_arm
    from drivetrain.arm.rotors import Rotor as Rotor
    from drivetrain.arm.rotors import RotorLevel as RotorLevel
    from drivetrain.arm.with_rotors import with_rotors as with_rotors
    from drivetrain.dynamics.coriolis import coriolis_matrix as coriolis_matrix
    from drivetrain.dynamics.forward import forward_dynamics as forward_dynamics
    from drivetrain.dynamics.mass_matrix import mass_matrix as mass_matrix
    from drivetrain.dynamics.newton_euler import DriveTorques as DriveTorques
    from drivetrain.dynamics.newton_euler import drive_torques as drive_torques
    from drivetrain.dynamics.newton_euler import gravity_torque as gravity_torque
    from drivetrain.dynamics.newton_euler import inverse_dynamics as inverse_dynamics
    from drivetrain.dynamics.newton_euler import joint_loads as joint_loads
    from drivetrain.errors import DrivetrainError as DrivetrainError
    from drivetrain.errors import InputError as InputError
    from drivetrain.errors import PhysicsWarning as PhysicsWarning
    from drivetrain.sizing.currents import current_commands as current_commands
    from drivetrain.sizing.evaluate import evaluate as evaluate
    from drivetrain.sizing.results import Verdict as Verdict
    from drivetrain.sizing.search import select as select
    from drivetrain.study.load import load_study as load_study

_HOME = {
    "Arm": "arm.arm",
    "load_arm": "arm.load",
    "Rotor": "arm.rotors",
    "RotorLevel": "arm.rotors",
    "with_rotors": "arm.with_rotors",
    "coriolis_matrix": "dynamics.coriolis",
    "forward_dynamics": "dynamics.forward",
    "mass_matrix": "dynamics.mass_matrix",
    "DriveTorques": "dynamics.newton_euler",
    "drive_torques": "dynamics.newton_euler",
    "gravity_torque": "dynamics.newton_euler",
    "inverse_dynamics": "dynamics.newton_euler",
    "joint_loads": "dynamics.newton_euler",
    "DrivetrainError": "errors",
    "InputError": "errors",
    "PhysicsWarning": "errors",
    "current_commands": "sizing.currents",
    "evaluate": "sizing.evaluate",
    "Verdict": "sizing.results",
    "select": "sizing.search",
    "load_study": "study.load",
}

__all__ = sorted([*_HOME, "__version__"])


def __getattr__(name: str) -> Any:
    """The public name, imported from the module it lives in."""
    if name not in _HOME:
        raise AttributeError(f"module 'drivetrain' has no attribute {name!r}")
    return getattr(import_module(f"drivetrain.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    """The public names."""
    return __all__
