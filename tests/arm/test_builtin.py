"""The built-in arms: quiet, complete, and what their sources say."""

from __future__ import annotations

import json
import warnings

import numpy as np
import pytest

from drivetrain.arm.arm import Arm
from drivetrain.arm.builtin import ROBOTS, builtin_arm, builtin_names
from drivetrain.arm.coupling import coupled_groups, rotor_turns
from drivetrain.arm.files.load import load_arm
from drivetrain.arm.rotors import MountedRotor
from drivetrain.errors import InputError
from drivetrain.spatial.inertia import triangle_excess
from drivetrain.spatial.poses import exp_pose, inverse_pose, log_pose


@pytest.mark.parametrize("name", builtin_names())
def test_loads_without_a_warning_and_says_its_name(name: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        arm = builtin_arm(name)
    assert arm.name == name
    assert arm.n in (2, 6, 7)
    assert (arm.masses >= 0).all()


@pytest.mark.parametrize("name", builtin_names())
def test_doubtful_inertias_are_in_the_notes(name: str) -> None:
    arm = builtin_arm(name)
    links = zip(arm.link_names, arm.inertias, strict=True)
    doubtful = [link for link, tensor in links if triangle_excess(tensor) > 1e-4]
    for link in doubtful:
        assert any(note.startswith(f"{link}: no body") for note in arm.notes), link
    assert bool(doubtful) == (name == "puma560")


def test_gravity_can_be_chosen_and_defaults_down() -> None:
    for name in builtin_names():
        down = [0, -9.81, 0] if name.startswith("planar-2r") else [0, 0, -9.81]
        assert builtin_arm(name).gravity.tolist() == down
        assert builtin_arm(name, gravity=[1, 2, 3]).gravity.tolist() == [1, 2, 3]


def test_unknown_name_and_tip() -> None:
    with pytest.raises(InputError, match="puma560"):
        builtin_arm("puma506")
    with pytest.raises(InputError, match="no links"):
        builtin_arm("puma560", tip="tool0")
    with pytest.raises(InputError, match="tool0"):
        builtin_arm("ur5", tip="tool1")


def test_ur5_corrected_differs_only_in_its_wrists() -> None:
    one, other = builtin_arm("ur5"), builtin_arm("ur5-corrected")
    assert np.array_equal(one.screws, other.screws)
    assert np.array_equal(one.masses, other.masses)
    assert np.array_equal(one.home, other.home)
    assert np.array_equal(one.inertias[:3], other.inertias[:3])
    # Radius 0.6 to 0.06: the axial moment falls by a hundred.
    assert one.inertias[3:, 2, 2] == pytest.approx(100.0 * other.inertias[3:, 2, 2], rel=1e-4)
    assert sum("density" in note for note in one.notes) == 3
    assert not any("density" in note for note in other.notes)


def test_panda_is_its_file() -> None:
    arm, read = builtin_arm("panda"), load_arm(ROBOTS / "panda.urdf", tip="panda_hand_tcp")
    assert np.array_equal(arm.inertias, read.inertias)
    assert builtin_arm("panda", tip="panda_link8").tip[2, 3] == pytest.approx(0.333 + 0.316 + 0.384 - 0.107)


def ratios_of(arm: Arm) -> list[float]:
    return [rotor.ratio for rotor in arm.rotors if rotor is not None]


def test_puma_ratios_keep_their_signs() -> None:
    assert ratios_of(builtin_arm("puma560")) == [-62.6111, 107.815, -53.7063, 76.0364, 71.923, 76.686]


def test_puma_stands_as_published() -> None:
    """Corke's zero pose: arm along x; tip at (a2 + a3, -d3, d1 + d4)."""
    arm = builtin_arm("puma560")
    assert arm.tip[:3, 3] == pytest.approx([0.4318 + 0.0203, -0.15005, 0.67183 + 0.4318])
    assert arm.screws[0] == pytest.approx([0, 0, 1, 0, 0, 0])
    assert arm.screws[1, :3] == pytest.approx([0, -1, 0], abs=1e-15)
    assert arm.home[1, :3, 3] == pytest.approx([0.4318 - 0.3638, -0.2275, 0.67183 + 0.006], abs=1e-15)


def test_kr300_stands_upright_and_carries_its_payload() -> None:
    """Drawing of the R2500: shoulder at (0.35, 0.675), 1.15 m upper arm, 1 m forearm 0.041 m off the elbow."""
    arm = builtin_arm("kr300")
    assert arm.tip[:3, 3] == pytest.approx([0.35 + 1.15 + 1.0 + 0.24, 0.0, 0.675 - 0.041], abs=1e-14)
    assert arm.masses[5] == pytest.approx(157.78)
    last_in_tip = inverse_pose(arm.tip) @ arm.home[5]
    assert last_in_tip[:3, 3] == pytest.approx([0, 0, (140 * 0.1 - 17.78 * 0.05) / 157.78], abs=1e-15)
    assert arm.tip[:3, 2] == pytest.approx([1, 0, 0], abs=1e-15)
    assert any("140 kg" in note for note in arm.notes)
    assert arm.joint_names == ("A1", "A2", "A3", "A4", "A5", "A6")


@pytest.mark.parametrize("name", ["puma560", "kr300"])
def test_tables_have_a_source_and_scalar_rotors(name: str) -> None:
    data = json.loads((ROBOTS / f"{name}.json").read_text())
    assert data["source"] and data["convention"] == "classic"
    for row, rotor, screw in zip(data["rows"], builtin_arm(name).rotors, builtin_arm(name).screws, strict=True):
        assert isinstance(rotor, MountedRotor)
        assert rotor.axial_inertia == pytest.approx(row["rotor_inertia"])
        assert rotor.screw == pytest.approx(screw, abs=1e-15)
        assert rotor.mass == 0.0


def test_every_bundled_file_has_its_source() -> None:
    sources = (ROBOTS / "SOURCES.md").read_text()
    for path in ROBOTS.iterdir():
        assert path.name == "SOURCES.md" or path.name in sources
    for name in builtin_names():
        assert f"`{name}`" in sources


def test_ur5_wrist_axes_are_parallel_as_in_the_book() -> None:
    """Modern Robotics, example 4.5: screws 2, 3 and 4 are parallel, 5 turns the other way about the base's z."""
    arm = builtin_arm("ur5")
    assert arm.screws[1, :3] == pytest.approx(arm.screws[2, :3], abs=1e-10)
    assert arm.screws[1, :3] == pytest.approx(arm.screws[3, :3], abs=1e-10)
    assert arm.screws[4, :3] == pytest.approx([0, 0, -1], abs=1e-10)
    # The book's home: stretched along x by L1 + L2, W1 + W2 to the side, H1 - H2 up.
    assert arm.tip[:3, 3] == pytest.approx([0.425 + 0.39225, 0.1333 - 0.0242 + 0.0823, 0.089159 - 0.09465], abs=1e-3)
    assert log_pose(exp_pose(arm.screws[0]))[2] == pytest.approx(1.0)


def test_wam_turns_its_motors_as_its_makers_software_has_them() -> None:
    """libbarrett, config/wam7w.conf: the matrix j2mp; and the user's manual, tables 5 and 6."""
    arm = builtin_arm("wam")
    j2mp = np.zeros((7, 7))
    j2mp[0, 0], j2mp[3, 3], j2mp[6, 6] = -42.0, -18.0, -14.93
    j2mp[1:3, 1:3] = [[28.25, -16.8155], [-28.25, -16.8155]]
    j2mp[4:6, 4:6] = [[9.7, -9.7], [9.7, 9.7]]
    assert rotor_turns(arm) == pytest.approx(j2mp, abs=5e-5)
    assert coupled_groups(arm) == [(1, 2), (4, 5)]
    # The manual's other direction, equation 6: J3 = -n3 / (2 N2) M2 - n3 / (2 N3) M3.
    back = np.linalg.inv(rotor_turns(arm))
    assert back[2, 1:3] == pytest.approx([-1.68 / (2 * 28.25)] * 2)
    assert back[1, 1:3] == pytest.approx([1 / (2 * 28.25), -1 / (2 * 28.25)])
    # Stretched upwards at zero, the elbow 45 mm off the line.
    assert arm.tip[:3, 3] == pytest.approx([0.0, 0.0, 0.55 + 0.3 + 0.0609])
    assert arm.upper[3] == 3.1 and arm.lower[4] == -4.76
    assert arm.masses.sum() == pytest.approx(19.459, abs=1e-3)
