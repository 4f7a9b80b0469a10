"""The verdict table for the terminal."""

from __future__ import annotations

from rich.table import Table
from rich.text import Text

from drivetrain.report.best_sets import equals_sentence, set_lines
from drivetrain.report.quantities import DASH, percent
from drivetrain.report.words import gaps, headline, identity, objective_text, overall_sentence
from drivetrain.sizing.results import Evaluation, JointResult, Selection
from drivetrain.study.parts.verdicts import Verdict, shared_place

STYLES = {
    Verdict.PASS: "bold green",
    Verdict.MARGINAL: "bold yellow",
    Verdict.FAIL: "bold red",
    Verdict.NOT_CHECKED: "dim",
}


def verdict_table(evaluation: Evaluation) -> Table:
    """One line a joint: its drive, how much of it is used, the verdict and what limits it."""
    table = Table(box=None, pad_edge=False, header_style="bold", padding=(0, 2, 0, 0))
    table.add_column("joint", no_wrap=True)
    table.add_column("motor", overflow="fold")
    table.add_column("gear", overflow="fold")
    for name in ("peak", "rms", "temp", "current"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("verdict", no_wrap=True)
    table.add_column("limited by", overflow="fold")
    for joint in evaluation.joints.values():
        table.add_row(*_cells(joint))
    for check in evaluation.shared:
        if check.utilisation is None and check.verdict is not Verdict.FAIL:
            continue
        verdict = Text(str(check.verdict), STYLES[check.verdict])
        blank = [DASH] * 3
        table.add_row(shared_place(check), "", "", percent(check.utilisation), *blank, verdict, check.name)
    return table


def _cells(joint: JointResult) -> list[str | Text]:
    """One joint's line."""
    heat, binding = joint.series.winding_temperature, joint.binding
    return [
        joint.name,
        joint.motor,
        joint.gear or "direct",
        percent(_largest(joint, ("gear repeated peak torque", "motor peak torque"))),
        percent(_largest(joint, ("motor RMS current",))),
        DASH if heat is None else f"{float(heat.max()):.0f} °C",
        percent(_largest(joint, ("motor peak current", "amplifier peak current"))),
        Text(str(joint.verdict), STYLES[joint.verdict]),
        DASH if binding is None else f"{binding.name} {percent(binding.utilisation)}",
    ]


def part_lines(evaluation: Evaluation) -> list[str]:
    """What the makers call the parts, each once."""
    rows = [row for joint in evaluation.joints.values() for row in (joint.drive.motor, joint.drive.gear)]
    return list(dict.fromkeys(f"{row.key}: {identity(row)}" for row in rows if row.key and identity(row)))


def _largest(joint: JointResult, names: tuple[str, ...]) -> float | None:
    """The highest utilisation among the named checks; None when none of them was judged."""
    found = [check.utilisation for check in joint.checks if check.name in names and check.utilisation is not None]
    return max(found, default=None)


def verdict_lines(result: Evaluation | Selection) -> list[Text]:
    """What stands under the table: the verdict in words, the objective, how sure the choice is, what would fix it."""
    selection = result if isinstance(result, Selection) else None
    evaluation = result.evaluation if isinstance(result, Selection) else result
    lines = [
        Text.assemble((str(result.verdict), STYLES[result.verdict]), "  ", headline(evaluation, selection)),
        Text(overall_sentence(evaluation)),
        Text(f"objective: {objective_text(evaluation, selection)}"),
    ]
    holes = gaps(evaluation)
    lines[1:1] = [Text(line, "yellow") for line in (holes[:1] if selection is not None else holes)]
    if selection is not None:
        lines += [Text(f"note: {line}", "yellow") for line in selection.notes]
        lines.append(Text(f"proof: {selection.proof}; {len(selection.fallen)} candidates rejected"))
        lines += [Text(line) for line in (equals_sentence(selection),) if line]
        lines += [Text(line, "dim") for line in set_lines(selection)]
        lines += [Text(f"fix: {line}") for line in selection.advice]
    missing = sum(
        check.verdict is Verdict.NOT_CHECKED for joint in evaluation.joints.values() for check in joint.checks
    )
    lines += [Text(line, "dim") for line in part_lines(evaluation)]
    if missing:
        lines.append(
            Text(f"{missing} checks not evaluated, or for information only: the report says which and why", "dim")
        )
    return lines
