"""Text tables as programs for people, loggers and power cuts leave them."""

import numpy as np
import pytest
from import_samples import imported

from cspm_checks.disorder import order_of
from cspm_msgs_py.errors import InputError

MAPPING = """
name: rig
csv: {%s}
clocks: {pc: {column: t%s}}
channels:
  /winches/state: {position/surge: {column: "%s", unit: rad}}
"""
ROWS = [f"{i / 100:.2f},{np.sin(i / 20):.6f}" for i in range(60)]
WHOLE = "t,q\n" + "\n".join(ROWS) + "\n"
ANGLES = [float(row.partition(",")[2]) for row in ROWS]


def read(folder, text, form="", column="q", clock="", encoding="utf-8"):
    path = folder / "lab.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode(encoding))
    found = imported(path, MAPPING % (form, clock, column), trial=True)
    return found.rows["/winches/state"][:, 0], found.report.notes


@pytest.mark.parametrize(
    ("text", "form", "column", "noted"),
    [
        (WHOLE.encode("utf-16"), "", "q", None),
        (("\ufeff" + WHOLE).encode("utf-16-be"), "", "q", None),
        ("sep=;\r\n" + WHOLE.replace(",", ";"), "", "q", None),
        ("sep=;\n" + WHOLE.replace(",", ";"), 'delimiter: ";"', "q", None),
        (WHOLE.replace("-", "\u2212"), "", "q", None),
        (WHOLE.replace("t,q", 't,"q\n(rad)"'), "", "q\\n(rad)", None),
        (WHOLE.replace("t,q", "t,q\n[s],[rad]"), "", "q", "line 2 holds units ([s], [rad])"),
        (WHOLE.replace("t,q", "t,q\ns,rad"), "", "q", "line 2 holds units (s, rad)"),
        (WHOLE + "Mean,0.1\nMax,1.0\n", "", "q", "lines 62 to 63 hold words below the numbers"),
    ],
)
def test_a_table_is_read_whole_however_it_is_written(tmp_path, text, form, column, noted):
    found, notes = read(tmp_path, text, form, column)
    assert found.tolist() == ANGLES
    assert noted is None or any(noted in note for note in notes)


def test_thousands_may_be_apart_by_a_blank_that_does_not_break(tmp_path):
    text = "t;q\n0,00;1\u00a0237,5\n0,01;2\u202f345,5\n"
    form = 'delimiter: ";", decimal: ",", thousands: " "'
    assert read(tmp_path, text, form)[0].tolist() == [1237.5, 2345.5]


def test_lines_with_zero_bytes_and_a_cut_last_number_are_left_out_and_told(tmp_path):
    lost = WHOLE.replace(ROWS[30], "0.30\0\0\0,0.99")
    found, notes = read(tmp_path, lost)
    assert found.tolist() == ANGLES[:30] + ANGLES[31:]
    assert "line 32 holds 3 zero bytes (power lost?), left out" in notes
    found, notes = read(tmp_path, WHOLE[:-4])
    assert found.tolist() == ANGLES[:-1]
    assert any("line 61, the last, is cut short" in note for note in notes)
    # A last line that is whole but for its end is a row.
    assert read(tmp_path, WHOLE[:-1])[0].tolist() == ANGLES


def test_a_word_between_numbers_is_told_with_its_line(tmp_path):
    with pytest.raises(InputError, match=r"line 32, column 't': 'Mean'"):
        read(tmp_path, WHOLE.replace(ROWS[30], "Mean,0.1"))


def test_wide_text_without_a_mark_names_its_encoding(tmp_path):
    with pytest.raises(InputError, match=r"csv\.encoding: utf-16-le"):
        read(tmp_path, WHOLE.encode("utf-16-le"))


def test_hours_before_and_after_noon(tmp_path):
    times = ("11:59:59.5 AM", "12:00:00 PM", "1:00:00 PM")
    text = "t,q\n" + "".join(f"01/31/2026 {time},1\n" for time in times)
    path = tmp_path / "lab.csv"
    path.write_text(text)
    found = imported(path, MAPPING % ("", ", unit: mm/dd/yyyy", "q"), trial=True)
    stamps = found.stamps["/winches/state"]
    assert (np.diff(stamps) * 1e-9).tolist() == [0.5, 3600.0]


def test_what_is_out_of_order_is_dropped_only_where_little_is_lost():
    even = np.arange(400) * 10_000_000
    few = even.copy()
    few[100] = few[99]
    assert order_of(few).keys == {"disorder": "drop"}
    assert "leaves out 1 of 400 messages" in order_of(few).remedy
    whole = even // 1_000_000_000 * 1_000_000_000
    assert order_of(whole).keys == {"rate": 100.0}
    assert "would lose 396 of 400 messages" in order_of(whole).remedy
    put_back = even - 3_600_000_000_000 * (np.arange(400) >= 200)
    assert "local time put back by 1 h" in order_of(put_back).remedy
    assert order_of(put_back).keys == {"rate": 100.0}
    scattered = np.random.default_rng(0).permutation(even)
    assert order_of(scattered).keys == {}
