"""What a recording amounts to, against the account that the run itself keeps."""

import numpy as np
import pytest
from run_samples import bundle_of

from cspm_msgs_py.diagnostics import encode_diagnostics
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.recording import Recording
from cspm_msgs_py.topics import SCENE
from cspm_run.recorded_run import new_recording, run
from cspm_run.recorded_statistics import recording_statistics

MS = 1_000_000
# A cable is let go.
UNWINDING = "control={mode: torque, torque: {surge_1: {offset: -0.2}}}"


def both(tmp_path, scenario, *overrides, steps):
    """Return the account of a run and the one of its recording."""
    bundle = bundle_of(scenario, *overrides)
    result = run(bundle, tmp_path / "bag", steps=steps)
    return result.statistics, recording_statistics(tmp_path / "bag", bundle.testbed.testbed)


def assert_equal(kept, found):
    assert found.steps == kept.steps
    np.testing.assert_allclose(found.max_error, kept.max_error, rtol=1e-9, atol=1e-14)
    np.testing.assert_allclose(found.rms_error, kept.rms_error, rtol=1e-9, atol=1e-14)
    assert found.tension_range == kept.tension_range
    assert found.slack_share == kept.slack_share
    assert found.saturated_share == pytest.approx(kept.saturated_share, abs=2.0 / kept.steps)
    drives = [str(i) for i in range(kept.envelope.shape[2] - 6)]
    for ours, theirs in zip(kept.saturation(drives), found.saturation(drives), strict=True):
        assert theirs.share == pytest.approx(ours.share, abs=2.0 / kept.steps)
        assert theirs.longest == pytest.approx(ours.longest, abs=2.1 * kept.period)
    assert found.kept_steps == kept.kept_steps
    assert found.period == pytest.approx(kept.period)
    np.testing.assert_array_equal(found.last_tensions, kept.last_tensions)
    assert found.bin_steps == kept.bin_steps
    np.testing.assert_allclose(found.envelope, kept.envelope, rtol=1e-9, atol=1e-14)


@pytest.mark.parametrize(
    ("scenario", "steps"), [("worst_case", 2300), ("one_winch", 300), ("verification_mid", 300)]
)
def test_a_recording_amounts_to_what_the_run_did(tmp_path, scenario, steps):
    kept, found = both(tmp_path, scenario, steps=steps)
    assert_equal(kept, found)
    assert kept.infeasible_share == pytest.approx(found.infeasible_share, abs=0.05)


def test_slack_cables_are_counted(tmp_path):
    kept, found = both(tmp_path, "rest", UNWINDING, steps=400)
    assert 0.0 < kept.slack_share < 1.0
    assert_equal(kept, found)


def test_wrenches_out_of_reach_are_counted(tmp_path):
    kept, found = both(tmp_path, "worst_case", steps=2301)
    assert 0.005 < kept.infeasible_share < 1.0
    assert found.infeasible_share == pytest.approx(kept.infeasible_share, abs=2e-3)


def keep_only(source, folder, bundle, wanted):
    """Copy some topics of a recording; the others remain without messages."""
    topics = bundle.testbed.testbed.topics
    with Recording(source) as recording, new_recording(bundle, folder, "copy") as writer:
        for name in filter(wanted, [each for each in recording.topics if each not in SCENE]):
            if topics[name].fields or name == "/clock":
                found = recording.rows(name)
                for log, stamp, row in zip(*found[:3], strict=True):
                    writer.channel(name).append(int(log), int(stamp), row)
            else:
                found = recording.payloads(name)
                for log, payload in zip(*found, strict=True):
                    writer.append_payload(name, int(log), payload)


