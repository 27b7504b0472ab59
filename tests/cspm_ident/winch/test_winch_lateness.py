"""A torque that is late against the angle, and one that is not."""

import dataclasses

import numpy as np
import pytest
from winch_samples import EFFECTS, STEP, Winch, closed_loop

from cspm_ident.signals.samples import Samples
from cspm_ident.winch import identify_winch
from cspm_ident.winch.lateness import at_age, fit_beside_lateness, lateness_of

WINCH = Winch()


def shifted(made, seconds):
    """The same readings with torques stamped later."""
    return dataclasses.replace(made, torque=made.torque.shifted(seconds))


@pytest.fixture(scope="module")
def made():
    return closed_loop(WINCH, 8000, torque_noise=0.01, seed=11)


@pytest.mark.parametrize("late", [0.02, -0.015, 0.045])
def test_lateness_is_found_with_its_sign_and_taken_out(made, late):
    wrong = shifted(made, late)
    found = lateness_of([wrong], EFFECTS, reversals=False)
    assert found.ci95[0] <= made.torque_age + late + 1e-4
    assert found.age == pytest.approx(made.torque_age + late, abs=2e-4)
    assert found.ci95[1] >= made.torque_age + late - 1e-4
    assert found.error[1] < 0.5 * found.error[0]
    biased = identify_winch([wrong], EFFECTS, reversals=False).estimate
    assert abs(biased.values[1] / WINCH.viscous - 1.0) > 0.1
    mended = fit_beside_lateness(at_age([wrong], found.age), EFFECTS, reversals=False).estimate
    assert mended.names == biased.names
    assert np.all(np.abs(mended.values - WINCH.values) < 3.5 * mended.sd)


def test_a_torque_on_time_is_not_late(made):
    assert lateness_of([made], EFFECTS, reversals=False) is None
    assert lateness_of([shifted(made, 0.4 * STEP)], EFFECTS, reversals=False) is None


def test_a_torque_that_the_motion_does_not_follow_is_not_late(made):
    rng = np.random.default_rng(5)
    noise = Samples(made.torque.times, 0.3 * rng.standard_normal((len(made.torque.times), 1)))
    assert lateness_of([dataclasses.replace(made, torque=noise)], EFFECTS) is None


def test_an_unknown_instant_within_the_period_widens_the_intervals(made):
    sure = identify_winch([made], EFFECTS, reversals=False).estimate
    unsure = fit_beside_lateness([made], EFFECTS, reversals=False).estimate
    assert unsure.names == sure.names
    assert np.all(unsure.sd > 0.9 * sure.sd)
    half_a_period = fit_beside_lateness([shifted(made, 0.5 * STEP)], EFFECTS, reversals=False)
    assert np.all(np.abs(half_a_period.estimate.values - WINCH.values) < 3.5 * unsure.sd)
