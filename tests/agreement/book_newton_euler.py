"""Equations 8.103 to 8.111 of Modern Robotics, written with 6x6 matrices, one sample at a time.

The book lets rotor i ride on link i-1; here on any link, so that all link twists are found before the rotors', and a
link carries every rotor whose stator it holds.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm

from drivetrain.arm.arm import Arm


def skew(v: np.ndarray) -> np.ndarray:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def bracket(screw: np.ndarray) -> np.ndarray:
    result = np.zeros((4, 4))
    result[:3, :3], result[:3, 3] = skew(screw[:3]), screw[3:]
    return result


def big_adjoint(pose: np.ndarray) -> np.ndarray:
    result = np.zeros((6, 6))
    result[:3, :3] = result[3:, 3:] = pose[:3, :3]
    result[3:, :3] = skew(pose[:3, 3]) @ pose[:3, :3]
    return result


def small_adjoint(twist: np.ndarray) -> np.ndarray:
    result = np.zeros((6, 6))
    result[:3, :3] = result[3:, 3:] = skew(twist[:3])
    result[3:, :3] = skew(twist[3:])
    return result


def spatial_inertia(mass: float, tensor: np.ndarray) -> np.ndarray:
    result = np.zeros((6, 6))
    result[:3, :3], result[3:, 3:] = tensor, mass * np.eye(3)
    return result


class Body:
    """A link or a rotor: home frame at its centre of mass, its screw there, what it rides on."""

    def __init__(self, home: np.ndarray, screw: np.ndarray, carrier_home: np.ndarray, mass: float, tensor: np.ndarray):
        self.home = np.linalg.inv(home) @ carrier_home  # M_{i,carrier}
        self.axis = big_adjoint(np.linalg.inv(home)) @ screw  # A_i, or R_i
        self.inertia = spatial_inertia(mass, tensor)  # G_i

    def move(self, q: float, qd: float, qdd: float, twist: np.ndarray, rate: np.ndarray) -> None:
        """8.103 to 8.108; for a rotor q is ratio times the joint's."""
        self.to_carrier = big_adjoint(expm(-bracket(self.axis) * q) @ self.home)
        self.twist = self.to_carrier @ twist + self.axis * qd
        self.rate = self.to_carrier @ rate + small_adjoint(self.twist) @ self.axis * qd + self.axis * qdd

    def wrench(self) -> np.ndarray:
        return self.inertia @ self.rate - small_adjoint(self.twist).T @ (self.inertia @ self.twist)


def book_torques(
    arm: Arm, q: np.ndarray, qd: np.ndarray, qdd: np.ndarray, tip: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Gear torques 8.110 and motor torques 8.111."""
    homes = [np.eye(4), *arm.home]
    base_rate = np.concatenate([np.zeros(3), -arm.gravity])
    links: list[Body] = []
    for i in range(arm.n):
        link = Body(arm.home[i], arm.screws[i], homes[i], arm.masses[i], arm.inertias[i])
        before = (links[-1].twist, links[-1].rate) if links else (np.zeros(6), base_rate)
        link.move(q[i], qd[i], qdd[i], *before)
        links.append(link)
    rotors: list[Body | None] = []
    for i, r in enumerate(arm.rotors):
        rotors.append(None)
        if r is not None:
            rotors[i] = rotor = Body(r.home, r.screw, homes[r.carrier + 1], r.mass, r.inertia)
            carrier = (links[r.carrier].twist, links[r.carrier].rate) if r.carrier >= 0 else (np.zeros(6), base_rate)
            rotor.move(r.ratio * q[i], r.ratio * qd[i], r.ratio * qdd[i], *carrier)
    to_last = big_adjoint(np.linalg.inv(arm.tip) @ arm.home[-1])  # T_{n+1,n}, fixed
    passed = to_last.T @ tip
    gear, motor = np.zeros(arm.n), np.zeros(arm.n)
    for i in range(arm.n - 1, -1, -1):
        wrench = passed + links[i].wrench()  # 8.109
        for j, r in enumerate(arm.rotors):
            if r is not None and r.carrier == i:
                wrench = wrench + rotors[j].to_carrier.T @ rotors[j].wrench()
        gear[i] = links[i].axis @ wrench  # 8.110
        passed = links[i].to_carrier.T @ wrench
        if rotors[i] is None:
            motor[i] = gear[i]
        else:
            motor[i] = gear[i] / arm.rotors[i].ratio + rotors[i].axis @ rotors[i].wrench()  # 8.111
    return gear, motor
