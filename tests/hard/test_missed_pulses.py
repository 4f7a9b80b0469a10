"""What a step control that only looks where its stages fall does not see: short pulses, and short segments."""

from __future__ import annotations

import numpy as np
from hard_case import Figure, hard_case
from scipy.integrate import solve_ivp

from drivetrain.drive.motor import Motor
from drivetrain.effects.loads.given_torque import GivenTorque
from drivetrain.effects.motor.given import GivenCurrent
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.simulation.engines.fixed_step import FixedStep
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import joint_scene
from drivetrain.solvers.solver import Rodas4

METHODS = ("RK45", "DOP853", "LSODA", "BDF", "Radau")


@hard_case(
    "T37",
    "A pulse of 5 ms in 10 s of rest",
    setup="100 N m act at 7.3 s on 1 kg m². E1 at 0.5 s, E2 with a tolerance of 1e-6.",
    naive="scipy's five solvers with tolerances of 1e-3, 1e-6 and 1e-9, which report success",
)
def test_short_pulse() -> list[Figure]:
    pulse = GivenTorque([0.0, 7.3, 7.3, 7.305, 7.305, 10.0], [0.0, 0.0, 100.0, 100.0, 0.0, 0.0])
    scene = joint_scene(1.0, [pulse], 10.0)
    ends = {
        name: simulate(scene, solver=solver)["joint.speed"][-1]
        for name, solver in (("E1", FixedStep(0.5)), ("E2", Rodas4(1e-6)))
    }
    worst = []
    for method in METHODS:
        for rtol in (1e-3, 1e-6, 1e-9):
            run = solve_ivp(
                lambda t, y: [y[1], 100.0 if 7.3 <= t < 7.305 else 0.0], (0.0, 10.0), [0.0, 0.0],
                method=method, rtol=rtol, atol=1e-3 * rtol,
            )  # fmt: skip
            worst.append(abs(run.y[1, -1] - 0.5) if run.success else 0.0)
    assert min(worst) == 0.5  # all of them miss it, and say nothing
    return [
        Figure(
            f"error of the final speed ({name})",
            abs(end - 0.5),
            max(worst) if name == "E1" else None,
            at_most=1e-9,
            unit="rad/s",
        )
        for name, end in ends.items()
    ]


@hard_case(
    "T38",
    "Bang-bang motion with segments of 5 ms",
    setup=(
        "840 rad/s² for 5 ms, a rest, and 400 rad/s², which lead to 2.121 rad in 4 s. E1 at 10 ms, E2 with a "
        "tolerance of 1e-6."
    ),
    naive="scipy's LSODA, BDF and Radau with a tolerance of 1e-6, which report success",
)
def test_bang_bang() -> list[Figure]:
    marks = np.array([0.0, 0.5, 0.505, 0.51, 2.0, 2.0725, 2.145, 4.0])
    pushes = np.array([0.0, 840.0, -840.0, 0.0, 400.0, -400.0, 0.0])
    wanted = 840.0 * 0.005**2 + 400.0 * 0.0725**2
    time, acceleration = np.repeat(marks, 2)[1:-1], np.repeat(pushes, 2)
    effects = [MotorCurrent(Motor("m", 0.5, 0.03)), GivenCurrent(time, acceleration * 2.0 / 0.03)]
    scene = joint_scene(2.0, effects, 4.0)
    off, speed, naive = [], [], 0.0
    for solver in (FixedStep(0.01), Rodas4(1e-6)):
        run = simulate(scene, solver=solver, interval=0.1)
        off.append(abs(run["joint.position"][-1] - wanted))
        speed.append(abs(run["joint.speed"][-1]))

    def rates(t: float, y: np.ndarray) -> list[float]:
        return [y[1], float(pushes[min(np.searchsorted(marks, t, side="right") - 1, len(pushes) - 1)])]

    for method in ("LSODA", "BDF", "Radau"):
        end = solve_ivp(rates, (0.0, 4.0), [0.0, 0.0], method=method, rtol=1e-6, atol=1e-9)
        naive = max(naive, abs(end.y[0, -1] - wanted) if end.success else 0.0)
    return [
        Figure("error of the final position (E1)", off[0], naive, at_most=1e-9, unit="rad"),
        Figure("error of the final position (E2)", off[1], at_most=1e-9, unit="rad"),
        Figure("speed at the end", max(speed), at_most=1e-9, unit="rad/s"),
    ]
