"""Text tables, MATLAB files and bags as they come, damaged ones among them."""

import numpy as np
import pytest
from bag_samples import clock_messages, write_rosbag1
from import_samples import NOETIC, imported, ros1_bag
from scipy.io import savemat

from cspm_ident.importing.sources import bag_source, csv_source
from cspm_msgs_py.errors import InputError

STATE = "/winches/state"
ALLOWED = (
    "allowed: a text table, .csv.gz, .json, .npz, .xlsx, .parquet, .mat, HDF5, TDMS or MDF"
    " file, or a bag"
)
MAPPING = """
name: rig
csv: {%s}
clocks: {pc: {column: t}}
channels:
  /winches/state: {position/surge: {column: q, unit: rad}}
"""


def read(tmp_path, text, form="", name="a.csv", encoding="utf-8"):
    path = tmp_path / name
    path.write_bytes(text.encode(encoding))
    return imported(path, MAPPING % form)


def fault(tmp_path, text, form="", **how):
    with pytest.raises(InputError) as caught:
        read(tmp_path, text, form, **how)
    assert "\n" not in str(caught.value)
    return str(caught.value).removeprefix(f"{tmp_path}/")


@pytest.mark.parametrize(
    ("text", "form"),
    [
        ("t,q\n0,1\n1,2\n", ""),
        ("t;q\n0;1\n1;2\n", ""),
        ("t\tq\n0\t1\n1\t2\n", ""),
        ("t q\n0   1\n1  2\n", ""),
        ("t  q\n 0   1\n 1  2\n", "delimiter: blank"),
        ('"t","q"\r\n"0","1"\r\n"1","2"\r\n', ""),
        ("made by a logger\n\nt,q\n[s],[rad]\n0,1\n1,2\n", "names_line: 3, first_line: 5"),
        ("t,q\n0,1 # start\n# a pause\n\n1,2\n", ""),
        ("t,q,note\n0,1,one\n1,2,\n", ""),
        ("t|q\n0|1e0\n1|+2.\n", "delimiter: '|'"),
        ("t;q\n0,0;1,0\n1,0;2,0\n", "decimal: ','"),
        ("t,q\n0,1\n1,2\n2,", ""),
        ("\ufefft,q\n0,1\n1,2\n", ""),
        ("# t,q\n0,1\n1,2\n", ""),
    ],
)
def test_tables_in_many_forms(tmp_path, text, form):
    found = read(tmp_path, text, form)
    assert found.stamps[STATE].tolist() == [0, 1_000_000_000]
    assert found.rows[STATE].tolist() == [[1.0], [2.0]]


def test_other_encodings_and_no_names(tmp_path):
    for encoding in ("utf-16", "latin-1"):
        text = "t,q,Größe\n0,1,0\n1,2,0\n"
        found = read(tmp_path, text, f"encoding: {encoding}", encoding=encoding)
        assert found.report.unused == ["Größe"]
    (tmp_path / "b.csv").write_text("0,1\n1,2\n")
    mapping = (MAPPING % "names_line: 0").replace("column: t", "column: '1'")
    found = imported(tmp_path / "b.csv", mapping.replace("column: q", "column: '2'"))
    assert found.rows[STATE].tolist() == [[1.0], [2.0]]


def test_missing_cells_in_many_words(tmp_path):
    text = "t,q\n0,1\n1,\n2,nan\n3,NaN\n4,n/a\n5,  \n6,-\n7,3\n"
    found = read(tmp_path, text, "missing: [n/a, '-']")
    assert found.rows[STATE].tolist() == [[1.0], [3.0]]
    assert found.report.topics[0].left_out.missing == 6


def test_a_last_line_that_is_cut_short_is_reported(tmp_path):
    found = read(tmp_path, "t,q,r\n0,1,2\n1,2,3\n2,5")
    assert "line 4, the last, is cut short and left out" in found.report.notes
    assert "cells are separated by ',', by its first line" in found.report.notes


