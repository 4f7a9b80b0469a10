"""Every verdict of an unusual crane worked out again by numpy, pinocchio and the cells of the catalogue alone.

A column whose drive rides on the link that it turns, a boom with a spring, a brake and friction that grows with its
load, a ram on a screw without a gear. Held against the table of checks number by number, required and limit.
"""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np
import pinocchio as pin

import drivetrain as dt

PASS, MARGINAL = dt.Verdict.PASS, dt.Verdict.MARGINAL
CATALOGS = Path(__file__).parents[2] / "catalogs"
SI = {"mNm": 1e-3, "mNm/A": 1e-3, "rpm": math.pi / 30.0, "g cm^2": 1e-7, "kg cm^2": 1e-4, "mm": 1e-3, "mH": 1e-3}
SI |= {"arcmin": math.pi / 10800.0, "h": 3600.0, "ms": 1e-3}
NAMES, AXES = ("slew", "boom", "ram"), np.array([[0, 0, 1.0], [0, -1, 0], [1, 0, 0]])
DRIVES = (("AM_MF0127032_48V", "hd_SHG-40-80-2UH"), ("AM_MF0127032_48V", "hd_SHG-45-100-2UH"), ("AM_MF0095032_48V", ""))
AIR, COLD, VOLTS, MODULATION, RAMP, RMS_TO_DC = 45.0, -10.0, 48.0, 0.95, 0.5, math.sqrt(1.5)
FACTORS = {"peak_torque": 1.25, "rms": 1.1, "speed": 1.05, "voltage": 1.02, "brake": 1.7}
FACTORS |= {"inertia_ratio": 30.0, "life": 2e7}
SPRING = {"stiffness": 9e3, "free_length": 0.2, "lever_carrier": 0.3, "lever_link": 0.12, "dead_centre": math.pi / 2}
SCREW = {"lead": 0.016 / (2 * math.pi), "efficiency": 0.88, "diameter": 0.025, "root_diameter": 0.021, "length": 0.6}
COULOMB, VISCOUS, SHARE = (1.0, 3.0, 0.01), (0.5, 2.0, 0.0), (0.0, 0.03, 0.0)
AMPLIFIER = {"peak_current": 30.0, "continuous_current": 12.0, "peak_time": 2.0}
STANDBY, SWITCH, AMPLIFIER_HEAT, BRAKE = 4.0, 0.006, (0.0, 0.5, 0.0), "BR_8JSA_4"
PAYLOAD, COM, TURN = 12.0, (0.05, 0.0, -0.1), 0.15
CAPACITY, THRESHOLD, RESISTOR = 0.02, 54.0, 6.0
ARM = "".join(
    f'''<link name="{child}"><inertial><origin xyz="{centre}"/><mass value="{mass}"/><inertia ixx="{turn[0]}"
    iyy="{turn[1]}" izz="{turn[2]}" ixy="0" ixz="0" iyz="0"/></inertial></link><joint name="{name}" type="{kind}">
    <parent link="{parent}"/><child link="{child}"/><origin xyz="{place}" rpy="{turned} 0 0"/><axis xyz="{axis}"/><limit
    lower="-6" upper="6" effort="1e4" velocity="20"/></joint>'''
    for name, kind, parent, child, place, turned, axis, centre, mass, turn in (
        ("slew", "revolute", "base", "column", "0 0 0.4", 0.1, "0 0 1", "0.05 0.02 0.3", 20, (0.8, 0.8, 0.4)),
        ("boom", "revolute", "column", "jib", "0.1 0 0.6", 0, "0 -1 0", "0.4 0 0", 12, (0.1, 0.8, 0.8)),
        ("ram", "prismatic", "jib", "pole", "0.5 0 0", 0, "1 0 0", "0.3 0 0", 4, (0.01, 0.1, 0.1)),
    )
)


