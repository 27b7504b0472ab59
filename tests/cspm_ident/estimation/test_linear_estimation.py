import json

import numpy as np
import pytest
from estimation_samples import NAMES, TRUTH, columns, first_order, parameters, records
from scipy.stats import binom

from cspm_ident.estimation import Interval, Parameter, Prior, Record, fit_linear
from cspm_msgs_py.errors import InputError


def test_without_noise_the_parameters_are_exact():
    made = records(np.random.default_rng(1), deviation=0.0)
    found = fit_linear(made, parameters()).estimate
    np.testing.assert_allclose(found.values, TRUTH, rtol=1e-12)
    assert np.all(found.sd < 1e-12)
    assert found.unexcited == ()


def test_with_white_noise_it_is_the_textbook():
    """Ordinary least squares, its standard errors and its t quantile."""
    made = records(np.random.default_rng(2), (3000,), decay=0.0)
    regressors, target = made[0].regressors[:, 0], made[0].target[:, 0]
    values, left, _, _ = np.linalg.lstsq(regressors, target, rcond=None)
    variance = left[0] / (3000 - 3) * np.diag(np.linalg.inv(regressors.T @ regressors))
    found = fit_linear(made, parameters(), max_order=0).estimate
    np.testing.assert_allclose(found.values, values, rtol=1e-10)
    np.testing.assert_allclose(found.sd, np.sqrt(variance), rtol=1e-6)
    np.testing.assert_allclose(found.ci95[:, 1] - values, 1.961 * found.sd, rtol=1e-3)
    assert found.effective_samples == 3000


def test_with_known_colour_it_is_generalised_least_squares():
    """Against the dense inverse of the true covariance; the colour is estimated, hence 5 %."""
    rng = np.random.default_rng(3)
    made = records(rng, (1200,), decay=0.9, deviation=0.2)
    lags = np.abs(np.subtract.outer(np.arange(1200), np.arange(1200)))
    weight = np.linalg.inv(0.04 * 0.9**lags)
    regressors, target = made[0].regressors[:, 0], made[0].target[:, 0]
    covariance = np.linalg.inv(regressors.T @ weight @ regressors)
    values = covariance @ regressors.T @ weight @ target
    found = fit_linear(made, parameters(), max_order=1).estimate
    sd = np.sqrt(np.diag(covariance))
    assert np.abs(found.values - values).max() < 0.05 * sd.min()
    # The innovations' size and the decay are each known to about 1/√1200, amplified by 1/(1 − 0.9).
    np.testing.assert_allclose(found.sd, sd, rtol=0.3)
    expected = covariance / np.outer(sd, sd)
    np.testing.assert_allclose(found.correlation, expected, atol=0.1)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("whiten", "interval"),
    [
        (True, Interval.LIKELIHOOD),
        (True, Interval.SANDWICH),
        (True, Interval.BOOTSTRAP),
        (False, Interval.SANDWICH),
        (False, Interval.BOOTSTRAP),
    ],
)
def test_stated_spread_is_the_real_one(whiten, interval):
    """Over 60 experiments; plain least squares states a quarter of it at this colour."""
    experiments = [records(np.random.default_rng([4, run]), (800, 400)) for run in range(60)]
    found = [
        fit_linear(made, parameters(), whiten=whiten, interval=interval).estimate
        for made in experiments
    ]
    real = np.std([estimate.values for estimate in found], axis=0, ddof=1)
    stated = np.sqrt(np.mean([estimate.sd**2 for estimate in found], axis=0))
    # A standard deviation from 60 runs is known to 9 %; three of these, and blocks are finite.
    np.testing.assert_allclose(stated, real, rtol=0.3)
    inside = sum(int(e.ci95[0, 0] < TRUTH[0] < e.ci95[0, 1]) for e in found)
    assert inside >= binom.ppf(1e-3, 60, 0.9)


def test_windows_are_not_joined():
    """A slow process that starts anew in each window: joined, its jumps would pass for noise."""
    rng = np.random.default_rng(5)
    pieces = [records(rng, (40,), decay=0.99, deviation=1.0)[0] for _ in range(60)]
    order = np.random.default_rng(6).permutation(60)
    one = fit_linear(pieces, parameters()).estimate
    other = fit_linear([pieces[i] for i in order], parameters()).estimate
    np.testing.assert_allclose(one.values, other.values, rtol=1e-9)
    np.testing.assert_allclose(one.sd, other.sd, rtol=1e-9)


def test_groups_are_weighted_by_their_own_noise():
    """A sensor a hundred times worse, in another unit, hardly takes part."""
    rng = np.random.default_rng(7)
    good = records(rng, (800,), deviation=0.01)[0]
    bad = records(rng, (800,), deviation=1.0, truth=TRUTH + 1.0)[0]
    alone = fit_linear([good], parameters()).estimate
    both = fit_linear([good, Record(bad.target, bad.regressors, "bad")], parameters()).estimate
    assert np.all(np.abs(both.values - alone.values) < alone.sd)
    mixed = fit_linear([good, bad], parameters()).estimate
    assert np.any(np.abs(mixed.values - alone.values) > 10.0 * alone.sd)


def test_frozen_parameters_keep_their_start():
    made = records(np.random.default_rng(8))
    found = fit_linear(made, parameters(slope={"frozen": True}), [0.0, -0.5, 0.0]).estimate
    assert found.value("slope") == -0.5
    assert found.frozen == ("slope",)
    assert np.isnan(found.interval("slope")).all()
    free = fit_linear(made, parameters()).estimate
    # What is known is not lost; the colour is estimated anew, hence not exactly.
    assert found.sd[0] < 1.02 * free.sd[0]
    assert np.isfinite(found.correlation[0, 2])
    assert np.isnan(found.correlation[1]).all()


