"""Logs with a line per drive: a mapping names the rows that it takes."""

import numpy as np
import pytest
from import_samples import imported, table

from cspm_ident.importing.sources.row_choice import Labels, RowChoice, plain, row_choice
from cspm_msgs_py.errors import InputError

STATE = "/winches/state"
COUNT = 300
T = np.arange(COUNT) / 100
MAPPING = """
name: rig
clocks: {pc: {column: t}}
channels:
  /winches/state:
    position/surge: {column: "q[drive=%s]", unit: rad}
    effort/surge: {column: "u[drive=%s]", unit: N·m}
"""


def log(drives=(1, 2, 3)):
    """A line per drive and instant: drive k turns by sin(k t), with torque k + cos(k t)."""
    columns = {"t": [], "drive": [], "q": [], "u": [], "note": []}
    for t in T:
        for k, drive in enumerate(drives, start=1):
            found = (t, drive, np.sin(k * t), k + np.cos(k * t), 0.0)
            for name, value in zip(columns, found, strict=True):
                columns[name].append(value)
    return columns


def written(path, columns):
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(columns)
    if path.suffix == ".csv":
        return table(path, columns)
    pytest.importorskip("openpyxl" if path.suffix == ".xlsx" else "pyarrow")
    frame.to_excel(path, index=False) if path.suffix == ".xlsx" else frame.to_parquet(path)
    return path


@pytest.mark.parametrize("suffix", ["csv", "xlsx", "parquet"])
@pytest.mark.parametrize("drives", [(1, 2, 3), ("left", "mid", "right")])
@pytest.mark.parametrize("k", [1, 3])
def test_rows_of_one_drive_are_taken(tmp_path, suffix, drives, k):
    path = written(tmp_path / f"lab.{suffix}", log(drives))
    found = imported(path, MAPPING % (drives[k - 1], drives[k - 1]))
    assert found.stamps[STATE].tolist() == [10_000_000 * i for i in range(COUNT)]
    expected = np.stack([np.sin(k * T), k + np.cos(k * T)], axis=1)
    np.testing.assert_allclose(found.rows[STATE], expected, rtol=0, atol=1e-15)
    assert found.report.unused == ["note"]


def test_a_column_of_that_very_name_is_a_column(tmp_path):
    columns = {"t": T, "q[drive=3]": np.sin(T), "u[drive=3]": np.cos(T)}
    found = imported(table(tmp_path / "lab.csv", columns), MAPPING % (3, 3))
    np.testing.assert_array_equal(found.rows[STATE][:, 0], np.sin(T))


def test_dates_are_times_of_the_chosen_rows(tmp_path):
    columns = log()
    columns["t"] = [f"2026-01-31T12:00:{t:09.6f}" for t in columns["t"]]
    found = imported(table(tmp_path / "lab.csv", columns), MAPPING % (2, 2))
    assert np.diff(found.stamps[STATE]).tolist() == [10_000_000] * (COUNT - 1)


def test_a_clock_without_column_counts_the_rows_of_the_drive(tmp_path):
    text = (MAPPING % (2, 2)).replace("column: t}", "rate: 50}")
    found = imported(table(tmp_path / "lab.csv", log()), text)
    assert found.stamps[STATE].tolist() == [20_000_000 * i for i in range(COUNT)]


def fault(path, text):
    with pytest.raises(InputError) as caught:
        imported(path, text)
    return str(caught.value).removeprefix(f"{path.parent}/")


def test_what_cannot_be_chosen_is_refused(tmp_path):
    path = table(tmp_path / "lab.csv", log())
    assert fault(path, MAPPING % (4, 4)) == (
        "lab.csv: no row in which drive is 4, allowed: 1, 2, 3"
    )
    assert "lab.csv: no column 'axis', allowed: t, drive, q, u, note" in fault(
        path, (MAPPING % (1, 1)).replace("q[drive", "q[axis")
    )
    assert fault(path, (MAPPING % (1, 1)).replace("u[drive=1]", "drive")) == (
        "lab.csv: column 'drive' chooses rows and is read as well, allowed: one of both"
    )
    twice = log((1, 2, 2))
    assert fault(table(tmp_path / "lab.csv", twice), MAPPING % (2, 2)).startswith(
        "mapping.yaml: channels./winches/state: 300 stamps not later than one before"
    )


@pytest.mark.parametrize(
    ("name", "choice"),
    [
        ("q[drive=3]", ("q", "drive", "3")),
        ("log.q[0][ axis = left ]", ("log.q[0]", "axis", "left")),
        ("cells:q[drive=3]", ("cells:q", "drive", "3")),
        ("q", None),
        ("q[3]", None),
        ("q[1,2]", None),
        ("[drive=3]", None),
    ],
)
def test_names_of_choices(name, choice):
    found = row_choice(name)
    assert found == choice
    if found is not None:
        assert row_choice(RowChoice(*found).name) == found


def test_labels_keep_their_numbers_over_pieces():
    labels = Labels()
    assert labels.read(np.array([" 3", "left", "3.0"])).tolist() == [0, 1, 0]
    assert labels.read(np.array(["right", "03", "left "])).tolist() == [2, 0, 1]
    assert labels.known == ["3", "left", "right"]
    assert (plain(" 1e3 "), plain(" a b ")) == ("1000", "a b")
