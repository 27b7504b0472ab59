"""`cspm import` as people and programs see it."""

import hashlib
import json
import sys

import numpy as np
import pytest
from error_lines import said
from import_samples import ONE_WINCH, table
from run_samples import recorded

from cspm.cli import main as cli
from cspm_ident.importing import write
from cspm_msgs_py.recording import Recording

STATE, TENSION = "/winches/state", "/cables/tension"
MAPPING = """
name: lab
clocks:
  drive: {column: t}
  cell: {rate: 250}
channels:
  /cables/tension:
    effort/surge: {column: F, unit: kN, clock: cell}
  /winches/state:
    position/surge: {column: q, unit: deg}
    velocity/surge: {column: v, unit: rpm}
"""


@pytest.fixture
def lab(monkeypatch, capsys, tmp_path):
    """Import a table of 2 s whose velocity has the wrong sign; return exit code, out and err."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "160")
    t = np.arange(2000) * 1e-3
    columns = {
        "t": t,
        "q": np.degrees(np.sin(t)),
        "v": -np.cos(t) * 30 / np.pi,
        "F": 0.02 + 0.001 * np.sin(t),
    }
    table(tmp_path / "lab.csv", columns)
    (tmp_path / "lab.yaml").write_text(MAPPING)

    def call(*arguments, source="lab.csv", mapping="lab.yaml"):
        line = ["cspm", "import", source, "--mapping", mapping, "--testbed", ONE_WINCH, *arguments]
        monkeypatch.setattr(sys, "argv", list(map(str, line)))
        with pytest.raises(SystemExit) as caught:
            cli.main()
        out, err = capsys.readouterr()
        return caught.value.code or 0, out, err

    return call


def test_a_trial_shows_everything_and_writes_nothing(lab, tmp_path):
    before = sorted(tmp_path.iterdir())
    code, out, err = lab("--dry-run")
    assert (code, err) == (0, "")
    assert sorted(tmp_path.iterdir()) == before
    text = " ".join(out.split())
    sha = hashlib.sha256((tmp_path / "lab.csv").read_bytes()).hexdigest()
    assert f"lab.csv, text table, SHA-256 {sha}" in text
    assert "/winches/state: 2000 messages from 0 s to 1.999 s, 1000 Hz, steps 1 to 1 ms" in text
    assert "/cables/tension: 2000 messages from 0 s to 7.996 s, 250 Hz" in text
    assert "0.0174532925 rad/deg · raw" in text
    assert "q raw 0 0.0572957" in text
    assert "position/surge [rad] 0 0.001 0.002 0.003 0.00399999" in text
    assert (
        "suspicion: /winches/state velocity/surge: velocity does not integrate to position: factor"
        " 1, sign −" in text
    )
    assert text.endswith("trial: nothing was written")


def test_the_recording_carries_where_it_comes_from(lab, tmp_path):
    code, out, err = lab("--out", "bag", "--json", "reported.json")
    assert (code, err) == (0, "")
    assert "factor 1, sign −" in out
    assert "recording bag: 4000 messages" in out
    rows = recorded(tmp_path / "bag")
    assert list(rows) == [TENSION, STATE]
    t = np.arange(2000) * 1_000_000
    assert np.array_equal(rows[STATE].stamp_ns, t)
    assert np.array_equal(rows[STATE].log_ns, t)
    assert np.array_equal(rows[TENSION].stamp_ns, 4 * t)
    np.testing.assert_allclose(rows[STATE].rows[:, 0], np.sin(t * 1e-9), rtol=1e-12)
    with Recording(tmp_path / "bag") as recording:
        about, files = recording.metadata["cspm"], recording.attachments
        assert recording.topic(STATE).parts == ("position", "velocity")
    sha = hashlib.sha256((tmp_path / "lab.csv").read_bytes()).hexdigest()
    assert (about["source"], about["source_sha256"], about["mode"]) == ("lab.csv", sha, "import")
    assert about["mapping_sha256"] == hashlib.sha256(MAPPING.encode()).hexdigest()
    assert about["testbed_sha256"] == hashlib.sha256(ONE_WINCH.read_bytes()).hexdigest()
    assert files["mapping.yaml"] == MAPPING.encode()
    assert files["testbed.yaml"] == ONE_WINCH.read_bytes()
    reported = json.loads((tmp_path / "reported.json").read_text())
    assert reported["recording"] == "bag"
    assert reported["messages"] == {TENSION: 2000, STATE: 2000}
    assert reported["about"]["source_sha256"] == sha
    assert {one["kind"] for one in reported["suspicions"]} == {"velocity", "smoothed"}
    assert reported["topics"][1]["fields"][0]["converted"][1] == pytest.approx(np.sin(1e-3))
    assert b"source_sha256: " + sha.encode() in files["import.yaml"]


def test_info_says_what_was_imported(lab, monkeypatch, capsys):
    lab("--out", "bag")
    monkeypatch.setattr(sys, "argv", ["cspm", "info", "bag"])
    with pytest.raises(SystemExit):
        cli.main()
    out = capsys.readouterr().out
    assert "imported from lab.csv (SHA-256 " in out
    assert "mapping lab, test-bed one_winch" in out


def test_without_a_folder_it_goes_to_the_recordings(lab, tmp_path):
    code, _, _ = lab()
    assert code == 0
    folders = list((tmp_path / "recordings").iterdir())
    assert [folder.name.startswith("lab-") for folder in folders] == [True]


def test_what_cannot_be_done_is_one_line_and_leaves_nothing(lab, tmp_path):
    (tmp_path / "there").mkdir()
    bad = {
        "bad.yaml": MAPPING.replace("unit: deg", "unit: grad"),
        "late.yaml": MAPPING.replace("column: t}", "column: F, disorder: refuse}"),
    }
    for name, text in bad.items():
        (tmp_path / name).write_text(text)
    before = sorted(tmp_path.iterdir())
    for arguments, how, reported in (
        (["--out", "there"], {}, "there: already exists, allowed: a new folder"),
        (["--out", "b", "--dry-run"], {}, "--out b --dry-run: allowed: one of both"),
        (["--out", "b"], {"source": "no.csv"}, "no.csv: no such file, allowed: a text table"),
        (
            ["--out", "b"],
            {"mapping": "lab"},
            "lab: no such mapping, allowed: bam, emps, joint_log or a file",
        ),
        (["--out", "b"], {"mapping": "no.yaml"}, "no.yaml: no such file, allowed: a mapping file"),
        (
            ["--out", "b"],
            {"mapping": "bad.yaml"},
            "bad.yaml: channels./winches/state.position/surge.unit: unit 'grad', allowed: rad,",
        ),
        (
            ["--out", "b"],
            {"mapping": "late.yaml"},
            "lab.csv: column 'F' is clock and channel, allowed: one of both",
        ),
    ):
        code, _, err = lab(*arguments, **how)
        assert (code, err.count("\n")) == (2, 1)
        assert said(err).startswith(reported)
    assert sorted(tmp_path.iterdir()) == before


def test_a_failure_while_writing_leaves_no_half_recording(lab, tmp_path, monkeypatch):
    def fail(*_):
        raise OSError(28, "No space left on device", "bag")

    monkeypatch.setattr(write, "_append", fail)
    code, _, err = lab("--out", "bag")
    assert (code, err) == (1, "cspm import: bag: No space left on device\n")
    assert not (tmp_path / "bag").exists()


def test_topics_stand_side_by_side_in_time_however_they_are_cut(lab, tmp_path, monkeypatch):
    monkeypatch.setattr(write, "PIECE", 7)
    lab("--out", "small")
    monkeypatch.setattr(write, "PIECE", 10_000)
    lab("--out", "large")
    small, large = recorded(tmp_path / "small"), recorded(tmp_path / "large")
    for name, rows in large.items():
        assert np.array_equal(small[name].stamp_ns, rows.stamp_ns)
        assert np.array_equal(small[name].rows, rows.rows)
