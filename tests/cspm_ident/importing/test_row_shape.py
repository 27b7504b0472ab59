"""Rows of text tables that have not the shape their names and their format declare."""

import csv

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from import_samples import imported

from cspm_msgs_py.errors import InputError

STATE = "/winches/state"
MAPPING = """
name: rig
csv: {%s}
clocks: {pc: {column: t%s}}
channels:
  /winches/state: {position/surge: {column: q, unit: rad}}
"""


def read(folder, text, form="", unit=""):
    path = folder / "a.csv"
    path.write_text(text, encoding="utf-8")
    return imported(path, MAPPING % (form, unit))


def fault(folder, text, form="", unit=""):
    with pytest.raises(InputError) as caught:
        read(folder, text, form, unit)
    return str(caught.value).removeprefix(f"{folder}/")


def numbered(count=12):
    """Rows with their number in front, as R writes them: no name for it."""
    rows = [
        f"{i + 1},{i / 100:.2f},{np.sin(i / 10):.4f},{np.cos(i / 10):.4f}" for i in range(count)
    ]
    return "t,q,v\n" + "\n".join(rows) + "\n"


def test_a_row_number_without_a_name_shifts_no_column(tmp_path):
    assert fault(tmp_path, numbered()) == (
        "a.csv: line 2: 4 cells under 3 names (t, q, v), allowed: one each; `csv.names` gives a"
        " name to each; a decimal comma needs another delimiter, or numbers in quotes"
    )
    found = read(tmp_path, numbered(), "names: [row, t, q, v]")
    assert found.stamps[STATE].tolist() == [10_000_000 * i for i in range(12)]
    assert found.rows[STATE][10, 0] == 0.8415


def test_a_decimal_comma_between_commas_is_refused(tmp_path):
    text = "t,q\n0,1,000\n1,1,001\n"
    assert fault(tmp_path, text).startswith("a.csv: line 2: 3 cells under 2 names (t, q)")
    quoted = 't;q\n0;"1,000"\n1;"1,001"\n'
    assert read(tmp_path, quoted, "decimal: ','").rows[STATE].tolist() == [[1.0], [1.001]]


def test_a_width_that_changes_is_refused_with_its_line(tmp_path):
    for row in ("2,3,4", "2,3,4,5"):
        assert fault(tmp_path, f"t,q\n0,1\n1,2\n{row}\n").startswith("a.csv: line 4: ")
    # A last row moved aside has an empty first cell, as words below the numbers may have.
    assert fault(tmp_path, "t,q\n0,1\n,1,2\n").startswith("a.csv: line 3: 3 cells under 2 names")
    assert read(tmp_path, "t,q\n0,1\n,2,\nMean,1\n").rows[STATE].tolist() == [[1.0]]
    short = "t,q,note\n0,1,a\n1,2\n2,3,c\n"
    assert fault(tmp_path, short) == (
        "a.csv: line 3: only 2 cells under 3 names (t, q, note), allowed: one each;"
        " csv.short_rows: fill takes the others as missing"
    )
    assert read(tmp_path, short, "short_rows: fill").rows[STATE].tolist() == [[1.0], [2.0], [3.0]]
    filled = read(tmp_path, "t q\n0 1\n1\n2 3\n", "short_rows: fill, delimiter: blank")
    assert filled.rows[STATE].tolist() == [[1.0], [3.0]]


def test_separators_at_the_end_make_no_column(tmp_path):
    found = read(tmp_path, "t,q\n0,1,\n1,2,\n")
    assert found.rows[STATE].tolist() == [[1.0], [2.0]]
    assert "2 rows end with empty cells, left out" in found.report.notes
    assert read(tmp_path, "t,q,\n0,1\n1,2\n").rows[STATE].tolist() == [[1.0], [2.0]]


def test_a_point_under_a_decimal_comma_is_refused_or_declared(tmp_path):
    text = "t;q\n0,0;1.000\n0,1;1.079,5\n0,2;999\n0,3;1.234.567,25\n"
    assert fault(tmp_path, text, "decimal: ','") == (
        "a.csv: line 2, column 'q': '1.000' has a point where csv.decimal is a comma, allowed:"
        " csv.thousands: '.' for points between thousands, or csv.decimal: '.'"
    )
    found = read(tmp_path, text, "decimal: ',', thousands: '.'")
    assert found.rows[STATE][:, 0].tolist() == [1000.0, 1079.5, 999.0, 1234567.25]


@pytest.mark.parametrize("cell", ["1.00", "1.0000", "0.123", "12.34.567", "1.23,4"])
def test_marks_between_other_than_thousands_are_refused(tmp_path, cell):
    assert fault(tmp_path, f"t;q\n0;{cell}\n", "decimal: ',', thousands: '.'") == (
        f"a.csv: line 2, column 'q': '{cell}', allowed: '.' between groups of three digits only"
    )


def test_commas_between_thousands_need_another_delimiter(tmp_path):
    text = "t;q\n0;1,000.5\n1;12,345\n"
    assert "'1,000.5', allowed: a number" in fault(tmp_path, text)
    assert read(tmp_path, text, "thousands: ','").rows[STATE].tolist() == [[1000.5], [12345.0]]
    assert fault(tmp_path, text, "thousands: ',', delimiter: ','").endswith(
        "csv.thousands: ',' is the decimal mark or the delimiter as well, allowed: another mark"
    )


def test_points_in_dates_and_texts_are_no_numbers(tmp_path):
    text = "t;q;file\n31.01.2026 00:00:01,5;1,5;a.b\n31.01.2026 00:00:02,5;2,5;c.d\n"
    found = read(tmp_path, text, "decimal: ','", ", unit: dd.mm.yyyy")
    assert np.diff(found.stamps[STATE]).tolist() == [10**9]
    assert found.rows[STATE].tolist() == [[1.5], [2.5]]


def outcome(folder, text):
    """What is read, or the refusal."""
    try:
        return read(folder, text, "missing: [n/a]")
    except InputError as refused:
        return str(refused)


CELLS = st.sampled_from(["0", "1", "-2.5", "", "n/a", "1,5", "1.000", "a b", "1e3", '"7"', "nan"])


@settings(max_examples=150, deadline=None)
@given(st.lists(st.lists(CELLS, min_size=1, max_size=4), min_size=1, max_size=6))
def test_any_table_is_refused_or_read_as_by_another_reader(tmp_path_factory, rows):
    folder = tmp_path_factory.mktemp("table")
    lines = [",".join([str(i), *row]) for i, row in enumerate(rows)]
    text = "t,q,r\n" + "\n".join(lines) + "\n"
    found = outcome(folder, text)
    if isinstance(found, str):
        assert "\n" not in found
        return
    expected = []
    for i, cells in enumerate(csv.reader(text.splitlines()[1:])):
        assert len(cells) == 3 or (len(cells) > 3 and not any(c.strip() for c in cells[3:]))
        value = float("nan") if cells[1].strip() in ("", "n/a") else float(cells[1])
        if not np.isnan(value):
            expected.append((i * 10**9, value))
    got = zip(found.stamps[STATE].tolist(), found.rows[STATE][:, 0].tolist(), strict=True)
    assert list(got) == expected