def test_without_truth_the_measured_values_are_taken(tmp_path):
    bundle = bundle_of("rest")
    kept = run(bundle, tmp_path / "bag", steps=400).statistics
    keep_only(tmp_path / "bag", tmp_path / "real", bundle, lambda name: "/truth" not in name)
    found = recording_statistics(tmp_path / "real", bundle.testbed.testbed)
    assert found.steps == 400
    with Recording(tmp_path / "bag") as recording:
        tensions = recording.rows("/cables/tension").rows
        poses = recording.rows("/bar/pose").rows
    assert found.tension_range == (tensions.min(), tensions.max())
    assert found.tension_range != kept.tension_range
    # The reference rests; each of the ten times rarer poses counts until the next.
    np.testing.assert_allclose(found.max_error[:3], np.abs(poses[:, :3] - [0, 0, 2]).max(axis=0))
    squares = np.mean((poses[:, :3] - [0, 0, 2]) ** 2, axis=0)
    np.testing.assert_allclose(found.rms_error[:3], np.sqrt(squares))


@pytest.mark.parametrize("missing", ["/bar/reference", "pose"])
def test_without_reference_or_pose_there_are_no_errors(tmp_path, missing):
    bundle = bundle_of("rest")
    kept = run(bundle, tmp_path / "bag", steps=100).statistics
    keep_only(tmp_path / "bag", tmp_path / "part", bundle, lambda name: missing not in name)
    found = recording_statistics(tmp_path / "part", bundle.testbed.testbed)
    assert not found.rms_error.any()
    assert found.tension_range == kept.tension_range


def test_without_tensions_nothing_is_counted(tmp_path):
    bundle = bundle_of("rest")
    new_recording(bundle, tmp_path / "bag", "graph").close()
    found = recording_statistics(tmp_path / "bag", bundle.testbed.testbed)
    assert found.steps == 0
    assert found.tension_range == (0.0, 0.0)
    assert (found.slack_share, found.infeasible_share) == (0.0, 0.0)


def test_a_turn_is_no_error(tmp_path):
    """Just below and just above half a turn of yaw lie next to each other."""
    bundle = bundle_of("rest")
    quaternion = {sign: [0, 0, np.sin(a / 2), np.cos(a / 2)] for sign, a in ((1, 3.1), (-1, -3.1))}
    with new_recording(bundle, tmp_path / "bag", "graph") as writer:
        writer.channel("/truth/cables/tension").append(0, 0, np.ones(8))
        writer.channel("/truth/bar/pose").append(0, 0, np.array([0, 0, 2.0, *quaternion[1]]))
        reference = np.array([0, 0, 2.0, *quaternion[-1], *np.zeros(12)])
        writer.channel("/bar/reference").append(0, 0, reference)
    found = recording_statistics(tmp_path / "bag", bundle.testbed.testbed)
    assert found.max_error[5] == pytest.approx(2 * np.pi - 6.2)
    assert not found.max_error[:5].any()


@pytest.mark.parametrize(
    ("reported", "expected"),
    [
        ([], 0.0),
        (["0.5"], 0.5),
        (["1.000", "0.2", "0.4"], 0.3),
        (["0", "many", "nan", "inf", "-1", "7", "0.4"], 0.4),
        (["0", "many"], 0.0),
    ],
)
def test_shares_are_those_that_the_distribution_reported(tmp_path, reported, expected):
    bundle = bundle_of("rest")
    with new_recording(bundle, tmp_path / "bag", "graph") as writer:
        for step in range(10):
            writer.channel("/truth/cables/tension").append(step * MS, step * MS, np.ones(8))
        for i, share in enumerate(reported):
            statuses = [
                (0, "plant", "ok", {"infeasible_share": "1"}),
                (0, "tension_distribution", "ok", {"infeasible_share": share}),
                (0, "tension_distribution", "ok", {"another": "1"}),
            ]
            writer.append_payload("/diagnostics", i * MS, encode_diagnostics(i * MS, statuses))
    found = recording_statistics(tmp_path / "bag", bundle.testbed.testbed)
    assert found.infeasible_share == pytest.approx(expected)


def test_no_recording_is_one_line(tmp_path):
    with pytest.raises(InputError, match=r"no such file or folder$"):
        recording_statistics(tmp_path / "none", bundle_of("rest").testbed.testbed)
