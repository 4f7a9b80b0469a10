"""Random drives at the default settings of both engines, beside their equations written out and solved by scipy.

Stiff and soft gears, bristles, cogging, walls, gravity, cold windings with little capacity, voltages up and down.
The adaptive engine is right; the fixed step is, or says that it is not.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import OdeSolution, solve_ivp

import drivetrain as dt
from drivetrain.drive.motor import copper_coefficient
from drivetrain.drive.thermal.thermal_network import ThermalNetwork
from drivetrain.effects.effect import Effect
from drivetrain.simulation.recording import Recording
from drivetrain.simulation.scene import Scene

DURATION = 0.6
AIR = 25.0


class Drawn:
    """The numbers of a drive; what it does not have is zero."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)

        def size(low: float, high: float) -> float:
            return float(10.0 ** rng.uniform(math.log10(low), math.log10(high)))

        def some(value: float) -> float:
            return value if rng.random() < 0.6 else 0.0

        self.ratio, self.rotor = float(rng.choice([1.0, 10.0, 50.0, 100.0])), size(1e-6, 1e-4)
        self.load = self.ratio**2 * self.rotor * size(0.1, 20.0)
        self.weight, self.phase = some(self.load * 9.81 * rng.uniform()), rng.uniform(0.0, 6.0)
        self.resistance, self.constant, self.inductance = (
            rng.uniform(0.2, 2.0),
            rng.uniform(0.02, 0.1),
            size(3e-5, 1e-3),
        )
        self.time, self.volts = np.linspace(0.0, DURATION, 13), np.append(0.0, rng.uniform(-24.0, 24.0, 12))
        self.spring = some(self.load * (2.0 * math.pi * size(5.0, 300.0)) ** 2)
        self.damping = rng.uniform(0.0, 0.2) * math.sqrt(self.spring * self.load)
        self.coulomb = some(self.ratio * self.constant * size(0.5, 5.0))
        self.static, self.slow = self.coulomb * rng.uniform(1.0, 1.6), size(0.01, 0.3)
        self.bristles = self.coulomb * size(1e2, 1e5)
        self.bristle_damping = rng.uniform(0.0, 0.5) * math.sqrt(self.bristles * self.load)
        self.viscous = some(size(1e-6, 1e-4))
        self.cogging, self.teeth = some(self.constant * size(0.1, 2.0)), int(rng.choice([6, 12, 84]))
        self.wall, self.rest = some(self.load * (2.0 * math.pi * size(0.5, 50.0)) ** 2), rng.uniform(-1.0, 1.0)
        self.network = ThermalNetwork(
            rng.uniform(0.5, 2.0), rng.uniform(1.0, 4.0), size(0.05, 5.0), size(1.0, 50.0), AIR
        )
        self.cold, self.warms = rng.uniform(-40.0, AIR), rng.random() < 0.7
        self.start = rng.uniform(-1.0, 1.0)

    def scene(self) -> Scene:
        """The drive as effects."""
        motor = dt.Motor("m", self.resistance, self.constant, inductance=self.inductance)
        effects: list[Effect] = [dt.FullRotor(self.rotor, self.ratio), dt.Winding(motor)]
        effects.append(dt.GivenVoltage(self.time, self.volts))
        if self.spring:
            effects.append(dt.FlexibleJoint(dt.Gear("g", self.ratio, stiffness_1=self.spring), self.damping))
        if self.coulomb:
            law = (self.bristles, self.coulomb, self.static, self.slow, self.bristle_damping)
            effects.append(dt.LuGreFriction(*law))
        if self.viscous:
            effects.append(dt.ViscousFriction(dt.Friction(viscous=self.viscous), "motor"))
        if self.cogging:
            effects.append(dt.Cogging((self.cogging,), (self.teeth,)))
        if self.wall:
            effects.append(dt.WallSpring(self.wall, rest=self.rest))
        if self.warms:
            effects.append(dt.WindingHeat(self.network, winding=self.cold, housing=self.cold))
        return dt.joint_scene(dt.Inertia(self.load, self.weight, self.phase), effects, DURATION, position=self.start)

    def rates(self, t: float, y: Any) -> list[float]:
        """Of position and speed of link and motor, current, bend of the bristles, temperatures."""
        place, speed, turn, spin, current, bend, winding, housing = y
        if not self.spring:
            turn, spin = place, speed
        r = self.resistance * (1.0 + copper_coefficient(AIR) * (winding - AIR))
        k = self.constant * (1.0 - 0.001 * (housing - AIR))
        fast = self.ratio * spin
        current_rate = (np.interp(t, self.time, self.volts) - r * current - k * fast) / self.inductance
        motor = k * current - self.viscous * fast - self.cogging * math.sin(self.teeth * self.ratio * turn)
        link = -self.weight * math.cos(place + self.phase) - self.wall * (place - self.rest)
        bend_rate = 0.0
        if self.coulomb:
            falls = math.exp(-min((speed / self.slow) ** 2, 700.0))
            slips = self.coulomb + (self.static - self.coulomb) * falls
            bend_rate = speed - self.bristles * abs(speed) / slips * bend
            link -= self.bristles * bend + self.bristle_damping * bend_rate
        own = self.ratio**2 * self.rotor
        if self.spring:
            carried = self.spring * (turn - place) + self.damping * (spin - speed)
            link_rate, spin_rate = (link + carried) / self.load, (self.ratio * motor - carried) / own
        else:
            link_rate = spin_rate = (link + self.ratio * motor) / (self.load + own)
        net, through = self.network, (winding - housing) / self.network.resistance_winding_housing
        out = (housing - AIR) / net.resistance_housing_ambient
        warming = (r * current**2 - through) / net.winding_capacity * self.warms
        housing_rate = (through - out + self.viscous * fast**2) / net.housing_capacity * self.warms
        return [speed, link_rate, spin, spin_rate, current_rate, bend_rate, warming, housing_rate]

    def solved(self, run: Recording) -> OdeSolution:
        """The equations from where a recording begins."""
        told = {name: float(one.values[0]) for name, one in run.series.items()}
        first = [told["joint.position"], 0.0, told["joint.position"] + told.get("joint.deflection", 0.0), 0.0]
        first += [told["joint.current"], told.get("joint.joint_bristle_bend", 0.0)]
        first += [told.get(f"joint.{node}_temperature", AIR) for node in ("winding", "housing")]
        tolerances = {"rtol": 1e-9, "atol": 1e-11, "max_step": 0.01}
        return solve_ivp(self.rates, (0.0, DURATION), first, method="LSODA", dense_output=True, **tolerances).sol

    def off(self, run: Recording, solution: OdeSolution) -> float:
        """The most that way, peak and RMS current and the winding's temperature are off by, of their size [-]."""
        found = solution(run.time)
        place, current, warm = found[0], found[4], found[6]
        mean = math.sqrt(float(np.mean(current**2)))
        shares = [
            np.abs(run["joint.position"] - place).max() / np.ptp(place),
            abs(float(np.abs(run["joint.current"]).max() / np.abs(current).max()) - 1.0),
            abs(math.sqrt(float(np.mean(run["joint.current"] ** 2))) / mean - 1.0),
        ]  # fmt: skip
        if self.warms:
            shares.append(np.abs(run["joint.winding_temperature"] - warm).max() / max(float(np.ptp(warm)), 0.1))
        return float(max(shares))


@pytest.mark.parametrize("seed", range(20))
def test_a_random_drive_is_right_or_says_that_it_is_not(seed: int) -> None:
    drawn = Drawn(seed)
    scene = drawn.scene()
    adaptive, fixed = dt.simulate(scene, solver=dt.AdaptiveStep(), interval=1e-3), dt.simulate(scene, interval=1e-3)
    solution = drawn.solved(adaptive)
    assert drawn.off(adaptive, solution) < 1e-4
    # Half the step changes what is off by 2 % at the first order by 1 %, which is said.
    assert drawn.off(fixed, solution) < 0.02 or any(event.name in ("step", "LuGre stiffness") for event in fixed.events)
