"""The machine's lateness, measured before a run in real time begins."""

from itertools import pairwise

import numpy as np
import pytest
from first_in_line import going_first
from realtime_graph import slow_bundle
from ros_graph import load_ros, new_domain
from run_samples import bundle_of

load_ros()

from cspm_msgs_py.errors import InputError  # noqa: E402
from cspm_msgs_py.recording.rows import Rows  # noqa: E402
from cspm_msgs_py.schedule import TORQUE_COMMAND  # noqa: E402
from cspm_ros.margins.rehearsal import check_machine, measure, worst_age_ns  # noqa: E402
from cspm_ros.runtime.realtime_run import run_realtime  # noqa: E402 - after ROS is there

MS = 1_000_000


def rows(*times_ms):
    """Messages by when they came and what they are stamped with [ms]."""
    times = MS * np.array(times_ms, dtype=np.int64).reshape(-1, 2)
    return Rows(times[:, 0], times[:, 1], np.zeros((len(times), 1)))


def test_the_age_is_that_of_what_is_in_force_until_the_next_command_comes():
    tensions = rows((0, 0), (10, 10), (40, 40))
    assert worst_age_ns(rows((1, 0), (11, 10), (40, 20)), tensions) == 30 * MS
    # The last command counts until the end, and none at all from the beginning.
    assert worst_age_ns(rows((1, 0), (11, 10)), tensions) == 30 * MS
    assert worst_age_ns(rows((1, 0)), tensions) == 40 * MS
    assert worst_age_ns(rows(), tensions) == 40 * MS
    assert worst_age_ns(rows(), rows()) == 2000 * MS


def test_where_nothing_says_how_late_commands_may_be_nothing_is_measured():
    def never(*_, **__):
        raise AssertionError

    assert measure(bundle_of("one_winch"), never, never) is None


def test_a_secured_graph_is_not_rehearsed_and_that_is_said(monkeypatch):
    def never(*_, **__):
        raise AssertionError

    monkeypatch.setenv("ROS_DOMAIN_ID", str(new_domain()))
    monkeypatch.setenv("ROS_SECURITY_ENABLE", "true")
    said = []
    check_machine(slow_bundle(), never, said.append)
    assert said == ["not rehearsed: a secured graph has no other namespace (ROS_SECURITY_ENABLE)"]
    monkeypatch.setenv("ROS_SECURITY_ENABLE", "false")
    with pytest.raises(AssertionError):
        check_machine(slow_bundle(), never, said.append)


@pytest.mark.slow
@pytest.mark.realtime
def test_what_the_machine_does_not_bear_is_refused_and_what_it_bears_is_named(monkeypatch):
    """A tenth of a millisecond is too short for any machine, half a second for none."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(new_domain()))
    said = []
    with going_first(), pytest.raises(InputError) as err:
        check_machine(
            slow_bundle("safety.lateness=0.0001"), run_realtime, said.append, slow_bundle_of
        )
    text = str(err.value)
    began = f"machine too busy: {TORQUE_COMMAND} answered, in 2 s before the start, a state of "
    assert text.startswith(began)
    assert " ms ago, allowed: 0.1 ms (safety.lateness): " in text
    measured = float(text.removeprefix(began).partition(" ms")[0])
    assert 0.1 <= measured < 500.0
    profile = text.partition(": fastest profile that holds here: ")[2]
    assert profile.startswith("--set drive=tension (")
    assert profile.endswith(" of 500 ms)")
    assert len(said) == 2
    assert all(a == b for a, b in pairwise(said))


def slow_bundle_of(overrides):
    return slow_bundle(*overrides, "rates.load_cells=200")
