"""Motors that MuJoCo's ``dcmotor`` and this package's effects can both express, written down for both.

The equations are the same, not alike. A ``dcmotor`` told a position asks for the voltage (R/K) (kp e - kd w) + K w, so
its current nears (kp e - kd w) / K with the time constant L/R: this package's current loop of bandwidth R/L, or the
current at once where there is no inductance. Its armature is the reflected rotor.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import mujoco
import numpy as np
from mujoco import rollout
from scipy.integrate import solve_ivp

import drivetrain as dt
from drivetrain.arm.arm import Arm
from drivetrain.arrays import Array
from drivetrain.drive.friction import Friction
from drivetrain.drive.motor import Motor
from drivetrain.effects.control.cascade import PositionLoop
from drivetrain.effects.control.commanded_motion import CommandedMotion
from drivetrain.effects.effect import Effect
from drivetrain.effects.friction.dry_friction import DryFriction
from drivetrain.effects.friction.lugre_friction import LuGreFriction
from drivetrain.effects.friction.viscous_friction import ViscousFriction
from drivetrain.effects.motor.cogging import Cogging
from drivetrain.effects.motor.current_loop import CurrentLoop
from drivetrain.effects.motor.given import GivenVoltage
from drivetrain.effects.motor.motor_current import MotorCurrent
from drivetrain.effects.motor.rotor import ReflectedRotor
from drivetrain.effects.motor.winding import Winding
from drivetrain.motion.motion import Motion
from drivetrain.simulation.engines.engine import Engine
from drivetrain.simulation.planning.plan import Plan
from drivetrain.simulation.planning.plan import plan as planned
from drivetrain.simulation.run import simulate
from drivetrain.simulation.scene import Inertia, Scene, joint_scene

WHAT = ("position", "current")
INTERVAL = 0.01  # s, between two instants that are compared
INTEGRATORS = ("Euler", "implicitfast", "implicit", "discrete", "RK4")
RESISTANCE, INDUCTANCE, CONSTANT, ROTOR, RATIO = 0.299, 8.2e-5, 0.0302, 3.3e-5, 100.0
MASS, REACH, OWN, DRAG, G = 2.0, 0.5, 0.7, 1.0, 9.80665  # a pendulum: kg, m, kg m^2, N m s/rad, m/s^2
MOTOR = Motor("m", RESISTANCE, CONSTANT, inductance=INDUCTANCE, rotor_inertia=ROTOR)
PAN, COULOMB, STATIC, STRIBECK, BRISTLES, BRISTLE_DRAG = (0.004, 12, 0.3), 0.015, 0.025, 5.0, 2.0, 0.002
STIFFNESS = (9000.0, 9000.0, 5000.0, 900.0, 900.0, 300.0)  # N m/rad, of the UR5's position loops
DAMPING = (600.0, 600.0, 300.0, 45.0, 45.0, 15.0)  # N m s/rad
RATIOS = (100.0, 100.0, 100.0, 80.0, 80.0, 80.0)
ROTORS = (6e-5, 6e-5, 4e-5, 8e-6, 8e-6, 8e-6)  # kg m^2
CONSTANTS = (0.12, 0.12, 0.12, 0.08, 0.08, 0.08)  # N m/A
RESISTANCES, INDUCTANCES = (0.5,) * 6, (4e-4,) * 6  # ohm, H: they follow within 0.8 ms
VISCOUS = 2.0  # N m s/rad, at every joint
START, GOAL = (0.2, -1.2, 1.0, 0.3, 0.5, 0.0), (0.8, -0.8, 0.5, 0.8, 0.1, 0.7)  # rad


@dataclass(frozen=True, eq=False)
class Twin:
    """A scene in both languages.

    Attributes:
        name: What it is.
        xml: For MuJoCo, with ``{step}`` and ``{integrator}`` to be filled in.
        scene: For this package.
        controls: (instant [s], control) pieces, each until the next.
        gains: Current over position error and over speed [A/rad, A s/rad] a joint; None: the current is a state.
    """

    name: str
    xml: str
    scene: Scene
    controls: tuple[tuple[float, tuple[float, ...]], ...]
    gains: tuple[Array, Array] | None = None
    plan: Plan = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "plan", planned(self.scene))

    @property
    def instants(self) -> Array:
        """Where the two are compared [s]."""
        return INTERVAL * np.arange(round(self.scene.duration / INTERVAL) + 1)


@dataclass(frozen=True, eq=False)
class Answer:
    """Positions [rad] and currents [A] at the instants of a twin, (N, n) each."""

    positions: Array
    currents: Array


def error(found: Answer, reference: Answer) -> float:
    """The larger of two: end position over the largest travel, and RMS of the current's error over the RMS current."""
    travel = np.abs(np.ptp(reference.positions, axis=0)).max()
    end = np.abs(found.positions[-1] - reference.positions[-1]).max() / travel
    off = np.sqrt(np.square(found.currents - reference.currents).mean())
    return float(max(end, off / np.sqrt(np.square(reference.currents).mean())))