def cells(table):
    """Rows by key, in SI; empty cells left out."""
    found = {}
    with (CATALOGS / f"{table}.csv").open(encoding="utf-8") as file:
        for row in csv.DictReader(file):
            found[row["key"]] = own = {}
            for header, text in row.items():
                name, _, unit = header.partition(" [")
                try:
                    own[name] = float(text) * SI.get(unit.rstrip("]"), 1.0)
                except ValueError:
                    own |= {name: text} if text else {}
    return found


MOTORS, GEARS, BRAKES = (cells(table) for table in ("motors", "gears", "brakes"))


def moves():
    """(t, q, qd, qdd): there and back by polynomials that set off without a jerk."""
    s = np.linspace(0.0, 1.0, 61)[:, None]
    ends, found = np.array([[-0.4, -0.3, 0.0], [0.9, 0.7, 0.35]]), []
    for (start, end), length in (((0, 1), 1.6), ((1, 0), 1.3)):
        span = ends[end] - ends[start]
        rates = (10 * s**3 - 15 * s**4 + 6 * s**5, 30 * s**2 * (1 - s) ** 2, 60 * s * (1 - s) * (1 - 2 * s))
        q, qd, qdd = (rate * span / length**k for k, rate in enumerate(rates))
        found.append((s[:, 0] * length, ends[start] + q, qd, qdd))
    return found


def study(path):
    there, back = moves()
    joint = [{"drive": {"motor": m, "gear": g or "none"}, "friction": {"coulomb": c, "viscous": v, "load_share": x},
              "amplifier_heat": h}
             for (m, g), c, v, x, h in zip(DRIVES, COULOMB, VISCOUS, SHARE, AMPLIFIER_HEAT, strict=True)]  # fmt: skip
    joint[0]["mount"] = {"carrier": "child", "offset": 0.05}
    joint[1] |= {"counterbalances": [SPRING], "brake": BRAKE}
    joint[2]["stages"] = [{"type": "screw", "ends": "fixed-supported", "diameter_speed": 12.0, **SCREW}]
    turn = {"xx": TURN, "yy": TURN, "zz": TURN}
    return dt.study(
        str(path),
        [{"motion": there, "payload": "load"}, {"dwell": 1.5, "payload": "load"}, {"motion": back}, {"dwell": 0.7}],
        drive_mass="added", payloads={"load": {"mass": PAYLOAD, "com": COM, "inertia": turn}},
        joints=dict(zip(NAMES, joint, strict=True)), ambient=AIR, cold_start=COLD, holding="most", safety=FACTORS,
        supply={"voltage": VOLTS, "peak_power": 2500.0, "mean_power": 300.0, "regenerated_power": 40.0,
                "capacity": CAPACITY, "max_voltage": 58.0, "threshold": THRESHOLD, "resistance": RESISTOR},
        amplifier={"current_basis": "rms", "standby_power": STANDBY, "on_resistance": SWITCH, **AMPLIFIER},
        stop={"ramp": RAMP, "power_off": False, "stops_per_day": 20.0, "service_life": 3e8},
    )  # fmt: skip


