"""What counts as an oscillation that stays: tones, noise, and tones that come and go."""

import numpy as np
import pytest

from cspm_run.stability.limit_cycle import oscillation

PERIOD = 1e-3
TIMES = PERIOD * np.arange(4096)
NOISE = np.random.default_rng(3).normal(size=(len(TIMES), 3))


def tone(frequency, amplitude, envelope=1.0):
    return amplitude * envelope * np.sin(2.0 * np.pi * frequency * TIMES)


def cables(signal, noise=0.2):
    """Three tensions about 20 N, of which the second has a signal."""
    found = 20.0 + noise * NOISE
    found[:, 1] += signal
    return found


def test_a_tone_is_found_with_its_cable_frequency_and_amplitude():
    found = oscillation(cables(tone(18.3, 6.0)), PERIOD)
    assert found.cable == 1
    assert found.frequency == pytest.approx(18.3, abs=0.25)
    assert found.amplitude == pytest.approx(6.0, rel=0.05)


def test_the_largest_of_several_is_named():
    both = cables(tone(18.3, 6.0))
    both[:, 2] += tone(18.3, 9.0)
    assert oscillation(both, PERIOD).cable == 2


@pytest.mark.parametrize(
    "signal",
    [
        pytest.param(0.0 * TIMES, id="noise alone"),
        pytest.param(tone(0.8, 6.0), id="a wave"),
        pytest.param(tone(18.3, 0.5), id="a ripple"),
        pytest.param(tone(18.3, 6.0, np.exp(-2.0 * TIMES)), id="dies out"),
        pytest.param(tone(18.3, 0.2, np.exp(1.0 * TIMES)), id="grows"),
        pytest.param(8.0 * NOISE[::-1, 0], id="much noise"),
    ],
)
def test_what_else_a_tension_does_is_none(signal):
    assert oscillation(cables(signal), PERIOD) is None


def test_few_periods_show_none():
    tensions = cables(tone(18.3, 6.0))
    assert oscillation(tensions[:1000], PERIOD) is not None
    assert oscillation(tensions[:300], PERIOD) is None
    assert oscillation(tensions[:1], PERIOD) is None
