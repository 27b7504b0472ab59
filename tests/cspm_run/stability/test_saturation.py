"""Drives at their torque limit: the share of the time, and chatter or stretches."""

import numpy as np
import pytest

from cspm_run.stability.saturation import saturation_of, saturation_words

TIMES = 1e-3 * np.arange(2000)
LIMITS = np.array([0.5, 0.5, 0.5])
NAMES = ("hoist", "surge", "sway")


@pytest.fixture
def torques():
    """The first never at its limit, the second by turns, the third for 0.3 s at the lower one."""
    found = np.full((2000, 3), 0.49)
    found[::4, 1] = 0.5
    found[500:800, 2] = -0.51
    return found


def test_shares_and_longest_stretches_are_those_of_the_samples(torques):
    never, chatter, stretch = saturation_of(TIMES, torques, LIMITS, NAMES)
    assert never == ("hoist", 0.0, 0.0)
    assert (chatter.share, chatter.longest) == (0.25, pytest.approx(1e-3))
    assert (stretch.share, stretch.longest) == (0.15, pytest.approx(0.3))
    assert chatter.words == "surge 25.0 % (chatter, at most 1 ms)"
    assert stretch.words == "sway 15.0 % (stretches, up to 300 ms)"


def test_words_leave_out_what_hardly_happened(torques):
    torques[500:800, 2] = 0.0
    torques[0, 2] = 0.6
    found = saturation_of(TIMES, torques, LIMITS, NAMES)
    assert saturation_words(found, 0.01) == "surge 25.0 % (chatter, at most 1 ms)"
    assert saturation_words(found, 0.5) == ""
