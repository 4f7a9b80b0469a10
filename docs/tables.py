"""The pages that are printed from the code: ``python docs/tables.py`` writes them anew."""

from __future__ import annotations

from dataclasses import MISSING, Field, fields
from pathlib import Path
from typing import Any

import drivetrain as dt
from drivetrain.effects.effect import Effect
from drivetrain.sizing.judge.checks import ARM, GEAR, HEAT, REQUIREMENTS, SPEED, STOP, SUPPLY, TORQUE, Requirement

HERE = Path(__file__).parent
HEADINGS = {
    GEAR: "Of the gear",
    SPEED: "Of motor, brake and amplifier, without a torque",
    TORQUE: "Of the motor's torque",
    HEAT: "Of current, voltage and heat",
    SUPPLY: "Of the supply, all joints together",
    ARM: "Of the arm on its gears, where the study wishes it",
    STOP: "Of the whole arm in a stop",
}

CHECKS = """# What each check computes

`python docs/tables.py` prints this page from the table of checks (`drivetrain/sizing/judge/checks.py`), from which
verdicts, search, tolerances and reports come too. A check passes where what is required, times its factor of the
study's `safety` section, stays within the limit; `drivetrain explain` prints one with its numbers, its instant and
the row that the limit is from. How far the laws hold, and where they are from, is in
[What is counted, and how](physics.md).

**e**, essential: where it cannot be made the verdict is NOT CHECKED, and the drive is never chosen. **w**: made
only where the study asks for it.
"""

EFFECTS = """# Effects of a simulation

`python docs/tables.py` prints this page from the classes in `drivetrain/effects/`. A scene has what its study calls
for; any other is added by name (`simulation: {add: [{effect: Cogging, joint: elbow, amplitudes: [5 mN m], orders:
[84]}]}`) or in Python (`dt.effects.Cogging(...)`, units SI). Which engine solves them is in
[What happens when it runs](simulation.md); one of your own takes one file: [step by step](add_one.md).

| effect | what it is | numbers that it takes |
|---|---|---|
"""


def checks_page() -> str:
    """Every check, by what it is of."""
    parts = [CHECKS]
    for stage, heading in HEADINGS.items():
        rows = [_check(one) for one in REQUIREMENTS if one.stage == stage]
        head = f"\n## {heading}\n\n| check | required | limit | factor | |\n|---|---|---|---|---|\n"
        parts.append(head + "".join(rows))
    return "".join(parts)


def _check(one: Requirement) -> str:
    factor = "" if one.factor == "one" else f"`{one.factor.partition('.')[2]}`"
    marks = ", ".join(mark for mark, holds in (("e", one.essential), ("w", one.optional)) if holds)
    formula = one.formula.replace("|", "\\|")
    unit = {"C": "°C", "1": "-"}.get(one.unit, one.unit)
    return f"| {one.name} [{unit}] | {formula} | {one.sheet} | {factor} | {marks} |\n"


def effects_page() -> str:
    """Every effect, in the order of its name."""
    found = [getattr(dt.effects, name) for name in dir(dt.effects)]
    known = [one for one in found if isinstance(one, type) and issubclass(one, Effect) and one is not Effect]
    return EFFECTS + "".join(
        f"| `{one.__name__}` | {_first_sentence(one)} | {', '.join(map(_field, fields(one)))} |\n" for one in known
    )


def _first_sentence(kind: type[Effect]) -> str:
    return (kind.__doc__ or "").partition("\n\n")[0].strip().replace("|", "\\|")


def _field(field: Field[Any]) -> str:
    """Its name, and what it is where nothing is said."""
    given = "none" if field.default in ((), None) else field.default
    return f"`{field.name}`" if field.default is MISSING else f"`{field.name}` ({given})"


def main() -> None:
    """Write both."""
    for name, text in (("checks.md", checks_page()), ("effects.md", effects_page())):
        (HERE / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
