"""Two links with drives, and a crank beside the first, that several rooms try."""

from __future__ import annotations

import numpy as np

from drivetrain.arm.arm import Arm
from drivetrain.spatial.poses import pose
from drivetrain.study.objects import study as dt_study

MOTOR = {
    "torque_constant": 0.1, "resistance": 0.5, "rotor_inertia": 1e-4, "nominal_current": 8.0, "peak_current": 30.0,
    "peak_torque": 3.0, "mass": 0.8, "max_speed": 600.0, "kind": "brushless", "current_basis": "dc",
    "winding_basis": "line_line",
}  # fmt: skip
GEAR = {"ratio": 50, "kind": "planetary", "efficiency": 0.9, "mass": 1.0, "momentary_torque": 120.0,
        "repeated_peak_torque": 60.0, "stiffness_1": 2e4}  # fmt: skip
BRAKE = {"torque_side": "motor", "static_torque": 2.0, "inertia": 1e-6, "power": 8.0,
         "energy_per_stop": 50.0, "mass": 0.3}  # fmt: skip
DIFFERENTIAL = {"joints": ["shoulder", "elbow"], "type": "differential", "turns": [1.0, 1.5]}
HEIGHT = 0.2  # of the crank's joint over that of the first link [m]


def two_links(inertia=0.0, closures=None, engage_time=0.03, drive_mass="added", coupling=(), **changed):
    """Two links in a vertical plane that stop at the limit of a current or by their brakes.

    ``inertia``: more of the first link about its joint [kg m^2]; ``changed``: of ``motor``, ``gear``, ``brake``.
    """
    tensors = np.tile(0.01 * np.eye(3), (2, 1, 1))
    tensors[0] += np.diag([0.0, inertia, inertia])
    arm = Arm.from_screws(
        np.array([pose(point=[x, 0.0, 0.0]) for x in (0.15, 0.4)]), [[0, -1.0, 0, 0, 0, 0], [0, -1.0, 0, 0, 0, -0.3]],
        [2.0, 1.5], tensors, tip=pose(point=[0.5, 0.0, 0.0]), joint_points=[[0.0, 0.0, 0.0], [0.3, 0.0, 0.0]],
        joint_names=("shoulder", "elbow"), link_names=("upper", "fore"),
    )  # fmt: skip
    t = np.linspace(0.0, 2.0, 41)
    motion = t, np.column_stack([0.4 * np.sin(np.pi * t), 0.6 * np.sin(2.0 * np.pi * t)])
    own, brake = {"output_bearing": "external", "brake": "B"}, {**BRAKE, "engage_time": engage_time, "source": "t"}
    motor, gear, brake = (
        part | changed.get(name, {}) for name, part in (("motor", MOTOR), ("gear", GEAR), ("brake", brake))
    )
    return dt_study(
        arm=arm, motion=motion, motors={"M": motor}, gears={"G": gear}, brakes={"B": brake},
        drives=("M", "G"), supply="48 V", joints={"default": own}, drive_mass=drive_mass, closures=closures or [],
        coupling=list(coupling),
        amplifier={"peak_current": 20.0, "current_basis": "dc"},
    )  # fmt: skip


def crank(inertia):
    """A crank and a rod that make a parallelogram with the first link: the crank turns as that does."""
    axis, turned = [0, -1, 0], {"xx": 0.0, "yy": inertia, "zz": inertia}
    links = [
        {
            "joint": "crank",
            "axis": axis,
            "point": [0.0, 0.0, HEIGHT],
            "mass": 1.0 if inertia else 0.0,
            "inertia": turned,
        },
        {"joint": "rod", "axis": axis, "point": [0.2, 0.0, HEIGHT]},
    ]
    return [{"start": "base", "links": links, "end": "upper", "point": [0.2, 0.0, 0.0]}]


def short_crank():
    """A four-bar whose crank does not turn as the first link does; every body solid."""
    found = crank(0.3)
    own, rod = found[0]["links"]
    own |= {"com": [0.05, 0.0, 0.15], "inertia": {"xx": 0.3, "yy": 0.3, "zz": 0.3}}
    solid = {"xx": 0.01, "yy": 0.01, "zz": 0.01}
    rod |= {"point": [0.13, 0.0, HEIGHT], "mass": 0.7, "com": [0.16, 0.0, 0.21], "inertia": solid}
    return found
