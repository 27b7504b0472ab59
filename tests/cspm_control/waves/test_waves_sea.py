import numpy as np
import pytest
from scipy import stats

from cspm_control.waves.sea import draw_waves, spreading_offset, wave_number


def test_frequencies_are_the_multiples_inside_the_band():
    waves = draw_waves((0.21, 1.16), 200.0, 0.0, 15.0, seed=1)
    assert waves.harmonic[0] == 42
    assert waves.harmonic[-1] == 232
    assert (np.diff(waves.harmonic) == 1).all()
    assert waves.frequency[0] == pytest.approx(0.21)


def test_same_seed_same_sea_other_seed_other_sea():
    first, again, other = (draw_waves((0.2, 1.0), 100.0, 0.3, 9.0, seed) for seed in (5, 5, 6))
    assert (first.phase == again.phase).all()
    assert (first.direction == again.direction).all()
    assert not (first.phase == other.phase).any()
    assert not (first.direction == other.direction).any()


def test_bodies_with_other_bands_see_the_same_waves():
    frame = draw_waves((0.21, 1.16), 200.0, 0.7, 15.0, seed=2)
    target = draw_waves((0.23, 1.16), 200.0, 0.7, 15.0, seed=2)
    shared = np.isin(frame.harmonic, target.harmonic)
    assert shared.sum() == len(target.harmonic)
    assert not shared.all()
    assert (frame.phase[shared] == target.phase).all()
    assert (frame.direction[shared] == target.direction).all()


def test_seas_with_other_periods_share_the_waves_of_the_same_frequency():
    short = draw_waves((0.2, 1.0), 100.0, 0.7, 15.0, seed=2)
    long = draw_waves((0.2, 1.0), 200.0, 0.7, 15.0, seed=2)
    even = long.harmonic % 2 == 0
    assert (long.harmonic[even] == 2 * short.harmonic).all()
    assert (long.phase[even] == short.phase).all()
    assert not np.isin(long.phase[~even], short.phase).any()


def test_phases_are_uniform_and_independent_of_directions():
    waves = draw_waves((0.1, 20.0), 100.0, 0.0, 5.0, seed=4)
    assert stats.kstest(waves.phase / (2 * np.pi), "uniform").pvalue > 0.01
    assert abs(np.corrcoef(waves.phase, waves.direction)[0, 1]) < 0.05
    assert abs(np.corrcoef(waves.phase[1:], waves.phase[:-1])[0, 1]) < 0.05


@pytest.mark.parametrize("spreading", [0.0, 0.5, 4.0, 15.0, 200.0])
def test_directions_follow_the_cosine_law(spreading):
    angles = np.linspace(-np.pi, np.pi, 20001)
    density = np.cos(angles / 2) ** (2 * spreading)
    cumulative = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]))])
    probability = np.linspace(0.01, 0.99, 31)
    expected = np.interp(probability, cumulative / cumulative[-1], angles)
    assert spreading_offset(probability, spreading) == pytest.approx(expected, abs=1e-4)


def test_directions_lie_about_the_heading():
    waves = draw_waves((0.1, 20.0), 100.0, 2.0, 15.0, seed=4)
    assert waves.direction.mean() == pytest.approx(2.0, abs=0.03)
    assert waves.direction.std() == pytest.approx(np.sqrt(2 / 16), rel=0.08)


def test_phasor_lags_downstream_and_leads_upstream():
    waves = draw_waves((0.35, 0.45), 10.0, 0.4, 10_000.0, seed=1)
    along = 0.01 * np.array([np.cos(waves.direction[0]), np.sin(waves.direction[0])])
    origin = waves.phasor((0.0, 0.0), 9.81)
    downstream = waves.phasor((along[0], along[1]), 9.81)
    across = waves.phasor((-along[1], along[0]), 9.81)
    number = wave_number(waves.angular_frequency, 9.81)
    assert np.angle(downstream / origin) == pytest.approx(-0.01 * number)
    assert across == pytest.approx(origin, abs=1e-12)


def test_dispersion_of_deep_water():
    # a wave 1.56 T² m long has the period T
    period = np.array([1.0, 5.0, 8.0])
    length = 2 * np.pi / wave_number(2 * np.pi / period, 9.81)
    assert length == pytest.approx(1.5613 * period**2, rel=1e-4)
