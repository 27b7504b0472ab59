"""Recordings of others, fetched from a publisher that a server on loopback stands in for."""

import csv
import hashlib
import json
import sys
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import pytest
from error_lines import said
from scipy.io import savemat

from cspm.cli import main as cli
from cspm.open_data import source as sources
from cspm.open_data.download import cache_folder
from cspm.open_data.source import MACHINES, Table
from cspm.open_data.tables import make_table
from cspm_ident.importing.mapping import load_mapping
from cspm_msgs_py.testbed import load_testbed
from cspm_msgs_py.yaml_file import dump_yaml

SHARED = Path(__file__).resolve().parents[4] / "shared" / "data" / "open"
LICENCE, TEXT = b"Use it as you like.\n" * 30, b"time,position\n" + b"0.0,1.0\n" * 40_000


class Publisher:
    """A server that counts, cuts answers off, and may know nothing of ranges."""

    def __init__(self, files):
        self.files, self.asked = files, []
        self.cut, self.knows_ranges = None, True
        publisher = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self):
                publisher.answer(self)

            def log_message(self, *_):
                pass

        self.server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.address = f"http://127.0.0.1:{self.server.server_port}"
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def answer(self, request):
        name = unquote(request.path).rpartition("/")[2]
        wanted = request.headers["Range"]
        self.asked.append((name, wanted))
        if name not in self.files:
            request.send_error(404)
            return
        first = int(wanted[6:-1]) if wanted and self.knows_ranges else 0
        body = self.files[name][first:]
        request.send_response(206 if first else 200)
        request.send_header("Content-Length", str(len(body)))
        request.end_headers()
        request.wfile.write(body[: self.cut])


@pytest.fixture
def publisher():
    made = Publisher({"LICENSE": LICENCE, "data.csv": TEXT})
    yield made
    made.server.shutdown()
    made.server.server_close()


@pytest.fixture
def get(publisher, monkeypatch, capsys, tmp_path):
    """Call `cspm data`; return exit code, out and err. The list has one source of two files."""
    paths = {"LICENSE": LICENCE, "some data/data.csv": TEXT}
    files = [
        {"path": p, "bytes": len(b), "sha256": hashlib.sha256(b).hexdigest()}
        for p, b in paths.items()
    ]
    table = {"name": "ddp.csv", "source": "some data/data.csv", "make": "as_it_is"}
    small = {
        "title": "a pendulum",
        "folder": "pendulum",
        "repository": "lab/data",
        "commit": "c0ffee",
        "licence": "CC0-1.0",
        "licence_file": "LICENSE",
        "citation": "A. Nobody, 2020",
        "files": files,
        "tables": [table | {"sha256": files[1]["sha256"]}],
        "machines": [
            {
                "testbed": "pendulum.yaml",
                "known": "pendulum_known.yaml",
                "mapping": "pendulum_mapping.yaml",
                "tables": ["ddp.csv"],
            }
        ],
    }
    (tmp_path / "list.yaml").write_text(dump_yaml({"dfki_pendulum": small}))
    monkeypatch.setattr(sources, "_LIST", tmp_path / "list.yaml")
    return caller(monkeypatch, capsys, tmp_path)


def caller(monkeypatch, capsys, folder):
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder / "cache"))
    monkeypatch.setenv("COLUMNS", "160")
    monkeypatch.chdir(folder)

    def call(*arguments):
        monkeypatch.setattr(sys, "argv", ["cspm", "data", *map(str, arguments)])
        with pytest.raises(SystemExit) as caught:
            cli.main()
        out, err = capsys.readouterr()
        return caught.value.code or 0, out, err

    return call


def test_what_is_fetched_comes_with_licence_citation_and_machine(get, publisher, tmp_path):
    code, out, _ = get("get", "dfki_pendulum", "--mirror", publisher.address, "--json", "got.json")
    assert code == 0
    assert "licence CC0-1.0" in out
    assert "A. Nobody, 2020" in out
    folder = tmp_path / "open_data" / "pendulum"
    assert (folder / "ddp.csv").read_bytes() == TEXT
    assert (folder / "LICENSE").read_bytes() == LICENCE
    assert "A. Nobody" in (folder / "source.yaml").read_text()
    assert load_testbed(folder / "pendulum.yaml").testbed.name == "dfki_pendulum"
    assert json.loads((tmp_path / "got.json").read_text())["licence"] == "CC0-1.0"
    # Again: what is there is left alone, and another folder is filled from the cache.
    asked = len(publisher.asked)
    assert "already there" in get("get", "dfki_pendulum", "--mirror", publisher.address)[1]
    assert get("get", "dfki_pendulum", "--mirror", publisher.address, "--out", "more")[0] == 0
    assert (tmp_path / "more" / "ddp.csv").read_bytes() == TEXT
    assert len(publisher.asked) == asked == 2


@pytest.mark.parametrize("knows_ranges", [True, False])
def test_what_was_cut_off_goes_on_where_it_was(get, publisher, tmp_path, knows_ranges):
    publisher.cut, publisher.knows_ranges = 70_000, knows_ranges
    code, _, err = get("get", "dfki_pendulum", "--mirror", publisher.address)
    assert code == 1
    assert "ended 250014 bytes early; what came is kept" in said(err)
    assert not (tmp_path / "open_data").exists()
    publisher.cut = None
    assert get("get", "dfki_pendulum", "--mirror", publisher.address)[0] == 0
    assert publisher.asked[-1] == ("data.csv", "bytes=70000-")
    assert (tmp_path / "open_data" / "pendulum" / "ddp.csv").read_bytes() == TEXT
    assert not list(cache_folder().glob("*.part"))


