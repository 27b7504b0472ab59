"""How long work shows how far it is, on a terminal and elsewhere."""

import io
import threading

from rich.console import Console

from cspm.commands import progress_shown
from cspm.commands.progress_shown import Remaining, progress_line, shown


def console(terminal):
    return Console(file=io.StringIO(), force_terminal=terminal, width=80)


def test_a_line_says_what_how_far_and_what_is_left():
    assert progress_line("searching", 0.25, 30.0, Remaining()) == "searching, 25%, 90 s left"
    assert progress_line("reading", 0.0, 12.4, Remaining()) == "reading, 12 s"
    assert progress_line("simulating", 1.0, 40.0, Remaining()) == "simulating, 100%, 40 s"


def test_what_is_left_never_grows():
    """A step stands at 57 %; then the work goes on faster than was said, and slower again."""
    remaining = Remaining()
    said = [
        remaining.words(share, elapsed)
        for share, elapsed in [(0.57, 50.0), (0.57, 52.0), (0.57, 60.0), (0.9, 150.0), (0.9, 190.0)]
    ]
    assert said == ["38 s left", "36 s left", "60 s so far", "17 s left", "190 s so far"]


def test_where_nobody_watches_there_is_a_line_now_and_then(monkeypatch):
    monkeypatch.setattr(progress_shown, "LINE_S", 0.02)
    out, said = console(terminal=False), threading.Event()
    monkeypatch.setattr(progress_shown, "say", lambda _, line: (lines.append(line), said.set()))
    lines = []
    with shown(out, "working") as progress:
        progress(0.5, "half of it")
        while not any(line.startswith("half of it, 50%") for line in lines):
            assert said.wait(30.0)
            said.clear()
    count = len(lines)
    assert not threading.Event().wait(0.1)
    assert len(lines) == count


def test_quick_work_says_nothing_to_a_pipe():
    out = console(terminal=False)
    with shown(out, "working") as progress:
        progress(0.5, "")
    assert out.file.getvalue() == ""


def test_a_terminal_has_a_bar_with_names_as_they_are():
    out = console(terminal=True)
    with shown(out, "working") as progress:
        progress(0.5, "file [a].csv")
        progress(1.0, "file [a].csv")
    assert "file [a].csv" in out.file.getvalue()
    assert "100%" in out.file.getvalue()
