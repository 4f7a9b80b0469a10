"""Modern Robotics figure 8.7 as a scene: supply, amplifiers, motors, gears, encoders, controllers and a 2R arm."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import drivetrain as dt

MOTOR = dt.Motor(
    key="150 W", resistance=0.299, torque_constant=0.0302, inductance=82e-6, rotor_inertia=1.4e-5,
    resistance_winding_housing=1.9, resistance_housing_ambient=4.65, winding_time_constant=41.0,
    housing_time_constant=1120.0,
)  # fmt: skip
GEAR = dt.Gear(key="1:100", ratio=100.0, efficiency=0.8, kind="strain_wave")
ROTOR, AMPLIFIER, SERVO = 3.3e-5, 3000.0, 1e-3  # kg m^2 with the wave generator, rad/s, s


def reach(arm: dt.Arm) -> dt.Motion:
    """A second to a posture and a second back, with no jerk at the ends."""
    u = np.linspace(0.0, 1.0, 101)
    rise = np.array([10 * u**3 - 15 * u**4 + 6 * u**5, 30 * (u**2 - 2 * u**3 + u**4), 60 * (u - 3 * u**2 + 2 * u**3)])
    path = np.concatenate([rise, rise[:, -2::-1] * np.array([[1.0], [-1.0], [1.0]])], axis=1)
    far = np.array([1.0, -1.5])
    return dt.Motion("reach", arm.joint_names, np.linspace(0.0, 2.0, 201), *(row[:, np.newaxis] * far for row in path))


def drive(load: float) -> tuple[dt.Effect, ...]:
    """What stands between one joint's command and its link."""
    axis = dt.ServoAxis(MOTOR.torque_constant, GEAR.ratio, ROTOR, load)
    gains = dt.design_loops(axis, dt.ServoTiming(AMPLIFIER, SERVO, 1), speed_bandwidth=120.0)
    return (
        dt.Encoder(4096), dt.SampledCascade(gains.position_gain, gains.speed_gain, gains.integral_time, 30.0, SERVO),
        dt.SampledCurrentLoop(MOTOR, AMPLIFIER, peak_current=30.0), dt.Winding(MOTOR), dt.FullRotor(ROTOR, GEAR.ratio),
        dt.DryFriction(dt.Friction(coulomb=0.015, static=0.025, stribeck_speed=5.0), side="motor"), dt.MeshLoss(GEAR),
        dt.WindingHeat(dt.thermal_network(MOTOR, 25.0)),
    )  # fmt: skip


def main(picture: Path) -> None:
    arm = dt.with_rotors(dt.load_arm("planar-2r"), [None, None])  # without the rotors that the book's arm has
    # The other joint gives way, so a loop feels less than the mass matrix's diagonal: the inverse of its inverse.
    rotors = ROTOR * GEAR.ratio**2
    loads = 1.0 / np.diag(np.linalg.inv(dt.mass_matrix(arm, [0.0, 0.0]) + rotors * np.eye(2))) - rotors
    bus = dt.SupplyBus(48.0, 5e-3, power=180.0, threshold=56.0, resistance=5.0)
    joints = {name: drive(float(load)) for name, load in zip(arm.joint_names, loads, strict=True)}
    scene = dt.Scene(arm, {**joints, "scene": (dt.CommandedMotion(reach(arm)), bus)}, 2.4, name="servo chain")
    print(dt.plan(scene))
    run = dt.simulate(scene, interval=2e-3)
    print(f"{run.counters['steps']} steps; energy unaccounted for {abs(run.series['energy_error'].values).max():.2g} J")
    figure = Figure(figsize=(8.0, 8.0), layout="constrained")
    rows = figure.subplots(5, 1, sharex=True)
    shown = ("position", "current", "voltage", "winding_temperature")
    for axes, what in zip(rows, shown, strict=False):
        for joint in arm.joint_names:
            axes.plot(run.time, run.series[f"{joint}.{what}"].values, label=joint)
        axes.set_ylabel(f"{what.replace('_', ' ')}\n[{run.series[f'{arm.joint_names[0]}.{what}'].unit}]")
    rows[0].legend()
    rows[4].plot(run.time, run.series["scene.bus_voltage"].values, color="C2")
    rows[4].set(ylabel="bus voltage\n[V]", xlabel="time [s]", ylim=(0.0, 60.0))
    figure.savefig(picture, dpi=120)
    print(f"drew {picture}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(Path(__file__).stem + ".png"))
