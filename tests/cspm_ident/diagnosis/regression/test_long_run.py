"""Intervals under correlated blocks; all of it is `python -m bench.accuracy.block_coverage`."""

import numpy as np
import pytest
from scipy.stats import binom
from scipy.stats import t as t_distribution

from bench.accuracy.block_coverage import REGRESSORS, coverage, noise, parts_of
from cspm_ident.diagnosis.regression.long_run import FEWEST_STRETCHES, long_run

RUNS = 1000
# With a coverage of 93 to 97 % one in a thousand tests of 1000 runs ends below, and one above.
FEWEST, MOST = binom.ppf(1e-3, RUNS, 0.93) / RUNS, binom.ppf(1.0 - 1e-3, RUNS, 0.97) / RUNS


def rows_in(blocks, columns=1, correlation=0.0, seed=0, each=6):
    """Gram matrices of blocks with several rows of random columns and noise."""
    rng = np.random.default_rng(seed)
    rows = rng.standard_normal((blocks, each, columns + 1))
    rows[:, :, -1] += noise(rng, blocks, correlation)[:, None]
    return np.einsum("bri,brj->bij", rows, rows)


@pytest.mark.parametrize(
    ("blocks", "correlation"), [(12, 0.0), (12, 0.5), (24, 0.5), (24, 0.7), (48, 0.0), (48, 0.7)]
)
@pytest.mark.parametrize("regressor", ["constant", "random sign and size"])
def test_intervals_hold_as_often_as_promised(regressor, blocks, correlation):
    found = coverage(REGRESSORS[regressor], blocks, correlation, RUNS, seed=3)
    assert FEWEST <= found.holds <= MOST


@pytest.mark.parametrize("regressor", ["dies away over an eighth", "four, scattered"])
def test_intervals_of_what_few_blocks_report_hold(regressor):
    found = coverage(REGRESSORS[regressor], 24, 0.5, RUNS, seed=4)
    assert found.holds >= FEWEST


def test_beside_many_other_columns_intervals_hold():
    """Those others take most freedom of the residuals; by the binomial at 1e-3."""
    inside = 0
    for seed in range(RUNS // 2):
        parts = rows_in(16, columns=30, seed=seed, each=3)
        whole = parts.sum(axis=0)
        weight = np.linalg.solve(whole[:-1, :-1], whole[:-1, -1])[-1]
        inside += abs(weight) <= long_run(parts, 1).half_widths[0]
    assert binom.ppf(1e-3, RUNS // 2, 0.93) <= inside <= binom.ppf(1 - 1e-3, RUNS // 2, 0.99)


@pytest.mark.parametrize(("blocks", "freedom"), [(4, 1), (12, 2), (24, 3), (48, 5), (96, 8)])
def test_freedom_follows_from_the_number_of_blocks(blocks, freedom):
    rng = np.random.default_rng(1)
    assert long_run(parts_of(np.ones(blocks), rng.standard_normal(blocks)), 1).freedom == [freedom]


@pytest.mark.parametrize(("few", "freedom"), [(1, 0), (2, 1), (3, 2)])
def test_no_interval_rests_on_more_than_the_blocks_that_report(few, freedom):
    rng = np.random.default_rng(2)
    shown = np.isin(np.arange(48), [0, 20, 47][:few])
    found = long_run(parts_of(shown.astype(float), rng.standard_normal(48)), 1)
    assert found.freedom == [freedom]
    assert np.isinf(found.half_widths[0]) == (few == 1)
    assert found.stretches <= few


def test_one_block_among_quiet_ones_has_no_interval():
    """The others show a tenth of its information together."""
    rng = np.random.default_rng(3)
    loud = np.where(np.arange(24) == 7, 1.0, np.sqrt(0.1 / 23.0))
    found = long_run(parts_of(loud, rng.standard_normal(24)), 1)
    assert np.isinf(found.half_widths[0])


def test_what_nothing_excites_has_an_interval_of_nothing():
    parts = rows_in(24, columns=2)
    parts[:, 1] = parts[:, :, 1] = 0.0
    assert long_run(parts, 1).half_widths == [0.0]


def test_intervals_scale_with_the_numbers_and_have_no_sign():
    parts, scale = rows_in(24, columns=3), np.array([1.0, -30.0, 0.2, -7.0])
    before, after = long_run(parts, 3), long_run(parts * np.outer(scale, scale), 3)
    expected = before.half_widths * 7.0 / np.abs(scale[:-1])
    np.testing.assert_allclose(after.half_widths, expected, rtol=1e-6)
    np.testing.assert_allclose(after.stretches, before.stretches, rtol=1e-6)


def test_intervals_are_the_same_backwards_in_time():
    parts = rows_in(24, columns=3)
    before, after = long_run(parts, 3), long_run(parts[::-1], 3)
    for one, other in zip(before, after, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9)


def test_equal_blocks_are_those_of_the_published_estimator():
    """The mean's variance from amplitudes of cosines, by hand; larger by what correlation hides."""
    values, blocks = np.random.default_rng(5).standard_normal(24), 24
    found = long_run(parts_of(np.ones(blocks), values), 1)
    middle = (np.arange(blocks) + 0.5) / blocks
    waves = np.sqrt(2.0 / blocks) * np.cos(np.pi * np.outer([1, 2, 3], middle))
    variance = np.mean((waves @ values) ** 2) / blocks
    plain = t_distribution.ppf(0.975, 3) * np.sqrt(variance)
    assert 1.0 < found.half_widths[0] / plain < 1.2


@pytest.mark.parametrize(("correlation", "few"), [(0.0, False), (0.5, False), (0.97, True)])
def test_few_independent_stretches_are_told(correlation, few):
    seeds = range(100)
    told = [
        long_run(parts_of(np.ones(24), noise(np.random.default_rng(s), 24, correlation)), 1)
        for s in seeds
    ]
    assert bool(np.median([each.stretches[0] for each in told]) < FEWEST_STRETCHES) is few
    assert bool(np.mean([each.few_stretches[0] for each in told]) > 0.5) is few
    assert all(np.isfinite(each.half_widths[0]) for each in told)
