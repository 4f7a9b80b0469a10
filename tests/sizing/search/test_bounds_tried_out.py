"""Bounds of single axes against the least of what loads within their intervals ask for, each judged on its own."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from one_axis import BRAKE, SAFETY, constant, mean, random_axis, rates, resistance, rubbed
from scipy.linalg import expm
from scipy.optimize import brentq
from test_random_axes import BARE, DRAG, HARD, KINDS, RAMP, drag, part_of, sticks, stuck

from drivetrain.drive.amplifier import Amplifier
from drivetrain.drive.drive import loss_speed
from drivetrain.drive.friction import Friction
from drivetrain.drive.thermal.periodic_heat import Nodes
from drivetrain.records import as_numbers
from drivetrain.sizing.judge.operation import Operation
from drivetrain.sizing.search import bounds
from drivetrain.sizing.search.bounds import LeastHeat
from drivetrain.sizing.search.candidates import build_candidates
from drivetrain.study.model import Stop

CLOSE = 1e-9  # relative: the same sums in another order
PLAIN_SHAFT = {"motor_friction": Friction(0.002, None, 4e-6)}  # friction that does not fall with the speed
LOCKING = {"efficiency": 0.4}
CASES = KINDS | {
    "self-locking": ({}, LOCKING, RAMP, {}),
    "self-locking backwards": ({}, {**LOCKING, "ratio": -50.0}, HARD, {}),
    "steady friction": ({}, {}, {**RAMP, **PLAIN_SHAFT}, {"size": -1.0}),
    "peaks on a ramp": ({}, {**DRAG, "repeated_peak_torque": 5.0}, RAMP, {}),
    "lossy when driven": ({}, {"ratio": -50.0, "efficiency": 0.8, "backdriving_efficiency": 0.5}, RAMP, {}),
    "stopped slowly": ({}, {"stiffness_1": 7e3}, {"stop": Stop(current=30.0, rise=0.09)}, {}),
    "stopped with next to nothing": ({}, {}, {"stop": Stop(current=3e-3), **BARE}, {"size": 1e-4, "cold_start": -15.0}),
    "never moves": ({}, {}, {**RAMP, "friction": Friction(0.001)}, {"moves": False, "size": 0.001}),
    "that may jam": ({}, {"ratio": -80.0, **DRAG, "stiffness_1": 7e3, "stiffness_2": 9e3, "torque_1": 4.0,
                          "ratcheting_torque": 200.0}, {"stop": Stop(current=30.0, jam=True)}, {"cold_start": -4.0}),
    "stiffer and stiffer": ({}, {"stiffness_1": 7e3, "stiffness_2": 9e3, "stiffness_3": 12e3, "torque_1": 4.0,
                                 "torque_2": 20.0, "stage_inertia": 0.0}, HARD, {}),
}  # fmt: skip


def candidates_of(op):
    """The axis as the search sees it; drives of other joints do not load it."""
    none = np.zeros((0, 6, len(op.demand.time)))
    work = SimpleNamespace(
        study=op.study, basis=(), at=lambda joint, drives: SimpleNamespace(fixed=op.demand),
        unit_wrenches=lambda joint, drives, samples=slice(None): none[..., samples],
    )  # fmt: skip
    offer = build_candidates(op.study, work).joints[0]
    offer.torque_interval(np.zeros((1, 5)), np.zeros((1, 5)))
    return offer


def bounded(offer, low=None, high=None, until=np.inf):
    """The bounds of the only candidate, its energy and the slope of its power; ``low``, ``high``: ends of its load."""
    if low is not None:
        full, stops = offer.bound_data.full, offer.bound_data.stops
        full.low[:], full.high[:] = low, high
        if len(stops.speed):  # every sample that moves is one at which a stop begins
            torque = np.array([low, high])[:, full.motion.loss_speed != 0.0]
            stops.static[:] += torque - stops.torque
            stops.torque[:] = torque
    none = np.zeros(1)
    count, used, energy, slope = offer.bound(
        np.zeros(1, np.int64), none, np.zeros(1), np.zeros(1, np.bool_), until=until, with_energy=True
    )
    assert count == 1
    return offer.bound_data.cases.case[0].figures, used[0], energy[0], slope


def called(law, *given):
    """A law by itself, in Python; what is compiled has a maximum of its own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bounds, "larger", max)
        patch.setattr(bounds, "smaller", min)
        return getattr(bounds, law)(*given)


def loaded(op, torque):
    """The axis with another load."""
    return Operation(replace(op.demand, gear_torque=torque), op.drive, op.study, 0)


def axis_of(make, name):
    motor, gear, task, changes = CASES[name]
    return random_axis(make, motor, gear, task, **changes)


# --- no width: the judge's own figures

EXACT = (
    "joint_torque", "motor_torque", "rms_torque", "phase_torque", "axial_load", "radial_load", "tilting_moment",
    "bearing_static_load", "required_stiffness", "holding_torque", "cold_torque", "cold_current", "input_speed",
    "mean_input_speed", "coast_torque", "jam_torque",
)  # fmt: skip
COOLER = ("winding_temperature", "phase_temperature", "motor_current", "rms_current", "phase_current", "voltage")
SMALLER = ("average_load_torque", "load_torque", "momentary_torque", *COOLER)


def below(found, wanted):
    """Whether a bound is one, to rounding."""
    return found <= wanted + CLOSE * abs(wanted)


def bounded_by(op, used):
    """Figures that a bound never exceeds; of a winding that runs away, as the judge says too, none after its heat."""
    assert used < math.inf or op.figures.winding_temperature == math.inf
    return SMALLER if used < math.inf else SMALLER[: -len(COOLER)]


