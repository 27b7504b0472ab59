"""Imports worked on in pieces and judged in stretches: the same numbers in bounded memory."""

from unittest import mock

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from import_samples import imported, table

from cspm_checks import pace as paces
from cspm_checks import stretches as stretching
from cspm_checks.pace import pace_of
from cspm_checks.stretches import joined
from cspm_checks.suspicion import Suspicion
from cspm_ident.importing import column_store
from cspm_ident.importing.field_statistics import statistics_of
from cspm_ident.importing.joint_parts import absent_numbers

STATE = "/winches/state"
MAPPING = """
name: rig
nan: drop
clocks: {pc: {column: t, unit: ms, wrap: 65536, offset: 3.0, skew: 1.0e-3, disorder: drop}}
channels:
  /winches/state:
    position/surge: {column: q, unit: counts, counts_per_turn: 4096, wrap: 4096}
    velocity/surge: {column: v, unit: rad/s, spikes: mask}
    effort/surge: {column: u, unit: N·m, invalid: [99]}
"""
PLAIN = """
name: rig
clocks: {pc: {column: t}}
channels:
  /winches/state:
    position/surge: {column: q, unit: rad}
"""


@pytest.fixture
def short_stretches(monkeypatch):
    for module in (paces, stretching):
        monkeypatch.setattr(module, "STRETCH", 500)


def messy(folder):
    """Return a table with a counter, a rollover of time, gaps, a spike and an error code."""
    rng = np.random.default_rng(7)
    count = 400
    time = np.mod(64_000.0 + 10.0 * np.arange(count), 65536.0)
    time[200] = time[199]
    angle = 6.0 * np.sin(np.arange(count) / 30.0)
    torque = rng.normal(0.1, 0.02, count)
    torque[300:304] = 99.0
    speed = np.round(np.gradient(angle, 0.01), 3)
    speed[250] = 4000.0
    late = [*[""] * 5, *speed[5:]]
    counts = np.mod(np.round(angle * 4096 / 2 / np.pi), 4096)
    return table(folder / "a.csv", {"t": time, "q": counts, "v": late, "u": torque})


@pytest.mark.parametrize("size", [1, 7, 64])
def test_pieces_of_any_size_give_the_same_import(tmp_path, monkeypatch, size):
    path = messy(tmp_path)
    whole = imported(path, MAPPING)
    monkeypatch.setattr(column_store, "PIECE", size)
    pieces = imported(path, MAPPING)
    assert whole.report.topics[0].left_out.total > 0
    assert {"late_part", "mended"} <= whole.kinds
    np.testing.assert_array_equal(pieces.stamps[STATE], whole.stamps[STATE])
    np.testing.assert_array_equal(pieces.rows[STATE], whole.rows[STATE])
    assert pieces.report.suspicions == whole.report.suspicions
    for one, other in zip(
        pieces.report.topics[0].fields, whole.report.topics[0].fields, strict=True
    ):
        assert (one.low, one.high, one.turns) == (other.low, other.high, other.turns)
        np.testing.assert_array_equal(one.raw, other.raw)
        assert one.mean == pytest.approx(other.mean)
        assert one.deviation == pytest.approx(other.deviation)


@given(
    st.lists(st.just(float("nan")) | st.floats(-1e3, 1e3), min_size=1, max_size=40),
    st.integers(1, 45),
)
def test_statistics_of_pieces_are_those_of_all_numbers(values, size):
    values = np.array(values)
    known = values[~np.isnan(values)]
    with mock.patch.object(column_store, "PIECE", size):
        found = statistics_of(values.__getitem__, len(values))
    assert found.head.tolist() == known.tolist()
    if len(known):
        assert (found.low, found.high) == (known.min(), known.max())
        assert found.mean == pytest.approx(known.mean(), abs=1e-9)
        assert found.deviation == pytest.approx(known.std(), abs=1e-6)
    else:
        assert np.isnan(found[:4]).all()


@settings(max_examples=200)
@given(
    st.lists(st.tuples(st.booleans(), st.booleans()), min_size=1, max_size=25), st.integers(1, 30)
)
def test_the_first_messages_may_lack_a_part_that_comes_later(there, size):
    held = {
        name: np.array([1.0 if row[i] else np.nan for row in there])
        for i, name in enumerate(("position/a", "velocity/a"))
    }
    with mock.patch.object(column_store, "PIECE", size):
        absent, late = absent_numbers(
            lambda piece: {name: column[piece] for name, column in held.items()},
            len(there),
            ("position", "velocity"),
        )
    begins = [
        next((i for i, row in enumerate(there) if row[part]), len(there)) for part in range(2)
    ]
    expected, counted = [], [0, 0]
    for i, row in enumerate(there):
        excused = [i < begins[p] < len(there) and any(row) for p in range(2)]
        counted = [count + yes for count, yes in zip(counted, excused, strict=True)]
        expected.append(any(not row[p] and not excused[p] for p in range(2)))
    assert absent.tolist() == expected
    named = zip(("position", "velocity"), counted, strict=True)
    assert late == {name: count for name, count in named if count}


def test_the_pace_of_stretches_is_that_of_the_whole(short_stretches, monkeypatch):
    stamps = np.arange(2600) * 2_000_000 + 10**9
    stamps[1400:] += 50_000_000
    stamps[2200] = stamps[2199]
    joined_pace = pace_of(stamps, 10**9)
    monkeypatch.setattr(paces, "STRETCH", 10**6)
    whole = pace_of(stamps, 10**9)
    assert joined_pace._replace(rate_hz=None, irregular=0.0) == whole._replace(
        rate_hz=None, irregular=0.0
    )
    assert joined_pace.rate_hz == pytest.approx(whole.rate_hz)
    assert joined_pace.irregular == pytest.approx(whole.irregular)
    assert (whole.gaps, whole.duplicates, whole.messages) == (2, 1, 2600)


def test_what_is_wrong_late_in_a_long_recording_is_found_once(tmp_path, short_stretches):
    time = np.arange(3000) * 0.01
    angle = np.sin(time)
    angle[[1200, 1800]] += 5.0
    path = table(tmp_path / "a.csv", {"t": time, "q": angle})
    spikes = [one for one in imported(path, PLAIN).report.suspicions if one.kind == "spike"]
    (spike,) = spikes
    assert spike.where == f"{STATE} position/surge"
    assert spike.at_s == pytest.approx((12.0,))
    assert spike.text.endswith("; likewise in 2 of 6 stretches of 500 messages")


@pytest.mark.parametrize(("moving", "suspected"), [(2000, False), (1000, True)])
def test_a_rest_is_no_constant_channel_unless_most_is(tmp_path, short_stretches, moving, suspected):
    time = np.arange(3000) * 0.01
    angle = np.where(np.arange(3000) < moving, np.sin(time), 0.25)
    found = imported(table(tmp_path / "a.csv", {"t": time, "q": angle}), PLAIN)
    assert ((f"{STATE} position/surge", "constant") in found.suspected) == suspected


def test_what_never_comes_near_a_limit_must_never_do_so():
    idle = Suspicion("/a x", "implausible", "never above", {"largest": 0.1, "limit": 900.0})
    huge = Suspicion("/a x", "implausible", "up to", {"largest": 5000.0, "limit": 900.0})
    present = {"/a": 4}
    assert joined([[idle], [], [], []], present) == []
    assert [one.text[:5] for one in joined([[idle], [idle], [idle], []], present)] == ["never"]
    assert [one.text[:5] for one in joined([[], [huge], [], []], present)] == ["up to"]
    assert joined([[idle]], {"/a": 1}) == [idle]
