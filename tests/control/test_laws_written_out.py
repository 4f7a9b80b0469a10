"""The laws of a tick on plain numbers, against formulas with every case written out."""

from __future__ import annotations

import ctypes
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from crank_arm import DIFFERENTIAL, short_crank, two_links
from numba import types

import drivetrain as dt
from drivetrain.arm.arm import Arm
from drivetrain.arm.bodies import on_moving_base
from drivetrain.arm.coupling import shaft_torques, shaft_turns
from drivetrain.control import commander, laws
from drivetrain.control.c_code import _pins, _plain
from drivetrain.control.laws import Axis, Balances, Chains
from drivetrain.drive.amplifier import Amplifier
from drivetrain.drive.counterbalance import Counterbalance
from drivetrain.drive.friction import Friction
from drivetrain.drive.gear import Gear, complete, mesh_of
from drivetrain.drive.motor import Motor
from drivetrain.drive.thermal.thermal_network import ThermalNetwork
from drivetrain.dynamics.closed import whole_motion
from drivetrain.effects.motor.winding_heat import WindingHeat
from drivetrain.jit import callback
from drivetrain.records import as_records

AMBIENT, INNER, OUTER, WINDING, HOUSING = 22.0, 0.6, 1.7, 30.0, 40.0  # [C], [K/W], [K/W], [J/K], [J/K]
RESISTANCE, CONSTANT, MAGNETS, INDUCTANCE = 0.8, 0.07, -0.002, 3e-4


def an_axis(**changes: Any) -> Axis:
    """An axis with a gear of ratio -40 without loss, friction on both sides, counterbalances and every limit."""
    motor = Motor(
        "m", RESISTANCE, CONSTANT, inductance=INDUCTANCE, rotor_inertia=1e-5, peak_torque=1.4,
        reference_temperature=25.0, magnet_coefficient=MAGNETS, max_winding_temperature=130.0,
    )  # fmt: skip
    heat = WindingHeat(ThermalNetwork(INNER, OUTER, WINDING, HOUSING, AMBIENT), gear_heat=0.5).own(None)  # type: ignore[arg-type]
    heat.winding_temperature, heat.housing_temperature = 70.0, 45.0
    usual: dict[str, Any] = {
        "motor": motor, "gear": complete(Gear("g", -40.0, efficiency=1.0, inertia=0.0)),
        "amplifier": Amplifier(peak_current=24.0, continuous_current=8.0, peak_time=2.0),
        "joint": Friction(coulomb=3.0, viscous=2.0), "shaft": Friction(coulomb=0.02, viscous=1e-4),
        "balances": Balances(Counterbalance(torque=5.0), Counterbalance(torque=-2.0), Counterbalance(torque=9.0)),
        "heat": heat, "travel": 1.0, "gear_temperature": 25.0, "volts": 40.0, "most": 24.0, "heats": 1.0,
        "overloads": 1.0, "fade": 10.0, "slow": 0.05, "bandwidth": 30.0, "step": 2e-3, "current": 4.0, "overload": 0.5,
    }  # fmt: skip
    return Axis(**(usual | changes))


def plain_axis(**changes: Any) -> Any:
    """The same as an object with the fields of its record."""
    return _plain(as_records([an_axis(**changes)]))[0]


def turning_torque(load: float, speed: float) -> float:
    """Of the motor at a speed of the gear's output, whose friction has the sign of the speed."""
    sign = math.copysign(1.0, speed)
    return (load + 3.0 * sign + 2.0 * speed) / -40.0 + 0.02 * -sign + 1e-4 * -40.0 * speed


@pytest.mark.parametrize("speed", [0.3, -0.7, 0.05, -0.05, 0.02, -0.012, 0.0])
@pytest.mark.parametrize("load", [12.0, -7.0])
def test_torque_fades_between_the_directions(load: float, speed: float) -> None:
    """Below 0.05 rad/s a line between the torques at both ends of that range."""
    share = min(max(speed / 0.05, -1.0), 1.0)
    ends = [turning_torque(load, way * max(abs(speed), 0.05)) for way in (1.0, -1.0)]
    wanted = 0.5 * (1.0 + share) * ends[0] + 0.5 * (1.0 - share) * ends[1]
    axis = plain_axis()
    assert laws.torque_for_load(axis, mesh_of(axis.gear), load, speed) == pytest.approx(wanted, rel=1e-12)


