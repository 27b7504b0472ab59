"""Hoisting and lowering by hand, and what the winches feel of the switch to tracking."""

import numpy as np
import pytest
from loops import Listener
from run_samples import bundle_of

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.schedule import BAR_REFERENCE, TENSION_COMMAND, TORQUE_COMMAND

IDEAL = "sensors=ideal"
SWITCH_MS = 3000


def heard(*overrides, blend=2.0):
    hoist = "{at: 0.5, mode: manual, blend: 1.0, rate: [0, 0, -0.05, 0, 0, 0]}"
    track = f"{{at: 3.0, mode: track, blend: {blend}}}"
    operation = f"operation=[{hoist}, {track}]"
    return Listener(bundle_of("manual_hoist", "duration=6", IDEAL, operation, *overrides)).run(5500)


def largest_step(rows):
    """Return the largest change from one ms to the next about the switch."""
    return np.abs(np.diff(rows[SWITCH_MS - 100 : SWITCH_MS + 100], axis=0)).max()


@pytest.mark.compiled
def test_torque_and_tension_have_no_step_at_the_switch():
    smooth, hard = heard(), heard(blend=0.0)
    for topic, usual in ((TENSION_COMMAND, 0.02), (TORQUE_COMMAND, 0.001)):
        assert largest_step(smooth.rows(topic)) < usual
        assert largest_step(hard.rows(topic)) > 50 * usual


@pytest.mark.compiled
def test_the_bar_follows_by_hand_as_it_does_on_its_own():
    found = heard()
    wanted, there = found.rows(BAR_REFERENCE)[:, 2], found.rows("/truth/bar/pose")[:, 2]
    assert np.ptp(wanted) > 0.1
    assert np.abs(wanted - there).max() < 0.001
    assert found.parts.plant.time == pytest.approx(5.5)


def test_the_scenario_hoists_by_0_3_m_and_comes_back():
    reference = Listener(bundle_of("manual_hoist")).parts.references[BAR_REFERENCE].motion
    begin, top, down = (reference.at(t)[2] for t in (6.0, 16.0, 29.0))
    assert top - begin == pytest.approx(-0.3, abs=1e-9)
    assert down - top == pytest.approx(0.3, abs=1e-9)


def test_a_rate_that_tips_the_bar_is_refused():
    tipping = "operation=[{at: 0.0, mode: manual, rate: [0, 0, 0, 0, 1.0, 0]}]"
    bundle = bundle_of("manual_hoist", "duration=6", tipping)
    with pytest.raises(InputError, match=r"^motion: pitch reaches .* rad about the mean pose"):
        Listener(bundle)
