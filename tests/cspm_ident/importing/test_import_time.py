"""Stamps: from columns, rates and messages, and which samples make a message."""

from unittest import mock

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from import_samples import imported, table

from cspm_checks.pace import pace_of
from cspm_ident.importing import column_store
from cspm_ident.importing.mapping import Clock
from cspm_ident.importing.time_base import out_of_order, times_of, unlike_log
from cspm_ident.importing.unwrapping import Unwrapper
from cspm_msgs_py.errors import InputError

STATE, TENSION = "/winches/state", "/cables/tension"
ALL = """
name: rig
clocks: {pc: {column: t%s}}
channels:
  /winches/state:
    position/surge: {column: q, unit: rad}
"""


def stamps(raw, **clock):
    raw = [] if raw is None else [np.asarray(raw, dtype=np.longdouble)]
    count = len(raw[0]) if raw else 4
    units = [clock.get("unit", "s")]
    where = "m.yaml: clocks.c"
    with column_store.ColumnStore() as store:
        return times_of(raw, count, Clock(**clock), units, store, where).stamp_ns.tolist()


@pytest.mark.parametrize(
    ("unit", "value"),
    [
        ("s", 0.001),
        ("ms", 1),
        ("us", 1000),
        ("ns", 1e6),
        ("min", 1 / 6e4),
        ("h", 1 / 3.6e6),
        ("d", 1 / 8.64e7),
    ],
)
def test_units_of_time(unit, value):
    assert stamps([0, value], column="t", unit=unit) == [0, 1_000_000]


def test_a_rate_counts_rows_without_drift():
    assert stamps(None, rate=1000 / 3) == [0, 3_000_000, 6_000_000, 9_000_000]
    with column_store.ColumnStore() as store:
        times = times_of([], 3_600_001, Clock(rate=1000.0), [], store, "")
        assert (times.first_ns, times.stamp_ns[-1]) == (0, 3_600_000_000_000)
        assert np.array_equal(times.rows, np.arange(3_600_001))


def test_offset_skew_and_points():
    assert stamps([-1.0, 0.0], column="t", offset=1.5) == [500_000_000, 1_500_000_000]
    assert stamps([2.0, 3.0], column="t", skew=1e-3) == [2_000_000_000, 3_001_000_000]
    assert stamps([2.0, 3.0, 4.0], column="t", points=((2.0, 10.0), (4.0, 13.0))) == [
        10_000_000_000,
        11_500_000_000,
        13_000_000_000,
    ]


def test_a_millisecond_counter_that_starts_again():
    raw = [4294967294, 4294967295, 0, 1]
    assert (
        np.diff(stamps(raw, column="t", unit="ms", wrap=4294967296.0, offset=-4294967.294)).tolist()
        == [1_000_000] * 3
    )


def test_nanoseconds_since_1970_keep_every_digit(tmp_path):
    given_ns = [1_700_000_000_123_456_789 + i * 1_000_003 for i in range(4)]
    found = []
    for name, cells, unit in (
        ("ns", [str(ns) for ns in given_ns], "ns"),
        ("s", [f"{ns // 10**9}.{ns % 10**9:09d}" for ns in given_ns], "s"),
        ("iso", [f"{np.datetime64(ns, 'ns')}Z" for ns in given_ns], "iso8601"),
    ):
        path = table(tmp_path / f"{name}.csv", {"t": cells, "q": [1.0, 2.0, 3.0, 4.0]})
        found.append(imported(path, ALL % f", unit: {unit}").stamps[STATE].tolist())
    assert found == [given_ns] * 3


@pytest.mark.parametrize(
    ("raw", "clock", "text"),
    [
        (
            [-1.0],
            {"column": "t"},
            "times from -1 s to -1 s, allowed: 0 to 2147483647 s; is the unit"
            " right? `offset` moves them",
        ),
        (
            [3e9],
            {"column": "t"},
            "times from 3e+09 s to 3e+09 s, allowed: 0 to 2147483647 s; is the unit"
            " right? `offset` moves them",
        ),
        ([np.nan], {"column": "t"}, "no row has a time, allowed: at least one"),
    ],
)
def test_times_that_no_recording_holds(raw, clock, text):
    with pytest.raises(InputError) as caught:
        stamps(raw, **clock)
    assert str(caught.value) == f"m.yaml: clocks.c: {text}"


