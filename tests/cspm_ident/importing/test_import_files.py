"""Files of other programs: spreadsheets, Parquet, HDF5, compressed tables, arrays of MATLAB."""

import gzip
import sys
from datetime import datetime, timedelta

import numpy as np
import pytest
from import_samples import imported
from scipy.io import savemat

from cspm_ident.importing.sources.loaded_table import signals
from cspm_msgs_py.errors import InputError

STATE = "/winches/state"
MAPPING = """
name: rig
csv: {%s}
clocks: {pc: {column: %s}}
channels:
  /winches/state: {position/surge: {column: "%s", unit: rad}}
"""
T = np.arange(200) / 100
Q = np.sin(5 * T)
START = datetime(2026, 1, 31, 12)


def read(path, clock="t", column="q", form=""):
    return imported(path, MAPPING % (form, clock, column))


def fault(path, *args, **kwargs):
    with pytest.raises(InputError) as caught:
        read(path, *args, **kwargs)
    assert "\n" not in str(caught.value)
    return str(caught.value).removeprefix(f"{path.parent}/")


def assert_read(found):
    assert found.stamps[STATE].tolist() == [10_000_000 * i for i in range(200)]
    # Spreadsheets keep 16 digits.
    np.testing.assert_allclose(found.rows[STATE][:, 0], Q, rtol=0, atol=1e-15)


def spreadsheet(path, rows, sheets=("log",)):
    book = pytest.importorskip("openpyxl").Workbook()
    for i, name in enumerate(sheets):
        sheet = book.active if not i else book.create_sheet()
        sheet.title = name
        for row in rows if name == sheets[-1] else [["nothing"]]:
            sheet.append(row)
    book.save(path)
    return path


def test_spreadsheets(tmp_path):
    path = tmp_path / "a.xlsx"
    rows = [["t", "q", None], *([float(t), float(q)] for t, q in zip(T, Q, strict=True))]
    assert_read(read(spreadsheet(path, rows)))
    two = spreadsheet(path, rows, sheets=("plot", "log"))
    found = read(two, form="sheet: log")
    assert_read(found)
    assert "sheet log of plot, log" in found.report.notes
    assert fault(two, form="sheet: data") == "a.xlsx: no sheet 'data', allowed: plot, log"
    above = [["made by a logger"], [], *rows]
    assert_read(read(spreadsheet(path, above), form="names_line: 3"))


def test_spreadsheets_with_dates_and_with_what_is_no_number(tmp_path):
    path = tmp_path / "a.xlsx"
    rows = [["t", "q"]]
    rows += [[START + timedelta(milliseconds=10 * i), float(q)] for i, q in enumerate(Q)]
    found = read(spreadsheet(path, rows))
    assert np.diff(found.stamps[STATE]) == pytest.approx(1e7, abs=1e4)
    assert found.stamps[STATE][0] == 1769860800 * 10**9
    rows = [["t", "q"], [0.0, 1.0], [1.0, "n/a"], [2.0, None], [3.0, 4.0]]
    assert fault(spreadsheet(path, rows)) == (
        "a.xlsx: row 3, column 'q': 'n/a', allowed: a number, nothing, or a text named in"
        " csv.missing"
    )
    found = read(path, form="missing: [n/a]")
    assert found.rows[STATE].tolist() == [[1.0], [4.0]]
    longer = spreadsheet(path, [["t", "q"], [1, 0.0, 1.0]])
    assert fault(longer).startswith("a.xlsx: row 2: more cells than the 2 names")


def test_parquet(tmp_path):
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    path = tmp_path / "a.parquet"
    columns = {"t": T, "q": Q, "note": ["a"] * 200}
    columns["when"] = [START + timedelta(milliseconds=10 * i) for i in range(200)]
    holed = [None if i == 7 else q for i, q in enumerate(Q.tolist())]
    parquet.write_table(pyarrow.table(columns | {"holed": holed}), path)
    assert_read(read(path))
    dated = read(path, clock="when")
    assert dated.stamps[STATE].tolist() == [1769860800 * 10**9 + 10_000_000 * i for i in range(200)]
    assert len(read(path, column="holed").stamps[STATE]) == 199
    assert fault(path, column="note") == (
        "a.parquet: column 'note' holds texts, allowed: numbers; dates and texts as the column of a"
        " clock"
    )
    assert "no column 'x', allowed: t, q, note, when, holed" in fault(path, column="x")
    (tmp_path / "b.parquet").write_bytes(path.read_bytes()[:400])
    assert "b.parquet: no Parquet file that can be read (" in fault(tmp_path / "b.parquet")


