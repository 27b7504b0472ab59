"""Rates, losses and clocks: each fault of timing is reported by its own check, with its size."""

from dataclasses import replace

import numpy as np
import pytest
from driver_samples import EPOCH_NS, TENSION, said, steady_feed, undecided, wrong
from hypothesis import example, given
from hypothesis import strategies as st

from cspm_msgs_py.topics import contract_topics
from cspm_ros.check_drivers.driver_observation import hear
from cspm_ros.check_drivers.driver_timing import check_timing

TOPIC = contract_topics(["a", "b"], has_bar=False, has_winch_frame=False)[TENSION]
RATE = 1000
MILLISECOND, SECOND = 1_000_000, 1_000_000_000


def judged(feed, rate=RATE, delay=0.0):
    return check_timing(rate, delay, hear(feed.topic, feed.observation())[0])


@pytest.fixture(scope="module")
def steady():
    return steady_feed(TOPIC, RATE, 3.0)


def received_later(feed, nanoseconds):
    return replace(feed, receives=feed.receives + np.asarray(nanoseconds, dtype=np.int64))


def skewed(feed, ppm):
    return feed.shifted((feed.stamps - feed.stamps[0]) * ppm * 1e-6)


def in_bursts(feed):
    last = np.minimum(np.arange(len(feed.receives)) // 16 * 16 + 15, len(feed.receives) - 1)
    return replace(feed, receives=feed.receives[last])


def random_loss(feed):
    return feed.only(np.random.default_rng(1).random(len(feed.stamps)) > 0.05)


def with_zeros(feed):
    stamps = feed.stamps.copy()
    stamps[[5, 9]] = 0
    return replace(feed, stamps=stamps)


def restarted(feed):
    late = np.arange(len(feed.stamps)) >= 1500
    return feed.shifted(np.where(late, -2 * SECOND, 0))


def jittering(feed):
    # Stamps that scatter by 0.4 ms keep their order and lose nothing.
    return feed.shifted(np.random.default_rng(2).uniform(0, 0.4, len(feed.stamps)) * MILLISECOND)


FAULTS = {
    "half rate": (lambda f: f.only(slice(None, None, 2)), "rate", False,
                  "500.0 Hz (interval 2.000 ms), expected 1000 Hz", {"late"}),
    "losses": (random_loss, "gaps", False, "are missing, longest gap", {"late"}),
    "few losses": (lambda f: f.only(np.r_[0:1000, 1003:3000]), "gaps", None,
                   "3 messages (0.10%) are missing, longest gap 4.00 ms: lost by the driver, the"
                   " network or here", set()),
    "late": (lambda f: f.only(np.r_[0:1000, 1003:3000]), "late", None,
             "0.03% come more than 2 periods after the one before", set()),
    "duplicates": (lambda f: f.only(np.repeat(np.arange(3000), 2)), "stamps", False,
                   "of 6000 stamps 3000 repeat the one before, expected: strictly increasing",
                   set()),
    "no stamps": (lambda f: f.shifted(-f.stamps), "stamps", False,
                  "all stamps are 0: header.stamp is not filled", set()),
    "some zero": (with_zeros, "stamps", False, "of 3000 stamps 2 are 0, 2 go back, by up to",
                  {"gaps"}),
    "restart": (restarted, "stamps", False, "of 3000 stamps 1 go back, by up to 1.999 s",
                {"clock"}),
    "one hour behind": (lambda f: f.shifted(-3600 * SECOND), "clock", False,
                        "stamps are 3600.0 s behind this computer's clock: another time zone or"
                        " unsynchronised clocks", set()),
    "half an hour ahead": (lambda f: f.shifted(1800 * SECOND), "clock", False,
                           "stamps are 1800.0 s ahead of this computer's clock: another time",
                           set()),
    "five seconds": (lambda f: f.shifted(-5 * SECOND), "clock", False,
                     "stamps are 5.0 s behind this computer's clock: unsynchronised clocks",
                     set()),
    "TAI": (lambda f: f.shifted(37 * SECOND), "clock", False, "TAI, as PTP clocks give it", set()),
    "GPS": (lambda f: f.shifted(18 * SECOND), "clock", False, "GPS time, not UTC", set()),
    "since start": (lambda f: f.shifted(-EPOCH_NS + SECOND), "clock", False,
                    "they count from a start, as in a simulation or since switching on", set()),
    "fast clock": (lambda f: skewed(f, 500.0), "drift", False, "stamps run 500 ppm fast", set()),
    "slow clock": (lambda f: skewed(f, -500.0), "drift", False, " ppm slow (99 %: -50", set()),
    "early": (lambda f: received_later(f, -40 * MILLISECOND), "delay", False,
              "stamps are 39.67 ms ahead of their reception: clocks differ", set()),
    "delayed": (lambda f: received_later(f, 40 * MILLISECOND), "delay", None,
                "stamps are 40.33 ms old when received (median; 99 %: 40.5", set()),
    "bursts": (in_bursts, "jitter", None, "in bursts, or this computer or the network is slow",
               {"late"}),
    "jitter": (jittering, "stamp_jitter", None,
               "stamped when sent or received rather than when measured?", set()),
}  # fmt: skip


@pytest.mark.parametrize(
    ("change", "check", "ok", "words", "follows"), FAULTS.values(), ids=FAULTS.keys()
)
def test_a_fault_is_reported_by_its_check_and_no_other(steady, change, check, ok, words, follows):
    findings = judged(change(steady))
    found = said(findings, TENSION, check)
    assert any(verdict is ok and words in text for verdict, text in found), found
    assert {name for _, name in wrong(findings)} - {check} <= follows


def test_steady_messages_have_nothing_wrong(steady):
    findings = judged(steady)
    assert wrong(findings) == undecided(findings) == set()
    assert {finding.check for finding in findings} == {
        "rate", "jitter", "late", "stamps", "stamp_jitter", "gaps", "clock", "delay", "drift"
    }  # fmt: skip


def test_scattered_stamps_are_not_taken_for_losses(steady):
    assert said(judged(jittering(steady)), TENSION, "gaps")[0][0] is True


@pytest.mark.parametrize(("share", "ok"), [(1.04, True), (0.96, True), (1.07, False), (0.9, False)])
def test_the_rate_may_differ_by_a_twentieth(share, ok):
    feed = steady_feed(TOPIC, 100 * share, 3.0)
    assert said(judged(feed, rate=100), TENSION, "rate")[0][0] is ok


@pytest.mark.parametrize(("expected", "ok"), [(0.0, None), (0.04, True), (0.036, True)])
def test_a_delay_is_held_against_the_test_beds(steady, expected, ok):
    feed = received_later(steady, 40 * MILLISECOND)
    assert said(judged(feed, delay=expected), TENSION, "delay")[0][0] is ok


@given(ppm=st.floats(-2000.0, 2000.0), seed=st.integers(0, 2**31))
def test_the_drift_of_the_clock_is_found_whatever_its_size(ppm, seed):
    feed = skewed(steady_feed(TOPIC, 200, 3.0, seed), ppm)
    [(ok, text)] = said(judged(feed, rate=200), TENSION, "drift")
    found = float(text.split()[2]) * (1 if "fast" in text else -1)
    assert found == pytest.approx(ppm, abs=25.0)
    if abs(ppm) > 140.0 or abs(ppm) < 60.0:
        assert ok is (abs(ppm) < 100.0)


def test_a_short_window_does_not_judge_the_drift(steady):
    few = steady.only(slice(0, 30))
    assert said(judged(few), TENSION, "drift") == [(None, "30 messages, too few to judge")]


@given(seed=st.integers(0, 2**31))
@example(seed=9908122)  # Both halves fall as a drift would, but the whole does not.
def test_a_jammed_network_is_not_taken_for_a_drift(seed):
    # Delays of up to 0.1 s in a line where nothing overtakes hold each other up.
    feed = steady_feed(TOPIC, 100, 2.0)
    delays = np.random.default_rng(seed).integers(0, 100 * MILLISECOND, len(feed.stamps))
    jammed = replace(feed, receives=np.maximum.accumulate(feed.receives + delays))
    [(ok, text)] = said(judged(jammed, rate=100), TENSION, "drift")
    assert ok is None
    assert text.endswith("against this computer's clock; listen longer to decide")


@pytest.mark.parametrize("count", [0, 1, 2])
def test_a_few_messages_are_too_few(steady, count):
    findings = judged(steady.only(slice(0, count)))
    assert [(f.check, f.ok, f.text) for f in findings] == [
        ("rate", None, f"{count} messages, too few to judge")
    ]


def test_messages_that_come_all_at_once_are_judged_by_their_stamps(steady):
    at_once = replace(steady, receives=np.full(3000, steady.receives[-1]))
    assert said(judged(at_once), TENSION, "rate")[0][0] is True
    nothing_to_go_by = at_once.shifted(-steady.stamps)
    assert said(judged(nothing_to_go_by), TENSION, "rate") == [(None, "all messages came at once")]