@given(st.lists(st.integers(-2000, 2000), min_size=1, max_size=50), st.integers(-(10**6), 10**6))
def test_unwrapping_restores_what_moves_less_than_half_a_turn(steps, start):
    truth = np.cumsum([start, *steps]).astype(float)
    counter = Unwrapper(4096.0)
    raw = np.mod(truth, 4096.0)
    found = np.concatenate([counter.take(raw[:20]), counter.take(raw[20:])])
    assert np.array_equal(found - found[0], truth - truth[0])
    assert counter.largest_step == np.abs(steps).max() / 4096.0


def test_unwrapping_passes_over_what_is_missing():
    counter = Unwrapper(4096.0)
    found = counter.take(np.array([4090.0, np.nan, 4.0, np.nan]))
    np.testing.assert_array_equal(found, [4090.0, np.nan, 4100.0, np.nan])
    assert counter.turns == 1
    # A piece without a number changes nothing, and the next one goes on where the last known was.
    assert np.isnan(counter.take(np.array([np.nan]))).all()
    np.testing.assert_array_equal(counter.take(np.array([5.0])), [4101.0])
    assert counter.turns == 1
    fresh = Unwrapper(10.0)
    fresh.take(np.array([np.nan, 3.0]))
    assert fresh.turns == 0


def test_pace_of_regular_and_irregular_stamps():
    regular = pace_of(np.arange(5) * 2_000_000 + 10**9, 10**9)
    assert (regular.messages, regular.rate_hz, regular.gaps) == (5, 500.0, 0)
    assert regular.step_s == pytest.approx((0.002,) * 3)
    assert (regular.duplicates, regular.backwards, regular.irregular) == (0, 0, 0.0)
    odd = pace_of(np.array([0, 1, 2, 2, 1, 2, 3, 9, 10]) * 1_000_000, 0)
    assert (odd.duplicates, odd.backwards, odd.gaps) == (1, 1, 1)
    assert odd.gap_at_s == pytest.approx(0.003)
    assert odd.rate_hz == pytest.approx(1000.0)
    assert pace_of(np.zeros(0, dtype=np.int64), 0).rate_hz is None
    assert pace_of(np.array([7]), 7).step_s is None


@given(st.lists(st.tuples(st.integers(0, 20), st.booleans()), max_size=30), st.integers(1, 40))
def test_stamps_out_of_order_are_those_not_later_than_all_kept_before(rows, size):
    stamps = np.array([stamp for stamp, _ in rows], dtype=np.int64)
    kept = np.array([keep for _, keep in rows], dtype=bool)
    expected, latest = [], -1
    for i, (stamp, keep) in enumerate(rows):
        if keep and stamp <= latest:
            expected.append(i)
        latest = max(latest, stamp) if keep else latest
    with mock.patch.object(column_store, "PIECE", size):
        assert out_of_order(stamps, kept).tolist() == expected


def test_stamps_out_of_order_are_refused_dropped_or_kept(tmp_path):
    path = table(
        tmp_path / "a.csv", {"t": [0.0, 1.0, 1.0, 0.5, 2.0], "q": [0.0, 1.0, 2.0, 3.0, 4.0]}
    )
    with pytest.raises(InputError) as caught:
        imported(path, ALL % "")
    assert str(caught.value) == (
        f"{tmp_path}/mapping.yaml: channels./winches/state: 2 stamps not later than one before, the"
        " first of message 3 at 1 s, allowed: rising stamps, times with all their digits, in a bag"
        " `stamp: log`, or a `rate`; `disorder: drop` would lose 2 of 5 messages, or disorder: keep"
    )
    shown = imported(path, ALL % "", trial=True)
    assert {"backwards", "duplicate"} <= shown.kinds
    dropped = imported(path, ALL % ", disorder: drop")
    assert dropped.rows[STATE][:, 0].tolist() == [0.0, 1.0, 4.0]
    assert dropped.report.topics[0].left_out.disorder == 2
    assert not {"backwards", "duplicate"} & dropped.kinds
    kept = imported(path, ALL % ", disorder: keep")
    assert kept.rows[STATE][:, 0].tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]


TWO_CLOCKS = """
name: rig
%s
clocks: {a: {column: t}, b: {column: t2}}
channels:
  /winches/state:
    position/surge: {column: q, unit: rad}
    velocity/surge: {column: v, unit: rad/s, clock: b}
"""


