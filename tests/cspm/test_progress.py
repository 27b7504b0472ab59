"""Progress of functions in Python: shown where a person watches, unless they have their own."""

import os
import pty
import subprocess
import sys

import pytest

from cspm import progress as shown_by
from cspm.progress import shows_progress, silent


@shows_progress("working")
def worked(times, *, progress=silent):
    """Report so many times, and return to whom."""
    for done in range(times):
        progress((done + 1) / times, "at it")
    return progress


def test_nobody_is_shown_anything_where_nobody_watches(monkeypatch, capsys):
    monkeypatch.setattr(shown_by, "is_watched", lambda: False)
    assert worked(3) is silent
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("own", [silent, lambda share, what: None])
def test_progress_of_ones_own_is_used_wherever_it_is(monkeypatch, own):
    monkeypatch.setattr(shown_by, "is_watched", lambda: True)
    assert worked(1, progress=own) is own
    assert worked(1) not in (own, silent)


def test_a_terminal_has_a_bar_and_standard_output_nothing():
    code = "from tests.cspm.test_progress import worked; worked(5)"
    leader, follower = pty.openpty()
    with subprocess.Popen(
        [sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=follower, env=_with_tests()
    ) as process:
        out, _ = process.communicate(timeout=120)
        os.close(follower)
        said = os.read(leader, 1 << 16).decode()
    os.close(leader)
    assert (process.returncode, out) == (0, b"")
    assert "at it" in said
    assert "100%" in said


def _with_tests():
    root = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
    paths = [root, *filter(None, [os.environ.get("PYTHONPATH")])]
    return os.environ | {"PYTHONPATH": os.pathsep.join(paths), "COLUMNS": "100", "TERM": "xterm"}
