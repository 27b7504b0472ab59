"""What nodes reported of their deadlines, read from a recording."""

import pytest

from cspm_msgs_py.diagnostics import Level, Status, encode_diagnostics
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.recording.writer import RecordingWriter
from cspm_msgs_py.stepping.delay_histogram import DelayHistogram
from cspm_msgs_py.topics import DIAGNOSTICS
from cspm_run.recorded_timing import first_alarm, timing_of, torque_delays


def record(folder, *statuses):
    """Record statuses, each in a message of its own, at 0.1 s intervals."""
    topics = {DIAGNOSTICS.name: DIAGNOSTICS}
    with RecordingWriter(folder, topics, attachments={}, metadata={}) as writer:
        for i, status in enumerate(statuses):
            now = i * 100_000_000
            writer.append_payload(DIAGNOSTICS.name, now, encode_diagnostics(now, [status]))
    return folder


def said(name, level=Level.OK, message="ok", **values):
    return Status(level, name, message, {key: str(value) for key, value in values.items()})


def test_of_totals_the_last_counts_and_of_latencies_the_largest(tmp_path):
    folder = record(
        tmp_path / "r",
        said("motion_controller", deadlines_missed=0, stale_inputs=0, worst_latency_ms="7.250"),
        said("plant", deadlines_missed=3, late_steps=2, slack_share="0.500"),
        said("motion_controller", deadlines_missed=4, stale_inputs=1, worst_latency_ms="1.500"),
        said("plant", deadlines_missed=5, late_steps=2, slack_share="0.000"),
        said("recorder", lost=0, refused=12),
    )
    assert timing_of(folder) == {
        "motion_controller": {"deadlines_missed": 4, "stale_inputs": 1, "worst_latency_ms": 7.25},
        "plant": {"deadlines_missed": 5, "late_steps": 2},
        "recorder": {"lost": 0, "refused": 12},
    }


def test_who_reports_nothing_of_time_is_left_out(tmp_path):
    folder = record(tmp_path / "r", said("plant/watchdog", state="running"))
    assert timing_of(folder) == {}


def test_of_delays_the_last_report_counts(tmp_path):
    first, last = DelayHistogram(), DelayHistogram()
    first.add(500_000)
    for delay_ns in (500_000, 1_500_000, 90_000_000):
        last.add(delay_ns)
    folder = record(
        tmp_path / "r",
        said("plant", torque_delays=first),
        said("plant", torque_delays=last),
        said("recorder", lost=0),
    )
    assert torque_delays(folder).counts == last.counts


def test_a_recording_without_diagnostics_shows_nothing(tmp_path):
    folder = record(tmp_path / "r")
    assert timing_of(folder) == {}
    assert torque_delays(folder) is None
    assert first_alarm(folder) is None


def test_the_first_error_is_reported_with_its_name_whatever_comes_after(tmp_path):
    folder = record(
        tmp_path / "r",
        said("plant", Level.WARN, "slack cable"),
        said("force_controller", Level.STALE, "waits for /tension_command"),
        said("force_controller", Level.ERROR, "safe state hold since 1.2 s: a reason"),
        said("plant/watchdog", Level.ERROR, "safe state hold since 1.3 s: another"),
        said("force_controller"),
    )
    assert first_alarm(folder) == "force_controller: safe state hold since 1.2 s: a reason"


def test_warnings_and_stale_inputs_are_no_errors(tmp_path):
    folder = record(
        tmp_path / "r",
        said("plant", Level.WARN, "slack cable"),
        said("force_controller", Level.STALE, "waits for /tension_command"),
    )
    assert first_alarm(folder) is None


def test_what_is_no_recording_is_refused(tmp_path):
    with pytest.raises(InputError, match="nothing"):
        timing_of(tmp_path / "nothing")
