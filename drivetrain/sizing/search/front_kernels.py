"""How near the candidates of a joint come to their limits at least while other choices are open."""

from __future__ import annotations

import math

import numpy as np

from drivetrain.sizing.demand.load_basis import NUMBERS
from drivetrain.sizing.demand.load_kernels import (
    HOTTEST,
    PEAK,
    SQUARE,
    WARM_MAGNETS,
    least_average,
    least_peak,
)
from drivetrain.sizing.judge.compiling import njit_leaf, njit_part
from drivetrain.sizing.judge.packed_rows import (
    AVERAGE,
    CONTINUOUS,
    DIRECT_DRIVE,
    INNER,
    MAGNET,
    MAX_INPUT,
    MAX_SPEED,
    MAX_WINDING,
    MEAN_INPUT,
    MOMENTARY,
    PEAK_CURRENT,
    PEAK_TORQUE,
    RATIO,
    REPEATED,
)
from drivetrain.sizing.judge.packed_task import (
    AMBIENT,
    AMPLIFIER_CONTINUOUS,
    AMPLIFIER_PEAK,
    DURATION,
    FASTEST,
    MEAN_SPEED,
    PEAK_FACTOR,
    RMS_FACTOR,
    SPEED_FACTOR,
    TEMPERATURE_MARGIN,
    VOLTAGE_FACTOR,
    VOLTS,
    PackedTask,
)
from drivetrain.sizing.judge.torque_kernels import constant_at, resistance
from drivetrain.sizing.search.bound_kernels import HIGH, LOW, certain_loss, least_voltage
from drivetrain.sizing.search.propagation import Memory

MASS, PRICE, ENERGY, USED = range(4)
BELOW = 1.0 - 2e-9  # a bound stays a bound though it is rounded


@njit_leaf
def _share(required: float, available: float) -> float:
    """Required over available; 0 where nothing limits it."""
    return required / available if available > 0.0 and required > 0.0 else 0.0


@njit_part
def bound_used(task: PackedTask, joint: int, pair: int, memory: Memory) -> tuple[float, float]:
    """How near a candidate comes to its limits at least, and what copper loss is certain, within bounds of torque.

    Returns:
        Utilisation, and loss over torque squared [W/(N m)^2].
    """
    m, g = task.motors[joint, task.pairs[pair, 0]], task.gears[task.pairs[pair, 1]]
    row, limits, bounds = task.series[joint], task.tasks[joint], memory.bounds
    least, most, figures = bounds.scratch[LOW], bounds.scratch[HIGH], bounds.figures
    peak, square, hottest = figures[PEAK], figures[SQUARE], figures[HOTTEST]
    weak = constant_at(m, figures[WARM_MAGNETS])
    # Magnets that may be stronger without bound, or gone: no current is certain.
    sure = weak > 0.0 and not (m[MAGNET] > 0.0 and not np.isnan(m[INNER]))
    loss = certain_loss(m, figures)
    turning = limits[SPEED_FACTOR] * abs(g[RATIO])
    used = max(_share(turning * limits[FASTEST], m[MAX_SPEED]), _share(turning * limits[FASTEST], g[MAX_INPUT]))
    used = max(used, _share(turning * limits[MEAN_SPEED], g[MEAN_INPUT]))
    used = max(used, _share(limits[PEAK_FACTOR] * peak, m[PEAK_TORQUE]))
    if sure:
        current = limits[PEAK_FACTOR] * peak / weak
        rms = limits[RMS_FACTOR] * math.sqrt(square / limits[DURATION]) / weak
        used = max(used, _share(current, m[PEAK_CURRENT]), _share(current, limits[AMPLIFIER_PEAK]))
        used = max(used, _share(rms, m[CONTINUOUS]), _share(rms, limits[AMPLIFIER_CONTINUOUS]))
    room = m[MAX_WINDING] - limits[TEMPERATURE_MARGIN] - limits[AMBIENT]
    used = max(used, _share(hottest - limits[AMBIENT], room))
    cold = constant_at(m, limits[AMBIENT])
    volts = least_voltage(row, m, g[RATIO], resistance(m, limits[AMBIENT]), cold, least, most)
    used = max(used, _share(limits[VOLTAGE_FACTOR] * volts, limits[VOLTS]))
    if g[DIRECT_DRIVE] == 0.0:
        low, high, at = memory.torque[0], memory.torque[1], task.offsets[joint, joint]
        for t in range(len(low)):
            low[t], high[t] = bounds.low[t], bounds.high[t]
        if at >= 0:
            for i in range(NUMBERS):
                unit, number = task.force[at + i], task.numbers[pair, i]
                for t in range(len(low)):
                    low[t] += number * unit[t]
                    high[t] += number * unit[t]
        asked = limits[PEAK_FACTOR] * least_peak(row, limits, low, high)
        used = max(used, _share(asked, g[REPEATED]), _share(asked, g[MOMENTARY]))
        if not np.isnan(g[AVERAGE]):
            exponent = task.exponents[task.exponent_of[task.pairs[pair, 1]]]
            used = max(used, _share(least_average(row, exponent, low, high), g[AVERAGE]))
    return used, loss
