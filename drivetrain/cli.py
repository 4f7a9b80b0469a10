"""The command line. Exit codes: 0 fits, 1 does not fit, 2 wrong input, 3 internal error, 130 interrupted.

Modules that are slow to import are imported inside the commands that need them, so that ``--help`` is fast.
"""

from __future__ import annotations

import gc
import os
import sys
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from drivetrain.commands import accuracy, answers, catalog, export, identify, serve, simulate, sizing, sweep, warm
from drivetrain.commands.shared import DEBUG, FITS, failure
from drivetrain.version import __version__


class _Commands(TyperGroup):
    """The group of commands; removes pydantic's prefix from messages about options."""

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except typer.BadParameter as error:
            error.message = error.message.removeprefix("Value error, ")
            raise


app = typer.Typer(
    cls=_Commands,
    name="drivetrain",
    help="Select motors and gears for a robot arm, verify that they can perform its motions, simulate them.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
)
catalogs = typer.Typer(
    help="Check and import catalogues of motors, gears, brakes, amplifiers and prices.",
    no_args_is_help=True,
    rich_markup_mode="rich",
)
app.add_typer(catalogs, name="catalog")

COMMANDS = (
    sizing.demo, sizing.init, sizing.check, sizing.size, sizing.select, sizing.report, answers.ratio, export.currents,
    export.export, answers.why_not, answers.explain, answers.curve, answers.front, answers.family, answers.free_ratio,
    answers.fastest, sweep.sweep, simulate.simulate, accuracy.accuracy, accuracy.loops, identify.identify,
    serve.serve, warm.warm,
)  # fmt: skip
for one in COMMANDS:
    app.command(one.__name__.replace("_", "-"))(one)
catalogs.command("lint")(catalog.lint)
catalogs.command("import")(catalog.import_)

COLLECT_AFTER = 100_000  # new objects between garbage collections


def main() -> None:
    """Run the command that is given on the command line."""
    for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        # Before numpy is loaded: for small matrices its threads cost more than they gain.
        os.environ.setdefault(name, "1")
    gc.set_threshold(COLLECT_AFTER, 20, 100)  # otherwise garbage collection takes a tenth of the compile time
    try:
        app()
    except SystemExit as end:
        code = end.code
    except Exception as error:  # usually a broken installation, since commands report their own errors
        code = failure(error)
    try:
        sys.stdout.flush()
    except OSError as error:
        code = failure(error)
    sys.exit(code)


def _show_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"drivetrain {__version__}")
        raise typer.Exit(FITS)


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and exit.", is_eager=True, callback=_show_version)
    ] = False,
    debug: Annotated[bool, typer.Option("--debug", help="Show the traceback where something fails.")] = False,
    trust_xacro: Annotated[
        bool, typer.Option("--trust-xacro", help="Let the expressions of xacro files execute any code.")
    ] = False,
) -> None:
    """Options before the command's name."""
    if debug:  # both as environment variables, for the processes that a command starts
        os.environ[DEBUG] = "1"
    if trust_xacro:
        from drivetrain.arm.files.xml import TRUSTED

        os.environ[TRUSTED] = "1"
