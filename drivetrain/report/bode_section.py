"""The loops of every joint's servo, as a section of a page."""

from __future__ import annotations

import math

from drivetrain.drive.drive import drive_inertia
from drivetrain.drive.loop_design import LoopDesign, ServoAxis, ServoTiming, design_loops
from drivetrain.drive.motor import torque_constant
from drivetrain.report.figures_bode import figure_bode
from drivetrain.report.quantities import number
from drivetrain.report.sections import Section, SheetTable
from drivetrain.report.svg import house_style, svg_text
from drivetrain.sizing.results import Evaluation, JointResult

TURN = 2.0 * math.pi


def bode_section(evaluation: Evaluation, current_bandwidth: float) -> Section:
    """Loops as fast as current loop and spring let them be, with the load at its heaviest.

    Args:
        current_bandwidth: Of the current loops [rad/s].
    """
    figures, rows, notes = [], [], []
    timing = ServoTiming(current_bandwidth)
    for name, joint in evaluation.joints.items():
        axis = servo_axis(joint, evaluation.study.simulation.damping)
        if axis is None:
            notes.append(f"{name}: the inertia of load or rotor is unknown, so no loop can be laid out")
            continue
        design = design_loops(axis, timing)
        with house_style(f"bode-{name}"):
            figure = figure_bode(axis, timing, design, name.replace("_", " "), name=f"bode-{name}")
            figure.set_size_inches(7.6, 3.7)
            figures.append((svg_text(figure, f"open loops of {name}"), f"Open loops of {name}."))
        rows.append(_row(name, design))
    lead = (
        "Gains from the drive, the load at its heaviest over the cycle and the gear's softest stiffness: the speed "
        "loop stays a factor of five below the current loop and of three below the anti-resonance."
    )
    headings = ("joint", "speed loop [Hz]", "position loop [Hz]", "phase margins [°]", "gain margins [dB]",
                "anti-resonance, resonance [Hz]", "limited by", "settles")  # fmt: skip
    tables = (SheetTable(headings, tuple(rows), "", (1, 2, 3, 4, 5)),) if rows else ()
    return Section("Loops", "loops", lead=(lead,), figures=tuple(figures), tables=tables, notes=tuple(notes))


def servo_axis(joint: JointResult, damping: float) -> ServoAxis | None:
    """A joint as its servo sees it.

    Args:
        damping: Of the spring, as a share of the critical one [-].

    Returns:
        The axis at the largest inertia of the cycle; None where an inertia is unknown.
    """
    load, rotor = joint.series.load_inertia, joint.drive.motor.rotor_inertia
    if load is None or not rotor or not float(load.max()) > 0.0:
        return None
    constant = float(torque_constant(joint.drive.motor, joint.drive.motor.reference_temperature))
    stiffness, heaviest = joint.drive.gear.stiffness_1, float(load.max())
    along = 2.0 * damping * math.sqrt((stiffness or 0.0) * heaviest)
    return ServoAxis(constant, joint.drive.gear.ratio, drive_inertia(joint.drive), heaviest, stiffness, along)


def _row(name: str, design: LoopDesign) -> tuple[str, ...]:
    def pair(first: float, second: float, scale: float = 1.0) -> str:
        return f"{number(first * scale)}, {number(second * scale)}"

    degrees = 180.0 / math.pi
    decibels = [20.0 * math.log10(margin) if math.isfinite(margin) else math.inf
                for margin in (design.speed_gain_margin, design.position_gain_margin)]  # fmt: skip
    return (
        name, number(design.speed_bandwidth / TURN), number(design.position_bandwidth / TURN),
        pair(design.speed_phase_margin, design.position_phase_margin, degrees), pair(*decibels),
        pair(design.anti_resonance, design.resonance, 1.0 / TURN), design.limited_by, "yes" if design.stable else "no",
    )  # fmt: skip
