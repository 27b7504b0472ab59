"""Whether a finding changes what was measured by more than matters."""

import numpy as np
import pytest
from diagnosis_samples import NOISE, PLACE, RUBBING, TORQUE, equation
from diagnosis_samples import THESIS as FILE

from cspm_ident.diagnosis.regression.coefficients import Weights
from cspm_ident.diagnosis.regression.hypothesis import bounded
from cspm_ident.diagnosis.regression.parameter_estimates import of_scales
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.thresholds import DEFAULT_THRESHOLDS
from cspm_ident.diagnosis.validation import remainder
from cspm_ident.diagnosis.validation.materiality import accuracy_of, acts_immaterially
from cspm_msgs_py.sensor_spec import Sensor
from cspm_sim.effects import Channel, catalogue

THESIS = FILE.testbed
GAIN = Candidate(catalogue()["winch_torque_gain"], "surge_2")


def rig(torque_noise):
    """The machine whose drives report torques with such a noise."""
    old = THESIS.sensors["/winches/state"].model_dump()
    noise = (*old["noise"][:2], torque_noise)
    sensor = Sensor(**{**old, "noise": noise, "resolution": (0.0, 0.0, 0.0)})
    return THESIS.model_copy(update={"sensors": {**THESIS.sensors, "/winches/state": sensor}})


def is_immaterial(torque, accuracy):
    """Whether a friction is, where 0.15 N·m were measured; rows are in units of their noise."""
    own = equation().scaled(np.array([NOISE]))
    given = [[own]], {PLACE: np.array([NOISE])}, rig(accuracy), DEFAULT_THRESHOLDS
    return acts_immaterially({RUBBING: np.array([torque])}, *given)


def test_a_friction_matters_by_share_or_by_accuracy():
    """The measured torque spreads by 0.14 N·m, so that 5 % are 7 mN·m."""
    assert is_immaterial(0.004, 0.005)
    assert not is_immaterial(0.004, 0.003)
    assert not is_immaterial(0.02, 0.03)
    assert not is_immaterial(TORQUE, 0.0)


def test_what_acts_nowhere_or_without_a_stated_accuracy_is_not_immaterial():
    given = {PLACE: np.array([NOISE])}, rig(1.0), DEFAULT_THRESHOLDS
    assert not acts_immaterially({RUBBING: np.array([1e-6])}, [[]], *given)
    bare = THESIS.model_copy(update={"sensors": {}})
    own = [[equation()]]
    assert not acts_immaterially({RUBBING: np.array([1e-6])}, own, *given[:1], bare, given[2])
    assert acts_immaterially({RUBBING: np.array([1e-6])}, own, *given)


@pytest.mark.parametrize(("share", "expected"), [(0.9, True), (1.1, False)])
def test_a_sensor_that_is_said_to_be_exact_resolves_16_bits(share, expected):
    size = share * 2.0**-16
    assert remainder.is_immaterial(size, 1.0, 0.0, DEFAULT_THRESHOLDS) is expected
    assert remainder.is_immaterial(size, 1.0, 1e-3, DEFAULT_THRESHOLDS)


def test_accuracy_is_that_of_the_sensor_in_the_residual():
    assert accuracy_of(rig(0.3), PLACE) == pytest.approx(0.3)
    tension = THESIS.sensors["/cables/tension"].noise[0]
    assert accuracy_of(THESIS, Place(Channel.TENSION, "sway_1")) == pytest.approx(tension, rel=0.1)
    assert np.isnan(accuracy_of(THESIS, Place(Channel.WRENCH, "bar")))


@pytest.mark.parametrize("gain", [0.6, 0.97, 1.8])
def test_a_gain_is_exact_where_the_shaft_has_a_residual(gain):
    fitted: Weights = {GAIN: (np.array([1.0 - 1.0 / gain]), np.array([0.01]))}
    place = Place(Channel.SHAFT, "surge_2")
    weight, half = of_scales(fitted, {place})[GAIN]
    assert 1.0 + weight[0] == pytest.approx(gain)
    # The interval follows the slope of g against 1 − 1/g.
    assert half[0] == pytest.approx(0.01 * gain**2)
    assert of_scales(fitted, set()) == fitted


def test_a_significant_weight_beyond_its_range_is_left_there():
    """What sits on a bound is no estimate; an insignificant one may be anything in the range."""
    far, unknown = np.array([-0.7]), np.array([0.9])
    assert bounded(GAIN, far, np.array([0.4]))[0] == -0.7
    assert bounded(GAIN, far, unknown)[0] == -0.5
    assert bounded(RUBBING, np.array([-0.001]), np.array([0.002]))[0] == 0.0
    assert bounded(RUBBING, np.array([-0.01]), np.array([0.002]))[0] == -0.01
