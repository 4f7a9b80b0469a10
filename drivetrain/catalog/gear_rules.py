"""Consistency rules for the values of one gear, and for the gears of one manufacturer."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from fractions import Fraction
from itertools import pairwise

from drivetrain.catalog.findings import LIMIT, Finding, Values, error, in_order, numbers, slip, warning
from drivetrain.catalog.table import Cell, Row
from drivetrain.drive.gear import DRAG_REFERENCE, DRAG_TEMPERATURES

TORQUES = ("continuous_torque", "average_torque_limit", "repeated_peak_torque", "momentary_torque")
ROUNDING = 1e-6  # equal printed torques may differ by this much after conversion
RATIO_ROUNDING = 0.025  # relative rounding of a ratio printed with two digits
FAMILY = 5  # smallest number of gears of one manufacturer that makes a deviating denominator suspicious
STAGE_RATIO = {  # usual ratio per stage, from 2616, 24, 229 and 118 catalogue rows
    "planetary": (2.0, 12.0),
    "koaxdrive": (4.0, 40.0),
    "spur": (1.1, 12.0),
    "strain_wave": (25.0, 400.0),
}
STAGE_EFFICIENCY = (0.65, 0.99)
LOSSES = ("mesh_efficiency", "drag_torque", "seal_drag_torque", "starting_torque")
# Printed back-driving torque over ratio times starting torque, and its relative scatter, from six gear units.
BACK_DRIVING = (1.05, 0.30)
STATIC_RATING = (0.3, 5.0)  # usual C0/C of the output bearing; 33 crossed roller bearings have 1.3 to 1.9
SIZE_STEP = 2.54e-3  # [m] pitch diameter per size number of a strain-wave gear, which is size/10 inch
PITCH_LIMIT = 0.05
_ORDERS = (
    (warning, "average_input_speed_limit", "max_input_speed", ""),
    (warning, "rated_speed", "max_input_speed", ""),
    (error, "stiffness_1", "stiffness_2", "is larger than stiffness_2: a gear stiffens with torque"),
    (error, "stiffness_2", "stiffness_3", "is larger than stiffness_3: a gear stiffens with torque"),
    (error, "torque_1", "torque_2", "is larger than torque_2: a gear stiffens with torque"),
    (warning, "backdriving_efficiency", "efficiency", "is larger than the efficiency when the motor drives"),
)


def check_gear(cells: Mapping[str, Cell]) -> list[Finding]:
    """All inconsistencies in the row of one gear."""
    values = numbers(cells)
    rules = (_losses, _torque_order, _rare_torques, _torques_present, _no_load, _pitch, _bearing)
    findings = [*in_order(values, *_ORDERS), *(finding for rule in rules for finding in rule(values))]
    kind = cells.get("kind")
    if any(name in values for name in LOSSES) and not cells.get("loss_basis"):
        findings.append(error("loss_basis", "is empty: say where mesh efficiency, drag and starting torque come from"))
    return [*findings, *_inverted(values), *_stages(values, str(kind)), *_ratio_fraction(cells)]


def _inverted(values: Values) -> Iterator[Finding]:
    ratio = values.get("ratio", 1.0)
    if 0.0 < abs(ratio) < 1.0:
        problem = f"a ratio of {ratio:.4g} makes the output faster than the motor"
        yield warning("ratio", f"{problem}; was {1.0 / ratio:.4g} meant: motor over output speed?")


def _torque_order(values: Values) -> Iterator[Finding]:
    present = [name for name in TORQUES if name in values]
    for smaller, larger in pairwise(present):
        if values[smaller] > values[larger] * (1.0 + ROUNDING):
            words = f"is larger than the {larger.replace('_', ' ')}"
            hint = slip(values[smaller] / values[larger])
            yield error(smaller, words + (f"; {hint}" if hint else ""))


def _rare_torques(values: Values) -> Iterator[Finding]:
    peak = values.get("momentary_torque")
    for name in ("ratcheting_torque", "buckling_torque"):
        if name in values and peak is not None and values[name] < peak:
            yield error(name, "is smaller than the momentary torque")


def _torques_present(values: Values) -> Iterator[Finding]:
    present = [name for name in TORQUES if name in values]
    if not present:
        yield error("continuous_torque", "no torque limit is given, so nothing can be checked")
    elif present == ["continuous_torque"]:
        yield warning("repeated_peak_torque", "is empty: the peaks cannot be checked")
    elif "continuous_torque" not in present and len(present) == 1:
        yield error("continuous_torque", f"is empty, and only the {present[0].replace('_', ' ')} is given")
    elif "continuous_torque" not in present:
        yield warning("continuous_torque", "is empty: the average torque cannot be checked")


def _no_load(values: Values) -> Iterator[Finding]:
    if all(name in values for name in ("no_load_torque", "ratio", "continuous_torque")):
        if values["no_load_torque"] * abs(values["ratio"]) > values["continuous_torque"]:
            yield error("no_load_torque", "times the ratio is larger than the continuous torque: it is at the input")


def _losses(values: Values) -> Iterator[Finding]:
    """Consistency of drag and mesh losses with each other and with the printed total."""
    if ("mesh_efficiency" in values) != ("drag_torque" in values):
        missing = "drag_torque" if "mesh_efficiency" in values else "mesh_efficiency"
        yield error(missing, "is empty: a mesh without its drag, or a drag without its mesh, is half the loss")
    for name in ("drag_speed_exponent", "drag_temperature_1", "drag_temperature_2"):
        if "drag_torque" in values and name not in values:
            yield error(name, "is empty: write 0 where the drag does not change with it")
    if values.get("drag_speed_exponent") and "drag_speed" not in values:
        yield error("drag_speed", "is empty, and the drag grows with speed")
    if values.get("mesh_efficiency", 1.0) < values.get("efficiency", 0.0):
        yield error("mesh_efficiency", "is smaller than the efficiency, which counts the drag too")
    slope = values.get("drag_temperature_1", 0.0), values.get("drag_temperature_2", 0.0)
    if any(slope[0] < 2.0 * slope[1] * (end - DRAG_REFERENCE) for end in DRAG_TEMPERATURES):
        yield warning("drag_temperature_1", "lets the drag grow with temperature: grease thins when it is warm")
    if "ratio" not in values:
        return
    for name in ("drag_torque", "starting_torque"):
        if values.get(name, 0.0) * abs(values["ratio"]) > values.get("continuous_torque", float("inf")):
            yield error(name, "times the ratio is larger than the continuous torque: it is at the input")
    if values.get("starting_torque") and "back_driving_torque" in values:
        predicted = BACK_DRIVING[0] * abs(values["ratio"]) * values["starting_torque"]
        if abs(values["back_driving_torque"] / predicted - 1.0) > BACK_DRIVING[1]:
            yield warning("back_driving_torque", "is far from 1.05 times ratio and starting torque", predicted)


def _pitch(values: Values) -> Iterator[Finding]:
    if "size" in values and "pitch_diameter" in values:
        predicted = values["size"] * SIZE_STEP
        difference = values["pitch_diameter"] / predicted - 1.0
        if abs(difference) > PITCH_LIMIT:
            yield warning("pitch_diameter", f"differs by {100.0 * difference:+.1f} % from size/10 inch", predicted)


def _bearing(values: Values) -> Iterator[Finding]:
    """The limits of the output bearing against its ratings: each load alone must stay below the static rating."""
    static, dynamic = values.get("bearing_static_rating"), values.get("bearing_dynamic_rating")
    if static is not None and dynamic is not None and not STATIC_RATING[0] <= static / dynamic <= STATIC_RATING[1]:
        span = f"{STATIC_RATING[0]:g} to {STATIC_RATING[1]:g}"
        yield warning("bearing_static_rating", f"is {static / dynamic:.2g} of the dynamic rating; usual: {span}")
    if dynamic is not None and "bearing_pitch_diameter" not in values:
        yield warning("bearing_pitch_diameter", "is empty: without it a tilting moment makes no load of the bearing")
    if static is None:
        return
    arm = 0.5 * values.get("bearing_pitch_diameter", 0.0)
    largest = {"tilting_moment_limit": static * arm, "axial_load_limit": static / 0.44, "radial_load_limit": static}
    for name, most in largest.items():
        if most and values.get(name, 0.0) > most:
            yield error(name, "by itself exceeds the static rating of the bearing", most)


def _stages(values: Values, kind: str) -> Iterator[Finding]:
    """Ratio and efficiency per stage, if all stages were equal, against the usual ranges."""
    stages = values.get("stages")
    if not stages:
        return
    low, high = STAGE_RATIO.get(kind, (0.0, float("inf")))
    if "ratio" in values:
        each = abs(values["ratio"]) ** (1.0 / stages)
        if not low <= each <= high:
            yield warning("ratio", f"makes {each:.3g} a stage; usual: {low:g} to {high:g}")
    if "efficiency" in values and kind != "strain_wave":
        share = values["efficiency"] ** (1.0 / stages)
        if not STAGE_EFFICIENCY[0] <= share <= STAGE_EFFICIENCY[1]:
            usual = f"{STAGE_EFFICIENCY[0]} to {STAGE_EFFICIENCY[1]}"
            yield warning("efficiency", f"makes {share:.2f} a stage; usual: {usual}")


def _ratio_fraction(cells: Mapping[str, Cell]) -> Iterator[Finding]:
    text, ratio = cells.get("ratio_exact"), cells.get("ratio")
    if not isinstance(text, str):
        return
    exact = exact_ratio(text)
    if exact is None:
        yield error("ratio_exact", "must be a fraction such as 57/13 or a whole number")
    elif isinstance(ratio, float):
        predicted = float(exact) if ratio > 0.0 else -float(exact)
        difference = ratio / predicted - 1.0
        words = f"differs by {100.0 * difference:+.1f} % from the fraction {text}"
        if abs(difference) > LIMIT:
            yield error("ratio", words, predicted)
        elif abs(difference) > RATIO_ROUNDING and abs(ratio - predicted) > 0.5:
            yield warning("ratio", words, predicted)


def exact_ratio(text: str) -> Fraction | None:
    """The fraction in a text such as ``57/13``; None if it is not a fraction."""
    try:
        value = Fraction(text.replace(" ", ""))
    except (ValueError, ZeroDivisionError):
        return None
    return value if value > 0 else None


def check_families(rows: Iterable[Row]) -> list[tuple[Row, Finding]]:
    """Probably misprinted exact ratios.

    Manufacturers combine few different stages, so gears with the same numerator have the same denominator.
    """
    families: dict[tuple[str, float | None, str], list[tuple[Row, str]]] = defaultdict(list)
    for row in rows:
        numerator, slash, denominator = row.text("ratio_exact").replace(" ", "").partition("/")
        if slash and exact_ratio(f"{numerator}/{denominator}") is not None:
            families[row.text("maker"), row.number("stages"), numerator].append((row, denominator))
    return [found for (*_, top), members in families.items() for found in _deviating_members(top, members)]


def _deviating_members(numerator: str, members: list[tuple[Row, str]]) -> Iterator[tuple[Row, Finding]]:
    """Findings for gears whose denominator is unique while at least ``FAMILY`` others share another one."""
    counts = Counter(denominator for _, denominator in members)
    usual, most = counts.most_common(1)[0]
    for row, denominator in members:
        predicted = float(Fraction(int(numerator), int(usual)))
        difference = float(Fraction(int(numerator), int(denominator))) / predicted - 1.0
        if counts[denominator] > 1 or most < FAMILY or abs(difference) <= LIMIT:
            continue
        words = f"{most} gears of this maker print {numerator}/{usual}, which is {predicted:.6g}: misprint?"
        finding = error if _one_digit_apart(denominator, usual) else warning
        yield row, finding("ratio_exact", words)


def _one_digit_apart(one: str, other: str) -> bool:
    """Whether two numbers of the same length differ in exactly one digit."""
    return len(one) == len(other) and sum(a != b for a, b in zip(one, other, strict=True)) == 1
