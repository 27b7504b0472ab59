"""The command `cspm bundle`: all that repeats a verdict, and nobody's name."""

import json
import zipfile

import numpy as np
import pytest

import cspm as door
from cspm_ident.diagnosis_file import read_diagnosis
from cspm_ident.recording_hash import recording_sha256
from cspm_msgs_py.recording import Recording
from cspm_run.library import find_scenario

SECRET = "hidden_harbour"


@pytest.fixture(scope="module")
def given(tmp_path_factory):
    """A recording of a machine whose name is nobody's business, and a verdict about it."""
    folder = tmp_path_factory.mktemp("given")
    machine = folder / f"{SECRET}.yaml"
    text = door.load_testbed("one_winch").text.replace("name: one_winch", f"name: {SECRET}")
    machine.write_text(f"# of {SECRET}\n{text.replace('verification length', SECRET)}")
    scenario = folder / "scenario.yaml"
    scenario.write_text(
        find_scenario("one_winch").read_text().replace("testbeds/one_winch.yaml", machine.name)
    )
    path = folder / f"{SECRET}_monday"
    door.simulate(scenario, duration=0.05).save(path)
    verdict = folder / "verdict"
    verdict.mkdir()
    (verdict / "diagnosis.json").write_text(json.dumps(verdict_of(path, machine)))
    (verdict / "testbed.improved.yaml").write_text(machine.read_text())
    return path, verdict, machine


def verdict_of(path, machine):
    """A verdict with what every one has."""
    check = {"check": "length", "recording": str(path), "ok": False, "what": f"{path}: short"}
    return {
        "schema": "cspm.diagnosis/1",
        "recordings": [{"path": str(path), "sha256": recording_sha256(path), "role": "search"}],
        "testbed": {"path": str(machine), "sha256": door.load_testbed(machine).sha256},
        "verdict": "not_excited",
        "data_checks": [check | {"remedy": "longer"}],
        **{key: [] for key in ("findings", "not_excited", "fit")},
        "model": None,
    }


def test_a_bundle_repeats_the_numbers_bit_for_bit_and_names_nobody(cspm, tmp_path, given):
    path, verdict, _ = given
    code, out, err = cspm("bundle", path, verdict, "--out", "for_anna.zip")
    assert (code, err) == (0, "")
    assert f"{path} → recording_1" in " ".join(out.split())
    with zipfile.ZipFile(tmp_path / "for_anna.zip") as archive:
        archive.extractall(tmp_path)
    place = tmp_path / "for_anna"
    for file in (each for each in place.rglob("*") if each.is_file()):
        assert SECRET.encode() not in file.read_bytes(), file
        assert str(path.parent).encode() not in file.read_bytes(), file
    with Recording(path) as before, Recording(place / "recording_1") as after:
        assert {"/winches/state", "/truth/winches/state"} <= set(after.topics)
        assert "/diagnostics" not in after.topics
        for name in after.topics:
            for ours, theirs in zip(before.rows(name), after.rows(name), strict=True):
                assert np.array_equal(ours, theirs)
        assert set(after.attachments) == {"scenario.yaml", "testbed.yaml"}
        assert SECRET not in str((after.attachments, after.metadata))
    found = read_diagnosis(place)
    assert found.recordings[0].path == found.data_checks[0].recording == "recording_1"
    assert found.data_checks[0].what == "recording_1: short"
    assert found.recordings[0].sha256 == recording_sha256(place / "recording_1")
    assert found.testbed.sha256 == door.load_testbed(place / "testbed.yaml").sha256
    files = given[2], place / "testbed.yaml"
    ours, theirs = (door.load_testbed(each).description for each in files)
    assert ours.model_copy(update={"name": "machine"}) == theirs
    command = "cspm diagnose recording_1 --testbed testbed.yaml --out repeated"
    assert command in (place / "README.txt").read_text()


def test_what_does_not_belong_to_the_verdict_is_refused(cspm, refused, tmp_path, given):
    path, verdict, _ = given
    other = tmp_path / "other"
    door.simulate("one_winch", duration=0.02).save(other)
    assert f"{other}: not of the verdict, allowed: {path}" in refused(
        "bundle", path, other, verdict, "--out", "a.zip"
    )
    line = refused("bundle", path, verdict, "--testbed", "wrong.yaml", "--out", "a.zip")
    assert "wrong.yaml: no such file" in line
    (tmp_path / "a.zip").write_text("")
    assert "--out a.zip: already exists" in refused("bundle", path, verdict, "--out", "a.zip")