@pytest.mark.parametrize(
    ("text", "form", "reported"),
    [
        ("", "", f"a.csv: an empty file, {ALLOWED}"),
        ("t,q\n", "", "a.csv: 1 lines, allowed: numbers from line 2 on"),
        (
            "t,q\n0,1\n1,two\n2,3\n",
            "",
            "a.csv: line 3, column 'q': 'two', allowed: a number, nothing, or a text named in"
            " csv.missing",
        ),
        (
            "t,q\n0,1\n1\n2,3\n",
            "",
            "a.csv: line 3: only 1 cells under 2 names (t, q), allowed: one each; csv.short_rows:"
            " fill takes the others as missing",
        ),
        (
            "t,q\n0,1\nnoon,2\n2,3\n",
            "",
            "a.csv: line 3, column 't': 'noon', allowed: a number, or a text with its unit of:"
            " iso8601 (2026-01-31T12:00:00.125), time_of_day (12:00:00.125), dd.mm.yyyy (31.01.2026"
            " 12:00:00.125), mm/dd/yyyy (01/31/2026 12:00:00.125)",
        ),
        (
            't,q,note\n0,1,a\n1,2,"b\n2,3,c\n3,4,d"\n4,5,e\n',
            "",
            "a.csv: line 3: a quote is left open, allowed: one line per row",
        ),
        (
            't,q\n0,1\n1,"2\n2,3\n',
            "",
            "a.csv: line 3: a quote is left open, allowed: one line per row",
        ),
        ("t,q,q\n0,1,2\n", "", "a.csv: column 'q' occurs twice, allowed: each name once"),
        ("t,x\n0,1\n", "", "a.csv: no column 'q', allowed: t, x"),
        ("t,q\n0,1\x01\n", "", f"a.csv: no text, {ALLOWED}"),
    ],
)
def test_damaged_tables(tmp_path, text, form, reported):
    assert fault(tmp_path, text, form) == reported


def test_a_wrong_encoding_is_reported(tmp_path):
    reported = fault(tmp_path, "t,q,Größe\n0,1,2\n", "encoding: utf-8", encoding="latin-1")
    assert reported.startswith("a.csv: no utf-8 text (")
    assert "allowed: as csv.encoding says; programs of Windows often write cp1252" in reported


def test_pieces_of_a_long_table_are_the_whole(tmp_path, monkeypatch):
    monkeypatch.setattr(csv_source, "PIECE", 200)
    values = np.random.default_rng(0).normal(size=500)
    lines = [f"{i},{value!r}" for i, value in enumerate(values.tolist())]
    lines[321] = "321,"
    found = read(tmp_path, "t,q\n" + "\n".join(lines) + "\n")
    assert found.rows[STATE][:, 0].tolist() == np.delete(values, 321).tolist()
    lines[400] = "400,x"
    assert fault(tmp_path, "t,q\n" + "\n".join(lines) + "\n").startswith(
        "a.csv: line 402, column 'q': 'x'"
    )


def mat(tmp_path, content, columns=("t", "q")):
    path = tmp_path / "a.mat"
    savemat(path, content)
    clock, column = columns
    return imported(
        path, (MAPPING % "").replace(": t}", f": '{clock}'}}").replace(": q,", f": '{column}',")
    )


def test_matlab_vectors_structures_cells_and_matrices(tmp_path):
    cell = np.empty(2, dtype=object)
    cell[0], cell[1] = np.arange(3.0), np.array([1.0, 5.0, 2.0])
    for content, names in (
        ({"t": np.arange(3.0), "q": np.array([[1], [5], [2]], dtype=np.int16)}, ("t", "q")),
        ({"d": {"log": {"t": np.arange(3.0), "q": np.array([1.0, 5, 2])}}}, ("d.log.t", "d.log.q")),
        ({"c": cell}, ("c[0]", "c[1]")),
        ({"m": np.array([[0.0, 1.0], [1.0, 5.0], [2.0, 2.0]])}, ("m[0]", "m[1]")),
        ({"m": np.array([[0.0, 1.0, 2.0], [1.0, 5.0, 2.0]])}, ("m[0]", "m[1]")),
    ):
        found = mat(tmp_path, content | {"gain": 3.5}, names)
        assert found.rows[STATE].tolist() == [[1.0], [5.0], [2.0]]
        assert "single numbers in the file: gain = 3.5" in found.report.notes


