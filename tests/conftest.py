"""Machines that several test files use."""

import os
import sys
import time

import hypothesis
import psutil
import pytest
from machines import THESIS, build, general_content, point_content, rig_content

from cspm.cli import main as cli
from cspm_msgs_py.testbed import load_testbed

# The first call of a kernel may compile it, which takes longer than any sensible deadline.
hypothesis.settings.register_profile("cspm", deadline=None)
hypothesis.settings.load_profile("cspm")

# For how long others may have the processors before a test by the wall clock is given up; for how
# long they are looked at [s]; which share of one processor they may use.
PATIENCE_S, LOOK_S, OTHERS = 10.0, 0.5, 0.2

# Steps of this share of a round come back evenly, however many are looked at.
GOLDEN_SHARE = 0.5 * (5.0**0.5 - 1.0)


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


def turned(files, turn):
    """Return the list begun elsewhere; in five turns in a row each file is in the first quarter."""
    first = int(len(files) * (turn * GOLDEN_SHARE % 1.0))
    return files[first:] + files[:first]


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(items):
    """Begin slow tests with another file each turn, so that where time is short all have theirs.

    But for what no run may be without.
    """
    turn = int(os.environ.get("CSPM_SLOW_TESTS_TURN", "0"))
    files = list(dict.fromkeys(item.path for item in items if item.get_closest_marker("slow")))
    place = {path: i for i, path in enumerate(turned(files, turn))}
    early = {item.path for item in items if item.get_closest_marker("early")}
    items.sort(key=lambda item: -1 if item.path in early else place.get(item.path, -1))


def pytest_runtest_setup(item):
    """Skip slow tests once the time that continuous integration gives them is over."""
    kind = "ALONE" if item.get_closest_marker("alone") else "SLOW"
    until = os.environ.get(f"CSPM_{kind}_TESTS_BEGIN_UNTIL")
    if until and item.get_closest_marker("slow") and time.time() > float(until):
        pytest.skip("no time left for all slow tests: `make test` has no such limit")


@pytest.fixture(autouse=True)
def _real_time_needs_a_processor(request):
    """Skip tests that run by the wall clock where other programs have the processors."""
    by_the_wall = ("test_realtime_safety", "test_realtime_run", "test_external_plant")
    if request.module.__name__ in by_the_wall:
        request.getfixturevalue("uncrowded")


@pytest.fixture
def uncrowded():
    """Skip where other programs have the processors, and go on having them for some seconds."""
    until = time.monotonic() + PATIENCE_S
    while is_crowded():
        if time.monotonic() > until:
            pytest.skip("the processor is crowded: real time cannot be judged")


def is_crowded():
    """Whether others use more than a part of a processor, or a busy loop does not get all of one.

    Not by the load average, in which the tests before this one are still to be seen.
    """
    begun, used, all_before = time.perf_counter(), time.process_time(), psutil.cpu_times()
    while time.perf_counter() < begun + LOOK_S:
        pass
    own, all_after = time.process_time() - used, psutil.cpu_times()
    busy = sum(
        getattr(all_after, kind) - getattr(all_before, kind) for kind in ("user", "nice", "system")
    )
    return own < 0.98 * LOOK_S or busy - own > OTHERS * LOOK_S


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
        assert err.startswith("cspm: ")
        return err.removeprefix("cspm: ").removesuffix("\n")

    return call
