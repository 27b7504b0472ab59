"""What is left of a residual: noise or not, whatever windows and units it has."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis_samples import PLACE, held_out, remainder
from hypothesis import given
from hypothesis import strategies as st

from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.thresholds import Thresholds
from cspm_ident.diagnosis.validation.remainder import (
    independent_noise,
    is_immaterial,
    remainders_of,
)
from cspm_ident.winch.weak_form import make_window, weigh

STEP_S, HALF = 0.001, 20


def windowed(samples, second=False):
    """Rows as the residuals have them: windows of 40 ms, one every 10 ms."""
    window = make_window(HALF, STEP_S)
    weights = window.second if second else window.weights
    return weigh(weights, samples, HALF // 2)


def equation(left, measured=None, signals=None, times=None):
    times = 0.01 * np.arange(len(left)) if times is None else times
    measured = np.zeros(len(left)) if measured is None else measured
    return Equation(PLACE, times, left[:, None], {}, measured[:, None], signals=signals or {})


def left_of(rows, accuracy=float("nan"), **others):
    own = equation(rows, **others)
    (found,) = remainders_of([own], independent_noise([own]), np.ones(1), accuracy)
    return found


@pytest.mark.parametrize("second", [False, True])
@pytest.mark.parametrize("count", [400, 1000, 10_000])
def test_white_noise_is_at_its_noise_as_often_as_is_promised(second, count):
    """Of 600 series hardly one may exceed the ratio; neighbouring rows share their windows."""
    rng = np.random.default_rng(5)
    found = [left_of(windowed(rng.standard_normal(count), second)) for _ in range(600)]
    ratios = np.array([each.ratio for each in found])
    assert np.median(ratios) == pytest.approx(1.0, abs=0.12)
    assert sum(not each.is_at_noise() for each in found) <= 4


@pytest.mark.parametrize("rows", [150, 1000])
@pytest.mark.parametrize("frequency_hz", [3.0, 9.0])
def test_a_function_of_a_signal_is_no_noise_however_fast_it_changes(frequency_hz, rows):
    """Dry friction of a shaft that reverses within a few rows: all differences in time have it."""
    rng, times = np.random.default_rng(4), 0.01 * np.arange(rows)
    speed = np.cos(2 * np.pi * frequency_hz * times + 0.3 * np.sin(times))
    noise = windowed(rng.standard_normal(len(times) * HALF))[: len(times)]
    friction = 3.0 * np.std(noise) * np.sign(speed)
    found = left_of(noise + friction, signals={"speed [rad/s]": speed})
    assert found.noise == pytest.approx(np.std(noise), rel=0.4)
    assert not found.is_at_noise()
    assert found.excess == pytest.approx(3.0 * np.std(noise), rel=0.2)
    assert left_of(noise, signals={"speed [rad/s]": speed}).is_at_noise()
    in_time = left_of(noise + friction).noise
    assert in_time > 1.5 * np.std(noise), "in time it is taken for noise"


@pytest.mark.parametrize("rows", [30, 90, 300, 1000])
def test_noise_is_a_function_of_no_signal(rows):
    """One of 1000 may be by chance, with three signals as with one."""
    rng, times = np.random.default_rng(6), 0.01 * np.arange(rows)
    signals = {f"signal {k}": np.sin((1 + k) * times + k) for k in range(3)}
    found = [
        left_of(windowed(rng.standard_normal(10 * rows + 2 * HALF))[:rows], signals=signals)
        for _ in range(400)
    ]
    assert sum(each.is_function for each in found) <= 3


@pytest.mark.parametrize("frequency_hz", [0.2, 1.0, 3.0])
def test_what_lasts_longer_than_a_window_is_no_noise(frequency_hz):
    rng, times = np.random.default_rng(1), STEP_S * np.arange(20_000)
    noise = windowed(rng.standard_normal(len(times)))
    wave = windowed(np.sin(2 * np.pi * frequency_hz * times))
    wave *= 3.0 * np.std(noise) / np.std(wave)
    assert not left_of(noise + wave).is_at_noise()
    assert left_of(noise).is_at_noise()


def test_dry_friction_is_not_taken_for_noise_at_any_sampling():
    """Steps where a shaft reverses enter differences, yet far less than what lasts."""
    rng = np.random.default_rng(2)
    for every in (40, 100, 400):
        steps = np.sign(np.sin(np.pi * np.arange(4000) / every))
        assert left_of(0.1 * rng.standard_normal(4000) + steps).ratio > 1.5


def test_rows_across_a_gap_are_no_neighbours():
    rng = np.random.default_rng(3)
    rows = 0.01 * rng.standard_normal(400) + np.repeat(np.arange(10.0), 40)
    gone = 0.01 * np.arange(400) + np.repeat(np.arange(10.0), 40)
    together, apart = equation(rows), equation(rows, times=gone)
    assert independent_noise([apart])[0] == pytest.approx(0.01, rel=0.15)
    assert independent_noise([together])[0] > 0.1


def test_short_runs_are_compared_row_by_row():
    """Rows of six at a time: only neighbours are near, whose windows overlap."""
    rng = np.random.default_rng(4)
    runs = [windowed(rng.standard_normal(2 * HALF + 51)) for _ in range(60)]
    own = [equation(run) for run in runs]
    truth = np.sqrt(np.mean(np.concatenate(runs) ** 2))
    assert independent_noise(own)[0] == pytest.approx(truth, rel=0.15)


def test_of_too_few_rows_nothing_is_known():
    found = left_of(np.random.default_rng(0).standard_normal(10))
    assert not found.is_judged
    assert not found.is_at_noise()
    assert not found.is_excited()


@given(unit=st.floats(1e-3, 1e3), size=st.floats(0.0, 10.0))
def test_the_judgement_is_the_same_in_any_unit(unit, size):
    rng = np.random.default_rng(6)
    rows = 0.1 * rng.standard_normal(500) + size * np.sin(0.05 * np.arange(500))
    measured = np.sin(0.02 * np.arange(500))
    plain = left_of(rows, 0.05, measured=measured)
    other = left_of(unit * rows, unit * 0.05, measured=unit * measured)
    assert other.is_at_noise() is plain.is_at_noise()
    assert other.is_excited() is plain.is_excited()
    assert other.ratio == pytest.approx(plain.ratio)


@pytest.mark.parametrize(
    ("size", "accuracy", "immaterial"),
    [
        (0.04, 0.05, True),
        (0.04, 0.03, False),  # small, but the sensor resolves it
        (0.06, 0.07, False),  # a larger share, though the sensor does not resolve it
        (0.04, float("nan"), True),
        (0.06, float("nan"), False),
    ],
)
def test_immaterial_is_small_and_below_the_accuracy(size, accuracy, immaterial):
    assert is_immaterial(size, 1.0, accuracy) is immaterial
    strict = Thresholds(immaterial_share=0.01)
    assert not is_immaterial(size, 1.0, accuracy, strict)


def test_its_driver_and_its_stretch_are_found():
    rng, count = np.random.default_rng(7), 1000
    angle, other = np.linspace(0.0, 40.0, count), rng.standard_normal(count)
    signals = {"angle [rad]": angle % 6.0, "tension [N]": other, "time [s]": angle}
    found = left_of(np.cos(angle % 6.0) + 0.1 * other[::-1], signals=signals)
    assert found.driver == "angle [rad]"
    assert found.share > 0.8
    burst = 0.1 * rng.standard_normal(count)
    burst[600:700] += 5.0
    stretch = left_of(burst).stretch
    assert (stretch.start, stretch.end) == pytest.approx((6.0, 6.99))
    assert stretch.share > 0.9


def test_a_quantity_that_hardly_moves_judges_nothing():
    quiet = remainder(rms=0.001, measured=0.002)
    assert quiet.noise == pytest.approx(0.001)
    assert not quiet.is_excited()
    assert quiet._replace(measured=0.0031).is_excited()


def test_a_residual_is_at_its_noise_if_each_channel_is():
    whole = held_out(0.001)
    assert whole.is_at_noise() is True
    worse = replace(whole, remainders=(*whole.remainders, remainder(0.1)))
    assert worse.is_at_noise() is False
    assert replace(whole, remainders=()).is_at_noise() is None
