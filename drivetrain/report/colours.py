"""The colours of all pictures."""

from __future__ import annotations

INK = "#1f2a37"
MUTED = "#64748b"
FAINT = "#dfe5ec"
# Okabe and Ito's palette, told apart by every common kind of colour blindness.
BLUE, ORANGE, GREEN, VERMILLION, PURPLE, SKY = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#CC79A7", "#56B4E9"
JOINT_COLOURS = (BLUE, ORANGE, GREEN, PURPLE, VERMILLION, SKY, "#7f6a3f", "#444444")
# Instants from first to last: viridis without its yellow end, which is lost on white paper.
INSTANTS = (
    "#440154", "#471063", "#481d6f", "#472a7a", "#453781", "#414287", "#3d4e8a", "#38598c", "#33638d", "#2e6d8e",
    "#2a768e", "#27808e", "#23898e", "#20928c", "#1e9c89", "#21a585", "#28ae80", "#35b779", "#46c06f", "#5ac864",
    "#70cf57", "#89d548", "#a2da37", "#bddf26",
)  # fmt: skip
