"""Errors that every laboratory has: of its survey, its clocks, and memory from before the start."""

from pathlib import Path

import numpy as np
import pytest

import cspm

RIGS = Path(__file__).resolve().parents[4] / "shared" / "cases" / "30_rigs"

pytestmark = [pytest.mark.compiled, pytest.mark.slow]


def rig(folder, name):
    """A rig by another hand, in counts, rpm, kgf and millimetres, diagnosed."""
    source = RIGS / name
    if not source.exists():
        pytest.skip(f"no recordings in {RIGS}")
    given = {"mapping": source / "map.yaml", "testbed": source / "rig.yaml"}
    cspm.import_recording(source / "drive.csv", folder / "rec", **given)
    return cspm.diagnose(folder / "rec")


@pytest.mark.parametrize("name", ["healthy_survey_0.5mm", "healthy_survey_1mm"])
def test_a_survey_within_its_accuracy_is_calibrated_and_no_fault(tmp_path, name):
    found = rig(tmp_path, name)
    assert (found.verdict, len(found.findings)) == ("consistent", 0)
    calibrated = found.data["calibrated"]
    assert {each["name"] for each in calibrated} <= {"x", "y", "z"}
    assert max(abs(each["value"]) for each in calibrated) < 3.7e-3


@pytest.mark.parametrize(
    ("name", "effect", "element", "parameter", "truth"),
    [
        ("attachment_off", "cable_attachment_offset", "c3", "x", 0.005),
        ("one_cell_late", "tension_delay", "h2", "delay", 0.008),
        ("creep_from_fresh", "cable_creep", "h1", "compliance", 1e-5),
        ("less_friction", "winch_coulomb_friction", "h2", "torque", -0.004),
    ],
)
def test_what_is_off_on_a_rig_is_named_where_it_is(
    tmp_path, name, effect, element, parameter, truth
):
    (finding,) = rig(tmp_path, name).findings
    assert (finding.effect, list(finding.elements)) == (effect, [element])
    low, high = finding.parameters[parameter].ci95
    assert low <= truth <= high


def surveyed(folder, *, off, size, seed):
    """A run of the thesis's machine with all ends off, one attachment by more, diagnosed."""
    scenario, draw = cspm.load_scenario("calm"), np.random.default_rng(seed)
    machine = scenario.testbed
    for cable in machine.cables:
        for effect in ("cable_exit_offset", "cable_attachment_offset"):
            moved = dict(zip("xyz", draw.normal(0.0, size, 3), strict=True))
            if off and (effect, cable) == ("cable_attachment_offset", "surge_1"):
                moved = {"x": off, "y": 0.0, "z": 0.0}
            machine = machine.with_effect(effect, cable, **moved)
    run = cspm.simulate(scenario, testbed=machine, seed=seed, duration=20.0)
    recording = run.save(folder / "recorded")
    return cspm.diagnose(recording, testbed=scenario.testbed, closed_loop=False)


def test_ends_of_eight_cables_a_millimetre_off_are_no_fault(tmp_path):
    found = surveyed(tmp_path, off=0.0, size=1e-3, seed=3)
    assert (found.verdict, len(found.findings)) == ("consistent", 0)
    assert {each["accuracy"] for each in found.data["calibrated"]} == {1e-3}


def test_an_attachment_is_distinguished_from_a_survey_of_all_ends(tmp_path):
    """0.7 mm everywhere is calibrated; 10 mm at one attachment are a wrong number of the file."""
    found = surveyed(tmp_path, off=0.01, size=7e-4, seed=2)
    (finding,) = found.findings
    assert (found.verdict, list(finding.elements)) == ("parameter", ["surge_1"])
    low, high = finding.parameters["x"].ci95
    assert finding.effect == "cable_attachment_offset"
    assert low <= 0.01 <= high


@pytest.fixture(scope="module")
def heavier(tmp_path_factory):
    """A winch whose rotor has 1.76 g·m² more than its file says, and its recording."""
    folder, scenario = tmp_path_factory.mktemp("heavier"), cspm.load_scenario("one_winch")
    machine = scenario.testbed.with_parameter("cables.surge.rotor_inertia", 2e-3)
    run = cspm.simulate(scenario, testbed=machine, seed=4, duration=15.0)
    return run.save(folder / "recorded"), scenario.testbed.text


@pytest.mark.parametrize(
    ("accuracy", "verdict", "named", "calibrated"),
    [
        ("", "parameter", ["winch_inertia"], []),
        (", accuracy: 1.0e-3", "consistent", [], ["winch_inertia"]),
        (", accuracy: 1.0e-4", "parameter", ["winch_inertia"], []),
    ],
)
def test_a_number_within_the_accuracy_that_its_file_states_is_no_fault(
    tmp_path, heavier, accuracy, verdict, named, calibrated
):
    recording, text = heavier
    stated = "rotor_inertia: {value: 2.4e-4, provenance: reconstructed"
    assert stated in text
    (tmp_path / "machine.yaml").write_text(text.replace(stated, stated + accuracy))
    found = cspm.diagnose(recording, testbed=tmp_path / "machine.yaml", closed_loop=False)
    assert found.verdict == verdict
    assert [each.effect for each in found.findings] == named
    assert [each["effect"] for each in found.data["calibrated"]] == calibrated
    for each in found.data["calibrated"]:
        assert each["value"] == pytest.approx(1.76e-3, rel=0.01)
