"""Measured signals: holes, smoothing without phase, noise, winch motion."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from cspm_ident.signals.noise import noise_above_band, noise_between
from cspm_ident.signals.samples import Samples, ordered, stretches
from cspm_ident.signals.smoothing import band_of, filtered, smooth
from cspm_ident.signals.winch_motion import ENCODER_BAND_HZ, winch_motion

RATE = 1000.0
TIMES = np.arange(0, 20, 1 / RATE)


def wave(frequency, times=TIMES):
    return np.sin(2 * np.pi * frequency * times)[:, None]


def noise(deviation, seed=1, times=TIMES):
    return deviation * np.random.default_rng(seed).standard_normal((len(times), 1))


def test_samples_come_in_order_once_and_whole():
    times = np.array([0.0, 0.2, 0.1, 0.1, 0.3])
    values = np.array([[0.0], [2.0], [1.0], [9.0], [np.nan]])
    found = ordered(times, values)
    assert found.times.tolist() == [0.0, 0.1, 0.2]
    assert found.values[:, 0].tolist() == [0.0, 1.0, 2.0]


def test_a_hole_parts_the_samples_and_a_missing_one_does_not():
    times = np.concatenate([np.arange(50) * 0.01, 1.0 + np.arange(50) * 0.01])
    assert Samples(times, times[:, None]).spans == [slice(0, 50), slice(50, 100)]
    once = np.delete(np.arange(100) * 0.01, 40)
    assert Samples(once, once[:, None]).spans == [slice(0, 99)]


def test_smoothing_leaves_what_is_in_the_band_where_it_is():
    found = smooth(Samples(TIMES, wave(1.0) + noise(0.1)), band=5.0)
    inner = TIMES[2000:-2000]
    # Noise left: 0.1·√(2·5/1000) = 0.01; a lag of 5 ms would be an error of 0.03.
    assert np.abs(found.at(inner) - wave(1.0, inner)).max() < 0.05
    rate = 2 * np.pi * np.cos(2 * np.pi * inner)[:, None]
    assert np.sqrt(np.mean((found.at(inner, 1) - rate) ** 2)) < 0.3


def test_smoothing_knows_nothing_of_holes():
    times = np.concatenate([TIMES[:5000], TIMES[8000:]])
    found = smooth(Samples(times, wave(1.0, times)))
    assert np.isnan(found.at(np.array([6.5]))).all()
    assert np.isfinite(found.at(np.array([4.0, 9.0]))).all()


def test_what_stands_still_has_no_speed_at_all():
    """A rounding error would have a sign, and with it dry friction."""
    still = smooth(Samples(TIMES, np.full((len(TIMES), 2), [512.3, -0.1])))
    assert not still.at(TIMES[:-1] + 3e-4, 1).any()
    assert not still.at(TIMES, 2).any()
    np.testing.assert_array_equal(still.at(TIMES[:5]), np.full((5, 2), [512.3, -0.1]))


def test_fewer_knots_do_not_show():
    """At the band's edge, where a spline has the fewest knots per period."""
    found = smooth(Samples(TIMES, wave(4.0)), band=5.0)
    every = CubicSpline(TIMES, filtered(Samples(TIMES, wave(4.0)), band=5.0)[0])
    inner = TIMES[2000:-2000]
    assert len(found.pieces[0].c) < 0.25 * len(TIMES)
    assert np.abs(found.at(inner) - every(inner)).max() < 1e-4
    assert np.abs(found.at(inner, 1) - every(inner, 1)).max() < 1e-3 * 2 * np.pi * 4.0
    assert found.spans.tolist() == [[TIMES[0], TIMES[-1]]]


def test_long_records_are_represented_by_stretches_of_all_of_them():
    values = np.arange(100_000)[:, None]
    found = stretches(values, 1000, 10)
    assert len(found) == 10_000
    assert (found[0, 0], found[-1, 0]) == (0, 99_999)
    assert (np.diff(found[:, 0]) == 1).sum() == 10_000 - 10
    assert stretches(values, 1000, 100) is values


@pytest.mark.parametrize("frequency", [2.0, 8.0, 30.0])
def test_the_band_ends_above_the_signal_and_well_below_the_rate(frequency):
    found = band_of(Samples(TIMES, wave(frequency) + noise(0.05)))
    assert frequency < found < 3 * frequency + 2


def test_a_signal_without_noise_is_not_smoothed():
    chirp = np.sin(2 * np.pi * 12 * TIMES**2)[:, None]
    assert not np.isfinite(smooth(Samples(TIMES, chirp)).band)


