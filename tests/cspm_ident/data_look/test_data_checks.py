"""What a look at recordings finds, and that it finds nothing in healthy ones."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from machines import THESIS
from run_samples import SCENARIOS
from winch_samples import Winch, closed_loop

from cspm_ident.data_look.channel_checks import (
    constant_check,
    jump_check,
    saturation_check,
    slack_check,
)
from cspm_ident.data_look.look import CHECKS, look_at, without_regimes
from cspm_ident.data_look.motion_checks import excitation_check, length_check, standstill_check
from cspm_ident.data_look.regime_check import regime_check
from cspm_ident.data_look.sensor_check import sensor_check
from cspm_ident.data_look.shared_rows import refuse_shared_rows
from cspm_ident.data_look.stamp_check import stamp_check
from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.samples import Samples
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import load_testbed

COUNT = 12000


def recording(seed):
    """A single winch without cable, 12 s at 1 kHz, under the name of its seed."""
    made = closed_loop(Winch(), COUNT, torque_noise=0.01, seed=seed, shift=float(seed))
    file = load_testbed(SCENARIOS / "testbeds" / "emps.yaml")
    measurement = Measurement(Path(f"run_{seed}"), str(seed), file, torque_age=made.torque_age)
    return dataclasses.replace(measurement, angle=made.angle, torque=made.torque)


@pytest.fixture(scope="module")
def healthy():
    return recording(1)


def changed(measurement, name, change):
    """The same with one sensor's values changed in place."""
    samples = getattr(measurement, name)
    values = samples.values.copy()
    change(samples.times, values)
    return measurement.with_samples(name, Samples(samples.times, values))


def put(values, rows, to=0.0):
    """Set the first column."""
    values[rows, 0] = to


def test_a_healthy_recording_passes_every_check(healthy):
    checks = look_at([healthy], [recording(2)])
    assert [each.text for each in checks if not each.ok] == []
    assert len(checks) == 2 * len(CHECKS)
    assert all(each.what and not each.remedy for each in checks)


def test_a_short_recording_is_named(healthy):
    found = length_check(healthy.within(0.0, 6.0))
    assert (found.ok, found.what) == (False, "lasts 6 s")
    assert length_check(healthy).ok


def test_a_winch_that_does_not_move_is_named(healthy):
    def stop(_, values):
        values[:] = 1.0 + 1e-4 * np.random.default_rng(1).standard_normal(values.shape)

    still = changed(healthy, "angle", stop)
    assert excitation_check(still).what == "carriage does not move"
    assert standstill_check(still).ok


def test_standing_for_most_of_the_time_is_named(healthy):
    def stop(times, values):
        values[times > 4.0] = values[np.searchsorted(times, 4.0)]

    found = standstill_check(changed(healthy, "angle", stop))
    assert not found.ok
    assert found.what.startswith("carriage stands still for ")


def test_slack_and_stuck_load_cells_are_named():
    times = np.arange(2000) * 0.01
    tension = 20.0 + np.random.default_rng(2).standard_normal((2000, 8))
    angle = Samples(times, np.cumsum(0.1 * np.ones((2000, 8)), axis=0))
    file = load_testbed(THESIS)
    fine = Measurement(Path("some"), "", file, angle=angle, tension=Samples(times, tension))
    assert slack_check(fine).ok
    assert constant_check(fine).ok
    slack = changed(fine, "tension", lambda at, v: put(v, at < 3.0))
    assert slack_check(slack).what == "hoist_1 is slack for 15.0 % of the time"
    stuck = changed(fine, "tension", lambda at, v: put(v, (at > 5.0) & (at < 9.0), 20.0))
    assert constant_check(stuck).what == "tension of hoist_1 is stuck for 20 % of the time"
    constant = changed(fine, "tension", lambda at, v: put(v, at >= 0.0, 49.05))
    assert constant_check(constant).what == "tension of hoist_1 is constant at 49.05"


def test_a_saturated_drive_is_named_and_one_that_chatters_is_said_to(healthy):
    limit = healthy.machine.cables[0].torque_limit
    lasting = changed(healthy, "torque", lambda at, v: put(v, (at > 1.0) & (at < 2.2), limit))
    assert saturation_check(lasting).what == (
        "at their torque limit: carriage 10.0 % (stretches, up to 1.2 s)"
    )
    chatters = changed(healthy, "torque", lambda at, v: put(v, np.arange(len(at)) % 3 == 0, limit))
    found = saturation_check(chatters)
    assert found.ok
    assert found.what == "drives touch their torque limit: carriage 33.3 % (chatter, at most 1 ms)"
    rarely = changed(healthy, "torque", lambda at, v: put(v, np.arange(len(at)) % 200 == 0, limit))
    assert saturation_check(rarely).what == "no drive is at its limit"


def test_a_jump_is_named_with_its_instant(healthy):
    found = jump_check(changed(healthy, "angle", lambda at, v: put(v, at > 5.9995, 30.0)))
    assert not found.ok
    assert found.what == "angle of carriage jumps 1 times, at 5.999 s"