@pytest.mark.parametrize("other", [TEXT[:-1] + b"9", TEXT + b"and more"])
def test_another_file_than_the_pinned_one_is_refused(get, publisher, tmp_path, other):
    publisher.files["data.csv"] = other
    code, _, err = get("get", "dfki_pendulum", "--mirror", publisher.address)
    assert code == 2
    assert f"allowed: {hashlib.sha256(TEXT).hexdigest()}" in said(err)
    assert not (tmp_path / "open_data").exists()
    publisher.files["data.csv"] = TEXT
    assert get("get", "dfki_pendulum", "--mirror", publisher.address)[0] == 0


def test_what_is_lacking_is_one_line(get, publisher, tmp_path):
    del publisher.files["data.csv"]
    code, _, err = get("get", "dfki_pendulum", "--mirror", publisher.address)
    assert code == 1
    assert "some%20data/data.csv: answers 404" in said(err)
    code, _, err = get("get", "pendulum")
    assert code == 2
    assert said(err).startswith("pendulum: no such recordings, allowed: ")
    (tmp_path / "mine").mkdir()
    code, _, err = get("get", "dfki_pendulum", "--from", "mine")
    assert code == 2
    assert said(err).startswith("--from mine: no LICENSE of SHA-256 ")
    code, _, err = get("get", "dfki_pendulum", "--mirror", publisher.address, "--out", "mine")
    assert code == 2
    assert said(err).startswith("mine: already exists, allowed: ")


def test_a_folder_that_has_the_published_files_needs_no_network(get, publisher, tmp_path):
    there = tmp_path / "there" / "deep"
    there.mkdir(parents=True)
    (there / "LICENSE").write_bytes(LICENCE)
    (there / "data.csv").write_bytes(TEXT[:-1])
    assert get("get", "dfki_pendulum", "--from", tmp_path / "there")[0] == 2
    (there / "ddp.csv").write_bytes(TEXT)
    assert get("get", "dfki_pendulum", "--from", tmp_path / "there")[0] == 0
    assert (tmp_path / "open_data" / "pendulum" / "ddp.csv").read_bytes() == TEXT
    assert publisher.asked == []


def test_every_machine_of_the_list_can_be_read_and_is_for_tables_that_there_are():
    for name, source in sources.sources().items():
        assert any(file.path == source.licence_file for file in source.files)
        made = {table.name for table in source.tables}
        assert {table.source for table in source.tables} < {file.path for file in source.files}
        for machine in source.machines:
            assert {*machine.tables} <= made
            load_testbed(MACHINES / name / machine.testbed)
            assert load_testbed(MACHINES / name / machine.known).testbed.effects
            load_mapping(MACHINES / name / machine.mapping)
    machines = [m for source in sources.sources().values() for m in source.machines]
    named = {name for m in machines for name in (m.testbed, m.known, m.mapping)}
    assert len(named) == sum(1 for _ in MACHINES.glob("*/*.yaml"))


@pytest.mark.parametrize("name", sources.sources())
def test_copies_that_are_there_are_taken(name, monkeypatch, capsys, tmp_path):
    if not SHARED.is_dir():
        pytest.skip("no copies of the published recordings: they are no part of the project")
    call = caller(monkeypatch, capsys, tmp_path)
    code, out, err = call("get", name, "--from", SHARED)
    assert code == 0, err
    source = sources.source_of(name)
    assert source.citation in out
    for table in source.tables:
        assert (tmp_path / "open_data" / source.folder / table.name).stat().st_size > 10_000


def test_an_axis_of_a_robot_is_taken_from_its_structure(tmp_path):
    fields = ("act_pos_mot_deg", "act_vel_mot_deg_per_s", "act_torque_abs_nm", "ref_pos_deg")
    values = np.random.default_rng(0).normal(size=(4, 6, 50))
    record = dict(zip(fields, values, strict=True)) | {"time_disc": np.arange(1.0, 51.0)}
    savemat(tmp_path / "data.mat", {"rec": record})
    table = Table(name="A_4.csv", source="data.mat", make="kuka_axis", axis=4, sha256="")
    make_table(table, tmp_path / "data.mat", tmp_path / "A_4.csv")
    assert (tmp_path / "A_4.csv").read_text().splitlines()[
        0
    ] == "t,pos_deg,vel_deg_s,torque_nm,ref_deg"
    found = np.loadtxt(tmp_path / "A_4.csv", delimiter=",", skiprows=1)
    assert found == pytest.approx(np.vstack([np.arange(1.0, 51.0), values[:, 3]]).T, abs=1e-5)


def test_torque_and_angle_of_the_kites_drum_follow_from_speed_and_power(tmp_path):
    """The first two rows are the publisher's; the last is too slow for a torque."""
    head = "time,ground_tether_reelout_speed,ground_mech_power,ground_tether_force"
    rows = [
        "1570532184.5,-3.05133,-11167.5,92.6309",
        "1570532184.6,-3.1034200000000003,-12521.1,92.8112",
    ]
    (tmp_path / "raw.csv").write_text("\n".join([head, *rows, "1570532184.7,0.2,10,93"]) + "\n")
    table = Table(name="winch.csv", source="raw.csv", make="kite_winch", sha256="")
    make_table(table, tmp_path / "raw.csv", tmp_path / "winch.csv")
    with (tmp_path / "winch.csv").open(newline="") as file:
        first, second, slow = csv.DictReader(file)
    assert float(first["torque"]) == pytest.approx(914.969865599591)
    assert float(second["angle"]) == pytest.approx(-1.2309488260746)
    assert float(second["t"]) == 0.1
    assert float(second["force_kg"]) == 92.8112
    assert slow["torque"] == ""
