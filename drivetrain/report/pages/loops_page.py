"""The loops of a study's joints: gains for an amplifier, margins, pictures; in words, as a page and as JSON."""

from __future__ import annotations

import math
from typing import Any

from drivetrain.drive.amplifier import from_dc
from drivetrain.drive.loops.loop_design import MODULUS_MARGIN, LoopDesign, Margins
from drivetrain.report.charts.chart import captioned
from drivetrain.report.charts.run_charts import bode_charts, step_chart
from drivetrain.report.json_text import job_data, json_text, picked
from drivetrain.report.pages.sheet import Section, SheetTable, sheet
from drivetrain.report.pages.views import anchor
from drivetrain.report.quantities import DASH, number
from drivetrain.sizing.answers.loops import JointLoops, StudyLoops, study_loops
from drivetrain.sizing.results import Evaluation
from drivetrain.study.model import Study

TURN = 2.0 * math.pi
PER_RPM = TURN / 60.0  # rad/s
CASCADE = ("position_gain", "speed_gain", "integral_time")  # gains of a design
JUDGED = ("stable", "speed_bandwidth", "speed_reach", "position_reach", "modulus_margin", "critical_frequency",
          "damping", "anti_resonance", "resonance")  # fmt: skip


def loops_report(study: Study, found: StudyLoops) -> str:
    sections = [_section(one) for one in found.joints]
    sections += [
        Section(name, anchor(name), "not designed", "unchecked", (f"Not designed: {why}.",))
        for name, why in found.missing.items()
    ]
    return sheet(study, "Control loops", sections)


def loops_sentence(one: JointLoops) -> str:
    design = one.design
    if not one.stable:
        return f"no gains settle: {_limited(one)}"
    return (
        f"speed loop {number(design.speed_bandwidth / TURN)} Hz ({number(design.speed_gain)} A s/rad, "
        f"{number(1e3 * design.integral_time)} ms), position loop {number(design.position_gain)} 1/s; "
        f"limited by {_limited(one)}"
    )


def loops_json(study: Study, found: StudyLoops) -> str:
    joints, stable = {one.joint: _data(one) for one in found.joints}, all(one.stable for one in found.joints)
    return json_text(
        job_data(study, "loops", stable=stable and not found.missing, joints=joints, missing=found.missing)
    )


def _limited(one: JointLoops) -> str:
    """Text on what limits the loops, and on a notch filter that would help."""
    design, faster = one.design, one.design.with_notch
    text = design.limited_by
    if design.critical_frequency > 3.0 * design.speed_bandwidth:
        text += f" (nearest to -1 at {number(design.critical_frequency / TURN)} Hz)"
    near = min(design.modulus_margin, one.light.modulus_margin)
    if one.stable and near < MODULUS_MARGIN:
        text += f", with a modulus margin of only {number(near)}, below {number(MODULUS_MARGIN)}"
    if faster is not None and faster.notch is not None:
        at, bandwidth = faster.notch.frequency / TURN, faster.speed_bandwidth / TURN
        text += f"; with a notch at {number(at)} Hz the speed loop reaches {number(bandwidth)} Hz"
    return text


def _section(one: JointLoops) -> Section:
    name, title = anchor(one.joint), one.joint
    gain, phase = bode_charts(one.joint, one.design, None if one.light is one.design else one.light)
    word, css = ("settles", "pass") if one.stable else ("does not settle", "fail")
    lead = f"Limited by {_limited(one)}." if one.stable else f"No gains settle: {_limited(one)}."
    bode = "Open speed loop and open position loop, drawn with the heaviest load of the cycle; dots are crossovers."
    step = "Motor's angle after a step of its command, without speed feedforward and below the current limit."
    figures = ((gain, ""), (phase, bode), (step_chart(one), step))
    tables: tuple[SheetTable, ...] = (_gains(one, one.design, "Gains"),)
    faster = one.design.with_notch
    if faster is not None and faster.notch is not None:
        notch = (
            f"{number(faster.notch.frequency / TURN)} Hz, damping {faster.notch.zeros:g} over {faster.notch.poles:g}"
        )
        tables += (_gains(one, faster, f"Gains with a notch at {notch}: simulated by SampledCascade's notch"),)
    tables += (_margins(one), _poles(one), _plant(one))
    return Section(title, name, word, css, (lead,), figures, tables, _notes(one))


