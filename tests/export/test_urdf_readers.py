"""Written files in two other readers, pinocchio and MuJoCo, give the same torques, with and without rotors."""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pinocchio as pin
import pytest

from drivetrain.arm.arm import Arm
from drivetrain.arm.files.load import load_arm
from drivetrain.arm.geared import at_level, with_rotors
from drivetrain.arm.rotors import Rotor, RotorLevel
from drivetrain.dynamics.inverse import inverse_dynamics
from drivetrain.export.urdf import urdf_text

BUILT_IN = ("kr300", "panda", "planar-2r", "puma560", "ur5", "ur5-corrected")


def bare(name: str) -> Arm:
    arm = load_arm(name)
    return with_rotors(arm, [None] * arm.n)


def sliding() -> Arm:
    """A prismatic joint without limits and a revolute one with a limit on one side, both oblique."""
    arm = replace(bare("panda"), lower=np.full(7, -np.inf), upper=np.array([np.inf] * 3 + [2.0] + [np.inf] * 3))
    screws = arm.screws.copy()
    screws[1] = [0.0, 0.0, 0.0, 0.6, 0.0, 0.8]
    return replace(arm, screws=screws)


def motion(n: int) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    rng = np.random.default_rng(11)
    return [(rng.uniform(-3, 3, n), rng.uniform(-2, 2, n), rng.uniform(-5, 5, n)) for _ in range(5)]


class InPinocchio:
    """A file's arm in pinocchio, where the position of a continuous joint is its cosine and sine."""

    def __init__(self, arm: Arm):
        self.model = pin.buildModelFromXML(urdf_text(arm))
        self.model.gravity.linear = arm.gravity
        self.data = self.model.createData()

    def torque(self, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
        place = pin.integrate(self.model, pin.neutral(self.model), q)
        return pin.rnea(self.model, self.data, place, qd, qdd)

    def add_rotors(self, arm: Arm) -> None:
        """Add rotors as the tags define them: reflected inertia at the joint, axial inertia on the carrier."""
        self.model.armature = np.array([r.ratio**2 * r.axial_inertia for r in arm.rotors])
        for i, rotor in enumerate(arm.rotors[1:], 1):
            axis = arm.home[i - 1, :3, :3].T @ (arm.screws[i, :3] if arm.screws[i, :3].any() else arm.screws[i, 3:])
            body = self.model.inertias[i]
            tensor = body.inertia + rotor.axial_inertia * np.outer(axis, axis)
            self.model.inertias[i] = pin.Inertia(body.mass, body.lever, tensor)


@pytest.mark.parametrize("name", [*BUILT_IN, "sliding"])
def test_pinocchio_reads_the_same_arm(name: str) -> None:
    arm = sliding() if name == "sliding" else bare(name)
    other = InPinocchio(arm)
    assert tuple(other.model.names)[1:] == arm.joint_names
    for q, qd, qdd in motion(arm.n):
        wanted = inverse_dynamics(arm, q, qd, qdd)
        assert other.torque(q, qd, qdd) == pytest.approx(wanted, abs=1e-12 * max(1.0, np.abs(wanted).max()))


@pytest.mark.parametrize("name", ["panda", "sliding"])
def test_pinocchio_with_armature_is_the_reflected_level(name: str) -> None:
    arm = sliding() if name == "sliding" else bare(name)
    rng = np.random.default_rng(3)
    geared = with_rotors(arm, [Rotor(r, 2e-4, 0.4) for r in rng.uniform(-120, 120, arm.n)], level=RotorLevel.REFLECTED)
    other = InPinocchio(geared)
    other.add_rotors(geared)
    for q, qd, qdd in motion(arm.n):
        wanted = inverse_dynamics(geared, q, qd, qdd)
        assert other.torque(q, qd, qdd) == pytest.approx(wanted, abs=1e-12 * np.abs(wanted).max())
        assert inverse_dynamics(at_level(geared, RotorLevel.FULL), q, qd, qdd) != pytest.approx(wanted, rel=1e-6)


def test_pinocchio_reads_limits_and_efforts() -> None:
    model = InPinocchio(bare("ur5")).model
    assert model.upperPositionLimit == pytest.approx(load_arm("ur5").upper, abs=0)
    assert model.velocityLimit == pytest.approx(load_arm("ur5").speed_limits, abs=0)
    assert (model.effortLimit > 1e300).all()


@pytest.mark.parametrize("name", ["panda", "ur5-corrected", "sliding"])
def test_mujoco_reads_the_same_arm_and_its_armature_is_the_reflected_inertia(name: str) -> None:
    """For the built-in arms with physically consistent links; MuJoCo refuses the others."""
    arm = sliding() if name == "sliding" else bare(name)
    spec = mujoco.MjSpec.from_string(urdf_text(arm))
    spec.compiler.boundinertia, spec.compiler.boundmass = 0.0, 0.0
    model = spec.compile()
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT  # without the forces of its joint limits
    model.opt.gravity[:] = arm.gravity
    data = mujoco.MjData(model)
    assert [model.joint(i).name for i in range(model.njnt)] == list(arm.joint_names)
    reflected = np.random.default_rng(4).uniform(0.5, 2.0, arm.n)
    for armature in (np.zeros(arm.n), reflected):
        model.dof_armature[:] = armature
        for data.qpos[:], data.qvel[:], data.qacc[:] in motion(arm.n):
            mujoco.mj_inverse(model, data)
            wanted = inverse_dynamics(arm, data.qpos, data.qvel, data.qacc) + armature * data.qacc
            assert data.qfrc_inverse == pytest.approx(wanted, abs=1e-11 * np.abs(wanted).max())
