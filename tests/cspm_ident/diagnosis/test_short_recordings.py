"""What distinguishes motion from noise in a recording of a few seconds, and where nothing does."""

from dataclasses import replace

import numpy as np
import pytest
from machines import THESIS
from measured_samples import measured_with

from cspm_ident.diagnosis.diagnose import diagnose
from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.samples import Samples
from cspm_ident.signals.smoothing import band_of
from cspm_ident.system.shooting import make_shooting
from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import load_testbed

FILE = load_testbed(THESIS)
RATE = 100.0


def poses(seconds, seed, height=0.02, noise=5e-5, frequency=1.1):
    times = np.arange(round(seconds * RATE)) / RATE
    rng = np.random.default_rng(seed)
    values = noise * rng.standard_normal((len(times), 6))
    values[:, 0] += height * np.sin(2.0 * np.pi * frequency * times)
    values[:, 2] += 2.0
    return Samples(times, values)


@pytest.mark.parametrize("seconds", [3.0, 5.0, 9.0, 13.0])
def test_noise_does_not_pass_for_motion(seconds):
    """Six columns in 25 recordings: with a fixed threshold some noise stood out in nearly each."""
    bands = [band_of(poses(seconds, seed)) for seed in range(25)]
    assert max(bands) < 12.0
    assert min(bands) > 1.1


def test_fast_motion_is_kept_in_a_short_recording():
    assert band_of(poses(5.0, 1, frequency=9.0)) > 9.0


def measurement(bar, frame=None):
    times = np.arange(0.0, bar.times[-1] + 1e-9, 1e-3)
    still = Samples(times, np.zeros((len(times), 8)))
    return Measurement(
        THESIS,
        "ab" * 32,
        FILE,
        frame_pose=frame or poses(bar.times[-1], 7),
        bar_pose=bar,
        angle=still,
        tension=Samples(still.times, np.full(still.values.shape, 5.0)),
    )


def test_poses_that_are_all_noise_say_how_long_is_enough():
    rng = np.random.default_rng(3)
    wild = Samples(np.arange(31) / RATE, rng.standard_normal((31, 6)))
    with pytest.raises(InputError) as said:
        make_shooting(measurement(wild, wild), 0.1, 2, {})
    assert str(said.value) == (
        f"{THESIS}: 0.3 s, the motion of its poses does not stand out of their noise; allowed: a"
        " recording of at least 12 s, or motion capture at a higher rate"
    )


def test_a_recording_shorter_than_half_a_window_says_so():
    with pytest.raises(InputError) as said:
        make_shooting(measurement(poses(1.5, 2)), 4.0, 2, {})
    assert str(said.value) == (
        f"{THESIS}: of 1.5 s no stretch of 2 s is without a hole, allowed: a longer recording or a"
        " shorter --horizon"
    )


def test_a_shaft_that_reverses_in_every_window_is_refused_in_one_line(tmp_path):
    measured = measured_with("", tmp_path / "rig", "one_winch", "duration=6")
    shaken = np.sin(2.0 * np.pi * 30.0 * measured.angle.times)[:, None]
    angle = measured.angle.of_others(shaken)
    with pytest.raises(
        InputError, match=r"reverse all the time, allowed: .* with a known direction"
    ):
        diagnose([replace(measured, angle=angle, speed=None, command=None)])
