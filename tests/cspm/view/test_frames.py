"""The grid of frames of a viewer: no spike is lost, no gap is bridged."""

import numpy as np
import pytest

import cspm
from cspm.view.frames import FRAMES_PER_SECOND, LONGEST_GAP_S, envelope, frames_of, interpolated

TIMES = np.arange(31) / 30.0


def samples(rate=1000.0, duration=1.0):
    return np.arange(round(rate * duration) + 1) / rate


def test_the_envelope_keeps_a_spike_of_one_sample():
    at = samples()
    values = np.zeros((len(at), 2))
    values[517, 1] = 5.0
    low, high = envelope(TIMES, at, values)
    assert high[:, 1].max() == 5.0
    assert TIMES[np.argmax(high[:, 1])] == pytest.approx(at[517], abs=0.5 / 30.0 + 1e-9)
    assert not low.any()
    assert not high[:, 0].any()


def test_samples_slower_than_frames_are_connected():
    at = samples(rate=10.0)
    low, high = envelope(TIMES, at, at[:, None])
    np.testing.assert_allclose(0.5 * (low + high)[:, 0], TIMES, atol=1e-12)


@pytest.mark.parametrize(("gap", "drawn"), [(0.9, True), (1.1, False)])
def test_only_short_gaps_are_bridged(gap, drawn):
    at = np.array([0.0, 0.1, 0.1 + gap * LONGEST_GAP_S, 1.0, 1.1])
    found = interpolated(np.array([0.05, 0.3, 0.99]), at, np.ones((5, 1)))[:, 0]
    assert np.isfinite(found[0])
    assert bool(np.isfinite(found[1])) is drawn
    assert np.isfinite(found[2])


def test_nothing_is_drawn_long_after_the_last_sample():
    found = interpolated(np.array([1.4, 1.6]), np.array([0.9, 1.0]), np.ones((2, 1)))[:, 0]
    assert np.isfinite(found[0])
    assert np.isnan(found[1])


@pytest.fixture(scope="module")
def rest():
    return cspm.simulate("rest", duration=1.0)


def test_frames_of_a_run_have_its_poses_and_signals(rest):
    found = frames_of(rest, "rest")
    assert found.period == 1.0 / FRAMES_PER_SECOND
    assert found.count == len(found.poses["bar"]) == 31
    titles = [trace.title for trace in found.traces]
    assert titles[0] == "Bar error, wanted − measured: position"
    tension = found.traces[titles.index("Cable tensions")]
    assert tension.names == rest.testbed.cables
    assert tension.high.max() == rest.tension.values.max()
    assert tension.low.min() == rest.tension.values.min()


def test_the_error_is_wanted_less_measured(rest):
    found = frames_of(rest, "rest").traces[0]
    wanted = np.interp(rest.bar_pose.time, rest.bar_reference.time, rest.bar_reference["heave"])
    error = 1e3 * (wanted - rest.bar_pose["heave"])
    assert found.high[:, 2].max() == pytest.approx(error.max())
    assert found.low[:, 2].min() == pytest.approx(error.min())
