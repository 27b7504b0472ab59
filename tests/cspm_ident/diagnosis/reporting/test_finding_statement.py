"""What is said of a finding: what has what, how much, since when, where, and what it is worth."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from diagnosis_samples import (
    PLACE,
    RUBBING,
    THESIS,
    TORQUE,
    diagnosis,
    held_out,
    judged,
)

from cspm_ident.diagnosis.finding import Onset, Shape
from cspm_ident.diagnosis.parameter import Coefficients
from cspm_ident.diagnosis.regression.block_regression import Gain
from cspm_ident.diagnosis.regression.hypothesis import Hypothesis, Rival
from cspm_ident.diagnosis.reporting.formula_hint import is_even
from cspm_ident.diagnosis.reporting.quantity import amount_words
from cspm_ident.diagnosis.reporting.verdict import diagnosis_data
from cspm_ident.diagnosis.residuals.free_shapes import Driver
from cspm_ident.diagnosis.residuals.regressors import Candidate, Place
from cspm_ident.diagnosis.validation.detection_limits import Limit
from cspm_sim.effects import Channel, catalogue


def test_a_finding_says_what_how_much_since_when_and_what_it_is_worth():
    (finding,) = diagnosis_data(diagnosis())["findings"]
    reported = finding["statement"]
    start = "Winch surge 2 has dry friction that the model does not have: torque 30.0 ± 1.0 mN·m."
    assert reported.startswith(f"{start} Present throughout.")
    # 0.03 and 0.001 N·m of 0.15, where noise is 0.001.
    assert "the torque of winch surge 2 falls from 20 % to 0.67 % of what was measured" in reported
    angle = "Simulated, the error of the angle of winch surge 2 falls from 1.46 rad to 7.1 mrad."
    assert reported.endswith(f"of what was measured. That is the noise floor. {angle}")
    assert all(len(sentence.split()) <= 25 for sentence in reported.split(". "))
    assert "reverses" not in reported


@pytest.mark.parametrize(
    ("times", "course"),
    [
        (1.5, "rises from 20 % to 30 %"),
        (0.5, "falls from 20 % to 10 %"),
        (1.001, "stays at 20 %"),
        (0.999, "stays at 20 %"),
    ],
)
def test_an_error_is_said_to_rise_fall_or_stay(times, course):
    """As far as two digits show."""
    fit = held_out(times * TORQUE)
    (finding,) = diagnosis_data(replace(diagnosis(), fit=(fit,)))["findings"]
    assert f"torque of winch surge 2 {course} of what was measured" in finding["statement"]


def test_what_is_left_above_the_noise_is_reported_and_where_it_is_not():
    found = diagnosis()
    fit = held_out(0.015, steady=0.01)
    (finding,) = diagnosis_data(replace(found, fit=(fit,)))["findings"]
    left = "Apart from where the shaft reverses it is 6.7 %. Noise is 0.67 %."
    assert f"to 10 % of what was measured. {left}" in finding["statement"]


@pytest.mark.parametrize(
    ("least", "missing", "reported"),
    [(0.002, (), True), (0.002, ("sway_4",), False), (0.04, (), False)],
)
def test_that_no_other_winch_has_it_is_reported_where_it_would_have_shown(least, missing, reported):
    others = [n for n in THESIS.testbed.cable_names if n != "surge_2" and n not in missing]
    limits = tuple(Limit(RUBBING.effect_id, n, "torque", least, "N·m", True) for n in others)
    (finding,) = diagnosis_data(replace(diagnosis(), limits=limits))["findings"]
    assert (
        "Other winches: none above the detection limit of 2 mN·m." in finding["statement"]
    ) is reported


def test_of_an_effect_that_may_be_elsewhere_that_is_not_reported():
    other = Hypothesis(RUBBING.effect, (Candidate(RUBBING.effect, "sway_1"),))
    cables = [n for n in THESIS.testbed.cable_names if n != "surge_2"]
    limits = tuple(Limit(RUBBING.effect_id, n, "torque", 0.002, "N·m", True) for n in cables)
    found = replace(diagnosis(alternatives=[Rival(other, 0.5)]), limits=limits)
    (finding,) = diagnosis_data(found)["findings"]
    assert "No other" not in finding["statement"]


@pytest.mark.parametrize("low", [None, 12.1])
def test_a_beginning_is_reported(low):
    onset = None if low is None else Onset(12.3, low, 12.5)
    found = diagnosis()
    found = judged(found, [replace(each, onset=onset) for each in found.findings])
    (finding,) = diagnosis_data(found)["findings"]
    assert ("It begins at 12.3 s (12.1 to 12.5 s)." in finding["statement"]) is (low is not None)
    assert ("Present throughout" in finding["statement"]) is (low is None)


@pytest.mark.parametrize(
    ("value", "ends", "unit", "words"),
    [
        (0.0309, (0.0307, 0.0311), "N·m", "30.90 ± 0.20 mN·m"),
        (0.85, (0.84, 0.86), "1", "0.850 ± 0.010"),
        (0.05, (0.04, 0.09), "kg", "50 (40 to 90) g"),
        (3e-7, None, "m/N", "0.3 µm/N"),
        (12.0, None, "rad", "12 rad"),
        (0.0, None, "N", "0 N"),
    ],
)
def test_amounts_are_reported_as_an_engineer_writes_them(value, ends, unit, words):
    assert amount_words(value, unit, ends) == words


def test_the_file_of_the_machine_is_named():
    assert diagnosis_data(diagnosis())["testbed"]["path"].endswith("today: testbed.yaml")
    given = diagnosis_data(diagnosis(), Path("my_rig.yaml"))["testbed"]
    assert given == {"path": "my_rig.yaml", "sha256": THESIS.sha256}


@pytest.mark.parametrize(
    ("shape", "even"), [(lambda v: np.sqrt(np.abs(v)), True), (lambda v: v * np.abs(v), False)]
)
def test_what_is_even_in_speed_differs_by_direction(shape, even):
    speeds = np.array([-9.0, -5.0, -2.0, 0.0, 2.0, 5.0, 10.0])
    values = shape(speeds) - np.mean(shape(speeds))
    driver = Driver(PLACE, "speed [rad/s]")
    found = diagnosis(named=False, unknown=[(driver, Gain(50.0, 5.0), 0.4)])
    (unexplained,) = found.unexplained
    found = replace(found, unexplained=(unexplained._replace(shape=Shape(speeds, values)),))
    (reported,) = diagnosis_data(found)["findings"]
    words = "it is the same in both directions, so that friction differs by direction"
    assert (words in reported["statement"]) is even


def test_one_direction_alone_is_not_even():
    speeds = np.linspace(0.5, 5.0, 7)
    assert not is_even(speeds, np.ones(7))


@pytest.mark.parametrize(
    ("signal", "unit"), [("time, in heave [s]", " N, takes"), ("pitch [rad]", " N·m, takes")]
)
def test_an_unknown_wrench_has_the_unit_of_its_component(signal, unit):
    driver = Driver(Place(Channel.WRENCH, "bar"), signal)
    found = diagnosis(named=False, unknown=[(driver, Gain(50.0, 5.0), 0.4)])
    (reported,) = diagnosis_data(found)["findings"]
    assert unit in reported["statement"]


def test_of_several_numbers_those_that_may_be_nothing_have_none():
    pushed = Candidate(catalogue()["bar_constant_wrench"], "bar")
    weights = np.array([0.0004, 0.3, -0.0003, 0.0, 0.0, 0.0])
    found = diagnosis()
    hypothesis = Hypothesis(pushed.effect, (pushed,))
    for half, reported in (
        (0.001, "sway 0.3000 ± 0.0010 N, surge, heave, roll, pitch, yaw not significantly"),
        (np.inf, "sway 0.3 N, heave -0.3 mN"),
    ):
        own = (Coefficients(pushed, weights, np.full(6, half)),)
        changed = judged(
            found, [replace(found.findings[0], hypothesis=hypothesis, coefficients=own)]
        )
        (finding,) = diagnosis_data(changed)["findings"]
        assert reported in finding["statement"]
        assert ("too few data for an interval" in finding["statement"]) is (half == np.inf)


@pytest.mark.parametrize(
    ("half", "reported", "ends"),
    [
        (5.0, "torque 30 mN·m, too few data for an interval", None),
        (np.inf, "torque 30 mN·m, too few data for an interval", None),
        (0.001, "torque 30.0 ± 1.0 mN·m.", [0.029, 0.031]),
    ],
)
def test_an_interval_of_all_that_is_allowed_is_none(half, reported, ends):
    """Dry friction may be from 0 to 1 N·m."""
    own = (Coefficients(RUBBING, np.array([TORQUE]), np.array([half])),)
    found = diagnosis()
    changed = judged(found, [replace(each, coefficients=own) for each in found.findings])
    (finding,) = diagnosis_data(changed)["findings"]
    assert reported in finding["statement"]
    (number,) = finding["parameters"]
    assert number["ci95"] == (None if ends is None else pytest.approx(ends))
