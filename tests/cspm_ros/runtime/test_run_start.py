"""A start of a run with a process per node that does not complete: who dies, who never joins."""

import re

import pytest
from process_runs import processes, use_site
from ros_graph import load_ros
from run_samples import bundle_of

from cspm_msgs_py.errors import CspmError
from cspm_ros.runtime import stall_watchdog as watch

load_ros()

from cspm_msgs_py.ros.session import FAREWELL_S  # noqa: E402
from cspm_ros.runtime.node_run import _spin  # noqa: E402

pytestmark = pytest.mark.compiled

# What a process does of which the others never hear, once it has become this node.
_AT_START = """
import os, time
import cspm_ros.runtime.node_main as program
main = program.main
def act(name, *others):
    return {act} if name == "motion_controller" else main(name, *others)
program.main = act
"""


def test_a_node_that_dies_while_the_run_starts_is_named(tmp_path, monkeypatch):
    use_site(tmp_path, monkeypatch, _AT_START.format(act="os._exit(7)"))
    with pytest.raises(CspmError) as caught:
        processes(bundle_of("rest"), tmp_path / "bag", steps=10)
    assert str(caught.value) == "motion_controller ended with exit code 7 before the run did"


def test_a_node_that_never_joins_ends_the_start_with_its_name(tmp_path, monkeypatch):
    use_site(tmp_path, monkeypatch, _AT_START.format(act="time.sleep(3600)"))
    monkeypatch.setattr(watch, "GRACE_S", 0.0)
    reported = []

    def notify(text):
        reported.append(text)
        if text == "plant waits for motion_controller":
            monkeypatch.setattr(watch, "START_FACTOR", 0.0)

    with pytest.raises(CspmError) as caught:
        processes(bundle_of("rest"), tmp_path / "bag", notify=notify, steps=10)
    assert reported[0] == "waits for plant"
    assert re.match(
        r"not all nodes joined within 0 s: plant waits for motion_controller; allowed: 0 times the"
        r" longer of patience \(20 s\) and what this start cost \(\S+ s\); for more use --patience",
        str(caught.value),
    )
    assert caught.value.exit_code == 1


class Part:
    """A node that has ended."""

    progress = 0


class Session:
    """Spins nothing; notes how long it may deliver [s]."""

    def __init__(self, stopped):
        self.stopped, self.allowed = stopped, []

    def every(self, seconds, call):
        call()

    def spin_until(self, done):
        assert done()

    def deliver(self, seconds):
        self.allowed.append(seconds)


@pytest.mark.parametrize(
    ("stopped", "cost", "wanted"),
    [(False, 2.0, 3.0), (False, 40.0, 40.0), (True, 40.0, FAREWELL_S)],
)
def test_last_words_may_take_as_long_as_starting_took(stopped, cost, wanted):
    session = Session(stopped)
    _spin(session, watch.Watch([Part()], watch.Patience(cost=cost), print), lambda: True)
    assert session.allowed == [wanted]