def _notes(one: JointLoops) -> tuple[str, ...]:
    timing = one.timing
    late = f"{timing.delay} sample{'' if timing.delay == 1 else 's'} later"
    servo = (
        "continuous loops, since the study states no control for this joint: samples and delay make them slower "
        "(simulation: {control: {" + one.joint + ": {rate: 1 kHz, delay: 1}}})"
        if timing.period == 0.0
        else f"loops sampled at {number(1e-3 / timing.period)} kHz, output {late} and held"
    )
    cascade = one.design
    gains = (
        f"position_gain: {cascade.position_gain:.4g} 1/s, speed_gain: {cascade.speed_gain:.4g} A s/rad, "
        f"integral_time: {1e3 * cascade.integral_time:.4g} ms"
    )
    return (
        servo,
        f"to simulate with these gains: `simulation: {{control: {{{one.joint}: {{{gains}}}}}}}`",
        "amperes are those of the equivalent DC machine, with brushes those of the motor; without brushes divide by "
        "1.225 for amperes rms of a phase, by 0.866 for their amplitude",
        "the current loop counts as a lag of its bandwidth; resistance and inductance are those between two terminals",
    )


def _gains(one: JointLoops, design: LoopDesign, title: str) -> SheetTable:
    constant = one.axis.torque_constant
    rms = float(from_dc(design.speed_gain, "rms"))
    rows = [
        ("position loop, gain", _of(design.position_gain, "1/s"), _of(0.06 * design.position_gain, "(m/min)/mm")),
        ("speed loop, gain", _of(design.speed_gain, "A s/rad"), _of(1e3 * design.speed_gain * PER_RPM, "mA/rpm")),
        ("speed loop, gain in amperes rms (brushless)", _of(rms, "A s/rad"), _of(1e3 * rms * PER_RPM, "mA/rpm")),
        ("speed loop, gain as torque", _of(design.speed_gain * constant, "N m s/rad"),
         _of(1e3 * design.speed_gain * constant * PER_RPM, "mN m/rpm")),
        ("speed loop, integral time", _of(design.integral_time, "s"), _of(1e3 * design.integral_time, "ms")),
        ("speed loop, integral gain", _of(design.speed_gain / design.integral_time, "A/rad"),
         _of(design.speed_gain / design.integral_time * math.pi / 180.0, "A/°")),
        ("current loop, bandwidth", _of(one.timing.current_bandwidth, "rad/s"),
         _of(one.timing.current_bandwidth / TURN, "Hz")),
        ("current loop, gain", _of(one.current_gain, "V/A"), _of(one.current_gain, "V/A")),
        ("current loop, integral gain", _of(one.current_integral, "V/(A s)"),
         _of(None if one.current_integral is None else 1e-3 * one.current_integral, "V/(A ms)")),
    ]  # fmt: skip
    return SheetTable(("gain", "SI", "in units of amplifiers"), tuple(rows), title, (1, 2))


def _margins(one: JointLoops) -> SheetTable:
    rows = []
    for load, design in (("heaviest", one.design), ("lightest", one.light)):
        for loop, margins, reach in (
            ("speed", design.speed_margins, design.speed_reach),
            ("position", design.position_margins, design.position_reach),
        ):
            rows.append((f"{loop} loop, {load} load", _phases(margins), _factors(margins), _of(reach / TURN, "Hz")))
        rows.append((
            f"both, {load} load", f"modulus margin {number(design.modulus_margin)}",
            f"least damping of a closed pole {number(design.damping)}",
            "settles" if design.damping > 0.0 else "does not settle",
        ))  # fmt: skip
    headings = (
        "loop",
        "phase margin at each crossing of 0 dB",
        "gain margin at each crossing of −180°",
        "−3 dB, closed",
    )
    return SheetTable(headings, tuple(rows), "Margins, with the samples, hold and delay of the simulation", (3,))


