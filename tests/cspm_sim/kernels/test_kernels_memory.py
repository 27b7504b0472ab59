"""States along samples against filters and definitions that others wrote."""

import numpy as np
import pytest
from scipy.signal import lfilter

from cspm_sim.kernels.memory import played, relaxed


@pytest.mark.parametrize("kept", [0.0, 0.3, 0.99])
def test_a_state_that_relaxes_is_a_first_order_filter(kept):
    targets = np.random.default_rng(1).normal(size=(50, 2))
    out = np.zeros((50, 2))
    relaxed(targets, np.full((50, 2), kept), out)
    expected = lfilter([1.0 - kept], [1.0, -kept], targets[1:], axis=0)
    assert np.allclose(out[1:], expected, rtol=0.0, atol=1e-12)
    assert not out[0].any()


def test_what_is_kept_may_change_from_step_to_step():
    out = np.array([[1.0], [0.0], [0.0], [0.0]])
    relaxed(np.full((4, 1), 3.0), np.array([[0.0], [1.0], [0.5], [0.0]]), out)
    assert out[:, 0].tolist() == [1.0, 1.0, 2.0, 3.0]


def test_a_play_is_taken_up_from_either_side():
    turned = np.array([0.0, -0.2, -0.2, 0.1, 0.5, -0.1, -0.1])
    taut = np.array([False, False, False, False, False, False, True])
    out = np.zeros(7)
    played(turned, taut, 0.3, out)
    assert out == pytest.approx([0.0, 0.2, 0.3, 0.2, 0.0, 0.1, 0.0])
