"""Serving one page to browsers on this computer."""

from __future__ import annotations

import sys
from collections.abc import Callable
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import urlsplit

from cspm_msgs_py.errors import InputError

LOOPBACK = "127.0.0.1"
FIRST_PORT, LAST_PORT = 8080, 8099
# What every answer says: keep nothing, guess nothing, be shown in no other page.
_HEADERS = {
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
}


class ViewServer(ThreadingHTTPServer):
    """Offers a page at `/`, and nothing else.

    A request counts only under a name of this computer: a page from elsewhere whose name was
    pointed at 127.0.0.1 (DNS rebinding) comes with its own name as `Host`, and is refused.

    Attributes:
        page: the HTML.
    """

    daemon_threads = True

    def __init__(self, page: str, host: str, port: int) -> None:
        """Listen.

        Raises:
            OSError: the address cannot be used.
        """
        super().__init__((host, port), ViewHandler)
        self.page = page.encode()
        self.names = {host, "localhost", LOOPBACK, "::1"}

    def handle_error(self, request: Any, client_address: Any) -> None:  # noqa: ANN401
        """Say nothing of a browser that went before its answer was whole."""
        if not isinstance(sys.exc_info()[1], ConnectionError):
            super().handle_error(request, client_address)

    @property
    def url(self) -> str:
        """Where the page is."""
        name = str(self.server_address[0])
        return f"http://{f'[{name}]' if ':' in name else name}:{self.server_port}/"


class ViewHandler(BaseHTTPRequestHandler):
    """Answers GET of `/`; refuses other hosts, origins, paths and methods."""

    server: ViewServer
    server_version, sys_version = "cspm", ""

    def do_GET(self) -> None:
        """Send the page."""
        if self.allowed() and self.path == "/":
            self.answer(HTTPStatus.OK, self.server.page, "text/html; charset=utf-8")
        elif self.allowed():
            self.answer(HTTPStatus.NOT_FOUND, b"only / is here\n")

    def allowed(self) -> bool:
        """Return whether the request came under a name of this computer; else answer that."""
        given = self.headers.get("Host", "")
        origin = self.headers.get("Origin")
        own = _name(f"//{given}") in self.server.names
        if own and (origin is None or urlsplit(origin).netloc == given):
            return True
        self.answer(HTTPStatus.FORBIDDEN, b"this name is not one of this computer\n")
        return False

    def answer(self, status: HTTPStatus, body: bytes, kind: str = "text/plain") -> None:
        """Send a whole answer."""
        self.send_response(status)
        for name, value in _HEADERS.items():
            self.send_header(name, value)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:  # noqa: ANN401
        """Log nothing: the terminal belongs to the command."""


def _name(address: str) -> str | None:
    try:
        return urlsplit(address).hostname
    except ValueError:
        return None


def listening(host: str, port: int | None, make: Callable[[str, int], ViewServer]) -> ViewServer:
    """Return a server at a port, or at the first free one of a range where none is given.

    Raises:
        InputError: the address is not one of this computer, or the port is taken.
    """
    ports = range(FIRST_PORT, LAST_PORT + 1) if port is None else (port,)
    reason = ""
    for each in ports:
        try:
            return make(host, each)
        except OSError as err:
            reason = err.strerror or str(err)
    which = f"{ports[0]} to {ports[-1]}" if port is None else str(port)
    raise InputError(
        f"--host {host} --port {which}: {reason}, allowed: an address of this computer and a free"
        " port (0 takes any)"
    )
