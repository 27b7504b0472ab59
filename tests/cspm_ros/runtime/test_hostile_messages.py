"""Runs in lockstep while a stranger talks on their topics: the same messages, or a reason."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from ros_graph import assert_same, load_ros, new_domain
from run_samples import bundle_of

from cspm_msgs_py.errors import CspmError
from cspm_run.recorded_run import run
from cspm_run.resim import resimulate

load_ros()

from cspm_ros.runtime.graph_run import run_graph  # noqa: E402
from cspm_ros.runtime.process_run import run_processes  # noqa: E402

pytestmark = [pytest.mark.compiled, pytest.mark.slow]

STRANGER = Path(__file__).resolve().parents[2] / "support" / "graph" / "hostile_stranger.py"
# A process per node has to be given processor time against the stranger as well.
STEPS, FEW_STEPS = 600, 100
PATIENCE_S = 6.0
STANDSTILL = rf"nothing moved for {PATIENCE_S:g} s|the first steps stood still for \S+ s"
REASONS = rf"(?:{STANDSTILL}): plant waits for \S|/\S+: two senders"


class Stranger:
    """A program that talks in a domain of its own, where it finds a run.

    Attributes:
        domain: the ROS domain.
    """

    def __init__(self, kinds, seed=1):
        self.domain = new_domain()
        words = [sys.executable, STRANGER, kinds, str(seed)]
        environment = os.environ | {"ROS_DOMAIN_ID": str(self.domain)}
        self._process = subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env=environment)
        self._said = ""

    def hold_up(self, _):
        """Let nothing go on before it has talked to all."""
        self._said = self._said or self._process.stdout.readline()
        assert self._said == "talking\n"

    def __enter__(self):
        """Wait until it is there: a run may be over before a program has started."""
        assert self._process.stdout.readline() == "here\n"
        return self

    def __exit__(self, kind, *_):
        silent = self._process.poll()
        self._process.kill()
        self._process.communicate()
        assert kind is not None or silent is None, "the stranger fell silent"


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed") / "bag"
    run(bundle_of("rest"), folder, steps=STEPS)
    return folder


def disturbed(folder, stranger, patience_s=30.0):
    """Run with everything in this process, which stands still until the stranger talks."""
    run_graph(
        bundle_of("rest"),
        folder,
        stranger.hold_up,
        steps=STEPS,
        domain_id=stranger.domain,
        patience_s=patience_s,
    )


def failure_of(folder, stranger):
    """Return why a disturbed run ended early, nothing if it did not."""
    try:
        disturbed(folder, stranger, PATIENCE_S)
    except CspmError as err:
        return str(err)
    return ""


@pytest.mark.parametrize("kinds", ["values", "stamps", "statuses"])
def test_what_strangers_say_is_refused_and_changes_nothing(tmp_path, undisturbed, kinds, capfd):
    with Stranger(kinds) as stranger:
        disturbed(tmp_path / "bag", stranger)
    assert_same(undisturbed, tmp_path / "bag")
    reported = capfd.readouterr().err
    assert "allowed: " in reported
    assert "Traceback" not in reported


def test_messages_of_another_type_are_not_heard(tmp_path, undisturbed):
    with Stranger("types") as stranger:
        disturbed(tmp_path / "bag", stranger)
    assert_same(undisturbed, tmp_path / "bag")


@pytest.mark.parametrize("kinds", ["flood+echoes+noise", "deluge", "handshakes", "imitations"])
def test_what_cannot_be_refused_changes_nothing_or_ends_the_run(
    tmp_path, undisturbed, kinds, capfd
):
    folder = tmp_path / "bag"
    with Stranger(kinds) as stranger:
        failure = failure_of(folder, stranger)
    if failure:
        assert re.match(REASONS, failure)
        assert "\n" not in failure
        assert resimulate(folder, lambda now, total: None).difference is None
    else:
        assert_same(undisturbed, folder)
    assert "Traceback" not in capfd.readouterr().err


def test_all_at_once_changes_nothing_to_a_process_per_node(tmp_path):
    reported = []
    run(bundle_of("rest"), tmp_path / "undisturbed", steps=FEW_STEPS)
    with Stranger("flood+values+stamps+echoes+noise+statuses", seed=2) as stranger:
        run_processes(
            bundle_of("rest"),
            tmp_path / "bag",
            steps=FEW_STEPS,
            domain_id=stranger.domain,
            notify=reported.append,
        )
    assert_same(tmp_path / "undisturbed", tmp_path / "bag")
    assert any("allowed: " in line for line in reported)