def test_counterbalances_of_a_joint_add() -> None:
    assert laws.counterbalance_torque(plain_axis().balances, 0.3) == pytest.approx(12.0)


@pytest.mark.parametrize("heats", [0.0, 1.0])
@pytest.mark.parametrize("overloads", [0.0, 1.0])
def test_limits_of_the_current(heats: float, overloads: float) -> None:
    """Voltage with inductance first, then the smallest of amplifier, motor, overload, faded by the temperature."""
    rng, hit = np.random.default_rng(3), set()
    for _ in range(120):
        axis = plain_axis(heats=heats, overloads=overloads)
        axis.wanted, axis.current = rng.uniform(-60.0, 60.0), rng.uniform(-24.0, 24.0)
        axis.overload, axis.heat.winding_temperature = rng.uniform(15.98, 16.0), rng.uniform(100.0, 135.0)
        axis.most, axis.volts = rng.uniform(5.0, 30.0), rng.uniform(5.0, 60.0)
        constant, resistance, turning = -0.066, 0.93, rng.uniform(-500.0, 500.0)
        per_step = INDUCTANCE / 2e-3
        free = [(way * axis.volts - constant * turning + per_step * axis.current) / (resistance + per_step)
                for way in (-1.0, 1.0)]  # fmt: skip
        limits = {"amplifier": axis.most, "motor": 1.4 / 0.066}
        if overloads:  # of 8 = (24/8)^2 - 1 for 2 s, what is left may be used in one step
            limits["overload"] = 8.0 * math.sqrt(1.0 + (16.0 - axis.overload) / 2e-3)
        least = min(limits, key=limits.get)  # type: ignore[arg-type]
        most = limits[least]
        if heats:
            most *= min(max((130.0 - axis.heat.winding_temperature) / 10.0, 0.0), 1.0)
        wanted = min(max(axis.wanted, free[0]), free[1])
        hit |= {least, "volts" if wanted != axis.wanted else "", "heat" if heats and most < limits[least] else ""}
        wanted = min(max(wanted, -most), most)
        assert laws.limited(axis, constant, resistance, turning) == pytest.approx(wanted, rel=1e-9, abs=1e-12)
    assert {"amplifier", "motor", "volts"} <= hit
    assert ("heat" in hit) == bool(heats) and ("overload" in hit) == bool(overloads)


def test_unknown_data_set_no_limit() -> None:
    """Without inductance the current may jump; without a peak torque only the amplifier limits it."""
    axis = plain_axis(
        motor=Motor("m", RESISTANCE, CONSTANT, max_winding_temperature=130.0), most=900.0, heats=0.0, overloads=0.0
    )
    axis.wanted = 1000.0
    assert laws.limited(axis, CONSTANT, RESISTANCE, 100.0) == pytest.approx((40.0 - 7.0) / RESISTANCE)
    axis.volts = 1e6
    assert laws.limited(axis, CONSTANT, RESISTANCE, 100.0) == 900.0


def test_a_tick_of_plain_axis() -> None:
    """Current from torque and warm magnets; heat and overload by their own equations in ten thousand small steps."""
    axis = plain_axis(volts=400.0, most=500.0)
    load, rotor, planned, measured = 90.0, 6.0, 0.4, 0.35
    laws.drive(axis, load, rotor, planned, measured)
    constant = CONSTANT * (1.0 + MAGNETS * (45.0 - 25.0))
    torque = rotor / -40.0 + turning_torque(load, planned)
    assert axis.wanted == pytest.approx(torque / constant)
    warm = RESISTANCE * (1.0 + 0.0039 * (70.0 - 25.0))
    limited = plain_axis(volts=400.0, most=500.0)
    limited.wanted = axis.wanted
    assert axis.current == pytest.approx(laws.limited(limited, constant, warm, -40.0 * measured), rel=1e-9)
    turning = -40.0 * measured
    friction = (0.02 * math.copysign(1.0, turning) + 1e-4 * turning) * turning  # [W], the gear loses nothing
    winding, housing, step = 70.0, 45.0, 2e-3 / 1e4
    for _ in range(10_000):
        flow = (winding - housing) / INNER
        winding += step * (warm * axis.current**2 - flow) / WINDING
        housing += step * (flow + friction - (housing - AMBIENT) / OUTER) / HOUSING
    assert axis.heat.winding_temperature == pytest.approx(winding, abs=1e-7)
    assert axis.heat.housing_temperature == pytest.approx(housing, abs=1e-7)
    assert axis.overload == pytest.approx(max(0.5 + 2e-3 * ((axis.current / 8.0) ** 2 - 1.0), 0.0))
    cold = plain_axis(volts=400.0, most=500.0, heats=0.0, overloads=0.0)
    laws.drive(cold, load, rotor, planned, measured)
    assert (cold.heat.winding_temperature, cold.heat.housing_temperature, cold.overload) == (70.0, 45.0, 0.5)
    assert cold.current == pytest.approx(min(abs(torque / constant), 1.4 / constant) * math.copysign(1.0, torque))


