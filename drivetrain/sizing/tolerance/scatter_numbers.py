"""A set of drives at its work as arrays: where each number stands, for the compiled judge of many arms."""

from __future__ import annotations

from typing import NamedTuple

from drivetrain.arrays import Array
from drivetrain.sizing.tolerance.scatter_blocks import Blocks, Indices

# Rows of a joint's series.
(FORCE, JOINT_FRICTION, LOSS_FRICTION, WAY, ROTOR_TORQUE, SHAFT, SPEED, TRAVEL, BEHIND, AT, AHEAD, LOSS, REST, NEXT,
 SERIES) = range(15)  # fmt: skip

# Numbers of a joint.
(
    RATIO, EFFICIENCY, BACK, LOSSLESS, NO_LOAD, RATED, CONSTANT, RESISTANCE, COPPER, REFERENCE, MAGNET, INDUCTANCE,
    INNER, OUTER, WINDING_CAPACITY, HOUSING_CAPACITY, KIND, HOTTEST, MARGIN, PRINTED, MOVES, BREAK, BREAK_BACK,
    SHAFT_BREAK, SHAFT_BREAK_BACK, REPEATED, MOMENTARY, AVERAGE, EXPONENT, LIFE_SHARE, PEAK_TORQUE, PEAK_CURRENT,
    STALL_VOLTAGE, VOLTS, AMPLIFIER_PEAK, AMPLIFIER_MEAN, PEAK_FACTOR, RMS_FACTOR, VOLTAGE_FACTOR, NUMBERS,
) = range(40)  # fmt: skip

# Where a check stands; the order of ``judge.STAGES``.
(
    REPEATED_PEAK, MOMENTARY_PEAK, AVERAGE_TORQUE, MAXIMUM_INPUT, MEAN_INPUT, LIFE, TILTING, AXIAL, RADIAL,
    MOTOR_SPEED, INERTIA, MOTOR_TORQUE, MOTOR_CURRENT, AMPLIFIER_CURRENT, VOLTAGE, RMS_CURRENT, TEMPERATURE,
    AMPLIFIER_RMS, CHECKS,
) = range(19)  # fmt: skip
SUPPLY_PEAK, SUPPLY_MEAN, SUPPLY_BACK, SUPPLY = range(4)

# Rows of what one joint of some arms is, then of what is found of it.
(
    RUBBING, DRIVING, DRIVEN, HELD, TORQUE_CONSTANT, OHMS, SLOPE, THERMAL, AMBIENT, COLD, LARGEST, PEAK, SQUARE, WEAR,
    TILT, AXLE, ACROSS, MASSES, MAGNETS, RISE, RUNS_AWAY, WARM, TERMINAL, ROWS,
) = range(24)  # fmt: skip

# Rows of one part's heat: state at its start, rates of flow, sources, what other parts bring into the housing [W],
# and what a watt does there [K/s].
X0, X1, A, B, C, D, SOURCE, GROWTH, LOSS_IN, LOSS_OUT, BROUGHT, UNIT, HEAT_ROWS = range(13)


class ScatterTask(NamedTuple):
    """A set of drives at its work, for compiled code; n joints, N samples, P payloads, Q parts of a mix.

    Attributes:
        series: Rows as above, SI, (n, SERIES, N).
        numbers: Columns as above, SI, (n, NUMBERS).
        weight: Time each sample stands for, as a share of the whole, (N,).
        share: Of the time of use, (Q,).
        blocks: Of samples, for heat, one row a joint.
        loss: Moments of the loss in the housing in each block, (n, K, 2).
        payload: What the whole of each payload asks of each gear [N m], (n, P, N).
        bearing: Tilting moment's two, axial and radial force's two components, each followed by what the payloads add,
            (n, 5, 1 + P, samples); empty where the payload does not scatter or no bearing is judged.
        inertia: Inertia over that of the rotor and what the payloads add, over the limit, (n, 1 + P, samples).
        counts: How many samples of ``bearing`` and of ``inertia`` are the joint's own, (n, 2).
        bearing_limits: Of tilting moment, axial and radial load over the factor on peaks, NaN where unknown, (n, 3).
        fixed: Utilisations that do not scatter, NaN for the rest and for what is not checked, (n, CHECKS).
        made: 1 for checks that are made, NaN where data lack, (n, CHECKS).
        supply: Limits of peak, mean and regenerated power [W], NaN where there is none, (3,).
    """

    series: Array
    numbers: Array
    weight: Array
    share: Array
    blocks: Blocks
    loss: Array
    payload: Array
    bearing: Array
    inertia: Array
    counts: Indices
    bearing_limits: Array
    fixed: Array
    made: Array
    supply: Array


class Memory(NamedTuple):
    """What one thread writes into, again and again; the last axis are the arms, W at once.

    Attributes:
        lane: Rows of one joint, as above, SI, (ROWS, W).
        shares: Of each payload that is there, less 1, (P, W).
        torque: Of one motor [N m], (N, W).
        start: Size of the torque that starts the joint [N m], where it rests, (N, W).
        power: Electrical, of all joints [W], (N, W).
        moments: Of the squared torque in each block: sum, first, half of the second, and that of pairs by their
            distance, (4 K, W).
        heat: Rows of each part, (Q HEAT_ROWS, W).
        map: What a part does to its state, (Q 4, W).
        used: Utilisations of one joint, (CHECKS, W).
    """

    lane: Array
    shares: Array
    torque: Array
    start: Array
    power: Array
    moments: Array
    heat: Array
    map: Array
    used: Array
