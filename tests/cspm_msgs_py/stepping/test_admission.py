"""Which messages count by their stamps, and whose clock is believed."""

import pytest

from cspm_msgs_py.stepping.admission import AHEAD_NS, Admission
from cspm_msgs_py.stepping.publisher_binding import PublisherBinding

NOW = 1_800_000_000_000_000_000
TOPIC = "/winches/torque_command"


@pytest.mark.parametrize(
    ("ahead_ns", "admitted"),
    [(0, True), (AHEAD_NS, True), (AHEAD_NS + 1, False), (-(10**12), True)],
)
def test_stamps_are_hardly_ahead(ahead_ns, admitted):
    made = Admission(TOPIC)
    fault = made.fault(NOW + ahead_ns, NOW)
    assert (fault is None) == admitted
    assert made.stamp_ns == (NOW + ahead_ns if admitted else None)
    if not admitted:
        assert fault == f"{TOPIC}: stamp 0.050 s in the future, allowed: 0.05 s"


@pytest.mark.parametrize(("step_ns", "admitted"), [(1, True), (0, True), (-1, False)])
def test_stamps_do_not_go_back(step_ns, admitted):
    made = Admission(TOPIC)
    assert made.fault(NOW, NOW) is None
    fault = made.fault(NOW + step_ns, NOW)
    assert (fault is None) == admitted
    if not admitted:
        assert fault.startswith(f"{TOPIC}: stamp went back from ")


def test_in_the_safe_state_a_clock_may_have_been_restarted():
    made = Admission(TOPIC)
    assert made.fault(NOW, NOW) is None
    assert made.fault(NOW - 10**9, NOW, safe=True) is None
    assert made.stamp_ns == NOW - 10**9
    assert made.fault(NOW - 10**9 + 1, NOW) is None


def test_a_strangers_stamp_changes_nothing():
    made = Admission(TOPIC, PublisherBinding(TOPIC, [], lambda: {b"a": "drive"}))
    assert made.fault(NOW, NOW, b"a") is None
    assert "a second publisher" in made.fault(NOW + 5, NOW, b"b")
    assert made.stamp_ns == NOW
