"""Every public name exists, comes from where the package says, and is seen by type checkers too."""

from __future__ import annotations

import ast
import inspect
from pathlib import Path

import pytest

import drivetrain as dt

FIXED = {
    "load_arm", "Arm", "Rotor", "with_rotors", "inverse_dynamics", "drive_torques", "mass_matrix", "coriolis_matrix",
    "gravity_torque", "forward_dynamics", "load_study", "evaluate", "select", "current_commands",
}  # fmt: skip


@pytest.mark.parametrize("name", dt.__all__)
def test_public_name_exists(name: str) -> None:
    assert getattr(dt, name) is not None
    if name in dt._HOME:
        assert inspect.unwrap(getattr(dt, name)).__module__ == f"drivetrain.{dt._HOME[name]}"


def test_the_fixed_face_is_public() -> None:
    assert set(dt.__all__) >= FIXED


def test_type_checkers_see_the_same_names() -> None:
    tree = ast.parse(Path(dt.__file__).read_text(encoding="utf-8"))
    (block,) = [node for node in tree.body if isinstance(node, ast.If)]
    seen = {(alias.name, node.module) for node in block.body for alias in node.names}  # type: ignore[attr-defined]
    assert seen == {(name, f"drivetrain.{home}") for name, home in dt._HOME.items()}


def test_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="nonsense"):
        dt.nonsense  # noqa: B018
