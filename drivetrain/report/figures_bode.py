"""One joint's loops: open over frequency with crossovers, margins and the spring's two; closed over time."""

from __future__ import annotations

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from drivetrain.arrays import Array
from drivetrain.drive.loop_design import LoopDesign
from drivetrain.report.colours import BLUE, FAINT, GREEN, MUTED, ORANGE
from drivetrain.report.quantities import number
from drivetrain.report.svg import house_style
from drivetrain.sizing.answers.loops import JointLoops

TURN = 2.0 * math.pi
LOWEST, HIGHEST = -60.0, 60.0  # dB drawn


def figure_bode(
    design: LoopDesign, title: str, *, light: LoopDesign | None = None, name: str = "bode"
) -> Figure:  # fmt: skip
    """Gain and phase of the open speed loop and the open position loop, dashed what they are with the lightest load."""
    shown = (design.frequencies > 0.02 * design.position_bandwidth) & (design.frequencies < _top(design))
    at = design.frequencies[shown]
    with house_style(name):
        figure = Figure(figsize=(7.6, 5.6))
        gain, phase = figure.subplots(2, 1, sharex=True)
        loops = (design.speed_loop[shown], design.position_loop[shown])
        for response, text, colour in zip(loops, _texts(design), (BLUE, ORANGE), strict=True):
            _loop(gain, phase, at, response, text, colour)
        if light is not None:
            own = (light.frequencies > at[0]) & (light.frequencies < at[-1])
            for response, colour in ((light.speed_loop[own], BLUE), (light.position_loop[own], ORANGE)):
                gain.plot(
                    light.frequencies[own] / TURN, _decibels(response), color=colour, linewidth=0.8, linestyle="--"
                )
            gain.plot([], [], color=MUTED, linewidth=0.8, linestyle="--", label="with the lightest load")
        gain.axhline(0.0, color=MUTED, linewidth=0.9)
        phase.axhline(-180.0, color=MUTED, linewidth=0.9)
        for value, text in ((design.anti_resonance, "anti-resonance"), (design.resonance, "resonance")):
            if value < at[-1]:
                for axes in (gain, phase):
                    axes.axvline(value / TURN, color=MUTED, linewidth=0.9, linestyle=(0, (1, 1.5)))
                gain.annotate(
                    f"{text} {number(value / TURN)} Hz", (value / TURN, HIGHEST), (3, -3), textcoords="offset points",
                    rotation=90, ha="left", va="top", fontsize=7, color=MUTED,
                    bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.5},
                )  # fmt: skip
        gain.set_xscale("log")
        gain.set_xlim(at[0] / TURN, at[-1] / TURN)
        gain.set_ylim(LOWEST, HIGHEST)
        phase.set_ylim(-270.0, 90.0)
        phase.set_yticks([-270, -180, -90, 0, 90])
        gain.set_ylabel("gain [dB]")
        phase.set_ylabel("phase [°]")
        phase.set_xlabel("frequency [Hz]")
        for axes in (gain, phase):
            axes.grid(True, color=FAINT)
        gain.legend(loc="lower left", fontsize=7.5)
        figure.suptitle(title, fontsize=9.5)
        figure.set_layout_engine("constrained")
    return figure


def figure_steps(loops: JointLoops, *, name: str = "steps") -> Figure:
    """The motor's angle after a step of its command, with the heaviest and the lightest load."""
    with house_style(name):
        figure = Figure(figsize=(7.6, 2.6))
        axes = figure.subplots()
        axes.axhline(1.0, color=MUTED, linewidth=0.9)
        curves = [(loops.step, "heaviest load", ORANGE, "-")]
        if loops.light is not loops.design:
            curves.append((loops.light_step, "lightest load", ORANGE, "--"))
        if loops.notch_step is not None:
            curves.append((loops.notch_step, "heaviest load, gains with a notch", GREEN, "-"))
        where = "steps-post" if loops.timing.period > 0.0 else "default"
        for values, text, colour, style in curves:
            axes.plot(loops.time, values, color=colour, linestyle=style, label=text, drawstyle=where)
        axes.set_xlabel("time [s]")
        axes.set_ylabel("angle of the motor\nover the step [-]")
        axes.set_xlim(0.0, loops.time[-1])
        lowest, highest = (float(end([end(values) for values, *_ in curves])) for end in (np.min, np.max))
        axes.set_ylim(max(-1.0, min(-0.05, 1.1 * lowest)), min(3.0, max(1.2, 1.1 * highest)))
        axes.legend(loc="lower right")
    return figure


def _top(design: LoopDesign) -> float:
    """Highest frequency that is worth drawing [rad/s]."""
    resonance = design.resonance if math.isfinite(design.resonance) else 0.0
    return max(10.0 * design.speed_bandwidth, 3.0 * resonance, 2.0 * design.critical_frequency)


def _texts(design: LoopDesign) -> tuple[str, str]:
    """What the two lines are, with their margins."""

    def told(loop: str, phase: float, gain: float) -> str:
        decibels = f"{20.0 * math.log10(gain):.1f} dB" if math.isfinite(gain) else "without limit"
        return f"{loop} loop: phase margin {math.degrees(phase):.0f}°, gain margin {decibels}"

    return (
        told("speed", design.speed_phase_margin, design.speed_gain_margin),
        told("position", design.position_phase_margin, design.position_gain_margin),
    )


def _decibels(response: Array) -> Array:
    return np.asarray(20.0 * np.log10(np.maximum(np.abs(response), 1e-12)))


def _loop(gain: Axes, phase: Axes, at: Array, response: Array, text: str, colour: str) -> None:
    """One loop in both halves, its crossover marked."""
    decibels = _decibels(response)
    turned = np.degrees(np.unwrap(np.angle(response)))
    turned += 360.0 * np.round((-90.0 - turned[0]) / 360.0)
    gain.plot(at / TURN, decibels, color=colour, label=text)
    phase.plot(at / TURN, turned, color=colour)
    crossings = np.flatnonzero(np.diff(np.signbit(decibels)))
    for index in crossings:
        gain.plot(at[index] / TURN, 0.0, "o", color=colour, markersize=4)
        phase.plot(at[index] / TURN, turned[index], "o", color=colour, markersize=4)
