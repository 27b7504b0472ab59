"""The command `cspm view`."""

from __future__ import annotations

import sys
import webbrowser
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

import cspm.recorded
from cspm.commands.progress_shown import shown
from cspm.recorded import Recording
from cspm.view.frames import frames_of
from cspm.view.marks import read_marks
from cspm.view.view_server import ViewServer, listening
from cspm.view.viewer_page import viewer_page
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import Testbed, load_testbed
from cspm_run.output.console import make_console, say
from cspm_run.output.json_file import write_json

MOST_RECORDINGS = 2


@dataclass(frozen=True)
class ViewRequest:
    """Options of the command.

    Attributes:
        recordings: one, or two to lay over one another.
        testbed: the machine, instead of the one that the first recording carries.
        diagnosis: a `diagnosis.json` or its folder, whose parts are marked.
        html: a new file to write instead of serving.
        host: address to listen on.
        port: to listen on; None takes the first free one from 8080.
        browser: whether to open a browser.
    """

    recordings: Sequence[Path]
    testbed: Path | None
    diagnosis: Path | None
    html: Path | None
    host: str
    port: int | None
    browser: bool


def view_command(request: ViewRequest, json: Path | None) -> None:
    """Write the page of recordings, or serve it until Ctrl-C.

    Raises:
        InputError: recordings, test-bed, diagnosis or address cannot be used.
    """
    console = make_console()
    if len(request.recordings) > MOST_RECORDINGS:
        count = len(request.recordings)
        raise InputError(f"view: {count} recordings, allowed: 1, or 2 to lay over one another")
    _refuse_file(request.html)
    with shown(console, "reading"):
        page = page_of(request.recordings, request.testbed, request.diagnosis)
    if request.html is not None:
        _write(console, request.html, page)
        if json is not None:
            write_json(json, {"html": str(request.html), "bytes": len(page.encode())})
        return
    server = listening(request.host, request.port, lambda *at: ViewServer(page, *at))
    if json is not None:
        write_json(json, {"url": server.url})
    serve(console, server, request.browser)


def page_of(recordings: Sequence[Path], testbed: Path | None, diagnosis: Path | None) -> str:
    """Return the viewer's page of recordings.

    Raises:
        InputError: recordings, test-bed or diagnosis cannot be used.
    """
    opened = [cspm.recorded.open(path) for path in recordings]
    machine = _machine(opened[0], testbed)
    names = [each.path.resolve().name for each in opened]
    marks = () if diagnosis is None else read_marks(diagnosis, machine, names[0])
    if len(set(names)) < len(names):
        names = [str(each.path) for each in opened]
    runs = [frames_of(each, name) for each, name in zip(opened, names, strict=True)]
    return viewer_page(machine, runs, marks)


def _machine(recording: Recording, testbed: Path | None) -> Testbed:
    if testbed is not None:
        return load_testbed(testbed).testbed
    try:
        return recording.testbed.description
    except InputError as err:
        raise InputError(f"{err}, or --testbed FILE") from None


def _refuse_file(path: Path | None) -> None:
    if path is None:
        return
    if path.exists() or not path.absolute().parent.is_dir():
        raise InputError(f"--html {path}: allowed: a new file in a folder that exists")


def _write(console: Console, path: Path, page: str) -> None:
    path.write_text(page, encoding="utf-8")
    say(console, f"page {path}, {len(page.encode()) / 1e6:.1f} MB; it needs no network")


def serve(console: Console, server: ViewServer, browser: bool) -> None:
    """Serve until Ctrl-C."""
    say(console, f"view {server.url} (Ctrl-C ends)")
    sys.stdout.flush()
    if browser:
        open_browser(server.url)
    try:
        server.serve_forever()
    except KeyboardInterrupt:
        say(console, "")
    finally:
        server.server_close()


def open_browser(url: str) -> None:
    """Open a page in the browser that the system prefers, if there is one."""
    webbrowser.open(url)
