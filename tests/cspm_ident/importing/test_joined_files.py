"""Two files of one experiment, joined by their times."""

from hashlib import sha256

import numpy as np
import pytest
from import_samples import NOETIC, imported, ros1_bag, table

from cspm_ident.importing.sources.joined_source import file_of
from cspm_msgs_py.errors import InputError

STATE, TENSION = "/winches/state", "/cables/tension"
T, CELL_T = np.arange(300) / 100, np.arange(70) / 25
MAPPING = """
name: rig
files: {cells: {path: cells.csv, csv: {delimiter: ";"}}}
clocks:
  drive: {column: t}
  cell: {column: "cells:ms", unit: ms, offset: 0.02}
channels:
  /winches/state: {position/surge: {column: q, unit: rad}}
  /cables/tension: {effort/surge: {column: "cells:load", unit: N}}
"""


def files(folder, *, later=0.0):
    """A drive at 100 Hz, and a load cell at 25 Hz with a clock in ms."""
    cells = {"ms": 1e3 * (CELL_T + later), "load": 20.0 + np.cos(CELL_T), "spare": 0.0 * CELL_T}
    table(folder / "cells.csv", cells, delimiter=";")
    return table(folder / "lab.csv", {"t": T, "q": np.sin(T), "u": np.cos(T)})


def fault(path, old, new):
    assert old in MAPPING
    with pytest.raises(InputError) as caught:
        imported(path, MAPPING.replace(old, new))
    assert "\n" not in str(caught.value)
    return str(caught.value).replace(f"{path.parent}/", "")


def test_each_file_keeps_its_rows_and_its_instants(tmp_path):
    found = imported(files(tmp_path), MAPPING)
    assert found.stamps[STATE].tolist() == [10_000_000 * i for i in range(300)]
    assert found.stamps[TENSION].tolist() == [40_000_000 * i + 20_000_000 for i in range(70)]
    np.testing.assert_array_equal(found.rows[STATE][:, 0], np.sin(T))
    np.testing.assert_array_equal(found.rows[TENSION][:, 0], 20.0 + np.cos(CELL_T))
    assert found.report.unused == ["u", "cells:spare"]
    assert found.report.kind == "text table, cells: text table"
    digest = sha256((tmp_path / "cells.csv").read_bytes()).hexdigest()
    assert found.report.about["files_sha256"] == f"cells: cells.csv {digest}"


def test_one_file_has_no_entry_of_others(tmp_path):
    text = MAPPING.replace("files:", "description: alone #").replace("  cell:", "  #")
    found = imported(files(tmp_path), text[: text.index("  /cables")])
    assert "files_sha256" not in found.report.about


def test_a_line_per_drive_in_the_other_file(tmp_path):
    path = files(tmp_path)
    rows = {"ms": np.repeat(1e3 * CELL_T, 2), "id": np.tile([7.0, 9.0], 70)}
    rows["load"] = np.where(rows["id"] == 9.0, 30.0 + rows["ms"], 0.0)
    table(tmp_path / "cells.csv", rows, delimiter=";")
    found = imported(path, MAPPING.replace("cells:load", "cells:load[id=9]"))
    np.testing.assert_array_equal(found.rows[TENSION][:, 0], 30.0 + 1e3 * CELL_T)
    assert found.report.unused == ["u"]


def test_files_that_do_not_overlap_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"begins 997\.03 s after the end of /winches/state"):
        imported(files(tmp_path, later=1000.0), MAPPING)


def test_what_does_not_fit_is_refused(tmp_path):
    path = files(tmp_path)
    assert fault(path, "path: cells.csv", "path: none.csv").startswith("none.csv: no such file")
    assert fault(path, "cells:load", "cells:lood").startswith("cells.csv: no column 'lood'")
    assert fault(path, "unit: rad}", "unit: rad, clock: cell}") == (
        "mapping.yaml: channels./winches/state.position/surge: clock 'cell' is of another file than"
        " column 'q', allowed: a clock of its own file"
    )
    assert fault(path, "cells:ms", "u") == (
        "mapping.yaml: channels./cables/tension.effort/surge: no clock of file 'cells', allowed:"
        " one whose column is in the channel's own file"
    )
    assert fault(path, "column: q,", 'column: "cells:load",').startswith(
        "lab.csv: the mapping takes no column of it, allowed: at least one of t, q, u"
    )


def test_bags_are_not_joined(tmp_path):
    path = files(tmp_path)
    number = NOETIC.types["std_msgs/msg/Float64"](1.0)
    bag = ros1_bag(tmp_path / "cells.bag", {"/load": ("std_msgs/msg/Float64", [(1, number)])})
    assert fault(path, "path: cells.csv", "path: cells.bag") == (
        "mapping.yaml: files.cells.path: a bag, allowed: a table"
    )
    with pytest.raises(InputError, match=r"mapping\.yaml: files: beside a bag, allowed: beside a"):
        imported(bag, MAPPING)


def test_the_file_of_a_column():
    assert [file_of(each, {"cells"}) for each in ("cells:a", "a", "time:s", "cells")] == [
        "cells",
        "",
        "",
        "",
    ]
