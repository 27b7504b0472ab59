"""Machines that several test files use."""

import fcntl
import os
import sys
import tempfile
from pathlib import Path

from error_lines import said

# Workers of pytest share the processors; linear algebra with threads of its own only gets in their
# way: a fit of a system took 71 s of processor time with two threads, and 36 s with one.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import hypothesis
import pytest
from machines import THESIS, build, general_content, point_content, rig_content

from cspm.cli import main as cli
from cspm.commands import progress_shown
from cspm_msgs_py.garbage import look_seldom
from cspm_msgs_py.testbed import load_testbed

# Collected tests and all that they load stay: workers collect with 2 s less of 15 s.
look_seldom()

# The first call of a kernel may compile it, which takes longer than any sensible deadline.
hypothesis.settings.register_profile("cspm", deadline=None, derandomize=True)
hypothesis.settings.load_profile("cspm")


@pytest.fixture(autouse=True)
def alone_in_real_time(request):
    """Run tests that keep the wall clock one at a time: each wants a processor when it is due."""
    if request.node.get_closest_marker("realtime") is None:
        yield
        return
    with (Path(tempfile.gettempdir()) / "cspm-test-realtime").open("w") as turn:
        fcntl.flock(turn, fcntl.LOCK_EX)
        yield


@pytest.fixture(autouse=True)
def in_few_words(monkeypatch):
    """Leave out the lines of progress, which come when a machine is slow."""
    monkeypatch.setattr(progress_shown, "LINE_S", 1e9)


@pytest.fixture(scope="session")
def thesis():
    """The machine as the thesis models it: without the roll damping that its file adds."""
    return load_testbed(THESIS).testbed.model_copy(update={"effects": ()})


@pytest.fixture(scope="session")
def rig():
    return build(rig_content())


@pytest.fixture(scope="session")
def point():
    return build(point_content())


@pytest.fixture(scope="session")
def general():
    return build(general_content())


@pytest.fixture
def captured(capsys):
    """What catches the output of `cspm`; for a file to override."""
    return capsys


@pytest.fixture
def columns():
    """How wide the terminal of `cspm` is; for a file to override."""
    return 200


@pytest.fixture
def cspm(monkeypatch, captured, columns, tmp_path):
    """Run a command line in an empty folder; return exit code, stdout and stderr."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", str(columns))

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["cspm", *map(str, arguments)])
        with pytest.raises(SystemExit) as caught:
            cli.main()
        out, err = captured.readouterr()
        return caught.value.code or 0, out, err

    return call


@pytest.fixture
def refused(cspm):
    """Run a command line that must fail with one line on stderr; return the line."""

    def call(*arguments, code=2):
        found, _, err = cspm(*arguments)
        assert (found, err.count("\n")) == (code, 1), err
        assert said(err).startswith("")
        return said(err).removesuffix("\n")

    return call
