"""When a finding shows most: where its residual is lowered, of whichever curve."""

from dataclasses import replace

import numpy as np
import pytest

from cspm_ident.diagnosis.reporting.shown_place import most_lowered
from cspm_ident.diagnosis.residuals.regressors import Place
from cspm_ident.diagnosis.validation.residual_curves import Curve
from cspm_sim.effects import Channel

TIMES = np.arange(2000) / 100.0


def curve(middle, recording=0, height=1.0):
    """A residual of noise with a bump of 1 s, which the findings take away."""
    noise = 0.1 * height * np.random.default_rng(4).normal(size=len(TIMES))
    bump = height * (np.abs(TIMES - middle) < 0.5)
    place = Place(Channel.SHAFT, "surge_2")
    return Curve(place, "", TIMES, bump, bump + noise, noise, {}, (), recording)


def test_the_stretch_is_where_the_residual_is_lowered():
    found, time = most_lowered([curve(7.3)])
    assert found is not None
    assert time == pytest.approx(7.3, abs=0.05)


def test_units_do_not_decide_between_curves():
    clear = curve(7.3)
    noisy = replace(curve(12.0, recording=1, height=1e3))
    noisy = replace(noisy, after=0.9 * noisy.before)
    found, time = most_lowered([noisy, clear])
    assert found is clear
    assert time == pytest.approx(7.3, abs=0.05)


def test_what_makes_a_residual_worse_shows_nowhere():
    worse = curve(7.3)
    worse = replace(worse, before=worse.after, after=worse.before)
    silent = replace(worse, before=0.0 * TIMES, after=0.0 * TIMES)
    assert most_lowered([worse, silent]) == (None, 0.0)
    assert most_lowered([]) == (None, 0.0)