def test_a_bound_without_width_is_the_figure(make):
    told = set()
    for name in CASES:
        op = axis_of(make, name)
        offer, figures = candidates_of(op), op.figures
        bound, used, energy, _ = bounded(offer)
        staged, ramped, jams = op.drive.gear.stage_inertia > 0.0, op.task.stop.ramp is not None, op.task.stop.jam
        wanted = [one for one in EXACT if jams or one not in ("coast_torque", "jam_torque")]
        wanted += [] if staged else ["load_torque", "average_load_torque", "gear_life"]
        wanted = [one for one in wanted if op.demand.speed.any() or one not in ("gear_life", "stop_motor_torque")]
        wanted += [] if ramped else ["stop_motor_torque"]
        wanted += [] if ramped or staged or op.task.stop.rise else ["momentary_torque"]
        wanted += [] if staged or math.isnan(bound.permitted_peaks) else ["permitted_peaks"]
        for one in wanted:
            if math.isfinite(figures[one]) or one == "permitted_peaks":
                assert bound[one] == pytest.approx(figures[one], rel=CLOSE), (name, one)
                told.add(one)
        if op.demand.stop.torque.size:
            load = max(bound.load_torque, np.abs(op.demand.stop.torque).max())
            assert bound.momentary_torque == pytest.approx(load, rel=CLOSE), name
        for one in bounded_by(op, used):
            assert below(bound[one], figures[one]), (name, one)
        assert energy <= figures.energy + 1e-12 and below(used, max(u for u in op.judgement.used.values() if u == u))
    assert told >= {*EXACT, "permitted_peaks", "momentary_torque", "stop_motor_torque", "gear_life"}


# --- a width: the least of what is asked at each sample


def interval(op, rng):
    """Ends of a load about that of the cycle: narrow, wide, around zero, and at some samples none."""
    bare = op.demand.gear_torque
    size = rng.choice([0.05, 0.4, 1.5]) * np.abs(bare).max()
    width = size * rng.random((2, len(bare))) * rng.choice([0.0, 1.0], (2, len(bare)))
    return bare - width[0], bare + width[1]


def corners(op, low, high):
    """The axis at both ends of its load, and at the load between them at which the power through the mesh turns."""
    way = loss_speed(op.demand.speed, op.demand.acceleration, op.demand.at_rest, parts=op.demand.cycle.parts)
    bend = np.clip(-rubbed(op.task.friction, way), low, high)
    return loaded(op, low), loaded(op, bend), loaded(op, high)


def least_of(values):
    """Smallest magnitude of straight lines through some values."""
    values = np.array(values)
    crosses = (values.min(axis=0) <= 0.0) & (values.max(axis=0) >= 0.0)
    return np.where(crosses, 0.0, np.abs(values).min(axis=0))


def starts(op, load):
    """Motor torque that breaks what rests loose."""
    driving, _, _, inertia, _ = part_of(op)
    ratio, sign = op.drive.gear.ratio, np.sign(load)
    rotor = inertia * (ratio * op.demand.acceleration + op.demand.carrier_acceleration)
    held = driving * (load + sign * stuck(op.task.friction)) / ratio
    return held + np.sign(ratio) * sign * (stuck(op.task.motor_friction) + sticks(op)) + rotor


@pytest.mark.parametrize("name", CASES)
def test_a_bound_is_the_least_of_each_sample(make, name):
    op = axis_of(make, name)
    for seed in range(3):
        rng = np.random.default_rng(seed)
        offer, still = candidates_of(op), op.demand.at_rest
        low, high = interval(op, rng)
        bound, used, energy, slope = bounded(offer, low, high)
        tried = corners(op, low, high)
        torque = least_of([one.motor_torque for one in tried])
        carried = least_of([one.judgement.series.traces.load for one in tried])
        motion = offer.series.motion
        weight, phase = motion.weight / motion.weight.sum(), motion.phase_ratio
        told = still & ((low > 0.0) | (high < 0.0))
        loose = starts(op, low), starts(op, high)
        loose = np.where(told & (loose[0] * loose[1] > 0.0), np.minimum(*np.abs(loose)), 0.0)
        largest = max(torque.max(), loose.max()) if op.demand.speed.any() else torque.max()
        speed, exponent = np.abs(op.demand.speed), op.judgement.case.gear.life_exponent
        rubs = stuck(op.task.friction) * speed.any()
        load = max(carried.max(), (carried + rubs)[still & (carried > 0.0)].max(initial=0.0))
        wanted = {
            "motor_torque": largest, "rms_torque": math.sqrt(weight @ torque**2),
            "phase_torque": math.sqrt(weight @ (torque * phase) ** 2), "load_torque": load, "joint_torque": load,
            "average_load_torque": carried.max(),
        }  # fmt: skip
        if speed.any():
            wear = weight @ (speed * carried**exponent) / (weight @ speed)
            wanted["average_load_torque"] = wear ** (1.0 / exponent)
        for one, value in wanted.items():
            assert bound[one] == pytest.approx(value, rel=CLOSE, abs=1e-15), one
        for share in (rng.random(len(low)), rng.integers(0, 2, len(low))):
            within = loaded(op, low + share * (high - low))
            figures, made = within.figures, within.judgement
            if figures.winding_temperature > made.case.limits.winding_temperature:
                continue
            for one in bounded_by(within, used):
                assert below(bound[one], figures[one]), one
            least = energy + (slope * motion.weight) @ (within.demand.gear_torque - 0.5 * (low + high))
            assert least <= figures.energy + CLOSE * (np.abs(within.power) @ motion.weight)
            assert below(used, max(value for value in made.used.values() if value == value))


