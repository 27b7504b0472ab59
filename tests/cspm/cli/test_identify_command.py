"""`cspm identify` on recordings that the project's plant did not make, one for each length."""

import json

import pytest
from error_lines import said
from machines import THESIS
from matplotlib.image import imread
from rig_samples import record

from bench.accuracy.rig_cables import SpecimenTruth, multisine, ramps
from cspm_ident.recording_hash import recording_sha256
from cspm_msgs_py.testbed import load_testbed

TRUTH = SpecimenTruth()
LENGTHS = {"short": 1.25, "middle": 2.1, "long": 3.5}


@pytest.fixture(scope="module")
def bags(tmp_path_factory):
    """By kind of motion and name of the length; the cable is called `cable` in all of them."""
    place = tmp_path_factory.mktemp("rig")
    found = {}
    for name, length in LENGTHS.items():
        for kind, make in (("ramps", ramps), ("sines", multisine)):
            options = {"cycles": 2} if kind == "ramps" else {"duration": 10.0}
            one = make(TRUTH, length, seed=2, label="cable", **options)
            found[kind, name] = record(place / f"{name}_{kind}", [one])
    return found


@pytest.fixture
def refused(cspm):
    def call(*arguments):
        code, _, err = cspm("identify", *arguments)
        assert (code, err.count("\n")) == (2, 1), err
        return said(err).removesuffix("\n")

    return call


def chosen(bags, kind):
    return [bags[kind, name] for name in LENGTHS]


@pytest.mark.slow
def test_stiffness_then_damping_then_a_file_that_says_where_from(cspm, bags, tmp_path):
    code, out, err = cspm(
        *("identify", "stiffness", *chosen(bags, "ramps")),
        *("--verify", "middle_ramps:cable", "--out", "law", "--json", "law.json"),
    )
    assert (code, err) == (0, "")
    for text in ("both branches", "up alone", "down alone", "two exponentials (3-5)", "not fitted"):
        assert text in out
    data = json.loads((tmp_path / "law.json").read_text())
    assert [one["fitted"] for one in data["specimens"]] == [True, True, False]
    values = {one["name"]: one for one in data["law"]["parameters"]}
    for name, truth in (("b", TRUTH.b), ("rigidity", TRUTH.rigidity)):
        low, high = values[name]["ci95"]
        # Two half widths about the middle: beyond them once in 10⁴.
        assert abs(truth - 0.5 * (low + high)) < high - low
        assert f"{values['b']['value']:.6g}" in out
    for picture in ("stiffness.png", "hysteresis.png"):
        assert imread(tmp_path / "law" / picture).std() > 0.05
    assert data["written"]["testbed"] == "law/fitted_testbed.yaml"

    fitted = load_testbed(tmp_path / "law" / "fitted_testbed.yaml")
    cable = fitted.testbed.cables[0]
    assert cable.stiffness.a == pytest.approx(values["a"]["value"], rel=1e-7)
    about = fitted.provenance["cables[0].stiffness.b"]
    first, second = (recording_sha256(bags["ramps", name]) for name in ("short", "long"))
    assert (about.recording, about.further_recordings) == (first, (second,))
    assert about.interval == pytest.approx(tuple(values["b"]["ci95"]), rel=1e-6)
    # What was not fitted stays.
    assert cable.stiffness.diameter == TRUTH.diameter
    assert "cables[0].stiffness.diameter" not in fitted.provenance

    code, out, err = cspm(
        *("identify", "damping", *chosen(bags, "sines"), "--out", "both"),
        *("--stiffness", "law/fitted_testbed.yaml", "--json", "damping.json"),
    )
    assert (code, err) == (0, "")
    data = json.loads((tmp_path / "damping.json").read_text())
    low, high = data["law"]["constant"]["ci95"]
    assert abs(TRUTH.constant - 0.5 * (low + high)) < high - low
    assert f"{data['law']['constant']['value']:.5g}" in out
    last = load_testbed(tmp_path / "both" / "fitted_testbed.yaml")
    assert last.testbed.cables[0].stiffness == cable.stiffness
    assert last.testbed.cables[0].damping.factor == 1.0
    assert last.provenance["cables[0].damping.slope"].provenance == "fitted"
    assert imread(tmp_path / "both" / "damping.png").std() > 0.05


@pytest.mark.slow
def test_the_law_goes_into_another_machine(cspm, bags, tmp_path):
    code, _, err = cspm(
        *("identify", "stiffness", *chosen(bags, "ramps"), "--out", "law"),
        *("--into", THESIS, "--into-cables", "hoist_1,hoist_2"),
    )
    assert (code, err) == (0, "")
    before = load_testbed(THESIS).testbed.cables
    after = load_testbed(tmp_path / "law" / "fitted_testbed.yaml").testbed.cables
    assert after[0].stiffness == after[1].stiffness != before[0].stiffness
    assert after[2:] == before[2:]
    assert after[0].damping == before[0].damping


def test_bad_input_is_one_line(refused, bags, tmp_path):
    bag = bags["ramps", "short"]
    assert refused("stiffness", "nowhere") == "nowhere: no such file or folder"
    assert refused("stiffness", bag, "--verify", "x") == "--verify x: no such cable, allowed: cable"
    assert refused("stiffness", bag, "--cables", "a,,b") == (
        "--cables a,,b: allowed: names with commas between them"
    )
    assert refused("stiffness", bag, "--cutoff", "-1") == (
        "--cutoff -1: allowed: a frequency above 0 Hz"
    )
    (tmp_path / "taken").mkdir()
    assert (
        refused("damping", bag, "--out", "taken") == "taken: already exists, allowed: a new folder"
    )
    sines = bags["sines", "short"]
    assert refused("stiffness", sines) == (
        f"cable: 0 slow cycles of stretching and releasing in {sines}, allowed: at least 2"
    )
    assert refused("damping", sines, "--stiffness", THESIS) == (
        "--stiffness: no cable cable in thesis, allowed: a test-bed with it; it has hoist_1,"
        " hoist_2, surge_1, surge_2, sway_1, sway_2, sway_3, sway_4"
    )
    assert "--into" in refused("stiffness", bag, "--into", "x.yaml", "--into-cables", "")


def test_help_says_what_to_do(cspm):
    code, out, _ = cspm("identify", "--help")
    assert code == 0
    assert "stiffness" in out
    assert "damping" in out
    code, out, _ = cspm("identify", "stiffness", "--help")
    assert code == 0
    for option in ("--testbed", "--cables", "--verify", "--into", "--out", "--json"):
        assert option in out
