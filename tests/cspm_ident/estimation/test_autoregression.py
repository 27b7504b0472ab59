import numpy as np
import pytest
from scipy.linalg import solve_triangular, toeplitz
from scipy.signal import lfilter

from cspm_ident.estimation.autoregression import Autoregression, fit_autoregression, whiten
from cspm_ident.estimation.block_length import autocovariances, block_length
from cspm_ident.estimation.noise import fit_noise, whiten_channels

# Poles at 0.8·exp(±0.9i): x_t = −a_1 x_{t-1} − a_2 x_{t-2} + e_t.
COEFFICIENTS = np.array([-1.6 * np.cos(0.9), 0.64])


def process(rng, count, coefficients=COEFFICIENTS, deviation=1.0):
    draws = deviation * rng.standard_normal(count + 500)
    return lfilter([1.0], np.concatenate([[1.0], coefficients]), draws)[500:]


def stationary_covariance(coefficients, deviation, count):
    """By the long impulse response, which knows nothing of Burg or Levinson."""
    impulse = np.zeros(4000)
    impulse[0] = deviation
    response = lfilter([1.0], np.concatenate([[1.0], coefficients]), impulse)
    lags = [response[: len(response) - k] @ response[k:] for k in range(count)]
    return toeplitz(lags)


def test_pieces_of_one_process_give_its_coefficients():
    rng = np.random.default_rng(1)
    pieces = [process(rng, count, deviation=0.3) for count in (900, 40, 2500, 1500)]
    found = fit_autoregression(pieces, 2)
    # Four standard deviations of a_1 and a_2 for 4940 samples: √((1 − a_2²)/n) = 0.011.
    np.testing.assert_allclose(found.coefficients, COEFFICIENTS, atol=0.044)
    assert found.variance == pytest.approx(0.09, rel=4 * np.sqrt(2 / 4940))


def test_pieces_are_not_joined():
    """A jump between two pieces is no sample, and their order does not matter."""
    rng = np.random.default_rng(2)
    low, high = process(rng, 300), process(rng, 200)
    apart = fit_autoregression([low, high], 8)
    turned = fit_autoregression([high, low], 8)
    np.testing.assert_allclose(apart.reflections, turned.reflections, rtol=1e-12)
    joined = fit_autoregression([np.concatenate([low, high])], 8)
    assert not np.allclose(apart.reflections[:1], joined.reflections[:1], rtol=1e-9)


def test_order_is_that_of_the_process_and_white_noise_has_none():
    orders = [
        len(fit_autoregression([process(np.random.default_rng(seed), 3000)], 30).reflections)
        for seed in range(20)
    ]
    # AIC takes a superfluous order now and then, hardly ever one too few.
    assert min(orders) == 2
    assert np.median(orders) <= 4
    white = np.random.default_rng(3).standard_normal(3000)
    assert len(fit_autoregression([white], 30).reflections) <= 4


def test_filter_is_the_inverse_root_of_the_covariance():
    """From the first sample on: the exact likelihood, also of pieces shorter than the order."""
    reflections = np.array([-0.7, 0.5, 0.2])
    model = Autoregression(reflections, 0.04)
    covariance = stationary_covariance(model.coefficients, 0.2, 12)
    root = np.linalg.cholesky(covariance)
    assert model.process_variance == pytest.approx(covariance[0, 0], rel=1e-9)
    values = np.random.default_rng(4).standard_normal((12, 3))
    for count in (12, 3, 2, 1):
        expected = solve_triangular(root[:count, :count], values[:count], lower=True)
        np.testing.assert_allclose(whiten(model, values[:count]), expected, rtol=1e-8)


def test_effective_samples_are_those_of_a_mean():
    """(1 − φ)/(1 + φ) for a first-order process; a process that swings about its mean has all."""
    assert Autoregression(np.array([-0.9]), 1.0).effective_share == pytest.approx(0.1 / 1.9)
    assert Autoregression(np.array([0.9]), 1.0).effective_share == 1.0


def test_rounding_is_not_taken_for_a_process():
    silent = fit_autoregression([np.zeros(100)], 5, floor=1e-16)
    assert len(silent.reflections) == 0
    assert silent.variance == pytest.approx(1e-32)


def test_channels_become_independent():
    """Two colours, driven by draws that are correlated at the same instant."""
    rng = np.random.default_rng(5)
    draws = rng.multivariate_normal([0.0, 0.0], [[1.0, 0.8], [0.8, 1.0]], 20000)
    first = lfilter([1.0], np.concatenate([[1.0], COEFFICIENTS]), draws[:, 0])
    both = np.stack([first, 30.0 * lfilter([1.0], [1.0, -0.9], draws[:, 1])], axis=1)
    noise = fit_noise([both], [""], None, {"": 0.0})
    white = whiten_channels(noise[""], both)
    # Each entry of the correlations has a standard deviation of 1/√20000 = 0.007.
    np.testing.assert_allclose(np.cov(white.T), np.eye(2), atol=0.04)
    np.testing.assert_allclose(white[1:].T @ white[:-1] / len(white), np.zeros((2, 2)), atol=0.03)


def test_autocovariances_do_not_span_pieces():
    pieces = [np.array([1.0, -1.0, 2.0]), np.array([-2.0, 0.0])]
    np.testing.assert_allclose(autocovariances(pieces, 2), [10 / 5, -3 / 5, 2 / 5])


def test_block_length_grows_with_memory():
    """Of a first-order process it is about (6^½·φ/(1 − φ²))^⅔·n^⅓ (Politis, White 2004)."""
    rng = np.random.default_rng(6)
    for phi in (0.5, 0.9):
        lengths = [block_length([process(rng, 4000, np.array([-phi]))]) for _ in range(30)]
        expected = (np.sqrt(6.0) * phi / (1.0 - phi**2)) ** (2 / 3) * 4000 ** (1 / 3)
        # The spectrum's derivative is estimated: single lengths scatter by a factor of two.
        assert 0.6 * expected < np.median(lengths) < 1.6 * expected
    assert np.median([block_length([rng.standard_normal(4000)]) for _ in range(30)]) <= 8