def run_ours(twin: Twin, engine: Engine) -> Answer:
    """This package's answer."""
    run = simulate(twin.plan, solver=engine, interval=INTERVAL, checked=False)
    if run.stopped_by is not None:
        raise RuntimeError(str(run.stopped_by))
    series, names = run.series, twin.scene.joints
    position, current = (np.stack([series[f"{n}.{what}"].values for n in names], axis=1) for what in WHAT)
    return Answer(position, current)


class InMujoco:
    """A twin in MuJoCo, made ready: what ``run`` does is stepping alone, in C."""

    def __init__(self, twin: Twin, integrator: str, step: float):
        self.twin, self.every = twin, round(INTERVAL / step)
        self.model = mujoco.MjModel.from_xml_string(twin.xml.format(integrator=integrator, step=repr(step)))
        self.data = mujoco.MjData(self.model)
        count, full = round(twin.scene.duration / step), mujoco.mjtState.mjSTATE_FULLPHYSICS
        self.control = np.empty((1, count, self.model.nu))
        for at, values in twin.controls:
            self.control[:, round(at / step) :] = values
        start = beginning(twin)
        self.data.qpos[:], self.data.act[:] = start[: self.model.nq], start[2 * self.model.nq :]
        self.first = np.empty((1, mujoco.mj_stateSize(self.model, full)))
        mujoco.mj_getState(self.model, self.data, self.first[0], full)
        self.states = np.empty((1, count, self.first.shape[1]))

    def run(self) -> None:
        """Step to the end."""
        rollout.rollout([self.model], [self.data], self.first, self.control, state=self.states)

    def answer(self) -> Answer:
        """What the last run found."""
        n = self.model.nq
        rows = np.vstack([self.first, self.states[0, self.every - 1 :: self.every]])
        return answer(self.twin, rows[:, 1 : 1 + n], rows[:, 1 + n : 1 + 2 * n], rows[:, 1 + 2 * n :])


def answer(twin: Twin, q: Array, qd: Array, own: Array) -> Answer:
    """Positions and currents from MuJoCo's states: the currents are the last of the actuators' own ones."""
    if twin.gains is None:
        return Answer(q, own[:, -q.shape[1] :])
    stiff, damp = twin.gains
    return Answer(q, stiff * (np.array(GOAL) - q) - damp * qd)


def beginning(twin: Twin) -> Array:
    """Positions, speeds and actuator states at the start; currents as this package starts them."""
    n, model = len(twin.scene.joints), mujoco.MjModel.from_xml_string(twin.xml.format(integrator="Euler", step="1e-12"))
    position = np.zeros(n) if twin.scene.position is None else twin.scene.position
    own = np.zeros(model.na)
    if model.na >= n:
        first = simulate(twin.plan, duration=1e-3, interval=1e-3).series
        own[-n:] = [first[f"{name}.current"].values[0] for name in twin.scene.joints]
    return np.concatenate([position, np.zeros(n), own])


