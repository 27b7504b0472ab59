"""What every command has: quiet, help by -h, data on standard output, exit codes in its help."""

import json
import os
import subprocess
import sys

import pytest


def test_every_command_has_the_same_options_and_names_its_exit_codes(cspm, commands):
    assert {("view",), ("demo",), ("analyze", "linear"), ("identify", "winch")} <= set(commands)
    for words in commands:
        code, out, err = cspm(*words, "-h")
        assert (code, err) == (0, ""), words
        for part in ("--quiet", "-h", "Exit code"):
            assert part in out, words
        assert "--json" in out or words in (("node",), ("urdf",)), words
        assert "BAG" not in out, words


@pytest.mark.parametrize("flag", ["-q", "--quiet"])
def test_quiet_prints_nothing_and_the_next_command_prints_again(cspm, tmp_path, flag):
    words = ("run", "rest", "--duration", "0.05", "--no-record")
    assert cspm(*words, flag) == (0, "", "")
    code, out, _ = cspm(*words)
    assert code == 0
    assert "tensions" in out


def test_errors_are_printed_though_quiet(refused):
    assert refused("info", "nowhere", "--quiet") == "nowhere: no such file or folder"


@pytest.mark.parametrize("more", [(), ("--quiet",)])
def test_data_on_standard_output_are_alone_there(cspm, tmp_path, more):
    words = ("run", "rest", "--duration", "0.05", "--no-record", "--json", "-")
    code, out, err = cspm(*words, *more)
    assert code == 0
    assert json.loads(out)["scenario"] == "rest"
    assert ("tensions" in err) is (not more)
    assert not (tmp_path / "-").exists()


def test_a_run_names_the_next_command(cspm, tmp_path):
    code, out, _ = cspm("run", "rest", "--duration", "0.05", "--out", "my run")
    assert code == 0
    assert "next: cspm view 'my run'" in out


@pytest.mark.parametrize(("columns", "framed"), [("60", False), ("80", False), ("120", True)])
def test_help_has_frames_only_where_there_is_room(columns, framed):
    found = subprocess.run(
        [sys.executable, "-m", "cspm", "run", "--help"],
        env=os.environ | {"COLUMNS": columns},
        capture_output=True,
        text=True,
        check=True,
    )
    assert ("│" in found.stdout) is framed
    lines = found.stdout.splitlines()
    assert max(map(len, lines)) <= int(columns)
    (first,) = (line for line in lines if "How to run" in line)
    assert len(first[first.index("How to run") :].rstrip(" │")) >= 20


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["run", "nowhere"], "cspm run: nowhere: no such scenario, allowed: "),
        (["identify", "winch", "nowhere"], "cspm identify winch: nowhere: no such file or folder"),
        # A line that names its command itself names it once.
        (
            ["diagnose"],
            "cspm diagnose: no recording, allowed: one or more, --explain EFFECT or --plan"
            " SCENARIO",
        ),
    ],
)
def test_an_error_begins_with_the_whole_command(cspm, words, line):
    code, _, err = cspm(*words)
    assert code == 2
    assert err.startswith(line)