def test_the_losses_of_the_gear_heat_its_motor_in_part() -> None:
    """Half of the mesh loss of a gear of 80 %, at the speed that was measured."""
    gear = complete(Gear("g", -40.0, efficiency=0.8, inertia=0.0))
    lossy, lossless = (
        plain_axis(gear=one, shaft=Friction()) for one in (gear, complete(Gear("g", -40.0, efficiency=1.0)))
    )
    for axis in (lossy, lossless):
        axis.motor.magnet_coefficient, axis.most, axis.volts = 0.0, 0.0, 1e9  # no current
        laws.drive(axis, 90.0, 0.0, 0.4, 0.35)
        assert axis.current == 0.0
    rise = lossy.heat.housing_temperature - lossless.heat.housing_temperature
    lost = 90.0 * 0.35 * (1.0 / 0.8 - 1.0)
    assert rise == pytest.approx(0.5 * lost * 2e-3 / HOUSING, rel=1e-3)


def test_feedback_and_balances_of_a_tick() -> None:
    """The acceleration is that of the target, plus bandwidth squared times the error and twice it times its rate."""
    axes = [plain_axis(bandwidth=30.0), plain_axis(bandwidth=20.0)]
    none = np.zeros((2, 2))
    arm: Any = SimpleNamespace(
        pins=SimpleNamespace(follow=()), chains=(), shares=none, unmixed=np.eye(2), turns=np.eye(2)
    )
    targets = np.array([[0.4, -0.2], [1.0, 2.0], [5.0, -3.0], [0.3, -0.25], [0.8, 2.5]])
    laws.command(arm, axes, targets, 0.0)
    assert axes[0].acceleration == pytest.approx(5.0 + 900.0 * 0.1 + 60.0 * 0.2)
    assert axes[1].acceleration == pytest.approx(-3.0 + 400.0 * 0.05 + 40.0 * -0.5)
    for axis, speed in zip(axes, targets[1], strict=True):
        assert axis.balance_torque == 12.0 and (axis.load, axis.rotor_torque) == (0.0, 0.0)
        constant = CONSTANT * (1.0 + MAGNETS * (45.0 - 25.0))
        assert axis.wanted * constant == pytest.approx(turning_torque(-12.0, speed))


def remembered(arm: Arm, axes: list[Axis], targets: np.ndarray, base: np.ndarray | None) -> list[Any]:
    """The arrays of a tick, with a linkage at the targets."""
    carried = 0 if base is None else 6
    memory = commander.memory(arm, as_records(axes), targets, carried=carried)
    if arm.linkage is not None:
        still = 0.0 * targets[:1]
        memory[commander.WHOLE_AT]["place"] = whole_motion(arm.linkage, targets[:1], still, still).position
    if base is not None:
        memory[commander.OWN_AT][:, :carried] = base
    return memory


def ticked(memory: list[Any], targets: np.ndarray) -> list[Any]:
    """The axes after a tick, by the laws in plain Python."""
    own = [_plain(one) for one in memory[commander.LINKS_AT : commander.SHARES_AT + 1]]
    found = _plain(memory[commander.AXES_AT])
    laws.command(Chains(*own, _pins(SimpleNamespace(memory=memory))), found, targets, 1.0)  # type: ignore[arg-type]
    return found


def called(memory: list[Any]) -> int:
    """A tick as a controller calls it, by the addresses of the arrays; why it is refused, 0 if it is not."""
    function = callback(types.void(types.CPointer(types.voidptr)), commander._tick).ctypes
    addresses = np.array([one.ctypes.data for one in memory], dtype=np.intp)
    function(ctypes.cast(addresses.ctypes.data, function.argtypes[0]))
    return int(memory[commander.SIZES][9])


