"""`cspm check`: what looks wrong in recordings and logs, and the mapping that mends it."""

import json
import sys
from functools import cache
from unittest import mock

import numpy as np
import pytest
from import_samples import ONE_WINCH
from machine_logs import BAR, CELLS, STATE, healthy
from run_samples import SCENARIOS

import cspm
from cspm.cli import main as cli

TESTBED = SCENARIOS / "testbeds" / "suspended_four.yaml"


@pytest.fixture
def check(capsys):
    """Return what runs the command, and returns its exit code and what it wrote."""

    def run(*arguments):
        words = ["cspm", "check", *map(str, arguments)]
        with mock.patch.object(sys, "argv", words), pytest.raises(SystemExit) as ended:
            cli.main()
        captured = capsys.readouterr()
        return ended.value.code, captured.out + captured.err

    return run


@cache
def columns():
    """Return the table of a healthy machine, at the rate of its camera."""
    log = healthy()[0]
    stamps = log[BAR].stamp_ns
    found = {"t": stamps * 1e-9}
    for topic in (STATE, CELLS, BAR):
        rows = np.searchsorted(log[topic].stamp_ns, stamps).clip(max=len(log[topic].table) - 1)
        for name, column in zip(log[topic].topic.fields, log[topic].table[rows].T, strict=True):
            found[f"{topic} {name}"] = column
    return found


def written(folder, exchanged=()):
    """Write the table with some columns exchanged, and the mapping of one in which none is."""
    table = dict(columns())
    for one, other in exchanged:
        table[one], table[other] = table[other], table[one]
    path = folder / "lab.csv"
    np.savetxt(
        path,
        np.column_stack([*table.values()]),
        delimiter=",",
        header=",".join(table),
        comments="",
    )
    units = {"position": "rad", "velocity": "rad/s", "effort": "N·m", "x": "m", "y": "m", "z": "m"}
    lines = ["name: lab", "clocks: {pc: {column: t}}", "channels:"]
    for topic in (STATE, CELLS, BAR):
        lines.append(f"  {topic}:")
        for name in healthy()[0][topic].topic.fields:
            unit = "N" if topic == CELLS else units.get(name.partition("/")[0], "1")
            lines.append(f'    {name}: {{column: "{topic} {name}", unit: "{unit}"}}')
    (folder / "lab.yaml").write_text("\n".join(lines))
    return path, folder / "lab.yaml"


def test_a_log_is_mended_by_the_mapping_that_it_writes(check, tmp_path):
    names = healthy()[1].cable_names
    pair = (f"{STATE} position/{names[0]}", f"{STATE} position/{names[2]}")
    speeds = (f"{STATE} velocity/{names[0]}", f"{STATE} velocity/{names[2]}")
    path, mapping = written(tmp_path, (pair, speeds, (f"{BAR} y", f"{BAR} y")))
    mended, page, data = (tmp_path / name for name in ("mended.yaml", "page.html", "found.json"))
    code, output = check(
        path,
        *("--mapping", mapping, "--testbed", TESTBED, "--fix", mended),
        *("--page", page, "--json", data),
    )
    assert code == 1, output
    assert f"channels.{STATE}.position/{names[0]}: as position/{names[2]} was" in output
    assert "exchanged" in page.read_text()
    written_data = json.loads(data.read_text())
    assert not written_data["ok"]
    assert "exchanged" in {one["kind"] for one in written_data["suspicions"]}
    assert "exchanged" not in check(path, "--mapping", mended, "--testbed", TESTBED)[1]


def test_a_recording_in_which_nothing_looks_wrong_is_fine(check, tmp_path):
    cspm.simulate("suspended_four", seed=5, duration=14.0).save(tmp_path / "run")
    code, output = check(tmp_path / "run")
    assert (code, "nothing looks wrong" in output) == (0, True), output
    assert "/bar/pose: 14000 messages" in output or "/bar/pose: 1400 messages" in output


@pytest.mark.parametrize(
    ("arguments", "reported"),
    [
        (("nowhere",), "nowhere"),
        (("a.csv", "--mapping", "emps"), "--mapping: without --testbed"),
        (("a.csv", "--fix", "b.yaml"), "--fix b.yaml: without --mapping"),
        (("a.csv", "--page", ONE_WINCH), "already exists, allowed: a new file"),
    ],
)
def test_what_cannot_be_checked_is_one_line(check, arguments, reported):
    code, output = check(*arguments)
    assert code == 2
    assert reported in output
    assert output.count("\n") == 1
