"""Estimates that outliers do not move, against what was put in and against estimating equations."""

import numpy as np
import pytest

from cspm_model.robust_statistics import MAD_TO_SIGMA, difference_noise, huber_fit

TIMES = np.arange(20_000) * 1e-3


def series(sd, seed=4):
    smooth = np.stack([np.sin(2.0 * TIMES), 5.0 * TIMES**2], axis=1)
    return smooth + np.random.default_rng(seed).normal(size=smooth.shape) * sd


@pytest.mark.parametrize("order", [1, 2, 3, 4])
def test_noise_is_separated_from_what_is_smooth(order):
    sd = np.array([0.05, 2.0])
    assert difference_noise(series(sd), order) == pytest.approx(sd, rel=0.05)


@pytest.mark.parametrize("order", [3, 4])
def test_the_order_decides_how_much_of_a_signal_counts_as_noise(order):
    """Of a polynomial, differences of a higher order leave nothing."""
    cubic = (TIMES[:500] * 1e3) ** 3
    assert difference_noise(cubic, order) == pytest.approx(
        MAD_TO_SIGMA * 6.0 / 20.0**0.5 if order == 3 else 0.0
    )


def test_steps_do_not_move_the_noise():
    rows = series(0.05)[:, 0]
    stepped = rows + np.cumsum(np.where(np.arange(len(rows)) % 500 == 0, 10.0, 0.0))
    assert difference_noise(stepped) == pytest.approx(difference_noise(rows), rel=0.02)


def test_one_series_and_its_column_have_the_same_noise():
    rows = series(0.05)
    assert difference_noise(rows[:, 0]).shape == ()
    assert float(difference_noise(rows[:, 0])) == difference_noise(rows)[0]


def line(wrong=0.0):
    random = np.random.default_rng(2)
    columns = np.stack([np.linspace(-1.0, 1.0, 400), np.ones(400)], axis=1)
    target = columns @ [3.0, -0.5] + 0.01 * random.normal(size=400)
    target[::10] += wrong
    return columns, target


@pytest.mark.parametrize("threshold", [1.345, 3.0])
def test_hubers_estimating_equation_holds_at_the_solution(threshold):
    """Σ ψ(r/s)·x = 0 with ψ clipped at the threshold, Huber (1964)."""
    columns, target = line(wrong=1.0)
    found, weights = huber_fit(columns, target, threshold, 60)
    left = target - columns @ found
    scale = MAD_TO_SIGMA * np.median(np.abs(left))
    clipped = np.clip(left / scale, -threshold, threshold)
    assert columns.T @ clipped == pytest.approx([0.0, 0.0], abs=1e-6)
    assert weights == pytest.approx(np.clip(threshold * scale / np.abs(left), None, 1.0))


def test_a_tenth_of_wrong_rows_hardly_moves_the_fit():
    columns, target = line(wrong=5.0)
    found, weights = huber_fit(columns, target, 1.345, 30)
    assert found == pytest.approx([3.0, -0.5], abs=5e-3)
    assert weights[::10].max() < 0.01
    plain = np.linalg.lstsq(columns, target, rcond=None)[0]
    assert abs(plain[1] + 0.5) > 0.3


def test_an_exact_fit_ends_only_where_that_is_asked_for():
    columns, _ = line()
    target = columns @ [3.0, -0.5]
    found, weights = huber_fit(columns, target, 1.345, 30, exact=1e-12)
    assert found == pytest.approx([3.0, -0.5])
    assert (weights == 1.0).all()
    _, going_on = huber_fit(columns, target, 1.345, 30)
    assert going_on.min() < 1.0
