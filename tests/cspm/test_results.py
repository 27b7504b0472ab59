"""Identification, comparison, diagnosis and analysis from a script: same code as the commands."""

import json

import jsonschema
import numpy as np
import pytest

import cspm
from cspm.identification.identified import Identification
from cspm.parameters import Parameter, Parameters
from cspm.progress import by_steps
from cspm.schemas.file_schema import schema_of
from cspm_ident.diagnosis_file import read_diagnosis


@pytest.fixture(scope="module")
def friction():
    machine = cspm.load_testbed("one_winch")
    machine = machine.with_effect("winch_viscous_friction", "surge", coefficient=2e-3)
    return machine.with_effect("winch_coulomb_friction", "surge", torque=0.02)


@pytest.fixture(scope="module")
def recording(friction, tmp_path_factory):
    place = tmp_path_factory.mktemp("recordings") / "winch"
    return cspm.simulate("one_winch", testbed=friction, duration=12).save(place)


def test_a_winch_is_identified_with_intervals_that_hold_the_truth(recording, tmp_path):
    reported = []
    found = cspm.identify_winch(
        recording,
        testbed="one_winch",
        # Dry friction sticks at reversals.
        reversals=False,
        progress=lambda *each: reported.append(each),
    )
    truth = {"inertia": 2.4e-4, "winch_viscous_friction coefficient": 2e-3}
    for name, value in truth.items():
        low, high = found.parameters[name].ci95
        assert low < value < high
        assert found.parameters[name, "surge"].unit
    assert reported == [(0.0, "surge")]
    effects = {entry.effect for entry in found.testbed.effects}
    assert {"winch_viscous_friction", "winch_coulomb_friction"} <= effects
    written = found.write(tmp_path / "fitted")
    assert cspm.load_testbed(written["testbed"]).sha256 == found.testbed.sha256
    with pytest.raises(cspm.InputError, match="fitted: already exists, allowed: a new folder"):
        found.write(tmp_path / "fitted")


def test_a_comparison_has_channels_by_name(recording, tmp_path):
    same = cspm.compare(recording)
    channel = same.channel("cables/tension/surge")
    assert channel.vaf > 99.0
    with pytest.raises(cspm.InputError, match="whole: no channel depth, allowed: cables/tension"):
        same.channel("depth")
    report = same.write(tmp_path / "report")
    assert json.loads((report.parent / "comparison.json").read_text()) == json.loads(
        json.dumps(same.data())
    )


def test_findings_of_a_planted_friction(recording, tmp_path):
    found = cspm.diagnose(recording, testbed="one_winch", closed_loop=False)
    named = {finding.effect: finding for finding in found.findings}
    friction = named["winch_coulomb_friction"]
    assert friction.elements == ("surge",)
    assert friction.status in {"reported", "tied"}
    assert friction.parameters["torque"].value == pytest.approx(0.02, rel=0.1)
    assert friction.subsystem == "winch"
    assert 0.0 < friction.probability < 1.0
    assert "winch_coulomb_friction" in found.improved_testbed.text
    place = found.write(tmp_path / "verdict")
    data = json.loads((place / "diagnosis.json").read_text())
    assert data["verdict"] == found.verdict
    jsonschema.validate(data, schema_of("diagnosis"))
    (read,) = (each for each in read_diagnosis(place).findings if each.effect == friction.effect)
    assert read.parameters[0].value == friction.parameters["torque"].value
    assert (place / "testbed.improved.yaml").read_text() == found.improved_testbed.text


def test_what_is_no_recording_is_refused(recording, tmp_path):
    run = cspm.simulate("one_winch", duration=0.01)
    with pytest.raises(cspm.InputError, match=r"is no recording, allowed: one that cspm.open or"):
        cspm.diagnose([run])
    with pytest.raises(cspm.InputError, match="is already used for the search, allowed: another"):
        cspm.diagnose(recording, held_out=recording)
    with pytest.raises(cspm.InputError, match="drive wind: allowed: winch, torque, tension"):
        cspm.compare(recording, drive="wind")


def test_parameters_go_by_name_and_by_element():
    one = Parameters([Parameter("torque", "a", 1.0, "N·m", None)])
    assert list(one) == ["torque"]
    assert one["torque"] is one["torque", "a"]
    two = Parameters([*one.values(), Parameter("torque", "b", 2.0, "N·m", (1.0, 3.0))])
    assert list(two) == [("torque", "a"), ("torque", "b")]
    assert two["torque", "b"].value == 2.0
    with pytest.raises(KeyError, match=r"torque, allowed: \('torque', 'a'\), \('torque', 'b'\)"):
        two["torque"]


def test_progress_of_unknown_length_grows_and_stays_below_one():
    reported = []
    step = by_steps(lambda share, what: reported.append((share, what)))
    for number in range(50):
        step(str(number))
    shares = [share for share, _ in reported]
    assert shares[0] == 0.0
    assert (np.diff(shares) > 0.0).all()
    assert shares[-1] < 1.0


def test_a_linear_model_goes_to_python_control():
    linear = cspm.analyze_linear(pose=[0.0, 0.0, 2.0, 0.0, 0.0, 0.0])
    plant = linear.to_control("tension")
    exact = linear.result.exact.tension.system
    frequency = np.array([3.0, 30.0])
    assert plant(1j * frequency).transpose(2, 0, 1) == pytest.approx(exact.response(frequency))
    with pytest.raises(cspm.InputError, match="part rudder: allowed: plant, motion, tension"):
        linear.to_control("rudder")
    with pytest.raises(cspm.InputError, match=r"pose \[1\]: allowed: six numbers, surge"):
        cspm.analyze_linear(pose=[1])
    with pytest.raises(cspm.InputError, match="machine one_winch has no bar"):
        cspm.analyze_manipulability(testbed="one_winch")


def test_a_stage_of_the_cascade_is_a_controller_in_its_own_place():
    usual = cspm.simulate("calm", duration=0.1)
    own = {"tension_distribution": cspm.builtin_controller("tension_distribution", "calm")}
    run = cspm.simulate("calm", duration=0.1, controllers=own)
    assert np.array_equal(run.tension, usual.tension)
    with pytest.raises(cspm.InputError, match="stage rudder: allowed: wave_trajectory, motion"):
        cspm.builtin_controller("rudder", "calm")
    with pytest.raises(cspm.InputError, match="tension_distribution: needs /wrench_command"):
        own["tension_distribution"].step(0.0, {})


def test_numbers_that_are_no_machines_leave_no_folder(tmp_path):
    def refused():
        raise cspm.InputError("no machine")

    found = Identification(None, Parameters([]), refused, lambda place: {})
    with pytest.raises(cspm.InputError, match=r"^no machine$"):
        found.write(tmp_path / "out")
    assert not (tmp_path / "out").exists()