def test_hdf5_as_matlab_writes_it_and_others(tmp_path):
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "a.mat"
    with h5py.File(path, "w") as file:
        file["t"], file["q"] = T[None, :], Q[None, :]
        file["log/signals"] = np.stack([np.stack([k * Q for k in range(2)]) for _ in range(3)]).T
        file["log/signals"].attrs["MATLAB_class"] = np.bytes_("double")
        file["name"] = np.arange(9, dtype=np.uint16)
        file["name"].attrs["MATLAB_class"] = np.bytes_("char")
        file["table"] = np.zeros(6)
        file["table"].attrs["MATLAB_object_decode"] = 3
    found = read(path)
    assert_read(found)
    assert any(note.startswith("objects that MATLAB alone reads") for note in found.report.notes)
    assert_read(read(path, column="log.signals[2,1]"))
    assert "no column 'name'" in fault(path, column="name")
    other = tmp_path / "a.h5"
    with h5py.File(other, "w") as file:
        file["log"] = np.array(list(zip(T, Q, strict=True)), dtype=[("t", "f8"), ("q", "f4")])
    found = read(other, clock="log.t", column="log.q")
    assert found.rows[STATE][:, 0] == pytest.approx(Q, abs=1e-6)
    (tmp_path / "b.mat").write_bytes(b"MATLAB 7.3 MAT-file" + bytes(600))
    assert "b.mat: no HDF5 file that can be read (" in fault(tmp_path / "b.mat")


@pytest.mark.parametrize(
    ("name", "start", "module"),
    [
        ("a.xlsx", b"PK\x03\x04", "openpyxl"),
        ("a.parquet", b"PAR1", "pyarrow"),
        ("a.mat", b"MATLAB 7.3 MAT-file", "h5py"),
        ("a.h5", b"\x89HDF\r\n\x1a\n", "h5py"),
    ],
)
def test_what_is_not_installed_is_named_with_its_remedy(tmp_path, monkeypatch, name, start, module):
    for known in [module, *(one for one in sys.modules if one.startswith(f"{module}."))]:
        monkeypatch.setitem(sys.modules, known, None)
    (tmp_path / name).write_bytes(start + bytes(600))
    assert fault(tmp_path / name) == (
        f"{name}: {module} is not installed, allowed: after `pip install 'cspm[files]'`, or a text"
        " table"
    )


def test_compressed_tables(tmp_path):
    path = tmp_path / "a.csv.gz"
    text = "t,q\n" + "".join(f"{t!r},{q!r}\n" for t, q in zip(T.tolist(), Q.tolist(), strict=True))
    path.write_bytes(gzip.compress(text.encode()))
    assert_read(read(path))
    path.write_bytes(gzip.compress(text.encode())[:900])
    assert fault(path).startswith("a.csv.gz: damaged gzip data (")
    path.write_bytes(gzip.compress(bytes(99)))
    assert fault(path).startswith("a.csv.gz: no text inside, allowed: ")


def test_an_old_spreadsheet_is_named(tmp_path):
    (tmp_path / "a.xls").write_bytes(b"\xd0\xcf\x11\xe0" + bytes(600))
    assert fault(tmp_path / "a.xls") == (
        "a.xls: an old spreadsheet (.xls), allowed: saved as .xlsx or .csv"
    )


def test_signals_of_matlab_with_three_axes_have_a_name_each(tmp_path):
    values = np.stack([[k * 10 * Q + j for j in range(3)] for k in range(1, 3)])
    assert values.shape == (2, 3, 200)
    log = {"time": T, "signals": {"values": values, "dimensions": [2, 3]}}
    savemat(tmp_path / "a.mat", {"log": log})
    found = read(tmp_path / "a.mat", clock="log.time", column="log.signals.values[1,2]")
    assert found.rows[STATE][:, 0].tolist() == (20 * Q + 2).tolist()


def test_the_longest_axis_is_time():
    names = dict(signals("a", np.arange(24.0).reshape(2, 12)))
    assert names["a[1]"].tolist() == list(range(12, 24))
    assert list(dict(signals("a", np.zeros((12, 2))))) == ["a[0]", "a[1]"]
    assert len(signals("a", np.zeros((100, 3, 2)))) == 6
    assert signals("a", np.zeros((100, 90))) == []


