"""The same arm in MuJoCo; rotors only as armature, MuJoCo's name for the reflected inertia."""

from __future__ import annotations

import mujoco
import numpy as np

from drivetrain.arm.arm import Arm


class InMujoco:
    """Body frames are parallel to the base's when every joint is at zero, with the origin where the joint sits."""

    def __init__(self, arm: Arm, armature: np.ndarray | None = None):
        self.model = mujoco.MjModel.from_xml_string(_xml(arm, np.zeros(arm.n) if armature is None else armature))
        self.data = mujoco.MjData(self.model)

    def torque(self, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray) -> np.ndarray:
        self.data.qpos[:], self.data.qvel[:], self.data.qacc[:] = q, qd, qdd
        mujoco.mj_inverse(self.model, self.data)
        return self.data.qfrc_inverse.copy()

    def mass_matrix(self, q: np.ndarray) -> np.ndarray:
        self.data.qpos[:], self.data.qvel[:] = q, 0.0
        mujoco.mj_forward(self.model, self.data)
        result = np.zeros((self.model.nv, self.model.nv))
        mujoco.mj_fullM(self.model, self.data, result)
        return result


def _text(*values: float) -> str:
    return " ".join(repr(float(value)) for value in values)


def _xml(arm: Arm, armature: np.ndarray) -> str:
    lines = [
        "<mujoco>",
        '<compiler angle="radian" balanceinertia="false" boundmass="0" boundinertia="0" autolimits="false"/>',
        f'<option gravity="{_text(*arm.gravity)}"/>',
        "<worldbody>",
    ]
    before = np.zeros(3)
    for i, screw in enumerate(arm.screws):
        point, home = arm.joint_points[i], arm.home[i]
        turning = bool(screw[:3].any())
        i_ = home[:3, :3] @ arm.inertias[i] @ home[:3, :3].T
        tensor = _text(i_[0, 0], i_[1, 1], i_[2, 2], i_[0, 1], i_[0, 2], i_[1, 2])
        lines += [
            f'<body pos="{_text(*(point - before))}">',
            f'<joint type="{"hinge" if turning else "slide"}" axis="{_text(*(screw[:3] if turning else screw[3:]))}" '
            f'armature="{_text(armature[i])}"/>',
            f'<inertial pos="{_text(*(home[:3, 3] - point))}" mass="{_text(arm.masses[i])}" fullinertia="{tensor}"/>',
        ]
        before = point
    return "\n".join([*lines, *["</body>"] * arm.n, "</worldbody></mujoco>"])