def test_what_the_own_drive_adds_is_load(make):
    """Loads per unit of five parameters and what a drive has of them, against the same as load."""
    rng = np.random.default_rng(3)
    for name in ("planetary", "heaviest at rest", "riding backwards", "that may jam"):
        op = axis_of(make, name)
        low, high = interval(op, rng)
        own, inertia, amounts = rng.normal(size=(5, 16)), 0.01 * rng.random((5, 16)), rng.normal(size=5)
        added, carrying = candidates_of(op), candidates_of(op)
        stops, moves = added.bound_data.stops, added.bound_data.full.motion.loss_speed != 0.0
        if len(stops.speed):
            stops.torque[:] += amounts @ own[:, moves]
            stops.static[:] += amounts @ own[:, moves] - amounts @ inertia[:, moves] * stops.acceleration
            stops.inertia[:] += amounts @ inertia[:, moves]
        found = [bounded(added, low + amounts @ own, high + amounts @ own)[0].copy()]
        data = carrying.bound_data
        data.parameters[0] = amounts
        data = data._replace(
            key=data.key._replace(unit_torque=np.zeros((5, 32))), full=data.full._replace(unit_torque=own),
            stops=stops._replace(
                torque=data.stops.torque, static=data.stops.static, inertia=data.stops.inertia,
                unit_torque=np.ascontiguousarray(own[:, moves]), unit_inertia=np.ascontiguousarray(inertia[:, moves]),
            ),
        )  # fmt: skip
        if not len(stops.speed):
            data = data._replace(stops=stops._replace(unit_torque=np.zeros((5, 0)), unit_inertia=np.zeros((5, 0))))
        found.append(bounded(replace(carrying, bound_data=data), low, high)[0])
        for figure in found[0].dtype.names:
            assert found[1][figure] == pytest.approx(found[0][figure], rel=1e-8, nan_ok=True), (name, figure)


# --- heat


def test_the_housing_is_heated_by_the_least_losses(make):
    """Of every sample at its load of smallest magnitude, straight between samples."""
    alone = {"resistance_winding_housing": None, "resistance_housing_ambient": None, "resistance_winding_ambient": 3.0}
    for name, change, stated in (
        ("planetary", {}, 24.0), ("drag that is stopped", {}, 24.0), ("drag", {}, None), ("drag", alone, None),
        ("lossy when driven", {}, None), ("two parts", {}, 24.0), ("two parts", alone, 24.0),
        ("steady friction", {}, None),
    ):  # fmt: skip
        motor, gear, task, changes = CASES[name]
        brake = replace(BRAKE, power=None if stated else 7.0)
        op = random_axis(make, {**motor, **change}, gear, {**task, "amplifier_heat": 0.0}, brake=brake,
                         **{**changes, "gear_temperature": stated})  # fmt: skip
        low, high = interval(op, np.random.default_rng(2))
        offer = candidates_of(op)
        bounded(offer, low, high, until=0.0)
        case, full = offer.bound_data.cases.case[0], offer.bound_data.full
        called("least_mechanical", case, full, np.zeros(0), case.setting.gear_temperature)
        nodes, square = called("thermal_nodes", case.motor, case.setting.mounting), 0.003
        found = called("least_housing_loss", case, full, nodes, square)
        nearest = loaded(op, np.clip(-rubbed(op.task.friction, op.demand.speed), low, high)).judgement.series.traces
        dragged = 0.6 * mean(op, op.judgement.series.traces.drag_loss)

        def warm(temperature, op=op):
            turning = [drag(op, np.array(1.0), one)[1] for one in (temperature, 20.0)]
            return float(turning[0] / turning[1]) if turning[1] else 1.0

        def beyond(at, own, outer, dragged=dragged, warm=warm):
            return own + outer * dragged * warm(at) - at

        heat = mean(op, nearest.friction_loss + 0.6 * nearest.mesh_loss)
        at = stated
        if stated is None:  # as warm as the housing, that of a winding as cold as the law of drag goes
            cold = min(op.study.ambient, -10.0)
            coil = square * resistance(op.drive.motor, cold) / constant(op.drive.motor, cold) ** 2
            own = op.study.ambient + nodes.outer * (coil + heat)
            at = brentq(beyond, -100.0, 900.0, (own, nodes.outer), xtol=1e-9)
        if name == "two parts" and change:  # each part has a temperature of its own
            assert found == pytest.approx(heat, rel=CLOSE) and dragged > 0.01 * heat
        else:
            assert found == pytest.approx(heat + dragged * warm(at), rel=1e-6), name


def test_what_a_winding_is_warmer_at_least():
    """Impulses of heat into the winding, once a cycle: the least of the housing's response over its mean."""
    rng = np.random.default_rng(5)
    for _ in range(20):
        inner, outer, winding, housing, duration = 10.0 ** rng.uniform(-1.0, 1.0, 5)
        cooling = np.array([[-1.0 / (inner * winding), 1.0 / (inner * winding)],
                            [1.0 / (inner * housing), -(1.0 / inner + 1.0 / outer) / housing]])  # fmt: skip
        decayed = expm(cooling * duration)
        before = np.linalg.solve(np.eye(2) - decayed, decayed @ [1.0 / winding, 0.0])
        share = called("resting_share", Nodes(inner, outer, winding, housing), 1, duration)
        assert share == pytest.approx(before[1] * duration / outer, rel=1e-9, abs=1e-12)
        decayed = math.exp(-duration / (outer * winding))
        alone = called("resting_share", Nodes(0.0, outer, winding, math.nan), 1, duration)
        assert alone == pytest.approx(decayed / (1.0 - decayed) / winding * duration / outer)
    for nodes, parts, share in (
        (Nodes(0.0, 1.0, 2.0, math.nan), 2, 0.0), (Nodes(0.0, 1.0, math.nan, math.nan), 1, 1.0),
        (Nodes(1.0, 1.0, math.nan, 2.0), 2, 1.0), (Nodes(1.0, 1.0, math.nan, 2.0), 1, 1.0),
        (Nodes(1.0, 1.0, 2.0, math.nan), 1, 0.0), (Nodes(1.0, 1.0, 2.0, 3.0), 2, 0.0),
    ):  # fmt: skip
        assert called("resting_share", nodes, parts, 1.0) == share


