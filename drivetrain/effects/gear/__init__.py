"""Effects of the gear: drag, mesh loss, backlash and torsional spring."""