class Crane:
    """The arm in pinocchio: stators and gears as cylinders, rotors as bodies on joints of their own."""

    def __init__(self, path, drives, loaded, without=None):
        self.model, self.drives = pin.buildModelFromUrdf(str(path)), drives
        self.ids, self.rotors = [self.model.getJointId(name) for name in NAMES], {}
        if loaded:
            self.put(self.ids[2], PAYLOAD, COM, TURN * np.eye(3))
        for k, one in enumerate(drives):
            joint, axis, along = self.ids[k], AXES[k], np.outer(AXES[k], AXES[k])
            seat = (self.model.parents[joint], self.model.jointPlacements[joint]) if k else (joint, pin.SE3.Identity())
            turn = one.across * np.eye(3) + (one.along - one.across) * along
            self.put(seat[0], one.mass, (0.0 if k else 0.05) * axis, turn, seat[1])
            if k != without:
                rotor = self.model.addJoint(seat[0], pin.JointModelRevoluteUnaligned(axis), seat[1], f"rotor {k}")
                self.put(rotor, 0.0, (0, 0, 0), one.inertia * along)
                self.rotors[k] = rotor
        self.data = self.model.createData()

    def put(self, joint, mass, centre, turn, place=None):
        body = pin.Inertia(mass, np.array(centre, float), turn)
        self.model.appendBodyToJoint(joint, body if place is None else place.act(body), pin.SE3.Identity())

    def spread(self, values):
        full = np.zeros(self.model.nv)
        for k, joint in enumerate(self.ids):
            full[self.model.joints[joint].idx_v] = values[k]
        for k, joint in self.rotors.items():
            full[self.model.joints[joint].idx_v] = self.drives[k].ratio / self.drives[k].travel * values[k]
        return full

    def loads(self, q, qd, qdd):
        """Torque at each gear's output, what turns each rotor, and moment and force that each joint passes on."""
        torque = pin.rnea(self.model, self.data, *map(self.spread, (q, qd, qdd)))
        own = np.array([torque[self.model.joints[joint].idx_v] for joint in self.ids])
        a, b, angle = SPRING["lever_carrier"], SPRING["lever_link"], q[1] - SPRING["dead_centre"]
        point = b * np.array([math.cos(angle), math.sin(angle)])
        rope = point - [a, 0.0]
        pull = -SPRING["stiffness"] * (1.0 - SPRING["free_length"] / np.linalg.norm(rope)) * rope
        own[1] -= point[0] * pull[1] - point[1] * pull[0]
        turned = np.array([torque[self.model.joints[self.rotors[k]].idx_v] for k in range(3)])
        wrench = np.array([[self.data.f[joint].angular, self.data.f[joint].linear] for joint in self.ids])
        return own * [one.travel for one in self.drives], turned, wrench

    def inertia(self, joint, q):
        mass = pin.crba(self.model, self.data, self.spread(q))
        unit = self.spread(np.eye(3)[joint]) * self.drives[joint].travel
        return unit @ (np.triu(mass) + np.triu(mass, 1).T) @ unit


class Drive:
    """Sheets of one joint's drive as its laws need them."""

    def __init__(self, k):
        motor, gear = MOTORS[DRIVES[k][0]], GEARS.get(DRIVES[k][1], {})
        self.motor, self.gear, self.brake = motor, gear, BRAKES[BRAKE] if k == 1 else {}
        brake, screw, share = self.brake, k == 2, SHARE[k]
        self.kt, self.ohms, self.travel = motor["torque_constant"], motor["resistance"], SCREW["lead"] if screw else 1.0
        self.ratio, self.shaft = gear.get("ratio", 1.0), motor["rotor_inertia"] + brake.get("inertia", 0.0)
        across = 0.5 * (SCREW["diameter"] + SCREW["root_diameter"])
        rod = math.pi / 32.0 * 7850.0 * SCREW["length"] * across**4 if screw else 0.0
        self.inertia, self.rod = self.shaft + gear.get("inertia", 0.0) + rod, rod
        eta = SCREW["efficiency"] if screw else gear["mesh_efficiency"]
        self.driving, self.driven = (1.0 + share) / eta, (1.0 - share) * (2.0 - 1.0 / eta)
        self.onward = self.driving if screw else 1.0 + share
        self.coulomb, self.viscous, self.heat_share = COULOMB[k], VISCOUS[k], AMPLIFIER_HEAT[k]
        bodies = [self.cylinder(motor["mass"] + brake.get("mass", 0.0), motor["diameter"], motor["length"])]
        bodies += [self.cylinder(gear["mass"], gear.get("diameter"), gear.get("length"))] if gear else []
        self.mass, self.across, self.along = np.sum(bodies, axis=0) - [0.0, 0.0, self.shaft]

    @staticmethod
    def cylinder(mass, wide, tall):
        room = 4.0 * mass / (5200.0 * math.pi)
        wide = wide or (math.sqrt(room / tall) if tall else room ** (1.0 / 3.0))
        tall = tall or room / wide**2
        return mass, mass * (0.75 * wide**2 + tall**2) / 12.0, mass * wide**2 / 8.0

    def drag(self, speed, temperature):
        gear, d = self.gear, min(max(temperature, -10.0), 40.0) - 20.0
        if not gear:
            return 0.0 * speed
        warm = math.exp(-gear["drag_temperature_1"] * d + gear["drag_temperature_2"] * d * d)
        turning = gear["drag_torque"] * (abs(speed) / gear["drag_speed"]) ** gear["drag_speed_exponent"] * warm
        return np.sign(speed) * (turning + gear["seal_drag_torque"])

    def torque(self, load, rotor, speed, temperature):
        """Of the motor: all losses by the direction of power, the most that holds at rest."""
        starts = max(self.gear.get("starting_torque", 0.0), self.gear.get("seal_drag_torque", 0.0))
        held = self.driving * load + np.sign(load) * starts * self.ratio
        factor = np.where(load * speed > 0.0, self.driving, self.driven)
        through = np.where(speed == 0.0, held, factor * load) / self.ratio
        return through + rotor + self.drag(self.ratio * speed, temperature)

    def rubs(self, speed):
        return np.sign(speed) * self.coulomb + self.viscous * speed

    def starting(self, load, rotor, way):
        """Breaking loose against the load, or else in the way of the motion that follows."""
        way = np.where(load != 0.0, np.sign(load), way)
        starts = max(self.gear.get("starting_torque", 0.0), self.gear.get("seal_drag_torque", 0.0))
        return self.driving * (load + way * self.coulomb) / self.ratio + way * starts + rotor

    def resistance(self, temperature):
        return self.ohms * (1.0 + 0.0039 * (temperature - 25.0))

    def constant(self, temperature):
        return self.kt * (1.0 - 0.001 * (temperature - 25.0))