def test_least_mean_square():
    """Of straight lines between intervals; the least one exactly where the smaller end may be half the larger one."""
    rng = np.random.default_rng(6)
    for _ in range(50):
        low = rng.normal(size=3)
        high, share = low + 2.0 * rng.random(3) * rng.integers(0, 2, 3), rng.random(3)
        found = called("least_mean_square", low, high, share)
        for _ in range(30):
            line = low + rng.random(3) * (high - low)
            square = (line[:-1] ** 2 + line[:-1] * line[1:] + line[1:] ** 2) / 3.0
            assert found <= share[:-1] @ square + 1e-15
    for least, most in (((1.0, 2.0), (3.0, 5.0)), ((-3.0, -5.0), (-1.0, -2.0))):
        least, most = np.array(least), np.array(most)
        assert called("least_mean_square", least, most, np.array([0.7, 9.0])) == pytest.approx(0.7 * 7.0 / 3.0)
    for least, most in (((2.0, -1.5), (3.0, 4.0)), ((-1.5, 2.0), (0.5, 2.0)), ((-1.0, -9.0), (5.0, -2.0)),
                        ((2.0, -1.0), (2.0, -1.0)), ((-1.0, 2.0), (-1.0, 2.0))):  # fmt: skip
        # the larger end is 2: (4 + 2 x + x^2) / 3 is least, 1, at x = -1
        assert called("least_mean_square", np.array(least), np.array(most), np.array([0.7, 9.0])) == pytest.approx(0.7)


def test_least_temperatures(make):
    """The state at which the least losses keep themselves: magnets on the housing, a winding as cool as it may get."""
    nodes = {
        "two": {}, "one": {"resistance_winding_housing": None, "resistance_housing_ambient": None,
                           "resistance_winding_ambient": 3.0},
        "no times": {"winding_time_constant": None, "housing_time_constant": None},
        "weak magnets": {"magnet_coefficient": -0.004}, "steady magnets": {"magnet_coefficient": 0.0},
    }  # fmt: skip
    for name, change in nodes.items():
        op = random_axis(make, {**change}, {}, RAMP, size=0.8)
        offer = candidates_of(op)
        bound, *_ = bounded(offer)
        case, full, motor = offer.bound_data.cases.case[0], offer.bound_data.full, op.drive.motor
        loss = called("least_mechanical", case, full, np.zeros(0), case.setting.gear_temperature)
        path = called("thermal_nodes", case.motor, case.setting.mounting)
        square = called("least_mean_square", full.motor_low, full.motor_high, full.step_share)
        heat = called("least_housing_loss", case, full, path, square)
        share, rise, coolest = called("resting_share", path, 1, op.demand.time[-1]), 0.0, 31.0
        for _ in range(100):
            copper = square * resistance(motor, coolest) / constant(motor, 31.0 + rise) ** 2
            rise = path.outer * (copper + heat)
            coolest = 31.0 + share * rise
        called("least_mechanical", case, full, np.zeros(0), case.setting.gear_temperature)
        found = called("least_heat", case, full)
        hottest = rise + path.inner * copper
        room = 2e-3 * hottest  # steps that add less than a thousandth end the iteration
        assert 5.0 < rise and 31.0 + hottest - room < found.hottest < 31.0 + hottest + 1e-9, name
        assert 31.0 + rise - room < found.magnets < 31.0 + rise + 1e-9, name
        assert coolest - room < found.coolest < coolest + 1e-9, name
        assert bound.winding_temperature == found.hottest, name
        phase = path.inner or path.outer
        alone = (loss.phase - loss.square) / op.demand.time[-1] * resistance(motor, found.hottest)
        more = phase * alone / constant(motor, found.magnets) ** 2
        rises = 0.0 if change.get("magnet_coefficient") == 1.0 else more
        assert bound.phase_temperature - found.hottest == pytest.approx(rises), name
        for figure, torque in (("motor_current", "motor_torque"), ("rms_current", "rms_torque")):
            assert bound[figure] == pytest.approx(bound[torque] / constant(motor, found.magnets)), name


def test_temperatures_that_have_no_bound(make):
    known = {"resistance_winding_housing": None, "resistance_winding_ambient": None, "max_winding_temperature": 90.0}
    lacking = {**known, "max_winding_temperature": None}
    growing = {"magnet_coefficient": 1e-4}
    for change, coolest, magnets, hottest in (
        (known, 90.0, 31.0, -math.inf), (lacking, 31.0, 31.0, -math.inf), (growing, 31.0, 31.0, 31.0),
        ({"max_winding_temperature": None}, 31.0, 31.0, 31.0),
        ({**growing, "max_winding_temperature": 20.0}, 20.0, 31.0, 31.0),
        ({"magnet_coefficient": -0.02}, None, None, math.inf),
    ):  # fmt: skip
        op = random_axis(make, change, {}, RAMP)
        offer = candidates_of(op)
        bound, used, _, _ = bounded(offer)
        case, full = offer.bound_data.cases.case[0], offer.bound_data.full
        called("least_mechanical", case, full, np.zeros(0), case.setting.gear_temperature)
        heat = called("least_heat", case, full)
        assert heat.hottest == hottest
        if hottest == math.inf:  # it runs away
            assert used == math.inf and heat.magnets > 31.0
            continue
        assert (heat.coolest, heat.magnets) == (coolest, magnets)
        assert math.isnan(bound.winding_temperature) == (hottest == -math.inf)
        if "magnet_coefficient" in change:  # magnets of which is not known how strong they become
            assert math.isnan(bound.motor_current) and bound.phase_temperature == bound.winding_temperature
        else:
            assert bound.motor_current == pytest.approx(bound.motor_torque / constant(op.drive.motor, magnets))


