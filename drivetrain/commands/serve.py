"""The command `serve`: an interactive report page, reachable from this machine only."""

from __future__ import annotations

from typing import Annotated

import typer

from drivetrain.commands.chain import chosen, load_chosen
from drivetrain.commands.shared import StudyOrResult, command, say


@command
def serve(
    study: StudyOrResult,
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port on this machine; 0: any free port.")] = 8765,
) -> None:
    """Serve the report as a local page with sliders for payload, cycle time, voltage, ambient, drives and ratios."""
    from drivetrain.commands.server import LOOPBACK, server_of
    from drivetrain.errors import Fault, InputError
    from drivetrain.report.pages.live_page import LivePage

    loaded = load_chosen(study)
    page = LivePage(loaded, chosen(loaded))
    try:
        server = server_of(page, port)
    except OSError as error:
        raise InputError(Fault("--port", f"cannot be used: {error.strerror}", port, "name another")) from None
    say(f"page: http://{LOOPBACK}:{server.server_address[1]}/  (this machine only; Ctrl-C ends it)")
    with server:
        server.serve_forever()
