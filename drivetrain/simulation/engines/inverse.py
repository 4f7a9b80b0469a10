"""E0: the command taken as done, and asked what it takes; no states, no steps, nothing solved in time.

Valid while nothing touches the arm and every motor can do what is asked. It refuses the rest: a command pressed into a
wall asks for torques that no motor will ever give.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from drivetrain.errors import Fault, InputError
from drivetrain.simulation.engines.elastic_inverse import with_springs
from drivetrain.simulation.engines.engine import Engine, Outcome, RunOptions
from drivetrain.simulation.engines.inverse_demand import Demand, demanded
from drivetrain.simulation.passive import recorded_times
from drivetrain.simulation.planning.plan import Plan
from drivetrain.simulation.planning.wiring import unit_at
from drivetrain.simulation.recording import Series


@dataclass(frozen=True)
class Inverse(Engine):
    """The inverse engine.

    Attributes:
        share: Of a limit that a command may reach, 1 for all of it.
    """

    share: float = 1.0

    def run(self, plan: Plan, options: RunOptions) -> Outcome:
        """What the command takes at the wanted instants."""
        times = recorded_times(plan.scene.duration, options.interval)
        demand, events = with_springs(plan, demanded(plan, times))
        faults = [
            fault for joint, name in enumerate(plan.scene.joints) for fault in self._limits(plan, demand, joint, name)
        ]
        if faults:
            raise InputError(faults)
        counters = {"instants": len(times), "steps": 0}
        return Outcome(np.empty((0, 0)), counters, events, series=_series(plan, demand), times=times)

    def _limits(self, plan: Plan, demand: Demand, joint: int, name: str) -> list[Fault]:
        """What the joint's motor cannot do."""
        effects = plan.scene.effects.get(name, ())
        faults = []
        for what, values, unit in (("peak_current", demand.current, "A"), ("voltage", demand.voltage, "V")):
            limit = min((float(getattr(effect, what, np.inf)) for effect in effects), default=np.inf)
            worst = int(np.argmax(np.abs(np.nan_to_num(values[:, joint]))))
            needed = abs(float(np.nan_to_num(values[worst, joint])))
            if needed > self.share * limit:
                problem = (
                    f"the command takes {needed:.4g} {unit} at {demand.time[worst]:.4g} s, more than {limit:.4g} {unit}"
                )
                faults.append(Fault(name, problem, needed, "simulate forward (FixedStep) to see what happens instead"))
        return faults


def _series(plan: Plan, demand: Demand) -> dict[str, Series]:
    """The demand by name."""
    series = {}
    columns: tuple[tuple[str, str, Any], ...] = (
        ("position", "rad", demand.position), ("speed", "rad/s", demand.speed),
        ("acceleration", "rad/s^2", demand.acceleration), ("mesh_torque", "N m", demand.mesh_torque),
        ("joint_friction", "N m", demand.joint_friction),
    )  # fmt: skip
    for i, name in enumerate(plan.scene.joints):
        for what, unit, values in columns:
            series[f"{name}.{what}"] = Series(unit_at(unit, plan.scene.turning[i]), values[:, i])
        series[f"{name}.motor_speed"] = Series("rad/s", demand.shaft_speed[:, i] * plan.body.ratios[i])
        series[f"{name}.electromagnetic_torque"] = Series("N m", demand.motor_torque[:, i])
        if np.isfinite(demand.current[:, i]).all():
            series[f"{name}.current"] = Series("A", demand.current[:, i])
            series[f"{name}.voltage"] = Series("V", demand.voltage[:, i])
        twist = plan.body.springs[i].deflection if i in plan.body.springs else None
        if twist is not None:
            series[f"{name}.deflection"] = Series("rad", np.array([twist(load) for load in demand.mesh_torque[:, i]]))
    return series