def test_numbers_of_one_message_from_different_instants_are_refused(tmp_path):
    columns = {
        "t": [0.0, 1.0, 2.0],
        "t2": [0.5, 1.5, 2.5],
        "q": [1.0, 2.0, 4.0],
        "v": [1.0, 2.0, 3.0],
    }
    path = table(tmp_path / "a.csv", columns)
    for policy in ("", "unpaired: drop"):
        with pytest.raises(InputError) as caught:
            imported(path, TWO_CLOCKS % policy)
        assert str(caught.value) == (
            f"{tmp_path}/mapping.yaml: channels./winches/state: position/surge (3) and"
            " velocity/surge (3) have 0 stamps in common, within 0.05 s, and nothing is"
            " interpolated, allowed: numbers of one message from one instant, or within"
            " `pairing`; map what was measured at other instants to another topic or leave it out"
        )


def test_samples_without_partner_go_when_asked_and_none_is_made(tmp_path):
    columns = {
        "t": [0.0, 1.0, 2.0],
        "t2": [2.0, 3.0, 0.0],
        "q": [1.0, 2.0, 4.0],
        "v": [7.0, 8.0, 9.0],
    }
    path = table(tmp_path / "a.csv", columns)
    with pytest.raises(InputError, match=r"have 2 stamps in common, .* or unpaired: drop$"):
        imported(path, TWO_CLOCKS % "")
    found = imported(path, TWO_CLOCKS % "unpaired: drop")
    assert found.stamps[STATE].tolist() == [0, 2_000_000_000]
    assert found.rows[STATE].tolist() == [[1.0, 9.0], [4.0, 7.0]]
    assert found.report.topics[0].left_out.unpaired == 2
    columns["t2"] = columns["t"]
    same = imported(table(tmp_path / "b.csv", columns), TWO_CLOCKS % "")
    assert same.rows[STATE].tolist() == [[1.0, 7.0], [2.0, 8.0], [4.0, 9.0]]


def test_missing_numbers_are_dropped_refused_or_kept(tmp_path):
    path = table(tmp_path / "a.csv", {"t": [3.0, 4.0, 5.0], "q": [1.0, "", 2.0]})
    mapping = "nan: %s" + ALL % ""
    assert imported(path, ALL % "").stamps[STATE].tolist() == [3_000_000_000, 5_000_000_000]
    kept = imported(path, mapping % "keep")
    np.testing.assert_array_equal(kept.rows[STATE][:, 0], [1.0, np.nan, 2.0])
    with pytest.raises(InputError) as caught:
        imported(path, mapping % "refuse")
    assert str(caught.value) == (
        f"{tmp_path}/mapping.yaml: channels./winches/state: 1 messages with a number missing, the"
        " first at 1 s, allowed: none, with nan: refuse"
    )


def test_segments_count_from_the_first_stamp_and_may_name_topics(tmp_path):
    time = np.arange(10) * 1.0 + 100.0
    path = table(tmp_path / "a.csv", {"t": time, "q": time, "N": time})
    text = """
name: rig
clocks: {pc: {column: t}}
channels:
  /winches/state: {position/surge: {column: q, unit: rad}}
  /cables/tension: {effort/surge: {column: N, unit: N}}
drop:
  - {start: -1, end: 1, reason: cable not yet on}
  - {start: 4, end: 5, topics: [/cables/tension]}
"""
    found = imported(path, text)
    assert found.rows[STATE][:, 0].tolist() == [102, 103, 104, 105, 106, 107, 108, 109]
    assert found.rows[TENSION][:, 0].tolist() == [102, 103, 106, 107, 108, 109]
    assert [topic.left_out.segments for topic in found.report.topics] == [(2, 0), (2, 2)]
    with pytest.raises(InputError, match=r"no message is left, allowed: at least one$"):
        imported(path, text.replace("end: 1,", "end: 99,"))


def test_headers_unlike_the_log_are_told_and_a_usual_lag_is_not():
    log = np.arange(300, dtype=np.longdouble) * 10_000_000
    busy = np.random.default_rng(0).exponential(2_000_000, 300)
    assert unlike_log(log - 5_000_000 - busy, log) == 0.0
    whole = log // 1_000_000_000 * 1_000_000_000
    assert unlike_log(whole, log) == pytest.approx(0.99)