def test_stamps_that_scatter_are_held_against_accelerations(healthy):
    assert stamp_check(healthy).what == "stamps are even"
    rng = np.random.default_rng(3)
    angle = healthy.angle
    times, values = angle.times[::4], angle.values[::4]
    wrong = Samples(times + 0.0016 * rng.uniform(-1.0, 1.0, len(times)), values)
    found = stamp_check(healthy.with_samples("angle", wrong))
    assert not found.ok
    assert "% of the accelerations of carriage are noise, as stamps that scatter by" in found.what
    kept = np.sort(rng.choice(len(angle.times), 6000, replace=False))
    uneven = Samples(angle.times[kept], angle.values[kept])
    found = stamp_check(healthy.with_samples("angle", uneven))
    assert found.ok
    assert found.what.endswith("and angles agree with them")


@pytest.mark.parametrize("torque", [0.4, -0.4])
def test_a_stretch_under_another_load_is_found_and_left_out(healthy, torque):
    def load(times, values):
        values[(times > 5.0) & (times < 8.0)] += torque

    other = changed(healthy, "torque", load)
    found = regime_check(other)
    ((start, end),) = found.stretches
    assert start == pytest.approx(5.0, abs=0.6)
    assert end == pytest.approx(8.0, abs=0.6)
    assert f"its torque is off by {torque:.1f}"[:-1] in found.what
    (left,) = without_regimes([other], look_at([other]))
    assert len(left.angle.spans) == 2
    assert not np.any((left.torque.times > start) & (left.torque.times < end))
    assert regime_check(healthy).stretches == ()


def test_a_copied_stretch_is_refused_in_either_role(healthy):
    copy = dataclasses.replace(healthy.within(0.0, 6.0), path=Path("copy"), sha256="other")
    text = "--held-out copy: shares 100 % of its rows with run_1, which is searched"
    with pytest.raises(InputError, match=text):
        refuse_shared_rows([healthy], [copy])
    with pytest.raises(InputError, match="copy: shares 100 % of its rows with run_1, which would"):
        refuse_shared_rows([healthy, copy], [])


def test_what_stands_still_alike_is_no_copy(healthy):
    """Two recordings that begin with the same standstill, read without noise."""

    def quiet(measurement):
        for name in ("angle", "torque"):
            measurement = changed(measurement, name, lambda at, v: put(v, at < 4.0))
        return measurement

    refuse_shared_rows([quiet(healthy)], [quiet(recording(3))])


def test_plain_data_have_what_the_contract_names(healthy):
    data = next(c for c in look_at([healthy.within(0.0, 6.0)]) if c.check == "length").data()
    assert data == {
        "check": "length",
        "recording": "run_1",
        "ok": False,
        "what": "lasts 6 s",
        "remedy": "record 10 s or more, or give another recording by --held-out",
        "stretches": [],
    }


@pytest.mark.parametrize("name", ["/winch_frame/pose", "/bar/pose", "/cables/tension"])
def test_a_sensor_of_the_file_that_was_not_recorded_is_named(name):
    """A machine that lists no such sensor has nothing to record: its frame is fixed."""
    file = load_testbed(THESIS)
    ones = Samples(np.arange(3.0), np.ones((3, 8)))
    topics = "/winch_frame/pose", "/bar/pose", "/cables/tension"
    parts = dict(zip(("frame_pose", "bar_pose", "tension"), topics, strict=True))
    there = {part: ones for part, topic in parts.items() if topic != name}
    measurement = Measurement(Path("run"), "0", file, angle=ones, **there)
    check = sensor_check(measurement)
    assert not check.ok
    assert check.what.startswith(f"{name} is not there: ")
    assert measurement.knows_frame is (name != "/winch_frame/pose")
    unlisted = {topic: own for topic, own in file.testbed.sensors.items() if topic != name}
    machine = file.testbed.model_copy(update={"sensors": unlisted})
    fixed = measurement.with_machine(machine)
    assert sensor_check(fixed).ok
    assert fixed.knows_frame


def test_a_winch_frame_that_is_a_constant_is_fixed_and_none_that_should_move():
    times = np.arange(2000) * 0.01
    file, noise = load_testbed(THESIS), np.random.default_rng(4).standard_normal((2000, 6))
    moving = np.cumsum(0.01 * np.ones((2000, 6)), axis=0)
    fixed = Samples(times, np.tile([0.1, 0.0, -0.2, 0.0, 0.0, 0.5], (2000, 1)))
    told = Samples(times, fixed.values + 1e-4 * noise)
    for frame, words in ((fixed, ""), (told, "the winch frame does not move")):
        poses = {"frame_pose": frame, "bar_pose": Samples(times, moving)}
        found = excitation_check(Measurement(Path("some"), "", file, **poses))
        assert found.ok == (not words)
        assert words in found.what
