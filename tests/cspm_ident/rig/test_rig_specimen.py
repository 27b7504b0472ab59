"""Cables of rigs, read from recordings."""

import hashlib
import re

import numpy as np
import pytest
from machines import THESIS, point_content
from rig_samples import record
from run_samples import bundle_of

from bench.accuracy.rig_cables import SpecimenTruth, multisine
from cspm_ident.recording_hash import recording_sha256
from cspm_ident.rig.specimen import read_specimens
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import load_testbed, parse_testbed
from cspm_msgs_py.yaml_file import dump_yaml
from cspm_run.recorded_run import run

TRUTH = SpecimenTruth()
SAMPLES = [
    multisine(TRUTH, length, seed=1, duration=0.5, label=name)
    for length, name in ((1.25, "short"), (3.5, "long"))
]


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    return record(tmp_path_factory.mktemp("rig") / "bag", SAMPLES)


def line_of(*arguments):
    with pytest.raises(InputError) as caught:
        read_specimens(*arguments)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_a_recording_comes_back_as_it_was_made(bag):
    found = read_specimens([bag])
    assert [one.label for one in found] == ["short", "long"]
    for made, read in zip(SAMPLES, found, strict=True):
        # The encoder began at 7 rad; what counts is what was wound since.
        np.testing.assert_allclose(read.wound, made.wound, atol=1e-12)
        np.testing.assert_allclose(read.rate, made.rate, atol=1e-12)
        np.testing.assert_allclose(read.tension, made.tension, atol=1e-12)
        np.testing.assert_allclose(read.time, made.time, atol=1e-9)
        assert read.length == made.distance
        assert read.window == (0.0, pytest.approx(0.499))
        assert read.period == pytest.approx(1e-3)


def test_the_hash_is_that_of_the_mcap_file(bag):
    file = next(bag.glob("*.mcap"))
    digest = hashlib.sha256(file.read_bytes()).hexdigest()
    assert recording_sha256(bag) == recording_sha256(file) == digest
    # What lies beside it does not count.
    (bag / "notes.txt").write_text("a picture, a summary")
    assert recording_sha256(bag) == digest
    assert {one.sha256 for one in read_specimens([bag])} == {digest}


def test_cables_of_one_name_are_distinguished_by_their_recordings(tmp_path, bag):
    other = record(tmp_path / "again", SAMPLES[:1])
    found = read_specimens([bag, other])
    assert [one.label for one in found] == ["bag:short", "long", "again:short"]
    assert [one.label for one in read_specimens([bag], None, ["long"])] == ["long"]


def test_the_rig_of_the_library_is_read(tmp_path):
    run(bundle_of("rig_damping_surge"), tmp_path / "run", steps=50)
    found = read_specimens([tmp_path / "run"])
    assert [one.length for one in found] == [1.25, 2.10, 3.00, 3.50, 1.80]
    assert all(one.cable.gear_ratio == 1.0 for one in found)


def test_sensors_of_two_rates_meet_on_the_slower(tmp_path):
    slow = record(
        tmp_path / "slow", SAMPLES, keep=lambda n, k: n != "/cables/tension" or k % 4 == 0
    )
    found = read_specimens([slow])
    assert found[0].period == pytest.approx(4e-3)
    np.testing.assert_allclose(found[0].tension, SAMPLES[0].tension[::4], atol=1e-12)
    np.testing.assert_allclose(found[0].wound, SAMPLES[0].wound[: 4 * 125 : 4], atol=1e-12)


def test_holes_are_reported(tmp_path):
    holed = record(tmp_path / "holed", SAMPLES, keep=lambda n, k: not 200 <= k < 220)
    assert line_of([holed]) == (
        f"{holed}: /winches/state: a gap of 0.021 s at 0.199 s, allowed: at most 0.005 s"
    )
    few = record(tmp_path / "few", SAMPLES, keep=lambda n, k: k == 0)
    assert line_of([few]).startswith(f"{few}: /winches/state, allowed: at least two messages")
    apart = record(
        tmp_path / "apart", SAMPLES, keep=lambda n, k: (n == "/winches/state") == (k < 200)
    )
    assert line_of([apart]).endswith("share no time, allowed: both at once")


def test_other_machines_and_recordings_are_refused(tmp_path, bag):
    assert line_of([bag], None, ["longer"]) == (
        "--cables longer: no such cable, allowed: long, short"
    )
    assert line_of([tmp_path / "nothing"]).endswith("nothing: no such file or folder")
    assert line_of([bag], load_testbed(THESIS)) == (
        f"{bag}: thesis has a bar or a winch frame, allowed: cables fixed in the world"
    )
    point = parse_testbed(dump_yaml(point_content()), "point.yaml")
    assert "point has a bar" in line_of([bag], point)
    bare = record(tmp_path / "bare", SAMPLES, attach=False)
    assert line_of([bare]) == f"{bare}: carries no testbed.yaml, allowed: with --testbed FILE"
    text = re.sub("name: short", "name: shorter", described_rig())
    other = parse_testbed(text, "other.yaml")
    assert line_of([bag], other).startswith(f"{bag}: shorter not in /winches/state and ")
    # With its test-bed given, a recording without one is read.
    given = parse_testbed(described_rig(), "given.yaml")
    assert [one.label for one in read_specimens([bare], given)] == ["short", "long"]


def test_a_rig_of_winches_alone_is_refused(bag):
    winch = {"name": "only", "drum_radius": 0.1, "rotor_inertia": 1.0, "torque_limit": 1.0}
    alone = parse_testbed(dump_yaml({"name": "alone", "cables": [winch]}), "alone.yaml")
    assert line_of([bag], alone) == (
        f"{bag}: alone has winches alone, allowed: winches with cables"
    )


def described_rig():
    cables = [one.cable.model_dump(mode="json", exclude_none=True) for one in SAMPLES]
    return dump_yaml({"name": "rig", "cables": cables})
