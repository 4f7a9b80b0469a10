"""All figures of single axes with random motions and loads, each worked out by numpy from what docs/checks.md says.

No two numbers are equal and none is round, so that no exchanged operator, factor or sign leaves a figure as it was.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from one_axis import (
    BRAKE,
    COPPER,
    FRICTIONS,
    SAFETY,
    constant,
    mean,
    random_axis,
    rates,
    resistance,
    rubbed,
    steps,
)
from scipy.optimize import brentq

from drivetrain.drive.amplifier import Amplifier
from drivetrain.drive.drive import loss_speed
from drivetrain.drive.friction import Friction
from drivetrain.study.model import Mount, Stop

CLOSE = 1e-9  # relative: the same sums in another order
DRAG = {
    "mesh_efficiency": 0.85, "drag_torque": 0.013, "drag_speed": 40.0, "drag_speed_exponent": 0.45,
    "drag_temperature_1": 0.021, "drag_temperature_2": 1.7e-4, "seal_drag_torque": 0.004, "starting_torque": 0.021,
    "kind": "strain_wave", "efficiency": None,
}  # fmt: skip
BEARING = {
    "bearing_pitch_diameter": 0.11, "bearing_offset": 0.043, "bearing_dynamic_rating": 9e3,
    "bearing_static_rating": 12e3,
}  # fmt: skip
STAGES = {
    "stage_driving": 1.06, "stage_driven": 0.94, "stage_inertia": 4e-6, "stage_sprung": 0.013, "staged": 1.0,
    "inertia": 1e-5,
}  # fmt: skip
RUBBING = replace(FRICTIONS[0], load_share=0.03)
RAMP, HARD = {"stop": Stop(ramp=0.35)}, {"stop": Stop(current=30.0)}
COOL = {"resistance_housing_ambient": 0.9}  # K/W: a gear that stays colder than its law of drag ends
BARE = {"friction": Friction(), "motor_friction": Friction()}
KINDS = {  # changes of motor, gear, task and study
    "planetary": ({}, BEARING, RAMP, {}),
    "a shaft that sticks": ({}, {}, {**RAMP, "motor_friction": replace(FRICTIONS[1], stribeck_speed=60.0)}, {}),
    "backwards": ({}, {"ratio": -50.0, "bearing_offset": 0.043}, HARD, {"cold_start": -15.0}),
    "drag": ({}, {"ratio": -60.0, **DRAG, **BEARING}, RAMP, {"cold_start": -4.0}),
    "drag in cool air": (COOL, DRAG, RAMP, {"ambient": 5.0}),
    "drag in cold air": (COOL, {"ratio": 45.0, **DRAG}, RAMP, {"ambient": -25.0}),
    "drag that is stopped": ({}, {"ratio": 60.0, **DRAG, "bearing_pitch_diameter": 0.1}, HARD,
                             {"cold_start": -4.0, "gear_temperature": 29.0}),
    "stages": ({}, {**STAGES, **BEARING}, {**RAMP, "friction": RUBBING}, {"gear_temperature": 33.0}),
    "heavy stages": ({}, {**STAGES, "stage_inertia": 1e-3, "inertia": 1.1e-3}, {**RAMP, **BARE}, {}),
    "stages that are stopped": ({}, {**STAGES, "stiffness_1": 7e3}, {
        "stop": Stop(current=30.0, rise=0.006), "friction": RUBBING, "mount": Mount("child")}, {}),
    "stages that are stopped the other way": ({}, STAGES, {**HARD, "friction": RUBBING}, {"size": -1.0}),
    "a load that gives back": ({}, {"efficiency": 0.6}, {**RAMP, **BARE}, {"gives_back": True}),
    "most torque at rest": ({}, {**DRAG, "holding": 1.0, "kind": "rv"}, {**RAMP, "friction": Friction(0.7)}, {}),
    "riding backwards": ({}, {"ratio": -45.0, "stiffness_1": 7e3}, {**HARD, "mount": Mount("child")}, {}),
    "two parts": ({}, {**DRAG, **BEARING}, RAMP, {"mixed": True}),
    "two parts of a winding on its housing": (COOL | {"resistance_winding_housing": 0.05}, DRAG, RAMP,
                                              {"mixed": True, "ambient": 5.0}),
    "heaviest at rest": ({}, {}, HARD, {"held": 24.0}),
    "heaviest at rest, with stages": ({}, STAGES, {**RAMP, "friction": RUBBING}, {"held": -24.0}),
    "in a twinkling": (COOL, DRAG, RAMP, {"pace": 0.02, "ambient": 5.0}),
    "factors below 1": ({}, BEARING, RAMP, {"safety": replace(SAFETY, peak_torque=0.7, life=None)}),
    "next to nothing": ({}, BEARING, {**RAMP, **BARE}, {"size": 1e-4}),
    "next to nothing with drag": (COOL, DRAG, {**RAMP, **BARE}, {"size": 1e-4, "ambient": 5.0}),
    "next to nothing is stopped": ({}, STAGES, {
        "stop": Stop(current=3e-3), **BARE, "friction": Friction(load_share=0.03)}, {
        "size": 1e-4, "cold_start": -15.0}),
}  # fmt: skip


@pytest.fixture(params=KINDS)
def op(make, request):
    motor, gear, task, changes = KINDS[request.param]
    return random_axis(make, motor, gear, task, **changes)


@pytest.mark.parametrize("kind", [*KINDS, "that never moves"])
def test_a_mirrored_axis_has_the_same_figures(make, kind):
    """Extremes of either sign: all loads and motions the other way, the same friction in both directions."""
    motor, gear, task, changes = KINDS.get(kind, ({}, {}, HARD, {"moves": False}))
    even = replace(task.get("friction", FRICTIONS[0]), coulomb_negative=None, viscous_negative=None)
    there, back = (
        random_axis(make, motor, gear, {**task, "friction": even}, **{
            **changes, "size": sign * changes.get("size", 1.0), "held": sign * changes.get("held", 0.0),
        }) for sign in (1.0, -1.0)
    )  # fmt: skip
    for name in there.judgement.case["figures"].dtype.names:
        found = [float(getattr(op.figures, name)) for op in (there, back)]
        assert found[0] == pytest.approx(found[1], rel=1e-12, abs=1e-15, nan_ok=True), name


def part_of(op):
    """Factors of the mesh while it is driven and while it drives, onward factor, inertia of rotor and of stages."""
    gear, share = op.drive.gear, op.task.friction.load_share
    loss = 1.0 / (gear.mesh_efficiency or gear.efficiency) - 1.0
    driving = (1.0 + loss) * gear.stage_driving * (1.0 + share)
    driven = (1.0 - loss) * gear.stage_driven * (1.0 - share)
    rotor = op.drive.motor.rotor_inertia + gear.inertia
    return driving, driven, gear.stage_driving * (1.0 + share), rotor, gear.stage_inertia * gear.ratio**2


def drag(op, turn, temperature):
    """Of seals, and without them."""
    gear, d = op.drive.gear, min(max(temperature, -10.0), 40.0) - 20.0
    if gear.drag_torque is None:
        return 0.0 * turn, 0.0 * turn
    warm = math.exp(gear.drag_temperature_2 * d * d - gear.drag_temperature_1 * d)
    turning = gear.drag_torque * (np.abs(turn) / gear.drag_speed) ** gear.drag_speed_exponent * warm
    return np.sign(turn) * gear.seal_drag_torque, np.sign(turn) * turning


def shaft_torque(op, load, speed, rotor, temperature):
    """Of a motor that moves a load, all losses counted."""
    driving, driven, *_ = part_of(op)
    turn = op.drive.gear.ratio * speed
    through = np.where(load * speed > 0.0, driving, driven) * load / op.drive.gear.ratio
    return through + rotor + rubbed(op.task.motor_friction, turn) + sum(drag(op, turn, temperature))


def stuck(friction):
    return friction.coulomb if friction.static is None else friction.static


def sticks(op):
    """Torque at the input that an unloaded gear takes to start."""
    return max(op.drive.gear.starting_torque or 0.0, op.drive.gear.seal_drag_torque or 0.0)


def worked_out(op, temperature):
    """Motor torque at every sample, and that with the start of what rests."""
    demand, ratio, friction = op.demand, op.drive.gear.ratio, op.task.friction
    way = loss_speed(demand.speed, demand.acceleration, demand.at_rest, parts=demand.cycle.parts)
    driving, driven, _, inertia, _ = part_of(op)
    rotor = inertia * (ratio * demand.acceleration + demand.carrier_acceleration)
    held = demand.gear_torque / ratio + rotor
    if op.drive.gear.holding:
        held = driving * demand.gear_torque / ratio + sticks(op) * np.sign(demand.gear_torque / ratio) + rotor
    moving = shaft_torque(op, demand.gear_torque + rubbed(friction, way), way, rotor, temperature)
    torque = np.where(way == 0.0, held, moving)
    starts = []
    for sign in (np.sign(demand.gear_torque), np.sign(way[demand.cycle.after])):  # against the load, and where it moves
        pushed = demand.gear_torque + sign * stuck(friction)
        through = np.where(pushed * sign > 0.0, driving, np.where(pushed * sign < 0.0, driven, 0.0)) * pushed / ratio
        start = through + np.sign(ratio) * sign * (stuck(op.task.motor_friction) + sticks(op)) + rotor
        starts.append(np.where(sign == 0.0, 0.0, np.abs(start)))
    return torque, np.where(demand.at_rest, np.max([np.abs(torque), *starts], axis=0), np.abs(torque))


def phase_squares(op):
    """Square of the torque that heats the most loaded phase: a resting one carries twice its share."""
    time, cycle, still = op.demand.time, op.demand.cycle, op.demand.at_rest
    resting, whole = np.zeros((2, len(time)))
    for i, k in steps(cycle):
        for one in (i, k):
            resting[one] += (time[k] - time[i]) * (still[i] and still[k])
            whole[one] += time[k] - time[i]
    return op.motor_torque**2 * (1.0 + resting / whole)


def gear_temperature(op):
    """At which the drag is taken: as stated, else of cold air, else 20 C."""
    return min(op.study.ambient, 20.0) if op.study.gear_temperature is None else op.study.gear_temperature


def test_torque(op):
    torque, starting = worked_out(op, gear_temperature(op))
    np.testing.assert_allclose(op.motor_torque, torque, rtol=CLOSE)
    assert op.figures.motor_torque == pytest.approx(starting.max(), rel=CLOSE)
    assert op.figures.rms_torque == pytest.approx(math.sqrt(mean(op, torque**2)), rel=CLOSE)
    assert op.figures.phase_torque == pytest.approx(math.sqrt(mean(op, phase_squares(op))), rel=CLOSE)
    k = constant(op.drive.motor, op.figures.magnet_temperature)
    for name in ("motor", "rms", "phase"):
        assert op.figures[f"{name}_current"] == pytest.approx(op.figures[f"{name}_torque"] / k, rel=CLOSE)


def test_load_of_the_gear(op):
    demand, friction, gear = op.demand, op.task.friction, op.drive.gear
    _, _, onward, _, stages = part_of(op)
    load = demand.gear_torque + rubbed(friction, demand.speed)
    loose = np.abs(load) + np.where(demand.at_rest, stuck(friction), 0.0)
    carried = np.where(load * demand.speed > 0.0, onward, 1.0) * load
    carried = np.maximum(np.abs(carried), np.abs(carried + stages * demand.acceleration))
    assert op.figures.joint_torque == pytest.approx(loose.max(), rel=CLOSE)
    largest = np.maximum(carried, np.where(demand.at_rest, onward * loose, 0.0)).max()
    assert op.figures.load_torque == pytest.approx(largest, rel=CLOSE)
    exponent, speed = 10.0 / 3.0 if gear.kind == "rv" else 3.0, np.abs(demand.speed)
    average = (mean(op, speed * carried**exponent) / mean(op, speed)) ** (1.0 / exponent)
    assert op.figures.average_load_torque == pytest.approx(average, rel=CLOSE)
    turns = abs(gear.ratio) * mean(op, speed)
    life = gear.rated_life * gear.rated_speed / turns * (gear.continuous_torque / average) ** exponent
    assert op.figures.gear_life == pytest.approx(life, rel=CLOSE)


def test_output_bearing(op):
    """Of its centre, on the worse side of the flange; of a sheet that tells a diameter alone nothing is known."""
    demand, gear, wish = op.demand, op.drive.gear, op.safety
    if gear.bearing_pitch_diameter and not gear.bearing_offset:
        assert math.isnan(op.figures.tilting_moment) and math.isnan(op.figures.bearing_life)
        return
    mx, my, _, fx, fy, fz = demand.wrench.T
    arm = gear.bearing_offset or 0.0
    moment = np.maximum(np.hypot(mx + arm * fy, my - arm * fx), np.hypot(mx - arm * fy, my + arm * fx))
    across, along = np.hypot(fx, fy), np.abs(fz)
    largest = moment.max(), across.max(), along.max()
    found = op.figures.tilting_moment, op.figures.radial_load, op.figures.axial_load
    assert found == pytest.approx(largest, rel=CLOSE)
    if gear.bearing_pitch_diameter is None:
        assert math.isnan(op.figures.bearing_static_load) and math.isnan(op.figures.bearing_life)
        return
    static = largest[1] + 2.0 * largest[0] / gear.bearing_pitch_diameter + 0.44 * largest[2]
    assert op.figures.bearing_static_load == pytest.approx(static, rel=CLOSE)
    radial, speed, e = across + 2.0 * moment / gear.bearing_pitch_diameter, np.abs(demand.speed), 10.0 / 3.0
    load = np.where(along <= 1.5 * radial, radial + 0.45 * along, 0.67 * (radial + along))
    worn = (mean(op, speed * load**e) / mean(op, speed)) ** (1.0 / e)
    turns = 1e6 * (gear.bearing_dynamic_rating / (wish.bearing_load_factor * worn)) ** e
    assert op.figures.bearing_life == pytest.approx(2.0 * math.pi * turns / mean(op, speed), rel=CLOSE)


def test_inertia_brake_and_spring(op):
    demand, gear, motor = op.demand, op.drive.gear, op.drive.motor
    _, _, _, rotor, stages = part_of(op)
    inertia, square = demand.load_inertia.max(), gear.ratio**2
    ratio = (inertia + stages) / (square * (rotor - gear.stage_inertia))
    assert op.figures.inertia_ratio == pytest.approx(ratio, rel=CLOSE)
    assert motor.rotor_inertia == pytest.approx(2e-5 + 3e-6)
    sprung = (2.0 * math.pi * 7.0) ** 2 * (inertia + gear.stage_sprung)
    assert op.figures.required_stiffness == pytest.approx(sprung, rel=CLOSE)
    held, speed = np.abs(demand.static_torque).max() / abs(gear.ratio), abs(gear.ratio) * np.abs(demand.speed).max()
    assert op.figures.holding_torque == pytest.approx(held, rel=CLOSE)
    energy = 0.5 * (rotor + inertia / square) * speed**2 * 0.9 / (0.9 - held)
    assert op.figures.stopping_energy == pytest.approx(energy, rel=CLOSE)


def test_voltage_and_power(op):
    """Cold and as warm as the cycle makes it, with the factor on torque and without; and what a start takes."""
    motor, demand, torque, more = op.drive.motor, op.demand, op.motor_torque, max(op.safety.peak_torque, 1.0)
    turn, time, hot = op.motor_speed, demand.time, op.winding_temperature
    _, starting = worked_out(op, gear_temperature(op))
    found, k = [], constant(motor, op.figures.magnet_temperature)
    for magnets, winding in ((op.study.ambient, op.study.ambient), (op.figures.magnet_temperature, hot)):
        volts = resistance(motor, winding) * torque + motor.inductance * rates(op)
        found += [constant(motor, magnets) * turn + volts / constant(motor, magnets) * one for one in (1.0, more)]
    found.append((more * resistance(motor, hot) * starting / k)[demand.at_rest])
    assert op.figures.voltage == pytest.approx(max(np.abs(one).max() for one in found), rel=CLOSE)
    current = torque / k
    drawn = (k * turn + resistance(motor, hot) * current) * current + BRAKE.power
    taken = drawn + 2.0 * 0.02 * current**2  # two switches carry each of two phases
    np.testing.assert_allclose(op.power, taken, rtol=CLOSE, atol=1e-9)
    _, _, _, inertia, _ = part_of(op)
    free = (demand.gear_torque + rubbed(op.task.friction, demand.speed)) / op.drive.gear.ratio
    free = free + inertia * (op.drive.gear.ratio * demand.acceleration + demand.carrier_acceleration)
    least = min(op.study.ambient, math.inf if op.study.cold_start is None else op.study.cold_start)
    cold = free * turn + resistance(motor, least) * (free / constant(motor, least)) ** 2
    np.testing.assert_allclose(op.judgement.power[1], np.minimum(drawn, cold), rtol=CLOSE, atol=1e-9)
    assert op.figures.mean_power == pytest.approx(mean(op, taken), rel=CLOSE)
    assert op.figures.energy == pytest.approx(mean(op, taken) * time[-1], rel=CLOSE)


def test_cold_start(op):
    motor, cold, more = op.drive.motor, op.study.cold_start, max(op.safety.peak_torque, 1.0)
    if cold is None:
        assert op.judgement.case.setting.cold == 0.0
        return
    torque, starting = worked_out(op, cold)
    k, ohms = constant(motor, cold), resistance(motor, cold)
    assert op.figures.cold_torque == pytest.approx(starting.max(), rel=CLOSE)
    assert op.figures.cold_current == pytest.approx(starting.max() / k, rel=CLOSE)
    volts = (ohms * torque + motor.inductance * rates(op, torque)) / k
    found = [np.abs(k * op.motor_speed + volts * one).max() for one in (1.0, more)]
    assert op.figures.cold_voltage == pytest.approx(max(*found, more * ohms * starting.max() / k), rel=CLOSE)


def coldest(op):
    """Temperatures of the gear and of the magnets in a stop."""
    cold = math.inf if op.study.cold_start is None else op.study.cold_start
    return min(gear_temperature(op), cold), min(cold, op.study.ambient, 25.0)


def ramped_stop(op):
    """Torque of gear and motor, no loss counted where it helps."""
    stop, (_, _, onward, inertia, stages), ratio = op.demand.stop, part_of(op), op.drive.gear.ratio
    rotor = inertia * (ratio * stop.acceleration + stop.carrier_acceleration)
    lossy = stop.torque + rubbed(op.task.friction, stop.speed)
    load = np.max([np.abs(stop.torque), np.abs(stop.torque + stages * stop.acceleration), np.abs(lossy)])
    driven = shaft_torque(op, lossy, stop.speed, rotor, coldest(op)[0])
    return onward * load, max(np.abs(stop.torque / ratio + rotor).max(), np.abs(driven).max())


def hard_stop(op):
    """The motor brakes at its current, the stator perhaps on the link that it stops: torques and the longest way."""
    demand, motor, gear = op.demand, op.drive.motor, op.drive.gear
    driving, driven, onward, inertia, stages = part_of(op)
    ratio, rides = gear.ratio, float(op.task.mount.carrier == "child")
    rotor, stiff = ratio * (ratio + rides) * inertia, 1.3 * (gear.stiffness_1 or math.inf)
    warmth, magnets = coldest(op)
    speeds = loss_speed(demand.speed, demand.acceleration, demand.at_rest, parts=demand.cycle.parts)
    holding, largest, longest = 0.0, 0.0, 0.0
    for t, speed in enumerate(speeds):
        load = demand.load_inertia[t] + rides * (ratio + 1.0) * inertia
        static = demand.gear_torque[t] - load * demand.acceleration[t]
        holding, way = max(holding, abs(static / ratio)), np.sign(speed)
        if way == 0.0:
            continue
        carrier = demand.carrier_acceleration[t] - rides * demand.acceleration[t]

        def stopped(amperes, rubs, factors, load=load, static=static, way=way, carrier=carrier):
            """f T + R a = push, T = I a + b, where f fits the sign of what T does."""
            push = -way * abs(ratio) * (amperes + abs(rubs)) - ratio * inertia * carrier
            for f, sign in zip(factors, (1.0, -1.0), strict=True):
                a, torque = np.linalg.solve([[rotor, f], [-load, 1.0]], [push, static])
                if torque * way * sign >= 0.0:
                    return a, torque
            raise AssertionError("no direction of power fits")

        turn = ratio * speed
        rubs = rubbed(op.task.motor_friction, turn)
        seal, turning = drag(op, turn, warmth)
        a, torque = stopped(op.task.stop.current * constant(motor, magnets), rubs + seal + turning, (driving, driven))
        share = 1.0
        if op.task.stop.rise and gear.stiffness_1:
            x = 0.5 * math.sqrt(gear.stiffness_1 * (1.0 / load + 1.0 / rotor)) * op.task.stop.rise
            share = abs(math.sin(x) / x)
        begun = abs(torque + share * (torque - demand.gear_torque[t]))
        ended = abs(static + share * (static - torque))
        bound = math.inf
        if gear.stiffness_1:
            bound = abs(static) + abs(demand.gear_torque[t] - static) + abs(demand.speed[t]) * math.sqrt(stiff * load)
        largest = max(largest, min(max(begun, ended), bound) + stages * abs(a))
        slowing = -way * stopped(op.task.stop.current * motor.torque_constant, rubs + seal, (1.0, 1.0))[0]
        longest = max(longest, 0.5 * speed**2 / slowing if slowing > 0.0 else math.inf)
    return onward * largest, holding, longest


def test_stops(op):
    ramp, figures, gear, factor = op.task.stop.ramp, op.figures, op.drive.gear, op.safety.peak_torque
    if ramp is None:
        torque, motor, travel = hard_stop(op)
    else:
        torque, motor = ramped_stop(op)
        travel = 0.5 * ramp * np.abs(op.demand.speed).max()
    assert figures.stop_torque == pytest.approx(torque, rel=CLOSE)
    assert figures.stop_motor_torque == pytest.approx(motor, rel=CLOSE)
    assert figures.stop_travel == pytest.approx(travel, rel=CLOSE) and travel < math.inf
    k = constant(op.drive.motor, figures.magnet_temperature)
    assert figures.stop_current == pytest.approx(motor / k, rel=CLOSE)
    assert figures.momentary_torque == max(figures.load_torque, figures.stop_torque)
    if torque * factor <= gear.repeated_peak_torque:
        assert figures.permitted_peaks == math.inf
    elif gear.kind == "strain_wave":
        turns = abs(gear.ratio) * travel / (2.0 * math.pi)
        assert figures.permitted_peaks == pytest.approx(1e4 / (2.0 * turns), rel=CLOSE)


def test_heat(op):
    """Of a winding that follows no cycle; the gear's drag as warm as its housing, found with a winding at -10 C."""
    motor, demand, turn, torque = op.drive.motor, op.demand, op.motor_speed, op.motor_torque
    driving, driven, *_ = part_of(op)
    load, outer = demand.gear_torque + rubbed(op.task.friction, demand.speed), motor.resistance_housing_ambient
    power = load * demand.speed
    mesh = np.where(power > 0.0, driving - 1.0, driven - 1.0) * power
    seal, turning = (part * turn for part in drag(op, turn, 20.0))
    meshed, dragged = mean(op, mesh + seal), mean(op, turning)
    switched = 2.0 * 0.02 * (torque / constant(motor, motor.max_winding_temperature)) ** 2
    rubs = mean(op, rubbed(op.task.motor_friction, turn) * turn + 0.35 * (switched + 5.0)) + BRAKE.power
    excess, squares = phase_squares(op) - torque**2, []
    for part in demand.cycle.parts:
        a, b, step = torque[part][:-1], torque[part][1:], np.diff(demand.time[part])
        alone = step @ (excess[part][:-1] + excess[part][1:]) / 2.0
        squares.append(np.array([step @ (a * a + a * b + b * b) / 3.0, alone]) / step.sum())
    squares, shares = np.array(squares), np.array(demand.cycle.shares)
    square = shares @ squares[:, 0]

    def warm(temperature):
        one = drag(op, np.array(1.0), temperature)[1], drag(op, np.array(1.0), 20.0)[1]
        return float(one[0] / one[1]) if one[1] else 1.0

    lost = meshed + dragged * warm(gear_temperature(op))
    if op.study.gear_temperature is None and dragged > 0.0:
        cold = min(op.study.ambient, -10.0)
        coil = square * resistance(motor, cold) / constant(motor, cold) ** 2
        own = op.study.ambient + outer * (coil + rubs + 0.6 * meshed)
        at = brentq(lambda at: own + outer * 0.6 * dragged * warm(at) - at, -100.0, 900.0, xtol=1e-9)
        lost = meshed + dragged * warm(at)
    assert op.figures.gear_loss == pytest.approx(lost, rel=1e-6)  # of a temperature to a millionth
    # Each part by itself on one housing; the resistance rises with what the winding is warmer than that.
    k, housing, inner = (
        constant(motor, op.figures.magnet_temperature),
        op.figures.housing_temperature,
        motor.resistance_winding_housing,
    )
    slope = motor.resistance * COPPER / k**2
    copper = squares[:, 0] * resistance(motor, housing) / k**2 / (1.0 - inner * slope * squares[:, 0])
    ripple = 2e-2  # K: 1.5 s of 2e4 s
    assert housing == pytest.approx(op.study.ambient + outer * (shares @ copper + rubs + 0.6 * lost), abs=ripple)
    windings = housing + inner * copper
    assert op.figures.winding_temperature == pytest.approx(windings.max(), abs=ripple)
    assert op.figures.gear_temperature == max(housing, op.study.gear_temperature or -math.inf)
    # The phase that rests under the amplitude carries twice its share, and is warmed by what it loses beside; what it
    # is warmer at the end of one part, it is when the other one begins.
    more = inner * resistance(motor, windings.max()) / k**2 / (1.0 - inner * slope * squares.sum(axis=1).max())
    assert op.figures.phase_temperature == pytest.approx(windings.max() + more * squares[:, 1].max(), abs=ripple)


@pytest.mark.parametrize(
    ("motor", "amplifier", "least"), [(8.0, None, 8.0), (None, 5.0, 5.0), (8.0, 5.0, 5.0), (4.0, 5.0, 4.0)]
)
def test_the_smaller_of_two_peak_currents_counts_or_the_known_one(make, motor, amplifier, least):
    task = {"amplifier": Amplifier(peak_current=amplifier, continuous_current=3.0)}
    op = random_axis(make, {"peak_current": motor}, task=task)
    assert op.number("limits.peak_current") == least
