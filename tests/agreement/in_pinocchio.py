"""The same arm in pinocchio, its rotors as further bodies on joints of their own."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from drivetrain.arm.arm import Arm
from drivetrain.arm.coupling import rotor_turns


class InPinocchio:
    """Body frames are parallel to the base's when every joint is at zero; rotor joints follow the links' joints."""

    def __init__(self, arm: Arm, rotors: bool = True):
        self.arm, self.model = arm, pin.Model()
        self.model.gravity.linear = arm.gravity
        self.points = np.vstack([np.zeros(3), arm.joint_points])
        self.ids = [0]
        for i, screw in enumerate(arm.screws):
            self.ids.append(self._joint(i - 1, _kind(screw), arm.joint_points[i], f"joint {i}"))
            self._body(self.ids[-1], arm.joint_points[i], arm.masses[i], arm.home[i], arm.inertias[i])
        self.rotor_ids: dict[int, int] = {}
        mounted = [(i, rotor) for i, rotor in enumerate(arm.rotors if rotors else ()) if rotor is not None]
        # Outermost carriers first: pinocchio's derivatives want what hangs on a joint to stand together after it.
        for i, rotor in sorted(mounted, key=lambda pair: -pair[1].carrier):
            point = np.cross(rotor.screw[:3], rotor.screw[3:])
            kind = pin.JointModelRevoluteUnaligned(rotor.screw[:3])
            joint = self._joint(rotor.carrier, kind, point, f"rotor {i}")
            self._body(joint, point, rotor.mass, rotor.home, rotor.inertia)
            self.rotor_ids[i] = joint
        self.data = self.model.createData()

    def _joint(self, carrier: int, kind: object, point: np.ndarray, name: str) -> int:
        place = pin.SE3(np.eye(3), point - self.points[carrier + 1])
        return self.model.addJoint(self.ids[carrier + 1], kind, place, name)

    def _body(self, joint: int, point: np.ndarray, mass: float, home: np.ndarray, inertia: np.ndarray) -> None:
        turn = home[:3, :3]
        body = pin.Inertia(float(mass), home[:3, 3] - point, turn @ inertia @ turn.T)
        self.model.appendBodyToJoint(joint, body, pin.SE3.Identity())

    def spread(self, values: np.ndarray) -> np.ndarray:
        """Joint values as those of every joint of the model: a rotor's is N times all (its ratio times its joint's)."""
        full = np.zeros(self.model.nv)
        for i, joint in enumerate(self.ids[1:]):
            full[self.model.joints[joint].idx_v] = values[i]
        for i, joint in self.rotor_ids.items():
            full[self.model.joints[joint].idx_v] = rotor_turns(self.arm)[i] @ values
        return full

    def torques(self, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray, tip: np.ndarray | None = None) -> np.ndarray:
        """(2, n): at the joints without the rotors' own, and at the motors."""
        motion = (self.spread(q), self.spread(qd), self.spread(qdd))
        if tip is None:
            full = pin.rnea(self.model, self.data, *motion)
        else:
            full = pin.rnea(self.model, self.data, *motion, self._reaction(tip))
        gear = np.array([full[self.model.joints[joint].idx_v] for joint in self.ids[1:]])
        # Virtual work: gear . qd + rotor torques . (N qd) = motor . (N qd).
        motor = np.linalg.solve(rotor_turns(self.arm).T, gear)
        for i, joint in self.rotor_ids.items():
            motor[i] += full[self.model.joints[joint].idx_v]
        return np.array([gear, motor])

    def _reaction(self, tip: np.ndarray) -> pin.StdVec_Force:
        forces = pin.StdVec_Force([pin.Force.Zero() for _ in range(self.model.njoints)])
        place = pin.SE3(self.arm.tip[:3, :3], self.arm.tip[:3, 3] - self.arm.joint_points[-1])
        forces[self.ids[-1]] = -place.act(pin.Force(tip[3:], tip[:3]))
        return forces


def _kind(screw: np.ndarray) -> object:
    if not screw[:3].any():
        return pin.JointModelPrismaticUnaligned(screw[3:])
    pitch = float(screw[:3] @ screw[3:])
    if abs(pitch) < 1e-12:
        return pin.JointModelRevoluteUnaligned(screw[:3])
    return pin.JointModelHelicalUnaligned(screw[:3], pitch)