def worked_out(path):
    """Required and limit of every check, by joint and name."""
    drives = [Drive(k) for k in range(3)]
    arms = {loaded: Crane(path, drives, loaded) for loaded in (True, False)}
    (t, q, qd, qdd), (t2, q2, qd2, qdd2) = moves()
    still = np.zeros((2, 3))
    time = np.concatenate([t, t[-1] + [0.0, 1.5], t[-1] + 1.5 + t2, t[-1] + 1.5 + t2[-1] + np.array([0.0, 0.7])])
    q, qd, qdd = (np.concatenate(rows) for rows in (
        (q, q[[-1, -1]], q2, q2[[-1, -1]]), (qd, still, qd2, still), (qdd, still, qdd2, still)))  # fmt: skip
    loaded = np.arange(len(time)) < len(t) + 2
    steps = np.diff(time)
    weight = np.convolve(steps, [0.5, 0.5]) / time[-1]
    states = list(zip(loaded, q, qd, qdd, strict=True))
    gear, rotor, wrench = (
        np.array(rows) for rows in zip(*(arms[a].loads(*motion) for a, *motion in states), strict=True)
    )
    static = np.array([arms[a].loads(one, 0 * one, 0 * one)[0] for a, one, *_ in states])
    stops = [(moving, arms[a].loads(one + v * RAMP * s * (1 - s / 2), v * (1 - s), -v / RAMP))
             for a, one, v, _ in states if v.any() for s in (0.0, 0.5, 1.0)
             for moving in (np.where(abs(v) > 0.0, v * max(1 - s, 1e-9), 0.0),)]  # fmt: skip
    more, table, power, least = FACTORS["peak_torque"], {}, np.zeros(len(time)), np.zeros(len(time))
    for k, (name, one) in enumerate(zip(NAMES, drives, strict=True)):
        speed, row, motor, box = qd[:, k] / one.travel, {}, one.motor, one.gear
        speed = np.where(abs(speed) > 1e-9 * abs(speed).max(), speed, 0.0)
        rest, fastest, mean = speed == 0.0, abs(speed).max(), weight @ abs(speed)
        bare = [Crane(path, drives, a, without=k) for a in (True, False)]
        inertia = max(abs(bare[1 - a].inertia(k, at)) for a, at, *_ in states)
        load = gear[:, k] + one.rubs(speed)
        held = abs(load + np.where(rest, np.sign(load) * one.coulomb, 0.0))
        borne = np.where(rest | (load * speed > 0.0), one.onward, 1.0) * held
        worn = np.where(load * speed > 0.0, one.onward, 1.0) * abs(load)
        spinning = one.ratio * speed
        drawn = one.torque(load, rotor[:, k], speed, 20.0)
        way = np.where(np.roll(speed, -1) != 0.0, np.sign(np.roll(speed, -1)), 0.0)
        starting = np.where(rest, np.maximum(abs(drawn), abs(one.starting(gear[:, k], rotor[:, k], way))), abs(drawn))
        # Stops on a ramp: of gear and motor, no loss helping, all of them where the motor drives on.
        push = turn = 0.0
        for moving, (forces, rotors, _) in stops:
            rate = moving[k] / one.travel
            rubbed = forces[k] + one.rubs(rate)
            lossy = float(one.torque(rubbed, rotors[k], np.array(rate), COLD))
            push = max(push, one.onward * max(abs(forces[k]), abs(rubbed)))
            turn = max(turn, abs(forces[k] / one.ratio + rotors[k]), abs(lossy))
        if box:
            row["gear repeated peak torque"] = borne.max() * more, box["repeated_peak_torque"]
            row["gear momentary peak torque"] = max(borne.max(), push) * more, box["momentary_torque"]
            average = (weight @ (abs(speed) * worn**3) / mean) ** (1.0 / 3.0)
            row["gear average torque"] = average, box["average_torque_limit"]
            row["gear maximum input speed"] = one.ratio * fastest * FACTORS["speed"], box["max_input_speed"]
            slow = box.get("average_input_speed_limit", 0.38 * box["max_input_speed"])
            row["gear mean input speed"] = one.ratio * mean * FACTORS["speed"], slow
            life = (
                (box["continuous_torque"] / average) ** 3 * box["rated_life"] * box["rated_speed"] / (one.ratio * mean)
            )
            row["gear life L10"] = FACTORS["life"] / 3600.0, life / 3600.0
            waves = 1e4 / (2.0 * one.ratio * 0.5 * fastest * RAMP / (2.0 * math.pi))
            row["gear momentary peaks"] = (
                20.0 * 3e8 / 86400.0, math.inf if push * more <= box["repeated_peak_torque"] else waves)  # fmt: skip
            moment, force = wrench[:, k, 0], wrench[:, k, 1]
            axial, across = force @ AXES[k], np.linalg.norm(np.cross(force, AXES[k]), axis=1)
            about = (moment - np.cross(side * box["bearing_offset"] * AXES[k], force) for side in (1.0, -1.0))
            tilt = np.maximum(*(np.linalg.norm(np.cross(one_side, AXES[k]), axis=1) for one_side in about))
            row["output bearing tilting moment"] = tilt.max() * more, box["tilting_moment_limit"]
            row["output bearing axial load"] = abs(axial).max() * more, box["axial_load_limit"]
            row["output bearing radial load"] = across.max() * more, box["radial_load_limit"]
            wide = box["bearing_pitch_diameter"]
            heavy = across.max() + 2.0 * tilt.max() / wide + 0.44 * abs(axial).max()
            row["output bearing static load"] = 1.5 * heavy, box["bearing_static_rating"]
            rolled = across + 2.0 * tilt / wide
            rolled = np.where(abs(axial) <= 1.5 * rolled, rolled + 0.45 * abs(axial), 0.67 * (rolled + abs(axial)))
            rolled = (weight @ (abs(speed) * rolled ** (10 / 3)) / mean) ** 0.3
            hours = 1e6 / (60.0 * mean * 30.0 / math.pi) * (box["bearing_dynamic_rating"] / (1.2 * rolled)) ** (10 / 3)
            row["output bearing life L10"] = FACTORS["life"] / 3600.0, hours
        else:
            section, length = math.pi * SCREW["root_diameter"] ** 4 / 64.0, SCREW["length"]
            ends = math.pi**2 * 2.06e11 * section / (math.pi / 4.493409 * length) ** 2 / 2.0 * SCREW["lead"]
            row["torque behind the gear"] = held.max() * more, ends
            bent = (3.926602 / length) ** 2 * SCREW["root_diameter"] / 4.0 * math.sqrt(2.06e11 / 7850.0)
            row["speed behind the gear"] = fastest * FACTORS["speed"], min(0.8 * bent, 12.0 / SCREW["diameter"])
        row["motor speed"] = one.ratio * fastest * FACTORS["speed"], 0.92 * motor["no_load_speed"]
        if one.brake:
            hold, grip = abs(static[:, k]).max() / one.ratio, one.brake["static_torque"]
            row["holding brake torque"] = hold * FACTORS["brake"], grip
            turning = (one.inertia + inertia / one.ratio**2) * (one.ratio * fastest) ** 2 / 2.0
            row["holding brake energy"] = turning * grip / (grip - hold), 26.0 * grip
        moved = inertia / one.ratio**2 + one.rod  # the screw is load
        row["inertia ratio"] = moved / (one.inertia - one.rod), FACTORS["inertia_ratio"]
        # Heat: one node, at 40 C and more a gear drags no less; magnets and winding by their mean.
        coil, hot = one.brake.get("power", 0.0), one.constant(110.0)
        lost = np.where(load * speed > 0.0, one.driving - 1.0, one.driven - 1.0) * load * speed
        lost += one.drag(spinning, 40.0) * spinning + coil
        lost += one.heat_share * (STANDBY + 2.0 * SWITCH * (drawn / hot) ** 2)
        square = steps @ (drawn[:-1] ** 2 + drawn[:-1] * drawn[1:] + drawn[1:] ** 2) / 3.0 / time[-1]
        way_out, warm = motor["resistance_winding_ambient"], AIR
        for _ in range(99):
            warm = AIR + way_out * (square * one.resistance(warm) / one.constant(warm) ** 2 + weight @ lost)
        constant = one.constant(warm)
        current, rms = drawn / constant, math.sqrt(weight @ drawn**2) / constant
        # At rest one phase may carry the amplitude: twice its share of the loss, through all of the one way out.
        still = np.where(rest[1:] & rest[:-1], steps, 0.0)
        phase = np.sqrt(1.0 + np.convolve(still, [1, 1]) / np.convolve(steps, [1, 1]))
        extra, whole = way_out * (weight @ ((phase**2 - 1.0) * current**2)), way_out * (weight @ (phase * current) ** 2)
        slope = one.resistance(1.0) - one.resistance(0.0)
        row["winding temperature"] = warm, 110.0
        row["phase temperature at rest"] = warm + extra * one.resistance(warm) / (1.0 - whole * slope), 110.0
        short, strongest, lasting = motor["peak_torque"], 30.0 * RMS_TO_DC, 12.0 * RMS_TO_DC
        row["motor peak torque"] = starting.max() * more, short
        row["amplifier peak current"] = starting.max() / constant * more, strongest
        row["amplifier continuous current"] = rms * FACTORS["rms"], lasting
        held = math.sqrt(weight @ (phase * current) ** 2) * FACTORS["rms"]
        row["amplifier phase current at rest"] = held, lasting
        row["current to stop"] = turn / constant * more, strongest
        cooler = motor["nominal_current"] * math.sqrt((110.0 - AIR) / (110.0 - 25.0))
        melts = math.sqrt((110.0 - AIR) / (one.resistance(110.0) * way_out))
        row["motor RMS current"] = rms * FACTORS["rms"], min(cooler, melts)
        full, overload = 0.0, 0.0
        for _ in range(2):
            for step, now in zip(steps, current, strict=False):
                full = max(full + ((now * FACTORS["rms"]) ** 2 - lasting**2) * step, 0.0)
                overload = max(overload, full)
        row["amplifier overload (I2t)"] = overload / ((strongest**2 - lasting**2) * 2.0), 1.0

        def voltage(torque, constant, ohms, one=one, spinning=spinning, rest=rest):
            """Largest, with the plain and the factored torque; the rate from both sides where both are smooth."""
            alike = (steps > 0.0) & (rest[1:] == rest[:-1])
            slope = np.where(alike, np.diff(torque) / np.where(alike, steps, 1.0), 0.0)
            sides = np.maximum(np.convolve(alike, [1, 1]), 1)
            volts = ohms * torque + one.motor["inductance"] * np.convolve(slope, [1, 1]) / sides
            return max(abs(constant * spinning + times * volts / constant).max() for times in (1.0, more))

        starts = more * one.resistance(warm) * np.where(rest, starting, 0.0).max() / constant
        volts = voltage(drawn, constant, one.resistance(warm)), voltage(drawn, one.constant(AIR), one.resistance(AIR))
        row["motor voltage"] = max(*volts, starts) * FACTORS["voltage"], VOLTS * MODULATION
        cold = one.torque(load, rotor[:, k], speed, COLD)
        stiff = np.where(rest, np.maximum(abs(cold), starting), abs(cold)).max()
        row["cold start torque"] = stiff * more, short
        row["cold start current"] = stiff / one.constant(COLD) * more, strongest
        blocked = more * one.resistance(COLD) * stiff / one.constant(COLD)
        volts = max(voltage(cold, one.constant(COLD), one.resistance(COLD)), blocked)
        row["cold start voltage"] = volts * FACTORS["voltage"], VOLTS * MODULATION
        taken = (constant * spinning + one.resistance(warm) * current) * current + coil
        power += taken + 2.0 * SWITCH * current**2 + STANDBY
        free = load / one.ratio + rotor[:, k]
        least += np.minimum(taken, free * spinning + one.resistance(COLD) / one.constant(COLD) ** 2 * free**2)
        table[name] = row
    empty, bus = 0.5 * CAPACITY * VOLTS**2, 0.5 * CAPACITY * VOLTS**2
    highest, burns = bus, 0.5 * CAPACITY * THRESHOLD**2
    for step, now in zip(steps, 0.5 * (least[1:] + least[:-1]), strict=True):
        bus = max(bus - now * step, empty)
        bus -= min(max(bus - burns, 0.0), THRESHOLD**2 / RESISTOR * step)
        highest = max(highest, bus)
    table["supply"] = {
        "supply peak power": (power.max(), 2500.0), "supply mean power": (weight @ np.maximum(power, 0.0), 300.0),
        "supply regenerated power": (weight @ np.maximum(-power, 0.0), 40.0),
        "supply peak braking power": (max(-least.min(), 0.0), None),
        "supply bus voltage": (math.sqrt(2.0 * highest / CAPACITY), 58.0),
    }  # fmt: skip
    return table


