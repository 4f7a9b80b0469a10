"""Every public name exists, is said in one place, and stands in a room; ``dt`` shows the ones to begin with."""

from __future__ import annotations

import ast
import inspect
from pathlib import Path

import pytest

import drivetrain as dt
from drivetrain.face import homes

ROOMS = [f"drivetrain.{room}" for room in dt._ROOMS]
FIXED = {
    "load_arm", "Arm", "Rotor", "with_rotors", "inverse_dynamics", "drive_torques", "mass_matrix", "coriolis_matrix",
    "gravity_torque", "forward_dynamics", "load_study", "evaluate", "select", "current_commands",
}  # fmt: skip
PACKAGE = Path(dt.__file__).parent


@pytest.mark.parametrize("room", ROOMS)
def test_names_of_a_room(room: str) -> None:
    shown = getattr(dt, room.partition(".")[2])
    assert dir(shown) == sorted(homes(room))
    for name, home in homes(room).items():
        found = getattr(shown, name)
        assert getattr(dt, name) is found
        assert home == room or not hasattr(found, "__module__") or inspect.unwrap(found).__module__ == home


@pytest.mark.parametrize("room", ROOMS)
def test_no_file_of_a_room_hides_a_public_name(room: str) -> None:
    """The import of a submodule sets an attribute of its name."""
    files = {path.stem for path in (PACKAGE / room.partition(".")[2]).iterdir()}
    assert {name for name, home in homes(room).items() if home != room} & files == set()


def test_no_name_is_public_twice() -> None:
    names = [name for room in ROOMS for name in homes(room)]
    assert len(names) == len(set(names)) and set(names) & set(dt._ROOMS) == set()


def test_what_dt_shows_is_the_fixed_face_and_little_more() -> None:
    assert set(dir(dt)) >= FIXED | set(dt._ROOMS)
    assert set(dir(dt)) <= set(dt.__all__) and len(dir(dt)) < 75


def test_objects_that_an_argument_takes_by_default_are_public() -> None:
    hidden = {
        f"{name}({one.name}=)": type(one.default).__name__
        for name in dt.__all__
        if inspect.isfunction(getattr(dt, name))
        for one in inspect.signature(getattr(dt, name)).parameters.values()
        if type(one.default).__module__.startswith("drivetrain.") and not isinstance(one.default, str)
        if not hasattr(dt, type(one.default).__name__)
    }
    assert hidden == {}
    assert dt.task_space_dynamics(dt.load_arm("ur5"), [0.1] * 6, [0.0] * 6, task=dt.SpaceTwist((3, 4))).rank == 2
    assert dt.FreeRatio(20.0, 200.0).series is None  # of ``free_ratios(free=)``


def test_type_checkers_see_every_room() -> None:
    (block,) = [
        node for node in ast.parse(Path(dt.__file__).read_text(encoding="utf-8")).body if isinstance(node, ast.If)
    ]
    stars = [node.module for node in block.body if isinstance(node, ast.ImportFrom) and node.names[0].name == "*"]
    assert sorted(stars) == ROOMS


def test_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="nonsense"):
        dt.nonsense  # noqa: B018
    with pytest.raises(AttributeError, match="nonsense"):
        dt.motion.nonsense  # noqa: B018
