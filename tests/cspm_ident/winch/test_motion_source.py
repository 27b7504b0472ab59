"""Accelerations against the noise of the angle, and of stamps that scatter."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from run_samples import SCENARIOS
from winch_samples import EFFECTS, STEP, Winch, closed_loop

from cspm_ident.signals.measurement import Measurement
from cspm_ident.signals.prediction_noise import prediction_noise
from cspm_ident.signals.samples import Samples
from cspm_ident.winch import identify_winch
from cspm_ident.winch.identify_winches import identify_winches
from cspm_ident.winch.motion_source import motion_source, speed_agrees
from cspm_msgs_py.testbed import load_testbed

WINCH = Winch()


@pytest.fixture(scope="module")
def made():
    return closed_loop(WINCH, 8000, torque_noise=0.005, seed=12)


def speed_of(made):
    """As a drive reports it."""
    return Samples(made.angle.times, np.gradient(made.angle.values, STEP, axis=0))


def scattered(samples, every=4, share=0.4):
    """Every so manieth reading, its stamp off by up to a share of the time between two."""
    times, values = samples.times[::every], samples.values[::every]
    apart = share * every * STEP * np.random.default_rng(3).uniform(-1.0, 1.0, len(times))
    return Samples(times + apart, values)


@pytest.mark.parametrize("apart", [np.full(4000, STEP), None])
def test_noise_is_what_a_cubic_does_not_predict(apart):
    rng = np.random.default_rng(1)
    times = np.cumsum(rng.uniform(0.2, 1.8, 4000) * STEP if apart is None else apart)
    smooth = 2.0 * np.sin(2.0 * np.pi * 1.1 * times)
    noisy = Samples(times, (smooth + 1e-3 * rng.standard_normal(4000))[:, None])
    assert np.sqrt(prediction_noise(noisy)) == pytest.approx(1e-3, rel=0.05)
    assert np.sqrt(prediction_noise(Samples(times, smooth[:, None]))) < 1e-5


def test_a_good_angle_shows_accelerations_though_there_is_a_speed(made):
    found = motion_source([made], [speed_of(made)], EFFECTS, reversals=False)
    assert found.signals[0].speed is None
    assert found.shows_acceleration
    assert found.noise_share < 0.01


def test_scattering_stamps_hide_accelerations(made):
    jittered = dataclasses.replace(made, angle=scattered(made.angle))
    found = motion_source([jittered], [None], EFFECTS, reversals=False)
    assert not found.shows_acceleration
    # Uniform: 0.4/√3 of the period.
    assert found.stamp_error == pytest.approx(0.4 * 4 * STEP / np.sqrt(3.0), rel=0.25)
    inertia = identify_winch(found.signals, EFFECTS, reversals=False).estimate.values[0]
    assert inertia < (1.0 - 0.7 * found.noise_share) * WINCH.inertia


def test_many_readings_in_a_window_average_their_stamps_scatter(made):
    jittered = dataclasses.replace(made, angle=scattered(made.angle, every=1))
    found = motion_source([jittered], [None], EFFECTS, reversals=False)
    assert found.shows_acceleration
    inertia = identify_winch(found.signals, EFFECTS, reversals=False).estimate.values[0]
    assert inertia == pytest.approx(WINCH.inertia, rel=0.03)


def test_the_drives_speed_shows_them_instead(made):
    jittered = dataclasses.replace(made, angle=scattered(made.angle))
    reported = scattered(speed_of(made))
    found = motion_source([jittered], [reported], EFFECTS, reversals=False)
    assert found.signals[0].speed is reported
    assert found.shows_acceleration
    estimate = identify_winch(found.signals, EFFECTS, reversals=False).estimate
    np.testing.assert_allclose(estimate.values[:3], WINCH.values[:3], rtol=0.05)


@pytest.mark.parametrize("held_out", [0, 1])
def test_the_drives_speed_serves_with_recordings_held_out_and_without(made, held_out):
    every = [
        Measurement(
            Path(name),
            name,
            load_testbed(SCENARIOS / "testbeds" / "emps.yaml"),
            angle=scattered(made.angle),
            speed=scattered(speed_of(made)),
            torque=made.torque,
        )
        for name in ("searched", "judging")[: 1 + held_out]
    ]
    found = identify_winches(every[:1], held_out=every[1:], torque_age=made.torque_age)
    (winch,) = found.winches
    assert winch.from_speed
    assert [each.held_out for each in winch.judgements] == [False, True][: 1 + held_out]
    np.testing.assert_allclose(winch.fit.estimate.values[:3], WINCH.values[:3], rtol=0.05)


def test_a_speed_in_another_unit_is_none(made):
    speed = speed_of(made)
    assert speed_agrees(made.angle, speed)
    for wrong in (speed.values / 60.0, -speed.values, 1.2 * speed.values):
        assert not speed_agrees(made.angle, Samples(speed.times, wrong))