def test_noise_is_found_beside_a_signal_and_between_repeats():
    first = Samples(TIMES, wave(1.0) + noise(0.05, seed=1))
    second = Samples(TIMES, wave(1.0) + noise(0.05, seed=2))
    assert noise_above_band(first)[0] == pytest.approx(0.05, rel=0.05)
    assert noise_between(first, second)[0] == pytest.approx(0.05, rel=0.05)
    # A motion that is not repeated counts as noise, which is why repeats must be repeats.
    assert noise_between(first, Samples(TIMES, wave(1.3)))[0] > 0.5


def encoder(step):
    """Fast motion of 3 mrad at 60 Hz on a slow one; angle in steps, speed with noise."""
    angle = 0.5 * wave(0.5) + 0.003 * wave(60.0)
    speed = 0.5 * np.pi * np.cos(np.pi * TIMES) + 0.003 * 120 * np.pi * np.cos(120 * np.pi * TIMES)
    rounded = np.round(angle / step) * step
    return angle, Samples(TIMES, rounded), Samples(TIMES, speed[:, None] + noise(0.01))


def test_speeds_show_motion_that_an_encoder_hides():
    angle, rounded, speed = encoder(step=0.01)
    inner = slice(2000, -2000)
    both = winch_motion(rounded, speed, TIMES)
    alone = winch_motion(rounded, None, TIMES)
    error = [np.sqrt(np.mean((m.angles - angle)[inner] ** 2)) for m in (both, alone)]
    assert error[0] < 0.5 * error[1]
    assert not np.isfinite(both.band)
    assert alone.band == ENCODER_BAND_HZ


def test_speeds_sum_up_to_a_fast_swing_without_losing_any_of_it():
    """Trapezoids make a swing of 15 Hz, read at 1 kHz, a thousandth too small, straight lines as
    much between the readings."""
    rates = 2.0 * np.pi * np.array([15.0, 0.5])
    between = TIMES[2000:-2000] + 0.4 / RATE

    def turned(times):
        return np.sin(np.outer(times, rates)).sum(axis=1, keepdims=True)

    speed = (rates * np.cos(np.outer(TIMES, rates))).sum(axis=1, keepdims=True)
    found = winch_motion(Samples(TIMES, turned(TIMES)), Samples(TIMES, speed), between)
    assert not np.isfinite(found.band)
    apart = found.angles - turned(between)
    assert np.abs(apart - apart.mean()).max() < 5e-5


def test_stamps_that_scatter_are_taken_for_even_ones():
    scattered = TIMES + 1e-5 * np.random.default_rng(3).uniform(-1.0, 1.0, len(TIMES))
    samples = Samples(scattered, wave(1.0))
    np.testing.assert_allclose(samples.even.times, TIMES, atol=2e-6)
    assert np.abs(samples.times - TIMES).max() > 9e-6
    assert samples.even.values is samples.values


def test_stamps_of_no_even_clock_are_filtered_where_they_are():
    """A third of the readings come a fifth of a period later than the median says."""
    late = np.random.default_rng(7).uniform(size=4000) < 0.33
    times = np.cumsum(np.where(late, 0.012, 0.01))
    true = 5.0 * wave(0.3, times)
    samples = Samples(times, true + noise(1e-3, times=times))
    np.testing.assert_array_equal(samples.even.times, times)
    found, _ = filtered(samples, 5.0)
    inner = slice(200, -200)
    assert np.std((found - true)[inner]) < 1e-3
    speed = 5.0 * 0.6 * np.pi * np.cos(0.6 * np.pi * times)
    # By the readings' numbers, not their stamps, the speed was wrong by 7 %.
    apart = smooth(samples, 5.0).at(times, 1)[inner, 0] - speed[inner]
    assert np.std(apart) < 0.005 * np.std(speed)


def test_speeds_are_used_where_winches_do_little_but_tremble():
    """A filter's ends, which see one side only, are no disagreement of encoder and speed."""
    generator = np.random.default_rng(5)
    rough = np.zeros(len(TIMES))
    for _ in range(3):
        rough = np.convolve(generator.standard_normal(len(TIMES)), [1.0, -1.0], "same") + rough
    speed = rough[:, None] + 0.02 * wave(0.5)
    steps = 0.5 * (speed[1:] + speed[:-1]) * np.diff(TIMES)[:, None]
    angle = np.concatenate([np.zeros((1, 1)), np.cumsum(steps, axis=0)])
    rounded = Samples(TIMES, np.round(angle / 7.67e-4) * 7.67e-4)
    assert not np.isfinite(winch_motion(rounded, Samples(TIMES, speed), TIMES).band)


def test_a_speed_of_the_wrong_sign_is_not_used():
    _, rounded, speed = encoder(step=0.001)
    wrong = Samples(speed.times, -speed.values)
    assert winch_motion(rounded, wrong, TIMES).band == ENCODER_BAND_HZ
