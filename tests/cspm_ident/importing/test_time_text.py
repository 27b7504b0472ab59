"""Times as laboratories write them: two columns, dates, times of day, days."""

from datetime import datetime, timedelta, timezone

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from import_samples import imported

from cspm_ident.importing.time_text import nanoseconds, unit_of_text
from cspm_msgs_py.errors import InputError

STATE = "/winches/state"
MAPPING = """
name: rig
clocks: {pc: {%s}}
channels:
  /winches/state: {position/surge: {column: q, unit: rad}}
"""
START = datetime(2026, 1, 31, 12, tzinfo=timezone.utc)
EPOCH = datetime(1970, 1, 1, tzinfo=timezone.utc)
INSTANTS = [START + timedelta(milliseconds=10 * i) for i in range(200)]


def written(folder, names, rows):
    path = folder / "a.csv"
    lines = [";".join([*names, "q"])]
    lines += [";".join([*row, f"{np.sin(i / 20):.5f}"]) for i, row in enumerate(rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def ns_of(instant):
    since = instant - EPOCH
    return ((since.days * 86400 + since.seconds) * 10**6 + since.microseconds) * 1000


def clock(instant, form):
    return instant.strftime(form) + f".{instant.microsecond // 1000:03d}"


@pytest.mark.parametrize(
    ("form", "names", "cells"),
    [
        (
            "column: [sec, nanosec], unit: [s, ns]",
            ("sec", "nanosec"),
            lambda at: (str(ns_of(at) // 10**9), str(ns_of(at) % 10**9)),
        ),
        (
            "column: [day, time], unit: [dd.mm.yyyy, time_of_day]",
            ("day", "time"),
            lambda at: (at.strftime("%d.%m.%Y"), clock(at, "%H:%M:%S")),
        ),
        (
            "column: [day, time], unit: [iso8601, time_of_day]",
            ("day", "time"),
            lambda at: (at.strftime("%Y-%m-%d"), clock(at, "%H:%M:%S")),
        ),
        ("column: t, unit: dd.mm.yyyy", ("t",), lambda at: (clock(at, "%d.%m.%Y %H:%M:%S"),)),
        ("column: t, unit: mm/dd/yyyy", ("t",), lambda at: (clock(at, "%m/%d/%Y %H:%M:%S"),)),
        ("column: t, unit: iso8601", ("t",), lambda at: (clock(at, "%Y-%m-%dT%H:%M:%S") + "Z",)),
        ("column: t", ("t",), lambda at: (clock(at, "%Y-%m-%d %H:%M:%S"),)),
        (
            "column: t",
            ("t",),
            lambda at: (
                clock(at.astimezone(timezone(timedelta(hours=5, minutes=30))), "%Y-%m-%dT%H:%M:%S")
                + "+05:30",
            ),
        ),
    ],
)
def test_dates_and_pairs_of_columns(tmp_path, form, names, cells):
    path = written(tmp_path, names, [cells(at) for at in INSTANTS])
    found = imported(path, MAPPING % form)
    assert found.stamps[STATE].tolist() == [ns_of(at) for at in INSTANTS]
    assert found.rows[STATE][7, 0] == pytest.approx(np.sin(7 / 20), abs=1e-5)


def test_a_time_of_day_runs_on_over_midnight(tmp_path):
    instants = [
        datetime(2026, 1, 31, 23, 59, 59, tzinfo=timezone.utc) + timedelta(milliseconds=10 * i)
        for i in range(200)
    ]
    for form in ("column: t", "column: t, unit: time_of_day"):
        path = written(tmp_path, ("t",), [(clock(at, "%H:%M:%S"),) for at in instants])
        assert np.diff(imported(path, MAPPING % form).stamps[STATE]).tolist() == [10**7] * 199


@pytest.mark.parametrize(("unit", "zero"), [("datenum", 719529.0), ("excel", 25569.0)])
def test_days_are_counted_as_matlab_and_spreadsheets_do(tmp_path, unit, zero):
    days = [zero + ns_of(at) / 8.64e13 for at in INSTANTS]
    path = written(tmp_path, ("t",), [(f"{day:.13f}",) for day in days])
    stamps = imported(path, MAPPING % f"column: t, unit: {unit}").stamps[STATE]
    # A double holds such days to 10 us.
    np.testing.assert_allclose(stamps, [ns_of(at) for at in INSTANTS], rtol=0, atol=11_000)


@given(
    st.datetimes(min_value=datetime(1971, 1, 1), max_value=datetime(2035, 1, 1)),
    st.integers(0, 999_999_999),
    st.integers(-14 * 60, 14 * 60),
)
def test_dates_keep_every_nanosecond(instant, fraction, minutes):
    whole = instant.replace(microsecond=0)
    sign, size = "-" if minutes < 0 else "+", abs(minutes)
    text = f"{whole:%Y-%m-%d %H:%M:%S}.{fraction:09d}{sign}{size // 60:02d}:{size % 60:02d}"
    expected = int((np.datetime64(whole, "ns") - np.datetime64(0, "ns")).astype(np.int64))
    expected += fraction - minutes * 60 * 10**9
    assert int(nanoseconds("iso8601", [text])[0]) == expected


def test_only_texts_of_one_meaning_have_a_unit_of_their_own():
    assert unit_of_text("2026-01-31T12:00:00Z") == "iso8601"
    assert unit_of_text("2026-01-31") == "iso8601"
    assert unit_of_text("23:59:59.5") == "time_of_day"
    assert unit_of_text("01/02/2026") is None
    assert unit_of_text("24:00:00") is None
    assert unit_of_text("12:60") is None


@pytest.mark.parametrize(
    ("form", "cells", "reported"),
    [
        (
            "column: t",
            ["01/02/2026"],
            "'01/02/2026', allowed: a number, or a text with its unit of",
        ),
        ("column: t, unit: s", ["12:00:00"], "'12:00:00', allowed: a number, or a text with"),
        (
            "column: t, unit: iso8601",
            ["1769860800.5"],
            "'1769860800.5', allowed: a text as 2026-01-31T12:00:00.125 by unit iso8601",
        ),
        (
            "column: t, unit: dd.mm.yyyy",
            ["30.02.2026"],
            "'30.02.2026', allowed: a text as 31.01.2026 12:00:00.125 by unit dd.mm.yyyy",
        ),
        (
            "column: t",
            ["0", "12:00:00"],
            "line 2, column 't': '0', allowed: a text as 12:00:00.125 by unit",
        ),
        (
            "column: [t, q]",
            ["0"],
            "clocks.pc.unit: missing for several columns, allowed: a list, one each",
        ),
        (
            "column: [t, q], unit: [s]",
            ["0"],
            "clocks.pc.unit: 1 for 2 columns, allowed: one each",
        ),
        (
            "column: [t, q], unit: [s, ns], wrap: 60.0",
            ["0"],
            "clocks.pc: wrap, allowed: with one column in a unit of a number",
        ),
    ],
)
def test_times_that_are_not_what_they_are_said_to_be(tmp_path, form, cells, reported):
    path = written(tmp_path, ("t",), [(cell,) for cell in cells])
    with pytest.raises(InputError) as caught:
        imported(path, MAPPING % form)
    assert reported in str(caught.value)
    assert "\n" not in str(caught.value)


def test_days_taken_for_seconds_are_refused_and_stated_seconds_are_not(tmp_path):
    days = [740013.5 + 0.01 * i / 86400 for i in range(200)]
    path = written(tmp_path, ("t",), [(f"{day:.10f}",) for day in days])
    with pytest.raises(InputError) as caught:
        imported(path, MAPPING % "column: t")
    assert "mapping.yaml: clocks.pc.unit: missing, and in s /winches/state comes at" in str(
        caught.value
    )
    assert "in days at 100" in str(caught.value)
    found = imported(path, MAPPING % "column: t, unit: datenum")
    assert np.diff(found.stamps[STATE]) == pytest.approx(1e7, abs=2e4)
    stated = imported(path, MAPPING % "column: t, unit: s")
    assert "; were it days, 100" in next(
        one.text for one in stated.report.suspicions if one.kind == "rate"
    )


@pytest.mark.parametrize(("step", "suspected"), [(10.0, True), (1.0, True), (0.5, False)])
def test_a_rate_that_the_next_unit_would_explain_is_reported(tmp_path, step, suspected):
    path = written(tmp_path, ("t",), [(repr(i * step),) for i in range(100)])
    found = imported(path, MAPPING % "column: t")
    texts = [one.text for one in found.report.suspicions if one.kind == "rate"]
    assert bool(texts) == suspected
    assert not texts or f"were it the next smaller unit of time, {1000 / step:g} Hz" in texts[0]