def _poles(one: JointLoops) -> SheetTable:
    """Poles of the closed cascade, slowest first, without those that decay within a sample period."""
    rows = []
    for load, design in (("heaviest", one.design), ("lightest", one.light)):
        upper = [pole for pole in design.poles if pole.imag >= 0.0 and pole]
        for pole in sorted((p for p in upper if p.real * one.timing.period > -math.pi), key=abs):
            natural = abs(pole)
            fades = _of(-1e3 / pole.real, "ms") if pole.real < 0.0 else "grows"
            rows.append((load, _of(natural / TURN, "Hz"), number(-pole.real / natural), fades))
    headings = ("load", "natural frequency", "damping", "time constant")
    return SheetTable(headings, tuple(rows), "Closed-loop poles", (1, 2, 3))


def _phases(margins: Margins) -> str:
    parts = [f"{number(math.degrees(lag))}° at {number(at / TURN)} Hz" for at, lag in margins.phase]
    return ", ".join(parts) or "no crossing"


def _factors(margins: Margins) -> str:
    parts = [
        f"{number(20.0 * math.log10(factor))} dB at {number(at / TURN)} Hz"
        for at, factor in margins.gain
        if 0.0 < factor < 1e3  # larger gain margins than 60 dB are not listed
    ]
    return ", ".join(parts) or "no crossing"


def _plant(one: JointLoops) -> SheetTable:
    axis, heavy, light = one.axis, one.design, one.light
    square = axis.ratio**2
    stiff = axis.stiffness is not None
    rows = (
        ("load at the joint", _of(one.lightest, "kg m²"), _of(axis.load_inertia, "kg m²")),
        ("rotor and gear input, at the joint", *2 * (_of(square * axis.rotor_inertia, "kg m²"),)),
        ("smallest stiffness of the gear", *2 * (_of(axis.stiffness, "N m/rad"),)),
        ("damping of the gear", *2 * (_of(axis.spring_damping if stiff else None, "N m s/rad"),)),
        ("anti-resonance", *(_of(d.anti_resonance / TURN if stiff else None, "Hz") for d in (light, heavy))),
        ("resonance", *(_of(d.resonance / TURN if stiff else None, "Hz") for d in (light, heavy))),
        ("speed loop's crossover as designed", *(_of(d.speed_bandwidth / TURN, "Hz") for d in (light, heavy))),
        ("speed gain over that permitted by the sampling, rigid joint",
         *(number(d.sampled_share) if d.sampled_share else DASH for d in (light, heavy))),
        ("nearest to −1 at", *(_of(d.critical_frequency / TURN, "Hz") for d in (light, heavy))),
    )  # fmt: skip
    return SheetTable(("quantity", "lightest load", "heaviest load"), rows, "Plant", (1, 2))


def _of(value: float | None, unit: str) -> str:
    return DASH if value is None else f"{number(value)}\u00a0{unit}"


def _data(one: JointLoops) -> dict[str, Any]:
    axis, design = one.axis, one.design
    faster = design.with_notch
    return {
        "stable": one.stable,
        "limited_by": design.limited_by,
        "gains": picked(design, *CASCADE) | picked(one, "current_gain", "current_integral"),
        "timing": picked(one.timing, "current_bandwidth", "period", "delay"),
        "plant": {
            **picked(axis, "torque_constant", "ratio", "rotor_inertia"),
            "load_inertia": [one.lightest, axis.load_inertia], **picked(axis, "stiffness", "spring_damping"),
        },
        "with_notch": None if faster is None
        else {"notch": vars(faster.notch), "gains": picked(faster, *CASCADE), **_judged(faster)},
        "lightest_load": _judged(one.light),
        "heaviest_load": _judged(design),
    }  # fmt: skip


def _judged(design: LoopDesign) -> dict[str, Any]:
    return picked(design, *JUDGED) | {
        "speed_margins": {"gain": design.speed_margins.gain, "phase": design.speed_margins.phase},
        "position_margins": {"gain": design.position_margins.gain, "phase": design.position_margins.phase},
        "poles": [[pole.real, pole.imag] for pole in design.poles],
    }


def bode_section(evaluation: Evaluation, current_bandwidth: float) -> Section:
    """Section on loops as fast as current loop [rad/s], sampling and gear spring allow, at the heaviest load."""
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
    tables = (SheetTable(headings, rows, "", (1, 2, 3, 4, 5)),)
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
