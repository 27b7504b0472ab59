"""Stamps and counters of 64 bits, read to the last digit from files of all kinds."""

import json

import numpy as np
import pytest
from import_samples import imported
from lab_bags import bag, made
from scipy.io import savemat

from cspm_ident.importing.column_store import ColumnStore
from cspm_ident.importing.sources import csv_source
from cspm_ident.importing.sources.exact_numbers import exact_numbers
from cspm_ident.importing.sources.row_choice import plain

STATE = "/winches/state"
STAMPS = 1_769_860_800_123_456_789 + 10_000_001 * np.arange(60)
COUNTS = np.arange(40, -20, -1).astype(np.uint64)  # 2⁶⁴ − 1 comes after 0
MAPPING = """
name: rig
csv: {%s}
clocks: {pc: {%s}}
channels:
  /winches/state:
    position/surge: {column: "%s", unit: rad, wrap: 18446744073709551616%s}
"""
BY_COLUMN = "column: t, unit: ns"


def read(path, *, clock=BY_COLUMN, column="c", form="", more=""):
    found = imported(path, MAPPING % (form, clock, column, more))
    return found.stamps[STATE].tolist(), found.rows[STATE][:, 0].tolist()


def whole(stamps=STAMPS):
    return stamps.tolist(), [float(40 - i) for i in range(len(stamps))]


def write_csv(path):
    lines = [f"{t},{c}" for t, c in zip(STAMPS, COUNTS, strict=True)]
    path.write_text("\n".join(["t,c", *lines, ""]))


def write_json(path):
    path.write_text(json.dumps({"t": STAMPS.tolist(), "c": COUNTS.tolist()}))


def write_h5(path):
    with pytest.importorskip("h5py").File(path, "w") as file:
        for name, values in (("t", STAMPS), ("c", COUNTS)):
            file[name] = values
            file[name].attrs["_FillValue"] = values.dtype.type(77)


def write_parquet(path):
    arrow = pytest.importorskip("pyarrow")
    parquet = pytest.importorskip("pyarrow.parquet")
    counts = arrow.array([*COUNTS.tolist(), None], arrow.uint64())
    last = arrow.array([*STAMPS.tolist(), int(STAMPS[-1]) + 1])
    parquet.write_table(arrow.table({"t": last.cast(arrow.decimal128(20)), "c": counts}), path)


WRITERS = {
    "csv": write_csv,
    "json": write_json,
    "npz": lambda path: np.savez(path, t=STAMPS, c=COUNTS),
    "mat": lambda path: savemat(path, {"t": STAMPS, "c": COUNTS}),
    "h5": write_h5,
    "parquet": write_parquet,
}


@pytest.mark.parametrize("end", WRITERS)
def test_a_counter_that_goes_back_through_zero_loses_no_count(tmp_path, end):
    WRITERS[end](tmp_path / f"log.{end}")
    assert read(tmp_path / f"log.{end}") == whole()


def test_messages_hold_counters_of_64_bits(tmp_path):
    sent = [
        (t, "/c", made("std_msgs/msg/UInt64", int(c))) for t, c in zip(STAMPS, COUNTS, strict=True)
    ]
    path = bag(tmp_path / "a.mcap", sent)
    assert read(path, clock="stamp: log", column="/c:data") == whole()


def test_a_table_whose_later_pieces_have_the_long_numbers(tmp_path, monkeypatch):
    monkeypatch.setattr(csv_source, "PIECE", 60)  # a few rows
    write_csv(tmp_path / "log.csv")
    assert read(tmp_path / "log.csv") == whole()


def test_an_invalid_value_of_64_bits_is_that_one_alone(tmp_path):
    write_csv(tmp_path / "log.csv")
    lost = 2**64 - 3
    stamps, rows = read(tmp_path / "log.csv", more=f", invalid: [{lost}]")
    expected = [pair for pair in zip(*whole(), strict=True) if pair[1] != -3.0]
    assert list(zip(stamps, rows, strict=True)) == expected


def test_numbers_are_long_only_where_float64_would_round_them():
    assert exact_numbers([1, 2**53 - 1, None, float("inf")]).dtype == np.float64
    found = exact_numbers([2**53 + 1, None, 0.5])
    assert found.dtype == np.longdouble
    assert (int(found[0]), found[2]) == (2**53 + 1, 0.5)
    with pytest.raises(OverflowError):
        exact_numbers([10**400])


def test_a_column_becomes_long_with_the_first_piece_that_is():
    with ColumnStore() as store:
        store.append("c", np.array([0.5, np.nan]))
        store.append("c", exact_numbers([2**60 + 1]))
        store.append("c", np.array([2.0]))
        store.append("d", np.array([3.0]))
        assert int(store.column("c")[2]) == 2**60 + 1
        np.testing.assert_array_equal(np.delete(store.column("c"), 2), [0.5, np.nan, 2.0])
        assert store.column("d").tolist() == [3.0]


def test_double_precision_is_named_where_it_rounds_counters(tmp_path):
    np.savez(tmp_path / "log.npz", t=STAMPS, c=COUNTS.astype(float), r=np.full(60, 2.0**53 - 1))
    notes = {
        column: imported(tmp_path / "log.npz", MAPPING % ("", BY_COLUMN, column, "")).report.notes
        for column in "cr"
    }
    assert notes["c"] == [
        "column 'c' holds whole numbers from 2⁵³ on in double precision, which rounds them to"
        " 4096; stored as 64-bit integers they are exact"
    ]
    assert notes["r"] == []


def test_rows_are_chosen_by_long_numbers():
    assert plain(" 0012345678901234567 ") == "12345678901234567"
    assert plain("12345678901234568") != plain("12345678901234567")
    assert {plain("3"), plain("3.0"), plain("03")} == {"3"}
