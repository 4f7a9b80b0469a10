"""The fastest cycle in lines, and its motion as a file that a study reads."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from drivetrain.report.words import overall_sentence
from drivetrain.sizing.answers.fastest import Fastest
from drivetrain.study.model import Study


def fastest_lines(found: Fastest) -> Iterator[str]:
    """What the terminal shows."""
    if found.feasible:
        change = 100.0 * (found.duration / found.before - 1.0)
        yield f"fastest cycle: {found.duration:.4g} s instead of {found.before:.4g} s ({change:+.3g} %)"
    else:
        yield f"no pace holds, not even a cycle of {found.duration:.4g} s: {overall_sentence(found.evaluation)}"
    for move in found.moves:
        words = f"  {move.name}, from {move.start:.4g} s: {move.after:.4g} s instead of {move.before:.4g} s"
        if move.check:
            when = "over the whole cycle" if math.isnan(move.time) else f"t = {move.time:.4g} s"
            words += f"; limited by {move.check} at {move.place}, {when}"
        yield words


def motion_csv(study: Study) -> str:
    """Joint positions over the cycle, one row an instant."""
    cycle, arm = study.cycle, study.arm
    slides = [False] * len(cycle.joint_names) if arm is None else [not screw[:3].any() for screw in arm.screws]
    names = [f"{name} [{'m' if slide else 'rad'}]" for name, slide in zip(cycle.joint_names, slides, strict=True)]
    kept = np.append(np.diff(cycle.time) > 0.0, True)
    rows = np.column_stack([cycle.time, cycle.position])[kept]
    text = "\n".join(",".join(f"{value:.9g}" for value in row) for row in rows)
    return f"{','.join(['time [s]', *names])}\n{text}\n"
