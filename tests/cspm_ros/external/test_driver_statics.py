"""A run on hardware begins with what `check-drivers` finds of a machine at rest."""

from contextlib import ExitStack

import numpy as np
import pytest
from driver_samples import BAR, FRAME, TENSION, WINCHES, lab_of
from error_lines import said
from realtime_graph import APART, TOGETHER, Command, Witness
from ros_graph import load_ros
from scripted_lab import ScriptedLab, clamped_bundle

from cspm_msgs_py.errors import InputError
from cspm_ros.check_drivers.driver_observation import Finding
from cspm_ros.check_drivers.driver_statics import DriverStatics, refuse_static_faults

load_ros()

MEASURED = (FRAME, BAR, WINCHES, TENSION)
MS = 1_000_000


def mirrored(feed):
    rows = feed.rows.copy()
    rows[:, 2] *= -1.0
    return feed.__class__(feed.topic, feed.stamps, feed.receives, rows)


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    return lab_of(tmp_path_factory.mktemp("lab") / "r", "rest", "duration=1.5")


def heard(lab, seconds=1.5):
    """Return what heard the lab's drivers for a time, every tenth message."""
    statics = DriverStatics(lab.testbed, lab.rates, MEASURED)
    for name, feed in lab.feeds.items():
        observation = feed.observation()
        first = observation.samples[0][0]
        for received_ns, payload in observation.samples:
            if received_ns - first <= seconds * 1e9:
                statics.hear(name, received_ns, payload)
    return statics


def test_good_drivers_are_judged_after_a_second_and_once(lab):
    assert heard(lab, seconds=0.9).waits()
    statics = heard(lab)
    assert not statics.waits()
    assert statics.passed
    statics.hear(BAR, 0, b"nonsense")
    assert not statics.waits()


def test_after_a_restart_a_second_is_heard_again(lab):
    statics = heard(lab)
    statics.restart()
    assert statics.waits()


@pytest.mark.parametrize(
    ("topic", "change", "text"),
    [
        (
            BAR,
            lambda feed: feed.scaled(1000.0, slice(3)),
            "drivers: /bar/pose: looks in millimetres: ",
        ),
        (BAR, mirrored, "z points up, expected: down"),
        (TENSION, lambda feed: feed.scaled(1000.0 / 9.81), "drivers: /cables/tension: looks in g"),
        (TENSION, lambda feed: feed.scaled(-1.0), "inverted, or not zeroed?"),
        (WINCHES, lambda feed: feed.scaled(-1.0, slice(16, 24)), "the torque that holds"),
        (BAR, lambda feed: feed.described(frame_id="map"), "all messages: frame 'map', expected"),
        (BAR, lambda feed: feed.scaled(np.nan, slice(1)), "x: NaN, infinite or beyond 1e+12"),
        (TENSION, lambda feed: feed.shifted(-20_000 * 1_000_000), "20.0 s behind this computer's"),
        (WINCHES, lambda feed: feed.only(slice(None, None, 4)), "250 Hz, expected 1000 Hz (rates"),
    ],
)
def test_statics_that_are_wrong_are_refused(lab, topic, change, text):
    with pytest.raises(InputError) as refused:
        heard(lab.but(topic, change)).waits()
    assert text in str(refused.value)
    assert str(refused.value).endswith("`cspm check-drivers` lists all")


def test_what_is_late_or_odd_is_no_reason_to_refuse():
    refuse_static_faults(
        [
            Finding(BAR, "rate", False, "19 Hz, expected 100 Hz"),
            Finding(BAR, "frame", False, "1 of 100 messages: frame 'map'"),
            Finding(TENSION, "balance", None, "does it hang?"),
        ]
    )


def test_the_first_fault_is_named_and_the_others_counted():
    found = [Finding(BAR, "axes", False, "z up"), Finding(TENSION, "units", False, "grams")]
    with pytest.raises(InputError, match=r"^drivers: /bar/pose: z up \(and 1 more\); allowed: "):
        refuse_static_faults(found)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        ({"unreliable": (BAR,)}, "drivers: /bar/pose: best effort (from lab), expected reliable"),
        (
            {"mute": (BAR,)},
            "drivers: all are there, and the run did not begin within 1 s: waits for /bar/pose",
        ),
    ],
    ids=["best_effort", "patience"],
)
def test_drivers_that_nobody_hears_end_a_run_with_the_reason(tmp_path, fault, reason):
    bundle = clamped_bundle()
    with ExitStack() as stack:
        arguments = ("--plant", "external", TOGETHER, "--patience", "1")
        command = stack.enter_context(Command(tmp_path, bundle, *arguments))
        witness = stack.enter_context(Witness(command.domain))
        ScriptedLab(witness.session, bundle.testbed.testbed, **fault)
        witness.until(lambda: command.process.poll() is not None, "the refusal")
        code, _, err = command.done()
    assert code == 2, err
    (line,) = err.strip().splitlines()[-1:]
    assert reason in line


@pytest.mark.slow
@pytest.mark.parametrize("processes", [TOGETHER, APART])
def test_poses_in_millimetres_end_a_run_before_it_begins(tmp_path, processes):
    bundle = clamped_bundle()
    arguments = ("--plant", "external", processes)
    with ExitStack() as stack:
        command = stack.enter_context(Command(tmp_path, bundle, *arguments))
        witness = stack.enter_context(Witness(command.domain))
        lab = ScriptedLab(witness.session, bundle.testbed.testbed)
        lab.jump(0.0, 0.0, 2000.0)
        witness.until(lambda: command.process.poll() is not None, "the refusal")
        code, _, err = command.done()
    assert code == 2, err
    (line,) = err.strip().splitlines()[-1:]
    assert "Traceback" not in err, err
    assert "drivers: /bar/pose: looks in millimetres: 2000 from the origin" in line
    assert said(line).startswith("")
    assert np.allclose(lab.torques, 5.0 * lab.radii)
