import numpy as np
import pytest

from cspm_control.waves.realisation import (
    COARSEST,
    MOST_KNOTS,
    checked_count,
    envelope,
    knot_count,
    start_from_rest,
    synthesise,
)
from cspm_model.motion import Motion
from cspm_msgs_py.errors import InputError

PERIOD = 100.0


def waves(low=0.21, high=1.16, scale=0.1, seed=0):
    generator = np.random.default_rng(seed)
    harmonic = np.arange(int(np.ceil(low * PERIOD)), int(high * PERIOD) + 1)
    shape = (len(harmonic), 6)
    amplitude = generator.normal(size=shape) + 1j * generator.normal(size=shape)
    return scale * amplitude / np.sqrt(len(harmonic)), harmonic


def direct_sum(amplitude, harmonic, time, order=0):
    rotation = 2j * np.pi * harmonic / PERIOD
    return np.real((rotation**order * np.exp(rotation * time)) @ amplitude)


@pytest.mark.parametrize("count", [5000, 5001])
def test_knots_are_the_sum_of_waves_and_its_derivatives(count):
    amplitude, harmonic = waves()
    knots = synthesise(amplitude, harmonic, PERIOD, count)
    for i in (0, 1, 777, count - 1):
        for order in range(3):
            expected = direct_sum(amplitude, harmonic, i * PERIOD / count, order)
            assert knots[i, 6 * order : 6 * order + 6] == pytest.approx(expected, abs=1e-11)


@pytest.mark.parametrize(("high", "scale"), [(1.16, 0.1), (1.16, 3.0), (8.0, 0.1), (20.0, 0.3)])
def test_spline_follows_the_sum_of_waves_between_knots(high, scale):
    amplitude, harmonic = waves(high=high, scale=scale)
    bound = np.abs(amplitude).sum(axis=0).max()
    count = knot_count(PERIOD, harmonic[-1] / PERIOD, bound)
    motion = Motion(synthesise(amplitude, harmonic, PERIOD, count), PERIOD / count, periodic=True)
    assert motion.spacing <= COARSEST
    assert motion.duration == pytest.approx(PERIOD, rel=1e-12)
    middles = (np.random.default_rng(1).integers(0, count, 300) + 0.5) * motion.spacing
    error = [motion.at(t)[:6] - direct_sum(amplitude, harmonic, t) for t in middles]
    assert np.abs(error).max() < 1e-8


def test_fast_and_large_motions_get_closer_knots():
    slow = knot_count(PERIOD, 1.16, 0.3)
    assert slow == PERIOD / COARSEST
    assert knot_count(PERIOD, 10.0, 0.3) > 2 * slow
    assert knot_count(PERIOD, 10.0, 30.0) > 2 * knot_count(PERIOD, 10.0, 0.3)


def test_too_many_knots_are_refused_in_one_line():
    assert checked_count(MOST_KNOTS) == MOST_KNOTS
    with pytest.raises(InputError) as caught:
        knot_count(10_800.0, 25.0, 0.3)
    assert "allowed: at most 2000000 (a shorter time or lower frequencies)" in str(caught.value)
    with pytest.raises(InputError, match="allowed: at most 2000000"):
        start_from_rest(np.zeros((5, 18)), 0.02, 1.0, 1e6)


def test_envelope_rises_from_rest_to_rest():
    value, rate, acceleration = envelope(np.array([-1.0, 0.0, 2.0, 4.0, 9.0]), 4.0)
    assert value == pytest.approx([0.0, 0.0, 0.5, 1.0, 1.0])
    assert rate == pytest.approx([0.0, 0.0, 1.875 / 4, 0.0, 0.0])
    assert acceleration == pytest.approx(np.zeros(5))
    t, h = np.linspace(0.1, 3.9, 20), 1e-5
    before, now, after = (envelope(t + k * h, 4.0) for k in (-1, 0, 1))
    assert (after[0] - before[0]) / (2 * h) == pytest.approx(now[1], abs=1e-8)
    assert (after[1] - before[1]) / (2 * h) == pytest.approx(now[2], abs=1e-8)


def test_a_ramp_starts_from_rest_and_ends_in_the_waves():
    amplitude, harmonic = waves()
    periodic = synthesise(amplitude, harmonic, PERIOD, 5000)
    motion = Motion(start_from_rest(periodic.copy(), 0.02, 10.0, 250.0), 0.02)
    whole = Motion(periodic, 0.02, periodic=True)
    assert (motion.at(0.0) == 0.0).all()
    assert motion.duration >= 250.0
    for time in (10.0, 10.013, 60.0, 130.017, 249.99):
        assert motion.at(time) == pytest.approx(whole.at(time), abs=1e-9)
    for time in np.random.default_rng(0).uniform(0.0, 10.0, 50):
        expected = envelope(np.array(time), 10.0)[0] * direct_sum(amplitude, harmonic, time)
        assert motion.at(time)[:6] == pytest.approx(expected, abs=1e-8)
