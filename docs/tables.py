"""The pages that are printed from the code: ``python docs/tables.py`` writes them anew."""

from __future__ import annotations

import sys
from dataclasses import MISSING, Field, fields
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))  # the code beside these pages, not an installed package

import drivetrain as dt  # noqa: E402
from drivetrain.catalog.schema import CHOICE, NUMBER, TABLES, Column  # noqa: E402
from drivetrain.effects.effect import Effect  # noqa: E402
from drivetrain.sizing.judge.checks import (  # noqa: E402
    ARM,
    GEAR,
    HEAT,
    REQUIREMENTS,
    SPEED,
    STOP,
    SUPPLY,
    TORQUE,
    Requirement,
)

HEADINGS = {
    GEAR: "Gear and output bearing",
    SPEED: "Speed, stages behind the gear, brake, inertia, amplifier",
    TORQUE: "Motor torque",
    HEAT: "Current, voltage, temperature",
    SUPPLY: "Supply, all joints together",
    ARM: "Stiffness of the arm",
    STOP: "Stop of the whole arm",
}

CHECKS = """# What each check computes

This page lists every check: what it requires, the limit, and the safety factor. A check is satisfied if the required
value, multiplied by its factor from the study's `safety` section, does not exceed the limit. `drivetrain explain`
prints a check with its numbers, its instant, and the catalogue row of the limit. The sources of the laws and their
range of validity are in [Physics](physics.md).

The last column contains:

- **essential**: if the check cannot be made, the verdict is NOT CHECKED and the drive is never chosen.
- **on request**: the check is made only if the study asks for it.

The symbols are explained [at the end](#symbols). `python docs/tables.py` generates this page from the table of checks
(`drivetrain/sizing/judge/checks.py`), which verdicts, search, tolerances and reports use as well.
"""

SYMBOLS = """
## Symbols

| symbol | meaning |
|---|---|
| T, w, I | torque, speed and load inertia at the gear's output |
| b | load torque without the part I w' |
| a, a_carrier | acceleration of the joint, and of the rotor's carrier about the rotor's axis |
| G, J | gear ratio; inertia at the gear's input |
| f | 1/efficiency if the motor drives the load, backward efficiency if the load drives the motor |
| n, n_rated, T_rated, L_rated, e | input speed, rated input speed, rated torque, rated life, exponent of the life |
| phi(T), U(T) | wind-up of the gear under the torque T, and its elastic energy |
| i, kt, R, L | current, torque constant, resistance and inductance of the winding |
| kt(magnets), kt(cold) | torque constant at the temperature of the magnets; at that of a cold start |
| t | duration of an interval of the cycle in sums; duration of the ramp in a stop on a ramp |
| N | permitted number of waves of the flexspline under momentary peaks |
| I_p, I_c, t_p | peak current, continuous current and time at peak current of the amplifier |
| Fr, Fa, M, dp | radial force, axial force and tilting moment on the output bearing; its pitch diameter |
| C, C0, fw | dynamic rating, static rating, load factor of the output bearing |
| P, P0 | in checks of the output bearing: its dynamic and static equivalent load |
| V, E, C | in checks of the supply: voltage, energy and capacitance of the bus |
| q, M, h, tau | in checks of the arm: joint positions, mass matrix, bias torques, joint torques |
| J, K, w, b | in checks of the arm: Jacobian of the tip, stiffness of the gears, angular frequency, backlash |
| K1 to K3 | stiffness of a gear in the three sections of its torque |
| P, R | in a stop: torque of motor, drag and brake at the gear's output; torque that accelerates the rotor |
"""

EFFECTS = """# Effects of a simulation

This page lists the physical effects that a [simulation](simulation.md) can include. A scene contains the effects that
the data of its study call for. Other effects are added

- by name in a study: `simulation: {add: [{effect: Cogging, joint: elbow, amplitudes: [5 mN m], orders: [84]}]}`
- in Python, in SI units: `dt.effects.Cogging(...)`

Units of the parameters are in the docstrings, for example `help(dt.effects.Cogging)`.
An effect of your own takes one file: see [adding an effect](add_one.md#an-effect-of-the-simulation).
`python docs/tables.py` generates this page from the classes in `drivetrain/effects/`.

| effect | description | parameters (default) |
|---|---|---|
"""


COLUMNS = """# Columns of a catalogue

This page lists the columns of the tables of a catalogue. [Your own parts](own_parts.md) describes how to write one. In
studies and in Python, `motors`, `gears` and `brakes` have entries of the same names.

A header states the name and a unit: `torque_constant [mNm/A]`, `max_speed [rpm]`, `rotor_inertia [oz-in-s^2]`. Any
unit of the same kind is converted to the SI unit that this page shows. A cell is empty if its value is unknown. Columns
may be in any order; only those marked **required** must be there.

`python docs/tables.py` generates this page from the columns that the reader knows (`drivetrain/catalog/schema.py`).
"""


def columns_page() -> str:
    """Every column of every table of a catalogue."""
    parts = [COLUMNS]
    for file, columns in TABLES.items():
        head = f"\n## {file}\n\n| column | SI unit or words | meaning |\n|---|---|---|\n"
        parts.append(head + "".join(map(_column, columns)))
    return "".join(parts)


def _column(one: Column) -> str:
    unit = {"1": "- or %", "degC": "°C"}.get(one.unit, one.unit) if one.content == NUMBER else ""
    words = ", ".join(f"`{word}`" for word in one.choices) if one.content == CHOICE else unit
    marks = " **Required.**" * one.needed + " Used by `drivetrain catalog lint` only." * one.lint_only
    return f"| `{one.name}` | {words} | {one.meaning}{marks} |\n"


def checks_page() -> str:
    """Every check, by what it is of."""
    parts = [CHECKS]
    for stage, heading in HEADINGS.items():
        rows = [_check(one) for one in REQUIREMENTS if one.stage == stage]
        head = f"\n## {heading}\n\n| check | required | limit | factor | note |\n|---|---|---|---|---|\n"
        parts.append(head + "".join(rows))
    return "".join([*parts, SYMBOLS])


def _check(one: Requirement) -> str:
    factor = "" if one.factor == "one" else f"`{one.factor.partition('.')[2]}`"
    marks = ", ".join(mark for mark, holds in (("essential", one.essential), ("on request", one.optional)) if holds)
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
    """Its name and its default."""
    given = "none" if field.default in ((), None) else field.default
    return f"`{field.name}`" if field.default is MISSING else f"`{field.name}` ({given})"


def main() -> None:
    """Write all."""
    for name, text in (("checks.md", checks_page()), ("effects.md", effects_page()), ("columns.md", columns_page())):
        (HERE / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