def test_a_prior_is_a_measurement_more():
    """Precision-weighted mean of the data's estimate and the datasheet's."""
    made = records(np.random.default_rng(9), (1000,), decay=0.0)
    only = [Parameter("level", "1", scale=1.0)]
    level = made[0].target - made[0].regressors[:, :, :2] @ TRUTH[:2]
    constant = [Record(level, np.ones((1000, 1)))]
    alone = fit_linear(constant, only, max_order=0).estimate
    mean, sd = alone.values[0] + 3.0 * alone.sd[0], 2.0 * alone.sd[0]
    given = [Parameter("level", "1", scale=1.0, prior=Prior(mean, sd))]
    found = fit_linear(constant, given, max_order=0).estimate
    weights = np.array([1.0 / alone.sd[0] ** 2, 1.0 / sd**2])
    expected = weights @ [alone.values[0], mean] / weights.sum()
    assert found.values[0] == pytest.approx(expected, rel=1e-4)
    assert found.sd[0] == pytest.approx(weights.sum() ** -0.5, rel=1e-3)
    for interval in (Interval.SANDWICH, Interval.BOOTSTRAP):
        other = fit_linear(constant, given, max_order=0, interval=interval).estimate
        # 1000 replicates, blocks of a few samples.
        assert other.sd[0] == pytest.approx(found.sd[0], rel=0.15)


def test_a_bound_holds_and_is_named():
    made = records(np.random.default_rng(10), deviation=0.02)
    held = fit_linear(made, parameters(gain={"upper": 1.5})).estimate
    assert held.value("gain") == pytest.approx(1.5, abs=1e-6)
    assert held.at_bound == ("gain",)
    loose = fit_linear(made, parameters(gain={"upper": 2.5})).estimate
    assert loose.at_bound == ()
    assert loose.value("gain") == pytest.approx(2.0, abs=0.05)


def test_same_seed_same_bootstrap():
    made = records(np.random.default_rng(11))
    first, again, other = (
        fit_linear(made, parameters(), interval=Interval.BOOTSTRAP, seed=seed).estimate.ci95
        for seed in (1, 1, 2)
    )
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_data_is_json_and_infinite_is_null():
    regressors = columns(np.arange(300.0))
    regressors[:, 1] = 0.0
    noise = first_order(np.random.default_rng(12), 300, 0.5, 0.1)
    made = [Record(regressors @ TRUTH + noise, regressors)]
    data = fit_linear(made, parameters(level={"frozen": True}), [0.0, 0.0, 0.3]).estimate.data()
    read = json.loads(json.dumps(data, allow_nan=False))
    gain, slope, level = read["parameters"]
    assert [entry["name"] for entry in read["parameters"]] == list(NAMES)
    assert gain["excited"]
    assert gain["ci95"][0] < gain["value"] < gain["ci95"][1]
    assert not slope["excited"]
    assert slope["ci95"] == [None, None]
    assert level["frozen"]
    assert level["ci95"] is None
    assert read["unexcited"] == [
        {"direction": "slope", "weights": {"slope": 1.0}, "sd_in_scales": None}
    ]


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (
            lambda: Parameter("m", "kg", 2.0, 1.0),
            "parameter m: bounds 2 to 1; allowed: lower below",
        ),
        (lambda: Parameter("m", "kg"), "parameter m: scale 0; allowed: finite and above 0"),
        (
            lambda: Parameter("m", "kg", scale=1.0, prior=Prior(1.0, 0.0)),
            "parameter m: prior's standard deviation 0; allowed: finite and above 0",
        ),
        (lambda: Record(np.zeros((2, 2, 2)), np.zeros((2, 1))), r"target has shape \(2, 2, 2\)"),
        (lambda: Record(np.zeros(0), np.zeros((0, 1))), r"target has shape \(0, 1\)"),
        (lambda: Record(np.array([np.nan]), np.ones((1, 1))), "target has a number that is not"),
        (lambda: Record(np.zeros(3), np.ones((2, 1))), r"regressors have shape \(2, 1, 1\)"),
        (lambda: Record(np.zeros(1), np.array([[np.inf]])), "regressors have a number that is not"),
    ],
)
def test_nonsense_is_refused(build, words):
    with pytest.raises(InputError, match=words):
        build()


def test_half_the_range_is_the_scale():
    assert Parameter("m", "kg", 1.0, 4.0).scale == 1.5
    assert Parameter("m", "kg", 1.0, 4.0, 0.1).scale == 0.1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (([], parameters()), "no records to estimate from; allowed: one or more"),
        ((None, parameters()[:2]), "has 3 regressors; allowed: one for each of 2 parameters"),
        ((None, parameters(), [0.0]), r"start has shape \(1,\); allowed: one value for each of 3"),
        (
            (None, parameters(gain={"lower": 1.0}), [0.0, 0.0, 0.0]),
            "start of gain: 0 1; allowed: 1 to inf",
        ),
        ((None, (*parameters()[:2], parameters()[0])), "a name repeats; allowed: each name once"),
        (
            (None, parameters(**{name: {"frozen": True} for name in NAMES})),
            "no parameter is free; allowed: at least one",
        ),
    ],
)
def test_what_does_not_fit_is_refused(arguments, words):
    made = records(np.random.default_rng(1), (50,))
    first, *rest = arguments
    with pytest.raises(InputError, match=words):
        fit_linear(made if first is None else first, *rest)


def test_likelihood_without_whitening_is_refused():
    made = records(np.random.default_rng(1), (50,))
    with pytest.raises(InputError, match="allowed: sandwich, bootstrap"):
        fit_linear(made, parameters(), whiten=False, interval=Interval.LIKELIHOOD)