# --- voltage, power and energy


def test_least_voltage_at_every_corner():
    """V = k w + (R T + L dT/dt) / k, each term by itself the smallest or the largest."""
    rng, n = np.random.default_rng(8), 5
    for trial in range(60):
        low = 3.0 * rng.normal(size=n) + 4.0 * rng.integers(-1, 2)
        high = low + rng.random(n) * rng.integers(0, 3, n)
        speed, before, at, after = rng.normal(size=(4, n)) * [[9.0], [5.0], [5.0], [5.0]]
        weak, cool = rng.uniform(0.05, 0.2), rng.uniform(0.3, 1.0)
        strong, warm = weak + rng.uniform(0.0, 0.1), cool + rng.uniform(0.0, 0.5)
        factor, ratio, inductance = rng.uniform(1.0, 2.0), rng.choice([-3.0, 4.0]), rng.choice([math.nan, 0.05])
        motion = SimpleNamespace(speed=speed, rates=np.array([before, at, after]))
        case = SimpleNamespace(gear=SimpleNamespace(ratio=ratio), motor=SimpleNamespace(inductance=inductance))
        held = SimpleNamespace(motion=motion, motor_low=low, motor_high=high)
        largest, ends = 0.0, (low, high)
        for t in range(1, n - 1):
            emf = [k * ratio * speed[t] for k in (weak, strong)]
            drop = [
                factor / k * (r * u + (0.0 if math.isnan(inductance) else inductance) * sum(rates))
                for k in (weak, strong) for r in (cool, warm) for u in (low[t], high[t])
                for rates in itertools.product(
                    *([rate[t] * one[t + d] for one in ends] for rate, d in ((before, -1), (at, 0), (after, 1)))
                )
            ]  # fmt: skip
            least, most = min(emf) + min(drop), max(emf) + max(drop)
            largest = max(largest, least, -most)
        found = called("least_voltage", case, held, (weak, strong), (cool, warm), factor)
        assert found == pytest.approx(largest, rel=1e-12, abs=1e-12), trial


def test_voltage_is_that_of_a_motor_as_cold_or_as_warm_as_may_be(make):
    """Without width and with steady magnets only the resistance is open, between its least and that at the limit."""
    warmest = []
    for name, more, moves in itertools.product(("planetary", "backwards", "drag"), (1.3, 0.7), (1.0, 0.1)):
        motor, gear, task, changes = CASES[name]
        op = random_axis(make, {**motor, "magnet_coefficient": 0.0}, gear, {**task, "amplifier_heat": 0.0},
                         safety=replace(SAFETY, peak_torque=more), moves=moves, **changes)  # fmt: skip
        offer = candidates_of(op)
        bound, *_ = bounded(offer)
        motor, torque, turn, slope = op.drive.motor, op.motor_torque, op.motor_speed, rates(op)
        case, full = offer.bound_data.cases.case[0], offer.bound_data.full
        called("least_mechanical", case, full, np.zeros(0), case.setting.gear_temperature)
        heat = called("least_heat", case, full)
        assert 35.0 < heat.coolest < 121.0
        k, largest = constant(motor, 31.0), []
        for factor, ends in itertools.product((1.0, max(more, 1.0)), ((31.0, 31.0), (heat.coolest, 121.0))):
            volts = [
                k * turn + factor * (resistance(motor, one) * torque + motor.inductance * slope) / k for one in ends
            ]
            least, most = np.min(volts, axis=0)[1:-1], np.max(volts, axis=0)[1:-1]
            largest.append(max(least.max(), -most.min()))
        assert bound.voltage == pytest.approx(max(largest), rel=1e-9)
        warmest.append(max(largest) > max(largest[::2]))
        assert below(bound.voltage, op.figures.voltage) or op.figures.winding_temperature > 121.0
    assert any(warmest) and not all(warmest)


def test_least_of_a_parabola():
    rng = np.random.default_rng(9)
    for _ in range(200):
        square, linear = rng.choice([0.0, 0.02, 2.0]), 0.3 * rng.normal()
        begin = rng.normal()
        end = begin + rng.random() * rng.choice([0.0, 1.0, 5.0])
        x = np.linspace(begin, end, 2001)
        least = ((square * x + linear) * x).min()
        room = square * (x[1] - x[0]) ** 2
        assert least - room - 1e-12 <= called("least_of_parabola", square, linear, begin, end) <= least + 1e-12


def test_certain_loss(make):
    motor = replace(make.motor, magnet_coefficient=-0.002)
    assert called("certain_loss", motor, 40.0, 35.0, True) == pytest.approx(
        resistance(motor, 35.0) / constant(motor, 40.0) ** 2
    )
    assert called("certain_loss", motor, 600.0, 35.0, True) == 0.0  # no magnets left
    growing = replace(motor, magnet_coefficient=0.001)
    assert called("certain_loss", growing, 40.0, 35.0, True) == 0.0
    wanted = resistance(growing, 35.0) / constant(growing, 40.0) ** 2
    assert called("certain_loss", growing, 40.0, 35.0, False) == pytest.approx(wanted)


