"""Jumps of an encoder's reading, and motion that has none."""

import numpy as np
import pytest

from cspm_ident.signals.jumps import jumps, without_jumps
from cspm_ident.signals.samples import Samples

STEP = 0.004
TIMES = np.arange(3000) * STEP
SINES = 3.0 * np.sin(2.0 * np.pi * 0.7 * TIMES) + 0.4 * np.sin(2.0 * np.pi * 4.3 * TIMES)


def angle(values, times=TIMES):
    return Samples(times, values[:, None])


def spikes():
    values = SINES.copy()
    values[[700, 1500]] += 20.0
    return values, [699, 700, 1499, 1500]


def reset():
    return np.where(TIMES < 6.0, SINES, SINES - 30.0), [1499]


def rollover():
    values = np.mod(SINES, 3.0)
    return values, np.flatnonzero(np.abs(np.diff(values)) > 1.5).tolist()


@pytest.mark.parametrize("made", [spikes, reset, rollover])
def test_each_jump_is_found_and_nothing_else(made):
    values, where = made()
    assert jumps(angle(values)).tolist() == where


def starts_and_stops(rate):
    """A shaft at rest nine tenths of the time, and moves at 16 rad/s for the rest."""
    times = np.arange(0.0, 40.0, 1.0 / rate)
    speed = 16.0 * ((times % 10.0) < 1.0)
    return np.cumsum(speed) / rate, times


@pytest.mark.parametrize("rate", [33.0, 250.0, 1000.0])
def test_a_shaft_that_starts_does_not_jump(rate):
    assert len(jumps(angle(*starts_and_stops(rate)))) == 0


def test_counts_of_a_slow_encoder_are_no_jumps():
    counts = np.round(0.02 * TIMES / 1e-3) * 1e-3
    assert len(jumps(angle(counts))) == 0


def test_stamps_that_nearly_coincide_are_no_jumps():
    """Polled over a bus: 1 ms after 31 ms, with an angle that moved on for 15 ms."""
    times = np.sort(np.concatenate([TIMES[::8], TIMES[::8] + 0.001]))
    moved = np.interp(times + 0.007 * (np.arange(len(times)) % 2), TIMES, SINES)
    assert len(jumps(angle(moved, times))) == 0


def test_a_hole_is_left_at_a_jump():
    values, _ = reset()
    kept = without_jumps(angle(values))
    assert len(kept.spans) == 2
    assert np.isin(kept.times, TIMES).all()
    whole = angle(SINES)
    assert without_jumps(whole) is whole