@pytest.mark.parametrize("which", ["two links", "coupled", "four-bar", "coupled four-bar", "moving base"])
def test_torques_of_a_tick_are_those_of_inverse_dynamics(which: str) -> None:
    """Without losses, motor torque times ratio over travel is the shafts' torque, besides friction at their speeds."""
    closures = short_crank() if "four-bar" in which else None
    bare = two_links(closures=closures, coupling=[DIFFERENTIAL] if "coupled" in which else ()).arm
    ratios, inertias, travels = np.array([50.0, -80.0]), np.array([4e-4, 7e-4]), np.array([1.0, 0.3])
    arm = dt.with_rotors(bare, [dt.Rotor(*one) for one in zip(ratios, inertias, strict=True)])
    axes = [
        an_axis(gear=complete(Gear("g", ratio, efficiency=1.0, inertia=0.0)), travel=travel,
                     joint=Friction(viscous=2.0), shaft=Friction(), balances=Balances(), bandwidth=0.0, volts=9.0)
        for ratio, travel in zip(ratios, travels, strict=True)
    ]  # fmt: skip
    rng = np.random.default_rng(8)
    for _ in range(3):
        q, qd, qdd = (size * rng.uniform(-1.0, 1.0, 2) for size in (0.4, 3.0, 10.0))
        base, moved = None, (q, qd, qdd)
        if which == "moving base":
            base = rng.uniform(-0.5, 0.5, (3, 6)) * np.array([[1.0], [2.0], [4.0]])
            moved = tuple(np.concatenate(both) for both in zip(base, moved, strict=True))
        whole = dt.inverse_dynamics(arm if base is None else on_moving_base(arm), *moved)[-2:]
        measured = qd + rng.uniform(-1.0, 1.0, 2)
        targets = np.array([q, qd, qdd, q, measured])
        found = ticked(remembered(arm, axes, targets, base), targets)
        torque = shaft_torques(arm, whole) * travels + 2.0 * shaft_turns(arm) @ qd / travels
        wanted = np.array([axis.wanted for axis in found]) * CONSTANT * (1.0 + MAGNETS * (45.0 - 25.0)) * ratios
        np.testing.assert_allclose(wanted, torque, rtol=1e-9, atol=1e-9 * np.abs(torque).max())
        turning = ratios * (shaft_turns(arm) @ measured) / travels
        for axis, fresh, speed in zip(found, _plain(as_records(axes)), turning, strict=True):
            fresh.wanted, warm = axis.wanted, RESISTANCE * (1.0 + 0.0039 * (70.0 - 25.0))
            limit = laws.limited(fresh, CONSTANT * (1.0 + MAGNETS * (45.0 - 25.0)), warm, speed)
            assert axis.current == pytest.approx(limit, rel=1e-9)
        memory = remembered(arm, axes, targets, base)
        assert called(memory) == 0
        for name in ("wanted", "current", "overload"):
            same = pytest.approx([getattr(axis, name) for axis in found], rel=1e-9, abs=1e-12)
            assert memory[commander.AXES_AT][name].tolist() == same
        if which == "two links":  # the second rotor turns with the first link, besides
            rotors = inertias * ratios * (ratios * qdd + [0.0, qdd[0]])
            assert [axis.rotor_torque for axis in found] == pytest.approx(rotors, rel=1e-9)
            assert [axis.load for axis in found] == pytest.approx(whole - rotors, rel=1e-9)


@pytest.mark.parametrize("which", ["two links", "moving base"])
def test_numbers_too_large_to_be_squared_are_refused(which: str) -> None:
    """Each row of the targets, and of the motion of the base; the currents stay."""
    arm, axes, base = two_links().arm, [an_axis(), an_axis()], np.full((3, 6), 0.1) if which == "moving base" else None
    rows = [(commander.TARGETS_AT, k) for k in range(5)]
    for at, row in [*rows, *([] if base is None else [(commander.OWN_AT, k) for k in range(3)])]:
        memory = remembered(arm, axes, np.zeros((5, 2)), base)
        memory[at][row, 1] = 1e151
        assert called(memory) == commander.NOT_FINITE and (memory[commander.AXES_AT]["current"] == 4.0).all()
