import os

import numpy as np
import pytest
from run_samples import SCENARIOS, bundle_of
from scipy.io import savemat
from vessel_samples import small_body_vessel

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.recording import Recording
from cspm_msgs_py.scenario import load_scenario
from cspm_msgs_py.testbed import load_testbed
from cspm_run.bundle import Bundle, make_bundle, read_bundle
from cspm_run.recorded_run import run

TESTBED = SCENARIOS / "testbeds" / "thesis.yaml"
MOTION = "t,x,y,z,roll,pitch,yaw\n" + "".join(
    f"{0.1 * i:.1f},{0.01 * np.sin(i):.6f},0,0,0,0,0\n" for i in range(40)
)


@pytest.fixture
def scenario_path(tmp_path):
    """A scenario of two bodies that move as files beside it say, vessel and recorded motion."""
    place = tmp_path / "mine"
    (place / "data").mkdir(parents=True)
    (place / "data" / "surge.csv").write_text(MOTION)
    savemat(place / "boat.mat", {"vessel": small_body_vessel(np.linspace(0.5, 6.0, 30))})
    path = place / "scenario.yaml"
    path.write_text(
        f"""name: mine
testbed: {TESTBED}
duration: 2.0
winch_frame:
  motion: {{type: file, path: data/surge.csv}}
target:
  mean_pose: [0, 0, 2, 0, 0, 0]
  motion: {{type: vessel, rao: boat.mat, scale: 12.0, significant_wave_height: 0.05,
    peak_period: 2.3, band: [0.3, 0.8], period: 100.0, ramp: 10.0}}
control: {{mode: locked_winches}}
"""
    )
    return path


def test_nothing_outside_the_bundle_is_named(scenario_path):
    bundle = bundle_of(scenario_path)
    assert bundle.scenario.testbed == "testbed.yaml"
    assert bundle.scenario.winch_frame.motion.path == "winch_frame_motion.csv"
    assert bundle.scenario.target.motion.rao == "target_motion.mat"
    attachments = bundle.attachments()
    assert list(attachments) == [
        "scenario.yaml",
        "testbed.yaml",
        "winch_frame_motion.csv",
        "target_motion.mat",
    ]
    assert attachments["winch_frame_motion.csv"] == MOTION.encode()
    assert attachments["target_motion.mat"] == (scenario_path.parent / "boat.mat").read_bytes()
    assert attachments["testbed.yaml"] == TESTBED.read_bytes()


def test_bundles_come_back_from_their_attachments(scenario_path):
    for bundle in (bundle_of(scenario_path), bundle_of("worst_case"), bundle_of("one_winch")):
        assert read_bundle(bundle.attachments(), "bag") == bundle


def test_overrides_and_gains_travel_along():
    bundle = bundle_of("worst_case", "seed=5", "control={mode: closed_loop}")
    found = read_bundle(bundle.attachments(), "bag").scenario
    assert found.seed == 5
    assert set(found.control.motion.gains) == {"surge", "sway", "heave", "pitch", "yaw"}
    assert len(found.control.force.gains) == 8
    for dof, gains in found.control.motion.gains.items():
        assert gains == bundle.scenario.control.motion.gains[dof]  # to the last bit


def test_a_run_needs_only_the_bundle(scenario_path, tmp_path):
    bundle = bundle_of(scenario_path)
    run(bundle, tmp_path / "bag", steps=200)
    for path in (scenario_path.parent / "data" / "surge.csv", scenario_path.parent / "boat.mat"):
        path.unlink()
    with Recording(tmp_path / "bag") as recording:
        again = read_bundle(recording.attachments, "bag")
        surge = recording.rows("/winch_frame/reference").rows[:, 0]
    assert again == bundle
    assert surge[100] == pytest.approx(0.01 * np.sin(1.0), abs=1e-6)
    result = run(again, None, steps=200)
    assert np.isfinite(result.statistics.max_error).all()


def test_a_file_that_cannot_be_read_is_one_line(scenario_path):
    (scenario_path.parent / "boat.mat").unlink()
    with pytest.raises(InputError) as caught:
        bundle_of(scenario_path)
    assert str(caught.value) == (
        f"{scenario_path.parent}/boat.mat: not readable (No such file or directory), allowed: a"
        " file"
    )