@pytest.mark.parametrize(
    "name", ["planetary", "backwards", "drag", "self-locking", "most torque at rest", "two parts", "lossy when driven",
             "next to nothing"]
)  # fmt: skip
def test_least_energy_of_every_sample(make, name):
    """The least of w T + c T^2 - s (x - middle) over loads x, at a loss and a slope that are given."""
    motor, gear, task, changes = CASES[name]
    coil = None if name == "two parts" else 7.0
    op = random_axis(make, motor, gear, task, brake=replace(BRAKE, power=coil), **changes)
    motor, turn, rng = op.drive.motor, op.motor_speed, np.random.default_rng(10)
    for coolest, magnets, hottest in ((35.0, 50.0, 70.0), (20.0, 31.0, -math.inf)):
        low, high = interval(op, rng)
        offer = candidates_of(op)
        bounded(offer, low, high, until=0.0)
        case, full = offer.bound_data.cases.case[0], offer.bound_data.full
        called("least_mechanical", case, full, np.zeros(0), case.setting.gear_temperature)
        slope = rng.normal(size=16) * np.abs(turn).max() / 50.0
        found = called("least_energy", case, full, LeastHeat(coolest, magnets, hottest), slope)
        loss, wanted = (
            resistance(motor, coolest) / constant(motor, magnets) ** 2,
            (coil or 0.0) * float(offer.series.motion.weight.sum()),
        )
        tried, weight = corners(op, low, high), offer.series.motion.weight
        loads, torques = ([getattr(one, what) for one in tried] for what in ("demand", "motor_torque"))
        loads, torques = np.array([one.gear_torque for one in loads]), np.array(torques)
        room = 0.0
        locked = [offer.series.motion.loss_speed == 0.0, np.full(16, bounds.mesh_of(case.gear).grip != 0.0)]
        for t in range(16):
            charged, middle = slope[t], 0.5 * (low[t] + high[t])
            if locked[0][t] and locked[1][t]:
                least = loss * least_of(torques[:, t : t + 1])[0] ** 2 - abs(charged) * 0.5 * (high[t] - low[t])
            else:
                least = math.inf
                for i in (0, 1):
                    x = np.linspace(loads[i, t], loads[i + 1, t], 4001)
                    torque = np.linspace(torques[i, t], torques[i + 1, t], 4001)
                    least = min(least, ((turn[t] + loss * torque) * torque - charged * (x - middle)).min())
                    room += weight[t] * loss * (torque[1] - torque[0]) ** 2
            wanted += weight[t] * least
        assert wanted - room - 1e-9 * abs(wanted) <= found <= wanted + 1e-9 * abs(wanted)