SILENT = {"motor peak current", "gear temperature"}
"""Of which these rows print no limit."""


def test_every_verdict_is_that_of_a_plain_evaluation(tmp_path):
    """To a thousandth: two meshes of a thermal step and the settled drag are all that differs."""
    path = tmp_path / "crane.urdf"
    path.write_text(f'<robot name="crane"><link name="base"/>{ARM}</robot>', encoding="utf-8")
    found, wanted = dt.evaluate(study(path)), worked_out(path)
    checks = {name: {one.name: one for one in joint.checks} for name, joint in found.joints.items()}
    checks["supply"] = {one.name: one for one in found.shared if one.name.startswith("supply")}
    wrong = []
    for place, row in wanted.items():
        asked = {name for name, one in checks[place].items() if one.required is not None and name not in SILENT}
        assert set(row) == asked, place
        for name, numbers in row.items():
            one = checks[place][name]
            for ours, theirs in zip(numbers, (one.required, one.available), strict=True):
                if not (ours is theirs or math.isclose(ours, theirs, rel_tol=1e-3, abs_tol=1e-9)):
                    wrong.append(f"{place} {name}: {ours} against {theirs}")
            if numbers[1] is not None and (numbers[0] > numbers[1]) == (one.verdict in (PASS, MARGINAL)):
                wrong.append(f"{place} {name}: {one.verdict}")
    assert not wrong, "\n".join(wrong)