def test_matlab_files_that_cannot_be_used(tmp_path):
    path = f"{tmp_path}/a.mat"
    with pytest.raises(InputError) as caught:
        mat(tmp_path, {"t": np.arange(3.0), "q": np.arange(4.0)})
    assert str(caught.value) == (
        f"{tmp_path}/mapping.yaml: clocks.pc: 3 times for 4 rows of column 'q', allowed: one each"
    )
    with pytest.raises(InputError) as caught:
        mat(tmp_path, {"gain": 3.5})
    assert str(caught.value) == f"{path}: holds no vector of numbers, allowed: at least one"
    (tmp_path / "a.mat").write_bytes(b"MATLAB 5.0 MAT-file" + bytes(range(200)))
    with pytest.raises(InputError, match=r"a\.mat: no MATLAB file that can be read \("):
        imported(tmp_path / "a.mat", MAPPING % "")


BAG = """
name: rig
clocks: {pc: {%s}}
channels:
  /winches/state: {position/surge: {column: "%s", unit: rad}}
"""


@pytest.fixture
def bag(tmp_path):
    """A ROS 1 bag with a number that has no stamp of its own, and a JointState."""
    number = NOETIC.types["std_msgs/msg/Float64"]
    return ros1_bag(
        tmp_path / "a.bag",
        {"/angle": ("std_msgs/msg/Float64", [(10**9 * i, number(2.0 * i)) for i in range(3)])},
    )


def test_numbers_without_header_have_the_time_of_the_log_or_a_rate(bag):
    found = imported(bag, BAG % ("stamp: log", "/angle:data"))
    assert found.stamps[STATE].tolist() == [0, 10**9, 2 * 10**9]
    assert found.rows[STATE].tolist() == [[0.0], [2.0], [4.0]]
    found = imported(bag, BAG % ("rate: 2.0", "/angle:data"))
    assert found.stamps[STATE].tolist() == [0, 5 * 10**8, 10**9]


@pytest.mark.parametrize(
    ("clock", "column", "reported"),
    [
        (
            "stamp: header",
            "/angle:data",
            "a.bag: /angle: std_msgs/msg/Float64 has no header, allowed: a clock with stamp: log",
        ),
        (
            "stamp: log",
            "/angle:value",
            "a.bag: /angle: std_msgs/msg/Float64 has no number 'value', allowed: a path from data",
        ),
        ("stamp: log", "/speed:data", "a.bag: no topic /speed, allowed: /angle"),
        (
            "stamp: log",
            "data",
            "a.bag: column 'data', allowed: /TOPIC:FIELD, such as /joint_states:position[surge] or"
            " /mocap:pose.position.x",
        ),
        (
            "column: t",
            "/angle:data",
            "mapping.yaml: channels./winches/state.position/surge: clock 'pc' has a column,"
            " allowed: stamp or rate in a bag",
        ),
    ],
)
def test_what_a_bag_has_not(bag, tmp_path, clock, column, reported):
    with pytest.raises(InputError) as caught:
        imported(bag, BAG % (clock, column))
    assert str(caught.value).removeprefix(f"{tmp_path}/") == reported


def test_topics_that_are_left_out_are_named(tmp_path):
    bag = write_rosbag1(tmp_path / "b.bag", clock_messages([0, 1000, 2000]))
    found = imported(bag, BAG % ("stamp: log", "/clock:clock.nanosec"))
    assert "/bar/pose:…" in found.report.unused
    assert "/clock:…" not in found.report.unused


def test_a_missing_file_is_one_line(tmp_path):
    with pytest.raises(InputError) as caught:
        imported(tmp_path / "no.csv", MAPPING % "")
    assert str(caught.value) == (f"{tmp_path}/no.csv: no such file, {ALLOWED}")


def test_a_matlab_file_that_is_cut_short_is_one_line(tmp_path):
    path = tmp_path / "whole.mat"
    savemat(path, {"t": np.arange(50.0), "q": np.arange(50.0)}, do_compression=True)
    content = path.read_bytes()
    for length in range(1, len(content), 37):
        (tmp_path / "a.mat").write_bytes(content[:length])
        with pytest.raises(InputError) as caught:
            imported(tmp_path / "a.mat", MAPPING % "")
        assert "\n" not in str(caught.value)


def test_pieces_of_a_long_bag_are_the_whole(bag, monkeypatch):
    monkeypatch.setattr(bag_source, "PIECE", 2)
    found = imported(bag, BAG % ("stamp: log", "/angle:data"))
    assert found.rows[STATE].tolist() == [[0.0], [2.0], [4.0]]
