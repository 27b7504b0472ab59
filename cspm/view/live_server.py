"""Serving a run as it happens to browsers on this computer."""

from __future__ import annotations

import json
from http import HTTPStatus
from urllib.parse import parse_qs, urlsplit

from cspm.view.live_run import LiveRun
from cspm.view.view_server import ViewHandler, ViewServer
from cspm.view.viewer_page import viewer_page
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Testbed

_MOST_BYTES = 1000
_WAITING = """<!doctype html><html lang=en><head><meta charset=utf-8>
<meta http-equiv=refresh content=1><title>cspm run</title></head>
<body><p>The run has not begun yet.</p></body></html>"""


class LiveServer(ViewServer):
    """Offers a page at `/`, what came since at `/run`, and takes what is turned at `/knob`."""

    def __init__(self, live: LiveRun, machine: Testbed, host: str, port: int) -> None:
        """Listen; errors as `ViewServer`."""
        super().__init__("", host, port)
        self.live, self.machine = live, machine
        self.RequestHandlerClass = LiveHandler


class LiveHandler(ViewHandler):
    """Answers what the live page asks, under the rules of `ViewHandler`."""

    server: LiveServer

    def do_GET(self) -> None:
        """Send the page, or what came since."""
        if not self.allowed():
            return
        asked = urlsplit(self.path)
        if asked.path == "/run":
            after = parse_qs(asked.query).get("after", [""])[0]
            found = self.server.live.answer(after)
            if found is None:
                self.answer(HTTPStatus.NO_CONTENT, b"")
            else:
                self.answer(HTTPStatus.OK, found, "application/json")
        elif self.path == "/":
            frames = self.server.live.frames()
            page = (
                viewer_page(self.server.machine, [frames], live=True)
                if frames is not None and frames.traces
                else _WAITING
            )
            self.answer(HTTPStatus.OK, page.encode(), "text/html; charset=utf-8")
        else:
            self.answer(HTTPStatus.NOT_FOUND, b"only / is here\n")

    def do_POST(self) -> None:
        """Turn a knob; only the page itself may."""
        if not self.allowed():
            return
        if self.headers.get("Origin") is None or self.path != "/knob":
            self.answer(HTTPStatus.FORBIDDEN, b"only the page turns knobs\n")
            return
        try:
            size = int(self.headers.get("Content-Length", "0"))
            asked = json.loads(self.rfile.read(min(size, _MOST_BYTES)))
            self.server.live.turn(str(asked["name"]), asked["value"])
        except (ValueError, TypeError, KeyError, InputError) as err:
            self.answer(HTTPStatus.BAD_REQUEST, f"{err}\n".encode())
            return
        self.answer(HTTPStatus.NO_CONTENT, b"")
