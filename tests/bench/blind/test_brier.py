"""The Brier score by bins, against the mean of squares of single findings."""

import numpy as np
import pytest

from bench.blind.scoring.brier import brier_of
from bench.blind.scoring.share import share


def test_it_is_the_mean_square_where_each_bin_has_one_probability():
    rng = np.random.default_rng(8)
    said = rng.choice([0.3, 0.6, 0.9], 200)
    right = rng.random(200) < said
    found = brier_of([(p, share(right[said == p])) for p in (0.3, 0.6, 0.9)])
    assert found.findings == 200
    assert found.score == pytest.approx(np.mean((said - right) ** 2))
    assert found.constant == pytest.approx(np.mean((right.mean() - right) ** 2))


def test_what_is_sure_and_right_scores_nothing_and_sure_and_wrong_all():
    assert brier_of([(1.0, share([True] * 3))]).score == 0.0
    assert brier_of([(1.0, share([False] * 3))]).score == 1.0
    assert brier_of([(0.5, share([]))]) is None
