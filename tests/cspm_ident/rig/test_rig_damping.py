"""Damping recovered from cables that the project's plant did not make."""

from dataclasses import replace

import numpy as np
import pytest

from bench.accuracy.rig_cables import SpecimenTruth, described, multisine
from cspm_ident.rig.damping import DAMPING, identify_damping
from cspm_msgs_py.errors import InputError

TRUTH = SpecimenTruth()


def specimen(length, seed=3, law=TRUTH.law, truth=TRUTH, **options):
    """A cable whose stiffness the test-bed file knows."""
    one = multisine(truth, length, seed=seed, **options)
    return replace(one, cable=described(length, truth, one.label, stiffness=law))


@pytest.fixture(scope="module")
def found():
    return identify_damping([specimen(x) for x in (1.25, 2.1, 3.0, 3.5, 1.8)], ["l180"])


def test_the_line_is_the_truth_within_its_intervals(found):
    law = found.law
    assert law.constant_interval[0] < TRUTH.constant < law.constant_interval[1]
    assert law.slope_interval[0] < TRUTH.slope < law.slope_interval[1]
    # And the intervals say something: 5 % of the constant, 10 % of the slope.
    assert np.ptp(law.constant_interval) < 0.05 * TRUTH.constant
    assert np.ptp(law.slope_interval) < 0.1 * TRUTH.slope
    # Four lengths, two parameters: χ² of two degrees of freedom, beyond 3.3² once in 10⁹.
    assert law.scatter < 3.3


def test_each_length_is_damped_as_it_was_made(found):
    for one in found.specimens:
        low, high = one.estimate.interval(DAMPING)
        half = 0.5 * (high - low)
        # Two half widths: beyond them once in 10⁴.
        assert abs(one.estimate.value(DAMPING) - TRUTH.damping(one.mean_length)) < 2.0 * half
        assert half < 0.02 * TRUTH.damping(one.mean_length)
        assert one.vaf > 99.9


def test_a_length_not_fitted_is_predicted_from_its_first_value(found):
    assert [one.fitted for one in found.specimens] == [True] * 4 + [False]
    assert found.verified["l180"] > 99.9
    # With the line of a cable that is damped half as much the prediction is worse.
    other = SpecimenTruth(constant=0.5 * TRUTH.constant, slope=0.5 * TRUTH.slope)
    less = [specimen(x, truth=other) for x in (1.25, 3.5)]
    wrong = identify_damping([*less, specimen(1.8)], ["l180"])
    assert wrong.law.constant < 0.6 * TRUTH.constant
    left = [100.0 - result.verified["l180"] for result in (found, wrong)]
    assert left[1] > 3.0 * left[0]


def test_a_wrong_sign_of_the_rate_is_a_negative_damping():
    one = specimen(2.1)
    wrong = identify_damping([replace(one, rate=-one.rate)])
    low, high = wrong.specimens[0].estimate.interval(DAMPING)
    assert low < -TRUTH.damping(2.1) < high or high < 0.0


def test_one_length_gives_no_line():
    result = identify_damping([specimen(2.1), specimen(2.1, seed=8, label="other")])
    assert result.law is None
    assert result.data()["law"] is None
    assert result.verified == {}


def test_a_wrong_stiffness_shows_in_the_vaf():
    soft = identify_damping([specimen(2.1, law=TRUTH.law | {"a": 0.6 * TRUTH.a})])
    assert soft.specimens[0].vaf < 99.0


def test_faults_are_one_line():
    one = specimen(2.1)
    slack = replace(one, tension=one.tension - float(one.tension.min()))
    with pytest.raises(InputError) as caught:
        identify_damping([slack])
    assert str(caught.value) == "l210: 0 N at its least, allowed: a cable that is always taut"
    with pytest.raises(InputError) as caught:
        identify_damping([replace(one, rate=np.zeros_like(one.rate))])
    assert str(caught.value) == "l210: its winch stands still, allowed: a multi-sine"
    with pytest.raises(InputError) as caught:
        identify_damping([one], cutoff=300.0)
    assert str(caught.value) == (
        "l210: 1e+03 Hz, allowed with a cut-off at 300 Hz: at least 1200 Hz"
    )
    short = replace(
        one, **{k: getattr(one, k)[:1500] for k in ("time", "wound", "rate", "tension")}
    )
    with pytest.raises(InputError) as caught:
        identify_damping([short])
    assert str(caught.value) == "l210: 1.5 s, allowed: at least 2 s"
