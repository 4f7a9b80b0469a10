"""The loops of every joint's servo, as a section of a page."""

from __future__ import annotations

import math

from drivetrain.drive.loops.loop_design import LoopDesign
from drivetrain.report.quantities import number
from drivetrain.report.run_charts import bode_charts
from drivetrain.report.sections import Section, SheetTable, captioned
from drivetrain.sizing.answers.loops import study_loops
from drivetrain.sizing.results import Evaluation

TURN = 2.0 * math.pi


def bode_section(evaluation: Evaluation, current_bandwidth: float) -> Section:
    """Loops as fast as current loop, samples and spring let them be, with the load at its heaviest.

    Args:
        current_bandwidth: Of the current loops [rad/s].
    """
    found = study_loops(evaluation, current_bandwidth=current_bandwidth)
    figures = [
        pair for one in found.joints
        for pair in captioned(bode_charts(one.joint, one.design), f"Open loops of {one.joint}.")
    ]  # fmt: skip
    lead = (
        "Gains from the drive, the gear's softest stiffness, and a load between its lightest and its heaviest over the "
        "cycle, which is drawn: the speed loop stays a factor of five below the current loop and of three below the "
        "anti-resonance, and slow enough that the closed loops settle with a modulus margin of 0.5."
    )
    headings = ("joint", "speed loop [Hz]", "position loop [Hz]", "phase margins [°]", "gain margins [dB]",
                "anti-resonance, resonance [Hz]", "limited by", "settles")  # fmt: skip
    rows = tuple(_row(one.joint, one.design, one.stable) for one in found.joints)
    tables = (SheetTable(headings, rows, "", (1, 2, 3, 4, 5)),) if rows else ()
    notes = tuple(f"{name}: {why}" for name, why in found.missing.items())
    return Section("Loops", "loops", lead=(lead,), figures=tuple(figures), tables=tables, notes=notes)


def _row(name: str, design: LoopDesign, settles: bool) -> tuple[str, ...]:
    def pair(first: float, second: float, scale: float = 1.0) -> str:
        return f"{number(first * scale)}, {number(second * scale)}"

    degrees = 180.0 / math.pi
    decibels = [20.0 * math.log10(margin) if math.isfinite(margin) else math.inf
                for margin in (design.speed_gain_margin, design.position_gain_margin)]  # fmt: skip
    return (
        name, number(design.speed_bandwidth / TURN), number(design.position_bandwidth / TURN),
        pair(design.speed_phase_margin, design.position_phase_margin, degrees), pair(*decibels),
        pair(design.anti_resonance, design.resonance, 1.0 / TURN), design.limited_by, "yes" if settles else "no",
    )  # fmt: skip
