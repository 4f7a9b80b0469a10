"""The web server of an interactive report page, reachable from this machine only."""

from __future__ import annotations

import gc
import json
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from drivetrain.errors import DrivetrainError, InputError
from drivetrain.report.json_text import json_text
from drivetrain.report.pages.live_page import LivePage

LOOPBACK = "127.0.0.1"
MOST_BYTES = 1_000_000  # largest size of a request
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; connect-src 'self'"
)


def server_of(page: LivePage, port: int = 0) -> ThreadingHTTPServer:
    """A server of one page, reachable from this machine only."""
    gc.freeze()  # no garbage collection of what is loaded: it would occasionally delay an answer by 0.15 s
    server = ThreadingHTTPServer((LOOPBACK, port), type("Answers", (_Answers,), {"page": page}))
    server.daemon_threads = True
    return server


class _Answers(BaseHTTPRequestHandler):
    """Handler: GET / returns the page, POST /evaluate and /select return results as JSON."""

    page: LivePage
    at_once = threading.Lock()  # one request at a time

    def do_GET(self) -> None:
        if self._is_own():
            if self.path == "/":
                self._send(200, "text/html; charset=utf-8", self.page.page())
            else:
                self._refuse(404, "there is one page, at /")

    def do_POST(self) -> None:
        if not self._is_own():
            return
        length, kind = self.headers.get("Content-Length", ""), self.headers.get_content_type()
        if self.path not in ("/evaluate", "/select"):
            self._refuse(404, "questions go to /evaluate or /select")
        elif kind != "application/json" or not length.isdecimal() or int(length) > MOST_BYTES:
            self._refuse(400, f"a question is JSON of at most {MOST_BYTES} bytes")
        else:
            try:
                asked = json.loads(self.rfile.read(int(length)))
            except (ValueError, RecursionError):
                return self._refuse(400, "the question is no JSON")
            try:
                with self.at_once:
                    found = self.page.answer(asked, anew=self.path == "/select")
                self._send(200, "application/json", _json(found))
            except DrivetrainError as error:
                self._refuse(400, *map(str, error.faults if isinstance(error, InputError) else [error]))

    def _is_own(self) -> bool:
        """Whether the request is from the page itself: pages of other sites must not use this server.

        Such a page may know the port, or reach this machine by a host name of its own.
        """
        port = self.request.getsockname()[1]
        hosts = [f"{name}:{port}" for name in (LOOPBACK, "localhost")]
        origin = self.headers.get("Origin")
        own = self.headers.get("Host") in hosts and (origin is None or origin in [f"http://{one}" for one in hosts])
        if not own:
            self._refuse(403, "only the page itself may ask")
        return own

    def _refuse(self, status: int, *faults: str) -> None:
        self._send(status, "application/json", _json({"faults": faults}))

    def _send(self, status: int, kind: str, text: str) -> None:
        body = text.encode()
        self.send_response(status)
        headers = {"Content-Type": kind, "Content-Length": str(len(body)), "Content-Security-Policy": POLICY,
                   "X-Content-Type-Options": "nosniff", "Cache-Control": "no-store"}  # fmt: skip
        for name, value in headers.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:
        """No log: results and faults are shown on the page."""


def _json(data: dict[str, Any]) -> str:
    return json_text(data, packed=True)