def reference(twin: Twin, *, rtol: float = 1e-10, method: str = "DOP853") -> Answer:
    """A third way: MuJoCo's equations under scipy's step control, afresh at every change of the control."""
    model = mujoco.MjModel.from_xml_string(twin.xml.format(integrator="Euler", step="1e-12"))
    data, n = mujoco.MjData(model), model.nq

    def rates(_: float, y: Array) -> Array:
        data.qpos[:], data.qvel[:], data.act[:] = y[:n], y[n : 2 * n], y[2 * n :]
        mujoco.mj_forward(model, data)
        return np.concatenate([data.qvel, data.qacc, data.act_dot])

    times, state, parts = twin.instants, beginning(twin), []
    ends = [*(at for at, _ in twin.controls[1:]), twin.scene.duration]
    for (first, values), last in zip(twin.controls, ends, strict=True):
        data.ctrl[:] = values
        inside = times[(times >= first - 1e-9) & (times < last - 1e-9)].clip(first, last)
        done = solve_ivp(rates, (first, last), state, method, np.append(inside, last), rtol=rtol, atol=1e-3 * rtol)
        parts.append(done.y[:, :-1].T)
        state = done.y[:, -1]
    rows = np.vstack([*parts, state])
    return answer(twin, rows[:, :n], rows[:, n : 2 * n], rows[:, 2 * n :])


def pendulum_xml(actuator: str, loss: float = 0.0) -> str:
    """A pendulum that gravity turns back from above; position 0 is level."""
    own = f"{OWN} {OWN} {OWN}"
    return f"""<mujoco><option timestep="{{step}}" integrator="{{integrator}}" gravity="0 0 -{G}"/><worldbody><body>
    <joint name="joint" type="hinge" axis="0 -1 0" damping="{DRAG}" frictionloss="{loss}"/>
    <inertial pos="{REACH} 0 0" mass="{MASS}" diaginertia="{own}"/></body></worldbody>
    <actuator>{actuator}</actuator></mujoco>"""


def motor_xml(more: str = "", joint: str = "joint") -> str:
    """The motor of the pendulum."""
    return (
        f'<dcmotor joint="{joint}" gear="{RATIO}" motorconst="{CONSTANT}" resistance="{RESISTANCE}" '
        f'inductance="{INDUCTANCE}" armature="{ROTOR}" {more}/>'
    )


def pendulum(effects: list[Effect], duration: float, position: float = 0.0) -> Scene:
    """The same pendulum here."""
    load = Inertia(OWN + MASS * REACH**2, weight=MASS * G * REACH)
    always = [ReflectedRotor(ROTOR, RATIO), ViscousFriction(Friction(viscous=DRAG))]
    return joint_scene(load, [*always, *effects], duration, position=position)


def voltages(controls: tuple[tuple[float, tuple[float, ...]], ...], end: float) -> GivenVoltage:
    """Pieces of constant voltage."""
    times = np.repeat([*(at for at, _ in controls), end], 2)[1:-1]
    return GivenVoltage(times, np.repeat([values[0] for _, values in controls], 2))


def one_joint() -> Twin:
    """A geared joint at a voltage that jumps."""
    controls = ((0.0, (12.0,)), (1.0, (-12.0,)), (2.0, (6.0,)), (3.0, (0.0,)))
    scene = pendulum([Winding(MOTOR), voltages(controls, 4.0)], 4.0)
    return Twin("one joint, voltage", pendulum_xml(motor_xml()), scene, controls)


def one_joint_bristles() -> Twin:
    """The same with LuGre friction and cogging at the rotor."""
    controls = ((0.0, (3.0,)), (1.0, (0.0,)), (1.5, (-3.0,)))
    size, order, phase = PAN
    more = (
        f'cogging="{size} {order} {phase + math.pi}" '
        f'lugre="{BRISTLES} {BRISTLE_DRAG} {COULOMB} {STATIC} {STRIBECK}"'
    )  # its cogging pushes where ours pulls
    effects: list[Effect] = [
        Winding(MOTOR), voltages(controls, 2.5), Cogging((size,), (int(order),), (phase,)),
        LuGreFriction(BRISTLES, COULOMB, STATIC, STRIBECK, BRISTLE_DRAG, side="motor"),
    ]  # fmt: skip
    return Twin("one joint, LuGre and cogging", pendulum_xml(motor_xml(more)), pendulum(effects, 2.5), controls)