def test_packed_numbers_of_hdf5_are_unpacked_and_holes_are_none(tmp_path):
    h5py = pytest.importorskip("h5py")
    angles = np.sin(np.arange(40) / 20.0)
    with h5py.File(tmp_path / "lab.h5", "w") as file:
        file["t"] = np.arange(40) / 100.0
        packed = np.round(angles * 32767.0).astype(np.int16)
        packed[7] = -32768
        file["q"] = packed
        file["q"].attrs.update({"scale_factor": 1.0 / 32767.0, "_FillValue": np.int16(-32768)})
    found = imported(tmp_path / "lab.h5", MAPPING % ("", "t", "q"), trial=True)
    assert found.rows[STATE][:, 0] == pytest.approx(np.delete(angles, 7), abs=2e-5)


def test_durations_are_times(tmp_path):
    pandas = pytest.importorskip("pandas")
    times = pandas.to_timedelta(np.arange(40) * 10, unit="ms")
    table = pandas.DataFrame({"t": times, "q": np.sin(np.arange(40) / 20.0)})
    table.to_parquet(tmp_path / "lab.parquet")
    found = imported(tmp_path / "lab.parquet", MAPPING % ("", "t", "q"), trial=True)
    assert set(np.diff(found.stamps[STATE])) == {10_000_000}


ANGLES = np.sin(np.arange(40) / 20.0)


def tdms(path, **groups):
    """Write groups of channels; a channel is values, or values and properties."""
    nptdms = pytest.importorskip("nptdms")
    objects = [
        nptdms.ChannelObject(group, name, *(own if isinstance(own, tuple) else (own,)))
        for group, channels in groups.items()
        for name, own in channels.items()
    ]
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(objects)


def test_channels_of_tdms_are_columns_and_waveforms_have_a_time(tmp_path):
    times = 0.01 * np.arange(40)
    path = tmp_path / "lab.tdms"
    tdms(path, drive={"t": times, "q": ANGLES}, cell={"q": np.ones(40)})
    found = imported(path, MAPPING % ("", "t", "drive.q"), trial=True)
    assert found.rows[STATE][:, 0] == pytest.approx(ANGLES)
    tdms(path, drive={"q": (ANGLES, {"wf_increment": 0.01})})
    found = imported(path, MAPPING % ("", "time", "q"), trial=True)
    assert set(np.diff(found.stamps[STATE])) == {10_000_000}
    assert found.rows[STATE][:, 0] == pytest.approx(ANGLES)


@pytest.mark.parametrize("version", ["3.30", "4.10"])
def test_channels_of_mdf_are_columns_beside_their_group_s_time(tmp_path, version):
    asammdf = pytest.importorskip("asammdf")
    times, suffix = 0.01 * np.arange(40), {"3.30": "mdf", "4.10": "mf4"}[version]
    with asammdf.MDF(version=version) as file:
        file.append([asammdf.Signal(ANGLES, times, name="q")])
        path = file.save(tmp_path / f"lab.{suffix}")
    found = imported(path, MAPPING % ("", "time", "q"), trial=True)
    assert set(np.diff(found.stamps[STATE])) == {10_000_000}
    assert found.rows[STATE][:, 0] == pytest.approx(ANGLES)


@pytest.mark.parametrize(
    ("start", "kind", "library"),
    [
        (b"TDSm\x0e", "TDMS", "nptdms"),
        (b"MDF     4.10    ", "MDF", "asammdf"),
        (b"MDF     3.30    ", "MDF", "asammdf"),
    ],
)
def test_damaged_files_of_test_benches_are_one_line(tmp_path, monkeypatch, start, kind, library):
    path = tmp_path / "lab.bin"
    path.write_bytes(start + bytes(100))
    with pytest.raises(InputError, match=rf"lab.bin: (no {kind} file that can be read|holds no)"):
        imported(path, MAPPING % ("", "t", "q"))
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(InputError, match=r"after `pip install 'cspm\[benches\]'`, or exported"):
        imported(path, MAPPING % ("", "t", "q"))


def test_a_formula_that_was_never_calculated_is_named(tmp_path):
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    for row in (["t", "q"], *([i / 100, f"=SIN({i}/20)"] for i in range(5))):
        book.active.append(row)
    book.save(tmp_path / "lab.xlsx")
    with pytest.raises(InputError, match="row 2, column 'q': a formula without a saved value"):
        imported(tmp_path / "lab.xlsx", MAPPING % ("", "t", "q"))