def test_errors_name_the_users_file_and_not_its_copy(scenario_path):
    bundle = bundle_of(scenario_path)
    name = next(iter(bundle.files))
    with pytest.raises(InputError) as caught, bundle.unpacked() as place:
        raise InputError(f"{place / name}: line 3: nonsense")
    origin = bundle.origins[name]
    assert str(caught.value) == f"{origin}: line 3: nonsense"
    assert str(scenario_path.parent) in origin


@pytest.mark.parametrize(
    ("attachments", "text"),
    [
        ({}, "carries no scenario.yaml and no testbed.yaml"),
        ({"testbed.yaml": b""}, "carries no scenario.yaml"),
        ({"scenario.yaml": b""}, "carries no testbed.yaml"),
    ],
)
def test_what_cspm_did_not_record_is_refused(attachments, text):
    with pytest.raises(InputError) as caught:
        read_bundle(attachments, "bag")
    assert str(caught.value) == f"bag: {text}, allowed: a recording made by cspm"


def test_damaged_attachments_are_named():
    whole = bundle_of("one_winch").attachments()
    for name in ("scenario.yaml", "testbed.yaml"):
        for content in (b"\xff\xfe{", b"name: [", b"surprise: 1\n"):
            with pytest.raises(InputError, match=f"^bag: {name}: [^\n]+$"):
                read_bundle(whole | {name: content}, "bag")


@pytest.mark.parametrize("name", ["../outside.csv", "/tmp/absolute.csv", "a/b.csv", ".."])
def test_attachments_stay_in_their_folder(name):
    with pytest.raises(InputError) as caught:
        read_bundle(bundle_of("one_winch").attachments() | {name: b""}, "bag")
    assert str(caught.value) == f"bag: attachment {name!r}, allowed: names without folders"


def test_still_bodies_need_no_files():
    path = SCENARIOS / "rest.yaml"
    bundle = make_bundle(load_scenario(path), load_testbed(TESTBED), SCENARIOS)
    assert bundle.files == {}
    with bundle.unpacked() as place:
        assert list(place.iterdir()) == []
    with Bundle(bundle.scenario, bundle.testbed, {"a.csv": b"x"}).unpacked() as place:
        assert (place / "a.csv").read_bytes() == b"x"
    assert not place.exists()


@pytest.mark.parametrize("path", ["/etc/hostname", "../outside.csv", "/dev/zero", "absent.csv"])
@pytest.mark.parametrize("key", ["path", "rao"])
def test_a_recording_reads_what_it_carries_and_no_other_file(scenario_path, path, key):
    carried = bundle_of(scenario_path).attachments()
    name = {"path": "winch_frame_motion.csv", "rao": "target_motion.mat"}[key]
    text = carried["scenario.yaml"].decode()
    assert read_bundle(carried, "bag").files
    changed = carried | {"scenario.yaml": text.replace(name, path).encode()}
    role = {"path": "winch_frame", "rao": "target"}[key]
    with pytest.raises(InputError) as caught:
        read_bundle(changed, "bag")
    assert str(caught.value) == (
        f"bag: scenario.yaml: {role}.motion.{key}: {path!r}, allowed: a file that the recording"
        " carries"
    )


def linked(place):
    place.symlink_to("/etc/hostname")


def climbing(place):
    place.symlink_to(place.parent.parent.parent)


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (linked, "leads outside, allowed: a file in the scenario's folder"),
        (climbing, "leads outside, allowed: a file in the scenario's folder"),
        (os.mkfifo, "no regular file, allowed: a file"),
    ],
)
def test_a_scenario_reads_files_of_its_own_folder_alone(scenario_path, make, text):
    path = scenario_path.parent / "boat.mat"
    path.unlink()
    make(path)
    with pytest.raises(InputError) as caught:
        bundle_of(scenario_path)
    assert str(caught.value) == f"{path}: {text}"


def test_a_link_inside_the_folder_is_a_file(scenario_path):
    path = scenario_path.parent / "boat.mat"
    path.rename(path.with_name("ship.mat"))
    path.symlink_to("ship.mat")
    assert "target_motion.mat" in bundle_of(scenario_path).files


@pytest.mark.parametrize("path", ["/etc/hostname", "../hostname", "/dev/zero"])
def test_a_scenario_names_no_file_elsewhere(scenario_path, path):
    scenario_path.write_text(scenario_path.read_text().replace("boat.mat", path))
    with pytest.raises(InputError) as caught:
        bundle_of(scenario_path)
    found = scenario_path.parent / path
    assert str(caught.value) == f"{found}: leads outside, allowed: a file in the scenario's folder"
