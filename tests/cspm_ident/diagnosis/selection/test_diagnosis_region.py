"""Where a finding shows: found where it was put, and nowhere if it is everywhere."""

import numpy as np
import pytest

from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.residuals.residual_equation import Equation
from cspm_ident.diagnosis.selection.region import region_of
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS
from cspm_sim.effects import Channel, catalogue

PLACE = Place(Channel.SHAFT, "only")
FRICTION = Candidate(catalogue()["winch_coulomb_friction"], "only")
OFFSET = Candidate(catalogue()["winch_torque_offset"], "only")


def regions(column, weight=2.0, seed=1, signal="speed [rad/s]"):
    """The region of an effect whose column is a function of a signal; all signals are noise."""
    rng = np.random.default_rng(seed)
    speed, angle = rng.uniform(-1.0, 1.0, 4000), rng.uniform(0.0, 1.0, 4000)
    own, other = column(speed)[:, None, None], np.ones((4000, 1, 1))
    target = weight * own[:, :, 0] + 0.5 + 0.1 * rng.standard_normal((4000, 1))
    equation = Equation(
        PLACE,
        0.01 * np.arange(4000.0),
        target,
        {FRICTION: own, OFFSET: other},
        target,
        signals={"angle [rad]": angle, signal: speed},
    )
    weights = {FRICTION: np.array([weight]), OFFSET: np.array([0.5])}
    return region_of([[equation]], [FRICTION], weights)


@pytest.mark.parametrize(("low", "high"), [(0.2, 0.5), (-0.9, -0.6)])
def test_an_effect_of_some_speeds_is_found_there(low, high):
    found = regions(lambda speed: ((speed > low) & (speed < high)) * 1.0)
    assert found is not None
    assert found.driver == "speed [rad/s]"
    a_bin = 0.04
    assert low - a_bin <= found.low < found.high <= high + a_bin
    assert found.share == pytest.approx((high - low) / 2.0, abs=0.03)
    assert found.held >= 1.0 - DEFAULT_THRESHOLDS.minor_share


def test_when_a_machine_moved_is_no_region():
    def moved(values):
        return ((values > 0.2) & (values < 0.5)) * 1.0

    assert regions(moved, signal="time [s]") is None
    assert regions(moved, signal="speed [rad/s]") is not None


def test_an_effect_of_all_speeds_has_no_region():
    assert regions(np.sign) is None


def test_an_effect_that_takes_nothing_has_no_region():
    assert regions(np.zeros_like) is None