def test_the_slope_of_the_power_is_its_derivative(make):
    """Of drives without friction at ambient temperature; the mean of the first eight or of eight between all."""
    axis = random_axis(
        make, {"inductance": None}, {"efficiency": 0.7}, {**RAMP, "friction": Friction(), "motor_friction": Friction()}
    )
    demand = replace(axis.demand, carrier_acceleration=0.0 * axis.demand.speed)
    op = Operation(demand, axis.drive, axis.study, 0)
    offer, rng = candidates_of(op), np.random.default_rng(11)
    ratios = 30.0 + 5.0 * np.arange(17)
    numbers = offer.bound_data.cases
    gears = np.repeat(offer.records.gears[numbers.pairs[0, 1]].reshape(1), 17)
    gears["ratio"] = ratios
    pairs = np.column_stack([np.full(17, numbers.pairs[0, 0]), np.arange(17)])
    numbers = numbers._replace(gears=as_numbers(gears), direct=np.zeros(17), pairs=pairs)
    low, high = interval(op, rng)
    motion = offer.bound_data.full.motion
    motor, middle, step = op.drive.motor, 0.5 * (low + high), 1e-3

    def power(ratio, load):
        gear = replace(op.drive.gear, ratio=ratio)
        torque = Operation(replace(demand, gear_torque=load), replace(op.drive, gear=gear), op.study, 0).motor_torque
        return ratio * demand.speed * torque + resistance(motor, 31.0) * (torque / constant(motor, 31.0)) ** 2

    for first, count, chosen in (
        (True, 17, range(8)),
        (False, 17, [k * 17 // 8 for k in range(8)]),
        (False, 3, range(3)),
    ):
        slope, moved = np.zeros(16), (motion.speed, motion.loss_speed, motion.acceleration)
        bounds.mean_power_slope(numbers, moved, middle, np.arange(count), first, slope)
        wanted = np.mean([power(ratios[k], middle + step) - power(ratios[k], middle - step) for k in chosen], axis=0)
        moves = np.abs(middle) > step
        np.testing.assert_allclose(slope[moves], wanted[moves] / (2.0 * step), rtol=1e-6, atol=1e-6)
        assert moves.sum() > 12


def test_energy_that_open_drives_may_change():
    rng = np.random.default_rng(12)
    half, unit = rng.random((2, 5)), rng.normal(size=(2, 5, 7))
    half[:, [1, 4]] = 0.0
    weight, slope = rng.random(7), rng.normal(size=7)
    tried = [
        abs((slope * weight) @ np.tensordot(np.array(signs).reshape(2, 3) * half[:, [0, 2, 3]], unit[:, [0, 2, 3]], 2))
        for signs in itertools.product((-1.0, 1.0), repeat=6)
    ]
    assert bounds.energy_of_slope(half, unit, slope * weight) == pytest.approx(max(tried))


def test_a_load_between_the_ends_of_other_drives():
    rng = np.random.default_rng(13)
    load, unit = rng.normal(size=9), rng.normal(size=(2, 5, 9))
    low = rng.normal(size=(2, 5))
    high = low + rng.random((2, 5)) * rng.integers(0, 2, (2, 5))
    bottom, top, half = np.empty(9), np.empty(9), np.empty((2, 5))
    bounds.load_interval(load, unit, low, high, bottom, top, half)
    each = np.stack([low[:, :, None] * unit, high[:, :, None] * unit])
    least, most = (load + f(each, axis=0).sum(axis=(0, 1)) for f in (np.min, np.max))
    np.testing.assert_allclose(bottom, least, rtol=0.0, atol=1e-10)
    np.testing.assert_allclose(top, most, rtol=0.0, atol=1e-10)
    assert (bottom < least + 1e-15).all() and (top > most - 1e-15).all()  # never inside, however it is rounded
    np.testing.assert_allclose(half, 0.5 * (high - low), rtol=1e-9)


def test_power_of_any_candidate(make):
    """Every motor torque in its interval, with the least and the largest loss that a feasible winding may have."""
    unheated = {"resistance_winding_housing": None, "resistance_winding_ambient": None}
    for name, change, brake, switches in (
        ("planetary", {}, 7.0, 0.02), ("backwards", {"magnet_coefficient": 0.0}, 7.0, 0.02),
        ("two parts", {"magnet_coefficient": 1e-3}, 7.0, None), ("planetary", unheated, None, 0.02),
        ("next to nothing", {"magnet_coefficient": 1e-3}, None, None),
    ):  # fmt: skip
        motor, gear, task, changes = CASES[name]
        amplifier = Amplifier(peak_current=40.0, continuous_current=9.0, on_resistance=switches)
        op = random_axis(make, {**motor, **change}, gear, {**task, "amplifier": amplifier},
                         brake=replace(BRAKE, power=brake), **changes)  # fmt: skip
        low, high = interval(op, np.random.default_rng(14))
        offer = candidates_of(op)
        bounded(offer, low, high, until=0.0)
        least, most = np.zeros((2, 16))
        bounds.candidate_power_range(offer.bound_data, np.zeros(1, np.int64), least, most)
        torques = np.array([one.motor_torque for one in corners(op, low, high)])
        motor, limit, heated = op.drive.motor, 125.0, change is not unheated
        hot = limit - 4.0 if heated else limit
        loses = motor.magnet_coefficient < 0.0 and heated
        weak, cold = constant(motor, hot if loses else 31.0), 31.0 if heated else limit
        certain = resistance(motor, cold) / constant(motor, 31.0) ** 2
        certain = 0.0 if heated and motor.magnet_coefficient > 0.0 else certain
        largest = (resistance(motor, hot) + 2.0 * (switches or 0.0)) / weak**2
        tried = torques.min(axis=0) + np.linspace(0.0, 1.0, 4001)[:, None] * np.ptp(torques, axis=0)
        power = (op.motor_speed + certain * tried) * tried + (brake or 0.0)
        room, close = certain * (np.ptp(torques, axis=0) / 4000.0) ** 2, 1e-9 * np.abs(power).max(axis=0)
        assert (least <= power.min(axis=0) + close).all() and (least >= power.min(axis=0) - room - close).all(), name
        drawn = ((op.motor_speed + largest * tried) * tried + (brake or 0.0)).max(axis=0)
        np.testing.assert_allclose(most, drawn, rtol=1e-9, atol=1e-15)


# --- many candidates


def several(make):
    """Nine pairs at one axis, some of which lack data or are too weak."""
    op = random_axis(make, {}, {"stiffness_1": 4e4}, RAMP)
    motors = {f"m{k}": replace(op.drive.motor, key=f"m{k}", resistance=0.1 * (k + 1)) for k in range(3)}
    gears = {"g0": op.drive.gear, "g1": replace(op.drive.gear, key="g1", repeated_peak_torque=11.0),
             "g2": replace(op.drive.gear, key="g2", stiffness_1=None)}  # fmt: skip
    task = replace(op.task, drive=None, pairs=tuple(itertools.product(motors, gears)))
    study = replace(op.study, joints=(task,), catalog=replace(op.study.catalog, motors=motors, gears=gears))
    return candidates_of(Operation(op.demand, op.drive, study, 0))


def test_candidates_are_taken_in_turn(make):
    offer, rng = several(make), np.random.default_rng(15)
    full, count = offer.bound_data.full, len(offer.bound_data.cases.pairs)
    low, high = full.low - 0.3 * rng.random(16), full.high + 0.3 * rng.random(16)
    full.low[:], full.high[:] = low, high
    base, none, everything = rng.random(count), np.zeros(count, np.bool_), np.arange(count)

    def tried(pairs, cost, exact=none, **options):
        given = {"until": np.inf, "with_energy": False, **options}
        raised = cost.copy()
        return (*offer.bound(pairs, base, raised, exact, **given), raised)

    tested, used, _, _, same = tried(everything, base)
    assert tested == count and (same == base).all()
    lacking, gear = np.isinf(used), offer.bound_data.cases.pairs[:, 1]
    assert lacking.any() and not lacking.all() and set(gear[lacking]) == {gear.max()}
    for k in everything[~lacking]:  # each as alone
        assert tried(everything[[k]], base[[k]], none[:1])[1] == used[k]
    # Exact ones are not tested, nor those that cost too much; only what may be cheapest if that is asked.
    exact = np.arange(count) % 4 == 1
    tested, some, *_ = tried(everything, base, exact, cost_limit=0.7)
    asked = ~exact & (base < 0.7)
    assert tested == asked.sum() and (some[asked] == used[asked]).all() and (some[~asked] == 0.0).all()
    told = 0
    for seed, until in itertools.product(range(10), (np.median(used[~lacking]), 99.0)):
        cost, expected = np.random.default_rng(seed).random(count), []
        exact = np.random.default_rng(seed + 10).random(count) < 0.3
        before = cheapest = cost[exact].min(initial=math.inf)
        for k in everything:
            if not exact[k] and cost[k] < min(cheapest, 0.8):
                expected.append(k)
                cheapest = min(cheapest, cost[k]) if used[k] <= until else cheapest
        tested, some, *_ = tried(everything, cost, exact, until=until, test_all=False, cost_limit=0.8)
        assert tested == len(expected) and (np.flatnonzero(some) == expected).all()
        told += 0 < len(expected) < (~exact & (cost < min(before, 0.8))).sum()
    assert told > 2
    # What costs energy costs as much more as it draws at least; the slope is that of the cheapest, or of all.
    for weight in (0.0, 0.02):
        _, used, energy, slope, cost = tried(everything, base, with_energy=True, energy_weight=weight)
        assert (np.isfinite(energy[~lacking])).all() and (energy[~lacking] != 0.0).all()
        wanted = np.maximum(base, base + weight * energy)
        np.testing.assert_allclose(cost[~lacking], wanted[~lacking], rtol=1e-6)
        assert (cost <= np.maximum(wanted, base)).all() and (cost > base)[~lacking].all() == (weight > 0.0)
        mean_slope = np.zeros(16)
        moved, middle = (full.motion.speed, full.motion.loss_speed, full.motion.acceleration), 0.5 * (low + high)
        bounds.mean_power_slope(
            offer.bound_data.cases, moved, middle + full.loss_friction, everything, weight > 0.0, mean_slope
        )
        np.testing.assert_allclose(slope, mean_slope, rtol=1e-9)


def test_open_drives_may_save_energy(make):
    """What they may change is taken off, but never more than without any slope."""
    offer = several(make)
    full, data = offer.bound_data.full, offer.bound_data
    full.low[:], full.high[:] = full.low - 0.1, full.high + 0.1
    pairs, none, base = np.arange(2), np.zeros(2, np.bool_), np.full(len(offer.bound_data.cases.pairs), 5.0)
    for half in (0.0, 1e-4, 1.0):
        unit = np.ones((1, 5, 16))
        open_ = replace(offer, bound_data=data._replace(half_width=np.full((1, 5), half), unit_torque=unit))
        cost, weight = np.full(2, 5.0), 0.5
        options = {"until": np.inf, "with_energy": True, "energy_weight": weight}
        _, _, energy, slope = open_.bound(pairs, base, cost, none, **options)
        saved = 5.0 * half * abs(slope @ full.motion.weight)
        for k in pairs:
            offer.bound(pairs[[k]], base, np.full(1, 5.0), none[:1], **options)
            case = offer.bound_data.cases.case[0]
            heat = called("least_heat", case, full) if half == 1.0 else None
            least = energy[k] - saved
            if half == 1.0:
                without = called("least_energy", case, full, heat, np.zeros(16))
                assert without > least
                least = without
            assert cost[k] == pytest.approx(max(5.0, 5.0 + weight * least), rel=1e-6)


def test_key_samples():
    """Of each section that of largest acceleration and that of largest certain torque."""
    rng = np.random.default_rng(16)

    def held(n):
        names = "low high friction loss_friction".split()
        moved = "speed loss_speed acceleration carrier_acceleration".split()
        motion = SimpleNamespace(**{one: rng.normal(size=n) for one in moved})
        return SimpleNamespace(
            motion=motion, unit_torque=rng.normal(size=(5, n)), powers=SimpleNamespace(exponent=np.zeros(1)),
            **{one: rng.normal(size=n) for one in names},
        )  # fmt: skip

    full, key = held(16 * 5 + 3), held(32)  # sixteen sections of five samples, and three samples left over
    full.high = full.low + rng.random(83)
    full.low[15:20] -= 9.0
    full.high[15:20] -= 9.0
    peaks = 5 * np.arange(16) + rng.integers(0, 5, 16)
    bounds.fill_key_samples(key, full, peaks)
    certain = np.maximum(full.low, -full.high)
    at = [*peaks, *(5 * k + int(certain[5 * k : 5 * k + 5].argmax()) for k in range(16))]
    assert math.isnan(key.powers.exponent[0])
    for one in ("low", "high", "friction", "loss_friction"):
        np.testing.assert_array_equal(getattr(key, one), getattr(full, one)[at])
    for one in vars(full.motion):
        np.testing.assert_array_equal(getattr(key.motion, one), getattr(full.motion, one)[at])
    np.testing.assert_array_equal(key.unit_torque, full.unit_torque[:, at])
    np.testing.assert_array_equal(bounds.section_peaks(np.arange(3.0)), np.arange(16) % 3)


PEAKS = "gear repeated peak torque", "gear momentary peak torque", "motor peak torque"


def test_a_candidate_that_is_out_at_key_samples_is_not_looked_at_again(make):
    """What is largest there is told, here what is largest of all: every sample is a key sample."""
    op = random_axis(make, {}, {"max_input_speed": 1e5, "average_input_speed_limit": 1e5}, RAMP, size=-1.3)
    offer = candidates_of(op)
    _, used, _, _ = bounded(offer)
    figures = offer.bound_data.cases.case[0].figures.copy()
    quick, first, nothing, _ = bounded(offer, op.demand.gear_torque, op.demand.gear_torque, until=0.5)
    assert first == pytest.approx(max(op.judgement.used[name] for name in PEAKS))
    assert nothing == 0.0 and math.isnan(quick.voltage) and not math.isnan(figures.voltage) and used >= first
