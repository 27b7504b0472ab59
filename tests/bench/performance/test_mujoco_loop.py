"""The closed loop around MuJoCo is the same with controllers in Python and in its C callback."""

import mujoco
import numpy as np
import pytest

from bench.performance.mujoco_model.loop import MujocoLoop, loop_ways

STEPS = 300


@pytest.mark.compiled
@pytest.mark.parametrize("integrator", ["RK4", "Euler"])
def test_both_ways_are_the_same_bit_for_bit_and_hold_the_bar(integrator):
    one, other, free = (MujocoLoop(integrator) for _ in range(3))
    start = one.pose
    one.by_python(STEPS)
    other.by_python(1)
    other.by_callback(STEPS - 1)
    np.testing.assert_array_equal(other.pose, one.pose)
    np.testing.assert_array_equal(other.ctrl, one.ctrl)
    assert mujoco.get_mjcb_control() is None
    assert np.abs(one.ctrl).max() > 0.1
    # Pushed, the bar stays within a centimetre; what nobody controls does not do the same.
    free._machine.advance(STEPS)
    assert 1e-4 < np.abs(one.pose - start)[:3].max() < 0.01
    assert np.abs(free.pose - one.pose).max() > 1e-4


@pytest.mark.compiled
def test_prices_name_both_integrators_and_both_kinds_of_controllers():
    prices = {what: price() for what, _, price in loop_ways()}
    assert len(prices) == 4
    assert all(np.isfinite(price) and price > 0.0 for price in prices.values())
