"""The command `cspm export`: the numbers of the file are those of the recording."""

import csv
import json
import sys

import numpy as np
import pytest
from scipy.io import loadmat

import cspm as door


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """Winches at 1000 Hz, and poses at a tenth of that."""
    slow = door.load_scenario("rest").with_parameter("rates.motion_capture", 100)
    run = door.simulate(slow, duration=0.05)
    return run.save(tmp_path_factory.mktemp("recording") / "bag")


def test_a_text_table_has_a_row_for_each_stamp_and_nothing_where_there_is_none(
    cspm, tmp_path, recording
):
    words = ("--signals", "bar_pose,tension", "--json", "found.json")
    code, out, err = cspm("export", recording.path, "--out", "bag.csv", *words)
    assert (code, err) == (0, "")
    assert out.endswith("written bag.csv\n")
    with (tmp_path / "bag.csv").open(encoding="utf-8") as file:
        names, *rows = csv.reader(file)
    assert names[:2] == ["time [s]", "bar_pose/surge [m]"]
    assert len(rows) == len(np.unique([*recording.tension.time, *recording.bar_pose.time]))
    for name, expected in (("tension", recording.tension), ("bar_pose", recording.bar_pose)):
        for column, unit in zip(expected.columns, expected.units, strict=True):
            at = names.index(f"{name}/{column} [{unit}]")
            there = [(float(row[0]), float(row[at])) for row in rows if row[at]]
            assert np.array_equal(there, np.column_stack([expected.time, expected[column]]))
    found = json.loads((tmp_path / "found.json").read_text())
    assert list(found["signals"]) == ["bar_pose", "tension"]


def test_parquet_has_units_and_nulls(cspm, tmp_path, recording):
    parquet = pytest.importorskip("pyarrow.parquet")
    assert cspm("export", recording.path, "--out", "bag.parquet")[0] == 0
    table = parquet.read_table(tmp_path / "bag.parquet")
    assert table.schema.field("winch_torque/sway_1").metadata[b"unit"] == "N·m".encode()
    column = table.column("bar_pose/heave")
    assert column.null_count == len(table) - len(recording.bar_pose)
    assert np.array_equal(column.drop_null().to_numpy(), recording.bar_pose["heave"])


def test_matlab_has_a_structure_for_each_signal(cspm, tmp_path, recording):
    assert cspm("export", recording.path, "--out", "bag.mat")[0] == 0
    found = loadmat(tmp_path / "bag.mat", simplify_cells=True)
    assert set(recording.names) <= set(found)
    assert np.array_equal(found["tension"]["values"], recording.tension.values)
    assert np.array_equal(found["tension"]["time"], recording.tension.time)
    assert list(found["tension"]["columns"]) == list(recording.tension.columns)
    assert list(found["bar_pose"]["units"]) == ["m", "m", "m", "rad", "rad", "rad"]


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("--out", "bag.xls"), "bag.xls: allowed: a name that ends with .csv, .parquet, .mat"),
        (("--out", "there.csv"), "there.csv: allowed: a new file in a folder that exists"),
        (("--out", "no/bag.csv"), "no/bag.csv: allowed: a new file in a folder that exists"),
        (("--out", "bag.csv", "--signals", "wind"), "no wind, it has: bar_pose, frame_pose"),
    ],
)
def test_what_cannot_be_written_is_one_line(refused, tmp_path, recording, words, line):
    (tmp_path / "there.csv").write_text("")
    assert line in refused("export", recording.path, *words)
    assert not (tmp_path / "bag.csv").exists()


def test_parquet_without_its_library_names_the_extra(refused, monkeypatch, recording):
    for known in ["pyarrow", *(name for name in sys.modules if name.startswith("pyarrow."))]:
        monkeypatch.setitem(sys.modules, known, None)
    line = refused("export", recording.path, "--out", "bag.parquet")
    assert line.endswith("after `pip install 'cspm[files]'`, or .csv or .mat")