def holding(loss: float, share: float, duration: float) -> tuple[str, Scene]:
    """A pendulum that dry friction holds level, at a share of what it could; without motor, in both languages."""
    level = math.acos(share * loss / (MASS * G * REACH))
    scene = pendulum([DryFriction(Friction(coulomb=loss), "joint")], duration, level)
    return pendulum_xml("", loss).replace('axis="0 -1 0"', f'axis="0 -1 0" armature="{ROTOR * RATIO**2}"'), scene


def six_joints(inductance: bool) -> Twin:
    """A geared UR5 whose position loops pull it from one posture to another."""
    arm = dt.load_arm("ur5")
    effects: dict[str, tuple[Effect, ...]] = {"scene": (CommandedMotion(_stays(arm)),)}
    actuators = []
    gains = np.array(STIFFNESS) / (np.array(RATIOS) * CONSTANTS), np.array(DAMPING) / (np.array(RATIOS) * CONSTANTS)
    for i, name in enumerate(arm.joint_names):
        motor = Motor(name, RESISTANCES[i], CONSTANTS[i], inductance=INDUCTANCES[i] if inductance else None)
        stage = CurrentLoop(motor, RESISTANCES[i] / INDUCTANCES[i]) if inductance else MotorCurrent(motor)
        loop = PositionLoop(STIFFNESS[i], DAMPING[i], CONSTANTS[i])
        drag = ViscousFriction(Friction(viscous=VISCOUS))
        effects[name] = (ReflectedRotor(ROTORS[i], RATIOS[i]), loop, stage, drag)
        more = f'inductance="{INDUCTANCES[i]}"' if inductance else ""
        actuators.append(
            f'<dcmotor joint="{name}" gear="{RATIOS[i]}" motorconst="{CONSTANTS[i]}" resistance="{RESISTANCES[i]}" '
            f'armature="{ROTORS[i]}" input="pos" controller="{STIFFNESS[i] / RATIOS[i] ** 2} 0 '
            f'{DAMPING[i] / RATIOS[i] ** 2}" {more}/>'
        )
    scene = Scene(arm, effects, 2.0, np.array(START))
    control = tuple(r * q for r, q in zip(RATIOS, GOAL, strict=True))
    name = f"UR5, position loops, {'with' if inductance else 'without'} inductance"
    return Twin(name, _arm_xml(arm, actuators), scene, ((0.0, control),), None if inductance else gains)


def _stays(arm: Arm) -> Motion:
    """A command that stays at the goal."""
    goal, still = np.tile(GOAL, (2, 1)), np.zeros((2, arm.n))
    return Motion("goal", arm.joint_names, np.array([0.0, 2.0]), goal, still, still)


def _arm_xml(arm: Arm, actuators: list[str]) -> str:
    """An arm of turning joints; frames are parallel to the base's at joint positions zero."""
    lines = [
        '<mujoco><compiler angle="radian" balanceinertia="false" boundmass="0" boundinertia="0" autolimits="false"/>',
        f'<option timestep="{{step}}" integrator="{{integrator}}" gravity="{_text(*arm.gravity)}"/><worldbody>',
    ]
    before = np.zeros(3)
    for i, screw in enumerate(arm.screws):
        point, home = arm.joint_points[i], arm.home[i]
        own = home[:3, :3] @ arm.inertias[i] @ home[:3, :3].T
        tensor = _text(*np.diag(own), own[0, 1], own[0, 2], own[1, 2])
        lines += [
            f'<body pos="{_text(*(point - before))}">',
            f'<joint name="{arm.joint_names[i]}" type="hinge" axis="{_text(*screw[:3])}" damping="{VISCOUS}"/>',
            f'<inertial pos="{_text(*(home[:3, 3] - point))}" mass="{arm.masses[i]}" fullinertia="{tensor}"/>',
        ]
        before = point
    return "\n".join([*lines, *["</body>"] * arm.n, "</worldbody><actuator>", *actuators, "</actuator></mujoco>"])


def _text(*values: float) -> str:
    return " ".join(repr(float(value)) for value in values)
